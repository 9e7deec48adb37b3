"""The examples are found from a checkout and from an installed wheel, which carries all; the name and version of it."""

from __future__ import annotations

import re
import tomllib
import zipfile
from pathlib import Path

import pytest
from hatchling.build import build_wheel

import dse
from dse.cli.main import run
from dse.examples import shipped
from dse.examples.shipped import example_files, example_folder, example_path
from dse.questions.problem import load
from dse.spec.loading.load import load_spec
from dse.support.errors import EXIT_USAGE, UsageError

ROOT = Path(__file__).parents[1]
SHIPPED = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "problems").rglob("*.yaml"))


@pytest.mark.parametrize("path", example_files(), ids=lambda path: path.stem)
def test_every_example_loads_with_its_catalogues(path: Path) -> None:
    load_spec(path)


def test_a_name_finds_its_file_with_and_without_suffix() -> None:
    assert example_path("inmark") == example_path("inmark.yaml") == example_folder() / "inmark.yaml"


def test_catalogues_are_no_examples() -> None:
    assert {path.parent for path in example_files()} == {example_folder()}
    assert list((example_folder() / "catalogues").glob("*.yaml"))


@pytest.mark.parametrize(("name", "hint"), [("inmrk", 'did you mean "inmark"?'), ("zzz", "known: autoware")])
def test_an_unknown_name_is_answered_with_the_closest(name: str, hint: str) -> None:
    with pytest.raises(UsageError) as caught:
        example_path(name)
    assert str(caught.value).startswith(f'no example is called "{name}" ({hint}')
    assert caught.value.exit_code == EXIT_USAGE


def test_an_installed_package_has_its_own_problems(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "dse" / "problems").mkdir(parents=True)
    (tmp_path / "problems").mkdir()  # somebody else's
    monkeypatch.setattr(shipped, "__file__", str(tmp_path / "dse" / "examples" / "shipped.py"))
    assert example_folder() == tmp_path / "dse" / "problems"


def test_examples_share_their_catalogues_in_one_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A catalogue that is there already, unchanged, is no reason to stop; a changed one is."""
    monkeypatch.chdir(tmp_path)
    assert run(["new", "--example", "inmark"]) == run(["new", "--example", "inmark_chapter3"]) == 0
    load(tmp_path / "inmark_chapter3.yaml")
    (tmp_path / "catalogues" / "buses.yaml").write_text("bus_types: {}\n", encoding="utf-8")
    (tmp_path / "inmark.yaml").unlink()
    assert run(["new", "--example", "inmark"]) == EXIT_USAGE
    assert not (tmp_path / "inmark.yaml").exists()


def test_the_wheel_carries_every_problem_and_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    with zipfile.ZipFile(tmp_path / build_wheel(str(tmp_path))) as wheel:
        names = set(wheel.namelist())
    assert {f"dse/{name}" for name in SHIPPED} <= names
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "dse").rglob("*.py")}
    assert modules <= names
    assert "dse/py.typed" in names
    assert not [name for name in names if not name.startswith(("dse/", "dse_pareto-"))]


def test_the_package_index_name_is_ours_everywhere() -> None:
    """`dse` on the index is another project: nothing that we say may install it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["name"] == "dse-pareto"
    ours = [
        path for folder in ("dse", "docs", "problems", ".ci") for path in (ROOT / folder).rglob("*") if path.is_file()
    ]
    ours += [ROOT / "README.md", ROOT / "pyproject.toml"]
    texts = {path: path.read_bytes().decode(errors="ignore") for path in ours if path.suffix != ".pyc"}
    assert len(texts) > 200
    wrong = re.compile(r"(?<![\w-])dse\[[a-z]|pip install ['\"]?dse\b(?!-)|(version|installed)\(['\"]dse['\"]\)")
    assert [path for path, text in texts.items() if wrong.search(text)] == []
    assert any("dse-pareto[cluster]" in text for text in texts.values())


def test_the_version_does_not_depend_on_how_it_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    assert build_wheel(str(tmp_path)).split("-")[:2] == ["dse_pareto", dse.__version__]
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"dse {dse.__version__}\n"
