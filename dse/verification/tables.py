"""A question as tables: what every design must fulfil, and exact integer sums for its objectives and requirements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from math import ceil, floor, lcm
from operator import mul
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit
from dse.analysis.measures import Measure, Term
from dse.analysis.messages.conflicts import open_identifiers
from dse.analysis.messages.stages import counted_buses
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.terms import FlowChain, Reads, Waiter
from dse.analysis.timescale import RESPONSE_SCALE_LIMIT
from dse.analysis.validity import is_broken
from dse.analysis.views import View
from dse.space.model.criteria import Metric
from dse.space.model.space import EMPTY, Space
from dse.space.model.trees import Choice
from dse.space.question.open_cores import is_scheduled
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, TooLarge, as_fraction, leaves
from dse.verification.messages.limits import is_message_limit
from dse.verification.messages.waiting import wait_key
from dse.verification.scheduling.clock_reads import Passage, in_units, passage_of
from dse.verification.scheduling.contention import is_late_limit
from dse.verification.scheduling.core_limits import CoreTable, core_table
from dse.verification.scheduling.sampling import formula_of
from dse.verification.scheduling.schedulability import Levels, levels_of, rooms, timely
from dse.verification.scheduling.threads import places_of, rate_of, waits_of
from dse.verification.sums import Pick, Sum, SumBound, Summands, Waits

EXACT = 2**52
"""Sums stay below this, so that 64-bit arithmetic and the solver's are exact."""
COARSE = 10**6
ONE = Fraction(1)
FEW_DECISIONS = 10
"""With more open decisions a response time surely has too many cases to tabulate."""
FEW_OF_MESSAGES = 5
"""With more open decisions the response time of a message has too many cases: it depends on all of its bus."""
FEW_LEAVES = 100
"""A response time with more cases than this is judged design by design."""
FEW_CASES = 300
"""A limit on a figure with a response time in it and more cases than this is judged design by design."""


@dataclass(frozen=True)
class Tables:
    """A question: `conditions` are named diagrams that must be true; objective = sum / divisor, to be minimised.

    `met[d]` tells where decision d is used; None where it always is.
    """

    space: Space
    evaluator: Evaluator
    allowed: Sequence[Sequence[int]]
    conditions: tuple[tuple[str, Diagram], ...]
    bounds: tuple[SumBound, ...]
    objectives: tuple[tuple[Sum, int], ...]
    met: tuple[Diagram | None, ...]
    late: tuple[Limit, ...] = ()
    """Limits on response times that no bound holds: the analysis judges them design by design."""
    messages: tuple[Limit, ...] = ()
    """Limits on messages that no bound holds, which the analysis judges as well."""
    loose: tuple[Limit, ...] = ()
    """Limits that bounds state in part only; the analysis judges each design as well."""
    cores: tuple[CoreTable, ...] = ()
    """Limits on each core of a processor."""
    places: Mapping[int, Diagram] = field(default_factory=dict)
    """For each thread that may share a core with others a number for its core; empty where there are no such limits."""
    waits: Waits | None = None
    """Waiting in objectives and bounds; none where tables hold all of it."""
    passages: tuple[Passage, ...] = ()
    """What flows take until components read, where response times are in it that no table holds."""
    levels: Levels | None = None
    """Rows of cores that designs keep whose threads are in time; none where they would be too large."""

    @property
    def is_exact(self) -> bool:
        """Whether the bounds admit exactly the designs that the requirements do."""
        return self.bounds_are_exact and all(table.exact for table in self.cores)

    @property
    def bounds_are_exact(self) -> bool:
        """Whether the bounds admit exactly the designs that the requirements do, limits on cores left aside."""
        return not self.late and not self.messages and self.waits is None and all(bound.exact for bound in self.bounds)


