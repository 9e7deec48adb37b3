"""Classifiers with all that they inherit: what extends and refines merged into one, prototypes resolved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.syntax.tree import (
    Association,
    Binding,
    Classifier,
    Connection,
    Feature,
    Flow,
    FlowSpec,
    Mode,
    Reference,
    Subcomponent,
)
from dse.importers.allowance import spend

MAX_CHAIN = 60
T = TypeVar("T", Feature, FlowSpec, Subcomponent, Connection, Flow)


@dataclass(frozen=True)
class Owned:
    """A property association, and the package whose names it uses."""

    association: Association
    package: str


@dataclass(eq=False)
class Member(Generic[T]):
    """A declaration with its refinements merged in; `package` is that of the one which names the classifier."""

    item: T
    package: str
    properties: list[Owned]


@dataclass
class Actual:
    """The binding of a prototype: a reference, the package that holds it, and the bindings there."""

    reference: Reference | None
    package: str
    environment: Environment
    inner: tuple[Binding, ...] = ()


Environment = Mapping[str, Actual]


@dataclass
class Flat:
    """A classifier with all that it inherits; members by key, those of its ancestors first.

    `flows` are its end-to-end flows, `implementations` those of flow specifications, of which one may have several.
    """

    classifier: Classifier
    chain: tuple[Classifier, ...]
    environment: Environment
    features: dict[str, Member[Feature]] = field(default_factory=dict)
    specs: dict[str, Member[FlowSpec]] = field(default_factory=dict)
    subcomponents: dict[str, Member[Subcomponent]] = field(default_factory=dict)
    connections: dict[str, Member[Connection]] = field(default_factory=dict)
    flows: dict[str, Member[Flow]] = field(default_factory=dict)
    implementations: dict[str, list[Member[Flow]]] = field(default_factory=dict)
    modes: dict[str, Mode] = field(default_factory=dict)
    properties: list[Owned] = field(default_factory=list)

    @property
    def title(self) -> str:
        """``package::name``."""
        return f"{self.classifier.package}::{self.classifier.name}"


class Flattener:
    """Flattens classifiers of one library, each once.

    Refinements are merged into what they refine, own properties go before inherited ones.
    """

    def __init__(self, library: Library) -> None:
        self.library = library
        self._done: dict[int, Flat] = {}

    def flat(self, classifier: Classifier, environment: Environment | None = None) -> Flat:
        """The classifier with what it inherits, under what is bound to its prototypes.

        A `Flat`; kept for classifiers without prototypes bound from outside.
        """
        if not environment and id(classifier) in self._done:
            return self._done[id(classifier)]
        chain = self._chain(classifier)
        spend(len(chain))
        bound: dict[str, Actual] = {}
        for item in reversed(chain):
            bound |= self.bindings(item.bindings, item.package, environment or {})
        bound |= environment or {}
        flat = Flat(classifier, tuple(chain), bound)
        for item in reversed(chain):
            self._merge(flat, item)
        flat.properties = [Owned(one, item.package) for item in chain for one in item.properties]
        packages = dict.fromkeys(item.package for item in chain)
        for name in packages:
            package = self.library.packages.get(name.lower())
            flat.properties += [Owned(one, name) for one in (package.properties if package else ())]
        if not environment:
            self._done[id(classifier)] = flat
        return flat

    def bindings(self, actuals: tuple[Binding, ...], package: str, environment: Environment) -> dict[str, Actual]:
        """The bindings of prototypes in a place, by key."""
        return {item.name.lower(): Actual(item.classifier, package, environment, item.inner) for item in actuals}

    def resolve(
        self, reference: Reference, package: str, around: Flat | None, actuals: tuple[Binding, ...] = ()
    ) -> Flat | None:
        """Resolve a reference in the classifier `around` it to a prototype of that classifier, or to a classifier.

        None with a finding where it leads nowhere.
        """
        if around is not None and not reference.package:
            key = reference.name.lower()
            declared = (one for item in around.chain for one in item.prototypes)
            prototype = next((one for one in declared if one.name.lower() == key), None)
            if prototype is not None and key in around.environment:
                return self._bound(around.environment[key], reference)
            if prototype is not None and prototype.constraint is None:
                hint = f"write ({prototype.name} => {prototype.category or 'CATEGORY'} CLASSIFIER) where it is used"
                self.library.fail(f"the prototype {prototype.name} is bound to nothing", reference.place, hint)
                return None
            if prototype is not None and prototype.constraint is not None:
                message = f"the prototype {prototype.name} is not bound: read as what it must be at least"
                self.library.remark(message, reference.place)
                return self.resolve(prototype.constraint, package, None)
        classifier = self.library.find(reference, package)
        if classifier is None:
            self.library.fail_absent(reference, package)
            return None
        return self.flat(classifier, self.bindings(actuals, package, around.environment if around else {}))

    def _bound(self, actual: Actual, wanted: Reference) -> Flat | None:
        """The actual of a prototype, which may be a prototype of the classifier around."""
        reference = actual.reference
        if reference is None:
            self.library.fail(f"what is bound to the prototype {wanted.name} is not followed", wanted.place)
            return None
        key = reference.name.lower()
        if not reference.package and key in actual.environment:
            return self._bound(actual.environment[key], reference)
        classifier = self.library.find(reference, actual.package)
        if classifier is None:
            self.library.fail_absent(reference, actual.package)
            return None
        return self.flat(classifier, self.bindings(actual.inner, actual.package, actual.environment))

    def _chain(self, classifier: Classifier) -> list[Classifier]:
        """The classifier, those it extends, and behind an implementation its type and those."""
        chain: list[Classifier] = []
        item: Classifier | None = classifier
        while item is not None:
            if item in chain or len(chain) > MAX_CHAIN:
                self.library.fail(f"{classifier.name} extends itself", classifier.place)
                return chain[:1]
            chain.append(item)
            item = self._parent(item)
        if classifier.is_implementation:
            stem = Reference("", classifier.name.partition(".")[0], classifier.place)
            kind = self.library.find(stem, classifier.package)
            if kind is None:
                self.library.fail(f"there is no type {stem.name} of this implementation", classifier.place)
            else:
                chain += [item for item in self._chain(kind) if item not in chain]
        return chain

    def _parent(self, item: Classifier) -> Classifier | None:
        if item.extends is None:
            return None
        parent = self.library.find(item.extends, item.package)
        if parent is None:
            self.library.fail_absent(item.extends, item.package)
        return parent

    def _merge(self, into: Flat, item: Classifier) -> None:
        """Add the members of one classifier to those of its ancestors."""
        for name in ("features", "specs", "subcomponents", "connections", "flows"):
            members: dict[str, Member[Any]] = getattr(into, name)
            for stated in getattr(item, name):
                if name == "flows" and stated.kind != "end to end":
                    continue
                properties = [Owned(one, item.package) for one in stated.properties]
                key = stated.name.lower() or f" {stated.place.line}:{stated.place.column}"
                before = members.get(key)
                if before is None:
                    if stated.refined:
                        self.library.fail(f"there is no {stated.name} to refine", stated.place)
                    members[key] = Member(stated, item.package, properties)
                else:
                    if not stated.refined and name not in ("flows",):
                        line = f"{before.item.place.file}:{before.item.place.line}"
                        self.library.fail(f'"{stated.name}" is declared twice, first in {line}', stated.place)
                    merged = _refined(before.item, stated)
                    package = item.package if getattr(stated, "classifier", None) else before.package
                    members[key] = Member(merged, package, [*properties, *before.properties])
        _add_implementations(into, item)
        for mode in item.modes:
            into.modes[mode.name.lower()] = mode


def _add_implementations(into: Flat, item: Classifier) -> None:
    """Add the flow implementations of a classifier before those of its ancestors, as OSATE numbers them."""
    own: dict[str, list[Member[Flow]]] = {}
    for stated in item.flows:
        if stated.kind == "end to end":
            continue
        key, properties = stated.name.lower(), [Owned(one, item.package) for one in stated.properties]
        if not stated.refined:
            own.setdefault(key, []).append(Member(stated, item.package, properties))
            continue
        there = into.implementations.get(key, [])  # a refinement is of all that have its name
        there[:] = [
            Member(_refined(one.item, stated), item.package, [*properties, *one.properties]) for one in there
        ]  # fmt: skip
    for key, members in own.items():
        into.implementations[key] = [*members, *into.implementations.get(key, [])]


def _refined(before: Any, stated: Any) -> Any:
    """A declaration with what its refinement states anew."""
    changes: dict[str, Any] = {}
    for name in ("direction", "classifier", "dimensions", "entry", "exit", "source", "target", "elements", "bindings"):
        if hasattr(stated, name):
            changes[name] = getattr(stated, name) or getattr(before, name)
    if hasattr(stated, "modes"):
        changes["modes"] = stated.modes if stated.modes is not None else before.modes
    if hasattr(stated, "inverse") and stated.classifier is None:
        changes["inverse"] = before.inverse
    if hasattr(stated, "both_ways") and not stated.source:
        changes["both_ways"] = before.both_ways
    return replace(stated, **changes)
