"""Sizes of connections that name their type of ROS message in place of a `data_size`, by rosbags (extra ``ros``).

A result carries the sizes that were found, under `CARRIED`: it is read back without rosbags and without definitions.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from dse.importers.ros2.messages import DEFAULT, LengthError, Types
from dse.spec.loading.reader import PathPart
from dse.spec.loading.sources import Carried, Files
from dse.spec.schema.model import Connection, Messages, Spec
from dse.support.errors import ProblemError, UsageError
from dse.support.files.reading import UnreadableFileError
from dse.support.units import shown

CARRIED = "<sizes of messages>"
"""Among the texts of a problem: the sizes of the connections that name a message, in bytes, as JSON."""
MOST_BYTES = 8_000_000


@dataclass(frozen=True)
class MessageMistake:
    """A mistake in the description of a message, with its place.

    `path` leads to the key in the problem file; `hint` says what would be right.
    """

    path: tuple[PathPart, ...]
    message: str
    hint: str = ""


@dataclass
class Sized:
    """Sizes in bytes by connection; connections with a mistake have none.

    Sizes count as the section `messages` of the file asks, with the stated lengths of sequences.
    """

    sizes: dict[str, int] = field(default_factory=dict)
    mistakes: list[MessageMistake] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The sizes, as a result carries them.

        JSON with names of connections and bytes, so that a result can be reopened without the definitions of messages.
        """
        return json.dumps(self.sizes, ensure_ascii=False, indent=1)


Named: TypeAlias = Mapping[str, Connection]


def read_sizes(spec: Spec, main: Path, files: Files, *, is_text: bool = False, doubtful: Collection[str] = ()) -> Sized:
    """The sizes of the connections of a problem that name a message.

    Where their lengths are left open, strings and sequences count with their bounds; those without a bound are
    mistakes. `is_text`: the problem is in no file, from whose folder definitions could be found. `doubtful`:
    connections of which something was left out, which are passed over.
    """
    sized = Sized()
    sound = {name: item for name, item in spec.connections.items() if name not in doubtful}
    named = {name: item for name, item in sound.items() if item.message is not None}
    for name, item in sound.items():
        sized.mistakes += _contradictions(name, item)
    if spec.messages is not None and spec.messages.definitions and is_text:
        sized.mistakes.append(MessageMistake(("messages", "definitions"), "a text cannot name files of definitions"))
    if not named or sized.mistakes:
        return sized
    if isinstance(files, Carried):
        return _carried(sized, named, main, files)
    _compute(sized, named, spec.messages or Messages(), main)
    return sized


def _contradictions(name: str, item: Connection) -> Iterator[MessageMistake]:
    path = ("connections", name)
    if item.message is None and item.lengths:
        yield MessageMistake((*path, "lengths"), "lengths are those of a `message`, which is not stated")
    if item.message is None:
        return
    for other in ("data_size", "data_rate"):
        if getattr(item, other) is not None:
            yield MessageMistake((*path, other), f"give `message` or `{other}`, not both")


def _carried(sized: Sized, named: Named, main: Path, files: Files) -> Sized:
    """The sizes that a result carries."""
    try:
        sizes = json.loads(files.read(main.parent / CARRIED, MOST_BYTES, "the sizes of messages"))
    except (UnreadableFileError, ValueError):
        sizes = None
    for name in named:
        size = sizes.get(name) if isinstance(sizes, dict) else None
        if isinstance(size, int) and size >= 0:
            sized.sizes[name] = size
        else:
            sized.mistakes.append(
                MessageMistake(("connections", name, "message"), "the result does not carry its size")
            )
    return sized


def _compute(sized: Sized, named: Named, stated: Messages, main: Path) -> None:
    try:
        folders = [main.parent / text for text in stated.definitions or ()]
        for position, folder in enumerate(folders):
            if not folder.exists():
                hint = "the path is relative to this file"
                path: tuple[PathPart, ...] = ("messages", "definitions", *((position,) if len(folders) > 1 else ()))
                sized.mistakes.append(MessageMistake(path, f"no such file or folder: {shown(str(folder))}", hint))
        if sized.mistakes:
            return
        types = Types(stated.distribution or DEFAULT, folders)
        types.check([item.message or "" for item in named.values()])
    except UsageError as error:  # no rosbags, or no such distribution
        where = ("messages", "distribution") if stated.distribution else ("connections", next(iter(named)), "message")
        sized.mistakes.append(MessageMistake(where, str(error).removeprefix("--")))
        return
    except ProblemError as error:
        where = ("messages", "definitions")
        sized.mistakes += [MessageMistake(where, str(item)) for item in error.diagnostics]
        return
    for name, item in named.items():
        try:
            sized.sizes[name] = _size(types, item, stated)
        except _WrongError as error:
            sized.mistakes += [MessageMistake(("connections", name, *path), *said) for path, *said in error.mistakes]


class _WrongError(Exception):
    """The mistakes of a connection: for each one its path, a message and a hint."""

    def __init__(self, *mistakes: tuple[tuple[PathPart, ...], str, str]) -> None:
        super().__init__(*(message for _, message, _ in mistakes))
        self.mistakes = mistakes


def _size(types: Types, item: Connection, stated: Messages) -> int:
    try:
        name = types.full_name(item.message or "")
        places = list(types.places(name))
    except UsageError as error:
        raise _WrongError((("message",), str(error), "")) from None
    except ProblemError as error:
        raise _WrongError((("message",), error.diagnostics[0].message, "")) from None
    if stated.size == "rule":
        if item.lengths:
            raise _WrongError((("lengths",), "they do not count where `messages` states `size: rule`", ""))
        return types.rule(name)
    unknown = [path for path in item.lengths if path not in places]
    if unknown:
        has = f"it has {', '.join(places)}" if places else "it has none"
        text = f"nothing of {item.message} at that path has a length"
        raise _WrongError(*((("lengths", path), text, has) for path in unknown))
    try:
        if missing := types.unstated(name, item.lengths):
            example = "{" + ", ".join(f"{path}: 8" for path in missing) + "}"
            text = f"the size of {item.message} depends on the length of {', '.join(missing)}"
            raise _WrongError((("message",), text, f"state it, such as `lengths: {example}`"))
        size = types.size(name, item.lengths, largest=True)
    except LengthError as error:
        raise _WrongError((("lengths", error.path), error.reason, "")) from None
    assert size is not None
    return size


def with_sizes(spec: Spec, sized: Sized) -> Spec:
    """The problem with these sizes stated for its connections, in place of their messages.

    A copy of the spec; connections with a size of their own are not changed.
    """
    if not sized.sizes:
        return spec
    connections = dict(spec.connections)
    for name, size in sized.sizes.items():
        update: dict[str, Any] = {"data_size": (size,), "message": None, "lengths": {}}
        connections[name] = connections[name].model_copy(update=update)
    return spec.model_copy(update={"connections": connections})
