"""What releases the stages of a system: streams of jobs, with the jitter that they have as far as it is known.

Event-triggered stages inherit the streams of what releases them, later by the jitter of processing and transmission
(K. Tindell and J. Clark, "Holistic schedulability analysis for distributed hard real-time systems", Microprocessing and
Microprogramming 40, 1994). A thread with segments is one thread: where a job of it is late without a bound, so is the
first piece of the next one, and any number of these may follow each other closely (docs/semantics.md, section 4.7).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, reduce
from typing import TypeAlias

from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.analysis.scheduling.model import ChainKey, Ends, Release, Stage, lag_of
from dse.space.model.arrivals import CyclicActivation
from dse.support.units import Exact

Streams: TypeAlias = tuple[Stream, ...] | None
"""None where their jitter has no bound."""


class EventModels:
    """The releases of the stages of a system, as response times are known by now."""

    def __init__(
        self,
        stages: Mapping[TaskKey, Stage],
        ends: Ends,
        chains: Iterable[ChainKey] = (),
        *,
        heads: Mapping[TaskKey, Sequence[TaskKey]] | None = None,
        is_plain: bool = False,
    ) -> None:
        """With `is_plain` all times are mere numbers: equal releases of a stage make the same task, one object.

        Of `chains` the ends are looked at, too. In windows stages come no more often than their `heads`.
        """
        self.stages, self.ends, self.is_plain = stages, ends, is_plain
        self.heads = {} if heads is None else heads
        self._chains: dict[TaskKey, list[ChainKey]] = {}
        for chain in chains:
            self._chains.setdefault((chain[0], "thread"), []).append(chain)
        self._streams: dict[TaskKey, Streams] = {}
        self._followers: dict[TaskKey, list[TaskKey]] | None = None

    def raised(self, key: TaskKey) -> None:
        """The end of a stage has changed: what it releases comes otherwise from now on."""
        if self._followers is None:
            self._followers = {}
            for stage in self.stages.values():
                for release in stage.releases:
                    if release.after is not None:
                        for item in {release.after, self.stages[release.after].first}:
                            self._followers.setdefault(item, []).append(stage.key)
                if stage.stored_by is not None:
                    self._followers.setdefault(stage.stored_by, []).append(stage.key)
        todo = list(self._followers.get(key, ()))
        while todo:
            item = todo.pop()
            if self._streams.pop(item, self) is not self:
                todo += self._followers.get(item, ())

    def streams(self, key: TaskKey) -> Streams:
        """The streams that release a stage; None when their jitter has no bound.

        Raises
        ------
        CyclicActivation
            when event-triggered stages release each other in a cycle.
        """
        todo, open_ = [key], set()
        while todo:
            top = todo[-1]
            if top in self._streams:
                todo.pop()
                continue
            missing = [one for one in self._before(top) if one not in self._streams]
            if not missing:
                self._streams[top] = self._found(self.stages[top])
                todo.pop()
            elif top in open_:
                raise CyclicActivation
            else:
                open_.add(top)
                todo += missing
        return self._streams[key]

    def task(self, key: TaskKey) -> Task | None:
        """The stage as what a busy window counts; None where it comes without a bound."""
        return _late_task(self.stages[key]) if self.has_no_bound(key) else self.bounded_task(key)

    def bounded_task(self, key: TaskKey) -> Task | None:
        """The stage as what a busy window counts, of a piece as if its thread had a bound."""
        stage, streams = self.stages[key], self.streams(key)
        if streams is None:
            return _late_task(stage)
        return _shared_task(stage, streams) if self.is_plain else _task_of(stage, streams)

    def in_window(self, key: TaskKey) -> Task | None:
        """The stage as what a busy window counts in which all of its executor runs; None where it has no bound."""
        heads = self.heads.get(key, ())
        return self.released_as(key, heads) if heads else self.task(key)

    def released_as(self, key: TaskKey, heads: Iterable[TaskKey]) -> Task | None:
        """A stage that comes no more often than some others, nor than ever; None where none of them has a bound."""
        found: Streams = None
        for one in (key, *heads):
            streams = self.streams(one)
            if found is None or streams is None:
                found = streams if found is None else found
            else:
                pairs = zip(found, streams, strict=True)
                found = tuple(Stream(old.period_ns, min(old.jitter_ns, new.jitter_ns)) for old, new in pairs)
        if found is None:
            return _late_task(self.stages[key])
        return (_shared_task if self.is_plain else _task_of)(self.stages[key], found)

    def leaving(self, key: TaskKey) -> Streams:
        """The streams at which the jobs of a stage end; None when their jitter has no bound."""
        self.streams(self.stages[key].first)
        return self._leaving(key)

    def source_task(self, key: TaskKey) -> Task | None:
        """Jobs of what releases others, which nothing holds back; None where they come without a bound."""
        streams = self.streams(key)
        return None if streams is None else Task("", 0, streams)

    def has_no_bound(self, key: TaskKey) -> bool:
        """Whether a stage is a piece of a thread without a bound: its jobs follow each other as closely as they may."""
        pieces = self.stages[key].pieces
        return bool(pieces) and self.ends.get(pieces[-1], 0) is None

    def endless_before(self, key: TaskKey) -> list[TaskKey]:
        """The stages without a bound that release a stage, and the other pieces of its thread that have none.

        What ends in time though it comes without a bound is followed further up, such as a stage that takes no time.
        """
        stage = self.stages[key]
        found = [item for item in stage.pieces if item != key and self.ends.get(item, 0) is None]
        todo = [release.after for release in self.stages[stage.first].releases]
        seen = set[TaskKey]()
        while todo:
            item = todo.pop(0)
            if item is None or item in seen:
                continue
            seen.add(item)
            if self.ends.get(item, 0) is None:
                found.append(item)
            elif self.streams(self.stages[item].first) is None:
                todo += [release.after for release in self.stages[self.stages[item].first].releases]
        return list(dict.fromkeys(found))

    def _before(self, key: TaskKey) -> Iterable[TaskKey]:
        """The stages whose own releases are passed on to a stage."""
        return (self.stages[item.after].first for item in self.stages[key].releases if item.after is not None)

    def _found(self, stage: Stage) -> Streams:
        ways = [self._way(release) for release in stage.releases]
        if stage.stored_by is not None and ways:
            assert stage.separation_ns is not None
            stored = [self._stored(way, self.stages[stage.stored_by]) for way in ways]
            return looked_at(stored, [release.is_steady for release in stage.releases], stage.separation_ns)
        if stage.rooms and ways:
            return joined(ways, stage.rooms)
        found: list[Stream] = []
        for way in ways:
            if way is None:
                return None
            found += way
        return tuple(found)

    def _way(self, release: Release) -> Streams:
        """The streams of one way in which a stage is released."""
        found = () if release.stream is None else (release.stream,)
        if release.after is None:
            return found
        leaving = self._leaving(release.after)
        if leaving is None:
            return None
        spread = release.most_ns - release.least_ns
        return (*found, *(Stream(item.period_ns, item.jitter_ns + spread) for item in leaving))

    def _stored(self, way: Streams, callback: Stage) -> Streams:
        """The streams at which a callback has stored what comes in one way."""
        end = self.ends.get(callback.key, callback.worst_ns)
        if way is None or end is None:
            return None
        spread = max(end, callback.worst_ns) - callback.best_ns
        return tuple(Stream(item.period_ns, item.jitter_ns + spread) for item in way)

    def _leaving(self, key: TaskKey) -> Streams:
        """The streams at which jobs of a stage end: of all bounds on their jitter the least."""
        alone = self._leaving_alone(key)
        for chain in self._chains.get(key, ()):
            whole = self._leaving_chain(chain)
            if alone is None or whole is None:
                alone = whole if alone is None else alone
            else:
                alone = tuple(
                    Stream(one.period_ns, min(one.jitter_ns, other.jitter_ns))
                    for one, other in zip(alone, whole, strict=True)
                )
        return alone

    def _leaving_chain(self, chain: ChainKey) -> Streams:
        """The streams at which the last thread of a chain ends, by the window of all of it."""
        released = _spaced(self.stages[chain[1], "thread"], self.streams((chain[1], "thread")))
        end = self.ends.get((*chain, "lag"), self.ends.get(chain))
        if released is None or end is None:
            return None
        key: TaskKey = (chain[0], "thread")
        spread: Exact = end
        while True:
            spread -= self.stages[key].best_ns
            if key[0] == chain[1]:
                return tuple(Stream(item.period_ns, item.jitter_ns + spread) for item in released)
            link = self.stages[key].follows
            assert link is not None
            assert link.after is not None
            key, spread = link.after, spread + link.most_ns - link.least_ns

    def _leaving_alone(self, key: TaskKey) -> Streams:
        """The streams at which jobs of a stage end, by its own response time."""
        sender = self.stages[key]
        first = self.stages[sender.first]
        released = _spaced(first, self._streams[first.key])
        best, worst = sender.elapsed_ns
        end = self.ends.get(key, worst)
        end = self.ends.get(lag_of(key), end)
        if released is None or end is None:
            return None
        return tuple(Stream(item.period_ns, item.jitter_ns + max(end, worst) - best) for item in released)


def joined(ways: Sequence[Streams], rooms: Sequence[int | None]) -> Streams:
    """The streams of jobs that need an event of each way; None when their jitter has no bound.

    When a time begins some way has no event that waits: in it there are no more jobs than events of that way. Nor are
    there more than events of any way and those of it that wait at the beginning (docs/semantics.md, section 3.8).

    >>> joined([(Stream(100, 20),), (Stream(100, 80),)], [None, None])
    (Stream(period_ns=100, jitter_ns=80),)
    >>> joined([(Stream(100, 20),), (Stream(100, 280),)], [1, 1])
    (Stream(period_ns=100, jitter_ns=120),)
    >>> joined([(Stream(10, 0),), (Stream(100, 5),)], [1, 1])
    (Stream(period_ns=100, jitter_ns=105),)
    """
    known = [way for way in ways if way is not None]
    single = [way[0] for way in known if len(way) == 1]
    if len(single) == len(ways) and all(item.period_ns == single[0].period_ns for item in single):
        latest = _longest(item.jitter_ns for item in single)
        held_back = (one.jitter_ns + room * one.period_ns for one, room in zip(single, rooms, strict=True) if room)
        return (Stream(single[0].period_ns, reduce(min, held_back, latest)),)
    held = [(way, room) for way, room in zip(ways, rooms, strict=True) if way and room is not None]
    if held:
        (first, *others), room = min(held, key=lambda item: sum(Fraction(1) / one.period_ns for one in item[0]))
        return (Stream(first.period_ns, first.jitter_ns + room * first.period_ns), *others)
    if len(known) < len(ways):
        return None
    if len(single) == len(ways):
        return (Stream(min(item.period_ns for item in single), _longest(item.jitter_ns for item in single)),)
    return tuple(item for way in known for item in way)


def looked_at(ways: Sequence[Streams], are_steady: Sequence[bool], period_ns: int) -> tuple[Stream, ...]:
    """The streams of jobs of a timer that finds an event of each way, of which it takes all at once.

    In the last period before the first job of a time some way had no event yet: all that it has had since are of that
    period and the time. Of each way one event at most is older than the first job. Of a slower way no event is older
    than the longest time that another one may have none (docs/semantics.md, section 3.8).

    >>> looked_at([(Stream(100, 20),), (Stream(100, 60),)], [False, False], 10)
    (Stream(period_ns=100, jitter_ns=70),)
    >>> looked_at([(Stream(100, 0),), (Stream(30, 5),)], [True, True], 10)
    (Stream(period_ns=100, jitter_ns=45),)
    >>> looked_at([(Stream(100, 0),), (Stream(30, 5),)], [False, False], 10)
    (Stream(period_ns=100, jitter_ns=100),)
    >>> looked_at([(Stream(10, 5),), None], [True, True], 10)
    (Stream(period_ns=10, jitter_ns=0),)
    """
    known = [way for way in ways if way is not None]
    slowest = min(known, key=lambda way: sum(Fraction(1) / one.period_ns for one in way), default=None)
    if slowest is None or sum(Fraction(1) / one.period_ns for one in slowest) * period_ns >= 1:
        return (Stream(period_ns),)
    first, *more = slowest
    late: list[Exact] = [first.jitter_ns + period_ns]
    held_back: list[Exact] = [first.jitter_ns + first.period_ns]
    is_known = not more
    for way, is_steady in zip(ways, are_steady, strict=True):
        if way is slowest:
            continue
        one = way[0] if way is not None and len(way) == 1 else None
        if one is not None and one.period_ns == first.period_ns:
            late.append(one.jitter_ns + period_ns)
            held_back.append(one.jitter_ns + one.period_ns)
        elif one is not None and is_steady:
            late.append(late[0] + one.period_ns + one.jitter_ns)
        else:
            is_known = False
    bounds = [*held_back, _longest(late)] if is_known else held_back
    return (Stream(first.period_ns, reduce(min, bounds)), *more)


def _spaced(stage: Stage, streams: Streams) -> Streams:
    """The streams of a stage that keeps its jobs apart: of its releases and of its separation the one of lower rate.

    Holding back what comes early keeps the bound of the streams (Le Boudec and Thiran, "Network Calculus", 1.5: shaping
    keeps arrival constraints).
    """
    if streams is None or stage.separation_ns is None:
        return streams
    rate = sum((Fraction(1) / item.period_ns for item in streams), Fraction(0))
    return (Stream(stage.separation_ns),) if rate * stage.separation_ns >= 1 else streams


def apart_ns(releases: Sequence[Stream], separation_ns: int | None) -> Exact | None:
    """The least time between two releases of a thread; None where it is released once only.

    In ns: period less jitter of a single stream, or the separation where that is greater; 0 for several streams.
    """
    if not releases:
        return None
    streams = releases[0].period_ns - releases[0].jitter_ns if len(releases) == 1 else 0
    return max(0, streams, separation_ns or 0)


def _longest(times: Iterable[Exact]) -> Exact:
    return reduce(max, times)


def _task_of(stage: Stage, streams: tuple[Stream, ...]) -> Task:
    """A stage that these streams release, with what it costs to switch to it and back."""
    return Task(stage.name, stage.cost_ns, streams, stage.separation_ns, stage.key)


@lru_cache(16384)
def _shared_task(stage: Stage, streams: tuple[Stream, ...]) -> Task:
    return _task_of(stage, streams)


def _late_task(stage: Stage) -> Task | None:
    """A stage that comes without a bound: None; one job of a stage that takes no time, which delays nothing."""
    return None if stage.cost_ns else once(stage)


def once(stage: Stage) -> Task:
    """One job of a stage."""
    return Task(stage.name, stage.cost_ns, (), None, stage.key)
