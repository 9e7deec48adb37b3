"""Launch files and parameter files of ROS 2 as problem files: nodes, containers, remappings, and rates of timers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from dse.importers.allowance import allowed, at, spend
from dse.importers.registry import NODES, PUBLISHERS, Imported
from dse.importers.ros2.launch.parameters import ParameterFile, TimerParameter, stated_timers, timers_of
from dse.importers.ros2.launch.running import Launch, Started, joined
from dse.importers.ros2.packages import Packages
from dse.importers.ros2.system import Callback, Group, Message, System, SystemWriter, seen_among
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue
from dse.support.errors import Diagnostic, UsageError
from dse.support.files.reading import real

SINGLE, SEVERAL, APART, ISOLATED = "one thread", "several threads", "a thread for each node", "callback-isolated"
Seen: TypeAlias = Mapping[tuple[str, str], Sequence[str]]
"""The publishers of a topic of a node by a trace, as the option `PUBLISHERS` has them."""
INPUTS, OUTPUTS = ("input", "inputs", "in"), ("output", "outputs", "out")
PIECES = 20
"""The share of the allowance that a callback, or a connection to one, takes."""
LEFT_OUT = "not static, left out"
MOST_TOLD = 40
BY_NAMES = (
    "What nodes send and receive follows from the names that are remapped: those that begin with input or output."
)


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the problem that a launch file describes, as far as it is static.

    Raises
    ------
    ProblemError
        when it is no launch file, or one that it includes is none.
    UsageError
        when an option is wrong.
    """
    with allowed(), at(path, 1):
        return _read(path, options)


def _read(path: Path, options: Mapping[str, Any]) -> Imported:
    launch = Launch(Packages(path, options.get("workspace")))
    launch.run(real(path), _arguments(options.get("arguments")))
    file = LocatedFile(path, "a launch file", LocatedValue({}, 0, 0))
    system = _system(launch, file, _stated(options), options.get(PUBLISHERS, {}))
    if not system.groups:
        file.wrong(LocatedValue({}, 1, 0), "it starts no node that is known without launching it")
        file.mistakes += list(launch.told)[:MOST_TOLD]
        file.check()
    writer = SystemWriter(file, system, options, "launch file")
    document = writer.document()
    if system.wires:
        document["assumptions"].append(BY_NAMES)
    remarks = [*launch.told, *file.remarks]
    missing = [item for item in remarks if LEFT_OUT in item.message]
    if missing:
        words = "; ".join(f"{Path(item.file).name}:{item.line}: {item.message}" for item in missing)
        document["assumptions"].append(f"MISSING: what only the launch decides: {words}"[:900])
    return Imported(document, tuple(remarks), writer.places, writer.entities())


