"""A design for other tools: ROS 2 parameters with the rates, cores and priorities as CSV, Graphviz, GraphML."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction

from dse.analysis.diagnosis.front_verdicts import core_by, cores_of
from dse.analysis.rates import rate_hz
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.views import View
from dse.answers.result import csv_text
from dse.answers.tables.display import exact
from dse.answers.tables.graph import architecture_graph
from dse.space.model.space import EMPTY, Design, Space, at_home
from dse.space.model.trees import at
from dse.spec.loading.writing import yaml_text
from dse.spec.schema.model import Ros2
from dse.spec.schema.ros2 import Parameter, read_parameter
from dse.support.errors import UsageError


def ros2_parameters(space: Space, design: Design, title: str, names: Ros2 | None = None) -> str:
    """A ROS 2 parameter file: a node per process (or per thread without one), with rates and periods of threads.

    Node and parameter names become what ROS allows; where that changes one, the original is in a comment. Rates are
    those of activation, in Hz. On a processor with several cores ``cpu_affinity`` holds the CPU to pin a thread to,
    counted from 0 as operating systems do: response times hold on these cores only. ROS itself does not look at it.
    `names` has the nodes' full names and the user's own parameters, which then stand in place of ours.
    """
    return "\n".join([f"# {_line(title)}", *_nodes(space, design, names or Ros2())]) + "\n"


def _nodes(space: Space, design: Design, names: Ros2) -> Iterator[str]:
    view, cores = View(design), cores_of(space, design)
    nodes: dict[str, list[int]] = {}
    same: dict[str, str] = {}
    for number, component in enumerate(space.components):
        if component.section == "threads" and space.is_last_piece(number):
            own = names.nodes.get(component.name)  # of several nodes in one process
            name = (
                same.setdefault(own, component.name)
                if own
                else at(at_home(space.components, number).process, view) or component.name
            )
            nodes.setdefault(name, []).append(number)
    stated_of: dict[str, list[Parameter]] = {}
    for key, text in names.parameters.items():
        parameter = read_parameter(key, text)
        if isinstance(parameter, Parameter):
            stated_of.setdefault(parameter.thread, []).append(parameter)
    taken = set(names.nodes.values())
    for name, numbers in nodes.items():
        full = _node_name(space, name, numbers, names, view)
        yield f"{full}:" if full is not None else f"{_unique(name, taken)}:{_original(name)}"
        yield "  ros__parameters:"
        inside: set[str] = set()
        stated = [item for number in numbers for item in stated_of.get(space.components[number].name, ())]
        if stated:
            yield from _own_parameters(space, stated, view)
            continue
        for number in numbers:
            component = space.components[number]
            indent = "    "
            if component.name != name:
                local = component.name.removeprefix(f"{name}.")
                yield f"{indent}{_unique(local, inside)}:{_original(local)}"
                indent += "  "
            for line in _parameters(space, number, view, cores.get(number)):
                yield indent + line


def _node_name(space: Space, name: str, numbers: Sequence[int], names: Ros2, view: View) -> str | None:
    """The full name of a node: that of the process, of the thread, or of the executor of all of its threads."""
    executors = {at(space.components[number].executor, view) for number in numbers}
    of_all = next(iter(executors)) if len(executors) == 1 else None
    candidates = [name, space.executors[of_all].name if of_all is not None else name]
    return next((names.nodes[item] for item in candidates if item in names.nodes), None)


def _own_parameters(space: Space, stated: Sequence[Parameter], view: View) -> Iterator[str]:
    """The parameters that the user names, with the chosen figures."""
    numbers = {component.name: number for number, component in enumerate(space.components)}
    for item in stated:
        period = at(space.components[numbers[item.thread]].period_ns, view)
        rate = rate_hz(space, ("activation", numbers[item.thread]), view)
        if item.field == "period" and period is None:
            raise UsageError(f"{item.thread} has no period in this design, which the parameter {item.name} would have")
        offset = at(space.components[numbers[item.thread]].offset_ns, view)
        if item.field == "offset" and offset is None:
            raise UsageError(f"{item.thread} has no known offset in this design, which {item.name} would have")
        value = item.value(Fraction(period or 0), Fraction(rate), Fraction(offset or 0))
        if item.is_whole and value.denominator != 1:
            raise UsageError(f"{item.name}: {float(value):g} {item.unit} is no whole number")
        text = str(value) if item.is_whole else _float(float(value))
        yield f"    {yaml_text(item.name)}: {text}  # {_line(item.thread)}, {item.field} [{item.unit}]"


def _parameters(space: Space, number: int, view: View, core: int | None) -> Iterator[str]:
    """Protocol, period, rate and place of a thread; `core` is where it is to be pinned, where there are several."""
    component = space.components[number]
    period, rate = at(component.period_ns, view), rate_hz(space, ("activation", number), view)
    protocol = at(component.protocol, view) or ("aperiodic" if period is None else "periodic")
    yield f"dispatch_protocol: {yaml_text(str(protocol))}"
    if period is not None:
        yield f"period_s: {_float(period / 10**9)}"
    offset = at(component.offset_ns, view)
    if offset is not None:
        yield f"offset_s: {_float(offset / 10**9)}  # of its first release on the clock"
    yield f"rate_hz: {_float(float(rate))}"
    processor = at(component.processor, view)
    if processor is None:
        return
    name = _line(space.processors[processor].name)
    if core is None:
        yield f"# runs on {name}"
        return
    yield f"cpu_affinity: [{core - 1}]  # runs on {name}, core {core}, {core_by(space, component, view)}"


PINNING = (
    "thread", "executor", "processor", "type", "core", "cpu", "chosen_by", "level", "period_ns", "response_ns",
)  # fmt: skip
PINNED = "# Response times hold where each thread is pinned to its cpu (taskset, pthread_setaffinity_np) at its level."


def pinning_table(space: Space, design: Design, title: str) -> str:
    """Where each thread of a processor runs, as CSV: one line of a thread or callback, by processor, core and level.

    ``core`` counts from 1, ``cpu`` from 0 as operating systems do; ``chosen_by`` is whose choice it is (`core_by`);
    ``level`` 1 goes first on its core, threads of one level share it; ``response_ns`` is empty without a bound.
    """
    view = View(design)
    rows: list[Sequence[object]] = [PINNING]
    for number, slot in enumerate(space.processors):
        kind = slot.types[view[slot.type_decision]]
        for item in processor_responses(space, number, view) if kind != EMPTY else ():
            component = space.components[item.component]
            period = at(component.period_ns, view)
            place = (slot.name, kind, item.core, item.core - 1, core_by(space, component, view), item.rank)
            response = "" if item.response_ns is None else exact(item.response_ns)
            rows.append((item.name, item.executor, *place, "" if period is None else period, response))
    return f"# {_line(title)}\n{PINNED}\n{csv_text(rows)}"


def _float(value: float) -> str:
    """A number that ROS reads as a double: with a point and without an exponent."""
    text = f"{value:.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _unique(name: str, taken: set[str]) -> str:
    """A ROS name: letters, digits and underscores, no digit first; numbered where another one has it."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "node"
    plain = f"n_{plain}" if plain[0].isdigit() else plain
    found, number = plain, 2
    while found in taken:
        found, number = f"{plain}_{number}", number + 1
    taken.add(found)
    return yaml_text(found)


