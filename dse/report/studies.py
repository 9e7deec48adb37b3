"""Terminal views of studies: sweeps, margins, uncertain inputs, the price of robustness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from rich.console import Console

from dse.report.parts import decisions_text
from dse.report.plain import basis_words, plain, plain_table, print_hanging
from dse.report.sensitivitysection import INDICES, left_out_words, scaling_words, unbounded_words, weakest
from dse.results.display import NO_BOUND, figure, readable
from dse.results.robust import RobustResult
from dse.results.sensitivity import Break, Margin, SensitivityResult, UncertainResult
from dse.results.sweep import Change, SweepResult, SweepRun
from dse.results.variants import find_variants, varying
from dse.units import is_unbounded

SHOWN_DESIGNS = 3
SHOWN_MARGINS = 15
SHOWN_BARS = 8
BAR_WIDTH = 30
ROOM_FOR_DECISIONS = 120
"""Columns of a terminal; in a narrower one designs are listed below their table."""
READABLE = {"ns", "ct", "ppm", "mW", "B/s", "nm"}


def print_sweep(console: Console, sweep: SweepResult) -> None:
    """Break-points with the architecture on each side, or the front for each value with what is won and lost."""
    console.print(f"{sweep.problem['name']} ({basis_words(sweep.problem)})", style="bold", markup=False)
    currency = str(sweep.problem["currency"])
    for run, change in zip(sweep.runs, sweep.changes, strict=True):
        where = ", ".join(f"{axis.name} {value}" for axis, value in zip(sweep.grid_axes, run.values, strict=True))
        if run.outcome is not None and run.outcome["kind"] == "breaks":
            _print_breaks(console, run, where, currency)
        else:
            _print_front(console, sweep, run, where, change)
    counts = {status: sum(run.status == status for run in sweep.runs) for status in ("invalid", "open", "incomplete")}
    for status, words in (
        ("invalid", "made no valid problem"),
        ("open", "not solved"),
        ("incomplete", "stopped early"),
    ):
        if counts[status]:
            console.print(f"{counts[status]} of {len(sweep.runs)} runs {words}.", markup=False)
    for remark in sweep.remarks:
        console.print(f"remark: {remark}", markup=False)


def _print_breaks(console: Console, run: SweepRun, where: str, currency: str) -> None:
    outcome = run.outcome
    assert outcome is not None
    unit, metric = outcome["unit"], outcome["metric"]
    low, high = (readable(Fraction(outcome[end]), unit, currency, 6) for end in ("from", "to"))
    console.print(f"{where + ': ' if where else ''}{metric} {outcome['operator']} {low} .. {high}", markup=False)
    if outcome["status"] == "infeasible":
        console.print("Infeasible, proved: no design under any limit of this interval.", style="bold", markup=False)
        return
    if outcome["infeasible_until"] is not None:
        value = readable(Fraction(outcome["infeasible_until"]), unit, currency, 6)
        word = "below" if outcome["operator"] == "<=" else "above"
        console.print(f"No design {word} {value} (proved).", markup=False)
    known = {item["id"]: item for item in outcome["alternatives"]}
    names = varying([item["decisions"] for item in known.values()])
    table = plain_table(console, "Best choice under the limit")
    wide = console.width >= ROOM_FOR_DECISIONS
    for heading in ("from limit", "to", *_headings(outcome), "on the front", "decisions" if wide else "design"):
        table.add_column(heading, overflow="fold", justify="left" if heading == "decisions" else "right")
    merged = _merged(outcome["stretches"])
    for stretch in merged:
        best = known[stretch["best"]]
        ends = [readable(Fraction(stretch[end]), unit, currency, 6) for end in ("from", "to")]
        chosen = plain(decisions_text(best["decisions"], names)) if wide else f"#{best['id']}"
        table.add_row(*ends, *_values(outcome, best, currency), stretch["sizes"], chosen)
    console.print(table)
    for number in () if wide else dict.fromkeys(stretch["best"] for stretch in merged):
        print_hanging(console, f"#{number}: {decisions_text(known[number]['decisions'], names)}", "")
    for info in outcome["objectives"]:
        console.print(_best_by_limit(outcome, known, info, currency), markup=False)
    words = "proved" if outcome["status"] == "complete" else "NOT proved: stopped early"
    count = len(outcome["stretches"])
    console.print(
        f"{count - 1} break-points of the front, {words}: nothing changes between them.", style="bold", markup=False
    )
    console.print(f"Definition: {outcome['definition']}.", markup=False)


def _best_by_limit(
    outcome: Mapping[str, Any], known: Mapping[int, Mapping[str, Any]], info: Mapping[str, str], currency: str
) -> str:
    """The best value of one objective as a function of the limit: ``Best price.

    900 EUR from 5 ms, 150 EUR from 20 ms``.
    """
    pick = min if info["sense"] == "minimise" else max
    steps: list[tuple[Fraction, str]] = []
    for stretch in outcome["stretches"]:
        value = pick(figure(known[entry["id"]]["metrics"][info["name"]]) for entry in stretch["front"])
        if not steps or steps[-1][0] != value:
            steps.append((value, readable(Fraction(stretch["from"]), outcome["unit"], currency, 6)))
    return (
        f"Best {info['name']}: "
        + ", ".join(f"{readable(value, info['unit'], currency)} from {place}" for value, place in steps)
        + "."
    )


def _merged(stretches: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Neighbouring stretches with the same best choice as one; `sizes` is how many designs their fronts have."""
    merged: list[dict[str, Any]] = []
    for stretch in stretches:
        size = len(stretch["front"])
        if merged and merged[-1]["best"] == stretch["best"]:
            merged[-1] |= {
                "to": stretch["to"],
                "most": max(merged[-1]["most"], size),
                "least": min(merged[-1]["least"], size),
            }
        else:
            merged.append({**stretch, "least": size, "most": size})
    for item in merged:
        item["sizes"] = str(item["least"]) if item["least"] == item["most"] else f"{item['least']} .. {item['most']}"
    return merged


