"""Vectorised brute force: every combination of options, in chunks, through the vectorised analysis."""

from __future__ import annotations

import time
from math import prod
from typing import Any

import numpy as np

from dse.analysis.evaluate import Evaluator
from tests.benchmarks.vectorised import VectorisedEvaluator

from .fronts import non_dominated

CHUNK = 262_144


def exhaustive_front(evaluator: Evaluator, limit_s: float) -> dict[str, Any]:
    """The front by enumeration, as minimised values; incomplete when time runs out."""
    space = evaluator.space
    tables = VectorisedEvaluator(evaluator)
    counts = [len(item.options) for item in space.decisions]
    total = prod(counts)
    signs = np.array([-1 if item.sense == "maximise" else 1 for item in space.objectives])
    front = np.zeros((0, len(signs)), dtype=np.int64)
    started = time.perf_counter()
    done = 0
    while done < total and time.perf_counter() - started < limit_s:
        size = min(CHUNK, total - done)
        designs = np.stack(np.unravel_index(np.arange(done, done + size), counts), axis=1)
        batch = tables.evaluate(designs)
        values = (batch.objectives * signs)[batch.is_feasible]
        if len(values):
            front = non_dominated(np.concatenate([front, values]))
        done += size
    return {
        "front": [tuple(map(int, row)) for row in front],
        "is_complete": done >= total,
        "designs": done,
        "seconds": time.perf_counter() - started,
    }


def combinations(evaluator: Evaluator) -> int:
    """How many combinations of options there are, valid or not."""
    return prod(len(item.options) for item in evaluator.space.decisions)
