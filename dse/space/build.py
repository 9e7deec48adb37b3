"""From the problem as written to the space of designs; finds every mistake that names and structure can hold."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dse.errors import ProblemError
from dse.space.activation import check_activation, with_triggers
from dse.space.components import build_component, build_connection, check_machines
from dse.space.figures import Ledger, Path
from dse.space.flows import build_flows
from dse.space.questions import with_questions
from dse.space.slots import build_buses, build_processor
from dse.space.types import Space
from dse.spec.load import LoadedSpec
from dse.spec.model import Spec


def build_space(loaded: LoadedSpec) -> Space:
    """The space of the loaded problem.

    Raises
    ------
    ProblemError
        with every semantic mistake of the file, in file order.
    """
    spec, ledger = loaded.spec, Ledger(loaded)
    _check_names(spec, ledger)
    _check_totals(spec, ledger)
    processors = tuple(build_processor(ledger, spec, name) for name in spec.processors)
    buses = build_buses(ledger, spec)
    components = tuple(build_component(ledger, spec, processors, section, name) for section, name in _component_names(spec))
    connections = tuple(build_connection(ledger, spec, buses, components, name) for name in spec.connections)
    check_machines(ledger, processors, buses, components, connections)
    components = with_triggers(ledger, spec, components, connections)
    flows = build_flows(ledger, spec, components, connections)
    space = Space(
        name=spec.name,
        profile=spec.profile,
        worst_case=spec.worst_case,
        decisions=tuple(ledger.decisions),
        processors=processors,
        buses=buses,
        components=components,
        connections=connections,
        flows=flows,
        totals=spec.totals,
        derived=(),
        requirements=(),
        rules=(),
        objectives=(),
        references=ledger.references,
        currency=_currency(spec, ledger),
        baseline={},
        assumptions=spec.assumptions,
    )
    check_activation(ledger, space)
    space = with_questions(ledger, space, spec)
    if ledger.diagnostics:
        raise ProblemError(sorted(ledger.diagnostics, key=lambda item: (item.file, item.line, item.column)))
    return space


def _component_names(spec: Spec) -> list[tuple[str, str]]:
    return [("devices", name) for name in spec.devices] + [("threads", name) for name in spec.threads]


def _check_names(spec: Spec, ledger: Ledger) -> None:
    """Names of processors, buses, devices, threads and connections are distinct; so are flows, metrics and totals."""
    groups = (("processors", "buses", "devices", "threads", "connections"), ("flows", "metrics", "totals"))
    for group in groups:
        first: dict[str, str] = {}
        for section in group:
            for name in getattr(spec, section):
                if name in first:
                    ledger.error((section, name), f"the name {name!r} is already taken in {first[name]}")
                first.setdefault(name, section)


def _priced(spec: Spec) -> Iterable[tuple[Path, Any]]:
    for section in ("processor_types", "bus_types", "device_types", "thread_types", "devices", "threads"):
        for name, model in getattr(spec, section).items():
            yield (section, name), model


def _check_totals(spec: Spec, ledger: Ledger) -> None:
    for path, model in _priced(spec):
        for key, given in model.totals.items():
            if key not in spec.totals:
                ledger.unknown((*path, "totals", key), "total", key, spec.totals)
                continue
            for total in given:
                if total.unit != spec.totals[key]:
                    ledger.error((*path, "totals", key), f"expected a figure in {spec.totals[key]}, got {total.unit!r}")


def _currency(spec: Spec, ledger: Ledger) -> str:
    found: dict[str, Path] = {}
    for path, model in _priced(spec):
        for money in model.price or ():
            found.setdefault(money.currency, (*path, "price"))
    names = list(found)
    for other in names[1:]:
        ledger.error(found[other], f"price in {other}, but other prices are in {names[0]}", "use one currency")
    return names[0] if names else "EUR"


