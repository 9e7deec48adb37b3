"""`dse.explain`: why a problem has no design, what would mend it, and what an offer would change."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations
from math import ceil
from pathlib import Path

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit
from dse.analysis.measures import PPM, build_measure
from dse.analysis.patience import OutOfTime
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import View
from dse.api.offering import with_offers
from dse.api.origins import origin_of
from dse.api.problem import Changes, Problem, changed, load
from dse.pareto.conflicts import Conflicts, Correction, find_conflicts
from dse.pareto.feasibility import Fixed, Member, Oracle, find_design
from dse.pareto.relaxations import Closest, closest_limit
from dse.results.explanation import Demand, Explanation, GiveUp, MinimalConflict, Offer, Relaxation
from dse.results.result import Clash, Conflict, decisions_of
from dse.space.types import Design, Metric, Requirement, Rule, Space
from dse.units import DIMENSIONLESS, Quantity, convert, format_duration, format_number

MOST_CONFLICTS = 100
MOST_COMBINATIONS = 200


@dataclass(frozen=True)
class Wishes:
    """What is asked of an explanation: all conflicts (at most `limit`) or some, offers, time, the solver's seed."""

    every: bool = False
    limit: int = MOST_CONFLICTS
    offers: Sequence[str] = ()
    time_limit_s: float | None = None
    seed: int = 0


def explain(
    problem: Problem | str | Path,
    changes: Changes | None = None,
    *,
    require: str | Sequence[str] = (),
    fix: str | Sequence[str] = (),
    processing: str | None = None,
    deadlines: str | None = None,
    every: bool = False,
    limit: int = MOST_CONFLICTS,
    offer: str | Sequence[str] = (),
    time_limit_s: float | None = None,
    seed: int = 0,
) -> Explanation:
    """Why a problem has no design, and the smallest changes that mend it.

    Parameters
    ----------
    problem
        a loaded problem, or the path of a problem file.
    changes
        limits, requirements, rules, fixed decisions and profile beyond the file.
    require, fix, processing, deadlines
        a shorthand for the most frequent of them.
    every, limit
        list all minimal conflicts, at most `limit`; else those that proving the smallest set to give up came across.
    offer
        further options, such as ``"computer.type += Spectra"``: which of them mends it, and at what price.
    time_limit_s
        seconds of wall time; what was proved until then is returned, marked as not `complete`.
    seed
        of the solver. The set of all conflicts and every figure are independent of it.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a change or an offer is.
    """
    loaded = problem if isinstance(problem, Problem) else load(problem)
    given = changes or Changes()
    asked = replace(given, require=(*given.require, *_texts(require)), fix=(*given.fix, *_texts(fix)))
    asked = asked.with_settings(processing=processing, deadlines=deadlines)
    return explain_changed(loaded, asked, Wishes(every, limit, _texts(offer), time_limit_s, seed))


def _texts(given: str | Sequence[str]) -> Sequence[str]:
    return (given,) if isinstance(given, str) else given


def explain_changed(problem: Problem, changes: Changes, wishes: Wishes) -> Explanation:
    """Explain a problem with a caller's changes; see `explain`."""
    started = time.monotonic()
    for text in wishes.offers:
        with_offers(problem, (text,), changes)  # a mistake in an offer is told before the work
    explainer = Explainer.of(changed(problem, changes), wishes, started)
    found = explainer.explanation()
    if wishes.offers and found.status in ("infeasible", "feasible") and found.complete:
        offers, complete = _cheapest(problem, changes, wishes, explainer.deadline)
        found = found.with_(offers=offers, offered=tuple(wishes.offers), complete=complete)
    return found.with_(wall_s=round(time.monotonic() - started, 3))


def conflicts_of(asked: Problem, wishes: Wishes) -> tuple[tuple[Conflict, ...], tuple[Clash, ...]]:
    """The minimal conflicts of an infeasible problem as a result has them: each member with its closest limit.

    Where no member alone mends the problem, also the fewest that do together.
    """
    found = Explainer.of(asked, wishes, time.monotonic()).explanation()
    alone = {(item.demand.text, item.demand.origin): item for item in found.relaxations}
    conflicts = []
    for conflict in found.conflicts:
        clashes = []
        for demand, _ in conflict.members:
            item = alone.get((demand.text, demand.origin))
            clashes.append(_clash(item) if item is not None else Clash(demand.text, demand.origin))
        conflicts.append(Conflict(tuple(clashes)))
    together = found.give_up.members if found.give_up and not any(item.helps for item in found.relaxations) else ()
    return tuple(conflicts), tuple(_clash(item) for item in together)


