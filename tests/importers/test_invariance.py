"""Other ways to write the same model change no number; cut-off and mutated models give located findings."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.importers.registry import read_foreign
from dse.support.errors import ProblemError
from tests.helpers.effort import cases

ROOT = Path(__file__).parents[2]
MODELS = sorted((ROOT / "problems" / "aadl").glob("*.aadl"))


class Drawn:
    """A random pipeline of stages: devices, threads in processes, abstract components, and what is said of each."""

    def __init__(self, seed: int) -> None:
        draw = random.Random(seed)
        self.stages = [draw.choice(("device", "thread", "abstract")) for _ in range(draw.randint(2, 5))]
        self.ports = [draw.choice(("data port", "event data port", "feature")) for _ in self.stages[1:]]
        self.figures = [self._figures(draw, kind) for kind in self.stages]
        self.sizes = [draw.randint(1, 400) for _ in self.ports]
        self.bound = [draw.random() < 0.6 for _ in self.ports]

    @staticmethod
    def _figures(draw: random.Random, kind: str) -> list[str]:
        found = []
        if draw.random() < 0.7:
            found.append(f"Period => {draw.choice((5, 10, 20, 40))} ms;")
        if draw.random() < 0.7:
            low = draw.randint(1, 900)
            found.append(f"Compute_Execution_Time => {low} us .. {low + draw.randint(0, 900)} us;")
        if draw.random() < 0.3:
            found.append(f"Dispatch_Protocol => {draw.choice(('Periodic', 'Aperiodic'))};")
        if draw.random() < 0.3:
            found.append(f"Deadline => {draw.randint(1, 9)} ms;")
        return found

    def types(self, *, inherit: bool) -> list[str]:
        """A type for each stage; its figures in it, or in what it extends."""
        found = []
        for number, kind in enumerate(self.stages):
            features = []
            if number:
                features.append(f"i : in {self.ports[number - 1]} d{number - 1};")
            if number < len(self.ports):
                features.append(f"o : out {self.ports[number]} d{number};")
            ends = [name[0] for name in features]
            flow = "path i -> o" if len(ends) == 2 else f"{'source' if ends == ['o'] else 'sink'} {ends[0]}"
            stated = f"properties {' '.join(self.figures[number])}" if self.figures[number] else ""
            body = f"features {' '.join(features)} flows f : flow {flow};"
            if inherit:
                found.append(f"{kind} base{number} {stated} end base{number};")
                found.append(f"{kind} mid{number} extends base{number} {body} end mid{number};")
                found.append(f"{kind} t{number} extends mid{number} end t{number};")
            else:
                found.append(f"{kind} t{number} {body} {stated} end t{number};")
            if kind == "thread":
                found += self._process(number, features, flow)
        found += [f"data d{n} properties Data_Size => {size} Bytes; end d{n};" for n, size in enumerate(self.sizes)]
        record = "[Fixed => 3 us .. 5 us; PerByte => 100 ns .. 200 ns;]"
        found.append(f"bus wire properties Transmission_Time => {record}; end wire;")
        return found

    def _process(self, number: int, features: list[str], flow: str) -> list[str]:
        up = "c2 : feature t.o -> o;" if flow.endswith("o") else ""
        down = "c1 : feature i -> t.i;" if number else ""
        inner = [part for part in ("i -> c1" if number else "", "t.f", "c2 -> o" if up else "") if part]
        word = flow.split()[0]
        said = (
            f"subcomponents t : thread t{number}; connections {down} {up} flows f : flow {word} {' -> '.join(inner)};"
        )
        return [
            f"process q{number} features {' '.join(features)} flows f : flow {flow}; end q{number};",
            f"process implementation q{number}.i {said} end q{number}.i;",
        ]

    def root(self, order: random.Random | None = None, prefix: str = "") -> str:
        """The root; its declarations in another order where `order` is given, types from packages by `prefix`."""
        subs = [f"b : bus {prefix}wire;"]
        for number, kind in enumerate(self.stages):
            category, name = ("process", f"q{number}.i") if kind == "thread" else (kind, f"t{number}")
            subs.append(f"s{number} : {category} {prefix}{name};")
        wires = [f"w{n} : feature s{n}.o -> s{n + 1}.i;" for n in range(len(self.ports))]
        elements = " -> ".join(part for n in range(len(self.stages)) for part in (f"s{n}.f", f"w{n}"))
        flow = f"e : end to end flow {elements.rpartition(' -> ')[0]};"
        said = [
            f"Actual_Connection_Binding => (reference (b)) applies to w{n};"
            for n, is_bound in enumerate(self.bound)
            if is_bound
        ]
        if order is not None:
            for part in (subs, wires, said):
                order.shuffle(part)
        stated = f"properties {' '.join(said)}" if said else ""
        head = "system top end top; system implementation top.i"
        return f"{head} subcomponents {' '.join(subs)} connections {' '.join(wires)} flows {flow} {stated} end top.i;"


def figures(path: Path) -> dict[str, Any]:
    found = dse.analyse(path)
    rows = [(row.category, row.min_ns, row.min_method, row.max_ns, row.max_method) for row in found.flows[0].rows]
    buses = {item.name.lower(): sorted(item.shares.values()) for item in found.buses}
    return {"rows": rows, "buses": buses, "total": (found.flows[0].min_ns, found.flows[0].max_ns)}


def write(folder: Path, name: str, *texts: str) -> Path:
    (folder / name).mkdir()
    for number, text in enumerate(texts):
        (folder / name / f"f{number}.aadl").write_text(text, encoding="utf-8")
    return folder / name / "f0.aadl"


@pytest.mark.parametrize("seed", cases(12))
def test_other_words_for_the_same_model_change_no_number(seed: int, tmp_path: Path) -> None:
    """Renaming, reordering, splitting into packages, inheriting instead of copying, capitals and comments."""
    drawn, order = Drawn(seed), random.Random(seed)
    types, root = drawn.types(inherit=False), drawn.root()
    plain = f"package m public {' '.join([*types, root])} end m;"
    expected = figures(write(tmp_path, "plain", plain))
    shuffled = drawn.types(inherit=False)
    order.shuffle(shuffled)
    renamed = re.sub(r"\b(s|w|t|q|d)(\d)\b", r"a_much_longer_\1\2", plain)
    parts = f"package lib::parts public {' '.join(types)} end lib::parts;"
    variants = {
        "reordered": [f"package m public {drawn.root(order)} {' '.join(shuffled)} end m;"],
        "inheriting": [f"package m public {' '.join(drawn.types(inherit=True))} {root} end m;"],
        "renamed": [renamed],
        "split": [f"package m public with lib::parts; {drawn.root(prefix='lib::parts::')} end m;", parts],
        "capitals": [plain.upper().replace(" MS;", " ms;")],
        "commented": [plain.replace(";", "; -- a comment;\n").replace("end m;", "annex x {** end m; **};\nend m;")],
    }
    for name, texts in variants.items():
        assert figures(write(tmp_path, name, *texts)) == expected, name


@pytest.mark.parametrize("seed", cases(60))
def test_cut_off_and_mutated_models_give_located_findings(seed: int, tmp_path: Path) -> None:
    """A model of the report, cut off or with a token lost, doubled or exchanged: it is read, or there is a place."""
    draw = random.Random(seed)
    original = draw.choice(MODELS)
    text = original.read_text(encoding="utf-8")
    tokens = [found.span() for found in re.finditer(r"\w+|[^\s\w]+", text)]
    start, end = draw.choice(tokens)
    other = draw.choice(tokens)
    kind = draw.choice(("cut", "lost", "doubled", "exchanged"))
    if kind == "cut":
        text = text[:start]
    elif kind == "lost":
        text = text[:start] + text[end:]
    elif kind == "doubled":
        text = text[:end] + " " + text[start:]
    else:
        text = text[:start] + text[slice(*other)] + text[end:]
    for item in MODELS:
        (tmp_path / item.name).write_text(item.read_text(encoding="utf-8"), encoding="utf-8")
    path = tmp_path / original.name
    path.write_text(text, encoding="utf-8")
    try:
        found = read_foreign(path)
        assert all(item.line and item.column for item in found.remarks)
        dse.load(path)
    except ProblemError as error:
        said = [
            item
            for item in error.diagnostics
            if "--root" not in item.hint and "system implementation" not in item.message
        ]
        assert all(item.line for item in said), [str(item) for item in said]


def test_a_model_with_many_flows_over_feature_groups(tmp_path: Path) -> None:
    """165 flows through three levels: each is found; the number of connections is that of the ports."""
    count = 165
    ports = " ".join(f"p{n} : out data port;" for n in range(count))
    flows = " ".join(f"f{n} : flow source g.p{n};" for n in range(count))
    sinks = " ".join(f"f{n} : flow sink h.p{n};" for n in range(count))
    inner = " ".join(f"e{n} : end to end flow a.t.f{n} -> x -> b.t.f{n};" for n in range(count))
    text = f"""
package m public
  feature group plug features {ports} end plug;
  feature group socket inverse of plug end socket;
  thread sender features g : feature group plug; flows {flows} properties Period => 10 ms; end sender;
  thread receiver features h : feature group socket; flows {sinks} properties Period => 20 ms; end receiver;
  process one features g : feature group plug; end one;
  process implementation one.i subcomponents t : thread sender; connections c : feature group t.g <-> g; end one.i;
  process two features h : feature group inverse of plug; end two;
  process implementation two.i subcomponents t : thread receiver; connections c : feature group h <-> t.h; end two.i;
  system top end top;
  system implementation top.i
    subcomponents a : process one.i; b : process two.i;
    connections x : feature group a.g <-> b.h;
    flows {inner}
  end top.i;
end m;"""
    path = tmp_path / "m.aadl"
    path.write_text(text, encoding="utf-8")
    problem = dse.load(path)
    assert (len(problem.space.flows), len(problem.space.connections)) == (count, count)
    assert {len(flow.steps) for flow in problem.space.flows} == {3}
