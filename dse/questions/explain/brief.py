"""The conflicts of an infeasible problem as a result lists them."""

from __future__ import annotations

import time
from collections.abc import Iterator

from dse.answers.explanation import Explanation, Relaxation
from dse.answers.result import Clash, Conflict
from dse.questions.explain.explain import Explainer, Wishes
from dse.questions.problem import Problem
from dse.support.timelimit import OutOfTime


def conflicts_of(asked: Problem, wishes: Wishes) -> tuple[tuple[Conflict, ...], tuple[Clash, ...]]:
    """The minimal conflicts of an infeasible problem as a result has them: each member with its closest limit.

    Where no member alone mends the problem, also the fewest statements that do together: a limit of every flow is one.
    Figures for which there was no
    time are left out.
    """
    explainer = Explainer.of(asked, wishes, time.monotonic(), is_brief=True)
    explanation = explainer.explanation()
    alone = {(item.demand.text, item.demand.origin): item for item in _alone(explainer, explanation)}
    conflicts = []
    for conflict in explanation.conflicts:
        clashes = []
        for demand, _ in conflict.members:
            item = alone.get((demand.text, demand.origin))
            clashes.append(_clash(item) if item is not None else Clash(demand.text, demand.origin, is_sought=False))
        conflicts.append(Conflict(tuple(clashes), conflict.by_waiting))
    together = (
        explanation.give_up.members if explanation.give_up and not any(item.helps for item in alone.values()) else ()
    )
    return tuple(conflicts), tuple(_clash(item) for item in together)


def _alone(explainer: Explainer, explanation: Explanation) -> Iterator[Relaxation]:
    """The relaxation of each member of a conflict alone: by how much its limit has to move for a design to exist.

    That is told, too, of a member that the file demands together with others in one statement.
    """
    members = explainer.oracle.members
    named = {demand for conflict in explanation.conflicts for demand, _ in conflict.members}
    for item in explanation.relaxations:
        if not item.together:
            yield item
            continue
        for number, member in enumerate(members):
            if member.text in item.together and explainer.designs.demand(number) in named:
                try:
                    yield explainer.relaxation((number,), frozenset({number}))
                except OutOfTime:
                    return


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
