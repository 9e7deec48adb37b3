"""The outcome of a sweep: the front, or the break-points of a limit, for each value of what was varied."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import count
from math import sqrt
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from dse.answers.base import DataAnswer, to_file
from dse.answers.contention_verdicts import ContentionBasis
from dse.answers.question_data import WAITING, Objective, StudiedProblem, WaitingCounted
from dse.answers.ranking.ranking import competition_ranks, ideal_distances, range_of, score_texts
from dse.answers.studies.run_data import AnyRun, Change
from dse.answers.tables.display import figure, in_table, titled
from dse.answers.tables.frames import unit_frame
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_INVALID, EXIT_NO
from dse.support.json_fields import NULL, Data, Json, Of

if TYPE_CHECKING:
    import pandas

RANKING = "distance to the ideal point, objectives scaled to their range on all fronts of the sweep (equal weights)"


@dataclass(frozen=True)
class VariedAxis:
    """One thing that a sweep varies: an input of the file, or a limit.

    It has `values`, for each of which the front is solved, or the `interval` of a limit whose break-points are exact.
    """

    name: Annotated[str, "The path of an input, or the metric of a limit."]
    kind: Annotated[str, "`limit` or what kind of input it is."]
    values: Annotated[tuple[str, ...], "Values of the axis as texts.", Json(default=[])] = ()
    interval: Annotated[str, "The interval of a limit whose break-points are exact.", Json(default="")] = ""


@dataclass(frozen=True)
class SweepRun:
    """One run: the value of each axis that has values, and what was found there.

    `outcome` is plain data. Its ``kind`` is ``front`` (``front``: alternatives with ``rank``, ``score``,
    ``decisions``, ``metrics``), ``breaks`` (``stretches`` of limits with the front in each and its ``best``,
    ``alternatives`` by ``id``) or ``error``; figures are exact in the ``units`` beside them, fractions as text. None
    when the sweep was stopped before.
    """

    values: tuple[str, ...]
    outcome: Mapping[str, Any] | None

    @property
    def status(self) -> str:
        """``complete``, ``infeasible``, ``incomplete``, ``invalid``, or ``open`` when it was not solved.

        The status of a front or of the break-points of a limit; ``invalid`` where the values make no valid problem.
        """
        return "open" if self.outcome is None else str(self.outcome["status"])

    @property
    def front(self) -> Sequence[Mapping[str, Any]]:
        """The alternatives in the order of rank; of break-points, under the loosest limit.

        Mappings as in JSON, with decisions, metrics and rank; empty for runs that failed or were not solved.
        """
        if self.outcome is None or self.outcome["kind"] == "error":
            return ()
        if self.outcome["kind"] == "front":
            front: Sequence[Mapping[str, Any]] = self.outcome["front"]
            return front
        stretches = self.outcome["stretches"]
        return self._of_stretch(stretches[-1]) if stretches else ()

    def _of_stretch(self, stretch: Mapping[str, Any]) -> list[Mapping[str, Any]]:
        """The alternatives of one stretch of limits, each with its rank there."""
        assert self.outcome is not None
        known = {item["id"]: item for item in self.outcome["alternatives"]}
        return [{**known[entry["id"]], **entry} for entry in stretch["front"]]


@dataclass(frozen=True)
class ScaledObjective:
    """An objective with its ends on all fronts of the sweep.

    The ideal and the worst point of the ranking are common to all runs, so that scores can be compared across a sweep.
    """

    WRITTEN = (Objective, "best", "worst")

    name: str
    sense: str
    unit: str
    best: Annotated[Fraction, NULL, "Best value of the objective on all fronts, in `unit`; null where it is unbounded."]
    worst: Annotated[
        Fraction, NULL, "Worst value of the objective on all fronts, in `unit`; null where it is unbounded."
    ]


@dataclass(frozen=True)
class SweepRanking:
    """The ranking of designs, on one scale for the whole sweep."""

    words: Annotated[str, "The method in words."]
    scale: Annotated[tuple[ScaledObjective, ...], "The scale: each objective with its best and worst value."]


class Changes(Data):
    """The question of the caller beyond that of the file; fields that were not asked are left out."""

    limits: Annotated[
        list[tuple[str, str]], "Limits of `--max-METRIC`, each the metric and the text.", Json(default=[])
    ]
    require: Annotated[list[str], "Further requirements and rules.", Json(default=[])]
    objectives: Annotated[list[str], "The objectives that take the place of those of the file.", Json(default=[])]
    fix: Annotated[list[str], "Fixed decisions.", Json(default=[])]
    profile: Annotated[str, "The profile, where another was asked for.", Json(default=None)]
    worst_case: Annotated[str, "The worst-case setting, where another was asked for.", Json(default=None)]
    processing: Annotated[
        str, "What a flow counts for a thread, where another setting was asked for.", Json(default=None)
    ]
    deadlines: Annotated[str, "Which deadlines count, where another setting was asked for.", Json(default=None)]
    overload: Annotated[
        str, "Whether a load of more than 100 % is allowed, where another setting was asked for.", Json(default=None)
    ]


class SweptProblem(StudiedProblem):
    """The swept problem, and its question."""

    WRITTEN = (*StudiedProblem.WRITTEN, "changes")

    changes: Annotated[Changes, "Changes by the caller: limits, fixed decisions and settings beyond the file."]


@dataclass(frozen=True, repr=False)
class SweepResult(DataAnswer):
    """The outcome of `dse sweep`: the front for each value of what was varied.

    The same problem, changes and seed give the same text, however often the sweep was stopped and wherever its runs
    were solved; `solved` and `found` (in the store) tell what this sitting did and are no part of it. `scale` has for
    each objective its best and worst value on all fronts together: ranks and scores of every run rest on it.

    Examples
    --------
    >>> import dse
    >>> found = dse.sweep("pump.yaml", "price=60EUR..300EUR", store=None)
    >>> [str(stretch["from"]) for stretch in found.runs[0].outcome["stretches"]]
    ['6000', '7500', '24000', '25500']
    """

    FORMAT = "sweep"
    WRITTEN = (
        *("problem", "semantics", "seed", "status", "ranking", "remarks", "contention", "waiting"),
        *("axes", Of("run_data", key="runs"), "files"),
    )

    problem: Annotated[Mapping[str, Any], "Which problem was swept.", Json(kind=SweptProblem)]
    semantics: Annotated[str, "The version of what the figures mean, with a digest of the code that found them."]
    axes: Annotated[tuple[VariedAxis, ...], "Axes of the sweep.", Json("vary")]
    runs: tuple[SweepRun, ...]
    seed: Annotated[int, "The seed."] = 0
    ranking: Annotated[SweepRanking, "Ranking of the designs."] = SweepRanking(RANKING, ())
    remarks: Annotated[tuple[str, ...], "Remarks on effects that varying an input does not show."] = ()
    contention: Annotated[
        Mapping[str, Any] | None,
        "Contention that all fronts leave out; null where they count it.",
        Json(kind=ContentionBasis | None),
    ] = None
    waiting: Annotated[Mapping[str, list[str]], WAITING, Json(kind=WaitingCounted)] = field(default_factory=dict)
    files: Annotated[
        Mapping[str, str], "The text of the problem file, of what it includes and of its samples, by name."
    ] = field(default_factory=dict)
    solved: int = field(default=0, compare=False)
    found: int = field(default=0, compare=False)

    @property
    def status(self) -> Literal["complete", "infeasible", "incomplete", "invalid"]:
        """The status of all runs together.

        It is ``invalid`` when some value makes no valid problem, ``incomplete`` when the sweep was stopped, and
        ``infeasible`` when all runs are.
        """
        statuses = {run.status for run in self.runs}
        for worst in ("invalid", "open", "incomplete"):
            if worst in statuses:
                return "invalid" if worst == "invalid" else "incomplete"
        return "infeasible" if statuses == {"infeasible"} else "complete"

    @property
    def exit_code(self) -> int:
        """The exit code of the command line.

        0, or the code for *incomplete*, *infeasible* or *invalid* as the worst status of its runs.
        """
        codes = {"incomplete": EXIT_INCOMPLETE, "infeasible": EXIT_NO, "invalid": EXIT_INVALID}
        return codes.get(self.status, EXIT_COMPLETE)

    @property
    def _grid_axes(self) -> tuple[VariedAxis, ...]:
        """The axes that have values."""
        return tuple(axis for axis in self.axes if axis.values)

    @cached_property
    def changes(self) -> tuple[Change | None, ...]:
        """For each run what it wins and loses against its neighbour: the value before on the last axis.

        None for the first.
        """
        last = len(self._grid_axes[-1].values) if self._grid_axes else 1
        changes: list[Change | None] = []
        for number, run in enumerate(self.runs):
            before = self.runs[number - 1] if number % last else None
            usable = before is not None and all(item.status in ("complete", "infeasible") for item in (before, run))
            changes.append(_change(before, run) if before is not None and usable else None)
        return tuple(changes)

    @property
    def run_data(self) -> Annotated[list[Mapping[str, Any]], Json(kind=list[AnyRun])]:
        """The outcome of each run; values of the last axis change fastest.

        One mapping for each run, in the form of JSON: the values on the axes, the outcome, and what changed against the
        run before.
        """
        from dse.answers.forms.codec import written

        return [
            {
                "values": dict(zip((axis.name for axis in self._grid_axes), run.values, strict=True)),
                **(run.outcome or {"kind": "open", "status": "open"}),
                "change": written(Change, change) if change is not None else None,
            }
            for run, change in zip(self.runs, self.changes, strict=True)
        ]

    @classmethod
    def _read(cls, data: Mapping[str, Any]) -> Mapping[str, Any]:
        runs = []
        for run in data["runs"]:
            outcome = {name: value for name, value in run.items() if name not in ("values", "change")}
            runs.append(SweepRun(tuple(run["values"].values()), outcome if run["kind"] != "open" else None))
        return {"runs": tuple(runs)}

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """A row for each alternative of each run (and stretch of limits), units in the header.

        Exact figures, fractions as text. Column ``contention`` says whether the design keeps every requirement when
        response times count, where the fronts leave them out.
        """
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        columns = self.columns
        units = self._units()
        writer.writerow([titled(name, units.get(name, "")) for name in columns])
        for row in self._rows():
            writer.writerow([in_table(row.get(name)) for name in columns])
        return to_file(out.getvalue(), path)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The rows of `to_csv` as a frame.

        Columns: each axis with values (text); ``from`` and ``to`` where a limit has break-points (exact, in the
        limit's unit); ``status``, ``rank``; ``contention`` (``kept`` or ``broken``) where fronts leave that out; each
        metric as ``NAME [UNIT]`` (integer, or a fraction as text); each decision (text, missing where inactive).
        `units` as for `Result.frame`.
        """
        return unit_frame(self.columns, list(self._rows()), self._units(), units, str(self.problem["currency"]))

    @property
    def columns(self) -> list[str]:
        """The columns of `frame` and of the CSV.

        Axes first, then status and rank, metrics, and a column for each decision that some design has.
        """
        names = [axis.name for axis in self._grid_axes]
        if any(axis.interval for axis in self.axes):
            names += ["from", "to"]
        judged = ["contention"] if self.contention is not None else []
        rows = list(self._rows())
        metrics = list(self._units())
        decisions = dict.fromkeys(name for row in rows for name in row)
        known = {*names, "status", "rank", *judged, *metrics}
        return [*names, "status", "rank", *judged, *metrics, *(name for name in decisions if name not in known)]

    def _units(self) -> dict[str, str]:
        units: dict[str, str] = {}
        for run in self.runs:
            units |= run.outcome.get("units", {}) if run.outcome is not None else {}
        return units

    def _rows(self) -> Iterator[dict[str, Any]]:
        for run in self.runs:
            head = dict(zip((axis.name for axis in self._grid_axes), run.values, strict=True))
            head["status"] = run.status
            if run.outcome is not None and run.outcome["kind"] == "breaks":
                for stretch in run.outcome["stretches"]:
                    for item in run._of_stretch(stretch):
                        limits = {"from": stretch["from"], "to": stretch["to"]}
                        yield {**head, **limits, **_row(item)}
                continue
            if not run.front:
                yield head
            for item in run.front:
                yield {**head, **_row(item)}


