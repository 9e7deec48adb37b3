"""A question as tables: what every design must fulfil, and exact integer sums for its objectives and requirements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from functools import partial
from math import ceil, floor, lcm
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit
from dse.analysis.measures import Term
from dse.analysis.priorities import number_of, order_ns
from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.scheduling import UNBOUNDED_NS
from dse.analysis.tasks import work_ns
from dse.analysis.validity import is_broken
from dse.analysis.views import View
from dse.records import dataclass
from dse.space.cores import is_scheduled
from dse.space.trees import Choice
from dse.space.types import EMPTY, Space
from dse.verification.contention import has_number, is_late_limit, is_simple, place_of
from dse.verification.cores import CoreTable, core_table
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, TooLarge, as_fraction, leaves
from dse.verification.levels import Levels, levels_of, rooms, timely
from dse.verification.releases import formula_of
from dse.verification.sums import Bound, Figures, Pick, Sum, Waits

EXACT = 2**52
"""Sums stay below this, so that 64-bit arithmetic and the solver's are exact."""
COARSE = 10**6
ONE = Fraction(1)
FEW_DECISIONS = 10
"""With more open decisions a response time surely has too many cases to tabulate."""
FEW_LEAVES = 300
"""A response time with more cases than this is judged design by design."""
FEW_CASES = 1_000
"""So is a limit on a figure that holds a response time among others, with more cases than this."""


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
    loose: tuple[Limit, ...] = ()
    """Other limits of which bounds hold a part only, and which the analysis judges, too."""
    cores: tuple[CoreTable, ...] = ()
    """Limits on each core of a processor."""
    places: Mapping[int, Diagram] = field(default_factory=dict)
    """For each thread that may share a core with others a number for its core; empty where there are no such limits."""
    waits: Waits | None = None
    """Waiting in objectives and bounds; none where tables hold all of it."""
    levels: Levels | None = None
    """Rows of cores that designs keep whose threads are in time; none where they would be too large."""

    @property
    def is_exact(self) -> bool:
        """Whether the bounds admit exactly the designs that the requirements do."""
        return self.bounds_are_exact and all(table.exact for table in self.cores)

    @property
    def bounds_are_exact(self) -> bool:
        """The same of everything but cores."""
        return not self.late and self.waits is None and all(bound.exact for bound in self.bounds)


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
    threads = timely(evaluator.space, late)
    return Tables(
        space=evaluator.space,
        evaluator=evaluator,
        allowed=builder.make.allowed,
        conditions=tuple(builder.conditions),
        bounds=(*bounds, *(builder.bound(*room, 1, strict=False) for room in rooms(builder.make, threads))),
        objectives=objectives,
        met=tuple(builder.met(number) for number in range(len(evaluator.space.decisions))),
        late=late,
        loose=tuple(builder.loose),
        cores=tuple(builder.cores),
        places=builder.places() if late or builder.waiting else {},
        waits=builder.waits() if builder.waiting else None,
        levels=levels_of(builder.make, threads),
    )