def build_tables(evaluator: Evaluator) -> Tables:
    """The tables of a question.

    Raises
    ------
    TooLarge
        when a formula depends on too many combinations of options.
    """
    builder = _TableBuilder(evaluator)
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
        bounds=(
            *bounds,
            *builder.sums,
            *(builder.bound(*room, 1, strict=False) for room in rooms(builder.make, threads)),
        ),
        objectives=objectives,
        met=tuple(builder.met(number) for number in range(len(evaluator.space.decisions))),
        late=late,
        messages=tuple(builder.messages),
        loose=tuple(builder.loose),
        cores=tuple(builder.cores),
        places=places_of(builder.make, builder.defined) if late or builder.waiting or builder.chains else {},
        waits=builder.waits() if builder.waiting or builder.waits_of or builder.chains else None,
        passages=tuple(builder.passages),
        levels=levels_of(builder.make, threads),
    )


class _TableBuilder:
    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.space = evaluator.space
        self.make = Diagrams(evaluator.space)
        self.conditions: list[tuple[str, Diagram]] = []
        self.late: list[Limit] = []
        self.messages: list[Limit] = []
        self.waits_of: dict[int, Callable[[View], Fraction]] = {}
        self.chains: dict[FlowChain, int] = {}
        self.loose: list[Limit] = []
        self.sums: list[SumBound] = []  # of the architecture
        self.cores: list[CoreTable] = []
        self.waiting: set[int] = set()
        self.passages: list[Passage] = []
        self.until_read: dict[int, tuple[Term, Summands | None]] = {}  # with the term, so that its id stays its own
        measures = [*evaluator.objectives, *(limit.measure for limit in evaluator.limits)]
        waits = partial(may_hold_waiting, self.space)
        counted = (item for item in measures if not item.rounded or item.scale <= RESPONSE_SCALE_LIMIT)
        self.wait_scale = lcm(*(item.scale for item in counted if waits(item.metric)))

    def structure(self) -> None:
        """The conditions of the architecture and the rules."""
        book = self.evaluator.rulebook
        for predicate in book.predicates:
            if not predicate.terms:
                self.demand(predicate.text, predicate.holds)
                continue
            parts = [self._plain(term, predicate.text) for term in predicate.terms]
            self.sums.append(self.bound(predicate.text, Summands(tuple(parts)), Fraction(0), 1, strict=False))
        for cover in book.covers:

            def used(view: View, cover: Any = cover) -> bool:
                filled = cover.slot.types[view[cover.slot.type_decision]] != EMPTY
                return not filled or any(uses(view) for uses in cover.users)

            self.demand(f"something is bound to {cover.slot.name}", used)
        for rule in self.space.rules:
            self.demand(rule.text, lambda view, rule=rule: not is_broken(rule, view))  # type: ignore[misc]
        for number, component in enumerate(self.space.components):
            self.defined(rate_of(self.make, number), f"the rate of {component.name}")

    def demand(self, name: str, holds: Callable[[View], bool]) -> None:
        """The formula must be true in every design."""
        diagram = self.make.mapped(self.make.diagram(holds, name), lambda leaf: leaf is not NO_DESIGN and bool(leaf))
        if diagram is not True:
            self.conditions.append((name, diagram))

    def defined(self, diagram: Diagram, name: str) -> None:
        """The formula must have a value in every design."""
        mapped = self.make.mapped(diagram, lambda leaf: leaf is not NO_DESIGN)
        if mapped is not True:
            self.conditions.append((f"{name} is defined", mapped))

    def term(self, term: Term, owner: str) -> Diagram:
        """A summand as a diagram of exact fractions."""
        return self._plain(formula_of(term), f"{owner}: {term.label}")

    def _plain(self, formula: Callable[[View], Any], name: str) -> Diagram:
        """A figure that has a value in every design as a diagram of exact fractions."""
        diagram = self.make.diagram(formula, name)
        self.defined(diagram, name)
        return self.make.mapped(diagram, as_fraction)

    def measured(self, measure: Measure, owner: str, *, upper: bool, loose: bool = False) -> Summands:
        """The summands of a measure, see `figures`; of a rounded one waiting stays open where it rounds up by itself.

        That is so where it counts once in the unit of both, and what it is added to is a whole number of it.
        """
        if not measure.rounded:
            return self.figures(measure.terms, owner, upper=upper, loose=loose)
        summands = Summands(())
        for term in measure.terms:
            is_open = upper and self._is_whole(term, measure.scale, owner)
            summands = summands.plus(self._figure(term, owner, upper=is_open, loose=loose))
        return summands

    def _is_whole(self, term: Term, scale: int, owner: str) -> bool:
        """Whether a term is a whole number of 1 / `scale` and a waiting that counts once in these."""
        if term.waits is None or not term.only_waits:
            return False
        least = (leaf * scale for leaf in leaves(self._least(term, owner)))
        return term.waits[1] * scale == self.wait_scale and all(Fraction(leaf).denominator == 1 for leaf in least)

    def figures(self, terms: Iterable[Term], owner: str, *, upper: bool = False, loose: bool = False) -> Summands:
        """Summands as exact fractions; where `upper`, waiting that is too much to tabulate may be left open.

        Where `loose`, other summands that are too much to tabulate have their lower ends.
        """
        listed = list(terms)
        summands = Summands(())
        sums = [summands]  # before each term
        for number, term in enumerate(listed):
            is_taken_apart = upper and term.reads is not None and self._is_large(term)
            until_read = self._until_read(listed, number, owner) if is_taken_apart else None
            if until_read is None or term.reads is None:
                summands = summands.plus(self._figure(term, owner, upper=upper, loose=loose))
            else:
                jobs = () if term.reads.job is None else (term.reads.job,)
                summands = sums[number - term.reads.before].plus(until_read)
                summands = summands.plus(self.figures(jobs, owner, upper=upper, loose=loose))
            sums.append(summands)
        return summands

    def _figure(self, term: Term, owner: str, *, upper: bool, loose: bool) -> Summands:
        """One summand."""
        if term.extreme is not None:
            sums = tuple(self.figures(inner, owner, upper=upper, loose=loose) for inner in term.extreme.sums)
            is_loose = any(item.is_loose for item in sums)
            return Summands((), ((term.extreme.kind == "max", sums),), is_loose=is_loose)
        always = term.only_waits and term.waits_where is None
        if upper and always and term.waits is not None and self._is_large(term):
            key = self._waiter(term.waits[0])
            return Summands((self._least(term, owner),), waits=((key, term.waits[1]),))
        if upper and term.message is not None and self._is_large(term):
            key = wait_key(term.message.number, has_source=term.message.has_source)
            self.waits_of[key] = partial(_waited, term, term.message.times)
            return Summands((self._least(term, owner),), waits=((key, term.message.times),))
        if loose and term.ends is not None and self._has_many_cases(term):
            return Summands((self._least(term, owner),), is_loose=True)
        return Summands((self.term(term, owner),))

    def _waiter(self, waiter: Waiter) -> int:
        """The key of a thread, its number, or of a chain in the waiting that is left open."""
        if isinstance(waiter, int):
            self.waiting.add(waiter)
            return waiter
        if len(waiter.threads) == 1:
            self.waiting.add(waiter.threads[0])
        if waiter not in self.chains:
            self.chains[waiter] = -1 - 2 * len(self.space.connections) - len(self.chains)
        return self.chains[waiter]

    def _threads_of(self, key: int) -> int:
        """Of how many threads a waiting that is left open is; one where it is a message's."""
        return next((len(chain.threads) for chain, other in self.chains.items() if other == key), 1)

    def _least(self, term: Term, owner: str) -> Diagram:
        """A summand where nothing waits."""
        return self.term(replace(term, value=partial(_least_of, term), sampled=None), owner)

    def _until_read(self, terms: Sequence[Term], number: int, owner: str) -> Summands | None:
        """A flow until the component of a term reads; None where that is not taken apart."""
        term = terms[number]
        if term.reads is None or number < term.reads.before:
            return None
        if id(term) not in self.until_read:
            try:
                made = self._made_until_read(terms[number - term.reads.before : number], term, term.reads, owner)
            except TooLarge:
                made = None
            self.until_read[id(term)] = term, made
        return self.until_read[id(term)][1]

    def _made_until_read(self, flow: Sequence[Term], term: Term, reads: Reads, owner: str) -> Summands:
        before = self.figures(flow, owner, upper=True)
        if term.sampled is None:  # the first of a flow
            return before
        scale = self.wait_scale / reads.factor

        def in_unit(figures: Summands) -> Sum:
            return self._sum(figures, 1, partial(in_units, scale), scale)

        since = {}
        for number, earlier in enumerate(flow):
            figures = self._until_read(flow, number, owner)
            if earlier.reads is not None and figures is not None:
                since[earlier.reads.receiver] = in_unit(figures)
        passage = passage_of(self.make, term, in_unit(before), since, self.wait_scale)
        if not any(leaves(passage.sender)):
            return before.plus(Summands((self.make.mapped(passage.behind, lambda leaf: Fraction(leaf) / scale),)))
        self.passages.append(passage)
        self.waiting |= passage.threads
        return Summands((), passages=((len(self.passages) - 1, reads.factor),))

    def _has_many_cases(self, term: Term) -> bool:
        """Whether a figure with a response time in it has too many cases to look at."""
        return self.make.has_more_leaves(term.value, FEW_CASES)

    def _is_large(self, term: Term) -> bool:
        """Whether a response time has too many cases to tabulate."""
        waiter = None if term.waits is None else term.waits[0]
        if isinstance(waiter, int) and self.space.components[waiter].processor is None:
            return False
        many = FEW_OF_MESSAGES if term.message is not None else FEW_DECISIONS
        if sum(decision.is_open for decision in self.space.decisions) > many:
            return True
        if term.message is not None and open_identifiers(self.space):
            return True
        return self.make.has_more_leaves(term.value, FEW_LEAVES)

    def objective(self, number: int) -> tuple[Sum, int]:
        """Objective `number`, negated when it is to be maximised."""
        measure = self.evaluator.objectives[number]
        sign = 1 if self.space.objectives[number].sense == "minimise" else -1
        figures = self.measured(measure, measure.metric.name, upper=sign > 0)
        if measure.rounded:
            return self._sum(figures, sign, partial(_rounded_up, measure.scale), Fraction(measure.scale)), 1
        steps = [weight / self.wait_scale for weight in figures.weights]
        divisor = lcm(*((step * measure.scale).denominator for step in (*figures.leaves, *steps)))
        each = Fraction(measure.scale * divisor)

        def count(value: Any) -> int:
            return int(value * each)

        return self._sum(figures, sign, count, each), divisor

    def _sum(self, figures: Summands, sign: int, count: Callable[[Any], int], scale: Fraction = ONE) -> Sum:
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
        waits, passages = (self._times(found, sign * scale) for found in (figures.waits, figures.passages))
        low = sum(min(end) for end in ends) + sum(item.low for item in picks)
        high = sum(max(end) for end in ends) + sum(item.high for item in picks)
        high += sum(times * self._threads_of(key) * UNBOUNDED_NS * self.wait_scale for key, times in waits)
        high += sum(times * self.passages[number].high for number, times in passages)
        floors = [
            self.make.mapped(part, partial(mul, times))
            for number, times in passages
            for part in self.passages[number].floor
            if times > 0
        ]
        return Sum(tuple(made), low, high, picks, waits, passages, tuple(floors))

    def _times(self, counted_waits: Iterable[tuple[int, Fraction]], scale: Fraction) -> tuple[tuple[int, int], ...]:
        """How often units of waiting count in a sum."""
        listed = [(number, weight * scale / self.wait_scale) for number, weight in counted_waits]
        if any(times.denominator != 1 for _, times in listed):
            raise TooLarge("response times have no common unit with the figures that they are added to")
        return tuple((number, int(times)) for number, times in listed)

    def limit(self, limit: Limit) -> list[SumBound]:
        """The inequalities of a requirement; one for each thread where every core has its limit."""
        operator, name = limit.requirement.operator, limit.requirement.text
        if is_message_limit(limit) and any(self._is_large(term) for term in limit.measure.terms):
            self.messages.append(limit)
            return []
        if is_late_limit(limit):
            many = sum(decision.is_open for decision in self.space.decisions) > FEW_DECISIONS
            if many or any(self.make.has_more_leaves(term.value, FEW_LEAVES) for term in limit.measure.terms):
                self.late.append(limit)
                return []
        bound = self.make.diagram(limit.bound, name)
        self.defined(bound, name)
        upper = limit.requirement.is_upper
        loose = upper and limit.cores is None and not limit.measure.rounded
        parts = self.measured(limit.measure, name, upper=upper, loose=loose)
        if parts.is_open and limit.measure.rounded:  # up, by less than the unit of waiting
            parts = parts.plus(Summands((-sum(parts.weights) / self.wait_scale,)))
        self.loose += [limit] if parts.is_loose else []
        bounds = []
        if operator in ("<=", "<", "=="):
            bounds.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), 1, strict=operator == "<"))
        if operator in (">=", ">", "=="):
            bounds.append(self.bound(name, parts, self.make.mapped(bound, as_fraction), -1, strict=operator == ">"))
        if limit.cores is not None:
            for thread, terms in limit.alone.items():
                alone, most = self.figures(terms, name), limit.cores.most
                bounds.append(self.bound(f"{name}: {thread}", alone, most, 1, strict=limit.cores.is_strict))
            table = core_table(
                limit, partial(self.term, owner=name), self.make.diagram, self.make.mapped, EXACT, COARSE
            )
            self.cores += [] if table is None else [table]
        return bounds

    def bound(self, name: str, figures: Summands, bound: Diagram, sign: int, *, strict: bool) -> SumBound:
        """The inequality sign * (figures - bound) <= 0, or < 0, in whole numbers."""
        edge = Summands((bound,))
        scale = lcm(*(leaf.denominator for item in (figures, edge) for leaf in item.leaves))
        if figures.is_open:
            scale = lcm(scale, self.wait_scale, *(self.wait_scale * item.denominator for item in figures.weights))
        exact = (figures.biggest + edge.biggest) * scale < EXACT
        if figures.is_open and not exact:
            raise TooLarge(f"{name} adds response times to figures that are too fine")
        scale = scale if exact else COARSE
        whole: Callable[[Any], int] = floor  # a lower bound of each summand: no design is lost
        low = self._sum(figures, sign, lambda value: sign * whole(sign * value * scale), Fraction(scale))
        most = self._sum(edge, 1, lambda value: whole(-sign * value * scale) + (1 if strict and exact else 0))
        made = replace(low, parts=(*low.parts, *most.parts), low=low.low + most.low, high=low.high + most.high)
        return SumBound(name, made, exact and not figures.is_open and not figures.is_loose)

    def waits(self) -> Waits:
        """The tables from which the waiting of threads follows."""
        made = waits_of(self.make, self.defined, self.waiting, self.late, self.wait_scale)
        return replace(made, messages=self.waits_of, chains={key: chain for chain, key in self.chains.items()})

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

        diagram = self.make.diagram(meets, self.space.decisions[index].name)
        return None if diagram is True else diagram


def _rounded_up(scale: int, value: Any) -> int:
    rounded: int = ceil(value * scale)
    return rounded


def may_hold_waiting(space: Space, metric: Metric) -> bool:
    """Whether response times, or the waiting of messages, may count in a metric."""
    return is_scheduled(space, metric) or bool(counted_buses(space))


def _waited(term: Term, times: Fraction, view: View) -> Fraction:
    """The waiting of a message, in ns, that counts so many times in a figure on top of its value without waiting."""
    return (term.value(view) - _least_of(term, view)) / times


def _least_of(term: Term, view: View) -> Fraction:
    """The figure of a term where nothing waits."""
    assert term.ends is not None
    return term.ends(view)[0]
