"""Which threads never wait at the same time: those of one chain, where each job of it ends before the next.

A thread that only the end of another releases has a job after each of that one's. Where the job of a thread's last
successor always ends before the thread is released again, a job of the chain is never released while an earlier one
waits: the jobs of the chain do not delay each other. (Of all jobs that end later than their bounds one would be first:
until then what the others' bounds rest on has held, and so its own; docs/semantics.md, sections 4.6 and 4.9.)
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, reduce
from itertools import islice

from dse.analysis.scheduling.busy_window import Task, TaskKey
from dse.analysis.scheduling.event_models import EventModels, apart_ns
from dse.analysis.scheduling.model import Entry, Resource, Stage, System
from dse.analysis.scheduling.policies.coupled import OnWay, OnWays, behind_on_core, cases_in_window, is_coupled
from dse.support.units import Exact

MOST_THREADS = 32
"""The greatest number of threads that a chain is followed up, and of those in one window: longer ones are cut."""


class Chains:
    """Which stages of an executor, or a core, never wait at the same time, as response times are known when it is made.

    `keys` are the whole threads that it runs, and that take time, but for callbacks of hybrid ones.
    """

    def __init__(self, events: EventModels, keys: Sequence[TaskKey]) -> None:
        self.events, self.keys = events, keys
        self._apart: dict[TaskKey, Exact | None] = {}
        """The least time between two releases of a stage; None of one release, or of any lateness."""
        self._first: dict[TaskKey, TaskKey] = {}
        """The first of each stage's chain in the executor."""
        self._pairs: set[tuple[TaskKey, TaskKey]] = set()
        """Of each pair the one that comes before, or the same."""
        self._spans: dict[tuple[TaskKey, TaskKey], Exact] = {}
        """The longest time from the release of the one that comes before until the end of the other."""
        there = set(keys)
        for key in keys:
            ways = list(self.spans_to(key))
            is_over = [self.is_apart(first, span) for first, span in ways]
            for position, (first, _) in enumerate(ways):
                if first in there:
                    self._first[key], self._spans[first, key] = first, ways[position][1]
                    if any(is_over[position:]):
                        self._pairs.add((first, key))

    def _response_ns(self, key: TaskKey) -> Exact | None:
        """The longest time of a job from its release to its end."""
        alone = self.events.stages[key].worst_ns
        found = self.events.ends.get(key, alone)
        return None if found is None else max(found, alone)

    def spans_to(self, key: TaskKey) -> Iterator[tuple[TaskKey, Exact]]:
        """A stage and all before it in its chain, with the longest time from the release of that to its own end.

        Of all ways to cut that into windows of chains on one core and response times the least.
        """
        way, rests, first = [key], list[Exact | None]([0]), key
        while True:
            ends = [(self._response_ns(first), rests[0])]
            between: Exact = 0
            for index in range(1, len(way)):
                link = self.events.stages[way[index]].follows
                assert link is not None
                between += link.most_ns
                end = self.events.ends.get((way[index][0], first[0]))
                ends.append((None if end is None else end + between, rests[index]))
            spans = [end + rest for end, rest in ends if end is not None and rest is not None]
            span = reduce(min, spans) if spans else None
            if span is not None:
                yield first, span
            link = self.events.stages[first].follows
            if link is None or link.after is None or link.after in way or len(way) == MOST_THREADS:
                return
            rests.insert(0, None if span is None else span + link.most_ns)
            first = link.after
            way.insert(0, first)

    def is_apart(self, key: TaskKey, span: Exact) -> bool:
        """Whether so long a time is over when a stage is released again."""
        if key not in self._apart:
            streams = self.events.streams(key)
            self._apart[key] = None if streams is None else apart_ns(streams, self.events.stages[key].separation_ns)
        apart = self._apart[key]
        return apart is not None and span <= apart

    def never_meet(self, one: Stage, other: Stage) -> bool:
        """Whether two stages are of one chain, and never wait at the same time; one alone with its next job.

        Judged by the response times that are known when the object is made.
        """
        return _is_whole(one) and _is_whole(other) and self._follow(one.key, other.key)

    def in_turn(self, first: TaskKey, last: TaskKey) -> bool:
        """Whether a stage comes before another in a chain, or is it, and no two jobs of the chain between ever wait."""
        return (first, last) in self._pairs

    def rest_ns(self, first: TaskKey, last: TaskKey) -> Exact | None:
        """The least time, in ns, from the end of a job of a chain until its next one is released.

        None where it is not known, and where the chain is released once only.
        """
        apart, span = self._apart.get(first), self._spans.get((first, last))
        return None if apart is None or span is None else apart - span

    def _follow(self, one: TaskKey, other: TaskKey) -> bool:
        return self.in_turn(one, other) or self.in_turn(other, one)

    def line(self, stage: Stage) -> TaskKey | None:
        """A line of stages of which at most one job waits at a time; None of one that may wait twice.

        It has all that follow its first stage in the executor, or one stage, or the pieces of one thread.
        """
        if stage.pieces:
            return stage.first
        return self._lines.get(stage.key) if _is_whole(stage) else None

    @cached_property
    def _lines(self) -> Mapping[TaskKey, TaskKey]:
        members: dict[TaskKey, list[TaskKey]] = {}
        for key, first in self._first.items():
            members.setdefault(first, []).append(key)
        found: dict[TaskKey, TaskKey] = {}
        for first, line in members.items():
            is_one = all(self._follow(one, other) for index, one in enumerate(line) for other in line[index:])
            found |= {key: first if is_one else key for key in line if self.in_turn(key, key)}
        return found


