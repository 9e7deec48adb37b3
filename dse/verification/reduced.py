"""Regions refuted on a smaller question: without cores and deadlines, without what cannot be and what is never better.

Every requirement that a sum of diagrams holds is a row, sum <= bound; so are conditions, and the bounds of a region. An
option that breaks a row by itself, the other decisions at their best for that row, is no option. Of two options of
which one is nowhere larger, in no row and whatever else is chosen, the other is left out: a design with it stays one
when it is exchanged. Response times, limits of single cores and waiting are not looked at; so what is refuted here is
refuted, while a solution says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import gcd
from operator import add
from typing import Any

from ortools.sat.python import cp_model

from dse.support.timelimit import look_at_the_clock
from dse.verification.diagrams import Diagram, Node, changed, leaves
from dse.verification.element_constraints import Lookups
from dse.verification.restricted_diagrams import Left, Remainder, is_deep, remainder
from dse.verification.scheduling.core_limits import crowd
from dse.verification.scheduling.pooled_cores import add_pools
from dse.verification.scheduling.schedulability import Demand, Levels, add_levels
from dse.verification.solver_calls import BY_ROWS, PACKING, WAYS, attempted
from dse.verification.sums import Sum
from dse.verification.tables import Tables

SHARE_OF_CORES = 2
"""The rows of cores may take so many times the limit of a smaller question without them."""


MOST_LESSONS = 40
"""The greatest number of times that a smaller question with a solution is asked again, with a row against it."""

PATIENCE = 4
"""After so many attempts at pooled cores each core is asked for by itself; without cores after one."""


@dataclass(frozen=True)
class Row:
    """The sum of `parts`, diagrams of integers, is at most `most`.

    Integers; a region is empty where the rows admit no combination of options.
    """

    parts: tuple[Diagram, ...]
    most: int

    @cached_property
    def constant(self) -> int:
        """The sum of the parts that look at no decision."""
        return sum(int(part) for part in self.parts if not isinstance(part, Node))

    @cached_property
    def alone(self) -> dict[int, list[int]]:
        """The summands of each decision's options, in the parts that look at this decision alone."""
        options_of: dict[int, list[int]] = {}
        for part in self.parts:
            if isinstance(part, Node) and not is_deep(part):
                known = options_of.get(part.decision)
                added = [int(value) for value in part.branches]
                options_of[part.decision] = added if known is None else list(map(add, known, added))
        return options_of

    @cached_property
    def deep(self) -> list[Node]:
        """The parts that look at several decisions."""
        return [part for part in self.parts if is_deep(part)]

    @cached_property
    def scope(self) -> dict[int, list[int]]:
        """Every decision that is looked at, with the positions of the `deep` parts that do."""
        options_of: dict[int, list[int]] = {decision: [] for decision in self.alone}
        for at, part in enumerate(self.deep):
            for decision in part.looked_at:
                options_of.setdefault(decision, []).append(at)
        return options_of