class _Builder:
    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.space = evaluator.space
        self.make = Diagrams(evaluator.space)
        self.conditions: list[tuple[str, Diagram]] = []
        self.late: list[Limit] = []
        self.loose: list[Limit] = []
        self.cores: list[CoreTable] = []
        self.waiting: set[int] = set()
        measures = [*evaluator.objectives, *(limit.measure for limit in evaluator.limits)]
        self.wait_scale = lcm(
            *(item.scale for item in measures if not item.rounded and is_scheduled(self.space, item.metric))
        )

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
        formula = formula_of(term)
        found = self.make.diagram(formula, name)
        self.defined(found, name)
        return self.make.mapped(found, as_fraction)

    def figures(self, terms: Iterable[Term], owner: str, *, upper: bool = False, loose: bool = False) -> Figures:
        """Summands as exact fractions; where `upper`, waiting that is too much to tabulate may be left open.

        Where `loose`, other summands that are too much to tabulate have their lower ends.
        """
        plain, extremes, waits = [], [], []
        is_loose = False
        for term in terms:
            if term.extreme is not None:
                sums = tuple(self.figures(inner, owner, upper=upper, loose=loose) for inner in term.extreme.sums)
                is_loose |= any(item.is_loose for item in sums)
                extremes.append((term.extreme.kind == "max", sums))
            elif upper and term.only_waits and term.waits is not None and self._is_large(term, owner):
                plain.append(self.term(replace(term, value=partial(_least_of, term), sampled=None), owner))
                waits.append(term.waits)
                self.waiting.add(term.waits[0])
            elif loose and term.ends is not None and self._has_many_cases(term, owner):
                plain.append(self.term(replace(term, value=partial(_least_of, term), sampled=None), owner))
                is_loose = True
            else:
                plain.append(self.term(term, owner))
        return Figures(tuple(plain), tuple(extremes), tuple(waits), is_loose)

    def _has_many_cases(self, term: Term, name: str) -> bool:
        """Whether a figure with a response time in it has too many cases to look at."""
        try:
            self.make.diagram(term.value, name, FEW_CASES)
        except TooLarge:
            return True
        return False

    def _is_large(self, term: Term, name: str) -> bool:
        """Whether a response time has too many cases to tabulate."""
        if term.waits is not None and self.space.components[term.waits[0]].processor is None:
            return False
        if sum(decision.is_open for decision in self.space.decisions) > FEW_DECISIONS:
            return True
        try:
            self.make.diagram(term.value, name, FEW_LEAVES)
        except TooLarge:
            return True
        return False

    def objective(self, number: int) -> tuple[Sum, int]:
        """Objective `number`, negated when it is to be maximised."""
        measure = self.evaluator.objectives[number]
        sign = 1 if self.space.objectives[number].sense == "minimise" else -1
        upper = sign > 0 and not measure.rounded
        figures = self.figures(measure.terms, measure.metric.name, upper=upper)
        if measure.rounded:
            return self._sum(figures, sign, partial(_rounded_up, measure.scale)), 1
        divisor = lcm(*((leaf * measure.scale).denominator for leaf in figures.leaves))
        each = Fraction(measure.scale * divisor)

        def count(value: Any) -> int:
            return int(value * each)

        return self._sum(figures, sign, count, each), divisor

    def _sum(self, figures: Figures, sign: int, count: Callable[[Any], int], scale: Fraction = ONE) -> Sum:
        """The sum with each figure counted, times `sign`: the greatest of several is the least of their negatives."""
        made = [
            self.make.mapped(part, lambda leaf: 0 if leaf is NO_DESIGN else sign * count(leaf))
            for part in figures.parts
        ]
        ends = [leaves(part) or [0] for part in made]
        picks = tuple(
            Pick(greatest == (sign > 0), tuple(self._sum(item, sign, count, scale) for item in sums))
            for greatest, sums in figures.extremes
        )
        waits = []
        for number, weight in figures.waits:
            times = sign * weight * scale / self.wait_scale
            if times.denominator != 1:
                raise TooLarge("response times have no common unit with the figures that they are added to")
            waits.append((number, int(times)))
        low = sum(min(end) for end in ends) + sum(item.low for item in picks)
        high = sum(max(end) for end in ends) + sum(item.high for item in picks)
        high += sum(times * UNBOUNDED_NS * self.wait_scale for _, times in waits)
        return Sum(tuple(made), low, high, picks, tuple(waits))

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
        upper = operator in ("<=", "<") and not limit.is_elsewhere and not limit.measure.rounded
        parts = self.figures(limit.measure.terms, name, upper=upper, loose=upper and limit.cores is None)
        self.loose += [limit] if parts.is_loose else []
        found = []
        if operator in ("<=", "<", "=="):
            found.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), 1, strict=operator == "<"))
        if operator in (">=", ">", "=="):
            found.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), -1, strict=operator == ">"))
        if limit.cores is not None:
            for thread, terms in limit.alone.items():
                alone, most = self.figures(terms, name), limit.cores.most
                found.append(self.bound(f"{name}: {thread}", alone, most, 1, strict=limit.cores.is_strict))
            table = core_table(
                limit, partial(self.term, owner=name), self.make.diagram, self.make.mapped, EXACT, COARSE
            )
            self.cores += [] if table is None else [table]
        return found

    def bound(self, name: str, figures: Figures, bound: Diagram, sign: int, *, strict: bool) -> Bound:
        """The inequality sign * (figures - bound) <= 0, or < 0, in whole numbers."""
        edge = Figures((bound,))
        scale = lcm(*(leaf.denominator for item in (figures, edge) for leaf in item.leaves))
        if figures.is_open:
            scale = lcm(scale, self.wait_scale)
        exact = (figures.biggest + edge.biggest) * scale < EXACT
        if figures.is_open and not exact:
            raise TooLarge(f"{name} adds response times to figures that are too fine")
        scale = scale if exact else COARSE
        whole: Callable[[Any], int] = floor  # a lower bound of each summand: no design is lost
        low = self._sum(figures, sign, lambda value: sign * whole(sign * value * scale), Fraction(scale))
        most = self._sum(edge, 1, lambda value: whole(-sign * value * scale) + (1 if strict and exact else 0))
        made = Sum((*low.parts, *most.parts), low.low + most.low, low.high + most.high, low.extremes, low.waits)
        return Bound(name, made, exact and not figures.is_open and not figures.is_loose)

    def waits(self) -> Waits:
        """What the waiting of threads follows from."""
        simple = [number for number, item in enumerate(self.space.components) if is_simple(item)]
        rates = {number: self._rates(number) for number in simple}
        orders = {number: self._orders(number) for number in simple if not has_number(self.space.components[number])}
        listed = sorted({leaf for diagram in orders.values() for leaf in leaves(diagram)}, reverse=True)
        scale = self.wait_scale

        def separation(rate: Any) -> int:
            return ceil(NS_PER_S * scale / rate) if rate and rate is not NO_DESIGN else 2 * UNBOUNDED_NS * scale

        places = self.places()
        return Waits(
            space=self.space,
            scale=scale,
            threads=tuple(sorted(self.waiting)),
            works={number: self._whole(partial(self._work, number), number) for number in simple},
            ranks={number: self.make.mapped(found, listed.index) for number, found in orders.items()},
            separations={number: self.make.mapped(found, separation) for number, found in rates.items()},
            places={number: places[number] for number in simple},
            priorities={number: self._number(number) for number in simple if number not in orders},
            latest={
                limit.requirement.metric.index or 0: self._latest(limit)
                for limit in self.late
                if limit.requirement.metric.index in self.waiting & set(simple)
            },
        )

    def _rates(self, number: int) -> Diagram:
        return self.make.diagram(partial(self._rate, number), f"the rate of {self.space.components[number].name}")

    def _orders(self, number: int) -> Diagram:
        """The time that orders a thread in ns, the shorter first."""

        def order(view: View) -> Fraction:
            found = order_ns(self.space, number, view)
            return Fraction(UNBOUNDED_NS) ** 2 if found is None else found

        found = self.make.diagram(order, f"the turn of {self.space.components[number].name}")
        return self.make.mapped(found, lambda leaf: Fraction(UNBOUNDED_NS) ** 2 if leaf is NO_DESIGN else leaf)

    def _number(self, number: int) -> Diagram:
        component = self.space.components[number]
        found = self.make.diagram(partial(number_of, component), f"the priority of {component.name}")
        return self.make.mapped(found, lambda leaf: leaf if isinstance(leaf, int) else 0)

    def _work(self, number: int, view: View) -> int:
        return work_ns(self.space, number, view)

    def _whole(self, formula: Callable[[View], Any], number: int) -> Diagram:
        found = self.make.diagram(formula, f"the execution time of {self.space.components[number].name}")
        return self.make.mapped(found, lambda leaf: 0 if leaf is NO_DESIGN else leaf)

    def _latest(self, limit: Limit) -> Diagram:
        """The time by which a job ends, in the unit of waiting."""
        strict = limit.requirement.operator == "<"

        def count(bound: Any) -> int:
            if bound is NO_DESIGN:
                return 2 * UNBOUNDED_NS * self.wait_scale
            scaled = Fraction(bound) * self.wait_scale
            return min(ceil(scaled) - 1 if strict else floor(scaled), 2 * UNBOUNDED_NS * self.wait_scale)

        return self.make.mapped(self.make.diagram(limit.bound, limit.requirement.text), count)

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


def _rounded_up(scale: int, value: Any) -> int:
    found: int = ceil(value * scale)
    return found


def _least_of(term: Term, view: View) -> Fraction:
    """The figure of a term where nothing waits."""
    assert term.ends is not None
    return term.ends(view)[0]
