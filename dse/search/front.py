"""The complete Pareto front, by search regions: each solver call finds a non-dominated point or refutes a region.

In a region one objective is minimised first and the sum of the others next; what that minimum leaves below itself is
refuted by the same call. The search ends when no region is left, and only then is the front called complete. Every
design passes the referee (`Evaluator`), which computes its figures without the solver.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

from dse.analysis.bounds import best_possible
from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.encode.model import EncodedSpace, encode
from dse.search import tuning as tuned
from dse.search.canonical import InOrder, canonical_design
from dse.search.certificate import ANYTHING, FrontSearch, ObjectiveScale
from dse.search.lexicographic import claimed_by, counted, minimise_in, signed
from dse.search.referee import accepted, checked, confirmed, may_refuse
from dse.search.regions import (
    Bound,
    Question,
    RefutedRegions,
    SearchRegions,
    capped,
    local_upper_bounds,
    strictly_inside,
)
from dse.search.solver.bounding import waiting_axes
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from dse.search.tuning import Tuning
from dse.search.workers import Pace, StrategyPool, stop_on_interrupt
from dse.space.model.space import Design
from dse.support.timelimit import NEVER, OutOfTime, TimeLimit, until

__all__ = ["ANYTHING", "SearchLimits", "FrontSearch", "Progress", "Watch", "search_front"]

CHAIN = 16
"""The number of points in a row that get their canonical designs one from another, whatever the number of workers."""
HELP_AFTER_S = 0.5
"""After how long further solvers join: a small problem is done before they are ready."""
MOST_CERTIFYING = 20_000
"""A certificate with more regions than this is left as the search made it."""


@dataclass(frozen=True)
class Progress:
    """The state of a search, as a callback of `dse.solve` gets it after every solver call.

    `points` found so far, regions of the objective space that are open, solver calls, and the seconds since the start.
    An `open_regions` of 0 means that the front is complete.
    """

    points: int
    open_regions: int
    calls: int
    elapsed_s: float


@dataclass(frozen=True)
class SearchLimits:
    """Until when, with which seed, on how many regions at the same time, and with which heuristics (all by default).

    `workers` is the number of regions that are searched at once; the front does not depend on it.
    """

    limit: TimeLimit = NEVER
    seed: int = 0
    workers: int = 1
    tuning: Tuning | None = None


@dataclass(frozen=True)
class Watch:
    """The callbacks of a search: `progress` after every call, `checkpoint` now and then with the state so far.

    The points of that state are as the solver claims them; the referee sees those that the search ends with.
    """

    progress: Callable[[Progress], None] | None = None
    checkpoint: Callable[[FrontSearch], None] | None = None


@dataclass
class _State:
    """A search under way: counted in steps above each objective's offset."""

    evaluator: Evaluator
    encoded: EncodedSpace
    regions: SearchRegions
    started: float
    limit: TimeLimit
    pool: StrategyPool[Question, Answer] = field(default_factory=StrategyPool)
    designs: dict[Bound, Design] = field(default_factory=dict)
    first: set[Bound] = field(default_factory=set)
    bare: dict[Design, Design] = field(default_factory=dict)
    incumbent: Found | None = None
    hint: Design | None = None
    calls_before: int = 0
    interrupted: bool = False
    untaught: EncodedSpace | None = None
    """The model as it was before it learnt from solutions, where it does and canonical designs may depend on that."""

    def interrupt(self) -> None:
        """Stop on Ctrl-C: the running calls end, and no others begin."""
        self.interrupted = True
        self.pool.stop()

    def take(self, question: Question, answer: Answer) -> None:
        """Update the regions by an answer of the solver."""
        regions, axis = question
        if isinstance(answer, NoSuchDesign):
            for region in regions:
                self.regions.refute(region)
        elif isinstance(answer, Found):
            self.hint = answer.design
            self.designs.setdefault(answer.point, answer.design)
            for region in regions:
                self.regions.refute(capped(region, axis, answer.point))
            self.regions.cut(answer.point)
        elif answer.best is not None and not self.designs:
            self.incumbent = answer.best

    def start_from(self, design: Design) -> None:
        """Take a design for an incumbent, if it meets what is required."""
        evaluation = self.evaluator.evaluate(design)
        if evaluation.is_feasible:
            point = self.frame.in_steps(signed(self.evaluator, evaluation.objectives))
            self.incumbent, self.hint = Found(point, evaluation.design), evaluation.design

    def progress(self) -> Progress:
        """The state of a search, as a callback of `dse.solve` gets it after every solver call.

        `points` found so far, regions of the objective space that are open, solver calls, and the seconds since the
        start. An `open_regions` of 0 means that the front is complete.
        """
        elapsed = time.monotonic() - self.started
        return Progress(len(self.designs), len(self.regions.open), self.calls_before + self.pool.calls, elapsed)

    @cached_property
    def frame(self) -> ObjectiveScale:
        """The offset and step in which the search counts each objective."""
        objectives = self.encoded.objectives
        return ObjectiveScale(
            self.encoded.everywhere, tuple(item.offset for item in objectives), tuple(item.step for item in objectives)
        )

    @cached_property
    def waiting_axes(self) -> frozenset[int]:
        """The objectives that depend on how long threads wait."""
        return waiting_axes(self.encoded)

    def _come_across(self) -> Found | None:
        """A design that meets what is required, while nothing better is known."""
        known = [
            self.incumbent,
            *(() if may_refuse(self.evaluator) else (item.incumbent for item in self.pool.strategies)),
        ]
        return next((better for better in known if better is not None), None)

    def _bare(self, design: Design) -> Design:
        """The design without decisions that it does not use."""
        if design not in self.bare:
            self.bare[design] = canonical(self.evaluator.space, design)
        return self.bare[design]

    def snapshot(self, *, is_refereed: bool = True) -> FrontSearch:
        """The state in counted units, every point refereed unless it is only kept for the case that the run is lost."""
        objectives = self.encoded.objectives
        designs = self.designs
        if not designs and self.regions.open and (incumbent := self._come_across()) is not None:
            designs = {incumbent.point: incumbent.design}
        points = {}
        for point, design in sorted(designs.items()):
            claimed = claimed_by(self.evaluator, self.encoded, point)
            points[claimed] = confirmed(self.evaluator, design, claimed) if is_refereed else self._bare(design)
        regions = sorted(self.regions.open)
        return FrontSearch(
            points=points,
            unexplored=tuple(counted(objectives, region) for region in regions),
            refuted=tuple(sorted(counted(objectives, region) for region in self.regions.refuted)),
            calls=self.calls_before + self.pool.calls,
            elapsed_s=time.monotonic() - self.started,
            floors=tuple(counted(objectives, self.regions.refuted.floor(region)) for region in regions),
            not_first=frozenset(
                claimed_by(self.evaluator, self.encoded, point) for point in designs.keys() - self.first
            ),
            interrupted=self.interrupted,
            frame=self.frame,
        )


