"""Amalthea models (the XML of Eclipse APP4MC, and of the WATERS challenges) as problem files.

A task is a thread with the period of its stimulus, or one that another task triggers; its time is that of the ticks of
its runnables on the processing units. A label that one task writes and another reads is data between them, those of two
tasks together one connection to a data port. Event chains are flows, latency constraints on them requirements.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

from dse.importers.allowance import allowed, at, spend
from dse.importers.amalthea_xml import Element, tree
from dse.importers.registry import Imported, Key, Place
from dse.importers.ros2.yaml_places import UniqueNames, ros_name
from dse.support.errors import Diagnostic, ProblemError, UsageError
from dse.support.units import (
    PARAMETER_TIMES_NS,
    TimeRange,
    UnitError,
    format_duration,
    format_time_range,
    parse_rate_hz,
)

PIECES = 4_000_000
TIMES_NS = {"ps": Fraction(1, 1000), **PARAMETER_TIMES_NS}
RATES_HZ = {"Hz": 1, "kHz": 10**3, "KHz": 10**3, "MHz": 10**6, "GHz": 10**9}
BITS = {"bit": 1, "kbit": 10**3, "Mbit": 10**6, "Kibit": 2**10, "Mibit": 2**20}
BITS |= {"B": 8, "kB": 8 * 10**3, "MB": 8 * 10**6, "KiB": 2**13, "MiB": 2**23}
NEEDS = ("Ticks", "ExecutionNeed", "RunnableInstructions")
"""Elements of a runnable that take time."""
SWITCHES = ("ModeSwitch", "ProbabilitySwitch", "RunnableModeSwitch", "RunnableProbabilitySwitch")
DEEPEST = 300
"""How deep runnables may call each other, with the groups and branches around each call."""
METRICS = {"Reaction": "reaction time", "Age": "data age"}
ONE = "one processor"
LONGEST_NUMBER = 40
MOST_SOURCE = 900
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d{1,2})?")


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """An Amalthea model as the document of a problem file.

    Raises
    ------
    ProblemError
        when the file is none, or has no tasks.
    UsageError
        when an option is wrong.
    """
    with allowed(PIECES), at(path, 1):
        root = tree(path)
        return _Reader(path, root, options).read()


class _Reader:
    """Makes the document of one model."""

    def __init__(self, path: Path, root: Element, options: Mapping[str, Any]) -> None:
        self.path, self.options = path, options
        self.remarks: list[Diagnostic] = []
        self.told: set[Diagnostic] = set()
        self.places: dict[Key, Place] = {}
        self.names = UniqueNames()
        self.parts: dict[str, list[Element]] = {}
        for model in root.parts:
            for item in model.parts:
                self.parts.setdefault(item.tag, []).append(item)
        self.units = [item for item in root.all() if item.kind == "ProcessingUnit" or item.tag == "cores"]
        self.speed_hz = self._option()
        self.tasks = [*self.parts.get("tasks", ()), *self.parts.get("isrs", ())]
        self.runnables = {item.name: item for item in self.parts.get("runnables", ())}
        self.stimuli = {item.name: item for item in self.parts.get("stimuli", ())}
        self.threads: dict[str, str] = {}
        self.runs: dict[str, list[Element]] = {}
        """The runnables of each task, by its name."""
        self.triggers: dict[str, dict[str, None]] = {}
        """By stimulus, the tasks that trigger it."""
        self.wires: dict[tuple[str, str], str] = {}

    def _option(self) -> Fraction | None:
        text = self.options.get("frequency")
        try:
            return None if text is None else Fraction(parse_rate_hz(str(text)))
        except UnitError as error:
            raise UsageError(f"--frequency {text}: {error}") from error

    def _remark(self, message: str, item: Element | None = None, hint: str = "") -> None:
        line = item.line if item is not None else 0
        remark = Diagnostic(message, file=str(self.path), line=line, hint=hint, severity="warning")
        if remark not in self.told:
            self.told.add(remark)
            self.remarks.append(remark)

    def _at(self, item: Element, words: str = "") -> str:
        return f"{self.path.name}:{item.line}{f': {words}' if words else ''}"[:MOST_SOURCE]

    def read(self) -> Imported:
        """The whole of it."""
        if not self.tasks:
            raise ProblemError([Diagnostic("the model has no tasks", file=str(self.path), line=1)])
        processors = dict(self._processors())
        self._read_runs()
        threads = dict(self._threads(list(processors)))
        connections = {**dict(self._connections()), **dict(self._dispatches())}
        flows, requirements = self._flows()
        document: dict[str, Any] = {
            "dse": 1,
            "name": self.path.stem,
            "source": f"{self.path.name} (Amalthea model)",
            "assumptions": [
                "A tick is one cycle of its processing unit; runnables take their shortest to longest times each.",
                "What tasks exchange by labels waits to be read; it crosses no bus.",
            ],
            "processor_types": self.types,
            "processors": processors,
            "threads": threads,
        }
        document |= {"connections": connections} if connections else {}
        document |= {"flows": flows} if flows else {}
        document |= {"requirements": requirements} if requirements else {}
        return Imported(document, tuple(self.remarks), self.places)

    # --- hardware

    def _processors(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """A processor for each processing unit, whose type has the frequency of its domain."""
        domains = {item.name: item for item in self.parts.get("domains", ())}
        self.types: dict[str, dict[str, Any]] = {}
        self.hz: dict[str, Fraction | None] = {}
        self.slots: dict[str, str] = {}
        self.kinds: dict[str, str] = {}
        """The type of each processor."""
        self.slow: set[str] = set()
        """Types without a frequency, of which that is told."""
        kinds, taken = UniqueNames(), {}
        for unit in self.units or [Element("", "", {"name": "computer"}, 1)]:
            domain = next((domains[name] for name in unit.refers("frequencyDomain") if name in domains), None)
            value = next(iter(domain.of("defaultValue")), None) if domain is not None else None
            stated = _quantity(value, RATES_HZ) if value is not None else None
            hz = self.speed_hz or stated
            definition = next(iter(unit.refers("definition")), "") or f"{unit.name}_type"
            if (definition, hz) not in taken:
                kind = kinds.new(ros_name(definition))
                taken[definition, hz] = kind
                of = f"{float(hz) / 1e6:g} MHz" if hz else "no frequency stated"
                self.types[kind] = {"cores": 1, "source": self._at(unit, of)}
                self.hz[kind] = hz
            slot = self.names.new(ros_name(unit.name or "core"))
            self.slots[unit.name] = slot
            self.kinds[slot] = taken[definition, hz]
            yield slot, {"type": taken[definition, hz], "source": self._at(unit)}
        if not self.units:
            self._remark(f"no processing unit is stated: {ONE} is taken for the computer")

    def _homes(self) -> tuple[dict[str, list[str]], dict[str, int]]:
        """The processors of each task, as it is mapped, and its priority."""
        of_scheduler: dict[str, list[str]] = {}
        for item in self.parts.get("schedulerAllocation", ()):
            units = item.refers("responsibility") or item.refers("executingPU")
            for name in item.refers("scheduler"):
                of_scheduler.setdefault(name, []).extend(self.slots[unit] for unit in units if unit in self.slots)
        homes: dict[str, list[str]] = {}
        priorities: dict[str, int] = {}
        for item in (*self.parts.get("taskAllocation", ()), *self.parts.get("isrAllocation", ())):
            units = [self.slots[unit] for unit in item.refers("affinity") if unit in self.slots]
            units = units or [slot for name in item.refers("scheduler") for slot in of_scheduler.get(name, ())]
            stated = _priority(item)
            for name in (*item.refers("task"), *item.refers("isr")):
                homes[name] = list(dict.fromkeys(units))
                if stated is not None:
                    priorities[name] = stated
        return homes, priorities

    # --- tasks

    def _threads(self, slots: Sequence[str]) -> Iterator[tuple[str, dict[str, Any]]]:
        homes, priorities = self._homes()
        has_all = all(task.name in priorities for task in self.tasks)
        if priorities and not has_all:
            self._remark("priorities are left out: not every task has one")
        free = [task.name for task in self.tasks if not homes.get(task.name)]
        if free and len(slots) > 1:
            words = "1 task is" if len(free) == 1 else f"{len(free)} tasks are"
            self._remark(f"{words} mapped to no processing unit: each may be on any", hint=free[0])
        for task in self.tasks:
            name = self.names.new(ros_name(task.name or "task"))
            self.threads[task.name] = name
            self.places["threads", name] = Place(str(self.path), task.line, 1)
            where = homes.get(task.name) or list(slots)
            body: dict[str, Any] = {"processor": where[0] if len(where) == 1 else where}
            body |= self._activation(task)
            times = self._times(task, list(dict.fromkeys(self.kinds[slot] for slot in where)))
            body |= {"compute_execution_time": times} if times else {}
            body |= {"priority": priorities[task.name]} if has_all else {}
            count = len(self.runs[task.name])
            body["source"] = self._at(task, f"{count} runnable{'' if count == 1 else 's'}")
            yield name, body

    def _activation(self, task: Element) -> dict[str, Any]:
        """How often a task runs: by its first stimulus that says it."""
        stimuli = [self.stimuli[name] for name in task.refers("stimuli") if name in self.stimuli]
        for item in stimuli:
            if (period := _period_ns(item)) is not None:
                if len(stimuli) > 1:
                    self._remark(f"{task.name} has {len(stimuli)} stimuli: {item.name} counts", task)
                offset = next(iter(item.of("offset")), None)
                if offset is not None and _quantity(offset, TIMES_NS):
                    self._remark(f"the offset of {item.name} is not counted", offset, "state `offset` of its threads")
                protocol = "periodic" if item.kind == "PeriodicStimulus" else "sporadic"
                return {"dispatch_protocol": protocol, "period": format_duration(max(1, round(period)))}
        if any(item.name in self.triggers for item in stimuli):
            return {"dispatch_protocol": "aperiodic"}
        kinds = ", ".join(item.kind or item.tag for item in stimuli) or "no stimulus"
        self._remark(f"nothing says how often {task.name} runs ({kinds})", task, "state its `period`")
        return {"dispatch_protocol": "periodic"}

    def _read_runs(self) -> None:
        """Read the runnables of each task, and the stimuli of others that it triggers."""
        for task in self.tasks:
            self.runs[task.name] = list(self._called(task, ()))
            for item in (part for one in (task, *self.runs[task.name]) for part in one.all()):
                if item.kind == "InterProcessTrigger":
                    for name in item.refers("stimulus"):
                        self.triggers.setdefault(name, {})[task.name] = None

    def _called(self, item: Element, within: tuple[str, ...]) -> Iterator[Element]:
        """The runnables that a task or runnable calls, each before those that it calls itself."""
        for part in item.all():
            for name in part.refers("runnable"):
                if name not in self.runnables:
                    self._remark(f"there is no runnable {name[:80]}: the call is left out", part)
                elif name in within or len(within) > DEEPEST:
                    self._remark(f"the runnable {name[:80]} calls itself: the call is left out", part)
                else:
                    yield self.runnables[name]
                    yield from self._called(self.runnables[name], (*within, name))

    def _ticks(self, item: Element, kind: str, within: tuple[str, ...], depth: int = 0) -> tuple[Fraction, Fraction]:
        """The fewest and most ticks of an element: of what is in it and what it calls, one branch of each switch."""
        spend()
        if depth > DEEPEST:
            raise ProblemError(
                [Diagnostic("calls are too deep within each other", file=str(self.path), line=item.line)]
            )
        if item.kind in NEEDS or item.tag in NEEDS:
            bounds = _bounds(item, kind)
            if bounds is None:
                self._remark(f"the time of {item.kind or item.tag} is not understood and left out", item)
            return bounds or (Fraction(0), Fraction(0))
        is_switch = item.kind in SWITCHES
        parts = list(item.of("entries", "defaultEntry")) if is_switch else item.parts
        ends = [self._ticks(part, kind, within, depth + 1) for part in parts]
        for name in item.refers("runnable"):
            if name in self.runnables and name not in within:
                ends.append(self._ticks(self.runnables[name], kind, (*within, name), depth + 1))
        if not is_switch:
            return sum((one[0] for one in ends), Fraction(0)), sum((one[1] for one in ends), Fraction(0))
        is_sure = "Probability" in item.kind or any(True for _ in item.of("defaultEntry"))
        least = min((one[0] for one in ends), default=Fraction(0)) if is_sure else Fraction(0)
        return least, max((one[1] for one in ends), default=Fraction(0))

    def _times(self, task: Element, kinds: Sequence[str]) -> Any:
        """The times of a task: a range, or one for each type of processor; None where not known."""
        times: dict[str, str] = {}
        for kind in kinds:
            hz = self.hz[kind]
            least, most = self._ticks(task, kind, ())
            if not most:
                return None
            if not hz:
                if kind not in self.slow:
                    self.slow.add(kind)
                    words = f"no frequency of {kind} is stated: times are left out"
                    self._remark(words, None, "give --frequency '200 MHz'")
                return None
            ns = [least * 10**9 / hz, most * 10**9 / hz]
            times[kind] = format_time_range(TimeRange(int(ns[0]), -int(-ns[1] // 1)))
        return next(iter(times.values())) if len(set(times.values())) == 1 else times

    # --- labels, chains

    def _connections(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """The connections by labels: one for each pair of tasks, with the sizes of the labels."""
        sizes = {item.name: next(iter(item.of("size")), None) for item in self.parts.get("labels", ())}
        writers: dict[str, dict[str, None]] = {}
        readers: dict[str, dict[str, None]] = {}
        for task in self.tasks:
            for access in (item for one in (*self.runs[task.name], task) for item in one.all()):
                if access.kind == "LabelAccess" or "access" in access.attributes:
                    of = writers if "write" in access.attributes.get("access", "").lower() else readers
                    for label in access.refers("data"):
                        of.setdefault(label, {})[task.name] = None
        together: dict[tuple[str, str], list[str]] = {}
        for label, tasks in writers.items():
            for source in tasks:
                for target in readers.get(label, ()):
                    spend()
                    if source != target:
                        together.setdefault((source, target), []).append(label)
        unsized = 0
        for (source, target), labels in together.items():
            name = self.names.new(f"{self.threads[source]}.to.{self.threads[target]}")
            self.wires[source, target] = name
            bits = [_quantity(size, BITS) if (size := sizes.get(label)) is not None else None for label in labels]
            unsized += sum(item is None for item in bits)
            total = sum((item for item in bits if item is not None), Fraction(0))
            body: dict[str, Any] = {"from": self.threads[source], "to": self.threads[target], "port": "data"}
            body |= {"data_size": f"{-(-total // 8)} B"} if total else {}
            words = f"{len(labels)} label{'' if len(labels) == 1 else 's'}: {', '.join(labels[:8])}"
            body["source"] = f"{self.path.name}: {words}"[:MOST_SOURCE]
            yield name, body
        if unsized:
            self._remark(f"labels without a size count as 0 B: {unsized}")

    def _dispatches(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Which task triggers which: a connection that dispatches the other one."""
        for target in self.tasks:
            stimuli = [item for item in target.refers("stimuli") if item in self.triggers]
            timed = any(_period_ns(self.stimuli[item]) for item in target.refers("stimuli") if item in self.stimuli)
            for source in dict.fromkeys(task for item in stimuli for task in self.triggers[item]):
                if timed or source == target.name:
                    self._remark(f"{target.name} runs by its period: that {source} triggers it is not counted", target)
                    continue
                name = self.names.new(f"{self.threads[source]}.triggers.{self.threads[target.name]}")
                self.wires[source, target.name] = name
                ends = {"from": self.threads[source], "to": self.threads[target.name]}
                yield name, {**ends, "port": "event", "source": self._at(target, f"triggered by {source}")}

    def _flows(self) -> tuple[dict[str, Any], list[str]]:
        """Event chains as flows, and the limits on their latencies."""
        events = {item.name: item for item in self.parts.get("events", ())}
        of_runnable: dict[str, list[str]] = {}
        for task, runnables in self.runs.items():
            for item in runnables:
                of_runnable.setdefault(item.name, []).append(task)
        flows: dict[str, Any] = {}
        names, requirements = UniqueNames(), []
        known: dict[str, str] = {}
        for chain in self.parts.get("eventChains", ()):
            path = self._path(chain, events, of_runnable)
            if path is None:
                continue
            name = names.new(ros_name(chain.name or "chain"))
            known[chain.name] = name
            flows[name] = {"path": path, "source": self._at(chain)}
        self._tell_limits()
        for item in self.parts.get("timingConstraints", ()):
            most = next(iter(item.of("maximum")), None)
            limit = _quantity(most, TIMES_NS) if most is not None else None
            for scope in item.refers("scope") if item.kind == "EventChainLatencyConstraint" else ():
                if scope in known and limit:
                    metric = METRICS.get(item.attributes.get("type", ""), "latency")
                    requirements.append(f"{metric} of {_quoted(known[scope])} <= {format_duration(int(limit))}")
        return flows, requirements

    def _tell_limits(self) -> None:
        """The limits that are none on the latency of an event chain, counted by their kind."""
        kinds: dict[str, int] = {}
        for item in (*self.parts.get("timingConstraints", ()), *self.parts.get("requirements", ())):
            if item.kind != "EventChainLatencyConstraint":
                kinds[item.kind or item.tag] = kinds.get(item.kind or item.tag, 0) + 1
        for kind, number in kinds.items():
            self._remark(f"limits of the kind {kind[:80]} are left out: {number}", None, "state `requirements`")

    def _path(
        self, chain: Element, events: Mapping[str, Element], of_runnable: Mapping[str, Sequence[str]]
    ) -> list[str] | None:
        """The tasks of a chain, with the connections between them; None where it is no way, with a remark."""
        if any(True for item in chain.of("strands")) or chain.attributes.get("itemType", "sequence") != "sequence":
            self._remark(f"the event chain {chain.name} is left out: it has parallel paths", chain)
            return None
        links = [item for item in chain.all() if item is not chain and "stimulus" in item.attributes] or [chain]
        named = [name for link in links for key in ("stimulus", "response") for name in link.refers(key)]
        tasks: list[str] = []
        for name in named:
            task = self._task_of(events.get(name), of_runnable, tasks[-1:])
            if task is None:
                self._remark(f"the event chain {chain.name} is left out: {name} is an event of no task", chain)
                return None
            tasks += [task] if tasks[-1:] != [task] else []
        path = [self.threads[tasks[0]]]
        for source, target in pairwise(tasks):
            if (source, target) not in self.wires:
                words = f"no label or trigger leads from {source} to {target}"
                self._remark(f"the event chain {chain.name} is left out: {words}", chain)
                return None
            path += [self.wires[source, target], self.threads[target]]
        if len(path) < 3:
            self._remark(f"the event chain {chain.name} is left out: it is within one task", chain)
            return None
        return path

    def _task_of(
        self, event: Element | None, of_runnable: Mapping[str, Sequence[str]], before: Sequence[str]
    ) -> str | None:
        """The task of an event: its own, or one that runs its runnable, the one before where that does."""
        if event is None:
            return None
        for name in (*event.refers("entity"), *event.refers("process"), *event.refers("runnable")):
            if name in self.threads:
                return name
            tasks = of_runnable.get(name, ())
            if tasks:
                return next((task for task in before if task in tasks), tasks[0])
        return None


