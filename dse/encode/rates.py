"""Activation rates as variables, for rates that depend on too many decisions to tabulate, and acyclic dispatch."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import cached_property, partial
from itertools import product
from math import lcm
from operator import add
from typing import Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.measures import Term
from dse.analysis.rates import (
    RateKey,
    all_keys,
    dispatch,
    passes_rates_on,
    source_rates_hz,
    source_rates_of,
    stated_hz,
    summands,
)
from dse.encode.linear import EXACT_LIMIT, Board, Form, Given, ceil_int, check_exact
from dse.space.architecture.activation import trigger_graph
from dse.space.model.arrivals import PROTOCOLS
from dse.space.model.trees import leaves
from dse.support.graphs import strong_components


def add_acyclic_activation(board: Board) -> None:
    """order[v] >= order[u] + 1 where the rates of u and v follow from their inputs and u triggers v.

    Only components in a cycle of possible dispatches get an order variable.
    """
    graph = trigger_graph(board.space)
    for members in strong_components(graph):
        edges = {(one, other) for one in members for other in graph[one] if other in members}
        if not edges:
            continue
        order = {number: board.model.new_int_var(0, len(members), "") for number in sorted(members)}
        components = {number: board.space.components[number] for number in sorted(members)}
        eager = {number: board.holds(partial(passes_rates_on, item)) for number, item in components.items()}
        for one, other in sorted(edges):
            if one == other:
                board.forbid([eager[one]])
            else:
                later = board.model.add(order[other] >= order[one] + 1)
                later.only_enforce_if([eager[one], eager[other]])


class RateVariables:
    """Integer variables for rates in units of 1 / `scale` Hz, made when asked for.

    A rate is tabulated where it has few values; these variables are for the others.
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.tables = RateTables(board)
        self._made: dict[RateKey, tuple[cp_model.IntVar, int]] = {}
        self._scale = 0

    @property
    def scale(self) -> int:
        """The common denominator of all source rates.

        Raises `OverflowError` where it would be too large for exact sums.
        """
        if not self._scale:
            rates = source_rates_hz(self.board.space)
            self._scale = lcm(*(rate.denominator for found in rates.values() for rate in found))
            if self._scale > EXACT_LIMIT >> 20:
                raise OverflowError("the periods and rates have no common multiple small enough to sum rates exactly")
        return self._scale

    def product_form(self, term: Term, scale: int, conditions: Given) -> Form:
        """The product coefficient * rate, rounded up to 1 / `scale`: a linear constraint for each coefficient.

        Where the options in `conditions` are not chosen the product may be anything.
        """
        assert term.coefficient is not None and term.rate is not None
        board = self.board
        rate, most = self.variable(term.rate)
        factors = [
            (literal, value * Fraction(scale, self.scale))
            for literal, value in board.table(term.coefficient, conditions)
        ]
        chosen = [board.options[decision][option] for decision, option in conditions.items()]
        ends = [ceil_int(factor * most) for _, factor in factors]
        low, high = min(0, *ends), max(0, *ends)
        check_exact(max(high, -low), f"the rate of {term.label} times its work or size")
        product = board.model.new_int_var(low, high, "")
        for literal, factor in factors:
            check_exact(factor.numerator * most, f"the rate of {term.label} times its work or size")
            check_exact(factor.denominator * max(high, -low), f"the sum over {term.label}")
            exact = factor.numerator * rate
            board.model.add(factor.denominator * product >= exact).only_enforce_if([literal, *chosen])
            most_product = exact + factor.denominator - 1
            board.model.add(factor.denominator * product <= most_product).only_enforce_if([literal, *chosen])
        return Form(0, {product.index: 1}, low, high)

    def variable(self, key: RateKey) -> tuple[cp_model.IntVar, int]:
        """The variable of a rate and its upper bound.

        Defined by linear constraints over other rates on first use.
        """
        if key not in self._made:
            most = self._bounds[key]
            check_exact(most, "a rate in its common denominator")
            made = self.board.model.new_int_var(0, most, "")
            self._made[key] = (made, most)
            self._define(key, made)
        return self._made[key]

    def _define(self, key: RateKey, variable: cp_model.IntVar) -> None:
        kind, number = key
        space, model = self.board.space, self.board.model
        if kind == "input":
            triggers = space.components[number].triggers
            model.add(variable == sum(self.variable(("delivery", wire))[0] for wire in triggers))
        elif kind == "slowest":
            delivered: list[Any] = [self.variable(("delivery", wire))[0] for wire in space.components[number].triggers]
            model.add_min_equality(variable, delivered or [0])
        elif kind == "delivery":
            self._define_delivery(number, variable)
        else:
            self._define_activation(number, variable)

    def _define_delivery(self, number: int, variable: cp_model.IntVar) -> None:
        connection, board = self.board.space.connections[number], self.board
        if not connection.states_rate:
            source = self.variable(("activation", connection.sender))[0] if connection.sender is not None else 0
            board.model.add(variable == source)
            return
        table = board.table(partial(stated_hz, connection))
        form = board.form((literal, int(value * self.scale)) for literal, value in table)
        board.model.add(variable == board.expression(form))

    def _define_activation(self, number: int, variable: cp_model.IntVar) -> None:
        """Its own rate, and what it takes of its inputs (`dse.analysis.rates.Dispatch`)."""
        space, model = self.board.space, self.board.model
        component = space.components[number]

        for literal, rule in self.board.table(partial(dispatch, component)):
            own = int(rule.own * self.scale)
            if not rule.by_inputs:
                model.add(variable == own).only_enforce_if(literal)
                continue
            arriving, most = self.variable((rule.arriving, number))
            taken: Any = arriving
            if rule.most is not None:
                cap = int(rule.most * self.scale)
                taken = model.new_int_var(0, min(cap, most), "")
                model.add_min_equality(taken, [arriving, cap])
            model.add(variable == taken + own).only_enforce_if(literal)

    @cached_property
    def _bounds(self) -> dict[RateKey, int]:
        """Upper bounds on all rates, over the designs whose dispatch is acyclic.

        There no chain of dispatches comes back to where it was: as many rounds as a cycle has members are enough.
        """
        space = self.board.space
        bounds = dict.fromkeys(all_keys(space), 0)
        for members in strong_components({key: list(summands(space, key)) for key in bounds}):  # summands come first
            for _ in members:
                bounds.update({key: self._bound(key, bounds) for key in members})
        return bounds

    def _bound(self, key: RateKey, bounds: dict[RateKey, int]) -> int:
        """The bound that follows from those of the rates that this one sums."""
        space = self.board.space
        total = sum(bounds[source] for source in summands(space, key))
        most = max([0, *(int(rate * self.scale) for rate in source_rates_of(space, key))])
        return total + most if key[0] == "activation" and self._adds(key[1]) else max(total, most)

    def _adds(self, number: int) -> bool:
        """Whether a component may take its inputs on top of a rate of its own."""
        protocols = set(leaves(self.board.space.components[number].protocol)) - {None}
        return any(PROTOCOLS[name].by_inputs and PROTOCOLS[name].by_timer for name in protocols)


