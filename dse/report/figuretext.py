"""Figures and designs as the data of studies have them, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

from dse.results.display import NO_BOUND, display_unit, readable
from dse.units import is_unbounded

Data: TypeAlias = Mapping[str, Any]
MOST_ROWS = 400
"""A table in a page has at most so many rows; CSV and JSON have all."""


def decisions_text(chosen: Mapping[str, str], names: Sequence[str]) -> str:
    """Some decisions of a design in words."""
    return ", ".join(f"{name.removesuffix('.type')} {chosen[name]}" for name in names if name in chosen)


def number_of(value: Any, unit: str, currency: str) -> float | None:
    """A figure as a number of the unit that engineers read; None where it is unbounded, and cannot be drawn."""
    if value is None or is_unbounded(value):
        return None
    return float(Fraction(value) / display_unit(unit, currency)[0])


def figure_text(value: Any, unit: str, currency: str) -> str:
    """An input or a metric for people, in full where its unit has no other form; None is unbounded."""
    if value is None or is_unbounded(value):
        return NO_BOUND
    if unit in ("ns", "ct", "ppm", "mW", "B/s", "nm"):
        return readable(Fraction(value), unit, currency, 6)
    number = Fraction(value)
    return f"{number if number.denominator == 1 else format(float(number), '.9g')} {unit}".strip()
