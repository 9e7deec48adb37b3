"""The form of what `dse sizes` tells: ``dse-sizes/1``."""

from __future__ import annotations

from typing import Literal

from dse.answers.forms.base import Form, Number, field


class TypeSize(Form):
    """The sizes of a message type in bytes."""

    name: str = field("The type, such as `sensor_msgs/msg/Imu`.")
    rule: int = field("By the report's rule: each array one element, a string 8, a header 24.")
    least: int = field("Serialised, with empty strings and sequences.")
    stated: int | None = field("Serialised, with the stated lengths; null where none is of this type.")
    most: int | None = field("Serialised, at its largest; null where a string or sequence has no bound.")


class TopicSize(Form):
    """What a bag has of a topic."""

    name: str = field("The topic.")
    type: str = field("Its message type.")
    count: int = field("How many messages there are.")
    least: int = field("The least serialised size in bytes.")
    most: int = field("The greatest.")
    mean: Number = field("Their mean.")
    shortest_ns: int | None = field("The shortest time between two messages; null with fewer than two.")
    longest_ns: int | None = field("The longest.")
    mean_ns: Number | None = field("The mean.")


class SizesForm(Form):
    """The outcome of `dse sizes`."""

    format: Literal["dse-sizes/1"] = field("The name of this format.")
    distribution: str = field("The distribution of ROS: its types, and how they are serialised.")
    lengths: dict[str, int] = field("The lengths that were stated, by path.")
    types: list[TypeSize] = field("Message types.")
    topics: list[TopicSize] = field("Topics of bags.")
