"""Which limits fit a metric, and what they are in its own unit."""

from __future__ import annotations

from fractions import Fraction

from dse.space.architecture.carriers import by_type
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import SHARES, metric_dimension, total_unit
from dse.space.model.space import EMPTY, UNKNOWN_TYPE, Bus, Space
from dse.space.question.metrics import QuestionError
from dse.support.units import (
    DATA_RATE,
    DIMENSIONLESS,
    MONEY,
    POWER,
    TIME,
    Dimension,
    Quantity,
    as_written,
    shown,
    unit_hint,
    unit_ratio,
)

EXAMPLES = {TIME: "20 ms", DATA_RATE: "5 KB/s", MONEY: "500 EUR", POWER: "10 W", DIMENSIONLESS: "70 %"}


def own_limit(space: Space, metric: Metric, limit: Quantity) -> Quantity:
    """A limit as its metric counts: in coherent units, or for a declared total in its own unit.

    It must be of the metric's kind; a load may also be limited by a share of the bandwidth.

    Raises
    ------
    QuestionError
        when it is not.
    """
    wanted = metric_dimension(space, metric)
    if wanted is None:
        unit = total_unit(space, metric)
        ratio = unit_ratio(limit.unit, unit) if limit.unit and unit else Fraction(1) if limit.unit == unit else None
        if ratio is None:
            got = shown(limit.unit) if limit.unit else "a bare number"
            wanted_unit = f"a limit in {unit}" if unit else "a plain number"
            raise QuestionError(f"expected {wanted_unit} for {metric.name}, got {got}")
        return Quantity(as_written(limit).value * ratio, None, unit)
    of_bandwidth = is_share(metric, limit)
    if limit.unit == "" and (wanted != DIMENSIONLESS or metric.kind in SHARES):
        hint = f"such as {EXAMPLES[wanted]}" if wanted in EXAMPLES else _units(space, wanted)
        raise QuestionError(f"expected a limit with its unit for {metric.name}, got a bare number", hint)
    if limit.dimension != wanted and not of_bandwidth:
        raise QuestionError(f"{shown(limit.unit)} is no unit of {metric.name}", _units(space, wanted, limit.unit))
    if wanted == MONEY and limit.unit != space.currency:
        raise QuestionError(f"prices are in {space.currency}, got {limit.unit}")
    if of_bandwidth:
        _check_bandwidth(space.buses[metric.index or 0])
    return limit


def is_share(metric: Metric, limit: Quantity) -> bool:
    """Whether a limit is a share of the bandwidth.

    In percent, as against a data rate in B/s.
    """
    return metric.kind == "load" and limit.dimension == DIMENSIONLESS and limit.unit != ""


def states_bandwidth(bus: Bus) -> bool:
    """Whether some type of a bus has a bandwidth; middleware mostly has none."""
    return any(has for _, has in by_type(bus, bus.bandwidth_bps))


def _units(space: Space, wanted: Dimension, unit: str = "") -> str:
    """The closest unit of the wanted kind, or all of them."""
    if wanted == MONEY:
        return f"units: {space.currency}"
    hint = unit_hint(unit, wanted)
    is_list = wanted == DATA_RATE and hint.startswith("units")
    return f"{hint}, or a share of the bandwidth such as 50 %" if is_list else hint


def _check_bandwidth(bus: Bus) -> None:
    """Every type that the slot may have needs a bandwidth."""
    for name, has in by_type(bus, bus.bandwidth_bps):
        if not has and name not in (EMPTY, UNKNOWN_TYPE):
            message = f"{shown(bus.name)} has no bandwidth to take a share of"
            raise QuestionError(message, f"type {shown(name)} states none")
