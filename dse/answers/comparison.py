"""Two designs, or two results, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from dse.analysis.measures import all_metrics
from dse.answers.analysis import Analysis
from dse.answers.base import Answer
from dse.answers.designs import Point, numbered_texts
from dse.answers.ranking.core_numbering import numbered_like
from dse.answers.result import ObjectiveInfo, Result, decisions_of
from dse.answers.tables.display import scaled_unit
from dse.answers.tables.frames import mixed_frame
from dse.space.model.criteria import Metric
from dse.space.model.metric_kinds import parts_of
from dse.space.model.space import Space
from dse.space.question.settings import SETTINGS, settings_of
from dse.support.json_fields import Data, Json, Of, Unit, Values
from dse.support.units.text import count_words

if TYPE_CHECKING:
    import pandas

LATENCIES = ("latency", "min latency", "jitter")
COUNTING = {"profile": (*LATENCIES, "busy"), "worst_case": LATENCIES, "processing": LATENCIES}
"""The kinds of metric that each setting counts otherwise; which deadlines are required changes no figure."""


@dataclass(frozen=True)
class ComparedLine:
    """One thing in two designs: texts or exact numbers in `unit`; None where a design does not have it.

    `is_alike` is false for what has no difference: sums of money in two currencies, figures of different rules.
    `renumbered` is `other` for a core that goes by another number where the cores of both are numbered alike.
    """

    name: str
    one: Any
    other: Any
    unit: str = ""
    is_alike: bool = True
    renumbered: str | None = None

    @property
    def differs(self) -> bool:
        """Whether the two are not the same.

        A value that has another meaning in the two problems (`is_alike` is false) differs even when the numbers are
        equal; cores that are only numbered differently do not.
        """
        return bool(self.one != (self.renumbered or self.other)) or not self.is_alike

    @property
    def difference(self) -> Fraction | None:
        """Other minus one, for numbers that both have.

        Exact, in the unit of the line; None for texts, and for numbers that do not mean one thing in both problems.
        """
        if self.is_alike and isinstance(self.one, Fraction) and isinstance(self.other, Fraction):
            return self.other - self.one
        return None


Holds: TypeAlias = Literal["holds", "broken"] | None


class TwoValues(Data):
    """A metric in two designs."""

    values: Annotated[
        tuple[Fraction | None, Fraction | None],
        "Value of the metric in each design; null where a design does not have the metric, or it is unbounded.",
    ]
    unit: Annotated[Unit, "Unit of the values."]


def _pairs(lines: Iterable[ComparedLine]) -> dict[str, tuple[Any, Any]]:
    return {line.name: (line.one, line.other) for line in lines}


@dataclass(frozen=True, repr=False)
class DesignComparison(Answer):
    """Two designs side by side.

    `carried` names the problem files that were not there, so that the problems that results carry were compared.
    """

    FORMAT = "comparison"
    JSON_NAME = "Designs"
    WRITTEN = (
        *("of", "names", "currencies", Of("options", key="decisions"), Of("figures", key="metrics")),
        *("requirements", "unlike"),
    )

    names: Annotated[tuple[str, str], "Names of both."]
    decisions: tuple[ComparedLine, ...]
    metrics: tuple[ComparedLine, ...]
    verdicts: tuple[ComparedLine, ...]
    currencies: Annotated[tuple[str, str], "The currency of each."]
    unlike: Annotated[
        tuple[str, ...], "The settings by which figures of both are counted otherwise.", Json("not_comparable")
    ] = ()
    carried: tuple[str, ...] = ()
    senses: Mapping[str, int] = field(default_factory=dict)
    """The objectives of both problems by name: 1 for one that is minimised, -1 for one that is maximised."""

    @property
    def of(self) -> Literal["designs"]:
        """The kind of things compared."""
        return "designs"

    @property
    def options(self) -> Mapping[str, tuple[str | None, str | None]]:
        """The option of each decision in both; null where a design has no use for it.

        Names of decisions to pairs of options, in the order of the first design's problem.
        """
        return _pairs(self.decisions)

    @property
    def figures(self) -> Annotated[Mapping[str, Any], Json(kind=Mapping[str, TwoValues])]:
        """Each metric in both.

        Names of metrics to mappings with ``values`` (a pair, None where a design has none) and ``unit``.
        """
        return {line.name: {"values": (line.one, line.other), "unit": line.unit} for line in self.metrics}

    @property
    def requirements(self) -> Mapping[str, tuple[Holds, Holds]]:
        """The verdicts of both results on each requirement; null where a problem does not state it.

        Texts of requirements to pairs of ``holds``-verdicts.
        """
        return _pairs(self.verdicts)

    def _verdict(self) -> str:
        return (
            f"{sum(line.differs for line in self.decisions)} of {count_words(len(self.decisions), 'decision')} differ"
        )

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each decision, metric and requirement.

        Columns: ``kind``, ``name``, ``one`` and ``other`` (None where only one of the designs has it; exact where it is
        a figure), ``unit``. `units` as for `Result.frame`: rows of their kind are in that unit, which then stands in
        ``unit``; money of two currencies stays as it is.
        """
        listed = {"decision": self.decisions, "metric": self.metrics, "requirement": self.verdicts}
        named = [(kind, line) for kind, lines in listed.items() for line in lines]
        rows = [
            {"kind": kind, "name": line.name, "one": line.one, "other": line.other, "unit": line.unit or None}
            for kind, line in named
        ]
        currency = self.currencies[0] if len(set(self.currencies)) == 1 else None
        return mixed_frame(["kind", "name", "one", "other", "unit"], rows, ["one", "other"], units, currency)


