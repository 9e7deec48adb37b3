"""The design space as a CP-SAT model; reads like a contents page.

Every coefficient comes from tabulating the analysis' own functions, so that a design in the model has the figures that
`dse.analysis` gives it. Where a common denominator is too fine to count in (`Measure.rounded`), constraints are relaxed
to the safe side, which loses no design, and the referee refuses what exact comparison refuses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import gcd
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit
from dse.analysis.measures import Measure
from dse.analysis.memo import consulted
from dse.analysis.views import View
from dse.encode.decisions import add_activity, add_decisions, add_rule, add_validity
from dse.encode.linear import Board, OpenTerm, floor_int, placed
from dse.encode.messages.limits import MessageLimits, message_limits_of
from dse.encode.rates import RateVariables, add_acyclic_activation
from dse.encode.requirements import add_limit
from dse.encode.scheduling.contention import Contention, contention_of
from dse.encode.scheduling.core_limits import CoreLimits, core_limits_of
from dse.encode.scheduling.waiting_forms import is_better_shorter, is_upward, may_fall, may_wait
from dse.encode.search_order import strategy_in_order
from dse.encode.sums import measure_branches
from dse.encode.tuning import ModelTuning, RegionUnions
from dse.space.model.criteria import Objective
from dse.space.model.space import INACTIVE, Design, Space
from dse.space.question.unchecked import refuse_unchecked
from dse.support.errors import TooLargeError


@dataclass(frozen=True)
class EncodedObjective:
    """An objective in the model: value = offset + step * variable, the variable from 0 to `size`.

    Maximised objectives are negated. Of each of the `branches`: where all its literals are true, the variable is its
    constant and the sum of its coefficients times the variables that they belong to.
    """

    variable: cp_model.IntVar
    offset: int
    step: int
    size: int
    branches: tuple[tuple[frozenset[int], int, Mapping[int, int]], ...] = ()


@dataclass(frozen=True)
class RegionSwitch:
    """While `literal` is true, each objective is within the domain of its linear constraint, named by its index.

    Lets one model ask for a union of regions of the objective space.
    """

    literal: cp_model.IntVar
    constraints: tuple[int, ...]


@dataclass(frozen=True)
class EncodedSpace:
    """The model, the literal of each option of each decision, and the objectives (all to be minimised)."""

    model: cp_model.CpModel
    options: Sequence[Sequence[cp_model.IntVar]]
    inactive: Sequence[cp_model.IntVar | None]
    objectives: tuple[EncodedObjective, ...]
    open_terms: Sequence[OpenTerm] = ()
    contention: Contention | None = None
    core_limits: CoreLimits | None = None
    messages: MessageLimits | None = None
    shared: Sequence[int] = ()
    """Decisions on which many summands hang, most first: sums have a form for each of their options."""
    regions: Sequence[RegionSwitch] = ()  # of which one is on: for questions about several regions
    weigh: Callable[[Design], tuple[int, ...] | None] = lambda _: None
    """The objectives of a design as the analysis has them, in steps; None where it refuses the design."""
    attained: Sequence[int] = ()  # literals that say which of several sums is the greatest (or the least)
    space: Space | None = None

    @property
    def everywhere(self) -> tuple[int, ...]:
        """The region of all objective vectors: a bound above each."""
        return tuple(objective.size + 1 for objective in self.objectives)

    def copy(self) -> EncodedSpace:
        """A copy of the model, for another thread to solve.

        Variables keep their indices; what the original learns later is not shared.
        """
        model = self.model.clone()

        def again(variable: cp_model.IntVar) -> cp_model.IntVar:
            return model.get_int_var_from_proto_index(variable.index)

        return EncodedSpace(
            model,
            [[again(literal) for literal in literals] for literals in self.options],
            [again(literal) if literal is not None else None for literal in self.inactive],
            tuple(replace(objective, variable=again(objective.variable)) for objective in self.objectives),
            [replace(term, variable=again(term.variable)) for term in self.open_terms],
            self.contention.copy(model) if self.contention is not None else None,
            self.core_limits.copy(model) if self.core_limits is not None else None,
            self.messages.copy(model) if self.messages is not None else None,
            self.shared,
            [replace(region, literal=again(region.literal)) for region in self.regions],
            self.weigh,
            self.attained,
            self.space,
        )

    def design(self, solution: Sequence[int]) -> Design:
        """The design of a solution, which has the value of each variable of the model.

        A tuple of option numbers, with inactive decisions marked.
        """
        return tuple(_chosen(indices, solution) for indices in self._indices)

    @cached_property
    def _indices(self) -> list[list[int]]:
        """The variable of each option of each decision."""
        return [[literal.index for literal in literals] for literals in self.options]

    @cached_property
    def _idle_indices(self) -> list[int | None]:
        """The variable of each decision's being inactive, where it may be."""
        return [None if literal is None else literal.index for literal in self.inactive]

    def differs_from(self, design: Design) -> list[Any]:
        """Literals of which at least one is true in any other design; cores count where figures depend on them.

        Used to exclude a design; decisions with a single option are left out.
        """
        moved = self.contention.moved if self.contention is not None else frozenset()
        return [
            self.options[index][option].negated()
            for index, option in enumerate(design)
            if option >= 0 and len(self.options[index]) > 1 and index not in moved
        ]

    def in_order(self) -> list[Any]:
        """The strategies of a search in the order of the file, one after the other.

        CP-SAT decision strategies for fixed search.
        """
        return [self._order, *(self.core_limits.packing() if self.core_limits is not None else ())]

    @cached_property
    def _order(self) -> Any:
        moved = self.contention.moved if self.contention is not None else frozenset()
        return strategy_in_order(self.model, self.options, self.inactive, moved, self.attained)

    def suggest(self, design: Design | None) -> None:
        """Give the solver a design to start from, or none.

        Sets the solution hint of the model for every decision; other variables have none.
        """
        self.model.clear_hints()
        if design is None:
            return
        values: dict[int, int] = {}
        for indices, idle, chosen in zip(self._indices, self._idle_indices, design, strict=True):
            if len(indices) > 1:
                for option, index in enumerate(indices):
                    values.setdefault(index, int(option == chosen))
            if idle is not None:
                values.setdefault(idle, int(chosen < 0))
        suggestion = self.model.proto.solution_hint
        suggestion.vars.extend(values.keys())
        suggestion.values.extend(values.values())

    @property
    def learns(self) -> bool:
        """Whether the model becomes stricter with what its solutions show."""
        learning = (self.contention, self.core_limits, self.messages)
        return bool(self.open_terms) or any(item is not None for item in learning)

    @property
    def has_messages(self) -> bool:
        """Whether the model learns of messages that wait: of their limits, or of figures that they are a part of."""
        return self.messages is not None or any(term.message is not None for term in self.open_terms)

    @property
    def is_loose(self) -> bool:
        """Whether the objectives of a solution may be larger than those of its design, unless they are minimised."""
        return bool(self.open_terms) and self.contention is not None and self.contention.is_upward

    def settled(
        self, design: Design, value: Callable[[cp_model.IntVar], int], *, is_best: bool = True
    ) -> Design | None:
        """The design of a solution as the analysis accepts it; None where the model has learnt from it instead.

        From one that is not the best of the model it need not learn (`Contention.settled`).
        """
        if self.messages is not None:
            why_late = None if self.contention is None else self.contention.why_late
            if not self.messages.settled(design, lambda one: bool(value(one)), why_late):
                return None
        if self.open_terms and self.contention is not None and self.contention.is_upward:
            if self.contention.raised(self.open_terms, design, value):
                return None
        elif self.open_terms and self.sharpen(design, value):
            return None
        settled_design: Design | None = design
        if self.contention is not None:
            with_rows = self.core_limits.known if self.core_limits is not None else ()
            settled_design = self.contention.settled(
                design, lambda literal: bool(value(literal)), with_rows, is_best=is_best
            )
        if settled_design is None or self.core_limits is None:
            return settled_design
        return (
            settled_design
            if self.core_limits.settled(settled_design, lambda one: bool(value(one)), is_best=is_best)
            else None
        )

    def sharpen(self, design: Design, value: Callable[[cp_model.IntVar], int]) -> bool:
        """Make open terms exact where a solution has other figures; whether there were any.

        For the options that the exact figure consults: variable = figure, whatever the other decisions are.
        """
        is_sharper = False
        for term in self.open_terms:
            exact, asked = consulted(View(design), term.value)
            if value(term.variable) != exact:
                is_sharper = True
                self.model.add(term.variable == exact).only_enforce_if(
                    [self._chosen(decision, option) for decision, option in asked.items()]
                )
        return is_sharper

    def _chosen(self, decision: int, option: int) -> cp_model.IntVar:
        inactive = self.inactive[decision]
        if option == INACTIVE:
            assert inactive is not None
            return inactive
        return self.options[decision][option]


