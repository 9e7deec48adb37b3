"""Measurements to figures: a line for each transport and platform, a range for each thread, and what is to be said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import get_args

from dse.fitting.extremes import tails
from dse.fitting.fitted import Execution, Fit, Transport
from dse.fitting.judging import (
    Remark,
    bend,
    goodness,
    left_out_remarks,
    resolution_remark,
    saturated_remarks,
    spread_remarks,
)
from dse.fitting.lines import (
    LinearModel,
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
from dse.fitting.measurements import MeasuredGroup, Measurements, Summary, read_measurements
from dse.support.errors import Diagnostic, ProblemError, UsageError
from dse.support.timelimit import in_time
from dse.support.units import format_duration
from dse.support.units.parse import round_to_int
from dse.support.units.table import Rounding

DIGITS = 4
"""Digits to which figures are rounded outwards: minima down, maxima up."""
OFF = Fraction(1, 4)
"""A line does not fit where it is off by this share of a time."""
Sizes = tuple[int, int]
"""From and to, both included, in bytes."""


@dataclass(frozen=True)
class FitOptions:
    """The options of a fit of measurements to lines; see `fit_measurements`.

    `sizes` and `without` select message sizes in bytes; `extremes` asks for tails up to what one sample in as many
    exceeds.
    """

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


def fit_measurements(paths: Sequence[Path], options: FitOptions) -> Fit:
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
    fit = Fit(
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
        return replace(fit, is_round_trip=False, executions=executions)
    return replace(fit, transports=tuple(_transports(measured, with_size, options, is_round_trip)))


def _transports(
    measured: Measurements, summaries: Sequence[Summary], options: FitOptions, is_round_trip: bool
) -> list[Transport]:
    name = options.name or Path(measured.files[0]).stem
    groups: dict[MeasuredGroup, list[Summary]] = {}
    for item in summaries:
        groups.setdefault(item.group, []).append(item)
    return [
        _transport(group, group.transport or name, sorted(items, key=_size), options, is_round_trip)
        for group, items in in_time(groups.items(), every=10)
    ]


def _size(item: Summary) -> int:
    return item.size_bytes or 0


def _transport(
    group: MeasuredGroup, name: str, summaries: Sequence[Summary], options: FitOptions, is_round_trip: bool
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
    models = [
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
        tails=tuple(models),
    )


def _is_used(size: int, options: FitOptions) -> bool:
    inside = options.sizes is None or options.sizes[0] <= size <= options.sizes[1]
    return inside and not any(low <= size <= high for low, high in options.without)


def _points(summaries: Sequence[Summary], *, upper: bool) -> Points:
    return [(item.size_bytes or 0, item.max_ns if upper else item.min_ns) for item in summaries]


def _lines(used: Sequence[Summary], options: FitOptions) -> tuple[LinearModel, LinearModel, list[Remark]]:
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
    lines = below_upper(low, high, *parts)
    if lines == low:
        return low, high, []
    what = "time per byte" if low.per_byte_ns > high.per_byte_ns else "fixed part"
    rest = "the other part is the best under that"
    text = f"the {what} of the lower line would be above that of the upper one: it is the same instead, and {rest}"
    return lines, high, [Remark("crossing", text)]


def _general(used: Sequence[Summary], is_round_trip: bool) -> list[Remark]:
    count = sum(item.count or 0 for item in used)
    many = f" ({count:,} samples)" if count and all(item.count for item in used) else ""
    remarks = [Remark("sample maximum", f"the greatest of what was measured{many} is no bound of what can happen")]
    if is_round_trip:
        text = (
            "times are halves of round trips, as if both ways took the same: half of the longest is no longest one way"
        )
        remarks.append(Remark("half round trip", text))
    if len(used) == 2:
        remarks.append(Remark("few sizes", "two sizes: a line always goes through both, how well it fits is not known"))
    singles = [str(item.size_bytes) for item in used if item.is_single]
    if singles:
        remarks.append(Remark("single sample", f"a single sample at {', '.join(singles)} B"))
    return remarks


def _line_remarks(which: str, points: Points, line: LinearModel, options: FitOptions) -> list[Remark]:
    remarks = []
    upper = which == "upper"
    if line.free is not None:
        fixed, slope = line.free
        what, value, unit = ("the fixed part", fixed, "us") if slope >= 0 else ("the time per byte", slope * 1000, "ns")
        text = f"{what} of the {which} line would be negative ({float(value / 1000):.4g} {unit}): it is 0 instead"
        remarks.append(Remark("negative part", text))
    fit = goodness(points, line, upper=upper)
    if fit.beyond:
        side, end = ("above", "maxima") if upper else ("below", "minima")
        most = f"{float(fit.most_beyond_ns) / 1000:.4g} us at {fit.at_bytes} B"
        advice = "" if options.method == "envelope" else "; --method envelope covers all that was measured"
        text = f"{fit.beyond} of {len(points)} {end} lie {side} the {which} line, by up to {most}{advice}"
        remarks.append(Remark("outside", text))
    knee = bend(points, line)
    if knee is not None:
        what = "maxima" if upper else "minima"
        text = f"a line does not fit: the {what} bend at {knee} B; fit parts of the sizes with --sizes"
        remarks.append(Remark("bend", text))
    else:
        remarks += _poor(which, points, line)
    return remarks


def _poor(which: str, points: Points, line: LinearModel) -> list[Remark]:
    off, size = max((abs(time - line.at(size)) / time if time else Fraction(0), size) for size, time in points)
    if off <= OFF:
        return []
    text = f"a line does not fit well: the {which} one is off by {round(float(off) * 100)} % at {size} B"
    return [Remark("poor fit", text)]


def _figures(low: LinearModel, high: LinearModel) -> list[tuple[Fraction, Fraction]]:
    """The ranges of the fixed part and of the time per byte, rounded outwards."""
    ends = (low.fixed_ns, high.fixed_ns), (low.per_byte_ns, high.per_byte_ns)
    return [(_outwards(least, Rounding.DOWN), _outwards(most, Rounding.UP)) for least, most in ends]


def _outwards(value: Fraction, rounding: Rounding) -> Fraction:
    """A figure with `DIGITS` digits, in the named direction.

    >>> int(_outwards(Fraction(524987), Rounding.DOWN)), float(_outwards(Fraction(1, 3), Rounding.UP))
    (524900, 0.3334)
    """
    if not value:
        return value
    step = Fraction(10) ** (len(str(int(value))) - DIGITS) if value >= 1 else Fraction(1, 10**DIGITS)
    return round_to_int(value / step, rounding) * step


def _execution(item: Summary, options: FitOptions) -> Execution:
    name = "_".join(part for part in (item.group.component, item.group.thread) if part)
    remarks = []
    if item.is_single:
        text = "a single sample: neither least nor greatest of anything; measure it again"
        remarks.append(Remark("single sample", text))
    else:
        many = f" of {item.count:,} samples" if item.count else ""
        remarks.append(Remark("sample maximum", f"the greatest{many} is no bound of what can happen"))
    remarks += saturated_remarks([item])
    fitted_tails = tails(item.samples_ns, options.extremes) if options.extremes else []
    return Execution(name, item.group.platform, item, tuple(remarks), tuple(fitted_tails))
