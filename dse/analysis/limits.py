"""Requirements as comparisons of exact sums: metric against limit, with the capacity of what is limited.

A ratio limits the utilisation of a processor by limit * cores, and each thread alone by the limit of one core
(docs/semantics.md, section 4.2); it limits the load of a bus by limit * bandwidth
(docs/semantics.md, section 5.1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

from dse.analysis.measures import (
    PPM,
    SCALE_LIMIT,
    Measure,
    Term,
    build_measure,
    display_unit,
    exact_sum,
    scaled_term,
)
from dse.analysis.scheduling import UNBOUNDED_NS, deadline_ns
from dse.analysis.views import View, tabulate
from dse.space.metrics import metric_dimension
from dse.space.trees import at
from dse.space.types import Component, Requirement, Space
from dse.units import DIMENSIONLESS

MANY_CASES = 10_000

HOLDS: dict[str, Callable[[Fraction, Fraction], bool]] = {
    "<=": lambda value, limit: value <= limit,
    "<": lambda value, limit: value < limit,
    ">=": lambda value, limit: value >= limit,
    ">": lambda value, limit: value > limit,
    "==": lambda value, limit: value == limit,
    "!=": lambda value, limit: value != limit,
}


@dataclass(frozen=True)
class Limit:
    """A requirement ready to evaluate: the sum of `measure` against `bound`, both in the measure's unit.

    `each` is the limit that every single term of the measure must keep too (a thread cannot use more than one core), or
    None. `is_elsewhere`: its figures are not those of the space that it limits, but of one with other inputs.
    """

    requirement: Requirement
    measure: Measure
    bound: Callable[[View], Fraction]
    each: Fraction | None = None
    is_elsewhere: bool = False


@dataclass(frozen=True)
class Verdict:
    """How a design meets a requirement: `value` and `limit` in `unit`; `slack` is negative when it is broken.

    `worst_term` names the thread that alone breaks the limit of one core, if one does.
    """

    requirement: Requirement
    value: Fraction
    limit: Fraction
    unit: str
    holds: bool
    worst_term: str = ""

    @property
    def slack(self) -> Fraction:
        """How far the value may still move towards the limit, in `unit`."""
        return self.limit - self.value if self.requirement.operator in ("<=", "<") else self.value - self.limit


def build_limit(space: Space, requirement: Requirement) -> Limit:
    """The limit of a resolved requirement.

    An empty slot uses nothing, and keeps every upper limit: its capacity counts as 1.
    """
    metric, quantity = requirement.metric, requirement.limit
    measure = build_measure(space, metric)
    if metric.kind == "utilisation":
        slot, per_core = space.processors[metric.index or 0], quantity.value * PPM
        each = per_core if requirement.operator in ("<=", "<") else None
        return Limit(requirement, measure, lambda view: per_core * (at(slot.cores, view) or 1), each)
    if metric.kind == "load" and quantity.dimension == DIMENSIONLESS:
        bus, share = space.buses[metric.index or 0], quantity.value / 8
        return Limit(requirement, measure, lambda view: share * (at(bus.bandwidth_bps, view) or 8))
    if metric.key == "deadline":
        thread = space.components[metric.index or 0]
        return Limit(requirement, measure, lambda view: Fraction(0) + _deadline_ns(space, thread, view))
    dimension = metric_dimension(space, metric)
    bound = quantity.value * (display_unit(dimension)[1] if dimension is not None else 1)
    return Limit(requirement, measure, lambda view: bound)


def _deadline_ns(space: Space, thread: Component, view: View) -> int:
    """The deadline of a thread as the designs have it; one without is never late.

    Where only stated deadlines count a thread without one has none, else its period.
    """
    found = at(thread.deadline_ns, view) if space.deadlines == "stated" else deadline_ns(thread, view)
    return UNBOUNDED_NS if found is None else found


def excess(space: Space, limit: Limit) -> Measure:
    """How far a design is beyond a limit, in the measure's unit: positive when broken. Leaves out the limit per thread.

    The sign is such that less is better for ``<=`` and ``<`` as well as for ``>=`` and ``>``.
    """
    sign = 1 if limit.requirement.operator in ("<=", "<", "==") else -1
    measure = limit.measure
    bounds = {limit_case.value for limit_case in tabulate(space, limit.bound, MANY_CASES) or []}
    scale = lcm(measure.scale, *(bound.denominator for bound in bounds))
    terms = [scaled_term(term, Fraction(sign)) for term in measure.terms]
    terms.append(Term("limit", lambda view: -sign * limit.bound(view)))
    too_fine = measure.rounded or scale > SCALE_LIMIT
    return Measure(measure.metric, measure.unit, tuple(terms), min(scale, SCALE_LIMIT), rounded=too_fine)


def thread_loads(terms: tuple[Term, ...]) -> dict[str, list[Term]]:
    """Utilisation terms by thread: a hybrid thread's callback and timer together."""
    grouped: dict[str, list[Term]] = {}
    for term in terms:
        grouped.setdefault(term.component, []).append(term)
    return grouped


def judge(limit: Limit, view: View) -> Verdict:
    """The verdict on a design."""
    requirement, measure = limit.requirement, limit.measure
    value, bound = measure.value(view), limit.bound(view)
    compare = HOLDS[requirement.operator]
    holds, worst = compare(value, bound), ""
    if limit.each is not None:
        for name, terms in thread_loads(measure.terms).items():
            if not compare(exact_sum(term.value(view) for term in terms), limit.each):
                holds, worst = False, worst or name
    return Verdict(requirement, value, bound, measure.unit, holds, worst)
