"""The result of a solve: the front with everything that a reader or a program needs to judge and reuse it."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from dse.analysis.diagnosis.front_verdicts import cores_of, with_contention
from dse.answers.base import Answer, With
from dse.answers.contention_verdicts import NOT_JUDGED, Contended, core_use
from dse.answers.ranking.ranking import METHOD, competition_ranks, ideal_distances
from dse.answers.ranking.variants import find_variants
from dse.answers.tables.display import in_base_units, in_table, scaled_unit, titled
from dse.answers.tables.frames import unit_frame
from dse.space.model.space import Design, Space
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.support.units.text import count_words, writable
from dse.support.version import SEMANTICS

if TYPE_CHECKING:
    import pandas

FORMULA = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True, repr=False)
class Result(Answer):
    """The outcome of `dse.solve`.

    `status` is ``complete`` (the front is proved), ``incomplete`` (stopped early: every point is non-dominated among
    all designs, but others may be missing in the `unexplored` regions; where none was proved in time, the one design
    shown is feasible and no more, and lies in such a region) or ``infeasible`` (proved). The front is in the order of
    rank. `baseline` is today's design where the problem states all of it; `ranking` is the method as asked for,
    `ranking_words` the method with its parameters; `others` are further designs at or near points of the front, where
    they were asked for; `give_up`, where no single member of the conflicts mends the problem, are the fewest that do
    together, each with its closest limit when the others are given up; `rounded` names the figures that are rounded up,
    to the unit in which they count. Regions are exclusive bounds by objective; `potential` is the best value of each
    objective that may still be unexplored. `interrupted` says that Ctrl-C ended the search: nothing is added then.
    `contended` says by id what each design keeps when response times count, where the question leaves them out
    (`dse.analysis.diagnosis.front_verdicts`); designs that are missing there were not checked. `insisting` has the
    front with each option fixed, where that was asked for. `under_way`: the search goes on, and this is kept in case
    the run is lost: points are as the solver claims them, with their objectives and decisions and nothing else.

    Examples
    --------
    >>> import dse
    >>> result = dse.solve("pump.yaml")
    >>> result.frame(("ms", "EUR")).columns[2]
    'jitter of sensor_to_valve [ms]'
    """

    FORM = "result.ResultForm"

    problem: Origin
    space: Space
    status: Literal["complete", "incomplete", "infeasible"]
    objectives: tuple[ObjectiveInfo, ...]
    counting_units: Mapping[str, str]
    front: tuple[Point, ...]
    unexplored: tuple[Mapping[str, int], ...]
    refuted: tuple[Mapping[str, int], ...]
    potential: Mapping[str, int]
    conflicts: tuple[Conflict, ...]
    search: Search
    baseline: Design | None = None
    ranking: str = "ideal"
    ranking_words: str = METHOD
    others: tuple[FurtherDesigns, ...] = ()
    others_asked: FurtherAsked | None = None
    give_up: tuple[Clash, ...] = ()
    rounded: tuple[str, ...] = ()
    interrupted: bool = False
    contended: Mapping[str, Contended] = field(default_factory=dict)
    insisting: Insisting | None = None
    under_way: bool = False

    def to_json(self) -> str:
        """`to_dict` as text; on one line, which is made soonest, while the search is under way."""
        return f"{json.dumps(self.to_dict(), ensure_ascii=False)}\n" if self.under_way else super().to_json()

    @property
    def exit_code(self) -> int:
        """What the command line answers with."""
        return {"complete": EXIT_COMPLETE, "incomplete": EXIT_INCOMPLETE, "infeasible": EXIT_NO}[self.status]

    @property
    def leaves_out_contention(self) -> bool:
        """Whether what designs keep with contention is something else than what they were searched for."""
        return with_contention(self.space) is not None

    @cached_property
    def variants(self) -> Mapping[int, int]:
        """Near-identical points by id: the better-ranked point that each is a variant of (`dse.answers.ranking`)."""
        if self.under_way:
            return {}
        vectors = [tuple(point.objectives[item.name] for item in self.objectives) for point in self.front]
        leaders = find_variants(vectors, [point.decisions for point in self.front])
        pairs = zip(self.front, leaders, strict=True)
        return {point.id: self.front[leader].id for point, leader in pairs if leader is not None}

    @property
    def leaders(self) -> tuple[Point, ...]:
        """The points that are no variants of better-ranked ones, in the order of rank."""
        return tuple(point for point in self.front if point.id not in self.variants)

    @property
    def unused(self) -> list[dict[str, Any]]:
        """The fixed decisions that some points have no use for: see `dse.answers.result.unused_choices`."""
        return unused_choices(self.space, ((point.id, point.decisions) for point in self.front))

    def _told(self) -> Mapping[str, Any]:
        listed = [
            With(point, {"variant_of": self.variants.get(point.id), "reasons": None, **self._said_of(point)})
            for point in self.front
        ]
        others = [
            With(item, {"designs": [With(design, self._said_of(design)) for design in item.designs]})
            for item in self.others
        ]
        return {
            "semantics": SEMANTICS,
            "ranking": (self.ranking, self.ranking_words),
            "front": listed,
            "others": others,
            "robust": None,
        }

    def _said_of(self, item: Point | FurtherDesign) -> dict[str, Any]:
        """The core of each thread that has several to choose from, and what the design keeps with contention."""
        chosen = {} if self.under_way else cores_of(self.space, item.design)
        return {
            "cores": {self.space.components[thread].name: core for thread, core in chosen.items()},
            "core_use": core_use(self.space, item.design) if chosen else {},
            "contention": self.contended.get(str(item.id), NOT_JUDGED) if self.leaves_out_contention else None,
        }

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The front as a frame, in the order of rank.

        Columns: ``id``, ``rank``; each objective and each further metric as ``NAME [UNIT]`` (integers in the units of
        `objectives` and `counting_units`; infinite where they are unbounded); each open decision by name (text, None
        where inactive).

        Parameters
        ----------
        units
            units such as ``"ms"`` or ``("ms", "%")`` for the columns of their kind, or ``"readable"`` for those that
            engineers read; figures in them are floating-point.
        """
        rows = [dict(zip(self.columns, row, strict=True)) for row in self._rows()]
        return unit_frame(self.columns, rows, self.units, units, self.space.currency)

    @property
    def metric_units(self) -> Mapping[str, str]:
        """The unit of each metric of a point, as `dse.analyse` has it; JSON and tables count in `counting_units`."""
        return {name: scaled_unit(unit)[1] for name, unit in self.counting_units.items()}

    @property
    def units(self) -> Mapping[str, str]:
        """The unit that the integers of each metric count, objectives included."""
        return {**self.counting_units, **{item.name: item.unit for item in self.objectives}}

    def __repr__(self) -> str:
        """One line: what was asked, and what was found."""
        return f"<Result of {self.problem.name!r}: {self.status}, {count_words(len(self.front), 'point')}>"

    def _repr_html_(self) -> str:
        """The front as a table for a notebook, in the units that engineers read."""
        frame = self.frame("readable")
        told = f"{self.problem.name}: {self.status}, {count_words(len(self.front), 'point')}"
        return f"<p>{escape(told)}</p>{frame.to_html(index=False, escape=True, max_rows=60)}"

    @property
    def columns(self) -> list[str]:
        """The columns of `frame` and of the CSV."""
        names = [item.name for item in self.objectives]
        more = [name for name in self.counting_units if name not in names]
        return ["id", "rank", *names, *more, *self.open_decisions]

    @property
    def open_decisions(self) -> list[str]:
        """The names of the decisions that the problem leaves open, in its order."""
        return [decision.name for decision in self.space.decisions if decision.is_open]

    def _rows(self) -> list[list[Any]]:
        rows = []
        for point in self.front:
            values: dict[str, Any] = {**point.counts, **point.objectives, **point.decisions}
            rows.append([point.id, point.rank, *(values.get(name) for name in self.columns[2:])])
        return rows

    def to_csv(self) -> str:
        """`frame` as CSV text, units in the header.

        A text that a spreadsheet would take for a formula gets an apostrophe.
        """
        units = self.units
        heading = [titled(name, units.get(name, "")) for name in self.columns]
        return csv_text([heading, *self._rows()])


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV; a text that a spreadsheet would take for a formula gets an apostrophe."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue()


