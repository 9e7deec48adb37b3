"""Flows over readers on one clock beside response times: what has passed when data are read, as one variable.

A job that ends later may wait less for the next read, so that the waits of a sum fall where response times grow. What
passes from one read to the next does not: it is what is congruent to the difference of the offsets modulo the step g of
both timers, and no less than the response times on the way (`dse.analysis.terms.Read`). So the sum of a flow until a
component reads is a variable, at least the sum until the timer before it read and g * k + x - y, with

    x = (difference of the offsets - soonest) mod g,    g * k + x >= spread + waiting of the threads on the way,
    y <= x - late start of the sender  and  x + late start of the reader < g,    or  y <= 0,

integers k >= 0 and x, 0 <= x, y < g. The waiting of threads is a variable (`dse.encode.scheduling.waiting`) that is no
less than it should be: so is the sum, and with the response times of a design it is what the analysis has. The rows are
necessary conditions, so that no design is lost whatever the solver makes of the variables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import gcd, lcm
from typing import Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.measures import Measure, Term
from dse.analysis.terms import Phased, Read, Reads, Rest
from dse.analysis.views import tabulate
from dse.encode.linear import NOTHING, Board, Form, Given, OpenTerm, check_exact
from dse.encode.scheduling.waiting_forms import is_short, shared_waiting
from dse.space.model.trees import at, leaves
from dse.support.units import Exact

MOST_CASES = 4_000
"""What data wait for in more cases than this is made exact where the search comes by."""
FormOf: TypeAlias = Callable[[Term, Given], Form]


def sum_of(board: Board, measure: Measure, terms: Sequence[Term], form_of: FormOf, given: Given = NOTHING) -> Form:
    """The sum of terms, where the options in `given` are chosen; `form_of` is the form of one of them."""
    if not any(term.reads is not None for term in terms) or measure.rounded:
        total = Form()
        for term in terms:
            total.add(form_of(term, given))
        return total
    totals = [Form()]  # before each term
    for number, term in enumerate(terms):
        reads, until_read = term.reads, None
        if reads is not None and not is_short(board, term.value):
            until_read = _until_read(board, measure, terms, number, form_of)
        if reads is None or until_read is None:
            totals.append(_sum(totals[-1], form_of(term, given)))
        else:
            job = [] if reads.job is None else [form_of(reads.job, given)]
            totals.append(_sum(totals[number - reads.before], until_read, *job))
    return totals[-1]


def _sum(*forms: Form) -> Form:
    total = Form()
    for form in forms:
        total.add(form)
    return total


def _until_read(board: Board, measure: Measure, terms: Sequence[Term], number: int, form_of: FormOf) -> Form | None:
    """The sum of a flow until the component of one of its terms reads, in every design; None where it stays whole."""
    reads = terms[number].reads
    if reads is None or number < reads.before:
        return None
    key = id(terms[number])
    if key not in board.until_read:
        flow = terms[number - reads.before : number]
        board.until_read[key] = terms[number], _made(board, measure, flow, reads, form_of)
    found: Form | None = board.until_read[key][1]
    return found


def _made(board: Board, measure: Measure, flow: Sequence[Term], reads: Reads, form_of: FormOf) -> Form | None:
    cases = tabulate(board.space, reads.parts, MOST_CASES)
    if cases is None:
        return None
    before = sum_of(board, measure, flow, form_of)
    times = reads.factor * measure.scale
    if all(case.value.sender is None for case in cases):
        pairs = board.named(cases)
        return _sum(before, board.form((literal, _whole(read.base_ns, times)) for literal, read in pairs))
    if is_short(board, reads.until_read):
        table = board.table(reads.until_read)
        return _sum(before, board.form((literal, int(value * measure.scale)) for literal, value in table))
    since: dict[int, Form] = {}
    for number, term in enumerate(flow):
        at_read = _until_read(board, measure, flow, number, form_of)
        if term.reads is not None and at_read is not None:
            since[term.reads.receiver] = at_read
    if not {case.value.sender for case in cases} - {None} <= since.keys():
        return None
    return _Passing(board, measure, flow, reads, before, since).form([*board.named(cases)])


def _whole(time: Exact, times: Fraction) -> int:
    found = times * time
    assert found.denominator == 1, time
    return int(found)


class _Passing:
    """The rows of one variable, the sum of a flow until a component reads."""

    def __init__(
        self,
        board: Board,
        measure: Measure,
        flow: Sequence[Term],
        reads: Reads,
        before: Form,
        since: dict[int, Form],
    ) -> None:
        self.board, self.measure, self.reads, self.before, self.since = board, measure, reads, before, since
        self.flow = flow
        self.times = reads.factor * measure.scale

    def form(self, cases: Sequence[tuple[Any, Read]]) -> Form | None:
        """The variable, with the rows of all cases; None where waiting is counted in another unit."""
        groups: dict[Any, list[tuple[Any, Read]]] = {}
        for literal, read in cases:
            key = read.sender, read.step_ns, read.delayed, read.late, read.missed, read.counts_least
            groups.setdefault(key, []).append((literal, read))
        threads = {number for _, read in cases for number in (*read.delayed, *read.late, *read.missed)}
        if any(self._waited([number]) is None for number in threads):
            return None
        longest = max(read.base_ns + (0 if read.sender is None else read.step_ns) for _, read in cases)
        most = self.before.high + _whole(longest, self.times)
        variable = self.board.model.new_int_var(min(0, self.before.low), most, "")
        for group in groups.values():
            self._add(variable, group)
        self.board.open_terms.append(OpenTerm(variable, self._value))
        return Form(0, {variable.index: 1}, min(0, self.before.low), most)

    def _value(self, view: Any) -> int:
        """The sum in a design."""
        total = sum((term.value(view) for term in self.flow), Fraction(0)) + self.reads.until_read(view)
        found = total * self.measure.scale
        assert found.denominator == 1, found
        return int(found)

    def _add(self, variable: Any, cases: Sequence[tuple[Any, Read]]) -> None:
        """The rows of the cases with the same sender, step and threads."""
        board, read = self.board, cases[0][1]
        guard = board.any_of([literal for literal, _ in cases])
        base = self._table(cases, lambda read: read.base_ns)
        if read.sender is None:
            board.model.add(variable >= board.expression(self.before) + base).only_enforce_if(guard)
            return
        since = board.expression(self.since[read.sender])
        step = _whole(read.step_ns, self.times)
        soonest = self._phase(cases, read.sender, step, guard)
        steps = board.model.new_int_var(0, self.before.high // step + 1, "")
        passed = step * steps + soonest
        spread = self._table(cases, lambda read: read.spread_ns) + self._waited(read.delayed)
        board.model.add(passed >= spread).only_enforce_if(guard)
        least = self._least(read, soonest, step, guard) if read.counts_least else 0
        board.model.add(variable >= since + base + passed - least).only_enforce_if(guard)

    def _table(self, cases: Sequence[tuple[Any, Read]], time: Callable[[Read], Exact]) -> Any:
        form = self.board.optional_form((literal, _whole(time(read), self.times)) for literal, read in cases)
        return self.board.expression(form)

    def _waited(self, numbers: Sequence[int]) -> Any:
        """How long threads wait for others, all together; None where that is counted in another unit."""
        total: Any = 0
        for number in numbers:
            found = shared_waiting(self.board, number, self.measure.scale, self.reads.factor)
            if found is None:
                return None
            total += found[1] * found[0]
        return total

    def _phase(self, cases: Sequence[tuple[Any, Read]], sender: int, step: int, guard: Any) -> Any:
        """(offset of the reader - offset of the sender - soonest) mod step, as a variable."""
        board = self.board
        later, earlier = self._offset(self.reads.receiver), self._offset(sender)
        shift = board.optional_form((literal, _whole(read.soonest_ns, self.times)) for literal, read in cases)
        difference = Form()
        for form, sign in ((later, 1), (earlier, -1), (shift, -1)):
            difference.add(form, sign)
        rest = board.model.new_int_var(0, step - 1, "")
        whole = board.model.new_int_var(difference.low // step, difference.high // step, "")
        board.model.add(board.expression(difference) == step * whole + rest).only_enforce_if(guard)
        return rest

    def _offset(self, number: int) -> Form:
        """The offset of a component; where it is not known it is of no account."""
        tree = self.board.space.components[number].offset_ns
        table = self.board.table(lambda view: at(tree, view) or 0)
        return self.board.form((literal, _whole(value, self.times)) for literal, value in table)

    def _least(self, read: Read, soonest: Any, step: int, guard: Any) -> Any:
        """The least wait, or what is less: until the first read that data may meet, if it is not met a step sooner."""
        if not read.late and not read.missed:
            return soonest
        model = self.board.model
        least, meets = model.new_int_var(0, step - 1, ""), model.new_bool_var("")
        model.add(least + self._waited(read.missed) <= soonest).only_enforce_if([guard, meets])
        model.add(soonest + self._waited(read.late) <= step - 1).only_enforce_if([guard, meets])
        model.add(least <= 0).only_enforce_if([guard, meets.negated()])
        return least


# Sampling on one clock for the solver: what is left of a difference of offsets after whole steps, as one variable.
#
# A wait is (o_j - o_i + shift) mod g, for offsets o on a grid: o_j - o_i + shift = g * q + wait, 0 <= wait < g, with
# integers q and wait. Both sides are counted in the greatest common divisor of all offsets, the shift and g, so that
# there are as few values as there are. The same pair, shift and g is one variable, whatever uses it. What is left of it
# beyond a time (of readers that may begin late) is one variable more.


def phased_form(board: Board, measure: Measure, term: Term, given: Given) -> Form:
    """base[case] * case + times * wait, where the case is; a product with a literal where waits differ by case."""
    assert term.phased is not None
    phased, scale = term.phased, measure.scale
    cases = board.cases(phased.parts, given)
    named = board.named(cases, given)
    form = board.form((literal, _phases_whole(base * scale)) for literal, (base, _) in named)
    where: dict[Rest, list[Any]] = {}
    for literal, (_, rests) in named:
        for rest in rests:
            where.setdefault(replace(rest, shift=rest.shift % rest.step), []).append(literal)
    for rest, literals in where.items():
        times, wait = rest.times, _wait(board, phased, rest)
        if not wait.most:
            continue
        variable = wait.variable if len(literals) == len(named) else _where(board, wait, literals)
        factor = _phases_whole(times * scale * wait.unit_ns)
        form.add(Form(0, {variable.index: factor}, min(0, factor * wait.most), max(0, factor * wait.most)))
    return form


def _phases_whole(value: Fraction) -> int:
    found = Fraction(value)
    assert found.denominator == 1, value
    return int(found)


@dataclass(frozen=True)
class Wait:
    """A wait as a variable from 0 to `most`, in units of `unit_ns`."""

    variable: cp_model.IntVar
    most: int
    unit_ns: Fraction


def _wait(board: Board, phased: Phased, rest: Rest) -> Wait:
    """The wait of a pair, made once."""
    key = phased.sender, phased.receiver, rest.shift, rest.step, rest.less
    if key not in board.phases:
        board.phases[key] = (
            _beyond(board, phased, rest) if rest.less else _phases_made(board, phased, rest.shift, rest.step)
        )
    found: Wait = board.phases[key]
    return found


def _beyond(board: Board, phased: Phased, rest: Rest) -> Wait:
    """max(0, wait - less), in a unit that both have in common."""
    wait, less = _wait(board, phased, replace(rest, less=0)), Fraction(rest.less)
    scale = lcm(wait.unit_ns.denominator, less.denominator)
    unit = Fraction(gcd(int(wait.unit_ns * scale), int(less * scale)), scale)
    times, count = int(wait.unit_ns / unit), int(less / unit)
    most = max(0, wait.most * times - count)
    check_exact(max(wait.most * times, count), "a wait between offsets")
    variable = board.model.new_int_var(0, most, "")
    board.model.add_max_equality(variable, [0, times * wait.variable - count])
    return Wait(variable, most, unit)


def _phases_made(board: Board, phased: Phased, shift: Exact, step: Exact) -> Wait:
    trees = [board.space.components[number].offset_ns for number in (phased.receiver, phased.sender)]
    values = [Fraction(leaf) for tree in trees for leaf in leaves(tree)]
    scale = lcm(*(Fraction(value).denominator for value in (*values, shift, step)))
    unit = gcd(*(int(value * scale) for value in (*values, shift, step)))
    width, start = int(step * scale) // unit, int(shift * scale) // unit
    later, earlier = (_offset(board, tree, Fraction(scale, unit)) for tree in trees)
    low, high = later.low - earlier.high + start, later.high - earlier.low + start
    check_exact(max(abs(low), abs(high)), "a difference of offsets")
    wait = board.model.new_int_var(0, width - 1, "")
    whole = board.model.new_int_var(low // width, high // width, "")
    difference = board.expression(later) - board.expression(earlier) + start
    board.model.add(difference == width * whole + wait)
    return Wait(wait, width - 1, Fraction(unit, scale))


def _offset(board: Board, tree: Any, factor: Fraction) -> Form:
    """An offset in whole units."""
    table = board.table(lambda view: Fraction(at(tree, view)))
    return board.form((literal, int(value * factor)) for literal, value in table)


def _where(board: Board, wait: Wait, literals: list[Any]) -> cp_model.IntVar:
    """A wait where one of the literals is true (at most one is), and 0 elsewhere."""
    counted = board.model.new_int_var(0, wait.most, "")
    here = board.any_of(literals)
    board.model.add(counted == wait.variable).only_enforce_if(here)
    board.model.add(counted == 0).only_enforce_if(here.negated())
    return counted
