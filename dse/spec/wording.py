"""What pydantic finds in a problem file, in plain words: with its place, and what is allowed as a hint."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from dse.errors import Diagnostic
from dse.spec.fields import describe
from dse.spec.frames import MODELS as FRAMES
from dse.spec.hardware import TransmissionTime
from dse.spec.model import Catalogue, PathElement, Spec
from dse.spec.parts import Model
from dse.spec.reader import PathPart

if TYPE_CHECKING:
    from dse.spec.load import Source

BUS_SCHEDULE = "put a device of `category: bus` with `period`, `clock` and `offset` before the message that it sends"
"""How the schedule of a bus is said."""


def translated(item: ErrorDetails, source: Source, root: type[Model]) -> Diagnostic:
    """A finding of pydantic with its place in the file; `root` is what the file was read as."""
    path, kind = list(item["loc"]), item["type"]
    if path and path[-1] == "[key]":
        return source.diagnostic(path[:-1], *_words(item), at_key=True)
    if kind == "extra_forbidden":
        return source.diagnostic(path, *_unknown_key(path, source, root), at_key=True)
    if kind == "missing":
        return source.diagnostic(path[:-1], f"missing key `{path[-1]}`", at_key=True)
    return source.diagnostic(path, *_words(item))


def _words(item: ErrorDetails) -> tuple[str, str]:
    """Message and hint."""
    context, got = item.get("ctx", {}), describe(item["input"])
    match item["type"]:
        case "dse":
            return str(context["message"]), str(context["hint"])
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"expected a mapping, got {got}", ""
        case "literal_error":
            return _literal(str(context["expected"]), item["input"])
        case "bool_type":
            return f"expected true or false, got {got}", ""
        case "string_type":
            return f"expected text, got {got}", ""
        case "too_short":
            return "expected at least one entry, got an empty list", ""
    return item["msg"], ""


def _literal(expected: str, value: Any) -> tuple[str, str]:
    allowed = re.findall(r"'([^']*)'", expected) or [expected]
    words = f"expected {allowed[0]}" if len(allowed) == 1 else f"expected one of {', '.join(allowed)}"
    return f"{words}, got {describe(value)}", suggestion(value, allowed)


def suggestion(value: Any, allowed: Sequence[str]) -> str:
    """``did you mean "x"?`` for the closest of the allowed texts, or ""."""
    close = get_close_matches(value, allowed, 1, 0.6) if isinstance(value, str) and len(value) < 200 else []
    return f'did you mean "{close[0]}"?' if close else ""


def _unknown_key(path: Sequence[PathPart], source: Source, root: type[Model]) -> tuple[str, str]:
    key = str(path[-1])
    if len(path) == 1 and root is Catalogue and key in Spec.model_fields:
        return "this key has no place in an included file", ""
    if len(path) == 3 and path[0] in ("buses", "bus_types") and key in ("clock", "offset"):
        return f"a bus has no {key}: its schedule is that of its messages", BUS_SCHEDULE
    fields = _model_at(path[:-1], root).model_fields
    if "totals" in fields and source.node.known(["totals", key]) == ("totals", key):
        return "unknown key", f"it is a declared total: `totals: {{{key}: …}}`"
    allowed = [info.alias or name for name, info in fields.items()]
    return "unknown key", suggestion(key, allowed) or f"allowed: {', '.join(allowed)}"


def _model_at(path: Sequence[PathPart], root: type[Model]) -> type[BaseModel]:
    """The class of the mapping at a place."""
    if not path:
        return root
    if path[-1] in FRAMES:
        return FRAMES[str(path[-1])]
    if "path" in path[2:]:
        return PathElement
    if len(path) > 2:
        return TransmissionTime
    model = get_args(Catalogue.model_fields[str(path[0])].annotation)[1]
    assert isinstance(model, type) and issubclass(model, Model)
    return model
