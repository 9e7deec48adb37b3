"""The instances of a system, and which port leads to which: connections of all levels, wildcards included."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from dse.importers.allowance import spend
from dse.importers.autoware.entities import DEEPEST, Entity, Library, Part, ends_of

PUBLISHER, SUBSCRIBER = "publisher", "subscriber"
OLDER = {"output": PUBLISHER, "input": SUBSCRIBER}
SERVICES = ("server", "client")
WILD = "*^+"
MOST_WILD = 4
"""The greatest number of wildcards in an end of a connection."""
PortKey: TypeAlias = tuple[str, str, str]
"""The path of an instance, publisher or subscriber, and the name of its port."""


@dataclass
class NodeInstance:
    """A node where it is: its path, the compute unit that runs it ("": none is stated), and its entity."""

    path: str
    entity: Entity
    unit: str
    place: Part


@dataclass
class Tree:
    """All nodes of a system by their paths, and the ports to which each port leads.

    `is_whole` tells whether nothing was left out.
    """

    nodes: dict[str, NodeInstance] = field(default_factory=dict)
    links: dict[PortKey, list[tuple[PortKey, Part]]] = field(default_factory=dict)
    is_whole: bool = True

    def reached(self, port: PortKey) -> Iterator[tuple[PortKey, Part]]:
        """The ports of nodes to which a publisher leads, each once, with the connection that arrives there."""
        todo, seen = [port], {port}
        while todo:
            for following, place in self.links.get(todo.pop(), ()):
                spend()
                if following not in seen:
                    seen.add(following)
                    todo.append(following)
                    if following[0] in self.nodes and following[1] == SUBSCRIBER:
                        yield following, place


def tree_of(library: Library, entity: Entity) -> Tree:
    """The instances of a system or module, or a node alone."""
    tree = Tree()
    whole = Part(entity.file.root, entity.file)
    _grow(library, tree, entity, "", "", whole, 0)
    return tree


def _grow(library: Library, tree: Tree, entity: Entity, path: str, unit: str, place: Part, depth: int) -> None:
    spend()
    if entity.kind == "node":
        own = path or "/" + entity.name.removesuffix(".node")
        tree.nodes[own] = NodeInstance(own, entity, unit, place)
        return
    inside: dict[str, tuple[str, Entity]] = {}
    for item in entity.entries("components"):
        name, kind = item.text("name"), item.text("entity")
        if not name or not kind or depth > DEEPEST:
            why = "it is nested too deeply" if name and kind else "it has no name or no `entity`"
            item.remark(f"{name[:80] or 'an instance'} is left out: {why}")
            tree.is_whole = False
            continue
        child = library.named(kind, item)
        if child is None or child.kind not in ("node", "module"):
            if child is not None:
                item.remark(f"{name[:80]} is left out: {kind[:80]} is no node and no module")
            tree.is_whole = False
            continue
        inside[name] = _path_of(item, path, name), child
        _grow(library, tree, child, inside[name][0], item.text("compute_unit") or unit, item, depth + 1)
    _connect(tree, entity, path, inside)


def _path_of(item: Part, above: str, name: str) -> str:
    """The path of an instance: the stated one, else its name in its namespace."""
    stated = item.text("path")
    if stated:
        return "/" + stated.strip("/")
    return "/" + "/".join(part for part in (above.strip("/"), item.text("namespace").strip("/"), name) if part)


def _connect(tree: Tree, entity: Entity, path: str, inside: dict[str, tuple[str, Entity]]) -> None:
    """Add what the connections of an entity say, which are between its own ports and those of its instances."""
    sources: dict[str, PortKey] = {}
    targets: dict[str, PortKey] = {}
    for kind, lists, own in ((SUBSCRIBER, "subscribers", sources), (PUBLISHER, "publishers", targets)):
        for port in entity.entries(lists):
            own[f"{kind}.{port.text('name')}"] = path, kind, port.text("name")
        for name, (there, other) in inside.items():
            inner = targets if kind == SUBSCRIBER else sources
            for port in other.entries(lists):
                spend()
                inner[f"{name}.{kind}.{port.text('name')}"] = there, kind, port.text("name")
    for item in entity.entries("connections"):
        ends = [_spelt(end) for end in ends_of(item.value)]
        if any(map(_is_service, ends)):
            item.remark("a connection of services is left out: nothing says how often they are called")
            continue
        pairs = _pairs(ends, sources, targets) if len(ends) == 2 else []
        if not pairs:
            item.remark(f"a connection is left out: no ports are there for {' and '.join(ends_of(item.value))[:160]}")
            tree.is_whole = False
        for source, target in pairs:
            spend()
            tree.links.setdefault(sources[source], []).append((targets[target], item))


def _spelt(end: str) -> str:
    """An end with the word of newer files for what kind of port it is, which is first, or behind the instance."""
    first, *rest = end.split(".")
    if first in OLDER and rest:
        return ".".join([OLDER[first], *rest])
    return ".".join([first, OLDER.get(rest[0], rest[0]), *rest[1:]]) if len(rest) > 1 else end


def _is_service(end: str) -> bool:
    return any(part in SERVICES for part in end.split(".")[:2])


def _pairs(ends: list[str], sources: dict[str, PortKey], targets: dict[str, PortKey]) -> list[tuple[str, str]]:
    """The ports that a connection joins, whichever of its ends is the source."""
    if any(sum(mark in WILD for mark in end) > MOST_WILD for end in ends):
        return []
    for source, target in (ends, ends[::-1]):
        starts, stops = _matching(source, sources), _matching(target, targets)
        if not starts or not stops:
            continue
        if _is_wild(source) and _is_wild(target):
            filled = [(start, _filled(target, captured)) for start, captured in starts.items()]
            pairs = [(start, stop) for start, stop in filled if stop in stops]
        else:
            pairs = [(start, stop) for start in starts for stop in stops]
        if pairs:
            return pairs
    return []


def _is_wild(end: str) -> bool:
    return any(mark in end for mark in WILD)


def _matching(pattern: str, ports: dict[str, PortKey]) -> dict[str, list[tuple[str, str]]]:
    """The ports that an end names, each with what its wildcards stand for."""
    if not _is_wild(pattern):
        return {pattern: []} if pattern in ports else {}
    marks = [mark for mark in pattern if mark in WILD]
    form = re.compile("".join("([^.]*)" if mark in WILD else re.escape(mark) for mark in pattern))
    matching = {}
    for port in ports:
        spend()
        if match := form.fullmatch(port):
            matching[port] = list(zip(marks, match.groups(), strict=True))
    return matching


def _filled(pattern: str, captured: list[tuple[str, str]]) -> str:
    """An end with what the wildcards of the other end stand for, in their order, mark by mark."""
    left = list(captured)
    text = ""
    for mark in pattern:
        at = next((place for place, (other, _) in enumerate(left) if other == mark), None) if mark in WILD else None
        text += mark if at is None else left.pop(at)[1]
    return text
