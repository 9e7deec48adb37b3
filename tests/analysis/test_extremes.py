"""The greatest and the least of several metrics, from the file to the second proof, on a problem worked out by hand.

Thread t1 takes 4 ms of 20 ms (20 %), t2 6 ms (30 %), t3 9 ms (45 %). A processor costs 100 EUR; `right` may stay empty.
The busiest of two is used least by t1 and t2 against t3: 50 %. Latencies (sensor, then a thread, sampled at its period
of 20 ms): t1 24 ms, t2 26 ms, t3 29 ms.
"""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.cli.main import run
from dse.encode.model import encode
from dse.questions.robust.robust import solve_robust
from dse.questions.sensitivity.sensitivity import sensitivity
from dse.search.solver.settings import BARE_IN_ORDER, SolverSettings
from dse.search.solver.strategy import Strategy
from dse.search.solver_answer import Answer, Found, Unfinished

HAND = """
dse: 1
name: hand
processor_types: {cpu: {price: 100 EUR}}
processors: {left: {type: cpu}, right: {type: cpu, optional: true}}
devices: {sensor: {period: 20 ms}}
threads:
  t1: {processor: [left, right], period: 20 ms, compute_execution_time: 0 ms .. 4 ms}
  t2: {processor: [left, right], period: 20 ms, compute_execution_time: 0 ms .. 6 ms}
  t3: {processor: [left, right], period: 20 ms, compute_execution_time: 0 ms .. 9 ms}
connections: {c1: {from: sensor, to: t1}, c2: {from: sensor, to: t2}, c3: {from: sensor, to: t3}}
flows: {f1: {path: [sensor, t1]}, f2: {path: [sensor, t2]}, f3: {path: [sensor, t3]}}
requirements: [utilisation <= 100 %]
objectives: [minimise utilisation, minimise price]
processing: execution_time
"""


def shares(result: dse.Result) -> list[dict[str, int]]:
    return [dict(point.objectives) for point in result.front]


def test_the_busiest_of_all() -> None:
    result = dse.solve(dse.loads(HAND))
    assert result.status == "complete"
    assert {tuple(row.values()) for row in shares(result)} == {(950_000, 10_000), (500_000, 20_000)}
    assert [item.name for item in result.objectives] == ["max(utilisation)", "price"]
    for asked in ("max(utilisation)", "max(utilisation of left, utilisation of right)"):
        again = dse.solve(dse.loads(HAND), minimise=[asked, "price"])
        assert {tuple(row.values()) for row in shares(again)} == {tuple(row.values()) for row in shares(result)}
        assert again.objectives[0].name == asked


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        (["maximise utilisation"], [500_000 - 50_000]),  # of the least used: the other half, 45 %
        (["minimise max(latency)"], [29_000_000]),
        (["maximise latency"], [24_000_000]),
        (["maximise max(latency of f1 * 2, latency of f3 + latency of f2)"], [55_000_000]),
        (["minimise min(utilisation)"], [0]),
    ],
)
def test_both_senses(asked: list[str], expected: list[int]) -> None:
    key = {"minimise": "minimise", "maximise": "maximise"}
    texts: dict[str, Any] = {}
    for text in asked:
        verb, _, metric = text.partition(" ")
        texts.setdefault(key[verb], []).append(metric)
    result = dse.solve(dse.loads(HAND), **texts)
    assert sorted({next(iter(row.values())) for row in shares(result)}) == expected


def test_limits_on_either_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hand.yaml"
    file.write_text(HAND, encoding="utf-8")
    for limit, codes in (
        ("max(utilisation) <= 50 %", 0),
        ("max(utilisation) < 50 %", 4),
        ("min(utilisation) >= 45 %", 0),
    ):
        assert run(["solve", str(file), "--require", limit]) == codes
    assert run(["explain", str(file), "--require", "max(utilisation) < 50 %"]) == 4
    assert "max(utilisation) < 50 %" in capsys.readouterr().out
    assert run(["explain", str(file), "--require", "max(utilisation) <= 30 %"]) == 4
    assert "feasible with 50 %" in capsys.readouterr().out


