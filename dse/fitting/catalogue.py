"""What was fitted as a catalogue that problem files include, each figure with its source."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dse.fitting.fit import Execution, Fit, Transport, executions_by_name
from dse.spec.loading.writing import block_text
from dse.support.units import TimeRange, format_duration, format_size_range, format_time_range
from dse.support.units.parse import whole

HEAD = "# Figures from measurements; the greatest of what was measured is no bound of what can happen.\n"
SAMPLES = "samples"


def catalogue_text(fit: Fit, samples_file: str | None = None) -> str:
    """The catalogue as YAML; remarks on a figure stand before it.

    Parameters
    ----------
    fit
        what was fitted.
    samples_file
        the name of the file that `samples_table` writes, for the uncertainty of execution times; None: their mean and
        deviation are stated instead.
    """
    data = catalogue(fit, samples_file)
    return HEAD + "".join(f"# {line}\n" for line in remark_lines(fit)) + "\n" + block_text(data)


def catalogue(fit: Fit, samples_file: str | None = None) -> dict[str, Any]:
    """The same as plain data, without the remarks."""
    data: dict[str, Any] = {}
    limits = _limits(fit)
    if limits:
        data["assumptions"] = limits
    if fit.transports:
        data["bus_types"] = _bus_types(fit)
    if fit.executions:
        data["thread_types"] = _thread_types(fit)
        uncertain = dict(_uncertainty(fit, samples_file))
        if uncertain:
            data["uncertainty"] = uncertain
    return data


def remark_lines(fit: Fit) -> Iterator[str]:
    """What is to be said, each with what it is about."""
    for item in fit.transports:
        yield from (f"{_where(item)}: {remark.text}" for remark in item.remarks if remark.kind != "sample maximum")
    for one in fit.executions:
        yield from (f"{_where(one)}: {remark.text}" for remark in one.remarks if remark.kind != "sample maximum")


def _where(item: Transport | Execution) -> str:
    name = item.transport if isinstance(item, Transport) else item.name
    return " on ".join(part for part in (name, item.platform) if part)


def _limits(fit: Fit) -> list[str]:
    """Sizes to stay at or below, where the spread of the samples jumps, and sizes that the figures are not for."""
    beyond = {"spread": "the measured times spread much further", "left out": "what was measured was left out"}
    found = []
    for item in fit.transports:
        for remark in item.remarks:
            if remark.limit_bytes is not None:
                limit = f"messages of at most {remark.limit_bytes} B (beyond, {beyond[remark.kind]})"
                found.append(f"{_where(item)}: {limit}")
            elif remark.kind == "left out":
                found.append(f"{_where(item)}: {remark.text}")
    return found


def _source(fit: Fit) -> str:
    files = ", ".join(Path(file).name for file in fit.files)
    if fit.executions:
        return f"measured ({files}): least and greatest sample"
    how = {
        "ols": "least squares of minima and maxima",
        "envelope": "closest lines that nothing measured lies beyond",
        "quantile": "lines of the {} and {} quantiles",
    }[fit.method]
    if fit.quantiles:
        how = how.format(*(f"{float(share) * 100:g} %" for share in fit.quantiles))
    return f"fitted to {files}: {how}" + (", half of round trips" if fit.is_round_trip else "")


def _bus_types(fit: Fit) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for item in fit.transports:
        parts = {
            "fixed": format_time_range(TimeRange(*map(whole, item.fixed_ns))),
            "per_byte": format_time_range(TimeRange(*map(whole, item.per_byte_ns))),
            "sizes": format_size_range(item.sizes_bytes),
        }
        entry = found.setdefault(item.transport, {})
        if item.platform:
            entry["virtual"] = True
            entry.setdefault("transmission_time", {})[item.platform] = parts
        else:
            entry["transmission_time"] = parts
        entry["source"] = entry.pop("source", _source(fit))
    return found


def _thread_types(fit: Fit) -> dict[str, Any]:
    found = {}
    for name, items in executions_by_name(fit.executions).items():
        ranges = {item.platform: _range(item) for item in items}
        times = ranges.get("", ranges)
        singles = [item.platform or name for item in items if item.summary.is_single]
        source = _source(fit) + (f"; a single sample on {', '.join(singles)}" if singles else "")
        found[name] = {"compute_execution_time": times, "source": source}
    return found


def _range(item: Execution) -> str:
    return format_time_range(TimeRange(whole(item.summary.min_ns), whole(item.summary.max_ns)))


def _uncertainty(fit: Fit, samples_file: str | None) -> Iterator[tuple[str, dict[str, str]]]:
    """What each longest execution time may be instead: the samples, or a normal distribution cut to their range."""
    for item in fit.executions:
        found = item.summary
        if found.is_single or found.min_ns == found.max_ns:
            continue
        path = ".".join(part for part in ("thread_types", item.name, "compute_execution_time", item.platform) if part)
        if samples_file is not None and len(found.samples_ns):
            yield f"{path}.max", {SAMPLES: samples_file, "column": column_name(item), "unit": "ns"}
        elif found.mean_ns is not None and found.deviation_ns:
            yield (
                f"{path}.max",
                {
                    "distribution": "normal",
                    "mean": _rounded(float(found.mean_ns)),
                    "deviation": _rounded(float(found.deviation_ns)),
                    "range": _range(item),
                },
            )


def _rounded(value_ns: float) -> str:
    return format_duration(max(1, round(value_ns)))


def column_name(item: Execution) -> str:
    """The column of the samples of a thread on a platform."""
    return " on ".join(part for part in (item.name, item.platform) if part)


def samples_table(fit: Fit) -> str:
    """The samples of execution times in ns as CSV: a column for each thread and platform, shorter ones end early."""
    import csv
    import io

    with_samples = [item for item in fit.executions if len(item.summary.samples_ns)]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([column_name(item) for item in with_samples])
    longest = max((len(item.summary.samples_ns) for item in with_samples), default=0)
    for row in range(longest):
        cells = [item.summary.samples_ns[row : row + 1] for item in with_samples]
        writer.writerow([format(cell[0], ".15g") if len(cell) else "" for cell in cells])
    return stream.getvalue()
