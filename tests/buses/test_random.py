"""Drawn problems with messages that wait: the oracle's own reading, every design, the second proof, the simulation."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice, product

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.space.model.space import Space
from dse.support.errors import TooLargeError
from tests.helpers.bus_systems import draw_bus_problem
from tests.helpers.effort import cases
from tests.helpers.identifier_systems import draw_identifier_problem
from tests.helpers.tuned import learn_instead_of_tabulating
from tests.oracle import evaluator as oracle

DESIGNS = 30
SHARES = ("load", "busy")


@pytest.mark.parametrize("seed", cases(40))
def test_figures_are_those_of_the_oracle(seed: int) -> None:
    text = draw_bus_problem(seed, decisions=4)
    evaluator, read = Evaluator(dse.loads(text).ask().space), oracle.load_text(text)
    for design in islice(oracle.designs(read), DESIGNS):
        figures = oracle.evaluate(read, design)
        options = [item.options.index(design.get(item.name) or item.options[0]) for item in evaluator.space.decisions]
        values = evaluator.metric_values(tuple(options))
        measures = {item.metric.name: item for item in evaluator.metrics}
        for flow, found in figures["flows"].items():
            for kind, key in (("latency", "max"), ("min latency", "min"), ("jitter", "jitter")):
                measure, value = measures[f"{kind} of {flow}"], values[f"{kind} of {flow}"]
                beyond = Fraction(value, measure.scale) - found[key]
                assert 0 <= beyond < 1 if measure.rounded else not beyond, (kind, flow, design)
        for bus in ("can0",) if "broadcast" not in text else ():
            load, busy = (Fraction(values[f"{kind} of {bus}"], measures[f"{kind} of {bus}"].scale) for kind in SHARES)
            assert (load, busy) == (figures["load"][bus], figures["busy"][bus] * 10**6)
        late = [item.requirement.text for item in evaluator.evaluate(tuple(options)).verdicts if not item.holds]
        told = [item for item in figures["violations"] if item.startswith("response time")]
        assert sorted(item for item in late if item.startswith("response time")) == sorted(told)


def front_of(space: Space) -> set[tuple[int, ...]]:
    """The objectives of all designs that nothing dominates."""
    evaluator = Evaluator(space)
    found = [evaluator.evaluate(design) for design in product(*(range(len(item.options)) for item in space.decisions))]
    points = {item.objectives for item in found if item.is_feasible}
    return {
        one
        for one in points
        if not any(other != one and all(a <= b for a, b in zip(other, one, strict=True)) for other in points)
    }


@pytest.mark.parametrize("seed", cases(30, 500))
@pytest.mark.parametrize("few", [False, True])
def test_fronts_are_those_of_all_designs(seed: int, few: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where figures are tables, and where they are learnt from what the referee says of solutions."""
    if few:
        learn_instead_of_tabulating(monkeypatch)
    try:
        result = dse.solve(dse.loads(draw_bus_problem(seed, decisions=5)))
    except TooLargeError:  # bits of 333 kbit/s in response times, beside transmission times of another bus
        pytest.skip("too large to search exactly")
    assert {tuple(point.objectives.values()) for point in result.front} == front_of(result.space)
    assert not dse.verify(result).findings


@pytest.mark.parametrize("seed", cases(30, 900))
def test_what_is_played_contradicts_nothing(seed: int) -> None:
    text = draw_bus_problem(seed, decisions=0)
    assert not dse.simulate(dse.loads(text), runs=3, seed=seed).contradictions


@pytest.mark.parametrize("seed", cases(4, 300))
def test_fronts_with_faults_and_any_identifier_are_those_of_all_designs(seed: int) -> None:
    """Rows of a bus count no more faults than there are, in the search and in the second proof."""
    faults = f"fault_interval: {('2 ms', '5 ms', '[3 ms, 9 ms]')[seed % 3]}, fault_burst: {(1, 2, '[1, 2]')[seed % 3]}"
    text = draw_identifier_problem(seed, decisions=2).replace("frame: can,", f"frame: can, {faults},")
    result = dse.solve(dse.loads(text))
    assert {tuple(point.objectives.values()) for point in result.front} == front_of(result.space)
    assert not dse.verify(result, method="model").findings
