"""After a proof of infeasibility: which requirement stands in the way, and by how much, when the others hold."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Verdict, build_limit, excess, judge
from dse.analysis.views import View
from dse.encode.model import encode
from dse.pareto.subproblem import Found, Solver
from dse.space.types import Objective, Requirement, Rule, Space

MOST_TOGETHER = 3


@dataclass(frozen=True)
class Miss:
    """What must give together: requirements or rules, and for each requirement its verdict on the design that comes closest.

    Each verdict is on a design that meets everything but the members of the miss (None for a rule).
    """

    members: tuple[Requirement | Rule, ...]
    verdicts: tuple[Verdict | None, ...]


def nearest_misses(space: Space, *, seed: int = 0, deadline: float | None = None) -> tuple[Miss, ...]:
    """Every requirement and rule that alone makes the space infeasible, with the closest value of the requirements.

    Where none does alone, the first smallest set (up to three) whose removal leaves a design. Empty when even that does not
    help, or time runs out. Every answer is a design that the analysis has checked, or a solver's proof.
    """
    singles = tuple(_alone(space, seed, deadline))
    if singles:
        return singles
    members: list[Requirement | Rule] = [*space.requirements, *space.rules]
    for count in range(2, MOST_TOGETHER + 1):
        for group in combinations(members, count):
            if deadline is not None and time.monotonic() > deadline:
                return ()
            rest = _without(space, group)
            if _design_exists(rest, seed, deadline):
                return (Miss(group, tuple(_verdict(rest, member, seed, deadline) for member in group)),)
    return ()


def _alone(space: Space, seed: int, deadline: float | None) -> Iterator[Miss]:
    for requirement in space.requirements:
        verdict = _closest(_without(space, (requirement,)), requirement, seed, deadline)
        if verdict is not None:
            yield Miss((requirement,), (verdict,))
    for rule in space.rules:
        if _design_exists(_without(space, (rule,)), seed, deadline):
            yield Miss((rule,), (None,))


def _verdict(rest: Space, member: Requirement | Rule, seed: int, deadline: float | None) -> Verdict | None:
    return None if isinstance(member, Rule) else _closest(rest, member, seed, deadline)


def _without(space: Space, members: tuple[Requirement | Rule, ...]) -> Space:
    return replace(
        space,
        requirements=tuple(item for item in space.requirements if item not in members),
        rules=tuple(item for item in space.rules if item not in members),
        objectives=(),
    )


def _design_exists(space: Space, seed: int, deadline: float | None) -> bool:
    evaluator = Evaluator(space)
    return _best(evaluator, seed, deadline) is not None


def _best(evaluator: Evaluator, seed: int, deadline: float | None) -> View | None:
    """The design that is best in the evaluator's only objective (any design when it has none), or None."""
    encoded = encode(evaluator)
    solver = Solver(encoded, seed=seed, deadline=deadline)
    count = len(encoded.objectives)
    answer = solver.minimise([1] * count, [objective.size for objective in encoded.objectives])
    if not isinstance(answer, Found):
        return None
    assert evaluator.evaluate(answer.design).is_feasible or any(item.measure.rounded for item in evaluator.limits)
    return View(answer.design)


def _closest(rest: Space, requirement: Requirement, seed: int, deadline: float | None) -> Verdict | None:
    """The verdict on the design of `rest` that breaks `requirement` least; None when there is no design."""
    limit = build_limit(rest, requirement)
    measure = excess(rest, limit)
    asked = replace(rest, objectives=(Objective(requirement.text, "minimise", measure.metric),))
    view = _best(Evaluator(asked, (measure,)), seed, deadline)
    return None if view is None else judge(limit, view)
