"""A drawn system as the document of a problem file."""

from __future__ import annotations

from typing import Any

from dse.examples.random.draft import Draft, DraftConnection, DraftThread
from dse.examples.random.published import IPC_FIXED_US, IPC_PER_BYTE_NS, REFERENCE, WIRE_CLASSES, WireType

MIDDLEWARE = "middleware"


def build_document(draft: Draft, cores: int, wire_classes: list[int]) -> dict[str, Any]:
    """The system without requirements and objectives; every processor has `cores`, every bus the types of its class."""
    return {
        "processor_types": _processor_types(draft, cores),
        "bus_types": _bus_types(draft, sorted(set(wire_classes))),
        "processors": {slot: {"type": _offered(draft, number)} for number, slot in enumerate(processor_names(draft))},
        "buses": {
            name: {"type": [item.name for item in WIRE_CLASSES[wires]]}
            for name, wires in zip(bus_names(draft), wire_classes, strict=True)
        },
        "devices": _devices(draft),
        "threads": {thread.name: _thread(draft, thread) for thread in draft.threads},
        "connections": {wire.name: _connection(draft, wire) for wire in draft.wires},
        "flows": {f"flow_{number + 1}": {"path": path} for number, path in enumerate(_paths(draft))},
        "rules": [*_routing_rules(draft), *_period_rules(draft)],
        "baseline": _baseline(draft, wire_classes),
    }


def processor_names(draft: Draft) -> list[str]:
    """The names of the processor slots."""
    if draft.processors == 1:
        return ["computer"]
    return [f"{'ecu' if draft.family.automotive else 'computer'}_{number + 1}" for number in range(draft.processors)]


def bus_names(draft: Draft) -> list[str]:
    """The names of the buses."""
    return [f"bus_{number + 1}" for number in range(draft.buses)]


def _offered(draft: Draft, slot: int) -> list[str]:
    """Two to four types, the reference among them; the first slot has all."""
    names = [machine.name for machine in draft.family.machines]
    return (names, names[:3], names[1:], names[:2])[slot % 4]


def _processor_types(draft: Draft, cores: int) -> dict[str, Any]:
    return {
        item.name: {"cores": cores, "price": f"{item.price_eur} EUR", "power": f"{item.power_w} W"}
        for item in draft.family.machines
    }


