"""A simulation as text for a terminal."""

from __future__ import annotations

from rich.console import Console, JustifyMethod
from rich.table import Table

from dse.report.plain import basis_words
from dse.report.plain import plain as _plain
from dse.report.plain import plain_table as _table
from dse.results.display import readable
from dse.results.simulate import LATENCY, FlowObservation, Simulation
from dse.space.settings import settings_of
from dse.units import Exact

BAR = 40


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)


def print_simulation(console: Console, simulation: Simulation) -> None:
    """Contradictions first, then each flow against its bounds, its histogram, response times, losses, notes."""
    console.print(
        f"{simulation.space.name}: simulated ({basis_words(settings_of(simulation.space))})", style="bold", markup=False
    )
    for text in simulation.contradictions:
        console.print(f"CONTRADICTION: {text}", style="bold red", markup=False)
    console.print(_flow_table(console, simulation))
    for flow in simulation.flows:
        _print_histogram(console, flow)
    if simulation.tasks:
        console.print(_task_table(console, simulation))
    for name, count in simulation.lost.items():
        console.print(f"lost: {count} at {name}", markup=False)
    for note in simulation.notes:
        console.print(f"note: {note}", markup=False)
    if simulation.is_stopped:
        console.print("Stopped by the time limit: the other runs were not made.", style="bold", markup=False)
    console.print(LATENCY, markup=False)
    effort = (
        f"{simulation.runs} runs, {simulation.events:,} events, offsets {simulation.offsets}, seed {simulation.seed}"
    )
    said = "The analysis is contradicted." if simulation.contradictions else "No observation contradicts the analysis."
    if not simulation.is_anything_observed:
        said = "Nothing was observed: nothing came to its end in the simulated time (--duration)."
    said = said if simulation.runs else "Nothing was observed."
    console.print(f"{said} {effort}.", style="bold", markup=False)


def _flow_table(console: Console, simulation: Simulation) -> Table:
    table = _table(console)
    for heading in (
        "flow",
        "data",
        "observed min",
        "mean",
        "max",
        "analysed min",
        "max",
        "with response times",
        "verdict",
    ):
        justify: JustifyMethod = "left" if heading in ("flow", "verdict") else "right"
        table.add_column(heading, justify=justify, overflow="fold")
    for flow in simulation.flows:
        seen = ["-"] * 3
        if flow.latencies and flow.mean_ns is not None:
            seen = [_ms(min(flow.latencies)), _ms(round(flow.mean_ns)), _ms(max(flow.latencies))]
        scheduled = "" if flow.scheduled_ns is None else _ms(flow.scheduled_ns[1])
        bounds = [_ms(value) for value in flow.bounds_ns]
        table.add_row(_plain(flow.name), str(flow.count), *seen, *bounds, scheduled, _plain(_verdict(flow)))
    return table


def _verdict(flow: FlowObservation) -> str:
    if not flow.count:
        return "no data reached the end"
    if flow.is_contradiction:
        return "CONTRADICTION"
    if flow.outside:
        return f"{flow.outside} outside: {flow.excuse or 'CPU contention'}"
    return "within"


def _print_histogram(console: Console, flow: FlowObservation) -> None:
    most = max((item["count"] for item in flow.histogram), default=0)
    if not most:
        return
    console.print(f"Latencies of {flow.name}", markup=False)
    for item in flow.histogram:
        bar = "#" * (-(-item["count"] * BAR // most))
        console.print(f"  {_ms(item['from_ns']):>14} {item['count']:>8} {bar}", markup=False)


def _task_table(console: Console, simulation: Simulation) -> Table:
    table = _table(console, "Response times")
    for heading in ("thread", "observed", "analysed", "verdict"):
        table.add_column(heading, justify="right" if heading in ("observed", "analysed") else "left")
    for task in simulation.tasks:
        bound = "unbounded" if task.bound_ns is None else _ms(task.bound_ns)
        said = "CONTRADICTION" if task.is_contradiction else "within" if task.is_compared else "not compared"
        table.add_row(_plain(task.name), _ms(task.observed_ns), bound, said)
    return table
