"""Heuristics of the search, with a switch and tuning constants for each; `Tuning` has all of them.

A switch changes how long a search takes, never its front: `tests/properties/test_ways_of_searching.py` draws problems
and solves them with each heuristic off, `python -m tests.benchmarks --only heuristics` measures what each one saves.

Work is deterministic time, weighed by settings (`dse.search.solver.settings`): a unit is about a second of a processor.
A `Way` is settings of the solver with a limit on its work.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from dse.encode.tuning import MODEL, ModelTuning
from dse.search.solver.settings import (
    BARE,
    BARE_IN_ORDER,
    CUTTING,
    CUTTING_IN_ORDER,
    LOWEST,
    OPTIONS_FIRST,
    POOLING,
    RELAXED,
    RELAXED_IN_ORDER,
    SolverSettings,
)

Way: TypeAlias = tuple[SolverSettings, float]


@dataclass(frozen=True)
class Portfolio:
    """Settings that were quicker at earlier questions are tried first (`dse.search.solver.portfolio`).

    Without it settings are tried as they stand in the code, with limits that double.
    """

    is_on: bool = True
    first_limit: float = 0.05
    """The least limit of an attempt, as work."""
    patience: int = 6
    """The limit of the favourite, as a multiple of the work that its answers took on average."""
    gate: int = 8
    """An attempt is put off while it is known to cost more than this multiple of the favourite's limit."""
    trivial: float = 0.0005
    """Answers that take less work, by propagation alone, tell nothing of the settings."""
    newest: float = 0.25
    """Weight of the newest answer in an average."""


@dataclass(frozen=True)
class Subspaces:
    """Hard questions are asked of each combination of shared options by itself (`dse.search.solver.subspaces`)."""

    is_on: bool = True
    most: int = 64
    """The greatest number of combinations."""
    first_work: float = 0.25
    """Work at the first question as a whole, before its subspaces are asked."""
    brief: Way = (BARE, 0.05)
    """First attempt at a subspace; what is left needs a linear relaxation."""
    ways: tuple[SolverSettings, ...] = (CUTTING, RELAXED, BARE)
    """Settings of the further attempts, in turn."""
    sharing_ways: tuple[SolverSettings, ...] = (CUTTING, LOWEST, RELAXED)
    """Settings of the further attempts where threads share cores."""
    full_ways: tuple[SolverSettings, ...] = (POOLING, OPTIONS_FIRST)
    """Settings where the model has rows of full cores, whose bounds are good, and designs are missing."""
    work: float = 1.5
    """Work of each attempt in the first round; twice as much in each further one."""
    last_work: float = 24.0
    """Work of an attempt where threads wait for each other and one subspace is left: asking anew gains nothing."""
    cheap: float = 0.1
    """A subspace whose first relaxation took less work is asked with a relaxation at once the next time."""
    most_missed: int = 4
    """A subspace that bare settings left open as many times in a row is asked with a relaxation at once."""
    factor: int = 4
    """Limit of a question asked by subspaces, as a multiple of its limit as a whole."""


@dataclass(frozen=True)
class ValueGrid:
    """Bounds are rounded to values that the minimised sum can have in a subspace (`dse.search.solver.value_grid`)."""

    is_on: bool = True


@dataclass(frozen=True)
class KnapsackTables:
    """Dynamic programming bounds two objectives that are plain sums (`dse.search.solver.knapsack`)."""

    is_on: bool = True
    after: float = 0.1
    """Work of a search after which its tables are made."""
    most_cells: int = 2_000_000
    """Larger tables of a whole space are not made; they take 16 MB and some 50 ms."""
    most_decisions: int = 2**9
    """Spaces of more decisions have no tables: sums of 2**9 values below 2**53 keep below `NO_VALUE`."""
    most_tried: int = 8
    """The number of designs with the same objectives that are shown to the analysis."""


@dataclass(frozen=True)
class LowestFirst:
    """Where cores are shared only the lowest value that is not refuted is asked for, then twice as many at a time."""

    is_on: bool = True
    at_once: float = 0.1
    """Work for a range of values before pooled cores are asked."""


