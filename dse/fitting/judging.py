"""What is to be said of measurements and of the lines through them: how well they fit, and what is odd about them."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Literal, TypeAlias

import numpy as np

from dse.fitting.lines import Floats, LinearModel, Points
from dse.fitting.measurements import Summary
from dse.support.json_fields import Json
from dse.support.timelimit import in_time

Kind: TypeAlias = Literal[
    "sample maximum", "half round trip", "negative part", "crossing", "outside", "poor fit", "bend", "spread",
    "saturated", "resolution", "few sizes", "single sample", "left out",
]  # fmt: skip
"""What a remark is about."""
JUMP, RISE = 3.0, 1.5
"""A spread of `JUMP` times what other sizes suggest is an anomaly, which reaches as far as it is `RISE` times that."""
FEWEST_FOR_SPREAD = 6
FEWEST_FOR_BEND = 6
SIGNIFICANT = 0.01
LARGE = 0.10
"""The share of a time from which on its residual is remarked."""
CEILING_SHARE = 0.01
"""Samples at the very maximum: more than that are no chance."""


@dataclass(frozen=True)
class Remark:
    """Something to know before the figures are used.

    `limit_bytes` is stated where the remark is about larger messages.
    """

    JSON_NAME = "FitRemark"

    kind: Annotated[
        Kind, "What it is about, such as `spread`, `saturated`, `negative part`, `sample maximum`.", Json(kind=str)
    ]
    text: Annotated[str, "In words."]
    limit_bytes: Annotated[
        int | None, "The size at or below which messages stay clear of it; null where there is none."
    ] = None


@dataclass(frozen=True)
class Goodness:
    """The goodness of fit of a line through the extremes of the sizes.

    Times in ns; an envelope has nothing beyond it.
    """

    r_squared: Annotated[float | None, "The share of the variance that the line explains; null where there is none."]
    rms_ns: Annotated[float, "The root of the mean squared residual."]
    beyond: Annotated[int, "How many minima lie below, or maxima above, the line."]
    most_beyond_ns: Annotated[Fraction, "By how much at most."]
    at_bytes: Annotated[int | None, "At which size that is; null where nothing lies beyond."]


def goodness(points: Points, line: LinearModel, *, upper: bool) -> Goodness:
    """The goodness of fit of a line to points.

    `points` are pairs of a size in bytes and a time in ns; `upper` looks for maxima above the line, else for minima
    below.
    """
    residuals = [time - line.at(size) for size, time in points]
    mean = sum((time for _, time in points), Fraction(0)) / len(points)
    total = sum((time - mean) ** 2 for _, time in points)
    rest = sum(residual**2 for residual in residuals)
    outside = [(residual if upper else -residual, size) for residual, (size, _) in zip(residuals, points, strict=True)]
    most, at = max(outside)
    return Goodness(
        r_squared=float(1 - rest / total) if total else None,
        rms_ns=float(rest / len(points)) ** 0.5,
        beyond=sum(value > 0 for value, _ in outside),
        most_beyond_ns=max(most, Fraction(0)),
        at_bytes=at if most > 0 else None,
    )


def bend(points: Points, line: LinearModel) -> int | None:
    """The size at which a line with one bend fits much better than a straight one; None where none does.

    Much better: significantly (F test of two parameters, one per cent) with a quarter of the squared residuals, and
    where the straight line is off by a tenth of a time somewhere.
    """
    if len(points) < FEWEST_FOR_BEND:
        return None
    off = max(abs(float(time - line.at(size))) / max(float(time), 1.0) for size, time in points)
    sizes = np.array([float(size) for size, _ in points])
    times = np.array([float(time) for _, time in points])
    straight = _rest(np.column_stack([np.ones_like(sizes), sizes]), times)
    if off < LARGE or straight <= 0:
        return None
    best, at = min(
        (_rest(np.column_stack([np.ones_like(sizes), sizes, np.maximum(sizes - knee, 0)]), times), knee)
        for knee in in_time(sizes[1:-1], every=10)
    )
    freedom = len(points) - 4
    ratio = (straight - best) / 2 / max(best / freedom, straight * 1e-12)
    is_significant = (1 + 2 * ratio / freedom) ** (-freedom / 2) < SIGNIFICANT / (len(points) - 2)
    return int(at) if is_significant and best < straight / 4 else None


def _rest(matrix: Floats, values: Floats) -> float:
    solution = np.linalg.lstsq(matrix, values, rcond=None)[0]
    return float(((values - matrix @ solution) ** 2).sum())


def _spreads(summaries: Sequence[Summary]) -> list[float]:
    """How far the samples of each size lie apart: the middle nine tenths, the deviation, or all from least to most."""
    if all(len(item.samples_ns) > 1 for item in summaries):
        return [float(np.subtract(*np.quantile(item.samples_ns, [0.95, 0.05]))) for item in summaries]
    if all(item.deviation_ns is not None for item in summaries):
        return [float(item.deviation_ns or 0) for item in summaries]
    return [float(item.max_ns - item.min_ns) for item in summaries]


def _anomalies(summaries: Sequence[Summary]) -> list[tuple[int, int]]:
    """Ranges of sizes (positions of first and last) in which the spread jumps, against a robust line of all sizes.

    A spread that grows evenly with the size is none.
    """
    if len(summaries) < FEWEST_FOR_SPREAD:
        return []
    values = np.array(_spreads(summaries))
    sizes = np.array([float(item.size_bytes or 0) for item in summaries])
    slope, intercept = repeated_medians(sizes, values)
    expected = np.maximum(intercept + max(slope, 0.0) * sizes, np.median(values) / 2)
    if expected.min() <= 0:
        return []
    ratios = values / expected
    anomalies: list[tuple[int, int]] = []
    for position in np.flatnonzero(ratios >= JUMP):
        first = last = int(position)
        if anomalies and first <= anomalies[-1][1]:
            continue
        while first > 0 and ratios[first - 1] >= RISE:
            first -= 1
        while last + 1 < len(ratios) and ratios[last + 1] >= RISE:
            last += 1
        anomalies.append((first, last))
    return anomalies


def repeated_medians(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and intercept of a line that half of the points may be far from: Siegel, Biometrika 69 (1982).

    Floats; a robust line with a breakdown point of 50 %.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # NaN of each point with itself
        medians = [np.nanmedian((y[at] - y) / (x[at] - x)) for at in in_time(range(len(x)))]
    slope = float(np.median(medians))
    return slope, float(np.median(y - slope * x))


def spread_remarks(summaries: Sequence[Summary]) -> list[Remark]:
    """A remark for each range of sizes whose spread jumps.

    Each names the sizes in bytes and advises a limit or ``--without``.
    """
    remarks = []
    for first, last in _anomalies(summaries):
        low, high = summaries[first].size_bytes, summaries[last].size_bytes
        where = f"from {low} to {high} B" if low != high else f"at {low} B"
        below = summaries[first - 1].size_bytes if first else None
        advice = (
            f"keep messages to at most {below} B, or leave these sizes out with --without"
            if below is not None
            else "leave these sizes out with --without"
        )
        text = f"the samples lie much further apart {where} than at the other sizes: {advice}"
        remarks.append(Remark("spread", text, below))
    return remarks


def left_out_remarks(used: Sequence[int], left_out: Sequence[int]) -> list[Remark]:
    """The remark that sizes were measured and not used, with the greatest size up to which the line holds.

    One for each run of neighbouring sizes.
    """
    remarks = []
    for used_below, sizes in _runs(sorted(used), sorted(left_out)):
        where = f"from {sizes[0]} to {sizes[-1]} B" if len(sizes) > 1 else f"of {sizes[0]} B"
        text = f"messages {where} were measured and left out: the figures are not for them"
        beyond = any(size > sizes[-1] for size in used)
        limit = None if beyond or not used_below else used_below[-1]
        remarks.append(Remark("left out", text, limit))
    return remarks


def _runs(used: Sequence[int], left_out: Sequence[int]) -> Iterator[tuple[list[int], list[int]]]:
    """The sizes that were left out between two that were used, with the used ones below them."""
    by_place: dict[int, list[int]] = {}
    for size in left_out:
        by_place.setdefault(bisect(used, size), []).append(size)
    for place, sizes in by_place.items():
        yield list(used[:place]), sizes


def saturated_remarks(summaries: Sequence[Summary]) -> list[Remark]:
    """A remark for each row whose maximum looks like a ceiling (a time-out, a full queue, a counter's end).

    One for each suspicious size, and one where several sizes share the greatest maximum.
    """
    remarks = []
    for item in summaries:
        reason = _ceiling(item)
        if reason:
            text = f"{_of(item)} looks saturated: {reason}; the true maximum may be higher"
            remarks.append(Remark("saturated", text))
    highest = max((item.max_ns for item in summaries), default=Fraction(0))
    at_top = [item for item in summaries if item.max_ns == highest]
    if len(at_top) > 2 and len({item.max_ns for item in summaries}) > 2:
        sizes = ", ".join(f"{item.size_bytes} B" for item in at_top)
        text = f"{sizes} share the greatest maximum of all, which looks like a ceiling; the true maxima may be higher"
        remarks.append(Remark("saturated", text))
    return remarks


def _ceiling(item: Summary) -> str:
    if len(item.samples_ns) >= 20:
        values, counts = np.unique(item.samples_ns, return_counts=True)
        if len(values) > 10 and counts[-1] >= max(3, CEILING_SHARE * len(item.samples_ns)):
            return f"{counts[-1]} of {len(item.samples_ns)} samples are at the maximum"
        return ""
    middle = item.median_ns
    if middle is not None and item.max_ns > item.min_ns and middle == item.max_ns:
        return "half of the samples are at the maximum"
    return ""


def _of(item: Summary) -> str:
    return f"{item.size_bytes} B" if item.size_bytes is not None else " ".join(name for name in item.group if name)


def resolution_remark(summaries: Sequence[Summary], words: Callable[[Fraction], str]) -> Remark | None:
    """A remark where the figures lie on a coarse grid: what is measured in tenths of ms is not known in us.

    None with fewer than four figures, or where the grid is finer than 5 % of the least one.
    """
    figures = [value for item in in_time(summaries) for value in (item.min_ns, item.max_ns) if value]
    step = _grid(figures)
    least = min(figures, default=Fraction(0))
    if len(figures) < 4 or step * 20 < least:
        return None
    text = f"all minima and maxima are multiples of {words(step)}: a line through them is no finer than that"
    return Remark("resolution", text)


def _grid(values: Sequence[Fraction]) -> Fraction:
    """The greatest step of which all are multiples, by powers of ten and their halves and fifths."""
    for power in range(12, -4, -1):
        for factor in (5, 2, 1):
            step = factor * Fraction(10) ** power
            if all(value % step == 0 for value in in_time(values, every=1000)):
                return step
    return Fraction(0)
