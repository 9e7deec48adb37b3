"""Messages of a bus of which none can be the last in time: whatever the order of these, one of them is late.

Who is last waits for all others, for each job of theirs, and behind a frame of any message beside them: that goes
before it, or may have begun. One with any identifier can be last only behind the greatest number of the others, and
behind all that have the numbers right after it: there is none for it in between. Releases have the jitter that they
have where nothing waits, the least there is. So such a set is late in every design in which these messages come as
often, take as long, and are as urgent as here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from dse.analysis.binding import frame_numbers
from dse.analysis.memo import Recall
from dse.analysis.messages.assignment import Candidate, LastOf, assigned
from dse.analysis.messages.stages import (
    bus_of,
    candidate_of,
    carried_by,
    faults_on,
    identifier_range,
    is_comparable,
    may_wait_for,
)
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.views import View, tabulate
from dse.space.architecture.arbitration import may_be_any
from dse.space.model.space import Space
from dse.space.model.trees import at, leaves
from dse.spec.schema.fields import ANY_IDENTIFIER
from dse.support.units import Exact

NEVER = 10**18
"""The deadline of messages without one, in ns."""
MOST_CASES = 64
"""A bound with more cases than this is taken for another one than the deadline."""


@dataclass(frozen=True)
class Conflict:
    """A set of messages on a bus, by their connections, and one of the others whose frame is the longest, if any.

    `numbers` are the identifiers of those that have one; `behind` others that have those right after the greatest.
    Where `last` is a message the group goes before that one in every order in which all are in time: none of the group
    but those that are `kept` there by a rule can be the last of these in time.
    """

    bus: int
    group: tuple[int, ...]
    behind: tuple[int, ...]
    blocker: int | None
    numbers: Mapping[int, int]
    last: int | None = None
    kept: frozenset[int] = frozenset()

    @property
    def placed(self) -> tuple[int, ...]:
        """The group, and the message that it goes before."""
        return self.group if self.last is None else (*self.group, self.last)

    @property
    def members(self) -> tuple[int, ...]:
        """The messages of the conflict: the group, the one that it goes before, those behind it, and the blocker."""
        found = (*self.placed, *self.behind)
        return found if self.blocker is None else (*found, self.blocker)

    def candidates(self, space: Space, view: View) -> dict[int, Candidate] | None:
        """The messages as they are in a design; None where one is not on the bus there."""
        for number in self.members:
            if bus_of(space, number, view) != self.bus or at(space.connections[number].carried_in, view) is not None:
                return None
        return {number: _CANDIDATES.recall(space, (self.bus, number), view, _unnumbered) for number in self.members}

    def kept_from_last(self, space: Space, view: View) -> frozenset[int] | None:
        """The messages in time as the last whose number is lower than that of another; None where one can be last."""
        known = self.candidates(space, view)
        if known is None:
            return None
        bit, faults = identifier_range(space, self.bus, view)[0], faults_on(space, self.bus, view)
        blocked = 0 if self.blocker is None else known[self.blocker].section_ns
        highest = max((self.numbers.get(number, -1) for number in self.placed), default=-1)
        placed = [known[number] for number in self.placed]
        last_of = LastOf(placed, blocked, bit, faults)
        behind = [known[other] for other in self.behind]
        free_last = LastOf([*placed, *behind], blocked, bit, faults) if behind else last_of
        ordered = set()
        for number in reversed(self.group):
            if number in self.kept:
                continue
            if (last_of if number in self.numbers else free_last).is_in_time(known[number]):
                if self.numbers.get(number, highest) >= highest:
                    return None
                ordered.add(number)
        return frozenset(ordered)

    def limited(self, space: Space, view: View) -> list[int]:
        """The connections in the frames of the group whose deadlines make it a conflict in a design."""
        frames = (frame_numbers(space, space.connections[number], view) for number in self.group)
        return [one for frame in frames for one in frame if at(space.connections[one].deadline_ns, view) is not None]

    def frame_burden(self, space: Space, index: int, view: View) -> Sequence[int | None] | None:
        """How busy the options of a decision in whose message a connection is carried keep the conflict.

        A number for each option, the greater the busier; None of one that is at least as busy as the least of them, and
        instead of all where only the option of the design keeps it. A connection that is in no frame of the conflict
        can only make it busier elsewhere.
        """
        decision, option = space.decisions[index], view[index]
        number = next(number for number, item in enumerate(space.connections) if item.name == decision.component)
        head = decision.values[option]
        if number in self.members:
            return None
        if head not in self.members:
            return [0] * len(decision.values)
        if None not in decision.values:
            return None
        return [0 if value is None else 1 if value == head else None for value in decision.values]

    def is_late(self, space: Space, view: View) -> bool:
        """Whether none of the group can be last in time in a design, where numbers are in the same order."""
        return self.kept_from_last(space, view) is not None

    def bounds(self, ordered: frozenset[int]) -> Iterator[tuple[int, int, bool]]:
        """Connections with a number, and whether theirs must be at most that (else at least) for the conflict to last.

        That is so of each of those that are kept from the last place, and of the last number that keeps them. (Where
        others are behind, that has the number right before theirs, and they have just these.)
        """
        if ordered or self.behind:
            highest = max(self.placed, key=lambda number: self.numbers.get(number, -1))
            yield highest, self.numbers[highest], False
            yield from ((number, self.numbers[number], True) for number in ordered)
        for number in (highest, *self.behind) if self.behind else ():
            yield number, self.numbers[number], False
            yield number, self.numbers[number], True


_CARRIED: Recall[list[int]] = Recall()
_CANDIDATES: Recall[Candidate] = Recall()


def candidates_on(space: Space, bus: int, view: View) -> tuple[list[int], list[Candidate]]:
    """The messages of a bus on which each is one connection, and each in search of its place."""
    carried = _CARRIED.recall(space, bus, view, carried_by)
    found = []
    for number in carried:
        identifier = at(space.connections[number].identifier, view)
        made = _CANDIDATES.recall(space, (bus, number), view, _unnumbered)
        found.append(made if identifier == ANY_IDENTIFIER else replace(made, identifier=identifier))
    return carried, found


def _unnumbered(space: Space, key: tuple[int, int], view: View) -> Candidate:
    """A message without its number: no more is read of that than its frame's length takes."""
    bus, number = key
    (task,) = released_undelayed(space, view, [(number, "message")]).values()
    return candidate_of(space, bus, number, view, task)