def _change(before: SweepRun, after: SweepRun) -> Change:
    old = [item["decisions"] for item in before.front]
    new = [item["decisions"] for item in after.front]
    objectives = (after.outcome or {}).get("objectives", [])
    names = [info["name"] for info in objectives]
    moved = [
        item["decisions"]
        for item in after.front
        for other in before.front
        if item["decisions"] == other["decisions"]
        and any(item["metrics"][name] != other["metrics"][name] for name in names)
    ]
    return Change(
        entered=tuple(item for item in new if item not in old),
        left=tuple(item for item in old if item not in new),
        moved=tuple(moved),
        best={info["name"]: (_best(before, info), _best(after, info)) for info in objectives},
    )


def _best(run: SweepRun, info: Mapping[str, str]) -> Fraction | None:
    values = [figure(item["metrics"][info["name"]]) for item in run.front]
    if not values:
        return None
    return min(values) if info["sense"] == "minimise" else max(values)


def _row(item: Mapping[str, Any]) -> dict[str, Any]:
    """A design in its row."""
    judged = {"contention": item["contention"]["status"]} if "contention" in item else {}
    return {"rank": item["rank"], **judged, **_figures(item), **item["decisions"]}


def _figures(item: Mapping[str, Any]) -> dict[str, Any]:
    """The metrics of a design as a table has them: those that JSON has as null are unbounded."""
    return {name: figure(None) if value is None else value for name, value in item["metrics"].items()}


