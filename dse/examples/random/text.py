"""Documents of texts, lists and mappings as YAML: one component per line, the same bytes on every machine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def to_yaml(document: dict[str, Any]) -> str:
    """The text of a problem file.

    >>> print(to_yaml({"name": "one", "threads": {"a": {"period": ["10 ms", "20 ms"]}}}), end="")
    name: one
    <BLANKLINE>
    threads:
      a: {period: [10 ms, 20 ms]}
    """
    return "\n".join(_lines(document)) + "\n"


def _lines(document: dict[str, Any]) -> Iterator[str]:
    for key, value in document.items():
        if isinstance(value, dict):
            yield ""
            yield f"{key}:"
            yield from (f"  {name}: {_flow(body)}" for name, body in value.items())
        elif isinstance(value, list):
            yield ""
            yield f"{key}:"
            yield from (f"  - {_flow(item)}" for item in value)
        else:
            yield f"{key}: {value}"


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return str(value)
