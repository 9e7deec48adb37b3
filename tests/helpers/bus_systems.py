"""Random problems with messages that wait for buses: senders of all kinds, options everywhere, chains over buses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

KINDS = ("priority", "priority", "priority", "fifo", "round_robin", "none")
ETHERNET = ("vlan: true, mtu: 128 B", "vlan: true, mtu: 131 B, transport: udp", "vlan: true")
"""Frames of Ethernet with priorities; a short `mtu` makes several of a message."""
BYTES = (0, 1, 4, 8, 12, 20)


def draw_bus_problem(seed: int, *, decisions: int = 3, responses: bool | None = None) -> str:
    """The text of a problem with one or two buses, some threads and devices, and up to so many open decisions."""
    rng = Random(seed)
    left = [decisions]

    def options(values: Sequence[str]) -> str:
        """One value, or a few of them as options while some are left."""
        if left[0] and rng.random() < 0.4:
            left[0] -= 1
            return f"[{', '.join(rng.sample(values, min(len(values), rng.choice((2, 2, 3)))))}]"
        return rng.choice(values)

    kind = rng.choice(KINDS)
    anys = rng.choice((0, 0, 0.5, 0.9)) if kind == "priority" else 0
    counts = rng.random() < 0.5 if responses is None else responses
    lines = ["dse: 1", f"name: bus {seed}", f"processing: {'response_time' if counts else 'execution_time'}"]
    queues = Random(f"queues {seed}")  # drawn apart from all else
    words = Random(f"functions {seed}")
    wires = Random(f"faults {seed}")
    way = _transmit_queue(queues, left, 0.3)
    lines += [f"processor_types: {{c: {{cores: 2, price: 10 EUR{way}}}}}", "bus_types:"]
    arbitration = f", arbitration: {kind}" * (kind != "priority")
    broadcast = ", broadcast: true" if rng.random() < 0.2 else ""
    for name, rate, price in (("slow", "125 kbit/s", 1), ("fast", "500 kbit/s", 5), ("odd", "333 kbit/s", 3)):
        faults = _perhaps_faults(wires, left) if kind == "priority" else ""
        lines.append(f"  {name}: {{bandwidth: {rate}, frame: can{arbitration}{faults}{broadcast}, price: {price} EUR}}")
    links = _Links(Random(f"links {seed}"))
    lines.append(f"  link: {{bandwidth: 1 Mbit/s, frame: {{protocol: ethernet, {links.rng.choice(ETHERNET)}}},")
    lines.append("         arbitration: priority, price: 4 EUR}")
    times = "transmission_time: {fixed: 200 us .. 300 us, per_byte: 20 us}, bandwidth: 200 kbit/s"
    lines.append(f"  plain: {{{times}, arbitration: {rng.choice(KINDS)}, price: 2 EUR}}")
    longest = Random(f"late {seed}").choice(("150 us",) * 6 + ("6 ms", "9 ms"))  # later than its period
    lines.append(f"  ipc: {{virtual: true, transmission_time: {{fixed: 10 us .. {longest}}}, overhead: 1 B}}")
    lines += ["processors: {p: {type: c}}", "buses:"]
    buses = ["can0", "can1"] if rng.random() < 0.4 else ["can0"]
    lines.append(f"  can0: {{type: {options(['slow', 'fast', 'odd'])}, overload: allowed}}")
    slot = len(lines) - 1
    lines += [f"  {name}: {{type: {links.second}, overload: allowed}}" for name in buses[1:]]
    lines.append("  wrap: {type: ipc, bus: can0}")
    devices = [f"d{number}" for number in range(rng.randint(1, 3))]
    threads = [f"t{number}" for number in range(rng.randint(1, 3))]
    lines.append("devices:")
    for name in devices:
        job = rng.choice(("", ", compute_execution_time: 100 us .. 900 us", ", latency: 200 us .. 400 us"))
        job += _transmit_queue(queues, left, 0.3)
        lines.append(f"  {name}: {{period: {options(['4 ms', '5 ms', '8 ms', '10 ms'])}{job}}}")
    lines.append("  sink: {}")
    eager = [name for name in threads if rng.random() < 0.5]
    timers = devices + [name for name in threads if name not in eager]
    lines.append("threads:")
    for name in threads:
        cost = options(["100 us .. 300 us", "1 ms .. 2 ms", "500 us"])
        core = f", core: {rng.randint(1, 2)}"
        period = "dispatch_protocol: aperiodic" if name in eager else f"period: {options(['5 ms', '10 ms', '20 ms'])}"
        period += _transmit_queue(queues, left, 0.2)
        lines.append(f"  {name}: {{processor: p{core}, {period}, compute_execution_time: {cost}}}")
    lines.append("connections:")
    flows: dict[str, list[str]] = {}
    identifiers = rng.sample(range(1, 60), 20)
    made = 0
    frames = _Frames(words, 2 if decisions else 0)

    def connect(source: str, target: str, extra: str = "") -> str:
        nonlocal made
        name = f"m{made}"
        bus = rng.choice([*buses, *buses, "wrap"])
        if len(buses) > 1 and left[0] and rng.random() < 0.2:
            left[0] -= 1
            bus = "[can0, can1]"
        size = options([f"{size} B" for size in BYTES[: 4 if rng.random() < 0.7 else 6]])
        deadline = f", deadline: {options(['2 ms', '4 ms', '8 ms', '20 ms'])}" if rng.random() < 0.4 else ""
        ends = f"from: {source}, to: {target}" if source else f"to: {target}, rate: {rng.choice((50, 125))} Hz"
        own = hex(identifiers[made])
        if left[0] and rng.random() < 0.3:  # perhaps one that another message has
            left[0] -= 1
            other = rng.choice([identifiers[made - 1] if made else 71, rng.randint(60, 70)])
            own = f"[{own}, {other:#x}]"
        own = _perhaps_canopen(words, _perhaps_any(rng, left, anys, own))
        size = links.size(bus, size, left)
        shown = f"{ends}, data_size: {size}, bus: {bus}, identifier: {own}"
        shown += links.perhaps_class(bus, left)
        shown = frames.perhaps_carried(name, (source, target, bus + extra), size, own) or f"{shown}{extra}"
        lines.append(f"  {name}: {{{shown}{deadline}}}")
        made += 1
        return name

    sources = list(timers)
    for name in eager:
        source = rng.choice(sources)
        connect(source, name)
        flows[f"f{len(flows)}"] = [source, name]
        sources.append(name)
    for source in words.choice((1, 2)) * [rng.choice(sources) for _ in range(rng.randint(1, 3))]:
        port = ", from_port: o" if broadcast else rng.choice(("", "", ", port: data"))
        if rng.random() < 0.2:
            connect("", "sink", ", port: data")
        last = connect(source, "sink", port)
        chain = next((path for path in flows.values() if path[-1] == source), [source])
        flows[f"f{len(flows)}"] = [*chain, last, "sink"]
    lines[slot] = lines[slot].replace(", overload", f"{_perhaps_rule(Random(f'assignment {seed}'), lines)}, overload")
    lines.append("flows:")
    lines += [f"  {name}: {{path: [{', '.join(path)}]}}" for name, path in flows.items()]
    first = next(iter(flows))
    lines.append(f"objectives: [minimise price, minimise {rng.choice(('jitter', 'latency'))} of {first}]")
    return "\n".join(lines)


class _Links:
    """A link of Ethernet, perhaps in place of the second bus, with its messages."""

    def __init__(self, rng: Random) -> None:
        self.rng = rng
        self.second = "link" if rng.random() < 0.5 else "plain"

    def size(self, bus: str, size: str, left: list[int]) -> str:
        """The size of a message: of one that is always on the link perhaps of several frames."""
        if self.second == "plain" or bus != "can1":
            return size
        if left[0] and self.rng.random() < 0.25:
            left[0] -= 1
            return "[20 B, 250 B]"
        return self.rng.choice(("1 B", "8 B", "150 B"))

    def perhaps_class(self, bus: str, left: list[int]) -> str:
        """A priority on the link, while some decisions are left perhaps one of two; rarely none."""
        if self.second == "plain" or "can1" not in bus:
            return ""
        if left[0] and self.rng.random() < 0.3:
            left[0] -= 1
            return f", priority: [{self.rng.randint(0, 3)}, {self.rng.randint(4, 7)}]"
        return f", priority: {self.rng.choice((0, 2, 2, 5))}" if self.rng.random() < 0.95 else ""


def _perhaps_canopen(rng: Random, own: str) -> str:
    """An identifier that is stated alone, perhaps of CANopen: a number above all others."""
    if not own.startswith("0x") or rng.random() < 0.7:
        return own
    return f"{rng.choice(['TPDO1', 'RPDO2', 'TSDO'])} of node {int(own, 16)}"


@dataclass
class _Frames:
    """The connections of each sender on each bus, with the bytes that their frames have left, and further decisions."""

    rng: Random
    left: int
    rooms: dict[tuple[str, str], dict[str, int]] = field(default_factory=dict)

    def perhaps_carried(self, name: str, where: tuple[str, str, str], size: str, own: str) -> str:
        """Perhaps a connection in the message of another one, always or as a choice; else its message may carry others.

        `own` is its identifier where it has a message of its own; `where` its sender, receiver and bus.
        """
        source, target, bus = where
        if not source or "[" in bus or "from_port" in bus:
            return ""
        bus, _, more = bus.partition(",")
        rooms = self.rooms.setdefault((source, bus), {})
        heads = [head for head, room in rooms.items() if room > 1]
        begin = f"from: {source}, to: {target}, bus: {bus}{more and ','}{more}, data_size: "
        if heads and self.rng.random() < 0.7:
            head = self.rng.choice(heads)
            if self.left and self.rng.random() < 0.5:
                self.left -= 1
                rooms[name] = 2
                return f"{begin}{self.rng.choice((1, 4))} B, carried_in: [{head}, alone], identifier: {own}"
            rooms[head] -= 2
            return f"{begin}{self.rng.choice((1, 2))} B, carried_in: {head}"
        rooms[name] = 8 - max(int(part.removesuffix("B")) for part in size.strip("[]").split(","))
        return ""


def _transmit_queue(rng: Random, left: list[int], share: float) -> str:
    """Perhaps how a sender queues its messages, while some decisions are left perhaps both ways."""
    if rng.random() >= share:
        return ""
    if left[0] and rng.random() < 0.3:
        left[0] -= 1
        return ", transmit_queue: [priority, fifo]"
    return f", transmit_queue: {rng.choice(('fifo', 'fifo', 'priority'))}"


def _perhaps_rule(rng: Random, lines: Sequence[str]) -> str:
    """Perhaps how messages with any identifier take their places on the first bus, where there are such."""
    if not any("any" in line for line in lines if "bus: can0" in line or "bus: [can0" in line):
        return ""
    return rng.choice(("", ", assignment: robust", ", assignment: deadline_monotonic"))


def _perhaps_faults(rng: Random, left: list[int]) -> str:
    """Perhaps how often the wire may fail, while some decisions are left perhaps in several ways."""
    if rng.random() < 0.6:
        return ""
    interval = rng.choice(("3 ms", "10 ms", "25 ms", "7.3 ms"))
    if left[0] and rng.random() < 0.2:
        left[0] -= 1
        interval = "[5 ms, 20 ms]"
    return f", fault_interval: {interval}" + rng.choice(("", "", ", fault_burst: 2", ", fault_burst: 3"))


def _perhaps_any(rng: Random, left: list[int], share: float, own: str) -> str:
    """Perhaps any identifier, alone or, while some decisions are left, beside what a message has."""
    if rng.random() >= share:
        return own
    if not left[0] or rng.random() < 0.5:
        return "any"
    left[0] -= 1
    return f"[{own.strip('[]')}, any]"
