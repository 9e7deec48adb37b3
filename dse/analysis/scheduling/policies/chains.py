"""Chains on a core: threads that the end of the one before releases there, bounded as one job.

A thread that only the end of another one releases, at once and on the same core, waits for none of the jobs before it
in its chain. From the release of the first thread v1 until the end of the last one vm the core serves, without a break,
nothing but the chain and what is at least as urgent as its least urgent thread. In a busy period at that level job q of
vm therefore ends no later than

    w = B + q C(vm) + sum over the other threads of the chain C ceil((w + J(v1)) / T) + work of the rivals in w

which is the busy window of vm, released when v1 is, behind the threads before it, which are released then too
(docs/semantics.md, section 4.9). The thread-by-thread bound counts a rival anew for each thread; this one counts it
once. Either may be less: the least of all ways to cut a chain into windows holds.
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
from dse.analysis.scheduling.policies.successions import is_prioritised
from dse.analysis.scheduling.tasks import TaskKey

ReleasedAs: TypeAlias = Callable[[TaskKey, TaskKey], Task | None]
"""A stage as a job that is released when another stage is; None where that comes without a bound."""


@dataclass(frozen=True, slots=True)
class Chain:
    """Threads in a row on one core, each released at once by the end of the one before.

    `members` are their positions on the resource, in the order of the chain. `lowest` is the position of the least
    urgent one, and `rivals` are the positions of what else may go before any of them.
    """

    key: ChainKey
    members: tuple[int, ...]
    lowest: int
    rivals: tuple[int, ...]


def chains_on(resource: Resource, stages: Mapping[TaskKey, Stage]) -> tuple[Chain, ...]:
    """Every chain of two threads or more on a core, parts of longer chains among them, by the position of its end."""
    return _chains(resource, tuple(stages[entry.key] for entry in resource.entries))


@lru_cache(4096)
def _chains(resource: Resource, stages: tuple[Stage, ...]) -> tuple[Chain, ...]:
    if resource.wire is not None or resource.is_accelerator:
        return ()
    entries = resource.entries
    positions = {entry.key: position for position, entry in enumerate(entries)}
    before: dict[int, int] = {}
    for position, stage in enumerate(stages):
        link = stage.follows
        found = None if link is None or link.most_ns or link.after is None else positions.get(link.after)
        if (
            found is not None
            and is_prioritised(entries[found], stages[found])
            and is_prioritised(entries[position], stage)
        ):
            before[position] = found
    chains = []
    for last in before:
        members = [last]
        while (found := before.get(members[0])) is not None and found not in members:
            members.insert(0, found)
            chains.append(_chain(entries, tuple(members)))
    return tuple(chains)


def _chain(entries: Sequence[Entry], members: tuple[int, ...]) -> Chain:
    rivals = set[int]().union(*(entries[position].rivals for position in members)) - set(members)
    key = (entries[members[-1]].key[0], entries[members[0]].key[0])
    return Chain(key, members, max(members), tuple(sorted(rivals)))


def window_of(
    resource: Resource, chain: Chain, tasks: Sequence[Task | None], released_as: ReleasedAs, over: frozenset[int]
) -> Preempted | None:
    """The busy window from the release of the first thread of a chain until the end of the last one.

    The rivals `over` never wait while a thread of the chain does. None where a rival, or the release of the first
    thread, has no bound. Where the last thread ends at all follows from
    the window: no response time of a member is asked for.
    """
    entries, lowest = resource.entries, resource.entries[chain.lowest]
    first = entries[chain.members[0]].key
    own = [released_as(entries[position].key, first) for position in chain.members]
    found = [*own[:-1], *gaps_and_servers(resource, lowest, tasks), *(tasks[position] for position in chain.rivals)]
    rivals = tuple(item for item in found if item is not None)
    if own[-1] is None or len(rivals) < len(found):
        return None
    kin = tuple(item for position in chain.rivals if position in over and (item := tasks[position]) is not None)
    return Preempted(own[-1], rivals, lowest.blocking_ns, kin, sum(item.worst_ns for item in own if item is not None))

