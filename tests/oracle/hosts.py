"""Random executors whose processor and core are open, threads that choose among them, and reservations beside them."""

from __future__ import annotations

import random
from itertools import islice
from math import ceil
from typing import Any

from .architecture import on_cores
from .evaluator import designs, evaluated
from .problem import Problem, as_list

MOST_DESIGNS = 200
"""Designs of a problem, the cores being asked for."""
LONGEST_NS = 10**9
"""A limit of a response time is no longer: those without a bound are."""
KINDS = ("fifo", "callback_group", "wait_set")
LISTS = ("executor", "processor", "core", "kind", "priority", "budget")
"""What is narrowed where there are too many designs."""


def state_hosts(rng: random.Random, document: dict[str, Any]) -> None:
    """One to three executors for some threads, which may choose among them; sometimes a reservation."""
    threads = on_cores(document)
    if not threads:
        return
    for kind in document["processor_types"].values():
        if "serves" not in kind and rng.random() < 0.8:
            kind["cores"] = rng.choice(["1", "2", "2", "2", "3"])
    slots = list(dict.fromkeys(slot for body in threads for slot in as_list(body["processor"])))
    if len(slots) == 1 and "mcu" not in document["processors"] and rng.random() < 0.4:
        kinds = rng.sample(list(document["processor_types"]), min(len(document["processor_types"]), rng.choice([1, 2])))
        document["processors"]["mcu"] = {"type": _plain(kinds)} | ({"optional": "true"} if rng.random() < 0.5 else {})
        slots.append("mcu")
    names = ("left", "right", "the third")[: rng.choice([1, 2, 2, 3])]
    executors = {name: _executor(rng, document, slots) for name in names}
    _quicken(rng, document)
    linked = _link(random.Random(repr(rng.getstate()[1][3])), document)  # drawn apart from all else
    for body in rng.sample(threads, rng.randint(min(len(threads), rng.choice([1, 2, 2])), len(threads))):
        _host(rng, body, executors)
    homes = [body["executor"] for body in linked if "executor" in body]
    for body in linked if homes else ():  # a chain is in one executor, mostly
        if "executor" not in body or not set(as_list(body["executor"])) & set(as_list(homes[0])):
            for field in ("processor", "core", "process"):
                body.pop(field, None)
            body["executor"] = homes[0]
    used = {name for body in threads for name in as_list(body.get("executor"))}
    document["executors"] = {name: body for name, body in executors.items() if name in used}
    if rng.random() < 0.5:
        _reserve(rng, document, threads, slots)
    _narrow(rng, document)


def _quicken(rng: random.Random, document: dict[str, Any]) -> None:
    """Some threads run so often that a core may be too full; nothing so seldom that a bound is long in coming."""
    for section in ("devices", "device_types", "threads", "thread_types"):
        for body in document.get(section, {}).values():
            if body.get("period") == "1 s":
                body["period"] = "100 ms"
            if section == "threads" and isinstance(body.get("period"), str) and rng.random() < 0.3:
                body["period"] = rng.choice(["2 ms", "3 ms", "4 ms"])


def _link(rng: random.Random, document: dict[str, Any]) -> list[dict[str, Any]]:
    """Mostly some threads become a chain: the first is a timer, the others are released by the one before alone."""
    threads, connections = document["threads"], document["connections"]
    free = [body for body in on_cores(document) if "type" not in body]
    found: list[str] = []
    ways: list[dict[str, Any]] = []
    for name, body in threads.items():
        way = next(
            (way for way in connections.values() if way.get("to") == name and way.get("from") in found[-1:]), None
        )
        if body in free and (way is not None or not found):
            found.append(name)
            ways += [] if way is None else [way]
    sent_to_first = [way for way in connections.values() if way.get("to") in found[:1]]
    if len(found) < 2 or any("from" not in way for way in sent_to_first) or rng.random() < 0.3:
        return []
    for name in found:
        for field in ("dispatch_trigger", "callback_execution_time", "queue_size", "join", "pairing"):
            threads[name].pop(field, None)
        for way in connections.values():
            if way.get("to") == name:
                way.pop("queue_size", None)
                way["port"] = "data"
    threads[found[0]]["dispatch_protocol"] = "periodic"
    threads[found[0]]["period"] = rng.choice(["5 ms", "7 ms", "10 ms", "20 ms"])
    for name, way in zip(found[1:], ways, strict=True):
        threads[name]["dispatch_protocol"] = "aperiodic"
        for field in ("period", "offset", "communication"):
            threads[name].pop(field, None)
        for field in ("rate", "data_rate", "port"):
            way.pop(field, None)
        way.setdefault("data_size", "8 B")
    return [threads[name] for name in found]


