"""One design of a problem: what its fields come down to, its rates, its latencies and its loads."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache, cached_property, wraps
from itertools import combinations, permutations
from math import ceil, gcd
from typing import Any, TypeAlias, TypeVar, cast

from . import quantities, wire
from .identifiers import number_of
from .joins import Joins
from .packing import Peak
from .problem import FIELDS, FOLLOWS, NONE, Problem, Unstated, as_list, looked_up, option_value
from .quantities import NS_PER_S, TIME
from .scheduling import Scheduling

PER_PROCESSOR_TYPE = ("compute_execution_time", "callback_execution_time", "response_time")
EVENT_TRIGGERED = ("aperiodic", "sporadic")
NO_BOUND_NS = Fraction(10**14)
COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "<=": operator.le,
    "<": operator.lt,
    ">=": operator.ge,
    ">": operator.gt,
    "==": operator.eq,
    "!=": operator.ne,
}


Row: TypeAlias = tuple[str, str, Any, Any]
"""A component or connection, the method, and least and most ns."""


@cache
def _per_second(period_ns: int) -> Fraction:
    """How often a timer of this period releases in a second."""
    return Fraction(NS_PER_S, period_ns)


def plain(number: Fraction) -> Fraction | int:
    """A whole number as one, which is quick to add up."""
    return number.numerator if number.denominator == 1 else number


class InvalidDesign(Exception):
    """The combination of options is no design; the message says why."""


Method = TypeVar("Method", bound=Callable[..., Any])


def in_common(method: Method) -> Method:
    """What a method finds is found once for all designs that agree in the decisions that it looks at."""

    @wraps(method)
    def known(self: Reading, *given: Any) -> Any:
        if not self.complete:
            return method(self, *given)
        alike = self.problem.in_common.setdefault((method.__qualname__, given), {})
        option = self.design.get
        for names, found in alike.items():
            chosen = tuple(map(option, names))
            if chosen in found:
                self.looked_at[-1].update(names)
                return found[chosen]
        self.looked_at.append(set())
        try:
            result = method(self, *given)
        finally:
            seen = self.looked_at.pop()
            self.looked_at[-1] |= seen
        chosen = tuple([self.design.get(name) for name in sorted(seen)])
        alike.setdefault(tuple(sorted(seen)), {})[chosen] = result
        return result

    return cast(Method, known)


class Reading:
    """One design, possibly still partial: what every field comes down to and what follows from it."""

    def __init__(self, problem: Problem, design: Mapping[str, str | None], complete: bool = True) -> None:
        self.problem, self.design, self.complete = problem, design, complete
        self.looked_at: list[set[str]] = [set()]
        self._awaited: set[str] = set()
        self.joins = Joins(self)

    def chosen(self, decision: str) -> str | None:
        """The option of a decision; every look at the design is one of these."""
        self.looked_at[-1].add(decision)
        return self.design.get(decision)

    # Fields

    def type_of(self, name: str) -> str | None:
        types = self.problem.types(name)
        if not types:
            return None
        return types[0] if len(types) == 1 else self._choice(name, "type", types)

    def offered(self, name: str, field: str) -> list[Any]:
        """The options of a field under the chosen type and processor; empty where it is not stated."""
        fixed = self.problem.fixed.get((name, field))
        if fixed is not None:
            return fixed
        if field == "core":
            return self.problem.cores(name)
        own = self.problem.component(name)
        is_plain = field in own and field != "offset"
        raw = own[field] if is_plain else self.problem.stated(name, field, self.type_of(name))
        if isinstance(raw, dict) and field in PER_PROCESSOR_TYPE:
            raw = self._entry(name, field, raw, self.processor_of(name))
        return as_list(raw)

    def admitted(self, name: str, field: str) -> list[Any]:
        """The options of a field; of any offset on the grid those below the period."""
        found = self.offered(name, field)
        if field != "offset" or self.problem.component(name).get("offset") != "any":
            return found
        period = self.period_ns(name)
        assert period is not None, name
        return [text for text in found if quantities.duration(text) < period]

    def _entry(self, name: str, field: str, per_type: Mapping[str, Any], slot: str | None) -> Any:
        key = self.type_of(slot) if slot is not None else None
        if key is None or key not in per_type:
            raise InvalidDesign(f"{name}.{field} has no figure for processor type {key}")
        return per_type[key]

    def get(self, name: str, field: str) -> Any:
        """The value of a field in this design, or None where it is not stated."""
        settled = self.problem.settled
        return settled[name, field] if (name, field) in settled else self._value(name, field)

    @in_common
    def _value(self, name: str, field: str) -> Any:
        options = self.admitted(name, field)
        return self._choice(name, field, options) if len(options) > 1 else options[0] if options else None

    def _choice(self, name: str, field: str, options: list[Any]) -> Any:
        choice = self.chosen(f"{name}.{field}")
        if choice is None:
            raise InvalidDesign(f"{name}.{field} is open")
        meant = option_value(field, choice)
        for option in options:
            if option_value(field, option) == meant:
                return option
        raise InvalidDesign(f"{name}.{field}: {choice} is not offered here")

    def is_active(self, name: str, field: str) -> bool:
        """Whether the design uses this field (reading 3)."""
        section = self.problem.section_of[name]
        if field == "type":
            return bool(self.problem.types(name))
        if section == "executors" and not self.runs_any(name):
            return False
        if field == "core":
            return int(self.get(self.get(name, "processor"), "cores") or 1) > 1
        if field == "bus":
            if section == "buses":
                return "bus" in self.problem.component(name) and self.type_of(name) != NONE
            return "bus" in self.problem.component(name) and not self.stays(name)
        if section in ("processors", "buses") and self.type_of(name) == NONE:
            return False
        if field in ("offset", "communication") and self.protocol(name) not in ("periodic", "hybrid"):
            return False
        if field == "join" and self.protocol(name) == "periodic":
            return False
        if field in ("identifier", "priority", "rate") and section == "connections" and self.head(name) != name:
            return False
        if field == "pairing" and not self.joins.joins(name):
            return False
        if self.offered(name, field) in ([word] for word in FOLLOWS) or self.has_default(name, field):
            return False
        return bool(self.offered(name, field)) and not (field == "period" and self.protocol(name) == "aperiodic")

    def head(self, connection: str) -> str:
        """The connection whose message has the data of another one, or of itself."""
        body = self.problem.component(connection)
        found = self.get(connection, "carried_in") if "carried_in" in body else None
        return connection if found in (None, "alone") else str(found)

    def frame(self, connection: str) -> list[str]:
        """The connections in one message with another one, in the order of the file."""
        if not self.problem.has_frames:
            return [connection]
        head = self.head(connection)
        return [name for name in self.problem.sections["connections"] if self.head(name) == head]

    def is_sent_before(self, connection: str, bus: str) -> bool:
        """Whether a bus carries the message of a connection for one before it in the file."""
        frame = self.frame(connection)
        return any(bus in self.stack(name) for name in frame[: frame.index(connection)])

    def has_default(self, name: str, field: str) -> bool:
        """Whether the chosen type does not state the field, which counts all the same."""
        return any(isinstance(option, Unstated) for option in self.offered(name, field))

    # Bindings

    def processor_of(self, thread: str | None) -> str | None:
        if thread is None or self.problem.section_of[thread] != "threads":
            return None
        return self.get(self.place_of(thread), "processor")

    def executor_of(self, thread: str) -> str | None:
        """The executor that runs a thread, none where it is an OS thread of its own."""
        return self.get(thread, "executor") if "executor" in self.problem.component(thread) else None

    def reservation_of(self, thread: str) -> str | None:
        """The reservation that a thread or its executor is in."""
        found: str | None = self.problem.component(self.executor_of(thread) or thread).get("reservation")
        return found

    def place_of(self, thread: str) -> str:
        """The entry that says on which processor and core a thread runs."""
        return self.reservation_of(thread) or self.executor_of(thread) or thread

    def runs_any(self, executor: str) -> bool:
        """Whether any thread runs in an executor."""
        return any(self.executor_of(thread) == executor for thread in self.problem.sections["threads"])

    def possible_cores(self, place: str) -> list[int]:
        """The core that is chosen for a place, else those that are stated, else none."""
        chosen = self.chosen(f"{place}.core")
        return [int(chosen)] if chosen is not None else [int(core) for core in self.problem.stated_cores(place)]

    def segments(self, name: str) -> list[dict[str, Any]]:
        """The pieces of a thread's work, one after the other."""
        found: list[dict[str, Any]] = self.problem.component(name).get("segments", [])
        return found

    def piece_slot(self, name: str, place: int) -> str | None:
        """Where a piece runs: on its accelerator, else where its thread does."""
        accelerator: str | None = self.segments(name)[place].get("processor")
        return accelerator or self.processor_of(name)

    def piece_times(self, name: str, place: int | None = None, *, before: bool = False) -> tuple[int, int]:
        """Shortest and longest time of a piece, of all those `before` it, or (None) of all together."""
        count = len(self.segments(name))
        places = range(count) if place is None else range(place) if before else [place]
        found = [self._piece(name, each) for each in places]
        return sum(least for least, _ in found), sum(most for _, most in found)

    def _piece(self, name: str, place: int) -> tuple[int, int]:
        text = self.segments(name)[place]["compute_execution_time"]
        if isinstance(text, dict):
            text = self._entry(name, f"segments[{place}]", text, self.piece_slot(name, place))
        return quantities.time_range(text)

    def order(self, slot: str) -> str | None:
        """How an accelerator serves; None of a processor."""
        kind = self.type_of(slot)
        return None if kind in (None, NONE) else self.problem.sections["processor_types"][kind].get("serves")

    def is_local(self, connection: str) -> bool:
        """Whether both ends are threads of one process."""
        ends = self.problem.component(connection)
        processes = [self._process(ends.get("from")), self._process(ends.get("to"))]
        return processes[0] is not None and processes[0] == processes[1]

    def stays(self, connection: str) -> bool:
        """Whether a connection takes no bus: its ends are in one process, or on one processor where that suffices."""
        if self.is_local(connection):
            return True
        ends = self.problem.component(connection)
        homes = [self.processor_of(ends.get(end)) for end in ("from", "to")]
        return homes[0] is not None and homes[0] == homes[1] and self.problem.need_not_travel(ends)

    def _process(self, name: str | None) -> str | None:
        return self.get(name, "process") if name is not None and self.problem.section_of[name] == "threads" else None

    @in_common
    def stack(self, connection: str) -> list[str]:
        """The buses that carry a connection, from the one that it is bound to down to the wire."""
        members: list[str] = []
        bus = None if self.stays(connection) else self.get(connection, "bus")
        while bus is not None:
            if bus in members:
                raise InvalidDesign(f"{bus} carries itself")
            members.append(bus)
            has_carrier = bus in self.problem.sections["buses"] and "bus" in self.problem.component(bus)
            bus = self.get(bus, "bus") if has_carrier else None
        return members

    @in_common
    def carrying(self) -> set[str]:
        """The buses that carry a connection, as far as the bindings are decided."""
        found: set[str] = set()
        for connection in self.problem.sections["connections"]:
            if not self.stays(connection):
                found.update(as_list(self.get(connection, "bus")))
        for name in self.problem.virtual_slots:
            if name in found and (len(self.offered(name, "bus")) == 1 or self.chosen(f"{name}.bus") is not None):
                found.add(self.get(name, "bus"))
        return found

    def bus_field(self, bus: str, field: str) -> Any:
        """A figure of a bus, or of a virtual bus type that is used directly; None for an empty slot."""
        if bus not in self.problem.sections["buses"]:
            return looked_up(self.problem.sections["bus_types"][bus], field)
        return None if self.type_of(bus) == NONE else self.get(bus, field)

    def machine(self, connection: str) -> str | None:
        """The processor slot that runs the middleware of a connection."""
        ends = self.problem.component(connection)
        return self.processor_of(ends.get("from")) or self.processor_of(ends.get("to"))

    # Rates

    def protocol(self, name: str) -> str:
        stated = self.get(name, "dispatch_protocol")
        if stated is not None:
            return stated
        return "periodic" if self.offered(name, "period") else "aperiodic"

    def period_ns(self, name: str) -> int | None:
        text = self.get(name, "period")
        return None if text is None else quantities.period(text)

    def has_period(self, name: str) -> bool:
        """Whether a period counts: a timer's, or how far apart jobs are at least."""
        return bool(self.offered(name, "period")) and self.protocol(name) != "aperiodic"

    def timer_rate(self, name: str) -> Fraction:
        period = self.period_ns(name)
        if period is None:
            raise ValueError(f"{name} needs a period")
        return _per_second(period)

    def input_rate(self, name: str) -> Fraction:
        """Activations per second by the trigger connections."""
        return sum((self.delivered_rate(c) for c in self.triggers(name)), Fraction(0))

    def triggers(self, name: str) -> list[str]:
        """The connections whose messages dispatch a component."""
        triggers = self.problem.component(name).get("dispatch_trigger")
        if triggers is None:
            return [c for c in self.problem.incoming[name] if self.get(c, "port") not in ("data", "data_access")]
        return as_list(triggers)

    def states_rate(self, connection: str) -> bool:
        """Whether a connection delivers at a rate of its own."""
        connection = self.head(connection)
        by_data = self.offered(connection, "data_rate") and self.offered(connection, "data_size")
        return bool(self.offered(connection, "rate") or by_data)

    @in_common
    def rate(self, name: str) -> Fraction:
        """Activations per second, which are also the messages per second that leave (of a hybrid: its timer's)."""
        protocol, joins = self.protocol(name), self.joins.joins(name)
        if protocol == "periodic" or (protocol == "hybrid" and not joins):
            return self.timer_rate(name)
        if name in self._awaited:
            raise InvalidDesign(f"{name} is in a cycle of event-triggered components")
        self._awaited.add(name)
        rate = min(map(self.delivered_rate, self.triggers(name))) if joins else self.input_rate(name)
        if protocol == "hybrid" or (protocol == "sporadic" and self.offered(name, "period")):
            rate = min(rate, self.timer_rate(name))
        self._awaited.remove(name)
        return rate

    @in_common
    def delivered_rate(self, connection: str) -> Fraction:
        """Messages per second that a connection delivers."""
        connection = self.head(connection)
        stated = self.get(connection, "rate")
        if stated is not None:
            return quantities.rate(stated)
        data_rate = self.get(connection, "data_rate")
        if data_rate is not None and self.offered(connection, "data_size"):
            return quantities.data_rate(data_rate) / quantities.size(self.get(connection, "data_size"))
        sender = self.problem.component(connection).get("from")
        return Fraction(0) if sender is None else self.rate(sender)

    # Response times

    @property
    def scheduling(self) -> Scheduling:
        """What runs on each core; only of a complete design whose cores are all known."""
        found, seen = self._scheduling
        self.looked_at[-1] |= seen
        return found

    @cached_property
    def _scheduling(self) -> tuple[Scheduling, set[str]]:
        """What runs on each core, and the decisions that were looked at."""
        self.looked_at.append(set())
        return Scheduling(self), self.looked_at.pop()

    @staticmethod
    def _counted(response: Fraction | None) -> Fraction:
        """A response time in a sum; one without a bound is as the documents say, 27.8 h."""
        return NO_BOUND_NS if response is None else min(response, NO_BOUND_NS)

    @in_common
    def responses(self) -> dict[str, Fraction]:
        """The response time of each thread on a processor, where what is asked decides the cores."""
        if not self.problem.asks_of_cores:
            return {}
        named = [name for name in self.problem.sections["threads"] if self.processor_of(name)]
        return {name: self._counted(self.scheduling.of(name)) for name in named}

    def deadline_ns(self, name: str) -> int | None:
        """By when a thread on a processor must end after its release, where that is asked."""
        for field in self.problem.deadline_fields(name):
            if field == "deadline" and self.get(name, field) is not None:
                return quantities.deadline(self.get(name, field))
            if field == "period" and self.has_period(name):
                return self.period_ns(name)
        return None

    def lateness(self) -> dict[str, Fraction]:
        """How much later than they must threads end, less than 0 where they end before."""
        found = self.responses()
        limits = {name: self.deadline_ns(name) for name in found}
        late = {name: found[name] - limit for name, limit in limits.items() if limit is not None}
        if self.problem.document.get("deadlines", "stated") != "none":
            for name, response in self.message_responses().items():
                if self.get(name, "deadline") is not None:
                    late[name] = response - quantities.deadline(self.get(name, "deadline"))
        return late

    # Latency

    def processing(self, name: str) -> tuple[int, Any]:
        """Best and worst processing time of a component."""
        if self.segments(name):
            best, worst = self.piece_times(name)
            response = self.scheduling.of(name) if self.problem.counts_responses else Fraction(worst)
            return best, self._counted(response)
        stated = self.get(name, "compute_execution_time") or self.get(name, "latency")
        best, worst = quantities.time_range(stated) if stated is not None else (0, 0)
        response = self.get(name, "response_time")
        if response is not None:
            return best, quantities.time_range(response)[1]
        if self.problem.counts_responses and self.processor_of(name) and self.offered(name, "compute_execution_time"):
            return best, self._counted(self.scheduling.of(name))
        return best, worst

    def callback_range(self, name: str) -> tuple[int, Any]:
        """What the callback of a hybrid thread takes."""
        callback = self.get(name, "callback_execution_time")
        if callback is None:
            return 0, 0
        least, most = quantities.time_range(callback)
        if self.problem.counts_responses and self.processor_of(name):
            return least, self._counted(self.scheduling.of(name, "callback"))
        return least, most

    @in_common
    def component_rows(self, name: str, arrival: str | None, first: bool, way: tuple[str, ...] = ()) -> list[Row]:
        """The contributions of a component of a flow: (component, method, min, max); `way` leads to a join of all."""
        rows: list[Row] = []
        protocol = self.protocol(name)
        best, worst = self.processing(name)
        if protocol == "hybrid" and arrival is not None and self.get(name, "callback_execution_time") is not None:
            rows.append((name, "processing time", *self.callback_range(name)))
        joins = bool(way) and arrival in self.triggers(name) and self.joins.joins(name)
        if joins:
            soonest, latest = self.joins.wait(name, way)
            rows.append((name, "waiting", soonest, NO_BOUND_NS if latest is None else min(latest, NO_BOUND_NS)))
        if protocol in ("periodic", "hybrid"):
            period = self.period_ns(name)
            assert period is not None, name
            rows.append((name, "first sampling", 0, 0) if first else (name, "sampling", 0, period))
        else:
            if arrival is not None and self.is_stored(name, arrival):
                gap = self.dispatch_gap_ns(name)
                rows.append((name, "until a dispatch", 0, NO_BOUND_NS if gap is None else min(gap, NO_BOUND_NS)))
            queue = self.get(arrival, "queue_size") if arrival is not None else None
            queue = self.get(name, "queue_size") if queue is None else queue
            if queue is not None and not self.joins.joins(name) and not self.is_polled(name):
                rows.append((name, "queued", 0, int(queue) * worst))
        specified = not self.offered(name, "compute_execution_time")
        logical = self.logical_ns(name)
        if logical is not None:
            rows.append((name, "logical execution time", logical, logical))
        else:
            rows.append((name, "specified" if specified else "processing time", best, worst))
        own = self.own_job_ns(name, arrival)
        return [*rows, (name, "own job", 0, -own)] if own else rows

    def is_stored(self, name: str, arrival: str) -> bool:
        """Whether what comes by a connection lies there until something else dispatches an event-triggered component.

        A device that nothing dispatches takes it at once.
        """
        triggers = self.triggers(name)
        return arrival not in triggers and bool(triggers or self.problem.section_of[name] == "threads")

    def dispatch_gap_ns(self, name: str) -> Any:
        """The longest time between two jobs of a component; None where there may be none for ever."""
        return self._job_distances(name)[1]

    def _job_distances(self, name: str) -> tuple[Any, Any]:
        """The shortest and the longest time between two jobs of a component; None for ever."""
        joins = self.joins.joins(name)
        if self.protocol(name) == "hybrid" and joins:
            return self.joins.job_distances(name)
        if self.protocol(name) in ("periodic", "hybrid"):
            period = self.period_ns(name) or 0
            return period, period + self.skipped_ns(name)
        if name in self._awaited:
            raise InvalidDesign(f"{name} is in a cycle of event-triggered components")
        self._awaited.add(name)
        ways = [self.message_distances(connection) for connection in self.triggers(name)]
        self._awaited.remove(name)
        known = [longest for _, longest in ways if longest is not None]
        soonest = ways[0][0] if len(ways) == 1 else 0
        if joins:
            known = [max(known)] if len(known) == len(ways) else []
        separation = (
            self.period_ns(name) or 0 if self.protocol(name) == "sporadic" and self.offered(name, "period") else 0
        )
        logical = self.logical_ns(name)
        lost = max(self.processing(name)[1] if logical is None else logical, separation)
        longest = min(known) if known else None
        if soonest >= lost:
            return soonest, longest
        return max(soonest, separation), None if longest is None else longest + lost

    def is_polled(self, name: str) -> bool:
        """Whether an executor runs it that takes one job of each thread in a round, and drops what has no room."""
        executor = self.executor_of(name)
        return executor is not None and self.get(executor, "kind") == "polling"

    def room(self, name: str, part: str) -> int | None:
        """How many jobs wait there at most, beside one that runs; None: all that come."""
        if not self.is_polled(name) or self.joins.joins(name) or self.protocol(name) == "sporadic":
            return None
        if part == "timer" and self.protocol(name) in ("periodic", "hybrid"):
            return 1
        triggers = self.triggers(name)
        sizes = [self.get(each, "queue_size") for each in (*triggers, name)] if len(triggers) == 1 else []
        stated = [int(size) for size in sizes if size is not None]
        return max(1, stated[0]) if stated else None

    def own_job_ns(self, name: str, arrival: str | None) -> Any:
        """What a timer's period and its response time count twice, where its executor asks for more than a core.

        Both a job of its own in the round that runs and a whole period count only for what the executor stores.
        """
        if arrival is None or not self.problem.counts_responses or self.room(name, "timer") is None:
            return 0
        if self.protocol(name) not in ("periodic", "hybrid") or self.get(name, "compute_execution_time") is None:
            return 0
        has_offset = self.is_active(name, "offset") and self.get(name, "offset") not in (None, "unknown")
        if has_offset or self.get(name, "response_time") is not None:
            return 0
        home, used = self.executor_of(name), Fraction(0)
        for other in self.problem.sections["threads"]:
            if self.executor_of(other) != home:
                continue
            for field, rate in (("compute", self.rate), ("callback", self.input_rate)):
                time = self.get(other, f"{field}_execution_time")
                if time is not None and (field == "compute" or self.protocol(other) == "hybrid"):
                    used += rate(other) * quantities.time_range(time)[1]
        if used <= NS_PER_S:
            return 0
        longest = quantities.time_range(self.get(name, "compute_execution_time"))[1]
        known = self.scheduling
        inside = [job for job in known.jobs if self.executor_of(job[0]) == home]
        longest -= sum(known.times(job)[1] for job in inside if known.has_turn_before(job[0], name))
        longest = max(longest, 0)
        sender = self.problem.component(arrival).get("from")
        is_inner = sender is not None and self.problem.section_of[sender] == "threads"
        is_inner = (
            is_inner and self.executor_of(str(sender)) == home and not sum(r[3] for r in self.connection_rows(arrival))
        )
        work = self.get(str(sender), "compute_execution_time") if is_inner else None
        if self.protocol(name) == "hybrid" and arrival in self.triggers(name):
            callback = self.get(name, "callback_execution_time")
            is_inner, work = is_inner or callback is not None, work if callback is None else callback
        is_inner = is_inner and work is not None and quantities.time_range(work)[1] > 0  # what takes no time waits not
        return longest if is_inner else min(longest, self.period_ns(name) or 0)

    def skipped_ns(self, name: str) -> Any:
        """How much longer than its period two jobs of a timer are apart: a release is skipped while one waits."""
        if self.room(name, "timer") is None or self.protocol(name) not in ("periodic", "hybrid"):
            return 0
        if self.get(name, "compute_execution_time") is None:
            return 0
        begins = self.processing(name)[1] - quantities.time_range(self.get(name, "compute_execution_time"))[1]
        return begins if begins >= (self.period_ns(name) or 0) else 0

    def message_distances(self, connection: str) -> tuple[Any, Any]:
        """The shortest and the longest time between two messages of a connection; None for ever."""
        spread = sum((Fraction(row[3]) - row[2] for row in self.connection_rows(connection)), Fraction(0))
        sender = self.problem.component(connection).get("from")
        apart = Fraction(0)
        if self.states_rate(connection) or sender is None:
            rate = self.delivered_rate(connection)
            if not rate:
                return 0, None
            apart = Fraction(ceil(NS_PER_S / rate))
        if sender is None:
            return max(apart - spread, 0), apart + spread
        soonest, longest = (0, None) if sender in self._awaited else self._job_distances(sender)
        least, most = self.processing(sender)
        logical = self.logical_ns(sender)
        if logical is not None:
            least = most = logical
        if longest is None or most >= NO_BOUND_NS:
            return 0, None
        soonest, longest = max(soonest - (most - least), 0), longest + (most - least)
        if soonest < apart:
            soonest, longest = apart, longest + apart
        return max(soonest - spread, 0), longest + spread

    # Clocks

    def logical_ns(self, name: str) -> int | None:
        """The deadline, else the period, of a timer whose data pass then."""
        if not self.is_active(name, "communication") or self.get(name, "communication") != "let":
            return None
        deadline = self.get(name, "deadline")
        return self.period_ns(name) if deadline is None else quantities.deadline(deadline)

    def error_ns(self, one: str, other: str) -> int | None:
        """By how much the clocks of two components may differ; None where they are not the same."""
        machines = [self.processor_of(name) or name for name in (one, other)]
        if machines[0] == machines[1]:
            return 0
        clocks = [self.problem.component(machine).get("clock") for machine in machines]
        if clocks[0] is None or clocks[0] != clocks[1]:
            return None
        stated = self.problem.document["clocks"][clocks[0]] or {}
        return quantities.duration(stated.get("synchronisation_error", "0 ns"))

    def late_ns(self, name: str) -> Any:
        """How late after its release a job that reads when it begins may read: what its response time has besides."""
        communicates = self.is_active(name, "communication") and self.get(name, "communication")
        stated, execution = self.get(name, "response_time"), self.get(name, "compute_execution_time")
        counted = self.problem.counts_responses and self.processor_of(name) is not None and execution is not None
        if communicates in ("let", "at_dispatch") or (stated is None and not counted):
            return 0
        best, response = self.processing(name)
        own = best if execution is None else quantities.time_range(execution)[1]
        return max(0, response - own)

    def sampling(self, sender: str, name: str, least: Any, most: Any, *, is_first: bool) -> tuple[Any, Any, Any]:
        """The wait at least and at most, and what it adds to the jitter of one run.

        `is_first` tells whether the sender begins the flow, so that time counts from its release.
        """
        period, error = self.period_ns(name), self.error_ns(sender, name)
        assert period is not None, name
        if error is None or most >= NO_BOUND_NS:
            return 0, period, period
        step = gcd(period, self.period_ns(sender) or 0)
        offsets = [self.get(each, "offset") if self.is_active(each, "offset") else None for each in (sender, name)]
        if None in offsets:
            if self.late_ns(name) or (not is_first and self.late_ns(sender)):
                return 0, period, period
            ways = ceil((most - least + 2 * error) / Fraction(step)) * step
            return 0, period, min(period, period - step + ways + 2 * error - (most - least))
        shift = quantities.duration(offsets[1]) - quantities.duration(offsets[0])

        def first_from(time: Any) -> Any:
            """The first possible time from a release of the one to one of the other."""
            return shift + ceil((time - shift) / Fraction(step)) * step

        late, missed = self.late_ns(name), 0 if is_first else self.late_ns(sender)
        soonest = max(least, first_from(least - error - late) - error - missed) - least
        latest = min(period, first_from(most + error) + error + period - step - most)
        return soonest, latest, latest - soonest

    @in_common
    def message_bytes(self, connection: str) -> int:
        """Data size of all in one message and the overheads of all buses that carry the connection."""
        sizes = [self.get(name, "data_size") for name in self.frame(connection)]
        overheads = [self.bus_field(bus, "overhead") for bus in self.stack(connection)]
        return sum(quantities.size(text) for text in (*sizes, *overheads) if text is not None)

    @property
    def messages(self) -> Scheduling:
        """What messages wait for their buses: with all response times where these count, else by themselves."""
        if self.problem.counts_responses:
            return self.scheduling
        found, seen = self._messages
        self.looked_at[-1] |= seen
        return found

    @cached_property
    def _messages(self) -> tuple[Scheduling, set[str]]:
        """What messages wait for their buses by themselves, and the decisions that were looked at."""
        self.looked_at.append(set())
        return Scheduling(self, only_buses=True), self.looked_at.pop()

    @in_common
    def connection_rows(self, connection: str, lags: bool = False) -> list[Row]:
        """The contributions of a connection of a flow: what it takes, and what its message waits for its bus.

        Where it `lags` from when it is queued at the latest.
        """
        rows = self.transit_rows(connection)
        if not self.problem.waiting_buses & set(self.stack(connection)):
            return rows
        waits = self.messages.waits(connection, lags=lags)
        return [*rows, (connection, "waiting for the bus", 0, self._counted(waits))]

    def message_responses(self) -> dict[str, Fraction]:
        """The longest from when the message of each connection is sent until it is there."""
        named = self.problem.sections["connections"]
        return {name: sum((Fraction(row[3]) for row in self.connection_rows(name)), Fraction(0)) for name in named}

    @in_common
    def transit_rows(self, connection: str) -> list[Row]:
        """What a connection takes where nobody waits."""
        rows: list[Row] = []
        for bus in self.stack(connection):
            if self.bus_field(bus, "transmission_time.fixed") is not None:
                least, most = map(plain, self._transmission(connection, bus))
                rows.append((connection, f"transmission on {bus}", least, most))
                continue
            latency = self.bus_field(bus, "latency")
            if isinstance(latency, dict):
                latency = self._entry(bus, "latency", latency, self.machine(connection))
            if latency is not None:
                rows.append((connection, f"latency of {bus}", *quantities.time_range(latency)))
        if not rows and not self.is_local(connection):
            own = self.get(connection, "latency")
            if own is not None:
                rows.append((connection, "latency", *quantities.time_range(own)))
        return rows or [(connection, "no latency", 0, 0)]

    @in_common
    def _transmission(self, connection: str, bus: str) -> tuple[Fraction, Fraction]:
        parts = []
        if self.bus_field(bus, "transmission_time.fixed") == "from bandwidth":
            time = self.message_bytes(connection) * NS_PER_S / quantities.bandwidth(self.bus_field(bus, "bandwidth"))
            return time, time
        if self.bus_field(bus, "transmission_time.fixed") == "frame":
            least, most = self._on_the_wire(connection, bus)
            return least * NS_PER_S, most * NS_PER_S
        for field in ("transmission_time.fixed", "transmission_time.per_byte"):
            text = self.bus_field(bus, field)
            if isinstance(text, dict):
                text = self._entry(bus, field, text, self.machine(connection))
            parts.append(quantities.transmission(text))
        (fixed_best, fixed_worst), (best, worst) = parts
        size = self.message_bytes(connection)
        return fixed_best + best * size, fixed_worst + worst * size

    def _on_the_wire(self, connection: str, bus: str) -> tuple[Fraction, Fraction]:
        """Least and most seconds of a message in frames."""
        kind = self.type_of(bus)
        assert kind is not None, bus
        body = self.problem.sections["bus_types"][kind]
        return wire.seconds(
            body, quantities.bandwidth(self.bus_field(bus, "bandwidth")), self.message_bytes(connection)
        )

    def flow_rows(self, flow: str) -> list[Row]:
        """The contributor table of a flow."""
        return self.flow_parts(flow)[0]

    @in_common
    def flow_parts(self, flow: str) -> tuple[list[Row], Any]:
        """The contributor table of a flow, and the jitter of one run."""
        return self._parts(self.problem.paths[flow])

    def input_ages(self, flow: str, name: str) -> tuple[Any, Any]:
        """How old at least and at most what a component reads by a flow is: nothing newer than that is there."""
        path = self.problem.paths[flow]
        rows, _ = self._parts(path[: path.index(name) + 1], reads_last=True)
        while rows[-1][1] not in ("sampling", "until a dispatch"):
            rows.pop()  # what follows when it has read
        least, most = sum(row[2] for row in rows), sum(row[3] for row in rows)
        if self.is_active(name, "offset") and self.get(name, "offset") not in (None, "unknown"):
            most += min(self.late_ns(name), (self.period_ns(name) or 0) - rows[-1][3])
        before = path[: path.index(name) + 1]
        most += self._skipped_before(before) - self.own_job_ns(name, before[-2] if len(before) > 1 else None)
        return least, most + self.first_period(flow) - self._renewed_ns(before)

    @in_common
    def disparity(self, name: str) -> Any:
        """The oldest input by one flow less the newest by another, at most."""
        ages = [self.input_ages(flow, name) for flow in self.problem.meetings[name]]
        pairs = permutations(ages, 2)
        return max(one[1] - other[0] for one, other in pairs)

    def _parts(self, path: Sequence[str], *, reads_last: bool = False) -> tuple[list[Row], Any]:
        """The rows of a path and the jitter of one run; where it only `reads_last` that one is in no row of threads."""
        in_rows = self._in_rows(path[:-1] if reads_last else path)
        rows: list[Row] = []
        since: list[Row] = []
        arrival, timer, first = None, None, True
        run: Any = 0
        for name in path:
            if self.problem.section_of[name] == "connections":
                found = [*self.connection_rows(name, self._lags(path, path.index(name)))]
                arrival, first = name, False
            else:
                way = tuple(path[: path.index(name)])
                found = [*self.component_rows(name, arrival, first, way if arrival and self.joins.joins(name) else ())]
                row = in_rows.get(name, [name])
                if len(row) > 1:
                    since_first = path[: path.index(row[0]) + 1]
                    own = max(place for place, each in enumerate(found) if each[1] != "own job")  # behind its callback
                    found[own] = self._in_row(found[own], row, row.index(name), since_first)
                if arrival and self.joins.joins(name):
                    found = self._from_latest(found, name, row, way)
                first = False
            at = next((place for place, row in enumerate(found) if "sampling" in row[1]), None)
            if at is not None and timer is not None:
                before = since + found[:at]
                least, most = sum(row[2] for row in before), sum(row[3] for row in before)
                *wait, spread = self.sampling(timer, name, least, most, is_first=timer == path[0])
                found[at] = (name, "sampling", *wait)
                run += spread - (wait[1] - wait[0])
            since = since + found if at is None else found[at + 1 :]
            since = [row for row in since if row[1] != "own job"]
            timer = timer if at is None else name
            rows += found
            run += sum(row[3] - row[2] for row in found)
        return rows, run

    def _from_latest(self, found: list[Row], name: str, names: Sequence[str], way: tuple[str, ...]) -> list[Row]:
        """The rows of a thread that may take messages in order: from its latest release what follows may be sooner."""
        counts = self.problem.counts_responses and self.get(name, "response_time") is None and bool(way)
        own = max(place for place, each in enumerate(found) if each[1] != "own job")
        if not counts or found[own][1] != "processing time" or way[-1] not in self.triggers(name):
            return found
        slowest = self.joins.slowest(name, way)
        whole, latest = (self.chain_bound(names, (*way, name), each) for each in (None, slowest))
        if slowest is None or max(whole, latest) >= NO_BOUND_NS:
            return found
        least = found[own]
        return [*found[:own], (*least[:3], least[3] - (whole - latest)), *found[own + 1 :]]

    def _comes_to_a_join(self, path: Sequence[str], name: str) -> bool:
        """Whether a flow leads on to a thread that needs all its inputs, whatever is chosen for it."""
        behind = path[path.index(name) + 1 :]
        return any("all" in as_list(self.problem.component(each).get("join")) for each in behind)

    def follows(self, row: Sequence[str], name: str, arrival: str) -> bool:
        """Whether what a flow has come by releases a component, so that both count together by the ways to cut them."""
        if not row or self.problem.speaks_of_clocks or not self.problem.counts_responses:
            return False
        return self.triggers(name) == [arrival] and self.scheduling.chains.chain(name)[-2:-1] == [row[-1]]

    def _lags(self, path: Sequence[str], place: int) -> bool:
        """Whether a message of a flow counts from when it is queued at the latest, from the source of its sender on."""
        if not self.problem.waiting_buses & set(self.stack(path[place])):
            return False
        if not place or self.problem.speaks_of_clocks or self._comes_to_a_join(path, path[place - 1]):
            return False
        chains, first = self.messages.chains, place - 1
        while first > 1 and self.triggers(path[first]) == [path[first - 1]]:
            if chains.chain(path[first])[-2:-1] != [path[first - 2]]:
                break
            first -= 2
        since = [name for name in path[: first + 1] if self.problem.section_of[name] != "connections"]
        return chains.chain(path[first]) == [path[first]] and any(map(chains.always_begins, since))

    def _in_rows(self, path: Sequence[str]) -> dict[str, list[str]]:
        """For each component of a path those in a row that release each other, itself among them."""
        rows: list[list[str]] = [[]]
        arrival = None
        for name in path:
            if self.problem.section_of[name] == "connections":
                arrival = name
                continue
            is_next = arrival is not None and self.follows(rows[-1], name, arrival)
            if is_next and not self._comes_to_a_join(path, name):
                rows[-1].append(name)
            else:
                rows.append([name])
        return {name: row for row in rows for name in row}

    def _in_row(self, row: Row, names: Sequence[str], place: int, since: Sequence[str]) -> Row:
        """The row of what a component takes: how much longer those in a row with it take up to its end.

        It ends no later than any that follows, less what comes between: ways, and all that these execute.
        """
        if row[1] not in ("processing time", "specified") or self.get(names[place], "response_time") is not None:
            return row
        before, now = (self._ends(names, at, since) for at in (place, place + 1))
        if max(before, now) >= NO_BOUND_NS:
            return row
        way = self.scheduling.chains.way(names[place]) if place else 0
        return (row[0], row[1], row[2], now - before - way)

    def _ends(self, names: Sequence[str], count: int, since: Sequence[str]) -> Any:
        """When the first so many in a row are over at the latest, from the release of the first on; 0 of none."""
        if not count:
            return Fraction(0)
        ends: list[Any] = []
        behind = Fraction(0)
        for length in range(count, len(names) + 1):
            if length > count:
                last = names[length - 1]
                behind += Fraction(self.scheduling.times((last, "timer"))[1]) + self.scheduling.chains.way(last)
            end = self.chain_bound(names[:length], since)
            if end < NO_BOUND_NS:
                ends.append(end - behind)
        return min(ends, default=NO_BOUND_NS)

    def chain_bound(self, part: Sequence[str], since: Sequence[str], slowest: int | None = None) -> Any:
        """The longest that components in a row take that release each other, in a flow that has led by some `since`."""
        stated = [name for name in part if self.get(name, "response_time") is not None]  # what is stated counts
        takes = {name: Fraction(self.processing(name)[1]) for name in part}
        bounded = {name: None if time >= NO_BOUND_NS else time for name, time in takes.items()}
        chains = self.scheduling.chains
        begins = chains.chain(part[0]) == [part[0]] and any(map(chains.always_begins, since))
        return self._counted(self.scheduling.windows.cut(part, bounded, stated, counts_lags=begins, slowest=slowest))

    @in_common
    def flow_figures(self, flow: str) -> dict[str, Any]:
        """Least and most latency of a flow, both jitters, reaction time and data age, and the contributor table."""
        rows, run = self.flow_parts(flow)
        best, worst = sum(row[2] for row in rows), sum(row[3] for row in rows)
        first = self.first_period(flow)
        path = self.problem.paths[flow]
        sensed = worst + first + (self.skipped_ns(path[0]) if self.problem.section_of[path[0]] == "threads" else 0)
        found = {"min": best, "max": worst, "jitter": worst - best, "rows": rows, "run": run, "reaction": sensed}
        if first:
            found["age"] = worst + first - self.last_period(flow) + self._skipped_before(path)
        return found

    def first_period(self, flow: str) -> Any:
        """The period of the first component, where a timer releases it."""
        first = self.problem.paths[flow][0]
        period = self._timer_period(first)
        if period is not None and self.joins.joins(first):
            gap = self.dispatch_gap_ns(first)
            return NO_BOUND_NS if gap is None else min(gap, NO_BOUND_NS)
        return period or 0

    def _skipped_before(self, path: Sequence[str]) -> Any:
        """What skipped releases add to an age: of each timer of a path but that which reads last."""
        readers = [
            name
            for arrival, name in zip(["", *path], path, strict=False)
            if self.problem.section_of[name] != "connections"
            and (self._timer_period(name) is not None or (arrival and self.is_stored(name, arrival)))
        ]
        skipped = sum(self.skipped_ns(name) for name in readers[:-1] if self.problem.section_of[name] == "threads")
        pairs = zip(["", *path], path, strict=False)
        return skipped + sum(self.own_job_ns(name, arrival) for arrival, name in pairs if arrival)

    def last_period(self, flow: str) -> Any:
        """The period of the last component that a timer releases, or how far apart its dispatches are at most."""
        return self._renewed_ns(self.problem.paths[flow])

    def _renewed_ns(self, path: Sequence[str]) -> Any:
        """How far apart at most the last of a path reads that waits for a release or a dispatch."""
        for place in reversed(range(len(path))):
            name, arrival = path[place], path[place - 1] if place else None
            if self.problem.section_of[name] == "connections":
                continue
            period = self._timer_period(name)
            if period is not None:
                return period
            if arrival is not None and self.is_stored(name, arrival):
                gap = self.dispatch_gap_ns(name)
                return NO_BOUND_NS if gap is None else min(gap, NO_BOUND_NS)
        return 0

    def _timer_period(self, name: str) -> int | None:
        is_component = self.problem.section_of[name] in ("devices", "threads")
        return self.period_ns(name) if is_component and self.protocol(name) in ("periodic", "hybrid") else None

    # Resources

    @in_common
    def shares(self) -> dict[str, dict[str, Fraction]]:
        """Utilisation of one core by each thread, per processor."""
        found: dict[str, dict[str, Fraction]] = {slot: {} for slot in self.problem.sections["processors"]}
        for thread in self.problem.sections["threads"]:
            slot = self.processor_of(thread)
            if slot is None:
                continue
            for place in range(len(self.segments(thread))):
                home, longest = self.piece_slot(thread, place) or slot, self.piece_times(thread, place)[1]
                found[home].setdefault(thread, Fraction(0))
                found[home][thread] += longest * self.rate(thread) / NS_PER_S
            if self.segments(thread):
                continue
            work = self.get(thread, "compute_execution_time")
            share = self._worst(work) * self.rate(thread)
            if self.protocol(thread) == "hybrid":
                share += self._worst(self.get(thread, "callback_execution_time")) * self.input_rate(thread)
            found[slot][thread] = share / NS_PER_S
        return found

    @in_common
    def peak(self, slot: str) -> Peak:
        """What the fullest core of a processor carries when its threads are put on cores as evenly as can be.

        Those of one executor or reservation share a core.
        """
        count = int(self.get(slot, "cores") or 1)
        taken, ways = [Fraction(0)] * count, []
        together: dict[str, Fraction] = {}
        for thread, share in self.shares()[slot].items():
            place = self.place_of(thread)
            together[place] = together.get(place, Fraction(0)) + share
        for place, share in together.items():
            cores = self.possible_cores(place) or range(1, count + 1)
            if count == 1:
                taken[0] += share
            elif len(cores) == 1:
                taken[cores[0] - 1] += share
            else:
                ways.append([(core - 1, share) for core in cores if core <= count])
        return Peak(tuple(taken), tuple(sorted(map(tuple, ways), key=lambda way: -way[0][1])))

    def core_use(self, slot: str, shares: dict[str, Fraction]) -> list[Fraction] | None:
        """What each core of a processor carries; None where the core of a thread is open."""
        count = int(self.get(slot, "cores") or 1)
        used = [Fraction(0)] * self.problem.most_cores(slot)
        for thread, share in shares.items():
            cores = self.possible_cores(self.place_of(thread)) if count > 1 else [1]
            if len(cores) != 1:
                return None
            used[cores[0] - 1] += share
        return used

    @staticmethod
    def _worst(text: str | None) -> int:
        return 0 if text is None else quantities.time_range(text)[1]

    @in_common
    def loads(self) -> dict[str, Fraction]:
        """Bytes per second on each bus."""
        found = {bus: Fraction(0) for bus in self.problem.buses}
        for connection in self.problem.sections["connections"]:
            for bus in self.stack(connection):
                found[bus] += 0 if self.is_sent_before(connection, bus) else self._load(connection, bus)
        return found

    @in_common
    def _load(self, connection: str, bus: str) -> Fraction:
        """Bytes per second of a connection on a bus that carries it."""
        if self.bus_field(bus, "transmission_time.fixed") == "frame":
            bandwidth = quantities.bandwidth(self.bus_field(bus, "bandwidth"))
            return self._on_the_wire(connection, bus)[1] * bandwidth * self.delivered_rate(connection)
        data_rate = self.get(connection, "data_rate")
        if data_rate is not None:
            return quantities.data_rate(data_rate)
        return self.message_bytes(connection) * self.delivered_rate(connection)

    @in_common
    def busy(self) -> dict[str, Fraction]:
        """The share of the time that each bus is busy, where that can be computed."""
        found = {bus: Fraction(0) for bus in self.problem.timed_buses}
        for connection in self.problem.sections["connections"]:
            for bus in found.keys() & set(self.stack(connection)):
                found[bus] += 0 if self.is_sent_before(connection, bus) else self._busy(connection, bus)
        return found

    @in_common
    def _busy(self, connection: str, bus: str) -> Fraction:
        return self._transmission(connection, bus)[1] * self.delivered_rate(connection) / NS_PER_S

    def is_exclusive(self, bus: str) -> bool:
        """Whether a bus slot's chosen type carries one message at a time."""
        kind = self.type_of(bus)
        return kind not in (None, NONE) and self.problem.sections["bus_types"][kind].get("exclusive") == "true"

    @in_common
    def amounts(self, figure: str) -> dict[str, Fraction]:
        """Price in cents, power in mW or a declared total, per component; direct virtual bus types count once."""
        found = {}
        for name, section in self.problem.section_of.items():
            if section != "connections":
                empty = section in ("processors", "buses") and self.type_of(name) == NONE
                found[name] = Fraction(0) if empty else self._amount(name, figure)
        for bus in self.carrying() - found.keys():
            body = self.problem.sections["bus_types"][bus]
            text = (body.get("totals") or {}).get(figure) if figure in self.problem.totals else body.get(figure)
            found[bus] = self._number(figure, text)
        return found

    def _amount(self, name: str, figure: str) -> Fraction:
        if figure in self.problem.totals:
            stated = self.problem.stated(name, "totals", self.type_of(name)) or {}
            return self._number(figure, stated.get(figure))
        return self._number(figure, self.get(name, figure))

    def _number(self, figure: str, text: str | None) -> Fraction:
        if text is None:
            return Fraction(0)
        if figure in self.problem.totals:
            return quantities.figure(text, self.problem.totals[figure])
        return Fraction(quantities.price(text) if figure == "price" else quantities.power(text))

    # Validity

    def check(self) -> None:
        """Raises InvalidDesign unless the bindings, the trigger graph and the rules admit this design."""
        self.check_bindings()
        self.check_rest()

    def check_bindings(self) -> None:
        """What follows from types, processes, processors and buses alone."""
        self.check_processes()
        self.check_slots()

    def check_rest(self) -> None:
        """What other decisions have a say in."""
        self.check_cores()
        self.check_identifiers()
        self.check_frames()
        for name, section in self.problem.section_of.items():
            if section in ("devices", "threads"):
                self.rate(name)
        for rule in self.problem.rules:
            if self.holds(rule.condition) is rule.forbid:
                raise InvalidDesign(f"rule: {rule.text}")

    def check_identifiers(self) -> None:
        """Two messages on one wire have different identifiers, but for those of a port that a broadcast bus carries."""
        named = [name for name, body in self.problem.sections["connections"].items() if "identifier" in body]
        for one, other in combinations(named, 2):
            if other in self.frame(one):
                continue
            texts = [self.get(self.head(each), "identifier") for each in (one, other)]
            if "any" in texts or number_of(texts[0]) != number_of(texts[1]):
                continue
            for bus in set(self.stack(one)) & set(self.stack(other)):
                named_type = self.type_of(bus) if bus in self.problem.section_of else bus
                kind = self.problem.sections["bus_types"][str(named_type)]
                bodies = [self.problem.component(name) for name in (one, other)]
                ports = [(body.get("from"), body.get("from_port")) for body in bodies]
                is_one = ports[0] == ports[1] and ports[0][1] is not None and kind.get("broadcast") == "true"
                if kind.get("virtual") != "true" and not is_one:
                    raise InvalidDesign(f"{one} and {other} have one identifier")

    def check_frames(self) -> None:
        """A message that carries another one's data is carried in none, and has a frame that holds it all."""
        for name in self.problem.sections["connections"]:
            if self.head(self.head(name)) != self.head(name):
                raise InvalidDesign(f"{self.head(name)} is carried itself")
            if len(self.frame(name)) > 1:
                kinds = [self.problem.sections["bus_types"][str(self.type_of(bus))] for bus in self.stack(name)]
                frames = [kind.get("frame") for kind in kinds if kind.get("frame") is not None]
                names = [frame["protocol"] if isinstance(frame, dict) else frame for frame in frames]
                most = min(({"can": 8, "can_fd": 64}.get(str(each), 10**9) for each in names), default=10**9)
                if self.message_bytes(name) > most:
                    raise InvalidDesign(f"the frame of {name} is too long")

    def check_cores(self) -> None:
        """A stated core is one that the processor has, of all in which something runs."""
        for place in self.problem.places:
            cores = self.possible_cores(place)
            if not cores or (self.problem.section_of[place] == "executors" and not self.runs_any(place)):
                continue
            slot = self.get(place, "processor")
            count = int(self.get(slot, "cores") or 0)
            if min(cores) > count and (len(cores) == 1 or count > 1):
                raise InvalidDesign(f"{slot} has no core for {place}")

    def check_processes(self) -> None:
        homes: dict[str, str | None] = {}
        for thread in self.problem.sections["threads"]:
            process = self._process(thread)
            if process is not None:
                slot = self.processor_of(thread)
                if homes.setdefault(process, slot) != slot:
                    raise InvalidDesign(f"process {process} is spread over processors")

    def bound(self) -> set[str]:
        """The processor and bus slots that something is bound to."""
        slots = {self.processor_of(thread) for thread in self.problem.sections["threads"]}
        pieces = {piece.get("processor") for name in self.problem.sections["threads"] for piece in self.segments(name)}
        return {slot for slot in slots | pieces if slot is not None} | self.carrying()

    def check_slots(self) -> None:
        bound = self.bound()
        for name in (*self.problem.sections["processors"], *self.problem.sections["buses"]):
            if NONE in self.problem.types(name) and (self.type_of(name) == NONE) == (name in bound):
                raise InvalidDesign(f"{name} is {'empty' if name in bound else 'unused'} but must not be")

    # Rules

    @in_common
    def holds(self, condition: tuple) -> bool | None:
        """Kleene truth of a condition."""
        match condition:
            case ("not", part):
                inner = self.holds(part)
                return None if inner is None else not inner
            case ("and", parts):
                return self._kleene([self.holds(part) for part in parts], False)
            case ("or", parts):
                return self._kleene([self.holds(part) for part in parts], True)
            case ("used", name):
                return self._is_used(name)
            case ("compare", left, sign, right):
                return self._compare(left, sign, right)
            case ("in", left, values):
                return self._kleene([self._compare(left, "==", value) for value in values], True)
            case ("multiple", left, right):
                first, second = self._operand(left), self._operand(right)
                if first is None or second is None:
                    return None
                ratio = quantities.exact(first, TIME) / quantities.exact(second, TIME)
                return ratio.denominator == 1 and ratio >= 1
        raise ValueError(f"unknown condition {condition}")

    @staticmethod
    def _kleene(parts: list[bool | None], dominant: bool) -> bool | None:
        if dominant in parts:
            return dominant
        return None if None in parts else not dominant

    def _field_of(self, text: str) -> tuple[str, str] | None:
        """Component and field, if the text names a decision."""
        for name, section in self.problem.section_of.items():
            field = text.removeprefix(f"{name}.")
            if field != text and (field in FIELDS[section] or (field == "core" and name in self.problem.places)):
                return name, field
        return None

    def _operand(self, text: str) -> str | None:
        """The value of a decision (None while inactive), or the text itself."""
        named = self._field_of(text)
        if named is None:
            return text
        return self.get(*named) if self.is_active(*named) or self.has_default(*named) else None

    def _compare(self, left: str, sign: str, right: str) -> bool | None:
        """Compares as options are compared: after their rounding."""
        one, other = self._operand(left), self._operand(right)
        if one is None or other is None:
            return None
        named = self._field_of(left)
        assert named is not None, left
        first, second = (option_value(named[1], value) for value in (one, other))
        return COMPARE[sign](first, second)

    def _is_used(self, name: str) -> bool:
        if name in self.problem.section_of:
            return self.type_of(name) != NONE
        typed = [n for n, section in self.problem.section_of.items() if section != "connections"]
        return name in {self.type_of(component) for component in typed} | self.carrying()
