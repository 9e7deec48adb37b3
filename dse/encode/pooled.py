"""Interchangeable cores counted together: a smaller model without the symmetry of cores (decision record 32).

Whether a core is in time depends on times: for each level some time up to it has room for the work of the core (see
`dse.encode.core_demand`). Cores for which the same times have room form a pool. For a pool the rows of its cores add
up: what its threads need until a time is at most that time for each of its cores. So the model has, for each class of
interchangeable cores, a few pools, how many cores are in each, and which pool a thread is in at which rate; which core
of the pool is not asked. Every design that keeps the rows of cores is a solution with the same figures. What is refuted
here is refuted; of a solution it is left to see whether the threads of each pool can be put on its cores.

Levels whose rows hold under conditions only, and those that would make too many pools, are left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import partial
from math import gcd
from typing import TYPE_CHECKING, Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.partition import core_count
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import allowed_options, tabulate
from dse.encode.core_demand import WHOLE, CoreDemand, jobs_of, points_of
from dse.encode.linear import EXACT_LIMIT
from dse.encode.places import Places, Thread
from dse.encode.schedulability import Rows
from dse.records import dataclass
from dse.space.interchangeable import interchangeable_cores
from dse.timelimit import look_at_the_clock

if TYPE_CHECKING:
    from dse.encode.contention import Contention

MOST_POOLS = 6
"""A level with several times is left out where it would make more pools than this."""
MOST_CASES = 1_000
"""A processor whose number of cores depends on more combinations of options has as many as any type has."""
PARTS = 10_000
"""A core, in whose parts the room that a pool leaves is counted."""

Key: TypeAlias = tuple[int, int]
"""A thread, and a literal of its being somewhere at a rate, which may be one of other threads, too."""
Entries: TypeAlias = dict[Key, tuple[Thread, int, Fraction | None]]
"""Whose work counts in a row while a literal is true: so many jobs, or the rate of a share."""


@dataclass(frozen=True)
class _Row:
    """What one core must have room for: the jobs of `entries` until `most` (ns), or their shares of a `WHOLE` core."""

    entries: Entries
    most: int

    def weight(self, key: Key) -> Fraction:
        """How much of the row a thread takes for each ns of its work."""
        _, jobs, rate = self.entries[key]
        return Fraction(jobs, self.most) if rate is None else rate / NS_PER_S


@dataclass(frozen=True)
class Pool:
    """Cores of a class for which the same times have room: their number, the room that is left, and who is there.

    `cores` are all those of the class, from 1 on; `inside` has for each thread literals of its being in the pool.
    """

    processor: int
    cores: tuple[int, ...]
    count: cp_model.IntVar
    room: cp_model.IntVar
    inside: Mapping[int, Sequence[cp_model.IntVar]]


def add_pools(model: cp_model.CpModel, contention: Contention, processor: int) -> list[Pool]:
    """The pools of a processor, in a model that knows nothing of its cores; none where there is nothing to count."""
    space, places = contention.space, contention.places
    classes = interchangeable_cores(space, processor, fixable=places.fixable)
    rows = Rows(space, model, _by_class(model, places, processor, classes), processor, contention.deadlines)
    pools = []
    for number, cores in enumerate(classes[: rows.cores]):
        pools += _pools(model, rows, number, cores)
    return pools


def _by_class(model: cp_model.CpModel, places: Places, processor: int, classes: Sequence[Sequence[int]]) -> Places:
    """The same places, in which threads are on classes of cores instead of cores."""
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
    if places.true in here or (len(thread.cores) == 1 and here and here == set(columns) - {never}):
        return places.true
    if len(here) < 2:
        return here.pop() if here else never
    made = model.new_bool_var("")
    model.add(sum(_literal(model, index) for index in here) == made)
    return int(made.index)


def _pools(model: cp_model.CpModel, rows: Rows, number: int, cores: Sequence[int]) -> list[Pool]:
    """The pools of a class of cores, which is a column of `rows`."""
    kinds = _kinds(*_rows_of(rows, number))
    counts = [model.new_int_var(0, len(cores), "") for _ in kinds]
    model.add(sum(counts) <= len(cores))
    for literal, most in _cores_by_type(rows):
        there = len([core for core in cores if core <= most])
        if there < len(cores):
            model.add(sum(counts) <= there).only_enforce_if(literal)
    keys = sorted({key for kind in kinds for row in kind for key in row.entries})
    shares = {key: _divided(model, key[1], len(kinds)) for key in keys}
    pools = []
    for place, (kind, count) in enumerate(zip(kinds, counts, strict=True)):
        look_at_the_clock()
        room = model.new_int_var(0, len(cores) * PARTS, "")
        here = {key: columns[place] for key, columns in shares.items()}
        for row in kind:
            _add_row(model, rows, number, row, here, cores, count, room)
        inside: dict[int, list[cp_model.IntVar]] = {}
        for key in keys:
            inside.setdefault(key[0], []).append(here[key])
        pools.append(Pool(rows.processor, tuple(cores), count, room, inside))
    return pools


def _cores_by_type(rows: Rows) -> Iterator[tuple[cp_model.IntVar, int]]:
    """For each type of the processor its literal, and how many cores it has at most."""
    space, processor = rows.space, rows.processor
    decision = space.processors[processor].type_decision
    for option, kind in zip(allowed_options(space, decision), rows.types, strict=True):
        cases = tabulate(space, partial(core_count, space, processor), MOST_CASES, {decision: option})
        if cases:
            yield rows.literal(kind), max(case.value for case in cases)


def _rows_of(rows: Rows, number: int) -> tuple[list[_Row], list[list[_Row]]]:
    """Rows that each core of a class keeps, and lists of which it keeps one at least."""
    timers: Entries = {(thread.number, pair): (thread, 0, rate) for pair, rate, thread in rows.timers(number)}
    always, choices = ([_Row(timers, WHOLE)] if timers else []), []
    for demand in sorted(rows.demands(number), key=lambda demand: demand.latest):
        points = None if demand.demanding else points_of(demand)
        if points:
            choices.append([_until(demand, point) for point in points])
    return always, choices


def _until(demand: CoreDemand, point: int) -> _Row:
    entries: Entries = {}
    for pair, jobs, thread in jobs_of(demand, point):
        _, known, _ = entries.get((thread.number, pair), (thread, 0, None))
        entries[thread.number, pair] = thread, known + jobs, None
    return _Row(entries, point)


def _kinds(always: Sequence[_Row], choices: Sequence[Sequence[_Row]]) -> list[list[_Row]]:
    """The kinds of cores: one row of each list beside those that always hold, without rows that follow from others.

    Without kinds that are nowhere better than another one.
    """
    every = [*always, *(row for rows in choices for row in rows)]
    weights = [{key: row.weight(key) for key in row.entries} for row in every]
    places = {id(row): place for place, row in enumerate(every)}
    follows = [  # the places of the rows that a row follows from
        {
            place
            for place, other in enumerate(weights)
            if row.keys() <= other.keys() and all(weight <= other[key] for key, weight in row.items())
        }
        for row in weights
    ]

    def reduced(kind: frozenset[int]) -> frozenset[int]:
        kept = set(kind)
        for place in sorted(kind):
            if follows[place] & kept - {place}:
                kept.discard(place)
        return frozenset(kept)

    def undominated(kinds: Iterable[frozenset[int]]) -> list[frozenset[int]]:
        found: list[frozenset[int]] = []
        for kind in sorted(set(kinds), key=lambda kind: (len(kind), sorted(kind))):
            if not any(_is_weaker(other, kind, follows) for other in found):
                found = [other for other in found if not _is_weaker(kind, other, follows)]
                found.append(kind)
        return found

    kinds = [reduced(frozenset(range(len(always))))]
    for rows in choices:
        listed = [places[id(row)] for row in rows]
        finer = undominated(reduced(kind | {place}) for kind in kinds for place in listed)
        if len(finer) <= max(MOST_POOLS, len(kinds)):
            kinds = finer
    return [[every[place] for place in sorted(kind)] for kind in kinds]


def _is_weaker(one: frozenset[int], other: frozenset[int], follows: Sequence[set[int]]) -> bool:
    """Whether all rows of one kind follow from those of the other, so that nothing is lost without the other."""
    return all(follows[place] & other for place in one)


def _divided(model: cp_model.CpModel, index: int, pools: int) -> list[cp_model.IntVar]:
    """For each pool a literal of a literal's being true there: one of them where it is."""
    whole = _literal(model, index)
    if pools == 1:
        return [whole]
    parts = [model.new_bool_var("") for _ in range(pools)]
    model.add_exactly_one([whole.negated(), *parts])
    return parts


