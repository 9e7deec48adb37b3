"""Traces of ros2_tracing: callbacks with their execution times, timers, topics, and who publishes what.

Tracepoints: those of ros2_tracing (github.com/ros2/ros2_tracing); those of CARET say which callback groups and
executors there are, where a trace has them.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from dse.importers.registry import Imported
from dse.importers.ros2.events import MOST_NS, Event, events_of
from dse.importers.ros2.system import Callback, Group, Message, System, SystemWriter
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue
from dse.support.errors import Diagnostic, ProblemError
from dse.support.timelimit import in_time
from dse.support.units import format_rate

OF_TOOLS = ("/parameter_events", "/rosout")
"""Topics that every node has, and nobody designs."""
MOST_CPUS = 1024
OFF = Fraction(1, 100)
"""A timer whose mean period is further from what it was created with is told."""
NEEDED = {
    "rcl_node_init": "begin the trace before the nodes start",
    "callback_start": "enable the tracepoints of ROS 2: ros2 trace -u 'ros2:*'",
    "callback_end": "enable the tracepoints of ROS 2: ros2 trace -u 'ros2:*'",
}
Handle = tuple[Any, Any]
"""Process and address."""


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the problem that a trace shows.

    Raises
    ------
    ProblemError
        when it is no trace, or lacks the tracepoints that are needed.
    UsageError
        when an option is wrong.
    """
    file, system = _seen(path)
    writer = SystemWriter(file, system, options, "trace")
    document = writer.document()
    document["assumptions"].append(
        "Execution times of the trace go from the beginning of a callback to its end: with what preempted it."
    )
    return Imported(
        *(document, tuple(file.remarks), writer.places, writer.entities()),
        publishers=writer.publishers(),
        is_measured=True,
    )


def read_seen(path: Path) -> list[Callback]:
    """The callbacks of a trace, with when they began and how long they took. Errors as for `read`.

    `Callback` objects with begins and durations in ns.
    """
    return [one for group in _seen(path)[1].groups for one in group.callbacks]


def _seen(path: Path) -> tuple[LocatedFile, System]:
    seen = TraceState()
    for event in in_time(events_of(path)):
        seen.take(event)
    seen.check(path)
    file = LocatedFile(path, "a trace", LocatedValue({}, 0, 0))
    system = seen.system(file)
    if not system.groups:
        raise ProblemError([Diagnostic("no callback of a timer or subscription runs in it", "", str(path))])
    return file, system


@dataclass
class Run:
    """The jobs of one callback in a trace: start times and durations, in ns."""

    starts: array[int] = field(default_factory=lambda: array("q"))
    durations: array[int] = field(default_factory=lambda: array("q"))
    threads: set[Any] = field(default_factory=set)


