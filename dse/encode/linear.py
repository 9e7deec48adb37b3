"""Literals and linear forms over a CP-SAT model: what the constraint families are written in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

from ortools.sat.python import cp_model

from dse.analysis.terms import MessageWait, Waiter
from dse.analysis.views import Case, View, tabulate
from dse.encode import tuning as tuned
from dse.encode.tuning import ModelTuning
from dse.space.model.criteria import Objective, Requirement
from dse.space.model.space import Space
from dse.space.model.trees import Choice, Tree

T = TypeVar("T")

EXACT_LIMIT = 2**53
"""Sums beyond this would be rounded by the solver's floating-point parts."""
HARD_CASE_LIMIT = 200_000
CLAUSES = 2_000
"""A predicate with more cases than this is not forbidden case by case."""

Given: TypeAlias = Mapping[int, int]
"""Decisions that are taken, with their options."""
NOTHING: Given = MappingProxyType({})


def set_domain(bounded: Any, low: int, high: int) -> None:
    """The domain of a variable or of a linear constraint."""
    bounded.domain.clear()
    bounded.domain.extend([low, high])


@dataclass
class Form:
    """constant + sum of coefficient * variable, with bounds known term by term: ``low <= form <= high``.

    Integers; bounds are those of the terms added up, which may be wider than the true range.
    """

    constant: int = 0
    coefficients: dict[int, int] = field(default_factory=dict)
    low: int = 0
    high: int = 0

    def add(self, other: Form, times: int = 1) -> None:
        """Add another form in place.

        `times` may be negative; then the bounds change places.
        """
        self.constant += times * other.constant
        for variable, coefficient in other.coefficients.items():
            self.coefficients[variable] = self.coefficients.get(variable, 0) + times * coefficient
        ends = (times * other.low, times * other.high)
        self.low += min(ends)
        self.high += max(ends)


@dataclass(frozen=True)
class OpenTerm:
    """A figure that depends on too many combinations of options: a variable that may be any value in safe bounds.

    What a solution says of it is compared with `value`, and made exact for the options that this consults
    (`EncodedSpace.sharpen`); every combination is met at most once, so that searches end.
    """

    variable: cp_model.IntVar
    value: Callable[[View], int]
    least: Form | None = None
    """What the variable is at least where no thread waits for another."""
    waits: tuple[Waiter, Fraction] | None = None
    """A thread or a chain, and what a nanosecond of its waiting adds at least."""
    may_fall: bool = False
    """Whether it may be less where some response time is longer."""
    message: MessageWait | None = None
    """The waiting of a message for its bus that it counts."""
    waiting: Callable[[View, Fraction], int] | None = None
    """The value of the term for a wait of the message in ns; None where limits on messages can be relaxed."""
    before: Mapping[int, int] = field(default_factory=dict)
    """The messages that may go before that one, by connection: a literal each, which must be true where it does."""


class SolverModel(cp_model.CpModel):
    """A model without the names that its methods had before PEP 8: to make those takes longer than a small model."""

    def _add_pre_pep8_methods(self) -> None:
        pass

    def clone(self) -> SolverModel:
        """A model of its own with the same variables and constraints.

        Variables keep their indices.
        """
        made = SolverModel()
        made.proto.copy_from(self.proto)
        made.rebuild_constant_map()
        return made