def _bus_types(draft: Draft, classes: list[int]) -> dict[str, Any]:
    made: dict[str, Any] = {item.name: _bus_type(item) for number in classes for item in WIRE_CLASSES[number]}
    if any(wire.has_middleware for wire in draft.wires):
        times = {}
        for item in draft.family.machines:
            fixed = [figure * 1000 * item.slowness // 100 for figure in IPC_FIXED_US]
            per_byte = [max(1, figure * item.slowness // 100) for figure in IPC_PER_BYTE_NS]
            times[item.name] = {"fixed": _range_ns(*fixed), "per_byte": _range_ns(*per_byte)}
        made[MIDDLEWARE] = {"virtual": "true", "transmission_time": times}
    return made


def _bus_type(item: WireType) -> dict[str, Any]:
    body: dict[str, Any] = {"bandwidth": f"{item.kbit_s} kbit/s"}
    if item.overhead_bytes:
        body["overhead"] = f"{item.overhead_bytes} B"
    body["transmission_time"] = {"fixed": _range_ns(*item.fixed_ns), "per_byte": _range_ns(*item.per_byte_ns)}
    body["price"] = f"{item.price_eur} EUR"
    return body


def _range_ns(low: int, high: int) -> str:
    unit, size = ("us", 1000) if low % 1000 == 0 and high % 1000 == 0 else ("ns", 1)
    return f"{low // size} {unit}" if low == high else f"{low // size} {unit} .. {high // size} {unit}"


def _devices(draft: Draft) -> dict[str, Any]:
    made: dict[str, Any] = {
        f"sensor_{number + 1}": {"period": f"{period} ms", "compute_execution_time": "100 us .. 200 us"}
        for number, period in enumerate(draft.sensors_ms)
    }
    made.update({f"actuator_{number + 1}": {} for number in range(draft.actuators)})
    return made


def _thread(draft: Draft, thread: DraftThread) -> dict[str, Any]:
    names = processor_names(draft)
    body: dict[str, Any] = {"processor": _one_or_all([names[slot] for slot in thread.slots])}
    if thread.mode == "both":
        body["dispatch_protocol"] = ["periodic", "aperiodic"]
    else:
        body["dispatch_protocol"] = "aperiodic" if thread.mode == "event" else "periodic"
    if thread.mode != "event":
        body["period"] = [f"{period} ms" for period in thread.periods_ms]
    if thread.mode != "timer" and len(thread.inputs) > 1:
        body["dispatch_trigger"] = [draft.wires[thread.inputs[0]].name]
    machines = {name for slot in thread.slots for name in _offered(draft, slot)}
    times = {}
    for item in draft.family.machines:
        if item.name in machines:
            worst = -(-thread.worst_us * item.slowness // 100)
            times[item.name] = f"{max(1, min(worst, thread.best_us * item.slowness // 100))} us .. {worst} us"
    body["compute_execution_time"] = times
    return body


def _one_or_all(options: list[str]) -> str | list[str]:
    return options[0] if len(options) == 1 else options


def _connection(draft: Draft, wire: DraftConnection) -> dict[str, Any]:
    body: dict[str, Any] = {"from": _end(draft, wire.source), "to": _end(draft, wire.target)}
    body["data_size"] = f"{wire.size_bytes} B"
    buses = [bus_names(draft)[bus] for bus in wire.buses]
    carriers = [MIDDLEWARE, *buses] if wire.has_middleware else buses
    if carriers:
        body["bus"] = _one_or_all(carriers)
    if isinstance(wire.target, int):
        thread = draft.threads[wire.target]
        if thread.mode == "timer":
            body["port"] = "data"
    return body


def _end(draft: Draft, end: int | str) -> str:
    return end if isinstance(end, str) else draft.threads[end].name


def _paths(draft: Draft) -> list[list[str]]:
    return [
        [f"sensor_{sensor + 1}", *(draft.threads[number].name for number in flow), f"actuator_{actuator + 1}"]
        for flow, (sensor, actuator) in zip(draft.flows, draft.flow_ends, strict=True)
    ]


def _routing_rules(draft: Draft) -> list[str]:
    """Middleware within a processor, the bus between two; for connections whose ends may move."""
    rules = []
    for wire in draft.wires:
        if not wire.has_middleware or not wire.buses:
            continue
        assert isinstance(wire.source, int) and isinstance(wire.target, int)
        one, other = draft.threads[wire.source], draft.threads[wire.target]
        if len(one.slots) == 1:
            one, other = other, one
        where = f"{other.name}.processor" if len(other.slots) > 1 else processor_names(draft)[other.slots[0]]
        rules.append(f"{one.name}.processor == {where} implies {wire.name}.bus == {MIDDLEWARE}")
        rules.append(f"{one.name}.processor != {where} implies {wire.name}.bus != {MIDDLEWARE}")
    return rules


def _period_rules(draft: Draft) -> list[str]:
    """Some timers run at a multiple of the period of the timer that feeds them, as they do at the start."""
    rules = []
    for wire in draft.wires:
        if not isinstance(wire.source, int) or not isinstance(wire.target, int):
            continue
        one, other = draft.threads[wire.source], draft.threads[wire.target]
        if one.mode == other.mode == "timer" and other.period_ms % one.period_ms == 0:
            rules.append(f"require {other.name}.period is a multiple of {one.name}.period")
    return rules


def _baseline(draft: Draft, wire_classes: list[int]) -> dict[str, Any]:
    """The starting design, decision by decision."""
    made: dict[str, Any] = {name: {"type": draft.family.machines[REFERENCE].name} for name in processor_names(draft)}
    for name, wires in zip(bus_names(draft), wire_classes, strict=True):
        made[name] = {"type": WIRE_CLASSES[wires][REFERENCE].name}
    for thread in draft.threads:
        body: dict[str, Any] = {}
        if len(thread.slots) > 1:
            body["processor"] = processor_names(draft)[thread.slots[0]]
        if thread.mode == "both":
            body["dispatch_protocol"] = thread.start
        if thread.mode != "event" and thread.start == "periodic":
            body["period"] = f"{thread.period_ms} ms"
        if body:
            made[thread.name] = body
    for wire in draft.wires:
        if wire.has_middleware and wire.buses:
            assert isinstance(wire.source, int) and isinstance(wire.target, int)
            local = draft.threads[wire.source].slots[0] == draft.threads[wire.target].slots[0]
            made[wire.name] = {"bus": MIDDLEWARE if local else bus_names(draft)[wire.buses[0]]}
        elif len(wire.buses) > 1:
            made[wire.name] = {"bus": bus_names(draft)[wire.buses[0]]}
    return made
