"""Messages that may have any identifier: places against every order, numbers, and what the search makes of them."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from itertools import combinations, permutations
from pathlib import Path
from random import Random

import pytest

import dse
from dse.analysis.messages.assignment import Candidate, assigned, is_in_time, tolerated_ns
from dse.analysis.messages.burdens import is_settled
from dse.analysis.scheduling.busy_window import Task, periodic
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.faults import faults_of_wire, with_frame
from dse.answers.ranking.reasons import Reasoner
from dse.cli.main import run
from dse.report.content.front.document import Document
from dse.report.content.front.first_screen import first_page
from dse.report.page import Table, Text
from dse.report.words.messages import identifier_words, late_message_words
from dse.report.words.reasons import sentences
from dse.space.architecture.arbitration import untraded_orders
from dse.support.errors import ProblemError
from tests.buses.test_messages import SYNC, car_bus
from tests.helpers.effort import cases

MOST = 2047


def draw(rng: Random, count: int, *, numbers: Sequence[int] = ()) -> list[Candidate]:
    """Messages of a bus that is rather full, in bits; the first ones have these numbers."""
    found = []
    for place in range(count):
        bits = rng.choice((55, 75, 95, 135))
        period = rng.randint(3, 12) * 100
        limit = rng.choice((None, period, period, period // 2 + 100))
        number = numbers[place] if place < len(numbers) else None
        task = periodic(str(place), bits, period, rng.choice((0, 0, 40)))
        found.append(Candidate(task, bits, bits, limit, number, rng.random() < 0.3))
    return found


def is_kept(found: Sequence[Candidate], order: Sequence[int], faults: Task | None = None) -> bool:
    """Whether all meet their deadlines in an order, as the analysis of buses has it, with stated numbers in theirs."""
    numbers = [number for place in order if (number := found[place].identifier) is not None]
    if numbers != sorted(numbers):
        return False
    for at, place in enumerate(order):
        own, behind = found[place], [found[other].section_ns for other in order[at + 1 :]]
        urgent = tuple(task for other in order[:at] if (task := found[other].task) is not None)
        assert own.task is not None
        hits = with_frame(faults, max(found[other].section_ns for other in order[: at + 1]))
        response = Arbitrated(own.task, urgent, max(behind, default=0), own.last_ns, 1, hits).response_ns()
        if own.limit_ns is not None and (response is None or response > own.limit_ns):
            return False
    return True


@pytest.mark.parametrize("seed", cases(120))
def test_an_order_that_meets_all_deadlines_is_found_if_there_is_one(seed: int) -> None:
    rng = Random(seed)
    found = draw(rng, rng.randint(2, 5), numbers=rng.sample(range(100, 2000, 50), rng.randint(0, 2)))
    faults = faults_of_wire(rng.randint(4, 20) * 100, rng.randint(1, 2), 1) if seed % 3 == 0 else None
    made = assigned(found, 1, MOST, faults=faults)
    exists = any(is_kept(found, order, faults) for order in permutations(range(len(found))))
    assert is_kept(found, made.order, faults) == exists == (not made.stuck)
    if made.stuck and not any(item.identifier is not None for item in found):
        blocked = max((found[at].section_ns for at in range(len(found)) if at not in made.stuck), default=0)
        for place in made.stuck:
            assert not is_in_time(found[place], [found[at] for at in made.stuck if at != place], blocked, 1, faults)


@pytest.mark.parametrize("seed", cases(60))
def test_numbers_are_in_order_and_stated_ones_stay(seed: int) -> None:
    """Also where stated ones leave little room: 0 is NMT of CANopen, before which there is none."""
    rng = Random(seed)
    found = draw(rng, rng.randint(2, 8), numbers=rng.sample(range(8), rng.randint(0, 4)))
    made = assigned(found, 1, 12)
    assert sorted(made.order) == list(range(len(found)))
    assert all(0 <= one < other <= 12 for one, other in combinations(made.identifiers, 2))
    for place, number in zip(made.order, made.identifiers, strict=True):
        assert found[place].identifier in (None, number)


DAVIS = """
dse: 1
name: deadlines that are periods
bus_types: {can: {bandwidth: 1 Mbit/s, frame: can}}
buses: {b: {type: can}}
devices: {sink: {}, d0: {period: 360 us}, d1: {period: 420 us}, d2: {period: 630 us}, d3: {period: 850 us}}
connections:
  m0: {from: d0, to: sink, port: data, bus: b, data_size: 4 B, deadline: 360 us, identifier: ANY0}
  m1: {from: d1, to: sink, port: data, bus: b, data_size: 8 B, deadline: 420 us, identifier: ANY1}
  m2: {from: d2, to: sink, port: data, bus: b, data_size: 0 B, deadline: 630 us, identifier: ANY2}
  m3: {from: d3, to: sink, port: data, bus: b, data_size: 8 B, deadline: 850 us, identifier: ANY3}
