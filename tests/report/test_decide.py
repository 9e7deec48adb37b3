"""Deciding on the page, in headless Chromium: limits are exact, options show their fronts, views can be kept."""

from __future__ import annotations

import csv
import io
import json
import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import dse
from dse.questions.verbs.feasible_designs import feasible_designs
from dse.report.content.front.document import Document
from dse.report.content.front.filters import decide_data
from dse.report.html import html_report
from tests.helpers.effort import count
from tests.report.browser import Browser, needs_browser

pytestmark = needs_browser

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
SOLVED = 15
FILTERED = 2500


@pytest.fixture(scope="module")
def result() -> dse.Result:
    """All compromises of a pump: dear and quick, cheap and slow, with what it costs to insist."""
    text = PUMP.read_text(encoding="utf-8").replace("objectives: [", "objectives: [minimise load of can0, ")
    problem = dse.loads(text.replace("period: 20 ms", "period: [20 ms, 40 ms]"))
    return dse.insist(dse.solve(problem, processing="execution_time"))


@pytest.fixture(scope="module")
def file(result: dse.Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("decide") / "page.html"
    path.write_text(html_report(Document(result)), encoding="utf-8")
    return path


@pytest.fixture
def page(browser: Browser, file: Path) -> Iterator[Browser]:
    browser.open(file)
    yield browser
    assert browser.problems() == []


def metric(page: Browser, name: str) -> int:
    return int(page.run(f"dseReport.data.decide.metrics.findIndex((m) => m.name === {json.dumps(name)})"))


def require(page: Browser, name: str, sense: str, value: str) -> None:
    page.run(
        f"""(async () => {{
        document.getElementById('wish-metric').value = '{metric(page, name)}';
        document.getElementById('wish-sense').value = {json.dumps(sense)};
        document.getElementById('wish-value').value = {json.dumps(value)};
        document.getElementById('whatif').requestSubmit();
        await new Promise((done) => setTimeout(done, 0));
        }})()"""
    )


def shown(page: Browser) -> list[int]:
    rows = "[...document.querySelectorAll('#front-table tbody tr:not(.out)')].map((row) => Number(row.dataset.id))"
    return sorted(page.run(rows))


def test_a_filtered_front_is_the_solved_front(page: Browser, result: dse.Result) -> None:
    """For random limits, at figures of the front, a hair beside them, and in between; in whole and in broken units."""
    draw = random.Random(1)
    problem = dse.loads(next(iter(result.problem.texts.values())))
    names = [info.name for info in result.objectives]
    data = {item["name"]: item for item in decide_data(result)["metrics"]}
    for _ in range(count(SOLVED)):
        page.run("document.getElementById('limits').reset()")
        page.run("new Promise((done) => setTimeout(done, 30))")
        limits = []
        for name in draw.sample(names, draw.randint(1, 2)):
            item = data[name]
            value = Fraction(draw.choice(list(item["values"].values()))) * int(item["den"]) / int(item["num"])
            value += draw.choice(
                [Fraction(0), Fraction(1, 10**6), Fraction(-1, 10**6), Fraction(draw.randint(0, 9), 7)]
            )
            text = f"{float(max(value, Fraction(0))):.6f}"
            limits.append(f"{name} <= {text} {item['unit']}")
            require(page, name, "<=", text)
        solved = dse.solve(problem, require=limits, processing="execution_time")
        expected = [point.objectives for point in solved.front]
        found = [point.objectives for point in result.front if point.id in shown(page)]
        assert len(found) == len(expected) and all(one in expected for one in found), limits
        assert page.run("document.getElementById('verdict').className") == "exact"


def test_a_thousand_filtered_fronts_are_those_of_all_designs(page: Browser, result: dse.Result) -> None:
    """What no other design within the limits dominates, of all designs that there are: nothing is solved here."""
    draw = random.Random(2)
    among = feasible_designs(result)
    assert among is not None and len(among.vectors) > 2 * len(result.front)
    every, names = np.array(among.vectors), [info.name for info in result.objectives]
    metrics = {item["name"]: item for item in decide_data(result)["metrics"]}
    scales = [Fraction(int(metrics[name]["num"]), int(metrics[name]["den"])) for name in names]
    numbers = [metric(page, name) for name in names]
    drawn, expected = [], []
    for _ in range(count(FILTERED)):
        wishes, within = [], np.ones(len(every), dtype=bool)
        for axis in draw.sample(range(len(names)), draw.randint(1, len(names))):
            value = int(draw.choice(every)[axis]) / scales[axis] + Fraction(draw.choice([0, 0, 1, -1, 10**8]), 10**9)
            nano = max(0, int(value * 10**9))  # nine digits, as they are written
            wishes.append({"metric": numbers[axis], "sense": "<=", "text": f"{nano // 10**9}.{nano % 10**9:09}"})
            within &= every[:, axis] <= int(nano * scales[axis] / 10**9)
        drawn.append(wishes)
        left = every[within]
        dominated = [((left <= row).all(axis=1) & (left < row).any(axis=1)).any() for row in left]
        expected.append({tuple(map(int, row)) for row, worse in zip(left, dominated, strict=True) if not worse})
    found = page.run(
        f"""{json.dumps(drawn)}.map((wishes) => {{
          dseReport.state.wishes = wishes;
          return dseReport.data.front.filter(dseReport.also).map((record) => record.id);
        }})"""
    )
    vectors = {point.id: tuple(point.objectives[name] for name in names) for point in result.front}
    assert [{vectors[number] for number in ids} for ids in found] == expected
    assert len({frozenset(item) for item in expected}) > 10
    page.run("dseReport.state.wishes = []")


@pytest.mark.parametrize(
    ("name", "sense", "value", "option"),
    [
        ("price", ">=", "100", "--require 'price >= 100 EUR'"),
        ("utilisation of computer", "<=", "20", "--require 'utilisation of computer <= 20 %'"),
    ],
)
def test_what_is_another_question_names_the_command(
    page: Browser, name: str, sense: str, value: str, option: str
) -> None:
    require(page, name, sense, value)
    assert page.run("document.getElementById('verdict').className") == "open"
    said = page.run("document.querySelector('#verdict code').textContent")
    assert said.startswith("dse solve ") and said.endswith(option)
    assert "needs the solver" in page.run("document.getElementById('wishes').textContent")


def test_what_is_no_number_is_refused(page: Browser, result: dse.Result) -> None:
    require(page, "price", "<=", "cheap")
    assert "number" in page.run("document.getElementById('wish-error').textContent")
    assert len(shown(page)) == len(result.front)


def test_each_option_shows_its_front(page: Browser, result: dse.Result) -> None:
    assert result.insisting is not None
    struck = page.run("[...document.querySelectorAll('#insist s')].map((item) => item.textContent)")
    assert struck == [item.option for item in result.insisting.options if item.status == "infeasible"]
    for number, item in enumerate(result.insisting.options):
        if item.status == "infeasible":
            continue
        page.run(f"document.querySelector('#insist button[data-option=\"{number}\"]').click()")
        page.wait(f"document.querySelectorAll('#insist-answer tbody tr').length === {len(item.front)}")
        page.wait(f"document.querySelectorAll('#scatter .diamond').length === {len(item.front)}")
        assert page.run("document.querySelectorAll('#insist [aria-pressed=true]').length") == 1
        assert f"{item.decision} {item.option}" in page.run("document.getElementById('insist-answer').textContent")
    page.run("document.querySelector('#insist [aria-pressed=true]').click()")
    page.wait("document.getElementById('insist-answer').textContent === ''")


def test_a_link_restores_the_view(page: Browser, browser: Browser, file: Path, result: dse.Result) -> None:
    require(page, "price", "<=", "200")
    last = result.front[-1].id
    page.run(f"dseReport.choose({last})")
    page.run("document.querySelector('#insist button').click()")
    page.wait("document.querySelectorAll('#insist-answer tbody tr').length > 0")
    page.run("for (const turn of [1, 2]) document.querySelectorAll('#front-table th')[2].click()")
    page.run("Object.assign(dseReport.state, {bands: {0: [0.1, 1]}, zoomed: true}); dseReport.keep()")
    order = page.run("[...document.querySelectorAll('#front-table tbody tr')].map((row) => row.dataset.id)")
    before, address = shown(page), page.run("location.hash")
    assert address.startswith("#view?")
    linked = file.with_name("linked.html")
    linked.write_text(file.read_text(encoding="utf-8").replace("<head>", "<head>", 1), encoding="utf-8")
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=linked.resolve().as_uri() + address)
    browser.wait("document.readyState === 'complete' && Boolean(window.dseReport && window.dseReport.ready)")
    assert shown(browser) == before != sorted(point.id for point in result.front)
    assert browser.run("dseReport.state.chosen") == last
    assert browser.run("document.querySelectorAll('#insist [aria-pressed=true]').length") == 1
    assert browser.run("[dseReport.state.zoomed, dseReport.state.bands]") == [True, {"0": [0.1, 1]}]
    assert browser.run("[...document.querySelectorAll('#front-table tbody tr')].map((r) => r.dataset.id)") == order


