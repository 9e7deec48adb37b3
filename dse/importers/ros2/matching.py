"""Which callback, connection and executor of one description of a ROS 2 system is which of another one.

Callbacks are the same where they are the same in ROS: of one node, and for one topic or of one period, or each the only
timer of the node. Anything else is the same by its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dse.importers.registry import STORED_PORTS, Imported
from dse.importers.ros2.yaml_places import ros_name
from dse.support.errors import Diagnostic
from dse.support.timelimit import in_time
from dse.support.units import format_duration, parse_period_ns

BARE = {"process", "processor", "executor", "dispatch_protocol", "source"}
MOST_TOLD, MOST_NODES = 500, 8


@dataclass
class Match:
    """The correspondence between the elements of two documents.

    `threads`, `connections`, `executors`, `processors`, `processor_types`: by the name in the second one that in the
    first. `left_out` and
    `left_out_executors` are names of the second one of what the first one does not have, and says all of. `replaced`
    are threads of the first one of which nothing but their node is known; `heirs` those of the second one in their
    place, `successors` by the replaced thread what sends in its place (a timer, or the only one). `joined`:
    threads of the first one to executors of the second; `processes`: their processes.
    """

    threads: dict[str, str] = field(default_factory=dict)
    connections: dict[str, str] = field(default_factory=dict)
    executors: dict[str, str] = field(default_factory=dict)
    processors: dict[str, str] = field(default_factory=dict)
    processor_types: dict[str, str] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)
    left_out_executors: set[str] = field(default_factory=set)
    replaced: set[str] = field(default_factory=set)
    heirs: dict[str, str] = field(default_factory=dict)
    successors: dict[str, str] = field(default_factory=dict)
    joined: dict[str, str] = field(default_factory=dict)
    processes: dict[str, str] = field(default_factory=dict)
    told: list[Diagnostic] = field(default_factory=list)


def matched(first: Imported, second: Imported) -> Match:
    """Match the elements of a second document to those of a first one.

    A `Match`: names of threads, connections, executors and processes of `second` to those of `first`, and remarks on
    what has no counterpart.
    """
    match = Match()
    ours, theirs = _of(first, "threads"), _of(second, "threads")
    _threads(match, first, second)
    for name in theirs:
        if name not in second.entities and name in ours:
            match.threads[name] = name
    _connections(match, first, second)
    _processors(match, first, second)
    _executors(match, first, second)
    _processes(match, first, second)
    if (remark := _added(match, first, second)) is not None:
        match.told.append(remark)
    return match


def _processors(match: Match, first: Imported, second: Imported) -> None:
    """The one computer of a problem file is that of a description, whatever the two call it."""
    ours, theirs = _of(first, "processors"), _of(second, "processors")
    if not first.is_own or len(ours) != 1 or len(theirs) != 1:
        return
    [(own, body)], [(name, other)] = ours.items(), theirs.items()
    match.processors[name] = own
    if isinstance(body.get("type"), str) and isinstance(other.get("type"), str):
        match.processor_types[other["type"]] = body["type"]
    if own != name and second.entities:
        match.told.append(
            Diagnostic(f"{name} is taken for {own}, the computer of the problem file", severity="warning")
        )


def _of(imported: Imported, section: str) -> Mapping[str, Any]:
    return imported.document.get(section) or {}


def node_of(entity: str) -> str:
    """The node of a callback such as ``/cam@Timer(10000000)``.

    The part before ``@``.
    """
    return entity.partition("@")[0]


def _kind(entity: str) -> str:
    return entity.partition("@")[2]


def _by_node(imported: Imported) -> dict[str, list[str]]:
    by_node: dict[str, list[str]] = {}
    for name, entity in imported.entities.items():
        if name in _of(imported, "threads"):
            by_node.setdefault(node_of(entity), []).append(name)
    return by_node


def _threads(match: Match, first: Imported, second: Imported) -> None:
    ours, theirs = _by_node(first), _by_node(second)
    for node, names in in_time(theirs.items()):
        known = [name for name in ours.get(node, []) if _kind(first.entities[name])]
        open_ = [name for name in ours.get(node, []) if not _kind(first.entities[name])]
        is_question = first.is_own and not all(_is_bare(_of(first, "threads")[name]) for name in open_)
        if known:
            _same_node(match, known, names, first, second)
        elif is_question and len(open_) == len(names) == 1:
            match.threads[names[0]] = open_[0]
        elif is_question:
            _same_node(match, [], names, first, second)
        elif open_ and any(_kind(second.entities[name]) for name in names):
            match.replaced |= set(open_)
            match.heirs |= dict.fromkeys(names, open_[0])
            timers = [name for name in names if _kind(second.entities[name]).startswith("Timer")]
            sender = next((of[0] for of in (timers, names) if len(of) == 1), None)
            if sender is not None:
                match.successors |= dict.fromkeys(open_, sender)
        elif open_:
            match.threads |= dict(zip(names, open_, strict=False))


def _same_node(match: Match, known: list[str], names: list[str], first: Imported, second: Imported) -> None:
    """The callbacks of a node that both have."""
    left = list(known)
    late = []
    for name in in_time(names):
        entity = second.entities[name]
        same = [own for own in left if first.entities[own] == entity]
        if len(same) == 1:
            match.threads[name] = same[0]
            left.remove(same[0])
        else:
            late.append(name)
    timers = [name for name in late if _kind(second.entities[name]).startswith("Timer")]
    own = [name for name in left if _kind(first.entities[name]).startswith("Timer")]
    if len(timers) == len(own) == 1:
        match.threads[timers[0]] = own[0]
        late.remove(timers[0])
    for name in late:
        match.left_out.add(name)
        entity = second.entities[name]
        if _kind(entity):
            source = str(_of(second, "threads")[name].get("source", ""))[:200]
            words = f"{entity} is left out: the file named before has no such callback of {node_of(entity)} ({source})"
            hint = _key_of(entity) if first.is_own else ""
            match.told.append(Diagnostic(words, severity="warning", hint=hint))


def _key_of(entity: str) -> str:
    """The fields of a thread by which it is recognised as a callback."""
    node, kind = node_of(entity), _kind(entity)
    what = kind.partition("(")[2].rstrip(")")
    if kind.startswith("Timer"):
        period = f"{format_duration(int(what))}" if what.isdecimal() else "its period"
        return f"a thread of {node} is it with `period: {period}`, or as the only one with a `period`"
    return f"a thread of {node} is it where a connection called {ros_name(what)} ends at it"


def _is_bare(body: Mapping[str, Any]) -> bool:
    """Whether nothing is known of a thread but its node, as of nodes that a launch file starts."""
    return body.get("dispatch_protocol") == "periodic" and body.keys() <= BARE


def _added(match: Match, first: Imported, second: Imported) -> Diagnostic | None:
    """The remark on threads that a description adds; the problem file may have them already, by other names."""
    new = [name for name in second.entities if name not in match.threads and name not in match.left_out]
    new = [name for name in new if name not in match.heirs]
    if not first.is_own or not new or not _of(first, "threads"):
        return None
    nodes = list(dict.fromkeys(node_of(second.entities[name]) for name in new))
    count = f"{len(new)} threads" if len(new) > 1 else "1 thread"
    words = f"added: {count} of nodes that the problem file does not name: {', '.join(new)}"[:MOST_TOLD]
    keys = ", ".join(f"THREAD: {node}" for node in nodes[:MOST_NODES])
    hint = f"where it has them by other names: `ros2: {{nodes: {{{keys}}}}}`, with its own thread or process"
    return Diagnostic(words, hint=hint, severity="warning")


def _connections(match: Match, first: Imported, second: Imported) -> None:
    """Connections of the same ends; from outside where one of the two does not know who sends."""
    ours = {}
    for name, body in _of(first, "connections").items():
        source, target, is_data = _ends(body)
        ours[name] = (match.successors.get(source, source), match.successors.get(target, target), is_data)
    news = {*_of(second, "threads")} - {*match.threads}
    for name, body in in_time(_of(second, "connections").items()):
        source, target, is_data = _ends(body)
        if source in match.left_out or target in match.left_out:
            match.left_out.add(name)
            continue
        ends = (match.threads.get(source, source), match.threads.get(target, target), is_data)
        if target not in second.entities and source not in second.entities:
            if ours.get(name) == ends and body.get("bus") not in first.made_up & second.made_up:
                match.connections[name] = name
            continue
        taken = set(match.connections.values())
        free = [own for own in ours if own not in taken]
        same = [own for own in free if ours[own] == ends]
        if not same and target in match.threads and not is_data:
            near = [own for own in free if ours[own][1:] == ends[1:] and (ours[own][0] == "" or source == "")]
            if not near and source not in news and any(own[1:] == ends[1:] for own in ours.values()):
                match.left_out.add(name)
            same = near
        if same:
            match.connections[name] = same[0]


def _ends(body: Mapping[str, Any]) -> tuple[str, str, bool]:
    return body.get("from", ""), body.get("to", ""), body.get("port") in STORED_PORTS


def _members(threads: Mapping[str, Any], names: Mapping[str, str] | None = None) -> dict[str, frozenset[str]]:
    members_of: dict[str, set[str]] = {}
    for name, body in threads.items():
        if "executor" in body:
            members_of.setdefault(body["executor"], set()).add((names or {}).get(name, name))
    return {name: frozenset(members) for name, members in members_of.items()}


def _executors(match: Match, first: Imported, second: Imported) -> None:
    """Executors of the same threads; those of threads of which the first document has none; the others are remarks."""
    ours, theirs = _of(first, "threads"), _of(second, "threads")
    known = _members({name: body for name, body in ours.items() if name not in match.replaced})
    there = {name: body for name, body in theirs.items() if name not in match.left_out}
    for name, members in in_time(_members(there, match.threads).items()):
        same = [own for own, of in known.items() if of == members]
        shared = [one for one in members if one in ours]
        if same:
            match.executors[name] = same[0]
        elif any("executor" in ours[one] for one in shared):
            match.left_out_executors.add(name)
            words = f"the executor {name} is left out: by the file named before other executors run {', '.join(shared)}"
            match.told.append(Diagnostic(words[:500], severity="warning"))
        else:
            where = _of(second, "executors").get(name, {}).get("processor")
            where = match.processors.get(where, where)
            apart = [one for one in shared if first.is_own and ours[one].get("processor", where) != where]
            if apart:
                words = f"the executor {name} does not run {', '.join(apart)}: the problem file places them elsewhere"
                match.told.append(Diagnostic(words[:500], severity="warning"))
            match.joined |= {one: name for one in shared if one not in apart}
            if apart and len(apart) == len(members):
                match.left_out_executors.add(name)


def _processes(match: Match, first: Imported, second: Imported) -> None:
    """Containers: a process of several nodes, where the other one takes a node for a process."""
    ours, theirs = _by_node(first), _by_node(second)
    for node, names in theirs.items():
        process = _of(second, "threads")[names[0]].get("process")
        own_name = ".".join(part for part in node.split("/") if part)
        for name in ours.get(node, []):
            if process and process != own_name and _of(first, "threads")[name].get("process") == own_name:
                match.processes[name] = process


def entities_of(document: Mapping[str, Any]) -> dict[str, str]:
    """The ROS names of the threads of a problem file, by the nodes that it names; empty where it names none.

    The topic of a callback is the name of a connection to it, as imports give it.

    >>> entities_of({"threads": {"cam.tick": {"process": "cam", "period": "5 ms"}}, "ros2": {"nodes": {"cam": "/cam"}}})
    {'cam.tick': '/cam@Timer(5000000)'}
    """
    nodes: Mapping[str, str] = (document.get("ros2") or {}).get("nodes") or {}
    threads: Mapping[str, Any] = document.get("threads") or {}
    of = {name: nodes.get(name) or nodes.get(str(body.get("process"))) for name, body in threads.items()}
    entity_of = {}
    for name, node in in_time(of.items()):
        if node is not None:
            entity_of[name] = f"{node}@{_what(document, name, of)}"
    return entity_of


def _what(document: Mapping[str, Any], name: str, nodes: Mapping[str, str | None]) -> str:
    body = document["threads"][name]
    period = body.get("period")
    if isinstance(period, str):
        return f"Timer({parse_period_ns(period)})"
    if period is not None or body.get("dispatch_protocol") == "periodic":
        return "Timer(None)" if period is not None else ""
    for wire, ends in (document.get("connections") or {}).items():
        if ends.get("to") == name and ends.get("port") not in STORED_PORTS:
            both = [nodes.get(end) or "" for end in (ends.get("from", ""), name)]
            suffixes = (ros_name("".join(both)), ros_name(both[1]), "")
            end = next(text for text in suffixes if not text or wire.endswith(f".{text}"))
            topic = wire.removesuffix(f".{end}") if end else wire
            return f"Subscription(/{topic.replace('.', '/')})"
    return ""
