"""`dse.explain`: why a problem has no design, what would mend it, and what an offer would change."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from math import ceil
from typing import Unpack

from dse.analysis.boundaries import boundaries
from dse.analysis.evaluate import Evaluator
from dse.analysis.flow_waits import delayed_flows, unbounded_threads
from dse.analysis.lateness import Teller
from dse.analysis.limits import build_limit
from dse.analysis.measures import PPM, build_measure
from dse.analysis.overheads import safe_bounds
from dse.analysis.overloads import KINDS, overloads
from dse.analysis.rates import NS_PER_S
from dse.analysis.unbounded import rest_on_responses, unbounded_in
from dse.analysis.views import View
from dse.api.offers import cheapest_offers, with_offers
from dse.api.origins import origin_of
from dse.api.problem import Problem, Source, load
from dse.api.question import Question
from dse.pareto.conflicts import Conflicts, ConflictSet, Correction, find_conflicts
from dse.pareto.feasibility import Fixed, Member, Oracle
from dse.pareto.relaxations import Closest, closest_limit
from dse.records import dataclass
from dse.results.explain import Demand, Example, Explanation, GiveUp, MinimalConflict, Relaxation
from dse.results.points import Clash, Conflict
from dse.results.solve import decisions_of
from dse.space.activation import exclusions
from dse.space.criteria import Requirement, Rule
from dse.space.implied import overload_needed
from dse.space.metric_kinds import flows_in
from dse.space.types import Design, Space
from dse.timelimit import OutOfTime
from dse.units import Quantity, convert, format_duration, format_number

MOST_CONFLICTS = 100
UPPER_LIMITS = [(kind, operator) for kind in KINDS for operator in ("<=", "<")]


@dataclass(frozen=True)
class Wishes:
    """What is asked of an explanation: all conflicts (at most `limit`) or some, offers, time, the solver's seed."""

    every: bool = False
    limit: int = MOST_CONFLICTS
    offers: Sequence[str] = ()
    time_limit_s: float | None = None
    seed: int = 0


def explain(
    problem: Source,
    *,
    every: bool = False,
    limit: int = MOST_CONFLICTS,
    offer: str | Sequence[str] = (),
    time_limit_s: float | None = None,
    seed: int = 0,
    **question: Unpack[Question],
) -> Explanation:
    """Why a problem has no design, and the smallest changes that mend it.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    every, limit
        list all minimal conflicts, at most `limit`; else those that proving the smallest set to give up came across.
    offer
        further options, such as ``"computer.type += Spectra"``: which of them mends it, and at what price.
    time_limit_s
        seconds of wall time; what was proved until then is returned, marked as not `complete`, and so it is after
        Ctrl-C. What was not looked at is said.
    seed
        of the solver. The set of all conflicts and every figure are independent of it.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a change or an offer is.

    Examples
    --------
    >>> import dse
    >>> found = dse.explain("pump.yaml", max_jitter="5 ms")
    >>> found.status, [(item.demand.text, item.closest) for item in found.relaxations]
    ('infeasible', [('jitter of sensor_to_valve <= 5 ms', Fraction(6934000, 1))])
    """
    return explain_asked(load(problem).ask(**question), Wishes(every, limit, _texts(offer), time_limit_s, seed))


def _texts(given: str | Sequence[str]) -> Sequence[str]:
    return (given,) if isinstance(given, str) else given


def explain_asked(asked: Problem, wishes: Wishes) -> Explanation:
    """Explain the question of a problem as it stands; see `explain`."""
    started = time.monotonic()
    for text in wishes.offers:
        with_offers(asked, (text,))  # a mistake in an offer is told before the work
    explainer = Explainer.of(asked, wishes, started)
    found = explainer.explanation()
    if wishes.offers and found.status in ("infeasible", "feasible"):
        offers, complete = cheapest_offers(asked, wishes.offers, wishes.seed, explainer.oracle.deadline)
        left = () if complete else ("further offers and combinations of them",)
        found = found.with_(offers=offers, offered=tuple(wishes.offers), left_open=(*found.left_open, *left))
        found = found.with_(complete=found.complete and complete)
    return found.with_(wall_s=round(time.monotonic() - started, 3))


