"""Interchangeable cores counted together: a smaller model without the symmetry of cores (decision record 8).

Whether a core is in time depends on times: for each level some time up to it has room for the work of the core (see
`dse.encode.scheduling.core_demand`). Cores for which the same times have room form a pool. For a pool the rows of its
cores add up: what its threads need until a time is at most that time for each of its cores. So the model has, for each
class of interchangeable cores, a few pools, how many cores are in each, and which pool a thread is in at which rate;
which core of the pool is not asked. Every design that keeps the rows of cores is a solution with the same figures. What
is refuted here is refuted; of a solution it is left to see whether the threads of each pool can be put on its cores.

Levels whose rows hold under conditions only are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from math import gcd, lcm
from operator import le
from typing import TYPE_CHECKING, Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.placement.partition import core_count
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import allowed_options, tabulate
from dse.encode.linear import EXACT_LIMIT
from dse.encode.scheduling.core_demand import WHOLE, CoreDemand, jobs_of, points_of
from dse.encode.scheduling.schedulability import Rows
from dse.encode.scheduling.threads import Places, Thread
from dse.space.core_symmetry import interchangeable_cores
from dse.space.model.trees import leaves
from dse.support.timelimit import look_at_the_clock

if TYPE_CHECKING:
    from dse.encode.scheduling.contention import Contention

MOST_CASES = 1_000
"""A processor whose number of cores depends on more combinations of options has as many as any type has."""
PARTS = 10_000
"""A core, in whose parts the room that a pool leaves is counted."""


@dataclass(frozen=True)
class CoreClass:
    """Interchangeable cores of a processor, from 1 on, which are one column of `rows`, and their kinds."""

    rows: Rows
    column: int
    cores: tuple[int, ...]
    kinds: CoreKinds

    def works(self, row: CoreRow, position: int) -> dict[Key, int]:
        """The demand of each thread in a row, with the processor type at a position."""
        return {
            key: self.rows.worst(thread, self.column, position) * jobs
            if rate is None
            else self.rows.share(thread, self.column, position, rate)
            for key, (thread, jobs, rate) in row.entries.items()
        }


@dataclass(frozen=True)
class Pool:
    """The cores of a class that are of one kind: their number, the room that is left, and who is there."""

    of: CoreClass
    kind: Kind
    count: cp_model.IntVar
    room: cp_model.IntVar
    here: Mapping[Key, cp_model.IntVar]

    def threads(self, solution: Sequence[int]) -> set[int]:
        """The numbers of the threads that are there in a solution."""
        return {number for (number, _), literal in self.here.items() if is_true(solution, literal)}

    def share(self, solution: Sequence[int], place: int) -> Fraction:
        """How much of the room of a row, by its place, the threads of the pool take in a solution."""
        rows = self.of.rows
        row, cores = self.of.kinds.rows[place], solution[self.count.index]
        position = next(at for at, kind in enumerate(rows.types) if is_true(solution, rows.literal(kind)))
        works = self.of.works(row, position)
        taken = sum(work for key, work in works.items() if key in self.here and is_true(solution, self.here[key]))
        return Fraction(taken, row.most * cores)


def classes_of(
    model: cp_model.CpModel, contention: Contention, processor: int, *, few: int, most: int
) -> list[CoreClass]:
    """The classes of a processor's cores, in a model that knows nothing of its cores.

    `few` and `most` limit the number of kinds of cores (`CoreKinds`).
    """
    space, places = contention.space, contention.places
    classes = interchangeable_cores(space, processor, fixable=places.fixable)
    rows = Rows(space, model, _by_class(model, places, processor, classes), processor, contention.deadlines)
    return [
        CoreClass(rows, column, cores, CoreKinds(*_rows_of(rows, column), few=few, most=most))
        for column, cores in enumerate(classes[: rows.cores])
    ]


def _by_class(model: cp_model.CpModel, places: Places, processor: int, classes: Sequence[Sequence[int]]) -> Places:
    """Where each thread may run, by classes of interchangeable cores in place of single cores."""
    found = copy(places)
    found.threads = {
        number: replace(
            thread,
            cores={processor: tuple(_any_of(model, places, thread, processor, cores) for cores in classes)},
        )
        for number, thread in places.threads.items()
        if processor in thread.cores
    }
    found.worst_at = {
        (processor, number, place): worst
        for number in found.threads
        for place, cores in enumerate(classes)
        if (worst := places.worst_at.get((processor, number, cores[0] - 1))) is not None
    }
    return found


def _any_of(model: cp_model.CpModel, places: Places, thread: Thread, processor: int, cores: Sequence[int]) -> int:
    """A literal that is true where a thread is on one of these cores of a processor."""
    never, columns = -places.true - 1, thread.cores[processor]
    here = {columns[core - 1] for core in cores if core <= len(columns)} - {never}
    is_always_here = set(leaves(places.space.components[thread.number].processor)) == {processor}
    if places.true in here or (is_always_here and here and here == set(columns) - {never}):
        return places.true
    if len(here) < 2:
        return here.pop() if here else never
    made = model.new_bool_var("")
    model.add(sum(_literal(model, index) for index in here) == made)
    return int(made.index)


def _rows_of(rows: Rows, column: int) -> tuple[list[CoreRow], list[list[CoreRow]]]:
    """Rows that each core of a class keeps, and lists of which it keeps one at least."""
    timers: Entries = {(thread.number, pair): (thread, 0, rate) for pair, rate, thread in rows.timers(column)}
    always, choices = ([CoreRow(timers, WHOLE)] if timers else []), []
    for demand in sorted(rows.demands(column), key=lambda demand: demand.latest):
        points = None if demand.demanding else points_of(demand)
        if points:
            choices.append([_until(demand, point) for point in points])
    return always, choices


def _until(demand: CoreDemand, point: int) -> CoreRow:
    entries: Entries = {}
    for pair, jobs, thread in jobs_of(demand, point):
        _, known, _ = entries.get((thread.number, pair), (thread, 0, None))
        entries[thread.number, pair] = thread, known + jobs, None
    return CoreRow(entries, point)


def add_pools(model: cp_model.CpModel, of: CoreClass) -> list[Pool]:
    """A pool for each kind of the cores of a class, in a copy of the model in which the class was made."""
    kinds, rows, cores = of.kinds.kinds, of.kinds.rows, of.cores
    counts = [model.new_int_var(0, len(cores), "") for _ in kinds]
    model.add(sum(counts) <= len(cores))
    for index, most in _cores_by_type(of.rows):
        there = len([core for core in cores if core <= most])
        if there < len(cores):
            model.add(sum(counts) <= there).only_enforce_if(_literal(model, index))
    keys = sorted({key for kind in kinds for place in kind for key in rows[place].entries})
    parts = {key: _divided(model, key[1], len(kinds)) for key in keys}
    pools = []
    for number, (kind, count) in enumerate(zip(kinds, counts, strict=True)):
        look_at_the_clock()
        room = model.new_int_var(0, len(cores) * PARTS, "")
        pool = Pool(of, kind, count, room, {key: columns[number] for key, columns in parts.items()})
        for place in sorted(kind):
            _add_row(model, pool, rows[place])
        pools.append(pool)
    return pools


def _cores_by_type(rows: Rows) -> Iterator[tuple[int, int]]:
    """For each type of the processor its literal, and how many cores it has at most."""
    space, processor = rows.space, rows.processor
    decision = space.processors[processor].type_decision
    for option, kind in zip(allowed_options(space, decision), rows.types, strict=True):
        cases = tabulate(space, partial(core_count, space, processor), MOST_CASES, {decision: option})
        if cases:
            yield kind, max(case.value for case in cases)


def _divided(model: cp_model.CpModel, index: int, pools: int) -> list[cp_model.IntVar]:
    """For each pool a literal of a literal's being true there: one of them where it is."""
    whole = _literal(model, index)
    if pools == 1:
        return [whole]
    parts = [model.new_bool_var("") for _ in range(pools)]
    model.add_exactly_one([whole.negated(), *parts])
    return parts