@dataclass(frozen=True)
class PointComparison:
    """A point against the other front.

    Both fronts answer one question, so that objectives can be compared point by point.
    """

    JSON_NAME = "ComparedPoint"
    WRITTEN = (
        Of("point.id", "Id of the point in its own result.", kind=int),
        Of(
            "point.objectives",
            "Objectives of the point, in the units of its own result; null where one is unbounded.",
            kind=Values,
        ),
        *("equal", "dominated_by"),
    )

    point: Point
    equal: Annotated[tuple[int, ...], "The points of the other front with the same objectives."]
    dominated_by: Annotated[tuple[int, ...], "The points of the other front that dominate it."]


@dataclass(frozen=True, repr=False)
class ResultComparison(Answer):
    """Two results with the same objectives side by side.

    `carried` names the problem files that were not there, so that the problems that the results carry were compared.
    """

    FORMAT = "comparison"
    JSON_NAME = "Results"
    WRITTEN = ("of", "names", Of("fact_texts", key="facts"), "points", "unlike")

    names: Annotated[tuple[str, str], "Names of both."]
    results: tuple[Result, Result]
    facts: tuple[ComparedLine, ...]
    points: Annotated[tuple[tuple[PointComparison, ...], tuple[PointComparison, ...]], "The points of each front."]
    unlike: Annotated[
        tuple[str, ...],
        "The settings by which the objectives of both are counted otherwise: then no point is compared.",
        Json("not_comparable"),
    ] = ()
    carried: tuple[str, ...] = ()

    @property
    def of(self) -> Literal["results"]:
        """The kind of things compared."""
        return "results"

    @property
    def fact_texts(self) -> Mapping[str, tuple[str | None, str | None]]:
        """The facts of the questions and findings of both results, in words."""
        return _pairs(self.facts)

    def frame(self) -> pandas.DataFrame:
        """The questions and findings of both results side by side; columns ``name``, ``one`` and ``other``.

        A `pandas.DataFrame` with one row for each fact, such as the status or a requirement; all cells are texts.
        """
        import pandas

        rows = [[line.name, line.one, line.other] for line in self.facts]
        return pandas.DataFrame(rows, columns=["name", "one", "other"])


def compare_designs(names: tuple[str, str], one: Analysis, other: Analysis) -> DesignComparison:
    """Two analysed designs; what only one of them has is None in the other.

    A `DesignComparison` with decisions, metrics and verdicts side by side. Metrics for which the two problems state
    other rules, or prices in other currencies, are shown without a difference.
    """
    held = [
        {verdict.requirement.shown: _verdict(verdict.holds) for verdict in analysis.verdicts}
        for analysis in (one, other)
    ]
    currencies = (one.space.currency, other.space.currency)
    units = {**other.metric_units, **one.metric_units}
    ruled = _ruled_otherwise(one.space, other.space)
    affected = {item.name for item in all_metrics(one.space) if _rules_of(one.space, item) & ruled.keys()}
    affected &= one.metrics.keys() & other.metrics.keys()
    return DesignComparison(
        names=names,
        decisions=_decisions(one, other),
        metrics=tuple(
            replace(
                line,
                unit=units[line.name],
                is_alike=line.name not in affected and (units[line.name] != "ct" or currencies[0] == currencies[1]),
            )
            for line in _lines(one.metrics, other.metrics)
        ),
        verdicts=_lines(*held),
        currencies=currencies,
        unlike=_said(ruled) if affected else (),
        senses={name: sense for name, sense in _senses(one.space).items() if _senses(other.space).get(name) == sense},
    )


