"""Loading: values, includes, places of later diagnostics, and the way back to text."""

from __future__ import annotations

import hashlib
import json
from fractions import Fraction
from pathlib import Path

import pytest
import yaml

from dse.spec.loading.load import load_spec, parse_spec
from dse.spec.loading.reader import dotted
from dse.spec.schema.hardware import TransmissionTime
from dse.spec.schema.model import Spec
from dse.support.errors import ProblemError
from dse.support.units import Money, TimeRange, Total

FOLDER = Path(__file__).parents[1] / "bad_inputs"
VALID = (FOLDER / "valid.yaml").read_text(encoding="utf-8")

FULL = """\
dse: 1
name: everything
source: a report
description: |
  two
  lines
assumptions: [prices are ours]
profile: osate-2.2
worst_case: deadline
system: synchronous
partition_output: partition_end
best_case: full_queue
bus_queuing: not_counted
processing: response_time
deadlines: all
overload: allowed
offset_grid: 1 ms
ros2: {source: launch files}
messages: {distribution: ros2_humble}
clocks: {robot: {synchronisation_error: 10 us}}
priorities: rate_monotonic
partitions: {flight: {period: 20 ms, offset: 5 ms, duration: 10 ms}}
memories: {main: {ram: 1 MB}}
budgets: {lot: {speed: 40 MIPS, processor: computer}, nav: {within: lot, instructions: 250 KIPD, ram: 64 KB}}
totals: {mass: g}
processor_types:
  RT101: {cores: [4, 8], price: 150 EUR, power: 5 W, totals: {mass: [90 g, 95.5 g]}, source: Table 5.1}
bus_types:
  can: {bandwidth: 125 kbit/s, overhead: 8 B, latency: 1 us .. 1084 us, transmission_time: {per_byte: 64 us .. 88 us}}
  ros_ipc:
    virtual: true
    latency: {RT101: 5 us}
    transmission_time: {RT101: {fixed: 529 us .. 1115 us, per_byte: 87 ns .. 95 ns}}
device_types:
  mojo3: {period: 50 ms, latency: 1 .. 3 ms, price: 4000 EUR, category: device}
thread_types:
  provider: {compute_execution_time: {RT101: [243 us .. 1.3 ms, 1 ms]}, callback_execution_time: 1 us}
processors: {computer: {type: RT101, optional: true}}
buses: {bus: {type: can}, middle: {type: ros_ipc, bus: [bus]}}
packing: {bus: stated}
devices: {gnss: {type: mojo3, queue_size: 3, deadline: 5 ms, response_time: 1 ms, dispatch_protocol: periodic}}
threads:
  nav:
    {type: [provider], processor: computer, process: p, priority: [5, 0], core: 1, period: [10 ms, 0.02 s],
     dispatch_trigger: [position]}
  steer: {executor: node, period: 10 ms, non_preemptive: 1 us}
  log: {reservation: rest, period: 10 ms}
executors: {node: {kind: fifo, processor: computer, core: [1, 2], priority: 3}}
reservations: {rest: {processor: computer, budget: [1 ms, 2 ms], period: 5 ms, priority: 2, core: 1}}
connections:
  position: {from: gnss, to: nav, data_size: 30 B, bus: middle, rate: 50/3 Hz, port: data, queue_size: 0}
  inflow: {to: nav, data_rate: 3 kbit/s, latency: 1 ms, source: x}
flows: {main: {path: [gnss, position, nav], latency: 0 .. 10 ms, source: x}}
metrics: {line: jitter of main * 0.6 m/s}
requirements: [jitter of main <= 5 ms]
rules: [forbid RT101, {require: can}]
objectives: [minimise price]
baseline: {nav: {period: 10 ms}, computer: {cores: 4}}
cost_of_change: {nav: {period: 3}}
uncertainty:
  bus_types.can.bandwidth:
    {distribution: normal, mean: 120 kbit/s, deviation: 2 kbit/s, range: 100 .. 140 kbit/s, source: x}
  threads.nav.deadline: {factor: 0.8 .. 1.2, mode: 1}
  connections.position.data_size: {samples: sizes.csv, column: bytes, unit: B}
"""


def test_values() -> None:
    spec = parse_spec(FULL).spec
    assert spec.processor_types["RT101"].cores == (4, 8)
    assert spec.processor_types["RT101"].price == (Money(15000, "EUR"),)
    assert spec.processor_types["RT101"].totals == {"mass": (Total(Fraction(90), "g"), Total(Fraction(191, 2), "g"))}
    transmission = spec.bus_types["can"].transmission_time
    assert isinstance(transmission, TransmissionTime)
    assert (transmission.fixed, transmission.per_byte) == ((TimeRange(0, 0),), (TimeRange(64_000, 88_000),))
    assert spec.bus_types["can"].latency == (TimeRange(1000, 1_084_000),)
    assert spec.bus_types["ros_ipc"].latency == {"RT101": (TimeRange(5000, 5000),)}
    times = spec.thread_types["provider"].compute_execution_time
    assert times == {"RT101": (TimeRange(243_000, 1_300_000), TimeRange(1_000_000, 1_000_000))}
    assert spec.threads["nav"].period == (10_000_000, 20_000_000)
    assert spec.threads["nav"].dispatch_trigger == ("position",)
    assert spec.connections["position"].rate == (Fraction(50, 3),)
    assert spec.connections["position"].from_ == "gnss"
    assert spec.connections["inflow"].data_rate == (Fraction(375),)
    assert spec.flows["main"].latency == TimeRange(0, 10_000_000)
    assert spec.rules == ("forbid RT101", "require can")
    assert spec.baseline == {"nav": {"period": "10 ms"}, "computer": {"cores": 4}}
    assert spec.cost_of_change == {"nav": {"period": 3}}


