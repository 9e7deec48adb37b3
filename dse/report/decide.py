"""What the page needs to decide with: exact figures to filter by, options to insist on, the command to run else."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from dse.report.insisting import cost_words, prices
from dse.results.display import counted, display_unit
from dse.results.points import ObjectiveInfo
from dse.results.solve import Result
from dse.units import is_unbounded

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
    figures_of = {point.id: (point.objectives, point.metrics) for point in result.front}
    if result.insisting is not None:
        figures_of |= {point.id: (point.objectives, point.metrics) for point in result.insisting.points}
    metrics = []
    for name, unit in result.units.items():
        factor, shown = display_unit(unit, currency)
        values = {str(number): _value(*figures, name) for number, figures in figures_of.items()}
        if baseline is not None:
            values["baseline"] = None if is_unbounded(baseline[name]) else str(round(baseline[name]))
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
    """The metrics that are no objectives and differ on the front: number, as `decide_data` counts them, and name."""
    objectives = {info.name for info in result.objectives}
    return [
        (number, name)
        for number, name in enumerate(result.units)
        if name not in objectives and len({point.metrics[name] for point in result.front}) > 1
    ]


def _value(objectives: Mapping[str, int], metrics: Mapping[str, int], name: str) -> str | None:
    """The exact figure of a point as text; None where it is unbounded."""
    value = objectives[name] if name in objectives else metrics[name]
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
    found = []
    for decision in result.space.decisions:
        there = {point.decisions.get(decision.name) for point in result.front}
        options = [option for option in decision.options if option in there]
        if decision.is_open and len(options) > 1:
            found.append({"name": decision.name, "options": options})
    return found


def _insist_data(result: Result) -> dict[str, Any]:
    assert result.insisting is not None
    listed = [(point.id, point.objectives, point.decisions) for point in result.front]
    listed += [(point.id, point.objectives, point.decisions) for point in result.insisting.points]
    points = [
        {"id": number, **_figures(result.objectives, objectives, result), "decisions": dict(decisions)}
        for number, objectives, decisions in listed
    ]
    options = [
        {
            "decision": price.item.decision,
            "option": price.item.option,
            "status": price.item.status,
            "front": list(price.item.front),
            "kept": price.kept,
            "best": cost_words(result, price),
        }
        for price in prices(result)
    ]
    return {"points": points, "options": options}


def _figures(infos: Sequence[ObjectiveInfo], values: Mapping[str, int], result: Result) -> dict[str, Any]:
    """Readable values and texts by objective, as `dse.report.charts.front_records` has them."""
    found: dict[str, Any] = {}
    for axis, info in enumerate(infos):
        value = values[info.name]
        factor, _ = display_unit(info.unit, result.space.currency)
        found[f"o{axis}"] = None if is_unbounded(value) else float(value / factor)
        found[f"t{axis}"] = counted(value, info.unit, result.space.currency)
    return found


def insist_choices(result: Result) -> list[tuple[str, list[tuple[int, str, str]]]]:
    """For each decision its options: number, text, and ``complete``, ``incomplete`` or ``infeasible``."""
    found: dict[str, list[tuple[int, str, str]]] = {}
    if result.insisting is not None:
        for number, item in enumerate(result.insisting.options):
            found.setdefault(item.decision, []).append((number, item.option, item.status))
    return list(found.items())