def _executor(rng: random.Random, document: dict[str, Any], slots: list[str]) -> dict[str, Any]:
    kinds = ["callback_group"] if rng.random() < 0.4 else rng.sample(KINDS, rng.choice([1, 1, 1, 2]))
    body: dict[str, Any] = {"kind": _plain(kinds)} | _place(rng, document, slots)
    if rng.random() < 0.4:
        body["priority"] = rng.choice(["1", "2", "2"])
    return body


def _place(rng: random.Random, document: dict[str, Any], slots: list[str]) -> dict[str, Any]:
    """One processor or several, and any core, one or several in any order, perhaps one more than there are."""
    chosen = rng.sample(slots, min(len(slots), rng.choice([1, 1, 2])))
    most = max(map(Problem(document).most_cores, chosen))
    cores = rng.choice(["", "", "any", "list", "list", "one"])
    body: dict[str, Any] = {"processor": _plain(chosen)}
    if cores == "any":
        body["core"] = "any"
    elif cores == "one":
        body["core"] = str(rng.randint(1, most))
    elif cores == "list":
        listed = [str(core) for core in range(1, most + (2 if most == 1 or rng.random() < 0.3 else 1))]
        body["core"] = rng.sample(listed, rng.randint(2, len(listed)))
    return body


def _plain(options: list[str]) -> Any:
    return options if len(options) > 1 else options[0]


def _host(rng: random.Random, body: dict[str, Any], executors: dict[str, Any]) -> None:
    """A thread in one executor or in one of several, which may be urgent among others where those have an order."""
    names = rng.sample(list(executors), len(executors))
    names = names[: rng.choice([1, 2, 2, 3])]
    if rng.random() < 0.85:
        body.pop("process", None)
    for field in ("processor", "core"):
        body.pop(field, None)
    body["executor"] = _plain(names)
    if all("callback_group" in as_list(executors[name]["kind"]) for name in names) and rng.random() < 0.5:
        numbers = rng.sample(["1", "2", "7"], rng.choice([1, 1, 2]))
        body["priority"] = _plain(numbers)


def _reserve(rng: random.Random, document: dict[str, Any], threads: list[dict[str, Any]], slots: list[str]) -> None:
    """A reservation for threads of their own and executors that nobody chooses."""
    chosen = {name for body in threads for name in as_list(body.get("executor")) if len(as_list(body["executor"])) > 1}
    executors = [body for name, body in document["executors"].items() if name not in chosen]
    inside = [body for body in [*executors, *threads] if "executor" not in body and rng.random() < 0.7]
    if not inside:
        return
    period = rng.choice([2, 3, 4, 5])
    budgets = [f"{500 * half} us" for half in rng.sample(range(1, 2 * period + 1), rng.choice([1, 1, 2]))]
    share = {"budget": _plain(budgets), "period": f"{period} ms"} | _place(rng, document, slots)
    if rng.random() < 0.4:
        share["priority"] = rng.choice(["1", "2"])
    document["reservations"] = {"share": share}
    for body in inside:
        for field in ("processor", "core", "process"):
            body.pop(field, None)
        body["reservation"] = "share"


def _narrow(rng: random.Random, document: dict[str, Any]) -> None:
    """Removes alternatives, of those that are drawn here and of cores, until there are few enough designs."""
    while _are_many(document):
        entries = [*document["threads"].values(), *document["executors"].values()]
        entries += document.get("reservations", {}).values()
        lists = [(body, field) for body in entries for field in LISTS if isinstance(body.get(field), list)]
        problem = Problem(document)
        open_ = [place for place in problem.places if not problem.stated_cores(place) and len(problem.cores(place)) > 1]
        if open_ and (not lists or rng.random() < 0.5):
            place = rng.choice(open_)
            document[problem.section_of[place]][place]["core"] = rng.choice([["2", "1"], "1", "1"])
        elif lists:
            body, field = rng.choice(lists)
            removed = rng.randrange(len(body[field]))
            body[field] = _plain([text for number, text in enumerate(body[field]) if number != removed])
        else:
            break
        _mend(document)
    _mend(document)