class TraceState:
    """The nodes, callbacks and runs found in the events of a trace, by process and address.

    One pass over the events; `system` is asked at the end.
    """

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.nodes: dict[Handle, str] = {}
        self.subscriptions: dict[Handle, tuple[Handle, str]] = {}
        self.objects: dict[Handle, Handle] = {}
        self.of_subscription: dict[Handle, Handle] = {}
        self.periods: dict[Handle, int] = {}
        self.timer_nodes: dict[Handle, Handle] = {}
        self.of_timer: dict[Handle, Handle] = {}
        self.publishers: dict[Handle, str] = {}
        self.reentrant: set[Handle] = set()
        self.group_of: dict[Handle, Handle] = {}
        self.executors: dict[Handle, str] = {}
        self.executor_of: dict[Handle, Handle] = {}
        self.runs: dict[Handle, Run] = {}
        self.running: dict[Any, tuple[Handle, int]] = {}
        self.published: dict[tuple[Handle | None, str], array[int]] = {}
        self.lost = 0
        self.cpus: set[int] = set()

    def take(self, event: Event) -> None:
        """Note what one event says.

        Events without a handler are only counted by name.
        """
        self.names.add(event.name)
        act = TAKES.get(event.name)
        if act is not None:
            cpu = event.fields.get("cpu_id")
            if isinstance(cpu, int) and 0 <= cpu < MOST_CPUS:
                self.cpus.add(cpu)
            act(self, event, event.fields.get("vpid", 0))

    def _rcl_node_init(self, event: Event, process: Any) -> None:
        space = str(event.fields.get("namespace", "/")).rstrip("/")
        self.nodes[process, event.fields.get("node_handle")] = f"{space}/{event.fields.get('node_name', '')}"

    def _rcl_subscription_init(self, event: Event, process: Any) -> None:
        node = (process, event.fields.get("node_handle"))
        self.subscriptions[process, event.fields.get("subscription_handle")] = (
            node,
            str(event.fields.get("topic_name")),
        )

    def _rclcpp_subscription_init(self, event: Event, process: Any) -> None:
        handle = (process, event.fields.get("subscription_handle"))
        self.objects[process, event.fields.get("subscription")] = handle

    def _rclcpp_subscription_callback_added(self, event: Event, process: Any) -> None:
        self.of_subscription[process, event.fields.get("callback")] = (process, event.fields.get("subscription"))

    def _rcl_timer_init(self, event: Event, process: Any) -> None:
        period = event.fields.get("period", 0)
        is_one = isinstance(period, int) and 0 < period < MOST_NS
        self.periods[process, event.fields.get("timer_handle")] = period if is_one else 0

    def _rclcpp_timer_link_node(self, event: Event, process: Any) -> None:
        self.timer_nodes[process, event.fields.get("timer_handle")] = (process, event.fields.get("node_handle"))

    def _rclcpp_timer_callback_added(self, event: Event, process: Any) -> None:
        self.of_timer[process, event.fields.get("callback")] = (process, event.fields.get("timer_handle"))

    def _rcl_publisher_init(self, event: Event, process: Any) -> None:
        self.publishers[process, event.fields.get("publisher_handle")] = str(event.fields.get("topic_name"))

    def _add_callback_group(self, event: Event, process: Any) -> None:
        self.executor_of[process, event.fields.get("callback_group_addr")] = (
            process,
            event.fields.get("executor_addr"),
        )
        if event.fields.get("group_type_name") == "reentrant":
            self.reentrant.add((process, event.fields.get("callback_group_addr")))

    def _construct_executor(self, event: Event, process: Any) -> None:
        self.executors[process, event.fields.get("executor_addr")] = str(event.fields.get("executor_type_name"))

    def _callback_group_add_timer(self, event: Event, process: Any) -> None:
        self._add_to_group(event, process, "timer_handle")

    def _callback_group_add_subscription(self, event: Event, process: Any) -> None:
        self._add_to_group(event, process, "subscription_handle")

    def _add_to_group(self, event: Event, process: Any, handle: str) -> None:
        group = (process, event.fields.get("callback_group_addr"))
        self.group_of[process, event.fields.get(handle)] = group

    def _callback_start(self, event: Event, process: Any) -> None:
        callback = (process, event.fields.get("callback"))
        thread = event.fields.get("vtid", 0)
        if (process, thread) in self.running:
            self.lost += 1
        self.running[process, thread] = (callback, event.time_ns)
        run = self.runs.setdefault(callback, Run())
        run.starts.append(event.time_ns)
        run.threads.add((process, thread))

    def _callback_end(self, event: Event, process: Any) -> None:
        begun = self.running.pop((process, event.fields.get("vtid", 0)), None)
        if begun is None or begun[0] != (process, event.fields.get("callback")):
            self.lost += 1
            return
        self.runs[begun[0]].durations.append(event.time_ns - begun[1])

    def _rcl_publish(self, event: Event, process: Any) -> None:
        topic = self.publishers.get((process, event.fields.get("publisher_handle")))
        if topic is None:
            return
        begun = self.running.get((process, event.fields.get("vtid", 0)))
        self.published.setdefault((begun[0] if begun else None, topic), array("q")).append(event.time_ns)

    def check(self, path: Path) -> None:
        """Stop where a tracepoint is missing.

        Raises `ProblemError` with one diagnostic for each missing tracepoint.
        """
        missing = [name for name in NEEDED if name not in self.names]
        if missing:
            absent = [
                Diagnostic(f"the trace has no event ros2:{name}", "", str(path), hint=NEEDED[name]) for name in missing
            ]
            raise ProblemError(absent)

    # --- the system

    def system(self, file: LocatedFile) -> System:
        """Callbacks with their times, groups, and topics.

        Callbacks without a completed job are left out; a timer without a period is a remark.
        """
        system = System(cpus=self.cpus)
        callbacks = dict(self._callbacks(file))
        grouped: dict[Any, list[Callback]] = {}
        for handle, one in callbacks.items():
            grouped.setdefault(self._unit(handle, file), []).append(one)
        for number, members in enumerate(grouped.values()):
            nodes = list(dict.fromkeys(one.node for one in members))
            group = Group(f"{nodes[0]}/group" if len(nodes) == 1 else f"executor_{number}", members, members[0].place)
            system.groups.append(group)
            if len(members) > 1:
                system.executors.append((group.name, [group]))
        self._wires(system, callbacks, file)
        if self.lost:
            file.remark(
                LocatedValue({}, 0, 0), f"jobs of callbacks without their beginning or end, left out: {self.lost}"
            )
        return system

    def _callbacks(self, file: LocatedFile) -> Any:
        taken: dict[str, int] = {}
        for handle, run in self.runs.items():
            one = self._timer(handle) or self._subscription(handle)
            if one is None and handle in self.of_timer:
                words = f"a timer of {self._node_of(self.of_timer[handle])} without a period is left out, with its jobs"
                file.remark(LocatedValue({}, 0, 0), f"{words}: {len(run.starts)}")
            if one is None or one.topic in OF_TOOLS or not run.durations:
                continue
            taken[one.name] = taken.get(one.name, 0) + 1
            if taken[one.name] > 1:
                one.name = f"{one.name}_{taken[one.name]}"
            one.durations_ns, one.starts_ns = run.durations, run.starts
            if one.period_ns is not None and len(run.starts) > 1:
                mean = Fraction(run.starts[-1] - run.starts[0], len(run.starts) - 1)
                one.words = f"{len(run.starts)} times, every {float(mean) / 1e6:.6g} ms on average"
                if abs(mean - one.period_ns) > OFF * one.period_ns:
                    words = f"{one.name} was created with a period of {one.period_ns / 1e6:g} ms, and ran {one.words}"
                    file.remark(one.place, words)
            yield handle, one

    def _timer(self, handle: Handle) -> Callback | None:
        timer = self.of_timer.get(handle)
        if timer is None or not self.periods.get(timer):
            return None
        node = self._node_of(timer)
        return Callback(f"{node}/timer", node, LocatedValue({}, 0, 0), period_ns=self.periods[timer])

    def _node_of(self, timer: Handle) -> str:
        return self.nodes.get(self.timer_nodes.get(timer, (0, 0)), "/unknown_node")

    def _subscription(self, handle: Handle) -> Callback | None:
        subscription = self.objects.get(self.of_subscription.get(handle, (0, 0)))
        if subscription is None or subscription not in self.subscriptions:
            return None
        of, topic = self.subscriptions[subscription]
        node = self.nodes.get(of, "/unknown_node")
        return Callback(f"{node}/on{topic}", node, LocatedValue({}, 0, 0), topic=topic)

    def _unit(self, handle: Handle, file: LocatedFile) -> Any:
        """The unit in which callbacks run one at a time: an executor of one thread, a callback group, or a thread."""
        timer = self.of_timer.get(handle)
        subscription = self.objects.get(self.of_subscription.get(handle, (0, 0)))
        entity = timer if timer is not None else subscription
        group = self.group_of.get(entity) if entity is not None else None
        if group is None:
            threads = self.runs[handle].threads
            if len(threads) > 1:
                return handle
            return ("thread", *next(iter(threads)))
        executor = self.executor_of.get(group)
        kind = self.executors.get(executor, "") if executor is not None else ""
        if kind.startswith("single_threaded"):
            return executor
        if kind.startswith("multi_threaded"):
            text = "an executor has several threads: it counts as if it had one for each of its callback groups"
            file.remark(LocatedValue({}, 0, 0), text)
        return handle if group in self.reentrant else group

    def _wires(self, system: System, callbacks: Mapping[Handle, Callback], file: LocatedFile) -> None:
        sources: dict[str, list[Callback]] = {}
        outside: dict[str, array[int]] = {}
        for (handle, topic), times in self.published.items():
            if handle is not None and handle in callbacks:
                sources.setdefault(topic, []).append(callbacks[handle])
                system.publishes.append((callbacks[handle], topic))
            else:
                outside.setdefault(topic, array("q")).extend(times)
        targets = [(handle, one) for handle, one in callbacks.items() if one.topic]
        for handle, target in targets:
            topic = target.topic
            several = sum(one.topic == topic for _, one in targets) * max(1, len(sources.get(topic, []))) > 1
            known: list[Callback | None] = [*sources.get(topic, [])]
            for source in known or [None]:
                ends = f"{source.node if source is not None else ''}{target.node}" if several else ""
                wire = Message(f"{topic}{ends}", target.place, source, target, words=f"topic {topic}")
                if source is None:
                    wire.rate = _rate(self.runs[handle].starts if topic not in outside else outside[topic])
                    if not wire.rate:
                        file.remark(target.place, f"nothing in the trace publishes {topic}", "state its `rate`")
                system.wires.append(wire)


