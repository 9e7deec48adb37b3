"""Figures of declared totals, each in the unit that `totals` declares for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from dse.spec.schema.hardware import Priced
from dse.spec.schema.model import Spec
from dse.support.units import Total, UnitError, shown, unit_ratio

SECTIONS = ("processor_types", "bus_types", "device_types", "thread_types", "devices", "threads")
"""The sections whose entries have totals."""


def in_declared_units(spec: Spec) -> Spec:
    """The problem with its totals' figures in their declared units; what cannot be said in them stays as written.

    A copy in which each total of a component or type counts in the unit of ``totals`` at the top of the file.
    """
    if not spec.totals:
        return spec
    sections: dict[str, dict[str, Priced]] = {}
    for section in SECTIONS:
        models: Mapping[str, Priced] = getattr(spec, section)
        converted = {name: _converted(model, spec.totals) for name, model in models.items()}
        if any(converted[name] is not model for name, model in models.items()):
            sections[section] = converted
    return spec.model_copy(update=sections) if sections else spec


def _converted(model: Priced, units: Mapping[str, str]) -> Priced:
    totals = {
        key: tuple(_in_unit(total, units.get(key, total.unit)) for total in stated)
        for key, stated in model.totals.items()
    }
    return model if totals == model.totals else model.model_copy(update={"totals": totals})


def _in_unit(total: Total, unit: str) -> Total:
    """A figure in another unit; as it is where it cannot be said in it.

    >>> from fractions import Fraction
    >>> _in_unit(Total(Fraction(3, 2), "kg"), "g")
    Total(value=Fraction(1500, 1), unit='g')
    """
    ratio = None if total.unit == unit else unit_ratio(total.unit, unit)
    return total if ratio is None else Total(total.value * ratio, unit)


def in_unit_of(values: Iterable[object], total: Total) -> Total:
    """A figure in the unit of those among `values`, which have one.

    Raises
    ------
    UnitError
        where it cannot be said in it.
    """
    [unit] = {value.unit for value in values if isinstance(value, Total)}
    converted = _in_unit(total, unit)
    if converted.unit != unit:
        what = f"a figure in {unit}" if unit else "a number without a unit"
        raise UnitError(f"expected {what}, got {shown(total.unit)}")
    return converted
