"""Functions of Python that launch files call on plain values: ``str``, ``len``, ``range``, ``zip`` and such."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dse.importers.ros2.launch.actions import as_text
from dse.importers.ros2.launch.operations import counted, is_open

MOST_DIGITS = 40


def _number(values: list[Any], kind: type[int] | type[float]) -> Any:
    """``int(x)`` or ``float(x)``; NotImplemented where that is not known."""
    if not values:
        return kind()
    value = values[0]
    if len(values) != 1 or is_open(value) or not isinstance(value, str | int | float):
        return NotImplemented
    try:
        return kind(value) if not isinstance(value, str) or len(value) < MOST_DIGITS else NotImplemented
    except (ValueError, OverflowError):
        return NotImplemented


def _range(arguments: list[Any]) -> Any:
    if not 1 <= len(arguments) <= 3 or not all(isinstance(item, int) for item in arguments):
        return NotImplemented
    try:
        values = range(*arguments)
        return list(counted(values))
    except (ValueError, OverflowError):
        return NotImplemented


def _list(values: list[Any]) -> Any:
    if not values:
        return []
    [value, *_] = values
    return list(counted(value)) if isinstance(value, list | tuple | dict) else value


def _of_lists(values: list[Any], act: Callable[..., Any]) -> Any:
    """The result of a function of lists, whose lengths are counted; NotImplemented where an argument is no list."""
    if not values or not all(isinstance(item, list | tuple) for item in values):
        return NotImplemented
    return [list(item) for item in act(*map(counted, values))]


def _length(values: list[Any]) -> Any:
    is_one = len(values) == 1 and isinstance(values[0], str | list | tuple | dict)
    return len(values[0]) if is_one and not is_open(values[0]) else NotImplemented


def _decided(values: list[Any], decides: bool) -> Any:
    """``any([...])`` or ``all([...])``."""
    if len(values) != 1 or not isinstance(values[0], list | tuple):
        return NotImplemented
    known = [bool(item) for item in counted(values[0]) if not is_open(item)]
    if decides in known:
        return decides
    return not decides if len(known) == len(values[0]) else NotImplemented


FUNCTIONS: Mapping[str, Callable[[list[Any]], Any]] = {
    "str": lambda given: as_text(given[0]) if given else "",
    "int": lambda given: _number(given, int),
    "float": lambda given: _number(given, float),
    "bool": lambda given: (NotImplemented if is_open(given[0]) else bool(given[0])) if given else False,
    "list": _list,
    "tuple": _list,
    "dict": lambda given: dict(counted(given[0])) if isinstance(given[0], dict) else NotImplemented,
    "range": _range,
    "len": _length,
    "zip": lambda given: _of_lists(given, lambda *lists: zip(*lists, strict=False)),
    "enumerate": lambda given: _of_lists(given[:1], enumerate) if len(given) == 1 else NotImplemented,
    "any": lambda given: _decided(given, True),
    "all": lambda given: _decided(given, False),
}
"""Functions by their names: the values that they are given to what they return."""
