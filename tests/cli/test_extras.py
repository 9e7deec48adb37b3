"""What commands do where an extra is not installed: they say which and how to install it, or go on without it."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.support.extras import EXTRAS

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture
def lean(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a problem and its result, and no library of an extra."""
    text = example_path("starter").read_text(encoding="utf-8")
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "u.yaml").write_text(text + uncertain(text), encoding="utf-8")
    (tmp_path / "r.json").write_text(dse.solve(tmp_path / "p.yaml").to_json(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for _, module in EXTRAS.values():
        monkeypatch.setitem(sys.modules, module, None)  # an import of it fails
    return tmp_path


def uncertain(text: str) -> str:
    thread = next(iter(dse.loads(text).loaded.spec.threads))
    return f"\nuncertainty: {{threads.{thread}.compute_execution_time: {{factor: 0.9 .. 1.1}}}}\n"


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (["sensitivity", "u.yaml"], "sensitivity"),
        (["report", "r.json", "--figures", "png"], "png"),
        (["sweep", "p.yaml", "--vary", "price=50EUR..90EUR", "--scheduler", "tcp://127.0.0.1:9"], "cluster"),
    ],
    ids=lambda item: item[0] if isinstance(item, list) else item,
)
@pytest.mark.usefixtures("lean")
def test_what_is_missing_is_named_with_its_command(
    arguments: list[str], extra: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    said = capsys.readouterr().err
    assert f"pip install 'dse-pareto[{extra}]'" in said and EXTRAS[extra][0] in said


def test_a_page_and_its_pictures_have_every_plot_without_an_extra(lean: Path) -> None:
    assert run(["solve", "p.yaml", "-q", "--report"]) == 0
    assert run(["report", "r.json", "--figures", "svg", "-o", "pictures"]) == 0
    assert len(list((lean / "pictures").glob("*.svg"))) >= 5
    page = (lean / "reports" / "p.html").read_text(encoding="utf-8")
    assert page.count("<svg class='chart'") >= 2 and 'id="front-table"' in page
    assert page.count("<script") == 2  # the data, and what filters the table
    assert len(re.findall("sha256-", page)) == 1


def test_every_extra_of_a_command_is_one_of_the_package() -> None:
    extras = PROJECT["optional-dependencies"]
    assert set(EXTRAS) <= set(extras)
    assert extras["all"] == [f"dse-pareto[{','.join(sorted(EXTRAS))}]"]
    documented = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert all(f"| `{extra}` |" in documented for extra in EXTRAS)
    for name in (re.split(r"[<>=\[]", entry)[0] for entry in PROJECT["dependencies"]):
        assert re.search(rf"^\| {re.escape(name)}\b", documented, re.M | re.I), name
