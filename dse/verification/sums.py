"""Sums of the second proof: of diagrams, extremes of such sums, and waiting that no diagram holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.terms import FlowChain
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.verification.diagrams import Diagram, leaves


@dataclass(frozen=True)
class Sum:
    """The sum of its parts (diagrams of integers), `extremes` and `waits`; `low` and `high` bound it.

    Integers; `passages` and `waits` are response times, which no diagram holds.
    """

    parts: tuple[Diagram, ...]
    low: int
    high: int
    extremes: tuple[Pick, ...] = ()
    waits: tuple[tuple[int, int], ...] = ()
    """Threads with how often their waiting counts on top, in units of the tables' `Waits`."""
    passages: tuple[tuple[int, int], ...] = ()
    """Times of flows until a component reads, as places in the tables' `passages`, each with its multiplicity."""
    floors: tuple[Diagram, ...] = ()
    """Diagrams whose sum these are never less than, as often as they count."""

    @property
    def is_open(self) -> bool:
        """Whether some waiting is in it."""
        return bool(self.waits or self.passages) or any(one.is_open for item in self.extremes for one in item.sums)

    @property
    def never_falls(self) -> bool:
        """Whether what it holds beside its parts and extremes is never below 0."""
        return all(times >= 0 for _, times in (*self.waits, *self.passages))

    @property
    def diagrams(self) -> Iterator[Diagram]:
        """The diagrams of all figures in it."""
        yield from self.parts
        for item in self.extremes:
            for one in item.sums:
                yield from one.diagrams


@dataclass(frozen=True)
class SumBound:
    """``sum <= 0``; where it is not `exact` it holds of every design that meets the requirement, and of some others.

    A bound that is not exact is checked by the analysis for each solution.
    """

    name: str
    sum: Sum
    exact: bool


@dataclass(frozen=True)
class Pick:
    """The greatest (or the least) of several sums."""

    greatest: bool
    sums: tuple[Sum, ...]

    @property
    def low(self) -> int:
        """A lower bound."""
        return self.of(item.low for item in self.sums)

    @property
    def high(self) -> int:
        """An upper bound."""
        return self.of(item.high for item in self.sums)

    def of(self, values: Iterable[int]) -> int:
        """The value that counts."""
        return max(values) if self.greatest else min(values)


@dataclass(frozen=True)
class Summands:
    """The summands of a figure as exact fractions: diagrams, and extremes of further summands with their kind.

    Where it `is_loose` some summands are no more than lower bounds.
    """

    parts: tuple[Diagram, ...]
    extremes: tuple[tuple[bool, tuple[Summands, ...]], ...] = ()
    waits: tuple[tuple[int, Fraction], ...] = ()
    is_loose: bool = False
    passages: tuple[tuple[int, Fraction], ...] = ()

    @property
    def is_open(self) -> bool:
        """Whether some waiting is in it."""
        return bool(self.waits or self.passages) or any(item.is_open for _, sums in self.extremes for item in sums)

    def plus(self, other: Summands) -> Summands:
        """The summands of both."""
        return Summands(
            (*self.parts, *other.parts),
            (*self.extremes, *other.extremes),
            (*self.waits, *other.waits),
            self.is_loose or other.is_loose,
            (*self.passages, *other.passages),
        )

    @property
    def leaves(self) -> Iterator[Any]:
        """Every fraction in it."""
        for part in self.parts:
            yield from leaves(part)
        for _, sums in self.extremes:
            for item in sums:
                yield from item.leaves

    @property
    def weights(self) -> Iterator[Fraction]:
        """The factor of each waiting time in the sum."""
        yield from (weight for _, weight in (*self.waits, *self.passages))
        for _, sums in self.extremes:
            for item in sums:
                yield from item.weights

    @property
    def biggest(self) -> Any:
        """A bound of its absolute value.

        Exact; waiting is not in it.
        """
        largest_sum = sum(max((abs(leaf) for leaf in leaves(part)), default=0) for part in self.parts)
        return largest_sum + sum(max(item.biggest for item in sums) for _, sums in self.extremes)


@dataclass(frozen=True)
class Waits:
    """Waiting that no table holds: of `threads`, in units of 1 / `scale` ns, with what it follows from.

    For each thread that is simple enough the diagrams of its execution time (ns), its separation (in these units) and
    its place, its priority where that is a number, else the rank of its turn (a higher one goes first), and the time to
    end by where a limit says one.
    """

    space: Space
    scale: int
    threads: tuple[int, ...]
    works: Mapping[int, Diagram]
    ranks: Mapping[int, Diagram]
    separations: Mapping[int, Diagram]
    places: Mapping[int, Diagram]
    priorities: Mapping[int, Diagram]
    latest: Mapping[int, Diagram]
    messages: Mapping[int, Callable[[View], Fraction]] = field(default_factory=dict)
    """The wait of each message in a design, in ns, by a key below 0."""
    chains: Mapping[int, FlowChain] = field(default_factory=dict)
    """Threads of flows that may be one chain, by a key below those of messages: what all of them wait together."""

    def separation_ns(self, number: int, view: View) -> Fraction | None:
        """The time between two jobs of a thread; None where there is one only.

        In ns, exact: the reciprocal of the rate.
        """
        rate = rate_hz(self.space, ("activation", number), view)
        return NS_PER_S / rate if rate else None
