"""Random problems whose frames are packed: few senders with signals of several sizes, rates and deadlines on a bus."""

from __future__ import annotations

from random import Random

TYPES = {
    "can": (
        "slow: {bandwidth: 100 kbit/s, frame: can, price: 1 EUR}",
        "fast: {bandwidth: 200 kbit/s, frame: can, price: 3 EUR}",
    ),
    "mixed": (
        "slow: {bandwidth: 125 kbit/s, frame: {protocol: can, identifier_bits: 29}, price: 1 EUR}",
        "fast: {bandwidth: 125 kbit/s, frame: {protocol: can_fd, data_bandwidth: 500 kbit/s}, price: 3 EUR}",
    ),
}
JOB = "compute_execution_time: 100 us .. 900 us, "
PERIODS = ("5", "10", "20", "40")


def draw_packing_problem(seed: int, signals: int = 5) -> str:
    """The text of a problem with so many signals; limits are tight, and identifiers stated, open, or both.

    Senders are devices, or threads on one processor. Sometimes a signal releases a thread there.
    """
    rng = Random(f"packed frames {seed}")
    senders = rng.choice((1, 2, 2))
    kind = rng.choice(("can", "can", "mixed"))
    share = rng.choice((0, 0.5, 1))
    states_rates, are_threads, releases = rng.random() < 0.7, rng.random() < 0.3, rng.random() < 0.3
    lines = ["dse: 1", f"name: packing {seed}", "bus_types:", *(f"  {line}" for line in TYPES[kind])]
    lines += ["buses: {can0: {type: [slow, fast]}}", "packing: {can0: any}"]
    lines += [f"processing: {rng.choice(('response_time', 'execution_time'))}"]
    lines += ["processor_types: {c: {cores: 1}}", "processors: {p: {type: c}, q: {type: c}}"]
    job = "compute_execution_time: 100 us .. 900 us, processor: p, " if are_threads else rng.choice(("", "", JOB))
    drawn = [f"  d{number}: {{{job}period: {rng.choice(PERIODS)} ms}}" for number in range(senders)]
    act = ["  act: {processor: q, dispatch_protocol: aperiodic, compute_execution_time: 50 us .. 100 us}"] * releases
    lines += ["devices:", "  sink: {}", *([] if are_threads else drawn)]
    lines += ["threads:", *(drawn if are_threads else []), *act] if are_threads or releases else []
    lines += ["connections:"]
    numbers = rng.sample(range(1, 40), 2 * signals)
    for number in range(signals):
        identifier = "any" if rng.random() < share else hex(numbers[number])
        if rng.random() < 0.15:
            identifier = f"[{hex(numbers[number])}, {rng.choice(('any', hex(numbers[signals + number])))}]"
        ends = "to: act" if releases and not number else "to: sink, port: data"
        parts = [f"from: d{rng.randrange(senders)}", ends, f"data_size: {rng.choice((0, 1, 2, 3, 6))} B"]
        parts += ["bus: can0", f"identifier: {identifier}"]
        rate = 1000 // int(rng.choice(PERIODS))
        parts += [f"rate: {rate} Hz"] if states_rates and rng.random() < 0.9 else []
        parts += [f"deadline: {rng.choice((2, 3, 4, 6, 9))} ms"] if rng.random() < 0.7 else []
        lines.append(f"  s{number}: {{{', '.join(parts)}}}")
    first = next(line for line in lines if line.startswith("  s0: ")).partition("from: ")[2].partition(",")[0]
    lines.append(f"flows: {{f: {{path: [{first}, s0, {'act' if releases else 'sink'}]}}}}")
    second = rng.choice(("busy of can0", "load of can0", "latency of f", "jitter of f"))
    return "\n".join([*lines, f"objectives: [minimise price, minimise {second}]"])
