"""The walk through ECE-TR-25: every printed figure that `dse` computes, beside what it computes.

    python -m tests.walk            # each figure: equal, or different and why; exit code 1 where one is not as said
    python -m tests.walk --brief    # the different ones, and how many are equal in each table

docs/report.md is the page for readers; the figures printed lie in problems/report/tables.
"""

from __future__ import annotations

import csv
import json
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from dse.cli.main import run

ROOT = Path(__file__).parents[1]
TABLES = ROOT / "problems" / "report" / "tables"
MS, US = 10**6, 10**3

ROUNDED_TWICE = (
    "the report's cell is cut, or of a fit that was not yet rounded: 1 us below what its own Table 5.6 gives"
)
UNROUNDED = (
    "the report fitted its unrounded measurements, of which it prints 0.1 ms (RT101) or 1 us (Spectra): its own figure "
    "is within what that rounding leaves"
)
EXPECTED: Mapping[tuple[str, str], str] = {
    ("Section 2.3", "jitter of Table 2.1, ms"): "220.8 - 5.1 is 215.7; the text subtracts 220 - 5",
    ("Section 2.3", "jitter of Table 2.2, ms"): "120.8 - 5.1 is 115.7; the text subtracts 120 - 5",
    ("Section 5.5.2", "jitter of Table 5.7, ms"): "43.81 is cut, not rounded",
    ("Section 5.5.2", "line of Table 5.7, cm"): "2.63 is cut, as 43 ms times 0.6 m/s would be 2.58",
    (
        "Table 5.7",
        "row 3 min_ms",
    ): "Table 5.5 has 23.7 us, the model behind Table 5.7 had 23 us",
    ("Table 5.9", "row 7 max_ms"): ROUNDED_TWICE,
    ("Table 5.9", "row 13 max_ms"): ROUNDED_TWICE,
    ("Table 5.9", "row 17 min_ms"): ROUNDED_TWICE,
    ("Table 5.6", "RT101 min_per_byte_ns"): UNROUNDED,
    ("Table 5.6", "RT101 min_fixed_us"): UNROUNDED,
    ("Table 5.6", "RT101 max_fixed_us"): UNROUNDED,
    ("Table 5.6", "Spectra min_fixed_us"): UNROUNDED,
    ("Table 5.6", "Spectra max_fixed_us"): UNROUNDED,
}
"""Figures that differ, and why; every other one is equal."""


@dataclass(frozen=True)
class Figure:
    """A figure of the report and ours, both as text of the same precision."""

    place: str
    what: str
    printed: str
    ours: str

    @property
    def is_equal(self) -> bool:
        """Whether both say the same."""
        return self.printed == self.ours

    @property
    def is_as_said(self) -> bool:
        """Whether it is equal, or differs for a reason that is known."""
        return self.is_equal != ((self.place, self.what) in EXPECTED)

    def __str__(self) -> str:
        if self.is_equal:
            return f"equal      {self.place}, {self.what}: {self.printed}"
        why = EXPECTED.get((self.place, self.what), "NOT KNOWN WHY")
        return f"different  {self.place}, {self.what}: {self.printed} in the report, {self.ours} here: {why}"


@dataclass(frozen=True)
class Latencies:
    """A table of OSATE's latency report, by the command that gives its rows."""

    table: str
    command: str
    flow: str
    beyond: tuple[str, ...] = ()
    """Contributors at the ends of our flow that the table leaves out."""


LATENCIES = (
    Latencies("2.1", "analyse problems/inmark_chapter2.yaml", "f_gnss_lat"),
    Latencies(
        "2.2",
        "analyse problems/inmark_chapter2.yaml --design gnss_provider.dispatch_protocol=aperiodic",
        "f_gnss_lat",
    ),
    Latencies("3.4", "analyse problems/inmark_chapter3.yaml", "f_io_cmd"),
    Latencies("3.5", "analyse problems/inmark_chapter3.yaml", "f_gnss_lat"),
    Latencies(
        "5.7",
        "analyse problems/aadl/inmark_software.aadl --root software.rt101 --profile osate-2.2 --worst-case deadline",
        "chain",
        ("serial_driver", "io_driver"),
    ),
    Latencies(
        "5.9",
        "analyse problems/aadl/inmark_software.aadl --root software.spectra --profile osate-2.2 --worst-case deadline",
        "chain",
        ("serial_driver", "io_driver"),
    ),
)
LOADS = {"3.1": "canbus0", "3.2": "ser0", "3.3": "ser1"}
LOADED = "analyse problems/inmark_chapter3.yaml"
ETHERNET = "compare problems/report/ethernet.yaml --measured problems/report/ethernet_measured.csv"
FITTED = "fit problems/report/tables/table_5_3.csv --round-trip --name ros_ipc"
PROFILES = "fit problems/report/tables/table_5_5.csv --platform rt101=RT101 --platform spectra=Spectra"
COMMANDS = (*(item.command for item in LATENCIES), LOADED, ETHERNET, FITTED, PROFILES)