def _clash(item: Relaxation) -> Clash:
    if item.demand.kind != "requirement":
        return Clash(item.demand.text, item.demand.origin)
    return Clash(item.demand.text, item.demand.origin, item.unit, item.limit, item.closest, item.thread)


@dataclass
class Explainer:
    """One problem under explanation."""

    asked: Problem
    wishes: Wishes
    deadline: float | None
    oracle: Oracle = field(repr=False)

    @classmethod
    def of(cls, asked: Problem, wishes: Wishes, started: float) -> Explainer:
        """An explainer whose time limit began at `started`."""
        deadline = None if wishes.time_limit_s is None else started + wishes.time_limit_s
        return cls(asked, wishes, deadline, Oracle(asked.space, seed=wishes.seed, deadline=deadline))

    @property
    def space(self) -> Space:
        """The space of the question."""
        return self.asked.space

    def explanation(self) -> Explanation:
        """Everything but the offers."""
        blank = Explanation(origin_of(self.asked), "incomplete", self.space.currency, complete=False)
        oracle = self.oracle
        try:
            design = oracle.witness(oracle.everything)
            if design is not None:
                shown = self.decisions(design)
                return blank.with_(status="feasible", complete=True, design=shown, solver_calls=oracle.calls)
            if oracle.witness(frozenset()) is None:
                return blank.with_(status="no structure", complete=True, solver_calls=oracle.calls)
        except OutOfTime:
            return blank.with_(solver_calls=oracle.calls)
        found = find_conflicts(oracle, every=self.wishes.every, limit=self.wishes.limit)
        return self._mended(blank.with_(status="infeasible"), found)

    def _mended(self, blank: Explanation, found: Conflicts) -> Explanation:
        """The conflicts with the relaxations that mend them."""
        conflicts = tuple(
            MinimalConflict(tuple((self.demand(n), self.decisions(item.witnesses[n])) for n in item.members))
            for item in found.conflicts
        )
        members = sorted({number for item in found.conflicts for number in item.members})
        relaxations: list[Relaxation] = []
        give_up: GiveUp | None = None
        stopped = found.stopped
        try:
            relaxations += (self.relaxation(number, frozenset({number})) for number in members)
            give_up = self._give_up(found.smallest)
        except OutOfTime:
            stopped = True
        return blank.with_(
            conflicts=conflicts,
            every=found.all_conflicts,
            limited=found.limited,
            relaxations=tuple(relaxations),
            give_up=give_up,
            complete=not stopped,
            solver_calls=self.oracle.calls,
        )

    def _give_up(self, smallest: Correction | None) -> GiveUp | None:
        if smallest is None:
            return None
        together = frozenset(smallest.members)
        members = tuple(self.relaxation(number, together) for number in smallest.members)
        return GiveUp(members, self.decisions(smallest.witness))

    def relaxation(self, number: int, given_up: frozenset[int]) -> Relaxation:
        """What it takes of member `number`, while the others of `given_up` are given up and the rest holds."""
        oracle, member = self.oracle, self.oracle.members[number]
        witness = oracle.witness(oracle.everything - given_up)
        demand = self.demand(number)
        if witness is None:
            return Relaxation(demand, False, {}, *_own_limit(self.space, member))
        if not isinstance(member, Requirement):
            return Relaxation(demand, True, self.decisions(witness))
        closest = closest_limit(oracle, oracle.everything - given_up, member)
        if closest is None:
            return Relaxation(demand, True, self.decisions(witness), *_own_limit(self.space, member))
        return self._moved(demand, member, closest)

    def _moved(self, demand: Demand, member: Requirement, closest: Closest) -> Relaxation:
        unit, limit = _own_limit(self.space, member)
        return Relaxation(
            demand=demand,
            helps=True,
            design=self.decisions(closest.witness),
            unit=unit,
            limit=limit,
            closest=closest.limit * _factor(self.space, member),
            operator=member.operator,
            thread=closest.thread,
            text=_rewritten(member, closest.limit),
        )

    def demand(self, number: int) -> Demand:
        """A member in the user's words."""
        member: Member = self.oracle.members[number]
        if isinstance(member, Fixed):
            return Demand("fixed decision", member.text, member.origin)
        return Demand("rule" if isinstance(member, Rule) else "requirement", member.text, member.origin)

    def decisions(self, design: Design) -> dict[str, str]:
        """The active open decisions of a design."""
        return decisions_of(self.space, design)