def conflicts_of(asked: Problem, wishes: Wishes) -> tuple[tuple[Conflict, ...], tuple[Clash, ...]]:
    """The minimal conflicts of an infeasible problem as a result has them: each member with its closest limit.

    Where no member alone mends the problem, also the fewest that do together. Figures for which there was no
    time are left out.
    """
    explainer = Explainer.of(asked, wishes, time.monotonic())
    explainer.is_brief = True
    found = explainer.explanation()
    alone = {(item.demand.text, item.demand.origin): item for item in found.relaxations}
    conflicts = []
    for conflict in found.conflicts:
        clashes = []
        for demand, _ in conflict.members:
            item = alone.get((demand.text, demand.origin))
            clashes.append(_clash(item) if item is not None else Clash(demand.text, demand.origin, is_sought=False))
        conflicts.append(Conflict(tuple(clashes)))
    together = found.give_up.members if found.give_up and not any(item.helps for item in found.relaxations) else ()
    return tuple(conflicts), tuple(_clash(item) for item in together)


def _clash(item: Relaxation) -> Clash:
    if item.demand.kind != "requirement":
        return Clash(item.demand.text, item.demand.origin)
    return Clash(
        item.demand.text,
        item.demand.origin,
        item.unit,
        item.limit,
        item.closest,
        item.thread,
        item.unbounded,
        item.is_sought,
        item.overload,
    )


