"""Measurements to figures: a line for each transport and platform, a range for each thread, and what is to be said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

from dse.answers.base import Answer
from dse.answers.tables.display import exact
from dse.answers.tables.frames import unit_frame
from dse.fitting.extremes import Tail, tails
from dse.fitting.judging import (
    Goodness,
    Remark,
    bend,
    goodness,
    left_out_remarks,
    resolution_remark,
    saturated_remarks,
    spread_remarks,
)
from dse.fitting.lines import (
    Line,
    Method,
    Points,
    below_upper,
    envelope,
    least_squares,
    lower_envelope_parts,
    quantile_line,
    quantile_parts,
    squares_parts,
)
from dse.fitting.measurements import Group, Measurements, Summary, read_measurements
from dse.support.errors import Diagnostic, ProblemError, UsageError
from dse.support.json_fields import Json, Of
from dse.support.timelimit import in_time
from dse.support.units import format_duration
from dse.support.units.parse import round_to_int
from dse.support.units.table import Rounding, SizeRange

if TYPE_CHECKING:
    import pandas

DIGITS = 4
"""Figures are rounded outwards to so many digits: minima down, maxima up."""
OFF = Fraction(1, 4)
"""A line that is off by so much of a time does not fit."""
Sizes = tuple[int, int]
"""From and to, both included, in bytes."""


@dataclass(frozen=True)
class FittedLine:
    """A line through the minima or maxima of the sizes, as the method gives it, and how well it fits."""

    WRITTEN = (
        *("line.fixed_ns", "line.per_byte_ns"),
        *("fit.r_squared", "fit.rms_ns", "fit.beyond", "fit.most_beyond_ns", "fit.at_bytes"),
    )

    line: Line
    fit: Goodness


@dataclass(frozen=True)
class Transport:
    """A transport on a platform."""

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
    low: Line
    high: Line
    low_fit: Goodness
    high_fit: Goodness
    fixed_ns: Annotated[
        tuple[Fraction, Fraction],
        "Least and greatest fixed time, rounded outwards, as the catalogue has them.",
        Json(kind=tuple[Fraction, ...]),
    ]
    per_byte_ns: Annotated[
        tuple[Fraction, Fraction], "Least and greatest time per byte, likewise.", Json(kind=tuple[Fraction, ...])
    ]
    remarks: Annotated[tuple[Remark, ...], "What is to be said of it."]
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
        """What was measured, and on what."""
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
    """The execution times of a callback on a platform."""

    JSON_NAME = "FittedExecution"
    WRITTEN = (
        *("name", "platform", "summary"),
        Of("summary.is_single", "Whether there is only one.", key="is_single_sample"),
        *("remarks", "tails"),
    )

    name: Annotated[str, "The thread type."]
    platform: Annotated[str, "The processor type; empty where the files do not say it."]
    summary: Annotated[Summary, "Its samples in a few figures.", Json("measured")]
    remarks: Annotated[tuple[Remark, ...], "What is to be said of it."]
    tails: Annotated[tuple[Tail, ...], "Extreme-value fits, where they were asked for."] = ()

    @property
    def where(self) -> str:
        """What was measured, and on what."""
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
        """The catalogue: a file that problem files include; see `dse.fitting.catalogue.catalogue_text`."""
        from dse.fitting.catalogue import catalogue_text

        return catalogue_text(self, samples_file)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each transport, or thread, on each platform.

        Columns: ``name``, ``platform``; of a transport ``from [B]`` and ``to [B]`` (the sizes that it holds for),
        ``fixed least [ms]``, ``fixed most [ms]``, ``per byte least [ns/B]`` and ``per byte most [ns/B]``, as they go
        into a problem file; of a thread ``least [ms]``, ``most [ms]`` and ``count``, missing where no file says it.
        `units` as for `Result.frame`.
        """
        return fit_frame(self, units)


@dataclass(frozen=True)
class Options:
    """How measurements become figures; see `fit_measurements`."""

    method: Method = "ols"
    quantiles: tuple[Fraction, Fraction] = (Fraction(1, 100), Fraction(99, 100))
    is_round_trip: bool | None = None
    sizes: Sizes | None = None
    without: tuple[Sizes, ...] = ()
    name: str = ""
    extremes: int | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    platforms: Mapping[str, str] = field(default_factory=dict)