def _add_row(
    model: cp_model.CpModel,
    rows: Rows,
    number: int,
    row: _Row,
    here: Mapping[Key, cp_model.IntVar],
    cores: Sequence[int],
    count: cp_model.IntVar,
    room: cp_model.IntVar,
) -> None:
    """sum(work * literal) + what is left <= most * count, with each type of the processor."""
    for position, kind in enumerate(rows.types):
        works = {
            key: rows.worst(thread, number, position) * jobs
            if rate is None
            else rows.share(thread, number, position, rate)
            for key, (thread, jobs, rate) in row.entries.items()
        }
        divisor = gcd(row.most, *works.values())
        most = row.most // divisor
        literals = [here[key] for key in works]
        factors = [work // divisor for work in works.values()]
        total = cp_model.LinearExpr.weighted_sum(literals, factors)
        held = rows.literal(kind)
        model.add(total <= most * count).only_enforce_if(held)
        if (sum(factors) + 2 * most * len(cores)) * PARTS < EXACT_LIMIT:
            model.add(PARTS * total + most * room <= PARTS * most * count).only_enforce_if(held)


def _literal(model: cp_model.CpModel, index: int) -> Any:
    found = model.get_int_var_from_proto_index(index if index >= 0 else -index - 1)
    return found if index >= 0 else found.negated()
