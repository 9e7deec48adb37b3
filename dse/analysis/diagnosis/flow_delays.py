"""Who waits for whom in a flow whose latency counts response times, and which single shorter time would keep a limit.

What a thread waits for is told as that of late threads is (`dse.analysis.scheduling.waits`), and a shorter time that
would do is found in the same way (`dse.analysis.diagnosis.shortening`): all response times are found anew, and the
figure that is limited.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

from dse.analysis.diagnosis.lateness import Late, Teller
from dse.analysis.diagnosis.shortening import Shortenable, Shorter
from dse.analysis.diagnosis.unbounded import may_be_unbounded, unbounded_in
from dse.analysis.latency.joined_inputs import is_paired
from dse.analysis.limits import Verdict, build_limit, judge
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.chained import chain_of, least_cut
from dse.analysis.scheduling.responses import response_of
from dse.analysis.scheduling.waits import Wait
from dse.analysis.terms import FlowChain
from dse.space.model.metric_kinds import flows_in
from dse.support.units import Exact

MOST_CUT = 24
"""No more candidates than these are shortened for one requirement."""


@dataclass(frozen=True)
class FlowWait:
    """A thread of a flow that waits for others, or threads in a row that do so together.

    `waited_ns` is how much longer the flow takes for it, in ns.
    """

    threads: Annotated[tuple[str, ...], "The thread, or threads in a row on one core for which each job counts once."]
    waited_ns: Annotated[Exact, "How much later than by themselves they end."]
    waits: Annotated[tuple[Wait, ...], "What they wait for, with segments piece by piece."]


@dataclass(frozen=True)
class Delayed:
    """A broken limit on what counts response times of flows, and who waits in these.

    Latencies, jitters and ages count; times in ns.
    """

    requirement: Annotated[str, "The limit, in the words of the problem."]
    waiting: Annotated[tuple[FlowWait, ...], "The threads that wait, longest first."]
    shorter: Annotated[tuple[Shorter, ...], "Each of these would keep it by itself."]


def delayed_flows(teller: Teller, verdicts: Sequence[Verdict]) -> Iterator[Delayed]:
    """The broken upper limits in which threads wait for others, or a shorter time would do.

    In the order of `verdicts`; a broken limit without waiting and without a sufficient cut is left out.
    """
    for verdict in _broken(teller, verdicts):
        keys = _threads(teller, verdict)
        waits = [item for item in (_waiting(teller, part) for part in _parts(teller, verdict)) if item is not None]
        waits.sort(key=lambda item: -item.waited_ns)
        shorter = tuple(_shorter(teller, verdict, keys))
        if waits or shorter:
            yield Delayed(verdict.requirement.shown, tuple(waits), shorter)


def unbounded_threads(teller: Teller, verdicts: Sequence[Verdict]) -> Iterator[Late]:
    """The threads without a bound because of which such limits are broken, each once.

    `Late` objects that say why there is no bound; deadlines are handled by `late_threads`.
    """
    space = teller.space
    names = (name for item in _broken(teller, verdicts) for name in _unbounded(teller, item))
    for number in dict.fromkeys(space.component_numbers[name] for name in names):
        late = teller.unbounded(number)
        if late is not None:
            yield late


def _unbounded(teller: Teller, verdict: Verdict) -> tuple[str, ...]:
    return unbounded_in(teller.space, verdict.requirement.metric, teller.view)


def _broken(teller: Teller, verdicts: Sequence[Verdict]) -> Iterator[Verdict]:
    for verdict in verdicts:
        metric = verdict.requirement.metric
        is_upper = not verdict.holds and verdict.requirement.is_upper
        if is_upper and flows_in(teller.space, metric) and may_be_unbounded(teller.space, metric):
            yield verdict


def _threads(teller: Teller, verdict: Verdict) -> list[TaskKey]:
    """The threads of its flows, of one with segments its last piece there."""
    space = teller.space
    flows = flows_in(space, verdict.requirement.metric)
    steps = [step for flow in space.flows if flow.name in flows for step in flow.steps]
    last: dict[str, int] = {}
    for step in steps:
        if step.kind == "component" and teller.solution.system.place((step.index, "thread")) is not None:
            last[space.components[step.index].stated_as] = step.index
    return [(number, "thread") for number in last.values()]


def _parts(teller: Teller, verdict: Verdict) -> list[FlowChain]:
    """The threads of its flows, those in a row that wait together as one; each once."""
    space = teller.space
    flows = flows_in(space, verdict.requirement.metric)
    placed = {number for number, _ in _threads(teller, verdict)}
    parts: list[FlowChain] = []
    for flow in (flow for flow in space.flows if flow.name in flows):
        steps = [step for step in flow.steps if step.kind == "component" and step.index in placed]
        chains: dict[FlowChain, FlowChain] = {}
        for step in steps:
            if (chain := chain_of(step)) not in chains:
                paired = is_paired(space, step, space.components[step.index], teller.view)
                chains[chain] = replace(chain, is_paired=paired)
        for chain in chains.values():
            parts += least_cut(space, chain, teller.view)
    return list(dict.fromkeys(parts))


def _waiting(teller: Teller, part: FlowChain) -> FlowWait | None:
    """The waiting time of threads by cause; None where one has no bound, or they do not wait."""
    responses = [response_of(teller.space, number, "thread", teller.view) for number in part.threads]
    if any(item is None or item.response_ns is None for item in responses):
        return None
    waits = teller.waits.of_part(part) or ()
    waited = sum(item.waited_ns for item in waits)
    names = tuple(teller.space.components[number].stated_as for number in part.threads)
    return FlowWait(names, waited, waits) if waited > 0 else None


def _shorter(teller: Teller, verdict: Verdict, keys: Sequence[TaskKey]) -> Iterator[Shorter]:
    def is_enough(item: Shortenable, by_ns: int) -> bool:
        space, view = teller.trials.whole(item, by_ns)
        return judge(build_limit(space, verdict.requirement), view).holds

    yield from teller.trials.least_cuts(teller.trials.candidates(keys)[:MOST_CUT], is_enough)
