"""Everything that the loader takes is documented, everything documented is taken, and the JSON Schema says the same."""

from __future__ import annotations

import pickle
import re
from functools import cache
from pathlib import Path
from typing import Any, get_args

import jsonschema
import pytest
import yaml

from dse.spec.loading.load import load_spec
from dse.spec.schema import model
from dse.spec.schema.json_schema import json_schema
from dse.support.errors import ProblemError

DOCUMENT = (Path(__file__).parents[2] / "docs" / "problem-file.md").read_text(encoding="utf-8")
VALIDATOR = jsonschema.Draft202012Validator(json_schema())
EVERY_FIELD = """
dse: 1
name: everything
source: a book
description: several lines
assumptions: [none so far]
include: [parts.yaml]
profile: dse
ros2: {nodes: {f: /f}, parameters: {f.period: a}, callback_groups: {f: "/f@Timer({f})"}, source: s}
imported: {from: robot.aadl, root: "robots::robot.impl", mode: cruise, library: [../lib]}
unread: {f: {reason: it leads nowhere, latency: 0 ms .. 5 ms, source: "robot.aadl:3"}}
processing: execution_time
deadlines: stated
overload: forbidden
offset_grid: 1 ms
packing: {x: any}
messages: {distribution: ros2_humble, definitions: parts, size: serialised, source: s}
priorities: rate_monotonic
worst_case: deadline
system: synchronous
partition_output: partition_end
best_case: full_queue
bus_queuing: not_counted
cost_of_change: {p: {type: 2}}
totals: {mass: g}
processor_types:
  c: {cores: 2, priority_levels: 2, serves: fifo, transmit_queue: fifo, speed: 1 MIPS, price: 1 EUR, power: 1 W,
      totals: {mass: 1 kg},
      source: s,
      context_switch: 1 us,
      interrupts: {i: {compute_execution_time: 1 us, period: 1 ms, source: s}},
      throttling: {budget: 950 ms, period: 1 s, source: s}}
bus_types:
  b: {bandwidth: 1 Mbit/s, transmission_time: {fixed: 1 us, per_byte: 1 ns, sizes: 1 B .. 1 KB}, latency: 1 ms,
      overhead: 1 B, protocols: [v], broadcast: true, arbitration: fifo,
      virtual: false, exclusive: true, period: 1 ms, price: 1 EUR, power: 1 W, totals: {mass: 1 g},
      source: s}
  v: {virtual: true, transmission_time: from bandwidth, bandwidth: 1 Mbit/s}
  w: {bandwidth: 1 Mbit/s, frame: can, fault_interval: 1 s, fault_burst: 2}
device_types:
  d: {period: 1 ms, category: device, dispatch_protocol: periodic, compute_execution_time: 1 us, latency: 1 us,
      deadline: 1 ms, response_time: 1 us, queue_size: 1, price: 1 EUR, power: 1 W, totals: {mass: 1 g}, source: s,
      offset: 1 ms, transmit_queue: fifo}
thread_types:
  t: {period: 1 ms, category: thread, dispatch_protocol: periodic, compute_execution_time: 1 us,
      callback_execution_time: 1 us, latency: 1 us, deadline: 1 ms, response_time: 1 us, queue_size: 1, price: 1 EUR,
      power: 1 W, totals: {mass: 1 g}, source: s, offset: 1 ms, communication: let,
      non_preemptive: 1 us, transmit_queue: fifo}
clocks: {k: {synchronisation_error: 1 us, source: s}}
partitions: {o: {period: 1 ms, offset: 1 us, duration: 1 us, speed: 1 MIPS, source: s}}
memories: {mm: {size: 1 B, ram: 1 B, rom: 1 B, source: s}}
budgets:
  bu: {speed: 1 MIPS, processor: p, partition: o, memory: mm}
  f: {within: bu, instructions: 1 IPD, ram: 1 B, rom: 1 B, ram_used: 1 B, rom_used: 1 B, source: s}
processors: {p: {type: c, optional: true, overload: allowed, clock: k, source: s}}
buses: {x: {type: b, optional: true, overload: allowed, source: s}, y: {type: v, bus: x, further_buses: [z]},
        z: {type: b, budget: 1 B/s, assignment: robust}}
devices:
  e: {type: d, period: 1 ms, category: device, dispatch_protocol: periodic, compute_execution_time: 1 us, latency: 1 us,
      deadline: 1 ms, response_time: 1 us, queue_size: 1, price: 1 EUR, power: 1 W, totals: {mass: 1 g}, source: s,
      clock: k, offset: 1 ms, partition: o, transmit_queue: fifo}
threads:
  f: {type: t, processor: p, figures_of: p, partition: o, process: q, priority: 1, core: 1, period: 1 ms,
      category: thread,
      dispatch_protocol: periodic, dispatch_trigger: [w], compute_execution_time: 1 us, callback_execution_time: 1 us,
      latency: 1 us, deadline: 1 ms, response_time: 1 us, queue_size: 1, price: 1 EUR, power: 1 W, totals: {mass: 1 g},
      source: s, offset: 1 ms, communication: let, non_preemptive: 1 us, join: all, pairing: latest,
      transmit_queue: fifo,
      parameters: {u: {value: 1 m}}}
  h: {executor: n, period: 1 ms, segments: [{compute_execution_time: 1 us, processor: p, source: s}]}
  i: {reservation: l, period: 1 ms, compute_execution_time: 1 us}
executors: {n: {kind: fifo, processor: p, priority: 1, core: 1, reservation: l, source: s}}
reservations: {l: {processor: p, budget: 1 us, period: 1 ms, priority: 1, core: 1, source: s}}
connections:
  w: {from: e, to: f, data_size: 1 B, type_size: 2 B, bus: x, rate: 1 Hz, data_rate: 1 B/s, port: data, timing: delayed,
      queue_size: 1, further_buses: [z], protocols: [v], from_port: o, budget: 1 B/s, latency: 1 us, identifier: 1,
      priority: 1, carried_in: x, deadline: 1 s, source: s}
  x: {from: e, to: f, message: parts/Pose, lengths: {id: 1}, reply: {data_size: 1 B}}
flows:
  g: {path: [{element: e, latency: 1 us, compute_execution_time: 1 us, response_time: 1 us}, f], latency: 1 us .. 1 s,
      source: s}
metrics: {m: latency of g * 2}
requirements: [price <= 1 EUR]
rules: [c requires b]
objectives: [minimise price]
baseline: {p: {type: c}}
uncertainty:
  threads.f.period: {range: 1 ms .. 2 ms, factor: 1 .. 2, distribution: normal, mean: 1 ms, deviation: 1 ms, mode: 1 ms,
                     samples: [1 ms], column: c, unit: ms, source: s}
"""
CLASSES = {
    "processor_types": "ProcessorType", "bus_types": "BusType", "device_types": "DeviceType",
    "thread_types": "ThreadType", "clocks": "Clock", "processors": "Processor", "buses": "Bus", "devices": "Device",
    "threads": "Thread", "executors": "Executor", "reservations": "Reservation", "connections": "Connection",
    "flows": "Flow", "uncertainty": "Uncertainty", "memories": "Memory", "budgets": "ResourceBudget",
}  # fmt: skip
HEADINGS = {
    "processor_types": ["Processor types"],
    "bus_types": ["Bus types"],
    "device_types": ["Devices"],
    "thread_types": ["Threads", "Devices"],
    "clocks": ["Clocks and offsets"],
    "processors": ["Processors"],
    "buses": ["Buses", "Processors"],
    "devices": ["Devices"],
    "threads": ["Threads", "Devices"],
    "executors": ["Executors"],
    "reservations": ["Reservations"],
    "connections": ["Connections"],
    "flows": ["Flows"],
    "memories": ["Resource budgets"],
    "budgets": ["Resource budgets"],
    "uncertainty": ["Uncertainty"],
}
"""Where the keys of each section are explained; of several tables the first that has a key."""
OF_A_MODEL = {"of", "root", "mode", "library"}
"""Keys that name a model: tests/importers has files with them."""
WORDS = frozenset(
    {
        "changes", "contention", "core_by", "cpu_affinity", "g", "kg", "kB", "load", "osate", "pthread_setaffinity_np",
        "rounded", "taskset", "of", "jitter", "busy", "utilisation", "and", "or", "not", "implies", "requires",
        "require", "disparity",
        "forbid", "true", "false", "none", "any", "first_fit", "big", "little", "rate_monotonic",
        "deadline_monotonic", "all", "execution_time", "ppm",
        "let", "unknown", "implicit", "ros", "int", "fps", "detect", "alone",
    }
)  # fmt: skip
"""Words in code spans of the document that are no fields: metrics, rules, units, values, and what is not ours."""


