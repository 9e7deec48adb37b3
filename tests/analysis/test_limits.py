"""Limits: exact at equality, per core and per thread, shares of a bandwidth, derived metrics."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Verdict
from dse.space.question.reading import QuestionError, read_requirements
from tests.helpers.small import MS, design_of, example, figure, space_of


def verdicts(text: str, *requirements: str, options: dict[str, str] | None = None) -> tuple[Verdict, ...]:
    """The verdicts on a design, in the order of the requirements."""
    space = space_of(text + f"requirements: [{', '.join(requirements)}]")
    evaluation = Evaluator(space).evaluate(design_of(space, options))
    assert evaluation.breaches == ()
    return evaluation.verdicts


def processor(cores: int, *threads: tuple[str, str]) -> str:
    """A processor with threads of (execution time, period)."""
    lines = [
        f"t{number}: {{processor: one, compute_execution_time: {work}, period: {period}}}"
        for number, (work, period) in enumerate(threads)
    ]
    return f"""
    processor_types: {{pc: {{cores: {cores}}}}}
    processors: {{one: {{type: pc}}}}
    threads: {{{", ".join(lines)}}}
    """


def test_three_thirds_are_one() -> None:
    """3 * (1 ms / 3 ms) = 1 exactly: within 100 %, not below it."""
    within, below, least, equal = verdicts(
        processor(1, *[("1 ms", "3 ms")] * 3),
        *(f"utilisation of one {operator} 100 %" for operator in ("<=", "<", ">=", "==")),
    )
    assert (within.holds, below.holds, least.holds, equal.holds) == (True, False, True, True)
    assert within.value == within.limit == 10**6 and within.slack == 0


def test_one_nanosecond_more_is_too_much() -> None:
    [verdict] = verdicts(processor(1, *[("1 ms", "3 ms")] * 2, ("1000001 ns", "3 ms")), "utilisation of one <= 100 %")
    assert not verdict.holds
    assert verdict.slack == -Fraction(10**6, 3 * 10**6)


def test_a_limit_counts_the_cores() -> None:
    """4 * 70 % = 280 %: four threads of 70 % fit, and one more ppm does not."""
    fits = processor(4, *[("7 ms", "10 ms")] * 4)
    [verdict] = verdicts(fits, "utilisation of one <= 70 %")
    assert verdict.holds and verdict.limit == 2_800_000
    [verdict] = verdicts(processor(4, *[("7 ms", "10 ms")] * 4, ("1 us", "1 s")), "utilisation of one <= 70 %")
    assert not verdict.holds and verdict.who == "" and verdict.slack == -1


def test_a_core_that_breaks_the_limit_of_the_sum_has_the_figures() -> None:
    """Two threads of 70 % on core 1 of four: 140 % of its 100 %, not 140 % of 400 % with 260 % to spare."""
    text = processor(4, *[("7 ms", "10 ms")] * 2)
    [verdict] = verdicts(text.replace("{processor: one,", "{processor: one, core: 1,"), "utilisation of one <= 100 %")
    assert not verdict.holds and verdict.who == "core 1" and verdict.whole_limit == 4_000_000
    assert (verdict.value, verdict.limit, verdict.slack) == (1_400_000, 1_000_000, -400_000)
    stated = processor(4, ("5 ms", "10 ms"), ("3 ms", "10 ms")).replace("{processor: one,", "{processor: one, core: 1,")
    [verdict] = verdicts(stated, "utilisation of one <= 90 %")
    assert verdict.holds and verdict.who == "core 1" and verdict.slack == 100_000
    [verdict] = verdicts(processor(2, *[("6 ms", "10 ms")] * 3), "utilisation of one <= 100 %")
    assert not verdict.holds and verdict.who == "the fullest core" and verdict.slack == -200_000


def test_each_thread_alone_keeps_the_limit_of_one_core() -> None:
    """80 % in all is far below 4 * 70 %, but no core holds the one thread."""
    [verdict] = verdicts(processor(4, ("8 ms", "10 ms")), "utilisation of one <= 70 %")
    assert not verdict.holds
    assert verdict.worst_term == "t0" and verdict.slack == -100_000
    [verdict] = verdicts(processor(4, ("7 ms", "10 ms")), "utilisation of one <= 70 %")
    assert verdict.holds
    [verdict] = verdicts(processor(4, ("7 ms", "10 ms")), "utilisation of one < 70 %")
    assert not verdict.holds and verdict.worst_term == "t0"


def test_a_hybrid_threads_two_parts_are_one_thread() -> None:
    """Callback 40 % and timer 40 % run on one core: 80 %."""
    text = """
    processor_types: {pc: {cores: 4}}
    processors: {one: {type: pc}}
    devices: {eye: {period: 10 ms}}
    threads:
      odometry:
        {processor: one, dispatch_protocol: hybrid, period: 10 ms,
         callback_execution_time: 4 ms, compute_execution_time: 4 ms}
    connections: {x: {from: eye, to: odometry}}
    """
    fits, not_fits = verdicts(text, "utilisation of one <= 80 %", "utilisation of one <= 79 %")
    assert fits.holds and not not_fits.holds
    assert not_fits.worst_term == "odometry"


def test_an_empty_processor_keeps_every_upper_limit() -> None:
    text = """
    processor_types: {pc: {cores: 4}}
    processors: {one: {type: pc}, spare: {type: pc, optional: true}}
    threads: {t: {processor: [one, spare], period: 10 ms, compute_execution_time: 7 ms}}
    """
    options = {"spare.type": "none", "t.processor": "one"}
    one, spare, strict = verdicts(text, "utilisation <= 70 %", "utilisation of spare < 1 %", options=options)
    assert one.requirement.text == "utilisation of one <= 70 %"
    assert one.holds and spare.holds and strict.holds
    assert spare.value == 0


def bus(rate: str) -> str:
    return f"""
    bus_types: {{can: {{bandwidth: 125 kbit/s}}}}
    buses: {{wire: {{type: can}}}}
    devices: {{eye: {{}}}}
    connections: {{x: {{from: eye, data_rate: {rate}, bus: wire}}}}
    """


def test_a_share_of_the_bandwidth() -> None:
    """50 % of 125 kbit/s is 7812.5 B/s."""
    within, below, figure_limit = verdicts(
        bus("7812.5 B/s"), "load of wire <= 50 %", "load of wire < 50 %", "load of wire <= 7.8125 KB/s"
    )
    assert within.holds and not below.holds and figure_limit.holds
    assert within.limit == figure_limit.limit == Fraction(15625, 2)
    [over] = verdicts(bus("7813 B/s"), "load of wire <= 50 %")
    assert not over.holds and over.slack == Fraction(-1, 2)


def test_a_share_is_asked_of_the_buses_that_have_a_bandwidth() -> None:
    """Without a name the middleware is left out, which has none; named, or alone, it is a mistake."""
    space = example("inmark")
    found = read_requirements(space, "load <= 50 %")
    assert [item.metric.name for item in found] == [f"load of {name}" for name in ("canbus0", "ser0", "ser1", "eth0")]
    assert len(read_requirements(space, "load <= 5 KB/s")) == 5
    with pytest.raises(QuestionError, match="no bandwidth to take a share of"):
        read_requirements(space, "load of ros_ipc <= 50 %")
    with pytest.raises(QuestionError, match="no bandwidth to take a share of"):
        read_requirements(replace(space, buses=space.buses[-1:]), "load <= 50 %")


FLOW = """
    devices: {eye: {period: 10 ms, latency: 1 ms .. 2 ms}}
    threads: {nav: {period: 20 ms, compute_execution_time: 3 ms .. 5 ms}}
    connections: {x: {from: eye, to: nav}}
    flows: {f: {path: [eye, nav], latency: 5 ms .. 27 ms}}
    metrics:
      line: jitter of f * 0.6 m/s
      gap: latency of f - min latency of f
      doubled: line * 2
    """


def test_flow_limits() -> None:
    """Latency 2 + 20 + 5 = 27 ms, least 1 + 3 = 4 ms, jitter 23 ms. The flow's own latency is the first requirement."""
    own, jitter, least, line, gap = verdicts(
        FLOW, "jitter of f < 23 ms", "min latency of f >= 4 ms", "line <= 1.38 cm", "gap == 23 ms"
    )
    assert own.requirement.text == "latency of f <= 27 ms" and own.holds and own.slack == 0
    assert not jitter.holds and jitter.slack == 0
    assert least.holds and line.holds and gap.holds
    assert (line.value, line.unit) == (13_800_000, "nm")


