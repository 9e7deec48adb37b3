"""One ranking for all fronts of a sweep: the same scale everywhere, so that scores of different runs compare.

The score of a design is its distance to the ideal point of all fronts together, objectives scaled to their range on
these. It does not depend on the limit that varies: relaxing one only admits more designs, so the best choice changes
only to a design that was not admitted before, and only to a better score. (A design that dominates another has the
better score: where the two differ the range is not 0.) Of equal scores the design that needs the tighter limit goes
first, which what is newly admitted never does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import count
from math import sqrt
from typing import Any, TypeAlias

from dse.results.display import figure
from dse.results.ranking import competition_ranks, ideal_distances, range_of, score_texts
from dse.results.sweep import ScaledObjective

Outcome: TypeAlias = Mapping[str, Any]
Vector: TypeAlias = tuple[Fraction, ...]


def rank_together(
    outcomes: Sequence[Outcome | None], limits: Sequence[tuple[str, str]] = ()
) -> tuple[list[Outcome | None], tuple[ScaledObjective, ...]]:
    """The outcomes of a sweep with ranks and scores on one scale, each front best first; and that scale.

    Parameters
    ----------
    outcomes
        by run, as `dse.study` finds them (see `SweepRun`); None where a run was not solved.
    limits
        (metric, operator) of each limit that varies: what needs less of it goes first among equal scores.
    """
    solved = [item for item in outcomes if item is not None and item["kind"] != "error"]
    infos: Sequence[Outcome] = solved[0]["objectives"] if solved else []
    senses = [info["sense"] for info in infos]
    known = {number: _alternatives(item) for number, item in enumerate(outcomes) if item is not None}
    vectors = {number: [_vector(item, infos) for item in found] for number, found in known.items()}
    scale = range_of([vector for found in vectors.values() for vector in found], senses)
    distances = {number: ideal_distances(found, senses, scale=scale) for number, found in vectors.items()}
    texts = iter(score_texts([sqrt(value) for found in distances.values() for value in found]))
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
    found: Sequence[Outcome] = outcome.get("front") or outcome.get("alternatives") or ()
    return found


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
