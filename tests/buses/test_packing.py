"""Frames that the search packs: options, fronts against exhaustion, the second proof, the oracle, the simulation."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import islice, product
from random import Random

import pytest
from ortools.sat.python import cp_model

import dse
from dse.analysis.evaluate import Evaluation, Evaluator
from dse.encode.model import encode
from dse.space.model.space import Design
from dse.support.errors import ProblemError
from dse.verification import tables
from dse.verification.model import SecondModel
from tests.buses.test_random import front_of
from tests.helpers.effort import cases
from tests.helpers.packing_systems import draw_packing_problem
from tests.oracle import evaluator as oracle

BOX = """
dse: 1
name: a box of signals
bus_types: {can: {bandwidth: 125 kbit/s, frame: can, price: 1 EUR}}
buses: {can0: {type: can}}
packing: {can0: any}
devices: {box: {period: 10 ms}, other: {period: 10 ms}, panel: {}}
connections:
  slow: {from: box, to: panel, port: data, data_size: 2 B, bus: can0, identifier: any, rate: 10 Hz}
  fast: {from: box, to: panel, port: data, data_size: 3 B, bus: can0, identifier: any, rate: 100 Hz, deadline: 8 ms}
  soon: {from: box, to: panel, port: data, data_size: 3 B, bus: can0, identifier: any, rate: 100 Hz, deadline: 5 ms}
  wide: {from: box, to: panel, port: data, data_size: 7 B, bus: can0, identifier: any, rate: 10 Hz}
  own:  {from: box, to: panel, port: data, data_size: 1 B, bus: can0, identifier: any}
  far:  {from: other, to: panel, port: data, data_size: 1 B, bus: can0, identifier: any, rate: 10 Hz}
