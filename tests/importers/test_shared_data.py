"""Data that threads share: AADL's data access, in flows and beside them, in and out again."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from tests.helpers.documents import ROOT
from tests.importers.test_reading import document

FIGURE = ROOT / "problems" / "aadl" / "differential_odometry.aadl"
"""Figure 4.1 of the report."""
SHARED = """
dse: 1
name: shared
profile: %s
processor_types: {small: {}}
processors: {computer: {type: small}}
devices: {encoder: {period: 20 ms, latency: 1 ms .. 2 ms}}
threads:
  on_ticks: {processor: computer, process: odom, dispatch_protocol: aperiodic, compute_execution_time: 1 ms .. 3 ms}
  main_loop: {processor: computer, process: odom, period: [20 ms, 40 ms], compute_execution_time: 1 ms .. 5 ms}
  log: {processor: computer, period: 80 ms, compute_execution_time: 1 ms}
connections:
  ticks: {from: encoder, to: on_ticks}
  sum: {from: on_ticks, to: main_loop, port: data_access, data_size: 8 B}
  kept: {from: main_loop, to: log, port: data access}
flows: {f: {path: [encoder, on_ticks, main_loop]}}
objectives: [minimise utilisation of computer]
"""


@pytest.mark.parametrize(("profile", "worst_us"), [("osate-2.19", 2_750), ("osate-2.2", 24_800), ("dse", 22_750)])
def test_what_shared_data_wait_for_their_reader(profile: str, worst_us: int) -> None:
    """0.4 ms of the encoder, 0.05 of its callback, 0.3 of the timer's thread, 2 of the localisation.

    20 ms of sampling are not counted by OSATE 2.19, which samples data ports and abstract features alone
    (FlowLatencyAnalysisSwitch). OSATE 2.2 has a queue of one in front of the two threads that messages dispatch.
    """
    found = dse.analyse(FIGURE, profile=profile, worst_case="execution_time")
    assert [flow.max_ns for flow in found.flows] == [worst_us * 1000] * 2


def test_what_osate_leaves_out_is_a_warning_with_the_latency_that_has_it() -> None:
    told = [text for text in dse.analyse(FIGURE).warnings if "has access to" in text]
    assert [text.partition(": ")[2] for text in told] == [
        f"with it, as of a data port, {flow} takes 820 us .. 22.75 ms" for flow in ("left_to_pose", "right_to_pose")
    ]


def test_a_lock_is_told_with_what_counts_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(FIGURE)]) == 0
    [told] = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert "nodes.differential_odom.state is shared under priority_ceiling" in told
    assert "is not counted, unless the threads state how long they have it as `non_preemptive`" in told


ACCESS = """
  data store end store;
  thread writer features a : requires data access store {Access_Right => %s;}; end writer;
  thread reader features a : requires data access store {Access_Right => %s;}; end reader;
  process soft end soft;
  process implementation soft.i
    subcomponents w : thread writer; r : thread reader; d : data store;
    connections one : data access w.a -> d; other : data access d -> r.a;
  end soft.i;
  system top end top;
  system implementation top.i subcomponents p : process soft.i; end top.i;
"""


@pytest.mark.parametrize(
    ("rights", "expected"),
    [
        (("write_only", "read_only"), [("p.w", "p.d"), ("p.d", "p.r")]),
        (("read_write", "read_only"), [("p.d", "p.r")]),
        (("read_only", "read_write"), [("p.d", "p.w")]),  # whatever the arrow says
        (("read_write", "by_method"), []),
    ],
)
def test_access_rights_say_who_writes_and_who_reads(
    tmp_path: Path, rights: tuple[str, str], expected: list[tuple[str, str]]
) -> None:
    wires = document(tmp_path, ACCESS % rights).get("connections", {})
    assert sorted((wire["from"], wire["to"]) for wire in wires.values()) == sorted(expected)
    assert all(wire["port"] == "data_access" for wire in wires.values())


@pytest.mark.parametrize("profile", ["dse", "osate-2.2", "osate-2.19"])
def test_shared_data_come_back_from_aadl(tmp_path: Path, profile: str) -> None:
    """What a flow leads over, and what none does."""
    source, out = tmp_path / "p.yaml", tmp_path / "x.aadl"
    source.write_text(SHARED % profile, encoding="utf-8")
    result = dse.solve(source)
    out.write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    again = dse.analyse(out, profile=profile)
    assert again.metrics["latency of f"] == result.front[0].metrics["latency of f"]
    wires = document(tmp_path, out.read_text(encoding="utf-8"))["connections"]
    assert [name for name, wire in wires.items() if wire.get("port") == "data_access"] == ["sum", "kept"]


def test_shared_data_need_no_execution_time() -> None:
    """The data are a thread of `category: data` on the processor that the process is bound to."""
    text = SHARED % "dse"
    text = text.replace("  log: {", "  state: {category: data, processor: computer}\n  log: {")
    text = text.replace(
        "to: main_loop, port: data_access, data_size: 8 B}",
        "to: state, port: data_access}\n  read: {from: state, to: main_loop, port: data_access}",
    )
    text = text.replace("on_ticks, main_loop]", "on_ticks, state, main_loop]").replace("[20 ms, 40 ms]", "20 ms")
    assert not any("no execution time" in told for told in dse.analyse(dse.load(text)).warnings)
    assert any(
        "no execution time" in told for told in dse.analyse(dse.load(text.replace("category: data, ", ""))).warnings
    )