def fit_measurements(paths: Sequence[Path], options: Options) -> Fit:
    """Read files of measurements and make figures of them.

    Parameters
    ----------
    paths
        CSV files, see `read_measurements`.
    options
        ``method``: ``ols``, ``envelope`` or ``quantile`` (with ``quantiles``, which needs samples);
        ``is_round_trip``: halve every time (None: if a column says so); ``sizes``, ``without``: sizes in bytes to use
        or to leave out; ``name``: of the bus type where no column names the transport; ``extremes``: also fit tails, up
        to what one sample in so many exceeds; ``columns``, ``units``, ``platforms``: see `read_measurements`.

    Raises
    ------
    ProblemError
        when a file is wrong, with its line.
    UsageError
        when an option does not go with the measurements.
    """
    if options.method not in get_args(Method):
        raise UsageError(f"--method {options.method}: expected {', '.join(get_args(Method))}")
    measured = read_measurements(paths, options.columns, options.units, options.platforms)
    is_round_trip = measured.is_round_trip if options.is_round_trip is None else options.is_round_trip
    if options.method == "quantile" and not measured.has_samples:
        raise UsageError("--method quantile: needs samples, one a row; the files have figures of many samples")
    if options.extremes and not measured.has_samples:
        raise UsageError("--extremes: needs samples, one a row; the files have figures of many samples: leave it out")
    with_size = [item for item in measured.summaries if item.size_bytes is not None]
    without_size = [item for item in measured.summaries if item.size_bytes is None]
    if with_size and without_size:
        raise UsageError("some files have sizes of messages and some have not: fit them one after the other")
    found = Fit(
        files=measured.files,
        method=options.method,
        quantiles=options.quantiles if options.method == "quantile" else None,
        is_round_trip=is_round_trip,
        unused=measured.unused,
    )
    if without_size:
        if options.is_round_trip:
            raise UsageError("--round-trip: execution times are no round trips; a column with sizes is missing")
        executions = tuple(_execution(item, options) for item in in_time(without_size, every=10))
        return replace(found, is_round_trip=False, executions=executions)
    return replace(found, transports=tuple(_transports(measured, with_size, options, is_round_trip)))


def _transports(
    measured: Measurements, summaries: Sequence[Summary], options: Options, is_round_trip: bool
) -> list[Transport]:
    name = options.name or Path(measured.files[0]).stem
    groups: dict[Group, list[Summary]] = {}
    for item in summaries:
        groups.setdefault(item.group, []).append(item)
    return [
        _transport(group, group.transport or name, sorted(items, key=_size), options, is_round_trip)
        for group, items in in_time(groups.items(), every=10)
    ]


def _size(item: Summary) -> int:
    return item.size_bytes or 0


def _transport(
    group: Group, name: str, summaries: Sequence[Summary], options: Options, is_round_trip: bool
) -> Transport:
    used = [item for item in summaries if _is_used(item.size_bytes or 0, options)]
    if len(used) < 2:
        what = " on ".join(part for part in (name, group.platform) if part)
        there = f"there {'is' if used else 'are'} {len(used) or 'none'}"
        text = f"{what}: a line needs at least two sizes of messages, {there}"
        file, _, line = summaries[0].place.rpartition(":")
        raise ProblemError([Diagnostic(text, file=file, line=int(line))])
    coarse = resolution_remark(used, format_duration)
    used = [item.halved() for item in used] if is_round_trip else used
    low, high, crossed = _lines(used, options)
    lows, highs = _points(used, upper=False), _points(used, upper=True)
    remarks = [*_general(used, is_round_trip), *([coarse] if coarse else [])]
    remarks += [*_line_remarks("lower", lows, low, options), *_line_remarks("upper", highs, high, options)]
    fixed, per_byte = _figures(low, high)
    left_out = tuple(item.size_bytes or 0 for item in summaries if not _is_used(item.size_bytes or 0, options))
    remarks += [*crossed, *spread_remarks(used), *saturated_remarks(used)]
    remarks += left_out_remarks([item.size_bytes or 0 for item in used], left_out)
    found = [
        replace(tail, size_bytes=item.size_bytes or 0)
        for item in in_time(used if options.extremes else (), every=10)
        for tail in tails(item.samples_ns, options.extremes or 1)
    ]
    return Transport(
        *(name, group.platform, tuple(used)),
        left_out=left_out,
        **{"low": low, "high": high, "fixed_ns": fixed, "per_byte_ns": per_byte},  # type: ignore[arg-type]
        low_fit=goodness(lows, low, upper=False),
        high_fit=goodness(highs, high, upper=True),
        remarks=tuple(remarks),
        tails=tuple(found),
    )


def _is_used(size: int, options: Options) -> bool:
    inside = options.sizes is None or options.sizes[0] <= size <= options.sizes[1]
    return inside and not any(low <= size <= high for low, high in options.without)


def _points(summaries: Sequence[Summary], *, upper: bool) -> Points:
    return [(item.size_bytes or 0, item.max_ns if upper else item.min_ns) for item in summaries]


