"""Designs with the same figures whose threads use less of their cores.

An optimum of a model that knows nothing of where threads run (`dse.encode.scheduling.contention`) may fill its
processors to the brim, as nothing tells it not to. Others that have the same figures leave more room, and cores are
found for them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ortools.sat.python import cp_model

from dse.analysis.rates import NS_PER_S
from dse.analysis.views import View
from dse.encode.literals import literal_of
from dse.encode.model import EncodedSpace
from dse.encode.scheduling.threads import Places
from dse.space.model.space import Design
from dse.space.model.trees import at

PPM = 10**6


def least_used(encoded: EncodedSpace, design: Design, point: Sequence[int]) -> cp_model.CpModel:
    """A model of the designs with the objectives `point` and the processors of `design`, the least used first.

    What counts is the sum of what threads use of the processors on which they run in `design`, in ppm; rates that are
    too many to list do not, nor do threads that first-fit places there.
    """
    assert encoded.contention is not None, "nothing is asked about response times"
    places = encoded.contention.places
    model = encoded.model.clone()
    model.clear_objective()
    model.clear_hints()
    for objective, value in zip(encoded.objectives, point, strict=True):
        model.add(literal_of(model, objective.variable.index) == value)
    for slot in places.space.processors:
        chosen = places.chosen(slot.type_decision, design[slot.type_decision])
        model.add_bool_and([literal_of(model, chosen)])
    terms = list(_terms(places, View(design)))
    model.minimize(
        cp_model.LinearExpr.weighted_sum([literal_of(model, index) for index, _ in terms], [use for _, use in terms])
    )
    return model


def _terms(places: Places, view: View) -> Iterator[tuple[int, int]]:
    """Literals of rates with what a thread uses of its processor while they are true, in ppm."""
    for number, thread in places.threads.items():
        processor = places.processor_of(number, view)
        if (processor, number) not in places.worst_on:
            continue
        slot = places.space.processors[processor]
        chosen = places.chosen(slot.type_decision, view.design[slot.type_decision])
        worst = places.worst_on[processor, number][places.types[processor].index(chosen)]
        cores = max(1, int(at(slot.cores, view)))
        for index, rate in thread.rates or ():
            use = int(worst * rate * PPM / (NS_PER_S * cores))
            if use:
                yield index, use