class Reduction:
    """The rows that every design keeps, and for each decision the positions of options that the rows leave."""

    def __init__(self, tables: Tables) -> None:
        self.tables = tables
        self.rows = [holds(diagram) for _, diagram in tables.conditions]
        for bound in tables.bounds:
            self.rows += _rows_of(bound.sum, 0)
        self.left = [list(range(len(options))) for options in tables.allowed]
        self.using = by_decision(self.rows)
        """The rows that look at each decision."""
        self.is_empty = not narrow(self.rows, self.left, self.rows, self.using)

    def lesson(self, chosen: Left) -> Row | None:
        """A row that these positions break, for their threads do not fit on cores; all designs keep it from then on.

        None where the threads fit, or where that is not known.
        """
        for table in self.tables.cores:
            crowded = crowd(table, chosen, self.left)
            if crowded is not None:
                row = Row(*crowded)
                self.rows, self.using = [*self.rows, row], by_decision([row], self.using)
                return row
        return None

    def region(self, below: Sequence[int | None], from_on: Sequence[int | None] | None) -> ReducedRegion:
        """The smaller question of a region: objectives below `below` and not below `from_on` (None: no bound).

        Bounds are exclusive above and inclusive below, in counting units.
        """
        more = self.rows_in(below, from_on)
        rows, left = [*self.rows, *more], [list(options) for options in self.left]
        is_empty = self.is_empty or not narrow(rows, left, more, by_decision(more, self.using))
        return self.part(rows, left, is_empty=is_empty)

    def part(self, rows: Sequence[Row], left: list[list[int]], *, is_empty: bool = False) -> ReducedRegion:
        """The smaller question with these rows, and with what is left."""
        levels = self.tables.levels
        return ReducedRegion(rows, left, is_empty, levels, self.lesson if levels is None else None)

    def rows_in(self, below: Sequence[int | None], from_on: Sequence[int | None] | None) -> list[Row]:
        """The rows of a region beside those that every design keeps."""
        more = []
        for (total, divisor), bound in zip(self.tables.objectives, below, strict=True):
            if bound is not None:
                more += _rows_of(total, (bound - 1) * divisor)
        for (total, divisor), bound in zip(self.tables.objectives, from_on or (), strict=False):
            if bound is not None and not total.extremes and not total.is_open:
                more.append(Row(tuple(_times(part, -1) for part in total.parts), -bound * divisor))
        return more


class ReducedRegion:
    """A smaller question, to be asked again with more time until it is answered.

    One that has a solution is asked with the rows of cores (`dse.verification.scheduling.schedulability`), if there are
    any: there what is never better by the other rows may be so. Where types of processors are open, one after the other
    is.
    """

    def __init__(
        self,
        rows: Sequence[Row],
        left: list[list[int]],
        is_empty: bool,
        levels: Levels | None,
        lesson: Callable[[Left], Row | None] | None = None,
    ) -> None:
        self.rows, self.left, self.is_empty, self.levels, self.lesson = rows, left, is_empty, levels, lesson
        self.is_easy = False
        """Whether it is asked first as it is: what is never better is not looked for."""
        self._lessons = 0
        self._attempts = 0
        self._model: cp_model.CpModel | None = None
        self._options: RemainingOptions | None = None
        self._has_solution = False
        self._parts: list[ReducedRegion] = []
        self._ways = BY_ROWS if levels is None else WAYS
        self._forms = [] if levels is None else [add_pools, add_levels]  # those that were not asked yet

    def is_refuted(self, limit: float, deadline: float | None) -> bool:
        """Whether the question is proved infeasible within `limit` of deterministic time.

        True is a proof; False means a solution, or no answer within `limit` and `deadline`.
        """
        if self.is_empty or self._has_solution:
            return self.is_empty
        if self._parts:
            return self._are_refuted(limit, deadline)
        if self._model is None:
            rows, left = [row for row in self.rows if may_break(row, self.left)], [list(item) for item in self.left]
            if not self.is_easy:
                leave_out_dominated(rows, left)
            self._model, self._options = _reduced_model(rows, left)
        most = limit * SHARE_OF_CORES if self._ways is PACKING else limit
        status, solver = attempted(self._model, deadline, most, self._attempts, self._ways)
        self._attempts += 1
        self.is_empty = status == cp_model.INFEASIBLE
        if self.is_easy and status == cp_model.UNKNOWN and self.levels is None:
            self.is_easy, self._model = False, None
        if self._goes_on(status):
            self._parts = [] if self.levels is None else self._by_type(self.levels)
            if not self._parts:
                self._model, _ = _reduced_model(self.rows, self.left, self.levels, self._forms.pop(0))
                self._attempts = 0
                self._ways = PACKING
            return self.is_refuted(limit, deadline)
        if solver is not None and self.lesson and self._options and self._lessons < MOST_LESSONS:
            row = self.lesson(self._options.chosen(solver))
            if row is not None:
                self._learn(row)
                return self.is_refuted(limit, deadline)
        self._has_solution = solver is not None
        return self.is_empty

    def _learn(self, row: Row) -> None:
        """A row more, with what it leaves."""
        self.rows, self._model = [*self.rows, row], None
        self._lessons, self._attempts = self._lessons + 1, 0
        self.is_empty = not narrow(self.rows, self.left, [row])

    def _goes_on(self, status: Any) -> bool:
        """Whether the next form is asked: what the one before has refuted it would refute, too."""
        patience = 1 if self._ways is WAYS else PATIENCE
        is_open = status == cp_model.UNKNOWN and self._attempts >= patience
        return bool(self._forms) and (is_open or status in (cp_model.OPTIMAL, cp_model.FEASIBLE))

    def _by_type(self, levels: Levels) -> list[ReducedRegion]:
        """A reduced region for each type of a processor that has several types left; empty where none has."""
        decision = next((item for item in levels.types if len(self.left[item]) > 1), None)
        regions = []
        for option in self.left[decision] if decision is not None else ():
            left = [[option] if item == decision else list(options) for item, options in enumerate(self.left)]
            is_empty = not narrow(self.rows, left, self.rows)
            regions.append(ReducedRegion(self.rows, left, is_empty, levels))
        return regions

    def _are_refuted(self, limit: float, deadline: float | None) -> bool:
        for part in self._parts:
            part.is_refuted(limit, deadline)
            if part._has_solution:
                self._has_solution = True
                return False
        self.is_empty = all(part.is_empty for part in self._parts)
        return self.is_empty


