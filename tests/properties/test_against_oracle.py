"""The product against brute force by an independent reading of the documents, on random problems."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from fractions import Fraction

import pytest

from dse.analysis.terms import Term
from dse.search.front import search_front
from dse.space.model.space import Design
from dse.space.model.trees import consulted
from dse.space.size import space_size
from dse.support.errors import TooLargeError
from tests.helpers import chained_callbacks
from tests.helpers.effort import cases
from tests.helpers.whole_systems import draw_whole_system
from tests.oracle import evaluator as oracle
from tests.oracle.generator import random_problem
from tests.oracle.reading import NO_BOUND_NS, Reading
from tests.oracle.scheduling import Scheduling
from tests.properties import chained
from tests.properties.pair import Pair, exact_value

PROBLEMS = [("tiny", seed) for seed in cases(130)]
PROBLEMS += [("small", seed) for seed in cases(10)]
PROBLEMS += [("grouped", seed) for seed in cases(5, 102)]
PROBLEMS += [("reserved", seed) for seed in cases(10)]
PROBLEMS += [("segmented", seed) for seed in cases(10, 6)]
PROBLEMS += [("hosted", seed) for seed in cases(50, 109)]
MOST_COMPARED = 250
"""Designs of a problem whose figures are compared, evenly spread; a tiny problem has fewer."""
MOST_COMBINATIONS = 1500
"""Problems with more combinations of options are not searched by evaluating all of them."""


@pytest.mark.parametrize(("size", "seed"), PROBLEMS)
def test_a_random_problem(size: str, seed: int) -> None:
    try:
        pair = Pair(random_problem(seed, size))
        figures_agree(pair)
        found = search_front(pair.evaluator)
    except TooLargeError:  # limits and sums of what has no bound
        pytest.skip("too large to search exactly, by name")
    assert found.is_complete
    fronts_agree(pair, found.points)
    if pair.combinations <= MOST_COMBINATIONS:
        assert found.points == pair.own_front()


@pytest.mark.parametrize("seed", cases(200))
def test_random_chains(seed: int) -> None:
    """Jitter, lags and flows of one design each: docs/semantics.md, section 4.9."""
    figures_agree(Pair(chained.draw(seed)), most=NO_BOUND_NS)


@pytest.mark.parametrize("seed", cases(100))
def test_random_whole_systems(seed: int) -> None:
    """Chains through executors of all kinds, cores and a bus, one design each."""
    figures_agree(Pair(draw_whole_system(seed)), most=NO_BOUND_NS)


@pytest.mark.parametrize("seed", cases(200))
def test_random_callbacks(seed: int) -> None:
    """Chains of callbacks in executors that share a core, one design each: sections 4.6 and 4.9."""
    core = chained_callbacks.draw(random.Random(f"callbacks {seed}"))
    names = [item.name for item in core.callbacks]
    more = ["metrics:", *(f"  end_{name}: response time of {name}" for name in names), chained_callbacks.flows_of(core)]
    more += ["overload: allowed", f"objectives: [{', '.join(f'minimise end_{name}' for name in names)}]"]
    text = chained_callbacks.text_of(core, more="\n".join(more))
    figures_agree(Pair(text), most=NO_BOUND_NS)


def test_lags_of_drawn_chains_are_mostly_no_response_times() -> None:
    """In three of ten problems a thread or window ends sooner than a response time after the latest release."""
    pairs = [Pair(chained.draw(seed)) for seed in range(20)]
    designs = [Reading(pair.oracle, pair.valid[0].named).scheduling.windows for pair in pairs]
    differ = [
        any(lag is not None and lag < (found.response(row) or lag) for row, lag in found.lags.items())
        for found in designs
    ]
    assert sum(differ) >= 6


def test_some_threads_of_drawn_chains_come_less_often_behind_one_on_their_core() -> None:
    """In half of the problems a thread comes less often than its streams say in a busy window, its own or not.

    In three of ten a chain is back on a core where it may have begun again by then.
    """
    pairs = [Pair(chained.draw(seed)) for seed in range(20)]
    designs = [Reading(pair.oracle, pair.valid[0].named).scheduling for pair in pairs]
    assert sum(map(_has_fewer_jobs, designs)) >= 10
    assert sum(map(_comes_back_late, designs)) >= 6


def _comes_back_late(known: Scheduling) -> bool:
    core = {job[0]: known.core(job) for job in known.jobs if job[1] == "timer"}
    for name, here in core.items():
        chain = known.chains.chain(name)
        for place, before in enumerate(chain[:-1]):
            has_bound = known.windows.bound(chain[place:]) is not None
            if core.get(before) == here and has_bound and not known.chains.ends_before(before, name):
                return True
    return False


def _has_fewer_jobs(known: Scheduling) -> bool:
    plain = [job for job in known.jobs if job[1] == "timer"]
    return any(
        known.windows.successors.comes(job, level) != known.releases(job)
        for level in plain
        for job in [level, *known.beside(level)]
        if job == level or known.goes_before(job, level)
    )


def figures_agree(pair: Pair, *, most: Fraction | None = None) -> None:
    """Both call the same combinations designs, use the same decisions in them, and give them the same figures.

    Of a figure that is no less than `most` for one only that it is so for the other, too.
    """
    assert len(pair.valid) <= space_size(pair.space)
    for judged in pair.valid[:: len(pair.valid) // MOST_COMPARED + 1]:
        evaluation = pair.evaluator.evaluate(tuple(max(option, 0) for option in judged.design))
        assert evaluation.breaches == ()
        assert evaluation.design == judged.design
        assert_rules_see_what_is_active(pair, evaluation.design)
        broken = {verdict.requirement.text for verdict in evaluation.verdicts if not verdict.holds}
        assert bool(broken) == bool(judged.figures["violations"]), judged.named
        expected = pair.oracle_metrics(judged.figures)
        by_hyperperiod = [item for item in pair.evaluator.metrics if item.metric.kind.startswith("exact ")]
        listed = [item for item in pair.evaluator.metrics if item not in by_hyperperiod]
        assert {measure.metric.name for measure in listed} == expected.keys()
        counted = pair.evaluator.metric_values(evaluation.design)
        for measure in by_hyperperiod:  # see tests/clocks; here that the sums of neighbours bound it
            kind, flow = measure.metric.kind.removeprefix("exact "), pair.space.flows[measure.metric.index or 0].name
            exact, bound = exact_value(measure, counted[measure.metric.name]), expected[f"{kind} of {flow}"]
            assert measure.rounded or (exact >= bound if kind == "min latency" else exact <= bound)
        for measure in listed:
            exact, shown = expected[measure.metric.name], exact_value(measure, counted[measure.metric.name])
            if measure.rounded:
                assert 0 <= shown - exact < figures_in(measure.terms) * exact_value(measure, 1), measure.metric.name
            elif most is None or min(shown, exact) < most:
                assert shown == exact, measure.metric.name


def figures_in(terms: Sequence[Term]) -> int:
    """How many figures a sum adds up, of several sums the longest."""
    return sum(1 if term.extreme is None else max(map(figures_in, term.extreme.sums)) for term in terms)


def assert_rules_see_what_is_active(pair: Pair, design: Design) -> None:
    """What rules look at meets a decision exactly where it is active."""
    for number, item in enumerate(pair.space.decisions):
        reference = pair.space.references.get(item.name)
        if reference is not None and item.is_open:
            assert (number in consulted(reference.tree, design)[0]) == (design[number] >= 0), item.name


def fronts_agree(pair: Pair, points: Mapping[tuple[int, ...], Design]) -> None:
    """The same vectors, each with the first of all its designs; an infeasible problem has none."""
    assert bool(points) == bool(pair.feasible)
    if pair.is_rounded:
        rounded_front_agrees(pair, points)
        return
    found = {pair.vector(counted): design for counted, design in points.items()}
    assert found.keys() == pair.front.keys()
    for vector, design in found.items():
        assert design == pair.front[vector][0].design
        figures = oracle.evaluate(pair.oracle, pair.named(design))
        assert figures["violations"] == []
        assert figures["objectives"] == vector


def rounded_front_agrees(pair: Pair, points: Mapping[tuple[int, ...], Design]) -> None:
    """Where the product counts too coarsely to be exact, its front is that of the vectors as it counts them."""
    first: dict[tuple[int, ...], Design] = {}
    for judged in pair.feasible:
        first.setdefault(pair.evaluator.evaluate(judged.design).objectives, judged.design)
    vectors: dict[tuple[Fraction, ...], tuple[int, ...]] = {pair.vector(counted): counted for counted in first}
    assert points == {vectors[vector]: first[vectors[vector]] for vector in oracle.non_dominated(set(vectors))}
    for design in points.values():
        assert oracle.evaluate(pair.oracle, pair.named(design))["violations"] == []


DIRECT = """
dse: 1
name: direct
processor_types: {P: {price: 10 EUR}, Q: {price: 20 EUR}}
bus_types:
  ros: {virtual: true, latency: 1 us, price: 5 EUR}
  dds: {virtual: true, latency: 2 us, price: 3 EUR, power: 1 W}
