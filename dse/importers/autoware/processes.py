"""Processes of nodes as threads: one for each way in which a process starts.

What starts a process is made of `periodic`, `on_input`, `on_trigger` and `once`, by `or` (a list, too) and `and`. A
timer is one way, all that is enough by itself is another one together, and so is each group of which all must be there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import TypeAlias

from dse.importers.allowance import spend
from dse.importers.autoware.entities import Part
from dse.importers.ros2.yaml_places import LocatedValue

EVENTS = ("on_input", "on_trigger")
MOST_WAYS = 64
"""The greatest number of ways in which a process starts."""
DEEPEST = 12
NS_PER_S = 10**9
Cause: TypeAlias = tuple[str, str]
"""``on_input`` or ``once`` with a port ("": none), ``on_trigger`` with a process, ``periodic`` with a rate in Hz."""
Way: TypeAlias = frozenset[Cause]
"""Causes that are all needed."""


@dataclass(eq=False)
class ThreadOfProcess:
    """A way in which a process of a node starts: a timer, events of which each is enough, or events that all must come.

    `causes` are those events, `reads` what lies there when it starts: messages that need come once only, and for a
    timer what starts the process in its other ways.
    """

    name: str
    process: str
    place: Part
    period_ns: int | None = None
    causes: tuple[Cause, ...] = ()
    joins: bool = False
    reads: tuple[Cause, ...] = ()
    outputs: tuple[str, ...] = ()


def threads_of(process: Part, connected: Sequence[str]) -> list[ThreadOfProcess]:
    """The threads of a process; `connected` are the input ports of its node that something leads to."""
    name = process.text("name")
    if not name:
        process.remark("a process without a name is left out")
        return []
    ways = _any_of(list(process.value["trigger_conditions"]), process, 0)
    once = {("on_input", port) for way in ways for kind, port in way if kind == "once" and port}
    ways = list(dict.fromkeys(frozenset(one for one in way if one[0] != "once") for way in ways))
    ways = [way for way in ways if way and not any(other < way for other in ways if other)]
    known = [way for way in ways if all(kind != "on_input" or port in connected for kind, port in way)]
    if not known and ways:
        known = ways  # from outside, all of it
    if not known:
        process.remark(f"{name} is left out: it runs once, or nothing says when")
        return []
    outputs = tuple(item["to_output"].text for item in process.value["outcomes"] if item["to_output"].text)
    threads = [_of_way(name, process, way) for way in known if len(way) > 1]
    single = tuple(sorted(cause for way in known if len(way) == 1 for cause in way if cause[0] in EVENTS))
    if single:
        threads.insert(0, ThreadOfProcess(name, name, process, causes=single))
    for way in known:
        if len(way) == 1 and next(iter(way))[0] == "periodic":
            threads.append(_of_way(name, process, way))
    events = {cause for one in threads for cause in one.causes}
    for number, one in enumerate(threads):
        one.reads = tuple(sorted(once if one.causes else once | events))
        one.outputs = outputs
        if number:
            one.name = f"{name}/periodic" if one.period_ns is not None and not one.causes else f"{name}/all"
    if len(threads) > 1:
        process.remark(f"{name} starts in {len(threads)} ways: it counts as a thread for each")
    return threads


def _of_way(name: str, process: Part, way: Way) -> ThreadOfProcess:
    periods = [_period_ns(rate) for kind, rate in sorted(way) if kind == "periodic"]
    causes = tuple(sorted(cause for cause in way if cause[0] in EVENTS))
    joins = len(causes) > 1 or bool(causes and periods)
    return ThreadOfProcess(name, name, process, max(periods, default=None), causes, joins)


def _any_of(items: Sequence[LocatedValue], process: Part, depth: int) -> list[Way]:
    """The ways of a list, each of whose entries is enough."""
    return [way for item in items for way in _ways(item, process, depth + 1)][:MOST_WAYS]


def _ways(item: LocatedValue, process: Part, depth: int) -> list[Way]:
    """The ways of a condition."""
    spend()
    if depth > DEEPEST or not isinstance(item.data, dict):
        Part(item, process.file).remark("a condition is left out: it is none, or nested too deeply")
        return []
    ways: list[Way] = []
    for kind, value in item.data.items():
        if kind == "or":
            ways += _any_of(list(value), process, depth)
        elif kind == "and":
            parts = [_ways(one, process, depth + 1) for one in value]
            for choice in product(*(part for part in parts if part)) if any(parts) else ():
                spend()
                ways.append(frozenset[Cause]().union(*choice))
                if len(ways) >= MOST_WAYS:
                    Part(value, process.file).remark(f"of a condition the first {MOST_WAYS} ways count")
                    break
        elif kind == "once" or (kind in EVENTS and value.text) or (kind == "periodic" and _period_ns(value.text)):
            ways.append(frozenset({(kind, value.text)}))
        elif kind in (*EVENTS, "periodic"):
            Part(value, process.file).remark(f"a condition is left out: `{kind}` without what it needs")
    return ways


def _period_ns(rate: str) -> int:
    """The period of a rate in Hz, in whole ns; 0 of what is no rate."""
    try:
        hertz = Fraction(rate) if len(rate) < 30 and "e" not in rate.lower() else Fraction(0)
    except (ValueError, ZeroDivisionError):
        return 0
    return round(NS_PER_S / hertz) if Fraction(1, 10**6) <= hertz <= NS_PER_S else 0
