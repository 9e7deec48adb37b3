"""The quantities of a problem by their paths: which fields hold them, of which kind, and each value of a spec.

A path is what leads to a value in the file, joined by dots: ``threads.nav.compute_execution_time``,
``bus_types.ros_ipc.transmission_time.RT101.fixed``; ``[2]`` picks one of several options, counted from 0,
``.min`` and ``.max`` an end of a time range.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from typing import Any, TypeAlias, TypeVar, get_args

from pydantic.fields import FieldInfo

from dse.spec.schema.fields import COUNT
from dse.spec.schema.hardware import Priced, TransmissionTime
from dse.spec.schema.model import Catalogue, Spec
from dse.spec.schema.quantity_fields import TOTAL
from dse.support.errors import UsageError
from dse.support.units import (
    BANDWIDTH,
    DURATION,
    PERIOD,
    RATE,
    RATE_OF_DATA,
    SIZE,
    TIME_RANGE,
    TRANSMISSION,
    Money,
    Quantity,
    QuantityKind,
    TimeRange,
    Total,
    UnitError,
    as_written,
    expectation,
    parse_quantity,
    shown,
    unit_hint,
)

SECTIONS = (
    "processor_types", "bus_types", "device_types", "thread_types", "devices", "threads", "connections", "clocks",
    "partitions", "flows",
)  # fmt: skip
"""The sections with figures, in the order in which studies go through them."""
NOT_VARIED = (("bus_types", "period"), ("processor_types", "speed"), ("partitions", "speed"))
"""Figures that studies do not vary: OSATE's profiles alone look at them."""


def _kinds(section: str) -> dict[str, QuantityKind]:
    """The fields of the entries of a section that hold figures; of hardware its own before what it costs."""
    entries = get_args(Catalogue.model_fields[section].annotation)[1]
    kinds = {name: kind for name, info in entries.model_fields.items() if (kind := _kind(info)) is not None}
    kinds = {name: kind for name, kind in kinds.items() if (section, name) not in NOT_VARIED}
    costs = {name: kinds.pop(name) for name in PRICED if issubclass(entries, Priced) and name in kinds}
    return {**kinds, **costs} if section in ("processor_types", "bus_types") else {**costs, **kinds}


def _kind(info: FieldInfo) -> QuantityKind | None:
    """The kind that stands beside the type of a field, or of its options; None where there is none."""
    todo: list[Any] = [*info.metadata, info.annotation]
    for item in todo:
        if isinstance(item, QuantityKind):
            return item
        todo += [*getattr(item, "__metadata__", ()), *get_args(item)]
    return None


PRICED = ("price", "power")
FIELDS: Mapping[str, Mapping[str, QuantityKind]] = {section: _kinds(section) for section in SECTIONS}
"""Which fields hold figures, and of which kind: as the form of the problem file says."""
PARTS = ("fixed", "per_byte")
LIKE_A_PATH = 0.5
"""How alike a path must be to one that was given for being suggested (see `dse.support.errors.nearest`)."""
EXECUTION = "compute_execution_time"
"""The figure that each segment of a thread has, a reply, and a parameter with each value."""
OF_REPLIES = {"data_size": SIZE, EXECUTION: TIME_RANGE, "latency": TIME_RANGE}
"""The figures of the reply of a call."""
RANGES = (TIME_RANGE, TRANSMISSION)
BASE = dict.fromkeys((PERIOD, DURATION, *RANGES), "ns") | {
    SIZE: "B",
    BANDWIDTH: "bit/s",
    RATE: "Hz",
    RATE_OF_DATA: "B/s",
}


