"""Regions refuted on a smaller question: without cores and deadlines, without what cannot be and what is never better.

Every requirement that a sum of diagrams holds is a row, sum <= bound; so are conditions, and the bounds of a region. An
option that breaks a row by itself, the other decisions at their best for that row, is no option. Of two options of
which one is nowhere larger, in no row and whatever else is chosen, the other is left out: a design with it stays one
when it is exchanged. Response times, limits of single cores and waiting are not looked at; so what is refuted here is
refuted, while a solution says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from ortools.sat.python import cp_model

from dse.records import dataclass
from dse.timelimit import look_at_the_clock
from dse.verification.calls import PACKING, WAYS, attempted
from dse.verification.diagrams import Diagram, Node, changed, leaves, scope
from dse.verification.levels import Levels, add_levels, add_pools
from dse.verification.reduced_model import reduced_model
from dse.verification.sums import Sum
from dse.verification.tables import Tables

SHARE_OF_CORES = 2
"""The rows of cores may take so many times the limit of a smaller question without them."""


PATIENCE = 4
"""After so many attempts at pooled cores each core is asked for by itself; without cores after one."""


@dataclass(frozen=True)
class Row:
    """The sum of `parts`, diagrams of integers, is at most `most`."""

    parts: tuple[Diagram, ...]
    most: int

    @cached_property
    def open(self) -> dict[int, list[int]]:
        """For each decision that is looked at the positions of the parts that do."""
        found: dict[int, list[int]] = {}
        for at, part in enumerate(self.parts):
            for decision in scope(part):
                found.setdefault(decision, []).append(at)
        return found

    @cached_property
    def highs(self) -> list[int]:
        """The most that each part may be."""
        return [max((int(leaf) for leaf in leaves(part)), default=0) for part in self.parts]


class Reduction:
    """What every design has in common: rows, and for each decision the positions of options that they leave."""

    def __init__(self, tables: Tables) -> None:
        self.tables = tables
        self.rows = [Row((_negated(diagram),), 0) for _, diagram in tables.conditions]
        for bound in tables.bounds:
            self.rows += rows_of(bound.sum, 0)
        self.left = [list(range(len(options))) for options in tables.allowed]
        self.is_empty = not narrow(self.rows, self.left, self.rows)

    def region(self, below: Sequence[int | None], from_on: Sequence[int | None] | None) -> ReducedRegion:
        """The smaller question of a region: objectives below `below` and not below `from_on` (None: no bound)."""
        more = []
        for (total, divisor), bound in zip(self.tables.objectives, below, strict=True):
            if bound is not None:
                more += rows_of(total, (bound - 1) * divisor)
        for (total, divisor), bound in zip(self.tables.objectives, from_on or (), strict=False):
            if bound is not None and not total.extremes and not total.is_open:
                more.append(Row(tuple(_times(part, -1) for part in total.parts), -bound * divisor))
        left = [list(options) for options in self.left]
        is_empty = self.is_empty or not narrow([*self.rows, *more], left, more)
        return ReducedRegion([*self.rows, *more], left, is_empty, self.tables.levels)


class ReducedRegion:
    """A smaller question, to be asked again with more time until it is answered.

    One that has a solution is asked with the rows of cores (`dse.verification.levels`), if there are any: there what is
    never better by the other rows may be so. Where types of processors are open, one after the other is.
    """

    def __init__(self, rows: Sequence[Row], left: list[list[int]], is_empty: bool, levels: Levels | None) -> None:
        self.rows, self.left, self.is_empty, self.levels = rows, left, is_empty, levels
        self._attempts = 0
        self._model: cp_model.CpModel | None = None
        self._has_solution = False
        self._parts: list[ReducedRegion] = []
        self._ways = WAYS
        self._forms = [] if levels is None else [add_pools, add_levels]  # those that were not asked yet

    def is_refuted(self, limit: float, deadline: float | None) -> bool:
        """Whether it can be shown, with so much deterministic time, that there is no solution."""
        if self.is_empty or self._has_solution:
            return self.is_empty
        if self._parts:
            return self._are_refuted(limit, deadline)
        if self._model is None:
            left = [list(options) for options in self.left]
            leave_out_dominated(self.rows, left)
            self._model = reduced_model(self.rows, left)
        most = limit * SHARE_OF_CORES if self._ways is PACKING else limit
        status, solver = attempted(self._model, deadline, most, self._attempts, self._ways)
        self._attempts += 1
        self.is_empty = status == cp_model.INFEASIBLE
        if self._goes_on(status):
            self._parts = [] if self.levels is None else self._by_type(self.levels)
            if not self._parts:
                self._model, self._attempts = reduced_model(self.rows, self.left, self.levels, self._forms.pop(0)), 0
                self._ways = PACKING
            return self.is_refuted(limit, deadline)
        self._has_solution = solver is not None
        return self.is_empty

    def _goes_on(self, status: Any) -> bool:
        """Whether the next form is asked: what the one before has refuted it would refute, too."""
        patience = 1 if self._ways is WAYS else PATIENCE
        is_open = status == cp_model.UNKNOWN and self._attempts >= patience
        return bool(self._forms) and (is_open or status in (cp_model.OPTIMAL, cp_model.FEASIBLE))

    def _by_type(self, levels: Levels) -> list[ReducedRegion]:
        """The same for each type of a processor that has several left; nothing where none has."""
        decision = next((item for item in levels.types if len(self.left[item]) > 1), None)
        found = []
        for option in self.left[decision] if decision is not None else ():
            left = [[option] if item == decision else list(options) for item, options in enumerate(self.left)]
            is_empty = not narrow(self.rows, left, self.rows)
            found.append(ReducedRegion(self.rows, left, is_empty, levels))
        return found

    def _are_refuted(self, limit: float, deadline: float | None) -> bool:
        for part in self._parts:
            part.is_refuted(limit, deadline)
            if part._has_solution:
                self._has_solution = True
                return False
        self.is_empty = all(part.is_empty for part in self._parts)
        return self.is_empty


def rows_of(total: Sum, most: int) -> list[Row]:
    """Rows that hold wherever a sum is at most `most`: of a greatest value one more for each that it may be."""
    if not total.never_falls:
        return []
    low = sum(pick.low for pick in total.extremes)
    found = [Row((*total.parts, *total.floors), most - low)]
    for pick in total.extremes:
        for item in pick.sums if pick.greatest else ():
            if item.never_falls:
                least_inside = sum(inner.low for inner in item.extremes)
                parts = (*total.parts, *total.floors, *item.parts, *item.floors)
                found.append(Row(parts, most - low + pick.low - least_inside))
    return found


def narrow(rows: Sequence[Row], left: list[list[int]], fresh: Sequence[Row]) -> bool:
    """Leave out what breaks a row by itself, `fresh` ones first; whether each decision has an option left."""
    using: dict[int, list[Row]] = {}
    for row in rows:
        for decision in row.open:
            using.setdefault(decision, []).append(row)
    waiting = {id(row): row for row in fresh}
    while waiting:
        look_at_the_clock()
        row = waiting.pop(next(iter(waiting)))
        lows = [least(part, left) for part in row.parts]
        room = row.most - sum(lows)
        if room < 0:
            return False
        for decision, parts in row.open.items():
            if sum(row.highs[at] - lows[at] for at in parts) <= room:
                continue  # nothing of it can break the row
            kept = [
                option
                for option in left[decision]
                if sum(least(row.parts[at], left, {decision: option}) - lows[at] for at in parts) <= room
            ]
            if len(kept) < len(left[decision]):
                left[decision] = kept
                if not kept:
                    return False
                waiting |= {id(other): other for other in using[decision]}
    return True


def least(diagram: Diagram, left: Sequence[Sequence[int]], given: dict[int, int] | None = None) -> int:
    """The least leaf that the options that are left lead to, where some decisions are given."""
    known: dict[int, int] = {}

    def walk(item: Diagram) -> int:
        if not isinstance(item, Node):
            return int(item)
        if id(item) not in known:
            taken = left[item.decision]
            if given and item.decision in given:
                taken = [given[item.decision]]
            known[id(item)] = min(walk(item.branches[option]) for option in taken)
        return known[id(item)]

    return walk(diagram)


def leave_out_dominated(rows: Sequence[Row], left: list[list[int]]) -> None:
    """Leave out each option for which there is another that is nowhere larger."""
    using: dict[int, list[Row]] = {}
    for row in rows:
        for decision in row.open:
            using.setdefault(decision, []).append(row)
    for decision, here in using.items():
        look_at_the_clock()
        for option in list(left[decision]):
            others = (other for other in left[decision] if other != option)
            if any(all(_is_no_larger(row, decision, other, option, left) for row in here) for other in others):
                left[decision].remove(option)


def _is_no_larger(row: Row, decision: int, one: int, other: int, left: Sequence[Sequence[int]]) -> bool:
    """Whether a row's sum is no larger with `one` option of a decision than with another, whatever else is chosen."""
    difference = 0
    for at in row.open[decision]:
        first, second = (_at(row.parts[at], decision, option) for option in (one, other))
        if isinstance(first, Node) or isinstance(second, Node):
            if not _is_below(first, second, decision, (one, other), left):
                return False
        else:
            difference += int(first) - int(second)
    return difference <= 0


