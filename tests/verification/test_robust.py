"""Robust results are proved again, and those that say something else are rejected; what is stopped stays robust."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Literal

import pytest
from click.testing import CliRunner

import dse
from dse.answers.robust import RobustResult
from dse.cli.main import cli, run
from dse.questions.problem import load
from dse.questions.robust.robust import solve_robust
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Unfinished
from dse.support.errors import UsageError
from tests.helpers.effort import LONG
from tests.questions.studies import written
from tests.verification.shared import copied, question_once, robustness_once

STATED = """
uncertainty:
  threads.filter.compute_execution_time: {factor: 0.7 .. 1.6}
  devices.sensor.compute_execution_time.max: {range: 1 us .. 3 ms}
"""
PROBLEM = """dse: 1
name: robust
processing: execution_time
processor_types: {cpu: {price: [10 EUR, 20 EUR]}, big: {cores: 2, price: [30 EUR, 60 EUR]}}
thread_types:
  quick: {compute_execution_time: {cpu: 1 ms, big: 0.5 ms}}
  steady: {compute_execution_time: {cpu: 1.5 ms, big: 1 ms}, price: 2 EUR}
processors: {p: {type: [cpu, big]}}
bus_types: {can: {transmission_time: {fixed: 100 us, per_byte: 30 us .. 40 us}}}
buses: {can0: {type: can}}
devices: {sensor: {period: 20 ms, compute_execution_time: 100 us .. 200 us}}
threads:
  a: {processor: p, period: [5 ms, 10 ms, 20 ms], type: [quick, steady]}
  b: {processor: p, period: [5 ms, 10 ms, 20 ms, 40 ms], compute_execution_time: {cpu: 2 ms .. 3 ms, big: 1 ms .. 2 ms}}
connections:
  in: {from: sensor, to: a, data_size: [8 B, 64 B], bus: can0}
  ab: {from: a, to: b}
flows: {f: {path: [sensor, a, b]}}
requirements: [latency of f <= 50 ms, utilisation of p <= 70 %]
objectives: [minimise latency of f, minimise price, minimise utilisation of p]
uncertainty:
  thread_types.quick.compute_execution_time: {factor: 0.9 .. 4}
  threads.b.compute_execution_time: {factor: 0.8 .. 1.2}
  bus_types.can.transmission_time.per_byte: {factor: 1 .. 2}
"""
Data = dict[str, Any]


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RobustResult]:
    file = tmp_path_factory.mktemp("robust") / "p.yaml"
    file.write_text(PROBLEM, encoding="utf-8")
    return file, solve_robust(file)


@pytest.fixture(scope="module")
def starter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robust result of a shipped problem that is not robust by itself."""
    folder = tmp_path_factory.mktemp("starter")
    out = folder / "r.json"
    out.write_text(solve_robust(load(written(folder, "starter", STATED))).to_json(), encoding="utf-8")
    return out


def data_of(result: RobustResult) -> Data:
    found: Data = json.loads(result.to_json())
    return found


@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_true_robust_results_are_accepted(
    method: Literal["exhaustion", "model"], solved: tuple[Path, RobustResult], starter: Path
) -> None:
    file, result = solved
    assert len(result.robust.front) > 3 and result.failures and result.entered
    found = dse.verify(result, problem=file, method=method)
    assert found.status == "verified", (found.findings, found.left_open)
    assert any("hold for all stated values of 3 inputs" in text for text in found.checked)
    assert run(["verify", str(starter), "--method", method]) == 0


def test_a_robust_result_is_opened_again(solved: tuple[Path, RobustResult], tmp_path: Path) -> None:
    """Both fronts, and why designs of the nominal one are not robust."""
    _, result = solved
    path = tmp_path / "r.json"
    path.write_text(result.to_json(), encoding="utf-8")
    again = dse.reopen_robust(path)
    assert result.failures and again.failures == result.failures
    assert again.to_json() == result.to_json()
    ours, theirs = again.nominal.to_dict(), result.nominal.to_dict()
    assert ours.pop("search") != theirs.pop("search") and ours == theirs  # the file has the effort of both together
    data = data_of(result)
    data["robust"]["nominal_front"][0]["objectives"]["price"] += 1
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(UsageError, match="has other figures than the result says"):
        dse.reopen_robust(path)
    path.write_text(result.nominal.to_json(), encoding="utf-8")
    with pytest.raises(UsageError, match="is no result of `dse solve --robust`"):
        dse.reopen_robust(path)


def _held(data: Data, place: tuple[str | int, ...]) -> Any:
    held: Any = data
    for part in place:
        held = held[part]
    return held


