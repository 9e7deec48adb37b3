"""What Python's operators and methods make of values of which some are not known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dse.importers.launch.actions import Unknown, as_text
from dse.importers.launch.entities import Entity


def quoted(value: Any) -> str:
    """A value as one word of a substitution."""
    text = as_text(value)
    return f'"{text}"' if not text or (any(char.isspace() for char in text) and not text.startswith("$(")) else text


def sum_of(left: Any, right: Any) -> Any:
    """``left + right``, as far as it is known."""
    if isinstance(left, list | tuple) and isinstance(right, list | tuple):
        return [*left, *right]
    if isinstance(left, list | tuple) and isinstance(right, Unknown):
        return [*left, right]
    if isinstance(left, int | float) and isinstance(right, int | float):
        return left + right
    if isinstance(left, str | list | tuple) or isinstance(right, str):
        return as_text([left, right])
    return Unknown("a sum")


def is_open(value: Any) -> bool:
    """Whether a value is not known before the launch."""
    return isinstance(value, Unknown | Entity) or (isinstance(value, str) and "$(" in value)


def equal(left: Any, right: Any, is_equal: bool) -> Any:
    """Whether two values are equal, or differ; NotImplemented where one is not known."""
    if is_open(left) or is_open(right):
        return NotImplemented
    return (left == right) is is_equal


def entry_of(owner: Any, key: Any) -> Any:
    """``owner[key]``; NotImplemented where there is none."""
    if isinstance(owner, dict):
        return owner.get(key, NotImplemented) if isinstance(key, str) else NotImplemented
    if isinstance(owner, list | tuple) and isinstance(key, int) and -len(owner) <= key < len(owner):
        return owner[key]
    return NotImplemented


def _add(owner: Any, given: list[Any]) -> Any:
    """An action more for a launch description, or an item for a list."""
    target = owner.children if isinstance(owner, Entity) else owner
    for item in given:
        more = item if isinstance(item, list | tuple) else [item]
        target += [one for one in more if isinstance(one, Entity)] if isinstance(owner, Entity) else [item]


def _extend(owner: Any, given: list[Any]) -> Any:
    if isinstance(owner, list) and given and isinstance(given[0], list | tuple):
        owner += given[0]


METHODS: Mapping[str, Callable[[Any, list[Any]], Any]] = {
    "add_action": _add,
    "append": _add,
    "extend": _extend,
    "items": lambda owner, given: [[key, value] for key, value in owner.items()] if isinstance(owner, dict) else owner,
    "perform": lambda owner, given: owner,
    "lower": lambda owner, given: owner.lower() if isinstance(owner, str) and "$(" not in owner else owner,
    "strip": lambda owner, given: owner.strip() if isinstance(owner, str) else owner,
}
