"""Requirements that no design meets as bounds alone show, in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.bounds import Impossible
from dse.results.display import readable
from dse.units import format_duration, format_number, format_ratio

Bounds: TypeAlias = Mapping[tuple[str, str], Impossible]
"""What no design can have less (or more) of, by text and place of the requirement."""
DIGITS = 6
MOST_PARTS = 6
"""The greatest number of parts of a figure that are told; the largest."""


def bounds_of(found: Iterable[Impossible]) -> Bounds:
    """Bounds by the text and the place of their requirements."""
    return {(item.requirement.text, item.requirement.origin): item for item in found}


def impossible_words(item: Impossible, currency: str) -> str:
    """``no design meets latency of f <= 5 ms (p.yaml:12): it is at least 7 ms, the limit is 5 ms``."""
    requirement = item.requirement
    where = f" ({requirement.origin})" if requirement.origin else ""
    return f"no design meets {requirement.text}{where}: {bound_words(item, currency)}"


def bound_words(item: Impossible, currency: str) -> str:
    """``it is at least 7 ms, the limit is 5 ms``; for a deadline, what executes; of a sum also what it is made of."""
    value, limit = (_figure(figure, item.unit, currency) for figure in (item.value, item.limit))
    if item.requirement.metric.key == "deadline":
        return f"its own work takes {value} at its longest, the deadline is {limit}"
    return f"it is at {item.side} {value}, the limit is {limit}{_parts(item, currency)}"


def _parts(item: Impossible, currency: str) -> str:
    """The largest parts of a figure."""
    told = [f"{part.name} {_readable(part.value, item.unit, currency)}" for part in item.parts[:MOST_PARTS]]
    left = item.parts[MOST_PARTS:]
    if left:
        told.append(f"{len(left)} more {_readable(sum(part.value for part in left), item.unit, currency)}")
    return f": {', '.join(told)}" if told else ""


def _readable(value: Fraction | int, unit: str, currency: str) -> str:
    return readable(value, unit, currency, DIGITS)


def _figure(value: Fraction, unit: str, currency: str) -> str:
    """A figure in full; one without finite decimals to six, and as a fraction behind that."""
    text = _exact(value, unit, currency)
    is_fraction = "/" in text.split()[0]
    return f"{_readable(value, unit, currency)} (exact {text})" if is_fraction else text


def _exact(value: Fraction, unit: str, currency: str) -> str:
    if unit == "ns":
        return format_duration(value)
    if unit == "ppm":
        return format_ratio(value / 10**6)
    return f"{format_number(value / 100)} {currency}" if unit == "ct" else f"{format_number(value)} {unit}".rstrip()
