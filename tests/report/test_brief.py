"""The answer of `dse solve` on one screen, 100 columns and 40 lines: proof first, what differs, what to choose."""

from __future__ import annotations

import io
import re
from contextlib import nullcontext
from dataclasses import replace
from itertools import product
from pathlib import Path
from shutil import copytree

import pytest
from rich.console import Console

import dse
from dse.cli.main import run
from dse.examples.shipped import example_files, example_path
from dse.report import terminal
from dse.report.content.front.document import Document
from dse.report.content.front.first_screen import TOP, first_page
from dse.report.content.sensitivity import robust_section
from dse.report.page import Page, Section, Table, Text, listing
from dse.report.terminal import page_height, print_page
from tests.cli.test_time_limits import jumping
from tests.helpers.effort import LONG, few
from tests.helpers.small import without_waiting
from tests.helpers.support import PARTS

COLUMNS, LINES = 100, 40
console = Console(file=io.StringIO(), width=COLUMNS)


def printed(result: dse.Result, top: int | None = TOP) -> list[str]:
    out = io.StringIO()
    print_page(Console(file=out, width=COLUMNS), first_page(Document(result), top))
    return out.getvalue().splitlines()


@pytest.mark.parametrize("path", example_files(), ids=lambda path: path.stem)
def test_it_fits_a_screen_and_begins_with_the_proof(path: Path) -> None:
    problem = dse.load(path)
    problem = problem.ask(fix={} if LONG else PARTS.get(path.stem, {}))  # a part of a front is quicker
    lines = printed(dse.solve(problem))
    assert len(lines) <= LINES
    assert any(line.startswith("Front    complete, proved: ") for line in lines[1:5])
    assert any(line.startswith(("Recommended  #", "No recommendation: ", "The only design (#")) for line in lines)
    assert not any(line.endswith(" ") for line in lines)


def test_a_large_problem_does_too() -> None:
    lines = printed(dse.solve(dse.loads(dse.random_problem(30, 1, 2, "robot")), processing="execution_time"))
    assert len(lines) <= LINES


MIDDLE = {
    "analyse": ["p.yaml"],
    "analyse with response times": ["p.yaml", "--response-times"],
    "analyse what breaks": ["p.yaml", "--max-utilisation", "20 %", "--max-jitter", "90 ms"],
    "check": ["p.yaml"],
    "compare": ["r.json#1", "baseline"],
    "compare results": ["r.json", "r.json"],
    "explain": ["p.yaml", "--require", "price <= 10 EUR"],
    "sensitivity": ["p.yaml", "--time-limit", "2000"],  # looks at a clock that jumps
    "simulate": ["p.yaml", "--runs", "1", "--duration", "200 ms"],
    "sweep": ["p.yaml", "--no-store", "--workers", "1", "--vary", "jitter of flow_1=50ms..90ms"],
    "verify": ["r.json"],
}
FIRST = ("MEETS EVERY", "VIOLATED  ", "47 decisions", "INFEASIBLE  ", "Of 6 points", "VERIFIED", "WITHIN BOUNDS",
         "Front  ", "OUTSIDE BOUNDS", "Design: ", "No design below")  # fmt: skip


@pytest.fixture(scope="module")
def middle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A system of 30 threads and five flows, and its front."""
    folder = tmp_path_factory.mktemp("middle")
    (folder / "p.yaml").write_text(without_waiting(dse.random_problem(30, 1, 2, "robot")), encoding="utf-8")
    assert run(["solve", str(folder / "p.yaml"), "-q", "--json", str(folder / "r.json")]) == 0
    return folder


@pytest.mark.parametrize("name", MIDDLE)
def test_every_answer_about_a_middle_system_is_on_one_screen(
    name: str, middle: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The answer first, and one line less than the screen has, for the prompt; nothing is wider than it."""
    monkeypatch.chdir(middle)
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    with jumping(1.0, monkeypatch) if "--time-limit" in MIDDLE[name] else nullcontext():
        assert run([name.split()[0], *MIDDLE[name]]) in (0, 4, 5)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < LINES and max(map(len, lines)) <= COLUMNS
    told = " ".join(lines[:5])
    assert any(text in told for text in FIRST) or "decisions differ" in told
    if name in ("analyse", "check", "compare", "simulate"):
        assert any("--all" in line for line in lines)
        assert run([name, *MIDDLE[name], "--all"]) in (0, 4)
        assert len(capsys.readouterr().out.splitlines()) > len(lines)


