"""Comparisons as text for a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from dse.report.amounts import amount_words
from dse.report.plain import plain, plain_table
from dse.results.compare import DesignComparison, Line, PointComparison, ResultComparison
from dse.results.display import counted
from dse.results.solve import Result
from dse.units import is_unbounded


def print_comparison(console: Console, found: DesignComparison | ResultComparison) -> None:
    """Two designs, or two results, side by side; what differs is marked."""
    if isinstance(found, DesignComparison):
        _print_designs(console, found)
    else:
        _print_results(console, found)


def _print_designs(console: Console, found: DesignComparison) -> None:
    console.print(_texts(console, "Decisions", "decision", found.names, found.decisions))
    table = _headed(console, "Metrics", "metric", found.names, "difference")
    for line in found.metrics:
        pairs = zip((line.one, line.other), found.currencies, strict=True)
        values = ["-" if value is None else counted(value, line.unit, currency) for value, currency in pairs]
        table.add_row(plain(line.name), *values, _difference(line, found.currencies[0]))
    console.print(table)
    if found.verdicts:
        console.print(_texts(console, "Requirements", "requirement", found.names, found.verdicts))
    changed = sum(line.differs for line in found.decisions)
    console.print(f"{changed} of {len(found.decisions)} decisions differ.", style="bold", markup=False)
    if any(line.renumbered for line in found.decisions):
        one, other = found.names
        console.print(
            f"Cores of {other} are numbered here like those of {one}: equal cores may change places.", markup=False
        )
    if found.unlike:
        said = "Figures that follow different rules have no difference"
        console.print(f"{said}: {'; '.join(found.unlike)}.", markup=False)


def _print_results(console: Console, found: ResultComparison) -> None:
    console.print(_texts(console, "What was asked and found", "", found.names, found.facts))
    for name, other, result, points in zip(found.names, found.names[::-1], found.results, found.points, strict=True):
        table = plain_table(console, plain(f"{name}, against {other}"))
        table.add_column("#", justify="right")
        for info in result.objectives:
            table.add_column(plain(info.name), justify="right", overflow="fold")
        table.add_column("there", overflow="fold")
        for item in points:
            table.add_row(str(item.point.id), *_figures(item, result), "-" if found.unlike else _said(item))
        console.print(table)
        if not found.unlike:
            console.print(_summary(name, other, points), markup=False)
    if found.unlike:
        said = "The fronts are not comparable, their objectives follow different rules"
        console.print(f"{said}: {'; '.join(found.unlike)}.", style="bold", markup=False)


def _texts(console: Console, title: str, heading: str, names: tuple[str, str], lines: tuple[Line, ...]) -> Table:
    table = _headed(console, title, heading, names, "")
    for line in lines:
        cells = ["-" if value is None else plain(str(value)) for value in (line.one, line.renumbered or line.other)]
        table.add_row(plain(line.name), *cells, "differs" if line.differs else "")
    return table


def _headed(console: Console, title: str, heading: str, names: tuple[str, str], last: str) -> Table:
    table = plain_table(console, title)
    justify: Any = "right" if last else "left"
    table.add_column(heading, overflow="fold")
    for name in names:
        table.add_column(plain(name), overflow="fold", justify=justify)
    table.add_column(last, justify=justify)
    return table


def _difference(line: Line, currency: str) -> str:
    change = line.difference
    if is_unbounded(change):
        return "-"
    if not change:
        return "" if change is not None else "-"
    return f"{'+' if change > 0 else '-'}{amount_words(abs(change), line.unit, currency)}"


def _figures(item: PointComparison, result: Result) -> list[str]:
    return [counted(item.point.objectives[info.name], info.unit, result.space.currency) for info in result.objectives]


def _said(item: PointComparison) -> str:
    if item.equal:
        return f"the same as #{', #'.join(str(number) for number in item.equal)}"
    if item.dominated_by:
        return f"dominated by #{', #'.join(str(number) for number in item.dominated_by)}"
    return "only here"


def _summary(name: str, other: str, points: tuple[PointComparison, ...]) -> str:
    same = sum(bool(item.equal) for item in points)
    worse = sum(bool(item.dominated_by) for item in points)
    alone = len(points) - same - worse
    said = f"{same} are in {other} too, {worse} are dominated there, {alone} are only here"
    return f"Of {len(points)} points of {name}: {said}."
