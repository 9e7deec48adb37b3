"""Section 3 of the semantics on two components and a wire: each rule of each profile, with the arithmetic shown.

The `osate` profiles are held to OSATE's own source: 2.2 is FlowLatencyLogicComponent.java of October 2014 (637f569225),
2.19 is FlowLatencyAnalysisSwitch.java.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import combinations

import pytest

from tests.helpers.small import MS, US, figure, rows_of, space_of

WORK = "compute_execution_time: 1 ms .. 2 ms"
PERIODIC = f"dispatch_protocol: periodic, period: 20 ms, {WORK}"
APERIODIC = f"dispatch_protocol: aperiodic, {WORK}"
SPORADIC = f"dispatch_protocol: sporadic, period: 20 ms, {WORK}"
HYBRID = f"dispatch_protocol: hybrid, period: 20 ms, {WORK}"
IMPLICIT = f"period: 20 ms, {WORK}"
DONE = ("processing time", 2)
NOTHING = "no sampling/queuing latency"


def receiver_rows(
    receiver: str, port: str = "event_data", profile: str = "dse", worst_case: str = "execution_time", **more: str
) -> list[tuple[str, Fraction]]:
    """The rows of the receiver of a connection: method and maximum in ms."""
    sender, wire = more.get("sender", "period: 10 ms"), more.get("wire", "data_size: 8 B")
    space = space_of(
        f"""
        devices: {{sensor: {{{sender}}}}}
        threads: {{nav: {{{receiver}}}}}
        connections: {{c: {{from: sensor, to: nav, port: {port}, {wire}}}}}
        flows: {{f: {{path: [sensor, nav]}}}}
        """,
        profile=profile,
        worst_case=worst_case,
    )
    rows = [row for row in rows_of(space, "f") if row.contributor == "nav"]
    assert all(row.min_ns == 0 for row in rows[:-1])
    return [(row.max_method, Fraction(row.max_ns, MS)) for row in rows]


# --- sampling -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("port", ["event_data", "event", "data", "data_access", "feature"])
def test_sampling_whatever_the_port(port: str) -> None:
    assert receiver_rows(PERIODIC, port) == [("sampling", 20), DONE]
    assert ("sampling", 20) in receiver_rows(PERIODIC, port, "osate-2.2")


@pytest.mark.parametrize("port", ["data", "feature"])
def test_osate_today_samples_data_ports_and_abstract_features(port: str) -> None:
    assert receiver_rows(PERIODIC, port, "osate-2.19", sender="period: 15 ms") == [("sampling", 20), DONE]


@pytest.mark.parametrize("port", ["event_data", "event", "data_access"])
def test_osate_today_does_not_sample_event_ports_and_shared_data(port: str) -> None:
    assert receiver_rows(PERIODIC, port, "osate-2.19") == [DONE]


@pytest.mark.parametrize(
    ("sender", "sampling_ms"),
    [
        ("period: 10 ms", 10),  # 20 = 2 * 10
        ("period: 20 ms", 20),
        ("period: 15 ms", 20),  # 20 / 15 is no integer
        ("period: 40 ms", 20),
        ("dispatch_protocol: sporadic, period: 5 ms", 5),  # OSATE looks at the property, not at the dispatch
        ("latency: 1 ms", 20),  # no period
    ],
)
def test_osate_today_samples_at_a_harmonic_senders_period(sender: str, sampling_ms: int) -> None:
    assert receiver_rows(PERIODIC, "data", "osate-2.19", sender=sender) == [("sampling", sampling_ms), DONE]
    for profile in ("dse", "osate-2.2"):
        assert receiver_rows(PERIODIC, "data", profile, sender=sender) == [("sampling", 20), DONE]


@pytest.mark.parametrize("profile", ["dse", "osate-2.2", "osate-2.19"])
@pytest.mark.parametrize("receiver", [APERIODIC, SPORADIC, WORK])
def test_what_events_dispatch_does_not_sample(receiver: str, profile: str) -> None:
    assert "sampling" not in dict(receiver_rows(receiver, "event_data", profile))


def test_the_first_component_does_not_wait_for_itself() -> None:
    """The reduced reaction time: sensor 0, nav 0..20 + 1..2."""
    space = space_of(
        f"""
        devices: {{sensor: {{period: 10 ms}}}}
        threads: {{nav: {{{PERIODIC}}}}}
        connections: {{c: {{from: sensor, to: nav}}}}
        flows: {{f: {{path: [sensor, nav]}}}}
        """
    )
    assert rows_of(space, "f")[0].max_method == "first sampling"
    assert figure(space, "latency of f") == 22 * MS
    assert figure(space, "min latency of f") == 1 * MS
    assert figure(space, "jitter of f") == 21 * MS


def test_a_component_may_come_twice() -> None:
    """There and back: nav 0..20 + 1..2, sensor 0..10, nav 0..20 + 1..2."""
    space = space_of(
        f"""
        devices: {{sensor: {{period: 10 ms}}}}
        threads: {{nav: {{{PERIODIC}}}}}
        connections: {{there: {{from: sensor, to: nav}}, back: {{from: nav, to: sensor}}}}
        flows: {{f: {{path: [sensor, nav, sensor, nav]}}}}
        """
    )
    assert figure(space, "latency of f") == (22 + 10 + 22) * MS
    assert figure(space, "min latency of f") == 2 * MS


def test_hybrid_callback_then_timer() -> None:
    """The callback stores (3..4), the timer samples that (0..20) and works (1..2)."""
    space = space_of(
        f"""
        devices: {{sensor: {{period: 10 ms}}}}
        threads: {{nav: {{{HYBRID}, callback_execution_time: 3 ms .. 4 ms}}}}
        connections: {{c: {{from: sensor, to: nav}}}}
        flows: {{f: {{path: [sensor, nav]}}, alone: {{path: [nav]}}}}
        """
    )
    assert figure(space, "latency of f") == (4 + 20 + 2) * MS
    assert figure(space, "min latency of f") == (3 + 1) * MS
    assert figure(space, "latency of alone") == 2 * MS  # nothing came in: no callback


# --- queuing ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("profile", "port", "receiver", "queued_ms"),
    [
        # no queue size is given
        ("dse", "event_data", APERIODIC, None),
        ("dse", "data", APERIODIC, None),
        ("osate-2.2", "event_data", APERIODIC, 2),  # 1 * 2
        ("osate-2.2", "event", APERIODIC, 2),
        ("osate-2.2", "data", APERIODIC, None),
        ("osate-2.2", "feature", APERIODIC, None),
        ("osate-2.2", "event_data", PERIODIC, 0),  # (1 - 1) * 20
        ("osate-2.2", "event_data", SPORADIC, 0),
        ("osate-2.2", "event_data", IMPLICIT, 2),  # not explicitly periodic: 1 * 2
        ("osate-2.19", "event_data", APERIODIC, None),
        ("osate-2.19", "data", APERIODIC, 2),  # 1 * 2
        ("osate-2.19", "data_access", APERIODIC, None),
        ("osate-2.19", "data", SPORADIC, 20),  # 1 * 20
        ("osate-2.19", "data", PERIODIC, None),
        ("osate-2.19", "data", HYBRID, None),  # neither sporadic nor timed nor aperiodic
        ("osate-2.19", "feature", APERIODIC, None),
        # a queue of 3
        ("dse", "event_data", f"{APERIODIC}, queue_size: 3", 6),  # 3 * 2
        ("dse", "event_data", f"{SPORADIC}, queue_size: 3", 6),
        ("dse", "event_data", f"{PERIODIC}, queue_size: 3", None),  # a timer does not queue
        ("osate-2.2", "event_data", f"{APERIODIC}, queue_size: 3", 6),
        ("osate-2.2", "event_data", f"{PERIODIC}, queue_size: 3", 40),  # (3 - 1) * 20
        ("osate-2.2", "event_data", f"{SPORADIC}, queue_size: 3", 40),
        ("osate-2.2", "event_data", f"{IMPLICIT}, queue_size: 3", 6),
        ("osate-2.2", "data", f"{APERIODIC}, queue_size: 3", None),
        ("osate-2.2", "event_data", f"{APERIODIC}, category: abstract", None),
        ("osate-2.19", "event_data", f"{APERIODIC}, queue_size: 3", 6),
        ("osate-2.19", "event_data", f"{PERIODIC}, queue_size: 3", 60),  # 3 * 20
        ("osate-2.19", "event_data", f"{SPORADIC}, queue_size: 3", 60),
        ("osate-2.19", "event_data", f"{IMPLICIT}, queue_size: 3", 6),
        ("osate-2.19", "event_data", f"{APERIODIC}, queue_size: 0", None),
        # per item the worst processing: the response time where there is one
        ("dse", "event_data", f"{APERIODIC}, queue_size: 3, response_time: 4 ms", 12),
        ("osate-2.19", "event_data", f"{APERIODIC}, queue_size: 3, response_time: 4 ms", 12),
    ],
)
def test_queuing(profile: str, port: str, receiver: str, queued_ms: int | None) -> None:
    assert dict(receiver_rows(receiver, port, profile)).get("queued") == queued_ms


@pytest.mark.parametrize("profile", ["dse", "osate-2.2", "osate-2.19"])
def test_the_queue_of_the_port_overrides_the_components(profile: str) -> None:
    rows = receiver_rows(f"{APERIODIC}, queue_size: 3", profile=profile, wire="queue_size: 5")
    assert dict(rows)["queued"] == 5 * 2


# --- processing ---------------------------------------------------------------------------------------------------

TIMES = {
    "response": "response_time: 3 ms .. 4 ms",
    "execution": "compute_execution_time: 1 ms .. 2 ms",
    "deadline": "deadline: 8 ms",
    "latency": "latency: 5 ms .. 6 ms",
}
WORST = {"response": ("response time", 4), "execution": ("processing time", 2), "deadline": ("deadline", 8)}
WORST |= {"latency": ("specified", 6), "period": ("deadline", 20)}
ORDER = {  # profile, setting: which figure counts first
    ("dse", "execution_time"): ["response", "execution", "latency"],
    ("dse", "deadline"): ["response", "execution", "latency"],
    ("osate-2.2", "execution_time"): ["execution", "deadline", "latency"],
    ("osate-2.2", "deadline"): ["deadline", "latency"],
    ("osate-2.19", "execution_time"): ["response", "execution", "latency", "deadline", "period"],
    ("osate-2.19", "deadline"): ["response", "deadline", "execution", "latency", "period"],
}
SUBSETS = [chosen for size in range(5) for chosen in combinations(TIMES, size)]


@pytest.mark.parametrize("chosen", SUBSETS, ids=lambda chosen: "+".join(chosen) or "nothing")
@pytest.mark.parametrize(("profile", "worst_case"), ORDER)
def test_worst_processing(profile: str, worst_case: str, chosen: tuple[str, ...]) -> None:
    """The first of the order that is given; OSATE today ends with the default deadline, which is the period."""
    receiver = ", ".join(["period: 20 ms", *(TIMES[name] for name in chosen)])
    first = next((name for name in ORDER[profile, worst_case] if name in (*chosen, "period")), "")
    expected = WORST.get(first, ("no latency", 0))
    assert receiver_rows(receiver, "event_data", profile, worst_case)[-1] == expected


def test_default_deadline_of_a_sporadic_thread_and_none_of_an_aperiodic_one() -> None:
    sporadic = receiver_rows("dispatch_protocol: sporadic, period: 20 ms", profile="osate-2.19")
    assert sporadic == [("deadline", 20)]
    assert receiver_rows("dispatch_protocol: aperiodic", profile="osate-2.19") == [(NOTHING, 0)]
    assert receiver_rows("dispatch_protocol: aperiodic") == [("no latency", 0)]


BEST = {"response": ("response time", 3), "execution": ("processing time", 1), "latency": ("specified", 5)}


@pytest.mark.parametrize("chosen", SUBSETS, ids=lambda chosen: "+".join(chosen) or "nothing")
@pytest.mark.parametrize("profile", ["dse", "osate-2.2", "osate-2.19"])
def test_best_processing(profile: str, chosen: tuple[str, ...]) -> None:
    order = ["response"] * (profile == "osate-2.19") + ["execution", "latency"]
    times = ", ".join(TIMES[name] for name in chosen)
    space = space_of(f"threads: {{nav: {{{times}}}}}\nflows: {{f: {{path: [nav]}}}}")
    row = rows_of(replace(space, profile=profile), "f")[-1]
    first = next((name for name in order if name in chosen), "")
    nothing = NOTHING if profile == "osate-2.19" else "no latency"
    assert (row.min_method, Fraction(row.min_ns, MS)) == BEST.get(first, (nothing, 0))


def test_for_osate_a_time_of_zero_is_none() -> None:
    receiver = "dispatch_protocol: aperiodic, compute_execution_time: 0 ms, latency: 5 ms"
    assert receiver_rows(receiver) == [("processing time", 0)]
    assert receiver_rows(receiver, profile="osate-2.19") == [("specified", 5)]


# --- connections --------------------------------------------------------------------------------------------------

TWO_MACHINES = """
    processor_types: {slow: {}, fast: {}}
    processors: {one: {type: [slow, fast]}, two: {type: fast}}
    bus_types:
      can:
        {bandwidth: 125 kbit/s, overhead: 4 B, latency: 1 s,
         transmission_time: {fixed: 256 us, per_byte: 64 us .. 88 us}}
      plain: {latency: 1 ms .. 3 ms}
      silent: {}
      tunnel: {virtual: true, overhead: 10 B, transmission_time: {fixed: 5 us}}
      ros:
        virtual: true
        transmission_time: {slow: {fixed: 500 us .. 900 us, per_byte: 1 us}, fast: {fixed: 100 us .. 200 us}}
    buses: {wire: {type: can}, line: {type: plain}, dark: {type: silent}, path: {type: tunnel, bus: wire}}
    threads:
      a: {processor: one, period: 10 ms}
      b: {processor: two, dispatch_protocol: aperiodic}
      same: {processor: one, process: p, period: 10 ms}
      other: {processor: one, process: [p, q], dispatch_protocol: aperiodic}
    devices: {eye: {period: 10 ms}}
    """


def transmission_us(
    wire: str, options: dict[str, str] | None = None, ends: str = "from: a, to: b"
) -> tuple[str, int, int]:
    """Method, minimum and maximum of a connection's row."""
    space = space_of(TWO_MACHINES + f"connections: {{c: {{{ends}, {wire}}}}}\n    flows: {{f: {{path: [c]}}}}")
    [row] = rows_of(space, "f", options)
    assert row.min_ns % US == row.max_ns % US == 0
    return row.max_method, row.min_ns // US, row.max_ns // US


