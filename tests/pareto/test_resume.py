"""A stopped search keeps its worth: what it wrote is readable at any moment, and goes on to the same front."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from support import PROBLEMS

import dse
from dse.errors import UsageError
from dse.pareto.answer import Answer, Unfinished
from dse.pareto.settings import Settings
from dse.pareto.subproblem import Solver

BY_NAME = {path.stem: path for path in PROBLEMS}
INMARK = Path(__file__).parents[2] / "problems" / "inmark.yaml"
KILLS = int(os.environ.get("DSE_KILLS", "3"))
OBJECTIVES = ["jitter of gnss_to_sprayer", "price", "utilisation of computer", "power", "load of canbus0"]


def comparable(text: str) -> dict[str, Any]:
    """A result without what tells of the run itself."""
    data: dict[str, Any] = json.loads(text)
    data.pop("search")
    return data


@pytest.mark.parametrize("name", ["types", "protocols", "bindings"])
def test_a_search_stopped_at_any_call_goes_on_to_the_same_front(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = dse.solve(BY_NAME[name], workers=1)
    solve = Solver._solve_whole
    for stop in range(1, 8):
        asked: list[bool] = []

        def failing(self: Solver, configure: Settings, asked: list[bool] = asked, stop: int = stop) -> Answer:
            asked.append(True)
            return Unfinished() if len(asked) >= stop else solve(self, configure)

        monkeypatch.setattr(Solver, "_solve_whole", failing)
        stopped = dse.solve(BY_NAME[name], workers=1)
        monkeypatch.setattr(Solver, "_solve_whole", solve)
        if stopped.status == "complete":
            break
        assert stopped.status == "incomplete"
        assert stopped.unexplored
        assert set(stopped.potential) == {item.name for item in stopped.objectives}
        path = tmp_path / "stopped.json"
        path.write_text(stopped.to_json(), encoding="utf-8")
        assert comparable(dse.resume(path).to_json()) == comparable(expected.to_json())


def test_potential_bounds_what_is_still_to_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """No point of the whole front is better, in any objective, than what the stopped search says is still possible."""
    whole = dse.solve(INMARK, workers=1)
    solve, asked = Solver._solve_whole, []

    def failing(self: Solver, configure: Settings) -> Answer:
        asked.append(True)
        return Unfinished() if len(asked) > 6 else solve(self, configure)

    monkeypatch.setattr(Solver, "_solve_whole", failing)
    stopped = dse.solve(INMARK, workers=1)
    found = {tuple(point.objectives.values()) for point in stopped.front}
    for point in whole.front:
        if tuple(point.objectives.values()) not in found:
            assert all(point.objectives[name] >= bound for name, bound in stopped.potential.items())


def test_a_changed_problem_is_not_resumed(tmp_path: Path) -> None:
    problem = tmp_path / "starter.yaml"
    problem.write_text((INMARK.parent / "starter.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / "result.json"
    path.write_text(dse.solve(problem).to_json(), encoding="utf-8")
    problem.write_text(problem.read_text(encoding="utf-8").replace("60 EUR", "61 EUR"), encoding="utf-8")
    with pytest.raises(UsageError, match="has changed since"):
        dse.resume(path)


def test_a_killed_search_leaves_a_whole_state_that_goes_on_to_the_same_front(tmp_path: Path) -> None:
    """Killed with SIGKILL at random moments; `DSE_KILLS` says how often."""
    expected = comparable(dse.solve(INMARK, minimise=OBJECTIVES).to_json())
    path = tmp_path / "result.json"
    command = [sys.executable, "-c", "from dse.cli.main import main; main()", "solve", str(INMARK), "-q"]
    command += [word for objective in OBJECTIVES for word in ("--minimise", objective)]
    moments = random.Random(1)
    for _ in range(KILLS):
        path.unlink(missing_ok=True)
        process = subprocess.Popen([*command, "--json", str(path)])
        while not path.exists() and process.poll() is None:
            time.sleep(0.01)
        time.sleep(moments.uniform(0, 1))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert json.loads(path.read_text(encoding="utf-8"))["status"] in ("incomplete", "complete")
        assert comparable(dse.resume(path).to_json()) == expected
