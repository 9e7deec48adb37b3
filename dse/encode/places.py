"""Where each thread may run, how often and how long, as literals of a model: what rows and reasons are written in.

Literals are indices (negative ones negated), so that the same figures serve every copy of a model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.rates import NS_PER_S, is_event_triggered
from dse.analysis.scheduling import work_ns
from dse.analysis.views import View, allowed_options, tabulate
from dse.encode.linear import Board
from dse.encode.rates import RateVariables
from dse.space.trees import Choice, at, leaves
from dse.space.types import Component, Space

Literals = tuple[tuple[int, Any], ...]
"""Literals, of which exactly one is true, with the value that each stands for."""


@dataclass(frozen=True)
class Thread:
    """A thread that may run on a processor.

    `cores` has a literal for each core of each processor where it may be; `rates` its rates in Hz (None where they are
    too many to list); `modes` its rate in Hz where a timer dispatches it, else None; `worst` the longest time of a job
    in ns. `is_open` tells whether its core is decided; `priority` is the stated one, or None; where that is itself
    decided, or a callback runs beside the thread, the thread `is_odd`: rows leave it out.
    """

    number: int
    cores: dict[int, tuple[int, ...]]
    rates: Literals | None
    modes: Literals
    worst: Literals
    priority: int | None
    is_open: bool
    is_odd: bool


class Places:
    """The threads of a space with their literals on a board."""

    def __init__(self, board: Board, rates: RateVariables) -> None:
        self.space = board.space
        self.true = board.true.index
        self.threads: dict[int, Thread] = {}
        self.types: list[tuple[int, ...]] = []
        for slot in board.space.processors:
            options = allowed_options(board.space, slot.type_decision)
            self.types.append(tuple(board.options[slot.type_decision][option].index for option in options))
        for number, component in enumerate(board.space.components):
            if component.processor is not None:
                self.threads[number] = _thread(board, rates, number, component)
        self.worst_on = {
            (processor, number): _worst_on(board.space, processor, number)
            for processor in range(len(board.space.processors))
            for number, thread in self.threads.items()
            if processor in thread.cores
        }
        self.options = [[literal.index for literal in literals] for literals in board.options]
        self.inactive = [literal.index if literal is not None else None for literal in board.inactive]

    def on(self, processor: int) -> list[Thread]:
        """The threads that may run on a processor, in the order of the file."""
        return [thread for thread in self.threads.values() if processor in thread.cores]

    def processor_of(self, number: int, view: View) -> int:
        """The processor of a thread in a design."""
        return int(at(self.space.components[number].processor, view))

    def cores_of(self, processor: int, threads: Sequence[int]) -> list[list[int]]:
        """For each core of a processor on which all of these threads may be, the literals of their being there."""
        columns = [self.threads[number].cores[processor] for number in threads]
        return [list(row) for row in zip(*columns, strict=False)]

    def chosen(self, decision: int, option: int) -> int:
        """The literal of an option, or of the decision's being inactive."""
        if option < 0:
            index = self.inactive[decision]
            assert index is not None
            return index
        return self.options[decision][option]


def _thread(board: Board, rates: RateVariables, number: int, component: Component) -> Thread:
    def place(view: View) -> tuple[int | None, int | None]:
        processor = at(component.processor, view)
        return processor, at(component.core, view)

    def mode(view: View) -> Fraction | None:
        if is_event_triggered(component, view):
            return None
        return Fraction(NS_PER_S, at(component.period_ns, view))

    def worst(view: View) -> int:
        return work_ns(board.space, number, view)

    counts = {
        slot: max([1, *leaves(board.space.processors[slot].cores)])
        for slot in set(leaves(component.processor)) - {None}
    }
    found: dict[int, list[Any]] = {}
    cores: dict[int, tuple[int, ...]] = {}
    unknown = set()
    for literal, (processor, core) in board.table(place):
        if processor is None:
            continue
        if core is None and counts[processor] > 1 and component.core is None:
            unknown.add(processor)
            continue
        if core is not None and core > counts[processor]:  # of another processor with more cores: no design has it
            continue
        found.setdefault(processor, [[] for _ in range(counts[processor])])[(core or 1) - 1].append(literal)
    for processor, columns in found.items():
        if processor not in unknown:
            cores[processor] = tuple(board.any_of(literals).index for literals in columns)
    table = rates.tables.table(("activation", number))
    priorities = set(leaves(component.priority))
    is_hybrid = "hybrid" in set(leaves(component.protocol)) and component.callback_ns is not None
    return Thread(
        number=number,
        cores=cores,
        rates=None if table is None else tuple((literal.index, rate) for literal, rate in table),
        modes=tuple((literal.index, rate) for literal, rate in board.table(mode)),
        worst=tuple((literal.index, most) for literal, most in board.table(worst)),
        priority=component.priority if not isinstance(component.priority, Choice) else None,
        is_open=isinstance(component.core, Choice),
        is_odd=len(priorities) > 1 or is_hybrid or bool(unknown),
    )


def _worst_on(space: Space, processor: int, number: int) -> tuple[int, ...]:
    """For each type of the processor that may be chosen the least of a thread's longest times on it."""
    slot, component = space.processors[processor], space.components[number]
    found = []
    for option in allowed_options(space, slot.type_decision):

        def on(view: View) -> int | None:
            if at(component.processor, view) != processor:
                return None
            return work_ns(space, number, view)

        cases = tabulate(space, on, 10_000, {slot.type_decision: option}) or []
        found.append(min((case.value for case in cases if case.value is not None), default=0))
    return tuple(found)
