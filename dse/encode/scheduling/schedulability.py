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

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from math import gcd
from typing import Any, TypeAlias

from ortools.sat.python import cp_model

from dse.analysis.limits import Limit
from dse.analysis.rates import NS_PER_S
from dse.analysis.views import tabulate
from dse.encode.linear import EXACT_LIMIT
from dse.encode.literals import literal_of
from dse.encode.scheduling.core_demand import WHOLE, CoreDemand, Rate, few_points_of, points_of, work_of
from dse.encode.scheduling.core_symmetry import number_cores
from dse.encode.scheduling.threads import Places, Thread, Turn
from dse.space.architecture.chains import before_in_chain, may_come_seldom, may_succeed
from dse.space.model.space import Space
from dse.support.timelimit import look_at_the_clock

Level: TypeAlias = tuple[Fraction, int]
"""The time in ns that orders threads, and one by which a job must end."""
Turns: TypeAlias = dict[tuple[Fraction | None, Rate], list[int]]
"""Literals by the time that orders a thread while they are true, and its rate then."""


@dataclass(frozen=True)
class Deadline:
    """An upper limit on the response time of a thread; it holds while the literal `guard` (an index) is true."""

    limit: Limit
    guard: int | None = None

    @property
    def thread(self) -> int:
        """The number of the thread."""
        return self.limit.requirement.metric.index or 0


@dataclass
class _Owners:
    """Threads of a level on one core: for each a literal of its being there, and all that make the demand hold."""

    members: dict[tuple[int, int], tuple[Thread, int]] = field(default_factory=dict)
    demanding: list[int] = field(default_factory=list)


def add_rows(
    space: Space, model: cp_model.CpModel, places: Places, processor: int, deadlines: Sequence[Deadline]
) -> list[int]:
    """The rows of a processor's cores, and the symmetry of equal cores, whose clauses are returned."""
    rows = Rows(space, model, places, processor, deadlines)
    for core in range(rows.cores):
        for demand in rows.demands(core):
            look_at_the_clock()
            rows.add_demand(core, demand)
    for core in range(rows.cores):
        rows.add_utilisation(core)
    if len(rows.threads) == len(places.on(processor)):
        return number_cores(space, model, places, processor)
    return []


def _timed(thread: Thread) -> Sequence[tuple[int, Fraction | None, Fraction | None]]:
    """Literals with the time that orders a thread, where it is known, and the rate of its timer, if one releases it."""
    return thread.timers or [(literal, None, rate) for literal, rate in thread.modes]


