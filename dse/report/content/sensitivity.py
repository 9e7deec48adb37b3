"""The sections of a design's sensitivity: margins, tornadoes, uncertain inputs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import floor

from dse.answers.ranking.kinds import shortest_names
from dse.answers.ranking.variants import varying
from dse.answers.tables.display import counted, display_unit, figure, readable, titled
from dse.report.amounts import MOST_ROWS, Data, decisions_text, figure_text, number_of, safe_text
from dse.report.page import NOTHING, Block, Plot, Section, Table, Text, few, listing, texts
from dse.report.plots.canvas import Drawing
from dse.report.plots.study import shares, tornado
from dse.report.words.basis import scale_of
from dse.report.words.contention import study_counting_words
from dse.support.units import is_unbounded
from dse.support.units.text import count_words, first_of

SHOWN_BARS = 12
BRIEF_BARS = 8
"""Maximum number of bars of a metric on a terminal."""
SHOWN_MARGINS = 6
BRIEF_METRICS = 4
FEW = 3
"""The greatest numbers of margins, of metrics and uncertain inputs, and of decisions on a terminal."""
INDICES = (
    "share of its variance (Sobol); effect: mean change from one end of the input's range to the other "
    "(where it has no bounds, of the middle 95 % of its values)"
)


def sensitivity_sections(data: Data) -> Iterator[Section]:
    """The sections of what ``dse-sensitivity/1`` holds.

    `data` is the JSON form of the answer, so that a saved study gives an equal page. Sections: margins, tornado charts,
    uncertain inputs.
    """
    currency = data["problem"].get("currency", "EUR")
    chosen = decisions_text(data["decisions"], list(data["decisions"]))
    broken = (f"{text}; it has no margin below" for text in data["broken"])
    brief = few(chosen.split(", "), FEW, "decisions")
    margins: list[Block] = [Text(f"Design: {chosen or 'the only one'}", brief=f"Design: {brief}" if chosen else "")]
    margins += listing(broken, "VIOLATED", 0, "wrong")
    margins += texts(study_counting_words(data))
    margins.append(_margin_table(data, currency))
    margins += texts(_free_words(data))
    if scaling := data["execution_times"]:
        margins.append(Text(scaling_words(scaling), "strong", scaling_words(scaling, is_brief=True)))
    margins += texts(_left_out_words(data["left_out"]) if data.get("left_out") else "", tone="strong")
    breaks = (item[end]["requirement"] for item in data["margins"] for end in ("below", "above") if item[end])
    margins += texts(scale_of([*breaks, *(bar["metric"] for bar in data["tornado"])]))
    yield Section("margins", "Margins", tuple(margins))
    yield from _tornadoes(data, currency)
    if data["uncertainty"] is not None:
        yield from _uncertain_sections(data["uncertainty"], currency)


def _tornadoes(data: Data, currency: str) -> Iterator[Section]:
    """The most influential input of each metric, and all inputs that move it."""
    swings: list[Block] = []
    most: list[tuple[str, ...]] = []
    for metric in dict.fromkeys(bar["metric"] for bar in data["tornado"]):
        bars = [bar for bar in data["tornado"] if bar["metric"] == metric]
        swings += [_tornado_plot(metric, bars, currency), _tornado_table(metric, bars, currency)]
        ends = sorted(map(figure, bars[0]["values"]))
        moved = [figure_text(value, bars[0]["unit"], currency) for value in (bars[0]["nominal"], *ends)]
        most.append((metric, moved[0], bars[0]["path"], *moved[1:]))
    if swings:
        swing = texts(f"Each input alone, over: {data['swing']}.")
        headings = ("metric", "value", "most influential input", "from", "to")
        caption, rest = "Most influential input of each metric", "and {} more metrics (--all)"
        table = Table(caption, headings, tuple(most), (1, 3, 4), brief=BRIEF_METRICS, rest=rest, paths=(2,))
        is_beside = data["uncertainty"] is not None  # no room on a screen that also says how sure one can be
        yield Section("hangs", caption, (*swing, table), is_detail=is_beside)
        yield Section("tornado", "Influence of every input on each metric", tuple(swings), is_detail=True)


def _free_words(data: Data) -> str:
    """The number of inputs that cannot violate a requirement."""
    free = sum(not item["below"] and not item["above"] for item in data["margins"])
    one = free == 1
    return (
        f"{free} more input{'' if one else 's'} affect{'s' if one else ''} a requirement but cannot violate it."
        if free
        else ""
    )


def _left_out_words(parts: Sequence[str]) -> str:
    """The sentence on results that the time limit left out.

    >>> _left_out_words(["margins of further inputs", "uncertain inputs"])
    'Stopped by the time limit; not computed: margins of further inputs, uncertain inputs.'
    """
    return f"Stopped by the time limit; not computed: {', '.join(parts)}."


def _unbounded_words(metrics: Sequence[str]) -> str:
    """The sentence on unbounded metrics, whose variation is not explained.

    >>> _unbounded_words(["latency of f"])
    'Unbounded for some of the stated values, so that nothing explains their variation: latency of f.'
    """
    named = ", ".join(metrics)
    return f"Unbounded for some of the stated values, so that nothing explains their variation: {named}."


def scaling_words(scaling: Data, *, is_brief: bool = False) -> str:
    """The largest factor on all execution times, in words; `scaling` is ``execution_times`` of the data.

    The factor as a decimal number, exact where it is short (in brief with three decimals, rounded down), and the
    utilisation of each processor at it in % of one core.
    """
    if scaling["factor"] is None:
        return f"All execution times together: no requirement is violated up to {scaling['searched_to']} times."
    factor = Fraction(scaling["factor"])
    text = f"{float(factor):.9g}"
    if is_brief and factor >= 1:
        text = f"{floor(factor * 1000) / 1000:.9g}"
    elif scaling["exact"] and Fraction(text) != factor:
        text = f"{factor} = {text}…" if factor.denominator < 10**4 else f"{text}… (an exact fraction, rounded here)"
    alone = f" (by {scaling['thread']} alone)" if scaling["thread"] else ""
    said = (
        f"All execution times together: up to {text} times; beyond, a design violates {scaling['requirement']}{alone}."
    )
    used = ", ".join(f"{name} {readable(Fraction(v), 'ppm')}" for name, v in scaling["utilisations_ppm"].items())
    return f"{said} Breakdown utilisation: {used} of one core." if used else said


def _margin_table(data: Data, currency: str) -> Table:
    breaking = [item for item in data["margins"] if item["below"] or item["above"]]
    rows = []
    for item in sorted(breaking, key=_closeness):
        ends = [
            figure_text(side["last"], item["unit"], currency) if side else NOTHING
            for side in (item["below"], item["above"])
        ]
        words = "; ".join(
            f"{word}: {_metric_of(side['requirement'])}" + (f", {side['thread']} alone" if side["thread"] else "")
            for word, side in (("below", item["below"]), ("above", item["above"]))
            if side
        )
        low, high = ends
        room = f"{low} .. {high}" if NOTHING not in ends else f"from {low}" if high == NOTHING else f"up to {high}"
        rows.append((item["path"], figure_text(item["nominal"], item["unit"], currency), room, words))
    caption = "Margins: how far one input may move before a requirement is violated, the closest first"
    rest = "and {} more inputs with a margin (--all)"
    headings = ("input", "value", "may be", "violates")
    brief = Table(
        caption, headings, tuple(_brief_margins(data, currency)), (1,), brief=SHOWN_MARGINS, rest=rest, paths=(0,)
    )
    return Table(caption, headings, tuple(rows), (1,), most=MOST_ROWS, paths=(0,), short=brief)


def _brief_margins(data: Data, currency: str) -> Iterator[tuple[str, ...]]:
    """The rows of margins for a terminal: short names, three decimals that keep the requirement, what is violated."""
    breaking = sorted((item for item in data["margins"] if item["below"] or item["above"]), key=_closeness)
    paths = [item["path"] for item in data["margins"]]
    short = shortest_names([item["path"] for item in breaking], paths)
    for item in breaking:
        sides = [(name, item[name]) for name in ("below", "above") if item[name]]
        ends = [safe_text(Fraction(side["last"]), item["unit"], currency, is_least=n == "below") for n, side in sides]
        room = " .. ".join(ends) if len(ends) > 1 else f"{'from' if item['below'] else 'up to'} {ends[0]}"
        violated = dict.fromkeys(_violated_words(side) for _, side in sides)
        yield short[item["path"]], _spaced(item, currency), room, "; ".join(violated)


def _spaced(item: Data, currency: str) -> str:
    """The stated value of an input, thousands with a space."""
    return safe_text(Fraction(item["nominal"]), item["unit"], currency, is_least=True)


def _violated_words(side: Data) -> str:
    """The words for the requirement that is violated beyond a margin: its metric, or ``core 2 of computer``."""
    name = _metric_of(side["requirement"])
    if (side["thread"] or "").startswith("core "):
        return f"{side['thread']} of {name.removeprefix('utilisation of ')}"
    return f"{name}, {side['thread']} alone" if side["thread"] else name


def _metric_of(requirement: str) -> str:
    """A requirement without its limit, which the input cannot change: ``jitter of f`` for ``jitter of f <= 5 ms``."""
    return re.split(r" [<>=]=? ", requirement, maxsplit=1)[0]


def _closeness(item: Data) -> tuple[bool, Fraction]:
    nominal = Fraction(item["nominal"])
    moves = [abs(Fraction(side["last"]) - nominal) for side in (item["below"], item["above"]) if side]
    return (not nominal, min(moves) / nominal if nominal else Fraction(0))


def _tornado_plot(metric: str, bars: Sequence[Data], currency: str) -> Plot:
    unit = bars[0]["unit"]
    more = f" The {len(bars) - SHOWN_BARS} shorter bars are in the table." if len(bars) > SHOWN_BARS else ""
    words = f"{metric}: what moves it most; the dashed line is {figure_text(bars[0]['nominal'], unit, currency)}.{more}"
    return Plot(f"tornado-{metric}", partial(_tornado_chart, metric, bars, currency, words), words)


def _tornado_chart(metric: str, bars: Sequence[Data], currency: str, words: str) -> Drawing:
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
    return tornado(records, titled(metric, display_unit(unit, currency)[1]), words)


def _tornado_table(metric: str, bars: Sequence[Data], currency: str) -> Table:
    rows, swings = [], []
    for bar in bars:
        inputs = (figure_text(value, bar["input_unit"], currency) for value in bar["inputs"])
        rows.append((bar["path"], *inputs, *(figure_text(value, bar["unit"], currency) for value in bar["values"])))
        ends = [figure(value) for value in bar["values"]]
        swings.append(None if any(map(is_unbounded, ends)) else abs(ends[1] - ends[0]))
    longest = max((swing for swing in swings if swing is not None), default=Fraction(0)) or Fraction(1)
    return Table(
        f"{metric}: {figure_text(bars[0]['nominal'], bars[0]['unit'], currency)}",
        ("input", "from", "to", "there", "and there"),
        tuple(rows),
        (1, 2, 3, 4),
        bars=tuple(1.0 if swing is None else float(swing / longest) for swing in swings),
        brief=BRIEF_BARS,
        paths=(0,),
        rest="and {} shorter bars",
        most=MOST_ROWS,
    )


def _uncertain_sections(uncertainty: Data, currency: str) -> Iterator[Section]:
    yield Section("uncertainty", "Uncertain inputs", tuple(_uncertain_blocks(uncertainty)))
    indices = tuple(_index_blocks(uncertainty, currency))
    if indices:
        yield Section("variance", "What explains how much of the variance", indices, is_detail=True)


def _uncertain_blocks(uncertainty: Data) -> Iterator[Block]:
    one = uncertainty["design"]
    error = f", standard error {one['standard_error']:.2%}" if 0 < one["all_met"] < 1 else ""
    stated = tuple(uncertainty["inputs"].items())
    caption = f"Uncertain inputs ({count_words(uncertainty['samples'], 'sample')}, seed {uncertainty['seed']})"
    rest = "and {} more uncertain inputs (--all)"
    yield Table(caption, ("input", "what is stated"), stated, brief=BRIEF_METRICS, rest=rest)
    said = f"The design meets every requirement in {one['all_met']:.2%} of the samples{error}."
    yield from texts(said, tone="strong")
    yield from listing(f"{text}: {share:.2%}" for text, share in one["by_requirement"].items() if share < 1)
    if uncertainty["alternatives"]:
        names = varying([item["decisions"] for item in uncertainty["alternatives"]])
        chances = [
            (f"{item['all_met']:.2%}", _weakest(item), decisions_text(item["decisions"], names))
            for item in uncertainty["alternatives"]
        ]
        yield Table(
            "Alternatives of the front, the surest first",
            ("chance", "weakest requirement", "decisions"),
            tuple(chances),
            (0,),
            brief=BRIEF_METRICS,
            rest="and {} less sure ones (--all shows them)",
            most=MOST_ROWS,
        )
    yield from texts(_unbounded_words(uncertainty["unbounded"]) if uncertainty.get("unbounded") else "")


def _index_blocks(uncertainty: Data, currency: str) -> Iterator[Block]:
    for index in uncertainty["indices"]:
        paths = sorted(index["total"], key=lambda path: -index["total"][path])
        words = f"{index['output']}: what each input explains of its variance, alone (solid) and with interactions."
        yield Plot(f"variance-{index['output']}", partial(_variance_chart, index, paths, words), words)
        rows = [
            (
                path,
                f"{index['first'][path]:.3f}",
                f"{index['total'][path]:.3f}",
                figure_text(Fraction(index["effect"][path]), index["unit"], currency),
            )
            for path in paths
        ]
        caption = f"What moves {index['output']}: {INDICES}"
        yield Table(caption, ("input", "alone", "with interactions", "effect"), tuple(rows), (1, 2, 3))


def _variance_chart(index: Data, paths: Sequence[str], words: str) -> Drawing:
    records = [
        {
            "label": f"{path} · {index['total'][path]:.3f}",
            "first": max(0.0, index["first"][path]),
            "total": index["total"][path],
        }
        for path in paths[:SHOWN_BARS]
    ]
    return shares(records, "share of the variance", words)


def _weakest(item: Data) -> str:
    """The requirement that most samples break; nothing where none does."""
    shares_held: Mapping[str, float] = item["by_requirement"]
    name = min(shares_held, key=lambda text: shares_held[text], default="")
    return name if name and shares_held[name] < 1 else ""


# What robustness costs, as a section of the page of a robust front.


NAMED = 2
"""The greatest number of inputs, and of designs that are lost, that are told on one screen."""


def robust_section(data: Data, *, is_brief: bool = False) -> Section:
    """The best of each objective with and without it, and why nominal designs were lost; from ``dse-result/1``.

    Where it `is_brief` what may vary is named, and of what was lost there are the first.
    """
    return Section("robust", "What robustness costs", tuple(_blocks(data, is_brief=is_brief)))


def _blocks(data: Data, *, is_brief: bool) -> Iterator[Block]:
    robust = data["robust"]
    currency = robust.get("currency", "EUR")
    units = {info["name"]: info["unit"] for info in data["objectives"]}
    lost = {item["nominal_id"] for item in robust["lost"]}
    front = {item["id"]: item for item in robust["nominal_front"]}
    count = len(robust.get("unjudged", []))
    yield from texts(
        "Robust: every requirement holds for all of the stated values, proved. Objectives are those of the nominal "
        "figures.",
        tone="strong",
    )
    if is_brief:
        named = [f"{path} ({stated})" for path, stated in robust["inputs"].items()]
        yield from texts(f"What may vary: {first_of(named, NAMED, ' (--explain)')}.")
    else:
        yield Table("What may vary", ("input", "what is stated"), tuple(robust["inputs"].items()))
    prices = []
    for name, pair in robust["price"].items():
        ends = [pair[key] for key in ("nominal", "robust")]
        prices.append((name, *("none" if value is None else counted(value, units[name], currency) for value in ends)))
    caption = "What robustness costs: the best of each objective"
    yield Table(caption, ("objective", "nominal", "robust"), tuple(prices), (1, 2))
    reached = {tuple(item["objectives"].items()) for item in front.values()}
    same = sum(
        item["id"] in robust["entered"] and tuple(item["objectives"].items()) in reached for item in data["front"]
    )
    alike = f"{same} as good with other decisions, " if same else ""
    unjudged = f", {count} were not judged for want of time" if count else ""
    yield from texts(
        f"Of {len(front)} nominal alternatives {len(lost)} are not robust{unjudged}. "
        f"{len(robust['kept'])} of {len(data['front'])} robust alternatives are on the nominal front too, "
        f"{alike}{len(robust['entered']) - same} take the place of better ones that are not robust."
    )
    reasons = Counter(item["requirement"] for item in robust["lost"])
    yield from listing(f"{number} violate {text}" for text, number in reasons.most_common())
    rows = []
    for item in robust["lost"]:
        objectives = front[item["nominal_id"]]["objectives"]
        figures = (counted(figure(objectives[name]), unit, currency) for name, unit in units.items())
        worst = (figure_text(item[key], item["unit"], currency) for key in ("worst", "limit"))
        rows.append((f"#{item['nominal_id']}", *figures, item["requirement"], *worst))
    if rows:
        yield Table(
            "Nominal alternatives that are not robust, at their worst",
            ("nominal", *units, "breaks", "there", "limit"),
            tuple(rows),
            (*range(1, 1 + len(units)), 2 + len(units), 3 + len(units)),
            brief=NAMED if is_brief else 10,
            rest="and {} more that are not robust" + (" (--explain)" if is_brief else ""),
            most=MOST_ROWS,
        )