def test_transmission_counts_size_and_overhead_and_not_the_latency() -> None:
    """256 + 64 * (8 + 4) = 1024 and 256 + 88 * (8 + 4) = 1312."""
    assert transmission_us("data_size: 8 B, bus: wire") == ("transmission time", 1024, 1312)


def test_a_buss_latency_counts_without_a_transmission_time() -> None:
    assert transmission_us("data_size: 8 B, bus: line") == ("transmission time", 1000, 3000)


def test_a_stack_adds_its_times_and_its_overheads() -> None:
    """Size 8 + 10 + 4 = 22: the tunnel's 5 us, and 256 + 64 * 22 = 1664 or 256 + 88 * 22 = 2192."""
    assert transmission_us("data_size: 8 B, bus: path") == ("transmission time", 1664 + 5, 2192 + 5)


def test_a_virtual_bus_costs_what_it_costs_on_the_senders_machine() -> None:
    assert transmission_us("data_size: 8 B, bus: ros", {"one.type": "slow"}) == ("transmission time", 508, 908)
    assert transmission_us("data_size: 8 B, bus: ros", {"one.type": "fast"}) == ("transmission time", 100, 200)


def test_a_virtual_bus_from_a_device_costs_what_it_costs_on_the_receivers_machine() -> None:
    ends = "from: eye, to: a"
    assert transmission_us("data_size: 8 B, bus: ros", {"one.type": "slow"}, ends) == ("transmission time", 508, 908)
    assert transmission_us("data_size: 8 B, bus: ros", {"one.type": "slow"}, "from: eye, to: b")[1:] == (100, 200)


def test_a_connections_own_latency_counts_where_nothing_else_is_given() -> None:
    assert transmission_us("latency: 2 ms .. 4 ms") == ("specified", 2000, 4000)
    assert transmission_us("data_size: 8 B, bus: dark, latency: 2 ms .. 4 ms") == ("specified", 2000, 4000)
    assert transmission_us("data_size: 8 B, bus: line, latency: 2 ms .. 4 ms") == ("transmission time", 1000, 3000)
    assert transmission_us("data_size: 8 B") == ("no latency", 0, 0)


def test_inside_a_process_a_connection_costs_nothing() -> None:
    ends = "from: same, to: other"
    for wire in ("data_size: 8 B, bus: wire", "data_size: 8 B, bus: ros", "latency: 2 ms"):
        assert transmission_us(wire, {"other.process": "p"}, ends) == ("no latency", 0, 0)
    between = {"other.process": "q", "one.type": "slow"}
    assert transmission_us("data_size: 8 B, bus: ros", between, ends)[1:] == (508, 908)
    assert transmission_us("data_size: 8 B, bus: wire", between, ends)[1:] == (0, 0)
