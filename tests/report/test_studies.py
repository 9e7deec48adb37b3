"""Reports of studies: what they say is what the data say; pages open without an error or a request."""

from __future__ import annotations

import json
import random
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.answers.tables.display import counted
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.questions.problem import load
from dse.questions.robust.robust import solve_robust
from dse.report.amounts import safe_text
from dse.report.content.sensitivity import scaling_words
from dse.report.content.simulate import simulation_page
from dse.report.content.study import sections_of
from dse.report.output import study_figures, study_files
from dse.report.page import Section, Table, Text
from tests.questions.studies import example, written
from tests.report.browser import Browser, needs_browser

UNCERTAIN = """
uncertainty:
  threads.controller.compute_execution_time.small.max: {range: 2 ms .. 20 ms}
  bus_types.can_250k.transmission_time.per_byte.max: {factor: 0.9 .. 40}
"""


def read(result: Any) -> dict[str, Any]:
    """The data as a program reads them."""
    data: dict[str, Any] = json.loads(result.to_json())
    return data


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    problem = example("starter")
    price = "processor_types.small.price"
    stated = load(written(tmp_path_factory.mktemp("stated"), "starter", UNCERTAIN))
    return {
        "breaks": read(dse.sweep(problem, "jitter of sensor_to_actuator=1ms..50ms")),
        "breaks of a grid": read(
            dse.sweep(problem, [f"{price}=60 EUR,900 EUR", "jitter of sensor_to_actuator=1ms..50ms"])
        ),
        "grid": read(dse.sweep(problem, [f"{price}=60 EUR,900 EUR", "bus_types.can_250k.bandwidth=*0.001,1,2"])),
        "sensitivity": read(dse.sensitivity(stated, samples=500)),
        "robust": read(solve_robust(stated)),
    }


def table_of(section: Section, caption: str) -> Table:
    return next(table for table in section.tables if caption in table.caption)


def test_break_points_are_those_of_the_data(studies: dict[str, dict[str, Any]]) -> None:
    data = studies["breaks"]
    [section] = sections_of(data)
    stretches = data["runs"][0]["stretches"]
    rows = section.tables[0].rows
    assert len(rows) == len({item["best"] for item in stretches})
    assert "No design below 7.13424 ms (proved)." in section.texts and rows[0][0] == "7.13424 ms"
    [plot] = section.plots
    steps = re.findall(r"<title>([^<]*) at ([^<]*)</title></circle>", "".join(plot.draw().elements))
    assert f"Best price: {', '.join(f'{value} from {place}' for value, place in steps)}." in section.texts


def test_break_points_that_hardly_differ_are_one_row_of_a_terminal() -> None:
    """Each computer has its row; a limit that is printed is feasible."""
    problem = load(example_path("inmark"))
    data = read(dse.sweep(problem, "jitter of gnss_to_sprayer=5ms..40ms"))
    whole = sections_of(data)[0].tables[0]
    assert whole.short is not None and len(whole.short.rows) < len(whole.rows)
    exact = [Fraction(row[0].removesuffix(" ms")) for row in whole.rows]
    for row in whole.short.rows:
        limit = Fraction(row[0].removesuffix(" ms"))
        assert any(0 <= limit - one < Fraction(1, 1000) for one in exact)
    at = whole.short.headings.index("computer")
    assert {row[at] for row in whole.short.rows} == {"Spectra", "RT101"}


def test_a_printed_margin_keeps_its_requirement() -> None:
    """A least value is rounded up and a greatest down, by less than a thousandth of the unit."""
    rng = random.Random(0)
    for _ in range(200):
        value = Fraction(rng.randrange(10**5, 10**12), rng.randrange(1, 7))
        for is_least in (True, False):
            text = safe_text(value, "ns", "EUR", is_least=is_least)
            beyond = Fraction(text.removesuffix(" ms").replace(" ", "")) * 10**6 - value
            assert 0 <= (beyond if is_least else -beyond) < 1000


def test_a_grid_tells_what_enters_leaves_and_moves(studies: dict[str, dict[str, Any]]) -> None:
    data = studies["grid"]
    section, designs = sections_of(data)
    assert designs.is_detail and not section.is_detail
    rows = section.tables[0].rows
    assert len(rows) == 6 and [row[:2] for row in rows] == [tuple(run["values"].values()) for run in data["runs"]]
    for row, item in zip(rows, data["runs"], strict=True):
        change = item["change"]
        assert row[-3:] == (
            ("", "", "") if change is None else tuple(str(len(change[k])) for k in ("entered", "left", "moved"))
        )
    drawn = "".join(section.plots[0].draw().elements)
    assert set(re.findall(r"<text [^>]*dx='5'>([^<]*)", drawn)) == {
        "processor_types.small.price 60 EUR",
        "processor_types.small.price 900 EUR",
    }


