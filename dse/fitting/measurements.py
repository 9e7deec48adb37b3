"""Measurements in, as CSV: one sample a row, or one row with the figures of many; every mistake with its line."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from dse.fitting.columns import NAMES, TIMES, Column, ColumnError, OptionError, find_columns
from dse.spec.loading.sources import OnDisk, read_source
from dse.support.errors import Diagnostic, ProblemError, UsageError, did_you_mean
from dse.support.json_fields import NUMBER
from dse.support.timelimit import in_time
from dse.support.units import DATA, TIME, UnitError, parse_quantity

MOST_BYTES = 64_000_000
MOST_MISTAKES = 20
"""The number of mistakes after which a file is given up."""
_PLAIN = re.compile(r"[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]{1,2})?|\.[0-9]+([eE][+-]?[0-9]{1,2})?")


class MeasuredGroup(NamedTuple):
    """A group of samples with one transport, platform, component and thread; "" where the file does not state one.

    Samples of one group are fitted together.
    """

    transport: str = ""
    platform: str = ""
    component: str = ""
    thread: str = ""


@dataclass(frozen=True)
class Summary:
    """The samples of one size or thread, in a few figures (ns); of round trips, half of them.

    `samples_ns` is empty for rows of figures; `place` is ``FILE:LINE``.
    """

    JSON_NAME = "Measured"

    group: MeasuredGroup
    size_bytes: Annotated[int | None, "The size of the messages; null for execution times."]
    min_ns: Annotated[Fraction, "The least sample."]
    max_ns: Annotated[Fraction, "The greatest sample."]
    mean_ns: Annotated[Fraction | None, NUMBER, "Their mean; null where the file does not say it."] = None
    median_ns: Annotated[Fraction | None, NUMBER, "Their median; null where the file does not say it."] = None
    deviation_ns: Annotated[
        Fraction | None, NUMBER, "Their standard deviation; null where the file does not say it."
    ] = None
    count: Annotated[int | None, "How many there are; null where the file does not say it."] = None
    samples_ns: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty(0), compare=False)
    place: str = ""

    @property
    def is_single(self) -> bool:
        """Whether it is a single sample, as far as one can tell."""
        if self.count is not None:
            return self.count == 1
        return self.min_ns == self.max_ns and not self.deviation_ns

    def halved(self) -> Summary:
        """Half of everything: a round trip as two equal ways.

        The mean of a round trip halves exactly; minima and maxima are those of equal ways.
        """
        figures = {
            name: value / 2
            for name in ("min_ns", "max_ns", "mean_ns", "median_ns", "deviation_ns")
            if (value := getattr(self, name)) is not None
        }
        return replace(self, **figures, samples_ns=self.samples_ns / 2)


@dataclass(frozen=True)
class Measurements:
    """Everything that files of measurements say; `unused` are columns without a role.

    One `Summary` for each group and size.
    """

    files: tuple[str, ...]
    summaries: tuple[Summary, ...]
    unused: tuple[str, ...]
    is_round_trip: bool
    """Whether a column's name says that its samples are round trips."""

    @property
    def has_samples(self) -> bool:
        """Whether there are samples, rather than rows of figures."""
        return any(len(item.samples_ns) for item in self.summaries)


def read_measurements(
    paths: Sequence[Path],
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    platforms: Mapping[str, str] | None = None,
) -> Measurements:
    """The measurements of some files, in the order of the files.

    Parameters
    ----------
    paths
        CSV with a header (comma, semicolon or tab; lines that begin with ``#`` are remarks).
    columns, units
        see `dse.fitting.columns.find_columns`.
    platforms
        other names of platforms: those of the processor types of a problem.

    Raises
    ------
    ProblemError
        with every mistake and its file and line.
    UsageError
        when a column, a unit or a platform is named that there is not.
    """
    readers = [_SampleReader(path, columns or {}, units or {}, platforms or {}) for path in paths]
    _check_units(units or {}, [column for reader in readers for column in reader.columns.values()])
    mistakes = [mistake for reader in readers for mistake in reader.mistakes]
    if mistakes:
        raise ProblemError(mistakes)
    named = [name for reader in readers for name in reader.named]
    for name, kind in (platforms or {}).items():
        if name not in named:
            there = f"platforms: {', '.join(dict.fromkeys(named))}" if named else "no column names platforms"
            raise UsageError(f"--platform {name}={kind}: no row is of the platform {name!r} ({there})")
    summaries: dict[tuple[MeasuredGroup, int | None], Summary] = {}
    for reader in readers:
        for item in reader.summaries():
            key = (item.group, item.size_bytes)
            if key in summaries:
                what = _words(item)
                text = f"{what} is stated twice: here and at {summaries[key].place}"
                mistakes.append(_diagnostic(item.place, text))
            summaries[key] = item
    if mistakes:
        raise ProblemError(mistakes)
    unused = dict.fromkeys(name for reader in readers for name in reader.unused)
    round_trip = any(column.is_round_trip for reader in readers for column in reader.columns.values())
    return Measurements(tuple(str(path) for path in paths), tuple(summaries.values()), tuple(unused), round_trip)


