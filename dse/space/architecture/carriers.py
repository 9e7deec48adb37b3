"""Which buses and messages may carry a connection, what wraps its messages, and what the types of a bus state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from dse.space.architecture.frames import MOST_BYTES, Frame
from dse.space.model.space import Bus, Connection
from dse.space.model.trees import Choice, Tree, graft, leaves
from dse.space.properties import Ledger, Path
from dse.spec.schema.model import Spec
from dse.support.units import shown

NOT_IN_FRAMES = ("reply", "further_buses", "from_port", "data_rate")
"""Fields that no connection of a frame of several has."""
ALONE = "alone"
"""In place of a connection that carries another one: a message of its own."""


def carrying(bus: Bus) -> set[int]:
    """The buses that may carry a virtual bus directly.

    Indices of buses: every option of its carrier, and the further buses that carry it at once.
    """
    return {leaf for leaf in leaves(bus.carrier) if leaf is not None} | set(bus.further)


def carriers(buses: Sequence[Bus], connection: Connection) -> frozenset[int]:
    """Every bus that may carry the connection, directly or under a virtual bus.

    Indices of buses: the transitive closure of `carrying` over all options.
    """
    found = {leaf for leaf in leaves(connection.bus) if leaf is not None}
    found |= set(connection.further if found else ())
    while more := {leaf for bus in found for leaf in carrying(buses[bus])} - found:
        found |= more
    return frozenset(found)


def wrapping(buses: Sequence[Bus], required: Sequence[int], carried: frozenset[int]) -> frozenset[int]:
    """The protocols that wrap messages without being bound: those required, of what carries them too, and theirs.

    Indices of virtual bus types: the transitive closure over the protocols of types.
    """
    found = set(required) | {one for bus in carried for tree in leaves(buses[bus].protocols) for one in tree}
    while more := {one for bus in found for tree in leaves(buses[bus].protocols) for one in tree} - found:
        found |= more
    return frozenset(found)


def counted(buses: Sequence[Bus], connection: Connection) -> list[Bus]:
    """Every bus that may carry the connection, and every protocol that may wrap its messages.

    In the order of the space: whatever may add to the latency of the connection's messages.
    """
    carried = carriers(buses, connection)
    return [buses[number] for number in sorted(carried | wrapping(buses, connection.protocols, carried))]


def by_type(bus: Bus, tree: Tree) -> Iterator[tuple[str, bool]]:
    """Each type that a bus may have, and whether it states the figure.

    Pairs of a type's name and a boolean. A tree that does not branch by type gives one answer for all types.
    """
    if isinstance(tree, Choice) and tree.decision == bus.type_decision:
        yield from ((name, branch is not None) for name, branch in zip(bus.types, tree.branches, strict=True))
    else:
        yield from ((name, tree is not None) for name in bus.types)


def with_shared_buses(ledger: Ledger, spec: Spec) -> Spec:
    """The problem in which what another connection's message carries has the bus of that connection.

    Mistakes go to `ledger`: unknown connections, other senders, several buses, and fields that cannot be in a frame.
    """
    wires = dict(spec.connections)
    for name, given in spec.connections.items():
        path = ("connections", name, "carried_in")
        heads = [head for head in given.carried_in or () if head != ALONE]
        before = len(ledger.diagnostics)
        for head in heads:
            _check_head(ledger, spec, path, name, head)
        buses = {bus for head in heads if head in spec.connections for bus in spec.connections[head].bus or ()}
        if not heads or len(ledger.diagnostics) > before:
            continue
        if spec.profile != "dse":
            ledger.error(path, f"profile {spec.profile} knows no frames of several connections", "profile: dse")
        if len(buses | set(given.bus or ())) != 1:
            ledger.error(
                path, "all of a frame is on one bus: those that it may be carried in, and it itself, name it once"
            )
            continue
        is_always = len(heads) == len(given.carried_in or ())
        if is_always and (given.identifier is not None or given.rate is not None):
            key = "rate" if given.identifier is None else "identifier"
            ledger.error((*path[:2], key), f"the frame has the {key} of {shown(heads[0])}", "leave it out")
            continue
        choices = (*heads, *(() if is_always else (name,)))
        if len({spec.connections[item].rate is None for item in choices}) > 1:
            ledger.error(path, "where there is a choice all of them state a `rate`, or none does")
            continue
        wires[name] = given.model_copy(update={"bus": tuple(buses)})
    return spec.model_copy(update={"connections": wires}) if wires != spec.connections else spec


def _check_head(ledger: Ledger, spec: Spec, path: Path, name: str, head: str) -> None:
    """Check that a connection may be carried in the message of another one."""
    if head not in spec.connections or head == name:
        others = [item for item in spec.connections if item != name]
        ledger.unknown(path, "connection", head, others)
        return
    given, own = spec.connections[head], spec.connections[name]
    if given.from_ is None or given.from_ != own.from_:
        sender = "the outside" if given.from_ is None else shown(given.from_)
        ledger.error(path, f"{shown(head)} is sent by {sender}: a frame has one sender")
    if given.carried_in is not None and ALONE not in given.carried_in:
        ledger.error(path, f"{shown(head)} is carried itself, in {shown(given.carried_in[0])}", "name that")
    for key in NOT_IN_FRAMES:
        for item, body in ((head, given), (name, own)):
            if getattr(body, key):
                ledger.error(path, f"{shown(item)} has a `{key}`: it shares no frame")
    for item, body in ((head, given), (name, own)):
        if body.data_size is None:
            ledger.error(path, f"{shown(item)} has no `data_size`: that of the frame is the sum")


def read_carried(ledger: Ledger, spec: Spec, name: str) -> Tree:
    """The connection whose message carries another one's data: leaves are indices, None for a message of its own."""
    given = spec.connections[name].carried_in
    known = [head for head in given or () if head == ALONE or (head in spec.connections and head != name)]
    if not known:
        return None
    numbers = {item: number for number, item in enumerate(spec.connections)}
    options = tuple(None if head == ALONE else numbers[head] for head in known)
    tree: Tree = options[0]
    texts = dict(zip(options, known, strict=True))
    if len(options) > 1:
        decision = ledger.decide(name, "carried_in", "connection", options, lambda number: texts[number])
        tree = Choice(decision, options)
        ledger.settle(decision, tree)
    ledger.refer(f"{name}.carried_in", "connection", tree, texts)
    return tree


