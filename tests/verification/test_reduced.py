"""What the second proof refutes on a smaller question, or of many points at once, is so."""

from __future__ import annotations

import random
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import pytest

from dse.analysis.evaluate import Evaluator
from dse.support.errors import DseError
from dse.verification.cases import MOST_SOLUTIONS
from dse.verification.diagrams import Diagram, Node, TooLarge
from dse.verification.exhaustion import Exhaustion, TooMany, exhaust
from dse.verification.model import SecondModel
from dse.verification.reduced import Reduction, Row, leave_out_dominated, narrow
from dse.verification.restricted_diagrams import remainder
from dse.verification.tables import Tables, build_tables
from tests.helpers.effort import cases
from tests.properties.test_every_question import question

FEW = 1_000


def looked_at(seed: int, tmp_path: Path, *, scheduled: bool) -> tuple[Tables, Exhaustion] | None:
    """Every design of a random question; None where there are too many, or a second model takes none of it."""
    asked = question(seed, tmp_path, scheduled=scheduled)
    if asked is None:
        return None
    try:
        tables = build_tables(Evaluator(asked.problem.space))
        SecondModel(tables)  # which refuses figures that are too large
        return tables, exhaust(tables, FEW)
    except (DseError, TooLarge, TooMany):
        return None


@pytest.mark.parametrize("scheduled", [False, True])
@pytest.mark.parametrize("seed", cases(10, first=500))
def test_what_is_refuted_holds_no_design(seed: int, scheduled: bool, tmp_path: Path) -> None:
    """Where rows say all there is to say, what holds none is refuted, too."""
    found = looked_at(seed, tmp_path, scheduled=scheduled)
    if found is None:
        return
    tables, vectors = found[0], found[1].vectors
    rng = random.Random(seed)
    reduction = Reduction(tables)
    sums = [*(bound.sum for bound in tables.bounds), *(total for total, _ in tables.objectives)]
    only_rows = tables.is_exact and not tables.cores and not any(item.extremes for item in sums)
    for _ in range(4):
        if len(vectors):
            below = [int(value) + rng.choice((0, 1)) for value in vectors[rng.randrange(len(vectors))]]
        else:
            below = [total.high // divisor + 1 for total, divisor in tables.objectives]
        from_on = [bound - rng.randint(1, 3) for bound in below] if tables.bounds_are_exact else None
        has_one = (vectors < below).all(axis=1) & (True if from_on is None else (vectors >= from_on).all(axis=1))
        is_refuted = reduction.region(below, from_on).is_refuted(50.0, None)
        assert not (is_refuted and has_one.any()), (below, from_on)
        assert is_refuted or has_one.any() or not only_rows


@pytest.mark.parametrize("scheduled", [False, True])
@pytest.mark.parametrize("seed", cases(30, first=700))
def test_regions_that_are_refuted_together_hold_no_design(seed: int, scheduled: bool, tmp_path: Path) -> None:
    """Regions with a design are left, up to `MOST_SOLUTIONS` of them; where the model is exact no other is."""
    found = looked_at(seed, tmp_path, scheduled=scheduled)
    if found is None or not len(found[1].vectors):
        return
    tables, vectors = found[0], found[1].vectors
    rng = random.Random(seed)
    drawn = [[int(value) + rng.choice((0, 0, 1)) for value in vectors[rng.randrange(len(vectors))]] for _ in range(8)]
    holding = [at for at, below in enumerate(drawn) if (vectors < below).all(axis=1).any()]
    left = SecondModel(tables).unproved_regions(drawn)
    assert {*holding} <= {*left}
    if tables.is_exact and tables.waits is None and len(holding) < MOST_SOLUTIONS:
        assert left == holding


@pytest.mark.parametrize("scheduled", [False, True])
@pytest.mark.parametrize("seed", cases(30, first=900))
def test_a_design_that_is_not_the_first_is_found_among_others(seed: int, scheduled: bool, tmp_path: Path) -> None:
    """Of the first designs with some objectives it is proved at once that they are; with one later design it is not."""
    found = looked_at(seed, tmp_path, scheduled=scheduled)
    if found is None:
        return
    tables, everything = found
    second, rng = SecondModel(tables), random.Random(seed)

    def in_order(design: list[int]) -> list[int]:
        return [option for index, option in enumerate(design) if index not in second.free_cores]

    with_vector: dict[tuple[int, ...], list[list[int]]] = {}
    for vector, design in zip(everything.vectors.tolist(), everything.designs.tolist(), strict=True):
        with_vector.setdefault(tuple(vector), []).append(design)
    chosen = rng.sample(sorted(with_vector), min(12, len(with_vector)))
    first = {vector: min(with_vector[vector], key=in_order) for vector in chosen}
    if not first:
        return
    left = second.unproved_claims([(vector, tuple(design)) for vector, design in first.items()])
    assert not left or not tables.is_exact
    for vector in chosen:
        later = [design for design in with_vector[vector] if in_order(design) > in_order(first[vector])]
        if later:
            claims = {**first, vector: rng.choice(later)}
            left = second.unproved_claims([(vector, tuple(design)) for vector, design in claims.items()])
            assert list(claims).index(vector) in left


@pytest.mark.parametrize("seed", cases(100))
def test_what_is_left_of_a_diagram_is_found_as_by_looking_at_every_leaf(seed: int) -> None:
    rng = random.Random(seed)
    sizes, ordered = [rng.randint(1, 3) for _ in range(4)], seed % 2 == 0

    def grown(decisions: tuple[int, ...]) -> Diagram:
        if not decisions or rng.random() < 0.2:
            return rng.randint(-3, 5)
        at = 0 if ordered else rng.randrange(len(decisions))
        rest = decisions[:at] + decisions[at + 1 :]
        return Node(decisions[at], tuple(grown(rest) for _ in range(sizes[decisions[at]])))

    def leaf(item: Diagram, options: Sequence[int]) -> int:
        while isinstance(item, Node):
            item = item.branches[options[item.decision]]
        return int(item)

    diagram = Node(0, tuple(grown((1, 2, 3)) for _ in range(sizes[0])))
    left = [sorted(rng.sample(range(size), rng.randint(1, size))) for size in sizes]
    combinations = list(product(*left))
    found = remainder(diagram, left)
    assert found.least == min(leaf(diagram, options) for options in combinations)
    for decision in diagram.looked_at:
        assert found.least_with(decision) == [
            min(leaf(diagram, options) for options in combinations if options[decision] == option)
            for option in left[decision]
        ]
        one, other = rng.choice(left[decision]), rng.choice(left[decision])

        def having(options: Sequence[int], option: int, decision: int = decision) -> list[int]:
            return [option if at == decision else taken for at, taken in enumerate(options)]

        most = max(
            leaf(diagram, having(options, one)) - leaf(diagram, having(options, other)) for options in combinations
        )
        said = found.difference(decision, one, other)
        assert said == most if ordered else said >= most
    assert remainder(diagram, [list(options) for options in left]) is found


def test_what_breaks_a_row_goes_and_so_does_what_is_never_better() -> None:
    """Options 3, 5 and 9 in a sum with 2 or 4 at most 9; in another row the dearer options save nothing."""
    first, second = Node(0, (3, 5, 9)), Node(1, (4, 2))
    rows = [Row((first, second), 9), Row((Node(0, (1, 1, 0)), Node(1, (0, 5))), 100)]
    left = [[0, 1, 2], [0, 1]]
    assert narrow(rows, left, rows)
    assert left == [[0, 1], [0, 1]]
    leave_out_dominated(rows, left)
    assert left == [[0], [0, 1]]  # 4 and 0 against 2 and 5: neither is better
    assert not narrow([*rows, Row((second, first), 4)], left, [Row((second, first), 4)])
