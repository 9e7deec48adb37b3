"""The metrics of flows as terms by the elements of the flow (docs/semantics.md, sections 3.1 and 3.6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import cast

from dse.analysis.latency.clock_reads import can_be_taken_apart, hangs_on_offsets, phased_of, read_of
from dse.analysis.latency.contributors import (
    element_rows,
    elements_of,
    figure_of,
    job_range_ns,
    run_spread_ns,
    start_delay_ns,
    step_rows,
)
from dse.analysis.latency.element_waits import (
    always_waits,
    chains_apart,
    counts_waiting,
    counts_waiting_once,
    ends_in_pieces,
    may_move,
    may_wait,
    waited_ns,
    waits_where,
)
from dse.analysis.latency.exact_chains import exact_range_ns
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.rows import JOIN_METHOD, counts_responses
from dse.analysis.latency.skipping import skipped_terms
from dse.analysis.latency.stored_inputs import dispatch_gap_ns, dispatchers, may_be_stored, stored_row
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import counted_buses, may_wait_for
from dse.analysis.osate.latency import FlowPosition, place_rows, place_step, rivals, waiting_for_ns
from dse.analysis.rates import is_joined, is_periodic
from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.terms import ZERO, FlowChain, MessageWait, Reads, Sampled, Term, exact_sum
from dse.analysis.views import View
from dse.space.architecture.clocks import reads_when_jobs_begin
from dse.space.model.criteria import Metric
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.units import Exact, picked

EXACT_KINDS = {"exact latency": "latency", "exact min latency": "min latency", "exact jitter": "jitter"}


def flow_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """The summands of a metric of a flow (docs/semantics.md, sections 3.1 and 3.6)."""
    if kind in EXACT_KINDS:
        yield _exact_term(space, flow, EXACT_KINDS[kind])
        return
    yield from _latency_terms(space, flow, "latency" if kind in ("reaction time", "data age") else kind)
    if kind in ("reaction time", "data age"):
        yield Term(f"first period of {flow.name}", lambda view: ZERO + _first_period_ns(space, flow, view))
        yield from skipped_terms(space, flow, kind)
    if kind == "data age":
        yield Term(f"last period of {flow.name}", lambda view: ZERO - _last_period_ns(space, flow, view))


def up_to(flow: Flow, number: int) -> Flow:
    """A flow until a component reads what came to it."""
    place = next(at for at, step in enumerate(flow.steps) if (step.kind, step.index) == ("component", number))
    chain = flow.steps[place].chain
    before = chain[: chain.index(number)] if chain else ()
    steps = [replace(step, chain=before) if chain and step.chain == chain else step for step in flow.steps[:place]]
    return replace(flow, steps=(*steps, replace(flow.steps[place], only_reads=True, chain=(), has_source=False)))


def input_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """The age of what the last component of a flow reads, at most or at least (docs/semantics.md, section 3.6).

    At most that is the reduced latency and the first period, less that of the reader: what is read is the newest there.
    """
    if kind == "newest input":
        yield from _latency_terms(space, flow, "min latency")
        return
    *before, last = _latency_terms(space, flow, "latency")
    yield from before
    yield _read_late(space, flow.steps[-1], last)
    yield from skipped_terms(space, flow, kind)
    yield Term(f"first period of {flow.name}", lambda view: ZERO + _first_period_ns(space, flow, view))
    yield Term(f"last period of {flow.name}", lambda view: ZERO - _last_period_ns(space, flow, view))


def _read_late(space: Space, step: Step, term: Term) -> Term:
    """The term by which a reader's wait makes its input older: more where its job begins late, up to a period.

    What it finds then is no older than one period of what comes next.
    """
    component = space.components[step.index]
    responds = counts_responses(space) or component.response_ns is not None
    if component.offset_ns is None or not responds or not reads_when_jobs_begin(space):
        return term

    def late(view: View, space: Space = space) -> Fraction:
        rows = step_rows(space, step, view)
        waited = next((row.max_ns for row in rows if "sampling" in row.max_method), None)
        if waited is None or waited == (period := at(component.period_ns, view)):
            return ZERO
        delay_ns: Fraction = ZERO + picked("min", start_delay_ns(space, step, view), period - waited)
        return delay_ns

    def ends(view: View) -> tuple[Fraction, Fraction]:
        least, most = (term.ends or (lambda seen: (term.value(seen),) * 2))(view)
        return least, most + (at(component.period_ns, view) or 0)

    is_scheduled = term.ends is not None or counts_responses(space)
    return replace(
        term,
        value=lambda view: term.value(view) + late(view),
        ends=ends if is_scheduled else None,
        may_fall=is_scheduled,
        phased=None,
        reads=None,
        sampled=term.sampled and replace(term.sampled, kind="oldest input"),
    )


def _exact_term(space: Space, flow: Flow, kind: str) -> Term:
    """The exact latency, minimum latency or jitter of a flow, from everything that is on it at once."""
    name = space.components[flow.steps[-1].index].name if flow.steps[-1].kind == "component" else ""

    def value(view: View) -> Fraction:
        return ZERO + figure_of(kind, exact_range_ns(space, flow, view))

    def ends(view: View) -> tuple[Fraction, Fraction]:
        alone = _undelayed(space)
        ranges = [_element_range_ns(alone, element, view) for element in elements_of(space, flow)]
        least, most = (sum((found[end] for found in ranges), ZERO) for end in (0, 1))
        jobs = sum(2 + _queue_size(space, step, view) for step in flow.steps if step.kind == "component")
        jobs += sum(bool(may_wait_for(space, step.index)) for step in flow.steps if step.kind == "connection")
        waits = sum(at(space.components[step.index].period_ns, view) or 0 for step in flow.steps if step.since)
        if kind == "min latency":
            return ZERO, ZERO + exact_range_ns(alone, flow, view)[0]  # readers that begin late meet more
        low = ZERO if kind == "jitter" else ZERO + least
        return low, ZERO + most + waits + jobs * UNBOUNDED_NS

    waits_for_cores = counts_responses(space) and (kind != "min latency" or reads_when_jobs_begin(space))
    waits_for_buses = kind != "min latency" and any(
        may_wait_for(space, step.index) if step.kind == "connection" else _follows_a_bus(space, step)
        for step in flow.steps
    )
    return Term(flow.name, value, component=name, ends=ends if waits_for_cores or waits_for_buses else None)


def _latency_terms(space: Space, flow: Flow, kind: str) -> Iterator[Term]:
    """Sums over the rows of each element: maxima, minima, or maximum minus minimum (jitter)."""
    alone = _undelayed(space)
    chains = chains_apart(space, flow, kind)
    for number, (element, step) in enumerate(zip(elements_of(space, flow), flow.steps, strict=True)):
        names = space.components if step.kind == "component" else space.connections
        name = names[step.index].name
        if isinstance(element, FlowPosition):
            yield from _placed_terms(space, element, name, kind)
            continue
        if step.kind == "connection":
            yield _delivery_term(space, step, kind)
            continue

        if number not in chains or not counts_waiting_once(space, step):
            yield _element_term(space, flow, number, kind, is_apart=number in chains)
        else:
            yield Term(name, partial(_alone_of, alone, step, kind))
        if (chain := chains.get(number)) is not None:
            yield _chain_term(space, chain)


def _element_term(space: Space, flow: Flow, number: int, kind: str, *, is_apart: bool) -> Term:
    """The term of a component in a metric of a flow, behind `number` elements.

    Where it `is_apart` what its job waits for others is not in it.
    """
    step = flow.steps[number]
    alone = _undelayed(space)
    is_stored = may_be_stored(space, step)
    has_others = may_wait_for_inputs(space, step)
    responds = counts_responses(space) and may_wait(space, step, kind)
    is_scheduled = responds or (kind != "min latency" and _follows_a_bus(space, step))
    counted = space if is_scheduled or kind != "min latency" else alone  # no response time is worked out in vain

    def value(view: View, space: Space = counted) -> Fraction:
        figure = cast(Fraction, figure_of(kind, _element_range_ns(space, step, view)))  # as sums of rows are
        if kind == "run jitter":
            figure += _run_excess_ns(space, step, view)
        if is_apart and space is not alone:
            figure -= waited_ns(space, step, view)
        return figure

    def ends(view: View) -> tuple[Fraction, Fraction]:
        """Response times are no shorter than execution times; each counts for its job and for those queued.

        What waits for other inputs waits less where it comes later itself.
        """
        least = value(view, alone)
        period = at(space.components[step.index].period_ns, view) or 0  # how far sampling on one clock may move
        if kind == "min latency":
            return least - period, least
        jobs = 2 + _queue_size(space, step, view)
        if has_others:  # which counts no more than a time without a bound, in place of a queue
            rows = step_rows(alone, step, view)
            least -= sum(row.max_ns for row in rows if row.max_method.startswith(JOIN_METHOD))
            jobs = 3 if is_joined(space.components[step.index], view) else jobs
            if is_apart:  # what it waits is counted apart, where it takes messages in order more than is in its row
                least, jobs = least - UNBOUNDED_NS, jobs + 1
        if is_stored:  # its own job, and of what may dispatch it how late it ends and how long it is busy
            jobs += 1 + 2 * len(dispatchers(space, step.index))
        most = least + jobs * UNBOUNDED_NS
        if not may_move(space, step, kind):
            return least, most
        return least - period, most + 2 * period

    counts = responds and kind != "min latency" and not step.only_reads and counts_waiting(space, step.index)
    counts = counts and not has_others  # where it takes messages in order it is done sooner than that
    is_chained = bool(step.chain)
    counts = counts and not is_chained and not is_apart
    only_waits = counts and not may_move(space, step, kind) and counts_waiting_once(space, step)
    where = waits_where(space, step.index) if only_waits else None
    counts = only_waits or (counts and always_waits(space, step.index))
    falls = has_others or (is_chained and not is_apart) or may_move(space, step, kind)
    may_grow = not is_chained and not step.only_reads and not step.since
    return Term(
        space.components[step.index].name,
        value,
        ends=ends if is_scheduled else None,
        waits=(step.index, Fraction(1)) if counts else None,
        may_fall=is_scheduled and falls,
        only_waits=only_waits,
        waits_where=where,
        grows=is_scheduled and may_grow and ends_in_pieces(space, step),
        phased=None if is_scheduled else phased_of(space, step, kind),
        reads=_reads(space, step, number, kind),
        sampled=Sampled(space, step, kind) if step.since and not _follows_a_bus(space, step) else None,
    )


def _alone_of(alone: Space, step: Step, kind: str, view: View) -> Fraction:
    """The part of an element of a flow in a metric, in ns, where no thread and no message waits."""
    return ZERO + figure_of(kind, _element_range_ns(alone, step, view))


def _chain_term(space: Space, chain: FlowChain) -> Term:
    """How long the threads of a flow that may be one chain wait for others, in ns."""

    def ends(view: View) -> tuple[Fraction, Fraction]:
        return ZERO, ZERO + len(chain.threads) * UNBOUNDED_NS

    return Term(
        space.components[chain.threads[-1]].name,
        lambda view: ZERO + chain_wait_ns(space, chain, view),
        ends=ends,
        waits=(chain, Fraction(1)),
        only_waits=True,
        grows=True,
    )


def _undelayed(space: Space) -> Space:
    """The space in which no thread waits for a core, and no message for a bus."""
    return replace(space, processing="execution_time", bus_queuing="not_counted")


def _delivery_term(space: Space, step: Step, kind: str) -> Term:
    """The term of a connection in a metric of a flow, in ns; it depends on all messages of a bus that it waits for."""
    connection = space.connections[step.index]
    waits = kind != "min latency" and bool(may_wait_for(space, step.index))
    alone = _undelayed(space)

    def value(view: View, space: Space = space if waits or kind != "min latency" else alone) -> Fraction:
        return ZERO + figure_of(kind, _element_range_ns(space, step, view))

    def ends(view: View) -> tuple[Fraction, Fraction]:
        least = value(view, alone)
        return least, least + UNBOUNDED_NS

    message = MessageWait(step.index, step.has_source) if waits else None
    return Term(connection.name, value, ends=ends if waits else None, grows=waits, message=message)


def message_term(space: Space, number: int) -> Term:
    """The longest time from when a connection's message is sent until it is there, waiting for its bus included."""
    return _delivery_term(space, Step("connection", number), "latency")


