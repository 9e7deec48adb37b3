"""OSATE's resource budgets: what threads and subsystems need, and its verdicts, with the sums by hand."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import dse
from dse.analysis.osate.resources import ResourceUse

TEXT = """
dse: 1
name: budgets
profile: osate-2.19
processor_types: {pc: {speed: 1.2 MIPS}, fast: {speed: 3 MIPS}, old: {}}
processors: {cpu: {type: [pc, fast]}, spare: {type: old}}
partitions: {part: {period: 10 ms, duration: 5 ms, speed: 100 KIPS}}
memories: {main: {ram: 30 KB, rom: 10 KB}, disk: {size: 40 KB}}
threads:
  sense: {period: 20 ms, compute_execution_time: 8 ms .. 12 ms, processor: cpu}
  filter: {period: 20 ms, compute_execution_time: 1 ms, processor: [cpu, spare]}
  lone: {period: 10 ms, compute_execution_time: 2 ms, processor: cpu, partition: part}
  free: {period: 10 ms}
budgets:
  all: {}
  iop: {within: all, speed: 0.8 MIPS, processor: cpu, ram: 30 KB, memory: main}
  sense: {within: iop, ram_used: 20 KB, rom_used: 1 KB}
  filter: {within: iop, ram_used: 15 KB, instructions: 4 KIPD}
  display: {speed: 300 KIPS, processor: cpu, ram: 5 KB, memory: disk}
"""


def uses(**fix: str) -> dict[tuple[str, str], ResourceUse]:
    fixed = {"cpu.type": "pc", "filter.processor": "cpu"} | {key.replace("_", "."): text for key, text in fix.items()}
    return {(use.name, use.resource): use for use in dse.analyse(dse.loads(TEXT), fixed).resources}


def said(use: ResourceUse) -> list[str]:
    return [f"{item.severity}: {item.text}" for item in use.findings]


def test_what_threads_and_subsystems_need() -> None:
    """12 / 20 x 1.2 = 0.72 and 4000 / 20 ms = 0.2 MIPS in iop, 2 / 10 x 1.2 = 0.24 of lone, the budget of display."""
    found = uses()
    cpu = found["cpu", "speed"]
    assert [(item.name, item.used, item.budget) for item in cpu.users] == [
        ("iop", Fraction("0.92"), Fraction("0.8")), ("display", Fraction("0.3"), Fraction("0.3")),
        ("lone", Fraction("0.24"), None),
    ]  # fmt: skip
    assert (cpu.total, cpu.capacity, cpu.slack_ppm) == (Fraction("1.46"), Fraction("1.2"), Fraction(-26, 120) * 10**6)
    assert said(cpu) == ["error: what is bound to cpu needs 1.46 MIPS, more than its speed of 1.2 MIPS"]
    part = found["part", "speed"]
    assert (part.total, part.capacity) == (Fraction("0.24"), Fraction("0.1"))
    assert said(part) == ["error: what is bound to part needs 240 KIPS, more than its speed of 100 KIPS"]
    assert said(found["system", "speed"]) == [
        "error: iop needs 920 KIPS, more than its speed budget of 800 KIPS",
        "error: all together need 1.46 MIPS, the processors have 1.2 MIPS",
        "warning: 1 of 2 processors state their speed",
    ]


def test_the_decided_type_counts() -> None:
    """12 / 20 x 3 = 1.8, 0.2, 0.3, and 2 / 10 x 3 = 0.6: 2.9 of 3 MIPS."""
    cpu = uses(cpu_type="fast")["cpu", "speed"]
    assert (cpu.total, cpu.capacity, said(cpu)) == (Fraction("2.9"), 3, [])


def test_a_thread_that_is_bound_elsewhere_counts_with_what_contains_it() -> None:
    found = uses(filter_processor="spare")
    assert found["cpu", "speed"].total == Fraction("1.46")
    assert "warning: counted for cpu with what they are within, and for what they are bound to: filter" in said(
        found["cpu", "speed"]
    )
    spare = found["spare", "speed"]
    assert (spare.total, said(spare)) == (
        Fraction("0.2"), ["error: spare has no speed stated, but something is bound to it"],
    )  # fmt: skip


def test_memories() -> None:
    """Of iop 20 + 15 KB of RAM; of display its budget, on a memory of which the size is stated."""
    found = uses()
    assert (found["main", "RAM"].total, found["main", "ROM"].total) == (35000, 1000)
    assert said(found["main", "RAM"]) == ["error: what is bound to main needs 35000 B, more than its RAM of 30000 B"]
    assert (found["disk", "memory"].total, found["disk", "memory"].capacity) == (5000, 40000)
    assert found["system", "RAM"].total == 40000 and ("disk", "RAM") not in found
    assert "error: iop needs 35000 B, more than its RAM budget of 30000 B" in said(found["system", "RAM"])


def test_other_profiles_look_at_no_budget(tmp_path: Path) -> None:
    text = TEXT.replace("profile: osate-2.19\n", "").replace(", partition: part", "")
    assert dse.analyse(dse.loads(text), {"cpu.type": "pc", "filter.processor": "cpu"}).resources == ()
    plain = dse.loads("dse: 1\nname: n\nprofile: osate-2.19\nthreads: {a: {period: 1 ms}}\n")
    assert dse.analyse(plain).resources == ()


def test_budgets_go_through_aadl(tmp_path: Path) -> None:
    """The speed of a processor as MIPSCapacity, the rest in our property set."""
    (tmp_path / "p.yaml").write_text(TEXT, encoding="utf-8")
    fix = ["cpu.type = fast", "filter.processor = spare"]
    result = dse.solve(tmp_path / "p.yaml", minimise="price", fix=fix)
    text = dse.export(result, 1, "aadl")
    assert "SEI::MIPSCapacity => 3.0 MIPS;" in text
    (tmp_path / "x.aadl").write_text(text, encoding="utf-8")
    expected = dse.analyse(tmp_path / "p.yaml", {"cpu.type": "fast", "filter.processor": "spare"}).resources
    assert dse.analyse(tmp_path / "x.aadl").resources == expected
