"""The analysis of one design as a page; its tables are those of each alternative of a front, too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial

from dse.analysis.terms import PPM
from dse.report.amounts import amount_words, slack_words
from dse.report.bars import usage_chart, usage_records, waterfall, waterfall_records
from dse.report.contention import bus_words, contended_words, core_words, overhead_words, processing_words
from dse.report.page import MINUS, NOTHING, Block, Page, Plot, Section, Table, listing, texts
from dse.report.plain import basis_words, scale_words
from dse.report.scheduling import response_blocks
from dse.report.timeline import boundary_blocks
from dse.report.words import EMPTY_SLOT, GAPS, OTHER_TYPE, REDUCED
from dse.results.analyse import Analysis, FlowTable, Usage
from dse.results.display import counted, readable
from dse.space.settings import settings_of
from dse.units import is_unbounded
from dse.units.text import count_words

WATERFALL = (
    "Latency of {}: each bar begins where the worst case of the one before it ends; its solid part is the minimum. "
    "Contributions without time are in the table only."
)
USAGE = (
    "Which thread runs on which core, and which connection on which bus: each piece of a bar is one of them; the mark "
    "across a bar is its limit."
)


def analysis_page(analysis: Analysis) -> Page:
    """Contributor tables, processor and bus tables, verdicts of one design."""
    lead = f"{analysis.space.name} ({basis_words(settings_of(analysis.space))})"
    chosen = ", ".join(f"{name.removesuffix('.type')} {value}" for name, value in analysis.decisions.items())
    design = [*texts(f"Design: {chosen}" if chosen else "")]
    design += listing(analysis.breaches, "not a valid design", 0, "wrong")
    if not analysis.breaches:
        design += texts(_verdict_words(analysis), tone="strong")
    sections = [Section("design", "The design", tuple(design))]
    if not analysis.breaches:
        sections += [
            Section("latency", "Latency", tuple(_latency(analysis))),
            Section("clocks", "Timers on one clock", tuple(boundary_blocks(analysis.boundaries))),
            Section("usage", "Processors and buses", tuple(_usage(analysis))),
            Section("verdicts", "Requirements", tuple(_verdicts(analysis))),
        ]
    return Page(f"{analysis.space.name}: analysis", lead, tuple(section for section in sections if section.blocks))


def _verdict_words(analysis: Analysis) -> str:
    """The verdict, which comes before the tables: what the design breaks, where it breaks something."""
    broken = [verdict.requirement.shown for verdict in analysis.verdicts if not verdict.holds]
    if not broken:
        return "Verdict: meets every requirement." if analysis.verdicts else ""
    return (
        f"Verdict: breaks {len(broken)} of {count_words(len(analysis.verdicts), 'requirement')}: {'; '.join(broken)}."
    )


def _latency(analysis: Analysis) -> Iterator[Block]:
    for flow in analysis.flows:
        records = waterfall_records(flow)
        if records:
            draw = partial(waterfall, flow, records)
            yield Plot(f"latency-{flow.name}", draw, WATERFALL.format(flow.name))
        yield flow_table(flow)
    yield from texts(REDUCED, processing_words(settings_of(analysis.space)), bus_words(analysis.space))
    if analysis.contended is not None:
        said = contended_words(analysis.contended, analysis.space.currency)
        yield from texts(f"With response times, {core_words(analysis.space)}: {said}")
    yield from texts(GAPS[0], scale_words(analysis.space))


def _usage(analysis: Analysis) -> Iterator[Block]:
    records = usage_records(analysis.processors, analysis.buses, tightest_limits(analysis))
    if records:
        yield Plot("usage", partial(usage_chart, records), USAGE)
    yield from usage_tables(analysis)
    yield from response_blocks(analysis.responses)
    if analysis.responses:
        yield from texts(overhead_words(analysis.space, analysis.design))


def _verdicts(analysis: Analysis) -> Iterator[Block]:
    yield metric_table(analysis)
    if analysis.verdicts:
        yield verdict_table(analysis)
    yield from listing(analysis.warnings, "warning", 0)
    if analysis.verdicts:
        words = "meets every requirement" if analysis.is_feasible else "breaks a requirement"
        yield from texts(f"The design {words}.", tone="strong")


def flow_table(flow: FlowTable) -> Table:
    """What adds up to the least and the greatest latency of a flow."""
    rows = [
        (
            f"{row.category} {row.contributor}",
            counted(row.min_ns, "ns", digits=6),
            row.min_method,
            counted(row.max_ns, "ns", digits=6),
            row.max_method,
        )
        for row in flow.rows
    ]
    ends = [counted(value, "ns", digits=6) for value in (flow.min_ns, flow.max_ns, flow.jitter_ns)]
    rows.append(("total", ends[0], "", ends[1], f"jitter {ends[2]}"))
    headings = ("contributor", "minimum", "method", "maximum", "method")
    return Table(f"Latency of {flow.name}, contribution by contribution", headings, tuple(rows), (1, 3), total=True)


def usage_tables(analysis: Analysis) -> list[Table]:
    """Who uses the processors and buses, as far as somebody does."""
    found = [_usage_table(usage, processor=True) for usage in analysis.processors if usage.shares]
    return found + [_usage_table(usage, processor=False) for usage in analysis.buses if usage.shares]


def _usage_table(usage: Usage, *, processor: bool) -> Table:
    unit, what = ("ppm", "thread") if processor else ("B/s", "connection")
    of = f"of {readable(usage.capacity, unit)}" if usage.capacity else ""
    rows = [
        (who, readable(share, unit, digits=4), *([] if processor else [_share(share, usage)]), *_core(usage, who))
        for who, share in usage.shares.items()
    ]
    total = (f"total {of}".strip(), readable(usage.total, unit, digits=4))
    rows.append((*total, *([] if processor else [_share(usage.total, usage)]), *_core(usage, "")))
    caption = f"{'Processor' if processor else 'Bus'} {usage.name} ({usage.type})"
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


def _core(usage: Usage, who: str) -> tuple[str, ...]:
    """The cell of a thread's core, where there is such a column."""
    return (str(usage.cores.get(who, "")),) if usage.cores else ()


