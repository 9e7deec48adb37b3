"""What a careful reader would remark: of a design, and of a problem whatever the design.

The load of a bus counts bytes against its bandwidth, its busy time counts what its messages take; where both are stated
they can contradict each other. So can the shortest and the longest processing of a thread, which come from different
figures (docs/semantics.md, section 3.2): in OSATE's setting Deadline the longest is the deadline, or nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from math import ceil
from typing import NamedTuple

from dse.analysis.binding import bus_figure, bus_stack, carrying_ns, message_sizes
from dse.analysis.diagnosis.join_remarks import (
    drifting_joins,
    dropping,
    endless_waits,
    skipping,
    unread_rooms,
    unsaid_joins,
)
from dse.analysis.latency.contributors import element_rows, elements_of, flow_rows
from dse.analysis.latency.exact_chains import MOST_RELEASES, repeats_too_late
from dse.analysis.latency.offset_advice import boundaries, clock_gains
from dse.analysis.latency.rows import OWN_JOB_METHOD, Row
from dse.analysis.latency.sampling import METHOD
from dse.analysis.measures import build_measure
from dse.analysis.osate.latency import FlowPosition
from dse.analysis.rates import NS_PER_S
from dse.analysis.terms import PPM
from dse.analysis.usage import busy_terms, reachable_buses
from dse.analysis.views import View, tabulate
from dse.space.architecture.frames import frame_at
from dse.space.model.criteria import Metric
from dse.space.model.flows import Flow, Step
from dse.space.model.space import EMPTY, Bus, Component, Connection, Space
from dse.space.model.trees import FROM_BANDWIDTH, at, leaves
from dse.space.question.metrics import busy_obstacle
from dse.support.units import (
    Exact,
    SizeRange,
    format_bandwidth,
    format_duration,
    format_ratio,
    format_size,
    format_size_range,
)
from dse.support.units.text import first_of

MANY_CASES = 10_000
"""Bounds of figures that depend on more combinations of options than this are not looked for."""
SHOWN = 3
"""The greatest number of contributions with a minimum above the maximum that are named."""
MOST_NAMED = 20
"""The greatest number of threads without an execution time that are named."""
TELLING = Fraction(101, 100)
"""By what factor a bus must be busier than its load says for a remark."""


@dataclass(frozen=True)
class _Transfer:
    """A message on a bus: its bytes, the longest time that it takes there, and the bus's bandwidth."""

    name: str
    size_bytes: int
    longest_ns: Exact
    bandwidth_bps: int

    @property
    def at_bandwidth_ns(self) -> Fraction:
        """The transmission time by bandwidth alone, in ns."""
        return Fraction(8 * self.size_bytes * NS_PER_S, self.bandwidth_bps)


def design_remarks(space: Space, view: View) -> Iterator[str]:
    """All remarks on a design.

    Sentences about minima above maxima, messages that are dropped, extrapolated sizes, reads that data just miss, and
    threads without execution time.
    """
    for flow in space.flows:
        rows = [row for row in flow_rows(space, flow, view) if row.max_method != OWN_JOB_METHOD]
        reversed_rows = dict.fromkeys(map(_reversed, rows))
        yield from _too_small(space, flow, [text for text in reversed_rows if text])
        if repeats_too_late(space, flow, view):
            yield (
                f"{flow.name} repeats only after more than {MOST_RELEASES:,} releases: its bound stands for its exact "
                "latency"
            )
    yield from _late_reads(space, view)
    yield from endless_waits(space, view)
    yield from dropping(space, view)
    yield from skipping(space, view)
    yield from _bus_remarks(space, view)
    yield from outside_words(dict.fromkeys(outside_sizes(space, view)))
    untimed = [item.name for item in _on_processors(space) if at(item.execution_ns, view) is None]
    yield from _untimed(untimed)


