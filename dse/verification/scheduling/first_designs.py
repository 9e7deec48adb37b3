"""Where a design may come before another one with the same objectives: place by place, in the order of decisions.

One that does is like the other up to some decision, and has a smaller option there, or no use for the decision. With
the decisions before that place fixed, and the smaller options of its own, little of a question is left, and the rows of
the smaller one (`dse.verification.reduced`) refute nearly every place: options that break a row by themselves are left
out, threads are put on cores with the least that they may use, the solver is asked what is left of the rows. Each is a
proof; a place that stays open says nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ortools.sat.python import cp_model

from dse.space.model.space import INACTIVE, Design
from dse.verification.cases import Cases
from dse.verification.diagrams import reached
from dse.verification.reduced import ReducedRegion, Reduction, Row, by_decision, fails, holds, may_break, narrow
from dse.verification.scheduling.core_limits import may_fit
from dse.verification.solver_calls import FIRST_LIMIT, SHARE_OF_REFUTING

Claim: TypeAlias = tuple[Sequence[int], Design]
"""Objectives, and the first of the designs that have them."""


@dataclass(frozen=True)
class EarlierDesigns:
    """Designs that are like another one before a decision, and smaller there: for each decision the positions left.

    With the smaller question of them, which more work may still refute.
    """

    decision: int
    left: list[list[int]]
    region: ReducedRegion | None = None


class Earlier:
    """The places that stay open of each claim to be the first design; decisions in `aside` are no part of the order."""

    def __init__(self, reduction: Reduction, aside: Collection[int], deadline: float | None) -> None:
        self.reduction, self.tables, self.deadline = reduction, reduction.tables, deadline
        self.aside = aside
        self.anywhere = [EarlierDesigns(decision, reduction.left) for decision in range(len(self.tables.allowed))]
        """Every place, as long as nothing is known of a claim."""
        self._known: dict[Claim, list[EarlierDesigns]] = {}

    def places(self, vector: Sequence[int], design: Design) -> list[EarlierDesigns]:
        """The places at which a design with these objectives may come before `design`; none where it is the first."""
        key = tuple(vector), tuple(design)
        if key not in self._known:
            self._known[key] = list(self._open(vector, design))
        return self._known[key]

    def are_refuted(self, places: Sequence[EarlierDesigns], limit: float) -> bool:
        """Whether a proof succeeds, in a given deterministic time each, that no design has any of these places."""
        return all(place.region is not None and place.region.is_refuted(limit, self.deadline) for place in places)

    def _open(self, vector: Sequence[int], design: Design) -> Iterator[EarlierDesigns]:
        question = self._of(vector)
        if self.reduction.is_empty:
            return
        for decision, option in enumerate(design):
            if decision in self.aside:
                continue
            if any(self._smaller(question, decision, option)):
                if not question.narrowed():
                    return
                for positions, more in self._smaller(question, decision, option):
                    yield from self._if_open(decision, question.copy().limited(decision, positions, more))
            met, options = self.tables.met[decision], self.tables.allowed[decision]
            same = [position for position in question.left[decision] if option in (INACTIVE, options[position])]
            if not same:
                return  # no design of the point is like this one so far
            question.limited(decision, same, [] if met is None else [fails(met) if option == INACTIVE else holds(met)])

    def _smaller(self, question: _Question, decision: int, option: int) -> Iterator[tuple[list[int], list[Row]]]:
        """The positions of smaller options of a decision, and all of them where there is no use for it; with rows."""
        met, options = self.tables.met[decision], self.tables.allowed[decision]
        smaller = [position for position in question.left[decision] if options[position] < option]
        if smaller:
            yield smaller, [] if met is None else [holds(met)]
        if met is not None and option != INACTIVE and not all(reached(met, question.left)):
            yield question.left[decision], [fails(met)]

    def _of(self, vector: Sequence[int]) -> _Question:
        """The question of the designs with these objectives."""
        question = _Question(self.reduction.rows, self.reduction.using, self.reduction.left)
        return question.with_rows(self.reduction.rows_in([value + 1 for value in vector], vector))

    def _if_open(self, decision: int, question: _Question) -> Iterator[EarlierDesigns]:
        if question.narrowed() and all(may_fit(table, question.left) for table in self.tables.cores):
            region = self.reduction.part(question.rows, question.left)
            region.is_easy = True
            if not region.is_refuted(SHARE_OF_REFUTING * FIRST_LIMIT, self.deadline):
                yield EarlierDesigns(decision, question.left, region)


class _Question:
    """Rows that designs keep, also by decision, and for each decision the positions of options that they leave.

    What becomes known is noted, and looked at when `narrowed` is asked for: most of it is of no use before the end.
    """

    def __init__(self, rows: Sequence[Row], using: Mapping[int, Sequence[Row]], left: Sequence[list[int]]) -> None:
        self.rows, self.using, self.left = rows, using, list(left)
        self._fresh: list[Row] = []

    def copy(self) -> _Question:
        """A copy of the question that can be changed alone."""
        return _Question(self.rows, self.using, self.left)

    def with_rows(self, more: Sequence[Row]) -> _Question:
        """The question, with further rows."""
        self.rows, self.using = [*self.rows, *more], by_decision(more, self.using)
        self._fresh += more
        return self

    def limited(self, decision: int, positions: list[int], more: Sequence[Row]) -> _Question:
        """The question with these positions of a decision, and further rows that a remaining option could break."""
        fresh = [row for row in more if may_break(row, self.left)]
        if fresh:
            self.with_rows(fresh)
        if positions != self.left[decision]:
            self.left[decision] = positions
            self._fresh += self.using.get(decision, ())
        return self

    def narrowed(self) -> bool:
        """Leave out what breaks a row by itself; whether each decision has an option left."""
        fresh, self._fresh = self._fresh, []
        return narrow(self.rows, self.left, fresh, self.using)


def limit_options(
    model: cp_model.CpModel,
    chosen: Sequence[Any],
    allowed: Sequence[Sequence[int]],
    places: Sequence[Sequence[EarlierDesigns]],
) -> None:
    """The options of decisions are among those that some place leaves."""
    everywhere = {id(place.left): place.left for listed in places for place in listed}.values()
    for index, variable in enumerate(chosen):
        kept = {allowed[index][position] for left in everywhere for position in left[index]}
        model.add_linear_expression_in_domain(variable, cp_model.Domain.from_values(sorted(kept)))


def add_earlier(
    model: cp_model.CpModel,
    variables: tuple[Sequence[Any], Sequence[Any]],
    claims: Sequence[Claim],
    places: Sequence[Sequence[EarlierDesigns]],
    aside: Collection[int],
) -> Cases:
    """The design comes before that of some claim, at one of its places; the claims are the cases that are returned.

    A fixed search branches on the case, then in the order of decisions. `variables` are those of objectives and of
    options, `aside` the decisions that are no part of the order.
    """
    cases = Cases(model, len(claims))
    vectors, designs = zip(*claims, strict=True)
    for objective, values in zip(variables[0], zip(*vectors, strict=True), strict=True):
        model.add(objective == cases.value(values))
    same: Any = model.new_constant(1)
    found, order = [], [cases.which]
    for index, (variable, options) in enumerate(zip(variables[1], zip(*designs, strict=True), strict=True)):
        if index in aside:
            continue
        option, alike = cases.value(options), model.new_bool_var("")
        order.append(variable)
        model.add(variable == option).only_enforce_if(alike)
        model.add_implication(alike, same)
        open_here = [at for at, listed in enumerate(places) if any(place.decision == index for place in listed)]
        if open_here:
            smaller = model.new_bool_var("")
            model.add(variable <= option - 1).only_enforce_if(smaller)
            model.add_implication(smaller, same)
            found.append(smaller)
        if 0 < len(open_here) < len(claims):
            domain = cp_model.Domain.from_values(open_here)
            model.add_linear_expression_in_domain(cases.which, domain).only_enforce_if(smaller)
        same = alike
    model.add_bool_or(found)
    model.add_decision_strategy(order, cp_model.CHOOSE_FIRST, cp_model.SELECT_MIN_VALUE)
    return cases
