"""Findings of pydantic in a problem file in plain words, with the place, and what is allowed as a hint."""

from __future__ import annotations

import re
from collections.abc import Sequence
from types import UnionType
from typing import Annotated, Any, TypeGuard, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from dse.spec.loading.reader import PathPart, Source, YamlNode
from dse.spec.schema.fields import describe, kind_of
from dse.spec.schema.frames import MODELS as FRAMES
from dse.spec.schema.model import Catalogue, Spec
from dse.spec.schema.parts import SpecMapping
from dse.support.errors import Diagnostic, did_you_mean

BUS_SCHEDULE = "put a device of `category: bus` with `period`, `clock` and `offset` before the message that it sends"
"""How the schedule of a bus is said."""

RATES = ("frequency", "freq", "rate", "hz", "fps")
MEANT: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(RATES, ("period",)),
    **dict.fromkeys(("wcet", "bcet", "acet", "exec_time", "execution_time", "runtime"), ("compute_execution_time",)),
    **dict.fromkeys(("wcrt", "response"), ("response_time",)),
    **dict.fromkeys(("event", "event_triggered", "event_driven", "triggered"), ("aperiodic", "dispatch_protocol")),
    **dict.fromkeys(("timer", "timed", "time_triggered", "cyclic", "time_driven"), ("periodic", "dispatch_protocol")),
    **dict.fromkeys(("cpu", "ecu", "computer", "host", "machine"), ("processor",)),
    **dict.fromkeys(("cpus", "ecus", "computers", "hosts", "machines"), ("processors",)),
    **dict.fromkeys(("tasks", "nodes", "callbacks", "runnables"), ("threads",)),
    **dict.fromkeys(("sensors", "actuators"), ("devices",)),
    **dict.fromkeys(("networks", "links"), ("buses",)),
    **dict.fromkeys(("topics", "channels", "signals"), ("connections",)),
    **dict.fromkeys(("chains", "paths"), ("flows",)),
    **dict.fromkeys(("constraints", "limits"), ("requirements", "rules")),
    **dict.fromkeys(("goals", "optimise", "optimize", "minimise", "minimize"), ("objectives",)),
    **dict.fromkeys(("bitrate", "bit_rate", "baudrate", "baud_rate", "baud"), ("bandwidth",)),
    **dict.fromkeys(("size", "payload", "message_size", "bytes", "dlc"), ("data_size",)),
    **dict.fromkeys(("phase",), ("offset",)),
    **dict.fromkeys(("delay",), ("latency",)),
    **dict.fromkeys(("cost", "costs"), ("price",)),
    **dict.fromkeys(("src", "sender", "publisher"), ("from",)),
    **dict.fromkeys(("dst", "dest", "receiver", "subscriber"), ("to",)),
}
"""Other names of keys and values, with what the format calls them."""


def is_of_wrong_items(item: ErrorDetails) -> bool:
    """Whether a list counts as too short only because each of its entries is wrong, which is a finding of its own."""
    return item["type"] == "too_short" and bool(item["input"])


def translated(item: ErrorDetails, source: Source, root: type[SpecMapping]) -> Diagnostic:
    """A finding of pydantic with its place in the file; `root` is what the file was read as.

    A `Diagnostic` in plain words: unknown keys with the closest known key, missing keys, wrong types with what is
    allowed.
    """
    path, kind = list(item["loc"]), item["type"]
    if not path:  # the file may be any that a problem file includes: nothing of it is quoted
        return source.diagnostic([], f"expected a mapping, got {kind_of(item['input'])}")
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
    return f"{words}, got {describe(value)}", _suggestion(value, allowed)


def _suggestion(value: Any, allowed: Sequence[str]) -> str:
    """``did you mean "x"?`` for the allowed text of another name, or the closest one; or ""."""
    if not isinstance(value, str):
        return ""
    word = value.casefold().replace(" ", "_").replace("-", "_")
    if word not in allowed:
        for meant in MEANT.get(word, ()):
            if meant in allowed:
                more = " It is a time: 20 ms for 50 Hz" if word in RATES else ""
                return f'did you mean "{meant}"?{more}'
    return did_you_mean(value, allowed)


def _unknown_key(path: Sequence[PathPart], source: Source, root: type[SpecMapping]) -> tuple[str, str]:
    key = str(path[-1])
    if len(path) == 1 and root is Catalogue and key in Spec.model_fields:
        return "this key has no place in an included file", ""
    if len(path) == 3 and path[0] in ("buses", "bus_types") and key in ("clock", "offset"):
        return f"a bus has no {key}: its schedule is that of its messages", BUS_SCHEDULE
    fields = _model_at(path[:-1], root).model_fields
    if comma := _decimal_comma(key, source.node.at(path[:-1])):
        return "unknown key", f'decimals are written with a point: "{comma}"'
    if "totals" in fields and source.node.known(["totals", key]) == ("totals", key):
        return "unknown key", f"it is a declared total: `totals: {{{key}: …}}`"
    allowed = [info.alias or name for name, info in fields.items()]
    return "unknown key", _suggestion(key, allowed) or f"allowed: {', '.join(allowed)}"


def _decimal_comma(key: str, node: YamlNode) -> str:
    """The number that ``{price: 60,50 EUR}`` means, written with a point (YAML reads two entries); else ""."""
    keys = list(node.value) if isinstance(node.value, dict) else []
    if not key[:1].isdigit() or key not in keys[1:]:
        return ""
    assert isinstance(node.value, dict)
    before = node.value[keys[keys.index(key) - 1]].node.value
    is_number = isinstance(before, int) and not isinstance(before, bool)
    return f"{before}.{key}" if is_number and node.value[key].node.value is None else ""


def _model_at(path: Sequence[PathPart], root: type[SpecMapping]) -> type[BaseModel]:
    """The class of the mapping at a place, as the annotations around it say.

    A part of the path that is no key (the tag of a union) leads nowhere.
    """
    if path and path[-1] in FRAMES:
        return FRAMES[str(path[-1])]
    places: list[Any] = [root]
    for part in path:
        places = [inner for place in places for inner in _inside(place, part)] or places
    return next(place for place in places if _is_model(place))


def _inside(annotation: Any, part: PathPart) -> list[Any]:
    """The types that may stand at a key or position of a value that is annotated so: classes, mappings and lists."""
    if _is_model(annotation):
        fields = annotation.model_fields
        named = next((info for name, info in fields.items() if part in (name, info.alias)), None)
        return [] if named is None else _alternatives(named.annotation)
    kind, arguments = get_origin(annotation), get_args(annotation)
    return _alternatives(arguments[-1 if kind is dict else 0]) if kind in (dict, tuple) else []


def _alternatives(annotation: Any) -> list[Any]:
    """The parts of a union, and what is annotated without its annotations."""
    kind, arguments = get_origin(annotation), get_args(annotation)
    if kind is Annotated:
        return _alternatives(arguments[0])
    if kind in (Union, UnionType):
        return [inner for part in arguments for inner in _alternatives(part)]
    return [annotation]


def _is_model(annotation: Any) -> TypeGuard[type[BaseModel]]:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
