"""Results as text for a terminal: tables that stay readable in a pipe, in 80 columns and without UTF-8."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table

from dse.report.amounts import slack_words
from dse.report.contention import (
    asks_for_responses,
    contended_words,
    contention_words,
    core_words,
    overhead_words,
    processing_words,
    scale_words,
)
from dse.report.explain import print_conflicts
from dse.report.insisting import print_insisting
from dse.report.missing import TITLE, missing_words
from dse.report.plain import basis_words, print_hanging
from dse.report.plain import plain as _plain
from dse.report.plain import plain_table as _table
from dse.report.scheduling import response_table
from dse.report.words import (
    EMPTY_SLOT,
    GAPS,
    REDUCED,
    baseline_words,
    changes_words,
    dominated_words,
    exclusion_words,
    figures_words,
    hidden_words,
    others_words,
    proof_words,
    rank_text,
    rounding_words,
    sentences,
    short_name,
    tie_words,
    unused_words,
)
from dse.results.analyse import Analysis, FlowTable, Usage
from dse.results.changes import changes_between
from dse.results.display import counted, readable
from dse.results.points import Point
from dse.results.reasons import Reasoner
from dse.results.solve import Result
from dse.results.variants import varying
from dse.space.settings import settings_of
from dse.units import Exact
from dse.units.text import count_words

TOP = 10
EXPLAINED = 3
MANY_DECISIONS = 8
"""Where more decisions differ, alternatives are told by what they change against the first."""
ANY_WIDTH = 10_000
ROOM_FOR_DECISIONS = 44
"""Columns of a terminal that the decisions need beside the figures; with fewer they come below them."""


def print_result(console: Console, result: Result, top: int | None = TOP) -> None:
    """The front, ranked, with reasons for the first; what was proved; or why there is no design.

    `top` is how many alternatives are shown (None: all); which are not is said.
    """
    console.print(f"{result.problem.name} ({basis_words(result.problem.effective)})", style="bold", markup=False)
    if result.status == "infeasible":
        _print_infeasible(console, result)
        return
    if result.front:
        shown = listed_points(result, top)
        _print_front(console, result, shown)
        _print_ranking(console, result, shown)
        _print_common(console, result)
        _print_reasons(console, result, shown)
        _print_others(console, result, shown)
    if result.insisting is not None:
        print_insisting(console, result, top)
    console.print(proof_words(result), markup=False, style="bold")
    missing = missing_words(result)
    if missing:
        console.print(f"{TITLE}:", markup=False)
    for text in missing:
        print_hanging(console, f"{text}.")
    search = result.search
    console.print(
        f"{search.solver_calls} solver calls, {search.wall_s:.2f} s, at most "
        f"{count_words(search.space_size, 'design')}; every point recomputed without the solver.",
        markup=False,
    )
    for said in filter(None, (unused_words(result), rounding_words(result), exclusion_words(result.space))):
        console.print(said, markup=False)
    if contention := contention_words(result):
        console.print(contention, markup=False)
    elif result.front:
        console.print(processing_words(settings_of(result.space)), markup=False)
        if asks_for_responses(result.space):
            console.print(overhead_words(result.space), markup=False)
    for said in filter(None, (REDUCED, scale_words(result.space))):
        console.print(said, markup=False)


def listed_points(result: Result, top: int | None) -> tuple[Point, ...]:
    """The whole front where it has `top` points at most; else the first of those that are no variants."""
    return result.front if top is None or len(result.front) <= top else result.leaders[:top]


def _print_ranking(console: Console, result: Result, shown: Sequence[Point]) -> None:
    """The method with its parameters, ties, and what is not shown."""
    console.print(f"Ranked by {result.ranking_words}.", markup=False)
    ties = tie_words(result)
    if ties:
        console.print(ties, markup=False)
    for text in hidden_words(result, shown):
        console.print(text, markup=False)


def _print_reasons(console: Console, result: Result, shown: Sequence[Point]) -> None:
    reasoner = Reasoner(result)
    console.print(baseline_words(reasoner), markup=False)
    for point in [point for point in shown if point.id not in result.variants][:EXPLAINED]:
        reasons = reasoner.reasons(result.front.index(point))
        figures = figures_words(result, reasons.point.objectives)
        console.print(f"#{reasons.point.id}: {figures}", style="bold", markup=False)
        for sentence in sentences(result, reasons):
            print_hanging(console, f"{sentence.label}: {sentence.text}")


def _print_others(console: Console, result: Result, shown: Sequence[Point]) -> None:
    points = {point.id: point for point in result.front}
    for others in result.others:
        if others.of not in {point.id for point in shown}:
            continue
        console.print(f"#{others.of}: {others_words(others)}", markup=False)
        for sibling in others.designs:
            changes = changes_between(result.space, points[others.of].design, sibling.design)
            figures = f" {figures_words(result, sibling.objectives)};" if others.within else ""
            said = dominated_words(sibling, result)
            print_hanging(console, f"{sibling.id}:{figures} {changes_words(changes)}{said}.")


def _print_front(console: Console, result: Result, shown: Sequence[Point]) -> None:
    """The ranked points as a table; where that is too wide with their decisions below it, or as a list."""
    names = _varying(result)
    decisions = [_decisions(point, names, shown[0]) for point in shown]
    bare = _front_table(console, result, shown)
    width = console.measure(bare, options=console.options.update(width=ANY_WIDTH))
    room = console.width - width.minimum
    if room >= ROOM_FOR_DECISIONS:
        is_tight = console.width - width.maximum < ROOM_FOR_DECISIONS
        console.print(_front_table(console, result, shown, decisions, is_tight=is_tight))
        return
    if room >= 0:
        console.print(bare)
    for point, text in zip(shown, decisions, strict=True):
        if room >= 0:
            print_hanging(console, f"#{point.id}: {text}")
            continue
        score = f"; score {point.score}" if point.score else ""
        figures = figures_words(result, point.objectives)
        like = f", like #{result.variants[point.id]}" if point.id in result.variants else ""
        print_hanging(console, f"rank {rank_text(result, point.rank)}, #{point.id}{like}: {figures}{score}; {text}")


def _front_table(
    console: Console, result: Result, shown: Sequence[Point], decisions: Sequence[str] = (), *, is_tight: bool = False
) -> Table:
    """The figures of points, with their decisions if given; `is_tight` breaks headings into lines of one word."""
    table = _table(console)
    for heading in ("rank", "#"):
        table.add_column(heading, justify="right", no_wrap=True)
    columns = []
    if any(point.id in result.variants for point in shown):
        table.add_column("like", no_wrap=True)
        columns.append([f"#{result.variants[point.id]}" if point.id in result.variants else "" for point in shown])
    for info in result.objectives:
        values = [counted(point.objectives[info.name], info.unit, result.space.currency) for point in shown]
        heading = _plain(f"{'' if info.sense == 'minimise' else 'max '}{info.name}")
        least = max(map(len, [*values, *heading.split()]))
        table.add_column(
            heading, justify="right", overflow="fold", min_width=least, max_width=least if is_tight else None
        )
        columns.append(values)
    if any(point.score for point in shown):
        table.add_column("score", justify="right", no_wrap=True)
        columns.append([point.score for point in shown])
    if decisions:
        table.add_column("decisions", overflow="fold")
        columns.append([_plain(text) for text in decisions])
    for point, *cells in zip(shown, *columns, strict=True):
        table.add_row(rank_text(result, point.rank), str(point.id), *cells)
    return table


def _varying(result: Result) -> list[str]:
    """The decisions that tell the points of the front apart; those of a single point are all shown."""
    return varying([point.decisions for point in result.front], result.open_decisions)


def _decisions(point: Point, names: Sequence[str], first: Point) -> str:
    """The decisions of a point; of many, those in which it differs from the first one, where that is shorter."""
    chosen = [name for name in names if name in point.decisions]
    text = ", ".join(f"{short_name(name)} {point.decisions[name]}" for name in chosen)
    if len(names) <= MANY_DECISIONS or point is first:
        return text
    others = [name for name in chosen if point.decisions[name] != first.decisions.get(name)]
    rest = ", ".join(f"{short_name(name)} {point.decisions[name]}" for name in others)
    return min(f"as #{first.id}, but {rest}" if rest else f"as #{first.id}", text, key=len)


def _print_common(console: Console, result: Result) -> None:
    told = set(_varying(result))
    common = [name for name in result.open_decisions if name not in told and name in result.front[0].decisions]
    if common:
        text = ", ".join(f"{name.removesuffix('.type')} {result.front[0].decisions[name]}" for name in common)
        console.print(f"In all of them: {text}.", markup=False)


def _print_infeasible(console: Console, result: Result) -> None:
    console.print("Infeasible, proved: no design meets every requirement and rule.", style="bold", markup=False)
    print_conflicts(console, result)


def print_analysis(console: Console, analysis: Analysis) -> None:
    """Contributor tables, processor and bus tables, verdicts of one design."""
    console.print(f"{analysis.space.name} ({basis_words(settings_of(analysis.space))})", style="bold", markup=False)
    if analysis.decisions:
        chosen = ", ".join(f"{name.removesuffix('.type')} {value}" for name, value in analysis.decisions.items())
        console.print(f"Design: {chosen}", markup=False)
    for breach in analysis.breaches:
        console.print(f"not a valid design: {breach}", style="bold red", markup=False)
    if analysis.breaches:
        return
    for table in analysis.flows:
        console.print(_flow_table(console, table))
    console.print(REDUCED, markup=False)
    console.print(processing_words(settings_of(analysis.space)), markup=False)
    if analysis.contended is not None:
        said = contended_words(analysis.contended, analysis.space.currency)
        console.print(f"With response times, {core_words(analysis.space)}: {said}", markup=False)
    console.print(GAPS[0], markup=False)
    if scale := scale_words(analysis.space):
        console.print(scale, markup=False)
    for usage in analysis.processors:
        console.print(_processor_table(console, usage))
    for name, responses in analysis.responses.items():
        console.print(response_table(console, name, responses))
    if analysis.responses:
        console.print(overhead_words(analysis.space), markup=False)
    for usage in analysis.buses:
        if usage.shares or usage.capacity is not None:
            console.print(_bus_table(console, usage))
    _print_metrics(console, analysis)
    _print_verdicts(console, analysis)


def _flow_table(console: Console, flow: FlowTable) -> Table:
    table = _table(console, f"Flow {flow.name}".replace("[", r"\["))
    for heading, justify in (
        ("contributor", "left"),
        ("min", "right"),
        ("method", "left"),
        ("max", "right"),
        ("method", "left"),
    ):
        table.add_column(heading, justify=justify, overflow="fold")  # type: ignore[arg-type]
    for row in flow.rows:
        cells = (f"{row.category} {row.contributor}", _ms(row.min_ns), row.min_method, _ms(row.max_ns), row.max_method)
        table.add_row(*(_plain(cell) for cell in cells))
    table.add_section()
    table.add_row("latency total", _ms(flow.min_ns), "", _ms(flow.max_ns), f"jitter {_ms(flow.jitter_ns)}")
    return table


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)


def _processor_table(console: Console, usage: Usage) -> Table:
    table = _table(console, _plain(f"Processor {usage.name} ({usage.type})"))
    table.add_column("thread")
    table.add_column("utilisation of one core", justify="right")
    if usage.cores:
        table.add_column("core", justify="right")
    for name, share in usage.shares.items():
        table.add_row(_plain(name), readable(share, "ppm", digits=4), *_core(usage, name))
    table.add_section()
    total = readable(usage.total, "ppm", digits=4)
    table.add_row("total", total if usage.capacity is None else f"{total} of {readable(usage.capacity, 'ppm')}")
    return table


def _core(usage: Usage, name: str) -> tuple[str, ...]:
    """The cell of a thread's core, where there is such a column."""
    return (str(usage.cores[name]) if name in usage.cores else "",) if usage.cores else ()


