"""Limits of time are kept by every command that has one, and what there was no time for is said.

The clock is not the machine's: it moves on by itself whenever somebody looks at it, so that every limit comes after so
many looks, on a slow machine as on a fast one.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path

import click
import pytest

import dse
from dse.analysis.scheduling.policies import preemptive
from dse.cli.main import COMMANDS, cli, run
from dse.cli.pages import print_front
from dse.report.content.front.document import Document
from dse.support import timelimit
from dse.support.timelimit import OutOfTime, StepCounter, TimeLimit, in_force, look_at_the_clock, until

PRIMES = (10007, 10009, 10037, 10039, 10061, 10067)
THREADS = "".join(
    f"  t{number}: {{processor: p, core: 1, period: [{prime} us, {prime + 20} us], compute_execution_time: "
    f"{prime * 1000 // len(PRIMES)} ns}}\n"
    for number, prime in enumerate(PRIMES)
)
COPRIME = f"""
dse: 1
name: coprime
processing: response_time
processor_types: {{cpu: {{price: 60 EUR}}, better: {{price: 90 EUR}}}}
processors: {{p: {{type: [cpu, better]}}}}
devices:
  s: {{period: 20 ms, compute_execution_time: 100 us .. 200 us}}
threads:
{THREADS}
connections: {{a: {{from: s, to: t5}}}}
flows: {{f: {{path: [s, t5]}}}}
requirements: [latency of f <= 1 s]
objectives: [minimise latency of f, minimise price]
baseline: {{p: {{type: cpu}}, {", ".join(f"t{n}: {{period: {prime} us}}" for n, prime in enumerate(PRIMES))}}}
uncertainty: {{threads.t0.compute_execution_time: {{factor: 0.9 .. 1.0}}}}
"""
"""Six threads that fill a core with periods without a common divisor: response times take thousands of steps."""
UNCERTAIN = """
processing: response_time
baseline:
  {computer: {type: large}, can0: {type: can_500k}, filter: {dispatch_protocol: aperiodic}, control: {period: 5 ms}}
uncertainty: {threads.filter.compute_execution_time.small.max: {factor: 0.9 .. 1.1}}
"""
"""What the pump needs for `dse sensitivity`: a design, and an uncertain input."""


@contextmanager
def jumping(step_s: float, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """A clock that moves on by a step with every look that a computation takes at it; the list has their number."""
    monotonic, looks = time.monotonic, [0]

    def looked() -> float:
        looks[0] += 1
        return monotonic() + looks[0] * step_s

    with monkeypatch.context() as patch:
        patch.setattr(timelimit.time, "monotonic", looked)
        yield looks


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    preemptive._remembered.cache_clear()  # what another test computed would take no time
    (tmp_path / "p.yaml").write_text(COPRIME, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def pump(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result of a problem that is solved at once."""
    source = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
    path = tmp_path_factory.mktemp("pump") / "pump.json"
    assert run(["solve", str(source), "-q", "--json", str(path)]) == 0
    return path


LIMITED = {
    "solve": ["solve", "p.yaml", "--json", "out.json"],
    "robust": ["solve", "p.yaml", "--robust", "--json", "out.json"],
    "explain": ["explain", "p.yaml", "--max-latency", "30ms", "--json", "out.json"],
    "sensitivity": ["sensitivity", "p.yaml", "--json", "out.json"],
    "simulate": ["simulate", "p.yaml", "--json", "out.json"],
    "sweep": [
        "sweep",
        "p.yaml",
        "--vary",
        "latency of f=30ms..1s",
        "--workers",
        "1",
        "--no-store",
        "--json",
        "out.json",
    ],
    "analyse": ["analyse", "p.yaml", "--response-times", "--json", "out.json"],
    "check": ["check", "p.yaml", "--json", "out.json"],
}


