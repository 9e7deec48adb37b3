"""Chains on a core: threads that the end of the one before releases there, bounded as one job.

A thread that only the end of another one releases on the same core waits for none of the jobs before it in its chain.
From the release of the first thread v1 until the end of the last one vm the core serves nothing but the chain and what
is at least as urgent as its least urgent thread, or the chain is on its way between two threads. What is so urgent and
goes before it has been released since the core had last nothing of that to do. So each job of a rival counts once for
the whole chain, where the bounds of the threads, added up, count it for each (docs/semantics.md, section 4.9):

* Where a job of the chain always ends before the next one is released, the chain is one job that takes all its own
  time, and the times between its threads.
* Else, where nothing passes between the threads, job q of vm ends behind q jobs of its own and all jobs of the threads
  before it, which are released when v1 is: the busy window of vm with these as rivals.

The sum of the threads' own bounds may be less: the least of all ways to cut a chain into windows holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

from dse.analysis.scheduling.busy_window import Task
from dse.analysis.scheduling.model import ChainKey, Entry, Resource, Stage
from dse.analysis.scheduling.policies.preemptive import Preempted
from dse.analysis.scheduling.policies.reservations import gaps_and_servers
from dse.analysis.scheduling.policies.successions import Succession, is_prioritised
from dse.analysis.scheduling.tasks import TaskKey
from dse.support.units import Exact

ReleasedAs: TypeAlias = Callable[[TaskKey, TaskKey], Task | None]
"""A stage as a job that is released when another stage is; None where that comes without a bound."""


@dataclass(frozen=True, slots=True)
class Chain:
    """Threads in a row on one core, each released by the end of the one before.

    `members` are their positions on the resource, in the order of the chain. `lowest` is the position of the least
    urgent one, and `rivals` are the positions of what else may go before any of them. What they send each other takes
    `sent_ns` at most in all; `breaks` are the places in the chain of threads that something takes time to reach.
    """

    key: ChainKey
    members: tuple[int, ...]
    lowest: int
    rivals: tuple[int, ...]
    sent_ns: Exact = 0
    breaks: tuple[int, ...] = ()


def chains_on(resource: Resource, stages: Mapping[TaskKey, Stage]) -> tuple[Chain, ...]:
    """Every chain of two threads or more on a core, parts of longer chains among them, by the position of its end."""
    return _chains(resource, tuple(stages[entry.key] for entry in resource.entries))


@lru_cache(4096)
def _chains(resource: Resource, stages: tuple[Stage, ...]) -> tuple[Chain, ...]:
    if resource.wire is not None or resource.is_accelerator:
        return ()
    entries = resource.entries
    positions = {
        entry.key: position
        for position, entry in enumerate(entries)
        if is_prioritised(entry, stages[position])
    }
    before: dict[int, tuple[int, Exact]] = {}
    for position in positions.values():
        link = stages[position].follows
        if link is not None and link.after is not None and link.after in positions:
            before[position] = positions[link.after], link.most_ns
    chains = []
    for last in before:
        members, times = [last], list[Exact]()
        while (found := before.get(members[0])) is not None and found[0] not in members:
            members.insert(0, found[0])
            times.insert(0, found[1])
            chains.append(_chain(entries, tuple(members), times))
    return tuple(chains)


def _chain(entries: Sequence[Entry], members: tuple[int, ...], times: Sequence[Exact]) -> Chain:
    rivals = set[int]().union(*(entries[position].rivals for position in members)) - set(members)
    key = (entries[members[-1]].key[0], entries[members[0]].key[0])
    breaks = tuple(place for place, time in enumerate(times, 1) if time)
    return Chain(key, members, max(members), tuple(sorted(rivals)), sum(times), breaks)


def window_of(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], released_as: ReleasedAs, succession: Succession
) -> Preempted | None:
    """The busy window from the release of the first thread of a chain until the end of the last one.

    What passes between the threads counts with what blocks them. None where the first thread or a rival comes without a
    bound, and where jobs of a chain meet that takes time between its threads.
    """
    entries, lowest = resource.entries, resource.entries[chain.lowest]
    first, last = (entries[chain.members[place]].key for place in (0, -1))
    own = [item for position in chain.members if (item := released_as(entries[position].key, first)) is not None]
    found = [*gaps_and_servers(resource, lowest, tasks), *(tasks[position] for position in chain.rivals)]
    rivals = tuple(item for item in found if item is not None)
    if not own or len(rivals) < len(found):
        return None
    if not succession.are_apart(first, last):
        return None if chain.breaks else Preempted(own[-1], (*own[:-1], *rivals), lowest.blocking_ns)
    over = succession.over_before(chain.members, chain.rivals)
    kin = tuple(item for position in chain.rivals if position in over and (item := tasks[position]) is not None)
    whole = Task(own[-1].name, sum(item.worst_ns for item in own), own[-1].streams, None, own[-1].stage)
    under_way_ns = sum(item.worst_ns for item in own[chain.breaks[0] :]) if chain.breaks else 0
    waits_ns = (1 + len(chain.breaks)) * lowest.blocking_ns + chain.sent_ns
    return Preempted(whole, rivals, waits_ns, kin, under_way_ns)
