"""JSON that others may have written: read strictly, so that what is read can be computed with and written again."""

from __future__ import annotations

import json
import re
from math import isfinite
from typing import Any, NoReturn

MAX_DEPTH = 64
LONG = 100
_ENDLESS = re.compile(r"[-+]?[\d_]*\.?[\d_]*[eE][-+]?[\d_]{4,}")


def parse_json(text: str) -> Any:
    """The data of a JSON text.

    Raises
    ------
    ValueError
        when it is no JSON, is nested deeper than `MAX_DEPTH`, or holds a number that is none (NaN, infinities, 1e999)
        or that nobody can compute with (text such as 1e999999999), or text that is no Unicode (lone surrogates) and
        cannot be written again.
    """
    try:
        data = json.loads(text, parse_constant=_no_number, parse_float=_finite)
    except RecursionError:
        raise ValueError(f"nested deeper than {MAX_DEPTH} levels") from None
    _check(data)
    return data


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


def _finite(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        _no_number(text)
    return value


def _check(data: Any) -> None:
    """Depth and texts, without recursion."""
    waiting = [(data, 0)]
    while waiting:
        item, depth = waiting.pop()
        if isinstance(item, str):
            _check_text(item)
        elif isinstance(item, dict | list):
            if depth >= MAX_DEPTH:
                raise ValueError(f"nested deeper than {MAX_DEPTH} levels")
            if isinstance(item, dict):
                waiting += [(key, depth) for key in item]
            waiting += [(part, depth + 1) for part in (item.values() if isinstance(item, dict) else item)]


def _check_text(text: str) -> None:
    if len(text) < LONG and _ENDLESS.fullmatch(text.strip()):
        raise ValueError(f"{text!r} is no number that can be computed with")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        code = f"U+{ord(text[error.start]):04X}"
        raise ValueError(f"a text holds {code}, half of a character that is written in two") from None
