"""Processor and bus slots: their types, and the figures that follow from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from dse.space.buses import carrying
from dse.space.frames import FLEXRAY_MOST, LEAST_MTU, MOST_MTU, frame_of
from dse.space.hosts import Interference
from dse.space.properties import FieldReader, Ledger, Owner, Path, per_processor_type, stated, type_choice
from dse.space.trees import FROM_BANDWIDTH, Choice, Tree, graft, leaves
from dse.space.types import EMPTY, UNKNOWN_TYPE, Bus, Figures, Processor
from dse.spec.frames import CanFdFrame, EthernetFrame, FlexrayFrame, FrameModel
from dse.spec.hardware import FROM_BANDWIDTH as IN_WORDS
from dse.spec.hardware import BusType
from dse.spec.model import Spec
from dse.units import (
    format_bandwidth,
    format_duration,
    format_money,
    format_power,
    format_size,
    format_time_range,
    format_total,
    shown,
)

THROTTLING = "throttling"
"""What reports call the time that an operating system takes from threads."""


def known_types(
    ledger: Ledger, path: Path, what: str, names: Sequence[str], catalogue: Mapping[str, Any]
) -> list[tuple[str, Any]]:
    """The types that `names` means; one that is not in the catalogue leaves its slot or component in doubt."""
    for position, name in enumerate(names):
        if name not in catalogue:
            ledger.unknown((*path, "type", position), what, name, catalogue)
            ledger.doubt(str(path[1]))
            ledger.doubt_types(catalogue)
    return [(name, catalogue[name]) for name in names if name in catalogue]


def read_figures(ledger: Ledger, owner: Owner, totals: Mapping[str, str]) -> Figures:
    """Price, power and declared totals of an owner."""
    readers = {
        "price": FieldReader(ledger, owner, "price", "money", format_money),
        "power": FieldReader(ledger, owner, "power", "power", format_power),
    }
    price = readers["price"].read(lambda model: model.price)
    power = readers["power"].read(lambda model: model.power)
    more = {}
    for key in totals:
        reader = FieldReader(ledger, owner, f"totals.{key}", "total", format_total)
        tree = reader.read(lambda model, key=key: model.totals.get(key))  # type: ignore[misc]
        if tree is not None:
            more[key] = graft(tree, lambda total: None if total is None else total.value)
    return Figures(graft(price, lambda money: None if money is None else money.cents), power, more)


def _slot(ledger: Ledger, path: Path, name: str, types: Sequence[tuple[str, Any]], optional: bool) -> tuple[Any, Owner]:
    """The type decision of a slot and an owner whose fields follow from it; an empty slot has no figures."""
    names = tuple(type_name for type_name, _ in types)
    options = (EMPTY, *names) if optional else names
    decision = ledger.decide(name, "type", "type", options, str)
    home = Choice(decision, options)
    ledger.settle(decision, home)
    ledger.refer(f"{name}.type", "type", home, {option: option for option in options})
    nothing = [(EMPTY, _Nothing())] if optional else []
    catalogue: Path = (f"{'processor' if path[0] == 'processors' else 'bus'}_types",)
    return (options, decision), Owner(name, path, None, [*nothing, *types], catalogue, decision)


class _Nothing:
    """The figures of an empty slot: none."""

    totals: Mapping[str, Any] = {}

    def __getattr__(self, name: str) -> None:
        return None


UNKNOWN = ((UNKNOWN_TYPE, _Nothing()),)


def groups_of(model: Any) -> tuple[tuple[str, int], ...]:
    """The groups of cores of a processor type, with the number of cores of each; none where all cores are equal."""
    given = getattr(model, "cores", None)
    return tuple(given.items()) if isinstance(given, Mapping) else ()


def _all_cores(model: Any) -> Any:
    """How many cores a processor type has, in all groups together."""
    groups = groups_of(model)
    return (sum(count for _, count in groups),) if groups else stated(model, "cores")


def build_processor(ledger: Ledger, spec: Spec, name: str) -> Processor:
    """The processor slot called `name`."""
    given, path = spec.processors[name], ("processors", name)
    types = known_types(ledger, path, "processor type", given.type, spec.processor_types)
    (options, decision), owner = _slot(ledger, path, name, types or UNKNOWN, given.optional)
    cores = FieldReader(ledger, owner, "cores", "count", str).read(_all_cores)
    levels = FieldReader(ledger, owner, "priority_levels", "count", str).read(lambda model: model.priority_levels)
    figures = read_figures(ledger, owner, spec.totals)
    count = graft(cores, lambda found: found or 0)
    switch = FieldReader(ledger, owner, "context_switch", "duration", format_duration)
    return Processor(
        name=name,
        types=options,
        type_decision=decision,
        optional=given.optional,
        figures=figures,
        cores=count,
        overload=given.overload is not None,
        priority_levels=levels,
        groups={type_name: groups for type_name, model in owner.types if (groups := groups_of(model))},
        switch_ns=graft(switch.read(lambda model: model.context_switch), lambda found: 0 if found is None else found),
        interference=type_choice(decision, [_interference(model) for _, model in owner.types]),
        serves=_service(ledger, path, owner),
    )


def _service(ledger: Ledger, path: Path, owner: Owner) -> Tree:
    """In which order each type of a slot serves jobs where it is an accelerator; None where it is none."""
    given = {name: model for name, model in owner.types if name not in (EMPTY, UNKNOWN_TYPE)}
    served = {name: model.serves for name, model in given.items() if model.serves is not None}
    if not served:
        return None
    for name, model in given.items():
        if name not in served:
            one = shown(next(iter(served)))
            ledger.error((*path, "type"), f"{one} serves one job at a time, {shown(name)} does not: no slot has both")
        elif model.cores != (1,):
            ledger.error(("processor_types", name, "serves"), "serves one job at a time, but has several cores")
    first = next(iter(served.values()))
    return type_choice(owner.type_decision, [served.get(name, first) for name, _ in owner.types])


def _interference(model: Any) -> tuple[Interference, ...]:
    """What a processor type takes from its threads; throttling is a gap at the end of each period of it."""
    found = [
        Interference(name, item.compute_execution_time.max_ns, item.period)
        for name, item in (model.interrupts or {}).items()
    ]
    throttling = model.throttling
    if throttling is not None and throttling.budget < throttling.period:
        found.append(
            Interference(THROTTLING, throttling.period - throttling.budget, throttling.period, is_throttling=True)
        )
    return tuple(found)


def check_overheads(ledger: Ledger, spec: Spec) -> None:
    """Interrupts and throttling leave something of a core to threads, in every type that is used."""
    for type_name in {name: None for slot in spec.processors.values() for name in slot.type}:
        model = spec.processor_types.get(type_name)
        if model is None:
            continue
        path = ("processor_types", type_name)
        throttling = model.throttling
        if throttling is not None and throttling.budget > throttling.period:
            ledger.error((*path, "throttling", "budget"), "the budget is longer than its period")
        elif throttling is not None and throttling.budget == 0:
            ledger.error((*path, "throttling", "budget"), "a budget of nothing leaves no time to threads")
        elif sum(Fraction(item.worst_ns, item.period_ns) for item in _interference(model)) >= 1:
            ledger.error(path, "interrupts and throttling leave nothing of a core to threads")


def build_buses(ledger: Ledger, spec: Spec) -> tuple[Bus, ...]:
    """The bus slots, then the virtual bus types that are used directly, in the order of first use."""
    used = [name for item in spec.connections.values() for name in item.bus or ()]
    used += [name for item in spec.buses.values() for name in item.bus or ()]
    used += [name for wire in spec.connections.values() for name in (*wire.further_buses, *wire.protocols)]
    used += [name for bus in spec.buses.values() for name in bus.further_buses]
    used += [name for kind in spec.bus_types.values() for name in kind.protocols]
    direct = [
        name
        for name in dict.fromkeys(used)
        if name not in spec.buses and name in spec.bus_types and spec.bus_types[name].virtual
    ]
    names = [*spec.buses, *direct]
    index = {name: number for number, name in enumerate(names)}
    buses = tuple(_bus(ledger, spec, name, index) for name in names)
    _check_carriers(ledger, buses)
    return buses


def _bus(ledger: Ledger, spec: Spec, name: str, index: Mapping[str, int]) -> Bus:
    given = spec.buses.get(name)
    path: Path = ("buses", name) if given else ("bus_types", name)
    optional = given.optional if given else False
    types = (
        known_types(ledger, path, "bus type", given.type, spec.bus_types) if given else [(name, spec.bus_types[name])]
    )
    if len({model.virtual for _, model in types}) > 1:
        ledger.error((*path, "type"), "a slot takes either buses or virtual buses, not both")
    virtual = bool(types) and types[0][1].virtual
    (options, decision), owner = _slot(ledger, ("buses", name), name, types or UNKNOWN, optional)
    read = _bus_reader(ledger, owner, virtual)
    bandwidth = read("bandwidth", "bandwidth", format_bandwidth, lambda model: model.bandwidth)
    fixed, per_byte = (_transmission_part(ledger, owner, part, virtual) for part in ("fixed", "per_byte"))
    latency = read("latency", "time range", format_time_range, lambda model: model.latency)
    overhead = read("overhead", "data size", format_size, lambda model: stated(model, "overhead"))
    carrier = None
    if given and given.bus:
        if types and not virtual:
            ledger.error((*path, "bus"), "only a virtual bus is carried by another bus")
        carrier = read_named(ledger, name, "bus", (*path, "bus"), given.bus, index)
        carrier = type_choice(decision, [None if option == EMPTY else carrier for option in options])
        ledger.settle(decision_of(ledger, f"{name}.bus"), carrier)
        reference = ledger.references.get(f"{name}.bus")
        if reference is not None:
            ledger.references[reference.name] = replace(reference, tree=carrier)
    figures = read_figures(ledger, owner, spec.totals)
    overhead = graft(overhead, lambda size: size or 0)
    return Bus(
        name=name,
        types=options,
        type_decision=decision,
        optional=optional,
        figures=figures,
        virtual=virtual,
        bandwidth_bps=bandwidth,
        fixed_ns=fixed,
        per_byte_ns=per_byte,
        latency_ns=latency,
        overhead_bytes=overhead,
        carrier=carrier,
        direct=given is None,
        broadcast=type_choice(decision, [bool(model.broadcast) for _, model in owner.types]),
        exclusive=type_choice(decision, [bool(model.exclusive) for _, model in owner.types]),
        overload=given is not None and given.overload is not None,
        period_ns=read("period", "duration", format_duration, lambda model: model.period),
        further=read_further(ledger, spec, path, given, index),
        budget=given.budget if given is not None else None,
        protocols=type_choice(
            decision, [read_protocols(ledger, spec, ("bus_types", key), model, index) for key, model in owner.types]
        ),
    )


def read_further(ledger: Ledger, spec: Spec, path: Path, given: Any, index: Mapping[str, int]) -> tuple[int, ...]:
    """The further buses that carry a connection or virtual bus, all at once."""
    names = given.further_buses if given is not None else ()
    if names and not given.bus:
        ledger.error((*path, "further_buses"), "`further_buses` carry what `bus` carries: name that too")
    found = []
    for position, name in enumerate(names):
        if name not in index:
            ledger.unknown((*path, "further_buses", position), "bus", name, index)
        elif name in spec.buses and spec.buses[name].optional:
            message = f"{shown(name)} may stay empty: of several buses at once each must be there"
            ledger.error((*path, "further_buses", position), message)
        else:
            found.append(index[name])
    return tuple(dict.fromkeys(found))


def read_protocols(ledger: Ledger, spec: Spec, path: Path, given: Any, index: Mapping[str, int]) -> tuple[int, ...]:
    """The types of virtual buses that wrap messages without being bound."""
    known = {name: index[name] for name, model in spec.bus_types.items() if model.virtual and name in index}
    for position, name in enumerate(given.protocols or ()):
        if name not in known:
            ledger.unknown((*path, "protocols", position), "type of virtual bus", name, known)
    return tuple(known[name] for name in given.protocols or () if name in known)


def _bus_reader(ledger: Ledger, owner: Owner, virtual: bool) -> Callable[..., Tree]:
    by_type = per_processor_type if virtual else _nothing_known

    def read(name: str, kind: str, write: Callable[[Any], str], given_by: Callable[[Any], Any]) -> Tree:
        return FieldReader(ledger, owner, name, kind, write, by_type).read(given_by)

    return read


def _nothing_known(subtrees: Mapping[str, Tree], path: Path) -> Tree:
    """Figures per processor type of a bus that is not virtual: `check_bus_types` reports them."""
    return None


def _transmission_part(ledger: Ledger, owner: Owner, part: str, virtual: bool) -> Tree:
    """One part of the transmission time: leaves are time ranges, `PerProcessorType`, or None where a type has none."""

    def given_by(model: Any) -> Any:
        times = model.transmission_time
        if isinstance(times, Mapping):
            return {key: getattr(value, part) for key, value in times.items()}
        return None if times is None or times == IN_WORDS else stated(model, part, times)

    by_type = per_processor_type if virtual else _nothing_known
    reader = FieldReader(ledger, owner, f"transmission_time.{part}", "transmission time", format_time_range, by_type)
    tree = reader.read(given_by)
    branches = tree.branches if len(owner.types) > 1 else [tree]
    known = zip(owner.types, branches, strict=True)
    return type_choice(
        owner.type_decision,
        [branch if _in_words(model) is None else _in_words(model) for (_, model), branch in known],
    )


def _in_words(model: BusType) -> Any:
    """Of a transmission time that is not stated in figures, what stands for it in both of its parts; else None."""
    if model.frame is not None:
        return frame_of(model.frame)
    return FROM_BANDWIDTH if model.transmission_time == IN_WORDS else None


def check_bus_types(ledger: Ledger, spec: Spec) -> None:
    """Figures per processor type belong to virtual buses and name known processor types; in every type that is used."""
    used = {name for bus in spec.buses.values() for name in bus.type}
    used |= {name for connection in spec.connections.values() for name in connection.bus or ()}
    used |= {name for bus in spec.buses.values() for name in bus.bus or ()}
    for type_name, model in spec.bus_types.items():
        if type_name in used and model.virtual and model.exclusive:
            message = "only a physical bus is exclusive: middleware runs on many cores"
            ledger.error(("bus_types", type_name, "exclusive"), message)
        if type_name in used and model.transmission_time == IN_WORDS and model.bandwidth is None:
            ledger.error(("bus_types", type_name, "transmission_time"), f'"{IN_WORDS}" needs a `bandwidth`')
        if type_name in used and model.frame is not None:
            for field, message in _frame_mistakes(model, model.frame):
                ledger.error(("bus_types", type_name, field), message)
        for field_name in ("transmission_time", "latency"):
            given = getattr(model, field_name)
            if type_name not in used or not isinstance(given, Mapping):
                continue
            path = ("bus_types", type_name, field_name)
            if not model.virtual:
                ledger.error(path, "only a virtual bus has figures per processor type")
            for processor_type in given:
                if processor_type not in spec.processor_types:
                    place = (*path, processor_type)
                    ledger.unknown(place, "processor type", processor_type, spec.processor_types, at_key=True)


def _check_carriers(ledger: Ledger, buses: Sequence[Bus]) -> None:
    """A virtual bus must not carry itself, directly or through others."""
    for start, bus in enumerate(buses):
        seen: set[int] = set()
        frontier = {start}
        while frontier:
            frontier = {leaf for item in frontier for leaf in carrying(buses[item])} - seen
            seen |= frontier
        if start in seen:
            ledger.error(("buses", bus.name, "bus"), f"{shown(bus.name)} would carry itself")
        wrapped: set[int] = set()
        frontier = {start}
        while frontier:
            frontier = {one for item in frontier for tree in leaves(buses[item].protocols) for one in tree} - wrapped
            wrapped |= frontier
        if start in wrapped:
            place = ("bus_types", bus.types[0], "protocols")
            ledger.error(place, f"{shown(bus.types[0])} would wrap itself")


def decision_of(ledger: Ledger, name: str) -> int | None:
    """The index of the decision called `name`, or None where there is nothing to decide."""
    for number, decision in enumerate(ledger.decisions):
        if decision.name == name:
            return number
    return None


def read_named(
    ledger: Ledger, owner: str, field_name: str, path: Path, names: Sequence[str], index: Mapping[str, int]
) -> Tree:
    """A tree of indices for a field that names processors, buses or executors."""
    what = field_name if field_name in ("processor", "executor") else "bus"
    known = tuple(name for name in names if name in index)
    for position, name in enumerate(names):
        if name not in index:
            ledger.unknown((*path, position), what, name, index)
            ledger.doubt(f"{owner}.{field_name}")
    if not known:
        return None
    texts = {index[name]: name for name in known}
    numbers = tuple(texts)
    tree: Tree = numbers[0]
    if len(numbers) > 1:
        decision = ledger.decide(owner, field_name, what, numbers, lambda number: texts[number])
        tree = Choice(decision, numbers)
        ledger.settle(decision, tree)
    ledger.refer(f"{owner}.{field_name}", what, tree, texts)
    return tree


def _frame_mistakes(model: BusType, frame: FrameModel) -> Iterator[tuple[str, str]]:
    """What does not go with a frame, and what it needs: field and message."""
    if model.virtual:
        yield "frame", "only a physical bus has frames: middleware is not a wire"
    if model.transmission_time is not None:
        yield "transmission_time", "follows from `frame`: state one of the two"
    if model.bandwidth is None:
        yield "frame", "needs a `bandwidth`"
    elif isinstance(frame, CanFdFrame) and frame.data_bandwidth < max(model.bandwidth):
        yield "frame", "the `data_bandwidth` of CAN FD is not below the `bandwidth`"
    if isinstance(frame, EthernetFrame) and not LEAST_MTU <= frame.mtu <= MOST_MTU:
        yield "frame", f"an `mtu` is from {LEAST_MTU} B to {MOST_MTU} B"
    payload = frame.payload if isinstance(frame, FlexrayFrame) else None
    if payload is not None and (payload % 2 or not 2 <= payload <= FLEXRAY_MOST):
        yield "frame", f"a `payload` is an even number of bytes from 2 B to {FLEXRAY_MOST} B"
