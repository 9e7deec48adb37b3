"""Uncertain inputs: samples against the analysis, known indices, chances, and robust fronts against brute force."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy
import pytest

from dse.analysis.evaluate import Evaluator
from dse.questions.problem import Problem, load, loads
from dse.questions.robust.robust import solve_robust
from dse.questions.robust.worst_case import Box
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.importance import chance, indices, random_shares
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.margins import bars
from dse.questions.sensitivity.sensitivity import sensitivity
from dse.questions.sensitivity.uncertainty import columns_of, read_uncertainties, stated_ends
from dse.support.errors import ProblemError
from tests.helpers.support import evaluated
from tests.questions.sensitivity.test_margins import design_of, function_of, with_response_times
from tests.questions.studies import NAMES, example, written


def stated(folder: Path, name: str = "starter", text: str = "") -> Problem:
    problem = example(name)
    return load(written(folder, name, text or uncertain_text(problem)))


def uncertain_text(problem: Problem) -> str:
    """Something uncertain of every kind that the problem has."""
    variables = InputSpace(problem).variables
    lines = ["", "uncertainty:"]
    taken: set[str] = set()
    for variable in variables:
        word = variable.path.rpartition(".")[2]
        key = f"{variable.kind.noun} {word}"
        if key in taken or variable.nominal == 0 or not variable.unit or variable.unit == "mW" or len(taken) >= 6:
            continue
        taken.add(key)
        lines.append(f"  {variable.path}: {{factor: 0.7 .. {2 + len(taken) * 2}}}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", NAMES)
def test_samples_are_the_analysis(name: str) -> None:
    problem = example(name)
    function = function_of(problem, design_of(problem.space))
    source = numpy.random.default_rng(3)
    columns = {
        item.index: numpy.maximum(float(item.nominal) * source.uniform(0.5, 2, 40), 1)
        for item in function.inputs.variables
    }
    found = function.sampled(columns, 40)
    for sample in range(0, 40, 7):
        exact = function.analysed([Fraction(float(columns[item.index][sample])) for item in function.inputs.variables])
        for value, wanted in zip(found, exact, strict=True):
            assert float(value[sample] if isinstance(value, numpy.ndarray) else value) == pytest.approx(
                float(wanted), rel=1e-9
            )


def test_samples_of_response_times_are_the_analysis(tmp_path: Path) -> None:
    """Samples beyond a jump are computed by expressions of their own."""
    function = function_of(with_response_times(tmp_path), design_of(with_response_times(tmp_path).space))
    source = numpy.random.default_rng(3)
    columns = {
        item.index: float(item.nominal) * source.uniform(0.8, 3, 300)
        for item in function.inputs.variables
        if item.path.startswith("threads.") and item.end == "max"
    }
    found = function.sampled(columns, 300)
    for sample in range(0, 300, 23):
        values = list(function.inputs.nominal)
        for index, column in columns.items():
            values[index] = Fraction(float(column[sample]))
        for value, wanted in zip(found, function.analysed(values), strict=True):
            here = float(value[sample] if isinstance(value, numpy.ndarray) else value)
            assert here == pytest.approx(float(wanted), rel=1e-9)


def test_distributions_have_their_moments(tmp_path: Path) -> None:
    path = next(item.path for item in InputSpace(example("starter")).variables if item.unit == "bit/s")
    cases = {
        "{range: 100 .. 300 kbit/s}": (200e3, 200e3 / 12**0.5),
        "{factor: 0 .. 2, distribution: uniform}": (None, None),
        "{distribution: normal, mean: 200 kbit/s, deviation: 10 kbit/s}": (200e3, 10e3),
        "{range: 100 .. 300 kbit/s, distribution: triangular, mode: 200 kbit/s}": (200e3, 200e3 / 24**0.5),
        "{samples: [100 kbit/s, 300 kbit/s]}": (200e3, 100e3),
        "{samples: s.csv, column: b, unit: kbit/s}": (150e3, 50e3),
    }
    (tmp_path / "s.csv").write_text("a,b\n1,100\n2,200\n")
    for text, (mean, deviation) in cases.items():
        problem = stated(tmp_path, text=f"\nuncertainty:\n  {path}: {text}\n")
        inputs = InputSpace(problem)
        found = read_uncertainties(problem, inputs)
        [values] = columns_of(found, random_shares(1, 200_000, 1)).values()
        mean = float(found[0].variables[0].nominal) if mean is None else mean
        assert values.mean() == pytest.approx(mean, rel=0.01)
        assert deviation is None or values.std() == pytest.approx(deviation, rel=0.02)


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    problem = stated(tmp_path)
    results = [sensitivity(problem, design_of(problem.space), samples=2000, seed=seed).to_json() for seed in (5, 5, 6)]
    assert results[0] == results[1] != results[2] and '"seed": 5' in results[0]


def test_chances_are_counts(tmp_path: Path) -> None:
    """The share of samples that the analysis itself finds good."""
    problem = stated(tmp_path)
    function = function_of(problem, design_of(problem.space))
    uncertain = read_uncertainties(problem, function.inputs)
    shares = random_shares(len(uncertain), 200, 0)
    found = chance(function, uncertain, shares)
    columns = columns_of(uncertain, shares)
    good = 0
    for sample in range(200):
        values = list(function.inputs.nominal)
        for index, column in columns.items():
            values[index] = Fraction(float(column[sample]))
        good += not function.broken(function.analysed(values))
    assert found.all_met == good / 200


def test_indices_of_a_sum_are_shares_of_its_variance(tmp_path: Path) -> None:
    """Jitter is linear in execution times: two uniform inputs share its variance as the squares of their effects."""
    problem = example("inmark_chapter2")
    function = function_of(problem, design_of(problem.space))
    number = function.outputs.names.index("jitter of f_gnss_lat")
    program = function.programs[0]
    paths = [
        item.path
        for item in function.inputs.variables
        if item.end == "max" and item.index in program.variables(program.outputs[number])
    ][:2]
    text = f"\nuncertainty:\n  {paths[0]}: {{range: 10 ms .. 11 ms}}\n  {paths[1]}: {{range: 10 ms .. 13 ms}}\n"
    problem = stated(tmp_path, "inmark_chapter2", text)
    function = function_of(problem, design_of(problem.space))
    uncertain = read_uncertainties(problem, function.inputs)
    [found], _ = indices(function, uncertain, ["jitter of f_gnss_lat"], 0)
    slopes = [
        abs(bar.values[1] - bar.values[0])
        for bar in bars(function, Fraction(1, 10), stated_ends(uncertain), ["jitter of f_gnss_lat"])
        if bar.path in paths
    ]
    assert sorted(found.effect.values()) == pytest.approx(sorted(float(slope) for slope in slopes))
    squares = [effect**2 for effect in found.effect.values()]
    shares = [square / sum(squares) for square in squares]
    assert list(found.first.values()) == pytest.approx(shares, abs=0.01)
    assert list(found.total.values()) == pytest.approx(shares, abs=0.01)
    assert list(found.spread.values()) == pytest.approx([0, 0], abs=1)


CHAIN = """
dse: 1
name: chain
devices: {source: {period: 50 ms, compute_execution_time: 0 ms .. 1 ms}}
threads: {sink: {dispatch_protocol: aperiodic, compute_execution_time: 0 ms .. 5 ms}}
connections: {a: {from: source, to: sink}}
flows: {main: {path: [source, sink]}}
requirements: [latency of main <= 100 ms]
objectives: [minimise latency of main]
uncertainty:
  threads.sink.compute_execution_time.max: STATED
  devices.source.compute_execution_time.max: {range: 1 ms .. 2 ms}
