"""The page of `dse fit`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path

from dse.fitting.extremes import Tail
from dse.fitting.fitted import Execution, Fit, Transport
from dse.report.page import Block, Page, Section, Table, listing, texts
from dse.report.plots.fit import execution_plot, transport_plots
from dse.support.units import TimeRange, format_duration, format_time_range
from dse.support.units.parse import whole
from dse.support.units.text import first_of

NO_BOUND = "The greatest of what was measured is no bound of what can happen: state more where there is a reason to."
METHODS = {
    "ols": "least squares of the minima and of the maxima of all sizes",
    "envelope": "the closest lines that nothing measured lies beyond (least sum of distances at the measured sizes)",
    "quantile": "quantile lines",
}
GRAVITY = (
    "spread",
    "saturated",
    "poor fit",
    "bend",
    "left out",
    "single sample",
    "few sizes",
    "resolution",
    "negative part",
    "crossing",
    "outside",
    "half round trip",
)
"""The kinds of remarks but of sample maxima, which one sentence tells: what weighs more comes first."""
MOST_UNUSED = 8
"""More columns that were not used are counted."""


def fit_page(fit: Fit) -> Page:
    """Figures, how well they fit, every remark, and plots.

    Sections for transmission times and execution times, where the fit has them, then what to know before the figures
    are used.
    """
    sections = []
    if fit.transports:
        sections.append(Section("transmission", "Transmission times", tuple(_transports(fit))))
    if fit.executions:
        sections.append(Section("execution", "Execution times", tuple(_executions(fit.executions))))
    sections.append(Section("use", "What to know before they are used", tuple(_use(fit))))
    files = ", ".join(Path(name).name for name in fit.files)
    return Page(f"Figures of {files}", "", tuple(sections))


def _use(fit: Fit) -> Iterator[Block]:
    yield from texts(NO_BOUND, tone="strong")
    if fit.unused:
        yield from texts(f"Columns that were not used: {first_of(fit.unused, MOST_UNUSED)}.")


def _transports(fit: Fit) -> Iterator[Block]:
    how = METHODS[fit.method]
    if fit.quantiles is not None:
        how += " of " + " and ".join(f"{float(share) * 100:g} %" for share in fit.quantiles)
    yield from texts(f"Transmission times: {how}{', half of round trips' if fit.is_round_trip else ''}")
    headings = ("transport", "platform", "fixed", "per byte", "sizes", "R2 low", "R2 high", "beyond", "most beyond")
    yield _table(headings, map(_transport_row, fit.transports))
    yield from _remarks(fit.transports)
    for item in fit.transports:
        yield from _tails((f"{item.where}, {tail.size_bytes} B", tail) for tail in item.tails)
    yield from chain.from_iterable(map(transport_plots, fit.transports))


def _transport_row(item: Transport) -> tuple[str, ...]:
    most = max(item.low_fit.most_beyond_ns, item.high_fit.most_beyond_ns)
    return (
        *(item.transport, item.platform),
        format_time_range(TimeRange(*map(whole, item.fixed_ns))),
        format_time_range(TimeRange(*map(whole, item.per_byte_ns))),
        str(len(item.summaries)),
        *(_share(item.low_fit.r_squared), _share(item.high_fit.r_squared)),
        str(item.low_fit.beyond + item.high_fit.beyond),
        _about(most),
    )


def _about(value_ns: Fraction | float) -> str:
    """A duration in four digits."""
    return format_duration(Fraction(f"{float(value_ns):.4g}"))


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def _executions(executions: tuple[Execution, ...]) -> Iterator[Block]:
    headings = ("thread type", "platform", "least .. greatest", "mean", "deviation", "samples")
    yield _table(headings, map(_execution_row, executions))
    yield from _remarks(executions)
    for item in executions:
        yield from _tails((item.where, tail) for tail in item.tails)
    yield execution_plot(executions)


def _execution_row(item: Execution) -> tuple[str, ...]:
    summary = item.summary
    deviation = None if summary.is_single else summary.deviation_ns
    return (
        *(item.name, item.platform),
        format_time_range(TimeRange(whole(summary.min_ns), whole(summary.max_ns))),
        *("-" if value is None else _about(value) for value in (summary.mean_ns, deviation)),
        "1 !" if summary.is_single else "-" if summary.count is None else str(summary.count),
    )


def _table(headings: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Table:
    """A row for each of what was fitted; a terminal leaves rows out where they are more than it has room for."""
    every = tuple(rows)
    rest = "{} more: --all"
    return Table("", headings, every, tuple(range(2, len(headings))), brief=len(every), rest=rest)


def _remarks(models: Iterable[Transport | Execution]) -> list[Block]:
    """Every remark once, with all that it is about, the gravest first: the last are left out where there is no room."""
    about: dict[tuple[int, str], list[str]] = {}
    for item in models:
        for remark in item.remarks:
            if remark.kind != "sample maximum":
                about.setdefault((GRAVITY.index(remark.kind), remark.text), []).append(item.where)
    said = [f"{', '.join(where)}: {text}." for (_, text), where in sorted(about.items(), key=lambda one: one[0][0])]
    return listing(said, brief=len(said))


def _tails(tails: Iterable[tuple[str, Tail]]) -> list[Block]:
    return listing(f"{where}: {_tail_words(tail)}." for where, tail in tails)


def _tail_words(tail: Tail) -> str:
    verdict = "the test rejects the fit" if tail.is_rejected else "the test does not reject the fit"
    depends = f"; samples depend on each other (lag 1: {tail.lag_1:.2f})" if abs(tail.lag_1) > 0.1 else ""
    return (
        f"{tail.model}: one in {tail.one_in:,} above {tail.level_ns / 1000:.4g} us, an extrapolation, "
        f"no bound; shape {tail.shape:.2f}, {tail.values} values, p = {tail.p_value:.2f}: {verdict}{depends}"
    )
