"""Several sources that make one problem: who wins, what is told, and problem files among them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.cli.main import run
from tests.importers.test_ros2 import ARCHITECTURE, CONFIGURATION, TIMES

ISOLATED = """callback_groups:
  - id: /cam@Timer(50000000)
    affinity: [1]
    policy: SCHED_FIFO
    priority: 80
  - id: /ns/track@Subscription(/image)@Timer(20000000)
    affinity: ~
    policy: SCHED_OTHER
    priority: 0
"""
LAUNCH = """<launch>
  <node_container pkg="rclcpp_components" exec="component_container" name="box">
    <composable_node pkg="cam" plugin="Cam" name="cam"><param name="update_rate" value="25"/></composable_node>
    <composable_node pkg="more" plugin="More" name="more"><param name="update_rate" value="10"/></composable_node>
  </node_container>
  <node pkg="drive" exec="drive" name="drive"/>
</launch>
"""
PARAMETERS = "/**:\n  ros__parameters: {update_rate: 20.0}\n/other:\n  ros__parameters: {update_rate: 5.0}\n"
SYSTEM = {
    "architecture.yaml": ARCHITECTURE, "isolated.yaml": ISOLATED, "robot.launch.xml": LAUNCH,
    "parameters.yaml": PARAMETERS, "times.csv": TIMES, "template.yaml": CONFIGURATION,
}  # fmt: skip


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in SYSTEM.items():
        Path(name).write_text(text, encoding="utf-8")


def read(*names: str, **options: Any) -> tuple[dict[str, Any], list[str]]:
    found = dse.import_file(list(names), **options)
    document: dict[str, Any] = yaml.safe_load(found.text)
    return document, [str(item) for item in found.remarks]


def test_priorities_and_cores_of_one_file_go_into_the_structure_of_another() -> None:
    """The executor of /ns/track and /drive is in the architecture; that of /cam only in the configuration."""
    data, said = read("architecture.yaml", "isolated.yaml", rate="1 Hz")
    assert list(data["threads"]) == [
        *("cam.callback_0", "ns.track.on_image", "ns.track.tick", "drive.on_lane", "drive.on_stop"),
    ]
    assert data["threads"]["cam.callback_0"]["executor"] == "cam.group"
    assert "processor" not in data["threads"]["cam.callback_0"]
    assert data["executors"]["cam.group"].items() >= {"kind": "callback_group", "priority": 80, "core": 2}.items()
    assert data["ros2"]["callback_groups"] == {"cam.group": "/cam@Timer({cam.callback_0})"}
    assert any(
        "the executor ns.track.group is left out: by the file named before other executors run" in x for x in said
    )
    assert set(data["connections"]) == {"image", "ns.track.on_image.to.tick", "lane", "stop"}
    assert data["processor_types"]["computer_type"]["cores"] == 2
    dse.load(yaml.safe_dump(data))


def test_the_other_order_keeps_the_groups_and_learns_who_sends() -> None:
    data, said = read("isolated.yaml", "architecture.yaml", rate="1 Hz")
    assert list(data["threads"])[:3] == ["cam.timer", "ns.track.on.image", "ns.track.timer_2"]
    assert data["threads"]["drive.on_lane"]["process"] == "drive"
    assert list(data["executors"]) == ["cam.group", "ns.track.group"]
    wires = {name: (body.get("from"), body["to"], "rate" in body) for name, body in data["connections"].items()}
    assert wires["image.ns.track"] == ("cam.timer", "ns.track.on.image", False)
    assert ("ns.track.timer_2", "drive.on_lane", False) in wires.values()
    assert any("connections.image.ns.track.rate is left out (1 Hz): cam.timer sends it" in text for text in said)
    assert data["flows"]["steer"]["path"][0] == "cam.timer"
    assert any("who publishes the topics" in text for text in said)  # /stop
    assert data["ros2"]["callback_groups"]["ns.track.group"].endswith("@Timer({ns.track.timer_2})")
    dse.load(yaml.safe_dump(data))


def test_figures_that_differ_are_told_with_both_sources() -> None:
    data, said = read("architecture.yaml", "robot.launch.xml", rate="1 Hz")
    assert data["threads"]["cam.callback_0"]["period"] == "50 ms"
    told = next(text for text in said if "threads.cam.callback_0.period" in text)
    assert "period: 50 ms (architecture.yaml:30: " in told and "but 40 ms (robot.launch.xml" in told
    assert "the file that is named first counts" in told
    assert data["threads"]["more.timer"]["period"] == "100 ms"
    assert {name: data["threads"][name]["process"] for name in ("cam.callback_0", "more.timer")} == {
        "cam.callback_0": "box", "more.timer": "box",
    }  # fmt: skip
    assert data["ros2"]["nodes"]["cam.callback_0"] == "/cam" and "cam" not in data["ros2"]["nodes"]
    assert data["ros2"]["parameters"]["cam.callback_0.rate"] == "update_rate [int Hz]"
    assert "drive" not in data["threads"]
    other, _ = read("robot.launch.xml", "architecture.yaml", rate="1 Hz")
    assert other["threads"]["cam.timer"]["period"] == "40 ms"
    assert [name for name in other["threads"] if name.startswith("drive")] == ["drive.on_lane", "drive.on_stop"]


def test_times_by_the_names_of_a_later_file_are_found() -> None:
    """And with a sender for each topic nothing is left of what the first file could not tell."""
    Path("architecture.yaml").write_text(
        ARCHITECTURE.replace("topic_name: /stop", "topic_name: /lane"), encoding="utf-8"
    )
    data, said = read("isolated.yaml", "architecture.yaml", times=["times.csv"])
    assert data["thread_types"][data["threads"]["cam.timer"]["type"]]["compute_execution_time"] == "900 us .. 1 ms"
    assert not [text for text in said if "there is no thread for the times" in text or "no times of" in text]
    assert not [text for text in said if "who publishes the topics" in text]


def test_parameter_files_concern_the_nodes_of_the_other_files() -> None:
    """``/**`` gives both nodes with timers a rate; /other is only in the parameter file."""
    data, said = read("parameters.yaml", "architecture.yaml", rate="1 Hz")
    assert data["threads"]["other.timer"]["period"] == "200 ms"
    data, said = read("architecture.yaml", "parameters.yaml", rate="1 Hz")
    assert data["ros2"]["parameters"] == {
        "cam.callback_0.rate": "update_rate [Hz]",
        "ns.track.tick.rate": "update_rate [Hz]",
        "other.timer.rate": "update_rate [Hz]",
    }
    assert any("threads.ns.track.tick.period: 20 ms" in text and "but 50 ms" in text for text in said)


def test_times_go_to_all_of_them_and_what_is_missing_is_named() -> None:
    data, _ = read("architecture.yaml", "robot.launch.xml", times=["times.csv"], rate="1 Hz")
    assert data["assumptions"][0] == "MISSING: execution times of more.timer. They count as taking no time."
    problem = dse.load(yaml.safe_dump(data))
    assert any("no execution time is stated for more.timer" in text for text in dse.check(problem).remarks)


@pytest.mark.parametrize(
    "names", [["architecture.yaml"], ["template.yaml"], ["robot.launch.xml"], ["architecture.yaml", "isolated.yaml"]]
)
def test_what_an_import_writes_is_read_back_as_it_is(names: list[str]) -> None:
    """Alone it is the same text; after the file that it was made of it adds nothing."""
    assert run(["import", *names, "--rate", "3 Hz", "-o", "own.yaml"]) == 0
    text = Path("own.yaml").read_text(encoding="utf-8")
    again = dse.import_file("own.yaml")
    assert again.text == text and not again.remarks
    twice = dse.import_file(["own.yaml", "own.yaml"])
    assert yaml.safe_load(twice.text) == yaml.safe_load(text) and not twice.remarks
    merged = dse.import_file(["own.yaml", *names], rate="3 Hz")
    before, after = yaml.safe_load(text), yaml.safe_load(merged.text)
    for section in ("threads", "executors", "connections", "processors", "flows", "ros2"):
        assert after.get(section) == before.get(section), section


def test_a_completed_problem_keeps_its_question_and_takes_new_figures() -> None:
    assert run(["import", "architecture.yaml", "--rate", "3 Hz", "-o", "own.yaml"]) == 0
    own = Path("own.yaml").read_text(encoding="utf-8").replace("period: 20 ms", "period: [20 ms, 10 ms]")
    Path("own.yaml").write_text(own + "objectives: [minimise latency of steer]\n", encoding="utf-8")
    data, said = read("own.yaml", "isolated.yaml", times=["times.csv"])
    assert data["objectives"] == ["minimise latency of steer"]
    assert data["threads"]["ns.track.tick"]["period"] == ["20 ms", "10 ms"]
    assert data["executors"]["cam.group"]["priority"] == 80
    assert not [text for text in said if "period" in text]  # 20 ms, which the other file says, is one of them


def test_sources_of_other_kinds_stand_beside_each_other() -> None:
    Path("car.dbc").write_text(
        'VERSION ""\nNS_ :\nBS_:\nBU_: cam ecu\nBO_ 100 image: 8 ecu\n SG_ s : 0|8@1+ (1,0) [0|0] "" cam\n',
        encoding="utf-8",
    )
    data, _ = read("architecture.yaml", "car.dbc", rate="1 Hz", bandwidth="500 kbit/s", cycle="10 ms")
    assert set(data["devices"]) >= {"ecu"} and len(data["buses"]) == 1
    assert {"image", "image_2"} <= set(data["connections"])
    with pytest.raises(dse.UsageError, match="mode: none of these formats has such an option"):
        read("architecture.yaml", "car.dbc", mode="x")
    with pytest.raises(dse.UsageError, match="format: of several files each one tells its format by itself"):
        dse.import_file(["architecture.yaml", "isolated.yaml"], "caret")


def test_two_databases_without_names_of_their_buses_are_two_buses() -> None:
    """The message of one name on both is one on each; read back after its own source it stays one."""
    text = 'VERSION ""\nNS_ :\nBS_:\nBU_: gate ecu\nBO_ 100 speed: 8 gate\n SG_ s : 0|8@1+ (1,0) [0|0] "" ecu\n'
    for name in ("a.dbc", "b.dbc"):
        Path(name).write_text(text, encoding="utf-8")
    options = {"bandwidth": "500 kbit/s", "cycle": "10 ms"}
    data, _ = read("a.dbc", "b.dbc", **options)
    assert {name: body["bus"] for name, body in data["connections"].items()} == {"speed": "can0", "speed_2": "can0_2"}
    assert data["buses"]["can0_2"]["type"] == "can0_type_2" and list(data["devices"]) == ["gate", "ecu"]
    Path("own.yaml").write_text(dse.import_file("a.dbc", **options).text, encoding="utf-8")
    data, _ = read("own.yaml", "a.dbc", **options)
    assert list(data["connections"]) == ["speed"] and list(data["buses"]) == ["can0"]


def test_callbacks_of_a_later_file_take_the_place_of_a_node_of_which_nothing_is_known() -> None:
    """The launch file has what /cam sends; the callback that sends it is in the parameters."""
    Path("open.launch.xml").write_text(
        """<launch><node pkg="cam" exec="cam" name="cam"><remap from="~/output/image" to="/image"/></node>
        <node pkg="t" exec="t" name="track"><remap from="~/input/image" to="/image"/></node></launch>"""
    )
    Path("rates.yaml").write_text("/cam:\n  ros__parameters: {update_rate: 20}\n", encoding="utf-8")
    data, _ = read("open.launch.xml", "rates.yaml")
    assert list(data["threads"]) == ["track.on.image", "cam.timer"]
    assert data["connections"]["image"]["from"] == "cam.timer"
    dse.load(yaml.safe_dump(data))


OWN = """dse: 1
name: own
processor_types: {pi: {cores: 4}}
processors: {pc: {type: pi}}
threads:
  camera: {process: cam, processor: pc, period: [20 ms, 50 ms]}
  tracker: {process: ns.track, processor: pc, period: [10 ms, 40 ms]}
connections:
  c: {from: camera, to: tracker}
"""
NODES = "ros2: {nodes: {cam: /cam, ns.track: /ns/track}}\n"


def test_what_a_description_adds_to_an_own_question_is_named_with_the_key_that_matches_it() -> None:
    Path("own.yaml").write_text(OWN, encoding="utf-8")
    data, said = read("own.yaml", "architecture.yaml", rate="1 Hz")
    assert set(data["threads"]) > {"camera", "tracker", "cam.callback_0", "drive.on_stop"}
    [told] = [text for text in said if "of nodes that the problem file does not name" in text]
    assert "added: 5 threads" in told and "cam.callback_0, ns.track.on_image, ns.track.tick, drive.on_lane" in told
    assert "`ros2: {nodes: {THREAD: /cam, THREAD: /ns/track, THREAD: /drive}}`" in told
    assert data["processors"] == {"pc": {"type": "pi"}} and data["processor_types"]["pi"]["cores"] == 4
    assert {body.get("processor", "pc") for body in data["threads"].values()} == {"pc"}
    dse.load(yaml.safe_dump(data))


def test_threads_of_an_own_question_are_matched_by_their_nodes() -> None:
    Path("own.yaml").write_text(OWN + NODES, encoding="utf-8")
    data, said = read("own.yaml", "architecture.yaml", rate="1 Hz")
    assert list(data["threads"]) == ["camera", "tracker", "drive.on_lane", "drive.on_stop"]
    assert data["threads"]["camera"]["period"] == ["20 ms", "50 ms"]
    assert not [text for text in said if "threads.camera.period" in text]  # 50 ms is one of them
    assert [text for text in said if "threads.tracker.period: 10 ms, 40 ms (no source), but 20 ms" in text]
    [told] = [text for text in said if "/ns/track@Subscription(/image) is left out" in text]
    assert told.endswith("(a thread of /ns/track is it where a connection called image ends at it)")
    dse.load(yaml.safe_dump(data))


def test_a_thread_of_an_own_question_is_not_replaced() -> None:
    """It has neither period nor input, but decisions of its own: the only callback of its node is that thread."""
    own = OWN.replace("period: [20 ms, 50 ms]", "dispatch_protocol: sporadic, compute_execution_time: 1 ms")
    Path("own.yaml").write_text(own.replace("processor: pc, period: [10 ms, 40 ms]", "price: 3 EUR") + NODES)
    data, said = read("own.yaml", "architecture.yaml", rate="1 Hz")
    assert data["threads"]["camera"]["compute_execution_time"] == "1 ms"
    assert data["threads"]["camera"]["period"] == "50 ms"
    assert data["threads"]["tracker"]["price"] == "3 EUR" and "ns.track.tick" not in data["threads"]
    assert sum("of /ns/track is it " in text for text in said) == 2


def test_an_executor_does_not_move_threads_of_an_own_question() -> None:
    own = OWN.replace("processors: {pc: {type: pi}}", "processors: {pc: {type: pi}, other: {type: pi}}")
    Path("own.yaml").write_text(own + NODES, encoding="utf-8")
    data, said = read("own.yaml", "architecture.yaml", rate="1 Hz")
    assert data["threads"]["tracker"]["processor"] == "pc" and "executor" not in data["threads"]["tracker"]
    assert data["threads"]["drive.on_lane"]["executor"] == "executor_0"
    assert any("executor_0 does not run tracker: the problem file places them elsewhere" in text for text in said)
    dse.load(yaml.safe_dump(data))