"""


def by(text: str, *identifiers: object) -> dict[str, tuple[int | None, object]]:
    """The identifier and response time, in us, of each message."""
    for place, identifier in enumerate(identifiers):
        text = text.replace(f"ANY{place}", str(identifier))
    return {item.name: (item.identifier, item.response_ns) for item in dse.analyse(dse.loads(text)).messages["b"]}


def test_canopens_default_connection_set() -> None:
    """A function code and a node are a number, also in rules and in what is fixed."""
    words = ("SYNC", "EMCY of node 1", "[TPDO1 of node 127, 0x182]", "RSDO of node 5")
    text = DAVIS
    for place, word in enumerate(words):
        text = text.replace(f"ANY{place}", word)
    rule = text + 'rules: ["m2.identifier = TPDO1 of node 127"]\n'
    fixed = dse.analyse(dse.loads(text), {"m2.identifier": "TPDO1 of node 2"})
    assert [item.identifier for item in dse.analyse(dse.loads(rule)).messages["b"]] == [0x80, 0x81, 0x1FF, 0x605]
    assert [item.identifier for item in fixed.messages["b"]] == [0x80, 0x81, 0x182, 0x605]


def test_deadlines_alone_do_not_tell_the_order() -> None:
    """By deadline the third one ends 20 us late; it goes before the second one."""
    assert [response for _, response in by(DAVIS, 1, 2, 3, 4).values()] == [230_000, 365_000, 650_000, 420_000]
    found = by(DAVIS, "any", "any", "any", "any")
    assert found == {"m0": (1, 230_000), "m2": (2, 285_000), "m1": (3, 420_000), "m3": (4, 420_000)}
    assert by(DAVIS, "0x10", "any", "any", "0x11")["m1"] == (0x13, 420_000)  # there is no number between the two


def test_flows_have_the_places_that_deadlines_leave() -> None:
    """The PDO of no deadline waits for the SYNC of the flow, whatever identifiers are open."""
    text = SYNC.replace("0x181", "any").replace("0x80", "any")
    assert [item.name for item in dse.analyse(dse.loads(text)).messages["can0"]] == ["sync", "pdo"]
    of_pdo = text.replace("[master, sync, drive]", "[other, pdo, drive]")
    assert [item.name for item in dse.analyse(dse.loads(of_pdo)).messages["can0"]] == ["pdo", "sync"]


STATED = """
dse: 1
name: a stated message on a flow
bus_types: {can: {bandwidth: 250 kbit/s, frame: can}}
buses: {b: {type: can}}
devices: {sink: {}, a: {period: 10 ms}, c: {period: 10 ms}, d: {period: 10 ms}}
connections:
  slow: {from: a, to: sink, port: data, data_size: 8 B, bus: b, identifier: 0x600}
  fast: {from: c, to: sink, port: data, data_size: 8 B, bus: b, identifier: any}
  other: {from: d, to: sink, port: data, data_size: 8 B, bus: b, identifier: 0x200}
