"""Figures for people: the units that engineers read, rounded for display only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, cast

from dse.analysis.diagnosis.unbounded import may_be_unbounded, unbounded_from
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.space.model.criteria import Metric
from dse.space.model.space import Space
from dse.support.units import Exact, Unbounded, is_unbounded
from dse.support.units.text import writable

READABLE: dict[str, tuple[tuple[str, Fraction], ...]] = {
    "ns": (("s", Fraction(10**9)), ("ms", Fraction(10**6)), ("us", Fraction(1000)), ("ns", Fraction(1))),
    "nm": (("m", Fraction(10**9)), ("cm", Fraction(10**7)), ("mm", Fraction(10**6)), ("nm", Fraction(1))),
    "B/s": (("MB/s", Fraction(10**6)), ("KB/s", Fraction(1000)), ("B/s", Fraction(1))),
    "ppm": (("%", Fraction(10**4)),),
    "mW": (("W", Fraction(1000)),),
}
MOST_DIGITS = 9
PREFERRED = {"ns": "ms", "nm": "cm", "ppm": "%", "mW": "W", "B/s": "KB/s"}


PPM = 10**6
NO_BOUND = "unbounded"
"""The text in place of a figure in which a response time has no bound."""


def exact(value: Exact) -> int | str | None:
    """A figure as JSON has it: an integer, or a fraction as text; None where it is unbounded.

    A fraction too long to be read back is rounded up (`dse.support.units.text.writable`).

    >>> exact(Fraction(6, 3)), exact(Fraction(50, 3)), exact(Fraction(10**400 + 1, 2 * 10**400))
    (2, '50/3', '500000000000001/1000000000000000')
    """
    if is_unbounded(value):
        return None
    value = writable(value)
    return int(value) if value.denominator == 1 else f"{value.numerator}/{value.denominator}"


def figure(value: int | str | None) -> Fraction:
    """The number that `exact` wrote, read again.

    Text or integer of a JSON file as an exact fraction; null (None) becomes the number that stands for an unbounded
    figure.
    """
    return Unbounded(UNBOUNDED_NS) if value is None else Fraction(value)


def without_stand_in(space: Space, metric: Metric, unit: str, value: int) -> int:
    """A value of a search or a proof, in a counting unit, as it is shown: unbounded where a stand-in was counted.

    What only the stand-in for an unbounded response time has reached is unbounded.
    """
    scale, _ = scaled_unit(unit)
    if may_be_unbounded(space, metric) and abs(value) >= unbounded_from(space, metric) * scale:
        return cast(int, Unbounded(value))
    return value


def figures_of(values: Mapping[str, Exact]) -> dict[str, int | str | None]:
    """Figures by name as JSON has them.

    Integers where values are whole, else fractions as text such as ``"1/3"``, null for unbounded ones.
    """
    return {name: exact(value) for name, value in values.items()}


def in_table(value: Any) -> Any:
    """The text or number in a cell of a CSV file: `NO_BOUND` for an unbounded figure, other values unchanged."""
    return NO_BOUND if is_unbounded(value) else value


def readable(value: Fraction | int, unit: str, currency: str = "EUR", digits: int = 3) -> str:
    """A value in a base unit as text in the unit that engineers read: ``13.436 ms``, ``15.2 %``, ``900 EUR``.

    Rounded to `digits` decimals for display only; prices without cents where they are whole.
    """
    if is_unbounded(value):
        return NO_BOUND
    if unit == "ct":
        return _rounded(Fraction(value) / 100, 2, keep=Fraction(value) % 100 != 0) + f" {currency}"
    name = PREFERRED.get(unit)
    if name is None:
        return f"{_rounded(Fraction(value), digits)} {unit}".rstrip()
    factor = dict(READABLE[unit])[name]
    return f"{_rounded(Fraction(value) / factor, digits)} {name}"


def scaled_unit(unit: str) -> tuple[int, str]:
    """The number of counting units in one base unit, and the base unit.

    >>> scaled_unit("ns"), scaled_unit("1/3 ppm"), scaled_unit("1/3 ")
    ((1, 'ns'), (3, 'ppm'), (3, ''))
    """
    if not unit.startswith("1/"):
        return 1, unit
    scale, _, base = unit.removeprefix("1/").partition(" ")
    return int(scale), base


def in_base_units(counts: Mapping[str, int], units: Mapping[str, str]) -> dict[str, Fraction]:
    """Figures by name in the base units of those in which they are counted.

    >>> in_base_units({"use": 7, "price": 300}, {"use": "1/3 ppm", "price": "ct"})
    {'use': Fraction(7, 3), 'price': Fraction(300, 1)}
    """
    return {name: Fraction(1) * value / scaled_unit(units[name])[0] for name, value in counts.items()}


def display_unit(unit: str, currency: str = "EUR") -> tuple[Fraction, str]:
    """The number of counting units (``ns``, ``1/3 ppm``) in one unit that engineers read, and that unit's name.

    >>> display_unit("ns"), display_unit("1/3 ppm")
    ((Fraction(1000000, 1), 'ms'), (Fraction(30000, 1), '%'))
    """
    count, base = scaled_unit(unit)
    if base == "ct":
        return Fraction(100 * count), currency
    name = PREFERRED.get(base, base)
    return dict(READABLE.get(base, ())).get(name, Fraction(1)) * count, name


def titled(name: str, unit: str) -> str:
    """A name with its unit, as the title of an axis or a column: ``price [EUR]``; a count has none.

    >>> titled("price", "EUR"), titled("changes", ""), titled("a third of the changes", "1/3 ")
    ('price [EUR]', 'changes', 'a third of the changes [1/3]')
    """
    return f"{name} [{unit.strip()}]" if unit else name


def counted(value: Fraction | int, unit: str, currency: str = "EUR", digits: int = 3) -> str:
    """A value in a counting unit (``1/3 ppm``) as `readable` shows it; never 0 for what is not 0.

    >>> counted(1_000_000, "1/3 ppm"), counted(40, "ns")
    ('33.333 %', '0.00004 ms')
    """
    if is_unbounded(value):
        return NO_BOUND
    scale, base = scaled_unit(unit)
    amount = Fraction(value) / scale
    factor, _ = display_unit(base)
    while amount and digits < MOST_DIGITS and not round(amount / factor, digits):
        digits += 1
    return readable(amount, base, currency, digits)


def column(values: Sequence[int | Fraction], unit: str, currency: str = "EUR") -> tuple[str, list[str]]:
    """The unit that engineers read, and values in it with equally many decimals: 3, or for money 2 or none.

    Where a value that is not 0 would be shown as 0 there are more.

    >>> column([14_530_000, 11_977_000], "ns"), column([104_000, 29_000], "ct")
    (('ms', ['14.530', '11.977']), ('EUR', ['1 040', '290']))
    """
    factor, name = display_unit(unit, currency)
    shown = [value if is_unbounded(value) else Fraction(value) / factor for value in values]
    bounded = [value for value in shown if not is_unbounded(value)]
    is_whole = all(Fraction(value).denominator == 1 for value in bounded)
    digits = (0 if is_whole else 2) if scaled_unit(unit)[1] == "ct" or (not name and is_whole) else 3
    while digits < MOST_DIGITS and any(value and not round(Fraction(value), digits) for value in bounded):
        digits += 1
    return name, [NO_BOUND if is_unbounded(value) else _rounded(Fraction(value), digits, keep=True) for value in shown]


def each_core_words(limit: Fraction, whole: Fraction) -> str:
    """The words for a limit on several cores together, of capacity `whole`, as a limit for each; in ppm of one core.

    >>> each_core_words(Fraction(2_800_000), Fraction(4_000_000))
    '70 % of each of 4 cores'
    """
    return f"{readable(limit / whole * PPM, 'ppm', digits=6)} of each of {whole / PPM} cores"


def of_cores(capacity: Fraction) -> str:
    """The words for the capacity of a processor, on the scale on which one core is 100 %.

    >>> of_cores(Fraction(4_000_000)), of_cores(Fraction(1_000_000))
    ('of 400 % (4 cores)', 'of its core')
    """
    count = int(capacity / PPM)
    return "of its core" if count == 1 else f"of {count * 100} % ({count} cores)"


def _rounded(value: Fraction, digits: int, keep: bool = False) -> str:
    """Decimal text with at most `digits` decimals (half to even), without trailing zeros unless `keep`."""
    text = f"{round(value, digits).__float__():,.{digits}f}" if digits else f"{round(value):,}"
    text = text.replace(",", " ")
    return text if keep or "." not in text else text.rstrip("0").rstrip(".")
