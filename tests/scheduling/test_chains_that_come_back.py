"""A chain that comes back to a core: it may have no bound though no core is full (docs/semantics.md, section 4.9).

P. R. Kumar and S. H. Lu's network ("Distributed scheduling based on due dates and buffer priorities", IEEE Transactions
on Automatic Control 36, 1991): two cores that each work 75 % of the time, fixed execution times, one timer.
"""

from __future__ import annotations

import dse
from dse.answers.ranking.reasons import Reasoner
from dse.questions.verbs.simulate import simulate
from dse.report.content.explain import explanation_page
from dse.report.words.reasons import sentences
from dse.report.words.scheduling import GROWS, response_tables
from dse.support.units import Exact

MS = 10**6
TEXT = """
dse: 1
name: A chain that comes back
processor_types: {pc: {cores: 2, price: 10 EUR}}
processors: {computer: {type: pc}}
threads:
  a: {processor: computer, core: 1, priority: 1, period: 4 ms, compute_execution_time: 1 ms}
  b: {processor: computer, core: 2, priority: 2, dispatch_protocol: aperiodic, compute_execution_time: 2.5 ms}
  c: {processor: computer, core: 2, priority: 1, dispatch_protocol: aperiodic, compute_execution_time: 0.5 ms}
  d: {processor: computer, core: 1, priority: 2, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
connections: {ab: {from: a, to: b}, bc: {from: b, to: c}, cd: {from: c, to: d}}
flows: {chain: {path: [a, b, c, d]}}
objectives: [minimise latency of chain]
"""


def longest_seen(duration: str) -> Exact:
    """The longest latency in a run of this length in which all queues have room, in ns."""
    played = simulate(dse.loads(TEXT), runs=1, duration=duration, execution="max", endless_queues=True)
    [flow] = played.flows
    assert played.exit_code == 0 and not played.lost
    return max(flow.latencies)


def test_latencies_grow_with_the_run() -> None:
    seen = [longest_seen(duration) for duration in ("200 ms", "400 ms", "800 ms")]
    assert seen == [42.5 * MS, 106.5 * MS, 191 * MS]


def test_the_reason_is_not_that_a_core_is_full() -> None:
    analysis = dse.analyse(dse.loads(TEXT))
    [table] = response_tables(analysis.responses)
    said = {row[table.label]: row[-1] for row in table.rows}
    assert said == {
        "a": "no bound, for d has none",
        "b": "no bound, for a has none",
        "c": GROWS,
        "d": "no bound, for c has none",
    }
    assert all(verdict.holds for verdict in analysis.verdicts)


def test_explain_says_that_the_threads_fit_on_the_core() -> None:
    found = dse.explain(dse.loads(f"{TEXT}requirements: [latency of chain <= 20 ms]\n"))
    said = " ".join(text for section in explanation_page(found).sections for text in section.texts)
    assert "% of core" not in said
    assert "a has no bound on core 1 of computer because d has none" in said
    assert (
        "c has no bound on core 2 of computer: it and the threads of higher priority fit on the core, but the later it "
        "ends, the closer together come the jobs that it waits for" in said
    )


def test_a_front_without_a_bound_names_all_rows() -> None:
    result = dse.solve(dse.loads(TEXT))
    said = {item.label: item.text for item in sentences(result, Reasoner(result).reasons(0))}
    assert said["Largest part of the latency of chain"].endswith("d (response time (unbounded)), which have no bound.")
    assert said["Largest part of the jitter of chain"].endswith("c (response time (unbounded)), which has no bound.")


def test_a_bound_with_other_priorities() -> None:
    """Where a goes before d the chain takes 7 ms at most."""
    text = TEXT.replace("core: 1, priority: 1", "core: 1, priority: 3")
    assert dse.analyse(dse.loads(text)).metrics["latency of chain"] == 7 * MS
