"""ROS 2 systems in and out: CARET's architecture files, the callback-isolated executor's, times, names.

The formats are those of CARET's documentation and of the README of cie_thread_configurator; the systems are our own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.cli.main import run

ARCHITECTURE = """named_paths:
- path_name: steer
  node_chain:
  - node_name: /cam
    publish_topic_name: /image
    subscribe_topic_name: UNDEFINED
  - node_name: /ns/track
    publish_topic_name: /lane
    subscribe_topic_name: /image
  - node_name: /drive
    publish_topic_name: UNDEFINED
    subscribe_topic_name: /lane
executors:
- executor_type: single_threaded_executor
  executor_name: executor_0
  callback_group_names:
  - /ns/track/group_0
  - /drive/group_0
- executor_type: multi_threaded_executor
  executor_name: executor_1
  callback_group_names:
  - /cam/group_0
nodes:
- node_name: /cam
  callback_groups:
  - callback_group_type: mutually_exclusive
    callback_group_name: /cam/group_0
    callback_names: [/cam/callback_0]
  callbacks:
  - callback_name: /cam/callback_0
    callback_type: timer_callback
    period_ns: 50000000
    symbol: grab
  publishes:
  - topic_name: /image
    callback_names: [/cam/callback_0]
- node_name: /ns/track
  callback_groups:
  - callback_group_type: mutually_exclusive
    callback_group_name: /ns/track/group_0
    callback_names: [on_image, tick]
  callbacks:
  - callback_name: on_image
    callback_type: subscription_callback
    topic_name: /image
    symbol: image
  - callback_name: tick
    callback_type: timer_callback
    period_ns: 20000000
    symbol: tick
  variable_passings:
  - callback_name_write: on_image
    callback_name_read: tick
  publishes:
  - topic_name: /lane
    callback_names: [UNDEFINED]
  subscribes:
  - topic_name: /image
    callback_name: on_image
  message_contexts:
  - context_type: callback_chain
    subscription_topic_name: /image
    publisher_topic_name: /lane
- node_name: /drive
  callback_groups:
  - callback_group_type: mutually_exclusive
    callback_group_name: /drive/group_0
    callback_names: [on_lane, on_stop]
  callbacks:
  - callback_name: on_lane
    callback_type: subscription_callback
    topic_name: /lane
    symbol: lane
  - callback_name: on_stop
    callback_type: subscription_callback
    topic_name: /stop
    symbol: stop
"""
TIMES = """node,callback,min_us,max_us
/cam,callback_0,900,1000
/ns/track,on_image,4000,5000
/ns/track,tick,1000,2000
/drive,on_lane,500,600
/drive,on_stop,10,20
"""
CONFIGURATION = """hardware_info: {model_name: Some CPU}
callback_groups:
  - id: /cam@Subscription(/parameter_events)@Service(/cam/get_parameters)@Waitable
    affinity: ~
    policy: SCHED_OTHER
    priority: 0
  - id: /cam@Timer(10000000)
    affinity: [1]
    policy: SCHED_FIFO
    priority: 80
  - id: /ns/track@Subscription(/image)@Timer(20000000)
    affinity: ~
    policy: SCHED_OTHER
    priority: 0
