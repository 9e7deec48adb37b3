"""Dataclasses whose methods are made when they are first needed.

`dataclasses.dataclass` writes and compiles six methods of each frozen class, which takes half a millisecond; of the
hundreds of classes that a command imports it uses some, and compares or shows few. Here a class becomes a dataclass
with its first object or when somebody looks at its fields, and what compares, hashes and shows it is made when it is
called: by `dataclasses` itself each time, so that nothing else differs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, **options):
        """As `dataclasses.dataclass`; frozen classes are made later."""
        if cls is None:
            return lambda found: dataclass(found, **options)
        if not options.get("frozen") or OWN & vars(cls).keys() or options.keys() - CAN_WAIT:
            return dataclasses.dataclass(**options)(cls)
        return _compared_later(cls, options) if options.get("slots") else _made_later(cls, options)


OWN = {"__init__", "__setattr__", "__delattr__", "__eq__", "__hash__"}
"""A class that has one of these by itself is made at once."""
CAN_WAIT = {"frozen", "eq", "repr", "slots"}
ASKED_BY = {"__repr__": "repr", "__eq__": "eq", "__hash__": "eq"}
"""Which option asks for a method."""
LOOKED_AT = ("__dataclass_fields__", "__dataclass_params__", "__match_args__", "__signature__")
"""What tells others that a class is a dataclass, and which fields it has."""
_lock = RLock()


class _Look:
    """Stands for an attribute of a class that is not made yet: a look at it makes the class."""

    def __init__(self, name: str, make: Callable[[], None]) -> None:
        self.name = name
        self.make = make

    def __get__(self, found: object, owner: type) -> Any:
        self.make()
        return getattr(owner, self.name)


def _made_later(cls: type, options: dict[str, Any]) -> type:
    """The class itself, which is made with its first object or at the first look at its fields."""

    def make() -> None:
        with _lock:
            if vars(cls).get("__init__") is not waiting:
                return
            for name in ("__match_args__", "__signature__"):
                delattr(cls, name)
            _compared_later(cls, {**options, "init": False})
            cls.__init__ = _init_of(cls)  # type: ignore[misc]  # at last: until then another thread waits for the lock

    waiting = _stand_in("__init__", cls, make)
    cls.__init__ = waiting  # type: ignore[misc]
    for name in LOOKED_AT:
        setattr(cls, name, _Look(name, make))
    return cls


def _init_of(cls: type) -> Any:
    """The `__init__` that `dataclasses` makes for a frozen class with the same fields."""
    same = [
        (
            found.name,
            object,
            dataclasses.field(
                default=found.default, default_factory=found.default_factory, init=found.init, kw_only=found.kw_only
            ),
        )
        for found in dataclasses.fields(cls)
    ]
    after = {"__post_init__": None} if hasattr(cls, "__post_init__") else {}
    made = dataclasses.make_dataclass(
        cls.__name__, same, namespace=after, frozen=True, repr=False, eq=False, match_args=False
    )
    method: Any = vars(made)["__init__"]
    method.__qualname__ = f"{cls.__qualname__}.__init__"
    method.__annotations__ = {found.name: found.type for found in dataclasses.fields(cls) if found.init}
    method.__annotations__["return"] = None
    return method


def _compared_later(cls: type, options: dict[str, Any]) -> type:
    """The class as a dataclass, whose objects are compared, hashed and shown by methods that are made when called."""
    made: type = dataclasses.dataclass(**{**options, "eq": False, "repr": False})(cls)
    for name, option in ASKED_BY.items():
        if options.get(option, True) and name not in vars(made):
            setattr(made, name, _waiting(name, made))
    return made


def _waiting(name: str, cls: type) -> Callable[..., Any]:
    def make() -> None:
        setattr(cls, name, _method(cls, name))

    return _stand_in(name, cls, make)


def _stand_in(name: str, cls: type, make: Callable[[], None]) -> Callable[..., Any]:
    """A method that makes the true one and calls it."""

    def method(*given: Any, **named: Any) -> Any:
        make()
        return getattr(cls, name)(*given, **named)

    return method


def _method(cls: type, name: str) -> Any:
    """What `dataclasses` makes for a class with the same fields."""
    same = [
        (found.name, object, dataclasses.field(compare=found.compare, hash=found.hash, repr=found.repr))
        for found in dataclasses.fields(cls)
    ]
    made = dataclasses.make_dataclass(
        cls.__name__,
        same,
        init=False,
        match_args=False,
        repr=name == "__repr__",
        eq=name == "__eq__",
        unsafe_hash=name == "__hash__",
    )
    method = vars(made)[name]
    method.__qualname__ = f"{cls.__qualname__}.{name}"
    return method
