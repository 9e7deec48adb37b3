"""A model as its instance: everything that the problem is made of, looked up in one place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path as FilePath
from typing import Any, TypeVar

from dse.importers.aadl.document.values import WrongKindError, is_true, size_of, text_of
from dse.importers.aadl.instance.connections import Features, Wiring
from dse.importers.aadl.instance.flows import EndToEnd, Flows, UnreadFlow
from dse.importers.aadl.instance.inheritance import Flat, Flattener
from dse.importers.aadl.instance.instance import Instance, Instantiator
from dse.importers.aadl.instance.library import Library, load_library
from dse.importers.aadl.instance.properties import FoundProperty, Properties, paths_in
from dse.importers.aadl.property_set import OURS
from dse.importers.aadl.syntax.tokens import finding
from dse.importers.aadl.syntax.tree import Classifier, Number, Path, Reference
from dse.importers.registry import Place
from dse.support.errors import ProblemError, UsageError

T = TypeVar("T")
MAX_DEPTH = 30
CARRIERS = ("bus", "virtual bus")

SIZES = ("Data_Size", "Source_Data_Size")
"""Properties that state a size, the first one first."""


@dataclass
class InstanceModel:
    """An instantiated model."""

    library: Library
    flattener: Flattener
    root: Instance
    properties: Properties
    features: Features
    wiring: Wiring
    flows: list[EndToEnd]
    unread: list[UnreadFlow]
    _names: dict[Instance, str] = field(default_factory=dict)

    def read(self, value: FoundProperty | None, reader: Callable[..., T], name: str) -> T | None:
        """A value of its kind; None where there is none, or, with a finding, where it is of another kind.

        `reader` converts a value; its `WrongKindError` becomes a located mistake.
        """
        if value is None:
            return None
        try:
            return reader(value.value)
        except WrongKindError as error:
            self.library.fail(f"{name}: expected {error.expected}", value.place)
            return None

    def name(self, component: Instance) -> str:
        """The name of a component in the problem file: as stated in our property set, else its path."""
        if component not in self._names:
            stated = self.read(self.properties.of(component, "Name", OURS), text_of, "Name")
            self._names[component] = stated or component.title
        return self._names[component]

    def end_name(self, component: Instance) -> str:
        """The name of a component as the end of a flow or connection: hardware has an entry of its own for that."""
        name = self.name(component)
        return f"{name} as a component" if component.category in (*CARRIERS, "processor") else name

    def medium_name(self, component: Instance) -> str:
        """The name of a component as the medium of a connection; one that is no bus has its own entry for that."""
        name = self.name(component)
        return name if component.category in CARRIERS else f"{name} as a medium"

    def is_boundary(self, component: Instance) -> bool:
        """Whether a component stands for the world around the system."""
        return self.is_marked(component, "Boundary")

    def is_marked(self, component: Instance, name: str) -> bool:
        """Whether a property of ours says yes of a component."""
        value = self.properties.of(component, name, OURS)
        return value is not None and is_true(value.value)

    def targets(self, value: FoundProperty | None) -> list[Instance]:
        """The components that a binding refers to; a reference that leads nowhere is a remark.

        Each once, in the order of the property; used for bindings to processors, buses and memories.
        """
        if value is None:
            return []
        result: list[Instance] = []
        for path in paths_in(value.value):
            for component, rest in value.base.descend(path):
                if rest:
                    message = f"reference ({'.'.join(path)}) leads to no component"
                    self.library.remark(message, value.place)
                elif component not in result:
                    result.append(component)
        return result

    def physical(self, component: Instance, depth: int = 0) -> Instance | None:
        """The processor that a processor or virtual processor is or runs on."""
        if component.category == "processor" or depth > MAX_DEPTH:
            return component if component.category == "processor" else None
        bound = self.targets(self.properties.of(component, "Actual_Processor_Binding"))
        bound += [item for item in component.around() if item.category in ("processor", "virtual processor")]
        for item in bound:
            if item is not component:
                return self.physical(item, depth + 1)
        return None

    def size_of_data(self, flat: Flat | None, component: Instance, depth: int = 0) -> Fraction | None:
        """The size of a data classifier in bytes: as stated, else that of its parts; None where neither tells.

        Exact; parts are the data subcomponents of the implementation.
        """
        if flat is None or depth > MAX_DEPTH:
            return None
        self.properties.data_types[id(flat)] = flat
        for name in SIZES:
            value = self.properties.of_classifier(flat.properties, component, name)
            size = self.read(value, size_of, name)
            if size is not None:
                return size.low
        total: Fraction | None = None
        for member in flat.subcomponents.values():
            if member.item.category != "data":
                continue
            own = [self.properties.of_classifier(member.properties, component, name)
                   for name in SIZES]  # fmt: skip
            stated = next((self.read(item, size_of, "Data_Size") for item in own if item is not None), None)
            inner = None if stated is None else stated.low
            if inner is None and member.item.classifier is not None:
                resolved = self.flattener.resolve(member.item.classifier, member.package, flat)
                inner = self.size_of_data(resolved, component, depth + 1)
            for dimension in member.item.dimensions:
                if isinstance(dimension, Number) and inner is not None:
                    inner *= int(dimension.value)
            if inner is not None:
                total = (total or Fraction(0)) + inner
        return total

    def port_size(self, component: Instance | None, path: Path) -> Fraction | None:
        """The size in bytes that a feature states itself; None where it leaves that to its data type."""
        for name in SIZES:
            size = self.read(self.properties.of_feature(component or self.root, path, name), size_of, name)
            if size is not None:
                return size.low
        return None

    def type_size(self, component: Instance | None, path: Path) -> Fraction | None:
        """The size in bytes of the data type of a feature; None where it has none, or that states no size."""
        return self.size_of_data(self._data_type(component or self.root, path), component or self.root)

    def is_sum(self, component: Instance | None, path: Path) -> bool:
        """Whether the data type of a feature states no size itself, so that its size is the sum of its parts."""
        flat = self._data_type(component or self.root, path)
        return flat is not None and not any(
            self.properties.of_classifier(flat.properties, component or self.root, name) for name in SIZES
        )

    def _data_type(self, component: Instance, path: Path) -> Flat | None:
        leaf = self.features.leaf(component, path)
        if leaf is None or leaf.member.item.classifier is None:
            return component.flat if component.category == "data" else None
        return self.flattener.resolve(leaf.member.item.classifier, leaf.member.package, leaf.around)


def read_model(path: FilePath, options: Mapping[str, Any]) -> InstanceModel:
    """A model from its files, instantiated.

    Raises
    ------
    ProblemError
        with every mistake; where a text cannot be parsed, nothing is instantiated.
    """
    library = load_library(path, libraries(options))
    _stop(library)
    return instantiated(library, path, options, {})


def libraries(options: Mapping[str, Any]) -> list[FilePath]:
    """The folders in which packages are looked for: a list, or, on a command line, a text with commas between them.

    Raises
    ------
    UsageError
        when one is none.
    """
    stated = options.get("library") or ()
    listed = [part.strip() for part in stated.split(",")] if isinstance(stated, str) else stated
    folders = [FilePath(item) for item in listed if item]
    for folder in folders:
        if not folder.is_dir():
            raise UsageError(f"--library {folder}: is no folder")
    return folders


def instantiated(
    library: Library, path: FilePath, options: Mapping[str, Any], replaced: Mapping[str, Classifier]
) -> InstanceModel:
    """The instance of files that are read; `replaced` are classifiers that subcomponents have instead, by path.

    Raises
    ------
    ProblemError
        with every mistake.
    """
    classifier = _root(library, options.get("root"), path)
    flattener = Flattener(library)
    modes = _modes(options.get("mode", ""))
    root = Instantiator(library, flattener, modes, replaced).build(flattener.flat(classifier))
    _stop(library)
    properties = Properties(library, root)
    features = Features(library, flattener)
    wiring = Wiring(library, root, features, properties)
    following = Flows(library, wiring)
    flows = list(following.of(root))
    return InstanceModel(library, flattener, root, properties, features, wiring, flows, following.unread)


def _stop(library: Library) -> None:
    if library.findings:
        raise ProblemError(sorted(library.findings, key=lambda item: (item.file, item.line, item.column)))


def _modes(text: str) -> dict[str, str]:
    """``m1, sw.m2``: the mode of the root, and of components by their path."""
    modes = {}
    for part in filter(None, (item.strip() for item in text.split(","))):
        path, _, mode = part.rpartition(".")
        modes[path.lower()] = mode
    return modes


def _root(library: Library, wanted: str | None, path: FilePath) -> Classifier:
    """The implementation to instantiate: as named, else the only one of a system that no other uses."""
    everything = [item for package in library.packages.values() for item in package.classifiers.values()]
    place = Place(str(path), 0, 0)
    if wanted:
        package, _, name = wanted.rpartition("::")
        classifiers = [
            item for item in everything
            if item.name.lower() == name.lower() and package.lower() in ("", item.package.lower())
        ]  # fmt: skip
        if len(classifiers) == 1 and classifiers[0].is_implementation:
            return classifiers[0]
        known = _listed(item for item in everything if item.is_implementation and item.category == "system")
        what = "is no implementation" if classifiers else f"there is no implementation {wanted}"
        what = f"there are several {wanted}: say of which package" if len(classifiers) > 1 else what
        raise ProblemError([finding(f"--root: {what}", place, f"there are {known}" if known else "")])
    main = [item for package in library.main for item in package.classifiers.values()]
    systems = [item for item in main if item.category == "system" and item.is_implementation]
    used = _used(library, everything)
    candidates = [item for item in systems if id(item) not in used]
    if len(candidates) == 1:
        return candidates[0]
    if not systems:
        raise ProblemError([finding("there is no system implementation to analyse", place)])
    hint = f"name one with --root: {_listed(candidates or systems)}"
    raise ProblemError([finding("several system implementations are used by no other", place, hint)])


def _used(library: Library, everything: list[Classifier]) -> set[int]:
    """The classifiers that others have as subcomponents or extend."""
    used = set()
    for item in everything:
        references: list[Reference] = [one.classifier for one in item.subcomponents if one.classifier is not None]
        references += [item.extends] if item.extends is not None else []
        used |= {id(classifier) for one in references if (classifier := library.find(one, item.package)) is not None}
    return used


def _listed(items: object) -> str:
    names = [f"{item.package}::{item.name}" for item in items]  # type: ignore[attr-defined]
    return ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
