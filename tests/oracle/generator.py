"""Random small problem files with every kind of decision, for comparison with brute force.

An architecture with too many alternatives is drawn first, then thinned out until it has few enough designs; limits
are drawn last, around values that designs attain, so that they bind, just hold, or just fail.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from fractions import Fraction
from itertools import islice
from math import ceil, floor
from typing import Any

import yaml

from .evaluator import designs, evaluate, non_dominated, violations
from .problem import NONE, Problem, as_list

CAPS = {"tiny": 200, "small": 2000}
SAMPLE = 120
"""Designs that are looked at when limits are chosen."""

PERIODS = ("5 ms", "7 ms", "10 ms", "16667 us", "20 ms", "33333 us", "50 ms", "62.5 ms", "100 ms", "1 s")
SIZES = ("1 B", "8 B", "30 B", "64 B", "125 bit", "333 B", "1 KB", "1.5 KB")
RATES = ("3 Hz", "7.5 Hz", "20 Hz", "33.3 Hz", "0.1 kHz")
DATA_RATES = ("100 B/s", "1234 B/s", "1.5 KB/s", "9.6 kbit/s", "1001 bit/s")
BANDWIDTHS = ("125 kbit/s", "15.625 KBytesps", "11520 B/s", "1 Mbit/s", "250 Kbitsps", "115200 bit/s")
PROTOCOLS = ("periodic", "aperiodic", "sporadic", "hybrid")
ALWAYS_TIMED = ("periodic", "hybrid")
COMPARABLE = ("type", "bus", "processor", "dispatch_protocol", "period", "data_size", "rate", "data_rate", "price")
NOT_DECISIONS = ("path", "dispatch_trigger", "assumptions")

THEMES = ("processor_type", "several_processors", "optional_processor", "bus_type", "optional_bus", "bus_choice",
          "carrier_choice", "thread_period", "protocol", "execution_time", "map_alternatives", "device_period",
          "device_time", "device_latency", "device_type", "thread_type", "type_alternatives", "data_size", "rate",
          "data_rate", "queue_size", "response_time", "connection_latency", "catalogue_alternatives")


def random_problem(seed: int, size: str = "small") -> str:
    """YAML text of a random problem with at most 2000 (`small`) or 200 (`tiny`) designs; the same for the same seed."""
    rng = random.Random(f"{size} {seed}")
    document = _Architecture(rng, size).document
    document["name"] = f"random {size} {seed}"
    _thin_out(rng, document, CAPS[size])
    _add_rules(rng, document)
    _add_question(rng, document)
    return to_yaml(document)


class _Architecture:
    """One draw of catalogues and components; `document` is the problem without rules, limits and objectives."""

    def __init__(self, rng: random.Random, size: str) -> None:
        self.rng, self.tiny = rng, size == "tiny"
        self.themes = set(rng.sample(THEMES, rng.randint(4, 8 if self.tiny else 11)))
        self.themes |= {"thread_period"} if self.chance(0.5) else set()
        self.totals = self.chance(0.3)
        self.document: dict[str, Any] = {"dse": "1", "name": ""}
        if self.totals:
            self.document["totals"] = {"mass": "g"}
        self._add_processor_types()
        self._add_bus_types()
        self._add_processors()
        self._add_buses()
        self._add_devices()
        self._add_threads()
        self._add_connections()
        self._add_triggers_and_queues()
        self._add_flows()

    # Drawing

    def chance(self, probability: float) -> bool:
        return self.rng.random() < probability

    def on(self, theme: str, probability: float = 0.6) -> bool:
        return theme in self.themes and self.chance(probability)

    def some(self, pool: tuple[str, ...] | list[str], theme: str, most: int = 3) -> Any:
        """One of the pool, or a list of alternatives if the theme is on."""
        pool = list(pool)
        if len(pool) > 1 and self.on(theme):
            chosen = self.rng.sample(pool, self.rng.randint(2, min(most, len(pool))))
            return chosen
        return self.rng.choice(pool)

    def duration(self, low_us: int, high_us: int) -> str:
        us = self.rng.randint(low_us, high_us)
        return self.rng.choice([f"{us} us", f"{us} us", f"{us}.{self.rng.randint(1, 9)} us", f"{us}us",
                                f"{us / 1000:.3f} ms"])

    def time_range(self, low_us: int, high_us: int) -> str:
        if self.chance(0.2):
            return self.duration(low_us, high_us)
        middle = (low_us + high_us) // 2
        return f"{self.duration(low_us, middle)} .. {self.duration(middle + 1, high_us)}"

    def time_ranges(self, theme: str, low_us: int, high_us: int) -> Any:
        if self.on(theme):
            return [self.time_range(low_us, high_us) for _ in range(self.rng.randint(2, 3))]
        return self.time_range(low_us, high_us)

    def per_type(self, theme: str, low_us: int, high_us: int) -> Any:
        """One time range, or one per processor type, perhaps with alternatives inside."""
        types = list(self.document["processor_types"])
        if self.chance(0.4):
            return self.time_ranges(theme, low_us, high_us)
        inner = "map_alternatives" if theme == "execution_time" else theme
        return {t: self.time_ranges(inner, low_us, high_us) for t in types}

    def add_costs(self, body: dict[str, Any], probability: float = 0.6) -> None:
        if self.chance(probability):
            body["price"] = self.some(["0.99 EUR", "10 EUR", "49.5 EUR", "150 EUR", "900EUR"], "catalogue_alternatives")
        if self.chance(probability):
            body["power"] = self.rng.choice(["250 mW", "1.5 W", "5 W", "0.035 kW"])
        if self.totals and self.chance(probability):
            body["totals"] = {"mass": f"{self.rng.randint(1, 500)} g"}

    # Catalogues

    def _add_processor_types(self) -> None:
        types: dict[str, Any] = {}
        for name in ("RT101", "Spectra", "Nano")[: self.rng.randint(1, 3)]:
            types[name] = {}
            if self.chance(0.7):
                types[name]["cores"] = (["1", "2"] if self.on("catalogue_alternatives", 0.3)
                                        else str(self.rng.randint(1, 4)))
            self.add_costs(types[name], 0.8)
        self.document["processor_types"] = types

    def _transmission_time(self, virtual: bool) -> dict[str, str]:
        per_byte = ["87 ns .. 95 ns", "7 ns .. 10 ns", "80.5 ns .. 88.25 ns"] if virtual else \
            ["64 us .. 88 us", "16 us .. 22 us", "87 us", "8.5 us .. 9.1 us"]
        times = {"fixed": self.time_range(50, 1200), "per_byte": self.rng.choice(per_byte)}
        if self.chance(0.2):
            del times[self.rng.choice(["fixed", "per_byte"])]
        return times

    def _add_bus_types(self) -> None:
        types: dict[str, Any] = {}
        for name in ("can_125k", "can_500k", "rs232")[: self.rng.randint(1, 3)]:
            types[name] = {"bandwidth": self.some(BANDWIDTHS, "catalogue_alternatives", 2)}
            self._add_bus_figures(types[name], virtual=False)
            self.add_costs(types[name])
        for name in ("ros_ipc", "dds", "udp_stack")[: self.rng.randint(1, 3)]:
            types[name] = {"virtual": "true"}
            self._add_bus_figures(types[name], virtual=True)
        self.document["bus_types"] = types

    def _add_bus_figures(self, body: dict[str, Any], virtual: bool) -> None:
        per_type = virtual and self.chance(0.7)
        kinds = self.document["processor_types"]
        if self.chance(0.75):
            body["transmission_time"] = ({t: self._transmission_time(True) for t in kinds} if per_type
                                         else self._transmission_time(virtual))
        if self.chance(0.4):
            body["latency"] = ({t: self.time_range(1, 1084) for t in kinds} if per_type
                               else self.time_ranges("catalogue_alternatives", 1, 1084) if not virtual
                               else self.time_range(1, 1084))
        if self.chance(0.4):
            body["overhead"] = (self.some(["5 B", "8 B", "30 bit"], "catalogue_alternatives", 2) if not virtual
                                else self.rng.choice(["12 B", "64 B", "0 B"]))

    def _is_per_type(self, bus: str) -> bool:
        """Whether a bus or virtual bus type needs to know the machine."""
        slot = self.document["buses"].get(bus)
        types = [bus] if slot is None else as_list(slot["type"])
        bodies = [self.document["bus_types"][t] for t in types]
        if slot is not None:
            bodies += [{"transmission_time": {"RT101": {}}} for b in as_list(slot.get("bus")) if self._is_per_type(b)]
        return any("RT101" in (body.get(field) or {}) for body in bodies for field in ("transmission_time", "latency")
                   if isinstance(body.get(field), dict))

    # Slots

    def _add_processors(self) -> None:
        names = ["computer"]
        if "several_processors" in self.themes or "optional_processor" in self.themes:
            names += ["companion", "mcu"][: self.rng.randint(1, 2)]
        types = list(self.document["processor_types"])
        slots = {name: {"type": self.some(types, "processor_type")} for name in names}
        if "optional_processor" in self.themes:
            slots[names[-1]]["optional"] = "true"
        self.document["processors"] = slots

    def _add_buses(self) -> None:
        types = self.document["bus_types"]
        physical = [t for t in types if "virtual" not in types[t]]
        virtual = [t for t in types if "virtual" in types[t]]
        slots: dict[str, Any] = {}
        self.document["buses"] = slots
        for name in ("canbus0", "eth0")[: self.rng.randint(1, 2)]:
            slots[name] = {"type": self.some(physical, "bus_type")}
        if self.on("optional_bus", 0.9):
            slots["spare"] = {"type": self.some(physical, "bus_type"), "optional": "true"}
        wires = list(slots)
        if "carrier_choice" in self.themes or self.chance(0.3):
            slots["middleware"] = {"type": self.some(virtual, "bus_type"), "bus": self.some(wires, "carrier_choice")}
            if self.on("optional_bus"):
                slots["middleware"]["optional"] = "true"
            if self.chance(0.25):
                slots["tunnel"] = {"type": self.rng.choice(virtual), "bus": "middleware"}
        elif self.chance(0.15):
            slots["local_ipc"] = {"type": self.some(virtual, "bus_type")}

    # Devices and threads

    def _device(self, body: dict[str, Any], source: bool, alternatives: bool = True) -> None:
        if source or self.chance(0.3):
            body["period"] = self.some(PERIODS, "device_period") if alternatives else self.rng.choice(PERIODS)
        if self.chance(0.6):
            body["compute_execution_time"] = self.time_ranges("device_time", 20, 900)
        elif self.chance(0.85):
            body["latency"] = self.time_ranges("device_latency", 100, 3000)

    def _add_devices(self) -> None:
        devices: dict[str, Any] = {}
        self.document["devices"] = devices
        self.sources = ["gnss", "imu"][: self.rng.randint(1, 2)]
        self.sinks = ["sprayer"] if self.chance(0.7) else []
        for name in (*self.sources, *self.sinks):
            devices[name] = {}
            if name in self.sources and self.on("device_type", 0.8):
                devices[name]["type"] = list(self._device_types())
                if self.chance(0.3):
                    devices[name]["price"] = "12.34 EUR"
                continue
            self._device(devices[name], source=name in self.sources)
            self.add_costs(devices[name], 0.3)

    def _device_types(self) -> dict[str, Any]:
        types = self.document.setdefault("device_types", {})
        for name in ("mojo3", "piksi"):
            if name not in types:
                types[name] = {"period": self.some(PERIODS, "type_alternatives")}
                self._device(types[name], source=False, alternatives=False)
                types[name].setdefault("period", self.rng.choice(PERIODS))
                self.add_costs(types[name], 0.7)
        return types

    def _add_threads(self) -> None:
        names = ["driver", "nav", "main loop" if self.chance(0.15) else "main_loop", "control"]
        names = names[: self.rng.randint(2, 3 if self.tiny else 4)]
        self.threads: dict[str, Any] = {}
        self.document["threads"] = self.threads
        slots = list(self.document["processors"])
        for name in names:
            body: dict[str, Any] = {"processor": self.some(slots, "several_processors")}
            if self.chance(0.07):
                del body["processor"]
            if self.on("thread_type") and "processor" in body:
                body["type"] = list(self._thread_types())
            else:
                self._schedule(body)
                self._times(body)
            self.threads[name] = body
        self._group_into_process(names)

    def _schedule(self, body: dict[str, Any]) -> None:
        """Dispatch protocol and period, as far as the protocols need one."""
        style = self.rng.choice(["periodic", "implicit", "event", "fixed", "choice"])
        if self.on("protocol", 0.8):
            style = "choice"
        if style == "choice" and "protocol" in self.themes:
            body["dispatch_protocol"] = self.rng.sample(PROTOCOLS, self.rng.randint(2, 4))
        elif style in ("fixed", "choice"):
            body["dispatch_protocol"] = self.rng.choice(PROTOCOLS)
        elif style == "periodic":
            body["dispatch_protocol"] = "periodic"
        protocols = as_list(body.get("dispatch_protocol"))
        needs_period = style == "implicit" or bool({"periodic", "hybrid"} & set(protocols))
        if needs_period or ("sporadic" in protocols and self.chance(0.8)) or (protocols and self.chance(0.3)):
            body["period"] = self.some(PERIODS, "thread_period", 4)
        if "hybrid" in protocols and self.chance(0.8):
            body["callback_execution_time"] = self.time_range(10, 300)

    def _times(self, body: dict[str, Any]) -> None:
        per_type = "processor" in body
        if self.chance(0.95):
            body["compute_execution_time"] = (self.per_type("execution_time", 50, 1500) if per_type
                                              else self.time_ranges("execution_time", 50, 1500))
        else:
            body["latency"] = self.time_range(50, 1500)
        if self.on("response_time", 0.6) or self.chance(0.05):
            body["response_time"] = (self.per_type("response_time", 1600, 6000) if per_type
                                     else self.time_ranges("response_time", 1600, 6000))

    def _thread_types(self) -> dict[str, Any]:
        types = self.document.setdefault("thread_types", {})
        for name in ("ekf", "ukf"):
            if name not in types:
                types[name] = {}
                self._schedule(types[name])
                if "period" in types[name] and "type_alternatives" in self.themes:
                    types[name]["period"] = self.rng.sample(PERIODS, 2)
                self._times(types[name])
                self.add_costs(types[name], 0.2)
        return types

    def _group_into_process(self, names: list[str]) -> None:
        bound = [name for name in names if "processor" in self.threads[name]]
        if len(bound) < 2 or not self.chance(0.35):
            return
        group = self.rng.sample(bound, self.rng.randint(2, len(bound)))
        first = self.threads[group[0]]["processor"]
        for name in group:
            self.threads[name]["process"] = "proc_a"
            if not set(as_list(first)) & set(as_list(self.threads[name]["processor"])) or self.chance(0.7):
                self.threads[name]["processor"] = list(first) if isinstance(first, list) else first

    # Connections

    def _add_connections(self) -> None:
        self.connections: dict[str, Any] = {}
        self.document["connections"] = self.connections
        chain = [self.sources[0], *self.threads, *self.sinks]
        self.chain = chain
        self.backbone = [self._connect(a, b) for a, b in zip(chain, chain[1:], strict=False)]
        threads = list(self.threads)
        for source in self.sources[1:]:
            self._connect(source, self.rng.choice(threads))
        if len(threads) > 1 and self.chance(0.35):
            at = self.rng.randrange(len(threads) - 1)
            self._connect(threads[at], threads[self.rng.randrange(at + 1, len(threads))], extra=True)
        if len(threads) > 1 and self.chance(0.2):
            self._add_feedback(threads)
        if self.chance(0.2):
            self._connect(None, threads[0])
        if self.chance(0.2):
            self._connect(threads[-1], None)

    def _add_feedback(self, threads: list[str]) -> None:
        """A connection backwards, with at least one thread on the loop that may be dispatched by time."""
        first, last = sorted(self.rng.sample(range(len(threads)), 2))
        loop = [self.threads[name] for name in threads[first:last + 1]]
        if not any(self._protocols(body) & set(ALWAYS_TIMED) for body in loop):
            return
        self._connect(threads[last], threads[first], extra=True)

    def _protocols(self, body: dict[str, Any]) -> set[str]:
        """The protocols that a thread or device may have."""
        bodies = [self._catalogue(t) | body for t in as_list(body.get("type"))] or [body]
        return {protocol for b in bodies for protocol in
                as_list(b.get("dispatch_protocol") or ("periodic" if "period" in b else "aperiodic"))}

    def _catalogue(self, type_name: str) -> dict[str, Any]:
        return (self.document.get("thread_types", {}) | self.document.get("device_types", {}))[type_name]

    def _connect(self, sender: str | None, receiver: str | None, extra: bool = False) -> str:
        name = f"c{len(self.connections)}"
        body: dict[str, Any] = {}
        if sender is not None:
            body["from"] = sender
        if receiver is not None:
            body["to"] = receiver
        if self.chance(0.92):
            body["data_size"] = self.some(SIZES, "data_size")
        if sender is None or self.on("rate", 0.4) or self.chance(0.05):
            body["rate"] = self.some(RATES, "rate")
        elif self.on("data_rate", 0.5):
            body["data_rate"] = self.some(DATA_RATES, "data_rate")
        self._bind(body)
        if self.on("connection_latency", 0.5) or ("bus" not in body and self.chance(0.4)):
            body["latency"] = self.time_ranges("connection_latency", 10, 2000)
        if receiver is not None and (extra or not self._may_be_triggered(receiver)) and self.chance(0.4):
            body["port"] = "data"
        elif self.chance(0.15):
            body["port"] = self.rng.choice(["event", "event_data"])
        self.connections[name] = body
        return name

    def _may_be_triggered(self, name: str) -> bool:
        return self._protocols((self.document["devices"] | self.threads)[name]) != {"periodic"}

    def _bind(self, body: dict[str, Any]) -> None:
        machine = self.threads.get(body.get("from", ""), {}).get("processor")
        if body.get("from") not in self.threads:
            machine = self.threads.get(body.get("to", ""), {}).get("processor")
        slots = self.document["buses"]
        direct = [t for t, b in self.document["bus_types"].items() if "virtual" in b]
        usable = [bus for bus in (*slots, *direct) if machine is not None or not self._is_per_type(bus)]
        if self.chance(0.88):
            body["bus"] = self.some(usable, "bus_choice")

    def _add_triggers_and_queues(self) -> None:
        for name, body in (*self.threads.items(), *self.document["devices"].items()):
            triggers = [c for c, ends in self.connections.items() if ends.get("to") == name
                        and ends.get("port") != "data"]
            if not self._may_be_triggered(name):
                continue
            if name in self.threads and len(triggers) > 1 and self.chance(0.4):
                chosen = self.rng.sample(triggers, self.rng.randint(1, len(triggers) - 1))
                body["dispatch_trigger"] = [c for c in triggers if c in chosen]
            if self._protocols(body) & {"aperiodic", "sporadic"} and (self.on("queue_size") or self.chance(0.1)):
                body["queue_size"] = self.some(["0", "1", "2", "3"], "queue_size")
                if self.chance(0.5):
                    self.connections[self.rng.choice(triggers)]["queue_size"] = self.some(["1", "2", "5"], "queue_size")

    # Flows

    def _add_flows(self) -> None:
        flows: dict[str, Any] = {}
        self.document["flows"] = flows
        start = 0
        if self.chance(0.3):
            start = self.rng.randrange(len(self.chain) - 1)
        flows["to_sprayer"] = {"path": self._path(start if self._may_start(self.chain[start]) else 0, len(self.chain))}
        if self.chance(0.5):
            start = self.rng.randrange(len(self.chain) - 1)
            end = self.rng.randrange(start + 2, len(self.chain) + 1)
            if self._may_start(self.chain[start]):
                flows["second flow" if self.chance(0.2) else "inner"] = {"path": self._path(start, end)}

    def _may_start(self, name: str) -> bool:
        """Flows start only where the documents say plainly what the first component contributes."""
        body = (self.document["devices"] | self.threads)[name]
        return "hybrid" not in self._protocols(body) and "queue_size" not in body

    def _path(self, start: int, end: int) -> list[str]:
        path = [self.chain[start]]
        for i in range(start, end - 1):
            parallel = [c for c, ends in self.connections.items()
                        if ends.get("from") == self.chain[i] and ends.get("to") == self.chain[i + 1]]
            if len(parallel) > 1 or self.chance(0.1):
                path.append(self.rng.choice(parallel))
            path.append(self.chain[i + 1])
        before = [c for c, ends in self.connections.items() if "from" not in ends and ends["to"] == path[0]]
        after = [c for c, ends in self.connections.items() if "to" not in ends and ends["from"] == path[-1]]
        if before and self.chance(0.7):
            path.insert(0, before[0])
        if after and self.chance(0.7):
            path.append(after[0])
        return path


# Size


def _lists(document: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Every list of alternatives: the mapping that holds it, and its key."""
    for key, value in document.items():
        if isinstance(value, dict):
            yield from _lists(value)
        elif isinstance(value, list) and key not in NOT_DECISIONS:
            yield document, key


