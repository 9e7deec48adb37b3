"""Other designs at or near a point of the front, chosen to differ from it and from one another.

Each call fixes (or bounds) the objectives and asks for the design whose smallest distance to those already there is
largest, the distance being the number of decisions that differ; a tie goes to the largest sum of distances. So the
first one is as far from the point's own design as any, and "there are no more" is a proof. One worker, one design to a
call: nothing is enumerated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.answers.ranking.core_numbering import numbered_like
from dse.encode.model import EncodedSpace, encode
from dse.search.referee import accepted
from dse.search.regions import Bound
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished
from dse.search.workers import heard
from dse.space.model.space import Design
from dse.support.errors import RefereeError
from dse.support.timelimit import OutOfTime

MOST_COPIES = 100
"""How many designs that differ by a swap of equal cores alone are passed over for one point."""


@dataclass(frozen=True)
class Neighbourhood:
    """The designs found, each with its objectives; `more` says whether there are others, None when stopped before.

    Designs with their objectives in counting units. `more` False is a proof.
    """

    designs: tuple[tuple[Design, tuple[int, ...]], ...]
    more: bool | None


class Finder:
    """Looks for further designs of one space; encodes it once, and copies the model for each point.

    `stop` ends the running question, and leaves all further ones unanswered.
    """

    def __init__(self, evaluator: Evaluator, *, seed: int = 0, deadline: float | None = None) -> None:
        self.evaluator = evaluator
        self.encoded = encode(evaluator)
        self.seed = seed
        self.deadline = deadline
        self.stopped = False
        self._running: Strategy | None = None

    def stop(self) -> None:
        """End the running question soon; it and all that follow answer that they were stopped.

        Called from another thread or a signal handler.
        """
        self.stopped = True
        if self._running is not None:
            self._running.stop()

    def near(
        self,
        objectives: Sequence[int],
        design: Design,
        count: int,
        within: Fraction = Fraction(0),
        besides: Sequence[Design] = (),
    ) -> Neighbourhood:
        """Up to `count` other designs whose objectives are each at most the share `within` worse than `objectives`.

        Parameters
        ----------
        objectives
            those of a point, in counting units; with `within` 0 exactly these are asked for, for a point of a proved
            front.
        design
            the point's own design.
        count
            how many to look for.
        besides
            designs that are known already and not wanted.
        """
        encoded = self.encoded.copy()
        upper = self._upper(objectives, within)
        lower = upper if not within else (0,) * len(upper)
        self._running = strategy = Strategy(encoded, seed=self.seed, deadline=self.deadline)
        if self.stopped:
            strategy.stop()
        for known in (design, *besides):
            strategy.exclude(known)
        spread, copies, known_designs = _Spread(encoded, [design]), 0, [design, *besides]
        designs: list[tuple[Design, tuple[int, ...]]] = []
        while True:
            strategy.set_box(lower, upper)
            encoded.model.clear_objective()
            encoded.model.maximize(spread.goal())
            try:
                answer = heard(strategy, self._weighed(strategy))
            except OutOfTime:
                answer = Unfinished()
            if isinstance(answer, NoSuchDesign):
                return Neighbourhood(tuple(designs), more=False)
            if not isinstance(answer, Found):
                return Neighbourhood(tuple(designs), more=None)
            evaluation = accepted(self.evaluator, answer.design)
            strategy.exclude(answer.design)
            if evaluation is None:
                continue
            if self._is_copy(evaluation.design, known_designs):
                copies += 1
                if copies > MOST_COPIES:
                    return Neighbourhood(tuple(designs), more=None)
                continue
            if not self._is_near(evaluation.objectives, objectives, within):
                raise RefereeError(f"the solver's design has other objectives than it claims: {evaluation}")
            if len(designs) == count:
                return Neighbourhood(tuple(designs), more=True)
            designs.append((evaluation.design, evaluation.objectives))
            known_designs.append(evaluation.design)
            spread.add(evaluation.design)

    def _is_copy(self, design: Design, known: Sequence[Design]) -> bool:
        """Whether a design differs from a known one by the numbers of equal cores alone."""
        return any(numbered_like(self.evaluator.space, design, other) == other for other in known)

    def _weighed(self, strategy: Strategy) -> Callable[[], Answer]:
        """A question that finds, with a design, all its figures, for as long as there is time."""

        def ask() -> Answer:
            answer = strategy.ask()
            if isinstance(answer, Found):
                self.evaluator.weigh(answer.design)
            return answer

        return ask

    def _upper(self, objectives: Sequence[int], within: Fraction) -> Bound:
        """The largest steps that keep each objective within the share of its own size."""
        bounds = []
        for value, objective, item in zip(
            objectives, self.evaluator.space.objectives, self.encoded.objectives, strict=True
        ):
            minimised = value if objective.sense == "minimise" else -value
            most = minimised + floor(abs(value) * within)
            bounds.append(min(item.size, (most - item.offset) // item.step))
        return tuple(bounds)

    def _is_near(self, values: Sequence[int], wanted: Sequence[int], within: Fraction) -> bool:
        for value, target, objective in zip(values, wanted, self.evaluator.space.objectives, strict=True):
            worse = value - target if objective.sense == "minimise" else target - value
            if worse > abs(target) * within or (not within and worse):
                return False
        return True


class _Spread:
    """How far a design is from those already there: the least distance first, then the sum."""

    def __init__(self, encoded: EncodedSpace, designs: Sequence[Design]) -> None:
        self.encoded = encoded
        moved = encoded.contention.moved if encoded.contention is not None else frozenset[int]()
        self.open = [
            index for index, literals in enumerate(encoded.options) if len(literals) > 1 and index not in moved
        ]
        self.least = encoded.model.new_int_var(0, len(self.open), "least distance")
        self.sums: list[Any] = []
        for design in designs:
            self.add(design)

    def add(self, design: Design) -> None:
        """A further design to keep away from."""
        distance = self._distance(design)
        self.encoded.model.add(self.least <= distance)
        self.sums.append(distance)

    def goal(self) -> Any:
        """The least distance, and the sum of all where that ties."""
        return self.least * (len(self.open) * len(self.sums) + 1) + cp_model.LinearExpr.sum(self.sums)

    def _distance(self, design: Design) -> Any:
        """The number of decisions that differ, an inactive one counting as an option of its own."""
        same = []
        for index in self.open:
            inactive = self.encoded.inactive[index]
            literal = inactive if design[index] < 0 else self.encoded.options[index][design[index]]
            if literal is not None:
                same.append(literal)
        return len(self.open) - cp_model.LinearExpr.sum(same)
