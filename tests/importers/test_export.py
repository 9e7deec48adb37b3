"""Designs as AADL: read back they give the very figures; of a model they extend it as Listing 2.3 does."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.questions.complete_design import complete_design
from dse.questions.verbs.export import figures
from dse.support.errors import UsageError

ROOT = Path(__file__).parents[2]
PARTS = """
dse: 1
name: "parts, of everything"
totals: {mass: g}
processor_types:
  cpu: {cores: 2, price: 5 EUR, totals: {mass: 3 g}}
  slow: {price: 1 EUR}
bus_types:
  wire: {bandwidth: 1 Mbit/s, exclusive: true, overhead: 3 B, transmission_time: {fixed: 10 us, per_byte: 8 us .. 9 us}}
  thin: {bandwidth: 1 Mbit/s, transmission_time: from bandwidth}
  odd: {virtual: true, latency: 1 us, transmission_time: {cpu: {fixed: 5 us, per_byte: 1/3 ns}, slow: {fixed: 7 us}}}
processors: {p: {type: [cpu, slow]}, q: {type: cpu, optional: true}}
buses: {"the wire": {type: [wire, thin]}, on top: {type: odd, bus: the wire}}
devices: {"a sensor": {period: 5 ms, latency: 1 ms .. 2 ms, price: 3 EUR}, end: {}}
threads:
  x.main: {processor: [p, q], process: x, period: [10 ms, 20 ms], priority: 3, deadline: 9 ms, queue_size: 2,
           dispatch_protocol: periodic, compute_execution_time: {cpu: 1 ms .. 2 ms, slow: 2 ms .. 4 ms}}
  x.other: {processor: [p, q], process: x, compute_execution_time: 1 us, dispatch_trigger: [in x]}
  y: {processor: p, dispatch_protocol: hybrid, period: 40 ms, callback_execution_time: 30 us,
      compute_execution_time: 7 us}
  s: {category: abstract, dispatch_protocol: sporadic, period: 5 ms, compute_execution_time: 10 us, processor: p}
connections:
  in: {to: "x.main", data_size: 4 B, rate: 20 Hz, port: data}
  c: {from: a sensor, to: x.main, data_size: 8 B, bus: the wire, queue_size: 3}
  in x: {from: x.main, to: x.other, data_size: 9 B, latency: 3 us}
  d: {from: x.other, to: y, data_size: 20 B, bus: on top, port: event}
  e: {from: y, to: s, data_size: 3 B, data_rate: 3 KB/s, bus: the wire, port: feature}
  f: {from: s, to: end, data_size: 1 B, bus: on top}
  out: {from: s, data_size: 2 B, bus: the wire}
flows:
  through: {path: [a sensor, c, x.main, x.other, y, e, s, f, end], latency: 0 ms .. 1 s}
  part: {path: [in, x.main, x.other]}
  rest: {path: [y, s, out]}
  parts: {path: [part, d, rest]}