class Succession:
    """The chains in the executors of a resource, as response times are known when one is first asked about.

    Chains depend on response times, so that there is one object for each round of the fixed point.
    """

    def __init__(self, events: EventModels, resource: Resource) -> None:
        self.events, self.resource = events, resource
        self._chains: dict[int, Chains] = {}

    def chains(self, executor: int) -> Chains:
        """The chains of one executor.

        Made on the first call for an executor; `executor` is its number.
        """
        if executor not in self._chains:
            stages = self.events.stages
            inside = (stages[item.key] for item in self.resource.entries if item.executor == executor)
            keys = [stage.key for stage in inside if stage.cost_ns and _is_whole(stage)]
            self._chains[executor] = Chains(self.events, keys)
        return self._chains[executor]

    @cached_property
    def has_coupled(self) -> bool:
        """Whether a thread of the resource comes behind another one on the same stated core in its chain."""
        stages = self.events.stages
        return self.resource.wire is None and any(
            is_coupled(stages, stages[item.key]) for item in self.resource.entries
        )

    def cases(
        self, level: TaskKey, ends: tuple[int, int], tasks: Sequence[Task | None], pieces: int | None = 1
    ) -> list[Sequence[Task | None]]:
        """The stages of the resource as they come in a busy window of the priority of one of them, in each case.

        The window is that of a chain between the positions `ends`, or of a stage that is both, in so many `pieces`.
        """
        if not self.has_coupled:
            return [tasks]
        first, last = ends[0], self.resource.entries[ends[1]].key
        return cases_in_window(self.events, self.resource, level, (first, last), tasks, self._ways, pieces)

    @cached_property
    def _ways(self) -> OnWays:
        events, outside = self.events, self._outside

        def behind_of(key: TaskKey) -> Sequence[OnWay]:
            return list(behind_on_core(events, events.stages[key], outside.spans_to, outside.is_apart))

        return OnWays(behind_of)

    @cached_property
    def has_relatives(self) -> bool:
        """Whether a stage of the resource may go before one that comes before or after it in its chain.

        Of stages that may have windows of chains.
        """
        entries, stages = self.resource.entries, self.events.stages
        if not any(stages[entry.key].follows is not None for entry in entries):
            return False
        above = self._above
        return any(
            other in above and (entries[other].key in mine or entries[position].key in above[other])
            for position, mine in above.items()
            for other in entries[position].rivals
        )

    @cached_property
    def _above(self) -> Mapping[int, frozenset[TaskKey]]:
        """The stages before each stage in its chain, by the position of each that may have windows of chains."""
        stages = self.events.stages
        return {
            position: frozenset(islice(_before(stages, entry.key), MOST_THREADS))
            for position, entry in enumerate(self.resource.entries)
            if may_have_windows(entry, stages[entry.key])
        }

    @cached_property
    def _outside(self) -> Chains:
        entries, stages = self.resource.entries, self.events.stages
        return Chains(self.events, [item.key for item in entries if may_have_windows(item, stages[item.key])])

    def are_apart(self, first: TaskKey, last: TaskKey) -> bool:
        """Whether a job goes through a chain of stages with windows before the next one is released."""
        return self._outside.in_turn(first, last)

    def rest_ns(self, first: TaskKey, last: TaskKey) -> Exact | None:
        """The least time, in ns, from the end of a job of a chain until its next one is released; None if not known."""
        return self._outside.rest_ns(first, last)

    def over_before(self, members: Sequence[int], rivals: Iterable[int]) -> frozenset[int]:
        """The rivals of a chain on one core, or of a stage, of which no job waits while one of it does.

        Positions; such rivals come before the first of the chain or after its last, and are over when it is released.
        """
        if not self.has_relatives:
            return frozenset()
        entries, above = self.resource.entries, self._above
        first, last = entries[members[0]].key, entries[members[-1]].key
        before = above.get(members[0], frozenset())
        keys = {other: entries[other].key for other in rivals if other in above}
        return frozenset(
            other
            for other, key in keys.items()
            if (key in before and self._outside.in_turn(key, last))
            or (last in above[other] and self._outside.in_turn(first, key))
        )


