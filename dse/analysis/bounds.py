"""Requirements that no design can meet, by the bounds of their figures alone: found without a search.

Each summand of a metric counts with the least (or most) that it has in any design, whatever the others need; a response
time counts as long as its job takes alone. What is found is certain, and much else may be impossible.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import ceil, floor
from typing import Annotated, Literal, TypeVar

from dse.analysis.limits import HOLDS, Limit
from dse.analysis.terms import ZERO, Measure, Term
from dse.analysis.views import View, tabulate
from dse.space.model.criteria import Requirement
from dse.space.model.space import Space
from dse.support.json_fields import Of, Unit
from dse.support.timelimit import OutOfTime

MANY_CASES = 1_000
"""A summand that depends on more combinations of options than this counts as 0 at least, and has no known maximum."""
SUMS_OF_SUMS = ("derived", "max", "min")
"""Metrics whose summands may be below 0."""
TIMES = ("latency", "min latency", "jitter", "run jitter")
"""Metrics that are never below 0 themselves, though their summands may be: what one adds another may take off."""
Side = Literal["least", "most"]
T = TypeVar("T")


@dataclass(frozen=True)
class Contribution:
    """The contribution of one thread, connection or device to a figure.

    In the unit of the figure; parts of a bound add up to it.
    """

    name: Annotated[str, "Which."]
    value: Annotated[Fraction, "How much."]


@dataclass(frozen=True)
class Impossible:
    """A requirement that no design meets, as bounds alone show.

    Found by summing the least (or the greatest) of each summand over all options, which no design can fall below
    (exceed).
    """

    JSON_NAME = "Bound"
    WRITTEN = (
        Of("requirement.text", "In the words of the problem.", key="requirement", kind=str),
        Of("requirement.origin", "Where it stands.", kind=str),
        *("side", "value", "limit", "unit", "parts"),
    )

    requirement: Requirement
    side: Annotated[Side, "Whether `value` is the least or the most that any design can have."]
    value: Annotated[Fraction, "The bound."]
    limit: Annotated[Fraction, "The limit."]
    unit: Annotated[Unit, "What the figures count."]
    parts: Annotated[
        tuple[Contribution, ...], "Of a sum what each thread, connection or device adds to the bound, largest first."
    ] = ()


class Ends:
    """The range of each summand over all designs of a space, computed once for each term.

    The terms must stay alive while the object does: they are recognised by identity.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self._found: dict[int, tuple[Term, list[tuple[Fraction, Fraction]] | None]] = {}

    def of(self, term: Term) -> list[tuple[Fraction, Fraction]] | None:
        """The least and the most that a summand may be, case by case; None where that is not known.

        Pairs (least, most) in the unit of the term, one for each combination of the options that it consults; None
        beyond a limit on their number.
        """
        if id(term) not in self._found:
            self._found[id(term)] = term, _cases(self.space, partial(_both, term))
        return self._found[id(term)][1]


def _both(term: Term, view: View) -> tuple[Fraction, Fraction]:
    if term.ends is not None:
        return term.ends(view)
    value = term.value(view)
    return value, value


def impossible(limits: Iterable[Limit], ends: Ends) -> Iterator[Impossible]:
    """The requirements among `limits` that no design meets, as far as bounds show it, with both figures.

    `Impossible` objects with the bound and the limit. A requirement that is not listed may be infeasible all the same.
    """
    for limit in limits:
        requirement = limit.requirement
        sides: tuple[tuple[Side, str], ...] = (("least", "<"), ("most", ">"))
        for side, direction in sides:
            if requirement.operator[0] in (direction, "="):
                excess = _beyond(ends, limit, side, requirement.operator)
                if excess is not None:
                    parts = _parts(ends, limit, side)
                    is_all = sum((part.value for part in parts), ZERO) == excess[0]
                    yield Impossible(requirement, side, *excess, limit.measure.unit, parts if is_all else ())
                    break


def _parts(ends: Ends, limit: Limit, side: Side) -> tuple[Contribution, ...]:
    """The contributions to the bound of a sum, largest first; empty unless the range of every term is known."""
    by_label: dict[str, Fraction] = {}
    for term in limit.measure.terms:
        bound = _bound(ends, term, side, nonnegative=False)
        if bound is None or not term.label:
            return ()
        by_label[term.label] = by_label.get(term.label, ZERO) + bound
    parts = [Contribution(name, value) for name, value in by_label.items() if value]
    return tuple(sorted(parts, key=lambda part: -abs(part.value)))


