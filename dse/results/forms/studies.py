"""The forms of studies: ``dse-sweep/1`` and ``dse-sensitivity/1``."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from dse.results.forms.base import Decisions, Figure, Form, Number, Objective, Of, Settings, Unit, field
from dse.results.forms.result import Contention


class Changes(Form):
    """What the caller asked beyond the file; what was not asked is left out."""

    limits: list[Annotated[list[str], Field(min_length=2, max_length=2)]] = field(
        "Limits of `--max-METRIC`, each the metric and the text.", default=[]
    )
    require: list[str] = field("Further requirements and rules.", default=[])
    objectives: list[str] = field("The objectives that take the place of those of the file.", default=[])
    fix: list[str] = field("Fixed decisions.", default=[])
    profile: str = field("The profile, where another was asked for.", default=None)
    worst_case: str = field("The worst-case setting, likewise.", default=None)
    processing: str = field("What a flow counts for a thread, likewise.", default=None)
    deadlines: str = field("Which deadlines count, likewise.", default=None)
    overload: str = field("Whether cores and buses may be used beyond all of them, likewise.", default=None)


class StudiedProblem(Settings):
    """A problem as a study names it."""

    INHERITED_BEHIND = "sha256"

    name: str = field("The name that the problem gives itself.")
    sha256: str = field("The SHA-256 of its file.")
    currency: str = field("The currency of prices, which count in cents.")


class SweptProblem(StudiedProblem):
    """Which problem was swept, and what was asked of it."""

    changes: Changes = field("What the caller asked beyond the file.")


class VariedAxis(Form):
    """What was varied: it has either `values` or an `interval`."""

    name: str = field("The path of an input, or the metric of a limit.")
    kind: str = field("`limit` or what kind of input it is.")
    values: list[str] = field("Its values as texts.", default=[])
    interval: str = field("The interval of a limit whose break-points are exact.", default="")


class ScaledObjective(Objective):
    """An objective with its ends on all fronts of the sweep."""

    best: Figure | None = field("Its best value on all fronts, in `unit`; null where it is unbounded.")
    worst: Figure | None = field("Its worst value on all fronts, in `unit`; null where it is unbounded.")


class SweepRanking(Form):
    """How designs are ranked, on one scale for the whole sweep."""

    words: str = field("The method in words.")
    scale: list[ScaledObjective] = field("The scale: each objective with its best and worst value.")


class FrontChange(Form):
    """What a run wins and loses against the one before it on the last axis."""

    entered: list[Decisions] = field("Designs that only this front has.")
    left: list[Decisions] = field("Designs that only the front before has.")
    moved: list[Decisions] = field("Designs on both whose objectives differ.")
    best: dict[str, Annotated[list[Figure | None], Field(min_length=2, max_length=2)]] = field(
        "The best value of each objective before and after; null where there is no design, or it is unbounded."
    )


class ContentionBasis(Form):
    """What the fronts leave out, and how their designs are judged all the same."""

    left_out: bool = field("Whether response times are left out of the latencies.")
    cores: list[Literal["stated", "decided", "first-fit"]] = field("Who chooses the cores that threads are judged on.")


class LimitedContention(Contention):
    """The same of a design whose limit varies."""

    limited: Figure | None = field(
        "The tightest limit that it keeps then, in the `unit` of the limit; null where none. Left out where it is a "
        "share, which response times do not change.",
        default=None,
    )


class Alternative(Form):
    """A design of a front, with its rank there."""

    rank: int = field("Its rank, from 1.")
    score: str = field("Its score: the distance to the ideal point of all fronts.")
    decisions: Decisions = field("The chosen option of each open decision that matters in it.")
    metrics: dict[str, Figure | None] = field(
        "Every metric and objective, in the `units` of the run; null where it is unbounded."
    )
    contention: Contention = field(
        "What it keeps when response times count, where the front leaves that out.", default=None
    )


class LimitedDesign(Form):
    """A design of some stretch of limits."""

    id: int = field("The number by which stretches name it.")
    limited: Figure = field("The tightest limit that it keeps, in the `unit` of the limit.")
    decisions: Decisions = field("The chosen option of each open decision that matters in it.")
    metrics: dict[str, Figure | None] = field(
        "Every metric and objective, in the `units` of the run; null where it is unbounded."
    )
    contention: LimitedContention = field(
        "What it keeps when response times count, beside the limit that varies.", default=None
    )


class Entry(Form):
    """A design of a stretch."""

    rank: int = field("Its rank among those of the stretch.")
    score: str = field("Its score.")
    id: int = field("Which design it is.")


class Stretch(Form):
    """An interval of the limit over which the front stays the same."""

    from_: Figure = field("Where it begins, seen from the tightest limit; included.", alias="from")
    to: Figure = field("Where the next one begins, or the loosest limit.")
    front: list[Entry] = field("The front, best first.", min_length=1)
    best: int = field("The design that is ranked first.")


class Run(Form):
    """What every run has."""

    values: dict[str, str] = field("The value of each axis that has values.")
    change: FrontChange | None = field(
        "What it wins and loses against the run before it; null for the first, and where one of the two is not proved."
    )


class OpenRun(Run):
    """A run that was not solved: the sweep was stopped before."""

    ORDER = ("values", "kind", "status", "change")

    kind: Literal["open"] = field("What was found.")
    status: Literal["open"] = field("How far.")


class FailedRun(Run):
    """A run whose values make no valid problem."""

    ORDER = ("values", "kind", "status", "message", "change")

    kind: Literal["error"] = field("What was found.")
    status: Literal["invalid", "other version"] = field("What is wrong.")
    message: str = field("The same in words.")


class SolvedRun(Run):
    """What every solved run has."""

    status: Literal["complete", "infeasible", "incomplete"] = field("How far the front is proved.")
    objectives: list[Objective] = field("The objectives.")
    units: dict[str, Unit] = field("What the figures of each metric count.")


class FrontRun(SolvedRun):
    """A run with a front."""

    ORDER = ("values", "kind", "status", "objectives", "units", "front", "change")

    kind: Literal["front"] = field("What was found.")
    front: list[Alternative] = field("The front, best first.")


class BreaksRun(SolvedRun):
    """A run with the exact break-points of a limit."""

    ORDER = (
        "values", "kind", "status", "definition", "metric", "operator", "unit", "from_", "to", "exact", "objectives",
        "units", "infeasible_until", "stretches", "alternatives", "change",
    )  # fmt: skip

    kind: Literal["breaks"] = field("What was found.")
    definition: str = field("What a break-point is.")
    metric: str = field("The limited metric.")
    operator: Literal["<=", ">="] = field("The sense of the limit.")
    unit: Unit = field("What limits count.")
    from_: Figure = field("The least limit of the interval.", alias="from")
    to: Figure = field("The greatest limit of the interval.")
    exact: bool = field("Whether the figures of the metric are exact, not rounded up to a unit.")
    infeasible_until: Figure | None = field(
        "The tightest limit that leaves a design, where it lies inside the interval."
    )
    stretches: list[Stretch] = field("The stretches, from the tightest limit to the loosest.")
    alternatives: list[LimitedDesign] = field("The designs of all stretches.")


def _kind(run: Any) -> str | None:
    kind = run.get("kind") if isinstance(run, dict) else getattr(run, "kind", None)
    return f"a run of kind {kind}" if isinstance(kind, str) else None


AnyRun: TypeAlias = Annotated[
    Annotated[OpenRun, Tag("a run of kind open")]
    | Annotated[FailedRun, Tag("a run of kind error")]
    | Annotated[FrontRun, Tag("a run of kind front")]
    | Annotated[BreaksRun, Tag("a run of kind breaks")],
    Discriminator(_kind),
]
"""The tags are no names of fields, so that the place of a mistake is told without them."""


class SweepForm(Form):
    """The outcome of `dse sweep`: the front for each value of what was varied."""

    format: Literal["dse-sweep/1"] = field("The name of this format.")
    problem: SweptProblem = field("Which problem was swept.")
    semantics: str = field("The version of what the figures mean, with a digest of the code that found them.")
    seed: int = field("The seed.")
    status: Literal["complete", "infeasible", "incomplete", "invalid"] = field("That of all runs together.")
    ranking: SweepRanking = field("How designs are ranked.")
    remarks: list[str] = field("What varying an input cannot show.")
    contention: ContentionBasis | None = field("What all fronts leave out; null where that is nothing.", earlier=None)
    vary: list[VariedAxis] = field("What was varied.")
    runs: list[AnyRun] = field("What was found for each value, the last axis fastest.")
    files: dict[str, str] = field(
        "The text of the problem file, of what it includes and of its samples, by name.", earlier=None
    )


class Break(Form):
    """Where a requirement breaks in one direction."""

    last: Figure = field("The last value that holds.")
    first: Figure | None = field("The first whole one that breaks; null where every value beyond `last` does.")
    requirement: str = field("The requirement that breaks.")
    thread: str | None = field("The thread by which it breaks, where that is told.")


class Margin(Form):
    """How far one input may move, alone."""

    path: str = field("The input, as a path of the problem file.")
    unit: Unit = field("What its figures count.")
    nominal: Figure = field("Its value in the problem.")
    below: Break | None = field("What breaks when it decreases; null where nothing does.")
    above: Break | None = field("What breaks when it increases; null where nothing does.")
    searched: list[Figure] = field("How far down and up it was looked for.", min_length=2, max_length=2)


class Scaling(Form):
    """All execution times multiplied by one factor."""

    factor: Figure | None = field("The greatest with which all requirements hold; null where none breaks any.")
    requirement: str | None = field("The requirement that breaks beyond it.")
    thread: str | None = field("The thread by which it breaks, where that is told.")
    exact: Annotated[bool, Of("is_exact")] = field("Whether the factor is the exact border; else it is found to 1e-9.")
    by_requirement: dict[str, Figure | None] = field("The factor of each requirement alone.")
    utilisations_ppm: Annotated[dict[str, Figure], Of("utilisations")] = field(
        "The utilisation of each processor at the factor."
    )
    searched_to: Annotated[Figure, Of("most")] = field("The greatest factor that was looked at.")


class Bar(Form):
    """A bar of a tornado chart: one metric at both ends of one input."""

    metric: str = field("The metric.")
    unit: Unit = field("What its figures count.")
    path: str = field("The input.")
    input_unit: Unit = field("What its figures count.")
    inputs: list[Figure] = field("The low and the high value of the input.", min_length=2, max_length=2)
    values: list[Figure | None] = field("The metric at these; null where it is unbounded.", min_length=2, max_length=2)
    nominal: Figure | None = field("The metric at the stated value; null where it is unbounded.")
    swing: Figure | None = field("The length of the bar; null where an end is unbounded.")


class Chance(Form):
    """How likely a design meets its requirements when the uncertain inputs vary."""

    decisions: Decisions = field("The design.")
    all_met: Number = field("The share of the samples in which every requirement holds.")
    standard_error: Number = field("Its standard error.")
    by_requirement: dict[str, Number] = field("The share in which each requirement holds.")


class Indices(Form):
    """What of a metric's variation each uncertain input explains."""

    output: str = field("The metric.")
    unit: Unit = field("What its figures count.")
    first: dict[str, Number] = field("The first-order Sobol index of each input.")
    total: dict[str, Number] = field("The total Sobol index of each input.")
    effect: dict[str, Number] = field("The mean absolute change when the input goes from one end to the other.")
    spread: dict[str, Number] = field("The standard deviation of that change.")
    over: dict[str, Annotated[list[Number], Field(min_length=2, max_length=2)]] = field("Both ends of each input.")


