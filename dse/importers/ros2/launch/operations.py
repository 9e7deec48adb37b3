"""Python's operators and methods on values of which some are not known."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeVar

from dse.importers.allowance import TooMuchError, spend, spend_text
from dse.importers.ros2.launch.actions import Unknown, as_text
from dse.importers.ros2.launch.entities import Entity

T = TypeVar("T", bound=Collection[Any])
NAMES = 8
"""The number of copied names that count as one piece of the allowance."""
MOST_BITS = 10_000
"""Whole numbers are not longer than this."""
NUMBERS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
ORDERS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def quoted(value: Any) -> str:
    """A value as one word of a substitution."""
    text = as_text(value)
    return f'"{text}"' if not text or (any(char.isspace() for char in text) and not text.startswith("$(")) else text


def counted(values: T) -> T:
    """Values that are copied, of which each uses up a piece of the allowance."""
    spend(len(values))
    return values


def sum_of(left: Any, right: Any) -> Any:
    """``left + right``, as far as it is known.

    Known numbers and lists are added, texts joined; `Unknown` where a part is only known at launch.
    """
    if isinstance(left, list | tuple) and isinstance(right, list | tuple):
        return [*counted(left), *counted(right)]
    if isinstance(left, list | tuple) and isinstance(right, Unknown):
        return [*counted(left), right]
    if isinstance(left, int | float) and isinstance(right, int | float):
        return _total(left, right)
    if isinstance(left, str | list | tuple) or isinstance(right, str):
        return as_text([left, right])
    return Unknown("a sum")


def reckoned(kind: type[ast.operator], left: Any, right: Any) -> Any:
    """The result of an arithmetic operator on two numbers; NotImplemented for other operands.

    Division by 0 gives NotImplemented, too; a number that is too large raises `TooMuchError`.
    """
    act = NUMBERS.get(kind)
    if act is None or not isinstance(left, int | float) or not isinstance(right, int | float):
        return NotImplemented
    return _total(left, right, act)


def _total(left: float, right: float, act: Callable[[Any, Any], Any] = operator.add) -> Any:
    try:
        total = act(left, right)
    except OverflowError:
        raise TooMuchError("a sum beyond all numbers") from None
    except (ZeroDivisionError, ValueError):
        return NotImplemented
    if isinstance(total, int) and total.bit_length() > MOST_BITS:
        raise TooMuchError("a number of too many digits")
    return total


def assigned(body: Sequence[ast.stmt]) -> list[str]:
    """The names that statements may change."""
    names = []
    for part in body:
        for item in ast.walk(part):
            spend()
            if isinstance(item, ast.Name) and _is_stored(item):
                names.append(item.id)
    return names


def leaves(body: Sequence[ast.stmt]) -> bool:
    """Whether statements may end the function or the round of a loop that they are in."""
    for part in body:
        for item in ast.walk(part):
            spend()
            if isinstance(item, ast.Return | ast.Raise | ast.Break | ast.Continue):
                return True
    return False


def has_actions(value: Any) -> bool:
    """Whether a value is an action of a launch file, or a list that has one."""
    if isinstance(value, list | tuple):
        spend(len(value))
        return any(isinstance(item, Entity) for item in value)
    return isinstance(value, Entity)


def copied(names: Mapping[str, Any]) -> dict[str, Any]:
    """The names of a scope, for one that begins as they are."""
    spend(1 + len(names) // NAMES)
    return dict(names)


def _is_stored(item: ast.Name) -> bool:
    return isinstance(item.ctx, ast.Store)


def is_open(value: Any) -> bool:
    """Whether a value is not known before the launch.

    Unknown values, and texts with substitutions.
    """
    return isinstance(value, Unknown | Entity) or (isinstance(value, str) and "$(" in value)


def compared(kind: type[ast.cmpop], left: Any, right: Any) -> Any:
    """The result of comparing two values; NotImplemented where one is not known."""
    if is_open(left) or is_open(right):
        return NotImplemented
    if kind in (ast.Eq, ast.NotEq):
        return _is_same(left, right) is (kind is ast.Eq)
    if kind in (ast.Is, ast.IsNot) and (left is None or right is None):
        return (left is right) is (kind is ast.Is)
    if kind in (ast.In, ast.NotIn):
        result = _is_in(left, right)
        return result if result is NotImplemented else result is (kind is ast.In)
    if kind in ORDERS and all(isinstance(item, int | float) for item in (left, right)):
        return ORDERS[kind](left, right)
    return NotImplemented


def _is_in(item: Any, owner: Any) -> Any:
    if isinstance(owner, str):
        return item in owner if isinstance(item, str) else NotImplemented
    if isinstance(owner, dict):
        return item in owner if isinstance(item, str) else NotImplemented
    if not isinstance(owner, list | tuple):
        return NotImplemented
    if any(is_open(one) for one in counted(owner)):
        return True if any(not is_open(one) and _is_same(item, one) for one in owner) else NotImplemented
    return any(_is_same(item, one) for one in owner)


def _is_same(left: Any, right: Any) -> bool:
    """Whether two values are equal, one entry after the other: lists may hold each other many times."""
    spend()
    if isinstance(left, list) and isinstance(right, list):
        return len(left) == len(right) and all(map(_is_same, left, right))
    if isinstance(left, dict) and isinstance(right, dict):
        return left.keys() == right.keys() and all(_is_same(item, right[key]) for key, item in left.items())
    return left is right if isinstance(left, Entity | Unknown) else bool(left == right)


def entry_of(owner: Any, key: Any) -> Any:
    """``owner[key]``; NotImplemented where there is none.

    Also NotImplemented for texts with substitutions, whose length is not known.
    """
    if isinstance(owner, dict):
        return owner.get(key, NotImplemented) if isinstance(key, str) else NotImplemented
    if isinstance(owner, str) and is_open(owner):
        return NotImplemented
    if isinstance(owner, list | tuple | str) and isinstance(key, int) and -len(owner) <= key < len(owner):
        return owner[key]
    return NotImplemented


def part_of(owner: Any, first: Any, last: Any) -> Any:
    """``owner[first:last]``; NotImplemented where that is not known."""
    ends = all(end is None or isinstance(end, int) for end in (first, last))
    if not ends or not isinstance(owner, list | tuple | str) or (isinstance(owner, str) and is_open(owner)):
        return NotImplemented
    return spend_text(owner[first:last]) if isinstance(owner, str) else counted(owner[first:last])


def _add(owner: Any, values: list[Any]) -> Any:
    """An action more for a launch description, or an item for a list; unknown of anything else."""
    if isinstance(owner, list):
        owner += values
        return None
    if not isinstance(owner, Entity):
        return NotImplemented
    for item in values:
        more = counted(item) if isinstance(item, list | tuple) else [item]
        owner.children += [one for one in more if isinstance(one, Entity)]
    return None


def _extend(owner: Any, values: list[Any]) -> Any:
    if isinstance(owner, list) and values and isinstance(values[0], list | tuple):
        owner += counted(values[0])


def _items(owner: Any, values: list[Any]) -> Any:
    return [[key, value] for key, value in counted(owner).items()] if isinstance(owner, dict) else owner


def _get(owner: Any, values: list[Any]) -> Any:
    if not isinstance(owner, dict) or not 1 <= len(values) <= 2 or not isinstance(values[0], str) or is_open(values[0]):
        return NotImplemented
    return owner.get(values[0], values[1] if len(values) > 1 else None)


def _update(owner: Any, values: list[Any]) -> Any:
    if not isinstance(owner, dict) or len(values) != 1 or not isinstance(values[0], dict):
        return NotImplemented
    owner |= counted(values[0])
    return None


def _entries(owner: Any, values: list[Any], pick: Callable[[dict[str, Any]], Any]) -> Any:
    return list(pick(counted(owner))) if isinstance(owner, dict) else NotImplemented


METHODS: Mapping[str, Callable[[Any, list[Any]], Any]] = {
    "add_action": _add,
    "append": _add,
    "extend": _extend,
    "items": _items,
    "keys": lambda owner, given: _entries(owner, given, dict.keys),
    "values": lambda owner, given: _entries(owner, given, dict.values),
    "get": _get,
    "update": _update,
    "perform": lambda owner, given: owner,
}
