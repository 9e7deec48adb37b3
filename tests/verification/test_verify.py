"""What `dse verify` says of results on disk, of stopped searches and of other files; and the parts it is made of."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import canonical
from dse.answers.ranking.order import ranked_by
from dse.cli.main import run
from dse.examples.shipped import example_path
from dse.questions.problem import load
from dse.questions.verify.points import Bench
from dse.search import lexicographic
from dse.search.solver_answer import Unfinished
from dse.support.errors import UsageError
from dse.verification.diagrams import TooLarge
from dse.verification.exhaustion import TooMany, exhaust
from dse.verification.geometry import covers, inside, uncovered
from dse.verification.model import SecondModel
from dse.verification.tables import build_tables
from tests.helpers.effort import LONG
from tests.helpers.support import PROBLEMS, load_space, raw_designs

STARTER = example_path("starter")


def starter(**options: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(dse.solve(STARTER, **options).to_json())
    return data


def places(data: dict[str, Any], **options: Any) -> list[str]:
    return [item.place for item in dse.verify(data, problem=STARTER, **options).findings]


def test_the_words_of_a_ranking_are_checked() -> None:
    data: dict[str, Any] = json.loads(ranked_by(dse.solve(STARTER), "knee").to_json())
    assert "more is better" in data["ranking"]["words"]
    data["ranking"]["words"] = "knee: less is better"
    assert places(data) == ["ranking.words"]


def test_a_setting_that_is_left_out_is_a_finding() -> None:
    data = starter()
    del data["problem"]["effective"]["system"]
    assert "problem.effective.system" in places(data) or "problem.effective" in places(data)


def test_what_is_asked_twice_is_listed_once() -> None:
    """In the same words, that is; a stricter limit stands beside the file's."""
    limit = "jitter of sensor_to_actuator <="
    data = starter(max_jitter=["60ms", "50 ms", "50 ms"], require=["load of can0 <= 40 %", "load <= 40 %"])
    assert data["problem"]["effective"]["requirements"] == [
        f"{limit} 60 ms",
        "utilisation of computer <= 70 %",
        "load of can0 <= 40 %",
        f"{limit} 50 ms",
    ]
    assert places(data) == []


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_enumeration_is_the_analysis_on_every_combination(path: Path) -> None:
    evaluator = Evaluator(load_space(path))
    expected = {}
    for raw in raw_designs(evaluator.space):
        evaluation = evaluator.evaluate(raw)
        if evaluation.is_feasible:
            expected[canonical(evaluator.space, raw)] = evaluation.objectives
    found = exhaust(build_tables(evaluator))
    signs = [1 if item.sense == "minimise" else -1 for item in evaluator.space.objectives]
    rows = [tuple(int(option) for option in row) for row in found.designs]
    assert len(rows) == len(set(rows))
    vectors = [tuple(s * int(v) for s, v in zip(signs, row, strict=True)) for row in found.vectors]
    assert dict(zip(rows, vectors, strict=True)) == expected


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_second_model_has_exactly_the_designs(path: Path) -> None:
    evaluator = Evaluator(load_space(path))
    tables = build_tables(evaluator)
    found = exhaust(tables)
    model = SecondModel(tables)
    for vector in sorted({tuple(map(int, row)) for row in found.vectors})[: 20 if LONG else 8]:
        inner = [value + 1 for value in vector]
        assert model.in_region(inner, vector).answer == "design"
        for axis in range(len(vector)):
            below = [value if at == axis else value + 1 for at, value in enumerate(vector)]
            better = ((found.vectors < below).all(axis=1)).any()
            assert model.in_region(below).answer == ("design" if better else "none")


def test_uncovered_is_what_counting_says() -> None:
    outer = (4, 3, 3)
    points = [(1, 1, 0), (0, 2, 2)]
    regions = [(1, 2, 3), (4, 1, 3), (0, 3, 3), (4, 3, 0)]
    left = {
        cell
        for cell in product(*map(range, outer))
        if not any(covers(point, cell) for point in points) and not any(inside(cell, region) for region in regions)
    }
    found = uncovered(points, regions, outer)
    assert (found is None) == (not left)
    assert found is None or tuple(value - 1 for value in found) in left
    assert uncovered(points, [(4, 3, 3)], outer) is None
    assert uncovered([], [], (1,)) == (1,)


def test_too_many_designs_are_left_to_the_model() -> None:
    tables = build_tables(Evaluator(dse.load(STARTER).space))
    with pytest.raises(TooMany):
        exhaust(tables, 10)


def test_figures_that_no_solver_can_add_are_refused() -> None:
    """Also one that is the same in every design."""
    tables = build_tables(Evaluator(dse.load(STARTER).space))
    (total, divisor), *others = tables.objectives
    large = replace(total, parts=(*total.parts, 10**20), low=total.low + 10**20, high=total.high + 10**20)
    with pytest.raises(TooLarge, match="so large"):
        SecondModel(replace(tables, objectives=((large, divisor), *others)))


