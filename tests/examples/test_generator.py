"""Random problems are valid, feasible by construction, bound by their limits, and the same for the same seed."""

from __future__ import annotations

import hashlib
import json
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluation, Evaluator
from dse.cli.main import run
from dse.examples.random import FAMILIES, random_problem
from dse.examples.random.published import ANGLE_SYNCHRONOUS, RUNNABLES
from dse.questions.problem import Problem, loads
from dse.questions.verbs.check import check
from dse.support.errors import EXIT_USAGE, UsageError
from tests.helpers.effort import LONG

SIZES = (5, 12, 30)
GOLDEN = "634505d9"


def start(problem: Problem) -> Evaluation:
    space = problem.space
    return Evaluator(space).evaluate(tuple(space.baseline.get(index, 0) for index in range(len(space.decisions))))


@pytest.mark.parametrize("threads", SIZES)
@pytest.mark.parametrize("family", FAMILIES)
def test_the_starting_design_is_feasible_and_the_limits_bind(family: str, threads: int) -> None:
    for seed in (1, 2, 3) if LONG else (1,):
        problem = loads(random_problem(threads, seed, 3, family)).ask(processing="execution_time")
        evaluation = start(problem)
        assert evaluation.is_feasible, evaluation
        slack = [item.slack / item.limit for item in evaluation.verdicts if item.requirement.metric.kind == "jitter"]
        assert min(slack) < Fraction(1, 3)
        assert len(problem.space.components) >= threads


@pytest.mark.parametrize("family", FAMILIES)
def test_every_problem_has_what_real_ones_have(family: str) -> None:
    problem = loads(random_problem(30, 1, 5, family))
    space = problem.space
    assert len(space.objectives) == 5
    periods = [len(item.options) for item in space.decisions if item.field == "period" and item.is_open]
    assert set(periods) <= {4, 5, 6}
    assert any(set(item.options) == {"periodic", "aperiodic"} for item in space.decisions)
    types = [item for item in space.decisions if item.field == "type"]
    assert types
    assert all(2 <= len(item.options) <= 4 for item in types if item.component != "middleware")
    hops = [sum(step.kind == "component" for step in flow.steps) - 1 for flow in space.flows]
    assert set(hops) <= set(range(4, 9))
    paths = [{step.index for step in flow.steps if step.kind == "component"} for flow in space.flows]
    assert any(one & other for index, one in enumerate(paths) for other in paths[index + 1 :])
    known = ("may be busier than its load says", "but every design has it and its price", "treated as unsynchronised")
    assert all(any(words in text for words in known) for text in check(problem).remarks)


def test_families_differ_in_what_is_open() -> None:
    fields = {
        family: {item.field for item in loads(random_problem(12, 1, 2, family)).space.decisions if item.is_open}
        for family in FAMILIES
    }
    assert "processor" in fields["two-computers"]
    assert "bus" in fields["many-buses"]
    assert "processor" not in fields["robot"]


def test_same_arguments_same_bytes_and_every_argument_matters() -> None:
    text = random_problem(12, 1, 2, "automotive")
    assert text == random_problem(12, 1, 2, "automotive")
    assert len({text, random_problem(13, 1, 2, "automotive"), random_problem(12, 2, 2, "automotive")}) == 3
    assert len({text, random_problem(12, 1, 3, "automotive"), random_problem(12, 1, 2, "robot")}) == 3


def test_the_bytes_do_not_change_between_versions_unnoticed() -> None:
    digest = hashlib.sha256("".join(random_problem(12, 1, 5, family) for family in FAMILIES).encode()).hexdigest()
    assert digest[:8] == GOLDEN, "published benchmark seeds now mean other problems: say so in the changelog"


def test_shares_of_periods_are_those_of_the_paper() -> None:
    assert sum(item.share for item in (*RUNNABLES, ANGLE_SYNCHRONOUS)) == 100
    for item in (*RUNNABLES, ANGLE_SYNCHRONOUS):
        assert item.least_ns <= item.mean_ns <= item.most_ns
        assert item.best[0] < item.best[1] <= 100 <= item.worst[0] < item.worst[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((4, 1, 2, "robot"), "threads: expected a whole number from 5 to 5,000; got 4"),
        ((5_001, 1, 2, "robot"), "threads: expected a whole number from 5 to 5,000; got 5001"),
        ((9, 1, 6, "robot"), "objectives: expected a whole number from 1 to 5; got 6"),
        ((9, 1, 0, "robot"), "objectives: expected a whole number from 1 to 5; got 0"),
        (
            (9, 1, 2, "robots"),
            "automotive; got 'robots' (did you mean \"robot\"?)",
        ),
    ],
)
def test_arguments_out_of_range(arguments: tuple[int, int, int, str], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        random_problem(*arguments)
    assert message in str(caught.value)


MODELINE = "# yaml-language-server: $schema=dse-problem.schema.json"
"""What makes an editor look for the schema."""


def test_the_command_writes_what_the_function_gives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.yaml"
    arguments = ["new", str(file), "--random", "--threads", "8", "--seed", "3", "--family", "event-driven"]
    assert run(arguments) == 0
    assert file.read_text(encoding="utf-8") == f"{MODELINE}\n{random_problem(8, 3, 2, 'event-driven')}"
    named = json.loads((tmp_path / MODELINE.partition("=")[2]).read_text(encoding="utf-8"))
    assert named == dse.schema()
    assert "dse solve" in capsys.readouterr().out
    assert run(arguments) == EXIT_USAGE
    assert run([*arguments, "--force", "--objectives", "3"]) == 0
    assert file.read_text(encoding="utf-8") == f"{MODELINE}\n{random_problem(8, 3, 3, 'event-driven')}"


def test_a_file_that_is_no_schema_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "dse-problem.schema.json").write_text("mine", encoding="utf-8")
    assert run(["new", str(tmp_path / "p.yaml")]) == EXIT_USAGE
    assert "no schema of dse" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["dse-problem.schema.json"]


def test_what_goes_to_standard_output_names_no_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["new", "-", "--random", "--threads", "8", "--seed", "3"]) == 0
    assert capsys.readouterr().out == random_problem(8, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--threads", "8"], "--threads needs --random"),
        (["--random", "--example", "inmark"], "exclude each other"),
        (["--random", "--threads", "2"], "from 5 to 5,000; got 2"),
        (["--random", "--family", "submarine"], "many-buses"),
    ],
)
def test_wrong_usage(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["new", str(tmp_path / "x.yaml"), *arguments]) == EXIT_USAGE
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
