"""An outcome from a store or another machine is what runs write, or is refused: never a fault of ours."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from typing import Any

import pytest

import dse
from dse.examples.shipped import example_path
from dse.questions.sweep.axes import LimitAxis, read_limit_axis
from dse.questions.sweep.break_points import break_points
from dse.questions.sweep.fronts import front_outcome
from dse.questions.sweep.runs import OutcomeError, read_outcome
from tests.helpers.effort import LONG

ODD: tuple[Any, ...] = (None, [], {}, "", "x", 0, -1, 0.5, True, [[]], [{}], {"x": None}, [None])


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where something stands: everything, but of each list the first entry only."""
    yield path
    items = data.items() if isinstance(data, dict) else enumerate(data[:1]) if isinstance(data, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def put(data: dict[str, Any], path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    made = copy.deepcopy(data)
    holder: Any = made
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = value
    return made


@pytest.mark.parametrize("kind", ["front", "breaks"])
def test_whatever_stands_in_any_place_is_read_or_refused(kind: str) -> None:
    space = dse.load(example_path("starter")).space
    axis = read_limit_axis(space, "jitter of sensor_to_actuator", "<= 20ms..60ms")
    assert isinstance(axis, LimitAxis)
    outcome = front_outcome(space, 0) if kind == "front" else break_points(space, axis, 0)
    assert outcome["kind"] == kind
    data = json.loads(json.dumps(outcome))
    assert read_outcome(json.dumps(data)) == data
    refused = 0
    for number, path in enumerate(places(data)):
        for odd in ODD if LONG else ODD[number % 3 :: 3]:
            try:
                read_outcome(json.dumps(put(data, path, odd)))
            except OutcomeError:
                refused += 1
    assert refused > 100
