"""The first screen of the page, in headless Chromium: banner, kinds, live ranking, two designs side by side."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import dse
from dse.examples.shipped import example_path
from dse.report.content.front.decision import CAUSES, banner, designs_data
from dse.report.content.front.document import Document
from dse.report.content.front.first_screen import Screen
from dse.report.html import html_report
from dse.report.words.headline import title_words
from dse.support.theme import DARK, LIGHT
from tests.report.browser import Browser, needs_browser

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


def screen_of(result: dse.Result) -> Screen:
    return Screen(Document(result))


@pytest.fixture(scope="module")
def robot() -> dse.Result:
    return dse.solve(example_path("inmark"), max_jitter="20ms", processing="execution_time")


WAITS = """
dse: 1
name: waits
processor_types: {cpu: {price: 5 EUR}, big: {price: 9 EUR}}
processors: {p: {type: [cpu, big]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {cpu: 4 ms, big: 3.9 ms}}
  b: {processor: p, period: 20 ms, compute_execution_time: {cpu: 6 ms, big: 5.9 ms}}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
requirements: [latency of f <= 32 ms]
objectives: [minimise latency of f, minimise price]
processing: execution_time
"""


def test_a_warning_that_changes_the_decision_is_the_banner() -> None:
    """On one core b takes 6 + 4 ms where a lets it wait, so that 30 ms become 34 ms, and 29.8 ms 33.7 ms."""
    found = banner(screen_of(dse.solve(dse.loads(WAITS))))
    assert found.state == "wrong"
    assert found.title.startswith(
        "Warning: With waiting for the CPU, all 2 designs violate latency of f <= 32 ms; least"
    )
    assert "No recommendation: no design of this front meets every limit with waiting." in found.lines
    assert (True, "Complete, proved: 2 designs") in found.facts
    assert (False, "Waiting not counted: processors") in found.facts


def test_a_recommendation_says_what_it_is_and_what_it_costs() -> None:
    found = banner(screen_of(dse.solve(PUMP)))
    assert (found.state, found.title) == ("good", "Recommended: #1 large, can_250k, control.period 5 ms")
    assert any(line.startswith("Cost: ") for line in found.lines)
    assert any(line.startswith("Nearest limit: ") for line in found.lines)


def test_a_result_that_is_read_again_has_its_title(robot: dse.Result, tmp_path: Path) -> None:
    """A result states the limit of every flow one by one; a title has room for one phrase."""
    robot.to_json(tmp_path / "r.json")
    titles = [title_words(result) for result in (robot, dse.reopen(tmp_path / "r.json"))]
    assert titles == ["Intelligent Marking line-marking robot: jitter of every flow <= 20 ms"] * 2


def test_a_long_name_leaves_room_for_a_limit() -> None:
    titles = [title_words(dse.solve(example_path(name))) for name in ("inmark_chapter2", "inmark_chapter3")]
    assert [title.partition(": ")[2] for title in titles] == [
        "jitter of f_gnss_lat < 200 ms, 1 more limit",
        "latency of every flow <= 10 ms, 4 more limits",
    ]
    assert all(title.startswith("Intelligent Ma") and len(title) <= 80 for title in titles)


def test_deadlines_stand_last_in_a_title() -> None:
    result = dse.solve(example_path("perception"))
    assert title_words(result) == "Perception pipeline: latency of brake <= 150 ms, every deadline met"


def test_a_question_without_a_design_is_red() -> None:
    assert banner(screen_of(dse.solve(PUMP, max_jitter="1ms"))).state == "wrong"


def test_a_search_that_found_nothing_says_what_to_do_next() -> None:
    result = dse.solve(example_path("inmark"))
    stopped = replace(result, front=(), status="incomplete")
    steps = list(screen_of(stopped).changing_steps())
    assert [option for option, _ in steps] == ["--processing execution-time", "--time-limit 10min"]
    assert not list(screen_of(dse.solve(PUMP, max_jitter="1ms")).changing_steps())


def test_causes_add_up_to_the_latency(robot: dse.Result) -> None:
    document = Document(robot)
    data = designs_data(Screen(document), document.alternatives)
    assert data["names"][3].startswith("RT101")  # the cheaper computer is a kind of its own
    for item in document.alternatives:
        for flow, (times, least, greatest) in zip(
            item.analysis.flows, data["designs"][str(item.point.id)]["flows"], strict=True
        ):
            assert (sum(times), least, greatest) == (flow.max_ns, flow.min_ns, flow.max_ns)
            assert len(times) == len(CAUSES) and times[CAUSES.index("waiting for the CPU")] == 0


def test_waiting_is_told_from_execution() -> None:
    result = dse.solve(PUMP, processing="response_time", minimise=["latency of sensor_to_valve", "price"])
    document = Document(result)
    data = designs_data(Screen(document), document.alternatives)
    times, _, greatest = data["designs"]["1"]["flows"][0]
    assert sum(times) == greatest
    rows = [row for row in document.alternatives[0].analysis.flows[0].rows if row.max_method == "response time"]
    threads = {CAUSES[1], CAUSES[2]}
    assert sum(time for cause, time in zip(CAUSES, times, strict=True) if cause in threads) == sum(
        row.max_ns for row in rows
    )


@pytest.fixture(scope="module")
def file(robot: dse.Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("first") / "page.html"
    path.write_text(html_report(Document(robot)), encoding="utf-8")
    return path


def move(page: Browser, name: str, value: object) -> None:
    page.run(
        f"""(() => {{ const input = document.getElementById('{name}'); input.value = '{value}';
        input.dispatchEvent(new Event('input')); }})()"""
    )


@needs_browser
def test_the_ranking_under_limits_and_weights_is_that_of_dse(browser: Browser, file: Path, robot: dse.Result) -> None:
    """Under a limit as `dse solve` with it ranks, with weights as ``--rank-by ideal:…`` ranks the front."""
    browser.open(file)
    ranked = "dseReport.ranked().map((item) => item.id)"
    assert browser.run(ranked) == [point.id for point in robot.front]
    move(browser, "limit-0", 6)
    browser.wait("dseReport.state.kept !== null")
    kept = browser.run("dseReport.state.kept")
    most = max(point.objectives["jitter of gnss_to_sprayer"] for point in robot.front if point.id in kept)
    solved = dse.solve(
        example_path("inmark"),
        max_jitter=["20ms", f"gnss_to_sprayer={most}ns"],
        processing="execution_time",
    )
    vectors = {point.id: tuple(point.objectives.values()) for point in robot.front}
    assert [vectors[number] for number in browser.run(ranked)] == [tuple(p.objectives.values()) for p in solved.front]
    live = browser.run("document.getElementById('live').textContent")
    assert live.startswith(f"{len(kept)} of 15 designs within the limits: first is #")
    assert "outside the limits" in browser.run("document.querySelector('.kinds').textContent")
    browser.run("document.querySelector('#limits button').click()")
    browser.wait("dseReport.state.kept === null")
    move(browser, "weight-1", 4)
    heavier = dse.ranked_by(robot, "ideal:1,4,1")
    assert browser.run(ranked) == [point.id for point in heavier.front]
    first = heavier.front[0].id
    assert first != 1 and f"first is #{first} RT101" in browser.run("document.getElementById('live').textContent")
    assert browser.problems() == []


@needs_browser
def test_a_card_calls_its_own_design_lowest_alone(browser: Browser, file: Path, robot: dse.Result) -> None:
    """The design of a card has the lowest jitter or price itself, not another one of its kind."""
    browser.open(file)
    pair = "[card.dataset.id, card.querySelector('em').textContent]"
    cards = browser.run(f"[...document.querySelectorAll('.cards li')].map((card) => {pair})")
    points = {point.id: point for point in robot.front}
    for name in [info.name for info in robot.objectives]:
        least = min(point.objectives[name] for point in robot.front)
        for number, said in cards:
            if f"lowest {name.split(' of ')[0]}" in said:
                assert points[int(number)].objectives[name] == least, (number, said)


@needs_browser
def test_two_designs_stand_side_by_side_and_a_link_keeps_them(browser: Browser, file: Path) -> None:
    browser.open(file)
    cards = browser.run("[...document.querySelectorAll('.cards li')].map((card) => card.textContent)")
    assert len(cards) == 4 and "#15 RT101" in cards[3] and "lowest price" in cards[3]
    browser.run("document.querySelector('.cards li:nth-child(4) .as-b').click()")
    browser.wait("dseReport.state.other === 15")
    said = browser.run("document.getElementById('latencies').textContent")
    assert "16.896" in said and "RT101" in said
    assert "price \N{MINUS SIGN}750 EUR" in browser.run("document.getElementById('between').textContent")
    first = browser.run("document.querySelector('.margin').textContent")
    assert first.startswith("core 1 of computer56.702 of 70 %")
    address = browser.run("location.hash")
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=file.resolve().as_uri() + address)
    browser.wait("document.readyState === 'complete' && Boolean(window.dseReport && window.dseReport.ready)")
    assert browser.run("[dseReport.state.chosen, dseReport.state.other]") == [1, 15]
    assert browser.problems() == []


@needs_browser
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_the_first_screen_answers(browser: Browser, file: Path, width: int, height: int) -> None:
    browser.open(file, width)
    assert browser.run("document.documentElement.scrollWidth") <= width
    wanted = [".banner", ".cards li", "#scatter svg", "#limits", "#weights", "#latencies svg", ".margin"]
    tops = {
        name: browser.run(f"document.querySelector({json.dumps(name)}).getBoundingClientRect().top") for name in wanted
    }
    shown = [name for name, top in tops.items() if top < height - 20]
    assert shown == (wanted if width > 1000 else [".banner", ".cards li"])


# Machado, Oliveira and Fernandes (2009), severity 1: linear RGB as it is seen.
VISION = {
    "normal": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


def lab(colour: str, vision: str) -> np.ndarray:
    """CIE L*a*b* of a colour, as somebody sees it."""
    rgb = np.array([int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.array(VISION[vision]) @ linear, 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = (
        value ** (1 / 3) if value > 0.008856 else 7.787 * value + 16 / 116
        for value in to_xyz @ linear / np.array([0.9505, 1.0, 1.089])
    )
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("names", ["d1 d2 d3 d4", "k1 k2 k3 k4 k5 k6 k7", "s1 s2 s3 s4"])
@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_colours_are_told_apart(theme: dict[str, str], names: str, vision: str) -> None:
    """Two colours of a plot differ by 14 (CIE76) at least, also for colour-blind eyes."""
    for one, other in combinations(names.split(), 2):
        assert np.linalg.norm(lab(theme[one], vision) - lab(theme[other], vision)) > 14, (one, other)
