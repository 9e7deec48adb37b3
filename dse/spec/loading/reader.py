"""YAML text to a tree of nodes that know their place: our own constructor over the parser's events.

It accepts one UTF-8 document with YAML 1.2 core scalars (``no`` and ``12:30`` are text) and refuses what surprises:
duplicate keys, merge keys, tags. Size, depth and the number of nodes after aliases are expanded are limited, so that
no input can exhaust time or memory. Every finding is a `Diagnostic` with line and column.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import yaml

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files import reading
from dse.support.timelimit import StepCounter
from dse.support.units import shown

MAX_BYTES = 8_000_000
MAX_DEPTH = 64
MAX_NODES = 500_000
MAX_INTEGER_DIGITS = 40

Scalar: TypeAlias = str | int | float | bool | None
PathPart: TypeAlias = str | int

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_WORDS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_HINTS = (
    ("cannot start any token", "indent with blanks, not tabs; put text with special characters in quotes"),
    ("mapping values are not allowed", 'put a blank after ":", and text that contains ": " in quotes'),
    ("could not find expected ':'", 'a key is followed by ":" and a blank; check the indentation'),
    ("did not find expected key", "check the indentation and the quotes"),
    ("did not find expected ',' or", "a bracket or brace is not closed, or a comma is missing"),
    ("did not find expected '-' indicator", "check the indentation of the list"),
)


@dataclass(frozen=True, slots=True)
class MappingEntry:
    """A key of a mapping, with its place, and its value.

    Line and column, from 1, are those of the key; the value's are in `node`.
    """

    line: int
    column: int
    node: YamlNode
    file: str = ""


@dataclass(frozen=True, slots=True)
class YamlNode:
    """A value of the file and its place, counted from 1; `file` where it is from another file than its root.

    The value is a scalar, a tuple of nodes or a mapping of `MappingEntry`; YAML 1.2 core schema, without dates and
    without ``yes`` and ``no``.
    """

    line: int
    column: int
    value: Scalar | tuple[YamlNode, ...] | dict[str, MappingEntry]
    file: str = ""

    def to_data(self) -> Any:
        """Plain data: dict, list, str, int, float, bool, None.

        Recursive; places are lost.
        """
        if isinstance(self.value, dict):
            return {key: entry.node.to_data() for key, entry in self.value.items()}
        if isinstance(self.value, tuple):
            return [item.to_data() for item in self.value]
        return self.value

    def known(self, path: Sequence[PathPart]) -> tuple[PathPart, ...]:
        """The path as far as the data has it, without the labels that pydantic puts into the locations of unions.

        Keys and list indices from the root, as far as they exist; used to find the place of a pydantic finding.
        """
        return tuple(part for part, _ in self._walk(path))

    def locate(self, path: Sequence[PathPart], *, at_key: bool = False) -> tuple[int, int]:
        """Line and column of the value at the path, or of its key; of the last part that exists.

        Both count from 1. With `at_key` a mapping entry is located at its key.
        """
        place = self.place(path, at_key=at_key)
        return place.line, place.column

    def place(self, path: Sequence[PathPart], *, at_key: bool = False) -> YamlNode | MappingEntry:
        """The value at the path, or its key; or the last part of it that exists.

        A node or, with `at_key`, the entry with its key; both have a line, a column and a file.
        """
        places: list[YamlNode | MappingEntry] = [self, *(place for _, place in self._walk(path))]
        place = places[-1]
        return place.node if isinstance(place, MappingEntry) and not at_key else place

    def at(self, path: Sequence[PathPart]) -> YamlNode:
        """The value at the path, or at the last part of it that exists.

        The node itself where the path is empty or nothing of it exists.
        """
        nodes = [self, *(item.node if isinstance(item, MappingEntry) else item for _, item in self._walk(path))]
        return nodes[-1]

    def _walk(self, path: Sequence[PathPart]) -> Iterator[tuple[PathPart, YamlNode | MappingEntry]]:
        node = self
        for part in path:
            value = node.value
            if isinstance(value, dict) and part in value:
                entry = value[str(part)]
                node = entry.node
                yield part, entry
            elif isinstance(value, tuple) and isinstance(part, int) and 0 <= part < len(value):
                node = value[part]
                yield part, node
            elif not (isinstance(part, str) and part.startswith(" ")):
                return


def dotted(path: Sequence[PathPart]) -> str:
    """``threads.nav.period``, ``requirements[2]``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