@pytest.mark.parametrize("method", ["exhaustion", "model"])
def test_proved_a_second_time(method: Any, tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "minimise": ["max(utilisation)", "price"],
        "maximise": ["min(latency of f1, jitter of f2 * 3)"],
    }
    file, path = tmp_path / "hand.yaml", tmp_path / "hand.json"
    file.write_text(HAND, encoding="utf-8")
    result = dse.solve(file, **asked)
    path.write_text(result.to_json(), encoding="utf-8")
    assert not dse.verify(path, method=method).findings
    data = json.loads(result.to_json())
    data["refuted"][0][result.objectives[0].name] += 10**6
    path.write_text(json.dumps(data), encoding="utf-8")
    assert dse.verify(path, method=method).findings


UNCERTAIN = HAND.replace(
    "utilisation <= 100 %", '"max(utilisation) <= 60 %", "min(latency of f1, latency of f2) <= 25 ms"'
)
UNCERTAIN += """
uncertainty:
  threads.t1.compute_execution_time.max: {range: 3 ms .. 5 ms}
  threads.t2.compute_execution_time.max: {range: 4 ms .. 7 ms}
  threads.t3.compute_execution_time.max: {range: 8 ms .. 10 ms}
"""


def test_robust_over_the_whole_ranges() -> None:
    """t1 and t2 beside t3 use 60 % at most, t2 and t3 85 %: one split is left. The lesser latency is 25 ms at most."""
    found = solve_robust(dse.loads(UNCERTAIN))
    assert [dict(point.objectives) for point in found.robust.front] == [{"max(utilisation)": 500_000, "price": 20_000}]
    worst = max(max(Fraction(a + b, 20), Fraction(c, 20)) for a, b, c in product((3, 5), (4, 7), (8, 10)))
    assert worst == Fraction(60, 100)
    tighter = UNCERTAIN.replace("<= 60 %", "<= 59 %")
    assert not solve_robust(dse.loads(tighter)).robust.front


def test_margins_of_a_design() -> None:
    """60 % of 20 ms are 12 ms: t2 may take 8 ms beside t1's 4 ms, t3 12 ms. The lesser latency is t1's up to 5 ms."""
    design = ["t1.processor = left", "t2.processor = left", "t3.processor = right"]
    found = sensitivity(dse.loads(UNCERTAIN), design, samples=2000, front=False)
    margins = {item.path: item.above for item in found.margins}
    t1, t2, t3 = (margins[f"threads.{name}.compute_execution_time.max"] for name in ("t1", "t2", "t3"))
    assert t1 is not None and (t1.last, t1.requirement) == (5_000_000, "min(latency of f1, latency of f2) <= 25 ms")
    assert t2 is not None and (t2.last, t2.requirement) == (8_000_000, "max(utilisation) <= 60 %")
    assert t3 is not None and t3.last == 12_000_000
    assert found.uncertain is not None and found.uncertain.design_chance.all_met == 1


def test_the_busiest_of_equals_that_nothing_moves() -> None:
    """Both processors are used to 1 %, whatever is chosen: the extreme is that number."""
    result = dse.solve(
        dse.loads(
            "dse: 1\nname: equals\nprocessor_types: {one: {price: 10 EUR}}\n"
            "processors: {p: {type: one}, q: {type: one}}\nbus_types: {eth: {bandwidth: [10 Mbit/s, 100 Mbit/s]}}\n"
            "buses: {e: {type: eth}}\nthreads:\n"
            "  b: {processor: p, period: 1 ms, compute_execution_time: 10 us}\n"
            "  c: {processor: q, period: 1 ms, compute_execution_time: 10 us}\n"
            "connections: {x: {from: b, to: c, data_size: 8 B, bus: e}}\nflows: {f: {path: [b, c]}}\n"
            "objectives: [minimise max(utilisation)]\n"
        )
    )
    assert [point.objectives for point in result.front] == [{"max(utilisation)": 10_000}]