def test_sensitivity_has_margins_tornadoes_and_chances(studies: dict[str, dict[str, Any]]) -> None:
    data = studies["sensitivity"]
    margins, most, tornado, uncertain, variance = sections_of(data)
    breaking = [item["path"] for item in data["margins"] if item["below"] or item["above"]]
    assert sorted(row[0] for row in margins.tables[0].rows) == sorted(breaking)
    metrics = list(dict.fromkeys(bar["metric"] for bar in data["tornado"]))
    assert [table.caption.rpartition(": ")[0] for table in tornado.tables] == metrics
    assert len(tornado.plots) == len(metrics) and [row[0] for row in most.tables[0].rows] == metrics
    assert tornado.is_detail and len(variance.plots) == len(data["uncertainty"]["indices"])
    chances = table_of(uncertain, "Alternatives").rows
    assert len(chances) == len(data["uncertainty"]["alternatives"])
    assert all(bool(row[1]) == (row[0] != "100.00%") for row in chances)  # the weakest requirement, where one breaks


def test_what_robustness_costs(studies: dict[str, dict[str, Any]]) -> None:
    data = studies["robust"]
    [section] = sections_of(data)
    lost = table_of(section, "not robust").rows
    assert len(lost) == len(data["robust"]["lost"]) > 0
    assert [row[0] for row in table_of(section, "What robustness costs").rows] == list(data["robust"]["price"])


def test_exact_factors_are_said_exactly() -> None:
    found = {"factor": "70/17", "exact": True, "requirement": "r", "thread": "t", "utilisations_ppm": {"cpu": 700000}}
    assert scaling_words(found) == (
        "All execution times together: up to 70/17 = 4.11764706… times; beyond, a design violates r (by t alone). "
        "Breakdown utilisation: cpu 70 % of one core."
    )
    assert "up to 2.5 times" in scaling_words({**found, "factor": "5/2"})


@pytest.mark.parametrize("name", ["breaks", "grid", "sensitivity"])
def test_files_of_a_study(studies: dict[str, dict[str, Any]], name: str) -> None:
    hostile = json.loads(json.dumps(studies[name]).replace("Starter", "<script>alert(1)</script> | _x_"))
    files = dict(study_files(hostile, "c", "j"))
    assert [Path(file).suffix for file in files] == [".html", ".md", ".csv", ".json"]
    page, text = list(files.values())[:2]
    assert "<script>alert" not in page and "http-equiv" in page and "<script>alert" not in text
    for section in sections_of(hostile):
        assert section.title in page
    figures = dict(study_figures(studies[name], ["svg"]))
    assert len(figures) == sum(len(section.plots) for section in sections_of(studies[name])) > 0
    assert all(isinstance(item, str) and item.startswith("<svg") for item in figures.values())


def test_reports_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(written(tmp_path, "starter", UNCERTAIN))
    folder = tmp_path / "reports"
    to = ["--report", "-o", str(folder)]
    vary = ["--vary", "jitter of sensor_to_actuator=1ms..50ms", "--no-store", "--workers", "1"]
    study = str(tmp_path / "sweep.json")
    assert run(["sweep", file, *vary, "--json", study, "-q", *to]) == 0
    assert run(["sensitivity", file, "--samples", "100", *to]) in (0, 4)
    assert run(["solve", file, "--robust", "-q", *to]) in (0, 4)
    assert {path.name for path in folder.iterdir()} == {
        *(f"Starter-{kind}.{end}" for kind in ("sweep", "sensitivity") for end in ("html", "md", "csv", "json")),
        *(f"starter.{end}" for end in ("html", "md", "csv", "json")),
    }
    assert "robust" in json.loads((folder / "starter.json").read_text())
    assert "What robustness costs" in (folder / "starter.html").read_text()
    again = tmp_path / "again"
    assert run(["report", study, "-o", str(again)]) == 0
    assert (again / "Starter-sweep.html").read_text() == (folder / "Starter-sweep.html").read_text()
    assert run(["report", study, "-o", str(again), "--figures", "svg"]) == 0 and list(again.glob("*.svg"))
    solved = str(tmp_path / "r.json")
    assert run(["solve", file, "-q", "--json", solved]) == 0
    assert run(["report", solved, "-o", str(again), "--study", study]) == 0
    page = (again / "starter.html").read_text()
    assert "Limit on jitter of sensor_to_actuator" in page and "How designs were ranked" in page
    capsys.readouterr()