"""


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("{range: 3 ms .. 9 ms}", 3, 9),
        ("{range: 3 ms .. 9 ms, distribution: triangular, mode: 4 ms}", 3, 9),
        ("{range: 3 ms .. 9 ms, distribution: normal, mean: 5 ms, deviation: 1 ms}", 3, 9),
        ("{distribution: normal, mean: 5 ms, deviation: 1 ms}", 5 - 1.959964, 5 + 1.959964),
        ("{samples: [3 ms, 4 ms, 4 ms, 9 ms]}", 3, 9),
    ],
)
def test_the_effect_is_what_the_whole_range_moves(text: str, low: float, high: float) -> None:
    """The latency is the sum of two execution times: it moves as far as the range is wide, however that is spread."""
    found = sensitivity(loads(CHAIN.replace("STATED", text)), samples=100).uncertain
    assert found is not None
    [index] = found.indices
    path = "threads.sink.compute_execution_time.max"
    assert index.effect[path] == pytest.approx((high - low) * 10**6)
    assert index.over[path] == pytest.approx((low * 10**6, high * 10**6))
    assert index.spread[path] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_worst_corners_are_the_worst(tmp_path: Path, name: str) -> None:
    """Every corner and random places inside are no worse than the corner that is proved."""
    problem = stated(tmp_path, name)
    function = function_of(problem, design_of(problem.space))
    box = Box(read_uncertainties(problem, function.inputs))
    proved = box.worsts(function)
    source = numpy.random.default_rng(0)
    places: list[list[Any]] = [
        [ends[end] for ends, end in zip(box.ends, corner, strict=True)]
        for corner in product((0, 1), repeat=len(box.ends))
    ]
    for _ in range(50):
        places.append([low + (high - low) * Fraction(int(source.integers(0, 1000)), 1000) for low, high in box.ends])
    for place in places:
        values = list(function.inputs.nominal)
        for item, value in zip(box.uncertain, place, strict=True):
            item.set(values, value)
        outputs = function.exact(values)
        for bound, worst in proved:
            sign = -1 if function.outputs.operators[bound.requirement][0] == ">" else 1
            assert sign * (outputs[bound.limit] - outputs[bound.value]) >= sign * (worst.limit - worst.value)


@pytest.mark.parametrize("name", ["starter", "inmark_chapter3"])
def test_the_robust_front_is_that_of_brute_force(tmp_path: Path, name: str) -> None:
    """Every design of the space, at every corner: those that hold at all of them, and their front."""
    problem = stated(tmp_path, name)
    found = solve_robust(problem)
    inputs = InputSpace(problem)
    box = Box(read_uncertainties(problem, inputs))
    robust: dict[tuple[int, ...], tuple[int, ...]] = {}
    for design, evaluation in evaluated(Evaluator(problem.space)).items():
        if not evaluation.is_feasible:
            continue
        function = DesignFunction(inputs, design)
        corners = product((0, 1), repeat=len(box.ends))
        if not any(function.broken(function.exact(box.values(inputs.nominal, corner))) for corner in corners):
            robust[design] = evaluation.objectives
    vectors = set(robust.values())
    front = {
        one
        for one in vectors
        if not any(other != one and all(a <= b for a, b in zip(other, one, strict=True)) for other in vectors)
    }
    assert {tuple(point.objectives.values()) for point in found.robust.front} == front
    assert (found.robust.status == "infeasible") == (not front)
    lost = {failure.point for failure in found.failures}
    assert {point.id for point in found.nominal.front if point.design not in robust} == lost


def test_a_range_of_no_width_changes_nothing(tmp_path: Path) -> None:
    path = InputSpace(example("starter")).variables[0].path
    problem = stated(tmp_path, text=f"\nuncertainty:\n  {path}: {{factor: 1 .. 1}}\n")
    found = solve_robust(problem)
    assert [point.design for point in found.robust.front] == [point.design for point in found.nominal.front]
    assert not found.failures and all(one == other for one, other in found.price.values())


EQUALITY = """
dse: 1
name: equality
processor_types: {c: {}}
processors: {p: {type: c}, q: {type: c}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 2 ms}
  b: {processor: [p, q], period: 10 ms, compute_execution_time: 1 ms, price: [10 EUR, 5 EUR]}
