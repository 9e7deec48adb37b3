"""`dse.explain`: why a problem has no design, what would mend it, and what an offer would change."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Unpack

from dse.analysis.bounds import Ends, Impossible, impossible
from dse.analysis.diagnosis.front_verdicts import waiting_counted
from dse.analysis.diagnosis.overload_search import lightened
from dse.analysis.diagnosis.unbounded import unbounded_in
from dse.analysis.scheduling.overheads import safe_bounds
from dse.analysis.views import View
from dse.answers.explanation import Demand, Example, Explanation, GiveUp, MinimalConflict, Relaxation
from dse.questions.explain.examples import NamedDesigns
from dse.questions.explain.limits import factor, own_limit, rewritten
from dse.questions.explain.offers import cheapest_offers, with_offers
from dse.questions.explain.without_contention import Uncontended, limits_use
from dse.questions.problem import Problem, Source, load, origin_of
from dse.questions.question import Question
from dse.search.feasibility.conflicts import Conflicts, ConflictSet, Correction, find_conflicts
from dse.search.feasibility.oracle import Oracle
from dse.search.feasibility.relaxations import Closest, closest_limit
from dse.space.architecture.activation import exclusions
from dse.space.model.criteria import Requirement
from dse.space.model.space import Design, Space
from dse.space.question.implied import overloads_needed
from dse.support import arguments
from dse.support.timelimit import OutOfTime, until
from dse.support.units.text import count_words

MOST_CONFLICTS = 100
EFFORT = 4.0
"""Work (`dse.search.solver.settings`) at an infeasible problem where neither a time nor all conflicts are asked for."""


@dataclass(frozen=True)
class Listener:
    """Callbacks of an explanation: `asks` gets the current step in words, `finds` each minimal conflict."""

    asks: Callable[[str], None] = lambda _: None
    finds: Callable[[Sequence[Demand]], None] = lambda _: None


@dataclass(frozen=True)
class Wishes:
    """The settings of an explanation: all conflicts (at most `limit`) or some, offers, time, the solver's seed.

    `every` asks for all conflicts instead of some, at most `limit`; `offers` are further options such as
    ``computer.type += Spectra``, to be tried cheapest first; `time_limit_s` is in seconds of wall time, None for no
    limit.
    """

    every: bool = False
    limit: int = MOST_CONFLICTS
    offers: Sequence[str] = ()
    time_limit_s: float | None = None
    seed: int = 0


@arguments.checked(
    also=Question.__annotations__,
    every=arguments.flag,
    limit=arguments.Whole(1, 10**9),
    offer=arguments.texts,
    time_limit_s=arguments.span,
    seed=arguments.SEED,
)
def explain(
    problem: Source,
    *,
    every: bool = False,
    limit: int = MOST_CONFLICTS,
    offer: str | Sequence[str] = (),
    time_limit_s: arguments.Span | None = None,
    seed: int = 0,
    **question: Unpack[Question],
) -> Explanation:
    """Why a problem has no design, and the smallest relaxations that make it feasible.

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
        Ctrl-C. What was not looked at is said. Without a limit and without `every`, what takes more than about 10
        seconds of a processor once the problem is proved infeasible is not looked at either.
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
    seconds = arguments.time_limit(time_limit_s).seconds
    wishes = Wishes(every, limit, arguments.texts("offer", offer), seconds, seed)
    return explain_asked(load(problem).ask(**question), wishes)


def explain_asked(problem: Problem, wishes: Wishes, listener: Listener | None = None) -> Explanation:
    """Explain the question of a problem as it stands; see `explain`.

    An `Explanation` with status, conflicts, relaxations, the offers by price, and what was left open when the time
    limit was reached. The `listener` is told of conflicts as soon as they are known.

    Raises `UsageError` for an offer that names no requirement, before the search for conflicts begins.
    """
    started = time.monotonic()
    for text in wishes.offers:
        with_offers(problem, (text,))  # a mistake in an offer is told before the work
    explainer = Explainer.of(problem, wishes, started)
    explainer.listener = listener or explainer.listener
    explanation = explainer.explanation()
    if wishes.offers and explanation.status in ("infeasible", "feasible"):
        offers, complete = cheapest_offers(problem, wishes.offers, wishes.seed, explainer.oracle.deadline)
        left = () if complete else ("further offers and combinations of them",)
        explanation = explanation.with_(
            offers=offers, offered=tuple(wishes.offers), left_open=(*explanation.left_open, *left)
        )
        explanation = explanation.with_(complete=explanation.complete and complete)
    return explanation.with_(wall_s=round(time.monotonic() - started, 3))


