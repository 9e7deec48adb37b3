"""`dse.simulate`: one design, played out in time, against what the analysis says of it."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil
from typing import Literal, TypeAlias, Unpack, get_args

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.contributors import flow_rows
from dse.analysis.latency.processing import is_logical
from dse.analysis.latency.rows import counts_responses
from dse.analysis.latency.stored_inputs import may_be_stored, takes_at_once
from dse.analysis.measures import build_measure
from dse.analysis.messages.stages import counted_buses
from dse.analysis.messages.waits import message_responses, with_identifiers
from dse.analysis.osate.latency import is_never_sampled, is_synchronous
from dse.analysis.rates import is_event_triggered
from dse.analysis.scheduling.priorities import deadline_ns
from dse.analysis.scheduling.responses import bounded_response_ns, processor_responses
from dse.analysis.scheduling.tasks import longest_alone_ns
from dse.analysis.views import View
from dse.answers.analysis import FlowTable
from dse.answers.result import decisions_of
from dse.answers.simulation import DisparityObservation, Extreme, FlowObservation, Simulation, TaskObservation
from dse.questions.complete_design import complete_design
from dse.questions.problem import Source, load, read_choices, with_stated_cores
from dse.questions.question import Decided, Question, decisions_as_texts
from dse.simulation.engine import simulate_once
from dse.simulation.observing import Execution, Setting
from dse.simulation.plan import Plan, build_plan
from dse.simulation.search import Observations, histogram, random_offsets, search_flow
from dse.space.model.flows import Flow
from dse.space.model.space import Design, Space
from dse.space.model.trees import at
from dse.space.question.metrics import all_disparities
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, until
from dse.support.units import Exact, Rounding, UnitError, format_duration, parse_duration_ns, whole

Offsets: TypeAlias = Literal["worst", "random", "zero"]
BINS = 20
MOST_DRIFT_PPM = 100_000
MOST_DISPATCHES = 50_000_000
"""The most dispatches of timers in one run, which take minutes."""


@arguments.checked(
    also=Question.__annotations__,
    duration=arguments.duration,
    offsets=arguments.Word(get_args(Offsets)),
    runs=arguments.Whole(1, 10**6),
    seed=arguments.SEED,
    execution=arguments.Word(get_args(Execution)),
    drift_ppm=arguments.Whole(0, MOST_DRIFT_PPM),
    contention=arguments.flag,
    bus_contention=arguments.flag,
    endless_queues=arguments.flag,
    time_limit_s=arguments.span,
)
def simulate(
    problem: Source,
    design: Decided = None,
    *,
    duration: str | None = None,
    offsets: Offsets = "worst",
    runs: int = 40,
    seed: int = 0,
    execution: Execution = "random",
    drift_ppm: int = 0,
    contention: bool = True,
    bus_contention: bool = False,
    endless_queues: bool = False,
    time_limit_s: arguments.Span | None = None,
    **question: Unpack[Question],
) -> Simulation:
    """Simulate one design and compare what is observed with the analysis.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    design
        decisions by name (or texts ``name = option``) or a point of a front, on top of the baseline; the baseline alone
        when left out.
    duration
        simulated time of each run, such as ``"10 s"``; long enough for every flow when left out.
    offsets
        ``worst`` searches the longest and shortest latency of each flow over all offsets, with execution times at
        their ends; ``random`` draws them anew for each run; ``zero`` starts everything at once.
    runs
        runs of the simulation: for each flow when searching, else in all (one for ``zero`` with fixed execution times).
    seed
        of everything that is drawn; the same seed gives the same result.
    execution
        ``random`` (uniform in its range), ``max`` or ``min``; the search does not look at it.
    drift_ppm
        clocks run up to this much too fast or too slow, each as drawn; with contention only too slow, since response
        times hold for periods that are no shorter than stated.
    contention
        threads share the cores of their processor; otherwise each has a core of its own.
    bus_contention
        a physical bus whose arbitration is not counted carries one message at a time, too, first come, first served.
        Faults of a wire hit frames at random, as often as they may come.
    endless_queues
        every queue holds whatever arrives, also where its size is stated: nothing is lost for want of room.
    time_limit_s
        seconds for everything; then what the runs until then showed, and `is_stopped`.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a decision or option does not exist, decisions are left open, the design is not valid, or a run
        would take more than `MOST_DISPATCHES`.
    OutOfTime
        when there was no time for the analysed bounds.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> dse.simulate("pump.yaml", best.decisions, runs=1).contradictions
    ()
    """
    limit = arguments.time_limit(time_limit_s)
    texts = decisions_as_texts(design)
    space = with_stated_cores(load(problem).ask(**question), texts).space
    chosen = complete_design(space, {**space.baseline, **space.fixed, **read_choices(space, texts)})
    with until(limit):
        evaluation = Evaluator(space).evaluate(chosen)
    if evaluation.breaches:
        raise UsageError(f"not a valid design: {'; '.join(evaluation.breaches)}")
    cores = cores_of(space, evaluation.design) if contention else None
    space = with_identifiers(space, View(evaluation.design))
    plan = build_plan(space, evaluation.design, cores=cores, endless_queues=endless_queues)
    whole = _setting(space, plan, _read_duration(duration))
    setting = replace(whole, execution=execution, bus_contention=bus_contention, seed=seed)
    _check_effort(plan, setting)
    record, is_stopped = Observations([Counter() for _ in space.flows]), False
    try:
        with until(limit):
            if offsets == "worst":
                for number, flow in enumerate(space.flows):
                    short = setting if duration is not None else _shortened(setting, plan, number, flow)
                    search_flow(plan, number, flow, short, runs, record)
            _sample(plan, setting, offsets, runs, drift_ppm, record, late_only=contention or _waits(plan))
    except OutOfTime:
        is_stopped = True
    holds_more = endless_queues and not _waits_anyway(space, plan)
    excuses = _excuses(plan, bus_contention=bus_contention, holds_more=holds_more)
    with until(limit.for_the_last_steps()):
        view = View(evaluation.design)
        flows = tuple(_flows(space, plan, record, view, excuses, drift_ppm, contention=contention))
        counted = replace(space, processing="response_time") if contention else space
        tasks = tuple(_tasks(space, plan, record, View(evaluation.design))) if contention else ()
        messages = tuple(_messages(counted, plan, record, View(evaluation.design)))
        disparities = tuple(_disparities(counted, record, View(evaluation.design), flows, drift_ppm))
    return Simulation(
        space=space,
        design=evaluation.design,
        decisions=decisions_of(space, evaluation.design),
        flows=flows,
        tasks=tasks,
        messages=messages,
        lost=dict(sorted(record.lost.items())),
        notes=tuple(_notes(space, plan, contention=contention)),
        offsets=offsets,
        runs=record.runs,
        events=record.events,
        duration_ns=setting.duration_ns,
        contention=contention,
        seed=seed,
        is_stopped=is_stopped,
        disparities=disparities,
    )


def _check_effort(plan: Plan, setting: Setting) -> None:
    """Refuse a run that would not end.

    Raises
    ------
    UsageError
        with the number of dispatches that the timers alone would make.
    """
    count = sum(setting.duration_ns // max(1, int(period)) for period in plan.timers.values())
    if count > MOST_DISPATCHES:
        raise UsageError(
            f"a run of {format_duration(setting.duration_ns)} has {count:,} dispatches of timers, more than "
            f"{MOST_DISPATCHES:,}: give a shorter --duration"
        )


def _read_duration(text: str | None) -> int | None:
    if text is None:
        return None
    try:
        duration_ns = parse_duration_ns(text, Rounding.UP)
    except UnitError as error:
        raise UsageError(f"duration {text!r}: {error}") from error
    if duration_ns <= 0:
        raise UsageError("the simulated time must be positive")
    return duration_ns


def _setting(space: Space, plan: Plan, duration_ns: int | None) -> Setting:
    """The time to simulate: ten of the longest periods, and what the data born last need to get through."""
    span = max((plan.span_ns(number, flow.steps) for number, flow in enumerate(space.flows)), default=0)
    longest = int(max(plan.timers.values(), default=0))
    whole = duration_ns or 10 * longest + ceil(span) + 1
    return Setting(whole, max(whole - ceil(span), whole // 2))


def _shortened(setting: Setting, plan: Plan, number: int, flow: Flow) -> Setting:
    """For a search: a few of the longest periods on the flow itself."""
    names = {plan.tasks[step.index, "thread"].name for step in flow.steps if step.kind == "component"}
    names |= {plan.links[step.index].name for step in flow.steps if step.kind == "connection"}
    longest = int(max((period for name, period in plan.timers.items() if name in names), default=10**8))
    longest = max(longest, *(int(plan.timers[name]) for name in _sources(plan, flow)), 1)
    span = ceil(plan.span_ns(number, flow.steps))
    return replace(setting, duration_ns=3 * longest + 2 * span + 1, births_until_ns=3 * longest + span)


def _sources(plan: Plan, flow: Flow) -> set[str]:
    """Timers that dispatch what the flow begins with, directly or through others."""
    first = flow.steps[0]
    start = first.index if first.kind == "component" else plan.links[first.index].source
    todo, seen = [start], set()
    names = {plan.links[first.index].name} if first.kind == "connection" else set()
    while todo:
        number = todo.pop()
        if number is None or number in seen:
            continue
        seen.add(number)
        names.add(plan.tasks[number, "thread"].name)
        for link in plan.links:
            if link.target == number and link.is_trigger:
                todo.append(link.source)
                names.add(link.name)
    return names & set(plan.timers)


def _sample(
    plan: Plan, setting: Setting, offsets: str, runs: int, drift_ppm: int, record: Observations, *, late_only: bool
) -> None:
    """Runs with drawn (or zero) offsets and drifts; after a search a few, for the shape of the histogram."""
    rng = random.Random(f"{setting.seed} sample")
    count = max(1, runs // 8) if offsets == "worst" else runs
    if offsets == "zero" and setting.execution != "random" and not drift_ppm:
        count = 1
    for number in range(count):
        drawn = plan.aligned({}) if offsets == "zero" else random_offsets(plan, rng)
        least = 0 if late_only else -drift_ppm
        kept = {*plan.phases, *plan.steady}  # what keeps a phase does not drift
        free = [name for name in plan.timers if name not in kept]
        drift = {name: rng.randint(least, drift_ppm) for name in free} if drift_ppm else {}
        run = replace(setting, offsets_ns=drawn, drift_ppm=drift, seed=setting.seed + number)
        record.add(simulate_once(plan, run), run)


def _waits(plan: Plan) -> bool:
    """Whether messages wait for a bus: bounds then hold for periods that are no shorter than stated."""
    return any(link.turn is not None for link in plan.links)


def _messages(space: Space, plan: Plan, record: Observations, view: View) -> Iterator[TaskObservation]:
    """Every message that has waited for a bus, or might have, in the order in which they go first."""
    for number in counted_buses(space):
        if space.buses[number].types[view.design[space.buses[number].type_decision]] == "none":
            continue
        for item in message_responses(space, number, view):
            observed = record.responses.get(item.name)
            if observed is not None:
                is_sure = not plan.guessed and not plan.overloaded
                yield TaskObservation(item.name, observed, item.response_ns, is_sure)


def _waits_anyway(space: Space, plan: Plan) -> bool:
    """Whether latencies count whatever waits: response times do, where no size of a queue and no distance is stated."""
    sizes = [*(item.queue_size for item in space.components), *(item.queue_size for item in space.connections)]
    is_apart = any(task.separation_ns is not None for task in plan.tasks.values())
    return counts_responses(space) and not is_apart and all(size is None for size in sizes)


def _excuses(plan: Plan, *, bus_contention: bool, holds_more: bool) -> list[str]:
    excuses = [f"{name} alone needs more than one core" for name in plan.overloaded]
    if bus_contention and any(link.bus is not None and link.turn is None for link in plan.links):
        excuses.append("messages wait for each other on the buses, which no bound counts")
    if holds_more:
        excuses.append("more data wait than the stated queue sizes admit")
    return excuses


def _notes(space: Space, plan: Plan, *, contention: bool) -> Iterator[str]:
    if plan.overloaded:
        yield f"overloaded: {', '.join(plan.overloaded)}; the bounds do not hold for such a design"
    if contention and any(task.core is not None for task in plan.tasks.values()):
        counted = "the bounds count response times, and must hold"
        if space.processing != "response_time":
            counted = "bounds from execution times can be exceeded; those from response times must hold"
            counted += " (processing: response_time)"
        yield f"threads share cores: {counted}"
        if plan.guessed:
            yield f"dispatched at no stated rate, so response times are not compared: {', '.join(plan.guessed)}"


def _flows(
    space: Space,
    plan: Plan,
    record: Observations,
    view: View,
    excuses: Sequence[str],
    drift_ppm: int,
    *,
    contention: bool,
) -> Iterator[FlowObservation]:
    scheduled_space = replace(space, processing="response_time")
    for number, flow in enumerate(space.flows):
        bounds = _bounds(space, flow, view)
        scheduled = _bounds(scheduled_space, flow, View(view.design)) if contention else None
        counter = record.latencies[number]
        reasons = [*excuses, *_gaps(space, flow, view), *_late(space, flow, view, contention=contention)]
        if contention and plan.guessed:
            reasons.append("some threads are dispatched at no stated rate")
        if contention and space.profile == "osate-2.2":
            reasons.append("this profile does not count response times")
        most = (scheduled or bounds)[1]
        yield FlowObservation(
            name=flow.name,
            latencies=dict(sorted(counter.items())),
            bounds_ns=bounds,
            scheduled_ns=scheduled,
            allowance_ns=-(-most * drift_ppm // 10**6) + len(flow.steps) if drift_ppm else 0,
            worst=_extreme(record, number, "max"),
            best=_extreme(record, number, "min"),
            histogram=histogram(counter, min(counter), max(counter), BINS) if counter else (),
            excuse="; ".join(reasons),
        )


def _disparities(
    space: Space, record: Observations, view: View, flows: Sequence[FlowObservation], drift_ppm: int
) -> Iterator[DisparityObservation]:
    """The disparities observed where flows meet; an excuse of a flow, and lost data, excuse the component, too."""
    for metric in all_disparities(space, range(len(space.components))):
        parts = {part.name: part for operand in metric.operands for _, part in operand}
        number = int(next(iter(parts.values())).key)
        excuses = dict.fromkeys(flows[part.index or 0].excuse for part in parts.values())
        if record.lost:
            excuses["data were lost, and older ones stayed"] = None
        oldest = max(build_measure(space, part).value(view) for part in parts.values() if part.kind == "oldest input")
        yield DisparityObservation(
            space.components[number].name,
            record.disparities.get(number),
            whole(build_measure(space, metric).value(view)),
            ceil(2 * oldest * drift_ppm / 10**6) + 2 * len(space.connections) if drift_ppm else 0,
            "; ".join(excuse for excuse in excuses if excuse),
        )


def _bounds(space: Space, flow: Flow, view: View) -> tuple[Exact, Exact]:
    table = FlowTable(flow.name, flow_rows(space, flow, view))
    return table.min_ns, table.max_ns


def _extreme(record: Observations, flow: int, goal: str) -> Extreme | None:
    extreme = record.extremes.get((flow, goal))
    if extreme is None:
        return None
    latency, setting = extreme
    return Extreme(latency, setting.offsets_ns, setting.drift_ppm, setting.execution, setting.seed)


def _gaps(space: Space, flow: Flow, view: View) -> Iterator[str]:
    """Where the additive bounds leave something out that the simulation shows."""
    for step in flow.steps:
        if step.figures is not None:
            name = space.components[step.index].name
            yield f"{name} has figures of its own in this flow, which no simulation knows"
        if step.kind != "component" or step.via is None:
            continue
        component = space.components[step.index]
        wire = space.connections[step.via]
        if space.profile != "dse" and is_synchronous(space, wire, view):
            yield f"OSATE takes the ends of {wire.name} for dispatched together; the clocks of a simulation drift apart"
        if space.profile != "dse" and is_never_sampled(space, wire, component, view):
            yield f"OSATE counts no sampling of {wire.name}, a connection of events, by {component.name}"
        triggers = step.via in component.triggers
        protocol = at(component.protocol, view)
        eager = is_event_triggered(component, view)
        if eager and not (triggers or takes_at_once(space, component) or may_be_stored(space, step)):
            yield f"{wire.name} does not dispatch {component.name}: its data wait for what does, which no bound counts"
        if protocol == "hybrid" and not triggers and at(component.callback_ns, view) is not None:
            yield f"{wire.name} does not run the callback of {component.name}, which the bounds count"
        queue = at(wire.queue_size, view)
        queue = at(component.queue_size, view) if queue is None else queue
        if protocol == "sporadic" and queue:
            yield f"what waits for {component.name} waits for its minimum separation, which no bound counts"


def _late(space: Space, flow: Flow, view: View, *, contention: bool) -> Iterator[str]:
    """Excuses: threads that may end after the deadline at which their data are assumed to pass."""
    longest = bounded_response_ns if contention else longest_alone_ns
    for number in dict.fromkeys(step.index for step in flow.steps if step.kind == "component"):
        component = space.components[number]
        if not is_logical(space, component, view):
            continue
        if longest(space, number, "thread", View(view.design)) > (deadline_ns(component, view) or 0):
            yield f"{component.name} may end after its deadline, at which its data pass"


def _tasks(space: Space, plan: Plan, record: Observations, view: View) -> Iterator[TaskObservation]:
    """Every task on a core that has run, in the order of processors, cores and priorities."""
    design: Design = view.design
    for number, slot in enumerate(space.processors):
        if slot.types[design[slot.type_decision]] == "none":
            continue
        for response in processor_responses(space, number, view):
            observed = record.responses.get(response.name)
            if observed is not None:
                yield TaskObservation(response.name, observed, response.response_ns, not plan.guessed)
