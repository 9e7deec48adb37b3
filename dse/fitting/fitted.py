"""The answer of `dse fit`: lines and ranges, as a catalogue that problem files include and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from dse.answers.base import Answer
from dse.answers.tables.display import exact
from dse.answers.tables.frames import unit_frame
from dse.fitting.extremes import Tail
from dse.fitting.judging import Goodness, Remark
from dse.fitting.lines import LinearModel, Method
from dse.fitting.measurements import Summary
from dse.spec.loading.writing import block_text
from dse.support.json_fields import Json, Of
from dse.support.units import TimeRange, format_duration, format_size_range, format_time_range
from dse.support.units.parse import whole
from dse.support.units.table import SizeRange

if TYPE_CHECKING:
    import pandas

HEAD = "# Figures from measurements; the greatest of what was measured is no bound of what can happen.\n"
SAMPLES = "samples"


@dataclass(frozen=True)
class FittedLine:
    """A line through the minima or maxima of the sizes, as the method gives it, and how well it fits.

    Times in ns, sizes in bytes.
    """

    WRITTEN = (
        *("line.fixed_ns", "line.per_byte_ns"),
        *("fit.r_squared", "fit.rms_ns", "fit.beyond", "fit.most_beyond_ns", "fit.at_bytes"),
    )

    line: LinearModel
    fit: Goodness


@dataclass(frozen=True)
class Transport:
    """A transport on a platform.

    Times in ns; `low_fit` and `high_fit` say how many samples lie beyond the two lines.
    """

    JSON_NAME = "FittedTransport"
    WRITTEN = (
        *("transport", "platform", "fixed_ns", "per_byte_ns"),
        Of("sizes_bytes", kind=tuple[int, ...]),
        Of("low_line", key="low"),
        Of("high_line", key="high"),
        *("summaries", "left_out", "remarks", "tails"),
    )

    transport: Annotated[str, "Its name: of the bus type."]
    platform: Annotated[str, "The processor type; empty where the files do not say it."]
    summaries: Annotated[tuple[Summary, ...], "What was fitted, by size.", Json("sizes")]
    left_out: Annotated[tuple[int, ...], "Sizes that were not used."]
    low: LinearModel
    high: LinearModel
    low_fit: Goodness
    high_fit: Goodness
    fixed_ns: Annotated[
        tuple[Fraction, Fraction],
        "Least and greatest fixed time, rounded outwards, as the catalogue has them.",
        Json(kind=tuple[Fraction, ...]),
    ]
    per_byte_ns: Annotated[
        tuple[Fraction, Fraction],
        "Least and greatest time per byte, rounded outwards, as the catalogue has them.",
        Json(kind=tuple[Fraction, ...]),
    ]
    remarks: Annotated[tuple[Remark, ...], "Remarks on the fit."]
    tails: Annotated[tuple[Tail, ...], "Extreme-value fits, where they were asked for."] = ()

    @property
    def low_line(self) -> FittedLine:
        """The line of the least times."""
        return FittedLine(self.low, self.low_fit)

    @property
    def high_line(self) -> FittedLine:
        """The line of the greatest times."""
        return FittedLine(self.high, self.high_fit)

    @property
    def where(self) -> str:
        """The transport and the platform of the measurements.

        ``TRANSPORT on PLATFORM``, or what there is of it.
        """
        return " on ".join(part for part in (self.transport, self.platform) if part)

    @property
    def sizes_bytes(self) -> SizeRange:
        """From and to which size of messages they hold, as the catalogue has it.

        These are the sizes that were measured and used, up to where a remark says to stay; they end below sizes between
        that were left out.
        """
        used = [item.size_bytes or 0 for item in self.summaries]
        limits = [remark.limit_bytes for remark in self.remarks if remark.limit_bytes is not None]
        first = min((size for size in self.left_out if size > min(used)), default=max(used) + 1)
        return SizeRange(min(used), min([max(size for size in used if size < first), *limits]))


@dataclass(frozen=True)
class Execution:
    """The execution times of a callback on a platform.

    Times in ns, one platform each.
    """

    JSON_NAME = "FittedExecution"
    WRITTEN = (
        *("name", "platform", "summary"),
        Of("summary.is_single", "Whether there is only one.", key="is_single_sample"),
        *("remarks", "tails"),
    )

    name: Annotated[str, "The thread type."]
    platform: Annotated[str, "The processor type; empty where the files do not say it."]
    summary: Annotated[Summary, "Its samples in a few figures.", Json("measured")]
    remarks: Annotated[tuple[Remark, ...], "Remarks on the fit."]
    tails: Annotated[tuple[Tail, ...], "Extreme-value fits, where they were asked for."] = ()

    @property
    def where(self) -> str:
        """The transport and the platform of the measurements."""
        return " on ".join(part for part in (self.name, self.platform) if part)


@dataclass(frozen=True, repr=False)
class Fit(Answer):
    """The outcome of `dse fit`: figures of a problem file from measurements.

    Examples
    --------
    >>> import dse
    >>> found = dse.fit("delays.csv", round_trip=True)
    >>> found.transports[0].summaries[0].max_ns
    Fraction(10000, 1)
    >>> print(found.to_yaml().splitlines()[-3].strip())
    per_byte: "10 ns .. 25 ns"
    """

    FORMAT = "fit"
    WRITTEN = (
        *("files", "method", "quantiles", "is_round_trip", "transports", "executions", "unused"),
        "catalogue",
    )

    files: Annotated[tuple[str, ...], "The files of measurements, as they were given."]
    method: Annotated[Method, "How lines are drawn."]
    quantiles: Annotated[
        tuple[Fraction, Fraction] | None,
        "The shares below the lower and the upper line; null for other methods.",
        Json(kind=tuple[Fraction, ...] | None),
    ]
    is_round_trip: Annotated[bool, "Whether times were halved.", Json("round_trip")]
    transports: Annotated[tuple[Transport, ...], "Transmission times, by transport and platform."] = ()
    executions: Annotated[tuple[Execution, ...], "Execution times, by thread and platform."] = ()
    unused: Annotated[tuple[str, ...], "Columns that say nothing for this.", Json("unused_columns")] = ()

    @property
    def catalogue(self) -> str:
        """The catalogue, as YAML."""
        return self.to_yaml()

    def to_yaml(self, samples_file: str | None = None) -> str:
        """The catalogue: a file that problem files include; see `_catalogue_text`.

        YAML text with remarks as comments; `samples_file` is the CSV that uncertainties refer to.
        """
        return _catalogue_text(self, samples_file)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each transport, or thread, on each platform.

        Columns: ``name``, ``platform``; of a transport ``from [B]`` and ``to [B]`` (the sizes that it holds for),
        ``fixed least [ms]``, ``fixed most [ms]``, ``per byte least [ns/B]`` and ``per byte most [ns/B]``, as they go
        into a problem file; of a thread ``least [ms]``, ``most [ms]`` and ``count``, missing where no file says it.
        `units` as for `Result.frame`.
        """
        return _fit_frame(self, units)


