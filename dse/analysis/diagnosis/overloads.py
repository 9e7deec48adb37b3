"""Who uses a processor or core beyond its limit, and which threads have no bound because of that.

The shares are those of the utilisation (docs/semantics.md, section 4.1), on the cores that the design has (4.2). Where
these are not given, and no partition keeps the limit, threads are named that have none by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Annotated

from dse.analysis.binding import own_core
from dse.analysis.diagnosis.lateness import Late
from dse.analysis.diagnosis.shortening import Shorter
from dse.analysis.limits import HOLDS, Limit, Verdict, build_limit, too_many
from dse.analysis.measures import exact_sum
from dse.analysis.placement.first_fit import core_of_each
from dse.analysis.placement.partition import core_count, given_cores
from dse.analysis.scheduling.tasks import longest_alone_ns, members, task_keys, utilisation
from dse.analysis.scheduling.waits import told_name
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at

KINDS = ("utilisation", "core utilisation")
"""The metrics of processors whose limits are told of."""
OF_BUSES = ("load", "busy")
"""Kinds of metrics of buses."""


@dataclass(frozen=True)
class Use:
    """The share of a core that one thread uses, or the share of a bus that one connection uses.

    Shares are exact, in ppm.
    """

    thread: Annotated[str, "The thread, or the connection."]
    share_ppm: Annotated[Fraction, "Its share of the core or the bus, in ppm."]


@dataclass(frozen=True)
class Overload:
    """A core or bus that is used beyond a limit, or threads that have no partition which keeps it.

    Where `is_served` the core has no number to anybody. The threads of `executor` break the limit by themselves though
    others use the core, too, or other cores are there.
    """

    requirement: Annotated[str, "The limit, in the words of the problem."]
    processor: Annotated[str, "The processor, accelerator or bus."]
    core: Annotated[int, "The core, from 1; 0 where threads have no core yet and no partition keeps the limit."]
    cores: Annotated[int, "How many cores the processor has."]
    is_served: bool
    limit_ppm: Annotated[Fraction, "How much of each core may be used, in ppm of it."]
    total_ppm: Annotated[Fraction, "What the threads use together, in ppm of one core."]
    uses: Annotated[
        tuple[Use, ...],
        "The threads, those that use most first; without a core those that have no partition, of which none can be "
        "left out.",
    ]
    unbounded: Annotated[tuple[str, ...], "The late threads that have no bound because of it."] = ()
    shorter: Annotated[tuple[Shorter, ...], "Each of these would keep the limit by itself; empty without a core."] = ()
    executor: Annotated[
        str, "An executor whose threads, which share a core, break the limit by themselves; empty where none do."
    ] = ""


def overloads(space: Space, verdicts: Sequence[Verdict], view: View, late: Sequence[Late] = ()) -> Iterator[Overload]:
    """The cores that break upper limits on utilisation, in the order of these; `late` are the threads that are.

    One `Overload` for each core or bus, with the lowest of its limits, the users by share, and the late threads on it.
    """
    by_place: dict[tuple[str, int], Overload] = {}
    for verdict in verdicts:
        metric = verdict.requirement.metric
        if verdict.holds or not verdict.requirement.is_upper:
            continue
        if metric.kind in OF_BUSES:
            yield from _on_bus(space, build_limit(space, verdict.requirement), view)
        if metric.kind in KINDS:
            for item in _on_processor(space, build_limit(space, verdict.requirement), view, late):
                before = by_place.setdefault((item.processor, item.core), item)
                if item.limit_ppm < before.limit_ppm:  # of several limits on a core the lowest tells all
                    by_place[item.processor, item.core] = item
    yield from by_place.values()


def _on_processor(space: Space, limit: Limit, view: View, late: Sequence[Late]) -> Iterator[Overload]:
    metric = limit.requirement.metric
    processor = metric.index or 0
    used = {number: utilisation(space, number, view) for number in members(space, processor, view)}
    units = [space.unit(number, view) for number in used]
    if limit.cores is not None and given_cores(space, processor, units, view) is None:
        full = list(_on_given_cores(space, limit, used, view, late))
        yield from full
        if full:
            return
        names = too_many(limit, view)
        left = {
            number: share
            for (number, share), unit in zip(used.items(), units, strict=True)
            if {space.components[number].name, space.components[unit].name} & {*names}
        }
        yield _made(space, limit, 0, left, view, late)
        return
    cores = core_of_each(space, processor, view)
    for core in [int(metric.key)] if metric.key else sorted(set(cores.values())):
        here = {number: share for number, share in used.items() if cores[number] == core}
        if not HOLDS[limit.requirement.operator](exact_sum(here.values()) * PPM, _most(limit)):
            yield _made(space, limit, core, here, view, late)


def _on_bus(space: Space, limit: Limit, view: View) -> Iterator[Overload]:
    """A bus that is used beyond a limit, and by which connections; nothing where its bandwidth is not known."""
    bus = space.buses[limit.requirement.metric.index or 0]
    bandwidth = at(bus.bandwidth_bps, view)
    if limit.requirement.metric.kind == "load" and not bandwidth:
        return
    whole = Fraction(bandwidth) / 8 if limit.requirement.metric.kind == "load" else Fraction(PPM)
    parts: dict[str, Fraction] = {}
    for term in limit.measure.terms:
        parts[term.label] = parts.get(term.label, Fraction(0)) + term.value(view) / whole * PPM
    uses = sorted((Use(name, share) for name, share in parts.items() if share), key=lambda item: -item.share_ppm)
    most, total = limit.bound(view) / whole * PPM, exact_sum(parts.values())
    yield Overload(limit.requirement.shown, bus.name, 1, 1, True, most, total, tuple(uses))


def _on_given_cores(
    space: Space, limit: Limit, used: Mapping[int, Fraction], view: View, late: Sequence[Late]
) -> Iterator[Overload]:
    """The cores that are used too much by those alone that are stated or decided to run there."""
    count = core_count(space, limit.requirement.metric.index or 0, view)
    own = {number: own_core(space, space.unit(number, view), view, count) for number in used}
    for core in sorted({core for core in own.values() if core is not None}):
        here = {number: share for number, share in used.items() if own[number] == core}
        if not HOLDS[limit.requirement.operator](exact_sum(here.values()) * PPM, _most(limit)):
            yield _made(space, limit, core, here, view, late)


def _most(limit: Limit) -> Fraction:
    """The largest utilisation of a core that a limit admits, in ppm."""
    return limit.cores.most if limit.cores is not None else limit.requirement.limit.value * PPM


def _made(
    space: Space, limit: Limit, core: int, used: Mapping[int, Fraction], view: View, late: Sequence[Late]
) -> Overload:
    """The overload of a core, or of a set of threads without partition, from the shares of threads by number."""
    slot = space.processors[limit.requirement.metric.index or 0]
    shares: dict[str, Fraction] = {}
    for number, share in used.items():
        name = space.components[number].stated_as
        shares[name] = shares.get(name, Fraction(0)) + share * PPM
    uses = sorted((Use(name, share) for name, share in shares.items() if share), key=lambda item: -item.share_ppm)
    return Overload(
        limit.requirement.shown, slot.name, core, at(slot.cores, view), at(slot.serves, view) is not None, _most(limit),
        exact_sum(shares.values()), tuple(uses), tuple(_because_of(slot.name, core, late)) if core else (),
        tuple(_shorter(space, limit, used, view)) if core else (),
        _full_executor(space, limit, used, view) if core else "",
    )  # fmt: skip


def _full_executor(space: Space, limit: Limit, used: Mapping[int, Fraction], view: View) -> str:
    """The executor whose threads alone use more of a core than a limit lets them; "" for none."""
    shares: dict[int, list[Fraction]] = {}
    for number, share in used.items():
        executor = at(space.components[number].executor, view)
        if executor is not None and at(space.processors[limit.requirement.metric.index or 0].serves, view) is None:
            shares.setdefault(executor, []).append(share)
    for executor, parts in shares.items():
        if len(parts) > 1 and not HOLDS[limit.requirement.operator](exact_sum(parts) * PPM, _most(limit)):
            return space.executors[executor].name
    return ""


def _because_of(processor: str, core: int, late: Sequence[Late]) -> dict[str, None]:
    """The threads that have no bound because more than all of a core is needed, or because such a thread has none."""
    unbounded = dict.fromkeys(
        item.thread
        for item in late
        if item.full is not None and (item.full.processor, item.full.core) == (processor, core)
    )
    while more := [item.thread for item in late if item.thread not in unbounded and unbounded.keys() & {*item.endless}]:
        unbounded |= dict.fromkeys(more)
    return dict.fromkeys(item.thread for item in late if item.thread in unbounded)


def _shorter(space: Space, limit: Limit, used: Mapping[int, Fraction], view: View) -> Iterator[Shorter]:
    """The least cuts of single threads or pieces with which a core keeps a limit."""
    beyond = exact_sum(used.values()) - _most(limit) / PPM
    for number, share in used.items():
        keys = list(task_keys(space, number, view))
        if len(keys) != 1 or not share:
            continue
        longest = longest_alone_ns(space, number, keys[0][1], view)
        exact = beyond * longest / share
        by_ns = floor(exact) + 1 if limit.requirement.operator == "<" else ceil(exact)
        if by_ns < longest:
            yield Shorter(told_name(space, keys[0]), by_ns)
