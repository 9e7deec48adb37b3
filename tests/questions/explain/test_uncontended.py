"""What clashes even if no thread waited for another, and what overloads hide, against every design."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from fractions import Fraction
from typing import Any, Literal

import pytest

import dse
from dse.analysis.diagnosis.without_contention import uncontended_limit
from dse.analysis.limits import judge
from dse.analysis.validity import is_broken
from dse.analysis.views import View
from dse.answers.explanation import Example, Explanation
from dse.questions.explain.explain import Explainer, Wishes
from dse.questions.explain.without_contention import Uncontended
from dse.questions.problem import load
from dse.report.content.explain import explanation_page
from dse.search.feasibility.oracle import Oracle
from dse.space.model.criteria import Requirement, Rule
from dse.space.model.space import Design
from tests.helpers.conflicting import structural_designs
from tests.helpers.effort import cases
from tests.helpers.thread_systems import KINDS, draw, text_of


def drawn(source: random.Random) -> dict[str, Any]:
    """Two computers, one of them with two cores in one of its types, threads in a chain and beside it."""
    threads: dict[str, Any] = {}
    for number, name in enumerate("abcde"[: source.choice((3, 4, 5))]):
        work = source.choice((1, 2, 3, 4, 6))
        thread: dict[str, Any] = {
            "processor": source.choice(("p", "p", "q", ["p", "q"])),
            "compute_execution_time": {"slow": f"{2 * work} ms", "fast": f"{work} ms"},
        }
        if number and source.random() < 0.3:
            thread["dispatch_protocol"] = "aperiodic"
        else:
            thread["period"] = f"{source.choice((8, 10, 12, 20, 40))} ms"
        if source.random() < 0.2:
            thread["deadline"] = f"{source.choice((3, 6, 9, 15))} ms"
        threads[name] = thread
    path = list(threads)[: source.choice((2, 3))]
    senders = zip(threads, list(threads)[1:], strict=False)
    types = {
        "slow": {"cores": source.choice((1, 2)), "price": "10 EUR"},
        "fast": {"cores": source.choice((1, 2)), "price": "30 EUR"},
    }
    asked = [
        f"latency of f <= {source.choice((10, 15, 25, 40, 60))} ms",
        f"jitter of f <= {source.choice((5, 10, 20, 40))} ms",
        f"price <= {source.choice((20, 40, 60))} EUR",
    ]
    rules = ["forbid p.type = fast and q.type = slow", "require p.type = q.type", "forbid p.type = fast"]
    return {
        "dse": 1,
        "name": "drawn",
        "processing": "response_time",
        "deadlines": source.choice(("all", "stated")),
        "processor_types": types,
        "processors": {name: {"type": source.choice((["slow"], ["slow", "fast"]))} for name in ("p", "q")},
        "threads": threads,
        "connections": {f"{one}{two}": {"from": one, "to": two} for one, two in senders},
        "flows": {"f": {"path": path}},
        "requirements": source.sample(asked, source.choice((1, 2, 3))),
        "rules": source.sample(rules, source.choice((0, 0, 1))) if source.random() < 0.5 else [],
        "objectives": ["minimise price"],
    }


@pytest.mark.parametrize("seed", cases(200, 91_000))
def test_what_is_told_is_true_of_every_design(seed: int) -> None:
    source = random.Random(seed)
    data = drawn(source)
    problem = load(data)
    designs = structural_designs(problem.space)
    oracle = Oracle(problem.space)
    if not designs or len(designs) > 3000:
        return
    met = {design: oracle.met_by(design) for design in designs}
    apart = {design: without_waiting(oracle, design) for design in designs}
    for design in designs:  # what is kept is kept without waiting, too
        assert met[design] <= apart[design], design
    explainer = Explainer.of(problem, Wishes(every=source.random() < 0.3), 0.0)
    told = explainer.explanation()
    assert told.complete
    assert (told.status == "feasible") == (oracle.everything in met.values())
    if told.status == "infeasible":
        waits = any(uncontended_limit(problem.space, item).is_elsewhere for item in problem.space.requirements)
        assert told.without_waiting == (waits and oracle.everything not in apart.values())
        check_conflicts(told, oracle, met, apart)
        check_least(told, oracle, met, explainer.designs.unseen)
        for example in examples(told):
            check_cuts(data, told, example)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", cases(10, 92_000))
def test_what_holds_without_waiting_is_found(kind: str, seed: int) -> None:
    """Of every kind of contention: what a design keeps it keeps without waiting, and which demands hold together so."""
    source = random.Random(f"{kind} {seed}")
    text = text_of(draw(seed, kind=kind)).replace("processing: execution_time", "processing: response_time")
    limits = [f"latency of f <= {source.choice((6, 12, 20, 30))} ms", f"price <= {source.choice((10, 20))} EUR"]
    space = dse.loads(text).ask(require=[*limits, f"jitter of f < {source.choice((4, 9, 15))} ms"]).space
    designs = structural_designs(space)
    oracle = Oracle(space)
    uncontended = Uncontended(space, oracle)
    apart = {design: without_waiting(oracle, design) for design in designs}
    assert all(oracle.met_by(design) <= kept for design, kept in apart.items())
    numbers = sorted(oracle.everything)
    for _ in range(12) if designs else ():
        members = frozenset(source.sample(numbers, source.randint(1, len(numbers))))
        found = uncontended.oracle.witness(members)
        assert (found is not None) == any(members <= kept for kept in apart.values()), members
        if found is not None:
            whole = uncontended.whole(found)
            assert oracle.met_by(whole) <= without_waiting(oracle, whole)


def without_waiting(oracle: Oracle, design: Design) -> frozenset[int]:
    """The members that a design meets if each response time is as long as the job takes alone."""
    view, found = View(design), set[int]()
    for number, member in enumerate(oracle.members):
        if isinstance(member, Requirement):
            holds = judge(uncontended_limit(oracle.space, member), view).holds
        else:
            assert isinstance(member, Rule)
            holds = not is_broken(member, view)
        if holds:
            found.add(number)
    return frozenset(found)


def check_conflicts(
    told: Explanation, oracle: Oracle, met: dict[Design, frozenset[int]], apart: dict[Design, frozenset[int]]
) -> None:
    numbers = {member.text: number for number, member in enumerate(oracle.members)}
    assert told.conflicts
    for conflict in told.conflicts:
        members = frozenset(numbers[demand.text] for demand, _ in conflict.members)
        assert not any(members <= kept for kept in met.values())
        for number in members:
            assert any(members - {number} <= kept for kept in met.values())
        assert conflict.by_waiting == any(members <= kept for kept in apart.values())


def check_least(told: Explanation, oracle: Oracle, met: dict[Design, frozenset[int]], unseen: frozenset[int]) -> None:
    """No fewer are enough, and none of them may be nearer to its limit while those that are seen hold."""
    numbers = {member.text: number for number, member in enumerate(oracle.members)}
    fewest = min(len(oracle.everything - kept) for kept in met.values())
    given = told.least if told.least is not None else told.give_up
    assert given is not None
    assert bool(unseen) == (told.least is not None)
    together = {numbers[item.demand.text] for item in given.members}
    assert len(together) <= fewest if unseen else len(together) == fewest
    rest = [kept for kept in met.values() if oracle.everything - unseen - together <= kept]
    assert rest


def examples(told: Explanation) -> list[Example]:
    found = [example for conflict in told.conflicts for _, example in conflict.members]
    found += [item.example for item in told.relaxations]
    given = told.least if told.least is not None else told.give_up
    return [*found, *([given.example] if given is not None else [])]


def check_cuts(data: dict[str, Any], told: Explanation, example: Example) -> None:
    """With so much less of one thread the design keeps all that is asked; with a nanosecond more it does not."""
    for item in example.shorter:
        assert not item.section
        for by_ns, holds in ((item.by_ns, True), (item.by_ns - 1, False)):
            shorter = deepcopy(data)
            thread = shorter["threads"][item.name]
            for name, time in thread["compute_execution_time"].items():
                left = Fraction(time.removesuffix(" ms")) * 10**6 - by_ns
                thread["compute_execution_time"][name] = f"{max(left, 1)} ns"
            fixed = {name: option for name, option in example.design.items() if not name.startswith(f"{item.name}.x")}
            found = dse.explain(shorter, fix=[f"{name} = {option}" for name, option in fixed.items()])
            assert (found.status == "feasible") == holds, (item, told.problem.name)


METHODS: tuple[Literal["exhaustion", "model"], ...] = ("exhaustion", "model")
PLAIN: dict[str, Any] = {
    "dse": 1,
    "name": "plain overload",
    "deadlines": "all",
    "processor_types": {"cpu": {"cores": 2}},
    "processors": {"p": {"type": "cpu"}},
    "threads": {
        name: {"processor": "p", "period": "10 ms", "compute_execution_time": "7 ms"} for name in ("a", "b", "c")
    },
    "objectives": ["minimise price"],
}


def test_a_plain_overload_is_told_as_one() -> None:
    found = dse.explain(PLAIN)
    (conflict,) = found.conflicts
    assert [demand.text for demand, _ in conflict.members] == ["utilisation of p <= 100 %"]
    assert not conflict.by_waiting and found.without_waiting and found.least is not None
    (bound,) = found.impossible
    assert (bound.value, bound.limit) == (Fraction(2_100_000), Fraction(2_000_000))
    assert [(part.name, part.value) for part in bound.parts] == [(name, 700_000) for name in "abc"]
    said = "\n".join(text for section in explanation_page(found).sections for text in section.texts)
    assert "it is at least 210 %, the limit is 200 % (100 % of each of 2 cores): a 70 %, b 70 %, c 70 %" in said
    assert "were not searched" in said and "even if no thread waited for another" in said
    assert len(dse.explain(PLAIN, every=True).conflicts) > 1


def test_what_does_not_follow_from_an_overload_is_told_beside_it() -> None:
    """On q d is late for itself; what e does there is not overloaded, and its latency is the limit's fault."""
    data = deepcopy(PLAIN)
    data["processors"]["q"] = {"type": "cpu"}
    data["threads"]["d"] = {"processor": "q", "core": 1, "period": "10 ms", "compute_execution_time": "4 ms"}
    data["threads"]["e"] = {
        "processor": "q", "core": 1, "period": "20 ms", "deadline": "7 ms", "compute_execution_time": "4 ms",
    }  # fmt: skip
    data["threads"]["d"]["deadline"] = "6 ms"
    told = {
        tuple(demand.text for demand, _ in conflict.members): conflict.by_waiting
        for conflict in dse.explain(data).conflicts
    }
    late = tuple(f"response time of {name} <= its deadline" for name in "de")
    assert told[("utilisation of p <= 100 %",)] is False
    assert [waits for members, waits in told.items() if set(members) <= set(late)] == [True]


