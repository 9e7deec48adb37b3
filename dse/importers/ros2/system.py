"""A ROS 2 system, whatever described it, and the problem file that it makes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import mean, stdev
from typing import Any

from dse.importers.registry import Imported, Key
from dse.importers.registry import Place as Found
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue, UniqueNames, ros_name
from dse.support.errors import UsageError
from dse.support.units import TimeRange, UnitError, format_duration, format_rate, format_time_range, parse_rate_hz

COMPUTER = "computer"
NODE = re.compile(r"(/[A-Za-z_]\w*)+")
"""The pattern of a full name of a node in ROS; other names are not kept as such."""
NO_TIMES = (
    "MISSING: execution times. Threads without `compute_execution_time` count as taking no time: measure them, and "
    "import again with --times, or state them."
)

CALL_HINT = "state the callback as a thread, and who calls it by a connection with a `reply`"
"""The hint for the callback of a service."""


@dataclass
class Callback:
    """A callback: a timer with a period, or what runs when a message of a topic comes.

    `durations_ns` are its measured execution times, `starts_ns` when they began, `words` what else is known of it.
    `process` is the container of its node ("": the node is a process of its own), `parameter` what states its period:
    ``rate`` or ``period``, and the parameter's name with its unit. `is_open`: nothing says what runs it. One that
    `joins` goes on when a message of each input has come.
    """

    name: str
    node: str
    place: LocatedValue
    period_ns: int | None = None
    topic: str = ""
    durations_ns: Sequence[int] = ()
    starts_ns: Sequence[int] = ()
    words: str = ""
    process: str = ""
    parameter: tuple[str, str] | None = None
    is_open: bool = False
    joins: bool = False


@dataclass
class Group:
    """Callbacks of which one runs at a time, unless it is reentrant; `id` as the callback-isolated executor has it.

    `priority` is that of its OS thread (None: none is stated), `cores` those it may run on, from 1.
    """

    name: str
    callbacks: list[Callback]
    place: LocatedValue
    is_reentrant: bool = False
    id: str = ""
    priority: int | None = None
    cores: tuple[int, ...] = ()
    is_isolated: bool = False


@dataclass
class Message:
    """A message from callback to callback: of a topic, or within a node, where it waits to be read or `dispatches`."""

    name: str
    place: LocatedValue
    source: Callback | None
    target: Callback
    is_kept: bool = False
    words: str = ""
    rate: str = ""
    dispatches: bool = False


@dataclass
class System:
    """Everything that a description says; `executors` are groups that share an OS thread, by the executor's name.

    `publishes` are callbacks with a topic that they were seen to publish, `cpus` the numbers of the CPUs seen, from 0.
    """

    groups: list[Group] = field(default_factory=list)
    executors: list[tuple[str, list[Group]]] = field(default_factory=list)
    wires: list[Message] = field(default_factory=list)
    flows: dict[str, tuple[LocatedValue, list[Callback | Message]]] = field(default_factory=dict)
    publishes: list[tuple[Callback, str]] = field(default_factory=list)
    cpus: set[int] = field(default_factory=set)


def _entity_of(one: Callback) -> str:
    """The ROS name of a callback: ``/node@Timer(PERIOD)`` or ``/node@Subscription(/topic)``; open, its node alone."""
    what = f"Subscription({one.topic})" if one.topic else f"Timer({one.period_ns})"
    return f"{one.node}@{'' if one.is_open else what}"


def seen_among(callbacks: Sequence[Callback], entities: Sequence[str]) -> list[Callback]:
    """The callbacks of a node that were seen: by what they are in ROS; its only timer is that of any period.

    Each once, in the order of `entities`, which are texts such as ``/cam@Timer(10000000)``.
    """
    seen: dict[int, Callback] = {}
    timers = [one for one in callbacks if one.period_ns is not None]
    for entity in entities:
        own = [one for one in callbacks if _entity_of(one) == entity]
        if not own and "@Timer(" in entity and len(timers) == 1:
            own = timers
        seen |= {id(one): one for one in own}
    return list(seen.values())


def is_of_topic(wire: str, port: str, topic: str) -> bool:
    """Whether a connection goes by the name that an import gives it: its topic, alone or with the nodes at its ends."""
    name = ros_name(topic)
    return wire == name or (wire.startswith(f"{name}.") and port != "data")


def stated_options(options: Mapping[str, Any]) -> tuple[int | None, str | None]:
    """The cores and the rate that the user states.

    Raises
    ------
    UsageError
        when one of them is none.
    """
    cores, rate = options.get("cores"), options.get("rate")
    if cores is not None and not (str(cores).isdecimal() and len(str(cores)) < 5 and 0 < int(cores) <= 1024):
        raise UsageError(f"--cores {cores}: expected a number of cores from 1 to 1024")
    if rate is None:
        return (None if cores is None else int(cores)), None
    try:
        return (None if cores is None else int(cores)), format_rate(parse_rate_hz(str(rate)))
    except UnitError as error:
        raise UsageError(f"--rate {rate}: {error}") from error


class SystemWriter:
    """Makes the document of a system; `places` tell where its parts come from."""

    def __init__(self, file: LocatedFile, system: System, options: Mapping[str, Any], kind: str) -> None:
        self.file, self.system, self.kind = file, system, kind
        self.cores, self.rate = stated_options(options)
        self.places: dict[Key, Found] = {}
        self.names = UniqueNames()
        self.names.new(COMPUTER)
        self.threads = {
            id(one): self.names.new(ros_name(one.name)) for group in system.groups for one in group.callbacks
        }
        self.executor_of: dict[int, str] = {}

    def document(self) -> dict[str, Any]:
        """The problem file as plain data.

        Problem file with threads, connections, executors and flows; figures that the source does not have are listed as
        assumptions.
        """
        executors = dict(self._executors())
        threads = dict(self._threads())
        connections = dict(self._connections())
        cores = self._cores()
        has_times = all(one.durations_ns for group in self.system.groups for one in group.callbacks)
        missing = [name for name, body in connections.items() if "from" not in body and "rate" not in body]
        source = f"{self.file.path.name} ({self.kind})"
        document: dict[str, Any] = {
            "dse": 1,
            "name": self.file.path.stem,
            "source": source,
            "assumptions": [
                *([] if has_times else [NO_TIMES]),
                "MISSING: sizes of messages, and what carries them. Without a `bus` they cost nothing.",
            ],
            "processor_types": {f"{COMPUTER}_type": {"cores": cores, "source": self._cores_source()}},
            "processors": {COMPUTER: {"type": f"{COMPUTER}_type"}},
        }
        if executors:
            document["executors"] = executors
        document["threads"] = threads
        if connections:
            document["connections"] = connections
        flows = {name: {"path": self._path(path), "source": self._at(place)} for name, (place, path) in self._flows()}
        if flows:
            document["flows"] = flows
        if uncertain := dict(self._uncertainty()):
            document["uncertainty"] = uncertain
        document["ros2"] = self._mapping()
        if missing:
            document["assumptions"].append(
                f"MISSING: how often these come from outside, a `rate` each (or --rate): {', '.join(missing)}."[:900]
            )
        return document

    def imported(self) -> Imported:
        """The document with the remarks on the file, and what its parts are in ROS."""
        return Imported(self.document(), tuple(self.file.remarks), self.places, self.entities())

    def entities(self) -> dict[str, str]:
        """The ROS name of each thread's callback: ``/node@Timer(PERIOD)`` or ``/node@Subscription(/topic)``.

        UniqueNames of threads to texts, for matching two descriptions of one system.
        """
        callbacks = (one for group in self.system.groups for one in group.callbacks)
        return {self.threads[id(one)]: _entity_of(one) for one in callbacks}

    def publishers(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """The callbacks, as `entities` has them, that were seen to publish a topic, by their node and the topic."""
        publishers: dict[tuple[str, str], dict[str, None]] = {}
        for one, topic in self.system.publishes:
            publishers.setdefault((one.node, topic), {})[_entity_of(one)] = None
        return {key: tuple(entities) for key, entities in publishers.items()}

    def _at(self, place: LocatedValue, *words: str) -> str:
        text = " ".join("; ".join(word for word in words if word).split())
        line = f":{place.line}" if place.line else ""
        return f"{self.file.path.name}{line}{f': {text}' if text else ''}"[:900]

    def _note(self, place: LocatedValue, *key: str) -> None:
        self.places[key] = Found(str(self.file.path), place.line, place.column)

    def _cores(self) -> int:
        pinned = max((core for group in self.system.groups for core in group.cores), default=1)
        if self.cores is not None and self.cores < pinned:
            raise UsageError(f"--cores {self.cores}: the file pins a callback group to core {pinned}")
        return self.cores or max(pinned, *(cpu + 1 for cpu in self.system.cpus), 1)

    def _cores_source(self) -> str:
        if self.cores is not None:
            return "stated at the import (--cores)"
        if self.system.cpus:
            cpus = f"CPUs up to number {max(self.system.cpus)}, counted from 0"
            return f"{self.file.path.name}: {len(self.system.cpus)} seen, {cpus}; --cores says otherwise"
        return f"{self.file.path.name}: as many cores as callbacks are pinned to, at least one; --cores says otherwise"

    def _executors(self) -> Iterator[tuple[str, dict[str, Any]]]:
        for title, groups in self.system.executors:
            members = [one for group in groups for one in group.callbacks]
            if len(members) < 2 and not groups[0].is_isolated:
                continue
            name = self.names.new(ros_name(title))
            for one in members:
                self.executor_of[id(one)] = name
            group = groups[0]
            self._note(group.place, "executors", name)
            yield (
                name,
                {
                    "kind": "callback_group" if group.is_isolated else "wait_set",
                    "processor": COMPUTER,
                    **_urgency(group),
                    "source": self._at(group.place, group.id),
                },
            )

    def _threads(self) -> Iterator[tuple[str, dict[str, Any]]]:
        for group in self.system.groups:
            for one in group.callbacks:
                name = self.threads[id(one)]
                executor = self.executor_of.get(id(one))
                body: dict[str, Any] = {"process": ros_name(one.process or one.node)}
                body |= {"executor": executor} if executor else {"processor": COMPUTER}
                if one.period_ns is not None:
                    body |= {"dispatch_protocol": "periodic", "period": format_duration(one.period_ns)}
                else:
                    body["dispatch_protocol"] = "periodic" if one.is_open else "aperiodic"
                if one.joins:
                    body["join"] = "all"
                    body["dispatch_protocol"] = "hybrid" if one.period_ns is not None else "aperiodic"
                what = f"timer of {one.node}" if one.period_ns is not None else f"{one.node}, on {one.topic}"
                what = f"{one.node}, MISSING: its `period`" if one.is_open else what
                if one.durations_ns:
                    body["compute_execution_time"] = _range(one.durations_ns)
                    what += f"; execution times measured, {len(one.durations_ns)} samples"
                body["source"] = self._at(one.place, what, one.words)
                self._note(one.place, "threads", name)
                yield name, body

    def _uncertainty(self) -> Iterator[tuple[str, dict[str, str]]]:
        """The uncertainty of the longest execution times, from the distribution of measured ones."""
        for group in self.system.groups:
            for one in group.callbacks:
                times = one.durations_ns
                if len(times) > 1 and min(times) < max(times):
                    yield (
                        f"threads.{self.threads[id(one)]}.compute_execution_time.max",
                        {
                            "distribution": "normal",
                            "mean": format_duration(round(mean(times))),
                            "deviation": format_duration(max(1, round(stdev(times)))),
                            "range": _range(times),
                        },
                    )

    def _connections(self) -> Iterator[tuple[str, dict[str, Any]]]:
        self.wire_names: dict[int, str] = {}
        for wire in self.system.wires:
            name = self.names.new(ros_name(wire.name))
            self.wire_names[id(wire)] = name
            body: dict[str, Any] = {}
            if wire.source is not None:
                body["from"] = self.threads[id(wire.source)]
            body["to"] = self.threads[id(wire.target)]
            stated = wire.rate or self.rate
            if wire.source is None and stated is not None:
                body["rate"] = stated
            if wire.is_kept and not wire.dispatches:
                body["port"] = "data"
            how = "rate measured" if wire.rate else "rate stated at the import"
            body["source"] = self._at(wire.place, wire.words, how if "rate" in body else "")
            self._note(wire.place, "connections", name)
            yield name, body

    def _flows(self) -> Iterator[tuple[str, tuple[LocatedValue, list[Callback | Message]]]]:
        names = UniqueNames()
        for name, path in self.system.flows.items():
            yield names.new(ros_name(name)), path

    def _path(self, path: list[Callback | Message]) -> list[str]:
        """Threads by name; between two of them the connection where there are several."""
        return [self.wire_names[id(item)] if isinstance(item, Message) else self.threads[id(item)] for item in path]

    def _mapping(self) -> dict[str, Any]:
        """How threads, nodes and groups are called in ROS."""
        callbacks = [one for group in self.system.groups for one in group.callbacks]
        nodes = {self.threads[id(one)] if one.process else ros_name(one.node): one.node for one in callbacks}
        mapping: dict[str, Any] = {"nodes": {name: node for name, node in nodes.items() if NODE.fullmatch(node)}}
        stated = [(self.threads[id(one)], *one.parameter) for one in callbacks if one.parameter is not None]
        if stated:
            mapping["parameters"] = {f"{thread}.{field}": text for thread, field, text in stated}
        groups = {}
        for _, members in self.system.executors:
            group = members[0]
            if group.id:
                groups[self.executor_of[id(group.callbacks[0])]] = self._pattern(group)
        return {**mapping, **({"callback_groups": groups} if groups else {})}

    def _pattern(self, group: Group) -> str:
        """The id of a group with the names of its timers' threads where their periods stand."""
        text = group.id
        for one in group.callbacks:
            if one.period_ns is not None:
                text = text.replace(f"@Timer({one.period_ns})", f"@Timer({{{self.threads[id(one)]}}})", 1)
        return text


def _range(times: Sequence[int]) -> str:
    return format_time_range(TimeRange(min(times), max(times)))


def _urgency(group: Group) -> dict[str, Any]:
    """Priority and cores of the OS thread of a callback group; nothing where several share one."""
    if not group.is_isolated:
        return {}
    fields: dict[str, Any] = {} if group.priority is None else {"priority": group.priority}
    return fields | {"core": (list(group.cores) if len(group.cores) > 1 else group.cores[0]) if group.cores else "any"}
