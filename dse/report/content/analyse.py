"""The analysis of one design as a page; its tables are those of each alternative of a front, too."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial

from dse.analysis.diagnosis.front_verdicts import waiting_counted
from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Verdict
from dse.analysis.terms import PPM
from dse.answers.analysis import Analysis, FlowTable, Usage
from dse.answers.tables.display import column, counted, each_core_words, of_cores, readable
from dse.report.amounts import amount_words, slack_words
from dse.report.page import MINUS, NOTHING, Block, Page, Plot, Section, Table, Text, few, listing, texts
from dse.report.plots.deadlines import deadline_plot
from dse.report.plots.design import usage_chart, usage_records, waterfall, waterfall_records
from dse.report.words.basis import basis_words, counting_words, missing_figures, scale_words, waiting_verdict
from dse.report.words.clocks import boundary_blocks
from dse.report.words.contention import (
    bus_words,
    contended_words,
    core_words,
    processing_words,
    response_time_words,
)
from dse.report.words.messages import bus_timelines, message_tables
from dse.report.words.reasons import CHAINED, EMPTY_SLOT, GAPS, OTHER_TYPE, REDUCED
from dse.report.words.resources import resource_blocks
from dse.report.words.scheduling import busy_timelines, response_tables
from dse.space.question.settings import settings_of
from dse.support.units import Exact, is_unbounded
from dse.support.units.text import count_words

WATERFALL = (
    "Latency of {}: each bar begins where the worst case of the one before it ends; its solid part is the minimum. "
    "Contributions without time are in the table only."
)
FEW = 3
"""The greatest number of decisions, of processors and of buses that are told on a terminal."""
FEW_REQUIREMENTS = 5
FEW_FLOWS = 4
FEW_THREADS = 7
MANY = 6
"""The greatest number of other metrics that are told before the table of all."""
MORE_REQUIREMENTS = "and {} more requirements (--all)"
OF_COMPONENTS = ("latency", "min latency", "jitter", "utilisation", "load", "busy")
"""Metrics that the tables of flows, processors and buses tell."""
USAGE = (
    "Which thread runs on which core, and which connection on which bus: each piece of a bar is one of them; the mark "
    "across a bar is its limit."
)


def analysis_page(analysis: Analysis) -> Page:
    """The verdict with its reasons; then contributor tables, processor and bus tables, metrics.

    A `Page` with the sections *design* (verdict, and what is counted),
    *overview*, *flows* and *responses*; an invalid design has its breaches only.
    """
    chosen = [f"{name.removesuffix('.type')} {value}" for name, value in analysis.numbered_decisions.items()]
    design: list[Block] = [Text(f"Design: {', '.join(chosen)}", brief=f"Design: {few(chosen, FEW, 'decisions')}.")]
    blocks = [*(design if chosen else []), *listing(analysis.breaches, "not a valid design", 0, "wrong")]
    if not analysis.breaches:
        blocks += texts(_verdict_words(analysis), tone="strong")
        blocks += listing([f"{item.reason} ({item.origin})" for item in analysis.unread], "not analysed", 0, "wrong")
        blocks.append(_counted(analysis))
    sections = [Section("design", "The design", tuple(blocks))]
    if not analysis.breaches:
        sections += [
            Section("overview", "Where it stands", tuple(_overview(analysis))),
            Section("flows", "Latencies", tuple(_flows(analysis))),
            Section("responses", "Response times", tuple(_responses(analysis))),
            Section("latency", "Latency, contribution by contribution", tuple(_latency(analysis)), is_detail=True),
            Section("clocks", "Timers on one clock", tuple(boundary_blocks(analysis.boundaries)), is_detail=True),
            Section("usage", "Who uses processors and buses", tuple(_usage(analysis)), is_detail=True),
            Section("metrics", "Every metric", tuple(_every_figure(analysis)), is_detail=True),
        ]
    name = analysis.space.name
    return Page(f"{name}: analysis", name, tuple(section for section in sections if section.blocks))


def _every_figure(analysis: Analysis) -> Iterator[Block]:
    """Requirements as they are stated, and metrics."""
    if analysis.verdicts:
        yield verdict_table(analysis)
    yield metric_table(analysis)


def _verdict_words(analysis: Analysis) -> str:
    """The verdict: the requirements that the design violates, or that it meets every one."""
    broken = [verdict.requirement.shown for verdict in analysis.verdicts if not verdict.holds]
    unchecked = [item.requirement for item in analysis.space.unchecked]
    known = len(analysis.verdicts) + len(unchecked)
    left = f"{len(unchecked)} of {count_words(known, 'requirement')} cannot be checked: {'; '.join(unchecked)}"
    if not broken:
        if unchecked:
            return f"UNKNOWN  {left}."
        return "MEETS EVERY REQUIREMENT" if analysis.verdicts else ""
    what = f"{len(broken)} of {count_words(known, 'requirement')}"
    return f"VIOLATED  {what}: {'; '.join(broken)}." + (f" {left}." if unchecked else "")


def _overview(analysis: Analysis) -> Iterator[Block]:
    """The nearest limits, the use of processors and buses, other metrics and warnings."""
    yield from listing(analysis.warnings, "warning", 0, "doubtful", brief=1)
    if analysis.verdicts:
        yield _margin_table(analysis)
    used = [(_fullness(usage), _processor_words(usage)) for usage in analysis.processors if _is_used(usage)]
    used += [(_fullness(usage), _bus_words(usage)) for usage in analysis.buses if _is_used(usage)]
    if used:
        said = [words for _, words in used]
        fullest = [words for _, words in sorted(used, key=lambda item: -item[0])]
        brief = f"Used most: {few(fullest, FEW, 'processors and buses')}." if len(used) > FEW + 1 else ""
        yield Text(f"Used: {'; '.join(said)}.", brief=brief)
    currency = analysis.space.currency
    others = [
        f"{name} {readable(value, analysis.metric_units[name], currency)}"
        for name, value in analysis.metrics.items()
        if name.partition(" of ")[0] not in OF_COMPONENTS
    ]
    if others:
        yield Text(f"Other metrics: {'; '.join(others)}.", brief=f"Other metrics: {few(others, MANY, 'metrics')}.")
    missed = [
        item.name for findings in analysis.responses.values() for item in findings if item.meets_deadline is False
    ]
    missed += [
        item.name for findings in analysis.messages.values() for item in findings if item.meets_deadline is False
    ]
    yield from texts(f"Missed deadlines: {', '.join(missed)}." if missed else "", tone="wrong")
    findings = [finding for flow in analysis.flows for finding in flow.findings]
    findings += [finding for usage in analysis.buses if usage.budget is not None for finding in usage.budget.findings]
    findings += [finding for use in analysis.resources for finding in use.findings]
    severities = sorted(Counter(finding.severity for finding in findings).items())
    if severities:
        counts = " and ".join(count_words(count, word) for word, count in severities)
        words = f"OSATE's findings: {counts}"
        yield Text(f"{words}, with the flows, buses and budgets below.", brief=f"{words} (--all).")


def _flows(analysis: Analysis) -> Iterator[Table]:
    """A row for each flow: its latency, its jitter, and what takes the most of it."""
    rows = []
    for flow in analysis.flows:
        ends = [column([value], "ns")[1][0] for value in (flow.min_ns, flow.max_ns, flow.jitter_ns)]
        most = max(flow.rows, key=lambda row: row.max_ns, default=None)
        said = ""
        if most is not None and flow.max_ns and not is_unbounded(flow.max_ns):
            share = readable(Fraction(most.max_ns) / flow.max_ns * PPM, "ppm", digits=1)
            said = f"{most.contributor}, {most.max_method} ({share})"
        rows.append((flow.name, *ends, said))
    headings = ("flow", "best [ms]", "worst [ms]", "jitter [ms]", "largest contribution")
    if rows:
        yield Table("Latencies", headings, tuple(rows), (1, 2, 3), brief=FEW_FLOWS, rest="and {} more flows (--all)")


def _is_used(usage: Usage) -> bool:
    return bool(usage.capacity and usage.shares)


def _fullness(usage: Usage) -> Fraction:
    """How much of a processor's fullest core, or of a bus, is used."""
    assert usage.capacity is not None
    loads = usage.core_loads
    busy = usage.busy_total or Fraction(0)
    return max(loads.values()) / PPM if loads else max(usage.total / usage.capacity, busy / PPM)