TAKES: Mapping[str, Callable[[TraceState, Event, Any], None]] = {
    "rcl_node_init": TraceState._rcl_node_init,
    "rcl_subscription_init": TraceState._rcl_subscription_init,
    "rclcpp_subscription_init": TraceState._rclcpp_subscription_init,
    "rclcpp_subscription_callback_added": TraceState._rclcpp_subscription_callback_added,
    "rcl_timer_init": TraceState._rcl_timer_init,
    "rclcpp_timer_link_node": TraceState._rclcpp_timer_link_node,
    "rclcpp_timer_callback_added": TraceState._rclcpp_timer_callback_added,
    "rcl_publisher_init": TraceState._rcl_publisher_init,
    "add_callback_group": TraceState._add_callback_group,
    "construct_executor": TraceState._construct_executor,
    "callback_group_add_timer": TraceState._callback_group_add_timer,
    "callback_group_add_subscription": TraceState._callback_group_add_subscription,
    "callback_start": TraceState._callback_start,
    "callback_end": TraceState._callback_end,
    "rcl_publish": TraceState._rcl_publish,
}
"""The methods that note events, by the name of the event."""


def _rate(times: array[int]) -> str:
    """The average rate of events at these times (ns) as text, such as ``10 Hz``; "" where fewer than two are known."""
    ordered = sorted(times)
    if len(ordered) < 2 or ordered[-1] == ordered[0]:
        return ""
    rate = Fraction((len(ordered) - 1) * 10**9, ordered[-1] - ordered[0])
    return format_rate(Fraction(round(rate * 1000), 1000)) if rate >= Fraction(1, 1000) else ""
