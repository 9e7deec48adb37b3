"""The report in headless Chromium, opened from disk with networking off."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.examples.shipped import example_path
from dse.report.content.front.document import Document
from dse.report.output import report_files
from dse.report.plots.canvas import LEFT, RIGHT
from tests.answers.hostile import hostile_result
from tests.helpers.effort import LONG
from tests.report.browser import Browser, needs_browser

pytestmark = needs_browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of the robot's front."""
    target = tmp_path_factory.mktemp("report")
    for name, content in report_files(Document(dse.solve(example_path("inmark"), processing="execution_time"))):
        (target / name).write_text(content, encoding="utf-8")
    return target


@pytest.fixture
def page(browser: Browser, folder: Path) -> Browser:
    browser.open(folder / "inmark.html")
    return browser


def bars_of(browser: Browser, kind: str, number: int) -> list[dict[str, Any]]:
    """The bars of a plot of the alternative: width in per cent of the plot, classes, what is said of them."""
    plot = f"document.querySelectorAll('#alternative [data-plot={kind}]')[{number}]"
    bar = "{width: parseFloat(r.getAttribute('width')), look: r.getAttribute('class'), tip: r.textContent}"
    return list(browser.run(f"[...{plot}.querySelectorAll('rect')].map((r) => ({bar}))"))