def _chosen(indices: Sequence[int], solution: Sequence[int]) -> int:
    """The option whose variable is true; a loop, as every solution has many decisions."""
    for option, index in enumerate(indices):
        if solution[index]:
            return option
    return INACTIVE


def encode(evaluator: Evaluator, tuning: ModelTuning | None = None) -> EncodedSpace:
    """The whole model of a space.

    Raises
    ------
    TooLargeError
        when a sum would leave the range of exact arithmetic, naming what it is a sum of.
    UncheckedError
        when a requirement of the problem is on a flow that its import could not follow.
    """
    refuse_unchecked(evaluator.space)
    try:
        return _encode(evaluator, tuning)
    except OverflowError as error:
        raise _too_large(error) from error


class Demands:
    """A space with demands that can be switched on and off: each holds while its guard is true.

    Built once for many questions about the same space; further limits and objectives may be added, and the decisions
    `fixable` restricted.
    """

    def __init__(self, evaluator: Evaluator, fixable: Iterable[int] = ()) -> None:
        refuse_unchecked(evaluator.space)
        self.evaluator = evaluator
        self.board = _structure(evaluator)
        self.board.fixable |= frozenset(fixable)
        self.board.is_guarded = True
        self.rates = RateVariables(self.board)
        self.rules = [self._guarded(partial(add_rule, self.board, rule)) for rule in evaluator.space.rules]
        self.is_upward = is_upward(evaluator.space)
        self.limits = [self.add_limit(limit) for limit in evaluator.limits]

    def add_limit(self, limit: Limit) -> cp_model.IntVar:
        """Encode a limit; returns its guard.

        The limit holds while the guard is true, so that one model answers questions about many sets of limits.
        """
        metric, sign = limit.requirement.metric, int(limit.requirement.is_upper)
        if may_wait(limit.measure.terms) and not is_better_shorter(self.evaluator.space, metric, sign):
            self.is_upward = False
        return self._guarded(partial(add_limit, self.board, self.rates, limit))

    def _guarded(self, add: Callable[[], None]) -> cp_model.IntVar:
        """The rows that `add` makes, under a guard of their own."""
        self.board.guard = guard = self.board.model.new_bool_var("")
        try:
            add()
        except OverflowError as error:
            raise _too_large(error) from error
        finally:
            self.board.guard = None
        return guard

    def with_objective(self, measure: Measure | None) -> EncodedSpace:
        """The space as it stands, with a measure to be minimised.

        Raises `TooLargeError` where the measure leaves exact arithmetic.
        """
        objectives: tuple[EncodedObjective, ...] = ()
        if measure is not None:
            wanted = Objective(measure.metric.name, "minimise", measure.metric)
            try:
                objectives = (_objective_of(self.board, self.rates, measure, wanted),)
            except OverflowError as error:
                raise _too_large(error) from error
        board = self.board
        contention = contention_of(board, self.rates)
        if contention is not None:
            contention.add_waiting(board)
            contention.is_upward = self.is_upward and (measure is None or not may_fall(measure.terms))
        return _encoded(board, objectives, contention)


