"""Fronts as plain data: what a study stores of a solve, in exact base units, without times or places of files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, with_contention
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import Measure, build_measure
from dse.analysis.views import View
from dse.answers.contention_verdicts import Contended, contended
from dse.answers.forms.codec import written
from dse.answers.result import decisions_of
from dse.answers.studies.run_data import FoundFront
from dse.answers.tables.display import exact
from dse.search.front import FrontSearch, SearchLimits, search_front
from dse.space.model.criteria import Metric
from dse.space.model.space import Design, Space
from dse.support.errors import UsageError
from dse.support.timelimit import in_force

Vector = tuple[int, ...]


@dataclass(frozen=True)
class MetricReader:
    """The reader of a design's metrics: the evaluator of a space, every metric in its base unit.

    `jury` says what it keeps with contention.
    """

    evaluator: Evaluator
    jury: Jury

    @property
    def units(self) -> dict[str, str]:
        """The base unit of each metric and objective.

        Names of metrics to units such as ``ns``, ``B/s`` or ``ppm``; `metrics` gives values in them.
        """
        measures = (*self.evaluator.metrics, *self.evaluator.objectives)
        return {measure.metric.name: measure.unit for measure in measures}

    def metrics(self, design: Design) -> dict[str, Fraction]:
        """Every metric of a design, in its base unit.

        Names to exact fractions, objectives included.
        """
        view = View(design)
        measures = (*self.evaluator.metrics, *self.evaluator.objectives)
        return {measure.metric.name: measure.value(view) for measure in measures}

    def alternative(self, design: Design) -> dict[str, Any]:
        """A design as data: its decisions and metrics, and what it keeps with contention where that is left out.

        Raises
        ------
        OutOfTime
            when the limit of time in force is up.
        """
        decisions = decisions_of(self.evaluator.space, design)
        return {"decisions": decisions, "metrics": self.metrics(design), **self.jury.says(design)}


def search_space(evaluator: Evaluator, seed: int) -> FrontSearch:
    """The front of an evaluator's space on one solver, within the limit in force: a study runs several side by side.

    A `FrontSearch` by one worker, with the time limit in force (`in_force`): studies run one search for each core.
    """
    return search_front(evaluator, SearchLimits(in_force(), seed, 1))


def check_objectives(space: Space) -> None:
    """A study needs something to compare by.

    Raises
    ------
    UsageError
        when the problem states no objectives.
    """
    if not space.objectives:
        raise UsageError(
            'nothing to minimise: state `objectives` in the problem file, or give --minimise "price" or the like'
        )


def senses(space: Space) -> list[str]:
    """The sense of each objective.

    ``minimise`` or ``maximise`` for each objective, in the order of the question.
    """
    return [objective.sense for objective in space.objectives]


def front_outcome(space: Space, seed: int) -> dict[str, Any]:
    """The proved front of a space as data, in the order of objectives.

    ``status`` is ``complete``, ``infeasible``, or ``incomplete`` when the search was stopped.
    """
    check_objectives(space)
    evaluator = Evaluator(space)
    search = search_space(evaluator, seed)
    figures = MetricReader(evaluator, Jury(space))
    status = "incomplete" if not search.is_complete else "complete" if search.points else "infeasible"
    outcome = {
        "kind": "front",
        "status": status,
        "objectives": objective_infos(evaluator),
        "units": figures.units,
        "front": [figures.alternative(design) for _, design in sorted(search.points.items())],
    }
    return written(FoundFront, outcome)


def objective_infos(evaluator: Evaluator) -> list[dict[str, str]]:
    """Name, sense and base unit of each objective.

    Mappings with the keys ``name``, ``sense`` and ``unit``, in the order of the question, as results of studies store
    them.
    """
    return [
        {"name": measure.metric.name, "sense": objective.sense, "unit": measure.unit}
        for measure, objective in zip(evaluator.objectives, evaluator.space.objectives, strict=True)
    ]


def minimised(vector: Sequence[Any], directions: Sequence[str]) -> tuple[Any, ...]:
    """A vector with every entry to be minimised.

    Entries of objectives to be maximised change their sign; `directions` has the sense of each.
    """
    return tuple(-value if sense == "maximise" else value for value, sense in zip(vector, directions, strict=True))


def non_dominated(points: Mapping[Any, tuple[Any, ...]]) -> list[Any]:
    """The keys of the vectors (to be minimised) that no other dominates.

    Of equal vectors the first, in the given order.

    >>> non_dominated({"a": (1, 2), "b": (2, 1), "c": (2, 2), "d": (1, 2)})
    ['a', 'b']
    """
    kept: list[Any] = []
    for key, vector in points.items():
        if any(_covers(points[other], vector) for other in kept):
            continue
        kept = [other for other in kept if not _covers(vector, points[other])]
        kept.append(key)
    return kept


def _covers(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    return all(a <= b for a, b in zip(one, other, strict=True))


# What the designs of a study's fronts keep when response times count, where the fronts leave that out; as data.


class Jury:
    """Says of each design of a front what it keeps with contention; nothing where the front counts all of that.

    A sweep of a question without response times still reports which designs keep every requirement when threads wait
    for each other.
    """

    def __init__(self, space: Space, limited: Metric | None = None) -> None:
        """Judge designs of `space`; `limited` is a metric whose limit varies: it is told as it is with contention."""
        counted = with_contention(space)
        self._referee = None if counted is None else ContentionReferee(counted)
        self._limited = limited
        self._measures: dict[int, tuple[Space, Measure]] = {}

    def says(self, design: Design) -> dict[str, Any]:
        """``contention`` of a design as JSON has it.

        Raises
        ------
        OutOfTime
            when the limit of time in force is up.
        """
        if self._referee is None:
            return {}
        verdict = self._referee.judge(design)
        said = written(Contended, contended(verdict))
        if self._limited is not None:
            said["limited"] = exact(self._measure(verdict.space, self._limited).value(View(verdict.design)))
        return {"contention": said}

    def _measure(self, space: Space, metric: Metric) -> Measure:
        if id(space) not in self._measures:
            self._measures[id(space)] = space, build_measure(space, metric)  # with the space, whose id stays its own
        return self._measures[id(space)][1]