def _late_reads(space: Space, view: View) -> Iterator[str]:
    """How much of a flow's jitter is there because jobs may read when they begin, and not at their release."""
    rows = {flow.name: flow_rows(space, flow, view) for flow in space.flows}
    readers_of: dict[str, dict[str, Exact]] = {}
    for item in boundaries(space, view):
        sender, reader = item.offsets_ns
        ends = item.sender, item.receiver
        waits = [row for row in rows[item.flow] if row.contributor in ends and row.max_method.startswith("response")]
        if sender is not None and reader is not None and waits:
            less = (reader - sender - item.there_ns[0]) % item.step_ns - item.wait_ns[0]
            if less > 0:
                readers_of.setdefault(item.flow, {})[f"{item.receiver} (after {item.sender})"] = less
    for flow, readers in readers_of.items():
        yield (
            f"{flow}: {format_duration(sum(readers.values()))} of its jitter are there because jobs may read when they "
            f"get the CPU, at {', '.join(readers)}: not where they read at their release (`communication: at_dispatch` "
            "or `let`)"
        )


def _on_processors(space: Space) -> Iterator[Component]:
    """Threads of which an execution time would be counted; shared data take none."""
    if space.profile == "dse":  # OSATE has its own figures in place of one
        threads = (item for item in space.components if item.section == "threads" and item.category != "data")
        yield from (item for item in threads if item.processor is not None)


def _untimed(names: Sequence[str]) -> Iterator[str]:
    """The remark that threads count as taking no time."""
    if names:
        more = f", and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        yield (
            f"no execution time is stated for {', '.join(names[:MOST_NAMED])}{more}: without "
            "`compute_execution_time` a thread counts as 0 ms"
        )


def _bus_remarks(space: Space, view: View) -> Iterator[str]:
    """Buses of a design that are busier than their load says, or than there is time; transfers that take no time."""
    for number, bus in enumerate(space.buses):
        chosen = bus.types[view[bus.type_decision]]
        if bus.virtual or chosen == EMPTY:
            continue
        carried = [item for item in space.connections if number in bus_stack(space, item, view)]
        if carried and _instant_type(bus, space.profile == "dse", view) is not None:
            yield _no_time(space, bus, chosen)
        if busy_obstacle(space, number):
            continue
        busy = _value(space, Metric("", "busy", number), view)
        bandwidth_bps = at(bus.bandwidth_bps, view)
        share = _value(space, Metric("", "load", number), view) * 8 * PPM / bandwidth_bps if bandwidth_bps else busy
        if busy > share * TELLING:
            yield (
                f"{bus.name} is busy for {_percent(busy)} of the time, although its load is {_percent(share)} of the "
                "bandwidth: its messages take longer than the bandwidth says"
            )
        elif busy > PPM:
            yield f"{bus.name} would be busy for {_percent(busy)} of the time"


def problem_remarks(space: Space) -> Iterator[str]:
    """Remarks on every bus that a design may have and on every flow: busy times, and transfers that take no time.

    Sentences that hold whatever the design; what depends on many options at once is left out beyond `MANY_CASES`.
    """
    yield from _untimed([item.name for item in _on_processors(space) if None in leaves(item.execution_ns)])
    yield from _of_other_rules(space)
    yield from _late_offsets(space)
    yield from _never_sent(space)
    yield from _never_packed(space)
    yield from unsaid_joins(space)
    yield from drifting_joins(space)
    yield from unread_rooms(space)
    yield from outside_words(_possibly_outside(space, MANY_CASES))
    alone = replace(space, processing="execution_time")  # a response time is never below an execution time
    for flow in space.flows:
        remarks: dict[str, None] = {}
        for element in elements_of(space, flow):
            rows = tabulate(space, partial(_reversed_row, alone, element), MANY_CASES)
            remarks |= dict.fromkeys(case.value for case in rows or () if case.value)
        yield from _too_small(space, flow, list(remarks))
        yield from _gains(space, flow)
    for number, bus in enumerate(space.buses):
        if space.profile == "dse" and any(leaf is not None for leaf in leaves(bus.period_ns)):
            yield (
                f"the period of {bus.name} does not count: only OSATE's profiles sample with it (here the slot of a "
                "message is a device of category bus before it)"
            )
        if bus.virtual:
            continue
        users = [item for item in space.connections if number in reachable_buses(space, item)]
        cases = tabulate(space, partial(_instant_type, bus, space.profile == "dse"), MANY_CASES) if users else None
        for chosen in dict.fromkeys(case.value for case in cases or () if case.value is not None):
            yield _no_time(space, bus, chosen)
        yield from _slow(space, number, users)
        least = _least_busy(space, number)
        if least > PPM:
            yield f"{bus.name} is busy for at least {_percent(least)} of the time, whatever the design"


