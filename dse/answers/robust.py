"""The front of the designs that hold for all stated values of their inputs.

And what that costs against the nominal front.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any

from dse.answers.base import Answer
from dse.answers.designs import Point
from dse.answers.question_data import Origin
from dse.answers.result import Result
from dse.support.json_fields import COUNT, NULL, Data, Json, Of, Unit

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Failure:
    """The reason why a design of the nominal front is not robust.

    The place is the corner of the stated ranges where the requirement is missed most.
    """

    JSON_NAME = "Lost"

    point: Annotated[int, "The id of the point on the nominal front.", Json("nominal_id")]
    requirement: Annotated[str, "A requirement that it violates somewhere in the stated ranges."]
    value: Annotated[
        Fraction,
        NULL,
        "Worst value of the design over the stated values, in `unit`; null where it is unbounded.",
        Json("worst"),
    ]
    limit: Annotated[Fraction, "The limit there, in `unit`."]
    unit: Annotated[Unit, "Unit of both figures."]
    inputs: Annotated[
        Mapping[str, Fraction], "The values of the inputs there, in base units (ns, B, bit/s) or as factors."
    ]


class NominalState(Data):
    """The status of the nominal front of a robust question."""

    OF = Result
    WRITTEN = (
        *(
            Of(name, "Field of the nominal front, as in a result.")
            for name in ("status", "unexplored", "refuted", "potential")
        ),
        Of("ranked_by", "Ranking of the nominal front, as in a result.", key="ranking"),
    )


class Cost(Data):
    """The best value of an objective on two fronts."""

    nominal: Annotated[int, COUNT, NULL, "On the nominal front; null where that is empty, or the best is unbounded."]
    robust: Annotated[int, COUNT, NULL, "On the robust front; null where that is empty, or the best is unbounded."]


@dataclass(frozen=True, repr=False)
class RobustResult(Answer):
    """`robust` has the designs whose requirements hold for all stated values, proved complete.

    Objectives are those of the nominal figures; `nominal` is the front without uncertainties.

    Examples
    --------
    >>> import dse, pathlib
    >>> text = pathlib.Path("pump.yaml").read_text(encoding="utf-8")
    >>> text += "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}"
    >>> dse.solve_robust(text).price["price"]
    (6000, 6000)
    """

    FORMAT = "result"

    robust: Result
    nominal: Annotated[Result, "Status of the nominal front and its search.", Json(kind=NominalState)]
    inputs: Annotated[Mapping[str, str], "Uncertain inputs, with the stated values in words."]
    corners: Annotated[int, "Number of pairs of a requirement and corner values that stand for all values in between."]
    failures: Annotated[
        tuple[Failure, ...],
        "The points of the nominal front that are not robust, each with what it violates.",
        Json("lost"),
    ]
    unjudged: Annotated[
        tuple[int, ...], "Points of the nominal front that the time was too short to judge.", Json(default=[])
    ] = ()

    @property
    def exit_code(self) -> int:
        """The exit code of the command line: the greater of both fronts.

        0: both are complete; 4: one is infeasible, proved; 5: one was stopped early.
        """
        return max(self.robust.exit_code, self.nominal.exit_code)

    @property
    def problem(self) -> Origin:
        """The solved problem, and its question."""
        return self.robust.problem

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The robust front as a frame, as `Result.frame`.

        One row for each robust design; `units` as for `Result.frame`.
        """
        return self.robust.frame(units)

    @property
    def price(self) -> dict[str, tuple[int | None, int | None]]:
        """For each objective its best value on the nominal and on the robust front (None: there is no design).

        Names of objectives to pairs of integers in the counting unit of the objective.
        """
        best_of: dict[str, tuple[int | None, int | None]] = {}
        for info in self.robust.objectives:
            pick = min if info.sense == "minimise" else max
            ends = [[point.objectives[info.name] for point in result.front] for result in (self.nominal, self.robust)]
            best = [pick(values) if values else None for values in ends]
            best_of[info.name] = (best[0], best[1])
        return best_of

    @property
    def kept(self) -> tuple[Point, ...]:
        """The points of the robust front whose designs are on the nominal front too.

        In the order of rank on the robust front.
        """
        nominal = {point.design for point in self.nominal.front}
        return tuple(point for point in self.robust.front if point.design in nominal)

    @property
    def entered(self) -> tuple[Point, ...]:
        """The designs that only the robust front has: something better, or as good and earlier, was not robust.

        In the order of rank on the robust front.
        """
        nominal = {point.design for point in self.nominal.front}
        return tuple(point for point in self.robust.front if point.design not in nominal)

    @property
    def costs(self) -> Annotated[Mapping[str, Any], Json("price", kind=Mapping[str, Cost])]:
        """The best value of each objective on both fronts."""
        return {name: {"nominal": nominal, "robust": robust} for name, (nominal, robust) in self.price.items()}

    @property
    def kept_ids(self) -> Annotated[list[int], Json("kept")]:
        """The points of the robust front that are on the nominal front too."""
        return [point.id for point in self.kept]

    @property
    def entered_ids(self) -> Annotated[list[int], Json("entered")]:
        """The points that only the robust front has."""
        return [point.id for point in self.entered]

    def to_dict(self) -> dict[str, Any]:
        """The robust front in the form ``dse-result/1``, with a further entry ``robust``."""
        from dse.answers.forms.codec import written

        return {**self.robust.to_dict(), "robust": written(Robust, self)}


class Robust(Data):
    """The robust front compared with the nominal front."""

    OF = RobustResult
    WRITTEN = (
        *("inputs", Of("robust.space.currency", "The currency of prices.", kind=str), "corners"),
        Of("nominal.listed_front", "The front without uncertainty.", key="nominal_front"),
        *("nominal", "costs", "kept_ids", "entered_ids", "failures", "unjudged"),
    )


class AnyResult(Data):
    """The outcome of `dse solve`: the front, its proof, and the question that was asked."""

    WRITTEN = (
        Result,
        Of(
            "robust",
            "For a robust question: the nominal front, and the price of robustness.",
            kind=Robust,
            default=None,
        ),
    )
