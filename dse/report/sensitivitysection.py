"""The sections of a design's sensitivity: margins, tornadoes, uncertain inputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from dse.report.document import NOTHING, Table
from dse.report.parts import Data, Plot, Section, decisions_text, figure_text, limited, number_of
from dse.report.studyplots import shares, tornado
from dse.results.display import display_unit, figure, readable, titled
from dse.results.variants import varying

SHOWN_BARS = 12
INDICES = (
    "share of its variance (Sobol); effect: mean change from one end of the input's range to the other "
    "(where it has no bounds, of the middle 95 % of its values)"
)


def sensitivity_sections(data: Data) -> Iterator[Section]:
    """The sections of what ``dse-sensitivity/1`` holds."""
    currency = data["problem"].get("currency", "EUR")
    chosen = decisions_text(data["decisions"], list(data["decisions"]))
    texts = [f"Design: {chosen or 'the only one'}."]
    texts += [f"Broken as it is, and left out of what follows: {text}." for text in data["broken"]]
    texts += [scaling_words(data["execution_times"])] if data["execution_times"] is not None else []
    texts += [left_out_words(data["left_out"])] if data.get("left_out") else []
    yield Section("margins", "Margins", tuple(texts), (), (_margin_table(data, currency),))
    plots, tables = [], []
    for metric in dict.fromkeys(bar["metric"] for bar in data["tornado"]):
        bars = [bar for bar in data["tornado"] if bar["metric"] == metric]
        plots.append(_tornado_plot(metric, bars, currency))
        tables.append(_tornado_table(metric, bars, currency))
    yield Section(
        "tornado",
        "What each metric hangs on",
        (f"Each input alone, over: {data['swing']}.",),
        tuple(plots),
        tuple(tables),
    )
    if data["uncertainty"] is not None:
        yield _uncertain_section(data["uncertainty"], currency)


def left_out_words(parts: Sequence[str]) -> str:
    """What there was no time for.

    >>> left_out_words(["margins of further inputs", "uncertain inputs"])
    'Stopped by the time limit; not looked at: margins of further inputs, uncertain inputs.'
    """
    return f"Stopped by the time limit; not looked at: {', '.join(parts)}."


def unbounded_words(metrics: Sequence[str]) -> str:
    """Of which metrics nothing is told.

    >>> unbounded_words(["latency of f"])
    'Unbounded for some of the stated values, so that nothing explains their variation: latency of f.'
    """
    named = ", ".join(metrics)
    return f"Unbounded for some of the stated values, so that nothing explains their variation: {named}."


def scaling_words(found: Data) -> str:
    """What multiplying all execution times does, in words; `found` is ``execution_times`` of the data."""
    if found["factor"] is None:
        return f"All execution times together: no requirement breaks up to {found['searched_to']} times as long."
    factor = Fraction(found["factor"])
    text = f"{float(factor):.9g}"
    if found["exact"] and Fraction(text) != factor:
        text = f"{factor} = {text}…" if factor.denominator < 10**4 else f"{text}… (an exact fraction, rounded here)"
    alone = f" (by {found['thread']} alone)" if found["thread"] else ""
    said = (
        f"All execution times together: up to {text} times as long; beyond that breaks {found['requirement']}{alone}."
    )
    used = ", ".join(f"{name} {readable(Fraction(v), 'ppm')}" for name, v in found["utilisations_ppm"].items())
    return f"{said} Breakdown utilisation there: {used} of one core." if used else said


def _margin_table(data: Data, currency: str) -> Table:
    breaking = [item for item in data["margins"] if item["below"] or item["above"]]
    rows = []
    for item in sorted(breaking, key=_closeness):
        ends = [
            figure_text(side["last"], item["unit"], currency) if side else NOTHING
            for side in (item["below"], item["above"])
        ]
        words = "; ".join(
            f"{word}: {side['requirement']}" + (f" (by {side['thread']} alone)" if side["thread"] else "")
            for word, side in (("below", item["below"]), ("above", item["above"]))
            if side
        )
        rows.append((item["path"], figure_text(item["nominal"], item["unit"], currency), *ends, words))
    caption = "Each input alone, the values up to which every requirement holds; the closest first"
    return Table(caption, ("input", "value", "least", "greatest", "breaks"), limited(rows), (1, 2, 3))


def _closeness(item: Data) -> tuple[bool, Fraction]:
    nominal = Fraction(item["nominal"])
    moves = [abs(Fraction(side["last"]) - nominal) for side in (item["below"], item["above"]) if side]
    return (not nominal, min(moves) / nominal if nominal else Fraction(0))


def _tornado_plot(metric: str, bars: Sequence[Data], currency: str) -> Plot:
    unit = bars[0]["unit"]
    records = []
    for bar in bars[:SHOWN_BARS]:
        nominal = number_of(bar["nominal"], unit, currency)
        drawn = [number_of(value, unit, currency) for value in bar["values"]]
        known = [value for value in (*drawn, nominal) if value is not None]
        low, high = (min(known), max(known)) if None in drawn and known else (drawn[0], drawn[1])
        ends = " .. ".join(figure_text(value, bar["input_unit"], currency) for value in bar["inputs"])
        text = " .. ".join(figure_text(value, unit, currency) for value in sorted(map(figure, bar["values"])))
        if low is not None and high is not None:
            low, high = min(low, high), max(low, high)
        record = {"low": low, "high": high, "nominal": nominal, "path": bar["path"]}
        records.append({**record, "inputs": ends, "text": text, "label": f"{bar['path']} · {text}"})
    more = f" The {len(bars) - SHOWN_BARS} shorter bars are in the table." if len(bars) > SHOWN_BARS else ""
    words = f"{metric}: what moves it most; the dashed line is {figure_text(bars[0]['nominal'], unit, currency)}.{more}"
    return Plot(f"tornado-{metric}", tornado(records, titled(metric, display_unit(unit, currency)[1]), words), words)


def _tornado_table(metric: str, bars: Sequence[Data], currency: str) -> Table:
    rows = [
        (
            bar["path"],
            *(figure_text(value, bar["input_unit"], currency) for value in bar["inputs"]),
            *(figure_text(value, bar["unit"], currency) for value in bar["values"]),
        )
        for bar in bars
    ]
    return Table(metric, ("input", "from", "to", f"{metric} there", "and there"), limited(rows), (1, 2, 3, 4))


def _uncertain_section(found: Data, currency: str) -> Section:
    one = found["design"]
    error = f", standard error {one['standard_error']:.2%}" if 0 < one["all_met"] < 1 else ""
    texts = [
        f"{found['samples']} samples, seed {found['seed']}.",
        f"The design meets every requirement in {one['all_met']:.2%} of the samples{error}.",
    ]
    tables = [Table("Uncertain inputs", ("input", "what is stated"), tuple(found["inputs"].items()))]
    if found["alternatives"]:
        names = varying([item["decisions"] for item in found["alternatives"]])
        chances = [
            (f"{item['all_met']:.2%}", weakest(item), decisions_text(item["decisions"], names))
            for item in found["alternatives"]
        ]
        tables.append(
            Table(
                "Alternatives of the front, the surest first",
                ("chance", "weakest requirement", "decisions"),
                limited(chances),
                (0,),
            )
        )
    if found.get("unbounded"):
        texts.append(unbounded_words(found["unbounded"]))
    plots = []
    for index in found["indices"]:
        paths = sorted(index["total"], key=lambda path: -index["total"][path])
        rows = [
            (
                path,
                f"{index['first'][path]:.3f}",
                f"{index['total'][path]:.3f}",
                figure_text(Fraction(index["effect"][path]), index["unit"], currency),
            )
            for path in paths
        ]
        caption = f"{index['output']}: {INDICES}"
        tables.append(Table(caption, ("input", "alone", "with interactions", "effect"), tuple(rows), (1, 2, 3)))
        records = [
            {
                "label": f"{path} · {index['total'][path]:.3f}",
                "first": max(0.0, index["first"][path]),
                "total": index["total"][path],
            }
            for path in paths[:SHOWN_BARS]
        ]
        words = f"{index['output']}: what each input explains of its variance, alone (solid) and with interactions."
        plots.append(Plot(f"variance-{index['output']}", shares(records, "share of the variance", words), words))
    return Section("uncertainty", "Uncertain inputs", tuple(texts), tuple(plots), tuple(tables))


def weakest(item: Data) -> str:
    """The requirement that most samples break; nothing where none does."""
    shares_held: Mapping[str, float] = item["by_requirement"]
    name = min(shares_held, key=lambda text: shares_held[text], default="")
    return name if name and shares_held[name] < 1 else ""
