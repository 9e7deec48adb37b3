"""Fitted figures as a frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dse.fitting.fit import Fit
from dse.results.display import exact
from dse.results.frames import unit_frame

if TYPE_CHECKING:
    import pandas


def fit_frame(fit: Fit, units: str | Sequence[str] | None) -> pandas.DataFrame:
    """A row for each transport, or thread, on each platform: see `Fit.frame`."""
    slopes = ("per byte least", "per byte most")
    times = ("fixed least", "fixed most", *slopes)
    rows: list[Mapping[str, Any]] = []
    for line in fit.transports:
        sizes = {"from": line.sizes_bytes.min_bytes, "to": line.sizes_bytes.max_bytes}
        figures = dict(zip(times, map(exact, (*line.fixed_ns, *line.per_byte_ns)), strict=True))
        rows.append({"name": line.transport, "platform": line.platform, **sizes, **figures})
    for item in fit.executions:
        ends = {"least": exact(item.summary.min_ns), "most": exact(item.summary.max_ns)}
        rows.append({"name": item.name, "platform": item.platform, **ends, "count": item.summary.count})
    own = ("from", "to", *times) if fit.transports else ("least", "most", "count")
    counted = {"from": "B", "to": "B"} | dict.fromkeys((*times, "least", "most"), "ns")
    counted |= dict.fromkeys(slopes, "ns/B")
    return unit_frame(["name", "platform", *own], rows, counted, units)
