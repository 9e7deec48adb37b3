"""The sentences name the right decision, gain, loss and requirement, on a front worked out by hand.

The flow is source -> worker -> sink. The worker on `slow` takes 4 ms, on `fast` 1 ms (best times 0); its period is 10
or 20 ms. Jitter: period + execution. Utilisation: 4 ms / 20 ms = 20 %, 4 / 10 = 40 %, 1 / 20 = 5 %, 1 / 10 = 10 %.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

import dse
from dse.answers.ranking.changes import Change
from dse.answers.ranking.order import ranked_by
from dse.answers.ranking.reasons import Reasoner
from dse.answers.result import Result
from dse.report.amounts import margin_words
from dse.report.words.reasons import baseline_words, changes_words, sentences, tie_words

PROBLEM = """
dse: 1
name: By hand
processor_types:
  slow: {price: 100 EUR}
  fast: {price: 300 EUR}
processors: {cpu: {type: [slow, fast]}}
devices: {source: {period: 10 ms}, sink: {dispatch_protocol: aperiodic}}
threads:
  worker:
    processor: cpu
    dispatch_protocol: periodic
    period: [10 ms, 20 ms]
    compute_execution_time: {slow: 0 ns .. 4 ms, fast: 0 ns .. 1 ms}
connections: {one: {from: source, to: worker}, two: {from: worker, to: sink}}
flows: {main: {path: [source, worker, sink]}}
requirements: [jitter of main <= 24 ms, utilisation of cpu <= 50 %]
objectives: [minimise jitter of main, minimise price]
baseline: {cpu: {type: slow}, worker: {period: 20 ms}}
processing: execution_time
"""


@pytest.fixture(scope="module")
def result() -> Result:
    return dse.solve(dse.loads(PROBLEM))


def said(result: Result, number: int) -> dict[str, str]:
    """The sentences about the point with that id, by label."""
    position = next(at for at, point in enumerate(result.front) if point.id == number)
    return {item.label: item.text for item in sentences(result, Reasoner(result).reasons(position))}


def test_the_front_is_the_one_worked_out(result: Result) -> None:
    found = {(point.rank, *point.decisions.values(), *point.objectives.values()) for point in result.front}
    assert found == {(1, "slow", "10 ms", 14_000_000, 10_000), (1, "fast", "10 ms", 11_000_000, 30_000)}
    assert tie_words(result) == "Ties: #1, #2 at rank 1."


def test_against_the_baseline(result: Result) -> None:
    fast = next(point.id for point in result.front if point.decisions["cpu.type"] == "fast")
    assert said(result, fast)["Against the baseline"] == (
        "Changes cpu from slow to fast; worker.period from 20 ms to 10 ms. "
        "Gains: jitter of main 11 ms instead of 24 ms (13 ms less). "
        "Losses: price 300 EUR instead of 100 EUR (200 EUR more)."
    )


def test_against_the_neighbour(result: Result) -> None:
    slow, fast = (
        next(point.id for point in result.front if point.decisions["cpu.type"] == kind) for kind in ("slow", "fast")
    )
    label = next(label for label in said(result, 2) if label.startswith("Against #1"))
    assert label == "Against #1, ranked above and its neighbour on the front"
    expected = {
        slow: "Changes cpu from fast to slow. Gains: price 100 EUR instead of 300 EUR (200 EUR less). "
        "Losses: jitter of main 14 ms instead of 11 ms (3 ms more).",
        fast: "Changes cpu from slow to fast. Gains: jitter of main 11 ms instead of 14 ms (3 ms less). "
        "Losses: price 300 EUR instead of 100 EUR (200 EUR more).",
    }
    assert said(result, 2)[label] == expected[2]


def test_binding_requirement_dominant_and_next_step(result: Result) -> None:
    slow, fast = (
        next(point.id for point in result.front if point.decisions["cpu.type"] == kind) for kind in ("slow", "fast")
    )
    words = said(result, slow)
    # 40 % of 50 % leaves 20 % of the limit; the jitter of 14 ms leaves 10 ms of 24 ms
    assert (
        words["Tightest requirement"]
        == "utilisation of cpu <= 50 %: 40 % against 50 %, slack 10 percentage points (20 % of the limit)."
    )
    assert words["Largest part of the latency of main"] == "worker (sampling), 10 ms of 14 ms (71.4 %)."
    assert words["Among all designs"] == "Least price of the front."
    assert words["To better price"] == "No feasible design is better: proved."
    assert words["To better jitter of main"] == (
        f"#{fast} has 3 ms less, for price 200 EUR more (66.67 EUR per ms). Changes cpu from slow to fast."
    )
    assert said(result, fast)["Tightest requirement"].startswith(
        "jitter of main <= 24 ms: 11 ms against 24 ms, slack 13 ms"
    )


def test_a_requirement_without_slack_binds() -> None:
    exact = dse.solve(dse.loads(PROBLEM), max_jitter="11ms")
    assert (
        said(exact, 1)["Tightest requirement"]
        == "jitter of main <= 11 ms: 11 ms against 11 ms. It binds: there is no slack."
    )


def test_one_core_binds_before_the_processor() -> None:
    cores = PROBLEM.replace("slow: {price", "slow: {cores: 2, price")
    found = dse.solve(dse.loads(cores), fix="cpu.type = slow", require="utilisation of cpu <= 40 %")
    assert said(found, 1)["Tightest requirement"] == (
        "utilisation of cpu <= 40 %: worker alone, 40 % against 40 % of one core. It binds: there is no slack."
    )


def test_every_requirement_without_slack_is_named(result: Result) -> None:
    exact = dse.solve(dse.loads(PROBLEM), max_jitter="14ms", max_utilisation="40%", fix="cpu.type = slow")
    assert said(exact, 1)["Tightest requirements"] == (
        "jitter of main <= 14 ms: 14 ms against 14 ms. It binds: there is no slack. "
        "utilisation of cpu <= 40 %: 40 % against 40 %. It binds: there is no slack."
    )


def test_a_limit_says_what_it_is_a_share_of() -> None:
    cores = PROBLEM.replace("slow: {price", "slow: {cores: 4, price")
    many = cores.replace("threads:", "threads:\n  other: {processor: cpu, period: 10 ms, compute_execution_time: 4 ms}")
    found = dse.solve(dse.loads(many), fix=["cpu.type = slow", "worker.period = 10 ms"])
    margins = Reasoner(found).reasons(0).margins
    whole = next(item for item in margins if not item.thread and item.limit == 2_000_000)
    # 40 % + 40 % of one core, against half of four
    assert margin_words(whole, "EUR") == (
        "utilisation of cpu <= 50 %: 80 % against 200 % (50 % of each of 4 cores), "
        "slack 120 percentage points (60 % of the limit)."
    )


def test_an_equality_is_no_tight_limit_and_a_limit_of_nothing_has_no_share() -> None:
    found = dse.solve(dse.loads(PROBLEM), require=["price == 100 EUR", "min latency of main >= 0 ms"])
    margins = Reasoner(found).reasons(0).margins
    assert {item.requirement.operator for item in margins} == {"<=", ">="}
    zero = next(item for item in margins if item.requirement.operator == ">=")
    assert margin_words(replace(zero, value=Fraction(1_000_000)), "EUR") == (
        "min latency of main >= 0 ms: 1 ms against 0 ms, slack 1 ms."
    )


def test_a_difference_of_shares_is_in_percentage_points() -> None:
    shares = PROBLEM.replace("minimise price]", "minimise utilisation of cpu]")
    found = dse.solve(dse.loads(shares), fix="cpu.type = fast")
    slower = next(point.id for point in found.front if point.decisions["worker.period"] == "20 ms")
    faster = next(point.id for point in found.front if point.decisions["worker.period"] == "10 ms")
    assert said(found, faster)["To better utilisation of cpu"] == (
        f"#{slower} has 5 percentage points less, for jitter of main 10 ms more (2 ms per percentage point). "
        "Changes worker.period from 10 ms to 20 ms."
    )


def test_what_is_shared_is_said_to_be() -> None:
    found = dse.solve(dse.loads(PROBLEM.replace("minimise price]", "minimise price, minimise utilisation of cpu]")))
    words = [said(found, point.id)["Among all designs"] for point in found.front]
    assert "Least price (shared with 1 other) of the front." in words


def test_a_problem_without_a_baseline_says_so() -> None:
    bare = dse.solve(dse.loads(PROBLEM.partition("baseline:")[0]))
    assert baseline_words(Reasoner(bare)) == "The problem states no complete baseline to compare with."


def test_closest_to_the_baseline_counts_decisions(result: Result) -> None:
    ranked = ranked_by(result, "baseline")
    assert [(point.rank, point.decisions["cpu.type"], point.score) for point in ranked.front] == [
        (1, "slow", "1 change"),
        (2, "fast", "2 changes"),
    ]
    assert {point.id for point in ranked.front} == {1, 2}


def test_what_follows_from_a_decision_is_no_change_of_its_own() -> None:
    text = PROBLEM.replace("dispatch_protocol: periodic", "dispatch_protocol: [periodic, aperiodic]").replace(
        "{period: 20 ms}}", "{dispatch_protocol: periodic, period: 20 ms}}"
    )
    found = dse.solve(dse.loads(text), fix=["cpu.type = slow", "worker.dispatch_protocol = aperiodic"])
    assert said(found, 1)["Against the baseline"].startswith(
        "Changes worker.dispatch_protocol from periodic to aperiodic (with it: no worker.period). Gains: jitter of main"
    )
    assert ranked_by(found, "baseline").front[0].score == "1 change"


def test_where_there_is_little_room_whole_changes_are_left_out() -> None:
    changes = [Change(f"t{number}.period", "1 ms", "2 ms", follows=False) for number in range(4)]
    assert changes_words(changes, 2) == (
        "Changes t0.period from 1 ms to 2 ms; t1.period from 1 ms to 2 ms; and 2 more changes"
    )
    assert changes_words(changes[:3], 2) == changes_words(changes[:3])