def _bus_table(console: Console, usage: Usage) -> Table:
    """Load and, where it is computable, busy time of each connection."""
    table = _table(console, _plain(f"Bus {usage.name} ({usage.type})"))
    table.add_column("connection")
    if usage.payload is not None:
        table.add_column("payload", justify="right")
    table.add_column("load" if usage.payload is None else "on the wire", justify="right")
    busy = usage.busy
    if busy is not None:
        table.add_column("busy", justify="right")
    for name, share in usage.shares.items():
        time = [] if busy is None else [readable(busy.get(name, 0), "ppm")]
        table.add_row(_plain(name), *_payload(usage, [name]), readable(share, "B/s"), *time)
    table.add_section()
    total = readable(usage.total, "B/s")
    if usage.capacity:
        part = readable(usage.total / usage.capacity * 10**6, "ppm")
        total += f" of {readable(usage.capacity, 'B/s')} ({part})"
    times = [] if usage.busy_total is None else [readable(usage.busy_total, "ppm")]
    table.add_row("total", *_payload(usage, usage.shares), total, *times)
    return table


def _payload(usage: Usage, names: Iterable[str]) -> list[str]:
    """The cell of what some connections carry without frames, where there is such a column."""
    payload = usage.payload
    return [] if payload is None else [readable(sum(payload[name] for name in names), "B/s")]