# One ranking for all fronts of a sweep: the same scale everywhere, so that scores of different runs compare.
#
# The score of a design is its distance to the ideal point of all fronts together, objectives scaled to their range on
# these. It does not depend on the limit that varies: relaxing one only admits more designs, so the best choice changes
# only to a design that was not admitted before, and only to a better score. (A design that dominates another has the
# better score: where the two differ the range is not 0.) Of equal scores the design that needs the tighter limit goes
# first, which what is newly admitted never does.


Outcome: TypeAlias = Mapping[str, Any]
Vector: TypeAlias = tuple[Fraction, ...]


def rank_together(
    outcomes: Sequence[Outcome | None], limits: Sequence[tuple[str, str]] = ()
) -> tuple[list[Outcome | None], tuple[ScaledObjective, ...]]:
    """The outcomes of a sweep with ranks and scores on one scale, each front best first; and that scale.

    Parameters
    ----------
    outcomes
        by run, as `dse.questions` finds them (see `SweepRun`); None where a run was not solved.
    limits
        (metric, operator) of each limit that varies: what needs less of it goes first among equal scores.
    """
    solved = [item for item in outcomes if item is not None and item["kind"] != "error"]
    infos: Sequence[Outcome] = solved[0]["objectives"] if solved else []
    senses = [info["sense"] for info in infos]
    known = {number: _alternatives(item) for number, item in enumerate(outcomes) if item is not None}
    vectors = {number: [_vector(item, infos) for item in items] for number, items in known.items()}
    scale = range_of([vector for items in vectors.values() for vector in items], senses)
    distances = {number: ideal_distances(items, senses, scale=scale) for number, items in vectors.items()}
    texts = iter(score_texts([sqrt(value) for items in distances.values() for value in items]))
    signs = {name: 1 if operator == "<=" else -1 for name, operator in limits}
    result: list[Outcome | None] = []
    for number, outcome in enumerate(outcomes):
        if outcome is None or outcome["kind"] == "error":
            result.append(outcome)
            continue
        rows = [
            (distance, _needs(outcome, item, signs), vector, place, text)
            for place, item, vector, distance, text in zip(
                count(), known[number], vectors[number], distances[number], texts, strict=False
            )
        ]
        result.append(_ranked_breaks(outcome, rows) if outcome["kind"] == "breaks" else _ranked_front(outcome, rows))
    scaled = (
        ScaledObjective(info["name"], info["sense"], info["unit"], ZERO + best, ZERO + worst)
        for info, (best, worst) in zip(infos, scale, strict=bool(scale))
    )
    return result, tuple(scaled)


