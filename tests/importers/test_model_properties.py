"""Properties of AADL models that count for what they are stated of: devices, bindings, arrays, ports."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from tests.importers.test_osate_figures import latencies
from tests.importers.test_reading import document, written


def test_a_reference_processor_scales_devices_too(tmp_path: Path) -> None:
    text = """
      processor cpu properties SEI::MIPSCapacity => 200.0 MIPS; end cpu;
      processor slow extends cpu properties SEI::MIPSCapacity => 100.0 MIPS; end slow;
      device a features o : out event data port; flows f : flow source o;
        properties Compute_Execution_Time => 1 ms .. 2 ms; SEI::Response_Time => 3 ms .. 4 ms; end a;
      device z features i : in event data port {Compute_Execution_Time => 1 ms .. 1 ms;}; flows f : flow sink i; end z;
      system top end top;
      system implementation top.i
        subcomponents a : device a; z : device z; c : processor slow;
        connections k : port a.o -> z.i;
        flows e : end to end flow a.f -> k -> z.f {Latency => 0 ms .. 9 ms;};
        properties
          Reference_Processor => classifier(cpu);
          Actual_Processor_Binding => (reference (c)) applies to a, z;
      end top.i;"""
    found = document(tmp_path, text)
    assert found["devices"]["a"]["compute_execution_time"] == "2000000 ns .. 4000000 ns"
    assert found["devices"]["a"]["response_time"] == "6000000 ns .. 8000000 ns"
    assert found["flows"]["e"]["path"][-1] == {"element": "z", "compute_execution_time": "2000000 ns .. 2000000 ns"}
    assert "processor" not in found["devices"]["a"]
    latencies = dse.analyse(written(tmp_path, text)).flows[0]
    assert (latencies.min_ns, latencies.max_ns) == (8 * 10**6, 10 * 10**6)


ARRAYS = """
  device s features o : out data port; end s;
  device r features i : in data port; end r;
  system top end top;
  system implementation top.i
    subcomponents s : device s[3]; r : device r[3];
    connections c : port s.o -> r.i {%s};
  end top.i;"""


@pytest.mark.parametrize(
    ("properties", "expected"),
    [
        ("Connection_Set => ([src => (1); dst => (3);], [src => (2); dst => (1);]);", {(1, 3), (2, 1)}),
        ("Connection_Set => ([src => (1); dst => (2);]); Connection_Pattern => ((One_To_One));",
         {(1, 2), (1, 1), (2, 2), (3, 3)}),
        ("", {(1, 1), (2, 2), (3, 3)}),
    ],
)  # fmt: skip
def test_a_connection_set_names_the_elements(properties: str, expected: set[tuple[int, int]], tmp_path: Path) -> None:
    wires = document(tmp_path, ARRAYS % properties)["connections"].values()
    assert {(int(item["from"][-2]), int(item["to"][-2])) for item in wires} == expected


def test_an_element_that_is_not_there_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, ARRAYS % "Connection_Set => ([src => (4); dst => (1);]);")
    assert any("names an element that is not there" in item.message for item in dse.load(path).loaded.told)


WAITING = """
  device s features o : out %s; flows f : flow source o {Latency => 1 ms .. 1 ms;}; end s;
  thread w
    features i : in %s;
    flows f : flow sink i {Latency => 2 ms .. 2 ms;};
    properties Compute_Execution_Time => 3 ms .. 3 ms; %s
  end w;
  system top end top;
  system implementation top.i
    subcomponents s : device s; w : thread w;
    connections c : port s.o -> w.i;
    flows e : end to end flow s.f -> c -> w.f;
  end top.i;"""


@pytest.mark.parametrize(
    ("port", "properties", "settings", "expected"),
    [
        # an assigned deadline takes the place of the execution time, also one of 0, which leaves what is specified
        ("event data port", "", "AS-MF-DL-EQ-EQL", 1 + 3),
        ("event data port", "Deadline => 5 ms;", "AS-MF-DL-EQ-EQL", 1 + 5),
        ("event data port", "Deadline => 0 ms;", "AS-MF-DL-EQ-EQL", 1 + 2),
        ("event data port", "Deadline => 0 ms; SEI::Response_Time => 4 ms .. 4 ms;", "AS-MF-DL-EQ-EQL", 1 + 4),
        ("event data port", "Deadline => 0 ms;", "AS-MF-ET-EQ-EQL", 1 + 3),
        # what is queued waits for a period of a periodic or sporadic component, and for its processing else
        ("event port {Queue_Size => 2;}", "Dispatch_Protocol => Aperiodic;", "AS-MF-ET-EQ-EQL", 1 + 2 * 3 + 3),
        ("event port {Queue_Size => 2;}", "Dispatch_Protocol => Sporadic; Period => 5 ms;", "AS-MF-ET-EQ-EQL",
         1 + 2 * 5 + 3),
        ("event port {Queue_Size => 2;}", "Dispatch_Protocol => Sporadic;", "AS-MF-ET-EQ-EQL", 1 + 3),
        ("event port {Queue_Size => 2;}", "Dispatch_Protocol => Periodic;", "AS-MF-ET-EQ-EQL", 1 + 3),
        ("data port", "Dispatch_Protocol => Aperiodic;", "AS-MF-ET-EQ-EQL", 1 + 3 + 3),
        ("data port", "Dispatch_Protocol => Sporadic;", "AS-MF-ET-EQ-EQL", 1 + 3),
    ],
)  # fmt: skip
def test_deadlines_of_0_and_queues_without_a_period(
    port: str, properties: str, settings: str, expected: int, tmp_path: Path
) -> None:
    text = WAITING % (port.partition(" {")[0], port, properties)
    assert latencies(tmp_path, text, settings)["e"][1] == expected


INDEXED = """
  thread w end w;
  process p end p;
  process implementation p.i subcomponents w : thread w[2]; end p.i;
  system top end top;
  system implementation top.i
    subcomponents p : process p.i[3]; m : thread w[2][2];
    properties
      %s
  end top.i;"""


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ("p[2].w[1]", {"p[2].w[1]"}),
        ("p[2].w", {"p[2].w[1]", "p[2].w[2]"}),
        ("p[1..2].w[2]", {"p[1].w[2]", "p[2].w[2]"}),
        ("p[2 .. 3].w[1 .. 2]", {"p[2].w[1]", "p[2].w[2]", "p[3].w[1]", "p[3].w[2]"}),
        ("m[1][2]", {"m[1][2]"}),
        ("m[2]", {"m[2][1]", "m[2][2]"}),
        ("m[1..2][1]", {"m[1][1]", "m[2][1]"}),
    ],
)
def test_an_index_in_a_path_names_elements_of_an_array(target: str, expected: set[str], tmp_path: Path) -> None:
    threads = document(tmp_path, INDEXED % f"Period => 7 ms applies to {target};")["threads"]
    assert {name for name, item in threads.items() if item.get("period") == "7 ms"} == expected


@pytest.mark.parametrize(("target", "is_there"), [("p[4]", False), ("p[3]", True), ("p[1].w[3]", False)])
def test_an_index_beyond_an_array_is_told(target: str, is_there: bool, tmp_path: Path) -> None:
    told = [
        item.message
        for item in dse.load(written(tmp_path, INDEXED % f"Period => 7 ms applies to {target};")).loaded.told
    ]
    assert (f"applies to {target}, which is not there: not looked at" not in told) == is_there


SHARED = """
  data store end store;
  subprogram job end job;
  thread w features a : requires data access store; j : provides subprogram access job; end w;
  thread r features a : requires data access store; j : requires subprogram access job; end r;
  system top end top;
  system implementation top.i
    subcomponents d : data store; w : thread w; r : thread r;
    connections
      c : data access d -> w.a;
      e : data access d -> r.a;
      g : subprogram access w.j -> r.j;
  end top.i;"""


def test_access_that_is_not_looked_at_is_told(tmp_path: Path) -> None:
    told = [item.message for item in dse.load(written(tmp_path, SHARED)).loaded.told]
    assert any(text.startswith("data access connections are not looked at") and "at 2 places" in text for text in told)
    assert any(text.startswith("r calls w: nothing is made of that, as in OSATE") for text in told)


def test_elements_of_arrays_of_features_are_connected_by_index(tmp_path: Path) -> None:
    text = """
  device s features o : out event data port[2]; end s;
  thread r features i : in event data port; end r;
  process box features i : in event data port[2]; end box;
  process implementation box.i
    subcomponents u : thread r; v : thread r;
    connections a : port i[1] -> u.i; b : port i[2] -> v.i;
  end box.i;
  bus wire end wire;
  system top end top;
  system implementation top.i
    subcomponents s : device s; p : process box.i; w : bus wire;
    connections c : port s.o -> p.i {Actual_Connection_Binding => (reference (w));};
    properties Data_Size => 7 Bytes applies to s.o[2]; Data_Size => 3 Bytes applies to s.o;
  end top.i;"""
    wires = document(tmp_path, text)["connections"]
    assert {name: (item["from"], item["to"], item["data_size"]) for name, item in wires.items()} == {
        "s.o[1]": ("s", "p.u", "3 B"),
        "s.o[2]": ("s", "p.v", "7 B"),
    }


def test_elements_of_arrays_of_feature_groups_are_connected_by_index(tmp_path: Path) -> None:
    text = """
  feature group pair features x : out event data port; y : in event data port; end pair;
  device s features o : feature group pair[2]; flows f : flow source o; end s;
  thread r features i : feature group inverse of pair; flows f : flow sink i; end r;
  process box features i : feature group inverse of pair[2]; end box;
  process implementation box.i
    subcomponents u : thread r; v : thread r;
    connections a : feature group i[1] <-> u.i; b : feature group i[2] <-> v.i;
  end box.i;
  system top end top;
  system implementation top.i
    subcomponents s : device s; p : process box.i;
    connections c : feature group s.o <-> p.i;
  end top.i;"""
    wires = document(tmp_path, text)["connections"]
    assert {name: (item["from"], item["to"]) for name, item in wires.items()} == {
        "s.o[1].x": ("s", "p.u"),
        "s.o[2].x": ("s", "p.v"),
        "p.u.i.y": ("p.u", "s"),
        "p.v.i.y": ("p.v", "s"),
    }


def test_equal_remarks_are_one_with_a_count(tmp_path: Path) -> None:
    text = """
  device s features o : out event data port; end s;
  device r features i : in event data port; end r;
  bus wire end wire;
  system top end top;
  system implementation top.i
    subcomponents s : device s[123]; r : device r[123]; w : bus wire;
    connections c : port s.o -> r.i {Actual_Connection_Binding => (reference (w));};
  end top.i;"""
    told = [item.message for item in dse.load(written(tmp_path, text)).loaded.told]
    assert len(told) == 1
    assert told[0].startswith("s[1].o has no Data_Size: its messages count as 0 bytes on w (and 122 more: s[2].o, ")
