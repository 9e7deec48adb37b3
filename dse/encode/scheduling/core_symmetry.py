"""The symmetry of equal cores: designs that differ in their numbers alone are searched once."""

from __future__ import annotations

from itertools import pairwise

from ortools.sat.python import cp_model

from dse.encode.literals import literal_of
from dse.encode.scheduling.threads import Places, Thread
from dse.space.core_symmetry import are_offered_in_order, interchangeable_cores
from dse.space.model.space import Space
from dse.support.timelimit import look_at_the_clock


def number_cores(space: Space, model: cp_model.CpModel, places: Places, processor: int) -> list[int]:
    """Interchangeable cores are numbered as their first threads stand in the file; returns the clauses that say so.

    Of two that follow each other in their class, the second needs an earlier thread on the first. Where some thread
    offers the cores of a class in another order than that of their numbers, none of its designs is left out.
    """
    threads = places.on(processor)
    clauses: list[int] = []
    never = -places.true - 1
    for cores in interchangeable_cores(space, processor, fixable=places.fixable):
        for former, core in pairwise(cores if are_offered_in_order(space, cores) else ()):
            for position, thread in enumerate(threads):
                here = _column(thread, processor, core, never)
                if here == never:
                    continue
                look_at_the_clock()
                before = [_column(other, processor, former, never) for other in threads[:position]]
                clause = model.add_bool_or([literal_of(model, index) for index in (-here - 1, *before)])
                clauses.append(clause.index)
    return clauses


def _column(thread: Thread, processor: int, core: int, never: int) -> int:
    """The literal of a thread's being on a core."""
    columns = thread.cores[processor]
    return columns[core - 1] if core <= len(columns) else never
