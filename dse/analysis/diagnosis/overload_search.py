"""A design whose overloaded processors are used as little as is found soon: an example of an overload.

Local search by single decisions, steepest first; the least is not promised.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import exact_sum
from dse.analysis.memo import consulted
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.scheduling.tasks import members, utilisation
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.space.model.space import Design
from dse.support.timelimit import in_time

MOST_TRIED = 1_000
"""The greatest number of designs that are looked at, about a second."""
Overuse: TypeAlias = tuple[Fraction, Fraction, Fraction]
"""By how much cores are used beyond all of them, the fullest core, and the squares of all: less is better."""


def lightened(
    evaluator: Evaluator, design: Design, processors: Collection[int], is_allowed: Callable[[Design], bool]
) -> Design:
    """A design that differs in single decisions one after the other and uses some processors, by number, less.

    Of the designs that are better those are taken that `is_allowed`.
    """
    left = MOST_TRIED
    known, overused = _overuse(evaluator, design, processors)
    while left > 0:
        lighter = []
        for other in in_time(_beside(evaluator, design, overused)):
            left -= 1
            overuse, _ = _overuse(evaluator, other, processors)
            if overuse < known:
                lighter.append((overuse, other))
        allowed = next((item for item in sorted(lighter) if is_allowed(item[1])), None)
        if allowed is None:
            return design
        design = allowed[1]
        known, overused = _overuse(evaluator, design, processors)
    return design


def _beside(evaluator: Evaluator, design: Design, overused: Collection[int]) -> Iterator[Design]:
    """The valid designs that differ in one of some decisions, and what is used or not because of it."""
    space = evaluator.space
    for decision in sorted(overused):
        for option in range(len(space.decisions[decision].options)):
            if option == design[decision]:
                continue
            made = tuple(option if at == decision else max(0, own) for at, own in enumerate(design))
            if not evaluator.invalid(made):
                yield canonical(space, made)


def _overuse(evaluator: Evaluator, design: Design, processors: Collection[int]) -> tuple[Overuse, frozenset[int]]:
    """How much cores are used, and the decisions on which that hangs."""
    space = evaluator.space

    def loads_of(view: View) -> Iterator[Fraction]:
        for processor in processors:
            cores = core_of_each(space, processor, view)
            used: dict[int, list[Fraction]] = {}
            for number in members(space, processor, view):
                used.setdefault(cores[number], []).append(utilisation(space, number, view))
            yield from map(exact_sum, used.values())

    loads, asked = consulted(View(design), lambda view: list(loads_of(view)))
    beyond = exact_sum(max(load - 1, Fraction(0)) for load in loads)
    overuse = beyond, max(loads, default=Fraction(0)), exact_sum(load * load for load in loads)
    return overuse, frozenset(asked)
