"""Measures as linear forms: the sum over their terms' tables."""

from __future__ import annotations

from dse.analysis.measures import Measure, Term
from dse.encode.forms import CASE_LIMIT, Board, Form, ceil_int, floor_int
from dse.encode.products import product_pairs
from dse.encode.rates import RateVariables
from dse.errors import UsageError

PAIR_LIMIT = 1_000
"""Products of more coefficients and rates than this are left to a rate variable."""

LAST_CASE_LIMIT = 20_000
"""How long a table may be where nothing shorter is exact."""

SCHEDULE_CASE_LIMIT = 5_000
"""Response times that depend on more combinations of options than this are refused, not approximated."""


def measure_form(board: Board, rates: RateVariables, measure: Measure, *, below: bool = False) -> Form:
    """The form of a measure in units of 1 / scale: exact, or for a rounded measure each term rounded up.

    With `below` a rounded measure's terms are rounded down instead: a lower bound of the exact sum.
    """
    return terms_form(board, rates, measure, measure.terms, below=below)


def terms_form(
    board: Board, rates: RateVariables, measure: Measure, terms: tuple[Term, ...], *, below: bool = False
) -> Form:
    """The form of some of a measure's terms."""
    total = Form()
    for term in terms:
        total.add(_term_form(board, rates, measure, term, below))
    return total


def _term_form(board: Board, rates: RateVariables, measure: Measure, term: Term, below: bool) -> Form:
    """sum(value[case] * case); coefficient * rate as a sum over pairs, or for too many rates with a rate variable."""
    if term.scheduled:
        return _scheduled_form(board, measure, term)
    rounded = floor_int if below and measure.rounded else ceil_int
    if term.coefficient is None or term.rate is None:
        return board.form((literal, rounded(value * measure.scale)) for literal, value in board.table(term.value) or [])
    table = board.table(term.value, CASE_LIMIT)
    if table is not None:
        return board.form((literal, rounded(value * measure.scale)) for literal, value in table)
    coefficients, values = board.table(term.coefficient) or [], rates.tables.table(term.rate)
    if values is not None and len(values) * len(coefficients) <= PAIR_LIMIT:
        pairs = product_pairs(board, coefficients, values)
        return board.optional_form((literal, rounded(value * measure.scale)) for literal, value in pairs)
    try:
        form = rates.product_form(term, measure.scale)
    except OverflowError:  # no common denominator for the rates: only the whole table is exact
        table = board.table(term.value, LAST_CASE_LIMIT)
        if table is None:
            raise
        return board.form((literal, rounded(value * measure.scale)) for literal, value in table)
    if below and measure.rounded:
        form.add(Form(-1, {}, -1, -1))
    return form


def _scheduled_form(board: Board, measure: Measure, term: Term) -> Form:
    """sum(value[case] * case) of a response time, exact.

    Raises
    ------
    UsageError
        when it depends on too many combinations of options: the search would have to guess.
    """
    table = board.table(term.value, SCHEDULE_CASE_LIMIT)
    if table is None:
        raise UsageError(
            f"{measure.metric.name}: the response time of {term.label} depends on more than {SCHEDULE_CASE_LIMIT:,} "
            f"combinations of options; fix some of the decisions about what shares its processor, or look at the "
            f"designs of a front one by one with `dse analyse --response-times`"
        )
    return board.form((literal, ceil_int(value * measure.scale)) for literal, value in table)
