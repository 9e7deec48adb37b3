"""Threads that need a message of each trigger for a job: how long what comes waits for the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from . import quantities
from .quantities import NS_PER_S

if TYPE_CHECKING:
    from .reading import Reading


class Tick(NamedTuple):
    """What comes `least` to `most` after each release of a timer, or sending from the boundary, in their order."""

    timer: str
    period: Fraction
    least: Any
    most: Any


class Joins:
    """What one design says of joins of all."""

    def __init__(self, reading: Reading) -> None:
        self.reading, self.problem = reading, reading.problem

    def joins(self, name: str) -> bool:
        """Whether a job needs a message of each trigger."""
        section, protocol = self.problem.section_of[name], self.reading.protocol(name)
        return section == "threads" and protocol != "periodic" and self.reading.get(name, "join") == "all"

    def room(self, name: str, connection: str) -> int | None:
        """How many messages of a connection there are at most; None where all stay."""
        if self.reading.protocol(name) == "hybrid" or self.reading.get(name, "pairing") == "latest":
            return 1
        size = self.reading.get(connection, "queue_size")
        size = self.reading.get(name, "queue_size") if size is None else size
        return None if size is None else max(1, int(size))

    def wait(self, name: str, way: Sequence[str]) -> tuple[Any, Any]:
        """The least and the greatest wait of what came by `way`, the path up to the thread; None: no bound."""
        by_room, in_order = self._waits(name, way)
        ways = self._ways(name)
        is_in_order = ways is not None and self._nothing_is_dropped(name, ways)
        least = self._least(name, ways, way[-1], way) if ways is not None and is_in_order else Fraction(0)
        return least, min((*by_room, *in_order), default=None)

    def _waits(self, name: str, way: Sequence[str]) -> tuple[list[Any], list[Any]]:
        """The bounds of the longest wait: by the room, and by the order of arrival."""
        others = [connection for connection in self.reading.triggers(name) if connection != way[-1]]
        by_room = []
        room = self.room(name, way[-1])
        if room is not None:
            gaps = [self._gap(name, connection) for connection in others]
            if None not in gaps:
                by_room.append(room * max(gaps))
        ways = self._ways(name)
        if ways is None or not self._nothing_is_dropped(name, ways):
            return by_room, []
        return by_room, list(self._in_order(ways, way[-1], way))

    def slowest(self, name: str, way: Sequence[str]) -> int | None:
        """The longest period before a thread that a flow reaches at its latest release in order; None where not so."""
        by_room, in_order = self._waits(name, way)
        if not in_order or min(in_order) > min(by_room, default=min(in_order)):
            return None
        if self.reading.protocol(name) == "sporadic":  # which may hold a job back
            return None
        return max(max(1, int(tick.period)) for ticks in (self._ways(name) or {}).values() for tick in ticks)

    def _gap(self, name: str, connection: str) -> Any:
        longest = self.reading.message_distances(connection)[1]
        return None if longest is None else longest + self._callback_spread(name)

    def _callback_spread(self, name: str) -> Any:
        least, most = self.reading.callback_range(name) if self.reading.protocol(name) == "hybrid" else (0, 0)
        return most - least

    def job_distances(self, name: str) -> tuple[Any, Any]:
        """The longest time between two jobs is that of the slowest input, and a timer's period on top."""
        ways = [self._gap(name, connection) for connection in self.reading.triggers(name)]
        longest = None if None in ways else max(ways)
        if self.reading.protocol(name) == "hybrid":
            period = self.reading.period_ns(name)
            return period, None if longest is None else longest + period
        return 0, longest

    # In order

    def _ways(self, name: str) -> dict[str, list[Tick]] | None:
        found = {connection: self._delivered(connection) for connection in self.reading.triggers(name)}
        if any(ticks is None for ticks in found.values()):
            return None
        return {connection: ticks for connection, ticks in found.items() if ticks is not None}

    def _delivered(self, connection: str) -> list[Tick] | None:
        """What the messages of a connection come of; None where they are not those of timers one by one."""
        rows = self.reading.connection_rows(connection)
        least, most = (sum((Fraction(row[end]) for row in rows), Fraction(0)) for end in (2, 3))
        sender = self.problem.component(connection).get("from")
        if sender is None:
            rate = self.reading.delivered_rate(connection)
            return [Tick(connection, NS_PER_S / rate, least, most)] if rate else None
        if self.reading.states_rate(connection):
            return None
        sent = self._sent(sender)
        return sent and [tick._replace(least=tick.least + least, most=tick.most + most) for tick in sent]

    def _sent(self, name: str) -> list[Tick] | None:
        released = self._released(name)
        least, most = self._takes(name)
        return released and [tick._replace(least=tick.least + least, most=tick.most + most) for tick in released]

    def _takes(self, name: str) -> tuple[Any, Any]:
        logical = self.reading.logical_ns(name)
        return self.reading.processing(name) if logical is None else (logical, logical)

    def _released(self, name: str) -> list[Tick] | None:
        protocol = self.reading.protocol(name)
        if protocol == "hybrid" and self.joins(name):
            return None
        if protocol in ("periodic", "hybrid") and self.reading.skipped_ns(name):
            return None
        if protocol in ("periodic", "hybrid"):
            return [Tick(name, Fraction(self.reading.period_ns(name) or 0), 0, 0)]
        if not self.joins(name) and len(self.reading.triggers(name)) != 1:
            return None
        ways = self._ways(name)
        if ways is None or (self.joins(name) and not self._nothing_is_dropped(name, ways)):
            return None
        by_timer: dict[str, Tick] = {}
        for tick in (tick for ticks in ways.values() for tick in ticks):
            before = by_timer.get(tick.timer, tick)
            by_timer[tick.timer] = tick._replace(least=max(before.least, tick.least), most=max(before.most, tick.most))
        together = list(by_timer.values())
        apart = (
            self.reading.period_ns(name) or 0 if protocol == "sporadic" and self.reading.offered(name, "period") else 0
        )
        needed = max(self._takes(name)[1], apart)
        spreads = [self._latest(tick, together) for tick in together]
        is_apart = any(
            latest is not None and tick.period - (latest - self._soonest(tick, together)) >= needed
            for tick, latest in zip(together, spreads, strict=True)
        )
        return together if is_apart or not needed else None

    def _phase(self, one: Tick, other: Tick) -> tuple[Any, Any]:
        """How much later the k-th release of the other timer is, at least and at most, whatever k; None: no bound."""
        if one.timer == other.timer:
            return 0, 0
        least, most = -one.period, other.period
        offsets = [self._offset(tick.timer) for tick in (one, other)]
        sections = {self.problem.section_of[tick.timer] for tick in (one, other)}
        error = None if "connections" in sections else self.reading.error_ns(one.timer, other.timer)
        if error is not None and offsets[0] is not None and offsets[1] is not None:
            least = most = Fraction(offsets[1] - offsets[0])
            least, most = least - error, most + error
        return (
            None if other.period < one.period else least,
            None if other.period > one.period else most,
        )

    def _offset(self, timer: str) -> int | None:
        if self.problem.section_of[timer] == "connections" or not self.reading.is_active(timer, "offset"):
            return None
        text = self.reading.get(timer, "offset")
        return None if text in (None, "unknown") else quantities.duration(text)

    def _latest(self, tick: Tick, ticks: Sequence[Tick]) -> Any:
        """How long after a timer's k-th release all k-th events of these are over; None: no bound."""
        ends = [(self._phase(tick, other)[1], other.most) for other in ticks]
        return None if any(phase is None for phase, _ in ends) else max(phase + most for phase, most in ends)

    def _soonest(self, tick: Tick, ticks: Sequence[Tick]) -> Any:
        begins = [(self._phase(tick, other)[0], other.least) for other in ticks]
        return max([0, *(phase + least for phase, least in begins if phase is not None)])

    def _nothing_is_dropped(self, name: str, ways: dict[str, list[Tick]]) -> bool:
        """Whether each queue has room for all that may wait in it."""
        if self.reading.protocol(name) == "hybrid":
            return False
        together = [tick for ticks in ways.values() for tick in ticks]
        for connection, ticks in ways.items():
            room = self.room(name, connection)
            ends = [(self._latest(tick, together), tick) for tick in ticks]
            if room is not None and not any(
                latest is not None and latest - tick.least < room * tick.period for latest, tick in ends
            ):
                return False
        return True

    def _in_order(self, ways: dict[str, list[Tick]], own: str, way: Sequence[str]) -> Iterator[Any]:
        together = [tick for ticks in ways.values() for tick in ticks]
        begin, timer = self._begin(way)
        for tick in ways[own]:
            if timer is not None and tick.timer != timer:
                continue
            spread: Any = 0
            if timer is None:
                if begin is None or tick.timer not in {item.timer for item in begin}:
                    continue
                last = self._latest(tick, begin)
                if last is None:
                    continue
                spread = last - self._soonest(tick, begin)
            latest, there = self._latest(tick, together), self._latest(tick, ways[own])
            if latest is not None and there is not None and latest < 10**14:
                yield latest - there + spread

    def _least(self, name: str, ways: dict[str, list[Tick]], own: str, way: Sequence[str]) -> Any:
        """More than nothing only where each input comes from a timer, and all messages wait."""
        if any(self.room(name, connection) is not None for connection in ways):
            return Fraction(0)
        for connection in ways:
            sender = self.problem.component(connection).get("from")
            is_timer = sender is None or self.reading.protocol(sender) in ("periodic", "hybrid")
            if not is_timer or (sender is not None and self.joins(sender)):
                return Fraction(0)
        if self._begin(way)[1] is None:
            return Fraction(0)
        together = [tick for ticks in ways.values() for tick in ticks]
        return self._soonest(ways[own][0], together) - self._soonest(ways[own][0], ways[own])

    def _begin(self, way: Sequence[str]) -> tuple[list[Tick] | None, str | None]:
        """What the time of a flow begins with on its way to a join: events behind timers, or the last timer."""
        for place in reversed(range(len(way))):
            name = way[place]
            if self.problem.section_of[name] == "connections":
                continue
            if self.reading.protocol(name) in ("periodic", "hybrid"):
                return None, name
            if place == 0 or way[place - 1] not in self.reading.triggers(name):
                return self._released(name), None
        sender = self.problem.component(way[0]).get("from")
        return (None, way[0]) if sender is None else (self._sent(sender), None)

    # Response times

    def streams(self, name: str, arriving: dict[str, list[tuple[int, Fraction]] | None]) -> Any:
        """The streams of jobs, from those of the messages of each trigger; None without a bound."""
        ways = list(arriving.values())
        if any(way == [] for way in ways):
            return ()
        known = [way for way in ways if way is not None]
        if len(known) == len(ways) and all(len(way) == 1 for way in ways if way):
            periods = {way[0][0] for way in known}
            late = max(way[0][1] for way in known)
            if len(periods) == 1:
                (period,) = periods
                for connection, way in arriving.items():
                    room = self.room(name, connection)
                    if way is not None and room is not None:
                        late = min(late, way[0][1] + room * period)
                return ((period, late),)
        held = [
            (sum(Fraction(1, period) for period, _ in way), way, room)
            for connection, way in arriving.items()
            if way is not None and (room := self.room(name, connection)) is not None
        ]
        if held:
            _, way, room = min(held, key=lambda item: item[0])
            (period, late), *others = way
            return ((period, late + room * period), *others)
        if len(known) < len(ways):
            return None
        if all(len(way) == 1 for way in known):
            return ((min(way[0][0] for way in known), max(way[0][1] for way in known)),)
        return tuple(stream for way in known for stream in way)

    def published(
        self,
        name: str,
        arriving: dict[str, list[tuple[int, Fraction]] | None],
        callback: tuple[int, Fraction | None],
        steady: set[str],
    ) -> list[tuple[int, Fraction]]:
        """The streams of jobs of a hybrid thread, from those of the messages, and what its callback takes."""
        if [] in arriving.values():
            return []
        timer = self.reading.period_ns(name) or 0
        least, most = callback
        stored = {
            connection: [(period, late + most - least) for period, late in way]
            for connection, way in arriving.items()
            if way is not None and most is not None
        }
        if not stored:
            return [(timer, Fraction(0))]
        rates = {connection: sum(Fraction(1, period) for period, _ in way) for connection, way in stored.items()}
        slowest = min(stored, key=lambda connection: rates[connection])
        if rates[slowest] >= Fraction(1, timer):
            return [(timer, Fraction(0))]
        (period, late), *others = stored[slowest]
        if others:
            return [(period, late + period), *others]
        ones = {connection: way[0] for connection, way in stored.items() if len(way) == 1}
        alike = [way for way in ones.values() if way[0] == period]
        bounds = [min(way[0] + way[1] for way in alike)]
        rest = [each for each in arriving if each not in ones or ones[each][0] != period]
        if all(each in ones and each in steady for each in rest):
            waits = [late + timer + sum(ones[each]) for each in rest]
            bounds.append(max([*(way[1] + timer for way in alike), *waits]))
        return [(period, min(bounds))]

    def is_steady(self, connection: str) -> bool:
        """Whether a connection that waits for no bus brings a message in each period."""
        sender = self.problem.component(connection).get("from")
        if sender is None:
            return True
        if self.reading.states_rate(connection) or self.reading.segments(sender) or self.reading.is_polled(sender):
            return False
        protocol = self.reading.protocol(sender)
        return protocol == "periodic" or (protocol == "hybrid" and not self.joins(sender))