@pytest.mark.parametrize(
    ("width", "dark"),
    [
        pytest.param(width, dark, id=f"{name}-{'dark' if dark else 'light'}")
        for width, name in ((390, "phone"), (1280, "desktop"))
        for dark in (False, True)
        if LONG or dark == (name == "desktop")
    ],
)
def test_opens_without_an_error_or_a_request(
    browser: Browser, folder: Path, tmp_path: Path, width: int, dark: bool
) -> None:
    browser.open(folder / "inmark.html", width, dark)
    assert browser.problems() == []
    assert [url for url in browser.requests() if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
    assert browser.run("document.documentElement.scrollWidth") <= width  # only tables and drawings scroll sideways
    assert browser.run("document.querySelectorAll('.plot > svg, #scatter svg, #latencies svg').length") == 6
    paper = browser.run("getComputedStyle(document.body).backgroundColor")
    assert paper == ("rgb(20, 24, 31)" if dark else "rgb(255, 255, 255)")
    browser.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 50_000


def test_plots_have_the_data_of_the_json(page: Browser, folder: Path) -> None:
    data = json.loads((folder / "inmark.json").read_text(encoding="utf-8"))
    expected = {
        point["id"]: (
            point["objectives"]["jitter of gnss_to_sprayer"] / 1e6,
            point["objectives"]["price"] / 100,
            point["objectives"]["utilisation of computer"] / 1e4,
        )
        for point in data["front"]
    }
    rows = page.run("dseReport.data.front")
    assert {row["id"] for row in rows} == set(points_drawn(page)) == set(expected)
    for row in rows:
        assert (row["o0"], row["o1"], row["o2"]) == pytest.approx(expected[row["id"]])
        drawn = page.run(f"dseReport.scatterPlace({row['id']})")
        assert drawn == pytest.approx(page.run(f"dseReport.scatterAt({row['o0']}, {row['o1']})"))
    lines = page.run(
        """Object.fromEntries([...document.querySelectorAll('#parallel .lines path')].map(
             (line) => [line.dataset.id, line.getAttribute('d').match(/[\\d.]+/g).map(Number)]))"""
    )
    assert {int(number) for number in lines} == set(expected)
    for axis in range(3):  # the best value at the top of its axis, the worst at the bottom, all others in proportion
        heights = {int(number): places[2 * axis + 1] for number, places in lines.items()}
        top, bottom = min(heights.values()), max(heights.values())
        least, most = (pick(values[axis] for values in expected.values()) for pick in (min, max))
        for number, values in expected.items():
            share = (values[axis] - least) / (most - least)
            assert heights[number] == pytest.approx(top + share * (bottom - top), abs=0.1)


def test_the_waterfall_adds_up_to_the_latency_of_the_json(page: Browser, folder: Path) -> None:
    data = json.loads((folder / "inmark.json").read_text(encoding="utf-8"))
    for number in (1, 17):
        page.run(f"dseReport.choose({number})")
        metrics = next(point["metrics"] for point in data["front"] if point["id"] == number)
        for position, flow in enumerate(("gnss_to_sprayer", "software_chain")):
            rows = [bar for bar in bars_of(page, "flow", position) if bar["tip"]]  # without the legend
            whole, least = (sum(b["width"] for b in rows if ("pale" in b["look"]) == pale) for pale in (True, False))
            assert whole == pytest.approx(100 * (RIGHT - LEFT), abs=0.2)
            assert least / whole == pytest.approx(
                metrics[f"min latency of {flow}"] / metrics[f"latency of {flow}"], abs=0.01
            )
        used = sum(bar["width"] for bar in bars_of(page, "usage", 0) if " of computer" in bar["tip"])
        assert used / (RIGHT - LEFT) == pytest.approx(metrics["utilisation of computer"] / 1e4, abs=0.1)


def points_drawn(browser: Browser) -> list[int]:
    """The designs that the scatter plot draws."""
    return list(browser.run("[...document.querySelectorAll('#scatter .point')].map((p) => Number(p.dataset.id))"))


def selected(browser: Browser) -> list[Any]:
    """What each view says is chosen: state, scatter, A, parallel coordinates, row and button of the table, details."""
    return list(
        browser.run(
            """[
              dseReport.state.chosen,
              Number(document.querySelector('#scatter .marks text:last-child').textContent.split('#')[1]),
              Number(document.getElementById('side-a').value),
              Number(document.querySelector('#parallel .chosen').dataset.id),
              Number(document.querySelector('#front-table tr.chosen').dataset.id),
              Number(document.querySelector('#front-table input:checked').value),
              Number(document.getElementById('alternative-title').textContent.split('#')[1]),
            ]"""
        )
    )


def test_choosing_in_the_table_chooses_everywhere(page: Browser) -> None:
    assert selected(page) == [1] * 7
    page.run("document.querySelector('#front-table tr[data-id=\"12\"] td:nth-child(4)').click()")
    page.wait("dseReport.state.chosen === 12")
    assert selected(page) == [12] * 7
    assert page.problems() == []


def test_choosing_in_the_scatter_plot_chooses_everywhere(page: Browser) -> None:
    # the cheapest with the most jitter stands alone enough to be hit: bottom right of the plot
    page.run("document.querySelector('#scatter').scrollIntoView({block: 'center', behavior: 'instant'})")
    place = page.run("dseReport.scatterPlace(25)")
    page.click(*place)
    page.wait("dseReport.state.chosen !== 1")
    number = page.run("dseReport.state.chosen")
    assert number in (23, 24, 25)
    assert selected(page) == [number] * 7
    assert page.problems() == []


def test_choosing_a_line_chooses_everywhere(page: Browser) -> None:
    place = page.run(
        """(() => {
          document.querySelector('#parallel').scrollIntoView({block: 'center', behavior: 'instant'});
          const record = dseReport.data.front.find((one) => one.id === 20);
          const [one, two] = [1, 2].map((axis) => dseReport.parallelAt(axis, record['n' + axis]));
          const part = 0.92;  // near the right end, where the three lines that reach the bottom are alone
          return [one[0] + part * (two[0] - one[0]), one[1] + part * (two[1] - one[1])];
        })()"""
    )
    page.click(*place)
    page.wait("dseReport.state.chosen !== 1")
    number = page.run("dseReport.state.chosen")
    assert number in (18, 19, 20)
    assert selected(page) == [number] * 7


def kept(browser: Browser) -> list[list[int]]:
    """What each view keeps: scatter, parallel coordinates, table."""
    return list(
        browser.run(
            """[
              dseReport.state.kept === null ? null
                : [...document.querySelectorAll('#scatter .point:not(.out)')].map((p) => Number(p.dataset.id)),
              dseReport.state.kept === null ? null
                : [...document.querySelectorAll('#parallel .lines path:not(.out)')].map((p) => Number(p.dataset.id)),
              [...document.querySelectorAll('#front-table tbody tr:not(.out)')].map((row) => Number(row.dataset.id)),
            ]"""
        )
    )


def test_a_limit_fades_in_every_view(page: Browser, folder: Path) -> None:
    data = json.loads((folder / "inmark.json").read_text(encoding="utf-8"))
    prices = sorted({point["objectives"]["price"] for point in data["front"]})
    page.run(
        """(() => { const input = document.getElementById('limit-1'); input.value = '1';
        input.dispatchEvent(new Event('input')); })()"""
    )
    expected = sorted(point["id"] for point in data["front"] if point["objectives"]["price"] <= prices[1])
    page.wait("dseReport.state.kept !== null")
    assert [sorted(part) for part in kept(page)] == [expected] * 3
    assert page.run("document.getElementById('count').textContent").startswith(f"{len(expected)} of 39")
    page.run("document.querySelector('#limits button').click()")
    page.wait("dseReport.state.kept === null")
    assert len(kept(page)[2]) == 39


def drag(page: Browser, start: Sequence[float], end: Sequence[float]) -> None:
    middle = [(one + other) / 2 for one, other in zip(start, end, strict=True)]
    steps = (("mouseMoved", start), ("mousePressed", start), ("mouseMoved", middle), ("mouseMoved", end))
    for kind, (x, y) in (*steps, ("mouseReleased", end)):
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)