def _follows_a_bus(space: Space, step: Step) -> bool:
    """Whether what a component of a flow adds depends on when messages come that wait for buses.

    That is so on a clock, where it reads what comes from a timer before it, where others dispatch it, and where it
    waits for other inputs.
    """
    if not counted_buses(space):
        return False
    came = any(item.kind == "connection" and may_wait_for(space, item.index) for item in step.since)
    if came and hangs_on_offsets(space, step):
        return True
    return may_be_stored(space, step) or may_wait_for_inputs(space, step)


def _reads(space: Space, step: Step, number: int, kind: str) -> Reads | None:
    """The term of a component on a clock in a latency or jitter under response times (`clock_reads`).

    `number` is how many elements come before it.
    """
    component = space.components[step.index] if step.kind == "component" else None
    if component is None or not counts_responses(space) or not can_be_taken_apart(space, step, kind):
        return None
    if any(item.kind == "connection" and may_wait_for(space, item.index) for item in step.since):
        return None
    reading = replace(step, only_reads=True)

    def until_read(view: View) -> Fraction:
        return ZERO + figure_of(kind, _element_range_ns(space, reading, view))

    def job(view: View, space: Space = space) -> Fraction:
        return ZERO + figure_of(kind, job_range_ns(space, step, view))

    def ends(view: View) -> tuple[Fraction, Fraction]:
        least = job(view, alone)
        return least, least + UNBOUNDED_NS

    alone = _undelayed(space)
    waits = (step.index, Fraction(1)) if counts_waiting(space, step.index) else None
    made = Term(
        component.name,
        job,
        ends=ends if waits is not None else None,
        waits=waits,
        only_waits=waits is not None,
        waits_where=waits_where(space, step.index) if waits is not None else None,
        grows=waits is not None,
    )
    parts = partial(read_of, alone, step, kind == "jitter")
    return Reads(step.index, number, parts, until_read, None if step.only_reads else made)