def _cell(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value[:1] in FORMULA else in_table(value)


def decisions_of(space: Space, design: Design) -> dict[str, str]:
    """The active open decisions of a design, as texts."""
    return {
        decision.name: decision.options[option]
        for decision, option in zip(space.decisions, design, strict=True)
        if decision.is_open and option >= 0
    }


V = TypeVar("V", bound=tuple[int | Fraction, ...])


def ranked(rows: Sequence[tuple[V, Design]], senses: Sequence[str]) -> list[tuple[int, V, Design]]:
    """(rank, vector, design) in the order of rank, then of the objectives."""
    distances = ideal_distances([vector for vector, _ in rows], senses)
    found = zip(competition_ranks(distances), rows, strict=True)
    return sorted((rank, vector, design) for rank, (vector, design) in found)


# What a result is made of: points of the front, conflicts, further designs, and where it comes from.


@dataclass(frozen=True)
class ObjectiveInfo:
    """An objective: its name, sense, and the unit that its integers count."""

    name: str
    sense: str
    unit: str


class Figures:
    """The metrics of a design: as they are counted, and as they are.

    `counts` are integers in the `counting_units` of the result, as its JSON has them.
    """

    counts: Mapping[str, int]
    counting_units: Mapping[str, str]

    @property
    def metrics(self) -> Mapping[str, Fraction]:
        """Every metric in the unit that `metric_units` of the result states, as `dse.analyse` has it.

        Exact but for those that the result lists as `rounded`: these are rounded up.
        """
        return in_base_units(self.counts, self.counting_units)


@dataclass(frozen=True, repr=False)
class Point(Figures):
    """A non-dominated design.

    `objectives` count in the units of the result's objectives, `decisions` are the active open ones.
    `id` names the point in a result whatever it is ranked by; `score` says in words what the rank is founded on.
    `is_first`: of all designs with these objectives it is the first in the order of the file.
    """

    id: int
    rank: int
    objectives: Mapping[str, int]
    counts: Mapping[str, int]
    counting_units: Mapping[str, str]
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
class FurtherDesign(Figures):
    """Another design at or near a point of the front; `id` is ``POINT.NUMBER``.

    `dominated_by` are the ids of the points that dominate it; `different` counts the decisions that differ from the
    point's.
    """

    id: str
    objectives: Mapping[str, int]
    counts: Mapping[str, int]
    counting_units: Mapping[str, str]
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

    `identity` is the digest of what the problem means (`dse.spec.loading.document`); `texts` are its files by name, as
    found from the folder of the main one, so that a result can be worked with where they are not. `is_carried`: so it
    was here.
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


# What it costs to insist on an option: the front with it fixed, for each option of each open decision.


@dataclass(frozen=True)
class InsistedPoint(Figures):
    """A design that is on the front with some option fixed, but not on the whole front; ids go on after those there."""

    id: int
    objectives: Mapping[str, int]
    counts: Mapping[str, int]
    counting_units: Mapping[str, str]
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
