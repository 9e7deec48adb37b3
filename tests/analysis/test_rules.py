"""Rules between decisions: Kleene's three-valued logic, and what each kind of test means."""

from __future__ import annotations

from itertools import product

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.validity import is_broken, truth
from dse.analysis.views import View
from dse.space.model.criteria import ValueTest
from dse.space.model.space import Space
from dse.space.question.rules import read_rule
from dse.spec.language.expressions import And, Not, Or
from tests.helpers.small import design_of, space_of, view_of

TRUE, FALSE, UNKNOWN = True, False, None
VALUES = (TRUE, FALSE, UNKNOWN)
NOWHERE = View(())


def atom(value: bool | None) -> ValueTest:
    """A test whose outcome is known without any decision."""
    return ValueTest({TRUE: 1, FALSE: 2, UNKNOWN: None}[value], "==", 1)


def test_atoms() -> None:
    assert [truth(atom(value), NOWHERE) for value in VALUES] == list(VALUES)


def test_not() -> None:
    assert [truth(Not(atom(value)), NOWHERE) for value in VALUES] == [FALSE, TRUE, UNKNOWN]


def kleene_and(left: bool | None, right: bool | None) -> bool | None:
    """False if either is false, else unknown if either is unknown."""
    if left is FALSE or right is FALSE:
        return FALSE
    return UNKNOWN if left is UNKNOWN or right is UNKNOWN else TRUE


@pytest.mark.parametrize(("left", "right"), list(product(VALUES, VALUES)))
def test_and_or(left: bool | None, right: bool | None) -> None:
    assert truth(And((atom(left), atom(right))), NOWHERE) is kleene_and(left, right)
    dual = kleene_and(*(None if value is None else not value for value in (left, right)))
    assert truth(Or((atom(left), atom(right))), NOWHERE) is (None if dual is None else not dual)


@pytest.mark.parametrize("values", list(product(VALUES, VALUES, VALUES)))
def test_three_operands(values: tuple[bool | None, ...]) -> None:
    expected = kleene_and(kleene_and(values[0], values[1]), values[2])
    assert truth(And(tuple(atom(value) for value in values)), NOWHERE) is expected


ROBOT = """
    processor_types: {slow: {}, fast: {}}
    bus_types: {can: {}, eth: {}}
    processors: {one: {type: [slow, fast]}, spare: {type: slow, optional: true}}
    buses: {wire: {type: [can, eth]}}
    threads:
      nav: {processor: [one, spare], dispatch_protocol: [periodic, aperiodic], period: [10 ms, 20 ms, 30 ms]}
      act: {processor: one, period: [5 ms, 10 ms, 20 ms]}
    connections: {x: {from: act, to: nav, data_size: 8 B, bus: wire}}
    """


def outcome(rule: str, **options: str) -> bool | None:
    """The truth of a rule's condition; options are written ``nav_period="10 ms"``."""
    space = space_of(ROBOT)
    return truth(read_rule(space, rule).condition, view_of(space, named(options)))


def named(options: dict[str, str]) -> dict[str, str]:
    return {name.replace("_", ".", 1): text for name, text in options.items()}


@pytest.mark.parametrize(
    ("rule", "holds"),
    [
        ("nav.period == 20 ms", {"20 ms"}),
        ("nav.period == 0.02 s", {"20 ms"}),
        ("nav.period != 20 ms", {"10 ms", "30 ms"}),
        ("nav.period < 20 ms", {"10 ms"}),
        ("nav.period <= 15 ms", {"10 ms"}),
        ("nav.period >= 20 ms", {"20 ms", "30 ms"}),
        ("nav.period > 30 ms", set()),
        ("nav.period in [10 ms, 30 ms]", {"10 ms", "30 ms"}),
        ("nav.period not in [10 ms, 30 ms]", {"20 ms"}),
        ("not nav.period == 20 ms", {"10 ms", "30 ms"}),
    ],
)
def test_comparisons(rule: str, holds: set[str]) -> None:
    for period in ("10 ms", "20 ms", "30 ms"):
        assert outcome(rule, nav_dispatch_protocol="periodic", nav_period=period) is (period in holds)
        assert outcome(rule, nav_dispatch_protocol="aperiodic", nav_period=period) is UNKNOWN


@pytest.mark.parametrize("nav", ["10 ms", "20 ms", "30 ms"])
@pytest.mark.parametrize("act", ["5 ms", "10 ms", "20 ms"])
def test_pairs_and_multiples(nav: str, act: str) -> None:
    periods = int(nav.split()[0]), int(act.split()[0])
    options = {"nav_dispatch_protocol": "periodic", "nav_period": nav, "act_period": act}
    assert outcome("nav.period == act.period", **options) is (periods[0] == periods[1])
    assert outcome("nav.period > act.period", **options) is (periods[0] > periods[1])
    assert outcome("nav.period is a multiple of act.period", **options) is (periods[0] % periods[1] == 0)
    options["nav_dispatch_protocol"] = "aperiodic"
    assert outcome("nav.period is a multiple of act.period", **options) is UNKNOWN


def test_types_and_slots_that_are_used() -> None:
    assert outcome("fast", one_type="fast") is TRUE
    assert outcome("fast", one_type="slow") is FALSE
    assert outcome("slow", one_type="fast", spare_type="none") is FALSE
    assert outcome("slow", one_type="fast", spare_type="slow") is TRUE
    assert outcome("spare", spare_type="slow") is TRUE
    assert outcome("spare", spare_type="none") is FALSE
    assert outcome("spare.type == none", spare_type="none") is TRUE
    assert outcome("nav.processor == spare", nav_processor="spare") is TRUE


def test_implications() -> None:
    for one, wire in product(("slow", "fast"), ("can", "eth")):
        for rule in ("fast requires eth", "fast implies wire.type == eth", "if fast then eth"):
            assert outcome(rule, one_type=one, wire_type=wire) is (one != "fast" or wire == "eth")


def broken(rule: str, options: dict[str, str]) -> bool:
    space = space_of(ROBOT)
    return is_broken(read_rule(space, rule), view_of(space, options))


def test_require_is_broken_only_by_false_and_forbid_only_by_true() -> None:
    periodic = {"nav.dispatch_protocol": "periodic", "nav.period": "10 ms"}
    aperiodic = {"nav.dispatch_protocol": "aperiodic"}
    for verb, other in (("require", "forbid"), ("forbid", "require")):
        assert broken(f"{verb} nav.period == 10 ms", periodic) is (verb == "forbid")
        assert broken(f"{verb} nav.period == 20 ms", periodic) is (other == "forbid")
        assert not broken(f"{verb} nav.period == 10 ms", aperiodic)


def test_broken_rules_are_named() -> None:
    rule = "require nav.period is a multiple of act.period"
    space: Space = space_of(ROBOT + f"rules: [{rule}]")
    evaluator = Evaluator(space)
    options = {"nav.dispatch_protocol": "periodic", "nav.period": "10 ms", "spare.type": "none", "nav.processor": "one"}
    assert evaluator.invalid(design_of(space, {**options, "act.period": "5 ms"})) == []
    assert evaluator.invalid(design_of(space, {**options, "act.period": "20 ms"})) == [rule]
