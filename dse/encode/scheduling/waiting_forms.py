"""Figures that hold response times as linear forms: a table, a thread's waiting, or a variable that is sharpened.

A response time depends on whatever shares the thread's core. Where that is few combinations of options it is a table;
where it is what a thread's waiting adds, this is one variable for all figures with it
(`dse.encode.scheduling.waiting`); else it is an open term (`dse.encode.linear.OpenTerm`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from ortools.sat.python import cp_model

from dse.analysis.measures import Measure
from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS, bounded_response_ns, waited_ns
from dse.analysis.terms import FlowChain, Term, Waiter
from dse.analysis.timescale import RESPONSE_SCALE_LIMIT, whole_time_scale
from dse.analysis.views import PartialView, Undecided, View, allowed_options, tabulate
from dse.encode.linear import Board, Form, OpenTerm, check_exact, floor_int
from dse.encode.messages.waiting import add_waiting_rows
from dse.encode.table_parts import additive_parts
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import parts_of
from dse.space.model.space import Space
from dse.space.model.trees import NotOffered
from dse.space.question.open_cores import is_scheduled, is_shortest
from dse.support.units import Exact

SCHEDULE_CASE_LIMIT = 64
"""Response times that depend on more combinations of options than this are sharpened where the search comes by."""

TABULATED_TASKS = 2**14
"""Where longer ones are somewhere an advantage each combination has to be come by: these are tabulated, as long as all
of them together have no more threads than this."""
CLEARLY_MORE = 8
"""A figure that looks at so many times more combinations on its way to one case is not tabulated to see whether they
are fewer: each case is an analysis."""


def _most_cases(board: Board) -> int:
    """How many combinations of options a table of response times may have."""
    few = 0 if is_upward(board.space) else TABULATED_TASKS // max(1, len(board.space.components))
    return max(SCHEDULE_CASE_LIMIT, few)


def is_short(board: Board, formula: Callable[[View], object]) -> bool:
    """Whether a figure is a table of so few cases that nothing else pays."""
    most = _most_cases(board)
    return not _is_clearly_long(board, formula, most) and tabulate(board.space, formula, most) is not None


def _is_clearly_long(board: Board, formula: Callable[[View], object], most: int) -> bool:
    """Whether the decisions that a figure looks at, one after the other, have far more combinations than `most`."""
    partial: dict[int, int] = {}
    ways = 1
    while ways <= CLEARLY_MORE * most:
        try:
            formula(PartialView(partial))
        except Undecided as question:
            options = allowed_options(board.space, question.decision)
            partial[question.decision] = options[0]
            ways *= len(options)
        except (NotOffered, CyclicActivation):
            return False
        else:
            return False
    return True


def scheduled_form(board: Board, measure: Measure, term: Term, rounded: Callable[[Fraction], int]) -> Form:
    """sum(value[case] * case) of a response time; with too many cases a variable between bounds that cut nothing off.

    low[case] <= variable <= high[case]; the exact value of a combination of options follows when a solution has it
    (`OpenTerm`).
    """
    key = id(term), rounded is floor_int
    if key not in board.scheduled:
        board.scheduled[key] = term, _made_form(board, measure, term, rounded)
    return board.scheduled[key][1]


def _made_form(board: Board, measure: Measure, term: Term, rounded: Callable[[Fraction], int]) -> Form:
    most = _most_cases(board)
    table = None if _is_clearly_long(board, term.value, most) else board.short_table(term.value, most)
    if table is not None:
        return board.form((literal, rounded(value * measure.scale)) for literal, value in table)
    ends = term.ends
    assert ends is not None
    if term.only_waits and term.waits is not None and not measure.rounded:
        shared = shared_waiting(board, term.waits[0], measure.scale, term.waits[1])
        if shared is not None:
            waiting, times = shared
            if term.waits_where is not None:
                assert isinstance(term.waits[0], int)
                waiting = _waiting_where(board, term.waits[0], waiting, term.waits_where)
            return _waiting_form(board, measure, term, waiting, times)
    bounds = board.table(ends)
    lows = board.form((literal, rounded(low * measure.scale)) for literal, (low, _) in bounds)
    highs = board.form((literal, rounded(high * measure.scale)) for literal, (_, high) in bounds)
    check_exact(max(abs(lows.low), abs(highs.high)), f"the response time of {term.label}")
    variable = board.model.new_int_var(lows.low, highs.high, "")
    board.model.add(variable >= board.expression(lows))
    board.model.add(variable <= board.expression(highs))
    waits = (
        None if term.waits is None or term.waits_where is not None else (term.waits[0], term.waits[1] * measure.scale)
    )
    before: Mapping[int, int] = {}
    often = term.message.times if term.message is not None else Fraction(1)
    if term.message is not None and not term.may_fall:
        before = add_waiting_rows(board, term.message.number, board.expression(lows), variable, measure.scale * often)
    value = OpenTerm(
        variable,
        lambda view: rounded(term.value(view) * measure.scale),
        lows,
        waits,
        term.may_fall,
        term.message,
        None if board.is_guarded else lambda view, waited: rounded((ends(view)[0] + often * waited) * measure.scale),
        before,
    )
    board.open_terms.append(value)
    return Form(0, {variable.index: 1}, lows.low, highs.high)


def shared_waiting(board: Board, waiter: Waiter, scale: int, weight: Fraction) -> tuple[cp_model.IntVar, int] | None:
    """The variable of a thread's or a chain's waiting on a board, and how often it counts in a figure.

    The figure is counted in 1 / `scale` of its unit. Waiting counts in the unit of all times, so that figures of any
    scale share it; None where they do not go together. The variable is an open term: it may be too low at first.
    """
    unit = board.wait_scale = whole_time_scale(board.space)  # of which every response time is a whole number
    times = weight * scale / unit
    if times.denominator != 1 or unit > RESPONSE_SCALE_LIMIT:
        return None
    if waiter not in board.waiting:

        def value(view: View) -> int:
            return -floor_int(-Fraction(waited_by_ns(board.space, waiter, view)) * unit)

        board.waiting[waiter] = board.model.new_int_var(0, most_waiting_ns(waiter) * unit, "")
        board.open_terms.append(OpenTerm(board.waiting[waiter], value, Form(), (waiter, Fraction(unit))))
    return board.waiting[waiter], int(times)


def waited_by_ns(space: Space, waiter: Waiter, view: View) -> Exact:
    """How long a thread, or the threads of a chain together, wait for others in a design, in ns."""
    if isinstance(waiter, FlowChain):
        return chain_wait_ns(space, waiter, view)
    return waited_ns(space, waiter, view, bounded_response_ns(space, waiter, "thread", view))


def most_waiting_ns(waiter: Waiter) -> int:
    """A bound of that, in ns: without a bound each thread counts as one time."""
    return UNBOUNDED_NS * (len(waiter.threads) if isinstance(waiter, FlowChain) else 1)


def _waiting_where(
    board: Board, number: int, waiting: cp_model.IntVar, counts: Callable[[View], bool]
) -> cp_model.IntVar:
    """A thread's waiting in the designs where it counts, 0 in others: exact as soon as that is."""
    if number not in board.waiting_where:
        found = board.model.new_int_var(0, UNBOUNDED_NS * board.wait_scale, "")
        literal = board.any_of(literal for literal, value in board.table(counts) if value)
        board.model.add(found == waiting).only_enforce_if(literal)
        board.model.add(found == 0).only_enforce_if(literal.negated())
        board.waiting_where[number] = found
    return board.waiting_where[number]


