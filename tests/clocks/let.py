"""Chains under logical execution time, job by job: an exact witness that shares nothing with `dse`, and their problems.

A chain is a list of (offset, period, deadline), in ms. Every job reads at its release and writes at release + deadline;
a reader released at the moment of a writing reads it.
"""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from itertools import pairwise
from math import lcm
from pathlib import Path
from typing import Any, TypeAlias

Chain: TypeAlias = Sequence[tuple[int, int, int]]
CASES = Path(__file__).parent / "case_studies.jsonl"


def published() -> list[tuple[str, list[tuple[int, int, int]]]]:
    """The chains of real applications that M. Günzel, M. Becker and D. Casini collected, by name."""
    lines = [json.loads(line) for line in CASES.read_text().splitlines() if line.startswith("{")]
    return [
        (str(line["ID"]), [(task["phase"], task["period"], task["deadline"]) for task in line["tasks"]])
        for line in lines
    ]


def observed(chain: Chain) -> dict[str, int]:
    """The exact figures of a chain in its steady state, from the values that jobs read and write.

    `longest` and `shortest`: from a release of the first component to the first writing of the last one that holds what
    it read, or something newer. `age`: how old what is written can be, at its writing.
    """
    hyper = lcm(*(period for _, period, _ in chain))
    warm = max(offset + period + deadline for offset, period, deadline in chain) * (len(chain) + 1)
    until = 2 * warm + 2 * hyper + sum(period + deadline for _, period, deadline in chain)
    written: list[tuple[int, int]] = []  # (time, when its input was sampled) of the component before
    for position, (offset, period, deadline) in enumerate(chain):
        found, seen = [], 0
        for release in range(offset, until, period):
            if position == 0:
                found.append((release + deadline, release))
                continue
            while seen < len(written) and written[seen][0] <= release:
                seen += 1
            if seen:
                found.append((release + deadline, written[seen - 1][1]))
        written = found
    start, step = chain[0][0], chain[0][1]
    samples = range(start + -(-warm // step) * step, start + (-(-warm // step) + hyper // step) * step, step)
    latencies, at = [], 0
    for sample in samples:
        while written[at][1] < sample:
            at += 1
        latencies.append(written[at][0] - sample)
    settled = [(time, born) for time, born in written if born >= warm]
    period = chain[-1][1]
    ages = [time - born for time, born in settled[: hyper // period + 1]]
    return {"longest": max(latencies), "shortest": min(latencies), "age": max(ages)}


def problem(chain: Chain, *, known: bool = True) -> dict[str, Any]:
    """A problem with the chain as threads on one computer."""
    names = [f"t{number}" for number in range(len(chain))]
    threads: dict[str, Any] = {}
    for name, (offset, period, deadline) in zip(names, chain, strict=True):
        threads[name] = {
            "processor": "computer", "period": f"{period} ms", "deadline": f"{deadline} ms", "communication": "let",
            "compute_execution_time": "1 us", "offset": f"{offset} ms" if known else "unknown",
        }  # fmt: skip
    pairs = list(pairwise(names))
    return {
        "dse": 1, "name": "Chain", "processing": "execution_time",
        "processor_types": {"any": {}}, "processors": {"computer": {"type": "any"}},
        "threads": threads, "connections": {f"{one}_{other}": {"from": one, "to": other} for one, other in pairs},
        "flows": {"chain": {"path": names}},
    }  # fmt: skip


def drawn(rng: random.Random) -> list[tuple[int, int, int]]:
    """A random chain with a short hyperperiod, deadlines below and beyond the period, and offsets."""
    periods = rng.choice([(1, 2, 5, 10, 20), (4, 6, 10, 12, 15), (3, 5, 7, 9), (10, 20, 25, 40, 50)])
    chain = []
    for _ in range(rng.randint(2, 5)):
        period = rng.choice(periods)
        deadline = rng.choice([period, rng.randint(1, period), rng.randint(1, 2 * period)])
        chain.append((rng.randrange(period), period, deadline))
    return chain
