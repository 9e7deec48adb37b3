"""OSATE's bus load: budgets, required budgets, and its verdicts on them (osate.md, part B).

Source: OSATE's `NewBusLoadAnalysis`. What a bus is required to carry are the budgets of what is bound to it directly:
virtual buses, and connections, of which those that are broadcast from one port count once, with the largest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from dse.analysis.binding import carriers_of
from dse.analysis.osate.findings import Finding
from dse.analysis.views import View
from dse.space.model.space import EMPTY, Bus, Space
from dse.space.model.trees import at
from dse.support.units import format_data_rate

ZERO = Fraction(0)


@dataclass(frozen=True, slots=True)
class BusBudget:
    """OSATE's budgets of a bus.

    In B/s, exact.
    """

    stated: Annotated[Fraction | None, "Its own, in B/s; null without one."]
    required: Annotated[Fraction, "The sum of those of what is bound to it."]
    findings: Annotated[tuple[Finding, ...], "OSATE's errors and warnings about them."] = ()


def _states_budgets(space: Space) -> bool:
    """Whether the problem has any budget."""
    return any(item.budget is not None for item in space.buses) or any(
        item.budget is not None for item in space.connections
    )


def bus_budget(
    space: Space, number: int, loads: dict[str, Fraction], capacity: Fraction | None, view: View
) -> BusBudget | None:
    """The budgets of a bus that carries `loads`, by connection; None where a problem states none at all.

    Required budgets count connections of one message once. Findings are compared with `capacity` in B/s.
    """
    bus = space.buses[number]
    if not _states_budgets(space) or bus.types[view[bus.type_decision]] == EMPTY:
        return None
    required = sum((item.budget or ZERO for item in _riders(space, number, view)), ZERO)
    findings: list[Finding] = []
    for names in _messages(space, number, view):
        budgets = [space.connections[index].budget for index in names]
        required += max((item or ZERO for item in budgets), default=ZERO)
        findings += _of_connections(space, number, names, loads)
    findings += _of_bus(bus.name, bus.budget, required, sum(loads.values(), ZERO), capacity)
    return BusBudget(bus.budget, required, tuple(findings))


def _riders(space: Space, number: int, view: View) -> list[Bus]:
    return [
        item
        for index, item in enumerate(space.buses)
        if item.virtual and item.types[view[item.type_decision]] != EMPTY and number in carriers_of(space, index, view)
    ]


def _messages(space: Space, number: int, view: View) -> list[list[int]]:
    """The connections that are bound to a bus directly; those that are one message of it together."""
    is_broadcast = bool(at(space.buses[number].broadcast, view))
    by_message: dict[object, list[int]] = {}
    for index, item in enumerate(space.connections):
        first = at(item.bus, view)
        if first is not None and number in (first, *item.further):
            port = (item.source, item.from_port) if is_broadcast and item.from_port is not None else index
            by_message.setdefault(port, []).append(index)
    return list(by_message.values())


def _of_connections(space: Space, number: int, names: list[int], loads: dict[str, Fraction]) -> Iterator[Finding]:
    items = [space.connections[index] for index in names]
    load = max((loads.get(item.name, ZERO) for item in items), default=ZERO)
    if len({item.budget for item in items}) > 1:
        said = ", ".join(item.name for item in items)
        yield Finding("warning", f"{said} are one message on {space.buses[number].name} and have unequal budgets")
    for item in items:
        if item.budget is None:
            yield Finding("warning", f"{item.name} has no budget")
        elif load > item.budget:
            yield Finding("error", f"{item.name} sends {_told(load)}, more than its budget of {_told(item.budget)}")


def _of_bus(
    name: str, budget: Fraction | None, required: Fraction, load: Fraction, capacity: Fraction | None
) -> Iterator[Finding]:
    if capacity is None:
        yield Finding("warning", f"{name} has no bandwidth")
    elif load > capacity:
        yield Finding("error", f"{name} carries {_told(load)}, more than its bandwidth of {_told(capacity)}")
    if budget is None:
        yield Finding("warning", f"{name} has no budget")
        return
    if capacity is not None and budget > capacity:
        yield Finding("error", f"the budget of {name}, {_told(budget)}, exceeds its bandwidth of {_told(capacity)}")
    if required > budget:
        required_words = f"the budgets of what is bound to {name}, {_told(required)} together"
        yield Finding("error", f"{required_words}, exceed its budget of {_told(budget)}")


def _told(value: Fraction) -> str:
    return format_data_rate(value)
