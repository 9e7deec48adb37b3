"""Sweeps: values, order, what is won and lost; kills, and workers that die."""

from __future__ import annotations

import csv
import io
import json
import os
import random
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from dse.answers.studies.sweep import SweepRun
from dse.cli.main import run as called
from dse.questions.sweep.fronts import front_outcome
from dse.questions.sweep.store import Store
from dse.questions.sweep.sweep import SweepProgress, sweep
from dse.questions.sweep.workers import LostRunError, run_all
from tests.questions.studies import LONG, edited, example, written
from tests.questions.sweep.tasks import always_dies, dies_once, doubled, fails

RUN = "from dse.cli.entry import main; main()"
RUNS, KILLS = (200, 5) if LONG else (16, 1)


def first_path(name: str, end: str) -> str:
    from dse.questions.sweep.inputs_of_file import Inputs, merged_data

    return next(path for path in Inputs(merged_data(example(name))).groups if path.endswith(end))


def unranked(run: SweepRun) -> dict[str, Any]:
    """An outcome as it was found, before the sweep ranked its fronts together."""
    assert run.outcome is not None
    names = [info["name"] for info in run.outcome["objectives"]]
    front = [{key: value for key, value in item.items() if key not in ("rank", "score")} for item in run.front]
    front.sort(key=lambda item: [Fraction(item["metrics"][name]) for name in names])
    return {**run.outcome, "front": front}


def test_each_value_is_the_front_of_the_edited_file() -> None:
    problem = example("starter")
    path = first_path("starter", ".bandwidth")
    result = sweep(problem, f"{path}=100kbit/s..500kbit/s step 200kbit/s")
    assert [run.values for run in result.runs] == [("100 kbit/s",), ("300 kbit/s",), ("500 kbit/s",)]
    for run in result.runs:
        outcome = front_outcome(edited(problem, **{path: run.values[0]}).space, 0)
        assert unranked(run) == json.loads(json.dumps(outcome))


def test_a_factor_scales_everything_below_its_path() -> None:
    problem = example("starter")
    path = first_path("starter", ".compute_execution_time")
    one = sweep(problem, f"{path}=*1")
    assert unranked(one.runs[0]) == json.loads(json.dumps(front_outcome(problem.space, 0)))
    assert sweep(problem, f"{path}=*3").runs[0].outcome != one.runs[0].outcome


def test_the_grid_is_the_product_the_last_axis_fastest() -> None:
    problem = example("starter")
    prices, bandwidth = first_path("starter", ".price"), first_path("starter", ".bandwidth")
    result = sweep(
        problem, [f"{prices}=10 EUR,200 EUR", f"{bandwidth}=*0.5,1", "jitter of sensor_to_actuator=9ms,20ms"]
    )
    assert len(result.runs) == 8 and result.runs[1].values == ("10 EUR", "*0.5", "20ms")
    assert [change is None for change in result.changes] == [True, False] * 4
    loosened = result.changes[1]
    assert loosened is not None and not any(
        after is not None and before is not None and after > before for before, after in loosened.best.values()
    )
    rows = list(csv.DictReader(io.StringIO(result.to_csv())))
    assert len(rows) == len(result.frame()) == sum(max(1, len(run.front)) for run in result.runs)


def test_an_interval_for_each_value_of_a_grid() -> None:
    problem = example("starter")
    result = sweep(
        problem, [f"{first_path('starter', '.price')}=10 EUR,900 EUR", "jitter of sensor_to_actuator=1ms..50ms"]
    )
    assert [run.outcome and run.outcome["kind"] for run in result.runs] == ["breaks", "breaks"]
    assert result.runs[0].outcome != result.runs[1].outcome
    assert {"from", "to"} <= set(result.columns)


def test_progress_and_estimate() -> None:
    seen: list[SweepProgress] = []
    sweep(example("starter"), f"{first_path('starter', '.price')}=1 EUR,2 EUR,3 EUR", progress=seen.append)
    assert [item.done for item in seen] == [1, 2, 3] and seen[0].left_s is not None and seen[-1].left_s == 0


