"""What a result is made of: points of the front, conflicts, further designs, and where it comes from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import Any

from dse.records import dataclass
from dse.space.types import Design, Space
from dse.units.text import writable
from dse.version import SEMANTICS


@dataclass(frozen=True)
class ObjectiveInfo:
    """An objective: its name, sense, and the unit that its integers count."""

    name: str
    sense: str
    unit: str


@dataclass(frozen=True, repr=False)
class Point:
    """A non-dominated design.

    `objectives` and `metrics` count in the units of the result, `decisions` are the active open ones.
    `id` names the point in a result whatever it is ranked by; `score` says in words what the rank is founded on.
    `is_first`: of all designs with these objectives it is the first in the order of the file.
    """

    id: int
    rank: int
    objectives: Mapping[str, int]
    metrics: Mapping[str, int]
    decisions: Mapping[str, str]
    design: Design
    score: str = ""
    is_first: bool = True

    def __repr__(self) -> str:
        """One line: its number, rank and objectives."""
        told = ", ".join(f"{name} = {value}" for name, value in self.objectives.items())
        return f"<Point {self.id}, rank {self.rank}: {told}>"


@dataclass(frozen=True)
class Clash:
    """A member of a conflict: its limit, the closest that leaves a design while all else holds, the miss, in `unit`.

    A rule has no figures, and none has where moving it alone does not help. A share of a processor or of a bandwidth
    counts in ppm. `thread` names the thread that alone needs so much of one core, if that is what counts. Of a metric
    in which the response time of the threads `unbounded` has no bound even in the best design there is no closest limit
    either; nor is there where the time was too short to look for it (`is_sought` False). `overload` names the processor
    or bus that the closest limit overloads, which has to be allowed.
    """

    text: str
    origin: str
    unit: str = ""
    limit: Fraction | None = None
    closest: Fraction | None = None
    thread: str = ""
    unbounded: tuple[str, ...] = ()
    is_sought: bool = True
    overload: str = ""

    @property
    def miss(self) -> Fraction | None:
        """How far the closest value, as it is written, is beyond the limit."""
        return (
            None if self.closest is None or self.limit is None else abs(Fraction(writable(self.closest)) - self.limit)
        )


@dataclass(frozen=True)
class Conflict:
    """Requirements and rules that cannot hold together, although without any one of them the others can.

    `by_waiting` is False where there is no design even if each response time were as long as the job takes alone; True
    where it takes that threads wait for each other, as far as is known.
    """

    members: tuple[Clash, ...]
    by_waiting: bool = True


@dataclass(frozen=True)
class FurtherDesign:
    """Another design at or near a point of the front; `id` is ``POINT.NUMBER``.

    `dominated_by` are the ids of the points that dominate it; `different` counts the decisions that differ from the
    point's.
    """

    id: str
    objectives: Mapping[str, int]
    metrics: Mapping[str, int]
    decisions: Mapping[str, str]
    design: Design
    dominated_by: tuple[int, ...]
    different: int


@dataclass(frozen=True)
class FurtherDesigns:
    """Further designs of point `of`: with its objectives (`within` 0), or with each at most that share worse.

    They are chosen to differ from the point and from one another. `more` says whether there are others still: None
    where the solver was stopped before it could tell.
    """

    of: int
    within: Fraction
    designs: tuple[FurtherDesign, ...]
    more: bool | None


@dataclass(frozen=True)
class FurtherAsked:
    """How many further designs were asked for, within which share (None: with the very objectives), of which points."""

    count: int
    within: Fraction | None
    points: tuple[int, ...]


@dataclass(frozen=True)
class Search:
    """What the search did: calls, seconds, size of the space, solver, workers, seed."""

    solver_calls: int
    wall_s: float
    space_size: int
    solver: str
    workers: int
    seed: int


@dataclass(frozen=True)
class Origin:
    """Which problem was solved: name, file, hashes, and the question as it was really asked.

    `identity` is the digest of what the problem means (`dse.spec.document`); `texts` are its files by name, as found
    from the folder of the main one, so that a result can be worked with where they are not. `is_carried`: so it was
    here.
    """

    name: str
    file: str
    sha256: str
    includes: Sequence[tuple[str, str]]
    effective: Mapping[str, Any]
    identity: str = ""
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    is_carried: bool = False

    @property
    def question(self) -> str:
        """The digest of all that was asked: what the figures mean, what the problem means, and what was asked of it.

        Regions that were refuted belong to one question, and prove nothing of another.
        """
        asked = [SEMANTICS, self.identity, dict(self.effective)]
        return hashlib.sha256(json.dumps(asked, ensure_ascii=False, sort_keys=True).encode()).hexdigest()


def unused_choices(space: Space, listed: Iterable[tuple[int, Mapping[str, str]]]) -> list[dict[str, Any]]:
    """The decisions that were fixed and that some points have no use for, so that fixing them changes nothing there.

    `listed` has id and active decisions of each point; as the JSON of a result has it.
    """
    points, found = list(listed), []
    for index, option in space.fixed.items():
        decision = space.decisions[index]
        idle = [number for number, decisions in points if decision.is_open and decision.name not in decisions]
        if idle:
            found.append({"decision": decision.name, "option": decision.options[option], "points": idle})
    return found