def fields_of(name: str) -> set[str]:
    return {info.alias or field for field, info in getattr(model, name).model_fields.items()}


def data_of(text: str) -> dict[str, Any]:
    found: dict[str, Any] = pickle.loads(_read(text))
    return found


@cache
def _read(text: str) -> bytes:
    """To be copied from: to read it takes longer than all that is done with it."""
    return pickle.dumps(yaml.safe_load(text))


def places() -> list[tuple[str, ...]]:
    """Every field of every section, the parts of a transmission time, and the top level."""
    data = data_of(EVERY_FIELD)
    found: list[tuple[str, ...]] = [(key,) for key in data if key not in CLASSES]
    for section in CLASSES:
        for name, entry in data[section].items():
            found += [(section, name, field) for field in entry]
    return [*found, *(("bus_types", "b", "transmission_time", part) for part in ("fixed", "per_byte", "sizes"))]


def taken(data: dict[str, Any], folder: Path) -> bool:
    (folder / "parts.yaml").write_text("description: nothing\n", encoding="utf-8")
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "Pose.msg").write_text("string id\n", encoding="utf-8")
    (folder / "p.yaml").write_text(yaml.dump(data, Dumper=yaml.CSafeDumper), encoding="utf-8")
    try:
        load_spec(folder / "p.yaml")
    except ProblemError:
        return False
    return True


