"""`dse solve --robust`: the front of the designs whose requirements hold for all stated values of their inputs.

Requirements are first demanded at the nominal figures and at corners of the box of stated values; then each design
that is found is checked over the whole box (`dse.study.boxes`). A design that fails names a corner, which is demanded
too, and the search is made again. A robust design meets every corner, so that none is ever lost; in the end every
design found is proved robust: that front is the robust front.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Unpack

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import HOLDS, Limit, build_limit
from dse.analysis.measures import Term
from dse.analysis.views import View
from dse.api.problem import Problem, Source, load
from dse.api.question import Question
from dse.api.solving import Watcher, result_of
from dse.errors import UsageError
from dse.pareto.front import ANYTHING, Budget, FrontSearch, Progress, Watch, search_front
from dse.results.robust import Failure, RobustResult
from dse.space.types import Design, Space
from dse.study.boxes import Box, Corner, Worst
from dse.study.fronts import check_objectives
from dse.study.functions import Bound, DesignFunction, InputSpace, Variable
from dse.study.uncertainty import read_uncertainties
from dse.timelimit import OutOfTime, TimeLimit, until
from dse.units import PERIOD, RATE, RATE_OF_DATA, SIZE

Demand = tuple[int, Corner]
"""A requirement, by number, at a corner."""


def solve_robust(
    problem: Source,
    *,
    time_limit_s: float | None = None,
    seed: int = 0,
    workers: int = 2,
    progress: Callable[[Progress], None] | None = None,
    **question: Unpack[Question],
) -> RobustResult:
    """The nominal front, the front of the designs that hold for all stated uncertainty, and what the difference costs.

    Parameters
    ----------
    problem
        a loaded problem, the path of a problem file, or its content as text or mapping; it states `uncertainty`.
    time_limit_s, seed, workers, progress
        as for `dse.solve`.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file, or an uncertainty that it states, is wrong.
    UsageError
        when nothing is stated, an input has no bounds, or nothing can be proved of a requirement over the stated
        ranges.
    """
    return robust_asked(
        load(problem).ask(**question), Budget(TimeLimit.after(time_limit_s), seed, workers), Watcher(progress)
    )


def robust_asked(problem: Problem, budget: Budget, watcher: Watcher | None = None) -> RobustResult:
    """The nominal front, the robust one, and what the difference costs.

    Raises
    ------
    ProblemError
        when a stated uncertainty is wrong.
    UsageError
        when nothing is stated, an input has no bounds, or nothing can be proved of a requirement over the stated
        ranges.
    """
    inputs = InputSpace(problem)
    check_objectives(inputs.problem.space)
    uncertain = read_uncertainties(problem, inputs)
    if not uncertain:
        raise UsageError(
            "the problem states no uncertainty: name what may vary under `uncertainty` (docs/problem-file.md)"
        )
    study = _Study(inputs, Box(uncertain), budget, watcher or Watcher())
    nominal = study.search((), budget.limit.at_most(budget.limit.left_s / 2))
    result = result_of(inputs.problem, study.evaluator(()), nominal, budget)
    demands: dict[Demand, None] = {}
    failures: list[Failure] = []
    with suppress(OutOfTime), until(budget.limit):
        for design in nominal.points.values():
            demands |= dict.fromkeys(study.demands(design))
        for point in result.front:
            failures += study.failures(point.id, point.design)
    while True:
        search = study.search(tuple(demands), budget.limit)
        proved, found = study.sorted_out(search)
        if not found or not search.is_complete:
            break
        demands |= dict.fromkeys(found)
    if len(proved) < len(search.points):  # stopped early: what is not proved robust is left out
        search = replace(search, points=proved, unexplored=search.unexplored or study.anywhere)
    robust = result_of(inputs.problem, study.evaluator(tuple(demands)), search, budget)
    words = {item.path: item.words for item in uncertain}
    return RobustResult(robust, result, words, len(demands), tuple(failures))


@dataclass
class _Study:
    inputs: InputSpace
    box: Box
    budget: Budget
    watcher: Watcher

    def __post_init__(self) -> None:
        self.worsts: dict[Design, list[tuple[Bound, Worst]]] = {}
        self.same_rates = not any(
            _moves_rates(self.space, variable) for item in self.box.uncertain for variable in item.variables
        )

    @property
    def space(self) -> Space:
        return self.inputs.problem.space

    def evaluator(self, demands: tuple[Demand, ...]) -> Evaluator:
        """The evaluator of the nominal figures with further limits: requirements at corners."""
        evaluator = Evaluator(self.space)
        evaluator.limits = (*evaluator.limits, *(self._limit(number, corner) for number, corner in demands))
        return evaluator

    def _limit(self, number: int, corner: Corner) -> Limit:
        values = self.box.values(self.inputs.nominal, corner)
        limit = build_limit(self.inputs.at(values), self.space.requirements[number])
        key = ("corner", corner)
        terms = tuple(_elsewhere(term, key, same_rates=self.same_rates) for term in limit.measure.terms)
        return replace(
            limit, measure=replace(limit.measure, terms=terms), bound=lambda view: limit.bound(_own(view, key))
        )

    def search(self, demands: tuple[Demand, ...], limit: TimeLimit) -> FrontSearch:
        """The front of the designs that meet the demands."""
        return search_front(self.evaluator(demands), replace(self.budget, limit=limit), Watch(self.watcher.progress))

    @property
    def anywhere(self) -> tuple[tuple[int, ...], ...]:
        """The region of which nothing is known."""
        return (tuple(ANYTHING for _ in self.space.objectives),)

    def sorted_out(self, search: FrontSearch) -> tuple[dict[tuple[int, ...], Design], list[Demand]]:
        """The points of a search that are proved robust, and what the others break; as far as there is time."""
        proved: dict[tuple[int, ...], Design] = {}
        found: list[Demand] = []
        with suppress(OutOfTime), until(self.budget.limit.for_the_last_steps()):
            for vector, design in search.points.items():
                broken = self.broken(design)
                found += broken
                if not broken:
                    proved[vector] = design
        return proved, found

    def worst(self, design: Design) -> list[tuple[Bound, Worst]]:
        """The worst corner of each comparison, for a design."""
        if design not in self.worsts:
            self.worsts[design] = self.box.worsts(DesignFunction(self.inputs, design))
        return self.worsts[design]

    def demands(self, design: Design) -> list[Demand]:
        """What to demand for a start: each requirement where it is worst for this design."""
        return [(bound.requirement, worst.corner) for bound, worst in self.worst(design)]

    def broken(self, design: Design) -> list[Demand]:
        """The demands that the design does not meet."""
        operators = [item.operator for item in self.space.requirements]
        return [
            (bound.requirement, worst.corner)
            for bound, worst in self.worst(design)
            if not HOLDS[operators[bound.requirement]](worst.value, worst.limit)
        ]

    def failures(self, point: int, design: Design) -> list[Failure]:
        """Why a nominal design is not robust: each requirement that breaks somewhere, at its worst."""
        found: dict[int, Failure] = {}
        requirements = self.space.requirements
        for bound, worst in self.worst(design):
            requirement = requirements[bound.requirement]
            if HOLDS[requirement.operator](worst.value, worst.limit):
                continue
            if bound.requirement in found and _miss(found[bound.requirement]) >= abs(worst.value - worst.limit) / (
                abs(worst.limit) or 1
            ):
                continue
            ends = {
                item.path: self.box.ends[number][worst.corner[number]]
                * (item.variables[0].nominal if _is_single_factor(item) else 1)
                for number, item in enumerate(self.box.uncertain)
            }
            unit = self.evaluator(()).limits[bound.requirement].measure.unit
            text = f"{requirement.text} (by {bound.thread} alone)" if bound.thread else requirement.text
            found[bound.requirement] = Failure(point, text, worst.value, worst.limit, unit, ends)
        return list(found.values())


def _miss(failure: Failure) -> Fraction:
    """How far beyond its limit, as a share of it."""
    return abs(failure.value - failure.limit) / (abs(failure.limit) or 1)


def _is_single_factor(item: object) -> bool:
    return bool(getattr(item, "is_factor", False)) and len(getattr(item, "variables", ())) == 1


def _own(view: View, key: object) -> View:
    """A view of the same design with a memory of its own: its rates are those of other figures."""
    if key not in view.memo:
        view.memo[key] = type(view)(view.design)
    found: View = view.memo[key]
    return found


def _moves_rates(space: Space, variable: Variable) -> bool:
    """Whether an input has a part in how often something runs or is sent (docs/semantics.md, section 2)."""
    if variable.kind is SIZE:
        return any(
            item.data_rate is not None and variable.path.startswith(f"connections.{item.name}.")
            for item in space.connections
        )
    return variable.kind in (PERIOD, RATE, RATE_OF_DATA)


def _elsewhere(term: Term, key: object, *, same_rates: bool) -> Term:
    """A term of a space with other figures, ready to be evaluated beside those of the nominal one.

    Where the rates are not the nominal ones, it is tabulated as a whole.
    """
    coefficient = term.coefficient

    def value(view: View) -> Fraction:
        return term.value(_own(view, key))

    def scaled(view: View) -> Fraction:
        assert coefficient is not None
        return coefficient(_own(view, key))

    if coefficient is None or not same_rates:
        return replace(term, value=value, coefficient=None, rate=None)
    return replace(term, value=value, coefficient=scaled)
