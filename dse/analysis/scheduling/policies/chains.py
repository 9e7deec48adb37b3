"""Chains on a core: threads that the end of the one before releases there, bounded as one job.

A thread that only the end of another one releases on the same core waits for none of the jobs before it in its chain.
From the release of the first thread v1 until the end of the last one vm the core serves nothing but the chain and what
is at least as urgent as its least urgent thread, or the chain is on its way between two threads. What is so urgent and
goes before it has been released since the core had last nothing of that to do. So each job of a rival counts once for
the whole chain, where the bounds of the threads, added up, count it for each (docs/semantics.md, section 4.9):

* Where a job of the chain always ends before the next one is released, the chain is one job that takes all its own
  time, and the times between its threads.
* Else, where nothing passes between the threads, let v be the first of them that is less urgent than all behind it.
  Job q of vm ends behind q jobs of v and of those behind v, and all jobs of the threads before v, which are released
  when v1 is: a later job of v waits until vm has ended.

The sum of the threads' own bounds may be less: the least of all ways to cut a chain into windows holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import cast

from dse.analysis.scheduling.busy_window import Kin, Task, TaskKey
from dse.analysis.scheduling.model import ChainKey, Entry, Resource, Stage, System
from dse.analysis.scheduling.policies.coupled import NOT_THERE
from dse.analysis.scheduling.policies.executors import shares_level
from dse.analysis.scheduling.policies.preemptive import Preempted, longest, present
from dse.analysis.scheduling.policies.reservations import gaps_and_servers
from dse.analysis.scheduling.policies.successions import MOST_THREADS, Succession, heads_of, may_have_windows
from dse.support.units import Exact

MOST_ON_CORE = 256
"""The threads of a core with more than this have no windows of chains: their number grows with its square."""


@dataclass(frozen=True, slots=True)
class Chain:
    """Threads in a row on one core, each released by the end of the one before.

    `members` are their positions on the resource, in the order of the chain. `lowest` is the position of the least
    urgent one, and `rivals` are the positions of what else may go before any of them. Where that one is in a callback
    group, `begun` are the positions of what is less urgent there, of which one job may have begun. That is once for
    each piece between breaks; in a part of a design once for all, since what is less urgent in the part may be a rival
    in the design, and come once. What they send each other takes `sent_ns` at most in all; `sent_to` are the places in
    the chain of threads that something takes time to reach. Threads between them that are left out of a part of a
    design take `absent_ns`.
    """

    key: ChainKey
    members: tuple[int, ...]
    lowest: int
    rivals: tuple[int, ...]
    begun: tuple[int, ...] = ()
    is_part: bool = False
    sent_ns: Exact = 0
    sent_to: tuple[int, ...] = ()
    absent_ns: int = 0

    @property
    def breaks(self) -> tuple[int, ...]:
        """The places in the chain of threads before which the core may turn to something less urgent.

        Those are all behind the first where something may have begun: a group takes its next job when one ends, and
        what that sends may be there only after it.
        """
        return tuple(range(1, len(self.members))) if self.begun and not self.is_part else self.sent_to

    def with_rivals_only(self) -> Chain:
        """The chain as if what may have begun were rivals."""
        return replace(self, rivals=tuple(sorted({*self.rivals, *self.begun})), begun=())


@dataclass(frozen=True, slots=True)
class _Link:
    """The thread before one on its core, by position, and what comes between: transmissions, and threads left out."""

    position: int
    sent_ns: Exact
    absent_ns: int = 0


def chains_in(system: System) -> list[tuple[Chain, ...]]:
    """For each resource every chain of two threads or more there, parts of longer chains among them.

    In a part of a design a thread that is left out may be on any core: a chain leads through it as if it were on the
    same one, so that no bound of the part is above that of the design.
    """
    if not any(stage.follows is not None for stage in system.stages.values()):
        return [()] * len(system.resources)
    if not system.is_part:
        stages = system.stages
        return [_whole(item, tuple(stages[entry.key] for entry in item.entries)) for item in system.resources]
    present = {entry.key for resource in system.resources for entry in resource.entries}
    absent = {key: stage for key, stage in system.stages.items() if key not in present}
    return [
        _chains(item, [system.stages[entry.key] for entry in item.entries], absent, is_part=True)
        for item in system.resources
    ]


@lru_cache(4096)
def _whole(resource: Resource, stages: tuple[Stage, ...]) -> tuple[Chain, ...]:
    return _chains(resource, stages, {}, is_part=False)


def _chains(
    resource: Resource, stages: Sequence[Stage], absent: Mapping[TaskKey, Stage], *, is_part: bool
) -> tuple[Chain, ...]:
    if resource.wire is not None or resource.is_accelerator or len(resource.entries) > MOST_ON_CORE:
        return ()
    entries = resource.entries
    positions = {
        entry.key: position for position, entry in enumerate(entries) if may_have_windows(entry, stages[position])
    }
    before = {
        position: link
        for position in positions.values()
        if (link := _link(stages[position], positions, absent)) is not None
    }
    chains = []
    for last in before:
        members, links = [last], list[_Link]()
        while (link := before.get(members[0])) is not None and link.position not in members:
            if len(members) == MOST_THREADS:
                break
            members.insert(0, link.position)
            links.insert(0, link)
            chains.append(_chain(resource, stages, tuple(members), links, is_part=is_part))
    return tuple(chains)


def _link(stage: Stage, positions: Mapping[TaskKey, int], absent: Mapping[TaskKey, Stage]) -> _Link | None:
    """The thread before a stage in its chain on the core, reached also through threads that are left out; or None."""
    sent: Exact = 0
    passed: list[TaskKey] = []
    link = stage.follows if stage.is_chained else None
    while link is not None and link.after is not None and link.after not in passed:
        sent += link.most_ns
        if link.after in positions:
            return _Link(positions[link.after], sent, sum(absent[key].worst_ns for key in passed))
        if link.after not in absent:
            return None
        passed.append(link.after)
        link = absent[link.after].follows if absent[link.after].is_chained else None
    return None


def _chain(
    resource: Resource, stages: Sequence[Stage], members: tuple[int, ...], links: Sequence[_Link], *, is_part: bool
) -> Chain:
    entries = resource.entries
    lowest = _lowest(entries, members)
    rivals = set[int]().union(*(entries[position].rivals for position in members)) - set(members)
    working = (position for position in rivals if stages[position].cost_ns)
    begun = {position for position in working if _may_have_begun(resource, lowest, position)}
    key = (entries[members[-1]].key[0], entries[members[0]].key[0])
    sent_to = tuple(place for place, link in enumerate(links, 1) if link.sent_ns)
    sent = sum(link.sent_ns for link in links)
    absent_ns = sum(link.absent_ns for link in links)
    return Chain(
        key, members, lowest, tuple(sorted(rivals - begun)), tuple(sorted(begun)), is_part, sent, sent_to, absent_ns
    )


def _lowest(entries: Sequence[Entry], members: Sequence[int]) -> int:
    """The position of the least urgent thread: of those in one executor the one that fewest of it go behind."""
    last = entries[max(members)]
    if last.executor is None:
        return max(members)
    inside = (position for position in members if entries[position].executor == last.executor)
    return max(inside, key=lambda position: len(entries[position].urgent))


def _may_have_begun(resource: Resource, lowest: int, position: int) -> bool:
    """Whether one job of another stage at most goes before a stage: a less urgent one of its callback group."""
    entry = resource.entries[lowest]
    if entry.executor is None or resource.entries[position].executor != entry.executor:
        return False
    is_group = resource.kinds[entry.executor] == "callback_group" and not shares_level(resource, lowest)
    return is_group and position not in entry.urgent


def windows_of(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], succession: Succession
) -> list[tuple[Chain, Preempted]]:
    """The busy windows each of which bounds a chain, with the chain as it is looked at.

    Where something less urgent in the group of its least urgent thread may have begun, as often as the core may turn to
    it, that may be rivals of the chain as well.
    """
    ways = [chain, chain.with_rivals_only()] if chain.begun else [chain]
    found = ((way, _longest_window(resource, way, tasks, succession)) for way in ways)
    return [(way, window) for way, window in found if window is not None]


def _longest_window(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], succession: Succession
) -> Preempted | None:
    """The busy window from the release of the first thread of a chain until the end of the last one.

    What passes between the threads counts with what blocks them. None where the first thread or a rival comes without a
    bound, and where jobs of a thread may meet of which an executor drops some.
    """
    first, last = (resource.entries[chain.members[place]].key for place in (0, -1))
    is_apart = succession.are_apart(first, last)
    stages = succession.events.stages
    if not is_apart and any(stages[resource.entries[item].key].keeps is not None for item in chain.members):
        return None
    pieces = 1 + len(chain.breaks) if is_apart or not chain.breaks else None
    ends = chain.members[0], chain.members[-1]
    tasks = _behind_begun(resource, chain, tasks, succession) if chain.begun and not chain.is_part else tasks
    cases = succession.cases(resource.entries[chain.lowest].key, ends, tasks, pieces)
    return longest([_window_of(resource, chain, case, succession, is_apart=is_apart) for case in cases])


def _window_of(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], succession: Succession, *, is_apart: bool
) -> Preempted | None:
    """The window of a chain where its threads and rivals come as `tasks`.

    It `is_apart` where each job of the chain has ended when the next one is released.
    """
    entries, lowest = resource.entries, resource.entries[chain.lowest]
    first, last = (entries[chain.members[place]].key for place in (0, -1))
    head = tasks[chain.members[0]]
    if head is None:
        return None
    stages = (succession.events.stages[entries[position].key] for position in chain.members)
    own = [Task(one.name, one.cost_ns, head.streams, head.separation_ns, one.key) for one in stages]
    found = [*gaps_and_servers(resource, lowest, tasks), *(tasks[position] for position in chain.rivals)]
    if None in found:
        return None
    rivals = tuple(item for item in found if item is not None and item is not NOT_THERE)
    blocked_ns = max(
        [lowest.blocking_ns, *(succession.events.stages[entries[item].key].cost_ns for item in chain.begun)]
    )
    way_ns = len(chain.breaks) * (lowest.blocking_ns if chain.is_part else blocked_ns) + chain.sent_ns
    meeting: Preempted | None = None
    if not is_apart:
        has_section = (succession.events.stages[entries[item].key].has_section for item in chain.members[:-1])
        in_executor = (entries[item].executor is not None for item in chain.members[:-1])
        is_cut = any(one and other for one, other in zip(has_section, in_executor, strict=True))
        place = len(own) - 1 if chain.breaks or is_cut else _first_in_turn(entries, chain.members)
        in_turn_ns = sum(item.worst_ns for item in own[place:]) + chain.absent_ns + way_ns
        meeting = Preempted(replace(own[-1], worst_ns=cast(int, in_turn_ns)), (*own[:place], *rivals), blocked_ns)
        if not chain.breaks:
            return meeting
    over = succession.over_before(chain.members, _same_home(entries, chain)) if is_apart else ()
    kin = present(tasks, (position for position in chain.rivals if position in over))
    work_ns = sum(item.worst_ns for item in own) + chain.absent_ns
    whole = Task(own[-1].name, work_ns, head.streams, head.separation_ns, own[-1].stage)
    under_way_ns = sum(item.worst_ns for item in own[chain.breaks[0] :]) if chain.breaks else 0
    if meeting is not None:  # no less than where jobs do not meet
        return longest([meeting, Preempted(whole, rivals, blocked_ns + way_ns, Kin(kin, under_way_ns))])
    rest_ns = succession.rest_ns(first, last)
    if under_way_ns and rest_ns is not None:
        lone = Preempted(Task(whole.name, under_way_ns, ()), rivals, blocked_ns).response_ns()
        if lone is not None and lone <= rest_ns:  # what the job before leaves, and all behind it, is over by then
            under_way_ns = 0
    return Preempted(whole, rivals, blocked_ns + way_ns, Kin(kin, under_way_ns))


def _behind_begun(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], succession: Succession
) -> Sequence[Task | None]:
    """The stages as they come in the window of a chain: behind what has begun in its group no less often than ever.

    A job of that which had been released before the window may end in each piece of it.
    """
    events, entries = succession.events, resource.entries
    home = entries[chain.lowest].executor
    inside = {item.key for item in entries if item.executor == home} - {entries[item].key for item in chain.begun}
    found = list(tasks)
    for position, entry in enumerate(entries):
        if entry.key in inside:
            heads = heads_of(events.stages, entry.key, inside)
            found[position] = events.released_as(entry.key, heads) if heads else events.task(entry.key)
    return found


def _same_home(entries: Sequence[Entry], chain: Chain) -> Sequence[int]:
    """The rivals of a chain that are in all of the executors that it leads through.

    Others count in the response times of its threads in there, though they never wait when these do. So they do in its
    window, or that would take less than a thread of it alone.
    """
    homes = {entries[position].executor for position in chain.members} - {None}
    return [position for position in chain.rivals if homes <= {entries[position].executor}]


def _first_in_turn(entries: Sequence[Entry], members: Sequence[int]) -> int:
    """The place of the first thread of a chain that goes before none of those behind it."""
    return next(
        place
        for place, position in enumerate(members)
        if not any(position in entries[other].rivals for other in members[place + 1 :])
    )
