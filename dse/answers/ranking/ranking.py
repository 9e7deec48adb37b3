"""Ranking of a front by a stated method, in exact rational arithmetic.

Every score is a fraction of integers, so that ties are real ones; objectives are scaled by the front itself, so that a
change of units changes nothing. Nothing is left out: each point gets a rank, and equal scores share one.

An objective is scaled to the range of its bounded values. What is unbounded counts as lying as far beyond the worst of
these as that is from the best, so that the number that stands for it (`dse.support.units.exact`) scales nothing.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import sqrt
from typing import Any, TypeAlias

from dse.support.arguments import hint
from dse.support.errors import UsageError
from dse.support.units import is_unbounded

METHOD = "distance to the ideal point, objectives scaled to their range on the front (equal weights)"
METHODS = ("ideal", "topsis", "knee", "weights", "order", "baseline")
MOST_DIGITS = 6
UNBOUNDED_LOSS = 2
"""The loss of an unbounded value, in ranges of the bounded ones from the best of these."""
Vectors: TypeAlias = Sequence[Sequence[int | Fraction]]
Range: TypeAlias = tuple[int | Fraction, int | Fraction]
"""The best and the worst value of an objective."""
Key: TypeAlias = tuple[Any, ...]


@dataclass(frozen=True)
class Ranking:
    """The ranking of a front: `method` as asked for, `words` with every parameter; rank and score of each point.

    Ranks begin with 1, ties share one; scores are exact decimals as text.
    """

    method: str
    words: str
    ranks: tuple[int, ...]
    scores: tuple[str, ...]

    @property
    def tied(self) -> frozenset[int]:
        """The ranks that several points share."""
        return frozenset(rank for rank in self.ranks if self.ranks.count(rank) > 1)


def rank(
    method: str,
    points: Vectors,
    objectives: Sequence[tuple[str, str]],
    changes: Sequence[int] | None = None,
) -> Ranking:
    """Rank the points of a front.

    Parameters
    ----------
    method
        ``ideal``, ``topsis``, ``knee``, ``baseline``, ``weights:NAME=NUMBER,…`` or ``order:NAME,…``; `ideal` and
        `topsis` take weights too (``topsis:price=2``). A name is that of an objective or the beginning of exactly one;
        weights may be numbers alone.
    points
        objective vectors, in counting units.
    objectives
        (name, sense) of each objective.
    changes
        for each point how many decisions differ from the baseline; None when there is no complete baseline.

    Raises
    ------
    UsageError
        when the method or an objective is not known, or there is no baseline.

    Examples
    --------
    >>> rank("ideal", [(0, 10), (4, 0), (1, 1)], [("jitter", "minimise"), ("price", "minimise")]).ranks
    (2, 2, 1)
    """
    name, _, text = method.strip().partition(":")
    names = [objective for objective, _ in objectives]
    if name not in METHODS:
        raise UsageError(f"--rank-by {method}: expected one of {', '.join(METHODS)}{hint(name, METHODS)}")
    if name in ("knee", "baseline") and text:
        raise UsageError(f"--rank-by {method}: {name} takes no parameters")
    if name in ("weights", "order") and not text:
        example = f"{_quoted(names[0])}=2" if name == "weights" else _quoted(names[0])
        raise UsageError(f"--rank-by {name} needs parameters, such as --rank-by '{name}:{example}'")
    losses = _losses(points, [sense for _, sense in objectives])
    if name == "baseline":
        return _by_baseline(method, changes)
    if name == "order":
        return _by_order(method, losses, names, text)
    if name == "knee":
        return _by_knee(method, losses)
    weights = _weights(text, names, method) if text else [Fraction(1)] * len(names)
    said = _weight_words(weights, names)
    if name == "weights":
        sums = [sum((w * x for w, x in zip(weights, row, strict=True)), Fraction(0)) for row in _by_range(losses)]
        words = f"weighted sum of the objectives, each scaled to its range on the front ({said})"
        return _ranking(method, words, [(value,) for value in sums], score_texts([float(value) for value in sums]))
    if name == "ideal":
        squared = ideal_distances(points, [sense for _, sense in objectives], weights)
        words = f"distance to the ideal point, objectives scaled to their range on the front ({said})"
        return _ranking(method, words, [(value,) for value in squared], score_texts([sqrt(value) for value in squared]))
    return _by_topsis(method, points, [sense for _, sense in objectives], weights, said)


def ideal_distances(
    points: Vectors,
    senses: Sequence[str],
    weights: Sequence[Fraction] | None = None,
    scale: Sequence[Range] | None = None,
) -> list[Fraction]:
    """The squared distance of each point to the ideal point (the best value of every objective on the front).

    `scale` has the best and the worst value of each objective where others than those of `points` are meant.

    >>> ideal_distances([(0, 10), (4, 0)], ["minimise", "minimise"])
    [Fraction(1, 1), Fraction(1, 1)]
    >>> ideal_distances([(0, 10), (4, 0)], ["minimise", "minimise"], scale=[(0, 8), (0, 10)])
    [Fraction(1, 1), Fraction(1, 4)]
    """
    factors = weights or [Fraction(1)] * len(senses)
    signs = [1 if sense == "minimise" else -1 for sense in senses]
    columns = [(sign * best, sign * worst) for sign, (best, worst) in zip(signs, scale or (), strict=bool(scale))]
    return [
        sum(((factor * value) ** 2 for factor, value in zip(factors, row, strict=True)), Fraction(0))
        for row in _by_range(_losses(points, senses), columns)
    ]


def range_of(points: Vectors, senses: Sequence[str]) -> list[Range]:
    """The best and the worst bounded value of each objective: the ideal and the nadir point of a front.

    An objective that is unbounded in all points has what stands for that.

    >>> range_of([(0, 10), (4, 0)], ["minimise", "maximise"])
    [(0, 4), (10, 0)]
    """
    columns = [_bounded(column) for column in zip(*points, strict=True)]
    return [
        (min(column), max(column)) if sense == "minimise" else (max(column), min(column))
        for column, sense in zip(columns, senses, strict=bool(points))
    ]


def finite(points: Vectors) -> list[tuple[int | Fraction, ...]]:
    """The points with a number for what is unbounded: as far beyond the greatest bounded one as that is from the least.

    Where the bounded ones are equal it is twice them and 1, and 0 where there are none.

    >>> from dse.support.units import Unbounded
    >>> finite([(3, 1), (5, 2), (Unbounded(10**14), 3)])
    [(3, 1), (5, 2), (7, 3)]
    """
    columns = []
    for column in zip(*points, strict=True):
        bounded = [value for value in column if not is_unbounded(value)] or [0]
        low, high = min(bounded), max(bounded)
        beyond = 2 * high - low if high > low else 2 * abs(high) + 1
        columns.append([beyond if is_unbounded(value) else value for value in column])
    return list(zip(*columns, strict=True)) if columns else [() for _ in points]


def _bounded(column: Sequence[int | Fraction]) -> Sequence[int | Fraction]:
    """The bounded values of a column; all of them where none is."""
    return [value for value in column if not is_unbounded(value)] or column


def competition_ranks(keys: Sequence[Any]) -> list[int]:
    """Competition ranks, from 1, smallest key first; equal keys share a rank.

    >>> competition_ranks([3, 1, 3, 2])
    [3, 1, 3, 2]
    """
    first: dict[Any, int] = {}
    for position, key in enumerate(sorted(keys), start=1):
        first.setdefault(key, position)
    return [first[key] for key in keys]


def trade_off(one: Sequence[Fraction], other: Sequence[Fraction]) -> Fraction | None:
    """The loss of moving from one point to another, per unit of gain; None where nothing is gained.

    Both points are normalised objectives to be minimised. Losses and gains are summed over the objectives (Rachmawati
    and Srinivasan 2009); large values mark a knee.
    """
    gain = sum((a - b for a, b in zip(one, other, strict=True) if a > b), Fraction(0))
    loss = sum((b - a for a, b in zip(one, other, strict=True) if b > a), Fraction(0))
    return loss / gain if gain else None


def _ranking(method: str, words: str, keys: Sequence[Key], scores: Sequence[str]) -> Ranking:
    return Ranking(method, words, tuple(competition_ranks(keys)), tuple(scores))


def score_texts(scores: Sequence[float | None]) -> list[str]:
    """Scores with as many decimals as tell different ones apart: 3 to 6; a dash where there is none.

    >>> score_texts([0.41783, 0.41796, None]), score_texts([0.5, 1.0])
    (['0.4178', '0.4180', '-'], ['0.500', '1.000'])
    """
    different = len({score for score in scores if score is not None})
    for digits in range(3, MOST_DIGITS + 1):
        texts = ["-" if score is None else f"{score:.{digits}f}" for score in scores]
        if len({*texts} - {"-"}) >= different:
            break
    return texts


def same_score(one: str, other: str) -> bool:
    """Whether two texts can be the same score, written with fewer and with more decimals.

    >>> same_score("0.418", "0.41752"), same_score("0.418", "0.419"), same_score("1 change", "2 changes")
    (True, False, False)
    """
    if one == other:
        return True
    numbers = [re.fullmatch(r"\d+\.(\d+)", text) for text in (one, other)]
    places = {len(number.group(1)) for number in numbers if number is not None}
    if None in numbers or len(places) < len(numbers):
        return False
    return abs(Fraction(one) - Fraction(other)) <= sum(Fraction(1, 10**count) for count in places) / 2


def _losses(points: Vectors, senses: Sequence[str]) -> list[tuple[int | Fraction, ...]]:
    """The points with every objective to be minimised."""
    signs = [1 if sense == "minimise" else -1 for sense in senses]
    return [tuple(sign * value for sign, value in zip(signs, point, strict=True)) for point in points]


def _by_range(losses: Vectors, scale: Sequence[Range] = ()) -> list[tuple[Fraction, ...]]:
    """Each objective from 0 (best of `scale`, else of the front) to 1 (worst); 0 where these are the same.

    What is unbounded has `UNBOUNDED_LOSS`, where something is bounded.
    """
    columns = scale or range_of(losses, ["minimise"] * len(losses[0] if losses else ()))
    return [tuple(_loss(value, *column) for value, column in zip(row, columns, strict=True)) for row in losses]


def _loss(value: int | Fraction, low: int | Fraction, high: int | Fraction) -> Fraction:
    if is_unbounded(value):
        return Fraction(UNBOUNDED_LOSS if value > low and not is_unbounded(low) else 0)
    return Fraction(value - low) / (high - low) if high > low else Fraction(0)


def _by_topsis(method: str, points: Vectors, senses: Sequence[str], weights: Sequence[Fraction], said: str) -> Ranking:
    """TOPSIS (Hwang and Yoon, 1981): closeness = d- / (d+ + d-), distances in vector-normalised, weighted objectives.

    Squared distances are rational, and closeness falls as (d+ / d-)^2 rises, so that no root is compared.
    """
    points = finite(points)
    norms = [sum(value * value for value in column) for column in zip(*points, strict=True)]
    losses = _losses(points, senses)
    columns = list(zip(*losses, strict=True))

    def squared(row: Sequence[int | Fraction], target: Sequence[int | Fraction]) -> Fraction:
        parts = (
            weight**2 * Fraction((value - to) ** 2) / norm
            for value, to, norm, weight in zip(row, target, norms, weights, strict=True)
            if norm
        )
        return sum(parts, Fraction(0))

    best, worst = [min(column) for column in columns], [max(column) for column in columns]
    keys: list[Key] = []
    scores: list[float | None] = []
    for row in losses:
        near, far = squared(row, best), squared(row, worst)
        keys.append((1, Fraction(0)) if near and not far else (0, near / far if far else Fraction(0)))
        scores.append(sqrt(far) / (sqrt(near) + sqrt(far)) if near or far else 1.0)
    words = f"TOPSIS: relative closeness to the ideal against the worst point, objectives vector-normalised ({said})"
    return _ranking(method, words, keys, score_texts(scores))


def _by_knee(method: str, losses: Vectors) -> Ranking:
    """The least trade-off of leaving a point for any other (the worth metric of Rachmawati and Srinivasan, 2009)."""
    rows = _by_range(losses)
    keys: list[Key] = []
    scores: list[float | None] = []
    for row in rows:
        trade_offs = [value for other in rows if other is not row and (value := trade_off(row, other)) is not None]
        worth = min(trade_offs, default=None)
        keys.append((0, Fraction(0)) if worth is None else (1, -worth))
        scores.append(None if worth is None else float(worth))
    words = (
        "knee: how much worse, per unit of what gets better, the least painful move to another point is "
        "(more is better); objectives scaled to their range on the front"
    )
    return _ranking(method, words, keys, score_texts(scores))


def _by_order(method: str, losses: Vectors, names: Sequence[str], text: str) -> Ranking:
    """The first objective first, the next where that ties; objectives that are not named follow in their own order."""
    wanted = [_objective(part, names, method) for part in split_names(text)]
    if len(set(wanted)) < len(wanted):
        raise UsageError(f"--rank-by {method}: an objective is named twice")
    full = [*wanted, *(index for index in range(len(names)) if index not in wanted)]
    keys = [tuple(row[index] for index in full) for row in losses]
    words = f"order of objectives: {', then '.join(names[index] for index in full)}"
    return _ranking(method, words, keys, [""] * len(keys))


def _by_baseline(method: str, changes: Sequence[int] | None) -> Ranking:
    if changes is None:
        raise UsageError("--rank-by baseline: the problem states no complete baseline")
    words = "closeness to the baseline: the number of decisions that change"
    said = [f"{count} change{'s' if count != 1 else ''}" for count in changes]
    return _ranking(method, words, [(count,) for count in changes], said)


# --- parameters ---------------------------------------------------------------------------------------------------


def split_names(text: str) -> list[str]:
    """Parts between commas outside quotes, trimmed.

    >>> split_names('price, "a, b" = 2')
    ['price', '"a, b" = 2']
    """
    return [part.strip() for part in re.findall(r"""(?:"[^"]*"|'[^']*'|[^,"'])+|["']""", text) if part.strip()]


def _weights(text: str, names: Sequence[str], method: str) -> list[Fraction]:
    parts = split_names(text)
    if len(parts) == len(names) and all(_number(part) is not None for part in parts):
        by_index = {index: _number(part) for index, part in enumerate(parts)}
    else:
        by_index = {}
        for part in parts:
            name, separator, value = part.rpartition("=")
            number = _number(value)
            if not separator or number is None:
                raise UsageError(f"--rank-by {method}: expected NAME=NUMBER, got {part!r}")
            index = _objective(name, names, method)
            if index in by_index:
                raise UsageError(f"--rank-by {method}: {names[index]!r} has two weights")
            by_index[index] = number
    weights = [by_index.get(index) or Fraction(0) for index in range(len(names))]
    if any(weight < 0 for weight in weights) or not any(weights):
        raise UsageError(f"--rank-by {method}: weights are not negative, and one is positive")
    return weights


def _number(text: str) -> Fraction | None:
    body = text.strip()
    if not re.fullmatch(r"-?\d{1,9}(\.\d{1,9}|/[1-9]\d{0,8})?", body):
        return None
    return Fraction(body)


def _objective(text: str, names: Sequence[str], method: str) -> int:
    """The objective that is called so, or the only one whose name begins so."""
    body = text.strip()
    if len(body) > 1 and body[0] == body[-1] and body[0] in "'\"":
        body = body[1:-1]
    if body in names:
        return list(names).index(body)
    matches = [index for index, name in enumerate(names) if body and name.startswith(body)]
    if len(matches) != 1:
        which = "several objectives begin so" if matches else "no such objective"
        raise UsageError(f"--rank-by {method}: {body!r}: {which}; objectives: {', '.join(names)}")
    return matches[0]


def _weight_words(weights: Sequence[Fraction], names: Sequence[str]) -> str:
    if len(set(weights)) == 1:
        return "equal weights"
    return "weights: " + ", ".join(f"{name} {_short(weight)}" for name, weight in zip(names, weights, strict=True))


def _short(weight: Fraction) -> str:
    return str(weight) if weight.denominator in (1, 3, 7) else f"{float(weight):g}"


def _quoted(name: str) -> str:
    return f'"{name}"' if "," in name or "=" in name else name
