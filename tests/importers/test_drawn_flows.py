"""Random chains with several flow implementations, feature groups and bindings, against a count by hand.

Each stage but the ends is a system with some subsystems, each of which implements its flow; each two stages are
connected by a feature group, bound to none, one or two virtual buses of a bus. So a flow is one for each choice of
subsystems and features, with the sum of their latencies and of what the buses take.
"""

from __future__ import annotations

import random
from collections import Counter
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

import dse
from tests.helpers.effort import cases
from tests.helpers.small import MS
from tests.importers.test_osate_figures import latencies
from tests.importers.test_reading import written

SETTINGS = "AS-MF-DL-EQ-DQL"
PERIOD_MS = 10
HEAD = """
package m public with SEI;
  bus wire properties Data_Size => 1 Bytes; Transmission_Time => [PerByte => 8 ms .. 8 ms;]; end wire;
  virtual bus plain end plain;
  virtual bus heavy properties Data_Size => 4 bits; Latency => 1 ms .. 1 ms; end heavy;
"""
OVERHEADS = {"plain": Fraction(0), "heavy": Fraction(1, 2)}
LATENCIES_MS = {"plain": 0, "heavy": 1}
PER_BYTE_MS = 8


class DrawnChain:
    """A chain: the latencies (ms) of the subsystems of each stage, the sizes (bits) of the features, the bindings."""

    def __init__(self, seed: int) -> None:
        draw = random.Random(seed)
        self.stages = [[draw.randint(1, 9)]]
        middle = draw.choice(([1], [2], [3], [1, 2], [2, 2]))
        self.stages += [[draw.randint(1, 99) for _ in range(count)] for count in middle]
        self.stages += [[draw.randint(1, 9)]]
        self.sizes = [draw.choice((1, 4, 8, 12, 80)) for _ in range(draw.randint(1, 2))]
        self.bound = [draw.choice(((), ("plain",), ("heavy",), ("plain", "heavy"))) for _ in self.stages[1:]]
        self.modal = draw.random() < 0.3

    @property
    def text(self) -> str:
        """The model."""
        lines = [
            HEAD,
            *(f"data d{n} properties Data_Size => {size} bits; end d{n};" for n, size in enumerate(self.sizes)),
        ]
        features = " ".join(f"x{n} : out event data port d{n};" for n in range(len(self.sizes)))
        lines.append(f"feature group group features {features} end group;")
        for number, stage in enumerate(self.stages):
            lines += self._stage(number, stage)
        subs = [f"s{n} : system t{n}.i;" for n in range(len(self.stages))]
        wires = [f"w{n} : feature group s{n}.o -> s{n + 1}.i;" for n in range(len(self.bound))]
        buses = sorted({name for names in self.bound for name in names})
        subs += ["b : bus wire;", *(f"{name}_bus : virtual bus {name};" for name in buses)]
        said = [f"Actual_Connection_Binding => (reference (b)) applies to {name}_bus;" for name in buses]
        for number, names in enumerate(self.bound):
            if names:
                listed = ", ".join(f"reference ({name}_bus)" for name in names)
                said.append(f"Actual_Connection_Binding => ({listed}) applies to w{number};")
        path = " -> ".join(part for n in range(len(self.stages)) for part in (f"s{n}.f", f"w{n}")).rpartition(" -> ")[0]
        lines.append("system top end top; system implementation top.i")
        lines.append(f"subcomponents {' '.join(subs)} connections {' '.join(wires)}")
        lines.append(
            f"flows e : end to end flow {path}; {'properties' if said else ''} {' '.join(said)} end top.i; end m;"
        )
        return "\n".join(lines)

    def _stage(self, number: int, stage: list[int]) -> list[str]:
        """A system with a subsystem for each latency, each with a flow implementation through it."""
        is_first, is_last = number == 0, number == len(self.stages) - 1
        entry = "" if is_first else "i : feature group inverse of group;"
        leaving = "" if is_last else "o : feature group group;"
        ends = "source o" if is_first else "sink i" if is_last else "path i -> o"
        features = f"features {entry} {leaving}"
        found, subs, wires, flows = [], [], [], []
        for index, latency in enumerate(stage):
            own = f"p{number}_{index}"
            found.append(
                f"device {own} {features} flows f : flow {ends} {{Latency => {latency} ms .. {latency} ms;}};"
                f" properties Period => {PERIOD_MS} ms; end {own};"
            )
            subs.append(f"c{index} : device {own};")
            parts = [f"c{index}.f"]
            if not is_first:
                wires.append(f"a{index} : feature group i -> c{index}.i;")
                parts = ["i", f"a{index}", *parts]
            if not is_last:
                wires.append(f"z{index} : feature group c{index}.o -> o;")
                parts += [f"z{index}", "o"]
            modes = " in modes (one)" if self.modal and index == 0 else " in modes (two)" if self.modal else ""
            flows.append(f"f : flow {ends.split()[0]} {' -> '.join(parts)}{modes};")
        modes = "modes one : initial mode; two : mode;" if self.modal else ""
        found.append(f"system t{number} {features} flows f : flow {ends}; end t{number};")
        found.append(
            f"system implementation t{number}.i subcomponents {' '.join(subs)} connections {' '.join(wires)} "
            f"flows {' '.join(flows)} {modes} end t{number}.i;"
        )
        return found

    def times(self) -> Counter[Fraction]:
        """The latencies of all flows, by hand: of each stage one subsystem, over each connection one feature."""
        stages = [stage[:1] if self.modal else stage for stage in self.stages]
        found: Counter[Fraction] = Counter()
        for chosen in product(*stages):
            for carried in product(self.sizes, repeat=len(self.bound)):
                waits = (self._carried(size, names) for size, names in zip(carried, self.bound, strict=True))
                found[sum(chosen) + sum(waits, Fraction(0))] += 1
        return found

    @staticmethod
    def _carried(bits: int, names: tuple[str, ...]) -> Fraction:
        """What the bus takes for each virtual bus: 8 ms for each byte of the message and both overheads."""
        return sum(
            (LATENCIES_MS[name] + PER_BYTE_MS * (Fraction(bits, 8) + OVERHEADS[name] + 1) for name in names),
            Fraction(0),
        )

    def load(self) -> Fraction:
        """What the bus carries in B/s: of each pair of subsystems each feature, once for each virtual bus."""
        total = Fraction(0)
        for number, names in enumerate(self.bound):
            pairs = len(self.stages[number]) * len(self.stages[number + 1])
            for bits, name in product(self.sizes, names):
                total += pairs * (Fraction(bits, 8) + OVERHEADS[name] + 1) * Fraction(1000, PERIOD_MS)
        return total


