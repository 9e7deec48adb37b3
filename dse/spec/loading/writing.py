"""Plain data as the text of a YAML file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from dse.support.units.text import Hexadecimal

_PLAIN = re.compile(r"[A-Za-z_][\w.%+-]*( [\w.%+-]+)*|[0-9]+(\.[0-9]+)?( ?[A-Za-z%/]+)+")
_RESERVED = re.compile(r"(?i)true|false|null|yes|no|on|off|y|n|[0-9.]+e[0-9]+")


def yaml_text(value: str) -> str:
    """A scalar that YAML reads back as this very text, in block and flow context alike.

    >>> yaml_text("10 ms"), yaml_text("a: b"), yaml_text("no")
    ('10 ms', '"a: b"', '"no"')
    """
    if _PLAIN.fullmatch(value) and not _RESERVED.fullmatch(value):
        return value
    # halves of characters, of names of files that are no UTF-8, are none in YAML, escaped or not
    quoted = json.dumps(value.encode("utf-8", "replace").decode(), ensure_ascii=False)
    return "".join(char if char.isprintable() else f"\\U{ord(char):08x}" for char in quoted)


LINE = 110


def block_text(data: Mapping[str, Any]) -> str:
    """Plain data as YAML in blocks, lists of scalars in brackets.

    >>> print(block_text({"buses": {"can": {"type": ["a", "no"]}}, "rules": [{"if": "x"}], "flows": {}}), end="")
    buses:
      can:
        type: [a, "no"]
    rules:
      - if: x
    flows: {}
    """
    return "".join(f"{line}\n" for line in _block(data, ""))


def _block(value: Any, margin: str) -> Iterator[str]:
    """The lines of a mapping, or of a list that holds more than scalars."""
    pairs = value.items() if isinstance(value, Mapping) else (("-", item) for item in value)
    for key, item in pairs:
        head = f"{margin}-" if key == "-" and not isinstance(value, Mapping) else f"{margin}{yaml_text(str(key))}:"
        if not item or not isinstance(item, Mapping | list) or _is_flat(item):
            yield f"{head} {_flow(item)}"
        elif head.endswith(":"):
            yield head
            yield from _block(item, f"{margin}  ")
        else:
            first, *rest = _block(item, f"{margin}  ")
            yield from (f"{head} {first.strip()}", *rest)


def _is_flat(item: Any) -> bool:
    """Whether it is a list of scalars that fit on a line."""
    is_simple = isinstance(item, list) and not any(isinstance(part, Mapping | list) for part in item)
    return is_simple and len(_flow(item)) < LINE


def _flow(value: Any) -> str:
    """A scalar, a list of scalars or an empty collection in one line."""
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, Hexadecimal):
        return f"{value}"
    return yaml_text(value) if isinstance(value, str) else json.dumps(value)
