"""Random small problems with a join of all: timers, perhaps threads on the way, the join, perhaps what follows."""

from __future__ import annotations

import random
from typing import Any

from tests.oracle.generator import to_yaml

PERIODS = (10, 20, 40, 50)


def draw_join(seed: int, *, options: bool = False) -> str:
    """A problem by its seed; with `options` some of its figures are decisions, and it asks for a front."""
    rng = random.Random(f"join {seed}")
    alike = rng.random() < 0.6
    common = rng.choice(PERIODS)
    clocked = rng.random() < 0.35
    cores = rng.choice([1, 2, 4])
    document: dict[str, Any] = {
        "dse": "1",
        "name": f"join {seed}",
        "processing": rng.choice(["execution_time", "response_time"]),
        "processor_types": {"pc": {"cores": str(cores), "price": "100 EUR"}},
        "processors": {"pc": {"type": "pc"}},
        "devices": {},
        "threads": {},
        "connections": {},
        "flows": {},
    }
    if clocked:
        document["clocks"] = {"bus": {"synchronisation_error": f"{rng.choice([0, 0, 1])} ms"}}
    devices, threads, wires = document["devices"], document["threads"], document["connections"]

    def core() -> dict[str, str]:
        return {"processor": "pc", "core": str(rng.randint(1, cores))}

    def times(most: int) -> str:
        low = rng.randint(0, most)
        return f"{low} ms .. {rng.randint(max(low, 1), most)} ms"

    ways: list[list[str]] = []
    for number in range(rng.choice([2, 2, 3])):
        period = common if alike else rng.choice(PERIODS)
        way = [f"d{number}"]
        if ways and rng.random() < 0.25:
            way = [ways[0][0]]  # a fork: both come from one timer
        else:
            devices[way[0]] = {"period": f"{period} ms", "latency": times(rng.choice([1, 5, 30]))}
            if clocked and rng.random() < 0.9:
                devices[way[0]] |= {"clock": "bus", "offset": f"{rng.randrange(0, period, 2)} ms"}
        if rng.random() < 0.4:
            name = f"t{number}"
            threads[name] = {**core(), "dispatch_protocol": "aperiodic", "compute_execution_time": times(2)}
            wires[f"to_{name}"] = {"from": way[-1], "to": name}
            way.append(name)
        ways.append(way)
    protocol = rng.choices(["aperiodic", "sporadic", "hybrid"], [6, 1, 2])[0]
    join: dict[str, Any] = {**core(), "join": "all", "dispatch_protocol": protocol}
    join["compute_execution_time"] = times(2)
    if protocol != "aperiodic":
        join["period"] = f"{rng.choice([5, 10, 30])} ms"
    if protocol == "hybrid":
        join["callback_execution_time"] = times(1)
    if rng.random() < 0.3:
        join["pairing"] = rng.choice(["latest", "fifo"])
    if rng.random() < 0.3:
        join["queue_size"] = str(rng.choice([1, 2, 3]))
    threads["join"] = join
    for number, way in enumerate(ways):
        wires[f"in{number}"] = {"from": way[-1], "to": "join"}
        if rng.random() < 0.15:
            wires[f"in{number}"]["latency"] = times(3)
        if rng.random() < 0.2:
            wires[f"in{number}"]["queue_size"] = str(rng.choice([1, 2, 4]))
    tail: list[str] = []
    last = "join"
    if rng.random() < 0.5:
        threads["after"] = {**core(), "compute_execution_time": times(2)}
        threads["after"] |= rng.choice([{"dispatch_protocol": "aperiodic"}, {"period": f"{rng.choice(PERIODS)} ms"}])
        wires["out"] = {"from": "join", "to": "after"}
        tail, last = ["after"], "after"
    if rng.random() < 0.3:  # a second join behind the first
        wires["deep"] = {"from": last, "to": "second"}
        wires["direct"] = {"from": ways[0][-1], "to": "second"}
        threads["second"] = {**core(), "join": "all", "dispatch_protocol": "aperiodic"}
        threads["second"] |= {"compute_execution_time": times(1)}
        tail.append("second")
    if rng.random() < 0.4:
        threads["busy"] = {**core(), "period": f"{rng.choice(PERIODS)} ms", "compute_execution_time": times(3)}
    for number, way in enumerate(ways):
        start = rng.randrange(len(way))
        document["flows"][f"f{number}"] = {"path": [*way[start:], f"in{number}", "join", *tail]}
    if options:
        _open(rng, document)
    return to_yaml(document)


def _open(rng: random.Random, document: dict[str, Any]) -> None:
    """Some figures become decisions."""
    threads, devices = document["threads"], document["devices"]
    joins = threads["join"]
    timers = list(devices.values())
    if "period" in joins and rng.random() < 0.5:
        joins["period"] = ["5 ms", "10 ms"]
    choices = [lambda: joins.update(join=["any", "all"])]
    if rng.random() < 0.7:
        choices.append(lambda: joins.update(pairing=["fifo", "latest"]))
    if not any("offset" in item for item in timers):
        choices.append(lambda: timers[0].update(period=["20 ms", "40 ms"]))
        if joins["dispatch_protocol"] == "aperiodic":
            choices.append(lambda: joins.update(dispatch_protocol=["periodic", "aperiodic"], period=["10 ms", "20 ms"]))
    cores = int(document["processor_types"]["pc"]["cores"])
    if cores > 1:
        choices.append(lambda: joins.update(core=["1", "2"]))
    for choose in rng.sample(choices, min(len(choices), rng.choice([2, 3]))):
        choose()
    document["objectives"] = [
        f"{rng.choice(['minimise'])} {rng.choice(['latency', 'jitter', 'reaction time'])} of f0",
        f"{rng.choice(['minimise', 'maximise'])} {rng.choice(['utilisation of pc', 'latency of f1', 'min latency of f1'])}",
    ]
    document["overload"] = "allowed"
