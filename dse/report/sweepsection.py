"""The section of a sweep: break-points of a limit, or the front for each value of what was varied."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

from dse.report.document import Table
from dse.report.parts import Data, Plot, Section, decisions_text, limited, number_of
from dse.report.studyplots import lines_chart
from dse.results.display import counted, display_unit, figure, readable, titled
from dse.results.variants import varying
from dse.units import UnitError, parse_quantity


def sweep_sections(data: Data) -> Iterator[Section]:
    """The section of what ``dse-sweep/1`` holds."""
    currency = data["problem"].get("currency", "EUR")
    varied = "; ".join(
        f"{axis['name']} {axis.get('interval') or ', '.join(axis['values'][:12])}" for axis in data["vary"]
    )
    solved = [run for run in data["runs"] if run["status"] in ("complete", "infeasible")]
    said = f"{len(solved)} of {len(data['runs'])} runs are proved complete." if len(data["runs"]) > 1 else ""
    remarks = (f"{text}." for text in data.get("remarks", ()))
    texts = tuple(text for text in (f"Varied: {varied}.", said, f"Status: {data['status']}.", *remarks) if text)
    breaks = [run for run in data["runs"] if run["kind"] == "breaks" and run["stretches"]]
    if breaks:
        yield _break_section(data, breaks, texts, currency)
    else:
        yield _grid_section(data, texts, currency)


def _where(run: Data) -> str:
    return ", ".join(f"{name} {value}" for name, value in run["values"].items())


def _break_section(data: Data, runs: Sequence[Data], texts: tuple[str, ...], currency: str) -> Section:
    first = runs[0]
    unit, metric = first["unit"], first["metric"]
    designs = [item["decisions"] for run in runs for item in run["alternatives"]]
    names = varying(designs)
    rows: list[tuple[str, ...]] = []
    for run in runs:
        known = {item["id"]: item for item in run["alternatives"]}
        if run["infeasible_until"] is not None:
            end = readable(Fraction(run["infeasible_until"]), unit, currency, 6)
            rows.append(
                (*run["values"].values(), "", end, *("none" for _ in run["objectives"]), "0", "no design: proved")
            )
        for stretch in run["stretches"]:
            best = known[stretch["best"]]
            ends = [readable(Fraction(stretch[end]), unit, currency, 6) for end in ("from", "to")]
            values = [counted(figure(best["metrics"][i["name"]]), i["unit"], currency) for i in run["objectives"]]
            size = str(len(stretch["front"]))
            chosen = decisions_text(best["decisions"], names)
            rows.append((*run["values"].values(), *ends, *values, size, chosen))
    grid = list(first["values"])
    headings = (
        *grid,
        "from limit",
        "to",
        *(info["name"] for info in first["objectives"]),
        "on the front",
        "best choice",
    )
    table = Table(
        f"{metric}: the best choice from each break-point on", headings, limited(rows), tuple(range(len(headings) - 1))
    )
    plots = [_steps_plot(runs, info, unit, metric, currency) for info in first["objectives"]]
    return Section(
        "breaks", f"Limit on {metric}", (*texts, f"Definition: {first['definition']}."), tuple(plots), (table,)
    )


def _steps_plot(runs: Sequence[Data], info: Data, unit: str, metric: str, currency: str) -> Plot:
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
    words = f"Best {info['name']} as a function of the limit on {metric}."
    return Plot(f"best-{info['name']}", lines_chart(records, across, f"best {up}", words, steps=True), words)


def _grid_section(data: Data, texts: tuple[str, ...], currency: str) -> Section:
    runs = data["runs"]
    infos: list[Data] = next((run["objectives"] for run in runs if run.get("objectives")), [])
    rows: list[tuple[str, ...]] = []
    for run in runs:
        best = [_best(run, info) for info in infos]
        shown = [
            "none" if value is None else counted(value, info["unit"], currency)
            for value, info in zip(best, infos, strict=True)
        ]
        change = run["change"]
        moved = ("", "", "") if change is None else tuple(str(len(change[key])) for key in ("entered", "left", "moved"))
        rows.append((*run["values"].values(), run["status"], str(len(run.get("front", ()))), *shown, *moved))
    grid = list(runs[0]["values"]) if runs else []
    headings = (
        *grid,
        "status",
        "on the front",
        *(f"best {info['name']}" for info in infos),
        "enter",
        "leave",
        "stay, moved",
    )
    numbers = tuple(range(len(grid) + 1, len(headings)))
    table = Table(
        "Front by value, and what enters and leaves it against the value before", headings, limited(rows), numbers
    )
    plots = [plot for info in infos for plot in [_values_plot(data, info, currency)] if plot is not None]
    title = " and ".join(grid) if grid else "Sweep"
    return Section("sweep", f"Front as a function of {title}", texts, tuple(plots), (table,))


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
    return Plot(f"best-{info['name']}", lines_chart(records, across, up, words), words)


def _places(labels: Sequence[str]) -> tuple[dict[str, float], str]:
    """Each label as a number in the unit of the last one; factors as they are."""
    last = parse_quantity(labels[-1].lstrip("*"))
    one = parse_quantity(f"1 {last.unit}").value if last.unit and last.dimension is not None else Fraction(1)
    found = {label: float(parse_quantity(label.lstrip("*")).value / one) for label in labels}
    return found, last.unit or ("times the value" if labels[-1].startswith("*") else "")
