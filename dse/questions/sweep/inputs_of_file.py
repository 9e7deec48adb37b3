"""The quantities of a problem file by their paths: found, read, set, scaled, as text.

A path is what leads to a value in the file, joined by dots: ``threads.nav.compute_execution_time``,
``bus_types.ros_ipc.transmission_time.RT101.fixed``; ``[2]`` picks one of several options, counted from 0,
``.min`` and ``.max`` an end of a time range.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.questions.problem import Problem
from dse.space.model.metric_kinds import asks_for_changes
from dse.space.model.space import Space
from dse.spec.quantities.quantities import BASE, EXECUTION, FIELDS, LIKE_A_PATH, OF_REPLIES, PARTS, RANGES
from dse.spec.schema.fields import COUNT
from dse.spec.schema.quantity_fields import TOTAL
from dse.support.errors import UsageError, did_you_mean
from dse.support.units import (
    TIME_RANGE,
    TRANSMISSION,
    UNITS,
    Quantity,
    QuantityKind,
    canonical_unit,
    format_number,
    parse_quantity,
    range_ends,
    shown,
)

BASELINE = ("baseline", "cost_of_change")
"""The keys of a problem file that say from where and how changes are counted."""
Place = tuple[str | int, ...]


@dataclass(frozen=True)
class InputValue:
    """A single value in the file: its path, where it stands, what kind it is, and its text (or whole number).

    `end` is ``min`` or ``max`` where only that end of a time range is meant.
    """

    path: str
    place: Place
    kind: QuantityKind
    text: str | int
    end: str = ""


def merged_data(problem: Problem) -> dict[str, Any]:
    """The problem as plain data with its includes merged in; stated uncertainties are left out.

    They do not change the front, so that editing them does not make a run a new one.
    """
    return {key: value for key, value in problem.loaded.document.items() if key != "uncertainty"}


def needed_data(data: Mapping[str, Any], space: Space) -> dict[str, Any]:
    """The data with no more of a baseline than the question of `space` looks at, for the same reason.

    Where changes are counted, that is what it states of open decisions: a fixed field never changes, and its value may
    be varied.
    """
    kept = {key: value for key, value in data.items() if key not in BASELINE}
    if asks_for_changes(space):
        stated = _of_open_decisions(space, data["baseline"]) or data["baseline"]
        kept |= {key: stated if key == "baseline" else data[key] for key in BASELINE if key in data}
    return kept


def _of_open_decisions(space: Space, baseline: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    open_ones = {item.name for item in space.decisions if item.is_open}
    kept = {
        component: {name: value for name, value in fields.items() if f"{component}.{name}" in open_ones}
        for component, fields in baseline.items()
    }
    return {component: fields for component, fields in kept.items() if fields}


def effective_text(data: Mapping[str, Any]) -> str:
    """Plain data as the text of a problem file: JSON, which is YAML.

    One line of JSON, with keys in the order of `data`; loading it gives an equal problem.
    """
    return json.dumps(data, ensure_ascii=False, separators=(", ", ": "))


class Inputs:
    """Every quantity of a problem file, by path.

    A path that leads to several values (options, figures per processor type) stands for all of them.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data = data
        self.groups: dict[str, list[InputValue]] = {}
        self.aliases: dict[str, list[str]] = {}
        for path, place, kind, value in _fields(data):
            above = _transmission_parents(path)
            for parents, item in _values(path, place, kind, value):
                for name in dict.fromkeys((*above, *parents, item.path)):
                    self.groups.setdefault(name, []).append(item)
                if kind in RANGES:
                    for end in ("min", "max"):
                        one = InputValue(f"{item.path}.{end}", item.place, kind, item.text, end)
                        self.groups[one.path] = [one]
        self._note_aliases()

    def _note_aliases(self) -> None:
        """Where a component takes a field from its types: what to say when its own path is asked for."""
        for section, types in (("threads", "thread_types"), ("devices", "device_types")):
            for name, entry in (self.data.get(section) or {}).items():
                type_name = (entry or {}).get("type")
                for of in type_name if isinstance(type_name, list) else [type_name]:
                    for field_name in FIELDS[section]:
                        target = f"{types}.{of}.{field_name}"
                        if target in self.groups:
                            self.aliases.setdefault(f"{section}.{name}.{field_name}", []).append(target)

    def at(self, path: str) -> list[InputValue]:
        """The values that a path leads to.

        Raises
        ------
        UsageError
            when there is none; with the closest path that exists.
        """
        if path in self.groups:
            return self.groups[path]
        raise UsageError(f"no quantity of the problem is called {shown(path)}{self._hint(path)}")

    def _hint(self, path: str) -> str:
        if path in self.aliases:
            return f" (it comes from the type: {' or '.join(self.aliases[path])})"
        if path.startswith("requirements"):
            return ' (a limit is varied by its metric, such as "jitter of my_flow=5ms..100ms")'
        for alias, targets in self.aliases.items():
            if path.startswith(f"{alias}."):
                return f" (it comes from the type: {' or '.join(target + path[len(alias) :] for target in targets)})"
        hint = did_you_mean(path, self.groups, LIKE_A_PATH)
        return f" ({hint})" if hint else ""

    def set(self, data: dict[str, Any], path: str, text: str) -> None:
        """Put a value at a path of `data`, in place.

        Raises
        ------
        UsageError
            for a path that leads to several values, or a value of the wrong kind.
        """
        items = self.at(path)
        if len(items) > 1:
            names = ", ".join(item.path for item in items[:6]) + (", …" if len(items) > 6 else "")
            raise UsageError(
                f"{path} holds {len(items)} values: say which ({names}), or scale all of them (*0.5, 1, 2)"
            )
        self._write(data, items[0], text)

    def scale(self, data: dict[str, Any], path: str, factor: Fraction) -> None:
        """Multiply every value at a path of `data`, in place.

        Ranges and lists of options are multiplied entry by entry, each written with its own unit. `data` is the plain
        data of the problem file.
        """
        for item in self.at(path):
            self._write(data, item, _scaled_text(item, factor))

    def _write(self, data: dict[str, Any], item: InputValue, text: str | int) -> None:
        holder: Any = data
        for part in item.place[:-1]:
            holder = holder[part]
        if item.kind is COUNT:
            holder[item.place[-1]] = int(text)
        elif item.end:
            low, high = _ends(str(holder[item.place[-1]]))
            ends = (str(text), high) if item.end == "min" else (low, str(text))
            holder[item.place[-1]] = f"{ends[0]} .. {ends[1]}"
        else:
            holder[item.place[-1]] = str(text)


