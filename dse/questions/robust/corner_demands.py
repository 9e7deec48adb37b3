"""The robust question: requirements that hold for all stated values of their inputs, as demands at corners.

A robust design meets every requirement at every corner of the box of stated values. So the designs that meet some
demands (a requirement at a corner each) hold all robust ones: what is refuted for them is refuted for the robust ones.
A design that meets the demands and is not robust (`dse.questions.robust.worst_case`) names corners to demand as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import HOLDS, Limit, build_limit
from dse.analysis.messages.stages import counted_buses
from dse.analysis.terms import Term, extreme_term
from dse.analysis.views import View
from dse.answers.robust import Failure
from dse.questions.problem import Problem
from dse.questions.robust.worst_case import Box, Corner, Worst
from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison
from dse.questions.sensitivity.inputs import InputSpace, Variable
from dse.questions.sensitivity.intervals import NotProvedError
from dse.questions.sensitivity.response_variables import ScheduledFunction, motion_of
from dse.questions.sensitivity.uncertainty import read_uncertainties
from dse.questions.sweep.fronts import check_objectives
from dse.space.model.space import Design, Space
from dse.space.question.open_cores import is_scheduled
from dse.support.errors import UsageError
from dse.support.units import PERIOD, RATE, RATE_OF_DATA, SIZE

Demand = tuple[int, Corner]
"""A requirement, by number, at a corner."""


class RobustQuestion:
    """A problem as it is asked, its uncertainties, and what is demanded at corners so far.

    Requirements are demanded at single corners of the box of uncertain inputs, added as designs are found that break
    them; a design that passes is then proved for the whole box (docs/sweeps-and-sensitivity.md).
    """

    def __init__(self, problem: Problem, ask: Callable[[Problem], Problem] | None = None) -> None:
        """The question of `problem`; `ask` makes it from the problem file, where its changes do not say all of it.

        Raises
        ------
        ProblemError
            when a stated uncertainty is wrong.
        UsageError
            when nothing is stated, there is nothing to minimise, or an input has no bounds.
        """
        self.inputs = InputSpace(problem, ask)
        check_objectives(self.space)
        uncertain = read_uncertainties(problem, self.inputs)
        if not uncertain:
            raise UsageError(
                "the problem states no uncertainty: name what may vary under `uncertainty` (docs/problem-file.md)"
            )
        self.box = Box(uncertain)
        self.demands: dict[Demand, Limit] = {}
        self._nominal = Evaluator(self.space)
        on_cores = any(item.processor is not None for item in self.space.components)
        scheduled = any(is_scheduled(self.space, item.metric) for item in self.space.requirements)
        self._is_scheduled = bool(counted_buses(self.space)) or (on_cores and scheduled)
        self._worsts: dict[Design, list[tuple[OutputComparison, Worst]]] = {}
        self._same_rates = not any(
            _moves_rates(self.space, variable) for item in uncertain for variable in item.variables
        )
        self._same_offsets = not any(
            "offset" in variable.path.rpartition(".")[2] for item in uncertain for variable in item.variables
        )

    @property
    def space(self) -> Space:
        """The space at the nominal figures.

        The design space with every uncertain input at the value that the file states. Decisions and options do not
        depend on the inputs.
        """
        return self.inputs.problem.space

    @property
    def words(self) -> dict[str, str]:
        """The uncertain inputs in words, by path.

        Paths of inputs, such as ``threads.ekf.compute_execution_time``, to their distribution or range in words.
        """
        return {item.path: item.robust_words for item in self.box.uncertain}

    def nominal(self) -> Evaluator:
        """The evaluator of the nominal figures."""
        return self._nominal

    def evaluator(self) -> Evaluator:
        """The evaluator of the nominal figures with what is demanded at corners so far.

        A new `Evaluator` on each call: its limits grow with the demands. A design that it rejects is not robust; one
        that it accepts may still break elsewhere.
        """
        return Evaluator(self.space, further=self.demands.values())

    def is_judged(self, design: Design) -> bool:
        """Whether the worst corners of a design were computed, so that it is known if the design is robust.

        True once the worst corners of the design were computed; the answer is kept for the life of the question.
        """
        return design in self._worsts

    def is_robust(self, design: Design) -> bool:
        """Whether every requirement holds for all stated values.

        Raises
        ------
        UsageError
            when nothing can be proved of a requirement over the stated ranges.
        """
        return not self._broken(design)

    def expect(self, design: Design) -> None:
        """Demand each requirement where it is worst for a design.

        Each requirement is added as a limit at the corner where its margin is least. Designs like this one are then
        excluded by the solver instead of one by one.
        """
        for bound, worst in self.worst(design):
            self._demand(bound.requirement, worst.corner)

    def learn(self, design: Design) -> bool:
        """Demand what a design breaks where it breaks it; False when it is robust.

        The demands are added to those of `evaluator`. True where at least one requirement is violated at some corner.
        """
        broken = self._broken(design)
        for number, corner in broken:
            self._demand(number, corner)
        return bool(broken)

    def worst(self, design: Design) -> list[tuple[OutputComparison, Worst]]:
        """The worst corner of each comparison, for a design.

        Pairs of a comparison and its `Worst`: the corner with the least margin, and both sides there, exact. Computed
        once for each design.

        Raises `NotProvedError` where no corner is proved to be the worst.
        """
        if design not in self._worsts:
            self._worsts[design] = self._worsts_of(design)
        return self._worsts[design]

    def _worsts_of(self, design: Design) -> list[tuple[OutputComparison, Worst]]:
        motion = motion_of(self.inputs, design, self.box) if self._is_scheduled else None
        if motion is None:
            plain = DesignFunction(self.inputs, design, cores=False)
            try:
                return self.box.worsts(plain, may_jump=self._is_scheduled)
            except NotProvedError:
                if not (broken := self.box.broken_corner(plain)):
                    raise
                return broken
        function = ScheduledFunction(self.inputs, design, motion, self.box)
        return function.broken_without_bound(self.box) or self.box.worsts(function)

    def _broken(self, design: Design) -> list[Demand]:
        operators = [item.operator for item in self.space.requirements]
        return [
            (bound.requirement, worst.corner)
            for bound, worst in self.worst(design)
            if not HOLDS[operators[bound.requirement]](worst.value, worst.limit)
        ]

    def _demand(self, number: int, corner: Corner) -> None:
        if (number, corner) not in self.demands:
            self.demands[number, corner] = self._limit(number, corner)

    def _limit(self, number: int, corner: Corner) -> Limit:
        values = self.box.values(self.inputs.nominal, corner)
        limit = build_limit(self.inputs.at(values), self.space.requirements[number])
        key = ("corner", corner)
        terms = tuple(self._elsewhere(term, key) for term in limit.measure.terms)
        return replace(
            limit,
            measure=replace(limit.measure, terms=terms),
            bound=lambda view: limit.bound(_own(view, key)),
            is_elsewhere=True,
        )

    def _elsewhere(self, term: Term, key: object) -> Term:
        """A term of a space with other figures, ready to be evaluated beside those of the nominal one.

        Where the rates are not the nominal ones, it is tabulated as a whole; so it is where offsets are not, which are
        variables of the search. Rows of the nominal space do not bound it: its threads may wait less.
        """
        if term.extreme is not None:
            return extreme_term(term.label, term.extreme.changed(lambda inner: self._elsewhere(inner, key)))
        coefficient, inner, phased = term.coefficient, term.ends, term.phased

        def value(view: View) -> Fraction:
            return term.value(_own(view, key))

        def scaled(view: View) -> Fraction:
            assert coefficient is not None
            return coefficient(_own(view, key))

        def ends(view: View) -> tuple[Fraction, Fraction]:
            assert inner is not None
            return inner(_own(view, key))

        if phased is not None:
            phased = phased.asked_of(lambda view: _own(view, key)) if self._same_offsets else None
        is_rate = coefficient is not None and self._same_rates
        return replace(
            term,
            value=value,
            coefficient=scaled if is_rate else None,
            rate=term.rate if is_rate else None,
            ends=ends if inner is not None else None,
            waits=None,
            only_waits=False,
            phased=phased,
            reads=None,
            message=None,
            sampled=term.sampled and replace(term.sampled, asked=lambda view: _own(view, key)),
        )

    def failures(self, point: int, design: Design) -> list[Failure]:
        """The failures of a nominal design: each requirement that is violated somewhere, at its worst.

        At most one `Failure` for each requirement, at the corner where it is missed most, with both sides in the unit
        of the metric and the values of the uncertain inputs there. `point` is the id of the design on the nominal
        front.
        """
        failures: dict[int, Failure] = {}
        requirements = self.space.requirements
        for bound, worst in self.worst(design):
            requirement = requirements[bound.requirement]
            if HOLDS[requirement.operator](worst.value, worst.limit):
                continue
            if bound.requirement in failures and _miss(failures[bound.requirement]) >= _miss(worst):
                continue
            ends = {
                item.path: self.box.ends[number][worst.corner[number]]
                * (item.variables[0].nominal if item.is_factor and len(item.variables) == 1 else 1)
                for number, item in enumerate(self.box.uncertain)
            }
            unit = self._nominal.limits[bound.requirement].measure.unit
            text = f"{requirement.shown} (by {bound.thread} alone)" if bound.thread else requirement.shown
            failures[bound.requirement] = Failure(point, text, worst.value, worst.limit, unit, ends)
        return list(failures.values())


def _miss(failure: Failure | Worst) -> Fraction:
    """How far beyond its limit, as a share of it."""
    return abs(failure.value - failure.limit) / (abs(failure.limit) or 1)


def _own(view: View, key: object) -> View:
    """The view with a memory of its own: rates are those of other figures, the threads that count the same."""
    if key not in view.memo:
        view.memo[key] = view.apart()
    own: View = view.memo[key]
    return own


def _moves_rates(space: Space, variable: Variable) -> bool:
    """Whether an input has a part in how often something runs or is sent (docs/semantics.md, section 2)."""
    if variable.kind is SIZE:
        return any(
            item.data_rate is not None and variable.path.startswith(f"connections.{item.name}.")
            for item in space.connections
        )
    return variable.kind in (PERIOD, RATE, RATE_OF_DATA)
