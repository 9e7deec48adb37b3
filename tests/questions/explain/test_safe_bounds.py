"""A proof that rests on safe bounds says so, in `explain` and in `solve`; one that does not says nothing of it."""

from __future__ import annotations

from typing import Any

import dse
from dse.report.content.explain import conflict_blocks, explanation_page
from dse.report.page import Text

CHAIN: dict[str, Any] = {
    "dse": 1, "name": "chain", "processing": "response_time", "objectives": ["minimise price"],
    "processor_types": {"cpu": {"price": "1 EUR"}}, "processors": {"pc": {"type": "cpu"}},
    "threads": {
        "a": {"processor": "pc", "period": "100 ms", "compute_execution_time": "25 ms"},
        "b": {"processor": "pc", "dispatch_protocol": "aperiodic", "compute_execution_time": "25 ms", "priority": 1},
        "r": {"processor": "pc", "period": "50 ms", "compute_execution_time": "10 ms"},
    },
    "connections": {"ab": {"from": "a", "to": "b"}}, "flows": {"chain": {"path": ["a", "b"]}},
    "requirements": ["latency of chain <= 55 ms"],
}  # fmt: skip
SAID = (
    "The proof rests on response times that are safe bounds, which need not be reached, on cores where events dispatch "
    "b: a design may be in time all the same."
)


def told(data: dict[str, Any]) -> tuple[str, str]:
    """What `explain` says, and what `solve` says of the conflicts."""
    page = explanation_page(dse.explain(data))
    blocks = conflict_blocks(dse.solve(data))
    return (
        "\n".join(text for section in page.sections for text in section.texts),
        "\n".join(block.text for block in blocks if isinstance(block, Text)),
    )


def test_a_proof_by_safe_bounds() -> None:
    """Both run one after the other in 50 ms, beside r, and events dispatch b."""
    explained, solved = told(CHAIN)
    assert f"INFEASIBLE  proved: no design meets every requirement and rule. {SAID}" in explained
    assert SAID in solved
    assert dse.explain(CHAIN).to_dict()["safe_bounds"] == {"events dispatch": ["b"]}


def test_a_proof_without_response_times() -> None:
    """A price is too high whatever threads wait for."""
    for more in (["price <= 0.50 EUR"], ["price <= 0.50 EUR", "latency of chain <= 55 ms"]):
        data = CHAIN | {"requirements": more}
        assert all("safe bounds" not in text for text in told(data))
        assert dse.explain(data, every=True).to_dict()["safe_bounds"] == {}


def test_a_proof_by_exact_response_times() -> None:
    """Timers alone."""
    threads = {**CHAIN["threads"], "b": {"processor": "pc", "period": "100 ms", "compute_execution_time": "25 ms"}}
    data = CHAIN | {"threads": threads}
    assert all("safe bounds" not in text for text in told(data))
