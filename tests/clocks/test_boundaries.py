"""What data just miss on one clock, and the offset that saves, held against the analysis of changed problems."""

from __future__ import annotations

import copy
import json
import random
from typing import Any

import pytest

import dse
from dse.answers.analysis import Analysis
from dse.answers.ranking.reasons import Reasoner
from dse.report.content.analyse import analysis_page
from dse.report.content.explain import explanation_page
from dse.report.page import Listing
from dse.report.words.clocks import boundary_words
from dse.report.words.reasons import SAME, sentences
from tests.clocks import let
from tests.helpers.effort import cases


def chain(*offsets: str, times: str = "1 ms .. 3500 us") -> dict[str, Any]:
    """Implicit timers of 20 ms; the first takes `times`, the others 1 ms."""
    data = let.problem([(0, 20, 20)] * len(offsets))
    for number, (offset, thread) in enumerate(zip(offsets, data["threads"].values(), strict=True)):
        thread |= {"offset": offset, "compute_execution_time": "1 ms" if number else times}
        del thread["communication"]
    return data


def test_what_is_just_missed_is_told_with_the_offset_that_saves() -> None:
    found = dse.analyse(chain("0 ms", "0 ms"), {})
    said = "chain: t1 just misses t0: offset 3.5 ms instead of 0 ms saves 16.5 ms of latency."
    assert boundary_words(found.boundaries) == [said]
    [boundary] = found.boundaries
    assert (boundary.room_ns, boundary.is_crossed) == (16_500_000, False)
    section = next(item for item in analysis_page(found).sections if item.name == "clocks")
    assert said in section.texts and [plot.name for plot in section.plots] == ["timeline-chain"]
    assert found.to_dict()["boundaries"][0]["better"] == {"offset_ns": 3500000, "saves_ns": 16500000, "costs_ns": {}}
    [said] = boundary_words(dse.analyse(chain("0 ms", "0 ms", "5 ms"), {}).boundaries)
    assert said == "chain: t1 just misses t0: offset 3.5 ms instead of 0 ms saves 20 ms of latency."  # t2 waits for it


def test_connections_may_be_more_than_components() -> None:
    """Before, the number of a connection on the way was looked up among the components."""
    data = chain("0 ms", "0 ms")
    more = {f"x{number}": {"from": "t0", "to": "t1", "port": "data"} for number in range(6)}
    data["connections"] = {**more, "last": {"from": "t0", "to": "t1"}}
    data["flows"]["chain"]["path"] = ["t0", "last", "t1"]
    assert [item.receiver for item in dse.analyse(data, {}).boundaries] == ["t1"]


def test_what_some_data_meet_and_others_miss() -> None:
    [said] = boundary_words(dse.analyse(chain("0 ms", "3 ms"), {}).boundaries)
    assert said == (
        "chain: t1 meets some data of t0 and misses others, there 1 ms .. 3.5 ms after its release: offset 3.5 ms "
        "instead of 3 ms saves 19.5 ms of latency."
    )
    assert boundary_words(dse.analyse(chain("0 ms", "3500 us"), {}).boundaries) == []


def test_unknown_offsets_of_one_clock() -> None:
    assert boundary_words(dse.analyse(chain("0 ms", "unknown"), {}).boundaries) == [
        "chain: it is not stated when t1 reads t0: offset 3.5 ms instead of unknown saves 20 ms of latency."
    ]
    assert boundary_words(dse.analyse(chain("unknown", "unknown") | {"clocks": {"k": {}}}, {}).boundaries) == [
        "chain: t1 waits up to 20 ms for t0, whose clock it shares: known offsets of both save up to 20 ms."
    ]


def latencies(found: Analysis) -> dict[str, Any]:
    return {flow.name: flow.max_ns for flow in found.flows}


@pytest.mark.parametrize("seed", cases(15))
def test_what_an_offset_saves_is_what_the_analysis_says(seed: int) -> None:
    """The saving, what it costs other flows, that no offset saves more, and how much later data may be there."""
    rng = random.Random(f"boundary {seed}")
    data = let.problem(let.drawn(rng))
    names = list(data["threads"])
    data["flows"]["end"] = {"path": names[-2:]}
    for thread in data["threads"].values():
        if rng.random() < 0.5:
            del thread["communication"]
            thread["compute_execution_time"] = f"1 us .. {rng.randint(1, 4)} ms"
    found = dse.analyse(data, {})
    today = latencies(found)
    for item in found.boundaries:
        other = copy.deepcopy(data)
        if item.better is not None:
            other["threads"][item.receiver]["offset"] = f"{item.better.offset_ns} ns"
            moved = latencies(dse.analyse(other, {}))
            assert today[item.flow] - moved[item.flow] == item.better.saves_ns > 0
            longer = {name: moved[name] - today[name] for name in today if moved[name] > today[name]}
            assert longer == item.better.costs_ns
        best = today[item.flow] - (item.better.saves_ns if item.better else 0)
        offset = rng.randrange(int(item.periods_ns[1]))
        other["threads"][item.receiver]["offset"] = f"{offset} ns"
        assert latencies(dse.analyse(other, {}))[item.flow] >= best
        writer = data["threads"][item.sender]
        if "communication" not in writer and item.flow == "end":
            later = copy.deepcopy(data)
            most = item.there_ns[1] + (item.room_ns or 0)
            later["threads"][item.sender]["compute_execution_time"] = f"1 us .. {most} ns"
            assert latencies(dse.analyse(later, {}))["end"] == today["end"]
            later["threads"][item.sender]["compute_execution_time"] = f"1 us .. {most + 1} ns"
            assert latencies(dse.analyse(later, {}))["end"] == today["end"] + item.step_ns