@pytest.mark.parametrize("name", LIMITED)
def test_a_limit_ends_every_command(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten looks at the clock, and it is over: an answer that says so, or a message; never a bug, never longer."""
    monkeypatch.setattr("dse.questions.verbs.check.TIME_S", inf)  # what it bounds by itself would be given up first
    with jumping(1000.0, monkeypatch) as looks:
        code = run([*LIMITED[name], "--time-limit", "10000s"])
    said = capsys.readouterr()
    assert code == 5, said
    assert looks[0] < 3000, "it went on after the limit"
    whole = name in ("analyse", "check")
    assert ("the time limit came before there was an answer" in said.err) == (not Path("out.json").exists())
    assert not whole or not Path("out.json").exists()
    if Path("out.json").exists():
        json.loads(Path("out.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_may_take_long_has_a_limit(command: str) -> None:
    found = cli.get_command(click.Context(cli), command)
    assert found is not None
    has = any("--time-limit" in parameter.opts for parameter in found.params)
    assert has == (command not in ("new", "schema"))


@pytest.mark.parametrize("command", ["report", "compare", "export"])
def test_what_is_whole_or_none_leaves_no_part(
    command: str, pump: Path, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = {
        "report": ["report", str(pump), "-o", "out"],
        "compare": ["compare", f"{pump}#1", f"{pump}#2", "--json", "out.json"],
        "export": ["export", str(pump), "--alternative", "1", "-o", "out.yaml"],
    }[command]
    with jumping(1000.0, monkeypatch):
        assert run([*arguments, "--time-limit", "1s"]) == 5
    assert "the time limit came before there was an answer" in capsys.readouterr().err
    left = [item for item in folder.rglob("*") if item.is_file() and item.name != "p.yaml"]
    assert left == []


READERS = {
    "analyse": [], "check": [], "explain": [],
    "sensitivity": [], "simulate": [], "solve": [], "solve --robust": [],
    "sweep": ["--no-store", "--vary", "latency of f=1s,2s"],
}  # fmt: skip


@pytest.mark.parametrize("command", READERS)
def test_reading_a_large_problem_counts(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every piece looks at the clock here, as every thousandth does: what is small is read whole in any time."""
    monkeypatch.setattr(StepCounter, "EVERY", 1)
    verb, *options = command.split()
    with jumping(1000.0, monkeypatch) as looks:
        assert run([verb, "p.yaml", *options, *READERS[command], "--time-limit", "10000s"]) == 5
    assert looks[0] < 20
    assert "the time limit came while the problem was read: nothing was computed" in capsys.readouterr().err


def test_reading_counts_in_python_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StepCounter, "EVERY", 1)
    for verb in (dse.solve, dse.solve_robust):
        with jumping(1000.0, monkeypatch), pytest.raises(OutOfTime, match="while the problem was read"):
            verb("p.yaml", time_limit_s=10000.0)


