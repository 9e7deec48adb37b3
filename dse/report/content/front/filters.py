"""Data of the page of a front: exact figures to filter by, options to insist on, the command to run else."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.answers.designs import InsistedOption
from dse.answers.result import ObjectiveInfo, Result
from dse.answers.tables.display import counted, display_unit, scaled_unit
from dse.report.amounts import MOST_ROWS, amount_words
from dse.report.page import NOTHING, Section, Table, texts
from dse.report.plots.front import drawn_figures
from dse.support.units import is_unbounded

PER_CORE = "utilisation"
"""A limit of this kind holds on each core: another computer makes another limit of it than the sum that is listed."""


def decide_data(result: Result, baseline: Mapping[str, Fraction] | None = None) -> dict[str, Any]:
    """Metrics with their exact values, decisions with their options, and fronts with an option fixed.

    Values are integers as text, for JavaScript has no exact ones of any size: ``value * den / num`` is in the unit
    shown. ``exact`` is the direction in which a limit on a metric only takes points away from the proven front:
    ``<=`` for what is minimised, ``>=`` for what is maximised, none (an empty text) where it is another question.
    `baseline` are the metrics of today's design, which is drawn, too.
    """
    currency = result.space.currency
    figures_of = {point.id: (point.objectives, point.counts) for point in result.front}
    if result.insisting is not None:
        figures_of |= {point.id: (point.objectives, point.counts) for point in result.insisting.points}
    metrics = []
    for name, unit in result.units.items():
        factor, shown = display_unit(unit, currency)
        values = {str(number): _value(*figures, name) for number, figures in figures_of.items()}
        if baseline is not None:
            today = baseline[name] * scaled_unit(unit)[0]
            values["baseline"] = None if is_unbounded(today) else str(round(today))
        metrics.append(
            {
                "name": name,
                "unit": shown,
                "num": str(factor.numerator),
                "den": str(factor.denominator),
                "exact": _exact_direction(result, name),
                "values": values,
            }
        )
    return {
        "metrics": metrics,
        "objectives": [list(result.units).index(info.name) for info in result.objectives],
        "decisions": _decisions(result),
        "picks": {str(point.id): dict(point.decisions) for point in result.front},
        "command": f"dse solve {shlex.quote(result.problem.file)}",
        "complete": result.status == "complete",
        "insist": _insist_data(result) if result.insisting is not None else None,
    }


def further_metrics(result: Result) -> list[tuple[int, str]]:
    """The metrics that are no objectives and differ on the front: number, as `decide_data` counts them, and name.

    Pairs of the metric's number in ``result.units`` and its name; the page offers them as columns and filters.
    """
    objectives = {info.name for info in result.objectives}
    return [
        (number, name)
        for number, name in enumerate(result.units)
        if name not in objectives and len({point.counts[name] for point in result.front}) > 1
    ]


def _value(objectives: Mapping[str, int], counts: Mapping[str, int], name: str) -> str | None:
    """The exact figure of a point as text; None where it is unbounded."""
    value = objectives[name] if name in objectives else counts[name]
    return None if is_unbounded(value) else str(value)


def _exact_direction(result: Result, name: str) -> str:
    """In which direction a limit on a metric is answered by taking points away; "" where it needs the solver.

    A design within the limit that no other such design dominates is dominated by none beyond it either: what dominates
    it is no worse in the objective, so within the limit too. That needs an objective, its own direction, the figure
    that is compared, and a proven front.
    """
    for info, objective in zip(result.objectives, result.space.objectives, strict=True):
        if info.name == name and name not in result.rounded and objective.metric.kind != PER_CORE:
            return "<=" if info.sense == "minimise" else ">="
    return ""


def _decisions(result: Result) -> list[dict[str, Any]]:
    """The open decisions, with the options that points of the front have."""
    decisions = []
    for decision in result.space.decisions:
        there = {point.decisions.get(decision.name) for point in result.front}
        options = [option for option in decision.options if option in there]
        if decision.is_open and len(options) > 1:
            decisions.append({"name": decision.name, "options": options})
    return decisions


def _insist_data(result: Result) -> dict[str, Any]:
    assert result.insisting is not None
    listed = [(point.id, point.objectives, point.decisions) for point in result.front]
    listed += [(point.id, point.objectives, point.decisions) for point in result.insisting.points]
    points = [
        {"id": number, **drawn_figures(result, objectives), "decisions": dict(decisions)}
        for number, objectives, decisions in listed
    ]
    options = [
        {
            "decision": price.item.decision,
            "option": price.item.option,
            "status": price.item.status,
            "front": list(price.item.front),
            "kept": price.kept,
            "best": _cost_words(result, price),
        }
        for price in prices(result)
    ]
    return {"points": points, "options": options}


def insist_choices(result: Result) -> list[tuple[str, list[tuple[int, str, str]]]]:
    """For each decision its options: number, text, and ``complete``, ``incomplete`` or ``infeasible``.

    Pairs of a decision's name and its options; empty where the result has no price of insisting.
    """
    choices: dict[str, list[tuple[int, str, str]]] = {}
    if result.insisting is not None:
        for number, item in enumerate(result.insisting.options):
            choices.setdefault(item.decision, []).append((number, item.option, item.status))
    return list(choices.items())


# The price of insisting on an option, in words and figures.


TOP = 10


@dataclass(frozen=True)
class Price:
    """The price of an option: the points of the front that have it, and the loss in the best value of each objective.

    `kept` counts points of the whole front; `best` and `lost` are by objective, empty where no design is known.
    """

    item: InsistedOption
    kept: int
    best: tuple[int, ...]
    lost: tuple[int, ...]

    @property
    def state(self) -> str:
        """``impossible``, ``unknown`` where the search was stopped, else how many points it keeps.

        Text for the column "alternatives kept".
        """
        if self.item.status == "infeasible":
            return "impossible"
        return "unknown" if self.item.status == "incomplete" else str(self.kept)


def prices(result: Result) -> list[Price]:
    """The price of each option, in the order of the problem.

    For each option the best value of each objective with it, and what that loses against the best of the whole front,
    in counting units. Requires `Result.insisting`.
    """
    assert result.insisting is not None
    vectors = {point.id: point.objectives for point in result.front}
    vectors |= {point.id: point.objectives for point in result.insisting.points}
    whole = {point.id for point in result.front}

    def best(info: ObjectiveInfo, ids: tuple[int, ...]) -> int:
        values = [vectors[number][info.name] for number in ids]
        return min(values) if info.sense == "minimise" else max(values)

    rows = []
    for item in result.insisting.options:
        reached = tuple(best(info, item.front) for info in result.objectives) if item.front else ()
        most = [best(info, tuple(whole)) for info in result.objectives] if reached else []
        lost = tuple(abs(value - ideal) for value, ideal in zip(reached, most, strict=True))
        rows.append(Price(item, len(whole & set(item.front)), reached, lost))
    return rows


def summary_words(result: Result) -> str:
    """The numbers of options that keep the whole front, part of it or nothing, are impossible or unknown.

    One sentence with the number of options of each of the five kinds.
    """
    every = prices(result)
    size = len(result.front)
    done = [price for price in every if price.item.status == "complete"]
    counts = [
        (sum(price.kept == size for price in done), "keep every alternative"),
        (sum(0 < price.kept < size for price in done), "keep some"),
        (sum(price.kept == 0 for price in done), "keep none"),
        (sum(price.item.status == "infeasible" for price in every), "are impossible"),
        (sum(price.item.status == "incomplete" for price in every), "are unknown: the search was stopped"),
    ]
    counted = ", ".join(f"{count} {words}" for count, words in counts if count)
    return f"Of {len(every)} options that one may insist on {counted}."


def costly(result: Result) -> list[Price]:
    """The options that no alternative of the front has, in the order of the problem.

    Only these cost something in the sense that no design of the front chooses them; options that are proved impossible
    are among them.
    """
    return [price for price in prices(result) if not price.kept]


def _cost_words(result: Result, price: Price) -> list[str]:
    """For each objective the best value with an option, and what that is worse than without insisting."""
    texts = []
    for info, value, lost in zip(result.objectives, price.best, price.lost, strict=False):
        text = counted(value, info.unit, result.space.currency)
        if lost and not is_unbounded(value):
            text += (
                f" ({'+' if info.sense == 'minimise' else '-'}{amount_words(lost, info.unit, result.space.currency)})"
            )
        texts.append(text)
    return texts


def insisting_section(result: Result, top: int | None = None) -> Section:
    """The price of insisting on options that no alternative has; a terminal shows the first, and the number of others.

    `top` is the number of rows on a terminal, None for all. Rows have the option, how many alternatives it keeps, and
    the best objectives with it.
    """
    said = texts(f"The price of insisting: {summary_words(result)}")
    rows = []
    for price in costly(result):
        cells = _cost_words(result, price) or [NOTHING] * len(result.objectives)
        rows.append((f"{price.item.decision} {price.item.option}", price.state, *cells))
    if rows:
        headings = ("insisting on", "alternatives kept", *(f"best {info.name}" for info in result.objectives))
        numbers = tuple(range(1, len(headings)))
        rest = f"{{}} more such options: --top {len(rows)}, --json or --report."
        brief = None if top is None else max(top, TOP)
        said.append(
            Table("What insisting costs", headings, tuple(rows), numbers, brief=brief, rest=rest, most=MOST_ROWS)
        )
    return Section("insisting", "The price of insisting", tuple(said))
