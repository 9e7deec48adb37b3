"""Break-points of limits against what is solved anew under single limits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from dse.cli.main import run
from dse.questions.problem import changed, loads
from dse.questions.question import QuestionChanges
from dse.questions.sweep.axes import LimitAxis, limited, read_axis, read_limit_axis
from dse.questions.sweep.break_points import break_points
from dse.questions.sweep.fronts import front_outcome
from dse.questions.sweep.inputs_of_file import Inputs, merged_data
from dse.space.model.space import Space
from tests.questions.studies import LONG, NAMES, example

UNITS = {"ns": "ns", "ct": "EUR", "ppm": "ppm", "B/s": "B/s", "mW": "mW", "nm": "nm"}


def ranges(space: Space) -> list[str]:
    """What is varied, over more than the whole interval of interest."""
    found = [f"jitter of {flow.name}=1us..400ms" for flow in space.flows]
    found += [f"latency of {flow.name}=1us..900ms" for flow in space.flows[:1]]
    found += [f"utilisation of {slot.name}=1%..100%" for slot in space.processors[:1]]
    found += [f"load of {bus.name}=1%..60%" for bus in space.buses if bus.bandwidth_bps is not None][:1]
    found.append(f"price=1 {space.currency}..5000 {space.currency}")
    return found if LONG else [found[0], *found[-3:]]


CASES = [(name, text) for name in NAMES for text in ranges(example(name).space)]


def solved_anew(space: Space, axis: LimitAxis, value: Fraction, unit: str) -> set[tuple[Any, ...]]:
    """The front of the remaining objectives under one limit, by a search of its own."""
    rest = tuple(item for item in space.objectives if item.metric != axis.metric) or space.objectives
    text = f"{value / 100} {space.currency}" if unit == "ct" else f"{value} {unit}"
    single = read_limit_axis(space, axis.name, f"{axis.operator} {text}")
    return vectors(front_outcome(replace(limited(space, single.values[0]), objectives=rest), 0))


def vectors(outcome: dict[str, Any]) -> set[tuple[Any, ...]]:
    names = [info["name"] for info in outcome["objectives"]]
    return {tuple(item["metrics"][name] for name in names) for item in outcome["front"]}


def stretch_vectors(outcome: dict[str, Any], stretch: dict[str, Any]) -> set[tuple[Any, ...]]:
    names = [info["name"] for info in outcome["objectives"]]
    known = {item["id"]: item for item in outcome["alternatives"]}
    return {tuple(known[entry["id"]]["metrics"][name] for name in names) for entry in stretch["front"]}


def expected(outcome: dict[str, Any], value: Fraction) -> set[tuple[Any, ...]]:
    """The front that the break-points tell for a limit (``<=``)."""
    found: set[tuple[Any, ...]] = set()
    for stretch in outcome["stretches"]:
        if Fraction(stretch["from"]) <= value:
            found = stretch_vectors(outcome, stretch)
    return found


@pytest.mark.parametrize(("name", "text"), CASES)
def test_break_points_agree_with_a_grid(name: str, text: str) -> None:
    """Just below each break-point, on it, and between; and a grid over the whole interval."""
    problem = example(name)
    if not problem.space.objectives:
        pytest.skip("no objectives")
    axis = read_axis(problem, Inputs(merged_data(problem)), text)
    assert isinstance(axis, LimitAxis)
    outcome = break_points(problem.space, axis, 0)
    low, high = Fraction(outcome["from"]), Fraction(outcome["to"])
    if outcome["status"] == "infeasible":
        assert not solved_anew(problem.space, axis, high, outcome["unit"])
        return
    starts = [Fraction(stretch["from"]) for stretch in outcome["stretches"]]
    assert starts == sorted(starts) and len(set(starts)) == len(starts)
    assert all(one != other for one, other in pairwise(stretch_vectors(outcome, item) for item in outcome["stretches"]))
    count = 40 if LONG else 3
    places = {low + (high - low) * number / count for number in range(count + 1)}
    shown = starts if LONG else [starts[0], starts[len(starts) // 2], starts[-1]]
    places |= set(shown) | {start - Fraction(1, 1000) for start in shown if start > low}
    for place in sorted(places):
        assert solved_anew(problem.space, axis, place, outcome["unit"]) == expected(outcome, place), float(place)


def test_lower_limits_are_swept_from_the_other_side() -> None:
    problem = example("starter")
    space = problem.space
    axis = read_axis(problem, Inputs(merged_data(problem)), f"min latency of {space.flows[0].name}>=1us..20ms")
    assert isinstance(axis, LimitAxis)
    outcome = break_points(space, axis, 0)
    values = [Fraction(stretch["from"]) for stretch in outcome["stretches"]]
    assert values == sorted(values, reverse=True) and outcome["infeasible_until"] is not None
    for stretch in outcome["stretches"]:
        assert solved_anew(space, axis, Fraction(stretch["from"]), "ns") == stretch_vectors(outcome, stretch)


def test_the_limit_of_the_file_gives_way() -> None:
    """The varied limit stands in the place of every other on the same metric, which would hide what lies beyond it."""
    problem = example("inmark_chapter2")
    tighter = changed(problem, QuestionChanges(limits=[("jitter", "f_gnss_lat=60 ms")]))
    axis = read_axis(problem, Inputs(merged_data(problem)), "jitter of f_gnss_lat=1ms..900ms")
    assert isinstance(axis, LimitAxis)
    assert break_points(tighter.space, axis, 0) == break_points(problem.space, axis, 0)


SEVERAL = """
dse: 1
name: several
processor_types: {a: {cores: 1, price: 50 EUR}, b: {cores: 2, price: 90 EUR}}
bus_types: {slow: {bandwidth: 20 kbit/s}, fast: {bandwidth: 50 kbit/s, price: 20 EUR}}
processors: {p: {type: [a, b]}, q: {type: [a, b], optional: true}}
buses: {left: {type: [slow, fast]}, right: {type: [slow, fast], optional: true}}
devices: {s: {period: 20 ms}, v: {period: 10 ms}}
threads:
  t1: {processor: [p, q], period: [10 ms, 20 ms], compute_execution_time: {a: 1 ms .. 4 ms, b: 1 ms .. 3 ms}}
  t2: {processor: [p, q], period: [10 ms, 20 ms], compute_execution_time: {a: 1 ms .. 5 ms, b: 1 ms .. 3 ms}}
  t3: {processor: [p, q], period: 30 ms, compute_execution_time: 2 ms .. 7 ms}
