"""Section 4 of the semantics: CPU utilisation, worked out by hand, in ppm of one core."""

from __future__ import annotations

from fractions import Fraction

import pytest

from dse.analysis.measures import utilisation_terms
from tests.helpers.small import figure, space_of, view_of

ROBOT = """
    processor_types: {slow: {cores: 2}, fast: {cores: 1}}
    processors: {one: {type: [slow, fast]}, two: {type: fast}}
    devices: {eye: {period: 50 ms, compute_execution_time: 30 ms}}
    threads:
      see: {processor: one, period: 10 ms, compute_execution_time: {slow: 1 ms .. 3 ms, fast: 1 ms .. 2 ms}}
      plan:
        processor: [one, two]
        dispatch_protocol: [periodic, aperiodic]
        period: 100 ms
        compute_execution_time: {slow: 7 ms, fast: 4 ms}
      idle: {processor: one, period: 1 ms}
      elsewhere: {period: 1 ms, compute_execution_time: 1 ms}
    connections: {x: {from: eye, to: plan}}
    """


@pytest.mark.parametrize(
    ("machine", "place", "protocol", "one", "two"),
    [
        ("slow", "one", "periodic", 300_000 + 70_000, 0),  # 3 ms * 100 Hz + 7 ms * 10 Hz
        ("slow", "one", "aperiodic", 300_000 + 140_000, 0),  # 7 ms * 20 Hz
        ("fast", "one", "periodic", 200_000 + 40_000, 0),
        ("slow", "two", "periodic", 300_000, 40_000),  # its time is that of the processor it runs on
        ("fast", "two", "aperiodic", 200_000, 80_000),
    ],
)
def test_worst_execution_time_on_its_type_times_rate(
    machine: str, place: str, protocol: str, one: int, two: int
) -> None:
    options = {"one.type": machine, "plan.processor": place, "plan.dispatch_protocol": protocol}
    space = space_of(ROBOT)
    assert figure(space, "utilisation of one", options) == one
    assert figure(space, "utilisation of two", options) == two


def test_the_share_of_each_thread_is_kept() -> None:
    space = space_of(ROBOT)
    view = view_of(space, {"one.type": "slow", "plan.processor": "one"})
    assert {term.label: term.value(view) for term in utilisation_terms(space, 0)} == {"see": 300_000, "plan": 70_000}


def test_hybrid_callbacks_work_at_the_input_rate() -> None:
    """3 ms * 20 Hz + 1 ms * 100 Hz."""
    space = space_of(
        """
        processor_types: {pc: {}}
        processors: {one: {type: pc}}
        devices: {eye: {period: 50 ms}}
        threads:
          odometry:
            {processor: one, dispatch_protocol: [hybrid, periodic], period: 10 ms,
             callback_execution_time: 2 ms .. 3 ms, compute_execution_time: 1 ms}
        connections: {x: {from: eye, to: odometry}}
        """
    )
    assert figure(space, "utilisation of one", {"odometry.dispatch_protocol": "hybrid"}) == 60_000 + 100_000
    assert figure(space, "utilisation of one", {"odometry.dispatch_protocol": "periodic"}) == 100_000
    labels = [term.label for term in utilisation_terms(space, 0)]
    assert labels == ["odometry", "odometry (callback)"]


def test_utilisation_is_exact() -> None:
    """1 ms every 3 ms is a third, 1 ns every 7 ns a seventh."""
    space = space_of(
        """
        processor_types: {pc: {}}
        processors: {one: {type: pc}}
        threads:
          third: {processor: one, period: 3 ms, compute_execution_time: 1 ms}
          seventh: {processor: one, period: 7 ns, compute_execution_time: 1 ns}
        """
    )
    assert figure(space, "utilisation of one") == Fraction(10**6, 3) + Fraction(10**6, 7)


def test_sporadic_threads_load_at_their_separation() -> None:
    space = space_of(
        """
        processor_types: {pc: {}}
        processors: {one: {type: pc}}
        devices: {eye: {period: 1 ms}}
        threads: {s: {processor: one, dispatch_protocol: sporadic, period: 4 ms, compute_execution_time: 1 ms}}
        connections: {x: {from: eye, to: s}}
        """
    )
    assert figure(space, "utilisation of one") == 250_000