def test_offsets_are_exported_as_ros_2_parameters() -> None:
    """Under the names that the problem states; an offset that nobody knows is refused."""
    data = chain("0 ms", "3500 us") | {"objectives": ["minimise latency of chain"]}
    named = data | {"ros2": {"parameters": {"t1.offset": "phase [int us]"}}}
    assert "phase: 3500  # t1, offset [us]" in dse.export(dse.solve(named), 1, "ros2")
    named["threads"]["t1"]["offset"] = "unknown"
    with pytest.raises(dse.UsageError, match="t1 has no known offset in this design"):
        dse.export(dse.solve(named), 1, "ros2")


def test_explanations_say_what_the_designs_just_miss() -> None:
    """Of the flows whose limits a named design breaks, and of no others."""
    data = chain("0 ms", "0 ms", "5 ms")
    data["threads"]["t1"]["offset"] = ["0 ms", "1 ms"]
    data["requirements"] = ["latency of chain <= 10 ms"]
    found = dse.explain(data)
    [page] = explanation_page(found).sections
    [relaxation] = json.loads(found.to_json())["relaxations"]
    [better] = [item["better"] for item in relaxation["boundaries"] if item["receiver"] == "t1"]
    assert better == {"offset_ns": 3_500_000, "saves_ns": 20_000_000, "costs_ns": {}}
    said = [item.text for block in page.blocks if isinstance(block, Listing) for item in block.items]
    assert any(
        text.startswith("on one clock, chain: t1 meets some data of t0 and misses others")
        and text.endswith("offset 3.5 ms instead of 1 ms saves 20 ms of latency")
        for text in said
    )
    data["requirements"] = ["price <= -1 EUR"]
    [page] = explanation_page(dse.explain(data)).sections
    said = [item.text for block in page.blocks if isinstance(block, Listing) for item in block.items]
    assert said and not any("on one clock" in text for text in said)


def test_another_offset_that_costs_nothing_is_told_beside_the_first_design() -> None:
    """Jitter is none at any offset beyond 3.5 ms and at 0 ms, the first of them, which waits a period for nothing."""
    data = chain("0 ms", "any") | {"offset_grid": "500 us", "objectives": ["minimise jitter of chain"]}
    result = dse.solve(data)
    assert result.front[0].decisions == {"t1.offset": "0 ns"}
    told = [item.text for item in sentences(result, Reasoner(result).reasons(0)) if item.label == SAME]
    assert told == ["t1.offset 3.5 ms instead of 0 ms saves 16.5 ms of latency of chain."]
    coarse = dse.solve(data | {"offset_grid": "2 ms"})
    [spared] = Reasoner(coarse).reasons(0).spared
    assert (spared.offsets_ns, spared.saves_ns) == ((0, 4_000_000), {"chain": 16_000_000})


@pytest.mark.parametrize("change", ["objective", "fixed", "requirement", "other flow"])
def test_an_offset_that_costs_something_is_not_offered(change: str) -> None:
    data = chain("0 ms", "any", "1 ms") | {"offset_grid": "500 us", "objectives": ["minimise jitter of chain"]}
    fixed = "t1.offset = 0 ns" if change == "fixed" else ""
    if change == "objective":
        data["objectives"] = ["minimise latency of chain"]
    elif change == "requirement":
        data["rules"] = ["t1.offset < 1 ms"]
    elif change == "other flow":
        data["flows"]["end"] = {"path": ["t1", "t2"]}
    result = dse.solve(data, fix=fixed) if fixed else dse.solve(data)
    assert Reasoner(result).reasons(0).spared == ()


def test_the_jitter_of_jobs_that_read_when_they_begin_is_remarked() -> None:
    """t1 is released with t0, behind it on one core: what t0 makes is there before t1 begins, not at its release."""
    data = chain("0 ms", "0 ms", times="1 ms .. 2 ms") | {"processing": "response_time"}
    said = "of its jitter are there because jobs may read when they get the CPU, at t1 (after t0)"
    assert [text for text in dse.analyse(data, {}).warnings if text.startswith("chain: ") and said in text]
    for change in ({"offset": "3 ms"}, {"communication": "let"}):
        other = copy.deepcopy(data)
        other["threads"]["t1"] |= change
        assert not [text for text in dse.analyse(other, {}).warnings if said in text]
    assert not [text for text in dse.analyse(data | {"processing": "execution_time"}, {}).warnings if said in text]


def test_what_flows_would_gain_is_said_where_there_are_more_connections_than_components() -> None:
    """The number of a connection was taken for that of a component."""
    wires = "\n".join(f"  w{number}: {{from: a, to: b}}" for number in range(9))
    text = f"""
dse: 1
name: wired
processor_types: {{cpu: {{}}}}
processors: {{p: {{type: cpu}}}}
threads:
  a: {{processor: p, period: 5 ms, compute_execution_time: 1 ms}}
  b: {{processor: p, period: 10 ms, compute_execution_time: 1 ms}}
connections:
{wires}
flows: {{f: {{path: [a, w8, b]}}}}
objectives: [minimise latency of f]
processing: execution_time
"""
    assert any("5 ms" in remark and "clock" in remark for remark in dse.check(dse.loads(text)).remarks)
