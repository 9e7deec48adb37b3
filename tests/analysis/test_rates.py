"""Section 2 of the semantics: how often components run and messages leave, worked out by hand."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.rates import RateKey, rate_hz, source_rates_hz
from dse.questions.verbs import check as checking
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Space
from tests.helpers.small import design_of, space_of, view_of


def activation_hz(space: Space, name: str, options: dict[str, str] | None = None) -> Fraction:
    """The activation rate of a component."""
    return _rate(space, ("activation", [item.name for item in space.components].index(name)), options)


def delivery_hz(space: Space, name: str, options: dict[str, str] | None = None) -> Fraction:
    """The rate at which a connection delivers."""
    return _rate(space, ("delivery", [item.name for item in space.connections].index(name)), options)


def input_hz(space: Space, name: str) -> Fraction:
    """The rate of all triggers of a component together."""
    return _rate(space, ("input", [item.name for item in space.components].index(name)), None)


def _rate(space: Space, key: RateKey, options: dict[str, str] | None) -> Fraction:
    value = rate_hz(space, key, view_of(space, options))
    assert isinstance(value, Fraction)
    return value


CHAIN = """
    devices: {gnss: {period: 50 ms}}
    threads:
      parser: {dispatch_protocol: aperiodic}
      provider: {dispatch_protocol: [periodic, aperiodic], period: [10 ms, 100 ms]}
      filter: {dispatch_protocol: aperiodic}
    connections:
      telegram: {from: gnss, to: parser}
      gpgga: {from: parser, to: provider}
      pose: {from: provider, to: filter}
    """


def test_aperiodic_threads_inherit_the_nearest_period_upstream() -> None:
    space = space_of(CHAIN)
    everything = ("gnss", "parser", "provider", "filter")
    rates = [activation_hz(space, name, {"provider.dispatch_protocol": "aperiodic"}) for name in everything]
    assert rates == [20, 20, 20, 20]
    for period, rate in (("10 ms", 100), ("100 ms", 10)):
        chosen = {"provider.dispatch_protocol": "periodic", "provider.period": period}
        assert [activation_hz(space, name, chosen) for name in everything] == [20, 20, rate, rate]
        assert delivery_hz(space, "pose", chosen) == rate


def test_fan_in_adds() -> None:
    """1 / 50 ms + 1 / 100 ms = 30 Hz."""
    space = space_of(
        """
        devices: {a: {period: 50 ms}, b: {period: 100 ms}}
        threads: {join: {dispatch_protocol: aperiodic}, next: {}}
        connections: {x: {from: a, to: join}, y: {from: b, to: join}, z: {from: join, to: next}}
        """
    )
    assert activation_hz(space, "join") == activation_hz(space, "next") == 30


def test_two_connections_from_one_sender_count_twice() -> None:
    space = space_of(
        """
        devices: {a: {period: 50 ms}}
        threads: {join: {dispatch_protocol: aperiodic}}
        connections: {x: {from: a, to: join}, y: {from: a, to: join}}
        """
    )
    assert activation_hz(space, "join") == 40


@pytest.mark.parametrize(("separation", "rate"), [("20 ms", 50), ("5 ms", 100), ("10 ms", 100)])
def test_sporadic_keeps_its_minimum_separation(separation: str, rate: int) -> None:
    space = space_of(
        f"""
        devices: {{a: {{period: 10 ms}}}}
        threads: {{s: {{dispatch_protocol: sporadic, period: {separation}}}, t: {{dispatch_protocol: aperiodic}}}}
        connections: {{x: {{from: a, to: s}}, y: {{from: s, to: t}}}}
        """
    )
    assert activation_hz(space, "s") == activation_hz(space, "t") == rate
    assert input_hz(space, "s") == 100


def test_hybrid_stores_at_the_input_rate_and_publishes_at_its_own() -> None:
    """20 Hz + 10 Hz arrive, 1 / 20 ms = 50 Hz leave."""
    space = space_of(
        """
        devices: {a: {period: 50 ms}, b: {period: 100 ms}}
        threads: {odometry: {dispatch_protocol: hybrid, period: 20 ms}, next: {dispatch_protocol: aperiodic}}
        connections: {x: {from: a, to: odometry}, y: {from: b, to: odometry}, z: {from: odometry, to: next}}
        """
    )
    assert input_hz(space, "odometry") == 30
    assert activation_hz(space, "odometry") == activation_hz(space, "next") == 50


def test_a_period_without_a_protocol_is_periodic_and_none_is_event_triggered() -> None:
    space = space_of(
        """
        devices: {a: {period: 50 ms}}
        threads: {timer: {period: 10 ms}, event: {}}
        connections: {x: {from: a, to: timer}, y: {from: a, to: event}}
        """
    )
    assert activation_hz(space, "timer") == 100
    assert activation_hz(space, "event") == 20


def test_a_connection_may_state_its_rate() -> None:
    """5 Hz as stated; 600 B/s over 30 B = 20 Hz; 100 B/s over 12 B = 25/3 Hz."""
    space = space_of(
        """
        devices: {a: {period: 1 ms}}
        threads: {b: {dispatch_protocol: aperiodic}, c: {dispatch_protocol: aperiodic}, d: {}}
        connections:
          x: {from: a, to: b, rate: 5 Hz}
          y: {from: a, to: c, data_size: 30 B, data_rate: 600 B/s}
          z: {from: a, to: d, data_size: 12 B, data_rate: 100 B/s}
        """
    )
    assert [activation_hz(space, name) for name in "bcd"] == [5, 20, Fraction(25, 3)]


def test_a_rate_comes_in_over_the_system_boundary() -> None:
    space = space_of("threads: {b: {dispatch_protocol: aperiodic}}\nconnections: {cmd: {to: b, rate: 10 Hz}}")
    assert activation_hz(space, "b") == 10


@pytest.mark.parametrize(("port", "rate"), [("event_data", 30), ("event", 30), ("feature", 30), ("data", 20)])
def test_data_ports_do_not_trigger(port: str, rate: int) -> None:
    space = space_of(
        f"""
        devices: {{a: {{period: 50 ms}}, b: {{period: 100 ms}}}}
        threads: {{join: {{dispatch_protocol: aperiodic}}}}
        connections: {{x: {{from: a, to: join}}, y: {{from: b, to: join, port: {port}}}}}
        """
    )
    assert activation_hz(space, "join") == rate


@pytest.mark.parametrize(("triggers", "rate"), [("[x]", 20), ("[y]", 10), ("[x, y]", 30)])
def test_a_thread_may_name_its_triggers(triggers: str, rate: int) -> None:
    space = space_of(
        f"""
        devices: {{a: {{period: 50 ms}}, b: {{period: 100 ms}}}}
        threads: {{join: {{dispatch_protocol: aperiodic, dispatch_trigger: {triggers}}}}}
        connections: {{x: {{from: a, to: join}}, y: {{from: b, to: join, port: data}}}}
        """
    )
    assert activation_hz(space, "join") == rate


CIRCLE = """
    devices: {a: {period: 50 ms}}
    threads:
      plan: {dispatch_protocol: [periodic, aperiodic], period: 100 ms}
      act: {dispatch_protocol: [periodic, aperiodic], period: 10 ms}
    connections: {start: {from: a, to: plan}, order: {from: plan, to: act}, echo: {from: act, to: plan}}
    """


def test_a_cycle_of_events_is_no_design() -> None:
    space = space_of(CIRCLE)
    evaluator = Evaluator(space)
    for plan in ("periodic", "aperiodic"):
        for act in ("periodic", "aperiodic"):
            options = {"plan.dispatch_protocol": plan, "act.dispatch_protocol": act}
            circular = plan == act == "aperiodic"
            assert bool(evaluator.invalid(design_of(space, options))) == circular
            if circular:
                with pytest.raises(CyclicActivation):
                    activation_hz(space, "plan", options)


def test_a_timer_breaks_the_cycle() -> None:
    """With act at its own 100 Hz plan gets 20 + 100; with plan at its own 10 Hz act gets 10."""
    space = space_of(CIRCLE)
    options = {"plan.dispatch_protocol": "aperiodic", "act.dispatch_protocol": "periodic"}
    assert activation_hz(space, "plan", options) == 120
    options = {"plan.dispatch_protocol": "periodic", "act.dispatch_protocol": "aperiodic"}
    assert activation_hz(space, "act", options) == 10


def test_a_stated_rate_breaks_the_cycle() -> None:
    """Plan gets 20 + 2, act what plan gives."""
    space = space_of(CIRCLE.replace("echo: {", "echo: {rate: 2 Hz, "))
    options = {"plan.dispatch_protocol": "aperiodic", "act.dispatch_protocol": "aperiodic"}
    assert Evaluator(space).invalid(design_of(space, options)) == []
    assert activation_hz(space, "act", options) == 22


def test_source_rates_have_the_denominators_of_every_design() -> None:
    space = space_of(CHAIN)
    names = [item.name for item in space.components]
    assert source_rates_hz(space)["activation", names.index("filter")] == {20, 100, 10}


def test_a_chain_may_be_as_long_as_a_problem_has_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of 2,000 threads is triggered by the one before it; a sensor of 1 Hz starts them."""
    monkeypatch.setattr(checking, "TIME_S", 0.1)  # bounds on what designs may have are not what is asked here
    names = [f"t{number}" for number in range(2_000)]
    thread = {"processor": "computer", "dispatch_protocol": "aperiodic", "compute_execution_time": "1 us .. 2 us"}
    wires = [{"from": before, "to": after} for before, after in pairwise(["sensor", *names])]
    problem = dse.load(
        {
            "dse": 1,
            "name": "Chain",
            "processing": "execution_time",
            "processor_types": {"p": {"cores": 4}},
            "processors": {"computer": {"type": "p"}},
            "devices": {"sensor": {"period": "1 s"}},
            "threads": dict.fromkeys(names, thread),
            "connections": {f"to {wire['to']}": wire for wire in wires},
            "requirements": ["utilisation of computer <= 70 %"],
        }
    )
    assert dse.check(problem).size == 1
    assert dse.analyse(problem).metrics["utilisation of computer"] == 4_000  # 2,000 times 2 us in a second, in ppm
