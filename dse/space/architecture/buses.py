"""Slots of buses: their types, what carries them, and the figures that follow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from dse.space.architecture.carriers import carrying
from dse.space.architecture.frames import FLEXRAY_MOST, LEAST_MTU, MOST_MTU, frame_of
from dse.space.architecture.processors import UNKNOWN, known_types, read_figures, read_named, read_slot
from dse.space.model.space import EMPTY, Bus
from dse.space.model.trees import FROM_BANDWIDTH, PerProcessorType, Tree, graft, leaves
from dse.space.properties import FieldReader, Ledger, Owner, Path, per_processor_type, stated, type_choice
from dse.spec.schema.frames import CanFdFrame, CanFrame, EthernetFrame, FlexrayFrame, FrameModel
from dse.spec.schema.hardware import FROM_BANDWIDTH as IN_WORDS
from dse.spec.schema.hardware import BusType, TransmissionTime
from dse.spec.schema.model import Spec
from dse.support.units import (
    format_bandwidth,
    format_duration,
    format_size,
    format_time_range,
    shown,
)


def build_buses(ledger: Ledger, spec: Spec) -> tuple[Bus, ...]:
    """The bus slots, then the virtual bus types that are used directly, in the order of first use.

    Figures are trees over the type decision of each slot. Unknown carriers and circles of virtual buses go to `ledger`.
    """
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
    (options, decision), owner = read_slot(ledger, ("buses", name), name, types or UNKNOWN, optional)
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
        ledger.with_use(f"{name}.bus", carrier)
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
        sizes_bytes=type_choice(decision, [_sizes(model) for _, model in owner.types]),
        fault_interval_ns=read("fault_interval", "duration", format_duration, lambda model: model.fault_interval),
        fault_burst=read("fault_burst", "count", str, lambda model: model.fault_burst),
        assignment=(given.assignment if given is not None else None) or "audsley",
    )


def _sizes(model: BusType) -> Tree:
    """Which sizes the transmission time of a type holds for."""
    times = model.transmission_time
    if isinstance(times, Mapping):
        found = {key: item.sizes for key, item in times.items()}
        return PerProcessorType(found) if any(found.values()) else None
    return times.sizes if isinstance(times, TransmissionTime) else None


def read_further(ledger: Ledger, spec: Spec, path: Path, given: Any, index: Mapping[str, int]) -> tuple[int, ...]:
    """The further buses that carry a connection or virtual bus, all at once.

    Indices of buses; a bus that may be empty, is named twice or carries nothing else goes to `ledger` as a mistake.
    """
    names = given.further_buses if given is not None else ()
    if names and not given.bus:
        ledger.error((*path, "further_buses"), "`further_buses` carry what `bus` carries: name that too")
    own = given.bus if given is not None else ()
    own = (own,) if isinstance(own, str) else tuple(own or ())
    found = []
    for position, name in enumerate(names):
        if name in own or name in names[:position]:
            message = f"{shown(name)} carries it already: `further_buses` are others, each named once"
            ledger.error((*path, "further_buses", position), message)
        elif name not in index:
            ledger.unknown((*path, "further_buses", position), "bus", name, index)
        elif name in spec.buses and spec.buses[name].optional:
            message = f"{shown(name)} may stay empty: of several buses at once each must be there"
            ledger.error((*path, "further_buses", position), message)
        else:
            found.append(index[name])
    return tuple(dict.fromkeys(found))


def read_protocols(ledger: Ledger, spec: Spec, path: Path, given: Any, index: Mapping[str, int]) -> tuple[int, ...]:
    """The types of virtual buses that wrap messages without being bound.

    Indices of buses, in the order of the file; names that are no virtual bus type go to `ledger`.
    """
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
    """Figures per processor type belong to virtual buses and name known processor types; in every type that is used.

    Mistakes go to `ledger`; types that nothing uses are not looked at.
    """
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
        for field, message in _fault_mistakes(model) if type_name in used else ():
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


def _fault_mistakes(model: BusType) -> Iterator[tuple[str, str]]:
    """Missing statements on faults of the wire: field and message."""
    if model.fault_interval is None:
        if model.fault_burst is not None:
            yield "fault_burst", "needs a `fault_interval`: the least time between two faults after a burst"
    elif not isinstance(model.frame, CanFrame | CanFdFrame):
        yield "fault_interval", "only CAN repeats a frame after a fault: needs `frame: can` or `can_fd`"
    elif model.arbitration not in (None, "priority"):
        yield "fault_interval", f"faults are counted with `arbitration: priority`, not with `{model.arbitration}`"


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


def _frame_mistakes(model: BusType, frame: FrameModel) -> Iterator[tuple[str, str]]:
    """Statements that contradict a frame, and missing ones: field and message."""
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
