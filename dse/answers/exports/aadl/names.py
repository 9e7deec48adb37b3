"""Names and quantities of problem files as AADL writes them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from typing import Any

from dse.spec.loading.writing import yaml_text
from dse.support.units import (
    Exact,
    TimeRange,
    UnitError,
    format_number,
    format_time_range,
    parse_bandwidth_bps,
    parse_instructions,
    parse_size_bytes,
    parse_speed_mips,
    unrounded,
)

_QUANTITY = re.compile(r"(\d+(?:\.\d+)?)\s*([A-Za-zµμ]+)")
_TIMES = {"ps": "ps", "ns": "ns", "us": "us", "µs": "us", "μs": "us", "ms": "ms", "s": "sec", "min": "min", "h": "hr"}
_PS = {"ps": 1, "ns": 10**3, "us": 10**6, "ms": 10**9, "sec": 10**12, "min": 60 * 10**12, "hr": 3600 * 10**12}
_RESERVED = """
abstract access all and annex applies binding bus calls classifier compute connections constant data delta device end
enumeration event extends false feature features flow flows group implementation in inherit initial internal inverse is
list memory mode modes none not of or out package parameter path port private process processor properties property
prototype prototypes provides public range record reference refined renames requires self set sink source subcomponents
subprogram system thread to true type units value virtual with
"""
RESERVED = frozenset(_RESERVED.split())
"""Words that are no names in AADL."""


def identifier(name: str, taken: set[str]) -> str:
    """A name as an AADL identifier that is not taken yet, and is now.

    >>> identifier("ekf.main loop", set()), identifier("end", set()), identifier("a", {"a"})
    ('ekf_main_loop', 'end_1', 'a_1')
    """
    stem = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "x"
    stem = stem if stem[0].isalpha() else f"x_{stem}"
    unique, number = stem, 0
    while unique.lower() in taken or unique.lower() in RESERVED:
        number += 1
        unique = f"{stem}_{number}"
    taken.add(unique.lower())
    return unique


def quoted(text: str) -> str:
    r"""A text in quotes; those within it as OSATE reads them, with a backslash.

    >>> print(quoted('load of "the bus"'))
    "load of \"the bus\""
    """
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def times(text: Any, *, as_range: bool = True) -> str | None:
    """A time or a range of times, in whole numbers of a unit; None where AADL has no form for it, such as ``1/3 ns``.

    AADL's Time is an aadlinteger: OSATE takes no ``1.3 ms``.

    >>> times("243 us .. 1.3 ms"), times("2 s"), times("2 s", as_range=False), times("1/3 ns")
    ('243 us .. 1300 us', '2 sec .. 2 sec', '2 sec', None)
    """
    ends = []
    for part in str(text).split(".."):
        match = _QUANTITY.fullmatch(part.strip())
        if match is None or match[2] not in _TIMES:
            return None
        whole = _whole(Fraction(match[1]), _TIMES[match[2]])
        if whole is None:
            return None
        ends.append(whole)
    if not as_range:
        return ends[0] if len(ends) == 1 else None
    return f"{ends[0]} .. {ends[-1]}"


def _whole(value: Fraction, unit: str) -> str | None:
    """A time in the greatest unit up to its own in which it is a whole number."""
    in_ps = value * _PS[unit]
    units = [word for word, size in _PS.items() if size <= _PS[unit] and (in_ps / size).denominator == 1]
    return f"{in_ps / _PS[units[-1]]} {units[-1]}" if units else None


def output_rate(hertz: Fraction) -> str | None:
    """Messages in a second as AADL's Output_Rate; None where that has no end as a decimal number.

    >>> output_rate(Fraction(25, 2)), output_rate(Fraction(1, 3))
    ('Output_Rate => [Value_Range => 12.5 .. 12.5; Rate_Unit => PerSecond;]', None)
    """
    text = real(hertz)
    return text and f"Output_Rate => [Value_Range => {text} .. {text}; Rate_Unit => PerSecond;]"


def real(value: Fraction) -> str | None:
    """An aadlreal; None where it has no end as a decimal number.

    Exact decimal text with a point, such as ``0.25``; None for fractions such as 1/3.
    """
    text = format((Decimal(value.numerator) / value.denominator).normalize(), "f")
    return (text if "." in text else f"{text}.0") if Fraction(text) == value else None


def written_range(ends: tuple[Exact, Exact]) -> str:
    """A range of times in ns, in whole ns: the least rounded down, the most up.

    Text such as ``1 ms .. 2 ms``. Rounding outwards keeps the exported model's bounds safe.
    """
    return format_time_range(TimeRange(int(ends[0] // 1), int(-(-ends[1] // 1))))


def size(text: Any) -> str | None:
    """A size in bytes, or in bits where it is no whole number of them.

    Text such as ``8 Bytes`` or ``93 bits``; None where `text` is no size.
    """
    try:
        return size_in_units(parse_size_bytes(str(text)))
    except (UnitError, ValueError, TypeError):
        return None


def size_in_units(size_bytes: int) -> str:
    """A size in bytes as AADL's Data_Size: in bits where it was stated in bits, and is a whole number of them.

    Text such as ``8 Bytes`` or ``93 bits``; `size_bytes` may carry the exact size that was rounded up to whole bytes.
    """
    bits = 8 * Fraction(unrounded(size_bytes))
    return f"{bits} bits" if bits % 8 and bits.denominator == 1 else f"{size_bytes} Bytes"


def bandwidth(text: Any) -> str | None:
    """A bandwidth in bit/s.

    Text such as ``250000.0 bitsps``; None where `text` is no bandwidth.
    """
    try:
        return f"{parse_bandwidth_bps(str(text))}.0 bitsps"  # an aadlreal: OSATE takes no whole number
    except (UnitError, ValueError, TypeError):
        return None


def speed(text: Any) -> str | None:
    """The speed of a processor in MIPS.

    Text such as ``1200.0 MIPS``; None where `text` is no speed, or has no end as a decimal number.
    """
    try:
        number = format_number(parse_speed_mips(str(text)))
    except (UnitError, ValueError, TypeError):
        return None
    return None if "/" in number else f"{number}{'' if '.' in number else '.0'} MIPS"


def instructions(text: Any) -> str | None:
    """The instructions of a dispatch, as a range.

    Text such as ``1000.0 IPD .. 1000.0 IPD`` (instructions per dispatch); None where `text` is no number of
    instructions, or has no end as a decimal number.
    """
    try:
        number = format_number(parse_instructions(str(text)))
    except (UnitError, ValueError, TypeError):
        return None
    value = f"{number}{'' if '.' in number else '.0'} IPD"
    return None if "/" in number else f"{value} .. {value}"


def real_size(text: Any) -> str | None:
    """A size in bytes, where AADL wants a real number.

    Text such as ``8.0 Bytes``; None where `text` is no size.
    """
    whole = size(text)
    return None if whole is None else whole.replace(" ", ".0 ")


def extra(fields: Iterable[tuple[str, Any]]) -> str | None:
    """Fields that AADL has no word for, as a list of texts ``key: value``.

    One list of AADL strings for the property ``Extra``, which `dse import` reads back; None without fields.
    """
    items = [quoted(f"{key}: {_flow(value)}") for key, value in fields]
    return f"({', '.join(items)})" if items else None


def _flow(value: Any) -> str:
    """A value in one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{yaml_text(str(key))}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, str):
        text = yaml_text(value)
        is_plain = value.isprintable() and not set(value) & {'"', "\\"}
        return "'" + value.replace("'", "''") + "'" if text.startswith('"') and is_plain else text
    return json.dumps(value)


def comment(lines: Iterable[str]) -> str:
    """Lines as comments.

    Each line begins with ``--`` and ends with a newline; characters that do not print become blanks.
    """
    safe = ("".join(char if char.isprintable() else " " for char in line) for line in lines)
    return "".join(f"-- {line}\n" for line in safe)


PROCESSES = ("thread group", "process", "system")
APPLIES_TO = {
    "Period": ("thread", "device", *PROCESSES, "virtual processor", "virtual bus", "bus"),
    "Deadline": ("thread", "device", *PROCESSES, "virtual processor"),
    "Compute_Execution_Time": ("thread", "device", "subprogram"),
    "SEI::Response_Time": ("thread", "device", "subprogram"),
    "Dispatch_Protocol": ("thread", "device", "virtual processor"),
    "Dispatch_Offset": ("thread",),
    "Priority": ("thread", "device", *PROCESSES, "data"),
}
"""The categories to which the predeclared property sets admit a property."""


def applies_to(name: str, category: str) -> bool:
    """Whether a property may be set of components of a category; an abstract one may have all.

    `name` is a property of AADL, `category` a component category such as ``thread`` or ``device`` (SAE AS5506C).
    """
    return category == "abstract" or category in APPLIES_TO[name]
