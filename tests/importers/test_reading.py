"""AADL rule by rule: small models, and what the problem states of them."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.importers.registry import read_foreign
from dse.support.errors import ProblemError

SENSOR = """
  device sensor
    features o : out data port Base_Types::Integer_32;
    flows f : flow source o {Latency => 1 ms .. 2 ms;};
  end sensor;
"""
WORKER = """
  thread worker
    features i : in data port Base_Types::Integer_32; o : out event data port Base_Types::Float_64;
    flows f : flow path i -> o;
    properties Period => 10 ms; Compute_Execution_Time => 1 ms .. 3 ms;
  end worker;
"""
SINK = """
  device sink
    features i : in event data port Base_Types::Float_64;
    flows f : flow sink i;
  end sink;
"""
PROCESS = """
  process proc
    features i : in data port Base_Types::Integer_32; o : out event data port Base_Types::Float_64;
    flows f : flow path i -> o;
  end proc;
  process implementation proc.i
    subcomponents w : thread worker;
    connections c1 : port i -> w.i; c2 : port w.o -> o;
    flows f : flow path i -> c1 -> w.f -> c2 -> o;
  end proc.i;
"""
WITHIN = PROCESS.replace("  end proc.i;", "properties Period => 13 ms applies to w; end proc.i;")
AT_IT = PROCESS.replace("thread worker;", "thread worker {Period => 12 ms;};")
TOP = """
  system top end top;
  system implementation top.i
    subcomponents s : device sensor; p : process proc.i; d : device sink; cpu : processor cpu; b : bus wire;
    connections c : port s.o -> p.i; e : port p.o -> d.i;
    flows through : end to end flow s.f -> c -> p.f -> e -> d.f {Latency => 0 ms .. 90 ms;};
    properties
      Actual_Processor_Binding => (reference (cpu)) applies to p;
      Actual_Connection_Binding => (reference (b)) applies to c, e;
      %s
  end top.i;
"""
HARDWARE = """
  processor cpu end cpu;
  bus wire
    properties Transmission_Time => [Fixed => 1 us .. 2 us; PerByte => 10 ns .. 20 ns;];
      SEI::BandWidthCapacity => 1 MBytesps;
  end wire;
