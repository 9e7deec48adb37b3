"""Reads a design once: the plain model (`dse.analysis.scheduling.model`) of a space and a view of its decisions.

Only this module and what it calls (`tasks`, `messages`, `order`, `priorities`, `overheads`, first-fit) look at the
space and ask for decisions; what is computed of the model does neither.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial, reduce
from math import ceil
from operator import gt, lt
from typing import TypeAlias

from dse.analysis.binding import transmission_ns
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import (
    bus_of,
    bus_resource,
    counted_buses,
    may_wait_for,
    message_key,
    message_stage,
)
from dse.analysis.rates import NS_PER_S, arrivals, input_room, is_joined, kept_jobs, passes_rates_on, rate_hz
from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.analysis.scheduling.event_models import EventModels
from dse.analysis.scheduling.model import Entry, Release, Resource, Server, Stage, Stated, System
from dse.analysis.scheduling.order import Schedule, Turn, turns_of
from dse.analysis.scheduling.overheads import interrupting, switching_ns
from dse.analysis.scheduling.policies.successions import source_of_message
from dse.analysis.scheduling.tasks import alone_ns, elapsed_ns, task_name
from dse.analysis.views import View
from dse.space.architecture.chains import chained_to, stated_place
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, leaves
from dse.support.units import picked

Read: TypeAlias = Callable[[TaskKey], Stage]


def resolve(space: Space, view: View, wanted: Sequence[TaskKey] | None = None) -> System:
    """The system of a design; of `wanted` stages only what decides their response times.

    Raises
    ------
    NotOffered
        when the design chooses an option that is not there.
    Undecided
        when it leaves a decision open that is asked for.
    """
    counted = counted_buses(space)
    if wanted is not None and not counted:  # with buses everything may have a part in everything
        return _system_of(space, Schedule(space, view).needed(wanted), view)
    buses = [_bus(space, number, view) for number in counted]
    if _is_shared(space, view):
        processors = range(len(space.processors))
        resources = [item for number in processors for item in _RESOURCES.recall(space, number, view, _resources_on)]
        return _system(space, [*resources, *buses], view)
    cores = Schedule(space, view).all_cores()
    return _system(space, [*(resource_of(space, *core, view) for core in cores), *buses], view)


def resolve_buses(space: Space, view: View, bus: int | None = None) -> System:
    """The system of the buses of a design alone: what sends messages ends within its longest processing by itself.

    Of one bus only what decides response times of its messages.
    """
    read = partial(_in_latencies, space, reader(space, view), view)
    if bus is None:
        resources = {number: _bus(space, number, view) for number in counted_buses(space)}
    else:
        resources, todo = {}, [bus]
        while todo:
            number = todo.pop()
            resource = resources[number] = _bus(space, number, view)
            before = with_senders([entry.key for entry in resource.entries], read)
            found = [bus_of(space, one, view) for one, part in before if part == "message"]
            todo += dict.fromkeys(one for one in found if one is not None and one not in resources)
    keys = [entry.key for resource in resources.values() for entry in resource.entries]
    return System(with_senders(keys, read), tuple(resources.values()), _horizon_ns(space), space.is_traced)


def _bus(space: Space, number: int, view: View) -> Resource:
    """A bus with its messages: of whole designs that agree in what decides them one object."""
    if _is_shared(space, view):
        return _BUSES.recall(space, number, view, resource_of_bus)
    return resource_of_bus(space, number, view)


def resource_of_bus(space: Space, number: int, view: View) -> Resource:
    """A bus with its messages; identifiers that are chosen go by the jitter that messages have where nothing waits."""
    return bus_resource(space, number, view, partial(released_undelayed, space, view))


def released_undelayed(space: Space, view: View, keys: Sequence[TaskKey]) -> dict[TaskKey, Task | None]:
    """Stages as jobs where nothing waits: what releases them ends within its longest processing by itself."""
    stages = with_senders(keys, partial(_in_latencies, space, reader(space, view), view))
    events = EventModels(stages, {})
    return {key: events.task(key) for key in keys}


def source_undelayed(space: Space, number: int, view: View) -> Task | None:
    """The releases of the chain of a message's sender where nothing waits; None of one whose time is not counted so."""
    key: TaskKey = (number, "message")
    stages = with_senders([key], partial(_in_latencies, space, reader(space, view), view))
    source = source_of_message(stages, stages[key])
    return None if source is None else EventModels(stages, {}).source_task(source)


