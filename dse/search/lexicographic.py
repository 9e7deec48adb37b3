"""The best point in some regions: one objective first, then the sum of the others, and what the solver says of it."""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.evaluate import Evaluator
from dse.encode.linear import EXACT_LIMIT
from dse.encode.model import EncodedObjective, EncodedSpace
from dse.search.referee import accepted, may_refuse
from dse.search.regions import (
    Bound,
    capped,
    strictly_inside,
)
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, Unfinished
from dse.space.model.space import Design
from dse.support.errors import RefereeError


def counted(objectives: tuple[EncodedObjective, ...], steps: Bound) -> Bound:
    """Solver steps to counted (minimised) objectives.

    Integers in counting units, entries to be maximised with a negative sign.
    """
    return tuple(item.offset + item.step * value for item, value in zip(objectives, steps, strict=True))


def signed(evaluator: Evaluator, values: Bound) -> tuple[int, ...]:
    """Minimised values back to the objectives' own sense.

    Integers in counting units, as results show them.
    """
    senses = [objective.sense for objective in evaluator.space.objectives]
    return tuple(-value if sense == "maximise" else value for value, sense in zip(values, senses, strict=True))


def claimed_by(evaluator: Evaluator, encoded: EncodedSpace, steps: Bound) -> tuple[int, ...]:
    """The objectives that the solver claims for a design, each in its own sense.

    The referee compares them with the analysis of the design.
    """
    return signed(evaluator, counted(encoded.objectives, steps))


def minimise_in(
    strategy: Strategy, evaluator: Evaluator, regions: tuple[Bound, ...], axis: int, hint: Design | None
) -> Answer:
    """The best point in some regions: the least of objective `axis`, then of the sum of the others.

    A design that exact comparison refuses (see `Measure.rounded`) is excluded, and the question asked again. Where no
    limit is rounded there is none, and the referee sees each point once, with its canonical design.

    Raises
    ------
    RefereeError
        when the solver's point lies in none of the regions, or the analysis refuses its design for another reason.
    """
    is_refereed = may_refuse(evaluator)
    while True:
        answer = _lexicographic(strategy, regions, axis, hint)
        if isinstance(answer, Unfinished) and answer.best is not None and is_refereed:
            if accepted(evaluator, answer.best.design, claimed_by(evaluator, strategy.encoded, answer.best.point)):
                return answer
            strategy.exclude(answer.best.design)
            return Unfinished(answer.bound)
        if not isinstance(answer, Found):
            return answer
        if not any(strictly_inside(answer.point, region) for region in regions):
            raise RefereeError(f"the solver's point {answer.point} is not within {' or '.join(map(str, regions))}")
        if not is_refereed or accepted(evaluator, answer.design, claimed_by(evaluator, strategy.encoded, answer.point)):
            return answer
        strategy.exclude(answer.design)


def _lexicographic(strategy: Strategy, regions: tuple[Bound, ...], axis: int, hint: Design | None) -> Answer:
    """One call with a weight that puts `axis` first; where that leaves exact arithmetic two calls, or one an axis."""
    most = [max(bounds) - 1 for bounds in zip(*regions, strict=True)]
    if not most:
        return strategy.minimise([], regions, hint=hint)
    others = sum(most) - most[axis]
    weight = others + 1
    if weight * most[axis] + others < EXACT_LIMIT:
        return strategy.minimise(
            [weight if position == axis else 1 for position in range(len(most))], regions, hint=hint
        )
    tightened: Sequence[Bound] = regions
    rest = [position for position in range(len(most)) if position != axis]
    for first in (axis, *rest) if others >= EXACT_LIMIT else (axis,):
        answer = strategy.minimise([int(position == first) for position in range(len(most))], tightened, hint=hint)
        if not isinstance(answer, Found):
            return answer
        least, hint = tuple(value + 1 for value in answer.point), answer.design
        tightened = [capped(region, first, least) for region in tightened]
    if others >= EXACT_LIMIT:
        return answer
    return strategy.minimise([int(position != axis) for position in range(len(most))], tightened, hint=hint)