@dataclass(frozen=True)
class PooledCores:
    """Nearly full cores are pooled, which removes their symmetry (`dse.search.solver.pooled_cores`)."""

    is_on: bool = True
    most_rounds: int = 4
    """The greatest number of times that kinds of cores are made finer for one question."""
    more_steps: tuple[int, ...] = (0, 1, 3, 8)
    """Designs are looked for at the least value and as many steps above it."""
    finest: int = 1000
    """The least step is the value divided by this number."""
    solve_work: float = 2.0
    """Work for the best solution of the pools, and as much for its proof."""
    room_work: float = 0.7
    """Work for the solution that leaves most room."""
    place_work: float = 1.5
    """Work to put the threads of the pools on cores."""
    few_kinds: int = 6
    """A list of alternatives that would make more kinds of cores is left out at first."""
    most_kinds: int = 30
    """Kinds are not split beyond this number."""


@dataclass(frozen=True)
class LeastUsed:
    """An optimum whose threads fit on no cores is exchanged for a design with its objectives that uses them less.

    See `dse.search.solver.repair`.
    """

    is_on: bool = True
    work: tuple[float, ...] = (0.05, 0.5)
    """Work of the attempts."""


@dataclass(frozen=True)
class OtherCores:
    """A refused design is tried on the cores of the placement heuristics, while no design is known."""

    is_on: bool = True
    most: int = 32
    """The greatest number of refused designs that are tried."""


@dataclass(frozen=True)
class Bounding:
    """Where threads wait for each other, bounds and designs take turns (`dse.search.solver.bounding`)."""

    is_on: bool = True
    below: int = 6
    """Proving bounds from below takes at most the limit of a question divided by this number ..."""
    most_below: float = 0.5
    """... and at most this work."""
    least: int = 4
    """A question ends when less than its limit divided by this number is left."""
    change: int = 4
    """Factor by which the range of values asked for is made narrower after a miss, wider after an answer."""
    widest: int = 1
    """The least number of ranges into which the values between bound and best design are divided."""
    narrowest: int = 256
    """The greatest number of ranges."""
    first: int = 16
    """The number of ranges at first."""
    quick: float = 1.2
    """Work at first for a range of values without relaxation."""
    most_quick: float = 2.4
    """The greatest work for such a range: it is doubled after an answer, ..."""
    least_quick: float = 0.075
    """... and halved after a miss; below this work there is no attempt without relaxation."""


@dataclass(frozen=True)
class FirstDesigns:
    """Depth-first searches for the first design of a point (`dse.search.canonical`).

    No switch: which design stands for a point depends on it.
    """

    ways: tuple[tuple[SolverSettings, float, int], ...] = (
        (BARE_IN_ORDER, 0.01, 2),
        (RELAXED_IN_ORDER, 0.05, 1),
        (CUTTING_IN_ORDER, 0.05, 1),
    )
    """Settings, work, and the number of misses in a row after which they are given up (decision record 3)."""
    ways_to_the_end: tuple[Way, ...] = ((BARE_IN_ORDER, 0.01), (CUTTING_IN_ORDER, 2.0))
    """Attempts where the first design alone will do."""
    few_variables: int = 1_000
    """In larger models a linear relaxation costs more than it helps a depth-first search."""


@dataclass(frozen=True)
class Tuning:
    """All heuristics of the search, and those of its model."""

    model: ModelTuning = MODEL
    portfolio: Portfolio = Portfolio()
    subspaces: Subspaces = Subspaces()
    value_grid: ValueGrid = ValueGrid()
    knapsack_tables: KnapsackTables = KnapsackTables()
    lowest_first: LowestFirst = LowestFirst()
    pooled_cores: PooledCores = PooledCores()
    least_used: LeastUsed = LeastUsed()
    other_cores: OtherCores = OtherCores()
    bounding: Bounding = Bounding()
    first_designs: FirstDesigns = FirstDesigns()


DEFAULT = Tuning()
"""All heuristics on."""