"""


def written(tmp_path: Path, text: str, name: str = "m") -> Path:
    path = tmp_path / f"{name}.aadl"
    if "package" not in text:
        text = f"package {name} public with Base_Types, SEI; {text} end {name};"
    path.write_text(text, encoding="utf-8")
    return path


def document(tmp_path: Path, text: str, **options: str) -> dict[str, Any]:
    return dict(read_foreign(written(tmp_path, text), None, options).document)


def model(more: str = "", **changed: str) -> str:
    parts = {"sensor": SENSOR, "worker": WORKER, "sink": SINK, "proc": PROCESS, "hardware": HARDWARE}
    return "".join({**parts, **changed}.values()) + TOP % more


def worker(tmp_path: Path, text: str, **options: str) -> dict[str, Any]:
    found: dict[str, Any] = document(tmp_path, text, **options)["threads"]["p.w"]
    return found


def test_a_whole_small_model(tmp_path: Path) -> None:
    found = document(tmp_path, model())
    assert found["profile"] == "osate-2.19" and found["imported"] == {"from": "m.aadl", "root": "m::top.i"}
    assert found["processors"] == {"cpu": {"type": "cpu"}}
    wire = found["bus_types"]["wire"]
    assert wire["bandwidth"] == "1 MB/s"
    assert wire["transmission_time"] == {"fixed": "1 us .. 2 us", "per_byte": "10 ns .. 20 ns"}
    assert {key: value for key, value in found["threads"]["p.w"].items() if key != "source"} == {
        "processor": "cpu", "period": "10 ms", "compute_execution_time": "1 ms .. 3 ms"
    }  # fmt: skip
    assert found["devices"]["s"]["latency"] == "1 ms .. 2 ms"
    assert found["connections"]["s.o"] == {
        "from": "s", "to": "p.w", "bus": "b", "port": "data", "data_size": "4 B",
        "source": found["connections"]["s.o"]["source"],
    }  # fmt: skip
    assert found["connections"]["p.w.o"]["data_size"] == "8 B"
    assert found["flows"]["through"]["path"] == ["s", "s.o", "p.w", "p.w.o", "d"]
    assert found["flows"]["through"]["latency"] == "0 ms .. 90 ms"


def test_the_analysis_of_it_by_hand(tmp_path: Path) -> None:
    """1 .. 2 ms of the sensor; 4 B: 1.04 .. 2.08 us; sampling 0 .. 10, work 1 .. 3 ms; 8 B: 1.08 .. 2.16 us."""
    found = dse.analyse(written(tmp_path, model()))
    rows = [(row.contributor, row.min_ns, row.max_ns) for row in found.flows[0].rows if row.max_method != "queued"]
    own = {name: (least, most) for name, least, most in rows if most}
    assert own["p.w"] == (1_000_000, 3_000_000)
    assert ("p.w", 0, 10_000_000) in rows
    assert found.flows[0].min_ns == 2_000_000 + 1040 + 1080


@pytest.mark.parametrize(
    ("more", "changed", "period"),
    [
        ("", {}, "10 ms"),
        ("Period => 11 ms applies to p.w;", {}, "11 ms"),
        ("Period => 11 ms applies to p;", {}, "10 ms"),  # what the thread's own type says goes before what it inherits
        ("", {"proc": AT_IT}, "12 ms"),
        ("Period => 11 ms applies to p.w;",
         {"proc": AT_IT}, "11 ms"),
        ("", {"proc": WITHIN}, "13 ms"),
        ("Period => 11 ms applies to p.w;",
         {"proc": WITHIN}, "11 ms"),
        ("Period => 14 ms applies to p;", {"worker": WORKER.replace("Period => 10 ms;", "")}, "14 ms"),
        ("Period => 15 ms;", {"worker": WORKER.replace("Period => 10 ms;", "")}, "15 ms"),
        ("Period => 0 ms applies to p.w;", {}, None),
        ("PERIOD => 16 MS applies to P.W;", {}, "16 ms"),
        ("Timing_Properties::Period => 17 ms applies to p.w;", {}, "17 ms"),
        ("Other::Period => 17 ms applies to p.w;", {}, "10 ms"),
    ],
)  # fmt: skip
def test_where_a_property_is_from(more: str, changed: dict[str, str], period: str | None, tmp_path: Path) -> None:
    assert worker(tmp_path, model(more, **changed)).get("period") == period


def test_constants_and_properties_of_the_users_own(tmp_path: Path) -> None:
    text = "property set mine is Base : constant Time => 7 ms; Again : constant Time => mine::Base; "
    text += "Wish : inherit Time => mine::Again applies to (all); end mine;\n"
    text += f"package m public with mine, SEI, Base_Types; {model('Period => mine::Again applies to p.w;')} end m;"
    path = tmp_path / "m.aadl"
    path.write_text(text, encoding="utf-8")
    assert read_foreign(path).document["threads"]["p.w"]["period"] == "7 ms"
    path.write_text(text.replace("=> mine::Again applies to p.w", "=> mine::Wish applies to p.w"), encoding="utf-8")
    assert read_foreign(path).document["threads"]["p.w"]["period"] == "7 ms"


def test_modes(tmp_path: Path) -> None:
    text = model("Period => 20 ms in modes (slow), 5 ms in modes (fast) applies to p.w;")
    text = text.replace("    flows through", "    modes slow : initial mode; fast : mode; flows through")
    text = text.replace("e : port p.o -> d.i;", "e : port p.o -> d.i; x : port s.o -> p.i in modes (fast);")
    text = text.replace("c : port s.o -> p.i;", "c : port s.o -> p.i in modes (slow);").replace(
        "applies to c, e", "applies to c, x, e"
    )
    assert worker(tmp_path, text)["period"] == "20 ms"
    assert worker(tmp_path, text, mode="fast")["period"] == "5 ms"
    fast = read_foreign(tmp_path / "m.aadl", None, {"mode": "fast"})
    assert any("the flow through is not there in this mode (connection c)" in item.message for item in fast.remarks)
    with pytest.raises(ProblemError, match=r"the root has no mode quick \(there are "):
        document(tmp_path, text, mode="quick")


def test_what_holds_in_a_binding_and_what_a_reference_processor_scales(tmp_path: Path) -> None:
    two = HARDWARE + "processor fast properties SEI::MIPSCapacity => 200.0 MIPS; end fast;"
    two = two.replace("processor cpu end cpu;", "processor cpu properties SEI::MIPSCapacity => 50.0 MIPS; end cpu;")
    by_binding = WORKER.replace(
        "1 ms .. 3 ms;", "1 ms .. 3 ms; Compute_Execution_Time => 1 ms .. 2 ms in binding (fast);"
    )
    by_binding = by_binding.replace("Compute_Execution_Time => 1 ms .. 3 ms;", "", 1) + ""
    text = model(worker=by_binding, hardware=two).replace("cpu : processor cpu;", "cpu : processor fast;")
    assert worker(tmp_path, text)["compute_execution_time"] == "1 ms .. 2 ms"
    scaled = WORKER.replace("Period", "Reference_Processor => classifier (fast); Period")
    assert worker(tmp_path, model(worker=scaled, hardware=two))["compute_execution_time"] == "4000000 ns .. 12000000 ns"


def test_feature_groups_with_inverse_across_levels(tmp_path: Path) -> None:
    text = """
  feature group plug features go : out data port Base_Types::Integer_16; back : in event data port; end plug;
  feature group socket inverse of plug end socket;
  device motor features g : feature group plug; flows f : flow source g.go; k : flow sink g.back; end motor;
  thread driver features h : feature group socket; flows f : flow sink h.go; k : flow source h.back; end driver;
  process box features x : feature group inverse of plug; end box;
  process implementation box.i
    subcomponents t : thread driver;
    connections inner : feature group x <-> t.h;
  end box.i;
  system top end top;
  system implementation top.i
    subcomponents m : device motor; b : process box.i;
    connections outer : feature group m.g <-> b.x;
    flows there : end to end flow m.f -> outer -> b.t.f; back : end to end flow b.t.k -> outer -> m.k;
  end top.i;
