"""What OSATE prints beside the latencies, and notes where its quirks act: small problems, figures by hand."""

from __future__ import annotations

import re
from typing import Any

import pytest

import dse
from dse.answers.analysis import Analysis, FlowTable
from dse.report.content.analyse import analysis_page
from dse.report.page import Text
from tests.helpers.small import MS

HEAD = "dse: 1\nname: small\nprofile: osate-2.19\n"
CHAIN = """
devices:
  s: {period: 5 ms, latency: 1 ms .. 2 ms}
  d: {compute_execution_time: 1 ms .. 4 ms, latency: 2 ms .. 3 ms}
"""


def analysed(text: str, **settings: Any) -> Analysis:
    return dse.analyse(dse.loads(HEAD + text), **settings)


def flow(text: str, **settings: Any) -> FlowTable:
    return analysed(text, **settings).flows[0]


BUSES = """
bus_types:
  timed: {transmission_time: {fixed: 1 ms .. 2 ms}, latency: 300 us .. 5 ms}
  untimed: {latency: 1 ms .. 3 ms}
  bare: {transmission_time: {fixed: 1 ms .. 2 ms}}
buses: {w: {type: KIND}}
connections: {c: {from: s, to: d, data_size: 0 B, bus: w, latency: 7 ms .. 8 ms}}
flows: {f: {path: [s, d], latency: LATENCY}}
"""


@pytest.mark.parametrize(
    ("kind", "specified", "rows"),
    [
        # the bus's latency is specified, whatever it takes; the sender's 1 .. 2 and the receiver's 2 .. 3
        ("timed", (3.3, 10), ("transmission time", 1, 2)),
        ("untimed", (4, 8), ("specified", 1, 3)),
        # nothing is specified for the bus: the connection's own 7 .. 8 counts in the specified total, and nowhere else
        ("bare", (10, 13), ("transmission time", 1, 2)),
    ],
)
def test_the_specified_column(kind: str, specified: tuple[float, float], rows: tuple[str, int, int]) -> None:
    found = flow(CHAIN + BUSES.replace("KIND", kind).replace("LATENCY", "0 ms .. 90 ms"))
    assert found.specified_ns == tuple(round(end * MS) for end in specified)
    [carried] = [row for row in found.rows if row.medium == "w" and row.max_method != "queued"]
    assert (carried.max_method, carried.min_ns, carried.max_ns) == (rows[0], rows[1] * MS, rows[2] * MS)


@pytest.mark.parametrize(("kind", "specified"), [("timed", (3.3, 10)), ("untimed", (4, 8)), ("bare", (3, 5))])
def test_the_column_of_2014_has_no_latency_of_a_connection(kind: str, specified: tuple[float, float]) -> None:
    """What OSATE says of the flow is today's; the profile `dse` has no such column."""
    text = CHAIN + BUSES.replace("KIND", kind).replace("LATENCY", "0 ms .. 90 ms")
    found = dse.analyse(dse.loads(HEAD.replace("osate-2.19", "osate-2.2") + text)).flows[0]
    assert (found.specified_ns, found.findings) == (tuple(round(end * MS) for end in specified), ())
    assert dse.analyse(dse.loads(HEAD.replace("osate-2.19", "dse") + text)).flows[0].specified_ns is None


@pytest.mark.parametrize(
    ("latency", "said"),
    [
        # actual 1 + 1 + 1 .. 2 + 2 + 4 + 0 (d is not periodic), specified 3.3 .. 10
        ("0 ms .. 20 ms", []),
        ("0 ms .. 9 ms", ["error: the maximum specified total 10 ms exceeds the maximum 9 ms of the flow"]),
        (
            "3 ms .. 7 ms",
            ["maximum specified total 10 ms", "maximum actual total 8 ms", "actual total, 5 ms, exceeds"],
        ),
        ("4 ms .. 20 ms", ["minimum specified total 3.3 ms is below", "minimum actual total 3 ms is below"]),
        ("0 ms .. 2 ms", ["minimum specified total 3.3 ms exceeds", "minimum actual total 3 ms exceeds"]),
    ],
)
def test_verdicts_on_actual_and_specified_totals(latency: str, said: list[str]) -> None:
    found = flow(CHAIN + BUSES.replace("KIND", "timed").replace("LATENCY", latency))
    texts = [f"{item.severity}: {item.text}" for item in found.findings]
    assert texts[0] == "warning: d takes 4 ms, specified are at most 3 ms"
    for one in said:
        assert any(one in text for text in texts), (one, texts)
    assert said or len(texts) == 1


IMMEDIATE = """
threads:
  a: {dispatch_protocol: periodic, period: 10 ms, compute_execution_time: 1 ms .. 3 ms}
  b: {dispatch_protocol: periodic, period: 10 ms, deadline: 6 ms, compute_execution_time: 1 ms .. 3500 us}
connections: {c: {from: a, to: b, port: data, timing: immediate}}
flows: {f: {path: [a, b], latency: 0 ms .. 20 ms}}
"""


def test_an_immediate_chain_has_to_end_by_the_deadline() -> None:
    [found] = flow(IMMEDIATE, worst_case="execution_time").findings
    told = "error: the immediate connections up to b end after 6.5 ms, its deadline is 6 ms"
    assert f"{found.severity}: {found.text}" == told
    assert not flow(IMMEDIATE.replace("3500 us", "3 ms"), worst_case="execution_time").findings


