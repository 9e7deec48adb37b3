"""How long data wait until a reader on a clock has them, with response times and offsets left to whoever knows them.

docs/semantics.md, section 3.6, taken apart: execution times, rates and clocks say a part of it, offsets another, and
how long threads wait for others on their cores the rest. What a read adds may fall where a response time grows, as data
that come later wait less; what passes from the release of the timer before it to the read never does. So the search
counts from there.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from dse.analysis.latency.contributors import figure_of, neighbours, phased_parts
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.processing import is_logical
from dse.analysis.latency.stored_inputs import may_be_stored
from dse.analysis.rates import is_periodic
from dse.analysis.terms import ZERO, Phased, Read, Rest
from dse.analysis.views import View
from dse.space.architecture.clocks import AT_RELEASE, is_always_timed
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import Choice, at, is_given, leaves


def hangs_on_offsets(space: Space, step: Step) -> bool:
    """Whether an element of a flow and some component before it may have offsets that are known."""
    before = [space.components[item.index] for item in step.since if item.kind == "component"]
    if step.kind != "component" or not any(map(_may_have_offset, before)):
        return False
    return _may_have_offset(space.components[step.index])


def _may_have_offset(component: Component) -> bool:
    return any(leaf is not None for leaf in leaves(component.offset_ns))


def can_be_taken_apart(space: Space, step: Step, kind: str) -> bool:
    """Whether a component's read is one that another may be counted from, or that may be counted from another.

    Not where more than one job's response time counts (of callbacks, of those in a queue, of pieces), where it is
    stated, or where clocks may be wrong, which cuts waits at both ends.
    """
    if kind not in ("latency", "jitter") or space.profile != "dse" or step.kind != "component":
        return False
    on_the_way = [item for item in (*step.since, step) if item.kind == "component"]
    return _may_have_offset(space.components[step.index]) and all(_is_plain(space, item) for item in on_the_way)


def _is_plain(space: Space, step: Step) -> bool:
    """Whether what an element adds holds its own response time once, or none, and whether it does in every design."""
    if may_be_stored(space, step) or may_wait_for_inputs(space, step):
        return False
    component = space.components[step.index]
    queues = [component.queue_size, *([] if step.via is None else [space.connections[step.via].queue_size])]
    if any(leaf is not None for queue in queues for leaf in leaves(queue)):
        return False
    if component.callback_ns is not None or step.figures is not None:
        return False
    if any(leaf is not None and leaf.error_ns for leaf in leaves(component.clock)):
        return False
    if component.processor is None:
        return True
    executes = {leaf is not None for leaf in leaves(component.execution_ns)}
    is_one_kind = len(executes) == 1 and None not in set(leaves(component.processor))
    return is_one_kind and component.pieces is None and component.response_ns is None


def read_of(alone: Space, step: Step, counts_least: bool, view: View) -> Read:
    """The case of a partial design; `alone` is the space whose threads have their cores for themselves.

    `counts_least` where the least wait is taken off, as in a jitter.
    """
    component = alone.components[step.index]
    if step.via is None or not is_periodic(component, view):
        return Read(0)
    period = at(component.period_ns, view)
    pair = neighbours(alone, step, view, offsets=False)
    if pair is None or not (
        is_given(component.offset_ns, view) and is_given(alone.components[pair.sender].offset_ns, view)
    ):
        return Read(period)
    way = list(_back_to_the_timer(alone, step, view))
    soonest = pair.least_ns if counts_least else 0
    return Read(
        period - pair.pair.step_ns,
        pair.sender,
        pair.pair.step_ns,
        soonest,
        pair.most_ns - soonest,
        delayed=tuple(number for item in way for number in _waiting(alone, item, view)),
        late=tuple(_beginning(alone, step, view)) if counts_least else (),
        missed=tuple(_beginning(alone, way[-1], view)) if counts_least else (),
        counts_least=counts_least,
    )


def _back_to_the_timer(space: Space, step: Step, view: View) -> Iterator[Step]:
    """The components before a reader, the nearest first, to the one that a timer releases."""
    for earlier in reversed(step.since):
        if earlier.kind == "component":
            yield earlier
            if is_periodic(space.components[earlier.index], view):
                return


def _waiting(space: Space, step: Step, view: View) -> Iterator[int]:
    """The thread whose waiting for others is in what an element of a flow adds, where there is one."""
    component = space.components[step.index]
    if at(component.processor, view) is None or is_logical(space, component, view):
        return
    if at(component.execution_ns, view) is not None:
        yield step.index


def _beginning(space: Space, step: Step, view: View) -> Iterator[int]:
    """The thread whose waiting says how late it reads: not the first of a flow, nor where it reads at its release."""
    component = space.components[step.index]
    if step.via is not None and at(component.communication, view) not in AT_RELEASE:
        yield from _waiting(space, step, view)


def phased_of(space: Space, step: Step, kind: str) -> Phased | None:
    """Sampling on one clock taken apart, where both timers and their offsets are there in every design.

    Where clocks may be wrong the wait is cut at both ends, and stays whole.
    """
    earlier = [item.index for item in step.since if item.kind == "component"]
    if not earlier or space.profile != "dse":
        return None
    if any(may_wait_for_inputs(space, item) for item in (*step.since, step)):
        return None
    pair = [space.components[number] for number in (earlier[-1], step.index)]
    open_offsets = [isinstance(item.offset_ns, Choice) for item in pair]
    if not any(open_offsets) or not all(
        is_always_timed(item) and None not in set(leaves(item.offset_ns)) and not _may_be_wrong(item) for item in pair
    ):
        return None

    def parts(view: View) -> tuple[Fraction, tuple[Rest, ...]]:
        (least, most), wait = phased_parts(space, step, view)
        base = ZERO + figure_of(kind, (least, most))
        if wait is None:
            return base, ()
        one = Fraction(1)
        if kind == "min latency":
            return base, (Rest(one, wait.least_ns, wait.step_ns, wait.less_ns),)
        if kind == "latency":
            return base, (Rest(one, wait.most_ns, wait.step_ns),)
        if not wait.less_ns and (wait.least_ns - wait.most_ns) % wait.step_ns == 0:
            return base, ()
        soonest = Rest(-one, wait.least_ns, wait.step_ns, wait.less_ns)
        return base, (Rest(one, wait.most_ns, wait.step_ns), soonest)

    return Phased(earlier[-1], step.index, parts)


def _may_be_wrong(component: Component) -> bool:
    """Whether the clock of a component may be another than that of some others by an error."""
    return any(leaf is not None and leaf.error_ns for leaf in leaves(component.clock))