def _processor_words(usage: Usage) -> str:
    """``computer (soc_high) 231.9 % of 400 % (4 cores), 60.2 % of core 1, the fullest``."""
    assert usage.capacity is not None
    said = f"{usage.name} ({usage.type}) {readable(usage.total, 'ppm')} {of_cores(usage.capacity)}"
    loads = usage.core_loads
    fullest = max(loads, key=lambda core: loads[core], default=None)
    return said if fullest is None else f"{said}, {readable(loads[fullest], 'ppm')} of core {fullest}, the fullest"


def _bus_words(usage: Usage) -> str:
    """``can0 (can_500k) 8.6 % of its bandwidth, busy 11.8 %``."""
    busy = "" if usage.busy_total is None else f", busy {readable(usage.busy_total, 'ppm')}"
    return f"{usage.name} ({usage.type}) {_share(usage.total, usage)} of its bandwidth{busy}"


def _responses(analysis: Analysis) -> Iterator[Block]:
    yield from deadline_plot(analysis.responses, analysis.messages)
    yield from response_tables(analysis.responses, FEW_THREADS)
    yield from message_tables(analysis.messages, FEW_THREADS)


def _counted(analysis: Analysis) -> Text:
    """The paragraph on what latencies count and leave out; marked doubtful where a requirement fails with waiting."""
    settings = settings_of(analysis.space)
    processing, buses, kept = processing_words(settings), bus_words(analysis.space), ""
    if analysis.contended is not None:
        said = contended_words(analysis.contended, analysis.space.currency)
        kept = f"With waiting for the CPU, {core_words(analysis.space)}: {said}"
    is_broken = analysis.contended is not None and bool(analysis.contended.broken)
    verdict = waiting_verdict(waiting_counted(analysis.space), missing_figures(analysis.space))
    whole = " ".join(filter(None, (f"Counted  {basis_words(settings)}.", verdict, processing, kept, buses)))
    counted = counting_words(analysis.space)
    brief = " ".join(filter(None, ("Counted ", counted, kept))) if counted else ""
    return Text(whole, "doubtful" if is_broken else "plain", brief, hang=9)


