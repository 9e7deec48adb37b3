"""How a design's verdicts and metrics move with its inputs: margins, tornado bars, probabilities, indices."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from dse.answers.base import DataAnswer
from dse.answers.tables.display import exact
from dse.answers.tables.frames import mixed_frame
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO

if TYPE_CHECKING:
    import pandas

    from dse.answers.forms import margins as forms


@dataclass(frozen=True)
class Break:
    """Where a requirement breaks in one direction.

    The last value that holds, the first that breaks, and which requirement.

    `first` is None where the border is no whole number and every value beyond `last` breaks. `last` itself holds.
    """

    last: Fraction
    first: Fraction | None
    requirement: str
    thread: str = ""


@dataclass(frozen=True)
class Margin:
    """How far one input may move, alone.

    `below` and `above` are None where no requirement breaks down to `least`, up to `most`.
    """

    path: str
    unit: str
    nominal: Fraction
    below: Break | None
    above: Break | None
    least: Fraction
    most: Fraction

    @property
    def searched(self) -> tuple[Fraction, Fraction]:
        """Between which values borders were looked for."""
        return self.least, self.most

    @classmethod
    def _heard(cls, form: forms.Margin) -> Mapping[str, Any]:
        least, most = form.searched
        return {"least": least, "most": most}


@dataclass(frozen=True)
class Scaling:
    """All execution times multiplied by one factor.

    Up to `factor` every requirement holds, beyond it `requirement` breaks (by `thread` alone, where one is named).

    `factor` is None where no factor up to `most` breaks anything; `is_exact` tells the exact border from one found to
    1e-9. `by_requirement` has the factor of each requirement alone, `utilisations` each processor's at that factor
    (the breakdown utilisation).
    """

    factor: Fraction | None
    requirement: str
    thread: str
    is_exact: bool
    by_requirement: Mapping[str, Fraction | None]
    utilisations: Mapping[str, Fraction]
    most: Fraction


@dataclass(frozen=True)
class Bar:
    """A bar of a tornado chart: the metric at the low and at the high value of one input, all else nominal."""

    metric: str
    unit: str
    path: str
    input_unit: str
    inputs: tuple[Fraction, Fraction]
    values: tuple[Fraction, Fraction]
    nominal: Fraction

    @property
    def swing(self) -> Fraction:
        """The length of the bar."""
        return max(*self.values, self.nominal) - min(*self.values, self.nominal)


@dataclass(frozen=True)
class Chance:
    """How likely a design meets every requirement, and each of them, when the uncertain inputs vary."""

    decisions: Mapping[str, str]
    all_met: float
    standard_error: float
    by_requirement: Mapping[str, float]


@dataclass(frozen=True)
class Indices:
    """What of an output's variation each uncertain input explains.

    Sobol: `first` alone, `total` with its interactions. `effect` is the mean absolute change (in `unit`) when the input
    goes from one end of its range to the other and the others are as drawn, `spread` the change's standard deviation;
    `over` has both ends in the input's unit (or factors): its bounds, or where it has none the middle 95 % of its
    values. `output` is a metric.
    """

    output: str
    unit: str
    first: Mapping[str, float]
    total: Mapping[str, float]
    effect: Mapping[str, float]
    spread: Mapping[str, float]
    over: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class UncertainResult:
    """What stated uncertainties do: inputs in words, the chance of each alternative, indices of the studied design.

    The metrics `unbounded` have none: a response time in them has no bound for some of the stated values.
    """

    inputs: Mapping[str, str]
    samples: int
    seed: int
    chances: tuple[Chance, ...]
    indices: tuple[Indices, ...]
    design_chance: Chance
    unbounded: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class SensitivityResult(DataAnswer):
    """The sensitivity of one design.

    `broken` are the requirements that the design breaks as it is; margins and scaling then look at the others.
    `swing` says over what the bars go. `left_out` names what the time limit left no time for; where that is the factor
    on all execution times, `scaling` is None. `bus_waiting` says that no latency counts it, where a
    physical bus carries messages.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.sensitivity("pump.yaml", [f"{name} = {option}" for name, option in best.decisions.items()])
    >>> found.broken, found.scaling.requirement
    ((), 'utilisation of computer <= 30 %')
    """

    FORM = "margins.SensitivityForm"

    problem: Mapping[str, Any]
    decisions: Mapping[str, str]
    broken: tuple[str, ...]
    margins: tuple[Margin, ...]
    scaling: Scaling | None
    bars: tuple[Bar, ...]
    swing: str
    uncertain: UncertainResult | None = None
    currency: str = "EUR"
    left_out: tuple[str, ...] = ()
    bus_waiting: str | None = None
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """What the command line answers with."""
        if self.broken:
            return EXIT_NO
        return EXIT_INCOMPLETE if self.left_out else EXIT_COMPLETE

    @property
    def metrics(self) -> list[str]:
        """The metrics that some input moves."""
        return list(dict.fromkeys(bar.metric for bar in self.bars))

    def _rows(self) -> list[list[Any]]:
        rows = []
        for item in self.margins:
            row: list[Any] = [item.path, item.unit, exact(item.nominal)]
            for side in (item.below, item.above):
                row += [None, None] if side is None else [exact(side.last), side.requirement]
            rows.append(row)
        return rows

    @classmethod
    def _heard(cls, form: forms.SensitivityForm) -> Mapping[str, Any]:
        return {"currency": form.problem.currency, "files": form.files or {}}

    COLUMNS = ("path", "unit", "nominal", "least that holds", "broken below", "greatest that holds", "broken above")

    def to_csv(self) -> str:
        """The margins as CSV text: exact figures in the unit beside them, fractions as text.

        Empty where nothing breaks.
        """
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.COLUMNS)
        writer.writerows(self._rows())
        return out.getvalue()

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The margins as a frame; columns as in `to_csv`: each row counts in its ``unit``.

        `units` as for `Result.frame`: rows of their kind are in that unit, which then stands in ``unit``.
        """
        rows = [dict(zip(self.COLUMNS, row, strict=True)) for row in self._rows()]
        figures = ("nominal", "least that holds", "greatest that holds")
        return mixed_frame(self.COLUMNS, rows, figures, units, self.currency)