def test_that_it_takes_no_waiting_is_proved_again() -> None:
    """Behind e d ends after 8 ms of its 6 ms; with 3 ms it is late by itself."""
    data = deepcopy(PLAIN) | {"deadlines": "stated"}
    common = {"processor": "p", "core": 1, "period": "20 ms", "compute_execution_time": "4 ms"}
    contended, alone = (
        load(data | {"threads": {"d": common | {"priority": 1, "deadline": deadline}, "e": common | {"priority": 2}}})
        for deadline in ("6 ms", "3 ms")
    )
    for problem, by_waiting in ((contended, True), (alone, False)):
        result = dse.solve(problem).to_dict()
        (conflict,) = result["conflicts"]
        assert conflict["by_waiting"] is by_waiting
        for method in METHODS:
            assert dse.verify(result, problem=problem, method=method).status == "verified"
    result = dse.solve(contended).to_dict()
    result["conflicts"][0]["by_waiting"] = False
    for method in METHODS:
        found = dse.verify(result, problem=contended, method=method)
        assert found.status == "rejected"
        assert ["by_waiting" in str(finding) for finding in found.findings] == [True]


def test_a_limit_below_all_of_a_processor_is_no_overload() -> None:
    """59 % against 55 % hides nothing: r2 ends after 4 + 7 of 9 ms, r1 after 13 of 10 ms."""
    data = deepcopy(PLAIN) | {"requirements": ["utilisation of p <= 55 %"]}
    data["processor_types"] = {"cpu": {}}
    late = {"processor": "p", "priority": "deadline_monotonic"}
    data["threads"] = {
        "r1": {"processor": "p", "period": "10 ms", "compute_execution_time": "2 ms"},
        "r2": late | {"period": "20 ms", "deadline": "9 ms", "compute_execution_time": "7 ms"},
        "r3": late | {"period": "100 ms", "deadline": "8 ms", "compute_execution_time": "4 ms"},
    }
    found = dse.explain(data)
    assert found.least is None
    assert [conflict.by_waiting for conflict in found.conflicts] == [False, True, True]


