"""Messages that wait for their bus, in problems: latencies, deadlines of messages, and what is not counted."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import all_metrics, build_measure
from dse.analysis.scheduling import responses
from dse.analysis.scheduling.fixed_point import Solution, solve
from dse.analysis.scheduling.model import System
from dse.analysis.views import View
from dse.cli.main import run
from dse.report.words.basis import counting_words
from dse.report.words.contention import bus_words
from dse.support.errors import ProblemError

SYNC = """
dse: 1
name: SYNC beside one long frame
bus_types: {can_1m: {bandwidth: 1 Mbit/s, frame: can, exclusive: true}}
buses: {can0: {type: can_1m}}
devices: {master: {period: 1 ms}, drive: {}, other: {period: 5 ms}}
connections:
  sync: {from: master, to: drive, data_size: 0 B, bus: can0, identifier: 0x80}
  pdo: {from: other, to: drive, data_size: 8 B, bus: can0, port: data, identifier: 0x181}
flows:
  sync_flow: {path: [master, sync, drive]}
"""
"""After machinekit #589: a SYNC jitters by one 8 B frame that has just begun: 111 bits unstuffed, 135 stuffed."""
CAR = Path(__file__).parents[1] / "golden" / "car_bus.csv"


def car_bus(order: dict[int, int] | None = None) -> str:
    """The problem of the car's messages, each with a deadline of its cycle, by their own identifiers or by others."""
    rows = [line.split(",") for line in CAR.read_text(encoding="utf-8").splitlines()[3:]]
    lines = ["dse: 1", "name: car", "bus_types: {can: {bandwidth: 500 kbit/s, frame: can}}", "buses: {b: {type: can}}"]
    lines += ["devices:", "  sink: {}", *(f"  d{row[0]}: {{period: {row[4]} ms}}" for row in rows), "connections:"]
    for number, name, _, size, cycle in rows:
        own = int(number) if order is None else order[int(number)]
        ends = f"from: d{number}, to: sink, port: data"
        lines.append(f"  {name}: {{{ends}, data_size: {size} B, bus: b, identifier: {own}, deadline: {cycle} ms}}")
    return "\n".join(lines)


def metric(text: str, name: str) -> object:
    return dse.analyse(dse.loads(text)).metrics[name]


def test_a_frame_that_has_begun_is_jitter() -> None:
    """0.011 ms of the frame's own stuff bits, and 135 bits of the other one."""
    assert metric(SYNC, "jitter of sync_flow") == 11_000 + 135_000
    found = dse.analyse(dse.loads(SYNC))
    rows = [(row.max_ns, row.max_method) for row in found.flows[0].rows if row.category == "connection"]
    assert rows == [(55_000, "transmission time"), (135_000, "waiting for the bus")]
    sync, pdo = found.messages["can0"]
    assert (sync.blocked_by, sync.blocking_ns, sync.response_ns) == ("pdo", 135_000, 190_000)
    assert [(item.name, item.jobs) for item in pdo.interference] == [("sync", 1)]


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        ((", identifier: 0x181", ""), "Waiting for can0 (no `identifier` of pdo) is not counted."),
        (("data_size: 8 B", "data_rate: 8 B/s"), "needs"),
    ],
)
def test_what_is_missing_is_named_and_nothing_waits(edit: tuple[str, str], said: str) -> None:
    text = SYNC.replace(*edit)
    if said == "needs":
        text = text.replace("frame: can, exclusive: true", "transmission_time: {fixed: 1 us}, arbitration: priority")
        said = "Waiting for can0 (no `data_size` of pdo) is not counted."
    found = dse.analyse(dse.loads(text))
    assert not found.messages
    assert all(row.max_method != "waiting for the bus" for row in found.flows[0].rows)
    assert bus_words(found.space) == said


