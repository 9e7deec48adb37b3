"""Random problems whose threads wait for each other: priorities, groups and lists of cores, executors, segments."""

from __future__ import annotations

import random
from typing import Any

from tests.oracle.architecture import state_segments
from tests.oracle.problem import as_list
from tests.properties.rewriting import Document, document_of, text_of

RULES = ("rate_monotonic", "deadline_monotonic")
KINDS = ("fifo", "callback_group", "wait_set")
MOST_OPEN = 3
"""So many decisions are added at most."""


def with_scheduling(text: str, rng: random.Random) -> str:
    """The same problem with a few of these things, as they come; times are long enough for threads to be late."""
    document = document_of(text)
    threads = {name: body for name, body in document["threads"].items() if "processor" in body}
    if not threads:
        return text
    _lengthen(document, rng)
    if rng.random() < 0.6:  # they were drawn around what the designs had
        document.pop("requirements", None)
    asked = rng.choice(("numbers", "any", "rules", "none"))
    if asked == "any":
        document["priorities"] = "any"
    left = MOST_OPEN
    for body in threads.values():
        left -= _prioritise(body, asked, rng, left)
        if rng.random() < 0.25:
            body["non_preemptive"] = rng.choice(["200 us", "1 ms", "3 ms"])
    if rng.random() < 0.5:
        _group(document, rng)
    if rng.random() < 0.6:
        _spread(document, threads, rng)
    if asked != "any" and rng.random() < 0.6:  # the best order is sought of threads alone
        _execute(document, threads, rng)
    if asked != "any" and rng.random() < 0.4:
        _reserve(document, threads, rng)
    _charge(document, rng)
    drawn = random.Random(repr(rng.getstate()[1][:2]))  # apart from all else
    if asked != "any" and drawn.random() < 0.4:
        _divide(document, drawn)
    _equal_times(threads, random.Random(repr(rng.getstate()[1][:2]) + " times"))
    return text_of(document)


def _equal_times(threads: dict[str, dict[str, Any]], rng: random.Random) -> None:
    """In one of five problems some threads take no time, and two take equally long."""
    timed = [body for body in threads.values() if isinstance(body.get("compute_execution_time"), str)]
    if rng.random() < 0.8 or len(timed) < 2:
        return
    one, other = rng.sample(timed, 2)
    one["compute_execution_time"] = other["compute_execution_time"]
    for body in timed:
        if rng.random() < 0.3:
            body["compute_execution_time"] = "0 ms .. 0 ms"


def _divide(document: Document, rng: random.Random) -> None:
    """The work of some threads becomes pieces on accelerators and their own processor; clocks are left out."""
    document.pop("clocks", None)
    for bodies in (document["processors"], document["devices"], document["threads"]):
        for body in bodies.values():
            for key in ("clock", "offset", "communication"):
                body.pop(key, None)
    state_segments(rng, document)
    for name, body in document["threads"].items():
        if "segments" in body:
            body.pop("non_preemptive", None)
            document.get("baseline", {}).pop(name, None)
    if not document.get("baseline", True):
        del document["baseline"]


def _lengthen(document: Document, rng: random.Random) -> None:
    """Periods of a few ms where periods are long, so that what runs for a ms is in the way."""
    quick = rng.choice((None, "3 ms", "4 ms", "6 ms"))
    for kind in ("threads", "thread_types"):
        for body in (document.get(kind) or {}).values():
            if quick is not None and isinstance(body.get("period"), str) and rng.random() < 0.5:
                body["period"] = quick


def _prioritise(body: dict[str, Any], asked: str, rng: random.Random, left: int) -> int:
    """The priority of a thread; how many decisions that adds."""
    if asked == "any":
        if rng.random() < 0.2:
            body["priority"] = rng.choice(["1", "2", "3"])
        return 1
    if asked == "none" or rng.random() < 0.3:
        return 0
    given = ["1", "2", "3"] if asked == "numbers" else list(RULES)
    if left > 0 and rng.random() < 0.5:
        body["priority"] = rng.sample(given, 2)
        return 1
    body["priority"] = rng.choice(given)
    return 0


def _group(document: Document, rng: random.Random) -> None:
    """Cores of a type in two groups, on one of which some threads take longer."""
    for kind, body in document["processor_types"].items():
        if isinstance(body.get("cores"), list) or rng.random() < 0.3:
            continue
        count = max(2, int(body.get("cores", "2")))
        body["cores"] = {"big": str(count - 1), "little": "1"}
        for thread in document["threads"].values():
            given = thread.get("compute_execution_time")
            if isinstance(given, dict) and kind in given and rng.random() < 0.6:
                slow = [f"2 ms .. {rng.choice([2, 3])} ms"]
                given[f"{kind}/{rng.choice(['big', 'little', 'little'])}"] = slow[0]
            if rng.random() < 0.15 and "core" not in thread and len(as_list(thread.get("processor"))) == 1:
                thread["core"] = rng.choice(["1", str(count)])


