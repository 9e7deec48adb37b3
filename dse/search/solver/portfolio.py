"""Which settings a question is asked with: those that cost the least so far, measured as the search goes.

An algorithm portfolio that learns on line (as Gagliolo and Schmidhuber, "Learning dynamic algorithm portfolios", Annals
of Mathematics and Artificial Intelligence 47, 2006), with limits that double, so that a question costs at most a
constant times what the best of the settings would have cost. Costs are counted in *work*, deterministic time weighed
by settings (`dse.search.solver.settings`), never in seconds: the same problem and seed have the same search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

from dse.search.solver_answer import Answer, Found, Unfinished

Attempt: TypeAlias = Callable[[float], Answer]
"""Tries to answer a question with so much work."""

FIRST_LIMIT = 0.05
"""Work; no limit is lower but that of a look."""
PATIENCE = 6
"""The favourite may take so many times what its answers cost on the average before others are tried."""
GATE = 8
"""An attempt that costs so many times the limit of the favourite is not worth it yet."""
TRIVIAL = 0.0005
"""Answers that cost less than this tell nothing of the attempts: propagation alone gives them."""
NEWEST = 0.25
"""The weight of the newest cost in an average."""
LOOK_AFTER = 2
"""After so many questions another attempt is given the chance to be quicker ..."""
LOOK_AT_MOST_AFTER = 64
"""... after twice as many where it was not, up to so many."""
LOOK_FROM = 0.004
"""Where the favourite costs less than this on the average, nothing can be gained."""


class Portfolio:
    """The average costs of some attempts, known by their positions.

    `expected` is what each may cost at least, before anything is known of it.
    """

    def __init__(self, expected: Sequence[float]) -> None:
        self.costs = list(expected)
        self._expected = expected
        self._answers: list[float | None] = [None for _ in expected]
        self._is_measured = [False for _ in expected]
        self._questions = 0
        self._interval = LOOK_AFTER
        self._next_look = LOOK_AFTER
        self._looked_at = 0

    @property
    def favourite(self) -> int:
        """The attempt that costs the least."""
        return self._order()[0]

    def answer(self, attempts: Sequence[Attempt], work: Callable[[], float], is_over: Callable[[], bool]) -> Answer:
        """The first answer that an attempt gives; unfinished when the time is over.

        `work` tells how much was done so far.
        """
        race = self.race()
        best: Found | None = None
        for position, limit in race:
            before = work()
            answer = attempts[position](limit)
            if not isinstance(answer, Unfinished):
                race.won(position, work() - before)
                return answer
            best = answer.best or best
            if is_over():
                return Unfinished(answer.bound, best)
            race.lost(position, limit)
        raise AssertionError("a race has no end")

    def race(self) -> Race:
        """The attempts at one more question."""
        self._questions += 1
        return Race(self)

    def look(self) -> tuple[int, float] | None:
        """An attempt that may be quicker than the favourite by now, and how much work that would be: half as much."""
        favourite, *others = self._order()
        cost = self.costs[favourite]
        if not others or cost < LOOK_FROM or self._questions < self._next_look:
            return None
        self._next_look = self._questions + self._interval
        position = sorted(others)[self._looked_at % len(others)]
        if self.costs[position] > cost and not self._is_measured[position]:
            return None
        return position, cost / 2

    def looked(self, *, was_quicker: bool) -> None:
        """What came of a look: where it was good the next one is soon and at the same attempt, else later."""
        if was_quicker:
            self._interval = 1
            self._next_look = self._questions + 1
        else:
            self._looked_at += 1
            self._interval = min(max(LOOK_AFTER, 2 * self._interval), LOOK_AT_MOST_AFTER)

    def learn(self, position: int, cost: float, *, is_answer: bool) -> None:
        """What an attempt has cost, or would have cost at least."""
        known = self.costs[position]
        if not is_answer and known >= cost:
            return
        self.costs[position] = cost if self._answers[position] is None else _blended(known, cost)
        if is_answer:
            self._answers[position] = _blended(self._answers[position], cost)
        self._is_measured[position] = True

    def _order(self) -> list[int]:
        """The cheapest first."""
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
                if not self._is_measured[position] or self.costs[position] <= GATE * first:
                    yield position, max(first, factor * self._limit(position))
            factor *= 2

    def _limit(self, position: int) -> float:
        """How much work an attempt is worth at first."""
        answers = self._answers[position]
        return max(FIRST_LIMIT, PATIENCE * (self._expected[position] if answers is None else answers))


class Race:
    """The attempts at one question: pairs of an attempt and how much work it may do, without an end."""

    def __init__(self, portfolio: Portfolio) -> None:
        self._portfolio = portfolio
        self._look = portfolio.look()
        self._lost: dict[int, float] = {}
        self._steps = portfolio.limits()

    def __iter__(self) -> Iterator[tuple[int, float]]:
        return self

    def __next__(self) -> tuple[int, float]:
        """The next attempt, and its limit."""
        return self._look if self._look is not None else next(self._steps)

    def won(self, position: int, work: float) -> None:
        """The attempt has answered the question."""
        if work > TRIVIAL:
            self._portfolio.learn(position, work, is_answer=True)
        for other, spent in self._lost.items():
            if other != position:
                self._portfolio.learn(other, spent + work, is_answer=False)
        self._end_look(was_quicker=self._look is not None and work <= self._look[1])

    def lost(self, position: int, limit: float) -> None:
        """The attempt was stopped at its limit: it would have cost twice that, say."""
        self._portfolio.learn(position, 2 * limit, is_answer=False)
        self._lost[position] = self._lost.get(position, 0.0) + limit
        self._end_look(was_quicker=False)

    def _end_look(self, *, was_quicker: bool) -> None:
        if self._look is not None:
            self._look = None
            self._portfolio.looked(was_quicker=was_quicker)


def _blended(average: float | None, cost: float) -> float:
    """The average with one more cost, the newest weighing most."""
    return cost if average is None else average + NEWEST * (cost - average)