def _late_offsets(space: Space) -> Iterator[str]:
    """Stated offsets of a whole period and more: of the phases between timers only what is left of them counts."""
    for item in space.components:
        periods = {leaf for leaf in leaves(item.period_ns) if leaf is not None}
        offsets = dict.fromkeys(leaf for leaf in leaves(item.offset_ns) if leaf is not None)
        for offset in offsets if len(periods) == 1 else ():
            if offset >= max(periods):
                rest = format_duration(offset % max(periods))
                period = format_duration(max(periods))
                yield f"{item.name} has a period of {period}: its offset of {format_duration(offset)} counts as {rest}"


def _never_sent(space: Space) -> Iterator[str]:
    """Connections with a physical bus whose ends are on one processor in every design, so that nothing is sent."""
    by_reason: dict[str, list[str]] = {}
    for item in space.connections if space.profile == "dse" else ():
        bus = space.buses[item.stated_bus] if isinstance(item.stated_bus, int) and not item.is_inner else None
        if bus is not None and item.bus is None and not bus.virtual:
            by_reason.setdefault(bus.name, []).append(item.name)
    for carrier, names in by_reason.items():
        more = f", and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        yield (
            f"not sent over {carrier}, for sender and receiver share a processor or process: "
            f"{', '.join(names[:MOST_NAMED])}{more} (a virtual bus may carry them on the processor)"
        )


def _never_packed(space: Space) -> Iterator[str]:
    """Buses with ``packing: any`` on which no connection may be carried in the message of another one."""
    for name in space.packed:
        if not any(item.riders for item in space.connections if _is_on(space, item, name)):
            yield (
                f"nothing can be packed on {name}: no two connections of one sender on {name} alone have data that fit "
                "into one frame, and rates of which one is stated for both or for neither"
            )


def _is_on(space: Space, item: Connection, name: str) -> bool:
    return any(leaf is not None and space.buses[leaf].name == name for leaf in leaves(item.bus))


def _of_other_rules(space: Space) -> Iterator[str]:
    """The remarks on fields that are stated and that the profile ignores."""
    if space.profile == "dse":
        names_of = {
            "protocols": [item.name for item in space.connections if item.protocols]
            + [item.name for item in space.buses if any(leaves(item.protocols))],
            "timing": [item.name for item in space.connections if item.timing != "sampled"],
            "partition": [item.name for item in space.components if item.partition is not None],
            "period": [item.name for item in space.buses if any(leaves(item.period_ns))],
        }
        said = [f"{field} of {first_of(names, SHOWN)}" for field, names in names_of.items() if names]
        if said:
            yield f"profile dse does not look at what only the osate profiles count: {'; '.join(said)}"
        return
    asking = [item.name for item in space.buses if FROM_BANDWIDTH in leaves(item.fixed_ns)]
    if asking:
        unknown = f"profile {space.profile} does not know `transmission_time: from bandwidth`"
        yield f"{unknown}: on {first_of(asking, SHOWN)} messages take the `latency` of the bus, or no time"


