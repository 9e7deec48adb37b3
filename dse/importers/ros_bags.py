"""What a bag holds: sizes and rates of the messages of each topic (.bag, .mcap, .db3), by rosbags (extra ``ros``)."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

from dse.errors import Diagnostic, ProblemError
from dse.extras import needed_for
from dse.files.reading import UnreadableFileError, beginning
from dse.records import dataclass

ROS1 = b"#ROSBAG V"
DAMAGED = (
    OSError,
    ValueError,
    LookupError,
    AssertionError,
    EOFError,
    RuntimeError,
    TypeError,
    MemoryError,
    struct.error,
)
"""What reading a damaged bag raises besides errors of its own."""


@dataclass(frozen=True)
class Topic:
    """The messages of a topic: serialised sizes in bytes, times between two of them in ns (None where there is one)."""

    name: str
    type: str
    count: int
    least: int
    most: int
    mean: float
    shortest_ns: int | None
    longest_ns: int | None
    mean_ns: float | None


def read_bag(path: Path) -> list[Topic]:
    """The topics of a bag, by name; a folder is a bag of ROS 2.

    Raises
    ------
    ProblemError
        when it is no bag, or is cut off.
    UsageError
        when rosbags is not installed.
    """
    with needed_for("A bag", "ros"):
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    _check_beginning(path)
    sizes: dict[tuple[str, str], list[int]] = {}
    times: dict[tuple[str, str], list[int]] = {}
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            for connection, stamp_ns, data in reader.messages():
                key = connection.topic, connection.msgtype
                sizes.setdefault(key, []).append(len(data))
                times.setdefault(key, []).append(stamp_ns)
    except (AnyReaderError, *DAMAGED) as error:
        raise ProblemError([_no_bag(path, error)]) from None
    if not sizes:
        raise ProblemError([Diagnostic("the bag has no messages", file=str(path))])
    return [_topic(*key, sizes[key], sorted(times[key])) for key in sorted(sizes)]


def _check_beginning(path: Path) -> None:
    """Stop where there is nothing to read, which would be waited for, or where a bag of ROS 1 does not begin as one.

    It would be read whole in search of a line.
    """
    try:
        begins = beginning(path, len(ROS1)) if path.is_file() else ROS1
    except UnreadableFileError as error:
        raise ProblemError([_no_bag(path, ValueError(error.reason))]) from None
    if path.suffix.lower() == ".bag" and begins != ROS1:
        raise ProblemError([_no_bag(path, ValueError(f"it does not begin with {ROS1.decode()}"))])


def _no_bag(path: Path, error: Exception) -> Diagnostic:
    words = " ".join(str(error).split())[:200] or type(error).__name__
    hint = "a .bag, .mcap or .db3 file, or the folder of a bag; is it cut off?"
    return Diagnostic(f"no bag that can be read: {words}", file=str(path), hint=hint)


def _topic(name: str, kind: str, sizes: list[int], times: list[int]) -> Topic:
    gaps = [later - earlier for earlier, later in pairwise(times)]
    mean = (times[-1] - times[0]) / len(gaps) if gaps else None
    return Topic(
        *(name, kind, len(sizes), min(sizes), max(sizes), sum(sizes) / len(sizes)),
        min(gaps, default=None),
        max(gaps, default=None),
        mean,
    )
