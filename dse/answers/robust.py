"""The front of the designs that hold for all stated values of their inputs.

And what that costs against the nominal front.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from dse.answers.base import Answer, With
from dse.answers.result import Origin, Point, Result

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Failure:
    """Why a design of the nominal front is not robust.

    A requirement, and the values of the inputs at which it misses its limit most.
    """

    point: int
    requirement: str
    value: Fraction
    limit: Fraction
    unit: str
    inputs: Mapping[str, Fraction]


@dataclass(frozen=True, repr=False)
class RobustResult(Answer):
    """`robust` has the designs whose requirements hold for all stated values, proved complete.

    Objectives are those of the nominal figures.

    `nominal` is the front without uncertainties. `inputs` says what was stated; `corners` how many (requirement,
    values) pairs stand for all values in between. `unjudged` are the ids of nominal points of which the time was too
    short to tell whether they are robust.

    Examples
    --------
    >>> import dse, pathlib
    >>> text = pathlib.Path("pump.yaml").read_text(encoding="utf-8")
    >>> text += "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}"
    >>> dse.solve_robust(text).price["price"]
    (6000, 6000)
    """

    FORM = "result.ResultForm"

    robust: Result
    nominal: Result
    inputs: Mapping[str, str]
    corners: int
    failures: tuple[Failure, ...]
    unjudged: tuple[int, ...] = ()

    @property
    def exit_code(self) -> int:
        """What the command line answers with."""
        return max(self.robust.exit_code, self.nominal.exit_code)

    @property
    def problem(self) -> Origin:
        """Which problem this is, and what was asked of it."""
        return self.robust.problem

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The robust front as a frame, as `Result.frame`."""
        return self.robust.frame(units)

    @property
    def price(self) -> dict[str, tuple[int | None, int | None]]:
        """For each objective its best value on the nominal and on the robust front (None: there is no design)."""
        found: dict[str, tuple[int | None, int | None]] = {}
        for info in self.robust.objectives:
            pick = min if info.sense == "minimise" else max
            ends = [[point.objectives[info.name] for point in result.front] for result in (self.nominal, self.robust)]
            best = [pick(values) if values else None for values in ends]
            found[info.name] = (best[0], best[1])
        return found

    @property
    def kept(self) -> tuple[Point, ...]:
        """The points of the robust front whose designs are on the nominal front too."""
        nominal = {point.design for point in self.nominal.front}
        return tuple(point for point in self.robust.front if point.design in nominal)

    @property
    def entered(self) -> tuple[Point, ...]:
        """The designs that only the robust front has: something better, or as good and earlier, was not robust."""
        nominal = {point.design for point in self.nominal.front}
        return tuple(point for point in self.robust.front if point.design not in nominal)

    def to_dict(self) -> dict[str, Any]:
        """The robust front in the form ``dse-result/1``, with a further entry ``robust``."""
        from dse.answers.forms.result import Robust
        from dse.answers.forms.writing import written

        nominal = self.nominal.to_dict()
        told = {
            "nominal_front": nominal["front"],
            "nominal": nominal,
            "kept": [point.id for point in self.kept],
            "entered": [point.id for point in self.entered],
        }
        return {**self.robust.to_dict(), "robust": written(Robust, With(self, told))}