def _latency(analysis: Analysis) -> Iterator[Block]:
    for flow in analysis.flows:
        records = waterfall_records(flow)
        if records:
            draw = partial(waterfall, flow, records)
            yield Plot(f"latency-{flow.name}", draw, WATERFALL.format(flow.name))
        yield flow_table(flow)
        yield from listing([f"{item.severity}: {item.text}" for item in flow.findings], "OSATE", 0)
    steps = [step for flow in analysis.space.flows for step in flow.steps]
    chained = counts_responses(analysis.space) and any(step.chain for step in steps)
    yield from texts(REDUCED, *([CHAINED] if chained else []), GAPS[0], scale_words(analysis.space))


def _usage(analysis: Analysis) -> Iterator[Block]:
    records = usage_records(analysis.processors, analysis.buses, tightest_limits(analysis))
    if records:
        yield Plot("usage", partial(usage_chart, records), USAGE)
    yield from usage_tables(analysis)
    budgets = [usage.budget for usage in analysis.buses if usage.budget is not None]
    yield from listing([f"{item.severity}: {item.text}" for budget in budgets for item in budget.findings], "OSATE", 0)
    yield from resource_blocks(analysis)
    yield from busy_timelines(analysis.responses)
    yield from bus_timelines(analysis.messages)
    if analysis.responses:
        yield from texts(response_time_words(analysis.space, analysis.design))


