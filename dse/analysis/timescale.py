"""The unit in which times are counted: a denominator that all sums of times of a space have in common."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from math import lcm
from typing import TypeAlias

from dse.analysis.binding import bit_times_ns, byte_times_ns
from dse.analysis.latency.joined_inputs import may_wait_for_inputs
from dse.analysis.latency.stored_inputs import may_be_stored
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import may_wait_for
from dse.analysis.usage import reachable_buses
from dse.analysis.views import View
from dse.space.architecture.carriers import wrapping
from dse.space.architecture.frames import Frame
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Bus, Component, Connection, Space
from dse.space.model.trees import FROM_BANDWIDTH, PerProcessorType, Tree, leaves
from dse.support.units import Exact, unrounded

TIME_SCALE_LIMIT = 1000
"""The finest unit of times, which are counted in ps at the finest: sums of hours of them are exact for the solver."""


RESPONSE_SCALE_LIMIT = 10
"""The finest unit of sums with response times, for which `UNBOUNDED_NS` may stand: a tenth of a ns."""


def latency_scale(space: Space, flow: Flow) -> tuple[int, int]:
    """A denominator of every latency that the flow may have, and the finest in which it is counted.

    A response time depends on whatever releases and delays a thread, anywhere.
    """
    if space.processing == "response_time":
        return whole_time_scale(space), RESPONSE_SCALE_LIMIT
    if space.profile != "dse":  # what waits, and what rounds up, consults others
        return whole_time_scale(space), TIME_SCALE_LIMIT
    if any(_hangs_on_others(space, step) for step in flow.steps):
        return whole_time_scale(space), RESPONSE_SCALE_LIMIT
    numbers = {kind: [step.index for step in flow.steps if step.kind == kind] for kind in ("component", "connection")}
    return _time_scale(space, numbers["component"], numbers["connection"]), TIME_SCALE_LIMIT


def _hangs_on_others(space: Space, step: Step) -> bool:
    """Whether what an element of a flow adds depends on times of what is not on the flow.

    So it is of a message that waits for a bus, and of an input that waits for a dispatch or for other inputs.
    """
    if step.kind == "connection":
        return bool(may_wait_for(space, step.index))
    return may_be_stored(space, step) or may_wait_for_inputs(space, step)


_SCALES: Recall[int] = Recall()


def whole_time_scale(space: Space) -> int:
    """A common denominator of all times of a space, whatever the design; many metrics ask for it.

    A divisor: times multiplied by it are whole numbers of ns. Remembered for each space.
    """

    def scale(space: Space, _: object, __: View) -> int:
        return _time_scale(space, range(len(space.components)), range(len(space.connections)))

    return _SCALES.recall(space, "time", View(()), scale)


def _time_scale(space: Space, components: Iterable[int], connections: Iterable[int]) -> int:
    """A common denominator, in ns, of sums of the times of components and connections.

    Times of the file are whole but for what messages and their bytes take. Where inputs are uncertain, a space has all
    kinds of figures (`dse.questions.sensitivity.design_function`).
    """
    of_components, of_connections = _PARTS.recall(space, "times", View(()), _part_scales)
    parts = (*(of_components[number] for number in components), *(of_connections[number] for number in connections))
    return lcm(1, *parts)


Parts: TypeAlias = tuple[tuple[int, ...], tuple[int, ...]]
_PARTS: Recall[Parts] = Recall()


def _part_scales(space: Space, _: object, __: View) -> Parts:
    """The denominators of the times of each component and of each connection; many flows ask for each."""
    return (
        tuple(_component_scale(component) for component in space.components),
        tuple(_connection_scale(space, connection) for connection in space.connections),
    )


def _component_scale(component: Component) -> int:
    times = (
        component.period_ns, component.execution_ns, component.callback_ns, component.latency_ns,
        component.deadline_ns, component.response_ns, component.stated_period_ns, component.offset_ns,
    )  # fmt: skip
    errors = [leaf.error_ns for leaf in leaves(component.clock) if leaf is not None]
    scale = lcm(1, *(Fraction(error).denominator for error in errors))
    return lcm(scale, _denominator(*times) * _denominator(component.queue_size))


def _connection_scale(space: Space, connection: Connection) -> int:
    anywhere = replace(connection, bus=connection.stated_bus)
    carried = reachable_buses(space, connection) | reachable_buses(space, anywhere)
    carried |= wrapping(space.buses, connection.protocols, carried)
    buses = [space.buses[number] for number in carried]
    times = (connection.latency_ns, *(tree for bus in buses for tree in (bus.fixed_ns, bus.latency_ns)))
    sizes = set(_numbers(connection.size_bytes, *(bus.overhead_bytes for bus in buses)))
    if space.profile != "dse":  # where sizes in bits count as they are
        sizes |= {Fraction(unrounded(size)) for size in _stated(connection, buses)}
    each = set(_numbers(*(bus.per_byte_ns for bus in buses))).union(*map(byte_times_ns, buses))
    scale = lcm(_denominator(*times), *((one * size).denominator for one in each for size in sizes))
    return lcm(scale, *(unit.denominator for bus in buses for unit in bit_times_ns(bus)))


def _stated(connection: Connection, buses: Sequence[Bus]) -> Iterator[Exact]:
    """The sizes of messages and overheads of buses, in bytes, as they are stated."""
    for tree in (connection.size_bytes, connection.type_bytes, *(bus.overhead_bytes for bus in buses)):
        yield from (leaf for leaf in leaves(tree) if leaf is not None)


def _denominator(*trees: Tree) -> int:
    """The common denominator of all numbers in trees of numbers and time ranges."""
    return lcm(1, *(number.denominator for number in _numbers(*trees)))


def _numbers(*trees: Tree) -> Iterator[Fraction]:
    """Every number in trees of numbers and time ranges."""
    for leaf in (leaf for tree in trees for leaf in leaves(tree)):
        if isinstance(leaf, PerProcessorType):
            yield from _numbers(*leaf.by_type.values())
        elif leaf is not None and leaf is not FROM_BANDWIDTH and not isinstance(leaf, Frame):
            yield from map(Fraction, leaf if isinstance(leaf, tuple) else (leaf,))
