"""Reports without a browser: what the files say, that they are small and whole, and that names stay text."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.console import Console

import dse
from dse.answers.result import Result
from dse.answers.tables.display import counted
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.report.content.analyse import tightest_limits
from dse.report.content.front.document import Document
from dse.report.content.front.pages import printed_page
from dse.report.html import html_report
from dse.report.markdown import escaped
from dse.report.output import figure_files, markdown_report, report_files
from dse.report.page import NOTHING
from dse.report.plots.design import usage_records, waterfall
from dse.report.plots.front import scatter
from dse.report.terminal import print_page
from dse.report.words.reasons import GAPS, REDUCED
from dse.support.theme import DARK, LIGHT
from tests.answers.hostile import NAMES, hostile_result
from tests.helpers import effort


class Reader(HTMLParser):
    """Tags, attributes and texts of a page; scripts and styles apart."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            assert not name.startswith("on"), (tag, name)
            if name == "id":
                self.ids.append(value or "")
            if name in ("src", "href", "action", "data"):
                self.addresses.append(value or "")

    def handle_data(self, data: str) -> None:
        if not self.tags or self.tags[-1] not in ("script", "style"):
            self.texts.append(data)


@pytest.fixture(scope="module")
def robot() -> Result:
    return dse.solve(example_path("inmark"))


def test_the_page_needs_nothing_else(page: Reader) -> None:
    assert page.addresses
    assert all(address.startswith("#") for address in page.addresses)
    assert not set(page.tags) & {"link", "img", "iframe", "object", "embed", "base"}
    assert len(page.ids) == len(set(page.ids))


def test_the_page_says_what_it_rests_on(page: Reader, robot: Result) -> None:
    text = " ".join(" ".join(page.texts).split())
    for said in (REDUCED, *GAPS, "profile dse", "seed 0", "Pareto front, proved complete", robot.search.solver):
        assert said in text, said
    for assumption in robot.space.assumptions:
        assert " ".join(assumption.split()) in text


@pytest.fixture(scope="module")
def files(robot: Result) -> dict[str, str]:
    return dict(report_files(Document(robot)))


@pytest.fixture(scope="module")
def page(files: dict[str, str]) -> Reader:
    return Reader(files["inmark.html"])


def test_the_same_result_gives_the_same_files(robot: Result, files: dict[str, str]) -> None:
    assert dict(report_files(Document(robot))) == files


def test_a_front_of_200_points_stays_below_2_mb(robot: Result) -> None:
    points = 200 if effort.LONG else 101  # from 100 on the library is packed
    many = [
        replace(point, id=number, objectives={name: value + number for name, value in point.objectives.items()})
        for number, point in enumerate((robot.front * 6)[:points], start=1)
    ]
    large = replace(robot, front=tuple(many))
    # points that differ more, of problems three times as large, take twice as much
    assert len(html_report(Document(large)).encode()) < 600_000 + 2_000 * points


def test_markdown_has_every_alternative(robot: Result) -> None:
    text = markdown_report(Document(robot))
    rows = re.findall(r"^\| +(\d+=?) +\| +(\d+) +\|", text, re.MULTILINE)
    assert [int(number) for _, number in rows] == [point.id for point in robot.front]
    assert "The other 36 alternatives are in the table above" in text


def test_shares_differ_by_percentage_points(robot: Result) -> None:
    rows = [row for item in Document(robot).alternatives for row in item.metrics.rows if row[1].endswith("%")]
    assert {row[0] for row in rows} == {"utilisation of computer", "busy of ser1", "busy of eth0"}
    assert all(row[3].endswith((" percentage points", " 1 percentage point")) for row in rows)


def test_an_empty_slot_has_no_limit(robot: Result, capsys: pytest.CaptureFixture[str]) -> None:
    requirement = "load of eth0 <= 50 %"
    table = Document(robot).alternatives[0].requirements
    row = next(row for row in table.rows if row[0] == requirement)
    assert row[1:] == ("\N{EN DASH}", "\N{EN DASH}", "\N{EN DASH}", "holds: the slot is empty")
    assert run(["analyse", str(example_path("inmark")), "--all"]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if requirement in line)
    assert line.split(requirement)[1].split() == [NOTHING, NOTHING, NOTHING, "holds:", "the", "slot", "is", "empty"]


LONG = "a_worker_with_a_name_that_no_plot_has_room_for_in_one_line"
ONE_OBJECTIVE = f"""
dse: 1
name: One
processor_types: {{slow: {{}}, fast: {{}}}}
bus_types: {{wires: {{bandwidth: 1 Mbit/s}}}}
processors: {{cpu: {{type: [slow, fast]}}, spare: {{type: slow}}}}
buses: {{{", ".join(f"b{number}: {{type: wires}}" for number in range(5))}}}
devices: {{source: {{period: 10 ms}}}}
threads: {{{LONG}: {{processor: cpu, period: 10 ms, compute_execution_time: {{slow: 4 ms, fast: 1 ms}}}}}}
connections: {{wire: {{from: source, to: {LONG}, data_size: 8 B, bus: b4}}}}
flows: {{main: {{path: [source, {LONG}]}}}}
objectives: [minimise latency of main]
"""


