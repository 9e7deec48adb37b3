"""A problem file as plain dictionaries of texts: its catalogues, components, decisions and paths."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from . import grammar, quantities
from .arbitration import counted, may_be_on
from .identifiers import number_of
from .packed_frames import packed

SECTIONS = ("processors", "buses", "reservations", "executors", "devices", "threads", "connections")
CATALOGUES = {
    "processors": "processor_types",
    "buses": "bus_types",
    "devices": "device_types",
    "threads": "thread_types",
}
_TASK_FIELDS = (
    "dispatch_protocol",
    "period",
    "compute_execution_time",
    "callback_execution_time",
    "latency",
    "deadline",
    "response_time",
    "queue_size",
    "transmit_queue",
    "price",
    "power",
)
_CLOCKED = ("offset", "communication")
FIELDS = {
    "processors": ("type", "cores", "transmit_queue", "price", "power"),
    "buses": (
        "type",
        "bus",
        "bandwidth",
        "transmission_time.fixed",
        "transmission_time.per_byte",
        "overhead",
        "latency",
        "fault_interval",
        "fault_burst",
        "price",
        "power",
    ),
    "reservations": ("budget", "period", "processor"),
    "executors": ("kind", "processor"),
    "devices": ("type", *_TASK_FIELDS, *_CLOCKED),
    "threads": (
        *("type", "process", "processor", "executor", *_TASK_FIELDS, *_CLOCKED, "priority", "non_preemptive", "join"),
        "pairing",
    ),
    "connections": (
        *("data_size", "bus", "rate", "data_rate", "port", "queue_size", "latency", "deadline", "carried_in"),
        *("identifier", "priority"),
    ),
}


class Unstated(str):
    """A default: what counts where a type does not state a field, and no option of anything."""


DEFAULTS = {"cores": Unstated("1"), "overhead": Unstated("0 B")}
"""What a processor or bus type has that does not state it."""
NONE = "none"
FOLLOWS = ("from bandwidth", "frame")
"""In the place of both parts of a transmission time that follows from the bandwidth, or from frames."""


class Problem:
    """A problem file as plain dictionaries of texts, includes merged in."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document = document
        self.sections: dict[str, dict[str, dict[str, Any]]] = {}
        for key in (*SECTIONS, *CATALOGUES.values(), "flows"):
            self.sections[key] = {name: body or {} for name, body in (document.get(key) or {}).items()}
        for section in ("executors", "threads"):  # each may run wherever an executor or reservation of it does
            for name, body in self.sections[section].items():
                keys = ("executor", "reservation")
                homes = [self.sections[f"{key}s"][home] for key in keys for home in as_list(body.get(key))]
                if homes:
                    slots = [slot for home in homes for slot in as_list(home["processor"])]
                    self.sections[section][name] = {**body, "processor": list(dict.fromkeys(slots))}
        self.says_local: set[str] = set()
        """Connections that state `local` beside the buses that they may take."""
        for name, body in self.sections["connections"].items():
            if "local" in as_list(body.get("bus")) and "local" not in self.sections["buses"]:
                self.says_local.add(name)
                self.sections["connections"][name] = {
                    **body,
                    "bus": [bus for bus in as_list(body["bus"]) if bus != "local"],
                }
        self.in_common: dict[tuple[str, Any], dict[tuple[str, ...], dict[tuple[str | None, ...], Any]]] = {}
        """What was worked out for one design and holds for others, by the decisions that were looked at (`reading`)."""
        wires = self.sections["connections"]
        for bus, way in (document.get("packing") or {}).items():
            wires.update(packed(self.sections, bus) if way == "any" else {})
        for name, body in wires.items():  # what is in the frame of another one is on its bus
            heads = [head for head in as_list(body.get("carried_in")) if head != "alone"]
            if heads and "bus" in wires[heads[0]]:
                wires[name] = {**body, "bus": wires[heads[0]]["bus"]}
        self.section_of = {name: section for section in SECTIONS for name in self.sections[section]}
        self.totals: dict[str, str] = document.get("totals") or {}
        self.requirements = [grammar.requirement(text) for text in document.get("requirements") or []]
        self.objectives = [grammar.objective(text) for text in document.get("objectives") or []]
        self.rules = [grammar.rule(text) for text in document.get("rules") or []]
        self.metrics = {name: grammar.derived(text) for name, text in (document.get("metrics") or {}).items()}

    @cached_property
    def has_frames(self) -> bool:
        """Whether some connection may be in the message of another one."""
        return any("carried_in" in body for body in self.sections["connections"].values())

    @cached_property
    def asks_of_cores(self) -> bool:
        """Whether what is asked depends on who shares a core: then open ones are decisions."""
        return self.names_cores or self.chooses_executors or self._asks_of_responses

    @cached_property
    def waiting_buses(self) -> frozenset[str]:
        """The buses for which messages wait."""
        return frozenset(counted(self))

    def may_wait(self, connection: str) -> bool:
        """Whether messages of a connection wait for a bus, in any design."""
        body = self.component(connection)
        ends = [self._slots(body[end]) for end in ("from", "to") if body.get(end) in self.sections["threads"]]
        if len(ends) == 2 and len(ends[0] | ends[1]) == 1 and self.need_not_travel(body):
            return False
        return bool(self.waiting_buses & may_be_on(self, connection))

    def _slots(self, name: str) -> set[str]:
        """The processors on which something may run, in any design."""
        homes = self.homes(name)
        if homes:
            return {slot for home in homes for slot in self._slots(home)}
        return set(as_list(self.component(name).get("processor")))

    @cached_property
    def chooses_executors(self) -> bool:
        """Whether it is a decision which executor runs a thread."""
        return any(len(as_list(body.get("executor"))) > 1 for body in self.sections["threads"].values())

    @cached_property
    def names_cores(self) -> bool:
        """Whether something that is asked, a rule or a derived metric is about single cores."""
        if any(text.endswith(".core") for rule in self.rules for text in grammar.operands(rule.condition)):
            return True
        asked = [item.metric for item in self.requirements] + [item.metric for item in self.objectives]
        asked += [metric for terms in self.metrics.values() for _, metric, _ in terms]
        return any(
            item.name == "utilisation" and grammar.core_of(item.of) is not None
            for metric in asked
            for item in grammar.inner(metric)
        )

    @cached_property
    def counts_responses(self) -> bool:
        """Whether latencies count how long threads wait for their core."""
        default = "response_time" if self.document.get("profile", "dse") == "dse" else "execution_time"
        return bool(self.document.get("processing", default) == "response_time")

    @cached_property
    def _asks_of_responses(self) -> bool:
        """Whether a requirement, an objective or a deadline depends on who shares a core."""
        if any(self.deadline_fields(name) for name in self.sections["threads"]):
            return True
        waiting = {"response time"}
        if self.counts_responses:
            waiting |= {"latency", "jitter", "run jitter", "reaction time", "data age", "disparity"}
            if any(map(self._may_read_late, self.sections["threads"])):
                waiting.add("min latency")
            if any("latency" in body for body in self.sections["flows"].values()):
                return True
        asked = [item.metric for item in self.requirements] + [item.metric for item in self.objectives]
        return any(name in waiting for metric in asked for name in self._kinds(metric))

    @cached_property
    def speaks_of_clocks(self) -> bool:
        """Whether anything says how timers keep time."""
        bodies = [body for section in self.sections.values() for body in section.values() if isinstance(body, dict)]
        return "clocks" in self.document or any({"clock", "offset", "communication"} & body.keys() for body in bodies)

    def _may_read_late(self, thread: str) -> bool:
        """Whether a thread keeps its phase on a clock, and may read when its job begins."""
        types: list[Any] = self.types(thread) or [None]
        has_offset = "processor" in self.component(thread) and any(
            self.stated(thread, "offset", kind) for kind in types
        )
        ways = {way for kind in types for way in as_list(self.stated(thread, "communication", kind) or "implicit")}
        return has_offset and "implicit" in ways

    def _kinds(self, metric: grammar.Metric | grammar.Extreme) -> Iterator[str]:
        """The kinds of metrics that a metric is made of."""
        for item in grammar.inner(metric):
            yield item.name
            for _, inner, _ in self.metrics.get(item.name, ()):
                yield from self._kinds(inner)

    def deadline_fields(self, thread: str) -> list[str]:
        """The fields that say by when a thread on a processor must end, the first first; none where none does."""
        setting = self.document.get("deadlines", "stated")
        body = self.component(thread)
        fields = {"none": [], "stated": ["deadline"], "all": ["deadline", "period"]}[setting]
        types: list[Any] = self.types(thread) or [None]
        stated = [field for field in fields if any(self.stated(thread, field, kind) for kind in types)]
        return fields if stated and "processor" in body else []

    def most_cores(self, slot: str) -> int:
        """The most cores that a processor may have."""
        own = self.component(slot).get("cores")
        given = [own] if own is not None else [self.stated(slot, "cores", kind) for kind in self.types(slot)]
        return max((int(core) for counts in given for core in as_list(counts or "1")), default=1)

    def homes(self, name: str) -> list[str]:
        """The executors or the reservation that say where a thread or executor runs; none where it does itself."""
        body = self.component(name)
        return [*as_list(body.get("executor")), *as_list(body.get("reservation"))]

    @cached_property
    def places(self) -> list[str]:
        """All that says itself on which processor and core it runs: reservations, executors and threads."""
        sections = ("reservations", "executors", "threads")
        found = [name for section in sections for name in self.sections[section] if not self.homes(name)]
        return [name for name in found if "processor" in self.component(name)]

    def stated_cores(self, place: str) -> list[str]:
        """The core or cores that the entry of a place names; none where any will do."""
        return [core for core in as_list(self.component(place).get("core")) if core != "any"]

    def cores(self, place: str) -> list[str]:
        """The cores that a place may have: those that are stated, else all of the processors where it may be."""
        return self.stated_cores(place) or [str(core) for core in range(1, self.last_core(place) + 1)]

    def last_core(self, place: str) -> int:
        """The greatest number of a core that a place may have, whatever it states."""
        return max(map(self.most_cores, as_list(self.component(place)["processor"])))

    def owner(self, decision: str) -> tuple[str, str]:
        """Component and field of a decision: ``("canbus0", "transmission_time.fixed")``."""
        return next(
            (name, decision.removeprefix(f"{name}."))
            for name, section in self.section_of.items()
            for field in (*FIELDS[section], "core")
            if decision == f"{name}.{field}"
        )

    def component(self, name: str) -> dict[str, Any]:
        """The entry of a component, without what its type gives."""
        return self.sections[self.section_of[name]][name]

    def types(self, name: str) -> list[str]:
        """The types that a component may have, ``none`` first for an optional slot."""
        return self._types[name]

    @cached_property
    def _types(self) -> dict[str, list[str]]:
        return {
            name: [*([NONE] if body.get("optional") == "true" else []), *as_list(body.get("type"))]
            for section in SECTIONS
            for name, body in self.sections[section].items()
        }

    @cached_property
    def fixed(self) -> dict[tuple[str, str], list[Any]]:
        """What a field offers, as a list, where no decision has a say in it."""
        found = {}
        for name, section in self.section_of.items():
            for field in FIELDS[section]:
                types = self.types(name)
                if field == "processor" and self.homes(name):
                    continue
                if field == "type":
                    found[name, field] = types
                elif field in self.component(name) or len(types) < 2:
                    raw = self.stated(name, field, types[0] if types else None)
                    if not isinstance(raw, dict):
                        found[name, field] = as_list(raw)
        return found

    @cached_property
    def settled(self) -> dict[tuple[str, str], Any]:
        """The value of each field that has one in every design, or in none; of offsets a period may have a say, too."""
        found = {key: options for key, options in self.fixed.items() if len(options) < 2 and key[1] != "offset"}
        return {key: options[0] if options else None for key, options in found.items()}

    def stated(self, name: str, field: str, type_name: str | None) -> Any:
        """What the component, else its type, says about a field."""
        found = self._stated(name, field, type_name)
        if field == "offset" and found in ("any", "unknown"):
            return self._grid(name) if found == "any" else None
        return found

    def _grid(self, name: str) -> list[str]:
        """The offsets below the longest period that the component may have."""
        types: list[Any] = [t for t in self.types(name) if t != NONE] or [None]
        periods = [as_list(self._stated(name, "period", t)) for t in types]
        longest = max((quantities.period(text) for texts in periods for text in texts), default=0)
        step = quantities.period(self.document["offset_grid"])
        return [f"{count * step} ns" for count in range(-(-longest // step))] or ["0 ns"]

    def _stated(self, name: str, field: str, type_name: str | None) -> Any:
        own = self.component(name)
        if field in own or type_name in (None, NONE):
            return own.get(field)
        return looked_up(self.sections[CATALOGUES[self.section_of[name]]][type_name], field)

    @cached_property
    def incoming(self) -> dict[str, list[str]]:
        """The connections that end at each component."""
        found: dict[str, list[str]] = {name: [] for name in self.section_of}
        for name, connection in self.sections["connections"].items():
            if "to" in connection:
                found[connection["to"]].append(name)
        return found

    @cached_property
    def paths(self) -> dict[str, list[str]]:
        """The path of every flow, its connections filled in."""
        return {name: self._complete(flow["path"]) for name, flow in self.sections["flows"].items()}

    def _complete(self, path: list[str]) -> list[str]:
        connections, full = self.sections["connections"], path[:1]
        for before, after in pairwise(path):
            if before not in connections and after not in connections:
                (between,) = (
                    name for name, ends in connections.items() if ends.get("from") == before and ends.get("to") == after
                )
                full.append(between)
            full.append(after)
        return full

    def is_always_timed(self, name: str) -> bool:
        """Whether a timer releases a component in every design."""
        if self.section_of[name] not in ("devices", "threads"):
            return False
        types: list[Any] = [kind for kind in self.types(name) if kind != NONE] or [None]
        protocols = {text for kind in types for text in as_list(self.stated(name, "dispatch_protocol", kind))}
        return protocols <= {"periodic", "hybrid"} and all(self.stated(name, "period", kind) for kind in types)

    @cached_property
    def meetings(self) -> dict[str, list[str]]:
        """Every timer at which flows that timers begin meet by different ways, and one flow for each way."""
        found: dict[str, list[str]] = {}
        for name in filter(self.is_always_timed, self.section_of):
            ways = {
                tuple(path[: path.index(name)]): flow
                for flow, path in reversed(self.paths.items())
                if name in path[1:] and self.is_always_timed(path[0])
            }
            if len(ways) > 1:
                found[name] = list(ways.values())
        return found

    @cached_property
    def buses(self) -> list[str]:
        """The entries of ``buses``, then the virtual bus types that are used directly."""
        entries = list(self.sections["buses"])
        for body in (*self.sections["buses"].values(), *self.sections["connections"].values()):
            entries += [bus for bus in as_list(body.get("bus")) if bus not in entries]
        return entries

    @cached_property
    def timed_buses(self) -> list[str]:
        """The physical buses whose busy time can be computed: every type has a time, every message a size."""
        found = []
        for bus, body in self.sections["buses"].items():
            types = [self.sections["bus_types"][name] for name in as_list(body["type"])]
            if all("virtual" not in item and {"transmission_time", "frame"} & item.keys() for item in types) and all(
                "data_size" in item or "data_rate" not in item
                for item in self.sections["connections"].values()
                if bus in self.reached(item) and not self._stays_inside(item)
            ):
                found.append(bus)
        return found

    def _stays_inside(self, body: dict[str, Any]) -> bool:
        """Whether both ends of a connection are always in one process, or on one processor: it is on no bus then."""
        ends = [self.sections["threads"].get(body.get(end, ""), {}) for end in ("from", "to")]
        if ends[0].get("process") is not None and ends[0].get("process") == ends[1].get("process"):
            return True
        homes = [as_list(end.get("processor")) for end in ends]
        return self.need_not_travel(body) and len(homes[0]) == 1 and homes[0] == homes[1]

    def need_not_travel(self, body: dict[str, Any]) -> bool:
        """Whether a connection takes no bus between threads of one processor: by `local`, or with physical buses."""
        if self.document.get("profile", "dse") != "dse":
            return False
        name = next((key for key, item in self.sections["connections"].items() if item is body), "")
        if name in self.says_local:
            return True
        options = as_list(body.get("bus"))
        kinds = [kind for bus in options for kind in as_list(self.sections["buses"].get(bus, {}).get("type", bus))]
        return bool(options) and not any("virtual" in self.sections["bus_types"].get(kind, {}) for kind in kinds)

    def reached(self, body: dict[str, Any]) -> set[str]:
        """Every bus that an entry with a `bus` may end up on, directly or under a virtual one."""
        direct = set(as_list(body.get("bus")))
        slots = self.sections["buses"]
        return direct.union(*(self.reached(slots[bus]) for bus in direct if bus in slots))

    @cached_property
    def decisions(self) -> dict[str, list[str]]:
        """Every decision and its options, in file order."""
        found = {}
        for section in SECTIONS:
            for name in self.sections[section]:
                for field in FIELDS[section]:
                    options = self._options(name, field)
                    if len(options) > 1:
                        found[f"{name}.{field}"] = options
        for place in self.places if self.asks_of_cores else ():
            if len(self.cores(place)) > 1:
                found[f"{place}.core"] = self.cores(place)
        return found

    def _options(self, name: str, field: str) -> list[str]:
        if field == "type":
            return self.types(name)
        if field == "processor" and self.homes(name):
            return []
        types: list[Any] = [t for t in self.types(name) if t != NONE] or [None]
        leaves = [leaf for t in types for leaf in self._leaves(name, self.stated(name, field, t))]
        if not any(isinstance(leaf, list) and len(leaf) > 1 for leaf in leaves):
            return []
        found: dict[Any, str] = {}
        for option in (option for leaf in leaves for option in as_list(leaf)):
            found.setdefault(option_value(field, option), option)
        return list(found.values())

    def _leaves(self, name: str, raw: Any) -> list[Any]:
        """The values or lists that a stated field can come down to."""
        if not isinstance(raw, dict):
            return [] if raw in (None, *FOLLOWS) or isinstance(raw, Unstated) else [raw]
        slots = as_list(self.component(name).get("processor"))
        reachable = {t for slot in slots for t in self.types(slot)}
        return [leaf for key, leaf in raw.items() if key in reachable]

    @cached_property
    def virtual_slots(self) -> list[str]:
        """Virtual buses that name carriers, each before those that may carry it."""
        order: list[str] = []

        def visit(name: str) -> None:
            if name not in order:
                for other, body in self.sections["buses"].items():
                    if name in as_list(body.get("bus")):
                        visit(other)
                order.append(name)

        for name, body in self.sections["buses"].items():
            if "bus" in body:
                visit(name)
        return [name for name in order if "bus" in self.component(name)]


def looked_up(body: Mapping[str, Any], field: str) -> Any:
    """A field of a catalogue entry; a part of a transmission time is nothing where it has none, and 0 if not given."""
    whole, _, part = field.partition(".")
    raw = body.get(whole, DEFAULTS.get(field))
    if whole == "transmission_time" and "frame" in body:
        return "frame"
    if not part or raw is None or raw in FOLLOWS:
        return raw
    if raw.keys() <= {"fixed", "per_byte", "sizes"}:
        return raw.get(part, Unstated("0 ns"))
    return {key: entry.get(part, "0 ns") for key, entry in raw.items()}


_READERS: dict[str, Callable[[str], Any]] = {
    "period": quantities.period,
    "data_size": quantities.size,
    "overhead": quantities.size,
    "rate": quantities.rate,
    "data_rate": quantities.data_rate,
    "bandwidth": quantities.bandwidth,
    "price": quantities.price,
    "power": quantities.power,
    "deadline": quantities.deadline,
    "budget": quantities.deadline,
    "offset": quantities.duration,
    "queue_size": int,
    "cores": int,
    "core": int,
    "identifier": lambda text: text if text == "any" else number_of(text),
    "priority": lambda text: int(text) if text.isdigit() else text,
    **dict.fromkeys(
        (
            "compute_execution_time",
            "callback_execution_time",
            "response_time",
            "latency",
        ),
        quantities.time_range,
    ),
    "transmission_time.fixed": quantities.transmission,
    "transmission_time.per_byte": quantities.transmission,
}


def option_value(field: str, text: str) -> Any:
    """What an option means, however it is spelled: ``0.02 s`` and ``20 ms`` are one period."""
    return _READERS[field](text) if field in _READERS else text


def as_list(raw: Any) -> list[Any]:
    """A list as it is, one value as a list, None as nothing."""
    return [] if raw is None else raw if isinstance(raw, list) else [raw]


def load_text(text: str, folder: Path | None = None) -> Problem:
    """Reads a problem from YAML text; includes are looked up in `folder`."""
    return Problem(_with_includes(text, folder))


def load_file(path: str | Path) -> Problem:
    """Reads a problem file with everything that it includes."""
    return load_text(Path(path).read_text(encoding="utf-8"), Path(path).parent)


def _with_includes(text: str, folder: Path | None) -> dict[str, Any]:
    document: dict[str, Any] = yaml.load(text, Loader=yaml.BaseLoader) or {}  # every scalar stays text
    for name in as_list(document.pop("include", None)):
        if folder is None:
            raise ValueError("an include needs a folder")
        included = _with_includes((folder / name).read_text(encoding="utf-8"), (folder / name).parent)
        for key, entries in included.items():
            if isinstance(entries, dict):
                merged = document.setdefault(key, {}) or {}
                if twice := merged.keys() & entries.keys():
                    raise ValueError(f"{key} {sorted(twice)} are defined twice")
                document[key] = {**entries, **merged}
    return document