def copied(data: Mapping[str, Any]) -> dict[str, Any]:
    """Data to change.

    A deep copy as a plain `dict`, so that changing one run does not change another.
    """
    return copy.deepcopy(dict(data))


def _fields(data: Mapping[str, Any]) -> Iterator[tuple[str, Place, QuantityKind, Any]]:
    """Path, place, kind and value of each field that holds quantities."""
    for section, fields in FIELDS.items():
        for name, entry in (data.get(section) or {}).items():
            if not isinstance(entry, dict):
                continue
            for field_name, kind in fields.items():
                if entry.get(field_name) is not None:
                    yield f"{section}.{name}.{field_name}", (section, name, field_name), kind, entry[field_name]
            for key, value in (entry.get("totals") or {}).items():
                yield f"{section}.{name}.totals.{key}", (section, name, "totals", key), TOTAL, value
            yield from _inner(section, name, entry)
            times = entry.get("transmission_time")
            if isinstance(times, dict):
                yield from _transmission(
                    f"{section}.{name}.transmission_time", (section, name, "transmission_time"), times
                )


def _inner(section: str, name: str, entry: Mapping[str, Any]) -> Iterator[tuple[str, Place, QuantityKind, Any]]:
    """The fields of segments, of a reply, and of parameters."""
    for number, item in enumerate(entry.get("segments") or ()):
        place = (section, name, "segments", number, EXECUTION)
        yield f"{section}.{name}.segments[{number}].{EXECUTION}", place, TIME_RANGE, item[EXECUTION]
    reply = entry.get("reply") or {}
    for key, kind in OF_REPLIES.items():
        if reply.get(key) is not None:
            yield f"{section}.{name}.reply.{key}", (section, name, "reply", key), kind, reply[key]
    for key, item in (entry.get("parameters") or {}).items():
        if (item or {}).get(EXECUTION) is not None:
            of = (section, name, "parameters", key, EXECUTION)
            yield f"{section}.{name}.parameters.{key}.{EXECUTION}", of, TIME_RANGE, item[EXECUTION]