flows: {f: {path: [a, slow, sink]}, g: {path: [c, fast, sink]}}
objectives: [minimise jitter of f, minimise jitter of g]
"""


def test_a_free_message_of_a_flow_goes_before_one_with_a_number_that_is_earlier_in_the_file() -> None:
    """It is most urgent, and does not wait for all that has lower numbers than the stated one; answers say so."""
    problem = dse.loads(STATED)
    assert [item.name for item in dse.analyse(problem).messages["b"]] == ["fast", "other", "slow"]
    assert any("another order of slow, fast, which" in text for text in untraded_orders(problem.space))
    stated = dse.loads(STATED.replace("identifier: any", "identifier: 0x100"))
    assert not list(untraded_orders(stated.space))


def test_the_public_cars_bus_has_an_order() -> None:
    found = dse.analyse(dse.loads(re.sub(r"identifier: \d+", "identifier: any", car_bus())))
    assert all(item.meets_deadline for item in found.messages["b"])


def robot(count: int, *, all_open: bool = False) -> str:
    """Messages with a third of the periods and of the identifiers (or all of these), and the bit rate open."""
    rng = Random(1)
    rates = ", ".join(
        f"can_{rate}: {{bandwidth: {rate} kbit/s, frame: can, price: {price} EUR}}"
        for rate, price in ((125, 1), (250, 3), (500, 6))
    )
    lines = ["dse: 1", "name: robot", f"bus_types: {{{rates}}}"]
    lines += ["buses: {b: {type: [can_125, can_250, can_500], overload: allowed}}", "devices:", "  sink: {}"]
    wires, before = ["connections:"], ["baseline:"]
    for one in range(count):
        period = rng.choice((10, 20, 20, 50, 100))
        lines.append(f"  d{one}: {{period: {f'[{period} ms, {2 * period} ms]' if one % 3 == 0 else f'{period} ms'}}}")
        own = hex(0x100 + 8 * one)
        is_open = all_open or one % 3 == 1
        identifier = f"[{own}, any]" if is_open else own
        sent = f"from: d{one}, to: sink, port: data, bus: b, data_size: {rng.choice((1, 2, 4, 8, 8))} B"
        wires.append(f"  m{one}: {{{sent}, identifier: {identifier}, deadline: {period} ms}}")
        before += [f"  m{one}: {{identifier: {own}}}"] if is_open else []
    return "\n".join([*lines, *wires, *before, "objectives: [minimise price, minimise changes]"])


def test_a_bus_with_periods_rates_and_identifiers_open() -> None:
    """40 messages: the price of the bit rate against identifiers that change, each design with all in time."""
    found = dse.solve(dse.loads(robot(40)), processing="execution_time")
    assert found.status == "complete"
    assert [tuple(point.objectives.values()) for point in found.front] == [(300, 4), (600, 0)]
    for point in found.front:
        messages = dse.analyse(dse.loads(robot(40)), point.decisions).messages["b"]
        assert all(item.meets_deadline for item in messages)
    assert not dse.verify(found).findings


def test_a_flow_over_a_bus_with_identifiers_open() -> None:
    """The price of the bit rate, identifiers that change, and the jitter of the last message's flow."""
    wanted = (
        "flows: {f: {path: [d19, m19, sink]}}\nobjectives: [minimise price, minimise changes, minimise jitter of f]"
    )
    found = dse.solve(
        robot(20).replace("objectives: [minimise price, minimise changes]", wanted), processing="execution_time"
    )
    assert found.status == "complete"
    assert {tuple(point.objectives.values()) for point in found.front} == {
        (100, 3, 18_000_000), (100, 4, 10_080_000), (300, 0, 7_560_000), (300, 1, 600_000), (600, 0, 3_780_000),
        (600, 1, 300_000),
    }  # fmt: skip
    assert not dse.verify(found).findings


def test_a_flow_over_one_of_40_messages() -> None:
    """What surely goes before a message bounds its wait, so that few orders are looked at."""
    wanted = (
        "flows: {f: {path: [d37, m37, sink]}}\nobjectives: [minimise price, minimise changes, minimise jitter of f]"
    )
    found = dse.solve(
        robot(40).replace("objectives: [minimise price, minimise changes]", wanted), processing="execution_time"
    )
    assert found.status == "complete"
    assert {tuple(point.objectives.values()) for point in found.front} == {
        (300, 4, 600_000), (600, 0, 8_050_000), (600, 1, 300_000),
    }  # fmt: skip


def test_a_flow_over_one_of_40_messages_that_may_all_have_any_identifier() -> None:
    """The front is proved, and verified: of 40 identifiers few are conditions of what a refused solution teaches."""
    wanted = (
        "flows: {f: {path: [d37, m37, sink]}}\nobjectives: [minimise price, minimise changes, minimise jitter of f]"
    )
    text = robot(40, all_open=True).replace("objectives: [minimise price, minimise changes]", wanted)
    found = dse.solve(text, processing="execution_time")
    assert found.status == "complete"
    assert {tuple(point.objectives.values()) for point in found.front} == {
        (300, 4, 600_000), (600, 0, 8_050_000), (600, 1, 300_000),
    }  # fmt: skip
    assert not dse.verify(found).findings


