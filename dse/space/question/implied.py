"""Limits that nobody states: no core, no bandwidth and no exclusive bus is used beyond all of it.

They are requirements like others, the last of a space, unless `overload: allowed` lifts them: for a whole problem (the
setting), for a processor, or for a bus. What somebody requires, a deadline among it, is never lifted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction

from dse.space.model.criteria import Metric, Requirement
from dse.space.model.space import Space
from dse.space.model.trees import leaves
from dse.space.question.limits import states_bandwidth
from dse.space.question.metrics import busy_obstacle
from dse.support.units import DIMENSIONLESS, Quantity

WHOLE = Quantity(Fraction(1), DIMENSIONLESS, "%")
IMPLIED = "implied"
"""The origin of a limit that nobody states."""


def with_implied(space: Space) -> Space:
    """The space with the limits that its architecture and its setting imply behind its other requirements.

    One that a stated limit keeps, the same metric at most at 100 %, is left out.
    """
    stated = [item for item in space.requirements if not item.implied]
    kept = {item.metric for item in stated if _keeps_whole(item)}
    implied = [item for item in _implied_limits(space) if item.metric not in kept]
    return replace(space, requirements=(*stated, *implied))


def _keeps_whole(item: Requirement) -> bool:
    is_share = item.is_upper and item.limit.dimension == DIMENSIONLESS
    return is_share and item.limit.value <= 1


def _implied_limits(space: Space) -> Iterator[Requirement]:
    """100 % of every core, of every bandwidth, and of the time of every bus that carries one message at a time."""
    if space.overload == "allowed":
        return
    for number, slot in enumerate(space.processors):
        is_used = any(number in set(leaves(item.processor)) for item in space.components)
        if is_used and not slot.overload:
            yield _whole("utilisation", slot.name, number)
    for number, bus in enumerate(space.buses):
        if bus.overload:
            continue
        if states_bandwidth(bus):
            yield _whole("load", bus.name, number)
        if any(leaves(bus.exclusive)) and not busy_obstacle(space, number):
            yield _whole("busy", bus.name, number)


def _whole(kind: str, name: str, number: int) -> Requirement:
    metric = Metric(f"{kind} of {name}", kind, number)
    return Requirement(f"{metric.name} <= 100 %", metric, "<=", WHOLE, IMPLIED, implied=True)


def overload_needed(space: Space, member: Requirement, limit: Fraction) -> str:
    """The processor or bus that must be allowed to be overloaded where a limit moves to `limit`; "" where none must.

    `limit` is in coherent units, 1 for 100 %. Explanations use it: such a limit can only move with `overload: allowed`.
    """
    of = member.metric.name.partition(" of ")[2]
    if member.implied:
        return of
    is_beyond = member.limit.dimension == DIMENSIONLESS and limit > 1
    return of if is_beyond and member.metric in {item.metric for item in _implied_limits(space)} else ""


def overloads_needed(space: Space, members: Iterable[Requirement], limit: Fraction) -> str:
    """The results of `overload_needed` for limits that move together, separated by commas."""
    return ", ".join(filter(None, (overload_needed(space, item, limit) for item in members)))
