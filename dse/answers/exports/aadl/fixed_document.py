"""The document of a problem with every decision made: one value for each field, the figures of types at their users."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

from dse.analysis.binding import bus_stack, machine_type
from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.osate.media import media
from dse.analysis.views import View
from dse.space.model.space import EMPTY, Design, Space
from dse.space.model.trees import Choice, NotOffered, at
from dse.space.parameters import value_in
from dse.spec.schema.hardware import TransmissionTime
from dse.support.errors import UsageError

TYPED = {"processors": "processor_types", "buses": "bus_types", "devices": "device_types", "threads": "thread_types"}
LISTS = ("dispatch_trigger", "path", "interrupts", "further_buses", "protocols")
"""Fields whose list is no choice."""
PARTS = frozenset(TransmissionTime.model_fields)
USERS = ("devices", "threads", "executors", "reservations")
LEFT_OPEN = ("priority", "core", "offset")
"""Fields that a problem may leave to the search without a list."""


class Decided:
    """A document under one design.

    `document` is the plain data of the problem file; lists of options are replaced by the chosen option, figures that a
    type states are copied to the part.
    """

    def __init__(self, document: Mapping[str, Any], space: Space, design: Design) -> None:
        self.document = document
        self.space = space
        self.design = design
        self.view = View(design)

    def section(self, name: str) -> dict[str, dict[str, Any]]:
        """The entries of a section, without empty slots and executors; ``type`` stays for processors and buses only.

        Plain data by name. Executors that no thread of the design runs in are left out.
        """
        entries = {}
        running = (
            {str(item.get("executor")) for item in self.section("threads").values()} if name == "executors" else ()
        )
        for key, entry in (self.document.get(name) or {}).items():
            fields = self._fields(name, key, dict(entry or {}))
            if fields.get("type") != EMPTY and (name != "executors" or key in running):
                entries[key] = fields
        return entries

    def type_of(self, section: str, name: str) -> dict[str, Any]:
        """The figures of the type that a slot has.

        Plain data of the processor or bus type that is chosen for slot `name`, with its own decisions made.
        """
        entry = self.section(section)[name]
        fields = dict((self.document.get(TYPED[section]) or {}).get(entry["type"]) or {})
        return self._chosen(section, name, fields)

    def _fields(self, section: str, name: str, stated: dict[str, Any]) -> dict[str, Any]:
        chosen = self._chosen(section, name, stated) | self._by_parameter(section, name, stated)
        kind = chosen.get("type")
        if section in ("devices", "threads") and kind is not None:
            types = self.document.get(TYPED[section]) or {}
            inherited = self._chosen(section, name, dict(types.get(kind) or {}))
            chosen = {**inherited, **{key: value for key, value in chosen.items() if key != "type"}}
        chosen |= self._left_open.get((section, name), {})
        protocol = chosen.get("dispatch_protocol") or ("periodic" if "period" in chosen else "aperiodic")
        if protocol == "periodic":  # its timer waits for no inputs
            chosen = {key: value for key, value in chosen.items() if key not in ("join", "pairing")}
        return {key: value for key, value in chosen.items() if value is not None}

    @cached_property
    def _left_open(self) -> dict[tuple[str, str], dict[str, Any]]:
        """The values that the design chooses for fields that are ``any`` or left open, and the cores by first-fit."""
        by_place: dict[tuple[str, str], dict[str, Any]] = {}
        for item, option in zip(self.space.decisions, self.design, strict=False):
            section = next((name for name in USERS if item.component in (self.document.get(name) or {})), None)
            if section is None or item.field not in LEFT_OPEN or option < 0:
                continue
            stated = (self.document[section][item.component] or {}).get(item.field)
            if not isinstance(stated, list):
                text = item.options[option]
                by_place.setdefault((section, item.component), {})[item.field] = int(text) if text.isdigit() else text
        for thread, core in cores_of(self.space, self.design).items():
            component = self.space.components[thread]
            if at(component.core, self.view) is None:  # as first-fit gives it: a model says where a thread runs
                name = self.space.core_owner(component, self.view)
                section = next(item for item in USERS if name in (self.document.get(item) or {}))
                by_place.setdefault((section, name), {})["core"] = core
        return by_place

    def _chosen(self, section: str, name: str, stated: dict[str, Any]) -> dict[str, Any]:
        chosen = {}
        for key, value in stated.items():
            chosen[key] = self.value(section, name, key, value)
        return {key: value for key, value in chosen.items() if value is not None}

    def value(self, section: str, name: str, key: str, value: Any) -> Any:
        """A field's value in the design; None where the design has no use for it.

        Transmission times and totals are decided part by part; values by processor type are replaced by the one of the
        chosen machine.
        """
        if key == "transmission_time" and isinstance(value, dict):
            parts = self._of_machine(section, name, value) if not set(value) & PARTS else value
            return {part: self._one(f"{name}.{key}.{part}", text) for part, text in (parts or {}).items()} or None
        if key == "totals" and isinstance(value, dict):
            return {total: self._one(f"{name}.totals.{total}", text) for total, text in value.items()}
        if key == "type":
            return self._one(f"{name}.type", value if isinstance(value, list) else [value])
        if key == "parameters" and isinstance(value, dict):
            return {item: self._parameter(f"{name}.{item}", entry or {}) for item, entry in value.items()}
        if key in LISTS or not isinstance(value, list | dict):
            return value
        if isinstance(value, dict):
            value = self._of_machine(section, name, value)
            if isinstance(value, dict):
                return value
        return self._one(f"{name}.{key}", value)

    def _parameter(self, name: str, entry: Mapping[str, Any]) -> dict[str, Any]:
        """A parameter of a thread with its chosen value; what the thread takes with it is the thread's."""
        kept = {key: value for key, value in entry.items() if key != "compute_execution_time"}
        return {**kept, "value": self._one(name, kept["value"])} if "value" in kept else kept

    def _by_parameter(self, section: str, name: str, stated: Mapping[str, Any]) -> dict[str, Any]:
        """The execution time of a thread for the chosen value of its parameter."""
        for key, entry in (stated.get("parameters") or {}).items():
            table, reference = (entry or {}).get("compute_execution_time"), self.space.references.get(f"{name}.{key}")
            chosen = None if reference is None else at(reference.tree, self.view)
            row = None if chosen is None else value_in(table or {}, chosen)
            if table and row is not None:
                return self._chosen(section, name, {"compute_execution_time": table[row]})
        return {}

    def _one(self, name: str, value: Any) -> Any:
        if not isinstance(value, list):
            return value
        reference = self.space.references.get(name)
        if reference is None:
            return value[0]
        tree = reference.tree
        while isinstance(tree, Choice) and tree.decision < len(self.design):
            tree = tree.branches[self.view[tree.decision]]
        if isinstance(tree, Choice):
            return None  # nothing that is asked depends on it: the design does not say
        try:
            leaf = at(reference.tree, self.view)
        except NotOffered:
            return None
        chosen = None if leaf is None else reference.texts.get(leaf, value[0])
        is_number = any(isinstance(item, int) for item in value)
        return int(chosen) if is_number and isinstance(chosen, str) and chosen.isdigit() else chosen

    def _of_machine(self, section: str, name: str, by_type: Mapping[str, Any]) -> Any:
        """The figure of the processor type that runs a thread, or whoever sends over a virtual bus."""
        types = self.document.get("processor_types") or {}
        if not by_type or not all(str(key).partition("/")[0] in types for key in by_type):
            return by_type  # figures of other things, such as how a bus frames
        kinds: set[str] = set()
        if section == "threads":
            component = next(item for item in self.space.components if item.name == name)
            processor = at(component.processor, self.view)
            if processor is not None:
                slot = self.space.processors[processor]
                kinds.add(slot.types[self.view[slot.type_decision]])
        elif section == "buses":
            number = next(index for index, item in enumerate(self.space.buses) if item.name == name)
            for wire in self.space.connections:
                wraps = (medium.bus for medium in media(self.space, wire, self.view))
                if number in bus_stack(self.space, wire, self.view) or number in wraps:
                    kinds.add(machine_type(self.space, wire, self.view))
        if len(kinds) > 1:
            raise UsageError(
                f"{name} has figures per processor type and is used from {', '.join(sorted(kinds))}: AADL has one bus "
                "for each; split it in the problem file"
            )
        kind = next(iter(kinds), None)
        if kind is None:
            return None
        if not any(str(key).startswith(f"{kind}/") for key in by_type):
            return by_type.get(kind)
        of_groups = {key: value for key, value in by_type.items() if str(key).partition("/")[0] == kind}
        for key, value in of_groups.items():
            if isinstance(value, list):
                raise UsageError(f"{name} chooses from a list for {key}: AADL cannot say which; state one figure")
        return of_groups