def test_a_flow_over_two_of_40_messages() -> None:
    """Who goes before either is learnt one message at a time: 23 points without a set of identifiers for each."""
    text = robot(40).replace("from: d37, to: sink", "from: d37, to: d38")
    wanted = "flows: {f: {path: [d37, m37, d38, m38, sink]}}\nobjectives: "
    wanted += "[minimise price, minimise changes, minimise jitter of f]"
    found = dse.solve(text.replace("objectives: [minimise price, minimise changes]", wanted))
    assert found.status == "complete"
    least = {tuple(point.objectives.values()) for point in found.front}
    assert len(least) == 23
    assert {(300, 4, 119_108_000), (300, 12, 116_068_000), (600, 0, 116_274_000), (600, 13, 106_004_000)} <= least


def test_the_jitter_of_a_message_may_hang_on_another_through_threads_on_its_way() -> None:
    """A message that waits dispatches a thread, and this the sender of another message: not where a timer sends it."""
    lines = ["dse: 1", "name: through", "processing: execution_time", "processor_types: {c: {}}"]
    lines += ["bus_types: {can: {bandwidth: 250 kbit/s, frame: can}}", "buses: {b: {type: can}}"]
    lines += ["processors: {p: {type: c}}", "devices: {d: {period: 5 ms}, sink: {}}", "threads:"]
    lines += [f"  t{one}: {{processor: p, dispatch_protocol: aperiodic}}" for one in (0, 1)]
    sent = "bus: b, data_size: 8 B, identifier"
    lines += ["connections:", f"  m0: {{from: d, to: t0, {sent}: 1}}", "  c: {from: t0, to: t1}"]
    text = "\n".join([*lines, f"  m1: {{from: t1, to: sink, {sent}: 2}}"])
    timed = text.replace("  t1: {processor: p, dispatch_protocol: aperiodic}", "  t1: {processor: p, period: 5 ms}")
    assert [is_settled(dse.loads(one).ask().space) for one in (text, timed)] == [False, True]


def test_chosen_numbers_beside_those_of_the_baseline_in_explanations_and_exports() -> None:
    """A message whose baseline has 0x90 goes right before 0x60: its deadline leaves it no later place."""
    text = DAVIS.replace("ANY0", "[0x90, any]").replace("ANY1", "0x60").replace("ANY2", "0x70").replace("ANY3", "0x80")
    text = text.replace("data_size: 0 B, deadline: 630 us", "data_size: 0 B, deadline: 700 us")
    text += "baseline: {m0: {identifier: 0x90}}\nobjectives: [minimise changes]\n"
    found = dse.solve(dse.loads(text))
    (point,) = found.front
    assert point.decisions == {"m0.identifier": "any"}
    assert identifier_words(found.space, point.design) == ["m0 0x5f (0x90 in the baseline)"]
    page = first_page(Document(found))
    said = [block.text for section in page.sections for block in section.blocks if isinstance(block, Text)]
    assert "  Identifiers  m0 0x5f (0x90 in the baseline)" in said
    told = sentences(found, Reasoner(found).reasons(0))
    assert [item.text for item in told if item.label == "Chosen identifiers"] == ["m0 0x5f (0x90 in the baseline)."]
    assert "#   m0: 0x5f" in dse.export(found, 1)


@pytest.mark.parametrize(("edit", "said"), [("0x181", "identifier: anything"), ("0x181", "identifier: [any, any]")])
def test_mistakes(edit: str, said: str) -> None:
    with pytest.raises(ProblemError):
        dse.loads(SYNC.replace(f"identifier: {edit}", said))


def test_a_chosen_identifier_is_played() -> None:
    text = SYNC.replace("0x181", "any").replace("0x80", "any")
    assert not dse.simulate(dse.loads(text), runs=5).contradictions


