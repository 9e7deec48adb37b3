"""Near-identical designs: which stand for which, and how that is said."""

from __future__ import annotations

import copy
import io
import json
import random
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from rich.console import Console

import dse
from dse.answers.ranking.order import ranked_by
from dse.answers.ranking.variants import find_variants, is_one_choice
from dse.answers.result import Result
from dse.answers.studies.sweep import SweepRun
from dse.examples.shipped import example_path
from dse.report.content.front.document import Document
from dse.report.content.front.pages import listed_points, printed_page
from dse.report.output import markdown_report
from dse.report.terminal import print_page


@pytest.fixture(scope="module")
def robot() -> Result:
    return dse.solve(example_path("inmark"), max_jitter="20 ms", processing="execution_time")


def test_one_design_with_several_bus_rates_takes_one_place(robot: Result) -> None:
    """The first three differ in more than the rate of the bus; each rate is told beside its design."""
    leaders = [dict(point.decisions) for point in listed_points(robot, 3)]
    for one in leaders:
        one.pop("canbus0.type")
    assert len({tuple(sorted(one.items())) for one in leaders}) == 3
    assert {variant: leader for variant, leader in robot.variants.items() if leader == 1} == {2: 1, 3: 1, 7: 1}
    text = terminal(robot, 3)
    assert "#2, #3, #7 (like #1)" in text
    assert (
        "Near-identical: #2 with canbus0 can_250k (jitter of gnss_to_sprayer 0.144 ms less, price 5 EUR more)" in text
    )


def terminal(result: Result, top: int | None) -> str:
    printed = io.StringIO()
    print_page(Console(file=printed, width=150), printed_page(Document(result), top))
    return " ".join(printed.getvalue().split())


def test_nothing_is_hidden_where_there_is_room(robot: Result) -> None:
    for top in (None, len(robot.front)):
        assert listed_points(robot, top) == robot.front
        text = terminal(robot, top)
        assert "Not shown" not in text and "Near-identical to one above" not in text
        assert " like " in text.partition("Among all designs")[0]


def test_what_is_listed_and_what_is_not_make_up_the_front(robot: Result) -> None:
    for top in range(1, 10):
        shown = {point.id for point in listed_points(robot, top)}
        like = {variant for variant, leader in robot.variants.items() if leader in shown}
        rest = len(robot.front) - len(shown | like)
        assert not shown & like
        assert (f"Not shown here: {rest} more of {len(robot.front)}" in terminal(robot, top)) == (rest > 0)


def test_reports_detail_designs_that_differ(robot: Result) -> None:
    text = markdown_report(Document(robot))
    for point in robot.leaders[:3]:
        assert f"## Alternative \\#{point.id}," in text
    assert text.count("## Alternative \\#") == 3


def test_variants_follow_the_ranking(robot: Result) -> None:
    other = ranked_by(robot, "order:price")
    ranks = {point.id: point.rank for point in other.front}
    assert other.variants and all(ranks[leader] <= ranks[variant] for variant, leader in other.variants.items())


