"""Waiting in the elements of a flow: which response times their metrics hold, and how often.

The search counts such waiting by variables of its own (`dse.encode.scheduling.waiting`): that of a thread, or of
threads in a row that may be one chain (docs/semantics.md, section 4.9).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from dse.analysis.latency.clock_reads import hangs_on_offsets
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.processing import is_logical
from dse.analysis.latency.rows import counts_responses
from dse.analysis.latency.sampling import LET
from dse.analysis.latency.stored_inputs import dispatchers, may_be_stored, waits_for_others
from dse.analysis.rates import may_poll
from dse.analysis.scheduling.chained import chain_of, longer_by_ns
from dse.analysis.scheduling.tasks import always_executes, longest_alone_ns
from dse.analysis.terms import ZERO, FlowChain
from dse.analysis.views import View
from dse.space.architecture.activation import must_be_event_triggered
from dse.space.architecture.clocks import is_always_timed, reads_when_jobs_begin
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Space
from dse.space.model.trees import leaves


def counts_waiting(space: Space, number: int) -> bool:
    """Whether the longest processing of a thread is its response time, in every design in which it is not LET."""
    component = space.components[number]
    if component.processor is None or not space.is_last_piece(number):
        return False
    if may_poll(space, component) and not must_be_event_triggered(component):
        return False  # where it samples, its own job may be taken off
    is_ever = set(leaves(component.communication)) != {LET}
    return space.profile == "dse" and component.response_ns is None and always_executes(space, number) and is_ever


def always_waits(space: Space, number: int) -> bool:
    """Whether a thread's data pass when its job ends, whatever the design."""
    return LET not in set(leaves(space.components[number].communication))


def waits_where(space: Space, number: int) -> Callable[[View], bool] | None:
    """In which designs that is so, where logical execution time is one of several ways to communicate."""
    if always_waits(space, number):
        return None
    return lambda view: not is_logical(space, space.components[number], view)


def may_wait(space: Space, step: Step, kind: str) -> bool:
    """Whether what an element of a flow adds may depend on response times: its own, or those before it on its clock."""
    here = space.components[step.index]
    if kind == "min latency":  # only where a job may read when it begins
        return may_move(space, step, kind) and reads_when_jobs_begin(space)
    if space.profile != "dse" or here.callback_ns is not None or waits_for_others(space, step):
        return True
    if may_wait_for_inputs(space, step):
        return any(
            space.components[item].processor is not None for item in (step.index, *dispatchers(space, step.index))
        )
    if not space.is_last_piece(step.index):
        return False
    to_ask = [here]
    for earlier in (space.components[item.index] for item in reversed(step.since) if item.kind == "component"):
        to_ask.append(earlier)
        if is_always_timed(earlier):
            break
    return any(item.processor is not None and set(leaves(item.communication)) != {LET} for item in to_ask)


def may_move(space: Space, step: Step, kind: str) -> bool:
    """Whether sampling on one clock may be cut or spread by what is before an element of a flow."""
    return bool(step.since) and (kind == "run jitter" or hangs_on_offsets(space, step))


def counts_waiting_once(space: Space, step: Step) -> bool:
    """Whether an element of a flow has no rows that count a response time but that of processing."""
    if may_be_stored(space, step) or may_wait_for_inputs(space, step):
        return False
    component = space.components[step.index]
    sizes = [component.queue_size]
    if step.via is not None:
        sizes.append(space.connections[step.via].queue_size)
    is_hybrid = "hybrid" in set(leaves(component.protocol)) and component.callback_ns is not None
    return not is_hybrid and all(leaf is None for size in sizes for leaf in leaves(size))


def ends_in_pieces(space: Space, step: Step) -> bool:
    """Whether the longest processing of an element is when the last piece of a thread ends."""
    component = space.components[step.index]
    is_logical = LET in set(leaves(component.communication))
    stated = component.response_ns is not None or component.callback_ns is not None or is_logical
    return space.profile == "dse" and component.pieces is not None and not stated and counts_waiting_once(space, step)


def chains_apart(space: Space, flow: Flow, kind: str) -> dict[int, FlowChain | None]:
    """The elements of a flow, by their places, whose waiting is one figure for the threads of a chain.

    The last of a chain has the chain, the others have none.
    """
    apart: dict[int, FlowChain | None] = {}
    if not counts_responses(space) or kind == "min latency" or space.profile != "dse":
        return apart
    chains: dict[tuple[int, ...], list[int]] = {}
    for place, step in enumerate(flow.steps):
        if step.chain:
            chains.setdefault(step.chain, []).append(place)
    for members in chains.values():
        if all(waits_apart(space, flow.steps[place], kind) for place in members):
            apart |= dict.fromkeys(members)
            apart[members[-1]] = chain_of(flow.steps[members[-1]])
    return apart


def waits_apart(space: Space, step: Step, kind: str) -> bool:
    """Whether what a job of an element waits for others may be distinguished from the rest of it, in every design."""
    if step.only_reads or not counts_waiting(space, step.index) or not always_waits(space, step.index):
        return False
    return not may_move(space, step, kind)


def waited_ns(space: Space, step: Step, view: View) -> Fraction:
    """The time that the job of a thread of a flow waits for others, behind those before it in its chain, in ns."""
    longest = longer_by_ns(space, step, view)
    return ZERO + longest - longest_alone_ns(space, step.index, "thread", view)
