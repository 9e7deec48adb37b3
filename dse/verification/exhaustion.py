"""Every design of a question: decision after decision, dropping what breaks a condition as soon as that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

from dse.analysis.views import View
from dse.space.model.space import INACTIVE
from dse.support.timelimit import look_at_the_clock
from dse.verification.diagrams import Diagram, Node, scope
from dse.verification.scheduling.core_limits import CoreTable, fitting
from dse.verification.sums import Sum
from dse.verification.tables import Tables

Ints = npt.NDArray[np.int64]
MOST_ROWS = 3_000_000


class TooMany(Exception):
    """The space has more combinations than are looked at one by one.

    The other method of the second proof is tried, or the claim is left open.
    """


@dataclass(frozen=True)
class Exhaustion:
    """All feasible designs (inactive decisions marked), their objectives (minimised), and how many were looked at.

    Integer arrays with one row for each design: options, and objectives in counting units.
    """

    designs: Ints
    vectors: Ints
    looked_at: int


def exhaust(tables: Tables, limit: int = MOST_ROWS) -> Exhaustion:
    """The outcome of an enumeration of every design.

    Raises
    ------
    TooMany
        when there are more than `limit` combinations at some point.
    """
    columns = _structural_designs(tables, limit)
    count = len(columns[0]) if columns else 1
    looked_at = count
    rows = np.arange(count)  # which are left, also of a problem that has nothing to decide
    if not columns:
        for _, diagram in tables.conditions:
            rows = rows[_values(diagram, columns, len(rows)).astype(bool)]

    def keep(mask: npt.NDArray[np.bool_]) -> None:
        nonlocal columns, rows
        columns, rows = _kept(columns, mask), rows[mask]

    for bound in tables.bounds:
        look_at_the_clock()
        keep(_sums(bound.sum, columns, len(rows)) <= 0)
    for table in tables.cores:
        keep(_fitting(table, columns, len(rows)))
    if not tables.bounds_are_exact:
        keep(_exactly(tables, columns, len(rows)))
    count = len(rows)
    if tables.waits is not None:
        return Exhaustion(*_weighed(tables, columns, count), looked_at)
    vectors = np.empty((count, len(tables.objectives)), dtype=np.int64)
    for axis, (total, divisor) in enumerate(tables.objectives):
        sums = _sums(total, columns, count)
        assert not (sums % divisor).any(), "an objective is no integer in its counting unit"
        vectors[:, axis] = sums // divisor
    return Exhaustion(_marked(tables, columns, count), vectors, looked_at)


def _weighed(tables: Tables, columns: list[Any], count: int) -> tuple[Ints, Ints]:
    """The designs, and their objectives as the analysis has them."""
    signs = [1 if item.sense == "minimise" else -1 for item in tables.space.objectives]
    vectors = np.empty((count, len(signs)), dtype=np.int64)
    for row in range(count):
        look_at_the_clock()
        evaluation = tables.evaluator.evaluate(tuple(int(column[row]) for column in columns))
        vectors[row] = [sign * value for sign, value in zip(signs, evaluation.objectives, strict=True)]
    return _marked(tables, columns, count), vectors


def _marked(tables: Tables, columns: list[Any], count: int) -> Ints:
    """The designs, with what is inactive marked."""
    designs = np.stack(columns, axis=1).astype(np.int64) if columns else np.empty((count, 0), dtype=np.int64)
    for index, met in enumerate(tables.met):
        if met is not None:
            used = _values(met, columns, count).astype(bool)
            designs[~used, index] = INACTIVE
    return designs


def _structural_designs(tables: Tables, limit: int) -> list[Any]:
    """The designs that meet every condition: a column of options for each decision; unused ones hold option 0."""
    order = _order(tables)
    waiting = [(scope(diagram), diagram) for _, diagram in tables.conditions]
    columns: list[Any] = [None] * len(order)
    count, known = 1, set[int]()
    for index in order:
        look_at_the_clock()
        met = tables.met[index]
        options = np.array(tables.allowed[index], dtype=np.int16)
        if met is not None and scope(met) <= known:
            used = _values(met, columns, count).astype(bool)
            times = np.where(used, len(options), 1)
        else:
            times = np.full(count, len(options))
        total = int(times.sum())
        if total > limit:
            raise TooMany(f"more than {limit} combinations")
        columns = [None if column is None else np.repeat(column, times) for column in columns]
        first = np.repeat(np.cumsum(times) - times, times)
        columns[index] = options[np.arange(total) - first]
        count = total
        known.add(index)
        ready = [diagram for needs, diagram in waiting if needs <= known]
        waiting = [item for item in waiting if not item[0] <= known]
        for diagram in ready:
            columns = _kept(columns, _values(diagram, columns, count).astype(bool))
            count = len(columns[index])
    return columns


def _order(tables: Tables) -> list[int]:
    """Decisions after those that tell whether they are used."""
    order: list[int] = []
    pending: set[int] = set()

    def visit(index: int) -> None:
        if index in pending or index in order:
            return
        pending.add(index)
        met = tables.met[index]
        for other in sorted(scope(met)) if met is not None else ():
            visit(other)
        pending.discard(index)
        order.append(index)

    for index in range(len(tables.space.decisions)):
        visit(index)
    return order


def _kept(columns: list[Any], mask: npt.NDArray[np.bool_]) -> list[Any]:
    return columns if mask.all() else [None if column is None else column[mask] for column in columns]


def _sums(total: Sum, columns: Sequence[Any], count: int) -> Ints:
    """The values of a sum; Python's own integers where 64 bits do not hold them."""
    kind = object if max(abs(total.low), abs(total.high)) >= 2**62 else np.int64
    sums = np.zeros(count, dtype=kind)
    for part in total.parts:
        sums = sums + (_values(part, columns, count, kind) if isinstance(part, Node) else part)
    for pick in total.extremes:
        choose = np.maximum if pick.greatest else np.minimum
        sums = sums + reduce(choose, (_sums(item, columns, count) for item in pick.sums))
    return sums


def _values(diagram: Diagram, columns: Sequence[Any], count: int, kind: Any = np.int64) -> Any:
    """The leaf of each row."""
    values = np.empty(count, dtype=kind)
    if not isinstance(diagram, Node):
        values[:] = diagram
        return values
    stack: list[tuple[Diagram, Ints]] = [(diagram, np.arange(count))]
    while stack:
        item, rows = stack.pop()
        if not len(rows):
            continue
        if not isinstance(item, Node):
            values[rows] = item
            continue
        chosen = columns[item.decision][rows]
        for option, branch in enumerate(item.branches):  # a fixed decision has no node: its only branch stands for it
            stack.append((branch, rows[chosen == option]))
    return values


def _fitting(table: CoreTable, columns: Sequence[Any], count: int) -> npt.NDArray[np.bool_]:
    """The rows whose threads fit on the cores of a processor."""

    def value(diagram: Diagram) -> Ints:
        values: Ints = _values(diagram, columns, count)
        return values

    return fitting(table, value, lambda row: View([int(column[row]) for column in columns]), count)


def _exactly(tables: Tables, columns: Sequence[Any], count: int) -> npt.NDArray[np.bool_]:
    """The analysis' own verdict on each row, where the bounds alone are too coarse."""
    fits = np.empty(count, dtype=bool)
    for row in range(count):
        look_at_the_clock()
        fits[row] = tables.evaluator.evaluate(tuple(int(column[row]) for column in columns)).is_feasible
    return fits