"""


def put(folder: Path, text: str, name: str = "robot.yaml") -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def document(text: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(text)
    return found


def test_an_architecture_is_a_problem(tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, ARCHITECTURE), rate="2 Hz")
    data = document(found.text)
    assert {name: body.get("period") for name, body in data["threads"].items()} == {
        "cam.callback_0": "50 ms",
        "ns.track.on_image": None,
        "ns.track.tick": "20 ms",
        "drive.on_lane": None,
        "drive.on_stop": None,
    }
    assert data["executors"]["executor_0"]["kind"] == "wait_set"
    members = [name for name, body in data["threads"].items() if body.get("executor") == "executor_0"]
    assert members == ["ns.track.on_image", "ns.track.tick", "drive.on_lane", "drive.on_stop"]
    assert data["connections"]["ns.track.on_image.to.tick"]["port"] == "data"
    assert data["connections"]["stop"] == {
        "to": "drive.on_stop",
        "rate": "2 Hz",
        "source": "robot.yaml:74: topic /stop; rate stated at the import",
    }
    assert data["flows"]["steer"]["path"] == [
        *("cam.callback_0", "image", "ns.track.on_image", "ns.track.on_image.to.tick", "ns.track.tick"),
        *("lane", "drive.on_lane"),
    ]
    assert data["ros2"]["nodes"]["ns.track"] == "/ns/track"
    said = [str(item).removeprefix(f"{tmp_path}/") for item in found.remarks]
    assert (
        "robot.yaml:55: warning: /ns/track/tick is taken for what publishes /lane (state it under callback_names)"
        in said
    )
    assert any("robot.yaml:19: warning: executor_1 has several threads" in text for text in said)
    assert any("nothing in the file publishes /stop" in text for text in said)


def test_times_of_another_file_count(tmp_path: Path) -> None:
    """Reaction by hand: a timer's 50 ms does not count; on_image 5 ms, up to 20 ms of waiting, tick 2 ms, 0.6 ms."""
    times = put(tmp_path, TIMES, "times.csv")
    found = dse.import_file(put(tmp_path, ARCHITECTURE), times=[times], rate="2 Hz")
    assert "MISSING: execution times" not in found.text
    table = dse.analyse(dse.load(found.text), processing="execution_time").flows[0]
    assert (table.min_ns, table.max_ns) == (900_000 + 4_000_000 + 1_000_000 + 500_000, 28_600_000)
    with pytest.raises(dse.UsageError, match="no times of threads that there are"):
        dse.import_file(put(tmp_path, ARCHITECTURE), times=[put(tmp_path, "thread,delay_us\nx,1\n", "x.csv")])


def test_what_is_missing_is_told(tmp_path: Path) -> None:
    times = put(tmp_path, "\n".join(TIMES.splitlines()[:4]) + "\n/nobody,cb,1,2\n", "times.csv")
    found = dse.import_file(put(tmp_path, ARCHITECTURE), times=[times])
    said = [str(item) for item in found.remarks]
    assert any("there is no thread for the times of" in text and "times.csv:5" in text for text in said)
    assert "warning: no times of drive.on_lane, drive.on_stop: they count as taking no time" in said
    assert "MISSING: execution times of drive.on_lane, drive.on_stop." in found.text
    assert "MISSING: how often these come from outside, a `rate` each (or --rate): stop." in found.text
    with pytest.raises(dse.ProblemError, match=r"stop: it triggers .* give it a `rate`"):
        dse.load(dse.import_file(put(tmp_path, ARCHITECTURE), times=[put(tmp_path, TIMES, "all.csv")]).text)


def test_platforms_of_the_times_are_choices_of_the_computer(tmp_path: Path) -> None:
    rows = TIMES.splitlines()
    table = [f"platform,{rows[0]}", *(f"{name},{row}" for name in ("pc", "board") for row in rows[1:])]
    times = put(tmp_path, "\n".join(table) + "\n", "times.csv")
    data = document(dse.import_file(put(tmp_path, ARCHITECTURE), times=[times], rate="1 Hz").text)
    assert data["processors"]["computer"]["type"] == ["pc", "board"]
    assert list(data["processor_types"]) == ["pc", "board"]


