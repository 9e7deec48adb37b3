"""Several sources that make one problem: the structure from one, figures from others.

The rule: files count in the order in which they are named. The first one that has the callbacks of a node says which
there are, and what they send and receive; the first one that states a figure says it. A later file adds what the
earlier ones leave open, and nodes that they do not have. Where two files differ both are told, with their sources.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dse.importers.registry import Imported
from dse.importers.ros2.matching import Match, matched, node_of
from dse.importers.ros2.system import NODE
from dse.importers.ros2.yaml_places import UniqueNames, ros_name
from dse.support.errors import Diagnostic

SECTIONS = (
    *("processor_types", "bus_types", "device_types", "thread_types", "clocks", "partitions", "processors", "buses"),
    *("devices", "executors", "threads", "connections", "flows"),
)
NAMED_TOGETHER = ("processors", "buses", "devices", "threads", "connections")
"""Sections whose names differ from each other."""
NOT_FIGURES = ("source",)
NO_TIMES = "MISSING: execution times"
NO_RATES = "MISSING: how often"
LONGEST = 900
OPEN_TOPICS = "who publishes the topics is not in such files"


def merged(first: Imported, second: Imported) -> Imported:
    """One document of two; the first one counts where they differ, with a remark.

    Parameters
    ----------
    first, second
        what two importers made of their files.
    """
    merger = _Merger(first, second, matched(first, second))
    document = merger.document()
    entities = {**first.entities, **merger.entities, **merger.restated_entities()}
    entities = {name: text for name, text in entities.items() if name in (document.get("threads") or {})}
    remarks = (*_open(first, document), *_open(second, document), *merger.match.told, *merger.told)
    aliases = {**merger.names["threads"], **first.aliases}
    places = {**second.places, **first.places}
    made_up = first.made_up | second.made_up
    publishers = {**second.publishers, **first.publishers}
    return Imported(
        *(document, tuple(dict.fromkeys(remarks)), places, entities, made_up, aliases, publishers),
        is_own=first.is_own,
    )


def _open(imported: Imported, document: Mapping[str, Any]) -> Iterable[Diagnostic]:
    """The remarks of one source without those on who publishes topics, where another source says it of all."""
    connections = (document.get("connections") or {}).values()
    is_known = all("from" in body for body in connections)
    return (item for item in imported.remarks if not (is_known and OPEN_TOPICS in item.message))


def _restated(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document with what is missing named anew: execution times, and how often connections from outside come."""
    threads, connections = document.get("threads") or {}, document.get("connections") or {}
    kept = [text for text in document.get("assumptions") or () if not text.startswith((NO_TIMES, NO_RATES))]
    types = document.get("thread_types") or {}
    untimed = [name for name, body in threads.items() if not _is_timed(body, types)]
    if threads and len(untimed) == len(threads):
        words = "Threads without `compute_execution_time` count as taking no time: measure them, and import again"
        kept.insert(0, f"{NO_TIMES}. {words} with --times, or state them.")
    elif untimed:
        kept.insert(0, f"{NO_TIMES} of {', '.join(untimed)}. They count as taking no time."[:LONGEST])
    open_ = [name for name, body in connections.items() if "from" not in body and not {"rate", "data_rate"} & set(body)]
    if open_:
        kept.append(f"{NO_RATES} these come from outside, a `rate` each (or --rate): {', '.join(open_)}."[:LONGEST])
    restated = {key: value for key, value in document.items() if key != "assumptions"}
    if not kept:
        return restated
    order: dict[str, Any] = {}
    for key, value in restated.items():
        order[key] = value
        if key == ("source" if "source" in restated else "name"):
            order["assumptions"] = kept
    return order


def _is_timed(body: Mapping[str, Any], types: Mapping[str, Any]) -> bool:
    of = body.get("type")
    names = of if isinstance(of, list) else [of] if of is not None else []
    return "compute_execution_time" in body or any("compute_execution_time" in types.get(name, {}) for name in names)


def _is_option(key: str, ours: Any, theirs: Any) -> bool:
    """Whether a figure is among those that a problem file decides between, or a number of cores that it exceeds."""
    if key == "cores":
        return isinstance(ours, int) and ours > theirs
    return isinstance(ours, list) and theirs in ours