def flow_table(flow: FlowTable) -> Table:
    """The table of the contributions to the least and the greatest latency of a flow.

    One row for each contributor, with the method by which minimum and maximum count, and a total with the jitter; times
    in ms.
    """
    rows: list[tuple[str, ...]] = [
        (
            f"{row.category} {row.contributor}" + (f" on {row.medium}" if row.medium else ""),
            counted(row.min_ns, "ns", digits=6),
            row.min_method,
            counted(row.max_ns, "ns", digits=6),
            row.max_method,
        )
        for row in flow.rows
    ]
    ends = [counted(value, "ns", digits=6) for value in (flow.min_ns, flow.max_ns, flow.jitter_ns)]
    rows.append(("total", ends[0], "", ends[1], f"jitter {ends[2]}"))
    headings: tuple[str, ...] = ("contributor", "minimum", "method", "maximum", "method")
    specified = flow.specified_ns
    if specified is not None and any(specified):
        specified_words = [_specified_words(item) for item in (*(row.specified_ns for row in flow.rows), specified)]
        rows = [(*row, text) for row, text in zip(rows, specified_words, strict=True)]
        headings = (*headings, "specified")
    return Table(f"Latency of {flow.name}, contribution by contribution", headings, tuple(rows), (1, 3), total=True)


def _specified_words(range_ns: tuple[Exact, Exact] | None) -> str:
    """OSATE's specified column, empty where nothing is specified."""
    if range_ns is None or not any(range_ns):
        return ""
    return " .. ".join(counted(value, "ns", digits=6) for value in range_ns)


def usage_tables(analysis: Analysis) -> list[Table]:
    """The tables of the threads and connections that use processors and buses.

    One table for each processor and each bus with shares; empty slots are left out.
    """
    tables = [_usage_table(usage, processor=True) for usage in analysis.processors if usage.shares]
    return tables + [_usage_table(usage, processor=False) for usage in analysis.buses if usage.shares]


def _usage_table(usage: Usage, *, processor: bool) -> Table:
    unit, what = ("ppm", "thread") if processor else ("B/s", "connection")
    of = f"of {readable(usage.capacity, unit)}" if usage.capacity else ""
    rows = [
        (who, readable(share, unit, digits=4), *([] if processor else [_share(share, usage)]), *_core(usage, who))
        for who, share in usage.shares.items()
    ]
    total = (f"total {of}".strip(), readable(usage.total, unit, digits=4))
    rows.append((*total, *([] if processor else [_share(usage.total, usage)]), *_core(usage, "")))
    caption = f"{'Processor' if processor else 'Bus'} {usage.name} ({usage.type}){_budget_words(usage)}"
    figures = ("of one core",) if processor else ("load", "of the bandwidth")
    headings = (what, *figures, *(("core",) if usage.cores else ()))
    if usage.busy is not None and usage.busy_total is not None:
        busy = [usage.busy.get(who, Fraction(0)) for who in usage.shares]
        rows = [(*row, readable(time, "ppm")) for row, time in zip(rows, [*busy, usage.busy_total], strict=True)]
        headings = (*headings, "busy")
    if usage.payload is not None:
        plain = [usage.payload[who] for who in usage.shares]
        rows = [(*row, readable(each, unit)) for row, each in zip(rows, [*plain, sum(plain)], strict=True)]
        headings = (*headings, "payload, without frames")
    return Table(caption, headings, tuple(rows), (1, 2, 3, 4)[: len(headings) - 1], total=True)


def _budget_words(usage: Usage) -> str:
    """The budget of a bus, and what those of its users add up to."""
    if usage.budget is None:
        return ""
    stated = readable(usage.budget.stated, "B/s") if usage.budget.stated is not None else "none"
    return f", budget {stated}, budgets on it {readable(usage.budget.required, 'B/s')}"


def _core(usage: Usage, who: str) -> tuple[str, ...]:
    """The cell of a thread's core, where there is such a column."""
    return (str(usage.cores.get(who, "")),) if usage.cores else ()


def _share(share: Fraction, usage: Usage) -> str:
    return readable(share / usage.capacity * 10**6, "ppm", digits=2) if usage.capacity else NOTHING


def verdict_table(analysis: Analysis) -> Table:
    """The table of verdicts on each requirement, in the order of the file.

    Columns: requirement, value, limit, slack and verdict, in the units that engineers read.
    """
    rows = tuple(_verdict_row(analysis, verdict) for verdict in analysis.verdicts)
    return Table("Requirements", ("requirement", "value", "limit", "slack", "verdict"), rows, (1, 2, 3))


