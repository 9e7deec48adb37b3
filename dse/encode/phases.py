"""Sampling on one clock for the solver: what is left of a difference of offsets after whole steps, as one variable.

A wait is (o_j - o_i + shift) mod g, for offsets o on a grid: o_j - o_i + shift = g * q + wait, 0 <= wait < g, with
integers q and wait. Both sides are counted in the greatest common divisor of all offsets, the shift and g, so that
there are as few values as there are. The same pair, shift and g is one variable, whatever uses it. What is left of it
beyond a time (of readers that may begin late) is one variable more.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import gcd, lcm
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.measures import Measure, Term
from dse.analysis.terms import Phased, Rest
from dse.encode.linear import Board, Form, Given, check_exact
from dse.records import dataclass
from dse.space.trees import at, leaves
from dse.units import Exact


def phased_form(board: Board, measure: Measure, term: Term, given: Given) -> Form:
    """base[case] * case + times * wait, where the case is; a product with a literal where waits differ by case."""
    assert term.phased is not None
    phased, scale = term.phased, measure.scale
    cases = board.cases(phased.parts, given)
    named = board.named(cases, given)
    form = board.form((literal, _whole(base * scale)) for literal, (base, _) in named)
    where: dict[Rest, list[Any]] = {}
    for literal, (_, rests) in named:
        for rest in rests:
            where.setdefault(replace(rest, shift=rest.shift % rest.step), []).append(literal)
    for rest, literals in where.items():
        times, wait = rest.times, _wait(board, phased, rest)
        if not wait.most:
            continue
        variable = wait.variable if len(literals) == len(named) else _where(board, wait, literals)
        factor = _whole(times * scale * wait.unit_ns)
        form.add(Form(0, {variable.index: factor}, min(0, factor * wait.most), max(0, factor * wait.most)))
    return form


def _whole(value: Fraction) -> int:
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
        board.phases[key] = _beyond(board, phased, rest) if rest.less else _made(board, phased, rest.shift, rest.step)
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


def _made(board: Board, phased: Phased, shift: Exact, step: Exact) -> Wait:
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
