"""What Python's operators and methods make of values of which some are not known."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any, TypeVar

from dse.importers.allowance import TooMuchError, spend, spend_text
from dse.importers.ros2.launch.actions import Unknown, as_text
from dse.importers.ros2.launch.entities import Entity

T = TypeVar("T", bound=Collection[Any])
MOST_BITS = 10_000
"""Whole numbers are not longer than this."""


def quoted(value: Any) -> str:
    """A value as one word of a substitution."""
    text = as_text(value)
    return f'"{text}"' if not text or (any(char.isspace() for char in text) and not text.startswith("$(")) else text


def counted(values: T) -> T:
    """Values that are copied, of which each uses up a piece of the allowance."""
    spend(len(values))
    return values


def sum_of(left: Any, right: Any) -> Any:
    """``left + right``, as far as it is known."""
    if isinstance(left, list | tuple) and isinstance(right, list | tuple):
        return [*counted(left), *counted(right)]
    if isinstance(left, list | tuple) and isinstance(right, Unknown):
        return [*counted(left), right]
    if isinstance(left, int | float) and isinstance(right, int | float):
        return _total(left, right)
    if isinstance(left, str | list | tuple) or isinstance(right, str):
        return as_text([left, right])
    return Unknown("a sum")


def _total(left: float, right: float) -> float:
    try:
        found = left + right
    except OverflowError:
        raise TooMuchError("a sum beyond all numbers") from None
    if isinstance(found, int) and found.bit_length() > MOST_BITS:
        raise TooMuchError("a number of too many digits")
    return found


def is_open(value: Any) -> bool:
    """Whether a value is not known before the launch."""
    return isinstance(value, Unknown | Entity) or (isinstance(value, str) and "$(" in value)


def equal(left: Any, right: Any, is_equal: bool) -> Any:
    """Whether two values are equal, or differ; NotImplemented where one is not known."""
    if is_open(left) or is_open(right):
        return NotImplemented
    return _is_same(left, right) is is_equal


def _is_same(left: Any, right: Any) -> bool:
    """Whether two values are equal, one entry after the other: lists may hold each other many times."""
    spend()
    if isinstance(left, list) and isinstance(right, list):
        return len(left) == len(right) and all(map(_is_same, left, right))
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(_is_same(item, right[key]) for key, item in left.items())
    return left is right if isinstance(left, Entity | Unknown) else bool(left == right)


def entry_of(owner: Any, key: Any) -> Any:
    """``owner[key]``; NotImplemented where there is none."""
    if isinstance(owner, dict):
        return owner.get(key, NotImplemented) if isinstance(key, str) else NotImplemented
    if isinstance(owner, list | tuple) and isinstance(key, int) and -len(owner) <= key < len(owner):
        return owner[key]
    return NotImplemented


def _add(owner: Any, given: list[Any]) -> Any:
    """An action more for a launch description, or an item for a list; unknown of anything else."""
    if isinstance(owner, list):
        owner += given
        return None
    if not isinstance(owner, Entity):
        return NotImplemented
    for item in given:
        more = counted(item) if isinstance(item, list | tuple) else [item]
        owner.children += [one for one in more if isinstance(one, Entity)]
    return None


def _extend(owner: Any, given: list[Any]) -> Any:
    if isinstance(owner, list) and given and isinstance(given[0], list | tuple):
        owner += counted(given[0])


def _items(owner: Any, given: list[Any]) -> Any:
    return [[key, value] for key, value in counted(owner).items()] if isinstance(owner, dict) else owner


METHODS: Mapping[str, Callable[[Any, list[Any]], Any]] = {
    "add_action": _add,
    "append": _add,
    "extend": _extend,
    "items": _items,
    "perform": lambda owner, given: owner,
    "lower": lambda owner, given: spend_text(owner.lower()) if isinstance(owner, str) and "$(" not in owner else owner,
    "strip": lambda owner, given: spend_text(owner.strip()) if isinstance(owner, str) else owner,
}
