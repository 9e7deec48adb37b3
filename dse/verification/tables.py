"""A question as tables: what every design must fulfil, and exact integer sums for its objectives and requirements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import ceil, floor, lcm
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit, thread_loads
from dse.analysis.measures import Term
from dse.analysis.rates import rate_hz
from dse.analysis.validity import is_broken
from dse.analysis.views import View
from dse.space.trees import Choice
from dse.space.types import EMPTY, Space
from dse.verification.contention import is_late_limit, place_of
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, TooLarge, as_fraction, leaves

EXACT = 2**52
"""Sums stay below this, so that 64-bit arithmetic and the solver's are exact."""
COARSE = 10**6
FEW_DECISIONS = 10
"""With more open decisions a response time surely has too many cases to tabulate."""
FEW_LEAVES = 300
"""A response time with more cases than this is judged design by design."""


@dataclass(frozen=True)
class Sum:
    """The sum of its parts (diagrams of integers) and `extremes`; `low` and `high` bound it."""

    parts: tuple[Diagram, ...]
    low: int
    high: int
    extremes: tuple[Pick, ...] = ()

    @property
    def diagrams(self) -> Iterator[Diagram]:
        """The diagrams of all figures in it."""
        yield from self.parts
        for item in self.extremes:
            for one in item.sums:
                yield from one.diagrams


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
class Figures:
    """The summands of a figure as exact fractions: diagrams, and extremes of further summands with their kind."""

    parts: tuple[Diagram, ...]
    extremes: tuple[tuple[bool, tuple[Figures, ...]], ...] = ()

    @property
    def leaves(self) -> Iterator[Any]:
        """Every fraction in it."""
        for part in self.parts:
            yield from leaves(part)
        for _, sums in self.extremes:
            for item in sums:
                yield from item.leaves

    @property
    def biggest(self) -> Any:
        """A bound of its absolute value."""
        found = sum(max((abs(leaf) for leaf in leaves(part)), default=0) for part in self.parts)
        return found + sum(max(item.biggest for item in sums) for _, sums in self.extremes)


@dataclass(frozen=True)
class Bound:
    """``sum <= 0``; where it is not `exact` it holds of every design that meets the requirement, and of some others."""

    name: str
    sum: Sum
    exact: bool


@dataclass(frozen=True)
class Tables:
    """A question: `conditions` are named diagrams that must be true; objective = sum / divisor, to be minimised.

    `met[d]` tells where decision d is used; None where it always is.
    """

    space: Space
    evaluator: Evaluator
    allowed: Sequence[Sequence[int]]
    conditions: tuple[tuple[str, Diagram], ...]
    bounds: tuple[Bound, ...]
    objectives: tuple[tuple[Sum, int], ...]
    met: tuple[Diagram | None, ...]
    late: tuple[Limit, ...] = ()
    """Limits on response times that no bound holds: the analysis judges them design by design."""
    places: Mapping[int, Diagram] = field(default_factory=dict)
    """For each thread that may share a core with others a number for its core; empty where there are no such limits."""

    @property
    def is_exact(self) -> bool:
        """Whether the bounds admit exactly the designs that the requirements do."""
        return not self.late and all(bound.exact for bound in self.bounds)


def build_tables(evaluator: Evaluator) -> Tables:
    """The tables of a question.

    Raises
    ------
    TooLarge
        when a formula depends on too many combinations of options.
    """
    builder = _Builder(evaluator)
    objectives = tuple(builder.objective(number) for number in range(len(evaluator.objectives)))
    bounds = tuple(bound for limit in evaluator.limits for bound in builder.limit(limit))
    builder.structure()
    late = tuple(builder.late)
    return Tables(
        space=evaluator.space,
        evaluator=evaluator,
        allowed=builder.make.allowed,
        conditions=tuple(builder.conditions),
        bounds=bounds,
        objectives=objectives,
        met=tuple(builder.met(number) for number in range(len(evaluator.space.decisions))),
        late=late,
        places=builder.places() if late else {},
    )


