"""The answer of `dse solve` on one screen, 100 columns and 40 lines: proof first, what differs, what to choose."""

from __future__ import annotations

import io
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from shutil import copytree

import pytest
from rich.console import Console

import dse
from dse.cli.main import run
from dse.examples.shipped import example_files, example_path
from dse.report.content.document import Document
from dse.report.content.front import TOP, brief_page, fitting_page
from dse.report.content.sensitivity import robust_section
from dse.report.page import Page, Section, Table, Text, listing
from dse.report.terminal import page_height, print_page
from tests.cli.test_time_limits import jumping

COLUMNS, LINES = 100, 40
console = Console(file=io.StringIO(), width=COLUMNS)


def printed(result: dse.Result, top: int | None = TOP) -> list[str]:
    out = io.StringIO()
    print_page(Console(file=out, width=COLUMNS), brief_page(Document(result), top))
    return out.getvalue().splitlines()


@pytest.mark.parametrize("path", example_files(), ids=lambda path: path.stem)
def test_it_fits_a_screen_and_begins_with_the_proof(path: Path) -> None:
    problem = dse.load(path)
    if path.stem == "inmark_clock":  # a part of its front is quicker
        problem = problem.ask(fix={"gnss_provider.period": "20 ms", "nav_controller.offset": "4 ms"})
    lines = printed(dse.solve(problem))
    assert len(lines) <= LINES
    assert any(line.startswith("Pareto front, proved complete") for line in lines[1:3])
    assert any(line.startswith("Choose #1,") for line in lines)


def test_a_large_problem_does_too() -> None:
    lines = printed(dse.solve(dse.loads(dse.random_problem(30, 1, 2, "robot"))))
    assert len(lines) <= LINES
    assert any("further decisions: --explain" in line for line in lines)


MIDDLE = {
    "analyse": ["p.yaml"],
    "analyse with response times": ["p.yaml", "--response-times"],
    "analyse what breaks": ["p.yaml", "--max-utilisation", "20 %", "--max-jitter", "90 ms"],
    "check": ["p.yaml"],
    "compare": ["r.json#1", "baseline"],
    "compare results": ["r.json", "r.json"],
    "explain": ["p.yaml", "--require", "price <= 10 EUR"],
    "sensitivity": ["p.yaml", "--time-limit", "2000"],  # looks at a clock that jumps
    "simulate": ["p.yaml", "--runs", "1", "--duration", "1 s"],
    "sweep": ["p.yaml", "--no-store", "--workers", "1", "--vary", "jitter of flow_1=50ms..90ms"],
    "verify": ["r.json"],
}
FIRST = ("Verdict: ", "47 decisions", "remark: ", "Infeasible, proved", "Of 6 points", "Verified: ", "No observation",
         "Outside the analysed", "Design: ", "No design below")  # fmt: skip


