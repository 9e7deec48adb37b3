"""Limits on response times in the second proof: what a refused solution teaches the second model.

Such a limit depends on whatever shares a core, so that no diagram holds it. The model does without at first, and the
analysis judges each of its solutions. Where threads are late, other cores are tried (they change nothing else); where
that is in vain, the model learns which threads cannot share a core: in any order (`orders.py`), or in this one
(`reasons.py`).
"""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.evaluate import Evaluation, Evaluator
from dse.analysis.limits import Limit, judge
from dse.analysis.placement.heuristics import placements
from dse.analysis.views import View
from dse.space.model.space import Design, Space
from dse.space.question.open_cores import decided_cores
from dse.verification.scheduling.orders import free_orders, order_lessons
from dse.verification.scheduling.reasons import Lesson, late_lesson


def is_late_limit(limit: Limit) -> bool:
    """Whether a limit is an upper one on a response time for which threads wait."""
    return limit.requirement.is_deadline and any(term.ends is not None for term in limit.measure.terms)


def on_other_cores(
    evaluator: Evaluator, late: Sequence[Limit], refused: Evaluation, held: int | None = None
) -> Evaluation | None:
    """The design with cores on which the analysis accepts it, with the same objectives; None where none is found.

    The option of the decision `held` stays.
    """
    space = evaluator.space
    kept = {*space.fixed, held}
    open_ = [item for item in decided_cores(space) if item.index not in kept]
    orders = [item for item in free_orders(space) if item.index != held]
    design = tuple(max(option, 0) for option in refused.design)
    if space.has_open_groups:
        return None
    beside = [limit for limit in evaluator.limits if limit.cores is not None]
    for other in placements(space, design, open_, late, orders, beside) if open_ or orders else ():
        found = evaluator.evaluate(other)
        if found.is_feasible and found.objectives == refused.objectives:
            return found
    return None


def lessons_of(space: Space, late: Sequence[Limit], design: Design, limits: Sequence[Limit] = ()) -> list[Lesson]:
    """The lessons of the late threads of a design: in any order, with these `limits`, or in this one."""
    view = View(design)
    found = list(order_lessons(space, limits, design))
    return found or [late_lesson(space, limit, design) for limit in late if not judge(limit, view).holds]
