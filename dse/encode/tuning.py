"""Heuristics of the model, with a switch and tuning constants for each: what makes it small, whatever is asked of it.

`dse.search.tuning` has those of the search, and says how they are tested and measured.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SharedForms:
    """A sum has one form for each option of a decision on which many of its products depend (decision record 6).

    Without it each pair of an option and a rate has a literal of its own, and a space has no subspaces.
    """

    is_on: bool = True
    shared_by: int = 3
    """A decision has forms of its own when the coefficients of at least this number of products depend on it."""
    most_branches: int = 16
    """The greatest number of forms of one sum."""


@dataclass(frozen=True)
class AdditiveTables:
    """A table over several decisions is the sum of smaller tables, where their effects add up (decision record 6)."""

    is_on: bool = True
    most_cells: int = 20_000
    """Tables over more combinations of options are left whole."""
    most_pairs: int = 250_000
    """Tables are left whole where more pairs of cases than this would have to be compared."""


@dataclass(frozen=True)
class RegionUnions:
    """One question is about several regions of the objective space at once (decision record 4).

    Questions that find nothing are fewer: one call refutes all of their regions.
    """

    is_on: bool = True
    most: int = 4
    """The greatest number of regions in one question."""
    most_relaxed: int = 2
    """The greatest number where a linear relaxation answers, which unions make weak."""
    fewest_objectives: int = 3
    """With fewer objectives regions do not overlap, and nearly every question finds a point."""


@dataclass(frozen=True)
class CoreLimitClauses:
    """A limit on the cores of a processor is learnt as clauses at first, as rows once these are many."""

    is_on: bool = True
    most: int = 16
    """The number of clauses after which the model gets the rows."""


@dataclass(frozen=True)
class ModelTuning:
    """The heuristics of a model."""

    shared_forms: SharedForms = SharedForms()
    additive_tables: AdditiveTables = AdditiveTables()
    region_unions: RegionUnions = RegionUnions()
    core_limit_clauses: CoreLimitClauses = CoreLimitClauses()


MODEL = ModelTuning()
"""All heuristics on."""
