"""Configurations of the callback-isolated executor: a thread of its own for each callback group, with its priority.

Format: the README of cie_thread_configurator (autowarefoundation/callback_isolated_executor). The id of a group says
what is in it: ``/node@Subscription(/topic)@Timer(100000000)``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.importers.registry import Imported
from dse.importers.ros2.system import CALL_HINT, Callback, Group, Message, System, SystemWriter
from dse.importers.ros2.yaml_places import LocatedFile, LocatedValue

WHAT = "a configuration of the callback-isolated executor"
POLICIES = ("SCHED_FIFO", "SCHED_RR", "SCHED_OTHER", "SCHED_BATCH", "SCHED_IDLE", "SCHED_DEADLINE")
URGENT = POLICIES[:2]
_PART = re.compile(r"(?P<kind>Subscription|Service|Client|Timer|Waitable)(\((?P<what>[^()@]*)\))?")
SERVICES_OF_PARAMETERS = ("/parameter_events",)
MOST_CORES = 1024


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """The document of the problem that a configuration (or the template of a pre-run) describes.

    Raises
    ------
    ProblemError
        with every mistake and its line.
    UsageError
        when an option is wrong.
    """
    file = LocatedFile(path, WHAT)
    system = _system(file)
    file.check()
    writer = SystemWriter(file, system, options, "callback-isolated executor")
    document = writer.document()
    _add_throttling(file, document)
    return Imported(document, tuple(file.remarks), writer.places, writer.entities())


def _system(file: LocatedFile) -> System:
    groups = list(file.root["callback_groups"])
    if not groups:
        file.wrong(file.root["callback_groups"], f"expected `callback_groups`, as {file.what} has them")
    system = System()
    idle = 0
    seen: dict[str, int] = {}
    clients = _clients(groups)
    for item in groups:
        text = file.needed(item, "id")
        if text in seen:
            file.wrong(
                item, f"{text[:80]} is there twice, first in line {seen[text]}", "timers of one period look alike"
            )
        seen[text] = item.line
        group = _group(file, item, text, clients)
        if group is None:
            continue
        if not group.callbacks:
            idle += 1
            continue
        system.groups.append(group)
        system.executors.append((group.name, [group]))
        for one in group.callbacks:
            if one.period_ns is None:
                system.wires.append(Message(f"{one.topic}{one.node}", item, None, one, words=f"topic {one.topic}"))
    if idle:
        words = "callback groups without a timer or subscription of their own, left out"
        file.remark(file.root["callback_groups"], f"{words}: {idle}")
    if system.wires:
        hint = "state the `rate` of each, give --rate, or import CARET's architecture with it"
        file.remark(file.root["callback_groups"], "who publishes the topics is not in such files", hint)
    for item in file.root["non_ros_threads"]:
        file.remark(item, f"{item['id'].text[:80]} is left out: nothing says how often a thread of its own kind runs")
    return system


def _clients(groups: Sequence[LocatedValue]) -> Mapping[str, Sequence[str]]:
    """The nodes with a client of each service, by the service's name."""
    clients: dict[str, list[str]] = {}
    for item in groups:
        node, *parts = item["id"].text.split("@")
        for match in filter(None, map(_PART.fullmatch, parts)):
            if match["kind"] == "Client" and node not in clients.setdefault(match["what"] or "", []):
                clients[match["what"] or ""].append(node)
    return clients


def _group(file: LocatedFile, item: LocatedValue, text: str, clients: Mapping[str, Sequence[str]]) -> Group | None:
    """A callback group by its id; None where that is none."""
    node, *parts = text.split("@")
    if not node.startswith("/") or not parts:
        if text:
            file.wrong(
                item["id"], f"expected an id such as /node@Subscription(/topic)@Timer(100000000), got {text[:60]!r}"
            )
        return None
    number = len([part for part in parts if part])
    group = Group(f"{node}/group", [], item, id=text, is_isolated=True)
    for position, part in enumerate(parts):
        match = _PART.fullmatch(part)
        if match is None:
            file.wrong(item["id"], f"{part[:60]!r} is none of Subscription, Service, Client, Timer, Waitable")
            continue
        what = match["what"] or ""
        if match["kind"] == "Timer":
            if not (what.isdecimal() and what.isascii() and len(what) < 19 and int(what)):
                file.wrong(item["id"], f"Timer({what[:40]}): expected a period in ns")
                continue
            suffix = f"/timer_{position + 1}" if number > 1 else "/timer"
            group.callbacks.append(Callback(f"{node}{suffix}", node, item, period_ns=int(what)))
        elif match["kind"] == "Subscription" and what not in SERVICES_OF_PARAMETERS:
            group.callbacks.append(Callback(f"{node}/on{what}", node, item, topic=what))
        elif match["kind"] == "Service" and not what.startswith(f"{node}/"):
            callers = ", ".join(clients.get(what, ()))
            why = f"which callback of {callers} calls it, and" if callers else "who calls it, and"
            file.remark(item, f"{what} of {node} is left out: nothing says {why} how often", CALL_HINT)
    _urgency(file, item, group)
    return group


def _urgency(file: LocatedFile, item: LocatedValue, group: Group) -> None:
    policy = item["policy"].text
    if policy not in POLICIES:
        file.wrong(item["policy"], f"policy: expected one of {', '.join(POLICIES)}, got {policy[:40]!r}")
        return
    if policy in URGENT:
        group.priority = file.whole(item, "priority", 1, 99)
        if policy == "SCHED_RR":
            file.remark(item, f"{group.id[:80]}: SCHED_RR counts as SCHED_FIFO")
    elif group.callbacks and policy == "SCHED_DEADLINE":
        file.remark(item, f"{group.id[:80]}: {policy} is not counted: the group goes by its rate")
    affinity = item["affinity"]
    cores = []
    for place in affinity:
        if not (
            place.text.isdecimal() and place.text.isascii() and len(place.text) < 10 and int(place.text) < MOST_CORES
        ):
            file.wrong(place, f"affinity: expected the numbers of CPUs from 0, got {place.text[:40]!r}")
        else:
            cores.append(int(place.text) + 1)
    if affinity.data is not None and not isinstance(affinity.data, list):
        file.wrong(affinity, "affinity: expected a list of the numbers of CPUs")
    group.cores = tuple(dict.fromkeys(cores))


def _add_throttling(file: LocatedFile, document: dict[str, Any]) -> None:
    """Real-time throttling, where the file states it."""
    stated = file.root["rt_throttling"]
    if not isinstance(stated.data, dict):
        return
    runtime = file.whole(stated, "runtime_us", -1)
    period = file.whole(stated, "period_us", 1)
    file.check()
    if runtime is None or period is None or runtime < 0 or runtime >= period:
        return
    [kind] = document["processor_types"].values()
    source = f"{file.path.name}:{stated.line}"
    kind["throttling"] = {"budget": f"{runtime} us", "period": f"{period} us", "source": source}