def _encoded(board: Board, objectives: tuple[EncodedObjective, ...], contention: Contention | None) -> EncodedSpace:
    """The space that a board holds."""
    return EncodedSpace(
        board.model,
        board.options,
        board.inactive,
        objectives,
        board.open_terms,
        contention,
        core_limits_of(board),
        message_limits_of(board),
        board.shared(),
        attained=board.attained,
    )


def _too_large(error: OverflowError) -> TooLargeError:
    return TooLargeError(f"too large to search exactly: {error}")


def _structure(evaluator: Evaluator, tuning: ModelTuning | None = None) -> Board:
    """The designs that there are, whatever is demanded of them."""
    board = Board(evaluator.space, tuning)
    add_decisions(board)
    add_activity(board)
    add_validity(board, evaluator.rulebook)
    add_acyclic_activation(board)
    return board


def _encode(evaluator: Evaluator, tuning: ModelTuning | None) -> EncodedSpace:
    """The contents page."""
    space = evaluator.space
    board = _structure(evaluator, tuning)
    rates = RateVariables(board)
    for rule in space.rules:
        add_rule(board, rule)
    for limit in evaluator.limits:
        add_limit(board, rates, limit)
    objectives = tuple(_add_objective(board, rates, evaluator, number) for number in range(len(space.objectives)))
    contention = contention_of(board, rates)
    if contention is not None:
        contention.add_known_rows()
        contention.is_upward = is_upward(space)
        contention.add_waiting(board)
        if board.open_terms:
            contention.number_cores()
    regions = _add_region_switches(board.model, objectives, board.tuning.region_unions)
    problem = board.model.validate()
    assert not problem, problem
    weigh = partial(_weigh, evaluator, objectives)
    return replace(_encoded(board, objectives, contention), regions=regions, weigh=weigh, space=space)