def test_a_configuration_goes_in_and_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Priorities, cores and ids with the chosen periods; read back they are the same."""
    monkeypatch.chdir(tmp_path)
    put(tmp_path, CONFIGURATION, "template.yaml")
    times = "node,callback,duration_us\n/cam,timer,2000\n/ns/track,on/image,3000\n/ns/track,timer_2,4000\n"
    put(tmp_path, times, "times.csv")
    assert run(["import", "template.yaml", "--times", "times.csv", "--rate", "10 Hz", "-o", "robot.yaml"]) == 0
    text = Path("robot.yaml").read_text(encoding="utf-8")
    data = document(text)
    group = {"kind": "callback_group", "processor": "computer", "priority": 80, "core": 2}
    assert data["executors"]["cam.group"].items() >= group.items()
    assert data["executors"]["ns.track.group"]["core"] == "any"
    assert (
        data["ros2"]["callback_groups"]["ns.track.group"] == "/ns/track@Subscription(/image)@Timer({ns.track.timer_2})"
    )
    text = text.replace("period: 10 ms", "period: [10 ms, 5 ms]").replace(
        "\nros2:", "\nros2:\n  parameters: {PARAMETERS}"
    )
    text = text.replace("PARAMETERS", 'cam.timer.period: "grab.ms [int ms]", ns.track.timer_2.rate: fps')
    question = "processing: response_time\ndeadlines: all\nobjectives: [maximise utilisation of computer]\n"
    put(tmp_path, text + question)
    assert run(["solve", "robot.yaml", "--json", "r.json"]) == 0
    assert run(["export", "r.json", "--alternative", "1", "--format", "cie", "-o", "cie.yaml"]) == 0
    groups = document(Path("cie.yaml").read_text(encoding="utf-8"))["callback_groups"]
    assert {item["id"]: (item["policy"], item["priority"]) for item in groups} == {
        "/cam@Timer(5000000)": ("SCHED_FIFO", 90),
        "/ns/track@Subscription(/image)@Timer(20000000)": ("SCHED_FIFO", 90 if groups[1]["affinity"] == [0] else 89),
    }
    assert groups[0]["affinity"] == [1]
    assert run(["export", "r.json", "--alternative", "1", "--format", "ros2", "-o", "parameters.yaml"]) == 0
    parameters = document(Path("parameters.yaml").read_text(encoding="utf-8"))
    assert parameters == {
        "/cam": {"ros__parameters": {"grab.ms": 5}},
        "/ns/track": {"ros__parameters": {"fps": 50.0}},
    }
    again = document(dse.import_file("cie.yaml").text)
    assert again["executors"]["cam.group"]["priority"] == 90 and again["threads"]["cam.timer"]["period"] == "5 ms"


def test_exports_refuse_what_has_no_name(tmp_path: Path) -> None:
    plain = """{dse: 1, name: x, processor_types: {t: {}}, processors: {p: {type: t}}, objectives: [minimise price],
        threads: {a: {processor: p, period: 1500 us, compute_execution_time: 1 us}}}"""
    with pytest.raises(dse.UsageError, match="states no ids of callback groups"):
        dse.export(dse.solve(dse.load(plain)), 1, "cie")
    named = plain.replace("dse: 1,", "dse: 1, ros2: {parameters: {a.period: 'p [int ms]'}},")
    with pytest.raises(dse.UsageError, match=r"p: 1\.5 ms is no whole number"):
        dse.export(dse.solve(dse.load(named)), 1, "ros2")


BAD = {
    "empty": ("", "caret", "robot.yaml:1: the file is empty"),
    "cut off": (ARCHITECTURE[:1210], "caret", "robot.yaml:"),
    "not YAML": ("nodes: [", "caret", ": not YAML"),
    "other file": ("a: 1\n", "caret", "expected `nodes`, as an architecture file of CARET has them"),
    "other configuration": ("a: 1\n", "cie", "expected `callback_groups`"),
    "period": (ARCHITECTURE.replace("50000000", "50 ms"), "caret", "robot.yaml:32:16: period_ns: expected"),
    "no period": (ARCHITECTURE.replace("    period_ns: 20000000\n", ""), "caret", "period_ns: expected a whole number"),
    "callback": (ARCHITECTURE.replace("[on_image, tick]", "[on_image, tack]"), "caret", "no callback 'tack'"),
    "group": (ARCHITECTURE.replace("  - /drive/group_0\n-", "  - /driv/group_0\n-"), "caret", "no callback group"),
    "kind": (ARCHITECTURE.replace("timer_callback", "times_callback"), "caret", "robot.yaml:30:5: expected timer_"),
    "twice": ("nodes: 1\nnodes: 2\n", "caret", "robot.yaml:2: 'nodes' is there twice"),
    "alias": ("nodes: &a [*a]\n", "caret", "robot.yaml:1"),
    "id": (CONFIGURATION.replace("/cam@Timer(10000000)", "cam"), "cie", "expected an id such as"),
    "part": (CONFIGURATION.replace("@Timer(10000000)", "@Timr(1)"), "cie", "'Timr(1)' is none of Subscription"),
    "timer": (CONFIGURATION.replace("Timer(10000000)", "Timer(10 ms)"), "cie", "Timer(10 ms): expected a period in ns"),
    "policy": (CONFIGURATION.replace("SCHED_FIFO", "FIFO"), "cie", "policy: expected one of SCHED_FIFO"),
    "priority": (CONFIGURATION.replace("priority: 80", "priority: 100"), "cie", "whole number from 1 to 99, got '100'"),
    "affinity": (CONFIGURATION.replace("[1]", "[a]"), "cie", "affinity: expected the numbers of CPUs"),
    "same id": (CONFIGURATION + CONFIGURATION[CONFIGURATION.index("  - id: /ns") :], "cie", "is there twice, first"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_told_with_their_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, form, words = BAD[name]
    target = tmp_path / "out.yaml"
    assert run(["import", put(tmp_path, text), "--format", form, "-o", str(target)]) == 3
    assert words in capsys.readouterr().err
    assert not target.exists()


def test_other_encodings_and_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "robot.yaml").write_text(ARCHITECTURE, encoding="utf-16")
    path = str(tmp_path / "robot.yaml")
    assert run(["import", path, "--format", "caret"]) == 3
    assert "the file is not UTF-8 text" in capsys.readouterr().err
    put(tmp_path, CONFIGURATION)
    assert run(["import", path, "--cores", "1"]) == 2
    assert "pins a callback group to core 2" in capsys.readouterr().err
    assert run(["import", path, "--cores", "0"]) == 2
    assert run(["import", path, "--rate", "fast"]) == 2


NAMES = {
    "node": ("nodes: {x: /cam}", 'ros2.nodes.x: there is no process, executor or thread "x"'),
    "full name": ("nodes: {a: cam}", 'ros2.nodes.a: expected the full name of a node such as "/ns/cam", got "cam"'),
    "same": ("nodes: {a: /c, b: /c}", 'ros2.nodes.b: "a" has this name too'),
    "field": (
        "parameters: {a.deadline: x}",
        "ros2.parameters.a.deadline: expected THREAD.period, THREAD.rate, THREAD.offset or THREAD.PARAMETER",
    ),
    "thread": ("parameters: {c.period: x}", 'ros2.parameters.c.period: there is no thread "c"'),
    "unit": ("parameters: {a.period: 'x [Hz]'}", "ros2.parameters.a.period: expected the name of a parameter"),
    "group": ("callback_groups: {c: '/n@Timer({a})'}", 'callback_groups.c: there is no executor or thread "c"'),
    "id": ("callback_groups: {a: 'n'}", "callback_groups.a: expected an id such as"),
    "hole": ("callback_groups: {a: '/n@Timer({c})'}", 'there is no thread "c", whose period would stand there'),
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_what_is_not_there_are_told(name: str) -> None:
    stated, words = NAMES[name]
    text = f"dse: 1\nname: x\nros2: {{{stated}}}\nthreads: {{a: {{period: 1 ms}}, b: {{period: 1 ms}}}}\n"
    with pytest.raises(dse.ProblemError) as raised:
        dse.load(text)
    assert words in str(raised.value)


SYNCHRONISED = (
    ARCHITECTURE.replace(
        """  - context_type: callback_chain
    subscription_topic_name: /image
    publisher_topic_name: /lane
