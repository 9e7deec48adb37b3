"""The forms of what is said of one design or one problem: ``dse-analysis/1``, ``dse-check/1``, ``dse-simulation/1``."""

from __future__ import annotations

from typing import Annotated, Literal

from dse.answers.forms.base import Decisions, Figure, Form, Number, Of, Settings, Unit, field
from dse.answers.forms.result import Contention


class Row(Form):
    """A contributor to the latency of a flow."""

    category: str = field("What kind of contribution it is.")
    contributor: str = field("The component, connection or bus.")
    min_ns: Figure = field("What it adds to the minimum latency.")
    min_method: str = field("The rule that gives the minimum.")
    max_ns: Figure | None = field("What it adds to the maximum latency; null where it is unbounded.")
    max_method: str = field("The rule that gives the maximum.")
    medium: str = field("The bus or virtual bus of a row of a connection.", default="")
    specified_ns: list[Figure] | None = field(
        "Under the `osate` profiles: the minimum and maximum that are specified for it.", default=None
    )


class FlowFinding(Form):
    """What OSATE says of a flow."""

    severity: Literal["error", "warning"] = field("How grave it is.")
    text: str = field("In words.")


class Flow(Form):
    """The latency of a flow: the sum of its rows."""

    rows: list[Row] = field("The contributors, from the source to the end of the flow.")
    min_ns: Figure = field("The minimum latency.")
    max_ns: Figure | None = field("The maximum latency; null where it is unbounded.")
    jitter_ns: Figure | None = field("The maximum minus the minimum; null where it is unbounded.")
    specified_ns: list[Figure] | None = field(
        "Under the `osate` profiles: the totals of what is specified, minimum and maximum.", default=None
    )
    findings: list[FlowFinding] = field("Under `osate-2.19`: the errors and warnings of OSATE about it.", default=[])


class Use(Form):
    """How much of a processor or bus is used, and by whom."""

    type: str = field("The chosen type; `none` where the slot is left empty.")
    unit: Unit = field("What the figures count: `ppm` of one core, or `B/s`.")
    shares: dict[str, Figure] = field("What each thread or connection uses.")
    total: Figure = field("The sum of the shares.")
    capacity: Figure | None = field("What there is; null where the problem does not state it.")


class ProcessorUse(Use):
    """How much of a processor is used, and by whom."""

    cores: dict[str, int] = field("Of a processor with several cores: the core of each thread, from 1.", default={})


class Busy(Form):
    """The share of the time that a bus is busy."""

    unit: Unit = field("`ppm`, where the busy time is known.", default="")
    shares: dict[str, Figure] = field("What each connection takes of the time.", default=None)
    total: Figure | None = field("The sum; null where it cannot be computed.")
    reason: str | None = field("Why it cannot be computed, where it cannot.", default=None)


class Budget(Form):
    """OSATE's budgets of a bus."""

    stated: Figure | None = field("Its own, in B/s; null without one.")
    required: Figure = field("The sum of those of what is bound to it.")
    findings: list[FlowFinding] = field("OSATE's errors and warnings about them.")


class BusUse(Use):
    """How much of a bus is used, by whom, and for how long."""

    payload: dict[str, Figure] = field(
        "Of a bus with frames: what each connection carries without them, as OSATE counts; `shares` are of the wire.",
        default=None,
    )
    busy: Annotated[Busy, Of("busy_use")] = field("The share of the time that it is busy.")
    budget: Budget | None = field("Under `osate-2.19`, where budgets are stated: those of the bus.", default=None)


class BudgetUse(Form):
    """What an entry of `budgets` needs of a resource."""

    name: str = field("The thread, device or subsystem.")
    used: Figure = field("What it needs, or its budget where it says of nothing that it needs it.")
    budget: Figure | None = field("What it is to use at most; null without a budget.")
    slack_ppm: Figure | None = field("What is left of the budget, as a share of it; null without one.")


