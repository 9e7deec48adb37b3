"""Threads that others on their core release: how often they come in a busy window of some priority.

From the beginning of a busy window until its end the core runs what is at least as urgent, and nothing else. Of a
thread that comes behind a less urgent one of the core in its chain, whatever is between, only those jobs come in the
window that are on their way when it begins: the less urgent thread ends no job meanwhile. Behind the thread itself
whose window it is come those on their way, and one for each earlier job. One that is released at once by a predecessor
as urgent comes no more often than that: what this had released before has ended. When the window begins one less
urgent thread at most has just ended, or has a section that nothing interrupts: what others of these release at once
does not come. In that case what comes before that thread in its chain comes later than it may come otherwise
(docs/semantics.md, section 4.9).

That is counted where the file states cores and priorities. Where they are decisions a thread that joins a core would
make bounds less, and what is learnt of few threads would not hold of more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple, TypeAlias

from dse.analysis.scheduling.busy_window import Behind, Stream, Task, TaskKey
from dse.analysis.scheduling.event_models import EventModels, once
from dse.analysis.scheduling.model import Resource, Stage
from dse.support.units import Exact, picked

MOST_ON_WAY = 16
"""The greatest number of messages on their way that is told."""
NOT_THERE = Task("", 0, ())
"""In place of a stage that does not come in a window."""
SpansTo: TypeAlias = Callable[[TaskKey], Iterable[tuple[TaskKey, Exact]]]
"""Gives the stages of a chain up to one, the nearest first, each with the longest time from its release to that end."""


class OnWay(NamedTuple):
    """How many jobs of a stage come, from some time on, of jobs of one before it in its chain that have ended by then.

    `most` are these, `most_sooner` of jobs that have ended before that time; None where it is not known. A job comes no
    later than `longest_ns` after the one of the other stage is released.
    """

    before: Stage
    most: int | None
    most_sooner: int | None
    longest_ns: Exact | None = None


class OnWays:
    """The stages that each stage of a core is behind, and how often it comes in windows by that; found when asked.

    `behind_of` gives what a stage is behind, the nearest first. All that a stage as urgent as the window releases in it
    comes of jobs released in the window, besides those on their way when it begins.
    """

    def __init__(self, behind_of: Callable[[TaskKey], Sequence[OnWay]]) -> None:
        self.behind_of = cache(behind_of)
        self._most: dict[tuple[TaskKey, int, int | None], int | None] = {}
        self._sooner: dict[tuple[TaskKey, int, TaskKey], int | None] = {}

    def most(self, key: TaskKey, priority: int, pieces: int | None) -> int | None:
        """The most jobs of a stage in a window of a priority, for less urgent ones before it end none there.

        But for one at the begin of each of so many `pieces`; None where that is not known.
        """
        place = key, priority, pieces
        if place not in self._most:
            self._most[place] = None  # in a circle
            found = list[int]()
            for item in self.behind_of(key):
                if _priority(item.before) < priority:
                    found += [] if item.most is None or pieces is None else [pieces * item.most]
                elif item.most_sooner is not None:
                    before = self.most(item.before.key, priority, pieces)
                    found += [] if before is None else [before + item.most_sooner]
            self._most[place] = min(found, default=None)
        return self._most[place]

    def sooner(self, key: TaskKey, priority: int, last: TaskKey) -> int | None:
        """The most jobs of a stage in a window besides one for each job of that which has ended; None: not known."""
        place = key, priority, last
        if place not in self._sooner:
            self._sooner[place] = None  # in a circle
            found = list[int]()
            for item in self.behind_of(key):
                if item.most_sooner is None:
                    continue
                if item.before.key == last:
                    found.append(item.most_sooner)
                elif _priority(item.before) >= priority:
                    before = self.sooner(item.before.key, priority, last)
                    found += [] if before is None else [before + item.most_sooner]
            self._sooner[place] = min(found, default=None)
        return self._sooner[place]


def is_coupled(stages: Mapping[TaskKey, Stage], stage: Stage) -> bool:
    """Whether a stage comes behind another one on the same stated core in its chain."""
    return next(_all_before(stages, stage), None) is not None


def behind_on_core(
    events: EventModels, stage: Stage, spans_to: SpansTo, is_apart: Callable[[TaskKey, Exact], bool]
) -> Iterator[OnWay]:
    """How many jobs of a stage are on their way at some time behind each stage before it in its chain on its core.

    `spans_to` gives the longest times from stages of a chain up to the end of one, `is_apart` whether a stage is not
    released again within some time.
    """
    stages = events.stages
    wanted = {before.key: before for before in _all_before(stages, stage)}
    if not wanted:
        return
    link = stage.follows
    assert link is not None
    assert link.after is not None
    if link.after in wanted:
        yield behind_next(stage, wanted[link.after])
    ways: dict[TaskKey, Exact] = {link.after: link.most_ns}
    for key, span in spans_to(link.after):
        if (before := wanted.get(key)) is not None:
            if is_apart(key, span + link.most_ns):  # a job is not released before the one before it has come through
                yield OnWay(before, 1, 1, span + link.most_ns)
            elif key in ways and (leaving := events.leaving(key)) is not None:
                within = sum(1 + (ways[key] + one.jitter_ns) // one.period_ns for one in leaving)
                sooner = sum(-(-(ways[key] + one.jitter_ns) // one.period_ns) for one in leaving)
                yield OnWay(before, None if before.has_section else within, sooner, span + link.most_ns)
        further = stages[key].follows
        if further is not None and further.after is not None:
            ways[further.after] = span + link.most_ns + further.most_ns


def behind_next(stage: Stage, before: Stage) -> OnWay:
    """How many messages are on their way from a stage to the next one at most: jobs end no closer than they take."""
    link = stage.follows
    assert link is not None
    if not link.most_ns:
        return OnWay(before, 1, 0)
    most = next((jobs for jobs in range(1, MOST_ON_WAY + 1) if link.most_ns < jobs * before.best_ns), None)
    sooner = next((jobs for jobs in range(1, MOST_ON_WAY + 1) if link.most_ns <= jobs * before.best_ns), None)
    return OnWay(before, None if before.has_section else most, sooner)


def cases_in_window(
    events: EventModels,
    resource: Resource,
    level: TaskKey,
    ends: tuple[int, TaskKey],
    tasks: Sequence[Task | None],
    ways: OnWays,
    pieces: int | None = 1,
) -> list[Sequence[Task | None]]:
    """The stages of a resource as they come in a busy window of the priority of one of them, in each case there is.

    `tasks` are they as they come at any time; None is one that comes without a bound, `NOT_THERE` one that does not
    come. The window is that of the stages from that at a position to another one, its `ends`. They are under way
    between so many `pieces` (None: as many as come), each of which may begin behind another less urgent thread.
    """
    first, last = ends
    stated = events.stages[level].stated
    if stated is None:
        return [tasks]
    found: list[Task | None] = []
    behind: dict[TaskKey, list[int]] = {}
    first_key = resource.entries[first].key
    for position, (entry, task) in enumerate(zip(resource.entries, tasks, strict=True)):
        if not ways.behind_of(entry.key):
            found.append(task)
            continue
        stage = events.stages[entry.key]
        passed, less_urgent = _up_to_head(events.stages, stage, stated.priority)
        comes = task if len(passed) == 1 else events.released_as(stage.key, [one.key for one in passed[1:]])
        most = ways.most(entry.key, stated.priority, pieces)
        is_once = most == 1 and pieces == 1
        if is_once:
            comes = once(stage)
            if less_urgent is not None and not _sent_ns(passed[-1]):
                behind.setdefault(less_urgent.key, []).append(position)
        elif most is not None and position != first:
            comes = replace(once(stage) if comes is None else comes, most=most)
        if pieces == 1 and position != first and comes is not None:
            sooner = ways.sooner(entry.key, stated.priority, last)
            if sooner is not None:
                known = (item for one in passed for item in ways.behind_of(one.key))
                reach = least_known(item.longest_ns for item in known if item.before.key == first_key)
                comes = replace(comes, behind=_behind(events, first_key, sooner, reach))
        found.append(comes)
    if not behind:
        return [found]
    grouped = {position for members in behind.values() for position in members}
    own = next((key for key, members in behind.items() if first in members), None)
    ended: list[TaskKey | None] = [None, *behind] if own is None else [own]
    cases: list[Sequence[Task | None]] = []
    for less_urgent_key in ended:
        there = set() if less_urgent_key is None else behind[less_urgent_key]
        case = [
            NOT_THERE if position in grouped and position not in there else task for position, task in enumerate(found)
        ]
        if less_urgent_key is not None:
            _delay(events, resource, less_urgent_key, first, case)
        cases.append(case)
    return cases


def _behind(events: EventModels, first: TaskKey, sooner: int, reach_ns: Exact | None) -> Behind:
    """The limits of jobs that come behind a stage, or the last one of a chain that it begins, in windows of these.

    `sooner` jobs have been released by jobs that ended before the window; one comes within `reach_ns` of the release of
    the first stage, None where that has no bound. Without one stream that releases the first stage no limit by its
    release is known.
    """
    streams = events.streams(first)
    if streams is None or len(streams) != 1 or reach_ns is None:
        return Behind(sooner, None, 1)
    return Behind(sooner, reach_ns + streams[0].jitter_ns, streams[0].period_ns)


def least_known(numbers: Iterable[Exact | None]) -> Any:
    """The least of some numbers; None where none of them is known."""
    known = [number for number in numbers if number is not None]
    return min(known, default=None)


def _priority(stage: Stage) -> int:
    assert stage.stated is not None
    return stage.stated.priority


def _up_to_head(stages: Mapping[TaskKey, Stage], stage: Stage, priority: int) -> tuple[list[Stage], Stage | None]:
    """A stage and those before it of whose releases it comes no more often than in windows of a priority.

    With them the less urgent stage that releases the last of these, if such a one does.
    """
    passed = [stage]
    while (before := releaser_on_core(stages, passed[-1])) is not None and before not in passed:
        assert before.stated is not None
        if before.stated.priority < priority:
            return passed, before
        if _sent_ns(passed[-1]):
            break
        passed.append(before)
    return passed, None


def _sent_ns(stage: Stage) -> Exact:
    """How long a message takes at most that releases a stage behind another one."""
    assert stage.follows is not None
    return stage.follows.most_ns


def _delay(events: EventModels, resource: Resource, key: TaskKey, first: int, case: list[Task | None]) -> None:
    """Let what comes before a stage in its chain come as late as it does where that stage has just ended.

    The next job of the chain begins a period after that one, which ends no later than its bound. The stage at the
    position `first`, whose window it is, comes as before: else a bound would fall when another stage joins the core.
    """
    passed_on = events.leaving(key)
    way = list(_way_up(events.stages, key))
    if passed_on is None or len(passed_on) != 1 or not way or events.stages[way[-1][0]].separation_ns is not None:
        return
    (last,), shortest = passed_on, dict(way)
    for position, entry in enumerate(resource.entries):
        task = case[position]
        if position == first or entry.key not in shortest or task is None:
            continue
        if task.separation_ns is not None or len(task.streams) != 1:
            continue
        (stream,) = task.streams
        if stream.period_ns == last.period_ns:
            later = last.jitter_ns + shortest[entry.key] - last.period_ns
            case[position] = replace(task, streams=(Stream(stream.period_ns, picked("min", stream.jitter_ns, later)),))


def _way_up(stages: Mapping[TaskKey, Stage], key: TaskKey) -> Iterator[tuple[TaskKey, Exact]]:
    """The stages before one in its chain, the nearest first, each with the least time from its release to that end."""
    least: Exact = stages[key].best_ns
    passed = {key}
    while (link := stages[key].follows) is not None and link.after is not None and link.after not in passed:
        key = link.after
        if stages[key].pieces:
            return
        passed.add(key)
        least += link.least_ns + stages[key].best_ns
        yield key, least


def _all_before(stages: Mapping[TaskKey, Stage], stage: Stage) -> Iterator[Stage]:
    """The stages before one in its chain that are on its stated core and take time, the nearest first."""
    link, passed = stage.follows, {stage.key}
    while stage.stated is not None and link is not None and link.after is not None and link.after not in passed:
        before = stages[link.after]
        if before.stated is not None and before.stated.shares_core(stage.stated) and before.cost_ns != 0:
            yield before
        passed.add(link.after)
        link = before.follows


def releaser_on_core(stages: Mapping[TaskKey, Stage], stage: Stage) -> Stage | None:
    """The stage whose end releases one, where both are on one stated core with stated priorities, and take time."""
    link = stage.follows
    if stage.stated is None or link is None or link.after is None:
        return None
    before = stages[link.after]
    is_there = before.stated is not None and before.stated.shares_core(stage.stated) and before.cost_ns != 0
    return before if is_there else None
