"""One interface to both second proofs: looking at every design, or asking a second model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol, TypeAlias

import numpy as np

from dse.analysis.evaluate import Evaluator
from dse.space.model.space import INACTIVE, Design
from dse.verification.exhaustion import Exhaustion, TooMany, exhaust
from dse.verification.model import SecondModel
from dse.verification.solver_calls import Reply
from dse.verification.tables import Tables, build_tables

Method: TypeAlias = Literal["auto", "exhaustion", "model"]
FEW_JUDGED = 500
"""The greatest number of combinations where the analysis has to judge each of them."""
FEW = 200_000
"""The greatest number of combinations that are looked at one by one; beyond it a model is asked instead."""


class Prover(Protocol):
    """Answers questions about the feasible designs of a space; objectives are to be minimised.

    Implemented by `AllDesigns` (exhaustion) and `AskedModel` (a second model).
    """

    @property
    def words(self) -> str:
        """The method of the proof, in words."""
        ...

    @property
    def left_aside(self) -> str:
        """The decisions not compared between designs with one objective vector, in words; empty where all are."""
        ...

    def in_region(
        self,
        below: Sequence[int | None],
        from_on: Sequence[int | None] | None = None,
        given: tuple[int, int] | None = None,
    ) -> Reply:
        """A design whose objectives are below `below` and not below `from_on` (None: no bound).

        `given` is a decision and the option that the design has, unless it has no use for the decision.
        """
        ...

    def earlier_design(self, vector: Sequence[int], design: Design) -> Reply:
        """A design with these objectives that comes before `design` in the order of the file.

        A `Reply` with the design, a proof of none, or unknown.
        """
        ...

    def unproved_regions(self, regions: Sequence[Sequence[int]]) -> list[int]:
        """The positions of regions that a quick proof about all of them does not show to be empty.

        Bounds as in `in_region`. For the other regions `in_region` finds no design; of those returned nothing is said.
        """
        ...

    def unproved_claims(self, claims: Sequence[tuple[Sequence[int], Design]]) -> list[int]:
        """The positions of claims for which a quick proof about all does not show that no design is earlier.

        For the other pairs of a vector and a design `earlier_design` finds none; of those returned nothing is said.
        """
        ...

    def another_design(self, below: Sequence[int], known: Sequence[Design], among: Sequence[int]) -> Reply:
        """A design with objectives below `below` that differs from each known one in some of the decisions `among`.

        Bounds are exclusive, in counting units; `among` are indices of decisions.
        """
        ...


class AllDesigns:
    """Every feasible design, looked at one by one.

    Arrays of `Exhaustion` are filtered; every answer is a proof.
    """

    def __init__(self, found: Exhaustion, compared: int) -> None:
        self.found = found
        self.compared = compared
        """The number of decisions that tell which design comes first."""

    @property
    def words(self) -> str:
        """The number of designs, in words."""
        feasible = len(self.found.vectors)
        return f"every design looked at: {self.found.looked_at} that are possible, {feasible} of them feasible"

    @property
    def left_aside(self) -> str:
        """Nothing but which of several orders that will do is taken, which no result claims."""
        return ""

    def in_region(
        self,
        below: Sequence[int | None],
        from_on: Sequence[int | None] | None = None,
        given: tuple[int, int] | None = None,
    ) -> Reply:
        """The first design with objectives below `below` and not below `from_on`, or a proof of none.

        None stands for no bound; with `given`, a pair (decision, option), only designs that have the option or do not
        use the decision count.
        """
        mask = np.ones(len(self.found.vectors), dtype=bool)
        for axis, bound in enumerate(below):
            if bound is not None:
                mask &= self.found.vectors[:, axis] < bound
        for axis, bound in enumerate(from_on or ()):
            if bound is not None:
                mask &= self.found.vectors[:, axis] >= bound
        if given is not None:
            mask &= np.isin(self.found.designs[:, given[0]], (INACTIVE, given[1]))
        return self._first(mask)

    def earlier_design(self, vector: Sequence[int], design: Design) -> Reply:
        """A design with these objectives that comes before `design` in the order of the file, or a proof of none.

        Only the decisions that results claim are compared.
        """
        reply = self._first((self.found.vectors == np.array(vector, dtype=np.int64)).all(axis=1))
        end = self.compared
        return reply if reply.answer == "design" and reply.design[:end] < design[:end] else Reply("none")

    def unproved_regions(self, regions: Sequence[Sequence[int]]) -> list[int]:
        """The positions of regions that hold a design; exact."""
        return [at for at, region in enumerate(regions) if self.in_region(region).answer != "none"]

    def unproved_claims(self, claims: Sequence[tuple[Sequence[int], Design]]) -> list[int]:
        """The positions of pairs of an objective vector and a design with an earlier design; exact."""
        return [at for at, claim in enumerate(claims) if self.earlier_design(*claim).answer != "none"]

    def another_design(self, below: Sequence[int], known: Sequence[Design], among: Sequence[int]) -> Reply:
        """A design with objectives below `below` that differs from each known one in some of the decisions `among`.

        Bounds are exclusive, in counting units; without such a design the reply is a proof.
        """
        mask = np.array((self.found.vectors < np.array(below, dtype=np.int64)).all(axis=1))
        for design in known:
            chosen = np.array([design[index] for index in among], dtype=np.int64)
            mask &= (self.found.designs[:, list(among)] != chosen).any(axis=1)
        return self._first(mask)

    def _first(self, mask: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Reply:
        """The first in the order of the file."""
        rows = self.found.designs[mask]
        if not len(rows):
            return Reply("none")
        return Reply("design", min(tuple(int(option) for option in row) for row in rows))


class AskedModel(SecondModel):
    """A second model, solved with other settings."""

    @property
    def words(self) -> str:
        """The number of questions to the model, in words."""
        return f"a second model asked {self.calls} times, with other settings and another search"

    @property
    def left_aside(self) -> str:
        """The cores of threads that can be moved, where there are such."""
        return "the cores of threads" if self.moves_threads else ""


def make_prover(evaluator: Evaluator, method: Method = "auto", deadline: float | None = None) -> tuple[Prover, Tables]:
    """The means to prove something about a space, and the tables that it rests on.

    Raises
    ------
    TooLarge
        when a formula depends on too many combinations of options for either.
    TooMany
        when `method` is ``exhaustion`` and there are too many designs.
    """
    tables = build_tables(evaluator)
    if method != "model":
        try:
            few = FEW_JUDGED if tables.late or tables.messages or tables.waits is not None else FEW
            exhaustion = exhaust(tables, few) if method == "auto" else exhaust(tables)
            return AllDesigns(exhaustion, tables.space.first_order), tables
        except TooMany:
            if method == "exhaustion":
                raise
    return AskedModel(tables, deadline), tables


def outer_bound(tables: Tables) -> tuple[int, ...]:
    """Exclusive upper bounds of the objectives, whatever the design.

    In counting units; the region below it contains every design.
    """
    return tuple(total.high // divisor + 1 for total, divisor in tables.objectives)
