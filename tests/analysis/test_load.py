"""Sections 5 and 6 of the semantics: bus loads in B/s, prices and powers, slots that may stay empty."""

from __future__ import annotations

from fractions import Fraction

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import load_terms
from tests.helpers.small import design_of, figure, space_of, view_of


def load_space(connections: str) -> str:
    return f"""
    bus_types:
      can: {{bandwidth: 125 kbit/s, overhead: 4 B}}
      ip: {{virtual: true, overhead: 40 B}}
    buses: {{wire: {{type: can}}, other: {{type: can}}, stack: {{type: ip, bus: [wire, other]}}}}
    devices: {{eye: {{period: 50 ms}}}}
    threads:
      see: {{period: [10 ms, 100 ms], process: p}}
      plan: {{dispatch_protocol: aperiodic, process: [p, q]}}
    connections: {{{connections}}}
    """


def test_size_and_overhead_times_rate() -> None:
    """(8 + 4) B * 20 Hz."""
    assert figure(space_of(load_space("x: {from: eye, to: see, data_size: 8 B, bus: wire}")), "load of wire") == 240


def test_the_rate_follows_from_decisions_upstream() -> None:
    space = space_of(load_space("x: {from: eye, to: see}, y: {from: see, data_size: 8 B, bus: wire}"))
    assert figure(space, "load of wire", {"see.period": "10 ms"}) == 12 * 100
    assert figure(space, "load of wire", {"see.period": "100 ms"}) == 12 * 10


def test_a_stated_data_rate_is_the_load() -> None:
    """No overhead is added to what is stated; a rate is another thing: 12 B * 5 Hz."""
    space = space_of(
        load_space(
            "x: {from: eye, data_rate: 0.1 KB/s, bus: wire}, y: {from: eye, data_size: 8 B, rate: 5 Hz, bus: wire},"
            "z: {from: eye, data_size: 8 B, data_rate: 100/3 B/s, bus: other}"
        )
    )
    terms = {term.label: term.value(view_of(space)) for term in load_terms(space, 0)}
    assert terms == {"x": 100, "y": 60}
    assert figure(space, "load of wire") == 160
    assert figure(space, "load of other") == Fraction(100, 3)


def test_every_carrier_of_a_stack_carries_all_overheads() -> None:
    """(8 + 40 + 4) B * 20 Hz on the virtual bus and on the bus that carries it."""
    space = space_of(load_space("x: {from: eye, to: see, data_size: 8 B, bus: stack}"))
    for carrier, other in (("wire", "other"), ("other", "wire")):
        options = {"stack.bus": carrier}
        assert figure(space, "load of stack", options) == figure(space, f"load of {carrier}", options) == 52 * 20
        assert figure(space, f"load of {other}", options) == 0


def test_connections_inside_a_process_are_free() -> None:
    space = space_of(load_space("x: {from: see, to: plan, data_size: 8 B, bus: wire}"))
    assert figure(space, "load of wire", {"plan.process": "p", "see.period": "10 ms"}) == 0
    assert figure(space, "load of wire", {"plan.process": "q", "see.period": "10 ms"}) == 1200


def test_a_connection_takes_the_bus_that_is_chosen() -> None:
    space = space_of(load_space("x: {from: eye, to: see, data_size: 8 B, bus: [wire, other]}"))
    for bus, other in (("wire", "other"), ("other", "wire")):
        assert figure(space, f"load of {bus}", {"x.bus": bus}) == 240
        assert figure(space, f"load of {other}", {"x.bus": bus}) == 0


# --- price, power, totals, empty slots ----------------------------------------------------------------------------