def _share(share: Fraction, usage: Usage) -> str:
    return readable(share / usage.capacity * 10**6, "ppm", digits=2) if usage.capacity else NOTHING


def verdict_table(analysis: Analysis) -> Table:
    """How the design meets each requirement."""
    rows: list[tuple[str, ...]] = []
    currency = analysis.space.currency
    for verdict in analysis.verdicts:
        if analysis.limits_empty_slot(verdict):
            said = OTHER_TYPE if analysis.is_of_other_type(verdict) else EMPTY_SLOT
            rows.append((verdict.requirement.shown, NOTHING, NOTHING, NOTHING, said))
            continue
        values = [readable(value, verdict.unit, currency, 6) for value in (verdict.value, verdict.limit)]
        values.append(slack_words(verdict.slack, verdict.unit, currency))
        said = f"holds, {verdict.who} is the tightest" if verdict.who else "holds"
        if not verdict.holds:
            said = f"BROKEN by {verdict.who} alone" if verdict.who else "BROKEN"
        rows.append((verdict.requirement.shown, *values, said))
    return Table("Requirements", ("requirement", "value", "limit", "slack", "verdict"), tuple(rows), (1, 2, 3))


def metric_table(analysis: Analysis, base: Analysis | None = None) -> Table:
    """Every metric; with `base`, the analysis of today's design, that one's beside it, and the difference."""
    rows: list[tuple[str, ...]] = []
    currency = analysis.space.currency
    for name, value in analysis.metrics.items():
        unit = analysis.metric_units[name]
        here = readable(value, unit, currency)
        if base is None:
            rows.append((name, here))
            continue
        change = value - base.metrics[name]
        sign = "+" if change > 0 else MINUS if change < 0 else "±"
        said = NOTHING if is_unbounded(change) else f"{sign}{amount_words(abs(change), unit, currency)}"
        rows.append((name, readable(base.metrics[name], unit, currency), here, said))
    headings = ("metric", "value") if base is None else ("metric", "baseline", "here", "difference")
    return Table("Metrics", headings, tuple(rows), tuple(range(1, len(headings))))


def tightest_limits(analysis: Analysis) -> Mapping[str, Fraction]:
    """The smallest upper limit of each processor, core (by ``core 2 of computer``) and bus, as a share of capacity."""
    slots = {"utilisation": analysis.processors, "load": analysis.buses}
    found: dict[str, Fraction] = {}
    for verdict in analysis.verdicts:
        metric = verdict.requirement.metric
        if metric.kind in slots and verdict.requirement.operator in ("<=", "<") and metric.index is not None:
            usage = slots[metric.kind][metric.index]
            if usage.capacity:
                share = verdict.whole_limit / usage.capacity
                found[usage.name] = min(found.get(usage.name, share), share)
        elif metric.kind == "core utilisation" and verdict.requirement.operator in ("<=", "<"):
            core, share = metric.name.removeprefix("utilisation of "), verdict.limit / PPM
            found[core] = min(found.get(core, share), share)
    return found
