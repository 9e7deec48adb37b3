"""OSATE's rules on a few components, with the arithmetic shown; sources as in docs/semantics.md, section 3.7."""

from __future__ import annotations

from fractions import Fraction

import pytest

import dse
from dse.space.question.settings import OSATE_WORDS, osate_settings
from tests.helpers.small import MS, figure, rows_of, space_of

WORK = "compute_execution_time: 1 ms .. 2 ms"
HEAD = "processor_types: {cpu: {}}\nprocessors: {p: {type: cpu}, q: {type: cpu}}\n"


def totals(body: str, **changes: str) -> tuple[Fraction, Fraction]:
    """Minimum and maximum of flow f in ms."""
    space = space_of(HEAD + body, **{"profile": "osate-2.19", **changes})
    return tuple(figure(space, f"{kind} of f") / MS for kind in ("min latency", "latency"))  # type: ignore[return-value]


def pair(sender: str, receiver: str, wire: str = "", more: str = "", **changes: str) -> tuple[Fraction, Fraction]:
    """Two threads and a data connection."""
    return totals(
        f"""
{more}
threads:
  a: {{{sender}}}
  b: {{{receiver}}}
connections: {{c: {{from: a, to: b, port: data, data_size: 8 B{wire}}}}}
flows: {{f: {{path: [a, b]}}}}
""",
        **changes,
    )


ON_P, ON_Q = f"processor: p, period: 10 ms, {WORK}", f"processor: q, period: 10 ms, {WORK}"
ETH = "{e: {transmission_time: {fixed: 3 ms .. 4 ms}}}"
BUS = f"bus_types: {ETH}\nbuses: {{eth: {{type: e}}}}"


# --- the differences of d67035f -----------------------------------------------------------------------------------


def test_threads_on_one_processor_are_synchronous() -> None:
    """1 + 0 + 1; 2 + (10 - 2) + 2. On two processors 2 + 10 + 2."""
    assert pair(ON_P, ON_P) == (2, 12)
    assert pair(ON_P, ON_Q) == (2, 14)
    assert pair(ON_P, ON_Q, system="synchronous") == (2, 12)
    unbound = ON_P.replace("processor", "figures_of")
    assert pair(unbound, unbound) == (2, 14)


@pytest.mark.parametrize(("clock", "expected"), [("one", (2, 12)), ("two", (2, 14))])
def test_a_stated_clock_decides_before_the_setting_of_the_system(clock: str, expected: tuple[int, int]) -> None:
    processors = f"{{p: {{type: cpu, clock: one}}, q: {{type: cpu, clock: {clock}}}}}"
    head = f"clocks: {{one: {{}}, two: {{}}}}\nprocessor_types: {{cpu: {{}}}}\nprocessors: {processors}\n"
    body = f"""{head}
threads: {{a: {{{ON_P}}}, b: {{{ON_Q}}}}}
connections: {{c: {{from: a, to: b, port: data, data_size: 8 B}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    for system in ("asynchronous", "synchronous"):
        space = space_of(body, profile="osate-2.19", system=system)
        assert tuple(figure(space, f"{kind} of f") / MS for kind in ("min latency", "latency")) == expected


def test_a_connections_latency_and_bus_count_inside_one_process() -> None:
    """1 + 3 + 1; 2 + 4 + 2 where nothing samples; the bus likewise."""
    inside = f"processor: p, process: node, dispatch_protocol: aperiodic, {WORK}"
    flow = f"""