def _in_latencies(space: Space, read: Read, view: View, key: TaskKey) -> Stage:
    """A stage that ends as latencies count it where nothing delays it: within its response time, if one is stated."""
    stage = read(key)
    if key[1] != "thread":
        return stage
    return replace(stage, elapsed_ns=_within_stated(space.components[key[0]], stage.elapsed_ns, view))


def _within_stated(component: Component, elapsed: tuple[int, int], view: View) -> tuple[int, int]:
    """The shortest and longest time of a job in ns, the longest no shorter than a stated response time."""
    stated = at(component.response_ns, view)
    return elapsed if stated is None else (elapsed[0], picked("max", elapsed[1], stated[1]))


def _elapsed_ns(space: Space, number: int, view: View, *, is_on_core: bool) -> tuple[int, int]:
    """The shortest and longest time of a job until the end of a component in ns; off all cores as it is stated."""
    elapsed = elapsed_ns(space, number, view)
    return elapsed if is_on_core else _within_stated(space.components[number], elapsed, view)


def among(space: Space, groups: Iterable[Sequence[int]], view: View, *, has_buses: bool = False) -> System:
    """The system in which only these threads are there, by number, each group on a resource of its own.

    Messages wait for no bus, or (`has_buses`) for all that are counted.
    """
    resources = [resource_of(space, 0, 0, turns_of(space, group, view), view) for group in groups]
    buses = [_bus(space, number, view) for number in counted_buses(space)] if has_buses else []
    return replace(_system(space, [*resources, *buses], view), is_part=True)


def _system_of(space: Space, cores: Iterable[tuple[int, int, Sequence[Turn]]], view: View) -> System:
    """The system of these resources: processor, core and the order of the tasks of each."""
    return _system(space, [resource_of(space, *core, view) for core in cores], view)


def _system(space: Space, resources: Sequence[Resource], view: View) -> System:
    keys = [entry.key for resource in resources for entry in resource.entries]
    return System(with_senders(keys, reader(space, view)), tuple(resources), _horizon_ns(space), space.is_traced)


def with_senders(keys: Sequence[TaskKey], read: Read) -> dict[TaskKey, Stage]:
    """Stages by their keys, with all that release them and the other pieces of their threads."""
    stages: dict[TaskKey, Stage] = {}
    todo = list(keys)
    while todo:
        key = todo.pop()
        if key not in stages:
            stage = stages[key] = read(key)
            todo += [release.after for release in stage.releases if release.after is not None]
            todo += stage.pieces
            if stage.stored_by is not None:
                todo.append(stage.stored_by)
    return stages


# --- stages -----------------------------------------------------------------------------------------------------------

_STAGES: Recall[Stage] = Recall()


def _is_shared(space: Space, view: View) -> bool:
    """Whether designs that agree in what a part of them depends on share it: whole designs of mere numbers do."""
    return type(view) is View and not space.is_traced


def reader(space: Space, view: View) -> Read:
    """A function that reads a stage by its key; what designs share is one object."""
    if _is_shared(space, view):
        return lambda key: _STAGES.recall(space, key, view, stage_of)
    return lambda key: stage_of(space, key, view)