@dataclass
class _Merger:
    """Puts a second document into a first one."""

    first: Imported
    second: Imported
    match: Match
    told: list[Diagnostic] = field(default_factory=list)
    entities: dict[str, str] = field(default_factory=dict)
    names: dict[str, dict[str, str]] = field(default_factory=lambda: {section: {} for section in SECTIONS})

    @property
    def is_overruled(self) -> bool:
        """Whether what the second document saw counts more than what the first one says."""
        return self.second.is_measured and not (self.first.is_measured or self.first.is_own)

    def restated_entities(self) -> dict[str, str]:
        """The ROS names of the threads of both documents, where the second one counts more."""
        if not self.is_overruled:
            return {}
        return {
            self.match.threads[name]: text for name, text in self.second.entities.items() if name in self.match.threads
        }

    def document(self) -> dict[str, Any]:
        """The document of both descriptions as one."""
        ours, theirs = dict(self.first.document), self.second.document
        self._rename(ours, theirs)
        document = {key: value for key, value in ours.items() if key not in SECTIONS}
        for key, value in theirs.items():
            if key not in SECTIONS:
                document[key] = self._top(key, document.get(key), value)
        parts = {section: self._section(section) for section in SECTIONS}
        order = [key for key in (*ours, *theirs, *SECTIONS) if key in SECTIONS and parts[key]]
        head = {key: value for key, value in document.items() if key not in AFTER}
        tail = {key: value for key, value in document.items() if key in AFTER}
        if "ros2" in tail and "nodes" in tail["ros2"]:
            tail["ros2"]["nodes"] = self._nodes(tail["ros2"]["nodes"], parts["threads"])
        return _restated({**head, **{key: parts[key] for key in dict.fromkeys(order)}, **tail})

    def _rename(self, ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> None:
        """Names of the second document that are to be new."""
        self.names["threads"] = dict(self.match.threads)
        self.names["connections"] = dict(self.match.connections)
        self.names["executors"] = dict(self.match.executors)
        self.names["processors"] = dict(self.match.processors)
        self.names["processor_types"] = dict(self.match.processor_types)
        taken = UniqueNames()
        taken.taken = {name for section in NAMED_TOGETHER for name in ours.get(section) or {}}
        for section in NAMED_TOGETHER:
            for name in theirs.get(section) or {}:
                if name in self.names[section] or name in self.match.left_out:
                    continue
                is_same = name in (ours.get(section) or {}) and section not in ("threads", "connections")
                is_same = is_same and name not in self.first.made_up & self.second.made_up
                self.names[section][name] = name if is_same else taken.new(name)
        types = UniqueNames()
        types.taken = {*(ours.get("bus_types") or {})}
        for name in theirs.get("bus_types") or {}:
            if name in self.first.made_up & self.second.made_up:
                self.names["bus_types"][name] = types.new(name)
        others = UniqueNames()
        others.taken = {*(ours.get("executors") or {})}
        for name in theirs.get("executors") or {}:
            if name not in self.names["executors"] and name not in self.match.left_out_executors:
                self.names["executors"][name] = others.new(name)
        self.entities = {
            self.names["threads"][name]: text
            for name, text in self.second.entities.items()
            if name in self.names["threads"] and self.names["threads"][name] not in self.first.entities
        }

    # --- sections

    def _section(self, section: str) -> dict[str, Any]:
        entries = {name: dict(body) for name, body in (self.first.document.get(section) or {}).items()}
        if section == "threads":
            entries = {name: body for name, body in entries.items() if name not in self.match.replaced}
        if section == "connections":
            entries = dict(self._succeeded(entries))
        if section == "flows":
            return self._flows(entries)
        for name, body in (self.second.document.get(section) or {}).items():
            if section in ("threads", "connections", "executors") and name not in self.names[section]:
                continue
            own = self.names[section].get(name, name)
            body = self._referring(section, body)
            if own in entries:
                entries[own] = self._entry(f"{section}.{own}", entries[own], body)
            else:
                entries[own] = {**body, **self._inherited(section, name)}
        if section == "threads":
            entries = {name: self._bound(name, body) for name, body in entries.items()}
        return entries

    def _succeeded(self, connections: Mapping[str, dict[str, Any]]) -> Iterable[tuple[str, dict[str, Any]]]:
        """The first document's connections, with what the second one has in place of nodes without callbacks."""
        for name, body in connections.items():
            gone = [key for key in ("from", "to") if body.get(key) in self.match.replaced]
            heirs = {key: self.match.successors.get(body[key]) for key in gone}
            if None in heirs.values():
                words = f"the connection {name} is left out: which callback has it is not known"
                self._tell(words, str(body.get("source", "")))
                continue
            yield name, {**body, **{key: self.names["threads"][str(heir)] for key, heir in heirs.items()}}

    def _flows(self, flows: dict[str, Any]) -> dict[str, Any]:
        names = UniqueNames()
        names.taken = set(flows)
        for name, body in (self.second.document.get("flows") or {}).items():
            path = [self._step(item) for item in body["path"]]
            if None in path:
                words = f"the flow {name} is left out: something on its way is not in the files named before"
                self._tell(words, str(body.get("source", "")))
            elif all(path != known["path"] for known in flows.values()):
                flows[names.new(name)] = {**body, "path": path}
        return flows

    def _step(self, item: Any) -> Any:
        name = item["element"] if isinstance(item, dict) else item
        own = self._name_of(name)
        return None if own is None else {**item, "element": own} if isinstance(item, dict) else own

    def _name_of(self, name: str) -> str | None:
        for section in ("threads", "devices", "connections"):
            if name in self.names[section]:
                return self.names[section][name]
        return None

    def _referring(self, section: str, body: Mapping[str, Any]) -> dict[str, Any]:
        """An entry of the second document with the names that are now those of what it refers to."""
        entry = dict(body)
        if section == "connections":
            for key in ("from", "to"):
                if key in entry:
                    entry[key] = self._name_of(entry[key]) or entry[key]
            if "bus" in entry:
                buses = self.names["buses"]
                of = entry["bus"]
                entry["bus"] = [buses.get(one, one) for one in of] if isinstance(of, list) else buses.get(of, of)
        if section in ("threads", "executors") and isinstance(entry.get("processor"), str):
            entry["processor"] = self.names["processors"].get(entry["processor"], entry["processor"])
        if section == "processors" and isinstance(entry.get("type"), str):
            entry["type"] = self.names["processor_types"].get(entry["type"], entry["type"])
        if section == "buses" and isinstance(entry.get("type"), str):
            entry["type"] = self.names["bus_types"].get(entry["type"], entry["type"])
        if section == "threads":
            if "executor" in entry:
                executor = self.names["executors"].get(entry.pop("executor"))
                entry |= {"executor": executor} if executor else {}
            if "dispatch_trigger" in entry:
                entry["dispatch_trigger"] = [
                    self.names["connections"].get(one, one) for one in entry["dispatch_trigger"]
                ]
        return entry

    def _inherited(self, section: str, name: str) -> dict[str, Any]:
        """The fields of the first document for a node whose callbacks only the second one has."""
        if section != "threads" or name not in self.match.heirs:
            return {}
        body = self.first.document["threads"][self.match.heirs[name]]
        return {key: body[key] for key in ("process", "executor") if key in body}

    def _bound(self, name: str, body: dict[str, Any]) -> dict[str, Any]:
        """A thread of an executor runs where that runs."""
        executor = self.match.joined.get(name)
        if executor is not None and "executor" not in body:
            body = {**body, "executor": self.names["executors"][executor]}
        process = self.match.processes.get(name)
        if process is not None:
            body = {**body, "process": process}
        if "executor" in body:
            body = {key: value for key, value in body.items() if key != "processor"}
        return body

    def _entry(self, path: str, ours: dict[str, Any], theirs: Mapping[str, Any]) -> dict[str, Any]:
        """An entry that both documents have, with the fields that the first one does not state."""
        is_thread, is_wire = path.startswith("threads."), path.startswith("connections.")
        merged, taken = dict(ours), []
        for key, value in theirs.items():
            if key in NOT_FIGURES or (is_thread and key in ("process", "executor", "processor")):
                continue
            if is_wire and key == "rate" and "from" in merged:
                continue
            if key not in merged:
                merged[key] = value
                taken.append(key)
            elif merged[key] != value and key == "cores" and not self.first.is_own:
                merged |= {"cores": max(merged[key], value)}
                merged |= {"source": theirs["source"]} if value > ours[key] and "source" in theirs else {}
            elif merged[key] != value and key == "period" and is_thread and self.is_overruled:
                merged[key] = value
                taken.append(key)
                self._differ(f"{path}.{key}", ours[key], ours, value, theirs, "the trace counts")
            elif merged[key] != value and not _is_option(key, merged[key], value):
                self._differ(f"{path}.{key}", merged[key], ours, value, theirs)
        if is_wire and "from" in taken and "rate" in merged:
            words = f"{path}.rate is left out ({merged.pop('rate')}): {merged['from']} sends it"
            self._tell(words, str(ours.get("source", "")))
        if taken and theirs.get("source"):
            parts = (ours.get("source", ""), f"{', '.join(taken)}: {theirs['source']}")
            merged["source"] = "; ".join(part for part in parts if part)[:LONGEST]
        return merged

    # --- the rest

    def _top(self, key: str, ours: Any, theirs: Any) -> Any:
        """A key of the whole document."""
        if key == "ros2":
            return self._mapping(ours or {}, theirs)
        if key == "uncertainty":
            return {**dict(self._uncertain(theirs)), **(ours or {})}
        if ours is None:
            return theirs
        if key in ("dse", "name"):
            return ours
        if key == "source":
            return "; ".join(dict.fromkeys([*str(ours).split("; "), *str(theirs).split("; ")]))[:LONGEST]
        if isinstance(ours, list) and isinstance(theirs, list):
            return [*ours, *(item for item in theirs if item not in ours)]
        if isinstance(ours, dict) and isinstance(theirs, dict):
            return {**theirs, **ours}
        if ours != theirs:
            self._differ(key, ours, self.first.document, theirs, self.second.document)
        return ours

    def _mapping(self, ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> dict[str, Any]:
        """The names in ROS of both documents, merged."""
        threads = (self.second.document.get("threads") or {}) if theirs else {}
        processes = {str(body.get("process")) for body in threads.values()}
        merged = {key: dict(value) if isinstance(value, dict) else value for key, value in ours.items()}
        renames: Mapping[str, Callable[[str], str | None]] = {
            "nodes": lambda key: key if key in processes and key not in threads else self._name_of(key),
            "parameters": self._parameter,
            "callback_groups": lambda key: self.names["executors"].get(key) or self._name_of(key),
        }
        for part, renamed in renames.items():
            entries = merged.setdefault(part, {})
            for key, text in (theirs.get(part) or {}).items():
                own = renamed(key)
                if own is not None:
                    entries.setdefault(own, self._with_threads(text) if part == "callback_groups" else text)
            if not entries:
                del merged[part]
        return merged

    def _nodes(self, stated: Mapping[str, str], threads: Mapping[str, Any]) -> dict[str, str]:
        """The node of each process, or of each thread where a process has several."""
        nodes: dict[str, str] = {}
        known = {**self.first.entities, **self.entities}
        of_ros = {name: node_of(text) for name, text in known.items() if name in threads}
        for name, node in of_ros.items():
            process = threads[name].get("process")
            if not NODE.fullmatch(node):
                continue
            nodes[process if process == ros_name(node) else name] = node
        others = {name for name in threads if name not in of_ros}
        processes = {threads[name].get("process") for name in others}
        return nodes | {name: node for name, node in stated.items() if name in others | processes}

    def _parameter(self, key: str) -> str | None:
        thread, _, name = key.rpartition(".")
        own = self.names["threads"].get(thread)
        return None if own is None else f"{own}.{name}"

    def _with_threads(self, text: str) -> str:
        """The id of a callback group with the names of its timers' threads."""
        for name, own in self.names["threads"].items():
            text = text.replace(f"{{{name}}}", f"{{{own}}}")
        return text

    def _uncertain(self, theirs: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
        """The uncertainties of figures that come from the second document."""
        for path, body in theirs.items():
            section, _, rest = path.partition(".")
            name = next((item for item in self.names.get(section, {}) if rest.startswith(f"{item}.")), None)
            if name is None:
                if section not in ("threads", "connections"):
                    yield path, body
                continue
            own, key = self.names[section][name], rest.removeprefix(f"{name}.")
            stated = (self.first.document.get(section) or {}).get(own, {})
            if key.partition(".")[0] not in stated:
                yield f"{section}.{own}.{key}", body

    def _differ(
        self,
        path: str,
        ours: Any,
        of_ours: Mapping[str, Any],
        theirs: Any,
        of_theirs: Mapping[str, Any],
        counts: str = "the file that is named first counts",
    ) -> None:
        first, second = (str(of.get("source", "")) or "no source" for of in (of_ours, of_theirs))
        mine, other = (", ".join(map(str, value)) if isinstance(value, list) else value for value in (ours, theirs))
        words = f"{path}: {mine} ({first[:200]}), but {other} ({second[:200]}): {counts}"
        self._tell(words)

    def _tell(self, words: str, source: str = "") -> None:
        self.told.append(Diagnostic(f"{words}{f' ({source[:200]})' if source else ''}", severity="warning"))


AFTER = ("metrics", "requirements", "rules", "objectives", "baseline", "cost_of_change", "uncertainty", "ros2")
