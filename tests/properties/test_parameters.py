"""Execution times that follow a parameter, against types of threads, which the oracle knows."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import pytest
import yaml

import dse
from tests.helpers.effort import cases
from tests.oracle import evaluator as oracle

PPM = 10**6


def random_parameters(seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """A problem in which a parameter says what a thread takes, and one in which its type does."""
    rng = random.Random(f"parameters {seed}")

    def times() -> Any:
        def one() -> str:
            low = rng.randint(1, 4)
            return f"{low} ms .. {rng.randint(low, 6)} ms"

        return one() if rng.random() < 0.6 else {"small": one(), "large": one()}

    values = rng.sample([2, 5, 10, 25, 50], 3)
    table = {str(value): times() for value in values}
    base: dict[str, Any] = {
        "dse": 1,
        "name": f"parameters {seed}",
        "processing": rng.choice(["execution_time", "response_time"]),
        "processor_types": {"small": {"price": "10 EUR"}, "large": {"price": "30 EUR"}},
        "processors": {"pc": {"type": ["small", "large"]}},
        "devices": {"sensor": {"period": "50 ms", "latency": "1 ms"}},
        "connections": {"c": {"from": "sensor", "to": "nav"}},
        "flows": {"f": {"path": ["sensor", "nav"]}},
        "objectives": ["minimise latency of f", "minimise utilisation of pc", "minimise price"],
    }
    nav = {"processor": "pc", "period": ["20 ms", "50 ms"]}
    other = {"processor": "pc", "period": "40 ms", "compute_execution_time": times()}
    bound = rng.choice(values)
    size: dict[str, Any] = {"range": "2 m .. 50 m", "value": [f"{100 * value} cm" for value in values]}
    size["compute_execution_time"] = {f"{value} m": time for value, time in table.items()}
    mine = {**base, "threads": {"nav": {**nav, "parameters": {"size": size}}, "other": other}}
    mine["rules"] = [f"nav.size >= {bound} m", f"nav.size == {bound * 1000} mm implies nav.period == 20 ms"]
    theirs = {**base, "threads": {"nav": {**nav, "type": [f"t{value}" for value in values]}, "other": other}}
    theirs["thread_types"] = {f"t{value}": {"compute_execution_time": time} for value, time in table.items()}
    allowed = ", ".join(f"t{value}" for value in values if value >= bound)
    theirs["rules"] = [f"nav.type in [{allowed}]", f"nav.type == t{bound} implies nav.period == 20 ms"]
    return mine, theirs


@pytest.mark.parametrize("seed", cases(8))
def test_times_by_a_parameter_are_those_of_types_and_the_oracle_finds_them(seed: int) -> None:
    mine, theirs = (yaml.safe_dump(document, sort_keys=False) for document in random_parameters(seed))
    found = dse.solve(dse.loads(mine))
    assert found.status == "complete"
    judged = oracle.evaluated(oracle.load_text(theirs))
    front = oracle.non_dominated({figures["objectives"] for _, figures in judged if not figures["violations"]})
    expected = sorted((first, second * PPM, third) for first, second, third in front)
    assert sorted(tuple(point.objectives.values()) for point in found.front) == expected
    assert all(isinstance(value, int | Fraction) for row in expected for value in row)