TWO = """
threads:
  a: {dispatch_protocol: periodic, period: 5 ms, compute_execution_time: 1 ms}
  b: {dispatch_protocol: periodic, period: 10 ms, compute_execution_time: 2 ms}
connections: {c: {from: a, to: b, port: data, BUS}}
"""
Q1 = TWO.replace(", BUS", "") + "flows: {f: {path: [a, b]}, g: {path: [f]}}"
WIRE = "bus_types: {w: {transmission_time: {fixed: 1 ms}, period: PERIOD}}\nbuses: {w: {type: w}}\n"
ON_W = "data_size: 0 B, bus: w"
Q2 = WIRE.replace(", period: PERIOD", "") + TWO.replace("BUS}", f"{ON_W}}}, e: {{from: s, to: d, {ON_W}}}")[:-2]
Q2 += """}
devices: {s: {latency: 1 ms, period: 50 ms}, d: {latency: 1 ms}}
flows: {f: {path: [a, b]}, g: {path: [a, b]}, h: {path: [s, d]}}
"""
Q6 = "threads: {a: {deadline: 1 ms, compute_execution_time: 500 us .. 3 ms}}\nflows: {f: {path: [a]}}"
Q5 = """
partitions: {one: {period: 4 ms}, two: {period: 6 ms}}
threads:
  a: {partition: one, compute_execution_time: 1 ms}
  b: {partition: two, dispatch_protocol: periodic, period: 10 ms, compute_execution_time: 2 ms}
connections: {c: {from: a, to: b, port: data}}
flows: {f: {path: [a, b]}}
"""
Q7 = WIRE.replace("PERIOD", "8 ms") + TWO.replace("BUS", "data_size: 0 B, bus: w") + "flows: {f: {path: [a, b]}}"
Q4 = "partitions: {one: {period: 4 ms}}\nthreads: {a: {partition: one, period: 8 ms}}\nflows: {f: {path: [a]}}"


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        # b samples every 5 ms, as its sender does: 1 + 2 .. 1 + 5 + 2
        (Q1, {}, "OSATE counts no sampling and no queues: with them it takes 3 ms .. 8 ms"),
        # 1 + 1 + 2 .. 1 + 1 + 5 + 2, and 1 ms for e on the bus
        (Q2, {}, "OSATE counts the bus queue of c in the last flow over it alone: with it f takes 4 ms .. 10 ms"),
        (Q6, {"worst_case": "deadline"}, "OSATE counts its deadline of 1 ms: with the execution time f takes up"),
        # 1 + 2 and the period less the frame, 10 - 6
        (Q5, {}, "OSATE adds 4 ms to the minimum of f as well, which is 3 ms without it"),
        (Q7, {"system": "synchronous"}, "OSATE adds the period 8 ms of what carries c to the minimum as well"),
        (Q4, {}, "f starts with a, which is periodic: OSATE does not take its partition one for the beginning"),
    ],
)  # fmt: skip
def test_a_quirk_is_noted_where_it_acts(text: str, settings: dict[str, Any], said: str) -> None:
    found = analysed(text, **{"worst_case": "execution_time", **settings})
    assert any(said in warning for warning in found.warnings), found.warnings
    others = dse.analyse(dse.loads(HEAD.replace("osate-2.19", "dse") + text.replace("partition: one, ", "")))
    assert not any("OSATE" in warning for warning in others.warnings)


def test_a_flow_that_leads_through_itself_is_refused() -> None:
    with pytest.raises(dse.ProblemError, match='the flow "f" leads through itself'):
        dse.loads(HEAD + TWO.replace(", BUS", "") + "flows: {f: {path: [a, g]}, g: {path: [f, b]}}")


def test_a_flow_of_flows_counts_everything_under_our_own_rules() -> None:
    found = dse.analyse(dse.loads(HEAD.replace("osate-2.19", "dse") + Q1))
    assert found.flows[0].max_ns == found.flows[1].max_ns


def test_what_the_rules_do_not_look_at_is_told() -> None:
    """Before, protocols, timing and partitions under profile dse, and a latency from the bandwidth, went in silence."""
    text = Q5.replace("port: data}", "port: data, timing: delayed}")
    remarks = dse.check(dse.loads(HEAD.replace("osate-2.19", "dse") + text)).remarks
    told = "profile dse does not look at what only the osate profiles count: timing of c; partition of a, b"
    assert told in remarks
    assert not any("does not look at" in item for item in dse.check(dse.loads(HEAD + text)).remarks)
    wired = WIRE.replace("{fixed: 1 ms}, period: PERIOD", "from bandwidth, bandwidth: 1 Mbit/s, latency: 1 ms")
    remarks = dse.check(dse.loads(HEAD + wired + TWO.replace("BUS", ON_W) + "flows: {f: {path: [a, b]}}")).remarks
    assert any("on w messages take the `latency` of the bus" in item for item in remarks), remarks


def test_the_screen_says_how_many_findings_there_are_and_how_to_see_them() -> None:
    """Before, only those who asked for everything learned that OSATE reports errors."""
    text = (
        HEAD
        + """
devices: {a: {period: 10 ms, compute_execution_time: 1 ms}, b: {period: 5 ms, compute_execution_time: 1 ms}}
connections: {c: {from: a, to: b, port: data}}
flows: {f: {path: [a, b], latency: 5 ms .. 6 ms}}
"""
    )
    found = dse.analyse(dse.loads(text))
    count = len(found.flows[0].findings)
    assert count
    [section] = [item for item in analysis_page(found).sections if item.name == "overview"]
    [said] = [item for item in section.blocks if isinstance(item, Text) and "OSATE" in item.text]
    assert said.brief.endswith("(--all).") and sum(map(int, re.findall(r"\d+", said.brief))) == count