def test_columns_sort_and_what_is_shown_is_saved(page: Browser, result: dse.Result) -> None:
    heads = page.run("[...document.querySelectorAll('#front-table th')].map((head) => head.textContent.trim())")
    at = heads.index("price")
    for direction in ("ascending", "descending"):
        page.run(f"document.querySelectorAll('#front-table th')[{at}].click()")
        prices = [float(row[at - 1].replace(" ", "").removesuffix("EUR")) for row in saved(page)[1:]]
        assert prices == sorted(prices, reverse=direction == "descending") and len(prices) == len(result.front)
        assert page.run(f"document.querySelectorAll('#front-table th')[{at}].ariaSort") == direction
    require(page, "price", "<=", "200")
    assert len(saved(page)) - 1 == len(shown(page)) < len(result.front)


def saved(page: Browser) -> list[list[str]]:
    return list(csv.reader(io.StringIO(page.run("dseReport.csv()"))))


def test_zoom_fits_the_axes_to_what_is_shown(page: Browser) -> None:
    wide = page.run("dseReport.scatterEnds()")
    require(page, "price", "<=", "200")
    page.run("document.getElementById('zoom').click()")
    page.wait(f"String(dseReport.scatterEnds()) !== '{','.join(map(str, wide))}'")
    kept = page.run("dseReport.data.front.filter((r) => dseReport.state.kept.includes(r.id)).map((r) => r.o0)")
    low, high = page.run("dseReport.scatterEnds()")
    assert low <= min(kept) and max(kept) <= high


def test_one_point_has_nothing_to_slide(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "one.html"
    path.write_text(html_report(Document(dse.solve(PUMP, minimise="price"))), encoding="utf-8")
    browser.open(path)
    assert browser.run("document.querySelectorAll('#limits input').length") == 0
    assert browser.problems() == []
