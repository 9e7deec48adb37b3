"""Kinds of designs on a front: which computers and which decisions make a difference, and which hardly matter.

A *kind* is a set of designs with equal processor types and equal values of every decision that is not minor. The minor
decisions together move no objective, within a kind, by much more than a tenth of its range on the front or a tenth of
its value, whichever is larger, as far as four further decisions can tell kinds apart. The second part is for fronts
that are narrow in an objective: bus rates of 5 to 40 EUR stay minor although all designs cost 1 040 to 1 080 EUR.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from dse.answers.designs import Point
from dse.answers.ranking.ranking import range_of
from dse.answers.ranking.variants import varying
from dse.answers.result import Result
from dse.support.units import is_unbounded

OF_RANGE = Fraction(1, 10)
"""The change of an objective by the minor decisions of a kind, as a share of its range on the front."""
OF_VALUE = Fraction(1, 10)
"""The change of an objective by the minor decisions of a kind, as a share of its value."""
ARRANGED = ("core", "priority", "offset")
"""Fields that say where and when threads run on a given computer: minor before any other decision is."""
MOST_NAMING = 4
"""The greatest number of decisions beside processor types that tell kinds apart."""
EXCESS = Fraction(1, 4)
"""How much wider than that kinds may be on average, before another decision tells them apart."""
FAR = 10**9
MOST_LOOKED_AT = 1_000_000
"""Points times decisions up to which minor decisions are looked for; else processor types alone name kinds."""


@dataclass(frozen=True)
class Kind:
    """Designs of a front that are built alike, best ranked first; `point` stands for them.

    Built alike means: equal options in the decisions that make a difference to the objectives.
    """

    point: Point
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Kinds:
    """The kinds of a front, by the rank of their best design.

    `naming` are the decisions that tell kinds apart, `minor` those that differ within a kind, in the order of the
    problem, without the cores, priorities and offsets of threads, which are `arranged`.
    """

    kinds: tuple[Kind, ...]
    naming: tuple[str, ...]
    minor: tuple[str, ...]
    arranged: tuple[str, ...]


def kinds_of(result: Result) -> Kinds:
    """The kinds of designs on the front of a result.

    Examples
    --------
    >>> import dse
    >>> found = kinds_of(dse.solve("pump.yaml"))
    >>> [(kind.point.id, len(kind.points)) for kind in found.kinds], found.naming, found.minor
    ([(1, 2), (2, 2)], ('computer.type',), ('can0.type', 'control.period'))
    """
    front = result.front
    if not front:
        return Kinds((), (), (), ())
    names = varying([point.decisions for point in front], result.open_decisions) if len(front) > 1 else []
    fields = {decision.name: decision.field for decision in result.space.decisions}
    types = {f"{slot.name}.type" for slot in result.space.processors}
    always = [name for name in names if name in types]
    others = [name for name in names if name not in types]
    needed = _naming(result, always, others)
    naming = [name for name in names if name in needed]
    groups: dict[tuple[str | None, ...], list[Point]] = {}
    for point in front:
        groups.setdefault(tuple(point.decisions.get(name) for name in naming), []).append(point)
    rest = [name for name in names if name not in naming]
    arranged = tuple(name for name in rest if fields[name] in ARRANGED)
    minor = tuple(name for name in rest if name not in arranged)
    kinds = tuple(Kind(_like(front[0], points, minor), tuple(points)) for points in groups.values())
    return Kinds(kinds, tuple(naming), minor, arranged)


def _like(first: Point, points: Sequence[Point], minor: Sequence[str]) -> Point:
    """The best design of a kind that has the minor options of the first of all; else the best design."""
    alike = (item for item in points if all(item.decisions.get(n) == first.decisions.get(n) for n in minor))
    return next(alike, points[0])


def _naming(result: Result, always: Sequence[str], others: Sequence[str]) -> set[str]:
    """The decisions that tell kinds apart: `always`, and of `others` those without which kinds would be too wide.

    They are added one by one, each time the one that leaves the least excess: until that is no more than `EXCESS`, or
    there are `MOST_NAMING`.
    """
    front, senses = result.front, [info.sense for info in result.objectives]
    naming = list(always)
    if len(front) * len(others) > MOST_LOOKED_AT:
        return set(naming)
    vectors = [tuple(point.objectives[info.name] for info in result.objectives) for point in front]
    ranges = [max(Fraction(worst - best), Fraction(best - worst)) for best, worst in range_of(vectors, senses)]
    fields = {decision.name: decision.field for decision in result.space.decisions}
    columns = {name: [point.decisions.get(name) for point in front] for name in (*always, *others)}
    rest = sorted(others, key=lambda name: (fields[name] in ARRANGED, not name.endswith(".type")))
    groups = _numbered(list(zip(*(columns[name] for name in always), strict=True)) or [()] * len(front))
    excess = _excess(groups, vectors, ranges)
    while excess > EXCESS and rest and len(naming) < len(always) + MOST_NAMING:
        finer = {name: _numbered(list(zip(groups, columns[name], strict=True))) for name in rest}
        left = {name: _excess(finer[name], vectors, ranges) for name in rest}
        name = min(rest, key=lambda name: left[name])  # the first of several
        if left[name] >= excess:
            break
        groups, excess = finer[name], left[name]
        naming.append(name)
        rest.remove(name)
    return set(naming)


def _numbered(keys: Sequence[Hashable]) -> list[int]:
    """A number for each key; equal ones have the same."""
    numbers: dict[Hashable, int] = {}
    return [numbers.setdefault(key, len(numbers)) for key in keys]


def _excess(groups: Sequence[int], vectors: Sequence[Sequence[int]], ranges: Sequence[Fraction]) -> Fraction:
    """How much wider groups are than kinds may be, as a share of that, on average over their members.

    A group in which an objective is bounded in some only is far too wide.
    """
    ends: dict[int, tuple[list[int], list[int], list[int]]] = {}
    mixed: set[int] = set()
    for group, vector in zip(groups, vectors, strict=True):
        low, high, count = ends.setdefault(group, (list(vector), list(vector), [0]))
        count[0] += 1
        for axis, value in enumerate(vector):
            if is_unbounded(value) != is_unbounded(low[axis]):
                mixed.add(group)
            low[axis], high[axis] = min(low[axis], value), max(high[axis], value)
    total = Fraction(0)
    for group, (low, high, count) in ends.items():
        width = Fraction(FAR if group in mixed else 0)
        for lower, upper, span in zip(low, high, ranges, strict=True) if group not in mixed else ():
            largest: int = max(abs(upper), abs(lower))
            most = max(span * OF_RANGE, largest * OF_VALUE)
            width = max(width, Fraction(upper - lower) / most if most else Fraction(0))
        total += max(width - 1, Fraction(0)) * count[0]
    return total / len(groups)


def shortest_names(names: Iterable[str], known: Iterable[str]) -> Mapping[str, str]:
    """The shortest ending of each name, cut at points, that no other known name has; the type of a slot is the slot's.

    >>> shortest_names(["ekf.main_loop.period", "can0.type", "a.period"], ["ekf.main_loop.period", "b.main.period"])
    {'ekf.main_loop.period': 'main_loop.period', 'can0.type': 'can0', 'a.period': 'a.period'}
    """
    every = [name.split(".") for name in {*known, *names}]
    short = {}
    for name in names:
        parts = name.split(".")
        if parts[-1] == "type":
            short[name] = ".".join(parts[:-1])
            continue
        for count in range(2, len(parts) + 1):
            if sum(other[-count:] == parts[-count:] for other in every) == 1:
                break
        short[name] = ".".join(parts[-count:]) if len(parts) > 1 else name
    return short
