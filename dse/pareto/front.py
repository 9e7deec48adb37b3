"""The complete Pareto front, by search zones: each solver call finds a non-dominated point or refutes a region.

In a zone one objective is minimised first and the sum of the others next; what that minimum leaves below itself is
refuted by the same call. The search ends when no zone is left, and only then is the front called complete. Every design
passes the referee (`Evaluator`), which computes its figures without the solver.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from dse.analysis.evaluate import Evaluator
from dse.encode.forms import EXACT_LIMIT
from dse.encode.model import EncodedObjective, EncodedSpace, encode
from dse.errors import RefereeError
from dse.pareto.canonical import canonical_design
from dse.pareto.subproblem import Answer, Found, NoSuchDesign, Solver, Unfinished
from dse.pareto.zones import Bound, SearchRegion
from dse.space.types import Design


@dataclass(frozen=True)
class Progress:
    """Where the search stands."""

    points: int
    open_regions: int
    calls: int
    elapsed_s: float


@dataclass(frozen=True)
class FrontSearch:
    """What a search found and proved.

    `points` maps objective vectors (counted, as `Measure.integer` gives them) to designs. `unexplored` are the regions
    still open and `refuted` those proved empty: exclusive upper bounds in the same units, minimised objectives
    (maximised ones negated).
    """

    points: dict[tuple[int, ...], Design]
    unexplored: tuple[Bound, ...]
    refuted: tuple[Bound, ...]
    calls: int
    elapsed_s: float

    @property
    def is_complete(self) -> bool:
        """Whether every region was refuted or is dominated."""
        return not self.unexplored


@dataclass(frozen=True)
class Budget:
    """How long, with which seed, on how many solver workers."""

    time_limit_s: float | None = None
    seed: int = 0
    workers: int = 1


def search_front(
    evaluator: Evaluator, budget: Budget | None = None, progress: Callable[[Progress], None] | None = None
) -> FrontSearch:
    """All non-dominated points of the evaluator's space, each with its canonical design.

    Ctrl-C and the time limit end the search early: the points found so far are non-dominated all the same, and the open
    regions say where more may lie.

    Raises
    ------
    RefereeError
        when the solver's figures and the analysis disagree.
    """
    budget = budget or Budget()
    started = time.monotonic()
    deadline = None if budget.time_limit_s is None else started + budget.time_limit_s
    encoded = encode(evaluator)
    solver = Solver(encoded, seed=budget.seed, workers=budget.workers, deadline=deadline)
    objectives = encoded.objectives
    region = SearchRegion(tuple(objective.size + 1 for objective in objectives))
    designs: dict[Bound, Design] = {}
    hint: Design | None = None
    while region.open:
        zone, axis = region.next_zone()
        answer = _minimise_in(solver, evaluator, zone, axis, hint)
        if isinstance(answer, Unfinished):
            break
        if isinstance(answer, NoSuchDesign):
            region.refute(zone)
        else:
            point, hint = answer.point, answer.design
            designs[point] = answer.design
            region.refute((*zone[:axis], point[axis], *zone[axis + 1 :]))
            region.cut(point)
        if progress is not None:
            progress(Progress(len(designs), len(region.open), solver.calls, time.monotonic() - started))
    points = {}
    for point in sorted(designs):
        design = canonical_design(solver, point, designs[point]) or designs[point]
        points[_signed(evaluator, counted(objectives, point))] = _refereed(evaluator, encoded, design, point).design
    return FrontSearch(
        points=points,
        unexplored=tuple(sorted(counted(objectives, zone) for zone in region.open)),
        refuted=tuple(sorted(counted(objectives, box) for box in region.refuted)),
        calls=solver.calls,
        elapsed_s=time.monotonic() - started,
    )


def counted(objectives: tuple[EncodedObjective, ...], steps: Bound) -> Bound:
    """Solver steps to counted (minimised) objectives."""
    return tuple(item.offset + item.step * value for item, value in zip(objectives, steps, strict=True))


def _signed(evaluator: Evaluator, values: Bound) -> tuple[int, ...]:
    """Minimised values back to the objectives' own sense."""
    senses = [objective.sense for objective in evaluator.space.objectives]
    return tuple(-value if sense == "maximise" else value for value, sense in zip(values, senses, strict=True))


def _minimise_in(solver: Solver, evaluator: Evaluator, zone: Bound, axis: int, hint: Design | None) -> Answer:
    """The best point in a zone: the least of objective `axis`, then of the sum of the others.

    A design that exact comparison refuses (see `Measure.rounded`) is excluded, and the question asked again.
    """
    upper = [bound - 1 for bound in zone]
    while True:
        answer = _lexicographic(solver, upper, axis, hint)
        if not isinstance(answer, Found) or _is_exactly_feasible(evaluator, answer.design):
            return answer
        exclude(solver.encoded, answer.design)


def _lexicographic(solver: Solver, upper: list[int], axis: int, hint: Design | None) -> Answer:
    """One call with a weight that puts `axis` first, or two calls where that weight would leave exact arithmetic."""
    others = sum(high for position, high in enumerate(upper) if position != axis)
    weight = others + 1
    weights = [weight if position == axis else 1 for position in range(len(upper))]
    if weight * upper[axis] + others < EXACT_LIMIT:
        return solver.minimise(weights, upper, hint=hint)
    first = solver.minimise([int(position == axis) for position in range(len(upper))], upper, hint=hint)
    if not isinstance(first, Found):
        return first
    tightened = [first.point[axis] if position == axis else high for position, high in enumerate(upper)]
    return solver.minimise([int(position != axis) for position in range(len(upper))], tightened, hint=first.design)


def exclude(encoded: EncodedSpace, design: Design) -> None:
    """Forbid one design: at least one decision differs."""
    literals = [
        encoded.options[index][option].negated()
        for index, option in enumerate(design)
        if option >= 0 and len(encoded.options[index]) > 1
    ]
    encoded.model.add_bool_or(literals)


def _is_exactly_feasible(evaluator: Evaluator, design: Design) -> bool:
    """Whether the referee accepts the design; only a rounded measure's limit may be a reason not to."""
    evaluation = evaluator.evaluate(design)
    rounded = {limit.requirement for limit in evaluator.limits if limit.measure.rounded}
    broken = {verdict.requirement for verdict in evaluation.verdicts if not verdict.holds}
    if evaluation.breaches or broken - rounded:
        reasons = [*evaluation.breaches, *(item.text for item in broken)]
        raise RefereeError(f"the solver's design is refused by the analysis: {'; '.join(reasons)}")
    return not broken


def _refereed(evaluator: Evaluator, encoded: EncodedSpace, design: Design, point: Bound) -> Found:
    """The design, after the analysis has recomputed its objectives and requirements."""
    evaluation = evaluator.evaluate(design)
    claimed = _signed(evaluator, counted(encoded.objectives, point))
    if not evaluation.is_feasible or evaluation.objectives != claimed:
        raise RefereeError(f"the solver claims {claimed}, the analysis finds {evaluation}")
    return Found(point, evaluation.design)