"""
    found = document(tmp_path, text)
    assert {name: (item["from"], item["to"]) for name, item in found["connections"].items()} == {
        "m.g.go": ("m", "b.t"), "b.t.h.back": ("b.t", "m")
    }  # fmt: skip
    assert found["connections"]["m.g.go"]["data_size"] == "2 B"
    assert found["flows"]["there"]["path"] == ["m", "m.g.go", "b.t"]
    assert found["flows"]["back"]["path"] == ["b.t", "b.t.h.back", "m"]


def test_arrays_and_their_patterns(tmp_path: Path) -> None:
    text = """
  device a features o : out event port; end a;
  device b features i : in event port; end b;
  system top end top;
  system implementation top.i
    subcomponents a : device a[3]; b : device b[3]; one : device b;
    connections
      pairs : port a.o -> b.i; all_in : port a.o -> one.i;
      next : port a.o -> b.i {Connection_Pattern => ((Cyclic_Next));};
    properties Period => 5 ms applies to a; Period => 7 ms applies to a[2];
  end top.i;
"""
    found = document(tmp_path, text)
    ends = {(item["from"], item["to"]) for item in found["connections"].values()}
    assert {(f"a[{n}]", f"b[{n}]") for n in (1, 2, 3)} | {(f"a[{n}]", "one") for n in (1, 2, 3)} <= ends
    assert {("a[1]", "b[2]"), ("a[2]", "b[3]"), ("a[3]", "b[1]")} <= ends and len(ends) == 9
    assert [found["devices"][f"a[{n}]"]["period"] for n in (1, 3)] == ["5 ms", "5 ms"]


def test_prototypes(tmp_path: Path) -> None:
    generic = PROCESS.replace(
        "  process implementation proc.i", "  process implementation proc.i\n    prototypes w : thread;"
    )
    generic = generic.replace("w : thread worker;", "w : thread w;")
    bound = model(proc=generic).replace("p : process proc.i;", "p : process proc.i (w => thread worker);")
    assert worker(tmp_path, bound)["period"] == "10 ms"
    with pytest.raises(ProblemError, match="the prototype w is bound to nothing"):
        document(tmp_path, model(proc=generic))
    extending = generic + "process implementation proc.j extends proc.i (w => thread worker) end proc.j;"
    assert worker(tmp_path, model(proc=extending).replace("process proc.i;", "process proc.j;"))["period"] == "10 ms"


def test_extension_and_refinement(tmp_path: Path) -> None:
    text = (
        model()
        + """
  thread quick extends worker properties Period => 2 ms; end quick;
  process implementation proc.q extends proc.i subcomponents w : refined to thread quick; end proc.q;
  system implementation top.j extends top.i
    subcomponents p : refined to process proc.q;
    connections c : refined to port {Latency => 1 us .. 1 us;};
    flows through : refined to end to end flow {Latency => 0 ms .. 50 ms;};
  end top.j;
