"""The content of a problem, whatever file states it: includes merged in, samples at hand; and its hash.

Two problems are the same where their documents are, leaving out what nobody computes with (`WORDS`) and the order of
the sections and of the fields of a component. The order of names counts: it decides which of several designs with the
same objectives is shown.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from dse.spec.loading.reader import YamlNode
from dse.spec.loading.samples import SampleError, Samples
from dse.spec.schema.model import Catalogue, Spec

SECTIONS = tuple(name for name, info in Catalogue.model_fields.items() if str(info.annotation).startswith("dict["))
WORDS = ("description", "source", "assumptions", "imported", "ros2")
"""Keys that say something to readers and to other tools only."""


def merged_document(trees: Sequence[YamlNode], samples: Samples, sizes: Mapping[str, int]) -> dict[str, Any]:
    """Plain data of a problem: the main file first, then what it includes; samples as a list, with their unit.

    Connections that name a message have the `sizes` of theirs, in bytes, instead.
    """
    main, *others = (tree.to_data() for tree in trees)
    data = {key: value for key, value in main.items() if key != "include"}
    for section in SECTIONS:
        for other in others:
            if other.get(section):
                data[section] = {**(data.get(section) or {}), **other[section]}
    for other in others:
        if other.get("assumptions"):
            data["assumptions"] = [*_listed(data.get("assumptions")), *_listed(other["assumptions"])]
    for path, texts in samples.items():
        if not isinstance(texts, SampleError):
            entry = {key: value for key, value in data["uncertainty"][path].items() if key not in ("column", "unit")}
            unit = data["uncertainty"][path].get("unit")
            entry["samples"] = [f"{text} {unit}" if unit else text for text in texts]
            data["uncertainty"] = {**data["uncertainty"], path: entry}
    return _with_sizes(data, sizes)


def _with_sizes(data: dict[str, Any], sizes: Mapping[str, int]) -> dict[str, Any]:
    if not sizes:
        return data
    connections = dict(data["connections"])
    for name, size in sizes.items():
        named = connections[name]
        rest = {key: value for key, value in named.items() if key not in ("message", "lengths")}
        source = named.get("source") or f"size of {named['message']}"
        connections[name] = {**rest, "data_size": f"{size} B", "source": source}
    return {key: value for key, value in data.items() if key != "messages"} | {"connections": connections}


def _listed(value: Any) -> list[Any]:
    if value is None:
        return []
    return value if isinstance(value, list) else [value]


def identity_of(document: Mapping[str, Any]) -> str:
    """The digest of what a document means; see the head of this module.

    SHA-256 in hexadecimal over canonical JSON. Comments, layout, and the order of sections and of fields do not count;
    the order of names and of options does.
    """
    text = json.dumps(_canonical(document), ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _canonical(document: Mapping[str, Any]) -> dict[str, Any]:
    """A document without descriptive keys, sections in the order of the schema, fields in that of their names.

    >>> _canonical({"threads": {"b": {"source": "x", "period": "1 ms"}, "a": {}}, "dse": 1, "source": "y"})
    {'threads': {'b': {'period': '1 ms'}, 'a': {}}, 'dse': 1}
    """
    fields = [info.alias or name for name, info in Spec.model_fields.items()]
    order = {key: position for position, key in enumerate(fields)}
    keys = sorted((key for key in document if key not in WORDS), key=lambda key: order.get(key, len(order)))
    ordered = {key: document[key] for key in keys if document[key] is not None}
    for section in SECTIONS:
        if isinstance(ordered.get(section), dict):
            ordered[section] = {name: _fields(entry) for name, entry in ordered[section].items()}
    return ordered


def _fields(entry: Any) -> Any:
    if not isinstance(entry, dict):
        return entry
    return {key: entry[key] for key in sorted(entry) if key not in WORDS}


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[str]:
    """The differences in meaning between two documents, in words; `one` is the earlier.

    Sentences with the path of each difference, such as ``threads.nav.period``; used to say what changed since a result
    was written.
    """
    yield from _differing("", _canonical(one), _canonical(other))


def _differing(path: str, one: Any, other: Any) -> Iterator[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys((*one, *other)):
            place = f"{path}.{key}" if path else str(key)
            if key not in other:
                yield f"{place} is gone"
            elif key not in one:
                yield f"{place} is new"
            else:
                yield from _differing(place, one[key], other[key])
        if list(one) != list(other) and set(one) == set(other):
            yield f"{path} has its names in another order"
    elif one != other or type(one) is not type(other):
        yield f"{path} was {_brief(one)}, is {_brief(other)}"


def _brief(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 80 else f"{text[:79]}…"