class RepeatedKeysError(ProblemError):
    """Keys are there twice and nothing else is wrong; `root` has the first of each, `paths` are their places.

    The diagnostics name both lines of each key. The rest of the file is checked with the first value.
    """

    def __init__(self, findings: Sequence[Diagnostic], root: YamlNode, paths: Sequence[tuple[PathPart, ...]]) -> None:
        super().__init__(findings)
        self.root, self.paths = root, tuple(paths)


def read_bytes(path: Path, file: str, what: str = "a problem file") -> bytes:
    """The content of a file, at most `MAX_BYTES`; `file` is its name in diagnostics.

    Raises `ProblemError` with one diagnostic where the file is missing, is no regular file, or is too large.
    """
    try:
        return reading.read_bytes(path, MAX_BYTES, what)
    except reading.UnreadableFileError as error:
        raise ProblemError([Diagnostic(error.reason, file=file)]) from None


def decode_text(data: bytes, file: str) -> str:
    """UTF-8 text without control characters; a byte order mark is dropped.

    Raises `ProblemError` with the line of the first byte that is not UTF-8, or of a control character.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ProblemError([Diagnostic("the file is not UTF-8 text", file=file, line=line, column=0)]) from None
    _check_characters(text, file)
    return text


def _check_characters(text: str, file: str) -> None:
    """Refuse NUL and other control characters."""
    match = _FORBIDDEN.search(text)
    if match:
        line = text.count("\n", 0, match.start()) + 1
        column = match.start() - text.rfind("\n", 0, match.start())
        code = f"U+{ord(match.group()):04X}"
        raise ProblemError([Diagnostic(f"control character {code} in the text", file=file, line=line, column=column)])


def read_yaml(text: str, file: str) -> YamlNode:
    """The tree of the one document in `text`.

    Raises
    ------
    RepeatedKeysError
        YAML in which only keys that are there twice are wrong.
    ProblemError
        Text that is not YAML, of which nothing is quoted (anybody may read the messages, and the file may be any that
        a problem file includes); or not the YAML described above, with every finding.
    """
    _check_characters(text, file)
    builder, work = _NodeBuilder(file), StepCounter()
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            work.go_on()
            builder.take(event)
    except yaml.YAMLError as error:
        builder.findings = [_syntax_error(error, file)]  # of a file that is not YAML nothing is quoted
    except _Stopped:
        pass
    if builder.findings:
        if builder.root is not None and len(builder.findings) == len(builder.repeated):
            raise RepeatedKeysError(builder.findings, builder.root, builder.repeated)
        raise ProblemError(builder.findings)
    if builder.root is None or builder.root.value is None:
        raise ProblemError([Diagnostic("the file is empty", file=file, hint='a problem file begins with "dse: 1"')])
    return builder.root


def _syntax_error(error: yaml.YAMLError, file: str) -> Diagnostic:
    if not isinstance(error, yaml.MarkedYAMLError):
        return Diagnostic(f"not YAML: {error}", file=file)
    mark = error.problem_mark or error.context_mark
    problem = (error.problem or str(error)).strip()
    hint = next((hint for part, hint in _HINTS if part in problem), "")
    context = f" {error.context}" if error.context else ""
    if error.context_mark and mark and error.context_mark.line != mark.line:
        context += f" that begins in line {error.context_mark.line + 1}"
    line, column = (mark.line + 1, mark.column + 1) if mark else (0, 0)
    if "nesting depth" in problem:  # the parser's own limit, which it meets before it tells of what is open
        return Diagnostic(f"nested deeper than {MAX_DEPTH} levels", file=file, line=line, column=column)
    return Diagnostic(f"not YAML: {problem}{context}", file=file, line=line, column=column, hint=hint)


class _Stopped(Exception):
    """A finding after which reading on makes no sense; it is in the builder's findings."""


