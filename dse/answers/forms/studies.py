"""The forms of sweeps, ``dse-sweep/1``, and of what every study says of its problem."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from dse.answers.forms.base import Decisions, Figure, Form, Objective, Settings, Unit, field
from dse.answers.forms.result import Contention


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


class _Design(Form):
    """What is said of every design."""

    decisions: Decisions = field("The chosen option of each open decision that matters in it.")
    metrics: dict[str, Figure | None] = field(
        "Every metric and objective, in the `units` of the run; null where it is unbounded."
    )


class FrontDesign(_Design):
    """A design of a front."""

    contention: Contention = field(
        "What it keeps when response times count, where the front leaves that out.", default=None
    )


class Alternative(FrontDesign):
    """A design of a front, with its rank there."""

    ORDER = ("rank", "score", "decisions", "metrics", "contention")

    rank: int = field("Its rank, from 1.")
    score: str = field("Its score: the distance to the ideal point of all fronts.")


class LimitedDesign(_Design):
    """A design of some stretch of limits."""

    ORDER = ("id", "limited", "decisions", "metrics", "contention")

    id: int = field("The number by which stretches name it.")
    limited: Figure = field("The tightest limit that it keeps, in the `unit` of the limit.")
    contention: LimitedContention = field(
        "What it keeps when response times count, beside the limit that varies.", default=None
    )


class Named(Form):
    """A design of a stretch, by its number."""

    id: int = field("Which design it is.")


class Entry(Named):
    """A design of a stretch."""

    ORDER = ("rank", "score", "id")

    rank: int = field("Its rank among those of the stretch.")
    score: str = field("Its score.")


class _Interval(Form):
    """An interval of the limit."""

    from_: Figure = field("Where it begins, seen from the tightest limit; included.", alias="from")
    to: Figure = field("Where the next one begins, or the loosest limit.")


class FoundStretch(_Interval):
    """An interval of the limit over which the front stays the same."""

    front: list[Named] = field("The front, in the order of objectives.", min_length=1)


class Stretch(_Interval):
    """An interval of the limit over which the front stays the same."""

    front: list[Entry] = field("The front, best first.", min_length=1)
    best: int = field("The design that is ranked first.")


class Failure(Form):
    """What a run finds whose values make no valid problem."""

    kind: Literal["error"] = field("What was found.")
    status: Literal["invalid", "other version"] = field("What is wrong.")
    message: str = field("The same in words.")


class _Solved(Form):
    """What every solved run finds."""

    status: Literal["complete", "infeasible", "incomplete"] = field("How far the front is proved.")
    objectives: list[Objective] = field("The objectives.")
    units: dict[str, Unit] = field("What the figures of each metric count.")


class _Front(_Solved):
    kind: Literal["front"] = field("What was found.")


class _Breaks(_Solved):
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
    alternatives: list[LimitedDesign] = field("The designs of all stretches.")


FRONT = ("kind", "status", "objectives", "units", "front")
BREAKS = (
    "kind", "status", "definition", "metric", "operator", "unit", "from_", "to", "exact", "objectives", "units",
    "infeasible_until", "stretches", "alternatives",
)  # fmt: skip


class FoundFront(_Front):
    """What a run finds, and the store keeps: a front that is not ranked yet, for that is on the scale of its sweep."""

    ORDER = FRONT

    front: list[FrontDesign] = field("The front, in the order of objectives.")


class FoundBreaks(_Breaks):
    """The same of the break-points of a limit."""

    ORDER = BREAKS

    stretches: list[FoundStretch] = field("The stretches, from the tightest limit to the loosest.")


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


class FailedRun(Run, Failure):
    """A run whose values make no valid problem."""

    ORDER = ("values", "kind", "status", "message", "change")


class FrontRun(Run, _Front):
    """A run with a front."""

    ORDER = ("values", *FRONT, "change")

    front: list[Alternative] = field("The front, best first.")


class BreaksRun(Run, _Breaks):
    """A run with the exact break-points of a limit."""

    ORDER = ("values", *BREAKS, "change")

    stretches: list[Stretch] = field("The stretches, from the tightest limit to the loosest.")


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
Found: TypeAlias = Annotated[
    Annotated[Failure, Tag("a run of kind error")]
    | Annotated[FoundFront, Tag("a run of kind front")]
    | Annotated[FoundBreaks, Tag("a run of kind breaks")],
    Discriminator(_kind),
]
"""What a run finds, by itself."""


BUS_WAITING = "Where it is not counted in latencies although a physical bus carries messages; null elsewhere."


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
    bus_waiting: Literal["not counted"] | None = field(BUS_WAITING, earlier=None)
    vary: list[VariedAxis] = field("What was varied.")
    runs: list[AnyRun] = field("What was found for each value, the last axis fastest.")
    files: dict[str, str] = field(
        "The text of the problem file, of what it includes and of its samples, by name.", earlier=None
    )