def _mend(document: dict[str, Any]) -> None:
    """No executor that no thread may run in, no place without any of its cores, no priorities where they mean none."""
    used = {name for body in document["threads"].values() for name in as_list(body.get("executor"))}
    for name in [name for name in document["executors"] if name not in used]:
        del document["executors"][name]
    for body in document["threads"].values():
        kinds = [as_list(document["executors"][name]["kind"]) for name in as_list(body.get("executor"))]
        if not all("callback_group" in each for each in kinds):
            body.pop("priority", None)
    problem = Problem(document)
    for place in problem.places:
        if min(map(int, problem.stated_cores(place)), default=1) > problem.last_core(place):
            document[problem.section_of[place]][place]["core"] = "1"


def _are_many(document: dict[str, Any]) -> bool:
    problem = Problem({**document, "deadlines": "all"})
    return sum(1 for _ in islice(designs(problem), MOST_DESIGNS + 1)) > MOST_DESIGNS


def ask_for_responses(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes the response time of a thread is an objective, or has a limit that some designs just meet."""
    threads = [name for name, body in Problem(document).sections["threads"].items() if "processor" in body]
    if not threads or rng.random() < 0.5:
        return
    metric = f"response time of {_quoted(rng.choice(threads))}"
    if rng.random() < 0.6:
        document["objectives"] = [*document["objectives"][:3], f"minimise {metric}"]
        return
    asked = Problem({**document, "objectives": [f"minimise {metric}"]})
    values = sorted(figures["objectives"][0] for _, figures in evaluated(asked))
    if values and values[0] < LONGEST_NS:
        value = min(rng.choice(values[: len(values) // 2 + 1]), LONGEST_NS)
        document["requirements"] = [*document.get("requirements", []), f"{metric} <= {ceil(value)} ns"]


def state_host_rules(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes a rule about who runs where; one that leaves no design, or none that is good, is dropped."""
    problem = Problem(document)
    fields = ("executor", "core", "processor", "kind", "priority")
    sections = ("executors", "reservations", "threads")
    given = {
        decision: options
        for decision, options in problem.decisions.items()
        for name, field in [problem.owner(decision)]
        if field in fields and problem.section_of[name] in sections
    }
    if not given or rng.random() < 0.5:
        return
    atoms = []
    for decision in rng.choices(list(given), k=2):
        name, field = problem.owner(decision)
        atoms.append(f"'{name}'.{field} {rng.choice(['==', '==', '!='])} {_quoted(rng.choice(given[decision]))}")
    text = rng.choice([atoms[0], f"{atoms[0]} implies {atoms[1]}", f"forbid {atoms[0]} and {atoms[1]}"])
    rules = [*document.get("rules", []), text]
    asked = {**document, "rules": rules}
    if not _are_many(asked) and any(not figures["violations"] for _, figures in evaluated(Problem(asked))):
        document["rules"] = rules


def _quoted(text: str) -> str:
    return f"'{text}'" if " " in text else text


def state_polling(rng: random.Random, document: dict[str, Any]) -> None:
    """Some executors poll that were wait sets, and some topics that lead there keep their last messages.

    Jobs of theirs read when they begin: nothing passes at a release in such a problem.
    """
    for executor in document.get("executors", {}).values():
        kinds = as_list(executor["kind"])
        if "wait_set" in kinds and rng.random() < 0.5:
            executor["kind"] = _plain(["polling" if kind == "wait_set" else kind for kind in kinds])
    homes = {name for name, body in document.get("executors", {}).items() if "polling" in as_list(body["kind"])}
    inside = [name for name, body in document["threads"].items() if homes & set(as_list(body.get("executor")))]
    for section in ("threads", "thread_types") if inside else ():
        for body in document.get(section, {}).values():
            body.pop("communication", None)
    for way in document.get("connections", {}).values():
        target = document["threads"][way["to"]] if way.get("to") in inside else {}
        if target.get("dispatch_protocol") in ("aperiodic", "sporadic") and "port" not in way and rng.random() < 0.5:
            way.setdefault("queue_size", rng.choice(["1", "2"]))
