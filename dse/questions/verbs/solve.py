"""`dse.solve`: from a problem and a caller's changes to the proved, ranked front."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, Unpack

from dse.analysis.evaluate import Evaluator
from dse.answers.designs import Point
from dse.answers.ranking.order import ranked_by
from dse.answers.result import ObjectiveInfo, Result, Search, decisions_of, ranked
from dse.questions.complete_design import baseline_design
from dse.questions.front_verdicts import with_verdicts
from dse.questions.problem import Problem, Source, load, origin_of
from dse.questions.question import Question
from dse.search.front import ANYTHING, FrontSearch, Progress, SearchLimits, Watch, search_front
from dse.search.solver_answer import SOLVER
from dse.space.size import space_size
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.timelimit import until

EXPLANATION_TIME_S = 30.0


@arguments.checked(
    also=Question.__annotations__,
    time_limit_s=arguments.span,
    seed=arguments.SEED,
    workers=arguments.Whole(1, 64),
    progress=arguments.call,
)
def solve(
    problem: Source,
    *,
    time_limit_s: arguments.Span | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[Progress], None] | None = None,
    **question: Unpack[Question],
) -> Result:
    """The proven Pareto front of a problem.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    time_limit_s
        seconds of wall time for the search; then the front so far is returned as ``incomplete``.
    seed, workers
        of the solver, and how many regions are searched at the same time. The front does not depend on them.
    progress
        called after every solver call.
    question
        changes to the question, in the words of `Problem.ask`.

    Returns
    -------
    Result
        with status ``complete``, ``incomplete`` or ``infeasible``.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a limit, requirement, objective or decision is.

    Examples
    --------
    >>> import dse
    >>> result = dse.solve("pump.yaml")
    >>> result
    <Result of 'Pump': complete, 4 points>
    >>> result.front[0].objectives
    {'jitter of sensor_to_valve': 7078000, 'price': 24000}
    """
    limit = arguments.time_limit(time_limit_s)
    with until(limit.for_the_last_steps()):
        asked = load(problem).ask(**question)
    return solve_asked(asked, SearchLimits(limit, seed, workers), Watcher(progress))


@dataclass(frozen=True)
class Watcher:
    """Who is told how a solve goes.

    `progress` is called after every solver call, `checkpoint` now and then with the result so far (`Result.under_way`):
    every second, or as rarely as it takes to cost a few per cent of the time.
    """

    progress: Callable[[Progress], None] | None = None
    checkpoint: Callable[[Result], None] | None = None


def solve_asked(asked: Problem, budget: SearchLimits, watcher: Watcher, earlier: FrontSearch | None = None) -> Result:
    """Solve the question of a problem as it stands, or go on with an earlier search of it.

    A `Result` with status *complete*, *incomplete* (budget used up) or *infeasible*, then with conflicts. `watcher`
    gets progress and, where asked for, the result so far.

    Raises `UsageError` for a question without objectives.
    """
    started = time.monotonic()
    space = asked.space
    if not space.objectives:
        raise UsageError(
            'nothing to minimise: state `objectives` in the problem file, or give --minimise "price" or the like'
        )
    with until(budget.limit.for_the_last_steps()):
        evaluator = Evaluator(space)
        evaluator.find_metrics()
    searched = replace(budget, limit=budget.limit.sparing_for_the_answer())
    watch = Watch(watcher.progress)
    if watcher.checkpoint is not None:
        write = watcher.checkpoint
        watch = Watch(watcher.progress, lambda state: write(result_of(asked, evaluator, state, budget, under_way=True)))
    search = search_front(evaluator, searched, watch, earlier, baseline_design(space))
    result = result_of(asked, evaluator, search, budget)
    if result.status == "infeasible":
        from dse.questions.explain.brief import conflicts_of  # few results need it
        from dse.questions.explain.explain import Wishes

        left_s = EXPLANATION_TIME_S if budget.limit.seconds is None else budget.limit.left_s
        wishes = Wishes(time_limit_s=left_s, seed=budget.seed)
        conflicts, give_up = conflicts_of(asked, wishes)
        result = replace(result, conflicts=conflicts, give_up=give_up)
    result = with_verdicts(ranked_by(result, "ideal"), started=started, limit=budget.limit)
    return replace(result, search=replace(result.search, wall_s=round(time.monotonic() - started, 3)))


def result_of(
    asked: Problem, evaluator: Evaluator, search: FrontSearch, budget: SearchLimits, *, under_way: bool = False
) -> Result:
    """The result of a search, finished or not; brief for one that is `under_way`.

    Points are evaluated by the analysis and ranked, regions are stated in counting units. One that is `under_way` is
    the checkpoint of a search and leaves out what takes long to compute.
    """
    space = evaluator.space
    status: Literal["complete", "incomplete", "infeasible"] = "complete" if search.is_complete else "incomplete"
    return Result(
        problem=origin_of(asked),
        space=space,
        status="infeasible" if search.is_complete and not search.points else status,
        objectives=tuple(
            ObjectiveInfo(measure.metric.name, objective.sense, measure.counting_unit)
            for measure, objective in zip(evaluator.objectives, space.objectives, strict=True)
        ),
        counting_units=evaluator.counting_units,
        rounded=evaluator.rounded,
        front=_points(evaluator, search, under_way=under_way),
        unexplored=tuple(_region(evaluator, bound) for bound in search.unexplored),
        refuted=tuple(_region(evaluator, bound) for bound in search.refuted),
        potential=_potential(evaluator, search),
        conflicts=(),
        interrupted=search.interrupted,
        baseline=baseline_design(space),
        search=Search(
            solver_calls=search.calls,
            wall_s=round(search.elapsed_s, 3),
            space_size=space_size(space),
            solver=SOLVER,
            workers=budget.workers,
            seed=budget.seed,
        ),
        under_way=under_way,
    )


def _potential(evaluator: Evaluator, search: FrontSearch) -> Mapping[str, int]:
    """For each objective the best value that the unexplored regions may still hold, as far as it is proved."""
    if not search.floors:
        return {}
    return _region(evaluator, tuple(min(column) for column in zip(*search.floors, strict=True)))


def _points(evaluator: Evaluator, search: FrontSearch, *, under_way: bool) -> tuple[Point, ...]:
    """The points, ranked; those of a search that is under way as the solver claims them, without further figures.

    Where figures are slow to find they were found when the design was, and tell what is unbounded.
    """
    space = evaluator.space
    names = [measure.metric.name for measure in evaluator.objectives]
    is_claimed = under_way and not evaluator.is_slow
    points = [
        (vector if is_claimed else evaluator.evaluate(design).objectives, design)
        for vector, design in search.points.items()
    ]
    rows = ranked(points, [objective.sense for objective in space.objectives])
    return tuple(
        Point(
            id=number,
            rank=rank,
            objectives=dict(zip(names, vector, strict=True)),
            counts={} if under_way else evaluator.metric_values(design),
            counting_units=evaluator.counting_units,
            decisions=decisions_of(space, design),
            design=design,
            is_first=vector not in search.not_first,
        )
        for number, (rank, vector, design) in enumerate(rows, start=1)
    )


def _region(evaluator: Evaluator, bound: tuple[int, ...]) -> Mapping[str, int]:
    """A region as exclusive bounds by objective: below for what is minimised, above for what is maximised.

    An objective of which nothing is known has none.
    """
    senses = [objective.sense for objective in evaluator.space.objectives]
    names = [measure.metric.name for measure in evaluator.objectives]
    signed = zip(names, bound, senses, strict=True)
    return {name: -value if sense == "maximise" else value for name, value, sense in signed if value < ANYTHING}