class ResourceUse(Form):
    """OSATE's resource budgets: of a processor, a partition, a memory, or of the whole system."""

    name: str = field("The processor, partition or memory; `system` for all together.")
    resource: Literal["speed", "memory", "RAM", "ROM"] = field("What is compared.")
    unit: Unit = field("What the figures count: `MIPS` or `B`.")
    capacity: Figure | None = field("What there is of it; null where that is not stated.")
    total: Figure = field("What is needed together.")
    slack_ppm: Figure | None = field("What is left of the capacity, as a share of it; null without one.")
    users: list[BudgetUse] = field("The outermost that are bound to it; of the system everything with a budget.")
    findings: list[FlowFinding] = field("OSATE's errors and warnings.")


class Metric(Form):
    """A metric of a design."""

    value: Figure | None = field("Its exact value; null where it is unbounded.")
    unit: Unit = field("What the value counts.")


class Verdict(Form):
    """How a design meets a requirement."""

    requirement: Annotated[str, Of("requirement.text")] = field("In the words of the problem.")
    implied: Annotated[bool, Of("requirement.implied")] = field(
        "Whether nobody states it: 100 % of a core, a bandwidth or the time of an exclusive bus."
    )
    origin: Annotated[str, Of("requirement.origin")] = field("Where it stands: `FILE:LINE`, or `command line`.")
    value: Figure | None = field("What the design has, in `unit`; null where it is unbounded.")
    limit: Figure = field("The limit in this design, in `unit`.")
    slack: Figure | None = field(
        "How far the value is from the limit; negative where it is missed, null where the value is unbounded."
    )
    unit: Unit = field("What the figures count.")
    holds: bool = field("Whether the requirement holds.")
    worst_thread: Annotated[str | None, Of("who")] = field(
        "The thread or core that alone decides, where one does: value and limit are then its own."
    )


class Releases(Form):
    """A stream of releases of a thread."""

    period_ns: int = field("Its period.")
    jitter_ns: Figure = field("How much later than periodically a release may come.")


class Interference(Form):
    """What goes before the worst job of a thread."""

    thread: Annotated[str, Of("name")] = field("The more urgent thread, or the interrupt.")
    jobs: int = field("How many of its jobs, from the beginning of the busy period on.")
    work_ns: Figure = field("What these take together.")


class ResponseTime(Form):
    """The response time of a thread on its core."""

    thread: Annotated[str, Of("name")] = field("The thread.")
    core: int = field("Its core, from 1.")
    executor: str = field("The executor that runs it beside others, where one does.", default="")
    reservation: str = field("The reservation that it runs in, where it is in one.", default="")
    rank: int = field("Its rank among the threads of the core, from 1, the most urgent.")
    execution_ns: list[int] = field("Its shortest and its longest execution time.", min_length=2, max_length=2)
    releases: Annotated[list[Releases], Of("task.streams")] = field("What releases it.")
    switching_ns: int = field("What the context switches of a job take.", earlier=0)
    blocking_ns: Annotated[Figure, Of("blocked_ns")] = field(
        "How long a less urgent thread of the core keeps it; 0 where that does not count.", earlier=0
    )
    blocked_by: str = field("That thread; missing where there is none.", default="")
    interference: Annotated[list[Interference], Of("delays")] = field(
        "What goes before its worst job; empty where it has no bound, and of segments.", earlier=[]
    )
    earlier_ns: Annotated[Figure, Of("parts.earlier_ns")] = field(
        "What earlier jobs of its own take before its worst job; missing where there is none.", default=0
    )
    over_ns: Annotated[Figure, Of("parts.over_ns")] = field(
        "How much of all that goes before its worst job is over when this is released; missing where nothing is.",
        default=0,
    )
    response_ns: Figure | None = field(
        "The longest time from release to completion; null where it has no bound. But for segments it is the longest "
        "execution, switching, blocking, interference and earlier jobs, less what is over."
    )
    deadline_ns: int | None = field("The deadline that it is compared with; null where there is none.")
    meets_deadline: bool | None = field("Whether it is met; null where there is none.")


class BetterOffset(Form):
    """Another offset of a reader, all others as they are."""

    offset_ns: Figure = field("The offset.")
    saves_ns: Figure = field("What the latency of the flow is shorter by.")
    costs_ns: dict[str, Figure] = field("What the latencies of other flows are longer by, by flow.")