def _spread(document: Document, threads: dict[str, dict[str, Any]], rng: random.Random) -> None:
    """Three or four cores, of which some threads may have some."""
    types = [body for body in document["processor_types"].values() if isinstance(body.get("cores", "1"), str)]
    for body in types:
        if rng.random() < 0.6:
            body["cores"] = rng.choice(["3", "4"])
    counts = [int(body["cores"]) for body in types if "cores" in body]
    for body in threads.values():
        if counts and "core" not in body and rng.random() < 0.4:
            cores = sorted(rng.sample(range(1, max(counts) + 1), min(max(counts), rng.choice((2, 2, 3)))))
            body["core"] = list(map(str, cores))


def _execute(document: Document, threads: dict[str, dict[str, Any]], rng: random.Random) -> None:
    """One or two executors for some of the threads, which leave their processor and core to them."""
    homes = [body["processor"] for body in threads.values()]
    executors: dict[str, Any] = {}
    for number in range(rng.choice((1, 1, 2))):
        body: dict[str, Any] = {"kind": _kinds(rng), "processor": rng.choice(homes)}
        if rng.random() < 0.4:
            body["priority"] = rng.choice(["1", "2", "3"])
        if rng.random() < 0.2:
            body["core"] = "1"
        executors[f"node{number}"] = body
    used = set()
    for body in threads.values():
        if rng.random() < 0.6:
            name = rng.choice(list(executors))
            used.add(name)
            for key in ("processor", "core", "process"):
                body.pop(key, None)
            body["executor"] = name
            if rng.random() < 0.3 and len(executors) > 1:
                used |= set(executors)
                body["executor"] = list(executors)
            if any(executors[one]["kind"] != ["callback_group"] for one in as_list(body["executor"])):
                body.pop("priority", None)
    is_open = any(isinstance(body.get("executor"), list) for body in threads.values())
    for body in threads.values():
        if is_open and body.get("core") == "first_fit":  # all cores are decisions then
            del body["core"]
    if used:
        document["executors"] = {name: body for name, body in executors.items() if name in used}


def _reserve(document: Document, threads: dict[str, dict[str, Any]], rng: random.Random) -> None:
    """A share of a core for some threads, and for an executor."""
    open_ = {name for body in threads.values() if isinstance(body.get("executor"), list) for name in body["executor"]}
    homes = [body["processor"] for body in threads.values() if "processor" in body]
    alone = [body for body in threads.values() if "processor" in body and rng.random() < 0.6]
    executors = [body for name, body in (document.get("executors") or {}).items() if name not in open_]
    whole = alone + [body for body in executors if rng.random() < 0.4]
    if not homes or not whole:
        return
    period = rng.choice([2, 4, 5])
    budgets = [f"{budget} ms" for budget in rng.sample(range(1, period + 1), rng.choice((1, 1, 2)))]
    share: dict[str, Any] = {"processor": rng.choice(homes), "budget": budgets, "period": f"{period} ms"}
    if rng.random() < 0.4:
        share["priority"] = rng.choice(["1", "3"])
    document["reservations"] = {"share": share}
    used = {id(body) for body in whole if body in executors}
    names = {name for name, body in (document.get("executors") or {}).items() if id(body) in used}
    for body in whole:
        for key in ("processor", "core", "process"):
            body.pop(key, None)
        body["reservation"] = "share"
    for body in threads.values():
        if "reservation" in body or names & set(as_list(body.get("executor") or [])):
            body.pop("non_preemptive", None)


def _kinds(rng: random.Random) -> list[str]:
    return ["callback_group"] if rng.random() < 0.4 else rng.sample(KINDS, rng.choice((1, 1, 2)))


def _charge(document: Document, rng: random.Random) -> None:
    """Overheads of the types."""
    for body in document["processor_types"].values():
        if rng.random() < 0.2:
            body["context_switch"] = "50 us"
        if rng.random() < 0.2:
            body["interrupts"] = {"tick": {"compute_execution_time": "100 us", "period": "1 ms"}}
        if rng.random() < 0.15:
            body["throttling"] = {"budget": "4 ms", "period": "5 ms"}
        if rng.random() < 0.15:
            body["priority_levels"] = rng.choice(["1", "2"])
