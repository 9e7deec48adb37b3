"""No output takes the place of what the same run reads or writes, whatever it is called."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.support.errors import UsageError
from dse.support.files.guard import Guard, guarding
from dse.support.files.writing import write_file, write_files

ROOT = Path(__file__).parents[2]
PUMP = (ROOT / "tests" / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
MORE = """
baseline:
  computer: {type: large}
  can0: {type: can_500k}
  filter: {dispatch_protocol: periodic, period: 5 ms}
  control: {period: 5 ms}
uncertainty: {connections.reading.data_size: {samples: sizes.csv, column: bytes, unit: B}}
"""
LIMIT = "jitter of sensor_to_valve=5ms..20ms"
JSON_AND_CSV: dict[str, list[str]] = {
    "solve": ["solve", "FILE", "-q"],
    "sweep": ["sweep", "FILE", "--vary", LIMIT, "--no-store", "--workers", "1", "-q"],
    "sensitivity": ["sensitivity", "FILE", "--no-front"],
}
JSON_ONLY: dict[str, list[str]] = {
    "check": ["check", "FILE"],
    "analyse": ["analyse", "FILE"],
    "explain": ["explain", "FILE", "--max-jitter", "5ms"],
    "simulate": ["simulate", "FILE", "--runs", "1"],
    "verify": ["verify", "RESULT"],
    "compare": ["compare", "RESULT#1", "RESULT#2"],
}
OUTPUTS = [
    *((name, option) for name in JSON_AND_CSV for option in ("--json", "--csv")),
    *((name, "--json") for name in JSON_ONLY),
    ("export", "-o"),
    ("sweep", "--store"),
]
COMMANDS = {**JSON_AND_CSV, **JSON_ONLY, "export": ["export", "RESULT", "--alternative", "1"]}


@pytest.fixture(scope="module")
def origin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A problem that includes a file and reads samples, other names for each, and a result."""
    folder = tmp_path_factory.mktemp("origin")
    head, _, rest = PUMP.partition("processor_types:")
    types, mark, rest = rest.partition("processors:")
    (folder / "types.yaml").write_text(f"processor_types:{types}", encoding="utf-8")
    (folder / "own.yaml").write_text(f"{head}include: [types.yaml]\n{mark}{rest}\n{MORE}", encoding="utf-8")
    (folder / "sizes.csv").write_text("bytes\n12\n16\n", encoding="utf-8")
    (folder / "linked.yaml").symlink_to("own.yaml")
    (folder / "sub").mkdir()
    with contextlib.chdir(folder):  # the result names its problem as it was named
        assert run(["solve", "own.yaml", "-q", "--json", "own.json"]) == 0
    return folder


def copied(origin: Path, target: Path) -> Path:
    folder = target / "own"
    shutil.copytree(origin, folder, symlinks=True)
    os.link(folder / "own.yaml", folder / "hard.yaml")
    os.link(folder / "types.yaml", folder / "hard-types.yaml")
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {item.name: item.read_bytes() for item in folder.rglob("*") if item.is_file()}