def search_front(
    evaluator: Evaluator,
    budget: SearchLimits | None = None,
    watch: Watch | None = None,
    earlier: FrontSearch | None = None,
    start: Design | None = None,
    encoded: EncodedSpace | None = None,
) -> FrontSearch:
    """All non-dominated points of the evaluator's space, each with its canonical design.

    Ctrl-C and the time limit end the search early: the points found so far are non-dominated all the same, and the open
    regions say where more may lie. `earlier` is the outcome of a stopped search of the same space, which is continued.
    `start` is a design to start from, such as today's. Where the search is stopped before its first point, the best
    design that it has found is all there is: in an open region, and not proved to be non-dominated. `encoded` is
    the model of the space, where there is one already.

    Raises
    ------
    RefereeError
        when the solver's figures and the analysis disagree.
    UsageError
        when `earlier` is not the outcome of a search of this space.
    OutOfTime
        when there was no time to look at the points of `earlier`.
    """
    budget, watch = budget or SearchLimits(), watch or Watch()
    tuning = budget.tuning or tuned.DEFAULT
    started = time.monotonic()
    with until(budget.limit):
        if earlier is not None:
            earlier = checked(evaluator, earlier)
        if start is not None:
            with suppress(OutOfTime):  # before the model is made: it is what there is where the time is too short
                evaluator.weigh(start)
        with suppress(OutOfTime):
            encoded = encoded if encoded is not None else encode(evaluator, tuning.model)
    if encoded is None:
        known = earlier or FrontSearch({}, (tuple(ANYTHING for _ in evaluator.objectives),), (), 0, 0.0)
        return replace(_started_from(evaluator, known, start, budget.limit), elapsed_s=time.monotonic() - started)
    state = _State(evaluator, encoded, SearchRegions(encoded.everywhere), started, budget.limit)
    # where the referee may refuse, canonical designs are the first of all, whatever a model has learnt
    is_untaught = encoded.learns and not encoded.has_messages and not may_refuse(evaluator)
    state.untaught = encoded.copy() if is_untaught else None
    if start is not None:
        with until(budget.limit.for_what_is_needed()), suppress(OutOfTime):
            state.start_from(start)
    if earlier is not None:
        _restore(state, earlier)
    state.pool.strategies.append(Strategy(encoded, seed=budget.seed, deadline=budget.limit.deadline, tuning=tuning))
    keep = _keeping(state, watch)
    with stop_on_interrupt(state.interrupt):
        _explore(state, budget, watch, keep)
        _make_canonical(state, keep)
    if not state.regions.open:
        regions = local_upper_bounds(encoded.everywhere, sorted(state.designs), MOST_CERTIFYING)
        state.regions.refuted = RefutedRegions(regions) if regions is not None else state.regions.refuted
    return state.snapshot()


