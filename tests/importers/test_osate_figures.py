"""The latencies that OSATE's rules give for small models, through the importer, with the arithmetic shown."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.space.question.settings import osate_settings
from tests.helpers.small import MS
from tests.importers.test_reading import document, written

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


# --- what carries a message -----------------------------------------------------------------------------------------

CARRIED = """
  data payload
    properties Data_Size => 10 Bytes;
  end payload;
  abstract sender
    features o : out event data port payload;
    flows f : flow source o {Latency => 1 ms .. 1 ms;};
  end sender;
  abstract receiver
    features i : in event data port payload;
    flows f : flow sink i {Latency => 1 ms .. 1 ms;};
  end receiver;
  virtual bus inner
    properties Data_Size => 4 Bytes; Latency => 2 ms .. 3 ms;
  end inner;
  virtual bus outer
    properties Data_Size => 6 Bytes; Transmission_Time => [PerByte => 1 ms .. 1 ms;];
      Required_Virtual_Bus_Class => (classifier (inner));
  end outer;
  virtual bus ticking
    properties Period => 7 ms;
  end ticking;
  bus wire
    properties Data_Size => 2 Bytes; Transmission_Time => [Fixed => 5 ms .. 6 ms; PerByte => 1 ms .. 1 ms;];
  end wire;
  processor router
    properties Latency => 8 ms .. 9 ms;
  end router;
  system top end top;
  system implementation top.i
    subcomponents a : abstract sender; b : abstract receiver; w : bus wire; x : bus wire; o : virtual bus outer;
      r : processor router; t : virtual bus ticking;
    connections c : port a.o -> b.i;
    flows e : end to end flow a.f -> c -> b.f;
    properties
      %s
  end top.i;
"""


ON_W = "Actual_Connection_Binding => (reference (w)) applies to c; "
ON_T = "Actual_Connection_Binding => (reference (t)) applies to c; "
ON_O = ON_W.replace("(w)", "(o)") + ON_W.replace("to c", "to o")


@pytest.mark.parametrize(
    ("properties", "expected"),
    [
        # 2 + 5 + (10 + 2)
        ("Actual_Connection_Binding => (reference (w)) applies to c;", (2 + 17, 2 + 18)),
        # through a router: each medium wraps the message of 10 bytes by itself
        ("Actual_Connection_Binding => (reference (w), reference (r), reference (x)) applies to c;",
         (2 + 17 + 8 + 17, 2 + 18 + 9 + 18)),
        # outer: 10 + 6; inner within it: specified; the wire: 10 + 6 + 4 + 2 bytes
        (ON_W + "Required_Virtual_Bus_Class => (classifier (outer)) applies to c;", (2 + 16 + 2 + 27, 2 + 16 + 3 + 28)),
        # side by side each wraps the message of 10 bytes: outer 16, inner of outer, inner; the wire carries 26
        (ON_W + "Required_Virtual_Bus_Class => (classifier (outer), classifier (inner)) applies to c;",
         (2 + 16 + 2 + 2 + 31, 2 + 16 + 3 + 3 + 32)),
        # bound to a virtual bus, which itself requires inner: 10 + 6; inner; the wire 10 + 6 + 4 + 2
        (ON_O + "Required_Virtual_Bus_Class => (classifier (ticking)) applies to c;", (2 + 16 + 2 + 27, 2 + 19 + 28)),
        # without a binding no latency of what is required counts, but its Period does
        ("Required_Virtual_Bus_Class => (classifier (outer), classifier (ticking)) applies to c;", (2, 2 + 7)),
        # whatever has a period samples, also what carries another one: 10 + 2 bytes on the wire
        (ON_T + "Actual_Connection_Binding => (reference (w)) applies to t; Period => 5 ms applies to w;",
         (2 + 17, 2 + 18 + 7 + 5)),
    ],
)  # fmt: skip
def test_what_carries_a_message(tmp_path: Path, properties: str, expected: tuple[int, int]) -> None:
    assert latencies(tmp_path, CARRIED % properties) == {"e": expected}


def test_several_buses_at_once_each_carry_the_message(tmp_path: Path) -> None:
    """At 10 messages in a second of 10 + 2 bytes, on each of two wires."""
    bound = "Actual_Connection_Binding => (reference (w), reference (x)) applies to c;"
    text = CARRIED % (bound + " SEI::Message_Rate => 10.0 PerSecond applies to c;")
    found = dse.analyse(written(tmp_path, text), profile="dse")
    loads = {name: value for name, value in found.metrics.items() if name.startswith("load")}
    assert loads == {"load of w": 120, "load of x": 120, "load of o": 0, "load of t": 0}
    assert found.flows[0].min_ns == (1 + 17 + 17 + 1) * MS


SIZED = """
package m public with SEI;
  data plain end plain;
  data whole properties Data_Size => 99 Bytes; end whole;
  data flag properties Data_Size => 1 bits; end flag;
  data pair end pair;
  data implementation pair.i subcomponents x : data whole; y : data flag; end pair.i;
  bus wire properties Transmission_Time => [PerByte => 1 ms .. 1 ms;]; Source_Data_Size => 7 Bytes; end wire;
  device s features o : out event data port %s; flows f : flow source o {Latency => 1 ms .. 1 ms;};
    properties Period => 1 sec; end s;
  device r features i : in event data port; flows f : flow sink i {Latency => 1 ms .. 1 ms;}; end r;
  system top end top;
  system implementation top.i
    subcomponents s : device s; r : device r; b : bus wire;
    connections k : port s.o -> r.i {Actual_Connection_Binding => (reference (b));};
    flows e : end to end flow s.f -> k -> r.f;
  end top.i;
