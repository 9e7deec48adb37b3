"""Sizes of ROS messages: the report's rule, and what they take serialised (ROS 1, or CDR), by rosbags (extra ``ros``).

The report (ECE-TR-25, section 4.5) counts each array as one element, a string as 8 bytes and a header as 24:
`sensor_msgs/Imu` has 128 B and `nav_msgs/Odometry` 152 B. The true size depends on the lengths of arrays and strings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.errors import Diagnostic, ProblemError, UsageError, did_you_mean
from dse.extras import needed_for
from dse.files.reading import UnreadableFileError, read_text
from dse.records import dataclass

WIDTHS = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
    "float32": 4, "int64": 8, "uint64": 8, "float64": 8, "string": 8, "time": 8, "duration": 8, "octet": 1,
}  # fmt: skip
"""Bytes by the report's rule."""
HEADER, HEADER_BYTES = "std_msgs/msg/Header", 24
SUFFIXES = (".msg", ".srv", ".action", ".idl")
PARTS = {".msg": ("",), ".srv": ("_Request", "_Response"), ".action": ("_Goal", "_Result", "_Feedback")}
MOST_BYTES = 4_000_000
"""Of a file of definitions."""
LONGEST = 10**8
"""The most elements of an array or string that may be stated."""
MOST_MESSAGES = 1_000_000
"""The most elements of an array or sequence of messages or texts, each of which is serialised."""
DEFAULT = "ros2_humble"


@dataclass(frozen=True)
class MessageSize:
    """The sizes of one type in bytes.

    `rule` is that of the report; `least` has empty strings and sequences; `stated` the lengths that were given (None
    where none is of this type); `most` is None where a string or sequence has no bound.
    """

    name: str
    rule: int
    least: int
    stated: int | None
    most: int | None


class _UnboundedError(Exception):
    """A string or sequence without a bound, by its path."""

    def __init__(self, path: str) -> None:
        super().__init__(path)
        self.path = path


class LengthError(UsageError):
    """A stated length that cannot be; `path` says of what, `reason` why."""

    def __init__(self, path: str, stated: int, reason: str) -> None:
        super().__init__(f"--length {path}={stated}: {reason}")
        self.path, self.reason = path, reason


class _WrongFormError(ValueError):
    """A file that has not the form of a definition, in our words."""


