"""Measures as linear forms: the sum over their terms' tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import product
from math import gcd
from typing import Any

from dse.analysis.measures import Measure, Term
from dse.analysis.views import allowed_options
from dse.encode.linear import Board, Form, Given, ceil_int, check_exact, floor_int
from dse.encode.rates import RateVariables
from dse.encode.scheduling.clock_reads import phased_form, sum_of
from dse.encode.scheduling.waiting_forms import scheduled_form
from dse.encode.table_parts import additive_parts

PAIR_LIMIT = 1_000
"""Products of more coefficients and rates than this are left to a rate variable."""

LAST_CASE_LIMIT = 20_000
"""How long a table may be where nothing shorter is exact."""


@dataclass(frozen=True)
class Branch:
    """The form of a sum where the options in `given` are chosen, whose literals are `chosen`.

    A sum has one branch for each combination of the options of its shared decisions.
    """

    given: Given
    chosen: tuple[Any, ...]
    form: Form

    def counted(self, sign: int, offset: int, step: int) -> tuple[frozenset[int], int, dict[int, int]]:
        """The literals of the case, and the constant and coefficients of its form, in steps above an offset.

        For the grid of values that the sum can have in a part of the space.
        """
        coefficients = {index: sign * coefficient // step for index, coefficient in self.form.coefficients.items()}
        return frozenset(item.index for item in self.chosen), (sign * self.form.constant - offset) // step, coefficients


def measure_branches(
    board: Board,
    rates: RateVariables,
    measure: Measure,
    terms: tuple[Term, ...] | None = None,
    *,
    below: bool = False,
) -> list[Branch]:
    """The sum of a measure's terms (or of some of them) in units of 1 / scale.

    Exact, or for a rounded measure each term rounded up; with `below` rounded down instead, a lower bound of the exact
    sum. Where many terms depend on the same decision (the type of a processor), there is one form for each of its
    options: that needs no literal for each pair of the option and a rate.
    """
    listed = measure.terms if terms is None else terms
    shared = _shared_decisions(board, rates, listed)
    branches = []
    for taken in product(*(allowed_options(board.space, decision) for decision in shared)):
        conditions = dict(zip(shared, taken, strict=True))
        form = sum_of(board, measure, listed, partial(_term_form, board, rates, measure, below), conditions)
        chosen = tuple(board.options[decision][option] for decision, option in conditions.items())
        branches.append(Branch(conditions, chosen, form))
    return branches


def _shared_decisions(board: Board, rates: RateVariables, terms: Sequence[Term]) -> list[int]:
    """The decisions on which the coefficients of several products hang, as far as they have few options together."""
    tuning = board.tuning.shared_forms
    if not tuning.is_on:
        return []
    counts: Counter[int] = Counter()
    for term in terms:
        if term.coefficient is None or term.rate is None or term.ends is not None:
            continue
        values = rates.tables.table(term.rate)
        if values is None or len(values) > 1:
            cases = board.cases(term.coefficient)
            counts.update(sorted({decision for case in cases for decision, _ in case.conditions}))
    shared: list[int] = []
    branches = 1
    for decision, users in counts.most_common():
        options = len(allowed_options(board.space, decision))
        if users < tuning.shared_by or board.inactive[decision] is not None:
            continue
        if branches * options <= tuning.most_branches:
            shared.append(decision)
            branches *= options
            board.branched[decision] += users
    return shared


def _term_form(
    board: Board, rates: RateVariables, measure: Measure, below: bool, term: Term, conditions: Given
) -> Form:
    """sum(value[case] * case); coefficient * rate as a sum over pairs, or for too many rates with a rate variable."""
    rounded = floor_int if below and measure.rounded else ceil_int
    if term.extreme is not None:
        return _extreme_form(board, rates, measure, term, below)
    if term.ends is not None:
        return scheduled_form(board, measure, term, rounded)
    if term.phased is not None and not measure.rounded:
        return phased_form(board, measure, term, conditions)

    def counted(pairs: Iterable[tuple[Any, Fraction]]) -> Iterator[tuple[Any, int]]:
        return ((literal, rounded(value * measure.scale)) for literal, value in pairs)

    if term.coefficient is None or term.rate is None:
        cases = board.cases(term.value, conditions)
        form = Form()
        for part in [cases] if measure.rounded else additive_parts(board.space, cases, board.tuning.additive_tables):
            form.add(board.form(counted(board.named(part, conditions))))
        return form
    coefficients, values = board.table(term.coefficient, conditions), rates.tables.table(term.rate)
    if values is not None and len(values) * len(coefficients) <= PAIR_LIMIT:
        return board.optional_form(counted(rates.tables.times(coefficients, values)))
    try:
        form = rates.product_form(term, measure.scale, conditions)
    except OverflowError:  # no common denominator for the rates: only the whole table is exact
        table = board.short_table(term.value, LAST_CASE_LIMIT)
        if table is None:
            raise
        return board.form(counted(table))
    if below and measure.rounded:
        form.add(Form(-1, {}, -1, -1))
    return form


def _extreme_form(board: Board, rates: RateVariables, measure: Measure, term: Term, below: bool) -> Form:
    """The greatest (or least) of several sums as a variable m: m >= each sum, and m <= one of them.

    (For the least m <= each sum, and m >= one of them.) Exact in both directions, whatever the search asks of it;
    counted in the largest step that the sums have in common.
    """
    key = id(term), below and measure.rounded
    if key not in board.extremes:
        board.extremes[key] = term, _made_extreme(board, rates, measure, term, below)
    return board.extremes[key][1]


def _made_extreme(board: Board, rates: RateVariables, measure: Measure, term: Term, below: bool) -> Form:
    assert term.extreme is not None
    pick, sign = term.extreme.pick, 1 if term.extreme.kind == "max" else -1
    sums = [measure_branches(board, rates, measure, terms, below=below) for terms in term.extreme.sums]
    forms = [branch.form for branches in sums for branch in branches]
    low = pick(min(branch.form.low for branch in branches) for branches in sums)
    high = pick(max(branch.form.high for branch in branches) for branches in sums)
    check_exact(max(abs(end) for form in forms for end in (form.low, form.high)), term.label)
    base = forms[0].constant
    step = gcd(*(form.constant - base for form in forms), *(c for form in forms for c in form.coefficients.values()))
    if not step:
        return Form(base, {}, base, base)
    least, most = -((base - low) // step), (high - base) // step
    variable = board.model.new_int_var(least, most, "")
    value = base + step * variable
    reached = []
    for branches in sums:
        here = board.model.new_bool_var("")
        reached.append(here)
        for branch in branches:
            expression = board.expression(branch.form)
            board.model.add(sign * value >= sign * expression).only_enforce_if(branch.chosen)
            board.model.add(sign * value <= sign * expression).only_enforce_if([*branch.chosen, here])
    board.model.add_bool_or(reached)
    board.attained += [here.index for here in reached]
    return Form(base, {variable.index: step}, low, high)
