"""Random small problems with a join of all: timers, perhaps threads on the way, the join, perhaps what follows."""

from __future__ import annotations

import random
from typing import Any

from tests.oracle.generator import to_yaml

PERIODS = (10, 20, 40, 50)


class _Draft:
    """A problem in the making."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(f"join {seed}")
        self.cores = self.rng.choice([1, 2, 4])
        self.is_clocked = self.rng.random() < 0.35
        self.document: dict[str, Any] = {
            "dse": "1",
            "name": f"join {seed}",
            "processing": self.rng.choice(["execution_time", "response_time"]),
            "processor_types": {"pc": {"cores": str(self.cores), "price": "100 EUR"}},
            "processors": {"pc": {"type": "pc"}},
        }
        if self.is_clocked:
            self.document["clocks"] = {"bus": {"synchronisation_error": f"{self.rng.choice([0, 0, 1])} ms"}}
        self.devices, self.threads, self.wires, self.flows = (
            self.document.setdefault(key, {}) for key in ("devices", "threads", "connections", "flows")
        )

    def core(self) -> dict[str, str]:
        return {"processor": "pc", "core": str(self.rng.randint(1, self.cores))}

    def times(self, most: int) -> str:
        low = self.rng.randint(0, most)
        return f"{low} ms .. {self.rng.randint(max(low, 1), most)} ms"

    def timer(self, name: str, period: int) -> None:
        """A device, perhaps on the clock."""
        self.devices[name] = {"period": f"{period} ms", "latency": self.times(self.rng.choice([1, 5, 30]))}
        if self.is_clocked and self.rng.random() < 0.9:
            self.devices[name] |= {"clock": "bus", "offset": f"{self.rng.randrange(0, period, 2)} ms"}

    def ways(self) -> list[list[str]]:
        """The components on the way to each input: a timer, perhaps one that another way has, perhaps a thread."""
        rng = self.rng
        common, found = (rng.choice(PERIODS) if rng.random() < 0.6 else 0), list[list[str]]()
        for number in range(rng.choice([2, 2, 3])):
            way = [f"d{number}"]
            if found and rng.random() < 0.25:
                way = [found[0][0]]
            else:
                self.timer(way[0], common or rng.choice(PERIODS))
            if rng.random() < 0.4:
                name = f"t{number}"
                self.threads[name] = {**self.core(), "dispatch_protocol": "aperiodic"}
                self.threads[name]["compute_execution_time"] = self.times(2)
                self.wires[f"to_{name}"] = {"from": way[-1], "to": name}
                way.append(name)
            found.append(way)
        return found

    def join(self) -> None:
        """The thread that needs all."""
        rng = self.rng
        protocol = rng.choices(["aperiodic", "sporadic", "hybrid"], [6, 1, 2])[0]
        body: dict[str, Any] = {**self.core(), "join": "all", "dispatch_protocol": protocol}
        body["compute_execution_time"] = self.times(rng.choice([2, 2, 9]))
        if protocol != "aperiodic":
            body["period"] = f"{rng.choice([5, 10, 30])} ms"
        if protocol == "hybrid":
            body["callback_execution_time"] = self.times(1)
        if rng.random() < 0.3:
            body["pairing"] = rng.choice(["latest", "fifo"])
        if rng.random() < 0.3:
            body["queue_size"] = str(rng.choice([1, 2, 3]))
        self.threads["join"] = body

    def inputs(self, ways: list[list[str]]) -> None:
        for number, way in enumerate(ways):
            wire = self.wires[f"in{number}"] = {"from": way[-1], "to": "join"}
            if self.rng.random() < 0.15:
                wire["latency"] = self.times(3)
            if self.rng.random() < 0.2:
                wire["queue_size"] = str(self.rng.choice([1, 2, 4]))

    def tail(self, ways: list[list[str]]) -> list[str]:
        """What follows: perhaps a thread, perhaps a second join, with an input from before the first one."""
        rng, found = self.rng, list[str]()
        if rng.random() < 0.5:
            self.threads["after"] = {**self.core(), "compute_execution_time": self.times(2)}
            by_timer = {"period": f"{rng.choice(PERIODS)} ms"}
            self.threads["after"] |= rng.choice([{"dispatch_protocol": "aperiodic"}, by_timer])
            self.wires["out"] = {"from": "join", "to": "after"}
            found = ["after"]
        if rng.random() < 0.3:
            self.wires["deep"] = {"from": found[-1] if found else "join", "to": "second"}
            self.wires["direct"] = {"from": ways[0][-1], "to": "second"}
            self.threads["second"] = {**self.core(), "join": "all", "dispatch_protocol": "aperiodic"}
            self.threads["second"]["compute_execution_time"] = self.times(1)
            found.append("second")
        if rng.random() < 0.4:
            self.threads["busy"] = {**self.core(), "period": f"{rng.choice(PERIODS)} ms"}
            self.threads["busy"]["compute_execution_time"] = self.times(3)
        return found

    def open(self) -> None:
        """Some figures become decisions, and there is something to ask."""
        rng, join, first = self.rng, self.threads["join"], next(iter(self.devices.values()))
        changes: list[tuple[dict[str, Any], dict[str, Any]]] = [(join, {"join": ["any", "all"]})]
        if "period" in join:
            changes.append((join, {"period": ["5 ms", "10 ms"]}))
        if rng.random() < 0.7:
            changes.append((join, {"pairing": ["fifo", "latest"]}))
        if not any("offset" in item for item in self.devices.values()):
            changes.append((first, {"period": ["20 ms", "40 ms"]}))
            if join["dispatch_protocol"] == "aperiodic":
                changes.append((join, {"dispatch_protocol": ["periodic", "aperiodic"], "period": ["10 ms", "20 ms"]}))
        if self.cores > 1:
            changes.append((join, {"core": ["1", "2"]}))
        for body, change in rng.sample(changes, min(len(changes), rng.choice([2, 3]))):
            body.update(change)
        one, other = rng.choice(["latency", "jitter", "reaction time"]), rng.choice(["latency", "min latency"])
        what = rng.choice(["utilisation of pc", f"{other} of f1"])
        self.document["objectives"] = [f"minimise {one} of f0", f"{rng.choice(['minimise', 'maximise'])} {what}"]
        self.document["overload"] = "allowed"


def draw_join(seed: int, *, options: bool = False) -> str:
    """A problem by its seed; with `options` some of its figures are decisions, and it asks for a front."""
    draft = _Draft(seed)
    ways = draft.ways()
    draft.join()
    draft.inputs(ways)
    tail = draft.tail(ways)
    for number, way in enumerate(ways):  # a flow may begin behind the timer
        begin = draft.rng.randrange(len(way))
        draft.flows[f"f{number}"] = {"path": [*way[begin:], f"in{number}", "join", *tail]}
    if options:
        draft.open()
    return to_yaml(draft.document)