def _waiting_form(board: Board, measure: Measure, term: Term, waiting: cp_model.IntVar, times: int) -> Form:
    """The lower end of a figure, and its thread's waiting so many times."""
    ends = term.ends
    assert ends is not None
    form = Form()
    cases = board.cases(lambda view: ends(view)[0])
    for part in additive_parts(board.space, cases, board.tuning.additive_tables):
        form.add(board.form((literal, int(low * measure.scale)) for literal, low in board.named(part)))
    assert term.waits is not None
    form.add(Form(0, {waiting.index: times}, 0, times * most_waiting_ns(term.waits[0]) * board.wait_scale))
    return form


# Where longer response times are nowhere an advantage: a search then takes them as long as they are at least.


def is_upward(space: Space) -> bool:
    """Whether a longer response time is nowhere an advantage: then it is enough that open terms are not too low."""
    asked = [(item.metric, int(item.is_upper)) for item in space.requirements]
    asked += [(item.metric, 1 if item.sense == "minimise" else -1) for item in space.objectives]
    return all(is_better_shorter(space, metric, sign) for metric, sign in asked)


def is_better_shorter(space: Space, metric: Metric, sign: int, factor: Fraction | int = 1) -> bool:
    """Whether open terms of a metric that should be low (`sign` 1), high (-1) or equal (0) are enough if not too low.

    They are where it counts `factor` times in a sum that should be low, and grows there with response times.
    """
    parts = parts_of(space, metric)
    if parts:
        return all(is_better_shorter(space, inner, sign, factor * item.value) for item, inner in parts)
    return (sign > 0 and (factor < 0) == is_shortest(metric)) or not is_scheduled(space, metric)


def may_wait(terms: Sequence[Term]) -> bool:
    """Whether response times are in a sum."""
    return any(term.ends is not None for term in _every_term(terms))


def may_fall(terms: Sequence[Term]) -> bool:
    """Whether a sum may be less where some response time is longer."""
    return any(term.ends is not None and term.waits is None and not term.grows for term in _every_term(terms))


def _every_term(terms: Iterable[Term]) -> Iterator[Term]:
    """The terms of a sum, and those of the sums that it takes the greatest or the least of."""
    for term in terms:
        yield term
        for inner in term.extreme.sums if term.extreme is not None else ():
            yield from _every_term(inner)
