"""The JSON Schema of the problem file, generated from the model, for completion and checks in editors."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

from dse.spec.schema import model
from dse.spec.schema.model import Spec

DIALECT = "https://json-schema.org/draft/2020-12/schema"
WITH_UNIT = " with its unit: "


def json_schema() -> dict[str, Any]:
    """The schema of a problem file as plain data, keys as in the file; each property with its meaning and examples.

    JSON Schema, draft 2020-12; what `dse schema` prints and editors use for completion.
    """
    schema = Spec.model_json_schema(by_alias=True)
    head = schema_head("problem")
    whole = {**head, **simplified({key: value for key, value in schema.items() if key not in head})}
    for name, part in (("Spec", whole), *whole["$defs"].items()):
        classes = [base.__name__ for base in getattr(model, name).__mro__]
        for key, item in part["properties"].items():
            _describe(item, classes, key)
    return whole


def schema_head(name: str) -> dict[str, Any]:
    """The identification of a schema: that of a file of ``dse-NAME/1``, or of a problem file.

    The keys ``$schema``, ``$id`` and ``title``.
    """
    title = "dse problem file" if name == "problem" else f"dse-{name}/1"
    return {"$schema": DIALECT, "$id": f"urn:x-dse:{name}:1", "title": title}


def _describe(item: dict[str, Any], classes: list[str], key: str) -> None:
    """Put the meaning of a property, the units of its quantities and examples where an editor looks for them."""
    known = descriptions()
    described = next((known[name][key] for name in classes if key in known.get(name, {})), None)
    if described is not None:
        quantities = dict.fromkeys(text for text in _texts(item) if WITH_UNIT in text)
        item["description"] = " ".join([described["means"], *quantities])
        item["examples"] = described["examples"]


@cache
def descriptions() -> dict[str, dict[str, dict[str, Any]]]:
    """By class and key, what a property ``means`` and ``examples`` of it.

    Read once from ``descriptions.yaml``: class to key to a mapping with ``means`` and ``examples``.
    """
    import yaml

    by_class: dict[str, dict[str, dict[str, Any]]] = yaml.safe_load(
        files("dse.spec.schema").joinpath("descriptions.yaml").read_text(encoding="utf-8")
    )
    return by_class


def _texts(part: Any) -> Iterator[str]:
    """The descriptions in a part of a schema."""
    if isinstance(part, list):
        for item in part:
            yield from _texts(item)
    elif isinstance(part, dict):
        if isinstance(part.get("description"), str):
            yield part["description"]
        for value in part.values():
            yield from _texts(value)


def simplified(part: Any) -> Any:
    """A schema without what editors stumble over: generated titles, defaults of null, ``oneOf``.

    A copy; ``oneOf`` becomes ``anyOf``, which editors report with better messages.
    """
    if isinstance(part, list):
        return [simplified(item) for item in part]
    if not isinstance(part, dict):
        return part
    kept = {key: simplified(value) for key, value in part.items() if not _is_noise(key, value)}
    if "oneOf" in kept:
        kept["anyOf"] = kept.pop("oneOf")
    return kept


def _is_noise(key: str, value: Any) -> bool:
    return (key == "title" and isinstance(value, str)) or (key == "default" and value in (None, {}, []))