@pytest.mark.parametrize("seed", cases(25))
def test_flows_and_loads_of_drawn_chains(seed: int, tmp_path: Path) -> None:
    drawn = DrawnChain(seed)
    found = latencies(tmp_path, drawn.text, SETTINGS)
    assert Counter(most for _, most in found.values()) == drawn.times()
    assert all(least == most for least, most in found.values())
    analysis = dse.analyse(written(tmp_path, drawn.text))
    assert analysis.metrics.get("load of b", 0) == drawn.load()
    assert not analysis.unread


@pytest.mark.parametrize("seed", cases(6))
def test_drawn_chains_survive_the_import_and_the_export(seed: int, tmp_path: Path) -> None:
    drawn = DrawnChain(100 + seed)
    (tmp_path / "x.yaml").write_text(dse.import_file(written(tmp_path, drawn.text)).text, encoding="utf-8")
    result = dse.solve(tmp_path / "x.yaml", minimise="price", bus_queuing="not_counted")
    (tmp_path / "out.aadl").write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    for name in ("x.yaml", "out.aadl"):
        again = dse.analyse(tmp_path / name, bus_queuing="not_counted")
        assert Counter(Fraction(flow.max_ns) / MS for flow in again.flows) == drawn.times()
        assert again.metrics.get("load of b", 0) == drawn.load()
