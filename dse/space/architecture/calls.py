"""Calls that are answered: a connection with a `reply` becomes a request, a reply, and the jobs that they dispatch.

See docs/semantics.md, section 3.9.

A thread that calls ends its job with the request; a further job of it, which the reply dispatches, does the rest. What
serves several calls has one job for each, so that each caller gets its own answers, and no more of them. All of these
are components and connections as any others: rates, latencies and response times follow. Jobs of one thread have its
decisions, and its OS thread where they take time: its executor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from dse.importers.registry import STORED_PORTS
from dse.space.architecture.activation import must_be_event_triggered
from dse.space.model.space import AdditiveFigures, Component, Connection, Processor
from dse.space.model.trees import leaves
from dse.space.properties import FieldReader, Ledger, Owner, by_machine
from dse.spec.schema.model import Spec, Thread
from dse.support.graphs import strong_components
from dse.support.units import format_time_range, shown

Way: TypeAlias = tuple[tuple[str, int], ...]
"""Connections by name, each with the component that it leads to."""

OF_THE_FIRST_JOB = (
    "period_ns", "stated_period_ns", "callback_ns", "latency_ns", "deadline_ns", "response_ns", "queue_size",
    "section_ns", "offset_ns", "communication", "join", "pairing", "partition",
)  # fmt: skip
"""Fields that only the first job of a caller has, not its job after a reply."""
MOST_JOBS = 10_000
MOST_NESTED = 50
"""The greatest number of jobs that calls make, and of calls nested within each other."""


@dataclass(frozen=True)
class Link:
    """A message of a call, from component to component: of connection `call`, under a name of its own."""

    call: str
    name: str
    source: int
    target: int
    is_reply: bool


@dataclass
class Calls:
    """The calls of a problem: their messages, and of each component that calls the way through all its calls."""

    links: list[Link] = field(default_factory=list)
    ways: dict[int, Way] = field(default_factory=dict)
    last: dict[str, int] = field(default_factory=dict)
    """The component that sends what a thread that calls sends to others: its job after the last reply."""


def stated_calls(spec: Spec) -> tuple[str, ...]:
    """The connections that are answered."""
    return tuple(name for name, given in spec.connections.items() if given.reply is not None)


def with_calls(
    ledger: Ledger, spec: Spec, processors: Sequence[Processor], components: Sequence[Component]
) -> tuple[tuple[Component, ...], Calls]:
    """The components, further jobs that calls make behind them, and how calls lead from one to the other."""
    made = _Made(ledger, spec, processors, list(components))
    made.all()
    return tuple(made.components), made.found


def connections_of_calls(spec: Spec, calls: Calls, stated: Mapping[str, Connection]) -> tuple[Connection, ...]:
    """Requests to further jobs, and replies; the first request of each call is the stated connection itself."""
    found = []
    for link in calls.links:
        if link.name == link.call or link.call not in stated:
            continue
        made = replace(stated[link.call], name=link.name, source=link.source, target=link.target)
        reply = spec.connections[link.call].reply
        if link.is_reply and reply is not None:
            made = replace(made, size_bytes=reply.data_size, identifier=reply.identifier, priority=reply.priority,
                           rate_hz=None, data_rate=None, deadline_ns=None, queue_size=None,
                           latency_ns=reply.latency or made.latency_ns)  # fmt: skip
        found.append(made)
    return tuple(found)


@dataclass
class _Made:
    """Makes the jobs of all calls, from those who are called by nobody on."""

    ledger: Ledger
    spec: Spec
    processors: Sequence[Processor]
    components: list[Component]
    found: Calls = field(default_factory=Calls)
    made: set[str] = field(default_factory=set)
    calls_of: dict[str, list[str]] = field(default_factory=dict)
    jobs: dict[str, int] = field(default_factory=dict)

    def all(self) -> None:
        """Every call of the problem."""
        self.numbers = {item.stated_as: number for number, item in enumerate(self.components)}
        for call in stated_calls(self.spec):
            if self._has_ends(call):
                self.calls_of.setdefault(str(self.spec.connections[call].from_), []).append(call)
        if not self._is_countable():
            self.calls_of.clear()
        calls = [call for several in self.calls_of.values() for call in several]
        if [call for call in calls if self._is_wrong(call)]:
            return
        servers = {str(self.spec.connections[call].to) for call in calls}
        for name in self.calls_of:
            if name not in servers:
                self._job(name, ())

    def _is_countable(self) -> bool:
        """Whether calls lead back to nobody who calls, and make few enough jobs; counts those of each thread."""
        servers = {name: [str(self.spec.connections[call].to) for call in calls]
                   for name, calls in self.calls_of.items()}  # fmt: skip
        graph = {name: servers.get(name, []) for several in servers.values() for name in several} | servers
        inwards, depth = strong_components(graph), dict.fromkeys(graph, 0)
        self.jobs = dict.fromkeys(graph, 0)
        for members in reversed(inwards):
            name = members[0]
            path = ("connections", self.calls_of.get(name, [""])[0], "reply")
            if len(members) > 1 or name in graph[name]:
                self.ledger.error(path, "calls lead back to who calls: each would wait for the other")
                self.ledger.doubt(*members)
                return False
            self.jobs[name] = max(self.jobs[name], 1)
            for server in graph[name]:
                self.jobs[server] += self.jobs[name]
                depth[server] = max(depth[server], depth[name] + 1)
            if sum(self.jobs.values()) > MOST_JOBS or depth[name] > MOST_NESTED:
                text = f"calls within calls make more than {MOST_JOBS:,} jobs, or are more than {MOST_NESTED} deep"
                self.ledger.error(("connections",), text)
                return False
        return True

    def _job(self, name: str, label: tuple[str, ...]) -> tuple[int, int]:
        """A thread with its calls, once more where it was made before: the numbers of its first and its last job."""
        self.ledger.work.go_on(10)
        words = list(label)
        first = self.numbers[name]
        if name in self.made:
            first = self._add(replace(self.components[first], name=_titled(name, words), part_of=name,
                                      figures=AdditiveFigures(None, None, {})))  # fmt: skip
        else:
            words = []
        is_first = name not in self.made
        self.made.add(name)
        at, way = first, list[tuple[str, int]]()
        for call in self.calls_of.get(name, ()):
            given = self.spec.connections[call]
            begin, end = self._job(str(given.to), (*words, call))
            after = self._after(name, call, words)
            request, reply = (call if is_first else _titled(call, words)), _titled(call, [*words, "reply"])
            self.found.links += [Link(call, request, at, begin, False), Link(call, reply, end, after, True)]
            way += [(request, begin), *self.found.ways.get(begin, ()), (reply, after)]
            at = after
        if way:
            self.found.ways[first] = tuple(way)
            if is_first:
                self.found.last[name] = at
        return first, at

    def _after(self, name: str, call: str, words: Sequence[str]) -> int:
        """The job of a caller that a reply dispatches, with the caller's own place."""
        caller, given = self.components[self.numbers[name]], self.spec.connections[call].reply
        owner = Owner(_titled(name, [*words, f"after {call}"]), ("connections", call, "reply"), given)
        machine = by_machine(self.ledger, self.processors, name, caller.processor)
        runs_on = [leaf for leaf in leaves(caller.processor) if leaf is not None]
        types = frozenset(item for leaf in runs_on for item in self.processors[leaf].types)
        reader = FieldReader(
            self.ledger, owner, "compute_execution_time", "time range", format_time_range, machine, types
        )
        execution = reader.read(lambda model: model.compute_execution_time)
        works = execution is not None
        absent: dict[str, Any] = dict.fromkeys(OF_THE_FIRST_JOB)
        return self._add(
            replace(
                caller,
                name=owner.name,
                part_of=name,
                processor=caller.processor if works else None,
                executor=caller.executor if works else None,
                reservation=caller.reservation if works else None,
                core=caller.core if works else None,
                protocol="aperiodic",
                execution_ns=execution,
                figures=AdditiveFigures(None, None, {}),
                **absent,
            )
        )

    def _add(self, component: Component) -> int:
        for section in ("threads", "devices", "connections"):
            if component.name in getattr(self.spec, section):
                self.ledger.error((section, component.name), "the name of a job that a call makes", at_key=True)
        self.components.append(component)
        return len(self.components) - 1

    # --- mistakes ---------------------------------------------------------------------------------------------------

    def _has_ends(self, call: str) -> bool:
        """Whether a call leads from a thread to a thread or device; what is wrong is told."""
        given, is_whole = self.spec.connections[call], True
        for key, end, sections in (("from", given.from_, ("threads",)), ("to", given.to, ("threads", "devices"))):
            if end is None:
                self.ledger.error(("connections", call), f"a call needs `{key}`")
                self.ledger.doubt(f"{call}.{key}")
            elif end in self.spec.devices and key == "from":
                self.ledger.error(("connections", call, key), f"{shown(end)} is a device: threads call others")
            is_whole &= end is not None and any(end in getattr(self.spec, section) for section in sections)
        return is_whole

    def _is_wrong(self, call: str) -> bool:
        """Whether a call cannot be followed, which is told."""
        given, before = self.spec.connections[call], len(self.ledger.diagnostics)
        path, caller, server = ("connections", call), str(given.from_), str(given.to)
        if self.spec.profile != "dse":
            self.ledger.error((*path, "reply"), f"profile {self.spec.profile} knows no calls", "profile: dse")
        if given.port in STORED_PORTS:
            self.ledger.error((*path, "port"), "a call dispatches who answers it: not to a port where data lie")
            self.ledger.doubt(server)
        if given.bus and given.reply is not None and given.reply.data_size is None:
            self.ledger.error((*path, "reply"), "a reply over a bus needs `data_size`")
        if not given.bus and given.reply is not None and given.reply.identifier is not None:
            self.ledger.error((*path, "reply", "identifier"), "an identifier is that of a message on a `bus`")
        if not given.bus and given.reply is not None and given.reply.priority is not None:
            self.ledger.error((*path, "reply", "priority"), "a priority is that of a message on a `bus`")
        stated = given.reply.compute_execution_time if given.reply is not None else None
        times = stated.values() if isinstance(stated, Mapping) else [stated or ()]
        if any(len(options) > 1 for options in times):
            text = "a job after a reply has one execution time"
            self.ledger.error((*path, "reply", "compute_execution_time"), text, "or one for each type")
        self._check_caller(caller, call)
        self._check_server(server, call)
        return len(self.ledger.diagnostics) > before

    def _check_caller(self, name: str, call: str) -> None:
        """Mistakes of a thread that calls."""
        given, path, reply = self.spec.threads[name], ("threads", name), self.spec.connections[call].reply
        self._check_thread(name)
        if given.deadline is not None:
            message = f"of the jobs before and after the reply of {shown(call)} it does not say which is to end by it"
            self.ledger.error((*path, "deadline"), message, "limit the latency of a flow through it")
        if given.communication is not None and "let" in given.communication:
            self.ledger.error((*path, "communication"), "a thread under logical execution time waits for no reply")
        if reply is not None and reply.compute_execution_time is not None and _is_alone(given):
            message = f"works before and after the reply of {shown(call)}: name the OS thread that runs both jobs"
            self.ledger.error(path, message, "an `executor` of kind fifo")

    def _check_server(self, name: str, call: str) -> None:
        """Mistakes of who answers a call."""
        path = ("threads" if name in self.spec.threads else "devices", name)
        if name in self.spec.threads:
            self._check_thread(name)
        server = self.components[self.numbers[name]]
        has_period = any(leaf is not None for leaf in leaves(server.period_ns))
        if has_period or server.join is not None or not must_be_event_triggered(server):
            message = f"answers {shown(call)}: each call dispatches it, so it has no period, timer or join"
            self.ledger.error(path, message, "make the callback of the service a thread of its own")
        if self.jobs[name] < 2:
            return
        wires = self.spec.connections.items()
        others = [key for key, item in wires if name in (item.from_, item.to) and item.reply is None]
        if others:
            message = f"answers several calls: to which of these jobs {shown(others[0])} belongs is not known"
            self.ledger.error(path, message, "a thread of its own for each caller, in one executor")
        if name in self.spec.threads and _is_alone(self.spec.threads[name]):
            message = "answers several calls: name the OS thread that runs these jobs one by one"
            self.ledger.error(path, message, "an `executor` of kind fifo")

    def _check_thread(self, name: str) -> None:
        if self.spec.threads[name].segments is not None:
            self.ledger.error(("threads", name, "segments"), "a thread with segments makes and answers no calls")


def _is_alone(given: Thread) -> bool:
    """Whether a thread runs on a processor, and nothing is said to run it beside other jobs."""
    return given.executor is None and bool(given.processor or given.figures_of or given.reservation)


def _titled(name: str, words: Sequence[str]) -> str:
    return f"{name} ({', '.join(words)})" if words else name
