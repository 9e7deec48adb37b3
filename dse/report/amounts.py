"""Differences, slacks and shares in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import ceil, floor
from typing import Any, TypeAlias

from rich.cells import cell_len, set_cell_size

from dse.answers.ranking.changes import Delta
from dse.answers.ranking.reasons import Margin
from dse.answers.tables.display import NO_BOUND, counted, display_unit, each_core_words, readable
from dse.support.units import is_unbounded

PPM = 10**6


def deltas_words(items: Sequence[Delta], currency: str) -> str:
    """``Gains: price 290 EUR instead of 305 EUR (15 EUR less). Gives up: …. Unchanged: …``.

    Improved objectives first, then worsened ones, then those that are equal; `currency` is the code of prices, such as
    ``EUR``.
    """
    gains = [_delta(item, currency) for item in items if item.gain > 0]
    losses = [_delta(item, currency) for item in items if item.gain < 0]
    same = [item.name for item in items if not item.gain]
    parts = [f"Gains: {'; '.join(gains)}"] if gains else []
    parts += [f"Losses: {'; '.join(losses)}"] if losses else []
    parts += [f"Unchanged: {', '.join(same)}"] if same else []
    return ". ".join(parts)


def _delta(item: Delta, currency: str) -> str:
    after, before = counted(item.after, item.unit, currency), counted(item.before, item.unit, currency)
    if is_unbounded(item.after) or is_unbounded(item.before):
        return f"{item.name} {after} instead of {before}"
    return f"{item.name} {after} instead of {before} ({difference_words(item, currency)})"


def difference_words(item: Delta, currency: str) -> str:
    """``15 EUR less``; where one of the two is unbounded there is no difference.

    Rounded for display, in the unit that engineers read.
    """
    if is_unbounded(item.after) or is_unbounded(item.before):
        after, before = counted(item.after, item.unit, currency), counted(item.before, item.unit, currency)
        return f"{after} instead of {before}"
    change = item.after - item.before
    return f"{amount_words(abs(change), item.unit, currency)} {'more' if change > 0 else 'less'}"


def amount_words(value: Fraction | int, unit: str, currency: str, digits: int = 3) -> str:
    """A difference; between shares in percentage points, so that no reader takes it for a share of the value.

    >>> amount_words(39_900, "ppm", "EUR"), amount_words(1500, "ct", "EUR")
    ('3.99 percentage points', '15 EUR')
    """
    text = counted(value, unit, currency, digits)
    return text.removesuffix("%") + _points(text) if text.endswith("%") else text


def slack_words(slack: Fraction, unit: str, currency: str, digits: int = 6) -> str:
    """The slack between a value and its limit as text; a dash where the value is unbounded.

    Text such as ``1.934 ms``, in the unit that engineers read, rounded to `digits` decimals.
    """
    return "-" if is_unbounded(slack) else readable(slack, unit, currency, digits)


def _points(text: str) -> str:
    return "percentage point" if text == "1 %" else "percentage points"


def margin_words(margin: Margin, currency: str) -> str:
    """``load of can0 <= 40 %: 2.4 KB/s against 12.5 KB/s (40 % of 31.25 KB/s), slack 10.1 KB/s (80.8 % of the …)``.

    A limit without slack is said to bind; where one thread alone breaks a limit on cores it is named.
    """
    value, limit = readable(margin.value, margin.unit, currency), _limit_words(margin, currency)
    who = f"{margin.thread} alone, {value} against {limit}" if margin.thread else f"{value} against {limit}"
    if not margin.slack:
        return f"{margin.requirement.shown}: {who}. It binds: there is no slack."
    if is_unbounded(margin.slack):
        return f"{margin.requirement.shown}: {who}."
    slack = amount_words(margin.slack, margin.unit, currency)
    share = f" ({readable(margin.share * 10**6, 'ppm', digits=1)} of the limit)" if margin.limit else ""
    return f"{margin.requirement.shown}: {who}, slack {slack}{share}."


def _limit_words(margin: Margin, currency: str) -> str:
    """The limit, and of what it is a share: ``280 % (70 % of each of 4 cores)``, ``7.8 KB/s (50 % of 15.6 KB/s)``."""
    limit = readable(margin.limit, margin.unit, currency)
    if margin.thread:
        return f"{limit} of one core"
    whole = margin.capacity
    if whole is None or (margin.unit == "ppm" and whole == PPM):
        return limit
    if margin.unit == "ppm":
        return f"{limit} ({each_core_words(margin.limit, whole)})"
    return f"{limit} ({readable(margin.limit / whole * PPM, 'ppm')} of {readable(whole, margin.unit, currency)})"


def rate_words(loss: Delta, gain: Delta, currency: str) -> str:
    """The rate of a trade-off, loss per unit of gain: ``138.9 EUR per ms``.

    `loss` and `gain` are two objectives of one step on the front; their quotient is in display units, with four digits.
    """
    loss_factor, loss_unit = display_unit(loss.unit, currency)
    gain_factor, gain_unit = display_unit(gain.unit, currency)
    rate = (Fraction(-loss.gain) / loss_factor) / (Fraction(gain.gain) / gain_factor)
    loss_unit = "percentage points" if loss_unit == "%" else loss_unit
    gain_unit = "percentage point" if gain_unit == "%" else gain_unit
    worse = loss_unit or ("changes" if loss.name == "changes" else f"of {loss.name}")
    better = gain_unit or ("change" if gain.name == "changes" else f"1 of {gain.name}")
    return f"{float(rate):.4g} {worse} per {better}"


def shortened(text: str, room: int) -> str:
    """Text that takes at most `room` columns (wide letters take two), without its middle if need be.

    >>> shortened("implement_controller", 10), shortened("sprayer", 10)
    ('impl…oller', 'sprayer')
    """
    head = room // 2 - 1
    if cell_len(text) <= room:
        return text
    return f"{set_cell_size(text, head).rstrip()}…{set_cell_size(text[::-1], room - head - 1)[::-1].lstrip()}"


def listed(items: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``.

    Items are joined by commas and a final "and"; no items give an empty text.
    """
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


