"""Demand rows of a bus in the second proof: the time that messages due by some time need of it, in any order.

Of messages that are all due by some time E the last ends by then, after each job of the others that comes until
it begins, of those with a number before it, too, and after a frame of one more. A message that may carry others is due
as soon as one of these is. For each E numbers are gone through from the greatest down: once a message that is due has
one, whatever has a lower one goes before the last that is due. One of several intervals holds that end.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, pairwise
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.binding import frame_numbers
from dse.analysis.messages.assignment import Candidate
from dse.analysis.messages.frames import added, apart, has_own_message, longest_frame_ns
from dse.analysis.messages.stages import (
    candidate_of,
    counted_buses,
    faults_on,
    identifier_range,
    is_comparable,
    limit_ns,
)
from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.policies.faults import ERROR_BITS
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.views import PartialView, View, tabulate
from dse.space.model.space import Space
from dse.space.model.trees import Choice, at, leaves
from dse.support.units import Exact

MOST_CASES = 16
"""A message with more combinations of options than this has no part in rows."""
FINE = 8
"""Rows count in parts of a ns."""
LATEST = 8
"""The number of last arrivals before the end that are looked at one by one."""
EARLIER = 4
"""The number of parts into which the time before the last arrivals is divided."""


class BusRows:
    """The rows of all buses in a model; `chosen` are the variables of its decisions.

    `limited` are the messages that must meet the deadline of their connection.
    """

    def __init__(self, space: Space, model: cp_model.CpModel, chosen: Sequence[Any], limited: Collection[int]) -> None:
        self.space, self.model, self.chosen = space, model, chosen
        self.limited = limited
        self._literals: dict[tuple[int, int], Any] = {}
        for bus in counted_buses(space) if self.limited else ():
            for kind, wire, messages in self.by_type(bus):
                self._add_times(kind, wire, messages)

    def _is(self, decision: int, option: int) -> Any:
        """A literal that is true exactly where a decision has an option."""
        if (decision, option) not in self._literals:
            made = self._literals[decision, option] = self.model.new_bool_var("")
            if len(self.space.decisions[decision].options) == 2:
                self.model.add(self.chosen[decision] == (made if option else 1 - made))
                return made
            self.model.add(self.chosen[decision] == option).only_enforce_if(made)
            self.model.add(self.chosen[decision] != option).only_enforce_if(made.negated())
        return self._literals[decision, option]

    def _where(self, conditions: Sequence[tuple[int, int]]) -> Any:
        """A literal that is true where all these options are chosen; None where that is always so."""
        if not conditions:
            return None
        if len(conditions) == 1:
            return self._is(*conditions[0])
        made = self.model.new_bool_var("")
        self.model.add_bool_or([made, *(self._is(*item).negated() for item in conditions)])
        return made

    def by_type(self, bus: int) -> Iterator[tuple[Any, _Wire, list[Sent]]]:
        """For each type of a bus on which numbers decide its literal, its wire, and the messages always on it."""
        space, slot = self.space, self.space.buses[bus]
        if set(leaves(slot.broadcast)) != {False} or not is_comparable(space):
            return
        for option in range(len(slot.types)):
            given = {slot.type_decision: option}
            if (bit := self._bit(bus, given)) is not None:
                found = (self._message(bus, number, given) for number in range(len(space.connections)))
                faults = tabulate(space, partial(faults_on, space, bus), MOST_CASES, given) or []
                sure = [case.value for case in faults if case.value is not None]
                wire = _Wire(bit, sure if len(sure) == len(faults) else [])
                yield self._is(slot.type_decision, option), wire, [one for one in found if one]

    def _bit(self, bus: int, given: dict[int, int]) -> Exact | None:
        """The time of a bit, in ns, where numbers decide on a bus of a type; None where that is not sure."""
        space, slot = self.space, self.space.buses[bus]

        def bit_of(view: View) -> Exact | None:
            is_counted = at(slot.arbitration, view) == "priority"
            return identifier_range(space, bus, view)[0] if is_counted else None

        bits = tabulate(space, bit_of, MOST_CASES, given) or []
        return bits[0].value if len({case.value for case in bits}) == 1 else None

    def _add_times(self, kind: Any, wire: _Wire, messages: Sequence[Sent]) -> None:
        times = {item.limit_ns for one in messages for _, item in one.cases}
        for time in sorted(time for time in times if time is not None):
            self._add_time(messages, time, wire, kind)

    def _message(self, bus: int, number: int, given: dict[int, int]) -> Sent | None:
        space, wire = self.space, self.space.connections[number]
        if set(leaves(wire.bus)) != {bus} or not has_own_message(space, number):
            return None
        alone = apart(space, number, given)
        own = [
            item
            for item in alone.items()
            if isinstance(wire.carried_in, Choice) and item[0] == wire.carried_in.decision
        ]
        members = frame_numbers(space, wire, PartialView({**space.fixed, **alone})) if wire.riders else [number]

        def formula(view: View) -> Candidate:
            (task,) = released_undelayed(space, view, [(number, "message")]).values()
            due = [limit_ns(space, bus, one, view) for one in members if one in self.limited]
            limit = min((item for item in due if item is not None), default=None)
            return replace(candidate_of(space, bus, number, view, task), limit_ns=limit)

        cases = tabulate(space, formula, MOST_CASES, alone) or []
        if not cases or any(case.value.task is None for case in cases):
            return None
        numbers = tabulate(space, lambda view: at(wire.identifier, view), MOST_CASES, alone if own else None) or []
        riders = [(one, case) for one in wire.riders for case in added(space, bus, number, one, alone)]
        full = [case.value for case in tabulate(space, partial(longest_frame_ns, space, bus), MOST_CASES, alone) or ()]
        longest = max(case.value.last_ns for case in cases)
        ends = [item for item in full if item is not None]
        whole = (
            max(ends) if ends and len(ends) == len(full) else longest + sum(case.value.extra_ns for _, case in riders)
        )
        return Sent(
            number,
            [(self._where(case.conditions), case.value) for case in cases],
            [(self._where([*own, *case.conditions]), case.value) for case in numbers if isinstance(case.value, int)],
            self._where(own),
            [
                _Carried(
                    self._where(case.conditions),
                    case.value.extra_ns,
                    case.value.limit_ns if one in self.limited else None,
                )
                for one, case in riders
            ],
            whole if riders else longest,
        )

    def _add_time(self, messages: Sequence[Sent], time: Exact, wire: _Wire, kind: Any) -> None:
        due = [one for one in messages if one.is_due(time) or one.carried_until(time)]
        others = [one for one in messages if one not in due]
        if not any(one.is_due(time) for one in due):
            return
        before = self._before([one for one in due if one.is_due(time)], others)
        last = max(one.longest_ns for one in due)
        frame = max((one.frame_ns for one in others), default=0)
        alike = [one for one in others if one.frame_ns == frame]
        blocker = max(alike, key=lambda one: (one.number not in before, one.number), default=None)
        open_frames = [one for one in others if one.number not in before]
        blocked = None
        if any(one.own is not None or one.carried for one in others):
            blocked, frame, blocker = self._longest_of(open_frames, kind), 0, None
        there = [self._there(one, time) for one in due]
        sure = [one.frame_ns for one in due if one.is_due(time) and one.own is None]
        hit, bit = max(sure, default=min(one.frame_ns for one in due)), wire.bit_ns
        parts = []
        for begin, end in _intervals(due, time, last, bit):
            row: list[tuple[Any, int]] = [(None, int(frame * FINE) + int(wire.faulty_ns(begin, hit) * FINE))]
            for one, present in zip(due, there, strict=True):
                is_due = one.is_due(time)
                works = [_work(item, begin, last, bit, time) if is_due else _one_job(item) for _, item in one.cases]
                row += [(literal, int(work * FINE)) for (literal, _), work in zip(present.cases, works, strict=True)]
                jobs = min(int(work / _one_job(item)) for (_, item), work in zip(one.cases, works, strict=True))
                row += [(literal, int(extra * FINE) * jobs) for literal, extra in present.carried]
            for one in others:
                if one.number in before:
                    least = min(_work(item, begin, last, bit, 0) for _, item in one.cases)
                    row.append((before[one.number], int((least - (frame if one is blocker else 0)) * FINE)))
            constant = sum(work for literal, work in row if literal is None)
            part = self.model.new_bool_var("")
            form: Any = sum(work * literal for literal, work in row if literal is not None)
            form = form if blocked is None else form + blocked
            self.model.add(form + constant <= int(end * FINE)).only_enforce_if([kind, part])
            parts.append(part)
        self.model.add_bool_or([*parts, kind.negated()])

    def both(self, one: Any, other: Any) -> Any:
        """A literal that is true where both are; None: always."""
        if one is None or other is None:
            return other if one is None else one
        made = self.model.new_bool_var("")
        self._implies([one, other], made)
        return made

    def _there(self, one: Sent, time: Exact) -> _There:
        """A message where it is sent and due by then, be it for what is carried in it."""
        if one.is_due(time):
            cases = [(self.both(one.own, literal), item) for literal, item in one.cases]
            return _There(cases, [(item.literal, item.extra_ns) for item in one.carried])
        until = one.carried_until(time)
        present = self.model.new_bool_var("")
        for item in until:
            self._implies([item.literal], present)
        return _There(
            [(self.both(present, literal), item) for literal, item in one.cases],
            [
                (item.literal if item in until else self.both(present, item.literal), item.extra_ns)
                for item in one.carried
            ],
        )

    def _longest_of(self, messages: Sequence[Sent], kind: Any) -> Any:
        """What the longest of these messages takes at least, as a variable."""
        found = self.model.new_int_var(0, int(max((one.longest_ns for one in messages), default=0) * FINE), "")
        for one in messages:
            taken = [(one.own, one.frame_ns), *((item.literal, item.extra_ns) for item in one.carried)]
            least = sum(int(time * FINE) * (1 if literal is None else literal) for literal, time in taken)
            self.model.add(found >= least).only_enforce_if(kind)
        return found

    def _before(self, due: Sequence[Sent], others: Sequence[Sent]) -> dict[int, Any]:
        """A literal for each of the others, true where a message that is due has a greater identifier."""
        numbers = [(number, True, one.number, literal) for one in due for literal, number in one.numbers]
        numbers += [(number, False, one.number, literal) for one in others for literal, number in one.numbers]
        passed: Any = None
        found: dict[int, Any] = {}
        for _, is_due, message, literal in sorted(numbers, key=lambda item: (-item[0], not item[1])):
            if not is_due and passed is None:
                continue
            made = found.get(message) if not is_due else None
            made = self.model.new_bool_var("") if made is None else made
            if is_due:
                self._implies([literal], made)
                if passed is not None:
                    self.model.add_implication(passed, made)
                passed = made
            else:
                self._implies([literal, passed], made)
                found[message] = made
        return found

    def _implies(self, literals: Sequence[Any], made: Any) -> None:
        self.model.add_bool_or([made, *(item.negated() for item in literals if item is not None)])


@dataclass(frozen=True)
class _Wire:
    """A type of a bus: the time of a bit, in ns, and the faults that there are at least, in some of these ways."""

    bit_ns: Exact
    faults: list[Task]

    def faulty_ns(self, begin: Exact, hit_ns: Exact) -> Exact:
        """The least that faults cost until some time after `begin`, where each has a frame of `hit_ns` sent again."""
        streams = [stream for task in self.faults for stream in task.streams]
        counts = ((begin + stream.jitter_ns) // stream.period_ns + 1 for stream in streams)
        return min(counts, default=0) * (ERROR_BITS * self.bit_ns + hit_ns)


@dataclass(frozen=True)
class _Carried:
    """What a message may carry where a literal is true: what it adds at least, and how long that may take."""

    literal: Any
    extra_ns: Exact
    limit_ns: Exact | None


@dataclass(frozen=True)
class _There:
    """The cases of a message and what is carried in it, each with a literal that is true where it counts."""

    cases: list[tuple[Any, Candidate]]
    carried: list[tuple[Any, Exact]]


@dataclass
class Sent:
    """A message that is on a bus: what it is where literals are true, and its numbers; None: always.

    It is there where `own` is true. With all that it may carry its frame takes `longest_ns`.
    """

    number: int
    cases: list[tuple[Any, Candidate]]
    numbers: list[tuple[Any, int]]
    own: Any
    carried: list[_Carried]
    longest_ns: Exact

    def carried_until(self, time: Exact) -> list[_Carried]:
        """Connections that it may carry and that are due by `time`."""
        return [item for item in self.carried if item.limit_ns is not None and item.limit_ns <= time]

    def is_due(self, time: Exact) -> bool:
        """Whether the message is due by `time` in every case."""
        return all(item.limit_ns is not None and item.limit_ns <= time for _, item in self.cases)

    @property
    def frame_ns(self) -> Exact:
        """The least time of its longest frame."""
        return min(item.section_ns for _, item in self.cases)


def _one_job(item: Candidate) -> Exact:
    """The time of one job of a message."""
    assert item.task is not None
    return item.task.worst_ns


def _intervals(due: Sequence[Sent], time: Exact, last: Exact, bit: Exact) -> Iterator[tuple[Exact, Exact]]:
    """Parts of the time until the end, which are cut where jobs come."""
    cuts: set[Exact] = set()
    for item in chain.from_iterable((case for _, case in one.cases) for one in due):
        for stream in item.task.streams if item.task is not None else ():
            come = last - bit - stream.jitter_ns
            count = (time - come) // stream.period_ns
            cuts |= {come + job * stream.period_ns for job in range(max(0, count - LATEST), count + 1)}
    late = sorted(cut for cut in cuts if 0 < cut < time)[-LATEST:]
    edges = [*(part * (late[0] if late else time) // EARLIER for part in range(EARLIER)), *late, time]
    for begin, end in pairwise(edges):
        if begin < end:
            yield begin, end


def _work(item: Candidate, begin: Exact, last: Exact, bit: Exact, due: Exact) -> Exact:
    """The work of a message before the last message starts, which ends after `begin`; one job if it may be the last."""
    assert item.task is not None
    window = begin - last + bit
    if window < 0 or (item.limit_ns is not None and item.limit_ns <= due and begin < item.limit_ns):
        return item.task.worst_ns
    jobs = sum((window + stream.jitter_ns) // stream.period_ns + 1 for stream in item.task.streams)
    if item.task.separation_ns is not None:
        jobs = min(jobs, window // item.task.separation_ns + 1)
    return max(1, jobs) * item.task.worst_ns
