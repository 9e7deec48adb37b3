"""The document of a problem from the design files of an Autoware system.

A process is a thread for each way in which it starts, a compute unit a processor, a node a process of the operating
system with one executor; the nodes of a container that has one thread share its executor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from dse.importers.allowance import TooMuchError, allowed
from dse.importers.autoware.entities import KINDS, Library, Part, in_mode
from dse.importers.autoware.processes import ThreadOfProcess, threads_of
from dse.importers.autoware.tree import PUBLISHER, NodeInstance, Tree, tree_of
from dse.importers.registry import Imported, Key, Place
from dse.importers.ros2.system import COMPUTER, NO_TIMES, NODE, stated_options
from dse.importers.ros2.yaml_places import UniqueNames, ros_name
from dse.support.errors import Diagnostic, ProblemError
from dse.support.units import format_duration

ONE_THREAD = ("ros2_component_container", "ros2_component_container_ipc")
SEVERAL_THREADS = tuple(f"{name.removesuffix('_ipc')}_mt{'_ipc' * name.endswith('_ipc')}" for name in ONE_THREAD)


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the problem that a system, module or node is.

    Raises
    ------
    ProblemError
        with every mistake of the file, and its line.
    UsageError
        when an option is wrong.
    """
    try:
        with allowed():
            library = Library(path, options.get("workspace"))
            entity = library.main()
            mode = in_mode(entity, options.get("mode")) if entity.kind == KINDS[-1] or "mode" in options else ""
            tree = tree_of(library, entity)
            writer = _Writer(path, tree, entity.entries("node_groups"), options)
            document = writer.document(mode)
    except TooMuchError as error:
        raise ProblemError([Diagnostic(str(error), "", str(path), 1)]) from None
    remarks = dict.fromkeys(remark for file in library.files for remark in file.remarks)
    return Imported(document, tuple(remarks), writer.places)


@dataclass(eq=False)
class _Thread:
    """A thread of the document: its name, its node, and what it is there."""

    name: str
    node: NodeInstance
    part: ThreadOfProcess


