"""The conflicts that a result lists, proved a second time: impossible together, minimal, and the limits exact.

Every question is asked of the means of `dse.verification` (each design looked at, or the second model); nothing of the
search that found the conflicts is used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import PurePath
from typing import Any, TypeAlias

from dse.analysis.diagnosis.unbounded import unbounded_from, unbounded_in
from dse.analysis.diagnosis.without_contention import uncontended_limit
from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit, build_limit, judge
from dse.analysis.measures import PPM, build_measure
from dse.analysis.views import View
from dse.answers.tables.display import exact
from dse.questions.verify.points import Bench
from dse.space.model.criteria import Requirement, Rule
from dse.space.model.space import Design, Space
from dse.space.question.implied import overloads_needed
from dse.space.question.metrics import QuestionError
from dse.space.question.reading import read_requirements
from dse.spec.language.expressions import Operator
from dse.spec.language.grammar import ExpressionError
from dse.support.units.text import DECIMALS
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany
from dse.verification.prover import Method, make_prover
from dse.verification.solver_calls import Reply


@dataclass(frozen=True)
class FixedDecision:
    """A decision that was fixed beyond the file.

    `decision` and `option` are numbers of the space, `text` is ``DECISION=OPTION``. It is a member of a conflict next
    to requirements and rules.
    """

    decision: int
    option: int
    text: str
    origin: str = "command line"


Demand: TypeAlias = Requirement | Rule | FixedDecision


def check_conflicts(bench: Bench, method: Method, deadline: float | None) -> None:
    """Check that each listed conflict is infeasible and minimal, and that each limit is exact.

    Each claim is decided by the second proof, without the solver's conflict search. Findings go to `bench`, what was
    not decided before `deadline` to ``bench.left_open``.
    """
    listed = bench.data["conflicts"]
    if bench.data["status"] != "infeasible":
        if listed:
            bench.find("conflicts", f"a result that is {bench.data['status']} has none")
        return
    if not listed:
        if bench.data.get("give_up"):
            bench.find("give_up", "is stated without any conflict that it would remove")
        bench.remarks.append(
            "no conflict is listed: why there is no design was not confirmed; there was no time to look for it, or it "
            "was left out (`dse explain` finds it)"
        )
        return
    court = _Court(bench, method, deadline)
    for position, conflict in enumerate(listed):
        court.examine(f"conflicts[{position}]", conflict["members"])
        if not conflict.get("by_waiting", True):
            court.examine_alone(f"conflicts[{position}]", conflict["members"])
    court.examine_together("give_up", bench.data.get("give_up", []))
    bench.checked.append(
        f"{len(listed)} conflicts: impossible, minimal, and their limits exact ({court.asked} questions)"
    )


class _Court:
    """The demands of a question, and proofs about parts of them."""

    def __init__(self, bench: Bench, method: Method, deadline: float | None) -> None:
        self.bench, self.method, self.deadline = bench, method, deadline
        space = bench.space
        names = [decision.name for decision in space.decisions]
        chosen = [
            FixedDecision(index, option, f"{names[index]} = {space.decisions[index].options[option]}")
            for index, option in space.fixed.items()
        ]
        self.demands: tuple[Demand, ...] = (*space.requirements, *space.rules, *chosen)
        self.asked = 0

    def examine(self, place: str, stated: Sequence[Mapping[str, Any]]) -> None:
        """One conflict."""
        members = self._members(f"{place}.members", stated)
        if members is None:
            return
        together = self._ask(place, members)
        if together is not None and together.answer == "design":
            self.bench.find(place, "is said to be impossible, but there is a design that meets all of it")
        for position, (member, item) in enumerate(zip(members, stated, strict=True)):
            where = f"{place}.members[{position}]"
            without = self._ask(where, [other for other in members if other is not member])
            if without is not None and without.answer == "none":
                self.bench.find(where, "may be left out: the others are impossible without it")
            self._check_limit(where, [member], item, [member])

    def examine_alone(self, place: str, stated: Sequence[Mapping[str, Any]]) -> None:
        """One conflict that is said to be one even if no thread waited for another."""
        members = self._members(f"{place}.members", stated)
        if members is None:
            return
        space = self.bench.space
        least = {
            item: limit
            for item in members
            if isinstance(item, Requirement) and (limit := uncontended_limit(space, item)).is_elsewhere
        }
        if not least:
            return
        design = self._ask(place, [item for item in members if item not in least], list(least.values()))
        if design is not None and design.answer == "design":
            self.bench.find(
                f"{place}.by_waiting", "is not so: if no thread waited for another a design would meet all of it"
            )

    def examine_together(self, place: str, stated: Sequence[Mapping[str, Any]]) -> None:
        """Check a set of demands that are relaxed together: it is enough, and no smaller part of it is."""
        statements = [self._statement(f"{place}[{position}]", item) for position, item in enumerate(stated)]
        members = [member for statement in statements for member in statement]
        if not all(statements) or not statements:
            return
        for position, (statement, item) in enumerate(zip(statements, stated, strict=True)):
            where = f"{place}[{position}]"
            others = [other for other in members if not _among(other, statement)]
            kept = self._ask(where, [other for other in self.demands if not _among(other, others)])
            if kept is not None and kept.answer == "design":
                self.bench.find(where, "need not be relaxed: there is a design that meets it and all other demands")
            self._check_limit(where, statement, item, members)
        rest = self._ask(place, [other for other in self.demands if not _among(other, members)])
        if rest is not None and rest.answer == "none":
            self.bench.find(place, "is not enough: the other demands are impossible too")

    def _members(self, place: str, stated: Sequence[Mapping[str, Any]]) -> list[Demand] | None:
        """The demands that are meant; None where the question has no such demand."""
        members: list[Demand] = []
        for position, item in enumerate(stated):
            meant = (item["text"], self._place(item["origin"]))
            demands = [demand for demand in self.demands if (demand.text, self._place(demand.origin)) == meant]
            demands = [demand for demand in demands if not _among(demand, members)] or demands
            if not demands:
                self.bench.find(f"{place}[{position}]", f"nothing in the question says {item['text']!r}")
                return None
            members.append(demands[0])
        return members

    def _statement(self, place: str, item: Mapping[str, Any]) -> Sequence[Demand]:
        """The demands that one text states: one, or those of a limit of every flow, processor or bus; () for none."""
        if any(demand.text == item["text"] for demand in self.demands):
            return self._members(place, [item]) or ()
        meant = self._place(item["origin"])
        try:
            said = read_requirements(self.bench.space, item["text"])
        except (ExpressionError, QuestionError):
            said = ()
        known = {(one.metric, one.operator, one.limit) for one in said}
        statement = [
            demand
            for demand in self.demands
            if isinstance(demand, Requirement)
            and (demand.metric, demand.operator, demand.limit) in known
            and self._place(demand.origin) == meant
        ]
        if not statement:
            self.bench.find(place, f"nothing in the question says {item['text']!r}")
        return statement

    def _place(self, origin: str) -> str:
        """Where a demand stands; in a file that has changed since only that it stands there."""
        file, _, line = origin.rpartition(":")
        if not file:
            return origin
        return "" if self.bench.has_moved else f"{PurePath(file).name}:{line}"

    def _check_limit(
        self, place: str, statement: Sequence[Demand], item: Mapping[str, Any], given_up: Sequence[Demand]
    ) -> None:
        """The unit and own limit, and that the closest is met but nothing nearer, where `given_up` need not hold.

        The demands of a statement have one limit.
        """
        member = statement[0]
        members = [one for one in statement if isinstance(one, Requirement)]
        stated = None if item["closest"] is None else Fraction(item["closest"])
        if not isinstance(member, Requirement) or item.get("looked_for") is False:
            self.bench.compare(place, {"limit": None, "closest": None, "miss": None, "unit": ""}, _figures(item))
            if item.get("looked_for") is False:
                self.bench.remarks.append(f"{place} states no closest limit: it was not looked for")
            return
        unit, own = _own_limit(self.bench.space, member)
        miss = None if stated is None else exact(abs(stated - own))
        expected = {"limit": exact(own), "closest": item["closest"], "miss": miss, "unit": unit}
        self.bench.compare(place, expected, _figures(item))
        needed = "" if stated is None else overloads_needed(self.bench.space, members, stated / PPM)
        self.bench.compare(f"{place}.overload", needed, item.get("overload", ""))
        others = [demand for demand in self.demands if not _among(demand, given_up)]
        if stated is None:
            alone = self._ask(f"{place}.closest", others)
            if item.get("unbounded"):
                self._check_unbounded(place, members, others, alone)
                return
            if alone is not None and alone.answer == "design":
                self.bench.find(f"{place}.closest", "is missing: moving this requirement alone leaves a design")
            return
        claims = [_claims(self.bench.space, one, own, stated) for one in members]
        met, nearer = ([limit for claim in claims for limit in claim[side]] for side in (0, 1))
        reached, refuted = self._ask(f"{place}.closest", others, met), self._ask(f"{place}.closest", others, nearer)
        if reached is not None and reached.answer == "none":
            self.bench.find(f"{place}.closest", "is not enough: no design meets the other demands and this limit")
        if refuted is not None and refuted.answer == "design":
            if _is_undecided(nearer, refuted.design):
                self.bench.left_open.append(f"{place}.closest: whether the threads fit on cores with less is undecided")
                return
            self.bench.find(
                f"{place}.closest", "is not the closest: a design meets the other demands and a nearer limit"
            )

    def _check_unbounded(
        self, place: str, members: Sequence[Requirement], others: Sequence[Demand], alone: Reply | None
    ) -> None:
        """Check that giving it up leaves a design, and that no such design has a bound.

        Which threads are named for that depends on the design that was found, and is not checked.
        """
        if alone is not None and alone.answer == "none":
            self.bench.find(f"{place}.unbounded", "is not so: giving this requirement up leaves no design")
        space = self.bench.space
        far = [_limit(space, member, "<", unbounded_from(space, member.metric)) for member in members]
        bounded = self._ask(f"{place}.unbounded", others, far)
        if bounded is not None and bounded.answer == "design":
            design = tuple(max(option, 0) for option in bounded.design)
            if not any(unbounded_in(space, member.metric, View(design)) for member in members):
                self.bench.find(f"{place}.unbounded", "is not so: a design meets the other demands, and has a bound")

    def _ask(self, place: str, demands: Sequence[Demand], limits: Sequence[Limit] = ()) -> Reply | None:
        """Whether demands and further limits have a design together; None where that was left open."""
        self.asked += 1
        space = replace(
            self.bench.space,
            requirements=tuple(item for item in demands if isinstance(item, Requirement)),
            rules=tuple(item for item in demands if isinstance(item, Rule)),
            fixed={item.decision: item.option for item in demands if isinstance(item, FixedDecision)},
            objectives=(),
        )
        evaluator = Evaluator(space, further=limits)
        try:
            return make_prover(evaluator, self.method, self.deadline)[0].in_region(())
        except (TooLarge, TooMany) as error:
            self.bench.left_open.append(f"{place} could not be proved again: {error}")
            return None


def _among(demand: Demand, others: Sequence[Demand]) -> bool:
    """Whether it is one of them: two demands may say the same in different places."""
    return any(demand is other for other in others)


def _figures(item: Mapping[str, Any]) -> dict[str, Any]:
    return {name: item[name] for name in ("limit", "closest", "miss", "unit")}


def _own_limit(space: Space, member: Requirement) -> tuple[str, Fraction]:
    """The unit in which a conflict states a limit, and the requirement's own; a deadline is 0 ns late."""
    if member.is_share:
        return "ppm", member.limit.value * PPM
    measure = build_measure(space, member.metric)
    if member.metric.key == "deadline":
        return measure.unit, Fraction(0)
    one = build_limit(space, replace(member, limit=replace(member.limit, value=Fraction(1))))
    return measure.unit, member.limit.value * one.bound(None)  # type: ignore[arg-type] # the same in every design


