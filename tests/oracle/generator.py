"""Random small problem files with every kind of decision, for comparison with brute force.

An architecture with too many alternatives is drawn first, then thinned out until it has few enough designs; limits
are drawn last, around values that designs attain, so that they bind, just hold, or just fail.

Left out, because the documents do not say what it means or the product refuses it: lists of processes or whole
transmission times, alternatives inside virtual bus types, response times without execution times, maps that lack
a processor type, flows that start at a hybrid component or one with a queue, or with a connection to a periodic one,
`load` of a virtual bus type, shares of buses without a bandwidth, data rates without sizes in flows and on trigger
connections, connections over a bus with neither, and processes whose threads can never meet on one processor.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from functools import cache
from itertools import islice
from math import prod
from typing import Any

from .architecture import (
    STORED,
    Architecture,
    state_clocks,
    state_cores,
    state_equal_times,
    state_executors,
    state_joins,
    state_overload,
    state_reservations,
    state_segments,
)
from .coverage import features
from .deadlines import state_deadlines
from .drawn import keep, kept
from .evaluator import designs
from .hosts import ask_for_responses, state_host_rules, state_hosts, state_polling
from .problem import Problem, as_list
from .question import add_question, add_rules, allow_what_is_needed

__all__ = ["features", "random_problem"]

CAPS = {"tiny": 200, "small": 2000, "grouped": 200, "reserved": 200, "segmented": 200, "hosted": 10}
NOT_DECISIONS = ("path", "dispatch_trigger", "assumptions")


COVERING = (30, 33, 45, 56, 73, 77, 82, 89, 92, 97, 98, 127, 128, 129, 130, 137, 142, 180, 183, 200, 231, 246,
            248)  # fmt: skip
"""Seeds that cover every kind as the generator is today; where they do not any more the others are tried, too."""
USUAL = {
    "tiny": (
        *range(40),
        *range(304, 306),
        *range(500, 512),
        *range(1_019, 1_029),
        *range(2_000, 2_008),
        *range(2_027, 2_032),
        *COVERING,
    ),
    "small": (*range(9), 10, 12, 14, 17, 18),
    "grouped": (102, 201),
    "reserved": (*range(5), 8, 9, 202),
    "segmented": (*range(4), *range(6, 9), 205),
    "hosted": (3, 5, 6, 16, 18, 71, *range(109, 119)),
}
"""The seeds of the problems that are kept."""


@cache
def random_problem(seed: int, size: str = "small") -> str:
    """YAML text of a random problem with at most 2000 (`small`) or 200 (other) designs; the same for the same seed."""
    found = kept().get(f"{size} {seed}")
    return draw(seed, size) if found is None else found


def draw(seed: int, size: str) -> str:
    """The text of a random problem, made anew.

    One that is `grouped` is tiny but for kinds of executors, and has one for some threads wherever it can; one that is
    `reserved` has reservations in the same way, and perhaps an executor; in one that is `segmented` some threads have
    segments, others perhaps an executor or reservation, and there are no clocks. One that is `hosted` has few other
    alternatives than those of where threads run: on which core and processor their executors, and in which of these.
    """
    rng = random.Random(f"{size} {seed}")
    document = Architecture(rng, size if size == "small" else "tiny").document
    document["name"] = f"random {size} {seed}"
    state_joins(random.Random(f"joins {size} {seed}"), document)
    _thin_out(rng, document, CAPS[size])
    _mend_joins(document)
    _mend_cycles(document)
    state_cores(random.Random(f"cores {size} {seed}"), document)  # drawn apart from all else
    state_overload(random.Random(f"overload {size} {seed}"), document)
    if size == "segmented":
        state_segments(random.Random(f"segments {seed}"), document)
    else:
        state_clocks(random.Random(f"clocks {size} {seed}"), document)
    drawn = random.Random(f"executors {seed}")
    if size == "grouped" or drawn.random() < {"reserved": 0.5, "segmented": 0.5}.get(size, 0):
        state_executors(drawn, document)
    if size in ("grouped", "reserved", "segmented"):
        state_equal_times(random.Random(f"equal times {size} {seed}"), document)
    reserved = random.Random(f"reservations {seed}")
    if size == "reserved" or (size == "segmented" and reserved.random() < 0.5):
        state_reservations(reserved, document)
    if size == "hosted":
        state_hosts(random.Random(f"hosts {seed}"), document)
    state_polling(random.Random(f"polling {size} {seed}"), document)
    share = 0.9 if size in ("grouped", "reserved", "segmented") else 0.7 if size == "hosted" else 0.2
    state_deadlines(random.Random(f"deadlines {size} {seed}"), document, share)
    add_rules(rng, document)
    add_question(rng, document)
    if size == "hosted":
        ask_for_responses(random.Random(f"host responses {seed}"), document)
        state_host_rules(random.Random(f"host rules {seed}"), document)
    allow_what_is_needed(random.Random(f"allowed {size} {seed}"), document)
    return to_yaml(document)


def _lists(document: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Every list of alternatives: the mapping that holds it, and its key."""
    for key, value in document.items():
        if isinstance(value, dict):
            yield from _lists(value)
        elif isinstance(value, list) and key not in NOT_DECISIONS:
            yield document, key


