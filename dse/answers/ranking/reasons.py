"""Why an alternative is there: what changes, what it gains and gives up, what limits it, and what more would cost.

Everything is computed from the front and the analysis; `dse.report.words.reasons` puts it into sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.rows import Row
from dse.analysis.limits import ComparedSum, Limit, comparisons
from dse.analysis.views import View
from dse.answers.analysis import Analysis, FlowTable, analyse_design
from dse.answers.designs import Point
from dse.answers.ranking.changes import Change, Delta, changes_between, counted_changes, deltas
from dse.answers.result import Result
from dse.space.model.criteria import Requirement
from dse.support.units import Exact, Rounding, parse_duration_ns, whole


@dataclass(frozen=True)
class PointDeltas:
    """An alternative against another design: `with_` is that one's id on the front, or None for the baseline.

    `changes` are decisions with both options, `deltas` the objectives of both.
    """

    with_: int | None
    changes: tuple[Change, ...]
    deltas: tuple[Delta, ...]


@dataclass(frozen=True)
class Margin:
    """The slack of a requirement, in `unit`; `thread` is named where the limit is that of one core alone.

    `capacity` is what the limit is a share of (all cores, the bandwidth), where it is stated as a share.
    """

    requirement: Requirement
    value: Fraction
    limit: Fraction
    unit: str
    thread: str = ""
    capacity: Fraction | None = None

    @property
    def slack(self) -> Fraction:
        """The distance that the value may still move towards the limit.

        In the unit of the requirement's metric; negative where the requirement is violated.
        """
        return self.limit - self.value if self.requirement.is_upper else self.value - self.limit

    @property
    def share(self) -> Fraction:
        """The slack as a share of the limit; of 1 where the limit is 0.

        A fraction; the requirement with the least share is the tightest.
        """
        return self.slack / (abs(self.limit) or 1)


@dataclass(frozen=True)
class Dominant:
    """The rows with the largest share of a flow's worst-case latency, or of its jitter.

    Each of `rows` takes `part_ns` of `total_ns`; `of` is ``latency`` or ``jitter``.
    """

    flow: str
    of: str
    rows: tuple[Row, ...]
    part_ns: Exact
    total_ns: Exact


@dataclass(frozen=True)
class Improvement:
    """The next better value of an objective on the front: the point that has it at the least loss, if there is one.

    `point` is its id, None where the front has no better value. `deltas` say what the step costs in the other
    objectives.
    """

    objective: str
    point: int | None
    deltas: tuple[Delta, ...]
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class Spared:
    """Another offset of a reader, with which every objective is the same and a flow shorter, and none longer.

    Offsets before and after in ns; `saves_ns` has the gain of each flow that becomes shorter.
    """

    reader: str
    offsets_ns: tuple[Exact, Exact]
    saves_ns: Mapping[str, Exact]


@dataclass(frozen=True)
class Reasons:
    """Everything that is said about one alternative; `variants` are near-identical points, compared with it.

    Made by `Reasoner.reasons`; reports turn the parts into sentences.
    """

    point: Point
    analysis: Analysis
    changed: tuple[Change, ...] | None
    """The changes against the baseline, where they are counted; they are known of a part of a baseline, too."""
    baseline: PointDeltas | None
    above: PointDeltas | None
    neighbour: PointDeltas | None
    variants: tuple[PointDeltas, ...]
    margins: tuple[Margin, ...]
    dominants: tuple[Dominant, ...]
    improvements: tuple[Improvement, ...]
    spared: tuple[Spared, ...] = ()


class Reasoner:
    """Finds the reasons for the points of one result; builds the measures once."""

    def __init__(self, result: Result) -> None:
        self.result = result
        self._losses = _scaled_losses(result)

    @cached_property
    def evaluator(self) -> Evaluator:
        """The measures of the problem."""
        return Evaluator(self.result.space)

    @cached_property
    def baseline(self) -> tuple[Analysis, dict[str, int]] | None:
        """The analysis of today's design with its objectives, if it is a valid design; --fix does not bind it.

        None where no baseline is stated or its choices make no valid design; the baseline need not meet the
        requirements.
        """
        design = self.result.baseline
        if design is None:
            return None
        space = self.result.space
        evaluator = Evaluator(replace(space, fixed={})) if space.fixed else self.evaluator
        evaluation = evaluator.evaluate(design)
        if evaluation.breaches:
            return None
        names = [item.name for item in self.result.objectives]
        return analyse_design(evaluator, design), dict(zip(names, evaluation.objectives, strict=True))

    def reasons(self, position: int) -> Reasons:
        """The reasons for the point at `position` of the front.

        `position` counts from 0 in the order of rank. Takes one analysis of the design.
        """
        point = self.result.front[position]
        analysis = analyse_design(self.evaluator, point.design)
        above, neighbour = self.above(position), self.neighbour(position)
        return Reasons(
            point=point,
            analysis=analysis,
            changed=counted_changes(self.result.space, point.design),
            baseline=self._against_baseline(point),
            above=None if above is None else self.against(point, above),
            neighbour=None if neighbour is None else self.against(point, neighbour),
            variants=tuple(self._variants(point)),
            margins=tuple(self.margins(point)),
            dominants=tuple(dominants(analysis)),
            improvements=tuple(self._improvements(position)),
            spared=tuple(self._spared(point, analysis)),
        )

    def _spared(self, point: Point, analysis: Analysis) -> Iterator[Spared]:
        """For each reader that gains from another offset: the first that it may have from then on, if that is free.

        The design shown is the first of those with its objectives, whatever else they differ in.
        """
        better = {item.receiver: item for item in analysis.boundaries if item.better and None not in item.offsets_ns}
        today = {flow.name: flow.max_ns for flow in analysis.flows}
        for reader, item in better.items():
            number, offset = self._offset(reader, item.better.offset_ns if item.better else 0)
            if offset is None or number in self.result.space.fixed:
                continue
            changed = (*point.design[:number], offset[1], *point.design[number + 1 :])
            evaluation = self.evaluator.evaluate(changed)
            if not evaluation.is_feasible or evaluation.objectives != tuple(point.objectives.values()):
                continue
            flows = {flow.name: flow.max_ns for flow in analyse_design(self.evaluator, evaluation.design).flows}
            saves = {name: today[name] - most for name, most in flows.items() if most != today[name]}
            if saves and min(saves.values()) > 0:
                yield Spared(reader, (whole(item.offsets_ns[1] or 0), offset[0]), saves)

    def _offset(self, reader: str, least_ns: Exact) -> tuple[int, tuple[Exact, int] | None]:
        """The decision of an offset, and the first of its options from some time on."""
        for number, decision in enumerate(self.result.space.decisions):
            if decision.name == f"{reader}.offset" and decision.is_open:
                times = [
                    (parse_duration_ns(text, Rounding.UP), option)
                    for option, text in enumerate(decision.options)
                    if text != "unknown"
                ]
                return number, min((pair for pair in times if pair[0] >= least_ns), default=None)
        return -1, None

    def against(self, point: Point, other: Point, *, like_other: bool = False) -> PointDeltas:
        """Compare `point` with `other`: changed decisions, gains and losses; cores have the numbers of one of them.

        `like_other` numbers interchangeable cores as in `other`, so that a renumbered core is no change.
        """
        changes = changes_between(self.result.space, other.design, point.design, like_before=like_other)
        return PointDeltas(other.id, changes, deltas(self.result.objectives, other.objectives, point.objectives))

    def _against_baseline(self, point: Point) -> PointDeltas | None:
        if self.baseline is None or self.result.baseline is None:
            return None
        changes = changes_between(self.result.space, self.result.baseline, point.design)
        return PointDeltas(None, changes, deltas(self.result.objectives, self.baseline[1], point.objectives))

    def _variants(self, point: Point) -> Iterator[PointDeltas]:
        """The points that `point` stands for, with what they change, gain and lose against it."""
        for other in self.result.front:
            if self.result.variants.get(other.id) == point.id:
                yield replace(self.against(other, point, like_other=True), with_=other.id)

    def above(self, position: int) -> Point | None:
        """The point ranked before this one; variants are passed over by what is none itself.

        A variant is compared with any point above it. None for the first point.
        """
        front, variants = self.result.front, self.result.variants
        before = reversed(front[:position])
        return next((p for p in before if front[position].id in variants or p.id not in variants), None)

    def neighbour(self, position: int) -> Point | None:
        """The nearest other point, objectives scaled to their range on the front; the first ranked of several.

        Variants are passed over by what is none itself.
        """
        here, front, variants = self._losses[position], self.result.front, self.result.variants
        others = [
            (sum(((a - b) ** 2 for a, b in zip(here, row, strict=True)), Fraction(0)), other)
            for other, row in enumerate(self._losses)
            if other != position and (front[position].id in variants or front[other].id not in variants)
        ]
        return self.result.front[min(others)[1]] if others else None

    def _improvements(self, position: int) -> Iterator[Improvement]:
        front, point = self.result.front, self.result.front[position]
        for axis, info in enumerate(self.result.objectives):
            better = [other for other in range(len(front)) if self._losses[other][axis] < self._losses[position][axis]]
            if not better:
                yield Improvement(info.name, None, (), ())
                continue
            nearest = max(self._losses[other][axis] for other in better)
            _, best = min(
                (self._loss(position, other), other) for other in better if self._losses[other][axis] == nearest
            )
            step = self.against(front[best], point, like_other=True)
            yield Improvement(info.name, front[best].id, step.deltas, step.changes)

    def _loss(self, position: int, other: int) -> Fraction:
        pairs = zip(self._losses[position], self._losses[other], strict=True)
        return sum((max(b - a, Fraction(0)) for a, b in pairs), Fraction(0))

    def margins(self, point: Point) -> list[Margin]:
        """The room that each requirement leaves, least first, as a share of its limit.

        One `Margin` for each requirement, a second one for the fullest core where each core has a limit; equalities
        have none.
        """
        view = View(point.design)
        margins = [margin for limit in self.evaluator.limits for margin in margins_of(limit, view)]
        return sorted(margins, key=lambda margin: margin.share)


def margins_of(limit: Limit, view: View) -> list[Margin]:
    """The margin of a limit, and that of the fullest core where each core must keep one.

    Where cores are open it is the fullest core of the partition that is reported, or the busiest thread where there is
    none.

    An equality has none: there is no side on which the value may move.
    """
    requirement, unit = limit.requirement, limit.measure.unit
    if requirement.operator == "==":
        return []
    bound = limit.bound(view)
    margins = [Margin(requirement, limit.measure.value(view), bound, unit, capacity=_capacity(requirement, bound))]
    if limit.cores is not None and limit.cores.most != bound:
        alone = [
            item
            for item in comparisons(limit, view)
            if item.thread or (item.spread is not None and item.spread.status != "undecided")
        ]
        fullest = max(alone, key=lambda item: (item.value, _stated_core(item)), default=None)
        if fullest is not None:
            who = fullest.thread or f"core {fullest.core}"
            margins.append(Margin(requirement, fullest.value, limit.cores.most, unit, who))
    return margins


def _stated_core(item: ComparedSum) -> int:
    """The number of a core that is stated or decided; 0 for a thread, and for a core of a partition."""
    return 0 if item.spread is None or item.spread.is_open else item.core


def _capacity(requirement: Requirement, bound: Fraction) -> Fraction | None:
    """The whole of which a limit on utilisation or load is a share; None for a limit that is no share."""
    stated = requirement.limit.value
    return bound / stated if requirement.is_share and stated else None


def dominants(analysis: Analysis) -> Iterator[Dominant]:
    """For each flow the rows that have most of its worst-case latency, and those that have most of its jitter.

    One `Dominant` for latency and one for jitter of each flow, where the total is above 0.
    """
    for table in analysis.flows:
        for of, parts in (
            ("latency", [row.max_ns for row in table.rows]),
            ("jitter", [row.max_ns - row.min_ns for row in table.rows]),
        ):
            yield from _dominant(table, of, parts)


def _dominant(table: FlowTable, of: str, parts: Sequence[Exact]) -> Iterator[Dominant]:
    most = max(parts, default=0)
    if 0 < most <= sum(parts):  # what makes one row longer may make another shorter: sampling on one clock
        rows = tuple(row for row, part in zip(table.rows, parts, strict=True) if part == most)
        yield Dominant(table.name, of, rows, most, sum(parts, Fraction(0)))


def _scaled_losses(result: Result) -> list[tuple[Fraction, ...]]:
    """The objectives of each point, to be minimised, from 0 to 1 over the front."""
    columns: list[list[Fraction]] = []
    for info in result.objectives:
        sign = 1 if info.sense == "minimise" else -1
        values = [sign * point.objectives[info.name] for point in result.front]
        low, high = min(values, default=0), max(values, default=0)
        columns.append([Fraction(value - low, (high - low) or 1) for value in values])
    return list(zip(*columns, strict=True)) if columns else []
