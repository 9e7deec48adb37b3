"""From the problem as written to the space of designs; finds every mistake that names and structure can hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from dse.space.architecture.activation import check_activation, with_triggers
from dse.space.architecture.arbitration import check_arbitration, with_arbitration
from dse.space.architecture.budgets import build_resources
from dse.space.architecture.buses import build_buses, check_bus_types
from dse.space.architecture.calls import with_calls
from dse.space.architecture.carriers import with_shared_buses
from dse.space.architecture.clocks import check_clocks, grid_in_use
from dse.space.architecture.components import (
    build_component,
    build_connections,
    check_machines,
    check_processes,
    check_processor_types,
)
from dse.space.architecture.executors import build_executors, build_homes, build_reservations
from dse.space.architecture.flows import build_flows, check_flow_sizes, unread_flows
from dse.space.architecture.joins import check_joins
from dse.space.architecture.processors import build_processor, check_overheads
from dse.space.architecture.segments import with_pieces
from dse.space.model.metric_kinds import RESERVED
from dse.space.model.space import Space
from dse.space.packing import with_packing
from dse.space.properties import Ledger, Path, closest
from dse.space.question.reading import with_questions
from dse.space.question.settings import SETTINGS, stated_settings
from dse.spec.language.scan import CALL
from dse.spec.loading.load import LoadedSpec, UnreadableError
from dse.spec.schema import ros2
from dse.spec.schema.model import Spec
from dse.support.errors import Diagnostic, ProblemError, in_order
from dse.support.units import shown

CATALOGUES = ("processor_types", "bus_types", "device_types", "thread_types")


def build_space(loaded: LoadedSpec) -> Space:
    """The space of the loaded problem.

    Raises
    ------
    ProblemError
        with every semantic mistake of the file, in file order.
    """
    ledger = Ledger(loaded)
    spec = with_shared_buses(ledger, with_packing(ledger, loaded.spec))
    settings = stated_settings(spec.model_dump(include=set(SETTINGS)))
    _check_names(spec, ledger)
    _check_totals(spec, ledger)
    for path, message in ros2.mistakes(spec):
        ledger.error(path, message)
    check_bus_types(ledger, spec)
    check_overheads(ledger, spec)
    check_processor_types(ledger, spec)
    check_clocks(ledger, spec)
    processors = tuple(build_processor(ledger, spec, name) for name in spec.processors)
    buses = build_buses(ledger, spec)
    homes = build_homes(ledger, spec, processors)
    components = tuple(
        build_component(ledger, spec, processors, homes, section, name) for section, name in _component_names(spec)
    )
    components = with_pieces(ledger, spec, processors, components)
    components, calls = with_calls(ledger, spec, processors, components)
    executors = build_executors(ledger, spec, processors, homes.executors, components)
    reservations = build_reservations(ledger, spec, homes, components)
    connections = build_connections(ledger, spec, buses, components, calls)
    check_machines(ledger, processors, buses, components, connections)
    check_processes(ledger, processors, components)
    components = with_triggers(ledger, spec, components, connections)
    check_arbitration(ledger, spec)
    buses = with_arbitration(ledger, spec, buses, connections)
    flows = build_flows(ledger, spec, components, connections, calls)
    space = Space(
        name=spec.name,
        profile=spec.profile,
        worst_case=spec.worst_case,
        system=spec.system,
        partition_output=spec.partition_output,
        best_case=spec.best_case,
        bus_queuing=spec.bus_queuing,
        packed=tuple(name for name, way in spec.packing.items() if way == "any"),
        decisions=tuple(ledger.decisions),
        processors=processors,
        buses=buses,
        components=components,
        connections=connections,
        flows=flows,
        unread=unread_flows(ledger, spec),
        totals=spec.totals,
        derived=(),
        requirements=(),
        rules=(),
        objectives=(),
        references=ledger.references,
        currency=_currency(spec, ledger),
        baseline={},
        assumptions=spec.assumptions,
        processing=settings["processing"],
        catalogue={section: tuple(getattr(spec, section)) for section in CATALOGUES},
        deadlines=settings["deadlines"],
        overload=spec.overload,
        executors=executors,
        reservations=reservations,
        offset_grid_ns=grid_in_use(spec),
        resources=build_resources(ledger, spec, [item.stated_as for item in components], list(spec.processors)),
    )
    check_activation(ledger, space)
    check_joins(ledger, space)
    check_flow_sizes(ledger, space)
    _check_uncertainty(ledger)
    space = with_questions(ledger, space, spec)
    if ledger.diagnostics:
        raise ProblemError(ledger.sorted_diagnostics())
    return space


def every_mistake(error: UnreadableError) -> ProblemError:
    """The mistakes of a file that cannot be read, with those that names and structure hold in the rest of it.

    A `ProblemError` with all diagnostics in the order of files and lines.
    """
    found: list[Diagnostic] = [*error.diagnostics]
    if error.rest is not None:
        try:
            build_space(error.rest)
        except ProblemError as further:
            found += further.diagnostics
        found = in_order(found, [source.file for source in error.rest.sources])
    return ProblemError(found)


def _component_names(spec: Spec) -> list[tuple[str, str]]:
    return [("devices", name) for name in spec.devices] + [("threads", name) for name in spec.threads]


def _check_names(spec: Spec, ledger: Ledger) -> None:
    """Names of slots, components, their hosts and connections are distinct; so are flows, metrics and totals."""
    groups = (
        ("processors", "buses", "devices", "threads", "executors", "reservations", "connections"),
        ("flows", "metrics", "totals"),
    )
    for group in groups:
        first: dict[str, str] = {}
        for section in group:
            for name in getattr(spec, section):
                if name in first:
                    message = f"the name {shown(name)} is already taken in {first[name]}"
                    ledger.error((section, name), message, at_key=True)
                    ledger.doubt(name)
                first.setdefault(name, section)


def _priced(spec: Spec) -> Iterable[tuple[Path, Any]]:
    for section in ("processor_types", "bus_types", "device_types", "thread_types", "devices", "threads"):
        for name, model in getattr(spec, section).items():
            yield (section, name), model


def _check_totals(spec: Spec, ledger: Ledger) -> None:
    for name in spec.totals:
        if name in RESERVED or CALL.match(name):
            ledger.error(("totals", name), f"{shown(name)} is a metric already: choose another name", at_key=True)
    for path, model in _priced(spec):
        for key, given in model.totals.items():
            if key not in spec.totals:
                hint = closest(key, spec.totals) or f"declare its unit at the top: totals: {{{key}: UNIT}}"
                ledger.error((*path, "totals", key), f"unknown total {shown(key)}", hint, at_key=True, unknown=key)
                continue
            for at, total in enumerate(given):
                place = (*path, "totals", key, *([at] if len(given) > 1 else []))
                if total.unit != spec.totals[key]:
                    ledger.error(place, f"expected a figure in {spec.totals[key]}, got {shown(total.unit)}")
                elif total in given[:at]:
                    ledger.error(place, "option given twice")


def _check_uncertainty(ledger: Ledger) -> None:
    """Every entry says something that can be read, of a figure that is there."""
    for error in ledger.loaded.misstated:
        if error.is_of_nothing and not ledger.loaded.remains.is_whole:
            continue  # its figure may have been taken out
        ledger.error(error.place, error.message, error.hint, at_key=not error.field)


def _currency(spec: Spec, ledger: Ledger) -> str:
    """The currency of the problem: that of most prices; the others are mistakes."""
    places = [(money.currency, path) for path, model in _priced(spec) for money in model.price or ()]
    if not places:
        return "EUR"
    currency: str = Counter(found for found, _ in places).most_common(1)[0][0]
    for found, path in places:
        if found != currency:
            ledger.error((*path, "price"), f"price in {found}, but most prices are in {currency}", "use one currency")
    return currency
