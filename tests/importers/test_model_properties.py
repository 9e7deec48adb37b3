"""Properties of AADL models that count for what they are stated of: devices, bindings, arrays, ports."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
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
