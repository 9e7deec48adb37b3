"""Figures for people: the units that engineers read, rounded for display only."""

from __future__ import annotations

from fractions import Fraction

READABLE: dict[str, tuple[tuple[str, Fraction], ...]] = {
    "ns": (("s", Fraction(10**9)), ("ms", Fraction(10**6)), ("us", Fraction(1000)), ("ns", Fraction(1))),
    "nm": (("m", Fraction(10**9)), ("cm", Fraction(10**7)), ("mm", Fraction(10**6)), ("nm", Fraction(1))),
    "B/s": (("MB/s", Fraction(10**6)), ("KB/s", Fraction(1000)), ("B/s", Fraction(1))),
    "ppm": (("%", Fraction(10**4)),),
    "mW": (("W", Fraction(1000)),),
}
PREFERRED = {"ns": "ms", "nm": "cm", "ppm": "%", "mW": "W", "B/s": "KB/s"}


def readable(value: Fraction | int, unit: str, currency: str = "EUR", digits: int = 3) -> str:
    """A value in a base unit as text in the unit that engineers read: ``13.436 ms``, ``15.2 %``, ``900 EUR``."""
    if unit == "ct":
        return _rounded(Fraction(value) / 100, 2, keep=Fraction(value) % 100 != 0) + f" {currency}"
    name = PREFERRED.get(unit)
    if name is None:
        return f"{_rounded(Fraction(value), digits)} {unit}"
    factor = dict(READABLE[unit])[name]
    return f"{_rounded(Fraction(value) / factor, digits)} {name}"


def _rounded(value: Fraction, digits: int, keep: bool = False) -> str:
    """Decimal text with at most `digits` decimals (half to even), without trailing zeros unless `keep`."""
    text = f"{round(value, digits).__float__():,.{digits}f}".replace(",", " ") if digits else str(round(value))
    return text if keep or "." not in text else text.rstrip("0").rstrip(".")