def _beyond(ends: Ends, limit: Limit, side: Side, operator: str) -> tuple[Fraction, Fraction] | None:
    """The bound of the figure and the limit, where no design keeps it; None where one may."""
    compare = HOLDS[{"==": "<=" if side == "least" else ">="}.get(operator, operator)]
    pick = min if side == "least" else max
    terms = limit.measure.terms
    bounds = _cases(ends.space, limit.bound)
    if len(terms) == 1 and terms[0].extreme is None:
        pairs = _with_limit(ends, terms[0], side, limit, bounds)
        if pairs is None or any(compare(value, bound) for value, bound in pairs):
            return None
        return pick(pairs, key=lambda pair: pair[0] - pair[1], default=None)
    value = _total(ends, terms, side, nonnegative=limit.measure.metric.kind not in SUMS_OF_SUMS)
    if not bounds or value is None:
        return None
    furthest = max(bounds) if side == "least" else min(bounds)
    return None if compare(value, furthest) else (value, furthest)


def _with_limit(
    ends: Ends, term: Term, side: Side, limit: Limit, bounds: list[Fraction] | None
) -> list[tuple[Fraction, Fraction]] | None:
    """A figure and its limit, case by case: both may depend on the same decision."""
    if bounds is None or len(bounds) != 1:
        return _cases(ends.space, lambda view: (_end(term, side, view), limit.bound(view)))
    bounds_of_term = ends.of(term)
    return (
        None if bounds_of_term is None else [(pair[0 if side == "least" else 1], bounds[0]) for pair in bounds_of_term]
    )


def best_possible(space: Space, measure: Measure, sense: str) -> int | None:
    """A bound that no design improves on, as `Measure.integer` counts; None where none is known, or not in time.

    An integer in counting units, rounded to the safe side.
    """
    side: Side = "least" if sense == "minimise" else "most"
    nonnegative = measure.metric.kind not in SUMS_OF_SUMS
    try:
        total = _total(Ends(space), measure.terms, side, nonnegative=nonnegative)
    except OutOfTime:
        return 0 if nonnegative and side == "least" else None
    if total is None:
        return None
    if side == "least":
        total = max(total, ZERO) if measure.metric.kind in TIMES else total
        return ceil(total * measure.scale)  # what is rounded is rounded up
    return floor(total * measure.scale) + (_summands(measure.terms) if measure.rounded else 0)


def _summands(terms: Iterable[Term]) -> int:
    """How many figures are rounded up one by one in a sum."""
    return sum(1 if term.extreme is None else sum(map(_summands, term.extreme.sums)) for term in terms)


def largest(ends: Ends, measure: Measure) -> Fraction | None:
    """A figure that no design exceeds, by its absolute value, in units of 1 / `scale`; None where that is not known.

    Exact; used to see that sums fit into the solver's integers.
    """
    bound = _largest(ends, measure.terms)
    return None if bound is None else measure.scale * bound


def _largest(ends: Ends, terms: Iterable[Term]) -> Fraction | None:
    total = Fraction(0)
    for term in terms:
        if term.extreme is not None:
            totals = [_largest(ends, inner) for inner in term.extreme.sums]
            if None in totals:
                return None
            total += max(one for one in totals if one is not None)
            continue
        pairs = ends.of(term)
        if pairs is None:
            return None
        total += max((abs(end) for pair in pairs for end in pair), default=Fraction(0))
    return total


def _total(ends: Ends, terms: Iterable[Term], side: Side, *, nonnegative: bool = False) -> Fraction | None:
    """The least or most that a sum may have, each summand for itself; None where that is not known."""
    bounds = [_bound(ends, term, side, nonnegative=nonnegative) for term in terms]
    return None if None in bounds else sum((bound for bound in bounds if bound is not None), Fraction(0))


def _bound(ends: Ends, term: Term, side: Side, *, nonnegative: bool) -> Fraction | None:
    """The least or most that a summand has in any design; None where that is not known."""
    if term.extreme is not None:
        totals = [_total(ends, terms, side) for terms in term.extreme.sums]
        total: Fraction | None = None if None in totals else term.extreme.pick(totals)
        return total
    pairs = ends.of(term)
    if pairs:
        return min(least for least, _ in pairs) if side == "least" else max(most for _, most in pairs)
    return Fraction(0) if nonnegative and side == "least" else None


def _end(term: Term, side: Side, view: View) -> Fraction:
    """A summand, or the end of what it may be where it holds a response time."""
    if term.ends is None:
        return term.value(view)
    return term.ends(view)[0 if side == "least" else 1]


def _cases(space: Space, formula: Callable[[View], T]) -> list[T] | None:
    cases = tabulate(space, formula, MANY_CASES)
    return None if cases is None else [case.value for case in cases]