"""
    )
    found = document(tmp_path, text)
    assert found["name"] == "m::top.j" and found["threads"]["p.w"]["period"] == "2 ms"
    assert found["connections"]["s.o"]["latency"] == "1 us .. 1 us"
    assert found["flows"]["through"]["latency"] == "0 ms .. 50 ms"
    assert document(tmp_path, text, root="top.i")["threads"]["p.w"]["period"] == "10 ms"


def test_packages_renames_and_files_around(tmp_path: Path) -> None:
    written(tmp_path, f"package parts::devices public with Base_Types; {SENSOR} {SINK} end parts::devices;", "devices")
    written(tmp_path, f"package parts public with Base_Types, SEI; {WORKER} {PROCESS} {HARDWARE} end parts;", "parts")
    written(tmp_path, "this is no model", "unrelated")
    top = TOP % ""
    top = top.replace("device sensor", "device d::sensor").replace("process proc.i", "process parts::proc.i")
    head = "with parts, parts::devices; d renames package parts::devices; renames parts::devices::all; "
    head += "renames processor parts::cpu; link renames bus parts::wire; "
    text = f"package m public {head} {top.replace('bus wire', 'bus link')} end m;"
    found = document(tmp_path, text)
    assert found["flows"]["through"]["path"] == ["s", "s.o", "p.w", "p.w.o", "d"]
    (tmp_path / "unrelated.aadl").unlink()
    assert read_foreign(tmp_path).document["flows"] == found["flows"]


def test_flows_of_flows_and_of_several_levels(tmp_path: Path) -> None:
    text = model().replace(
        "    flows through : end to end flow s.f -> c -> p.f -> e -> d.f",
        "    flows first : end to end flow s.f -> c -> p.f; whole : end to end flow first -> e -> d.f; "
        "through : end to end flow s.f -> c -> p.w.f -> e -> d.f",
    )
    flows = document(tmp_path, text)["flows"]
    assert flows["first"]["path"] == ["s", "s.o", "p.w"]
    assert flows["through"]["path"] == ["s", "s.o", "p.w", "p.w.o", "d"]
    assert flows["whole"]["path"] == ["first", "p.w.o", "d"]


def test_virtual_buses_and_several_targets(tmp_path: Path) -> None:
    hardware = HARDWARE + "virtual bus vb properties Latency => 1 ms .. 2 ms; Data_Size => 3 Bytes; end vb;"
    text = model("Actual_Connection_Binding => (reference (b)) applies to v;", hardware=hardware)
    text = text.replace("b : bus wire;", "b : bus wire; v : virtual bus vb;").replace(
        "(b)) applies to c, e", "(v)) applies to c, e"
    )
    found = document(tmp_path, text)
    assert found["buses"]["v"] == {"type": "vb", "bus": "b"} and found["connections"]["s.o"]["bus"] == "v"
    assert found["bus_types"]["vb"]["overhead"] == "3 B" and found["bus_types"]["vb"]["virtual"] is True
    both = text.replace("=> (reference (v)) applies to c, e", "=> (reference (v), reference (b)) applies to c, e")
    assert document(tmp_path, both)["connections"]["s.o"]["bus"] == "v"


def test_data_sizes_are_summed_over_subcomponents(tmp_path: Path) -> None:
    data = """
  data point end point;
  data implementation point.i
    subcomponents x : data Base_Types::Float_64; y : data Base_Types::Float_32[3]; z : data {Data_Size => 5 Bytes;};
  end point.i;
