"""Models of other formats as trees of problem files, and files that decide over one laid over what it states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dse.importers.registry import Imported, Key, Place
from dse.spec.loading.document import SECTIONS
from dse.spec.loading.reader import MappingEntry, YamlNode
from dse.support.errors import Diagnostic, did_you_mean
from dse.support.units import shown

DECIDING = ("of", "root", "mode", "library")
"""Keys that name a model; in what they lead to they are no more."""
OWN = (
    *("flows", "metrics", "totals", "uncertainty", "executors", "reservations"),
    *("processor_types", "bus_types", "device_types", "thread_types"),
)
"""Sections to which a file beside a model may add names of its own."""
SLOTS = ("processors", "buses", "devices", "threads")
LISTS = ("requirements", "assumptions", "rules", "objectives")


def tree_of(imported: Imported, file: str) -> YamlNode:
    """The document of a model as a tree whose values have the places that the model gives them.

    A `YamlNode` that loading treats as a file; diagnostics then point into the imported model.
    """
    return _node(imported.document, (), imported.places, Place(file, 0, 0))


def _node(value: Any, key: Key, places: Any, around: Place) -> YamlNode:
    place = places.get(key, around)
    if isinstance(value, dict):
        entries = {}
        for name, inner in value.items():
            at = places.get((*key, name), place)
            entries[name] = MappingEntry(at.line, at.column, _node(inner, (*key, name), places, place), at.file)
        return YamlNode(place.line, place.column, entries, place.file)
    if isinstance(value, list | tuple):
        items = tuple(_node(inner, (*key, number), places, place) for number, inner in enumerate(value))
        return YamlNode(place.line, place.column, items, place.file)
    return YamlNode(place.line, place.column, value, place.file)


def _entries(node: YamlNode, *path: str) -> dict[str, MappingEntry]:
    """The entries of the mapping at a path; none where there is none."""
    entries = node.at(path).value if len(node.known(path)) == len(path) else None
    return entries if isinstance(entries, dict) else {}


def offered(node: YamlNode) -> dict[str, dict[str, list[str]]]:
    """The types that a file offers for components, by section and name.

    Section to component to names of types. The importer takes these as the options of the component.
    """
    offers: dict[str, dict[str, list[str]]] = {}
    for section in SLOTS:
        for name, entry in _entries(node, section).items():
            stated = entry.node.to_data()
            types = stated.get("type") if isinstance(stated, dict) else None
            listed = [types] if isinstance(types, str) else types if isinstance(types, list) else []
            texts = [item for item in listed if isinstance(item, str)]
            if texts:
                offers.setdefault(section, {})[name] = texts
    return offers


def strangers(node: YamlNode, model: YamlNode, file: str) -> Iterator[Diagnostic]:
    """The mistakes in a file that names components and connections that the model does not have.

    Sections that a deciding file may extend are left out, and connections with `from` and `to` of their own. Each
    `Diagnostic` has the closest name of the model as a hint.
    """
    homes = {name: section for section in SECTIONS if section not in OWN for name in _entries(model, section)}
    for section in SECTIONS:
        if section in OWN:
            continue
        for name, entry in _entries(node, section).items():
            if name in _entries(model, section) or (section == "connections" and _leads(node, name)):
                continue
            hint = f"it is among its {homes[name]}" if name in homes else did_you_mean(name, homes)
            if section == "connections" and not hint:
                hint = "a connection of your own states `from` and `to`"
            message = f"the model has no {shown(name)} among its {section}"
            yield Diagnostic(message, f"{section}.{name}", file, entry.line, entry.column, hint)


def _leads(node: YamlNode, name: str) -> bool:
    """Whether a connection of a deciding file states both of its ends, so that it is not one of the model's."""
    return {"from", "to"} <= set(_entries(node, "connections", name))


def overlaid(node: YamlNode, model: YamlNode) -> YamlNode:
    """The model with the fields of a deciding file in place of its own, and the lists of both joined.

    A new tree: scalars of the deciding file replace those of the model, requirements, rules and objectives are
    appended.
    """
    mine, theirs = (part.value if isinstance(part.value, dict) else {} for part in (node, model))
    merged = {key: entry for key, entry in mine.items() if key not in DECIDING}
    for key, entry in theirs.items():
        own = merged.get(key)
        if own is None:
            merged[key] = entry
        elif key in LISTS and isinstance(own.node.value, tuple) and isinstance(entry.node.value, tuple):
            both = YamlNode(own.node.line, own.node.column, (*own.node.value, *entry.node.value))
            merged[key] = MappingEntry(own.line, own.column, both)
        elif key in SECTIONS:
            merged[key] = _section(own, entry)
    if "unread" in theirs and "unread" not in mine:
        merged["unread"] = _still_unread(theirs["unread"], _entries(node, "flows"))
    return YamlNode(node.line, node.column, merged, node.file)


def _still_unread(entry: MappingEntry, stated: Mapping[str, MappingEntry]) -> MappingEntry:
    """The flows that the model could not give, but those that the file states itself."""
    listed = entry.node.value if isinstance(entry.node.value, dict) else {}
    left = {name: flow for name, flow in listed.items() if name not in stated}
    return MappingEntry(
        entry.line, entry.column, YamlNode(entry.node.line, entry.node.column, left, entry.node.file), entry.file
    )


def _section(own: MappingEntry, entry: MappingEntry) -> MappingEntry:
    """A section: the model's components in their order, with the fields that the file states instead."""
    mine = own.node.value if isinstance(own.node.value, dict) else None
    theirs = entry.node.value if isinstance(entry.node.value, dict) else {}
    if mine is None:
        return own
    section = {name: _component(mine.get(name), there) for name, there in theirs.items()}
    section |= {name: here for name, here in mine.items() if name not in section}
    return MappingEntry(own.line, own.column, YamlNode(own.node.line, own.node.column, section))


def _component(own: MappingEntry | None, entry: MappingEntry) -> MappingEntry:
    if own is None:
        return entry
    mine, theirs = own.node.value, entry.node.value
    if not isinstance(mine, dict) or not isinstance(theirs, dict):
        return own
    if "executor" in mine and "processor" not in mine:  # the executor says where its threads run
        theirs = {key: value for key, value in theirs.items() if key != "processor"}
    fields = {**theirs, **mine}
    if "parameters" in theirs and "parameters" in mine:  # each has fields of its own: a range, a value
        fields["parameters"] = _section(mine["parameters"], theirs["parameters"])
    return MappingEntry(own.line, own.column, YamlNode(own.node.line, own.node.column, fields))
