"""Readers that go away, full disks, closed streams, Ctrl-C, two runs at once: a message, a true code, whole files."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from dse.cli.main import run
from tests.helpers.effort import LONG, count, few, long_test

ROOT = Path(__file__).parents[2]
PUMP = ROOT / "tests" / "fuzz" / "pump.yaml"
INMARK = ROOT / "problems" / "inmark.yaml"
PROGRAM = [sys.executable, "-c", "from dse.cli.entry import main; main()"]
SWEEP = ["sweep", str(PUMP), "--vary", "jitter of sensor_to_valve=1ms..40ms", "--no-store", "--workers", "1"]
INTERRUPTS = count(2)


def dse(*arguments: str, environment: dict[str, str] | None = None, **more: Any) -> subprocess.CompletedProcess[str]:
    more = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **more}
    everything = {**os.environ, "PYTHONPATH": str(ROOT), **(environment or {})}
    return subprocess.run([*PROGRAM, *arguments], text=True, env=everything, check=False, **more)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result file of the pump."""
    path = tmp_path_factory.mktemp("world") / "result.json"
    assert run(["solve", str(PUMP), "-q", "--json", str(path)]) == 0
    return path


def no_reader() -> int:
    """The writing end of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["solve", str(PUMP)], 0),
        (["solve", str(PUMP), "--max-jitter", "5ms"], 4),
        (["--help"], 0),
        (SWEEP, 0),
        *([(["schema"], 0), (["solve", str(PUMP), "-q", "--json", "-"], 0)] if LONG else []),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else str(value),
)
def test_without_a_reader_the_exit_code_means_what_it_means(arguments: list[str], code: int) -> None:
    done = dse(*arguments, stdout=no_reader())
    assert (done.returncode, "Traceback" in done.stderr, "Exception ignored" in done.stderr) == (code, False, False)


def test_without_a_reader_files_are_written_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    dse("solve", str(PUMP), "--json", str(path), stdout=no_reader())
    assert json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    "arguments", few([["solve", str(PUMP)], ["--help"], ["schema"], ["solve", str(PUMP), "-q", "--json", "-"]], 2)
)
def test_a_full_disk_behind_standard_output_is_a_message(arguments: list[str]) -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = dse(*arguments, stdout=full)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (2, "dse: No space left on device")


def limited(size: int) -> Callable[[], None]:
    """No file of this process may grow beyond a size, as on a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_a_full_disk_loses_neither_the_answer_nor_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text("old", encoding="utf-8")
    done = dse("solve", str(PUMP), "--json", str(path), preexec_fn=limited(1000))
    assert done.returncode == 2
    assert "Front    complete, proved: 4 designs" in done.stdout
    assert done.stderr.splitlines()[-1] == f"dse: {path}: File too large"
    assert [item.name for item in tmp_path.iterdir()] == ["result.json"]
    assert path.read_text(encoding="utf-8") == "old"


