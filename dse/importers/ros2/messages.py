"""Sizes of ROS messages: the report's rule, and what they take serialised (ROS 1, or CDR), by rosbags (extra ``ros``).

The report (ECE-TR-25, section 4.5) counts each array as one element, a string as 8 bytes and a header as 24:
`sensor_msgs/Imu` has 128 B and `nav_msgs/Odometry` 152 B. The true size depends on the lengths of arrays and strings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from dse.importers.ros2.idl import wrong_expressions
from dse.importers.ros2.packages import package_around
from dse.importers.ros2.serialised import NOTHING, WIDTHS, FieldType, WireLayout
from dse.support.errors import Diagnostic, ProblemError, UsageError, did_you_mean
from dse.support.extras import needed_for
from dse.support.files.foreign import reading
from dse.support.files.reading import UnreadableFileError, read_text

BY_RULE = WIDTHS | {"string": 8}
"""Bytes of a field by the report's rule."""
TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
TIME_BYTES = 8
HEADER, HEADER_BYTES = "std_msgs/msg/Header", 24
SUFFIXES = (".msg", ".srv", ".action", ".idl")
PARTS = {".msg": ("",), ".srv": ("_Request", "_Response"), ".action": ("_Goal", "_Result", "_Feedback")}
MOST_BYTES = 200_000
"""Of a file of definitions."""
MOST_MISTAKES = 50
UNDEFINED = "is not defined"
HOW_FOREIGN = "name the types that you need, or give its definitions too (--definitions)"
WHAT = "no definition of a message"
_STOPPED = re.compile(r"^(\d+)$", re.MULTILINE)
"""Where rosbags tells how far it came in a text, after the text as Python writes it, in one line."""
LONGEST = 10**8
"""The most elements of an array or string that may be stated."""
DEEPEST = 60
"""The most messages that are within each other."""
DEFAULT = "ros2_humble"


@dataclass(frozen=True)
class MessageSize:
    """The sizes of a message type in bytes."""

    JSON_NAME = "TypeSize"

    name: Annotated[str, "The type, such as `sensor_msgs/msg/Imu`."]
    rule: Annotated[int, "By the report's rule: each array one element, a string 8, a header 24."]
    least: Annotated[int, "Serialised, with empty strings and sequences."]
    stated: Annotated[int | None, "Serialised, with the stated lengths; null where none is of this type."]
    most: Annotated[int | None, "Serialised, at its largest; null where a string or sequence has no bound."]


class LengthError(UsageError):
    """A stated length that cannot be; `path` says of what, `reason` why."""

    def __init__(self, path: str, stated: int, reason: str) -> None:
        super().__init__(f"--length {path}={stated}: {reason}")
        self.path, self.reason = path, reason