metrics: {sum: latency of through + latency of part}
requirements: [utilisation of q <= 90 %, load of the wire <= 90 %, mass <= 9 g]
objectives: [minimise price, minimise latency of part]
"""


@pytest.mark.parametrize("name", ["starter", "parts", "inmark_chapter3"])
def test_a_whole_model_reads_back_as_the_same_design(name: str, tmp_path: Path) -> None:
    """`dse.export` itself compares every figure; here the names and the settings too, and that the text is AADL."""
    path = tmp_path / "parts.yaml"
    path.write_text(PARTS, encoding="utf-8")
    result = dse.solve(path if name == "parts" else ROOT / "problems" / f"{name}.yaml")
    text = dse.export(result, 1, "aadl")
    written = tmp_path / "model.aadl"
    written.write_text(text, encoding="utf-8")
    there = dse.load(written).space
    mine, theirs = figures(result.space, result.front[0].design), figures(there, complete_design(there, {}))
    own = {key: value for key, value in theirs.items() if value and not key.startswith("utilisation of core")}
    assert {key: value for key, value in mine.items() if value} == own  # a model says on which cores, which tells these
    assert [item.name for item in there.components] == [item.name for item in result.space.components]
    assert (there.name, there.profile) == (result.space.name, result.space.profile)
    again = dse.solve(written, minimise="price")
    assert dse.export(again, 1, "problem")


def copied(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "problems" / "aadl", tmp_path / "aadl")
    return tmp_path / "aadl"


def test_a_design_of_a_model_extends_it_as_listing_2_3_does(tmp_path: Path) -> None:
    folder = copied(tmp_path)
    result = dse.solve(folder / "inmark_chapter2.yaml")
    chosen = next(point for point in result.front if point.objectives["changes"] == 1)
    text = dse.export(result, chosen.id, "aadl")
    assert "system implementation inmark_full.chosen extends inmark_chapter2::inmark_full.gnss_flow" in text
    assert "Dispatch_Protocol => Aperiodic applies to sw.localisation_subsystem.gnss_provider;" in text
    assert "Period => 0 ms applies to sw.localisation_subsystem.gnss_provider;" in text
    (folder / "chosen.aadl").write_text(text, encoding="utf-8")
    found = dse.analyse(dse.Model(folder / "chosen.aadl"), profile="osate-2.2")
    listing = dse.analyse(dse.Model(folder / "inmark_chapter2.aadl", "inmark_full.gnss_flow2"), profile="osate-2.2")
    assert [vars_of(row) for row in found.flows[0].rows] == [vars_of(row) for row in listing.flows[0].rows]


def vars_of(row: object) -> tuple[object, ...]:
    return tuple(getattr(row, name) for name in ("contributor", "min_ns", "min_method", "max_ns", "max_method"))


def test_another_bus_is_a_refined_subcomponent(tmp_path: Path) -> None:
    folder = copied(tmp_path)
    result = dse.solve(folder / "inmark_chapter3.yaml")
    chosen = next(point for point in result.front if point.decisions["canbus0.type"] == "can.c500")
    text = dse.export(result, chosen.id, "aadl")
    assert "canbus0 : refined to bus inmark_hardware::can.c500;" in text
    (folder / "chosen.aadl").write_text(text, encoding="utf-8")
    found = dse.analyse(folder / "chosen.aadl", profile="osate-2.2", worst_case="execution_time")
    assert found.metrics["latency of f_io_cmd"] == chosen.metrics["latency of f_io_cmd"]


def test_the_model_is_needed_to_extend_it(tmp_path: Path) -> None:
    folder = copied(tmp_path)
    result = dse.solve(folder / "inmark_chapter2.yaml")
    (folder / "inmark_chapter2.aadl").unlink()
    with pytest.raises(UsageError, match="AADL model that it is of is not there"):
        dse.export(result, 1, "aadl")


def test_an_imported_file_is_a_problem_by_itself(tmp_path: Path) -> None:
    """It may have been changed, and stand where the model is not; before, it was asked for."""
    model = dse.Model(ROOT / "problems" / "aadl" / "inmark_chapter2.aadl", "inmark_full.gnss_flow")
    text = dse.import_file(model.path, root=model.root).text.replace(" 12 ms", " 900 ms")
    (tmp_path / "i.yaml").write_text(text, encoding="utf-8")
    result = dse.solve(tmp_path / "i.yaml", minimise="price")
    assert "extends" not in dse.export(result, 1, "aadl")


RENAMED = """package lib public with a; renames system a::s;
  system implementation s.j extends a::s.i end s.j; end lib;"""


def test_the_type_of_a_renamed_classifier(tmp_path: Path) -> None:
    """The implementation is in one package, its type in another that only a renames leads to."""
    text = "package a public device d properties Period => 5 ms; end d; system s end s;"
    text += " system implementation s.i subcomponents t : device d; end s.i; end a;"
    (tmp_path / "a.aadl").write_text(text, encoding="utf-8")
    (tmp_path / "lib.aadl").write_text(RENAMED, encoding="utf-8")
    result = dse.solve(dse.Model(tmp_path / "lib.aadl", "lib::s.j"), minimise="price")
    assert "system s extends a::s" in dse.export(result, 1, "aadl")


def test_the_property_set_stands_beside_the_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.json").write_text(dse.solve(ROOT / "problems" / "starter.yaml").to_json(), encoding="utf-8")
    export = ["export", "p.json", "--alternative", "1", "--format", "aadl"]
    assert run([*export, "-o", "model.aadl"]) == 0
    assert run(["check", "model.aadl"]) == 0 and run(["analyse", "model.aadl"]) == 0
    assert Path("dse.aadl").read_text(encoding="utf-8").startswith("property set dse is")
    Path("dse.aadl").write_text("another\n", encoding="utf-8")
    assert run([*export, "-o", "other.aadl"]) == 2


def test_a_result_of_a_model_is_opened_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its root; also where the model is gone: the result carries what was read."""
    folder = copied(tmp_path)
    monkeypatch.chdir(folder)
    arguments = ["solve", "inmark_chapter2.aadl", "--root", "inmark_full.gnss_flow", "--profile", "osate-2.2", "-q"]
    assert run([*arguments, "--minimise", "price", "--json", "r.json"]) == 4  # 12 ms are required
    assert run(["verify", "r.json"]) == 0
    assert run(["solve", "inmark_chapter2.yaml", "-q", "--json", "s.json"]) == 0
    assert run(["verify", "s.json"]) == 0
    assert run(["export", "s.json", "--alternative", "1", "-o", "fixed.yaml"]) == 0
    Path("inmark_chapter2.aadl").unlink()
    assert run(["verify", "r.json"]) == 5  # nothing wrong, but a forgery of both would pass
    (folder / "inmark_chapter2.yaml").unlink()
    assert run(["verify", "s.json"]) == 5


