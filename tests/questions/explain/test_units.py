"""Every unit of every kind of metric there and back: a limit at the value holds, one beyond it is mended by advice."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.support.units import (
    DATA,
    DATA_RATE,
    DIMENSIONLESS,
    FREQUENCY,
    LENGTH,
    POWER,
    SPEED,
    TIME,
    UNITS,
    canonical_unit,
    format_number,
    units_of,
)
from tests.helpers.effort import LONG

PROBLEM = """
dse: 1
name: units
totals: {share: "TOTAL"}
processor_types: {P: {cores: 2, price: 31 EUR, power: 7 W, totals: {share: "37 TOTAL"}}}
bus_types: {wire: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 3 us, per_byte: 1 us .. 7 us}}}
processors: {p: {type: P}}
buses: {b: {type: wire}}
devices: {d: {period: 5 ms, compute_execution_time: 11 us .. 17 us}}
threads: {t: {processor: p, period: 10 ms, compute_execution_time: 1 ms .. 3 ms}}
connections: {c: {from: d, to: t, data_size: 13 B, bus: b}}
flows: {f: {path: [d, t]}}
METRICS
requirements: ["REQUIREMENT"]
objectives: [minimise price]
"""
DERIVED = {
    "distance": "jitter of f * 0.6 m/s",
    "speed": "jitter of f * 0.6 m/s / 1 s",
    "volume": "load of b * 3 s",
    "frequency": "utilisation of p / 9 s",
    "ratio": "utilisation of p * 2",
    "twice": "share * 2",
}
"""What a problem defines if its requirement is on it."""
# The only design: 11 us .. 17 us, 16 us .. 94 us on the bus, sampled within 10 ms, 1 ms .. 3 ms; 13 B every 5 ms.
MS, UTILISATION = Fraction(1, 1000), Fraction(3, 10)
JITTER = (Fraction("13.111") - Fraction("1.027")) * MS
FOREIGN = ("g", "points", "USD per hour")
"""Units that no table has."""
TIMES = (*units_of(TIME), "µs", "μs")
METRICS: dict[str, tuple[Fraction, tuple[str, ...]]] = {
    "latency of f": (Fraction("13.111") * MS, TIMES),
    "min latency of f": (Fraction("1.027") * MS, TIMES),
    "jitter of f": (JITTER, TIMES),
    "response time of t": (3 * MS, TIMES),
    "utilisation of p": (UTILISATION / 2, units_of(DIMENSIONLESS)),  # the thread alone needs twice that of one core
    "load of b": (Fraction(2600), units_of(DATA_RATE)),
    "busy of b": (Fraction(94 * 200, 10**6), units_of(DIMENSIONLESS)),
    "price": (Fraction(3100), ("EUR",)),
    "price of p": (Fraction(3100), ("EUR",)),
    "power": (Fraction(7), units_of(POWER)),
    "distance": (JITTER * 6 / 10, units_of(LENGTH)),
    "speed": (JITTER * 6 / 10, units_of(SPEED)),
    "volume": (Fraction(7800), units_of(DATA)),
    "frequency": (UTILISATION / 9, units_of(FREQUENCY)),
    "ratio": (UTILISATION * 2, units_of(DIMENSIONLESS)),
}
"""The value of each metric in coherent units, and the units of its limits."""
TOTALS = {"share": Fraction(37), "twice": Fraction(74)}
SHARES = {"utilisation of p": UTILISATION, "load of b": Fraction(2600, 125_000)}
ELSEWHERE = {unit for _, units in METRICS.values() for unit in units}
"""Units that some metric has of its own."""
FOR_TOTALS = (*UNITS, "µs", *FOREIGN)
ALONE = tuple(unit for unit in FOR_TOTALS if unit not in ELSEWHERE)
SOME = {
    **{metric: METRICS[metric][1][::3] for metric in ("min latency of f", "jitter of f", "utilisation of p")},
    "response time of t": TIMES[1::3],
    "ratio": METRICS["ratio"][1][1::3],
    "share": FOR_TOTALS[::12],
    "twice": (*ALONE, *[unit for unit in FOR_TOTALS if unit in ELSEWHERE][::18]),
}
"""Of metrics whose units all have another metric of their kind: some of them. Every unit is that of some limit."""
CASES = [
    *((metric, value / UNITS[canonical_unit(unit)][0], unit) for metric, (value, units) in METRICS.items()
      for unit in (units if LONG else SOME.get(metric, units))),
    *((metric, value, unit) for metric, value in TOTALS.items() for unit in (FOR_TOTALS if LONG else SOME[metric])),
    *(("load of b", SHARES["load of b"] / UNITS[unit][0], unit) for unit in units_of(DIMENSIONLESS)),
]  # fmt: skip
PROVED = {metric: {unit for name, _, unit in CASES if name == metric} for metric, _, _ in CASES}
"""The units of each metric whose results are proved a second time."""
if not LONG:
    PROVED = {metric: set(sorted(units)[:2]) for metric, units in PROVED.items()}


def problem(requirement: str, unit: str) -> dse.Problem:
    """The problem with one requirement, its total in a unit."""
    defined = "".join(f"\n  {name}: {text}" for name, text in DERIVED.items() if requirement.startswith(name))
    text = PROBLEM.replace("METRICS", f"metrics:{defined}" if defined else "").replace("TOTAL", unit)
    return dse.loads(text.replace("REQUIREMENT", requirement))


@pytest.mark.parametrize(("metric", "value", "unit"), CASES)
def test_a_limit_and_its_advice_are_in_the_unit_of_the_limit(metric: str, value: Fraction, unit: str) -> None:
    if metric == "utilisation of p":
        value *= 2
    least = f"{metric} <= {format_number(value)} {unit}"
    kept = problem(least, unit)
    held = dse.solve(kept)
    assert held.status == "complete"
    assert unit not in PROVED[metric] or dse.verify(held, problem=kept).status == "verified"
    broken = problem(f"{metric} <= {format_number(value * 999 / 1000)} {unit}", unit)
    result = dse.solve(broken)
    assert result.status == "infeasible"
    (clash,) = result.conflicts[0].members
    assert clash.closest is not None and clash.limit is not None
    assert clash.limit / clash.closest == Fraction(999, 1000)
    assert unit not in PROVED[metric] or dse.verify(result, problem=broken).status == "verified"
    (advice,) = dse.explain(broken).relaxations
    assert advice.text == least


SIGNS = ("<", ">=", ">", "==")
COMPARED = [
    (*case, sign)
    for at, case in enumerate({case[0]: case for case in CASES}.values())
    for number, sign in enumerate(SIGNS)
    if LONG or number in (at % 4, (at + 1) % 4)
]
"""Each metric with each sign where there is time, else with two of them in turn."""


@pytest.mark.parametrize(("metric", "value", "unit", "sign"), COMPARED)
def test_other_comparisons_too(metric: str, value: Fraction, unit: str, sign: str) -> None:
    """Of `utilisation` these compare the sum with what all cores have, and `<` each thread with one."""
    if metric == "utilisation of p" and sign == "<":
        value *= 2
    beyond = Fraction(1001 if sign[0] == ">" else 999, 1000)
    broken = problem(f"{metric} {sign} {format_number(value * beyond)} {unit}", unit)
    (advice,) = dse.explain(broken).relaxations
    assert advice.text == f"{metric} {sign if sign == '==' else sign[0] + '='} {format_number(value)} {unit}"
    assert dse.solve(problem(advice.text, unit)).status == "complete"


@pytest.mark.parametrize("unit", ["%", "ppm", "ms", "g"])
def test_an_uncertain_total_is_in_its_own_unit(unit: str) -> None:
    text = PROBLEM.replace("METRICS", "").replace("TOTAL", unit).replace("REQUIREMENT", f"share <= 40 {unit}")
    path = "uncertainty:\n  processor_types.P.totals.share: {range: RANGE}\n"
    for top, status in (("40", "complete"), ("41", "infeasible")):
        stated = dse.loads(text + path.replace("RANGE", f"30 .. {top} {unit}"))
        study = dse.solve_robust(stated)
        assert study.robust.status == status
    with pytest.raises(dse.ProblemError, match=f"expected a figure in {unit}"):
        dse.loads(text + path.replace("RANGE", "30 .. 40 W"))