def _executions_by_name(executions: Sequence[Execution]) -> dict[str, list[Execution]]:
    """The platforms of each thread type, in the order of the files."""
    order = {name: number for number, name in enumerate(dict.fromkeys(item.name for item in executions))}
    ordered = sorted(executions, key=lambda item: order[item.name])
    return {name: list(items) for name, items in groupby(ordered, key=lambda item: item.name)}


# The catalogue.


def _catalogue_text(fit: Fit, samples_file: str | None = None) -> str:
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
    return HEAD + "".join(f"# {line}\n" for line in _remark_lines(fit)) + "\n" + block_text(data)


def catalogue(fit: Fit, samples_file: str | None = None) -> dict[str, Any]:
    """The catalogue as plain data, without remarks.

    Sections `assumptions`, `bus_types`, `thread_types` and `uncertainty`, as far as there is something to say.
    """
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


def _remark_lines(fit: Fit) -> Iterator[str]:
    """The remarks on figures, each headed by its transport or thread and the platform."""
    measured: tuple[Transport | Execution, ...] = (*fit.transports, *fit.executions)
    for item in measured:
        yield from (f"{item.where}: {remark.text}" for remark in item.remarks if remark.kind != "sample maximum")


def _limits(fit: Fit) -> list[str]:
    """Sizes to stay at or below, where the spread of the samples jumps, and sizes that the figures are not for."""
    beyond = {"spread": "the measured times spread much further", "left out": "what was measured was left out"}
    limits = []
    for item in fit.transports:
        for remark in item.remarks:
            if remark.limit_bytes is not None:
                limit = f"messages of at most {remark.limit_bytes} B (beyond, {beyond[remark.kind]})"
                limits.append(f"{item.where}: {limit}")
            elif remark.kind == "left out":
                limits.append(f"{item.where}: {remark.text}")
    return limits


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
    types: dict[str, Any] = {}
    for item in fit.transports:
        parts = {
            "fixed": format_time_range(TimeRange(*map(whole, item.fixed_ns))),
            "per_byte": format_time_range(TimeRange(*map(whole, item.per_byte_ns))),
            "sizes": format_size_range(item.sizes_bytes),
        }
        entry = types.setdefault(item.transport, {})
        if item.platform:
            entry["virtual"] = True
            entry.setdefault("transmission_time", {})[item.platform] = parts
        else:
            entry["transmission_time"] = parts
        entry["source"] = entry.pop("source", _source(fit))
    return types