class _Builder:
    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.space = evaluator.space
        self.make = Diagrams(evaluator.space)
        self.conditions: list[tuple[str, Diagram]] = []
        self.late: list[Limit] = []

    def structure(self) -> None:
        """What the architecture and the rules demand."""
        book = self.evaluator.rulebook
        for predicate in book.predicates:
            self.demand(predicate.text, predicate.holds)
        for cover in book.covers:

            def used(view: View, cover: Any = cover) -> bool:
                filled = cover.slot.types[view[cover.slot.type_decision]] != EMPTY
                return not filled or any(uses(view) for uses in cover.users)

            self.demand(f"something is bound to {cover.slot.name}", used)
        for rule in self.space.rules:
            self.demand(rule.text, lambda view, rule=rule: not is_broken(rule, view))  # type: ignore[misc]
        for number, component in enumerate(self.space.components):
            name = f"the rate of {component.name}"
            self.defined(self.make.diagram(partial(self._rate, number), name), name)

    def _rate(self, number: int, view: View) -> Any:
        return rate_hz(self.space, ("activation", number), view)

    def demand(self, name: str, holds: Callable[[View], bool]) -> None:
        """The formula must be true in every design."""
        found = self.make.mapped(self.make.diagram(holds, name), lambda leaf: leaf is not NO_DESIGN and bool(leaf))
        if found is not True:
            self.conditions.append((name, found))

    def defined(self, diagram: Diagram, name: str) -> None:
        """The formula must have a value in every design."""
        found = self.make.mapped(diagram, lambda leaf: leaf is not NO_DESIGN)
        if found is not True:
            self.conditions.append((f"{name} is defined", found))

    def term(self, term: Term, owner: str) -> Diagram:
        """A summand as a diagram of exact fractions."""
        name = f"{owner}: {term.label}"
        found = self.make.diagram(term.value, name)
        self.defined(found, name)
        return self.make.mapped(found, as_fraction)

    def figures(self, terms: Iterable[Term], owner: str) -> Figures:
        """Summands as exact fractions."""
        plain, extremes = [], []
        for term in terms:
            if term.extreme is None:
                plain.append(self.term(term, owner))
            else:
                sums = tuple(self.figures(inner, owner) for inner in term.extreme.sums)
                extremes.append((term.extreme.kind == "max", sums))
        return Figures(tuple(plain), tuple(extremes))

    def objective(self, number: int) -> tuple[Sum, int]:
        """Objective `number`, negated when it is to be maximised."""
        measure = self.evaluator.objectives[number]
        sign = 1 if self.space.objectives[number].sense == "minimise" else -1
        figures = self.figures(measure.terms, measure.metric.name)
        if measure.rounded:
            return self._sum(figures, sign, lambda value: ceil(value * measure.scale)), 1
        divisor = lcm(*((leaf * measure.scale).denominator for leaf in figures.leaves))
        return self._sum(figures, sign, lambda value: int(value * measure.scale * divisor)), divisor

    def _sum(self, figures: Figures, sign: int, count: Callable[[Any], int]) -> Sum:
        """The sum with each figure counted, times `sign`: the greatest of several is the least of their negatives."""
        made = [
            self.make.mapped(part, lambda leaf: 0 if leaf is NO_DESIGN else sign * count(leaf))
            for part in figures.parts
        ]
        ends = [leaves(part) or [0] for part in made]
        picks = tuple(
            Pick(greatest == (sign > 0), tuple(self._sum(item, sign, count) for item in sums))
            for greatest, sums in figures.extremes
        )
        low = sum(min(end) for end in ends) + sum(item.low for item in picks)
        high = sum(max(end) for end in ends) + sum(item.high for item in picks)
        return Sum(tuple(made), low, high, picks)

    def limit(self, limit: Limit) -> list[Bound]:
        """The inequalities of a requirement; one for each thread where every core has its limit."""
        operator, name = limit.requirement.operator, limit.requirement.text
        if is_late_limit(limit):
            try:
                if sum(decision.is_open for decision in self.space.decisions) > FEW_DECISIONS:
                    raise TooLarge(name)
                for term in limit.measure.terms:
                    self.make.diagram(term.value, name, FEW_LEAVES)
            except TooLarge:
                self.late.append(limit)
                return []
        bound = self.make.diagram(limit.bound, name)
        self.defined(bound, name)
        parts = self.figures(limit.measure.terms, name)
        found = []
        if operator in ("<=", "<", "=="):
            found.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), 1, strict=operator == "<"))
        if operator in (">=", ">", "=="):
            found.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), -1, strict=operator == ">"))
        if limit.each is not None:
            for thread, terms in thread_loads(limit.measure.terms).items():
                alone = self.figures(terms, name)
                found.append(self.bound(f"{name}: {thread}", alone, limit.each, 1, strict=operator == "<"))
        return found

    def bound(self, name: str, figures: Figures, bound: Diagram, sign: int, *, strict: bool) -> Bound:
        """The inequality sign * (figures - bound) <= 0, or < 0, in whole numbers."""
        edge = Figures((bound,))
        scale = lcm(*(leaf.denominator for item in (figures, edge) for leaf in item.leaves))
        exact = (figures.biggest + edge.biggest) * scale < EXACT
        scale = scale if exact else COARSE
        whole: Callable[[Any], int] = floor  # a lower bound of each summand: no design is lost
        low = self._sum(figures, sign, lambda value: sign * whole(sign * value * scale))
        most = self._sum(edge, 1, lambda value: whole(-sign * value * scale) + (1 if strict and exact else 0))
        made = Sum((*low.parts, *most.parts), low.low + most.low, low.high + most.high, low.extremes)
        return Bound(name, made, exact)

    def places(self) -> dict[int, Diagram]:
        """The core of each thread, as a number."""
        found = {}
        for number, component in enumerate(self.space.components):
            if component.processor is not None:
                name = f"the core of {component.name}"
                diagram = self.make.diagram(partial(place_of, self.space, number), name)
                self.defined(diagram, name)
                found[number] = self.make.mapped(diagram, lambda leaf: -1 if leaf is NO_DESIGN else leaf)
        return found

    def met(self, index: int) -> Diagram | None:
        """Where the walk through the decision's home meets it."""
        home = self.space.decisions[index].home
        if isinstance(home, Choice) and home.decision == index:
            return None

        def meets(view: View) -> bool:
            tree = home
            while isinstance(tree, Choice):
                if tree.decision == index:
                    return True
                tree = tree.branches[view[tree.decision]]
            return False

        found = self.make.diagram(meets, self.space.decisions[index].name)
        return None if found is True else found
