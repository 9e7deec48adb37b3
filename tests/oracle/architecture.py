"""Random architectures with too many alternatives: catalogues, slots, devices, threads, connections and flows."""

from __future__ import annotations

import random
from itertools import pairwise
from typing import Any

from .problem import as_list

PERIODS = ("5 ms", "7 ms", "10 ms", "16667 us", "20 ms", "33333 us", "50 ms", "62.5 ms", "100 ms", "1 s")
SIZES = ("1 B", "8 B", "30 B", "64 B", "125 bit", "333 B", "1 KB", "1.5 KB")
RATES = ("3 Hz", "7.5 Hz", "20 Hz", "33.3 Hz", "0.1 kHz")
STORED = ("data", "data_access")
"""Ports that dispatch nobody."""
DATA_RATES = ("100 B/s", "1234 B/s", "1.5 KB/s", "9.6 kbit/s", "1001 bit/s")
BANDWIDTHS = ("125 kbit/s", "20.5 KBytesps", "11520 B/s", "1 Mbit/s", "250 Kbitsps", "115200 bit/s")
FRAMES = (
    {"protocol": "can"},
    {"protocol": "can", "identifier_bits": "29"},
    {"protocol": "can_fd", "data_bandwidth": "1500 kbit/s"},
    {"protocol": "can_fd", "identifier_bits": "29", "data_bandwidth": "2 Mbit/s"},
    {"protocol": "serial"},
    {"protocol": "serial", "data_bits": "7", "parity": "odd", "stop_bits": "1.5"},
    {"protocol": "ethernet"},
    {"protocol": "ethernet", "transport": "udp", "mtu": "576 B"},
    {"protocol": "ethernet", "transport": "udp", "network": "ipv6", "mtu": "400 B"},
    {"protocol": "ethernet", "transport": "tcp", "vlan": "true"},
    {"protocol": "ethernet", "transport": "tcp_timestamps", "network": "ipv6", "mtu": "0.3 KB"},
    {"protocol": "ethercat"},
    {"protocol": "flexray"},
    {"protocol": "flexray", "payload": "32 B", "transmission_start_bits": "9"},
)
PROTOCOLS = ("periodic", "aperiodic", "sporadic", "hybrid")
ALWAYS_TIMED = ("periodic", "hybrid")
THEMES = (
    "processor_type",
    "several_processors",
    "optional_processor",
    "bus_type",
    "optional_bus",
    "bus_choice",
    "carrier_choice",
    "thread_period",
    "protocol",
    "execution_time",
    "map_alternatives",
    "device_period",
    "device_time",
    "device_latency",
    "device_type",
    "thread_type",
    "type_alternatives",
    "data_size",
    "rate",
    "data_rate",
    "queue_size",
    "response_time",
    "connection_latency",
    "catalogue_alternatives",
)


