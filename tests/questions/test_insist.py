"""The price of insisting: a result with every option's front, written, read again, verified, and shown."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.cli.main import run
from dse.report.content.front.filters import costly, prices, summary_words
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO, EXIT_USAGE

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"


@pytest.fixture(scope="module")
def result() -> dse.Result:
    return dse.insist(dse.solve(PUMP))


@pytest.fixture
def file(result: dse.Result, tmp_path: Path) -> Path:
    path = tmp_path / "r.json"
    path.write_text(result.to_json(), encoding="utf-8")
    return path


def test_each_options_front_is_that_of_fix(result: dse.Result) -> None:
    assert result.insisting is not None
    listed: list[Any] = [*result.front, *result.insisting.points]
    vectors = {point.id: (point.objectives, point.decisions) for point in listed}
    for item in result.insisting.options:
        fixed = dse.solve(PUMP, fix=[f"{item.decision} = {item.option}"])
        expected = [(point.objectives, point.decisions) for point in fixed.front]
        found = [vectors[number] for number in item.front]
        assert all(one in expected for one in found) and len(found) == len(expected), item
        assert item.status == fixed.status


def test_it_is_the_same_on_several_cores(result: dse.Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dse.questions.verbs.insist.ALONE_S", 0.0)
    assert dse.insist(dse.solve(PUMP), workers=2).insisting == result.insisting


def test_it_is_read_again_and_verified(result: dse.Result, file: Path) -> None:
    assert dse.reopen(file).insisting == result.insisting
    for method in ("exhaustion", "model"):
        found = dse.verify(file, method=method)
        assert found.status == "verified", found.findings
        assert any("with each of 12 options" in text for text in found.checked)


def drop_a_point(insisting: Any) -> None:
    next(item for item in insisting["options"] if len(item["front"]) > 1)["front"].pop()


def swap_options(insisting: Any) -> None:
    insisting["options"].reverse()


def change_a_figure(insisting: Any) -> None:
    insisting["points"][0]["objectives"]["price"] -= 1


def call_it_impossible(insisting: Any) -> None:
    insisting["options"][0] |= {"status": "infeasible", "front": []}


def add_what_is_dominated(insisting: Any) -> None:
    first = insisting["points"][0]["id"]
    item = next(item for item in insisting["options"] if first not in item["front"])
    item["front"] = sorted([*item["front"], first])


def renumber(insisting: Any) -> None:
    insisting["points"][-1]["id"] += 1


@pytest.mark.parametrize(
    "change", [drop_a_point, swap_options, change_a_figure, call_it_impossible, add_what_is_dominated, renumber]
)
def test_what_is_not_so_is_found(change: Callable[[Any], None], file: Path) -> None:
    data = json.loads(file.read_text(encoding="utf-8"))
    change(data["insisting"])
    found = dse.verify(data, problem=PUMP)
    assert found.status == "rejected"
    assert any(item.place.startswith("insisting") for item in found.findings)


def test_prices(result: dse.Result) -> None:
    """With control at 20 ms the least jitter is 21.934 ms, 15 ms more than 6.934 ms."""
    price = next(
        item for item in prices(result) if (item.item.decision, item.item.option) == ("control.period", "20 ms")
    )
    assert (price.kept, price.best, price.lost) == (0, (21_934_000, 6000), (15_000_000, 0))
    assert price in costly(result)
    assert summary_words(result).startswith(
        "Of 12 options that one may insist on 4 keep every alternative, 6 keep some"
    )


def test_a_stopped_one_says_unknown(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    stopped = dse.insist(dse.solve(PUMP), time_limit_s=1e-9)
    assert stopped.insisting is not None and not stopped.insisting.is_complete
    assert {item.status for item in stopped.insisting.options} == {"incomplete"}
    assert "unknown" in summary_words(stopped)
    assert dse.verify(stopped, problem=PUMP).status == "verified"


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    assert run(["solve", str(PUMP), "--insist", "--json", str(path)]) == EXIT_COMPLETE
    printed = capsys.readouterr().out
    assert "The price of insisting" in printed and "control.period 20 ms" in printed
    assert json.loads(path.read_text(encoding="utf-8"))["insisting"]["options"]
    assert run(["solve", str(PUMP), "--insist", "--time-limit", "0.001", "-q"]) == EXIT_INCOMPLETE
    assert run(["solve", str(PUMP), "--insist", "--max-price", "1 EUR", "-q"]) == EXIT_NO
    assert run(["solve", str(PUMP), "--scheduler", "tcp://x:1", "-q"]) == EXIT_USAGE
    assert run(["solve", str(PUMP), "--robust", "--insist", "-q"]) == EXIT_USAGE
    assert "--insist" in capsys.readouterr().err


def test_of_an_infeasible_problem_every_option_is_impossible() -> None:
    found = dse.insist(dse.solve(PUMP, max_price="1 EUR")).insisting
    assert found is not None and not found.points
    assert {item.status for item in found.options} == {"infeasible"}