processors: {p: {type: [P, Q]}}
buses: {net: {type: dds, bus: ros, optional: true}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
  b: {processor: p, compute_execution_time: 1 ms}
connections: {c: {from: a, to: b, data_size: 1 B, bus: [ros, dds, net]}}
flows: {f: {path: [a, b]}}
objectives: [minimise latency, minimise price, minimise power]
processing: execution_time
"""


@pytest.mark.parametrize(
    "rules", ["[]", "[ros requires Q]", "[dds requires Q]", "[forbid ros]", "[require ros and dds]"]
)
def test_a_virtual_bus_type_used_directly_is_there_where_something_is_bound_to_it(rules: str) -> None:
    pair = Pair(DIRECT if rules == "[]" else f"{DIRECT}rules: {rules}\n")
    figures_agree(pair)
    found = search_front(pair.evaluator).points
    fronts_agree(pair, found)
    assert found == pair.own_front()
    prices = {"[]": {1_300, 1_500}, "[ros requires Q]": {1_300, 2_500}, "[dds requires Q]": {1_500}}
    if rules in prices:
        assert {vector[1] for vector in pair.front} == prices[rules]


LEADING = """
dse: 1
name: leading
processor_types: {P: {}}
processors: {p: {type: P}}
threads:
  a: {processor: p, period: 5 ms, compute_execution_time: 1 ms}
  b:
    processor: p
    dispatch_protocol: [periodic, aperiodic, hybrid]
    period: [10 ms, 20 ms]
    compute_execution_time: 1 ms
connections: {c: {from: a, to: b, latency: 1 us .. 3 us}, d: {to: b, rate: 7 Hz, port: data}}
flows: {sent: {path: [c, b]}, arriving: {path: [d, b]}, whole: {path: [a, b]}, alone: {path: [b]}}
objectives: [minimise latency of sent, minimise jitter of arriving, minimise utilisation]
processing: execution_time
"""


def test_a_flow_that_begins_with_a_connection_starts_when_its_message_leaves() -> None:
    pair = Pair(LEADING)
    figures_agree(pair)
    found = search_front(pair.evaluator).points
    fronts_agree(pair, found)
    longest = {judged.figures["flows"]["sent"]["max"] for judged in pair.valid}
    assert longest == {1_003_000, 11_003_000, 21_003_000}


EMPTY = """
dse: 1
name: empty
processor_types: {P: {}}
bus_types: {can: {bandwidth: 1 Mbit/s, latency: 1 ms}, dds: {virtual: true, latency: 1 us}}
processors: {p: {type: P}}
buses:
  one: {type: can}
  two: {type: can}
  net: {type: dds, bus: [one, two], optional: true}
threads: {a: {processor: p, period: 10 ms, compute_execution_time: 1 ms}}
connections: {c: {from: a, data_size: 1 B, bus: [one, net]}}
flows: {f: {path: [a, c]}}
objectives: [minimise latency, maximise load of one]
rules: ["RULE"]
processing: execution_time
"""


@pytest.mark.parametrize(
    ("rule", "count"),
    [
        ("net.bus == two", 2),
        ("forbid net.bus == two", 2),
        ("net.type == none implies net.bus == two", 3),
        ("net.bus in [two] and net.type == dds", 1),
        ("not net.bus == one or net.type == none", 2),
    ],
)
def test_the_carrier_of_an_empty_virtual_slot_is_unknown_to_rules(rule: str, count: int) -> None:
    """It was known in rules although inactive, and the search then found no design with the slot empty."""
    pair = Pair(EMPTY.replace("RULE", rule))
    assert len(pair.valid) == count
    figures_agree(pair)
    found = search_front(pair.evaluator).points
    fronts_agree(pair, found)
    assert found == pair.own_front()


def test_the_random_problems_are_worth_it() -> None:
    """Fronts of several points, ties between designs, and infeasible problems do occur."""
    pairs = [Pair(random_problem(seed, "tiny")) for seed in range(20)]
    assert sum(len(pair.front) > 2 for pair in pairs) > 2
    assert any(not pair.front for pair in pairs)
    assert any(len(designs) > 1 for pair in pairs for designs in pair.front.values())
    assert any(-1 in designs[0].design for pair in pairs for designs in pair.front.values())
