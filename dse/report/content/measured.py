"""A design against measurements, as a page."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

from dse.answers.measured import Input, Kept, MeasuredComparison, Prediction, Seen
from dse.answers.tables.display import counted, display_unit
from dse.report.amounts import amount_words
from dse.report.page import Block, Page, Plot, Section, Table, Tone, listing, texts
from dse.report.plots.canvas import Drawing
from dse.report.plots.charts import ChartBar, ChartRow, rows_chart
from dse.report.words.basis import scale_of
from dse.support.units import is_unbounded

DIGITS = 4
VERDICTS = {"inside": "inside", "above": "above", "below": "below", "both": "above and below"}

MOST = 8
"""The greatest number of rows of a table that are printed."""
REST = "and {} more (--all)"


def measured_page(comparison: MeasuredComparison) -> Page:
    """Metrics first, then figures of the file that have drifted, then what becomes of the requirements.

    `Page.is_amiss` is set where a prediction or a requirement fails.
    """
    section = Section("measured", "Predicted and measured", tuple(_blocks(comparison)))
    files = ", ".join(comparison.files)
    lead = f"{comparison.problem}, a design of it against {files}"
    return Page(f"{comparison.problem} against {files}", lead, (section,), is_amiss=not _is_well(comparison))


def _is_well(comparison: MeasuredComparison) -> bool:
    return comparison.is_as_predicted and comparison.still_holds


def _blocks(comparison: MeasuredComparison) -> Iterator[Block]:
    currency = comparison.currency
    drifted = [item for item in comparison.inputs if item.drifted]
    tone: Tone = "strong" if _is_well(comparison) else "wrong"
    yield from texts(_verdict(comparison, len(drifted)), tone=tone)
    if comparison.predictions:
        rows = tuple(_prediction(item, currency) for item in comparison.predictions)
        headings = ("metric", "predicted", "measured", "mean", "samples", "outside", "verdict")
        yield Table("Predicted and measured", headings, rows, (1, 2, 3, 4, 5), brief=MOST, rest=REST)
        yield from listing(
            (_beyond(item, currency) for item in comparison.predictions if item.verdict != "inside"), "", 1, "wrong"
        )
        for unit in dict.fromkeys(item.unit for item in comparison.predictions):
            group = tuple(item for item in comparison.predictions if item.unit == unit)
            name = f"predicted and measured {display_unit(unit, currency)[1]}"
            yield Plot(name, partial(_ranges, group, currency), "Predicted ranges (bars) and measured ones (lines).")
    if comparison.inputs:
        stated = tuple(_input(item) for item in comparison.inputs)
        yield Table(
            "Figures of the file",
            ("figure", "stated", "measured", "mean", "samples", "", "counts as"),
            stated,
            (1, 2, 3, 4),
            brief=MOST,
            rest=REST,
        )
    if comparison.requirements and drifted:
        kept = tuple(
            (
                item.text,
                *(counted(value, item.unit, currency) for value in item.values),
                *(_margin(item, at, currency) for at in (0, 1)),
                "holds" if item.holds[1] else "VIOLATED" if item.holds[0] else "VIOLATED, also as stated",
            )
            for item in comparison.requirements
        )
        columns = ("requirement", "as stated", "as measured", "margin as stated", "as measured", "")
        yield Table("Requirements with the measured figures", columns, kept, (1, 2, 3, 4), brief=MOST, rest=REST)
    overstepped = [item for item in comparison.requirements if item.observed_holds is False]
    yield from listing((_overstepped(item, currency) for item in overstepped), "", 1, "wrong")
    named = (
        *(item.name for item in comparison.predictions),
        *(item.text for item in comparison.requirements if drifted),
    )
    yield from texts(scale_of(named))
    yield from listing(comparison.remarks, "remark", 0)


def _verdict(comparison: MeasuredComparison, drifted: int) -> str:
    outside = sum(item.verdict != "inside" for item in comparison.predictions)
    parts = []
    if comparison.predictions:
        parts.append(
            f"{len(comparison.predictions) - outside} of {len(comparison.predictions)} metrics are as predicted."
        )
    if comparison.inputs:
        parts.append(f"{drifted} of {len(comparison.inputs)} figures lie beyond what the file states.")
    if drifted:
        broken = [item.text for item in comparison.requirements if not item.holds[1]]
        said = (
            "With them the design meets every requirement." if not broken else f"It then violates {'; '.join(broken)}."
        )
        parts.append(said)
    overstepped = [item.text for item in comparison.requirements if item.observed_holds is False]
    if overstepped:
        parts.append(f"The measured values violate {'; '.join(overstepped)}.")
    return " ".join(parts)


def _overstepped(item: Kept, currency: str) -> str:
    value = amount_words(item.observed or 0, item.unit, currency, DIGITS)
    return f"{item.text}: {value} was measured{'' if item.holds[0] else ', and predicted to violate it'}"


def _prediction(item: Prediction, currency: str) -> tuple[str, ...]:
    high = counted(item.high, item.unit, currency, DIGITS)
    predicted = f"up to {high}" if item.low is None else _range(item.low, item.high, item.unit, currency)
    outside = "" if item.outside is None else str(item.outside)
    return (item.name, predicted, *_seen(item.seen, item.unit, currency), outside, VERDICTS[item.verdict])


def _input(item: Input) -> tuple[str, ...]:
    state = "drifted" if item.drifted else "as stated"
    counts = "" if item.counted is None else _range(*item.counted, item.unit)
    return (item.name, _range(item.low, item.high, item.unit), *_seen(item.seen, item.unit, ""), state, counts)


def _seen(seen: Seen, unit: str, currency: str) -> tuple[str, str, str]:
    mean = "" if seen.mean is None else counted(seen.mean, unit, currency, DIGITS)
    return _range(seen.low, seen.high, unit, currency), mean, "" if seen.count is None else str(seen.count)


def _range(low: Fraction, high: Fraction, unit: str, currency: str = "EUR") -> str:
    ends = counted(low, unit, currency, DIGITS), counted(high, unit, currency, DIGITS)
    return ends[0] if low == high else " .. ".join(ends)


def _margin(item: Kept, at: int, currency: str) -> str:
    """The slack; of a share also what it is a share of, where that is the capacity of several cores."""
    slack, value = item.slacks[at], item.values[at]
    if is_unbounded(slack):
        return "-"
    said = counted(slack, item.unit, currency)
    is_upper = item.values[1] + item.slacks[1] == item.limit
    whole = counted(value + slack if is_upper else value - slack, item.unit, currency)
    return said if item.unit != "ppm" or whole in item.text else f"{said} of {whole}"


def _beyond(item: Prediction, currency: str) -> str:
    """``load of eth: 324.5 B/s beyond, 6.64 % of the measured value, 7.12 % of the predicted one``."""
    shares = ((item.of_measured, "the measured value"), (item.of_predicted, "the predicted one"))
    said = [f"{float(share * 100):.2f} % of {what}" for share, what in shares if share is not None]
    return f"{item.name}: {', '.join([f'{amount_words(item.beyond, item.unit, currency, DIGITS)} beyond', *said])}"


def _ranges(items: tuple[Prediction, ...], currency: str) -> Drawing:
    factor, unit = display_unit(items[0].unit, currency)
    rows = []
    for item in items:
        low, high, least, most = (
            None if is_unbounded(value) else float(value / factor)
            for value in (item.low or 0, item.high, item.seen.low, item.seen.high)
        )
        bars = (
            []
            if low is None or high is None
            else [ChartBar(low, high, "f-c1 pale", f"predicted {low:g} to {high:g} {unit}")]
        )
        if least is not None and most is not None:
            bars.append(ChartBar(least, most, "f-c2", f"measured {least:g} to {most:g} {unit}", height=3))
        mean = None if item.seen.mean is None else float(item.seen.mean / factor)
        marks = () if mean is None else ((mean, "l-c2 two", f"mean {mean:g} {unit}"),)
        rows.append(ChartRow(item.name, tuple(bars), marks))
    words = "Predicted and measured ranges of each metric, with the mean of what was measured."
    return rows_chart(rows, f"predicted (bar), measured (line, mean) [{unit}]", words)