def _quoted(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z_][\w.]*", name) else "'" + name.replace("'", "") + "'"


def _figure(text: str) -> Fraction | None:
    return Fraction(text) if len(text) < LONGEST_NUMBER and _NUMBER.fullmatch(text) else None


def _quantity(item: Element, units: Mapping[str, Fraction | int]) -> Fraction | None:
    """The value of an element with its unit, in the least unit; None where it has none."""
    number = _figure(item.attributes.get("value", ""))
    unit = units.get(item.attributes.get("unit", ""))
    return None if number is None or unit is None or number < 0 else number * unit


def _period_ns(stimulus: Element) -> Fraction | None:
    """The period of a stimulus, or the least time between two of one that comes now and then."""
    tags = ("recurrence", "minDistance", "timeBetween", "stimulusDeviation", "nextOccurrence")
    for item in stimulus.of(*tags):
        for one in item.all():
            if one.tag in ("recurrence", "minDistance", "timeBetween", "lowerBound", "nextOccurrence", "min"):
                period = _quantity(one, TIMES_NS)
                if period:
                    return period
    return None


def _bounds(need: Element, kind: str) -> tuple[Fraction, Fraction] | None:
    """The fewest and most ticks of an element: stated for the type of processor, or for all."""
    own = [item for item in need.of("extended") if ros_name(next(iter(item.refers("key")), "")) == kind]
    chosen = [part for item in own for part in (item.parts or [item])] or [
        item for item in need.parts if item.tag not in ("extended", "customProperties")
    ]
    for item in (*chosen, need):
        least, most = (_bound(item, key) for key in ("lowerBound", "upperBound"))
        value = _figure(item.attributes.get("value", ""))
        least, most = (value if bound is None else bound for bound in (least, most))
        if least is not None and most is not None and 0 <= least <= most:
            return least, most
    return None


def _bound(item: Element, key: str) -> Fraction | None:
    """A bound of a distribution: an attribute, or a part with a value, at any depth."""
    if key in item.attributes:
        return _figure(item.attributes[key])
    return next((_figure(one.attributes.get("value", "")) for one in item.all() if one.tag == key), None)


def _priority(allocation: Element) -> int | None:
    """The priority of a task, as its allocation states it."""
    for item in allocation.of("schedulingParameters", "schedulingParameter"):
        text = item.attributes.get("priority", "")
        if item.attributes.get("key") == "priority":
            text = next((one.attributes["value"] for one in item.all() if "value" in one.attributes), "")
        if re.fullmatch(r"\d{1,9}", text):
            return int(text)
    return None
