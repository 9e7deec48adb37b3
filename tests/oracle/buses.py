"""Messages that wait for their bus, by playing its busiest stretch frame by frame.

The messages of a counted bus (`arbitration`) are jobs beside those of threads (`scheduling`): what their senders add to
their releases, and what they add to those of their receivers, is found with all response times.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from heapq import heappop, heappush, merge
from itertools import repeat
from typing import TYPE_CHECKING, Any

from . import quantities, wire
from .arbitration import arbitration, counted
from .identifiers import number_of, order_of
from .quantities import NS_PER_S
from .queues import Queues, hits_of
from .stretches import MOMENT, MOST_PLAYED, Releases, has_no_end, play_inside

if TYPE_CHECKING:
    from .scheduling import Job, Scheduling


class Buses:
    """The messages of the counted buses in one complete design."""

    def __init__(self, scheduling: Scheduling) -> None:
        self.scheduling, self.reading = scheduling, scheduling.reading
        slots = counted(self.reading.problem)
        self.bus_of: dict[str, str] = {}
        for name in self.reading.problem.sections["connections"]:
            bus = next((slot for slot in self.reading.stack(name) if slot in slots), None)
            if bus is not None:
                self.bus_of[name] = bus
        self.order: dict[str, list[str]] = {}
        self._found: dict[Any, Any] = {}
        self.jobs: list[Job] = [(name, "message") for name in self.bus_of if self.sent_as(name) == name]

    def sent_as(self, name: str) -> str:
        """The connection whose message it is: of those that leave one port onto a broadcast bus the first."""
        own, bus = self.reading.problem.component(name), self.bus_of[name]
        frame = self.reading.frame(name)
        if len(frame) > 1:
            return next(each for each in (self.reading.head(name), *frame) if self.bus_of.get(each) == bus)
        if not self._is_broadcast(bus) or "from_port" not in own or self.reading.stack(name)[0] != bus:
            return name
        for other in self.bus_of:
            body = self.reading.problem.component(other)
            if other == name:
                break
            alike = all(body.get(key) == own.get(key) for key in ("from", "from_port"))
            which = self._class if arbitration(self._type(bus)) == "classes" else self.identifier
            alike = alike and which(name) == which(other)
            sizes = [quantities.size(self.reading.get(each, "data_size")) for each in (name, other)]
            alike = alike and self.reading.stack(other)[0] == bus and sizes[0] == sizes[1]
            if alike and not any(self.reading.states_rate(each) for each in (name, other)):
                return other
        return name

    def identifier(self, name: str) -> int | None:
        """Its identifier in this design, -1 of a message without one; None where it may have any."""
        text = self.reading.get(self.reading.head(name), "identifier") or "-1"
        return None if text == "any" else number_of(text)

    def _class(self, name: str) -> int:
        """Its priority on Ethernet in this design, -1 of a message without one."""
        return int(self.reading.get(self.reading.head(name), "priority") or -1)

    def choose(self) -> None:
        """The places of messages on buses on which some may have any identifier, with releases as they are now."""
        flows = {name for path in self.reading.problem.paths.values() for name in path}
        for bus in dict.fromkeys(self.bus_of.values()):
            here = [name for name, _ in self.jobs if self.bus_of[name] == bus]
            if arbitration(self._type(bus)) != "priority" or all(self.identifier(name) is not None for name in here):
                continue
            parts = {
                name: [one for one in self.bus_of if self.bus_of[one] == bus and self.sent_as(one) == name]
                for name in here
            }
            frame = self._type(bus).get("frame")
            bits = int(frame.get("identifier_bits", 11)) if isinstance(frame, dict) else 29 if frame is None else 11
            self.order[bus] = order_of(
                {name: self.identifier(name) for name in here},
                {name: self._latest(parts[name]) for name in here},
                {name: self._period(name) for name in here},
                {name: bool(flows & set(parts[name])) for name in here},
                2**bits - 1,
                lambda name, before, behind, more, bus=bus: self._between(name, before, behind, bus, more),  # type: ignore[misc]
                self.reading.problem.sections["buses"][bus].get("assignment", "audsley"),
            )

    def _latest(self, names: Sequence[str]) -> Fraction | None:
        """How long a message may take on its bus for all that are this one message."""
        found: list[Fraction] = []
        for name in names:
            text = self.reading.get(name, "deadline")
            if text is not None:
                found.append(
                    Fraction(quantities.deadline(text)) - sum(Fraction(row[3]) for row in self._rows_before(name))
                )
        return min(found, default=None)

    def _period(self, name: str) -> Fraction | None:
        """The least time between two of a stream of it."""
        releases = self.releases(name)
        periods = [Fraction(period) for period, _ in releases.streams] if releases is not None else []
        return min(periods, default=None)

    def _rows_before(self, name: str) -> list[Any]:
        return [row for row in self.reading.transit_rows(name) if row[1] != f"transmission on {self.bus_of[name]}"]

    def _type(self, bus: str) -> Any:
        kind = self.reading.type_of(bus)
        assert kind is not None, bus
        return self.reading.problem.sections["bus_types"][kind]

    def _is_broadcast(self, bus: str) -> bool:
        return self._type(bus).get("broadcast") == "true"

    def times(self, name: str) -> tuple[Fraction, Fraction]:
        """Shortest and longest on the wire."""
        least, most = self.reading._transmission(name, self.bus_of[name])
        return Fraction(least), Fraction(most)

    def _last(self, name: str) -> tuple[Fraction, Fraction]:
        """The last frame of a message, and the longest of its frames."""
        bus, size = self.bus_of[name], self.reading.message_bytes(name)
        body, whole = self._type(bus), self.times(name)[1]
        frame = body.get("frame")
        protocol = frame.get("protocol") if isinstance(frame, dict) else frame
        if protocol == "ethernet":
            *before, rest = wire.packets({"protocol": "ethernet"} if isinstance(frame, str) else frame, size)
            bit = Fraction(NS_PER_S) / quantities.bandwidth(self.reading.bus_field(bus, "bandwidth"))
            takes = [(8 + 4 + 12 + max(60, part)) * bit for part in (rest, wire.longest_packet(frame))]
            return takes[0], takes[1] if before else whole
        most = {"can": 8, "can_fd": 64}.get(str(protocol))
        if most is None or size <= most:
            return whole, whole
        bandwidth = quantities.bandwidth(self.reading.bus_field(bus, "bandwidth"))
        *_, rest = wire.pieces(size, most)
        last, full = (wire.seconds(body, bandwidth, part)[1] * NS_PER_S for part in (rest, most))
        return last, full

    def releases(self, name: str) -> Releases | None:
        """When the message is handed to its bus; None where it may be late without a bound."""
        rows = self._rows_before(name)
        spread = sum((Fraction(row[3]) - row[2] for row in rows), Fraction(0))
        sender = self.reading.problem.component(name).get("from")
        if sender is None or self.reading.states_rate(name):
            rate = self.reading.delivered_rate(name)
            return Releases(((max(1, int(NS_PER_S / rate)), spread),) if rate else ())
        leaving = self.scheduling.leaving(sender)
        return None if leaving is None else Releases(tuple((period, late + spread) for period, late in leaving))

    def played(self, name: str) -> Fraction | None:
        """The longest from when the message is handed to its bus to the end of its last frame."""
        bus = self.bus_of[name]
        here = [other for other, _ in self.jobs if self.bus_of[other] == bus and other != name]
        kind = arbitration(self._type(bus))
        if kind == "priority":
            return self._by_identifier(name, here, bus)
        if kind == "classes":
            return self._by_class(name, here)
        mine = [other for other in here if self._sender(other) == self._sender(name)]
        line = here if kind == "fifo" else mine
        others = {self._sender(other) for other in here} - {self._sender(name)} if kind == "round_robin" else set()
        turn = sum(
            (max(self.times(other)[1] for other in here if self._sender(other) == sender) for sender in others),
            Fraction(0),
        )
        found = [self._inside([name, *line], turn, in_order=True)]
        if others:
            found.append(self._inside([name, *here], Fraction(0), in_order=False))
        return min((each for each in found if each is not None), default=None)

    def lag(self, name: str) -> Fraction | None:
        """The longest from the latest time at which the source of its sender may have it queued to its end."""
        takes, bus = self.scheduling.response[name, "message"], self.bus_of[name]
        sender = self.reading.problem.component(name).get("from")
        if takes is None or arbitration(self._type(bus)) != "priority":
            return takes
        if sender is None or self.reading.states_rate(name):
            return takes
        first = self.scheduling.chains.chain(sender)[0]
        begins = self.scheduling.releases((first, "timer"))
        if begins is None or begins.apart:
            return takes
        here = [other for other, _ in self.jobs if self.bus_of[other] == bus]
        if Queues({each: self.queue(each) for each in here}).lines:
            return takes
        found = self._by_identifier(name, [other for other in here if other != name], bus, begins)
        return None if found is None else min(found, takes)

    def _sender(self, name: str) -> str:
        return str(self.reading.problem.component(name).get("from") or f"outside of {name}")

    def _inside(self, names: Sequence[str], turn: Fraction, *, in_order: bool) -> Fraction | None:
        given: list[Any] = [(self.releases(each), self.times(each)[1] + turn) for each in names]
        if any(releases is None for releases, _ in given) or has_no_end(given, 0):
            return None
        return play_inside(given, [], 0, in_order=in_order)

    def _by_identifier(
        self, name: str, here: Sequence[str], bus: str, counted: Releases | None = None
    ) -> Fraction | None:
        order = self.order.get(bus) or sorted([name, *here], key=lambda each: self.identifier(each) or 0)
        place = order.index(name)
        queues = Queues({each: self.queue(each) for each in order})
        if not queues.lines:
            return self._between(name, order[:place], order[place + 1 :], bus, begins=counted)
        bit = Fraction(NS_PER_S) / quantities.bandwidth(self.reading.bus_field(bus, "bandwidth")) / 8
        frames = {each: (self.releases(each), self.times(each)[1], *self._last(each)) for each in order}
        faults = self._faults(bus)
        key = bus, bit, tuple(frames.items()), faults
        if key not in self._found:
            self._found[key] = queues.responses(frames, bit, faults)
        return self._found[key][name]

    def _by_class(self, name: str, here: Sequence[str]) -> Fraction | None:
        """Of those with the highest priority the oldest goes next; all of one priority are one queue."""
        listed = [each for each in self.reading.problem.sections["connections"] if each in {name, *here}]
        order = sorted(listed, key=lambda each: -self._class(each))
        queues = Queues({each: str(self._class(each)) for each in order})
        frames = {each: (self.releases(each), self.times(each)[1], *self._last(each)) for each in order}
        key = "classes", tuple(frames.items())
        if key not in self._found:
            self._found[key] = queues.responses(frames, Fraction(0))
        return self._found[key][name]

    def queue(self, name: str) -> str | None:
        """Which thread, device or computer queues a message as it comes."""
        sender = self.reading.problem.component(name).get("from")
        if sender is None:
            return None
        own = self.reading.get(sender, "transmit_queue")
        if own is not None:
            return str(sender) if own == "fifo" else None
        computer = self.reading.processor_of(sender)
        return computer if computer and self.reading.get(computer, "transmit_queue") == "fifo" else None

    def _between(
        self,
        name: str,
        urgent: Sequence[str],
        behind: Sequence[str],
        bus: str,
        more: int = 0,
        begins: Releases | None = None,
    ) -> Fraction | None:
        begun = max((self._last(other)[1] for other in behind), default=Fraction(0)) + more
        given: list[Any] = [(self.releases(each), self.times(each)[1]) for each in (name, *urgent)]
        bit = Fraction(NS_PER_S) / quantities.bandwidth(self.reading.bus_field(bus, "bandwidth")) / 8
        hits = hits_of(self._faults(bus), max(self._last(each)[1] for each in (name, *urgent)), bit)
        if any(releases is None for releases, _ in given) or has_no_end([*given, *hits], 1 if begun or hits else 0):
            return None
        return _play(given, begun, self._last(name)[0], bit, hits, begins)

    def _faults(self, bus: str) -> tuple[int, int] | None:
        """The time between faults of the wire, and how many may come at once."""
        interval = self.reading.bus_field(bus, "fault_interval")
        if interval is None:
            return None
        return int(quantities.period(interval)), int(self.reading.bus_field(bus, "fault_burst") or 1)


def _play(
    given: Sequence[tuple[Releases, Fraction]],
    begun: Fraction,
    last: Fraction,
    bit: Fraction,
    hits: Sequence[tuple[Releases, Fraction]] = (),
    begins: Releases | None = None,
) -> Fraction | None:
    """The longest time from a release of the first of these to its end; the others go first until its `last` frame.

    Of what `begins` its chain each job has one release: where that is later than its own the time is from there on.
    Another frame may have `begun` a moment before. What comes less than a bit after a frame has begun may still win it.
    Each fault of the wire that `hits` a frame before its end costs as much time.
    """
    began = iter(()) if begins is None else begins.densest()
    faults = merge(*(zip(releases.densest(), repeat(cost)) for releases, cost in hits))
    fault = next(faults, None)
    coming: list[tuple[Fraction, int, Fraction, Any]] = []
    for number, (releases, cost) in enumerate(given):
        times = releases.densest()
        heappush(coming, (next(times), number, cost, times))
    sooner = MOMENT if begun else Fraction(0)
    now, worst = begun - sooner, Fraction(0)
    urgent: list[Fraction] = []
    own: list[list[Fraction]] = []  # the release of each job that waits, and what it has left
    for _ in range(MOST_PLAYED):
        while fault is not None and fault[0] < now:
            now, fault = now + fault[1], next(faults, None)
        if not urgent and not own and (not coming or coming[0][0] > now or coming[0][0] == now > 0):
            return worst
        while coming and coming[0][0] < now + bit:
            time, number, cost, times = heappop(coming)
            if number:
                urgent.append(cost)
            else:
                since = next(began, None)
                own.append([time if since is None else max(time, since), cost])
            following = next(times, None)
            if following is not None:
                heappush(coming, (following, number, cost, times))
        if urgent:
            now += urgent.pop()
            continue
        release, left = own[0]
        if left > last:
            now, own[0][1] = now + left - last, last
            continue
        if fault is not None and fault[0] < now + left:
            now, fault = now + fault[1], next(faults, None)
            continue
        now += left
        worst = max(worst, now + sooner - release)
        own.pop(0)
    return None
