"""How long a chain of threads takes: the least of all ways to cut it into busy windows.

(docs/semantics.md, section 4.9)

Threads of a flow of which each is released by the end of the one before take no longer than the sum of their response
times. Where they are one chain on a core, the windows of the chain and of its parts may give less.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial, reduce
from itertools import pairwise
from typing import Any

from dse.analysis.memo import Recall
from dse.analysis.scheduling.fixed_point import solve
from dse.analysis.scheduling.model import ChainKey, LagKey
from dse.analysis.scheduling.resolve import resolve
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses, bounded_response_ns, counted_ns
from dse.analysis.scheduling.tasks import longest_alone_ns, task_keys
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.space.model.flows import Step
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact, picked

ABSENT = object()
"""Stands for a bound of what the design does not have."""
_ENDS: Recall[tuple[Exact | None, ...]] = Recall()


def chain_of(step: Step) -> FlowChain:
    """The threads that may be one chain with that of a step of a flow, itself among them; itself alone without."""
    return FlowChain(step.chain or (step.index,), step.has_source)


def longer_by_ns(space: Space, step: Step, view: View, *, is_paired: bool = False) -> Exact:
    """How much longer the chain of a step of a flow takes with its thread than up to the one before, in ns.

    Where the thread is not chained to others in the design it is its response time, or its lag; `UNBOUNDED_NS` without
    a bound. Where it `is_paired` it takes messages in order: all of its chain counts from its latest release.
    """
    chain = chain_of(step)
    longer = _longer_ns(space, chain, view)[chain.threads.index(step.index)]
    if not is_paired or longer >= UNBOUNDED_NS:
        return longer
    latest = _ends_ns(space, replace(chain, is_paired=True), view)[-1]
    if len(chain.threads) == 1:
        return latest
    whole = _ends_ns(space, chain, view)[-1]
    return longer if whole >= UNBOUNDED_NS else longer - (whole - latest)


def chain_wait_ns(space: Space, chain: FlowChain, view: View) -> Exact:
    """How long threads of a flow that may be one chain wait for others, all of them together.

    In ns; `UNBOUNDED_NS` and more without a bound.
    """
    alone = (longest_alone_ns(space, number, "thread", view) for number in chain.threads)
    whole = _ends_ns(space, chain, view)[-1]
    return (whole if whole < UNBOUNDED_NS else sum(_longer_ns(space, chain, view))) - sum(alone)


def _longer_ns(space: Space, chain: FlowChain, view: View) -> list[Exact]:
    """For each thread of a chain how much longer the chain takes with it than up to the one before, in ns.

    All of them together are the bound of the chain. A thread ends no later than one behind it, less the longest times
    of the threads from there on. Of threads behind the last bound of the chain it is the response time.
    """
    ends = _ends_ns(space, chain, view)
    latest = [ends[-1]]
    for number, end in zip(reversed(chain.threads), reversed(ends[:-1]), strict=True):
        if latest[0] < UNBOUNDED_NS:
            end = picked("min", end, latest[0] - longest_alone_ns(space, number, "thread", view))
        latest.insert(0, end)
    return [
        after - before if after < UNBOUNDED_NS else bounded_response_ns(space, number, "thread", view)
        for number, (before, after) in zip(chain.threads, pairwise(latest), strict=True)
    ]


def least_cut(space: Space, chain: FlowChain, view: View) -> list[FlowChain]:
    """The parts into which a chain of a whole design is cut so that it takes the least time, in their order.

    Each part is a thread alone or threads with one window; of equal times the one that has more parts.
    """
    ends = _ends_ns(space, chain, view)
    found, last = list[FlowChain](), len(chain.threads)
    while last:
        first = min(_ways(space, chain, last - 1, view), key=lambda way: (ends[way[0]] + way[1], -way[0]))[0]
        is_paired = chain.is_paired and not first
        found.insert(0, replace(chain, threads=chain.threads[first:last], is_paired=is_paired))
        last = first
    return found


def _ends_ns(space: Space, chain: FlowChain, view: View) -> list[Exact]:
    """For each thread of a chain when it ends at the latest after the release of the first one, and 0 before them.

    Of a chain with its source lags count in place of response times: then it is after the latest release of that. Of
    one that `is_paired` the first thread counts from the latest release by messages in order.
    """
    ends: list[Exact] = [0]
    for last in range(len(chain.threads)):
        ways = (ends[first] + takes for first, takes in _ways(space, chain, last, view))
        ends.append(reduce(partial(picked, "min"), ways))
    return ends


def _ways(space: Space, chain: FlowChain, last: int, view: View) -> Iterator[tuple[int, Exact]]:
    """The ways to bound the end of a thread of a chain: by its own time, and by windows that begin with one before it.

    Pairs of the place of the first thread that a time is counted from, and that time in ns.
    """
    number = chain.threads[last]
    yield last, _alone_ns(space, number, view, has_source=chain.has_source)
    if chain.is_paired:
        yield 0, _paired_ns(space, chain.threads[: last + 1], view)
    for first in range(last):
        window = _window_ns(space, (number, chain.threads[first]), view, has_source=chain.has_source)
        if window is not ABSENT:
            yield first, counted_ns(window)


def _alone_ns(space: Space, number: int, view: View, *, has_source: bool) -> Exact:
    """The response time of a thread as a number, or its lag where it has one."""
    lag: Any = _end_ns(space, (number, number, "lag"), view) if has_source else ABSENT
    if lag is ABSENT:
        return bounded_response_ns(space, number, "thread", view)
    found: Exact = picked("max", counted_ns(lag), longest_alone_ns(space, number, "thread", view))
    return found


def _paired_ns(space: Space, threads: Sequence[int], view: View) -> Exact:
    """How long after the latest release of the first of them threads end, of which that takes messages in order, in ns.

    `UNBOUNDED_NS` where it is not known: more than priorities schedules one, or several have no window together.
    """
    lag: Any = _end_ns(space, (threads[-1], threads[0], "joined"), view)
    if lag is ABSENT:
        return UNBOUNDED_NS
    return (
        counted_ns(lag)
        if len(threads) > 1
        else picked("max", counted_ns(lag), longest_alone_ns(space, threads[0], "thread", view))
    )


def _window_ns(space: Space, key: ChainKey, view: View, *, has_source: bool) -> Any:
    """The bound of a chain's window in ns, or its lag where it has one; see `_end_ns`."""
    lag = _end_ns(space, (*key, "lag"), view) if has_source else ABSENT
    return _end_ns(space, key, view) if lag is ABSENT else lag


def _end_ns(space: Space, key: ChainKey | LagKey, view: View) -> Any:
    """The bound of a chain's window or a lag in ns, None without one; `ABSENT` where the design has no such thing."""
    if type(view) is View:
        return all_responses(space, view).get(key, ABSENT)
    asked = ("end", *key)
    if asked not in view.memo:
        view.memo[asked] = _ENDS.recall(space, key, view, _found)
    found = view.memo[asked]
    return found[0] if found else ABSENT


def _found(space: Space, key: ChainKey | LagKey, view: View) -> tuple[Exact | None, ...]:
    """The bound of a chain's window or a lag in ns, None without one; nothing where the design has no such thing."""
    if at(space.components[key[0]].processor, view) is None or (key[0], "thread") not in task_keys(space, key[0], view):
        return ()
    ends = solve(resolve(space, view, [(key[0], "thread")])).ends
    return (ends[key],) if key in ends else ()
