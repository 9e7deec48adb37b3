"""The JSON Schema of the problem file, generated from the model, for completion and checks in editors."""

from __future__ import annotations

from typing import Any

from dse.spec.model import Spec

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The schema of a problem file as plain data, keys as in the file."""
    schema = Spec.model_json_schema(by_alias=True)
    head = {"$schema": DIALECT, "title": "dse problem file"}
    return {**head, **simplified({key: value for key, value in schema.items() if key not in head})}


def simplified(part: Any) -> Any:
    """A schema without what editors stumble over: generated titles, defaults of null, ``oneOf``."""
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
