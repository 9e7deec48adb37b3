"""Bags: sizes and rates of the messages of each topic (.bag, .mcap, .db3), by rosbags (extra ``ros``)."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from dse.support.errors import Diagnostic, ProblemError
from dse.support.extras import needed_for
from dse.support.files.foreign import reading
from dse.support.files.reading import UnreadableFileError, beginning, obstacle
from dse.support.timelimit import in_time

ROS1 = b"#ROSBAG V"
WHAT = "no bag that can be read"
HINT = "a .bag, .mcap or .db3 file, or the folder of a bag; is it cut off?"
METADATA, MOST_METADATA = "metadata.yaml", 4_000_000
MOST_NS = 2**63


@dataclass(frozen=True)
class Topic:
    """The messages of one topic in a bag: their number, sizes and intervals.

    Sizes in bytes as serialised in the bag, times in ns between the moments of recording.
    """

    JSON_NAME = "TopicSize"

    name: Annotated[str, "The topic."]
    type: Annotated[str, "Its message type."]
    count: Annotated[int, "How many messages there are."]
    least: Annotated[int, "The least serialised size in bytes."]
    most: Annotated[int, "The greatest."]
    mean: Annotated[float, "Their mean."]
    shortest_ns: Annotated[int | None, "The shortest time between two messages; null with fewer than two."]
    longest_ns: Annotated[int | None, "The longest."]
    mean_ns: Annotated[float | None, "The mean."]


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
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
    _check_beginning(path)
    sizes: dict[tuple[str, str], array[int]] = {}
    times: dict[tuple[str, str], array[int]] = {}
    with reading(path, WHAT, HINT), (Reader1 if path.suffix == ".bag" else Reader2)(path) as reader:
        stamp_ns: Any  # whatever a damaged database has in its place
        for connection, stamp_ns, data in in_time(reader.messages()):
            key = connection.topic, connection.msgtype
            if not (isinstance(stamp_ns, int) and 0 <= stamp_ns < MOST_NS):
                raise _no_bag(path, f"a message of {str(key[0])[:80]} has no time from 0 to 2**63 ns")
            if key not in sizes:
                if not all(isinstance(text, str) for text in key):
                    raise _no_bag(path, "a topic without a name and a type")
                sizes[key], times[key] = array("q"), array("q")
            sizes[key].append(len(data))
            times[key].append(stamp_ns)
    if not sizes:
        raise ProblemError([Diagnostic("the bag has no messages", file=str(path))])
    return [_topic(*key, sizes[key], sorted(times[key])) for key in sorted(sizes)]


def _check_beginning(path: Path) -> None:
    """Stop where there is nothing to read, which would be waited for, or where a bag of ROS 1 does not begin as one.

    It would be read whole in search of a line. Of a folder all files are regular ones, and what describes it is short.
    """
    if path.is_dir():
        for item in sorted(path.iterdir()):
            missing = None if item.is_dir() else obstacle(item)
            if item.name == METADATA and missing is None and item.stat().st_size > MOST_METADATA:
                missing = f"the file is larger than {MOST_METADATA // 10**6} MB"
            if missing is not None:
                raise _no_bag(path, f"{item.name}: {missing}")
        return
    try:
        begins = beginning(path, len(ROS1))
    except UnreadableFileError as error:
        raise _no_bag(path, error.reason) from None
    if path.suffix.lower() == ".bag" and begins != ROS1:
        raise _no_bag(path, f"it does not begin with {ROS1.decode()}")


def _no_bag(path: Path, words: str) -> ProblemError:
    return ProblemError([Diagnostic(f"{WHAT}: {words}", file=str(path), hint=HINT)])


def _topic(name: str, kind: str, sizes: Sequence[int], times: Sequence[int]) -> Topic:
    gaps = [later - earlier for earlier, later in pairwise(times)]
    mean = (times[-1] - times[0]) / len(gaps) if gaps else None
    return Topic(
        *(name, kind, len(sizes), min(sizes), max(sizes), sum(sizes) / len(sizes)),
        min(gaps, default=None),
        max(gaps, default=None),
        mean,
    )