# Rates as disjoint literals, and coefficient * rate as a sum over pairs of cases.
#
# A chain of event-triggered threads inherits its rate from far away: tabulating that over all decisions on the way
# gives long tables. Here each component's rate has one literal per value it can take, defined from its senders'
# literals, so that a table grows with the number of different rates instead of the number of ways to get them.


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
        """The literals and values (Hz) of a rate.

        Pairs of a literal and an exact rate in Hz.
        """
        if key not in self._made:
            self._made[key] = None  # a cycle of event-triggered components is asked for again and has no table
            self._made[key] = self._make(key)
        return self._made[key]

    def _make(self, key: RateKey) -> RateTable | None:
        kind, number = key
        if kind in ("input", "slowest"):
            return self._arriving(number, slowest=kind == "slowest")
        if kind == "delivery":
            return self._delivery(number)
        return self._activation(number)

    def _arriving(self, number: int, *, slowest: bool) -> RateTable | None:
        """Sums over the triggers, or the least of them, one value for each combination of theirs."""
        total: RateTable = [(self.board.true, Fraction(0))]
        for place, wire in enumerate(self.board.space.components[number].triggers):
            more = self.table(("delivery", wire))
            if more is None or len(more) * len(total) > MOST_RATES * 4:
                return None
            together = min if slowest and place else add
            pairs = [(self.board.all_of((a, b)), together(x, y)) for (a, x), (b, y) in product(total, more)]
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
            arriving = self.table((rule.arriving, number))
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
        """The table of coefficient * rate; at most one literal is true, and where none is, the product is 0.

        Pairs of a literal and an exact product; cases of 0 are left out.
        """
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
