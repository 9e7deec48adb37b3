"""A design's prediction held against what was measured: metrics, figures of the file, and requirements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal

from dse.analysis.terms import PPM
from dse.answers.base import Answer
from dse.answers.tables.frames import mixed_frame
from dse.support.units import is_unbounded

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Seen:
    """What was measured of one thing, in the unit of what it is held against; where in which file.

    `count` and `mean` are None where the file does not say them.
    """

    low: Fraction
    high: Fraction
    mean: Fraction | None
    count: int | None
    place: str


@dataclass(frozen=True)
class Prediction:
    """A metric: predicted from `low` (None: it is an upper bound alone) to `high`, and what was measured.

    `outside` of the samples lie beyond, None where there are only their extremes.
    """

    name: str
    unit: str
    low: Fraction | None
    high: Fraction
    seen: Seen
    outside: int | None = None

    @property
    def predicted(self) -> tuple[Fraction | None, Fraction]:
        """The predicted range."""
        return self.low, self.high

    @property
    def verdict(self) -> Literal["inside", "above", "below", "both"]:
        """Where the measured values lie."""
        above = self.seen.high > self.high
        below = self.low is not None and self.seen.low < self.low
        return "both" if above and below else "above" if above else "below" if below else "inside"

    @property
    def beyond(self) -> Fraction:
        """How far beyond the prediction, at most; 0 inside."""
        under = self.low - self.seen.low if self.low is not None else Fraction(0)
        over = Fraction(0) if is_unbounded(self.high) else self.seen.high - self.high
        return max(Fraction(0), over, under)

    @property
    def _is_above(self) -> bool:
        return is_unbounded(self.high) or self.seen.high - self.high == self.beyond

    @property
    def of_measured(self) -> Fraction | None:
        """`beyond` as a share of the measured value that is so far; None where that is 0."""
        value = self.seen.high if self._is_above else self.seen.low
        return self.beyond / value if value and not is_unbounded(value) else None

    @property
    def of_predicted(self) -> Fraction | None:
        """`beyond` as a share of the predicted value next to it; None where that is 0."""
        value = self.high if self._is_above else self.low
        return self.beyond / value if value and not is_unbounded(value) else None


@dataclass(frozen=True)
class Input:
    """A figure that the file states, from `low` to `high`, and what was measured of it.

    `drifted`: that lies beyond; then `counted` (else None) are the ends that count instead.
    """

    name: str
    unit: str
    low: Fraction
    high: Fraction
    seen: Seen
    counted: tuple[Fraction, Fraction] | None = None

    @property
    def stated(self) -> tuple[Fraction, Fraction]:
        """What the file states."""
        return self.low, self.high

    @property
    def drifted(self) -> bool:
        """Whether what was measured lies beyond what the file states."""
        return self.counted is not None


@dataclass(frozen=True)
class Kept:
    """A requirement with the figures of the file and with those that were measured: value, slack, whether it holds.

    `observed` is what was measured of its metric itself, at the end that the requirement looks at, and `observed_holds`
    whether that keeps it; None where the metric was not measured.
    """

    text: str
    unit: str
    limit: Fraction
    values: tuple[Fraction, Fraction]
    slacks: tuple[Fraction, Fraction]
    holds: tuple[bool, bool]
    observed: Fraction | None = None
    observed_holds: bool | None = None

    @property
    def is_newly_broken(self) -> bool:
        """Whether it holds with the figures of the file, but not with measured ones, or not as measured itself."""
        return self.holds[0] and not (self.holds[1] and self.observed_holds is not False)

    @property
    def stated(self) -> tuple[Fraction, Fraction, bool]:
        """Value, slack, and whether it holds with the figures of the file."""
        return self.values[0], self.slacks[0], self.holds[0]

    @property
    def measured(self) -> tuple[Fraction, Fraction, bool]:
        """The same with those that were measured."""
        return self.values[1], self.slacks[1], self.holds[1]


@dataclass(frozen=True, repr=False)
class MeasuredComparison(Answer):
    """One design against measurements: metrics, figures of the file, and requirements with the measured figures.

    `remarks` say what could not be held against anything, and why.
    """

    FORM = "verdicts.MeasuredForm"

    problem: str
    files: tuple[str, ...]
    decisions: Mapping[str, str]
    tolerance: Fraction
    currency: str
    predictions: tuple[Prediction, ...]
    inputs: tuple[Input, ...]
    requirements: tuple[Kept, ...]
    remarks: tuple[str, ...] = ()

    @property
    def is_as_predicted(self) -> bool:
        """Every metric inside its prediction, no figure beyond what the file states."""
        return all(item.verdict == "inside" for item in self.predictions) and not any(
            item.drifted for item in self.inputs
        )

    @property
    def still_holds(self) -> bool:
        """Whether every requirement holds with the measured figures, and as far as its metric itself was measured."""
        return all(item.holds[1] and item.observed_holds is not False for item in self.requirements)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each metric, each figure of the file, and each requirement.

        Columns: ``kind`` (``metric``, ``figure`` or ``requirement``), ``name``; ``from`` and ``to``, what is predicted
        or stated (of a requirement the value with the figures of the file, and with those that were measured);
        ``measured from`` and ``measured to``; ``verdict``; all figures exact in the row's ``unit``. `units` as for
        `Result.frame`: rows of their kind are in that unit, which then stands in ``unit``.
        """
        rows: list[list[Any]] = []
        for metric in self.predictions:
            ends = (metric.low, metric.high, metric.seen.low, metric.seen.high)
            rows.append(["metric", metric.name, *ends, metric.verdict, metric.unit])
        for figure in self.inputs:
            ends = (figure.low, figure.high, figure.seen.low, figure.seen.high)
            rows.append(["figure", figure.name, *ends, "drifted" if figure.drifted else "as stated", figure.unit])
        for kept in self.requirements:
            verdict = "holds" if kept.holds[1] and kept.observed_holds is not False else "broken"
            rows.append(["requirement", kept.text, *kept.values, kept.observed, kept.observed, verdict, kept.unit])
        figures = ("from", "to", "measured from", "measured to")
        columns = ("kind", "name", *figures, "verdict", "unit")
        return mixed_frame(
            columns, [dict(zip(columns, row, strict=True)) for row in rows], figures, units, self.currency
        )

    def _told(self) -> Mapping[str, Any]:
        return {"tolerance_ppm": self.tolerance * PPM}
