"""Tampered results, studies and stores end with a message that names them."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import shutil
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from dse.cli.main import run
from tests.fuzz.crafted import Crafted, craft_store, crafted
from tests.fuzz.harness import EXIT_CODES, LIMIT_S, Hangs
from tests.helpers.effort import FIRST, count

CASES = max(24, count(250))
SEED = 1 + FIRST
PUMP = Path(__file__).parent / "pump.yaml"
GRID = (
    *("sweep", "pump.yaml", "--vary", "bus_types.can_250k.bandwidth=200 kbit/s, 300 kbit/s"),
    *("--vary", "price=100EUR,300EUR", "--workers", "1"),
)
DESIGN = tuple(
    part
    for text in (
        "computer.type=small", "can0.type=can_250k", "filter.dispatch_protocol=periodic", "filter.period=5ms",
        "control.period=10ms",
    )
    for part in ("--design", text)
)  # fmt: skip
BASES: dict[str, tuple[str, ...]] = {
    "complete": ("solve", "pump.yaml", "-q"),
    "others": ("solve", "pump.yaml", "-q", "--further", "2", "--within", "20%", "--top", "2"),
    "infeasible": ("solve", "pump.yaml", "-q", "--max-jitter", "5ms", "--max-price", "50EUR"),
    "robust": ("solve", "uncertain.yaml", "-q", "--robust"),
    "hosts": ("solve", "hosts.yaml", "-q", "--further", "1"),
    "sweep": ("sweep", "pump.yaml", "--vary", "jitter of sensor_to_valve=1ms..40ms", "--no-store"),
    "grid": (*GRID, "--store", "whole.sqlite"),
    "sensitivity": ("sensitivity", "pump.yaml", "--samples", "50", "--no-front", *DESIGN),
}
STUDIES = ("sweep", "grid", "sensitivity")
ON_RESULTS = (
    ("verify", "ODD"),
    ("verify", "ODD", "--method", "model"),
    ("report", "ODD", "-o", "report"),
    ("report", "ODD", "-o", "report", "--rank-by", "knee", "--figures", "svg"),
    ("compare", "ODD", "complete.json"),
    ("compare", "complete.json", "ODD"),
    ("compare", "ODD#1", "baseline"),
    ("export", "ODD", "--alternative", "1"),
    ("export", "ODD", "--alternative", "1", "--format", "ros2"),
    ("export", "ODD", "--alternative", "2.1", "--format", "graphml"),
    ("solve", "--resume", "ODD", "-q", "--json", "-", "--time-limit", "2s"),
    ("analyse", "pump.yaml", "--design", "ODD#1"),
    ("simulate", "pump.yaml", "--design", "ODD#1", "--duration", "5ms", "--runs", "1"),
)
OF_BOTH = ("leaves open", "the results have different objectives")
"""What is wrong about a sound file beside another one."""
ON_STUDIES = (
    ("report", "ODD", "-o", "report"),
    ("report", "ODD", "-o", "report", "--figures", "svg"),
    ("report", "complete.json", "--study", "ODD", "-o", "report"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where true results, studies and a store lie; it is the current folder."""
    place, before = tmp_path_factory.mktemp("crafted"), Path.cwd()
    os.chdir(place)
    text = PUMP.read_text(encoding="utf-8")
    Path("pump.yaml").write_text(text, encoding="utf-8")
    more = "\nuncertainty:\n  threads.filter.compute_execution_time.small: {factor: 0.9 .. 1.1}\n"
    Path("uncertain.yaml").write_text(text + more, encoding="utf-8")
    shutil.copy(PUMP.parent / "hosts.yaml", "hosts.yaml")
    for name, arguments in BASES.items():
        code, _, error = called(*arguments, "--json", f"{name}.json")
        assert code in (0, 4, 5), (name, error)
    stopped = json.loads(Path("complete.json").read_text(encoding="utf-8"))
    last = stopped["front"].pop()
    region = {name: value + 1 for name, value in last["objectives"].items()}
    stopped |= {"status": "incomplete", "unexplored": [region], "potential": last["objectives"]}
    Path("incomplete.json").write_text(json.dumps(stopped), encoding="utf-8")
    yield place
    os.chdir(before)


def called(*arguments: str) -> tuple[Any, str, str]:
    """Exit code (or what was raised), standard output and error; the output takes only text that can be written."""
    out, error = io.TextIOWrapper(io.BytesIO(), encoding="utf-8"), io.StringIO()

    def alarm(number: int, frame: FrameType | None) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, alarm)
    signal.alarm(LIMIT_S)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            code: Any = run(list(arguments))
            out.flush()
    except Hangs:
        code = "hangs"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    buffer = out.buffer
    assert isinstance(buffer, io.BytesIO)
    return code, buffer.getvalue().decode(), error.getvalue()


def fault(name: str, odd: str, arguments: tuple[str, ...]) -> str:
    """What should not have come of a command on a tampered file; "" for nothing."""
    code, _, error = called(*(part.replace("ODD", odd) for part in arguments))
    if code not in EXIT_CODES:
        return f"{name}: {arguments} ends with {code}: {error[-300:]}"
    if "Traceback" in error or "Exception ignored" in error:
        return f"{name}: {arguments} shows a traceback"
    is_told = odd in error or any(text in error for text in OF_BOTH)
    if code in (2, 3) and arguments[0] != "verify" and not is_told:
        return f"{name}: {arguments} does not name the file: {error[-300:]}"
    return ""