def test_a_late_message_is_told_with_what_goes_before_it_and_an_identifier_that_would_do() -> None:
    """0.54 ms each at 250 kbit/s, due after 2 ms: late behind three others, in time behind one and a frame begun."""
    lines = ["dse: 1", "name: late", "bus_types: {can: {bandwidth: 250 kbit/s, frame: can, price: 1 EUR}}"]
    lines += ["buses: {b: {type: can}}", "devices:", "  sink: {}", *(f"  d{one}: {{period: 5 ms}}" for one in range(4))]
    lines.append("connections:")
    for one in range(4):
        deadline = ", deadline: 2 ms" if one == 3 else ""
        sent = f"from: d{one}, to: sink, port: data, bus: b, data_size: 8 B{deadline}"
        lines.append(f"  m{one}: {{{sent}, identifier: {16 + 2 * one}}}")
    found = dse.explain("\n".join([*lines, "objectives: [minimise price]"]))
    (late,) = found.conflicts[0].members[0][1].late_messages
    assert (late.message.name, late.late_ns, late.before, late.identifier) == ("m3", 160_000, "m1", 17)
    assert [(item.name, item.work_ns) for item in late.message.interference] == [
        (name, 540_000) for name in ("m0", "m1", "m2")
    ]
    said = "m3 (0x16) ends 0.16 ms late on b: 0.54 ms of its own"
    assert late_message_words(late).startswith(said)
    assert late_message_words(late).endswith("in time right before m1, with 0x11 for example")


@pytest.mark.parametrize("seed", cases(60))
def test_no_other_order_lets_the_least_tolerant_message_tolerate_more(seed: int) -> None:
    """The robust order: of all orders in which all are in time the one with the greatest least tolerance."""
    rng = Random(seed)
    found = draw(rng, rng.randint(2, 5))
    faults = faults_of_wire(rng.randint(8, 20) * 100, 1, 1) if seed % 3 == 0 else None

    def tolerance(order: Sequence[int]) -> int | None:
        """What the least tolerant message of an order tolerates; None where one is late."""
        least = 10**9
        for at, place in enumerate(order):
            if found[place].limit_ns is None:
                continue
            behind = max((found[other].section_ns for other in order[at + 1 :]), default=0)
            one = tolerated_ns(found[place], [found[other] for other in order[:at]], behind, 1, faults, 0)
            if one is None:
                return None
            least = min(least, one)
        return least

    made = assigned(found, 1, MOST, faults=faults, rule="robust")
    known = [tolerance(order) for order in permutations(range(len(found)))]
    assert tolerance(made.order) == max((one for one in known if one is not None), default=None)
    assert bool(made.stuck) == all(one is None for one in known)


def test_the_deadline_monotonic_order_is_by_deadlines_alone() -> None:
    """Of Davis' four messages the third is late by that, and in time in the robust order, as in Audsley's."""
    text = DAVIS.replace("b: {type: can}", "b: {type: can, assignment: RULE}")
    anys = ["any"] * 4
    by_deadline = by(text.replace("RULE", "deadline_monotonic"), *anys)
    assert [by_deadline[f"m{one}"][0] for one in range(4)] == [1, 2, 3, 4]
    assert by_deadline["m2"][1] == 650_000
    robust = by(text.replace("RULE", "robust"), *anys)
    assert all(item[1] <= limit * 1000 for item, limit in zip(robust.values(), (360, 420, 630, 850), strict=True))  # type: ignore[operator]
    assert robust == by(text.replace("RULE", "audsley"), *anys)


def test_a_rule_needs_messages_that_it_may_place() -> None:
    text = DAVIS.replace("b: {type: can}", "b: {type: can, assignment: robust}")
    text = re.sub(r", identifier: ANY\d", "", text)
    with pytest.raises(ProblemError, match="no message on this bus states an identifier"):
        dse.loads(text)


def test_the_robust_order_in_the_search() -> None:
    """The bit rate is open; each design has its own robust order, and the second proof agrees."""
    text = DAVIS.replace("{bandwidth: 1 Mbit/s, frame: can}", "{bandwidth: [1 Mbit/s, 900 kbit/s], frame: can}")
    text = text.replace("b: {type: can}", "b: {type: can, assignment: robust}")
    for place in range(4):
        text = text.replace(f"ANY{place}", "any")
    text += "flows: {f: {path: [d2, m2, sink]}}\nobjectives: [minimise latency of f, minimise response time of m3]\n"
    result = dse.solve(dse.loads(text))
    assert result.front
    assert not dse.verify(result).findings


