"""The symmetry of equal cores: designs that differ in their numbers alone are searched once."""

from __future__ import annotations

from typing import Any

from ortools.sat.python import cp_model

from dse.encode.places import Places
from dse.space.cores import numbers_of
from dse.space.metrics import by_first_fit
from dse.space.types import Space
from dse.timelimit import look_at_the_clock


def _are_equal(space: Space, processor: int, one: int, other: int) -> bool:
    """Whether two cores (from 1) are in one group, whatever type the processor has."""
    slot = space.processors[processor]
    groups = [
        {group for group, _ in named if {one, other} & set(numbers_of(slot, type_name, group))}
        for type_name, named in slot.groups.items()
    ]
    return all(len(found) == 1 for found in groups)


def number_cores(space: Space, model: cp_model.CpModel, places: Places, processor: int) -> None:
    """Equal cores are numbered as their first threads stand in the file: core c + 1 needs an earlier thread on core c.

    Only where nothing tells cores apart: each thread of the processor may be on each of them, and none has its core by
    first-fit, which goes through them by their numbers.
    """
    threads = places.on(processor)
    if any(by_first_fit(space, processor)):
        return
    fixed = {number for item in space.open_cores if item.index in places.fixable for number in item.threads}
    counts = {len(thread.cores[processor]) for thread in threads}
    every = set(range(1, max(counts, default=0) + 1))  # a list of the first few is no choice among all
    partial = {item.component for item in space.open_cores if not every <= set(item.decision.values)}
    if len(counts) != 1 or any(
        not thread.is_open or thread.number in fixed or thread.number in partial for thread in threads
    ):
        return

    def literal(index: int) -> Any:
        found = model.get_int_var_from_proto_index(index if index >= 0 else -index - 1)
        return found if index >= 0 else found.negated()

    never = -places.true - 1
    count = counts.pop()
    for core in (core for core in range(1, count) if _are_equal(space, processor, core, core + 1)):
        for position, thread in enumerate(threads):
            here = thread.cores[processor][core]
            if here == never:
                continue
            look_at_the_clock()
            before = [other.cores[processor][core - 1] for other in threads[:position]]
            model.add_bool_or([literal(-here - 1), *(literal(index) for index in before)])
