"""Fixed-priority schedulability of the cores of a processor as linear rows: the level form.

Threads without a priority of their own are ordered by a time: that between their jobs, or their deadline. Of those
that share this time, a deadline D and a core, the last in the order of the file waits for all others of them, for
every thread of a shorter time and for every thread with a number. It ends in time only if some t up to D has room for
all their jobs:

    sum(ceil(t * rate) * worst over what is more urgent) + sum(worst over those with this time and deadline) <= t

so that one row for each t serves all of them, and one clause says that some t does. For t it is enough to take the
points of E. Bini and G. C. Buttazzo ("Schedulability analysis of periodic fixed priority systems", IEEE Transactions on
Computers 53(11), 2004) over all rates that may be there: {D}, and for each rate the last release before each point.

The rows hold of every schedule that the analysis accepts, whatever it has: release jitter, several streams and odd
rates only add jobs (a rate is rounded down to one that some timer has), threads that are not listed only add work, and
of a deadline beyond the period the first job is looked at. For rate-monotonic threads without jitter whose deadlines
do not exceed their periods they say exactly what response-time analysis says.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from math import gcd
from typing import TYPE_CHECKING, Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.rates import NS_PER_S
from dse.analysis.views import tabulate
from dse.encode.equal_cores import number_cores
from dse.encode.linear import EXACT_LIMIT
from dse.encode.places import Places, Thread, Turn
from dse.records import dataclass
from dse.space.types import Space
from dse.timelimit import look_at_the_clock

if TYPE_CHECKING:
    from dse.encode.contention import Deadline

MOST_POINTS = 24
"""A level with more points than this has no rows: what it would refuse is found by the referee."""

Rate: TypeAlias = Fraction
Level: TypeAlias = tuple[Fraction, int]
"""The time in ns that orders threads, and one by which a job must end."""
Turns: TypeAlias = dict[tuple[Fraction | None, Rate], list[int]]
"""Literals by the time that orders a thread while they are true, and its rate then."""


@dataclass
class _Owners:
    """Threads of a level on one core: for each a literal of its being there, and all that make the demand hold."""

    members: dict[tuple[int, int], tuple[Thread, int]] = field(default_factory=dict)
    demanding: list[int] = field(default_factory=list)


def add_rows(
    space: Space, model: cp_model.CpModel, places: Places, processor: int, deadlines: Sequence[Deadline]
) -> list[int]:
    """The rows of a processor's cores, and the symmetry of equal cores, whose clauses are returned."""
    threads = [thread for thread in places.on(processor) if not thread.is_odd]
    rows = _Rows(space, model, places, processor, threads)
    wanted: dict[int, list[Deadline]] = {}
    busy = {thread.number for thread in threads if rows.always_works(thread)}
    for item in deadlines:
        if item.thread in busy:
            wanted.setdefault(item.thread, []).append(item)
    rows.add_levels(wanted)
    rows.add_utilisation(wanted)
    if any(thread.numbers for thread in threads):
        rows.add_best_order(wanted)
    if len(threads) == len(places.on(processor)):
        return number_cores(space, model, places, processor)
    return []