def _placed_terms(space: Space, place: FlowPosition, name: str, kind: str) -> Iterator[Term]:
    """The rows of an element in its place in a flow; what its message waits for each other connection is apart."""

    def value(view: View) -> Fraction:
        rows = place_rows(space, place, view, queues=False)
        sums = sum((row.min_ns for row in rows), ZERO), sum((row.max_ns for row in rows), ZERO)
        figure: Fraction = ZERO + figure_of(kind, sums)
        return figure

    yield Term(name, value)
    if kind == "min latency" or place_step(space, place).kind == "component":
        return
    for other in rivals(space, place):

        def waiting(view: View, other: int = other) -> Fraction:
            return ZERO + waiting_for_ns(space, place, other, view)

        yield Term(name, waiting)


_RANGES: Recall[tuple[int | Fraction, int | Fraction]] = Recall()


AT_ONCE = ("latency", "min latency", "jitter")
"""The metrics that follow from the two ends of a flow's latency, which are found once for each design."""


def flow_figure_ns(space: Space, metric: Metric, view: View) -> int | Fraction | None:
    """The latency, minimum latency or jitter of a flow at once; None for other metrics.

    Equal to the value of the measure.
    """
    if metric.kind not in AT_ONCE:
        return None
    flow = space.flows[metric.index or 0]
    key = ("flow", metric.index)
    range_ns: tuple[int | Fraction, int | Fraction] | None = view.memo.get(key)
    if range_ns is None:
        ranges = [_element_range_ns(space, item, view) for item in elements_of(space, flow)]
        range_ns = view.memo[key] = exact_sum(least for least, _ in ranges), exact_sum(most for _, most in ranges)
    return figure_of(metric.kind, range_ns)


