"""Each thread as literals of a model: where it may run, how often and how long. Rows and reasons are written in these.

Literals are indices (negative ones negated), so that the same figures serve every copy of a model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.rates import NS_PER_S, is_event_triggered, rate_hz
from dse.analysis.scheduling.priorities import number_of, order_ns
from dse.analysis.scheduling.tasks import work_ns
from dse.analysis.views import View, allowed_options, tabulate
from dse.encode.linear import Board
from dse.encode.literals import Chosen
from dse.encode.rates import RateTable, RateVariables
from dse.space.architecture.joins import may_join
from dse.space.model.space import Component, Space
from dse.space.model.trees import Choice, at, leaves

Literals = tuple[tuple[int, Any], ...]
"""Literals, of which exactly one is true, with the value that each stands for."""


Turn = tuple[int, Fraction | None, Fraction]
"""A literal, and the time that orders a thread while it is true, and the thread's rate then."""
MOST_TURNS = 256
"""With more cases than this nothing is known of a thread's turn."""


@dataclass(frozen=True)
class Thread:
    """A thread that may run on a processor.

    `cores` has a literal for each core of each processor where it may be; `rates` its rates in Hz (None where they are
    too many to list); `modes` its rate in Hz where a timer dispatches it, else None; `turns` the time in ns that orders
    it (None: behind all others) with its rate, and `timers` the same with that of its timer (None where that is too
    much to list, or where it has a number); `worst` the longest time of a job in ns. `is_open`: its core is
    decided; `numbers` has its priorities where these are decided, else `priority` the stated one, or None. Where a
    callback runs beside the thread, or an executor or a reservation has it, it `is_odd`: rows leave it out.
    """

    number: int
    cores: dict[int, tuple[int, ...]]
    rates: Literals | None
    modes: Literals
    turns: tuple[Turn, ...] | None
    timers: tuple[tuple[int, Fraction | None, Fraction | None], ...]
    worst: Literals
    priority: int | None
    numbers: Literals
    is_open: bool
    is_odd: bool

    @property
    def is_numbered(self) -> bool:
        """Whether it has a priority as a number, stated or decided."""
        return self.priority is not None or bool(self.numbers)


class Places:
    """The threads of a space with their literals on a board."""

    def __init__(self, board: Board, rates: RateVariables) -> None:
        self.space = board.space
        self.fixable = board.fixable
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
        self.worst_at = {
            (processor, number, core): _worst_on(board.space, processor, number, core + 1)
            for processor, number in self.worst_on
            for core in range(len(self.threads[number].cores[processor]))
            if board.space.unequal_cores
        }
        self._chosen = Chosen.of_model(board.options, board.inactive)
        self.options = self._chosen.options

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
        return self._chosen.literal(decision, option)


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
    modes = tuple((literal.index, rate) for literal, rate in board.table(mode))
    priorities = set(leaves(component.priority))
    is_numbered = any(isinstance(item, int) for item in priorities)
    is_hybrid = "hybrid" in set(leaves(component.protocol)) and (
        component.callback_ns is not None or may_join(component)
    )
    return Thread(
        number=number,
        cores=cores,
        rates=None if table is None else tuple((literal.index, rate) for literal, rate in table),
        modes=modes,
        worst=tuple((literal.index, most) for literal, most in board.table(worst)),
        turns=None if is_numbered else _turns(board, table, number),
        timers=() if is_numbered else _timers(board, modes, mode, number),
        priority=component.priority if isinstance(component.priority, int) else None,
        numbers=_numbers(board, component) if is_numbered and len(priorities) > 1 else (),
        is_open=isinstance(component.core, Choice),
        is_odd=is_hybrid or bool(unknown) or not component.is_lone,
    )


def _numbers(board: Board, component: Component) -> Literals:
    return tuple((literal.index, found) for literal, found in board.table(lambda view: number_of(component, view)))


def _is_rate_monotonic(component: Component) -> bool:
    return set(leaves(component.priority)) <= {None, "rate_monotonic"}


def _turns(board: Board, table: RateTable | None, number: int) -> tuple[Turn, ...] | None:
    """The times that order a thread, with its rates; of a rate-monotonic one they follow from these."""
    if _is_rate_monotonic(board.space.components[number]):
        if table is None:
            return None
        return tuple((literal.index, NS_PER_S / rate if rate else None, rate) for literal, rate in table)

    def turn(view: View) -> tuple[Fraction | None, Fraction]:
        return order_ns(board.space, number, view), rate_hz(board.space, ("activation", number), view)

    found = board.short_table(turn, MOST_TURNS)
    return None if found is None else tuple((literal.index, *one) for literal, one in found)


def _timers(
    board: Board, modes: Literals, mode: Callable[[View], Fraction | None], number: int
) -> tuple[tuple[int, Fraction | None, Fraction | None], ...]:
    """The times that order a thread as far as they are known, with the rates of its timer."""
    if _is_rate_monotonic(board.space.components[number]):
        return tuple((index, NS_PER_S / rate if rate else None, rate) for index, rate in modes)

    def timer(view: View) -> tuple[Fraction | None, Fraction | None]:
        return order_ns(board.space, number, view), mode(view)

    found = board.short_table(timer, MOST_TURNS)
    if found is None:
        return tuple((index, None, rate) for index, rate in modes)
    return tuple((literal.index, *one) for literal, one in found)


def _worst_on(space: Space, processor: int, number: int, core: int | None = None) -> tuple[int, ...]:
    """For each type of the processor that may be chosen the least of a thread's longest times on it, or on a core."""
    slot, component = space.processors[processor], space.components[number]
    found = []
    for option in allowed_options(space, slot.type_decision):

        def on(view: View) -> int | None:
            if at(component.processor, view) != processor:
                return None
            if core is not None and at(component.core, view) not in (None, core):
                return None
            return work_ns(space, number, view)

        cases = tabulate(space, on, 10_000, {slot.type_decision: option}) or []
        found.append(min((case.value for case in cases if case.value is not None), default=0))
    return tuple(found)
