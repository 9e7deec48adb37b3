"""A question asked part by part, where it is too hard as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from dse.pareto.answer import Answer, Found, NoSuchDesign, Unfinished, weighted
from dse.pareto.grid import EVERY
from dse.pareto.parts import Part
from dse.pareto.regions import Bound
from dse.pareto.settings import (
    BARE,
    BRIEF,
    BUILDING,
    CUTTING,
    LOWEST,
    NARROWING,
    OPTIONS_FIRST,
    READING,
    RELAXED,
    WHOLE_BRIEFLY,
    Settings,
)

if TYPE_CHECKING:
    from dse.pareto.subproblem import Solver

APART_WAYS = (CUTTING, RELAXED, BARE)
"""The settings for parts for which that was not enough, in turn ..."""
PACKING_WAYS = (CUTTING, LOWEST, RELAXED)
"""... where threads have to end in time on cores that they share, ..."""
FULL_WAYS = (BUILDING, OPTIONS_FIRST)
"""... where these are so full that the model has rows of them: then its bounds are known to be good ..."""
APART_WORK = 1.5
"""... and designs are missing; with so much work in the first round, and twice as much in each further one."""
ALONE_WORK = 24.0
"""The same where threads wait for each other and no other part is left: nothing is won by asking anew."""
APART_CHEAP = 0.1
"""A part for which linear relaxation has needed less than this is asked with it at once the next time."""
MOST_MISSED_BRIEFLY = 4
"""A part that bare settings have left open so many times in a row is asked with linear relaxation at once."""
APART = 4
"""The factor by which questions are asked longer part by part than as a whole."""

WHOLE = -1
"""Stands for all parts together where misses are counted."""
MANY_PARTS = 12
"""With fewer parts than this reading them is not what a question costs."""
MANY_LEFT = 3
"""So many parts that no settings were tried on are asked for something better than a known design at once."""
MOST_MISSED_WHOLE = 2
"""Where the model has rows of cores, questions are asked part by part at once after so many misses as a whole."""


def as_a_whole(solver: Solver, weights: Sequence[int], regions: Sequence[Bound]) -> Answer | None:
    """The answer to a question about full cores that is easy enough to need no parts, each of which is read anew."""
    if len(solver.parts) < MANY_PARTS or solver.missed_briefly[WHOLE] >= MOST_MISSED_WHOLE:
        return None
    answer = solver.solve_in(regions, *WHOLE_BRIEFLY)
    if isinstance(answer, Unfinished):
        solver.missed_briefly[WHOLE] += 1
        return None
    solver.missed_briefly[WHOLE] = 0
    return answer


class Apart:
    """A question asked part by part: in rounds, those first whose bound leaves most room for something better.

    What is found in one part limits the others, and what earlier questions proved of a part may answer for it.
    """

    def __init__(self, solver: Solver, weights: Sequence[int], regions: Sequence[Bound]) -> None:
        self.solver = solver
        self.weights = weights
        self.regions = regions
        self.best = solver.parts.best(weights, regions)
        self._has_asked_rest = False

    @cached_property
    def waiting(self) -> list[tuple[int, int, int]]:
        """Turn, bound and number of each part that may hold something; most questions are answered as a whole."""
        return [
            (int(number in self.solver.relaxed_first), weighted(self.weights, part.floor(open_regions)), number)
            for number, part in enumerate(self.solver.parts.all)
            if (open_regions := part.open(self.regions))
        ]

    def attempt(self, work: float) -> Answer:
        """Go on for so much work, and more: what was done is not lost; with rows of cores to the end."""
        solver = self.solver
        end = solver.work + APART * work
        while self.waiting:
            turn, bound, number = self.waiting.pop(self.waiting.index(min(self.waiting)))
            if self.best is not None and bound >= weighted(self.weights, self.best.point):
                continue
            if turn == 0 and self._is_rest_worth_it() and self._ask_rest():
                break
            was_full = self._is_full
            answer = self._ask(number, turn, bound)
            solver.work += READING * len(solver.encoded.model.proto.variables)
            if isinstance(answer, Found):
                self.best = answer
            elif isinstance(answer, Unfinished):
                self.best = answer.best or self.best
                self.waiting.append((turn + 1, bound if answer.bound is None else max(bound, answer.bound), number))
                if self._is_full and not was_full:  # other settings are better from now on: their turns begin
                    self.waiting = [(min(turn, 1), bound, number) for turn, bound, number in self.waiting]
            if self.waiting and (solver.out_of_time() or (solver.work >= end and not self._is_full)):
                return Unfinished(best=self.best)
        return self.best or NoSuchDesign()

    def _is_rest_worth_it(self) -> bool:
        """Whether what is known limits parts that nothing was tried on, which are read once then, not one by one."""
        if self.best is None or self._has_asked_rest or self.solver.encoded.contention is not None:
            return False
        return sum(turn == 0 for turn, _, _ in self.waiting) + 1 >= MANY_LEFT

    def _ask_rest(self) -> bool:
        """Ask for something better than the best design wherever it is; whether that gave an answer."""
        self._has_asked_rest = True
        solver, everywhere = self.solver, Part((), tuple(EVERY for _ in self.weights))
        answer = solver.solve_part(everywhere, BRIEF, self.weights, self.regions, self.best)
        solver.work += READING * len(solver.encoded.model.proto.variables)
        if isinstance(answer, Unfinished):
            self.best = answer.best or self.best
            return False
        self.best = answer if isinstance(answer, Found) else self.best
        assert self.best is not None
        least = weighted(self.weights, self.best.point)
        for part in solver.parts.all:
            part.learn(Unfinished(least), self.weights, part.open(self.regions), None)
        return True

    @property
    def _is_full(self) -> bool:
        """Whether the model has rows of cores."""
        return self.solver.encoded.contention is not None and bool(self.solver.encoded.contention.known)

    def _ways(self) -> Sequence[Settings]:
        if self.solver.encoded.contention is None:
            return APART_WAYS
        return FULL_WAYS if self._is_full else PACKING_WAYS

    def _ask(self, number: int, turn: int, least: int) -> Answer:
        """One attempt at a part: bare settings for a moment, then linear relaxation with limits that double.

        No design of it has a weighted sum below `least`.
        """
        solver, part = self.solver, self.solver.parts.all[number]
        if turn == 0:
            attempt = BRIEF
        else:
            ways = self._ways()
            rounds, way = divmod(turn - 1, len(ways))
            attempt = ways[way], APART_WORK * 2**rounds
            if solver.encoded.is_loose:
                first = APART_WORK if self.waiting else ALONE_WORK
                attempt = NARROWING, first * 2 ** (max(turn, part.round) - 1)
        before = solver.work
        answer = solver.solve_part(part, attempt, self.weights, self.regions, self.best, least)
        if turn and not isinstance(answer, Unfinished):
            part.round = max(turn, part.round)
        if turn == 0 and isinstance(answer, Unfinished):
            solver.missed_briefly[number] += 1
        elif turn == 0:
            solver.missed_briefly[number] = 0
        is_hard = solver.encoded.contention is None and solver.missed_briefly[number] >= MOST_MISSED_BRIEFLY
        if is_hard or (turn == 1 and solver.work - before <= APART_CHEAP):
            solver.relaxed_first.add(number)
        else:
            solver.relaxed_first.discard(number)
        return answer