def _gains(space: Space, flow: Flow) -> Iterator[str]:
    """The remark on the latency that a flow would gain if its timers shared a clock."""
    gains = clock_gains(space, flow)
    if gains:
        parts = [f"{format_duration(item.saves_ns)} at {item.receiver} (after {item.sender})" for item in gains]
        yield (
            f"{flow.name}: timers of one processor are treated as unsynchronised; stating offsets on one clock may "
            f"save up to {format_duration(sum(item.saves_ns for item in gains))}: {', '.join(parts)}"
        )


def _reversed_row(space: Space, element: Step | FlowPosition, view: View) -> str:
    return next((text for row in element_rows(space, element, view) if (text := _reversed(row))), "")


def _reversed(row: Row) -> str:
    """A contribution whose minimum is above its maximum, in words; "" for others.

    What comes sooner may wait longer for the next release of a timer: that is no contradiction.
    """
    if row.min_ns <= row.max_ns or row.max_method == METHOD:
        return ""
    least, most = format_duration(row.min_ns), format_duration(row.max_ns)
    return f"{row.contributor} at least {least} ({row.min_method}), at most {most} ({row.max_method})"


def _too_small(space: Space, flow: Flow, names: Sequence[str]) -> Iterator[str]:
    """The remark that the maximum and the jitter of a flow are too small, for minima above maxima."""
    if names:
        more = f", and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        setting = "" if space.profile == "dse" else f" (worst case by {space.worst_case.replace('_', ' ')})"
        yield (
            f"the maximum and the jitter of {flow.name} are too small: by profile {space.profile}{setting} it counts "
            f"for {'; '.join(names[:SHOWN])}{more}"
        )


def _instant_type(bus: Bus, knows_bandwidth: bool, view: View) -> str | None:
    """The type of a bus, where it has a bandwidth but nothing that says how long a message takes.

    A time that follows from the bandwidth OSATE does not know.
    """
    none = (None,) if knows_bandwidth else (None, FROM_BANDWIDTH)
    times = (bus.fixed_ns, bus.latency_ns)
    is_instant = at(bus.bandwidth_bps, view) is not None and all(at(tree, view) in none for tree in times)
    return bus.types[view[bus.type_decision]] if is_instant else None


def _no_time(space: Space, bus: Bus, chosen: str) -> str:
    why = "`transmission_time: from bandwidth` asks for size / bandwidth"
    if space.profile != "dse":
        why = f"{why} under profile dse alone"
    states = f"its type {chosen} states a bandwidth, but no transmission time"
    return f"transfers over {bus.name} take no time: {states} ({why})"


def _slow(space: Space, number: int, users: list[Connection]) -> Iterator[str]:
    """The remark that messages of a bus may take longer than its bandwidth says, by the worst example."""
    slow_transfers: list[_Transfer] = []
    for item in users:
        cases = tabulate(space, partial(_transfer, space, number, item), MANY_CASES)
        slow_transfers += [case.value for case in cases or () if case.value is not None]
    slowest = max(slow_transfers, key=lambda one: one.longest_ns / one.at_bandwidth_ns, default=None)
    if slowest is not None and slowest.longest_ns > slowest.at_bandwidth_ns * TELLING:
        name, obstacle = space.buses[number].name, busy_obstacle(space, number)
        busy_words = f"its busy time {obstacle}" if obstacle else f"`busy of {name}` counts the time"
        yield (
            f"{name} may be busier than its load says: {slowest.name} ({format_size(slowest.size_bytes)}) takes up to "
            f"{format_duration(slowest.longest_ns)}, at {format_bandwidth(slowest.bandwidth_bps)} it would be "
            f"{format_duration(round(slowest.at_bandwidth_ns))}; {busy_words}"
        )


def _transfer(space: Space, number: int, item: Connection, view: View) -> _Transfer | None:
    """The transfer of a connection over a bus, where both its time and the bandwidth are stated; loads count frames."""
    stack, bus = bus_stack(space, item, view), space.buses[number]
    if number not in stack or at(item.size_bytes, view) is None or frame_at(bus.fixed_ns, view) is not None:
        return None
    size, bandwidth_bps = ceil(max(message_sizes(space, item, number, view))), at(bus.bandwidth_bps, view)
    times = carrying_ns(space, bus, item, size, view)
    if times is None or not size or not bandwidth_bps:
        return None
    return _Transfer(item.name, size, times[1], bandwidth_bps)