def count_designs(problem: Problem, cap: int) -> int:
    """The number of designs, at most `cap` + 1."""
    return sum(1 for _ in islice(designs(problem), cap + 1))


def _thin_out(rng: random.Random, document: dict[str, Any], cap: int) -> None:
    """Removes random alternatives until at most `cap` designs are left."""
    while _product(Problem(document)) > 400 * cap or count_designs(Problem(document), cap) > cap:
        holder, key = rng.choice(list(_lists(document)))
        options = holder[key]
        options.pop(rng.randrange(len(options)))
        if len(options) == 1:
            holder[key] = options[0]


def _product(problem: Problem) -> int:
    product = 1
    for options in problem.decisions.values():
        product *= len(options)
    return product


# Rules


def _quote(name: str) -> str:
    return f"'{name}'" if " " in name else name


def _ref(decision: str) -> str:
    name, field = decision.rsplit(".", 1)
    return f"{_quote(name)}.{field}"


def _add_rules(rng: random.Random, document: dict[str, Any]) -> None:
    """Up to three rules; one that leaves no design is nearly always dropped."""
    if not rng.random() < 0.6:
        return
    rules: list[str] = []
    for _ in range(rng.randint(1, 3)):
        text = _rule(rng, Problem(document))
        if text is None:
            continue
        document["rules"] = [*rules, text]
        if next(designs(Problem(document)), None) is not None or rng.random() < 0.05:
            rules.append(text)
        if rules:
            document["rules"] = list(rules)
        else:
            del document["rules"]


