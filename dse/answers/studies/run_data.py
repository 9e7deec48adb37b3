"""The outcome of a run of a sweep as plain data: as the store keeps it, and as it is written with ranked designs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Literal, TypeAlias

from dse.answers.contention_verdicts import Contended
from dse.answers.question_data import Objective
from dse.support.json_fields import BY_KIND, NULL, Data, Json, Unit

Decisions: TypeAlias = Mapping[str, str]


@dataclass(frozen=True)
class Change:
    """The designs that a run gains and loses against the run before it on the last axis.

    Designs are distinguished by their decisions; the first run of an axis has no change.
    """

    JSON_NAME = "FrontChange"

    entered: Annotated[tuple[Decisions, ...], "Designs that only this front has."]
    left: Annotated[tuple[Decisions, ...], "Designs that only the front before has."]
    moved: Annotated[tuple[Decisions, ...], "Designs on both whose objectives differ."]
    best: Annotated[
        Mapping[str, tuple[Annotated[Fraction, NULL] | None, Annotated[Fraction, NULL] | None]],
        "The best value of each objective before and after; null where there is no design, or it is unbounded.",
    ]


class LimitedContention(Data):
    """The verdict on a design whose limit varies, with waiting for the CPU counted."""

    WRITTEN = (Contended, "limited")

    limited: Annotated[
        Fraction,
        NULL,
        "The tightest limit that it keeps then, in the `unit` of the limit; null where none. Left out where it is a "
        "share, which response times do not change.",
        Json(default=None),
    ]


class _Design(Data):
    """The fields of a design in every study."""

    decisions: Annotated[Decisions, "The chosen option of each open decision that matters in it."]
    metrics: Annotated[
        Mapping[str, Annotated[Fraction, NULL]],
        "Every metric and objective, in the `units` of the run; null where it is unbounded.",
    ]


class FrontDesign(_Design):
    """A design of a front."""

    contention: Annotated[
        Contended, "Verdict on the design with response times, where the front leaves them out.", Json(default=None)
    ]


class Alternative(FrontDesign):
    """A design of a front, with its rank there."""

    WRITTEN = ("rank", "score", "decisions", "metrics", "contention")

    rank: Annotated[int, "Rank of the design, from 1."]
    score: Annotated[str, "Score of the design: the distance to the ideal point of all fronts."]


class LimitedDesign(_Design):
    """A design of some stretch of limits."""

    WRITTEN = ("id", "limited", "decisions", "metrics", "contention")

    id: Annotated[int, "The number by which stretches name it."]
    limited: Annotated[Fraction, "The tightest limit that it keeps, in the `unit` of the limit."]
    contention: Annotated[
        LimitedContention,
        "The requirements that it meets when response times count, apart from the limit that varies.",
        Json(default=None),
    ]


class Named(Data):
    """A design of a stretch, by its number."""

    id: Annotated[int, "Which design it is."]


class Entry(Named):
    """A design of a stretch."""

    WRITTEN = ("rank", "score", "id")

    rank: Annotated[int, "Rank of the design among those of the stretch."]
    score: Annotated[str, "Score of the design."]


class _Interval(Data):
    """An interval of the limit."""

    from_: Annotated[Fraction, "Where it begins, seen from the tightest limit; included.", Json("from")]
    to: Annotated[Fraction, "Where the next one begins, or the loosest limit."]


class FoundStretch(_Interval):
    """An interval of the limit over which the front stays the same."""

    front: Annotated[list[Named], "The front, in the order of objectives.", Json(limits={"min_length": 1})]


class Stretch(_Interval):
    """An interval of the limit over which the front stays the same."""

    front: Annotated[list[Entry], "The front, best first.", Json(limits={"min_length": 1})]
    best: Annotated[int, "The design that is ranked first."]


class Failure(Data):
    """The outcome of a run whose values make no valid problem."""

    kind: Annotated[Literal["error"], "Kind of outcome."]
    status: Annotated[
        Literal["invalid", "other version"], "The kind of mistake: an invalid problem, or a store of another version."
    ]
    message: Annotated[str, "The mistakes as one text."]


class FoundFront(Data):
    """The outcome of a run in the store: a front without ranks, because ranking needs the scale of the whole sweep."""

    kind: Annotated[Literal["front"], "Kind of outcome."]
    status: Annotated[
        Literal["complete", "infeasible", "incomplete"], "Status of the proof: complete, incomplete or infeasible."
    ]
    objectives: Annotated[list[Objective], "The objectives."]
    units: Annotated[Mapping[str, Unit], "Unit of each metric."]
    front: Annotated[list[FrontDesign], "The front, in the order of objectives."]


class FoundBreaks(Data):
    """The break-points of a limit as a run finds them and the store keeps them, not ranked yet.

    A break-point is a limit at which the front changes. Limits are exact, in `unit`; between two of them a stretch has
    one front.
    """

    kind: Annotated[Literal["breaks"], "Kind of outcome."]
    status: Annotated[
        Literal["complete", "infeasible", "incomplete"], "Status of the proof: complete, incomplete or infeasible."
    ]
    definition: Annotated[str, "Definition of a break-point."]
    metric: Annotated[str, "The limited metric."]
    operator: Annotated[Literal["<=", ">="], "The sense of the limit."]
    unit: Annotated[Unit, "Unit of the limits."]
    from_: Annotated[Fraction, "The least limit of the interval.", Json("from")]
    to: Annotated[Fraction, "The greatest limit of the interval."]
    exact: Annotated[bool, "Whether the figures of the metric are exact, not rounded up to a unit."]
    objectives: Annotated[list[Objective], "The objectives."]
    units: Annotated[Mapping[str, Unit], "Unit of each metric."]
    infeasible_until: Annotated[
        Fraction | None, "The tightest limit that leaves a design, where it lies inside the interval."
    ]
    stretches: Annotated[list[FoundStretch], "The stretches, from the tightest limit to the loosest."]
    alternatives: Annotated[list[LimitedDesign], "The designs of all stretches."]


Found: TypeAlias = Annotated[Failure | FoundFront | FoundBreaks, BY_KIND]
"""The outcome of a run by itself."""


class _Run(Data):
    """The fields that every run of a sweep has."""

    values: Annotated[Mapping[str, str], "The value of each axis that has values."]
    change: Annotated[
        Change | None,
        "Designs gained and lost against the run before; null for the first run, and where one of both is not proved.",
    ]


class OpenRun(_Run):
    """A run that was not solved: the sweep was stopped before."""

    WRITTEN = ("values", "kind", "status", "change")

    kind: Annotated[Literal["open"], "Kind of outcome."]
    status: Annotated[Literal["open"], "Status of the run."]


class FailedRun(_Run, Failure):
    """A run whose values make no valid problem."""

    WRITTEN = ("values", "kind", "status", "message", "change")


class FrontRun(_Run, FoundFront):
    """A run with a front."""

    WRITTEN = ("values", "kind", "status", "objectives", "units", "front", "change")

    front: Annotated[list[Alternative], "The front, best first."]  # type: ignore[assignment]


class BreaksRun(_Run, FoundBreaks):
    """A run with the exact break-points of a limit."""

    WRITTEN = (
        *("values", "kind", "status", "definition", "metric", "operator", "unit", "from_", "to", "exact", "objectives"),
        *("units", "infeasible_until", "stretches", "alternatives", "change"),
    )

    stretches: Annotated[  # type: ignore[assignment]
        list[Stretch], "The stretches, from the tightest limit to the loosest."
    ]


AnyRun: TypeAlias = Annotated[OpenRun | FailedRun | FrontRun | BreaksRun, BY_KIND]
