"""Activation rates as variables, for rates that depend on too many decisions to tabulate, and acyclic dispatch."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property, partial
from math import lcm
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.measures import Term
from dse.analysis.rates import NS_PER_S, RateKey, all_keys, is_event_triggered, source_rates_hz
from dse.analysis.views import View
from dse.encode.linear import EXACT_LIMIT, Board, Form, Given, ceil_int, check_exact
from dse.encode.rate_tables import RateTables
from dse.space.activation import trigger_graph
from dse.space.cycles import strong_components
from dse.space.trees import at, leaves
from dse.space.types import Space


def add_acyclic_activation(board: Board) -> None:
    """order[v] >= order[u] + 1 where u and v are both event-triggered and u triggers v."""
    graph = trigger_graph(board.space)
    for members in strong_components(graph):
        edges = {(one, other) for one in members for other in graph[one] if other in members}
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
        self.tables = RateTables(board)
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

    def product_form(self, term: Term, scale: int, given: Given) -> Form:
        """The product coefficient * rate, rounded up to 1 / `scale`: a linear constraint for each coefficient.

        Where the options in `given` are not chosen the product may be anything.
        """
        assert term.coefficient is not None and term.rate is not None
        board = self.board
        rate, most = self.variable(term.rate)
        factors = [
            (literal, value * Fraction(scale, self.scale)) for literal, value in board.table(term.coefficient, given)
        ]
        chosen = [board.options[decision][option] for decision, option in given.items()]
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
        """The variable of a rate and its upper bound."""
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

        table = board.table(stated)
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

        for literal, (eager, period) in self.board.table(mode):
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

    @cached_property
    def _bounds(self) -> dict[RateKey, int]:
        """Upper bounds on all rates, over the designs whose dispatch is acyclic.

        There no chain of dispatches comes back to where it was: as many rounds as a circle has members are enough.
        """
        space = self.board.space
        bounds = dict.fromkeys(all_keys(space), 0)
        for members in strong_components({key: list(_summands(space, key)) for key in bounds}):  # summands come first
            for _ in members:
                bounds.update({key: self._bound(key, bounds) for key in members})
        return bounds

    def _bound(self, key: RateKey, bounds: dict[RateKey, int]) -> int:
        """The bound that follows from those of the rates that this one sums."""
        kind, number = key
        space = self.board.space
        total = sum(bounds[source] for source in _summands(space, key))
        if kind == "activation":
            periods = [leaf for leaf in leaves(space.components[number].period_ns) if leaf is not None]
            return max(total, *(int(Fraction(NS_PER_S, period) * self.scale) for period in periods), 0)
        if kind == "input" or total:
            return total
        connection = space.connections[number]
        if connection.rate_hz is not None:
            return max(int(Fraction(leaf) * self.scale) for leaf in leaves(connection.rate_hz))
        if connection.data_rate is None:
            return 0
        sizes = [leaf for leaf in leaves(connection.size_bytes) if leaf]
        rates = [Fraction(leaf) / size for leaf in leaves(connection.data_rate) for size in sizes]
        return max((int(rate * self.scale) for rate in rates), default=0)


def _summands(space: Space, key: RateKey) -> list[RateKey]:
    """The rates that a rate is the sum, or the larger, or the smaller of."""
    kind, number = key
    if kind == "activation":
        return [("input", number)]
    if kind == "input":
        return [("delivery", wire) for wire in space.components[number].triggers]
    connection = space.connections[number]
    if connection.rate_hz is not None or connection.data_rate is not None or connection.source is None:
        return []
    return [("activation", connection.source)]
