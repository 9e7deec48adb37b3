"""What the columns of a file of measurements hold: a role and a unit, by their names or as the caller says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from dse.support.units import DATA, TIME, UNITS, Dimension, canonical_unit

TIMES = ("sample", "min", "max", "mean", "median", "deviation")
"""Roles whose figures are durations."""
MEASURED = ("latency", "delay", "duration", "time", "execution time")
"""What the least, greatest and mean in the name of a column are of: `latency_min (ms)`, `max delay [us]`."""


def _of_what(*words: str) -> tuple[str, ...]:
    """Names of a column for a figure of samples: alone, and before or after what it is of."""
    pairs = ((word, of) for word in words for of in MEASURED)
    return (*words, *(name for word, of in pairs for name in (f"{word} {of}", f"{of} {word}")))


NAMES: Mapping[str, tuple[str, ...]] = {
    "size": ("size", "data size", "message size", "msg size", "payload", "payload size", "bytes", "length"),
    "sample": (
        *("sample", "delay", "latency", "duration", "time", "value", "rtt", "round trip", "round trip time"),
        *("round trip delay", "one way", "one way delay", "execution time", "exec time", "response time", "elapsed"),
    ),
    "min": _of_what("min", "minimum", "least", "best"),
    "max": _of_what("max", "maximum", "greatest", "worst"),
    "mean": _of_what("mean", "average", "avg"),
    "median": _of_what("median", "p50"),
    "deviation": ("stddev", "std dev", "std", "deviation", "standard deviation", "sd", "sigma"),
    "count": ("count", "samples", "n", "n samples", "number of samples"),
    "platform": ("platform", "computer", "processor", "processor type", "machine", "host", "board", "cpu"),
    "transport": ("transport", "bus", "bus type", "virtual bus", "middleware", "rmw", "link", "protocol"),
    "thread": ("thread", "callback", "task", "function", "runnable", "thread type"),
    "component": ("component", "node", "node name", "module"),
}
"""The names of a column by its role, in lower case and without the unit."""
ROUND_TRIPS = ("rtt", "round trip", "round trip time", "round trip delay")
_UNIT_WORDS = {
    "byte": "B", "bytes": "B", "b": "B", "kb": "KB", "kib": "KiB", "mb": "MB", "mib": "MiB",
    "nsec": "ns", "usec": "us", "msec": "ms", "sec": "s", "seconds": "s", "milliseconds": "ms",
    "microseconds": "us", "nanoseconds": "ns",
}  # fmt: skip
_BRACKETED = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*")


@dataclass(frozen=True)
class Column:
    """A column with a role; `scale` makes ns or bytes of its plain numbers (None: each cell states its unit).

    `is_round_trip` halves the samples; `index` counts from 0.
    """

    role: str
    index: int
    name: str
    scale: Fraction | None
    is_round_trip: bool = False


class ColumnError(ValueError):
    """The columns say not enough, or too much; `hint` is what helps.

    Reported with the line of the header.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message, self.hint = message, hint


class OptionError(ColumnError):
    """An option names a role, a column or a unit that there is not: no mistake of the file.

    Reported without a line, because the file is not at fault.
    """


def find_columns(
    header: Sequence[str], stated: Mapping[str, str], units: Mapping[str, str]
) -> tuple[dict[str, Column], list[str]]:
    """The columns by their role, and the names of those that have none.

    Parameters
    ----------
    header
        the names of all columns.
    stated
        the name of the column of a role, before what its name would say.
    units
        the unit of the plain numbers of a role, or of a column by name.

    Raises
    ------
    OptionError
        when a stated column is not there, or a stated unit is none of its kind.
    ColumnError
        when a role has two columns, or a unit in the name of a column is none of its kind.

    Examples
    --------
    >>> found, others = find_columns(["data_size_bytes", "computer", "min_ms", "note"], {}, {})
    >>> [(role, column.name) for role, column in found.items()], others
    ([('size', 'data_size_bytes'), ('platform', 'computer'), ('min', 'min_ms')], ['note'])
    """
    columns: dict[str, Column] = {}
    others: list[str] = []
    taken = {name: role for role, name in stated.items()}
    for role, name in stated.items():
        if role not in NAMES:
            raise OptionError(f"--column {role}={name}: no column has the role {role!r}", f"roles: {', '.join(NAMES)}")
        if name not in header:
            raise OptionError(
                f"--column {role}={name}: there is no column {name!r}", f"columns: {', '.join(header[:12])}"
            )
    for index, name in enumerate(header):
        role, unit, plain = _meaning(name)
        role = taken.get(name, role if role not in stated else "")
        if not role:
            others.append(name)
            continue
        if role in columns:
            hint = f"say which with --column {role}=NAME"
            raise ColumnError(f"{columns[role].name!r} and {name!r} may both be the {role}", hint)
        key = next((key for key in (name, role) if key in units), None)
        unit = unit if key is None else units[key]
        try:
            columns[role] = Column(role, index, name, _scale(role, name, unit), plain in ROUND_TRIPS)
        except ColumnError as error:
            if key is None:
                raise
            raise OptionError(f"--unit {key}={unit}: {error.message}", error.hint) from error
    return columns, others


def _scale(role: str, name: str, unit: str) -> Fraction | None:
    """The factor to ns or bytes; 1 for texts and counts."""
    if role not in (*TIMES, "size"):
        return Fraction(1)
    if not unit:
        return None
    dimension, base = (DATA, "B") if role == "size" else (TIME, "ns")
    known = _known(unit, dimension)
    if known is None:
        example = "B, KB" if role == "size" else "ns, us, ms, s"
        raise ColumnError(f"{name!r}: {unit!r} is no unit of the {role}", f"such as {example}")
    return UNITS[known][0] / UNITS[base][0]


def _known(unit: str, dimension: Dimension) -> str | None:
    for text in (unit, _UNIT_WORDS.get(unit.lower(), "")):
        known = canonical_unit(text)
        if text and known in UNITS and UNITS[known][1] == dimension:
            return known
    return None


def _meaning(name: str) -> tuple[str, str, str]:
    """The role that the name of a column says ("" where it says none), its unit, and the name without it."""
    text = name.strip()
    bracketed = _BRACKETED.fullmatch(text)
    if bracketed is not None:
        words = plain_words(bracketed["name"])
        return _role(words), bracketed["unit"].strip(), words
    words = plain_words(text)
    if words == "bytes":
        return "size", "B", words
    role = _role(words)
    if role:
        return role, "", words
    head, _, last = words.rpartition(" ")
    dimension = DATA if _role(head) == "size" else TIME
    if head and _known(last, dimension) is not None:
        return _role(head), last, head
    return "", "", words


def plain_words(text: str) -> str:
    """A title of a column as lower-case words with one blank between them."""
    return " ".join(re.split(r"[\s_-]+", text.strip().lower())).strip()


def _role(plain: str) -> str:
    return next((role for role, names in NAMES.items() if plain in names), "")