threads: {{a: {{{inside}, dispatch_trigger: [i]}}, b: {{{inside}}}}}
devices: {{s: {{period: 10 ms}}}}
connections: {{i: {{from: s, to: a}}, c: {{from: a, to: b, data_size: 8 B, WIRE}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    assert totals(flow.replace("WIRE", "latency: 3 ms .. 4 ms")) == (5, 8)
    assert totals(BUS + flow.replace("WIRE", "bus: eth")) == (5, 8)
    both = flow.replace("WIRE", "bus: eth, latency: 7 ms .. 9 ms")
    assert totals(BUS + both) == (5, 8)  # its own latency only without any other time
    idle = BUS.replace(" {transmission_time: {fixed: 3 ms .. 4 ms}}", " {bandwidth: 1 Mbit/s}")
    assert totals(idle + both) == (9, 13)


def test_the_period_of_an_aperiodic_component_is_sender_period_and_default_deadline() -> None:
    """a: 1 .. 2; sampling 0 .. 5, the sender's; b: 0 .. 20, its period as its deadline."""
    sender = f"processor: p, dispatch_protocol: aperiodic, period: 5 ms, {WORK}"
    more = "devices: {s: {period: 10 ms}}"
    body = f"""
{more}
threads: {{a: {{{sender}}}, b: {{processor: q, period: 20 ms}}}}
connections: {{i: {{from: s, to: a}}, c: {{from: a, to: b, port: data, data_size: 8 B}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    assert totals(body) == (1, 27)


@pytest.mark.parametrize(
    ("times", "latency", "expected"),
    [("0 ms .. 3 ms", "1 ms .. 9 ms", (1, 3)), ("0 ms", "1 ms .. 9 ms", (1, 9)), ("2 ms .. 3 ms", "9 ms", (2, 3))],
)
def test_a_transmission_time_of_zero_falls_back_to_the_latency_at_that_end(
    times: str, latency: str, expected: tuple[int, int]
) -> None:
    bus_type = f"e: {{transmission_time: {{fixed: {times}}}, latency: {latency}}}"
    body = f"""
bus_types: {{{bus_type}}}
buses: {{eth: {{type: e}}}}
devices: {{a: {{}}, b: {{}}}}
connections: {{c: {{from: a, to: b, data_size: 8 B, bus: eth, rate: 1 Hz}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    assert totals(body) == expected


def test_overhead_counts_as_far_as_the_message_is_wrapped() -> None:
    """The protocol carries 8 + 2 B at 0.5 ms, the wire 8 + 2 + 4 B at 1 ms: 5 + 14, not 7 + 14."""
    body = """
bus_types:
  proto: {virtual: true, overhead: 2 B, transmission_time: {per_byte: 500 us}}
  wire: {overhead: 4 B, transmission_time: {per_byte: 1 ms}}
buses: {w: {type: wire}, v: {type: proto, bus: w}}
devices: {a: {}, b: {}}
connections: {c: {from: a, to: b, data_size: 8 B, bus: v, rate: 1 Hz}}
flows: {f: {path: [a, b]}}
"""
    assert totals(body) == (19, 19)
    assert totals(body, profile="dse") == (21, 21)
    assert totals(body, profile="osate-2.2") == (12, 12)  # no overhead: 8 B at 1.5 ms


def test_a_deadline_of_zero_is_not_given() -> None:
    device = "devices: {a: {compute_execution_time: 1 ms .. 5 ms, deadline: DEADLINE}, b: {}}\n"
    body = device + "connections: {c: {from: a, to: b}}\nflows: {f: {path: [a, b]}}"
    space = space_of(body.replace("DEADLINE", "3 ms"), profile="osate-2.19", worst_case="deadline")
    assert [row.max_ns for row in rows_of(space, "f")] == [3 * MS, 0, 0]
    space = space_of(body.replace(", deadline: DEADLINE", ""), profile="osate-2.19", worst_case="deadline")
    assert [row.max_ns for row in rows_of(space, "f")] == [5 * MS, 0, 0]


# --- kinds of connections -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("timing", "receiver", "expected"),
    [
        ("sampled", ON_Q, (2, 14)),
        ("delayed", ON_Q, (12, 14)),
        ("delayed", ON_P, (11, 12)),  # 1 + (10 - 1) + 1, 2 + (10 - 2) + 2
        ("immediate", ON_P, (2, 4)),
        ("immediate", ON_Q, (2, 4)),
    ],
)
def test_timing(timing: str, receiver: str, expected: tuple[int, int]) -> None:
    assert pair(ON_P, receiver, f", timing: {timing}") == expected


def test_a_delayed_connection_waits_for_the_receivers_own_period() -> None:
    """A sampled one for the sender's, which divides it: 2 + (5 - 2) + 2."""
    sender = f"processor: p, period: 5 ms, {WORK}"
    assert pair(sender, ON_P, ", timing: sampled") == (2, 7)
    assert pair(sender, ON_P, ", timing: delayed") == (11, 12)


def test_what_passed_is_counted_from_the_last_row_that_samples() -> None:
    """A 2, c samples (10 - 2), c 2; an immediate one 3; d samples to the next multiple of 4 after 2 + 3: 8."""
    body = f"""
threads:
  a: {{processor: p, period: 10 ms, {WORK}}}
  b: {{processor: p, period: 10 ms, {WORK}}}
  c: {{processor: p, period: 10 ms, compute_execution_time: 1 ms .. 3 ms}}
  d: {{processor: p, period: 4 ms, compute_execution_time: 1 ms}}
connections:
  ab: {{from: a, to: b, port: data, data_size: 8 B}}
  bc: {{from: b, to: c, port: data, data_size: 8 B, timing: immediate}}
  cd: {{from: c, to: d, port: data, data_size: 8 B}}
flows: {{f: {{path: [a, b, c, d]}}}}
"""
    assert totals(body) == (1 + 1 + 1 + 1, 2 + 8 + 2 + 3 + 3 + 1)


def test_in_2014_synchronous_ends_round_up_both() -> None:
    assert pair(ON_P, ON_P, profile="osate-2.2") == (1 + 9 + 1, 2 + 8 + 2)


# --- queues and buses ---------------------------------------------------------------------------------------------


def test_full_queues_at_best() -> None:
    """Two items of 1 .. 2 ms wait for the thread: 0 .. 4 ms, or 2 .. 4 ms."""
    body = f"""
devices: {{s: {{period: 10 ms}}}}
threads: {{a: {{processor: p, dispatch_protocol: aperiodic, {WORK}, queue_size: 2}}}}
connections: {{c: {{from: s, to: a}}}}
flows: {{f: {{path: [s, a]}}}}
"""
    assert totals(body, best_case="empty_queue")[0] == 1
    assert totals(body, best_case="full_queue")[0] == 3
    assert totals(body)[1] == totals(body, best_case="full_queue")[1]


SHARED = """
bus_types: {e: {transmission_time: {fixed: 3 ms .. 4 ms}, PERIOD}}
buses: {eth: {type: e}}
devices: {a: {}, b: {}}
connections:
  one: {from: a, to: b, data_size: 8 B, bus: eth, rate: 1 Hz}
  two: {from: a, to: b, data_size: 8 B, bus: eth, rate: 1 Hz}
  unused: {from: a, to: b, data_size: 8 B, bus: eth, rate: 1 Hz}
flows: {f: {path: [a, one, b]}, g: {path: [a, two, b]}}
"""


def test_a_message_waits_for_the_other_connections_of_flows_on_its_bus() -> None:
    assert totals(SHARED.replace(", PERIOD", "")) == (3, 8)
    assert totals(SHARED.replace(", PERIOD", ""), bus_queuing="not_counted") == (3, 4)
    assert totals(SHARED.replace(", PERIOD", ""), profile="osate-2.2") == (3, 4)


def test_a_bus_with_a_period_samples_and_nobody_waits_there() -> None:
    assert totals(SHARED.replace("PERIOD", "period: 5 ms")) == (3, 4 + 5)


def test_a_bus_rounds_nothing_up_in_a_synchronous_system() -> None:
    """Where something sampled before, a whole period is added at both ends."""
    body = f"""
bus_types: {{e: {{transmission_time: {{fixed: 3 ms .. 4 ms}}, period: 5 ms}}}}
buses: {{eth: {{type: e}}}}
threads: {{a: {{{ON_P}}}}}
devices: {{b: {{}}}}
connections: {{c: {{from: a, to: b, data_size: 8 B, bus: eth, rate: 1 Hz}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    assert totals(body) == (1 + 3, 2 + 4 + 5)
    assert totals(body, system="synchronous") == (1 + 3 + 5, 2 + 4 + 5)


@pytest.mark.parametrize("category", ["process", "system", "thread_group"])
def test_other_categories_sample_with_a_period_and_execute_nothing(category: str) -> None:
    receiver = f"category: {category}, dispatch_protocol: sporadic, period: 10 ms, {WORK}"
    assert pair(ON_P, receiver) == (1, 2 + 10 + 10)  # nothing but its period is left as its deadline


# --- partitions ---------------------------------------------------------------------------------------------------

FRAMES = """
partitions:
  one: {period: 20 ms, offset: 0 ms, duration: 5 ms}
  two: {period: 20 ms, offset: 8 ms, duration: 4 ms}
  loose: {period: 20 ms}
"""


def crossing(first: str, second: str, **changes: str) -> tuple[Fraction, Fraction]:
    """An aperiodic thread of 1 .. 2 ms sends to another one on the same processor, each in a partition or in none."""
    body = f"""{FRAMES}
devices: {{s: {{period: 100 ms}}}}
threads:
  a: {{processor: p, dispatch_protocol: aperiodic, {WORK}{first}}}
  b: {{processor: p, dispatch_protocol: aperiodic, {WORK}{second}}}
connections: {{i: {{from: s, to: a}}, c: {{from: a, to: b, data_size: 8 B}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    return totals(body, **changes)


@pytest.mark.parametrize(
    ("first", "second", "changes", "expected"),
    [
        ("", "", {}, (2, 4)),
        (", partition: one", ", partition: one", {}, (2, 4)),
        # out at the major frame, after 20 ms: then 8 ms to the window of the other, 20 - 20 + 8
        (", partition: one", ", partition: two", {}, (20 + 8 + 1, 20 + 8 + 2)),
        # out at the end of the window, after 5 ms: 3 ms to the other's
        (", partition: one", ", partition: two", {"partition_output": "partition_end"}, (5 + 3 + 1, 5 + 3 + 2)),
        # without windows nothing waits to get out, and what comes in waits for the next frame
        (", partition: loose", ", partition: two", {}, (20 + 1, 20 + 2)),
        (", partition: one", "", {}, (20 + 1, 20 + 2)),
        ("", ", partition: loose", {}, (2, 2 + 20 + 2)),  # nothing was counted before it
    ],
)
def test_partitions(first: str, second: str, changes: dict[str, str], expected: tuple[int, int]) -> None:
    assert crossing(first, second, **changes) == expected


def test_a_task_with_a_longer_period_than_its_partition_waits_for_the_rest_at_both_ends() -> None:
    """Into the frame 0 .. 20, then 25 - 20 more."""
    body = f"""{FRAMES}
threads: {{a: {{{ON_Q}}}, b: {{processor: p, period: 25 ms, {WORK}, partition: loose}}}}
connections: {{c: {{from: a, to: b, port: data, data_size: 8 B}}}}
flows: {{f: {{path: [a, b]}}}}
"""
    assert totals(body) == (1 + 5 + 1, 2 + 20 + 5 + 2)


# --- settings -----------------------------------------------------------------------------------------------------


def test_settings_by_osates_abbreviations() -> None:
    assert osate_settings("AS-MF-DL-EQ-EQL") == {
        "system": "asynchronous",
        "partition_output": "major_frame",
        "worst_case": "deadline",
        "best_case": "empty_queue",
        "bus_queuing": "counted",
    }
    assert len(OSATE_WORDS) == 10
    for wrong in ("", "AS-SS", "XX", "AS--MF"):
        with pytest.raises(ValueError, match="one each of"):
            osate_settings(wrong)


def test_settings_are_part_of_the_question() -> None:
    text = f"""
dse: 1
name: two
profile: osate-2.19
system: synchronous
{HEAD}
threads: {{a: {{{ON_P}}}, b: {{{ON_Q.replace("10 ms", "[10 ms, 20 ms]", 1)}}}}}
connections: {{c: {{from: a, to: b, port: data, data_size: 8 B}}}}
flows: {{f: {{path: [a, b]}}}}
objectives: [minimise latency of f]
"""
    problem = dse.loads(text)
    assert dse.solve(problem).front[0].objectives["latency of f"] == 12 * MS
    other = problem.ask(system="asynchronous")
    result = dse.solve(other)
    assert result.front[0].objectives["latency of f"] == 14 * MS
    assert result.problem.effective["system"] == "asynchronous"
    assert dse.verify(result).status != "rejected"


@pytest.mark.parametrize("profile", ["osate-2.2", "osate-2.19"])
def test_a_time_that_follows_from_the_bandwidth_is_none_for_osate_and_that_is_said(profile: str) -> None:
    text = """
dse: 1
name: camera
bus_types: {eth: {bandwidth: 100 Mbit/s, transmission_time: from bandwidth}}
buses: {e: {type: eth}}
devices: {camera: {period: 50 ms}, screen: {period: 50 ms}}
connections: {image: {from: camera, to: screen, data_size: 100 KB, bus: e}}
flows: {seen: {path: [camera, screen]}}
"""
    problem = dse.loads(text)
    assert not [remark for remark in dse.check(problem).remarks if "take no time" in remark]
    [remark] = [item for item in dse.check(problem.ask(profile=profile)).remarks if "take no time" in item]
    assert "under profile dse alone" in remark