class Types:
    """Message types: those of a distribution of ROS, and of files of definitions."""

    def __init__(self, distribution: str = DEFAULT, definitions: Sequence[Path] = ()) -> None:
        """Read definitions: files, or folders with packages in them.

        Raises
        ------
        ProblemError
            when a file of definitions is wrong, with every mistake.
        UsageError
            when there is no such distribution, or rosbags is not installed.
        """
        with needed_for("The size of a ROS message", "ros"):
            from rosbags.interfaces import Nodetype
            from rosbags.typesys import Stores, TypesysError, get_typestore
        names = [store.value for store in Stores if store.name not in ("EMPTY", "LATEST")]
        if distribution not in names:
            raise UsageError(f"--distribution {distribution}: there are {', '.join(names)}")
        self.node, self.error = Nodetype, TypesysError
        self.store = get_typestore(Stores(distribution))
        self.is_ros1 = distribution.startswith("ros1")
        self.own: dict[str, str] = {}
        mistakes = [mistake for path in definitions for mistake in self._read(path)]
        mistakes += [mistake for name, file in self.own.items() for mistake in self._check(name, file)]
        if mistakes:
            raise ProblemError(mistakes)

    def _read(self, path: Path) -> Iterator[Diagnostic]:
        files = sorted(item for item in path.rglob("*") if item.suffix in SUFFIXES) if path.is_dir() else [path]
        if not files:
            yield Diagnostic(f"there is no file of definitions in this folder ({', '.join(SUFFIXES)})", file=str(path))
        for file in files:
            try:
                text = read_text(file, MOST_BYTES, "definitions of messages")
                found = dict(self._definitions(file, text))
                self.store.register({name: item for name, item in found.items() if name not in self.store.fielddefs})
                self.own |= dict.fromkeys(found, str(file))
            except UnreadableFileError as error:
                yield Diagnostic(error.reason, file=str(file))
            except (self.error, ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
                # the file may be any that a problem file names: nothing of it is quoted
                words = str(error) if isinstance(error, _WrongFormError) else "it cannot be read"
                line = next((number for number, text_line in enumerate(text.splitlines(), 1) if _is_odd(text_line)), 1)
                yield Diagnostic(f"no definition of a message: {words}", file=str(file), line=line)

    def _definitions(self, file: Path, text: str) -> Iterator[tuple[str, Any]]:
        from rosbags.typesys import get_types_from_idl, get_types_from_msg

        if file.suffix not in SUFFIXES:
            raise _WrongFormError(f"expected a file with one of the suffixes {', '.join(SUFFIXES)}")
        if file.suffix == ".idl":
            yield from get_types_from_idl(text).items()
            return
        folder = file.suffix.lstrip(".")
        package = (file.parent.parent if file.parent.name == folder else file.parent).resolve().name
        parts = "\n".join(line.rstrip() for line in text.splitlines()).split("\n---" if file.suffix != ".msg" else "\0")
        parts = [part.lstrip("-") for part in parts]
        if text.lstrip().startswith("---") and file.suffix != ".msg":
            parts = ["", *parts[1:]] if parts[0].strip("- \n") == "" and len(parts) > 1 else ["", parts[0]]
        if len(parts) != len(PARTS[file.suffix]):
            raise _WrongFormError(f"expected {len(PARTS[file.suffix])} parts with --- between them, got {len(parts)}")
        for ending, part in zip(PARTS[file.suffix], parts, strict=True):
            name = (
                f"{package}/msg/{file.stem}{ending}"  # what a service names without a package is a message of its own
            )
            for found, item in get_types_from_msg(part or "\n", name).items():
                yield (f"{package}/{folder}/{file.stem}{ending}" if found == name else found), item

    def _check(self, name: str, file: str) -> Iterator[Diagnostic]:
        """That every type in a definition is there, and that none contains itself."""
        try:
            self.rule(name)
        except ProblemError as error:
            yield from (Diagnostic(item.message, file=file, line=1) for item in error.diagnostics)

    def names(self) -> list[str]:
        """The types of the files of definitions; those of the distribution where there are none."""
        return sorted(self.own or self.store.fielddefs)

    def full_name(self, name: str) -> str:
        """``sensor_msgs/msg/Imu`` of ``sensor_msgs/Imu``.

        Raises
        ------
        UsageError
            when there is no such type.
        """
        package, _, rest = name.partition("/")
        for text in (name, f"{package}/msg/{rest}"):
            if text in self.store.fielddefs:
                return text
        hint = did_you_mean(f"{package}/msg/{rest}", self.store.fielddefs, 0.5)
        raise UsageError(f"there is no message type {name!r}" + (f"; {hint}" if hint else ""))

    def _fields(self, name: str, above: Sequence[str]) -> Any:
        if name in above:
            raise ProblemError([Diagnostic(f"{name} contains itself: {' > '.join([*above, name])}")])
        if name not in self.store.fielddefs:
            within = f", which {above[-1]} has," if above else ""
            raise ProblemError([Diagnostic(f"the type {name}{within} is not defined")])
        return self.store.fielddefs[name][1]

    def rule(self, name: str, above: Sequence[str] = ()) -> int:
        """The size by the report's rule."""
        if name == HEADER:
            return HEADER_BYTES
        return sum(self._rule_of(node, (*above, name)) for _, node in self._fields(name, above))

    def _rule_of(self, node: Any, above: Sequence[str]) -> int:
        kind, what = node
        if kind == self.node.NAME:
            if what in ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"):
                return WIDTHS["time"]
            return self.rule(what, above)
        return WIDTHS[what[0]] if kind == self.node.BASE else self._rule_of(what[0], above)

    def size(self, name: str, lengths: Mapping[str, int], *, largest: bool = False) -> int | None:
        """The serialised size with stated lengths, by path; `largest`: None where something has no bound."""
        try:
            message = self._message(name, lengths, "", largest)
        except _UnboundedError:
            return None
        serialise = self.store.serialize_ros1 if self.is_ros1 else self.store.serialize_cdr
        return len(serialise(message, name))

    def unstated(self, name: str, lengths: Mapping[str, int]) -> list[str]:
        """The paths of strings and sequences on which the size depends, that have neither a stated length nor a bound.

        Raises
        ------
        LengthError
            when a stated length is beyond the bound.
        """
        found: list[str] = []
        while True:
            try:
                self._message(name, {**lengths, **dict.fromkeys(found, 1)}, "", largest=True)
            except _UnboundedError as error:
                found.append(error.path)
            else:
                return found

    def _message(self, name: str, lengths: Mapping[str, int], path: str, largest: bool) -> Any:
        fields = self.store.fielddefs[name][1]
        values = [self._value(node, lengths, f"{path}.{field}".lstrip("."), largest) for field, node in fields]
        return self.store.types[name](*values)

    def _value(self, node: Any, lengths: Mapping[str, int], path: str, largest: bool) -> Any:
        kind, what = node
        if kind == self.node.NAME:
            return self._message(what, lengths, path, largest)
        if kind == self.node.BASE:
            if what[0] != "string":
                return False if what[0] == "bool" else 0
            return "x" * self._length(path, what[1], lengths, largest)
        inner, bound = what
        count = bound if kind == self.node.ARRAY else self._length(path, bound, lengths, largest)
        return self._several(inner, count, lengths, path, largest)

    def _several(self, inner: Any, count: int, lengths: Mapping[str, int], path: str, largest: bool) -> Any:
        import numpy as np

        kind, what = inner
        if kind == self.node.BASE and what[0] != "string":
            names = {"byte": "uint8", "char": "uint8", "octet": "uint8"}
            return np.zeros(count, dtype=names.get(what[0], what[0]))
        if count > MOST_MESSAGES:
            raise LengthError(path, count, f"of messages or texts at most {MOST_MESSAGES} are counted")
        place = path if kind == self.node.NAME else f"{path}[]"
        return [self._value(inner, lengths, place, largest)] * count if count else []

    def _length(self, path: str, bound: int, lengths: Mapping[str, int], largest: bool) -> int:
        stated = lengths.get(path)
        if stated is not None:
            if bound and stated > bound:
                raise LengthError(path, stated, f"its bound is {bound}")
            return stated
        if largest and not bound:
            raise _UnboundedError(path)
        return bound if largest else 0

    def places(self, name: str, path: str = "") -> Iterator[str]:
        """The paths of what has a length."""
        for field, (kind, what) in self._fields(name, ()):
            place = f"{path}.{field}".lstrip(".")
            inner_kind, inner = (kind, what)
            if kind in (self.node.ARRAY, self.node.SEQUENCE):
                if kind == self.node.SEQUENCE:
                    yield place
                inner_kind, inner = what[0]
                if inner_kind == self.node.BASE and inner[0] == "string":
                    yield f"{place}[]"
                    continue
            if inner_kind == self.node.NAME:
                yield from self.places(inner, place)
            elif inner_kind == self.node.BASE and inner[0] == "string":
                yield place


def _is_odd(line: str) -> bool:
    """Whether a line of a definition has fewer words than a field."""
    words = line.partition("#")[0].split()
    return len(words) == 1 and words[0] != "---"


def message_sizes(types: Types, names: Sequence[str], lengths: Mapping[str, int]) -> list[MessageSize]:
    """The sizes of types, in the given order.

    Raises
    ------
    UsageError
        when there is no such type, or no type has a stated length.
    """
    found: list[MessageSize] = []
    used: set[str] = set()
    for name in map(types.full_name, names):
        own = {path: length for path, length in lengths.items() if path in set(types.places(name))}
        used |= own.keys()
        least = types.size(name, {})
        assert least is not None
        stated = types.size(name, own) if own else None
        found.append(MessageSize(name, types.rule(name), least, stated, types.size(name, {}, largest=True)))
    unused = lengths.keys() - used
    if unused and found:
        known = ", ".join(dict.fromkeys(types.places(found[0].name))) or "none"
        raise UsageError(
            f"--length {sorted(unused)[0]}: nothing of that path has a length; {found[0].name} has {known}"
        )
    return found
