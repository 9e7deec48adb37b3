"""Implementations of subsystems as alternatives: each design is the model with those implementations."""

from __future__ import annotations

import random
from itertools import product
from pathlib import Path

import pytest

import dse
from dse.support.errors import ProblemError, UsageError
from tests.helpers.effort import cases

HEAD = """package r public
  data msg properties Data_Size => 8 Bytes; end msg;
  device sensor
    features o : out data port msg;
    flows f : flow source o {Latency => 1 ms .. 2 ms;};
    properties Period => 5 ms;
  end sensor;
  device sink
    features i : in event data port msg;
    flows f : flow sink i {Latency => 1 ms .. 2 ms;};
  end sink;
  thread a
    features i : in data port msg; o : out event data port msg;
    flows f : flow path i -> o;
    properties Dispatch_Protocol => Periodic;
  end a;
  thread b
    features i : in event data port msg; o : out event data port msg;
    flows f : flow path i -> o;
  end b;
  process part
    features i : in data port msg; o : out event data port msg;
    flows f : flow path i -> o;
  end part;
  process implementation part.base
    subcomponents a : thread a; b : thread b;
    connections c1 : port i -> a.i; c2 : port a.o -> b.i; c3 : port b.o -> o;
    flows f : flow path i -> c1 -> a.f -> c2 -> b.f -> c3 -> o;
  end part.base;
  processor cpu end cpu;
  bus wire properties Transmission_Time => [Fixed => 1 us .. 2 us; PerByte => 1 us .. 1 us;]; end wire;
  system top end top;
  system implementation top.i
    subcomponents s : device sensor; p : process part.base; q : process part.v0; d : device sink; c : processor cpu;
      w : bus wire; x : bus wire;
    connections k1 : port s.o -> p.i; k : port p.o -> q.i; k2 : port q.o -> d.i;
    flows e : end to end flow s.f -> k1 -> p.f -> k -> q.f -> k2 -> d.f {Latency => 0 ms .. 90 ms;};
    properties
      Actual_Processor_Binding => (reference (c)) applies to p, q;
      Actual_Connection_Binding => (reference (w)) applies to k1, k2;
  end top.i;
"""


def drawn(seed: int) -> tuple[str, int]:
    """A model with several implementations of a process, and how many."""
    draw = random.Random(seed)
    count, found = draw.randint(2, 3), HEAD
    for number in range(count):
        low = draw.randint(1, 900)
        said = [
            f"Period => {draw.choice((5, 10, 20))} ms applies to a;",
            f"Compute_Execution_Time => {low} us .. {low + draw.randint(0, 900)} us applies to a, b;",
            f"Dispatch_Protocol => {draw.choice(('Aperiodic', 'Timed'))} applies to b;",
            f"Priority => {draw.randint(1, 9)} applies to b;",
        ]
        said += [f"Data_Size => {draw.randint(1, 99)} Bytes applies to b.o;"] if draw.random() < 0.6 else []
        said += [f"Deadline => {draw.randint(1, 9)} ms applies to a;"] if draw.random() < 0.5 else []
        found += (
            f"process implementation part.v{number} extends part.base properties {' '.join(said)} end part.v{number};\n"
        )
    return found + "end r;", count


def files(folder: Path, text: str, said: str) -> Path:
    (folder / "r.aadl").write_text(text, encoding="utf-8")
    (folder / "r.yaml").write_text(
        f"{{dse: 1, name: r, of: r.aadl, worst_case: execution_time, {said}}}", encoding="utf-8"
    )
    return folder / "r.yaml"


def types(count: int) -> str:
    return "[" + ", ".join(f"part.v{number}" for number in range(count)) + "]"


@pytest.mark.parametrize("seed", cases(4))
def test_each_design_is_the_model_with_these_implementations(seed: int, tmp_path: Path) -> None:
    text, count = drawn(seed)
    question = "thread_types: {part.v0: {price: 3 EUR}, part.v1: {price: 1 EUR}}, objectives: [minimise latency of e, "
    question += "minimise price]"
    path = files(tmp_path, text, f"threads: {{p: {{type: {types(count)}}}, q: {{type: {types(count)}}}}}, {question}")
    problem = dse.load(path)
    expected = set()
    for one, other in product(range(count), repeat=2):
        plain = text.replace("p : process part.base", f"p : process part.v{one}")
        plain = plain.replace("q : process part.v0", f"q : process part.v{other}")
        (tmp_path / "plain").mkdir(exist_ok=True)
        (tmp_path / "plain" / "r.aadl").write_text(plain, encoding="utf-8")
        mine = dse.analyse(problem, [f"p.type = part.v{one}", f"q.type = part.v{other}"])
        theirs = dse.analyse(tmp_path / "plain" / "r.aadl", worst_case="execution_time")
        assert mine.flows[0].rows == theirs.flows[0].rows
        for name, value in theirs.metrics.items():
            assert mine.metrics[name] == value or name == "price", name
        price = sum({0: 300, 1: 100}.get(number, 0) for number in (one, other))
        expected.add((mine.flows[0].max_ns, price))
    front = {item for item in expected if not any(o != item and o[0] <= item[0] and o[1] <= item[1] for o in expected)}
    result = dse.solve(problem)
    assert {tuple(point.objectives.values()) for point in result.front} == front
    assert dse.verify(result).exit_code == 0