@pytest.mark.parametrize(("command", "option"), OUTPUTS)
def test_no_output_overwrites_an_input(
    command: str,
    option: str,
    origin: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = copied(origin, tmp_path)
    monkeypatch.chdir(folder)
    before = content(folder)
    problem = [str(folder / "own.yaml"), "own.yaml", "sub/../own.yaml", "linked.yaml", "hard.yaml"]
    included = ["types.yaml", "hard-types.yaml", *(["sizes.csv"] if command == "sensitivity" else [])]
    result = ["own.json", str(folder / "own.json")] if "RESULT" in " ".join(COMMANDS[command]) else []
    for name in [*problem, *included, *result]:
        arguments = [part.replace("FILE", "own.yaml").replace("RESULT", "own.json") for part in COMMANDS[command]]
        arguments = [part for part in arguments if part != "--no-store" or option != "--store"]
        assert run([*arguments, option, name]) == 2, name
        said = capsys.readouterr()
        assert f"{name}: is " in said.err and "not overwritten" in said.err, said.err
        assert "solver calls" not in said.err  # told before the work
    assert content(folder) == before


@pytest.mark.parametrize("command", ["solve", "sweep", "sensitivity"])
def test_a_report_overwrites_no_input(
    command: str, origin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report of a problem in JSON, written to the folder of the problem."""
    folder = copied(origin, tmp_path)
    name = {"solve": "Pump.json", "sweep": "Pump-sweep.json", "sensitivity": "Pump-sensitivity.json"}[command]
    shutil.copy(folder / "own.yaml", folder / name)
    monkeypatch.chdir(folder)
    before = content(folder)
    arguments = [part.replace("FILE", name) for part in COMMANDS[command]]
    assert run([*arguments, "--report", "-o", "."]) == 2
    assert "is the problem file that this command reads" in capsys.readouterr().err
    assert content(folder) == before


def test_a_report_of_a_study_does_not_overwrite_it(
    origin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = copied(origin, tmp_path)
    monkeypatch.chdir(folder)
    assert run([*(part.replace("FILE", "own.yaml") for part in COMMANDS["sweep"]), "--json", "own.md"]) == 0
    before = content(folder)
    assert run(["report", "own.json", "--study", "own.md", "-o", "."]) == 2
    assert "is a study that this command reads" in capsys.readouterr().err
    assert run(["report", "own.json", "-o", "."]) == 2
    assert content(folder) == before


def test_two_outputs_in_one_file_are_refused(
    origin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = copied(origin, tmp_path)
    monkeypatch.chdir(folder)
    (folder / "other.json").symlink_to("new.json")
    before = content(folder)
    for outputs in (
        ["--json", "new.json", "--csv", "new.json"],
        ["--json", "new.json", "--csv", "./new.json"],
        ["--json", "other.json", "--csv", "new.json"],
        ["--json", "./own.csv", "--report", "-o", "."],
    ):
        assert run(["solve", "own.yaml", "-q", *outputs]) == 2, outputs
        assert "needs a name of its own" in capsys.readouterr().err
    sweep = [part for part in COMMANDS["sweep"] if part != "--no-store"]
    sweep = [part.replace("FILE", "own.yaml") for part in sweep]
    for output in ("own.runs.sqlite", "own.runs.sqlite-wal"):
        assert run([*sweep, "--json", output]) == 2
    assert content(folder) == before


def test_a_stopped_search_may_go_on_in_its_own_file(origin: Path, tmp_path: Path) -> None:
    """All that was in the file is in the result that takes its place."""
    folder = copied(origin, tmp_path)
    path = folder / "own.json"
    assert run(["solve", "--resume", str(path), "-q", "--json", str(path)]) == 0
    assert len(json.loads(path.read_text(encoding="utf-8"))["front"]) == 4
    assert run(["solve", "--resume", str(path), "-q", "--json", str(folder / "own.yaml")]) == 2


def test_standard_output_in_the_same_file(origin: Path, tmp_path: Path) -> None:
    folder = copied(origin, tmp_path)
    program = [sys.executable, "-c", "from dse.cli.entry import main; main()"]
    with (folder / "out.json").open("w", encoding="utf-8") as stream:
        done = subprocess.run(
            [*program, "check", "own.yaml", "--json", "out.json"],
            cwd=folder,
            stdout=stream,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
    assert (done.returncode, "standard output" in done.stderr) == (2, True)


def test_the_report_of_the_api_overwrites_no_input(origin: Path, tmp_path: Path) -> None:
    folder = copied(origin, tmp_path)
    (folder / "own.yaml").rename(folder / "own.md")
    before = content(folder)
    result = dse.solve(folder / "own.md")
    with pytest.raises(UsageError, match="not overwritten"):
        dse.write_report(result, folder)
    assert content(folder) == before


@pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")
def test_what_is_replaced_keeps_its_mode_and_links_are_followed(origin: Path, tmp_path: Path) -> None:
    folder = copied(origin, tmp_path)
    secret, link, hard = folder / "secret.json", folder / "link.json", folder / "hard.json"
    secret.write_text("old", encoding="utf-8")
    secret.chmod(0o600)
    link.symlink_to("secret.json")
    os.link(secret, hard)
    assert run(["check", str(folder / "own.yaml"), "--json", str(link)]) == 0
    assert link.is_symlink() and json.loads(secret.read_text(encoding="utf-8"))
    assert secret.stat().st_mode & 0o777 == 0o600
    assert hard.read_text(encoding="utf-8") == "old"  # a file of its own now
    dangling = folder / "dangling.json"
    dangling.symlink_to("new.json")
    assert run(["check", str(folder / "own.yaml"), "--json", str(dangling)]) == 0
    assert dangling.is_symlink() and json.loads((folder / "new.json").read_text(encoding="utf-8"))
    umask = os.umask(0)
    os.umask(umask)
    assert (folder / "new.json").stat().st_mode & 0o777 == 0o666 & ~umask
    report = folder / "out"
    report.mkdir()
    (report / "own.csv").write_text("old", encoding="utf-8")
    (report / "own.csv").chmod(0o640)
    dse.write_report(dse.solve(folder / "own.yaml"), report)
    assert (report / "own.csv").stat().st_mode & 0o777 == 0o640


def test_the_folder_of_a_page_is_made(origin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = copied(origin, tmp_path)
    page = folder / "new" / "pages" / "own.html"
    assert run(["check", str(folder / "own.yaml"), "--report", str(page)]) == 0
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert capsys.readouterr().err == ""  # nothing about extras that nobody asked for
    assert run(["check", str(folder / "own.yaml"), "--report", str(folder / "own.yaml" / "x.html")]) == 2
    assert "cannot be made" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("missing/x.json", "there is no folder"),
        ("sub", "is a folder"),
        ("x" * 300 + ".json", "File name too long"),
        ("cycle.json", "links lead in a cycle"),
        ("own.yaml/x.json", "there is no folder"),
    ],
)
def test_what_cannot_be_written_is_told_before_the_work(
    name: str,
    said: str,
    origin: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = copied(origin, tmp_path)
    (folder / "cycle.json").symlink_to("cycle.json")
    monkeypatch.setattr("dse.questions.verbs.solve.solve_asked", lambda *_: pytest.fail("the search began"))
    assert run(["solve", str(folder / "own.yaml"), "--json", str(folder / name)]) == 2
    assert said in capsys.readouterr().err


def test_a_name_of_250_characters_is_written(origin: Path, tmp_path: Path) -> None:
    folder = copied(origin, tmp_path)
    path = folder / f"{'x' * 245}.json"
    assert run(["check", str(folder / "own.yaml"), "--json", str(path)]) == 0
    assert path.is_file() and not list(folder.glob(".dse-*"))


def test_the_same_output_may_be_written_again(tmp_path: Path) -> None:
    """As the result so far is, with other files between that may get the inode of the one before."""
    with guarding() as guard:
        guard.claim(tmp_path / "a")
        for number in range(20):
            write_file(tmp_path / "a", str(number))
            write_files(tmp_path, [(f"b{number}", b"x"), (f"c{number}", "y")])
        with pytest.raises(UsageError, match="name of its own"):
            guard.claim(tmp_path / "b3")
    assert (tmp_path / "a").read_text(encoding="utf-8") == "19"


def test_files_of_a_report_are_claimed_before_the_first_is_written(tmp_path: Path) -> None:
    (tmp_path / "last").write_text("input", encoding="utf-8")
    with guarding(tmp_path / "last"), pytest.raises(UsageError):
        write_files(tmp_path, [("first", "x"), ("last", "y")])
    assert not (tmp_path / "first").exists()


def test_devices_may_be_written_twice(tmp_path: Path) -> None:
    guard = Guard()
    guard.claim(os.devnull)
    guard.claim(os.devnull)
    assert not guard.outputs


@pytest.mark.parametrize("outputs", [["--csv", "own.json"], ["--json", "more.json", "--csv", "own.json"]])
def test_only_the_result_itself_takes_the_place_of_one_that_is_resumed(
    origin: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outputs: list[str]
) -> None:
    folder = copied(origin, tmp_path)
    monkeypatch.chdir(folder)
    before = content(folder)
    assert run(["solve", "--resume", "own.json", "-q", *outputs]) == 2
    assert content(folder) == before
    assert run(["solve", "--resume", "own.json", "-q", "--json", "own.json", "--csv", "own.csv"]) == 0


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("option", ["--json", "--csv"])
def test_a_problem_that_the_run_does_not_read_is_not_overwritten_either(
    form: str, option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slip of the shell's completion; what a command has written before is its own to replace."""
    monkeypatch.chdir(tmp_path)
    Path("own.yaml").write_text(PUMP, encoding="utf-8")
    text = PUMP if form == "yaml" else json.dumps({"name": "Other", "dse": 1, "threads": {}})
    Path("other").write_text(text, encoding="utf-8")
    assert run(["solve", "own.yaml", "-q", option, "other"]) == 2
    assert "other: is a problem file, and is not overwritten; give another name" in capsys.readouterr().err
    assert Path("other").read_text(encoding="utf-8") == text
    for _ in range(2):
        assert run(["solve", "own.yaml", "-q", option, "result"]) == 0
    assert (
        run(["export", "result", "--alternative", "1", "-o", "other"] if option == "--json" else ["check", "own.yaml"])
        == 0
    )