def _popped(place: tuple[str | int, ...], at: int, data: Data) -> None:
    _held(data, place).pop(at)


def _set(place: tuple[str | int, ...], key: str, value: object, data: Data) -> None:
    _held(data, place)[key] = value


def changed_parts(data: Data) -> Iterator[tuple[str, Callable[[Data], object]]]:
    """One thing changed in each; what each point and each number has is changed in one of them."""
    robust, lost = data["robust"], data["robust"]["lost"][: None if LONG else 1]
    yield "not robust", lambda d: d["problem"]["effective"].update(robust=False)
    yield "not robust, and no block", lambda d: (d["problem"]["effective"].update(robust=False), d.pop("robust"))
    yield "no block", lambda d: d.pop("robust")
    yield "another requirement", lambda d: d["problem"]["effective"]["requirements"].append("price <= 1000 EUR")
    for name in ("kept", "entered", "lost", "nominal_front"):
        yield f"{name} shortened", partial(_popped, ("robust", name), -1)
    for path in robust["inputs"]:
        yield f"{path} says otherwise", partial(_set, ("robust", "inputs"), path, "factor: 1 .. 1")
    for name in list(robust["price"])[: None if LONG else 1]:
        for which in ("nominal", "robust"):
            yield f"{which} {name}", partial(_set, ("robust", "price", name), which, 1)
    for at in range(len(lost)):
        yield f"lost[{at}]", partial(_set, ("robust", "lost", at), "worst", 1)
    for at in range(len(data["front"]) if LONG else 1):
        yield f"front[{at}] missing", partial(_popped, ("front",), at)
    yield "a refuted region missing", lambda d: d["refuted"].pop()
    yield "a nominal region missing", lambda d: d["robust"]["nominal"]["refuted"].pop()
    yield (
        "a nominal region widened",
        lambda d: d["robust"]["nominal"]["refuted"][-1].update({info["name"]: 10**12 for info in d["objectives"]}),
    )
    yield "nominal status", lambda d: d["robust"]["nominal"].update(status="incomplete")
    yield "the nominal front", lambda d: d.update(front=copied(d)["robust"]["nominal_front"])


