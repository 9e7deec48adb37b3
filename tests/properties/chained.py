"""Random problems of chains of threads whose lags differ from their response times: one design each.

Jitter is mostly as long as a period or longer, and busy periods have several jobs: threads take almost no time at
least, behind devices that do so, too. Chains fork, and meet where any input releases a thread; on their way are cores,
connections that take time, buses that messages wait for, threads that keep a distance, executors, segments, stated
response times, threads without a processor, and timers, some of which let data pass at their deadline. In every other
problem a chain goes away from a core, and returns to it with more urgent threads than it left.
"""

from __future__ import annotations

import random
from typing import Any

from tests.oracle.generator import to_yaml

PERIODS = (4, 5, 6, 8, 10, 12, 15, 20)
Bodies = dict[str, dict[str, Any]]


def draw(seed: int) -> str:
    """The text of a problem."""
    rng = random.Random(f"chained {seed}")
    document: dict[str, Any] = {
        "dse": "1", "name": f"chained {seed}", "processing": "response_time", "deadlines": "none",
        "overload": "allowed", "processor_types": {"cpu": {"cores": rng.choice(("1", "1", "2"))}},
        "processors": {name: {"type": "cpu"} for name in ("p", "q", "o")[: rng.randint(1, 3)]},
        "bus_types": {
            "ipc": {"virtual": "true", "transmission_time": {"fixed": "100 us .. 2 ms"}},
            "net": {"transmission_time": {"fixed": "100 us .. 400 us"}, "arbitration": "fifo"},
        },
        "buses": {"ipc": {"type": "ipc"}, "net": {"type": "net"}},
        "devices": {}, "threads": {}, "connections": {}, "flows": {},
    }  # fmt: skip
    for number in range(rng.choice((1, 1, 2))):
        document["devices"][f"d{number}"] = _device(rng)
    if seed % 2:
        _add_return(rng, document)
    else:
        _add_threads(rng, document)
        _gather(rng, document)
    _pin(rng, document)
    _add_flows(rng, document)
    timed = [name for name, body in document["threads"].items() if "processor" in body or "executor" in body]
    document["metrics"] = {f"end_{name}": f"response time of {name}" for name in timed}
    document["objectives"] = [f"minimise {name}" for name in document["metrics"]]
    return to_yaml({key: value for key, value in document.items() if value != {}})


def _device(rng: random.Random) -> dict[str, Any]:
    period = rng.choice(PERIODS)
    field = rng.choice(("compute_execution_time", "compute_execution_time", "latency"))
    return {"period": f"{period} ms", field: f"{rng.randint(0, 500)} us .. {rng.randint(500, 2_000 * period)} us"}


def _add_threads(rng: random.Random, document: dict[str, Any]) -> None:
    """Two to eight threads, each behind one that is there or behind nothing, with connections from those before."""
    often: dict[str, float] = {name: 1 / float(body["period"].split()[0]) for name, body in document["devices"].items()}
    count = rng.randint(3, 8)
    share = rng.choice((0.5, 0.7, 0.85, 0.95)) * len(document["processors"])
    threads: Bodies = document["threads"]
    for number in range(count):
        name, before = f"t{number}", []
        if rng.random() > (0.7 if number == 0 else 0.15):
            before = [rng.choice(list(often)[-2:]) if rng.random() < 0.75 else rng.choice(list(often))]
        if before and rng.random() < 0.1:
            before = list(dict.fromkeys([*before, rng.choice(list(often))]))
        beside = threads.get(before[0], {}).get("processor") if before and rng.random() < 0.5 else None
        body: dict[str, Any] = {"processor": beside or rng.choice(list(document["processors"]))}
        often[name] = sum(often[each] for each in before)
        if not before or rng.random() < 0.05:
            period = rng.choice(PERIODS)
            body["period"] = f"{period} ms"
            often[name] = 1 / period
            if before and rng.random() < 0.3:
                body["communication"] = "let"
        elif rng.random() < 0.08:
            apart = rng.choice((1, 2, 3, 4, 6, 8))
            body |= {"dispatch_protocol": "sporadic", "period": f"{apart} ms"}
            often[name] = min(often[name], 1 / apart)
        else:
            body["dispatch_protocol"] = "aperiodic"
        most = round(1_000 * share * rng.uniform(0.4, 1.6) / count / often[name])
        body["compute_execution_time"] = f"{rng.choice((0, most // 10, most // 2, most))} us .. {most} us"
        if rng.random() < 0.8:
            body["priority"] = str(rng.randint(1, 4))
        if before and rng.random() < 0.08:
            body["response_time"] = f"{most // 2} us .. {rng.choice((most, 2 * most, 4 * most))} us"
        threads[name] = body
        for each in before:
            way = _way(rng, threads.get(each, {}))
            document["connections"][f"{each}{name}"] = {"from": each, "to": name, **way}


