"""Which buses may carry a connection, what wraps its messages, and what the types of a bus state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dse.space.model.space import Bus, Connection
from dse.space.model.trees import Choice, Tree, leaves


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
