"""What comes from files steers no terminal: it is shown as escapes, piped or not; files have it as it is."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dse
from dse.cli import common
from dse.cli.main import run
from dse.cli.printing import in_a_line, visible
from dse.examples.shipped import example_path
from dse.report.page import Item, Listing, Page, Section, Table, Text
from dse.report.terminal import print_page

PUMP = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
HOSTILE = "a\x1b]0;title\x07b\x9b31mc\u202ed\x00e\u2066\x7f\x1b[2J"
SHOWN = r"a\x1b]0;title\x07b\x9b31mc\u202ed\x00e\u2066\x7f\x1b[2J"
STEERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def test_every_character_that_steers_is_shown() -> None:
    assert visible(HOSTILE) == SHOWN
    assert visible("\udc80\x85") == r"\udc80\x85"
    assert visible("é µs ≤ 漢 …\n\t") == "é µs ≤ 漢 …\n\t"
    assert in_a_line("a\r\n\tb") == r"a\r\n\tb"
    every = "".join(map(chr, range(0x11000)))
    assert set(STEERS.findall(visible(every))) == set() and set(STEERS.findall(in_a_line(every))) == set()


def test_messages_and_paths_are_escaped(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"p{HOSTILE.replace(chr(0), '')}.yaml"
    path.write_text(PUMP.replace("name: Pump", f"name: Pump\n{json.dumps(HOSTILE)}: 1"), encoding="utf-8")
    hostile = HOSTILE.replace("\x00", "")
    assert run(["check", str(path)]) == 3
    said = capfd.readouterr().err
    assert f"{SHOWN}: unknown key" in said and len(said.splitlines()) == 2 and not STEERS.search(said)
    path.write_text(PUMP, encoding="utf-8")
    for more in (["--fix", f"{hostile} = 2"], ["--require", hostile], [f"--{hostile}"], ["--rank-by", hostile]):
        assert run(["solve", str(path), *more]) == 2
        said = capfd.readouterr().err
        assert r"\x1b" in said and not STEERS.search(said), more
    assert run(["solve", f"{path}x"]) == 2
    assert not STEERS.search(capfd.readouterr().err)


def test_pages_are_escaped_before_they_are_laid_out(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = (
        Text(HOSTILE),
        Listing((Item(HOSTILE, HOSTILE), Item(HOSTILE, tone="wrong"))),
        Table(HOSTILE, (HOSTILE, "second"), ((f"{HOSTILE}\nforged", "x"), ("short", "y"))),
    )
    print_page(common.console(), Page("t", HOSTILE, (Section("s", "S", blocks),)), every=True)
    said = capsys.readouterr().out
    assert said.count(SHOWN) >= 6 and not STEERS.search(said)
    rows = [line for line in said.splitlines() if line.rstrip().endswith((" x", " y"))]
    assert len(rows) == 2 and len({line.rstrip().rindex(" ") for line in rows}) == 1, "columns are one below the other"
    assert rf"{SHOWN}\nforged" in rows[0]


def test_data_are_what_they_are(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = PUMP.replace("name: Pump", f"name: Pump\nassumptions: [{json.dumps(HOSTILE)}, a\u202eb]")
    assert dse.loads(text).loaded.spec.assumptions == (HOSTILE, "a\u202eb")
    assert run(["solve", _written(tmp_path, text), "-q", "--json", "-"]) == 0
    assert text in _texts(json.loads(capfd.readouterr().out))


def _texts(data: object) -> list[str]:
    """Every text in plain data."""
    if isinstance(data, dict | list):
        return [text for item in (data.values() if isinstance(data, dict) else data) for text in _texts(item)]
    return [data] if isinstance(data, str) else []


def _written(folder: Path, text: str) -> str:
    path = folder / "written.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_terminal_is_told_what_a_pipe_is(tmp_path: Path) -> None:
    import pty

    file = _written(tmp_path, PUMP.replace("name: Pump", f"name: Pump\n{json.dumps(HOSTILE)}: 1"))
    ours, theirs = pty.openpty()
    program = "import sys; from dse.cli.main import run; sys.exit(run(sys.argv[1:]))"
    process = subprocess.run([sys.executable, "-c", program, "check", file], stdout=theirs, stderr=theirs, check=False)
    os.close(theirs)
    with io.FileIO(ours) as terminal:
        said = terminal.read(100_000) or b""
    assert process.returncode == 3
    assert f"{SHOWN}: unknown key".encode() in said and b"\x1b" not in said


def test_an_answer_has_the_lines_that_are_stated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A window of 18 lines, one of 40, and none, which is like 40; a window of one line has the shortest answer."""
    file = str(example_path("inmark"))
    heights = {}
    for stated in ("18", "40", "", "1", "many"):
        monkeypatch.setenv("LINES", stated)
        assert run(["simulate", file, "--runs", "1", "--duration", "100ms"]) in (0, 4)
        heights[stated] = capsys.readouterr().out.count("\n")
    assert heights["18"] < heights["40"] == heights[""] == heights["many"]
    assert heights["1"] <= heights["18"]


def test_nothing_else_prints() -> None:
    folder = Path(common.__file__).parent
    for path in folder.glob("*.py"):
        if path.name != "printing.py":
            found = re.findall(
                r"click\.echo\(|click\.secho\(|\bprint\(|stdout\.write\(", path.read_text(encoding="utf-8")
            )
            assert [item for item in found if item != "print("] == [], path
