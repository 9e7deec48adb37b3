"""Threads that must be in time on cores that may not be filled: other cores are sought within both kinds of limits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.analysis.placement.lexicographic import first_placement
from dse.encode.model import EncodedSpace, encode
from dse.space.model.space import Design
from dse.verification.scheduling.contention import is_late_limit, on_other_cores
from tests.helpers.support import space_of

PROBLEM = """
dse: 1
name: late and full
deadlines: all
processor_types: {duo: {cores: 2, price: 10 EUR}}
processors: {p: {type: duo}}
threads:
%s
flows: {f: {path: [t0]}}
requirements: ['utilisation of p <= 60 %%']
objectives: [minimise price, minimise latency of f]
"""


def crowd(*worst_ms: int) -> Evaluator:
    """Threads of 10 ms on two cores of which 6 ms may be used, each on either core."""
    lines = [
        f"  t{number}: {{processor: p, period: 10 ms, compute_execution_time: {worst} ms, core: [1, 2]}}"
        for number, worst in enumerate(worst_ms)
    ]
    return Evaluator(space_of(PROBLEM % "\n".join(lines)))


def settled_from_one_core(evaluator: Evaluator, *, is_best: bool = True) -> tuple[EncodedSpace, Design | None]:
    """What becomes of the design with all threads on the first core, where the last is late."""
    encoded = encode(evaluator)
    design = tuple(0 for _ in evaluator.space.decisions)
    assert not evaluator.evaluate(design).is_feasible

    def value(_: cp_model.IntVar) -> int:
        pytest.fail("nothing is asked of the solution")

    return encoded, encoded.settled(design, value, is_best=is_best)


def test_late_threads_are_moved_within_what_cores_may_use() -> None:
    """The least used core in turn leaves 70 % on one; 3 + 3 and 2 + 2 + 2 fit."""
    evaluator = crowd(3, 3, 2, 2, 2)
    encoded, found = settled_from_one_core(evaluator)
    assert found is not None
    assert evaluator.evaluate(found).is_feasible
    assert encoded.contention is not None
    assert not encoded.contention.known


def test_cores_that_are_too_full_are_not_learnt_as_threads_that_are_late() -> None:
    """On 4 + 4 and 4 no thread is late, but a core is too full, as it is in any design: no rows of response times."""
    encoded, found = settled_from_one_core(crowd(4, 4, 4))
    assert found is None
    assert encoded.contention is not None
    assert not encoded.contention.known
    assert encoded.core_limits is not None
    assert encoded.core_limits.known == {0}
    solver = cp_model.CpSolver()
    assert solver.solve(encoded.model) == cp_model.INFEASIBLE


@pytest.mark.parametrize("worst_ms", [(4, 4, 4), (6, 6, 6)])
def test_no_rows_are_learnt_from_what_is_not_the_best(worst_ms: tuple[int, ...]) -> None:
    """A design on the way may never come again, and rows make each further question larger."""
    encoded, found = settled_from_one_core(crowd(*worst_ms), is_best=False)
    assert found is None
    assert encoded.contention is not None and encoded.core_limits is not None
    assert not encoded.contention.known and not encoded.core_limits.known


def test_the_second_proof_moves_late_threads_within_what_cores_may_use() -> None:
    evaluator = crowd(3, 3, 2, 2, 2)
    refused = evaluator.evaluate(tuple(0 for _ in evaluator.space.decisions))
    late = [item for item in evaluator.limits if is_late_limit(item)]
    found = on_other_cores(evaluator, late, refused)
    assert found is not None
    assert found.is_feasible


def test_the_first_cores_are_looked_for_within_what_cores_may_use() -> None:
    """Nobody is late with five threads of 2 ms on a core, but three fill what may be used: the search ends at once."""
    evaluator = crowd(2, 2, 2, 2, 2, 2)
    space = evaluator.space
    late = [item for item in evaluator.limits if is_late_limit(item)]
    full = [item for item in evaluator.limits if item.cores is not None]
    found, is_sure = first_placement(space, tuple(0 for _ in space.decisions), space.open_cores, late, full)
    assert found is not None and is_sure
    chosen = [item.decision.values[found[item.index]] for item in space.open_cores]
    assert chosen == [1, 1, 1, 2, 2, 2]


@pytest.mark.parametrize(("worst_ms", "is_sure"), [((4, 4, 4), True), ((1,) * 12, False)])
def test_that_there_are_no_first_cores_may_be_sure(worst_ms: tuple[int, ...], *, is_sure: bool) -> None:
    """Three of 4 ms have none, as is seen at once; twelve that no core may have could be in too many places."""
    evaluator = crowd(*worst_ms)
    space = evaluator.space
    late = [item for item in evaluator.limits if is_late_limit(item)]
    full = [item for item in evaluator.limits if item.cores is not None]
    if not is_sure:
        full = [*full, *(replace(item, bound=lambda _: Fraction(-1)) for item in late)]
    assert first_placement(space, tuple(0 for _ in space.decisions), space.open_cores, late, full) == (None, is_sure)
