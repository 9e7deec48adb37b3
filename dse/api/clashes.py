"""The conflicts of an infeasible problem as a result lists them."""

from __future__ import annotations

import time

from dse.api.explain import Explainer, Wishes
from dse.api.problem import Problem
from dse.results.explain import Relaxation
from dse.results.points import Clash, Conflict


def conflicts_of(asked: Problem, wishes: Wishes) -> tuple[tuple[Conflict, ...], tuple[Clash, ...]]:
    """The minimal conflicts of an infeasible problem as a result has them: each member with its closest limit.

    Where no member alone mends the problem, also the fewest that do together. Figures for which there was no
    time are left out.
    """
    explainer = Explainer.of(asked, wishes, time.monotonic(), is_brief=True)
    found = explainer.explanation()
    alone = {(item.demand.text, item.demand.origin): item for item in found.relaxations}
    conflicts = []
    for conflict in found.conflicts:
        clashes = []
        for demand, _ in conflict.members:
            item = alone.get((demand.text, demand.origin))
            clashes.append(_clash(item) if item is not None else Clash(demand.text, demand.origin, is_sought=False))
        conflicts.append(Conflict(tuple(clashes), conflict.by_waiting))
    together = found.give_up.members if found.give_up and not any(item.helps for item in found.relaxations) else ()
    return tuple(conflicts), tuple(_clash(item) for item in together)


def _clash(item: Relaxation) -> Clash:
    if item.demand.kind != "requirement":
        return Clash(item.demand.text, item.demand.origin)
    return Clash(
        item.demand.text,
        item.demand.origin,
        item.unit,
        item.limit,
        item.closest,
        item.thread,
        item.unbounded,
        item.is_sought,
        item.overload,
    )
