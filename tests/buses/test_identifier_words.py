"""Identifiers that a rule gives, in the words of answers."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.cli.main import run

LISTED = """
dse: 1
name: listed
bus_types:
  slow: {bandwidth: 250 kbit/s, frame: can, price: 1 EUR}
  fast: {bandwidth: 500 kbit/s, frame: can, price: 3 EUR}
buses: {b: {type: [slow, fast]}}
devices: {s: {}, w: {period: [2.5 ms, 4 ms]}, v: {period: 5 ms}}
threads: {}
connections:
  first: {from: w, to: s, bus: b, data_size: 8 B, identifier: [0x300, any]}
  next: {from: w, to: s, bus: b, data_size: 8 B, identifier: any, port: data, deadline: 3 ms}
  late: {from: v, to: s, bus: b, data_size: 8 B, identifier: [0x10, any], deadline: 5 ms}
flows: {f: {path: [w, first, s]}}
baseline: {b: {type: slow}, first: {identifier: 0x300}, late: {identifier: 0x10}, w: {period: 4 ms}}
objectives: [minimise latency of f, minimise price]
"""


def test_sentences_name_the_number_of_an_identifier_any(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The answer, its reasons, comparisons, analyses and explanations; the decision itself stays `any`."""
    path, result = tmp_path / "any.yaml", tmp_path / "any.json"
    path.write_text(LISTED)
    found = dse.solve(path)
    result.write_text(found.to_json(), encoding="utf-8")
    assert {point.decisions["late.identifier"] for point in found.front} == {"any"}
    for command, said in (
        (["solve", str(path), "--fix", "b.type = slow"], "late.identifier any (0x302)"),
        (
            ["solve", str(path)],
            "0x300, late.identifier any (0x302).",
        ),
        (["solve", str(path), "--explain"], "late.identifier from 0x10 to any (0x302)"),
        (["analyse", str(path), "--design", f"{result}#1"], "late.identifier any (0x302)"),
        (["compare", f"{result}#1", "baseline"], "late.identifier  any (0x302)  0x10"),
        (["explain", str(path), "--max-latency", "0.4 ms"], "late.identifier any (0x302)"),
    ):
        run(command)
        assert said in capsys.readouterr().out, command
