"""Extreme-value fits beside a sample maximum: block maxima (GEV) and peaks over a threshold (GPD), each with a test.

They are extrapolations under assumptions (samples that do not depend on each other, all under the same conditions, one
of three limit distributions), and no bounds: what was not seen because it cannot have happened in the measurement is
not in them. Coles, An Introduction to Statistical Modeling of Extreme Values (2001), chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

import numpy as np

from dse.fitting.lines import Floats
from dse.support.extras import needed_for
from dse.support.json_fields import Json

FEWEST = 400
"""Samples below which nothing is fitted: a tail of some ten values says nothing."""
BLOCKS = 50
"""Block maxima that are looked for; blocks are as long as that allows."""
TAIL = 0.05
"""The share of the samples that counts as the tail."""
POOR = 0.05
"""A fit with a smaller p-value is rejected."""
Model: TypeAlias = Literal["block maxima (GEV)", "peaks over threshold (GPD)"]


@dataclass(frozen=True)
class Tail:
    """An extreme-value fit beside a sample maximum: an extrapolation, no bound.

    For the test of `p_value` the model is fitted to every other value.
    """

    JSON_NAME = "FittedTail"
    WRITTEN = (
        *("size_bytes", "model", "shape", "location_ns", "scale_ns", "level_ns", "one_in", "values"),
        *("p_value", "lag_1"),
    )

    model: Annotated[Model, "`block maxima (GEV)` or `peaks over threshold (GPD)`.", Json(kind=str)]
    shape: Annotated[float, "The shape; above 0 the tail has no end."]
    location_ns: Annotated[float, "The location, or the threshold."]
    scale_ns: Annotated[float, "The scale."]
    level_ns: Annotated[float, "What one sample in `one_in` exceeds, if the model holds."]
    one_in: Annotated[int, "One sample in so many."]
    values: Annotated[int, "How many block maxima or values beyond the threshold were fitted."]
    p_value: Annotated[float, "Of a Kolmogorov-Smirnov test of the half that was left out of a fit for it."]
    lag_1: Annotated[float, "The correlation of samples that follow each other; the models assume none."]
    size_bytes: Annotated[int | None, "The size of the messages; null for execution times."] = None

    @property
    def is_rejected(self) -> bool:
        """Whether the test says that the values are no sample of the model.

        Then the fit is shown, and said to be unusable.
        """
        return self.p_value < POOR


def tails(samples_ns: Floats, one_in: int) -> list[Tail]:
    """Both fits of some samples, in the order in which they were measured; nothing where there are too few.

    What cannot be fitted (a handful of distinct values) is left out.
    """
    with needed_for("--extremes", "sensitivity"):
        from scipy import stats

    if len(samples_ns) < FEWEST or samples_ns.min() == samples_ns.max():
        return []
    lag = float(np.corrcoef(samples_ns[:-1], samples_ns[1:])[0, 1])
    unit = float(np.median(samples_ns)) or 1.0
    scaled = samples_ns / unit
    fitted = []
    block = len(scaled) // BLOCKS
    maxima = scaled[: block * BLOCKS].reshape(BLOCKS, block).max(axis=1)
    if len(np.unique(maxima)) > 5:
        share = -np.expm1(block * np.log1p(-1 / one_in))
        fit = stats.genextreme.fit(maxima)
        half = stats.genextreme.fit(maxima[::2])
        p_value = stats.kstest(maxima[1::2], stats.genextreme(*half).cdf).pvalue
        level = stats.genextreme.isf(share, *fit)
        place = (-fit[0], fit[1] * unit, fit[2] * unit, level * unit)  # the sign of the shape as the literature has it
        fitted.append(_tail("block maxima (GEV)", place, (one_in, BLOCKS), float(p_value), lag))
    threshold = float(np.quantile(scaled, 1 - TAIL))
    excess = scaled[scaled > threshold] - threshold
    if len(np.unique(excess)) > 5:
        share = 1 / one_in / (len(excess) / len(scaled))
        shape, _, scale = stats.genpareto.fit(excess, floc=0)
        half = stats.genpareto.fit(excess[::2], floc=0)
        p_value = stats.kstest(excess[1::2], stats.genpareto(*half).cdf).pvalue
        level = threshold + stats.genpareto.isf(min(share, 1.0), shape, 0, scale)
        place = (shape, threshold * unit, scale * unit, level * unit)
        fitted.append(_tail("peaks over threshold (GPD)", place, (one_in, len(excess)), float(p_value), lag))
    return fitted


def _tail(model: Model, place: Sequence[float], counts: tuple[int, int], p_value: float, lag: float) -> Tail:
    shape, location, scale, level = (float(value) for value in place)
    return Tail(model, shape, location, scale, level, *counts, p_value, lag)