def _at(diagram: Diagram, decision: int, option: int) -> Diagram:
    """What follows at the top of a diagram where a decision has an option."""
    while isinstance(diagram, Node) and diagram.decision == decision:
        diagram = diagram.branches[option]
    return diagram


def _is_below(
    one: Diagram, other: Diagram, decision: int, options: tuple[int, int], left: Sequence[Sequence[int]]
) -> bool:
    """Whether a diagram with one option is nowhere above another with the other option."""
    known: set[tuple[int, int]] = set()  # pairs of nodes that were found to be so

    def walk(one: Diagram, other: Diagram) -> bool:
        one, other = _at(one, decision, options[0]), _at(other, decision, options[1])
        if not isinstance(one, Node) and not isinstance(other, Node):
            return int(one) <= int(other)
        pair = (id(one), id(other))
        if pair not in known:
            split = one.decision if isinstance(one, Node) else other.decision
            if not all(walk(_at(one, split, option), _at(other, split, option)) for option in left[split]):
                return False
            known.add(pair)
        return True

    return walk(one, other)


def _negated(diagram: Diagram) -> Diagram:
    """0 where a condition is true, 1 elsewhere."""
    return changed(diagram, lambda leaf: int(not leaf))


def _times(diagram: Diagram, factor: int) -> Diagram:
    return changed(diagram, lambda leaf: factor * int(leaf))