def sources_in(system: System) -> dict[TaskKey, TaskKey]:
    """Of each stage from which a lag may count the source: the first of its chain.

    Those are stages that the end of another one releases: threads that may have windows of chains, and messages that
    compete by their identifiers, none in a queue, whose sender belongs to the chain. A thread alone has a lag where
    only priorities schedule it (docs/semantics.md, sections 4.9 and 5.4).
    """
    stages, sources = system.stages, dict[TaskKey, TaskKey]()

    def source(key: TaskKey) -> TaskKey:
        way = [key]
        for before in _before(stages, key):
            way.append(before)
            if before in sources:
                way.append(sources[before])
                break
        return sources.setdefault(key, way[-1])

    found = {
        entry.key: first
        for resource in system.resources
        if resource.wire is None and not resource.is_accelerator
        for entry in resource.entries
        if may_have_windows(entry, stages[entry.key]) and (first := source(entry.key)) != entry.key
    }
    for resource in system.resources:
        wire = resource.wire
        if wire is None or wire.arbitration != "priority" or wire.lines:
            continue
        for entry in resource.entries:
            first_of_chain = source_of_message(stages, stages[entry.key])
            if first_of_chain is not None:
                found[entry.key] = first_of_chain
    return found


def source_of_message(stages: Mapping[TaskKey, Stage], message: Stage) -> TaskKey | None:
    """The first stage of the chain of what sends a message; None where nothing does, or that keeps its jobs apart.

    Then the time of the message counts from when it is queued (docs/semantics.md, section 5.4).
    """
    sender = message.releases[0].after if message.releases else None
    if sender is None:
        return None
    first = stages[sender].first
    for before in _before(stages, first):
        first = before
    return first if stages[first].separation_ns is None else None


def heads_in(system: System) -> dict[TaskKey, list[TaskKey]]:
    """The others of their executor that release stages at once, one after the other: these come no more often.

    When a busy window begins in which the executor runs none of its jobs waits, and what they have sent has come. In a
    part of a design a stage that is left out may be in the executor (docs/semantics.md, section 4.6).
    """
    stages, present = system.stages, set[TaskKey]()
    homes: dict[TaskKey, tuple[int, int]] = {}
    for number, resource in enumerate(system.resources):
        for entry in resource.entries:
            present.add(entry.key)
            if entry.executor is not None and may_have_windows(entry, stages[entry.key]):
                homes[entry.key] = number, entry.executor
    absent = stages.keys() - present if system.is_part else set[TaskKey]()
    members: dict[tuple[int, int], set[TaskKey]] = {}
    for key, home in homes.items():
        members.setdefault(home, set(absent)).add(key)
    found = {key: heads_of(stages, key, members[home]) for key, home in homes.items()}
    return {key: heads for key, heads in found.items() if heads}


def heads_of(stages: Mapping[TaskKey, Stage], key: TaskKey, inside: Container[TaskKey]) -> list[TaskKey]:
    """The stages inside that release each other at once up to one, the nearest first, as far as they take time."""
    heads = list[TaskKey]()
    while (link := stages[heads[-1] if heads else key].follows) is not None and link.after is not None:
        before = stages[link.after]
        if link.most_ns or not before.cost_ns or not _is_whole(before) or before.key not in inside:
            break
        if before.key == key or before.key in heads:
            break
        heads.append(before.key)
    return heads


def is_prioritised(entry: Entry, stage: Stage) -> bool:
    """Whether a stage is a whole thread that executes something and that its priority alone schedules."""
    return entry.executor is None and may_have_windows(entry, stage)


def may_have_windows(entry: Entry, stage: Stage) -> bool:
    """Whether a stage is a whole thread that executes something, in an executor or not, and in no reservation."""
    is_whole = entry.reservation is None and not entry.is_piece and stage.key[1] == "thread"
    return is_whole and stage.cost_ns != 0


def _before(stages: Mapping[TaskKey, Stage], key: TaskKey) -> Iterator[TaskKey]:
    """The stages before one in its chain, the nearest first."""
    passed = {key}
    link = stages[key].follows
    while link is not None and link.after is not None and link.after not in passed:
        yield link.after
        passed.add(link.after)
        link = stages[link.after].follows


def _is_whole(stage: Stage) -> bool:
    """Whether a stage is all of a thread, but for a hybrid one's callback."""
    return stage.key[1] == "thread" and not stage.pieces


def longest_of_each(tasks: Sequence[tuple[Task, TaskKey | None]]) -> list[Task] | None:
    """The task of each line that takes longest, the first of several; None where one that takes time is in no line.

    Of each line at most one job waits at a time (docs/semantics.md, section 4.6).
    """
    longest: dict[TaskKey, Task] = {}
    for task, line in tasks:
        if not task.worst_ns:
            continue
        if line is None:
            return None
        if line not in longest or task.worst_ns > longest[line].worst_ns:
            longest[line] = task
    return list(longest.values())
