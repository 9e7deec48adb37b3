"""How many bytes a ROS message takes serialised, by arithmetic: nothing is built, however long its arrays are.

In CDR (as rosbags and the middlewares of ROS 2 write it, after a header of 4 bytes) a number is aligned to its own
size, texts and sequences begin with a count of 4 bytes, aligned, and a text ends with a zero. ROS 1 leaves no gaps, and
its texts have no zero. What is repeated adds up by its period: where an element begins is known modulo `WIDEST`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any, NamedTuple, TypeAlias

from dse.support.errors import Diagnostic, ProblemError

WIDTHS = {
    "bool": 1, "byte": 1, "char": 1, "octet": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4,
    "uint32": 4, "float32": 4, "int64": 8, "uint64": 8, "float64": 8, "float128": 16,
}  # fmt: skip
"""Bytes of a number."""
TEXT = "string"
WIDEST = 16
NOTHING = "structure_needs_at_least_one_member"
"""The field of a message without fields: a byte in CDR, nothing in ROS 1."""
MOST_PLACES = 10_000
"""The most strings and sequences that a message has, with those of the messages in it."""
Node: TypeAlias = Any
"""A type as rosbags has it: (BASE, (name, bound)), (NAME, name), (ARRAY or SEQUENCE, (node, count)); by `FieldType`."""
Fields: TypeAlias = Mapping[str, Sequence[tuple[str, Node]]]
"""The fields of each type: every type that one of them names is there, and none contains itself."""


class FieldType(IntEnum):
    """The kind of a node in a message type; the numbers are those of rosbags."""

    BASE = 1
    NAME = 2
    ARRAY = 3
    SEQUENCE = 4


class Length(NamedTuple):
    """A string or sequence of a message: its path, its bound (0: none), the paths of the sequences that it is in."""

    path: str
    bound: int
    within: tuple[str, ...]


class WireLayout:
    """The positions of fields in serialised messages of given types.

    In CDR, as the middlewares of ROS 2 write it, or in the format of ROS 1.
    """

    def __init__(self, fields: Fields, *, is_ros1: bool) -> None:
        self.fields, self.is_ros1 = fields, is_ros1
        self._lengths: dict[str, tuple[Length, ...]] = {}

    def lengths(self, name: str) -> tuple[Length, ...]:
        """The strings and sequences of a type, in their order.

        Raises
        ------
        ProblemError
            when it has too many.
        """
        if name not in self._lengths:
            lengths = [item for field, node in self.fields[name] for item in self._lengths_of(node, field, ())]
            if len(lengths) > MOST_PLACES:
                words = f"{name} has more than {MOST_PLACES} strings and sequences, with those of the messages in it"
                raise ProblemError([Diagnostic(words)])
            self._lengths[name] = tuple(lengths)
        return self._lengths[name]

    def _lengths_of(self, node: Node, path: str, within: tuple[str, ...]) -> list[Length]:
        kind, what = node
        if kind == FieldType.NAME:
            return [
                Length(f"{path}.{item.path}", item.bound, (*within, *(f"{path}.{above}" for above in item.within)))
                for item in self.lengths(what)
            ]
        if kind == FieldType.BASE:
            return [Length(path, what[1], within)] if what[0] == TEXT else []
        inner, bound = what
        is_sequence = kind == FieldType.SEQUENCE
        own = [Length(path, bound, within)] if is_sequence else []
        place = path if inner[0] == FieldType.NAME else f"{path}[]"
        return own + self._lengths_of(inner, place, (*within, path) if is_sequence else within)

    def unstated(self, name: str, lengths: Mapping[str, int]) -> list[str]:
        """The paths of the strings and sequences on which the size depends: without a stated length and a bound.

        Sequences inside of an empty sequence do not count.
        """
        return [
            item.path
            for item in self.lengths(name)
            if not item.bound and item.path not in lengths and not any(lengths.get(above) == 0 for above in item.within)
        ]

    def size(self, name: str, lengths: Mapping[str, int], *, largest: bool) -> int:
        """The serialised size with stated lengths, by path; others count with their bounds (`largest`) or as empty.

        In bytes.
        """
        return _Size(self, lengths, largest).of(name)


class _Size:
    """The size of one message."""

    def __init__(self, layout: WireLayout, lengths: Mapping[str, int], largest: bool) -> None:
        self.layout, self.lengths, self.largest = layout, lengths, largest
        self.known: dict[tuple[str, int], int] = {}
        """The bytes of a message without stated lengths, by its type and its beginning."""

    def of(self, name: str) -> int:
        return self._message(name, 0, "") + (0 if self.layout.is_ros1 else 4)

    def _aligned(self, at: int, width: int) -> int:
        return at if self.layout.is_ros1 else -(-at // width) * width

    def _message(self, name: str, at: int, path: str) -> int:
        """Where it ends."""
        is_plain = not any(stated.startswith(path) for stated in self.lengths)
        key = name, at % WIDEST
        if is_plain and key in self.known:
            return at + self.known[key]
        end = at
        for field, node in self.layout.fields[name]:
            if field != NOTHING or not self.layout.is_ros1:
                end = self._end(node, end, f"{path}{field}")
        if is_plain:
            self.known[key] = end - at
        return end

    def _end(self, node: Node, at: int, path: str) -> int:
        kind, what = node
        if kind == FieldType.NAME:
            return self._message(what, at, f"{path}.")
        if kind == FieldType.BASE:
            if what[0] != TEXT:
                return self._aligned(at, WIDTHS[what[0]]) + WIDTHS[what[0]]
            return self._aligned(at, 4) + 4 + self._count(path, what[1]) + (not self.layout.is_ros1)
        inner, count = what
        if kind == FieldType.SEQUENCE:
            at, count = self._aligned(at, 4) + 4, self._count(path, count)
        return self._repeated(inner, count, at, path if inner[0] == FieldType.NAME else f"{path}[]")

    def _count(self, path: str, bound: int) -> int:
        return self.lengths.get(path, bound if self.largest else 0)

    def _repeated(self, node: Node, count: int, at: int, path: str) -> int:
        """The end of the last of `count` elements: from where one begins as another did, everything comes again."""
        begun: dict[int, tuple[int, int]] = {}
        for number in range(count):
            if at % WIDEST in begun:
                first, then = begun[at % WIDEST]
                rounds, rest = divmod(count - number, number - first)
                return self._repeated(node, rest, at + rounds * (at - then), path)
            begun[at % WIDEST] = number, at
            at = self._end(node, at, path)
        return at
