"""End-to-end flow latency as OSATE computes it: the contributor table of the profiles `osate-2.2` and `osate-2.19`.

The rules are those of docs/semantics.md, section 3.7. What an element adds may depend on what came before it: where
both ends of a connection run by one clock, its receiver waits until the time since the last sampling is a multiple of
its period. An element is therefore looked at in its place in the flow. Looking back ends at the last row that samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dse.analysis.latency.rows import NO_LATENCY, Row
from dse.analysis.memo import Recall
from dse.analysis.osate.components import OLD, is_sampling, later_rows, period_ns
from dse.analysis.osate.media import Medium, media, medium_ends, medium_ns
from dse.analysis.views import View
from dse.space.model.budgets import Partition
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Component, Connection, Space
from dse.space.model.trees import at
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class FlowPosition:
    """The element at `position` of a flow (by index).

    Used as a key: figures of an element depend on its place in the flow.
    """

    flow: int
    position: int


@dataclass(frozen=True, slots=True)
class Sums:
    """The least and the greatest time since the last row that sampled, in ns.

    Restarted at every row that samples; rounding to partitions and buses needs them.
    """

    min_ns: Exact = 0
    max_ns: Exact = 0

    def with_rows(self, rows: Sequence[Row]) -> Sums:
        """The sums with those of further rows.

        New sums in ns.
        """
        return Sums(
            self.min_ns + sum(row.min_ns for row in rows), self.max_ns + sum(row.max_ns for row in rows)
        )  # fmt: skip


def places_of(space: Space, flow: Flow) -> tuple[FlowPosition, ...]:
    """The places of a flow's elements, in order.

    One `FlowPosition` for each element of the flow.
    """
    number = space.flows.index(flow)
    return tuple(FlowPosition(number, position) for position in range(len(flow.steps)))


def place_step(space: Space, place: FlowPosition) -> Step:
    """The element at a place."""
    return space.flows[place.flow].steps[place.position]


def place_rows(space: Space, place: FlowPosition, view: View, *, queues: bool = True) -> tuple[Row, ...]:
    """The rows of the element at a place; without what waits on buses where `queues` is false.

    Rows in OSATE's order, times in ns: sampling, partition, queue and processing of a component; output, media and
    entry of a connection.
    """
    step = place_step(space, place)
    if step.kind == "connection":
        left, entered = crossed(space, step)
        output = _output_row(space, place, left, view) if left is not None else None
        entry = _entry_row(space, place, entered, view) if entered is not None else None
        rows = (output, *_connection_rows(space, place, view, queues=queues), entry)
        return tuple(row for row in rows if row is not None)
    component = space.components[step.index]
    sampling = _sampling_row(space, place, component, view)
    first = _first_partition_row(space, place, component, view)
    return tuple(row for row in (sampling, first, *later_rows(space, step, component, view)) if row is not None)


# --- components ---------------------------------------------------------------------------------------------------


def is_never_sampled(space: Space, wire: Connection, component: Component, view: View) -> bool:
    """Whether OSATE counts no sampling of what its receiver, a periodic component, gets: by an event port, today.

    False under the profile *osate-2.2*, which samples every input of a periodic component.
    """
    return space.profile != OLD and wire.port not in ("data", "feature") and is_sampling(space, component, view)


def _sampling_row(space: Space, place: FlowPosition, component: Component, view: View) -> Row | None:
    step = place_step(space, place)
    periodic = is_sampling(space, component, view)
    # OSATE 2.2 prints the row for every device and abstract component, periodic or not: a slip of its source
    printed = space.profile == OLD and component.category in ("device", "abstract")
    name = (component.category, component.name)
    if step.via is None or step.unlinked:
        return Row(*name, 0, "first sampling", 0, "first sampling") if periodic or printed else None
    wire = space.connections[step.via]
    if not periodic:
        return Row(*name, 0, "sampling", 0, "sampling") if printed else None
    if is_never_sampled(space, wire, component, view):
        return None
    if wire.timing == "immediate":
        return Row(*name, 0, "immediate", 0, "immediate")
    period = _sampling_period_ns(space, step, wire, component, view)
    entered = (
        crossed(space, place_step(space, FlowPosition(place.flow, place.position - 1)))[1] if place.position else None
    )
    method = "delayed sampling" if wire.timing == "delayed" else "sampling"
    if entered is not None:  # added to the minimum, too, as OSATE does
        more = max(0, period - entered.period_ns)
        return Row(*name, more, method, more, method)
    since = since_sampling(space, place, view) if is_synchronous(space, wire, view) else None
    if wire.timing == "delayed":
        least, most = (period, period) if since is None else _round_ups(since, period)
        return Row(*name, least, method, most, method)
    least, most = (0, period) if since is None else _round_ups(since, period)
    if space.profile != OLD:
        least = 0
    return Row(*name, least, method, most, method)


def _sampling_period_ns(space: Space, step: Step, wire: Connection, component: Component, view: View) -> Exact:
    """The receiver's period; today the sender's where that divides it and the connection is sampled."""
    period = period_ns(component, view)
    if space.profile == OLD or wire.timing != "sampled" or step.sender is None:
        return period
    sending = period_ns(space.components[step.sender], view)
    return sending if sending and period % sending == 0 else period


def _round_ups(since: Sums, period: Exact) -> tuple[Exact, Exact]:
    return _round_up(since.min_ns, period), _round_up(since.max_ns, period)


def _round_up(passed: Exact, period: Exact) -> Exact:
    """The time to the next multiple of a period: a whole period where `passed` is 0, and 0 for a period of 0.

    >>> [_round_up(passed, 10) for passed in (0, 3, 10, 12)], _round_up(3, 0)
    ([10, 7, 0, 8], 0)
    """
    if not period:
        return period
    return -passed % period if passed else period


def is_synchronous(space: Space, wire: Connection, view: View) -> bool:
    """Whether both ends of a connection run by one clock (AADL's Reference_Time, as `clock`).

    Those on one device or processor do, and those in one partition where a processor is not known. Where both state a
    clock, that it is the same one decides; else the setting of the system does.
    """
    ends = [_hardware(space, end, view) for end in (wire.source, wire.target)]
    if ends[0] is not None and ends[0] == ends[1]:
        return True
    if None in ends:
        inside = [space.components[end].partition if end is not None else None for end in (wire.source, wire.target)]
        if inside[0] is not None and inside[0] == inside[1]:
            return True
    clocks = [_stated_clock(space, end, view) for end in (wire.source, wire.target)]
    if clocks[0] and clocks[1]:
        return clocks[0] == clocks[1]
    return space.system == "synchronous"


def _stated_clock(space: Space, end: int | None, view: View) -> str:
    """The clock that the hardware of a component states; "" without one."""
    if end is None or not space.components[end].bound:
        return ""
    reading = at(space.components[end].clock, view)
    return reading.name if reading is not None else ""


def _hardware(space: Space, end: int | None, view: View) -> tuple[str, int] | None:
    """The hardware that a component runs on; a device runs on itself."""
    if end is None:
        return None
    component = space.components[end]
    if component.category == "device":
        return "device", end
    processor = at(component.processor, view) if component.bound else None
    return None if processor is None else ("processor", processor)


def since_sampling(space: Space, place: FlowPosition, view: View) -> Sums | None:
    """The time between the last row that sampled and an element of a flow; None where no row sampled.

    Entering a partition counts as sampling; immediate rows and those of buses do not.
    """
    sums = Sums()
    for position in range(place.position - 1, -1, -1):
        before = FlowPosition(place.flow, position)
        step = place_step(space, before)
        if step.kind == "connection":
            left, entered = crossed(space, step)
            if entered is not None:
                return sums
            sums = sums.with_rows(_connection_rows(space, before, view))
            if left is not None:
                sums = sums.with_rows(tuple(row for row in (_output_row(space, before, left, view),) if row))
            continue
        component = space.components[step.index]
        sums = sums.with_rows(tuple(later_rows(space, step, component, view)))
        first = _first_partition_row(space, before, component, view)
        if first is not None or _samples(space, step, component, view):
            return sums
    return None


def _samples(space: Space, step: Step, component: Component, view: View) -> bool:
    """Whether a component has a row that samples, whatever its value is."""
    if not is_sampling(space, component, view):
        return space.profile == OLD and component.category in ("device", "abstract")
    if step.via is None or step.unlinked:
        return True
    wire = space.connections[step.via]
    return wire.timing != "immediate" and (space.profile == OLD or wire.port in ("data", "feature"))


# --- partitions ---------------------------------------------------------------------------------------------------


def crossed(space: Space, step: Step) -> tuple[Partition | None, Partition | None]:
    """The partition that a connection leaves and the one that it enters, where these are not the same.

    A pair, both None for a component or where both ends are in one partition.
    """
    if step.kind != "connection":
        return None, None
    wire = space.connections[step.index]
    left, entered = (
        space.components[end].partition if end is not None else None for end in (wire.source, wire.target)
    )  # fmt: skip
    return (None, None) if left == entered else (left, entered)


def _first_partition_row(space: Space, place: FlowPosition, component: Component, view: View) -> Row | None:
    """The partition in which a flow starts with a component that is not periodic: time is counted from there."""
    partition = component.partition
    if place.position or partition is None or is_sampling(space, component, view):
        return None
    return Row("partition", partition.name, 0, "partition", 0, "partition")


def _output_row(space: Space, place: FlowPosition, left: Partition, view: View) -> Row | None:
    """Output leaves a partition with a window at its major frame, or at the end of a window."""
    if left.duration_ns is None:
        return None
    since = since_sampling(space, place, view) or Sums()
    least, most = (_output_ns(space, left, passed) for passed in (since.min_ns, since.max_ns))
    return Row("partition", left.name, least, "partition output", most, "partition output")


def _output_ns(space: Space, left: Partition, passed: Exact) -> Exact:
    if space.partition_output == "major_frame":
        return _round_up(passed + left.offset_ns, left.period_ns)
    window = left.duration_ns
    assert window is not None, left.name
    full = passed // window
    return (full + 1) * window - passed + full * left.period_ns


def _entry_row(space: Space, place: FlowPosition, entered: Partition, view: View) -> Row:
    """Input waits for the partition's frame, or for its window: at most a whole frame where clocks differ."""
    wire = space.connections[place_step(space, place).index]
    method = "partition offset" if entered.duration_ns is not None else "partition major frame"
    frame = entered.period_ns
    since = _since_crossing(space, place, view) if is_synchronous(space, wire, view) else None
    if since is None:
        return Row("partition", entered.name, 0, method, frame, method)
    before = _last_window(space, place, view) if entered.duration_ns is not None else None
    if before is None:
        least, most = _round_ups(since, frame)
    else:
        phase = entered.offset_ns - before.offset_ns
        least, most = (_to_phase(phase - passed, frame) for passed in (since.min_ns, since.max_ns))
    return Row("partition", entered.name, least, method, most, method)


def _to_phase(distance: Exact, frame: Exact) -> Exact:
    """A distance modulo a frame, as an expression of them (`dse.questions.sensitivity.traced_numbers`)."""
    return distance - distance // frame * frame


def _since_crossing(space: Space, place: FlowPosition, view: View) -> Sums | None:
    """The time since the last row that sampled, until a connection has carried its message."""
    since = since_sampling(space, place, view)
    if since is None:
        return None
    left = crossed(space, place_step(space, place))[0]
    output = _output_row(space, place, left, view) if left is not None else None
    rows = _connection_rows(space, place, view)
    return since.with_rows(rows if output is None else (output, *rows))


def _last_window(space: Space, place: FlowPosition, view: View) -> Partition | None:
    """The partition with a window that a flow was in last before a connection, as far as its rows tell."""
    for position in range(place.position - 1, -1, -1):
        step = place_step(space, FlowPosition(place.flow, position))
        entered = crossed(space, step)[1]
        if not position and step.kind == "component":
            component = space.components[step.index]
            first = _first_partition_row(space, FlowPosition(place.flow, 0), component, view)
            entered = component.partition if first is not None else None
        if entered is not None and entered.duration_ns is not None:
            return entered
    return None


# --- connections --------------------------------------------------------------------------------------------------


def _connection_rows(space: Space, place: FlowPosition, view: View, *, queues: bool = True) -> tuple[Row, ...]:
    """Transmission over each medium, its sampling, and waiting there; the connection's own latency without any."""
    wire = space.connections[place_step(space, place).index]
    name = ("connection", wire.name)
    nothing = NO_LATENCY[space.profile]
    stack = media(space, wire, view)
    rows = [row for row in (_medium_row(space, wire, medium, view) for medium in stack) if row.max_ns]
    periods = [(at(space.buses[medium.bus].period_ns, view) or 0, space.buses[medium.bus].name) for medium in stack]
    sampling = [(period, medium) for period, medium in periods if period]
    if space.profile == OLD:
        rows = [Row(*name, sum(r.min_ns for r in rows), nothing, sum(r.max_ns for r in rows), nothing)]
    elif not rows and not sampling:
        own = at(wire.latency_ns, view)
        if own is not None and own[1]:
            rows = [Row(*name, own[0], "specified", own[1], "specified")]
    rounded = bool(sampling) and is_rounded_to_bus(space, place, view)
    for period, medium_name in sampling:  # each samples by itself, also one that carries another
        least = period if rounded else 0
        rows.append(Row(*name, least, "sampling protocol", period, "sampling protocol", medium_name))
    waiting = _waiting_ns(space, place, view) if queues else 0
    if waiting:
        waited = (item.bus for item in stack if item.is_bound and not at(space.buses[item.bus].period_ns, view))
        names = ", ".join(dict.fromkeys(space.buses[number].name for number in waited))
        rows.append(Row(*name, 0, "queued", waiting, "queued", names))
    return tuple(rows) or (Row(*name, 0, nothing, 0, nothing),)


def _medium_row(space: Space, wire: Connection, medium: Medium, view: View) -> Row:
    """The time of one medium, and the rule that gives each end of it."""
    (least, is_least_timed), (most, is_most_timed) = medium_ends(space, wire, medium, view)
    methods = ["transmission time" if timed else "specified" for timed in (is_least_timed, is_most_timed)]
    return Row("connection", wire.name, least, methods[0], most, methods[1], space.buses[medium.bus].name)


def is_rounded_to_bus(space: Space, place: FlowPosition, view: View) -> bool:
    """OSATE in a synchronous system rounds up nothing to a bus's period where something sampled before: a whole one."""
    return space.system == "synchronous" and since_sampling(space, place, view) is not None


def _waiting_ns(space: Space, place: FlowPosition, view: View) -> Exact:
    """The wait of a message for the other connections of flows on its media, each counted once."""
    others = rivals(space, place)
    mine = _bound_to(space, place, view) if others else frozenset()
    return sum(_shared_ns(space, mine, other, view) for other in others) if mine else 0


def rivals(space: Space, place: FlowPosition) -> tuple[int, ...]:
    """The connections of flows that one may wait for on a bus, where its waiting is counted.

    OSATE prints it in the last of the flows alone that have the connection.
    """
    number = place_step(space, place).index
    if space.profile == OLD or space.bus_queuing == "not_counted" or _last_flows(space)[number] != place.flow:
        return ()
    return tuple(other for other in sorted(_last_flows(space)) if other != number)


_LAST: Recall[dict[int, int]] = Recall()


def _last_flows(space: Space) -> dict[int, int]:
    """The connections of flows, each with the last flow that has it."""

    def found(space: Space, _: object, __: View) -> dict[int, int]:
        steps = ((number, step) for number, flow in enumerate(space.flows) for step in flow.steps)
        return {step.index: number for number, step in steps if step.kind == "connection"}

    return _LAST.recall(space, "last flows", View(()), found)


def waiting_for_ns(space: Space, place: FlowPosition, other: int, view: View) -> Exact:
    """The wait of a message for one other connection: its longest transmission on each medium that both share.

    A medium with a period of its own makes no message wait. OSATE keeps the last of several messages on one medium.
    """
    return _shared_ns(space, _bound_to(space, place, view), other, view)


def _bound_to(space: Space, place: FlowPosition, view: View) -> frozenset[int]:
    """The buses and virtual buses that a connection is bound to, directly and through each other."""
    wire = space.connections[place_step(space, place).index]
    return frozenset(item.bus for item in media(space, wire, view) if item.is_bound)


def _shared_ns(space: Space, mine: frozenset[int], other: int, view: View) -> Exact:
    """The longest transmission of another connection on given media."""
    rival = space.connections[other]
    longest: dict[int, Exact] = {}
    for item in media(space, rival, view):
        if item.is_bound and item.bus in mine and not at(space.buses[item.bus].period_ns, view):
            longest[item.bus] = medium_ns(space, rival, item, view)[1] or longest.get(item.bus, 0)
    return sum(longest.values())