class Architecture:
    """One draw of catalogues and components; `document` is the problem without rules, limits and objectives."""

    def __init__(self, rng: random.Random, size: str) -> None:
        self.rng, self.tiny = rng, size == "tiny"
        self.themes = set(rng.sample(THEMES, rng.randint(4, 8 if self.tiny else 11)))
        self.themes |= {"thread_period"} if self.chance(0.5) else set()
        self.totals, self.limited = self.chance(0.3), self.chance(0.3)
        self.document: dict[str, Any] = {"dse": "1", "name": "", "processing": "execution_time"}
        if self.totals:
            self.document["totals"] = {"mass": random.Random(rng.getstate()[1][0]).choice(["g", "%"])}
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
        return self.rng.choice(
            [f"{us} us", f"{us} us", f"{us}.{self.rng.randint(1, 9)} us", f"{us}us", f"{us / 1000:.3f} ms"]
        )

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
            body["totals"] = {"mass": f"{self.rng.randint(1, 500)} {self.document['totals']['mass']}"}

    # Catalogues

    def _add_processor_types(self) -> None:
        types: dict[str, Any] = {}
        for name in ("RT101", "Spectra", "Nano")[: self.rng.randint(1, 3)]:
            types[name] = {}
            if self.chance(0.7):
                types[name]["cores"] = (
                    ["1", "2"] if self.on("catalogue_alternatives", 0.3) else str(self.rng.randint(1, 4))
                )
            self.add_costs(types[name], 0.8)
        self.document["processor_types"] = types

    def _transmission_time(self, virtual: bool) -> dict[str, Any]:
        per_byte = (
            ["87 ns .. 95 ns", "7 ns .. 10 ns", "80.5 ns .. 88.25 ns", "7300 ps"]
            if virtual
            else ["64 us .. 88 us", "16 us .. 22 us", "87 us", "8.5 us .. 9.1 us", "0.1 ns .. 333 ps", "80.01 ns"]
        )
        times = {"fixed": self.time_range(50, 1200), "per_byte": self.rng.choice(per_byte)}
        if not virtual and self.on("catalogue_alternatives", 0.3):
            times["fixed"] = self.time_ranges("catalogue_alternatives", 50, 1200)
        if self.chance(0.2):
            del times[self.rng.choice(["fixed", "per_byte"])]
        apart = random.Random(repr(self.rng.getstate()[1][2]))  # drawn apart from all else
        if apart.random() < 0.2:  # what they hold for is remarked, and changes no figure
            times["sizes"] = apart.choice(["1 B .. 64 B", "1 kB", "0 B .. 1 MB"])
        return times

    def _add_bus_types(self) -> None:
        types: dict[str, Any] = {}
        for name in ("can_125k", "can_500k", "rs232")[: self.rng.randint(1, 3)]:
            types[name] = {"bandwidth": self.some(BANDWIDTHS, "catalogue_alternatives", 2)}
            self._add_bus_figures(types[name], virtual=False)
            if random.Random(self.rng.getstate()[1][0]).random() < 0.15:  # drawn apart from all else
                types[name]["transmission_time"] = "from bandwidth"
            self._add_frame(types[name], random.Random(repr(self.rng.getstate()[1][1])))
            self.add_costs(types[name])
        for name in ("ros_ipc", "dds", "udp_stack")[: self.rng.randint(1, 3)]:
            types[name] = {"virtual": "true"}
            if self.limited:
                types[name]["bandwidth"] = self.rng.choice(BANDWIDTHS)
            self._add_bus_figures(types[name], virtual=True)
            if self.chance(0.3):
                types[name] |= {"price": self.rng.choice(["3 EUR", "49.5 EUR"]), "power": "250 mW"}
        self.document["bus_types"] = types

    @staticmethod
    def _add_frame(body: dict[str, Any], drawn: random.Random) -> None:
        """Frames in place of a transmission time, drawn apart from all else."""
        if drawn.random() < 0.25:
            body.pop("transmission_time", None)
            body["frame"] = dict(drawn.choice(FRAMES))
            if len(body["frame"]) == 1 and body["frame"]["protocol"] != "can_fd" and drawn.random() < 0.5:
                body["frame"] = body["frame"]["protocol"]

    def _add_bus_figures(self, body: dict[str, Any], virtual: bool) -> None:
        per_type = virtual and self.chance(0.7)
        kinds = self.document["processor_types"]
        if self.chance(0.75):
            body["transmission_time"] = (
                {t: self._transmission_time(True) for t in kinds} if per_type else self._transmission_time(virtual)
            )
        if self.chance(0.4):
            body["latency"] = (
                {t: self.time_range(1, 1084) for t in kinds}
                if per_type
                else self.time_ranges("catalogue_alternatives", 1, 1084)
                if not virtual
                else self.time_range(1, 1084)
            )
        if self.chance(0.4):
            body["overhead"] = (
                self.some(["5 B", "8 B", "30 bit"], "catalogue_alternatives", 2)
                if not virtual
                else self.rng.choice(["12 B", "64 B", "0 B"])
            )

    def _is_per_type(self, bus: str) -> bool:
        """Whether a bus or virtual bus type needs to know the machine."""
        slot = self.document["buses"].get(bus)
        types = [bus] if slot is None else as_list(slot["type"])
        bodies = [self.document["bus_types"][t] for t in types]
        if slot is not None:
            bodies += [{"transmission_time": {"RT101": {}}} for b in as_list(slot.get("bus")) if self._is_per_type(b)]
        return any(
            "RT101" in (body.get(field) or {})
            for body in bodies
            for field in ("transmission_time", "latency")
            if isinstance(body.get(field), dict)
        )

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
        needs_period = style == "implicit" or bool({"periodic", "hybrid", "sporadic"} & set(protocols))
        if needs_period or (protocols and self.chance(0.3)):
            body["period"] = self.some(PERIODS, "thread_period", 4)
        if "hybrid" in protocols and self.chance(0.8):
            body["callback_execution_time"] = self.time_range(10, 300)

    def _times(self, body: dict[str, Any]) -> None:
        per_type = "processor" in body
        if self.chance(0.95):
            body["compute_execution_time"] = (
                self.per_type("execution_time", 50, 1500) if per_type else self.time_ranges("execution_time", 50, 1500)
            )
        else:
            body["latency"] = self.time_range(50, 1500)
        if self.on("response_time", 0.6) or self.chance(0.05):
            body["response_time"] = (
                self.per_type("response_time", 1600, 6000)
                if per_type
                else self.time_ranges("response_time", 1600, 6000)
            )

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
        self.backbone = [self._connect(a, b) for a, b in pairwise(chain)]
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
        loop = [self.threads[name] for name in threads[first : last + 1]]
        if not any(self._protocols(body) & set(ALWAYS_TIMED) for body in loop):
            return
        self._connect(threads[last], threads[first], extra=True)

    def _protocols(self, body: dict[str, Any]) -> set[str]:
        """The protocols that a thread or device may have."""
        bodies = [self._catalogue(t) | body for t in as_list(body.get("type"))] or [body]
        return {
            protocol
            for b in bodies
            for protocol in as_list(b.get("dispatch_protocol") or ("periodic" if "period" in b else "aperiodic"))
        }

    def _catalogue(self, type_name: str) -> dict[str, Any]:
        return (self.document.get("thread_types", {}) | self.document.get("device_types", {}))[type_name]

    def _connect(self, sender: str | None, receiver: str | None, extra: bool = False) -> str:
        name = f"c{len(self.connections)}"
        body: dict[str, Any] = {}
        if sender is not None:
            body["from"] = sender
        if receiver is not None:
            body["to"] = receiver
        body["data_size"] = self.some(SIZES, "data_size")
        if sender is None or self.on("rate", 0.4) or self.chance(0.05):
            body["rate"] = self.some(RATES, "rate")
        elif self.on("data_rate", 0.5):
            body["data_rate"] = self.some(DATA_RATES, "data_rate")
        self._bind(body)
        if receiver is not None and (extra or not self._may_be_triggered(receiver)) and self.chance(0.4):
            body["port"] = "data_access" if len(self.connections) % 3 == 0 else "data"
        elif self.chance(0.15):
            body["port"] = self.rng.choice(["event", "event_data"])
        triggers = receiver is not None and body.get("port") not in STORED and self._may_be_triggered(receiver)
        if self.chance(0.25) and not ("bus" in body and "data_rate" not in body) and not triggers:
            del body["data_size"]
        if self.on("connection_latency", 0.5) or ("bus" not in body and self.chance(0.4)):
            body["latency"] = self.time_ranges("connection_latency", 10, 2000)
        if "data_rate" in body and any("frame" in item for item in self.document["bus_types"].values()):
            body.setdefault("data_size", "20 B")  # a data rate alone says nothing of frames
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
            if self.chance(0.15):
                body["bus"] = ["local", *as_list(body["bus"])]

    def _add_triggers_and_queues(self) -> None:
        for name, body in (*self.threads.items(), *self.document["devices"].items()):
            triggers = [
                c for c, ends in self.connections.items() if ends.get("to") == name and ends.get("port") not in STORED
            ]
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
        for flow in flows.values():
            self._give_sizes(flow["path"])

    def _give_sizes(self, path: list[str]) -> None:
        """A data size for the connections of a flow: its transmission may take time per byte."""
        ends = {(body.get("from"), body.get("to")): body for body in self.connections.values()}
        on_the_way = [self.connections[element] for element in path if element in self.connections]
        on_the_way += [ends[pair] for pair in pairwise(path) if pair in ends]
        for body in on_the_way:
            if "bus" in body:
                body.setdefault("data_size", self.rng.choice(SIZES))

    def _may_start(self, name: str) -> bool:
        """Flows start only where the documents say plainly what the first component contributes."""
        body = (self.document["devices"] | self.threads)[name]
        return "hybrid" not in self._protocols(body) and "queue_size" not in body

    def _is_never_timed(self, name: str) -> bool:
        return not self._protocols((self.document["devices"] | self.threads)[name]) & set(ALWAYS_TIMED)

    def _path(self, start: int, end: int) -> list[str]:
        path = [self.chain[start]]
        for i in range(start, end - 1):
            parallel = [
                c
                for c, ends in self.connections.items()
                if ends.get("from") == self.chain[i] and ends.get("to") == self.chain[i + 1]
            ]
            if len(parallel) > 1 or self.chance(0.1):
                path.append(self.rng.choice(parallel))
            path.append(self.chain[i + 1])
        before = [
            c
            for c, ends in self.connections.items()
            if "from" not in ends and ends["to"] == path[0] and self._is_never_timed(path[0])
        ]
        after = [c for c, ends in self.connections.items() if "to" not in ends and ends["from"] == path[-1]]
        if before and self.chance(0.7):
            path.insert(0, before[0])
        if after and self.chance(0.7):
            path.append(after[0])
        return path


