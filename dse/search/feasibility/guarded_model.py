"""A space that is encoded once, whose demands are switched on and off from question to question.

Encoding takes most of the time of a question about feasibility; here each demand has a guard in the model, which a
question sets true or false. Which demands are asked for changes bounds of variables only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from math import inf

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit, Reading, build_limit, judge
from dse.analysis.measures import Measure
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.encode.linear import set_domain
from dse.encode.model import Demands
from dse.search.referee import refused
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found, Unfinished
from dse.search.workers import heard
from dse.space.model.space import Design, Space
from dse.support.timelimit import OutOfTime

ROUND = 1e-4
"""Work, for each variable of the model, of a round in which it learns from a design that the analysis refuses."""


@dataclass
class TimeLeft:
    """The common end of several questions: `at` by the monotonic clock, None without a limit, or after `work`.

    Work is deterministic time (`dse.search.solver.settings`), and a `ROUND` for each design that the model learns from.
    """

    at: float | None
    work: float = inf

    @property
    def is_over(self) -> bool:
        """Whether nothing is left."""
        return self.work <= 0 or (self.at is not None and time.monotonic() >= self.at)

    @contextmanager
    def worked(self, strategy: Strategy, most: float = inf) -> Iterator[None]:
        """A strategy at work with what is left, or with `most` of it; what it takes counts."""
        a_round = ROUND * (1 + len(strategy.encoded.model.proto.variables))
        strategy.most_work, strategy.most_rounds = min(most, self.work), self.work / a_round
        try:
            yield
        finally:
            self.work -= strategy.work + a_round * strategy.rounds


class Switchboard:
    """Answers which demands have a design together.

    Demands are numbered: requirements, rules, fixed decisions, each in the order of the space. Requirements are made
    limits by `reading`.
    """

    def __init__(self, space: Space, reading: Reading = build_limit) -> None:
        self.space = space
        self.evaluator = Evaluator(replace(space, fixed={}, objectives=()), reading=reading)
        self.structure = Evaluator(replace(space, fixed={}, objectives=(), requirements=(), rules=()))
        self.demands = Demands(self.evaluator, space.fixed)
        self.model = self.demands.board.model
        self.guards = [*self.demands.limits, *self.demands.rules]

    def find(
        self,
        kept: frozenset[int],
        measure: Measure | None = None,
        further: Sequence[Limit] = (),
        *,
        seed: int = 0,
        time_left: TimeLeft | None = None,
        most_work: float = inf,
    ) -> Design | None:
        """A design that meets the demands `kept` and further limits, or None where there is none.

        With `measure` it is one in which that is least, exactly so unless the measure is `rounded`.

        Raises
        ------
        OutOfTime
            when there is no answer in the time that is left, or with `most_work`.
        RefereeError
            when the analysis refuses the solver's design.
        """
        more = [(limit, self.demands.add_limit(limit)) for limit in further]
        encoded = self.demands.with_objective(measure)  # after all limits, so that it knows those on response times
        pairs = zip(self.evaluator.limits, self.demands.limits, strict=True)
        limits = [pair for number, pair in enumerate(pairs) if number in kept]
        if measure is None:
            encoded = replace(encoded, weigh=partial(self._weigh, [limit for limit, _ in (*limits, *more)]))
        self._switch(kept)
        ones = [1] * len(encoded.objectives)
        for _, guard in more:
            self._bound(guard, 1, 1)
        time_left = time_left or TimeLeft(None)
        strategy = Strategy(encoded, seed=seed, deadline=time_left.at)
        try:
            with time_left.worked(strategy, most_work):
                while True:
                    answer = heard(strategy, partial(strategy.minimise, ones, [encoded.everywhere]))
                    if isinstance(answer, Unfinished):
                        raise OutOfTime
                    if not isinstance(answer, Found):
                        return None
                    limits_asked = [*limits, *more]
                    broken = refused(self.structure, answer.design, [limit for limit, _ in limits_asked])
                    if not broken:
                        return canonical(self.space, answer.design)
                    for number in broken:  # within what rounding admits, but not exactly
                        strategy.exclude(answer.design, unless=[limits_asked[number][1].negated()])
        finally:
            for _, guard in more:
                self._bound(guard, 0, 0)

    def _weigh(self, limits: Sequence[Limit], design: Design) -> tuple[int, ...] | None:
        """The objectives of a design that meets the limits, of which there are none; None for other designs.

        Response times in a solution may be too low: that those of demands which are switched off are does not matter.
        """
        if self.structure.invalid(design):
            return None
        view = View(design)
        return () if all(judge(limit, view).holds for limit in limits) else None

    def _switch(self, kept: frozenset[int]) -> None:
        """Set the guards, and restrict fixed decisions to their options or free them."""
        for number, guard in enumerate(self.guards):
            self._bound(guard, int(number in kept), int(number in kept))
        for number, (decision, fixed) in enumerate(self.space.fixed.items(), start=len(self.guards)):
            literals = self.demands.board.options[decision]
            for option, literal in enumerate(literals if len(literals) > 1 else ()):
                self._bound(literal, 0, int(option == fixed or number not in kept))

    def _bound(self, variable: cp_model.IntVar, low: int, high: int) -> None:
        set_domain(self.model.proto.variables[variable.index], low, high)
