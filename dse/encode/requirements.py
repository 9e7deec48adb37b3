"""Requirements as linear constraints: metric against limit, and each thread against one core."""

from __future__ import annotations

from dse.analysis.limits import Limit, thread_loads
from dse.analysis.measures import Measure
from dse.encode.forms import Board, Form, ceil_int, floor_int
from dse.encode.rates import RateVariables
from dse.encode.sums import measure_form, terms_form


def add_limit(board: Board, rates: RateVariables, limit: Limit) -> None:
    """sum(terms) OP sum(bound[case] * case); the sum is an integer, so rounding the bound inwards is exact."""
    operator, measure = limit.requirement.operator, limit.measure
    try:
        if operator in ("<=", "<", "=="):
            form = measure_form(board, rates, measure, below=True)
            _add_upper(board, form, limit, measure, strict=operator == "<")
        if operator in (">=", ">", "=="):
            form = measure_form(board, rates, measure)
            _add_lower(board, form, limit, measure, strict=operator == ">")
        if limit.each is not None:
            _add_each(board, rates, limit, strict=operator == "<")
    except OverflowError as error:
        raise OverflowError(f"{limit.requirement.text}: {error}") from error


def _add_upper(board: Board, form: Form, limit: Limit, measure: Measure, *, strict: bool) -> None:
    bounds = []
    for literal, bound in board.table(limit.bound) or []:
        scaled = bound * measure.scale
        bounds.append((literal, ceil_int(scaled) - 1 if strict else floor_int(scaled)))
    form.add(board.form(bounds), -1)
    if form.high > 0:
        board.model.add(board.expression(form) <= 0)


def _add_lower(board: Board, form: Form, limit: Limit, measure: Measure, *, strict: bool) -> None:
    bounds = []
    for literal, bound in board.table(limit.bound) or []:
        scaled = bound * measure.scale
        bounds.append((literal, floor_int(scaled) + 1 if strict else ceil_int(scaled)))
    form.add(board.form(bounds), -1)
    if form.low < 0:
        board.model.add(board.expression(form) >= 0)


def _add_each(board: Board, rates: RateVariables, limit: Limit, *, strict: bool) -> None:
    """Each thread alone uses at most its share of one core."""
    assert limit.each is not None
    scaled = limit.each * limit.measure.scale
    most = ceil_int(scaled) - 1 if strict else floor_int(scaled)
    for terms in thread_loads(limit.measure.terms).values():
        form = terms_form(board, rates, limit.measure, tuple(terms), below=True)
        if form.high > most:
            board.model.add(board.expression(form) <= most)