class _Writer:
    """Makes the document; `places` tell where its parts come from."""

    def __init__(self, path: Path, tree: Tree, groups: list[Part], options: Mapping[str, Any]) -> None:
        self.path, self.tree, self.groups = path, tree, groups
        self.cores, self.rate = stated_options(options)
        self.places: dict[Key, Place] = {}
        self.names = UniqueNames()
        self.units = {unit: self.names.new(ros_name(unit) if unit else COMPUTER) for unit in self._units()}
        self.arriving: dict[str, dict[str, list[tuple[str, str, Part]]]] = {}
        for at, node in tree.nodes.items():
            for port in node.entity.entries("publishers"):
                for (target, _, name), place in tree.reached((at, PUBLISHER, port.text("name"))):
                    self.arriving.setdefault(target, {}).setdefault(name, []).append((at, port.text("name"), place))
        self.containers = dict(self._containers())
        self.threads: dict[str, list[_Thread]] = {}
        for at, node in tree.nodes.items():
            threads = [
                one for item in node.entity.entries("processes") for one in threads_of(item, self._connected(at))
            ]
            self.threads[at] = [_Thread(self.names.new(ros_name(f"{at}/{one.name}")), node, one) for one in threads]
            if not threads:
                node.place.remark(f"{at} has no process that starts again and again: it is no thread")

    def document(self, mode: str) -> dict[str, Any]:
        """The problem file as plain data."""
        executors = dict(self._executors())
        threads = dict(self._threads(executors))
        connections = dict(self._connections())
        missing = [name for name, body in connections.items() if "from" not in body and "rate" not in body]
        words = f"{self.path.name} (Autoware system design{f', mode {mode}' if mode else ''})"
        cores = "stated at the import (--cores)" if self.cores is not None else "MISSING: how many; --cores states it"
        kinds = {f"{name}_type": {"cores": self.cores or 1, "source": cores} for name in self.units.values()}
        document: dict[str, Any] = {
            "dse": 1,
            "name": self.path.name.rsplit(".", 2)[0],
            "source": words,
            "assumptions": [
                NO_TIMES,
                "MISSING: sizes of messages, and what carries them. Without a `bus` they cost nothing.",
                *([] if self.cores is not None else [f"MISSING: the cores of {', '.join(self.units.values())}."[:900]]),
            ],
            "processor_types": kinds,
            "processors": {name: {"type": f"{name}_type"} for name in self.units.values()},
        }
        document |= {"executors": executors} if executors else {}
        document["threads"] = threads
        document |= {"connections": connections} if connections else {}
        nodes = {self.process_of(at): at for at in self.tree.nodes if at not in self.containers and NODE.fullmatch(at)}
        used = {body["process"] for body in threads.values()}
        document["ros2"] = {"nodes": {name: node for name, node in nodes.items() if name in used}}
        if missing:
            document["assumptions"].append(
                f"MISSING: how often these come from outside, a `rate` each (or --rate): {', '.join(missing)}."[:900]
            )
        if not self.tree.is_whole:
            document["assumptions"].append(
                "MISSING: instances or connections that could not be read; see the warnings."
            )
        return document

    # --- where it runs

    def _units(self) -> list[str]:
        return list(dict.fromkeys(node.unit for node in self.tree.nodes.values())) or [""]

    def process_of(self, at: str) -> str:
        """The process of a node: its container, else a process of its own."""
        return ros_name(self.containers.get(at, (at, ""))[0])

    def _containers(self) -> Iterator[tuple[str, tuple[str, str]]]:
        """The container of each node in one, with its type."""
        seen: set[str] = set()
        for item in self.groups:
            name, kind = item.text("name"), item.text("type")
            patterns = [one.text.rstrip("/") for one in item.value["nodes"]]
            inside = [at for at in self.tree.nodes if any(_is_in(at, pattern) for pattern in patterns)]
            units = {self.tree.nodes[at].unit for at in inside}
            if not name or kind not in (*ONE_THREAD, *SEVERAL_THREADS) or len(units) > 1:
                why = "its nodes are on several compute units" if len(units) > 1 else f"its type is {kind[:40]!r}"
                item.remark(f"the node group {name[:60]} is left out: {why}", f"{', '.join(ONE_THREAD)} or with _mt")
                continue
            if kind in SEVERAL_THREADS and inside:
                item.remark(f"{name} has several threads: it counts as a thread for each of its nodes")
            for at in inside:
                if at not in seen:
                    seen.add(at)
                    yield at, (f"/{name.strip('/')}", kind)

    def _home(self, at: str) -> str:
        """The path of what has the executor of a node: a container of one thread, else the node itself."""
        container, kind = self.containers.get(at, (at, ""))
        return container if kind in ONE_THREAD else at

    def _executors(self) -> Iterator[tuple[str, dict[str, Any]]]:
        self.executor_of: dict[str, str] = {}
        members: dict[str, list[str]] = {}
        for at, threads in self.threads.items():
            members.setdefault(self._home(at), []).extend(at for _ in threads)
        for home, nodes in members.items():
            if len(nodes) > 1:
                name = self.names.new(ros_name(home))
                self.executor_of |= dict.fromkeys(nodes, name)
                node = self.tree.nodes[nodes[0]]
                self._note(node.place, "executors", name)
                body = {"kind": "wait_set", "processor": self.units[node.unit], "source": self._at(node.place)}
                yield name, body

    def _threads(self, executors: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
        for at, threads in self.threads.items():
            for one in threads:
                part, executor = one.part, self.executor_of.get(at)
                body: dict[str, Any] = {"process": self.process_of(at)}
                body |= {"executor": executor} if executor in executors else {"processor": self.units[one.node.unit]}
                protocol = "aperiodic" if part.causes else "periodic"
                body["dispatch_protocol"] = "hybrid" if part.causes and part.period_ns is not None else protocol
                body |= {} if part.period_ns is None else {"period": format_duration(part.period_ns)}
                body |= {"join": "all"} if part.joins else {}
                if len(part.causes) > 1 and not part.joins:
                    body["join"] = "any"
                body["source"] = self._at(part.place, f"process {part.process} of {at}")
                self._note(part.place, "threads", one.name)
                yield one.name, body

    # --- what leads where

    def _connected(self, at: str) -> tuple[str, ...]:
        """The input ports of a node that some node publishes to."""
        return tuple(self.arriving.get(at, {}))

    def _publishing(self, at: str, port: str) -> list[_Thread]:
        """The threads of a node that publish by a port: those that say so, else the only one."""
        own = self.threads[at]
        stated = [one for one in own if port in one.part.outputs]
        if not stated and len(own) == 1 and not own[0].part.outputs:
            own[0].part.place.remark(f"{own[0].name} is taken for what publishes {port}, of which no process says it")
            return own
        if not stated and own:
            own[0].part.place.remark(f"nothing says which process of {at} publishes {port}: it is left out")
        return stated

    def _connections(self) -> Iterator[tuple[str, dict[str, Any]]]:
        for at, threads in self.threads.items():
            ports = self.arriving.get(at, {})
            for one in threads:
                for kind, what in one.part.causes:
                    yield from self._caused(one, kind, what, ports, "")
                for kind, what in one.part.reads:
                    yield from self._caused(one, kind, what, ports, "data")
            yield from self._read_by_others(threads, ports)

    def _caused(
        self, one: _Thread, kind: str, what: str, ports: Mapping[str, list[tuple[str, str, Part]]], port: str
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """The connections by which an input, or another process of its node, starts a thread, or leaves data for it."""
        if kind == "on_input":
            return self._to(one, what, ports.get(what, []), port=port)
        return self._after(one, what, port)

    def _read_by_others(
        self, threads: list[_Thread], ports: Mapping[str, list[tuple[str, str, Part]]]
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """Inputs that start no process: the only thread of the node reads them when it runs."""
        used = {what for one in threads for kind, what in one.part.causes if kind == "on_input"}
        used |= {what for one in threads for kind, what in one.part.reads if kind == "on_input"}
        for name, sources in ports.items():
            if name in used or not threads:
                continue
            if len({one.part.process for one in threads}) == 1:
                yield from self._to(threads[0], name, sources, port="data")
            else:
                at = threads[0].node.path
                sources[0][2].remark(f"nothing says which process of {at} reads {name}: it is left out")

    def _to(
        self, one: _Thread, name: str, sources: list[tuple[str, str, Part]], *, port: str
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """The connections to an input of a thread, or that from outside where nothing leads there."""
        if not sources:
            if port:
                return  # it lies there from the beginning on
            wire = self.names.new(ros_name(f"{one.node.path}/{name}"))
            body: dict[str, Any] = {"to": one.name} | ({"rate": self.rate} if self.rate is not None else {})
            body["source"] = self._at(one.part.place, f"input {name}: nothing in the design leads to it")
            self._note(one.part.place, "connections", wire)
            yield wire, body
        for at, output, place in sources:
            for sender in self._publishing(at, output):
                wire = self.names.new(ros_name(f"{sender.node.path}/{output}/to/{one.name}"))
                body = {"from": sender.name, "to": one.name} | ({"port": port} if port else {})
                body["source"] = self._at(place, f"{output} to {name}")
                self._note(place, "connections", wire)
                yield wire, body

    def _after(self, one: _Thread, process: str, port: str) -> Iterator[tuple[str, dict[str, Any]]]:
        """The connections from the threads of a process of the node that starts this one, or leaves data for it."""
        senders = [other for other in self.threads[one.node.path] if other.part.process == process]
        if not senders and port:
            return
        if not senders:
            one.part.place.remark(f"{one.name} starts after {process[:80]}, which is no process of its node that runs")
            wire = self.names.new(ros_name(f"{one.node.path}/{process}"))
            yield wire, {"to": one.name, "source": self._at(one.part.place, f"after {process}")}
        for sender in senders:
            wire = self.names.new(ros_name(f"{sender.name}/to/{one.part.name}"))
            body = {"from": sender.name, "to": one.name} | ({"port": port} if port else {})
            body["source"] = self._at(one.part.place, f"after {process}")
            self._note(one.part.place, "connections", wire)
            yield wire, body

    # --- places

    def _at(self, place: Part, words: str = "") -> str:
        text = " ".join(words.split())
        return f"{place.file.path.name}:{place.value.line}{f': {text}' if text else ''}"[:900]

    def _note(self, place: Part, *key: str) -> None:
        self.places[key] = Place(str(place.file.path), place.value.line, place.value.column)


def _is_in(path: str, pattern: str) -> bool:
    """Whether a node group names a node: by a pattern, or a path that it is below."""
    if any(mark in pattern for mark in "*?["):
        return fnmatchcase(path, pattern)
    return path.startswith(f"{pattern}/") or path == pattern