def _queue_size(space: Space, step: Step, view: View) -> int:
    """The most jobs that a flow's queuing row may count for a step (OSATE counts one where no size is stated)."""
    sizes = [at(space.components[step.index].queue_size, view)]
    if step.via is not None:
        sizes.append(at(space.connections[step.via].queue_size, view))
    return max(1, *(int(size or 0) for size in sizes))


def _element_range_ns(space: Space, element: Step | FlowPosition, view: View) -> tuple[Exact, Exact]:
    """The least and most that an element of a flow adds; many flows, metrics and designs ask for the same."""
    key = ("element", element, space.processing, space.bus_queuing)
    range_ns: tuple[Exact, Exact] | None = view.memo.get(key)
    if range_ns is None:
        on_bus = _may_hang_on_buses(space, element)
        if on_bus or (counts_responses(space) and not _is_delivery(element)):  # consults all on a bus or processor
            range_ns = _rows_range_ns(space, element, view)
        else:
            range_ns = _RANGES.recall(space, element, view, _rows_range_ns)
        view.memo[key] = range_ns
    return range_ns


def _is_delivery(element: Step | FlowPosition) -> bool:
    """Whether an element is a connection, which waits for no processor."""
    return isinstance(element, Step) and element.kind == "connection"


def _may_hang_on_buses(space: Space, element: Step | FlowPosition) -> bool:
    """Whether what messages wait for may have a part in an element of a flow, so that it consults all on a bus."""
    if not counted_buses(space) or not isinstance(element, Step):
        return False
    if element.kind == "connection":
        return bool(may_wait_for(space, element.index))
    return _follows_a_bus(space, element)