def test_derived_metrics_are_exact_and_may_use_each_other() -> None:
    """23 ms * 0.6 m/s = 13.8 mm."""
    space = space_of(FLOW)
    assert figure(space, "line") == Fraction(138, 10) * 10**6
    assert figure(space, "doubled") == 2 * figure(space, "line")
    assert figure(space, "gap") == 23 * MS
    backwards = space_of(FLOW.replace("      line:", "      first: doubled / 2\n      line:"))
    assert figure(backwards, "first") == figure(space, "line")


def test_totals_derived_from_totals_keep_their_unit() -> None:
    text = """
    totals: {mass: g, freight: g}
    devices: {eye: {totals: {mass: 1.5 g, freight: 2 g}}}
    metrics: {gross: mass + freight, twice: gross * 2}
    """
    space = space_of(text)
    assert figure(space, "gross") == Fraction(7, 2)
    within, below = verdicts(text, "twice <= 7 g", "twice < 7 g")
    assert within.holds and not below.holds and within.unit == "g"


@pytest.mark.parametrize(("limit", "holds"), [("150.50 EUR", True), ("150.49 EUR", False)])
def test_price_limit_to_the_cent(limit: str, holds: bool) -> None:
    text = "devices: {eye: {price: 150.50 EUR, power: 5 W}}\n"
    price, power = verdicts(text, f"price <= {limit}", "power of eye <= 5000 mW")
    assert price.holds is holds and power.holds
    assert price.value == 15050
