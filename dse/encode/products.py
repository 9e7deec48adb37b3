"""Rates as disjoint literals, and coefficient * rate as a sum over pairs of cases.

A chain of event-triggered threads inherits its rate from far away: tabulating that over all decisions on the way gives
long tables. Here each component's rate has one literal per value it can take, defined from its senders' literals, so
that a table grows with the number of different rates instead of the number of ways to get them.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import product
from typing import Any, TypeAlias

from dse.analysis.rates import NS_PER_S, RateKey, is_event_triggered
from dse.analysis.views import View
from dse.encode.forms import Board
from dse.space.trees import at

RateTable: TypeAlias = list[tuple[Any, Fraction]]

MOST_RATES = 64
"""More values than this are left to an integer variable."""


class RateTables:
    """For each rate the literals of its values, exactly one of which is true; None where there are too many values."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._made: dict[RateKey, RateTable | None] = {}

    def table(self, key: RateKey) -> RateTable | None:
        """The literals and values (Hz) of a rate."""
        if key not in self._made:
            self._made[key] = None  # a circle of event-triggered components is asked for again and has no table
            self._made[key] = self._make(key)
        return self._made[key]

    def _make(self, key: RateKey) -> RateTable | None:
        kind, number = key
        if kind == "input":
            return self._input(number)
        if kind == "delivery":
            return self._delivery(number)
        return self._activation(number)

    def _input(self, number: int) -> RateTable | None:
        """Sums over the triggers, one value for each combination of theirs."""
        total: RateTable = [(self.board.true, Fraction(0))]
        for wire in self.board.space.components[number].triggers:
            more = self.table(("delivery", wire))
            if more is None or len(more) * len(total) > MOST_RATES * 4:
                return None
            pairs = [(self.board.all_of((a, b)), x + y) for (a, x), (b, y) in product(total, more)]
            merged = self._merged(pairs)
            if merged is None:
                return None
            total = merged
        return total

    def _delivery(self, number: int) -> RateTable | None:
        connection = self.board.space.connections[number]

        def stated(view: View) -> Fraction:
            if connection.rate_hz is not None:
                return Fraction(at(connection.rate_hz, view))
            size = at(connection.size_bytes, view)
            return Fraction(at(connection.data_rate, view)) / size if size else Fraction(0)

        if connection.rate_hz is not None or connection.data_rate is not None:
            return self._merged(self.board.table(stated) or [])
        if connection.source is None:
            return [(self.board.true, Fraction(0))]
        return self.table(("activation", connection.source))

    def _activation(self, number: int) -> RateTable | None:
        """1 / period, the input rate, or for sporadic components the smaller of the two."""
        component = self.board.space.components[number]

        def mode(view: View) -> tuple[bool, Fraction | None]:
            eager = is_event_triggered(component, view)
            bounded = at(component.protocol, view) == "sporadic" or not eager
            return eager, Fraction(NS_PER_S, at(component.period_ns, view)) if bounded else None

        pairs: RateTable = []
        for literal, (eager, own) in self.board.table(mode) or []:
            if not eager:
                assert own is not None
                pairs.append((literal, own))
                continue
            arriving = self.table(("input", number))
            if arriving is None:
                return None
            for other, rate in arriving:
                pairs.append((self.board.all_of((literal, other)), rate if own is None else min(rate, own)))
        return self._merged(pairs)

    def _merged(self, pairs: Iterable[tuple[Any, Fraction]]) -> RateTable | None:
        """One literal for each value."""
        never = self.board.true.negated().index
        by_value: dict[Fraction, list[Any]] = {}
        for literal, value in pairs:
            if literal.index != never:
                by_value.setdefault(value, []).append(literal)
        if len(by_value) > MOST_RATES:
            return None
        table = [(self.board.any_of(literals), value) for value, literals in sorted(by_value.items())]
        if len(table) > 1:
            self.board.exactly_one([literal for literal, _ in table])
        return table


def product_pairs(board: Board, coefficients: RateTable, rates: RateTable) -> list[tuple[Any, Fraction]]:
    """The table of coefficient * rate: y[c, v] is true where coefficient case c and rate v are.

    sum over v of y[c, v] = c for every coefficient case but 0, and sum over c of y[c, v] <= v. At most one y is true;
    where none is, the product is 0.
    """
    never = board.true.negated().index
    by_value: dict[Fraction, list[Any]] = {}
    for literal, value in coefficients:
        if literal.index != never:
            by_value.setdefault(value, []).append(literal)
    cases = [(board.any_of(literals), value) for value, literals in sorted(by_value.items()) if value]
    if len(rates) == 1:
        return [(literal, value * rates[0][1]) for literal, value in cases]
    if len(by_value) == 1 and cases:
        return [(literal, cases[0][1] * rate) for literal, rate in rates]
    pairs: list[tuple[Any, Fraction]] = []
    columns: list[list[Any]] = [[] for _ in rates]
    for literal, value in cases:
        row = []
        for column, (_, rate) in zip(columns, rates, strict=True):
            both = board.model.new_bool_var("")
            row.append(both)
            column.append(both)
            pairs.append((both, value * rate))
        board.model.add_exactly_one([literal.negated(), *row])
    for column, (literal, _) in zip(columns, rates, strict=True):
        board.model.add_at_most_one([literal.negated(), *column])
    return pairs