def test_a_rectangle_in_the_scatter_plot_fades_elsewhere(page: Browser) -> None:
    page.run("document.querySelector('#scatter').scrollIntoView({block: 'center', behavior: 'instant'})")
    box = [page.run(f"dseReport.scatterAt({x}, {y})") for x, y in ((5, 500), (45, 250))]
    drag(page, *box)
    page.wait("dseReport.state.kept !== null && dseReport.state.kept.length === 9")
    expected = page.run("dseReport.data.front.filter((r) => r.o0 <= 45 && r.o1 <= 500).map((r) => r.id)")
    assert [sorted(part) for part in kept(page)] == [sorted(expected)] * 3


def on_axis(page: Browser, axis: int, places: Sequence[float]) -> list[list[float]]:
    """Where places between the worst (0) and the best (1) value of an objective are in the window."""
    return list(
        page.run(
            f"""(() => {{
          document.querySelector('#parallel').scrollIntoView({{block: 'center', behavior: 'instant'}});
          return {json.dumps(places)}.map((place) => dseReport.parallelAt({axis}, place));
        }})()"""
        )
    )


def test_a_stretch_of_an_axis_keeps_what_passes_it(page: Browser) -> None:
    low, high = on_axis(page, 1, [0.6, 1.02])
    drag(page, low, high)
    page.wait("dseReport.state.kept !== null")
    expected = page.run("dseReport.data.front.filter((r) => r.n1 >= 0.6).map((r) => r.id)")
    assert 0 < len(expected) < 39
    assert [sorted(part) for part in kept(page)] == [sorted(expected)] * 3
    assert page.run("dseReport.state.bands")["1"] == pytest.approx([0.6, 1], abs=0.01)
    drawn = page.run("[...document.querySelectorAll('#parallel .bands line')].map((line) => line.dataset.axis)")
    assert drawn == ["1"]
    assert "b=1%3A" in page.run("location.hash")
    page.click(*on_axis(page, 1, [0.8])[0])
    page.wait("dseReport.state.kept === null")
    assert page.run("document.querySelectorAll('#parallel .bands line').length") == 0
    assert page.run("dseReport.state.chosen") == 1  # taking hold of an axis chooses no line
    assert page.problems() == []


def test_axes_show_any_metric(page: Browser, folder: Path) -> None:
    data = json.loads((folder / "inmark.json").read_text(encoding="utf-8"))
    name = "latency of gnss_to_sprayer"
    page.run(
        f"""(() => {{ const select = document.getElementById('across');
        select.value = 'm' + dseReport.data.decide.metrics.findIndex((metric) => metric.name === '{name}');
        select.dispatchEvent(new Event('change')); }})()"""
    )
    title = "[...document.querySelectorAll('#scatter .axis .title')].map((t) => t.textContent)"
    page.wait(f"{title}.includes('{name} [ms]')")
    field = page.run("document.getElementById('across').value")
    rows = {row["id"]: row[field] for row in page.run("dseReport.data.front")}
    assert set(points_drawn(page)) == set(rows)
    assert rows == {point["id"]: pytest.approx(point["metrics"][name] / 1e6) for point in data["front"]}
    assert page.problems() == []