def stage_of(space: Space, key: TaskKey, view: View) -> Stage:
    """A task of a thread or device, or a message, as a stage."""
    number, part = key
    if part == "message":
        return message_stage(space, number, view)
    component = space.components[number]
    best, worst = alone_ns(component, part, view)
    is_on_core = component.processor is not None and at(component.processor, view) is not None
    found = arrivals(component, view)
    pieces = () if component.pieces is None else component.pieces.members
    joins = part == "thread" and found.by_inputs and is_joined(component, view)
    is_stored = part == "thread" and found.by_timer and is_joined(component, view)
    return Stage(
        key,
        task_name(component, part),
        best,
        worst,
        worst + (switching_ns(space, number, view) if is_on_core else 0),
        _releases_of(space, key, view),
        at(component.period_ns, view) if is_stored or (part == "thread" and found.is_separated) else None,
        tuple((item, "thread") for item in pieces),
        _elapsed_ns(space, number, view, is_on_core=is_on_core) if part == "thread" else (best, worst),
        bool(pieces) and component.executor is not None,
        _follows(space, component, view) if part == "thread" else None,
        bool(component.section_ns),
        part == "thread" and chained_to(space.components, space.connections, number) is not None,
        _rooms(space, component, view) if joins else (),
        kept_jobs(space, component, part, view),
        _stated(space, number) if part == "thread" else None,
        _longest_period_ns(space, number, view) if joins and not found.is_separated else None,
        (number, "callback") if is_stored else None,
    )


def _stated(space: Space, number: int) -> Stated | None:
    found = stated_place(space, number)
    return None if found is None else Stated(*found)


def _rooms(space: Space, component: Component, view: View) -> tuple[int | None, ...]:
    """For each trigger of a thread that needs a message of all how many of its messages wait at most."""
    return tuple(input_room(space, component, wire, view) for wire in component.triggers)


