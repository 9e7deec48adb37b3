"""Requirements as linear constraints: metric against limit, and each thread against one core."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from dse.analysis.limits import Limit
from dse.analysis.measures import Term
from dse.analysis.messages.conflicts import open_identifiers
from dse.encode.linear import Board, Form, Given, ceil_int, floor_int, greatest, placed
from dse.encode.messages.limits import is_message_limit, message_limit
from dse.encode.rates import RateVariables
from dse.encode.scheduling.contention import is_deadline
from dse.encode.scheduling.core_limits import CoreLimit
from dse.encode.scheduling.schedulability import Deadline
from dse.encode.scheduling.waiting_forms import is_short
from dse.encode.sums import Branch, measure_branches
from dse.space.core_symmetry import interchangeable_cores
from dse.space.model.trees import leaves


def add_limit(board: Board, rates: RateVariables, limit: Limit) -> None:
    """sum(terms) OP sum(bound[case] * case); the sum is an integer, so rounding the bound inwards is exact.

    Deadlines and limits on cores are handed to the parts of the model that know response times and cores.
    """
    operator, measure = limit.requirement.operator, limit.measure
    if is_deadline(limit):
        board.deadlines.append(Deadline(limit, board.guard.index if board.guard is not None else None))
        return
    if is_message_limit(limit) and (
        open_identifiers(board.space) or not all(is_short(board, term.value) for term in measure.terms)
    ):
        board.message_limits.append(message_limit(board, limit))
        return
    try:
        if operator in ("<=", "<", "=="):
            inwards = greatest(strict=operator == "<")
            is_tight = False
            for branch in measure_branches(board, rates, measure, below=True):
                bounds = _bounds(board, limit, branch.given, inwards)
                is_tight = is_tight or _may_fill_cores(board, limit, branch, bounds)
                _add_upper(board, branch, bounds)
            if is_tight:
                board.core_limits.append(CoreLimit(limit, board.guard.index if board.guard is not None else None))
        if operator in (">=", ">", "=="):
            for branch in measure_branches(board, rates, measure):
                _add_lower(board, branch, _bounds(board, limit, branch.given, _least(strict=operator == ">")))
        _add_cores(board, rates, limit)
    except OverflowError as error:
        raise placed(limit.requirement, error) from error


def _least(*, strict: bool) -> Callable[[Fraction], int]:
    """The least integer that keeps a lower bound."""
    return (lambda bound: floor_int(bound) + 1) if strict else ceil_int


def _bounds(board: Board, limit: Limit, conditions: Given, inwards: Callable[[Fraction], int]) -> Form:
    table = board.table(limit.bound, conditions)
    return board.form((literal, inwards(bound * limit.measure.scale)) for literal, bound in table)


def _add_upper(board: Board, branch: Branch, bounds: Form) -> None:
    branch.form.add(bounds, -1)
    if branch.form.high > 0:
        board.demand(board.expression(board.within(branch.form, 0)) <= 0, branch.chosen)


def _add_lower(board: Board, branch: Branch, bounds: Form) -> None:
    branch.form.add(bounds, -1)
    if branch.form.low < 0:
        board.demand(board.expression(branch.form) >= 0, branch.chosen)


def _add_cores(board: Board, rates: RateVariables, limit: Limit) -> None:
    """Each thread alone uses at most its share of one core, and so do threads together that are stated to share it."""
    if limit.cores is None:
        return
    measure = limit.measure
    most = greatest(strict=limit.cores.is_strict)(limit.cores.most * measure.scale)
    for terms in (*limit.alone.values(), *limit.together):
        if len(terms) == 1 and _forbid_products(
            board, rates, terms[0], Fraction(most + measure.rounded, measure.scale)
        ):
            continue
        for branch in measure_branches(board, rates, measure, tuple(terms), below=True):
            if branch.form.high > most:
                board.demand(board.expression(branch.form) <= most, branch.chosen)


def _may_fill_cores(board: Board, limit: Limit, branch: Branch, bounds: Form) -> bool:
    """Whether threads that keep the sum and their own limits may not fit on the cores of a processor.

    First-fit puts threads of at most 1 on n cores as long as they use no more than (n + 1) / 2 together (J. M. Lopez
    and others, "Utilization bounds for EDF scheduling on real-time multiprocessor systems", Real-Time Systems 28,
    2004); where cores are stated, listed or decided anything may happen.
    """
    if limit.cores is None:
        return False
    space, processor = limit.cores.space, limit.cores.processor
    if max([1, *leaves(space.processors[processor].cores)]) < 2:
        return False
    each = limit.cores.most * limit.measure.scale
    if branch.form.high + len(limit.measure.terms) <= each:
        return False  # all of them fit on one core
    here = [item for item in space.components if processor in set(leaves(item.processor))]
    if any(item.core is not None for item in here) or any(item.others for item in space.open_cores):
        return True
    if len(interchangeable_cores(space, processor)) > 1:
        return True
    cores = bounds.low // each if each else 0
    return branch.form.high + len(limit.measure.terms) > each * (cores + 1) / 2


def _forbid_products(board: Board, rates: RateVariables, term: Term, most: Fraction) -> bool:
    """Forbid each pair of a coefficient and a rate whose product is beyond `most`; False if the rate has no table."""
    if term.coefficient is None or term.rate is None or term.ends is not None:
        return False
    values = rates.tables.table(term.rate)
    if values is None:
        return False
    for case in board.cases(term.coefficient):
        options = [board.options[decision][option] for decision, option in board.conditions(case)]
        for literal, rate in values:
            if case.value * rate > most:
                board.forbid([*options, literal])
    return True
