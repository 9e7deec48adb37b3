"""Connection instances: from the component that sends to the one that receives, across feature groups and levels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from dse.importers.aadl.instance.inheritance import Flat, Flattener, Member
from dse.importers.aadl.instance.instance import Instance, is_active, size_of_dimension
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.instance.properties import FoundProperty, Properties
from dse.importers.aadl.syntax.tree import Connection, Feature, Listed, Number, Path, Record, Value, Word
from dse.importers.allowance import spend

ENDS = ("thread", "device", "processor", "virtual processor", "data", "memory", "bus", "virtual bus", "subprogram")
"""Categories whose features are always the ends of connections."""
CALLING = ("thread", "subprogram")
"""Categories that may connect the subprograms that they call; such connections are not read."""
PIECES = 50
"""The share of the allowance that a feature takes."""
MAX_DEPTH = 20
MAX_INSTANCES = 200_000
TURNED = {"in": "out", "out": "in", "provides": "requires", "requires": "provides"}


@dataclass(frozen=True, eq=False)
class Leaf:
    """A feature, or one of a feature group: its path from the component, its direction as seen from there.

    `around` is the flattened classifier in which the feature is declared.
    """

    path: Path
    direction: str
    member: Member[Feature]
    around: Flat


@dataclass(frozen=True)
class Declared:
    """A declared connection in the component that declares it."""

    context: Instance
    member: Member[Connection]


@dataclass(frozen=True, eq=False)
class ConnectionInstance:
    """A connection from end to end; an end is None where it is a feature of the root, whose path it still has.

    `wires` are the declared connections that it is made of, from the source to the target (AS5506C, 14.3).
    """

    source: Instance | None
    source_path: Path
    target: Instance | None
    target_path: Path
    wires: tuple[Declared, ...]


Node = tuple[Instance, Path]


def _indices(value: Value | None) -> tuple[int, ...] | None:
    """The whole numbers of a list, or one; None where it is none."""
    items = value.items if isinstance(value, Listed) else () if value is None else (value,)
    numbers = [int(item.value) for item in items if isinstance(item, Number) and item.value.denominator == 1]
    return tuple(numbers) if len(numbers) == len(items) else None


NO_MORE = (("",), ())
"""The rest of a feature behind a path that names it (see `beyond`)."""


def beyond(path: Path, feature: Path) -> Path | None:
    """The rest of a feature's path beyond a path: the index that the path does not name, then the inner names.

    None where it leads elsewhere.

    >>> beyond(("g",), ("g[2]", "x")), beyond(("g[2]",), ("g[2]", "x")), beyond(("g", "x"), ("g", "x"))
    (('[2]', 'x'), ('', 'x'), ('',))
    """
    if len(path) > len(feature) or not path:
        return None
    for mine, name in zip(path, feature, strict=False):
        if mine != name and mine != name.partition("[")[0]:
            return None
    return feature[len(path) - 1][len(path[-1]) :], *feature[len(path) :]


def indices(library: Library, dimensions: Sequence[Value | None]) -> list[str]:
    """The indices of the elements of an array, as they are written: ``[1]``; one that is empty where it is no array.

    Every combination of the indices of the dimensions, from 1.
    """
    sizes = [size_of_dimension(library, item) for item in dimensions]
    if None in sizes:
        return [""]
    ranges = (range(1, (size or 0) + 1) for size in sizes)
    return ["".join(f"[{number}]" for number in index) for index in product(*ranges)]


class Features:
    """The features of components, feature groups taken apart."""

    def __init__(self, library: Library, flattener: Flattener) -> None:
        self.library = library
        self.flattener = flattener
        self._known: dict[tuple[int, str], list[Leaf]] = {}
        self._kept: list[Flat] = []

    def leaves(self, flat: Flat | None, name: str) -> list[Leaf]:
        """A feature of a classifier, or those of a feature group; none where there is no such feature.

        Paths are relative to the component; directions are turned in inverse feature groups.
        """
        if flat is None or name not in flat.features:
            return []
        key = (id(flat), name)
        if key not in self._known:
            self._kept.append(flat)
            self._known[key] = list(self._expanded(flat, name, (), False, 0))
        return self._known[key]

    def leaf(self, component: Instance, path: Path) -> Leaf | None:
        """The feature that a path leads to."""
        name = path[0].partition("[")[0] if path else ""
        return next((leaf for leaf in self.leaves(component.flat, name) if beyond(path, leaf.path) in NO_MORE), None)

    def _expanded(self, flat: Flat, name: str, prefix: Path, turned: bool, depth: int) -> Iterator[Leaf]:
        spend(PIECES)
        member = flat.features[name]
        for index in indices(self.library, member.item.dimensions):
            yield from self._element(flat, member, (*prefix, f"{name}{index}"), turned, depth)

    def _element(self, flat: Flat, member: Member[Feature], path: Path, turned: bool, depth: int) -> Iterator[Leaf]:
        """A feature (of an array one element), or those of a feature group."""
        if member.item.kind == "feature group" and member.item.classifier is not None and depth < MAX_DEPTH:
            group = self.flattener.resolve(member.item.classifier, member.package, flat)
            if group is not None:
                turned ^= member.item.inverse
                for _ in range(MAX_DEPTH):
                    inverse = next((item for item in group.chain if item.inverse_of), None)
                    if group.features or inverse is None or inverse.inverse_of is None:
                        break
                    other = self.flattener.resolve(inverse.inverse_of, inverse.package, None)
                    if other is None:
                        break
                    group, turned = other, not turned
                for inner in group.features:
                    yield from self._expanded(group, inner, path, turned, depth + 1)
                return
        direction = member.item.direction
        yield Leaf(path, TURNED.get(direction, direction) if turned else direction, member, flat)


class Wiring:
    """All connection instances of a tree."""

    def __init__(self, library: Library, root: Instance, features: Features, properties: Properties) -> None:
        self.library = library
        self.features = features
        self.properties = properties
        self._edges: dict[Node, list[tuple[Declared, Node]]] = defaultdict(list)
        self._entered: dict[Node, list[Declared]] = defaultdict(list)
        for component in (root, *root.below()):
            self._declare(component)
        self.instances = list(self._instances(root))

    # --- edges between features -----------------------------------------------------------------------------------

    def _declare(self, context: Instance) -> None:
        if context.flat is None:
            return
        for member in context.flat.connections.values():
            if is_active(member.item.modes, context.mode) and "bus access" not in member.item.kind:
                self._expand(context, member)

    def _expand(self, context: Instance, member: Member[Connection]) -> None:
        wire = Declared(context, member)
        sources, targets = (self._ends(context, member, path) for path in (member.item.source, member.item.target))
        for source, target in self._paired(wire, sources, targets):
            for one, other in self._leaves(member, source, target):
                spend()
                for start, end in self._directed(context, member, one, other):
                    self._edges[start].append((wire, end))
                    self._entered[end].append(wire)

    def _ends(self, context: Instance, member: Member[Connection], path: Path) -> list[Node]:
        """The components (several of an array) and features that an end names."""
        key = tuple(name.lower() for name in path)
        if key[:1] == ("self",):
            return [(context, key[1:])]
        if key[:1] == ("processor",):
            self.library.remark("a connection to the processor is not followed", member.item.place)
            return []
        ends = []
        for component in context.named(key[0]) if key else []:
            if len(key) == 1 or self._has(component, key[1]):
                ends.append((component, key[1:]))
            elif component.flat is not None:
                message = f"{component.base or component.name} has no feature {key[1]}"
                self.library.fail(message, member.item.place)
        if ends or not key:
            return ends
        if self._has(context, key[0]):
            return [(context, key)]
        inactive = context.flat is not None and key[0].partition("[")[0] in context.flat.subcomponents
        if context.category in CALLING:
            text = f"{path[0]} is no subcomponent or feature: what is called is not looked at"
            self.library.remark(text, member.item.place)
        elif not inactive:
            self.library.fail(f"there is no subcomponent or feature {path[0]}", member.item.place)
        return []

    def _has(self, component: Instance, name: str) -> bool:
        return component.flat is not None and name.partition("[")[0] in component.flat.features

    def _paired(self, wire: Declared, sources: list[Node], targets: list[Node]) -> Iterator[tuple[Node, Node]]:
        """Which elements of arrays are connected: by Connection_Set and Connection_Pattern, else one to one."""
        least, most = sorted((len(sources), len(targets)))
        stated = self.properties.of_member(wire.context, wire.member, "Connection_Set") if least and most > 1 else None
        pattern = self.properties.of_member(wire.context, wire.member, "Connection_Pattern") if least > 1 else None
        listed = list(self._listed(wire, stated, sources, targets)) if stated is not None else []
        yield from listed
        if stated is None or pattern is not None:
            yield from (pair for pair in self._patterned(wire, pattern, sources, targets) if pair not in listed)

    def _listed(
        self, wire: Declared, stated: FoundProperty, sources: list[Node], targets: list[Node]
    ) -> Iterator[tuple[Node, Node]]:
        """The pairs of a Connection_Set, which names elements by their indices."""
        records = stated.value.items if isinstance(stated.value, Listed) else (stated.value,)
        for record in records:
            wanted = [_indices(record.get(name)) if isinstance(record, Record) else None for name in ("src", "dst")]
            ends = [
                next((node for node in nodes if node[0].index == index), None)
                for nodes, index in zip((sources, targets), wanted, strict=True)
            ]
            if ends[0] is None or ends[1] is None:
                text = f"Connection_Set of {wire.member.item.name} names an element that is not there: not looked at"
                self.library.remark(text, stated.place)
            else:
                yield ends[0], ends[1]

    def _patterned(
        self, wire: Declared, stated: FoundProperty | None, sources: list[Node], targets: list[Node]
    ) -> Iterator[tuple[Node, Node]]:
        if len(sources) == 1 or len(targets) == 1:
            yield from ((one, other) for one in sources for other in targets)
            return
        pattern = "one_to_one"
        if stated is not None:
            value = stated.value
            while isinstance(value, Listed) and value.items:
                value = value.items[0]
            pattern = value.name.lower() if isinstance(value, Word) else pattern
        step = {"one_to_one": 0, "next": 1, "cyclic_next": 1, "previous": -1, "cyclic_previous": -1}.get(pattern)
        if pattern in ("all_to_all", "one_to_all", "all_to_one"):
            yield from ((one, other) for one in sources for other in targets)
        elif step is None:
            self.library.remark(f"the pattern {pattern} is not followed", wire.member.item.place)
        else:
            for number, one in enumerate(sources):
                other = number + step
                if pattern.startswith("cyclic"):
                    other %= len(targets)
                if 0 <= other < len(targets):
                    yield one, targets[other]

    def _leaves(self, member: Member[Connection], source: Node, target: Node) -> Iterator[tuple[Node, Node]]:
        """The features on both sides that belong together: of groups by name, of arrays by index, else by order."""
        one, other = self._within(source), self._within(target)
        if not one or not other:
            yield source, target
            return
        rests = {beyond(target[1], path): path for path in other}
        mine = [beyond(source[1], path) for path in one]
        if NO_MORE[0] in rests and NO_MORE[0] in mine:
            yield (source[0], one[0]), (target[0], other[0])
        elif any(rest in rests for rest in mine):
            for rest, path in zip(mine, one, strict=True):
                if rest in rests:
                    yield (source[0], path), (target[0], rests[rest])
        elif 1 in (len(one), len(other)) and all(rest[1:] == () for rest in (*mine, *rests) if rest is not None):
            for path in one:  # one feature and the elements of an array
                for there in other:
                    yield (source[0], path), (target[0], there)
        elif len(one) == len(other):
            for path, there in zip(one, other, strict=True):
                yield (source[0], path), (target[0], there)
        else:
            self.library.remark("the features on both sides do not fit: the connection is left out", member.item.place)

    def _within(self, node: Node) -> list[Path]:
        """The paths of the features at a path: several of a feature group."""
        component, path = node
        if not path:
            return []
        leaves = self.features.leaves(component.flat, path[0].partition("[")[0])
        return [leaf.path for leaf in leaves if beyond(path, leaf.path) is not None]

    def _directed(
        self, context: Instance, member: Member[Connection], one: Node, other: Node
    ) -> Iterator[tuple[Node, Node]]:
        """The ways that something goes between two features: by the arrow, and by their own directions."""
        there = self._sends(context, one) is not False and self._sends(context, other) is not True
        back = self._sends(context, one) is not True and self._sends(context, other) is not False
        if "access" in member.item.kind:
            there = back = True
        if not member.item.both_ways and "access" not in member.item.kind:
            back = False
            there = there or member.item.kind != "feature group"
        if there:
            yield one, other
        if back:
            yield other, one

    def _sends(self, context: Instance, node: Node) -> bool | None:
        """Whether a feature gives to the connections of a component (or takes from them); None where it may do both."""
        leaf = self.features.leaf(*node)
        if leaf is None or leaf.direction not in ("in", "out"):
            return None
        return (leaf.direction == "out") != (node[0] is context)

    # --- from end to end ------------------------------------------------------------------------------------------

    def _instances(self, root: Instance) -> Iterator[ConnectionInstance]:
        count = 0
        for node in list(self._edges):
            component = node[0]
            context = component.parent or component
            if not self._is_source(node, context):
                continue
            for traced in self._traced(root, node, context):
                count += 1
                if count > MAX_INSTANCES:
                    self.library.fail(f"more than {MAX_INSTANCES} connections", root.place)
                    return
                yield traced

    def _is_source(self, node: Node, context: Instance) -> bool:
        """Whether something begins here: it leaves, and nothing within the component leads to it."""
        if not any(wire.context is context for wire, _ in self._edges[node]):
            return False
        component = node[0]
        if component.parent is None or component.category in ENDS:
            return True
        return not any(wire.context is component for wire in self._entered[node])

    def _traced(self, root: Instance, start: Node, context: Instance) -> Iterator[ConnectionInstance]:
        """Every way from a source along connections to where it ends."""
        stack: list[tuple[Node, Instance, tuple[Declared, ...]]] = [(start, context, ())]
        while stack:
            node, here, wires = stack.pop()
            spend(1 + len(wires))
            component = node[0]
            following = [item for item in self._edges.get(node, ()) if item[0].context is here and item[0] not in wires]
            is_end = bool(wires) and here is component and component.category in ENDS
            if wires and (is_end or not following):
                is_root = component is root
                if here is component or is_root:  # it came in from outside, or leaves the system
                    yield self._instance(root, start, node, wires)
                continue
            for wire, other in reversed(following):
                if wires and other[0] is start[0] and other == start:
                    continue
                inside = other[0] is not wire.context
                after = other[0] if inside else other[0].parent or other[0]
                if other[0] is root and not inside:
                    yield self._instance(root, start, other, (*wires, wire))
                else:
                    stack.append((other, after, (*wires, wire)))

    def _instance(self, root: Instance, start: Node, end: Node, wires: tuple[Declared, ...]) -> ConnectionInstance:
        source, target = (None if item[0] is root else item[0] for item in (start, end))
        return ConnectionInstance(source, start[1], target, end[1], wires)