def test_response_times_on_request(tmp_path: Path) -> None:
    """Of two threads on one core the less urgent waits for the other: 1 + 2 ms."""
    text = """{dse: 1, name: two, processor_types: {cpu: {}}, processors: {p: {type: cpu}}, threads: {
      fast: {processor: p, period: 10 ms, compute_execution_time: 1 ms},
      slow: {processor: p, period: [20 ms, 40 ms], compute_execution_time: 2 ms}},
      objectives: [minimise utilisation]}"""
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml")
    plain, told = (dse.export(result, 1, "aadl", response_times=asked) for asked in (False, True))
    assert "Response_Time" not in plain
    assert "SEI::Response_Time => 1 ms .. 1 ms;" in told and "SEI::Response_Time => 2 ms .. 3 ms;" in told
    with pytest.raises(UsageError, match="AADL models only"):
        dse.export(result, 1, "dot", response_times=True)
    (tmp_path / "m.aadl").write_text(plain, encoding="utf-8")
    again = dse.solve(tmp_path / "m.aadl", minimise="price")
    extended = dse.export(again, 1, "aadl", response_times=True)
    assert "SEI::Response_Time => 2 ms .. 3 ms applies to slow_process.slow;" in extended


HEAD = "dse: 1\nname: m\nobjectives: [minimise utilisation of p]\nprocessors: {p: {type: b}}\n"
OFFSETS = """
dse: 1
name: o
offset_grid: 5 ms
clocks: {k: {}}
processor_types: {b: {cores: 1}}
processors: {p: {type: b, clock: k}}
threads:
  t: {processor: p, period: 10 ms, offset: 0 ms, compute_execution_time: 1 ms}
  u: {processor: p, period: 10 ms, offset: any, compute_execution_time: 1 ms}
connections: {x: {from: t, to: u}}
flows: {f: {path: [t, u]}}
objectives: [minimise latency of f]
"""
WORDLESS = {
    "groups": "processor_types: {b: {cores: {big: 1, little: 1}}}\n"
    "threads: {t: {processor: p, period: [5 ms, 9 ms], compute_execution_time: {b/big: 1 ms, b/little: 2 ms}}}",
    "executors": "processor_types: {b: {cores: 1}}\nexecutors: {ros: {kind: [fifo, wait_set], processor: p}}\n"
    "threads: {t: {executor: ros, period: [5 ms, 9 ms], compute_execution_time: 1 ms}}",
    "partitions": "processor_types: {b: {cores: 1}}\nprofile: osate-2.19\n"
    "partitions: {w: {period: 20 ms, offset: 5 ms, duration: 5 ms}}\n"
    "threads: {t: {processor: p, partition: w, period: [20 ms, 40 ms], compute_execution_time: 1 ms}}",
    "frames": "processor_types: {b: {cores: 1}}\ndevices: {s: {period: 1 ms}}\n"
    "bus_types: {c: {bandwidth: 1 Mbit/s, frame: {protocol: can, identifier_bits: 29}}}\nbuses: {c: {type: c}}\n"
    "connections: {x: {from: s, to: t, data_size: 8 B, bus: c}}\n"
    "threads: {t: {processor: p, period: [20 ms, 40 ms], compute_execution_time: 1 ms}}",
    "any": "processor_types: {b: {cores: 1}}\ndeadlines: all\nprocessing: response_time\n"
    "threads: {t: {processor: p, period: 10 ms, priority: any, compute_execution_time: 1 ms},"
    " u: {processor: p, period: 20 ms, priority: [2, 4], compute_execution_time: 1 ms}}",
}  # fmt: skip


