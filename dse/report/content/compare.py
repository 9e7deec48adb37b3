"""Comparisons as pages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dse.answers.comparison import ComparedLine, DesignComparison, PointComparison, ResultComparison
from dse.answers.result import Result
from dse.answers.tables.display import counted
from dse.report.amounts import amount_words, listed
from dse.report.page import Block, Page, Section, Table, texts
from dse.support.units import is_unbounded
from dse.support.units.text import count_words

MOST = 8
"""The greatest number of rows of a table that are printed."""
IN_BOTH = "Points in both"
"""How the part begins that says what does not differ; `.ci/comment` ends there."""


def comparison_page(comparison: DesignComparison | ResultComparison) -> Page:
    """Two designs, or two results, side by side: what differs, and for files and those who ask for it what does not.

    A `Page` titled "A against B". Sections without content are left out.
    """
    sections = _designs(comparison) if isinstance(comparison, DesignComparison) else _results(comparison)
    name = " against ".join(comparison.names)
    return Page(name, "", tuple(section for section in sections if section.blocks))


def _designs(comparison: DesignComparison) -> Iterator[Section]:
    blocks: list[Block] = []
    changed = [line for line in comparison.decisions if line.differs]
    names = ("A", "B")
    blocks += texts(f"A {comparison.names[0]}    B {comparison.names[1]}", tone="strong")
    verb = "differs" if len(changed) == 1 else "differ"
    blocks += texts(f"{len(changed)} of {count_words(len(comparison.decisions), 'decision')} {verb}.", tone="strong")
    if any(line.renumbered for line in comparison.decisions):
        blocks += texts("Cores of B are numbered here like those of A: equal cores may change places.")
    if comparison.unlike:
        blocks += texts(f"Figures that follow different rules have no difference: {'; '.join(comparison.unlike)}.")
    blocks += texts(_preference(comparison), tone="strong")
    moved = [line for line in comparison.metrics if line.name in comparison.senses or _moves(line)]
    moved.sort(key=lambda line: line.name not in comparison.senses)
    verdicts = [line for line in comparison.verdicts if line.differs]
    blocks += _if_any(_texts("Decisions that differ", "decision", names, changed, brief=MOST))
    blocks += _if_any(
        _metrics(
            "Objectives, and other metrics that differ" if comparison.senses else "Metrics that differ",
            comparison,
            moved,
        )
    )
    blocks += _if_any(_texts("Requirements that differ", "requirement", names, verdicts, brief=MOST))
    yield Section("comparison", "What differs", tuple(blocks))
    same = [line for line in comparison.decisions if not line.differs]
    equal = [line for line in comparison.metrics if line not in moved]
    agreed = [line for line in comparison.verdicts if not line.differs]
    blocks = [*_if_any(_texts("Equal decisions", "decision", names, same))]
    blocks += _if_any(_metrics("Equal metrics", comparison, equal))
    blocks += _if_any(_texts("Equal verdicts", "requirement", names, agreed))
    yield Section("same", "What does not differ", tuple(blocks), is_detail=True)


def _preference(comparison: DesignComparison) -> str:
    """Which design is better in which objective; "" where an objective cannot be compared, or none is common.

    ``Trade-off: B has lower jitter of f, but higher utilisation of cpu; equal: price.``
    """
    changes = {line.name: line.difference for line in comparison.metrics if line.name in comparison.senses}
    if not changes or any(change is None or is_unbounded(change) for change in changes.values()):
        return ""
    moved = {name: change for name, change in changes.items() if change}
    if not moved:
        return "A and B are equal in every objective."
    better = {name for name, change in moved.items() if change * comparison.senses[name] < 0}  # in B
    who, sign = ("B", 1) if better else ("A", -1)
    said = {name: f"{'lower' if change * sign < 0 else 'higher'} {name}" for name, change in moved.items()}
    gains = [text for name, text in said.items() if (name in better) == bool(better)]
    losses = [text for name, text in said.items() if (name in better) != bool(better)]
    equal = [name for name in changes if name not in moved]
    rest = f"; equal: {listed(equal)}." if equal else "."
    if losses:
        return f"Trade-off: {who} has {listed(gains)}, but {listed(losses)}{rest}"
    return f"{who} dominates {'A' if better else 'B'}: it has {listed(gains)}{rest}"


def _moves(line: ComparedLine) -> bool:
    """Whether a metric differs, or has no comparable difference."""
    return line.difference is None or bool(line.difference)


def _metrics(title: str, comparison: DesignComparison, lines: Sequence[ComparedLine]) -> Table:
    rows = []
    for line in lines:
        pairs = zip((line.one, line.other), comparison.currencies, strict=True)
        values = ["-" if value is None else counted(value, line.unit, currency) for value, currency in pairs]
        rows.append((line.name, *values, _difference(line, comparison.currencies[0])))
    headings = ("metric", "A", "B", "B against A")
    return Table(title, headings, tuple(rows), (1, 2, 3), brief=MOST, rest="and {} more metrics (--all)")


def _results(comparison: ResultComparison) -> Iterator[Section]:
    blocks: list[Block] = []
    if comparison.unlike:
        said = "The fronts are not comparable, their objectives follow different rules"
        blocks += texts(f"{said}: {'; '.join(comparison.unlike)}.", tone="strong")
    else:
        for name, other, points in zip(comparison.names, comparison.names[::-1], comparison.points, strict=True):
            blocks += texts(_summary(name, other, points), tone="strong")
    differing = [line for line in comparison.facts if line.differs]
    blocks += _if_any(_texts("What was asked and found: what differs", "", comparison.names, differing))
    yield Section("comparison", "What differs", tuple(blocks))
    changed, shared = _points(comparison)
    yield Section("points", "Points that differ", tuple(changed))
    same = [line for line in comparison.facts if not line.differs]
    blocks = [*shared, *_if_any(_texts("Asked and found alike", "", comparison.names, same))]
    yield Section("same", "What does not differ", tuple(blocks), is_detail=True)


def _points(comparison: ResultComparison) -> tuple[list[Block], list[Block]]:
    """The points of each front that the other has not, all where they cannot be compared; then those in both."""
    changed: list[Block] = []
    shared: list[Block] = []
    for name, other, result, points in zip(
        comparison.names, comparison.names[::-1], comparison.results, comparison.points, strict=True
    ):
        headings = ("#", *(info.name for info in result.objectives), "there")
        numbers = tuple(range(len(headings) - 1))
        here = {
            is_same: tuple(
                (str(item.point.id), *_figures(item, result), "-" if comparison.unlike else _said(item))
                for item in points
                if (bool(item.equal) and not comparison.unlike) == is_same
            )
            for is_same in (False, True)
        }
        title, rest = f"{name}, against {other}", "and {} more points (--all)"
        changed += _if_any(Table(title, headings, here[False], numbers, brief=MOST, rest=rest))
        if not shared:
            shared += _if_any(Table(f"{IN_BOTH} {name} and {other}", headings, here[True], numbers))
    return changed, shared


def _if_any(table: Table) -> list[Block]:
    """The table, unless it has no row."""
    return [table] if table.rows else []


def _texts(
    title: str, heading: str, names: tuple[str, str], lines: Sequence[ComparedLine], *, brief: int | None = None
) -> Table:
    rows = []
    for line in lines:
        cells = ["-" if value is None else str(value) for value in (line.one, line.renumbered or line.other)]
        rows.append((line.name, *cells))
    return Table(title, (heading, *names), tuple(rows), brief=brief, rest="and {} more (--all)")


def _difference(line: ComparedLine, currency: str) -> str:
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
    return f"Of {count_words(len(points), 'point')} of {name}: {said}."
