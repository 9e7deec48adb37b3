"""Demand rows of a bus: the time that messages due by some time need of it, in any order of transmission.

Whoever is the last of the messages S that are due by E ends at some t <= E, behind a frame of any message beside them,
and behind all others of S, with each of their jobs that comes until its last frame begins:

    longest frame beside S + sum over S of jobs(t) C + faults(t) (error frame + longest frame of S) <= t, some t <= E

A message k that is due later has no part in that unless it goes before the last of S for sure: it has a lower number
than some message of S. Then it adds C u, with u true where both have these numbers. (A literal for each E and number
says whether some message of S has a greater one: numbers that are kept form a chain.) The times up to E are cut into
intervals, of which one is chosen; jobs count as at its beginning, so that no design is lost. Messages whose bus is a
decision, or that have too many cases, are left out; where a sender queues messages as they come there are none (those
of a queue may wait for less than their identifiers say), nor where frames have several connections. The referee decides
(`dse.encode.messages.limits`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import floor
from typing import Any

from dse.analysis.messages.assignment import Candidate
from dse.analysis.messages.stages import (
    candidate_of,
    counted_buses,
    faults_on,
    identifier_range,
    is_each_alone,
    may_wait_for,
)
from dse.analysis.scheduling.busy_window import Task, most_jobs
from dse.analysis.scheduling.policies.executor_work import jobs_by
from dse.analysis.scheduling.policies.faults import with_frame
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.views import View, allowed_options, tabulate
from dse.encode.linear import EXACT_LIMIT, Board
from dse.space.model.space import EMPTY
from dse.space.model.trees import at, leaves
from dse.spec.schema.fields import MOST_IDENTIFIER
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact

MOST_CASES = 16
"""A message with more combinations of options than this is left out."""
MOST_TIMES = 24
"""The greatest number of due times of messages for which rows are made."""
MOST_STEPS = 6
"""The number of intervals that end where the jobs of the messages change last; a few even ones come before."""
EVEN = 4


@dataclass
class _Message:
    """A message that is on a bus in any design: its cases, each with a literal, and its identifiers, each with one."""

    number: int
    guard: Any
    cases: list[tuple[Any, Candidate]]
    numbers: list[tuple[Any, int]]

    @property
    def lowest(self) -> int:
        """The lowest identifier of the message; without identifiers the greatest possible one."""
        return min((number for _, number in self.numbers), default=MOST_IDENTIFIER)

    def is_due(self, time: Exact) -> list[tuple[Any, Candidate]]:
        """The cases in which it is due by then."""
        return [(literal, item) for literal, item in self.cases if item.limit_ns is not None and item.limit_ns <= time]


def add_rows(board: Board, limits: Iterable[tuple[int, int | None]]) -> None:
    """Rows for each bus and each of its types; `limits` are messages with a deadline and the guards of these."""
    space = board.space
    guards = dict(limits)
    for bus in counted_buses(space) if is_each_alone(space) else ():
        slot = space.buses[bus]
        if set(leaves(slot.broadcast)) != {False}:
            continue
        for option in allowed_options(space, slot.type_decision):
            given = {slot.type_decision: option}
            if slot.types[option] != EMPTY and "priority" in set(leaves(slot.arbitration)):
                _OnBus(board, bus, given, guards).add()


def add_waiting_rows(board: Board, number: int, least: Any, variable: Any, scale: int) -> None:
    """Rows that say how long a message waits at least, of a figure in 1 / `scale` ns that is `least` without waiting.

    Each message with a lower number goes before it with each job that comes until it begins: one at least, and as many
    as come while all that surely go before it are sent. The longest of the others has begun, or goes first, too.
    """
    space = board.space
    wire = space.connections[number]
    buses = set(leaves(wire.bus))
    if len(buses) != 1 or not is_each_alone(space):
        return
    (bus,) = buses
    if bus not in counted_buses(space) or set(leaves(space.buses[bus].broadcast)) != {False}:
        return
    slot = space.buses[bus]
    for option in allowed_options(space, slot.type_decision):
        given = {slot.type_decision: option}
        if slot.types[option] != EMPTY and "priority" in set(leaves(slot.arbitration)):
            _OnBus(board, bus, given, {}).add_waiting(number, least, variable, scale)


@dataclass
class _OnBus:
    board: Board
    bus: int
    given: dict[int, int]
    guards: dict[int, int | None]
    chain: dict[tuple[int, ...], dict[int, Any]] = field(default_factory=dict)
    faults: Task | None = None

    def add(self) -> None:
        """Rows for each time by which messages are due."""
        board, space = self.board, self.board.space
        ((decision, option),) = self.given.items()
        where = [board.options[decision][option]]
        ranges = tabulate(space, self._range, MOST_CASES, self.given)
        if ranges is None or len({case.value for case in ranges}) != 1 or ranges[0].value is None:
            return
        bit = ranges[0].value
        faults = tabulate(space, lambda view: faults_on(space, self.bus, view), MOST_CASES, self.given)
        self.faults = faults[0].value if faults is not None and len(faults) == 1 else None
        messages = [found for number in range(len(space.connections)) if (found := self._message(number)) is not None]
        times = sorted(
            {
                item.limit_ns
                for message in messages
                if message.number in self.guards
                for _, item in message.cases
                if item.limit_ns is not None
            }
        )
        for time in times if len(times) <= MOST_TIMES else times[:: -(-len(times) // MOST_TIMES)]:
            look_at_the_clock()
            self._add_time(messages, time, bit, where)

    def add_waiting(self, number: int, least: Any, variable: Any, scale: int) -> None:
        """Add the row of one message for this type of the bus."""
        board, space = self.board, self.board.space
        ((decision, option),) = self.given.items()
        ranges = tabulate(space, self._range, MOST_CASES, self.given)
        if ranges is None or len({case.value for case in ranges}) != 1 or ranges[0].value is None:
            return
        bit = ranges[0].value
        found = [made for one in range(len(space.connections)) if (made := self._message(one)) is not None]
        own = next((message for message in found if message.number == number), None)
        if own is None or not own.numbers:
            return
        others = [message for message in found if message is not own and message.numbers]
        highest = max(value for _, value in own.numbers)
        before = {message.number: self._goes_first(message, own) for message in others if message.lowest < highest}
        sure = [one for one in others if before.get(one.number) is board.true]
        window = sum(min(item.task.worst_ns for _, item in one.cases if item.task is not None) for one in sure) + bit
        parts = []
        for message in others:
            goes_first = before.get(message.number)
            if goes_first is None:
                continue
            for case, item in message.cases:
                assert item.task is not None
                work = floor(most_jobs(item.task, window) * item.task.worst_ns * scale)
                parts.append((work, board.all_of([goes_first, case])))
        if sum(work for work, _ in parts) >= EXACT_LIMIT:
            return
        maybe = [message for message in found if message is not own and before.get(message.number) is not board.true]
        blocker = max(maybe, key=_section, default=None)
        if blocker is not None:  # it has begun, or goes first, whatever its number
            behind = before.get(blocker.number, board.true.negated()).negated()
            parts.append((floor(_section(blocker) * scale), behind))
        form = sum(work * literal for work, literal in parts)
        board.model.add(variable >= least + form).only_enforce_if(board.options[decision][option])

    def _goes_first(self, other: _Message, own: _Message) -> Any:
        """A literal that is true only where the number of another message is lower than that of one; None: never."""
        board = self.board
        pairs = [(literal, mine) for literal, number in other.numbers for mine, value in own.numbers if number < value]
        if len(pairs) == 1 and all(literal.index == board.true.index for literal in pairs[0]):
            return board.true
        return board.any_of(board.all_of(pair) for pair in pairs) if pairs else None

    def _range(self, view: View) -> Exact | None:
        if at(self.board.space.buses[self.bus].arbitration, view) != "priority":
            return None
        return identifier_range(self.board.space, self.bus, view)[0]

    def _message(self, number: int) -> _Message | None:
        space, board = self.board.space, self.board
        item = space.connections[number]
        if set(leaves(item.bus)) != {self.bus} or self.bus not in may_wait_for(space, number):
            return None

        def formula(view: View) -> Candidate:
            (task,) = released_undelayed(space, view, [(number, "message")]).values()
            return candidate_of(space, self.bus, number, view, task)

        cases = tabulate(space, formula, MOST_CASES, self.given)
        if not cases or any(case.value.task is None for case in cases):
            return None
        guard = self.guards.get(number)
        numbers = board.short_table(lambda view: at(item.identifier, view), MOST_CASES)
        return _Message(
            number,
            None if guard is None else board.model.get_int_var_from_proto_index(guard),
            board.named(cases, self.given),
            [(literal, value) for literal, value in numbers or [] if isinstance(value, int)],
        )

    def _add_time(self, messages: Sequence[_Message], time: Exact, bit: Exact, where: Sequence[Any]) -> None:
        """Add one row for each interval of times up to `time`."""
        board = self.board
        due = [message for message in messages if message.number in self.guards and message.is_due(time)]
        beside = [message for message in messages if message not in due]
        needed = self._some_due(due, time)
        last = max(item.last_ns for message in due for _, item in message.is_due(time))
        ends = self._ends(due, time, last, bit)
        chosen = [board.true] if len(ends) == 1 else [board.model.new_bool_var("") for _ in ends]
        if len(ends) > 1:
            board.model.add_bool_or([*chosen, *(literal.negated() for literal in needed)])
        before = self._before(due, beside, time)
        blocker = max(beside, key=lambda message: (_section(message), message.lowest), default=None)
        scale = _scale([item for message in messages for _, item in message.cases])
        always = [_section(message) for message in due if len(message.is_due(time)) == len(message.cases)]
        faults = with_frame(self.faults, max(always, default=min(map(_section, due))))
        for (begin, end), literal in zip(ends, chosen, strict=True):
            hits = 0 if faults is None else jobs_by(faults, begin) * faults.worst_ns
            begun = 0 if blocker is None else _section(blocker)
            row = _Row(board, floor((begun + hits) * scale), floor(end * scale))
            for message in due:
                for case, item in message.is_due(time):
                    row.add(case, self._work(item, begin, last, bit, own=True), scale)
            for message in beside:
                if message.number in before:
                    least = min(self._work(item, begin, last, bit, own=False) for _, item in message.cases)
                    least -= _section(blocker) if message is blocker else 0
                    row.add(before[message.number], least, scale)
            row.demand([*where, *needed, literal])

    def _some_due(self, due: Sequence[_Message], time: Exact) -> list[Any]:
        """Literals that are true where all these limits are asked for, and one of the messages is due."""
        guards = [message.guard for message in due if message.guard is not None]
        if any(len(message.is_due(time)) == len(message.cases) for message in due):
            return guards
        return [*guards, self.board.any_of(case for message in due for case, _ in message.is_due(time))]

    def _ends(self, due: Sequence[_Message], time: Exact, last: Exact, bit: Exact) -> list[tuple[Exact, Exact]]:
        """Intervals of times up to this: jobs change at their beginnings, of the last ones nowhere else."""
        steps: set[Exact] = set()
        for message in due:
            for _, item in message.is_due(time):
                for stream in item.task.streams if item.task is not None else ():
                    jobs = (time - last + bit + stream.jitter_ns) // stream.period_ns
                    steps |= {
                        count * stream.period_ns - stream.jitter_ns - bit + last
                        for count in range(max(0, jobs - MOST_STEPS), jobs + 1)
                    }
        late = sorted(step for step in steps if 0 < step < time)[-MOST_STEPS:]
        first = late[0] if late else time
        points = {0, *(first * part // EVEN for part in range(1, EVEN)), *late, time}
        return list(pairwise(sorted(points)))

    def _work(self, item: Candidate, begin: Exact, last: Exact, bit: Exact, *, own: bool) -> Exact:
        """The least that a message takes before the last ends, at some time after `begin`; its `own` job alone, too."""
        assert item.task is not None
        if own and item.limit_ns is not None and begin < item.limit_ns:
            return item.task.worst_ns
        window = begin - last + bit  # that of the last one is longer
        return (jobs_by(item.task, window) if window >= 0 else 1) * item.task.worst_ns

    def _before(self, due: Sequence[_Message], beside: Sequence[_Message], time: Exact) -> dict[int, Any]:
        """A literal for each message in `beside`, true where it goes before the last message that is due."""
        board = self.board
        sure = [message for message in due if len(message.is_due(time)) == len(message.cases)]
        key = (*(message.number for message in sure), -1, *(message.number for message in beside))
        if key in self.chain:
            return self.chain[key]
        edges = sorted({number for message in beside for _, number in message.numbers})
        greater: dict[int, Any] = {}
        above: Any = None
        for position in reversed(range(len(edges))):
            edge = edges[position]
            until = edges[position + 1] if position + 1 < len(edges) else None
            here = [
                literal
                for message in sure
                for literal, number in message.numbers
                if number > edge and (until is None or number <= until)
            ]
            here += [] if above is None else [above]
            if here:
                above = board.any_of(here)
                greater[edge] = above
        found: dict[int, Any] = {}
        for message in beside:
            pairs = [(literal, greater[number]) for literal, number in message.numbers if number in greater]
            if pairs:
                found[message.number] = board.any_of(board.all_of(pair) for pair in pairs)
        self.chain[key] = found
        return found


class _Row:
    """constant + sum of coefficient * literal <= most."""

    def __init__(self, board: Board, constant: int, most: int) -> None:
        self.board, self.constant, self.most = board, constant, most
        self.parts: dict[int, tuple[Any, int]] = {}

    def add(self, literal: Any, work: Exact, scale: int) -> None:
        """Work where a literal is true, rounded down."""
        counted = floor(work * scale)
        if literal.index == self.board.true.index:
            self.constant += counted
        elif counted > 0:
            before = self.parts.get(literal.index, (literal, 0))[1]
            self.parts[literal.index] = literal, before + counted

    def demand(self, where: Sequence[Any]) -> None:
        """The row where all these literals are true."""
        total = sum(counted for _, counted in self.parts.values())
        if self.constant + total <= self.most or self.constant + total >= EXACT_LIMIT:
            return
        held = [literal for literal in where if literal.index != self.board.true.index]
        if self.constant > self.most:
            self.board.forbid(held)
            return
        form = sum(counted * literal for literal, counted in self.parts.values())
        self.board.model.add(form <= self.most - self.constant).only_enforce_if(held)


def _section(message: _Message) -> Exact:
    """The longest frame of a message, at least."""
    return min(item.section_ns for _, item in message.cases)


def _scale(items: Sequence[Candidate]) -> int:
    """Parts of a ns in which rows count: small numbers, and times of frames are mostly whole."""
    return 1 if all(isinstance(item.section_ns, int) for item in items) else 8
