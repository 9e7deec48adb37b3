"""Why threads are late: what is named goes before them, and a cut that is said to be enough is, and no smaller one."""

from __future__ import annotations

import json
import random
from typing import Any

import pytest

import dse
from dse.analysis.diagnosis.lateness import Late, late_threads
from dse.analysis.evaluate import Evaluator
from dse.analysis.views import View
from dse.questions.problem import loads
from dse.report.content.explain import explanation_page
from dse.report.words.lateness import late_words
from tests.helpers.effort import cases

HEAD = (
    "dse: 1\nname: late\ndeadlines: all\noverload: allowed\nprocessor_types: {cpu: {}}\nprocessors: {p: {type: cpu}}\n"
)


def text_of(works: dict[str, int], others: dict[str, str]) -> str:
    """A file whose threads take so many ns."""
    lines = [
        f"  {name}: {{processor: p, compute_execution_time: {works[name]} ns, {fields}}}"
        for name, fields in others.items()
    ]
    return HEAD + "threads:\n" + "\n".join(lines) + "\nobjectives: [minimise power]\n"


def found(text: str) -> dict[str, Late]:
    space = loads(text).space
    design = (0,) * len(space.decisions)
    verdicts = Evaluator(space).evaluate(design).verdicts
    return {item.thread: item for item in late_threads(space, verdicts, View(design))}