objectives: [minimise load of can0]
"""


def options(text: str) -> dict[str, tuple[str, ...]]:
    """What each connection may be carried in."""
    found = dse.loads(text).ask().space.decisions
    return {item.component: item.options for item in found if item.field == "carried_in"}


def test_what_may_carry_a_connection_leaves_no_less_often() -> None:
    """The fastest come first, then those due first; what states no rate, is too long or of another sender is alone."""
    assert options(BOX) == {"slow": ("alone", "soon", "fast"), "fast": ("alone", "soon")}
    assert options(BOX.replace("can0: any", "can0: stated")) == {}
    assert options(BOX.replace("rate: 100 Hz, deadline: 8 ms", "rate: 100 Hz, carried_in: alone")) == {
        "slow": ("alone", "soon", "fast")
    }


def test_a_signal_in_a_faster_frame_goes_as_often_as_it() -> None:
    """Two bytes ten times as often are 20 bits every 10 ms; a frame of their own has 75 bits every 100 ms."""
    result = dse.solve(dse.loads(BOX))
    (point,) = result.front
    assert point.decisions == {"slow.carried_in": "alone", "fast.carried_in": "soon"}
    both = dse.analyse(dse.loads(BOX), {"slow.carried_in": "soon", "fast.carried_in": "soon"})
    apart = dse.analyse(dse.loads(BOX), {"slow.carried_in": "alone", "fast.carried_in": "soon"})
    loads = [Fraction(item.metrics["load of can0"]) * 8 for item in (both, apart)]
    assert loads[0] - loads[1] == 20 * 100 - 75 * 10
    (message,) = (item for item in both.messages["can0"] if item.name == "soon")
    assert message.carries == ("slow", "fast")
    assert message.deadline_ns == 5_000_000
    assert not dse.verify(result).findings


def test_a_frame_is_a_message_with_signals_in_a_database() -> None:
    pytest.importorskip("cantools")
    written = dse.export(dse.solve(dse.loads(BOX)), 1, form="dbc")
    messages = re.findall(r"^BO_ \d+ (\w+): (\d+)", written, re.MULTILINE)
    assert sorted(messages) == [("far", "1"), ("own", "1"), ("slow", "2"), ("soon", "6"), ("wide", "7")]
    assert sorted(re.findall(r"SG_ (\w+) : (\d+\|\d+)@", written)) == [("fast", "0|24"), ("soon", "24|24")]


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("{can0: any}", "{can1: any}"), 'packing.can1: unknown bus "can1"'),
        (("{can0: any}", "{can0: all}"), "packing.can0"),
        (("frame: can,", "exclusive: true,"), 'only frames of CAN are packed: "can" states no `frame`'),
        (("frame: can,", "frame: serial,"), 'only frames of CAN are packed: "can" has frames of serial'),
        (("dse: 1", "dse: 1\nprofile: osate-2.19"), "knows no frames of several connections"),
    ],
)
def test_mistakes(edit: tuple[str, str], said: str) -> None:
    assert edit[0] in BOX
    with pytest.raises(ProblemError, match=said):
        dse.loads(BOX.replace(*edit))


def test_a_bus_on_which_nothing_can_be_packed_is_remarked() -> None:
    text = re.sub(r"^  (slow|fast): .*\n", "", BOX, flags=re.MULTILINE)
    assert any("nothing can be packed on can0" in item for item in dse.check(dse.loads(text)).remarks)
    assert not any("packed" in item for item in dse.check(dse.loads(BOX)).remarks)


@pytest.mark.parametrize("seed", cases(75))
def test_fronts_are_those_of_all_designs(seed: int) -> None:
    result = dse.solve(dse.loads(draw_packing_problem(seed)))
    assert {tuple(point.objectives.values()) for point in result.front} == front_of(result.space)
    assert not dse.verify(result).findings


def every_design(evaluator: Evaluator) -> dict[Design, Evaluation]:
    """All feasible designs, in the order of the options."""
    options = product(*(range(len(item.options)) for item in evaluator.space.decisions))
    found = (evaluator.evaluate(one) for one in options)
    return {item.design: item for item in found if item.is_feasible}


@pytest.mark.parametrize("seed", cases(50, 800))
def test_every_feasible_design_is_in_the_model(seed: int) -> None:
    """Rows of a bus hold in each of them, whatever shares a frame."""
    evaluator = Evaluator(dse.loads(draw_packing_problem(seed)).ask().space)
    encoded, designs = encode(evaluator), list(every_design(evaluator))
    for design in Random(seed).sample(designs, min(len(designs), 20)):
        model = encoded.model.clone()
        for number, option in enumerate(design):
            literal = encoded.options[number][option] if option >= 0 else encoded.inactive[number]
            assert literal is not None
            model.add(model.get_int_var_from_proto_index(literal.index) == 1)
        assert cp_model.CpSolver().solve(model) == cp_model.OPTIMAL


@pytest.mark.parametrize("seed", cases(50, 900))
def test_every_feasible_point_is_in_the_second_model(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("FEW_CASES", "FEW_LEAVES", "FEW_OF_MESSAGES"):
        monkeypatch.setattr(tables, name, 3)
    text = re.sub(r"(latency|jitter) of f\]", "load of can0]", draw_packing_problem(seed))
    evaluator = Evaluator(dse.loads(text).ask().space)
    model = SecondModel(tables.build_tables(evaluator))
    for point in {item.objectives for item in every_design(evaluator).values()}:
        assert model.in_region([value + 1 for value in point], point).answer == "design"


@pytest.mark.parametrize("frac", [1, Fraction(1, 4)])
def test_forty_signals_of_six_senders_are_packed(frac: Fraction) -> None:
    """At a quarter of the periods as deadlines the cheapest bus is too slow, in any packing and order."""
    rng = Random(2)
    lines = BOX[: BOX.index("devices:")].splitlines()
    rates = ("125", "250", "500", "1000")
    types = [f"b{rate}: {{bandwidth: {rate} kbit/s, frame: can, price: {rate} EUR}}" for rate in rates]
    lines[3:5] = [f"bus_types: {{{', '.join(types)}}}", "buses: {can0: {type: [b125, b250, b500, b1000]}}"]
    lines += ["devices:", "  sink: {}", *(f"  e{number}: {{period: 5 ms}}" for number in range(6)), "connections:"]
    for number in range(40):
        period, size = rng.choice((5, 10, 20, 50, 100, 200)), rng.choice((1, 1, 2, 2, 2, 4))
        what = f"data_size: {size} B, rate: {1000 // period} Hz, deadline: {round(period * 1000 * frac)} us"
        ends = f"from: e{number % 6}, to: sink, port: data, bus: can0"
        lines.append(f"  s{number}: {{{ends}, identifier: any, {what}}}")
    result = dse.solve(dse.loads("\n".join([*lines, "objectives: [minimise price, minimise busy of can0]"])))
    assert result.status == "complete"
    prices = [int(point.objectives["price"]) // 100 for point in result.front]
    assert sorted(prices) == ([125, 250, 500, 1000] if frac == 1 else [500, 1000])
    assert not dse.verify(result).findings


@pytest.mark.parametrize("seed", cases(50, 300))
def test_figures_are_those_of_the_oracle(seed: int) -> None:
    text = draw_packing_problem(seed)
    evaluator, read = Evaluator(dse.loads(text).ask().space), oracle.load_text(text)
    decisions = evaluator.space.decisions
    listed = list(islice(oracle.designs(read), 200))
    valid = {tuple(design.get(item.name, "-") for item in decisions) for design in listed}
    for design in Random(seed).sample(listed, min(len(listed), 20)):
        figures = oracle.evaluate(read, design)
        chosen = tuple(item.options.index(design.get(item.name) or item.options[0]) for item in decisions)
        values = evaluator.metric_values(chosen)
        measures = {item.metric.name: item for item in evaluator.metrics}
        for kind, key in (("latency of f", "max"), ("min latency of f", "min"), ("jitter of f", "jitter")):
            beyond = Fraction(values[kind], measures[kind].scale) - figures["flows"]["f"][key]
            assert 0 <= beyond < 1 if measures[kind].rounded else not beyond, (kind, design)
        load, busy = (
            Fraction(values[f"{kind} of can0"], measures[f"{kind} of can0"].scale) for kind in ("load", "busy")
        )
        assert (load, busy) == (figures["load"]["can0"], figures["busy"]["can0"] * 10**6)
        evaluation = evaluator.evaluate(chosen)
        assert not evaluation.breaches
        late = [item.requirement.text for item in evaluation.verdicts if not item.holds]
        assert sorted(late) == sorted(figures["violations"])
    if len(listed) < 200:
        every = product(*(range(len(item.options)) for item in decisions))
        found = {evaluation.design for one in every if not (evaluation := evaluator.evaluate(one)).breaches}
        assert len(found) == len(valid)


@pytest.mark.parametrize("seed", cases(50, 600))
def test_what_is_played_contradicts_nothing(seed: int) -> None:
    problem = dse.loads(draw_packing_problem(seed))
    evaluator = Evaluator(problem.ask().space)
    every = list(product(*(range(len(item.options)) for item in evaluator.space.decisions)))
    designs = [one for one in Random(seed).sample(every, min(len(every), 60)) if not evaluator.evaluate(one).breaches]
    for design in designs[:3]:
        texts = {
            item.name: item.options[option] for item, option in zip(evaluator.space.decisions, design, strict=True)
        }
        played = dse.simulate(problem, texts, runs=2, seed=seed)
        assert not played.contradictions and not played.outside
        named = {item.name for item in dse.analyse(problem, texts).messages.get("can0", ())}
        assert {item.name for item in played.messages} <= named