def _longest_period_ns(space: Space, number: int, view: View) -> int | None:
    """The longest period of the timers from which messages come to an event-triggered component; None without any."""
    longest: int | None = None
    todo, passed = [number], {number}
    while todo:
        for wire in space.components[todo.pop()].triggers:
            sender = space.connections[wire].source
            if sender is not None and passes_rates_on(space.components[sender], view):
                todo += {sender} - passed
                passed.add(sender)
                continue
            if sender is not None:
                period = at(space.components[sender].period_ns, view)
            else:
                rate = rate_hz(space, ("delivery", wire), view)
                period = max(1, NS_PER_S // rate) if rate else None
            if period is not None:
                longest = period if longest is None else max(longest, period)
    return longest


def _releases_of(space: Space, key: TaskKey, view: View) -> tuple[Release, ...]:
    number, part = key
    component = space.components[number]
    ways = arrivals(component, view)
    if part == "thread" and not passes_rates_on(component, view):
        return (Release(Stream(at(component.period_ns, view))),) if ways.by_timer else ()
    found: list[Release] = []
    for wire in component.triggers:
        if bus_of(space, wire, view) is not None:
            found.append(Release(None, message_key(space, wire, view)))
            continue
        least, most, _ = transmission_ns(space, space.connections[wire], view)
        sender = space.connections[wire].sender
        if sender is not None:
            found.append(Release(None, (sender, "thread"), least, most, _is_steady(space, sender, view)))
        elif rate := rate_hz(space, ("delivery", wire), view):
            is_steady = space.connections[wire].source is None
            found.append(Release(Stream(max(1, NS_PER_S // rate), most - least), is_steady=is_steady))
        elif is_joined(component, view) and part == "thread":
            return ()  # what never comes keeps all from being there
    return tuple(found)


def _is_steady(space: Space, number: int, view: View) -> bool:
    """Whether a component sends once in each period of its timer, of which it skips no release."""
    component = space.components[number]
    is_timed = arrivals(component, view).by_timer and not is_joined(component, view)
    return is_timed and component.pieces is None and kept_jobs(space, component, "thread", view) is None


def _follows(space: Space, component: Component, view: View) -> Release | None:
    found = arrivals(component, view)
    if not found.by_inputs or found.by_timer or found.is_separated or len(component.triggers) != 1:
        return None
    connection = space.connections[component.triggers[0]]
    if connection.sender is None or component.pieces is not None or may_wait_for(space, component.triggers[0]):
        return None
    sender = space.components[connection.sender]
    if sender.pieces is not None or at(sender.communication, view) == "let":
        return None
    least, most, _ = transmission_ns(space, connection, view)
    return Release(None, (connection.sender, "thread"), least, most)


# --- resources --------------------------------------------------------------------------------------------------------

_RESOURCES: Recall[tuple[Resource, ...]] = Recall(256)
_BUSES: Recall[Resource] = Recall(256)


def _resources_on(space: Space, processor: int, view: View) -> tuple[Resource, ...]:
    """The cores of a processor: of whole designs that agree in what decides their order each is one object."""
    cores = Schedule(space, view).cores(processor)
    return tuple(resource_of(space, processor, core, turns, view) for core, turns in enumerate(cores))


def resource_of(space: Space, processor: int, core: int, turns: Sequence[Turn], view: View) -> Resource:
    """A core or accelerator with the order of its tasks."""
    numbers = [turn.key[0] for turn in turns]
    executors = dict.fromkeys(turn.executor for turn in turns if turn.executor is not None)
    reservations: dict[int, int] = {}
    for turn in turns:
        if turn.reservation is not None:
            reservations.setdefault(turn.reservation, turn.key[0])
    return Resource(
        processor,
        core,
        tuple(_entry_of(turn, turns) for turn in turns),
        interrupting(space, numbers[:1], view),
        {number: at(space.executors[number].kind, view) for number in executors},
        {number: _server_of(space, number, first, view) for number, first in reservations.items()},
        at(space.processors[processor].serves, view) is not None,
    )


def _entry_of(turn: Turn, turns: Sequence[Turn]) -> Entry:
    is_inside = turn.executor is not None
    others = enumerate(turns) if is_inside else ()
    inside = [(position, other) for position, other in others if other.executor == turn.executor]
    return Entry(
        turn.key,
        turn.rank,
        tuple(turn.rivals(turns)),
        turn.blockers,
        turn.blocked_ns,
        turn.executor,
        frozenset(position for position, other in inside if turn.goes_first_inside(other)),
        bool(turn.pieces),
        tuple(turn.siblings(turns)) if turn.pieces else (),
        bool(turn.pieces) and turn.shares_turn(turns),
        turn.reservation,
        tuple(turn.outside(turns)) if turn.reservation is not None else (),
        tuple(turn.reservations(turns)),
        _with_number(turn, inside, gt),
        _with_number(turn, inside, lt),
    )


def _with_number(turn: Turn, inside: Sequence[tuple[int, Turn]], compare: Callable[[int, int], bool]) -> frozenset[int]:
    """The positions of the tasks of an executor whose priority compares so to that of a task of it, both numbers."""
    own = turn.number
    if own is None:
        return frozenset()
    return frozenset(place for place, other in inside if other.number is not None and compare(other.number, own))


def _server_of(space: Space, number: int, member: int, view: View) -> Server:
    item = space.reservations[number]
    budget, period = at(item.budget_ns, view), at(item.period_ns, view)
    return Server(item.name, budget, period, switching_ns(space, member, view))


def _horizon_ns(space: Space) -> int:
    """Ten times the longest period, in ns: response times that grow beyond it by their own jitter have no bound."""
    for components, known in _HORIZON:
        if components is space.components:
            return known
    periods = [leaf for item in space.components for leaf in leaves(item.period_ns) if leaf is not None]
    if counted_buses(space):
        rates = [leaf for item in space.connections for leaf in leaves(item.rate_hz) if leaf is not None]
        periods += [ceil(NS_PER_S / Fraction(rate)) for rate in rates]
    found: int = 10 * reduce(partial(picked, "max"), periods or [NS_PER_S])
    _HORIZON[:] = [(space.components, found)]
    return found


_HORIZON: list[tuple[tuple[Component, ...], int]] = []
"""The components that were asked about last, with their horizon."""
