"""Results as text for a terminal: tables that stay readable in a pipe, in 80 columns and without UTF-8."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from rich import box
from rich.console import Console
from rich.table import Table

from dse.api.checking import Description
from dse.results.analysis import Analysis, FlowTable, Usage
from dse.results.ranking import METHOD
from dse.results.result import Clash, ObjectiveInfo, Point, Result
from dse.results.values import readable

REDUCED = "Latencies are reduced reaction times: a flow starts at its first component, without that component's own period."
ADDITIVE = (
    "Worst execution times are not response times: CPU contention is not in the latency. "
    "Sums of periods over-estimate harmonic, synchronised threads."
)


def print_result(console: Console, result: Result) -> None:
    """The front, ranked, and what was proved; or the proof of infeasibility and the closest misses."""
    console.print(f"{result.problem.name} (profile {result.space.profile})", style="bold", markup=False)
    if result.status == "infeasible":
        _print_infeasible(console, result)
        return
    if result.front:
        console.print(_front_table(console, result))
        _print_common(console, result)
    console.print(_proof(result), markup=False, style="bold")
    search = result.search
    console.print(
        f"{search.solver_calls} solver calls, {search.wall_s:.2f} s, {search.space_size:,} combinations of options; "
        f"every point recomputed without the solver.",
        markup=False,
    )
    if result.front:
        console.print(f"Ranked by {METHOD}.", markup=False)
    console.print(REDUCED, markup=False)


def _proof(result: Result) -> str:
    count = len(result.front)
    points = f"{count} non-dominated design{'s' if count != 1 else ''}"
    if result.status == "complete":
        return f"Pareto front, proved complete: {points}."
    regions = len(result.unexplored)
    return (
        f"Incomplete front, stopped early: {points} so far; {regions} region{'s' if regions != 1 else ''} of the objective "
        f"space may hold more."
    )


def _table(console: Console, title: str = "") -> Table:
    ascii_only = (console.encoding or "utf-8").lower().replace("-", "") not in ("utf8", "utf8mb4", "utf16")
    return Table(title=title or None, title_justify="left", box=box.ASCII2 if ascii_only else box.SIMPLE_HEAD)


def _front_table(console: Console, result: Result) -> Table:
    table = _table(console)
    table.add_column("rank", justify="right")
    for info in result.objectives:
        table.add_column(f"{'' if info.sense == 'minimise' else 'max '}{info.name}", justify="right", overflow="fold")
    varying = _varying(result)
    table.add_column("decisions", overflow="fold")
    for point in result.front:
        values = [_value(point.objectives[info.name], info, result.space.currency) for info in result.objectives]
        table.add_row(str(point.rank), *values, _decisions(point, varying))
    return table


def _value(value: int, info: ObjectiveInfo, currency: str) -> str:
    """An integer in a counting unit (``1/3 ppm``) for people."""
    scale, _, unit = info.unit.rpartition(" ")
    factor = Fraction(1, int(scale.removeprefix("1/"))) if scale.startswith("1/") else Fraction(1)
    return readable(value * factor, unit, currency)


def _varying(result: Result) -> list[str]:
    """The decisions in which the points of the front differ."""
    return [
        name for name in result.open_decisions if len({point.decisions.get(name) for point in result.front}) > 1
    ]


def _decisions(point: Point, names: Sequence[str]) -> str:
    return ", ".join(f"{name.removesuffix('.type')} {point.decisions[name]}" for name in names if name in point.decisions)


def _print_common(console: Console, result: Result) -> None:
    varying = set(_varying(result))
    common = [name for name in result.open_decisions if name not in varying and name in result.front[0].decisions]
    if common:
        text = ", ".join(f"{name.removesuffix('.type')} {result.front[0].decisions[name]}" for name in common)
        console.print(f"In all of them: {text}.", markup=False)


def _print_infeasible(console: Console, result: Result) -> None:
    console.print("Infeasible, proved: no design meets every requirement and rule.", style="bold", markup=False)
    if not result.conflicts:
        console.print("No small set of requirements is to blame alone.", markup=False)
    for conflict in result.conflicts:
        if len(conflict.members) == 1:
            console.print("Closest miss, when all others hold:", markup=False)
        else:
            console.print("No single requirement is to blame; these must give together:", markup=False)
        for clash in conflict.members:
            console.print(f"  {_clash(clash, result.space.currency)}", markup=False)


def _clash(clash: Clash, currency: str) -> str:
    where = f" ({clash.origin})" if clash.origin else ""
    if clash.closest is None or clash.limit is None or clash.miss is None:
        return f"rule: {clash.text}{where}"
    closest = readable(clash.closest, clash.unit, currency, 6)
    if clash.thread:
        return f"{clash.text}{where}: {clash.thread} alone needs more than one core allows"
    miss = readable(clash.miss, clash.unit, currency, 6)
    limit = readable(clash.limit, clash.unit, currency, 6)
    return f"{clash.text}{where}: the closest is {closest}, {miss} beyond the limit of {limit}"


def print_analysis(console: Console, analysis: Analysis) -> None:
    """Contributor tables, processor and bus tables, verdicts of one design."""
    setting = "" if analysis.space.profile == "dse" else f", worst case by {analysis.space.worst_case.replace('_', ' ')}"
    console.print(f"{analysis.space.name} (profile {analysis.space.profile}{setting})", style="bold", markup=False)
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
    console.print(ADDITIVE, markup=False)
    for usage in analysis.processors:
        console.print(_processor_table(console, usage))
    for usage in analysis.buses:
        if usage.shares or usage.capacity is not None:
            console.print(_bus_table(console, usage))
    _print_metrics(console, analysis)
    _print_verdicts(console, analysis)


def _flow_table(console: Console, flow: FlowTable) -> Table:
    table = _table(console, f"Flow {flow.name}".replace("[", r"\["))
    for heading, justify in (("contributor", "left"), ("min", "right"), ("method", "left"), ("max", "right"), ("method", "left")):
        table.add_column(heading, justify=justify, overflow="fold")  # type: ignore[arg-type]
    for row in flow.rows:
        cells = (f"{row.category} {row.contributor}", _ms(row.min_ns), row.min_method, _ms(row.max_ns), row.max_method)
        table.add_row(*(_plain(cell) for cell in cells))
    table.add_section()
    table.add_row("latency total", _ms(flow.min_ns), "", _ms(flow.max_ns), f"jitter {_ms(flow.jitter_ns)}")
    return table


def _plain(text: str) -> str:
    """Text in which square brackets are no markup."""
    return text.replace("[", r"\[")


def _ms(value_ns: int) -> str:
    return readable(value_ns, "ns", digits=6)


def _processor_table(console: Console, usage: Usage) -> Table:
    table = _table(console, _plain(f"Processor {usage.name} ({usage.type})"))
    table.add_column("thread")
    table.add_column("utilisation of one core", justify="right")
    for name, share in usage.shares.items():
        table.add_row(_plain(name), readable(share, "ppm", digits=4))
    table.add_section()
    total = readable(usage.total, "ppm", digits=4)
    table.add_row("total", total if usage.capacity is None else f"{total} of {readable(usage.capacity, 'ppm')}")
    return table


def _bus_table(console: Console, usage: Usage) -> Table:
    table = _table(console, _plain(f"Bus {usage.name} ({usage.type})"))
    table.add_column("connection")
    table.add_column("load", justify="right")
    for name, share in usage.shares.items():
        table.add_row(_plain(name), readable(share, "B/s"))
    table.add_section()
    total = readable(usage.total, "B/s")
    if usage.capacity:
        part = readable(usage.total / usage.capacity * 10**6, "ppm")
        total += f" of {readable(usage.capacity, 'B/s')} ({part})"
    table.add_row("total", total)
    return table


def _print_metrics(console: Console, analysis: Analysis) -> None:
    names = ["price", "power", *analysis.space.totals, *(item.name for item in analysis.space.derived)]
    table = _table(console, "Totals and derived metrics")
    table.add_column("metric")
    table.add_column("value", justify="right")
    for name in names:
        table.add_row(_plain(name), readable(analysis.metrics[name], analysis.metric_units[name], analysis.space.currency))
    console.print(table)


def _print_verdicts(console: Console, analysis: Analysis) -> None:
    if analysis.verdicts:
        table = _table(console, "Requirements")
        for heading in ("requirement", "value", "limit", "slack", "verdict"):
            table.add_column(heading, overflow="fold")
        for verdict in analysis.verdicts:
            figures = [
                readable(value, verdict.unit, analysis.space.currency, 6)
                for value in (verdict.value, verdict.limit, verdict.slack)
            ]
            said = "holds" if verdict.holds else "BROKEN"
            if verdict.worst_term:
                said += f" by {verdict.worst_term} alone"
            table.add_row(_plain(verdict.requirement.text), *figures, _plain(said))
        console.print(table)
    for warning in analysis.warnings:
        console.print(f"warning: {warning}", markup=False)
    if analysis.verdicts:
        words = "meets every requirement" if analysis.is_feasible else "breaks a requirement"
        console.print(f"The design {words}.", style="bold", markup=False)


def print_description(console: Console, description: Description) -> None:
    """The decisions of a problem, the size of its space, and remarks."""
    space = description.space
    console.print(f"{space.name}: valid (profile {space.profile})", style="bold", markup=False)
    table = _table(console)
    table.add_column("decision", overflow="fold")
    table.add_column("options", overflow="fold")
    for decision in description.decisions:
        table.add_row(_plain(decision.name), _plain(", ".join(decision.options)))
    console.print(table)
    console.print(f"{description.size:,} combinations of options, before rules, bindings and requirements.", markup=False)
    console.print(f"Flows: {', '.join(flow.name for flow in space.flows) or 'none'}", markup=False)
    for title, texts in (
        ("Requirements", [item.text for item in space.requirements]),
        ("Rules", [item.text for item in space.rules]),
        ("Objectives", [f"{item.sense} {item.metric.name}" for item in space.objectives]),
    ):
        console.print(f"{title}: {'; '.join(texts) or 'none'}", markup=False)
    for remark in description.remarks:
        console.print(f"remark: {remark}", markup=False)