# Figures and designs as the data of studies have them, in words.


Data: TypeAlias = Mapping[str, Any]
MOST_ROWS = 400
"""The greatest number of rows of a table in a page; CSV and JSON have all."""


def decisions_text(chosen: Mapping[str, str], names: Sequence[str]) -> str:
    """The text of the named decisions of a design.

    Text such as ``computer Spectra, ekf.period 5 ms``, in the order of `names`; the suffix ``.type`` is dropped.
    """
    return ", ".join(f"{name.removesuffix('.type')} {chosen[name]}" for name in names if name in chosen)


def number_of(value: Any, unit: str, currency: str) -> float | None:
    """A figure as a number of the unit that engineers read; None where it is unbounded, and cannot be drawn.

    `value` is in the base unit `unit`; the result is a float for plots only.
    """
    if value is None or is_unbounded(value):
        return None
    return float(Fraction(value) / display_unit(unit, currency)[0])


def safe_text(value: Fraction, unit: str, currency: str, *, is_least: bool) -> str:
    """A bound in three decimals at most, rounded so that what is printed keeps it: a least value up, a greatest down.

    `value` is in the base unit `unit`; what three decimals would distort is written in full.

    >>> safe_text(Fraction(10_724_753), "ns", "EUR", is_least=True)
    '10.725 ms'
    """
    factor, name = display_unit(unit, currency)
    thousandths = value / factor * 1000
    if 0 < abs(thousandths) < 100:
        return figure_text(value, unit, currency)
    rounded = Fraction(ceil(thousandths) if is_least else floor(thousandths), 1000)
    return f"{readable(rounded, '')} {name}".rstrip()


def figure_text(value: Any, unit: str, currency: str) -> str:
    """An input or a metric for people, in full where its unit has no other form; None is unbounded.

    `value` is exact, in the base unit `unit`; up to six decimals are shown, other units are written with nine digits.
    """
    if value is None or is_unbounded(value):
        return NO_BOUND
    if unit in ("ns", "ct", "ppm", "mW", "B/s", "nm"):
        return readable(Fraction(value), unit, currency, 6)
    number = Fraction(value)
    return f"{number if number.denominator == 1 else format(float(number), '.9g')} {unit}".strip()