class Rows:
    """The demand rows of a processor's cores; the cores are the columns of its threads in `places`."""

    def __init__(
        self,
        space: Space,
        model: cp_model.CpModel,
        places: Places,
        processor: int,
        deadlines: Sequence[Deadline],
    ) -> None:
        self.space, self.model, self.places, self.processor = space, model, places, processor
        self.threads = [thread for thread in places.on(processor) if not thread.is_odd]
        self.types = places.types[processor]
        self.cores = max((len(thread.cores[processor]) for thread in self.threads), default=0)
        timers = {rate for thread in self.threads for _, rate in thread.modes if rate is not None}
        self.steady = sorted(timers)
        self._pairs: dict[int, list[dict[int, int]]] = {}
        self._rounded: dict[int, list[Turn]] = {}
        self._here: dict[tuple[int, int], Turns] = {}
        self._literals: dict[int, Any] = {}
        self._may_succeed: dict[tuple[int, int], bool] = {}
        busy = {thread.number for thread in self.threads if self.always_works(thread)}
        numbers = {thread.number for thread in self.threads}
        before = {number: numbers.intersection(before_in_chain(space, number)) for number in numbers}
        self.related = {number for number, found in before.items() if found}.union(*before.values())
        """Threads that may come before or after another one here in a chain."""
        self.wanted: dict[int, list[Deadline]] = {}
        for item in deadlines:
            if item.thread in busy:
                self.wanted.setdefault(item.thread, []).append(item)

    def always_works(self, thread: Thread) -> bool:
        """Whether a thread takes time wherever it is: a job without work ends at its release, and waits for nobody."""
        shares = [self.places.worst_on[self.processor, thread.number]]
        shares += [self.places.worst_at.get((self.processor, thread.number, core)) or () for core in range(self.cores)]
        return all(all(share) for share in shares)

    def literal(self, index: int) -> Any:
        """The solver's literal of an index; below 0 its negation."""
        if index not in self._literals:
            self._literals[index] = literal_of(self.model, index)
        return self._literals[index]

    def steady_rate(self, rate: Rate) -> Rate:
        """The highest rate of a timer that is not above a rate; 0 below all."""
        return max((item for item in self.steady if item <= rate), default=Fraction(0))

    def here(self, thread: Thread, core: int) -> Turns:
        """For each turn of a thread the literals of its having it on a core."""
        found = self._here.get((thread.number, core))
        if found is None:
            found = self._here[thread.number, core] = {}
            for index, order, rate in self._turns(thread):
                pair = self._pair(thread, core).get(index)
                if pair is not None:
                    found.setdefault((order, rate), []).append(pair)
        return found

    def _turns(self, thread: Thread) -> list[Turn]:
        """The turns of a thread, rates rounded down to steady ones; of unlisted rates those of its timer."""
        if thread.number not in self._rounded:
            self._rounded[thread.number] = self._made_turns(thread)
        return self._rounded[thread.number]

    def _made_turns(self, thread: Thread) -> list[Turn]:
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

    def demands(self, core: int) -> Iterator[CoreDemand]:
        """Those of each level, of threads with a stated priority, and of the best order where there is one to find."""
        by_number = {thread.number: thread for thread in self.threads}
        levels: dict[Level, _Owners] = {}
        alone: list[tuple[Thread, int, int]] = []
        timely: dict[tuple[int, int], int] = {}
        for number, items in self.wanted.items():
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
                    elif order is not None and thread.number in self.related:
                        owners = _Owners({(number, pair): (thread, pair)}, [pair])
                        yield self._level(core, order, latest, owners, timely, (thread, literal))
                    elif order is not None:
                        owners = levels.setdefault((order, latest), _Owners())
                        owners.members.setdefault((thread.number, pair), (thread, pair))
                        owners.demanding.append(pair)
        for (order, latest), owners in levels.items():
            yield self._level(core, order, latest, owners, timely)
        for thread, pair, latest in alone:
            yield self._alone(core, thread, pair, latest)
        if any(thread.numbers for thread in self.threads):
            yield from self._best_order(core)

    def _demands(self, item: Deadline, thread: Thread) -> Iterable[tuple[int, Fraction | None, int]]:
        """Literals with the time that orders the thread (None: unknown) and the one to end by where they hold."""
        operator = item.limit.requirement.operator
        timers = _timed(thread)
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

    def _level(
        self,
        core: int,
        level: Fraction,
        latest: int,
        owners: _Owners,
        timely: Mapping[tuple[int, int], int],
        only: tuple[Thread, int] | None = None,
    ) -> CoreDemand:
        """What delays the last of the owners: each of them once, and whatever is more urgent.

        Without owners it holds as well where all that is more urgent must end by `timely`, before its next job and no
        later than this level: there is room for all jobs when the last of them ends. (Not where some of it may be of
        one chain, in which jobs do not wait for each other.) `only` is the one owner, with its literal, that may be so.
        """
        urgent: list[tuple[int, Rate, Thread]] = []
        for thread in self.threads:
            if core >= len(thread.cores[self.processor]) or (only is not None and thread is only[0]):
                continue
            turns = self.here(thread, core) if only is None else self._beside(*only, thread, core)
            for (order, rate), literals in turns.items():
                if thread.is_numbered or (order is not None and order < level):
                    urgent += [(literal, rate, thread) for literal in literals]
        is_kept = not self.related and all(
            (end := timely.get((thread.number, pair))) is not None and end <= latest and end * rate <= NS_PER_S
            for pair, rate, thread in urgent
        )
        return CoreDemand(latest, urgent, list(owners.members.values()), [] if is_kept else owners.demanding)

    def _beside(self, owner: Thread, literal: int, other: Thread, core: int) -> Turns:
        """The turns in which another thread delays one that is in the mode of a literal on a core.

        Where the two may come one after the other in a chain only timers do, if a timer releases both.
        """
        pair = owner.number, other.number
        if pair not in self._may_succeed:
            self._may_succeed[pair] = may_succeed(self.space, *pair)
        if not self._may_succeed[pair]:
            return self.here(other, core)
        found: Turns = {}
        timed = {index for index, _, rate in _timed(owner) if rate is not None}
        for index, order, rate in _timed(other) if literal in timed else ():
            both = self._both(other, core, index) if rate is not None else None
            if both is not None and rate is not None:
                found.setdefault((order, rate), []).append(both)
        return found

    def _alone(self, core: int, thread: Thread, pair: int, latest: int) -> CoreDemand:
        """A thread with a stated priority: delayed by those whose stated priority is no lower."""
        urgent = []
        for other in self.threads:
            if other.number == thread.number or other.priority is None or core >= len(other.cores[self.processor]):
                continue
            if may_succeed(self.space, thread.number, other.number):
                continue
            if may_come_seldom(self.space, other.number, (thread.number,)):
                continue
            if thread.priority is not None and other.priority >= thread.priority:
                for (_, rate), literals in self.here(other, core).items():
                    urgent += [(literal, rate, other) for literal in literals]
        return CoreDemand(latest, urgent, [(thread, pair)], [pair])

    def add_demand(self, core: int, demand: CoreDemand) -> None:
        """Some point has room: where nothing is demanding it always does, and the linear relaxation sees it."""
        exact, demanding = points_of(demand), demand.demanding
        points, by_share = few_points_of(demand) if exact is None else (exact, frozenset[Rate]())
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
                worst = partial(self.worst, core=core, position=position)
                self._add_row(work_of(demand, point, worst, by_share), point, (literal, kind))

    def worst(self, thread: Thread, core: int, position: int) -> int:
        """The longest time of a job in ns, at least, with the type at a position of `types`."""
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

    def _best_order(self, core: int) -> Iterator[CoreDemand]:
        """Threads with deadlines up to their periods are in time in no order unless they are by their deadlines.

        One of several limits of a thread counts. What else is on the core only adds work.
        """
        entries: dict[tuple[int, int], tuple[int, Thread, int, Rate]] = {}
        for thread in self.threads:
            modes = {literal: rate for literal, rate in thread.modes if rate is not None}
            if core >= len(thread.cores[self.processor]):
                continue
            for item in self.wanted.get(thread.number, ()):
                for literal, _, latest in self._demands(item, thread):
                    known = entries.get((thread.number, literal))
                    if literal not in modes or latest * modes[literal] > NS_PER_S or (known and known[0] <= latest):
                        continue
                    pair = self._guarded(self._both(thread, core, literal), item.guard)
                    if pair is not None:
                        entries[thread.number, literal] = latest, thread, pair, modes[literal]
        for level in sorted({latest for latest, *_ in entries.values()}):
            urgent = [(pair, rate, thread) for latest, thread, pair, rate in entries.values() if latest < level]
            members = [(thread, pair) for latest, thread, pair, _ in entries.values() if latest == level]
            yield CoreDemand(level, urgent, members)

    def timers(self, core: int) -> list[tuple[int, Rate, Thread]]:
        """Literals of the threads with a deadline on a core with the rate of their timer; none where limits are open.

        They use no more than the core: the last of them waits for all others.
        """
        if any(item.guard is not None for items in self.wanted.values() for item in items):
            return []
        found = []
        for thread in self.threads:
            if thread.number in self.wanted and core < len(thread.cores[self.processor]):
                for literal, rate in thread.modes:
                    pair = self._both(thread, core, literal) if rate is not None else None
                    if pair is not None and rate is not None:
                        found.append((pair, rate, thread))
        return found

    def share(self, thread: Thread, core: int, position: int, rate: Rate) -> int:
        """The share of a core that a thread uses, in parts of `WHOLE`, rounded down."""
        return int(self.worst(thread, core, position) * rate * WHOLE / NS_PER_S)

    def add_utilisation(self, core: int) -> None:
        """Add the row that the threads with a deadline use at most the whole core."""
        timers = self.timers(core)
        look_at_the_clock()
        for position, kind in enumerate(self.types if timers else ()):
            parts = [(pair, self.share(thread, core, position, rate)) for pair, rate, thread in timers]
            self._add_row(parts, WHOLE, [kind])
