"""Boundaries on one clock: which reads data just miss, which they may miss, and the offset that would spare the wait.

docs/semantics.md, section 3.6. The wait of a reader jumps by a step where the moment at which its data are there
crosses one of its releases; how far that is off, and which other offset of the reader makes a flow's latency shortest
while all other offsets stay, follows from the waits of neighbours alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Annotated

from dse.analysis.latency.contributors import neighbours
from dse.analysis.latency.sampling import Pair, common_step, wait_ns
from dse.analysis.rates import is_periodic
from dse.analysis.views import View, tabulate
from dse.space.architecture.clocks import with_past
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.json_fields import Json
from dse.support.units import Exact, is_unbounded

MOST_CASES = 10_000
"""What a reader gains from a clock is looked for where it depends on no more combinations of options than this."""
MOST_OFFSETS = 256
"""The greatest number of offsets of a reader that are compared for each neighbour with which it may meet."""


@dataclass(frozen=True)
class Shift:
    """Another offset of a reader, all others as they are."""

    JSON_NAME = "BetterOffset"

    offset_ns: Annotated[Exact, "The offset."]
    saves_ns: Annotated[Exact, "What the latency of the flow is shorter by."]
    costs_ns: Annotated[Mapping[str, Exact], "What the latencies of other flows are longer by, by flow."]


@dataclass(frozen=True)
class Boundary:
    """A reader on the clock of the timer before it on a flow.

    Times in ns; `step_ns` is the greatest common divisor of both periods.
    """

    flow: Annotated[str, "The flow."]
    sender: Annotated[str, "The timer whose data are read."]
    receiver: Annotated[str, "The timer that reads."]
    offsets_ns: Annotated[tuple[Exact | None, Exact | None], "The offset of each; null where it is unknown."]
    periods_ns: Annotated[tuple[Exact, Exact], "The period of each."]
    there_ns: Annotated[
        tuple[Exact, Exact], "How long after the sender's release data are there, at least and at most."
    ]
    wait_ns: Annotated[
        tuple[Exact, Exact], "How long these then wait: what is there first at least, what is there last at most."
    ]
    step_ns: Exact
    room_ns: Annotated[
        Exact | None,
        "How much later the last data may be there before they miss the read; null where an offset is unknown.",
    ]
    is_crossed: Annotated[bool, "Whether some data meet a read that others miss.", Json("crossed")]
    better: Annotated[Shift | None, "The reader's offset with which the flow is shortest; null where it is."]

    @property
    def is_just_missed(self) -> bool:
        """Whether data wait for most of a step, for which another offset of the reader is the cure.

        A change of the offset then saves at least half a step.
        """
        return self.better is not None and 2 * self.better.saves_ns >= self.step_ns


@dataclass(frozen=True)
class _Hop:
    """Neighbours on one clock; `ends` are numbers of components, `pair` is without their offsets."""

    flow: str
    ends: tuple[int, int]
    pair: Pair
    least_ns: Exact
    most_ns: Exact

    def wait_ns(self, offsets: Mapping[int, Exact | None]) -> tuple[Exact, Exact]:
        """The wait for some offsets of all components."""
        earlier, later = (offsets[number] for number in self.ends)
        if earlier is None or later is None:
            return 0, self.pair.receiver_ns
        return wait_ns(replace(self.pair, shift_ns=later - earlier), self.least_ns, self.most_ns)


def boundaries(space: Space, view: View) -> tuple[Boundary, ...]:
    """Every reader whose data come from a timer on the same clock, flow by flow.

    One for each pair of neighbouring timers on one clock; only under the profile *dse*.
    """
    if space.profile != "dse":
        return ()
    hops = [hop for flow in space.flows for step in flow.steps for hop in _hops(space, flow, step, view)]
    offsets = {number: at(space.components[number].offset_ns, view) for hop in hops for number in hop.ends}
    return tuple(_boundary(space.components, hop, hops, offsets) for hop in hops)


def _hops(space: Space, flow: Flow, step: Step, view: View) -> Iterator[_Hop]:
    if step.kind != "component" or not step.since or not is_periodic(space.components[step.index], view):
        return
    pair = neighbours(space, step, view, offsets=False)
    if pair is not None and not is_unbounded(pair.most_ns):
        yield _Hop(flow.name, (pair.sender, step.index), pair.pair, pair.least_ns, pair.most_ns)


def _boundary(
    components: Sequence[Component], hop: _Hop, hops: Sequence[_Hop], offsets: Mapping[int, Exact | None]
) -> Boundary:
    earlier, later = (offsets[number] for number in hop.ends)
    error, step = hop.pair.error_ns, hop.pair.step_ns
    room, is_crossed = None, False
    if earlier is not None and later is not None:
        last = later - earlier - hop.most_ns - error
        room = last % step
        begins = hop.pair.begins_ns[1]  # a job that begins later than it is released meets more
        first = later - earlier - hop.least_ns + error
        is_crossed = is_unbounded(begins) or (first + begins) // step != last // step
    return Boundary(
        hop.flow,
        components[hop.ends[0]].name,
        components[hop.ends[1]].name,
        (earlier, later),
        (hop.pair.sender_ns, hop.pair.receiver_ns),
        (hop.least_ns, hop.most_ns),
        hop.wait_ns(offsets),
        step,
        room,
        is_crossed,
        _better(hop, hops, offsets),
    )


def _better(hop: _Hop, hops: Sequence[_Hop], offsets: Mapping[int, Exact | None]) -> Shift | None:
    """The offset of the reader with which the flow is shortest, the least of them; None where none is shorter."""
    reader = hop.ends[1]
    around = [item for item in hops if reader in item.ends]
    today = _longest(around, offsets)
    best: tuple[Exact, Exact, Exact] | None = None
    for offset in _meetings(reader, around, offsets):
        latencies_ns = _longest(around, {**offsets, reader: offset})
        others = sum(max(0, latencies_ns[flow] - today[flow]) for flow in latencies_ns if flow != hop.flow)
        key = latencies_ns[hop.flow], others, offset
        best = key if best is None or key < best else best
    if best is None or best[0] >= today[hop.flow]:
        return None
    latencies_ns = _longest(around, {**offsets, reader: best[2]})
    costs = {flow: latencies_ns[flow] - today[flow] for flow in latencies_ns if latencies_ns[flow] > today[flow]}
    return Shift(best[2], today[hop.flow] - best[0], costs)


def _longest(hops: Sequence[_Hop], offsets: Mapping[int, Exact | None]) -> dict[str, Exact]:
    """The longest waits of each flow, added up."""
    latencies_ns: dict[str, Exact] = {}
    for hop in hops:
        latencies_ns[hop.flow] = latencies_ns.get(hop.flow, 0) + hop.wait_ns(offsets)[1]
    return latencies_ns


def _meetings(reader: int, around: Sequence[_Hop], offsets: Mapping[int, Exact | None]) -> Iterator[Exact]:
    """The offsets of a reader at which it just meets data, or what it makes just meets the next reader."""
    seen: set[Exact] = set()
    for hop in around:
        sender, receiver = hop.ends
        other = offsets[sender if receiver == reader else receiver]
        if other is None or sender == receiver:
            continue
        late, step = hop.most_ns + hop.pair.error_ns, hop.pair.step_ns
        own = hop.pair.receiver_ns if receiver == reader else hop.pair.sender_ns
        first = (other + late if receiver == reader else other - late) % step
        for number in range(min(ceil(own / step), MOST_OFFSETS)):
            offset = first + number * step
            if offset < own and offset not in seen:
                seen.add(offset)
                yield offset


@dataclass(frozen=True)
class Gain:
    """A reader that a timer on the same processor feeds, and what one clock and offsets take off its wait at most."""

    sender: str
    receiver: str
    saves_ns: Exact


def clock_gains(space: Space, flow: Flow) -> tuple[Gain, ...]:
    """The greatest gains of a flow from timers that keep their phase, in a problem that states no clocks.

    Between neighbours with periods T_i and T_j the pair bound is T_j - g + r, r >= 0, against T_j: g at most, the
    greatest over all designs. Nothing is said of neighbours whose cases are too many to look through.
    """
    if space.profile != "dse" or any(step.since for item in space.flows for step in item.steps):
        return ()
    if any(item.pieces is not None for item in space.components):  # beside segments clocks are refused
        return ()
    gains = []
    for step in with_past(flow.steps):
        if step.kind == "component" and step.since and space.components[step.index].processor is not None:
            cases = tabulate(space, partial(_gain, space, step), MOST_CASES) or ()
            best = max((case.value for case in cases if case.value is not None), default=None)
            if best is not None:
                gains.append(Gain(best[1], space.components[step.index].name, best[0]))
    return tuple(gains)


def _gain(space: Space, step: Step, view: View) -> tuple[Exact, str] | None:
    """The gain of one reader in a design, and the sender that it reads from."""
    receiver = space.components[step.index]
    if not is_periodic(receiver, view):
        return None
    for sender in (space.components[item.index] for item in reversed(step.since) if item.kind == "component"):
        if is_periodic(sender, view):
            if sender.processor is None or at(sender.processor, view) != at(receiver.processor, view):
                return None
            return common_step(at(sender.period_ns, view), at(receiver.period_ns, view)), sender.name
    return None