class Uncertain(Form):
    """What stated uncertainties do."""

    inputs: dict[str, str] = field("The uncertain inputs, each with what is stated, in words.")
    samples: int = field("The number of samples.")
    seed: int = field("The seed.")
    design: Annotated[Chance, Of("design_chance")] = field("The chance of the studied design.")
    alternatives: Annotated[list[Chance], Of("chances")] = field("The chances of the designs of the front.")
    indices: list[Indices] = field("What explains the variation of each metric.")
    unbounded: list[str] = field(
        "Metrics without indices: a response time in them has no bound for some of the stated values.", default=[]
    )


class SensitivityForm(Form):
    """The outcome of `dse sensitivity`: how one design's verdicts and metrics move with its inputs."""

    format: Literal["dse-sensitivity/1"] = field("The name of this format.")
    problem: StudiedProblem = field("Which problem was studied.")
    decisions: Decisions = field("The studied design.")
    broken: list[str] = field("The requirements that it breaks as it is; margins look at the others.")
    margins: list[Margin] = field("How far each input may move, alone.")
    execution_times: Annotated[Scaling | None, Of("scaling")] = field(
        "All execution times together; null where time was too short."
    )
    swing: str = field("Over what the bars go.")
    tornado: Annotated[list[Bar], Of("bars")] = field("How far each input moves each metric.")
    uncertainty: Annotated[Uncertain | None, Of("uncertain")] = field(
        "What stated uncertainties do; null where none are stated."
    )
    left_out: list[str] = field("What the time limit left no time for.", default=[])
    files: dict[str, str] = field(
        "The text of the problem file, of what it includes and of its samples, by name.", earlier=None
    )
