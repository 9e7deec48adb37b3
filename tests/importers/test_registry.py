"""What every importer has in common, with a toy format: lines ``name period``."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import pytest

import dse
from dse.importers import registry
from dse.importers.registry import Imported, Importer
from dse.questions.verbs.import_file import import_file
from dse.support.errors import Diagnostic, ProblemError, UsageError


def read_toy(path: Path, options: Mapping[str, str]) -> Imported:
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, 1):
        if line.count(" ") != 2:
            raise ProblemError([Diagnostic("expected NAME PERIOD", file=str(path), line=number, column=1)])
    devices = {line.split()[0]: {"period": line.split(" ", 1)[1]} for line in lines}
    remarks = (Diagnostic("left out", file=str(path), line=1, column=1, severity="warning"),)
    return Imported({"dse": 1, "name": options.get("title", "toy"), "devices": devices}, remarks)


@pytest.fixture(autouse=True)
def _toy(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("toy_importer")
    module.read = read_toy  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "toy_importer", module)
    toy = Importer("toy", (".toy",), "lines of names and periods", "toy_importer", {"title": "its name"})
    monkeypatch.setattr(registry, "IMPORTERS", (*registry.IMPORTERS, toy))


def test_a_file_becomes_the_text_of_a_problem_file(tmp_path: Path) -> None:
    path = tmp_path / "a.toy"
    path.write_text("lamp 1 s\n", encoding="utf-8")
    found = import_file(path, title="Lamp")
    assert dse.loads(found.text).name == "Lamp"
    assert [str(item) for item in found.remarks] == [f"{path}:1:1: warning: left out"]


def test_the_format_is_told_by_the_name_or_stated(tmp_path: Path) -> None:
    path = tmp_path / "a.text"
    path.write_text("lamp 1 s\n", encoding="utf-8")
    with pytest.raises(UsageError, match="its name does not say which format it has"):
        import_file(path)
    for name, text, words in (
        ("a.txt", "lamp", "nothing in it tells what it is: expected traces of ros2_tracing"),
        ("b.txt", "", "b.txt:1: the file is empty: expected traces of"),
        ("c.yaml", "a: 1", "nothing in it tells what it is: expected architecture files"),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(ProblemError, match=re.escape(words)):
            import_file(tmp_path / name)
    assert "lamp" in import_file(path, "toy").text
    with pytest.raises(UsageError, match="there is no format 'toys'"):
        import_file(path, "toys")
    with pytest.raises(UsageError, match="colour: toy has no such option; it has title"):
        import_file(path, "toy", colour="red")
    with pytest.raises(UsageError, match="no such file"):
        import_file(tmp_path / "b.toy")


def test_mistakes_have_their_place(tmp_path: Path) -> None:
    path = tmp_path / "a.toy"
    path.write_text("lamp 1 s\nx\n", encoding="utf-8")
    with pytest.raises(ProblemError, match=r"a\.toy:2:1: expected NAME PERIOD"):
        import_file(path)


@pytest.mark.parametrize(
    ("name", "text", "form"),
    [
        ("bus.dbc", 'VERSION ""', "can"),
        ("robot.launch.yaml", "launch: []", "launch"),
        ("car.amxmi", "<a/>", "amalthea"),
        ("Robot.system.yaml", "autoware_system_design_format: 0.3.0", "autoware"),
        ("cam.yaml", "cam: {ros__parameters: {fps: 30}}", "parameters"),
    ],
)
def test_where_a_problem_is_expected_a_file_to_import_is_told_with_the_command(
    tmp_path: Path, name: str, text: str, form: str
) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(dse.ProblemError, match=f"expected a problem file, got one of the format {form}") as caught:
        dse.load(path)
    assert f"dse import {path} -o {name.partition('.')[0]}.yaml makes a problem file of it" in str(caught.value)
