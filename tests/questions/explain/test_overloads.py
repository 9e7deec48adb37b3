"""Who uses a core or an accelerator beyond its limit, what follows from that, and which shorter time would keep it."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import dse
from dse.report.content.explain import explanation_page, impossible_words

MS = 10**6


def told(data: dict[str, Any], **question: Any) -> str:
    page = explanation_page(dse.explain(data, every=True, **question))
    return "\n".join(text for section in page.sections for text in section.texts)


def overloads(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Those of the first design that is named, as JSON has them."""
    found = dse.explain(data, every=True).to_dict()
    return list((found["give_up"] or found["relaxations"][0])["overloads"])


def problem(threads: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "dse": 1, "name": "overloads", "deadlines": "none", "objectives": ["minimise price"],
        "processor_types": {"cpu": {"price": "1 EUR"}}, "processors": {"pc": {"type": "cpu"}},
        "threads": {name: {"processor": "pc", **fields} for name, fields in threads.items()}, **more,
    }  # fmt: skip


def thread(period: int, time: float, **more: Any) -> dict[str, Any]:
    return {"period": f"{period} ms", "compute_execution_time": f"{time} ms", **more}


def test_a_core() -> None:
    """60 + 45 = 105 %: 0.5 ms less of a, or 1 ms less of b, is 100 %."""
    data = problem({"b": thread(20, 9), "a": thread(10, 6)})
    enough = "kept with 1 ms less of b each time, or 0.5 ms less of a each time"
    assert f"core 1 of pc is used to 105 %, at most 100 %: a 60 %, b 45 %; {enough}" in told(data)
    [overload] = overloads(data)
    assert (overload["core"], overload["limit_ppm"], overload["total_ppm"]) == (1, MS, 1_050_000)
    assert overload["uses"] == [{"thread": "a", "share_ppm": 600_000}, {"thread": "b", "share_ppm": 450_000}]
    for item in overload["shorter"]:
        for more, status in ((0, "feasible"), (1, "infeasible")):
            changed = deepcopy(data)
            fields = changed["threads"][item["name"]]
            longest = round(float(fields["compute_execution_time"].split()[0]) * MS)
            fields["compute_execution_time"] = f"{longest - item['by_ns'] + more} ns"
            assert dse.explain(changed).status == status


def test_a_stated_limit_that_is_strict() -> None:
    """60 % is not less than 60 %: 1 ns less of a is enough."""
    data = problem({"a": thread(10, 6)}, requirements=["utilisation of pc < 60 %"])
    [overload] = overloads(data)
    assert (overload["requirement"], overload["limit_ppm"]) == ("utilisation of pc < 60 %", 600_000)
    assert overload["shorter"] == [{"name": "a", "by_ns": 1, "section": False}]


def test_a_limit_of_one_core() -> None:
    """Of two cores one is limited."""
    data = problem({"a": thread(10, 6, core=1), "b": thread(10, 3, core=2)})
    data["processor_types"]["cpu"]["cores"] = 2
    data["requirements"] = ["utilisation of core 1 of pc <= 50 %"]
    assert "core 1 of pc is used to 60 %, at most 50 %: a 60 %; kept with 1 ms less of a each time" in told(data)


def test_threads_without_a_partition() -> None:
    """Three of 60 % on two cores; a fourth of 30 % has nothing to do with it."""
    data = problem({**{name: thread(10, 6) for name in "abc"}, "d": thread(10, 3)})
    data["processor_types"]["cpu"]["cores"] = 2
    assert "a 60 %, b 60 % and c 60 % have no partition on the 2 cores of pc with at most 100 % on each" in told(data)
    [overload] = overloads(data)
    assert (overload["core"], overload["cores"], overload["shorter"]) == (0, 2, [])


def test_one_thread_that_no_core_can_carry() -> None:
    data = problem({"a": thread(10, 12), "b": thread(10, 3)})
    data["processor_types"]["cpu"]["cores"] = 2
    assert "a 120 % of one core, more than the 100 % that the 2 cores of pc may each be used" in told(data)