def _print_front(console: Console, sweep: SweepResult, run: SweepRun, where: str, change: Change | None) -> None:
    currency = str(sweep.problem["currency"])
    console.print(where, style="bold", markup=False)
    outcome = run.outcome
    if outcome is None:
        console.print("  not solved: the sweep was stopped", markup=False)
        return
    if outcome["kind"] == "error":
        console.print(f"  no valid problem: {outcome['message']}", style="red", markup=False)
        return
    if outcome["status"] == "infeasible":
        console.print("  infeasible, proved", markup=False)
    leaders = _leaders(sweep, run)
    names = varying([item["decisions"] for other in sweep.runs for item in other.front])
    for item in leaders[:SHOWN_DESIGNS]:
        pairs = zip(_headings(outcome), _values(outcome, item, currency), strict=True)
        figures = ", ".join(f"{name} {value}" for name, value in pairs)
        chosen = decisions_text(item["decisions"], names)
        print_hanging(console, f"{item['rank']:>3}. {figures}{f'; {chosen}' if chosen else ''}")
    more = len(run.front) - len(leaders[:SHOWN_DESIGNS])
    if more > 0:
        like = " (near-identical ones count once)" if len(leaders) < len(run.front) else ""
        console.print(f"       and {more} more{like}", markup=False)
    if change is not None:
        _print_change(console, outcome, change, currency)


def _leaders(sweep: SweepResult, run: SweepRun) -> list[Mapping[str, Any]]:
    """The designs of a front without variants of better-ranked ones, on the scale of the sweep."""
    vectors = [tuple(figure(item["metrics"][info.name]) for info in sweep.scale) for item in run.front]
    ranges = [abs(info.best - info.worst) for info in sweep.scale]
    variants = find_variants(vectors, [item["decisions"] for item in run.front], ranges)
    return [item for item, leader in zip(run.front, variants, strict=True) if leader is None]


def _print_change(console: Console, outcome: Mapping[str, Any], change: Change, currency: str) -> None:
    moved = []
    for info in outcome["objectives"]:
        before, after = change.best[info["name"]]
        if before != after:
            ends = ["none" if value is None else readable(value, info["unit"], currency) for value in (before, after)]
            moved.append(f"best {info['name']} {ends[0]} -> {ends[1]}")
    entered, left = len(change.entered), len(change.left)
    said = f"  against the value before: {entered} designs enter, {left} leave the front, {len(change.moved)} "
    console.print("; ".join([f"{said}stay with other figures", *moved]), markup=False)


