"""Options that make the question: their order, and what is said of mistakes in them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dse.cli.main import run

TEXT = """
dse: 1
name: question
processor_types: {small: {price: 10 EUR, power: 9 W}, large: {price: 20 EUR, power: 5 W}}
processors: {computer: {type: [small, large]}}
threads: {t: {processor: computer, period: [10 ms, 20 ms], compute_execution_time: 1 ms}}
requirements: [utilisation of computer <= 100 %]
objectives: [minimise price]
"""


@pytest.fixture
def path(tmp_path: Path) -> str:
    (tmp_path / "question.yaml").write_text(TEXT)
    return str(tmp_path / "question.yaml")


@pytest.mark.parametrize(
    ("options", "order"),
    [
        (["--maximise", "price", "--minimise", "power"], ["maximise price", "minimise power"]),
        (["--minimise=power", "--maximize=price"], ["minimise power", "maximise price"]),
        (["--maximise", "price", "--minimize", "power", "--maximise", "utilisation"],
         ["maximise price", "minimise power", "maximise utilisation of computer"]),
        ([], ["minimise price"]),
    ],
)  # fmt: skip
def test_objectives_keep_the_order_in_which_they_are_given(
    path: str, options: list[str], order: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["solve", path, *options, "-q", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [f"{item['sense']} {item['name']}" for item in found["objectives"]] == order


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("utilizaton of computer <= 30 %", 'unknown metric "utilizaton" (did you mean "utilisation"?)'),
        ("utilsation <= 30 %", 'unknown metric "utilsation" (did you mean "utilisation"?)'),
        ("forbid prise <= 30 EUR", 'unknown metric "prise" (did you mean "price"?)'),
        ("t.perod == 10 ms", 'unknown name "t.perod" in a rule (did you mean "t.period"?)'),
        ("small requires lage", 'unknown name "lage" in a rule (did you mean "large"?)'),
    ],
)
def test_a_misspelt_requirement_is_no_rule(path: str, text: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", path, "--require", text]) == 2
    assert said in capsys.readouterr().err