@dataclass(slots=True)
class _Frame:
    """A sequence or mapping that is still open."""

    kind: Literal["sequence", "mapping"]
    line: int
    column: int
    anchor: str | None
    items: list[YamlNode] = field(default_factory=list)
    entries: dict[str, MappingEntry] = field(default_factory=dict)
    key: tuple[str, int, int] | None = None
    has_key: bool = False
    size: int = 1
    height: int = 1


@dataclass(slots=True)
class _Measured:
    """A finished node with its number of nodes and levels after aliases are expanded; `text` is that of a scalar."""

    node: YamlNode
    size: int = 1
    height: int = 0
    text: str | None = None
    plain: bool = False


class _NodeBuilder:
    """Builds nodes from events with a stack of open collections, so that depth costs no recursion."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.findings: list[Diagnostic] = []
        self.root: YamlNode | None = None
        self.repeated: list[tuple[PathPart, ...]] = []
        self._stack: list[_Frame] = []
        self._anchors: dict[str, _Measured] = {}
        self._documents = 0
        self._nodes = 0

    def take(self, event: yaml.Event) -> None:
        """Act on one event of the parser."""
        mark = event.start_mark
        assert mark is not None, "the parser marks every event"
        line, column = mark.line + 1, mark.column + 1
        if isinstance(event, yaml.DocumentStartEvent):
            self._documents += 1
            if self._documents > 1:
                raise self._stopped("a second document begins here: expected one", line, column)
        elif isinstance(event, yaml.AliasEvent):
            done = self._alias(event.anchor, line, column)
            self._count(done.size, line, column)
            self._add(done)
        elif isinstance(event, yaml.ScalarEvent):
            self._check_tag(event, line, column)
            self._count(1, line, column)
            self._finish(self._scalar(event, line, column), event.anchor)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._check_tag(event, line, column)
            self._count(1, line, column)
            self._open(event, line, column)
        elif isinstance(event, yaml.CollectionEndEvent):
            self._close()

    def _find(self, message: str, line: int, column: int, hint: str = "", path: Sequence[PathPart] = ()) -> None:
        self.findings.append(Diagnostic(message, dotted(path), self.file, line, column, hint))

    def _stopped(self, message: str, line: int, column: int, hint: str = "") -> _Stopped:
        self._find(message, line, column, hint)
        return _Stopped()

    def _count(self, nodes: int, line: int, column: int) -> None:
        self._nodes += nodes
        if self._nodes > MAX_NODES:
            raise self._stopped(
                f"more than {MAX_NODES} values, aliases counted as often as they are used", line, column
            )

    def _check_tag(self, event: Any, line: int, column: int) -> None:
        if event.tag is not None:
            self._find("tags are not supported", line, column, "remove what begins with !")

    def _open(self, event: yaml.CollectionStartEvent, line: int, column: int) -> None:
        if len(self._stack) >= MAX_DEPTH:
            raise self._stopped(f"nested deeper than {MAX_DEPTH} levels", line, column)
        kind: Literal["sequence", "mapping"] = "sequence" if isinstance(event, yaml.SequenceStartEvent) else "mapping"
        self._stack.append(_Frame(kind, line, column, event.anchor))

    def _close(self) -> None:
        frame = self._stack.pop()
        value = tuple(frame.items) if frame.kind == "sequence" else frame.entries
        node = YamlNode(frame.line, frame.column, value)
        self._finish(_Measured(node, frame.size, frame.height), frame.anchor)

    def _alias(self, name: str | None, line: int, column: int) -> _Measured:
        if any(frame.anchor == name for frame in self._stack):
            raise self._stopped("the alias refers to what contains it", line, column)
        done = self._anchors.get(name or "")
        if done is None:
            raise self._stopped("unknown alias", line, column, "put text that begins with * in quotes")
        return done

    def _scalar(self, event: yaml.ScalarEvent, line: int, column: int) -> _Measured:
        plain = not event.style
        value: Scalar = event.value
        if plain:
            try:
                value = _resolve(event.value)
            except ValueError as error:
                self._find(str(error), line, column)
        return _Measured(YamlNode(line, column, value), text=event.value, plain=plain)

    def _finish(self, done: _Measured, anchor: str | None) -> None:
        if anchor is not None:
            self._anchors[anchor] = done
        self._add(done)

    def _add(self, done: _Measured) -> None:
        node = done.node
        if not self._stack:
            self.root = node
            return
        frame = self._stack[-1]
        frame.size += done.size
        frame.height = max(frame.height, done.height + 1)
        if len(self._stack) + done.height > MAX_DEPTH:
            raise self._stopped(f"nested deeper than {MAX_DEPTH} levels", node.line, node.column)
        if frame.kind == "sequence":
            frame.items.append(node)
        elif frame.has_key:
            self._add_value(frame, node)
        else:
            frame.key, frame.has_key = self._key(frame, done), True

    def _add_value(self, frame: _Frame, node: YamlNode) -> None:
        if frame.key is not None:
            text, line, column = frame.key
            frame.entries[text] = MappingEntry(line, column, node)
        frame.key, frame.has_key = None, False

    def _path(self) -> tuple[PathPart, ...]:
        """The place of the innermost open collection."""
        parts: list[PathPart] = []
        for frame in self._stack[:-1]:
            if frame.kind == "sequence":
                parts.append(len(frame.items))
            elif frame.key is not None:
                parts.append(frame.key[0])
        return tuple(parts)

    def _key(self, frame: _Frame, done: _Measured) -> tuple[str, int, int] | None:
        """The key's text and place, or None after a finding, when its value is dropped."""
        line, column, text = done.node.line, done.node.column, done.text
        if text is None:
            self._find("expected a name as key, got a list or mapping", line, column)
        elif done.plain and text == "<<":
            self._find("merge keys (<<) are not supported", line, column, "name a type instead, or repeat the fields")
        elif not text:
            self._find("a key is missing", line, column)
        elif text in frame.entries:
            first = frame.entries[text].line
            path = (*self._path(), text)
            self.repeated.append(path)
            self._find(f"the key {shown(text)} is there twice, first in line {first}", line, column, path=path)
        else:
            return text, line, column
        return None