def test_the_file_states_every_field_and_is_taken(tmp_path: Path) -> None:
    data = data_of(EVERY_FIELD)
    assert set(data) == fields_of("Spec") - OF_A_MODEL
    for section, name in CLASSES.items():
        assert {field for entry in data[section].values() for field in entry} == fields_of(name), section
    assert taken(data, tmp_path) and VALIDATOR.is_valid(data)


@cache
def keys_under(heading: str) -> dict[str, str]:
    """The keys that the tables under a heading explain, each with what a list means: options, all, or no."""
    begin = re.search(rf"^#+ {heading}$", DOCUMENT, re.M)
    assert begin is not None, heading
    end = re.search(r"^#+ ", DOCUMENT[begin.end() :], re.M)
    text = DOCUMENT[begin.end() : begin.end() + end.start() if end else None]
    found: dict[str, str] = {}
    columns: list[str] = []
    for line in (line for line in text.splitlines() if line.startswith("| ")):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if "key" in cells[0]:
            columns = cells
            continue
        place = columns.index("list") if "list" in columns else None
        said = cells[place] if place is not None and place < len(cells) else "no"
        for key in re.findall(r"`(\w+)`", cells[0]):
            found.setdefault(key, keys_under("Processor types")[key] if said == "as above" else said)
    return found


def of_section(section: str) -> dict[str, str]:
    """The keys of a section, as its tables explain them."""
    found: dict[str, str] = {}
    for heading in HEADINGS[section]:
        found = {**keys_under(heading), **found}
    return found


@pytest.mark.parametrize("place", places(), ids=".".join)
def test_a_list_is_taken_where_the_document_says(place: tuple[str, ...], tmp_path: Path) -> None:
    """By the loader and by the schema alike."""
    keys = keys_under("Top level") if len(place) == 1 else of_section(place[0])
    said = keys[place[-1]]
    assert said in ("options", "all", "no")
    listed = data_of(EVERY_FIELD)
    part = listed
    for key in place[:-1]:
        part = part[key]
    last = place[-1]
    part[last] = part[last] if isinstance(part[last], list) else [part[last]]
    offers = said != "no" and last != "totals"  # whose entries are lists
    assert taken(listed, tmp_path) is offers, "loader"
    assert VALIDATOR.is_valid(listed) is offers, "schema"


def test_alternatives_of_a_total_and_of_a_processor_type(tmp_path: Path) -> None:
    data = data_of(EVERY_FIELD)
    data["threads"]["f"]["totals"] = {"mass": ["1 g", "2 g"]}
    data["threads"]["f"]["compute_execution_time"] = {"c": ["1 us", "2 us"]}
    assert taken(data, tmp_path) and VALIDATOR.is_valid(data)


@pytest.mark.parametrize("section", HEADINGS)
def test_every_field_is_documented_where_its_section_is(section: str) -> None:
    assert fields_of(CLASSES[section]) - {"source"} - of_section(section).keys() == set()


def test_every_key_of_the_top_level_is_documented() -> None:
    assert fields_of("Spec") == keys_under("Top level").keys()


def test_the_keys_that_types_of_threads_leave_out_are_marked() -> None:
    rows = re.findall(r"^\| `(\w+)` †", DOCUMENT, re.M)
    assert fields_of("Thread") - fields_of("ThreadType") - {"processor"} == set(rows) - {"processor"}


def test_every_key_that_is_documented_is_taken() -> None:
    parts = ("Interrupt", "Throttling", "Segment", "Partition", "Messages", "Ros2", "UnreadFlow", "Reply", "Parameter")
    frames = ("CanFrame", "CanFdFrame", "SerialFrame", "EthernetFrame", "EthercatFrame", "FlexrayFrame")
    known = set().union(*(fields_of(name) for name in (*CLASSES.values(), *frames, "Spec", "TransmissionTime", *parts)))
    for name in (*CLASSES.values(), *frames, *parts, "Spec"):
        for info in getattr(model, name).model_fields.values():
            known |= set(re.findall(r"'([\w-]+)'", str(info.annotation)))
    known |= {word for kind in (model.Category, model.Protocol, model.Port) for word in _words(kind)}
    told = set(re.findall(r"`([a-z]\w*)`", DOCUMENT))
    assert told - known - WORDS == set()
    assert not WORDS & fields_of("Thread")


def _words(kind: Any) -> set[str]:
    found = {item for item in get_args(kind) if isinstance(item, str)}
    for item in get_args(kind):
        found |= _words(item) if not isinstance(item, str) else set()
    return found