def _rows_range_ns(space: Space, element: Step | FlowPosition, view: View) -> tuple[Exact, Exact]:
    rows = element_rows(space, element, view)
    return ZERO + sum(row.min_ns for row in rows), ZERO + sum(row.max_ns for row in rows)


def _run_excess_ns(space: Space, step: Step, view: View) -> Exact:
    """How much less than the jitter over all runs an element of a flow adds to that of one run; not above 0."""
    spread = run_spread_ns(space, step, view) if step.kind == "component" else None
    return 0 if spread is None else spread - at(space.components[step.index].period_ns, view)


def _first_period_ns(space: Space, flow: Flow, view: View) -> Exact:
    """The period of a flow's first component, 0 where no timer releases it: what is sensed waits for its release.

    Of one that goes on only when all its inputs have come, the longest time until it does.
    """
    first = flow.steps[0]
    if first.kind != "component" or not is_periodic(space.components[first.index], view):
        return 0
    if is_joined(space.components[first.index], view):  # a hybrid thread, which goes on only when all have come
        return dispatch_gap_ns(space, first.index, view)
    period_ns: Exact = at(space.components[first.index].period_ns, view)
    return period_ns


def _last_period_ns(space: Space, flow: Flow, view: View) -> Exact:
    """The period of the last component of a flow that a timer releases, at which its output is renewed, in ns.

    Of one that something dispatches which is not on the flow, the longest time between two dispatches.
    """
    for step in reversed(flow.steps):
        component = space.components[step.index] if step.kind == "component" else None
        if component is None:
            continue
        if is_periodic(component, view):
            period_ns: Exact = at(component.period_ns, view)
            return period_ns
        stored = stored_row(space, step, component, view)
        if stored is not None:
            return stored.max_ns
    return 0