def test_every_field_is_used_in_the_example() -> None:
    spec = parse_spec(FULL).spec
    assert spec.model_fields_set == set(Spec.model_fields) - {
        "include",
        "of",
        "root",
        "mode",
        "library",
        "imported",
        "unread",
    }


@pytest.mark.parametrize("text", [FULL, VALID])
def test_load_dump_load_is_the_identity(text: str) -> None:
    spec = parse_spec(text).spec
    dumped = json.loads(spec.model_dump_json(by_alias=True, exclude_defaults=True))
    assert parse_spec(yaml.safe_dump(dumped)).spec == spec


def test_order_of_names_is_that_of_the_file() -> None:
    assert list(parse_spec(VALID).spec.processor_types) == ["RT101", "Spectra"]


def test_order_of_keys_changes_nothing() -> None:
    data = yaml.safe_load(VALID)
    assert parse_spec(yaml.safe_dump(data, sort_keys=True)).spec == parse_spec(VALID).spec


def test_includes_are_merged_with_their_hashes(tmp_path: Path) -> None:
    (tmp_path / "lib" / "more").mkdir(parents=True)
    (tmp_path / "main.yaml").write_text(VALID + "include: [lib/a.yaml, lib/more/b.yaml]\nassumptions: [one]\n")
    (tmp_path / "lib" / "a.yaml").write_text("include: more/b.yaml\nprocessor_types: {A: {cores: 1}}\n")
    (tmp_path / "lib" / "more" / "b.yaml").write_text("assumptions: [two]\nprocessor_types: {B: {cores: 2}}\n")
    loaded = load_spec(tmp_path / "main.yaml")
    assert list(loaded.spec.processor_types) == ["RT101", "Spectra", "A", "B"]
    assert loaded.spec.assumptions == ("one", "two")
    assert loaded.sha256 == hashlib.sha256((tmp_path / "main.yaml").read_bytes()).hexdigest()
    assert [name for name, _ in loaded.includes] == ["lib/a.yaml", "lib/more/b.yaml"]
    assert loaded.includes[1][1] == hashlib.sha256((tmp_path / "lib/more/b.yaml").read_bytes()).hexdigest()
    place = loaded.diagnostic(("processor_types", "B", "cores"), "too many")
    assert str(place) == f"{tmp_path}/lib/more/b.yaml:2:30: processor_types.B.cores: too many"


def test_errors_of_all_files_come_together_main_first(tmp_path: Path) -> None:
    (tmp_path / "main.yaml").write_text("dse: 1\nname: x\ninclude: [b.yaml, a.yaml]\nzzz: 1\n")
    (tmp_path / "a.yaml").write_text("processor_types: {A: {cores: 0}}\n")
    (tmp_path / "b.yaml").write_text("x: [\n")
    with pytest.raises(ProblemError) as caught:
        load_spec(tmp_path / "main.yaml")
    assert [Path(item.file).name for item in caught.value.diagnostics] == ["main.yaml", "b.yaml", "a.yaml"]


def test_later_diagnostics_point_into_the_file() -> None:
    loaded = parse_spec(VALID, "two.yaml")
    found = loaded.diagnostic(("requirements", 0), "no flow", 'did you mean "b"?', "warning")
    assert str(found) == 'two.yaml:25:16: requirements[0]: warning: no flow (did you mean "b"?)'
    assert str(loaded.diagnostic(("threads", "nav"), "bad", at_key=True)) == "two.yaml:15:3: threads.nav: bad"
    assert str(loaded.diagnostic((), "bad")) == "two.yaml:1:1: bad"
    assert dotted(("flows", "f", "path", 2)) == "flows.f.path[2]"


def test_text_cannot_include_files() -> None:
    with pytest.raises(ProblemError, match="a text cannot include files"):
        parse_spec(VALID + "include: a.yaml\n")


def test_names_that_look_like_labels_of_the_schema() -> None:
    text = "dse: 1\nname: x\nbus_types: {b: {latency: {one: 1 ms, by processor type: 2}}}\n"
    with pytest.raises(ProblemError) as caught:
        parse_spec(text)
    assert [item.path for item in caught.value.diagnostics] == ["bus_types.b.latency.by processor type"]


def test_include_of_an_impossible_path(tmp_path: Path) -> None:
    path = tmp_path / "main.yaml"
    path.write_text('dse: 1\nname: x\ndescription: 5\ninclude: ["a\\0b", 7]\n')
    with pytest.raises(ProblemError) as caught:
        load_spec(path)
    assert [(item.line, item.message.split(":")[0]) for item in caught.value.diagnostics] == [
        (3, "expected text, got 5"),
        (4, "expected text without line breaks, tabs or control characters"),
        (4, "no such file"),
        (4, "expected text, got 7"),
    ]


def test_number_of_files_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dse.spec.loading.load.MAX_FILES", 2)
    (tmp_path / "main.yaml").write_text("dse: 1\nname: x\ninclude: [a.yaml, b.yaml]\n")
    for name in "ab":
        (tmp_path / f"{name}.yaml").write_text("assumptions: []\n")
    with pytest.raises(ProblemError, match=r"3:19: include\[1\]: more than 2 files"):
        load_spec(tmp_path / "main.yaml")
