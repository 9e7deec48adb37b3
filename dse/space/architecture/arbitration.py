"""Whether messages wait for each other on a bus: what its types and its messages state, and what is missing.

Waiting for a bus counts only where all that decides it is stated: how the bus arbitrates, and of each of its messages
the size, and the identifier where that decides. Else the waiting for this bus is not counted, and the bus says why
(`Bus.uncounted`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dse.space.architecture.carriers import carriers
from dse.space.model.metric_kinds import flows_in
from dse.space.model.space import EMPTY, UNKNOWN_TYPE, Bus, Connection, Space
from dse.space.model.trees import leaves
from dse.space.properties import Ledger, type_choice
from dse.spec.kinds import Arbitration
from dse.spec.schema.fields import ANY_IDENTIFIER, MOST_IDENTIFIER
from dse.spec.schema.frames import CanFdFrame, CanFrame, EthernetFrame
from dse.spec.schema.hardware import BusType
from dse.spec.schema.model import Spec
from dse.support.units import shown
from dse.support.units.text import first_of

MOST_SHOWN = 3


def _default_arbitration(model: BusType) -> Arbitration | None:
    """How a bus of this type arbitrates: as stated, else by priority where its frames are those of CAN.

    Of Ethernet `priority` is by classes: of several messages of one class the oldest goes first.
    """
    if model.arbitration == "priority" and isinstance(model.frame, EthernetFrame):
        return "classes"
    return model.arbitration or ("priority" if isinstance(model.frame, CanFrame | CanFdFrame) else None)


def check_arbitration(ledger: Ledger, spec: Spec) -> None:
    """Check that the arbitration of each bus type fits its other fields.

    Mistakes go to `ledger`: arbitration of middleware, without transmission times, or by priorities that the frame does
    not have.
    """
    for name, model in spec.bus_types.items():
        place = ("bus_types", name, "arbitration")
        if model.arbitration is None:
            continue
        if model.virtual:
            ledger.error(place, "only a physical bus arbitrates: middleware runs on many cores")
        elif model.frame is None and model.transmission_time is None:
            ledger.error(place, "needs a `frame` or a `transmission_time`: how long messages take")
        elif model.arbitration == "priority" and model.bandwidth is None:
            ledger.error(place, "`priority` needs a `bandwidth`: what comes within a bit of a start still competes")
        elif model.arbitration == "priority" and isinstance(model.frame, EthernetFrame):
            if not model.frame.vlan:
                hint = "frame: {protocol: ethernet, vlan: true}"
                ledger.error(place, "priorities of Ethernet are in the tag of IEEE 802.1Q: needs `vlan: true`", hint)
        elif model.arbitration == "priority" and not isinstance(model.frame, CanFrame | CanFdFrame | None):
            hint = "fifo, round_robin or none"
            message = "`priority` is that of identifiers (frames of CAN, or a `transmission_time`) or of Ethernet"
            ledger.error(place, message, hint)


def with_arbitration(ledger: Ledger, spec: Spec, buses: Sequence[Bus], wires: Sequence[Connection]) -> tuple[Bus, ...]:
    """The buses: how each arbitrates where all that decides the waiting for it is stated, else what is missing.

    Reports identifiers that two senders share, or that are beyond the bits of their frames.
    """
    on_bus: dict[int, list[Connection]] = {}
    for wire in wires:
        reached = sorted(number for number in carriers(buses, wire) if not buses[number].virtual)
        for number in reached:
            on_bus.setdefault(number, []).append(wire)
        stated = spec.connections.get(wire.name)  # none of a reply
        if stated is not None and stated.identifier is not None and not stated.bus:
            ledger.error(("connections", wire.name, "identifier"), "an identifier is that of a message on a `bus`")
        is_local = stated is not None and bool(stated.bus) and not reached  # its ends share a processor
        is_asked = stated is not None and stated.priority is not None and not is_local
        if stated is not None and is_asked and not _may_be_ordered(spec, buses, reached):
            message = "a priority is that of a message on Ethernet with `arbitration: priority`"
            hint = "on CAN the `identifier` decides" if stated.bus else "name its `bus`"
            ledger.error(("connections", wire.name, "priority"), message, hint)
    found = []
    for number, bus in enumerate(buses):
        here = on_bus.get(number, [])
        models = {name: spec.bus_types[name] for name in bus.types if name not in (EMPTY, UNKNOWN_TYPE)}
        given = spec.buses.get(bus.name)
        if given is not None and given.assignment is not None and all(one.identifier is None for one in here):
            message = "places messages with `identifier: any`, and no message on this bus states an identifier"
            ledger.error(("buses", bus.name, "assignment"), message, "leave it out, or state `identifier: any`")
        if bus.virtual or not here or not models:
            found.append(bus)
            continue
        _check_identifiers(ledger, models, here)
        kinds = {name: _default_arbitration(model) for name, model in models.items()}
        missing = next(_missing(buses, kinds, here), "")
        is_asked = any(kinds.values()) or any(one.identifier is not None or one.priority is not None for one in here)
        if not missing:
            bus = replace(bus, arbitration=type_choice(bus.type_decision, [kinds.get(name) for name in bus.types]))
        elif is_asked:
            bus = replace(bus, uncounted=missing)
        found.append(bus)
    return tuple(found)


def may_be_any(wire: Connection) -> bool:
    """Whether the message of a connection may have any identifier that another one leaves."""
    return ANY_IDENTIFIER in set(leaves(wire.identifier))


def untraded_orders(space: Space) -> Iterator[str]:
    """The orders of messages with any identifier that are no designs, where another could be better for some flow.

    A clause for each bus with several messages of the flows that are asked about, of which a rule places some.
    """
    asked = [item.metric for item in space.requirements] + [item.metric for item in space.objectives]
    flows = frozenset(name for metric in asked for name in flows_in(space, metric))
    steps = [step for flow in space.flows if flow.name in flows for step in flow.steps if step.kind == "connection"]
    wires = [space.connections[number] for number in dict.fromkeys(step.index for step in steps)]
    sent = [wire for wire in wires if not _is_carried(wire)]
    is_counted = space.profile == "dse" and space.bus_queuing == "counted"
    for number, bus in enumerate(space.buses if is_counted else ()):
        here = [wire for wire in sent if number in carriers(space.buses, wire)]
        names = [wire.name for wire in here]
        if len(names) > 1 and any(map(may_be_any, here)) and "priority" in set(leaves(bus.arbitration)):
            yield (
                f"messages with any identifier on {bus.name} have the order that the rule {bus.assignment} gives: "
                f"designs with another order of {first_of(names, MOST_SHOWN)}, which could trade between "
                "flows, are left out; list identifiers to include them"
            )


def _is_carried(wire: Connection) -> bool:
    """Whether a connection is in the message of another one in each design."""
    return wire.carried_in is not None and None not in set(leaves(wire.carried_in))


def _may_be_ordered(spec: Spec, buses: Sequence[Bus], reached: Sequence[int]) -> bool:
    """Whether one of these buses may be Ethernet on which priorities decide."""
    names = {name for number in reached for name in buses[number].types}
    return any(_default_arbitration(spec.bus_types[name]) == "classes" for name in names if name in spec.bus_types)


def _check_identifiers(ledger: Ledger, models: Mapping[str, BusType], wires: Sequence[Connection]) -> None:
    wires = [wire for wire in wires if wire.carried_in is None]
    first: dict[int, Connection] = {}
    frames = [model.frame for model in models.values()]
    bits = min((item.identifier_bits for item in frames if isinstance(item, CanFrame | CanFdFrame)), default=29)
    most = (1 << bits) - 1
    for wire in wires:
        options = set(leaves(wire.identifier)) - {None}
        given = sorted(options - {ANY_IDENTIFIER})
        place = ("connections", wire.name, "identifier")
        for number in given:
            if number > most:
                hint = f"a frame with `identifier_bits: 29` goes up to {MOST_IDENTIFIER:#x}" if bits == 11 else ""
                ledger.error(place, f"{number:#x} is beyond identifiers of {bits} bits ({most:#x})", hint)
        if len(given) != 1 or len(options) > 1 or len({leaf for leaf in leaves(wire.bus) if leaf is not None}) > 1:
            continue  # where there is a choice a design with one identifier twice is none
        other = first.setdefault(given[0], wire)
        if other is wire or (is_one_message(other, wire) and all(model.broadcast for model in models.values())):
            continue
        hint = "one message to several receivers leaves one `from_port` onto a `broadcast` bus"
        hint = hint if wire.source == other.source else "each sender has identifiers of its own"
        ledger.error(place, f"{given[0]:#x} is the identifier of {shown(other.name)} on the same bus", hint)


def identifier_text(identifier: int | str) -> str:
    """An identifier as the file may state it.

    >>> identifier_text(385), identifier_text("any")
    ('0x181', 'any')
    """
    return identifier if isinstance(identifier, str) else hex(identifier)


def is_one_message(one: Connection, other: Connection) -> bool:
    """Whether two connections leave one port of a component: on a broadcast bus they are one message.

    Ports are compared by name; connections without a port name are separate messages.
    """
    return one.source == other.source and one.from_port is not None and one.from_port == other.from_port


def _missing(
    buses: Sequence[Bus],
    kinds: Mapping[str, Arbitration | None],
    wires: Sequence[Connection],
) -> Iterator[str]:
    """Reasons why the waiting for a bus with these `wires` is not counted, the most important first.

    A connection that is always carried in a message has the identifier or priority of that: its carrier is named.
    """
    ordered = [wire for wire in wires if not _is_carried(wire)]
    yield from (f"{name} states no `arbitration`" for name, kind in kinds.items() if kind is None)
    if "classes" in kinds.values():
        yield from _said("no `priority`", [wire for wire in ordered if None in set(leaves(wire.priority))])
    if "priority" in kinds.values():
        yield from _said("no `identifier`", [wire for wire in ordered if None in set(leaves(wire.identifier))])
    yield from _said("no `data_size`", [wire for wire in wires if None in set(leaves(wire.size_bytes))])
    yield from _said("several buses at once", [wire for wire in wires if _is_on_several(buses, wire)])


def _is_on_several(buses: Sequence[Bus], wire: Connection) -> bool:
    """Whether a connection may be on several physical buses at once, or on one by several ways."""
    carried = carriers(buses, wire)
    return bool(wire.further) or any(buses[number].further for number in carried)


def _said(what: str, wires: Sequence[Connection]) -> Iterator[str]:
    if wires:
        yield f"{what} of {first_of([wire.name for wire in wires], MOST_SHOWN)}"