def _transmission_parents(path: str) -> list[str]:
    """The paths above a part of a transmission time that stand for several: of a machine, of all."""
    head, mark, rest = path.partition(".transmission_time.")
    names = rest.split(".")[:-1] if mark else []
    whole = f"{head}.transmission_time"
    return [whole, *(f"{whole}.{name}" for name in names)] if mark else []


def _transmission(path: str, place: Place, times: Mapping[str, Any]) -> Iterator[tuple[str, Place, QuantityKind, Any]]:
    if set(times) & {*PARTS, "sizes"}:
        for part in PARTS:
            if part in times:
                yield f"{path}.{part}", (*place, part), TRANSMISSION, times[part]
        return
    for machine, parts in times.items():
        for part in PARTS:
            if part in parts:
                yield f"{path}.{machine}.{part}", (*place, machine, part), TRANSMISSION, parts[part]


def _values(path: str, place: Place, kind: QuantityKind, value: Any) -> Iterator[tuple[tuple[str, ...], InputValue]]:
    """Each single value of a field, with the paths that stand for several."""
    if isinstance(value, dict):
        for machine, inner in value.items():
            for parents, item in _values(f"{path}.{machine}", (*place, machine), kind, inner):
                yield (path, *parents), item
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            name = f"{path}[{number}]" if len(value) > 1 else path
            yield (path,), InputValue(name, (*place, number), kind, inner)
    else:
        yield (), InputValue(path, place, kind, value)


def _ends(text: str) -> tuple[str, str]:
    """Both ends of a time range, each with its unit; a single time is both."""
    return range_ends(text) or (text.strip(), text.strip())


def _scaled_text(item: InputValue, factor: Fraction) -> str | int:
    """The item's text with its numbers multiplied."""
    if item.kind is COUNT:
        count = int(item.text) * factor
        if count.denominator != 1:
            raise UsageError(f"{item.path}: {item.text} times {format_number(factor)} is no whole number")
        return int(count)
    if item.end:
        low, high = _ends(str(item.text))
        return _scaled(low if item.end == "min" else high, item.kind, factor)
    if item.kind in RANGES and ".." in str(item.text):
        return " .. ".join(_scaled(end, item.kind, factor) for end in _ends(str(item.text)))
    return _scaled(str(item.text), item.kind, factor)


def _scaled(text: str, kind: QuantityKind, factor: Fraction) -> str:
    quantity = parse_quantity(text)
    return quantity_text(Quantity(quantity.value * factor, quantity.dimension, quantity.unit), kind)


def quantity_text(quantity: Quantity, kind: QuantityKind) -> str:
    """Exact text of a quantity, in the unit that it was written in.

    >>> from dse.support.units import PERIOD
    >>> quantity_text(parse_quantity("1.5 ms"), PERIOD)
    '1.5 ms'
    """
    scale = UNITS[canonical_unit(quantity.unit)][0] if quantity.dimension is not None and quantity.unit else Fraction(1)
    number = quantity.value / scale
    text = format_number(number)
    if "/" in text and kind in BASE:  # a fraction that has no decimals may have some in a finer unit
        base = BASE[kind]
        return f"{format_number(quantity.value / UNITS[base][0])} {base}"
    return f"{text} {quantity.unit}".strip()
