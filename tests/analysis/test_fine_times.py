"""Times finer than 1 ns: what messages and their bytes take is exact; whatever else is rounded is told."""

from __future__ import annotations

import json
import pickle
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.questions.problem import Problem, loads
from dse.questions.robust.robust import solve_robust
from dse.questions.verbs.simulate import simulate
from dse.search.front import SearchLimits, search_front
from dse.support.units import Rounded, parse_transmission_ns
from tests.helpers.small import figure, space_of
from tests.helpers.support import brute_front

LINK = """
bus_types: {link: {bandwidth: 10 GB/s, transmission_time: {per_byte: 0.1 ns}}}
buses: {b: {type: link}}
threads: {cam: {period: 50 ms}, see: {}}
connections: {image: {from: cam, to: see, data_size: SIZE, bus: b}}
flows: {f: {path: [cam, see]}}
"""


@pytest.mark.parametrize(("size", "most_ns"), [("2 MB", 200_000), ("1 B", Fraction(1, 10)), ("333 B", "333/10")])
def test_bytes_of_less_than_a_nanosecond_make_no_jitter(size: str, most_ns: object) -> None:
    space = space_of(LINK.replace("SIZE", size))
    assert figure(space, "latency of f") == Fraction(str(most_ns))
    assert figure(space, "min latency of f") == Fraction(str(most_ns)) and figure(space, "jitter of f") == 0


def test_picoseconds() -> None:
    assert parse_transmission_ns("62.5 ps .. 1/3 ns") == (Fraction(1, 16), Fraction(1, 3))
    assert parse_transmission_ns("2000 ps") == (2, 2)
    assert figure(space_of("threads: {a: {period: 5000000 ps}, b: {period: 1 ms}}\nconnections: {w: {from: b, to: a}}\n"
                           "flows: {f: {path: [b, a]}}"), "latency of f") == 5000  # fmt: skip


FINE = """
dse: 1
name: fine
PROCESSING
processor_types: {cpu: {}, two: {cores: 2, price: 7 EUR}}
processors: {p: {type: [cpu, two]}}
bus_types:
  noc: {virtual: true, transmission_time: {per_byte: 0.1 ns .. 0.3 ns}}
  slow:
    virtual: true
    price: 1 EUR
    transmission_time: {fixed: [500 ps, 1 ns], per_byte: [1/3 ns .. 350 ps, 0.125 ns]}
buses: {b: {type: [noc, slow]}}
threads:
  cam: {processor: p, period: [50 us, 60 us], compute_execution_time: 10 us .. 20 us}
  log: {processor: p, period: 40 us, compute_execution_time: 6 us, core: [1, 2]}
  see: {processor: p, compute_execution_time: 3 us .. 4 us, queue_size: 1}
connections: {image: {from: cam, to: see, data_size: [77 B, 200 B], bus: b}}
flows: {f: {path: [cam, see], latency: 0 ms .. LIMIT ns}}
requirements: [utilisation of p <= 100 %]
objectives: [minimise latency of f, maximise min latency of f, minimise response time of see, minimise price]
"""


def fine(processing: str, limit: str = "90000.05") -> str:
    return FINE.replace("PROCESSING", f"processing: {processing}").replace("LIMIT", limit)


@pytest.mark.parametrize("processing", ["execution_time", "response_time"])
@pytest.mark.parametrize("limit", ["28069.95", "28070", "28070.05", "44023.1", "60066.6", "90000"])
def test_the_front_is_that_of_every_design(processing: str, limit: str) -> None:
    evaluator = Evaluator(loads(fine(processing, limit)).space)
    found = search_front(evaluator, SearchLimits())
    assert found.is_complete and found.points == brute_front(evaluator)


def test_limits_finer_than_a_nanosecond_decide() -> None:
    """With 200 B at 0.35 ns and 0.5 ns before: 20 + 4 + 4 us and 70.5 ns."""
    fixed = ["b.type = slow", "b.transmission_time.fixed = 500 ps", "image.data_size = 200 B",
             "b.transmission_time.per_byte = 1/3 ns .. 0.35 ns"]  # fmt: skip
    for limit, status in (("28070.4999", "infeasible"), ("28070.5", "complete"), ("28070.5001", "complete")):
        result = dse.solve(loads(fine("execution_time", limit)), fix=fixed)
        assert result.status == status, limit