def state_cores(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes a thread has its core, or may choose among some."""
    kinds = document["processor_types"]
    if rng.random() < 0.5:
        return
    for body in document["threads"].values():
        types = [
            kinds[kind]
            for slot in as_list(body.get("processor"))
            for kind in as_list(document["processors"][slot]["type"])
        ]
        most = max((int(core) for kind in types for core in as_list(kind.get("cores", "1"))), default=0)
        if most > 1 and rng.random() < 0.6:
            chosen = sorted(rng.sample(range(1, most + 1), rng.choice([1, min(2, most)])))
            chosen = [1] if rng.random() < 0.4 else chosen
            body["core"] = str(chosen[0]) if len(chosen) == 1 else [str(core) for core in chosen]


def state_clocks(rng: random.Random, document: dict[str, Any]) -> None:
    """Sometimes timers have offsets, known or to be chosen, on one clock or several, and data pass at deadlines."""
    if rng.random() < 0.6:
        return
    document["clocks"] = {"common": {"synchronisation_error": rng.choice(["0 ns", "150 us"])}, "other": {}}
    for body in (*document["processors"].values(), *document["devices"].values()):
        if rng.random() < 0.6:
            body["clock"] = rng.choice(["common", "common", "other"])
    choices = 1
    for body in (*document["devices"].values(), *document["threads"].values()):
        if "processor" not in body and "clock" not in body:
            continue
        offsets = [f"{rng.randrange(0, 20)} ms", f"{rng.randrange(0, 20_000)} us"]
        if rng.random() < 0.75:
            body["offset"] = offsets[0] if rng.random() < 0.9 else "unknown"
            if choices and rng.random() < 0.5:
                choices -= 1
                body["offset"] = offsets
                if rng.random() < 0.3 and body.get("period") == "20 ms":
                    body["offset"], document["offset_grid"] = "any", "7 ms"
        if "processor" in body and rng.random() < 0.6:
            body["communication"] = "let"
            if rng.random() < 0.3:
                body["deadline"] = f"{rng.randint(1, 30)} ms"
            if choices and rng.random() < 0.3:
                choices -= 1
                body["communication"] = rng.sample(["let", "implicit", "at_dispatch"], 2)


def state_joins(rng: random.Random, document: dict[str, Any]) -> None:
    """Some threads with several triggers need a message of each, as a decision or not; what waits has a bound."""
    for name, body in document["threads"].items():
        ways = as_list(body.get("dispatch_protocol") or ("periodic" if "period" in body else "aperiodic"))
        coming = [key for key, wire in document["connections"].items() if wire.get("to") == name]
        triggers = body.get("dispatch_trigger") or [
            key for key in coming if document["connections"][key].get("port") not in STORED
        ]
        if len(as_list(triggers)) < 2 or "type" in body or ways == ["periodic"] or rng.random() < 0.5:
            continue
        body["join"] = rng.choice(["all", "all", ["any", "all"]])
        body["pairing"] = rng.choice(["latest", "fifo", ["fifo", "latest"]])
        if body["pairing"] != "latest":
            body["queue_size"] = rng.choice(["1", "2"])


def state_overload(rng: random.Random, document: dict[str, Any]) -> None:
    """Mostly everything may be overloaded; else nothing, or one slot; some buses carry one message at a time."""
    for body in document.get("bus_types", {}).values():
        if "virtual" not in body and rng.random() < 0.5:
            body["exclusive"] = "true"
    draw = rng.random()
    if draw < 0.6:
        document["overload"] = "allowed"
    elif draw < 0.8:
        slots = [*document["processors"].values(), *document.get("buses", {}).values()]
        rng.choice(slots)["overload"] = "allowed"


def state_reservations(rng: random.Random, document: dict[str, Any]) -> None:
    """One or two reservations of a core, for some threads and perhaps the executor."""
    threads = on_cores(document)
    if not threads:
        return
    slots = [slot for body in threads for slot in as_list(body["processor"])]
    for name in ["share", "other share"][: rng.choice([1, 1, 2])]:
        period = rng.choice([2, 3, 4, 5])
        budgets = sorted(rng.sample(range(1, 2 * period + 1), rng.choice([1, 1, 2])))
        texts = [f"{500 * budget} us" for budget in budgets]
        share = {"budget": texts if len(texts) > 1 else texts[0], "period": f"{period} ms", "core": "1"}
        share["processor"] = rng.choice(slots)
        if rng.random() < 0.4:
            share["priority"] = rng.choice(["1", "2"])
        free = [body for body in threads if "reservation" not in body]
        homes = rng.sample(free, min(len(free), rng.randint(1, 2)))
        for body in [*homes, *(document.get("executors", {}).values() if not homes or rng.random() < 0.5 else ())]:
            if "reservation" not in body:
                for field in ("processor", "core", "process"):
                    body.pop(field, None)
                body["reservation"] = name
                document.setdefault("reservations", {})[name] = share


def on_cores(document: dict[str, Any]) -> list[dict[str, Any]]:
    """The threads that an executor or a reservation may hold: those on processors, whole."""
    serves = [name for name, body in document["processor_types"].items() if "serves" in body]
    homes = {name: as_list(body["type"]) for name, body in document["processors"].items()}
    return [
        body
        for body in document["threads"].values()
        if "segments" not in body
        and "processor" in body
        and not any(kind in serves for slot in as_list(body["processor"]) for kind in homes[slot])
    ]


def state_segments(rng: random.Random, document: dict[str, Any]) -> None:
    """The work of some threads becomes pieces, some of them on one or two accelerators; others run there whole."""
    threads = {name: body for name, body in document["threads"].items() if "processor" in body}
    if not threads:
        return
    kinds = list(document["processor_types"])
    for name in ("Streams", "Engine"):
        document["processor_types"][name] = {
            "serves": rng.choice(["fifo", "priority"]),
            "price": rng.choice(["99 EUR", "300 EUR"]),
        }
    slots = ["gpu", "dsp"][: rng.choice([1, 1, 2])]
    for name in slots:
        types = rng.choice([["Streams"], ["Engine"], ["Streams", "Engine"]])
        document["processors"][name] = {"type": types if len(types) > 1 else types[0]}
        if rng.random() < 0.3:
            document["processors"][name]["optional"] = "true"
    for name in rng.sample(sorted(threads), min(len(threads), rng.choice([1, 1, 1, 2, 3]))):
        document["threads"][name] = _in_pieces(rng, document, threads[name], kinds, slots)
        for connection in document["connections"].values():
            if connection.get("to") == name:
                connection.pop("queue_size", None)
    for name in ("render", "encode")[: rng.choice([0, 0, 1, 1, 2])]:
        period = rng.choice(["4 ms", "5 ms", "7 ms", "20 ms"])
        work = _work(rng, ["Streams", "Engine"])
        document["threads"][name] = {"processor": rng.choice(slots), "period": period, "compute_execution_time": work}


def _in_pieces(
    rng: random.Random, document: dict[str, Any], stated: dict[str, Any], kinds: list[str], slots: list[str]
) -> dict[str, Any]:
    """A thread with segments, released as one without them was."""
    typed = document.get("thread_types", {}).get((as_list(stated.get("type")) or [""])[0], {})
    body = typed | {key: value for key, value in stated.items() if key != "type"}
    for field in ("compute_execution_time", "callback_execution_time", "response_time", "latency", "queue_size"):
        body.pop(field, None)
    protocols = [text for text in as_list(body.get("dispatch_protocol")) if text != "hybrid"]
    if "dispatch_protocol" in body:
        body["dispatch_protocol"] = protocols if len(protocols) > 1 else [*protocols, "periodic"][0]
    if body.get("dispatch_protocol") == "aperiodic":
        body.pop("period", None)
    places = [None, rng.choice(slots), *(rng.choice([None, *slots]) for _ in range(rng.randint(0, 2)))]
    rng.shuffle(places)
    body["segments"] = []
    for place in places:
        if place is None:
            body["segments"].append({"compute_execution_time": _work(rng, kinds)})
        else:
            piece = {"processor": place, "compute_execution_time": _work(rng, ["Streams", "Engine"])}
            body["segments"].append(piece)
    return body


def _work(rng: random.Random, kinds: list[str]) -> Any:
    """A time or a range, perhaps one for each type."""
    if rng.random() < 0.5:
        return {kind: _work_of(rng) for kind in kinds}
    return _work_of(rng)


def _work_of(rng: random.Random) -> str:
    least, most = sorted((rng.choice([100, 500, rng.randint(100, 3000)]), rng.randint(100, 3000)))
    return f"{least} us .. {most} us" if rng.random() < 0.7 else f"{most}.{rng.randint(1, 9)} us"


def state_executors(rng: random.Random, document: dict[str, Any]) -> None:
    """One OS thread runs the jobs of two or three threads; sometimes of a kind that is to be chosen."""
    threads = on_cores(document)
    if len(threads) < 2:
        return
    kinds = rng.sample(["fifo", "callback_group", "wait_set"], rng.choice([1, 1, 2]))
    executor = {"kind": kinds if len(kinds) > 1 else kinds[0], "core": "1"}
    executor["processor"] = rng.choice(as_list(rng.choice(threads)["processor"]))
    if rng.random() < 0.4:
        executor["priority"] = rng.choice(["1", "2"])
    for body in rng.sample(threads, rng.randint(2, min(3, len(threads)))):
        for field in ("processor", "core", "process"):
            body.pop(field, None)
        body["executor"] = "node"
        if kinds == ["callback_group"] and rng.random() < 0.4:
            body["priority"] = rng.choice(["1", "2", "7"])
    document["executors"] = {"node": executor}


def state_equal_times(rng: random.Random, document: dict[str, Any]) -> None:
    """Some threads take no time, two take equally long, and an executor may have one thread alone."""
    threads = document["threads"]
    timed = [name for name, body in threads.items() if isinstance(body.get("compute_execution_time"), str)]
    for name in timed:
        if rng.random() < 0.25:
            threads[name]["compute_execution_time"] = "0 ms .. 0 ms"
    if len(timed) > 1 and rng.random() < 0.3:
        one, other = rng.sample(timed, 2)
        threads[one]["compute_execution_time"] = threads[other]["compute_execution_time"]
    executors = document.get("executors", {})
    inside = [body for body in threads.values() if body.get("executor") == "node"]
    if len(inside) > 1 and rng.random() < 0.25 and "reservation" not in executors["node"]:
        for body in inside[1:]:
            del body["executor"]
            body["processor"] = executors["node"]["processor"]