def _thread_types(fit: Fit) -> dict[str, Any]:
    types = {}
    for name, items in _executions_by_name(fit.executions).items():
        ranges = {item.platform: _range(item) for item in items}
        times = ranges.get("", ranges)
        singles = [item.platform or name for item in items if item.summary.is_single]
        source = _source(fit) + (f"; a single sample on {', '.join(singles)}" if singles else "")
        types[name] = {"compute_execution_time": times, "source": source}
    return types


def _range(item: Execution) -> str:
    return format_time_range(TimeRange(whole(item.summary.min_ns), whole(item.summary.max_ns)))


def _uncertainty(fit: Fit, samples_file: str | None) -> Iterator[tuple[str, dict[str, str]]]:
    """The uncertainty of each longest execution time: the samples, or a normal distribution cut to their range."""
    for item in fit.executions:
        summary = item.summary
        if summary.is_single or summary.min_ns == summary.max_ns:
            continue
        path = ".".join(part for part in ("thread_types", item.name, "compute_execution_time", item.platform) if part)
        if samples_file is not None and len(summary.samples_ns):
            yield f"{path}.max", {SAMPLES: samples_file, "column": item.where, "unit": "ns"}
        elif summary.mean_ns is not None and summary.deviation_ns:
            yield (
                f"{path}.max",
                {
                    "distribution": "normal",
                    "mean": _rounded(float(summary.mean_ns)),
                    "deviation": _rounded(float(summary.deviation_ns)),
                    "range": _range(item),
                },
            )


def _rounded(value_ns: float) -> str:
    return format_duration(max(1, round(value_ns)))


def samples_table(fit: Fit) -> str:
    """The samples of execution times in ns as CSV: a column for each thread and platform, shorter ones end early."""
    import csv
    import io

    with_samples = [item for item in fit.executions if len(item.summary.samples_ns)]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([item.where for item in with_samples])
    longest = max((len(item.summary.samples_ns) for item in with_samples), default=0)
    for row in range(longest):
        cells = [item.summary.samples_ns[row : row + 1] for item in with_samples]
        writer.writerow([format(cell[0], ".15g") if len(cell) else "" for cell in cells])
    return stream.getvalue()


# Fitted figures as a frame.


def _fit_frame(fit: Fit, units: str | Sequence[str] | None) -> pandas.DataFrame:
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