def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    def interrupt(progress: SweepProgress) -> None:
        if progress.done == 2:
            raise KeyboardInterrupt

    vary = f"{first_path('starter', '.price')}=1 EUR,2 EUR,3 EUR"
    stopped = sweep(example("starter"), vary, store=tmp_path / "s", progress=interrupt)
    assert [run.status for run in stopped.runs] == ["complete", "complete", "open"] and stopped.exit_code == 5
    resumed = sweep(example("starter"), vary, store=tmp_path / "s")
    assert (resumed.solved, resumed.found, resumed.exit_code) == (1, 2, 0)


def interrupts(payload: str) -> str:
    """Like a search: takes the signal for itself, and says nothing of it."""
    before = signal.signal(signal.SIGINT, lambda *_: None)
    os.kill(os.getpid(), signal.SIGINT)
    signal.signal(signal.SIGINT, before)
    return payload


def test_ctrl_c_while_a_run_is_solved_here_is_not_lost() -> None:
    outcomes = run_all(interrupts, ["a", "b"], 1)
    with pytest.raises(KeyboardInterrupt):
        next(outcomes)


def test_a_sweep_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    """Kill -9 of the whole process tree at random moments: the same bytes, and no run solved twice."""
    file = written(tmp_path, "starter")
    vary = f"{first_path('starter', '.price')}=1 EUR..{RUNS} EUR step 1 EUR"

    def command(name: str) -> list[str]:
        options = ["--store", str(tmp_path / f"{name}.sqlite"), "--json", str(tmp_path / f"{name}.json"), "-q"]
        return [sys.executable, "-c", RUN, "sweep", str(file), "--vary", vary, "--workers", "2", *options]

    assert called([*command("whole")[3:], "--workers", "1"]) == 0
    source = random.Random(7)
    killed, pause, left = 0, 0.3, 10
    while killed < KILLS and left:
        left -= 1
        process = subprocess.Popen(command("killed"), start_new_session=True)
        goal = source.randint(1, max(1, RUNS // (KILLS + 2))) + solved(tmp_path / "killed.sqlite")
        while process.poll() is None and solved(tmp_path / "killed.sqlite") < goal:
            time.sleep(0.02)
        time.sleep(source.random() * pause)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            killed += 1
        process.wait()
        assert killed or (tmp_path / "killed.json").exists()
        if (tmp_path / "killed.json").exists():
            if killed:
                break
            pause = 0.0  # it was over before: from the start, and at once
            for path in tmp_path.glob("killed.*"):
                path.unlink()
    assert killed >= 1
    assert called([*command("killed")[3:], "--workers", "1"]) == 0
    assert (tmp_path / "killed.json").read_bytes() == (tmp_path / "whole.json").read_bytes()
    with Store(tmp_path / "killed.sqlite") as store:
        assert store.solved() == store.kept() == RUNS


def solved(path: Path) -> int:
    if not path.exists():
        return 0
    try:
        with Store(path) as store:
            return store.solved()
    except Exception:  # noqa: BLE001 (the file is being made)
        return 0


# --- workers ------------------------------------------------------------------------------------------------------


def test_workers_give_the_same_as_this_process() -> None:
    payloads = [str(number) for number in range(7)]
    assert dict(run_all(doubled, payloads, 2)) == dict(run_all(doubled, payloads, 1))


def test_a_dead_worker_costs_its_run_only(tmp_path: Path) -> None:
    payloads = [f"{tmp_path / 'mark'}:{number}{'!' if number == 2 else '?'}" for number in range(6)]
    found = dict(run_all(dies_once, payloads, 2))
    assert found == {number: "!" if number == 2 else "?" for number in range(6)} and (tmp_path / "mark").exists()


def test_a_run_that_takes_every_worker_with_it_is_given_up() -> None:
    with pytest.raises(LostRunError, match="run 4 has cost 3"):
        list(run_all(always_dies, [str(number) for number in range(6)], 2))


def test_an_error_in_a_worker_is_raised_here() -> None:
    with pytest.raises(ValueError, match="b"):
        list(run_all(fails, ["b", "b"], 2))


def test_exact_fractions_survive_the_way_through_text() -> None:
    result = sweep(example("inmark_chapter2"), "utilisation of computer=1%..70%")
    assert all(Fraction(item["from"]) >= 0 for run in result.runs if run.outcome for item in run.outcome["stretches"])