def test_the_front_is_shown_among_all_feasible_designs(page: Browser) -> None:
    narrow = page.run("dseReport.scatterEnds()")[1]
    page.run("document.getElementById('among').click()")
    page.wait("dseReport.data.feasible.length === document.querySelectorAll('#scatter .feasible circle').length")
    said = page.run("document.getElementById('among').parentElement.textContent")
    assert page.run("dseReport.data.feasible.length") > 3000 and "3 554 feasible designs" in said
    ends = page.run("dseReport.scatterEnds()")
    places = page.run("dseReport.data.feasible.map((row) => row[0])")
    assert ends[0] < min(places) and max(places) < ends[1] and narrow <= ends[1]
    assert page.problems() == []


def test_the_keyboard_is_enough(page: Browser) -> None:
    page.press("Tab", 9)
    assert page.run("document.activeElement.className") == "skip"
    assert page.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert page.run("document.activeElement.getBoundingClientRect().left") >= 0
    page.run("document.querySelector('#front-table input:checked').focus()")
    page.press("ArrowDown", 40)
    page.wait("dseReport.state.chosen === 2")
    assert selected(page) == [2] * 7


def test_a_screen_reader_has_names_and_tables(page: Browser) -> None:
    assert page.run("document.documentElement.lang") == "en"
    assert page.run("[...document.querySelectorAll('figure')].every((f) => f.querySelector('figcaption'))")
    assert page.run("[...document.querySelectorAll('input, select')].every((e) => e.labels.length || e.ariaLabel)")
    assert page.run("[...document.querySelectorAll('table')].every((t) => t.caption && t.tHead)")
    assert page.run(
        "[...document.querySelectorAll('svg:not([aria-hidden])')]"
        ".every((s) => s.parentElement.ariaLabel || s.querySelector('title'))"
    )
    headings = page.run("[...document.querySelectorAll('h1, h2, h3, h4')].map((h) => Number(h.tagName[1]))")
    assert headings[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(headings))
    rows = page.run("[...document.querySelectorAll('#alternative details table')].map((t) => t.tBodies[0].rows.length)")
    first = Document(dse.solve(example_path("inmark"), processing="execution_time")).alternatives[0]
    assert rows[0] == len(first.flows[0].source.rows) + 1  # every row, also those without time, and the total


def test_the_chosen_row_is_scrolled_into_sight(page: Browser) -> None:
    page.run("dseReport.choose(38)")
    frame, row = page.run(
        """['#front .scroll', '#front-table tr.chosen'].map((name) => {
          const box = document.querySelector(name).getBoundingClientRect();
          return [box.top, box.bottom];
        })"""
    )
    assert frame[0] < row[0] < row[1] < frame[1]


def test_the_chosen_point_and_its_label_lie_in_front(page: Browser) -> None:
    page.run("dseReport.choose(12)")
    marks = "[...document.querySelector('#scatter .marks').children].map((m) => m.textContent)"
    assert page.run(marks)[-1] == "A #12"
    order = "[...document.querySelector('#scatter svg').children].map((g) => g.classList[0])"
    assert page.run(order).index("points") < page.run(order).index("marks")


def test_what_a_limit_excludes_is_said_to_a_screen_reader(page: Browser) -> None:
    page.run(
        """(() => { const input = document.getElementById('limit-1'); input.value = '0';
        input.dispatchEvent(new Event('input')); })()"""
    )
    page.wait("dseReport.state.kept !== null")
    said = page.run("[...document.querySelectorAll('#front-table tr.out input')].map((e) => e.ariaLabel)")
    assert said
    assert all(text.endswith(", outside the limits") for text in said)


def test_on_paper_it_is_light_and_whole(browser: Browser, folder: Path) -> None:
    browser.open(folder / "inmark.html", dark=True, media="print")
    assert browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.run("getComputedStyle(document.getElementById('limits')).display") == "none"
    frame = browser.run("getComputedStyle(document.querySelector('#front .scroll')).maxHeight")
    assert frame == "none"  # every row of the table
    browser.run("window.dispatchEvent(new Event('beforeprint'))")
    assert browser.run("[...document.querySelectorAll('details')].every((node) => node.open)")
    widths = browser.run(
        "[...document.querySelectorAll('.plot > svg')].map((s) => s.clientWidth / s.closest('.plot').clientWidth)"
    )
    assert len(widths) == 4 and all(width == pytest.approx(1, abs=0.01) for width in widths)
    assert browser.run("getComputedStyle(document.querySelector('.axes')).display") == "none"
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    assert browser.run("[...document.querySelectorAll('#alternative details')].every((node) => !node.open)")
    assert browser.problems() == []


