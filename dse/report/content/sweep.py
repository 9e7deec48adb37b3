"""The section of a sweep: break-points of a limit, or the front for each value of what was varied."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any

from dse.answers.ranking.kinds import ARRANGED, MOST_NAMING, OF_RANGE, OF_VALUE, shortest_names
from dse.answers.ranking.variants import find_variants, varying
from dse.answers.tables.display import column, counted, display_unit, figure, readable, titled
from dse.report.amounts import MOST_ROWS, Data, amount_words, decisions_text, number_of, safe_text
from dse.report.page import NOTHING, Block, Item, Listing, Plot, Section, Table, Text, listing, texts
from dse.report.plots.canvas import Drawing
from dse.report.plots.study import lines_chart
from dse.report.words.basis import scale_of
from dse.report.words.contention import study_contention_words, study_counting_words
from dse.support.units import UnitError, is_unbounded, parse_quantity
from dse.support.units.text import count_words

SHOWN_DESIGNS = 3
"""How many designs of each front are told."""
FEW_STEPS = 4
"""The greatest number of steps of an objective that are printed."""
SCREEN: dict[str, Any] = {"brief": 10, "rest": "and {} more (--all)"}
"""The part of a table that is printed."""
BEST = "Best choice: the first of the front under that limit, closest to the ideal point of all fronts of the sweep."
"""The definition of the best choice, in short."""
TOLD = 180
"""Letters of a design below a table: two lines."""
KEPT: Data = {"status": "kept"}
"""The words for designs without a verdict: results of earlier versions."""
UNSOLVED = {"invalid": "made no valid problem", "open": "not solved", "incomplete": "stopped early"}


def sweep_sections(data: Data) -> Iterator[Section]:
    """The section of what ``dse-sweep/1`` holds.

    `data` is the JSON form of the answer. Intervals of a limit are drawn as steps, grids of values as tables.
    """
    currency = data["problem"].get("currency", "EUR")
    breaks = [run for run in data["runs"] if run["kind"] == "breaks"]
    designs: list[Block] = []
    blocks: list[Block] = [*texts(_varied(data))] if len(data["runs"]) > 1 or not breaks else []
    blocks += texts(study_counting_words(data))
    if breaks:
        name, title = "breaks", f"Limit on {breaks[0]['metric']}"
        solved = [run for run in breaks if run["stretches"]]
        blocks += [_steps_plot(solved, info, currency) for info in solved[0]["objectives"]] if solved else []
        for run in data["runs"]:
            blocks += _breaks(run, currency) if run["kind"] == "breaks" else _unsolved(run)
    else:
        grid = list(data["runs"][0]["values"]) if data["runs"] else []
        name, title = "sweep", f"Front as a function of {' and '.join(grid)}" if grid else "Sweep"
        blocks += _grid(data, currency)
        designs += _grid_designs(data, currency)
    objectives = (info["name"] for run in data["runs"] for info in run.get("objectives", ()))
    scale = scale_of([*objectives, *(axis["name"] for axis in data["vary"])])
    blocks += texts(*_counted_runs(data), study_contention_words(data), scale)
    blocks += listing(data.get("remarks", ()), "remark", 0, brief=SHOWN_DESIGNS)
    yield Section(name, title, tuple(blocks))
    if designs:
        yield Section("designs", "The first designs of each front", tuple(designs), is_detail=len(data["runs"]) > 1)


def _varied(data: Data) -> str:
    """The sentence on the varied inputs and their values."""
    said = (f"{axis['name']} {axis.get('interval') or ', '.join(axis['values'][:12])}" for axis in data["vary"])
    return f"Varied: {'; '.join(said)}."


def _counted_runs(data: Data) -> Iterator[str]:
    """How many runs have no proved answer."""
    for status, words in UNSOLVED.items():
        count = sum(run["status"] == status for run in data["runs"])
        if count:
            yield f"{count} of {count_words(len(data['runs']), 'run')} {words}."


def _where(run: Data) -> str:
    return ", ".join(f"{name} {value}" for name, value in run["values"].items())


def _unsolved(run: Data) -> Iterator[Block]:
    """A run that has no front to tell of."""
    if run["kind"] == "error":
        yield Text(f"{_where(run)}: no valid problem: {run['message']}", "wrong")
    else:
        yield Text(f"{_where(run)}: not solved: the sweep was stopped".removeprefix(": "))


def _breaks(run: Data, currency: str) -> Iterator[Block]:
    """The break-points of a limit, with the best choice between them."""
    where, unit, metric = _where(run), run["unit"], run["metric"]
    low, high = (readable(Fraction(run[end]), unit, currency, 6) for end in ("from", "to"))
    yield from texts(f"{where + ': ' if where else ''}{metric} {run['operator']} {low} .. {high}")
    if run["status"] == "infeasible":
        yield Text("INFEASIBLE  proved: no design under any limit of this interval.", "strong")
        return
    words = "complete, proved" if run["status"] == "complete" else "INCOMPLETE, stopped early"
    count = max(0, len(run["stretches"]) - 1)
    yield Text(f"Front    {words}: {count_words(count, 'break-point')}; nothing changes between them.", "strong")
    if run["infeasible_until"] is not None:
        value = readable(Fraction(run["infeasible_until"]), unit, currency, 6)
        yield from texts(f"No design {'below' if run['operator'] == '<=' else 'above'} {value} (proved).")
    yield _break_table(run, currency)
    for info in run["objectives"]:
        yield from _best_by_limit(run, info, currency)
    yield Text(f"Definition: {run['definition']}.", "quiet", BEST)


def _break_table(run: Data, currency: str) -> Table:
    known = {item["id"]: item for item in run["alternatives"]}
    names = varying([item["decisions"] for item in known.values()])
    is_judged = any("contention" in item for item in known.values())
    rows = []
    for stretch in _merged(run["stretches"]):
        best = known[stretch["best"]]
        ends = [readable(Fraction(stretch[end]), run["unit"], currency, 6) for end in ("from", "to")]
        shown = [_contended(run, best, currency)] if is_judged else []
        cells = (*ends, *_figures(run, best, currency), stretch["sizes"], *shown, f"#{best['id']}")
        rows.append((*cells, decisions_text(best["decisions"], names)))
    objectives = [info["name"] for info in run["objectives"]]
    judged = ["needs with waiting"] if is_judged else []
    headings = ("from limit", "to", *objectives, "on the front", *judged, "design", "decisions")
    last = len(headings) - 1
    where = f" at {_where(run)}" if run["values"] else ""
    caption = f"Best choice under the limit{where}"
    return Table(
        caption,
        headings,
        tuple(rows),
        tuple(range(last)),
        most=MOST_ROWS,
        wide=last,
        label=last - 1,
        told=TOLD,
        short=None if is_judged else _groups_table(run, currency, caption),
        **SCREEN,
    )


def _groups_table(run: Data, currency: str, caption: str) -> Table | None:
    """A row for neighbouring break-points whose best choices hardly differ; None where that shortens nothing.

    Limits are rounded up, so that each is feasible. Decisions are columns where no row has two of their options.
    """
    known = {item["id"]: item for item in run["alternatives"]}
    merged = _merged(run["stretches"])
    vectors = [[figure(known[item["best"]]["metrics"][o["name"]]) for o in run["objectives"]] for item in merged]
    if run["operator"] != "<=" or any(is_unbounded(value) for vector in vectors for value in vector):
        return None
    groups = _alike(vectors)
    if len(groups) in (0, len(merged)):
        return None
    limits = [safe_text(Fraction(merged[at]["from"]), run["unit"], currency, is_least=True) for at, _ in groups]
    headings, columns = ["from limit"], [limits]
    for axis, info in enumerate(run["objectives"]):
        ends = [sorted(vector[axis] for vector in vectors[start:end]) for start, end in groups]
        named, cells = column([value for values in ends for value in (values[0], values[-1])], info["unit"], currency)
        pairs = zip(cells[::2], cells[1::2], strict=True)
        headings.append(titled(info["name"], named))
        columns.append([low if low == high else f"{low} .. {high}" for low, high in pairs])
    numbers = tuple(range(len(headings)))
    chosen = [known[item["best"]]["decisions"] for item in merged]
    same = [name for name in varying(chosen) if all(_is_one([c.get(name) for c in chosen[a:b]]) for a, b in groups)]
    same = [name for name in same if name.rpartition(".")[2] not in ARRANGED]
    same.sort(key=lambda name: not name.endswith(".type"))
    short = shortest_names(same[:MOST_NAMING], chosen[0])
    for name in same[:MOST_NAMING]:
        headings.append(short[name])
        columns.append([chosen[start].get(name, NOTHING) for start, _ in groups])
    spare = tuple(range(len(headings) - 1, len(numbers), -1))
    rows = tuple(zip(*columns, strict=True))
    said = f"{caption}, by kind (--all: all {len(merged)} steps)"
    return Table(said, tuple(headings), rows, numbers, spare=spare, **SCREEN)


def _alike(vectors: Sequence[Sequence[Fraction]]) -> list[tuple[int, int]]:
    """The first and the last, exclusive, of neighbours that differ by no more than the designs of a kind."""
    axes = list(zip(*vectors, strict=True))
    spans = [max(values) - min(values) for values in axes]
    groups: list[tuple[int, int]] = []
    for at in range(len(vectors)):
        start = groups[-1][0] if groups else at
        parts = [values[start : at + 1] for values in axes]
        widths = zip(parts, spans, strict=True)
        if groups and all(max(p) - min(p) <= max(s * OF_RANGE, max(map(abs, p)) * OF_VALUE) for p, s in widths):
            groups[-1] = (start, at + 1)
        else:
            groups.append((at, at + 1))
    return groups


def _is_one(options: Sequence[str | None]) -> bool:
    return len({*options}) == 1


def _contended(run: Data, item: Data, currency: str) -> str:
    """The limit that a design needs when response times count, in the break table; that it breaks something else."""
    judged = item["contention"]
    limited = judged.get("limited", item["limited"])
    words = readable(figure(limited), run["unit"], currency, 6)
    return f"{words}, violates others" if judged["broken"] else words


def _best_by_limit(run: Data, info: Data, currency: str) -> Iterator[Text]:
    """The best value of one objective as a function of the limit: ``Best price: 900 EUR from 5 ms, 150 EUR from …``.

    In brief where the first value is reached, where the last, and the largest step between two.
    """
    known = {item["id"]: item for item in run["alternatives"]}
    pick = min if info["sense"] == "minimise" else max
    steps: list[tuple[Fraction, Fraction]] = []
    for stretch in run["stretches"]:
        value = pick(figure(known[entry["id"]]["metrics"][info["name"]]) for entry in stretch["front"])
        if not steps or steps[-1][0] != value:
            steps.append((value, Fraction(stretch["from"])))
    said = [f"{counted(v, info['unit'], currency)} from {readable(at, run['unit'], currency, 6)}" for v, at in steps]
    if not said:
        return
    brief = ""
    if len(said) > FEW_STEPS and not any(is_unbounded(value) for value, _ in steps):
        moves = [(other[0] - one[0], other[1]) for one, other in pairwise(steps)]
        move, at = max(moves, key=lambda item: abs(item[0]))
        words = amount_words(abs(move), info["unit"], currency)
        step = f"{words} {'less' if move < 0 else 'more'} from {readable(at, run['unit'], currency, 6)}"
        brief = f"Best {info['name']}: {said[0]}, {said[-1]}. Largest step: {step}."
    yield Text(f"Best {info['name']}: {', '.join(said)}.", brief=brief)


def _merged(stretches: Sequence[Data]) -> list[dict[str, Any]]:
    """Neighbouring stretches with the same best choice as one; `sizes` is how many designs their fronts have."""
    merged: list[dict[str, Any]] = []
    for stretch in stretches:
        size = len(stretch["front"])
        if merged and merged[-1]["best"] == stretch["best"]:
            least, most = min(merged[-1]["least"], size), max(merged[-1]["most"], size)
            merged[-1] |= {"to": stretch["to"], "least": least, "most": most}
        else:
            merged.append({**stretch, "least": size, "most": size})
    for item in merged:
        item["sizes"] = str(item["least"]) if item["least"] == item["most"] else f"{item['least']} .. {item['most']}"
    return merged


def _figures(run: Data, item: Data, currency: str) -> list[str]:
    return [counted(figure(item["metrics"][info["name"]]), info["unit"], currency) for info in run["objectives"]]


def _steps_plot(runs: Sequence[Data], info: Data, currency: str) -> Plot:
    words = f"Best {info['name']} as a function of the limit on {runs[0]['metric']}."
    return Plot(f"best-{info['name']}", partial(_steps_chart, runs, info, currency, words), words)


def _steps_chart(runs: Sequence[Data], info: Data, currency: str, words: str) -> Drawing:
    unit, metric = runs[0]["unit"], runs[0]["metric"]
    pick = min if info["sense"] == "minimise" else max
    records: list[dict[str, Any]] = []
    for run in runs:
        known = {item["id"]: figure(item["metrics"][info["name"]]) for item in run["alternatives"]}
        stretches = run["stretches"]
        for stretch in stretches:
            value = pick(known[entry["id"]] for entry in stretch["front"])
            record = {"series": _where(run), "y": number_of(value, info["unit"], currency)}
            said = {
                "text": counted(value, info["unit"], currency),
                "where": readable(Fraction(stretch["from"]), unit, currency, 6),
            }
            before = records[-1] if records and stretch is not stretches[0] else None
            fresh = before is None or before["y"] != record["y"]
            records.append({**record, **said, "x": number_of(stretch["from"], unit, currency), "mark": fresh})
        if stretches:
            records.append({**records[-1], "x": number_of(stretches[-1]["to"], unit, currency), "mark": False})
    across, up = (
        titled(name, display_unit(u, currency)[1])
        for name, u in ((f"limit on {metric}", unit), (info["name"], info["unit"]))
    )
    return lines_chart(records, across, f"best {up}", words, steps=True)


def _grid(data: Data, currency: str) -> Iterator[Block]:
    """The front for each value: its best figures, and what has no front."""
    infos: list[Data] = next((run["objectives"] for run in data["runs"] if run.get("objectives")), [])
    for info in infos:
        plot = _values_plot(data, info, currency)
        if plot is not None:
            yield plot
    yield _grid_table(data, infos, currency)
    for run in data["runs"]:
        if run["kind"] != "front":
            yield from _unsolved(run)


def _grid_designs(data: Data, currency: str) -> Iterator[Block]:
    """The first designs of each front."""
    names = varying([item["decisions"] for run in data["runs"] for item in run.get("front", ())])
    for run in data["runs"]:
        if run["kind"] != "front":
            continue
        said = ": infeasible, proved" if run["status"] == "infeasible" else ""
        yield Text(f"{_where(run)}{said}", "strong")
        yield from _first_designs(data, run, names, currency)


def _grid_table(data: Data, infos: Sequence[Data], currency: str) -> Table:
    rows: list[tuple[str, ...]] = []
    is_judged = data.get("contention") is not None
    for run in data["runs"]:
        best = [_best(run, info) for info in infos]
        shown = [
            "none" if value is None else counted(value, info["unit"], currency)
            for value, info in zip(best, infos, strict=True)
        ]
        front = run.get("front", ())
        kept = sum(item.get("contention", KEPT)["status"] == "kept" for item in front)
        judged = [f"{kept} of {len(front)}" if front else ""] if is_judged else []
        change = run["change"]
        moved = ("", "", "") if change is None else tuple(str(len(change[key])) for key in ("entered", "left", "moved"))
        rows.append((*run["values"].values(), run["status"], str(len(front)), *judged, *shown, *moved))
    grid = list(data["runs"][0]["values"]) if data["runs"] else []
    bests = (f"best {info['name']}" for info in infos)
    keep = ["keep with response times"] if is_judged else []
    headings = (*grid, "status", "on the front", *keep, *bests, "enter", "leave", "stay, moved")
    numbers = tuple(range(len(grid) + 1, len(headings)))
    caption = "Front by value, and what enters and leaves it against the value before"
    return Table(caption, headings, tuple(rows), numbers, most=MOST_ROWS, **SCREEN)


def _first_designs(data: Data, run: Data, names: Sequence[str], currency: str) -> Iterator[Block]:
    """The first designs of a front that are no variants of better-ranked ones, on the scale of the sweep."""
    front = run["front"]
    scale = data["ranking"]["scale"]
    vectors = [tuple(figure(item["metrics"][info["name"]]) for info in scale) for item in front]
    ranges = [abs(figure(info["best"]) - figure(info["worst"])) for info in scale]
    variants = find_variants(vectors, [item["decisions"] for item in front], ranges)
    leaders = [item for item, leader in zip(front, variants, strict=True) if leader is None]
    objectives = [info["name"] for info in run["objectives"]]
    items = []
    for item in leaders[:SHOWN_DESIGNS]:
        pairs = zip(objectives, _figures(run, item, currency), strict=True)
        chosen = decisions_text(item["decisions"], names)
        said = ", ".join(f"{name} {value}" for name, value in pairs)
        items.append(Item(f"{item['rank']}. {said}{f'; {chosen}' if chosen else ''}"))
    more = len(front) - len(items)
    if more > 0:
        like = " (near-identical ones count once)" if len(leaders) < len(front) else ""
        items.append(Item(f"and {more} more{like}"))
    if items:
        yield Listing(tuple(items))


def _best(run: Data, info: Data) -> Fraction | None:
    values = [figure(item["metrics"][info["name"]]) for item in run.get("front", ())]
    if not values:
        return None
    return min(values) if info["sense"] == "minimise" else max(values)


def _values_plot(data: Data, info: Data, currency: str) -> Plot | None:
    last = data["vary"][-1]
    try:
        places, unit = _places(last["values"])
    except UnitError:
        return None
    records = []
    for run in data["runs"]:
        best = _best(run, info)
        if best is None:
            continue
        *others, label = run["values"].values()
        names = [axis["name"] for axis in data["vary"][:-1]]
        series = ", ".join(f"{name} {value}" for name, value in zip(names, others, strict=True))
        place = {"series": series, "x": places[label], "y": number_of(best, info["unit"], currency)}
        records.append({**place, "where": label, "text": counted(best, info["unit"], currency), "mark": True})
    if not records:
        return None
    across = titled(last["name"], unit)
    words = f"Best {info['name']} as a function of {last['name']}."
    up = titled(f"best {info['name']}", display_unit(info["unit"], currency)[1])
    return Plot(f"best-{info['name']}", partial(lines_chart, records, across, up, words), words)


def _places(labels: Sequence[str]) -> tuple[dict[str, float], str]:
    """Each label as a number in the unit of the last one; factors as they are."""
    last = parse_quantity(labels[-1].lstrip("*"))
    one = parse_quantity(f"1 {last.unit}").value if last.unit and last.dimension is not None else Fraction(1)
    place_of = {label: float(parse_quantity(label.lstrip("*")).value / one) for label in labels}
    return place_of, last.unit or ("times the value" if labels[-1].startswith("*") else "")
