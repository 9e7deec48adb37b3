"""Cores that are filled one after the other: partitions that are known to exist, and those of exhaustion."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import product

import pytest

from dse.analysis.placement.bin_packing import PackedItem, Room
from dse.analysis.placement.partition import partition, tightest
from dse.analysis.placement.subset_sum import filled
from tests.helpers.effort import LONG, cases


def loads_of(shares: list[int], taken: list[int], cores: tuple[int, ...]) -> list[int]:
    loads = list(taken)
    for share, core in zip(shares, cores, strict=True):
        loads[core] += share
    return loads


def drawn(source: random.Random) -> tuple[list[int], list[tuple[int, ...]], list[int], int]:
    """A few threads, some of which may not have every core, on cores that are empty or not."""
    count = source.randint(1, 3)
    most = source.choice((20, 100, 3 << 21))
    shares = [source.randint(0, most * 3 // 4) for _ in range(source.randint(1, 7))]
    allowed = [
        tuple(sorted(source.sample(range(count), source.choice((count, count, source.randint(1, count))))))
        for _ in shares
    ]
    taken = [source.choice((0, 0, source.randint(0, most // 2))) for _ in range(count)]
    return shares, allowed, taken, most


@pytest.mark.parametrize("seed", cases(12, 71_000))
def test_what_is_found_is_a_partition_and_mostly_found_where_there_is_one(seed: int) -> None:
    source, there, found = random.Random(seed), 0, 0
    for _ in range(200):
        shares, allowed, taken, most = drawn(source)
        is_there = any(max(loads_of(shares, taken, cores)) <= most for cores in product(*allowed))
        cores = filled(shares, allowed, taken, most)
        there, found = there + is_there, found + (cores is not None)
        if cores is not None:
            assert all(core in item for core, item in zip(cores, allowed, strict=True))
            assert max(loads_of(shares, taken, cores)) <= most
            assert is_there
        threads = [PackedItem(Fraction(share, most), item) for share, item in zip(shares, allowed, strict=True)]
        said = partition(threads, [Fraction(load, most) for load in taken], Room(Fraction(1)))
        assert said.status == ("found" if is_there else "none")
    assert found >= there * 0.95


@pytest.mark.parametrize("is_strict", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_full_cores_are_found_where_first_fit_and_a_short_search_give_up(seed: int, *, is_strict: bool) -> None:
    """Five cores, each cut into seven threads, with hardly any room left: there is a partition, the one cut."""
    source = random.Random(seed)
    most, pieces = 100_000, []
    for _ in range(5):
        ends = sorted(source.sample(range(1, most - 40), 6))
        pieces += [end - start for start, end in zip([0, *ends], [*ends, most - 40], strict=True)]
    source.shuffle(pieces)
    work = [PackedItem(Fraction(piece, most), range(5)) for piece in pieces]
    room = Room(Fraction(1), is_strict=is_strict)
    found = partition(work, [Fraction(0)] * 5, room)
    assert found.status == "found"
    loads = [Fraction(0)] * 5
    for item, core in zip(work, found.cores, strict=True):
        loads[core] += item.share
    assert tuple(loads) == found.loads
    assert all(map(room.fits, loads))


def test_no_threads_and_cores_that_are_too_full() -> None:
    assert filled([], [], [0, 100], 100) == ()
    assert filled([], [], [0, 101], 100) is None
    assert partition([], [Fraction(2)], Room(Fraction(1))).status == "none"


def loads_that_can_be(shares: list[int], allowed: list[tuple[int, ...]], taken: list[int]) -> set[tuple[int, ...]]:
    """The loads of all partitions."""
    found = {tuple(taken)}
    for share, cores in zip(shares, allowed, strict=True):
        found = {
            tuple(load + share * (core == chosen) for core, load in enumerate(loads))
            for loads in found
            for chosen in cores
        }
    return found


@pytest.mark.parametrize("seed", cases(8, 72_000))
def test_nearly_full_cores_are_decided_as_all_partitions_say(seed: int) -> None:
    """Cores that are cut into threads, some of which then are a little larger or smaller."""
    source, seen = random.Random(seed), set()
    for _ in range(15 if LONG else 6):
        count, most = source.randint(2, 3), source.choice((60, 500))
        shares = []
        for _ in range(count):
            cuts = sorted(source.sample(range(1, most), 3 if count == 3 else 4))
            shares += [high - low for low, high in zip((0, *cuts), (*cuts, most), strict=True)]
        shares = [max(0, share + source.choice((0, 0, 0, 0, 1, -1, -2))) for share in shares]
        every = tuple(range(count))
        allowed = [every if source.random() < 0.9 else (source.randrange(count),) for _ in shares]
        taken = [source.choice((0, 0, 0, 1)) for _ in every]
        there = loads_that_can_be(shares, allowed, taken)
        threads = [PackedItem(Fraction(share, most), item) for share, item in zip(shares, allowed, strict=True)]
        before = [Fraction(load, most) for load in taken]
        for is_strict in (False, True):
            is_there = any(max(loads) + is_strict <= most for loads in there)
            assert partition(threads, before, Room(Fraction(1), is_strict)).status == ("found" if is_there else "none")
            seen.add(is_there)
        assert max(tightest(threads, before).loads) == Fraction(min(map(max, there)), most)
    assert seen == {False, True}