class Types:
    """Message types: those of a distribution of ROS, and of files of definitions.

    A type that the distribution has keeps its definition; files of definitions add the others.
    """

    def __init__(self, distribution: str = DEFAULT, definitions: Sequence[Path] = ()) -> None:
        """Read definitions: files, or folders with packages in them. What is wrong with some types `check` tells.

        Raises
        ------
        ProblemError
            when a folder has no definitions.
        UsageError
            when there is no such distribution, or rosbags is not installed.
        """
        with needed_for("The size of a ROS message", "ros"):
            from rosbags.typesys import Stores, get_typestore
        names = [store.value for store in Stores if store.name not in ("EMPTY", "LATEST")]
        if distribution not in names:
            raise UsageError(f"--distribution {distribution}: there are {', '.join(names)}")
        self.fields = {name: fields for name, (_, fields) in get_typestore(Stores(distribution)).fielddefs.items()}
        self.layout = WireLayout(self.fields, is_ros1=distribution.startswith("ros1"))
        self.rules: dict[str, tuple[int, int]] = {}
        """The size of each type by the report's rule, and how many messages are within each other in it."""
        self.own: dict[str, tuple[str, str]] = {}
        self.broken: list[Diagnostic] = []
        """Mistakes in files that are not understood, whatever types they have."""
        for path in definitions:
            self._read(path)

    def _read(self, path: Path) -> None:
        files = sorted(item for item in path.rglob("*") if item.suffix in SUFFIXES) if path.is_dir() else [path]
        if not files:
            words = f"there is no file of definitions in this folder ({', '.join(SUFFIXES)})"
            raise ProblemError([Diagnostic(words, file=str(path))])
        for file in files:
            try:
                text = read_text(file, MOST_BYTES, "definitions of messages")
                definitions = dict(_definitions(file, text))
            except UnreadableFileError as error:
                self.broken.append(Diagnostic(error.reason, file=str(file)))
            except ProblemError as error:
                self.broken += error.diagnostics
            else:
                for name, (_, fields) in definitions.items():
                    self.fields.setdefault(name, fields or [(NOTHING, (FieldType.BASE, ("uint8", 0)))])
                    self.own[name] = str(file), text

    def check(self, names: Sequence[str]) -> None:
        """Stop where something is wrong with types, or with what they have within them.

        Raises
        ------
        ProblemError
            with every mistake, and those of files that are not understood where a type may be in one of them. With all
            types of the definitions asked for, that is every mistake of the files.
        """
        mistakes: list[Diagnostic] = []
        seen: set[str] = set()
        is_lacking = False
        waiting = [self._known(name) for name in names]
        while waiting:
            name = waiting.pop(0)
            is_lacking = is_lacking or name not in self.fields
            if name in seen or name not in self.own:
                continue
            seen.add(name)
            mistakes += self._check(name)
            waiting += [inner for _, node in self.fields[name] for inner in _named(node)]
        if is_lacking or seen >= self.own.keys():
            mistakes = [*self.broken, *mistakes]
        if mistakes:
            raise ProblemError(list({mistake.message: mistake for mistake in reversed(mistakes)}.values())[::-1])

    def _known(self, name: str) -> str:
        """The full name of a type; the name itself where there is none of it."""
        try:
            return self.full_name(name)
        except UsageError:
            return name

    def _check(self, name: str) -> Iterator[Diagnostic]:
        """Check that every type in a definition is there, that none contains itself, and that no array is too long."""
        file, text = self.own[name]
        mistakes = [(field, words) for field, node in self.fields[name] if (words := _wrong(node))]
        for field, words in mistakes:
            yield Diagnostic(f"{field}: {words}", file=file, line=_line_of(field, text))
        try:
            if not mistakes:
                self.rule(name)
                self.layout.lengths(name)
        except ProblemError as error:
            for item in error.diagnostics:
                is_foreign = item.message.endswith(UNDEFINED) and len(self.own) > 1
                hint = HOW_FOREIGN if is_foreign else ""
                yield Diagnostic(item.message, file=item.file or file, line=item.line or 1, hint=hint)

    def names(self) -> list[str]:
        """The types of the files of definitions; those of the distribution where there are none."""
        return sorted(self.own or self.fields)

    def full_name(self, name: str) -> str:
        """``sensor_msgs/msg/Imu`` of ``sensor_msgs/Imu``.

        Raises
        ------
        UsageError
            when there is no such type.
        """
        package, _, rest = name.partition("/")
        for text in (name, f"{package}/msg/{rest}"):
            if text in self.fields:
                return text
        hint = did_you_mean(f"{package}/msg/{rest}", list(self.fields), 0.5)
        raise UsageError(f"there is no message type {name!r}" + (f"; {hint}" if hint else ""))

    def rule(self, name: str) -> int:
        """The size by the report's rule.

        Raises
        ------
        ProblemError
            when the type contains itself, or one that is not defined.
        """
        return self._rule(name, ())[0]

    def _rule(self, name: str, above: Sequence[str]) -> tuple[int, int]:
        if name in self.rules:
            return self.rules[name]
        if name in above:
            raise ProblemError([Diagnostic(f"{name} contains itself: {' > '.join([*above, name])}")])
        if name not in self.fields:
            within = f", which {above[-1]} has," if above else ""
            file, text = self.own.get(above[-1], ("", "")) if above else ("", "")
            line = _line_of(name.rpartition("/")[2], text)
            raise ProblemError([Diagnostic(f"the type {name}{within} {UNDEFINED}", file=file, line=line)])
        if len(above) >= DEEPEST:
            raise ProblemError([Diagnostic(f"{above[0]} has more than {DEEPEST} messages within each other")])
        sizes = [self._rule_of(node, (*above, name)) for _, node in self.fields[name]]
        depth = 1 + max(depth for _, depth in sizes)
        if depth > DEEPEST:
            raise ProblemError([Diagnostic(f"{name} has more than {DEEPEST} messages within each other")])
        self.rules[name] = (HEADER_BYTES if name == HEADER else sum(size for size, _ in sizes)), depth
        return self.rules[name]

    def _rule_of(self, node: Any, above: Sequence[str]) -> tuple[int, int]:
        kind, what = node
        if kind == FieldType.NAME:
            sizes = self._rule(what, above)
            return (TIME_BYTES, sizes[1]) if what in TIMES else sizes
        return (BY_RULE[what[0]], 0) if kind == FieldType.BASE else self._rule_of(what[0], above)

    def size(self, name: str, lengths: Mapping[str, int], *, largest: bool = False) -> int | None:
        """The serialised size with stated lengths, by path; `largest`: None where something has no bound.

        Raises
        ------
        LengthError
            when a stated length is beyond the bound.
        """
        for item in self.layout.lengths(name):
            stated = lengths.get(item.path, 0)
            if item.bound and stated > item.bound:
                raise LengthError(item.path, stated, f"its bound is {item.bound}")
        if largest and self.unstated(name, lengths):
            return None
        return self.layout.size(name, lengths, largest=largest)

    def unstated(self, name: str, lengths: Mapping[str, int]) -> list[str]:
        """The paths of strings and sequences on which the size depends: without a stated length and a bound.

        Paths such as ``data`` or ``header.frame_id``; the size is not known without them.
        """
        return self.layout.unstated(name, lengths)

    def places(self, name: str) -> list[str]:
        """The paths of what has a length."""
        return [item.path for item in self.layout.lengths(name)]


