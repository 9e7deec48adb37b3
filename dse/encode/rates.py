"""Activation rates as variables, for rates that depend on too many decisions to tabulate, and acyclic dispatch."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property, partial
from math import lcm
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.measures import Term
from dse.analysis.rates import (
    RateKey,
    all_keys,
    dispatch,
    is_event_triggered,
    source_rates_hz,
    source_rates_of,
    stated_hz,
    summands,
)
from dse.encode.linear import EXACT_LIMIT, Board, Form, Given, ceil_int, check_exact
from dse.encode.rate_tables import RateTables
from dse.space.activation import trigger_graph
from dse.space.cycles import strong_components
from dse.space.protocols import PROTOCOLS
from dse.space.trees import leaves


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
            arriving, most = self.variable(("input", number))
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
