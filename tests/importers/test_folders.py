"""Models of folders: spelled in any way, with libraries elsewhere, and files to decide with."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run

LIBRARY = "package lib public data d properties Data_Size => 8 Bytes; end d; end lib;"
MODEL = """
package m public with lib;
  device s features o : out data port lib::d; flows f : flow source o; properties Period => 10 ms; end s;
  device z features i : in data port lib::d; flows f : flow sink i; end z;
  system top end top;
  system implementation top.i
    subcomponents s : device s; z : device z;
    connections c : port s.o -> z.i;
    flows e : end to end flow s.f -> c -> z.f {Latency => 0 ms .. 100 ms;};
  end top.i;
end m;
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    found = tmp_path / "robot"
    (found / "inner").mkdir(parents=True)
    (found / "m.aadl").write_text(MODEL, encoding="utf-8")
    (found / "lib.aadl").write_text(LIBRARY, encoding="utf-8")
    monkeypatch.chdir(found)
    return found


@pytest.mark.parametrize("spelled", [".", "./", "../robot", "inner/..", "{folder}"])
def test_a_folder_may_be_spelled_in_any_way(spelled: str, folder: Path, tmp_path: Path) -> None:
    path = spelled.format(folder=folder)
    assert run(["analyse", path, "--root", "m::top.i"]) == 0
    target = tmp_path / "out.yaml"
    assert run(["import", path, "--root", "m::top.i", "-o", str(target)]) == 0
    assert run(["check", str(target)]) == 0
    question = f"dse: 1\nname: q\nof: {path}\nroot: m::top.i\nobjectives: [minimise price]\n"
    (folder / "q.yaml").write_text(question, encoding="utf-8")
    assert run(["solve", "q.yaml", "--json", str(tmp_path / "r.json")]) == 0
    assert run(["verify", str(tmp_path / "r.json")]) == 0


@pytest.mark.parametrize("spelled", ["..", "../"])
def test_the_folder_around_is_meant_from_within(spelled: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder / "inner")
    assert run(["analyse", spelled, "--root", "m::top.i"]) == 0


@pytest.fixture
def apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model and its library in folders beside each other, and another library that nothing asks for."""
    for name, text in (("app/m.aadl", MODEL), ("sets/lib.aadl", LIBRARY), ("more/broken.aadl", "package x public")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("path", ["app/m.aadl", "app"])
def test_a_library_is_looked_for_in_the_folders_that_are_named(
    path: str, apart: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["analyse", path]) == 3
    assert "package lib is in none of the files that were read (--library FOLDER, or" in capsys.readouterr().err
    named = ["--library", "more", "--library", "sets"]
    assert run(["analyse", path, *named]) == 0
    assert run(["import", path, *named, "-o", "x.yaml"]) == 0
    assert run(["check", "x.yaml"]) == 0
    assert run(["import", path, "--library", "sets,more", "-o", "y.yaml"]) == 0
    assert run(["analyse", path, "--library", "absent"]) == 2
    assert "--library absent: is no folder" in capsys.readouterr().err


def test_a_file_that_decides_names_libraries_and_its_design_is_exported(
    apart: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    question = (
        "dse: 1\nname: q\nof: ../app/m.aadl\nlibrary: [../more, ../sets]\n"
        "devices: {s: {period: [10 ms, 20 ms]}}\nobjectives: [minimise price]\n"
    )
    (apart / "q").mkdir()
    (apart / "q" / "q.yaml").write_text(question, encoding="utf-8")
    assert run(["solve", "q/q.yaml", "-q", "--json", "q/r.json"]) == 0
    monkeypatch.chdir(apart / "q")
    assert run(["export", "r.json#1", "--format", "aadl", "-o", "chosen.aadl"]) == 0
    assert "Period =>" in Path("chosen.aadl").read_text(encoding="utf-8")
    assert run(["verify", "r.json"]) == 0
    monkeypatch.chdir(apart)
    (apart / "sets").rename(apart / "sets, more")
    Path("q/q.yaml").write_text(question.replace("../sets", '"../sets, more"'), encoding="utf-8")
    assert run(["solve", "q/q.yaml", "-q"]) == 0
    monkeypatch.chdir(apart / "q")
    Path("q.yaml").write_text(question.replace("../sets", "../nowhere"), encoding="utf-8")
    assert run(["check", "q.yaml"]) == 3
    assert "library: there is no folder '../nowhere'" in capsys.readouterr().err


def test_a_result_of_a_model_with_libraries_is_exported(apart: Path) -> None:
    assert run(["solve", "app/m.aadl", "--library", "sets", "--minimise", "price", "-q", "--json", "r.json"]) == 0
    assert run(["export", "r.json#1", "--format", "aadl", "-o", "chosen.aadl"]) == 0


OFFERING = """
package m public with SEI;
  processor cpu end cpu;
  processor implementation cpu.slow properties SEI::MIPSCapacity => 100.0 MIPS; end cpu.slow;
  processor implementation cpu.quick properties SEI::MIPSCapacity => 200.0 MIPS; end cpu.quick;
  bus wire properties SEI::BandWidthCapacity => 2.0 KBytesps; SEI::BandWidthBudget => 1.0 KBytesps; end wire;
  bus fibre properties SEI::BandWidthCapacity => 9.0 KBytesps; end fibre;
  data d properties Data_Size => 2 Bytes; end d;
  device s features o : out event data port d; flows f : flow source o; properties Period => 10 ms; end s;
  thread w
    features i : in event data port d; o : out event data port d;
    flows f : flow path i -> o;
    properties Dispatch_Protocol => Periodic; Period => 20 ms; Deadline => 15 ms;
      Compute_Execution_Time => 1 ms .. 3 ms;
  end w;
  thread v features i : in event data port d; flows f : flow sink i; properties Dispatch_Protocol => Aperiodic; end v;
  process p end p;
  process implementation p.i
    subcomponents w : thread w; v : thread v;
    connections a : port w.o -> v.i;
  end p.i;
  system top end top;
  system implementation top.i
    subcomponents c : processor cpu.slow; b : bus wire; s : device s; x : process p.i; z : process q.i;
    connections k : port s.o -> z.i {Actual_Connection_Binding => (reference (b));};
    flows e : end to end flow s.f -> k -> z.f {Latency => 0 ms .. 100 ms;};
    properties
      Actual_Processor_Binding => (reference (c)) applies to x, z;
      Reference_Processor => classifier (cpu.slow) applies to x, z;
  end top.i;
  process q features i : in event data port d; flows f : flow sink i; end q;
  process implementation q.i
    subcomponents w : thread w; v : thread v;
    connections a : port i -> w.i; b : port w.o -> v.i;
    flows f : flow sink i -> a -> w.f -> b -> v.f;
  end q.i;
