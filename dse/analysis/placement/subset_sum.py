"""Threads on cores that are nearly full: one core after the other is filled as far as it can be.

Which loads a core may have is a subset sum, all of them the bits of one number (dynamic programming: S. Martello and
P. Toth, "Knapsack Problems", Wiley 1990, chapter 4); that cores are filled in turn is their bin completion. Where a
partition is found it is one; where none is, nothing is proved.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

FINEST = 1 << 20
"""Loads are counted in no finer parts of a core: shares are rounded up to these."""
MOST_BITS = 500_000_000
"""The greatest number of bits that are computed: some 50 ms."""
FILLS_TRIED = 4
"""The number of fills of a core that are tried, the fullest first."""


def filled(
    shares: Sequence[int], allowed: Sequence[Collection[int]], taken: Sequence[int], most: int
) -> tuple[int, ...] | None:
    """The core of each thread, such that none carries more than `most`; None where none was found.

    Parameters
    ----------
    shares
        what each thread uses of a core, in any unit.
    allowed
        the cores that each thread may have, from 0.
    taken, most
        what is on each core already, and the capacity of a core, in the same unit.

    Examples
    --------
    >>> filled([60, 50, 40, 50], [(0, 1)] * 4, [0, 0], 100)
    (0, 1, 0, 1)
    >>> filled([60, 50, 40, 51], [(0, 1)] * 4, [0, 0], 100) is None
    True
    """
    part = max(1, -(-most // FINEST))
    rooms = [(most - load) // part for load in taken]
    search = _Filling([-(-share // part) for share in shares], allowed, rooms)
    slack = sum(rooms) - sum(search.shares)
    if min(rooms) < 0 or slack < 0:
        return None
    return tuple(search.cores) if search.fill(0, search.smallest_first, slack) else None


class _Filling:
    """Cores in turn, those first that the fewest threads may have."""

    def __init__(self, shares: Sequence[int], allowed: Sequence[Collection[int]], rooms: Sequence[int]) -> None:
        self.shares, self.allowed, self.rooms = shares, allowed, rooms
        self.smallest_first = sorted(range(len(shares)), key=lambda number: (shares[number], -number))
        self.turns = sorted(range(len(rooms)), key=lambda core: (sum(core in item for item in allowed), core))
        self.cores = [0] * len(shares)
        self.bits = MOST_BITS

    def fill(self, turn: int, waiting: Sequence[int], slack: int) -> bool:
        """Put threads on the cores from a turn on, which may have `slack` left over together."""
        if turn == len(self.turns):
            return not waiting
        core, later = self.turns[turn], self.turns[turn + 1 :]
        own = [number for number in waiting if not any(other in self.allowed[number] for other in later)]
        room = self.rooms[core] - sum(self.shares[number] for number in own)
        if room < 0 or not all(core in self.allowed[number] for number in own):
            return False
        open_ = [number for number in waiting if core in self.allowed[number] and number not in own]
        self.bits -= (room + 1) * len(open_)
        if self.bits < 0:
            return False
        sums = self._sums(open_, room)
        left = sums[-1]
        for _ in range(FILLS_TRIED):
            load = left.bit_length() - 1
            if load < 0 or room - load > slack or self.bits < 0:
                return False
            here = {*own, *self._chosen(open_, sums, load)}
            for number in here:
                self.cores[number] = core
            if self.fill(turn + 1, [number for number in waiting if number not in here], slack - (room - load)):
                return True
            left ^= 1 << load
        return False

    def _sums(self, numbers: Sequence[int], room: int) -> list[int]:
        """Before and after each of these threads: the bit of a load is set where those until then can have it."""
        mask, masks = (1 << (room + 1)) - 1, [1]
        for number in numbers:
            masks.append((masks[-1] | masks[-1] << self.shares[number]) & mask)
        return masks

    def _chosen(self, numbers: Sequence[int], sums: Sequence[int], load: int) -> list[int]:
        """Threads that have a load together, large ones first: what is small still fits later."""
        chosen = []
        for at in range(len(numbers) - 1, -1, -1):
            share = self.shares[numbers[at]]
            if load >= share and sums[at] >> (load - share) & 1:
                chosen.append(numbers[at])
                load -= share
        return chosen
