"""A design for other tools: parameters of ROS 2 nodes, cores and priorities as CSV, Graphviz, GraphML."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from dse.analysis.diagnosis.front_verdicts import core_by
from dse.analysis.rates import rate_hz
from dse.analysis.scheduling.responses import processor_responses
from dse.analysis.views import View
from dse.answers.result import csv_text
from dse.answers.tables.display import exact
from dse.answers.tables.graph import architecture_graph
from dse.space.model.space import EMPTY, Component, Design, Space, at_home
from dse.space.model.trees import at
from dse.space.parameters import KIND as PARAMETER
from dse.spec.loading.writing import yaml_text
from dse.spec.quantities.totals import in_unit_of
from dse.spec.schema.model import Ros2
from dse.spec.schema.ros2 import FIELDS, Parameter, read_parameter
from dse.support.errors import UsageError
from dse.support.units import Total, UnitError, format_duration


def ros2_parameters(space: Space, design: Design, title: str, names: Ros2 | None = None) -> str:
    """A ROS 2 parameter file: what each node declares for the rates, periods and offsets of its threads, as chosen.

    A node ignores what it does not declare, so that only the parameters stand here that the problem states
    (``ros2: parameters``), under the nodes' full names where it states these. Threads without any are in a comment.

    Raises
    ------
    UsageError
        when the problem states no parameters, or one has no value in this design.
    """
    names = names or Ros2()
    if not names.parameters and not own_parameters(space):
        hint = (
            "state what the nodes declare under `ros2: parameters`, as `dse import` of launch and parameter files does"
        )
        raise UsageError(f"the problem states no parameters of nodes: {hint}")
    return "\n".join([f"# {in_comment(title)}", PLACES, *_nodes(space, design, names)]) + "\n"


def own_parameters(space: Space) -> Mapping[str, Sequence[str]]:
    """The parameters with a value that threads state, by thread."""
    parameters: dict[str, list[str]] = {}
    for reference in space.references.values():
        if reference.kind == PARAMETER:
            thread, _, name = reference.name.rpartition(".")
            parameters.setdefault(thread, []).append(name)
    return parameters


def _nodes(space: Space, design: Design, names: Ros2) -> Iterator[str]:
    view = View(design)
    stated_of: dict[str, list[Parameter]] = {}
    for key, text in names.parameters.items():
        parameter = read_parameter(key, text)
        if isinstance(parameter, Parameter):
            stated_of.setdefault(parameter.thread, []).append(parameter)
    for thread, declared_names in own_parameters(space).items():
        called = {item.field for item in stated_of.get(thread, ())}
        declared = [Parameter(thread, name, name, "", False) for name in declared_names if name not in called]
        stated_of.setdefault(thread, []).extend(declared)
    nodes: dict[str, list[int]] = {}
    same: dict[str, str] = {}
    others: list[str] = []
    unsaid: list[str] = []
    for number, component in enumerate(space.components):
        if component.section != "threads" or component.part_of or not space.is_last_piece(number):
            continue
        if component.name not in stated_of:
            others.append(component.name)
        said = {item.field for item in stated_of.get(component.name, ())}
        unsaid += _chosen_without_parameter(space, component, said, view)
        own = names.nodes.get(component.name)  # of several nodes in one process
        process = at(at_home(space.components, number).process, view)
        nodes.setdefault(same.setdefault(own, component.name) if own else process or component.name, []).append(number)
    if others:
        yield f"# Without a stated parameter, so that their nodes keep what they have: {in_comment(', '.join(others))}"
    if unsaid:
        yield f"# Chosen, but not written, for no parameter of a node is stated for it: {in_comment(', '.join(unsaid))}"
    taken = set(names.nodes.values())
    for name, numbers in nodes.items():
        stated = [item for number in numbers for item in stated_of.get(space.components[number].name, ())]
        if stated:
            full = _node_name(space, name, numbers, names, view)
            yield f"{full}:" if full is not None else f"{_unique(name, taken)}:{_original(name)}"
            yield "  ros__parameters:"
            yield from _own_parameters(space, stated, view)


def _chosen_without_parameter(space: Space, component: Component, said: set[str], view: View) -> Iterator[str]:
    """The period and offset of a thread that were chosen from several and that no parameter has."""
    chosen = {
        "period": None if {"period", "rate"} & said else at(component.period_ns, view),
        "offset": None if "offset" in said else at(component.offset_ns, view),
    }
    is_open = {item.name: item.is_open for item in space.decisions}
    for key, value_ns in chosen.items():
        if value_ns is not None and is_open.get(f"{component.name}.{key}"):
            yield f"{component.name}.{key} {format_duration(value_ns)}"


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
        if item.field not in FIELDS:
            yield _own_parameter(space, item, view)
            continue
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
        yield f"    {yaml_text(item.name)}: {text}  # {in_comment(item.thread)}, {item.field} [{item.unit}]"


def _own_parameter(space: Space, item: Parameter, view: View) -> str:
    """A parameter of the thread itself, with its value: a whole number where it has no unit and all of them are."""
    reference = space.references[f"{item.thread}.{item.field}"]
    chosen: Total = at(reference.tree, view)
    value, unit = chosen.value, chosen.unit
    if item.unit:
        try:
            value, unit = in_unit_of([Total(value, item.unit)], chosen)
        except UnitError as error:
            raise UsageError(f"{item.name}: {error.message}") from error
    values = [one for one in reference.texts if isinstance(one, Total)]
    is_whole = item.is_whole or (not unit and all(one.value.denominator == 1 for one in values))
    if is_whole and value.denominator != 1:
        raise UsageError(f"{item.name}: {float(value):g} {unit} is no whole number")
    text = str(value) if is_whole else _float(float(value))
    comment = f"{item.thread}, {item.field}" + (f" [{unit}]" if unit else "")
    return f"    {yaml_text(item.name)}: {text}  # {in_comment(comment)}"


PINNING = (
    "thread", "executor", "processor", "type", "core", "cpu", "chosen_by", "level", "period_ns", "response_ns",
)  # fmt: skip
PLACES = "# Cores and priorities are no parameters: --format pinning and --format cie write them."
PINNED = "# Response times hold where each thread is pinned to its cpu (taskset, pthread_setaffinity_np) at its level."


def pinning_table(space: Space, design: Design, title: str) -> str:
    """The core of each thread of a processor, as CSV: one line of a thread or callback, by processor, core and level.

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
    return f"# {in_comment(title)}\n{PINNED}\n{csv_text(rows)}"


def _float(value: float) -> str:
    """A number that ROS reads as a double: with a point and without an exponent."""
    text = f"{value:.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _unique(name: str, taken: set[str]) -> str:
    """A ROS name: letters, digits and underscores, no digit first; numbered where another one has it."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "node"
    plain = f"n_{plain}" if plain[0].isdigit() else plain
    unique, number = plain, 2
    while unique in taken:
        unique, number = f"{plain}_{number}", number + 1
    taken.add(unique)
    return yaml_text(unique)


def _original(name: str) -> str:
    return "" if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) else f"  # {in_comment(name)}"


def in_comment(text: str) -> str:
    """Text that stays within one line of comment: each character that cannot be printed becomes a blank."""
    return "".join(char if char.isprintable() else " " for char in text)


def graphviz(space: Space, design: Design) -> str:
    """The architecture in the DOT language: components, slots, connections and bindings.

    Text for ``dot``. Nodes are labelled with name, type and period in ms, edges with connection and bus.
    """
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
    """The architecture as GraphML; the buses of a connection are one text.

    XML text for tools such as yEd or NetworkX; attributes that a part does not have are left out.
    """
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
