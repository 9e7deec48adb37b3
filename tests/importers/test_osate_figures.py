"""The latencies that OSATE's rules give for small models, through the importer, with the arithmetic shown."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.space.settings import osate_settings
from tests.importers.test_reading import document, written
from tests.small import MS

USUAL = "AS-MF-DL-EQ-EQL"


def latencies(tmp_path: Path, text: str, settings: str = USUAL, **options: Any) -> dict[str, tuple[Fraction, Fraction]]:
    """Minimum and maximum of each flow in ms."""
    model = dse.Model(written(tmp_path, text), **options)
    found = dse.analyse(model, **osate_settings(settings))  # type: ignore[arg-type]
    return {flow.name: (Fraction(flow.min_ns) / MS, Fraction(flow.max_ns) / MS) for flow in found.flows}


# --- partitions ---------------------------------------------------------------------------------------------------

HALVES = """
  abstract half
    features f : feature;
    properties Latency => 3 ms .. 4 ms;
  end half;
  virtual processor window
    properties Period => 10 ms;
  end window;
  processor module end module;
"""
WHOLE = """
  system top end top;
  system implementation top.i
    subcomponents a : abstract half; b : abstract half; v : virtual processor window; w : virtual processor window;
      m : processor module;
    connections c : feature a.f -> b.f;
    flows e : end to end flow a -> c -> b;
    properties
      %s
  end top.i;
"""
BOTH = """
      Actual_Processor_Binding => (reference (v)) applies to a;
      Actual_Processor_Binding => (reference (w)) applies to b;
      Actual_Processor_Binding => (reference (m)) applies to v, w;
"""
SCHEDULE = """
      ARINC653::Module_Schedule => ([Periodic_Processing_Start => true;],
        [Partition => reference (w); Duration => 2 ms;], [Partition => reference (v); Duration => 5 ms;]) applies to m;
"""


def partitioned(properties: str) -> str:
    return f"package m public with ARINC653; {HALVES} {WHOLE % properties} end m;"


ALONE = """
      Period => 0 ms applies to v; Execution_Time => 6 ms applies to v;
      Actual_Processor_Binding => (reference (v)) applies to a;
"""
FRAMED = """
      ARINC653::Module_Major_Frame => 25 ms applies to m;
      Actual_Processor_Binding => (reference (w)) applies to b;
      Actual_Processor_Binding => (reference (m)) applies to w;
