"""The result of a solve: the front with everything that a reader or a program needs to judge and reuse it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from dse.analysis.contention import cores_of, with_contention
from dse.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.records import dataclass
from dse.results.answer import Answer, With
from dse.results.contention import NOT_JUDGED, Contended, core_use
from dse.results.display import in_table, titled
from dse.results.frames import unit_frame
from dse.results.insisting import Insisting
from dse.results.points import (
    Clash,
    Conflict,
    FurtherAsked,
    FurtherDesign,
    FurtherDesigns,
    ObjectiveInfo,
    Origin,
    Point,
    Search,
    unused_choices,
)
from dse.results.ranking import METHOD, competition_ranks, ideal_distances
from dse.results.variants import find_variants
from dse.space.types import Design, Space
from dse.units.text import count_words
from dse.version import SEMANTICS

if TYPE_CHECKING:
    import pandas

FORMULA = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True, repr=False)
class Result(Answer):
    """The outcome of `dse.solve`.

    `status` is ``complete`` (the front is proved), ``incomplete`` (stopped early: every point is non-dominated among
    all designs, but others may be missing in the `unexplored` regions; where none was proved in time, the one design
    shown is feasible and no more, and lies in such a region) or ``infeasible`` (proved). The front is in the
    order of rank. `baseline` is today's design where the problem states all of it; `ranking` is the method as asked
    for, `ranking_words` the method with its parameters; `others` are further designs at or near points of the front,
    where they were asked for; `give_up`, where no single member of the conflicts mends the problem, are the fewest that
    do together, each with its closest limit when the others are given up; `rounded` names the figures that are rounded
    up, to the unit in which they count. Regions are exclusive bounds by objective; `potential` is the best value of
    each objective that may still be unexplored. `interrupted` says that Ctrl-C ended the search: nothing is added then.
    `contended` says by id what each design keeps when response times count, where the question leaves them out
    (`dse.analysis.contention`); designs that are missing there were not checked. `insisting` has the front with each
    option fixed, where that was asked for. `under_way`: the search goes on, and this is kept in case the run is lost:
    points are as the solver claims them, with their objectives and decisions and nothing else.

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
    metric_units: Mapping[str, str]
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
        """Near-identical points by id: the better-ranked point that each is a variant of (`dse.results.variants`)."""
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
        """The fixed decisions that some points have no use for: see `dse.results.points.unused_choices`."""
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
        `objectives` and `metric_units`; infinite where they are unbounded); each open decision by name (text, None
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
    def units(self) -> Mapping[str, str]:
        """The unit that the integers of each metric count, objectives included."""
        return {**self.metric_units, **{item.name: item.unit for item in self.objectives}}

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
        more = [name for name in self.metric_units if name not in names]
        return ["id", "rank", *names, *more, *self.open_decisions]

    @property
    def open_decisions(self) -> list[str]:
        """The names of the decisions that the problem leaves open, in its order."""
        return [decision.name for decision in self.space.decisions if decision.is_open]

    def _rows(self) -> list[list[Any]]:
        rows = []
        for point in self.front:
            values: dict[str, Any] = {**point.metrics, **point.objectives, **point.decisions}
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