def _headings(outcome: Mapping[str, Any]) -> list[str]:
    return [str(info["name"]) for info in outcome["objectives"]]


def _values(outcome: Mapping[str, Any], item: Mapping[str, Any], currency: str) -> list[str]:
    return [readable(figure(item["metrics"][info["name"]]), info["unit"], currency) for info in outcome["objectives"]]


# --- sensitivity ---------------------------------------------------------------------------------------------------


def print_sensitivity(console: Console, result: SensitivityResult, *, show_all: bool = False) -> None:
    """Margins, the scaling of all execution times, tornado bars, and what uncertain inputs do."""
    console.print(f"{result.problem['name']} ({basis_words(result.problem)})", style="bold", markup=False)
    chosen = ", ".join(f"{name.removesuffix('.type')} {value}" for name, value in result.decisions.items())
    console.print(f"Design: {chosen or 'the only one'}", markup=False)
    for text in result.broken:
        console.print(f"broken as it is: {text}", style="bold red", markup=False)
    _print_margins(console, result, show_all)
    _print_scaling(console, result)
    for metric in result.metrics:
        _print_tornado(console, result, metric, show_all)
    if result.uncertain is not None:
        _print_uncertain(console, result.uncertain, show_all)
    if result.left_out:
        console.print(left_out_words(result.left_out), style="bold", markup=False)


def _print_margins(console: Console, result: SensitivityResult, show_all: bool) -> None:
    breaking = [item for item in result.margins if item.below is not None or item.above is not None]
    ordered = sorted(breaking, key=lambda item: (item.relative is None, item.relative or 0))
    shown = ordered if show_all else ordered[:SHOWN_MARGINS]
    table = plain_table(console, "Margins: each input alone, the values up to which every requirement holds")
    for heading, justify in (
        ("input", "left"),
        ("value", "right"),
        ("least", "right"),
        ("greatest", "right"),
        ("breaks", "left"),
    ):
        table.add_column(heading, justify=justify, overflow="fold")  # type: ignore[arg-type]
    for item in shown:
        ends = [
            _figure(side.last, item.unit, result.currency) if side is not None else ""
            for side in (item.below, item.above)
        ]
        table.add_row(
            plain(item.path), _figure(item.nominal, item.unit, result.currency), *ends, plain(_breaking(item))
        )
    console.print(table)
    more = len(ordered) - len(shown)
    free = len(result.margins) - len(breaking)
    said = [f"{more} further input{'s have' if more > 1 else ' has'} a margin (--all shows them)"] if more else []
    said += (
        [f"{free} reach{'es' if free == 1 else ''} a requirement but break{'s' if free == 1 else ''} none"]
        if free
        else []
    )
    if said:
        console.print(f"{'; '.join(said)}.", markup=False)


def _breaking(item: Margin) -> str:
    parts = [(word, side) for word, side in (("below", item.below), ("above", item.above)) if side is not None]
    return "; ".join(f"{word}: {_requirement(side)}" for word, side in parts)


def _length(swing: Fraction, longest: Fraction) -> int:
    """How long a bar is drawn; one without a bound takes all the room."""
    return BAR_WIDTH if is_unbounded(swing) else max(1, round(BAR_WIDTH * swing / longest))


def _requirement(side: Break) -> str:
    return f"{side.requirement} (by {side.thread} alone)" if side.thread else side.requirement


def _print_scaling(console: Console, result: SensitivityResult) -> None:
    if result.scaling is not None:
        console.print(scaling_words(result.scaling.to_dict()), style="bold", markup=False)


def _print_tornado(console: Console, result: SensitivityResult, metric: str, show_all: bool) -> None:
    bars = result.of_metric(metric)
    shown = bars if show_all else bars[:SHOWN_BARS]
    longest = max((bar.swing for bar in bars if not is_unbounded(bar.swing)), default=Fraction(0)) or Fraction(1)
    table = plain_table(
        console, plain(f"{metric}: {_figure(bars[0].nominal, bars[0].unit, result.currency)} ({result.swing})")
    )
    for heading in ("input", "from", "to", ""):
        table.add_column(heading, justify="right" if heading in ("from", "to") else "left", overflow="fold")
    for bar in shown:
        ends = [_figure(value, bar.unit, result.currency) for value in sorted(bar.values)]
        table.add_row(plain(bar.path), *ends, "#" * _length(bar.swing, longest))
    console.print(table)
    if len(bars) > len(shown):
        console.print(f"and {len(bars) - len(shown)} shorter bars", markup=False)