def test_robust_results_with_one_thing_changed_are_rejected(
    solved: tuple[Path, RobustResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, result = solved
    question_once(monkeypatch)
    robustness_once(monkeypatch)
    data = data_of(result)
    accepted = []
    for name, change in changed_parts(data):
        mutated = copied(data)
        change(mutated)
        assert mutated != data, name
        if dse.verify(mutated, problem=file).status != "rejected":
            accepted.append(name)
    assert not accepted


def test_a_design_that_breaks_somewhere_in_the_ranges_is_named(solved: tuple[Path, RobustResult]) -> None:
    file, result = solved
    data = data_of(result)
    lost = {item["nominal_id"] for item in data["robust"]["lost"]}
    data["front"].append(next(point for point in data["robust"]["nominal_front"] if point["id"] in lost))
    found = dse.verify(data, problem=file)
    assert any("for some stated values" in item.text for item in found.findings)


def stopped(after: int, monkeypatch: pytest.MonkeyPatch, file: Path, *options: str) -> Data:
    """What `dse solve --json` left when the solver had no answer any more."""
    asked: list[bool] = []
    minimise = Strategy.minimise

    def failing(self: Strategy, *arguments: Any, **more: Any) -> Answer:
        asked.append(True)
        return Unfinished() if len(asked) > after else minimise(self, *arguments, **more)

    out = file.parent / "stopped.json"
    with monkeypatch.context() as patch:
        patch.setattr(Strategy, "minimise", failing)
        assert run(["solve", str(file), "-q", "--workers", "1", "--json", str(out), *options]) in (0, 5)
    found: Data = json.loads(out.read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("after", [0, 1, 5, 14, 22] if LONG else [0, 14, 22])
def test_a_stopped_robust_search_goes_on_as_one(
    after: int, solved: tuple[Path, RobustResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the nominal front or behind it: what is stated is verified, and it ends where an undisturbed one does."""
    file, whole = solved
    data = stopped(after, monkeypatch, file, "--robust")
    assert data["problem"]["effective"]["robust"] is True
    assert dse.verify(data, problem=file).status == "verified"
    out, again = tmp_path / "r.json", tmp_path / "again.json"
    out.write_text(json.dumps(data), encoding="utf-8")
    for more in ([], ["--robust"]) if after == 14 or LONG else ([],):
        assert run(["solve", "--resume", str(out), "-q", "--json", str(again), *more]) == 0
        found = json.loads(again.read_text(encoding="utf-8"))
        for part in (found, expected := data_of(whole)):
            part.pop("search")
            part["robust"].pop("corners")
        assert found == expected


def test_what_does_not_belong_together_is_refused(
    solved: tuple[Path, RobustResult],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Another question than the regions were refuted under, in whatever part."""
    file, _ = solved
    robust = stopped(20, monkeypatch, file, "--robust", "--fix", "in.data_size=8B")
    nominal = stopped(3, monkeypatch, file, "--max-latency", "50ms")
    out = tmp_path / "r.json"
    edits: list[tuple[Data, dict[str, Any]]] = [
        (robust, {"robust": False}),
        (nominal, {"robust": True}),
        (nominal, {"requirements": nominal["problem"]["effective"]["requirements"][:-1]}),
        (nominal, {"processing": "response_time"}),
        (nominal, {"deadlines": "all"}),
        (nominal, {"profile": "osate-2.19"}),
        (nominal, {"fixed": {"in.data_size": "8 B"}}),
        (robust, {"fixed": {}}),
        (nominal, {"rules": ["require 'in'.data_size == 8 B"]}),
        (nominal, {"objectives": nominal["problem"]["effective"]["objectives"][::-1]}),
    ]
    for data, edit in edits:
        edited = copied(data)
        edited["problem"]["effective"].update(edit)
        out.write_text(json.dumps(edited), encoding="utf-8")
        with pytest.raises(UsageError, match=r"do not belong together|is not a whole result: (robust|objectives): "):
            dse.resume(out, problem=file)
        assert dse.verify(edited, problem=file).status == "rejected"
    older = {**nominal, "semantics": 99}
    out.write_text(json.dumps(older), encoding="utf-8")
    with pytest.raises(UsageError, match=r"semantics 99, here \d"):
        dse.resume(out, problem=file)
    wider = tmp_path / "wider.yaml"
    wider.write_text(PROBLEM.replace("0.8 .. 1.2", "0.8 .. 1.3"), encoding="utf-8")
    out.write_text(json.dumps(robust), encoding="utf-8")
    with pytest.raises(UsageError, match="has changed since"):
        dse.resume(out, problem=wider)
    out.write_text(json.dumps(nominal), encoding="utf-8")
    assert run(["solve", "--resume", str(out), "--robust"]) == 2
    assert "its search is not robust" in capsys.readouterr().err


def test_a_robust_search_that_is_killed_leaves_a_robust_state(tmp_path: Path) -> None:
    """The states that it writes while it runs are of the robust question, whole, and go on to the same front."""
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    periods = ", ".join(f"{number} ms" for number in range(5, 25, 2))
    large = PROBLEM.replace("[5 ms, 10 ms, 20 ms, 40 ms]", f"[{periods}]").replace(
        "[5 ms, 10 ms, 20 ms]", f"[{periods}]"
    )
    file.write_text(large, encoding="utf-8")
    program = "from dse.search import workers; workers.CHECKPOINT_S, workers.SHARE = 0, 1; "
    program += "from dse.cli.entry import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, "solve", str(file), "--robust", "-q", "--json", str(out)]
    )
    while process.poll() is None and not (out.exists() and json.loads(out.read_text(encoding="utf-8"))["front"]):
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    data = json.loads(out.read_text(encoding="utf-8"))
    assert data["problem"]["effective"]["robust"] is True
    found = dse.resume(out)
    assert isinstance(found, RobustResult)
    expected = solve_robust(file)
    assert [point.objectives for point in found.robust.front] == [point.objectives for point in expected.robust.front]


def test_time_is_one_limit_for_all_of_it(solved: tuple[Path, RobustResult]) -> None:
    file, whole = solved
    started = time.monotonic()
    found = solve_robust(file, time_limit_s=0.05)
    assert time.monotonic() - started < 5
    assert found.robust.status in ("incomplete", "complete")
    vectors = [point.objectives for point in whole.robust.front]
    assert all(point.objectives in vectors for point in found.robust.front)
    assert dse.verify(found, problem=file).status == "verified"


def test_a_robust_result_says_so_on_every_page(solved: tuple[Path, RobustResult]) -> None:
    file, _ = solved
    shown = CliRunner().invoke(cli, ["solve", str(file), "--robust"], env={"COLUMNS": "200"}).output
    assert "Robust: requirements hold for all stated values." in shown
    assert "Robust: requirements" not in CliRunner().invoke(cli, ["solve", str(file)], env={"COLUMNS": "200"}).output


def test_nothing_uncertain_is_no_robust_question() -> None:
    with pytest.raises(UsageError, match="states no uncertainty"):
        solve_robust(PROBLEM.partition("uncertainty:")[0])
