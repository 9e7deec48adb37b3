"""`dse solve --robust`: the front of the designs whose requirements hold for all stated values of their inputs.

Requirements are first demanded at the nominal figures; the designs of that front that are robust are on the robust
front too. What only the others dominated is searched again with demands at corners
(`dse.questions.robust.corner_demands`), until every design found is proved robust over the whole box: a robust design
meets every demand, so that none is ever lost. What was refuted on the way stays refuted, so that a search that is
stopped goes on where it was.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Unpack

from dse.answers.ranking.order import ranked_by
from dse.answers.result import Result
from dse.answers.robust import RobustResult
from dse.questions.complete_design import baseline_design
from dse.questions.front_verdicts import with_verdicts
from dse.questions.problem import Problem, Source, load
from dse.questions.question import Question
from dse.questions.robust.corner_demands import RobustQuestion
from dse.questions.verbs.solve import result_of
from dse.search.certificate import narrowed
from dse.search.front import FrontSearch, Progress, SearchLimits, Watch, search_front
from dse.search.referee import checked
from dse.space.model.space import Design
from dse.support import arguments
from dse.support.timelimit import OutOfTime, TimeLimit, look_at_the_clock, until


@dataclass(frozen=True)
class RobustWatcher:
    """Callbacks of a robust search: `progress` after every solver call, `checkpoint` with the result so far.

    Both are called from the process that searches; None where nobody listens.
    """

    progress: Callable[[Progress], None] | None = None
    checkpoint: Callable[[RobustResult], None] | None = None


@dataclass(frozen=True)
class RobustSearch:
    """The state of a robust search: the searches for the nominal front and for the robust front.

    Written to a result file when a search stops, and read by `resume`.
    """

    nominal: FrontSearch
    robust: FrontSearch


@arguments.checked(
    also=Question.__annotations__,
    time_limit_s=arguments.span,
    seed=arguments.SEED,
    workers=arguments.Whole(1, 64),
    progress=arguments.call,
)
def solve_robust(
    problem: Source,
    *,
    time_limit_s: arguments.Span | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[Progress], None] | None = None,
    **question: Unpack[Question],
) -> RobustResult:
    """The nominal front, the front of the designs that hold for all stated uncertainty, and what the difference costs.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result; it states `uncertainty`.
    time_limit_s
        seconds for both fronts together.
    seed, workers, progress
        as for `dse.solve`.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file, or an uncertainty that it states, is wrong.
    UsageError
        when nothing is stated, an input has no bounds, or nothing can be proved of a requirement over the stated
        ranges.

    Examples
    --------
    >>> import dse, pathlib
    >>> text = pathlib.Path("pump.yaml").read_text(encoding="utf-8")
    >>> text += "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}"
    >>> found = dse.solve_robust(text)
    >>> len(found.robust.front), len(found.nominal.front), found.failures
    (4, 4, ())
    """
    budget = SearchLimits(arguments.time_limit(time_limit_s), seed, workers)
    with until(budget.limit.for_the_last_steps()):
        asked = load(problem).ask(**question)
    return robust_asked(asked, budget, RobustWatcher(progress))


def robust_asked(problem: Problem, budget: SearchLimits, watcher: RobustWatcher | None = None) -> RobustResult:
    """Both fronts of the question of a problem as it stands; errors as for `solve_robust`.

    A `RobustResult` with both fronts, and what robustness costs in each objective. `budget` limits time, seed and
    workers of both searches together.
    """
    return solve_question(RobustQuestion(problem), budget, watcher or RobustWatcher())


def solve_question(
    question: RobustQuestion, budget: SearchLimits, watcher: RobustWatcher, earlier: RobustSearch | None = None
) -> RobustResult:
    """Search the robust front of a question, or go on with an earlier search of it; see `solve_robust`.

    With `earlier` nothing that was proved is proved again. The nominal front is searched first; its designs are the
    first candidates of the robust one.
    """
    return _RobustRun(question, budget, watcher).run(earlier)


@dataclass
class _RobustRun:
    """One robust search."""

    question: RobustQuestion
    budget: SearchLimits
    watcher: RobustWatcher

    def __post_init__(self) -> None:
        self.is_looked_at = False
        self.started = time.monotonic()
        self.limit = self.budget.limit
        self.senses = [item.sense for item in self.question.space.objectives]

    def run(self, earlier: RobustSearch | None) -> RobustResult:
        """Both fronts, as far as time suffices."""
        if earlier is not None:
            with until(self.limit):
                nominal = checked(self.question.nominal(), earlier.nominal)
                earlier = RobustSearch(nominal, checked(self.question.evaluator(), earlier.robust))
        if earlier is not None and _has_ended(earlier.nominal):
            nominal = earlier.nominal
        else:
            half = self.limit.at_most(self.limit.left_s / 2)
            nominal = self._search(earlier.nominal if earlier is not None else None, half, is_nominal=True)
        robust = earlier.robust if earlier is not None else self._narrowed(nominal)
        with suppress(OutOfTime), until(self.limit):
            for design in (*nominal.points.values(), *robust.points.values()):
                self.question.expect(design)
        robust = self._robust(nominal, robust)
        result = self._result(nominal, robust)
        judged = with_verdicts(result.robust, started=self.started, limit=self.limit)
        wall_s = round(time.monotonic() - self.started, 3)
        return replace(result, robust=replace(judged, search=replace(judged.search, wall_s=wall_s)))

    def _robust(self, nominal: FrontSearch, known: FrontSearch) -> FrontSearch:
        """Search what is open, until all that is found is robust, or time is up."""
        interrupted, is_open = nominal.interrupted, not _has_ended(known)
        while is_open and not interrupted and not self.limit.is_over:
            search = self._search(known, self.limit, nominal)
            known, interrupted = self._narrowed(search), search.interrupted
            if not search.is_complete:
                break
            for design in search.points.values():
                if self.question.is_judged(design):
                    self.question.learn(design)
            is_open = not known.is_complete
        return replace(known, interrupted=interrupted)

    def _search(
        self,
        earlier: FrontSearch | None,
        limit: TimeLimit,
        nominal: FrontSearch | None = None,
        *,
        is_nominal: bool = False,
    ) -> FrontSearch:
        """The front of the designs that meet what is demanded so far."""
        write = self.watcher.checkpoint

        def checkpoint(state: FrontSearch) -> None:
            if is_nominal:
                self._look_ahead(state)
            if write is not None:
                write(self._result(nominal or state, self._narrowed(state), under_way=True))

        evaluator = self.question.nominal() if is_nominal else self.question.evaluator()
        start = baseline_design(self.question.space) if is_nominal else None
        watch = Watch(self.watcher.progress, checkpoint if is_nominal or write is not None else None)
        return search_front(evaluator, replace(self.budget, limit=limit), watch, earlier, start)

    def _look_ahead(self, state: FrontSearch) -> None:
        """Judge the first design that is found before the search goes on: what cannot be proved is refused there.

        Raises
        ------
        UsageError
            when nothing can be proved of a requirement over the stated ranges.
        """
        if not self.is_looked_at:
            for design in list(state.points.values())[:1]:
                with suppress(OutOfTime), until(self.limit):
                    self.question.expect(design)
                self.is_looked_at = True

    def _narrowed(self, search: FrontSearch) -> FrontSearch:
        """What a search found, its designs that are not proved robust left out."""
        with until(self.limit.for_what_is_needed()):
            return narrowed(search, self.senses, self._keeps)

    def _keeps(self, design: Design) -> bool:
        """Whether it is proved, as far as there is time, that a design is robust."""
        try:
            look_at_the_clock()
            return self.question.is_robust(design)
        except OutOfTime:
            return False

    def _result(self, nominal: FrontSearch, robust: FrontSearch, *, under_way: bool = False) -> RobustResult:
        """What both searches amount to; while they are under way nothing is said of what is not robust."""
        asked, question = self.question.inputs.problem, self.question
        fronts: list[Result] = []
        for search, is_robust in ((nominal, False), (robust, True)):
            evaluator = question.evaluator() if is_robust else question.nominal()
            result = result_of(replace(asked, robust=is_robust), evaluator, search, self.budget, under_way=under_way)
            fronts.append(result if under_way else ranked_by(result, "ideal"))
        judged = [point for point in fronts[0].front if not under_way and question.is_judged(point.design)]
        failures = tuple(failure for point in judged for failure in question.failures(point.id, point.design))
        unjudged = tuple(point.id for point in fronts[0].front if point not in judged)
        return RobustResult(fronts[1], fronts[0], question.words, len(question.demands), failures, unjudged)


def _has_ended(search: FrontSearch) -> bool:
    """Whether the front is proved, and each point has the first of its designs."""
    return search.is_complete and not search.not_first
