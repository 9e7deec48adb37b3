"""Activation rates as variables, for rates that depend on too many decisions to tabulate, and acyclic dispatch."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from math import lcm
from typing import Any

import networkx
from ortools.sat.python import cp_model

from dse.analysis.measures import Term
from dse.analysis.rates import NS_PER_S, RateKey, is_event_triggered, source_rates_hz
from dse.analysis.views import View
from dse.encode.forms import EXACT_LIMIT, Board, Form, ceil_int
from dse.space.activation import trigger_graph
from dse.space.trees import at, leaves


def add_acyclic_activation(board: Board) -> None:
    """order[v] >= order[u] + 1 where u and v are both event-triggered and u triggers v."""
    graph = trigger_graph(board.space)
    for members in networkx.strongly_connected_components(graph):
        edges = {(one, other) for one, other, _ in graph.edges(members, keys=True) if other in members}
        if not edges:
            continue
        order = {number: board.model.new_int_var(0, len(members), "") for number in sorted(members)}
        components = {number: board.space.components[number] for number in sorted(members)}
        eager = {number: board.holds(partial(is_event_triggered, item)) for number, item in components.items()}
        for one, other in sorted(edges):
            if one == other:
                board.forbid([eager[one]])
            else:
                later = board.model.add(order[other] >= order[one] + 1)
                later.only_enforce_if([eager[one], eager[other]])


class RateVariables:
    """Integer variables for rates in units of 1 / `scale` Hz, made when asked for."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._made: dict[RateKey, tuple[cp_model.IntVar, int]] = {}
        self._scale = 0

    @property
    def scale(self) -> int:
        """The common denominator of all source rates."""
        if not self._scale:
            rates = source_rates_hz(self.board.space)
            self._scale = lcm(*(rate.denominator for found in rates.values() for rate in found))
            if self._scale > EXACT_LIMIT >> 20:
                raise OverflowError("the periods and rates have no common multiple small enough to sum rates exactly")
        return self._scale

    def product_form(self, term: Term, scale: int) -> Form:
        """The product coefficient * rate, rounded up to 1 / `scale`: a linear constraint for each coefficient."""
        assert term.coefficient is not None and term.rate is not None
        board = self.board
        rate, most = self.variable(term.rate)
        cases = board.table(term.coefficient) or []
        high = max((ceil_int(value * scale * most / self.scale) for _, value in cases), default=0)
        product = board.model.new_int_var(0, high, "")
        for literal, coefficient in cases:
            factor = coefficient * Fraction(scale, self.scale)
            exact = factor.numerator * rate
            board.model.add(factor.denominator * product >= exact).only_enforce_if(literal)
            board.model.add(factor.denominator * product <= exact + factor.denominator - 1).only_enforce_if(literal)
        return Form(0, {product.index: 1}, 0, high)

    def variable(self, key: RateKey) -> tuple[cp_model.IntVar, int]:
        """The variable of a rate and its upper bound."""
        if key not in self._made:
            most = self._bound(key, frozenset())
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
        elif kind == "delivery":
            self._define_delivery(number, variable)
        else:
            self._define_activation(number, variable)

    def _define_delivery(self, number: int, variable: cp_model.IntVar) -> None:
        connection, board = self.board.space.connections[number], self.board
        if connection.rate_hz is None and connection.data_rate is None:
            source = self.variable(("activation", connection.source))[0] if connection.source is not None else 0
            board.model.add(variable == source)
            return

        def stated(view: View) -> Fraction:
            if connection.rate_hz is not None:
                return Fraction(at(connection.rate_hz, view))
            size = at(connection.size_bytes, view)
            return Fraction(at(connection.data_rate, view)) / size if size else Fraction(0)

        table = board.table(stated) or []
        form = board.form((literal, int(value * self.scale)) for literal, value in table)
        board.model.add(variable == board.expression(form))

    def _define_activation(self, number: int, variable: cp_model.IntVar) -> None:
        """1 / period, the input rate, or for sporadic components the smaller of the two."""
        space, model = self.board.space, self.board.model
        component = space.components[number]

        def mode(view: View) -> tuple[bool, int | None]:
            eager = is_event_triggered(component, view)
            bounded = at(component.protocol, view) == "sporadic" or not eager
            return eager, at(component.period_ns, view) if bounded else None

        for literal, (eager, period) in self.board.table(mode) or []:
            cap = int(Fraction(NS_PER_S, period) * self.scale) if period is not None else None
            if not eager:
                model.add(variable == cap).only_enforce_if(literal)
                continue
            arriving, most = self.variable(("input", number))
            if cap is None:
                model.add(variable == arriving).only_enforce_if(literal)
            else:
                smaller: Any = model.new_int_var(0, min(cap, most), "")
                model.add_min_equality(smaller, [arriving, cap])
                model.add(variable == smaller).only_enforce_if(literal)

    def _bound(self, key: RateKey, above: frozenset[RateKey]) -> int:
        """An upper bound on a rate in any design whose dispatch is acyclic."""
        if key in above:
            return 0
        kind, number = key
        space, seen = self.board.space, above | {key}
        if kind == "input":
            return sum(self._bound(("delivery", wire), seen) for wire in space.components[number].triggers)
        if kind == "activation":
            periods = [leaf for leaf in leaves(space.components[number].period_ns) if leaf is not None]
            own = max((int(Fraction(NS_PER_S, period) * self.scale) for period in periods), default=0)
            return max(own, self._bound(("input", number), seen))
        connection = space.connections[number]
        if connection.rate_hz is not None:
            return max(int(Fraction(leaf) * self.scale) for leaf in leaves(connection.rate_hz))
        if connection.data_rate is not None:
            sizes = [leaf for leaf in leaves(connection.size_bytes) if leaf]
            rates = [Fraction(leaf) / size for leaf in leaves(connection.data_rate) for size in sizes]
            return max((int(rate * self.scale) for rate in rates), default=0)
        return self._bound(("activation", connection.source), seen) if connection.source is not None else 0
