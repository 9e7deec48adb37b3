"""Names that end a text in SVG or in a script, or that look like colours of a theme, are drawn as they are."""

from __future__ import annotations

import html
import json
from xml.etree import ElementTree

import pytest

import dse
from dse.report.dispatch import Told
from dse.report.output import _figures
from tests.helpers.effort import few

NAMES = ["${x}|<b>&amp;", "a\\", 'a\\"+1', 'a"b', "a'b", "a\"b'c", "a\\nb", "var(--x)", "var(--ink)", "\\u0041"]
PROBLEM = """
dse: 1
name: NAME
processor_types: {"small NAME": {cores: 2, price: 60 EUR}, "large NAME": {price: 240 EUR}}
bus_types: {"wire NAME": {bandwidth: 1 Mbit/s, transmission_time: {fixed: 128 us, per_byte: 8 us}}}
totals: {"mass NAME": "g NAME"}
clocks: {"clock NAME": {}}
processors: {"cpu NAME": {type: ["small NAME", "large NAME"], clock: "clock NAME"}}
buses: {"bus NAME": {type: "wire NAME"}}
devices: {"in NAME": {period: 20 ms, compute_execution_time: 1 ms, totals: {"mass NAME": "3 g NAME"}}}
threads:
  "one NAME":
    {processor: "cpu NAME", period: [10 ms, 20 ms], offset: 1 ms, deadline: 9 ms, compute_execution_time: 1 ms .. 2 ms}
  "two NAME": {processor: "cpu NAME", period: 20 ms, offset: 2 ms, deadline: 9 ms, compute_execution_time: 1 ms .. 3 ms}
connections:
  "c NAME": {from: "in NAME", to: "one NAME", data_size: 8 B, bus: "bus NAME"}
  "d NAME": {from: "one NAME", to: "two NAME"}
flows: {"NAME": {path: ["in NAME", "one NAME", "two NAME"]}}
objectives: [minimise jitter, minimise price]
"""


@pytest.mark.parametrize("name", few(NAMES, 2))
def test_every_plot_shows_any_name(name: str) -> None:
    text = PROBLEM.replace("name: NAME", f"name: {json.dumps(name)}").replace("NAME", json.dumps(name)[1:-1])
    result = dse.solve(text)
    drawn = _drawn(result)
    assert len(drawn) > 5
    assert all(f"{word}{name}" in html.unescape("".join(drawn)) for word in ("in ", "cpu ", ""))
    assert _drawn(dse.analyse(text, result.front[0]))
    assert _drawn(dse.sensitivity(text, result.front[0]))
    assert _drawn(dse.sweep(text, "price=60EUR..300EUR", store=None))


def _drawn(answer: Told) -> list[str]:
    """The plots of an answer as SVG."""
    found = [str(content) for _, content in _figures(answer, ("svg",), None)]
    assert all(ElementTree.fromstring(item).tag.endswith("svg") for item in found)
    return found