end m;
"""


@pytest.mark.parametrize(
    ("port", "latency", "load"),
    [
        ("whole", Fraction(2 + 99), Fraction(99)),
        # a size of the port itself counts in the load, not in the latency
        ("whole {Data_Size => 108 Bytes;}", Fraction(2 + 99), Fraction(108)),
        ("plain {Data_Size => 4 Bytes;}", Fraction(2), Fraction(4)),
        # sizes in bits are not rounded
        ("flag", 2 + Fraction(1, 8), Fraction(1, 8)),
        ("flag {Data_Size => 12 bits;}", 2 + Fraction(1, 8), Fraction(3, 2)),
        # OSATE has 0 for the load of data that is composed of others, where we count what is sent
        ("pair.i", 2 + 99 + Fraction(1, 8), 99 + Fraction(1, 8)),
    ],
)
def test_sizes_of_messages(tmp_path: Path, port: str, latency: Fraction, load: Fraction) -> None:
    text = SIZED % port
    assert latencies(tmp_path, text) == {"e": (latency, latency)}
    path = written(tmp_path, text)
    assert dse.analyse(path).metrics["load of b"] == load
    result = dse.solve(path, minimise=["load of b", "latency of e"])  # the search counts as the analysis does
    assert result.status == "complete"
    assert dse.verify(result).status == "verified"
    (tmp_path / "again.yaml").write_text(dse.import_file(path).text, encoding="utf-8")
    again = dse.solve(tmp_path / "again.yaml", minimise="price")
    (tmp_path / "out.aadl").write_text(dse.export(again, 1, "aadl"), encoding="utf-8")
    back = dse.analyse(tmp_path / "out.aadl")
    assert (back.metrics["load of b"], back.flows[0].max_ns) == (load, latency * MS)


TWICE = """
package m public with SEI;
  data d properties Data_Size => 10 Bytes; end d;
  bus wire properties Transmission_Time => [PerByte => 1 us .. 1 us;]; end wire;
  virtual bus plain end plain;
  virtual bus heavy properties Data_Size => 10 Bytes; end heavy;
  device s features o : out event data port d; flows f : flow source o; properties Period => 10 ms; end s;
  device r features i : in event data port d; flows f : flow sink i; end r;
  system top end top;
  system implementation top.i
    subcomponents s : device s; r : device r; b : bus wire; v : virtual bus plain; u : virtual bus heavy;
    connections k : port s.o -> r.i {Actual_Connection_Binding => (reference (v), reference (u));};
    flows e : end to end flow s.f -> k -> r.f;
    properties
      Actual_Connection_Binding => (reference (b)) applies to v, u;
  end top.i;
end m;
"""


@pytest.mark.parametrize("profile", ["dse", "osate-2.19"])
def test_two_virtual_buses_of_one_bus_load_it_twice(tmp_path: Path, profile: Any) -> None:
    """100 messages in a second, one of 10 bytes and one of 10 + 10 bytes each time."""
    found = dse.analyse(written(tmp_path, TWICE), profile=profile)
    loads = {name: value for name, value in found.metrics.items() if name.startswith("load")}
    assert loads == {"load of b": 3000, "load of v": 1000, "load of u": 2000}
    assert sum(row.max_ns for row in found.flows[0].rows if row.category == "connection") == 30_000


def test_the_simulation_sends_over_both_virtual_buses(tmp_path: Path) -> None:
    found = dse.simulate(written(tmp_path, TWICE), runs=1, profile="dse")
    assert found.exit_code == 0


# --- loads ----------------------------------------------------------------------------------------------------------

SENT = """
  data payload
    properties Data_Size => 8 Bytes;
  end payload;
  system sender
    features o : out data port payload; p : out data port payload;
  end sender;
  system receiver
    features i : in data port payload; j : in data port payload; k : in data port payload;
  end receiver;
  bus wire
  end wire;
  virtual bus wrapped
    properties Data_Size => 2 Bytes;
  end wrapped;
  system top end top;
  system implementation top.i
    subcomponents a : system sender; b : system receiver; w : bus wire; v : virtual bus wrapped;
    connections c : port a.o -> b.i; d : port a.o -> b.j; e : port a.p -> b.k;
    properties
      Actual_Connection_Binding => (reference (v)) applies to c, d, e;
      Actual_Connection_Binding => (reference (w)) applies to v;
      %s
  end top.i;
