"""How far a requirement must move, alone, for the others to leave a design: the exact limit, and the design.

Every step asks for a design that meets a limit strictly tighter than what the last one needs; the answer is exact
because the last question is refuted, whatever the units and capacities (a share of a processor whose cores are open,
one core for each thread).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm

from dse.analysis.limits import Limit, excess, needed_share
from dse.analysis.measures import SCALE_LIMIT, Measure
from dse.analysis.rates import NS_PER_S
from dse.analysis.terms import ExtremeOfSums, extreme_term
from dse.analysis.views import View
from dse.search.feasibility.oracle import Oracle
from dse.space.model.criteria import Requirement
from dse.space.model.space import Design, Space
from dse.space.question.metrics import worst_of
from dse.spec.language.expressions import Operator
from dse.support.units import Quantity


@dataclass(frozen=True)
class Closest:
    """The limit, in coherent units as `Requirement.limit`, at which `witness` just meets the requirement.

    For ``<`` and ``>`` the limit must lie beyond it. `thread` names the thread that needs it by itself, or the core.
    """

    limit: Fraction
    witness: Design
    thread: str = ""


def closest_limit(
    oracle: Oracle, kept: frozenset[int], requirement: Requirement, *others: Requirement
) -> Closest | None:
    """The limit nearest to the requirement's own at which it holds together with members; None where there is none.

    With `others`, which one statement demands with the requirement, it is the one limit of all of them: they have its
    operator, which is not ``==``, and are of metrics of its kind. The limit of a deadline is how much later than its
    deadline the thread may end (its own limit is 0 ns).

    Raises
    ------
    OutOfTime
        when there is no answer by the deadline.
    """
    if requirement.metric.key == "deadline":
        return _latest(oracle, kept, requirement)
    if requirement.operator != "==":
        return _extreme(oracle, kept, (requirement, *others), ())
    sides = []
    directions: tuple[tuple[Operator, Operator], ...] = ((">=", "<="), ("<=", ">="))
    for beyond, back in directions:
        side = _total(oracle, replace(requirement, operator=beyond))
        extreme = _extreme(oracle, kept, (replace(requirement, operator=back),), (side,), of_total=True)
        if extreme is not None:
            sides.append(extreme)
    return min(sides, key=lambda item: abs(item.limit - requirement.limit.value), default=None)


def _total(oracle: Oracle, requirement: Requirement) -> Limit:
    """The limit of the sum alone, without that of one core for each thread (which ``==`` does not ask for)."""
    return replace(_built(oracle, requirement), cores=None)


def _built(oracle: Oracle, requirement: Requirement) -> Limit:
    return oracle.reading(oracle.space, requirement, is_asked=False)


def _latest(oracle: Oracle, kept: frozenset[int], requirement: Requirement) -> Closest | None:
    """The least by which the thread is late."""
    limit = oracle.reading(oracle.space, requirement)
    measure = excess(oracle.space, limit)
    design = oracle.find(kept, measure)
    if design is None:
        return None
    view = View(design)
    return Closest((limit.measure.value(view) - limit.bound(view)) / NS_PER_S, design)


def _needed_limit(
    oracle: Oracle, requirement: Requirement, design: Design, *, of_total: bool = False
) -> tuple[Fraction, str]:
    """The limit at which a design just meets a requirement, were it not strict, and who alone needs it."""
    view = View(design)
    one = oracle.reading(oracle.space, _limited(requirement, Fraction(1)))
    return needed_share(one, view, of_total=of_total)


def _extreme(
    oracle: Oracle,
    kept: frozenset[int],
    requirements: tuple[Requirement, ...],
    also: tuple[Limit, ...],
    *,
    of_total: bool = False,
) -> Closest | None:
    """The least limit of all requirements for ``<=`` and ``<``, the greatest for ``>=`` and ``>``."""
    is_upper = requirements[0].is_upper
    strictly: Operator = "<" if is_upper else ">"
    space, build = oracle.space, _total if of_total else _built
    best: Closest | None = None
    tight, limits_asked = tuple(build(oracle, item) for item in requirements), also
    while True:
        design = oracle.find(kept, _worst_excess(space, tight), limits_asked)
        if design is None:
            return best
        needed = [_needed_limit(oracle, item, design, of_total=of_total) for item in requirements]
        limit, thread = (max if is_upper else min)(needed, key=lambda item: item[0])
        if best is not None and limit == best.limit:  # a partition that is undecided keeps every limit
            return best
        best = Closest(limit, design, thread)
        tight = tuple(build(oracle, replace(_limited(item, limit), operator=strictly)) for item in requirements)
        limits_asked = (*also, *tight)


def _limited(requirement: Requirement, limit: Fraction) -> Requirement:
    return replace(requirement, limit=Quantity(limit, requirement.limit.dimension, requirement.limit.unit))


def _worst_excess(space: Space, limits: Sequence[Limit]) -> Measure:
    """How far a design is beyond the limit that it misses by most, in the unit of all measures; see `excess`."""
    measures = [excess(space, item) for item in limits]
    if len(measures) == 1:
        return measures[0]
    scale = lcm(*(item.scale if not item.rounded else SCALE_LIMIT + 1 for item in measures))
    metric = worst_of("excess", [item.metric for item in measures], "<=")
    term = extreme_term(metric.name, ExtremeOfSums("max", tuple(item.terms for item in measures)))
    return Measure(metric, measures[0].unit, (term,), min(scale, SCALE_LIMIT), rounded=scale > SCALE_LIMIT)
