"""Minimal conflicts and smallest corrections of an infeasible problem.

A *conflict* is a set of members (`dse.search.feasibility.oracle`) that cannot hold together although every proper part
of it can; a *correction* is a set of members that, given up, leaves a design, although giving up any proper part does
not. Both are enumerated as by Liffiton, Previti, Malik and Marques-Silva, "Fast, flexible MUS enumeration", Constraints
21 (2016): a map of the sets that are still unexplored proposes the largest; where that has no design it is shrunk to a
conflict by leaving members out in turn, each time solving anew, else what it lacks is a correction. Because the largest
unexplored set is always asked first, the first correction is one of the smallest (implicit hitting sets: Davies and
Bacchus, CP 2011).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import TypeAlias

from ortools.sat.python import cp_model

from dse.encode.linear import SolverModel
from dse.search.feasibility.oracle import Oracle
from dse.search.solver.settings import sound_solver
from dse.space.model.space import Design
from dse.support.timelimit import OutOfTime, look_at_the_clock

Heard: TypeAlias = Callable[[frozenset[int], bool], None]
"""A callback that takes an infeasible set, and whether it is a minimal conflict."""
LIMIT = 2.0
"""Deterministic time of the first attempt at a largest set; each further one has another seed and twice as much."""


@dataclass(frozen=True)
class ConflictSet:
    """Members (by position) that cannot hold together; `witnesses[i]` is a design that meets all but member i.

    The witnesses prove that the conflict is minimal.
    """

    members: tuple[int, ...]
    witnesses: dict[int, Design]


@dataclass(frozen=True)
class Correction:
    """Members (by position) without which the others have the design `witness`.

    A relaxation set: giving up these members makes the problem feasible.
    """

    members: tuple[int, ...]
    witness: Design


@dataclass(frozen=True)
class Conflicts:
    """The conflicts and corrections that were found; `all_conflicts` says that the list of conflicts is complete.

    `smallest` is a correction of the fewest statements, which are members that a user stated as one. `limited` says
    that the enumeration ended at its limit, `stopped` that time ran out; `reduced` is then a set that has no design,
    and whether all of it is needed for that was not looked at.
    """

    conflicts: tuple[ConflictSet, ...]
    corrections: tuple[Correction, ...]
    all_conflicts: bool
    limited: bool
    stopped: bool
    reduced: frozenset[int] | None = None

    @property
    def smallest(self) -> Correction | None:
        """A correction that no smaller one can replace (proved), or None when time ran out before there was one.

        Smallest in the number of members.
        """
        return self.corrections[0] if self.corrections else None


class _Map:
    """The sets of members that are neither known to have a design nor known to contain a conflict."""

    def __init__(self, statements: Sequence[Sequence[int]], among: frozenset[int], seed: int) -> None:
        self.model = SolverModel()
        count = sum(map(len, statements))
        self.chosen = [self.model.new_bool_var("") for _ in range(count)]
        for number, literal in enumerate(self.chosen):
            if number not in among:
                self.model.add_bool_or([literal.negated()])
        whole = [self._whole([number for number in item if number in among]) for item in statements if len(item) > 1]
        single = [self.chosen[item[0]] for item in statements if len(item) == 1]
        self.model.maximize(sum((count + 1) * literal for literal in (*whole, *single)) + sum(self.chosen))
        self.seed = seed

    def _whole(self, members: Sequence[int]) -> cp_model.IntVar:
        """Whether all of what is stated as one is in a set."""
        literal = self.model.new_bool_var("")
        for number in members:
            self.model.add_implication(literal, self.chosen[number])
        return literal

    def largest(self) -> frozenset[int] | None:
        """An unexplored set that lacks the fewest statements, of such ones a largest; None when all are explored.

        Raises
        ------
        OutOfTime
            when there is none by the deadline.
        """
        for attempt in count():
            look_at_the_clock()
            solver = sound_solver(self.seed + attempt)
            solver.parameters.max_deterministic_time = LIMIT * 2**attempt
            status = solver.solve(self.model)
            if status == cp_model.INFEASIBLE:
                return None
            if status == cp_model.OPTIMAL:
                break
        return frozenset(number for number, literal in enumerate(self.chosen) if solver.boolean_value(literal))

    def without_conflict(self, conflict: frozenset[int]) -> None:
        """Sets that contain the conflict have no design."""
        self.model.add_bool_or([self.chosen[number].negated() for number in sorted(conflict)])

    def beyond(self, kept: frozenset[int]) -> None:
        """Parts of a set that has a design have one."""
        self.model.add_bool_or([literal for number, literal in enumerate(self.chosen) if number not in kept])


def find_conflicts(
    oracle: Oracle,
    *,
    every: bool = False,
    limit: int = 100,
    known: Iterable[frozenset[int]] = (),
    among: frozenset[int] | None = None,
    heard: Heard = lambda members, is_minimal: None,
) -> Conflicts:
    """The conflicts of a problem that is infeasible although its structure has designs, and its smallest correction.

    With `every` all minimal conflicts (at most `limit`), else those that the search for the smallest correction comes
    across: at least one. Members that a user stated as one count as one in the smallest correction. What is `known` are
    sets that have no design: the conflicts in these are found first. Of members that are not `among` those that are
    asked about no conflict or correction has any. Each set that has no design is `heard` of as soon as it is known.
    """
    demands = oracle.everything if among is None else among
    explored = _Map(oracle.statements, demands, oracle.seed)
    conflicts: list[ConflictSet] = []
    corrections: list[Correction] = []
    complete = limited = stopped = False
    reduced: frozenset[int] | None = None
    first = deque(known)
    for members in first:
        oracle.refute(members)
    try:
        while not limited:
            seed = first.popleft() if first else explored.largest()
            if seed is None:
                complete = True
                break
            if any(seed >= frozenset(item.members) for item in conflicts):
                continue
            witness = oracle.witness(seed)
            if witness is None:
                reduced = seed
                heard(reduced, False)
                for smaller in _shrinking(oracle, seed):
                    reduced = smaller
                    heard(reduced, False)
                conflict = proved(oracle, reduced)
                heard(reduced, True)
                reduced = None
                conflicts.append(conflict)
                explored.without_conflict(frozenset(conflict.members))
                limited = len(conflicts) >= limit
                continue
            corrections.append(Correction(tuple(sorted(demands - seed)), witness))
            explored.beyond(seed)
            if not every:
                break
    except OutOfTime:
        stopped = True
    ordered = sorted(conflicts, key=lambda item: (len(item.members), item.members))
    return Conflicts(tuple(ordered), tuple(corrections), complete, limited and not complete, stopped, reduced)


def _shrinking(oracle: Oracle, members: frozenset[int]) -> Iterator[frozenset[int]]:
    """Ever smaller parts of a set that has no design: each member in turn stays out where that changes nothing.

    None of them has a design, and the last is minimal. Members that come later in the problem are kept where there is
    a choice. Several in turn are left out at once, twice as many after each success and half as many after a design is
    found, which ends at the same set (progression: J. Marques-Silva, M. Janota, A. Belov, "Minimal sets over monotone
    predicates in Boolean formulae", CAV 2013).
    """
    kept, left, size = members, sorted(members), 1
    while left:
        rest = kept - {*left[:size]}
        if oracle.witness(rest) is None:
            kept, left, size = rest, left[size:], 2 * size
            yield kept
        elif size > 1:
            size = max(1, min(size, len(left)) // 2)
        else:
            left = left[1:]


def proved(oracle: Oracle, kept: frozenset[int]) -> ConflictSet:
    """A minimal conflict with a design for each member left out, proved again by another search.

    Two searches with different seeds must agree, else an assertion fails. `kept` are positions of members.
    """
    witnesses = {}
    for number in sorted(kept):
        witness = oracle.witness(kept - {number})
        assert witness is not None
        witnesses[number] = witness
    again = oracle.solve(kept, seed=oracle.seed + 1)
    assert again is None, f"a conflict was refuted once and then had the design {again}"
    return ConflictSet(tuple(sorted(kept)), witnesses)
