"""How far a requirement must move, alone, for the others to leave a design: the exact limit, and the design.

Every step asks for a design that meets a limit strictly tighter than what the last one needs; the answer is exact
because the last question is refuted, whatever the units and capacities (a share of a processor whose cores are open,
one core for each thread).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from dse.analysis.limits import build_limit, excess, thread_loads
from dse.analysis.views import View
from dse.pareto.feasibility import find_design
from dse.space.types import Design, Requirement, Space
from dse.spec.expressions import Operator
from dse.units import Quantity


@dataclass(frozen=True)
class Closest:
    """The limit, in coherent units as `Requirement.limit`, at which `witness` just meets the requirement.

    For ``<`` and ``>`` the limit must lie beyond it. `thread` names the thread that needs it by itself, on one core.
    """

    limit: Fraction
    witness: Design
    thread: str = ""


def closest_limit(
    rest: Space, requirement: Requirement, *, seed: int = 0, deadline: float | None = None
) -> Closest | None:
    """The limit nearest to the requirement's own at which it holds in a design of `rest`; None where there is none.

    None as well for ``utilisation ==``, whose two sides cannot be asked for without the limit of one core.

    Raises
    ------
    OutOfTime
        when there is no answer by the deadline.
    """
    if requirement.operator != "==":
        return _extreme(rest, requirement, seed, deadline)
    if requirement.metric.kind == "utilisation":
        return None
    sides = []
    directions: tuple[tuple[Operator, Operator], ...] = ((">=", "<="), ("<=", ">="))
    for beyond, back in directions:
        side = replace(rest, requirements=(*rest.requirements, replace(requirement, operator=beyond)))
        found = _extreme(side, replace(requirement, operator=back), seed, deadline)
        if found is not None:
            sides.append(found)
    return min(sides, key=lambda item: abs(item.limit - requirement.limit.value), default=None)


def needed_limit(space: Space, requirement: Requirement, design: Design) -> tuple[Fraction, str]:
    """The limit at which a design just meets a requirement, were it not strict, and the thread that alone needs it."""
    view = View(design)
    one = build_limit(space, _limited(requirement, Fraction(1)))
    needed, thread = one.measure.value(view) / one.bound(view), ""
    if one.each is not None:
        for name, terms in thread_loads(one.measure.terms).items():
            alone = sum((term.value(view) for term in terms), Fraction(0)) / one.each
            if alone > needed:
                needed, thread = alone, name
    return needed, thread


def _extreme(rest: Space, requirement: Requirement, seed: int, deadline: float | None) -> Closest | None:
    """The least limit for ``<=`` and ``<``, the greatest for ``>=`` and ``>``."""
    strictly: Operator = "<" if requirement.operator in ("<=", "<") else ">"
    best: Closest | None = None
    tight, asked = requirement, rest
    while True:
        measure = excess(rest, build_limit(rest, tight))
        design = find_design(asked, measure, seed=seed, deadline=deadline)
        if design is None:
            return best
        limit, thread = needed_limit(rest, requirement, design)
        assert best is None or limit != best.limit, "a tighter limit was met by a design that needs the same"
        best = Closest(limit, design, thread)
        tight = replace(_limited(requirement, limit), operator=strictly)
        asked = replace(rest, requirements=(*rest.requirements, tight))


def _limited(requirement: Requirement, limit: Fraction) -> Requirement:
    return replace(requirement, limit=Quantity(limit, requirement.limit.dimension, requirement.limit.unit))
