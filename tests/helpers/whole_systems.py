"""Random systems without decisions: chains through devices, cores, executors and buses, with a flow to each thread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

KINDS = ("fifo", "wait_set", "callback_group", "callback_group", "polling")
PERIODS = (5, 8, 10, 10, 12, 20, 20, 25, 40)
"""In ms."""


@dataclass
class _Home:
    """Where a thread may run: a core of a computer, or an executor there."""

    computer: int
    core: int
    executor: int | None = None
    has_priorities: bool = True

    @property
    def where(self) -> tuple[int, int]:
        """Its computer and core."""
        return self.computer, self.core

    @property
    def text(self) -> str:
        return f"executor: e{self.executor}" if self.executor is not None else f"processor: p{self.computer}"


def draw_whole_system(seed: int) -> str:
    """The text of a problem with one to three computers of one or two cores, one to four chains of up to six threads.

    Between threads of a computer a message takes no time, some, or goes through middleware; between computers it goes
    over one CAN bus, on which it waits. Chains begin with a timer or a device. Some threads hold their core, fork, or
    stand beside. Longest processing uses 30 to 90 % of each core.
    """
    rng = Random(f"whole systems {seed}")
    cores = [rng.choice((1, 1, 2)) for _ in range(rng.choice((1, 1, 2, 3)))]
    homes = [_Home(computer, core + 1) for computer, count in enumerate(cores) for core in range(count)]
    executors = []
    for number in range(rng.choice((0, 1, 1, 2, 3))):
        home, kind = rng.choice(homes), rng.choice(KINDS)
        priority = rng.choice(("", f", priority: {rng.randint(1, 9)}"))
        executors.append(f"  e{number}: {{processor: p{home.computer}, core: {home.core}, kind: {kind}{priority}}}")
        homes += [_Home(home.computer, home.core, number, kind == "callback_group")] * 2
    counts = rng.random() < 0.8
    lines = ["dse: 1", f"name: whole {seed}", f"processing: {'response_time' if counts else 'execution_time'}"]
    lines += ["deadlines: none", "overload: allowed", "processor_types:"]
    lines += [f"  c{number}: {{cores: {count}}}" for number, count in enumerate(cores)]
    lines += ["bus_types:", f"  can: {{bandwidth: {rng.choice((125, 250, 500))} kbit/s, frame: can}}"]
    lines += ["  ipc: {virtual: true, transmission_time: {fixed: 100 us .. 1500 us}}"]
    lines += ["processors:", *(f"  p{number}: {{type: c{number}}}" for number in range(len(cores)))]
    lines += ["buses:", "  can0: {type: can, overload: allowed}", "  middleware: {type: ipc}"]
    system = _System(rng, homes, rng.sample(range(1, 90), 80))
    for chain in range(rng.choice((1, 2, 2, 3, 4))):
        system.add_chain(chain)
    for number in range(rng.choice((0, 0, 1, 2))):
        system.add_thread(f"beside{number}", rng.choice(homes), rng.choice(PERIODS), is_timer=True)
    used = {item.home.executor for item in system.all_threads}
    executors = [line for number, line in enumerate(executors) if number in used]
    lines += ["executors:", *executors] if executors else []
    lines += ["devices:", *system.devices, "  sink: {}"]
    lines += ["threads:", *system.threads(rng.uniform(0.3, 0.9))]
    lines += ["connections:", *system.connections] if system.connections else []
    goals = ["price"]
    if counts:
        lines += ["metrics:", *(f"  end_{name}: response time of {name}" for name in system.names)]
        goals = [f"end_{name}" for name in system.names]
    lines += ["flows:", *system.flows] if system.flows else []
    return "\n".join([*lines, f"objectives: [{', '.join(f'minimise {goal}' for goal in goals)}]", ""])


@dataclass
class _Thread:
    name: str
    home: _Home
    period: int
    share: float
    fields: str


class _System:
    """Devices, threads, connections and flows as they are drawn."""

    def __init__(self, rng: Random, homes: Sequence[_Home], identifiers: list[int]) -> None:
        self.rng, self.homes, self.identifiers = rng, homes, identifiers
        self.devices: list[str] = []
        self.connections: list[str] = []
        self.flows: list[str] = []
        self.all_threads: list[_Thread] = []

    def add_chain(self, number: int) -> None:
        """A timer or device, and up to five threads behind it; now and then a last message to a device."""
        rng = self.rng
        period = rng.choice(PERIODS)
        before: list[tuple[str, _Home | None, list[str]]] = []  # name, home, way to it
        if rng.random() < 0.35:
            name = f"d{number}"
            job = rng.choice(("", ", compute_execution_time: 100 us .. 2 ms", ", latency: 200 us .. 6 ms"))
            self.devices.append(f"  {name}: {{period: {period} ms{job}}}")
            before.append((name, None, [name]))
        near = rng.choice(self.homes)
        for place in range(rng.choice((1, 2, 3, 4, 5, 6))):
            home = near if rng.random() < 0.6 else rng.choice(self.homes)
            name = f"t{number}_{place}"
            self.add_thread(name, home, period, is_timer=not before)
            way = [name]
            if before:
                source, at, path = before[-2 if len(before) > 2 and rng.random() < 0.1 else -1]
                self._connect(source, at, name, home)
                way = [*path, name]
                self.flows.append(f"  f_{name}: {{path: [{', '.join(way)}]}}")
            before.append((name, home, way))
        if rng.random() < 0.3:
            source, at, path = before[-1]
            self._connect(source, None, "sink", at)
            self.flows.append(f"  f_{number}: {{path: [{', '.join([*path, 'sink'])}]}}")

    def add_thread(self, name: str, home: _Home, period: int, *, is_timer: bool) -> None:
        """A thread that a timer releases, or the end of another one."""
        rng = self.rng
        fields = f"period: {period} ms" if is_timer else "dispatch_protocol: aperiodic"
        fields += f", {home.text}" + (f", core: {home.core}" if home.executor is None else "")
        if home.has_priorities and rng.random() < 0.9:
            fields += f", priority: {rng.randint(1, 9)}"
        self.all_threads.append(_Thread(name, home, period, rng.random() ** 2, fields))

    def _connect(self, source: str, at: _Home | None, target: str, home: _Home | None) -> None:
        rng = self.rng
        ends = f"from: {source}, to: {target}"
        if at is not None and home is not None and at.computer == home.computer and target != "sink":
            extra = rng.choice(
                ("", "", "", ", latency: 0 ms .. 1 ms", ", latency: 2 ms .. 3 ms", ", bus: middleware, data_size: 1 B")
            )
        elif rng.random() < 0.75:
            late = rng.choice(("", "", f", latency: 0 ms .. {rng.choice((1, 4, 12))} ms"))
            size = rng.choice((0, 2, 8, 8, 12))
            extra = f", bus: can0, data_size: {size} B, identifier: {self.identifiers.pop():#x}{late}"
        else:
            extra = rng.choice(("", f", latency: 0 ms .. {rng.choice((1, 4, 12))} ms"))
        self.connections.append(f"  c{len(self.connections)}: {{{ends}{extra}}}")

    @property
    def names(self) -> list[str]:
        """The names of the threads."""
        return [item.name for item in self.all_threads]

    def threads(self, load: float) -> list[str]:
        """The lines of all threads, where they use so much of each core."""
        rng = self.rng
        lines = []
        for item in self.all_threads:
            beside = [one for one in self.all_threads if one.home.where == item.home.where]
            worst = max(1, round(1000 * load * item.period * item.share / sum(one.share for one in beside)))
            worst -= worst % 10 if worst > 10 else 0
            best = rng.choice((worst, worst, worst // 2, 0))
            holds = rng.random() < 0.07 and worst > 1 and item.home.executor is None
            held = f", non_preemptive: {rng.randint(1, worst)} us" if holds else ""
            lines.append(f"  {item.name}: {{{item.fields}, compute_execution_time: {best} us .. {worst} us{held}}}")
        return lines
