"""Who waits in flows whose limits are broken, and which single shorter time would keep these."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import dse
from dse.report.content.explain import explanation_page

PROBLEM: dict[str, Any] = {
    "dse": 1, "name": "latency and contention", "processing": "response_time", "objectives": ["minimise price"],
    "processor_types": {"cpu": {"cores": 1, "price": "1 EUR"}}, "processors": {"pc": {"type": "cpu"}},
    "devices": {"sensor": {"period": "20 ms"}},
    "threads": {
        "fast": {"processor": "pc", "period": "10 ms", "compute_execution_time": "4 ms"},
        "nav": {"processor": "pc", "period": "20 ms", "compute_execution_time": "5 ms"},
    },
    "connections": {"s": {"from": "sensor", "to": "nav"}}, "flows": {"f": {"path": ["sensor", "nav"]}},
    "requirements": ["latency of f <= 27 ms"],
}  # fmt: skip


def told(data: dict[str, Any]) -> str:
    page = explanation_page(dse.explain(data))
    return "\n".join(text for section in page.sections for text in section.texts)


def test_contention_in_a_latency() -> None:
    """20 + 5 + 4 ms: 2 ms less of either is enough, and no less is."""
    enough = "latency of f <= 27 ms holds with 2 ms less of nav each time, or 2 ms less of fast each time"
    assert f"nav waits 4 ms behind 1 job of fast (4 ms) on core 1 of pc; {enough}" in told(PROBLEM)
    [relaxation] = dse.explain(PROBLEM).to_dict()["relaxations"]
    [delayed] = relaxation["delayed"]
    assert delayed["requirement"] == "latency of f <= 27 ms"
    [waiting] = delayed["waiting"]
    assert (waiting["threads"], waiting["waited_ns"]) == (["nav"], 4_000_000)
    assert waiting["waits"][0]["delays"] == [{"name": "fast", "jobs": 1, "work_ns": 4_000_000}]
    for item in delayed["shorter"]:
        for more, status in ((0, "feasible"), (1, "infeasible")):
            data = deepcopy(PROBLEM)
            thread = data["threads"][item["name"]]
            longest = int(thread["compute_execution_time"].split()[0]) * 10**6
            thread["compute_execution_time"] = f"{longest - item['by_ns'] + more} ns"
            assert dse.explain(data).status == status


def test_threads_in_a_row_wait_together() -> None:
    """What delays both is told once, with how much longer the flow takes for it."""
    data = deepcopy(PROBLEM) | {"requirements": ["latency of f <= 20 ms"]}
    data["threads"]["act"] = {"processor": "pc", "dispatch_protocol": "aperiodic", "compute_execution_time": "1 ms"}
    data["connections"]["c2"] = {"from": "nav", "to": "act"}
    data["flows"]["f"]["path"].append("act")
    assert "nav and act wait together 4 ms behind 1 job of fast (4 ms) on core 1 of pc" in told(data)


def test_nothing_waits_in_a_latency() -> None:
    """20 + 5 ms by itself: 1 ms less of it is enough."""
    data = deepcopy(PROBLEM) | {"requirements": ["latency of f <= 24 ms"]}
    del data["threads"]["fast"]
    assert "latency of f <= 24 ms holds with 1 ms less of nav each time" in told(data)
    assert "waits" not in told(data)
    [relaxation] = dse.explain(data).to_dict()["relaxations"]
    assert relaxation["delayed"][0]["waiting"] == []


def test_who_waits_is_told_of_a_limit_that_no_single_time_keeps() -> None:
    data = deepcopy(PROBLEM) | {"requirements": ["latency of f <= 19 ms"]}
    assert "for latency of f <= 19 ms nav waits 4 ms behind 1 job of fast (4 ms) on core 1 of pc" in told(data)


def test_a_thread_of_a_flow_without_a_bound() -> None:
    """Of 4 + 13 ms in 20 ms nothing is left for a third of 4 ms: it needs 105 %, and is bounded with 1 ms less."""
    data = deepcopy(PROBLEM)
    data |= {"overload": "allowed", "requirements": ["latency of f <= 60 ms"]}
    data["threads"]["fast"] |= {"period": "20 ms"}
    data["threads"]["more"] = {"processor": "pc", "period": "20 ms", "compute_execution_time": "13 ms", "priority": 2}
    data["threads"]["nav"]["compute_execution_time"] = "4 ms"
    text = told(data)
    assert (
        "nav has no bound on core 1 of pc: it and the threads of higher priority need 105 % of core 1 of pc; "
        "bounded with" in text
    )
    assert (
        "bounded with 1 ms less of nav each time, or 1 ms less of more each time, or 1 ms less of fast each time"
        in text
    )
    [relaxation] = dse.explain(data).to_dict()["relaxations"]
    [late] = relaxation["late"]
    assert (late["limit_ns"], late["full"]) == (None, {"processor": "pc", "core": 1, "share_ppm": 1_050_000})


def test_without_response_times_nobody_waits() -> None:
    """Where each thread counts as if alone nothing of that kind is told."""
    data = deepcopy(PROBLEM) | {"processing": "execution_time", "requirements": ["latency of f <= 20 ms"]}
    assert " waits " not in told(data)
    assert dse.explain(data).to_dict()["relaxations"][0]["delayed"] == []
