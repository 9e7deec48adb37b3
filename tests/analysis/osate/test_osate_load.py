"""OSATE's budgets of buses: what is required, and its verdicts, with the sums by hand."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.answers.analysis import Usage

HEAD = "dse: 1\nname: budgets\nprofile: osate-2.19\n"
TEXT = """
bus_types: {w: {bandwidth: 64 KB/s, broadcast: SHARED}, v: {virtual: true}}
buses: {w: {type: w, budget: OWN}, v: {type: v, bus: w, budget: 5 KB/s}}
devices: {s: {period: 1 ms}, d: {}, e: {}}
connections:
  a: {from: s, to: d, data_size: 2 B, bus: w, budget: 3 KB/s, from_port: o}
  b: {from: s, to: e, data_size: 2 B, bus: w, budget: 4 KB/s, from_port: o}
  c: {from: s, to: e, data_size: 7 B, bus: v, budget: 6 KB/s}
"""


def buses(own: str, shared: str) -> dict[str, Usage]:
    found = dse.analyse(dse.loads(HEAD + TEXT.replace("OWN", own).replace("SHARED", shared)))
    return {item.name: item for item in found.buses}


def said(usage: Usage) -> list[str]:
    assert usage.budget is not None
    return [f"{item.severity}: {item.text}" for item in usage.budget.findings]


@pytest.mark.parametrize(
    ("shared", "required", "actual"),
    [
        # v's own budget 5 (not that of what v carries), and 3 and 4; 2 B, 2 B and 7 B each ms
        ("false", 12, 11),
        # a and b leave one port: the larger budget, and one message
        ("true", 9, 9),
    ],
)
def test_the_required_budget(shared: str, required: int, actual: int) -> None:
    found = buses("20 KB/s", shared)
    assert found["w"].budget is not None and found["v"].budget is not None
    assert (found["w"].budget.stated, found["w"].budget.required) == (20000, required * 1000)
    assert found["w"].total == Fraction(actual * 1000)
    assert (found["v"].budget.required, found["v"].total) == (6000, 7000)
    unequal = "warning: a, b are one message on w and have unequal budgets"
    assert (unequal in said(found["w"])) == (shared == "true")


def test_the_verdicts() -> None:
    within, above = buses("20 KB/s", "false"), buses("8 KB/s", "false")
    assert said(within["w"]) == []
    assert said(within["v"]) == [
        "error: c sends 7 KB/s, more than its budget of 6 KB/s",
        "warning: v has no bandwidth",
        "error: the budgets of what is bound to v, 6 KB/s together, exceed its budget of 5 KB/s",
    ]
    together = "error: the budgets of what is bound to w, 12 KB/s together"
    assert said(above["w"]) == [f"{together}, exceed its budget of 8 KB/s"]
    beyond = buses("65 KB/s", "false")["w"]
    assert said(beyond) == ["error: the budget of w, 65 KB/s, exceeds its bandwidth of 64 KB/s"]


def test_what_states_no_budget_is_told_where_others_do() -> None:
    text = HEAD + TEXT.replace("OWN", "20 KB/s").replace("SHARED", "false").replace(", budget: 3 KB/s", "")
    assert "warning: a has no budget" in said(dse.analyse(dse.loads(text)).buses[0])
    assert dse.analyse(dse.loads(text.replace("osate-2.19", "dse"))).buses[0].budget is None
