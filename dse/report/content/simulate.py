"""A simulation as a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial

from dse.analysis.terms import PPM
from dse.answers.simulation import CONTENTION, LATENCY, FlowObservation, Simulation, TaskObservation
from dse.answers.tables.display import column, counted, readable
from dse.report.page import NOTHING, Block, Page, Plot, Section, Table, Text, few, listing, texts
from dse.report.plots.canvas import Drawing
from dse.report.plots.study import histogram
from dse.report.words.basis import basis_words, counting_words
from dse.space.question.settings import settings_of
from dse.support.units import Exact, is_unbounded
from dse.support.units.text import count_words

FEW = 3
MANY = 4
MOST = 10
"""The greatest number of threads that are printed."""
HISTOGRAM = (
    "Latencies of {} as they were observed; the lines are the least and the greatest that the analysis allows{}."
)
BOTH = ", without and with waiting for the CPU"


def simulation_page(simulation: Simulation) -> Page:
    """Contradictions first, then each flow against its bounds, its histogram, response times, losses, notes.

    Two sections: observations against bounds, and histograms (a detail that a terminal leaves out).
    """
    lead = f"{simulation.space.name}: simulated"
    sections = (
        Section("simulation", "What was observed", tuple(_blocks(simulation))),
        Section("histograms", "Each latency as a histogram", tuple(_histograms(simulation)), is_detail=True),
    )
    return Page(f"{simulation.space.name}: simulation", lead, tuple(section for section in sections if section.blocks))


def _blocks(simulation: Simulation) -> Iterator[Block]:
    said, brief = _said(simulation)
    if not simulation.is_anything_observed:
        said = "Nothing was observed: nothing came to its end in the simulated time (--duration)."
    said = said if simulation.runs else "Nothing was observed."
    yield Text(said, "strong", brief if simulation.is_anything_observed else "")
    yield from listing(simulation.contradictions, "CONTRADICTION", 0, "wrong")
    lost = [f"{count} arrivals lost at {name}" for name, count in simulation.lost.items()]
    yield from listing(lost, "WARNING", 0, "doubtful", brief=FEW)
    basis = f"{basis_words(settings_of(simulation.space))}."
    yield Text(f"Counted  {basis}", brief=f"Counted  {counting_words(simulation.space) or basis}", hang=9)
    if simulation.is_stopped:
        yield from texts("Stopped by the time limit: the other runs were not made.", tone="strong")
    yield _flow_table(simulation)
    if simulation.tasks:
        yield _task_table(simulation.tasks)
    if simulation.messages:
        yield _task_table(simulation.messages, "message", "Response times of messages")
    if simulation.disparities:
        yield _disparity_table(simulation)
    yield from listing(simulation.notes, "note", 0, brief=FEW)
    yield Text(LATENCY, brief="Latencies are reduced reaction times.")
    yield from texts(
        f"{count_words(simulation.runs, 'run')}, {count_words(simulation.events, 'event')}, "
        f"offsets {simulation.offsets}, seed {simulation.seed}."
    )


def _histograms(simulation: Simulation) -> Iterator[Block]:
    for flow in simulation.flows:
        if flow.count:
            yield Plot(
                f"latencies-{flow.name}",
                partial(_drawn, flow),
                HISTOGRAM.format(flow.name, BOTH if _waits_more(flow) else ""),
            )
        yield from _histogram(flow)


def _said(simulation: Simulation) -> tuple[str, str]:
    """Whether the analysis holds; where bounds were exceeded that need not hold, this first. In full, and in brief."""
    if simulation.contradictions:
        return "CONTRADICTED  an observation exceeds a bound that must hold.", ""
    if not simulation.outside:
        return "WITHIN BOUNDS  no observation exceeds its analysed bound.", ""
    beyond = [flow for flow in simulation.flows if flow.outside]
    tasks = (*simulation.tasks, *simulation.messages)
    if any(task.is_outside for task in tasks) or any(item.is_outside for item in simulation.disparities):
        return f"OUTSIDE BOUNDS  {'; '.join(simulation.outside)}.", ""
    counts = [f"{flow.outside} of {flow.count} latencies of {flow.name}" for flow in beyond]
    excuses = list(dict.fromkeys(flow.excuse or CONTENTION for flow in beyond))
    is_counted = not any(flow.excuse for flow in beyond)
    rest = "the bounds with response times hold" if is_counted else "no bound that must hold is contradicted"
    words = [
        f"OUTSIDE BOUNDS  {counted} ({why}); {rest}."
        for counted, why in (
            ("; ".join(counts), "; ".join(excuses)),
            (few(counts, FEW, "flows"), few(excuses, 1, "reasons")),
        )
    ]
    return words[0], words[1]


def _ms(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=6)


def _flow_table(simulation: Simulation) -> Table:
    """Observed latencies of each flow against its bounds; those with waiting for the CPU must hold where they are."""
    flows = sorted(simulation.flows, key=lambda flow: not flow.is_contradiction)
    is_scheduled = any(map(_waits_more, flows))
    rows = []
    for flow in flows:
        seen = [NOTHING] * 3
        if flow.latencies and flow.mean_ns is not None:
            seen = [_in_ms(value) for value in (min(flow.latencies), round(flow.mean_ns), max(flow.latencies))]
        bounds = [_in_ms(value) for value in flow.bounds_ns]
        if is_scheduled:
            bounds.append(NOTHING if flow.scheduled_ns is None else _in_ms(flow.scheduled_ns[1]))
        rows.append((flow.name, *seen, *bounds, _verdict(flow), str(flow.count)))
    headings = ("flow", "observed min", "mean", "max", "bound min", "max")
    headings += (*(("max with waiting",) if is_scheduled else ()), "verdict", "data")
    numbers = tuple(at for at in range(1, len(headings)) if headings[at] != "verdict")
    rest, spare = "and {} more flows (--all)", (len(headings) - 1,)
    caption = "Latencies [ms], observed and analysed"
    return Table(caption, headings, tuple(rows), numbers, brief=MOST, rest=rest, spare=spare)


def _waits_more(flow: FlowObservation) -> bool:
    """Whether the greatest latency with waiting for the CPU is another one than the analysed one."""
    return flow.scheduled_ns is not None and flow.scheduled_ns[1] != flow.bounds_ns[1]


def _in_ms(value_ns: Exact) -> str:
    """A time without its unit, which the caption has."""
    return column([value_ns], "ns")[1][0]


def _verdict(flow: FlowObservation) -> str:
    if not flow.count:
        return "no data reached the end"
    if flow.is_contradiction:
        return "CONTRADICTION"
    if flow.outside:
        return f"{flow.outside} outside: {flow.excuse or 'CPU contention'}"
    return "within"


def _drawn(flow: FlowObservation) -> Drawing:
    """The histogram with the bounds that the analysis gives."""
    bars = [
        {
            "low": float(item["from_ns"]) / 1e6,
            "high": float(item["to_ns"]) / 1e6,
            "count": int(item["count"]),
            "text": f"{_ms(item['from_ns'])} to {_ms(item['to_ns'])}",
        }
        for item in flow.histogram
    ]
    bounds = [("analysed", value) for value in flow.bounds_ns]
    if flow.scheduled_ns is not None and _waits_more(flow):
        bounds += [("with response times", value) for value in flow.scheduled_ns[1:]]
    marks = [
        {"kind": kind, "at": float(value) / 1e6, "text": counted(value, "ns")}
        for kind, value in bounds
        if not is_unbounded(value)
    ]
    return histogram(bars, marks, "latency [ms]", f"Latencies of {flow.name}: {flow.count} data.")


def _histogram(flow: FlowObservation) -> Iterator[Table]:
    most = max((item["count"] for item in flow.histogram), default=0)
    if most:
        rows = tuple((_ms(item["from_ns"]), str(item["count"])) for item in flow.histogram)
        bars = tuple(float(item["count"]) / float(most) for item in flow.histogram)
        yield Table(f"Latencies of {flow.name}", ("from", "data"), rows, (0, 1), bars=bars)


def _disparity_table(simulation: Simulation) -> Table:
    rows = []
    for item in sorted(simulation.disparities, key=lambda item: not item.is_contradiction):
        seen = "-" if item.observed_ns is None else _ms(item.observed_ns)
        bound = "unbounded" if is_unbounded(item.bound_ns) else _ms(item.bound_ns)
        said = "CONTRADICTION" if item.is_contradiction else item.excuse or "within"
        said = f"outside: {said}" if item.is_outside and not item.is_contradiction else said
        rows.append((item.name, seen, bound, said if item.observed_ns is not None else "never two inputs"))
    headings = ("reader", "observed", "analysed", "verdict")
    title, rest = "Disparity of inputs: the largest difference of age", "and {} more readers (--all)"
    return Table(title, headings, tuple(rows), (1, 2), brief=MANY, rest=rest)


def _task_table(tasks: Sequence[TaskObservation], what: str = "thread", title: str = "Response times") -> Table:
    rows = []
    for task in sorted(tasks, key=_closeness):
        bound = "unbounded" if task.bound_ns is None else _in_ms(task.bound_ns)
        share = Fraction(task.observed_ns) / task.bound_ns * PPM if task.bound_ns else None
        used = NOTHING if share is None else readable(share, "ppm", digits=1)
        rows.append((task.name, _in_ms(task.observed_ns), bound, used, _of_task(task)))
    headings = (what, "observed [ms]", "bound [ms]", "used", "verdict")
    rest = f"and {{}} more {what}s (--all)"
    return Table(f"{title}, the nearest to its bound first", headings, tuple(rows), (1, 2, 3), brief=MANY, rest=rest)


def _of_task(task: TaskObservation) -> str:
    if task.is_contradiction:
        return "CONTRADICTION"
    if task.is_compared:
        return "within"
    return f"{'outside, ' if task.is_outside else ''}not compared"


def _closeness(task: TaskObservation) -> tuple[bool, Fraction]:
    """The order of rows: contradictions first, then the largest share of the bound, rows without a bound last."""
    share = Fraction(task.observed_ns) / task.bound_ns if task.bound_ns else Fraction(-1)
    return not task.is_contradiction, -share
