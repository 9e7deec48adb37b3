"""`dse.fit`: measurements to the figures of a problem file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import get_args

from pydantic import TypeAdapter, ValidationError

from dse.fitting.fit import FitOptions, Sizes, fit_measurements
from dse.fitting.fitted import Fit
from dse.fitting.lines import Method
from dse.spec.schema.fields import Name
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.units import UnitError, parse_ratio, parse_size_bytes


@arguments.checked(
    files=arguments.paths,
    method=arguments.Word(get_args(Method)),
    quantiles=arguments.optional_text,
    round_trip=arguments.optional_flag,
    sizes=arguments.optional_text,
    without=arguments.texts,
    name=arguments.text,
    extremes=arguments.Whole(10, 10**12, is_optional=True),
    columns=arguments.named_texts,
    units=arguments.named_texts,
    platforms=arguments.named_texts,
)
def fit(
    *files: str | Path,
    method: str = "ols",
    quantiles: str | None = None,
    round_trip: bool | None = None,
    sizes: str | None = None,
    without: Sequence[str] = (),
    name: str = "",
    extremes: int | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    platforms: Mapping[str, str] | None = None,
) -> Fit:
    """Measurements as transmission times of bus types, or as execution times of thread types.

    Parameters
    ----------
    files
        CSV: one sample a row (a column such as ``delay_us``), or one row with the figures of many (``min_us``,
        ``max_us``, and where known ``mean_us``, ``median_us``, ``stddev_us``, ``count``). A column ``size_bytes`` makes
        them transmission times, else ``thread`` or ``component`` execution times; ``platform`` and ``transport`` tell
        several apart.
    method
        ``ols`` (least squares of minima and of maxima, as ECE-TR-25, section 5.5.1), ``envelope`` (the closest lines
        that nothing measured lies beyond) or ``quantile`` (lines that leave a share of the samples beyond them).
    quantiles
        the shares of the lower and the upper quantile line, for ``quantile`` only; None: ``1 % .. 99 %``.
    round_trip
        whether times are halved; None: where a column's name says so.
    sizes, without
        sizes of messages to use, and ranges of them to leave out, such as ``3 KB .. 7.5 KB``.
    name
        of the bus type, where no column names the transport; else the stem of the first file.
    extremes
        also fit extreme values, up to what one sample in so many exceeds.
    columns, units
        the column of a role, and the unit of its plain numbers: ``{"sample": "d"}``, ``{"sample": "us"}``.
    platforms
        the processor type of a platform: ``{"rt101": "RT101"}``.

    Raises
    ------
    ProblemError
        when a file is wrong, with every mistake and its line.
    UsageError
        when an argument is, or does not go with the measurements.

    Examples
    --------
    >>> from pathlib import Path
    >>> print(Path("delays.csv").read_text(), end="")
    size_bytes,min_us,max_us
    0,10,20
    100,12,25
    200,14,30
    >>> import dse
    >>> [one] = dse.fit("delays.csv").transports
    >>> [int(value) for value in one.fixed_ns], [int(value) for value in one.per_byte_ns]
    ([10000, 20000], [20, 50])
    """
    if not files:
        raise UsageError("there is no file of measurements")
    if quantiles is not None and method != "quantile":
        raise UsageError(f"--quantiles {quantiles}: is for --method quantile, not {method}: leave it out or change it")
    if name:
        _check_name("--name", name)
    for platform, kind in (platforms or {}).items():
        _check_name(f"--platform {platform}=", kind)
    chosen: Method = method  # type: ignore[assignment] # refused below where it is none
    options = FitOptions(
        method=chosen,
        quantiles=_shares(quantiles if quantiles is not None else "1 % .. 99 %"),
        is_round_trip=round_trip,
        sizes=_sizes("--sizes", sizes) if sizes is not None else None,
        without=tuple(_sizes("--without", text) for text in without),
        name=name,
        extremes=extremes,
        columns=columns or {},
        units=units or {},
        platforms=platforms or {},
    )
    return fit_measurements([Path(file) for file in files], options)


def _check_name(option: str, name: str) -> None:
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError as error:
        raise UsageError(f"{option} {name!r}: {error.errors()[0]['msg']}") from error


def _ends(option: str, text: str, example: str) -> tuple[str, str]:
    low, separator, high = (part.strip() for part in text.partition(".."))
    if not separator or not low or not high:
        raise UsageError(f"{option} {text}: expected LOW .. HIGH, such as {example}")
    return low, high


def _shares(text: str) -> tuple[Fraction, Fraction]:
    low, high = _ends("--quantiles", text, "1 % .. 99 %")
    try:
        shares = parse_ratio(low), parse_ratio(high)
    except UnitError as error:
        raise UsageError(f"--quantiles {text}: {error}") from error
    if not shares[0] < shares[1] <= 1:
        raise UsageError(f"--quantiles {text}: expected shares from 0 % to 100 %, the lower one first")
    return shares


def _sizes(option: str, text: str) -> Sizes:
    low, high = _ends(option, text, "3 KB .. 7.5 KB")
    try:
        sizes = parse_size_bytes(low), parse_size_bytes(high)
    except UnitError as error:
        raise UsageError(f"{option} {text}: {error}") from error
    if sizes[0] > sizes[1]:
        raise UsageError(f"{option} {text}: the lower size comes first")
    return sizes
