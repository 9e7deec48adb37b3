"""YAML of other tools as plain data of which every value knows its line; every mistake with its place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.reading import UnreadableFileError, read_text
from dse.support.timelimit import StepCounter

MOST_BYTES = 64_000_000
DEEPEST = 40
MOST_VALUES = 1_000_000
"""The greatest number of values in a file."""
NULL = "tag:yaml.org,2002:null"
NULLS = ("", "~", "null", "Null", "NULL")


class LocatedValue:
    """A value of the file: `data` is text, None, a list of places, or a mapping of places; `line` counts from 1.

    ``value["key"]`` is an empty place where the key is missing, so that reading needs no tests.
    """

    __slots__ = ("column", "data", "line")

    def __init__(self, data: Any, line: int, column: int) -> None:
        self.data, self.line, self.column = data, line, column

    def __getitem__(self, key: str) -> LocatedValue:
        """The value under a key; an empty one where there is no such key, or this is no mapping."""
        entry = self.data.get(key) if isinstance(self.data, dict) else None
        return entry if entry is not None else LocatedValue(None, self.line, self.column)

    def __iter__(self) -> Iterator[LocatedValue]:
        """The items of a list; nothing of anything else."""
        return iter(self.data if isinstance(self.data, list) else [])

    @property
    def text(self) -> str:
        """The text; "" of anything else."""
        return self.data.strip() if isinstance(self.data, str) else ""


class LocatedFile:
    """A file of another tool, with the mistakes and remarks that are found in it.

    Mistakes are collected and raised together by `check`.
    """

    def __init__(self, path: Path, what: str, root: LocatedValue | None = None) -> None:
        """Read the file, unless its `root` is known."""
        self.path, self.what = path, what
        self.mistakes: list[Diagnostic] = []
        self.values = 0
        self.remarks: dict[Diagnostic, None] = {}
        self.root = self._read() if root is None else root

    def wrong(self, place: LocatedValue, message: str, hint: str = "") -> None:
        """Note a mistake."""
        self.mistakes.append(Diagnostic(message, "", str(self.path), place.line, place.column, hint))

    def remark(self, place: LocatedValue, message: str, hint: str = "") -> None:
        """Note what is left out, or was assumed."""
        self.tell(Diagnostic(message, "", str(self.path), place.line, 0, hint, severity="warning"))

    def tell(self, remark: Diagnostic) -> None:
        """Note a remark, once."""
        self.remarks.setdefault(remark)

    def needed(self, place: LocatedValue, key: str) -> str:
        """The text under a key; a mistake where there is none."""
        value = place[key]
        if not value.text:
            self.wrong(place, f"{self.what} has `{key}` here", "is the file cut off?")
        return value.text

    def whole(self, place: LocatedValue, key: str, least: int = 0, most: int = 10**18) -> int | None:
        """The whole number under a key; None, and a mistake, where there is none.

        A mistake with the place for anything but decimal digits within the limits.
        """
        text = place[key].text
        if text.removeprefix("-").isdecimal() and text.isascii() and len(text) < 20 and least <= int(text) <= most:
            return int(text)
        got = f"got {text[:40]!r}" if text else "got nothing"
        self.wrong(place[key], f"{key}: expected a whole number from {least} to {most}, {got}")
        return None

    def check(self) -> None:
        """Stop where there are mistakes.

        Raises `ProblemError` with the first 50 mistakes.
        """
        if self.mistakes:
            raise ProblemError(self.mistakes[:50])

    def _stop(self, message: str, line: int = 1, column: int = 0, hint: str = "") -> ProblemError:
        return ProblemError([Diagnostic(message, "", str(self.path), line, column, hint)])

    def _read(self) -> LocatedValue:
        try:
            text = read_text(self.path, MOST_BYTES, self.what)
        except UnreadableFileError as error:
            raise self._stop(error.reason) from None
        try:
            root = self._root(text)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            raise self._stop(f"not YAML: {error.problem or error.context}", line, column, "is it cut off?") from None
        except (yaml.YAMLError, RecursionError, ValueError) as error:
            raise self._stop(f"not YAML: {' '.join(str(error).split())[:200]}") from None
        if root is None:
            raise self._stop("the file is empty", hint=f"expected {self.what}")
        return root

    def _root(self, text: str) -> LocatedValue | None:
        """The one document of a text; None where there is none."""
        events = _events(text)
        root = None
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    raise self._stopped("a second document is not expected here", event)
                root = self._place(next(events), events, {}, 0)
        return root

    def _place(
        self, event: Any, events: Iterator[Any], anchors: dict[str | None, LocatedValue], depth: int
    ) -> LocatedValue:
        """The value that begins with an event."""
        line, column = event.start_mark.line + 1, event.start_mark.column + 1
        if depth > DEEPEST:
            raise self._stopped(f"more than {DEEPEST} levels", event)
        if isinstance(event, yaml.AliasEvent):
            known = anchors.get(event.anchor)
            if known is None or isinstance(known.data, dict | list):
                raise self._stopped("aliases are not expected here", event)
            return LocatedValue(known.data, line, column)
        self.values += 1
        if self.values > MOST_VALUES:
            raise self._stopped(f"more than {MOST_VALUES:,} values", event)
        located = LocatedValue(None, line, column)
        if event.anchor is not None:
            anchors[event.anchor] = located
        if isinstance(event, yaml.MappingStartEvent):
            located.data = {}
            self._read_entries(located.data, events, anchors, depth)
        elif isinstance(event, yaml.SequenceStartEvent):
            located.data = []
            while not isinstance(inner := next(events), yaml.SequenceEndEvent):
                located.data.append(self._place(inner, events, anchors, depth + 1))
        else:
            is_null = event.tag == NULL or (event.implicit[0] and event.value in NULLS)
            located.data = None if is_null else str(event.value)
        return located

    def _read_entries(
        self,
        entries: dict[str, LocatedValue],
        events: Iterator[Any],
        anchors: dict[str | None, LocatedValue],
        depth: int,
    ) -> None:
        while not isinstance(key := next(events), yaml.MappingEndEvent):
            mark: Any = key.start_mark
            if not isinstance(key, yaml.ScalarEvent):
                raise self._stopped("a key is a text", key)
            if key.value in entries:
                raise self._stop(f"{key.value[:80]!r} is there twice", mark.line + 1)
            entries[key.value] = self._place(next(events), events, anchors, depth + 1)

    def _stopped(self, message: str, event: Any) -> ProblemError:
        return self._stop(message, event.start_mark.line + 1, event.start_mark.column + 1)


def _events(text: str) -> Iterator[Any]:
    """The events of the parser, with looks at the clock."""
    work = StepCounter()
    for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        work.go_on()
        yield event


def ros_name(text: str) -> str:
    """The name that something of ROS has in a problem file: ``/ns/cam`` becomes ``ns.cam``.

    >>> ros_name("/perception/cam/callback_0"), ros_name("/")
    ('perception.cam.callback_0', 'root')
    """
    name = ".".join(part for part in text.strip().split("/") if part)
    return {"": "root", "none": "none_"}.get(name, name)


class UniqueNames:
    """Names that differ: a second one gets a number."""

    def __init__(self) -> None:
        self.taken: set[str] = set()
        self._next: dict[str, int] = {}

    def new(self, name: str) -> str:
        """The name, or the first free one after it.

        Such as ``cam``, ``cam_2``, ``cam_3``; the name is taken from then on.
        """
        unique, number = name, self._next.get(name, 2)
        while unique in self.taken:
            unique, number = f"{name}_{number}", number + 1
        self._next[name] = number
        self.taken.add(unique)
        return unique