def _keeping(state: _State, watch: Watch) -> Callable[[], None]:
    """Hands out the state of a search when it is time, so that little is lost with the run; the solvers work on."""
    pace, checkpoint = Pace(state.started), watch.checkpoint
    if checkpoint is None:
        return lambda: None
    return lambda: pace.keep(
        len(state.designs) + len(state.regions.open), lambda: checkpoint(state.snapshot(is_refereed=False))
    )


def _explore(state: _State, budget: SearchLimits, watch: Watch, keep: Callable[[], None]) -> None:
    """Search regions until none is open, or time is up; each solver of the pool has a region of its own."""
    pool, search = state.pool, state.regions
    while search.open and not pool.stopped:
        now = time.monotonic()
        if len(pool.strategies) == 1 < budget.workers and now - state.started > HELP_AFTER_S:
            pool.strategies += [_another(pool.strategies[0]) for _ in range(budget.workers - 1)]  # while it is idle
        for strategy in pool.idle:
            question = search.next_question(list(pool.busy.values()), strategy.most_regions, state.waiting_axes)
            if question is not None:
                job = partial(minimise_in, strategy, state.evaluator, *question, state.hint)
                pool.start(strategy, question, partial(_in_time, state, strategy, job))
        keep()
        question, answer = pool.wait(keep)
        if isinstance(answer, Unfinished):
            pool.stop()
        state.take(question, answer)
        if watch.progress is not None:
            watch.progress(state.progress())
    if search.open:
        pool.stop()
    for question, answer in pool.drain():
        state.take(question, answer)


def _in_time(state: _State, strategy: Strategy, job: Callable[[], Answer]) -> Answer:
    """The answer to a question, with all figures of the design where they are slow to find: all before time is up.

    Whatever the time ends, what was found is not lost.
    """
    try:
        answer = job()
        if isinstance(answer, Found) and state.evaluator.is_slow:
            state.evaluator.weigh(answer.design)
        return answer
    except OutOfTime:
        return Unfinished(best=strategy.incumbent)


def _another(strategy: Strategy) -> Strategy:
    """A strategy for a copy of the model as it stands; both share what is known of the parts of the space."""
    return Strategy(
        strategy.encoded.copy(),
        seed=strategy.seed,
        deadline=strategy.deadline,
        parts=strategy.parts,
        tuning=strategy.tuning,
    )


def _make_canonical(state: _State, keep: Callable[[], None]) -> None:
    """Replace each design by the canonical one of its point, unless the search was stopped."""
    if state.regions.open:
        return
    pool: StrategyPool[list[Bound], list[tuple[Design, bool]]] = StrategyPool(state.pool.strategies)
    limit = state.limit.for_the_last_steps()  # the front is proved; what is left makes the result reproducible
    for strategy in pool.strategies:
        strategy.deadline = limit.deadline
    points = sorted(state.designs)
    waiting = [points[start : start + CHAIN] for start in range(0, len(points), CHAIN)][::-1]
    order, is_known = InOrder(), False  # how it goes with the first chain, which the others wait for
    while waiting or pool.busy:
        for strategy in pool.idle:
            if waiting and (is_known or not pool.busy):
                chain = waiting.pop()
                known = [Found(point, state.designs[point]) for point in chain]
                if state.untaught is not None:  # what a search has learnt depends on its way
                    strategy.encoded = state.untaught.copy()
                way = order.elsewhere() if is_known else order
                pool.start(strategy, chain, partial(_canonical_designs, strategy, state.evaluator, known, way))
        keep()
        chain, designs = pool.wait(keep)
        is_known = True
        for point, (design, is_first) in zip(chain, designs, strict=True):
            state.designs[point] = design
            if is_first:
                state.first.add(point)


