"""Traces and bags against a problem, and a bag's sizes and rates in an import."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run
from tests.answers.written import write_bag
from tests.importers.test_trace import happenings, put, text

SLOW = 1.5


def imported(folder: Path) -> str:
    """The problem that the trace makes, with a flow and limits."""
    found = dse.import_file(put(folder, text()), cores="2").text
    flow = "flows: {look: {path: [front.cam.timer, track.on.image]}}\n"
    return found + flow + "requirements: [latency of look <= 8 ms, utilisation of computer <= 50 %]\n"


def test_the_trace_that_made_a_problem_is_as_it_says(tmp_path: Path) -> None:
    problem = imported(tmp_path)
    found = dse.compare_measured(problem, tmp_path / "trace.txt")
    assert {item.name for item in found.inputs} == {
        "execution time of front.cam.timer",
        "period of front.cam.timer",
        "execution time of track.on.image",
        "execution time of track.on.stop",
    }
    assert found.is_as_predicted and found.still_holds


def test_a_later_trace_tells_what_has_drifted(tmp_path: Path) -> None:
    """Everything takes half as long again: 1.5 ms .. 1.6485 ms and 5.8515 ms .. 6 ms; the timer comes every 30 ms."""
    (tmp_path / "p.yaml").write_text(imported(tmp_path), encoding="utf-8")
    later = put(tmp_path, text([(int(time * SLOW), *rest) for time, *rest in happenings()]), "later.txt")
    assert run(["compare", str(tmp_path / "p.yaml"), "--measured", later]) == 4
    found = dse.compare_measured(tmp_path / "p.yaml", later)
    drifted = {item.name: item.counted for item in found.inputs if item.drifted}
    assert drifted["execution time of front.cam.timer"] == (1_000_000, 1_648_500)
    assert drifted["period of front.cam.timer"] == (30_000_000, 30_000_000)
    [latency] = [item for item in found.requirements if item.text.startswith("latency")]
    assert latency.values == (5_599_000, 8_398_500) and latency.holds == (True, False)
    row = found.frame("ms").set_index("name").T[latency.text]
    assert [row["to"], row["verdict"], row["unit"]] == [8.3985, "broken", "ms"]


def test_files_of_one_figure_count_together(tmp_path: Path) -> None:
    """A CSV file with 9 ms, and the trace, twice, which has 1 to 1.099 ms: in whatever order they come."""
    problem = imported(tmp_path).replace("1 ms .. 1.099 ms", "1 ms .. 1.05 ms", 1)
    path, trace = tmp_path / "m.csv", tmp_path / "trace.txt"
    path.write_text("metric,min,max\nexecution time of front.cam.timer,1.2 ms,9 ms\n", encoding="utf-8")
    found = dse.compare_measured(problem, path, trace, trace)
    assert len(found.inputs) == 4
    [longest] = [item for item in found.inputs if item.drifted]
    assert longest.counted == (1_000_000, 9_000_000) and longest.seen.count is None
    assert [item.seen.count for item in found.inputs if item.name == "period of front.cam.timer"] == [198]
    assert found.requirements == dse.compare_measured(problem, trace, path).requirements


def test_callbacks_are_found_by_node_and_period_or_topic(tmp_path: Path) -> None:
    """In a problem whose threads go by other names, as those of CARET do."""
    text_ = imported(tmp_path).replace("front.cam.timer", "front.cam.callback_0").replace("track.on.image", "track.see")
    found = dse.compare_measured(text_, put(tmp_path, text()))
    assert "period of front.cam.callback_0" in {item.name for item in found.inputs}
    assert "execution time of track.see" in {item.name for item in found.inputs}
    other = text_.replace("/front/cam", "/rear/cam")
    assert "that are no threads here: /front/cam/timer" in str(
        dse.compare_measured(other, tmp_path / "trace.txt").remarks
    )


def test_bags_are_held_against_sizes_and_rates(tmp_path: Path) -> None:
    """Three messages of 4 to 6 B, 15 ms apart on average."""
    problem = """{dse: 1, name: x, devices: {a: {period: 15 ms}, b: {}},
        connections: {chatter: {from: a, to: b, data_size: 5 B}}}"""
    write_bag(tmp_path / "seen.bag")
    found = dse.compare_measured(problem, tmp_path / "seen.bag")
    size, rate = found.inputs
    assert (size.name, size.seen.high, size.drifted) == ("data size of chatter", 6, True)
    assert rate.name == "rate of chatter" and not rate.drifted
    with pytest.raises(dse.UsageError, match="nothing in it is of this problem"):
        dse.compare_measured(problem.replace("chatter", "news"), tmp_path / "seen.bag")


def test_a_bag_gives_an_import_its_sizes_and_rates(tmp_path: Path) -> None:
    configuration = (
        "callback_groups:\n  - {id: /b@Subscription(/chatter), policy: SCHED_OTHER, priority: 0, affinity: ~}\n"
    )
    write_bag(tmp_path / "seen.bag")
    path = put(tmp_path, configuration, "cie.yaml")
    assert run(["import", path, "--bag", str(tmp_path / "seen.bag"), "-o", str(tmp_path / "p.yaml")]) == 0
    data = yaml.safe_load((tmp_path / "p.yaml").read_text(encoding="utf-8"))
    [wire] = data["connections"].values()
    assert (wire["data_size"], wire["rate"]) == ("6 B", "200/3 Hz")
    assert wire["source"].endswith("seen.bag: 3 messages of 4 to 6 B")
