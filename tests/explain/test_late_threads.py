"""Why threads are late: what is named goes before them, and a cut that is said to be enough is, and no smaller one."""

from __future__ import annotations

import random

import pytest
from effort import cases

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.lateness import Late, late_threads
from dse.analysis.views import View
from dse.api.problem import loads
from dse.report.explain import explanation_page, late_words

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
                changed = {**works, cut.name: works[cut.name] - by_ns}
                assert (item.thread in found(text_of(changed, others))) == is_late


def test_what_is_said_of_a_late_thread() -> None:
    """8 ms and one job of a in 10 ms would be in time; with 2 ms less, b is: 6 + 4 = 10 ms."""
    works = {"a": 4 * 10**6, "b": 8 * 10**6}
    others = {"a": "period: 10 ms", "b": "period: 20 ms, deadline: 12 ms"}
    text = text_of(works, others)
    said = (
        "b ends 4 ms late on core 1 of p: 8 ms of its own, behind 2 x a (8 ms); "
        "in time with 2 ms less of b each time, or 2 ms less of a each time"
    )
    assert [late_words(item) for item in found(text).values()] == [said]
    explanation = dse.explain(loads(text))
    assert said in " ".join(text for section in explanation_page(explanation).sections for text in section.texts)


def test_without_a_bound_and_in_an_executor() -> None:
    works, others = {"a": 7 * 10**6, "b": 8 * 10**6}, {"a": "period: 10 ms", "b": "period: 20 ms"}
    [late] = found(text_of(works, others)).values()
    assert (late.late_ns, late.shorter) == (None, ())
    assert late_words(late).startswith("b ends late without a bound on core 1 of p")
    node = "executors: {node: {kind: fifo, processor: p}}\n" + text_of(
        {"a": 4 * 10**6, "b": 5 * 10**6}, {"a": "period: 10 ms, deadline: 8 ms", "b": "period: 20 ms"}
    ).replace("processor: p, compute", "executor: node, compute").replace(HEAD, "")
    [late] = found(HEAD + node).values()
    assert late_words(late) == "a ends 1 ms late on core 1 of p: 4 ms of its own, behind 1 x b (5 ms)"


def test_lateness_in_json() -> None:
    """What the text says, with figures; of a thread with segments what all of its pieces take."""
    works = {"a": 4 * 10**6, "b": 8 * 10**6}
    others = {"a": "period: 10 ms", "b": "period: 20 ms, deadline: 12 ms"}
    [relaxation] = dse.explain(text_of(works, others)).to_dict()["relaxations"]
    [late] = relaxation["late"]
    assert (late["thread"], late["processor"], late["core"], late["late_ns"]) == ("b", "p", 1, 4 * 10**6)
    assert late["delays"] == [{"name": "a", "jobs": 2, "work_ns": 8 * 10**6}]
    assert late["shorter"] == [{"name": "b", "by_ns": 2 * 10**6}, {"name": "a", "by_ns": 2 * 10**6}]
    pieces = (
        "{compute_execution_time: 2 ms}, {processor: g, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}"
    )
    text = HEAD.replace("{cpu: {}}", "{cpu: {}, gpu: {serves: fifo}}").replace(
        "{type: cpu}}", "{type: cpu}, g: {type: gpu}}"
    )
    text += f"threads: {{c: {{processor: p, period: 20 ms, deadline: 9 ms, segments: [{pieces}]}}}}\n"
    [item] = found(text + "objectives: [minimise power]\n").values()
    assert (item.late_ns, item.work_ns, item.delays, item.shorter) == (2 * 10**6, 11 * 10**6, (), ())
    assert late_words(item).endswith("11 ms of its own, behind what its segments wait for on cores and accelerators")
