"""What a running system showed, as CSV: samples of metrics and of inputs, by name; every mistake with its line.

A row says what was measured and one sample of it, or the least and the greatest of many. What it is stands in a column
``metric`` (``latency of steering``, ``load of can0``, ``execution time of filter``, ``period of filter``), or in one
that names the flow, bus, processor or thread and the title of the column with the figures (``flow,latency_ms``).
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from dse.fitting.columns import plain_words
from dse.fitting.measurements import MOST_BYTES, MOST_MISTAKES, joined_rows, numbered_lines
from dse.spec.loading.sources import OnDisk, read_source
from dse.support.errors import Diagnostic, ProblemError
from dse.support.timelimit import in_time
from dse.support.units import Quantity, UnitError, parse_quantity

SUBJECTS: Mapping[str, str] = {
    "name": "", "of": "", "flow": "latency", "path": "latency", "bus": "load", "processor": "utilisation",
    "thread": "execution time", "callback": "execution time", "task": "execution time", "device": "execution time",
    "component": "", "connection": "", "topic": "",
}  # fmt: skip
"""Columns that name what was measured, and which figure of it is meant where nothing else says so."""
FIGURES: Mapping[str, tuple[str, ...]] = {
    "latency": ("latency", "end to end", "end to end latency", "e2e latency", "reaction"),
    "load": ("load",),
    "utilisation": ("utilisation", "utilization", "cpu", "cpu load"),
    "execution time": ("execution time", "exec time", "duration", "elapsed", "compute execution time"),
    "callback execution time": ("callback execution time",),
    "response time": ("response time",),
    "jitter": ("jitter",),
    "period": ("period", "interval", "timer period"),
    "rate": ("rate", "frequency"),
    "data size": ("data size", "message size", "size"),
}
"""Titles of columns that hold a figure by their own name."""
ROLES: Mapping[str, tuple[str, ...]] = {
    "metric": ("metric", "what", "figure"),
    "sample": ("sample", "value", "measured"),
    "min": ("min", "minimum"),
    "max": ("max", "maximum"),
    "mean": ("mean", "average", "avg"),
    "count": ("count", "samples", "n"),
    "unit": ("unit",),
}
_WORDS = {
    "bytes": "B",
    "byte": "B",
    "percent": "%",
    "hertz": "Hz",
    "usec": "us",
    "msec": "ms",
    "nsec": "ns",
    "sec": "s",
}
_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*")
_PLAIN = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,2})?")


@dataclass
class Observed:
    """The measured values of one figure: `figure` of `name` ("" where the metric is about the whole system).

    Figures are in coherent units (s, B, B/s, Hz, 1); `unit` is what the file wrote the first of them in. `samples` are
    kept where there are any; rows with the figures of many have none. `count` is None where a row does not say it.
    """

    figure: str
    name: str
    place: str
    unit: str
    low: Fraction
    high: Fraction
    total: Fraction = Fraction(0)
    count: int | None = 0
    is_mean_known: bool = True
    samples: list[Fraction] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The figure and its name as a requirement has them.

        Such as ``latency of "main loop"``, with quotes where there is a name.
        """
        if not self.name:
            return self.figure
        quote = "'" if '"' in self.name else '"'
        return f"{self.figure} of {quote}{self.name}{quote}"

    @property
    def words(self) -> str:
        """The figure and its name as a reader sees them."""
        return f"{self.figure} of {self.name}" if self.name else self.figure

    @property
    def mean(self) -> Fraction | None:
        """The mean; None where a row does not say it.

        Exact, in the base unit of the figure.
        """
        return self.total / (self.count or 1) if self.is_mean_known else None

    def merged(self, other: Observed) -> Observed:
        """Merge two observations of one figure: the least, the greatest, and the mean of all where it is known.

        A new object; samples are dropped.
        """
        counts = (self.count, other.count)
        is_known = self.is_mean_known and other.is_mean_known and None not in counts
        return replace(
            self,
            low=min(self.low, other.low),
            high=max(self.high, other.high),
            total=self.total + other.total,
            count=None if None in counts else sum(count or 0 for count in counts),
            is_mean_known=is_known,
            samples=[],
        )


def read_observed(paths: Sequence[Path]) -> tuple[list[Observed], list[str]]:
    """Read files of measurements, in their order; also returns the columns that are not used.

    Raises
    ------
    ProblemError
        with every mistake and its file and line.
    """
    by_key: dict[tuple[str, str], Observed] = {}
    unused: dict[str, None] = {}
    mistakes: list[Diagnostic] = []
    for path in paths:
        reader = _ObservedReader(str(path), by_key)
        reader.read(path)
        mistakes += reader.mistakes
        unused |= dict.fromkeys(reader.unused)
    if mistakes:
        raise ProblemError(mistakes)
    return list(by_key.values()), list(unused)


