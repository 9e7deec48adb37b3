"""OSATE's latency analysis as OSATE goes about it: contributors in a list, then one pass for minima and one for maxima.

Written from OSATE's rules (docs/semantics.md, section 3.7) and not from `dse.analysis.osate.latency`, which looks back
from each element instead: nothing of that is used here. Times in ns, of one design of a space.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil
from typing import Any

from dse.space.architecture.frames import Frame, wire_ns
from dse.space.model.flows import Flow, Step
from dse.space.model.space import Component, Connection, Design, Partition, Space
from dse.space.model.trees import FROM_BANDWIDTH, Choice, PerProcessorType

Times = tuple[Fraction, Fraction]
NOTHING: Times = (Fraction(0), Fraction(0))


def plain(size_bytes: Any) -> Fraction:
    """A size as it is stated: what was rounded to whole bytes remembers its bits."""
    return Fraction(getattr(size_bytes, "exact", size_bytes))


@dataclass
class Contributor:
    """One row: a fixed value, or how it samples."""

    value: Times = NOTHING
    kind: str = ""
    period: Fraction = Fraction(0)
    synchronous: bool = False
    is_connection: bool = False
    partition: Partition | None = None
    media: list[Contributor] = field(default_factory=list)


@dataclass
class Model:
    space: Space
    design: Design

    def at(self, tree: Any) -> Any:
        while isinstance(tree, Choice):
            tree = tree.branches[self.design[tree.decision]]
        return tree

    @property
    def is_old(self) -> bool:
        return self.space.profile == "osate-2.2"

    def times(self, tree: Any) -> Times | None:
        found = self.at(tree)
        return None if found is None else (Fraction(found[0]), Fraction(found[1]))

    def period(self, component: Component) -> Fraction:
        return Fraction(self.at(component.stated_period_ns) or 0)

    def protocol(self, component: Component) -> str | None:
        found: str | None = self.at(component.protocol)
        return found

    # --- components ---

    def is_periodic(self, item: Component) -> bool:
        if self.is_old:
            excepted = item.category in ("thread", "device") and self.protocol(item) == "sporadic"
        else:
            events = self.protocol(item) in ("sporadic", "aperiodic")
            excepted = item.category in ("thread", "device", "abstract") and events
        return self.period(item) > 0 and not excepted

    def processing(self, item: Component) -> Times:
        runs = item.category in ("thread", "device", "abstract")
        response = self.times(item.response_ns) if runs and not self.is_old else None
        execution = self.times(item.execution_ns) if runs else None
        specified = self.times(item.latency_ns)
        assigned = self.at(item.deadline_ns)
        deadline = Fraction(assigned or 0)
        by_deadline = self.space.worst_case == "deadline"
        worst = response[1] if response else Fraction(0)
        if not worst and execution and (not by_deadline or (assigned is None and not self.is_old)):
            worst = execution[1]
        if not worst and deadline and (by_deadline or self.is_old):
            worst = deadline
        if not worst and specified:
            worst = specified[1]
        if not worst and not self.is_old:
            worst = deadline if assigned is not None else self.period(item)
        best = response[0] if response else Fraction(0)
        for found in (execution, specified):
            if not best and found:
                best = found[0]
        return best, worst

    def component(
        self, item: Component, wire: Connection | None, sender: Component | None, *, is_reached: bool
    ) -> list[Contributor]:
        rows = []
        sampled = wire is None or self.is_old or wire.port in ("data", "feature")
        if self.is_periodic(item) and sampled:
            if wire is None:
                rows.append(Contributor(kind="first"))
            elif wire.timing != "immediate":
                period = self.period(item)
                if wire.timing == "sampled" and sender is not None and not self.is_old:
                    other = self.period(sender)
                    if other and (period / other).denominator == 1:
                        period = other
                rows.append(Contributor(kind=wire.timing, period=period))
        elif self.is_old and item.category in ("device", "abstract"):
            rows.append(Contributor(kind="first"))
        callback = self.times(item.callback_ns) if self.protocol(item) == "hybrid" and is_reached else None
        if callback is not None:
            rows.append(Contributor(callback))
        if wire is not None:
            rows += self.queue(item, wire)
        return [*rows, Contributor(self.processing(item))]

    def queue(self, item: Component, wire: Connection) -> list[Contributor]:
        size = self.at(wire.queue_size)
        if size is None:
            size = self.at(item.queue_size)
        fixed = self.protocol(item) in ("periodic", "sporadic")
        if self.is_old:
            if wire.port not in ("event", "event_data") or item.category not in ("thread", "device"):
                return []
            size = 1 if size is None else size
            size = max(0, size - 1) if fixed else size
        elif size is None:
            waits = item.category in ("thread", "device", "abstract") and wire.port == "data"
            size = 1 if waits and self.protocol(item) in ("sporadic", "aperiodic") else 0
        best, worst = (self.period(item),) * 2 if fixed else self.processing(item)
        full = self.space.best_case == "full_queue"
        return [Contributor((size * best if full else Fraction(0), size * worst))] if size else []

    # --- connections ---

    def stack(self, wire: Connection) -> list[tuple[int, Fraction, str]]:
        """What a message meets: each carrier, the bytes there, and whether it is bound, required or only sampling."""
        found: list[tuple[int, Fraction, str]] = []
        bus = self.at(wire.stated_bus)
        size = self.at(wire.size_bytes if wire.type_bytes is None else wire.type_bytes)
        self.meet([] if bus is None else [bus, *wire.further], wire.protocols, plain(size or 0), found)
        return found

    def meet(self, bound: list[int], protocols: Any, size: Fraction, found: list[tuple[int, Fraction, str]]) -> None:
        if not [bus for bus in bound if self.space.buses[bus].virtual]:
            size += self.wrap(protocols, size, found, "required" if bound else "sampling")
        for bus in bound:
            slot = self.space.buses[bus]
            found.append((bus, size + self.extra(bus), "bound"))
            below = self.at(slot.carrier)
            if slot.virtual:
                self.meet([] if below is None else [below, *slot.further], self.at(slot.protocols), found[-1][1], found)

    def wrap(self, protocols: Any, size: Fraction, found: list[tuple[int, Fraction, str]], kind: str) -> Fraction:
        added = Fraction(0)
        for bus in protocols:
            own = self.extra(bus)
            found.append((bus, size + own, kind))
            added += own + self.wrap(self.at(self.space.buses[bus].protocols), size + own, found, kind)
        return added

    def extra(self, bus: int) -> Fraction:
        return Fraction(0) if self.is_old else plain(self.at(self.space.buses[bus].overhead_bytes))

    def machine(self, wire: Connection) -> str:
        for end in (wire.source, wire.target):
            if end is not None and self.at(self.space.components[end].processor) is not None:
                slot = self.space.processors[self.at(self.space.components[end].processor)]
                return slot.types[self.design[slot.type_decision]]
        raise AssertionError

    def medium(self, wire: Connection, number: int, size: Fraction) -> Times:
        bus = self.space.buses[number]

        def figure(tree: Any) -> Any:
            found = self.at(tree)
            return self.at(found.by_type[self.machine(wire)]) if isinstance(found, PerProcessorType) else found

        fixed, each, latency = figure(bus.fixed_ns), None, figure(bus.latency_ns)
        found = NOTHING
        if isinstance(fixed, Frame):
            least, most = wire_ns(fixed, ceil(size), self.at(bus.bandwidth_bps))  # its bits are held to another encoder
            found = (Fraction(least), Fraction(most))
            if self.is_old:
                return found
        elif fixed is not None and fixed is not FROM_BANDWIDTH:
            each = figure(bus.per_byte_ns)
            found = (Fraction(fixed[0] + each[0] * size), Fraction(fixed[1] + each[1] * size))
            if self.is_old:
                return found
        if latency is None:
            return found
        return found[0] or Fraction(latency[0]), found[1] or Fraction(latency[1])

    def connection(self, number: int, flow: Flow) -> Contributor:
        wire = self.space.connections[number]
        row = Contributor(is_connection=True, synchronous=self.synchronous(wire))
        stack = self.stack(wire)
        times = [self.medium(wire, bus, size) for bus, size, kind in stack if kind != "sampling"]
        times = [item for item in times if item[1]]
        row.value = (sum((item[0] for item in times), Fraction(0)), sum((item[1] for item in times), Fraction(0)))
        periods = [Fraction(self.at(self.space.buses[bus].period_ns) or 0) for bus, _, _ in stack]
        row.period = sum(periods, Fraction(0))
        own = self.times(wire.latency_ns)
        if not times and not row.period and own and own[1] and not self.is_old:
            row.value = own
        last = [
            item for item in self.space.flows if any(s.kind == "connection" and s.index == number for s in item.steps)
        ]
        if not self.is_old and self.space.bus_queuing == "counted" and last[-1] is flow:
            row.value = row.value[0], row.value[1] + self.waiting(number, stack)
        return row

    def waiting(self, number: int, stack: list[tuple[int, Fraction, str]]) -> Fraction:
        total = Fraction(0)
        used = {s.index for flow in self.space.flows for s in flow.steps if s.kind == "connection"}
        for bus in {bus for bus, _, kind in stack if kind == "bound"}:
            if self.at(self.space.buses[bus].period_ns):
                continue
            for rival in (self.space.connections[other] for other in used - {number}):
                sizes = [size for met, size, kind in self.stack(rival) if met == bus and kind == "bound"]
                times = [self.medium(rival, bus, size)[1] for size in sizes]
                total += next((time for time in reversed(times) if time), Fraction(0))
        return total

    def synchronous(self, wire: Connection) -> bool:
        where = []
        for end in (wire.source, wire.target):
            item = self.space.components[end] if end is not None else None
            processor = self.at(item.processor) if item is not None and item.bound else None
            where.append(
                end
                if item is not None and item.category == "device"
                else (None if processor is None else f"p{processor}")
            )
        if where[0] is not None and where[0] == where[1]:
            return True
        ends = [self.space.components[end] for end in (wire.source, wire.target) if end is not None]
        inside = {item.partition for item in ends}
        if None in where and len(ends) == 2 and len(inside) == 1 and None not in inside:
            return True
        readings = [self.at(item.clock) for item in ends if item.bound]
        named = {reading.name for reading in readings if reading is not None and reading.name}
        if len([reading for reading in readings if reading is not None and reading.name]) == 2:
            return len(named) == 1
        return self.space.system == "synchronous"

    # --- the two passes ---

    def contributors(self, flow: Flow) -> list[Contributor]:
        rows: list[Contributor] = []
        for step in flow.steps:
            if step.kind == "connection":
                rows += self.crossing(step.index, flow)
                continue
            wire = self.space.connections[step.via] if step.via is not None else None
            sender = self.space.components[step.sender] if step.sender is not None else None
            item = self.here(step, wire)
            if step.unlinked:
                wire = sender = None
            found = self.component(item, wire, sender, is_reached=step.via is not None)
            if wire is not None:
                found[0].synchronous = self.synchronous(wire)
            if not rows and not self.is_periodic(item) and item.partition is not None:
                rows.append(Contributor(kind="partition", partition=item.partition))
            rows += found
        return rows

    def here(self, step: Step, wire: Connection | None) -> Component:
        """A component as this flow states it: latency always, times of the port for events that dispatch it."""
        item, own = self.space.components[step.index], step.figures
        if own is None:
            return item
        changed: dict[str, Any] = {"latency_ns": own.latency_ns}
        if wire is not None and wire.port.startswith("event") and not self.is_periodic(item):
            changed |= {"execution_ns": own.execution_ns, "response_ns": own.response_ns}
        return replace(item, **{name: value for name, value in changed.items() if value is not None})

    def crossing(self, number: int, flow: Flow) -> list[Contributor]:
        wire = self.space.connections[number]
        left, entered = (
            self.space.components[end].partition if end is not None else None for end in (wire.source, wire.target)
        )
        row = self.connection(number, flow)
        if left == entered:
            return [row]
        rows = [row]
        if left is not None and left.duration_ns is not None:
            rows.insert(0, Contributor(kind="output", partition=left))
        if entered is not None:
            rows.append(Contributor(kind="entry", partition=entered, synchronous=row.synchronous))
        return rows

    def partitioned(self, row: Contributor, rows: list[Contributor], since: Fraction | None, end: int) -> Fraction:
        assert row.partition is not None
        frame = Fraction(row.partition.period_ns)
        if row.kind == "output":
            passed, window = since or Fraction(0), Fraction(row.partition.duration_ns or 0)
            if self.space.partition_output == "partition_end":
                return window - passed % window + passed // window * frame
            return self.missing(passed + row.partition.offset_ns, frame)
        if not row.synchronous or since is None:
            return frame if end else Fraction(0)
        before = [item.partition for item in rows if item.kind in ("partition", "entry") and item.partition is not None]
        windows = [item for item in before if item.duration_ns is not None]
        if row.partition.duration_ns is None or not windows:
            return self.missing(since, frame)
        start, now = Fraction(row.partition.offset_ns), windows[-1].offset_ns + since
        while start < now:
            start += frame
        return start - now

    @staticmethod
    def missing(passed: Fraction, frame: Fraction) -> Fraction:
        multiple = frame
        while multiple < passed:
            multiple += frame
        return multiple - passed

    def total(self, flow: Flow, end: int) -> Fraction:
        """The sum of one pass: `end` 0 for the minimum, 1 for the maximum."""
        result, since = Fraction(0), None
        contributors = self.contributors(flow)
        for number, row in enumerate(contributors):
            value = row.value[end]
            if row.kind in ("output", "entry"):
                value = self.partitioned(row, contributors[:number], since, end)
            before = contributors[number - 1] if number else row
            if row.kind in ("sampled", "delayed") and before.kind == "entry" and before.partition is not None:
                result += max(Fraction(0), row.period - before.partition.period_ns)
                since = Fraction(0)
                continue
            if row.is_connection and row.period:
                rounds = self.space.system == "synchronous" and since is not None
                value += row.period if end or rounds else 0
            elif row.kind in ("sampled", "delayed"):
                value = self.sampled(row, since, end)
            result += value
            if row.kind in ("first", "sampled", "delayed", "partition", "entry"):
                since = Fraction(0)
            elif since is not None:
                since += value
        return result

    def sampled(self, row: Contributor, since: Fraction | None, end: int) -> Fraction:
        if row.synchronous and since is not None:
            if not end and row.kind == "sampled" and not self.is_old:
                return Fraction(0)
            missing = row.period - since % row.period
            return Fraction(0) if since and missing == row.period else missing
        return row.period if end or row.kind == "delayed" else Fraction(0)

    # --- loads of buses and their budgets ---

    def ways(self, bus: int) -> list[tuple[int, ...]]:
        """From a bus down to what carries it, each way."""
        slot = self.space.buses[bus]
        below = self.at(slot.carrier) if slot.virtual else None
        if below is None:
            return [(bus,)]
        return [(bus, *way) for one in (below, *slot.further) for way in self.ways(one)]

    def load(self, bus: int) -> Fraction | None:
        """What a bus carries in B/s, a broadcast message once; None where it has frames, or a rate is not plain."""
        total = Fraction(0)
        sent: set[tuple[Any, ...]] = set()
        for wire in self.space.connections:
            first = self.at(wire.bus)
            ways = [] if first is None else [way for one in (first, *wire.further) for way in self.ways(one)]
            message, before = (wire.source, wire.from_port), set(sent)
            sent |= {(one, *message) for other in ways for one in other}
            until = {way[: way.index(bus) + 1]: way for way in reversed(ways) if bus in way}
            for way in until.values():
                is_again = wire.from_port is not None and (way[0], *message) in before
                if is_again and self.at(self.space.buses[way[0]].broadcast):
                    continue
                carried = self.message_load(wire, way)
                if carried is None or isinstance(self.at(self.space.buses[bus].fixed_ns), Frame):
                    return None
                total += carried
        return total

    def message_load(self, wire: Connection, way: tuple[int, ...]) -> Fraction | None:
        if wire.data_rate is not None:
            return Fraction(self.at(wire.data_rate))
        rate = self.at(wire.rate_hz)
        if rate is None:
            sender = None if wire.source is None else self.space.components[wire.source]
            if sender is None or self.protocol(sender) not in ("periodic", "hybrid", "sporadic"):
                return None
            if self.protocol(sender) == "sporadic":
                return None  # as its inputs come
            rate = Fraction(10**9) / self.period(sender)
        overhead = sum(plain(self.at(self.space.buses[one].overhead_bytes)) for one in way)
        return Fraction(rate) * (plain(self.at(wire.size_bytes) or 0) + overhead)

    def required(self, bus: int) -> Fraction:
        """The budgets of what is bound to a bus directly."""
        total = Fraction(0)
        ports: dict[Any, Fraction] = {}
        for slot in self.space.buses:
            carrier = self.at(slot.carrier) if slot.virtual else None
            is_there = slot.types[self.design[slot.type_decision]] != "none"
            if carrier is not None and is_there and bus in (carrier, *slot.further):
                total += slot.budget or 0
        for number, wire in enumerate(self.space.connections):
            if self.at(wire.bus) is None or bus not in (self.at(wire.bus), *wire.further):
                continue
            shares = wire.from_port is not None and self.at(self.space.buses[bus].broadcast)
            key: Any = (wire.source, wire.from_port) if shares else number
            ports[key] = max(ports.get(key, Fraction(0)), wire.budget or Fraction(0))
        return total + sum(ports.values(), Fraction(0))