def _lines(used: Sequence[Summary], options: Options) -> tuple[Line, Line, list[Remark]]:
    """Both lines, the lower one with no part above that of the upper, and a remark where that changed it."""
    lows, highs = _points(used, upper=False), _points(used, upper=True)
    if options.method == "ols":
        low, high, parts = least_squares(lows), least_squares(highs), squares_parts(lows)
    elif options.method == "envelope":
        low, high, parts = envelope(lows, upper=False), envelope(highs, upper=True), lower_envelope_parts(lows)
    else:
        samples = [(item.size_bytes or 0, item.samples_ns) for item in used]
        low, high = (quantile_line(samples, share) for share in options.quantiles)
        parts = quantile_parts(samples, options.quantiles[0])
    found = below_upper(low, high, *parts)
    if found == low:
        return low, high, []
    what = "time per byte" if low.per_byte_ns > high.per_byte_ns else "fixed part"
    rest = "the other part is the best under that"
    text = f"the {what} of the lower line would be above that of the upper one: it is the same instead, and {rest}"
    return found, high, [Remark("crossing", text)]


def _general(used: Sequence[Summary], is_round_trip: bool) -> list[Remark]:
    count = sum(item.count or 0 for item in used)
    many = f" ({count:,} samples)" if count and all(item.count for item in used) else ""
    found = [Remark("sample maximum", f"the greatest of what was measured{many} is no bound of what can happen")]
    if is_round_trip:
        text = (
            "times are halves of round trips, as if both ways took the same: half of the longest is no longest one way"
        )
        found.append(Remark("half round trip", text))
    if len(used) == 2:
        found.append(Remark("few sizes", "two sizes: a line always goes through both, how well it fits is not known"))
    singles = [str(item.size_bytes) for item in used if item.is_single]
    if singles:
        found.append(Remark("single sample", f"a single sample at {', '.join(singles)} B"))
    return found


def _line_remarks(which: str, points: Points, line: Line, options: Options) -> list[Remark]:
    found = []
    upper = which == "upper"
    if line.free is not None:
        fixed, slope = line.free
        what, value, unit = ("the fixed part", fixed, "us") if slope >= 0 else ("the time per byte", slope * 1000, "ns")
        text = f"{what} of the {which} line would be negative ({float(value / 1000):.4g} {unit}): it is 0 instead"
        found.append(Remark("negative part", text))
    fit = goodness(points, line, upper=upper)
    if fit.beyond:
        side, end = ("above", "maxima") if upper else ("below", "minima")
        most = f"{float(fit.most_beyond_ns) / 1000:.4g} us at {fit.at_bytes} B"
        advice = "" if options.method == "envelope" else "; --method envelope covers all that was measured"
        text = f"{fit.beyond} of {len(points)} {end} lie {side} the {which} line, by up to {most}{advice}"
        found.append(Remark("outside", text))
    knee = bend(points, line)
    if knee is not None:
        what = "maxima" if upper else "minima"
        text = f"a line does not fit: the {what} bend at {knee} B; fit parts of the sizes with --sizes"
        found.append(Remark("bend", text))
    else:
        found += _poor(which, points, line)
    return found


def _poor(which: str, points: Points, line: Line) -> list[Remark]:
    off, size = max((abs(time - line.at(size)) / time if time else Fraction(0), size) for size, time in points)
    if off <= OFF:
        return []
    text = f"a line does not fit well: the {which} one is off by {round(float(off) * 100)} % at {size} B"
    return [Remark("poor fit", text)]


def _figures(low: Line, high: Line) -> list[tuple[Fraction, Fraction]]:
    """The ranges of the fixed part and of the time per byte, rounded outwards."""
    ends = (low.fixed_ns, high.fixed_ns), (low.per_byte_ns, high.per_byte_ns)
    return [(outwards(least, Rounding.DOWN), outwards(most, Rounding.UP)) for least, most in ends]


def outwards(value: Fraction, rounding: Rounding) -> Fraction:
    """A figure with `DIGITS` digits, in the named direction.

    >>> int(outwards(Fraction(524987), Rounding.DOWN)), float(outwards(Fraction(1, 3), Rounding.UP))
    (524900, 0.3334)
    """
    if not value:
        return value
    step = Fraction(10) ** (len(str(int(value))) - DIGITS) if value >= 1 else Fraction(1, 10**DIGITS)
    return round_to_int(value / step, rounding) * step


def _execution(item: Summary, options: Options) -> Execution:
    name = "_".join(part for part in (item.group.component, item.group.thread) if part)
    remarks = []
    if item.is_single:
        text = "a single sample: neither least nor greatest of anything; measure it again"
        remarks.append(Remark("single sample", text))
    else:
        many = f" of {item.count:,} samples" if item.count else ""
        remarks.append(Remark("sample maximum", f"the greatest{many} is no bound of what can happen"))
    remarks += saturated_remarks([item])
    found = tails(item.samples_ns, options.extremes) if options.extremes else []
    return Execution(name, item.group.platform, item, tuple(remarks), tuple(found))


def executions_by_name(executions: Sequence[Execution]) -> dict[str, list[Execution]]:
    """The platforms of each thread type, in the order of the files."""
    order = {name: number for number, name in enumerate(dict.fromkeys(item.name for item in executions))}
    ordered = sorted(executions, key=lambda item: order[item.name])
    return {name: list(items) for name, items in groupby(ordered, key=lambda item: item.name)}


# Fitted figures as a frame.


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