def test_programs_read_it_and_verify_looks_at_it(robot: Result, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text(robot.to_json(), encoding="utf-8")
    assert dse.verify(path).findings == ()
    data = json.loads(robot.to_json())
    assert {point["id"]: point["variant_of"] for point in data["front"] if "variant_of" in point} == robot.variants
    for forge in (lambda point: point.pop("variant_of"), lambda point: point.update(variant_of=4)):
        forged = copy.deepcopy(data)
        forge(forged["front"][1])
        path.write_text(json.dumps(forged), encoding="utf-8")
        assert [item.place for item in dse.verify(path).findings] == ["front[1].variant_of"]


@pytest.mark.parametrize("seed", range(40))
def test_the_definition_on_random_fronts(seed: int) -> None:
    """Every variant is near its leader and a chain of single choices away from it; leaders have no such link."""
    source = random.Random(seed)
    count, axes = source.randint(1, 40), source.randint(1, 3)
    vectors = [tuple(source.randint(0, 40) for _ in range(axes)) for _ in range(count)]
    designs = [{name: str(source.randint(0, 2)) for name in "abcd"} for _ in range(count)]
    found = find_variants(vectors, designs)
    spans = [max(column) - min(column) for column in zip(*vectors, strict=True)]

    def near(one: int, other: int) -> bool:
        triples = zip(vectors[one], vectors[other], spans, strict=True)
        return all(10 * abs(a - b) <= span for a, b, span in triples)

    for leader in [at for at, of in enumerate(found) if of is None]:
        group = {leader}
        while more := {
            at
            for at in range(leader + 1, count)
            if at not in group
            and (found[at] == leader or found[at] is None or (found[at] or 0) > leader)
            and near(leader, at)
            and any(is_one_choice(designs[at], designs[inside]) for inside in group)
        }:
            group |= more
        assert {at for at, of in enumerate(found) if of == leader} == group - {leader}


def test_designs_that_are_built_otherwise_stay_apart() -> None:
    far = {"a": "1", "b": "1"}, {"a": "2", "b": "2"}, {"a": "3", "b": "3"}
    assert find_variants([(0, 100), (1, 99), (100, 0)], far) == [None, None, None]
    near = {"a": "1", "b": "1"}, {"a": "1", "b": "2"}, {"a": "3", "b": "3"}
    assert find_variants([(0, 100), (1, 99), (100, 0)], near) == [None, 0, None]
    slot = {"a": "1", "s": "none"}, {"a": "2", "s": "x"}, {"a": "3", "s": "x"}
    assert find_variants([(0, 100), (1, 99), (100, 0)], slot) == [None, 0, None]


# --- sweeps ---------------------------------------------------------------------------------------------------------


@cache
def swept(name: str, vary: str) -> SweepRun:
    """The only run of a sweep over one limit; nobody changes it."""
    return dse.sweep(example_path(name), vary, processing="execution_time").runs[0]


@pytest.mark.parametrize(
    ("name", "vary"),
    [
        ("inmark", "jitter of gnss_to_sprayer=5ms..100ms"),
        ("inmark", "utilisation of computer=20%..100%"),
        ("inmark", "load of canbus0=10%..80%"),
        ("inmark", "price=250EUR..1100EUR"),
        ("starter", "price=50EUR..300EUR"),
        ("starter", "jitter of sensor_to_actuator=5ms..40ms"),
    ],
)
def test_the_best_choice_changes_only_to_a_better_design_that_is_new(name: str, vary: str) -> None:
    run = swept(name, vary)
    assert run.outcome is not None
    known = {item["id"]: item for item in run.outcome["alternatives"]}
    for tight, loose in pairwise(run.outcome["stretches"]):
        scores = {entry["id"]: float(entry["score"]) for entry in (*tight["front"], *loose["front"])}
        before, after = tight["best"], loose["best"]
        assert scores[after] == min(scores[entry["id"]] for entry in loose["front"])
        if before != after:
            assert scores[after] < scores[before]
            limits = [run.outcome["stretches"][0]["from"], loose["from"]]
            assert float(known[after]["limited"]) > float(known[before]["limited"]), limits


def test_the_best_choice_does_not_come_back() -> None:
    """Scaled to the range of each front it went from 290 EUR to 1,040 EUR and back, again and again."""
    run = swept("inmark", "jitter of gnss_to_sprayer=5ms..100ms")
    assert run.outcome is not None
    best = [stretch["best"] for stretch in run.outcome["stretches"]]
    changes = [number for number, before in zip(best[1:], best[:-1], strict=True) if number != before]
    assert len(changes) == len(set(changes)) > 5


def test_a_grid_of_limits_has_one_scale() -> None:
    study = dse.sweep(
        example_path("inmark"), "price=290EUR,310EUR,1040EUR,1055EUR,1080EUR", processing="execution_time"
    )
    assert {item.name for item in study.ranking.scale} == {
        "jitter of gnss_to_sprayer", "price", "utilisation of computer"
    }  # fmt: skip
    scores = [{json.dumps(item["decisions"]): item["score"] for item in run.front} for run in study.runs]
    for tight, loose in pairwise(study.runs):
        one, other = tight.front[0], loose.front[0]
        if one["decisions"] != other["decisions"]:
            assert float(other["score"]) < float(one["score"])
            assert other["decisions"] not in [item["decisions"] for item in tight.front]
    shared = set(scores[-1]) & set(scores[-2])
    assert shared and all(scores[-1][design] == scores[-2][design] for design in shared)
    data = json.loads(study.to_json())
    assert data["ranking"]["scale"][1] == {
        "name": "price", "sense": "minimise", "unit": "ct", "best": 29000, "worst": 108000
    }  # fmt: skip


def test_a_single_design_shows_its_decisions(capsys: pytest.CaptureFixture[str]) -> None:
    from dse.cli.main import run

    file = str(example_path("starter"))
    for varied in (["price=75EUR", "jitter of sensor_to_actuator=8ms..9ms"], ["jitter of sensor_to_actuator=9ms"]):
        more = [part for text in varied for part in ("--vary", text)]
        assert run(["sweep", file, *more, "--max-price", "75 EUR", "--no-store"]) == 0
        assert "computer small, can0 can_500k, filter.dispatch_protocol aperiodic" in " ".join(
            capsys.readouterr().out.split()
        )
    result = dse.solve(example_path("starter"), max_price="100 EUR", minimise=["price"])
    assert len(result.front) == 1
    text = terminal(result, 10).partition("Among all designs")[0]
    for name, option in result.front[0].decisions.items():
        assert f"{name.removesuffix('.type')} {option}" in text