@long_test
def test_a_full_disk_below_a_report_leaves_no_half_file(tmp_path: Path, result: Path) -> None:
    done = dse("report", str(result), "-o", str(tmp_path / "out"), preexec_fn=limited(20_000))
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert all(item.stat().st_size < 20_000 and item.name[0] != "." for item in (tmp_path / "out").iterdir())


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["check", "nothing.yaml"], 2),
        (["check", str(ROOT / "tests" / "bad_inputs" / "period_zero.yaml")], 3),
        (["solve", str(PUMP), "--max-jitter", "5ms"], 4),
    ],
    ids=lambda value: str(value),
)
def test_exit_codes_where_nobody_reads_what_is_said(arguments: list[str], code: int) -> None:
    """As in ``dse check bad.yaml 2>&1 | true``."""
    for out in (subprocess.PIPE, no_reader()) if LONG else (no_reader() if code == 2 else subprocess.PIPE,):
        assert dse(*arguments, stdout=out, stderr=no_reader()).returncode == code


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_folder_is_told_before_the_work(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    done = dse("solve", str(PUMP), "--json", str(tmp_path / "result.json"))
    assert (done.returncode, "cannot be written to" in done.stderr) == (2, True)


@pytest.mark.parametrize("redirections", few(["<&- >&- 2>&-", ">&-", "2>&-", ">&- 2>&-", "<&-"]))
def test_closed_streams(redirections: str, tmp_path: Path) -> None:
    command = f'"$@" {redirections}'
    path = tmp_path / "result.json"
    arguments = [*PROGRAM, "solve", str(PUMP), "--json", str(path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(["sh", "-c", command, "sh", *arguments], capture_output=True, env=environment, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False)
    assert len(json.loads(path.read_text(encoding="utf-8"))["front"]) == 4


@pytest.mark.parametrize(
    ("environment", "other"),
    few(
        [
            ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, ["explain", "--max-jitter", "5ms"]),
            ({"PYTHONIOENCODING": "ascii:strict"}, ["analyse", "--require", "☃ <= 1 ms"]),
            ({"PYTHONIOENCODING": "latin-1:strict", "TERM": "dumb"}, ["explain", "--max-jitter", "5ms"]),
            ({"NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "1"}, ["check"]),
            ({"LANG": "tr_TR.ISO-8859-9", "TERM": ""}, ["analyse", "--require", "☃ <= 1 ms"]),
        ],
        2,
    ),
    ids=lambda value: next(iter(value)),
)
def test_terminals_without_colours_or_characters(environment: dict[str, str], other: list[str], tmp_path: Path) -> None:
    file = tmp_path / "größe ☃.yaml"
    text = PUMP.read_text(encoding="utf-8").replace("name: Pump", "name: Pümpe ☃ Größe")
    file.write_text(text, encoding="utf-8")
    for command in (["solve"], other) if LONG or "LC_ALL" in environment else (other,):
        done = dse(command[0], str(file), *command[1:], environment=environment, errors="replace")
        assert done.returncode in (0, 2, 3, 4), (command, done.stderr)
        assert "Traceback" not in done.stderr and "a bug in dse" not in done.stderr and "\x1b[" not in done.stdout


@long_test
def test_two_runs_that_write_the_same_folder_leave_whole_files(tmp_path: Path, result: Path) -> None:
    """Some runs replace the files while others do: in the end, and at every moment, each file is a whole one."""
    folder = tmp_path / "out"
    assert run(["report", str(result), "-o", str(folder)]) == 0
    whole = {item.name: item.stat().st_size for item in folder.iterdir()}
    seen: list[tuple[str, int]] = []
    done = threading.Event()

    def look() -> None:
        while not done.wait(0.002):
            for name in whole:
                seen.append((name, (folder / name).stat().st_size))

    watcher = threading.Thread(target=look)
    watcher.start()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    arguments = ["report", str(result), "-o", str(folder)]
    both = [subprocess.Popen([*PROGRAM, *arguments], env=environment) for _ in range(2)]
    assert [process.wait() for process in both] == [0, 0]
    done.set()
    watcher.join()
    assert seen and all(abs(size - whole[name]) < 100 for name, size in seen)  # dates differ, halves would by far more
    assert sorted(item.name for item in folder.iterdir()) == sorted(whole)


INTERRUPTED = {
    "solve": ["solve", str(INMARK), "--json", "JSON"],
    "explain": ["explain", str(INMARK), "--max-jitter", "5ms", "--all", "--json", "JSON"],
    "verify": ["verify", "RESULT", "--method", "model", "--json", "JSON"],
    "report": ["report", "RESULT", "-o", "REPORT"],
    "simulate": ["simulate", str(INMARK), "--runs", "20", "--json", "JSON"],
    "sweep": [*SWEEP, "--json", "JSON"],
    "check": ["check", str(INMARK), "--json", "JSON"],
    "fit": ["fit", "TIMES", "-o", "MADE", "--json", "JSON"],
    "sizes": ["sizes", "--json", "JSON"],
    "import": ["import", str(ROOT / "problems" / "aadl" / "inmark_chapter3.aadl"), "-o", "MADE"],
    "new": ["new", "--force", "--random", "MADE"],
    "schema": ["schema", "-o", "JSON"],
    "analyse": ["analyse", str(INMARK), "--json", "JSON"],
    "compare": ["compare", "RESULT", "RESULT", "--json", "JSON"],
    "sensitivity": ["sensitivity", str(INMARK), "--json", "JSON"],
    "export": ["export", "RESULT#1", "--format", "problem", "-o", "MADE"],
}


IN_A_CALLBACK = """
import signal, sys, time, weakref
import dse.cli.main
from dse.cli import entry

class Thing: pass

def run(arguments):
    thing = Thing()
    watched = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    del thing
    time.sleep(60)
    return 0

dse.cli.main.run = run
entry.main()
"""


def test_ctrl_c_in_a_callback_of_python_is_not_lost() -> None:
    """What is raised there, as in the locks of the import system, Python prints and forgets."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", IN_A_CALLBACK], env=environment, capture_output=True, text=True, timeout=50, check=False
    )
    assert (done.returncode, done.stderr) == (5, "\ndse: interrupted\n")


@pytest.fixture(scope="module")
def usual() -> float:
    """How long a search takes here, in seconds; the other commands are of that order."""
    started = time.monotonic()
    assert dse("solve", str(INMARK)).returncode == 0
    return time.monotonic() - started


ALIKE = (
    ()
    if LONG
    else ("sizes", "schema", "check", "analyse", "compare", "sensitivity", "export", "new", "fit", "explain", "verify")
)
"""Commands that do and write nothing of a kind of their own."""


@pytest.mark.parametrize("command", [name for name in INTERRUPTED if name not in ALIKE])
def test_ctrl_c_at_any_moment(command: str, tmp_path: Path, result: Path, usual: float) -> None:
    """From the first line of the program on; what Python itself does before that is not ours."""
    rng = random.Random(command)
    names = {"JSON": str(tmp_path / "out.json"), "RESULT": str(result), "REPORT": str(tmp_path / "report")}
    names |= {"TIMES": str(tmp_path / "times.csv"), "MADE": str(tmp_path / "made.yaml")}
    lines = (f"t{number % 5},{rng.randint(100, 900)}\n" for number in range(500))
    Path(names["TIMES"]).write_text("thread,delay_us\n" + "".join(lines), encoding="utf-8")
    arguments = [names.get(part, part.replace("RESULT#", f"{result}#")) for part in INTERRUPTED[command]]
    for _ in range(INTERRUPTS):
        process = subprocess.Popen(
            [sys.executable, "-c", "from dse.cli.entry import main; print('here', flush=True); main()", *arguments],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None and process.stdout.readline() == "here\n"
        time.sleep(0.02 + rng.random() * usual)
        process.send_signal(signal.SIGINT)
        out, said = process.communicate(timeout=120)
        assert process.returncode in (0, 4, 5), (process.returncode, said)
        told = ("stopped early", "stopped by Ctrl-C", "Stopped before the first point", "the sweep was stopped")
        is_said = "dse: interrupted" in said or any(words in out for words in told)
        assert (process.returncode == 5) <= is_said, (out, said)
        assert "Traceback" not in said and "Exception ignored" not in said and "a bug" not in said, said
        if Path(names["JSON"]).exists():
            json.loads(Path(names["JSON"]).read_text(encoding="utf-8"))
        if Path(names["MADE"]).exists():
            assert yaml.safe_load(Path(names["MADE"]).read_text(encoding="utf-8"))
        assert not list(tmp_path.rglob(".*"))