def _canonical_designs(
    strategy: Strategy, evaluator: Evaluator, chain: list[Found], order: InOrder
) -> list[tuple[Design, bool]]:
    """The canonical design of each point, and whether it is the first; each is looked for near the one before.

    Where time is up the design that is known stays.
    """
    designs: list[tuple[Design, bool]] = []
    for known in chain:
        try:
            accepted = _first_accepted(strategy, evaluator, known, designs[-1][0] if designs else None, order)
            if evaluator.is_slow:
                evaluator.weigh(accepted[0])
        except OutOfTime:
            accepted = known.design, False
        designs.append(accepted)
    return designs


def _restore(state: _State, earlier: FrontSearch) -> None:
    """Take up a stopped search: its points, refuted and open regions.

    Those of a wider question may be counted otherwise: then regions are those of the same designs here.

    Raises
    ------
    UsageError
        when the earlier outcome is not one of this space.
    """
    frame = state.frame
    everywhere = frame.counted(frame.everywhere)
    regions = [
        tuple(most if bound >= ANYTHING else bound for bound, most in zip(region, everywhere, strict=True))
        for region in earlier.unexplored
    ]
    if earlier.frame in (None, frame):
        state.regions.refuted = RefutedRegions(frame.in_steps(region) for region in earlier.refuted)
        state.regions.open = [frame.in_steps(region) for region in regions]
    else:
        state.regions.refuted = RefutedRegions(frame.held(earlier.refuted))
        state.regions.open = [region for region in frame.held(regions) if not state.regions.refuted.cover(region)]
    for vector, design in earlier.points.items():
        point = frame.in_steps(signed(state.evaluator, vector))
        if any(strictly_inside(point, region) for region in state.regions.open):  # found, but not proved
            state.incumbent, state.hint = Found(point, design), design
        else:
            state.designs[point] = design
    state.calls_before = earlier.calls


def _first_accepted(
    strategy: Strategy, evaluator: Evaluator, known: Found, near: Design | None, order: InOrder
) -> tuple[Design, bool]:
    """The canonical design of a point among those that exact comparison accepts; the known one when stopped.

    And whether it is the first of them in the order of the file.

    Where the search adds to the model as it goes, only the strictly first one is the same whatever way it went.
    """
    is_refereed = may_refuse(evaluator)
    while True:
        canonical = canonical_design(strategy, known, near, order, strictly=is_refereed)
        if canonical is None:
            return known.design, False
        if not is_refereed or accepted(evaluator, canonical[0], claimed_by(evaluator, strategy.encoded, known.point)):
            return canonical  # where no limit is rounded, the referee sees it with the others (`_State.snapshot`)
        strategy.exclude(canonical[0])


# What is known where the time was up before anything was searched: a design to start from, and bounds.


def _started_from(evaluator: Evaluator, known: FrontSearch, start: Design | None, limit: TimeLimit) -> FrontSearch:
    """The state before the search: the design to start from, if it is feasible, and lower bounds of the objectives."""
    if known.is_complete:
        return known
    known = replace(known, floors=_floors(evaluator, known, limit))
    if start is None or known.points:
        return known
    with until(limit.for_what_is_needed()), suppress(OutOfTime):
        evaluation = evaluator.evaluate(start)
        if evaluation.is_feasible:
            evaluator.weigh(start)
            return replace(
                known, points={evaluation.objectives: evaluation.design}, not_first=frozenset({evaluation.objectives})
            )
    return known


def _floors(evaluator: Evaluator, known: FrontSearch, limit: TimeLimit) -> tuple[Bound, ...]:
    """The least that each objective may have in each open region, by its summands; none where one has no bound."""
    with until(limit.for_the_last_steps()):
        pairs = list(zip(evaluator.objectives, evaluator.space.objectives, strict=True))
        ends = [best_possible(evaluator.space, measure, objective.sense) for measure, objective in pairs]
    if None in ends:
        return ()
    least = signed(evaluator, tuple(end for end in ends if end is not None))
    refuted = RefutedRegions(known.refuted)
    return tuple(refuted.floor(region, least) for region in known.unexplored)
