"""Straight lines through measurements: transmission time = fixed + per byte x size, for the least and the greatest.

Three methods by name. ``ols`` is that of the report (ECE-TR-25, section 5.5.1): least squares of the minimum, and of
the maximum, of each size. ``envelope`` is the closest line that nothing measured lies beyond. ``quantile`` lines leave
a stated share of the samples beyond them. Parts of a line are never negative: a message of any size takes some time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from dse.support.extras import needed_for
from dse.support.timelimit import A_MOMENT_S, in_force, look_at_the_clock

Method: TypeAlias = Literal["ols", "envelope", "quantile"]
Points: TypeAlias = Sequence[tuple[int, Fraction]]
"""Sizes in bytes and times in ns; sizes ascend, and each is there once."""
Floats: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class LinearModel:
    """``fixed_ns + per_byte_ns * size``; `free` is the line that the method gives where parts may be negative.

    Both parts are at least 0; exact fractions of ns.
    """

    fixed_ns: Annotated[Fraction, "The time of an empty message."]
    per_byte_ns: Annotated[Fraction, "The time for each byte."]
    free: tuple[Fraction, Fraction] | None = None

    def at(self, size_bytes: int) -> Fraction:
        """The time of a message of this size, in ns."""
        return self.fixed_ns + self.per_byte_ns * size_bytes


def least_squares(points: Points) -> LinearModel:
    """The line with the least sum of squared differences, exactly; each size counts alike.

    Where one part were negative it is 0, and the other is the best under that (the sum is convex).

    >>> least_squares([(0, Fraction(1)), (1, Fraction(2)), (2, Fraction(6))])
    LinearModel(fixed_ns=Fraction(1, 2), per_byte_ns=Fraction(5, 2), free=None)
    >>> least_squares([(1, Fraction(0)), (2, Fraction(6))])
    LinearModel(fixed_ns=Fraction(0, 1), per_byte_ns=Fraction(12, 5), free=(Fraction(-6, 1), Fraction(6, 1)))
    """
    count = len(points)
    sizes, times = sum(size for size, _ in points), sum((time for _, time in points), Fraction(0))
    squares = sum(size * size for size, _ in points)
    products = sum((size * time for size, time in points), Fraction(0))
    slope = (count * products - sizes * times) / (count * squares - sizes * sizes)
    fixed = (times - slope * sizes) / count
    if slope < 0:
        return LinearModel(times / count, Fraction(0), (fixed, slope))
    if fixed < 0:
        return LinearModel(Fraction(0), products / squares, (fixed, slope))
    return LinearModel(fixed, slope)


def envelope(points: Points, *, upper: bool) -> LinearModel:
    """The closest line that no point lies beyond: above (`upper`) or below.

    The closest is the one with the least sum of distances at the measured sizes, each counting alike. That sum is
    ``n * line(mean size)`` less a constant, so the line is the edge of the convex hull that lies over the mean size.

    >>> envelope([(0, Fraction(2)), (10, Fraction(1)), (20, Fraction(5))], upper=True)
    LinearModel(fixed_ns=Fraction(2, 1), per_byte_ns=Fraction(3, 20), free=None)
    """
    sign = 1 if upper else -1
    hull: list[tuple[int, Fraction]] = []
    for point in points:
        while len(hull) > 1 and sign * _turn(hull[-2], hull[-1], point) >= 0:
            hull.pop()
        hull.append(point)
    mean = Fraction(sum(size for size, _ in points), len(points))
    left, right = next((one, two) for one, two in pairwise(hull) if one[0] <= mean <= two[0])
    slope = (right[1] - left[1]) / (right[0] - left[0])
    fixed = left[1] - slope * left[0]
    extreme = max if upper else min
    if slope < 0:
        return LinearModel(extreme(time for _, time in points), Fraction(0), (fixed, slope))
    if fixed < 0:
        return LinearModel(Fraction(0), extreme(time / size for size, time in points if size), (fixed, slope))
    return LinearModel(fixed, slope)


Part: TypeAlias = Callable[[Fraction], Fraction]
"""The best of one part of a line where the other is given."""


def below_upper(low: LinearModel, high: LinearModel, best_fixed: Part, best_slope: Part) -> LinearModel:
    """The lower line with no part above that of the upper one: the part that is is the same, the other the best then.

    Parameters
    ----------
    low, high
        as the method gives them.
    best_fixed, best_slope
        what the method gives where the time per byte, or the fixed part, is stated (in ns).
    """
    line = low
    if line.per_byte_ns > high.per_byte_ns:
        line = LinearModel(best_fixed(high.per_byte_ns), high.per_byte_ns)
    if not 0 <= line.fixed_ns <= high.fixed_ns:
        fixed = min(max(line.fixed_ns, Fraction(0)), high.fixed_ns)
        line = LinearModel(fixed, min(max(best_slope(fixed), Fraction(0)), high.per_byte_ns))
    return line


def squares_parts(points: Points) -> tuple[Part, Part]:
    """The parts of least squares: the mean residual, and the slope of a line through a point at size 0.

    Two functions: the best fixed time for a slope, and the best slope for a fixed time.
    """
    squares = sum(size * size for size, _ in points)
    return (
        lambda slope: sum((time - slope * size for size, time in points), Fraction(0)) / len(points),
        lambda fixed: sum((size * (time - fixed) for size, time in points), Fraction(0)) / squares,
    )


def lower_envelope_parts(points: Points) -> tuple[Part, Part]:
    """The parts of the lower envelope: the least residual, and the least slope from a point at size 0.

    Two functions: the greatest fixed time below all points for a slope, and the greatest slope for a fixed time.
    """
    return (
        lambda slope: min(time - slope * size for size, time in points),
        lambda fixed: min((time - fixed) / size for size, time in points if size),
    )


def quantile_parts(samples: Iterable[tuple[int, Floats]], share: Fraction) -> tuple[Part, Part]:
    """The parts of a quantile line: the quantile of residuals, and that of slopes with samples weighted by size.

    Two functions: the fixed time for a slope, and the slope for a fixed time, such that the share `share` lies below.
    """
    sizes, times, weights = _weighted(samples)
    some = sizes > 0

    def quantile(values: Floats, counts: Floats) -> Fraction:
        order = np.argsort(values)
        upto = np.cumsum(counts[order])
        return Fraction(float(values[order][np.searchsorted(upto, float(share) * upto[-1])]))

    return (
        lambda slope: quantile(times - float(slope) * sizes, weights),
        lambda fixed: quantile((times - float(fixed))[some] / sizes[some], (weights * sizes)[some]),
    )


def _turn(one: tuple[int, Fraction], two: tuple[int, Fraction], three: tuple[int, Fraction]) -> Fraction:
    """Above zero where the way from one over two to three turns left."""
    return (two[0] - one[0]) * (three[1] - one[1]) - (two[1] - one[1]) * (three[0] - one[0])


def quantile_line(samples: Iterable[tuple[int, Floats]], share: Fraction) -> LinearModel:
    """The line with a share of the samples below it: that with the least sum of tilted distances.

    Koenker and Bassett, Regression quantiles, Econometrica 46 (1978): a linear program, solved here as its dual, whose
    bounds are 1 for each sample and whose only rows are the two parts of the line, neither of which is negative.

    Parameters
    ----------
    samples
        the samples in ns by their size.
    share
        from 0 to 1.
    """
    with needed_for("--method quantile", "sensitivity"):
        from scipy.optimize import linprog

    sizes, times, weights = _weighted(samples)
    scale_size, scale_time = max(sizes.max(), 1.0), max(times.max(), 1.0)
    tau = float(share)
    bounds = np.column_stack([-(1 - tau) * weights, tau * weights])
    rows = np.vstack([np.ones_like(sizes), sizes / scale_size])
    limit = in_force()
    timed = {} if limit.deadline is None else {"time_limit": max(limit.left_s, A_MOMENT_S)}
    solved = linprog(-times / scale_time, A_ub=rows, b_ub=[0.0, 0.0], bounds=bounds, method="highs", options=timed)
    look_at_the_clock()
    assert solved.status == 0, solved.message  # always feasible (all zero) and bounded
    fixed, slope = (max(0.0, -float(value)) for value in solved.ineqlin.marginals)
    return LinearModel(Fraction(fixed * scale_time), Fraction(slope * scale_time / scale_size))


def _weighted(samples: Iterable[tuple[int, Floats]]) -> tuple[Floats, Floats, Floats]:
    """Sizes, times and how often each pair was measured."""
    columns: list[Floats] = []
    for size, times in samples:
        values, counts = np.unique(times, return_counts=True)
        columns.append(np.vstack([np.full(len(values), float(size)), values, counts]))
    sizes, times, weights = np.hstack(columns)
    return sizes, times, weights
