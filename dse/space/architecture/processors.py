"""Slots of processors: their types, and the figures that follow from them; what slots of buses need too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from dse.space.model.space import EMPTY, UNKNOWN_TYPE, AdditiveFigures, Interference, Processor
from dse.space.model.trees import Choice, Tree, graft
from dse.space.properties import FieldReader, Ledger, Owner, Path, stated, type_choice
from dse.spec.schema.model import Spec
from dse.support.units import (
    format_duration,
    format_money,
    format_power,
    format_total,
    shown,
)

THROTTLING = "throttling"
"""The name in reports of the time that an operating system takes from threads."""


def known_types(
    ledger: Ledger, path: Path, what: str, names: Sequence[str], catalogue: Mapping[str, Any]
) -> list[tuple[str, Any]]:
    """The types that `names` means; one that is not in the catalogue leaves its slot or component in doubt.

    Pairs of a name and its catalogue entry, without the unknown names, which go to `ledger`.
    """
    for position, name in enumerate(names):
        if name not in catalogue:
            ledger.unknown((*path, "type", position), what, name, catalogue)
            ledger.doubt(str(path[1]))
            ledger.doubt_types(catalogue)
    return [(name, catalogue[name]) for name in names if name in catalogue]


def read_figures(ledger: Ledger, owner: Owner, totals: Mapping[str, str]) -> AdditiveFigures:
    """Price, power and declared totals of an owner.

    An `AdditiveFigures` of trees: cents, mW, and declared totals in their units.
    """
    readers = {
        "price": FieldReader(ledger, owner, "price", "money", format_money),
        "power": FieldReader(ledger, owner, "power", "power", format_power),
    }
    price = readers["price"].read(lambda model: model.price)
    power = readers["power"].read(lambda model: model.power)
    more = {}
    for key in totals:
        reader = FieldReader(ledger, owner, f"totals.{key}", "total", format_total)
        tree = reader.read(lambda model, key=key: model.totals.get(key))  # type: ignore[misc]
        if tree is not None:
            more[key] = graft(tree, lambda total: None if total is None else total.value)
    return AdditiveFigures(graft(price, lambda money: None if money is None else money.cents), power, more)


def read_slot(
    ledger: Ledger, path: Path, name: str, types: Sequence[tuple[str, Any]], optional: bool
) -> tuple[Any, Owner]:
    """The type decision of a slot and an owner whose fields follow from it; an empty slot has no figures.

    Returns ``((options, decision), owner)``; an optional slot has the further option `EMPTY`.
    """
    names = tuple(type_name for type_name, _ in types)
    options = (EMPTY, *names) if optional else names
    decision = ledger.decide(name, "type", "type", options, str)
    home = Choice(decision, options)
    ledger.settle(decision, home)
    ledger.refer(f"{name}.type", "type", home, {option: option for option in options})
    nothing = [(EMPTY, _Nothing())] if optional else []
    catalogue: Path = (f"{'processor' if path[0] == 'processors' else 'bus'}_types",)
    return (options, decision), Owner(name, path, None, [*nothing, *types], catalogue, decision)


class _Nothing:
    """The figures of an empty slot: none."""

    totals: Mapping[str, Any] = {}

    def __getattr__(self, name: str) -> None:
        return None


UNKNOWN = ((UNKNOWN_TYPE, _Nothing()),)


def groups_of(model: Any) -> tuple[tuple[str, int], ...]:
    """The groups of cores of a processor type, with the number of cores of each; none where all cores are equal.

    Pairs of a group's name and its number of cores, in the order of the file; cores are numbered in that order.
    """
    given = getattr(model, "cores", None)
    return tuple(given.items()) if isinstance(given, Mapping) else ()


def _all_cores(model: Any) -> Any:
    """How many cores a processor type has, in all groups together."""
    groups = groups_of(model)
    return (sum(count for _, count in groups),) if groups else stated(model, "cores")


def build_processor(ledger: Ledger, spec: Spec, name: str) -> Processor:
    """The processor slot called `name`.

    A `Processor` whose figures are trees over its type decision; mistakes go to `ledger`.
    """
    given, path = spec.processors[name], ("processors", name)
    types = known_types(ledger, path, "processor type", given.type, spec.processor_types)
    (options, decision), owner = read_slot(ledger, path, name, types or UNKNOWN, given.optional)
    cores = FieldReader(ledger, owner, "cores", "count", str).read(_all_cores)
    levels = FieldReader(ledger, owner, "priority_levels", "count", str).read(lambda model: model.priority_levels)
    figures = read_figures(ledger, owner, spec.totals)
    count = graft(cores, lambda found: found or 0)
    switch = FieldReader(ledger, owner, "context_switch", "duration", format_duration)
    return Processor(
        name=name,
        types=options,
        type_decision=decision,
        optional=given.optional,
        figures=figures,
        cores=count,
        overload=given.overload is not None,
        priority_levels=levels,
        groups={type_name: groups for type_name, model in owner.types if (groups := groups_of(model))},
        switch_ns=graft(switch.read(lambda model: model.context_switch), lambda found: 0 if found is None else found),
        interference=type_choice(decision, [_interference(model) for _, model in owner.types]),
        serves=_service(ledger, path, owner),
        transmit_queue=FieldReader(ledger, owner, "transmit_queue", "transmit queue", str).read(
            lambda model: model.transmit_queue
        ),
    )


def _service(ledger: Ledger, path: Path, owner: Owner) -> Tree:
    """In which order each type of a slot serves jobs where it is an accelerator; None where it is none."""
    given = {name: model for name, model in owner.types if name not in (EMPTY, UNKNOWN_TYPE)}
    served = {name: model.serves for name, model in given.items() if model.serves is not None}
    if not served:
        return None
    for name, model in given.items():
        if name not in served:
            one = shown(next(iter(served)))
            ledger.error((*path, "type"), f"{one} serves one job at a time, {shown(name)} does not: no slot has both")
        elif model.cores != (1,):
            ledger.error(("processor_types", name, "serves"), "serves one job at a time, but has several cores")
    first = next(iter(served.values()))
    return type_choice(owner.type_decision, [served.get(name, first) for name, _ in owner.types])


def _interference(model: Any) -> tuple[Interference, ...]:
    """What a processor type takes from its threads; throttling is a gap at the end of each period of it."""
    found = [
        Interference(name, item.compute_execution_time.max_ns, item.period)
        for name, item in (model.interrupts or {}).items()
    ]
    throttling = model.throttling
    if throttling is not None and throttling.budget < throttling.period:
        found.append(
            Interference(THROTTLING, throttling.period - throttling.budget, throttling.period, is_throttling=True)
        )
    return tuple(found)


def check_overheads(ledger: Ledger, spec: Spec) -> None:
    """Interrupts and throttling leave something of a core to threads, in every type that is used.

    A throttling budget of 0 or above its period, and a demand of 100 % or more, go to `ledger`.
    """
    for type_name in {name: None for slot in spec.processors.values() for name in slot.type}:
        model = spec.processor_types.get(type_name)
        if model is None:
            continue
        path = ("processor_types", type_name)
        throttling = model.throttling
        if throttling is not None and throttling.budget > throttling.period:
            ledger.error((*path, "throttling", "budget"), "the budget is longer than its period")
        elif throttling is not None and throttling.budget == 0:
            ledger.error((*path, "throttling", "budget"), "a budget of nothing leaves no time to threads")
        elif sum(Fraction(item.worst_ns, item.period_ns) for item in _interference(model)) >= 1:
            ledger.error(path, "interrupts and throttling leave nothing of a core to threads")


def decision_of(ledger: Ledger, name: str) -> int | None:
    """The index of the decision called `name`, or None where there is nothing to decide."""
    return ledger.decision_numbers.get(name)


def read_named(
    ledger: Ledger,
    owner: str,
    field_name: str,
    path: Path,
    names: Sequence[str],
    index: Mapping[str, int],
    besides: Sequence[str] = (),
) -> Tree:
    """A tree of indices for a field that names processors, buses or executors; words `besides` are none of them.

    One name gives an index, several give a decision over the indices; unknown names go to `ledger`.
    """
    what = field_name if field_name in ("processor", "executor") else "bus"
    known = tuple(name for name in names if name in index)
    for position, name in enumerate(names):
        if name not in index and name not in besides:
            ledger.unknown((*path, position), what, name, index)
            ledger.doubt(f"{owner}.{field_name}")
    if not known:
        return None
    texts = {index[name]: name for name in known}
    numbers = tuple(texts)
    tree: Tree = numbers[0]
    if len(numbers) > 1:
        decision = ledger.decide(owner, field_name, what, numbers, lambda number: texts[number])
        tree = Choice(decision, numbers)
        ledger.settle(decision, tree)
    ledger.refer(f"{owner}.{field_name}", what, tree, texts)
    return tree