def conflicts(space: Space, bus: int, view: View) -> Iterator[Conflict]:
    """A conflict among the messages of a bus in a design, with few messages; nothing where there is none.

    Nor where messages go by other ways than their identifiers (senders that queue as messages come among them), or some
    connections of a frame may stay on a processor.
    """
    slot = space.buses[bus]
    if set(leaves(slot.broadcast)) != {False} or at(slot.arbitration, view) != "priority" or not is_comparable(space):
        return
    carried, candidates = candidates_on(space, bus, view)
    made = assigned(candidates, *identifier_range(space, bus, view), faults=faults_on(space, bus, view))
    if not made.stuck:
        return
    numbers = {
        number: item.identifier for number, item in zip(carried, candidates, strict=True) if item.identifier is not None
    }
    found = _Shrinking(space, bus, view, carried, candidates, numbers).least(made.stuck)
    if found is not None:
        yield found


@dataclass
class _Shrinking:
    space: Space
    bus: int
    view: View
    carried: Sequence[int]
    candidates: Sequence[Candidate]
    numbers: Mapping[int, int]

    def least(self, stuck: Sequence[int]) -> Conflict | None:
        """The conflict with the fewest of the stuck messages (given by place) that are late together."""
        group = sorted(stuck, key=lambda place: self._limit(place))
        if not self.fails(group):
            return None
        for limit in sorted({self._limit(place) for place in group}):
            fewer = [place for place in group if self._limit(place) <= limit]
            last = max((self._number(place) for place in fewer), default=-1)
            fewer += [place for place in group if place not in fewer and 0 <= self._number(place) < last]
            if self.fails(fewer):
                group = fewer
                break
        size = len(group) // 2
        while size:
            for start in range(0, len(group), size):
                fewer = [*group[:start], *group[start + size :]]
                if fewer and self.fails(fewer):
                    group = fewer
                    break
            else:
                size //= 2
        behind = [] if self.fails(group, with_behind=False) else self._behind(group)
        blocker = self._blocker(group)
        members = [self.carried[place] for place in (*group, *behind)]
        return Conflict(
            self.bus,
            tuple(members[: len(group)]),
            tuple(members[len(group) :]),
            None if blocker is None else self.carried[blocker],
            {number: self.numbers[number] for number in members if number in self.numbers},
        )

    def _behind(self, group: Sequence[int]) -> list[int]:
        """The messages beside the group with the numbers right after its greatest, in their order."""
        number = max(map(self._number, group))
        found: list[int] = []
        while number >= 0 and (place := self.places.get(number + 1)) is not None:
            found.append(place)
            number += 1
        return found

    @cached_property
    def places(self) -> dict[int, int]:
        """The places of messages by their numbers."""
        return {number: place for place in range(len(self.carried)) if (number := self._number(place)) >= 0}

    def fails(self, group: Sequence[int], *, with_behind: bool = True) -> bool:
        """Whether none of the group can be last in time; where it helps, behind those with the numbers right after."""
        bit, _ = identifier_range(self.space, self.bus, self.view)
        faults = faults_on(self.space, self.bus, self.view)
        blocker = self._blocker(group)
        blocked = 0 if blocker is None else self.candidates[blocker].section_ns
        highest = max(map(self._number, group))
        members = [self.candidates[place] for place in group]
        last_of = LastOf(members, blocked, bit, faults)
        behind = [self.candidates[other] for other in self._behind(group)] if with_behind else []
        free_last = LastOf([*members, *behind], blocked, bit, faults) if behind else last_of
        for place in reversed(group):
            number = self._number(place)
            if -1 < number < highest:
                continue
            if (last_of if number >= 0 else free_last).is_in_time(self.candidates[place]):
                return False
        return True

    def _blocker(self, group: Sequence[int]) -> int | None:
        known = {*group, *self._behind(group)}
        others = [place for place in range(len(self.carried)) if place not in known]
        return max(others, key=lambda place: self.candidates[place].section_ns, default=None)

    def _number(self, place: int) -> int:
        return self.numbers.get(self.carried[place], -1)

    def _limit(self, place: int) -> Exact:
        found = self.candidates[place].limit_ns
        return NEVER if found is None else found


def is_own_deadline(space: Space, number: int, bound: Callable[[View], Exact]) -> bool:
    """Whether a bound of the response time of a message is the deadline of its connection, in every design."""
    deadline = space.connections[number].deadline_ns
    cases = tabulate(space, lambda view: bound(view) == at(deadline, view), MOST_CASES)
    return cases is not None and all(case.value for case in cases)


def open_identifiers(space: Space) -> bool:
    """Whether some message that waits for a bus may have any identifier."""
    wires = enumerate(space.connections)
    return any(may_be_any(item) and may_wait_for(space, number) for number, item in wires)