SHOP = """
    totals: {mass: g}
    processor_types:
      small: {price: 150.50 EUR, power: 5 W, totals: {mass: 90.5 g}}
      large: {price: 900 EUR, power: 35 W, totals: {mass: 1/3 g}}
    bus_types: {can: {price: 20 EUR, bandwidth: 1 KB/s}, eth: {price: 120 EUR, power: 3 W}}
    device_types: {cheap: {price: 1 EUR, period: 50 ms}, dear: {price: [2 EUR, 3 EUR], period: 10 ms}}
    processors: {one: {type: [small, large]}, spare: {type: small, optional: true}}
    buses: {wire: {type: can}, line: {type: eth, optional: true}}
    devices: {eye: {type: [cheap, dear]}, ear: {power: 250 mW}}
    threads: {see: {processor: [one, spare], period: 10 ms}}
    connections: {x: {from: eye, to: see, data_size: 8 B, bus: [wire, line]}}
    """
BUILT = {"one.type": "small", "spare.type": "none", "line.type": "none", "see.processor": "one", "x.bus": "wire"}


@pytest.mark.parametrize(
    ("changes", "cents", "milliwatts"),
    [
        ({}, 15050 + 2000 + 100, 5000 + 250),
        ({"one.type": "large"}, 90000 + 2000 + 100, 35000 + 250),
        ({"spare.type": "small", "see.processor": "spare"}, 2 * 15050 + 2000 + 100, 2 * 5000 + 250),
        ({"line.type": "eth", "x.bus": "line"}, 15050 + 2000 + 12000 + 100, 5000 + 3000 + 250),
        ({"eye.type": "dear", "eye.price": "3 EUR"}, 15050 + 2000 + 300, 5000 + 250),
    ],
)
def test_totals_are_sums_of_the_chosen_types(changes: dict[str, str], cents: int, milliwatts: int) -> None:
    space, options = space_of(SHOP), {**BUILT, "eye.type": "cheap", **changes}
    assert Evaluator(space).invalid(design_of(space, options)) == []
    assert figure(space, "price", options) == cents
    assert figure(space, "power", options) == milliwatts


def test_totals_of_a_component_and_declared_totals() -> None:
    space = space_of(SHOP)
    assert figure(space, "price of wire", BUILT) == 2000
    assert figure(space, "power of ear", BUILT) == 250
    assert figure(space, "mass", BUILT) == Fraction(181, 2)
    assert figure(space, "mass", {**BUILT, "one.type": "large"}) == Fraction(1, 3)


def test_a_coupled_decision_moves_price_and_period_together() -> None:
    space = space_of(SHOP)
    assert figure(space, "load of wire", {**BUILT, "eye.type": "cheap"}) == 8 * 20
    assert figure(space, "load of wire", {**BUILT, "eye.type": "dear"}) == 8 * 100


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"see.processor": "spare"}, "empty slot spare"),
        ({"x.bus": "line"}, "empty slot line"),
        ({"spare.type": "small"}, "optional slot spare"),
        ({"line.type": "eth"}, "optional slot line"),
    ],
)
def test_an_optional_slot_is_empty_exactly_when_nothing_is_bound_to_it(changes: dict[str, str], words: str) -> None:
    space = space_of(SHOP)
    [breach] = Evaluator(space).invalid(design_of(space, {**BUILT, **changes}))
    assert words in breach


def test_an_option_that_the_type_does_not_offer_is_no_design() -> None:
    """Both types may have this price; the figure of a type that offers no alternatives is fixed."""
    space = space_of(SHOP.replace("cheap: {price: 1 EUR", "cheap: {price: [1 EUR, 2 EUR]"))
    evaluator = Evaluator(space)
    for kind, price, is_valid in (
        ("cheap", "1 EUR", True), ("cheap", "2 EUR", True), ("cheap", "3 EUR", False),
        ("dear", "1 EUR", False), ("dear", "2 EUR", True), ("dear", "3 EUR", True),
    ):  # fmt: skip
        design = design_of(space, {**BUILT, "eye.type": kind, "eye.price": price})
        assert (evaluator.invalid(design) == []) == is_valid, (kind, price)
