"""The flows of a problem as end-to-end flows: through processes, within one of them, or composed of other flows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from dse.answers.exports.aadl.names import extra, quoted, times
from dse.answers.exports.aadl.package import ComponentDraft, kind_of
from dse.answers.exports.aadl.paths import PathStep, placed_flows, stated_in, steps_of, whole_path
from dse.importers.aadl.property_set import OURS
from dse.support.errors import UsageError


@dataclass
class FlowWriter:
    """Writes flows into parts that have their features and connections.

    `parts` are components by name, `links` the names of connections; `end` gives the part of a step ("" is what is
    around the system), `process_of` the process of a part, `named` a name that is not taken, and `is_inside` whether a
    connection stays in one process. `latencies` are those that components state.
    """

    flows: Mapping[str, Mapping[str, Any]]
    wires: Mapping[str, Mapping[str, Any]]
    parts: Mapping[str, ComponentDraft]
    links: Mapping[str, str]
    latencies: Mapping[str, Any]
    root: ComponentDraft
    end: Callable[[str], ComponentDraft]
    process_of: Callable[[ComponentDraft], ComponentDraft | None]
    named: Callable[[str], str]
    is_inside: Callable[[Mapping[str, Any]], bool]
    profile: str
    steps: dict[str, list[PathStep]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)

    def write(self) -> None:
        """All flows, in their order.

        Lines are added to the drafts of processes and of the root system. Raises `UsageError` for a flow of one
        component, which AADL cannot state.
        """
        for name, entry in self.flows.items():
            self.names[name] = self.named(name)
            self.steps[name] = steps_of(self._whole(entry), self.parts, self.wires)
            if len(self.steps[name]) == 1:
                raise UsageError(
                    f"AADL cannot say flow {name}: it is one component, and a flow of AADL has a connection"
                )
        for name, entry in self.flows.items():
            process = self._around(name)
            inner = self._inner(name, entry)
            elements = self._elements(name, entry, inner)
            texts = elements if process is not None else list(self._lifted(name, elements, inner))
            line = f"{self.names[name]} : end to end flow {' -> '.join(texts)}{_block(name, entry)};"
            (process or self.root).flow_implementations.append(line)

    def _whole(self, entry: Mapping[str, Any]) -> list[Any]:
        return whole_path(entry["path"], self.flows, self.parts, self.wires)

    def _around(self, name: str) -> ComponentDraft | None:
        """The process that a flow stays within, which then declares it; None where the system does."""
        steps = self.steps[name]
        process = self.process_of(self.end(steps[0].name))
        inside = (self.is_inside(self.wires[step.name]) for step in steps if step.kind == "connection")
        return process if process is not None and all(inside) else None

    def _inner(self, name: str, entry: Mapping[str, Any]) -> dict[int, tuple[int, str]]:
        """The flows that this one is composed of, by their first step: the last one, and the flow.

        AADL has such flows where connections of the system join them; others are written out, which OSATE counts
        otherwise.
        """
        steps = self.steps[name]
        inner_of = placed_flows(entry["path"], steps, self.steps, self.parts)
        joints = {number for first, (last, _) in inner_of.items() for number in (first - 1, last + 1)}
        joints -= {-1, len(steps)}
        joined = all(steps[n].kind == "connection" and not self.is_inside(self.wires[steps[n].name]) for n in joints)
        declared = all(self._around(flow) is None for flow in (name, *(flow for _, flow in inner_of.values())))
        if joints and joined and declared:
            return inner_of
        named = (item for item in entry["path"] if isinstance(item, str))
        if self.profile != "dse" and any(item in self.flows and item not in self.parts for item in named):
            text = f"AADL cannot say flow {name}: connections of the system must join the flows it is composed of"
            raise UsageError(text)
        return {}

    def _elements(self, name: str, entry: Mapping[str, Any], inner: Mapping[int, tuple[int, str]]) -> list[str]:
        """The name of each step of a flow; components get flow specifications unless another flow has given them."""
        steps, path = self.steps[name], self._whole(entry)
        own_figures = dict(stated_in(path, steps, self.parts))
        elsewhere = {number for first, (last, _) in inner.items() for number in range(first, last + 1)}
        elements = []
        for number, step in enumerate(steps):
            if step.kind == "connection":
                elements.append(self.links[step.name])
                continue
            part, spec = self.end(step.name), f"{self.names[name]}_{number}"
            if number not in elsewhere:
                latency = own_figures.get(number, {}).get("latency") or self.latencies.get(step.name)
                self._specify(part, spec, step, latency)
            elements.append(f"{part.own}.{spec}")
        return elements

    def _specify(self, part: ComponentDraft, spec: str, step: PathStep, latency: Any) -> None:
        """A flow specification of a component from the connection before to the one behind."""
        text = None if latency is None else times(latency)
        block = f" {{Latency => {text};}}" if text else ""
        part.flows.append(f"{spec} : flow {kind_of(*self._ends(step))}{block};")

    def _ends(self, step: PathStep) -> tuple[str, str]:
        """The features that a component is entered and left by."""
        return (
            f"{self.links[step.before]}_in" if step.before else "",
            f"{self.links[step.after]}_out" if step.after else "",
        )

    def _lifted(self, name: str, elements: list[str], inner: Mapping[int, tuple[int, str]]) -> Iterator[str]:
        """The elements of the root: what runs within a process becomes a flow of that, another flow its name."""
        steps, number = self.steps[name], 0
        while number < len(steps):
            last, flow = inner.get(number, (number, ""))
            if flow:
                yield self.names[flow]
                number = last + 1
                continue
            process = self.process_of(self.end(steps[number].name)) if steps[number].kind == "component" else None
            if process is None:
                yield elements[number]
                number += 1
                continue
            while last + 2 < len(steps) and self.is_inside(self.wires[steps[last + 1].name]):
                last += 2
            yield f"{process.own}.{self._of_process(name, process, number, last, elements[number : last + 1])}"
            number = last + 1

    def _of_process(self, name: str, process: ComponentDraft, first: int, last: int, within: list[str]) -> str:
        """A flow of a process over some steps; returns its name."""
        before, after = self.steps[name][first].before, self.steps[name][last].after
        spec = f"{self.names[name]}_{first}_p"
        entry, leaving = self._ends(PathStep("component", "", before, after))
        process.flows.append(f"{spec} : flow {kind_of(entry, leaving)};")
        inner = [entry, f"{self.links[before]}_inside"] if before else []
        inner += within
        inner += [f"{self.links[after]}_outside", leaving] if after else []
        word = kind_of(entry, leaving).split()[0]
        process.flow_implementations.append(f"{spec} : flow {word} {' -> '.join(inner)};")
        return spec


def _block(name: str, entry: Mapping[str, Any]) -> str:
    """The properties of an end-to-end flow: its latency, its name in the problem file."""
    latency = entry.get("latency")
    text = times(latency) if latency is not None else None
    properties = [f"Latency => {text};"] if text is not None else []
    properties.append(f"{OURS}::Name => {quoted(name)};")
    if latency is not None and text is None:
        properties.append(f"{OURS}::Extra => {extra([('latency', latency)])};")
    return f" {{{' '.join(properties)}}}"