@pytest.mark.parametrize("seed", cases(6, 60))
def test_an_identifier_that_is_named_makes_a_flow_as_fast_as_is_said(seed: int) -> None:
    """The least urgent place that is enough: the flow keeps its limit there, and not right behind that message."""
    rng = Random(seed)
    count = rng.randint(3, 6)
    lines = ["dse: 1", "name: flow", "bus_types: {can: {bandwidth: 125 kbit/s, frame: can}}", "buses: {b: {type: can}}"]
    lines += [
        "devices:",
        "  sink: {}",
        *(f"  d{one}: {{period: {rng.choice([10, 20, 50])} ms}}" for one in range(count)),
    ]
    lines += ["connections:"]
    for one in range(count):
        size = rng.randint(1, 8)
        lines += [
            f"  m{one}: {{from: d{one}, to: sink, port: data, data_size: {size} B, bus: b, identifier: {8 * one + 8}}}"
        ]
    number = rng.randint(1, count - 1)
    lines += [f"flows: {{f: {{path: [d{number}, m{number}, sink]}}}}"]
    text = "\n".join(lines)
    problem = dse.loads(text)
    latency = int(dse.analyse(problem).metrics["latency of f"])
    limit = latency - rng.randint(1, latency // 2)
    found = dse.explain(problem, require=[f"latency of f <= {limit} ns"])
    (late,) = found.conflicts[0].members[0][1].late_messages
    assert late.flow.startswith("latency of f <= ") and late.late_ns == latency - limit
    own = f"identifier: {8 * number + 8}}}"
    kept = [
        one
        for one in range(number)
        if int(dse.analyse(dse.loads(text.replace(own, f"identifier: {8 * one + 7}}}"))).metrics["latency of f"])
        <= limit
    ]
    assert late.before == (f"m{kept[-1]}" if kept else None)
    assert late.identifier == (8 * kept[-1] + 7 if kept else None)
    said = late_message_words(late)
    assert f"m{number} ({8 * number + 8:#x}) waits " in said and ("right before" in said) == bool(kept)


TWO_FLOWS = """
dse: 1
name: two flows that would trade
bus_types: {can: {bandwidth: 125 kbit/s, frame: can}}
buses: {can0: {type: can}}
devices: {a: {period: 10 ms}, b: {period: 10 ms}, c: {period: 10 ms}, sink: {}}
connections:
  ma: {from: a, to: sink, port: data, data_size: 8 B, bus: can0, identifier: any}
  mb: {from: b, to: sink, port: data, data_size: 4 B, bus: can0, identifier: any}
  mc: {from: c, to: sink, port: data, data_size: 8 B, bus: can0, identifier: any}
flows: {fa: {path: [a, ma, sink]}, fb: {path: [b, mb, sink]}}
objectives: [minimise jitter of fa, minimise jitter of fb]
"""


def test_answers_say_which_orders_of_messages_of_flows_are_left_out() -> None:
    """With any identifier there is one design; with three listed ones for each message a second is found."""
    said = "with another order of ma, mb, which could trade between flows, are left out"
    problem = dse.loads(TWO_FLOWS)
    assert any(said in text for text in dse.check(problem).remarks)
    assert [point.objectives["jitter of fb"] for point in dse.solve(problem).front] == [2_312_000]
    refused = dse.explain(problem, require=["jitter of fb <= 2 ms"])
    assert refused.status == "infeasible" and any(said in text for text in refused.excluded)
    listed = dse.loads(TWO_FLOWS.replace("identifier: any", "identifier: [1, 2, 3]"))
    assert not any("are left out" in text for text in dse.check(listed).remarks)
    assert sorted(point.objectives["jitter of fb"] for point in dse.solve(listed).front) == [1_232_000, 2_312_000]
    alone = dse.loads(TWO_FLOWS.replace(", minimise jitter of fb", ""))
    assert not any("are left out" in text for text in dse.check(alone).remarks)


CHOSEN = """
dse: 1
name: Bus
processor_types: {small: {cores: 1}}
bus_types: {can_125k: {bandwidth: 125 kbit/s, frame: can}}
processors: {one: {type: small}, other: {type: small}}
buses: {can0: {type: can_125k}}
devices: {motor: {period: 1 ms}}
threads:
  speed: {processor: one, period: 10 ms, compute_execution_time: 1 ms}
  state: {processor: one, period: 20 ms, compute_execution_time: 1 ms}
  limit: {processor: other, period: [10 ms, 20 ms], compute_execution_time: 1 ms}
connections:
  wanted: {from: speed, to: motor, data_size: 8 B, bus: can0, identifier: any}
  seen: {from: state, to: motor, data_size: 8 B, bus: can0, identifier: any}
  most: {from: limit, to: motor, data_size: 8 B, bus: can0, identifier: 0x10}
flows: {speed_to_motor: {path: [speed, motor]}}
objectives: [minimise jitter of speed_to_motor]
"""


def test_a_result_has_the_identifiers_of_its_designs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bus.yaml").write_text(CHOSEN, encoding="utf-8")
    assert run(["solve", "bus.yaml", "--json", "result.json"]) == 0
    assert re.search(r"^  Identifiers  wanted 0xf, seen 0x11$", capsys.readouterr().out, re.MULTILINE)
    data = json.loads(Path("result.json").read_text(encoding="utf-8"))
    (design,) = data["front"]
    assert design["identifiers"] == {"wanted": "0xf", "seen": "0x11"}
    told = dse.analyse("bus.yaml", design["decisions"]).messages["can0"]
    assert [(item.name, item.identifier) for item in told] == [("wanted", 0xF), ("most", 0x10), ("seen", 0x11)]
    assert run(["verify", "result.json"]) == 0
    design["identifiers"]["wanted"] = "0x3"
    Path("forged.json").write_text(json.dumps(data), encoding="utf-8")
    assert run(["verify", "forged.json"]) == 4
    capsys.readouterr()
    assert run(["report", "forged.json"]) == 2
    assert "alternative 1 has other identifiers than the result says" in capsys.readouterr().err


TRADED = """
dse: 1
name: traded
bus_types:
  fast: {bandwidth: 500 kbit/s, frame: can, price: 5 EUR}
  slow: {bandwidth: 125 kbit/s, frame: can, price: 1 EUR}
buses: {can0: {type: [slow, fast]}}
devices: {sink: {}, a: {period: 10 ms}, b: {period: 5 ms}}
connections:
  m1: {from: a, to: sink, port: data, data_size: 8 B, bus: can0, identifier: 0x100}
  m2: {from: b, to: sink, port: data, data_size: 8 B, bus: can0, identifier: [0x200, any], deadline: 2200 us}
  m3: {from: a, to: sink, port: data, data_size: 8 B, bus: can0, identifier: 0x150}
baseline: {m2: {identifier: 0x200}}
objectives: [minimise price, minimise changes]
"""


def test_tables_have_the_number_of_a_message_that_takes_a_free_identifier() -> None:
    """By the slow bus m2 (1.08 ms) may wait for one frame that has begun: it goes right before 0x100."""
    found = dse.solve(dse.loads(TRADED))
    assert sorted(point.decisions["m2.identifier"] for point in found.front) == ["0x200", "any"]
    document = Document(found)
    assert sorted(row[-1] for row in document.front_table.rows) == ["0x200", "any (0xff)"]
    screen = [
        block for section in first_page(document).sections for block in section.blocks if isinstance(block, Table)
    ]
    assert {"any (0xff)", "0x200"} <= {cell for row in screen[0].rows for cell in row}
    assert {line.rpartition(",")[2] for line in found.to_csv().splitlines()[1:]} == {"0x200", "0xff"}


def test_explain_says_why_no_design_has_an_identifier() -> None:
    """0x150 is that of m3: fixed by the caller it leaves no valid design, whatever the limits."""
    text = TRADED.replace("[0x200, any]", "[0x200, 0x150]")
    found = dse.explain(dse.loads(text), fix=["m2.identifier = 0x150"])
    (item,) = found.relaxations
    assert item.example is not None
    assert item.example.conditions == ("m2 and m3 have different identifiers",)
    ruled = dse.loads(text + "rules: [m2.identifier == 0x200]")
    (item, *_) = dse.explain(ruled, fix=["m2.identifier = 0x150", "can0 = slow"]).relaxations
    assert item.example is not None
    assert not [text for text in item.example.conditions if "==" in text]
