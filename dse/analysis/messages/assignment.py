"""The order of the messages of a bus of which some may have any identifier: N. C. Audsley's assignment.

From the last message up: whatever meets its deadline when all that are left go first may be the last of these ("On
priority assignment in fixed priority scheduling", Information Processing Letters 79(1), 2001; of messages on CAN:
R. I. Davis and others, Real-Time Systems 35, 2007, section 6). Where jitter is given, and numbers do not run short, an
order that meets all deadlines is found if there is one. Of several messages that may be last one of no flow is, the one
with the latest deadline (its period, where it states none), and one with a stated number after those that may have any;
then those of flows, the last one in the file first: so flows have the most urgent places that the deadlines of the
others leave. Messages with a number keep their order.

That is the rule `audsley`. With `robust` of those that may be last it is the one that tolerates the longest additional
interference, at once, in its busy period: the order in which the message that tolerates least tolerates most (R. I.
Davis and A. Burns, "Robust priority assignment for messages on Controller Area Network (CAN)", Real-Time Systems 41,
2009). With `deadline_monotonic` it is the one with the latest deadline, whether it is in time or not.
(docs/semantics.md, section 5.5)
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from dse.analysis.scheduling.busy_window import CLEARLY, Task
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.faults import with_frame, work_of
from dse.space.model.space import AssignmentRule
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Candidate:
    """A message in search of its place; times in ns.

    Attributes
    ----------
    task
        what it takes, and what releases it; None where its releases have no bound.
    last_ns, section_ns
        its last and its longest frame.
    limit_ns
        the longest response time that meets its deadline; None where it has none.
    identifier
        its number; None where it may have any.
    is_on_flow
        whether it is a part of a flow.
    """

    task: Task | None
    last_ns: Exact
    section_ns: Exact
    limit_ns: Exact | None
    identifier: int | None
    is_on_flow: bool

    def turn(self, position: int, rule: AssignmentRule = "audsley") -> tuple[bool, bool, Exact, int]:
        """The lesser, the sooner it is made the last of those that may be; `position` is its place in the file."""
        by_deadline = rule == "deadline_monotonic"
        if self.is_on_flow and not by_deadline:
            return True, self.identifier is None, 0, -position
        periods = [item.period_ns for item in self.task.streams] if self.task is not None else []
        latest = self.limit_ns if self.limit_ns is not None else min(periods, default=None)
        is_stated = self.identifier is not None and not by_deadline
        return False, is_stated, -(10**18) if latest is None else -latest, -position


def is_in_time(
    own: Candidate, urgent: Iterable[Candidate], blocked_ns: Exact, bit_ns: Exact, faults: Task | None = None
) -> bool:
    """Whether a message meets its deadline where those of `urgent` go first; one without a deadline always does.

    `faults` are those of the wire, without the frames that are sent again.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> one, other = (Candidate(periodic("", 135, 1000), 135, 135, limit, None, False) for limit in (405, 300))
    >>> is_in_time(one, [other], 135, 1), is_in_time(other, [one], 135, 1)
    (True, False)
    """
    return LastOf((own, *urgent), blocked_ns, bit_ns, faults).is_in_time(own)


class LastOf:
    """Some messages of which one is the last, behind a frame of `blocked_ns`: whether it meets its deadline there.

    Where all come by one plain stream each, of whole ns, what they take is summed up once, by periods and jitters.
    """

    def __init__(
        self, members: Iterable[Candidate], blocked_ns: Exact, bit_ns: Exact, faults: Task | None = None
    ) -> None:
        self.members, self.blocked_ns, self.bit_ns = tuple(members), blocked_ns, bit_ns
        self.tasks = [item.task for item in self.members if item.task is not None]
        self.faults = with_frame(faults, max(item.section_ns for item in self.members))
        self.work: dict[tuple[int, int], Exact] | None = {}
        for task in self.tasks:
            if not _is_plain(task):
                self.work = None
                break
            key = task.streams[0].period_ns, int(task.streams[0].jitter_ns)
            self.work[key] = self.work.get(key, 0) + task.worst_ns

    def is_in_time(self, own: Candidate) -> bool:
        """Whether one of the messages meets its deadline as the last of them; one without a deadline always does."""
        if own.limit_ns is None:
            return True
        if own.task is None or len(self.tasks) < len(self.members) or own.task.worst_ns > own.limit_ns:
            return False
        if self.work is not None:
            found = self._is_soon(own.task, own.last_ns, own.limit_ns, self.work)
            if found is not None:
                return found
        others = [item.task for item in self.members if item is not own and item.task is not None]
        window = Arbitrated(own.task, tuple(others), self.blocked_ns, own.last_ns, self.bit_ns, self.faults)
        response = window.response_ns()
        return response is not None and response <= own.limit_ns

    def _is_soon(self, own: Task, last: Exact, limit: Exact, work: Mapping[tuple[int, int], Exact]) -> bool | None:
        """Whether each job of the busy period ends in time (`Arbitrated`); None where the bus is all but full."""
        used = sum(float(total / period) for (period, _), total in work.items())
        used += 0 if self.faults is None else float(self.faults.utilisation)
        if used > 1 - CLEARLY:
            return False if used > 1 + CLEARLY else None
        period, jitter = own.streams[0].period_ns, int(own.streams[0].jitter_ns)
        others = {**work, (period, jitter): work[period, jitter] - own.worst_ns}
        busy = self._least(self.blocked_ns + own.worst_ns, self.blocked_ns, 0, 0, work)
        start: Exact = 0
        count = 0
        while not count or count * period - jitter < busy:
            release = max(0, count * period - jitter)
            before = self.blocked_ns + (count + 1) * own.worst_ns - last
            start = self._least(max(before, start), before, self.bit_ns, last, others)
            if start + last - release > limit:
                return False
            count += 1
        return True

    def _least(self, time: Exact, once: Exact, bit: Exact, last: Exact, work: Mapping[tuple[int, int], Exact]) -> Exact:
        """The least time, no sooner than `time`, by which `once` and all that comes until a bit later is done.

        Faults count until the `last` frame that begins then is over.
        """
        faulty = work_of(self.faults)
        while True:
            needed = once + faulty(time + last)
            needed += sum(-(-(time + bit + jitter) // period) * total for (period, jitter), total in work.items())
            if needed <= time:
                return time
            time = needed


def _is_plain(task: Task) -> bool:
    """Whether a message comes by one stream, of a period and jitter in whole ns, and no later by a separation."""
    if len(task.streams) != 1 or task.separation_ns is not None:
        return False
    return type(task.streams[0].period_ns) is int and type(task.streams[0].jitter_ns) is int


def tolerated_ns(
    own: Candidate, urgent: Sequence[Candidate], blocked_ns: Exact, bit_ns: Exact, faults: Task | None, least_ns: int
) -> int | None:
    """How much additional interference, at once, leaves a message with a deadline in time, in whole ns.

    None where that is less than `least_ns`.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> one, other = (Candidate(periodic("", 135, 1000), 135, 135, limit, None, False) for limit in (405, 305))
    >>> tolerated_ns(one, [other], 0, 1, None, 0), tolerated_ns(other, [one], 0, 1, None, 40)
    (135, None)
    """
    assert own.limit_ns is not None

    def tolerates(more_ns: int) -> bool:
        return is_in_time(own, urgent, blocked_ns + more_ns, bit_ns, faults)

    if not tolerates(least_ns):
        return None
    low, high = least_ns, int(own.limit_ns) + 1  # not in time with that much
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if tolerates(middle) else (low, middle)
    return low


@dataclass(frozen=True)
class Assignment:
    """Messages in their order, by their positions in the file, the most urgent first, with their identifiers.

    `stuck` are those that were left when none of them could be last in time for the first time; empty where each has a
    place in time. `is_forced`: one of them would have been in time, but that numbers run short.
    """

    order: tuple[int, ...]
    identifiers: tuple[int, ...]
    stuck: tuple[int, ...] = ()
    is_forced: bool = False


def assigned(
    candidates: Sequence[Candidate],
    bit_ns: Exact,
    most: int,
    soonest: int | None = None,
    faults: Task | None = None,
    rule: AssignmentRule = "audsley",
    before: Collection[int] = (),
) -> Assignment:
    """Places for all messages, with identifiers up to `most`; what cannot be in time is placed all the same.

    With `soonest`, the position of a message, that has the most urgent place that the deadlines of all others leave it
    in any order, of those with the messages in `before` before it; as if there were numbers enough between stated ones.
    `faults` are those of the wire.

    Examples
    --------
    Four messages of 95, 135, 55 and 135 bits; by their deadlines, which are the periods, the third would end after 650.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> frames = [(95, 360), (135, 420), (55, 630), (135, 850)]
    >>> made = [Candidate(periodic("", bits, T), bits, bits, T, None, False) for bits, T in frames]
    >>> assigned(made, 1, 2047).order, assigned(made, 1, 2047).identifiers
    ((0, 2, 1, 3), (1, 2, 3, 4))
    """
    stated = sorted((item.identifier, place) for place, item in enumerate(candidates) if item.identifier is not None)
    free = [place for place, item in enumerate(candidates) if item.identifier is None]

    def turn(place: int) -> tuple[bool, bool, Exact, int]:
        if soonest is not None and (place == soonest or place in before):
            return True, True, int(place != soonest), 0
        return candidates[place].turn(place, rule)

    free.sort(key=turn)
    placed: list[int] = []
    blocked: Exact = 0
    top = most + 1
    stuck: tuple[int, ...] = ()
    is_forced = False
    while free or stated:
        number, bottom = stated[-1] if stated else (-1, -1)
        options = list(free) if soonest is not None or top - 1 > number else []
        may_be_bottom = bool(stated) and (soonest is not None or len(free) <= number - len(stated) + 1)
        if may_be_bottom or not options:
            options.append(bottom)
        options.sort(key=turn)
        left = [*free, *(place for _, place in stated)]

        last_of = LastOf((candidates[place] for place in left), blocked, bit_ns, faults)

        def may_be_last(place: int, last_of: LastOf = last_of) -> bool:
            return last_of.is_in_time(candidates[place])

        in_time = filter(may_be_last, options)
        if rule == "robust":
            chosen = _most_tolerant(candidates, in_time, left, blocked, bit_ns, faults)
        else:
            chosen = next(in_time, None)
        if rule == "deadline_monotonic":
            chosen = options[0]
        if chosen is None:
            if not stuck:
                is_forced = any(place not in options and may_be_last(place) for place in (*free, bottom) if place >= 0)
                stuck = tuple(sorted(left))
            chosen = options[0]
        placed.append(chosen)
        blocked = max(blocked, candidates[chosen].section_ns)
        if chosen == bottom:
            top = number
            stated.pop()
        else:
            top -= 1
            free.remove(chosen)
    placed.reverse()
    return Assignment(tuple(placed), _numbers(candidates, placed), stuck, is_forced)


def _most_tolerant(
    candidates: Sequence[Candidate],
    options: Iterable[int],
    left: Sequence[int],
    blocked_ns: Exact,
    bit_ns: Exact,
    faults: Task | None,
) -> int | None:
    """The one of some that may be last in time which tolerates most, the first of equal ones; None of none.

    One without a deadline tolerates whatever there is.
    """
    best: tuple[int, int] | None = None
    for place in options:
        if candidates[place].limit_ns is None:
            return place
        others = [candidates[other] for other in left if other != place]
        least = 0 if best is None else best[1] + 1
        found = tolerated_ns(candidates[place], others, blocked_ns, bit_ns, faults, least)
        best = best if found is None else (place, found)
    return None if best is None else best[0]


def _numbers(candidates: Sequence[Candidate], order: Sequence[int]) -> tuple[int, ...]:
    """Numbers in this order: right after the stated one before them, or from 1 on, or right before the first stated."""
    found: list[int] = []
    first = next((at for at, place in enumerate(order) if candidates[place].identifier is not None), None)
    for at, place in enumerate(order):
        own = candidates[place].identifier
        if own is not None:
            found.append(own)
        elif found:
            found.append(found[-1] + 1)
        else:
            before = None if first is None else candidates[order[first]].identifier
            found.append(1 if before is None or first is None else before - (first - at))
    return tuple(found)