@pytest.mark.parametrize("processing", ["response_time", "execution_time"])
def test_deadlines_of_messages_alone_say_that_a_bus_is_not_counted_and_what_is_missing(
    processing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A deadline holds for a message that waits for nothing: without a flow, too, the answer says what is missing."""
    text = SYNC[: SYNC.index("flows:")].replace("identifier: 0x80", "identifier: 0x80, deadline: 100 us")
    text += f"processing: {processing}\n"
    assert counting_words(dse.loads(text).space).endswith("Waiting counted: buses.")
    path = tmp_path / "missing.yaml"
    path.write_text(text.replace(", identifier: 0x181", ""), encoding="utf-8")
    for command in (["check"], ["analyse"], ["solve", "--minimise", "price"]):
        assert run([*command, str(path)]) == 0
        assert "Waiting not counted: can0 (no `identifier` of pdo)." in capsys.readouterr().out


def test_a_bus_with_frames_of_can_and_no_identifiers_is_told_by_name() -> None:
    text = SYNC.replace(", identifier: 0x80", "").replace(", identifier: 0x181", "")
    assert metric(text, "jitter of sync_flow") == 11_000
    said = bus_words(dse.analyse(dse.loads(text)).space)
    assert said == "Waiting for can0 (no `identifier` of sync, pdo) is not counted."


def test_nothing_is_said_by_name_where_nothing_is_stated() -> None:
    text = SYNC.replace(", identifier: 0x80", "").replace(", identifier: 0x181", "").replace(", frame: can", "")
    said = bus_words(dse.analyse(dse.loads(text)).space)
    assert said == "Waiting for a bus is not in the latencies: each message counts as if alone on it."


def test_osate_knows_no_identifiers() -> None:
    found = dse.analyse(dse.loads(SYNC), profile="osate-2.19")
    assert not found.messages


def test_the_setting_lets_no_message_wait() -> None:
    assert metric(SYNC + "bus_queuing: not_counted\n", "jitter of sync_flow") == 11_000


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ([("0x181", "0x80")], '0x80 is the identifier of "sync" on the same bus'),
        ([("0x181", "0x800")], "0x800 is beyond identifiers of 11 bits"),
        ([("can_1m: {", "w: {virtual: true, arbitration: fifo}, can_1m: {")], "only a physical bus arbitrates"),
        ([("bus: can0, port: data, ", "")], "an identifier is that of a message on a `bus`"),
        ([("frame: can", "frame: serial, arbitration: priority")], "`priority` is that of identifiers"),
        ([("frame: can", "arbitration: fifo")], "needs a `frame` or a `transmission_time`"),
        ([("bandwidth: 1 Mbit/s, frame: can", "transmission_time: {fixed: 1 us}, arbitration: priority")], "bandwidth"),
    ],
)
def test_mistakes(edits: list[tuple[str, str]], message: str) -> None:
    text = SYNC
    for edit in edits:
        assert edit[0] in text
        text = text.replace(*edit)
    with pytest.raises(ProblemError, match=message):
        dse.loads(text)


def test_stated_transmission_times_by_identifier() -> None:
    """Listing 3.1 of the report: 256 us and 64 to 88 us for each byte at 125 kbit/s."""
    kind = "bandwidth: 125 kbit/s, transmission_time: {fixed: 256 us, per_byte: 64 us .. 88 us}, arbitration: priority"
    text = SYNC.replace("bandwidth: 1 Mbit/s, frame: can", kind)
    assert metric(text, "latency of sync_flow") == 256_000 + 256_000 + 8 * 88_000


@pytest.mark.parametrize(
    ("kind", "waits"), [("fifo", 135_000), ("round_robin", 135_000), ("none", 0), ("priority", 135_000)]
)
def test_kinds_of_arbitration(kind: str, waits: int) -> None:
    text = SYNC.replace("frame: can", f"frame: can, arbitration: {kind}")
    assert metric(text, "latency of sync_flow") == 55_000 + waits


def test_jitter_of_a_message_is_that_of_its_sender_and_goes_on_to_its_receiver() -> None:
    """The thread takes 1 to 3 ms: a second message may come 3 ms after the first, and so what it triggers."""
    text = """
dse: 1
name: chain
processing: response_time
processor_types: {c: {cores: 2}}
bus_types: {can: {bandwidth: 500 kbit/s, frame: can}}
processors: {p: {type: c}, q: {type: c}}
buses: {b: {type: can}}
devices: {sink: {}, talker: {period: 10 ms}}
threads:
  first: {processor: q, core: 1, period: 5 ms, compute_execution_time: 1 ms .. 3 ms}
  second: {processor: p, core: 2, dispatch_protocol: aperiodic, compute_execution_time: 2 ms}
  third: {processor: p, core: 2, period: 20 ms, compute_execution_time: 1 ms}
connections:
  a: {from: first, to: second, data_size: 8 B, bus: b, identifier: 2}
  z: {from: talker, to: sink, port: data, data_size: 8 B, bus: b, identifier: 1}
"""
    found = dse.analyse(dse.loads(text))
    rows = {item.name: item for item in found.messages["b"]}
    assert [stream.jitter_ns for stream in rows["a"].releases or ()] == [2_000_000]
    assert rows["a"].response_ns == 2 * 270_000
    threads = {item.name: item for item in found.responses["p"]}
    # best: 111 bits without the gap of 3
    assert [stream.jitter_ns for stream in threads["second"].task.streams] == [2_000_000 + 540_000 - 108 * 2000]
    assert threads["third"].response_ns == 1_000_000 + 2 * 2_000_000


def test_one_message_to_several_receivers_is_one() -> None:
    text = SYNC.replace("frame: can", "frame: can, broadcast: true").replace(
        "  pdo: {from: other,",
        "  copy: {from: other, from_port: o, to: master, port: data, data_size: 8 B, bus: can0, identifier: 0x181}\n"
        "  pdo: {from: other, from_port: o,",
    )
    found = dse.analyse(dse.loads(text))
    assert [item.name for item in found.messages["can0"]] == ["sync", "copy"]
    assert found.metrics["latency of sync_flow"] == 190_000
    text = text.replace("to: drive, data_size: 8 B, bus: can0, port: data", "to: drive, data_size: 8 B, bus: can0")
    text += "  other_flow: {path: [other, pdo, drive]}\n"
    assert metric(text, "latency of other_flow") == 190_000
    assert not dse.simulate(dse.loads(text), runs=4).contradictions


def test_a_message_that_waits_for_nothing_among_few_threads_waits_in_the_whole_design() -> None:
    """A figure with no thread counted is remembered first; the whole design has its own, as one that is asked alone."""
    space = dse.loads(SYNC).space
    sync = build_measure(space, next(item for item in all_metrics(space) if item.name == "jitter of sync_flow"))
    assert sync.value(View((), ())) < sync.value(View(())) == 146_000


def test_the_public_cars_bus() -> None:
    """Twelve messages later than their cycle with their own identifiers, none in the order of their deadlines."""
    found = dse.analyse(dse.loads(car_bus()))
    late = [item.name for item in found.messages["b"] if item.meets_deadline is False]
    assert len(late) == 12
    assert {
        verdict.requirement.metric.name.removeprefix("response time of ")
        for verdict in found.verdicts
        if not verdict.holds
    } == set(late)
    rows = [line.split(",") for line in CAR.read_text(encoding="utf-8").splitlines()[3:]]
    ordered = sorted(rows, key=lambda row: (int(row[4]), int(row[0])))
    by_deadline = {int(row[0]): place for place, row in enumerate(ordered)}
    found = dse.analyse(dse.loads(car_bus(by_deadline)))
    assert all(item.meets_deadline for item in found.messages["b"])


def test_an_identifier_is_a_decision() -> None:
    """With a lower one than the SYNC has the other message goes first; with its own there is no such design."""
    text = (
        SYNC.replace("identifier: 0x181", "identifier: [0x80, 0x10, 0x181]")
        + """
requirements: [response time of pdo <= 0.2 ms]
objectives: [minimise response time of pdo, minimise changes]
baseline: {pdo: {identifier: 0x181}}
"""
    )
    found = dse.solve(dse.loads(text))
    assert [(point.decisions["pdo.identifier"], *point.objectives.values()) for point in found.front] == [
        ("0x181", 190_000, 0)
    ]
    assert "0x80" not in {point.decisions["pdo.identifier"] for point in found.front}
    assert not dse.verify(found).findings
    chosen = dse.loads(dse.export(found, 1))
    assert dse.analyse(chosen).messages["can0"][1].identifier == 0x181


def test_messages_with_open_periods_rates_and_identifiers() -> None:
    """Of 2 ** 13 combinations a few refused designs tell enough."""
    rates = "fast: {bandwidth: 500 kbit/s, frame: can, price: 6 EUR}, slow: {bandwidth: 125 kbit/s, frame: can}"
    lines = ["dse: 1", "name: many", f"bus_types: {{{rates}}}", "buses: {b: {type: [slow, fast]}}", "devices:"]
    lines += ["  sink: {}", *(f"  d{one}: {{period: [{10 + one} ms, {20 + 2 * one} ms]}}" for one in range(9))]
    lines.append("connections:")
    for one in range(9):
        identifier = f"[{100 + one}, {50 + one}]" if one % 3 == 0 else str(100 + one)
        sent = f"from: d{one}, to: sink, data_size: 8 B, bus: b, identifier: {identifier}"
        lines.append(f"  m{one}: {{{sent}, deadline: 9 ms}}")
    lines += ["flows: {f: {path: [d8, m8, sink]}}", "objectives: [minimise price, minimise jitter of f]"]
    found = dse.solve(dse.loads("\n".join(lines)))
    assert found.status == "complete"
    assert [point.objectives["price"] for point in found.front] == [600]  # at 125 kbit/s nine frames take longer


LATE = """
dse: 1
name: a message later than its period
processing: execution_time
bus_types: {can_500k: {bandwidth: 500 kbit/s, transmission_time: {fixed: 328 us}, arbitration: priority}}
buses: {can0: {type: can_500k}}
devices: {relay: {compute_execution_time: 1 ms .. 9612 us}, timer: {period: 5 ms}, other: {period: 50 ms}, sink: {}}
connections:
  command: {from: timer, to: relay}
  pdo: {from: relay, to: sink, data_size: 8 B, bus: can0, identifier: 1}
  status: {from: other, to: sink, data_size: 8 B, bus: can0, identifier: 2, port: data}
flows: {whole: {path: [timer, relay, sink]}, part: {path: [relay, sink]}}
"""


def test_a_late_message_has_been_early_behind_its_own_one() -> None:
    """docs/semantics.md, section 5.4: a response time of 984 us, and 656 us from its latest release on."""
    found = dse.analyse(dse.loads(LATE))
    (pdo,) = [item for item in found.messages["can0"] if item.name == "pdo"]
    assert pdo.response_ns == 984_000
    values = Evaluator(dse.loads(LATE).space).metric_values(())
    took = 9_612_000 + 328_000  # the relay, and the message on the wire
    waits = {flow: values[f"latency of {flow}"] - took for flow in ("whole", "part")}
    assert waits == {"whole": 328_000, "part": 656_000}


def test_a_figure_of_a_message_times_a_constant() -> None:
    """Waiting counts as often as the metric says, in the search and in the second proof."""
    lines = [
        "dse: 1",
        "name: scaled",
        "bus_types: {can: {bandwidth: 125 kbit/s, frame: can}}",
        "buses: {b: {type: can}}",
    ]
    lines += ["device_types:", "  quick: {compute_execution_time: 500 us}", "  slow: {compute_execution_time: 4 ms}"]
    lines += ["devices:", "  src: {period: 20 ms, type: [quick, slow]}", "  sink: {}"]
    lines += [f"  d{one}: {{period: [100 ms, 101 ms]}}" for one in range(9)]
    lines += ["connections:", "  m: {from: src, to: sink, data_size: 8 B, bus: b, identifier: [1, 900], port: data}"]
    for one in range(9):
        sent = f"from: d{one}, to: sink, data_size: {8 if one < 2 else 4} B, bus: b, port: data"
        lines.append(f"  c{one}: {{{sent}, identifier: {100 + one if one < 2 else 1000 + one}}}")
    lines += ["flows: {f: {path: [src, sink]}}", "metrics: {part: latency of f * 0.01}"]
    lines.append('rules: ["src.type = quick requires m.identifier = 900", "src.type = slow requires m.identifier = 1"]')
    found = dse.solve(dse.loads("\n".join(lines)), minimise=["part"])
    assert [point.decisions["src.type"] for point in found.front] == ["quick"]
    assert not dse.verify(found).findings


STATED = """
dse: 1
name: A device that states how late it answers
processor_types: {small: {cores: 1}}
bus_types: {can_125k: {bandwidth: 125 kbit/s, frame: can}}
processors: {one: {type: small}}
buses: {can0: {type: can_125k}}
devices:
  sensor: {period: 20 ms, compute_execution_time: 100 us .. 200 us, response_time: 100 us .. 1600 us}
  motor: {period: 1 ms}
threads: {control: {processor: one, dispatch_protocol: aperiodic, compute_execution_time: 1 ms}}
connections:
  seen: {from: sensor, to: control, data_size: 8 B, bus: can0, identifier: 1}
  wanted: {from: control, to: motor, data_size: 8 B, bus: can0, identifier: 2}
flows: {sensor_to_motor: {path: [sensor, control, motor]}}
objectives: [minimise jitter of sensor_to_motor]
"""


@pytest.mark.parametrize("processing", ["response_time", "execution_time"])
def test_what_a_device_sends_spreads_by_the_response_time_that_it_states(processing: str) -> None:
    seen = dse.analyse(dse.loads(STATED + f"processing: {processing}\n")).messages["can0"][0]
    assert seen.releases is not None
    assert [(item.period_ns, item.jitter_ns) for item in seen.releases] == [(20_000_000, 1_500_000)]


def test_the_twelve_late_messages_of_the_public_cars_bus_are_named_with_few_looks_at_the_whole_bus(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All messages of a design are looked at together, once for each question: 150 of them took minutes one by one."""
    looks = []

    def counting(system: System) -> Solution:
        looks.append(system)
        return solve(system)

    monkeypatch.setattr(responses, "solve", counting)
    found = dse.solve(dse.loads(f"{car_bus()}\nobjectives: [minimise price]"))
    assert found.status == "infeasible"
    assert len({clash.text for conflict in found.conflicts for clash in conflict.members}) == 12
    assert len(looks) < 60