@pytest.mark.parametrize("name", WORDLESS)
def test_what_aadl_has_no_word_for_goes_along(name: str, tmp_path: Path) -> None:
    """Written with our property set, and read back to the same figures."""
    text = dse.export(dse.solve(dse.loads(HEAD + WORDLESS[name])), 1, "aadl")
    assert "priority: any" not in text
    assert ("Priority" in text) == (name == "any")
    (tmp_path / "m.aadl").write_text(text, encoding="utf-8")
    dse.load(tmp_path / "m.aadl")


def test_a_chosen_offset_is_stated(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(OFFSETS, encoding="utf-8")
    result = dse.solve(path)
    text = dse.export(result, 1, "aadl")
    assert "Dispatch_Offset => 0 ms;" in text and "Dispatch_Offset => 5 ms;" in text
    (tmp_path / "m.aadl").write_text(text, encoding="utf-8")
    decided = "dse: 1\nname: d\nof: m.aadl\noffset_grid: 1 ms\nprofile: dse\nthreads: {u: {offset: [1 ms, 7 ms]}}\n"
    (tmp_path / "d.yaml").write_text(decided, encoding="utf-8")
    extended = dse.export(dse.solve(tmp_path / "d.yaml"), 1, "aadl")
    assert "Dispatch_Offset => 1 ms applies to u_process.u;" in extended


def test_what_cannot_be_read_back_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dse.answers.exports.aadl.model.SETTINGS", ("name",))
    monkeypatch.setattr("dse.answers.exports.aadl.model.settings_of", lambda _: {"rules": ["t.period = nothing"]})
    with pytest.raises(UsageError, match="AADL cannot say all of this design"):
        dse.export(dse.solve(dse.loads(HEAD + WORDLESS["executors"])), 1, "aadl")


FIRST_FIT = """
dse: 1
name: first fit
processor_types: {duo: {cores: 2, price: 5 EUR}}
processors: {p: {type: duo}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 6 ms}
  b: {processor: p, period: 100 ms, compute_execution_time: 50 ms}
  c: {processor: p, period: [100 ms, 200 ms], compute_execution_time: 8 ms}
objectives: [minimise price, minimise utilisation of p]
"""


def test_cores_that_first_fit_chose_go_along(tmp_path: Path) -> None:
    """Before, a model said nothing of them, and whoever read it did not know what runs beside what."""
    result = dse.solve(dse.loads(FIRST_FIT))
    assert result.to_dict()["front"][0]["cores"] == {"a": 1, "b": 2, "c": 1}
    path = tmp_path / "chosen.aadl"
    path.write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    read = dse.load(path)
    assert [item.core for item in read.space.components if item.section == "threads"] == [1, 2, 1]


WIRED = """package w public
  data m properties Data_Size => 8 Bytes; end m;
  device d features o : out event data port m; flows f : flow source o; properties Period => 10 ms; end d;
  thread t features i : in event data port m; flows f : flow sink i; properties Period => 10 ms; end t;
  process p features i : in event data port m; end p;
  process implementation p.i subcomponents t : thread t; connections c : port i -> t.i; end p.i;
  bus b properties Transmission_Time => [Fixed => 1 us .. 2 us; PerByte => 1 us .. 1 us;]; end b;
  system top end top;
  system implementation top.i
    subcomponents d : device d; p : process p.i; b : bus b;
    connections k : port d.o -> p.i;
    flows e : end to end flow d.f -> k -> p.t.f;
    properties Actual_Connection_Binding => (reference (b)) applies to k; STATED
  end top.i;
end w;"""
OF = """dse: 1
name: o
of: w.aadl
threads: {p.t: {queue_size: [1, 2], dispatch_protocol: aperiodic}}
connections: {d.o: {rate: [12.5 Hz, 40 Hz], latency: [1 ms .. 2 ms, 3 ms]}}
objectives: [minimise load of b, maximise latency of e]
"""


def test_margins_and_simulations_of_models_with_budgets_and_messages_of_no_size(tmp_path: Path) -> None:
    """Before, margins took a budget for a list of options, and a cycle of messages without a size had no end."""
    stated = "SEI::BandWidthBudget => 9.0 KBytesps applies to k;"
    (tmp_path / "w.aadl").write_text(WIRED.replace("STATED", stated), encoding="utf-8")
    assert dse.sensitivity(tmp_path / "w.aadl", require="latency of e <= 50 ms").margins
    text = """{dse: 1, name: cycle, threads: {t: {dispatch_protocol: aperiodic, compute_execution_time: 1 ms},
      u: {dispatch_protocol: aperiodic, compute_execution_time: 1 ms}}, devices: {d: {period: 10 ms}},
      connections: {a: {from: d, to: t}, b: {from: t, to: u}, c: {from: u, to: t, data_rate: 10 B/s}},
      flows: {f: {path: [d, t, u]}}}"""
    assert dse.simulate(dse.loads(text), runs=2).flows[0].name == "f"


@pytest.mark.parametrize("word", ["", "SEI::Data_Rate", "SEI::Message_Rate"])
def test_what_is_decided_of_connections(word: str, tmp_path: Path) -> None:
    """Rates by the property that the model has, queues at the port, latencies at the declaration; before, refused."""
    stated = f"{word} => 7.0 perSecond applies to d.o;" if word else ""
    (tmp_path / "w.aadl").write_text(WIRED.replace("STATED", stated), encoding="utf-8")
    (tmp_path / "o.yaml").write_text(OF, encoding="utf-8")
    result = dse.solve(tmp_path / "o.yaml")
    [point] = result.front
    assert (point.decisions["d.o.rate"], point.decisions["p.t.queue_size"]) == ("12.5 Hz", "2")
    text = dse.export(result, 1, "aadl")
    assert "Queue_Size => 2 applies to p.t.i;" in text
    rate = (
        f"{word} => 12.5 perSecond" if word else "Output_Rate => [Value_Range => 12.5 .. 12.5; Rate_Unit => PerSecond;]"
    )
    assert f"{rate} applies to d.o;" in text
    (tmp_path / "chosen.aadl").write_text(text, encoding="utf-8")
    again = dse.analyse(tmp_path / "chosen.aadl", worst_case="deadline").metrics
    assert {name: again[name] for name in ("load of b", "latency of e")} == {
        name: point.metrics[name] for name in ("load of b", "latency of e")
    }


def test_budgets_stand_where_osate_sees_them(tmp_path: Path) -> None:
    """MIPS, RAM, ROM and instructions of threads and devices are SEI's properties; the rest is ours; all come back."""
    text = """
dse: 1
name: budgets
profile: osate-2.19
processor_types: {pc: {speed: 1.2 MIPS}}
processors: {cpu: {type: pc}}
memories: {main: {ram: 30 KB, rom: 10 KB}}
devices: {lidar: {}}
threads:
  sense: {period: 20 ms, compute_execution_time: 8 ms .. 12 ms, processor: cpu}
  filter: {period: 20 ms, compute_execution_time: 1 ms, processor: cpu}
connections:
  scan: {from: lidar, to: sense}
  points: {from: sense, to: filter}
flows: {way: {path: [lidar, scan, sense, points, filter]}}
budgets:
  iop: {speed: 0.8 MIPS, processor: cpu, ram: 30 KB, memory: main}
  sense: {within: iop, speed: 500 KIPS, ram: 20 KB, ram_used: 19 KB, rom: 1 KB}
  filter: {within: iop, ram_used: 15 KB, instructions: 4.5 KIPD, speed: 0 MIPS}
  lidar: {ram: 2 KB, speed: 1 KIPS}
"""
    result = dse.solve(dse.loads(text), minimise="price")
    path = tmp_path / "m.aadl"
    path.write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    written = re.findall(r"SEI::(\w+ => .*);", path.read_text(encoding="utf-8"))
    assert sorted(written) == [
        "InstructionsPerDispatch => 4500.0 IPD .. 4500.0 IPD", "MIPSBudget => 0.001 MIPS", "MIPSBudget => 0.5 MIPS",
        "MIPSCapacity => 1.2 MIPS", "RAMBudget => 2000.0 Bytes", "RAMBudget => 20000.0 Bytes",
        "ROMBudget => 1000.0 Bytes",
    ]  # fmt: skip
    assert dse.analyse(path).resources == dse.analyse(dse.loads(text)).resources


LIBRARY = "package lib public data d properties Data_Size => 8 Bytes; end d; end lib;"
USING = """
package m public with lib;
  device s features o : out data port lib::d; flows f : flow source o; properties Period => 10 ms; end s;
  thread w features i : in data port lib::d; flows f : flow sink i; properties Period => 20 ms; end w;
  process p features i : in data port lib::d; flows f : flow sink i; end p;
  process implementation p.i
    subcomponents w : thread w;
    connections c : port i -> w.i;
    flows f : flow sink i -> c -> w.f;
  end p.i;
  system top end top;
  system implementation top.i
    subcomponents s : device s; p : process p.i;
    connections c : port s.o -> p.i;
    flows e : end to end flow s.f -> c -> p.f;
  end top.i;
end m;
"""
OVER = """
dse: 1
name: q
of: m.aadl
threads: {p.w: {period: [10 ms, 20 ms]}}
objectives: [minimise latency of e]
"""


def test_an_export_may_be_made_again_but_not_in_the_place_of_what_the_model_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("lib.aadl", LIBRARY), ("m.aadl", USING), ("q.yaml", OVER)):
        Path(name).write_text(text, encoding="utf-8")
    assert run(["solve", "q.yaml", "-q", "--json", "r.json"]) == 0
    for _ in range(2):
        assert run(["export", "r.json#1", "--format", "aadl", "-o", "out.aadl"]) == 0
    assert run(["export", "r.json#1", "--format", "aadl", "-o", "lib.aadl"]) == 2
    assert "lib.aadl: is a model that this command reads" in capsys.readouterr().err
    assert Path("lib.aadl").read_text(encoding="utf-8") == LIBRARY


