"""Random problems with messages of which many may have any identifier, some of them on flows over several messages."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random


def draw_identifier_problem(seed: int, *, decisions: int = 6) -> str:
    """The text of a problem with one rather full bus, a few senders, and up to so many open decisions.

    Some senders are threads of one core, where response times count; each message sends to a sink or another sender.
    """
    rng = Random(f"identifiers {seed}")
    left = [decisions]

    def options(values: Sequence[str]) -> str:
        """One value, or two as options while some are left."""
        if left[0] and rng.random() < 0.3:
            left[0] -= 1
            return f"[{', '.join(rng.sample(values, 2))}]"
        return rng.choice(values)

    count = rng.randint(4, 7)
    names = [f"x{one}" for one in range(count)]
    threads = names[: rng.randint(0, 2)]
    lines = ["dse: 1", f"name: identifiers {seed}", f"processing: {rng.choice(('response_time', 'execution_time'))}"]
    lines += ["processor_types: {c: {cores: 1, price: 1 EUR}}", "processors: {p: {type: c}}", "bus_types:"]
    lines += ["  slow: {bandwidth: 125 kbit/s, frame: can, price: 1 EUR}"]
    lines += ["  fast: {bandwidth: 250 kbit/s, frame: can, price: 3 EUR}"]
    lines += [f"buses: {{can: {{type: {options(['slow', 'fast'])}, overload: allowed}}}}", "devices:", "  sink: {}"]
    lines += [f"  {name}: {{period: {options(['4 ms', '5 ms', '8 ms', '12 ms'])}}}" for name in names[len(threads) :]]
    lines += ["threads:"] if threads else []
    for name in threads:
        cost = f"compute_execution_time: 100 us .. {rng.choice(('400 us', '1 ms'))}"
        lines.append(f"  {name}: {{processor: p, period: {options(['5 ms', '8 ms', '10 ms'])}, {cost}}}")
    lines.append("connections:")
    numbers, before, targets = rng.sample(range(4, 200, rng.choice((1, 3, 16))), count), list[str](), list[str]()
    for one, name in enumerate(names):
        own = identifier = hex(numbers[one])
        drawn = rng.random()
        if left[0] and drawn > 0.6:
            left[0] -= 1
            identifier = f"[{own}, any]"
            before.append(f"  m{one}: {{identifier: {own}}}")
        elif drawn > 0.3:
            identifier = "any"
        deadline = f", deadline: {options(['3 ms', '5 ms', '8 ms', '12 ms'])}" if rng.random() < 0.7 else ""
        targets.append(rng.choice(["sink", *(other for other in names if other != name)]))
        size = options(["0 B", "4 B", "8 B", "12 B"])
        sent = f"from: {name}, to: {targets[-1]}, port: data, bus: can, data_size: {size}"
        lines.append(f"  m{one}: {{{sent}, identifier: {identifier}{deadline}}}")
    lines += ["baseline:", *before] if before else []
    lines.append("flows:")
    wanted = ["minimise price", *(["minimise changes"] if before else [])]
    for flow in range(rng.randint(1, 2)):
        path, seen = [rng.choice(names)], set[str]()
        while path[-1] != "sink" and path[-1] not in seen:
            seen.add(path[-1])
            one = int(path[-1].removeprefix("x"))
            path += [f"m{one}", targets[one]]
        lines.append(f"  f{flow}: {{path: [{', '.join(path)}]}}")
        wanted.append(f"minimise {rng.choice(('jitter', 'latency'))} of f{flow}")
    return "\n".join([*lines, f"objectives: [{', '.join(wanted)}]"])