def test_what_follows_from_an_overload() -> None:
    """On the accelerator 12 of 20 ms twice: no deadline can be met, and the overload is told first."""
    ends = {"compute_execution_time": "1 ms"}
    pieces = [ends, {"processor": "g", "compute_execution_time": "12 ms"}, ends]
    data = problem({name: {"period": "20 ms", "segments": pieces} for name in "cd"}, deadlines="all")
    data["processor_types"]["gpu"] = {"serves": "fifo"}
    data["processors"]["g"] = {"type": "gpu"}
    text = told(data)
    assert (
        "g is used to 120 %, at most 100 %: c 60 %, d 60 %; because of it c and d have no bound; kept with 4 ms less "
        "of c (piece 2) each time, or 4 ms less of d (piece 2) each time" in text
    )
    assert text.index("utilisation of g") < text.index("response time of c")
    explanation = dse.explain(data, every=True)
    first = [conflict.members[0][0].text for conflict in explanation.conflicts]
    assert first == [
        "utilisation of g <= 100 %", "response time of c <= its deadline", "response time of d <= its deadline",
    ]  # fmt: skip
    assert explanation.give_up is not None
    assert explanation.give_up.members[0].demand.text == "utilisation of g <= 100 %"


def test_one_that_is_in_time_behind_nothing_does_not_follow() -> None:
    """The most urgent of an overloaded core has a bound."""
    data = problem({"a": thread(10, 6), "b": thread(20, 9)}, deadlines="all")
    [overload] = overloads(data)
    assert overload["unbounded"] == ["b"]


def test_what_has_to_be_given_up_with_others_names_no_design_of_its_own() -> None:
    """A design without one of several that must go breaks the others, too; of a victim it is said whose it is."""
    data = problem(
        {
            "a": {"period": "200 ms", "segments": _pieces(3, 116, 1), "core": 1},
            "b": {"period": "33 ms", "segments": _pieces(3, 8, 4), "core": 2},
        },
        deadlines="all",
    )
    data["processor_types"] = {"cpu": {"cores": 2, "price": "1 EUR"}, "gpu": {"serves": "fifo"}}
    data["processors"]["g"] = {"type": "gpu"}
    text = told(data)
    assert "feasible without it" not in text
    assert "no limit helps: at best the response time of a is unbounded because b has no bound" in text


def _pieces(*times: int) -> list[dict[str, Any]]:
    return [
        {"compute_execution_time": f"{time} ms", **({"processor": "g"} if place % 2 else {})}
        for place, time in enumerate(times)
    ]


def test_a_check_tells_decimals() -> None:
    """35 of 33 ms: a fraction stands behind its decimals; what has finite ones is told in full."""
    check = dse.check(problem({"a": thread(33, 35)}))
    [item] = check.impossible
    said = "it is at least 106.060606 % (exact 3500/33 %), the limit is 100 %: a 106.060606 %"
    assert impossible_words(item, "EUR").endswith(said)
    [item] = dse.check(problem({"a": thread(10, 12)})).impossible
    assert impossible_words(item, "EUR").endswith("it is at least 120 %, the limit is 100 %: a 120 %")


SHARED = """
dse: 1
name: callbacks that share a core
processor_types: {duo: {cores: 2}}
processors: {p: {type: duo}}
executors: {main: {kind: callback_group, processor: p}}
threads:
  one: {executor: main, period: 10 ms, compute_execution_time: 5 ms}
  two: {executor: main, period: 10 ms, compute_execution_time: 4 ms}
  three: {executor: main, period: 10 ms, compute_execution_time: 3 ms}
  beside: {processor: p, period: 10 ms, compute_execution_time: 1 ms}
"""


def test_an_executor_that_needs_more_than_a_core_is_named() -> None:
    """Before, its first thread was: as if that alone needed what all of them do."""
    [relaxation] = dse.explain(dse.loads(SHARED)).relaxations
    assert relaxation.thread == "executor main"
    assert relaxation.closest == 1_200_000