def _named(node: Any) -> list[str]:
    """The type that a field has, where it is a message."""
    kind, what = node
    if kind == FieldType.NAME:
        return [what]
    return [] if kind == FieldType.BASE else _named(what[0])


def _definitions(file: Path, text: str) -> Iterator[tuple[str, Any]]:
    """The types that a file defines.

    Raises
    ------
    ProblemError
        when it is none.
    """
    if file.suffix not in SUFFIXES:
        words = f"expected a file with one of the suffixes {', '.join(SUFFIXES)}"
        raise ProblemError([Diagnostic(f"{WHAT}: {words}", file=str(file), line=1)])
    if file.suffix == ".idl":
        wrong = [Diagnostic(words, file=str(file), line=line) for line, words in wrong_expressions(text)]
        if wrong:
            raise ProblemError(wrong[:MOST_MISTAKES])
        yield from _parsed(file, text, None).items()
        return
    folder = file.suffix.lstrip(".")
    home = (file.parent.parent if file.parent.name == folder else file.parent).resolve()
    package = package_around(home) or home.name
    if not re.fullmatch(r"\w+", package):
        words = f"{package[:80]!r} cannot be the name of a package with messages"
        raise ProblemError([Diagnostic(words, file=str(file), hint="a package.xml next to its folder states the name")])
    parts = "\n".join(line.rstrip() for line in text.splitlines()).split("\n---" if file.suffix != ".msg" else "\0")
    parts = [part.lstrip("-") for part in parts]
    line = 1
    if text.lstrip().startswith("---") and file.suffix != ".msg":
        if parts[0].strip("- \n") == "" and len(parts) > 1:
            parts[0] = ""
        else:
            parts, line = ["", parts[0]], 0
    if len(parts) != len(PARTS[file.suffix]):
        words = f"expected {len(PARTS[file.suffix])} parts with --- between them, got {len(parts)}"
        raise ProblemError([Diagnostic(f"{WHAT}: {words}", file=str(file), line=1)])
    for ending, part in zip(PARTS[file.suffix], parts, strict=True):
        name = f"{package}/msg/{file.stem}{ending}"  # what a service names without a package is a message of its own
        for type_name, item in _parsed(file, part or "\n", name, line).items():
            yield (f"{package}/{folder}/{file.stem}{ending}" if type_name == name else type_name), item
        line += part.count("\n") + 1


