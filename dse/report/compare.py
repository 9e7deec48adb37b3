"""Comparisons as pages."""

from __future__ import annotations

from collections.abc import Iterator

from dse.report.amounts import amount_words
from dse.report.page import Block, Page, Section, Table, texts
from dse.results.compare import DesignComparison, Line, PointComparison, ResultComparison
from dse.results.display import counted
from dse.results.solve import Result
from dse.units import is_unbounded


def comparison_page(found: DesignComparison | ResultComparison) -> Page:
    """Two designs, or two results, side by side; what differs is marked."""
    blocks = _designs(found) if isinstance(found, DesignComparison) else _results(found)
    name = " against ".join(found.names)
    return Page(name, "", (Section("comparison", "Side by side", tuple(blocks)),))


def _designs(found: DesignComparison) -> Iterator[Block]:
    yield _texts("Decisions", "decision", found.names, found.decisions)
    rows = []
    for line in found.metrics:
        pairs = zip((line.one, line.other), found.currencies, strict=True)
        values = ["-" if value is None else counted(value, line.unit, currency) for value, currency in pairs]
        rows.append((line.name, *values, _difference(line, found.currencies[0])))
    yield Table("Metrics", ("metric", *found.names, "difference"), tuple(rows), (1, 2, 3))
    if found.verdicts:
        yield _texts("Requirements", "requirement", found.names, found.verdicts)
    changed = sum(line.differs for line in found.decisions)
    yield from texts(f"{changed} of {len(found.decisions)} decisions differ.", tone="strong")
    if any(line.renumbered for line in found.decisions):
        one, other = found.names
        yield from texts(f"Cores of {other} are numbered here like those of {one}: equal cores may change places.")
    if found.unlike:
        yield from texts(f"Figures that follow different rules have no difference: {'; '.join(found.unlike)}.")


def _results(found: ResultComparison) -> Iterator[Block]:
    yield _texts("What was asked and found", "", found.names, found.facts)
    for name, other, result, points in zip(found.names, found.names[::-1], found.results, found.points, strict=True):
        rows = [(str(item.point.id), *_figures(item, result), "-" if found.unlike else _said(item)) for item in points]
        objectives = [info.name for info in result.objectives]
        numbers = tuple(range(1 + len(objectives)))
        yield Table(f"{name}, against {other}", ("#", *objectives, "there"), tuple(rows), numbers)
        if not found.unlike:
            yield from texts(_summary(name, other, points))
    if found.unlike:
        said = "The fronts are not comparable, their objectives follow different rules"
        yield from texts(f"{said}: {'; '.join(found.unlike)}.", tone="strong")


def _texts(title: str, heading: str, names: tuple[str, str], lines: tuple[Line, ...]) -> Table:
    rows = []
    for line in lines:
        cells = ["-" if value is None else str(value) for value in (line.one, line.renumbered or line.other)]
        rows.append((line.name, *cells, "differs" if line.differs else ""))
    return Table(title, (heading, *names, ""), tuple(rows))


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
