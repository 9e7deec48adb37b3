"""The paths of flows as AADL has them: components and connections in turn, and what is stated of them there."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Any, NamedTuple

from dse.answers.exports.aadl.names import times
from dse.support.errors import UsageError

PORT_TIMES = {"compute_execution_time": "Compute_Execution_Time", "response_time": "SEI::Response_Time"}


class PathStep(NamedTuple):
    """A component (``""``: what is around the system) or connection; a component with the connections around it.

    `before` and `after` name the neighbours on the path, empty at the ends.
    """

    kind: str
    name: str
    before: str
    after: str


def steps_of(path: list[Any], components: Container[str], wires: Mapping[str, Mapping[str, Any]]) -> list[PathStep]:
    """Components and connections in turn, each component with the connections before and behind it ("": none).

    `path` is a flow of the problem file; where two components follow each other, the connection between them is
    inserted.
    """
    flat: list[tuple[str, str]] = []
    for item in (one["element"] if isinstance(one, dict) else one for one in path):
        kind = "component" if item in components else "connection"
        if kind == "component" and flat and flat[-1][0] == "component":
            flat.append(("connection", _between(wires, flat[-1][1], item)))
        flat.append((kind, item))
    if flat[0][0] == "connection":
        flat.insert(0, ("component", wires[flat[0][1]].get("from", "")))
    if flat[-1][0] == "connection":
        flat.append(("component", wires[flat[-1][1]].get("to", "")))
    steps = []
    for number, (kind, item) in enumerate(flat):
        before = flat[number - 1][1] if number else ""
        after = flat[number + 1][1] if number + 1 < len(flat) else ""
        steps.append(PathStep(kind, item, before, after))
    return steps


def whole_path(
    path: list[Any], flows: Mapping[str, Mapping[str, Any]], components: Container[str], wires: Container[str]
) -> list[Any]:
    """A path with what stands for other flows written out.

    Recursive: a flow in a flow may contain further flows. `flows` has the entries of the file by name.
    """
    elements: list[Any] = []
    for item in path:
        if isinstance(item, str) and item not in components and item not in wires and item in flows:
            elements += whole_path(flows[item]["path"], flows, components, wires)
        else:
            elements.append(item)
    return elements


def placed_flows(
    path: list[Any], steps: list[PathStep], flows: Mapping[str, list[PathStep]], components: Container[str]
) -> dict[int, tuple[int, str]]:
    """The flows that stand in a path, by their first step there: the last one, and the flow.

    `steps` are those of the path, `flows` those of each flow; nothing where one of them is not met as it is alone.
    """
    placed, number = {}, 0
    for item in path:
        name = item["element"] if isinstance(item, dict) else item
        is_flow = not isinstance(item, dict) and name in flows and name not in components
        is_flow = is_flow and not any(step.kind == "connection" and step.name == name for step in steps)
        there = [(step.kind, step.name) for step in flows[name]] if is_flow else [("", name)]
        while number < len(steps) and steps[number].name != there[0][1]:
            number += 1  # a connection between two components that the path does not name
        if is_flow:
            if [(step.kind, step.name) for step in steps[number : number + len(there)]] != there:
                return {}
            placed[number] = (number + len(there) - 1, str(name))
        number += len(there)
    return placed


def stated_in(path: list[Any], steps: list[PathStep], components: Container[str]) -> Iterator[tuple[int, Any]]:
    """The steps of a path with figures of their own, by number, and these.

    Pairs of the position in `steps` and the mapping of the file, which has the element's own figures.
    """
    numbers = [number for number, step in enumerate(steps) if step.kind == "component"]
    items = [item for item in path if isinstance(item, dict) or item in components]
    skipped = not isinstance(path[0], dict) and path[0] not in components
    for number, item in zip(numbers[skipped:], items, strict=False):
        if isinstance(item, dict):
            yield number, item


def entered_times(
    flows: Mapping[str, Mapping[str, Any]], components: Container[str], wires: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, str]]:
    """The times that AADL states at the ports that connections enter by, by connection.

    Raises
    ------
    UsageError
        where flows by one port state different ones.
    """
    times_of: dict[str, dict[str, str]] = {}
    for flow, entry in flows.items():
        path = whole_path(entry["path"], flows, components, wires)
        steps = steps_of(path, components, wires)
        for number, item in stated_in(path, steps, components):
            texts = {word: times(item[key]) for key, word in PORT_TIMES.items() if key in item}
            known = {word: text for word, text in texts.items() if text is not None}
            before = steps[number].before
            if known != texts or (texts and not before) or times_of.get(before, known) != known:
                raise UsageError(f"AADL cannot say which times {item['element']} has in flow {flow}")
            if known:
                times_of[before] = known
    return times_of


def _between(wires: Mapping[str, Mapping[str, Any]], one: str, other: str) -> str:
    return next(name for name, item in wires.items() if item.get("from") == one and item.get("to") == other)
