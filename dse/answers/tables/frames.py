"""Tables as pandas frames: each column says its unit, and comes in the unit that a person wants."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from numbers import Rational
from typing import TYPE_CHECKING, Any

from dse.answers.tables.display import PREFERRED, display_unit, scaled_unit, titled
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.units import MONEY, UnitError, is_unbounded, parse_quantity

if TYPE_CHECKING:
    import pandas

READABLE = "readable"
"""Asks for the units that engineers read: ms, %, KB/s, W, the currency; so does nothing at all."""
EXACT = "exact"
"""Asks for exact integers in the units in which figures are counted, where no other unit is asked for."""
COUNTED = (*PREFERRED, "B")
"""Counting units of dse's figures: a unit of their kind may be asked for."""


def unit_frame(
    columns: Sequence[str],
    rows: Sequence[Mapping[str, Any]],
    units: Mapping[str, str],
    wanted: str | Sequence[str] | None = None,
    currency: str = "EUR",
) -> pandas.DataFrame:
    """A frame of `columns`; those with a unit are headed ``NAME [UNIT]``.

    Parameters
    ----------
    columns, rows
        the names of the columns, and for each row its values by name.
    units
        the counting unit of each column of figures, such as ``ns``, ``ct`` or ``1/3 ppm``.
    wanted
        units such as ``"us"`` or ``("us", "%")`` for the columns of their kind; the others are in the units that
        engineers read, and all are floating-point. With ``"exact"`` the others stay exact integers in their counting
        unit.
    currency
        what the counting unit ``ct`` is a hundredth of.

    Raises
    ------
    UsageError
        when a wanted unit is none.

    Examples
    --------
    >>> rows = [{"jitter": 2_500_000}]
    >>> [list(unit_frame(["jitter"], rows, {"jitter": "ns"}, units).iloc[0].items()) for units in (None, "us", "exact")]
    [[('jitter [ms]', 2.5)], [('jitter [us]', 2500.0)], [('jitter [ns]', 2500000)]]
    """
    import pandas

    texts = arguments.texts("units", () if wanted is None else wanted)
    factors = {name: _factor(unit, texts, currency) for name, unit in units.items() if name in columns}
    heads = [titled(name, factors[name][1]) if name in factors else name for name in columns]
    values = [
        [_in_unit(row.get(name), factors[name][0]) if name in factors else row.get(name) for name in columns]
        for row in rows
    ]
    return pandas.DataFrame(values, columns=heads)


def mixed_frame(
    columns: Sequence[str],
    rows: Sequence[Mapping[str, Any]],
    figures: Sequence[str],
    wanted: str | Sequence[str] | None = None,
    currency: str | None = "EUR",
) -> pandas.DataFrame:
    """A frame of things that are counted in different units: column ``unit`` says that of the `figures` of its row.

    `wanted` as for `unit_frame`: the figures of rows of its kind are converted, to floating point; texts stay, and so
    do sums of money where `currency` is None.

    Examples
    --------
    >>> rows = [{"name": "jitter", "value": 2_500_000, "unit": "ns"}, {"name": "type", "value": "arm", "unit": None}]
    >>> mixed_frame(["name", "value", "unit"], rows, ["value"], "ms").iloc[0].tolist()
    ['jitter', 2.5, 'ms']
    """
    import pandas

    texts = arguments.texts("units", () if wanted is None else wanted)
    values = []
    for row in rows:
        factor, unit = _factor(row.get("unit") or "", texts, currency)
        shown = {name: _in_unit(row.get(name), factor if _is_figure(row.get(name)) else None) for name in figures}
        values.append([{**row, **shown, "unit": unit or row.get("unit")}.get(name) for name in columns])
    return pandas.DataFrame(values, columns=list(columns))


def _is_figure(value: Any) -> bool:
    """Whether it is a number, or a fraction as text; a verdict or the name of an option is none."""
    return isinstance(value, Rational) or (isinstance(value, str) and re.fullmatch(r"-?\d+/\d+", value) is not None)


def _in_unit(value: Any, factor: Fraction | None) -> Any:
    """A figure divided by what makes one of the unit; as it is where none was asked for."""
    if is_unbounded(value):
        return math.inf
    return value if value is None or factor is None else float(Fraction(value) / factor)


def _factor(unit: str, wanted: Sequence[str], currency: str | None) -> tuple[Fraction | None, str]:
    """How many of a counting unit make one of the unit to show, and that unit's name; None to leave figures exact."""
    scale, base = scaled_unit(unit)
    for text in wanted:
        if text in (READABLE, EXACT):
            continue
        try:
            quantity = parse_quantity(f"1 {text}")
        except UnitError as error:
            raise UsageError(f"units {text!r}: {error.message}") from error
        if quantity.dimension is None and text != base:
            raise UsageError(f"units {text!r}: no unit that figures can be shown in, such as 'ms', '%' or 'KB/s'")
        if quantity.dimension == MONEY and currency is not None and text != currency:
            raise UsageError(f"units {text!r}: money is counted in {currency} here")
        if base == "ct":
            if text == currency:
                return Fraction(100) * scale, text
        elif base in COUNTED:
            one = parse_quantity(f"1 {base}")
            if one.dimension == quantity.dimension:
                return quantity.value / one.value * scale, text
    if EXACT in wanted or not unit or (base == "ct" and currency is None):
        return None, unit
    return display_unit(unit, currency or "")
