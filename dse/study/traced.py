"""What traces and bags show of a problem: execution times and periods of its threads, rates and sizes of its topics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from dse.fitting.observed import Observed
from dse.importers.registry import importer_of
from dse.importers.ros2.located import ros_name
from dse.importers.ros2.system import Callback, is_of_topic
from dse.importers.ros2.trace import read_seen
from dse.importers.ros_bags import read_bag
from dse.spec.model import Spec, Thread

BAGS = (".mcap", ".db3", ".bag")
NS = 10**9


def is_recording(path: Path) -> bool:
    """Whether it is a trace or a bag, rather than a table."""
    return _is_trace(path) or path.suffix.lower() in BAGS or (path.is_dir() and (path / "metadata.yaml").is_file())


def _is_trace(path: Path) -> bool:
    importer = importer_of(path)
    return importer is not None and importer.name == "trace"


def read_recording(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    """What a trace or bag shows of the threads and connections of a problem, and what it has besides.

    Callbacks are found by their node (the process of the thread, or its name in `ros2`) and their period or topic;
    topics by the name that an import gives their connection: ``/front/image`` is ``front.image``.

    Raises
    ------
    ProblemError
        when it is none, or damaged.
    UsageError
        when the library that reads it is not installed.
    """
    return _of_trace(path, spec) if _is_trace(path) else _of_bag(path, spec)


def _summary(figure: str, name: str, path: Path, values: Sequence[int], unit: str, scale: int) -> Observed:
    found = Observed(figure, name, f"{path}:0", unit, Fraction(min(values), scale), Fraction(max(values), scale))
    found.count, found.total = len(values), Fraction(sum(values), scale)
    return found


def _of_trace(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    found: list[Observed] = []
    others: list[str] = []
    for one in read_seen(path):
        names = _threads_of(one, spec)
        if len(names) != 1:
            others.append(one.name)
            continue
        found.append(_summary("execution time", names[0], path, one.durations_ns, "ns", NS))
        gaps = [later - earlier for earlier, later in pairwise(one.starts_ns)]
        if one.period_ns is not None and gaps:
            found.append(_summary("period", names[0], path, gaps, "ns", NS))
    return found, [f"callbacks of {path.name} that are no threads here: {', '.join(others)}"[:500]] if others else []


def _threads_of(one: Callback, spec: Spec) -> list[str]:
    """The threads that may be a callback: by name, else by node and period or topic."""
    if ros_name(one.name) in spec.threads:
        return [ros_name(one.name)]
    nodes = spec.ros2.nodes if spec.ros2 is not None else {}
    own = {
        name: thread
        for name, thread in spec.threads.items()
        if any(nodes.get(process, f"/{process.replace('.', '/')}") == one.node for process in thread.process or (name,))
    }
    if one.topic:
        return [name for name in own if name in set(_targets(one.topic, spec))]
    return _timers(one, own)


def _timers(one: Callback, own: dict[str, Thread]) -> list[str]:
    timers = [name for name, thread in own.items() if thread.period]
    same = [name for name in timers if one.period_ns in (own[name].period or ())]
    return same or (timers if len(timers) == 1 else [])


def _wires_of(topic: str, spec: Spec) -> Iterator[str]:
    """The connections that an import names by a topic."""
    return (wire for wire, stated in spec.connections.items() if is_of_topic(wire, stated.port, topic))


def _targets(topic: str, spec: Spec) -> Iterator[str]:
    for wire in _wires_of(topic, spec):
        to = spec.connections[wire].to
        if to is not None:
            yield to


def _of_bag(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    found: list[Observed] = []
    others: list[str] = []
    for topic in read_bag(path):
        wires = list(_wires_of(topic.name, spec))
        if not wires:
            others.append(topic.name)
        for wire in wires:
            size = Observed("data size", wire, f"{path}:0", "B", Fraction(topic.least), Fraction(topic.most))
            size.count, size.total = topic.count, Fraction(topic.mean) * topic.count
            found.append(size)
            if topic.mean_ns and topic.shortest_ns is not None and topic.longest_ns is not None:
                ends = Fraction(max(1, topic.shortest_ns), NS), Fraction(max(1, topic.longest_ns), NS)
                rate = Observed("rate", wire, f"{path}:0", "ns", *ends)
                rate.count, rate.total = topic.count - 1, Fraction(topic.mean_ns) / NS * (topic.count - 1)
                found.append(rate)
    return found, [f"topics of {path.name} that are no connections here: {', '.join(others)}"[:500]] if others else []
