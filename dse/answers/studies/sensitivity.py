"""How a design's verdicts and metrics move with its inputs: margins, tornado bars, probabilities, indices."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any

from dse.answers.base import DataAnswer, to_file
from dse.answers.question_data import WAITING, StudiedProblem, WaitingCounted
from dse.answers.tables.display import exact
from dse.answers.tables.frames import mixed_frame
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.support.json_fields import NULL, Json, Unit
from dse.support.units.text import count_words

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Break:
    """The end of an input's margin in one direction, beyond which a requirement is violated.

    Exact values of the input in base units; the first violated value exists only for inputs that are whole numbers.
    """

    last: Annotated[Fraction, "The last value that holds."]
    first: Annotated[
        Fraction | None, "The first whole value that violates a requirement; null where every value beyond `last` does."
    ]
    requirement: Annotated[str, "The requirement that is violated."]
    thread: Annotated[str, NULL, "The thread whose share violates it, where one does."] = ""


@dataclass(frozen=True)
class Margin:
    """The margin of one input: its range within which no requirement is violated while all others stay.

    `below` and `above` have the last value that meets every requirement in each direction, exact in `unit`; None where
    no requirement is violated within `searched`.
    """

    path: Annotated[str, "The input, as a path of the problem file."]
    unit: Annotated[Unit, "Unit of the values."]
    nominal: Annotated[Fraction, "Value of the input in the problem."]
    below: Annotated[Break | None, "Requirement that is violated first when the input decreases; null where none is."]
    above: Annotated[Break | None, "Requirement that is violated first when the input increases; null where none is."]
    searched: Annotated[tuple[Fraction, Fraction], "Least and greatest value of the input that was searched."]


@dataclass(frozen=True)
class Scaling:
    """All execution times multiplied by one factor.

    The critical scaling factor: above 1 there is slack, below 1 the design is infeasible already.
    """

    factor: Annotated[Fraction | None, "The greatest with which all requirements hold; null where none violates any."]
    requirement: Annotated[str, NULL, "The requirement that is violated beyond it."]
    thread: Annotated[str, NULL, "The thread whose share violates it, where one does."]
    is_exact: Annotated[bool, "Whether the factor is the exact border; else it is found to 1e-9.", Json("exact")]
    by_requirement: Annotated[Mapping[str, Fraction | None], "The factor of each requirement alone."]
    utilisations: Annotated[
        Mapping[str, Fraction], "The utilisation of each processor at the factor.", Json("utilisations_ppm")
    ]
    most: Annotated[Fraction, "The greatest factor that was looked at.", Json("searched_to")]


@dataclass(frozen=True)
class Bar:
    """A bar of a tornado chart: one metric at both ends of one input.

    Values are exact; the bars of one metric, longest first, make the tornado chart.
    """

    WRITTEN = ("metric", "unit", "path", "input_unit", "inputs", "values", "nominal", "swing")

    metric: Annotated[str, "The metric."]
    unit: Annotated[Unit, "Unit of the values."]
    path: Annotated[str, "The input."]
    input_unit: Annotated[Unit, "Unit of the input."]
    inputs: Annotated[tuple[Fraction, Fraction], "The low and the high value of the input."]
    values: Annotated[
        tuple[Annotated[Fraction, NULL], Annotated[Fraction, NULL]],
        "The metric at both values of the input; null where it is unbounded.",
    ]
    nominal: Annotated[Fraction, NULL, "The metric at the stated value; null where it is unbounded."]

    @property
    def swing(self) -> Annotated[Fraction, NULL]:
        """The length of the bar; null where an end is unbounded.

        In the unit of the metric: the greatest less the least of the two ends and the nominal value.
        """
        return max(*self.values, self.nominal) - min(*self.values, self.nominal)


@dataclass(frozen=True)
class Chance:
    """The probability that a design meets its requirements when the uncertain inputs vary.

    Estimated from samples; the standard error is that of a binomial share.
    """

    decisions: Annotated[Mapping[str, str], "The design."]
    all_met: Annotated[float, "The share of the samples in which every requirement holds."]
    standard_error: Annotated[float, "Standard error of the probability."]
    by_requirement: Annotated[Mapping[str, float], "The share in which each requirement holds."]


@dataclass(frozen=True)
class Indices:
    """The share of a metric's variation that each uncertain input explains.

    The others are as drawn for `effect`, in `unit`. `over` counts in the input's unit (or factors): its bounds, or
    where it has none the middle 95 % of its values.
    """

    output: Annotated[str, "The metric."]
    unit: Annotated[Unit, "Unit of the values."]
    first: Annotated[Mapping[str, float], "The first-order Sobol index of each input."]
    total: Annotated[Mapping[str, float], "The total Sobol index of each input."]
    effect: Annotated[Mapping[str, float], "The mean absolute change when the input goes from one end to the other."]
    spread: Annotated[Mapping[str, float], "The standard deviation of that change."]
    over: Annotated[Mapping[str, tuple[float, float]], "Both ends of each input."]


@dataclass(frozen=True)
class UncertainResult:
    """The effect of stated uncertainties on requirements and metrics.

    Chances are shares of samples; indices (Sobol 2001) say which input explains how much of a metric's variance.
    """

    JSON_NAME = "Uncertain"
    WRITTEN = ("inputs", "samples", "seed", "design_chance", "chances", "indices", "unbounded")

    inputs: Annotated[Mapping[str, str], "The uncertain inputs, each with what is stated, in words."]
    samples: Annotated[int, "The number of samples."]
    seed: Annotated[int, "The seed."]
    chances: Annotated[tuple[Chance, ...], "The chances of the designs of the front.", Json("alternatives")]
    indices: Annotated[tuple[Indices, ...], "Sobol indices: the share of each input in the variation of each metric."]
    design_chance: Annotated[Chance, "The chance of the studied design.", Json("design")]
    unbounded: Annotated[
        tuple[str, ...],
        "Metrics without indices: a response time in them has no bound for some of the stated values.",
        Json(default=[]),
    ] = ()


@dataclass(frozen=True, repr=False)
class SensitivityResult(DataAnswer):
    """The outcome of `dse sensitivity`: how one design's verdicts and metrics move with its inputs.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.sensitivity("pump.yaml", [f"{name} = {option}" for name, option in best.decisions.items()])
    >>> found.broken, found.scaling.requirement
    ((), 'utilisation of computer <= 30 %')
    """

    FORMAT = "sensitivity"
    WRITTEN = (
        *("problem", "decisions", "broken", "margins", "scaling", "swing", "bars", "uncertain", "left_out"),
        *("waiting", "files"),
    )

    problem: Annotated[Mapping[str, Any], "Which problem was studied.", Json(kind=StudiedProblem)]
    decisions: Annotated[Mapping[str, str], "The studied design."]
    broken: Annotated[tuple[str, ...], "The requirements that it violates; margins concern the others."]
    margins: Annotated[tuple[Margin, ...], "Margin of each input, alone."]
    scaling: Annotated[
        Scaling | None, "All execution times together; null where time was too short.", Json("execution_times")
    ]
    bars: Annotated[tuple[Bar, ...], "Effect of each input on each metric.", Json("tornado")]
    swing: Annotated[str, "Range of the inputs over which the bars go."]
    uncertain: Annotated[
        UncertainResult | None,
        "Effect of the stated uncertainties; null where none are stated.",
        Json("uncertainty"),
    ] = None
    left_out: Annotated[tuple[str, ...], "Parts that the time limit left out.", Json(default=[])] = ()
    waiting: Annotated[Mapping[str, list[str]], WAITING, Json(kind=WaitingCounted)] = field(default_factory=dict)
    files: Annotated[
        Mapping[str, str], "The text of the problem file, of what it includes and of its samples, by name."
    ] = field(default_factory=dict)

    @property
    def currency(self) -> str:
        """The currency of prices, which count in cents."""
        return str(self.problem["currency"])

    def _verdict(self) -> str:
        broken = f"violates {count_words(len(self.broken), 'requirement')}, " if self.broken else ""
        return f"{broken}{count_words(len(self.margins), 'margin')}"

    @property
    def exit_code(self) -> int:
        """The exit code of the command line.

        4 where the design violates a requirement as it is stated, 5 where the time limit came first, else 0.
        """
        if self.broken:
            return EXIT_NO
        return EXIT_INCOMPLETE if self.left_out else EXIT_COMPLETE

    @property
    def metrics(self) -> list[str]:
        """The metrics that some input moves.

        Names, each once, in the order of `bars`.
        """
        return list(dict.fromkeys(bar.metric for bar in self.bars))

    def _rows(self) -> list[list[Any]]:
        rows = []
        for item in self.margins:
            row: list[Any] = [item.path, item.unit, exact(item.nominal)]
            for side in (item.below, item.above):
                row += [None, None] if side is None else [exact(side.last), side.requirement]
            rows.append(row)
        return rows

    COLUMNS = ("path", "unit", "nominal", "least that holds", "broken below", "greatest that holds", "broken above")

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """The margins as CSV text: exact figures in the unit beside them, fractions as text.

        Empty where nothing breaks.
        """
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.COLUMNS)
        writer.writerows(self._rows())
        return to_file(out.getvalue(), path)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The margins as a frame; columns as in `to_csv`: each row counts in its ``unit``.

        `units` as for `Result.frame`: rows of their kind are in that unit, which then stands in ``unit``.
        """
        rows = [dict(zip(self.COLUMNS, row, strict=True)) for row in self._rows()]
        figures = ("nominal", "least that holds", "greatest that holds")
        return mixed_frame(self.COLUMNS, rows, figures, units, self.currency)
