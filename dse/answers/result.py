"""The result of a solve: the front with everything that a reader or a program needs to judge and reuse it."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, SupportsIndex, TypeVar, overload

from dse.analysis.diagnosis.front_verdicts import with_contention
from dse.answers.base import Answer, to_file
from dse.answers.contention_verdicts import NOT_JUDGED, Contended
from dse.answers.designs import (
    FurtherAsked,
    FurtherDesign,
    FurtherDesigns,
    Insisting,
    KeptBy,
    ListedDesign,
    ListedDesigns,
    ListedPoint,
    Point,
    Status,
    with_numbers,
)
from dse.answers.question_data import BY_WAITING, Objective, Origin, SolvedProblem
from dse.answers.ranking.ranking import METHOD, competition_ranks, ideal_distances
from dse.answers.ranking.variants import find_variants
from dse.answers.tables.display import in_table, scaled_unit, titled
from dse.answers.tables.frames import unit_frame
from dse.space.model.space import Design, Space
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO, UsageError
from dse.support.json_fields import NULL, Counts, Data, Json, Of, Unit
from dse.support.units.text import count_words, writable
from dse.support.version import SEMANTICS

if TYPE_CHECKING:
    import pandas

FORMULA = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True, repr=False)
class Result(Answer):
    """The outcome of `dse solve`: the front, its proof, and the question that was asked.

    Where `status` is ``incomplete`` every point is non-dominated among all designs; where none was proved in time, the
    one design shown is feasible and no more, and lies in an unexplored region. `baseline` is today's design where the
    problem states all of it; `ranking` is the method as asked for, `ranking_words` the method with its parameters.
    `interrupted` says that Ctrl-C ended the search: nothing is added then. `contended` says by id what each design
    keeps when response times count, where the question leaves them out (`dse.analysis.diagnosis.front_verdicts`);
    designs that are missing there were not checked.

    Examples
    --------
    >>> import dse
    >>> result = dse.solve("pump.yaml")
    >>> len(result), result[0], [point.id for point in result]
    (4, <Point 1, rank 1: jitter of sensor_to_valve 7.078 ms, price 240>, [1, 2, 3, 4])
    >>> result.frame().columns[2]
    'jitter of sensor_to_valve [ms]'
    """

    FORMAT = "result"
    WRITTEN = (
        Of("semantics", "The version of what the figures mean; a result of another one is refused.", kind=int),
        *("problem", "status", "under_way", Of("ranked_by", key="ranking"), "objectives", "counting_units", "rounded"),
        *(Of("listed_front", key="front"), "unused", "unexplored", "refuted", "potential", "conflicts", "give_up"),
        *(Of("listed_others", key="others"), "others_asked", "insisting", "search"),
        Of(
            "problem.texts",
            "The text of the problem file and of what it includes, by name, so that the result can be worked with "
            "where they are not.",
            key="files",
        ),
    )

    problem: Annotated[Origin, "Which problem was solved.", Json(kind=SolvedProblem)]
    space: Space
    status: Annotated[
        Status,
        "`complete`: the front is proved; `incomplete`: the search was stopped, points may be missing in `unexplored`; "
        "`infeasible`: proved that there is no design.",
    ]
    objectives: Annotated[
        tuple[ObjectiveInfo, ...], "The objectives, in the order of the question.", Json(kind=list[Objective])
    ]
    counting_units: Annotated[Mapping[str, Unit], "Unit of each metric.", Json("metric_units")]
    front: tuple[Point, ...]
    unexplored: Annotated[
        tuple[Counts, ...],
        "Regions that may still hold better designs: everything better than these exclusive bounds in every objective.",
    ]
    refuted: Annotated[
        tuple[Counts, ...], "Regions, bounded like the unexplored ones, that are proved to hold no design."
    ]
    potential: Annotated[Counts, "The best value of each objective that may still be unexplored."]
    conflicts: Annotated[tuple[Conflict, ...], "Conflicts of an infeasible problem."]
    search: Annotated[Search, "Effort and settings of the search."]
    baseline: Design | None = None
    ranking: str = "ideal"
    ranking_words: str = METHOD
    others: tuple[FurtherDesigns, ...] = ()
    others_asked: Annotated[
        FurtherAsked | None, "Which further designs were asked for.", Json(default=None, kind=FurtherAsked)
    ] = None
    give_up: Annotated[
        tuple[Clash, ...],
        "Where relaxing one member is not enough: the fewest to relax together, each with its closest limit. A limit "
        "that is stated once for several flows, processors, cores or buses is one, in the words in which it is stated.",
        Json(default=[]),
    ] = ()
    rounded: Annotated[
        tuple[str, ...], "The metrics whose figures are rounded up to their unit.", Json(default=[])
    ] = ()
    interrupted: bool = False
    contended: Mapping[str, Contended] = field(default_factory=dict)
    insisting: Annotated[
        Insisting | None,
        "Price of insisting on each option, where it was asked for.",
        Json(default=None, kind=Insisting),
    ] = None
    under_way: Annotated[
        bool,
        "True where the search went on when this was written, in case the run is lost: points are as the solver "
        "claims them, with objectives and decisions and no other figure; `--resume` looks at them first.",
        Json(default=False),
    ] = False
    semantics: ClassVar[int] = SEMANTICS

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """The result as JSON text, also written to `path` where one is given: whole or not at all.

        Indented; on one line while the search goes on, because that is the fastest.
        """
        if not self.under_way:
            return super().to_json(path)
        return to_file(f"{json.dumps(self.to_dict(), ensure_ascii=False)}\n", path)

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this result.

        0: complete; 4: infeasible, proved; 5: stopped early.
        """
        return {"complete": EXIT_COMPLETE, "incomplete": EXIT_INCOMPLETE, "infeasible": EXIT_NO}[self.status]

    @property
    def leaves_out_contention(self) -> bool:
        """Whether what designs keep with contention is something else than what they were searched for.

        True where threads share processors and latencies count execution times; `contended` then has a verdict for each
        design.
        """
        return with_contention(self.space) is not None

    @cached_property
    def variants(self) -> Mapping[int, int]:
        """Near-identical points by id: the better-ranked point that each is a variant of (`dse.answers.ranking`).

        Ids to ids. A variant differs by one decision and by little in every objective; empty while the search goes on.
        """
        if self.under_way:
            return {}
        vectors = [tuple(point.objectives[item.name] for item in self.objectives) for point in self.front]
        leaders = find_variants(vectors, [point.decisions for point in self.front])
        pairs = zip(self.front, leaders, strict=True)
        return {point.id: self.front[leader].id for point, leader in pairs if leader is not None}

    @property
    def leaders(self) -> tuple[Point, ...]:
        """The points that are no variants of better-ranked ones, in the order of rank.

        `Point` objects; reports list them before their variants.
        """
        return tuple(point for point in self.front if point.id not in self.variants)

    @property
    def unused(self) -> Annotated[list[dict[str, Any]], Json(default=[], kind=list[UnusedChoice])]:
        """Decisions that were fixed, though some points have no use for them."""
        return unused_choices(self.space, ((point.id, point.decisions) for point in self.front))

    @property
    def ranked_by(self) -> Annotated[Mapping[str, str], Json(kind=Ranking)]:
        """The ranking of the points, in words.

        A mapping with ``method``, such as ``ideal``, and ``words``, which has every parameter.
        """
        return {"method": self.ranking, "words": self.ranking_words}

    @property
    def listed_front(self) -> list[ListedPoint]:
        """The non-dominated designs, in the order of rank.

        Each `Point` with its cores, its verdict with contention and the point that it is a variant of, in the form of
        JSON.
        """
        return [ListedPoint(point, self._kept_by(point), self.variants.get(point.id)) for point in self.front]

    @property
    def listed_others(self) -> list[ListedDesigns]:
        """Further designs at or near points, where they were asked for."""
        return [
            ListedDesigns(item, tuple(ListedDesign(design, self._kept_by(design)) for design in item.designs))
            for item in self.others
        ]

    def _kept_by(self, item: Point | FurtherDesign) -> KeptBy:
        """The cores and identifiers of a design, and what it keeps with contention."""
        contention = self.contended.get(str(item.id), NOT_JUDGED) if self.leaves_out_contention else None
        if self.under_way:
            return KeptBy({}, {}, {}, contention)
        return KeptBy.in_design(self.space, item.design, contention)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The front as a frame, in the order of rank.

        Columns: ``id``, ``rank``; each objective and each further metric as ``NAME [UNIT]`` (floating-point, infinite
        where it is unbounded); each open decision by name (text, None where inactive, the number of `identifier: any`).

        Parameters
        ----------
        units
            units such as ``"us"`` or ``("us", "%")`` for the columns of their kind; the others are in those that
            engineers read (ms, %, KB/s, W, the currency). With ``"exact"`` they are integers in the units of
            `objectives` and `counting_units`.

        Raises
        ------
        UsageError
            when there is no such unit.
        """
        rows = [dict(zip(self.columns, row, strict=True)) for row in self._rows()]
        return unit_frame(self.columns, rows, self.units, units, self.space.currency)

    @property
    def metric_units(self) -> Mapping[str, str]:
        """The unit of each metric of a point, as `dse.analyse` has it; JSON and tables count in `counting_units`.

        Names of metrics to units such as ``ns`` or ``ppm``, without fractions of a unit.
        """
        return {name: scaled_unit(unit)[1] for name, unit in self.counting_units.items()}

    @property
    def units(self) -> Mapping[str, str]:
        """The unit that the integers of each metric count, objectives included.

        Names to units such as ``ns`` or ``1/3 ppm``, for `Point.counts` and `Point.objectives`.
        """
        return {**self.counting_units, **{item.name: item.unit for item in self.objectives}}

    def __len__(self) -> int:
        """The number of designs of the front."""
        return len(self.front)

    def __iter__(self) -> Iterator[Point]:
        """The designs of the front, in the order of rank."""
        return iter(self.front)

    @overload
    def __getitem__(self, at: SupportsIndex) -> Point: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Point, ...]: ...

    def __getitem__(self, at: SupportsIndex | slice) -> Point | tuple[Point, ...]:
        """The design at a place in the order of rank, the first at 0; several for a slice."""
        return self.front[at]

    def __bool__(self) -> bool:
        """Whether there is a design."""
        return bool(self.front)

    def plot(self, kind: str = "scatter", alternative: int | None = None) -> Any:
        """A plot of the front, as `dse.plot` draws it: a notebook shows it, its ``save`` writes it as SVG or PNG.

        `kind` is ``scatter``, ``parallel``, ``latency`` and so on (`dse.plot`); `alternative` is the id of a design.
        Raises `UsageError` for an unknown kind.
        """
        return import_module("dse.report.picture").plot(self, kind, alternative)  # plots stand above answers

    def point(self, number: int) -> Point:
        """The design with an id, as commands call it (``result.json#4``).

        Raises
        ------
        UsageError
            when there is none.
        """
        for point in self.front:
            if point.id == number:
                return point
        raise UsageError(f"there is no design {number}: ids run from 1 to {len(self.front)}")

    def __repr__(self) -> str:
        """One line: what was asked, and what was found."""
        return f"<Result of {self.problem.name!r}: {self.status}, {count_words(len(self.front), 'point')}>"

    def _repr_html_(self) -> str:
        """The front as a table for a notebook, in the units that engineers read."""
        frame = self.frame()
        heading = f"{self.problem.name}: {self.status}, {count_words(len(self.front), 'point')}"
        return f"<p>{escape(heading)}</p>{frame.to_html(index=False, escape=True, max_rows=60)}"

    @property
    def columns(self) -> list[str]:
        """The columns of `frame` and of the CSV.

        Id and rank first, then objectives, other metrics, and the open decisions.
        """
        names = [item.name for item in self.objectives]
        more = [name for name in self.counting_units if name not in names]
        return ["id", "rank", *names, *more, *self.open_decisions]

    @property
    def open_decisions(self) -> list[str]:
        """The names of the decisions that the problem leaves open, in its order.

        Decisions with more than one option, those that were fixed by the caller included.
        """
        return [decision.name for decision in self.space.decisions if decision.is_open]

    def _rows(self) -> list[list[Any]]:
        rows = []
        for point in self.front:
            chosen = point.decisions if self.under_way else with_numbers(self.space, point.decisions, point.design)
            values: dict[str, Any] = {**point.counts, **point.objectives, **chosen}
            rows.append([point.id, point.rank, *(values.get(name) for name in self.columns[2:])])
        return rows

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """`frame("exact")` as CSV text, units in the header; also written to `path`, where one is given.

        A text that a spreadsheet would take for a formula gets an apostrophe.
        """
        units = self.units
        heading = [titled(name, units.get(name, "")) for name in self.columns]
        return to_file(csv_text([heading, *self._rows()]), path)


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV; a text that a spreadsheet would take for a formula gets an apostrophe.

    Lines end with a newline; cells are quoted where needed. An unbounded figure is the word that reports use.
    """
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue()


def _cell(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value[:1] in FORMULA else in_table(value)


def decisions_of(space: Space, design: Design) -> dict[str, str]:
    """The active open decisions of a design, as texts.

    Names of decisions to names of options, in the order of the space; decisions with one option and inactive ones are
    left out.
    """
    return {
        decision.name: decision.options[option]
        for decision, option in zip(space.decisions, design, strict=True)
        if decision.is_open and option >= 0
    }


V = TypeVar("V", bound=tuple[int | Fraction, ...])


def ranked(rows: Sequence[tuple[V, Design]], senses: Sequence[str]) -> list[tuple[int, V, Design]]:
    """(rank, vector, design) in the order of rank, then of the objectives.

    Ranks are 1 and up, ties share one; by the distance to the ideal point. `senses` has the sense of each objective.
    """
    distances = ideal_distances([vector for vector, _ in rows], senses)
    by_rank = zip(competition_ranks(distances), rows, strict=True)
    return sorted((rank, vector, design) for rank, (vector, design) in by_rank)


# What a result is made of: points of the front, conflicts, further designs, and where it comes from.


@dataclass(frozen=True)
class ObjectiveInfo:
    """An objective of a result.

    `sense` is ``minimise`` or ``maximise``. `unit` is what the integers of its values count, such as ``ns``, ``ct``,
    ``ppm``, or a fraction of one such as ``1/3 ppm``, in which all values are integers.
    """

    name: str
    sense: str
    unit: str


@dataclass(frozen=True)
class Clash:
    """A requirement or rule of a conflict, or one that must be relaxed.

    `closest` is the nearest limit with which a design exists while everything else holds, in `unit` as `limit` is; None
    where there is none, or where it was not searched.
    """

    JSON_NAME = "Member"
    WRITTEN = ("text", "origin", "limit", "closest", "miss", "unit", "thread", "unbounded", "is_sought", "overload")

    text: Annotated[str, "In the words of the problem."]
    origin: Annotated[str, "Where it stands: `FILE:LINE`, or `command line`."]
    unit: Annotated[Unit, "Unit of the figures; empty where there are none."] = ""
    limit: Annotated[Fraction | None, "Limit of the requirement, in `unit`; null for a rule."] = None
    closest: Annotated[
        Fraction | None, "The closest limit with which there is a design while all else holds, if any."
    ] = None
    thread: Annotated[str, NULL, "The thread that alone needs so much of one core, where that is what counts."] = ""
    unbounded: Annotated[
        tuple[str, ...],
        "The threads whose response time has no bound even in the best design, so that no limit helps.",
        Json(default=[]),
    ] = ()
    is_sought: Annotated[
        bool,
        "False where the time was too short to look for `closest`.",
        Json("looked_for", default=True),
    ] = True
    overload: Annotated[
        str, "The processor or bus whose `overload: allowed` the closest limit takes.", Json(default="")
    ] = ""

    @property
    def miss(self) -> Fraction | None:
        """The distance of `closest` beyond `limit`.

        In `unit`, at least 0; None for rules and where no closest limit is known.
        """
        return (
            None if self.closest is None or self.limit is None else abs(Fraction(writable(self.closest)) - self.limit)
        )


@dataclass(frozen=True)
class Conflict:
    """Requirements and rules that cannot hold together, although without any one of them the others can.

    A minimal conflict: each member has the closest limit with which it would hold beside the others.
    """

    members: Annotated[tuple[Clash, ...], "The demands of the conflict, in the order of the problem."]
    by_waiting: Annotated[bool, BY_WAITING] = True


@dataclass(frozen=True)
class Search:
    """The effort of the search: solver calls, seconds, workers and seed.

    It is the only part of a result that differs between two runs of one question with the same seed.
    """

    solver_calls: Annotated[int, "Number of solver calls."]
    wall_s: Annotated[float, "Seconds that passed."]
    space_size: Annotated[int, "The number of designs that the decisions make at most."]
    solver: Annotated[str, "The solver and its version."]
    workers: Annotated[int, "Number of solvers that worked in parallel."]
    seed: Annotated[int, "The seed."]


class Ranking(Data):
    """A way of ranking."""

    method: Annotated[str, "The method, as `--rank-by` names it."]
    words: Annotated[str, "The method with its parameters, in words."]


class UnusedChoice(Data):
    """A fixed decision that changes nothing in some points."""

    decision: Annotated[str, "The decision."]
    option: Annotated[str, "The option at which it was fixed."]
    points: Annotated[list[int], "The ids of the points that have no use for it."]


def unused_choices(space: Space, listed: Iterable[tuple[int, Mapping[str, str]]]) -> list[dict[str, Any]]:
    """The decisions that were fixed and that some points have no use for, so that fixing them changes nothing there.

    `listed` has id and active decisions of each point; as the JSON of a result has it.
    """
    points, choices = list(listed), []
    for index, option in space.fixed.items():
        decision = space.decisions[index]
        idle = [number for number, decisions in points if decision.is_open and decision.name not in decisions]
        if idle:
            choices.append({"decision": decision.name, "option": decision.options[option], "points": idle})
    return choices