def drawn(name: str, rng: random.Random) -> Crafted:
    made = crafted(json.loads(Path(f"{name}.json").read_text(encoding="utf-8")), rng)
    Path("odd.json").write_text(made.text, encoding="utf-8", errors="surrogatepass")
    return made


@pytest.mark.timeout(120 + 4 * CASES)
def test_tampered_results_and_studies_are_told(folder: Path) -> None:
    rng, faults, seen = random.Random(SEED), [], Counter[str]()
    for _ in range(CASES):
        name = rng.choice(("complete", "others", "infeasible", "incomplete", "robust", "hosts", *STUDIES))
        made = drawn(name, rng)
        arguments = rng.choice(ON_STUDIES if name in STUDIES else ON_RESULTS)
        seen[arguments[0]] += 1
        if found := fault(f"{name} with {made.what}", "odd.json", arguments):
            faults.append(found)
    assert not faults
    assert len(seen) >= 6


@pytest.mark.timeout(120 + CASES)
def test_tampered_stores_are_told(folder: Path) -> None:
    rng, faults = random.Random(SEED), []
    for _ in range(max(20, CASES // 4)):
        for left in folder.glob("odd.sqlite*"):
            left.unlink()
        shutil.copy("whole.sqlite", "odd.sqlite")
        what = craft_store(Path("odd.sqlite"), rng)
        if found := fault(f"store with {what}", "odd.sqlite", (*GRID, "--store", "ODD", "--json", "-")):
            faults.append(found)
    assert not faults


# --- what this found, or somebody else -----------------------------------------------------------------------------


def edited(name: str, **changes: Any) -> None:
    data = json.loads(Path(f"{name}.json").read_text(encoding="utf-8"))
    for path, value in changes.items():
        *parents, last = path.split("__")
        holder = data
        for key in parents:
            holder = holder[int(key) if key.isdecimal() else key]
        holder[int(last) if last.isdecimal() else last] = value
    Path("odd.json").write_text(json.dumps(data), encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("complete", {"problem__effective__objectives": ["minimise price", "minimise price"]}, "an objective twice"),
        ("complete", {"front__0__decisions__filter.period": "\ud800"}, "half of a character"),
        ("complete", {"others": [{"designs": 3}]}, "not a whole result: others[0].of: is missing"),
        ("incomplete", {"potential": {"price": 1}}, "potential: is not about its objectives"),
        ("infeasible", {"conflicts__0__members__0__text": 3}, "conflicts[0].members[0].text: expected text, got 3"),
        ("infeasible", {"conflicts__0__members__0__closest": "1e999999999"}, "no number that can be computed with"),
        ("grid", {"runs__0__status": 0.5}, "is not a whole sweep: runs[0].status: expected"),
        ("sensitivity", {"tornado__0__values": ["1e-999999999"]}, "no number that can be computed with"),
        (
            "complete",
            {"problem__effective__profile": "dsee"},
            "result: problem.effective.profile: expected",
        ),
    ],
)
def test_single_oddities(folder: Path, name: str, changes: dict[str, Any], said: str) -> None:
    edited(name, **changes)
    code, _, error = called("report", "odd.json", "-o", "report")
    assert (code, "odd.json: " in error) == (2, True), error
    assert said in " ".join(error.split())


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", "9" * 5000, "[" * 100_000])
def test_no_json(folder: Path, number: str) -> None:
    Path("odd.json").write_text('{"format": "dse-result/1", "front": [], "x": ' + number + "}", encoding="utf-8")
    for command in (("report", "odd.json"), ("verify", "odd.json"), ("report", "complete.json", "--study", "odd.json")):
        code, _, error = called(*command)
        assert (code, "odd.json: " in error) == (2, True), error


def test_a_forged_entry_of_a_store_is_refused_by_its_key(folder: Path) -> None:
    for left in folder.glob("odd.sqlite*"):
        left.unlink()
    shutil.copy("whole.sqlite", "odd.sqlite")
    import hashlib
    import sqlite3

    connection = sqlite3.connect("odd.sqlite")
    key, outcome = connection.execute("SELECT key, outcome FROM runs ORDER BY key").fetchone()
    text = outcome.replace('"kind":"front"', '"kind":"front","x":1').replace('"metrics":{', '"metrics":{"more":1,', 1)
    assert text != outcome
    digest = hashlib.sha256(f"{key}\n{text}".encode()).hexdigest()
    connection.execute("UPDATE runs SET outcome = ?, digest = ? WHERE key = ?", (text, digest, key))
    connection.commit()
    connection.close()
    code, _, error = called(*GRID, "--store", "odd.sqlite", "--json", "-")
    assert (
        code == 2 and f"odd.sqlite: cannot be used as a store: the entry {key[:12]} was not written by a run" in error
    )


@pytest.mark.parametrize("option", ["--json", "--csv"])
def test_a_long_name_works_or_fails_before_the_work(folder: Path, option: str) -> None:
    name = "n" * 245 + ".out"
    assert called("solve", "pump.yaml", "-q", option, name)[0] == 0 and Path(name).stat().st_size
    code, _, error = called("solve", "pump.yaml", "-q", option, "n" * 260)
    assert code == 2 and "nnn: File name too long" in error