def _margin_table(analysis: Analysis) -> Table:
    """The slack of each requirement as a share of its limit: violated ones and the nearest first.

    Where each core has a limit the row is about the fullest one, of threads without a core in the partition shown.
    """
    rows = sorted((_nearest(analysis, verdict) for verdict in analysis.verdicts), key=lambda row: row[0])
    headings = ("requirement", "value", "limit", "slack", "verdict")
    caption = "Requirements, the nearest limit first" if len(rows) > 1 else "Requirement"
    shown = tuple(row for _, row in rows)
    return Table(caption, headings, shown, (1, 2, 3), brief=FEW_REQUIREMENTS, rest=MORE_REQUIREMENTS)


def _nearest(analysis: Analysis, verdict: Verdict) -> tuple[tuple[bool, bool, Fraction], tuple[str, ...]]:
    """The order of a requirement, and its row."""
    requirement, currency = verdict.requirement, analysis.space.currency
    name, value, limit, slack, unit = requirement.metric.name, verdict.value, verdict.limit, verdict.slack, verdict.unit
    if requirement.operator != "<=" or requirement.metric.key == "deadline":
        name = requirement.text
    name += " (implied)" if requirement.implied else ""
    empty = analysis.limits_empty_slot(verdict)
    if empty:
        said = OTHER_TYPE if analysis.is_of_other_type(verdict) else EMPTY_SLOT
        return (True, True, Fraction(1)), (name, NOTHING, NOTHING, NOTHING, said)
    spread, processor = verdict.spread, name.removeprefix("utilisation of ")
    if verdict.worst_core:
        name = f"{verdict.who} of {processor}"
    elif verdict.who:
        name = f"{name} ({verdict.who})"
    elif spread is not None and spread.status == "found" and (whole := _summed_cores(analysis, verdict)):
        core, each = spread.loads[spread.fullest - 1] * PPM, verdict.limit * PPM / whole
        if each - core < slack * each / (limit or 1):
            name, value, limit, slack = f"core {spread.fullest} of {processor}", core, each, each - core
    bandwidth = _shared_bandwidth(analysis, verdict)
    if bandwidth:
        value, limit, slack, unit = value * PPM / bandwidth, limit * PPM / bandwidth, slack * PPM / bandwidth, "ppm"
    share = Fraction(1) if not limit or is_unbounded(slack) else slack / abs(limit)
    of = f" of {readable(whole, 'ppm')}" if (whole := _summed_cores(analysis, verdict)) and "core " not in name else ""
    left = NOTHING if is_unbounded(slack) else readable(share * PPM, "ppm", digits=1) if limit else NOTHING
    row = (name, readable(value, unit, currency), f"{readable(limit, unit, currency)}{of}", left)
    return (verdict.holds, False, share), (*row, "holds" if verdict.holds else "VIOLATED")


def _verdict_row(analysis: Analysis, verdict: Verdict, digits: int = 6) -> tuple[str, ...]:
    """A requirement with its figures: utilisation in per cent of one core, load that a share limits of the bandwidth.

    Where the sum of a processor's cores decides the limit is that of all of them, and it is said what it is of each;
    where one core or thread decides value and limit are its own, and the value says whose.
    """
    currency, text = analysis.space.currency, verdict.requirement.shown
    if analysis.limits_empty_slot(verdict):
        said = OTHER_TYPE if analysis.is_of_other_type(verdict) else EMPTY_SLOT
        return (text, NOTHING, NOTHING, NOTHING, said)
    whole, bandwidth = _summed_cores(analysis, verdict), _shared_bandwidth(analysis, verdict)
    one, unit = (bandwidth / PPM, "ppm") if bandwidth else (Fraction(1), verdict.unit)
    figures = [value if is_unbounded(value) else value / one for value in (verdict.value, verdict.limit, verdict.slack)]
    values = [readable(value, unit, currency, digits) for value in figures[:2]]
    values.append(slack_words(figures[2], unit, currency, digits))
    each = f" ({each_core_words(verdict.limit, whole)}{_fullest_words(verdict, digits)})" if whole else ""
    said = f"holds, {verdict.who} is the tightest" if verdict.who else f"holds{each}"
    if not verdict.holds:
        said = f"VIOLATED by {verdict.who} alone" if verdict.who else f"VIOLATED{each}"
    if verdict.who:
        values[0] = f"{values[0]} ({verdict.who})"
    return (text, *values, said)


