"""Cores on which designs of a front without waiting meet every requirement, or a proof that there are none.

All decisions of a design are held but those on cores and best orders. One model serves all designs: what it learns of
the threads that cannot share a core holds for each of them, and the options that refute one design refute each other
one that has them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from math import inf
from typing import TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace, encode
from dse.search.referee import accepted
from dse.search.solver.settings import BARE, sound_solver
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found, Unfinished
from dse.search.workers import heard
from dse.space.model.space import Design
from dse.support.timelimit import OutOfTime, in_force

Options: TypeAlias = frozenset[tuple[int, int]]
"""Decisions, each with an option."""
WORK_AT_REASON = 0.05
"""The most work at the reason why a design holds on no cores: it takes a tenth as a rule."""
MOST_IDLE = 4
"""After so many reasons in a row that refute no other design there are no more."""


class OtherCores:
    """Looks for cores of designs one after the other; the model is made for the first of them.

    `evaluator` is of a question without objectives that counts response times and has every core as a decision, `free`
    are the decisions that may change. `most_work` is the work (`dse.search.solver.settings`) at all designs together.
    """

    def __init__(self, evaluator: Evaluator, free: frozenset[int], *, most_work: float = inf) -> None:
        self.evaluator, self.free, self.work_left = evaluator, free, most_work
        self._encoded: EncodedSpace | None = None
        self._refuted: list[Options] = []
        self._idle = 0

    def holding(self, design: Design) -> Design | None:
        """The design on cores where it meets every requirement; None where it is proved that there are none.

        `design` has an option for each decision of the space; those of the `free` decisions do not matter.

        Raises
        ------
        OutOfTime
            when the limit of time in force is up, or the work is done.
        RefereeError
            when the analysis refuses the solver's design.
        """
        options = frozenset(
            (index, option) for index, option in enumerate(design) if index not in self.free and option >= 0
        )
        if any(reason <= options for reason in self._refuted):
            self._idle = 0
            return None
        if self.work_left <= 0:
            raise OutOfTime
        if self._encoded is None:
            self._encoded = encode(self.evaluator)
        encoded = self._encoded
        strategy = Strategy(encoded, deadline=in_force().deadline)
        strategy.most_work = self.work_left
        try:
            with _all_but(encoded, design, self.free):
                while True:
                    answer = heard(strategy, lambda: strategy.minimise((), [encoded.everywhere]))
                    if isinstance(answer, Unfinished):
                        raise OutOfTime
                    if not isinstance(answer, Found):
                        break
                    evaluation = accepted(self.evaluator, answer.design)
                    if evaluation is not None:
                        return evaluation.design
                    strategy.exclude(answer.design)  # within what rounding admits, but not exactly
        finally:
            self.work_left -= strategy.work
        if self._idle < MOST_IDLE:
            self._idle += 1
            self._refuted.append(self._reason(encoded, options))
        return None

    def _reason(self, encoded: EncodedSpace, options: Options) -> Options:
        """Some of the options of a design that holds on no cores, with which none does; all where that takes long."""
        literals = {encoded.options[index][option].index: (index, option) for index, option in options}
        model, solver = encoded.model, sound_solver()
        BARE.apply(solver.parameters, WORK_AT_REASON)
        solver.parameters.max_time_in_seconds = in_force().left_s
        model.add_assumptions([encoded.options[index][option] for index, option in options])
        try:
            is_refuted = solver.solve(model) == cp_model.INFEASIBLE
        finally:
            model.clear_assumptions()
        self.work_left -= solver.response_proto.deterministic_time
        reason = solver.response_proto.sufficient_assumptions_for_infeasibility if is_refuted else ()
        return frozenset(literals[literal] for literal in reason) or options


@contextmanager
def _all_but(encoded: EncodedSpace, design: Design, free: Collection[int]) -> Iterator[None]:
    """All options of a design are given, but those of the decisions that are `free`."""
    variables = encoded.model.proto.variables
    held = {
        literals[option].index: list(variables[literals[option].index].domain)
        for number, (literals, option) in enumerate(zip(encoded.options, design, strict=True))
        if option >= 0 and number not in free
    }
    for index in held:
        set_domain(variables[index], 1, 1)
    try:
        yield
    finally:
        for index, (low, high) in held.items():
            set_domain(variables[index], low, high)
