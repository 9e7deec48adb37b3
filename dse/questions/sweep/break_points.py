"""Break-points of a limit: the exact values at which the front of the remaining objectives changes, proved.

Let m be the varied metric, R the objectives other than m, and F the front of (R, m) under the loosest limit of the
interval. A design that is non-dominated in R under a limit L on m has the vector of some point of F that meets L:
whatever dominates it in (R, m) meets L too. So the front of R under every L follows from F alone, and changes only at
values of m on F. Where the limit is a share of what the chosen type has (utilisation, load in per cent), the smallest
share that the front needs is found, and the next front is that under a strictly smaller share: again every value
between two break-points is proved to have the same front.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm
from typing import Any, Literal, TypeAlias

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import MANY_CASES, build_limit, needed_share
from dse.analysis.measures import PPM, SCALE_LIMIT, Measure, Term, build_measure, display_unit
from dse.analysis.views import View, tabulate
from dse.answers.forms.codec import written
from dse.answers.studies.run_data import FoundBreaks
from dse.questions.sweep.axes import LimitAxis, limit_requirements, limited
from dse.questions.sweep.fronts import (
    Jury,
    MetricReader,
    check_objectives,
    minimised,
    non_dominated,
    objective_infos,
    search_space,
    senses,
)
from dse.space.model.criteria import Objective
from dse.space.model.metric_kinds import metric_dimension
from dse.space.model.space import Design, Space
from dse.space.question.open_cores import with_open_cores
from dse.support.units import DIMENSIONLESS, Quantity

DEFINITION = (
    "the best choice under a limit is the first of the front of the remaining objectives "
    "(those other than the limited metric), ranked by distance to the ideal point of all fronts of the sweep, "
    "objectives scaled to their range on these; between two break-points that front does not change"
)
Row: TypeAlias = tuple[tuple[int, ...], Design]


@dataclass(frozen=True)
class LimitInterval:
    """From `value` (in the limit's unit) up to the next stretch towards looser limits.

    The front of the rest is `rows`.
    """

    value: Fraction
    rows: tuple[Row, ...]


def break_points(space: Space, axis: LimitAxis, seed: int) -> dict[str, Any]:
    """Every break-point of a limit in the axis' interval, as data.

    ``status`` is ``complete``, ``infeasible`` (no design even under the loosest limit) or ``incomplete`` (stopped).
    """
    check_objectives(space)
    rest = tuple(item for item in space.objectives if item.metric != axis.metric) or space.objectives
    question = _LimitSweep(replace(space, objectives=rest), axis, seed)
    stretches, proved = question.stretches()
    jury = Jury(question.space, None if question.is_share else axis.metric)
    figures = MetricReader(Evaluator(question.space), jury)
    status = "incomplete" if not proved else "complete" if stretches else "infeasible"
    outcome = {
        "kind": "breaks",
        "status": status,
        "definition": DEFINITION,
        "metric": axis.name,
        "operator": axis.operator,
        "unit": question.unit,
        "from": question.ends[0],
        "to": question.ends[1],
        "exact": not question.rounded,
        "objectives": objective_infos(figures.evaluator),
        "units": figures.units,
        **_described(question, figures, stretches),
    }
    return written(FoundBreaks, outcome)


def _described(question: _LimitSweep, figures: MetricReader, stretches: list[LimitInterval]) -> dict[str, Any]:
    """The designs of all stretches, numbered in order of appearance, and each stretch by those numbers."""
    numbers: dict[Design, int] = {}
    shown = []
    tight, loose = question.ends if question.sign > 0 else question.ends[::-1]
    for position, stretch in enumerate(stretches):
        designs = [design for _, design in sorted(stretch.rows)]
        for design in designs:
            numbers.setdefault(design, len(numbers) + 1)
        until = stretches[position + 1].value if position + 1 < len(stretches) else loose
        shown.append(
            {
                "from": _within(stretch.value, tight, question.sign),
                "to": until,
                "front": [{"id": numbers[design]} for design in designs],
            }
        )
    needed = stretches[0].value if stretches else None
    first = needed is not None and (needed - tight) * question.sign > 0
    return {
        "infeasible_until": needed if first else None,
        "stretches": shown,
        "alternatives": [
            {"id": number, "limited": question.needed(design), **figures.alternative(design)}
            for design, number in numbers.items()
        ],
    }


def _within(value: Fraction, tight: Fraction, sign: int) -> Fraction:
    return tight if (value - tight) * sign < 0 else value


def _share_of_load(space: Space, axis: LimitAxis) -> Measure | None:
    """The load of a bus as a share of its bandwidth, in ppm: each term over the bandwidth of the chosen type.

    None where its common denominator is too fine to count in, or the load itself is an objective.
    """
    measure = build_measure(space, axis.metric)
    whole = Quantity(Fraction(PPM), DIMENSIONLESS, "ppm")
    bound = build_limit(space, limit_requirements(axis, whole, axis.operator)[0]).bound
    cases = tabulate(space, lambda view: PPM * PPM / bound(view), MANY_CASES)
    if cases is None or measure.rounded or any(item.metric == axis.metric for item in space.objectives):
        return None
    scale = measure.scale * lcm(*(case.value.denominator for case in cases))
    if scale > SCALE_LIMIT:
        return None
    return Measure(measure.metric, "ppm", tuple(_over(term, bound) for term in measure.terms), scale)


def _over(term: Term, bound: Callable[[View], Fraction]) -> Term:
    coefficient = term.coefficient

    def value(view: View) -> Fraction:
        return term.value(view) * PPM * PPM / bound(view)

    def scaled(view: View) -> Fraction:
        assert coefficient is not None
        return coefficient(view) * PPM * PPM / bound(view)

    return replace(term, value=value, coefficient=scaled if coefficient is not None else None)


def _settled(stretches: Sequence[LimitInterval]) -> list[LimitInterval]:
    """The stretches with one design for each vector: that of the tightest limit, which every looser one admits."""
    designs: dict[tuple[int, ...], Design] = {}
    return [
        replace(stretch, rows=tuple((vector, designs.setdefault(vector, design)) for vector, design in stretch.rows))
        for stretch in stretches
    ]


class _LimitSweep:
    """A limit over an interval: `sign` is 1 where larger limits are looser (``<=``), -1 for ``>=``."""

    def __init__(self, space: Space, axis: LimitAxis, seed: int) -> None:
        self.space, self.axis, self.seed = space, axis, seed
        self.sign = 1 if axis.operator == "<=" else -1
        metric, low, high = axis.metrics[0], axis.low[0].limit, axis.high[0].limit
        self.measure = build_measure(space, axis.metric)
        self.dimension = low.dimension
        self.is_share = metric.kind == "utilisation" or (metric.kind == "load" and low.dimension == DIMENSIONLESS)
        dimension = DIMENSIONLESS if self.is_share else metric_dimension(space, metric)
        self.unit, self.factor = display_unit(dimension) if dimension is not None else (self.measure.unit, Fraction(1))
        self.ends = (low.value * self.factor, high.value * self.factor)
        self.rounded = self.measure.rounded
        self.needed: Callable[[Design], Fraction] = self._needed_share if self.is_share else self._value
        single_load = self.is_share and metric.kind == "load" and len(axis.metrics) == 1
        self.share = _share_of_load(space, axis) if single_load else None

    def _value(self, design: Design) -> Fraction:
        return self.measure.value(View(design))

    def _needed_share(self, design: Design) -> Fraction:
        """The tightest share that the design keeps, in ppm."""
        whole = Quantity(Fraction(1), DIMENSIONLESS, "%")
        limits = limit_requirements(self.axis, whole, self.axis.operator)
        shares = [needed_share(build_limit(self.space, item), View(design))[0] for item in limits]
        return (max(shares) if self.sign > 0 else min(shares)) * self.factor

    def stretches(self) -> tuple[list[LimitInterval], bool]:
        """The stretches from the tightest limit to the loosest, and whether they are proved."""
        intervals: list[LimitInterval] = []
        proved = True
        steps = self._by_shares() if self.is_share and self.share is None else self._by_values()
        for stretch in steps:
            if stretch is None:
                proved = False
            elif intervals and {row[0] for row in intervals[-1].rows} == {row[0] for row in stretch.rows}:
                intervals[-1] = stretch  # the same front, by designs that need less
            else:
                intervals.append(stretch)
        return _settled(intervals[::-1]), proved

    def _front(self, limit: Fraction, operator: str, objective: Objective) -> list[Row] | None:
        """Vector of the rest and design of each point of the front of (rest, metric); None when it was stopped."""
        quantity = Quantity(limit / self.factor, self.dimension, "")
        space = limited(self.space, limit_requirements(self.axis, quantity, operator))
        own = [item.metric for item in space.objectives]
        if objective.metric not in own:
            space = with_open_cores(replace(space, objectives=(*space.objectives, objective)))
        stand_ins = None
        if self.share is not None and objective.metric not in own:
            stand_ins = (*(build_measure(space, metric) for metric in own), self.share)
        search = search_space(Evaluator(space, stand_ins), self.seed)
        if not search.is_complete:
            return None
        return [(vector[: len(own)], design) for vector, design in search.points.items()]

    def _objective(self) -> Objective:
        sense: Literal["minimise", "maximise"] = "minimise" if self.sign > 0 else "maximise"
        return Objective(f"{sense} {self.axis.metric.name}", sense, self.axis.metric)

    def _by_values(self) -> Iterator[LimitInterval | None]:
        """One front; then the limits on it from the loosest to the tightest."""
        tight, loose = self.ends if self.sign > 0 else self.ends[::-1]
        rows = self._front(loose, self.axis.operator, self._objective())
        if rows is None:
            yield None
            return
        keyed = sorted((self.sign * self.needed(design), vector, design) for vector, design in rows)
        for value in sorted({key for key, _, _ in keyed}, reverse=True):
            admitted = [(vector, design) for key, vector, design in keyed if key <= value]
            kept = self._rest_front(admitted)
            yield LimitInterval(self._needed_by(kept), kept)
            if value <= self.sign * tight:
                return

    def _rest_front(self, rows: list[Row]) -> tuple[Row, ...]:
        """The rows that are non-dominated in the rest; of equal ones the first."""
        directions = senses(self.space)
        vectors = {number: minimised(vector, directions) for number, (vector, _) in enumerate(rows)}
        return tuple(rows[number] for number in non_dominated(vectors))

    def _needed_by(self, rows: tuple[Row, ...]) -> Fraction:
        """The tightest limit that all designs of a front keep."""
        return self.sign * max(self.sign * self.needed(design) for _, design in rows)

    def _by_shares(self) -> Iterator[LimitInterval | None]:
        """One front for each share that a front needs, from the loosest to the tightest."""
        tight, loose = self.ends if self.sign > 0 else self.ends[::-1]
        limit, operator = loose, str(self.axis.operator)
        while True:
            rows = self._front(limit, operator, self._objective())
            if rows is None:
                yield None
                return
            if not rows:
                return
            ordered = sorted(rows, key=lambda row: (self.sign * self.needed(row[1]), row))
            kept = self._rest_front(ordered)
            before, limit = limit, self._needed_by(kept)
            if operator in ("<", ">") and (limit - before) * self.sign >= 0:
                yield None  # whether the threads fit on cores is undecided: nothing tighter can be proved
                return
            operator = "<" if self.sign > 0 else ">"
            yield LimitInterval(limit, kept)
            if (limit - tight) * self.sign <= 0:
                return