end m;
"""


def test_a_file_that_decides_is_written_from_a_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("models").mkdir()
    Path("models/m.aadl").write_text(OFFERING, encoding="utf-8")
    assert run(["new", "--from", "models/m.aadl", "--root", "m::top.i", "study/q.yaml"]) == 2  # no such folder
    Path("study").mkdir()
    assert run(["new", "--from", "models/m.aadl", "--root", "m::top.i", "study/q.yaml"]) == 0
    text = Path("study/q.yaml").read_text(encoding="utf-8")
    stated = yaml.safe_load(text)
    assert stated["of"] == "../models/m.aadl" and stated["deadlines"] == "stated"
    assert stated["threads"] == {
        "x.w": {"period": ["20 ms", "10 ms", "40 ms"]},
        "z.w": {"period": ["20 ms", "10 ms", "40 ms"], "dispatch_protocol": ["periodic", "aperiodic"]},
    }
    assert stated["processors"] == {"c": {"type": ["m::cpu.slow", "m::cpu.quick"]}}
    assert stated["buses"] == {"b": {"type": ["m::wire", "m::fibre"]}}
    assert "latency of e within 0 ms .. 100 ms" in text and 'load of "b" <= 1 KB/s' in text
    result = dse.solve("study/q.yaml")
    assert result.status == "complete" and min(point.objectives["changes"] for point in result.front) == 0
    same = dse.analyse("study/q.yaml")
    own = dse.analyse(dse.Model("models/m.aadl", "m::top.i"), deadlines="stated")
    assert {name: own.metrics[name] for name in own.metrics} == {name: same.metrics[name] for name in own.metrics}


def test_what_a_new_file_does_not_take_with_a_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.aadl").write_text(OFFERING, encoding="utf-8")
    assert run(["new", "--root", "m::top.i"]) == 2
    assert run(["new", "--from", "m.aadl", "--random"]) == 2
    assert run(["new", "--from", "m.aadl", "--root", "m::absent.i"]) == 3
    assert run(["new", "--from", "m.aadl"]) == 0
    assert run(["new", "--from", "m.aadl"]) == 2  # it is there already
    assert run(["new", "--from", "m.aadl", "--force"]) == 0
    assert run(["check", "m-decisions.yaml"]) == 0


def test_a_model_that_leaves_nothing_to_choose_gives_a_file_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.aadl").write_text(MODEL.replace(" with lib;", "").replace(" lib::d", ""), encoding="utf-8")
    assert run(["new", "--from", "m.aadl", "q.yaml"]) == 0
    stated = yaml.safe_load(Path("q.yaml").read_text(encoding="utf-8"))
    assert "baseline" not in stated and stated["objectives"] == ['minimise latency of "e"']
    assert run(["solve", "q.yaml"]) == 0