def _senses(space: Space) -> dict[str, int]:
    """The objectives of a space by name: 1 for one that is minimised, -1 for one that is maximised."""
    return {item.metric.name: 1 if item.sense == "minimise" else -1 for item in space.objectives}


def compare_results(names: tuple[str, str], one: Result, other: Result) -> ResultComparison:
    """Two results that ask for the same objectives.

    Raises
    ------
    ValueError
        when they do not, or count money in two currencies.
    """
    objectives = [[(info.name, info.sense) for info in result.objectives] for result in (one, other)]
    if objectives[0] != objectives[1]:
        raise ValueError("the results have different objectives: compare designs of them instead (RESULT.json#ID)")
    currencies = [result.space.currency for result in (one, other)]
    if currencies[0] != currencies[1] and any(info.unit == "ct" for info in one.objectives):
        raise ValueError(f"the results count money in {' and in '.join(currencies)}: they cannot be compared")
    facts = _lines(_facts(one), _facts(other))
    ruled = _ruled_otherwise(one.space, other.space)
    ruled = {
        name: values
        for name, values in ruled.items()
        if any(name in _rules_of(one.space, item.metric) for item in one.space.objectives)
    }
    points = tuple(
        tuple(PointComparison(point, (), ()) if ruled else _against(point, mine, theirs) for point in mine.front)
        for mine, theirs in ((one, other), (other, one))
    )
    return ResultComparison(names, (one, other), facts, (points[0], points[1]), _said(ruled))


def _decisions(one: Analysis, other: Analysis) -> tuple[ComparedLine, ...]:
    """Decision by decision; cores that the same threads share are the same by any number."""
    lines = _lines(one.numbered_decisions, other.numbered_decisions)
    if one.space.decisions != other.space.decisions or one.breaches or other.breaches:
        return lines
    design = numbered_like(one.space, other.design, one.design)
    alike = numbered_texts(one.space, decisions_of(one.space, design), design)
    return tuple(
        line if alike.get(line.name) == line.other else replace(line, renumbered=alike[line.name]) for line in lines
    )


def _ruled_otherwise(one: Space, other: Space) -> dict[str, tuple[str, str]]:
    """The settings by which two spaces count figures otherwise; OSATE's worst case is none of the own profile."""
    mine, theirs = settings_of(one), settings_of(other)
    differing = {name: (mine[name], theirs[name]) for name in COUNTING if mine[name] != theirs[name]}
    if one.profile == other.profile == "dse":
        differing.pop("worst_case", None)
    return differing


def _rules_of(space: Space, metric: Metric) -> frozenset[str]:
    """The settings that a metric is counted by."""
    rules = frozenset(name for name, kinds in COUNTING.items() if metric.kind in kinds)
    return rules.union(*(_rules_of(space, part) for _, part in parts_of(space, metric)))


def _said(ruled: Mapping[str, tuple[str, str]]) -> tuple[str, ...]:
    return tuple(f"{name.replace('_', ' ')}: {one} and {other}" for name, (one, other) in ruled.items())


def _facts(result: Result) -> dict[str, str]:
    question = result.problem.effective
    return {
        "problem": result.problem.name,
        "problem SHA-256": result.problem.sha256[:12],
        **{name.replace("_", " "): str(question[name]) for name in SETTINGS},
        "requirements": "; ".join(question["requirements"]),
        "rules": "; ".join(question["rules"]),
        "fixed": "; ".join(f"{name} = {value}" for name, value in question["fixed"].items()),
        "status": result.status,
        "points": str(len(result.front)),
    }


def _against(point: Point, mine: Result, theirs: Result) -> PointComparison:
    here = _losses(point, mine.objectives)
    equal, better = [], []
    for other in theirs.front:
        there = _losses(other, theirs.objectives)
        if there == here:
            equal.append(other.id)
        elif all(a <= b for a, b in zip(there, here, strict=True)):
            better.append(other.id)
    return PointComparison(point, tuple(equal), tuple(better))


def _losses(point: Point, infos: Sequence[ObjectiveInfo]) -> list[Fraction]:
    """Objectives to be minimised, in base units: the counting units of two results may differ."""
    losses = []
    for info in infos:
        value = Fraction(point.objectives[info.name], scaled_unit(info.unit)[0])
        losses.append(value if info.sense == "minimise" else -value)
    return losses


def _lines(one: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[ComparedLine, ...]:
    names = [*one, *(name for name in other if name not in one)]
    return tuple(ComparedLine(name, one.get(name), other.get(name)) for name in names)


def _verdict(holds: bool) -> str:
    return "holds" if holds else "broken"
