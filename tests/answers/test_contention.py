"""What designs keep when threads wait for each other, told of fronts that leave it out; and which core runs what."""

from __future__ import annotations

import csv
import json
import random
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from io import BytesIO
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import networkx
import pytest
from click.testing import CliRunner

import dse
from dse.analysis.diagnosis.front_verdicts import cores_of, is_left_out, with_contention
from dse.analysis.evaluate import Evaluator
from dse.answers.drawing.picture import Drafter
from dse.answers.result import Result
from dse.cli.main import cli
from dse.questions import front_verdicts
from dse.questions.problem import loads
from dse.questions.reopen import reopen
from dse.questions.verify import contention as referee
from dse.report.content.front.document import Document
from dse.report.words.contention import contention_words, placed_words
from dse.search.feasibility.other_cores import OtherCores
from dse.space.model.space import Design
from dse.space.question.open_cores import cores_beside, with_all_cores
from dse.space.question.settings import deadline_requirements
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime
from tests.helpers.effort import cases

SHARED = """
dse: 1
name: shared
processor_types: {cpu: {cores: 2, price: 5 EUR}, big: {cores: 2, price: 9 EUR}}
processors: {p: {type: [cpu, big]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {cpu: 6 ms, big: 2 ms}}
  b: {processor: p, period: 20 ms, compute_execution_time: {cpu: 6 ms, big: 2 ms}}
  c: {processor: p, period: 40 ms, core: 2, compute_execution_time: {cpu: 12 ms, big: 3 ms}}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}}
flows: {f: {path: [a, b, c]}}
requirements: [latency of f <= 85 ms]
objectives: [minimise latency of f, minimise price]
processing: execution_time
"""
# On cpu: c (30 %) stands on core 2, a (60 %) fits on core 1, b (30 %) too. b: 6 + 6 = 12 and then a again: 18 ms.
# Alone the flow takes 6 + 20 + 6 + 40 + 12 = 84 ms, with contention 6 + 20 + 18 + 40 + 12 = 96 ms.


def threads(seed: int) -> str:
    """Three to five threads on one or two processors with open types; limits around what the designs attain."""
    rng = random.Random(f"contention {seed}")
    names = "abcde"[: rng.randint(3, 5)]
    lines = []
    for number, name in enumerate(names):
        fields: dict[str, Any] = {"processor": rng.choice(["p", "p", "q", "[p, q]"])}
        fields["period"] = f"[{rng.randint(8, 19)} ms, {rng.choice([20, 30, 40])} ms]"
        work = rng.randint(2, 7)
        fields["compute_execution_time"] = f"{{cpu: {rng.randint(1, work)} ms .. {work} ms, big: 1 ms .. 2 ms}}"
        if number and rng.random() < 0.4:
            fields["dispatch_protocol"] = rng.choice(["aperiodic", "sporadic", "[periodic, aperiodic]"])
        if rng.random() < 0.3:
            fields["priority"] = rng.randint(1, 3)
        if rng.random() < 0.2:
            fields["core"] = 1
        if rng.random() < 0.5:
            fields["deadline"] = f"{rng.randint(6, 25)} ms"
        lines.append(f"  {name}: {{{', '.join(f'{key}: {value}' for key, value in fields.items())}}}")
    wires = ", ".join(f"{one}{two}: {{from: {one}, to: {two}}}" for one, two in pairwise(names))
    limit = sum(rng.choice([8, 20, 40]) for _ in names)
    return f"""
dse: 1
name: threads {seed}
overload: allowed
deadlines: {rng.choice(["stated", "stated", "none"])}
processor_types: {{cpu: {{cores: {rng.choice([1, 2, 3])}, price: 5 EUR}}, big: {{cores: 2, price: 12 EUR}}}}
processors: {{p: {{type: [cpu, big]}}, q: {{type: [cpu, big], optional: true}}}}
threads:
{chr(10).join(lines)}
connections: {{{wires}}}
flows: {{f: {{path: [{", ".join(names)}]}}}}
requirements: [latency of f <= {limit} ms, jitter of f <= {limit} ms]
objectives: [minimise latency of f, minimise price]
processing: execution_time
"""


def kept(result: Result) -> dict[int, str]:
    return {point["id"]: point["contention"]["status"] for point in result.to_dict()["front"]}