@pytest.fixture(scope="module")
def middle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A system of 30 threads and five flows, and its front."""
    folder = tmp_path_factory.mktemp("middle")
    (folder / "p.yaml").write_text(dse.random_problem(30, 1, 2, "robot"), encoding="utf-8")
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


def test_the_price_of_insisting_is_on_one_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With wide cells and a long comparison, which gives way."""
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    assert run(["solve", str(example_path("move_base")), "--insist", "--workers", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < LINES and max(map(len, lines)) <= COLUMNS
    assert any(line.startswith("  insisting on") for line in lines)
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


def test_near_identical_ones_are_one_line_that_can_be_opened(robot: dse.Result) -> None:
    lines = printed(robot)
    first = "#1 with canbus0 can_250k … can_1m: 11.833 … 11.725 ms, 1 045 … 1 080 EUR, 56.702 % (#2, #3, #7)"
    assert first in lines
    told = {
        number for line in lines for number in range(1, 16) if f"#{number}" in line or f"{number}   {number}" in line
    }
    assert told == set(range(1, 16))
    opened = printed(robot, None)
    rows = [line.split()[:2] for line in opened]
    assert all([str(rank), str(number)] in rows for rank, number in ((p.rank, p.id) for p in robot.front[:3]))
    assert not any(line.startswith("#1 with") for line in opened)


def test_top_says_how_many(robot: dse.Result) -> None:
    lines = printed(robot, 1)
    assert any("ranked lower" in line for line in lines)
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
    assert "#1 with" in said[()] and "#1 with" not in said[("--all",)]


def test_an_infeasible_one_says_why() -> None:
    lines = printed(dse.solve(example_path("inmark"), max_jitter="1 ms"))
    assert lines[1].startswith("Infeasible, proved")
    assert len(lines) <= LINES


def test_the_verdict_on_a_design_comes_before_its_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["analyse", str(example_path("inmark")), "--max-jitter", "20ms"]) == 4
    lines = capsys.readouterr().out.splitlines()
    first = next(at for at, line in enumerate(lines) if line.startswith("Verdict: breaks "))
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
    lines = printed(dse.solve(example_path("inmark"), max_jitter="20 ms"))
    assert "In all of them: ser1 rs232, eth0 none and 4 more (--explain)." in [line.rstrip() for line in lines]


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
def test_it_says_that_no_message_waits_for_a_bus(processing: str, tmp_path: Path) -> None:
    """As long as latencies count no waiting for buses, every answer about a flow says so; others need not."""
    said = "Waiting for a bus is not counted."
    inmark = example_path("inmark")
    assert said in " ".join(printed(dse.solve(inmark, processing=processing, max_jitter="20 ms")))
    text = inmark.read_text(encoding="utf-8").replace("  - jitter of gnss_to_sprayer <= 100 ms\n", "")
    copytree(inmark.parent / "catalogues", tmp_path / "catalogues")
    (tmp_path / "inmark.yaml").write_text(text, encoding="utf-8")
    found = printed(dse.solve(tmp_path / "inmark.yaml", processing=processing, minimise=["price"]))
    assert said not in " ".join(found) and any(line.startswith("Choose #1,") for line in found)


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


def test_so_many_alternatives_as_fit(robot: dse.Result) -> None:
    def fits(lines: int, page: Page) -> bool:
        return page_height(console, page) <= lines

    pages = [fitting_page(Document(robot), TOP, partial(fits, lines)) for lines in (39, 33, 25)]
    shown = [len(next(block for block in page.sections[0].blocks if isinstance(block, Table)).rows) for page in pages]
    assert shown == [4, 2, 1]


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


def test_a_column_that_is_told_beside_a_table_keeps_its_name() -> None:
    """The verdict of a simulated flow is no decision, and a flow has no number; alternatives have both."""
    flows = Table("", ("flow", "data", "verdict"), (("brake", "10", "within"),), wide=2, told=0)
    fronts = Table("", ("rank", "#", "computer.type"), (("1", "7", "large"),), wide=2, label=1)
    said = {}
    for name, table in (("flows", flows), ("fronts", fronts)):
        for width in (160, 12):
            out = io.StringIO()
            print_page(Console(file=out, width=width), Page("", "", (Section("one", "One", (table,)),)))
            said[name, width] = " ".join(out.getvalue().split())
    assert "verdict" in said["flows", 160] and said["flows", 160].endswith("brake 10 within")
    assert "decisions" in said["fronts", 160] and said["fronts", 160].endswith("computer large")
    assert said["flows", 12].startswith("brake: ") and "#7: " in said["fronts", 12]


def test_a_choice_that_breaks_a_requirement_with_response_times_says_so_in_the_same_breath() -> None:
    """What is first by its figures alone, which one to take if that does not hold: on screen and page."""

    def words(lines: list[str]) -> str:
        return " ".join(" ".join(lines).split())

    found = dse.solve(example_path("inmark"), max_jitter="20ms")
    first = found.front[0]
    said = "But with response times it breaks jitter of gnss_to_sprayer <= 20 ms (29.294 ms)"
    lines = printed(found)
    at = next(number for number, line in enumerate(lines) if line.startswith("Choose #1,"))
    near = words(lines[at : at + 6])
    assert said in near
    assert "is the first that keeps" not in near
    assert said in " ".join(Document(found).summary)
    kept = replace(found.contended[str(first.id)], broken=())
    other = replace(found, contended={**found.contended, str(found.front[2].id): kept})
    assert f"#{found.front[2].id} is the first that keeps every requirement." in words(printed(other))
    assert "But with response times" not in words(printed(replace(other, contended={str(first.id): kept})))


def test_a_search_whose_time_was_over_before_its_first_call_says_so() -> None:
    result = dse.solve(dse.load(example_path("starter")))
    assert "solver call" in " ".join(printed(result))
    stopped = replace(result, status="incomplete", search=replace(result.search, solver_calls=0))
    assert "The time was over before the first solver call, as making the model comes first." in " ".join(
        printed(stopped)
    )