def _original(name: str) -> str:
    return "" if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) else f"  # {_line(name)}"


def _line(text: str) -> str:
    return "".join(char if char.isprintable() else " " for char in text)


def graphviz(space: Space, design: Design) -> str:
    """The architecture in the DOT language: components, slots, connections and bindings."""
    graph = architecture_graph(space, design)
    lines = [f"digraph {_dot(space.name)} {{", "  rankdir=LR; node [shape=box, style=rounded];"]
    shapes = {"processor": "box3d", "bus": "cds", "device": "box"}
    numbers = {name: f"n{number}" for number, name in enumerate(graph.nodes)}
    for name, facts in graph.nodes(data=True):
        details = [facts.get("type"), facts.get("dispatch_protocol")]
        if facts.get("period_ns") is not None:
            details.append(f"{facts['period_ns'] / 1e6:g} ms")
        label = "\n".join([name, *(str(item) for item in details if item and item != name)])
        shape = f", shape={shapes[facts['kind']]}" if facts["kind"] in shapes else ""
        lines.append(f"  {numbers[name]} [label={_dot(label)}{shape}];")
    for source, target, key, facts in graph.edges(keys=True, data=True):
        ends = f"{numbers[source]} -> {numbers[target]}"
        if facts["kind"] == "connection":
            path = " over ".join(facts["buses"])
            label = f"{key}\n{path}" if path else key
            lines.append(f"  {ends} [label={_dot(label)}];")
        else:
            core = graph.nodes[source].get("core")
            label = f"{facts['kind']}\ncore {core}" if core is not None else facts["kind"]
            lines.append(f"  {ends} [label={_dot(label)}, style=dashed, arrowhead=none];")
    return "\n".join([*lines, "}"]) + "\n"


def _dot(text: str) -> str:
    """A quoted string; a line break becomes one of Graphviz's."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def graphml(space: Space, design: Design) -> str:
    """The architecture as GraphML; the buses of a connection are one text."""
    import networkx

    graph = architecture_graph(space, design)
    for _, _, facts in graph.edges(data=True):
        for name, value in list(facts.items()):
            if value is None:
                del facts[name]
            elif isinstance(value, list):
                facts[name] = " over ".join(value)
    out = io.BytesIO()
    networkx.write_graphml(graph, out)
    return out.getvalue().decode() + "\n"
