"""Where a design may come before another one, against every design; and threads that are too many for cores."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.space.model.space import Design
from dse.verification import cases as verification_cases
from dse.verification.diagrams import Diagram, Node
from dse.verification.exhaustion import Exhaustion, exhaust
from dse.verification.model import SecondModel
from dse.verification.scheduling.core_limits import crowd
from dse.verification.tables import Tables, build_tables
from tests.benchmarks.cases import nearly_full
from tests.helpers.effort import cases
from tests.verification.test_reduced import looked_at


def without_deadlines(threads: int, cores: int, load: float, seed: int) -> Tables:
    """Threads that need but fit on cores, as each of them is as full as it may be."""
    return build_tables(Evaluator(problem(threads, cores, load, seed).space))


def problem(threads: int, cores: int, load: float, seed: int) -> dse.Problem:
    """The same as a problem."""
    return dse.loads(nearly_full(threads, cores, load, seed).replace("deadlines: all\n", ""))


def check_places(tables: Tables, everything: Exhaustion, rng: random.Random) -> None:
    """Every design that comes before another one with its objectives has one of the places that stay open."""
    second = SecondModel(tables)
    places_of, aside = second._earlier.places, second.free_cores

    def in_order(design: Design) -> list[int]:
        return [option for index, option in enumerate(design) if index not in aside]

    with_vector: dict[tuple[int, ...], list[Design]] = {}
    for vector, design in zip(everything.vectors.tolist(), everything.designs.tolist(), strict=True):
        with_vector.setdefault(tuple(vector), []).append(tuple(design))
    for vector in rng.sample(sorted(with_vector), min(12, len(with_vector))):
        alike = with_vector[vector]
        claimed = rng.choice(alike)
        places = places_of(vector, claimed)
        for design in (item for item in alike if in_order(item) < in_order(claimed)):
            at = next(index for index, option in enumerate(design) if index not in aside and option != claimed[index])
            assert any(
                place.decision == at
                and all(
                    option < 0 or option in {tables.allowed[index][position] for position in place.left[index]}
                    for index, option in enumerate(design)
                )
                for place in places
            ), (design, claimed)
        first = min(alike, key=in_order)
        is_first = in_order(claimed) == in_order(first)
        assert (second.earlier_design(vector, claimed).answer == "none") == is_first or not tables.is_exact


@pytest.mark.parametrize("scheduled", [False, True])
@pytest.mark.parametrize("seed", cases(20, first=300))
def test_no_place_is_lost_at_which_a_design_is_earlier(seed: int, scheduled: bool, tmp_path: Path) -> None:
    found = looked_at(seed, tmp_path, scheduled=scheduled)
    if found is not None and len(found[1].vectors):
        check_places(*found, random.Random(seed))


@pytest.mark.parametrize("seed", cases(6))
def test_nor_where_cores_are_full(seed: int) -> None:
    tables = without_deadlines(5, 2 + seed % 2, 0.9, seed)
    check_places(tables, exhaust(tables), random.Random(seed))


@pytest.mark.parametrize("seed", cases(6))
def test_every_design_keeps_the_row_that_a_crowd_is_refused_by(seed: int) -> None:
    """The row is broken by the choice that it is learnt from, and by no design."""
    tables, rng = without_deadlines(5, 2 + seed % 2, 0.9, seed), random.Random(seed)
    designs = exhaust(tables).designs
    [table] = tables.cores
    every = [list(range(len(options))) for options in tables.allowed]
    rows = 0
    for _ in range(100):
        chosen = [[rng.choice(positions)] for positions in every]
        found = crowd(table, chosen, every)
        if found is None:
            continue
        rows += 1
        parts, most = found

        def total(positions: list[list[int]], parts: tuple[Diagram, ...] = parts) -> int:
            return sum(leaf(part, positions) for part in parts)

        assert total(chosen) > most
        assert all(total([[int(option)] for option in design]) <= most for design in designs)
    assert rows


def leaf(diagram: Diagram, chosen: list[list[int]]) -> int:
    """Where a choice leads to; nothing is fixed, so that options are positions."""
    while isinstance(diagram, Node):
        diagram = diagram.branches[chosen[diagram.decision][0]]
    return int(diagram)


def test_a_first_design_is_proved_place_by_place_where_the_whole_question_is_not_answered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Fourteen threads on three cores, 95 % full: what is earlier does not fit, which no sum tells.

    The model is not asked at all; of a later design it is, and it finds the first one or another earlier one.
    """
    monkeypatch.setattr(verification_cases, "EASY_LIMIT", 1e-9)
    tables = without_deadlines(14, 3, 0.95, 2)
    names = [item.name for item in tables.space.decisions]
    second, proved = SecondModel(tables), 0
    for point in dse.solve(problem(14, 3, 0.95, 2)).to_dict()["front"]:
        options = zip(tables.space.decisions, (point["decisions"][name] for name in names), strict=True)
        design = tuple(decision.options.index(option) for decision, option in options)
        vector = tuple(tables.evaluator.evaluate(design).objectives)
        is_open = bool(second.unproved_claims([(vector, design)]))
        calls = second.calls
        assert second.earlier_design(vector, design).answer == "none"
        assert second.calls == calls
        proved += is_open
        other = second.another_design([value + 1 for value in vector], [design], range(len(design)))
        if other.answer == "design":
            found = second.earlier_design(vector, other.design)
            assert found.answer == "design"
            assert found.design < other.design
            assert 1 in second.unproved_claims([(vector, design), (vector, other.design)])
    assert proved