@dataclass(frozen=True)
class _Column:
    role: str
    index: int
    title: str
    unit: str = ""


class _ObservedReader:
    """Reads one file into what was found so far."""

    def __init__(self, file: str, by_key: dict[tuple[str, str], Observed]) -> None:
        self.file, self.found = file, by_key
        self.mistakes: list[Diagnostic] = []
        self.unused: list[str] = []
        self.columns: dict[str, _Column] = {}
        self.subjects: list[_Column] = []
        self.figures: list[_Column] = []
        self.line = 1

    def _wrong(self, message: str, hint: str = "", path: str = "") -> None:
        self.mistakes.append(Diagnostic(message, path, self.file, self.line, hint=hint))

    def read(self, path: Path) -> None:
        """Read the file; mistakes are collected."""
        data = read_source(OnDisk(), path, self.file, MOST_BYTES, "measurements")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            self.line = data[: error.start].count(b"\n") + 1
            hint = "it looks like UTF-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "save it as UTF-8"
            return self._wrong("the file is not UTF-8 text", hint)
        try:
            self._table(text)
        except csv.Error as error:
            self._wrong(f"the table cannot be read: {error}")
        return None

    def _table(self, text: str) -> None:
        lines = numbered_lines(text)
        titles = next(lines, None)
        if titles is None:
            return self._wrong("the file is empty", "expected a header, and a row for each sample")
        self.line, first = titles
        separator = max(",;\t", key=first.count)
        [header] = csv.reader([first], delimiter=separator, strict=True)
        self._header([name.strip() for name in header])
        if self.mistakes:
            return None
        rows = 0
        for self.line, row in in_time(joined_rows(lines)):
            [cells] = csv.reader(io.StringIO(row, newline=""), delimiter=separator, strict=True)
            rows += 1
            if len(cells) != len(header):
                hint = "is the file cut off?" if len(cells) < len(header) else "decimals are written with a point"
                self._wrong(f"{len(cells)} cells, but the header has {len(header)} columns", hint)
            else:
                self._row([cell.strip() for cell in cells])
            if len(self.mistakes) >= MOST_MISTAKES:
                return None
        if not rows:
            self._wrong("there is no row below the header")
        return None

    def _header(self, header: Sequence[str]) -> None:
        for index, title in enumerate(header):
            plain, unit = _title(title)
            role = next((role for role, names in ROLES.items() if plain in names), "")
            figure = next((figure for figure, names in FIGURES.items() if plain in names), "")
            if role and role in self.columns:
                self._wrong(f"{self.columns[role].title!r} and {title!r} may both be the {role}")
            elif role:
                self.columns[role] = _Column(role, index, title, unit)
            elif plain in SUBJECTS:
                self.subjects.append(_Column(plain, index, title))
            elif figure:
                self.figures.append(_Column(figure, index, title, unit))
            else:
                self.unused.append(title)
        shown = ", ".join(header[:12]) + (f", … ({len(header)} in all)" if len(header) > 12 else "")
        several = {"min", "max"} & self.columns.keys()
        if len(self.subjects) > 1:
            both = " and ".join(repr(item.title) for item in self.subjects[:2])
            self._wrong(f"{both} both name what was measured", "give a table for each")
        elif "metric" not in self.columns and not self.subjects:
            hint = f"such as metric, flow, bus, processor, thread (columns: {shown})"
            self._wrong("no column says what was measured", hint)
        elif not self.figures and "sample" not in self.columns and several != {"min", "max"}:
            hint = f"such as sample, latency_ms, or min_ms and max_ms (columns: {shown})"
            self._wrong("no column holds figures", hint)
        elif bool(self.figures) + ("sample" in self.columns) + bool(several) > 1:
            self._wrong("samples, or the least and greatest of many, not both", "give them as two files")

    def _row(self, cells: Sequence[str]) -> None:
        metric = cells[self.columns["metric"].index] if "metric" in self.columns else ""
        subject = self.subjects[0] if self.subjects else None
        name = cells[subject.index] if subject is not None else ""
        kind, _, of = (part.strip() for part in metric.partition(" of "))
        if of and name:
            return self._wrong(f"{metric!r} says of what it is, and so does {subject.title if subject else ''!r}")
        name = (of or name).strip("\"'")
        if subject is not None and not name:
            return self._wrong("expected a name, got nothing", "", subject.title)
        kind = next((figure for figure, names in FIGURES.items() if kind.lower() in names), kind)
        for column in self.figures:
            value = self._quantity(column, cells)
            if value is not None:
                self._add(kind or column.role, name, value, value, None, 1)
        if self.figures:
            return None
        kind = kind or (SUBJECTS[subject.role] if subject is not None else "")
        if not kind:
            return self._wrong("nothing says what was measured", "a column `metric`, or a title such as latency_ms")
        return self._figures(kind, name, cells)

    def _figures(self, kind: str, name: str, cells: Sequence[str]) -> None:
        if "sample" in self.columns:
            value = self._quantity(self.columns["sample"], cells)
            if value is not None:
                self._add(kind, name, value, value, None, 1)
            return
        low, high = (self._quantity(self.columns[role], cells) for role in ("min", "max"))
        mean = self._quantity(self.columns["mean"], cells) if "mean" in self.columns else None
        if low is None or high is None:
            return
        if low.value > high.value:
            return self._wrong("the minimum is above the maximum")
        if mean is not None and not low.value <= mean.value <= high.value:
            return self._wrong("the mean is not between the minimum and the maximum", "are the units right?")
        count = cells[self.columns["count"].index] if "count" in self.columns else ""
        if count and not (count.isascii() and count.isdecimal() and len(count) < 16 and int(count)):
            return self._wrong(f"expected the number of samples, got {count[:40]!r}", "", self.columns["count"].title)
        return self._add(kind, name, low, high, mean, int(count) if count else None)

    def _quantity(self, column: _Column, cells: Sequence[str]) -> Quantity | None:
        text = cells[column.index]
        if not text and column.role == "mean":
            return None
        stated = cells[self.columns["unit"].index] if "unit" in self.columns else ""
        unit = column.unit or stated
        try:
            quantity = parse_quantity(f"{text} {unit}" if _PLAIN.fullmatch(text) and unit else text)
        except UnitError as error:
            self._wrong(
                f"expected a figure, got {text[:40]!r}" if text else "expected a figure, got nothing", error.hint
            )
            return None
        if quantity.dimension is None or not quantity.unit:
            hint = f"in the title ({column.title}_ms), in a column unit, or in the cell"
            self._wrong(f"expected a figure with its unit, got {text[:40]!r}", hint, column.title)
            return None
        if quantity.value < 0:
            self._wrong(f"expected a figure of at least 0, got {text[:40]!r}", "", column.title)
            return None
        return quantity

    def _add(
        self, kind: str, name: str, low: Quantity, high: Quantity, mean: Quantity | None, count: int | None
    ) -> None:
        place = f"{self.file}:{self.line}"
        is_sample = low is high
        item = self.found.get((kind, name))
        if item is None:
            item = self.found[kind, name] = Observed(kind, name, place, low.unit, low.value, high.value)
        elif not is_sample or not item.samples:
            return self._wrong(f"{item.words} is stated twice: here and at {item.place}")
        known = parse_quantity(f"1 {item.unit}").dimension
        if low.dimension != known or high.dimension != known:
            return self._wrong(f"{item.words} was in {item.unit} at {item.place}, is in {low.unit} here")
        item.low, item.high = min(item.low, low.value), max(item.high, high.value)
        if is_sample:
            item.samples.append(low.value)
            item.total += low.value
            item.count = len(item.samples)
            return None
        item.count, item.is_mean_known = count, mean is not None
        if mean is not None:
            item.total = mean.value * (count or 1)
        return None


def _title(title: str) -> tuple[str, str]:
    """The name of a column in lower case, and its unit ("" where it has none).

    >>> _title("latency_ms"), _title("Load [B/s]"), _title("metric")
    (('latency', 'ms'), ('load', 'B/s'), ('metric', ''))
    """
    bracketed = _BRACKETED.fullmatch(title)
    if bracketed is not None:
        return plain_words(bracketed["name"]), _WORDS.get(bracketed["unit"].strip().lower(), bracketed["unit"].strip())
    head, mark, last = title.rpartition("_")
    if mark and _known(_WORDS.get(last.lower(), last)):
        return plain_words(head), _WORDS.get(last.lower(), last)
    return plain_words(title), ""


def _known(unit: str) -> bool:
    try:
        return parse_quantity(f"1 {unit}").dimension is not None
    except UnitError:
        return False
