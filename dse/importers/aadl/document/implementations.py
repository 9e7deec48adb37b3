"""Implementations of one subsystem as alternatives: one problem of the documents that each of them gives.

The subsystem becomes a component of its own, whose `type` is the implementation. What is within it and differs between
them has types of its own, or lists of values, which rules tie to that choice. So every design is one that the model
gives with one of the implementations; implementations of another structure are refused by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, TypeAlias

from dse.importers.aadl.instance.instance import Instance
from dse.importers.aadl.instance.library import Library
from dse.importers.aadl.instance.model import InstanceModel, instantiated
from dse.importers.aadl.syntax.tree import Reference
from dse.importers.registry import Key, Place

Document: TypeAlias = dict[str, Any]

SUBSYSTEMS = ("system", "process", "thread group", "abstract", "device")
SECTIONS = ("partitions", "processors", "buses", "devices", "threads", "connections", "flows", "clocks")
CATALOGUES = ("processor_types", "bus_types", "device_types", "thread_types")
OF_THE_COMPONENT = ("type", "processor", "process", "priority", "core", "executor", "dispatch_trigger", "partition",
                    "clock", "figures_of", "category")  # fmt: skip
"""Fields of threads and devices that their types have not."""
LISTED: Mapping[str, tuple[str, ...]] = {
    "processors": ("type",),
    "buses": ("type", "bus"),
    "devices": (),
    "threads": ("processor", "priority"),
    "connections": ("data_size", "type_size", "bus", "rate", "data_rate", "queue_size", "latency"),
}
"""Fields that may be a list of values, that is, a choice."""
STANDING_FOR = {"type_size": "data_size"}
"""Fields that count as another one where they are not stated."""
DATA = ("data", "subprogram", "subprogram group")


@dataclass(frozen=True)
class Subsystem:
    """A component whose implementation is to be chosen; `key` are the section and name that the problem has for it."""

    key: tuple[str, str]
    component: Instance
    classifiers: tuple[str, ...]

    @property
    def name(self) -> str:
        """The name of the component in the problem file."""
        return self.key[1]


class DifferError(Exception):
    """Two implementations cannot be alternatives in one problem; the text says why."""


def subsystems(model: InstanceModel, choices: Mapping[str, Mapping[str, Sequence[str]]]) -> list[Subsystem]:
    """The components with a structure of their own for which a file beside the model lists implementations."""
    by_name = {model.name(item): item for item in model.root.below()}
    parts = []
    for section in ("threads", "devices"):
        for name, listed in choices.get(section, {}).items():
            component = by_name.get(name)
            if component is None or component.category not in SUBSYSTEMS:
                continue
            known = tuple(one for one in dict.fromkeys(listed) if replacement(model.library, component, one))
            if any(_is_structure(model, component, one) for one in known):
                parts.append(Subsystem((section, name), component, known))
    return parts


def _is_structure(model: InstanceModel, component: Instance, name: str) -> bool:
    classifier = replacement(model.library, component, name)
    flat = None if classifier is None else model.flattener.flat(classifier)
    return flat is not None and any(item.item.category not in DATA for item in flat.subcomponents.values())


def replacement(library: Library, component: Instance, name: str) -> Any:
    """The classifier of that name which a subcomponent may have instead of its own; None where there is none."""
    package, _, own = name.rpartition("::")
    place = component.place
    packages = [package] if package else [item.name for item in library.packages.values()]
    classifiers = [library.find(Reference(one, own, place), one) for one in packages]
    fitting = [item for item in classifiers if item is not None and item.category in (component.category, "abstract")]
    unique = list(dict.fromkeys(fitting))
    return unique[0] if len(unique) == 1 else None


def with_implementations(
    model: InstanceModel,
    chosen: Sequence[Subsystem],
    taken: Mapping[str, str],
    path: FilePath,
    options: Mapping[str, Any],
) -> InstanceModel:
    """The instance of a model with an implementation for each subsystem, by its name."""
    replaced = {
        item.component.title.lower(): replacement(model.library, item.component, taken[item.name]) for item in chosen
    }
    return instantiated(model.library, path, options, replaced)


def conflict(chosen: Sequence[Subsystem]) -> str:
    """The reason why subsystems cannot be chosen independently; "" where they can."""
    for one in chosen:
        for other in chosen:
            if one is not other and one.component in other.component.around():
                return f"{other.name} is within {one.name}: only one of them can have implementations to choose from"
    return ""


def merged(
    chosen: Sequence[Subsystem],
    document: Callable[[Mapping[str, str]], Document],
    places: dict[Key, Place],
) -> Document:
    """One document for every combination; `document` gives that of one combination, by the names of subsystems.

    Raises
    ------
    DifferError
        where implementations differ in what a problem file cannot leave open.
    """
    first = {item.name: item.classifiers[0] for item in chosen}
    base = document(first)
    result = deepcopy(base)
    result.setdefault("rules", [])
    touched: dict[Key, str] = {}
    for item in chosen:
        merger = _Merger(item, result, places)
        variants = [base, *(document({**first, item.name: one}) for one in item.classifiers[1:])]
        merger.merge([_apart(one, there, base) for one, there in zip(item.classifiers, variants, strict=True)])
        for key in merger.changed:
            other = touched.setdefault(key, item.name)
            if other != item.name:
                raise DifferError(f"{key[1]} depends on the implementations of both {other} and {item.name}")
    if not result["rules"]:
        del result["rules"]
    return result


def _apart(title: str, document: Document, base: Document) -> Document:
    """A document whose types of buses have names of their own where they are not those of `base`."""
    copied = deepcopy(document)
    for name, entry in document.get("bus_types", {}).items():
        there = base.get("bus_types", {}).get(name)
        if there is None or _plain(there) == _plain(entry):
            continue
        other = f"{name} in {title}"
        copied["bus_types"][other] = copied["bus_types"].pop(name)
        for user in (
            *copied.get("buses", {}).values(),
            *copied["bus_types"].values(),
            *copied.get("connections", {}).values(),
        ):
            if user.get("type") == name:
                user["type"] = other
            if name in user.get("protocols", ()):
                user["protocols"] = [other if one == name else one for one in user["protocols"]]
    return copied


def _plain(entry: Any) -> Any:
    return {key: value for key, value in entry.items() if key != "source"} if isinstance(entry, dict) else entry


@dataclass
class _Merger:
    """Merges what the implementations of one subsystem give into `result`."""

    subsystem: Subsystem
    result: Document
    places: dict[Key, Place]
    changed: dict[Key, None] = field(default_factory=dict)

    def merge(self, variants: Sequence[Document]) -> None:
        self._same(variants)
        for catalogue in CATALOGUES:
            for there in variants:
                for name, entry in there.get(catalogue, {}).items():
                    old = self.result.setdefault(catalogue, {}).setdefault(name, deepcopy(entry))
                    if _plain(old) != _plain(entry):
                        raise DifferError(self._differ(f"the figures of type {name}"))
        for section in SECTIONS:
            for name in variants[0].get(section, {}):
                entries = [there[section][name] for there in variants]
                if (section, name) != self.subsystem.key and any(_plain(one) != _plain(entries[0]) for one in entries):
                    self._entry(section, name, entries)
        self._lead([there.get(self.subsystem.key[0], {}).get(self.subsystem.name, {}) for there in variants])

    def _differ(self, what: str) -> str:
        listed = " and ".join(self.subsystem.classifiers[:3])
        return (
            f"{listed} differ in {what}, which alternatives of {self.subsystem.name} cannot: compare them as two roots"
        )

    def _same(self, variants: Sequence[Document]) -> None:
        """Refuse what is there with one implementation only, and other questions."""
        base = variants[0]
        for there in variants[1:]:
            for section in SECTIONS:
                apart = set(base.get(section, {})) ^ set(there.get(section, {}))
                if apart:
                    raise DifferError(self._differ(f"their {section} ({', '.join(sorted(apart)[:3])})"))
            for key in {*base, *there} - {*SECTIONS, *CATALOGUES}:
                if base.get(key) != there.get(key):
                    raise DifferError(self._differ(key))

    def _entry(self, section: str, name: str, entries: Sequence[Mapping[str, Any]]) -> None:
        """An entry that differs: by types of its own, or by lists."""
        self.changed[section, name] = None
        mine = self.result[section][name]
        has_types = section in ("threads", "devices")
        fields = [
            key for key in dict.fromkeys(key for entry in entries for key in entry if key != "source")
            if any(entry.get(key) != entries[0].get(key) for entry in entries)
        ]  # fmt: skip
        if has_types and "type" in mine:
            raise DifferError(self._differ(f"{name}, which has types to choose from itself"))
        typed = [key for key in fields if has_types and key not in OF_THE_COMPONENT]
        if typed:
            names = [f"{name} in {classifier}" for classifier in self.subsystem.classifiers]
            catalogue = self.result.setdefault(f"{section[:-1]}_types", {})
            for one, entry in zip(names, entries, strict=True):
                catalogue[one] = {key: deepcopy(entry[key]) for key in (*typed, "source") if key in entry}
                self.places[f"{section[:-1]}_types", one] = self.places.get(
                    (section, name), self.subsystem.component.place
                )
            for key in typed:
                mine.pop(key, None)
            mine.pop("source", None)
            mine["type"] = names
            self._tie(name, "type", names)
        for key in (item for item in fields if item not in typed):
            values = [entry.get(key, entry.get(STANDING_FOR.get(key, ""))) for entry in entries]
            if key not in LISTED.get(section, ()) or any(not isinstance(one, str | int) for one in values):
                raise DifferError(self._differ(f"the {key.replace('_', ' ')} of {name}"))
            mine[key] = list(dict.fromkeys(values))
            self._tie(name, key, values)

    def _lead(self, entries: Sequence[Mapping[str, Any]]) -> None:
        """The subsystem itself: its type is the implementation, with what flows count of it."""
        section, name = self.subsystem.key
        catalogue = self.result.setdefault(f"{section[:-1]}_types", {})
        fixed: dict[str, Any] = {"category": self.subsystem.component.category.replace(" ", "_")}
        for classifier, entry in zip(self.subsystem.classifiers, entries, strict=True):
            own = {key: deepcopy(value) for key, value in entry.items() if key not in OF_THE_COMPONENT}
            catalogue[classifier] = own
            self.places[f"{section[:-1]}_types", classifier] = self.subsystem.component.place
        for key in OF_THE_COMPONENT:
            if any(entry.get(key) != entries[0].get(key) for entry in entries):
                raise DifferError(self._differ(f"the {key.replace('_', ' ')} of {name}"))
            if key in entries[0]:
                fixed[key] = entries[0][key]
        listed = list(self.subsystem.classifiers)
        fixed["type"] = listed if len(listed) > 1 else listed[0]
        self.result.setdefault(section, {})[name] = fixed
        self.places.setdefault((section, name), self.subsystem.component.place)

    def _tie(self, name: str, key: str, values: Sequence[Any]) -> None:
        """Rules: with an implementation the value that it gives."""
        for classifier, value in zip(self.subsystem.classifiers, values, strict=True):
            mine, theirs = _quoted(self.subsystem.name), _quoted(name)
            self.result["rules"].append(
                f"{mine}.type == {_quoted(classifier)} implies {theirs}.{key} == {_value(key, value)}"
            )


def _quoted(name: str) -> str:
    """A name in a rule."""
    return "'" + name + "'" if "'" not in name else f'"{name}"'


def _value(key: str, value: Any) -> str:
    return _quoted(value) if key in ("type", "processor", "bus") else str(value)
