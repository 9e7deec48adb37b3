"""Texts and paths in Python launch files: the everyday methods of ``str`` and ``pathlib.Path``, and ``os.path``.

A path is a text. A text with a substitution that is still to be done is open: what depends on its characters is not
known, but its folders are, as far as no substitution is touched.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from dse.importers.allowance import MOST_TEXT, TooMuchError, spend, spend_text
from dse.importers.ros2.launch.actions import as_text
from dse.importers.ros2.launch.operations import counted, is_open

FILE = "$(filename)"
"""The substitution in place of ``__file__``."""
SAFE = (
    *("lower", "upper", "title", "capitalize", "casefold", "swapcase", "strip", "lstrip", "rstrip"),
    *("startswith", "endswith", "removeprefix", "removesuffix", "split", "rsplit", "splitlines", "partition"),
    *("rpartition", "find", "rfind", "count", "isdigit", "isdecimal", "isnumeric", "isalpha", "isalnum", "islower"),
    *("isupper", "isspace"),
)
"""Methods of a text whose result is about as long as the text."""
SAME = ("__str__", "__fspath__", "as_posix", "resolve", "absolute", "expanduser", "abspath", "realpath", "normpath")
"""Functions that only write a path in another way."""
_FIELD = re.compile(r"\{\{|\}\}|\{(\w*)\}|[{}]")
_PERCENT = re.compile(r"%%|%[sd]|%")


def method_of_text(name: str, owner: str, values: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """The result of a method of a text or path; NotImplemented where it is not known.

    Examples
    --------
    >>> method_of_text("startswith", "robot_1", ["robot"], {}), method_of_text("joinpath", "/a", ["b", "c"], {})
    (True, '/a/b/c')
    >>> method_of_text("split", "$(var x)", [","], {})
    NotImplemented
    """
    if name in SAME:
        return owner
    if name == "joinpath" and not named:
        return path_of([owner, *values])
    if is_open(owner) and name not in ("join", "format"):
        return NotImplemented
    if name == "format":
        return _formatted(owner, values, named)
    if named:
        return NotImplemented
    if name == "join":
        return _joined(owner, values)
    if any(map(is_open, values)):
        return NotImplemented
    if name == "replace":
        return _replaced(owner, values)
    return _safe(name, owner, values) if name in SAFE else NotImplemented


def _safe(name: str, owner: str, values: Sequence[Any]) -> Any:
    spend(1 + len(owner) // 32)
    try:
        result = getattr(owner, name)(*(tuple(item) if isinstance(item, list) else item for item in values))
    except (TypeError, ValueError):
        return NotImplemented
    if isinstance(result, list | tuple):
        return list(counted(result))
    return spend_text(result) if isinstance(result, str) else result


def _joined(owner: str, values: Sequence[Any]) -> Any:
    if len(values) != 1 or not isinstance(values[0], list | tuple):
        return NotImplemented
    texts = [as_text(item) for item in counted(values[0])]
    if sum(map(len, texts)) + len(owner) * len(texts) > MOST_TEXT:
        raise TooMuchError(f"a text of more than {MOST_TEXT:,} characters")
    return spend_text(owner.join(texts))


def _replaced(owner: str, values: Sequence[Any]) -> Any:
    if len(values) != 2 or not all(isinstance(item, str) for item in values):
        return NotImplemented
    old, new = values
    if len(owner) + owner.count(old) * len(new) > MOST_TEXT:
        raise TooMuchError(f"a text of more than {MOST_TEXT:,} characters")
    return spend_text(owner.replace(old, new))


def _formatted(owner: str, values: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """``"{} {0} {name}".format(...)``, without formats of numbers."""
    pieces, end, number = [], 0, 0
    for item in _FIELD.finditer(owner):
        pieces.append(owner[end : item.start()])
        end = item.end()
        if item[0] in ("{{", "}}"):
            pieces.append(item[0][0])
            continue
        if item[1] is None:
            return NotImplemented
        key = item[1] or str(number)
        number += not item[1]
        if key.isdecimal() and len(key) < 4 and int(key) < len(values):
            pieces.append(as_text(values[int(key)]))
        elif key in named:
            pieces.append(as_text(named[key]))
        else:
            return NotImplemented
    return _together([*pieces, owner[end:]])


def by_percent(owner: str, value: Any) -> Any:
    """``"%s/%d" % (a, b)``; NotImplemented of other formats."""
    values = list(value) if isinstance(value, list | tuple) else [value]
    pieces, end = [], 0
    for item in _PERCENT.finditer(owner):
        pieces.append(owner[end : item.start()])
        end = item.end()
        if item[0] == "%%":
            pieces.append("%")
        elif item[0] == "%" or not values:
            return NotImplemented
        else:
            pieces.append(as_text(values.pop(0)))
    return NotImplemented if values else _together([*pieces, owner[end:]])


def with_format(value: Any, conversion: int, form: str) -> Any:
    """A value as an f-string has it; NotImplemented for formats of values that are not known.

    >>> with_format(0.5, -1, ".2f"), with_format("$(var x)", -1, "")
    ('0.50', '$(var x)')
    """
    if not form and conversion in (-1, ord("s")):
        return value
    if is_open(value) or not re.fullmatch(r"[<>^=]?[+-]?0?\d{0,2}(\.\d{1,2})?[sdfegx%]?", form):
        return NotImplemented
    try:
        shown = repr(value) if conversion in (ord("r"), ord("a")) else str(value) if conversion == ord("s") else value
        return spend_text(format(shown, form))
    except (TypeError, ValueError, OverflowError):
        return NotImplemented


def _together(parts: Sequence[str]) -> str:
    if sum(map(len, parts)) > MOST_TEXT:
        raise TooMuchError(f"a text of more than {MOST_TEXT:,} characters")
    return spend_text("".join(parts))


# --- paths


def path_of(parts: Sequence[Any]) -> str:
    """A path of its parts; what begins anew, at the root or with a folder that a substitution gives, counts alone.

    >>> path_of(["$(find-pkg-share p)", "config", "a.yaml"]), path_of(["a", "/b"]), path_of([])
    ('$(find-pkg-share p)/config/a.yaml', '/b', '.')
    """
    path = ""
    for part in map(as_text, parts):
        if part.startswith("/") or part.startswith("$(find-pkg-share "):
            path = part
        elif part:
            path = f"{path.rstrip('/')}/{part}" if path else part
    return spend_text(path or ".")


def _put_together(values: Sequence[Any]) -> str:
    """``os.path.join``, which keeps a slash at the end.

    >>> _put_together(["a", "", "b", ""]), _put_together(["a", "/b"])
    ('a/b/', '/b')
    """
    parts = [as_text(item) for item in values]
    path = path_of(parts) if any(parts) else ""
    return f"{path}/" if path and len(parts) > 1 and not parts[-1] and not path.endswith("/") else path


def _parent_of(path: str) -> Any:
    """The folder that has a file; NotImplemented where a substitution says which.

    >>> _parent_of("$(find-pkg-share p)/a/b.yaml"), _parent_of("$(filename)"), _parent_of("$(var x)")
    ('$(find-pkg-share p)/a', '$(dirname)', NotImplemented)
    """
    if path == FILE:
        return "$(dirname)"
    folder, _, name = path.rstrip("/").rpartition("/")
    if ")" in name or "$(" in name:
        return f"{path}/.." if path in ("$(dirname)",) or path.endswith("/..") else NotImplemented
    if name == "..":
        return f"{path}/.."
    return folder or ("/" if path.startswith("/") else ".")


def _name_of(path: str) -> Any:
    name = path.rstrip("/").rpartition("/")[2]
    return NotImplemented if ")" in name or "$(" in name else name


def _stem_of(path: str) -> Any:
    name = _name_of(path)
    return name if name is NotImplemented else name.rpartition(".")[0] or name


def _suffix_of(path: str) -> Any:
    name = _name_of(path)
    return name if name is NotImplemented else f".{name.rpartition('.')[2]}" if "." in name[1:] else ""


PARTS: Mapping[str, Callable[[str], Any]] = {
    "parent": _parent_of,
    "name": _name_of,
    "stem": _stem_of,
    "suffix": _suffix_of,
}
"""Functions for the attributes of a path, by the name of the attribute."""
OF_PATHS: Mapping[str, Callable[[Sequence[Any]], Any]] = {
    "join": _put_together,
    "dirname": lambda given: _parent_of(as_text(given[0])) if given else NotImplemented,
    "basename": lambda given: _name_of(as_text(given[0])) if given else NotImplemented,
    **dict.fromkeys(SAME, lambda given: as_text(given[0]) if given else NotImplemented),
}
"""The functions of ``os.path``."""