"""
    text = model(sensor=SENSOR.replace("Base_Types::Integer_32", "point.i")) + data
    assert document(tmp_path, text)["connections"]["s.o"]["data_size"] == "25 B"


SYSTEM = "system s end s; system implementation s.i"
MISTAKES = [
    ("device d end d", '1:32: expected ";", got the end of the file'),
    ("device d features x : in out event port end d;", 'expected the name of a classifier, got "end"'),
    ("device d features x : in; end d;", "expected the kind of the feature"),
    (f"{SYSTEM} subcomponents d : device q; end s.i;", "1:85: there is no classifier q"),
    (f"{SYSTEM} connections c : port a -> b; end s.i;", "there is no subcomponent or feature a"),
    ("system s extends t end s; system implementation s.i end s.i;", "there is no classifier t"),
    (f"device d properties Period => 5 m; end d; {SYSTEM} subcomponents d : device d; end s.i;",
     "1:38: Period: expected a time in ps, ns"),
    ("device d properties Period => ; end d;", '1:48: expected a value, got ";"'),
    (f"{SYSTEM} end s.i; system implementation s.j end s.j;", "(name one with --root: m::s.i, m::s.j)"),
    ("device d end d;", "there is no system implementation to analyse"),
    ("data d end d; data d end d;", '"d" is declared twice in m'),
    ("system s extends s end s; system implementation s.i end s.i;", "extends itself"),
    ('device d properties A => "x; end d;', "the text that begins here does not end"),
    ("annex a {** x;", "the annex that begins here does not end"),
    ("device d # end d;", "'#' begins nothing in AADL"),
    ("modul m", 'expected a classifier, "with", "renames", "annex", "private" or "end", got "modul"'),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), MISTAKES)
def test_mistakes_have_their_place_and_say_what_was_expected(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "m.aadl"
    path.write_text(f"package m public {text}" + (" end m;" if not text.endswith("end d") else ""), encoding="utf-8")
    with pytest.raises(ProblemError) as caught:
        read_foreign(path)
    assert message in str(caught.value)
    assert all(item.file == str(path) for item in caught.value.diagnostics)


def test_another_name_at_the_end_is_told(tmp_path: Path) -> None:
    text = f"package m public {SYSTEM} end s.j; end n;"
    said = "".join(str(item) for item in read_foreign(written(tmp_path, text)).remarks)
    assert 'expected "end s.i;", got "end s.j;"' in said and 'expected "end m;", got "end n;"' in said


def test_what_is_not_looked_at_is_told_with_its_place(tmp_path: Path) -> None:
    text = model("Period => 5 ms applies to nobody; Actual_Processor_Binding => (reference (nothing)) applies to p.w;")
    said = [str(item) for item in read_foreign(written(tmp_path, text)).remarks]
    assert any("applies to nobody, which is not there" in item and ": warning:" in item for item in said)
    assert any("reference (nothing) leads to no component" in item for item in said)


def test_a_file_that_decides_names_what_is_there(tmp_path: Path) -> None:
    written(tmp_path, model(hardware=HARDWARE + "processor big properties SEI::MIPSCapacity => 9.0 MIPS; end big;"))
    path = tmp_path / "p.yaml"
    head = "dse: 1\nname: p\nof: m.aadl\n"
    path.write_text(
        head + "processors: {cpu: {type: [cpu, big]}}\nthreads: {p.w: {period: [5 ms, 10 ms]}}\n", encoding="utf-8"
    )
    found = dse.load(path)
    assert [item.name for item in found.space.decisions if item.is_open] == ["cpu.type", "p.w.period"]
    path.write_text(head + "threads: {p.v: {period: 5 ms}, s: {period: 1 ms}}\n", encoding="utf-8")
    with pytest.raises(ProblemError) as caught:
        dse.load(path)
    said = [str(item) for item in caught.value.diagnostics]
    assert said[0].endswith('p.yaml:4:11: threads.p.v: the model has no "p.v" among its threads (did you mean "p.w"?)')
    assert "it is among its devices" in said[1]
    for text, message in (("of: q.aadl", "no such file"), ("of: p.txt", "expected the path of a model")):
        path.write_text(f"dse: 1\nname: p\n{text}\n", encoding="utf-8")
        with pytest.raises(ProblemError, match=message):
            dse.load(path)
    with pytest.raises(ProblemError, match="a text cannot decide over a model"):
        dse.loads(head)


def test_offsets_and_latencies_that_do_not_count_are_told(tmp_path: Path) -> None:
    """An offset needs a timer on a processor; OSATE does not look at the Latency of a flow implementation."""
    said = "Dispatch_Offset => 3 ms applies to p.w;"
    text = model(said).replace("flows f : flow path i -> c1 -> w.f -> c2 -> o;",
                               "flows f : flow path i -> c1 -> w.f -> c2 -> o {Latency => 1 ms .. 2 ms;};")  # fmt: skip
    found = read_foreign(written(tmp_path, text))
    assert found.document["threads"]["p.w"]["offset"] == "3 ms"
    assert any("Latency of the flow implementation f" in str(item) for item in found.remarks)
    free = model(said).replace("Actual_Processor_Binding => (reference (cpu)) applies to p;", "")
    found = read_foreign(written(tmp_path, free))
    assert "offset" not in found.document["threads"]["p.w"]
    assert any("Dispatch_Offset of p.w, which is bound to no processor" in str(item) for item in found.remarks)


def test_standard_properties_that_nothing_looks_at_are_told_once_each(tmp_path: Path) -> None:
    more = """SEI::RAMActual => 1.0 KByte applies to p; SEI::RAMActual => 5.0 KByte applies to p.w;
      Scheduling_Protocol => (EDF) applies to cpu; Dispatch_Jitter => 1 ms applies to p.w;
      SEI::Price => 3.0 applies to p;"""
    told = read_foreign(written(tmp_path, model(more)), None, {}).remarks
    first = min(item.line for item in told)
    assert [(item.message, item.line - first) for item in told] == [
        ("SEI::RAMActual is not looked at (at 2 places, first here)", 0),
        ("Scheduling_Protocol other than fixed priorities is not looked at", 1),
        ("Dispatch_Jitter is not looked at", 1),
        ("SEI::Price is not looked at", 2),
    ]
    assert all(item.severity == "warning" and item.column for item in told)


def test_properties_of_data_types_that_nothing_looks_at_are_told(tmp_path: Path) -> None:
    text = """package u public
