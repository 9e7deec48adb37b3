"""Deadlines in the second proof: what the threads of a core need together, level by level.

Threads that are periodic and preempted at any time, each of which must end before its next release, are in time on a
core under some priorities only if they are so rate-monotonically (Liu and Layland, 1973), and for that the work that is
released until some time t must fit into t: for the threads of each period and all shorter ones, t up to that period, a
multiple of one of theirs (Lehoczky, Sha and Ding, 1989). All else that the analysis counts only makes response times
longer. So every design that the analysis accepts keeps these rows, with some core for each thread; whether it may have
that core is not asked, and equal cores are numbered as their first threads stand in the file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, TypeAlias

from dse.analysis.limits import Limit
from dse.analysis.placement.partition import core_count
from dse.analysis.rates import is_event_triggered
from dse.analysis.scheduling.tasks import work_ns
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.space.model.trees import leaves as leaves_of
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, TooLarge, as_fraction, leaves
from dse.verification.scheduling.threads import is_simple
from dse.verification.sums import Summands

MOST_ENTRIES = 100_000
"""Rows with more entries than this, in all, are left out: they would cost more than they save."""

MOST_CASES = 1_000
"""A thread whose demand depends on more combinations of options has no part in rows: they hold without it."""

WHOLE = 10**9
"""A whole core, in which the shares of threads are counted, rounded down."""

Demand: TypeAlias = tuple[int, int, int, int]
"""Of a thread in a design: its processor, how many cores that has, its period and the time of a job at most, in ns."""


@dataclass(frozen=True)
class Levels:
    """For each thread that must be in time its `demands`, and the diagram of the position of the one that it has.

    The first one stands for what is not looked at: a thread on no processor, or one of which events release a job.
    `types` are the decisions on the types of processors.
    """

    demands: Mapping[int, tuple[Demand | None, ...]]
    positions: Mapping[int, Diagram]
    types: tuple[int, ...]


def timely(space: Space, late: Sequence[Limit]) -> dict[int, Limit]:
    """The threads that must be in time in every design, by number, of those whose jobs can be counted."""
    found = {}
    for limit in late:
        number = limit.requirement.metric.index
        if number is None or limit.is_elsewhere or limit.requirement.operator not in ("<=", "<"):
            continue
        component = space.components[number]
        if is_simple(component) and component.response_ns is None:
            found[number] = limit
    return found


def rooms(make: Diagrams, threads: Mapping[int, Limit]) -> Iterator[tuple[str, Summands, Diagram]]:
    """For each processor a name, what these threads use there, and how many cores there are."""
    for number, slot in enumerate(make.space.processors):
        name = f"the cores of {slot.name}"
        here = [thread for thread in threads if number in set(leaves_of(make.space.components[thread].processor))]
        uses = (_diagram(make, partial(_use, make.space, number, thread), name) for thread in here)
        parts = tuple(make.mapped(use, as_fraction) for use in uses if use is not None)
        count = _diagram(make, partial(core_count, make.space, number), name)
        if parts and count is not None:
            yield name, Summands(parts), make.mapped(count, as_fraction)


def _diagram(make: Diagrams, formula: Callable[[View], Any], name: str) -> Diagram | None:
    """The diagram of a formula; None where it depends on so much that a row does without it."""
    try:
        return make.diagram(formula, name, MOST_CASES)
    except TooLarge:
        return None


def _use(space: Space, processor: int, number: int, view: View) -> Fraction:
    """The share of a core that a thread uses of a processor; nothing where events release it."""
    component = space.components[number]
    if at(component.processor, view) != processor or is_event_triggered(component, view):
        return Fraction(0)
    return Fraction(work_ns(space, number, view), at(component.period_ns, view))


def levels_of(make: Diagrams, threads: Mapping[int, Limit]) -> Levels | None:
    """The data of the rows of these threads; None where there are none, or too many."""
    demands: dict[int, tuple[Demand | None, ...]] = {}
    positions = {}
    for number, limit in threads.items():
        found = _diagram(make, partial(_demand, make.space, number, limit), limit.requirement.text)
        if found is None:
            continue
        listed = (None, *sorted({leaf for leaf in leaves(found) if leaf is not None}))
        demands[number], positions[number] = listed, make.mapped(found, partial(_position, listed))
    levels = Levels(demands, positions, tuple(slot.type_decision for slot in make.space.processors))
    return levels if 0 < _entries(levels) <= MOST_ENTRIES else None


def _demand(space: Space, number: int, limit: Limit, view: View) -> Demand | None:
    component = space.components[number]
    processor = at(component.processor, view)
    if processor is None or is_event_triggered(component, view):
        return None
    period = at(component.period_ns, view)
    if limit.bound(view) > period:
        return None
    return processor, core_count(space, processor, view), period, work_ns(space, number, view)


def _position(listed: Sequence[Demand | None], demand: Any) -> int:
    return 0 if demand is NO_DESIGN else listed.index(demand)


def add_levels(model: Any, uses: Sequence[Mapping[Demand, Any]]) -> None:
    """The rows of every core; `uses` has for each thread, in the order of the file, whether it has a demand."""
    cores: dict[tuple[int, int], list[tuple[int, int, Any]]] = {}
    for place, use in enumerate(uses):
        for (processor, count, period, work), is_so in use.items():
            here = [model.new_bool_var("") for _ in range(min(count, place + 1))]
            model.add(sum(here) == is_so)
            for core, literal in enumerate(here):
                cores.setdefault((processor, core), []).append((period, work, literal))
    for held in cores.values():
        share = sum(WHOLE * work // period * literal for period, work, literal in held)
        model.add(share <= WHOLE)
        for shorter, points in by_level(held):
            fits = []
            for point in points:
                fit = model.new_bool_var("")
                work = sum(-(-point // period) * work * literal for period, work, literal in shorter)
                model.add(work <= point).only_enforce_if(fit)
                fits.append(fit)
            model.add_bool_or(fits)


def _entries(levels: Levels) -> int:
    """The number of entries of the rows."""
    held: dict[int, list[tuple[int, int, Any]]] = {}
    most: dict[int, int] = {}
    for demands in levels.demands.values():
        for processor, count, period, work in filter(None, demands):
            held.setdefault(processor, []).append((period, work, None))
            most[processor] = max(most.get(processor, 0), count)
    return sum(
        most[processor] * len(shorter) * len(points)
        for processor, here in held.items()
        for shorter, points in by_level(here)
    )


def by_level(held: Sequence[tuple[int, int, Any]]) -> Iterator[tuple[list[tuple[int, int, Any]], list[int]]]:
    """For each period of a core what is released as often or more often, and the times until which it may fit."""
    periods = sorted({period for period, _, _ in held})
    for level in periods:
        shorter = [item for item in held if item[0] <= level]
        yield shorter, _points(level, [period for period in periods if period <= level])


def _points(level: int, periods: Sequence[int]) -> list[int]:
    """The times until `level` of which one has room if any has: the last releases before each of them, in turn.

    E. Bini and G. C. Buttazzo, "Schedulability analysis of periodic fixed priority systems", IEEE Transactions on
    Computers 53(11), 2004; periods that nobody has on a core add points only.
    """
    points = {level}
    for period in sorted(periods, reverse=True):
        points |= {time - time % period for time in points if time >= period}
    return sorted(points)