def _print_uncertain(console: Console, found: UncertainResult, show_all: bool) -> None:
    console.print(f"Uncertain inputs ({found.samples} samples, seed {found.seed}):", style="bold", markup=False)
    for path, words in found.inputs.items():
        console.print(f"  {path}: {words}", markup=False)
    one = found.design_chance
    console.print(
        f"The design meets every requirement in {one.all_met:.2%} of the samples.", style="bold", markup=False
    )
    for text, share in one.by_requirement.items():
        if share < 1:
            console.print(f"  {text}: {share:.2%}", markup=False)
    if found.chances:
        names = varying([item.decisions for item in found.chances])
        table = plain_table(console, "Alternatives of the front, the surest first")
        for heading in ("chance", "weakest requirement", "decisions"):
            table.add_column(heading, overflow="fold")
        shown = found.chances if show_all else found.chances[:SHOWN_MARGINS]
        for item in shown:
            chosen = plain(decisions_text(item.decisions, names))
            table.add_row(f"{item.all_met:.2%}", plain(weakest(item.to_dict())), chosen)
        console.print(table)
        if len(found.chances) > len(shown):
            console.print(f"and {len(found.chances) - len(shown)} less sure ones (--all shows them)", markup=False)
    if found.unbounded:
        console.print(unbounded_words(found.unbounded), markup=False)
    for index in found.indices:
        title = f"What moves {index.output}: {INDICES}"
        table = plain_table(console, plain(title))
        for heading in ("input", "alone", "with interactions", "effect"):
            table.add_column(heading, justify="left" if heading == "input" else "right", overflow="fold")
        for path in sorted(index.total, key=lambda name: -index.total[name]):
            effect = _figure(Fraction(index.effect[path]), index.unit, "")
            table.add_row(plain(path), f"{index.first[path]:.3f}", f"{index.total[path]:.3f}", effect)
        console.print(table)


def _figure(value: Fraction, unit: str, currency: str) -> str:
    if is_unbounded(value):
        return NO_BOUND
    if unit in READABLE:
        return readable(value, unit, currency, 6)
    number = str(value) if value.denominator == 1 else f"{float(value):.9g}"
    return f"{number} {unit}".strip()


# --- robustness ----------------------------------------------------------------------------------------------------


def print_robust(console: Console, study: RobustResult) -> None:
    """What robustness costs: the best of each objective with and without it, and why nominal designs were lost."""
    console.print("Robust: every requirement holds for all of", style="bold", markup=False)
    for path, words in study.inputs.items():
        console.print(f"  {path}: {words}", markup=False)
    currency = study.robust.space.currency
    infos = {info.name: info for info in study.robust.objectives}
    for name, pair in study.price.items():
        unit = infos[name].unit
        ends = ["none" if value is None else _counted(value, unit, currency) for value in pair]
        words = "unchanged" if ends[0] == ends[1] else f"{ends[1]} instead of {ends[0]}"
        console.print(f"Best {name}: {words}.", markup=False)
    lost = {item.point for item in study.failures}
    console.print(
        f"Of {len(study.nominal.front)} nominal designs {len(lost)} are not robust; "
        f"{len(study.kept)} of {len(study.robust.front)} robust "
        f"designs are on the nominal front too.",
        markup=False,
    )
    if study.unjudged:
        console.print(f"{len(study.unjudged)} of them were not looked at: the time was up.", markup=False)
    reasons: dict[str, int] = {}
    for item in study.failures:
        reasons[item.requirement] = reasons.get(item.requirement, 0) + 1
    for text, count in sorted(reasons.items(), key=lambda pair: -pair[1]):
        console.print(f"  {count} break {text}", markup=False)
    console.print(
        "Objectives are those of the nominal figures; the front is proved over the whole ranges.", markup=False
    )


def _counted(value: int, unit: str, currency: str) -> str:
    """An integer in a counting unit (``1/3 ppm``) for people."""
    scale, _, name = unit.rpartition(" ")
    factor = Fraction(1, int(scale.removeprefix("1/"))) if scale.startswith("1/") else Fraction(1)
    return readable(value * factor, name, currency)
