"""The options of a field as texts: which one is meant, and what is said where there is no such option."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dse.space.model.space import (
    EMPTY,
    Reference,
    Space,
)
from dse.space.properties import closest
from dse.space.question.metrics import (
    QuestionError,
)
from dse.spec.quantities.totals import in_unit_of
from dse.spec.schema.canopen import connection_set
from dse.spec.schema.fields import ANY_IDENTIFIER
from dse.support.errors import Suggestion, did_you_mean
from dse.support.units import (
    Rounding,
    Total,
    UnitError,
    parse_bandwidth_bps,
    parse_data_rate,
    parse_duration_ns,
    parse_money,
    parse_parameter,
    parse_period_ns,
    parse_power_mw,
    parse_rate_hz,
    parse_size_bytes,
    parse_time_range_ns,
    parse_total,
    parse_transmission_ns,
    shown,
)

SHOWN_OPTIONS = 12


def _offset_ns(text: str) -> int | None:
    """An offset, which may be 0, or that there is none that anybody knows."""
    return None if text == "unknown" else parse_duration_ns(text, Rounding.EXACT)


def _identifier(text: str) -> int | str:
    """An identifier of CAN as a number; ``any`` as it is."""
    if text == ANY_IDENTIFIER:
        return ANY_IDENTIFIER
    found = connection_set(text)
    return int(text, 0) if found is None else found


PARSERS: Mapping[str, Callable[[str], Any]] = {
    "duration": parse_period_ns,
    "offset": _offset_ns,
    "time range": parse_time_range_ns,
    "transmission time": parse_transmission_ns,
    "data size": parse_size_bytes,
    "bandwidth": parse_bandwidth_bps,
    "data rate": parse_data_rate,
    "rate": parse_rate_hz,
    "money": parse_money,
    "power": parse_power_mw,
    "total": parse_total,
    "parameter": parse_parameter,
    "count": int,
    "identifier": _identifier,
}

ROUNDED = {"deadline": Rounding.DOWN, "non_preemptive": Rounding.UP, "context_switch": Rounding.UP}
"""Durations that need not be whole ns, as the file may state them."""


def unknown_field(space: Space, name: str) -> tuple[str, str]:
    """The error message for a name that no field has, and a hint with the closest names.

    A message and a hint; fields of the same component are suggested first.
    """
    fields = [item for item in space.references if item.rpartition(".")[0] == name.rpartition(".")[0]]
    return f"nothing is called {shown(name)}", closest(name, fields or space.references)


def read_option(space: Space, name: str, text: str) -> tuple[int | None, int]:
    """The decision called `name` and its option `text`; (None, 0) for a fixed field that has this very value.

    A type may go by the name of its component alone, as it does in tables.

    Raises
    ------
    QuestionError
        when there is no such field, or it has no such option.
    """
    name = name if name in space.references else f"{name}.type" if f"{name}.type" in space.references else name
    reference = space.references.get(name)
    if reference is None:
        raise QuestionError(*unknown_field(space, name))
    value = offered_value(reference, text)
    decision = space.decision_index(name)
    if decision is None:
        return None, 0
    if value not in space.decisions[decision].values:
        options = ", ".join(space.decisions[decision].options)
        message = f"{name} is {reference.texts[value]} only where a type does not state it: there is nothing to choose"
        raise QuestionError(message, Suggestion(f"options: {options}"))
    return decision, space.decisions[decision].values.index(value)


def offered_value(reference: Reference, text: str) -> Any:
    """The value that `text` means, which must be one of the options.

    In the base unit of the reference. Raises `QuestionError` where the value is none of the options.
    """
    value = read_value(reference, text)
    if value not in reference.texts:
        raise _never(reference, text)
    return value


def read_value(reference: Reference, text: str) -> Any:
    """The value that `text` means for a reference of its kind.

    In the base unit of the reference, rounded as the field of the file is. Raises `QuestionError` for text of another
    kind.
    """
    if reference.kind in PARSERS:
        rounding = ROUNDED.get(reference.name.rpartition(".")[2])
        try:
            value = PARSERS[reference.kind](text) if rounding is None else parse_duration_ns(text, rounding)
            return in_unit_of(reference.texts, value) if isinstance(value, Total) else value
        except UnitError as error:
            raise QuestionError(f"{reference.name}: {error.message}", error.hint) from error
        except ValueError as error:
            raise QuestionError(f"{reference.name}: expected a {reference.kind}, got {shown(text)}") from error
    by_text = {str(option): value for value, option in reference.texts.items()}
    if text in by_text:
        return by_text[text]
    if reference.kind == "type" and text == EMPTY:
        return EMPTY
    raise _never(reference, text)


def _never(reference: Reference, text: str) -> QuestionError:
    """A field that has no such option: the options, shortened where there are many."""
    options = list(dict.fromkeys(str(option) for option in reference.texts.values()))
    if len(options) == 1:
        return QuestionError(f"{shown(text)} is not an option of {reference.name}, which is always {options[0]}")
    meant = did_you_mean(text, options) if reference.kind not in PARSERS else ""
    shortened = options[:SHOWN_OPTIONS] + ["..."] * (len(options) > SHOWN_OPTIONS)
    hint = meant or f"options: {', '.join(shortened)}"
    return QuestionError(f"{shown(text)} is not an option of {reference.name}", Suggestion(hint))
