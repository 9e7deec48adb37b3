"""Random deadlines and priorities of threads on processors, around the response times that designs have."""

from __future__ import annotations

import random
from itertools import islice
from math import floor
from typing import Any

from . import quantities
from .evaluator import designs, evaluated
from .problem import Problem, as_list

FEW = 200
"""Designs of a problem whose cores are open."""
SAMPLE = 40
"""Designs whose response times are looked at."""


def state_deadlines(rng: random.Random, document: dict[str, Any], share: float = 0.2) -> None:
    """Sometimes deadlines, and what response times follow from; else those at which data pass are no limits."""
    threads = {
        name: body for name, body in document["threads"].items() if {"processor", "executor", "reservation"} & set(body)
    }
    if not threads or rng.random() < 1 - share:
        if any("deadline" in body for body in document["threads"].values()):
            document["deadlines"] = "none"
        return
    for body in threads.values():
        if "executor" not in body:
            _prioritise(rng, body)
    if rng.random() < 0.2:
        document["priorities"] = "deadline_monotonic"
    document["deadlines"] = "all"
    _settle_cores(rng, document)
    values = _attained(document)
    for name in (name for name in threads if values.get(name) and rng.random() < 0.6):
        _give_deadline(rng, threads[name], values[name])
    _settle_cores(rng, document)
    document["deadlines"] = rng.choice(["stated", "stated", "stated", "all", "none"])
    if document["deadlines"] == "stated" and rng.random() < 0.5:
        del document["deadlines"]
    if rng.random() < 0.3:
        if not Problem(document).asks_of_cores:
            _settle_cores(rng, document, few=0)  # latencies are asked for, or not, later: all cores are known
        document["processing"] = "response_time"
        if rng.random() < 0.5:
            del document["processing"]  # which is the default


def _prioritise(rng: random.Random, body: dict[str, Any]) -> None:
    if rng.random() < 0.3:
        body["priority"] = rng.choice(["1", "1", "2", "7", "rate_monotonic", "deadline_monotonic"])
    if rng.random() < 0.05:
        body["priority"] = rng.sample(["1", "2", "7"], 2)


def _give_deadline(rng: random.Random, body: dict[str, Any], values: list[int]) -> None:
    """A deadline, sometimes one of two."""
    body["deadline"], other = _around(rng, values), _around(rng, values)
    if rng.random() < 0.1 and quantities.deadline(other) != quantities.deadline(body["deadline"]):
        body["deadline"] = [body["deadline"], other]


def _settle_cores(rng: random.Random, document: dict[str, Any], few: int = FEW) -> None:
    """Threads have one core, one after the other, until there are few designs; all of them where none are few."""
    problem, threads = Problem(document), document["threads"]
    open_ = [(place, "core") for place in problem.places if len(problem.cores(place)) > 1]
    listed = [
        (name, key) for key in ("priority", "deadline") for name in threads if len(as_list(threads[name].get(key))) > 1
    ]
    while (open_ or listed) and _are_more(document, few):
        name, key = open_.pop(rng.randrange(len(open_))) if open_ else listed.pop()
        body = document[problem.section_of[name]][name]
        stated = [text for text in as_list(body.get(key)) if text != "any"]
        if key == "core":
            stated = [text for text in stated if int(text) <= problem.last_core(name)]
        body[key] = rng.choice(stated or ["1", "1", "2"])


def _are_more(document: dict[str, Any], few: int) -> bool:
    """Whether there are more designs than these."""
    return sum(1 for _ in islice(designs(Problem({**document, "deadlines": "all"})), few + 1)) > few


def _attained(document: dict[str, Any]) -> dict[str, list[int]]:
    """Response times of each thread in some designs, in ns."""
    found: dict[str, list[int]] = {}
    for _, figures in islice(evaluated(Problem(document)), SAMPLE):
        for name, value in figures["responses"].items():
            found.setdefault(name, []).append(floor(value))
    return found


def _around(rng: random.Random, values: list[int]) -> str:
    """A deadline that some just meet, just miss, or all meet."""
    value = min(sorted(values)[int(len(values) * rng.choice([0, 0.5, 0.8, 0.99]))], 10**9)
    said = [f"{value} ns", f"{value} ns", f"{value + 1} ns", f"{value}.7 ns", f"{max(1, value - 1)} ns"]
    return rng.choice([*said, f"{value // 10**6 + 1} ms"])
