"""Threads, devices and connections: their figures, where they run and what carries them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from dse.space.architecture.arbitration import identifier_text
from dse.space.architecture.buses import read_further, read_protocols
from dse.space.architecture.calls import Calls, connections_of_calls
from dse.space.architecture.carriers import counted, read_carried, with_frames
from dse.space.architecture.clocks import clock_of, read_communication, read_offset
from dse.space.architecture.executors import Homes, home_of, served_by
from dse.space.architecture.joins import read_join
from dse.space.architecture.processors import decision_of, groups_of, known_types, read_figures, read_named
from dse.space.architecture.segments import ends_by_name, inner_connections
from dse.space.model.arrivals import PROTOCOLS
from dse.space.model.budgets import Partition
from dse.space.model.space import EMPTY, UNKNOWN_TYPE, Bus, Component, Connection, Processor, at_home
from dse.space.model.trees import Choice, PerProcessorType, Tree, graft, leaves
from dse.space.parameters import read_parameters
from dse.space.properties import FieldReader, Ledger, Owner, Path, by_machine, closest
from dse.space.question.open_cores import check_core, cores_named, the_core
from dse.space.question.open_priorities import read_priority
from dse.spec.schema.model import Spec
from dse.support.units import format_data_rate, format_duration, format_rate, format_size, format_time_range, shown

BY_PROCESSOR_TYPE = ("compute_execution_time", "callback_execution_time", "non_preemptive", "response_time")


LOCAL = "local"
"""Among the buses of a connection: what it sends need not travel between threads of one processor."""


def _typed_owner(ledger: Ledger, spec: Spec, section: str, name: str) -> Owner:
    """The owner of a thread's or device's fields, with its type decision if it names several types."""
    given, path = getattr(spec, section)[name], (section, name)
    catalogue = f"{section[:-1]}_types"
    owner = Owner(name, path, given, type_path=(catalogue,))
    if given.type:
        owner.types = known_types(ledger, path, f"{section[:-1]} type", given.type, getattr(spec, catalogue))
        names = tuple(type_name for type_name, _ in owner.types)
        tree: Tree = names[0] if names else None
        if len(names) > 1:
            owner.type_decision = ledger.decide(name, "type", "type", names, str)
            tree = Choice(owner.type_decision, names)
            ledger.settle(owner.type_decision, tree)
        ledger.refer(f"{name}.type", "type", tree, {item: item for item in names})
    return owner


def build_component(
    ledger: Ledger, spec: Spec, processors: Sequence[Processor], homes: Homes, section: Any, name: str
) -> Component:
    """The thread or device called `name`; what triggers it is added when the connections are known.

    Figures are trees over decisions, times in ns; mistakes go to `ledger`. A thread in an executor or reservation runs
    where that runs.
    """
    ledger.work.go_on(10)
    given, path = getattr(spec, section)[name], (section, name)
    owner = _typed_owner(ledger, spec, section, name)
    processor: Tree = None
    process: Tree = None
    priority: Tree = None
    core: Tree = None
    executor: int | None = None
    reservation: int | None = None
    home = home_of(ledger, homes, name, given) if section == "threads" else None
    if section == "threads":
        index = {slot.name: number for number, slot in enumerate(processors)}
        if given.processor and given.figures_of:
            ledger.error((*path, "figures_of"), "give `processor` or `figures_of`, not both")
        key = "processor" if given.processor else "figures_of"
        named = getattr(given, key)
        if home is not None:
            processor = home.processor
        elif named:
            processor = read_named(ledger, name, "processor", (*path, key), named, index)
        reader = FieldReader(ledger, _without_types(owner), "process", "process", str)
        process = reader.read(lambda model: model.process)
        priority = read_priority(ledger, _without_types(owner), spec.priorities)
        core_path = ("threads", name, "core")
        named_cores = cores_named(ledger, processors, core_path, processor, given.core or ())
        core = the_core(named_cores) if home is None else home.core
        if home is not None:
            executor, reservation = home.executor, home.reservation
        else:
            executor = served_by(ledger, spec, processors, name, processor)
        check_core(ledger, processors, core_path, processor, named_cores)
    machine = by_machine(ledger, processors, name, processor)
    machines = frozenset(item for leaf in leaves(processor) if leaf is not None for item in processors[leaf].types)

    def read(field_name: str, kind: str, write: Callable[[Any], str], of: Owner | None = None) -> Tree:
        reader = FieldReader(ledger, of or owner, field_name, kind, write, machine, machines)
        return reader.read(lambda model: getattr(model, field_name, None))

    protocol = read("dispatch_protocol", "protocol", str)
    stated_period = read("period", "duration", format_duration)
    period = _period_in_use(ledger, path, name, protocol, stated_period)
    clock = clock_of(ledger, spec, section, name, processor)
    by_value = read_parameters(ledger, name, given) if section == "threads" else None
    if by_value is not None and any(item.compute_execution_time for item in (given, *(one for _, one in owner.types))):
        text = "a parameter states what it takes with each of its values: it has no other execution time"
        ledger.error((*by_value.path, "compute_execution_time"), text)
    join, pairing = read_join(ledger, spec, owner, protocol, period) if section == "threads" else (None, None)
    categories = [given.category, *(model.category for _, model in owner.types)]
    category = next((item for item in categories if item), section[:-1])
    return Component(
        name=name,
        section=section,
        category=category,
        processor=processor,
        process=process,
        protocol=protocol,
        period_ns=period,
        execution_ns=read("compute_execution_time", "time range", format_time_range, by_value),
        callback_ns=read("callback_execution_time", "time range", format_time_range),
        latency_ns=read("latency", "time range", format_time_range),
        deadline_ns=read("deadline", "duration", format_duration),
        response_ns=read("response_time", "time range", format_time_range),
        queue_size=read("queue_size", "count", str),
        transmit_queue=read("transmit_queue", "transmit queue", str),
        figures=read_figures(ledger, owner, spec.totals),
        priority=priority,
        core=core,
        executor=executor,
        reservation=reservation,
        section_ns=read("non_preemptive", "duration", format_duration),
        clock=clock,
        offset_ns=read_offset(ledger, spec, owner, protocol, period, clock),
        communication=read_communication(ledger, owner, protocol, period) if section == "threads" else None,
        join=join,
        pairing=pairing,
        stated_period_ns=_even_where_unused(ledger, f"{name}.period", stated_period, period),
        bound=section != "threads" or not given.figures_of,
        partition=_partition(ledger, spec, section, name),
    )


def _partition(ledger: Ledger, spec: Spec, section: str, name: str) -> Partition | None:
    """The partition that a thread or device runs in; without a period that is its window, as for OSATE."""
    named = (spec.threads if section == "threads" else spec.devices)[name].partition
    if named is None:
        return None
    if named not in spec.partitions:
        ledger.unknown((section, name, "partition"), "partition", named, spec.partitions)
        return None
    given, path = spec.partitions[named], ("partitions", named)
    period = given.period or given.duration or 0
    end = given.offset + (given.duration or 0)
    if given.duration == 0:
        ledger.error((*path, "duration"), "a window of no length", "leave `duration` out where no window is known")
    elif end > period and spec.imported is None:  # a model that says so is analysed as OSATE does
        what = "offset" if given.duration is None else "duration" if not given.offset else "offset or duration"
        place = "offset" if given.duration is None else "duration"
        beyond = f"its period of {format_duration(period)}" if period else "a period that is not stated"
        text = f"the window of {shown(named)} ends at {format_duration(end)}, beyond {beyond}"
        ledger.error((*path, place), text, f"lower its {what}")
    return Partition(named, period, given.offset, given.duration)


def _even_where_unused(ledger: Ledger, decision: str, stated: Tree, used: Tree) -> Tree:
    """A figure that a design does not use where it is stated, as far as nothing is to be decided about it."""
    number = decision_of(ledger, decision)

    def plain(tree: Tree) -> Tree:
        if not isinstance(tree, Choice):
            return tree
        if tree.decision == number:
            return None
        return Choice(tree.decision, tuple(plain(branch) for branch in tree.branches))

    return graft(used, lambda leaf: plain(stated) if leaf is None else leaf)


def _without_types(owner: Owner) -> Owner:
    """The owner without its types: for fields that a type cannot have."""
    return Owner(owner.name, owner.path, owner.own)


def check_processor_types(ledger: Ledger, spec: Spec) -> None:
    """Figures per processor type name known processor types, in every component and every type that one has.

    ``TYPE/GROUP`` names a group of cores of one.
    """
    known = [*spec.processor_types]
    known += [f"{name}/{group}" for name, model in spec.processor_types.items() for group, _ in groups_of(model)]
    for section in ("device_types", "thread_types", "devices", "threads"):
        users = getattr(spec, section.replace("_type", "")).values()
        used = {name for user in users for name in user.type or ()}
        for name, model in getattr(spec, section).items():
            if section.endswith("_types") and name not in used:
                continue
            for field_name in BY_PROCESSOR_TYPE:
                given = getattr(model, field_name, None)
                for key in given if isinstance(given, Mapping) else ():
                    if key not in known:
                        ledger.unknown((section, name, field_name, key), "processor type", key, known, at_key=True)


def _period_in_use(ledger: Ledger, path: Path, name: str, protocol: Tree, period: Tree) -> Tree:
    """The period as far as the protocol has one; a protocol that needs a period must find one."""
    together = graft(protocol, lambda chosen: graft(period, lambda value: (chosen, value)))
    for leaf, value in leaves(together):
        if leaf in PROTOCOLS and PROTOCOLS[leaf].has_period and value is None:
            if not ledger.is_doubtful(name):
                ledger.error((*path, "dispatch_protocol"), f"{leaf} needs a `period`")
            ledger.doubt(f"{name}.period")
            break
    tree = graft(protocol, lambda item: period if item not in PROTOCOLS or PROTOCOLS[item].has_period else None)
    return ledger.with_use(f"{name}.period", tree)


def build_connections(
    ledger: Ledger, spec: Spec, buses: Sequence[Bus], components: Sequence[Component], calls: Calls
) -> tuple[Connection, ...]:
    """Every connection of the problem.

    In the order of the file, followed by what calls send besides, and by the inner connections between pieces of
    threads.
    """
    wires = {item.name: number for number, item in enumerate(buses)}
    senders, receivers = ends_by_name([item for item in components if not item.part_of])
    senders = {**senders, **calls.last}
    requests = {link.name: (link.source, link.target) for link in calls.links}
    found = {}
    for name in spec.connections:
        ends = requests.get(name) or _ends(ledger, spec, senders, receivers, name)
        found[name] = _build_connection(ledger, spec, buses, wires, components, name, ends)
    stated = with_frames(ledger, buses, tuple(found.values()))
    return (*stated, *connections_of_calls(spec, calls, found), *inner_connections(components))


def _build_connection(
    ledger: Ledger,
    spec: Spec,
    buses: Sequence[Bus],
    wires: Mapping[str, int],
    components: Sequence[Component],
    name: str,
    ends: tuple[int | None, int | None],
) -> Connection:
    ledger.work.go_on(10)
    given, path = spec.connections[name], ("connections", name)
    if given.rate is not None and given.data_rate is not None:
        ledger.error((*path, "data_rate"), "give `rate` or `data_rate`, not both")
    owner = Owner(name, path, given)

    def read(field_name: str, kind: str, write: Callable[[Any], str]) -> Tree:
        return FieldReader(ledger, owner, field_name, kind, write).read(lambda model: getattr(model, field_name))

    size, deadline = read("data_size", "data size", format_size), read("deadline", "duration", format_duration)
    bus = stated_bus = _connection_bus(ledger, spec, name, wires)
    if bus is not None and given.data_size is None and given.data_rate is None:
        ledger.error(path, "a connection over a bus needs `data_size` or `data_rate`")
    homes = [at_home(components, end) if end is not None else None for end in ends]
    bus = _unless_local(bus, [item.process if item is not None else None for item in homes])
    if _stays(ledger, spec, name, wires, [buses[leaf] for leaf in leaves(stated_bus) if leaf is not None]):
        bus = _unless_local(bus, [item.processor if item is not None else None for item in homes])
    ledger.with_use(f"{name}.bus", bus)
    return Connection(
        name=name,
        source=ends[0],
        target=ends[1],
        size_bytes=size,
        bus=bus,
        rate_hz=read("rate", "rate", format_rate),
        data_rate=read("data_rate", "data rate", format_data_rate),
        port=given.port,
        queue_size=read("queue_size", "count", str),
        latency_ns=read("latency", "time range", format_time_range),
        timing=given.timing,
        stated_bus=_even_where_unused(ledger, f"{name}.bus", stated_bus, bus),
        from_port=given.from_port,
        budget=given.budget,
        type_bytes=read("type_size", "data size", format_size),
        further=read_further(ledger, spec, path, given, wires),
        protocols=read_protocols(ledger, spec, path, given, wires),
        identifier=read("identifier", "identifier", identifier_text),
        priority=read("priority", "count", str),
        deadline_ns=deadline,
        carried_in=read_carried(ledger, spec, name),
    )


def _ends(
    ledger: Ledger, spec: Spec, senders: Mapping[str, int], receivers: Mapping[str, int], name: str
) -> tuple[int | None, int | None]:
    """Sender and receiver, None at the system boundary; an unknown one leaves that end in doubt."""
    given = spec.connections[name]
    if given.from_ is None and given.to is None:
        ledger.error(("connections", name), "a connection needs `from` or `to`")
        ledger.doubt(f"{name}.from", f"{name}.to")
    for key, end in (("from", given.from_), ("to", given.to)):
        if end is not None and end not in senders:
            ledger.unknown(("connections", name, key), "thread or device", end, senders)
            ledger.doubt(f"{name}.{key}")
    source = None if given.from_ is None else senders.get(given.from_)
    target = None if given.to is None else receivers.get(given.to)
    reader = spec.threads.get(given.to) if given.to is not None else None
    if reader is not None and target is not None and given.queue_size is not None and reader.segments is not None:
        message = f"{shown(str(given.to))} has segments: how long jobs wait in a queue for it is not analysed"
        ledger.error(("connections", name, "queue_size"), message)
    return source, target


def _connection_bus(ledger: Ledger, spec: Spec, name: str, index: Mapping[str, int]) -> Tree:
    given, path = spec.connections[name].bus, ("connections", name, "bus")
    if not given:
        return None
    if not _carriers(given, index):
        message = "`local` is for threads on one processor: name the bus for those on two"
        ledger.error(path, message, "bus: [local, lan]")
        ledger.doubt(f"{name}.bus")
        return None
    for bus in given:
        if bus not in index and bus in spec.bus_types:
            message = f"{shown(bus)} is a type of physical bus: name a slot under `buses`"
            ledger.error((*path, given.index(bus)), message, closest(bus, index))
            ledger.doubt(f"{name}.bus")
            return None
    return read_named(ledger, name, "bus", path, given, index, besides=(LOCAL,))


def _carriers(given: Sequence[str], index: Mapping[str, int]) -> tuple[str, ...]:
    """The buses among the options of a connection, without the word `local`."""
    return tuple(bus for bus in given if bus != LOCAL or bus in index)


def _stays(ledger: Ledger, spec: Spec, name: str, index: Mapping[str, int], buses: Sequence[Bus]) -> bool:
    """Whether what a connection sends need not travel between threads of one processor (docs/semantics.md, 3.5).

    So it is where only physical buses are offered: a virtual one may be what carries it there. `local` among the
    options says it of any.
    """
    given = spec.connections[name].bus or ()
    is_stated = len(_carriers(given, index)) < len(given)
    if spec.profile != "dse":
        if is_stated:
            message = f"profile {spec.profile} knows no `local`: a connection takes the bus that it is bound to"
            ledger.error(("connections", name, "bus"), message, "profile: dse")
        return False
    return is_stated or (bool(buses) and not any(bus.virtual for bus in buses))


def _unless_local(bus: Tree, homes: Sequence[Tree]) -> Tree:
    """The bus tree, None where both ends are in one process, or on one processor."""
    sender, receiver = homes
    if bus is None or sender is None or receiver is None:
        return bus

    def of(one: Any, other: Any) -> Tree:
        return None if one is not None and one == other else bus

    return graft(sender, lambda one: graft(receiver, lambda other: of(one, other)))


def check_machines(
    ledger: Ledger,
    processors: Sequence[Processor],
    buses: Sequence[Bus],
    components: Sequence[Component],
    connections: Sequence[Connection],
) -> None:
    """Check that every virtual bus with figures per processor type has one for each machine that may run it.

    Missing figures go to `ledger` with the place of the connection or bus type.
    """
    for connection in connections:
        machines = _machine_tree(components, connection)
        for bus in counted(buses, connection):
            tables = [
                leaf for tree in (bus.fixed_ns, bus.latency_ns) for leaf in leaves(tree)
                if isinstance(leaf, PerProcessorType)
            ]  # fmt: skip
            for table in tables:
                if set(leaves(machines)) - {None}:
                    _check_machine(ledger, processors, connection, bus, table, machines)
                elif not _runs_in_doubt(ledger, components, connection):
                    path = ("connections", connection.name, "bus")
                    message = f"{shown(bus.name)} has figures per processor type, but neither end runs on a processor"
                    ledger.error(path, message)


def _runs_in_doubt(ledger: Ledger, components: Sequence[Component], connection: Connection) -> bool:
    """Whether a mistake hides which processor runs either end."""
    ends = [components[end].name for end in (connection.source, connection.target) if end is not None]
    fields = [f"{connection.name}.from", f"{connection.name}.to", *(f"{end}.processor" for end in ends)]
    return ledger.is_doubtful(*ends, *fields)


def _check_machine(
    ledger: Ledger,
    processors: Sequence[Processor],
    connection: Connection,
    bus: Bus,
    table: PerProcessorType,
    machines: Tree,
) -> None:
    path = ("connections", connection.name, "bus")
    for leaf in sorted(set(leaves(machines)) - {None}):
        slot = processors[leaf]
        for name in slot.types:
            if name not in (EMPTY, UNKNOWN_TYPE) and name not in table.by_type:
                what = f"{shown(bus.name)} has no figure for processor type {shown(name)}"
                ledger.error(path, f"{what}, which {shown(slot.name)} may have")


def check_processes(ledger: Ledger, processors: Sequence[Processor], components: Sequence[Component]) -> None:
    """Threads of one process must have a processor in common; where it is a decision, the search sees to it.

    A pair without a common processor is a mistake; reported once for each thread.
    """
    first: dict[str, Component] = {}
    for component in components:
        if not isinstance(component.process, str) or component.processor is None:
            continue
        other = first.setdefault(component.process, component)
        if set(leaves(component.processor)).isdisjoint(leaves(other.processor)):
            if ledger.is_doubtful(*(f"{item.name}.processor" for item in (component, other))):
                continue
            here, there = (
                " or ".join(processors[leaf].name for leaf in leaves(item.processor)) for item in (component, other)
            )
            process = shown(component.process)
            message = f"runs on {here}, but {shown(other.name)} of the same process {process} on {there}"
            ledger.error((component.section, component.name, "processor"), message)


def _machine_tree(components: Sequence[Component], connection: Connection) -> Tree:
    """The processor that runs a connection's middleware: the sending thread's, else the receiving one's."""
    ends = [at_home(components, end).processor for end in (connection.source, connection.target) if end is not None]
    return next((processor for processor in ends if processor is not None), None)
