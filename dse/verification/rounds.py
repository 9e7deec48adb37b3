"""One question of the second proof, asked again with what its refused solutions have taught.

Each round begins with the way and the limit that answered the last one, and from its solution: of the time of a proof
on response times nine tenths went into attempts that the round before had made in vain (decision record 10).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ortools.sat.python import cp_model

from dse.space.model.space import Design
from dse.verification.solver_calls import Outcome, SolverWay, Ways, ask, attempted

MOVING = 0.1
"""Deterministic time for other cores of a solution whose threads wait longer than it says."""
MOST_MOVES = 20
"""The greatest number of such attempts, each with what was learnt from the one before."""
IS_HARD = 2
"""A question that took so many attempts of each way says which way to favour."""


class Favourite:
    """The way that answered the last hard question; it is tried first, the others for a quarter of its limit."""

    def __init__(self) -> None:
        self.way: SolverWay | None = None

    def turned(self, ways: Ways) -> Ways:
        """The ways, the favourite first."""
        first = ways.index(self.way) if self.way in ways else 0
        return [*ways[first:], *ways[:first]]

    def answered(self, ways: Ways, attempt: int) -> int:
        """Take note of which attempt answered; where the next round begins.

        An index into the ways; easy answers change nothing.
        """
        if attempt < IS_HARD * len(ways):
            return attempt
        self.way = ways[attempt % len(ways)]
        return attempt - attempt % len(ways)


class Rounds:
    """The rounds of one question.

    Parameters
    ----------
    ways, favourite
        how the solver is asked.
    keep
        demands of a model that everything but the cores of a design is as it was.
    """

    def __init__(self, ways: Ways, favourite: Favourite, keep: Callable[[cp_model.CpModel, Design], None]) -> None:
        self.ways, self.favourite, self.keep = ways, favourite, keep
        self._first = 0
        self._hint: Sequence[int] = ()
        self._kept: Design | None = None
        self._moves = 0

    def learnt(self, values: Design, solver: cp_model.CpSolver, *, may_move: bool) -> None:
        """A solution was refused, and the model knows why; with `may_move` other cores may do for it."""
        self._hint = tuple(solver.response_proto.solution)
        self._kept = (self._kept or values) if may_move else None

    def answer(
        self,
        model: cp_model.CpModel,
        deadline: float | None,
        is_refuted: Callable[[float], bool] | None,
        most: int | None = None,
    ) -> Outcome:
        """An answer of the solver to the model of the next round; unknown at the deadline, or after `most` attempts.

        The hint is the last solution, and some rounds keep its cores only.
        """
        size = min(len(self._hint), len(model.proto.variables))
        model.proto.solution_hint.vars.extend(range(size))
        model.proto.solution_hint.values.extend(self._hint[:size])
        if self._kept is not None and self._moves < MOST_MOVES:
            self._moves += 1
            held = model.clone()
            self.keep(held, self._kept)
            outcome = attempted(held, deadline, MOVING, ways=self.ways)
            if outcome[1] is not None:
                return outcome
        self._kept, self._moves = None, 0
        ways = self.favourite.turned(self.ways)
        outcome, attempt = ask(
            model, deadline, is_refuted, ways, self._first, is_favoured=self.favourite.way in self.ways, most=most
        )
        self._first = self.favourite.answered(ways, attempt)
        return outcome
