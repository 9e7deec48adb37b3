"""Sets of objective vectors, all minimised: which are non-dominated, and how far one set is from another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Vector = tuple[int, ...]


def non_dominated(rows: Any) -> Any:
    """The distinct non-dominated rows, sorted."""
    left = np.unique(np.asarray(rows), axis=0)
    left = left[np.lexsort((*left.T[::-1], left.astype(float).sum(axis=1)))]
    kept = []
    while len(left):
        point = left[0]
        kept.append(point)
        left = left[np.any(left < point, axis=1)]
    return np.unique(np.array(kept), axis=0) if kept else left


def hypervolume(front: Sequence[Vector], true_front: Sequence[Vector]) -> float | None:
    """The share of the true front's hypervolume that `front` covers.

    Objectives are scaled to the true front's ideal and nadir point; the reference point is 10 % of the range beyond the
    nadir.
    """
    try:
        import moocore
    except ImportError:
        return None
    if len(front) == 0:
        return 0.0
    true = np.array(true_front, dtype=float)
    ideal, nadir = true.min(axis=0), true.max(axis=0)
    span = np.where(nadir > ideal, nadir - ideal, 1.0)
    reference = np.full(true.shape[1], 1.1)
    own = (np.array(front, dtype=float) - ideal) / span
    return float(moocore.hypervolume(own, ref=reference) / moocore.hypervolume((true - ideal) / span, ref=reference))


def certified_gap(points: Sequence[Vector], floors: Sequence[Vector]) -> float | None:
    """How far the found front can be from the true one, as a share of each objective's range: the additive epsilon.

    Whatever the open regions hold is nowhere below their floors, so each of them is compared with the found point that
    is closest to dominating its floor. An objective's range is from the least floor or point to the worst found point:
    while few points are known, their own range would be no measure. None when there are no points to compare with.
    """
    if not floors:
        return 0.0
    if not points:
        return None
    found, low = np.array(points, dtype=float), np.array(floors, dtype=float)
    span = found.max(axis=0) - np.minimum(found.min(axis=0), low.min(axis=0))
    span = np.where(span > 0, span, 1.0)
    gaps = ((found[None, :, :] - low[:, None, :]) / span).max(axis=2).min(axis=1)
    return float(max(0.0, gaps.max()))
