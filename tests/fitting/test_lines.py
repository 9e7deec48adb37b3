"""Lines through measurements: the report's table, and independent fits of the same data."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog, nnls
from scipy.stats import f as f_distribution
from scipy.stats import siegelslopes

import dse
from dse.fitting.fitted import Transport
from dse.fitting.judging import repeated_medians
from dse.fitting.lines import LinearModel, envelope, least_squares, quantile_line
from tests.helpers.effort import cases
from tests.helpers.small import TABLES

PRINTED = {"RT101": (87, 529, 95, 1115), "Spectra": (7, 113, 10, 295)}
"""Table 5.6: ns per byte and us fixed, of the minimum and of the maximum."""
TOLERANCE = {"RT101": (Fraction("1.1"), 28), "Spectra": (Fraction("0.6"), 3)}
"""What the rounding of the printed cells of Table 5.3 leaves open."""


def table_5_3(**more: Any) -> dict[str, Transport]:
    """The report's round trips between two nodes."""
    return {item.platform: item for item in dse.fit(TABLES / "table_5_3.csv", round_trip=True, **more).transports}


@pytest.mark.parametrize("platform", PRINTED)
def test_table_5_6_follows_from_table_5_3(platform: str) -> None:
    found = table_5_3()[platform]
    slope_low, fixed_low, slope_high, fixed_high = PRINTED[platform]
    slope, fixed = TOLERANCE[platform]
    assert abs(found.low.per_byte_ns - slope_low) <= slope and abs(found.high.per_byte_ns - slope_high) <= slope
    assert abs(found.low.fixed_ns / 1000 - fixed_low) <= fixed and abs(found.high.fixed_ns / 1000 - fixed_high) <= fixed


def test_least_squares_are_those_of_numpy() -> None:
    for item in table_5_3().values():
        for line, ends in ((item.low, "min_ns"), (item.high, "max_ns")):
            sizes = [one.size_bytes or 0 for one in item.summaries]
            slope, fixed = np.polyfit(sizes, [float(getattr(one, ends)) for one in item.summaries], 1)
            assert (float(line.per_byte_ns), float(line.fixed_ns)) == pytest.approx((slope, fixed))


def drawn(seed: int) -> list[tuple[int, Fraction]]:
    """Some sizes with times, of every slope."""
    source = random.Random(seed)
    sizes = sorted(source.sample(range(source.choice([5, 50, 5000])), source.randint(2, 5)))
    tilt = source.choice([-3, 0, 1, 20])
    return [(size, Fraction(max(0, source.randint(0, 90) + tilt * size + source.choice([0, -60])))) for size in sizes]


@pytest.mark.parametrize("seed", cases(60))
def test_no_part_is_negative_and_no_better_line_has_none(seed: int) -> None:
    """Against scipy: non-negative least squares, and the linear program of the envelope."""
    points = drawn(seed)
    sizes, times = np.array([float(x) for x, _ in points]), np.array([float(y) for _, y in points])
    matrix = np.column_stack([np.ones_like(sizes), sizes])
    line = least_squares(points)
    assert line.fixed_ns >= 0 <= line.per_byte_ns
    _, norm = nnls(matrix, times)
    assert sum(float(y - line.at(x)) ** 2 for x, y in points) == pytest.approx(norm**2, abs=1e-6, rel=1e-6)
    for upper, sign in ((True, 1), (False, -1)):
        line = envelope(points, upper=upper)
        assert line.fixed_ns >= 0 <= line.per_byte_ns
        assert all(sign * (line.at(x) - y) >= 0 for x, y in points)
        best = linprog(sign * matrix.sum(axis=0), A_ub=-sign * matrix, b_ub=-sign * times, bounds=[(0, None)] * 2)
        assert sign * float(sum(line.at(x) for x, _ in points)) == pytest.approx(best.fun, rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("seed", cases(8))
def test_quantile_lines_have_the_least_tilted_distance(seed: int) -> None:
    """Against the primal program, sample by sample."""
    source = np.random.default_rng(seed)
    samples = [(size, 50 + 3 * size + source.exponential(20, 15).round()) for size in (0, 3, 10)]
    share = [0.05, 0.5, 0.9][seed % 3]
    line = quantile_line(samples, Fraction(share))
    sizes = np.concatenate([np.full(len(times), float(size)) for size, times in samples])
    times = np.concatenate([times for _, times in samples])
    count = len(times)
    costs = np.concatenate([[0, 0], np.full(count, share), np.full(count, 1 - share)])
    rows = np.hstack([np.ones((count, 1)), sizes[:, None], np.eye(count), -np.eye(count)])
    best = linprog(costs, A_eq=rows, b_eq=times, bounds=[(0, None)] * len(costs)).fun
    rest = times - (float(line.fixed_ns) + float(line.per_byte_ns) * sizes)
    assert np.where(rest > 0, share * rest, (share - 1) * rest).sum() == pytest.approx(best)


def test_a_line_remembers_what_it_would_be_with_negative_parts() -> None:
    points = [(1, Fraction(0)), (2, Fraction(6)), (3, Fraction(12))]
    assert least_squares(points) == LinearModel(Fraction(0), Fraction(24, 7), (Fraction(-6), Fraction(6)))
    assert envelope(points, upper=True) == LinearModel(Fraction(0), Fraction(4), (Fraction(-6), Fraction(6)))
    falling = [(1, Fraction(9)), (2, Fraction(5))]
    assert envelope(falling, upper=True) == LinearModel(Fraction(9), Fraction(0), (Fraction(13), Fraction(-4)))


def test_the_envelope_of_the_report_covers_every_cell_also_when_rounded(tmp_path: Path) -> None:
    for item in table_5_3(method="envelope").values():
        assert (item.low_fit.beyond, item.high_fit.beyond) == (0, 0)
        for one in item.summaries:
            assert item.fixed_ns[0] + item.per_byte_ns[0] * (one.size_bytes or 0) <= one.min_ns
            assert item.fixed_ns[1] + item.per_byte_ns[1] * (one.size_bytes or 0) >= one.max_ns


def test_the_robust_line_and_the_tail_of_f_are_those_of_scipy() -> None:
    source = np.random.default_rng(1)
    x, y = np.arange(9.0), source.normal(0, 1, 9)
    assert repeated_medians(x, y) == pytest.approx(tuple(siegelslopes(y, x))[:2])
    assert pytest.approx(f_distribution.sf(7.5, 2, 9)) == (1 + 2 * 7.5 / 9) ** (-9 / 2)
