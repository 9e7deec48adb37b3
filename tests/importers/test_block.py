"""The block that every import ends with: what to fill in, what was guessed, and warnings by their kind."""

from __future__ import annotations

from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.report.words.imported import import_block
from tests.importers.test_can import WHOLE
from tests.importers.test_ros2 import ARCHITECTURE, TIMES

LAUNCH = """<launch>
<node pkg="p" exec="a" name="a"/>
<node pkg="p" exec="b" name="b"><param name="update_rate" value="50"/></node>
{nodes}
</launch>
"""


HINT = "(state the `rate` of that connection, or give --rate)"


def put(folder: Path, name: str, content: str) -> str:
    (folder / name).write_text(content, encoding="utf-8")
    return str(folder / name)


def test_an_architecture_says_what_is_to_be_filled_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = put(tmp_path, "a.yaml", ARCHITECTURE), str(tmp_path / "out.yaml")
    assert run(["import", file, "-o", out]) == 0
    assert capsys.readouterr().err.splitlines() == [
        "Read: 5 threads, 4 connections, 1 flow.",
        "Fill in:",
        (
            "  threads.NAME.compute_execution_time [ms]: without it each counts as taking no time; all 5: "
            "cam.callback_0, ns.track.on_image, ns.track.tick, drive.on_lane, drive.on_stop"
        ),
        "  connections.stop.rate [Hz]: nothing says how often the connection comes from outside",
        (
            "  connections.NAME.data_size [B]: without it each costs nothing on a bus; all 4: "
            "ns.track.on_image.to.tick, image, lane, stop"
        ),
        (
            "  connections.NAME.bus [name of a bus]: without one each costs nothing; 3 of 4: "
            "ns.track.on_image.to.tick, image, lane"
        ),
        "Guessed (2):",
        f"  {file}:55: warning: /ns/track/tick is taken for what publishes /lane (state it under callback_names)",
        (
            f"  {file}:19: warning: executor_1 has several threads: it counts as if it had one for each of its "
            "callback groups"
        ),
        "Warnings (1):",
        f"  {file}:74: warning: nothing in the file publishes /stop {HINT}",
    ]
    times = put(tmp_path, "times.csv", TIMES)
    assert run(["import", file, "--times", times, "--rate", "1 Hz", "-o", out]) == 0
    said = capsys.readouterr().err
    assert "compute_execution_time" not in said and ".rate [Hz]" not in said


def test_structure_without_connections_or_flows_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["import", put(tmp_path, "a.launch.xml", LAUNCH.format(nodes="")), "-o", str(tmp_path / "o.yaml")]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == ["Read: 2 threads, no connections, no flows.", "Fill in:"]
    assert "  threads.a.period [ms]: nothing says how often the thread runs" in said
    assert "  connections [from, to]: nothing says who sends to whom" in said
    assert "  flows [path]: without one there is no end-to-end latency" in said
    assert run(["import", put(tmp_path, "a.dbc", WHOLE), "-o", str(tmp_path / "o.yaml")]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "Read: no threads, 4 devices, 1 bus, 4 connections, no flows."


def test_warnings_that_differ_in_names_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    odd = "".join(f'<node pkg="p" exec="e{number}" name="$(env X{number})"/>\n' for number in range(9))
    path = put(tmp_path, "a.launch.xml", LAUNCH.format(nodes=odd))
    assert run(["import", path, "-o", str(tmp_path / "o.yaml")]) == 0
    said = capsys.readouterr().err
    assert "a.launch.xml:4: warning: e0 has no name: it is taken for e0 " in said and "taken for e1" not in said
    assert "state its `name`) [and 8 more like this]" in said and "Warnings (9):" in said and "Guessed (10):" in said
    assert run(["import", path, "--all", "-o", str(tmp_path / "o.yaml")]) == 0
    said = capsys.readouterr().err
    assert "more like this" not in said and "e8 has no name: it is taken for e8" in said


def test_what_is_in_place_is_not_asked_for() -> None:
    document = {
        "thread_types": {"t": {"compute_execution_time": "1 ms", "period": "2 ms"}},
        "threads": {
            "a": {"type": "t"},
            "b": {"type": ["t"], "dispatch_protocol": "aperiodic"},
            "c": {"compute_execution_time": "1 ms", "dispatch_protocol": "sporadic"},
        },
        "devices": {"d": {}, "e": {"period": "1 s"}},
        "connections": {
            "x": {"from": "e", "to": "b", "data_size": "1 B", "bus": "can"},
            "y": {"to": "c", "data_rate": "1 B/s"},
        },
        "flows": {"f": {"path": ["e", "b"]}},
    }
    assert import_block(document, ()) == ["Read: 3 threads, 2 devices, 2 connections, 1 flow."]


def test_python_has_the_plain_data(tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, "a.dbc", WHOLE))
    assert import_block(found.document, found.remarks)[0].startswith("Read: no threads, 4 devices")


MODEL = """package m public
  data d properties Data_Size => 8 Bytes; end d;
  device s features o : out event data port d; flows f : flow source o {Latency => 1 ms .. 2 ms;};
    properties Period => 10 ms; end s;
  thread w features i : in event data port d; a : requires data access d; flows f : flow path i -> a;
    properties Dispatch_Protocol => Aperiodic; Compute_Execution_Time => 1 ms .. 1 ms; end w;
  thread r features a : requires data access d; flows f : flow sink a {Latency => 3 ms .. 4 ms;};
    properties Dispatch_Protocol => Periodic; Period => 10 ms; end r;
  process p features i : in event data port d; flows f : flow sink i; end p;
  process implementation p.i
    subcomponents w : thread w; r : thread r; x : data d;
    connections c : port i -> w.i; b : data access w.a -> x; e : data access x -> r.a;
    flows f : flow sink i -> c -> w.f -> b -> x -> e -> r.f;
  end p.i;
  system top end top;
  system implementation top.i
    subcomponents s : device s; p : process p.i;
    connections c : port s.o -> p.i;
    flows e : end to end flow s.f -> c -> p.f;
  end top.i;
end m;
"""


def test_shared_data_and_flows_with_a_latency_are_complete(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a flow specification has a latency for needs no execution time, shared data no time and no bus."""
    assert run(["import", put(tmp_path, "m.aadl", MODEL), "-o", str(tmp_path / "out.yaml")]) == 0
    assert capsys.readouterr().err.splitlines() == [
        "Read: 2 threads, 1 device, 3 connections, 1 flow.",
        "Fill in:",
        "  connections.s.o.bus [name of a bus]: without one the connection costs nothing",
    ]