def test_results_say_in_which_fraction_they_count(tmp_path: Path) -> None:
    path = tmp_path / "fine.yaml"
    path.write_text(fine("execution_time"))
    result = dse.solve(str(path))
    (tmp_path / "fine.json").write_text(result.to_json())
    units = {item["name"]: item["unit"] for item in json.loads(result.to_json())["objectives"]}
    assert units["latency of f"] == "1/120 ns"  # of 1/8, 1/3, 1/10 and 7/20 ns, times whole bytes
    assert dse.verify(str(tmp_path / "fine.json")).status == "verified"
    slow = {**result.front[0].decisions, "b.type": "slow", "b.transmission_time.fixed": "500 ps"}
    slow |= {"b.transmission_time.per_byte": "0.125 ns", "image.data_size": "77 B"}
    table = json.loads(dse.analyse(str(path), slow).to_json())["flows"]["f"]  # 0.5 + 77 / 8 ns
    assert [row["max_ns"] for row in table["rows"] if row["contributor"] == "image"] == ["81/8"]
    assert table["max_ns"].endswith("/8") and table["jitter_ns"] == 15_000


def test_figures_without_a_common_unit_are_counted_in_picoseconds_and_named() -> None:
    text = fine("execution_time").replace("1/3 ns .. 350 ps", "1/7 ns .. 1/6 ns").replace("0.125 ns", "1/11 ns")
    evaluator = Evaluator(loads(text.replace("0.3 ns", "13/17 ns")).space)
    search = search_front(evaluator, SearchLimits())
    assert "latency of f" in evaluator.rounded and search.points == brute_front(evaluator)
    assert {item.counting_unit for item in evaluator.objectives if "latency" in item.metric.name} == {"1/1000 ns"}


@pytest.mark.parametrize("contention", [True, False])
def test_the_simulation_stays_within_fine_bounds(contention: bool) -> None:
    problem = loads(fine("execution_time"))
    fixed = {"p.type": "cpu", "b.type": "slow", "b.transmission_time.fixed": "500 ps", "image.data_size": "77 B",
             "b.transmission_time.per_byte": "1/3 ns .. 350 ps", "cam.period": "60 us", "log.core": "1"}  # fmt: skip
    result = simulate(problem, fixed, runs=30, contention=contention, offsets="random")
    [flow] = result.flows
    assert not result.contradictions and flow.count
    assert any(isinstance(value, Fraction) and value.denominator > 1 for value in flow.latencies)
    json.loads(result.to_json())


def rounded(text: str) -> list[str]:
    return [remark for remark in dse.check(loads(text)).remarks if '" counts as' in remark]


def test_what_reading_rounds_is_told() -> None:
    text = """
dse: 1
name: rounded
processor_types: {cpu: {price: [60.001 EUR, 70 EUR], power: 0.0001 W}}
processors: {p: {type: cpu}}
bus_types: {b: {bandwidth: 1.9 bit/s, overhead: 9 bit, latency: 1.5 ns, transmission_time: {per_byte: 0.5 ns}}}
threads: {t: {processor: p, period: 1 ms, compute_execution_time: {cpu: [1/3 ns .. 4 ns, 5 ns]}, deadline: 1.5 ns}}
objectives: [minimise price]
"""
    assert rounded(text) == [
        'processor_types.cpu.price: "60.001 EUR" counts as 60.01 EUR',
        'processor_types.cpu.power: "0.0001 W" counts as 1 mW',
        'bus_types.b.bandwidth: "1.9 bit/s" counts as 1 bit/s',
        'bus_types.b.latency: "1.5 ns" counts as 1 ns .. 2 ns',
        'bus_types.b.overhead: "9 bit" counts as 2 B',
        'threads.t.compute_execution_time.cpu: "1/3 ns .. 4 ns" counts as 0 ns .. 4 ns',
        'threads.t.deadline: "1.5 ns" counts as 1 ns',
    ]
    assert not rounded(fine("execution_time"))
    again = pickle.loads(pickle.dumps(Rounded(3, "note", Fraction(5, 2))))
    assert (again, again.note, again.exact) == (3, "note", Fraction(5, 2))


def test_a_deadline_is_supply_and_rounds_down() -> None:
    [thread] = space_of("threads: {t: {period: 1 ms, deadline: 0.0000019 ms}}").components
    assert thread.deadline_ns == 1


def two(limit: str) -> Problem:
    return loads(
        f"""
dse: 1
name: corners
threads: {{a: {{compute_execution_time: 1 ns}}, b: {{compute_execution_time: 1 ns, price: [10 EUR, 5 EUR]}}}}
connections: {{w: {{from: a, to: b}}}}
flows: {{f: {{path: [a, b]}}}}
requirements: [latency of f <= {limit}]
objectives: [minimise price]
uncertainty:
  threads.a.compute_execution_time: {{factor: 1 .. 1.5}}
  threads.b.compute_execution_time: {{factor: 1 .. 1.5}}
"""
    )


@pytest.mark.parametrize(("limit", "points"), [("3 ns", 1), ("2.9 ns", 0)])
def test_corners_between_whole_nanoseconds_are_not_rounded(limit: str, points: int) -> None:
    """1.5 + 1.5 ns keep 3 ns, although 2 + 2 ns would not."""
    found = solve_robust(two(limit))
    assert len(found.robust.front) == points
