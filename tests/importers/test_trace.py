"""Traces of ros2_tracing, as text and by babeltrace2's Python module (played): times, periods, topics, what is missing.

The tracepoints are those of ros2_tracing; the trace is our own.
"""

from __future__ import annotations

import sys
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml

import dse
from dse.cli.main import run
from dse.importers.ros2.events import events_of

CONTEXT = '{ cpu_id = 0 }, { vpid = 7, procname = "robot", vtid = %d }'
MS = 10**6
BEGIN = (23 * 3600 + 59 * 60 + 59) * 1000 * MS
"""A second before midnight."""


def stamp(time_ns: int) -> str:
    seconds, rest = divmod(time_ns % (86_400 * 10**9), 10**9)
    return f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}.{rest:09}"


def happenings() -> Iterator[tuple[int, int, str, dict[str, Any]]]:
    """Time in ns, thread, name and fields: a timer every 20 ms publishes, a callback of the topic, one from outside."""
    yield 0, 1, "rcl_node_init", {"node_handle": 1, "node_name": "cam", "namespace": "/front"}
    yield 0, 1, "rcl_node_init", {"node_handle": 2, "node_name": "track", "namespace": "/"}
    yield 0, 1, "rcl_publisher_init", {"publisher_handle": 10, "node_handle": 1, "topic_name": "/image"}
    yield 0, 1, "rcl_timer_init", {"timer_handle": 20, "period": 20 * MS}
    yield 0, 1, "rclcpp_timer_callback_added", {"timer_handle": 20, "callback": 21}
    yield 0, 1, "rclcpp_timer_link_node", {"timer_handle": 20, "node_handle": 1}
    for handle, topic in ((30, "/image"), (40, "/stop"), (50, "/parameter_events")):
        yield 0, 1, "rcl_subscription_init", {"subscription_handle": handle, "node_handle": 2, "topic_name": topic}
        yield 0, 1, "rclcpp_subscription_init", {"subscription_handle": handle, "subscription": handle + 1}
        yield 0, 1, "rclcpp_subscription_callback_added", {"subscription": handle + 1, "callback": handle + 2}
    jobs: list[tuple[int, int, int, int]] = []  # begin, callback, duration, thread
    for number in range(100):
        begin = number * 20 * MS + 5 * MS
        jobs += [(begin, 21, 1000_000 + number * 1000, 2), (begin + 3 * MS, 32, 4000_000 - number * 1000, 3)]
        if number % 10 == 0:
            jobs.append((begin + 9 * MS, 42, 500_000, 3))
            jobs.append((begin + 9 * MS, 52, 500_000, 4))
    events: list[tuple[int, int, str, dict[str, Any]]] = []
    for begin, callback, duration, thread in jobs:
        events.append((begin, thread, "callback_start", {"callback": callback, "is_intra_process": 0}))
        if callback == 21:
            events.append((begin + 100, thread, "rcl_publish", {"publisher_handle": 10, "message": 99}))
        events.append((begin + duration, thread, "callback_end", {"callback": callback}))
    yield from sorted(events, key=lambda item: item[0])


def text(events: Any = None) -> str:
    lines = []
    for time_ns, thread, name, fields in happenings() if events is None else events:
        values = {key: f'"{value}"' if isinstance(value, str) else str(value) for key, value in fields.items()}
        shown = ", ".join(f"{key} = {value}" for key, value in values.items())
        lines.append(f"[{stamp(BEGIN + time_ns)}] (+0.000000001) host ros2:{name}: {CONTEXT % thread}, {{ {shown} }}\n")
    return "".join(lines)


def put(folder: Path, content: str, name: str = "trace.txt") -> str:
    path = folder / name
    path.write_text(content, encoding="utf-8")
    return str(path)


def test_a_trace_is_a_problem_with_times_rates_and_topics(tmp_path: Path) -> None:
    """Across midnight; figures by hand."""
    found = dse.import_file(put(tmp_path, text()))
    data = yaml.safe_load(found.text)
    threads = data["threads"]
    assert list(threads) == ["front.cam.timer", "track.on.image", "track.on.stop"]
    assert threads["front.cam.timer"]["period"] == "20 ms"
    assert threads["front.cam.timer"]["compute_execution_time"] == "1 ms .. 1.099 ms"
    assert threads["track.on.image"]["compute_execution_time"] == "3.901 ms .. 4 ms"
    assert "100 samples; 100 times, every 20 ms on average" in threads["front.cam.timer"]["source"]
    assert data["executors"]["track.group"]["kind"] == "wait_set"  # both callbacks run in one OS thread
    assert data["connections"]["image"]["from"] == "front.cam.timer"
    assert data["connections"]["stop"]["rate"] == "5 Hz"
    assert data["uncertainty"]["threads.track.on.image.compute_execution_time.max"]["mean"] == "3.9505 ms"
    assert data["ros2"]["nodes"] == {"front.cam": "/front/cam", "track": "/track"}
    assert dse.load(found.text).space.decisions is not None and found.remarks == ()


def test_events_of_the_kernel_are_passed_over(tmp_path: Path) -> None:
    """What `ros2 trace -k` records beside those of ROS 2: their names have no provider, their fields nest."""
    fields = '{ cpu_id = 0 }, { prev_comm = "ros 2", prev_state = ( "TASK_RUNNING" : container = 0 ), next_prio = 20 }'
    lines = text().splitlines(keepends=True)
    kernel = [f"{line.partition(' ros2:')[0]} sched_switch: {fields}\n" for line in lines]
    mixed = "".join(line for pair in zip(lines, kernel, strict=True) for line in pair)
    plain = dse.import_file(put(tmp_path, text()))
    found = dse.import_file(put(tmp_path, mixed))
    assert [line for line in found.text.splitlines() if "source" not in line] == [
        line for line in plain.text.splitlines() if "source" not in line
    ]
    with pytest.raises(dse.ProblemError, match="the trace has no event ros2:callback_start"):
        dse.import_file(put(tmp_path, "".join(kernel)))