def _is_too_large(problem: Problem, cap: int) -> bool:
    combinations = prod(map(len, problem.decisions.values()))
    return combinations > 400 * cap or sum(1 for _ in islice(designs(problem), cap + 1)) > cap


def _thin_out(rng: random.Random, document: dict[str, Any], cap: int) -> None:
    """Removes random alternatives until at most `cap` designs are left."""
    _mend_processes(document)
    while _is_too_large(Problem(document), cap):
        holder, key = rng.choice(list(_lists(document)))
        options = holder[key]
        gone = options.pop(rng.randrange(len(options)))
        if options == ["local"]:  # which is no bus
            options[0] = gone
        if len(options) == 1:
            holder[key] = options[0]
        _mend_processes(document)


def _mend_processes(document: dict[str, Any]) -> None:
    """Threads of one process have a processor in common with the first of them."""
    first: dict[str, Any] = {}
    for body in document["threads"].values():
        if "process" in body:
            home = first.setdefault(body["process"], body["processor"])
            if not set(as_list(home)) & set(as_list(body["processor"])):
                body["processor"] = list(home) if isinstance(home, list) else home


def _mend_joins(document: dict[str, Any]) -> None:
    """No thread that a timer alone releases states a join, and none pairs what is not joined."""
    for body in document["threads"].values():
        if as_list(body.get("dispatch_protocol")) == ["periodic"]:
            body.pop("join", None)
        if "all" not in as_list(body.get("join")):
            body.pop("pairing", None)


def _mend_cycles(document: dict[str, Any]) -> None:
    """No hybrid thread needs all its inputs in a cycle of event-triggered threads, which would have no rate."""
    threads, wires = document["threads"], document["connections"]
    senders: dict[str, set[str]] = {}
    for name, body in threads.items():
        ways = set(as_list(body.get("dispatch_protocol") or ("periodic" if "period" in body else "aperiodic")))
        if ways <= {"aperiodic", "sporadic"} or (ways == {"hybrid"} and body.get("join") == "all"):
            coming = [key for key, wire in wires.items() if wire.get("to") == name and wire.get("port") not in STORED]
            triggers = as_list(body.get("dispatch_trigger") or coming)
            senders[name] = {
                wires[key]["from"] for key in triggers if "from" in wires[key] and "rate" not in wires[key]
            }
    for name in [name for name in senders if threads[name].get("dispatch_protocol") == "hybrid"]:
        before, todo = set[str](), [name]
        while todo:
            found = (senders.get(todo.pop(), set()) & senders.keys()) - before
            before |= found
            todo += found
        if name in before:
            del threads[name]["join"], threads[name]["pairing"], senders[name]


_PLAIN = re.compile(r"[A-Za-z0-9(][A-Za-z0-9_ ./%()<>=!*+-]*")


def _scalar(text: str) -> str:
    if _PLAIN.fullmatch(text) and text == text.strip():
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def to_yaml(document: dict[str, Any]) -> str:
    """A document of texts, lists and mappings as YAML, one component per line."""
    lines = []
    for key, value in document.items():
        if isinstance(value, dict):
            lines.append(f"{key}:")
            lines += [f"  {_scalar(name)}: {_flow(body)}" for name, body in value.items()]
        elif isinstance(value, list):
            lines.append(f"{key}:")
            lines += [f"  - {_flow(item)}" for item in value]
        else:
            lines.append(f"{key}: {_scalar(value)}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    keep({f"{size} {seed}": draw(seed, size) for size, seeds in USUAL.items() for seed in dict.fromkeys(seeds)})
