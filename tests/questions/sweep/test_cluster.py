"""A Dask cluster gives the same results in the same order; a worker that dies costs its run only."""

from __future__ import annotations

import os
import signal
import socket
import socketserver
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest

from dse.examples.shipped import example_path
from dse.questions.sweep.store import Store
from dse.questions.sweep.sweep import SweepProgress, sweep
from dse.support.errors import UsageError
from tests.questions.studies import LONG, example, long_test
from tests.questions.sweep.test_sweep import first_path

RUNS = 60 if LONG else 12


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and workers as a user starts them; address, worker processes and, as the last, the scheduler's."""
    pytest.importorskip("distributed")
    address = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    options = ["--scheduler-file", str(address), "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", "--port", "0", "--host", "127.0.0.1", *options], **quiet)  # type: ignore[call-overload]
    processes = [
        subprocess.Popen(  # type: ignore[call-overload]
            [*dask, "worker", *options, "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1"], cwd=folder, **quiet
        )
        for _ in range(workers)
    ]
    try:
        yield _address(address, workers), [*processes, scheduler]
    finally:
        for process in [*processes, scheduler]:
            process.kill()
            process.wait()


def _address(file: Path, workers: int) -> str:
    import json

    from distributed import Client

    for _ in range(600):
        if file.exists() and file.stat().st_size:
            break
        time.sleep(0.1)
    address = str(json.loads(file.read_text())["address"])
    with Client(address, timeout=60, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=120)
    return address


@long_test
@pytest.mark.filterwarnings("default")
def test_three_workers_one_killed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    problem = example("inmark" if LONG else "starter")
    path = first_path("inmark" if LONG else "starter", ".price")
    vary = f"{path}=1 EUR..{RUNS} EUR step 1 EUR"
    with cluster(tmp_path, 1) as (address, _):
        started = time.monotonic()
        one = sweep(problem, vary, scheduler=address)
        alone_s = time.monotonic() - started
    folder = tmp_path / "three"
    folder.mkdir()
    with cluster(folder, 3) as (address, workers):

        def kill(progress: SweepProgress) -> None:
            if progress.done == RUNS // 3:
                os.kill(workers[1].pid, signal.SIGKILL)

        started = time.monotonic()
        three = sweep(problem, vary, scheduler=address, store=tmp_path / "s", progress=kill)
        together_s = time.monotonic() - started
        assert workers[1].wait(10) == -signal.SIGKILL
    assert three.to_json() == one.to_json() and three.status == "complete"
    assert sweep(problem, vary, workers=1, store=tmp_path / "s").solved == 0
    with Store(tmp_path / "s") as store:
        assert store.solved() == RUNS
    with capsys.disabled():
        said = f"one worker {alone_s:.1f} s, three with one killed {together_s:.1f} s, ratio {alone_s / together_s:.2f}"
        sys.stderr.write(f"\n{RUNS} runs: {said}\n")


@long_test
def test_a_scheduler_that_dies_is_told_in_one_line(tmp_path: Path) -> None:
    """Not with what Dask logs of it, a screen of tracebacks."""
    vary = f"{first_path('starter', '.price')}=1 EUR..3000 EUR step 1 EUR"
    with cluster(tmp_path, 1) as (address, processes):
        arguments = ["sweep", str(example_path("starter")), "--vary", vary, "--no-store", "--scheduler", address]
        run = subprocess.Popen(
            [sys.executable, "-c", "from dse.cli.entry import main; main()", *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[3],
        )
        assert run.stderr is not None and " runs, about " in run.stderr.readline()
        processes[-1].kill()
        _, said = run.communicate(timeout=120)
    lines = [line for line in said.splitlines() if " runs, about " not in line]
    assert (run.returncode, lines) == (2, ["dse: the scheduler is gone; run the same command again to go on"])


@pytest.mark.filterwarnings("default")
def test_a_cluster_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("dse.questions.sweep.cluster.CONNECT_S", 1)
    for address, words in (
        ("tcp://127.0.0.1:9", "nothing listens there"),
        ("127.0.0.1:9", "nothing listens there"),
        ("tcp://no-such-host.invalid:8786", "nothing listens there"),
        ("nonsense://x", "expected tcp://HOST:PORT"),
        ("nonsense", "expected tcp://HOST:PORT"),
        ("tcp://127.0.0.1:99999", "expected tcp://HOST:PORT"),
        ("", "expected tcp://HOST:PORT"),
    ):
        with pytest.raises(UsageError, match=words):
            sweep(example("starter"), "price=100 EUR,200 EUR", scheduler=address)
    with socket.create_server(("127.0.0.1", 0)) as other:  # listens, but is no scheduler
        port = other.getsockname()[1]
        with pytest.raises(UsageError, match="there is no Dask scheduler"):
            sweep(example("starter"), "price=100 EUR,200 EUR", scheduler=f"tcp://127.0.0.1:{port}")
    for kind in (Talker, Zeros):
        with socketserver.ThreadingTCPServer(("127.0.0.1", 0), kind) as talker:
            Thread(target=talker.serve_forever, daemon=True).start()
            port = talker.server_address[1]
            with pytest.raises(UsageError, match="there is no Dask scheduler"):
                sweep(example("starter"), "price=100 EUR,200 EUR", scheduler=f"tcp://127.0.0.1:{port}")
            talker.shutdown()


class Talker(socketserver.BaseRequestHandler):
    """Answers in a language of its own."""

    def handle(self) -> None:
        self.request.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" * 10)


class Zeros(socketserver.BaseRequestHandler):
    """Sends what a decoder stumbles over."""

    def handle(self) -> None:
        self.request.sendall(b"\0" * 1000)
        time.sleep(1)


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'dse-pareto\[cluster\]'"):
        sweep(example("starter"), "price=100 EUR,200 EUR", scheduler="tcp://127.0.0.1:9")
