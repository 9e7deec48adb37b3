"""Cores on which designs of a front without waiting meet every requirement, or a proof that there are none.

All decisions of a design are held but those on cores and best orders. One model serves all designs: what it learns of
the threads that cannot share a core holds for each of them.
"""

from __future__ import annotations

from math import inf

from dse.analysis.evaluate import Evaluator
from dse.encode.model import EncodedSpace, encode
from dse.search.referee import accepted
from dse.search.solver.large_neighbourhood import all_but
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Found, Unfinished
from dse.search.workers import heard
from dse.space.model.space import INACTIVE, Design
from dse.support.timelimit import OutOfTime, in_force


class OtherCores:
    """Looks for cores of designs one after the other; the model is made for the first of them.

    `evaluator` is of a question without objectives that counts response times and has every core as a decision, `free`
    are the decisions that may change. `most_work` is the work (`dse.search.solver.settings`) at all designs together.
    """

    def __init__(self, evaluator: Evaluator, free: frozenset[int], *, most_work: float = inf) -> None:
        self.evaluator, self.free, self.work_left = evaluator, free, most_work
        self._encoded: EncodedSpace | None = None

    @property
    def is_over(self) -> bool:
        """Whether the work that all designs may take is done."""
        return self.work_left <= 0

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
        if self.is_over:
            raise OutOfTime
        if self._encoded is None:
            self._encoded = encode(self.evaluator)
        encoded = self._encoded
        strategy = Strategy(encoded, deadline=in_force().deadline)
        strategy.most_work = self.work_left
        held = tuple(INACTIVE if index in self.free else option for index, option in enumerate(design))
        try:
            with all_but(encoded, held, self.free):
                while True:
                    answer = heard(strategy, lambda: strategy.minimise((), [encoded.everywhere]))
                    if isinstance(answer, Unfinished):
                        raise OutOfTime
                    if not isinstance(answer, Found):
                        return None
                    evaluation = accepted(self.evaluator, answer.design)
                    if evaluation is not None:
                        return evaluation.design
                    strategy.exclude(answer.design)  # within what rounding admits, but not exactly
        finally:
            self.work_left -= strategy.work