def _add_row(model: cp_model.CpModel, pool: Pool, row: CoreRow) -> None:
    """sum(work * literal) + what is left <= most * count, with each type of the processor."""
    for position, kind in enumerate(pool.of.rows.types):
        works = pool.of.works(row, position)
        divisor = gcd(row.most, *works.values())
        most, factors = row.most // divisor, [work // divisor for work in works.values()]
        total = cp_model.LinearExpr.weighted_sum([pool.here[key] for key in works], factors)
        held = _literal(model, kind)
        model.add(total <= most * pool.count).only_enforce_if(held)
        if (sum(factors) + 2 * most * len(pool.of.cores)) * PARTS < EXACT_LIMIT:
            model.add(PARTS * total + most * pool.room <= PARTS * most * pool.count).only_enforce_if(held)


def is_true(solution: Sequence[int], literal: Any) -> bool:
    """Whether a literal, perhaps a negated one, is true in a solution."""
    index = literal.index
    return bool(solution[index]) if index >= 0 else not solution[-index - 1]


def _literal(model: cp_model.CpModel, index: int) -> Any:
    found = model.get_int_var_from_proto_index(index if index >= 0 else -index - 1)
    return found if index >= 0 else found.negated()


# The kinds of cores by what they have room for: until which time, for each level (decision record 8).
#
# A core keeps one row of each list of alternatives. Rows that follow from others are left out, and so are kinds that
# are nowhere better than another one. All combinations would be too many kinds; those that there are can be split where
# a row is missed that none of their alternatives keeps.


Key: TypeAlias = tuple[int, int]
"""A thread, and a literal of its being somewhere at a rate, which may be one of other threads, too."""
Entries: TypeAlias = dict[Key, tuple[Thread, int, Fraction | None]]
"""Whose work counts in a row while a literal is true: so many jobs, or the rate of a share."""
NOTHING = (None, 0, None)
Kind: TypeAlias = frozenset[int]
"""The places of the rows that a core keeps."""


@dataclass(frozen=True)
class CoreRow:
    """The demand that one core must hold: the jobs of `entries` until `most` (ns), or their shares of a whole core."""

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

    Each core keeps the rows `always`, and one row at least of each list of `choices`. A list that would make more than
    a `few` kinds is left out at first; kinds are not split into more than `most`.
    """

    def __init__(self, always: Sequence[CoreRow], choices: Iterable[Sequence[CoreRow]], *, few: int, most: int) -> None:
        self._most = most
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
            if len(finer) <= max(few, len(self.kinds)):
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
        if found == self.kinds or len(found) > self._most:
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
