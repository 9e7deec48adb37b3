"""Calls that are answered, written out: every job and message of theirs is an entry of a document without calls.

Random small problems with calls come with it. Nothing of the product is in here.
"""

from __future__ import annotations

import random
from typing import Any

Document = dict[str, Any]


def written_out(document: Document) -> Document:
    """The problem without calls: requests and replies as connections, and a thread for each further job.

    Lists of options are decisions of their own there, which rules keep equal to those of the entry that they are of.
    """
    threads, wires = dict(document["threads"]), dict(document["connections"])
    calls = {name: wire for name, wire in wires.items() if "reply" in wire}
    rules = list(document.get("rules", ()))
    ways: dict[str, list[str]] = {}
    lasts: dict[str, str] = {}
    used: set[str] = set()

    def again(name: str, label: str) -> str:
        """A thread once more, for another caller."""
        body = {key: value for key, value in document["threads"][name].items() if key not in ("price", "power")}
        return keep(threads, name, f"{name}{label}", body)

    def keep(section: Document, original: str, name: str, body: Document) -> str:
        section[name] = body
        rules.extend(f"'{name}'.{key} == '{original}'.{key}" for key, value in body.items() if isinstance(value, list))
        return name

    def job(name: str, label: str) -> tuple[str, str, list[str]]:
        """The first and the last job of a thread, and the way from the one to the other."""
        first = at = again(name, label) if name in used else name
        used.add(name)
        way: list[str] = []
        for call, wire in calls.items():
            if wire["from"] != name:
                continue
            begin, end, inner = job(wire["to"], f"{label} {call}")
            place = {key: value for key, value in threads[name].items() if key in ("executor", "priority", "process")}
            after = {**place, "dispatch_protocol": "aperiodic"}
            if "compute_execution_time" in wire["reply"]:
                after["compute_execution_time"] = wire["reply"]["compute_execution_time"]
            then = keep(threads, name, f"{name}{label} after {call}", after)
            request = {key: value for key, value in wire.items() if key != "reply"} | {"from": at, "to": begin}
            answer = {key: value for key, value in wire.items() if key in ("bus", "latency", "port")}
            answer |= {"from": end, "to": then, **{key: value for key, value in wire["reply"].items()
                                                   if key in ("data_size", "latency", "identifier")}}  # fmt: skip
            asked = call if call not in stated else f"{call}{label}"
            stated.add(call)
            keep(wires, call, asked, request) if asked != call else wires.update({call: request})
            keep(wires, call, f"{call}{label} reply", answer)
            way += [asked, begin, *inner, f"{call}{label} reply", then]
            at = then
        return first, at, way

    stated: set[str] = set()
    for name in document["threads"]:
        if any(wire["from"] == name for wire in calls.values()) and all(wire["to"] != name for wire in calls.values()):
            first, last, way = job(name, "")
            ways[first], lasts[name] = way, last
    for name, wire in document["connections"].items():
        if name not in calls and wire.get("from") in lasts:
            wires[name] = {**wire, "from": lasts[wire["from"]]}
    flows = {
        name: {**flow, "path": [step for element in flow["path"] for step in (element, *ways.get(element, ()))]}
        for name, flow in document["flows"].items()
    }
    return {**document, "threads": threads, "connections": wires, "flows": flows, "rules": rules}


def random_calls(seed: int) -> Document:
    """A problem with a call or several: by one caller or two, of one server that perhaps calls another one."""
    rng = random.Random(f"calls {seed}")
    cores = rng.choice([1, 1, 2])

    def times(most: int) -> str:
        low = rng.randint(1, most)
        return f"{low} ms .. {rng.randint(low, most)} ms"

    kinds = ["fifo", "callback_group", "wait_set"]
    executors = {name: {"kind": rng.choice(kinds), "processor": "pc", "core": rng.randint(1, cores)}
                 for name in ("e0", "e1", "e2")}  # fmt: skip
    homes = ["e0", "e1", "e2"]

    def home(name: str) -> Any:
        return rng.sample(homes, 2) if rng.random() < 0.25 else name

    threads: Document = {
        "caller": {"executor": home("e0"), "dispatch_protocol": "aperiodic", "compute_execution_time": times(2)},
        "server": {"executor": home("e1"), "compute_execution_time": times(4)},
        "actor": {"executor": "e2", "dispatch_protocol": "aperiodic", "compute_execution_time": times(2)},
    }
    threads |= {
        f"timer_{name}": {"executor": name, "period": "50 ms", "compute_execution_time": times(1)} for name in homes
    }

    def call(source: str, target: str) -> Document:
        wire: Document = {"from": source, "to": target, "data_size": f"{rng.randint(1, 200)} B"}
        if rng.random() < 0.7:
            wire["bus"] = rng.choice(["ros", ["ros", "local"], ["ros", "slow"]])
        elif rng.random() < 0.5:
            wire["latency"] = times(2)
        wire["reply"] = {"data_size": f"{rng.randint(1, 2000)} B"}
        if rng.random() < 0.6:
            wire["reply"]["compute_execution_time"] = times(3)
        return wire

    wires: Document = {"sensed": {"from": "sensor", "to": "caller"}, "ask": call("caller", "server"),
                       "act": {"from": "caller", "to": "actor", "data_size": "100 B", "bus": "ros"}}  # fmt: skip
    flows: Document = {"main": {"path": ["sensor", "caller", "actor"]}}
    if rng.random() < 0.6:
        threads["other"] = {"executor": home("e2"), "period": rng.choice(["40 ms", ["40 ms", "80 ms"]]),
                            "compute_execution_time": times(2)}  # fmt: skip
        wires["ask_too"] = call("other", "server")
        flows["side"] = {"path": ["other"]}
    if rng.random() < 0.4:
        threads["store"] = {"executor": "e2", "compute_execution_time": times(2)}
        wires["fetch"] = call("server", "store")
    if rng.random() < 0.3:
        wires["ask_again"] = call("caller", "server")
    return {
        "dse": 1, "name": f"calls {seed}", "processing": rng.choice(["execution_time", "response_time"]),
        "processor_types": {"pc": {"cores": cores}}, "processors": {"pc": {"type": "pc"}},
        "bus_types": {
            "ros": {"virtual": True, "transmission_time": {"fixed": "100 us .. 200 us", "per_byte": "1 us"}},
            "slow": {"virtual": True, "transmission_time": {"fixed": "1 ms .. 2 ms", "per_byte": "2 us"}},
        },
        "devices": {"sensor": {"period": rng.choice([["50 ms", "100 ms"], "50 ms"]), "latency": times(3)}},
        "executors": executors, "threads": threads, "connections": wires, "flows": flows,
        "objectives": ["minimise latency of main", "minimise utilisation of pc",
                       rng.choice(["minimise load of ros", "minimise jitter of main"])],
    }  # fmt: skip