connections:
  c1: {from: s, to: t1, data_size: 8 B, bus: [left, right]}
  c2: {from: t1, to: t2}
  c3: {from: t2, to: v, data_size: 16 B, bus: [left, right]}
  c4: {from: s, to: t3}
flows: {f: {path: [s, t1, t2, v]}, g: {path: [s, t3]}}
requirements: [utilisation <= 150 %, load <= 90 %]
objectives: [minimise price, minimise latency, minimise utilisation of p]
"""


@pytest.mark.parametrize(
    "vary",
    [
        "utilisation=20%..140%", "utilisation>=0%..40%", "load=5%..90%", "load=100B/s..3KB/s", "latency=40ms..90ms",
        "jitter>=5ms..60ms", "max(price of p, 2 * price of q)=10EUR..300EUR",
    ],
)  # fmt: skip
def test_a_limit_on_all_of_a_kind(vary: str) -> None:
    """Its break-points are where the front changes when each of them is limited so."""
    problem = loads(SEVERAL)
    axis = read_axis(problem, Inputs(merged_data(problem)), vary)
    assert isinstance(axis, LimitAxis)
    outcome = break_points(problem.space, axis, 0)
    assert outcome["status"] == "complete" and outcome["metric"] == vary.replace(">", "=").partition("=")[0]
    starts = [Fraction(stretch["from"]) for stretch in outcome["stretches"]]
    sign = 1 if axis.operator == "<=" else -1
    assert len(starts) > 1
    places = [*starts, *((one + other) / 2 for one, other in pairwise(starts))]
    for place in places if LONG else places[:: len(places) // 6 + 1]:
        expected = [
            stretch_vectors(outcome, stretch)
            for stretch in outcome["stretches"]
            if sign * Fraction(stretch["from"]) <= sign * place
        ]
        assert solved_anew(problem.space, axis, place, outcome["unit"]) == expected[-1], float(place)


def test_a_sweep_over_all_of_a_kind(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "several.yaml"
    file.write_text(f"{SEVERAL.rstrip()}\nprocessing: execution_time\n", encoding="utf-8")
    assert run(["sweep", str(file), "--vary", "utilisation=50%..70%", "--no-store"]) == 0
    text = capsys.readouterr().out
    assert "utilisation <= 50 % .. 70 %" in text and "proved: 4 break-points; nothing changes between them" in text
    assert run(["sweep", str(file), "--vary", "latency=70ms,90ms", "--no-store", "--workers", "1"]) == 0
    assert "latency <= 70ms" in capsys.readouterr().out