@pytest.mark.parametrize("seed", cases(20))
def test_cuts_are_the_least_that_are_enough(seed: int) -> None:
    rng = random.Random(seed)
    works, others = {}, {}
    for number in range(4):
        period = rng.choice((8, 10, 12, 15, 20))
        works[f"t{number}"] = rng.randint(1, max(1, period * 4 // 10)) * 10**6
        others[f"t{number}"] = (
            f"period: {period} ms, priority: {rng.randint(1, 3)}, non_preemptive: {rng.randint(1, 3)} ms"
        )
        if rng.random() < 0.5:
            others[f"t{number}"] += f", deadline: {rng.randint(2, 2 * period)} ms"
    for item in found(text_of(works, others)).values():
        for cut in item.shorter:
            for by_ns, is_late in ((cut.by_ns, False), (cut.by_ns - 1, True)):
                if cut.section:
                    head, had = others[cut.name].partition("non_preemptive: ")[::2]
                    longest = min(works[cut.name], int(had.split()[0]) * 10**6)
                    left = f"{head}non_preemptive: {longest - by_ns} ns{had.removeprefix(f'{had.split()[0]} ms')}"
                    changed = text_of(works, {**others, cut.name: left})
                else:
                    changed = text_of({**works, cut.name: works[cut.name] - by_ns}, others)
                assert (item.thread in found(changed)) == is_late


def test_what_is_said_of_a_late_thread() -> None:
    """8 ms and one job of a in 10 ms would be in time; with 2 ms less, b is: 6 + 4 = 10 ms."""
    works = {"a": 4 * 10**6, "b": 8 * 10**6}
    others = {"a": "period: 10 ms", "b": "period: 20 ms, deadline: 12 ms"}
    text = text_of(works, others)
    said = (
        "b ends 4 ms late on core 1 of p: 8 ms of its own, behind 2 jobs of a (8 ms); "
        "in time with 2 ms less of b each time, or 2 ms less of a each time"
    )
    assert [late_words(item) for item in found(text).values()] == [said]
    explanation = dse.explain(loads(text))
    assert said in " ".join(text for section in explanation_page(explanation).sections for text in section.texts)


def test_without_a_bound_and_in_an_executor() -> None:
    works, others = {"a": 7 * 10**6, "b": 8 * 10**6}, {"a": "period: 10 ms", "b": "period: 20 ms"}
    [late] = found(text_of(works, others)).values()
    assert late_words(late) == (
        "b ends late without a bound on core 1 of p: it and the threads of higher priority need 110 % of core 1 of p; "
        "in time with 2 ms less of b each time, or 1 ms less of a each time"
    )
    node = "executors: {node: {kind: fifo, processor: p}}\n" + text_of(
        {"a": 4 * 10**6, "b": 5 * 10**6}, {"a": "period: 10 ms, deadline: 8 ms", "b": "period: 20 ms"}
    ).replace("processor: p, compute", "executor: node, compute").replace(HEAD, "")
    [late] = found(HEAD + node).values()
    assert late_words(late) == (
        "a ends 1 ms late on core 1 of p: 4 ms of its own, behind 1 job of b (5 ms); "
        "in time with 1 ms less of a each time, or 1 ms less of b each time"
    )


BEHIND = """
dse: 1
name: behind a late thread
processor_types: {cpu: {}, gpu: {serves: priority}}
processors: {p: {type: cpu}, g: {type: gpu}}
threads:
  before: {processor: p, period: 10 ms, segments: [
            {compute_execution_time: 1 ms}, {processor: g, compute_execution_time: 8 ms}]}
  longer: {processor: g, period: 40 ms, compute_execution_time: 6 ms}
  b: {processor: WHERE, period: 20 ms, deadline: 20 ms, compute_execution_time: 1 ms}
objectives: [minimise power]
"""


def test_behind_a_thread_without_a_bound() -> None:
    """There is enough of the core: it is not said that there is too little. One in a reservation has its budget."""
    [late] = found(BEHIND.replace("WHERE", "p")).values()
    assert (late.thread, late.late_ns, late.endless) == ("b", None, ("before",))
    assert late_words(late) == (
        "b ends late without a bound on core 1 of p because before has none; in time with 5 ms less of before "
        "(piece 2) each time, or 5 ms less of longer each time"
    )
    [relaxation] = dse.explain(BEHIND.replace("WHERE", "p")).to_dict()["relaxations"]
    assert [item["endless"] for item in relaxation["late"]] == [["before"]]
    share = "reservations: {share: {processor: p, budget: 5 ms, period: 15 ms}}\nobjectives:"
    inside = BEHIND.replace("processor: WHERE", "reservation: share").replace("objectives:", share)
    [late] = found(inside).values()
    assert late_words(late).partition(": ")[2].startswith("share does not get its 5 ms of every 15 ms")


def test_lateness_in_json() -> None:
    """What the text says, with figures; of a thread with segments what all of its pieces take."""
    works = {"a": 4 * 10**6, "b": 8 * 10**6}
    others = {"a": "period: 10 ms", "b": "period: 20 ms, deadline: 12 ms"}
    [relaxation] = dse.explain(text_of(works, others)).to_dict()["relaxations"]
    [late] = relaxation["late"]
    assert (late["thread"], late["processor"], late["core"], late["late_ns"]) == ("b", "p", 1, 4 * 10**6)
    assert late["delays"] == [{"name": "a", "jobs": 2, "work_ns": 8 * 10**6}]
    assert late["accelerators"] == []
    assert late["shorter"] == [{"name": name, "by_ns": 2 * 10**6, "section": False} for name in "ba"]
    [wait] = late["waits"]
    assert (wait["work_ns"], wait["delays"], wait["over_ns"]) == (8 * 10**6, late["delays"], 0)
    assert (late["limit_ns"], late["ends_ns"]) == (12 * 10**6, 16 * 10**6)
    pieces = (
        "{compute_execution_time: 2 ms}, {processor: g, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}"
    )
    text = HEAD.replace("{cpu: {}}", "{cpu: {}, gpu: {serves: fifo}}").replace(
        "{type: cpu}}", "{type: cpu}, g: {type: gpu}}"
    )
    text += f"threads: {{c: {{processor: p, period: 20 ms, deadline: 9 ms, segments: [{pieces}]}}}}\n"
    [item] = found(text + "objectives: [minimise power]\n").values()
    assert (item.late_ns, item.work_ns, item.delays) == (2 * 10**6, 11 * 10**6, ())
    assert late_words(item) == (
        "c ends 2 ms late on core 1 of p: 11 ms of its own, more than its 9 ms even by itself; "
        "in time with 2 ms less of c (piece 2) each time"
    )
    [relaxation] = dse.explain(text + "objectives: [minimise power]\n").to_dict()["relaxations"]
    assert [item["accelerators"] for item in relaxation["late"]] == [["g"]]
    without_last = text.replace(", {compute_execution_time: 1 ms}", "") + "objectives: [minimise power]\n"
    assert next(iter(found(without_last).values())).processor == "g"
    [said] = map(late_words, found(without_last).values())
    assert said.startswith("c ends 1 ms late on g: 10 ms of its own, more than its 9 ms even by itself; in time with")


def reserved(rng: random.Random) -> dict[str, Any]:
    """A computer with threads in a reservation and beside it."""
    period = rng.choice((5, 8, 10))
    share = {"processor": "p", "budget": f"{rng.randint(1, period)} ms", "period": f"{period} ms"}
    threads: dict[str, Any] = {}
    for number in range(rng.randint(2, 4)):
        every = rng.choice((5, 8, 10, 20, 40))
        where = {"reservation": "share"} if number == 0 or rng.random() < 0.4 else {"processor": "p"}
        threads[f"t{number}"] = {
            **where, "period": f"{every} ms", "deadline": f"{rng.randint(2, 2 * every)} ms",
            "compute_execution_time": f"{rng.randint(1, max(1, every // 3))} ms",
        }  # fmt: skip
    return {
        "dse": 1, "name": "reserved", "processing": "response_time", "overload": "allowed",
        "processor_types": {"cpu": {}}, "processors": {"p": {"type": "cpu"}}, "reservations": {"share": share},
        "threads": threads,
    }  # fmt: skip


@pytest.mark.parametrize("seed", cases(20))
def test_a_budget_that_is_said_to_be_enough_is_the_least(seed: int) -> None:
    rng = random.Random(f"budget {seed}")
    data = reserved(rng)
    share = data["reservations"]["share"]
    for item in found(json.dumps(data)).values():
        assert (item.budget is None) is ("reservation" not in data["threads"][item.thread])
        if item.budget is None:
            continue
        enough, period = item.budget.enough_ns, item.budget.period_ns
        late = {enough - 1} if enough is not None else {rng.randint(1, period) for _ in range(6)} | {period}
        for budget_ns in (late | {enough}) - {0, None}:
            share["budget"] = f"{budget_ns} ns"
            assert (item.thread in found(json.dumps(data))) is (budget_ns in late), (data, item)
        share["budget"] = f"{item.budget.budget_ns} ns"


def test_what_is_said_of_a_budget() -> None:
    """11 ms without it, then 4 of its 4.5; 4 of every 10 ms are left of a core that has 3 of every 5 to do."""
    head = HEAD + "objectives: [minimise price]\n"
    text = f"""{head}reservations: {{share: {{processor: p, budget: 3 ms, period: 10 ms}}}}
threads:
  a: {{reservation: share, period: 20 ms, deadline: 15 ms, compute_execution_time: 4 ms}}
  b: {{processor: p, period: 10 ms, compute_execution_time: 1 ms}}
"""
    enough = "in time with 3 ms less of a each time, or a budget of 4.5 ms instead of 3 ms of share"
    assert late_words(found(text)["a"]).endswith(enough)
    endless = "a ends late without a bound on core 1 of p: "
    small = text.replace("budget: 3 ms", "budget: 1 ms")
    needs = "it and the threads of higher priority need more than share has, 1 ms of every 10 ms"
    assert (
        late_words(found(small)["a"]) == f"{endless}{needs}; in time with a budget of 4.5 ms instead of 1 ms of share"
    )
    text = text.replace("budget: 3 ms", "budget: 6 ms").replace(
        "period: 20 ms, deadline: 15", "period: 40 ms, deadline: 30"
    )
    busy = text.replace("period: 10 ms, compute_execution_time: 1", "period: 5 ms, compute_execution_time: 3")
    gets = "share does not get its 6 ms of every 10 ms after the threads of higher priority"
    enough = "in time with 1 ms less of b each time, or a budget of 2 ms instead of 6 ms of share"
    assert late_words(found(busy)["a"]) == f"{endless}{gets}; {enough}"
    [relaxation] = dse.explain(busy).to_dict()["relaxations"]
    assert relaxation["late"][0]["budget"] == {
        "reservation": "share", "budget_ns": 6_000_000, "period_ns": 10_000_000, "is_served": False,
        "enough_ns": 2_000_000,
    }  # fmt: skip


def test_what_has_no_bound_for_its_segments_is_not_said_to_need_more_than_its_core_has() -> None:
    """Two pieces of 12 ms every 20 ms do not fit on an accelerator, however little the core has to do."""
    text = HEAD.replace("{cpu: {}}", "{cpu: {}, gpu: {serves: fifo}}").replace(
        "{type: cpu}}", "{type: cpu}, g: {type: gpu}}"
    )
    ends = "{compute_execution_time: 1 ms}"
    pieces = f"[{ends}, {{processor: g, compute_execution_time: 12 ms}}, {ends}]"
    text += "threads:\n" + "".join(f"  {name}: {{processor: p, period: 20 ms, segments: {pieces}}}\n" for name in "cd")
    for item in found(text + "objectives: [minimise power]\n").values():
        said = "it and the threads of higher priority need 120 % of g; in time with "
        assert late_words(item).startswith(f"{item.thread} ends late without a bound on core 1 of p: {said}")
        assert item.late_ns is None
