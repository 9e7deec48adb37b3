"""Limits that nobody states: 100 % of each core, of each bandwidth and of the time of exclusive buses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.cli.main import run
from dse.questions.problem import loads
from dse.space.question.settings import SETTINGS
from dse.spec.schema.json_schema import json_schema
from dse.support.errors import UsageError
from dse.support.version import SEMANTICS

CORES = """
dse: 1
name: full cores
processor_types: {dual: {cores: 2, price: 5 EUR}}
processors: {p: {type: dual}}
threads:
  a: {processor: p, core: 1, period: 10 ms, compute_execution_time: 6 ms}
  b: {processor: p, core: 1, period: [10 ms, 20 ms], compute_execution_time: 7 ms}
objectives: [minimise price, minimise utilisation of p]
"""
BANDWIDTH = """
dse: 1
name: full bandwidth
bus_types: {wire: {bandwidth: 8 kbit/s, price: 2 EUR}}
buses: {line: {type: wire}}
devices: {s: {period: [500 us, 2 ms]}, t: {}}
connections: {c: {from: s, to: t, data_size: 1 B, bus: line}}
objectives: [minimise price, minimise load of line]
"""
EXCLUSIVE = """
dse: 1
name: busy all the time
bus_types: {wire: {exclusive: true, transmission_time: {fixed: 1 ms}, price: 2 EUR}}
buses: {line: {type: wire}}
devices: {s: {period: [500 us, 2 ms]}, t: {}}
connections: {c: {from: s, to: t, data_size: 1 B, bus: line}}
objectives: [minimise price, minimise busy of line]
"""
CASES = {
    "cores": (CORES, "utilisation of p <= 100 %", "p: {type: dual", "b.period = 10 ms", "b.period == 10 ms"),
    "bandwidth": (BANDWIDTH, "load of line <= 100 %", "line: {type: wire", "s.period = 500 us", "s.period == 500 us"),
    "exclusive": (EXCLUSIVE, "busy of line <= 100 %", "line: {type: wire", "s.period = 500 us", "s.period == 500 us"),
}
EACH = pytest.mark.parametrize("case", CASES)


def overloaded(case: str) -> str:
    """A problem whose every design uses something beyond all of it."""
    text, _, _, _, rule = CASES[case]
    return f"{text.strip()}\nrules: [{rule}]\n"


def by_slot(case: str) -> str:
    return overloaded(case).replace(CASES[case][2], f"{CASES[case][2]}, overload: allowed")


@EACH
def test_nothing_is_used_beyond_all_of_it(case: str) -> None:
    """The design with room is found, the other never; a problem of the other alone is infeasible by that limit."""
    text, limit, _, _, _ = CASES[case]
    found = dse.solve(loads(text.strip()))
    assert found.status == "complete" and len(found.front) == 1
    assert all("500 us" not in value and value != "10 ms" for value in found.front[0].decisions.values())
    result = dse.solve(loads(overloaded(case)))
    assert (result.status, result.front) == ("infeasible", ())
    assert [[item.text for item in conflict.members] for conflict in result.conflicts] in (
        [[limit, CASES[case][4]]],
        [[CASES[case][4], limit]],
    )
    assert result.problem.effective["implied"] == [limit]
    assert result.problem.effective["requirements"] == []
    assert dse.verify(result.to_dict(), problem=loads(overloaded(case))).status == "verified"


@EACH
def test_overload_is_allowed_by_the_file_the_slot_and_the_option(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    in_file = loads(overloaded(case) + "overload: allowed\n")
    in_slot = loads(by_slot(case))
    results = [dse.solve(in_file), dse.solve(in_slot), dse.solve(loads(overloaded(case)), overload="allowed")]
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    file.write_text(overloaded(case), encoding="utf-8")
    assert run(["solve", str(file), "--overload", "allowed", "--json", str(out)]) == 0
    assert "overload allowed" in capsys.readouterr().out
    assert dse.verify(out).status == "verified"
    for result in results:
        assert result.status == "complete" and len(result.front) == 1
        assert result.problem.effective["implied"] == []
    assert [item.problem.effective["overload"] for item in results] == ["allowed", "forbidden", "allowed"]
    assert json.loads(out.read_text())["front"][0]["objectives"] == results[0].to_dict()["front"][0]["objectives"]
    assert dse.solve(in_file, overload="forbidden").status == "infeasible"
    assert dse.solve(in_slot, overload="forbidden").status == "complete"


@EACH
def test_analyse_and_explain_treat_them_as_others(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, limit, _, design, _ = CASES[case]
    file, out = tmp_path / "p.yaml", tmp_path / "a.json"
    file.write_text(CASES[case][0].strip(), encoding="utf-8")
    assert run(["analyse", str(file), "--design", design, "--json", str(out)]) == 4
    said = " ".join(capsys.readouterr().out.split())
    assert f"{limit} (implied)" in said and "VIOLATED" in said
    [verdict] = json.loads(out.read_text())["requirements"]
    assert (verdict["requirement"], verdict["implied"], verdict["origin"]) == (limit, True, "implied")
    assert verdict["holds"] is False
    assert run(["analyse", str(file), "--design", design, "--overload", "allowed"]) == 0
    file.write_text(overloaded(case), encoding="utf-8")
    found = dse.explain(file, every=True)
    assert {item.text for conflict in found.conflicts for item, _ in conflict.members} == {limit, CASES[case][4]}
    [advice] = [item for item in found.relaxations if item.demand.text == limit]
    assert (advice.text, advice.overload) == ("", limit.removesuffix(" <= 100 %").partition(" of ")[2])
    assert advice.closest is not None and advice.limit is not None and advice.closest > advice.limit
    assert dse.solve(loads(by_slot(case))).status == "complete"  # what the advice says, helps
    capsys.readouterr()
    assert run(["explain", str(file)]) == 4
    assert "implied" in capsys.readouterr().out


@EACH
def test_check_names_them_and_remarks(case: str) -> None:
    _, limit, _, _, _ = CASES[case]
    description = dse.check(loads(CASES[case][0].strip()))
    assert description.to_dict()["implied"] == [limit]
    lifted = dse.check(loads(CASES[case][0].strip() + "\noverload: allowed\n"))
    assert lifted.to_dict()["implied"] == []
    if case != "exclusive":
        assert any("is implied" in text for text in description.remarks)
        assert any("`overload: allowed` admits designs" in text for text in lifted.remarks)


def test_a_stated_limit_takes_the_place_of_the_implied_one() -> None:
    """Of one at most at 100 %; a looser one lifts nothing, nor one on the sum alone."""
    for stated, implied in (
        ("utilisation of p <= 80 %", []),
        ("utilisation of p < 100 %", []),
        ("utilisation of p <= 150 %", ["utilisation of p <= 100 %"]),
        ("utilisation of p >= 10 %", ["utilisation of p <= 100 %"]),
    ):
        effective = dse.solve(loads(CORES.strip()), require=[stated]).problem.effective
        assert (effective["requirements"], effective["implied"]) == ([stated], implied)


def test_overload_lifts_no_deadline_and_no_requirement() -> None:
    late = overloaded("cores").replace("7 ms}", "7 ms, deadline: 9 ms}")
    late = late.replace("[10 ms, 20 ms]", "10 ms").replace("rules: [b.period == 10 ms]\n", "")
    for text in (late + "overload: allowed\n", late.replace("type: dual}", "type: dual, overload: allowed}")):
        assert dse.solve(loads(text), deadlines="none").status == "complete"
        assert dse.solve(loads(text), deadlines="all").status == "infeasible"
        assert dse.solve(loads(text), require=["utilisation of p <= 100 %"]).status == "infeasible"


def test_a_bus_type_without_the_property_is_not_limited() -> None:
    """Of a slot with several types only those with a bandwidth, or that are exclusive, have the limit."""
    text = BANDWIDTH.replace("price: 2 EUR}}", "price: 2 EUR}, bare: {price: 3 EUR}}").replace(
        "type: wire", "type: [wire, bare]"
    )
    text = text.strip().replace("objectives: [minimise price, minimise load of line]", "objectives: [minimise price]")
    result = dse.solve(loads(text + "\nrules: [s.period == 500 us]\n"))
    assert [point.decisions["line.type"] for point in result.front] == ["bare"]
    mixed = EXCLUSIVE.replace(
        "price: 2 EUR}}", "price: 2 EUR}, mesh: {transmission_time: {fixed: 1 ms}, price: 3 EUR}}"
    )
    mixed = mixed.replace("type: wire", "type: [wire, mesh]").replace(", minimise busy of line", "").strip()
    problem = loads(mixed + "\nrules: [s.period == 500 us]\n")
    result = dse.solve(problem)
    assert [point.decisions["line.type"] for point in result.front] == ["mesh"]
    assert dse.verify(result.to_dict(), problem=problem).status == "verified"


def test_an_exclusive_bus_without_a_busy_time_is_remarked_on() -> None:
    text = EXCLUSIVE.replace("transmission_time: {fixed: 1 ms}, ", "").replace(", minimise busy of line", "").strip()
    problem = loads(text)
    assert [item.text for item in problem.space.requirements] == []
    assert any(
        "the busy time of line is not limited, although it is exclusive" in text for text in dse.check(problem).remarks
    )


def test_a_result_of_the_other_question_is_not_its_result(tmp_path: Path) -> None:
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    file.write_text(CORES.strip(), encoding="utf-8")
    data: dict[str, Any] = dse.solve(file, overload="allowed").to_dict()
    data["problem"]["effective"]["overload"] = "forbidden"
    assert dse.verify(data, problem=file).status == "rejected"
    data["problem"]["effective"]["implied"] = ["utilisation of p <= 100 %"]
    assert dse.verify(data, problem=file).status == "rejected"
    data["semantics"] = 3
    out.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(UsageError, match="semantics 3, here 1"):
        dse.resume(out, problem=file)


def test_a_stopped_search_goes_on_under_its_own_setting(tmp_path: Path) -> None:
    file, out = tmp_path / "p.yaml", tmp_path / "r.json"
    file.write_text(CORES.strip(), encoding="utf-8")
    for value in ("allowed", "forbidden"):
        stopped = dse.solve(file, overload=value, time_limit_s=1e-9)
        out.write_text(json.dumps(stopped.to_dict()), encoding="utf-8")
        whole = dse.resume(out, problem=file)
        assert isinstance(whole, dse.Result)
        assert whole.problem.effective["overload"] == value
        assert whole.to_dict()["front"] == dse.solve(file, overload=value).to_dict()["front"]


def test_ranges_and_sweeps_have_the_limits_too() -> None:
    """6 ms of 10 ms leave room for 6.3 ms of 20 ms, not for 10.5 ms; nor do 9 or 12 ms for 7 ms of 20 ms."""
    uncertain = CORES.strip() + "\nuncertainty: {threads.b.compute_execution_time: {factor: 0.5 .. 0.9}}\n"
    assert dse.solve_robust(loads(uncertain)).robust.status == "complete"
    wider = uncertain.replace("0.5 .. 0.9", "0.5 .. 1.5")
    assert dse.solve_robust(loads(wider)).robust.status == "infeasible"
    assert dse.solve_robust(loads(wider), overload="allowed").robust.status == "complete"
    swept = dse.sweep(loads(CORES.strip()), ["threads.a.compute_execution_time=2ms,9ms,12ms"], overload="allowed")
    assert [run.status == "complete" for run in swept.runs] == [True, True, True]
    swept = dse.sweep(loads(CORES.strip()), ["threads.a.compute_execution_time=2ms,9ms,12ms"])
    assert [run.status == "complete" for run in swept.runs] == [True, False, False]


@EACH
def test_an_export_states_it(case: str, tmp_path: Path) -> None:
    for problem in (loads(by_slot(case)), loads(overloaded(case) + "overload: allowed\n")):
        text = dse.export(dse.solve(problem), 1, folder=tmp_path)
        assert [item for item in loads(text).space.requirements if item.implied] == []


def test_the_schema_knows_it() -> None:
    definitions = json_schema()["$defs"]
    assert all("overload" in definitions[name]["properties"] for name in ("Processor", "Bus"))


TIGHT = """
dse: 1
name: Tight
processor_types: {duo: {cores: 2, price: 50 EUR}}
processors: {p: {type: duo}}
threads:
  a: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 12 ms}
  b: {processor: p, period: 10 ms, compute_execution_time: 8 ms}
  c: {processor: p, period: 10 ms, compute_execution_time: 7 ms}
