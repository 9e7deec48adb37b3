"""Rules about types of the catalogues that no slot offers (any more)."""

from __future__ import annotations

import pytest
from support import brute_front, space_of

import dse
from dse.analysis.evaluate import Evaluator
from dse.pareto.front import Budget, search_front

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
    found = search_front(evaluator, Budget())
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
    with pytest.raises(dse.ProblemError, match=r'p\.type is never "wire"'):
        dse.loads(TEXT.replace("RULE", "p.type == wire"))
    with pytest.raises(dse.ProblemError, match='unknown name "odl"'):
        dse.loads(TEXT.replace("RULE", "forbid odl"))
