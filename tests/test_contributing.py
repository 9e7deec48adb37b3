"""The steps of CONTRIBUTING.md, applied to a copy of the package: what they add is solved, proved again and swept."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import dse
from dse.questions.question import LIMITED, Question

ROOT = Path(__file__).parents[1]
HUNK = re.compile(r"^```diff\n--- (?P<file>\S+)\n(?P<lines>.*?)^```", re.M | re.S)
MODULE = re.compile(r"^```python\n# (?P<file>\S+)\n(?P<lines>.*?)^```", re.M | re.S)
PROBLEM = """
dse: 1
name: toy
processor_types: {cpu: {price: 5 EUR}, fast: {price: 9 EUR}}
processors: {p: {type: [cpu, fast]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: {cpu: 1 ms .. 4 ms, fast: 1 ms .. 2 ms}}
  b:
    processor: p
    period: [20 ms, 40 ms]
    compute_execution_time: {cpu: 1 ms .. 4 ms, fast: 1 ms .. 2 ms}
    release_jitter: [1 ms, 3 ms]
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
requirements: [output age of f <= 90 ms]
rules: ["b.period == 40 ms implies b.release_jitter == 3 ms"]
objectives: [minimise output age of f, minimise price, maximise min latency of f]
processing: execution_time
"""


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with every step of the document, and a problem that uses them."""
    folder = tmp_path_factory.mktemp("changed")
    shutil.copytree(ROOT / "dse", folder / "dse", ignore=shutil.ignore_patterns("*.pyc.*"))
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    hunks = list(HUNK.finditer(text))
    assert len(hunks) == text.count("```diff")
    for hunk in hunks:
        path = folder / hunk["file"]
        before = "".join(line[1:] for line in hunk["lines"].splitlines(keepends=True) if line[0] in " -")
        after = "".join(line[1:] for line in hunk["lines"].splitlines(keepends=True) if line[0] in " +")
        source = path.read_text(encoding="utf-8")
        assert source.count(before) == 1, f"CONTRIBUTING.md has another text of {hunk['file']} than there is:\n{before}"
        path.write_text(source.replace(before, after), encoding="utf-8")
    for block in MODULE.finditer(text):
        (folder / block["file"]).write_text(block["lines"], encoding="utf-8")
    (folder / "toy.yaml").write_text(PROBLEM, encoding="utf-8")
    return folder


COMMANDS = """
import contextlib, io, json, sys
from dse.cli.main import run

for line in sys.stdin:
    out, error = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = run(json.loads(line))
        out.flush(), error.flush()
    print(json.dumps([code, *(said.buffer.getvalue().decode() for said in (out, error))]), flush=True)
"""


@pytest.fixture(scope="module")
def called(changed: Path) -> Iterator[Callable[..., str]]:
    """What a command of the copy prints; one process runs them all."""
    with subprocess.Popen(
        [sys.executable, "-c", COMMANDS], cwd=changed, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        to, of = process.stdin, process.stdout

        def call(*arguments: str, code: int = 0) -> str:
            print(json.dumps(arguments), file=to, flush=True)
            exit_code, said, error = json.loads(of.readline())
            assert exit_code == code, said + error
            return str(said)

        yield call
        to.close()


def test_what_the_steps_add_is_searched_and_proved_again(changed: Path, called: Callable[..., str]) -> None:
    """On cpu, period 20 ms, released 1 ms late: 4 + 20 + 4 + 1 ms, and 20 ms for the age; on fast 4 ms less."""
    called("solve", "toy.yaml", "-q", "--json", "r.json")
    data = json.loads((changed / "r.json").read_text(encoding="utf-8"))
    found = {
        point["decisions"]["p.type"]: (point["decisions"], point["objectives"]["output age of f"])
        for point in data["front"]
    }
    best = {"b.period": "20 ms", "b.release_jitter": "1 ms"}
    assert found == {
        "cpu": ({"p.type": "cpu", **best}, 49_000_000),
        "fast": ({"p.type": "fast", **best}, 45_000_000),
    }
    for method in ("exhaustion", "model"):
        assert "VERIFIED" in called("verify", "r.json", "--method", method)


def test_timers_on_one_clock_know_what_the_steps_add(changed: Path, called: Callable[..., str]) -> None:
    """Data of a are there 4 + 2 ms after its release: b reads them then and ends 4 + 1 ms later, 11 ms in all."""
    text = """
dse: 1
name: clock
offset_grid: 1 ms
processors: {p: {type: cpu}}
processor_types: {cpu: {}}
threads:
  a: {processor: p, period: 20 ms, offset: 0 ms, compute_execution_time: 1 ms .. 4 ms, release_jitter: 2 ms}
  b: {processor: p, period: 20 ms, offset: any, compute_execution_time: 1 ms .. 4 ms, release_jitter: [1 ms, 3 ms]}
connections: {ab: {from: a, to: b}}
flows: {f: {path: [a, b]}}
objectives: [minimise latency of f]
processing: execution_time
"""
    (changed / "clock.yaml").write_text(text, encoding="utf-8")
    called("solve", "clock.yaml", "-q", "--json", "c.json")
    (point,) = json.loads((changed / "c.json").read_text(encoding="utf-8"))["front"]
    assert (point["objectives"], point["decisions"]["b.offset"]) == ({"latency of f": 11_000_000}, "6 ms")
    assert "VERIFIED" in called("verify", "c.json", "--method", "model")


LINK = """
dse: 1
name: link
bus_types: {wire: {arbitration: ARBITRATION, transmission_time: {fixed: 1 ms}, price: 2 EUR}}
buses: {w: {type: wire}}
processor_types: {cpu: {}}
processors: {p: {type: cpu}, q: {type: cpu}, r: {type: cpu}}
threads:
  a: {processor: p, period: [4 ms, 5 ms, 20 ms], compute_execution_time: 1 ms}
  b: {processor: p, period: [2 ms, 10 ms], compute_execution_time: 0 ms .. 1 ms}
  c: {processor: q, period: 20 ms, compute_execution_time: 1 ms .. 2 ms}
  d: {processor: r, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}
connections:
  ad: {from: a, to: d, bus: w, data_size: 8 B}
  bd: {from: b, to: d, bus: w, data_size: 8 B}
  cd: {from: c, to: d, bus: w, data_size: 8 B}
flows: {f: {path: [a, d]}, g: {path: [c, d]}}
requirements: [latency of g <= 40 ms]
objectives: [minimise latency of f, maximise utilisation of p]
processing: response_time
"""


def test_a_policy_of_its_own_counts_everywhere(changed: Path, called: Callable[..., str]) -> None:
    """A link sends as `fifo` does, which is another class: the fronts and response times of both are equal."""
    found = {}
    for name in ("link", "fifo"):
        (changed / f"{name}.yaml").write_text(LINK.replace("ARBITRATION", name), encoding="utf-8")
        called("solve", f"{name}.yaml", "-q", "--json", f"{name}.json")
        front = json.loads((changed / f"{name}.json").read_text(encoding="utf-8"))["front"]
        chosen = [f"--design={key}={value}" for key, value in front[-1]["decisions"].items()]
        (messages,) = json.loads(called("analyse", f"{name}.yaml", *chosen, "--json", "-"))["messages"].values()
        found[name] = [point["objectives"] for point in front], messages
        for method in ("exhaustion", "model"):
            assert "VERIFIED" in called("verify", f"{name}.json", "--method", method)
    assert found["link"] == found["fifo"] and len(found["link"][0]) > 1
    assert [item["interference"] for item in found["link"][1]].count([]) == 0
    said = called("analyse", "link.yaml", "--design=a.period=4ms", "--design=b.period=2ms", "--all")
    assert "as they come on a link" in " ".join(said.split())


def test_a_metric_of_its_own_and_another_arrival_work_everywhere(changed: Path, called: Callable[..., str]) -> None:
    """Threads b and c share a core; c has 50 or 25 inputs a second, and 10 jobs of its timer where it is timed."""
    timed = "  c: {processor: p, dispatch_protocol: [timed, aperiodic], period: 100 ms, compute_execution_time: 1 ms}\n"
    text = PROBLEM.replace("connections: {ab:", f"{timed}connections: {{bc: {{from: b, to: c}}, ab:")
    text = (
        text[: text.index("requirements:")] + "requirements: [rate of c >= 30 Hz]\nobjectives: [minimise rate of c]\n"
    )
    (changed / "timed.yaml").write_text(text, encoding="utf-8")
    called("solve", "timed.yaml", "-q", "--json", "t.json")
    data = json.loads((changed / "t.json").read_text(encoding="utf-8"))
    assert [(point["objectives"], point["decisions"]["c.dispatch_protocol"]) for point in data["front"]] == [
        ({"rate of c": 35}, "timed")
    ]
    for method in ("exhaustion", "model"):
        assert "VERIFIED" in called("verify", "t.json", "--method", method)
    said = called("sweep", "timed.yaml", "--vary", "rate of c=10Hz..60Hz", "--minimise", "price", "--no-store")
    assert "35 Hz" in said
    design = ["p.type=cpu", "b.period=40ms", "b.release_jitter=3ms", "c.dispatch_protocol=timed"]
    chosen = [part for text in design for part in ("--design", text)]
    called("analyse", "timed.yaml", "--response-times", *chosen, "--json", "b.json")
    data = json.loads((changed / "b.json").read_text(encoding="utf-8"))
    assert data["metrics"]["utilisation of p"]["value"] == 400_000 + 100_000 + 35_000


def test_the_field_that_the_steps_add_is_written_and_in_the_schema(changed: Path, called: Callable[..., str]) -> None:
    called("solve", "toy.yaml", "-q", "--json", "s.json")
    called("verify", "s.json", "--json", "v.json")
    data = json.loads((changed / "v.json").read_text(encoding="utf-8"))
    assert data["is_plain"] is (data["remarks"] == [])
    schema = json.loads(called("schema", "--of", "verification"))
    assert schema["properties"]["is_plain"]["description"] == "Whether there is nothing to remark."


def test_what_the_steps_add_is_analysed_swept_and_in_the_schema(changed: Path, called: Callable[..., str]) -> None:
    design = [part for text in ("p.type=cpu", "b.period=40ms", "b.release_jitter=3ms") for part in ("--design", text)]
    called("analyse", "toy.yaml", *design, "--json", "a.json", code=4)
    data = json.loads((changed / "a.json").read_text(encoding="utf-8"))
    assert data["metrics"]["output age of f"] == {"value": 91_000_000, "unit": "ns"} and not data["feasible"]
    assert [row["max_ns"] for row in data["flows"]["f"]["rows"] if row["max_method"] == "released late"] == [3_000_000]
    said = called("sweep", "toy.yaml", "--vary", "output age of f=40ms..60ms", "--no-store")
    assert "No design below 45 ms" in said
    swept = called("sweep", "toy.yaml", "--vary", "threads.b.release_jitter[0]=1ms,2ms", "--no-store", "--workers", "1")
    assert "46 ms" in swept
    fields = json.loads(called("schema"))["$defs"]["Thread"]["properties"]
    assert "release_jitter" in fields


def test_every_limited_metric_has_a_keyword() -> None:
    limits = {name.removeprefix("max_") for name in Question.__annotations__ if name.startswith("max_")}
    assert limits == set(LIMITED)
    pump = dse.load(
        (ROOT / "tests" / "fuzz" / "pump.yaml").read_text(encoding="utf-8") + "baseline: {control: {period: 5 ms}}\n"
    )
    for name, item in LIMITED.items():
        asked = pump.ask(**{f"max_{name}": item.example})
        assert any(name in requirement.text for requirement in asked.space.requirements[3:])


def test_the_importer_of_the_document_works(changed: Path, called: Callable[..., str]) -> None:
    (changed / "pumps.timers").write_text("one,10,2\ntwo,20,3\n", encoding="utf-8")
    called("import", "pumps.timers", "--name", "Pumps", "-o", "pumps.yaml")
    assert "name: Pumps" in (changed / "pumps.yaml").read_text(encoding="utf-8")
    assert "single design" in called("check", "pumps.timers")
    assert "two" in (changed / "pumps.yaml").read_text(encoding="utf-8")
    (changed / "bad.timers").write_text("one,10,2\ntwo\n", encoding="utf-8")
    called("analyse", "bad.timers", code=3)
    (changed / "bad.timers").write_text("one,x,2\n", encoding="utf-8")
    called("analyse", "bad.timers", code=3)