def test_one_objective_is_not_plotted_against_itself() -> None:
    result = dse.solve(dse.loads(ONE_OBJECTIVE))
    document = Document(result)
    plot = scatter(result, document.records, 1, None)
    assert plot.height < 110 and sum("<circle class='f-c1'" in line for line in plot.elements) == 1
    assert plot.description == "latency of main [ms] across; 1 alternative."
    assert [record["n0"] for record in document.records] == [1.0]  # the only value is the best one
    page = html_report(document)
    assert "Pareto scatter" not in page.partition('id="data"')[0]
    assert any("scatter" in name for name, _ in figure_files(document, ["svg"]))


def test_long_names_leave_room_for_their_figures() -> None:
    flow = Document(dse.solve(dse.loads(ONE_OBJECTIVE))).alternatives[0].flows[0]
    drawn = "".join(waterfall(flow.source, flow.records).elements)
    assert re.findall(r"<text class='rim'[^>]*>([^<]*)", drawn) == [
        "a_worker_with_a_…m_for_in_one_line · 0 ms to 10 ms",
        "a_worker_with_a_…om_for_in_one_line · 1 ms to 1 ms",
    ]
    assert {row["label"] for row in flow.records} == {LONG}


def test_each_core_is_a_bar_with_its_threads_and_its_limit() -> None:
    """300, 200 and 100 us every ms are 30, 20 and 10 % of a core; nothing runs on the third and fourth core."""
    run = "period: 1 ms, processor: computer, core"
    text = f"""
dse: 1
name: Cores
processor_types: {{quad: {{cores: 4}}}}
processors: {{computer: {{type: quad}}}}
threads:
  a: {{{run}: 1, compute_execution_time: 300 us}}
  b: {{{run}: 2, compute_execution_time: 200 us}}
  c: {{{run}: 1, compute_execution_time: 100 us}}
requirements: [utilisation of computer <= 70 %, utilisation of core 1 of computer <= 50 %]
objectives: [minimise utilisation of computer]
"""
    found = dse.analyse(dse.loads(text))
    records = usage_records(found.processors, found.buses, tightest_limits(found))
    assert [(row["name"], row["part"], row["share"], row["limit"]) for row in records] == [
        ("core 1 of computer", "a", 30.0, 50.0),
        ("core 1 of computer", "c", 10.0, 50.0),
        ("core 2 of computer", "b", 20.0, 70.0),
        ("cores 3, 4 of computer", "nothing", 0.0, None),
    ]
    assert records[0]["title"] == "core 1 of computer (quad) · 40 %, limit 50 %"


def test_json_has_every_alternative_and_its_reasons(files: dict[str, str]) -> None:
    data = json.loads(files["inmark.json"])
    assert len(data["front"]) == 39
    assert all(point["reasons"]["Tightest requirement"] for point in data["front"])
    assert len(list(csv.reader(io.StringIO(files["inmark.csv"])))) == 40


def test_figures_are_made_without_a_browser(robot: Result) -> None:
    files = dict(figure_files(Document(robot), ["svg"], 4))
    names = {name.rpartition(".")[0] for name in files}
    assert names == {
        "inmark-scatter",
        "inmark-parallel",
        "inmark-4-latency-1",
        "inmark-4-latency-2",
        "inmark-4-usage",
        "inmark-4-architecture",
        "inmark-4-deadlines",
    }
    for name, content in files.items():
        assert isinstance(content, str) and content.startswith("<svg") and "var(--" not in content, name
        ElementTree.fromstring(content)


def test_an_infeasible_result_has_a_report_too() -> None:
    result = dse.solve(example_path("inmark"), max_jitter="1us")
    text = html_report(Document(result))
    assert "Infeasible: no design meets every requirement and rule" in text
    markdown = markdown_report(Document(result))
    assert markdown.startswith("# Intelligent Marking")
    for said in (" ".join(Reader(text).texts), markdown):  # what the terminal says
        assert "No design meets this:" in said
        assert "(caller): the closest is" in said or "(command line): the closest is" in said
    assert list(figure_files(Document(result), ["svg"])) == []