def test_an_extreme_without_a_bound_is_advised_by_no_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What stands for the response time of an overloaded thread is no advice, and the second proof agrees."""
    path, out = tmp_path / "p.yaml", tmp_path / "r.json"
    path.write_text(
        "dse: 1\nname: full\nprocessing: response_time\noverload: allowed\nprocessor_types: {one: {price: 10 EUR}}\n"
        "processors: {p: {type: one}}\nthreads:\n  a: {processor: p, period: 3 ms, compute_execution_time: 4 ms}\n"
        "  b: {processor: p, period: [5 ms, 6 ms], compute_execution_time: 2 ms}\nconnections: {c: {from: a, to: b}}\n"
        "flows: {f: {path: [a, b]}}\nrequirements: ['max(latency of f, 2 * jitter of f) <= 40 ms']\n"
        "objectives: [minimise price]\n",
        encoding="utf-8",
    )
    assert run(["explain", str(path)]) == 4
    said = " ".join(capsys.readouterr().out.split())
    assert "no limit helps: at best the response times of a, b are unbounded" in said
    assert run(["solve", str(path), "-q", "--json", str(out)]) == 4
    assert dse.verify(out).status == "verified"


ATTAINED = """
dse: 1
name: attained
processor_types: {cpu: {}}
bus_types: {udp: {virtual: true, transmission_time: {per_byte: 81 ns}, latency: 199 us .. 884 us}}
processors: {p: {type: cpu}}
devices: {gnss: {period: 100 ms, latency: [1.2 ms .. 1.7 ms, 1.4 ms .. 2.4 ms, 144 us .. 1.8 ms]}}
threads:
  a: {processor: p, compute_execution_time: [1294 us, 651 us .. 827 us]}
  b: {processor: p, period: 1 s, compute_execution_time: [1294 us, 651 us .. 827 us]}
connections:
  c0: {from: gnss, to: a, data_size: [1 KB, 333 B], bus: udp}
  c1: {from: a, to: b, data_size: 8 B, bus: udp}
flows: {f: {path: [gnss, a, b]}}
requirements: [utilisation of p <= 2.6707 %]
objectives: [minimise utilisation of p, maximise most]
metrics: {most: "max(min(latency of f, latency of f), jitter of f + jitter of f)"}
processing: execution_time
"""


def test_canonical_designs_need_no_search_for_the_value_of_an_extreme(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which sum is the greatest was left to the solver, which tried nanosecond after nanosecond for half a minute."""
    answers: list[Answer] = []
    run_once = Strategy.run

    def watched(self: Strategy, settings: SolverSettings, work: float) -> Answer:
        answers.append(run_once(self, settings, work))
        return answers[-1]

    monkeypatch.setattr(Strategy, "run", watched)
    result = dse.solve(dse.loads(ATTAINED), workers=1)
    assert [dict(point.objectives) for point in result.front] == [{"utilisation of p": 9_097, "most": 2_004_016_000}]
    assert answers and not any(isinstance(answer, Unfinished) for answer in answers)


def test_values_tried_one_by_one_count_by_their_conflicts() -> None:
    """Where the solver does not know which sum is the greatest, a unit of deterministic time takes half a minute."""
    encoded = replace(encode(Evaluator(dse.loads(ATTAINED).space)), attained=())
    strategy = Strategy(encoded)
    found = strategy.minimise([1, 1], [encoded.everywhere])
    assert isinstance(found, Found)
    strategy.set_point(found.point)
    encoded.model.clear_objective()
    encoded.model.clear_hints()
    before = strategy.work
    assert isinstance(strategy.run(BARE_IN_ORDER, 0.01), Unfinished)
    assert strategy.work - before < 0.005