@dataclass(frozen=True)
class Figure:
    """A stated value: its path, kind, nominal value and unit.

    `end` is ``min`` or ``max`` of a time range with different ends.
    """

    path: str
    kind: QuantityKind
    nominal: Fraction
    unit: str
    end: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether the file's values become whole numbers of the unit.

        Times in ns, sizes in bytes and money in cents are whole; rates and declared totals are exact fractions.
        """
        return self.kind not in (RATE, RATE_OF_DATA, TOTAL, TRANSMISSION)

    @property
    def is_count(self) -> bool:
        """Whether the quantity is a count (cores, places in a queue), which has whole values only.

        Margins of such inputs end at a whole number.
        """
        return self.kind is COUNT

    def settled(self, value: Fraction) -> Fraction:
        """The nearest value that it can have: a whole number where the file's values become one; never too small.

        Rounded to nearest, at least `least`; other kinds are returned unchanged. In the base unit of the figure.
        """
        return Fraction(max(self.least, floor(value + Fraction(1, 2)))) if self.is_whole else value

    @property
    def least(self) -> int:
        """The least value that the file admits.

        1 for periods, counts and bandwidths, else 0, in the base unit of the figure.
        """
        return 1 if self.kind in (PERIOD, COUNT) or self.unit == "bit/s" else 0


F = TypeVar("F", bound=Figure)
Make: TypeAlias = Callable[[Any, Figure], Any]
"""What stands in the place of a value, given the value and what it is."""


def figures_of(spec: Spec) -> tuple[Figure, ...]:
    """Every stated value of a problem but the latencies that flows state.

    In the order of the sections and entries of the file; each has its path, kind, unit and value.
    """
    figures: list[Figure] = []

    def note(value: Any, figure: Figure) -> Any:
        figures.append(figure)
        return value

    with_figures(spec, note)
    return tuple(figures)


def matching(figures: Sequence[F], path: str) -> list[F]:
    """The figures that a path stands for: its own, or all below it.

    An exact path gives one figure; ``threads.nav`` gives everything that is stated of the thread.
    """
    exact = [item for item in figures if item.path == path]
    return exact or [item for item in figures if item.path.startswith((f"{path}.", f"{path}["))]


def with_figures(spec: Spec, make: Make) -> Spec:
    """The problem with something else in the place of each stated value.

    `make` gets each value and its `Figure` and returns the replacement; latencies that flows state are left alone.
    """
    sections: dict[str, Any] = {}
    for section, kinds in FIELDS.items():
        if section == "flows":
            continue
        models = getattr(spec, section)
        sections[section] = {name: _model(f"{section}.{name}", model, kinds, make) for name, model in models.items()}
    return spec.model_copy(update=sections)


def _model(path: str, model: Any, kinds: Mapping[str, QuantityKind], make: Make) -> Any:
    stated = model.model_fields_set
    update: dict[str, Any] = {}
    for name, kind in kinds.items():
        if name == "cores" and isinstance(model.cores, Mapping):
            continue  # which core is of which group is no figure
        if name == "budget" and isinstance(model.budget, Fraction):
            continue  # of a bus or a connection: it is compared with figures, none follows from it
        if name in stated and getattr(model, name) is not None:
            update[name] = _field(f"{path}.{name}", getattr(model, name), kind, make)
    if "totals" in stated and getattr(model, "totals", None):
        update["totals"] = {
            key: _field(f"{path}.totals.{key}", item, TOTAL, make) for key, item in model.totals.items()
        }
    if getattr(model, "segments", None) is not None:
        update["segments"] = tuple(
            _model(f"{path}.segments[{number}]", item, {EXECUTION: TIME_RANGE}, make)
            for number, item in enumerate(model.segments)
        )
    if getattr(model, "reply", None) is not None:
        update["reply"] = _model(f"{path}.reply", model.reply, OF_REPLIES, make)
    if getattr(model, "parameters", None):
        update["parameters"] = {
            key: _model(f"{path}.parameters.{key}", item, {EXECUTION: TIME_RANGE}, make)
            for key, item in model.parameters.items()
        }
    times = getattr(model, "transmission_time", None)
    if isinstance(times, TransmissionTime):
        update["transmission_time"] = _transmission(f"{path}.transmission_time", times, make)
    elif isinstance(times, Mapping):
        update["transmission_time"] = {
            machine: _transmission(f"{path}.transmission_time.{machine}", item, make) for machine, item in times.items()
        }
    return model.model_copy(update=update)


def _transmission(path: str, times: TransmissionTime, make: Make) -> TransmissionTime:
    update = {
        part: _field(f"{path}.{part}", getattr(times, part), TRANSMISSION, make)
        for part in PARTS
        if part in times.model_fields_set
    }
    return times.model_copy(update=update)


def _field(path: str, value: Any, kind: QuantityKind, make: Make) -> Any:
    if isinstance(value, dict):
        return {machine: _field(f"{path}.{machine}", item, kind, make) for machine, item in value.items()}
    if isinstance(value, int | TimeRange):
        return _value(path, value, kind, make)
    several = len(value) > 1
    return tuple(
        _value(f"{path}[{number}]" if several else path, item, kind, make) for number, item in enumerate(value)
    )


def _value(path: str, stated: Any, kind: QuantityKind, make: Make) -> Any:
    def made(value: Any, unit: str, end: str = "") -> Any:
        where = f"{path}.{end}" if end else path
        return make(value, Figure(where, kind, Fraction(value), unit, end))

    if isinstance(stated, str):
        return stated
    if isinstance(stated, Money):
        return Money(made(stated.cents, "ct"), stated.currency)
    if isinstance(stated, Total):
        return Total(made(stated.value, stated.unit), stated.unit)
    if isinstance(stated, TimeRange):
        if stated.min_ns == stated.max_ns:
            both: Any = made(stated.min_ns, "ns")
            return TimeRange(both, both)
        return TimeRange(made(stated.min_ns, "ns", "min"), made(stated.max_ns, "ns", "max"))
    return made(stated, "mW" if kind.noun == "a power" else BASE.get(kind, ""))


def read_value(text: str, kind: QuantityKind, path: str) -> Quantity:
    """A value for a path.

    Raises
    ------
    UsageError
        when it is no quantity of the kind.
    """
    try:
        quantity = parse_quantity(text)
    except UnitError as error:
        raise UsageError(f"{path}: {error}") from error
    if kind is COUNT:
        if quantity.unit or quantity.value.denominator != 1:
            raise UsageError(f"{path}: expected {expectation(kind)}, got {shown(text)}")
        return quantity
    if kind is TOTAL:
        return as_written(quantity)
    if quantity.dimension != kind.dimension or not quantity.unit:
        hint = unit_hint(quantity.unit, kind.dimension)
        raise UsageError(f"{path}: expected {expectation(kind)}, got {shown(text)} ({hint})")
    return quantity