@dataclass
class Explainer:
    """One problem under explanation.

    It keeps the solver (`oracle`), a second one without waiting of threads (`uncontended`), and the designs that the
    explanation names. Made by `Explainer.of`.
    """

    asked: Problem
    wishes: Wishes
    oracle: Oracle = field(repr=False)
    uncontended: Uncontended = field(repr=False)
    designs: NamedDesigns = field(repr=False)
    listener: Listener = field(default_factory=Listener, repr=False)
    left_open: list[str] = field(default_factory=list)
    lighter: dict[Design, Design] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, problem: Problem, wishes: Wishes, started: float, *, is_brief: bool = False) -> Explainer:
        """An explainer whose time limit began at `started`; one that `is_brief` tells of no design.

        `started` is a reading of `time.monotonic()`; the deadline of both solvers is that many seconds after it. With
        `is_brief` the explanation contains conflicts but no example designs.
        """
        deadline = None if wishes.time_limit_s is None else started + wishes.time_limit_s
        oracle = Oracle(problem.space, seed=wishes.seed, deadline=deadline)
        uncontended = Uncontended(problem.space, oracle)
        return cls(problem, wishes, oracle, uncontended, NamedDesigns(problem.space, oracle, is_brief))

    @property
    def space(self) -> Space:
        """The space of the question."""
        return self.asked.space

    def explanation(self) -> Explanation:
        """The explanation without offers.

        The status is *feasible* with a design that meets every demand, *no structure* where no design exists even
        without requirements, *infeasible* with conflicts and relaxations, or *incomplete* when the time limit came
        before the first of these.
        """
        excluded = tuple(exclusions(self.space))
        waiting = waiting_counted(self.space)
        blank = Explanation(
            origin_of(self.asked), "incomplete", self.space.currency, excluded=excluded, complete=False, waiting=waiting
        )
        oracle, apart = self.oracle, self.uncontended
        try:
            design = None if apart.is_refuted else oracle.witness(oracle.everything)
            if design is not None:
                shown = self.designs.decisions(design)
                return blank.with_(status="feasible", complete=True, design=shown, solver_calls=self.calls)
            if oracle.witness(frozenset()) is None:
                return blank.with_(status="no structure", complete=True, solver_calls=self.calls)
        except OutOfTime:
            return blank.with_(solver_calls=self.calls, left_open=("whether there is a design",))
        return self._explained(blank.with_(status="infeasible", impossible=self._impossible()))

    @property
    def calls(self) -> int:
        """The questions that were solved.

        The number of solver calls of both solvers, with and without waiting of threads.
        """
        return self.oracle.calls + self.uncontended.oracle.calls

    def _impossible(self) -> tuple[Impossible, ...]:
        """The requirements that bounds alone prove impossible; none where bounds take more time than is left."""
        try:
            with until(self.oracle.deadline):
                return tuple(impossible(self.designs.evaluator.limits, Ends(self.space)))
        except OutOfTime:
            return ()

    def _explained(self, blank: Explanation) -> Explanation:
        """The conflicts, those first in which no thread waits, and what would mend them.

        Where threads need more than there is of a processor nothing is told of how they wait for each other because of
        that, unless all conflicts are asked for, or a design is at hand that keeps all else.
        """
        every, limit, oracle = self.wishes.every, self.wishes.limit, self.oracle
        if not every and self.wishes.time_limit_s is None:
            oracle.time_left.work = EFFORT
        if not self.uncontended.is_refuted:
            return self._mended(blank, find_conflicts(oracle, every=every, limit=limit, heard=self._hear))
        blank = blank.with_(without_waiting=True)
        apart = self.uncontended.conflicts(every=every, limit=limit, heard=self._hear)
        known = [frozenset(item.members) for item in apart.conflicts]
        if not every and not self._holds_without(apart.smallest):
            self.designs.unseen = self._unseen(known)
        conflicts = find_conflicts(
            oracle, every=every, limit=limit, known=known, among=self.designs.seen, heard=self._hear
        )
        if self.designs.unseen and conflicts.smallest is not None and self._holds_as_well(conflicts.smallest):
            self.designs.unseen = frozenset()
        return self._mended(blank, conflicts)

    def _hear(self, members: frozenset[int], is_minimal: bool) -> None:
        """Tell of a set that has no design."""
        if is_minimal:
            self.listener.finds([self.designs.demand(number) for number in sorted(members)])
        demands, questions = count_words(len(members), "demand"), count_words(self.calls, "question")
        self.listener.asks(f"{demands} without a design, {questions} solved")

    def _unseen(self, known: Sequence[frozenset[int]]) -> frozenset[int]:
        """What may follow from overloads in some conflicts; nothing where that takes more time than there is."""
        try:
            return self.uncontended.follow_from_overloads(known)
        except OutOfTime:
            return frozenset()

    def _holds_without(self, smallest: Correction | None) -> bool:
        """Whether a design is at hand that meets all but what must be given up even if no thread waited."""
        if smallest is None:
            return False
        design = self.uncontended.whole(smallest.witness)
        return self.oracle.everything - {*smallest.members} <= self.oracle.shown(design)

    def _holds_as_well(self, smallest: Correction) -> bool:
        """Whether what is left of the members that are seen has a design with those that are not.

        That is not asked where a processor may be overloaded then.
        """
        if any(limits_use(self.oracle.members[number]) for number in smallest.members):
            return False
        try:
            return self.oracle.witness(self.oracle.everything - {*smallest.members}) is not None
        except OutOfTime:
            return False

    def _mended(self, blank: Explanation, conflicts: Conflicts) -> Explanation:
        """The conflicts with the relaxations that remove them."""
        self.listener.asks("looking for what makes it feasible")
        members = self._statements({number for item in conflicts.conflicts for number in item.members})
        give_up = self._give_up(conflicts.smallest)
        if conflicts.smallest is None and (not conflicts.limited or self.designs.unseen):
            self.left_open.append("the fewest demands that must be relaxed")
        if self.designs.unseen:
            return self._told(blank.with_(least=give_up), conflicts)
        return self._told(blank.with_(relaxations=self._relaxations(members), give_up=give_up), conflicts)

    def _told(self, blank: Explanation, result: Conflicts) -> Explanation:
        """The conflicts, and what was left open."""
        members = [(self._conflict(item), item.members) for item in result.conflicts]
        members.sort(
            key=lambda item: (item[0].by_waiting, not all(limits_use(self.oracle.members[n]) for n in item[1]))
        )
        conflicts = tuple(conflict for conflict, _ in members)
        if result.reduced is not None:
            self.left_open.append("whether fewer of the demands that have no design together have none either")
        if result.stopped and self.wishes.every:
            self.left_open.append("further conflicts")
        return blank.with_(
            conflicts=conflicts,
            every=result.all_conflicts,
            limited=result.limited,
            complete=not self.left_open,
            left_open=tuple(self.left_open),
            reduced=tuple(self.designs.demand(number) for number in sorted(result.reduced or ())),
            solver_calls=self.calls,
            safe_bounds=self._safe_bounds(conflicts, result.reduced),
        )

    def _safe_bounds(
        self, conflicts: Sequence[MinimalConflict], reduced: frozenset[int] | None
    ) -> dict[str, tuple[str, ...]]:
        """Why response times are safe bounds, where all conflicts rest on such; nothing else."""
        by_waiting = [item.by_waiting for item in conflicts]
        if reduced is not None:
            by_waiting.append(self._takes_waiting(reduced))
        if not by_waiting or not all(by_waiting):
            return {}
        return {why: names for why, names in safe_bounds(self.space).items() if names}

    def _takes_waiting(self, members: Iterable[int]) -> bool:
        """Whether it takes that threads wait for each other; so, too, where there was no time to find out."""
        try:
            return self.uncontended.takes_waiting(members)
        except OutOfTime:
            return True

    def _statements(self, members: Iterable[int]) -> list[tuple[int, ...]]:
        """The statements of the members, each with all that it demands, in order; limits on processors come first."""
        named = frozenset(members)
        statements = [item for item in self.oracle.statements if not named.isdisjoint(item)]
        return sorted(statements, key=lambda item: (not limits_use(self.oracle.members[item[0]]), item))

    def _conflict(self, conflict: ConflictSet) -> MinimalConflict:
        """A conflict with a design for each member, which meets the others and as much else as possible."""
        return MinimalConflict(
            tuple(
                (self.designs.demand(number), self._example(self._fullest(conflict, number)))
                for number in conflict.members
            ),
            self._takes_waiting(conflict.members),
        )

    def _fullest(self, conflict: ConflictSet, left_out: int) -> Design:
        """A design that meets all but one member of a conflict, or at least all else of the conflict and what fits.

        Rules and fixed decisions are added before requirements: a design that breaks them is of the least use.
        """
        oracle, best = self.oracle, conflict.witnesses[left_out]
        if self.designs.is_brief:
            return best
        wanted = self.designs.seen - {left_out}
        kept = frozenset(conflict.members) - {left_out}
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

    def _relaxations(self, statements: Sequence[tuple[int, ...]]) -> tuple[Relaxation, ...]:
        """The relaxation of each statement alone, as far as time allows."""
        relaxations: list[Relaxation] = []
        try:
            relaxations += (self.relaxation(item, frozenset(item)) for item in statements)
        except OutOfTime:
            texts = "; ".join(self.designs.stated(item).text for item in statements[len(relaxations) :])
            self.left_open.append(f"whether relaxing one of these is enough, and how far: {texts}")
        return tuple(relaxations)

    def _give_up(self, smallest: Correction | None) -> GiveUp | None:
        if smallest is None:
            return None
        ordered = self._statements(smallest.members)
        together = frozenset(number for item in ordered for number in item) | self.designs.unseen
        try:
            members = tuple(self.relaxation(item, together) for item in ordered)
        except OutOfTime:
            members = tuple(Relaxation(self.designs.stated(item), True, is_sought=False) for item in ordered)
            self.left_open.append("the closest limit of each demand that must be relaxed")
        return GiveUp(members, self._example(smallest.witness))

    def _example(self, design: Design) -> Example:
        """A design as it is named; where it is overloaded, whatever is given up, as little as is found soon."""
        return self.designs.example(self._lightened(design) if self.designs.unseen else design)

    def _lightened(self, design: Design) -> Design:
        """A design that keeps what is looked at as well, and in which processors are overloaded less."""
        if self.designs.is_brief:
            return design
        oracle, kept = self.oracle, self.oracle.met_by(design) & self.designs.seen

        def is_allowed(other: Design) -> bool:
            return kept <= oracle.met_by(other)

        if design not in self.lighter:
            evened = self.uncontended.evened(design)
            first = evened if is_allowed(evened) else design
            try:
                with until(oracle.deadline):
                    self.lighter[design] = lightened(
                        self.designs.evaluator, first, self.uncontended.overloaded_processors, is_allowed
                    )
            except OutOfTime:
                return first
            except KeyboardInterrupt:
                oracle.deadline = time.monotonic()
                return first
        return self.lighter[design]

    def relaxation(self, statement: tuple[int, ...], given_up: frozenset[int]) -> Relaxation:
        """The relaxation that the members of one statement need, while the others of `given_up` may be violated.

        `statement` are the member numbers to be relaxed, `given_up` all members that may be violated. The `Relaxation`
        says how far the limit must move, with a design that shows it.
        """
        texts = tuple(self.oracle.members[number].text for number in statement)
        return replace(self._relaxation(statement, given_up), together=texts if len(texts) > 1 else ())

    def _relaxation(self, statement: tuple[int, ...], given_up: frozenset[int]) -> Relaxation:
        oracle, member = self.oracle, self.oracle.members[statement[0]]
        witness = oracle.witness(oracle.everything - given_up)
        demand = self.designs.stated(statement)
        if witness is None:
            return Relaxation(demand, False, Example({}), *own_limit(self.space, member))
        if not isinstance(member, Requirement) or (self.designs.unseen and limits_use(member)):
            return Relaxation(demand, True, self._example(witness))
        members = [item for number in statement if isinstance(item := oracle.members[number], Requirement)]
        try:
            closest = closest_limit(oracle, oracle.everything - given_up, *members)
        except OutOfTime:
            self.left_open.append(f"how far this must move: {demand.text}")
            return Relaxation(demand, True, self._example(witness), is_sought=False)
        if closest is None:
            return Relaxation(demand, True, self._example(witness), *own_limit(self.space, member))
        return self._moved(demand, members, closest)

    def _moved(self, demand: Demand, members: Sequence[Requirement], closest: Closest) -> Relaxation:
        member, is_one = members[0], len(members) == 1
        unit, limit = own_limit(self.space, member)
        example, view = self._example(closest.witness), View(closest.witness)
        unbounded = tuple(
            dict.fromkeys(name for item in members for name in unbounded_in(self.space, item.metric, view))
        )
        if unbounded:
            return Relaxation(demand, True, example, unit, limit, unbounded=unbounded)
        return Relaxation(
            demand=demand,
            helps=True,
            example=example,
            unit=unit,
            limit=limit,
            closest=closest.limit * factor(self.space, member),
            operator=member.operator,
            thread=closest.thread,
            text=rewritten(member, closest.limit, as_stated=not is_one),
            overload=overloads_needed(self.space, members, closest.limit),
        )