def test_the_figures_of_a_design_with_contention() -> None:
    result = dse.solve(loads(SHARED))
    by_price = {point.objectives["price"]: point for point in result.front}
    cheap, big = by_price[500], by_price[900]
    assert result.contended[str(big.id)].broken == ()
    data = {item["id"]: item for item in result.to_dict()["front"]}
    assert data[cheap.id]["cores"] == {"a": 1, "b": 1, "c": 2}
    assert data[cheap.id]["contention"] == {
        "status": "broken",
        "broken": [
            {"requirement": "latency of f <= 85 ms", "value": 96_000_000, "limit": 85_000_000, "unit": "ns"}
            | {"unbounded": []}
        ],
    }


def test_one_line_says_how_many_designs_hold() -> None:
    [said] = {contention_words(dse.solve(loads(SHARED)))}
    [big] = [number for number, status in kept(dse.solve(loads(SHARED))).items() if status == "kept"]
    assert said == (
        "CPU contention is not in the latencies: with response times, with cores chosen for each design, "
        f"1 of the 2 designs keeps every requirement (#{big}; the best is #{big})."
        " Counted in the search: --processing response-time."
    )
    without = SHARED.replace(", core: 2", "")
    begin = "CPU contention is not in the latencies: with response times, with cores chosen for each design,"
    hint = " Counted in the search: --processing response-time."
    for kind, keeps, more in (("cpu", "does not keep", hint), ("big", "keeps", "")):
        only = dse.solve(loads(without), fix=f"p.type = {kind}")
        assert contention_words(only) == f"{begin} the only design {keeps} every requirement.{more}"
    nothing = without.replace("requirements: [latency of f <= 85 ms]\n", "")
    assert "no requirement is stated that it could violate" in contention_words(dse.solve(loads(nothing)))


def test_where_contention_is_counted_nothing_more_is_said() -> None:
    for asked in ({"processing": "response_time"}, {"profile": "osate-2.2"}):
        result = dse.solve(loads(SHARED), max_latency="1 s", **asked)  # type: ignore[arg-type] # settings
        assert not is_left_out(result.space) and with_contention(result.space) is None
        assert contention_words(result) == "" and not result.contended
        assert all("contention" not in point for point in result.to_dict()["front"])


def holds_somewhere(result: Result, design: Design) -> bool:
    """Whether a design meets every requirement with waiting on some cores: each placement looked at."""
    counted = with_contention(result.space)
    assert counted is not None
    space = with_all_cores(counted)
    free = sorted(cores_beside(result.space))
    whole = [*design, *(0 for _ in range(len(space.decisions) - len(design)))]
    evaluator = Evaluator(replace(space, objectives=()))
    for options in product(*(range(len(space.decisions[index].options)) for index in free)):
        for index, option in zip(free, options, strict=True):
            whole[index] = option
        if evaluator.evaluate(tuple(whole)).is_feasible:
            return True
    return False


@pytest.mark.parametrize("seed", cases(50))
def test_the_word_of_the_referee_is_that_of_the_analysis_and_of_the_simulation(seed: int) -> None:
    """A design is kept where it is feasible with response times and deadlines; such a one is never observed outside.

    Stated deadlines are kept by each: they are requirements.
    """
    problem = loads(threads(seed))
    result = dse.solve(problem)
    deadlines = deadline_requirements(result.space, lambda _: "")
    for point in result.front:
        judged = result.contended[str(point.id)]
        cores = {
            problem.space.components[number].name: core for number, core in cores_of(result.space, point.design).items()
        }
        open_ = {item.decision.component for item in problem.space.open_cores}
        pinned = {f"{name}.core": str(core) for name, core in cores.items() if name in open_}
        chosen = {**point.decisions, **pinned}
        counted = dse.analyse(problem, chosen, processing="response_time", response_times=True)
        late = [
            item.name
            for found in counted.responses.values()
            for item in found
            if f"response time of {item.name} <= its deadline" in {demand.text for demand in deadlines}
            and item.meets_deadline is False
        ]
        assert not late
        holds = counted.is_feasible
        assert (not judged.broken) == holds, (point.decisions, late)
        assert kept(result)[point.id] == ("kept" if holds_somewhere(result, point.design) else "broken")
        free = dse.analyse(problem, point.decisions, processing="response_time")
        if free.contended is not None:
            assert free.contended.broken == judged.broken
        assert free.is_feasible or judged.broken
        assert free.contended is not None or free.is_feasible == holds
        if holds and seed % 4 == 0:
            limits = {item.metric.kind: item.limit.value * 10**9 for item in result.space.requirements}
            for endless in (
                False,
                True,
            ):  # what comes too soon for a sporadic thread waits, or is lost
                seen = dse.simulate(problem, chosen, runs=4, endless_queues=endless)
                for flow in seen.flows:
                    assert (endless and flow.excuse) or max(flow.latencies, default=0) <= limits["latency"]
    assert dse.verify(result, problem=problem).status == "verified"