def _claims(space: Space, member: Requirement, own: Fraction, closest: Fraction) -> tuple[list[Limit], list[Limit]]:
    """The demands on a design that reaches the closest limit, and on one that would come nearer."""
    off = _rounding(space, member, closest)
    if member.operator == "==":
        miss = abs(closest - own) - off
        return (
            [_limit(space, member, ">=", closest - off), _limit(space, member, "<=", closest + off)],
            [_limit(space, member, ">", own - miss), _limit(space, member, "<", own + miss)],
        )
    operators: tuple[Operator, Operator] = ("<=", "<") if member.is_upper else (">=", ">")
    off = off if operators[0] == "<=" else -off
    return [_limit(space, member, operators[0], closest + off)], [_limit(space, member, operators[1], closest - off)]


def _is_undecided(limits: Iterable[Limit], design: Design) -> bool:
    """Whether a design keeps a limit of each core only as far as is known: no partition of its threads was found."""
    view = View(tuple(max(option, 0) for option in design))
    spreads = (judge(limit, view).spread for limit in limits)
    return any(spread is not None and spread.status == "undecided" for spread in spreads)


def _rounding(space: Space, member: Requirement, closest: Fraction) -> Fraction:
    """How far the closest limit as it is written may be from what it is: figures of many digits are written rounded.

    0 where the metric has a common unit, or the figure is no rounded one.
    """
    may_be = build_measure(space, member.metric).rounded and 10**DECIMALS % closest.denominator == 0
    return Fraction(1, 10**DECIMALS) if may_be else Fraction(0)


def _limit(space: Space, member: Requirement, operator: Operator, shown: Fraction) -> Limit:
    """The requirement with another operator and limit, in the unit of `_own_limit`."""
    moved = replace(member, operator=operator)
    if member.is_share:
        share = build_limit(space, replace(moved, limit=replace(member.limit, value=shown / PPM)))
        return replace(share, cores=None) if member.operator == "==" else share
    limit = build_limit(space, moved)
    if member.metric.key == "deadline":
        return replace(limit, bound=lambda view: limit.bound(view) + shown)
    return replace(limit, bound=lambda view: shown)
