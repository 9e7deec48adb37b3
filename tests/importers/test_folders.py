"""Models of folders: spelled in any way, with libraries elsewhere, and files to decide with."""

from __future__ import annotations

from pathlib import Path

import pytest

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