def walk() -> Iterator[Figure]:
    """Every figure, in the order of the report."""
    for item in LATENCIES[:2]:
        yield from latencies(item)
    yield from texts_of_chapter_2()
    for table, bus in LOADS.items():
        yield from loads(table, bus)
    for item in LATENCIES[2:4]:
        yield from latencies(item)
    yield from ethernet()
    yield from fitted()
    yield from profiles()
    for item in LATENCIES[4:]:
        yield from latencies(item)
    yield from texts_of_chapter_5()


@cache
def answer(command: str) -> dict[str, Any]:
    """The JSON of a command, run in the root of the repository."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "answer.json"
        words = [str(ROOT / word) if word.startswith("problems/") else word for word in command.split()]
        stdout, sys.stdout = sys.stdout, (Path(folder) / "page.txt").open("w", encoding="utf-8")
        try:
            run([*words, "--json", str(path)])
        finally:
            sys.stdout.close()
            sys.stdout = stdout
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return found


def table(number: str) -> list[dict[str, str]]:
    """The rows of a table of the report."""
    with (TABLES / f"table_{number.replace('.', '_')}.csv").open(encoding="utf-8") as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


def rounded(value: Any, like: str) -> str:
    """A figure with as many decimals as a printed one; halves are rounded up."""
    exact = Fraction(value)
    digits = len(like.partition(".")[2])
    number = Decimal(exact.numerator) / Decimal(exact.denominator)
    return str(number.quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP))


def latencies(item: Latencies) -> Iterator[Figure]:
    """Every cell of a latency table: contributors in their order, methods and times, and the totals."""
    place = f"Table {item.table}"
    *cells, total = table(item.table)
    rows = answer(item.command)["flows"][item.flow]["rows"]
    rows = [row for row in rows if row["contributor"] not in item.beyond]
    yield Figure(place, "number of rows", str(len(cells)), str(len(rows)))
    for cell, row in zip(cells, rows, strict=True):
        what = f"row {cell['row']}"
        yield Figure(place, f"{what} category", cell["kind"], row["category"])
        for end in ("min", "max"):
            yield Figure(place, f"{what} {end}_method", cell[f"{end}_method"], row[f"{end}_method"])
            printed = cell[f"{end}_ms"]
            yield Figure(place, f"{what} {end}_ms", printed, rounded(Fraction(row[f"{end}_ns"]) / MS, printed))
    for end in ("min", "max"):
        ours = sum(Fraction(row[f"{end}_ns"]) for row in rows) / MS
        yield Figure(place, f"total {end}_ms", total[f"{end}_ms"], rounded(ours, total[f"{end}_ms"]))


def texts_of_chapter_2() -> Iterator[Figure]:
    """Section 2.3: jitters, and what they make of the line at 0.6 m/s (section 1.4: 20 ms are 1.2 cm)."""
    yield Figure("Section 1.4", "line at 20 ms, cm", "1.2", line_cm(20 * MS, "1.2"))
    yield Figure("Section 1.4", "line at 200 ms, cm", "12", line_cm(200 * MS, "12"))
    for item, jitter_ms, line in ((LATENCIES[0], "215", "13"), (LATENCIES[1], "115", "7")):
        found = Fraction(answer(item.command)["metrics"][f"jitter of {item.flow}"]["value"])
        yield Figure("Section 2.3", f"jitter of Table {item.table}, ms", jitter_ms, rounded(found / MS, jitter_ms))
        yield Figure("Section 2.3", f"line of Table {item.table}, cm (almost)", line, line_cm(found, line))


def texts_of_chapter_5() -> Iterator[Figure]:
    """Section 5.5.2: what Table 5.7 makes of the line."""
    item = LATENCIES[4]
    found = Fraction(answer(item.command)["metrics"][f"jitter of {item.flow}"]["value"])
    yield Figure("Section 5.5.2", "jitter of Table 5.7, ms", "43", rounded(found / MS, "43"))
    yield Figure("Section 5.5.2", "line of Table 5.7, cm", "2.5", line_cm(found, "2.5"))


def line_cm(jitter_ns: Fraction | int, like: str) -> str:
    """How far the start of a line varies at 0.6 m/s: 60 nm for each microsecond."""
    return rounded(Fraction(jitter_ns) * 60 / 10**9, like)


def loads(number: str, bus: str) -> Iterator[Figure]:
    """A table of OSATE's bus bandwidth report: every connection, the total and what there is, in KBytesps of 1000."""
    found = answer(LOADED)["buses"][bus]
    shares = {**found["shares"], "TOTAL": found["total"], "AVAILABLE": found["capacity"]}
    cells = table(number)
    yield Figure(f"Table {number}", "number of rows", str(len(cells)), str(len(shares)))
    for cell in cells:
        ours = rounded(Fraction(shares[cell["source"]]) / 1000, cell["actual_KBytesps"])
        exact = Fraction(cell["actual_KBytesps"]) * 1000 == Fraction(shares[cell["source"]])
        yield Figure(
            f"Table {number}", cell["source"], cell["actual_KBytesps"], ours if exact else f"{ours}, not exactly"
        )