def test_what_aadl_admits_of_no_such_component_is_told_instead_of_set(tmp_path: Path) -> None:
    text = USING.replace("s : device s;", "s : device s; b : process p;").replace(
        "c : port s.o -> p.i;", "c : port s.o -> p.i; d : port s.o -> b.i;"
    )
    (tmp_path / "lib.aadl").write_text(LIBRARY, encoding="utf-8")
    (tmp_path / "m.aadl").write_text(text, encoding="utf-8")
    (tmp_path / "q.yaml").write_text(
        "dse: 1\nname: q\nof: m.aadl\nthreads: {b: {compute_execution_time: [1 ms, 2 ms], deadline: [3 ms, 4 ms]}}\n"
        "objectives: [minimise latency of e]\n",
        encoding="utf-8",
    )
    exported = dse.export(dse.solve(tmp_path / "q.yaml"), 1, "aadl")
    body = exported.partition("package")[2]
    assert "Compute_Execution_Time" not in body and "Deadline => 3 ms applies to b;" in body
    assert (
        "Not set, for AADL has no such property of a process: Compute_Execution_Time => 1 ms .. 1 ms of b" in exported
    )


SENDING = """
package m public with lib;
  thread w features o : out data port lib::d; flows f : flow source o; properties Period => 20 ms; end w;
  process p features o : out data port lib::d; flows f : flow source o; end p;
  process implementation p.i
    subcomponents w : thread w;
    connections c : port w.o -> o;
    flows f : flow source w.f -> c -> o;
  end p.i;
  device z features i : in data port lib::d; flows f : flow sink i; end z;
  bus wire properties Transmission_Time => [PerByte => 1 ms .. 1 ms;]; end wire;
  system top end top;
  system implementation top.i
    subcomponents p : process p.i; z : device z; b : bus wire;
    connections c : port p.o -> z.i {Actual_Connection_Binding => (reference (b));};
    flows e : end to end flow p.f -> c -> z.f;
  end top.i;
end m;
"""