requirements: [utilisation of p == LIMIT]
objectives: [minimise price]
uncertainty:
  threads.b.compute_execution_time: {range: 1 ms .. HIGH}
"""


@pytest.mark.parametrize(
    ("limit", "high", "robust", "nominal"),
    [("20 %", "2 ms", 1, 1), ("30 %", "2 ms", 0, 1), ("30 %", "1 ms", 1, 1), ("40 %", "2 ms", 0, 0)],
)
def test_an_equality_is_robust_where_nothing_that_is_uncertain_moves_it(
    limit: str, high: str, robust: int, nominal: int
) -> None:
    problem = loads(EQUALITY.replace("LIMIT", limit).replace("HIGH", high))
    found = solve_robust(problem)
    assert (len(found.robust.front), len(found.nominal.front)) == (robust, nominal)
    assert [item.value for item in found.failures] == ([400_000] if nominal > robust else [])


@pytest.mark.parametrize(
    ("lines", "entry", "count", "least"),
    [
        ("100\n200\n300\n", "samples: s.csv, unit: kbit/s", 3, 100_000),
        ("100 kbit/s\n200 kbit/s\n", "samples: s.csv", 2, 100_000),
        ("rate\n100\n200\n", "samples: s.csv, unit: kbit/s", 2, 100_000),
        ("100\n200\n300\n", "samples: s.csv, column: '100', unit: kbit/s", 2, 200_000),
        ("a,b\n1,100\n2,200\n", "samples: s.csv, column: b, unit: kbit/s", 2, 100_000),
    ],
)
def test_a_first_line_that_is_a_number_is_a_sample(
    tmp_path: Path, lines: str, entry: str, count: int, least: int
) -> None:
    path = next(item.path for item in InputSpace(example("starter")).variables if item.unit == "bit/s")
    (tmp_path / "s.csv").write_text(lines)
    [found] = stated(tmp_path, text=f"\nuncertainty:\n  {path}: {{{entry}}}\n").loaded.stated
    assert (len(found.numbers), found.low) == (count, least)


def test_several_columns_without_a_header_are_a_mistake(tmp_path: Path) -> None:
    path = next(item.path for item in InputSpace(example("starter")).variables if item.unit == "bit/s")
    (tmp_path / "s.csv").write_text("1,100\n2,200\n")
    with pytest.raises(ProblemError, match="2 columns, but no header"):
        stated(tmp_path, text=f"\nuncertainty:\n  {path}: {{samples: s.csv, unit: kbit/s}}\n")


@pytest.mark.parametrize(("deviation", "robust"), [("0.9 ms", 1), ("1 ms", 1), ("1.1 ms", 0)])
def test_a_normal_distribution_without_a_range_counts_within_three_deviations(deviation: str, robust: int) -> None:
    """2 ms and three deviations keep 50 % of a core at 10 ms where a deviation is 1 ms at most."""
    text = f"""
dse: 1
name: normal
processor_types: {{c: {{}}}}
processors: {{p: {{type: c}}}}
threads: {{t: {{processor: p, period: 10 ms, compute_execution_time: 2 ms}}}}
requirements: [utilisation of p <= 50 %]
objectives: [minimise price]
uncertainty:
  threads.t.compute_execution_time: {{distribution: normal, mean: 2 ms, deviation: {deviation}}}
"""
    found = solve_robust(loads(text))
    assert len(found.robust.front) == robust
    [words] = found.inputs.values()
    assert words == f"normal, 2 ms with deviation {deviation}, within 3 deviations of its mean (99.73% of its values)"