def page_of(result: dse.Result, folder: Path) -> Path:
    """The HTML file of a result."""
    files = dict(report_files(Document(result)))
    path = folder / "page.html"
    path.write_text(next(text for name, text in files.items() if name.endswith(".html")), encoding="utf-8")
    return path


@pytest.mark.parametrize(("width", "media"), [(390, ""), (718, "print")], ids=["phone", "paper"])
def test_long_names_and_many_decisions_fit(browser: Browser, tmp_path: Path, width: int, media: str) -> None:
    long = "a_flow_with_a_name_that_goes_on_and_on_" * 3
    text = example_path("autoware_reference").read_text(encoding="utf-8").replace("lidar_to_wheels", long)
    browser.open(page_of(dse.solve(dse.loads(text)), tmp_path), width, media=media)
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.problems() == []
    titles = browser.run("[...document.querySelectorAll('#scatter .axis .title')].map((t) => t.textContent)")
    assert any("[ms]" in title for title in titles)  # the unit is not cut off


def test_hostile_names_are_text(browser: Browser, tmp_path: Path) -> None:
    result = hostile_result()
    browser.open(page_of(result, tmp_path))
    for point in result.front:
        browser.run(f"dseReport.choose({point.id})")
        assert browser.run("document.querySelectorAll('script').length") == 2
        assert (
            browser.run("document.querySelectorAll('img, b:not(p b):not(li > b):not(.next > b), iframe').length") == 0
        )
        assert browser.run("[...document.querySelectorAll('*')].every((e) => !e.onerror && !e.onclick)")
    assert "<script>alert('x')</script>" in browser.run("document.querySelector('h1').textContent")
    assert browser.problems() == []
    assert [url for url in browser.requests() if "x.invalid" in url] == []


def test_one_objective_is_a_line_of_points(browser: Browser, tmp_path: Path) -> None:
    browser.open(page_of(dse.solve(example_path("starter"), minimise="price"), tmp_path))
    assert browser.problems() == []
    assert points_drawn(browser) == [1]
    assert browser.run("document.querySelector('.axes').offsetHeight") == 0
    assert browser.run("document.getElementById('parallel')") is None  # a line without another axis says nothing


ONE_CLOCK = """
dse: 1
name: On one clock
deadlines: all
processor_types: {slow: {price: 1 EUR}, fast: {price: 2 EUR}}
processors: {cpu: {type: [slow, fast]}}
devices: {sensor: {period: 50 ms}, valve: {}}
threads:
  filter: {processor: cpu, period: 10 ms, offset: 0 ms, compute_execution_time: {slow: 2 ms .. 3 ms, fast: 1 ms}}
  control: {processor: cpu, period: 20 ms, offset: 0 ms, compute_execution_time: {slow: 4 ms .. 6 ms, fast: 2 ms}}
connections:
  in: {from: sensor, to: filter}
  state: {from: filter, to: control}
  out: {from: control, to: valve}
flows: {chain: {path: [sensor, filter, control, valve]}}
objectives: [minimise latency of chain, minimise price]
"""


def test_timers_and_deadlines_are_drawn_and_follow_the_choice(browser: Browser, tmp_path: Path) -> None:
    """Response times in % of the deadlines, the nearest first, and the timeline of the timers on one clock."""
    browser.open(page_of(dse.solve(dse.loads(ONE_CLOCK)), tmp_path))
    drawn = {}
    for number in (1, 2):
        browser.run(f"dseReport.choose({number})")
        kinds = browser.run("[...document.querySelectorAll('#alternative .plot')].map((node) => node.dataset.plot)")
        assert {"flow", "timeline", "deadlines", "usage"} == set(kinds)
        assert browser.run("[...document.querySelectorAll('#alternative .plot > svg')].length") == len(kinds)
        texts = "[...document.querySelectorAll('#alternative [data-plot=deadlines] text.rim')]"
        rows = browser.run(f"{texts}.map((t) => t.firstChild.textContent)")
        type_ = browser.run("document.querySelector('#front-table tr.chosen').textContent")
        drawn["slow" if "slow" in type_ else "fast"] = rows
    assert drawn["slow"] == ["control, core 1 · 9 ms of 20 ms", "filter, core 1 · 3 ms of 10 ms"]
    assert drawn["fast"] == ["control, core 1 · 3 ms of 20 ms", "filter, core 1 · 1 ms of 10 ms"]
    assert browser.problems() == []
