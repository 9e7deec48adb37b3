"""The same problem in other words: other names, another order of entries, other units; and with other limits."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import yaml

from tests.oracle.generator import to_yaml

CATALOGUES = ("processor_types", "bus_types", "device_types", "thread_types")
COMPONENTS = ("processors", "buses", "devices", "threads", "connections")
NAMED = (*CATALOGUES, *COMPONENTS, "flows", "metrics", "totals")
UNORDERED = (*CATALOGUES, *COMPONENTS, "flows", "metrics", "requirements", "rules")
SYNONYMS = (
    {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9},
    {"bit": 1, "B": 8, "KB": 8_000, "kB": 8_000, "KiB": 8_192},
    {"mg": 1, "g": 10**3, "kg": 10**6},
    {"bit/s": 1, "kbit/s": 10**3, "Mbit/s": 10**6, "B/s": 8, "KB/s": 8_000, "Kbitsps": 10**3, "KBytesps": 8_000},
    {"Hz": 1, "kHz": 10**3, "MHz": 10**6},
    {"mW": 1, "W": 10**3, "kW": 10**6},
    {"%": 10_000, "ppm": 1},
    {"nm": 1, "um": 10**3, "mm": 10**6, "cm": 10**7, "m": 10**9},
    {"mm/s": 1, "cm/s": 10, "m/s": 1_000},
)
"""Units that measure the same, by their size."""
_UNIT = "|".join(sorted((re.escape(unit) for units in SYNONYMS for unit in units), key=len, reverse=True))
_QUANTITY = re.compile(rf"(?<![\w.])(\d+(?:\.\d+)?)\s*({_UNIT})(?![\w/])")

Document = dict[str, Any]


def document_of(text: str) -> Document:
    """A problem file as dictionaries of texts."""
    return yaml.load(text, Loader=yaml.BaseLoader)


def renamed(document: Document) -> tuple[Document, dict[str, str]]:
    """Every name replaced by another that sorts the other way round; blanks stay blanks. With the names."""
    old = [name for section in NAMED for name in document.get(section) or {}]
    old += [body["process"] for body in (document.get("threads") or {}).values() if "process" in body]
    names = list(dict.fromkeys(old))
    new = {
        name: ("y {}" if " " in name else "x{}").format(len(names) - position) for position, name in enumerate(names)
    }
    pattern = re.compile(rf"(?<!\w)({'|'.join(sorted(map(re.escape, names), key=len, reverse=True))})(?!\w)")
    return _mapped(document, lambda text: pattern.sub(lambda match: new[match[1]], text), keys=True), new


def reordered(document: Document, rng: random.Random) -> Document:
    """The entries of every section, and the alternatives of every list, in another order; objectives stay in place."""
    result = {key: _shuffled(value, rng) if key in UNORDERED else value for key, value in document.items()}
    head = {key: result.pop(key) for key in ("dse", "name")}
    return head | _shuffled_items(result, rng)


def _shuffled(value: Any, rng: random.Random) -> Any:
    if isinstance(value, dict):
        whole = {key: item if key == "path" else _shuffled(item, rng) for key, item in value.items()}
        return _shuffled_items(whole, rng)
    return rng.sample(value, len(value)) if isinstance(value, list) else value


def _shuffled_items(value: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    return dict(rng.sample(list(value.items()), len(value)))


def in_other_units(document: Document, rng: random.Random) -> Document:
    """Every quantity in some other unit of its kind, to the last digit the same; totals have only their own."""
    totals = tuple(f"{name} " for name in document.get("totals") or {})

    def rewrite(text: str) -> str:
        if text.startswith(totals):
            return text
        return _QUANTITY.sub(lambda match: _converted(Fraction(match[1]), match[2], rng), text)

    changed = _mapped({key: value for key, value in document.items() if key != "totals"}, rewrite, keys=False)
    return _with_own_totals(changed, document)


def _with_own_totals(changed: Any, document: Any) -> Any:
    """The figures of totals as they were."""
    if not isinstance(document, dict):
        return changed
    return {key: value if key == "totals" else _with_own_totals(changed[key], value) for key, value in document.items()}


def _converted(number: Fraction, unit: str, rng: random.Random) -> str:
    units = next(units for units in SYNONYMS if unit in units)
    choices = [(text, other) for other in units if (text := decimal(number * units[unit] / units[other])) is not None]
    text, other = rng.choice(choices)
    return rng.choice([f"{text} {other}", f"{text}{other}"])


def decimal(value: Fraction) -> str | None:
    """A finite decimal text, or None where there is none of reasonable length."""
    for places in range(16):
        scaled = abs(value) * 10**places
        if scaled.denominator == 1:
            digits, sign = str(int(scaled)).rjust(places + 1, "0"), "-" if value < 0 else ""
            return f"{sign}{digits[:-places]}.{digits[-places:]}" if places else sign + digits
    return None


def _mapped(value: Any, change: Callable[[str], str], keys: bool, top: bool = True) -> Any:
    """Every text changed; keys too, where asked for, except for the sections themselves."""
    if isinstance(value, dict):
        return {
            (change(key) if keys and not top else key): _mapped(item, change, keys, top=False)
            for key, item in value.items()
            if not (top and key in ("name", "dse"))
        } | ({key: value[key] for key in ("dse", "name")} if top else {})
    if isinstance(value, list):
        return [_mapped(item, change, keys, top=False) for item in value]
    return change(value)


def with_limit(document: Document, position: int, factor: Fraction) -> Document | None:
    """The requirement at a position with its limit times a factor; None where the limit has no unit to write it in."""
    text = document["requirements"][position]
    match = re.search(r"(\d+(?:\.\d+)?)\s*(\S+)$", text)
    number = None if match is None else decimal(Fraction(match[1]) * factor)
    if match is None or number is None or (match[2] == "EUR" and len(number.partition(".")[2]) > 2):
        return None
    requirements = list(document["requirements"])
    requirements[position] = f"{text[: match.start()]}{number} {match[2]}"
    return {**document, "requirements": requirements}


def text_of(document: Document) -> str:
    """The document as a problem file."""
    return to_yaml(document)
