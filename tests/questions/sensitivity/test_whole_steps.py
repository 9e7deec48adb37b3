"""Cores, places in a queue, bytes: what is counted moves in whole steps, also where response times matter."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.questions.sensitivity.sensitivity import sensitivity

COUNTS = """
dse: 1
name: Counts
overload: allowed
processing: response_time
processor_types: {p: {cores: 2, price: 60 EUR}}
processors: {c: {type: p}}
devices:
  s: {period: 20 ms, compute_execution_time: 100 us .. 200 us}
  v: {period: 1 ms}
threads:
  a: {processor: c, period: 5 ms, compute_execution_time: 1 ms .. 2 ms}
  b: {processor: c, period: 7 ms, compute_execution_time: 1 ms .. 3 ms, queue_size: 2}
  d: {processor: c, period: 11 ms, compute_execution_time: 1 ms .. 3 ms}
connections:
  r: {from: s, to: a, data_size: 12 B}
  t: {from: a, to: b}
  u: {from: b, to: d}
  w: {from: d, to: v}
flows: {f: {path: [s, a, b, d, v]}}
requirements: [latency of f <= 80 ms]
objectives: [minimise latency of f]
"""


def written(tmp_path: Path, uncertainty: str = "") -> Path:
    path = tmp_path / "counts.yaml"
    path.write_text(f"{COUNTS}uncertainty: {uncertainty}\n" if uncertainty else COUNTS, encoding="utf-8")
    return path


def test_cores_move_by_one_core(tmp_path: Path) -> None:
    result = sensitivity(written(tmp_path))
    bars = {bar.path: bar for bar in result.bars}
    assert bars["processor_types.p.cores"].inputs == (1, 3)
    assert result.margins
    assert all(end.denominator == 1 for bar in result.bars for end in bar.inputs)


def test_a_share_of_few_bytes_is_whole_bytes(tmp_path: Path) -> None:
    text = COUNTS.replace("requirements: [", "requirements: [load of x <= 1 KB/s, ")
    text = text.replace("r: {", "r: {bus: x, ") + "bus_types: {n: {bandwidth: 1 Mbit/s}}\nbuses: {x: {type: n}}\n"
    path = tmp_path / "sizes.yaml"
    path.write_text(text, encoding="utf-8")
    bars = [bar for bar in sensitivity(path, front=False).bars if bar.path == "connections.r.data_size"]
    assert [(bar.inputs, bar.values) for bar in bars] == [((11, 13), (11 * 50, 13 * 50))]


@pytest.mark.parametrize(
    ("entry", "ends"),
    [
        ("{factor: 0.9 .. 1.1}", (11, 13)),  # 10.8 B .. 13.2 B
        ("{factor: 0.84 .. 1.3}", (11, 15)),  # 10.08 B .. 15.6 B: 10 B is not in it
        ("{factor: 1.01 .. 1.02}", (12, 12)),
        ("{range: 10 B .. 14 B}", (10, 14)),
    ],
)
def test_a_stated_factor_on_few_bytes_is_whole_bytes_within_it(
    entry: str, ends: tuple[int, int], tmp_path: Path
) -> None:
    text = COUNTS.replace("requirements: [", "requirements: [load of x <= 1 KB/s, ")
    text = text.replace("r: {", "r: {bus: x, ") + "bus_types: {n: {bandwidth: 1 Mbit/s}}\nbuses: {x: {type: n}}\n"
    path = tmp_path / "sizes.yaml"
    path.write_text(f"{text}uncertainty: {{connections.r.data_size: {entry}}}\n", encoding="utf-8")
    bars = [bar for bar in sensitivity(path, front=False).bars if bar.path == "connections.r.data_size"]
    assert [(bar.inputs, bar.values) for bar in bars] == [(ends, (ends[0] * 50, ends[1] * 50))] * (ends[0] < ends[1])


@pytest.mark.parametrize(
    "uncertainty",
    [
        "{processor_types.p: {factor: 0.6 .. 1.4}}",
        '{processor_types.p.cores: {samples: ["1", "2", "3"]}}',
        "{processor_types.p.cores: {distribution: normal, mean: 2, deviation: 1}}",
        "{threads.b.queue_size: {factor: 0.5 .. 1.5}, processor_types.p.cores: {factor: 0.6 .. 1.4}}",
    ],
)
def test_uncertain_counts_are_whole(uncertainty: str, tmp_path: Path) -> None:
    path = written(tmp_path, uncertainty)
    assert run(["sensitivity", str(path), "--samples", "60"]) == 0
    assert run(["solve", str(path), "--robust"]) in (0, 4)


def test_each_count_is_as_likely_as_its_samples(tmp_path: Path) -> None:
    """With one core the latency is out of bounds, with two or three it is not."""
    path = written(tmp_path, '{processor_types.p.cores: {samples: ["1", "2", "3", "3"]}}')
    found = sensitivity(path, samples=4000, front=False).uncertain
    assert found is not None
    assert abs(found.design_chance.all_met - 0.75) < 0.03
    one, three = (dse.analyse(dse.loads(COUNTS.replace("cores: 2", f"cores: {count}"))).is_feasible for count in (1, 3))
    assert (one, three) == (False, True)


def test_one_uncertain_input_and_one_output(tmp_path: Path) -> None:
    """SciPy makes a number of such indices, and breaks on it."""
    path = written(tmp_path, "{threads.d.compute_execution_time.max: {range: 2 ms .. 4 ms}}")
    found = sensitivity(path, samples=300, front=False).uncertain
    assert found is not None
    (only,) = found.indices
    assert only.first == pytest.approx({"threads.d.compute_execution_time.max": 1.0}, abs=1e-6)
    assert only.total == pytest.approx({"threads.d.compute_execution_time.max": 1.0}, abs=1e-6)


def test_bars_of_zero_and_of_ends_of_ranges() -> None:
    result = sensitivity(dse.loads(COUNTS.replace("1 ms .. 2 ms", "0 ms .. 3 ns")), front=False)
    ends = {bar.path: bar.inputs for bar in result.bars}
    assert "threads.a.compute_execution_time.min" not in ends
    assert ends.get("threads.a.compute_execution_time.max") in (None, (Fraction(2), Fraction(4)))


@pytest.mark.parametrize(
    ("stated", "least", "told"), [("core: 3", "0.4", 3), ("core: [1, 2]", "0.4", 2), ("core: 1", "0.4", 0)]
)
def test_no_fewer_cores_than_a_thread_states(
    stated: str, least: str, told: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before, figures of a thread on core 3 of 1 were followed, and designs called robust for them."""
    path = written(tmp_path, f"{{processor_types.p: {{factor: {least} .. 1}}}}")
    text = path.read_text(encoding="utf-8").replace("cores: 2", "cores: 3")
    path.write_text(text.replace("a: {processor: c,", f"a: {{processor: c, {stated},"), encoding="utf-8")
    for command in (["sensitivity", "--samples", "20"], ["solve", "--robust", "-q"]):
        ended = run([command[0], str(path), *command[1:]])
        said = capsys.readouterr()
        if told:
            assert ended == 2
            assert f"goes down to 1 core, but a may run on core {told}: there is no such design" in said.err
        else:
            assert ended in (0, 4), said.err