def _rows_of(total: Sum, most: int) -> list[Row]:
    """Rows that hold wherever a sum is at most `most`: of a greatest value one more for each that it may be."""
    if not total.never_falls:
        return []
    low = sum(pick.low for pick in total.extremes)
    rows = [Row((*total.parts, *total.floors), most - low)]
    for pick in total.extremes:
        for item in pick.sums if pick.greatest else ():
            if item.never_falls:
                least_inside = sum(inner.low for inner in item.extremes)
                parts = (*total.parts, *total.floors, *item.parts, *item.floors)
                rows.append(Row(parts, most - low + pick.low - least_inside))
    return rows


def narrow(
    rows: Sequence[Row],
    left: list[list[int]],
    fresh: Sequence[Row],
    using: Mapping[int, Sequence[Row]] | None = None,
) -> bool:
    """Leave out what breaks a row by itself, `fresh` ones first; whether each decision has an option left.

    `using` are the rows that look at each decision, where that is known.
    """
    using = by_decision(rows) if using is None else using
    waiting = {id(row): row for row in fresh}
    while waiting:
        look_at_the_clock()
        row = waiting.pop(next(iter(waiting)))
        lowest = {decision: min(values[option] for option in left[decision]) for decision, values in row.alone.items()}
        deep = [remainder(part, left) for part in row.deep]
        room = row.most - row.constant - sum(lowest.values()) - sum(item.least for item in deep)
        if room < 0:
            return False
        for decision, using_it in row.scope.items():
            if len(left[decision]) == 1:
                continue  # with it there is room
            added = _added(row, [deep[at] for at in using_it], decision, left)
            most = room + lowest.get(decision, 0)
            kept = [option for option, value in zip(left[decision], added, strict=True) if value <= most]
            if len(kept) < len(left[decision]):
                left[decision] = kept
                if not kept:
                    return False
                waiting |= {id(other): other for other in using[decision]}
    return True


def may_break(row: Row, left: Left) -> bool:
    """Whether a row is too large with some of the options that are left: else it says nothing of them.

    Judged by the greatest value of each part by itself.
    """
    alone = sum(max(values[option] for option in left[decision]) for decision, values in row.alone.items())
    return row.constant + alone + sum(remainder(part, left).greatest for part in row.deep) > row.most


def _added(row: Row, deep: Sequence[Remainder], decision: int, left: Sequence[Sequence[int]]) -> list[int]:
    """The least that each remaining option of a decision adds to a row, in their order."""
    values = row.alone.get(decision)
    added = [0 if values is None else values[option] for option in left[decision]]
    for item in deep:
        added = [value + least - item.least for value, least in zip(added, item.least_with(decision), strict=True)]
    return added