def _weigh(evaluator: Evaluator, objectives: Sequence[EncodedObjective], design: Design) -> tuple[int, ...] | None:
    """The objectives of a design in steps above their offsets; None where the analysis refuses it."""
    evaluation = evaluator.evaluate(design)
    if not evaluation.is_feasible:
        return None
    signs = [1 if item.sense == "minimise" else -1 for item in evaluator.space.objectives]
    return tuple(
        (sign * value - item.offset) // item.step
        for sign, value, item in zip(signs, evaluation.objectives, objectives, strict=True)
    )


def _add_region_switches(
    model: cp_model.CpModel, objectives: Sequence[EncodedObjective], tuning: RegionUnions
) -> list[RegionSwitch]:
    """Switch z: variable[i] <= bound[z, i] for each objective i, the bounds as yet those of the variables; one is on.

    None where questions are about one region each.
    """
    if not tuning.is_on or len(objectives) < tuning.fewest_objectives:
        return []
    switches = []
    for _ in range(tuning.most):
        literal = model.new_bool_var("")
        limits = [model.add(item.variable <= item.size).only_enforce_if(literal) for item in objectives]
        switches.append(RegionSwitch(literal, tuple(limit.index for limit in limits)))
    model.add_bool_or([switch.literal for switch in switches])
    return switches


def _add_objective(board: Board, rates: RateVariables, evaluator: Evaluator, number: int) -> EncodedObjective:
    """The objective as offset + step * variable, where step divides every difference (lossless)."""
    measure, objective = evaluator.objectives[number], board.space.objectives[number]
    return _objective_of(board, rates, measure, objective, _allowed_most(board, evaluator.limits, measure))


def _allowed_most(board: Board, limits: Sequence[Limit], measure: Measure) -> int | None:
    """The greatest sum of a measure, in units of 1 / scale, that the limits on the same metric allow; None: any."""
    bounds = [
        floor_int(max(case.value for case in board.cases(limit.bound)) * measure.scale)
        for limit in limits
        if limit.requirement.operator in ("<=", "<", "==")
        and (limit.measure.metric, limit.measure.scale) == (measure.metric, measure.scale)
        and not limit.is_elsewhere
    ]
    return min(bounds, default=None)


def _objective_of(
    board: Board, rates: RateVariables, measure: Measure, objective: Objective, most: int | None = None
) -> EncodedObjective:
    """The objective; designs of which the measure is above `most`, in units of 1 / scale, are refused elsewhere."""
    sign = 1 if objective.sense == "minimise" else -1
    try:
        branches = measure_branches(board, rates, measure)
        if most is not None:
            branches = [replace(branch, form=board.within(branch.form, most)) for branch in branches]
        expressions = [board.expression(branch.form) for branch in branches]
    except OverflowError as error:
        raise placed(objective, error) from error
    forms = [branch.form for branch in branches]
    apart = (form.constant - forms[0].constant for form in forms)
    step = gcd(*apart, *(c for form in forms for c in form.coefficients.values())) or 1
    low, high = min(form.low for form in forms), max(form.high for form in forms)
    ends = sorted((sign * low, sign * high))
    offset = ends[0] + (sign * forms[0].constant - ends[0]) % step
    size = max(0, (ends[1] - offset) // step)
    variable = board.model.new_int_var(0, size, measure.metric.name)
    for branch, expression in zip(branches, expressions, strict=True):
        board.model.add(sign * expression == offset + step * variable).only_enforce_if(branch.chosen)
    return EncodedObjective(
        variable, offset, step, size, tuple(branch.counted(sign, offset, step) for branch in branches)
    )
