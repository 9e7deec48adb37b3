"""The kinds of cores by what they have room for: until which time, for each level (decision record 32).

A core keeps one row of each list of alternatives. Rows that follow from others are left out, and so are kinds that are
nowhere better than another one. All combinations would be too many kinds; those that there are can be split where a
row is missed that none of their alternatives keeps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from math import lcm
from operator import le
from typing import TypeAlias

from dse.analysis.rates import NS_PER_S
from dse.encode.places import Thread
from dse.records import dataclass

FEW_KINDS = 6
"""At first a list of alternatives that would make more kinds than this is left out."""
MOST_KINDS = 30
"""With more kinds than this none is split."""

Key: TypeAlias = tuple[int, int]
"""A thread, and a literal of its being somewhere at a rate, which may be one of other threads, too."""
Entries: TypeAlias = dict[Key, tuple[Thread, int, Fraction | None]]
"""Whose work counts in a row while a literal is true: so many jobs, or the rate of a share."""
NOTHING = (None, 0, None)
Kind: TypeAlias = frozenset[int]
"""The places of the rows that a core keeps."""


@dataclass(frozen=True)
class CoreRow:
    """What one core must have room for: the jobs of `entries` until `most` (ns), or their shares of a whole core."""

    entries: Entries
    most: int

    def weight(self, key: Key) -> Fraction:
        """How much of the row a thread takes for each ns of its work; nothing where it does not count."""
        _, jobs, rate = self.entries.get(key, NOTHING)
        return Fraction(jobs, self.most) if rate is None else rate / NS_PER_S


def _weights(rows: Sequence[CoreRow]) -> list[tuple[int, ...]]:
    """For each row its weights in a common unit; threads with the same weights in all rows stand there once."""
    keys = {key for row in rows for key in row.entries}
    columns = {tuple(row.weight(key) for row in rows) for key in keys}
    unit = lcm(*(weight.denominator for column in columns for weight in column))
    whole = [[int(weight * unit) for weight in column] for column in sorted(columns)]
    return [tuple(column[place] for column in whole) for place in range(len(rows))]


class CoreKinds:
    """The kinds of the cores of a class.

    Each core keeps the rows `always`, and one row at least of each list of `choices`.
    """

    def __init__(self, always: Sequence[CoreRow], choices: Iterable[Sequence[CoreRow]]) -> None:
        self.rows = list(always)
        self.choices: list[range] = []
        for listed in choices:
            self.choices.append(range(len(self.rows), len(self.rows) + len(listed)))
            self.rows += listed
        weights = _weights(self.rows)
        self._follows_from = [
            {place for place, other in enumerate(weights) if all(map(le, row, other))} for row in weights
        ]
        self.kinds: list[Kind] = [self._reduced(range(len(always)))]
        for alternatives in self.choices:
            finer = self._undominated(self._reduced({*kind, place}) for kind in self.kinds for place in alternatives)
            if len(finer) <= max(FEW_KINDS, len(self.kinds)):
                self.kinds = finer

    def split(self, used: Mapping[Kind, Callable[[int], Fraction]]) -> bool:
        """Make kinds finer whose cores keep no row of some list; whether there were any.

        Of each kind that is in use there is given how much of the room of a row (by its place) is taken, 1 at most
        where the row is kept.
        """
        finer: list[Kind] = []
        for kind in self.kinds:
            least = [min(map(used[kind], listed)) for listed in self.choices] if kind in used else []
            worst = max(least, default=Fraction(0))
            if worst <= 1:
                finer.append(kind)
            else:
                finer += [self._reduced({*kind, place}) for place in self.choices[least.index(worst)]]
        found = self._undominated(finer)
        if found == self.kinds or len(found) > MOST_KINDS:
            return False
        self.kinds = found
        return True

    def _reduced(self, places: Iterable[int]) -> Kind:
        """Without the rows that follow from others."""
        kept = set(places)
        for place in sorted(kept):
            if self._follows_from[place] & (kept - {place}):
                kept.discard(place)
        return frozenset(kept)

    def _undominated(self, kinds: Iterable[Kind]) -> list[Kind]:
        """Without the kinds whose rows imply those of another one: no core needs to be of these."""
        found: list[Kind] = []
        for kind in sorted(set(kinds), key=lambda kind: (len(kind), sorted(kind))):
            if not any(self._follows(other, kind) for other in found):
                found = [other for other in found if not self._follows(kind, other)]
                found.append(kind)
        return found

    def _follows(self, one: Kind, other: Kind) -> bool:
        """Whether a core that keeps the rows of the other kind keeps those of this one."""
        return all(self._follows_from[place] & other for place in one)
