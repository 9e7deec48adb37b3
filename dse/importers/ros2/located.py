"""YAML of other tools as plain data of which every value knows its line; every mistake with its place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from dse.errors import Diagnostic, ProblemError
from dse.files.reading import UnreadableFileError, read_text

MOST_BYTES = 64_000_000
DEEPEST = 40


class Place:
    """A value of the file: `data` is text, None, a list of places, or a mapping of places; `line` counts from 1."""

    __slots__ = ("column", "data", "line")

    def __init__(self, data: Any, line: int, column: int) -> None:
        self.data, self.line, self.column = data, line, column

    def __getitem__(self, key: str) -> Place:
        """What stands under a key; nothing where there is no such key, or this is no mapping."""
        found = self.data.get(key) if isinstance(self.data, dict) else None
        return found if found is not None else Place(None, self.line, self.column)

    def __iter__(self) -> Iterator[Place]:
        """The items of a list; nothing of anything else."""
        return iter(self.data if isinstance(self.data, list) else [])

    @property
    def text(self) -> str:
        """The text; "" of anything else."""
        return self.data.strip() if isinstance(self.data, str) else ""


class LocatedFile:
    """A file of another tool, with the mistakes and remarks that are found in it."""

    def __init__(self, path: Path, what: str, root: Place | None = None) -> None:
        """Read the file, unless its `root` is known."""
        self.path, self.what = path, what
        self.mistakes: list[Diagnostic] = []
        self.remarks: list[Diagnostic] = []
        self.root = self._read() if root is None else root

    def wrong(self, place: Place, message: str, hint: str = "") -> None:
        """Note a mistake."""
        self.mistakes.append(Diagnostic(message, "", str(self.path), place.line, place.column, hint))

    def remark(self, place: Place, message: str, hint: str = "") -> None:
        """Note what is left out, or was assumed."""
        found = Diagnostic(message, "", str(self.path), place.line, 0, hint, severity="warning")
        if found not in self.remarks:
            self.remarks.append(found)

    def needed(self, place: Place, key: str) -> str:
        """The text under a key; a mistake where there is none."""
        found = place[key]
        if not found.text:
            self.wrong(place, f"{self.what} has `{key}` here", "is the file cut off?")
        return found.text

    def whole(self, place: Place, key: str, least: int = 0, most: int = 10**18) -> int | None:
        """The whole number under a key; None, and a mistake, where there is none."""
        text = place[key].text
        if text.removeprefix("-").isdecimal() and text.isascii() and len(text) < 20 and least <= int(text) <= most:
            return int(text)
        got = f"got {text[:40]!r}" if text else "got nothing"
        self.wrong(place[key], f"{key}: expected a whole number from {least} to {most}, {got}")
        return None

    def check(self) -> None:
        """Stop where there are mistakes."""
        if self.mistakes:
            raise ProblemError(self.mistakes[:50])

    def _stop(self, message: str, line: int = 1, column: int = 0, hint: str = "") -> ProblemError:
        return ProblemError([Diagnostic(message, "", str(self.path), line, column, hint)])

    def _read(self) -> Place:
        try:
            text = read_text(self.path, MOST_BYTES, self.what)
        except UnreadableFileError as error:
            raise self._stop(error.reason) from None
        try:
            node = yaml.compose(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            raise self._stop(f"not YAML: {error.problem or error.context}", line, column, "is it cut off?") from None
        except (yaml.YAMLError, RecursionError, ValueError) as error:
            raise self._stop(f"not YAML: {' '.join(str(error).split())[:200]}") from None
        if node is None:
            raise self._stop("the file is empty", hint=f"expected {self.what}")
        return self._place(node, set(), 0)

    def _place(self, node: yaml.Node, seen: set[int], depth: int) -> Place:
        line, column = node.start_mark.line + 1, node.start_mark.column + 1
        if id(node) in seen and not isinstance(node, yaml.ScalarNode):
            raise self._stop("aliases are not expected here", line, column)
        if depth > DEEPEST:
            raise self._stop(f"more than {DEEPEST} levels", line, column)
        seen.add(id(node))
        if isinstance(node, yaml.MappingNode):
            entries: dict[str, Place] = {}
            for key, value in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    raise self._stop("a key is a text", key.start_mark.line + 1, key.start_mark.column + 1)
                if key.value in entries:
                    raise self._stop(f"{key.value!r} is there twice", key.start_mark.line + 1)
                entries[key.value] = self._place(value, seen, depth + 1)
            return Place(entries, line, column)
        if isinstance(node, yaml.SequenceNode):
            return Place([self._place(item, seen, depth + 1) for item in node.value], line, column)
        is_null = node.tag == "tag:yaml.org,2002:null"
        return Place(None if is_null else str(node.value), line, column)


def ros_name(text: str) -> str:
    """The name that something of ROS has in a problem file: ``/ns/cam`` becomes ``ns.cam``.

    >>> ros_name("/perception/cam/callback_0"), ros_name("/")
    ('perception.cam.callback_0', 'root')
    """
    found = ".".join(part for part in text.strip().split("/") if part)
    return {"": "root", "none": "none_"}.get(found, found)


class Names:
    """Names that differ: a second one gets a number."""

    def __init__(self) -> None:
        self.taken: set[str] = set()

    def new(self, name: str) -> str:
        """The name, or the first free one after it."""
        found, number = name, 2
        while found in self.taken:
            found, number = f"{name}_{number}", number + 1
        self.taken.add(found)
        return found
