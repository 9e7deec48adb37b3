"""What was fitted as plain data: ``dse-fit/1``."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from dse.fitting.catalogue import catalogue_text
from dse.fitting.extremes import Tail
from dse.fitting.fit import Execution, Fit, Transport
from dse.fitting.judging import Goodness, Remark
from dse.fitting.lines import Line
from dse.fitting.measurements import Summary
from dse.results.display import exact

FORMAT = "dse-fit/1"


def fit_data(fit: Fit) -> dict[str, Any]:
    """The fit in the form ``dse-fit/1``, its catalogue included."""
    return {
        "format": FORMAT,
        "files": list(fit.files),
        "method": fit.method,
        "quantiles": None if fit.quantiles is None else [exact(share) for share in fit.quantiles],
        "round_trip": fit.is_round_trip,
        "transports": [_transport(item) for item in fit.transports],
        "executions": [_execution(item) for item in fit.executions],
        "unused_columns": list(fit.unused),
        "catalogue": catalogue_text(fit),
    }


def _transport(item: Transport) -> dict[str, Any]:
    return {
        "transport": item.transport,
        "platform": item.platform,
        "fixed_ns": [exact(value) for value in item.fixed_ns],
        "per_byte_ns": [exact(value) for value in item.per_byte_ns],
        "low": _line(item.low, item.low_fit),
        "high": _line(item.high, item.high_fit),
        "sizes": [_measured(found) for found in item.summaries],
        "left_out": list(item.left_out),
        "remarks": _remarks(item.remarks),
        "tails": [_tail(tail, size) for size, tail in item.tails],
    }


def _execution(item: Execution) -> dict[str, Any]:
    return {
        "name": item.name,
        "platform": item.platform,
        "measured": _measured(item.summary),
        "is_single_sample": item.summary.is_single,
        "remarks": _remarks(item.remarks),
        "tails": [_tail(tail, None) for tail in item.tails],
    }


def _line(line: Line, fit: Goodness) -> dict[str, Any]:
    return {
        "fixed_ns": exact(line.fixed_ns),
        "per_byte_ns": exact(line.per_byte_ns),
        "r_squared": fit.r_squared,
        "rms_ns": fit.rms_ns,
        "beyond": fit.beyond,
        "most_beyond_ns": exact(fit.most_beyond_ns),
        "at_bytes": fit.at_bytes,
    }


def _measured(found: Summary) -> dict[str, Any]:
    def number(value: Fraction | None) -> float | None:
        return None if value is None else float(value)

    return {
        "size_bytes": found.size_bytes,
        "min_ns": exact(found.min_ns),
        "max_ns": exact(found.max_ns),
        "mean_ns": number(found.mean_ns),
        "median_ns": number(found.median_ns),
        "deviation_ns": number(found.deviation_ns),
        "count": found.count,
    }


def _remarks(remarks: Sequence[Remark]) -> list[dict[str, Any]]:
    return [{"kind": item.kind, "text": item.text, "limit_bytes": item.limit_bytes} for item in remarks]


def _tail(tail: Tail, size: int | None) -> dict[str, Any]:
    return {
        "size_bytes": size,
        "model": tail.model,
        "shape": tail.shape,
        "location_ns": tail.location_ns,
        "scale_ns": tail.scale_ns,
        "level_ns": tail.level_ns,
        "one_in": tail.one_in,
        "values": tail.values,
        "p_value": tail.p_value,
        "lag_1": tail.lag_1,
    }