def test_the_module_of_babeltrace_says_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Message(SimpleNamespace):
        pass

    def played(path: str) -> Iterator[Any]:
        yield object()
        for time_ns, thread, name, fields in happenings():
            event = SimpleNamespace(
                name=f"ros2:{name}",
                packet=SimpleNamespace(context_field={"cpu_id": 0}),
                common_context_field={"vpid": 7, "vtid": thread},
                payload_field=fields,
            )
            clock = SimpleNamespace(ns_from_origin=BEGIN + time_ns)
            yield Message(event=event, default_clock_snapshot=clock)

    folder = tmp_path / "trace"
    folder.mkdir()
    (folder / "metadata").write_bytes(b"")
    module = SimpleNamespace(TraceCollectionMessageIterator=played, _EventMessageConst=Message, _Error=ValueError)
    monkeypatch.setitem(sys.modules, "bt2", module)
    here = dse.import_file(put(tmp_path, text())).text.replace("trace.txt", "trace")
    assert dse.import_file(folder).text == here
    monkeypatch.setitem(sys.modules, "bt2", None)
    with pytest.raises(dse.ProblemError, match=r"which is not there \(convert it: babeltrace2 TRACE > trace\.txt"):
        dse.import_file(folder)


def test_times_of_a_trace_go_into_a_structure_of_another_file(tmp_path: Path) -> None:
    template = """callback_groups:
  - {id: /front/cam@Timer(20000000), policy: SCHED_FIFO, priority: 80, affinity: [0]}
  - {id: "/track@Subscription(/image)@Subscription(/other)", policy: SCHED_OTHER, priority: 0, affinity: ~}
"""
    found = dse.import_file(put(tmp_path, template, "cie.yaml"), times=[put(tmp_path, text())], rate="1 Hz")
    threads = yaml.safe_load(found.text)["threads"]
    assert threads["front.cam.timer"]["compute_execution_time"] == "1 ms .. 1.099 ms"
    assert threads["track.on.image"]["source"].startswith("cie.yaml:3: /track, on /image; times: trace.txt: ")
    said = [str(item) for item in found.remarks]
    assert any("no thread is /track@Subscription(/stop): its times are left out" in item for item in said)
    assert "warning: no times of track.on.other: they count as taking no time" in said


def test_a_timer_that_drifts_and_jobs_without_an_end_are_told(tmp_path: Path) -> None:
    slow = [(time * 3 // 2, *rest) for time, *rest in happenings()]
    found = dse.import_file(put(tmp_path, text(slow[:-1])))
    said = [str(item) for item in found.remarks]
    assert any("was created with a period of 20 ms, and ran 100 times, every 30 ms on average" in item for item in said)


@pytest.mark.parametrize("period", ["0", "-5", '"slow"'])
def test_timers_without_a_period_are_told(period: str, tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, text().replace("period = 20000000", f"period = {period}")))
    assert "front.cam.timer" not in yaml.safe_load(found.text)["threads"]
    assert any(
        "a timer of /front/cam without a period is left out, with its jobs: 100" in str(item) for item in found.remarks
    )
    assert dse.load(found.text)


def without(part: str) -> str:
    return "".join(line for line in text().splitlines(keepends=True) if part not in line)


BAD = {
    "empty": ("", "trace.txt:1: the file is empty"),
    "other": ("hello\n", "trace.txt:1: no event: 'hello'"),
    "cut off": (text()[:-40], "no event: "),
    "no nodes": (without("node_init"), "no event ros2:rcl_node_init (begin the trace before the nodes start)"),
    "no starts": (without("callback_st"), "ros2 trace -u 'ros2:*'"),
    "backwards": (
        "".join(reversed(text().splitlines(keepends=True)[:20])),
        "this event is earlier than the one before",
    ),
    "no callbacks": (without("_added"), "no callback of a timer"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_traces_are_told_with_their_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, words = BAD[name]
    target = tmp_path / "out.yaml"
    assert run(["import", put(tmp_path, content), "--format", "trace", "-o", str(target)]) == 3
    assert words in capsys.readouterr().err
    assert not target.exists()


def test_one_stream_of_a_trace_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "trace.txt").write_bytes(b"\xc1\x1f\xfc\xc1" + bytes(100))
    with pytest.raises(dse.ProblemError, match="one stream of a CTF trace: name its folder"):
        dse.import_file(tmp_path / "trace.txt", "trace")


def test_times_in_seconds_are_read_too(tmp_path: Path) -> None:
    fields = '{ cpu_id = 0 }, { callback = 0x1F, s = "a \\"b\\", c" }'
    line = f"[1700000000.000000005] (+?.?????????) ros2:callback_end: {fields}\n"
    [event] = events_of(Path(put(tmp_path, line)))
    assert (event.name, event.time_ns) == ("callback_end", 1_700_000_000 * 10**9 + 5)
    assert event.fields["callback"] == 31


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("trace.txt", ["import", "--format", "trace"], "trace.txt:1: no event: "),
        ("run.bag", ["sizes", "--bag"], "run.bag: no bag that can be read: it does not begin with #ROSBAG V"),
    ],
)
def test_a_long_file_without_lines_is_not_read_whole(
    name: str, arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (tmp_path / name).open("wb") as stream:
        stream.truncate(300_000_000)
    tracemalloc.start()
    try:
        assert run([*arguments, str(tmp_path / name)]) == 3
        assert tracemalloc.get_traced_memory()[1] < 100_000_000
    finally:
        tracemalloc.stop()
    assert words in capsys.readouterr().err