def _parsed(file: Path, text: str, name: str | None, line: int = 1) -> dict[str, Any]:
    """The types in a text, which begins in a line of a file; without a name it is IDL."""
    from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

    with reading(file, WHAT, "", lambda words: (max(1, line) + _odd_line(text) - 1, 0)):
        try:
            types: dict[str, Any] = get_types_from_idl(text) if name is None else get_types_from_msg(text, name)
        except TypesysError as error:
            stopped = _STOPPED.search(str(error))
            if stopped is None:
                raise
            header = "" if name is None else f"MSG: {name}\n"
            whole = f"{header}{text}"
            at = int(stopped[1])
            at += len(whole[at:]) - len(whole[at:].lstrip())
            there = line + whole.count("\n", len(header), at)
            raise ProblemError([Diagnostic(f"{WHAT}: this is not understood", file=str(file), line=there)]) from None
    return types


def _wrong(node: Any) -> str:
    """The reason why a type has no size, or one beyond every limit; "" for a type with a size."""
    kind, what = node
    if kind == FieldType.NAME:
        return ""
    if kind == FieldType.BASE:
        name, bound = what
        if name not in BY_RULE:
            return f"the type {name} has no size that is known here"
    else:
        bound = what[1]
        if words := _wrong(what[0]):
            return words
    return "" if 0 <= bound <= LONGEST else f"expected a length from 0 to {LONGEST}, got {str(bound)[:30]}"


def _line_of(field: str, text: str) -> int:
    """The line of a field in a text of definitions."""
    word = re.compile(rf"\b{re.escape(field)}\b")
    lines = enumerate(text.splitlines(), 1)
    return next((number for number, line in lines if word.search(re.split(r"#|//", line)[0])), 1)


def _odd_line(text: str) -> int:
    """The first line with fewer words than a field has, which may be what is wrong."""
    return next((number for number, line in enumerate(text.splitlines(), 1) if _is_odd(line)), 1)


def _is_odd(line: str) -> bool:
    """Whether a line of a definition has fewer words than a field."""
    words = line.partition("#")[0].split()
    return len(words) == 1 and words[0] != "---"


def message_sizes(types: Types, names: Sequence[str], lengths: Mapping[str, int]) -> list[MessageSize]:
    """The sizes of types, in the given order.

    Raises
    ------
    ProblemError
        when a definition of one of them is wrong, with every mistake.
    UsageError
        when there is no such type, or no type has a stated length.
    """
    types.check(names)
    sizes: list[MessageSize] = []
    used: set[str] = set()
    for name in map(types.full_name, names):
        places = set(types.places(name))
        own = {path: length for path, length in lengths.items() if path in places}
        used |= own.keys()
        least = types.size(name, {})
        assert least is not None
        stated = types.size(name, own) if own else None
        sizes.append(MessageSize(name, types.rule(name), least, stated, types.size(name, {}, largest=True)))
    unused = lengths.keys() - used
    if unused and sizes:
        known = ", ".join(dict.fromkeys(types.places(sizes[0].name))) or "none"
        raise UsageError(
            f"--length {sorted(unused)[0]}: nothing of that path has a length; {sizes[0].name} has {known}"
        )
    return sizes