def ethernet() -> Iterator[Figure]:
    """Table 5.2, and the error that section 5.1 states."""
    [found] = answer(ETHERNET)["predictions"]
    yield Figure("Table 5.2", "estimated, B/s", "4560", rounded(found["predicted"][1], "4560"))
    yield Figure("Table 5.2", "measured, B/s", "4884.5", rounded(Fraction(88156) / Fraction("18.048"), "4884.5"))
    yield Figure("Section 5.1", "relative error, %", "6.64", rounded(Fraction(found["of_measured"]) * 100, "6.64"))


def fitted() -> Iterator[Figure]:
    """Table 5.6: lines through the minima and the maxima of Table 5.3, halved."""
    found = {item["platform"]: item for item in answer(FITTED)["transports"]}
    for cell in table("5.6"):
        platform = cell["platform"]
        for end, line in (("min", "low"), ("max", "high")):
            fit = found[platform][line]
            for name, value in (("per_byte_ns", fit["per_byte_ns"]), ("fixed_us", Fraction(fit["fixed_ns"]) / US)):
                printed = cell[f"{end}_{name}"]
                yield Figure("Table 5.6", f"{platform} {end}_{name}", printed, rounded(value, printed))


def profiles() -> Iterator[Figure]:
    """Table 5.5 as thread types: the least, the greatest and the mean of what was measured."""
    found = {(item["name"], item["platform"]): item for item in answer(PROFILES)["executions"]}
    names = {"rt101": "RT101", "spectra": "Spectra"}
    for cell in table("5.5"):
        name = f"{cell['component']}_{cell['thread']}"
        item = found[name, names[cell["platform"]]]
        for end in ("min", "max", "mean"):
            what = f"{cell['component']}.{cell['thread']} {names[cell['platform']]}, {end}, us"
            ours = Fraction(str(item["measured"][f"{end}_ns"])) / US
            yield Figure("Table 5.5", what, cell[f"{end}_us"], rounded(ours, cell[f"{end}_us"]))


def main(arguments: list[str]) -> int:
    """Print the walk; 1 where a figure is not as said."""
    figures = list(walk())
    wrong = [figure for figure in figures if not figure.is_as_said]
    lines = [str(figure) for figure in figures if not figure.is_equal or "--brief" not in arguments]
    for place in dict.fromkeys(figure.place for figure in figures):
        here = [figure for figure in figures if figure.place == place]
        lines.append(f"{place}: {sum(figure.is_equal for figure in here)} of {len(here)} figures equal")
    lines.append(f"{sum(figure.is_equal for figure in figures)} of {len(figures)} figures equal")
    lines += [f"not as said: {figure}" for figure in wrong]
    sys.stdout.write("\n".join(lines) + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