def _own_limit(space: Space, member: Member) -> tuple[str, Fraction | None]:
    """The unit and the limit of a requirement as an explanation shows them; nothing for other members."""
    if not isinstance(member, Requirement):
        return "", None
    if member.metric.key == "deadline":
        return "ns", Fraction(0)
    limit = member.limit.value * _factor(space, member)
    return "ppm" if _is_share(member) else build_measure(space, member.metric).unit, limit


def _is_share(member: Requirement) -> bool:
    """Whether the limit is a share of a processor or of a bandwidth."""
    return member.metric.kind in ("utilisation", "load") and member.limit.dimension == DIMENSIONLESS


def _factor(space: Space, member: Requirement) -> Fraction:
    """How many of the shown unit make one coherent unit of the limit."""
    if _is_share(member):
        return Fraction(PPM)
    if member.metric.key == "deadline":
        return Fraction(NS_PER_S)
    one = Quantity(Fraction(1), member.limit.dimension, member.limit.unit)
    any_design = View(())  # such a bound is the same in every design
    return build_limit(space, Requirement("", member.metric, "<=", one)).bound(any_design)


def _rewritten(member: Requirement, limit: Fraction) -> str:
    """The requirement as it may be written so that the others leave a design."""
    if member.metric.key == "deadline":
        return f"{member.text} + {format_duration(ceil(limit * NS_PER_S))}"
    operator = {"<": "<=", ">": ">="}.get(member.operator, member.operator)
    quantity = Quantity(limit, member.limit.dimension, member.limit.unit)
    written = member.limit.dimension is not None and member.limit.unit != ""
    number = convert(quantity, member.limit.unit) if written else limit
    return f"{member.metric.name} {operator} {format_number(number)} {member.limit.unit}".rstrip()


def _cheapest(
    problem: Problem, changes: Changes, wishes: Wishes, deadline: float | None
) -> tuple[tuple[Offer, ...], bool]:
    """Each offer alone, cheapest design first; where none suffices, the smallest combinations that do."""
    combined: Iterable[tuple[str, ...]] = (
        group for count in range(1, len(wishes.offers) + 1) for group in combinations(wishes.offers, count)
    )
    found: list[Offer] = []
    for position, group in enumerate(combined):
        mended = [offer for offer in found if offer.price is not None]
        if mended and len(group) > len(mended[0].texts):
            break
        if position >= MOST_COMBINATIONS:
            return _by_price(found), False
        try:
            found.append(_tried(with_offers(problem, group, changes).space, group, wishes.seed, deadline))
        except OutOfTime:
            return _by_price(found), False
    return _by_price(found), True


def _by_price(offers: list[Offer]) -> tuple[Offer, ...]:
    """Those that mend the problem, cheapest first; then single offers that do not."""
    kept = [offer for offer in offers if offer.price is not None or len(offer.texts) == 1]
    return tuple(sorted(kept, key=lambda offer: (offer.price is None, offer.price or 0, offer.texts)))


def _tried(space: Space, texts: tuple[str, ...], seed: int, deadline: float | None) -> Offer:
    price = build_measure(space, Metric("price", "price", None, "price"))
    demanded = replace(space, objectives=())
    design = find_design(demanded, price, seed=seed, deadline=deadline)
    if design is None:
        return Offer(texts, None, price.counting_unit, {})
    assert Evaluator(demanded).evaluate(design).is_feasible
    return Offer(texts, price.integer(View(design)), price.counting_unit, decisions_of(space, design))
