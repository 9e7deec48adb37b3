"""Threads whose work is a sequence of pieces: on their own processor, or on an accelerator while they wait.

Each piece becomes a component. The first one is dispatched as the thread is, each other by the end of the one before,
so that rates, utilisation and latency follow as of any event-triggered thread. What the pieces of one thread have in
common (its core, its priority, that they never run at once) is in `dse.space.model.space.Pieces`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from dse.space.architecture.clocks import speaks_of_clocks
from dse.space.model.space import AdditiveFigures, Component, Connection, Pieces, Processor
from dse.space.model.trees import leaves
from dse.space.properties import FieldReader, Ledger, Owner, by_machine
from dse.spec.schema.model import Segment, Spec
from dse.support.units import format_time_range, shown

NOT_BESIDE = (
    "compute_execution_time", "callback_execution_time", "response_time", "latency", "non_preemptive", "queue_size",
    "offset", "communication", "executor", "reservation", "figures_of", "partition",
)  # fmt: skip
"""What a thread with segments cannot state, with its types."""


def with_pieces(
    ledger: Ledger, spec: Spec, processors: Sequence[Processor], components: Sequence[Component]
) -> tuple[Component, ...]:
    """The components with each thread that has segments as its pieces, one after the other.

    New components; other components keep their order. `Component.pieces` names all pieces of a thread.
    """
    found: list[Component] = []
    for component in components:
        given = spec.threads[component.name].segments if component.section == "threads" else None
        if given is None:
            found.append(component)
            continue
        _check_thread(ledger, spec, processors, component)
        members = tuple(range(len(found), len(found) + len(given)))
        own = [number for number, segment in zip(members, given, strict=True) if segment.processor is None]
        pieces = Pieces(component.name, members, next(iter(own), members[-1]))
        for position, segment in enumerate(given):
            piece = _placed(ledger, spec, processors, component, position, segment)
            found.append(_dispatched(replace(piece, pieces=pieces), position, is_last=position + 1 == len(given)))
        if all(found[number].executor is not None for number in members):
            path = ("threads", component.name, "segments")
            ledger.error(path, "no segment runs on the thread's own processor", "leave out the `processor` of one")
    names = [item.name for item in found]
    for item in found:
        if item.pieces is not None and item.name != item.pieces.thread and names.count(item.name) > 1:
            ledger.error(("threads", item.name), f"the name of a segment of {shown(item.pieces.thread)}", at_key=True)
    return tuple(found)


def inner_connections(components: Sequence[Component]) -> tuple[Connection, ...]:
    """The connections by which the end of one piece of a thread dispatches the next piece.

    Event connections without a bus and without a size, named after the thread and its piece.
    """
    found = []
    for number, component in enumerate(components):
        if component.pieces is not None and number != component.pieces.members[0]:
            name = f"{component.pieces.thread} (piece {component.pieces.members.index(number)} ends)"
            ends = (number - 1, number)
            found.append(Connection(name, *ends, None, None, None, None, "event", None, None, is_inner=True))
    return tuple(found)


def ends_by_name(components: Sequence[Component]) -> tuple[Mapping[str, int], Mapping[str, int]]:
    """The sender (the last piece of a thread) and the receiver (the first piece) for each name of the file.

    Two mappings from names to component indices, for a thread without segments both to the thread itself.
    """
    last = {item.stated_as: number for number, item in enumerate(components)}
    first = {name: (components[at].pieces.members[0] if components[at].pieces else at) for name, at in last.items()}  # type: ignore[union-attr]
    return last, first


def _check_thread(ledger: Ledger, spec: Spec, processors: Sequence[Processor], component: Component) -> None:
    """What has no meaning beside segments, or is not analysed there, is refused by name."""
    path = ("threads", component.name)
    given = spec.threads[component.name]
    types = [spec.thread_types[name] for name in given.type or () if name in spec.thread_types]
    for key in NOT_BESIDE:
        if getattr(given, key, None) is not None:
            ledger.error((*path, key), "not of a thread with segments", "state it in its segments, or do without")
        elif any(getattr(item, key, None) is not None for item in types):
            ledger.error((*path, "type"), f"has `{key}`, which a thread with segments cannot have")
    if "hybrid" in set(leaves(component.protocol)):
        ledger.error((*path, "dispatch_protocol"), "a hybrid thread cannot have segments")
    if component.processor is None and not ledger.is_doubtful(component.name, f"{component.name}.processor"):
        ledger.error(path, "segments need the `processor` that its own pieces run on")
    if any(processors[leaf].serves is not None for leaf in leaves(component.processor) if leaf is not None):
        message = "serves one job at a time: segments need a processor of their own that threads share"
        ledger.error((*path, "processor"), message)
    if spec.profile != "dse":
        ledger.error((*path, "segments"), f"profile {spec.profile} knows no segments", "profile: dse")
    if speaks_of_clocks(spec, [component]):
        message = "segments where the problem speaks of clocks: when pieces end on a clock is not analysed"
        ledger.error((*path, "segments"), message, "leave out clocks, offsets and logical execution times")


def _placed(
    ledger: Ledger, spec: Spec, processors: Sequence[Processor], thread: Component, position: int, segment: Segment
) -> Component:
    """A piece of a thread where it runs, with its execution time there."""
    path = ("threads", thread.name, "segments", position)
    processor, executor, core = thread.processor, None, thread.core
    if segment.processor is not None:
        names = [item.name for item in processors]
        if segment.processor not in names:
            ledger.unknown((*path, "processor"), "processor", segment.processor, names)
            ledger.doubt(thread.name)
        else:
            processor = names.index(segment.processor)
            executor, core = accelerator(processors, spec, processor), None
            if executor is None:
                message = f"{shown(segment.processor)} is no accelerator: it does not say in which order it `serves`"
                ledger.error((*path, "processor"), message, "pieces without a `processor` run on the thread's own")
    for options in _options(segment):
        if len(options) > 1:
            ledger.error((*path, "compute_execution_time"), "a segment has one execution time", "or one for each type")
    name = f"{thread.name} (piece {position + 1})"
    machine = by_machine(ledger, processors, thread.name, processor)
    types = frozenset(item for leaf in leaves(processor) if leaf is not None for item in processors[leaf].types)
    owner = Owner(name, path, segment)
    reader = FieldReader(ledger, owner, "compute_execution_time", "time range", format_time_range, machine, types)
    return replace(
        thread,
        name=name,
        processor=processor,
        executor=executor,
        core=core,
        process=thread.process if executor is None else None,
        execution_ns=reader.read(lambda model: model.compute_execution_time),
    )


def _options(segment: Segment) -> list[Sequence[object]]:
    given = segment.compute_execution_time
    return list(given.values()) if isinstance(given, Mapping) else [given]


def _dispatched(piece: Component, position: int, *, is_last: bool) -> Component:
    """A piece with what dispatches it; the last one stands for the thread, with its name and price."""
    if position:
        piece = replace(piece, protocol="aperiodic", join=None, pairing=None)
    if is_last:
        return replace(piece, name=piece.stated_as)
    return replace(piece, figures=AdditiveFigures(None, None, {}))


def accelerator(processors: Sequence[Processor], spec: Spec, processor: int) -> int | None:
    """The number of the executor that serves the jobs of an accelerator; None where a processor is none.

    Accelerators are numbered behind the stated executors, in the order of the processors.
    """
    if processors[processor].serves is None:
        return None
    before = [item for item in processors[:processor] if item.serves is not None]
    return len(spec.executors) + len(before)