def read_parameters(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the nodes that a parameter file has by their names. Errors as for `read`.

    `options` are those of ``dse import`` by name.
    """
    with allowed(), at(path, 1):
        return _read_parameters(path, options)


def _read_parameters(path: Path, options: Mapping[str, Any]) -> Imported:
    stated = _stated(options)
    parameters = ParameterFile(path)
    file = LocatedFile(path, "a parameter file", LocatedValue({}, 0, 0))
    system = System()
    for name in dict.fromkeys([*parameters.nodes, *options.get(NODES, ())]):
        node = Started(name, path, 0, "", "", [], parameters.of(name))
        callbacks = _timers(node, file, stated)
        if callbacks:
            system.groups.append(Group(f"{name}/group", callbacks, callbacks[0].place))
            system.executors.append((f"{name}/group", system.groups[-1:]))
    if not system.groups:
        words = "none of its parameters is the rate or period of a timer as far as their names say"
        file.wrong(LocatedValue({}, 1, 0), words, "name them: --timers 'fps [Hz], /cam:grab.period_ms [ms]'")
        file.mistakes += list(file.remarks)[:MOST_TOLD]
    file.check()
    return SystemWriter(file, system, options, "parameter file of ROS 2").imported()


def _stated(options: Mapping[str, Any]) -> list[TimerParameter]:
    timers = stated_timers(options.get("timers"))
    if isinstance(timers, str):
        raise UsageError(f"--timers {timers}")
    return timers


def _arguments(text: str | None) -> dict[str, str]:
    """The launch arguments that the user gives, as ``ros2 launch`` takes them."""
    arguments = {}
    for part in (text or "").split(","):
        name, sign, value = part.strip().partition(":=")
        if part.strip() and (not sign or not name.strip()):
            raise UsageError(f"--arguments {part.strip()}: expected name:=value, several with commas")
        if sign:
            arguments[name.strip()] = value.strip()
    return arguments


def _system(launch: Launch, file: LocatedFile, stated: Sequence[TimerParameter], publishers: Seen) -> System:
    system = System()
    outputs: dict[str, list[tuple[Started, list[Callback]]]] = {}
    of_containers: dict[str, list[tuple[Started, Group]]] = {}
    seen: set[str] = set()
    for node in launch.nodes:
        if node.name in seen:
            _tell(file, node, f"a second node is called {node.name}")
        seen.add(node.name)
        callbacks = _callbacks(node, file, stated)
        group = Group(f"{node.name}/group", callbacks, callbacks[0].place)
        system.groups.append(group)
        if node.container:
            of_containers.setdefault(node.container, []).append((node, group))
        else:
            system.executors.append((group.name, [group]))
        for topic in _topics(node, OUTPUTS):
            outputs.setdefault(topic, []).append((node, callbacks))
    for name, members in of_containers.items():
        _container(name, launch.containers.get(name), members, system, file)
    _wires(system, outputs, file, publishers)
    return system


def _place() -> LocatedValue:
    return LocatedValue(None, 0, 0)  # its source names its own file


def _tell(file: LocatedFile, node: Started, message: str, hint: str = "") -> None:
    file.tell(Diagnostic(message, "", str(node.file), node.line, 0, hint, severity="warning"))


def _callbacks(node: Started, file: LocatedFile, stated: Sequence[TimerParameter]) -> list[Callback]:
    """The timers of a node that its parameters state, and what it runs for its inputs; else one that is open."""
    callbacks = _timers(node, file, stated)
    for topic in _topics(node, INPUTS):
        callbacks.append(Callback(f"{node.name}/on{topic}", node.name, _place(), topic=topic))
    if not callbacks:
        callbacks = [Callback(node.name, node.name, _place(), is_open=True)]
    spend(PIECES * len(callbacks))
    for one in callbacks:
        one.process = node.container
        one.words = "; ".join(text for text in (one.words, _described(node, one.topic)) if text)
    return callbacks


def _described(node: Started, topic: str) -> str:
    """Where a node is started, and its remappings; of a callback for a topic that of the topic."""
    spend(len(node.remaps))
    what = "/".join(text for text in (node.package, node.executable) if text)
    pairs = [(a, b) for a, b in node.remaps if not topic or _topic(node, b) == topic]
    remaps = ", ".join(f"{a}:={b}" for a, b in pairs)
    parts = (f"{node.file.name}:{node.line}: {what}" if what else "", f"remapped {remaps}" if remaps else "")
    return "; ".join(part for part in parts if part)


def _timers(node: Started, file: LocatedFile, stated: Sequence[TimerParameter]) -> list[Callback]:
    last = {item.name: item for item in node.parameters}
    timers, remarks = timers_of(node.name, list(last.values()), stated)
    if remarks:
        words = f"{node.name}: these may be rates or periods of timers, and are not counted: {', '.join(remarks)}"
        _tell(file, node, words[:500], "--timers 'NAME [Hz], NODE:NAME [ms]' counts those that it names")
    callbacks = []
    for item in timers:
        name = f"{node.name}/timer{'/' + item.parameter.name if len(timers) > 1 else ''}"
        why = f"{item.parameter.name} = {item.parameter.text} {item.unit}, {Path(item.parameter.file).name}"
        one = Callback(
            name, node.name, LocatedValue(None, 0, 0), period_ns=item.period_ns, words=f"{why}:{item.parameter.line}"
        )
        one.parameter = (item.field, item.words)
        if not item.stated:
            words = f"{node.name}: by its name {item.parameter.name} is the {item.field} of a timer ({item.unit})"
            told_at = Diagnostic(
                words, "", item.parameter.file, item.parameter.line, 0, "--timers says otherwise", severity="warning"
            )
            file.tell(told_at)
        callbacks.append(one)
    return callbacks


def _topics(node: Started, words: Sequence[str]) -> list[str]:
    """The topics to which inputs (or outputs) are remapped, by the names of what is remapped."""
    topics = [
        _topic(node, target)
        for source, target in node.remaps
        if any(part in words for part in source.strip("~/").split("/")[:1])
    ]
    return list(dict.fromkeys(topics))


def _topic(node: Started, name: str) -> str:
    if name.startswith("~"):
        return joined(node.name, name.removeprefix("~").strip("/"))
    return joined(node.name.rpartition("/")[0] or "/", name)


def _kind(container: Started | None) -> str:
    name = container.executable if container is not None else ""
    if "callback_isolated" in name or name.endswith("_cie"):
        return ISOLATED
    if name.endswith("_isolated"):
        return APART
    return SEVERAL if name.endswith(("_mt", "_multi_threaded", "_multithread")) else SINGLE


def _container(
    name: str, container: Started | None, members: Sequence[tuple[Started, Group]], system: System, file: LocatedFile
) -> None:
    """Which threads run the nodes of a container: by the kind of its executable, as rclcpp_components has them."""
    kind = _kind(container)
    node = container if container is not None else members[0][0]
    if container is None:
        _tell(file, node, f"nothing here starts the container {name}: it counts as one of one thread")
    elif container.executable not in ("component_container", "component_container_mt", "component_container_isolated"):
        _tell(file, node, f"the container {name} ({container.executable}) counts as one of {kind}")
    if kind == SEVERAL:
        words = f"{name} has several threads: it counts as if it had one for each of its nodes"
        _tell(file, node, words, "the callback groups of a node may run at once: a trace or CARET's file has them")
    groups = [group for _, group in members]
    if kind == SINGLE:
        system.executors.append((f"{name}/executor", groups))
        return
    for group in groups:
        group.is_isolated = kind == ISOLATED
        system.executors.append((group.name, [group]))


def _wires(
    system: System, outputs: Mapping[str, list[tuple[Started, list[Callback]]]], file: LocatedFile, publishers: Seen
) -> None:
    """A connection from what publishes a topic to each callback that it runs, by the names of remappings."""
    targets = [one for group in system.groups for one in group.callbacks if one.topic]
    readers = Counter(one.topic for one in targets)
    for target in targets:
        spend(sum(1 + len(own) for _, own in outputs.get(target.topic, [])))
        sources: list[Callback] = []
        for node, own in outputs.get(target.topic, []):
            there = seen_among(own, publishers.get((node.name, target.topic), ()))
            sources += there or _publisher(node, own, target, file)
        spend(PIECES * (1 + len(sources)))
        several = readers[target.topic] * max(1, len(sources)) > 1
        known: list[Callback | None] = [*sources]
        for source in known or [None]:
            ends = f"{source.node if source is not None else ''}{target.node}" if several else ""
            words = f"topic {target.topic}, by the names of what is remapped"
            system.wires.append(Message(f"{target.topic}{ends}", target.place, source, target, words=words))


def _publisher(node: Started, own: Sequence[Callback], target: Callback, file: LocatedFile) -> list[Callback]:
    """Which callback of a node publishes: its timer, or its only one."""
    timers = [one for one in own if one.period_ns is not None]
    if len(timers) == 1 or len(own) == 1:
        return timers[:1] or list(own[:1])
    words = f"nothing says which callback of {node.name} publishes {target.topic}: {own[0].name} is taken for it"
    _tell(file, node, words)
    return list(own[:1])