def _rule(rng: random.Random, problem: Problem) -> str | None:
    if not problem.decisions:
        return None
    verb = rng.choice(["", "require ", "forbid "])
    form = rng.randrange(6)
    if form == 0:
        return verb + _atom(rng, problem)
    if form == 1:
        return f"{verb}{_atom(rng, problem)} implies {_atom(rng, problem)}"
    if form == 2:
        used = _names_in_use(problem)
        return f"{rng.choice(used)} requires {rng.choice(used)}"
    if form == 3:
        return f"{verb}not {_atom(rng, problem)} {rng.choice(['or', 'and'])} {_atom(rng, problem)}"
    if form == 4:
        word = rng.choice(["or", "and"])
        return f"{verb}({_atom(rng, problem)} {word} {_atom(rng, problem)}) implies {_atom(rng, problem)}"
    return f"forbid {_atom(rng, problem)} and {_atom(rng, problem)}"


def _names_in_use(problem: Problem) -> list[str]:
    """Slots, and types that some slot may have."""
    names: list[str] = []
    for section in ("processors", "buses"):
        for name in problem.sections[section]:
            names += [_quote(name), *(t for t in problem.types(name) if t != NONE)]
    return list(dict.fromkeys(names))


def _atom(rng: random.Random, problem: Problem) -> str:
    """A comparison of decisions; those with periods are the most interesting."""
    decisions = {d: options for d, options in problem.decisions.items() if d.rsplit(".", 1)[1] in COMPARABLE
                 and not any("bit" in option for option in options)}
    periods = [d for d in decisions if d.endswith(".period")]
    if len(periods) > 1 and rng.random() < 0.5:
        left, right = rng.sample(periods, 2)
        return f"{_ref(left)} {rng.choice(['==', 'is a multiple of', '<=', '>', '!='])} {_ref(right)}"
    if not decisions or rng.random() < 0.12:
        return rng.choice(_names_in_use(problem))
    decision = rng.choice(periods if periods and rng.random() < 0.3 else list(decisions))
    options = decisions[decision]
    if rng.random() < 0.2:
        return f"{_ref(decision)} in [{', '.join(rng.sample(options, rng.randint(1, len(options))))}]"
    names = decision.rsplit(".", 1)[1] in ("type", "bus", "processor", "dispatch_protocol")
    sign = rng.choice(["==", "!="] if names else ["==", "!=", "<", "<=", ">", ">="])
    return f"{_ref(decision)} {sign} {rng.choice(options)}"


