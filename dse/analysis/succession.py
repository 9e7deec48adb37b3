"""Which threads of an executor never wait at the same time: those of one chain, where each job ends before the next.

A thread that only the end of another releases has a job after each of that one's. Where the job of a thread's last
successor always ends before the thread is released again, a job of the chain is never released while an earlier one
waits: the jobs of the chain do not delay each other. (Of all jobs that end later than their bounds one would be first:
until then what the others' bounds rest on has held, and so its own; docs/semantics.md, section 4.6.)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from dse.analysis.binding import transmission_ns
from dse.analysis.rates import arrivals
from dse.analysis.response_time import Task
from dse.analysis.segments import apart_ns
from dse.analysis.tasks import TaskKey, alone_ns
from dse.analysis.views import View
from dse.records import dataclass
from dse.space.trees import at
from dse.space.types import Space
from dse.units import Exact


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
    """The chains among the tasks of a core, by position, as response times are known."""

    def __init__(
        self,
        space: Space,
        tasks: Mapping[int, Task],
        known: Mapping[TaskKey, Exact | None],
        view: View,
    ) -> None:
        """`tasks` are those of one executor, by the number of their thread; a callback of a hybrid thread is none."""
        self.space, self.tasks, self.known, self.view = space, tasks, known, view
        self._spans = {number: dict(self._spans_to(number)) for number in tasks}
        """For each task those of the same executor before it in its chain, with the longest time from their release."""

    def _response_ns(self, number: int) -> Exact | None:
        """The longest time of a job from its release to its end."""
        alone = alone_ns(self.space.components[number], "thread", self.view)[1]
        found = self.known.get((number, "thread"), alone)
        return None if found is None else max(found, alone)

    def _spans_to(self, number: int) -> Iterator[tuple[int, Exact]]:
        span = self._response_ns(number)
        seen = {number}
        last = number
        if span is not None:
            yield number, span
        while span is not None and (link := link_of(self.space, last, self.view)) is not None:
            last = link.sender
            response = self._response_ns(last)
            if last in seen or response is None:
                return
            seen.add(last)
            span = span + link.most_ns + response
            if last in self.tasks:
                yield last, span

    def _is_over(self, first: int, last: int) -> bool:
        """Whether the job of the last one always ends before the first one is released again."""
        span = self._spans[last].get(first)
        if span is None:
            return False
        task = self.tasks[first]
        apart = apart_ns(task.streams, task.separation_ns)
        return apart is None or span <= apart

    def follow(self, one: int, other: int) -> bool:
        """Whether two threads are of one chain, and never wait at the same time; one alone with its next job."""
        return self._is_over(one, other) or self._is_over(other, one)

    def lines(self) -> dict[int, int | None]:
        """For each thread a line, of all whose jobs at most one waits at a time; None of one that may wait twice.

        A line has all that follow its first thread in the executor, or one thread.
        """
        members: dict[int, list[int]] = {}
        for number in self.tasks:
            members.setdefault(list(self._spans[number])[-1] if self._spans[number] else number, []).append(number)
        found: dict[int, int | None] = {}
        for first, line in members.items():
            is_one = all(self.follow(one, other) for index, one in enumerate(line) for other in line[index:])
            for number in line:
                alone = number if self.follow(number, number) else None
                found[number] = first if is_one else alone
        return found


def longest_of_each(tasks: Sequence[tuple[Task, int | None]]) -> list[Task] | None:
    """The task of each line that takes longest, the first of several; None where one is in no line."""
    longest: dict[int, Task] = {}
    for task, line in tasks:
        if line is None:
            return None
        if line not in longest or task.worst_ns > longest[line].worst_ns:
            longest[line] = task
    return list(longest.values())
