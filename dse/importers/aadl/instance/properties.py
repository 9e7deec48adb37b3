"""Values of the properties of components, features, connections and flows, with their places.

The rules of AADL (AS5506, section 11.3): what an enclosing component says with ``applies to`` goes first, the outermost
before those within; then the declaration of the subcomponent, the implementation, those that it extends, the type;
then, for properties that are inherited, the component around; at last the default.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from dse.importers.aadl.instance.inheritance import Flat, Member, Owned
from dse.importers.aadl.instance.instance import Instance, contained, is_active
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.syntax.predeclared import INHERITED, SET_OF
from dse.importers.aadl.syntax.tree import (
    Classified,
    Computed,
    Connection,
    Flow,
    FlowSpec,
    Listed,
    Number,
    Path,
    Range,
    Record,
    Reference,
    Referred,
    Value,
    Word,
)
from dse.importers.allowance import spend
from dse.importers.registry import Place

MAX_STEPS = 30
ANY = "component"
FEATURE = "feature"
MEMBER = "connection or flow"
DATA_TYPE = "data type"


@dataclass(frozen=True)
class FoundProperty:
    """A value, where it stands, the component that its paths begin at and the package whose names it uses.

    `via` tells how it came there: ``own``, ``inherited`` from a component around, or ``default``.
    """

    value: Value
    place: Place
    base: Instance
    package: str
    via: str = "own"


@dataclass(frozen=True, slots=True)
class OwnedProperty:
    """An association and what it is of: a category of components, a `FEATURE`, a `MEMBER` or a `DATA_TYPE`."""

    holder: str
    owned: Owned

    @property
    def property(self) -> tuple[str, str]:
        """The name, and the set where that must be named."""
        association = self.owned.association
        group = association.package.lower()
        return association.key, "" if group == SET_OF.get(association.key) else group


class Properties:
    """Looks up the properties of one instance tree."""

    def __init__(self, library: Library, root: Instance) -> None:
        self.library = library
        self.root = root
        self.asked: set[tuple[str, str, str]] = set()
        self.data_types: dict[int, Flat] = {}
        """The look-ups so far: the holder (see `OwnedProperty`), the name, and the set where that must be named."""
        self._contained: dict[tuple[Instance, Path], list[tuple[Owned, Instance]]] = defaultdict(list)
        for component in (root, *root.below()):
            for owned, base in contained(component):
                self._register(owned, base)

    def _register(self, owned: Owned, base: Instance) -> None:
        for path in owned.association.applies:
            for target, rest in base.descend(path):
                key = tuple(name.lower() for name in rest)
                if key and not _has(target, key[0]):
                    place, name = owned.association.place, ".".join(path)
                    if not self._may_be_inactive(target, key[0]):
                        self.library.remark(f"applies to {name}, which is not there: not looked at", place)
                    continue
                self._contained[target, key].append((owned, base))

    def _may_be_inactive(self, target: Instance, key: str) -> bool:
        """Whether a name is that of a subcomponent which is not there in this mode, and not one beyond an array."""
        name, is_indexed, _ = key.partition("[")
        is_declared = target.flat is not None and name in target.flat.subcomponents
        return is_declared and not (is_indexed and target.named(name))

    # --- who has it ---------------------------------------------------------------------------------------------

    def of(self, component: Instance, name: str, group: str = "", bound: Flat | None = None) -> FoundProperty | None:
        """The property of a component; `group` is its set where it must be named (``SEI``).

        `bound` is the processor that it runs on: values stated ``in binding`` of another do not count.
        """
        self._ask(ANY if self._is_inherited(name.lower(), group.lower()) else component.category, name, group)
        return self._first(self._of_component(component, name.lower(), group.lower()), component, bound)

    def _ask(self, holder: str, name: str, group: str) -> None:
        self.asked.add((holder, name.lower(), group.lower()))

    def _of_component(self, component: Instance, name: str, group: str) -> Iterator[tuple[Owned, Instance, str]]:
        yield from ((*item, "own") for item in self._own(component, name, group))
        if self._is_inherited(name, group):
            for around in component.around():
                yield from ((*item, "inherited") for item in self._own(around, name, group))

    def _own(self, component: Instance, name: str, group: str) -> Iterator[tuple[Owned, Instance]]:
        yield from self._outer((component, ()), name, group)
        if component.declared is not None and component.parent is not None:
            for owned in component.declared.properties:
                if not owned.association.applies and _is(owned, name, group):
                    yield owned, component.parent
        if component.flat is not None:
            for owned in component.flat.properties:
                if not owned.association.applies and _is(owned, name, group):
                    yield owned, component

    def _outer(self, target: tuple[Instance, Path], name: str, group: str) -> Iterator[tuple[Owned, Instance]]:
        """The associations of enclosing components by ``applies to``, the outermost first."""
        associations = [item for item in self._contained.get(target, ()) if _is(item[0], name, group)]
        yield from sorted(associations, key=lambda item: len(item[1].path))

    def of_feature(self, component: Instance, path: Path, name: str, group: str = "") -> FoundProperty | None:
        """The property of a feature; `path` leads through feature groups.

        A `FoundProperty` with value and place: first associations with ``applies to`` from outside, then its own.
        """
        self._ask(FEATURE, name, group)
        key = tuple(item.lower() for item in path)
        plain = tuple(item.partition("[")[0] for item in key)
        associations = list(self._outer((component, key), name.lower(), group.lower()))
        associations += list(self._outer((component, plain), name.lower(), group.lower())) if plain != key else []
        if component.flat is not None and len(path) == 1 and plain[0] in component.flat.features:
            member = component.flat.features[plain[0]]
            associations += [(item, component) for item in member.properties if _is(item, name.lower(), group.lower())]
        return self._first(((*item, "own") for item in associations), component)

    def of_member(
        self,
        component: Instance,
        member: Member[Connection] | Member[FlowSpec] | Member[Flow],
        name: str,
        group: str = "",
    ) -> FoundProperty | None:
        """The property of a connection, flow specification or end-to-end flow that is declared in a component.

        A connection inherits from the component.
        """
        self._ask(MEMBER, name, group)
        key = (member.item.name.lower(),)
        associations = list(self._outer((component, key), name.lower(), group.lower()))
        associations += [(item, component) for item in member.properties if _is(item, name.lower(), group.lower())]
        own = self._first(((*item, "own") for item in associations), component)
        if own is None and isinstance(member.item, Connection) and self._is_inherited(name.lower(), group.lower()):
            around = self.of(component, name, group)
            return None if around is None else replace(around, via="inherited")
        return own

    def of_classifier(self, owned: Iterable[Owned], component: Instance, name: str) -> FoundProperty | None:
        """The property of a classifier that is no component, such as the data type of a port."""
        own = [item for item in owned if not item.association.applies and _is(item, name.lower(), "")]
        return self._first(((item, component, "own") for item in own), component)

    # --- which value --------------------------------------------------------------------------------------------

    def _first(
        self, associations: Iterable[tuple[Owned, Instance, str]], component: Instance, bound: Flat | None = None
    ) -> FoundProperty | None:
        """The value that goes first, with what it is appended to."""
        appended: list[FoundProperty] = []
        last: FoundProperty | None = None
        spend()
        for owned, base, via in associations:
            if owned.association.binding and not self._is_in_binding(owned, bound):
                continue
            value = self._in_mode(owned, base)
            if value is None:
                continue
            one = FoundProperty(value, owned.association.place, base, owned.package, via)
            if owned.association.appends:
                appended.append(one)
                continue
            last = one
            break
        if not appended:
            return last and replace(last, value=self._evaluated(last.value, last, component, 0))
        chosen = ([last] if last is not None else []) + appended[::-1]
        items = [
            item for one in chosen for item in (one.value.items if isinstance(one.value, Listed) else (one.value,))
        ]
        return replace(appended[0], value=Listed(tuple(items), appended[0].place))

    def _is_in_binding(self, owned: Owned, bound: Flat | None) -> bool:
        named = [self.library.find(item, owned.package) for item in owned.association.binding]
        return bound is not None and any(item in bound.chain for item in named)

    def _in_mode(self, owned: Owned, base: Instance) -> Value | None:
        """The value that holds in the mode of the component that states it."""
        values = owned.association.values
        if len(values) == 1 and values[0].modes is None:
            return values[0].value
        default: Value | None = None
        for item in values:
            if item.modes is None:
                default = item.value
            elif is_active(item.modes, base.mode):
                return item.value
        return default

    # --- what stands there ----------------------------------------------------------------------------------------

    def stated(self) -> Iterator[OwnedProperty]:
        """Every association in the tree, with what it is of."""
        for component in (self.root, *self.root.below()):
            groups = [component.flat.properties] if component.flat is not None else []
            groups += [component.declared.properties] if component.declared is not None else []
            for group in groups:
                yield from (OwnedProperty(component.category, one) for one in group if not one.association.applies)
            if component.flat is None:
                continue
            for feature in component.flat.features.values():
                yield from (OwnedProperty(FEATURE, one) for one in feature.properties if not one.association.applies)
            flat = component.flat
            implementations = [one for several in flat.implementations.values() for one in several]
            for members in (flat.specs.values(), flat.connections.values(), flat.flows.values(), implementations):
                for member in members:
                    yield from (OwnedProperty(MEMBER, one) for one in member.properties if not one.association.applies)
        for (target, key), associations in self._contained.items():
            is_feature = bool(key) and target.flat is not None and key[0].partition("[")[0] in target.flat.features
            holder = (FEATURE if is_feature else MEMBER) if key else target.category
            yield from (OwnedProperty(holder, one) for one, _ in associations)
        for flat in self.data_types.values():  # those that messages have
            yield from (OwnedProperty(DATA_TYPE, one) for one in flat.properties if not one.association.applies)

    def is_asked(self, stated: OwnedProperty) -> bool:
        """Whether something looked it up.

        Properties that are never looked up are remarked as not understood.
        """
        if stated.holder == DATA_TYPE:
            return stated.property[0] in ("data_size", "source_data_size", "concurrency_control_protocol")
        holders = [stated.holder, *([] if stated.holder in (FEATURE, MEMBER) else [ANY])]
        return any((holder, *stated.property) in self.asked for holder in holders)

    def _is_inherited(self, name: str, group: str) -> bool:
        return name in INHERITED or self._inherits(name, group)

    def _inherits(self, name: str, group: str) -> bool:
        property_set = self.library.sets.get(group)
        return bool(property_set and name in property_set.definitions and property_set.definitions[name].inherit)

    def _evaluated(self, value: Value, association: FoundProperty, component: Instance, steps: int) -> Value:
        """The value with the constants and properties that it names."""

        def again(inner: Value) -> Value:
            return self._evaluated(inner, association, component, steps + 1)

        spend()
        if steps > MAX_STEPS:
            self.library.fail("this value leads back to itself", association.place)
            return Computed("a cycle", association.place)
        match value:
            case Word(package="", name=("true" | "false")):
                return value
            case Word():
                return self._named(value, association, component, steps)
            case Range(low, high, place):
                return Range(again(low), again(high), place)
            case Record(fields, place):
                return Record(tuple((name, again(inner)) for name, inner in fields), place)
            case Listed(items, place):
                return Listed(tuple(again(inner) for inner in items), place)
        return value

    def _named(self, word: Word, association: FoundProperty, component: Instance, steps: int) -> Value:
        """A constant of a property set, another property of the component, or the word itself: a literal."""
        key = word.name.lower()
        group = self.library.sets.get(word.package.lower()) if word.package else None
        definition = group.definitions.get(key) if group else None
        value: Value | None = None
        if definition is not None and definition.kind == "constant" and definition.value is not None:
            value = self._evaluated(definition.value, association, component, steps + 1)
        elif definition is not None and definition.kind == "property":
            other = self.of(component, word.name, word.package) if steps < MAX_STEPS else None
            value = other.value if other else definition.value
            value = None if value is None else self._evaluated(value, association, component, steps + 1)
        elif not word.package and key in SET_OF:
            other = self.of(component, word.name) if steps < MAX_STEPS else None
            value = other.value if other else None
        elif word.package and definition is None:
            message = f"{word.package}::{word.name} is no constant that is known"
            self.library.remark(message, word.place if word.place.line else association.place)
        if value is None:
            return word
        if word.negative and isinstance(value, Number):
            return replace(value, value=Fraction(-1) * value.value)
        return value


def _has(component: Instance, key: str) -> bool:
    """Whether a component has a feature, connection, flow or mode of that name."""
    flat = component.flat
    if flat is None:
        return False
    members = (flat.features, flat.specs, flat.connections, flat.flows, flat.implementations, flat.modes)
    return any(key.partition("[")[0] in group for group in members)


def _is(owned: Owned, name: str, group: str) -> bool:
    """Whether an association is of a property: by its name, and the name of its set where one is written or needed."""
    association = owned.association
    if association.key != name:
        return False
    stated = association.package.lower()
    if group:
        return stated == group
    return stated in ("", SET_OF.get(name, ""))


def reference_in(value: Value) -> Reference | None:
    """The classifier that a value names."""
    if isinstance(value, Classified):
        return value.classifier
    return None


def references_in(value: Value) -> list[Reference]:
    """The classifiers that a value names, one or a list."""
    if isinstance(value, Listed):
        return [references for item in value.items for references in references_in(item)]
    references = reference_in(value)
    return [] if references is None else [references]


def paths_in(value: Value | None) -> list[Path]:
    """The paths that a value refers to, one or a list."""
    if isinstance(value, Referred):
        return [value.path]
    if isinstance(value, Listed):
        return [path for item in value.items for path in paths_in(item)]
    return []
