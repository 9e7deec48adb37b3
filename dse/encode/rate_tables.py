"""Rates as disjoint literals, and coefficient * rate as a sum over pairs of cases.

A chain of event-triggered threads inherits its rate from far away: tabulating that over all decisions on the way gives
long tables. Here each component's rate has one literal per value it can take, defined from its senders' literals, so
that a table grows with the number of different rates instead of the number of ways to get them.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import partial
from itertools import product
from typing import Any, TypeAlias

from dse.analysis.rates import RateKey, dispatch, stated_hz
from dse.encode.linear import Board

RateTable: TypeAlias = list[tuple[Any, Fraction]]

MOST_RATES = 64
"""More values than this are left to an integer variable."""


class RateTables:
    """For each rate the literals of its values, exactly one of which is true; None where there are too many values."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._made: dict[RateKey, RateTable | None] = {}
        self._products: dict[tuple[tuple[int, ...], tuple[int, ...]], list[list[Any]]] = {}

    def table(self, key: RateKey) -> RateTable | None:
        """The literals and values (Hz) of a rate."""
        if key not in self._made:
            self._made[key] = None  # a cycle of event-triggered components is asked for again and has no table
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

        if connection.states_rate:
            return self._merged(self.board.table(partial(stated_hz, connection)))
        if connection.sender is None:
            return [(self.board.true, Fraction(0))]
        return self.table(("activation", connection.sender))

    def _activation(self, number: int) -> RateTable | None:
        """Its own rate, and what it takes of its inputs (`dse.analysis.rates.Dispatch`)."""
        component = self.board.space.components[number]

        pairs: RateTable = []
        for literal, rule in self.board.table(partial(dispatch, component)):
            if not rule.by_inputs:
                pairs.append((literal, rule.own))
                continue
            arriving = self.table(("input", number))
            if arriving is None:
                return None
            for other, rate in arriving:
                taken = rate if rule.most is None else min(rate, rule.most)
                pairs.append((self.board.all_of((literal, other)), rule.own + taken))
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

    def times(self, coefficients: RateTable, rates: RateTable) -> RateTable:
        """The table of coefficient * rate; at most one literal is true, and where none is, the product is 0."""
        never = self.board.true.negated().index
        by_value: dict[Fraction, list[Any]] = {}
        for literal, value in coefficients:
            if literal.index != never:
                by_value.setdefault(value, []).append(literal)
        if len(by_value) == 1:
            (value,) = by_value
            return [(literal, value * rate) for literal, rate in rates]
        cases = [(self.board.any_of(literals), value) for value, literals in sorted(by_value.items()) if value]
        if len(rates) == 1:
            return [(literal, value * rates[0][1]) for literal, value in cases]
        pairs = self._pairs([literal for literal, _ in cases], [literal for literal, _ in rates])
        return [
            (both, value * rate)
            for row, (_, value) in zip(pairs, cases, strict=True)
            for both, (_, rate) in zip(row, rates, strict=True)
        ]

    def _pairs(self, ones: list[Any], others: list[Any]) -> list[list[Any]]:
        """y[i, j] is true where ones[i] and others[j] are; at most one of `ones` is true, exactly one of `others`.

        sum over j of y[i, j] = ones[i], and sum over i of y[i, j] <= others[j].
        """
        key = (tuple(literal.index for literal in ones), tuple(literal.index for literal in others))
        if key not in self._products:
            model = self.board.model
            rows = [[model.new_bool_var("") for _ in others] for _ in ones]
            for literal, row in zip(ones, rows, strict=True):
                model.add_exactly_one([literal.negated(), *row])
            for number, literal in enumerate(others):
                model.add_at_most_one([literal.negated(), *(row[number] for row in rows)])
            self._products[key] = rows
        return self._products[key]
