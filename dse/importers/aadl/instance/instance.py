"""The instance of a system implementation: a tree of components, in the modes that are chosen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from dse.importers.aadl.instance.inheritance import Flat, Flattener, Member, Owned
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.syntax.tokens import finding
from dse.importers.aadl.syntax.tree import Classifier, Number, Path, Subcomponent, Value, Word
from dse.importers.allowance import spend
from dse.importers.registry import Place
from dse.support.errors import ProblemError

MAX_DEPTH = 40
MAX_INSTANCES = 200_000
PIECES = 10
"""The share of the allowance that a component takes."""
HARDWARE = ("processor", "virtual processor", "bus", "virtual bus", "memory")


@dataclass(eq=False)
class Instance:
    """A component of the system; `path` are the names from the root, `mode` the key of its mode ("" without any)."""

    name: str
    category: str
    flat: Flat | None
    parent: Instance | None
    declared: Member[Subcomponent] | None
    place: Place
    children: dict[str, Instance] = field(default_factory=dict)
    mode: str = ""
    base: str = ""
    index: tuple[int, ...] = ()

    @property
    def path(self) -> tuple[str, ...]:
        """The names from below the root down to it; () for the root."""
        return () if self.parent is None else (*self.parent.path, self.name)

    @property
    def title(self) -> str:
        """The path in text, such as ``sw.localisation.ekf``."""
        return ".".join(self.path)

    @property
    def root(self) -> Instance:
        """The root of its tree."""
        return self if self.parent is None else self.parent.root

    def below(self) -> Iterator[Instance]:
        """All components within it, each before those within that."""
        for child in self.children.values():
            yield child
            yield from child.below()

    def around(self) -> Iterator[Instance]:
        """The components that it is in, the nearest first."""
        if self.parent is not None:
            yield self.parent
            yield from self.parent.around()

    def named(self, name: str) -> list[Instance]:
        """The subcomponents of a name: of an array every element that it names, by an index or a range of them."""
        key = name.lower()
        if key in self.children:
            return [self.children[key]]
        base, *parts = key.split("[")
        there = [child for child in self.children.values() if child.base == base]
        return [child for child in there if _is_within(child.index, parts)] if parts else there

    def descend(self, path: Path) -> list[tuple[Instance, Path]]:
        """The components that a path leads to, each with the rest of the path that names no further component.

        Pairs of a component and the rest of the path; several where the path names elements of an array.
        """
        reached: list[tuple[Instance, Path]] = [(self, path)]
        done: list[tuple[Instance, Path]] = []
        while reached:
            component, rest = reached.pop(0)
            inner = component.named(rest[0]) if rest else []
            if inner:
                reached += [(child, rest[1:]) for child in inner]
            else:
                done.append((component, rest))
        return done


def _modes_of(root: Instance) -> str:
    """The modes that a tree has, as `--mode` takes them: the first ten."""
    modes = [
        f"{one.title}.{mode.name}" if one is not root else mode.name
        for one in (root, *root.below())
        if one.flat is not None
        for mode in one.flat.modes.values()
    ]
    return f"there are {', '.join(modes[:10])}{' ...' if len(modes) > 10 else ''}" if modes else "there are no modes"


def _is_within(index: tuple[int, ...], parts: Sequence[str]) -> bool:
    """Whether the index of an element begins with what is written in brackets: ``2]``, ``1..3]``."""
    if len(parts) > len(index):
        return False
    for number, part in zip(index, parts, strict=False):
        low, _, high = part.rstrip("]").partition("..")
        if not (low.isdecimal() and (high or low).isdecimal() and int(low) <= number <= int(high or low)):
            return False
    return True


class Instantiator:
    """Builds the tree of one root; `replaced` are classifiers that subcomponents have instead of theirs, by path."""

    def __init__(
        self,
        library: Library,
        flattener: Flattener,
        modes: Mapping[str, str],
        replaced: Mapping[str, Classifier] | None = None,
    ) -> None:
        self.library = library
        self.flattener = flattener
        self.modes = dict(modes)
        self.replaced = dict(replaced or {})
        self.used: set[str] = set()
        self._count = 0

    def build(self, root: Flat) -> Instance:
        """The tree.

        Raises nothing for a mistake: it is noted in the library.
        """
        top = Instance(root.classifier.name, root.classifier.category, root, None, None, root.classifier.place)
        self._fill(top, 0)
        for path in self.modes:
            if path not in self.used:
                where = path or "the root"
                message = f"--mode: {where} has no mode {self.modes[path]}"
                self.library.fail(message, root.classifier.place, _modes_of(top))
        return top

    def _fill(self, component: Instance, depth: int) -> None:
        flat = component.flat
        if flat is None:
            return
        component.mode = self._mode(component, flat)
        if depth > MAX_DEPTH:
            self.library.fail(f"{component.title} is nested deeper than {MAX_DEPTH} levels", component.place)
            return
        for member in flat.subcomponents.values():
            if not is_active(member.item.modes, component.mode):
                continue
            inner = self._classifier(member, flat)
            for index in product(*(range(1, size + 1) for size in self._sizes(member))):
                self._add(component, member, inner, index, depth)

    def _add(
        self, component: Instance, member: Member[Subcomponent], inner: Flat | None, index: tuple[int, ...], depth: int
    ) -> None:
        self._count += 1
        spend(PIECES)
        if self._count > MAX_INSTANCES:
            raise ProblemError([finding(f"more than {MAX_INSTANCES} components", component.place)])
        item = member.item
        name = item.name + "".join(f"[{number}]" for number in index)
        category = item.category
        other = self.replaced.get(".".join((*component.path, name)).lower())
        if other is not None:
            inner = self.flattener.flat(other)
        if inner is not None and category == "abstract":
            category = inner.classifier.category
        child = Instance(name, category, inner, component, member, item.place, base=item.name.lower(), index=index)
        component.children[name.lower()] = child
        self._fill(child, depth + 1)

    def _classifier(self, member: Member[Subcomponent], around: Flat) -> Flat | None:
        if member.item.classifier is None:
            return None
        flat = self.flattener.resolve(member.item.classifier, member.package, around, member.item.bindings)
        if flat is None:
            return None
        category = flat.classifier.category
        if category != member.item.category and "abstract" not in (category, member.item.category):
            message = f"{flat.classifier.name} is a {category}, no {member.item.category}"
            self.library.fail(message, member.item.classifier.place)
        return flat

    def _sizes(self, member: Member[Subcomponent]) -> list[int]:
        sizes = []
        for value in member.item.dimensions:
            size = size_of_dimension(self.library, value)
            if size is None:
                self.library.remark(f"the size of array {member.item.name} is not known: read as 1", member.item.place)
            sizes.append(1 if size is None else size)
        return sizes

    def _mode(self, component: Instance, flat: Flat) -> str:
        """The mode of a component: as chosen, as that around it where it has one of that name, else the initial one."""
        if not flat.modes:
            return ""
        path = component.title.lower()
        if path in self.modes:
            if self.modes[path].lower() in flat.modes:
                self.used.add(path)
                return self.modes[path].lower()
            return next(iter(flat.modes))
        initial = next((key for key, mode in flat.modes.items() if mode.initial), None)
        if initial is None:
            around = component.parent.mode if component.parent is not None else ""
            return around if around in flat.modes else next(iter(flat.modes))
        return initial


def size_of_dimension(library: Library, value: Value | None, steps: int = 0) -> int | None:
    """The size of a dimension of an array: a number, or a constant of a property set; None where it is not known."""
    if isinstance(value, Number) and value.value.denominator == 1 and 0 <= value.value <= MAX_INSTANCES:
        return int(value.value)
    if isinstance(value, Word) and value.package and steps < MAX_DEPTH:
        property_set = library.sets.get(value.package.lower())
        definition = property_set.definitions.get(value.name.lower()) if property_set else None
        return size_of_dimension(library, definition.value, steps + 1) if definition and definition.value else None
    return None


def is_active(modes: tuple[str, ...] | None, mode: str) -> bool:
    """Whether something that is stated for some modes (None: all) is there in a mode."""
    return modes is None or not mode or mode in [item.lower() for item in modes]


def contained(component: Instance) -> Iterator[tuple[Owned, Instance]]:
    """Property associations with ``applies to`` in a component, and the component that their paths begin at.

    Pairs; associations of the classifier and of the subcomponent's declaration.
    """
    if component.flat is not None:
        for owned in component.flat.properties:
            if owned.association.applies:
                yield owned, component
    if component.declared is not None:
        for owned in component.declared.properties:
            if owned.association.applies:
                yield owned, component
