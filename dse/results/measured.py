"""A design's prediction held against what was measured: metrics, figures of the file, and requirements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from dse.files.answer import Answer
from dse.results.compare import FORMAT
from dse.results.display import exact
from dse.units import is_unbounded


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
    def drifted(self) -> bool:
        """Whether what was measured lies beyond what the file states."""
        return self.counted is not None


@dataclass(frozen=True)
class Kept:
    """A requirement with the figures of the file and with those that were measured: value, slack, whether it holds."""

    text: str
    unit: str
    limit: Fraction
    values: tuple[Fraction, Fraction]
    slacks: tuple[Fraction, Fraction]
    holds: tuple[bool, bool]


@dataclass(frozen=True)
class MeasuredComparison(Answer):
    """One design against measurements: metrics, figures of the file, and requirements with the measured figures.

    `remarks` say what could not be held against anything, and why.
    """

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
        """Whether every requirement holds with the measured figures."""
        return all(item.holds[1] for item in self.requirements)

    def to_dict(self) -> dict[str, Any]:
        """In the form ``dse-comparison/1``."""
        return {
            "format": FORMAT,
            "of": "measured",
            "problem": self.problem,
            "files": list(self.files),
            "decisions": dict(self.decisions),
            "tolerance_ppm": exact(self.tolerance * 10**6),
            "predictions": [
                {
                    "metric": item.name,
                    "unit": item.unit,
                    "predicted": [None if item.low is None else exact(item.low), exact(item.high)],
                    "measured": _seen(item.seen),
                    "verdict": item.verdict,
                    "beyond": exact(item.beyond),
                    "of_measured": _share(item.of_measured),
                    "of_predicted": _share(item.of_predicted),
                    "outside": item.outside,
                }
                for item in self.predictions
            ],
            "inputs": [
                {
                    "figure": item.name,
                    "unit": item.unit,
                    "stated": [exact(item.low), exact(item.high)],
                    "measured": _seen(item.seen),
                    "drifted": item.drifted,
                    "counted": None if item.counted is None else [exact(value) for value in item.counted],
                }
                for item in self.inputs
            ],
            "requirements": [
                {
                    "requirement": item.text,
                    "unit": item.unit,
                    "limit": exact(item.limit),
                    "stated": {"value": exact(item.values[0]), "slack": exact(item.slacks[0]), "holds": item.holds[0]},
                    "measured": {
                        "value": exact(item.values[1]),
                        "slack": exact(item.slacks[1]),
                        "holds": item.holds[1],
                    },
                }
                for item in self.requirements
            ],
            "as_predicted": self.is_as_predicted,
            "still_holds": self.still_holds,
            "remarks": list(self.remarks),
        }


def _seen(item: Seen) -> dict[str, Any]:
    mean = None if item.mean is None else float(item.mean)
    return {"low": exact(item.low), "high": exact(item.high), "mean": mean, "count": item.count, "place": item.place}


def _kept(item: Kept, number: int) -> dict[str, Any]:
    return {"value": exact(item.values[number]), "slack": exact(item.slacks[number]), "holds": item.holds[number]}


def _share(value: Fraction | None) -> float | None:
    return None if value is None else float(value)