def by_decision(rows: Sequence[Row], known: Mapping[int, Sequence[Row]] | None = None) -> dict[int, Sequence[Row]]:
    """The rows that look at each decision, with those that are `known`."""
    using: dict[int, Sequence[Row]] = {} if known is None else dict(known)
    for row in rows:
        for decision in row.scope:
            using[decision] = [*using.get(decision, ()), row]
    return using


def leave_out_dominated(rows: Sequence[Row], left: list[list[int]]) -> None:
    """Leave out each option for which there is another that is nowhere larger.

    `left` is changed in place; an option that is never larger in any row makes the other one superfluous.
    """
    for decision, here in by_decision(rows).items():
        look_at_the_clock()
        for option in list(left[decision]):
            others = (other for other in left[decision] if other != option)
            if any(all(_is_no_larger(row, decision, other, option, left) for row in here) for other in others):
                left[decision].remove(option)


def _is_no_larger(row: Row, decision: int, one: int, other: int, left: Sequence[Sequence[int]]) -> bool:
    """Whether a row's sum is no larger with `one` option of a decision than with another, whatever else is chosen."""
    values = row.alone.get(decision)
    difference = 0 if values is None else values[one] - values[other]
    deep = (row.deep[at] for at in row.scope[decision])
    return difference + sum(remainder(part, left).difference(decision, one, other) for part in deep) <= 0


def holds(diagram: Diagram) -> Row:
    """The row of a condition."""
    return Row((changed(diagram, lambda leaf: int(not leaf)),), 0)


def fails(diagram: Diagram) -> Row:
    """The row of its contrary."""
    return Row((changed(diagram, lambda leaf: int(bool(leaf))),), 0)


def _times(diagram: Diagram, factor: int) -> Diagram:
    return changed(diagram, lambda leaf: factor * int(leaf))


# The model of a smaller question: its rows with the options that are left, and rows of cores where these are asked.


def _reduced_model(
    rows: Sequence[Row],
    left: Sequence[Sequence[int]],
    levels: Levels | None = None,
    add: Callable[[cp_model.CpModel, Sequence[Mapping[Demand, Any]]], None] = add_levels,
) -> tuple[cp_model.CpModel, RemainingOptions]:
    """The rows with what is left: what one decision adds to a row is one figure. With what is added for `levels`."""
    model = cp_model.CpModel()
    small: dict[tuple[Any, ...], Diagram] = {}
    options = RemainingOptions(model, left)
    for row in rows:
        look_at_the_clock()
        alone: dict[int, list[int]] = {}
        total: Any = row.constant
        for decision, values in row.alone.items():
            values = [values[option] for option in left[decision]]
            if len(set(values)) == 1:
                total += values[0]
            else:
                alone[decision] = values
        for part in (_restricted(item, left, small) for item in row.deep):
            if not isinstance(part, Node):
                total += int(part)
            elif is_deep(part):
                total += options.lookups.value(part)
            else:
                known = alone.get(part.decision, [0] * len(part.branches))
                alone[part.decision] = [value + int(more) for value, more in zip(known, part.branches, strict=True)]
        if levels is None:
            total += sum(options.lookups.value(_node(decision, values, small)) for decision, values in alone.items())
            if not isinstance(total, int):  # else it holds, as `narrow` has left it
                model.add(total <= row.most)
        elif alone:
            _add_in_steps(
                model, total, [(values, options.of(decision)) for decision, values in alone.items()], row.most
            )
        elif not isinstance(total, int):
            model.add(total <= row.most)
    if levels is not None:
        add(model, [_uses(levels, number, left, small, options) for number in sorted(levels.demands)])
    return model, options