def test_a_report_for_which_there_is_no_time_is_named(
    folder: Path, pump: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def slow(document: object) -> dict[str, str]:
        for _ in range(100):
            look_at_the_clock()
        raise AssertionError(document)

    monkeypatch.setattr("dse.report.output.report_files", slow)
    with jumping(1000.0, monkeypatch):
        assert run(["solve", "p.yaml", "--json", "out.json", "--report", "--time-limit", "10000s"]) == 5
    assert "no report: the time limit came first" in capsys.readouterr().err
    assert json.loads(Path("out.json").read_text(encoding="utf-8"))["status"] == "incomplete"
    assert not Path("reports").exists() or not list(Path("reports").iterdir())


def test_a_front_is_printed_without_reasons_where_there_is_no_time_for_them(
    folder: Path, pump: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The front was there in time; to find out why an alternative is there takes longer than what is left."""

    def slow(*given: object, **more: object) -> object:
        for _ in range(100):
            look_at_the_clock()
        raise AssertionError

    whole = dse.solve(Path(__file__).parents[1] / "fuzz" / "pump.yaml")
    document = Document(whole)
    print_front(document, None, TimeLimit(), explain=False)
    said = capsys.readouterr().out
    assert "Nearest limit" in said and "not computed" not in said
    monkeypatch.setattr("dse.answers.ranking.reasons.margins_of", slow)
    monkeypatch.setattr("dse.answers.ranking.reasons.analyse_design", slow)
    for explain in (False, True):
        with jumping(1000.0, monkeypatch):
            print_front(Document(whole), None, TimeLimit.after(10000.0), explain=explain)
        short = capsys.readouterr().out
        assert "Recommended  #1" in short and "Nearest limit not computed: the time limit came first" in short
        assert short.splitlines()[0] == said.splitlines()[0]


def test_a_search_that_could_not_begin_goes_on_later(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is known of its only region: no bound is stated, and a resumed search finds the whole front."""
    pump = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
    with jumping(1000.0, monkeypatch):
        assert run(["solve", str(pump), "-q", "--json", "out.json", "--time-limit", "10000s"]) == 5
    stopped = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert (stopped["status"], stopped["front"], stopped["unexplored"]) == ("incomplete", [], [{}])
    assert dse.verify("out.json").status == "verified"
    whole = dse.solve(pump)
    again = dse.resume("out.json")
    assert isinstance(again, dse.Result)
    assert [point.objectives for point in again.front] == [point.objectives for point in whole.front]
    assert dse.verify(again).status == "verified"


def test_a_stopped_search_that_goes_on_without_time_loses_nothing(
    folder: Path, pump: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever moment the limit comes at: the points that were there are there, or the file is as it was."""
    data = json.loads(pump.read_text(encoding="utf-8"))
    data = {**data, "status": "incomplete", "front": data["front"][:2], "refuted": [], "unexplored": [{}]}
    text = json.dumps(data)
    for looks in (2, 5, 20, 60, 200):
        Path("out.json").write_text(text, encoding="utf-8")
        with jumping(1.0, monkeypatch):
            code = run(["solve", "--resume", "out.json", "-q", "--json", "out.json", "--time-limit", f"{looks}s"])
        assert code in (0, 5), capsys.readouterr().err
        left = json.loads(Path("out.json").read_text(encoding="utf-8"))
        had = [point["objectives"] for point in data["front"]]
        assert all(point in [item["objectives"] for item in left["front"]] for point in had)


@pytest.mark.parametrize("looks", [3, 30, 100, 300])
def test_verify_says_how_far_it_came(looks: int, pump: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for method in ("exhaustion", "model"):
        with jumping(1000.0, monkeypatch) as looked:
            try:
                found = dse.verify(pump, method=method, time_limit_s=1000.0 * looks)
            except OutOfTime:  # not even the problem was read
                assert looks < 30
                continue
            assert looked[0] < looks + 1000
        if found.status == "unfinished":
            assert any("the time was too short" in text for text in found.left_open)
            assert found.exit_code == 5
        else:
            assert (found.status, looks) == ("verified", 300)
        assert not found.findings


def test_a_sweep_keeps_what_is_finished_and_goes_on(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    source = str(Path(__file__).parents[1] / "fuzz" / "pump.yaml")
    vary = ["sweep", source, "--vary", "jitter of sensor_to_valve=6ms,8ms,10ms,14ms", "--workers", "1", "-q"]
    with jumping(1.0, monkeypatch) as looks:
        assert run([*vary, "--json", "whole.json", "--no-store"]) == 0
    with jumping(1.0, monkeypatch):
        assert run([*vary, "--json", "some.json", "--store", "s.sqlite", "--time-limit", f"{looks[0] + 3}s"]) in (0, 5)
    with jumping(1.0, monkeypatch):
        assert run([*vary, "--json", "none.json", "--store", "t.sqlite", "--time-limit", "20s"]) == 5
    finished = [
        run_ for run_ in json.loads(Path("none.json").read_text(encoding="utf-8"))["runs"] if run_["status"] != "open"
    ]
    assert len(finished) < 4
    assert run([*vary, "--json", "again.json", "--store", "t.sqlite"]) == 0
    assert Path("again.json").read_text("utf-8") == Path("whole.json").read_text("utf-8")


def test_worker_processes_are_ended_too(folder: Path) -> None:
    """Two workers on runs that take very long: the limit is the parent's."""
    result = dse.sweep("p.yaml", "threads.t0.compute_execution_time=1 ms, 1.2 ms, 1.4 ms", workers=2, time_limit_s=0.5)
    assert result.exit_code in (0, 5)  # 0 on a machine that is fast enough


def test_sensitivity_names_what_it_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sooner the limit comes the more is left out, and it is named; with enough time nothing is."""
    pump = (Path(__file__).parents[1] / "fuzz" / "pump.yaml").read_text(encoding="utf-8")
    Path("u.yaml").write_text(f"{pump}{UNCERTAIN}", encoding="utf-8")
    left_out: list[tuple[str, ...]] = []
    for looks in (500, 1100, 10**9):
        with jumping(1.0, monkeypatch):
            found = dse.sensitivity("u.yaml", samples=50, time_limit_s=float(looks))
        left_out.append(found.left_out)
        assert found.exit_code == (5 if found.left_out else 0)
        assert ("left_out" in found.to_dict()) == bool(found.left_out)
    assert "margins of further inputs" in left_out[0]
    assert "uncertain inputs" in left_out[1]
    assert left_out[2] == ()


def test_a_limit_inside_another(monkeypatch: pytest.MonkeyPatch) -> None:
    assert in_force().seconds is None
    with until(TimeLimit.after(50.0)):
        assert 0 < in_force().left_s <= 50
        with until(TimeLimit.after(1000.0)):
            assert in_force().left_s <= 50
        with pytest.raises(OutOfTime), until(TimeLimit.after(-1.0)):
            look_at_the_clock()
    assert TimeLimit.after(100.0).for_the_last_steps().left_s > 104
    assert TimeLimit.after(1.0).for_the_last_steps().left_s > 1.4
    assert TimeLimit().for_the_last_steps() == TimeLimit()
    assert 96 < TimeLimit.after(100.0).sparing(3.0).left_s <= 97
    assert 2.9 < TimeLimit.after(4.0).sparing(3.0).left_s <= 3
    assert TimeLimit().sparing(3.0) == TimeLimit()
    assert (TimeLimit().rest_s, TimeLimit().left_s) == (None, float("inf"))