""",
        """  - context_type: inherit_unique_stamp
    subscription_topic_name: /image
    publisher_topic_name: /lane
  - context_type: inherit_unique_stamp
    subscription_topic_name: /depth
    publisher_topic_name: /lane
""",
    )
    .replace("names: [on_image, tick]", "names: [on_image, on_depth, tick]")
    .replace(
        """    symbol: image
""",
        """    symbol: image
  - callback_name: on_depth
    callback_type: subscription_callback
    topic_name: /depth
    symbol: depth
""",
    )
)


@pytest.mark.parametrize("publisher", ["tick", "on_depth"])
def test_messages_with_the_stamps_of_several_topics_wait_for_each(tmp_path: Path, publisher: str) -> None:
    """By the callback of the last message, or a timer that goes on when all have come."""
    text = SYNCHRONISED.replace("callback_names: [UNDEFINED]", f"callback_names: [{publisher}]")
    if publisher == "on_depth":
        text = text.replace("callback_name_read: tick", "callback_name_read: on_depth")
    found = dse.import_file(put(tmp_path, text), rate="10 Hz")
    thread = document(found.text)["threads"][f"ns.track.{publisher}"]
    protocol = {"tick": "hybrid", "on_depth": "aperiodic"}[publisher]
    assert (thread["join"], thread["dispatch_protocol"]) == ("all", protocol)
    kept = document(found.text)["connections"][f"ns.track.on_image.to.{publisher}"]
    assert "port" not in kept
    assert any("waits for a message of each of /image, /depth" in remark for remark in map(str, found.remarks))
    dse.loads(found.text)
