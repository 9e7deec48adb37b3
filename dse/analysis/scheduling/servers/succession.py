"""Which threads of an executor never wait at the same time: those of one chain, where each job ends before the next.

A thread that only the end of another releases has a job after each of that one's. Where the job of a thread's last
successor always ends before the thread is released again, a job of the chain is never released while an earlier one
waits: the jobs of the chain do not delay each other. (Of all jobs that end later than their bounds one would be first:
until then what the others' bounds rest on has held, and so its own; docs/semantics.md, section 4.6.)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from dse.analysis.binding import transmission_ns
from dse.analysis.rates import arrivals
from dse.analysis.scheduling.releases import thread_releases
from dse.analysis.scheduling.response_time import Task
from dse.analysis.scheduling.servers.segments import apart_ns
from dse.analysis.scheduling.tasks import TaskKey, alone_ns
from dse.analysis.scheduling.turns import Turn
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Link:
    """What alone releases a thread: the end of the job of another component, at most `most_ns` before."""

    sender: int
    most_ns: Exact


def link_of(space: Space, number: int, view: View) -> Link | None:
    """The only component whose jobs release those of a thread; None where there are others, or a timer, or none.

    Nor is there one where jobs are held back to keep a distance, or what is sent waits for a time.
    """
    memory: dict[int, Link | None] = view.memo.setdefault("links", {})
    if number not in memory:
        memory[number] = _found_link(space, number, view)
    return memory[number]


def _found_link(space: Space, number: int, view: View) -> Link | None:
    component = space.components[number]
    found = arrivals(component, view)
    if not found.by_inputs or found.by_timer or found.is_separated or len(component.triggers) != 1:
        return None
    connection = space.connections[component.triggers[0]]
    if connection.sender is None or component.pieces is not None:
        return None
    sender = space.components[connection.sender]
    if sender.pieces is not None or at(sender.communication, view) == "let":
        return None
    return Link(connection.sender, transmission_ns(space, connection, view)[1])


class Succession:
    """The chains in the executors of a core of `turns`, as response times are `known` when one is first asked about."""

    def __init__(self, space: Space, turns: Sequence[Turn], known: Mapping[TaskKey, Exact | None], view: View) -> None:
        self.space, self.turns, self.known, self.view = space, turns, known, view
        self._chains: dict[int, Chains] = {}

    def chains(self, executor: int) -> Chains:
        """Those of one executor."""
        if executor not in self._chains:
            numbers = [turn.key[0] for turn in self.turns if turn.executor == executor and _is_whole(turn)]
            self._chains[executor] = Chains(self.space, numbers, self.known, self.view)
        return self._chains[executor]


def _is_whole(turn: Turn) -> bool:
    """Whether a task is all of a thread, but for a hybrid one's callback."""
    return turn.key[1] == "thread" and not turn.pieces


class Chains:
    """Which threads of an executor never wait at the same time; `numbers` are those that are there."""

    def __init__(self, space: Space, numbers: Sequence[int], known: Mapping[TaskKey, Exact | None], view: View) -> None:
        self.space, self.numbers, self.known, self.view = space, numbers, known, view
        self._apart: dict[int, Exact | None] = {}
        """The least time between two releases of a component; None of one release, or of any lateness."""
        self._first: dict[int, int] = {}
        """The first of each thread's chain in the executor."""
        self._pairs: set[tuple[int, int]] = set()
        """Of each pair the one that comes before, or the same."""
        there = set(numbers)
        for number in numbers:
            ways = list(self._spans_to(number))
            is_over = [self._is_apart(first, span) for first, span in ways]
            for position, (first, _) in enumerate(ways):
                if first in there:
                    self._first[number] = first
                    if any(is_over[position:]):
                        self._pairs.add((first, number))

    def _response_ns(self, number: int) -> Exact | None:
        """The longest time of a job from its release to its end."""
        alone = alone_ns(self.space.components[number], "thread", self.view)[1]
        found = self.known.get((number, "thread"), alone)
        return None if found is None else max(found, alone)

    def _spans_to(self, number: int) -> Iterator[tuple[int, Exact]]:
        """A thread and all before it in its chain, with the longest time from the release of that to its own end."""
        span, last, seen = self._response_ns(number), number, {number}
        while span is not None:
            yield last, span
            link = link_of(self.space, last, self.view)
            response = None if link is None or link.sender in seen else self._response_ns(link.sender)
            if link is None or response is None:
                return
            span, last = span + link.most_ns + response, link.sender
            seen.add(last)

    def _is_apart(self, number: int, span: Exact) -> bool:
        """Whether so long a time is over when a component is released again."""
        if number not in self._apart:
            released = thread_releases(self.space, number, self.known, self.view)
            self._apart[number] = None if released[0] is None else apart_ns(released[0], released[1])
        apart = self._apart[number]
        return apart is not None and span <= apart

    def never_meet(self, one: Turn, other: Turn) -> bool:
        """Whether two tasks are of one chain, and never wait at the same time; one alone with its next job."""
        return _is_whole(one) and _is_whole(other) and self._follow(one.key[0], other.key[0])

    def _follow(self, one: int, other: int) -> bool:
        return (one, other) in self._pairs or (other, one) in self._pairs

    def line(self, turn: Turn) -> int | None:
        """A line of tasks of which at most one job waits at a time; None of one that may wait twice.

        It has all that follow its first thread in the executor, or one thread, or the pieces of one.
        """
        if turn.pieces:
            return turn.pieces[0]
        return self._lines.get(turn.key[0]) if _is_whole(turn) else None

    @cached_property
    def _lines(self) -> Mapping[int, int]:
        members: dict[int, list[int]] = {}
        for number, first in self._first.items():
            members.setdefault(first, []).append(number)
        found: dict[int, int] = {}
        for first, line in members.items():
            is_one = all(self._follow(one, other) for index, one in enumerate(line) for other in line[index:])
            found |= {number: first if is_one else number for number in line if self._follow(number, number)}
        return found


def longest_of_each(tasks: Sequence[tuple[Task, int | None]]) -> list[Task] | None:
    """The task of each line that takes longest, the first of several; None where one that takes time is in no line."""
    longest: dict[int, Task] = {}
    for task, line in tasks:
        if not task.worst_ns:
            continue
        if line is None:
            return None
        if line not in longest or task.worst_ns > longest[line].worst_ns:
            longest[line] = task
    return list(longest.values())