# Requirements and objectives


def _candidates(problem: Problem) -> list[str]:
    """The metrics that a requirement or an objective may name."""
    found = [f"{metric} of {_quote(flow)}" for flow in problem.paths for metric in ("latency", "min latency", "jitter")]
    found += [f"utilisation of {_quote(slot)}" for slot in problem.sections["processors"]]
    found += [f"load of {_quote(bus)}" for bus in problem.sections["buses"]]
    found += ["price", "power", *problem.totals, *problem.metrics]
    found += [f"{metric} of {_quote(name)}" for metric in ("price", "power")
              for section in ("processors", "buses", "devices") for name in problem.sections[section]]
    if len(problem.paths) == 1:
        found += ["jitter", "latency"]
    if len(problem.sections["processors"]) == 1:
        found.append("utilisation")
    return found


class _Sample:
    """Figures of up to SAMPLE designs, spread evenly, and every candidate metric's value in each of them."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self.metrics = _candidates(Problem(document))
        problem = Problem({**document, "objectives": [f"minimise {metric}" for metric in self.metrics]})
        found = list(designs(problem))
        self.figures = [evaluate(problem, design) for design in found[::len(found) // SAMPLE + 1]]
        columns = zip(*(figures["objectives"] for figures in self.figures), strict=True)
        self.values = dict(zip(self.metrics, map(list, columns), strict=True)) if found else {}
        self.varying = [metric for metric, values in self.values.items() if len(set(values)) > 1]

    def satisfying(self, requirements: list[str]) -> list[int]:
        """The indices of the designs that meet the requirements."""
        problem = Problem({**self.document, "requirements": requirements})
        return [i for i, figures in enumerate(self.figures) if not violations(problem, figures)]


def _add_question(rng: random.Random, document: dict[str, Any]) -> None:
    """Derived metrics, requirements, objectives and a baseline."""
    if rng.random() < 0.4:
        document["metrics"] = _derived_metrics(rng, Problem(document))
    sample = _Sample(document)
    requirements = _requirements(rng, sample)
    if requirements:
        document["requirements"] = requirements
    document["objectives"] = _objectives(rng, sample, sample.satisfying(requirements))
    if rng.random() < 0.25 and sample.figures:
        _require_flow_latency(rng, sample)
    if rng.random() < 0.2:
        _add_baseline(rng, document)


def _objectives(rng: random.Random, sample: _Sample, feasible: list[int]) -> list[str]:
    """One to five objectives; of several draws the one with the most trade-offs."""
    count = rng.choice([1, 2, 2, 3, 3, 3, 4, 4, 5])
    best: tuple[int, list[str]] = (-1, [])
    for _ in range(rng.choice([1, 15, 15])):
        chosen = _metrics_to_optimise(rng, sample, count)
        senses = [rng.choice([1] * 5 + [-1]) for _ in chosen]
        vectors = {tuple(sense * sample.values[metric][i] for sense, metric in zip(senses, chosen, strict=True))
                   for i in feasible}
        texts = [f"{'minimise' if sense > 0 else 'maximise'} {metric}"
                 for sense, metric in zip(senses, chosen, strict=True)]
        best = max(best, (len(non_dominated(vectors)) if vectors else 0, texts), key=lambda draw: draw[0])
    return best[1]


def _metrics_to_optimise(rng: random.Random, sample: _Sample, count: int) -> list[str]:
    """Different metrics, those that differ between designs first."""
    chosen: list[str] = []
    rest = [metric for metric in sample.metrics if metric not in sample.varying]
    for metric in (*rng.sample(sample.varying, len(sample.varying)), *rng.sample(rest, len(rest))):
        alike = any(set(metric.split(" of ")) <= set(other.split(" of ")) or
                    set(other.split(" of ")) <= set(metric.split(" of ")) for other in chosen)
        if len(chosen) < count and not alike:
            chosen.append(metric)
    return chosen


def _derived_metrics(rng: random.Random, problem: Problem) -> dict[str, str]:
    flow = _quote(rng.choice(list(problem.paths)))
    metrics = {"line_variation": f"jitter of {flow} * 0.6 m/s"}
    if rng.random() < 0.5:
        metrics["mean_distance"] = f"latency of {flow} * 0.6 m/s / 2 + min latency of {flow} * 0.3 m/s"
    if rng.random() < 0.4:
        metrics["budget"] = "price * 2 - price / 3"
    if rng.random() < 0.3:
        metrics["spread"] = f"latency of {flow} - 2 * min latency of {flow}"
    return metrics


def _requirements(rng: random.Random, sample: _Sample) -> list[str]:
    """Limits around attained values; most of them can be met together."""
    texts: list[str] = []
    if not sample.figures:
        return texts
    for _ in range(rng.choice([0, 1, 2, 2, 3, 4])):
        text = _general_requirement(rng, sample) if rng.random() < 0.25 else _requirement(rng, sample)
        if text not in texts and (sample.satisfying([*texts, text]) or rng.random() < 0.2):
            texts.append(text)
    return texts


def _requirement(rng: random.Random, sample: _Sample) -> str:
    pool = sample.varying if sample.varying and rng.random() < 0.85 else sample.metrics
    metric = rng.choice(pool)
    values = sorted(sample.values[metric])
    sign = rng.choice(["<="] * 6 + ["<", "<", ">=", ">", "=="])
    at = rng.choice([0, 0.3, 0.6, 0.8, 0.95])
    value = values[int(len(values) * (1 - at if sign in (">=", ">") and at else at))]
    if rng.random() < 0.03:
        value = values[0] - abs(values[0]) / 7 - 1
    return f"{metric} {sign} {_limit(rng, sample.document, metric, value, sign)}"


def _general_requirement(rng: random.Random, sample: _Sample) -> str:
    """A requirement without a name, which holds for every flow, processor or bus."""
    metric = rng.choice(["utilisation", "load", "latency", "jitter"])
    if metric == "utilisation":
        return f"utilisation {rng.choice(['<=', '<'])} {rng.choice(['5 %', '12.5 %', '30 %', '70 %', '100 %'])}"
    if metric == "load":
        return f"load <= {rng.choice(['1 %', '10 %', '50 %', '123456 ppm'])}"
    worst = max(max(sample.values[f"{metric} of {_quote(flow)}"]) for flow in sample.document["flows"])
    return f"{metric} <= {floor(worst * rng.choice([7, 9, 10, 10]) / 10)} ns"


def _limit(rng: random.Random, document: dict[str, Any], metric: str, value: Fraction, sign: str) -> str:
    """A limit at or next to a value, in a unit that can say it."""
    whole = rng.choice([floor, ceil]) if value.denominator > 1 else int
    kind = metric.split(" of ")[0]
    if kind == "utilisation":
        ppm = whole(value * 10**6)
        return rng.choice([f"{max(ppm, 0)} ppm", f"{max(ppm, 0) / 10**4:.4f} %"])
    if kind == "load":
        slot = re.sub(r"^load of |'", "", metric)
        types = as_list(document["buses"][slot]["type"])
        wired = all("bandwidth" in document["bus_types"][t] for t in types)
        if wired and rng.random() < 0.5:
            return rng.choice(["1 %", "5.5 %", "20 %", "50 %", "80000 ppm"])
        return f"{max(whole(value), 0)} B/s"
    if kind in ("price", "budget"):
        return f"{whole(value) / 100:.2f} EUR"
    if kind == "power":
        return f"{whole(value)} mW"
    if kind == "mass":
        return f"{whole(value)} g"
    if kind in ("line_variation", "mean_distance"):
        return rng.choice([f"{whole(value)} nm", f"{whole(value) / 10**6:.6f} mm"])
    ns = whole(value) + (rng.choice([0, 0, 0, 1, -1]) if sign != "==" else 0)
    return rng.choice([f"{ns} ns", f"{Fraction(ns, 1000).__ceil__()} us", f"{ns / 10**6:.6f} ms"])


def _require_flow_latency(rng: random.Random, sample: _Sample) -> None:
    name = rng.choice(list(sample.document["flows"]))
    values = sorted(sample.values[f"latency of {_quote(name)}"])
    limit = values[rng.randrange(len(values) // 2, len(values))]
    sample.document["flows"][name]["latency"] = f"0 ns .. {limit} ns"


def _add_baseline(rng: random.Random, document: dict[str, Any]) -> None:
    design = next(designs(Problem(document)), None)
    if design is None:
        return
    baseline: dict[str, dict[str, str]] = {}
    for decision, option in design.items():
        if option is not None and rng.random() < 0.8:
            name, field = decision.rsplit(".", 1)
            baseline.setdefault(name, {})[field] = option
    if baseline:
        document["baseline"] = baseline


# Text


_PLAIN = re.compile(r"[A-Za-z0-9(][A-Za-z0-9_ ./%()<>=!*+-]*")


def _scalar(text: str) -> str:
    if _PLAIN.fullmatch(text) and text == text.strip():
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def to_yaml(document: dict[str, Any]) -> str:
    """A document of texts, lists and mappings as YAML, one component per line."""
    lines = []
    for key, value in document.items():
        if isinstance(value, dict):
            lines.append(f"{key}:")
            lines += [f"  {_scalar(name)}: {_flow(body)}" for name, body in value.items()]
        elif isinstance(value, list):
            lines.append(f"{key}:")
            lines += [f"  - {_flow(item)}" for item in value]
        else:
            lines.append(f"{key}: {_scalar(value)}")
    return "\n".join(lines) + "\n"


# Coverage


def features(text: str) -> set[str]:
    """The kinds of decision, component, requirement, rule and objective that a problem file uses."""
    document = yaml.load(text, Loader=yaml.BaseLoader)
    problem = Problem(document)
    return {*_decision_features(problem), *_component_features(problem), *_question_features(problem)}


def _decision_features(problem: Problem) -> Iterator[str]:
    for decision, options in problem.decisions.items():
        name, field = decision.rsplit(".", 1)
        section = problem.section_of[name]
        yield f"decision {section}.{field}"
        own = problem.component(name)
        if field == "dispatch_protocol":
            yield from (f"protocol option {option}" for option in options)
        if field != "type" and field not in own:
            yield f"alternatives inside {section} type"
        if isinstance(own.get(field), dict):
            yield "alternatives inside a processor type map"
        if section == "connections" and field == "bus":
            virtual = {option not in problem.sections["buses"] for option in options}
            yield from ["bus or middleware"] if len(virtual) == 2 else []
    if not problem.decisions:
        yield "no decision"


def _component_features(problem: Problem) -> Iterator[str]:
    if len(problem.sections["processors"]) > 1:
        yield "several processors"
    for section in ("processors", "buses"):
        for name, body in problem.sections[section].items():
            if body.get("optional") == "true":
                yield f"optional {section}"
                if len(problem.types(name)) == 2:
                    yield "optional slot with one type"
            if "bus" in body:
                yield "virtual on physical" if as_list(body["bus"])[0] != "middleware" else "stack of three"
    for body in problem.sections["bus_types"].values():
        kind = "virtual bus" if "virtual" in body else "bus"
        for field in ("transmission_time", "latency"):
            if field in body:
                per_type = isinstance(body[field], dict) and "RT101" in body[field]
                yield f"{kind} {field}{' per processor type' if per_type else ''}"
        if "overhead" in body:
            yield f"{kind} overhead"
    yield from _task_features(problem)
    yield from _connection_features(problem)


def _task_features(problem: Problem) -> Iterator[str]:
    for section in ("devices", "threads"):
        for body in problem.sections[section].values():
            yield from (f"{section}.{field}" for field in body if field not in ("processor", "price", "power"))
            yield from (f"protocol {protocol}" for protocol in as_list(body.get("dispatch_protocol")))
            if section == "threads" and "processor" not in body:
                yield "thread without processor"
            for figure in ("price", "power", "totals"):
                if figure in body:
                    yield "figures of a device or thread"


def _connection_features(problem: Problem) -> Iterator[str]:
    names = list(problem.section_of)
    for name, body in problem.sections["connections"].items():
        yield from (f"connections.{field}" for field in body if field not in ("from", "to"))
        if "from" not in body or "to" not in body:
            yield "boundary"
        elif problem.section_of[body["from"]] == problem.section_of[body["to"]] == "threads":
            if names.index(body["from"]) > names.index(body["to"]):
                yield "feedback"
            processes = {problem.component(end).get("process") for end in (body["from"], body["to"])}
            if None not in processes and len(processes) == 1:
                yield "connection inside a process"
        if body.get("port") == "data":
            yield "data port"
        if "bus" not in body:
            yield "unbound connection"
        if any(bus in problem.sections["bus_types"] for bus in as_list(body.get("bus"))):
            yield "virtual bus type used directly"
        if "data_rate" in body:
            yield f"data_rate {'with' if 'data_size' in body else 'without'} data_size"
    for flow in problem.sections["flows"].values():
        path = flow["path"]
        if path[0] in problem.sections["connections"] or path[-1] in problem.sections["connections"]:
            yield "flow from or to the boundary"
        if any(element in problem.sections["connections"] for element in path[1:-1]):
            yield "connection named in a path"
        if "latency" in flow:
            yield "required latency of a flow"


def _question_features(problem: Problem) -> Iterator[str]:
    yield f"{len(problem.objectives)} objectives"
    for objective in problem.objectives:
        yield "minimise" if objective.sign > 0 else "maximise"
        yield f"objective {objective.metric.name}"
    for requirement in problem.requirements:
        yield f"operator {requirement.operator}"
        yield f"requirement {requirement.metric.name}{'' if requirement.metric.of else ' (general)'}"
        if requirement.metric.name == "load":
            yield "load share" if requirement.limit.endswith(("%", "ppm")) else "load in B/s"
    for rule in problem.rules:
        yield from ("rule " + word for word in ("require", "forbid", "implies", "requires", " and ", " or ", "not ",
                                                " in [", "is a multiple of", "==", "!=", "<=", ">=", "(")
                    if word in rule.text)
        yield "rule without verb" if not rule.text.startswith(("require ", "forbid ")) else "rule with verb"
    for key in ("metrics", "totals", "baseline"):
        if problem.document.get(key):
            yield key
    if any(" " in name for name in problem.section_of):
        yield "name with a blank"
