"""What a command says is one text: a terminal, Markdown and HTML have the same sentences and the same cells."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Callable, Iterator
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

import dse
from dse.cli import main
from dse.cli.main import run
from dse.questions.robust.robust import solve_robust
from dse.report.content.front.document import Document
from dse.report.content.front.pages import printed_page
from dse.report.dispatch import page_of
from dse.report.html import html_page
from dse.report.markdown import escaped, markdown_page
from dse.report.page import NOTHING, Listing, Page, Section, Table, Text
from dse.report.terminal import print_page
from dse.support.errors import UsageError

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
UNCERTAIN = "uncertainty: {threads.filter.compute_execution_time: {factor: 0.9 .. 1.5}}\n"
DESIGN = {"computer.type": "small", "can0.type": "can_500k", "filter.dispatch_protocol": "aperiodic",
          "control.period": "10 ms"}  # fmt: skip
CHOSEN = [part for name, option in DESIGN.items() for part in ("--design", f"{name} = {option}")]
VARY = "jitter of sensor_to_valve=1ms..40ms"
ANSWERS: dict[str, Callable[[], Any]] = {
    "solve": lambda: dse.solve("pump.yaml"),
    "solve without an answer": lambda: dse.solve("pump.yaml", max_jitter="5 ms"),
    "robust": lambda: solve_robust("pump.yaml"),
    "analyse": lambda: dse.analyse("pump.yaml", DESIGN, response_times=True),
    "check": lambda: dse.check("pump.yaml"),
    "explain": lambda: dse.explain("pump.yaml", max_jitter="5 ms"),
    "compare": lambda: dse.compare(dse.solve("pump.yaml"), dse.solve("pump.yaml", max_price="100 EUR")),
    "compare designs": lambda: dse.compare("r.json#1", "r.json#3"),
    "simulate": lambda: dse.simulate("pump.yaml", DESIGN, runs=2),
    "sweep": lambda: dse.sweep("pump.yaml", VARY, store=None),
    "sweep of an input": lambda: dse.sweep("pump.yaml", "processor_types.small.price=60 EUR,90 EUR", store=None),
    "sensitivity": lambda: dse.sensitivity("pump.yaml", DESIGN, samples=50),
    "verify": lambda: dse.verify("r.json"),
    "fit": lambda: dse.fit("delays.csv"),
    "fit of execution times": lambda: dse.fit("times.csv"),
    "sizes": lambda: dse.sizes("geometry_msgs/PoseArray", lengths={"poses": 32}),
}
COMMANDS = {
    "analyse": ["analyse", "pump.yaml", *CHOSEN],
    "check": ["check", "pump.yaml"],
    "compare": ["compare", "r.json#1", "r.json#2"],
    "explain": ["explain", "pump.yaml", "--max-jitter", "5 ms"],
    "fit": ["fit", "delays.csv"],
    "simulate": ["simulate", "pump.yaml", *CHOSEN, "--runs", "2"],
    "sizes": ["sizes", "geometry_msgs/PoseArray"],
    "solve": ["solve", "pump.yaml"],
    "sensitivity": ["sensitivity", "pump.yaml", *CHOSEN, "--samples", "50"],
    "sweep": ["sweep", "pump.yaml", "--vary", VARY, "--no-store"],
    "verify": ["verify", "r.json"],
}


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pump.yaml").write_text(PUMP.read_text(encoding="utf-8") + UNCERTAIN, encoding="utf-8")
    Path("delays.csv").write_text("size_bytes,min_us,max_us\n0,10,20\n100,12,24\n300,20,29\n", encoding="utf-8")
    Path("times.csv").write_text("thread,sample_us\nnav,10\nnav,14\nlog,3\nlog,9\n", encoding="utf-8")
    assert run(["solve", "pump.yaml", "-q", "--json", "r.json"]) == 0


def printed(page: Page) -> str:
    text = io.StringIO()
    print_page(Console(file=text, width=5000), page, every=True)
    return " ".join(text.getvalue().split())


def shown(page: str) -> str:
    """What a reader sees of a page."""
    body = page.partition("<body>")[2].partition('<script type="application/gzip"')[0]
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", body.replace("<wbr>", ""))).split())


def said(section: Section) -> Iterator[str]:
    for block in section.blocks:
        yield from [block.text] if isinstance(block, Text) else []
        yield from (
            (part for item in block.items for part in (item.label, item.text)) if isinstance(block, Listing) else []
        )
    for table in section.tables:
        yield from table.headings
        yield from (cell for row in table.rows for cell in row)


def is_in(said: str, text: str) -> bool:
    return " ".join(said.split()) in text


@pytest.mark.parametrize("name", ANSWERS)
def test_the_three_writers_say_the_same(name: str) -> None:
    page = page_of(ANSWERS[name]())
    terminal, markdown, html = printed(page), markdown_page(page), shown(html_page(page))
    read = " ".join(markdown.split())
    count = 0
    for section in page.sections:
        for text in said(section):
            assert is_in(escaped(text), read), (section.name, text)
            assert is_in(text, html), (section.name, text)
            if not section.is_for_files and text != NOTHING:
                assert is_in(text.removesuffix(".type"), terminal), (section.name, text)
            count += 1
    assert count > 5


@pytest.mark.parametrize("name", ["solve", "solve without an answer", "robust"])
def test_the_page_of_a_front_to_choose_on_says_what_is_printed(name: str) -> None:
    answer = ANSWERS[name]()
    dse.write_report(answer, "chosen.html")
    html = shown(Path("chosen.html").read_text(encoding="utf-8"))
    result = answer if name != "robust" else answer.robust
    first = result.front[0].id if result.front else None
    document = Document(result)
    for section in page_of(answer).sections:
        if section.name in ("summary", "basis", "robust") or section.name == f"alternative-{first}":
            for text in section.texts:
                label, _, rest = re.sub(r"^\s*(\S+( \S+)*)  +", r"\1: ", text).partition(
                    ": "
                )  # as a terminal aligns it
                parts = [label, *rest.rstrip(".").split("; ")]
                assert is_in(text, html) or all(is_in(part, html) for part in parts), text
        if section.name == "front":
            assert all(is_in(text, html) for text in said(section))
    for row in document.front_table.rows:
        assert all(is_in(cell, printed(printed_page(document, None))) for cell in row if cell != NOTHING)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_answers_writes_its_page(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    codes = {run([*COMMANDS[name], "--report", path]) for path in ("page.html", "page.md")}
    assert len(codes) == 1 and codes <= {0, 4}
    said = " ".join(capsys.readouterr().out.split())
    markdown = Path("page.md").read_text(encoding="utf-8")
    assert "<html" in Path("page.html").read_text(encoding="utf-8") and markdown.startswith("# ")
    paragraphs = [line for line in markdown.splitlines() if re.match(r"[A-Za-z*]", line)]
    assert any(is_in(line.strip("*"), said) for line in paragraphs)
    assert run([*COMMANDS[name], "--report", "page.pdf"]) == 2


def test_what_the_command_line_writes_is_what_python_writes() -> None:
    for name in ("analyse", "sweep", "solve", "check"):
        for path in ("page.html", "page.md"):
            assert run([*COMMANDS[name], "--report", path]) in (0, 4)
            shutil.move(path, f"theirs-{path}")
            answer = dse.analyse("pump.yaml", DESIGN) if name == "analyse" else ANSWERS[name]()
            assert dse.write_report(answer, path) == [Path(path)]
            assert Path(path).read_text() == Path(f"theirs-{path}").read_text()
    with pytest.raises(UsageError, match="the report of this answer is a page"):
        dse.write_report(dse.check("pump.yaml"), "folder")


def test_a_report_takes_a_path_or_a_folder() -> None:
    """`--report` of the studies alone still writes a folder, whatever stands behind it."""
    assert run(["solve", "--report", "pump.yaml", "-q", "-o", "all"]) == 0
    assert {path.name for path in Path("all").iterdir()} == {f"pump.{end}" for end in ("html", "md", "csv", "json")}
    assert run(["solve", "--report", "one.HTML", "pump.yaml", "-q"]) == 0
    assert Path("one.HTML").is_file() and not Path("reports").exists()


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_a_terminal_has_every_cell_in_whatever_room_there_is(width: int) -> None:
    page = page_of(dse.sensitivity("pump.yaml", DESIGN, samples=50))
    text = io.StringIO()
    print_page(Console(file=text, width=width), page, every=True)
    assert max(map(len, text.getvalue().splitlines())) <= width
    letters = re.sub(r"\s", "", text.getvalue())
    table = page.sections[0].tables[0]
    assert isinstance(table, Table) and table.rows
    for row in table.rows:
        assert all(part in letters for cell in row[1:4] for part in cell.split())


@pytest.mark.parametrize("command", ["solve", "sweep", "sensitivity", "explain", "analyse"])
@pytest.mark.parametrize("given", [["--report", "x.txt", "pump.yaml"], ["pump.yaml", "--report=x.txt"]])
def test_a_path_that_is_no_page_is_named(command: str, given: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, *given, *(["--vary", "price=1EUR..2EUR"] if command == "sweep" else [])]) == 2
    assert "x.txt: a report is HTML or Markdown: a path that ends in .html" in capsys.readouterr().err


def test_every_command_that_answers_is_here() -> None:
    """The others write files alone: problems, designs, schemas, and reports of answers that there are."""
    assert set(COMMANDS) == set(main.COMMANDS) - {"report", "export", "import", "new", "schema"}