@pytest.mark.parametrize("width", few([80, 100]))
@pytest.mark.parametrize("name", ["solve", *MIDDLE])
def test_no_table_of_a_command_loses_a_cell(
    name: str, width: int, middle: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each word of each cell of each table stands in what is printed of the table; so do the headings.

    What a table leaves out of itself is told: rows below it ("and 3 more"), columns that are told elsewhere.
    """
    tell, checked = terminal._print_table, 0

    def words_of(text: str) -> set[str]:
        return set(re.split(r"[\s,;:.#]+", text.replace("[", " [").replace(".type", "")))

    def checking(console: Console, table: Table, *, every: bool) -> None:
        nonlocal checked
        with console.capture() as said:
            tell(console, table, every=every)
        spared = set() if every else set(table.spare)
        cut = range(table.wide, len(table.headings)) if table.wide is not None and table.told and not every else ()
        kept = [at for at in range(len(table.headings)) if at not in spared and at not in cut]
        rows = terminal._first(table.rows, None if every else table.brief)
        headings = ["" if at == table.label else name for at, name in enumerate(table.headings)]
        for cells in (*rows, *([headings] if table.wide is None else [])):
            wanted = {word for at in kept for word in words_of(cells[at]) if word not in terminal.EMPTY}
            assert wanted <= words_of(said.get()), (wanted - words_of(said.get()), said.get())
            checked += 1
        tell(console, table, every=every)

    monkeypatch.chdir(middle)
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(terminal, "_print_table", checking)
    arguments = ["p.yaml"] if name == "solve" else MIDDLE[name]
    for more in ([], ["--all"]) if name != "verify" else ([],):
        with jumping(1.0, monkeypatch) if "--time-limit" in arguments else nullcontext():
            assert run([name.split()[0], *arguments, *more]) in (0, 4, 5)
        lines = capsys.readouterr().out.splitlines()
        assert lines and max(map(len, lines)) <= width and not any(line.endswith(" ") for line in lines)
    assert checked or name in ("verify", "explain")


def test_the_price_of_insisting_is_on_one_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With wide cells and a long comparison, which gives way."""
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    assert run(["solve", str(example_path("move_base")), "--insist", "--workers", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < LINES and max(map(len, lines)) <= COLUMNS
    assert any("insisting on" in line for line in lines)
    assert run(["solve", str(example_path("move_base")), "--insist", "--workers", "1", "--top", "8"]) == 0
    assert len(capsys.readouterr().out.splitlines()) > LINES


def test_a_fit_is_on_one_screen_and_tells_the_gravest_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four transports with a dozen remarks each; what is said of all is said once, and the rest is in the catalogue."""
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    rows = [
        f"{size},{platform},{name},{700 + size * at % 7000},"
        f"{9400 + size * at % 9001 + (99000 if 3000 < size < 7500 else 0)}"
        for at, (platform, name) in enumerate(product(("small", "large"), ("ipc", "udp")), 3)
        for size in range(76, 14021, 560)
    ]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(["size_bytes,platform,transport,min_us,max_us", *rows]), encoding="utf-8")
    assert run(["fit", str(path), "--round-trip"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < LINES and max(map(len, lines)) <= COLUMNS
    told = [line for line in lines if " on small" in line]
    assert "ipc on small, udp on small, ipc on large, udp on large: the samples lie much further" in told[0]
    assert any("more (--all)" in line for line in lines) and lines[-1].startswith("-o FILE writes the catalogue")
    assert run(["fit", str(path), "--round-trip", "--all"]) == 0
    every = capsys.readouterr().out
    assert "bus_types:" in every and every.count("are halves of round trips") == 1 + 4  # the catalogue says it of each
    few = tmp_path / "few.csv"
    few.write_text("size_bytes,min_us,max_us\n0,10,20\n10,20,30\n20,30,40\n", encoding="utf-8")
    assert run(["fit", str(few)]) == 0 and "bus_types:" in capsys.readouterr().out


def test_each_kind_of_design_has_a_row_and_what_is_minor_a_line(robot: dse.Result) -> None:
    lines = printed(robot)
    rows = [line.split() for line in lines if line.startswith("#")][1:]
    assert [(row[0], "Spectra" if "Spectra" in row else "RT101", row[-1]) for row in rows] == [
        ("#1", "Spectra", "4"), ("#4", "Spectra", "4"), ("#10", "Spectra", "4"), ("#15", "RT101", "3"),
    ]  # fmt: skip
    said = " ".join(lines)
    assert (
        "Within each kind: can_250k, can_500k, can_1m: jitter 0.144 to 0.252 ms less, price 5 to 40 EUR more." in said
    )
    opened = printed(robot, None)
    assert all(any(line.split()[1:2] == [str(point.id)] for line in opened) for point in robot.front)


def test_top_says_how_many(robot: dse.Result) -> None:
    lines = printed(robot, 1)
    assert any("14 more designs, ranked lower" in line for line in lines)
    assert len(lines) < len(printed(robot, 3))


@pytest.fixture(scope="module")
def robot() -> dse.Result:
    return dse.solve(example_path("inmark"), max_jitter="20 ms")


def test_explain_and_all(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    said = {}
    for option in ((), ("--explain",), ("--all",)):
        assert run(["solve", str(example_path("starter")), *option]) == 0
        said[option] = capsys.readouterr().out
    assert "Tightest requirement" in said[("--explain",)] and "Tightest requirement" not in said[()]
    assert "Within each kind" in said[()] and "Within each kind" not in said[("--all",)]


def test_an_infeasible_one_says_why() -> None:
    lines = printed(dse.solve(example_path("inmark"), max_jitter="1 ms"))
    assert lines[1].startswith("INFEASIBLE  proved: ")
    assert len(lines) <= LINES


def test_the_verdict_on_a_design_comes_before_its_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["analyse", str(example_path("inmark")), "--max-jitter", "20ms"]) == 4
    lines = capsys.readouterr().out.splitlines()
    first = next(at for at, line in enumerate(lines) if line.startswith("VIOLATED  "))
    assert first < next(at for at, line in enumerate(lines) if line.startswith("Requirements"))
    assert "jitter of gnss_to_sprayer <= 20 ms" in "".join(lines[first : first + 2])


def test_many_rules_have_a_line_each(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rules = [f"filter.period <= {period} ms" for period in (20, 21, 22, 23)]
    text = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
    text = "\n".join(line for line in text.splitlines() if not line.startswith("rules:")) + f"\nrules: {rules}\n"
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    assert run(["check", str(tmp_path / "p.yaml")]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    at = lines.index("Rules (4):")
    assert lines[at + 1 : at + 5] == rules


def test_what_all_alternatives_share_is_a_line() -> None:
    lines = printed(dse.solve(example_path("inmark"), max_jitter="20 ms"), None)
    assert "Same in every design: " in " ".join(lines)


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_it_says_that_no_message_waits_for_a_bus(processing: str, tmp_path: Path) -> None:
    """As long as latencies count no waiting for buses, every answer about a flow says so; others need not."""
    said = "not counted: "
    inmark = example_path("inmark")
    assert said in " ".join(printed(dse.solve(inmark, processing=processing, max_jitter="20 ms")))
    text = inmark.read_text(encoding="utf-8").replace("  - jitter of gnss_to_sprayer <= 100 ms\n", "")
    copytree(inmark.parent / "catalogues", tmp_path / "catalogues")
    (tmp_path / "inmark.yaml").write_text(text, encoding="utf-8")
    found = printed(dse.solve(tmp_path / "inmark.yaml", processing=processing, minimise=["price"]))
    assert said not in " ".join(found) and any("design (#1)" in line for line in found)


def test_tables_give_up_rows_until_the_page_fits() -> None:
    """The longest first; what is left out is told, and a table that is whole in `brief` stays so."""
    long, short = (
        Table(name, ("a",), tuple((f"{name} {row}",) for row in range(many)), brief=10, rest="and {} more (--all)")
        for name, many in (("long", 30), ("short", 4))
    )
    lost = listing([f"note {number}" for number in range(9)], brief=6)
    page = Page("title", "lead", (Section("one", "One", (long, short, *lost)),))

    def told(lines: int | None) -> list[str]:
        out = io.StringIO()
        print_page(Console(file=out, width=COLUMNS), page, lines=lines)
        return out.getvalue().splitlines()

    whole, cut = told(None), told(26)
    assert len(cut) == 26 < len(whole) == page_height(console, page)
    [more] = [line for line in cut if line.startswith("and ") and "note" not in line]
    rows = sum(line.strip().startswith("long ") for line in cut)
    assert more == f"and {30 - rows} more (--all)" and sum(line.strip().startswith("short ") for line in cut) == 4
    assert len(told(1)) > 1  # two rows are left of each table, one line of a list


def test_what_robustness_costs_is_told_in_brief() -> None:
    data = {
        "objectives": [{"name": "price", "unit": "EUR"}],
        "front": [],
        "robust": {
            "inputs": {f"threads.t{number}.period": "1 ms .. 2 ms" for number in range(5)},
            "lost": [], "nominal_front": [], "entered": [], "kept": [], "price": {},
        },
    }  # fmt: skip
    brief, whole = (robust_section(data, is_brief=is_brief).blocks for is_brief in (True, False))
    told = [block.text for block in brief if isinstance(block, Text)]
    assert (
        "What may vary: threads.t0.period (1 ms .. 2 ms), threads.t1.period (1 ms .. 2 ms) and 3 more (--explain)."
        in told
    )
    assert any(isinstance(block, Table) and len(block.rows) == 5 for block in whole)


def test_no_cell_is_lost_in_whatever_room_there_is() -> None:
    """As columns, as columns with wrapped cells, as a paragraph for each row; decisions beside, or below."""
    flows = Table("", ("flow", "data", "verdict"), (("brake", "10", "within the analysed bounds of it"),), (1,))
    fronts = Table("", ("rank", "#", "computer.type"), (("1", "7", "large"),), wide=2, label=1)
    for width in (160, 40, 30, 12):
        for table in (flows, fronts):
            out = io.StringIO()
            print_page(Console(file=out, width=width), Page("", "", (Section("one", "One", (table,)),)))
            said = "".join(out.getvalue().split())
            assert all(word in said for row in table.rows for cell in row for word in cell.split())
            assert max(map(len, out.getvalue().splitlines())) <= width


def test_a_tie_is_said_and_nothing_is_chosen() -> None:
    said = " ".join(" ".join(printed(dse.solve(example_path("starter")))).split())
    assert "No recommendation: #1 and #4 tie within 1 % (scores 0.926 and 0.931)." in said
    assert "#1 (large, can_250k) against #4 (small, can_250k): jitter -1.861 ms, price +180 EUR." in said
    assert "Recommended" not in said


def test_one_design_has_no_ranking_words() -> None:
    pump = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
    lines = printed(dse.solve(pump, max_jitter="7 ms"))
    assert any(
        line.startswith("The only design (#1): jitter of sensor_to_valve 6.934 ms, price 255 EUR") for line in lines
    )
    assert not any(word in " ".join(lines) for word in ("Recommended", "lowest", "score", "No recommendation: the"))


def test_the_nearest_limit_is_that_of_a_core_where_a_core_is_nearest(robot: dse.Result) -> None:
    """Core 2 at 64.752 % of 70 %, not a bus with a fifth of its limit left."""
    near = Document(robot).reasoner.margins(next(point for point in robot.front if point.id == 4))[0]
    assert (near.thread, near.requirement.metric.name) == ("core 2", "utilisation of computer")


def test_what_is_unbounded_or_overloaded_is_a_warning_and_no_choice(tmp_path: Path) -> None:
    text = """
dse: 1
name: Over
processor_types: {small: {price: 60 EUR}}
processors: {computer: {type: small}}
devices: {sensor: {period: 10 ms}, valve: {}}
threads:
  filter: {processor: computer, dispatch_protocol: aperiodic, compute_execution_time: 7 ms}
  control: {processor: computer, period: 10 ms, compute_execution_time: 7 ms}
connections: {a: {from: sensor, to: filter}, b: {from: filter, to: control}, c: {from: control, to: valve}}
flows: {main: {path: [sensor, filter, control, valve]}}
objectives: [minimise jitter of main, minimise price]
"""
    lines = printed(dse.solve(dse.loads(text), overload="allowed", processing="response-time"))
    assert lines[0] == "Over: overload allowed"
    assert lines[1:3] == ["WARNING  computer is overloaded: 140 % of 100 %.", "WARNING  Jitter of main is unbounded."]
    assert not any(word in " ".join(lines) for word in ("Recommended", "lowest"))


def test_a_stopped_search_says_best_found_and_how_good_a_design_may_be() -> None:
    found = dse.solve(dse.loads(dse.random_problem(30, 1, 2, "robot")), time_limit_s=0.6)
    if found.status == "complete":  # a fast machine
        found = replace(found, status="incomplete")
    lines = printed(found)
    assert any(line.startswith("INCOMPLETE  ") for line in lines) and lines[-1].endswith("exit code 5")
    assert "Recommended" not in " ".join(lines)


def test_a_search_whose_time_was_over_before_its_first_call_says_so() -> None:
    result = dse.solve(dse.load(example_path("starter")))
    assert "solver call" in " ".join(printed(result))
    stopped = replace(result, status="incomplete", search=replace(result.search, solver_calls=0))
    assert "The time was over before the first solver call, as making the model comes first." in " ".join(
        printed(stopped)
    )
