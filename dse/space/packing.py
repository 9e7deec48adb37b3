"""Frames that the search packs: which connections of a sender may share one, where `packing` of a bus is ``any``.

Each connection gets the options of `carried_in` that a person could have stated: the messages of the others of its
sender that leave no less often, and one of its own (docs/semantics.md, section 5.7). The others are those before it in
the order of rates, deadlines and the file, so that each way to share frames is one design.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TypeAlias

from dse.space.architecture.carriers import ALONE, NOT_IN_FRAMES
from dse.space.architecture.frames import MOST_BYTES
from dse.space.properties import Ledger
from dse.spec.schema.hardware import BusType
from dse.spec.schema.model import Connection, Spec
from dse.support.units import shown

Place: TypeAlias = tuple[Fraction, bool, int, int]
"""The order of connections that may share a frame: the fastest, then the one that is due first, then as in the file."""


def with_packing(ledger: Ledger, spec: Spec) -> Spec:
    """The problem in which connections on buses with ``packing: any`` may be carried in others' messages.

    Mistakes go to `ledger`: unknown buses, buses without frames of CAN, another profile.
    """
    wires = dict(spec.connections)
    for bus, way in spec.packing.items():
        if bus not in spec.buses:
            ledger.unknown(("packing", bus), "bus", bus, spec.buses, at_key=True)
        elif way == "any":
            most = _most_bytes(ledger, spec, bus)
            wires |= {} if most is None else _packed(ledger, spec, bus, most)
    return spec.model_copy(update={"connections": wires}) if wires != spec.connections else spec


def _most_bytes(ledger: Ledger, spec: Spec, bus: str) -> int | None:
    """The most data that a frame of a bus holds, of its largest type; None where something keeps it from packing."""
    path = ("packing", bus)
    if spec.profile != "dse":
        ledger.error(path, f"profile {spec.profile} knows no frames of several connections", "profile: dse")
        return None
    named = [(name, spec.bus_types[name]) for name in spec.buses[bus].type or () if name in spec.bus_types]
    for name, model in named:
        if _protocol(model) not in MOST_BYTES:
            said = f"has frames of {_protocol(model)}" if model.frame else "states no `frame`"
            ledger.error(path, f"only frames of CAN are packed: {shown(name)} {said}", "frame: can, or packing: stated")
            return None
    return max((MOST_BYTES[_protocol(model)] for _, model in named), default=None)


def _protocol(model: BusType) -> str:
    """The protocol of the frames of a bus type; empty without frames."""
    return str(getattr(model.frame, "protocol", ""))


def _packed(ledger: Ledger, spec: Spec, bus: str, most: int) -> dict[str, Connection]:
    """The connections of a bus that may be carried in others' messages, with these as options."""
    on_bus = [(number, name) for number, name in enumerate(spec.connections) if spec.connections[name].bus == (bus,)]
    places = {name: _place(number, spec.connections[name]) for number, name in on_bus if _may_share(spec, name)}
    found = {}
    for name in places:
        heads = [head for head in sorted(places, key=places.__getitem__) if _may_carry(spec, places, head, name, most)]
        if heads and spec.connections[name].carried_in is None:
            found[name] = spec.connections[name].model_copy(update={"carried_in": (ALONE, *heads)})
    return found


def _may_share(spec: Spec, name: str) -> bool:
    """Whether a connection may have a message with others: sent by a component, of a known size and at one rate."""
    given = spec.connections[name]
    if given.from_ is None or given.data_size is None or any(getattr(given, key) for key in NOT_IN_FRAMES):
        return False
    return given.rate is None or len(given.rate) == 1


def _place(number: int, given: Connection) -> Place:
    rate = Fraction(0) if given.rate is None else -Fraction(given.rate[0])
    return rate, given.deadline is None, min(given.deadline or (0,)), number


def _may_carry(spec: Spec, places: Mapping[str, Place], head: str, name: str, most: int) -> bool:
    """Whether a connection may be carried in the message of another one.

    That comes before it, is of the same sender, states a rate where it does, and is not carried always itself; the data
    of both fit into a frame.
    """
    one, other = spec.connections[head], spec.connections[name]
    if places[head] >= places[name] or one.from_ != other.from_ or (one.rate is None) != (other.rate is None):
        return False
    if one.carried_in is not None and ALONE not in one.carried_in:
        return False
    return min(one.data_size or (0,)) + min(other.data_size or (0,)) <= most