def test_what_a_design_leaves_open_follows_from_the_implementation(tmp_path: Path) -> None:
    """A baseline, and `--design`, name the implementation alone; before, every field within it was asked for."""
    text, _ = drawn(1)
    said = "threads: {p: {type: [part.v0, part.v1]}}, baseline: {p: {type: part.v1}}, objectives: [minimise changes]"
    problem = dse.load(files(tmp_path, text, said))
    assert dse.analyse(problem).metrics["changes"] == 0
    assert dse.analyse(problem, ["p.type = part.v0"]).metrics["changes"] == 1
    with pytest.raises(UsageError, match=r"the design leaves open: .*p\.type"):
        dse.analyse(dse.load(files(tmp_path, text, said.partition(", baseline")[0])))


def test_a_chosen_implementation_is_a_refined_subcomponent(tmp_path: Path) -> None:
    text, _ = drawn(2)
    said = "threads: {p: {type: [part.v1, part.v0]}, p.a: {period: [2 ms, 40 ms]}}, objectives: [minimise latency of e]"
    result = dse.solve(files(tmp_path, text, said))
    exported = dse.export(result, 1, "aadl")
    chosen = result.front[0].decisions["p.type"]
    assert f"p : refined to process r::{chosen};" in exported and "Period => 2 ms applies to p.a;" in exported
    (tmp_path / "chosen.aadl").write_text(exported, encoding="utf-8")
    again = dse.analyse(tmp_path / "chosen.aadl", worst_case="execution_time")
    assert again.metrics["latency of e"] == result.front[0].metrics["latency of e"]


OTHER = "process implementation part.more extends part.v0 subcomponents c : thread b; end part.more;\n"
SLOW = "process implementation part.slow extends part.v0 properties Timing => Immediate applies to c2; end part.slow;\n"
BOX = "system box end box; system implementation box.i subcomponents z : process part.v0; end box.i;"
NESTED = HEAD.replace("system top end", f"{BOX} system top end").replace(
    "x : bus wire;", "x : bus wire; y : system box.i;"
)


@pytest.mark.parametrize(
    ("given", "types", "message"),
    [
        (OTHER, "p: {type: [part.v0, part.more]}", r"differ in their threads \(p\.c\).*compare them as two roots"),
        (SLOW, "p: {type: [part.v0, part.slow]}", r"differ in the timing of p\.a\.o, which alternatives"),
        ("", "p: {type: [part.v0, part.w]}", r'threads.p.type\[1\]: unknown thread type "part.w"'),
        ("", "s: {type: [part.v0, part.v1]}", "among its devices"),
    ],
)
def test_what_cannot_be_alternatives_is_refused_by_name(given: str, types: str, message: str, tmp_path: Path) -> None:
    text, _ = drawn(3)
    with pytest.raises(ProblemError, match=message):
        dse.load(files(tmp_path, text.replace("end r;", given + "end r;"), f"threads: {{{types}}}"))


def test_subsystems_within_each_other_are_refused(tmp_path: Path) -> None:
    text = NESTED + drawn(3)[0].removeprefix(HEAD)
    said = "threads: {y: {type: [box.i]}, y.z: {type: [part.v0, part.v1]}}"
    with pytest.raises(ProblemError, match=r"y\.z is within y"):
        dse.load(files(tmp_path, text, said))


def test_what_implementations_state_is_looked_at_and_differing_budgets_are_told(tmp_path: Path) -> None:
    text, count = drawn(3)
    text = text.replace("processor cpu", "processor cpu properties SEI::MIPSCapacity => 10.0 MIPS;", 1)
    text = text.replace("package r public", "package r public with SEI;").replace(
        "Priority =>", "Reference_Processor => classifier (cpu) applies to a; Priority =>"
    )
    problem = dse.load(files(tmp_path, text, f"threads: {{q: {{type: {types(count)}}}}}"))
    told = [str(item) for item in problem.loaded.told]
    assert any("budgets of processors and memories differ with the type of q" in item for item in told)
    assert not any("Binding is not looked at" in item or "Execution_Time is not" in item for item in told)
