"""Random problems of executors that poll and may be overloaded: timers skip, topics keep the last, some are open."""

from __future__ import annotations

import random

METRICS = ("latency", "reaction time", "data age", "jitter", "min latency")


def draw_polled(seed: int) -> str:
    """A chain through one or two executors that poll, and what else runs on their cores."""
    rng = random.Random(f"polled {seed}")
    names = [f"t{number}" for number in range(rng.choice((2, 3, 3, 4)))]
    executors = [f"e{number}" for number in range(rng.choice((1, 1, 2)))]
    wires, threads = [], []
    for number, name in enumerate(names):
        protocol = (
            "periodic" if not number else rng.choice(("periodic", "aperiodic", "aperiodic", "hybrid", "sporadic"))
        )
        homes = rng.sample(executors, 2) if len(executors) > 1 and rng.random() < 0.3 else [rng.choice(executors)]
        longest = rng.choice((0, 1, 2, 3, 5, 9))
        fields = [f"executor: [{', '.join(homes)}]", f"dispatch_protocol: {protocol}"]
        fields.append(f"compute_execution_time: {rng.choice((0, longest))} ms .. {longest} ms")
        if protocol != "aperiodic":
            periods = rng.sample((2, 4, 5, 10, 20), rng.choice((1, 1, 2)))
            fields.append(f"period: [{', '.join(f'{time} ms' for time in sorted(periods))}]")
        if protocol == "hybrid":
            fields.append(f"callback_execution_time: {rng.choice((0, 1, 3))} ms")
        if seed % 2:
            fields += rng.choice(([], ["priority: 1"], ["priority: 2"], ["priority: [1, 3]"]))
        if rng.random() < 0.2:
            fields.append(f"queue_size: {rng.choice((0, 1, 2))}")
        threads.append(f"  {name}: {{{', '.join(fields)}}}")
        if number:
            fields = [f"from: t{number - 1}", f"to: {name}"]
            if rng.random() < 0.7:
                fields.append(f"queue_size: {rng.choice(('1', '1', '2', '[1, 3]'))}")
            elif protocol == "periodic" and rng.random() < 0.5:
                fields.append("port: data")
            wires.append(f"  c{number}: {{{', '.join(fields)}}}")
    for number in range(rng.choice((0, 0, 1))):
        longest = rng.choice((1, 2, 3))
        threads.append(f"  o{number}: {{processor: pc, core: 1, period: {rng.choice((5, 8))} ms, priority: 9,"
                       f" compute_execution_time: {longest} ms}}")  # fmt: skip
    kinds = [rng.choice(("polling", "polling", "[polling, wait_set]", "[callback_group, polling]")) for _ in executors]
    cores = [rng.choice(("1", "1", "2", "[1, 2]")) for _ in executors]
    places = zip(executors, kinds, cores, strict=True)
    path = ", ".join(names)
    asked = rng.sample(METRICS[:3], 2)
    lines = [
        "dse: 1",
        f"name: polled {seed}",
        "processing: response_time",
        "overload: allowed",
        "deadlines: none",
        "processor_types: {PC: {cores: 2}}",
        "processors: {pc: {type: PC}}",
        "executors:",
        *(f"  {name}: {{kind: {kind}, processor: pc, core: {core}}}" for name, kind, core in places),
        "threads:",
        *threads,
        "connections:",
        *wires,
        f"flows: {{chain: {{path: [{path}]}}}}",
        f"objectives: [{', '.join(f'minimise {metric} of chain' for metric in asked)}, minimise utilisation of pc]",
    ]
    if not wires:
        lines = [line for line in lines if line != "connections:"]
    used = {home for home in executors if any(home in text for text in threads)}
    return (
        "\n".join(line for line in lines if not any(line.startswith(f"  {one}:") for one in set(executors) - used))
        + "\n"
    )