def _check_units(units: Mapping[str, str], columns: Sequence[Column]) -> None:
    """Every stated unit is that of a role or column which is there."""
    there = list(dict.fromkeys(text for column in columns for text in (column.role, column.name)))
    for name, unit in units.items():
        if name not in there and there:
            words = did_you_mean(name, there, 0.5) or f"roles and columns: {', '.join(there)}"
            raise UsageError(f"--unit {name}={unit}: no column has this role or name ({words})")


def _diagnostic(place: str, message: str) -> Diagnostic:
    file, _, line = place.rpartition(":")
    return Diagnostic(message, file=file, line=int(line))


def _words(item: Summary) -> str:
    names = " ".join(name for name in item.group if name)
    size = f"{item.size_bytes} B" if item.size_bytes is not None else ""
    return " of ".join(part for part in (size, names) if part) or "the same"


class _SampleReader:
    """Reads one file; collects its mistakes."""

    def __init__(
        self, path: Path, stated: Mapping[str, str], units: Mapping[str, str], platforms: Mapping[str, str]
    ) -> None:
        self.file, self.platforms = str(path), platforms
        self.mistakes: list[Diagnostic] = []
        self.columns: dict[str, Column] = {}
        self.unused: list[str] = []
        self.rows: list[tuple[Summary, int]] = []
        self.samples: dict[tuple[MeasuredGroup, int | None], list[Fraction | float]] = {}
        self.extremes: dict[tuple[MeasuredGroup, int | None], tuple[Fraction, Fraction, int]] = {}
        self.known: dict[tuple[str, str], Fraction] = {}
        self.named: dict[str, None] = {}
        text = self._text(path)
        if text is None:
            return
        try:
            self._read(text, stated, units)
        except OptionError as error:
            hint = f" ({error.hint})" if error.hint else ""
            raise UsageError(f"{error.message} in {self.file}{hint}") from error
        except ColumnError as error:
            self._wrong(error.message, self.header_line, error.hint)
        except csv.Error as error:
            self._wrong(f"the table cannot be read: {error}", self.line)

    line = header_line = 1

    def _wrong(self, message: str, line: int, hint: str = "", path: str = "") -> None:
        self.mistakes.append(Diagnostic(message, path, self.file, line, hint=hint))

    def _text(self, path: Path) -> str | None:
        data = read_source(OnDisk(), path, self.file, MOST_BYTES, "measurements")
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = data[: error.start].count(b"\n") + 1
            hint = "it looks like UTF-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "save it as UTF-8"
            self._wrong("the file is not UTF-8 text", line, hint)
            return None

    def _read(self, text: str, stated: Mapping[str, str], units: Mapping[str, str]) -> None:
        lines = numbered_lines(text)
        titles = next(lines, None)
        if titles is None:
            return self._wrong("the file is empty", 1, "expected a header, and a row for each sample or size")
        self.header_line, first = titles
        separator = max(",;\t", key=first.count)
        [header] = csv.reader([first], delimiter=separator, strict=True)
        header = [name.strip() for name in header]
        self.columns, self.unused = find_columns(header, stated, units)
        self._check_columns(header)
        for number, line in in_time(joined_rows(lines)):
            self.line = number
            [cells] = csv.reader(io.StringIO(line, newline=""), delimiter=separator, strict=True)
            if len(cells) != len(header):
                hint = "is the file cut off?" if len(cells) < len(header) else "decimals are written with a point"
                self._wrong(f"{len(cells)} cells, but the header has {len(header)} columns", number, hint)
            else:
                self._row(cells)
            if len(self.mistakes) >= MOST_MISTAKES:
                return
        if not self.rows and not self.samples and not self.mistakes:
            self._wrong("there is no row below the header", self.header_line)

    def _check_columns(self, header: Sequence[str]) -> None:
        roles = set(self.columns)
        shown = ", ".join(header[:12]) + (f", … ({len(header)} in all)" if len(header) > 12 else "")
        if "sample" in roles and roles & {"min", "max"}:
            names = f"{self.columns['sample'].name!r} and {self.columns[next(iter(roles & {'min', 'max'}))].name!r}"
            raise ColumnError(f"{names}: samples, or the figures of many, not both", "give them as two files")
        if "sample" not in roles and not {"min", "max"} <= roles:
            hint = f"such as delay_us or min_us, max_us; or --column sample=NAME (columns: {shown})"
            raise ColumnError("no column holds durations", hint)
        if not roles & {"size", "thread", "component"}:
            hint = f"such as size_bytes, or thread; or --column size=NAME (columns: {shown})"
            raise ColumnError("no column says of what the durations are: a size, or a thread", hint)

    def _row(self, cells: Sequence[str]) -> None:
        before = len(self.mistakes)
        group = MeasuredGroup(**{role: self._name(cells, role) for role in MeasuredGroup._fields})
        size = self._figure(cells, "size")
        size_bytes = None if size is None else ceil(size)
        times = {role: self._figure(cells, role) for role in TIMES if role in self.columns}
        count = self._count(cells)
        if len(self.mistakes) > before:
            return
        if "sample" in self.columns:
            value = times["sample"]
            assert value is not None
            key = (group, size_bytes)
            self.samples.setdefault(key, []).append(float(value))
            low, high, line = self.extremes.get(key, (value, value, self.line))
            self.extremes[key] = (min(low, value), max(high, value), line)
            return
        low_, high_ = times["min"], times["max"]
        assert low_ is not None and high_ is not None
        place = f"{self.file}:{self.line}"
        summary = Summary(
            *(group, size_bytes, low_, high_, times.get("mean"), times.get("median"), times.get("deviation"), count),
            place=place,
        )
        self._check(summary)
        self.rows.append((summary, self.line))

    def _check(self, summary: Summary) -> None:
        """Check that the figures can be those of samples."""
        if summary.min_ns > summary.max_ns:
            self._wrong("the minimum is above the maximum", self.line)
            return
        for role, value in (("mean", summary.mean_ns), ("median", summary.median_ns)):
            if value is not None and not summary.min_ns <= value <= summary.max_ns:
                hint = "are the units of the columns right?"
                self._wrong(f"the {role} is not between the minimum and the maximum", self.line, hint)
        if summary.deviation_ns is not None and summary.deviation_ns > summary.max_ns - summary.min_ns:
            hint = "are the units of the columns right?"
            self._wrong("the deviation is larger than the range from minimum to maximum", self.line, hint)

    def _name(self, cells: Sequence[str], role: str) -> str:
        column = self.columns.get(role)
        if column is None:
            return ""
        text = cells[column.index].strip()
        if not text or not text.isprintable():
            self._wrong(
                "expected a name, got nothing" if not text else "a name is one line of text", self.line, "", column.name
            )
        if role != "platform":
            return text
        self.named.setdefault(text)
        return self.platforms.get(text, text)

    def _count(self, cells: Sequence[str]) -> int | None:
        column = self.columns.get("count")
        text = cells[column.index].strip() if column is not None else ""
        if not text or column is None:
            return None
        if not (text.isascii() and text.isdecimal() and len(text) < 16 and int(text)):
            self._wrong(f"expected the number of samples, got {text[:40]!r}", self.line, "", column.name)
            return None
        return int(text)

    def _figure(self, cells: Sequence[str], role: str) -> Fraction | None:
        """A duration in ns or a size in bytes; None where there is no such column, or where it may be empty."""
        column = self.columns.get(role)
        if column is None:
            return None
        text = cells[column.index].strip()
        if not text and role in ("mean", "median", "deviation"):
            return None
        key = (role, text)
        if key not in self.known:
            value = self._parsed(column, text)
            if value is None:
                return None
            self.known[key] = value
        return self.known[key]

    def _parsed(self, column: Column, text: str) -> Fraction | None:
        is_size = column.role == "size"
        what, example = ("a size", "B") if is_size else ("a duration", "us")
        if _PLAIN.fullmatch(text) and len(text) <= 40:
            if column.scale is not None:
                return Fraction(text) * column.scale
            hint = f"name the column {column.name}_{example.lower()}, or --unit {column.role}={example}"
            self._wrong(f"expected {what} with its unit, got {text!r}", self.line, hint, column.name)
            return None
        try:
            quantity = parse_quantity(text)
            if quantity.dimension == (DATA if is_size else TIME) and quantity.value >= 0:
                return quantity.value * (1 if is_size else 10**9)
            hint = "it is negative" if quantity.value < 0 else ""
        except UnitError as error:
            hint = error.hint
        shown = repr(text[:40]) if text else "nothing"
        self._wrong(f"expected {what}, got {shown}", self.line, hint, column.name)
        return None

    def summaries(self) -> Iterator[Summary]:
        """The summaries of a file in its order; samples are grouped by platform, transport and size."""
        yield from (item for item, _ in self.rows)
        for key, values in in_time(self.samples.items()):
            low, high, line = self.extremes[key]
            array = np.array(values, dtype=np.float64)
            mean, median = Fraction(float(array.mean())), Fraction(float(np.median(array)))
            deviation = Fraction(float(array.std(ddof=1))) if len(array) > 1 else Fraction(0)
            yield Summary(*(*key, low, high, mean, median, deviation, len(array), array), place=f"{self.file}:{line}")


def numbered_lines(text: str) -> Iterator[tuple[int, str]]:
    """The lines with their numbers, without remarks and empty ones.

    Pairs of a line number, from 1, and the line; looks at the time limit now and then.
    """
    for number, line in in_time(enumerate(text.splitlines(), start=1), every=1000):
        if line.strip() and not line.startswith("#"):
            yield number, line


def joined_rows(lines: Iterator[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Rows: lines, joined where a quoted cell goes on in the next one.

    Pairs of the first line's number and the row's text.
    """
    waiting: list[str] = []
    start, quotes = 0, 0
    for number, line in lines:
        start = start if waiting else number
        waiting.append(line)
        quotes += line.count('"')
        if quotes % 2 == 0:
            yield start, "\n".join(waiting)
            waiting, quotes = [], 0
    if waiting:
        yield start, "\n".join(waiting)


__all__ = ["NAMES", "MeasuredGroup", "Measurements", "Summary", "read_measurements"]
