"""Requirements that no design can meet, by the bounds of their figures alone: found without a search.

Each summand of a metric counts with the least (or most) that it has in any design, whatever the others need; a response
time counts as long as its job takes alone. What is found is certain, and much else may be impossible.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from functools import partial
from math import ceil, floor
from typing import Literal, TypeVar

from dse.analysis.limits import HOLDS, Limit, build_limit
from dse.analysis.terms import Measure, Term
from dse.analysis.views import View, tabulate
from dse.records import dataclass
from dse.space.criteria import Requirement
from dse.space.types import Space
from dse.timelimit import OutOfTime

MANY_CASES = 1_000
"""A summand that depends on more combinations of options than this counts as 0 at least, and has no known maximum."""
SUMS_OF_SUMS = ("derived", "max", "min")
"""Metrics whose summands may be below 0."""
Side = Literal["least", "most"]
T = TypeVar("T")


@dataclass(frozen=True)
class Impossible:
    """A requirement whose figure is at least (or at most, as `side` says) `value`, against `limit`, in `unit`."""

    requirement: Requirement
    side: Side
    value: Fraction
    limit: Fraction
    unit: str


def impossible(space: Space, requirements: Iterable[Requirement]) -> Iterator[Impossible]:
    """Those of some requirements that no design meets, as far as bounds show it, with both figures."""
    for requirement in requirements:
        limit = build_limit(space, requirement)
        sides: tuple[tuple[Side, str], ...] = (("least", "<"), ("most", ">"))
        for side, direction in sides:
            if requirement.operator[0] in (direction, "="):
                found = _beyond(space, limit, side, requirement.operator)
                if found is not None:
                    yield Impossible(requirement, side, *found, limit.measure.unit)
                    break


def _beyond(space: Space, limit: Limit, side: Side, operator: str) -> tuple[Fraction, Fraction] | None:
    """The bound of the figure and the limit, where no design keeps it; None where one may."""
    compare = HOLDS[{"==": "<=" if side == "least" else ">="}.get(operator, operator)]
    pick = min if side == "least" else max
    terms = limit.measure.terms
    if (
        len(terms) == 1 and terms[0].extreme is None
    ):  # a figure and its limit may hang on the same decision: together they say more
        [term] = terms
        pairs = _cases(space, lambda view: (_end(term, side, view), limit.bound(view)))
        if pairs is None or any(compare(value, bound) for value, bound in pairs):
            return None
        return pick(pairs, key=lambda pair: pair[0] - pair[1], default=None)
    value = _total(space, terms, side, nonnegative=limit.measure.metric.kind not in SUMS_OF_SUMS)
    bounds = _cases(space, limit.bound)
    if not bounds or value is None:
        return None
    furthest = max(bounds) if side == "least" else min(bounds)
    return None if compare(value, furthest) else (value, furthest)


def best_possible(space: Space, measure: Measure, sense: str) -> int | None:
    """What no design is better than, as `Measure.integer` counts; None where that is not known, or not in time."""
    side: Side = "least" if sense == "minimise" else "most"
    nonnegative = measure.metric.kind not in SUMS_OF_SUMS
    try:
        total = _total(space, measure.terms, side, nonnegative=nonnegative)
    except OutOfTime:
        return 0 if nonnegative and side == "least" else None
    if total is None:
        return None
    if side == "least":
        return ceil(total * measure.scale)  # what is rounded is rounded up
    return floor(total * measure.scale) + (_summands(measure.terms) if measure.rounded else 0)


def _summands(terms: Iterable[Term]) -> int:
    """How many figures are rounded up one by one in a sum."""
    return sum(1 if term.extreme is None else sum(map(_summands, term.extreme.sums)) for term in terms)


def largest(space: Space, measure: Measure) -> Fraction | None:
    """A figure that no design exceeds, by its absolute value, in units of 1 / `scale`; None where that is not known."""
    found = _largest(space, measure.terms)
    return None if found is None else measure.scale * found


def _largest(space: Space, terms: Iterable[Term]) -> Fraction | None:
    total = Fraction(0)
    for term in terms:
        if term.extreme is not None:
            totals = [_largest(space, inner) for inner in term.extreme.sums]
            if None in totals:
                return None
            total += max(one for one in totals if one is not None)
            continue

        def ends(view: View, term: Term = term) -> tuple[Fraction, Fraction]:
            return _end(term, "least", view), _end(term, "most", view)

        pairs = _cases(space, ends)
        if pairs is None:
            return None
        total += max((abs(end) for pair in pairs for end in pair), default=Fraction(0))
    return total


def _total(space: Space, terms: Iterable[Term], side: Side, *, nonnegative: bool = False) -> Fraction | None:
    """The least or most that a sum may have, each summand for itself; None where that is not known."""
    ends = [_bound(space, term, side, nonnegative=nonnegative) for term in terms]
    return None if None in ends else sum((end for end in ends if end is not None), Fraction(0))


def _bound(space: Space, term: Term, side: Side, *, nonnegative: bool) -> Fraction | None:
    """The least or most that a summand has in any design; None where that is not known."""
    if term.extreme is not None:
        totals = [_total(space, terms, side) for terms in term.extreme.sums]
        found: Fraction | None = None if None in totals else term.extreme.pick(totals)
        return found
    values = _cases(space, partial(_end, term, side))
    if values:
        return min(values) if side == "least" else max(values)
    return Fraction(0) if nonnegative and side == "least" else None


def _end(term: Term, side: Side, view: View) -> Fraction:
    """A summand, or the end of what it may be where it holds a response time."""
    if term.ends is None:
        return term.value(view)
    return term.ends(view)[0 if side == "least" else 1]


def _cases(space: Space, formula: Callable[[View], T]) -> list[T] | None:
    cases = tabulate(space, formula, MANY_CASES)
    return None if cases is None else [case.value for case in cases]