def test_an_overload_that_money_mends_hides_what_follows_from_it() -> None:
    """Six threads of 20 % need the dearer type: that is all that clashes."""
    data = deepcopy(PLAIN) | {"requirements": ["price <= 20 EUR"]}
    data["processor_types"] = {"a": {"price": "10 EUR"}, "b": {"cores": 2, "price": "30 EUR"}}
    data["processors"]["p"] = {"type": ["a", "b"]}
    data["threads"] = {
        f"t{number}": {"processor": "p", "period": "10 ms", "compute_execution_time": "2 ms"} for number in range(6)
    }
    found = dse.explain(data)
    (conflict,) = found.conflicts
    assert {demand.text for demand, _ in conflict.members} == {"price <= 20 EUR", "utilisation of p <= 100 %"}
    assert found.least is None and [item.demand.text for item in found.relaxations if item.helps] == ["price <= 20 EUR"]


@pytest.mark.parametrize("after", range(24))
def test_nothing_is_asked_after_ctrl_c(after: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever of the two is asked when it comes."""
    data = deepcopy(PLAIN) | {"requirements": ["price <= 20 EUR"]}
    data["processor_types"] = {"a": {"price": "10 EUR"}, "b": {"cores": 2, "price": "30 EUR"}}
    data["processors"]["p"] = {"type": ["a", "b"]}
    own, begun = Oracle._spent, 0

    @contextmanager
    def spent(self: Oracle) -> Iterator[None]:
        nonlocal begun
        with own(self):
            begun += 1
            if begun == after + 1:
                raise KeyboardInterrupt
            yield

    monkeypatch.setattr(Oracle, "_spent", spent)
    found = dse.explain(data)
    assert begun <= after + 1
    assert found.complete == (begun <= after)
    assert found.complete or found.left_open


def test_the_design_of_an_overload_uses_cores_as_little_as_may_be() -> None:
    """One quick core and two slow ones: three threads on the quick one need 120 %, and no other design is better."""
    data = deepcopy(PLAIN)
    data["processor_types"] = {"soc": {"cores": {"big": 1, "little": 2}, "price": "90 EUR"}}
    data["processors"]["p"] = {"type": "soc"}
    times = {"t1": (4, 9), "t2": (4, 9), "t3": (4, 9), "t4": (4, 12), "t5": (8, 16)}
    data["threads"] = {
        name: {
            "processor": "p",
            "period": "20 ms" if name == "t5" else "10 ms",
            "compute_execution_time": {"soc/big": f"{big} ms", "soc/little": f"{little} ms"},
        }
        for name, (big, little) in times.items()
    }
    found = dse.explain(data)
    assert found.least is not None
    (overload,) = found.least.example.overloads
    assert overload.total_ppm == 1_200_000
    assert {item.by_ns for item in found.least.example.shorter} == {2_000_000}


def test_threads_that_are_stated_on_a_full_core_are_named() -> None:
    """Two stated on core 1 need 110 %; a third, first-fit, has nothing to do with it."""
    data = deepcopy(PLAIN) | {"deadlines": "none"}
    home = {"processor": "p", "period": "10 ms"}
    data["threads"] = {
        "t1": home | {"core": 1, "compute_execution_time": "6 ms"},
        "t2": home | {"core": 1, "compute_execution_time": "5 ms"},
        "t3": home | {"core": "first_fit", "compute_execution_time": "3 ms"},
    }
    (conflict,) = dse.explain(data).conflicts
    (overload,) = conflict.members[0][1].overloads
    assert (overload.core, [item.thread for item in overload.uses]) == (1, ["t1", "t2"])


def test_an_executor_that_fills_a_core_is_named_beside_free_cores() -> None:
    data = deepcopy(PLAIN) | {"executors": {"node": {"kind": "fifo", "processor": "p"}}}
    data["threads"] = {
        name: {"executor": "node", "period": "10 ms", "compute_execution_time": f"{time} ms"}
        for name, time in (("t", 8), ("u", 3), ("w", 1))
    }
    said = "\n".join(text for section in explanation_page(dse.explain(data)).sections for text in section.texts)
    assert "those in executor node, which share a core, need more than that by themselves" in said


def test_who_uses_a_bus_beyond_its_limit_is_told() -> None:
    data = {
        "dse": 1,
        "name": "bus",
        "bus_types": {"can": {"bandwidth": "5 kbit/s"}},
        "buses": {"b": {"type": "can"}},
        "devices": {"s": {"period": "10 ms"}, "t": {}},
        "connections": {"c": {"from": "s", "to": "t", "data_size": "8 B", "bus": "b"}},
        "objectives": ["minimise price"],
    }
    (conflict,) = dse.explain(data).conflicts
    (overload,) = conflict.members[0][1].overloads
    assert (overload.processor, overload.total_ppm, overload.limit_ppm) == ("b", 1_280_000, 1_000_000)
    assert [(item.thread, item.share_ppm) for item in overload.uses] == [("c", 1_280_000)]


def test_the_greatest_of_several_latencies_waits_only_where_threads_do() -> None:
    data = deepcopy(PLAIN) | {"deadlines": "none", "requirements": ["max(latency) <= 13 ms"]}
    data["threads"] = {"a": {"processor": "p", "period": "20 ms", "compute_execution_time": "7 ms"}}
    data["devices"] = {"s": {"period": "7 ms"}}
    data["connections"] = {"c": {"from": "s", "to": "a"}}
    data["flows"] = {"f": {"path": ["s", "a"]}, "g": {"path": ["a"]}}
    for processing in ("execution_time", "response_time"):
        (conflict,) = dse.explain(data | {"processing": processing}).conflicts
        assert not conflict.by_waiting


@pytest.mark.parametrize("order", ["xyz", "zxy", "zyx"])
def test_what_real_responses_teach_proves_nothing_without_waiting(order: str) -> None:
    """With best orders open and many decisions beside, type y keeps all if nobody waits: the flag must not pass."""
    times = {"x": (2, 7), "y": (4, 4), "z": (4, 7)}
    data = deepcopy(PLAIN) | {"deadlines": "stated"}
    data["processor_types"] = {name: {"cores": 2} for name in order}
    data["processors"] = {"p": {"type": list(order)}}
    data["threads"] = {
        name: {
            "processor": "p", "core": core, "period": "20 ms", "deadline": "6 ms", "priority": "any",
            "compute_execution_time": {kind: f"{times[kind][place]} ms" for kind in order},
        }
        for name, core, place in (("d", 1, 0), ("e", 1, 0), ("f", 2, 1))
    }  # fmt: skip
    data["device_types"] = {kind: {"price": f"{price} EUR", "period": "10 ms"} for kind, price in (("u", 1), ("v", 2))}
    data["devices"] = {f"s{number}": {"type": ["u", "v"]} for number in range(12)}
    problem = load(data)
    result = dse.solve(problem).to_dict()
    assert [conflict["by_waiting"] for conflict in result["conflicts"]] == [True]
    result["conflicts"][0]["by_waiting"] = False
    assert dse.verify(result, problem=problem, method="model").status == "rejected"
