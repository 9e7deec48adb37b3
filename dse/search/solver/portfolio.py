"""Which settings a question is asked with: those that cost the least so far, measured as the search goes.

An algorithm portfolio that learns on line (as Gagliolo and Schmidhuber, "Learning dynamic algorithm portfolios", Annals
of Mathematics and Artificial Intelligence 47, 2006), with limits that double, so that a question costs at most a
constant times what the best of the settings would have cost. Costs are counted in *work*, deterministic time weighed
by settings (`dse.search.solver.settings`), never in seconds: the same problem and seed have the same search.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from dse.search import tuning as tuned
from dse.search.solver_answer import Answer, Found, Unfinished

Attempt: TypeAlias = Callable[[float], Answer]
"""Tries to answer a question with so much work."""


class Portfolio:
    """The average costs of some attempts, known by their positions.

    `expected` is what each may cost at least, before anything is known of it.
    """

    def __init__(self, expected: Sequence[float], tuning: tuned.Portfolio) -> None:
        self._tuning = tuning
        self.costs = list(expected)
        self._expected = expected
        self._answers: list[float | None] = [None for _ in expected]
        self._is_measured = [False for _ in expected]

    @property
    def favourite(self) -> int:
        """The attempt that costs the least.

        An index of the attempts.
        """
        return self._order()[0]

    def answer(self, attempts: Sequence[Attempt], work: Callable[[], float], is_over: Callable[[], bool]) -> Answer:
        """The first answer that an attempt gives; unfinished when the time is over.

        `work` tells how much was done so far.
        """
        best: Found | None = None
        lost: defaultdict[int, float] = defaultdict(float)  # the limits of attempts in vain
        for position, limit in self.limits():
            before = work()
            answer = attempts[position](limit)
            if not isinstance(answer, Unfinished):
                self._won(position, work() - before, lost)
                return answer
            best = answer.best or best
            if is_over():
                return Unfinished(answer.bound, best)
            self.learn(position, 2 * limit, is_answer=False)  # it would have cost twice its limit, say
            lost[position] += limit
        raise AssertionError("the attempts have no end")

    def _won(self, position: int, work: float, lost: Mapping[int, float]) -> None:
        """An attempt has answered a question; those that were tried before it would have cost as much and more."""
        if work > self._tuning.trivial:
            self.learn(position, work, is_answer=True)
        for other, spent in lost.items():
            if other != position:
                self.learn(other, spent + work, is_answer=False)

    def learn(self, position: int, cost: float, *, is_answer: bool) -> None:
        """Record the cost of an attempt, or a lower bound of it.

        `cost` is work in deterministic time; without an answer it is a lower bound.
        """
        known = self.costs[position]
        if not is_answer and known >= cost:
            return
        self.costs[position] = cost if self._answers[position] is None else self._blended(known, cost)
        if is_answer:
            self._answers[position] = self._blended(self._answers[position], cost)
        self._is_measured[position] = True

    def _order(self) -> list[int]:
        """The cheapest first."""
        if not self._tuning.is_on:
            return list(range(len(self.costs)))
        return sorted(range(len(self.costs)), key=lambda position: (self.costs[position], position))

    def limits(self) -> Iterator[tuple[int, float]]:
        """All in turn, the cheapest first, each with patience of its own; in the next round with twice as much.

        Those that are known to cost much more than the limit of the first wait for a later round.
        """
        factor = 1
        while True:
            order = self._order()
            first = factor * self._limit(order[0])
            for position in order:
                if not self._is_measured[position] or self.costs[position] <= self._tuning.gate * first:
                    yield position, max(first, factor * self._limit(position))
            factor *= 2

    def _limit(self, position: int) -> float:
        """How much work an attempt is worth at first."""
        answers = self._answers[position]
        return max(
            self._tuning.first_limit, self._tuning.patience * (self._expected[position] if answers is None else answers)
        )

    def _blended(self, average: float | None, cost: float) -> float:
        """The average with one more cost, the newest weighing most."""
        return cost if average is None else average + self._tuning.newest * (cost - average)
