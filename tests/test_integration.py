"""What a team's tools call: the hook of pre-commit, the comment on a pull request, the shell's completion."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PUMP = ROOT / "tests" / "fuzz" / "pump.yaml"
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}

pytestmark = pytest.mark.skipif(not (ROOT / "action.yml").is_file(), reason="these files are in a checkout only")


def called(*words: str | Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**ENVIRONMENT, **more}
    return subprocess.run([str(word) for word in words], env=environment, capture_output=True, text=True, check=False)


def test_the_hook_refuses_what_check_refuses(tmp_path: Path) -> None:
    [hook] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    entry = shlex.split(hook["entry"])
    bad = tmp_path / "bad.yaml"
    bad.write_text(PUMP.read_text(encoding="utf-8").replace("threads:", "threds:"), encoding="utf-8")
    assert called(*entry, PUMP).returncode == 0
    done = called(*entry, bad, PUMP)
    assert done.returncode == 1
    assert 'did you mean "threads"' in done.stderr and not done.stdout


def test_the_comment_says_what_changes(tmp_path: Path) -> None:
    after = tmp_path / "pump.yaml"
    after.write_text(PUMP.read_text(encoding="utf-8").replace("price: 60 EUR", "price: 70 EUR"), encoding="utf-8")
    done = called(ROOT / ".ci" / "comment", PUMP, after)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("<!-- dse: the front of pump.yaml -->")
    assert "Of 4 points of after.json: 2 are in before.json too, 2 are dominated there" in done.stdout
    assert "<details>" in done.stdout and "Pareto front, proved complete" in done.stdout
    assert str(tmp_path) not in done.stdout.partition("<details>")[0]


def test_the_comment_on_a_new_problem_and_on_a_broken_one(tmp_path: Path) -> None:
    assert "The problem is new." in called(ROOT / ".ci" / "comment", tmp_path / "none.yaml", PUMP).stdout
    bad = tmp_path / "bad.yaml"
    bad.write_text("dse: 1\n", encoding="utf-8")
    done = called(ROOT / ".ci" / "comment", PUMP, bad)
    assert done.returncode == 0
    assert "cannot be solved" in done.stdout and "name" in done.stdout


def test_the_action_calls_what_there_is() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    said = " ".join(step.get("run", "") for step in action["runs"]["steps"])
    assert ".ci/comment" in said
    assert os.access(ROOT / ".ci" / "comment", os.X_OK) and os.access(ROOT / ".ci" / "run", os.X_OK)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_as_documented(shell: str) -> None:
    documented = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert f"_DSE_COMPLETE={shell}_source dse" in documented
    done = called(
        "dse", COMP_WORDS="dse so", COMP_CWORD="1" if shell != "fish" else "so", _DSE_COMPLETE=f"{shell}_complete"
    )
    assert "solve" in done.stdout