class _Rows:
    def __init__(
        self, space: Space, model: cp_model.CpModel, places: Places, processor: int, threads: Sequence[Thread]
    ) -> None:
        self.space, self.model, self.places, self.processor = space, model, places, processor
        self.threads = threads
        self.types = places.types[processor]
        self.cores = max((len(thread.cores[processor]) for thread in threads), default=0)
        timers = {rate for thread in threads for _, rate in thread.modes if rate is not None}
        self.steady = sorted(timers)
        self._pairs: dict[int, list[dict[int, int]]] = {}

    def always_works(self, thread: Thread) -> bool:
        """Whether a thread takes time wherever it is: a job without work ends at its release, and waits for nobody."""
        shares = [self.places.worst_on[self.processor, thread.number]]
        shares += [self.places.worst_at.get((self.processor, thread.number, core)) or () for core in range(self.cores)]
        return all(all(share) for share in shares)

    def literal(self, index: int) -> Any:
        """The solver's literal of an index."""
        if index < 0:
            return self.model.get_int_var_from_proto_index(-index - 1).negated()
        return self.model.get_int_var_from_proto_index(index)

    def steady_rate(self, rate: Rate) -> Rate:
        """The highest rate of a timer that is not above a rate; 0 below all."""
        return max((item for item in self.steady if item <= rate), default=Fraction(0))

    def here(self, thread: Thread, core: int) -> Turns:
        """For each turn of a thread the literals of its having it on a core."""
        found: Turns = {}
        for index, order, rate in self._turns(thread):
            pair = self._pair(thread, core).get(index)
            if pair is not None:
                found.setdefault((order, rate), []).append(pair)
        return found

    def _turns(self, thread: Thread) -> list[Turn]:
        """The turns of a thread, rates rounded down to steady ones; of unlisted rates those of its timer."""
        if thread.turns is not None:
            return [(index, order, self.steady_rate(rate)) for index, order, rate in thread.turns]
        if thread.rates is not None:
            return [(index, None, self.steady_rate(rate)) for index, rate in thread.rates]
        if thread.is_numbered:
            return [(index, None, Fraction(0) if rate is None else rate) for index, rate in thread.modes]
        return [(index, order, Fraction(0) if rate is None else rate) for index, order, rate in thread.timers]

    def _pair(self, thread: Thread, core: int) -> dict[int, int]:
        """For each rate literal of a thread a literal that is true with it while the thread is on the core."""
        if thread.number not in self._pairs:
            self._pairs[thread.number] = self._made_pairs(thread)
        return self._pairs[thread.number][core]

    def _made_pairs(self, thread: Thread) -> list[dict[int, int]]:
        """y[rate, core], true where both are: sum over rates = the core's literal, sum over cores <= the rate's."""
        rates = [index for index, *_ in self._turns(thread)]
        cores = thread.cores[self.processor]
        true, never = self.places.true, -self.places.true - 1
        made: list[dict[int, int]] = []
        for core in cores:
            if core == never:
                made.append({})
            elif core == true:
                made.append({index: index for index in rates})
            elif len(rates) == 1:
                made.append({rates[0]: core})
            else:
                made.append({index: self.model.new_bool_var("").index for index in rates})
                self.model.add_exactly_one([self.literal(-core - 1), *map(self.literal, made[-1].values())])
        for index in rates if len(rates) > 1 else ():
            parts = [row[index] for row in made if index in row and row[index] != index]
            if parts:
                self.model.add_at_most_one([self.literal(-index - 1), *map(self.literal, parts)])
        return made

    def add_levels(self, wanted: dict[int, list[Deadline]]) -> None:
        """The rows of each level of each core."""
        by_number = {thread.number: thread for thread in self.threads}
        for core in range(self.cores):
            levels: dict[Level, _Owners] = {}
            alone: list[tuple[Thread, int, int]] = []
            timely: dict[tuple[int, int], int] = {}
            for number, items in wanted.items():
                thread = by_number[number]
                if core >= len(thread.cores[self.processor]):
                    continue
                for item in items:
                    for literal, order, latest in self._demands(item, thread):
                        pair = self._guarded(self._both(thread, core, literal), item.guard)
                        if pair is None:
                            continue
                        timely[number, pair] = min(latest, timely.get((number, pair), latest))
                        if thread.priority is not None:
                            alone.append((thread, pair, latest))
                        elif order is not None:
                            owners = levels.setdefault((order, latest), _Owners())
                            owners.members.setdefault((thread.number, pair), (thread, pair))
                            owners.demanding.append(pair)
            for (order, latest), owners in levels.items():
                look_at_the_clock()
                self._add_level(core, order, latest, owners, timely)
            for thread, pair, latest in alone:
                self._add_alone(core, thread, pair, latest)

    def _demands(self, item: Deadline, thread: Thread) -> Iterable[tuple[int, Fraction | None, int]]:
        """Literals with the time that orders the thread (None: unknown) and the one to end by where they hold."""
        operator = item.limit.requirement.operator
        timers = thread.timers or [(literal, None, rate) for literal, rate in thread.modes]
        values = {case.value for case in tabulate(self.space, item.limit.bound, 10_000) or []}
        if len(values) == 1:
            bound = values.pop()
            latest = bound.numerator // bound.denominator - int(operator == "<" and bound.denominator == 1)
            return [(literal, order, latest) for literal, order, _ in timers]
        component = self.space.components[item.thread]
        if component.deadline_ns is None:  # the period is the deadline; without a timer there may be none
            strict = int(operator == "<")
            return [
                (literal, order, int(NS_PER_S / rate) - strict) for literal, order, rate in timers if rate is not None
            ]
        return []

    def _both(self, thread: Thread, core: int, literal: int) -> int | None:
        """A literal that is true where the thread is in a mode and on a core; None where it cannot be."""
        where = thread.cores[self.processor][core]
        if where == -self.places.true - 1:
            return None
        if where == self.places.true:
            return literal
        if literal == self.places.true:
            return where
        known = self._pair(thread, core)
        if literal in known:
            return known[literal]
        made = self.model.new_bool_var("")
        self.model.add_bool_or([made, self.literal(-where - 1), self.literal(-literal - 1)])
        self.model.add_implication(made, self.literal(where))
        self.model.add_implication(made, self.literal(literal))
        return made.index

    def _guarded(self, pair: int | None, guard: int | None) -> int | None:
        """A literal that is true where both are; without a guard the literal itself."""
        if pair is None or guard is None:
            return pair
        made = self.model.new_bool_var("")
        self.model.add_bool_or([made, self.literal(-pair - 1), self.literal(-guard - 1)])
        self.model.add_implication(made, self.literal(pair))
        self.model.add_implication(made, self.literal(guard))
        return made.index

    def _add_level(
        self, core: int, level: Fraction, latest: int, owners: _Owners, timely: Mapping[tuple[int, int], int]
    ) -> None:
        """What delays the last of the owners: each of them once, and whatever is more urgent.

        Without owners it holds as well where all that is more urgent must end by `timely`, before its next job and no
        later than this level: there is room for all jobs when the last of them ends.
        """
        urgent: list[tuple[int, Rate, Thread]] = []
        for thread in self.threads:
            if core >= len(thread.cores[self.processor]):
                continue
            for (order, rate), literals in self.here(thread, core).items():
                if thread.is_numbered or (order is not None and order < level):
                    urgent += [(literal, rate, thread) for literal in literals]
        is_kept = all(
            (end := timely.get((thread.number, pair))) is not None and end <= latest and end * rate <= NS_PER_S
            for pair, rate, thread in urgent
        )
        self._add_demand(core, latest, urgent, list(owners.members.values()), [] if is_kept else owners.demanding)

    def _add_alone(self, core: int, thread: Thread, pair: int, latest: int) -> None:
        """A thread with a stated priority: delayed by those whose stated priority is no lower."""
        urgent = []
        for other in self.threads:
            if other.number == thread.number or other.priority is None or core >= len(other.cores[self.processor]):
                continue
            if thread.priority is not None and other.priority >= thread.priority:
                for (_, rate), literals in self.here(other, core).items():
                    urgent += [(literal, rate, other) for literal in literals]
        self._add_demand(core, latest, urgent, [(thread, pair)], [pair])

    def _add_demand(
        self,
        core: int,
        latest: int,
        urgent: Sequence[tuple[int, Rate, Thread]],
        members: Sequence[tuple[Thread, int]],
        demanding: Sequence[int],
    ) -> None:
        """Some point has room for what is urgent and for the members, where one of the literals `demanding` is true.

        Without any it has so always: then the linear relaxation sees it.
        """
        points = scheduling_points(latest, sorted({rate for _, rate, _ in urgent}))
        if points is None:
            return
        needed = demanding[0] if demanding else self.places.true
        if len(demanding) > 1:
            needed = self.model.new_bool_var("").index
            for pair in demanding:
                self.model.add_implication(self.literal(pair), self.literal(needed))
        chosen = [needed] if len(points) == 1 else [self.model.new_bool_var("").index for _ in points]
        if len(points) > 1:
            self.model.add_bool_or([*([self.literal(-needed - 1)] if demanding else []), *map(self.literal, chosen)])
        for position, kind in enumerate(self.types):
            for point, literal in zip(points, chosen, strict=True):
                parts = [
                    (pair, self._worst(thread, core, position) * jobs_within(point, rate))
                    for pair, rate, thread in urgent
                ]
                parts += [(pair, self._worst(thread, core, position)) for thread, pair in members]
                self._add_row(parts, point, (literal, kind))

    def _worst(self, thread: Thread, core: int, position: int) -> int:
        at_core = self.places.worst_at.get((self.processor, thread.number, core))
        return (at_core or self.places.worst_on[self.processor, thread.number])[position]

    def _add_row(self, parts: Iterable[tuple[int, int]], most: int, where: Iterable[int]) -> None:
        """sum(work * literal) <= most where the literals `where` hold, divided by the common divisor."""
        totals: dict[int, int] = {}
        for index, work in parts:
            if work:
                totals[index] = totals.get(index, 0) + work
        constant = totals.pop(self.places.true, 0)
        if not totals or constant + sum(totals.values()) <= most:
            if constant > most:
                self.model.add_bool_or([self.literal(-index - 1) for index in where])
            return
        divisor = gcd(*totals.values())
        if sum(totals.values()) // divisor >= EXACT_LIMIT:
            return
        literals = [self.literal(index) for index in totals]
        row = cp_model.LinearExpr.weighted_sum(literals, [work // divisor for work in totals.values()])
        held = [self.literal(index) for index in where if index != self.places.true]
        self.model.add(row <= (most - constant) // divisor).only_enforce_if(held)

    def add_best_order(self, wanted: dict[int, list[Deadline]]) -> None:
        """Threads with deadlines up to their periods are in time in no order unless they are by their deadlines.

        One of several limits of a thread counts. What else is on the core only adds work.
        """
        for core in range(self.cores):
            entries: dict[tuple[int, int], tuple[int, Thread, int, Rate]] = {}
            for thread in self.threads:
                modes = {literal: rate for literal, rate in thread.modes if rate is not None}
                if core >= len(thread.cores[self.processor]):
                    continue
                for item in wanted.get(thread.number, ()):
                    for literal, _, latest in self._demands(item, thread):
                        known = entries.get((thread.number, literal))
                        if literal not in modes or latest * modes[literal] > NS_PER_S or (known and known[0] <= latest):
                            continue
                        pair = self._guarded(self._both(thread, core, literal), item.guard)
                        if pair is not None:
                            entries[thread.number, literal] = latest, thread, pair, modes[literal]
            for level in sorted({latest for latest, *_ in entries.values()}):
                look_at_the_clock()
                urgent = [(pair, rate, thread) for latest, thread, pair, rate in entries.values() if latest < level]
                members = [(thread, pair) for latest, thread, pair, _ in entries.values() if latest == level]
                self._add_demand(core, level, urgent, members, [])

    def add_utilisation(self, wanted: dict[int, list[Deadline]]) -> None:
        """The threads with a deadline use no more than their core: the last of them waits for all others."""
        if any(item.guard is not None for items in wanted.values() for item in items):
            return
        timers = [
            (thread, literal, rate)
            for thread in self.threads
            if thread.number in wanted
            for literal, rate in thread.modes
            if rate is not None
        ]
        if not timers:
            return
        whole = 10**9
        for core in range(self.cores):
            look_at_the_clock()
            for position, kind in enumerate(self.types):
                parts = []
                for thread, literal, rate in timers:
                    pair = self._both(thread, core, literal) if core < len(thread.cores[self.processor]) else None
                    if pair is not None:
                        parts.append((pair, int(self._worst(thread, core, position) * rate * whole / NS_PER_S)))
                self._add_row(parts, whole, [kind])


def jobs_within(window_ns: int, rate: Rate) -> int:
    """The fewest jobs that a thread of this rate may release in a window at worst: at least the first.

    >>> [jobs_within(25, Fraction(NS_PER_S, 10)), jobs_within(20, Fraction(NS_PER_S, 10)), jobs_within(20, Fraction(0))]
    [3, 2, 1]
    """
    return max(1, -(-(window_ns * rate.numerator) // (NS_PER_S * rate.denominator)))


def scheduling_points(latest: int, rates: Sequence[Rate]) -> list[int] | None:
    """The times up to `latest` (ns) of which one has room if any time has, by Bini and Buttazzo; None if too many.

    `rates` go from the slowest to the fastest; a rate of 0 has its first job only.

    >>> scheduling_points(20, [Fraction(NS_PER_S, 12), Fraction(NS_PER_S, 7)])
    [7, 12, 14, 20]
    """
    points = {latest}
    for rate in rates:
        if rate:
            points |= {int(int(point * rate / NS_PER_S) * NS_PER_S / rate) for point in points}
        points.discard(0)
        if len(points) > MOST_POINTS:
            return None
    return sorted(points)