def _add_return(rng: random.Random, document: dict[str, Any]) -> None:
    """A chain with an urgent thread behind a less urgent one of its core, mostly by way of what takes long elsewhere.

    Timers of that core go between, and first.
    """
    period = rng.choice(PERIODS[2:])
    document["processors"] = {name: {"type": "cpu"} for name in ("p", "q")}
    document["devices"] = {"d0": _device(rng) | {"period": f"{period} ms"}} if rng.random() < 0.6 else {}
    between = rng.choice(("q", "q", "way", "both", "none"))
    urgent = [("p", rng.choice((3, 4)), period) for _ in range(rng.choice((1, 1, 2)))]
    chain = [("p", rng.randint(1, 4), period)] if rng.random() < 0.3 else []
    chain += [("p", 1, period), *([("q", 1, period)] if between in ("q", "both") else []), *urgent]
    beside = [("p", 2, rng.choice(PERIODS[2:])) for _ in range(rng.choice((0, 1, 1)))]
    beside += [("p", rng.choice((3, 4, 5)), rng.choice(PERIODS)) for _ in range(rng.choice((0, 1, 1)))]
    count = sum(place == "p" for place, _, _ in chain + beside)
    share = rng.choice((0.4, 0.6, 0.8, 0.9))
    before = next(iter(document["devices"]), None)
    for number, (place, priority, often) in enumerate(chain + beside):
        used = share * rng.uniform(0.5, 1.3) / count if place == "p" else rng.uniform(0.3, 0.95)
        most = round(1_000 * often * used)
        least = rng.choice((0, most // 10, most // 2, most))
        name, body = f"t{number}", {"processor": place, "priority": str(priority)}
        if number >= len(chain) or before is None:
            body["period"] = f"{often} ms"
        else:
            body["dispatch_protocol"] = "aperiodic"
            is_long = number == len(chain) - len(urgent) and between in ("way", "both")
            way = {"latency": f"0 us .. {rng.randint(1, 1_000 * period)} us"} if is_long else {}
            document["connections"][f"{before}{name}"] = {"from": before, "to": name, **way}
        document["threads"][name] = body | {"compute_execution_time": f"{least} us .. {most} us"}
        before = name


def _way(rng: random.Random, sender: dict[str, Any]) -> dict[str, Any]:
    """What a message travels by, if by anything; sometimes for less than the shortest time of what sends it."""
    case = rng.random()
    if case < 0.12:
        return {"bus": "ipc", "data_size": "8 B"}
    if case < 0.17:
        return {"bus": "net", "data_size": "8 B"}
    if case < 0.27:
        return {"latency": f"0 us .. {rng.randint(1, 3_000)} us"}
    least = int(sender.get("compute_execution_time", "0 us").split()[0])
    if least and case < 0.42:
        return {"latency": f"0 us .. {rng.choice((least, least - 1, least // 2, least + 1))} us"}
    return {}


def _gather(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes one or two threads are in an executor, one has segments or no processor, or needs all its inputs."""
    threads: Bodies = document["threads"]
    plain = [body for body in threads.values() if "response_time" not in body]
    if len(plain) > 2 and rng.random() < 0.25:
        inside = rng.sample(plain, rng.choice((1, 1, 2)))
        kind, home = rng.choice(("fifo", "callback_group", "wait_set")), inside[0]["processor"]
        document["executors"] = {"node": {"processor": home, "kind": kind}}
        for body in inside:
            del body["processor"]
            body["executor"] = "node"
            if kind != "callback_group":
                body.pop("priority", None)
    whole = [body for body in plain if "processor" in body and "communication" not in body]
    speaks_of_clocks = any("communication" in body for body in threads.values())
    if whole and not speaks_of_clocks and rng.random() < 0.1:
        body = rng.choice(whole)
        least, most = (int(text.split()[0]) for text in body.pop("compute_execution_time").split(" .. "))
        half = {"compute_execution_time": f"{least // 2} us .. {max(1, most // 2)} us"}
        body["segments"] = [half, {"processor": "g", **half}]
        document["processor_types"]["gpu"] = {"serves": "fifo"}
        document["processors"]["g"] = {"type": "gpu"}
    elif whole and rng.random() < 0.05:
        rng.choice(whole).pop("processor")
    for name, body in threads.items():
        coming = [each for each in document["connections"].values() if each["to"] == name]
        if len(coming) > 1 and "segments" not in body and rng.random() < 0.3 and "period" not in body:
            body |= {"join": "all", "queue_size": "2"}


def _pin(rng: random.Random, document: dict[str, Any]) -> None:
    """States cores, seldom one or a priority that is open, and sections where no executor or accelerator is."""
    here: list[dict[str, Any]] = [body for body in document["threads"].values() if "processor" in body]
    if document["processor_types"]["cpu"]["cores"] == "2":
        for body in [*here, *document.get("executors", {}).values()]:
            body["core"] = rng.choice(("1", "1", "1", "2"))
        if here and rng.random() < 0.15:
            rng.choice(here)["core"] = ["1", "2"]
    if here and rng.random() < 0.1:
        body = rng.choice(here)
        body["priority"] = ["1", "3"]
    if "executors" in document or "gpu" in document["processor_types"] or rng.random() < 0.5:
        return
    for body in here:
        if rng.random() < 0.3:
            most = int(body["compute_execution_time"].split()[3])
            body["non_preemptive"] = f"{rng.randint(1, most + 100)} us"


def _add_flows(rng: random.Random, document: dict[str, Any]) -> None:
    """From the first component of each way to each thread, and from one in its middle."""
    connections: Bodies = document["connections"]
    for name in document["threads"]:
        path = [name]
        while coming := [each for each in connections.values() if each["to"] == path[0]]:
            path.insert(0, rng.choice(coming)["from"])
        document["flows"][f"to {name}"] = {"path": path}
        if len(path) > 2:
            document["flows"][f"part to {name}"] = {"path": path[rng.randrange(1, len(path) - 1) :]}