"""
EACH = "Output_Rate => [Value_Range => 1.0 .. %s; Rate_Unit => %s;] applies to a.o, a.p;"


@pytest.mark.parametrize(
    ("properties", "expected"),
    [
        (EACH % ("100.0", "PerSecond"), 3 * 100 * 10),
        # of one port once, of the other too: 2 messages
        (EACH % ("100.0", "PerSecond") + "SEI::Broadcast_Protocol => true applies to v;", 2 * 100 * 10),
        # only what is bound to it directly is sent once
        (EACH % ("100.0", "PerSecond") + "SEI::Broadcast_Protocol => true applies to w;", 3 * 100 * 10),
        ("Period => 20 ms applies to a;" + EACH % ("4.0", "PerDispatch"), 3 * 200 * 10),
        ("Period => 20 ms applies to a;" + EACH % ("1.0", "PerDispatch"), 3 * 50 * 10),
        (EACH % ("4.0", "PerDispatch"), 0),
        # SEI's Data_Rate counts messages, and goes before the others
        (EACH % ("100.0", "PerSecond") + "SEI::Data_Rate => 7.0 PerSecond applies to a.o, a.p;", 3 * 7 * 10),
    ],
)
def test_rates_and_broadcasts(tmp_path: Path, properties: str, expected: int) -> None:
    found = dse.analyse(written(tmp_path, SENT % properties))
    assert {found.metrics["load of w"], found.metrics["load of v"]} == {expected}


def test_a_rate_for_each_dispatch_without_a_period_is_told(tmp_path: Path) -> None:
    told = dse.import_file(written(tmp_path, SENT % (EACH % ("4.0", "PerDispatch")))).remarks
    assert {item.message for item in told} == {
        "a has no Period: its Output_Rate for each dispatch counts as sending nothing"
    }


@pytest.mark.parametrize("end", ["  end s1.", "  properties Period => 1 ms applies inherit p.o;\n  end Top."])
def test_a_text_that_ends_within_a_name_is_a_located_mistake(tmp_path: Path, end: str) -> None:
    path = tmp_path / "cut.aadl"
    path.write_text(f"package cut public\n  system s1 end s1;\n  system implementation s1.i\n{end}", encoding="utf-8")
    with pytest.raises(dse.ProblemError) as caught:
        dse.load(path)
    assert all(item.file.endswith("cut.aadl") and item.line for item in caught.value.diagnostics)


# --- what public models do ------------------------------------------------------------------------------------------


def test_a_flow_may_lead_through_a_processor(tmp_path: Path) -> None:
    """It has an entry as what flows lead through beside that as what threads run on: 1 + 4 + 1."""
    text = """
      abstract half
        features f : feature;
        properties Latency => 1 ms .. 1 ms;
      end half;
      processor router
        features i : feature; o : feature;
        properties Latency => 4 ms .. 4 ms;
      end router;
      system top end top;
      system implementation top.i
        subcomponents a : abstract half; r : processor router; b : abstract half;
        connections c : feature a.f -> r.i; d : feature r.o -> b.f;
        flows e : end to end flow a -> c -> r -> d -> b;
      end top.i;
    """
    assert latencies(tmp_path, text) == {"e": (6, 6)}
    assert document(tmp_path, text)["flows"]["e"]["path"][2] == "r as a component"


def test_latin_1_in_comments_is_read(tmp_path: Path) -> None:
    path = tmp_path / "m.aadl"
    text = "package m public -- gr\u00f6\u00dfe\n system s end s; system implementation s.i end s.i; end m;"
    path.write_bytes(text.encode("latin-1"))
    assert dse.load(path).name == "m::s.i"


def test_connections_of_called_subprograms_are_told(tmp_path: Path) -> None:
    text = """
      subprogram job features x : out parameter; end job;
      thread worker features o : out data port; end worker;
      thread implementation worker.i
        calls seq : { one : subprogram job; };
        connections c : port one.x -> o;
      end worker.i;
      system top end top;
      system implementation top.i subcomponents w : thread worker.i; end top.i;
    """
    told = dse.import_file(written(tmp_path, text)).remarks
    assert "one is no subcomponent or feature: what is called is not looked at" in [item.message for item in told]