def _print_metrics(console: Console, analysis: Analysis) -> None:
    names = ["price", "power", *analysis.space.totals, *(item.name for item in analysis.space.derived)]
    table = _table(console, "Totals and derived metrics")
    table.add_column("metric")
    table.add_column("value", justify="right")
    for name in names:
        table.add_row(
            _plain(name), readable(analysis.metrics[name], analysis.metric_units[name], analysis.space.currency)
        )
    console.print(table)


def _print_verdicts(console: Console, analysis: Analysis) -> None:
    if analysis.verdicts:
        table = _table(console, "Requirements")
        for heading in ("requirement", "value", "limit", "slack", "verdict"):
            table.add_column(heading, overflow="fold")
        for verdict in analysis.verdicts:
            if analysis.limits_empty_slot(verdict):
                table.add_row(_plain(verdict.requirement.shown), "-", "-", "-", EMPTY_SLOT)
                continue
            currency = analysis.space.currency
            figures = [readable(value, verdict.unit, currency, 6) for value in (verdict.value, verdict.limit)]
            figures.append(slack_words(verdict.slack, verdict.unit, currency))
            said = "holds" if verdict.holds else "BROKEN"
            if verdict.who:
                said += f" by {verdict.who} alone"
            table.add_row(_plain(verdict.requirement.shown), *figures, _plain(said))
        console.print(table)
    for warning in analysis.warnings:
        console.print(f"warning: {warning}", markup=False)
    if analysis.verdicts:
        words = "meets every requirement" if analysis.is_feasible else "breaks a requirement"
        console.print(f"The design {words}.", style="bold", markup=False)