def with_frames(ledger: Ledger, buses: Sequence[Bus], wires: Sequence[Connection]) -> tuple[Connection, ...]:
    """The connections with those that their message may carry; identifier, priority and rate are its carrier's.

    Reports frames that are longer than those of their bus whatever is chosen.
    """
    found = list(wires)
    riders: dict[int, list[int]] = {}
    for other, item in enumerate(wires):
        for number in set(leaves(item.carried_in)) - {None}:
            riders.setdefault(number, []).append(other)
    for number in sorted(riders):
        found[number] = replace(wires[number], riders=tuple(riders[number]))
        _check_length(ledger, buses, found, number)
    for number, wire in enumerate(found):
        if wire.carried_in is not None:
            found[number] = replace(
                wire,
                identifier=_of_head(wire.carried_in, wire.identifier, [item.identifier for item in wires]),
                priority=_of_head(wire.carried_in, wire.priority, [item.priority for item in wires]),
                rate_hz=_of_head(wire.carried_in, wire.rate_hz, [item.rate_hz for item in wires]),
            )
            for key in ("identifier", "priority", "rate"):
                ledger.narrow(f"{wire.name}.{key}", partial(_where_alone, wire.carried_in))
    return tuple(found)


def _of_head(carried_in: Tree, own: Tree, heads: Sequence[Tree]) -> Tree:
    """A figure of the connection whose message carries another one's data; its `own` in a message of its own.

    None where none of them states it.
    """
    if {
        leaf
        for tree in (own, *(heads[head] for head in leaves(carried_in) if head is not None))
        for leaf in leaves(tree)
    } <= {None}:
        return None
    return graft(carried_in, lambda head: own if head is None else heads[head])


def _where_alone(carried_in: Tree, own: Tree) -> Tree:
    """A figure of a message of its own in designs that have one."""
    return graft(carried_in, lambda head: own if head is None else None)


def _check_length(ledger: Ledger, buses: Sequence[Bus], wires: Sequence[Connection], number: int) -> None:
    slots = [buses[bus] for bus in carriers(buses, wires[number])]
    frames = [leaf for slot in slots for leaf in leaves(slot.fixed_ns) if isinstance(leaf, Frame)]
    most = max((MOST_BYTES[frame.protocol] for frame in frames if frame.protocol in MOST_BYTES), default=None)
    always = [wires[other] for other in wires[number].riders if set(leaves(wires[other].carried_in)) == {number}]
    sizes = [
        min((leaf for leaf in leaves(item.size_bytes) if leaf is not None), default=0)
        for item in (wires[number], *always)
    ]
    if most is not None and always and sum(sizes) > most:
        message = f"the frame of {shown(wires[number].name)} has {sum(sizes)} B, at most {most} B fit"
        ledger.error(("connections", always[-1].name, "carried_in"), message)
