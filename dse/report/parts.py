"""What sections of studies are made of: plots, tables, words for figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, TypeAlias

from dse.report.charts import Spec
from dse.report.document import Table
from dse.results.display import NO_BOUND, display_unit, readable
from dse.units import is_unbounded

Data: TypeAlias = Mapping[str, Any]
MOST_ROWS = 400
"""A table in a page has at most so many rows; CSV and JSON have all."""


@dataclass(frozen=True)
class Plot:
    """A plot with its caption; `name` is the stem of its file."""

    name: str
    spec: Spec
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of a report: sentences, plots, tables."""

    name: str
    title: str
    texts: tuple[str, ...]
    plots: tuple[Plot, ...] = ()
    tables: tuple[Table, ...] = ()


def numbered(sections: Sequence[Section]) -> list[tuple[int, Section]]:
    """Each section with the number of its first plot on the page."""
    found, count = [], 0
    for section in sections:
        found.append((count, section))
        count += len(section.plots)
    return found


def study_specs(sections: Sequence[Section]) -> list[Any]:
    """The plots of all sections, in order."""
    return [plot.spec for section in sections for plot in section.plots]


def limited(rows: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """The rows that a page shows."""
    return tuple(rows[:MOST_ROWS])


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