def test_what_is_no_study_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(written(tmp_path, "starter"))
    solved, broken, text = tmp_path / "r.json", tmp_path / "broken.json", tmp_path / "text.json"
    run(["solve", file, "-q", "--json", str(solved)])
    broken.write_text('{"format": "dse-sweep/1"}')
    text.write_text("no json")
    for study, words in (
        (solved, "it is no study"),
        (text, "it is no study"),
        (broken, "broken.json: is not a whole sweep: problem: is missing"),
    ):
        capsys.readouterr()
        assert run(["report", str(solved), "-o", str(tmp_path / "o"), "--study", str(study)]) == 2
        assert words in capsys.readouterr().err
    assert run(["report", str(broken), "-o", str(tmp_path / "o")]) == 2
    assert run(["solve", file, "--robust", "--further", "2"]) == 2


@needs_browser
@pytest.mark.parametrize("width", [390, 1280], ids=["phone", "desktop"])
def test_pages_open_without_an_error_or_a_request(
    studies: dict[str, dict[str, Any]], tmp_path: Path, width: int, browser: Browser
) -> None:
    for name in ("breaks", "breaks of a grid", "grid", "sensitivity"):
        path = tmp_path / "page.html"
        path.write_text(next(iter(study_files(studies[name], None, None)))[1], encoding="utf-8")
        browser.open(path, width)
        assert browser.problems() == []
        assert [url for url in browser.requests() if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
        plots = sum(len(section.plots) for section in sections_of(studies[name]))
        assert browser.run("document.querySelectorAll('[data-plot=study] > svg').length") == plots > 0
        assert browser.run("document.documentElement.scrollWidth") <= width


def test_simulated_latencies_are_drawn_against_their_bounds() -> None:
    """The bars have every datum, the lines are the analysed bounds."""
    found = dse.simulate(example_path("starter"), runs=2)
    [plot] = [block for section in simulation_page(found).sections for block in section.plots]
    drawn = "".join(plot.draw().elements)
    assert sum(map(int, re.findall(r": (\d+) data</title>", drawn))) == found.flows[0].count > 0
    bounds = [counted(value, "ns") for value in found.flows[0].bounds_ns]
    assert re.findall(r"<title>analysed: ([^<]*)", drawn) == bounds
    assert f"<title>{float(min(found.flows[0].latencies)) / 1e6:.6f} ms to " in drawn


def test_studies_say_what_all_of_a_core_is(studies: dict[str, dict[str, Any]]) -> None:
    """Where they name utilisation: 100 % is one core, on every page."""
    swept = read(dse.sweep(example("starter"), "utilisation=20%..70%"))
    for data, said in ((swept, True), (studies["sensitivity"], True), (studies["breaks"], False)):
        assert ("Utilisation counts one core as 100 %" in repr(sections_of(data))) == said


@pytest.mark.parametrize("name", ["breaks", "breaks of a grid", "grid", "sensitivity"])
def test_studies_say_what_waiting_is_counted(name: str, studies: dict[str, dict[str, Any]]) -> None:
    """The arbitration of the problem's CAN bus is not stated; where nothing is left out nothing else is said."""
    study = studies[name]
    counted = {"counted": ["processors", "can0"], "not_counted": [], "faults": ["can0"]}
    for given, said in (
        (study, "execution, transmission. Waiting not counted: processors, buses."),
        ({**study, "waiting": counted}, "execution, transmission, faults of can0. Waiting counted: processors, buses."),
    ):
        texts = [block.text for section in sections_of(given) for block in section.blocks if isinstance(block, Text)]
        assert [text for text in texts if "Counted  " in text] == [f"Counted  {said}"]


def test_robust_designs_as_good_as_nominal_ones_take_nobodys_place(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """At 5 ms, first in the file, the longest time is too long; 10 ms cost the same."""
    path = tmp_path / "p.yaml"
    path.write_text(
        "dse: 1\nname: P\nprocessor_types: {c: {price: 5 EUR}}\nprocessors: {p: {type: c}}\n"
        "threads: {a: {processor: p, period: [5 ms, 10 ms], compute_execution_time: 1 ms .. 2 ms}}\n"
        "requirements: [utilisation of p <= 70 %]\nobjectives: [minimise price]\n"
        "uncertainty: {threads.a.compute_execution_time.max: {range: 2 ms .. 4 ms}}\n",
        encoding="utf-8",
    )
    assert run(["solve", str(path), "--robust"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "0 of 1 robust alternatives are on the nominal front too, 1 as good with other decisions, 0 take" in told
