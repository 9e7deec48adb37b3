"""Where longer response times are nowhere an advantage: a search then takes them as long as they are at least."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

from dse.analysis.terms import Term
from dse.space.cores import is_scheduled, is_shortest
from dse.space.criteria import Metric
from dse.space.metric_kinds import parts_of
from dse.space.types import Space


def is_upward(space: Space) -> bool:
    """Whether a longer response time is nowhere an advantage: then it is enough that open terms are not too low."""
    asked = [(item.metric, int(item.operator in ("<=", "<"))) for item in space.requirements]
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