class Boundary(Form):
    """A reader on the clock of the timer before it on a flow."""

    flow: str = field("The flow.")
    sender: str = field("The timer whose data are read.")
    receiver: str = field("The timer that reads.")
    offsets_ns: list[Figure | None] = field("The offset of each; null where it is unknown.", min_length=2, max_length=2)
    periods_ns: list[Figure] = field("The period of each.", min_length=2, max_length=2)
    there_ns: list[Figure] = field(
        "How long after the sender's release data are there, at least and at most.", min_length=2, max_length=2
    )
    wait_ns: list[Figure] = field(
        "How long these then wait: what is there first at least, what is there last at most.",
        min_length=2,
        max_length=2,
    )
    room_ns: Figure | None = field(
        "How much later the last data may be there before they miss the read; null where an offset is unknown."
    )
    crossed: Annotated[bool, Of("is_crossed")] = field("Whether some data meet a read that others miss.")
    better: BetterOffset | None = field("The reader's offset with which the flow is shortest; null where it is.")


class AnalysisForm(Settings):
    """The outcome of `dse analyse`: everything that is computed of one design."""

    INHERITED_BEHIND = "problem"
    INHERITED_OF = "space"

    format: Literal["dse-analysis/1"] = field("The name of this format.")
    problem: Annotated[str, Of("space.name")] = field("The name of the problem.")
    feasible: Annotated[bool, Of("is_feasible")] = field("Whether the design is valid and meets every requirement.")
    breaches: list[str] = field("Why it is no valid design; then the tables are empty.")
    decisions: Decisions = field("The chosen option of each open decision that matters in it.")
    flows: dict[str, Flow] = field("The contributors to the latency of each flow.")
    processors: dict[str, ProcessorUse] = field("The utilisation of each processor.")
    buses: dict[str, BusUse] = field("The load of each bus.")
    resources: list[ResourceUse] = field(
        "Under `osate-2.19`, where any is stated: the resource budgets of processors, partitions, memories and of all.",
        default=[],
    )
    metrics: dict[str, Metric] = field("Every metric.")
    requirements: Annotated[list[Verdict], Of("verdicts")] = field("How it meets each requirement.")
    contention: Annotated[Contention, Of("contended")] = field(
        "What it keeps when response times count, where the question leaves them out.", default=None
    )
    boundaries: list[Boundary] = field(
        "Every reader on the clock of the timer before it, where flows have some.", default=[]
    )
    warnings: list[str] = field("What no requirement forbids but an engineer should know.")
    overheads: dict[str, list[str]] = field(
        "What response times count beside execution times, with the threads or processors of which it is stated.",
        earlier={},
    )
    response_times: Annotated[dict[str, list[ResponseTime]], Of("responses")] = field(
        "The threads of each processor, where these were asked for."
    )


class Impossible(Form):
    """A requirement that no design meets, as bounds alone show; it has either `least` or `most`."""

    requirement: str = field("In the words of the problem.")
    origin: str = field("Where it stands.")
    least: str = field("The least value that any design can have, an exact number as text.", default="")
    most: str = field("The greatest value that any design can have, an exact number as text.", default="")
    limit: str = field("The limit, an exact number as text.")
    unit: Unit = field("What the figures count.")


class CheckForm(Settings):
    """The outcome of `dse check`: the space of a valid problem."""

    INHERITED_BEHIND = "valid"
    INHERITED_OF = "space"

    format: Literal["dse-check/1"] = field("The name of this format.")
    problem: Annotated[str, Of("space.name")] = field("The name of the problem.")
    valid: Literal[True] = field("A problem with mistakes has no description.")
    space_size: Annotated[int, Of("size")] = field("The number of designs that the decisions make at most.")
    decisions: dict[str, list[str]] = field("The options of each open decision, in the order of the file.")
    flows: list[str] = field("The names of the flows.")
    requirements: list[str] = field("The requirements in words.")
    implied: list[str] = field("The limits that nobody states: 100 % of cores, bandwidths and exclusive buses.")
    rules: list[str] = field("The rules in words.")
    objectives: list[str] = field("The objectives with their senses.")
    impossible: list[Impossible] = field("Requirements that no design meets, as bounds alone show.")
    too_large: str = field(
        "Which sum the search cannot count exactly, where it refuses the problem for that.", default=""
    )
    remarks: list[str] = field("What a careful reader would remark.")