EXCHANGED = """
dse: 1
name: exchanged
processor_types: {quad: {cores: 2, price: 5 EUR}, more: {cores: 2, price: 9 EUR}}
processors: {p: {type: [quad, more]}}
threads:
  fast: {processor: p, period: 10 ms, compute_execution_time: 4 ms}
  slow: {processor: p, period: 100 ms, compute_execution_time: {quad: 50 ms, more: 20 ms}}
  late: {processor: p, period: 100 ms, compute_execution_time: 8 ms, deadline: 10 ms}
objectives: [minimise price]
processing: execution_time
"""
DEADLINE = "response time of late <= its deadline"
# First-fit by decreasing use: slow (50 %), fast (40 %) and late (8 %) all on core 1, where late waits for fast.


def test_where_first_fit_misses_a_deadline_other_cores_are_chosen() -> None:
    """Deadlines that are stated are requirements, with the cores as decisions; before, they were told of the front."""
    result = dse.solve(loads(EXCHANGED))
    [point] = result.front
    assert cores_of(result.space, point.design) == {0: 1, 1: 1, 2: 2}
    assert result.to_dict()["front"][0]["contention"] == {"status": "kept", "broken": []}
    assert contention_words(result).endswith(
        "with cores chosen for each design, the only design keeps every requirement."
    )
    open_ = dse.analyse(loads(EXCHANGED), {"p.type": "quad"})
    assert open_.is_feasible and open_.contended == result.contended["1"]
    pinned = dse.analyse(loads(EXCHANGED), {"p.type": "quad", "fast.core": "1", "late.core": "1"})
    assert [item.requirement.text for item in pinned.verdicts if not item.holds] == [DEADLINE]
    untold = dse.solve(loads(EXCHANGED), deadlines="none")
    assert cores_of(untold.space, untold.front[0].design) == {0: 1, 1: 1, 2: 1}
    assert dse.verify(result, problem=loads(EXCHANGED)).status == "verified"


def test_random_problems_are_of_every_kind() -> None:
    seen: Counter[str] = Counter()
    for seed in range(40):
        result = dse.solve(loads(threads(seed)))
        seen.update(kept(result).values())
        seen["elsewhere"] += any(found.decisions for found in result.contended.values())
        seen["unbounded"] += any(item.value is None for found in result.contended.values() for item in found.broken)
        seen["required"] += any(item.metric.key == "deadline" for item in result.space.requirements)
    assert min(seen[name] for name in ("kept", "broken", "unbounded", "required", "elsewhere")) >= 4, seen


def out_of_time(*_: Any) -> Any:
    raise OutOfTime