class Board:
    """A CP-SAT model under construction, the literal of every option, and every derived literal made once.

    Clauses and sums go through it, so that equal conditions share one literal.
    """

    def __init__(self, space: Space, tuning: ModelTuning | None = None) -> None:
        self.space = space
        self.tuning = tuning or tuned.MODEL
        self.model = SolverModel()
        self.options: list[list[cp_model.IntVar]] = []
        self.inactive: list[cp_model.IntVar | None] = []
        self._all_of: dict[frozenset[int], Any] = {}
        self._choices: set[frozenset[int]] = set()
        self._implied: dict[int, frozenset[tuple[int, int]]] = {}
        self.open_terms: list[OpenTerm] = []
        self.deadlines: list[Any] = []  # upper limits on response times, see `dse.encode.scheduling.contention`
        self.contention: Any = None
        self.core_limits: list[Any] = []  # upper limits on cores, see `dse.encode.scheduling.core_limits`
        self.cores: Any = None
        self.message_limits: list[Any] = []  # upper limits on messages, see `dse.encode.messages.limits`
        self.messages: Any = None
        self.before: dict[tuple[int, int], Any] = {}  # by pairs of messages, see `dse.encode.messages.waiting`
        self.is_guarded = False  # whether limits can be switched off
        self.scheduled: dict[tuple[int, bool], tuple[object, Form]] = {}  # by the id of a term, which is kept alive
        self.extremes: dict[tuple[int, bool], tuple[object, Form]] = {}  # as `scheduled`
        self.until_read: dict[int, tuple[object, Any]] = {}  # as `scheduled`, see `dse.encode.scheduling.clock_reads`
        self.attained: list[int] = []  # literals of which sum an extreme is, see `dse.encode.sums`
        self.waiting: dict[Waiter, cp_model.IntVar] = {}  # by thread or chain, see `dse.encode.scheduling.waiting`
        self.waiting_where: dict[int, cp_model.IntVar] = {}  # the same of threads that wait in some designs only
        self.wait_scale = 0
        self.phases: dict[Any, Any] = {}  # by pair of components, see `dse.encode.scheduling.clock_reads`
        self.guard: cp_model.IntVar | None = None
        self.fixable: frozenset[int] = frozenset(space.fixed)  # decisions that are fixed, or may be once it is made
        self.branched: Counter[int] = Counter()
        self.true = self.model.new_constant(1)

    def all_of(self, literals: Iterable[Any]) -> Any:
        """A literal that is true exactly when all of the given ones are.

        One new Boolean variable with its clauses, unless an equal conjunction exists; constants are simplified.
        """
        parts = {literal.index: literal for literal in literals if literal.index != self.true.index}
        if any(-index - 1 in parts for index in parts) or -self.true.index - 1 in parts:
            return self.true.negated()
        if not parts:
            return self.true
        if len(parts) == 1:
            return next(iter(parts.values()))
        key = frozenset(parts)
        if key not in self._all_of:
            made = self.model.new_bool_var("")
            for part in parts.values():
                self.model.add_implication(made, part)
            self.model.add_bool_or([made, *(part.negated() for part in parts.values())])
            self._all_of[key] = made
        return self._all_of[key]

    def any_of(self, literals: Iterable[Any]) -> Any:
        """A literal that is true exactly when one of the given ones is.

        By De Morgan from `all_of`, with which it shares literals.
        """
        return self.all_of(literal.negated() for literal in literals).negated()

    def _case_literal(self, case: Case[Any]) -> Any:
        """The literal of a case: all its options are chosen."""
        return self.all_of(self.options[decision][option] for decision, option in self.conditions(case))

    def conditions(self, case: Case[Any]) -> list[tuple[int, int]]:
        """The options of a case, without those that the others imply.

        Pairs (decision, option), ascending.
        """
        conditions = set(case.conditions)
        for decision, _ in case.conditions:
            conditions -= self.implied(decision)
        return sorted(conditions)

    def implied(self, decision: int) -> frozenset[tuple[int, int]]:
        """The options that are chosen whenever the decision is active: the one way through its home tree to it.

        Pairs (decision, option); empty where there are several ways.
        """
        if decision not in self._implied:
            ways = list(_ways(self.space.decisions[decision].home, decision, ()))
            self._implied[decision] = frozenset(ways[0]) if len(ways) == 1 else frozenset()
        return self._implied[decision]

    def exactly_one(self, literals: Sequence[Any]) -> None:
        """Exactly one of the literals is true; said once for the same literals, and not of what is always true."""
        key = frozenset(literal.index for literal in literals)
        if key != {self.true.index} and key not in self._choices:
            self._choices.add(key)
            self.model.add_exactly_one(literals)

    def forbid(self, literals: Sequence[Any]) -> None:
        """Forbid that all literals are true together; where there is a guard, only while it is true.

        One clause of the negated literals.
        """
        held = [] if self.guard is None else [self.guard]
        self.model.add_bool_or([literal.negated() for literal in (*literals, *held)])

    def demand(self, comparison: Any, where: Sequence[Any]) -> None:
        """A linear constraint where all the literals are true; where there is a guard, only while it is true.

        `comparison` is a linear inequality or equation of CP-SAT.
        """
        held = [] if self.guard is None else [self.guard]
        self.model.add(comparison).only_enforce_if([*where, *held])

    def shared(self) -> tuple[int, ...]:
        """The decisions that sums have branched on, most summands first."""
        return tuple(decision for decision, _ in self.branched.most_common())

    def cases(self, formula: Callable[[View], T], conditions: Given = NOTHING) -> list[Case[T]]:
        """The cases of a formula, where the decisions in `conditions` are taken.

        Raises `OverflowError` beyond `HARD_CASE_LIMIT` cases.
        """
        cases = tabulate(self.space, formula, HARD_CASE_LIMIT, conditions)
        if cases is None:
            raise OverflowError("a figure depends on more combinations of options than can be tabulated")
        return cases

    def named(self, cases: Iterable[Case[T]], conditions: Given = NOTHING) -> list[tuple[Any, T]]:
        """Cases as (literal, value), exactly one of which is true (where the options in `conditions` are chosen)."""
        pairs = [(self._case_literal(case), case.value) for case in cases]
        if not conditions:
            self.exactly_one([literal for literal, _ in pairs])
        return pairs

    def table(self, formula: Callable[[View], T], conditions: Given = NOTHING) -> list[tuple[Any, T]]:
        """The cases of a formula as (literal, value), exactly one of which is true where `conditions` is chosen.

        Raises `OverflowError` beyond `HARD_CASE_LIMIT` cases.
        """
        return self.named(self.cases(formula, conditions), conditions)

    def short_table(self, formula: Callable[[View], T], limit: int) -> list[tuple[Any, T]] | None:
        """The cases of a formula as (literal, value), exactly one of which is true; None beyond `limit` cases.

        For formulas that have another encoding where the table would be large.
        """
        cases = tabulate(self.space, formula, limit)
        return self.named(cases) if cases is not None else None

    def forbid_where(self, formula: Callable[[View], bool]) -> bool:
        """Forbid the cases in which `formula` holds, each by one clause; False, and nothing said, beyond `CLAUSES`."""
        cases = tabulate(self.space, formula, CLAUSES)
        for case in cases or []:
            if case.value:
                self.forbid([self.options[decision][option] for decision, option in self.conditions(case)])
        return cases is not None

    def holds(self, formula: Callable[[View], bool]) -> Any:
        """The literal of a predicate.

        True in exactly the designs in which `formula` is true.
        """
        pairs = self.table(formula)
        return self.any_of(literal for literal, value in pairs if value)

    def form(self, pairs: Iterable[tuple[Any, int]]) -> Form:
        """The linear form of a table of integers.

        The least value is the constant, other cases add their difference to it.
        """
        listed = list(pairs)
        if not listed:
            return Form()
        base = min(value for _, value in listed)
        form = Form(base, {}, base, max(value for _, value in listed))
        for literal, value in listed:
            self._add_literal(form, literal, value - base)
        return form

    def optional_form(self, pairs: Iterable[tuple[Any, int]]) -> Form:
        """The linear form of a table of which at most one case is true, and 0 where none is.

        Cases exclude each other; the form is the value of the one that is true.
        """
        listed = list(pairs)
        form = Form(0, {}, min(0, *(value for _, value in listed), 0), max(0, *(value for _, value in listed), 0))
        for literal, value in listed:
            self._add_literal(form, literal, value)
        return form

    def _add_literal(self, form: Form, literal: Any, coefficient: int) -> None:
        if coefficient == 0:
            return
        if literal.index == self.true.index:
            form.constant += coefficient
        elif literal.index < 0:
            form.constant += coefficient
            index = -literal.index - 1
            form.coefficients[index] = form.coefficients.get(index, 0) - coefficient
        else:
            form.coefficients[literal.index] = form.coefficients.get(literal.index, 0) + coefficient

    def within(self, form: Form, most: int) -> Form:
        """A form that is `form` wherever that is at most `most`, and beyond it elsewhere, within exact arithmetic.

        A literal whose coefficient alone lifts the form beyond `most` cannot be true, whatever its coefficient: such as
        what stands for a latency without a bound, in units that divide a nanosecond. In place of another variable there
        is one that ends where the form is beyond `most` by it alone. Other forms stay as they are.
        """
        if form.high < EXACT_LIMIT or form.low > most:
            return form
        enough, high, held = most + 1 - form.low, form.constant, {}
        for variable, coefficient in form.coefficients.items():
            low, *_, last = domain = tuple(self.model.proto.variables[variable].domain)
            end = low - -enough // coefficient if coefficient > 0 else last
            if domain == (0, 1):
                coefficient = min(coefficient, enough)
            elif end < last:
                last, whole = end, self.model.get_int_var_from_proto_index(variable)
                ended = self.model.new_int_var(low, last, "")
                self.model.add_min_equality(ended, [whole, last])
                variable = ended.index
            held[variable] = coefficient
            high += max(coefficient * low, coefficient * last)
        return Form(form.constant, held, form.low, min(form.high, high))

    def expression(self, form: Form) -> Any:
        """The form as a solver expression; raises OverflowError where exact arithmetic would be lost."""
        check_exact(max(abs(form.low), abs(form.high)), "a sum")
        variables = [self.model.get_int_var_from_proto_index(index) for index in form.coefficients]
        return cp_model.LinearExpr.weighted_sum(variables, list(form.coefficients.values())) + form.constant


