"""A design's prediction held against what was measured: metrics, figures of the file, and requirements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Literal

from dse.analysis.terms import PPM
from dse.answers.base import Answer
from dse.answers.comparison import DesignComparison, ResultComparison
from dse.answers.tables.frames import mixed_frame
from dse.support.json_fields import NULL, NUMBER, Data, Json, Of, Unit
from dse.support.units import is_unbounded

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Seen:
    """The measured values of one figure, in the unit of the prediction that they are compared with."""

    JSON_NAME = "SeenForm"

    low: Annotated[Fraction, "The least."]
    high: Annotated[Fraction, "The greatest."]
    mean: Annotated[Fraction | None, NUMBER, "The mean; null where the file does not say it."]
    count: Annotated[int | None, "Number of samples; null where the file does not state it."]
    place: Annotated[str, "`FILE:LINE`, of the first of them."]


@dataclass(frozen=True)
class Prediction:
    """A metric against what was measured.

    It is predicted from `low` (None: it is an upper bound alone) to `high`.
    """

    JSON_NAME = "PredictedMetric"
    WRITTEN = (*("name", "unit", "predicted", "seen", "verdict", "beyond", "of_measured", "of_predicted", "outside"),)

    name: Annotated[str, "Name of the metric.", Json("metric")]
    unit: Annotated[Unit, "The unit of its figures."]
    low: Fraction | None
    high: Fraction
    seen: Annotated[Seen, "Measured values.", Json("measured")]
    outside: Annotated[int | None, "Number of samples outside the prediction; null where only extremes are known."] = (
        None
    )

    @property
    def predicted(self) -> tuple[Fraction | None, Fraction]:
        """The predicted range; null where it is an upper bound alone, or has none.

        Exact, in the unit of the prediction.
        """
        return self.low, self.high

    @property
    def verdict(self) -> Literal["inside", "above", "below", "both"]:
        """The position of the measured values against the prediction.

        ``both`` where samples lie below the minimum and above the maximum; an upper bound alone has no *below*.
        """
        above = self.seen.high > self.high
        below = self.low is not None and self.seen.low < self.low
        return "both" if above and below else "above" if above else "below" if below else "inside"

    @property
    def beyond(self) -> Fraction:
        """The greatest distance of a measured value outside the prediction.

        In the unit of the prediction; 0 where every sample is inside.
        """
        under = self.low - self.seen.low if self.low is not None else Fraction(0)
        over = Fraction(0) if is_unbounded(self.high) else self.seen.high - self.high
        return max(Fraction(0), over, under)

    @property
    def _is_above(self) -> bool:
        return is_unbounded(self.high) or self.seen.high - self.high == self.beyond

    @property
    def of_measured(self) -> Annotated[Fraction | None, NUMBER]:
        """The distance beyond the prediction as a share of the measured value; null where it is 0.

        `beyond` over the extreme sample; None, too, where that is unbounded.
        """
        value = self.seen.high if self._is_above else self.seen.low
        return self.beyond / value if value and not is_unbounded(value) else None

    @property
    def of_predicted(self) -> Annotated[Fraction | None, NUMBER]:
        """The distance beyond the prediction as a share of the predicted value; null where it is 0.

        `beyond` over the predicted end; None, too, where that is unbounded.
        """
        value = self.high if self._is_above else self.low
        return self.beyond / value if value and not is_unbounded(value) else None


@dataclass(frozen=True)
class Input:
    """A figure of the problem file against what was measured of it."""

    JSON_NAME = "MeasuredInput"
    WRITTEN = ("name", "unit", "stated", "seen", "drifted", "counted")

    name: Annotated[str, "Name of the figure, such as `execution time of filter`.", Json("figure")]
    unit: Annotated[Unit, "The unit of its figures."]
    low: Fraction
    high: Fraction
    seen: Annotated[Seen, "Measured values.", Json("measured")]
    counted: Annotated[
        tuple[Fraction, Fraction] | None,
        "Measured figure that replaces the stated one; null where the stated figure counts.",
    ] = None

    @property
    def stated(self) -> tuple[Fraction, Fraction]:
        """The range that the file states.

        A pair (low, high) in the unit of the figure.
        """
        return self.low, self.high

    @property
    def drifted(self) -> bool:
        """Whether the measured figure lies outside the stated one."""
        return self.counted is not None


@dataclass(frozen=True)
class KeptValue:
    """The value, slack and verdict of a requirement."""

    value: Annotated[Fraction, NULL, "The value; null where it is unbounded."]
    slack: Annotated[Fraction, NULL, "Slack to the limit; negative where it is violated, null where unbounded."]
    holds: Annotated[bool, "Whether the requirement holds."]


@dataclass(frozen=True)
class Kept:
    """A requirement with the figures of the file, and with those that were measured where they lie beyond."""

    JSON_NAME = "KeptRequirement"
    WRITTEN = ("text", "unit", "limit", "stated", "measured", "observed", "observed_holds")

    text: Annotated[str, "In the words of the problem.", Json("requirement")]
    unit: Annotated[Unit, "The unit of its figures."]
    limit: Annotated[Fraction, "Limit of the requirement."]
    values: tuple[Fraction, Fraction]
    slacks: tuple[Fraction, Fraction]
    holds: tuple[bool, bool]
    observed: Annotated[
        Fraction | None,
        "Measured value of the metric itself, at the end that the requirement limits; null where it was not measured.",
    ] = None
    observed_holds: Annotated[bool | None, "Whether the measured value of the metric meets the requirement."] = None

    @property
    def is_newly_broken(self) -> bool:
        """Whether the requirement holds with the figures of the file, but not with measured figures or as measured.

        These requirements are what measuring was for: the prediction said that they hold.
        """
        return self.holds[0] and not (self.holds[1] and self.observed_holds is not False)

    @property
    def stated(self) -> KeptValue:
        """The value of the requirement with the figures that the file states."""
        return KeptValue(self.values[0], self.slacks[0], self.holds[0])

    @property
    def measured(self) -> KeptValue:
        """The value of the requirement with the measured figures."""
        return KeptValue(self.values[1], self.slacks[1], self.holds[1])


@dataclass(frozen=True, repr=False)
class MeasuredComparison(Answer):
    """A design compared with measurements.

    Metrics against their predictions, stated inputs against measured ones, and every requirement with the measured
    figures. `is_as_predicted` and `still_holds` sum it up.
    """

    FORMAT = "comparison"
    JSON_NAME = "MeasuredForm"
    WRITTEN = (
        *("of", "problem", "files", "decisions", "tolerance_ppm", "predictions", "inputs", "requirements"),
        *(Of("is_as_predicted", key="as_predicted"), "still_holds", "remarks"),
    )

    problem: Annotated[str, "The name that the problem gives itself."]
    files: Annotated[tuple[str, ...], "The files of measurements."]
    decisions: Annotated[Mapping[str, str], "The design."]
    tolerance: Fraction
    currency: str
    predictions: Annotated[tuple[Prediction, ...], "Metrics."]
    inputs: Annotated[tuple[Input, ...], "Figures of the problem file."]
    requirements: Annotated[tuple[Kept, ...], "Each requirement of the question."]
    remarks: Annotated[tuple[str, ...], "Further remarks."] = ()

    @property
    def of(self) -> Literal["measured"]:
        """The kind of things compared."""
        return "measured"

    @property
    def tolerance_ppm(self) -> Fraction:
        """The tolerance of the mean of measured periods and rates.

        In ppm of the stated value.
        """
        return self.tolerance * PPM

    @property
    def is_as_predicted(self) -> bool:
        """Whether every metric is inside its prediction, and no figure beyond its stated range.

        With `still_holds` it is the verdict of the comparison.
        """
        return all(item.verdict == "inside" for item in self.predictions) and not any(
            item.drifted for item in self.inputs
        )

    @property
    def still_holds(self) -> bool:
        """Whether every requirement holds with the measured figures, and with its measured metric where there is one.

        Judged with measured figures in the place of stated ones, and with the observed metric where it was recorded.
        """
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


class Comparison(Data):
    """The outcome of `dse compare`."""

    ONE_OF = (DesignComparison, ResultComparison, MeasuredComparison)
