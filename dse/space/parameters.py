"""Parameters of threads: their values as decisions, checked by unit and range, and execution times that follow them.

The reference is docs/problem-file.md, "Parameters of threads".
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dse.space.model.trees import Choice, Tree
from dse.space.properties import Ledger, Owner, Path
from dse.spec.quantities.totals import in_unit_of
from dse.spec.schema.model import Parameter, Thread
from dse.support.units import Total, UnitError, format_total, parse_parameter, range_ends, shown

KIND = "parameter"
_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class _Times:
    """The execution time of a thread for one value of a parameter, in the form of a thread type."""

    compute_execution_time: Any


def _options(stated: Any) -> Sequence[Sequence[object]]:
    """The lists of options in times, or in those of each processor type."""
    return list(stated.values()) if isinstance(stated, Mapping) else [stated]


def shown_value(value: Total) -> str:
    """A value of a parameter in text, without a unit where it has none."""
    return format_total(value).strip()


def read_parameters(ledger: Ledger, name: str, stated: Thread) -> Owner | None:
    """Decides the values of the parameters of a thread; what has its execution times, where a parameter states them."""
    owner: Owner | None = None
    for key, parameter in stated.parameters.items():
        path: Path = ("threads", name, "parameters", key)
        if not _NAME.fullmatch(key):
            ledger.error(path, "expected a name of letters, digits and underscores", at_key=True)
        elif key in Thread.model_fields:
            ledger.error(path, f"{shown(key)} is a field of threads", "call the parameter otherwise", at_key=True)
            continue
        values = _values(ledger, path, parameter)
        if not values:
            ledger.doubt(f"{name}.{key}")
            if parameter.compute_execution_time is not None:
                ledger.error((*path, "compute_execution_time"), "needs the `value` that it is looked up by")
            continue
        decision = ledger.decide(name, key, KIND, values, shown_value) if len(values) > 1 else None
        tree: Tree = values[0] if decision is None else Choice(decision, values)
        ledger.settle(decision, tree)
        ledger.refer(f"{name}.{key}", KIND, tree, {value: shown_value(value) for value in values})
        table = parameter.compute_execution_time
        if table is None:
            continue
        if owner is not None:
            text = "execution times follow one parameter"
            ledger.error((*path, "compute_execution_time"), text, "state those of each combination as a type")
            continue
        types = [(text, _Times(times)) for text, times in _in_order(ledger, path, values, table)]
        if any(len(options) > 1 for _, model in types for options in _options(model.compute_execution_time)):
            ledger.error((*path, "compute_execution_time"), "each value has one execution time", "or one for each type")
        elif len(types) == len(values):
            owner = Owner(name, path, None, types, (*path, "compute_execution_time"), decision)
    return owner


def _values(ledger: Ledger, path: Path, parameter: Parameter) -> tuple[Total, ...]:
    """The values in the unit of the range, each once; none where something is wrong with them."""
    ends, totals = _ends(ledger, path, parameter.range), list[Total]()
    for position, text in enumerate(parameter.value or ()):
        place = (*path, "value", position) if len(parameter.value or ()) > 1 else (*path, "value")
        try:
            value = _converted(parse_parameter(text), [*(ends or ()), *totals])
        except UnitError as error:
            ledger.error(place, error.message, error.hint)
            return ()
        if ends and not ends[0].value <= value.value <= ends[1].value:
            ledger.error(place, f"{shown_value(value)} is not within {shown_value(ends[0])} .. {shown_value(ends[1])}")
            return ()
        if value in totals:
            ledger.error(place, f"option {shown_value(value)} is given twice")
            return ()
        totals.append(value)
    return tuple(totals)


def _converted(value: Total, known: Sequence[Total]) -> Total:
    """A value in the unit of others, as it is where there are none."""
    if not known or value.unit == known[0].unit:
        return value
    if not (value.unit and known[0].unit):
        unit = f"in {known[0].unit}" if known[0].unit else "without a unit"
        raise UnitError(f"expected a number {unit}, got {shown(shown_value(value))}")
    return in_unit_of(known[:1], value)


def _ends(ledger: Ledger, path: Path, text: str | None) -> tuple[Total, Total] | None:
    """Both ends of a range, in the unit of the upper one."""
    if text is None:
        return None
    place = (*path, "range")
    ends = range_ends(text)
    if ends is None:
        ledger.error(place, f"expected a range, got {shown(text)}", "0.04 m .. 1.5 m")
        return None
    try:
        high, low = parse_parameter(ends[1]), parse_parameter(ends[0])
        low = Total(low.value, high.unit) if not low.unit else _converted(low, [high])
    except UnitError as error:
        ledger.error(place, error.message, error.hint)
        return None
    if low.value > high.value:
        ledger.error(place, f"the range {shown(text)} ends below its beginning")
        return None
    return low, high


def value_in(table: Mapping[str, Any], value: Total) -> str | None:
    """The key of a table by values that means a value; None where none does."""
    for key in table:
        try:
            if _converted(parse_parameter(str(key)), [value]) == value:
                return key
        except UnitError:
            continue
    return None


def _in_order(
    ledger: Ledger, path: Path, values: Sequence[Total], table: Mapping[str, Any]
) -> Sequence[tuple[str, Any]]:
    """The times of each value, in the order of the values; a value without times is an error."""
    ordered = []
    for value in values:
        key = value_in(table, value)
        if key is None:
            ledger.error((*path, "compute_execution_time"), f"no execution time with {shown_value(value)}")
        else:
            ordered.append((key, table[key]))
    return ordered
