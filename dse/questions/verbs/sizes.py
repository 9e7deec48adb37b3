"""`dse.sizes`: how large ROS messages are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dse.answers.base import DataAnswer
from dse.answers.tables.frames import unit_frame
from dse.importers.ros2.bags import Topic, read_bag
from dse.importers.ros2.messages import DEFAULT, LONGEST, MessageSize, Types, message_sizes
from dse.support import arguments
from dse.support.errors import UsageError

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class Sizes(DataAnswer):
    """The outcome of `dse sizes`.

    Examples
    --------
    >>> import dse
    >>> found = dse.sizes("geometry_msgs/PoseArray", lengths={"poses": 32}, distribution="ros1_noetic")
    >>> found.types[0].stated
    1812
    """

    FORMAT = "sizes"

    distribution: Annotated[str, "The distribution of ROS: its types, and how they are serialised."]
    lengths: Annotated[Mapping[str, int], "The lengths that were stated, by path."]
    types: Annotated[tuple[MessageSize, ...], "Message types."]
    topics: Annotated[tuple[Topic, ...], "Topics of bags."]

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each type, and one for each topic of bags.

        Columns: ``type``; ``rule [B]``, ``least [B]``, ``stated [B]``, ``most [B]`` as in `types` (missing where there
        is none, ``most`` where it has no bound); where bags were read ``topic``, ``count``, ``mean [B]``,
        ``shortest [ms]``, ``mean time [ms]`` and ``longest [ms]``, as in `topics`. `units` as for `Result.frame`.
        """
        columns = ["type", "rule", "least", "stated", "most"]
        rows: list[Mapping[str, Any]] = [{**vars(item), "type": item.name} for item in self.types]
        if self.topics:
            columns = ["topic", *columns, "count", "mean", "shortest", "mean time", "longest"]
        for item in self.topics:
            times = {"shortest": item.shortest_ns, "mean time": item.mean_ns, "longest": item.longest_ns}
            rows.append({**vars(item), "topic": item.name, **times})
        counted = dict.fromkeys(("rule", "least", "stated", "most", "mean"), "B")
        return unit_frame(columns, rows, counted | dict.fromkeys(("shortest", "mean time", "longest"), "ns"), units)


@arguments.checked(
    lengths=arguments.lengths,
    names=arguments.texts,
    definitions=arguments.paths,
    bags=arguments.paths,
    distribution=arguments.text,
)
def sizes(
    *names: str,
    definitions: Sequence[str | Path] = (),
    bags: Sequence[str | Path] = (),
    lengths: Mapping[str, int] | None = None,
    distribution: str = DEFAULT,
) -> Sizes:
    """The sizes of ROS messages: by the report's rule, serialised at least, with stated lengths, and at most.

    Parameters
    ----------
    names
        message types; all of the definitions, or of the distribution, where there are none and no bags.
    definitions
        files (``.msg``, ``.srv``, ``.action``, ``.idl``) or folders with packages.
    bags
        bags (``.bag``, ``.mcap``, ``.db3``, or a folder), whose topics are measured.
    lengths
        how many elements or characters what has a length has, by its path: ``{"header.frame_id": 8}``.
    distribution
        which types there are besides, and how all are serialised: ROS 1, or CDR.

    Raises
    ------
    ProblemError
        when a file is wrong, with its line.
    UsageError
        when an argument is, or rosbags is not installed.

    Examples
    --------
    >>> import dse
    >>> [imu, odometry] = dse.sizes("sensor_msgs/Imu", "nav_msgs/Odometry").types
    >>> imu.rule, imu.least, odometry.rule
    (128, 316, 152)
    """
    stated = dict(lengths or {})
    for path, length in stated.items():
        if not 0 <= length <= LONGEST:
            raise UsageError(f"--length {path}={length}: from 0 to {LONGEST}")
    topics = tuple(topic for bag in bags for topic in read_bag(Path(bag)))
    measured: list[MessageSize] = []
    if names or definitions or not bags:
        types = Types(distribution, [Path(item) for item in definitions])
        measured = message_sizes(types, names or types.names(), stated)
    return Sizes(distribution, stated, tuple(measured), topics)
