"""Measures as linear forms: the sum over their terms' tables."""

from __future__ import annotations

from dse.analysis.measures import Measure, Term
from dse.encode.forms import CASE_LIMIT, Board, Form, ceil_int, floor_int
from dse.encode.rates import RateVariables


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
    """sum(value[case] * case), or where that has too many cases, a product of coefficient cases and a rate variable."""
    product = term.coefficient is not None and term.rate is not None
    table = board.table(term.value, CASE_LIMIT) if product else board.table(term.value)
    rounded = floor_int if below and measure.rounded else ceil_int
    if table is not None:
        return board.form((literal, rounded(value * measure.scale)) for literal, value in table)
    form = rates.product_form(term, measure.scale)
    if below and measure.rounded:
        form.add(Form(-1, {}, -1, -1))
    return form