def _resolve(text: str) -> Scalar:
    """The value of a plain scalar by YAML 1.2's core schema."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        if len(text) > MAX_INTEGER_DIGITS:
            raise ValueError(f"number too long: at most {MAX_INTEGER_DIGITS} digits")
        return int(text, 10 if text[:2] not in ("0o", "0x") else 0)
    return float(text.replace(".inf", "inf").replace(".nan", "nan")) if _is_float(text) else text


def _is_float(text: str) -> bool:
    return _FLOAT.fullmatch(text) is not None


@dataclass(frozen=True)
class Source:
    """One file of a problem: its name in diagnostics and its tree."""

    file: str
    node: YamlNode

    def diagnostic(
        self,
        path: Sequence[PathPart],
        message: str,
        hint: str = "",
        severity: Literal["error", "warning"] = "error",
        *,
        at_key: bool = False,
    ) -> Diagnostic:
        """A finding about a place in this file.

        `path` are keys and list indices; line and column are those of the value, with `at_key` of the key.
        """
        place = self.node.place(path, at_key=at_key)
        file = place.file or self.file
        return Diagnostic(message, dotted(self.node.known(path)), file, place.line, place.column, hint, severity)

    def text_at(self, path: Sequence[PathPart]) -> str:
        """The text at a place in this file, or of the last part that exists; "" for anything but text.

        Used to quote what the user wrote in a message.
        """
        value = self.node.at(path).value
        return value if isinstance(value, str) else ""
