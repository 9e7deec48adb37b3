"""The forms of what is found about problems and results.

``dse-explanation/1``, ``dse-comparison/1`` and ``dse-verification/1``.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, RootModel

from dse.answers.forms.base import Decisions, Figure, Form, Include, Number, Of, Unit, Values, field
from dse.answers.forms.design import Boundary
from dse.answers.forms.late import Delayed, Late, Overload, Shorter
from dse.answers.forms.result import Question


class ExplainedProblem(Form):
    """Which problem was explained, and what was asked of it."""

    name: str = field("The name that the problem gives itself.")
    file: str = field("The path of its file, as it was given.")
    sha256: str = field("The SHA-256 of the file.")
    includes: list[Include] = field("The files that it includes.")
    effective: Question = field("The question as it was asked.")


class Demand(Form):
    """A requirement, a rule or a fixed decision."""

    kind: Literal["requirement", "rule", "fixed decision"] = field("Which of the three.")
    text: str = field("In the words of the problem.")
    origin: str = field("Where it stands: `FILE:LINE`, or `command line`.")


class Why(Form):
    """Why a design breaks what it breaks."""

    overloads: list[Overload] = field("The cores and buses that it uses beyond a limit that it breaks.")
    late: list[Late] = field(
        "The threads that end too late in it, and those without a bound in flows whose limits it breaks."
    )
    delayed: list[Delayed] = field("The limits on flows that it breaks while threads in these wait for others.")
    boundaries: list[Boundary] = field(
        "The readers on the clock of the timer before them, along the flows whose limits it breaks."
    )
    shorter: list[Shorter] = field("Shorter times with each of which alone all that is asked holds in it.")


class ConflictMember(Demand):
    """A member of a minimal conflict."""

    without_it: Decisions = field("A design that meets all the other members.")
    breaks: list[str] = field("Every demand of the question that this design breaks.")
    why: Why | None = field("Why it does; null in earlier files.", earlier=None)


class MinimalConflict(Form):
    """Demands that cannot hold together; without any one of them the others can."""

    members: Annotated[list[ConflictMember], Of("listed")] = field("They.")
    by_waiting: bool = field(
        "False where there is no design even if each response time were as long as the job takes alone; true where it "
        "takes that threads wait for each other, as far as is known.",
        earlier=True,
    )


class Relaxation(Demand):
    """What happens when one demand alone gives, and all others hold."""

    INHERITED_OF = "demand"

    helps: bool = field("Whether that leaves a design.")
    limit: Figure | None = field("The requirement's limit, in `unit`; null for what has none.")
    closest: Figure | None = field("The closest limit at which there is a design; null where there is none.")
    unit: Unit = field("What the figures count; empty where there are none.")
    beyond: bool = field("Whether the requirement, which is strict, holds beyond `closest` only.")
    thread: str | None = field("The thread that alone needs so much of one core, where that is what counts.")
    requirement: Annotated[str | None, Of("text")] = field(
        "The requirement as it may be written then; null for one that is implied."
    )
    overload: str | None = field("The processor or bus whose `overload: allowed` it takes; null where it takes none.")
    unbounded: list[str] = field("The threads whose response time has no bound even in the best design.")
    together: list[str] = field(
        "Of a limit that is stated once for several flows, processors, cores or buses: their requirements, which move "
        "as one.",
        default=[],
    )
    looked_for: Annotated[bool, Of("is_sought")] = field("False where the time was too short to look for `closest`.")
    design: Annotated[Decisions, Of("example.design")] = field("An example.")
    breaks: Annotated[list[str], Of("example.broken_texts")] = field(
        "Every demand of the question that the example breaks."
    )
    overloads: Annotated[list[Overload], Of("example.overloads")] = field(
        "The cores that the example uses beyond a limit that it breaks.", earlier=[]
    )
    late: Annotated[list[Late], Of("example.late")] = field(
        "The threads that end too late in the example, and those without a bound in flows whose limits it breaks.",
        earlier=[],
    )
    delayed: Annotated[list[Delayed], Of("example.delayed")] = field(
        "The limits on flows that the example breaks while threads in these wait for others.", earlier=[]
    )
    boundaries: Annotated[list[Boundary], Of("example.boundaries")] = field(
        "The readers on the clock of the timer before them, along the flows whose limits the example breaks.",
        earlier=[],
    )
    shorter: Annotated[list[Shorter], Of("example.shorter")] = field(
        "Shorter times with each of which alone all that is asked holds in the example.", earlier=[]
    )


class GiveUp(Form):
    """The fewest demands without which the others leave a design."""

    members: list[Relaxation] = field("They, each with its closest limit while the rest is given up.")
    design: Annotated[Decisions, Of("example.design")] = field("An example.")
    breaks: Annotated[list[str], Of("example.broken_texts")] = field(
        "Every demand of the question that the example breaks."
    )
    overloads: Annotated[list[Overload], Of("example.overloads")] = field(
        "The cores that the example uses beyond a limit that it breaks.", earlier=[]
    )
    late: Annotated[list[Late], Of("example.late")] = field(
        "The threads that end too late in the example, and those without a bound in flows whose limits it breaks.",
        earlier=[],
    )
    delayed: Annotated[list[Delayed], Of("example.delayed")] = field(
        "The limits on flows that the example breaks while threads in these wait for others.", earlier=[]
    )
    boundaries: Annotated[list[Boundary], Of("example.boundaries")] = field(
        "The readers on the clock of the timer before them, along the flows whose limits the example breaks.",
        earlier=[],
    )
    shorter: Annotated[list[Shorter], Of("example.shorter")] = field(
        "Shorter times with each of which alone all that is asked holds in the example.", earlier=[]
    )


class Part(Form):
    """What a thread, connection or device adds to a figure."""

    name: str = field("Which.")
    value: Figure = field("How much.")


class Bound(Form):
    """A requirement that no design meets, as bounds alone show."""

    requirement: Annotated[str, Of("requirement.text")] = field("In the words of the problem.")
    origin: Annotated[str, Of("requirement.origin")] = field("Where it stands.")
    side: Literal["least", "most"] = field("Whether `value` is the least or the most that any design can have.")
    value: Figure = field("The bound.")
    limit: Figure = field("The limit.")
    unit: Unit = field("What the figures count.")
    parts: list[Part] = field("Of a sum what each thread, connection or device adds to the bound, largest first.")


class Offer(Form):
    """What options that are not among the alternatives would change."""

    options: Annotated[list[str], Of("texts")] = field("The options, in words.")
    price: int | None = field("The price of the cheapest design with them; null where there is none.")
    unit: Unit = field("What the price counts.")
    design: Decisions = field("That design.")


class Effort(Form):
    """What the explanation took."""

    solver_calls: int = field("How often the solver was called.")
    wall_s: Number = field("Seconds that passed.")


class ExplanationForm(Form):
    """The outcome of `dse explain`: why a problem has no design, and what mends it."""

    format: Literal["dse-explanation/1"] = field("The name of this format.")
    problem: ExplainedProblem = field("Which problem was explained.")
    status: Literal["feasible", "infeasible", "no structure", "incomplete"] = field(
        "`no structure`: even without demands there is no design; `incomplete`: time ran out before it was decided."
    )
    complete: bool = field("Whether nothing that was asked for is missing.")
    left_open: list[str] = field("What was not looked at, in words.")
    design: Decisions = field("Of a feasible problem: a design.")
    conflicts: list[MinimalConflict] = field("Minimal conflicts.")
    all_conflicts: Annotated[bool, Of("every")] = field("Whether these are all there are.")
    limit_reached: Annotated[bool, Of("limited")] = field(
        "Whether the number of conflicts that were asked for was reached."
    )
    impossible_together: Annotated[list[Demand], Of("reduced")] = field(
        "Where time ran out: demands that have no design together, fewer of which may have none either."
    )
    relaxations: list[Relaxation] = field("What happens when one demand alone gives.")
    give_up: GiveUp | None = field("The fewest demands to give up together, where no single one is enough.")
    least: GiveUp | None = field(
        "Where threads need more than there is of a processor, and what may follow from that was not looked at: the "
        "fewest of the other demands that must give, each with the least that it must move, but for the use of "
        "processors; more may have to.",
        earlier=None,
    )
    impossible: list[Bound] = field("Requirements that no design meets, as bounds alone show.", earlier=[])
    without_waiting: bool = field(
        "Whether there is no design even if no thread waited for another, where threads do.", earlier=False
    )
    excluded: list[str] = field("Combinations that are no designs though nothing in the file forbids them.")
    offered: list[str] = field("The options that were asked about.")
    offers: list[Offer] = field("What they would change.")
    search: Annotated[Effort, Of(".")] = field("What it took.")
    safe_bounds: dict[str, list[str]] = field(
        "Where all conflicts rest on response times that are safe bounds, which need not be reached: why they are, "
        "each reason with the threads. Else empty.",
        earlier={},
    )


class TwoValues(Form):
    """A metric in two designs."""

    values: list[Figure | None] = field(
        "In each; null where a design has none, or it is unbounded.", min_length=2, max_length=2
    )
    unit: Unit = field("What they count.")


class Designs(Form):
    """Two designs side by side."""

    format: Literal["dse-comparison/1"] = field("The name of this format.")
    of: Literal["designs"] = field("What is compared.")
    names: list[str] = field("What the two are called.", min_length=2, max_length=2)
    currencies: list[str] = field("The currency of each.", min_length=2, max_length=2)
    decisions: dict[str, Annotated[list[str | None], Field(min_length=2, max_length=2)]] = field(
        "The option of each decision in both; null where a design has no use for it."
    )
    metrics: dict[str, TwoValues] = field("Each metric in both.")
    requirements: dict[str, Annotated[list[Literal["holds", "broken"] | None], Field(min_length=2, max_length=2)]] = (
        field("How both meet each requirement; null where the problem does not state it.")
    )
    not_comparable: Annotated[list[str], Of("unlike")] = field(
        "The settings by which figures of both are counted otherwise."
    )


class ComparedPoint(Form):
    """A point against the other front."""

    id: Annotated[int, Of("point.id")] = field("Its id in its own result.")
    objectives: Annotated[Values, Of("point.objectives")] = field(
        "Its objectives, in the units of its own result; null where one is unbounded."
    )
    equal: list[int] = field("The points of the other front with the same objectives.")
    dominated_by: list[int] = field("The points of the other front that dominate it.")


class Results(Form):
    """Two results with the same objectives side by side."""

    format: Literal["dse-comparison/1"] = field("The name of this format.")
    of: Literal["results"] = field("What is compared.")
    names: list[str] = field("What the two are called.", min_length=2, max_length=2)
    facts: dict[str, Annotated[list[str | None], Field(min_length=2, max_length=2)]] = field(
        "What was asked and found, in words, of both."
    )
    points: list[list[ComparedPoint]] = field("The points of each front.", min_length=2, max_length=2)
    not_comparable: Annotated[list[str], Of("unlike")] = field(
        "The settings by which the objectives of both are counted otherwise: then no point is compared."
    )


class SeenForm(Form):
    """What was measured of one thing, in the unit of what it is held against."""

    low: Figure = field("The least.")
    high: Figure = field("The greatest.")
    mean: Number | None = field("The mean; null where the file does not say it.")
    count: int | None = field("How many samples; null where the file does not say it.")
    place: str = field("`FILE:LINE`, of the first of them.")


class PredictedMetric(Form):
    """A metric against what was measured."""

    metric: Annotated[str, Of("name")] = field("Its name.")
    unit: Unit = field("The unit of its figures.")
    predicted: Annotated[list[Figure | None], Field(min_length=2, max_length=2)] = field(
        "The predicted range; null where it is an upper bound alone, or has none."
    )
    measured: Annotated[SeenForm, Of("seen")] = field("What was measured.")
    verdict: Literal["inside", "above", "below", "both"] = field("Where the measured values lie.")
    beyond: Figure = field("How far beyond the prediction, at most.")
    of_measured: Number | None = field("That as a share of the measured value; null where it is 0.")
    of_predicted: Number | None = field("That as a share of the predicted value; null where it is 0.")
    outside: int | None = field("How many samples lie beyond; null where only their extremes are known.")


class MeasuredInput(Form):
    """A figure of the problem file against what was measured of it."""

    figure: Annotated[str, Of("name")] = field("What it is, such as `execution time of filter`.")
    unit: Unit = field("The unit of its figures.")
    stated: Annotated[list[Figure], Field(min_length=2, max_length=2)] = field("What the file states.")
    measured: Annotated[SeenForm, Of("seen")] = field("What was measured.")
    drifted: bool = field("Whether that lies beyond what the file states.")
    counted: Annotated[list[Figure], Field(min_length=2, max_length=2)] | None = field(
        "What counts in its place then; null where the stated figure stands."
    )


class KeptValue(Form):
    """How a requirement is met."""

    value: Figure | None = field("The value; null where it is unbounded.")
    slack: Figure | None = field("How far it is from the limit; negative where it is broken, null where unbounded.")
    holds: bool = field("Whether it holds.")


class KeptRequirement(Form):
    """A requirement with the figures of the file, and with those that were measured where they lie beyond."""

    requirement: Annotated[str, Of("text")] = field("In the words of the problem.")
    unit: Unit = field("The unit of its figures.")
    limit: Figure = field("Its limit.")
    stated: KeptValue = field("With the figures of the file.")
    measured: KeptValue = field("With the measured ones.")
    observed: Figure | None = field(
        "What was measured of its metric itself, at the end that the requirement looks at; null where nothing was."
    )
    observed_holds: bool | None = field("Whether that keeps it.")


class MeasuredForm(Form):
    """A design against measurements."""

    format: Literal["dse-comparison/1"] = field("The name of this format.")
    of: Literal["measured"] = field("What is compared.")
    problem: str = field("The name that the problem gives itself.")
    files: list[str] = field("The files of measurements.")
    decisions: Decisions = field("The design.")
    tolerance_ppm: Figure = field("How far the mean of periods and rates may be from what is stated.")
    predictions: list[PredictedMetric] = field("Metrics.")
    inputs: list[MeasuredInput] = field("Figures of the problem file.")
    requirements: list[KeptRequirement] = field("Each requirement of the question.")
    as_predicted: Annotated[bool, Of("is_as_predicted")] = field(
        "Every metric inside its prediction, no figure beyond what the file states."
    )
    still_holds: bool = field(
        "Every requirement holds with the measured figures, and as far as its metric was measured."
    )
    remarks: list[str] = field("What else is to be known.")


class ComparisonForm(RootModel[Annotated[Designs | Results | MeasuredForm, Field(discriminator="of")]]):
    """The outcome of `dse compare`."""


class Finding(Form):
    """Something that is wrong with a result."""

    place: str = field("Where in the result, such as `front[2].objectives`.")
    text: str = field("What is wrong.")


class VerificationForm(Form):
    """The outcome of `dse verify`: a second look at a result."""

    format: Literal["dse-verification/1"] = field("The name of this format.")
    result: str = field("The result.")
    problem: str = field("The problem file with which it was compared.")
    status: Literal["verified", "rejected", "unfinished"] = field(
        "`unfinished`: nothing wrong was found, but `left_open` could not be proved again."
    )
    findings: list[Finding] = field("What is wrong.")
    checked: list[str] = field("What was looked at, and how.")
    left_open: list[str] = field("What could not be proved again.")
    remarks: list[str] = field("What a reader of the result should know.")
    wall_s: Number = field("Seconds that passed.")
