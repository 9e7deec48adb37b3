"""What it costs to insist on an option: the front with it fixed, for each option of each open decision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from dse.records import dataclass
from dse.space.types import Design


@dataclass(frozen=True)
class InsistedPoint:
    """A design that is on the front with some option fixed, but not on the whole front; ids go on after those there."""

    id: int
    objectives: Mapping[str, int]
    metrics: Mapping[str, int]
    decisions: Mapping[str, str]
    design: Design


@dataclass(frozen=True)
class InsistedOption:
    """The front with an option fixed, as ids of points of the whole front and of `Insisting.points`.

    `status` is ``complete`` (proved), ``incomplete`` (stopped: these points are on it, others may be too) or
    ``infeasible`` (proved that no design has the option). Ids are in ascending order.
    """

    decision: str
    option: str
    status: Literal["complete", "incomplete", "infeasible"]
    front: tuple[int, ...]


@dataclass(frozen=True)
class Insisting:
    """The front with each option fixed; decisions and options in the order of the problem."""

    points: tuple[InsistedPoint, ...]
    options: tuple[InsistedOption, ...]

    @property
    def is_complete(self) -> bool:
        """Whether every option's front is proved."""
        return all(item.status != "incomplete" for item in self.options)
