"""What a team's tools call: the hook of pre-commit, the comment on a pull request, the shell's completion."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from dse.report.content.compare import IN_BOTH
from tests.helpers.effort import LONG

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
    assert done.stdout.startswith(f"<!-- dse: the front of {after} -->\n### What changes on the front of `pump.yaml`")
    assert "Of 4 points of after.json: 2 are in before.json too, 2 are dominated there" in done.stdout
    assert "<details>" in done.stdout and "Pareto front, proved complete" in done.stdout
    assert str(tmp_path) not in done.stdout.partition("-->")[2].partition("<details>")[0]


def test_the_comment_on_a_new_problem_and_on_a_broken_one(tmp_path: Path) -> None:
    if LONG:
        assert "The problem is new." in called(ROOT / ".ci" / "comment", tmp_path / "none.yaml", PUMP).stdout
    bad = tmp_path / "bad.yaml"
    bad.write_text("dse: 1\n", encoding="utf-8")
    done = called(ROOT / ".ci" / "comment", PUMP, bad)
    assert done.returncode == 0
    assert "cannot be solved" in done.stdout and "name" in done.stdout


def test_the_action_calls_what_there_is() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    said = " ".join(step.get("run", "") for step in action["runs"]["steps"])
    assert ".ci/pull-request" in said
    assert all(os.access(ROOT / ".ci" / name, os.X_OK) for name in ("comment", "pull-request", "run"))


def test_the_workflow_may_do_little_and_runs_what_is_known() -> None:
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    assert workflow["permissions"] == {"contents": "read"}
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    steps = [step for job in workflow["jobs"].values() for step in job["steps"]] + action["runs"]["steps"]
    used = [step["uses"] for step in steps if "uses" in step]
    assert len(used) == 3
    assert all(re.fullmatch(r"actions/[a-z-]+@[0-9a-f]{40}", item) for item in used), "by commit: a tag can be moved"
    [hook] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    assert "--time-limit" in hook["entry"]


GH = """#!/bin/sh
echo "$@" >> "$CALLS"
case "$*" in
*--paginate*) [ -z "$KNOWN" ] || echo "$KNOWN" ;;
*) [ -z "$REFUSED" ] || exit 1; for word; do case "$word" in body=@*) cat "${word#body=@}" > "$WRITTEN" ;; esac; done ;;
esac
"""

DSE = f"""#!/bin/sh
case "$1" in
compare)
    echo "changed: $(cat pump.yaml) was $(cat "$RUNNER_TEMP"/base-*/pump.yaml)"
    echo "{IN_BOTH} before.json and after.json"
    echo "all the others" ;;
report) echo all > "$4/front.md" ;;
esac
"""
"""Quick: what it says is not what is looked at here."""


def test_the_action_writes_one_comment_for_each_file(tmp_path: Path) -> None:
    """In a clone that knows the last commit only, with a `gh` that notes what it is called with."""
    upstream, clone, tools = (tmp_path / name for name in ("upstream", "clone", "tools"))
    tools.mkdir()
    for name, script in (("gh", GH), ("dse", DSE)):
        (tools / name).write_text(script, encoding="utf-8")
        (tools / name).chmod(0o755)
    git = ["git", "-C", str(upstream), "-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    called("git", "init", "-q", upstream)
    called(*git, "config", "uploadpack.allowAnySHA1InWant", "true")
    for price in ("60 EUR", "70 EUR"):
        (upstream / "pump.yaml").write_text(price, encoding="utf-8")
        called(*git, "add", ".")
        called(*git, "commit", "-qm", price)
    called("git", "clone", "-q", "--depth=1", upstream.as_uri(), clone)
    base = called(*git, "rev-parse", "HEAD~1").stdout.strip()
    names = {"PROBLEM": "pump.yaml", "LIMIT": "1min", "BASE": base, "NUMBER": "7", "GITHUB_REPOSITORY": "we/robot"}
    for more, verb in (
        ({}, "POST repos/we/robot/issues/7/comments"),
        ({"KNOWN": "42"}, "PATCH"),
        ({"REFUSED": "1"}, ""),
    ):
        files = {name: str(tmp_path / name) for name in ("CALLS", "WRITTEN", "GITHUB_STEP_SUMMARY")}
        path = f"{tools}{os.pathsep}{ENVIRONMENT['PATH']}"
        done = subprocess.run(
            [ROOT / ".ci" / "pull-request"],
            cwd=clone,
            env={
                **ENVIRONMENT,
                **names,
                **files,
                "KNOWN": "",
                "REFUSED": "",
                **more,
                "PATH": path,
                "RUNNER_TEMP": str(tmp_path),
            },
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert ("::warning::" in done.stdout) == ("REFUSED" in more)
        assert verb in (tmp_path / "CALLS").read_text(encoding="utf-8").splitlines()[-1]
        written = (tmp_path / "WRITTEN").read_text(encoding="utf-8")
        assert written.startswith("<!-- dse: the front of pump.yaml -->\n")
        assert "changed: 70 EUR was 60 EUR" in written and "all the others" not in written
        assert "<summary>" in written
        assert written in (tmp_path / "GITHUB_STEP_SUMMARY").read_text(encoding="utf-8")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_as_documented(shell: str) -> None:
    documented = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert f"_DSE_COMPLETE={shell}_source dse" in documented
    done = called(
        "dse", COMP_WORDS="dse so", COMP_CWORD="1" if shell != "fish" else "so", _DSE_COMPLETE=f"{shell}_complete"
    )
    assert "solve" in done.stdout