class Extreme(Form):
    """An observed extreme, and what shows it again."""

    latency_ns: Figure = field("The latency.")
    offsets_ns: dict[str, Figure] = field("The offset of each timer.")
    drift_ppm: dict[str, int] = field("The drift of each clock.")
    execution: str = field("How execution times were drawn.")
    seed: int = field("The seed of the run.")


class ObservedFlow(Form):
    """The observed latencies of a flow against its bounds."""

    count: int = field("How many data reached the end.")
    min_ns: Figure | None = field("The least latency; null where nothing arrived.")
    max_ns: Figure | None = field("The greatest latency; null where nothing arrived.")
    mean_ns: Annotated[Number | None, Of("shown_mean_ns")] = field("The mean; null where nothing arrived.")
    bounds_ns: list[Figure | None] = field(
        "The analysed minimum and maximum, null where unbounded.", min_length=2, max_length=2
    )
    scheduled_bounds_ns: Annotated[list[Figure | None] | None, Of("scheduled_ns")] = field(
        "The same with response times as processing times, where threads share cores; then these must hold."
    )
    allowance_ns: int = field("What drifting clocks add to the upper bound.")
    outside: int = field("How many latencies lie outside `bounds_ns`.")
    contradiction: Annotated[bool, Of("is_contradiction")] = field("Whether the observation refutes the analysis.")
    excuse: str | None = field("Why the bounds need not hold for this flow or run.")
    reach: Annotated[Number | None, Of("shown_reach")] = field("The part of the analysed range that was observed.")
    histogram: list[dict[str, Figure]] = field("How often latencies were in which interval, in ns.")
    worst: Extreme | None = field("The greatest latency.")
    best: Extreme | None = field("The least latency.")


class ObservedThread(Form):
    """The longest observed response of a thread on a shared core."""

    observed_ns: Figure = field("The longest that was observed.")
    response_time_ns: Annotated[Figure | None, Of("bound_ns")] = field(
        "The analysed response time; null where it has no bound."
    )
    contradiction: Annotated[bool, Of("is_contradiction")] = field("Whether the observation refutes the analysis.")


class ObservedDisparity(Form):
    """The largest observed difference of age of what a component reads by two flows."""

    observed_ns: Figure | None = field("The largest that was observed; null where two inputs were never there.")
    bound_ns: Figure | None = field("The disparity by the analysis; null where it is unbounded.")
    allowance_ns: int = field("What drifting clocks add to it.")
    contradiction: Annotated[bool, Of("is_contradiction")] = field("Whether the observation refutes the analysis.")
    excuse: str | None = field("Why the bound need not hold for this run.")


class SimulationForm(Settings):
    """The outcome of `dse simulate`: what was observed, against what the analysis says."""

    INHERITED_BEHIND = "problem"
    INHERITED_OF = "space"

    format: Literal["dse-simulation/1"] = field("The name of this format.")
    problem: Annotated[str, Of("space.name")] = field("The name of the problem.")
    decisions: Decisions = field("The simulated design.")
    offsets: str = field("How the offsets of timers were chosen.")
    contention: bool = field("Whether threads waited for the processor.")
    runs: int = field("The number of runs.")
    events: int = field("The number of events in all runs.")
    duration_ns: int = field("The simulated time of a run.")
    seed: int = field("The seed.")
    definition: str = field("What a latency is.")
    contradictions: list[str] = field("Every observation that refutes the analysis, in words.")
    outside: list[str] = field(
        "Every observation outside the bounds of the question, with the reason where one is known, in words.",
        earlier=[],
    )
    flows: dict[str, ObservedFlow] = field("What was observed of each flow.")
    threads: Annotated[dict[str, ObservedThread], Of("tasks")] = field(
        "What was observed of each thread on a shared core."
    )
    disparities: dict[str, ObservedDisparity] = field(
        "What was observed of the inputs of each component whose disparity is defined.", default={}
    )
    lost: dict[str, int] = field("How many messages each connection lost.")
    notes: list[str] = field("What a reader should know.")
    stopped: Annotated[bool, Of("is_stopped")] = field(
        "Whether the time limit ended it: the other runs were not made.", default=False
    )
