"""Messages of sizes that transmission times are not stated for: remarked wherever somebody looks, and counted."""

from __future__ import annotations

import pytest

import dse
from dse.report.words.reasons import extrapolated_words

PROBLEM = """
dse: 1
name: sizes
processor_types: {small: {price: 60 EUR}, big: {price: 90 EUR}}
bus_types:
  ipc:
    virtual: true
    overhead: 10 B
    transmission_time:
      small: {fixed: 1 us .. 2 us, per_byte: 1 ns .. 2 ns, sizes: 11 B .. 3 kB}
      big: {fixed: 1 us .. 2 us, per_byte: 1 ns}
  wire: {bandwidth: 100 Mbit/s, transmission_time: {fixed: 1 us, per_byte: 8 us, sizes: 2 KB}}
processors: {p: {type: [small, big]}}
buses: {can: {type: wire}}
devices: {lamp: {period: 1 s}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {small: 1 ms, big: 0.5 ms}}
  b: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
connections:
  scan: {from: a, to: b, data_size: [2 KB, 2990 B, 3 KB], bus: ipc}
  tiny: {from: b, to: a, data_size: 1 B, bus: ipc}
  image: {from: a, to: lamp, data_size: [2 KB, 2001 B], bus: can}
flows: {f: {path: [a, b]}}
objectives: [minimise latency of f, minimise price]
"""
WORDS = "transmission times are extrapolated to sizes of messages that they are not stated for: "


def found(texts: tuple[str, ...]) -> list[str]:
    return [text.removeprefix(WORDS) for text in texts if text.startswith(WORDS)]


def test_check_tells_which_messages_may_be_outside() -> None:
    told = found(dse.check(dse.loads(PROBLEM)).remarks)
    assert told == ["scan (3010 B; ipc: 11 B .. 3 KB), image (2001 B; can: 2 KB)"]


@pytest.mark.parametrize(
    ("computer", "scan", "image", "told"),
    [
        ("small", "2990 B", "2 KB", []),  # 3 KB with overhead, and 11 B of tiny: both borders are inside
        ("small", "3 KB", "2 KB", ["scan (3010 B; ipc: 11 B .. 3 KB)"]),
        ("big", "3 KB", "2 KB", []),
        ("big", "3 KB", "2001 B", ["image (2001 B; can: 2 KB)"]),
    ],
)
def test_analyse_tells_which_are(computer: str, scan: str, image: str, told: list[str]) -> None:
    design = {"p.type": computer, "scan.data_size": scan, "image.data_size": image}
    assert found(dse.analyse(dse.loads(PROBLEM), design).warnings) == told


def test_a_front_tells_in_which_designs() -> None:
    fixed = {"scan.data_size": "3 KB", "image.data_size": "2 KB"}
    result = dse.solve(dse.loads(PROBLEM), fix=fixed)
    [small] = [point.id for point in result.front if point.decisions["p.type"] == "small"]
    assert len(result.front) == 2
    assert extrapolated_words(result) == f"In #{small} {WORDS}scan (3010 B; ipc: 11 B .. 3 KB)."
    ruled = PROBLEM + "rules: [small implies scan.data_size <= 2990 B]\n"
    within = dse.solve(dse.loads(ruled), fix=fixed)
    assert extrapolated_words(within) == ""


def test_what_they_are_stated_for_changes_no_figure() -> None:
    without = PROBLEM.replace(", sizes: 11 B .. 3 kB", "").replace(", sizes: 2 KB", "")
    fronts = [[point.objectives for point in dse.solve(dse.loads(text)).front] for text in (PROBLEM, without)]
    assert fronts[0] == fronts[1] and "sizes" not in without.partition("bus_types")[2]
    assert found(dse.check(dse.loads(without)).remarks) == []
