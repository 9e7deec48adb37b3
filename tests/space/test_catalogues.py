"""Rules about types of the catalogues that no slot offers (any more)."""

from __future__ import annotations

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.search.front import SearchLimits, search_front
from tests.helpers.support import brute_front, evaluated, space_of

TEXT = """
dse: 1
name: catalogue
processor_types: {a: {price: 1 EUR}, b: {price: 2 EUR}, old: {price: 3 EUR}}
bus_types: {middleware: {virtual: true}, wire: {bandwidth: 1 Mbit/s}}
thread_types: {gone: {period: 5 ms}}
processors: {p: {type: [a, b]}}
threads: {t: {processor: p, period: [10 ms, 20 ms], compute_execution_time: 1 ms}}
requirements: [utilisation of p <= 100 %]
rules: ["RULE"]
objectives: [minimise price, minimise utilisation of p]
"""


@pytest.mark.parametrize(
    ("rule", "designs"),
    [("a requires old", 2), ("forbid old", 4), ("old requires a", 4), ("not middleware", 4), ("forbid wire", 4),
     ("p.type != old", 4), ("p.type in [a, old]", 2), ("p.type == old", 0), ("gone or b", 2)],
)  # fmt: skip
def test_a_type_that_nothing_may_have_is_used_in_no_design(rule: str, designs: int) -> None:
    space = space_of(TEXT.replace("RULE", rule))
    evaluator = Evaluator(space)
    choices = [(p, t) for p in range(2) for t in range(2)]
    assert sum(evaluator.evaluate(_design(space, *choice)).breaches == () for choice in choices) == designs
    found = search_front(evaluator, SearchLimits())
    assert found.is_complete and found.points == brute_front(evaluator)
    name = next(name for name in ("old", "middleware", "wire", "gone") if name in rule)
    remarks = dse.check(dse.loads(TEXT.replace("RULE", rule))).remarks
    said = f'rule "{rule}" names the type {name}, which nothing may have: it is used in no design'
    assert [remark for remark in remarks if remark.startswith("rule")] == [said]


def _design(space: object, processor: int, period: int) -> tuple[int, ...]:
    names = [decision.name for decision in space.decisions]  # type: ignore[attr-defined]
    chosen = {"p.type": processor, "t.period": period}
    return tuple(chosen.get(name, 0) for name in names)


def test_a_type_of_another_catalogue_is_still_a_mistake() -> None:
    with pytest.raises(dse.ProblemError, match=r'"wire" is not an option of p\.type'):
        dse.loads(TEXT.replace("RULE", "p.type == wire"))
    with pytest.raises(dse.ProblemError, match='unknown name "odl"'):
        dse.loads(TEXT.replace("RULE", "forbid odl"))


DEFAULTS = """
dse: 1
name: defaults
processor_types: {two: {cores: [2, 4], price: 5 EUR}, one: {price: 1 EUR}}
bus_types:
  can: {bandwidth: 1 Mbit/s, overhead: [1 B, 2 B], transmission_time: {fixed: [1 ms, 2 ms]}}
  serial: {bandwidth: 1 Mbit/s, transmission_time: {per_byte: 1 us}, price: 2 EUR}
processors: {p: {type: [two, one]}}
buses: {wire: {type: [can, serial]}}
threads: {t: {processor: p, period: 10 ms, compute_execution_time: 1 ms}, u: {period: 10 ms}}
connections: {c: {from: t, to: u, data_size: 8 B, bus: wire}}
flows: {f: {path: [t, u]}}
rules: [RULE]
requirements: [utilisation of p <= 100 %, load of wire <= 100 %]
objectives: [minimise latency of f, minimise price, maximise load of wire]
"""


@pytest.mark.parametrize(
    ("rule", "designs"),
    [("p.cores >= 1", 3 * 5), ("p.cores >= 2", 2 * 5), ("p.cores == 1", 5), ("wire.overhead == 0 B", 3),
     ("wire.transmission_time.fixed != 2 ms", 3 * 3), ("wire.transmission_time.per_byte == 0 ns", 3 * 4)],
)  # fmt: skip
def test_a_default_is_no_option_and_rules_know_it(rule: str, designs: int) -> None:
    """A type that does not state a field leaves nothing to decide; what it counts with is compared all the same."""
    space = space_of(DEFAULTS.replace("RULE", rule))
    options = {item.name: item.options for item in space.decisions if item.is_open}
    assert options == {
        "p.type": ("two", "one"), "p.cores": ("2", "4"), "wire.type": ("can", "serial"),
        "wire.transmission_time.fixed": ("1 ms", "2 ms"), "wire.overhead": ("1 B", "2 B"),
    }  # fmt: skip
    evaluator = Evaluator(space)
    assert sum(not item.breaches for item in evaluated(evaluator).values()) == designs
    found = search_front(evaluator, SearchLimits())
    assert found.is_complete and found.points == brute_front(evaluator)
    result = dse.solve(dse.loads(DEFAULTS.replace("RULE", rule)))
    for point in result.front:
        assert ("p.cores" in point.decisions) == (point.decisions["p.type"] == "two")
        assert ("wire.overhead" in point.decisions) == (point.decisions["wire.type"] == "can")


def test_a_default_cannot_be_chosen() -> None:
    problem = dse.loads(DEFAULTS.replace("RULE", "p.cores >= 1"))
    with pytest.raises(dse.UsageError, match=r"p\.cores is 1 only where a type does not state it.*options: 2, 4"):
        dse.solve(problem, fix="p.cores = 1")