def test_a_decided_size_goes_to_the_type_of_the_port(tmp_path: Path) -> None:
    """OSATE's latency looks at the data type of the port, not at the port."""
    (tmp_path / "lib.aadl").write_text(LIBRARY, encoding="utf-8")
    (tmp_path / "m.aadl").write_text(SENDING, encoding="utf-8")
    question = "connections: {p.w.o: {data_size: [4 B, 12 bit, 8 B]}}\nobjectives: [minimise latency of e]\n"
    (tmp_path / "q.yaml").write_text(f"dse: 1\nname: q\nof: m.aadl\n{question}", encoding="utf-8")
    for size, declared in (("4 B", "4 Bytes"), ("12 bit", "12 bits")):
        result = dse.solve(tmp_path / "q.yaml", fix=f"p.w.o.data_size = {size}")
        exported = dse.export(result, 1, "aadl")
        assert f"Data_Size => {declared};" in exported and "applies to" not in exported
        (tmp_path / "chosen.aadl").write_text(exported, encoding="utf-8")
        back = dse.analyse(tmp_path / "chosen.aadl")
        assert back.metrics["latency of e"] == result.front[0].metrics["latency of e"]
        assert back.metrics["load of b"] == result.front[0].metrics["load of b"]
        assert not any("not looked at" in item.message for item in dse.load(tmp_path / "chosen.aadl").loaded.told)