def test_findings_name_what_is_wrong() -> None:
    data = starter()
    assert places(data) == []
    price = copy.deepcopy(data)
    price["front"][1]["objectives"]["price"] += 1
    assert places(price)[0] == "front[1].objectives.price"
    missing = copy.deepcopy(data)
    del missing["refuted"][0]
    assert places(missing) == ["refuted"]
    point = copy.deepcopy(data)
    point["front"].pop()
    found = dse.verify(point, problem=STARTER)
    assert any("nothing is said of the region" in item.text and "it holds" in item.text for item in found.findings)


def test_what_is_not_claimed_of_a_point_is_said_of_that_one_where_another_is_no_design() -> None:
    data = starter()
    first, last = data["front"][0], data["front"][-1]
    first["decisions"] = dict.fromkeys(first["decisions"], "nothing")
    last["is_first"] = False
    found = dse.verify(data, problem=example_path("starter"))
    assert found.status == "rejected"
    assert any(f"the objectives of #{last['id']}" in text for text in found.remarks)


def test_an_infeasible_result_is_proved_again(tmp_path: Path) -> None:
    data = starter(max_jitter="1ms")
    assert data["status"] == "infeasible"
    found = dse.verify(data, problem=STARTER)
    assert found.status == "verified"
    assert "asked beyond the file: jitter of sensor_to_actuator <= 1 ms" in found.remarks
    data["problem"]["effective"]["requirements"].pop()
    assert dse.verify(data, problem=STARTER).status == "rejected"


def test_a_stopped_result_says_what_is_open() -> None:
    data = starter()
    stopped = copy.deepcopy(data)
    stopped["status"] = "incomplete"
    stopped["unexplored"] = [stopped["refuted"].pop(1)]
    assert dse.verify(stopped, problem=STARTER).status == "verified"
    dishonest = copy.deepcopy(stopped)
    dishonest["unexplored"][0]["price"] -= 1
    assert places(dishonest) == ["unexplored"]
    dishonest = copy.deepcopy(stopped)
    dishonest["unexplored"][0]["price"] += 1
    assert places(dishonest) == ["unexplored[0]"]


def test_a_search_stopped_before_its_first_point_claims_nothing_of_its_design(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lexicographic._lexicographic
    with monkeypatch.context() as patch:
        patch.setattr(lexicographic, "_lexicographic", lambda *given: Unfinished(best=whole(*given)))  # type: ignore[arg-type]
        stopped = starter()
    assert (stopped["status"], len(stopped["front"]), len(stopped["unexplored"])) == ("incomplete", 1, 1)
    assert dse.verify(stopped, problem=STARTER).status == "verified"
    assert "unexplored[0]" in places({**stopped, "front": starter()["front"][:2]})
    assert "unexplored[0]" in places({**stopped, "status": "complete"})


@pytest.mark.parametrize("broken", [{}, {"front": 3}, {"front": [{}]}, {"front": [], "problem": {}}, {"front": [None]}])
def test_no_result_at_all(broken: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    file.write_text(json.dumps({"format": "dse-result/1", **broken}))
    try:
        found = dse.verify(file, problem=STARTER)
    except UsageError:
        return
    assert found.status == "rejected"


def test_command(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.yaml").write_text(STARTER.read_text())
    assert run(["solve", "p.yaml", "--json", "r.json", "-q"]) == 0
    assert run(["verify", "r.json"]) == 0
    assert "VERIFIED" in capfd.readouterr().out
    assert run(["verify", "r.json", "--method", "model", "--json", "-"]) == 0
    assert json.loads(capfd.readouterr().out)["status"] == "verified"
    Path("elsewhere").mkdir()
    Path("p.yaml").rename("elsewhere/p.yaml")
    assert run(["verify", "r.json", "--problem", "elsewhere/p.yaml"]) == 0
    Path("elsewhere/p.yaml").write_text(STARTER.read_text().replace("name: ", "name: Another "))
    capfd.readouterr()
    assert run(["verify", "r.json", "--problem", "elsewhere/p.yaml"]) == 4
    assert "problem.identity" in capfd.readouterr().out


def test_a_problem_with_nothing_to_decide_is_refuted_and_that_is_verified(tmp_path: Path) -> None:
    """One design, which breaks its requirement: there is none."""
    text = "{dse: 1, name: x, devices: {a: {latency: 7 ms}}, flows: {f: {path: [a], latency: 0 ms .. 2 ms}},"
    (tmp_path / "p.yaml").write_text(f"{text} objectives: [minimise price]}}", encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml")
    (tmp_path / "r.json").write_text(result.to_json(), encoding="utf-8")
    assert not result.front
    for method in ("exhaustion", "model"):
        assert dse.verify(tmp_path / "r.json", method=method).findings == ()


def test_findings_about_designs_and_proofs_come_before_those_about_ranks() -> None:
    """Of 60 shifted ranks ten are listed and the rest is counted; an open region comes before them."""
    data = starter()
    bench = Bench(data, load(STARTER))
    for number in range(60):
        bench.find(f"front[{number}].rank", "is another one")
    bench.find("refuted", "nothing is said of a region")
    listed = bench.listed()
    assert (listed[0].place, len(listed)) == ("refuted", 12)
    assert str(listed[-1]) == "front[].rank: 50 more such findings"
    shifted = copy.deepcopy(data)
    for point in shifted["front"]:
        point["rank"] += 1
    del shifted["refuted"][0]
    assert places(shifted)[0] == "refuted"
