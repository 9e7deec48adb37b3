"""Every file is read as what it may be: regular, of a bounded size; whatever else stands there is a message at once."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import socket
import threading
from pathlib import Path
from typing import Any, cast

import pytest

import dse
from dse.cli.main import run
from dse.questions.sweep.store import Store
from dse.support.errors import UsageError
from dse.support.files import writing
from dse.support.files.reading import UnreadableFileError, beginning, obstacle, read_bytes, read_text

PUMP = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
BASELINE = """
baseline:
  computer: {type: large}
  can0: {type: can_500k}
  filter: {dispatch_protocol: periodic, period: 5 ms}
  control: {period: 5 ms}
"""
pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices of POSIX")
KINDS = {
    "pipe": "this is a pipe",
    "device": "this is a device",
    "directory": "this is a directory",
    "socket": "this is a socket",
    "cycle": "links lead in a cycle",
    "huge": "larger than",
}


def placed(path: Path, kind: str) -> Path:
    """Something of a kind at a path."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "directory":
        path.mkdir()
    elif kind == "socket":
        with contextlib.chdir(path.parent), socket.socket(socket.AF_UNIX) as there:
            there.bind(path.name)
    elif kind == "cycle":
        path.symlink_to(path.name)
    else:
        with path.open("wb") as stream:
            stream.truncate(10**9)
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pump.yaml").write_text(PUMP + BASELINE, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_files_of_any_kind(kind: str, folder: Path) -> None:
    path = placed(folder / "x", kind)
    for read in (read_bytes, read_text):
        with pytest.raises(UnreadableFileError, match=KINDS[kind]):
            read(path)
    if kind != "huge":
        assert KINDS[kind] in str(obstacle(path))


@pytest.mark.parametrize("kind", KINDS)
def test_no_command_waits_for_a_file_without_an_end(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As problem, included file, samples, result, study, store; by every command that reads one."""
    name = placed(folder / "x.json", kind).name
    (folder / "includes.yaml").write_text(f"include: [{name}]\n{PUMP}", encoding="utf-8")
    stated = f"uncertainty: {{connections.reading.data_size: {{samples: {name}, column: bytes, unit: B}}}}"
    (folder / "samples.yaml").write_text(f"{PUMP}{BASELINE}{stated}\n", encoding="utf-8")
    assert run(["solve", "pump.yaml", "-q", "--json", "result.json"]) == 0
    vary = ["--vary", "jitter of sensor_to_valve=5ms..20ms", "--workers", "1"]
    told_by_click = ("directory", "cycle")
    capsys.readouterr()
    for arguments, code in [
        (["check", name], 3),
        (["solve", name], 3),
        (["check", "includes.yaml"], 3),
        (["sensitivity", "samples.yaml", "--no-front"], 3),
        (["solve", "samples.yaml", "--robust"], 3),
        (["verify", name], 2),
        (["report", name], 2),
        (["report", "result.json", "--study", name], 2),
        (["compare", f"{name}#1", "baseline"], 2),
        (["export", name, "--alternative", "1"], 2),
        (["solve", "--resume", name], 2),
        (["analyse", "pump.yaml", "--design", f"{name}#1"], 2),
        (["verify", "result.json", "--problem", name], 3),
        *([(["sweep", "pump.yaml", *vary, "--store", name], 2)] if kind != "huge" else []),
    ]:
        by_click = (
            kind in told_by_click and name in arguments and "--design" not in arguments and "--store" not in arguments
        )
        found = run(arguments)
        said = capsys.readouterr().err
        assert found == (2 if by_click and arguments[0] != "compare" else code), (arguments, said)
        assert KINDS[kind] in said or by_click or "--store" in arguments, (arguments, said)


def test_the_api_reads_the_same(folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "cycle").symlink_to("cycle")
    for name, words in (("pipe", "this is a pipe"), ("cycle", "links lead in a cycle")):
        with pytest.raises(dse.ProblemError, match=words):
            dse.load(folder / name)
        with pytest.raises(UsageError, match=words):
            dse.verify(folder / name)
        with pytest.raises(UsageError, match=words if name == "pipe" else "store|cycle"):
            dse.sweep(folder / "pump.yaml", "price=100 EUR..500 EUR", store=folder / name)


def test_a_result_that_is_larger_than_any(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = folder / "x"
    path.write_bytes(b"12345")
    assert read_bytes(path, 5) == b"12345"
    with pytest.raises(UnreadableFileError, match="larger than 4 B"):
        read_bytes(path, 4)


def test_a_pipe_as_output_is_given_up_where_nobody_reads_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(writing, "READER_WAIT_S", 0.1)
    os.mkfifo(folder / "out")
    assert run(["analyse", "pump.yaml", "--json", "out"]) == 2
    told = capsys.readouterr()
    assert "out: no program reads from this pipe" in told.err
    assert "jitter of sensor_to_valve" in told.out


def test_a_pipe_as_output_waits_for_its_reader(folder: Path) -> None:
    os.mkfifo(folder / "out")
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append((folder / "out").read_bytes()))
    opened = writing.os.open

    def late(path: str, *rest: int) -> int:
        if not reader.is_alive():
            reader.start()
            raise OSError(errno.ENXIO, "no reader")
        return opened(path, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writing.os, "open", late)
        writing.write_file(folder / "out", "x" * 200_000)
    reader.join()
    assert read == [b"x" * 200_000]


@pytest.mark.parametrize("name", ["/proc/kmsg", "text"])
def test_a_store_is_a_database_before_it_is_opened(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Files of the kernel are regular ones by what they say of themselves, and are waited for without an end."""

    def opened(*_: object, **__: object) -> None:
        raise AssertionError("it would wait")

    if name.startswith("/") and not Path(name).exists():
        pytest.skip("no such file here")
    (folder / "text").write_text("a line\n", encoding="utf-8")
    monkeypatch.setattr("sqlite3.connect", opened)
    with pytest.raises(UsageError, match="cannot be used as a store"):
        Store(Path(name))


def test_what_is_not_there_yet_is_not_waited_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "log").write_bytes(b"")
    monkeypatch.setattr("dse.support.files.reading.os.fdopen", lambda *_: Silent(b""))
    for read in (read_bytes, lambda path: beginning(path, 4)):
        with pytest.raises(UnreadableFileError, match="there is nothing in it as yet"):
            read(folder / "log")


class Silent(io.BytesIO):
    """What is read without waiting, where there is nothing as yet."""

    def fileno(self) -> int:
        return 0

    def read(self, size: int | None = -1, /) -> bytes:
        found: Any = None
        return cast(bytes, found)