def _ways(tree: Tree, decision: int, taken: tuple[tuple[int, int], ...]) -> Iterator[tuple[tuple[int, int], ...]]:
    """The options on each way through `tree` to `decision`."""
    if not isinstance(tree, Choice):
        return
    if tree.decision == decision:
        yield taken
        return
    for option, branch in enumerate(tree.branches):
        yield from _ways(branch, decision, (*taken, (tree.decision, option)))


def check_exact(value: int, what: str) -> None:
    """Raise OverflowError where `value` is beyond what is computed exactly.

    `what` begins the message. Sums below `EXACT_LIMIT` cannot overflow in the solver.
    """
    if abs(value) >= EXACT_LIMIT:
        raise OverflowError(f"{what} may reach {abs(value)}, beyond exact arithmetic")


def placed(item: Requirement | Objective, error: OverflowError) -> OverflowError:
    """The error with what it is about: its place in the file, and its text.

    For a message that names the requirement or objective whose figures are too large.
    """
    return OverflowError(f"{item.origin}: {item.text}: {error}" if item.origin else f"{item.text}: {error}")


def floor_int(value: Fraction) -> int:
    """The greatest integer not above `value`."""
    return value.numerator // value.denominator


def greatest(*, strict: bool) -> Callable[[Fraction], int]:
    """The greatest integer that keeps an upper bound, or is below it.

    A function from an exact bound to an integer.
    """
    return (lambda bound: ceil_int(bound) - 1) if strict else floor_int


def ceil_int(value: Fraction) -> int:
    """The least integer not below `value`."""
    return -(-value.numerator // value.denominator)