"""


@pytest.mark.parametrize(
    ("properties", "settings", "expected"),
    [
        # 3 + 3; 4 + (the frame of w) 10 + 4
        ("Actual_Processor_Binding => (reference (w)) applies to b;", USUAL, (6, 18)),
        # v has no window, and both are on one module: up to the next frame after 3 and 4
        (BOTH, USUAL, (3 + 7 + 3, 4 + 6 + 4)),
        # v's window begins after 2: output at 10 - (3 + 2) and 10 - (4 + 2); w's window is (0 - 2) mod 10 = 8 after
        # v's, of which 3 + 5 and 4 + 4 have passed
        (BOTH + SCHEDULE, USUAL, (3 + 5 + 0 + 3, 4 + 4 + 0 + 4)),
        # partition end: 5 - 3 and 5 - 4; then 8 - 5 to the window of w
        (BOTH + SCHEDULE, "AS-PE-DL-EQ-EQL", (3 + 2 + 3 + 3, 4 + 1 + 3 + 4)),
        # a window that is its own frame, of a partition without a Period: 6 - 3 and 6 - 4 until output
        (ALONE, USUAL, (3 + 3 + 3, 4 + 2 + 4)),
        # the module's frame goes before the partition's Period
        (FRAMED, USUAL, (6, 33)),
    ],
)
def test_partitions(tmp_path: Path, properties: str, settings: str, expected: tuple[int, int]) -> None:
    assert latencies(tmp_path, partitioned(properties), settings) == {"e": expected}


def test_a_device_may_run_in_a_partition(tmp_path: Path) -> None:
    text = partitioned("Actual_Processor_Binding => (reference (w)) applies to b;").replace("abstract", "device")
    assert latencies(tmp_path, text) == {"e": (6, 18)}


def test_a_partition_that_is_not_in_the_schedule_is_told(tmp_path: Path) -> None:
    only_w = SCHEDULE.replace(", [Partition => reference (v); Duration => 5 ms;]", "")
    path = written(tmp_path, partitioned(BOTH + only_w))
    told = dse.import_file(path).remarks
    assert [item.message for item in told] == ["v is not in this schedule: no window of it is known"]
    found = document(tmp_path, partitioned(BOTH + only_w))["partitions"]
    assert "duration" not in found["v"] and found["w"]["duration"] == "2000000 ns"


def test_windows_beyond_the_frame_are_analysed_as_osate_does(tmp_path: Path) -> None:
    """From offset 2 of a frame of 4: 3 + (4 - 5 mod 4) + ..., without a refusal."""
    short = BOTH + SCHEDULE + "ARINC653::Module_Major_Frame => 4 ms applies to m;"
    assert latencies(tmp_path, partitioned(short))["e"][0] == 3 + 3 + 0 + 3


# --- what a component has in one flow alone -------------------------------------------------------------------------

SEVERAL = """
  device source
    features o : out event data port;
    flows f : flow source o {Latency => 1 ms .. 2 ms;};
  end source;
  thread worker
    features i : in event data port {Compute_Execution_Time => 3 ms .. 7 ms;};
      j : in event data port {SEI::Response_Time => 4 ms .. 9 ms;}; k : in event data port;
    flows f : flow sink i; g : flow sink j; h : flow sink k {Latency => 5 ms .. 6 ms;};
    properties Dispatch_Protocol => %s; Period => 20 ms; Deadline => 12 ms;
  end worker;
  system top end top;
  system implementation top.i
    subcomponents s : device source; t : device source; u : device source; w : thread worker;
    connections c : port s.o -> w.i; d : port t.o -> w.j; e : port u.o -> w.k;
    flows
      one : end to end flow s.f -> c -> w.f;
      two : end to end flow t.f -> d -> w.g;
      three : end to end flow u.f -> e -> w.h;
  end top.i;
"""


@pytest.mark.parametrize(
    ("protocol", "settings", "expected"),
    [
        # the ports' times count where events dispatch: the deadline of 12 goes before an execution time (DL)
        ("Sporadic", USUAL, {"one": (4, 14), "two": (5, 11), "three": (6, 14)}),
        ("Sporadic", "AS-MF-ET-EQ-EQL", {"one": (4, 9), "two": (5, 11), "three": (6, 8)}),
        ("Periodic", "AS-MF-ET-EQ-EQL", {"one": (1, 14), "two": (1, 14), "three": (6, 8)}),
    ],
)
def test_the_entry_port_and_the_flow_specification(
    tmp_path: Path, protocol: str, settings: str, expected: dict[str, tuple[int, int]]
) -> None:
    assert latencies(tmp_path, SEVERAL % protocol, settings) == expected


def test_one_component_twice_in_a_flow_with_different_latencies(tmp_path: Path) -> None:
    """1 + 2 + 4; the way through x counts 1 first and 4 then."""
    text = """
      abstract through
        features i : in feature; o : out feature; b : in feature; z : out feature;
        flows first : flow source o {Latency => 1 ms .. 1 ms;}; last : flow sink b {Latency => 4 ms .. 4 ms;};
          back : flow path i -> z {Latency => 2 ms .. 2 ms;};
      end through;
      system top end top;
      system implementation top.i
        subcomponents x : abstract through; y : abstract through;
        connections c : feature x.o -> y.i; d : feature y.z -> x.b;
        flows round : end to end flow x.first -> c -> y.back -> d -> x.last;
      end top.i;
    """
    assert latencies(tmp_path, text) == {"round": (7, 7)}
    path = document(tmp_path, text)["flows"]["round"]["path"]
    assert path[0] == "x" and path[-1] == {"element": "x", "latency": "4 ms .. 4 ms"}
