"""The nearest design beyond a limit: what a little more of one figure would save of another.

A second, small question about a complete front: without its nearest limit, and with another objective at least a tenth
better than on the whole front, which design exceeds the limit least? One search with a single objective answers it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit
from dse.analysis.views import View
from dse.answers.result import ObjectiveInfo, Result, decisions_of
from dse.answers.tables.display import scaled_unit
from dse.questions.explain.limits import factor
from dse.search.front import SearchLimits, search_front
from dse.space.model.criteria import Metric, Objective, Requirement
from dse.space.model.metric_kinds import metric_dimension
from dse.space.model.space import Space
from dse.space.question.metrics import worst_of
from dse.support.errors import TooLargeError
from dse.support.timelimit import OutOfTime, TimeLimit, until
from dse.support.units import Quantity, is_unbounded

SAVED = Fraction(1, 10)
"""How much better the other objective must be than on the front, as a share of its best value there."""


@dataclass(frozen=True)
class Beyond:
    """The design that exceeds a limit least among those that are a tenth better in another objective.

    `limited` is what is limited (``jitter`` where every flow is) and `saved` the name of the other objective. `limit`
    and `value` are in `unit`, a base unit such as ns, `objectives` in counting units. No design with such a saving
    exceeds the limit less: proved.
    """

    limited: str
    unit: str
    limit: Fraction
    value: Fraction
    saved: str
    objectives: Mapping[str, int]
    decisions: Mapping[str, str]


@dataclass(frozen=True)
class _Limit:
    """The nearest limit: all metrics that it is stated of, and its bound in base units."""

    number: int
    metrics: tuple[Metric, ...]
    bound: Fraction

    @property
    def worst(self) -> Metric:
        """The greatest of the limited metrics."""
        return self.metrics[0] if len(self.metrics) == 1 else worst_of(self.name, self.metrics, "<=")

    @property
    def name(self) -> str:
        """The limited metric as the requirement names it: one metric, or the kind that stands for several."""
        return self.metrics[0].name if len(self.metrics) == 1 else self.metrics[0].kind


def beyond(result: Result, limit: TimeLimit) -> Beyond | None:
    """The nearest design beyond the nearest limit of a complete front.

    None where no objective with a limit has another objective to save, where no design does, or where it was not proved
    in time. Prices are saved rather than other figures.
    """
    nearest = _nearest_limit(result)
    if result.status != "complete" or nearest is None:
        return None
    own = result.objectives[nearest.number].name
    others = [info for info in result.objectives if info.name != own and _can_be_saved(result, info)]
    if not others:
        return None
    saved = min(others, key=lambda info: scaled_unit(info.unit)[1] != "ct")
    try:
        with until(limit):
            evaluator = Evaluator(_asked(result.space, nearest, _limit_on(result, saved)))
            search = search_front(evaluator, SearchLimits(limit, result.search.seed))
            if not search.is_complete or not search.points:
                return None
            [design] = search.points.values()
            [value] = evaluator.evaluate(design).objectives
            figures = Evaluator(result.space).evaluate(design).objectives
    except (OutOfTime, TooLargeError):
        return None
    if any(map(is_unbounded, (value, *figures))):
        return None
    objectives = dict(zip((info.name for info in result.objectives), figures, strict=True))
    count, unit = scaled_unit(evaluator.objectives[0].counting_unit)
    decisions = decisions_of(result.space, design)
    return Beyond(nearest.name, unit, nearest.bound, Fraction(value, count), saved.name, objectives, decisions)


def _nearest_limit(result: Result) -> _Limit | None:
    """The upper limit on an objective that some design of the front comes nearest to, as a share of the limit."""
    limits: list[tuple[Fraction, _Limit]] = []
    for number, (info, objective) in enumerate(zip(result.objectives, result.space.objectives, strict=True)):
        greatest = max((point.objectives[info.name] for point in result.front), default=0)
        count, unit = scaled_unit(info.unit)
        if info.sense == "maximise" or is_unbounded(greatest) or unit == "ppm":
            continue
        for item in result.space.requirements:
            if item.metric != objective.metric or not item.is_upper or item.implied or item.is_share:
                continue
            bound = build_limit(result.space, item).bound(View(()))  # the same in every design
            together = [one.metric for one in result.space.requirements if item.stated and one.stated == item.stated]
            if bound > 0:
                metrics = tuple(dict.fromkeys([item.metric, *together]))
                limits.append((1 - Fraction(greatest, count) / bound, _Limit(number, metrics, bound)))
    return min(limits, key=lambda one: one[0])[1] if limits else None


def _asked(space: Space, nearest: _Limit, more: Requirement) -> Space:
    """The space without upper limits on what the nearest limit is on, with another limit, and that as its objective."""
    kept = [
        item for item in space.requirements if item.implied or not item.is_upper or item.metric not in nearest.metrics
    ]
    objective = Objective(f"minimise {nearest.worst.name}", "minimise", nearest.worst)
    return replace(space, requirements=(*kept, more), objectives=(objective,))


def _best(result: Result, info: ObjectiveInfo) -> Fraction:
    """The least value of an objective on the front, in its base unit."""
    return Fraction(min(point.objectives[info.name] for point in result.front), scaled_unit(info.unit)[0])


def _can_be_saved(result: Result, info: ObjectiveInfo) -> bool:
    """Whether there may be a tenth less of an objective; shares of cores are limited core by core, and left out."""
    return info.sense == "minimise" and scaled_unit(info.unit)[1] != "ppm" and _best(result, info) > 0


def _limit_on(result: Result, info: ObjectiveInfo) -> Requirement:
    """The limit of another objective by which it is a tenth better than on the front."""
    metric = next(item.metric for item in result.space.objectives if item.metric.name == info.name)
    one = Requirement("", metric, "<=", Quantity(Fraction(1), metric_dimension(result.space, metric), ""))
    most = _best(result, info) * (1 - SAVED) / factor(result.space, one)
    return Requirement(f"{info.name}, a tenth less", metric, "<=", replace(one.limit, value=most))