data d properties Data_Size => 4 Bytes; Access_Right => read_only; end d;
data unused properties Byte_Count => 3; end unused;
device s features o : out data port d; flows f : flow source o; end s;
device t features i : in data port d; flows f : flow sink i; end t;
system top end top;
system implementation top.i subcomponents a : device s; b : device t; connections c : port a.o -> b.i;
  flows e : end to end flow a.f -> c -> b.f;
end top.i;
end u;"""
    told = read_foreign(written(tmp_path, text), None, {}).remarks
    assert [(item.message, item.line) for item in told] == [("Access_Right is not looked at", 2)]


def test_budgets_of_processors_and_memories(tmp_path: Path) -> None:
    """The thread needs 3 ms of 10 ms on a processor of 20 MIPS: 6 MIPS, and 1.5 MIPS in instructions."""
    more = """SEI::MIPSBudget => 10.0 MIPS applies to p; SEI::MIPSCapacity => 20.0 MIPS applies to cpu;
      SEI::RAMBudget => 1.0 KByte applies to p; Actual_Memory_Binding => (reference (mem)) applies to p;
      Stack_Size => 700 Bytes applies to p.w; Source_Heap_Size => 100 Bytes applies to p.w;
      Code_Size => 2 KByte applies to p.w; SEI::RAMCapacity => 640 Bytes applies to mem; %s"""
    text = model("\n" + more % "").replace("b : bus wire;", "b : bus wire; mem : memory;")
    found = read_foreign(written(tmp_path, text))
    place = "m.aadl"
    stated = {name: {key: item for key, item in entry.items() if key != "source"}
              for name, entry in found.document["budgets"].items()}  # fmt: skip
    assert stated == {
        "p": {"processor": "cpu", "speed": "10 MIPS", "ram": "1000 B", "memory": "mem"},
        "p.w": {"within": "p", "ram_used": "800 B", "rom_used": "2000 B", "memory": "mem"},
    }
    assert found.document["memories"]["mem"]["ram"] == "640 B"
    assert place in found.document["budgets"]["p"]["source"]
    assert not [item for item in found.remarks if "MIPS" in item.message]

    def uses(path: Path) -> dict[tuple[str, str], tuple[object, ...]]:
        return {(use.name, use.resource): (use.total, use.capacity) for use in dse.analyse(path).resources}

    assert uses(written(tmp_path, text)) == {
        ("cpu", "speed"): (6, 20), ("system", "speed"): (6, 20), ("mem", "RAM"): (800, 640),
        ("system", "RAM"): (800, 640),
    }  # fmt: skip
    counted = text.replace(
        "SEI::RAMBudget", "SEI::InstructionsPerDispatch => 0.0 KIPD .. 15.0 KIPD applies to p.w;\n SEI::RAMBudget"
    )
    assert uses(written(tmp_path, counted, "n"))["cpu", "speed"] == (Fraction(3, 2), 20)


def test_properties_of_ports_and_bindings_are_told_too(tmp_path: Path) -> None:
    """What something looks up of others says of what it is not looked at; of sets that are not AADL's one remark."""
    more = """Period => 3 ms applies to s.o; Overflow_Handling_Protocol => DropOldest applies to p.w.i;
      Connection_Pattern => ((One_To_One)) applies to c; Latency => 3 ms applies to cpu;
      Allowed_Processor_Binding => (reference (cpu)) applies to p; Timing => Sampled applies to c;
      Source_Text => ("a.c") applies to p; my::Colour => "red" applies to p; my::Mass => 3 applies to p.w;"""
    (tmp_path / "my.aadl").write_text(
        "property set my is Colour: aadlstring applies to (all); Mass: aadlinteger applies to (all); end my;"
    )
    text = f"package m public with Base_Types, SEI, my; {model(more)} end m;"
    told = read_foreign(written(tmp_path, text), None, {}).remarks
    assert [item.message for item in told] == [
        "Period of a feature is not looked at",
        "Overflow_Handling_Protocol is not looked at",
        "Connection_Pattern is not looked at",
        "Latency of a processor is not looked at",
        "Allowed_Processor_Binding is not looked at",
        "properties that bear on no figure here are not looked at: Source_Text",
        "properties of my that bear on no figure here are not looked at: Colour, Mass (at 2 places, first here)",
    ]
    assert all(item.line and item.column for item in told)


def test_fixed_priorities_are_no_remark(tmp_path: Path) -> None:
    more = "Scheduling_Protocol => (POSIX_1003_HIGHEST_PRIORITY_FIRST_PROTOCOL) applies to cpu;"
    assert not read_foreign(written(tmp_path, model(more)), None, {}).remarks


def test_properties_of_modes_are_told(tmp_path: Path) -> None:
    modes = """    modes slow : initial mode {Deactivation_Policy => inactive;}; fast : mode;
      change : slow -[p.go]-> fast {Mode_Transition_Response => planned;}; flows through"""
    told = read_foreign(written(tmp_path, model("").replace("    flows through", modes))).remarks
    first = told[0].line
    assert [(item.message, item.line - first) for item in told] == [
        ("Deactivation_Policy of a mode is not looked at", 0),
        ("Mode_Transition_Response of a mode transition is not looked at", 1),
    ]