requirements: [utilisation of p <= 60 %]
objectives: [minimise price]
"""


def test_a_closest_limit_that_overloads_says_so() -> None:
    problem = dse.loads(TIGHT)
    result = dse.solve(problem)
    (member,) = result.to_dict()["conflicts"][0]["members"]
    assert (member["closest"], member["overload"]) == (1_300_000, "p")
    assert dse.verify(result, problem=problem).status == "verified"
    forged = json.loads(result.to_json())
    del forged["conflicts"][0]["members"][0]["overload"]
    assert dse.verify(forged, problem=problem).status == "rejected"


def test_a_limit_beyond_all_of_it_lifts_nothing_and_check_says_so() -> None:
    remarks = dse.check(dse.loads(TIGHT.replace("60 %", "130 %"))).remarks
    assert any("utilisation of p <= 130 % lifts no implied limit" in item for item in remarks)
    remarks = dse.check(dse.loads(TIGHT.replace("60 %", "130 %") + "overload: allowed\n")).remarks
    assert not any("lifts no implied limit" in item for item in remarks)


def test_each_design_says_whether_threads_without_a_core_have_a_partition() -> None:
    def use(text: str) -> dict[str, object]:
        problem = dse.loads(text)
        result = dse.solve(problem)
        assert dse.verify(result, problem=problem).status == "verified"
        return result.to_dict()["front"][0]["core_use"]["p"]

    loose = TIGHT.replace("requirements: [utilisation of p <= 60 %]", "overload: allowed")
    loose = loose.replace("[10 ms, 20 ms]", "20 ms")
    assert use(loose) == {"partition": "none", "used": [800_000, 1_300_000]}
    fits = loose.replace("compute_execution_time: 8 ms", "compute_execution_time: 3 ms")
    assert use(fits) == {"partition": "found", "used": [1_000_000, 600_000]}
    stated = fits.replace("ms}", "ms, core: 1}")
    assert use(stated) == {"partition": "stated", "used": [1_600_000, 0]}


def test_a_limit_that_another_type_implies_does_not_apply(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "p.yaml"
    types = "{alone: {exclusive: true, transmission_time: {fixed: 1 ms}}, shared: {transmission_time: {fixed: 1 ms}}}"
    text = f"""
dse: 1
name: types
bus_types: {types}
buses: {{line: {{type: [alone, shared]}}}}
devices: {{s: {{period: 2 ms}}, t: {{}}}}
connections: {{c: {{from: s, to: t, data_size: 1 B, bus: line}}}}
objectives: [minimise busy of line]
"""
    file.write_text(text, encoding="utf-8")
    for option, expected in (
        ("alone", "50 % 100 % 50 % holds"),
        ("shared", "\N{EN DASH} \N{EN DASH} \N{EN DASH} does not apply"),
    ):
        assert run(["analyse", str(file), "--design", f"line.type={option}"]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert f"busy of line (implied) {expected}" in said


SETTINGS_BY_SEMANTICS = {
    1: "profile worst_case system partition_output best_case bus_queuing processing deadlines overload",
}


def test_a_new_setting_is_a_new_meaning() -> None:
    """A result without it would not be told from a forgery: the number of `dse.support.version` is raised for it."""
    assert " ".join(SETTINGS) == SETTINGS_BY_SEMANTICS[SEMANTICS]