def _fullest_words(verdict: Verdict, digits: int) -> str:
    """The fullest core in words, where first-fit chooses cores and its slack is smaller than that of the sum."""
    assignment = verdict.spread
    if assignment is None or not assignment.is_open or assignment.status == "undecided":
        return ""
    used = readable(assignment.loads[assignment.fullest - 1] * PPM, "ppm", digits=digits)
    return f"; core {assignment.fullest} has {used} by first-fit"


def _summed_cores(analysis: Analysis, verdict: Verdict) -> Fraction | None:
    """The limit on the sum of several cores, in ppm of one core; None for one core, or where one core decides."""
    metric = verdict.requirement.metric
    if metric.kind != "utilisation" or metric.index is None or verdict.who or verdict.limit != verdict.whole_limit:
        return None
    capacity = analysis.processors[metric.index].capacity
    return capacity if capacity and capacity > PPM else None


def _shared_bandwidth(analysis: Analysis, verdict: Verdict) -> Fraction | None:
    """The bandwidth of a bus whose load a share of it limits."""
    metric = verdict.requirement.metric
    if metric.kind != "load" or metric.index is None or not verdict.requirement.is_share:
        return None
    return analysis.buses[metric.index].capacity


def metric_table(analysis: Analysis, base: Analysis | None = None) -> Table:
    """Every metric; with `base`, the analysis of today's design, that one's beside it, and the difference.

    Two columns without `base`, four with it: metric, baseline, here and the signed difference.
    """
    rows: list[tuple[str, ...]] = []
    currency = analysis.space.currency
    for name, value in analysis.metrics.items():
        unit = analysis.metric_units[name]
        here = f"{readable(value, unit, currency)}{_of_cores(analysis, name)}"
        if base is None:
            rows.append((name, here))
            continue
        change = value - base.metrics[name]
        sign = "+" if change > 0 else MINUS if change < 0 else "±"
        said = NOTHING if is_unbounded(change) else f"{sign}{amount_words(abs(change), unit, currency)}"
        rows.append((name, f"{readable(base.metrics[name], unit, currency)}{_of_cores(base, name)}", here, said))
    headings = ("metric", "value") if base is None else ("metric", "baseline", "here", "difference")
    return Table("Metrics", headings, tuple(rows), tuple(range(1, len(headings))))


def _of_cores(analysis: Analysis, name: str) -> str:
    """The capacity of all cores of the processor whose utilisation a metric is; None for one core."""
    for usage in analysis.processors:
        if name == f"utilisation of {usage.name}" and usage.capacity and usage.capacity > PPM:
            return f" of {readable(usage.capacity, 'ppm')}"
    return ""


def tightest_limits(analysis: Analysis) -> Mapping[str, Fraction]:
    """The smallest upper limit of each processor, core (by ``core 2 of computer``) and bus, as a share of capacity.

    Names to fractions of the capacity, 1 for 100 %; drawn as the mark across a bar of the usage chart.
    """
    slots = {"utilisation": analysis.processors, "load": analysis.buses}
    limits: dict[str, Fraction] = {}
    for verdict in analysis.verdicts:
        metric = verdict.requirement.metric
        if metric.kind in slots and verdict.requirement.is_upper and metric.index is not None:
            usage = slots[metric.kind][metric.index]
            if usage.capacity:
                share = verdict.whole_limit / usage.capacity
                limits[usage.name] = min(limits.get(usage.name, share), share)
        elif metric.kind == "core utilisation" and verdict.requirement.is_upper:
            core, share = metric.name.removeprefix("utilisation of "), verdict.limit / PPM
            limits[core] = min(limits.get(core, share), share)
    return limits
