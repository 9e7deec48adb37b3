"""Units: exact in both directions, strict about everything that is not a quantity."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dse.support import units
from dse.support.units import Money, Quantity, Rounding, TimeRange, Total, UnitError

BIG = 10**15
fractions = st.fractions(min_value=0, max_value=BIG, max_denominator=10**6)


@given(st.integers(0, BIG))
def test_integer_formats_read_back(value: int) -> None:
    for rounding in Rounding:
        assert units.parse_duration_ns(units.format_duration(value), rounding) == value
    assert units.parse_size_bytes(units.format_size(value)) == value
    assert units.parse_power_mw(units.format_power(value)) == value
    assert units.parse_bandwidth_bps(units.format_bandwidth(value + 1)) == value + 1
    assert units.parse_period_ns(units.format_duration(value + 1)) == value + 1


@given(st.integers(0, BIG), st.integers(0, BIG))
def test_time_range_reads_back(low: int, width: int) -> None:
    value = TimeRange(low, low + width)
    assert units.parse_time_range_ns(units.format_time_range(value)) == value


@given(fractions)
def test_fraction_formats_read_back(value: Fraction) -> None:
    assert units.parse_data_rate(units.format_data_rate(value)) == value
    assert units.parse_rate_hz(units.format_rate(value + 1)) == value + 1
    assert units.parse_ratio(units.format_ratio(value)) == value


@given(fractions, st.sampled_from(["g", "kg m", "points", "m", "%", "€/a", "ms"]))
def test_total_reads_back(value: Fraction, unit: str) -> None:
    assert units.parse_total(units.format_total(Total(value, unit))) == Total(value, unit)


@given(st.integers(0, BIG), st.sampled_from(units.CURRENCIES))
def test_money_reads_back(cents: int, currency: str) -> None:
    assert units.parse_money(units.format_money(Money(cents, currency))) == Money(cents, currency)


@given(st.text(max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    for reader in READERS:
        with suppress(UnitError):
            reader(text)


@given(st.integers(1, 10**6), st.sampled_from(["", "k", "M"]))
def test_larger_units_are_multiples(number: int, prefix: str) -> None:
    factor = {"": 1, "k": 10**3, "M": 10**6}[prefix]
    assert units.parse_bandwidth_bps(f"{number} {prefix}bit/s") == number * factor
    assert units.parse_bandwidth_bps(f"{number} {prefix.upper()}Bytesps") == number * factor * 8


READERS: tuple[Callable[[str], Any], ...] = (
    units.parse_quantity,
    units.parse_period_ns,
    units.parse_time_range_ns,
    units.parse_size_bytes,
    units.parse_bandwidth_bps,
    units.parse_data_rate,
    units.parse_rate_hz,
    units.parse_money,
    units.parse_power_mw,
    units.parse_ratio,
    units.parse_total,
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10 ms", "10 ms"),
        ("1300 us", "1.3 ms"),
        ("756.8us", "756.8 us"),
        ("87 ns", "87 ns"),
        ("0 s", "0 ns"),
        ("1.5e-3 s", "1.5 ms"),
        ("1/2 ms", "500 us"),
        ("5 µs", "5 us"),
        ("2 min", "120 s"),
        ("+1 h", "3600 s"),
    ],
)
def test_duration_text(text: str, expected: str) -> None:
    assert units.format_duration(units.parse_duration_ns(text, Rounding.EXACT)) == expected


def test_rounding_follows_the_named_direction() -> None:
    assert units.parse_duration_ns("1.5 ns", Rounding.DOWN) == 1
    assert units.parse_duration_ns("1.5 ns", Rounding.UP) == 2
    with pytest.raises(UnitError, match="whole number of ns"):
        units.parse_duration_ns("1.5 ns", Rounding.EXACT)
    assert units.parse_time_range_ns("1.5 ns .. 1.6 ns") == (1, 2)
    assert units.parse_time_range_ns("1.5 ns") == (1, 2)
    assert units.parse_size_bytes("9 bit") == 2
    assert units.parse_bandwidth_bps("1.9 bit/s") == 1
    assert units.parse_money("1.001 EUR") == Money(101, "EUR")
    assert units.parse_power_mw("0.1 mW") == 1
    with pytest.raises(UnitError, match="not a whole number"):
        units.round_to_int(Fraction(1, 2), Rounding.EXACT)


def test_the_report_s_figures() -> None:
    assert units.parse_bandwidth_bps("15.625 KB/s") == 125_000
    assert units.parse_bandwidth_bps("15.625 KBytesps") == 125_000
    assert units.parse_data_rate("11520 B/s") == 11520
    assert units.parse_size_bytes("1 KiB") == 1024
    assert (
        units.parse_size_bytes("1.5 kB")
        == units.parse_size_bytes("1.5 KB")
        == units.parse_size_bytes("12 kbit")
        == 1500
    )
    assert units.parse_bandwidth_bps("100 kB/s") == 800_000
    assert units.parse_quantity("0.6 m/s") == Quantity(Fraction(3, 5), units.SPEED, "m/s")
    assert units.parse_quantity("36 km/h").value == 10


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (units.format_time_range(TimeRange(243_000, 1_300_000)), "243 us .. 1.3 ms"),
        (units.format_time_range(TimeRange(5, 5)), "5 ns"),
        (units.format_size(1500), "1500 B"),
        (units.format_size(2000), "2 KB"),
        (units.format_bandwidth(125_000), "125 kbit/s"),
        (units.format_bandwidth(115_200), "115.2 kbit/s"),
        (units.format_rate(Fraction(50, 3)), "50/3 Hz"),
        (units.format_rate(Fraction(20)), "20 Hz"),
        (units.format_money(Money(15000, "EUR")), "150 EUR"),
        (units.format_money(Money(9990, "EUR")), "99.90 EUR"),
        (units.format_money(Money(-5, "EUR")), "-0.05 EUR"),
        (units.format_duration(-1_500_000), "-1.5 ms"),
        (units.format_power(5000), "5 W"),
        (units.format_ratio(Fraction(7, 10)), "70 %"),
        (units.format_total(Total(Fraction(90), "g")), "90 g"),
    ],
)
def test_canonical_text(value: str, expected: str) -> None:
    assert value == expected


@pytest.mark.parametrize(
    ("reader", "text", "message"),
    [
        (units.parse_period_ns, "10", 'expected a period such as "10 ms", got "10" (units: ps, ns, us, ms, s, min, h)'),
        (units.parse_period_ns, "10 msec", 'expected a period such as "10 ms", got "10 msec" (did you mean "ms"?)'),
        (units.parse_period_ns, "10 Ms", 'expected a period such as "10 ms", got "10 Ms" (did you mean "ms"?)'),
        (units.parse_period_ns, "0 ms", 'expected a period such as "10 ms", got "0 ms" (it must be above zero)'),
        (
            units.parse_period_ns,
            "1/3 ms",
            'expected a period such as "10 ms", got "1/3 ms" (it must be a whole number of ns)',
        ),
        (
            units.parse_bandwidth_bps,
            "10 kb/s",
            'expected a bandwidth such as "125 kbit/s", got "10 kb/s" (did you mean "KB/s" or "kbit/s"?)',
        ),
        (
            units.parse_bandwidth_bps,
            "0 bit/s",
            'expected a bandwidth such as "125 kbit/s", got "0 bit/s" (it must be at least 1 bit/s)',
        ),
        (
            units.parse_size_bytes,
            "5 Kb",
            'expected a data size such as "30 B", got "5 Kb" (did you mean "KB" or "kbit"?)',
        ),
        (units.parse_money, "5 €", 'expected a price such as "150 EUR", got "5 €" (did you mean "EUR"?)'),
        (units.parse_ratio, "0.7", 'expected a ratio such as "70 %", got "0.7" (units: %, ppm)'),
        (units.parse_power_mw, "-5 W", 'expected a power such as "5 W", got "-5 W" (it must not be negative)'),
        (
            units.parse_time_range_ns,
            "3 .. 1 ms",
            'expected a time range such as "243 us .. 1.3 ms", got "3 .. 1 ms" (the minimum is above the maximum)',
        ),
        (
            units.parse_time_range_ns,
            "1 ms ..",
            'expected a time range such as "243 us .. 1.3 ms", got "1 ms .."',
        ),
        (units.parse_quantity, "1_000 ms", 'malformed number "1_000 ms" (digits are not grouped)'),
        (units.parse_quantity, "1,5 ms", 'malformed number "1,5 ms" (write decimals with a point)'),
        (units.parse_quantity, "1.2.3 ms", 'malformed number "1.2.3 ms"'),
        (units.parse_quantity, "1e999999999 s", 'exponent out of range in "1e999999999 s" (from -30 to 30)'),
        (units.parse_quantity, "1/0 s", 'division by zero in "1/0 s"'),
        (units.parse_quantity, "nan", 'expected a number with its unit, got "nan"'),
        (units.parse_quantity, "inf s", 'expected a number with its unit, got "inf s"'),
        (units.parse_total, "90", 'expected a number with its unit such as "90 g", got "90"'),
    ],
)
def test_refusals(reader: Callable[[str], Any], text: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        reader(text)
    assert str(caught.value) == message


def test_hostile_numbers_are_refused_at_once() -> None:
    for text in ("9" * 10**6 + " s", "1e" + "9" * 10**6 + " s", "1/" + "3" * 10**6 + " s"):
        with pytest.raises(UnitError) as caught:
            units.parse_quantity(text)
        assert len(caught.value.message) < 200


def test_undeclared_units_stay_as_written() -> None:
    assert units.parse_quantity("90 g") == Quantity(Fraction(90), None, "g")
    assert units.convert(units.parse_quantity("90 g"), "g") == 90
    assert units.convert(units.parse_quantity("90 cm"), "m") == Fraction(9, 10)
    for text, unit in (("90 g", "kg"), ("90 s", "m")):
        with pytest.raises(UnitError):
            units.convert(units.parse_quantity(text), unit)


def test_dimensions_multiply_and_divide() -> None:
    assert units.SPEED.times(units.TIME) == units.LENGTH
    assert units.DATA.over(units.DATA_RATE) == units.TIME


@pytest.mark.parametrize(
    ("unit", "base", "ratio"),
    [
        ("kg", "g", 1000),
        ("g", "kg", Fraction(1, 1000)),
        ("Mg", "mg", 10**9),
        ("µg", "mg", Fraction(1, 1000)),
        ("hPa", "Pa", 100),
        ("mAh", "Ah", Fraction(1, 1000)),
        ("TOPS", "GOPS", 1000),
        ("GFLOPS", "TFLOPS", Fraction(1, 1000)),
        ("cm", "mm", 10),
        ("min", "s", 60),
        ("ppm", "%", Fraction(1, 10**4)),
        ("kB", "B", 1000),
        ("pcs", "pcs", 1),
        ("kpcs", "pcs", 1000),
        ("m", "min", None),
        ("min", "in", None),
        ("pt", "t", Fraction(1, 10**12)),
        ("EUR", "USD", None),
        ("g", "N", None),
        ("kkg", "kg", None),
        ("mkg", "kg", None),
        ("pcs", "cs", None),
        ("Mod", "od", None),
        ("km", "m/s", None),
    ],
)
def test_how_many_of_one_unit_another_is(unit: str, base: str, ratio: Fraction | int | None) -> None:
    assert units.unit_ratio(unit, base) == ratio
    assert units.unit_ratio(base, unit) == (ratio and 1 / Fraction(ratio))
