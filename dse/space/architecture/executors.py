"""Executors and reservations: OS threads that run the jobs of several threads, one at a time, and shares of cores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from dse.space.architecture.clocks import AT_RELEASE
from dse.space.architecture.processors import read_named
from dse.space.architecture.segments import accelerator
from dse.space.model.space import Component, Executor, Processor, Reservation
from dse.space.model.trees import Choice, Tree, graft, leaves
from dse.space.properties import FieldReader, Ledger, Owner
from dse.space.question.open_cores import check_core, cores_named, the_core, where_there_is_one
from dse.spec.kinds import POLLING
from dse.spec.schema.model import Spec
from dse.support.units import format_duration, shown

WHERE = ("processor", "figures_of", "core")
"""Fields that state where a thread runs that is in no executor and no reservation."""


@dataclass(frozen=True)
class Home:
    """The place of the threads of an executor or a reservation: a tree of processors, and the stated core.

    Executor and reservation are numbers, None where there is none.
    """

    processor: Tree
    core: Tree
    executor: Tree = None
    reservation: int | None = None


@dataclass(frozen=True)
class Homes:
    """The homes of executors and of reservations by name."""

    executors: Mapping[str, Home]
    reservations: Mapping[str, Home]


def build_homes(ledger: Ledger, spec: Spec, processors: Sequence[Processor]) -> Homes:
    """The home of each executor and reservation: a decision about it is one for all of its threads.

    In the order of the file; an executor in a reservation takes the reservation's home.
    """
    reservations = {
        name: replace(_home(ledger, processors, "reservations", name, given), reservation=index)
        for index, (name, given) in enumerate(spec.reservations.items())
    }
    executors = {}
    for index, (name, given) in enumerate(spec.executors.items()):
        home = _reserved(ledger, reservations, ("executors", name), given, ("processor", "core"))
        if home is None:
            if given.processor is None and given.reservation is None:
                ledger.error(("executors", name), "missing key `processor`", "or name its `reservation`")
                ledger.doubt(name)
            home = _home(ledger, processors, "executors", name, given)
        executors[name] = replace(home, executor=index)
    return Homes(executors, reservations)


def _home(ledger: Ledger, processors: Sequence[Processor], section: str, name: str, given: Any) -> Home:
    slots = {slot.name: number for number, slot in enumerate(processors)}
    processor: Tree = None
    if given.processor:
        processor = read_named(ledger, name, "processor", (section, name, "processor"), given.processor, slots)
    path = (section, name, "core")
    named = cores_named(ledger, processors, path, processor, given.core or ())
    core = the_core(named)
    check_core(ledger, processors, path, processor, named)
    for leaf in leaves(processor):
        if leaf is not None and processors[leaf].serves is not None:
            what = f"no {section[:-1]} runs there" if section == "executors" else "no share of it can be reserved"
            message = f"{shown(processors[leaf].name)} serves one job at a time by itself: {what}"
            ledger.error((section, name, "processor"), message)
            break
    return Home(processor, core)


def _reserved(
    ledger: Ledger, homes: Mapping[str, Home], path: tuple[str, str], given: Any, said: Sequence[str]
) -> Home | None:
    """The home of a thread or executor in a reservation; None for one in none, or in one that there is not."""
    if given.reservation is None:
        return None
    if given.reservation not in homes:
        ledger.unknown((*path, "reservation"), "reservation", given.reservation, homes)
        ledger.doubt(path[1], f"{path[1]}.processor")
        return None
    for field_name in said:
        if getattr(given, field_name) is not None:
            ledger.error((*path, field_name), "the reservation says where its threads run: state it there")
    return homes[given.reservation]


def served_by(ledger: Ledger, spec: Spec, processors: Sequence[Processor], name: str, processor: Tree) -> int | None:
    """The executor that serves the jobs of a thread on an accelerator; None where it runs on none.

    The number that the accelerator has among the executors. Choosing between an accelerator and other processors is a
    mistake.
    """
    slots = dict.fromkeys(leaf for leaf in leaves(processor) if leaf is not None)
    served = [slot for slot in slots if processors[slot].serves is not None]
    if not served:
        return None
    if len(slots) > 1:
        one = shown(processors[served[0]].name)
        message = f"{one} serves one job at a time: whether a thread runs there is no decision"
        ledger.error(("threads", name, "processor"), message, "name one processor")
    return accelerator(processors, spec, served[0])


def home_of(ledger: Ledger, homes: Homes, name: str, given: Any) -> Home | None:
    """The home of a thread in an executor or a reservation; None for one in none, or in one that there is not.

    A thread in an executor must not state a processor, core or reservation of its own; that goes to `ledger`.
    """
    if given.executor is None:
        return _reserved(ledger, homes.reservations, ("threads", name), given, WHERE)
    path = ("threads", name, "executor")
    index = {one: number for number, one in enumerate(homes.executors)}
    executor = read_named(ledger, name, "executor", path, given.executor, index)
    known = [one for one in given.executor if one in index]
    if not known or any(map(ledger.is_doubtful, known)):
        ledger.doubt(f"{name}.processor")
    for field_name in (*WHERE, "reservation"):
        if getattr(given, field_name) is not None:
            ledger.error(("threads", name, field_name), "the executor says where its threads run: state it there")
    if not known:
        return None
    found = list(homes.executors.values())
    if not isinstance(executor, Choice):
        return found[executor]
    reserved = next((one for one in known if homes.executors[one].reservation is not None), None)
    if reserved is not None:
        message = f"{shown(reserved)} has a reservation: whether a thread runs there is no decision"
        ledger.error(path, message, "name one executor")
    where = graft(executor, lambda number: found[number].processor)
    share = None if reserved is None else homes.executors[reserved].reservation
    return Home(where, graft(executor, lambda number: found[number].core), executor, share)


def build_executors(
    ledger: Ledger,
    spec: Spec,
    processors: Sequence[Processor],
    homes: Mapping[str, Home],
    components: Sequence[Component],
) -> tuple[Executor, ...]:
    """Every executor with its threads; behind them the accelerators, which serve jobs as executors do.

    `Executor` objects in the order of `homes`, with members as component indices; an executor without threads is a
    mistake.
    """
    named = {name for item in spec.threads.values() for name in item.executor or ()}
    is_whole = named <= set(homes) and ledger.loaded.remains.is_whole
    found = []
    for index, (name, home) in enumerate(homes.items()):
        given, path = spec.executors[name], ("executors", name)
        owner = Owner(name, path, given)
        kind = FieldReader(ledger, owner, "kind", "rule", str).read(lambda model: model.kind)
        priority = FieldReader(ledger, owner, "priority", "count", str).read(lambda model: model.priority)
        members = tuple(number for number, item in enumerate(components) if home.executor in set(leaves(item.executor)))
        if not members and is_whole:
            ledger.error(path, "no thread runs in this executor")
        for number in members:
            stated_as = components[number].stated_as
            thread = spec.threads[stated_as]
            if thread.priority is not None and not {"callback_group", POLLING} & set(given.kind):
                message = f"a {given.kind[0]} executor knows no priorities among its threads"
                ledger.error(("threads", stated_as, "priority"), message, "state that of the executor")
            if POLLING in given.kind and AT_RELEASE & set(leaves(components[number].communication)):
                message = (
                    f"jobs of an executor that polls read when they begin, those of {shown(stated_as)} at their release"
                )
                ledger.error((*path, "kind"), message, "leave its `communication` out, or take another kind")
        is_open = any(isinstance(components[number].executor, Choice) for number in members)
        for field_name in ("kind", "priority", "processor") if is_open else ():
            ledger.narrow(f"{name}.{field_name}", partial(where_there_is_one, components, members, index))
        found.append(Executor(name, kind, members, priority, is_open, home.processor, home.core))
    for number, slot in enumerate(processors):
        served = accelerator(processors, spec, number)
        if served is not None:
            members = tuple(at for at, item in enumerate(components) if item.executor == served)
            kind = graft(slot.serves, lambda order: "fifo" if order == "fifo" else "callback_group")
            found.append(Executor(slot.name, kind, members))
    return tuple(found)


def build_reservations(
    ledger: Ledger, spec: Spec, homes: Homes, components: Sequence[Component]
) -> tuple[Reservation, ...]:
    """Every reservation with its threads, those of executors in it among them.

    `Reservation` objects in the order of the file; a budget above its period is a mistake.
    """
    named = {item.reservation for item in spec.threads.values()} - {None}
    named |= {item.reservation for item in spec.executors.values()} - {None}
    is_whole = named <= set(homes.reservations) and ledger.loaded.remains.is_whole
    found = []
    for name, home in homes.reservations.items():
        path = ("reservations", name)
        owner = Owner(name, path, spec.reservations[name])
        budget = FieldReader(ledger, owner, "budget", "duration", format_duration).read(lambda model: model.budget)
        period = FieldReader(ledger, owner, "period", "duration", format_duration).read(lambda model: model.period)
        priority = FieldReader(ledger, owner, "priority", "count", str).read(lambda model: model.priority)
        most, least = max(leaves(budget)), min(leaves(period))
        if most > least:
            message = (
                f"a budget of {format_duration(most)} in each {format_duration(least)}: there is no more than that"
            )
            ledger.error((*path, "budget"), message)
        members = tuple(number for number, item in enumerate(components) if item.reservation == home.reservation)
        if not members and is_whole:
            ledger.error(path, "no thread runs in this reservation")
        for number in members:
            if any(leaf is not None for leaf in leaves(components[number].section_ns)):
                thread = components[number].name
                message = f"in a reservation nothing is non-preemptive: the budget of {shown(name)} may end inside"
                ledger.error(("threads", thread, "non_preemptive"), message, "leave it out")
        found.append(Reservation(name, members, budget, period, priority))
    return tuple(found)