def _least_busy(space: Space, number: int) -> Fraction:
    """A lower bound of the busy time in ppm: each connection at its least."""
    total = Fraction(0)
    for term in busy_terms(space, number) if not busy_obstacle(space, number) else ():
        cases = tabulate(space, term.value, MANY_CASES)
        total += min((case.value for case in cases or ()), default=Fraction(0))
    return total


def _value(space: Space, metric: Metric, view: View) -> Fraction:
    return build_measure(space, metric).value(view)


def _percent(ppm: Fraction) -> str:
    """A share with two decimals."""
    return format_ratio(round(ppm / PPM, 4))


# Messages of sizes for which the stated transmission times are not known to hold.
#
# A line through what was measured says nothing beyond the sizes that were (docs/measurements.md): the times of such
# messages are counted all the same, and remarked.


SHOWN_OF_KNOWN_SIZES = 4
"""The greatest number of messages that are named."""


class Outside(NamedTuple):
    """A message on a bus whose transmission time holds for other sizes; `size_bytes` with protocol overheads.

    Sizes in bytes; `sizes` is the range of the measurements behind the transmission time.
    """

    connection: str
    size_bytes: int
    bus: str
    sizes: SizeRange

    @property
    def text(self) -> str:
        """``scan (10 KB; ros_ipc: 1 B .. 3 KB)``."""
        return f"{self.connection} ({format_size(self.size_bytes)}; {self.bus}: {format_size_range(self.sizes)})"


def outside_sizes(space: Space, view: View) -> Iterator[Outside]:
    """Every message of a design that is smaller or larger than what its transmission times hold for.

    For one design; nothing where no bus states a range of sizes.
    """
    if any(bus.sizes_bytes is not None for bus in space.buses):
        for item in space.connections:
            yield from _outside(space, item, view)


def _possibly_outside(space: Space, limit: int) -> dict[Outside, None]:
    """Messages that in some design are smaller or larger than their transmission times hold for.

    A connection with more than `limit` cases is left out.
    """
    outside: dict[Outside, None] = {}
    for item in space.connections:
        if any(space.buses[number].sizes_bytes is not None for number in reachable_buses(space, item)):
            cases = tabulate(space, partial(_outside, space, item), limit) or ()
            outside |= dict.fromkeys(one for case in cases for one in case.value)
    return outside


def _outside(space: Space, item: Connection, view: View) -> tuple[Outside, ...]:
    if at(item.size_bytes, view) is None:
        return ()
    outside = []
    for number in bus_stack(space, item, view):
        bus = space.buses[number]
        sizes = _sizes(space, number, item, view)
        for size in map(ceil, message_sizes(space, item, number, view)):
            if sizes is not None and not sizes.min_bytes <= size <= sizes.max_bytes:
                outside.append(Outside(item.name, size, bus.name, sizes))
    return tuple(outside)


def _sizes(space: Space, bus: int, item: Connection, view: View) -> SizeRange | None:
    sizes: SizeRange | None = bus_figure(space, space.buses[bus].sizes_bytes, item, view)
    return sizes


def outside_words(outside: Collection[Outside]) -> Iterator[str]:
    """The remark that transmission times are extrapolated to other message sizes; nothing where `outside` is empty.

    At most one sentence with at most `SHOWN_OF_KNOWN_SIZES` messages.
    """
    if outside:
        more = f", and {len(outside) - SHOWN_OF_KNOWN_SIZES} more" if len(outside) > SHOWN_OF_KNOWN_SIZES else ""
        named = ", ".join(item.text for item in list(outside)[:SHOWN_OF_KNOWN_SIZES])
        yield f"transmission times are extrapolated to sizes of messages that they are not stated for: {named}{more}"
