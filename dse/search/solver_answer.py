"""What a solver call can answer: a design, that there is none, or neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import ortools

from dse.space.model.space import Design

SOLVER = f"OR-tools CP-SAT {ortools.__version__}"  # type: ignore[attr-defined]
"""The solver with its version, as results state it."""


@dataclass(frozen=True)
class Found:
    """An optimal solution: the counted objectives (steps above each offset) and the design.

    Objectives are minimised; the design is a tuple of option numbers.
    """

    point: tuple[int, ...]
    design: Design


@dataclass(frozen=True)
class NoSuchDesign:
    """The solver proved that there is no design in the region.

    A proof, which refutes the region for the front and for `dse verify` to check.
    """


@dataclass(frozen=True)
class Unfinished:
    """The solver was stopped before it could tell; says nothing about the region.

    What it minimised is at least `bound`; `best` is the best solution so far.
    """

    bound: int | None = None
    best: Found | None = None


Answer = Found | NoSuchDesign | Unfinished


def weighted(weights: Sequence[int], point: Sequence[int]) -> int:
    """The sum of the objectives times their weights.

    In solver steps.
    """
    return sum(weight * value for weight, value in zip(weights, point, strict=True))