def test_hostile_names_are_text_in_every_file() -> None:
    result = hostile_result()
    files = {name.rpartition(".")[2]: text for name, text in report_files(Document(result))}
    page = Reader(files["html"])
    assert page.tags.count("script") == 2
    assert not set(page.tags) & {"img", "iframe", "object"}
    text = " ".join(page.texts)
    for name in NAMES.values():
        assert name in text, name
    markdown = files["md"]
    assert not re.search(r"<(?!/?(details|summary)>)", markdown)
    assert "](http" not in markdown.replace("\\]", "")
    assert "https://" not in markdown
    for row in csv.reader(io.StringIO(files["csv"])):
        assert not [cell for cell in row if cell[:1] in "=+-@" and cell and not cell.lstrip("-").isdigit()]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("# no heading", "&#35; no heading"),
        ("- no item", "&#45; no item"),
        ("1. no item", "&#49;. no item"),
        ("1.5 ms", "1.5 ms"),
        ("---", "&#45;--"),
        ("snake_case _not_ emphasis", r"snake_case \_not\_ emphasis"),
        ("a | b", r"a \| b"),
        ("![x](y)", r"!\[x\](y)"),
        ("see https://x.invalid", "see https&#58;//x.invalid"),
        ("`code`", r"\`code\`"),
        ("two\nlines", "two lines"),
    ],
)
def test_markdown_is_taken_literally(text: str, expected: str) -> None:
    assert escaped(text) == expected


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_colours_have_contrast(theme: dict[str, str]) -> None:
    def light(colour: str) -> float:
        parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    def contrast(one: str, other: str) -> float:
        high, low = sorted((light(one), light(other)), reverse=True)
        return (high + 0.05) / (low + 0.05)

    for paper in ("paper", "panel"):
        for ink in ("ink", "soft", "accent", "c1"):  # texts and links
            assert contrast(theme[ink], theme[paper]) >= 4.5, (ink, paper)
    for name in ("c1", "c2", "c3", "c4", "c5", "c6", "s1", "s2", "s3", "s4"):
        assert contrast(theme[name], theme["paper"]) >= 3, name


def test_the_command_writes_a_report_and_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = tmp_path / "result.json"
    assert (
        run(
            [
                "solve",
                str(example_path("starter")),
                "-q",
                "--json",
                str(result),
                "--report",
                "-o",
                str(tmp_path / "one"),
            ]
        )
        == 0
    )
    assert {path.name for path in (tmp_path / "one").iterdir()} == {
        f"starter.{kind}" for kind in ("html", "md", "csv", "json")
    }
    assert (
        run(["report", str(result), "-o", str(tmp_path / "two"), "--rank-by", "order:price", "--alternative", "2"]) == 0
    )
    assert '"method": "order:price"' in (tmp_path / "two" / "starter.json").read_text()
    assert run(["report", str(result), "-o", str(tmp_path / "three"), "--figures", "svg"]) == 0
    assert all(path.suffix == ".svg" for path in (tmp_path / "three").iterdir())
    capsys.readouterr()
    assert run(["report", str(result), "--alternative", "99"]) == 2
    assert "has no alternative 99" in capsys.readouterr().err
    assert run(["report", str(result), "--figures", "gif"]) == 2
    none = tmp_path / "none.json"
    assert run(["solve", str(example_path("starter")), "-q", "--json", str(none), "--max-jitter", "1ms"]) == 4
    assert run(["report", str(none), "--figures", "svg", "-o", str(tmp_path / "four")]) == 2
    assert "nothing to draw" in capsys.readouterr().err


def test_a_changed_problem_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    problem = tmp_path / "mine.yaml"
    problem.write_text(example_path("starter").read_text(), encoding="utf-8")
    result = tmp_path / "result.json"
    assert run(["solve", str(problem), "-q", "--json", str(result)]) == 0
    problem.write_text(problem.read_text().replace("60 EUR", "61 EUR"), encoding="utf-8")
    assert run(["report", str(result), "-o", str(tmp_path)]) == 2
    assert "has changed since the result was written" in capsys.readouterr().err


@pytest.mark.parametrize("width", [40, 60, 80, 120, 160])
def test_the_terminal_is_readable_at_any_width(robot: Result, width: int) -> None:
    printed = io.StringIO()
    print_page(Console(file=printed, width=width), printed_page(Document(robot), 3))
    text = printed.getvalue()
    lines = text.splitlines()
    assert max(map(len, lines)) <= width
    joined = " ".join(text.split())
    for point in robot.leaders[:3]:
        for figure in (counted(point.objectives["jitter of gnss_to_sprayer"], "ns"), point.score):
            assert figure in joined  # neither cut nor broken
    assert "aperiodic" in joined.partition("Ranked by")[0]


def test_many_decisions_are_told_against_the_first(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", str(example_path("autoware_reference")), "--top", "2", "--explain"]) == 0
    text = capsys.readouterr().out
    assert "as #1, but BehaviorPlanner.period 40 ms" in text
    few = ["--top", "2", "--processing", "execution-time"]  # no cores are decided
    assert run(["solve", str(example_path("inmark")), *few]) == 0
    assert "as #1" not in capsys.readouterr().out


def test_the_terminal_says_what_it_leaves_out(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", str(example_path("inmark")), "--top", "4", "--explain"]) == 0
    text = capsys.readouterr().out
    assert "Near-identical to one above" in text
    assert "Not shown here: 26 more of 39" in text
    assert "The front, ranked by distance to the ideal point" in text
    assert "Tightest requirement:" in text
    assert run(["solve", str(example_path("starter")), "--rank-by", "baseline", "--explain"]) == 0
    assert "Ties:" in capsys.readouterr().out