ZERO = Fraction(0)
Row: TypeAlias = tuple[Fraction, tuple[Fraction, ...], Vector, int, str]
"""Squared distance, what is needed of each limit, objectives, place among the alternatives, score."""


def _alternatives(outcome: Outcome) -> Sequence[Outcome]:
    alternatives: Sequence[Outcome] = outcome.get("front") or outcome.get("alternatives") or ()
    return alternatives


def _vector(item: Outcome, infos: Sequence[Outcome]) -> Vector:
    return tuple(figure(item["metrics"][info["name"]]) for info in infos)


def _needs(outcome: Outcome, item: Outcome, signs: Mapping[str, int]) -> tuple[Fraction, ...]:
    """How much of each varied limit a design needs, more where the limit has to be looser."""
    if "limited" in item:  # exact, also where the limit is a share
        return (Fraction(item["limited"]) * (1 if outcome["operator"] == "<=" else -1),)
    figures = item["metrics"]
    return tuple(sign * figure(figures[name]) for name, sign in signs.items() if name in figures)


def _ranked_front(outcome: Outcome, rows: Sequence[Row]) -> Outcome:
    ranks = competition_ranks([row[0] for row in rows])
    entries = sorted(zip(rows, ranks, strict=True), key=lambda pair: pair[0][:4])
    front = [{"rank": rank, "score": row[4], **outcome["front"][row[3]]} for row, rank in entries]
    return {**outcome, "front": front}


def _ranked_breaks(outcome: Outcome, rows: Sequence[Row]) -> Outcome:
    by_id = {item["id"]: row for item, row in zip(outcome["alternatives"], rows, strict=True)}
    stretches = []
    for stretch in outcome["stretches"]:
        order = sorted((by_id[entry["id"]][:4], entry["id"]) for entry in stretch["front"])
        ranks = competition_ranks([key[0] for key, _ in order])
        front = [
            {"rank": rank, "score": by_id[number][4], "id": number}
            for rank, (_, number) in zip(ranks, order, strict=True)
        ]
        stretches.append({**stretch, "best": front[0]["id"], "front": front})
    return {**outcome, "stretches": stretches}