def _add_in_steps(
    model: cp_model.CpModel, total: Any, choices: Sequence[tuple[Sequence[int], Sequence[Any]]], most: int
) -> None:
    """Total + the chosen value of each choice <= most: where these are all, in the steps in which they grow."""
    low = sum(min(values) for values, _ in choices)
    step = gcd(*(value - min(values) for values, _ in choices for value in values)) if isinstance(total, int) else 1
    chosen = sum(
        (value - min(values)) // (step or 1) * literal
        for values, literals in choices
        for value, literal in zip(values, literals, strict=True)
    )
    if isinstance(total, int):
        model.add(chosen <= (most - low - total) // (step or 1))
    else:
        model.add(total + chosen <= most - low)


class RemainingOptions:
    """The remaining options of each decision as variables: the position of the option, and one literal per option.

    Variables are made on first use, and the two forms are linked where both exist.
    """

    def __init__(self, model: cp_model.CpModel, left: Sequence[Sequence[int]]) -> None:
        self.model, self.left = model, left
        self.lookups = Lookups(model, self.position)
        self._positions: dict[int, Any] = {}
        self._literals: dict[int, list[Any]] = {}

    def position(self, decision: int) -> Any:
        """The position of the option."""
        if decision not in self._positions:
            self._positions[decision] = self.model.new_int_var(0, len(self.left[decision]) - 1, "")
            self._bind(decision)
        return self._positions[decision]

    def of(self, decision: int) -> list[Any]:
        """A literal for each option."""
        if decision not in self._literals:
            self._literals[decision] = [self.model.new_bool_var("") for _ in self.left[decision]]
            self.model.add_exactly_one(self._literals[decision])
            self._bind(decision)
        return self._literals[decision]

    def chosen(self, solver: cp_model.CpSolver) -> list[list[int]]:
        """The position that a solution has of each decision; of one that no row looks at the first that is left."""
        kept = [[options[0]] for options in self.left]
        for decision, variable in self._positions.items():
            kept[decision] = [self.left[decision][solver.value(variable)]]
        for decision, literals in self._literals.items():
            kept[decision] = [self.left[decision][[solver.value(literal) for literal in literals].index(1)]]
        return kept

    def equal(self, variable: Any, values: Iterable[int]) -> list[Any]:
        """A literal for each of the values that a variable may have."""
        literals = []
        for value in values:
            literals.append(self.model.new_bool_var(""))
            self.model.add(variable == value).only_enforce_if(literals[-1])
        self.model.add_exactly_one(literals)
        return literals

    def _bind(self, decision: int) -> None:
        """Where there are both, the literals say which position it is."""
        if decision in self._positions:
            for value, literal in enumerate(self._literals.get(decision, ())):
                self.model.add(self._positions[decision] == value).only_enforce_if(literal)


def _uses(
    levels: Levels,
    number: int,
    left: Sequence[Sequence[int]],
    known: dict[tuple[Any, ...], Diagram],
    options: RemainingOptions,
) -> dict[Demand, Any]:
    """Whether a thread has each of its demands that are left: a sum of literals of which at most one is true."""
    listed, diagram = levels.demands[number], _restricted(levels.positions[number], left, known)
    uses: dict[Demand, Any] = {}
    if not isinstance(diagram, Node):
        pairs: Iterable[tuple[int, Any]] = [(int(diagram), 1)]
    elif is_deep(diagram):
        values = sorted({int(leaf) for leaf in leaves(diagram)})
        pairs = zip(values, options.equal(options.lookups.value(diagram), values), strict=True)
    else:
        pairs = zip(map(int, diagram.branches), options.of(diagram.decision), strict=True)
    for position, literal in pairs:
        demand = listed[position]
        if demand is not None:
            uses[demand] = uses.get(demand, 0) + literal
    return uses


def _node(decision: int, branches: Sequence[Diagram], known: dict[tuple[Any, ...], Diagram]) -> Diagram:
    """The node with these branches, the same one for the same branches; or their common value."""
    key = (decision, *(("node", id(item)) if isinstance(item, Node) else item for item in branches))
    if len(set(key[1:])) == 1:
        return branches[0]
    return known.setdefault(key, Node(decision, tuple(branches)))


def _restricted(diagram: Diagram, left: Sequence[Sequence[int]], known: dict[tuple[Any, ...], Diagram]) -> Diagram:
    """A diagram with the branches of the options that are left."""
    if not isinstance(diagram, Node):
        return int(diagram)
    key = ("of", id(diagram))
    if key not in known:
        branches = [_restricted(diagram.branches[option], left, known) for option in left[diagram.decision]]
        known[key] = _node(diagram.decision, branches, known)
    return known[key]