def test_what_time_does_not_suffice_for_is_not_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said, in every form; the result is whole all the same, verified and reopened."""
    file = tmp_path / "p.yaml"
    file.write_text(SHARED.lstrip(), encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(referee, "judge", out_of_time)
        result = dse.solve(file)
    assert set(kept(result).values()) == {"unknown"}
    assert "it is unknown which designs keep every requirement: the time was too short." in contention_words(result)
    out = tmp_path / "r.json"
    out.write_text(result.to_json(), encoding="utf-8")
    assert dse.verify(out).status == "verified"
    assert reopen(out).to_dict() == result.to_dict()


def test_some_may_be_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[Any] = []

    def judge(*args: Any) -> Any:
        if judged:
            raise OutOfTime
        judged.append(args)
        return real(*args)

    real = referee.judge
    monkeypatch.setattr(referee, "judge", judge)
    result = dse.solve(loads(SHARED))
    assert sorted(kept(result).values())[-1] == "unknown" and len(result.contended) == 1
    assert "(#1; the best is #1); 1 unknown: the time was too short." in contention_words(result)


TOGETHER = """
dse: 1
name: first-fit puts them together
processor_types: {cpu: {cores: 2, price: 5 EUR}, big: {cores: 2, price: 9 EUR}}
processors: {p: {type: [cpu, big]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {cpu: 4 ms, big: 2 ms}}
  b: {processor: p, period: 20 ms, compute_execution_time: {cpu: 6 ms, big: 2 ms}}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
requirements: [latency of f <= 32 ms]
objectives: [minimise latency of f, minimise price]
processing: execution_time
"""
# On cpu a (40 %) and b (30 %) fit on core 1, where b takes 6 + 4 ms: 4 + 20 + 10 = 34 ms. On two cores it is 30 ms.


def test_a_design_that_first_fit_condemns_holds_on_other_cores(tmp_path: Path) -> None:
    """It is judged with cores chosen, in every form; a forged word on it is found out."""
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    file.write_text(TOGETHER.lstrip(), encoding="utf-8")
    result = dse.solve(file)
    cheap = next(point for point in result.front if point.objectives["price"] == 500)
    found = result.contended[str(cheap.id)]
    assert [item.value for item in found.broken] == [34_000_000] and found.status == "kept"
    assert len(set(found.decisions.values())) == 2 and set(found.decisions) == {"a.core", "b.core"}
    waiting = {**cheap.decisions, **found.decisions}
    assert dse.analyse(file, waiting, processing="response_time").metrics["latency of f"] == 30_000_000
    assert set(kept(result).values()) == {"kept"}
    assert contention_words(result).endswith("with cores chosen for each design, both designs keep every requirement.")
    shown = CliRunner().invoke(cli, ["solve", str(file)], env={"COLUMNS": "200"}).output
    assert "With waiting for the CPU both meet every limit." in shown
    data = result.to_dict()
    assert reopen_of(data, out).to_dict() == data and dse.verify(out).status == "verified"
    at = [point["id"] for point in data["front"]].index(cheap.id)
    stated = data["front"][at]["contention"]
    forged: list[dict[str, Any]] = [
        {**stated, "decisions": {"a.core": "1", "b.core": "1"}},
        {**stated, "decisions": {"a.core": "1"}},
        {**stated, "decisions": {"a.core": "1", "b.core": "7"}},
        {**stated, "decisions": {"p.type": "big"}},
        {"status": "kept", "broken": []},
        {"status": "unknown", "broken": []},
        {"status": "broken", "broken": stated["broken"]},
    ]
    for item in forged:
        data["front"][at]["contention"] = item
        refused = item["status"] == "kept"
        with pytest.raises(UsageError) if refused else nullcontext():
            reopen_of(data, out)
        is_sound = item["status"] == "unknown"  # who says nothing says nothing wrong
        assert dse.verify(data, problem=file).status == ("verified" if is_sound else "rejected"), item


def test_what_the_search_for_cores_does_not_settle_is_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(front_verdicts, "MOST_WORK", 0)
        result = dse.solve(loads(TOGETHER))
    cheap = next(point for point in result.front if point.objectives["price"] == 500)
    assert kept(result)[cheap.id] == "unknown" and result.contended[str(cheap.id)].broken
    assert "; 1 unknown: the time was too short." in contention_words(result)
    assert dse.verify(result, problem=loads(TOGETHER)).status == "verified"
    with monkeypatch.context() as patch:
        patch.setattr(OtherCores, "holding", out_of_time)
        assert sorted(kept(dse.solve(loads(TOGETHER))).values()) == ["kept", "unknown"]


def test_cores_that_an_objective_depends_on_belong_to_the_design() -> None:
    asked = loads(TOGETHER).ask(objectives=["minimise response time of b", "minimise price"])
    assert not cores_beside(asked.space) and cores_beside(loads(TOGETHER).space)
    result = dse.solve(asked)
    assert not any(item.decisions for item in result.contended.values())
    assert dse.verify(result, problem=asked).status == "verified"


def test_a_result_that_says_otherwise_is_refused(tmp_path: Path) -> None:
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    file.write_text(SHARED.lstrip(), encoding="utf-8")
    data = dse.solve(file).to_dict()
    assert reopen_of(data, out).to_dict() == data
    for point in data["front"]:
        point["contention"] = {"status": "kept", "broken": []}
    with pytest.raises(UsageError, match="meets other requirements with response times"):
        reopen_of(data, out)
    assert dse.verify(out).status == "rejected"


def reopen_of(data: dict[str, Any], out: Path) -> Result:
    out.write_text(json.dumps(data), encoding="utf-8")
    return reopen(out)


def test_every_page_names_cores_and_what_breaks(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(SHARED.lstrip(), encoding="utf-8")
    result = dse.solve(file)
    cheap = next(point for point in result.front if point.objectives["price"] == 500)
    assert placed_words(result.space, cheap.design) == [
        "p: core 1 (90 %) a, b; core 2 (30 %) c (stated) (a partition within 100 % of each core)"
    ]
    shown = CliRunner().invoke(cli, ["solve", str(file), "--explain"], env={"COLUMNS": "200"}).output
    assert contention_words(result) in " ".join(shown.split())
    assert "Violates latency of f <= 85 ms (96 ms) (by first-fit); no other cores meet every" in shown
    assert "p: core 1 (90 %) a, b; core 2 (30 %) c (stated)" in shown
    assert contention_words(result) in Document(result).summary
    drawn = "\n".join(Drafter(result.space).lines(cheap.design))
    assert drawn.count("on p, core 1") == 2 and drawn.count("on p, core 2") == 1
    analysed = dse.analyse(file, cheap.decisions).to_dict()
    assert analysed["processors"]["p"]["cores"] == {"a": 1, "b": 1, "c": 2}


def test_every_export_has_the_cores(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(SHARED.lstrip(), encoding="utf-8")
    result = dse.solve(file)
    cheap = next(point for point in result.front if point.objectives["price"] == 500)
    title, said, *lines = dse.export(result, cheap.id, "pinning").splitlines()
    rows = list(csv.DictReader(lines))
    assert title.startswith("# ") and "hold where each thread is pinned" in said
    assert [(row["thread"], row["core"], row["cpu"], row["chosen_by"], row["level"]) for row in rows] == [
        ("a", "1", "0", "first-fit", "1"), ("b", "1", "0", "first-fit", "2"), ("c", "2", "1", "stated", "1"),
    ]  # fmt: skip
    found = dse.analyse(result.problem.file, cheap.decisions, response_times=True).responses["p"]
    assert [row["response_ns"] for row in rows] == [str(item.response_ns) for item in found]
    graph = networkx.read_graphml(BytesIO(dse.export(result, cheap.id, "graphml").encode()))
    places = {name: (facts["core"], facts["core_by"]) for name, facts in graph.nodes(data=True) if "core" in facts}
    assert places == {"a": (1, "first-fit"), "b": (1, "first-fit"), "c": (2, "stated")}
    assert dse.export(result, cheap.id, "dot").count("runs on\\ncore 1") == 2
    text = dse.export(result, cheap.id, folder=tmp_path)
    assert "#   p, core 1: a, b\n" in text and "core 2:" not in text
    again = dse.solve(loads(text))
    [point] = again.to_dict()["front"]
    assert point["cores"] == {"a": 1, "b": 1, "c": 2}


def test_one_core_needs_no_word() -> None:
    result = dse.solve(loads(SHARED.replace("cores: 2, ", "").replace(", core: 2", "")))
    assert all("cores" not in point for point in result.to_dict()["front"])
    assert "on the only core of each processor" in contention_words(result)


def test_an_analysis_says_what_its_design_keeps(capsys: pytest.CaptureFixture[str]) -> None:
    late = loads(SHARED)
    found = dse.analyse(late, {"p.type": "cpu"})
    assert found.is_feasible
    assert [item["requirement"] for item in found.to_dict()["contention"]["broken"]] == ["latency of f <= 85 ms"]
    cores = {"a.core": "1", "b.core": "1"}
    counted = dse.analyse(late, {"p.type": "cpu", **cores}, processing="response_time")
    assert "contention" not in counted.to_dict() and not counted.is_feasible


def test_the_terminal_says_whether_contention_is_in_a_latency(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(SHARED.lstrip(), encoding="utf-8")

    def said(*options: str) -> str:
        design = ["--design", "p.type = cpu", "--all", *options]
        return " ".join(CliRunner().invoke(cli, ["analyse", str(file), *design], env={"COLUMNS": "300"}).output.split())

    assert "CPU contention is not in the latencies: each thread counts its execution time" in said()
    assert "first-fit gives: Violates latency of f <= 85 ms (96 ms)." in said()
    assert "CPU contention is in the latencies" in said("--processing", "response-time")
    assert "this profile counts no response times" in said("--profile", "osate-2.2")


def test_fronts_of_sweeps_say_what_their_designs_keep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one line, in the JSON, in the CSV, by the same function as `solve`; of break-points which limit is needed."""
    monkeypatch.chdir(tmp_path)
    Path("p.yaml").write_text(SHARED.lstrip(), encoding="utf-8")
    for vary in ("price=5EUR,9EUR", "latency of f=70ms..84ms"):
        out = CliRunner().invoke(
            cli,
            ["sweep", "p.yaml", "--vary", vary, "--no-store", "--workers", "1", "--json", "s.json", "--csv", "s.csv"],
        )
        assert out.exit_code == 0, out.output
        data = json.loads(Path("s.json").read_text(encoding="utf-8"))
        assert data["contention"] == {"left_out": True, "cores": ["first-fit", "stated"]}
        said = " ".join(out.output.split())
        begin = "with response times, on the cores stated, else those that first-fit gives, "
        assert (
            f"{begin}1 of the {'3' if 'price' in vary else '2'} designs of all fronts keeps every requirement" in said
        )
        rows = Path("s.csv").read_text(encoding="utf-8").splitlines()
        assert "contention" in rows[0].split(",") and any(",broken," in row for row in rows[1:])
        page = CliRunner().invoke(cli, ["report", "s.json", "-o", "pages"])
        assert page.exit_code == 0
        [text] = [path.read_text(encoding="utf-8") for path in Path("pages").glob("*.md")]
        assert begin in " ".join(text.split())
    limited = {item["limited"]: item["contention"]["limited"] for item in data["runs"][0]["alternatives"]}
    assert limited[84_000_000] == 96_000_000
    assert "96 ms, violates others" in said
    solved = {item["decisions"]["p.type"]: item["contention"] for item in dse.solve(loads(SHARED)).to_dict()["front"]}
    swept = dse.sweep(loads(SHARED), "price=5EUR,9EUR")
    for run in swept.runs:
        assert all(item["contention"] == solved[item["decisions"]["p.type"]] for item in run.front)


def test_a_sweep_that_counts_contention_says_no_more() -> None:
    counted = dse.sweep(loads(SHARED).ask(processing="response_time"), "price=9EUR")
    assert counted.contention is None and "contention" not in counted.columns
    assert all("contention" not in item for run in counted.runs for item in run.front)


def test_cores_are_those_of_the_question_that_is_asked() -> None:
    """Before, a question was answered with the cores of one with another limit that the same process had asked."""
    free = loads(EXCHANGED.replace(", deadline: 10 ms", ""))
    tight = free.ask(require=["utilisation of p <= 60 %"])
    assert cores_of(free.space, (0,)) == {0: 1, 1: 1, 2: 1}
    assert cores_of(tight.space, (0,)) == {0: 2, 1: 1, 2: 1}
    times = [
        {
            item.name: item.response_ns
            for item in dse.analyse(asked, {"p.type": "quad"}, response_times=True).responses["p"]
        }
        for asked in (free, tight)
    ]
    assert [item["late"] for item in times] == [98_000_000, 58_000_000]


def test_a_profile_without_response_times_says_so_of_its_fronts() -> None:
    begin = "CPU contention is not in the latencies: this profile counts no response times"
    said = Document(dse.solve(loads(SHARED), profile="osate-2.2")).summary
    assert len([text for text in said if text.startswith(begin)]) == 1
    assert not [text for text in Document(dse.solve(loads(SHARED))).summary if text.startswith(begin)]


def test_where_first_fit_chooses_cores_the_fullest_is_told_beside_the_mean(tmp_path: Path) -> None:
    """Core 1 has a and c (60 % + 20 %), core 2 b (50 %): 90 % leave 25 % of the mean, and 10 % of core 1."""
    file = tmp_path / "p.yaml"
    file.write_text(
        "dse: 1\nname: mean\nprocessor_types: {cpu: {cores: 2}}\nprocessors: {p: {type: cpu}}\nthreads:\n"
        + "".join(
            f"  {name}: {{processor: p, period: 10 ms, compute_execution_time: {work} ms}}\n"
            for name, work in (("a", 6), ("b", 5), ("c", 2))
        )
        + "requirements: [utilisation of p <= 90 %]\n",
        encoding="utf-8",
    )
    shown = CliRunner().invoke(cli, ["analyse", str(file), "--all"], env={"COLUMNS": "200"}).output
    assert "core 1 of p 80 % 90 % 11.1 % holds" in " ".join(shown.split())
    row = "utilisation of p <= 90 % 130 % 180 % 50 % holds (90 % of each of 2 cores; core 1 has 80 % by first-fit)"
    assert row in " ".join(shown.split())
