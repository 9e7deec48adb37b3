"""Dataclasses that are made when they are first needed behave as those of the library do at once."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, field
from threading import Barrier
from typing import Any

import pytest

from dse import records


def _pair(**options: Any) -> list[type]:
    """The same class twice: by the library, and made later."""
    made = []
    for decorate in (dataclasses.dataclass, records.dataclass):

        class Point:
            """A point."""

            x: int
            name: str = "p"
            beside: list[int] = field(default_factory=list, compare=False, repr=False)

        made.append(decorate(**options)(Point))
    return made


@pytest.mark.parametrize(
    "options", [{"frozen": True}, {"frozen": True, "slots": True}, {"frozen": True, "eq": False}, {}], ids=str
)
def test_a_class_that_is_made_later_does_what_the_library_does(options: dict[str, Any]) -> None:
    library, later = _pair(**options)
    assert str(inspect.signature(later)) == str(inspect.signature(library))
    assert later.__name__ == library.__name__ and later.__match_args__ == library.__match_args__  # type: ignore[attr-defined]
    told = []
    for point in (library, later):
        one, same, other = point(1), point(1, "p", [2]), point(x=2)
        hashes = None if point.__hash__ is None else (hash(one) == hash(same), hash(one) == hash(other))
        told.append((repr(one), one == same, one == other, one == (1, "p"), hashes, dataclasses.asdict(other)))
        assert dataclasses.replace(one, x=5).x == 5 and copy.copy(one).x == 1
        with pytest.raises(TypeError, match="missing 1 required positional argument: 'x'"):
            point()
    assert told[0] == told[1]


def test_threads_that_make_the_first_objects_of_a_class_together_have_them() -> None:
    """Before, another thread found a class without a constructor for a moment: "Point() takes no arguments"."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for _ in range(60):
            point, start = _pair(frozen=True)[1], Barrier(4)

            def make(point: type = point, start: Barrier = start) -> Any:
                start.wait()
                return point(1, name="q").name

            with ThreadPoolExecutor(4) as pool:
                assert [item.result() for item in [pool.submit(make) for _ in range(4)]] == ["q"] * 4
    finally:
        sys.setswitchinterval(interval)


def test_a_frozen_object_stays_as_it_is() -> None:
    point = _pair(frozen=True)[1](1)
    with pytest.raises(FrozenInstanceError):
        point.x = 2
    with pytest.raises(FrozenInstanceError):
        del point.x


def test_a_class_is_made_with_its_first_object_its_first_comparison_and_by_those_that_inherit() -> None:
    @records.dataclass(frozen=True)
    class Base:
        x: int

    class Plain(Base):
        pass

    @records.dataclass(frozen=True)
    class Derived(Base):
        y: int = 0

    before = vars(Base)["__init__"]
    assert Plain(1).x == 1 and vars(Base)["__init__"] is not before
    waiting = vars(Base)["__eq__"]
    assert Plain(1) == Plain(1) and vars(Base)["__eq__"] is not waiting
    assert Derived(1) == Derived(1, 0) != Derived(1, 2) and repr(Derived(3)).endswith("Derived(x=3, y=0)")
    assert hash(Derived(1)) == hash(Derived(1, 0))
    assert [item.name for item in dataclasses.fields(Derived)] == ["x", "y"] and dataclasses.is_dataclass(Plain)


@records.dataclass(frozen=True)
class Kept:
    """A class that can be found by its name, for pickles."""

    x: int


def test_an_object_that_was_never_initialised_in_this_process_is_compared() -> None:
    made = object.__new__(Kept)
    object.__setattr__(made, "x", 4)
    assert made == Kept(4) and pickle.loads(pickle.dumps(made)) == made


def test_a_method_of_its_own_is_kept() -> None:
    @records.dataclass(frozen=True)
    class Shown:
        x: int

        def __repr__(self) -> str:
            return "shown"

    @records.dataclass(frozen=True)
    class Same:
        x: int

        def __eq__(self, other: object) -> bool:
            return True

    assert repr(Shown(1)) == "shown" and Shown(1) == Shown(1)
    assert Same(1) == Same(2) and hash(Same(1)) == hash(Same(1))