@dataclass
class Explainer:
    """One problem under explanation."""

    asked: Problem
    wishes: Wishes
    oracle: Oracle = field(repr=False)
    left_open: list[str] = field(default_factory=list)
    told: dict[Design, Example] = field(default_factory=dict, repr=False)
    is_brief: bool = False

    @classmethod
    def of(cls, asked: Problem, wishes: Wishes, started: float) -> Explainer:
        """An explainer whose time limit began at `started`."""
        deadline = None if wishes.time_limit_s is None else started + wishes.time_limit_s
        return cls(asked, wishes, Oracle(asked.space, seed=wishes.seed, deadline=deadline))

    @property
    def space(self) -> Space:
        """The space of the question."""
        return self.asked.space

    def explanation(self) -> Explanation:
        """Everything but the offers."""
        excluded = tuple(exclusions(self.space))
        blank = Explanation(origin_of(self.asked), "incomplete", self.space.currency, excluded=excluded, complete=False)
        oracle = self.oracle
        try:
            design = oracle.witness(oracle.everything)
            if design is not None:
                shown = self.decisions(design)
                return blank.with_(status="feasible", complete=True, design=shown, solver_calls=oracle.calls)
            if oracle.witness(frozenset()) is None:
                return blank.with_(status="no structure", complete=True, solver_calls=oracle.calls)
        except OutOfTime:
            return blank.with_(solver_calls=oracle.calls, left_open=("whether there is a design",))
        found = find_conflicts(oracle, every=self.wishes.every, limit=self.wishes.limit)
        return self._mended(blank.with_(status="infeasible"), found)

    def _mended(self, blank: Explanation, found: Conflicts) -> Explanation:
        """The conflicts with the relaxations that mend them."""
        members = self._overloads_first({number for item in found.conflicts for number in item.members})
        relaxations = self._relaxations(members)
        give_up = self._give_up(found.smallest)
        ordered = sorted(found.conflicts, key=lambda item: not all(map(self._is_overload, item.members)))
        conflicts = tuple(self._conflict(item) for item in ordered)
        if found.reduced is not None:
            self.left_open.append("whether fewer of the demands that have no design together have none either")
        if found.stopped and self.wishes.every:
            self.left_open.append("further conflicts")
        if found.smallest is None and not found.limited:
            self.left_open.append("the fewest demands that must be given up")
        return blank.with_(
            conflicts=conflicts,
            every=found.all_conflicts,
            limited=found.limited,
            relaxations=relaxations,
            give_up=give_up,
            complete=not self.left_open,
            left_open=tuple(self.left_open),
            reduced=tuple(self.demand(number) for number in sorted(found.reduced or ())),
            solver_calls=self.oracle.calls,
            safe_bounds=self._safe_bounds(
                [*(item.members for item in found.conflicts), *filter(None, [found.reduced])]
            ),
        )

    def _safe_bounds(self, conflicts: Sequence[Iterable[int]]) -> dict[str, tuple[str, ...]]:
        """Why response times are safe bounds, where all conflicts rest on such; nothing else."""
        texts = [[self.oracle.members[number].text for number in members] for members in conflicts]
        if not rest_on_responses(self.space, texts):
            return {}
        return {why: names for why, names in safe_bounds(self.space).items() if names}

    def _is_overload(self, number: int) -> bool:
        """Whether a member limits the use of a processor or core: deadlines that nothing keeps may follow from that."""
        member = self.oracle.members[number]
        return isinstance(member, Requirement) and (member.metric.kind, member.operator) in UPPER_LIMITS

    def _overloads_first(self, members: Iterable[int]) -> list[int]:
        """Members in their order, but the limits on processors and cores first."""
        return sorted(members, key=lambda number: (not self._is_overload(number), number))

    def _conflict(self, found: ConflictSet) -> MinimalConflict:
        """Beside each member a design that meets the others, and as much else of the question as can be added."""
        return MinimalConflict(
            tuple((self.demand(number), self.example(self._fullest(found, number))) for number in found.members)
        )

    def _fullest(self, found: ConflictSet, left_out: int) -> Design:
        """A design that meets all but one member of a conflict, or at least all else of the conflict and what fits.

        Rules and fixed decisions are added before requirements: a design that breaks them is of the least use.
        """
        oracle, best = self.oracle, found.witnesses[left_out]
        wanted = oracle.everything - {left_out}
        kept = frozenset(found.members) - {left_out}
        try:
            whole = oracle.witness(wanted)
            if whole is not None:
                return whole
            for number in sorted(wanted - kept, key=lambda n: (isinstance(oracle.members[n], Requirement), n)):
                more = best if number in oracle.met_by(best) else oracle.witness(kept | {number})
                if more is not None:
                    best, kept = more, kept | {number}
        except OutOfTime:
            pass  # what the design breaks is said, and it is only an example
        return best

    def _relaxations(self, members: Sequence[int]) -> tuple[Relaxation, ...]:
        """What it takes of each member alone, as far as the time reaches."""
        found: list[Relaxation] = []
        try:
            found += (self.relaxation(number, frozenset({number})) for number in members)
        except OutOfTime:
            texts = "; ".join(self.oracle.members[number].text for number in members[len(found) :])
            self.left_open.append(f"whether one of these alone mends it, and how far it must move: {texts}")
        return tuple(found)

    def _give_up(self, smallest: Correction | None) -> GiveUp | None:
        if smallest is None:
            return None
        together, ordered = frozenset(smallest.members), self._overloads_first(smallest.members)
        try:
            members = tuple(self.relaxation(number, together) for number in ordered)
        except OutOfTime:
            members = tuple(Relaxation(self.demand(number), True, is_sought=False) for number in ordered)
            self.left_open.append("how far each of those that must be given up is from its limit")
        return GiveUp(members, self.example(smallest.witness))

    def relaxation(self, number: int, given_up: frozenset[int]) -> Relaxation:
        """What it takes of member `number`, while the others of `given_up` are given up and the rest holds."""
        oracle, member = self.oracle, self.oracle.members[number]
        witness = oracle.witness(oracle.everything - given_up)
        demand = self.demand(number)
        if witness is None:
            return Relaxation(demand, False, Example({}), *_own_limit(self.space, member))
        if not isinstance(member, Requirement):
            return Relaxation(demand, True, self.example(witness))
        try:
            closest = closest_limit(oracle, oracle.everything - given_up, member)
        except OutOfTime:
            self.left_open.append(f"how far this must move: {member.text}")
            return Relaxation(demand, True, self.example(witness), is_sought=False)
        if closest is None:
            return Relaxation(demand, True, self.example(witness), *_own_limit(self.space, member))
        return self._moved(demand, member, closest)

    def _moved(self, demand: Demand, member: Requirement, closest: Closest) -> Relaxation:
        unit, limit = _own_limit(self.space, member)
        example = self.example(closest.witness)
        if unbounded := unbounded_in(self.space, member.metric, View(closest.witness)):
            return Relaxation(demand, True, example, unit, limit, unbounded=unbounded)
        return Relaxation(
            demand=demand,
            helps=True,
            example=example,
            unit=unit,
            limit=limit,
            closest=closest.limit * _factor(self.space, member),
            operator=member.operator,
            thread=closest.thread,
            text=_rewritten(member, closest.limit),
            overload=overload_needed(self.space, member, closest.limit),
        )

    def demand(self, number: int) -> Demand:
        """A member in the user's words."""
        member: Member = self.oracle.members[number]
        if isinstance(member, Fixed):
            return Demand("fixed decision", member.text, member.origin)
        return Demand("rule" if isinstance(member, Rule) else "requirement", member.text, member.origin)

    @cached_property
    def evaluator(self) -> Evaluator:
        """The analysis of the question."""
        return Evaluator(self.space)

    def example(self, design: Design) -> Example:
        """A design as it is named, with what it breaks; many demands have the same."""
        if design not in self.told:
            self.told[design] = self._example(design)
        return self.told[design]

    def _example(self, design: Design) -> Example:
        if self.is_brief:  # nobody looks at it
            return Example({})
        broken = sorted(self.oracle.everything - self.oracle.met_by(design))
        view = View(design)
        verdicts, teller = self.evaluator.evaluate(design).verdicts, Teller(self.space, view)
        late = tuple(teller.late_threads(verdicts))
        late += tuple(
            item for item in unbounded_threads(teller, verdicts) if item.thread not in {other.thread for other in late}
        )
        full = tuple(overloads(self.space, verdicts, view, late))
        delayed = tuple(delayed_flows(teller, verdicts))
        limited = [self.oracle.members[number] for number in broken]
        flows = {
            name for item in limited if isinstance(item, Requirement) for name in flows_in(self.space, item.metric)
        }
        read = tuple(item for item in boundaries(self.space, view) if item.flow in flows) if flows else ()
        return Example(
            self.decisions(design), tuple(self.demand(number) for number in broken), full, late, delayed, read
        )

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
    return "ppm" if member.is_share else build_measure(space, member.metric).unit, limit


def _factor(space: Space, member: Requirement) -> Fraction:
    """How many of the shown unit make one coherent unit of the limit."""
    if member.is_share:
        return Fraction(PPM)
    if member.metric.key == "deadline":
        return Fraction(NS_PER_S)
    one = Quantity(Fraction(1), member.limit.dimension, member.limit.unit)
    any_design = View(())  # such a bound is the same in every design
    return build_limit(space, Requirement("", member.metric, "<=", one)).bound(any_design)


def _rewritten(member: Requirement, limit: Fraction) -> str:
    """The requirement as it may be written so that the others leave a design; "" for one that nobody wrote."""
    if member.implied:
        return ""
    if member.metric.key == "deadline":
        return f"{member.text} + {format_duration(ceil(limit * NS_PER_S))}"
    operator = {"<": "<=", ">": ">="}.get(member.operator, member.operator)
    quantity = Quantity(limit, member.limit.dimension, member.limit.unit)
    written = member.limit.dimension is not None and member.limit.unit != ""
    number = convert(quantity, member.limit.unit) if written else limit
    return f"{member.metric.name} {operator} {format_number(number)} {member.limit.unit}".rstrip()
