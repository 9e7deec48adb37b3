"""Demand rows of a bus: the time that messages due by some time need of it, in any order of transmission.

Whoever is the last of the messages S that are due by E ends at some t <= E, behind a frame of any message beside them,
and behind all others of S, with each of their jobs that comes until its last frame begins:

    longest frame beside S + sum over S of jobs(t) C + faults(t) <= t        for some t <= E

(faults(t) is what those of the wire cost until then: an error frame and the longest frame of S each.)

A message k that is due later has no part in that unless it goes before the last of S for sure: it has a lower number
than some message of S, or the order says so of messages whose waiting a figure counts
(`dse.encode.messages.waiting`). Then it adds C u, with u true where that is so. (A literal for each E and number says
whether some message of S has a greater one: numbers that are kept form a chain.) The times up to E are cut into
intervals, of which one is chosen; jobs count as at its beginning, so that no design is lost. Messages whose bus is a
decision, or that have too many cases, are left out; where a sender queues messages as they come there are none (those
of a queue may wait for less than their identifiers say). A message that may carry others is due as soon as one of them
is, and what they add has a literal for each of them (`dse.encode.messages.frames`). The referee decides
(`dse.encode.messages.limits`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from math import floor
from typing import Any

from dse.analysis.binding import frame_numbers
from dse.analysis.messages.assignment import Candidate
from dse.analysis.messages.frames import apart, has_own_message, longest_frame_ns
from dse.analysis.messages.stages import (
    candidate_of,
    counted_buses,
    faults_on,
    identifier_range,
    is_comparable,
    limit_ns,
    may_wait_for,
)
from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.policies.executor_work import jobs_by
from dse.analysis.scheduling.policies.faults import ERROR_BITS
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.views import PartialView, View, allowed_options, tabulate
from dse.encode.linear import Board, Given
from dse.encode.messages.capped_sums import Row
from dse.encode.messages.frames import Rider, due_riders, own_literal, riders_of
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
class Sent:
    """A message that is on a bus in any design: its cases, each with a literal, and its identifiers, each with one.

    One that may be carried in another's is there where its literal `own` is true; `riders` are what may be carried in
    it, and `longest_ns` is the time of its frame with all that. Its limits are those under `guards`.
    """

    number: int
    guards: list[Any]
    cases: list[tuple[Any, Candidate]]
    numbers: list[tuple[Any, int]]
    own: Any
    riders: list[Rider]
    longest_ns: Exact

    @property
    def lowest(self) -> int:
        """The lowest identifier of the message; without identifiers the greatest possible one."""
        return min((number for _, number in self.numbers), default=MOST_IDENTIFIER)

    def is_due(self, time: Exact) -> list[tuple[Any, Candidate]]:
        """The cases in which it is due by then."""
        return [(literal, item) for literal, item in self.cases if item.limit_ns is not None and item.limit_ns <= time]

    def is_always_due(self, time: Exact) -> bool:
        """Whether it is due by then in all its cases, whatever is carried in it."""
        return len(self.is_due(time)) == len(self.cases)

    def last_ns(self, time: Exact) -> Exact:
        """The longest time of its last frame where it is due by then."""
        return self.longest_ns if self.riders else max(item.last_ns for _, item in self.is_due(time))

    def may_be_due(self, time: Exact, limited: Mapping[int, int | None]) -> bool:
        """Whether it is due by then in some case, or with something that is carried in it."""
        return bool(self.is_due(time)) or any(True for _ in due_riders(self.riders, time, limited))


def add_rows(board: Board, limits: Iterable[tuple[int, int | None]]) -> None:
    """Rows for each bus and each of its types; `limits` are messages with a deadline and the guards of these."""
    space = board.space
    guards = dict(limits)
    for bus in counted_buses(space) if is_comparable(space) else ():
        slot = space.buses[bus]
        if set(leaves(slot.broadcast)) != {False}:
            continue
        for option in allowed_options(space, slot.type_decision):
            given = {slot.type_decision: option}
            if slot.types[option] != EMPTY and "priority" in set(leaves(slot.arbitration)):
                BusRows(board, bus, given, guards).add()


@dataclass
class BusRows:
    """The rows of a bus with one of its types; `guards` are those of the messages with a deadline."""

    board: Board
    bus: int
    given: dict[int, int]
    guards: dict[int, int | None]
    chain: dict[tuple[int, ...], dict[int, Any]] = field(default_factory=dict)

    def add(self) -> None:
        """Rows for each time by which messages are due."""
        board, space = self.board, self.board.space
        ((decision, option),) = self.given.items()
        where, bit = [board.options[decision][option]], self.bit_ns()
        if bit is None:
            return
        messages = [found for number in range(len(space.connections)) if (found := self.message(number)) is not None]
        limits = [item.limit_ns for message in messages for _, item in message.cases]
        limits += [rider.limit_ns for message in messages for rider in message.riders if rider.number in self.guards]
        times = sorted({limit for limit in limits if limit is not None})
        for time in times if len(times) <= MOST_TIMES else times[:: -(-len(times) // MOST_TIMES)]:
            look_at_the_clock()
            self._add_time(messages, time, bit, where)

    def bit_ns(self) -> Exact | None:
        """The time of a bit where identifiers decide; None where that is not sure, or not known."""
        bits = self.bits_ns()
        return bits.pop() if bits is not None and len(bits) == 1 else None

    def bits_ns(self) -> set[Exact | None] | None:
        """The times of a bit in all cases, None where identifiers do not decide; None where cases are too many."""
        ranges = tabulate(self.board.space, self._range, MOST_CASES, self.given)
        return None if ranges is None else {case.value for case in ranges}

    def _range(self, view: View) -> Exact | None:
        if at(self.board.space.buses[self.bus].arbitration, view) != "priority":
            return None
        return identifier_range(self.board.space, self.bus, view)[0]

    def message(self, number: int) -> Sent | None:
        """A message that is on the bus in any design; None where it has too many cases, or may be elsewhere."""
        space, board = self.board.space, self.board
        item = space.connections[number]
        if set(leaves(item.bus)) != {self.bus} or self.bus not in may_wait_for(space, number):
            return None
        if not has_own_message(space, number):
            return None
        given = apart(space, number, self.given)
        always = frame_numbers(space, item, PartialView({**space.fixed, **given})) if item.riders else [number]
        limited = [one for one in always if one in self.guards]

        def formula(view: View) -> Candidate:
            (task,) = released_undelayed(space, view, [(number, "message")]).values()
            limits = [limit for one in limited if (limit := limit_ns(space, self.bus, one, view)) is not None]
            made = candidate_of(space, self.bus, number, view, task)
            return replace(made, limit_ns=min(limits, default=None))

        cases = tabulate(space, formula, MOST_CASES, given)
        if not cases or any(case.value.task is None for case in cases):
            return None
        own, riders = own_literal(board, number), riders_of(board, self.bus, number, given)
        full = tabulate(space, lambda view: longest_frame_ns(space, self.bus, view), MOST_CASES, given) or []
        ends = [case.value for case in full if case.value is not None]
        longest = max(case.value.last_ns for case in cases) + sum(rider.extra_ns for rider in riders)
        guards = [guard for one in limited if (guard := self.guards[one]) is not None]
        return Sent(
            number,
            [board.model.get_int_var_from_proto_index(guard) for guard in guards],
            board.named(cases, given),
            self.numbered(number, given),
            own,
            riders,
            max(ends) if riders and len(ends) == len(full) > 0 else longest,
        )

    def numbered(self, number: int, given: Given) -> list[tuple[Any, int]]:
        """The identifiers of a message of its own that are known, each with a literal that it is there with that."""
        board = self.board
        own, numbers = own_literal(board, number), self._numbers(number, given)
        return [(board.all_of([own, literal]), value) for literal, value in numbers or () if isinstance(value, int)]

    def _numbers(self, number: int, given: Given) -> list[tuple[Any, Any]] | None:
        """The identifiers that a message of its own may have, each with a literal."""
        item = self.board.space.connections[number]
        if item.carried_in is None:
            return self.board.short_table(lambda view: at(item.identifier, view), MOST_CASES)
        cases = tabulate(self.board.space, lambda view: at(item.identifier, view), MOST_CASES, given)
        return None if cases is None else self.board.named(cases, given)

    def _add_time(self, messages: Sequence[Sent], time: Exact, bit: Exact, where: Sequence[Any]) -> None:
        """Add one row for each interval of times up to `time`."""
        board = self.board
        due = [message for message in messages if message.may_be_due(time, self.guards)]
        beside = [message for message in messages if message not in due]
        needed = self._some_due(due, time)
        last = max(message.last_ns(time) for message in due)
        ends = self._ends(due, time, last, bit)
        chosen = [board.true] if len(ends) == 1 else [board.model.new_bool_var("") for _ in ends]
        if len(ends) > 1:
            board.model.add_bool_or([*chosen, *(literal.negated() for literal in needed)])
        before = self._before(due, beside, time)
        blocker = max(beside, key=lambda message: (section_ns(message), message.lowest), default=None)
        scale = _scale([item for message in messages for _, item in message.cases])
        blocked = self._blocked([message for message in beside if message.number not in before], scale, where)
        blocker = blocker if blocked is None else None
        counted = [self._due_parts(message, time) for message in due]
        for (begin, end), literal in zip(ends, chosen, strict=True):
            row = Row(board, floor(self._faulty(due, time, begin, bit) * scale), floor(end * scale), blocked)
            if blocker is not None:
                row.add(blocker.own, section_ns(blocker), scale)
            for cases, riders in counted:
                works = [self._work(item, begin, last, bit, own=True) for _, item in cases]
                for (case, _), work in zip(cases, works, strict=True):
                    row.add(case, work, scale)
                jobs = min(_jobs(item, work) for work, (_, item) in zip(works, cases, strict=True))
                for rider, extra_ns in riders:
                    row.add(rider, jobs * extra_ns, scale)
            for message in beside:
                if message.number in before:
                    least = min(self._work(item, begin, last, bit, own=False) for _, item in message.cases)
                    least -= section_ns(blocker) if message is blocker else 0
                    row.add(before[message.number], least, scale)
            row.demand([*where, *needed, literal])

    @cached_property
    def faults(self) -> list[Task]:
        """The faults of the wire in each of several ways; none where there may be none."""
        cases = tabulate(self.board.space, partial(faults_on, self.board.space, self.bus), MOST_CASES, self.given)
        known = [case.value for case in cases or () if case.value is not None]
        return known if len(known) == len(cases or ()) else []

    def _faulty(self, due: Sequence[Sent], time: Exact, begin: Exact, bit: Exact) -> Exact:
        """The least that faults cost until some time after `begin`: an error frame each, and a frame due by `time`."""
        sure = [one for one in due if one.is_always_due(time) and one.own is self.board.true]
        hit = max(map(section_ns, sure), default=min(map(section_ns, due)))
        return min((jobs_by(faults, begin) for faults in self.faults), default=0) * (ERROR_BITS * bit + hit)

    def _blocked(self, beside: Sequence[Sent], scale: int, where: Sequence[Any]) -> tuple[Any, int] | None:
        """A variable that is as long as the longest of some frames at least, and its greatest value.

        In 1 / `scale` ns, where all the literals in `where` are true; None where nothing may be carried in the frames,
        whose lengths are known then.
        """
        if not any(message.riders for message in beside):
            return None
        model, most = self.board.model, floor(max(message.longest_ns for message in beside) * scale)
        variable = model.new_int_var(0, most, "")
        for message in beside:
            form = floor(section_ns(message) * scale) * message.own
            form += sum(floor(rider.extra_ns * scale) * rider.literal for rider in message.riders)
            model.add(variable >= form).only_enforce_if(where)
        return variable, most

    def _due_parts(self, message: Sent, time: Exact) -> tuple[list[tuple[Any, Candidate]], list[tuple[Any, Exact]]]:
        """The cases of a message in which it is due by a time, and what is carried in it then, each with a literal."""
        board = self.board
        by_rider = [rider.literal for rider in due_riders(message.riders, time, self.guards)]
        if message.is_always_due(time):
            is_due = message.own
        elif by_rider:
            cases = [board.all_of([message.own, case]) for case, _ in message.is_due(time)]
            is_due = board.any_of([*cases, *by_rider])
            cases = [(board.all_of([is_due, case]), item) for case, item in message.cases]
            return cases, [(board.all_of([is_due, one.literal]), one.extra_ns) for one in message.riders]
        else:
            is_due = board.any_of(case for case, _ in message.is_due(time))
        cases = [(board.all_of([message.own, case]), item) for case, item in message.is_due(time)]
        return cases, [(board.all_of([is_due, one.literal]), one.extra_ns) for one in message.riders]

    def _some_due(self, due: Sequence[Sent], time: Exact) -> list[Any]:
        """Literals that are true where all these limits are asked for, and one of the messages is due."""
        limited = [guard for message in due for guard in message.guards]
        for rider in (rider for message in due for rider in due_riders(message.riders, time, self.guards)):
            guard = self.guards[rider.number]
            limited += [] if guard is None else [self.board.model.get_int_var_from_proto_index(guard)]
        guards = list({guard.index: guard for guard in limited}.values())
        if any(message.is_always_due(time) for message in due):
            return guards
        return [*guards, self.board.any_of(case for message in due for case, _ in message.is_due(time))]

    def _ends(self, due: Sequence[Sent], time: Exact, last: Exact, bit: Exact) -> list[tuple[Exact, Exact]]:
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
        if own and (item.limit_ns is None or begin < item.limit_ns):
            return item.task.worst_ns
        window = begin - last + bit  # that of the last one is longer
        return (jobs_by(item.task, window) if window >= 0 else 1) * item.task.worst_ns

    def _before(self, due: Sequence[Sent], beside: Sequence[Sent], time: Exact) -> dict[int, Any]:
        """A literal for each message in `beside`, true where it goes before the last message that is due."""
        board = self.board
        sure = [message for message in due if message.is_always_due(time)]
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
            ways = [board.all_of(pair) for pair in pairs]
            ways += [literal for own in sure for literal in self._ordered(message.number, own.number)]
            if ways:
                found[message.number] = board.any_of(ways)
        self.chain[key] = found
        return found

    def _ordered(self, first: int, second: int) -> list[Any]:
        """Literals that are true only where one message goes before another, of those whose waiting a figure counts."""
        known, opposite = (self.board.before.get(pair) for pair in ((first, second), (second, first)))
        return [*([] if known is None else [known]), *([] if opposite is None else [opposite.negated()])]


def _jobs(item: Candidate, work: Exact) -> int:
    """How many jobs of a message such work is."""
    assert item.task is not None
    return int(work // item.task.worst_ns)


def section_ns(message: Sent) -> Exact:
    """The longest frame of a message, at least."""
    return min(item.section_ns for _, item in message.cases)


def _scale(items: Sequence[Candidate]) -> int:
    """Parts of a ns in which rows count: small numbers, and times of frames are mostly whole."""
    return 1 if all(isinstance(item.section_ns, int) for item in items) else 8
