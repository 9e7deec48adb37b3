"""Launch files and parameter files of ROS 2: the same small system in three languages, and what is not static.

The rules of launch that are tested here (scopes of groups and includes, namespaces, which parameter counts) are those
of the documentation of launch, launch_xml and rcl_yaml_param_parser; the system is our own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

import dse
from dse.cli.main import run

XML = """<launch>
  <arg name="side" default="front"/>
  <arg name="fast" default="false"/>
  <let name="image" value="/$(var side)/image"/>
  <group>
    <push-ros-namespace namespace="$(var side)"/>
    <node pkg="cam" exec="cam_node" name="cam">
      <param from="$(find-pkg-share robot)/config/robot.yaml"/>
      <param name="update_rate" value="50" if="$(var fast)"/>
      <remap from="~/output/image" to="$(var image)"/>
    </node>
    <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
      <composable_node pkg="track" plugin="track::Track" name="track">
        <param from="$(dirname)/../config/robot.yaml"/>
        <remap from="~/input/image" to="$(var image)"/>
        <remap from="~/output/lane" to="/lane"/>
      </composable_node>
      <composable_node pkg="track" plugin="track::Steer" name="steer">
        <remap from="~/input/lane" to="/lane"/>
      </composable_node>
    </node_container>
  </group>
  <node pkg="watch" exec="dog" name="dog" if="$(eval &quot;'$(var side)' == 'rear'&quot;)"/>
  <node pkg="watch" exec="logger" name="logger" unless="$(var fast)"/>
</launch>
"""
YAML = """launch:
- arg: {name: side, default: front}
- arg: {name: fast, default: "false"}
- let: {name: image, value: /$(var side)/image}
- group:
  - push_ros_namespace: {namespace: $(var side)}
  - node:
      pkg: cam
      exec: cam_node
      name: cam
      param:
      - {from: $(find-pkg-share robot)/config/robot.yaml}
      - {name: update_rate, value: "50", if: $(var fast)}
      remap:
      - {from: ~/output/image, to: $(var image)}
  - node_container:
      pkg: rclcpp_components
      exec: component_container
      name: box
      namespace: ""
      composable_node:
      - pkg: track
        plugin: track::Track
        name: track
        param:
        - {from: $(dirname)/../config/robot.yaml}
        remap:
        - {from: ~/input/image, to: $(var image)}
        - {from: ~/output/lane, to: /lane}
      - pkg: track
        plugin: track::Steer
        name: steer
        remap:
        - {from: ~/input/lane, to: /lane}
- node: {pkg: watch, exec: dog, name: dog, if: "$(eval \\"'$(var side)' == 'rear'\\")"}
- node: {pkg: watch, exec: logger, name: logger, unless: $(var fast)}
"""
PYTHON = """import os
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration as Given
from launch.substitutions import PathJoinSubstitution, PythonExpression, ThisLaunchFileDir
from launch_ros.actions import ComposableNodeContainer, Node, PushRosNamespace
from launch_ros.descriptions import ComposableNode

Path("executed").write_text("this file must not be executed")


def cam(context):
    parameters = [os.path.join(get_package_share_directory("robot"), "config", "robot.yaml")]
    if Given("fast").perform(context) == "true":
        parameters += [{"update_rate": 50}]
    return [Node(package="cam", executable="cam_node", name="cam", parameters=parameters,
                 remappings=[("~/output/image", image())])]


def image():
    return ["/", Given("side"), "/image"]


def generate_launch_description():
    lane = f"/{'lane'}"
    arguments = {"side": "front", "fast": "false"}
    box = ComposableNodeContainer(
        package="rclcpp_components", executable="component_container", name="box", namespace="",
        composable_node_descriptions=[
            ComposableNode(package="track", plugin="track::Track", name="track",
                           parameters=[PathJoinSubstitution([ThisLaunchFileDir(), "..", "config", "robot.yaml"])],
                           remappings=[("~/input/image", image()), ("~/output/lane", lane)]),
            ComposableNode(package="track", plugin="track::Steer", name="steer", remappings=[("~/input/lane", lane)]),
        ])
    ld = LaunchDescription([DeclareLaunchArgument(name, default_value=text) for name, text in arguments.items()])
    ld.add_action(GroupAction([PushRosNamespace(Given("side")), OpaqueFunction(function=cam), box]))
    is_rear = PythonExpression(["'", Given("side"), "' == 'rear'"])
    ld.add_action(Node(package="watch", executable="dog", name="dog", condition=IfCondition(is_rear)))
    ld.add_action(Node(package="watch", executable="logger", name="logger",
                       condition=UnlessCondition(Given("fast"))))
    return ld
"""
PARAMETERS = """/**:
  ros__parameters: {use_sim_time: false}
/*/cam:
  ros__parameters:
    update_rate: 20.0
    learning_rate: 0.1
/front/track:
  ros__parameters:
    timer_period_ms: 25
    detector: {fps: 5}
"""
LANGUAGES = {"robot.launch.xml": XML, "robot.launch.yaml": YAML, "robot_launch.py": PYTHON}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with the three launch files and a parameter file; the folder to work in."""
    folder = tmp_path / "src" / "robot"
    for name, text in {**{f"launch/{name}": text for name, text in LANGUAGES.items()}, "config/robot.yaml": PARAMETERS,
                       "package.xml": "<package><name>robot</name></package>"}.items():  # fmt: skip
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return folder


def read(path: Path, **options: str) -> tuple[dict[str, Any], list[str]]:
    found = dse.import_file(path, **options)
    document: dict[str, Any] = yaml.safe_load(found.text)
    return document, [str(item) for item in found.remarks]


@pytest.mark.parametrize("name", LANGUAGES)
def test_a_launch_file_is_a_problem(name: str, package: Path) -> None:
    data, said = read(package / "launch" / name)
    threads = data["threads"]
    assert {key: (body.get("period"), body["process"], body.get("executor")) for key, body in threads.items()} == {
        "front.cam.timer": ("50 ms", "front.cam", None),
        "front.track.timer": ("25 ms", "front.box", "front.box.executor"),
        "front.track.on.front.image": (None, "front.box", "front.box.executor"),
        "front.steer.on.lane": (None, "front.box", "front.box.executor"),
        "logger": (None, "logger", None),
    }
    assert data["executors"]["front.box.executor"]["kind"] == "wait_set"
    ends = {key: (body.get("from"), body["to"]) for key, body in data["connections"].items()}
    assert ends == {
        "front.image": ("front.cam.timer", "front.track.on.front.image"),
        "lane": ("front.track.timer", "front.steer.on.lane"),
    }
    assert data["ros2"] == {
        "nodes": {
            "front.cam": "/front/cam",
            "front.track.timer": "/front/track",
            "front.track.on.front.image": "/front/track",
            "front.steer.on.lane": "/front/steer",
            "logger": "/logger",
        },
        "parameters": {
            "front.cam.timer.rate": "update_rate [Hz]",
            "front.track.timer.period": "timer_period_ms [int ms]",
        },
    }
    assert "update_rate = 20.0 Hz, robot.yaml:5; " in threads["front.cam.timer"]["source"]
    assert any("robot.yaml:5: warning: /front/cam: by its name update_rate is the rate of a timer" in x for x in said)
    assert any(
        "/front/cam: these may be rates or periods of timers, and are not counted: learning_rate" in x for x in said
    )
    assert not Path("executed").exists()
    with pytest.raises(dse.ProblemError, match=r"threads\.logger\.dispatch_protocol: periodic needs a `period`"):
        dse.load(yaml.safe_dump(data))


@pytest.mark.parametrize("name", LANGUAGES)
def test_arguments_and_stated_timers_count(name: str, package: Path) -> None:
    options = {"arguments": "side:=rear, fast:=true", "timers": "update_rate [Hz]"}
    data, _ = read(package / "launch" / name, **options)
    assert {key: body.get("period") for key, body in data["threads"].items()} == {
        "rear.cam.timer": "20 ms",
        "rear.track.on.rear.image": None,
        "rear.steer.on.lane": None,
        "dog": None,
    }
    data, _ = read(package / "launch" / name, timers="/front/track:detector.fps [Hz]")
    assert [body.get("period") for body in data["threads"].values()] == [None, "200 ms", None, None, None]
    data, said = read(package / "launch" / name, timers="*.fps [Hz]", arguments="sid:=rear")
    assert [body.get("period") for body in data["threads"].values()] == [None, "200 ms", None, None, None]
    [told] = [text for text in said if "--arguments" in text]
    assert 'sid: no file that was read has such a launch argument (did you mean "side"?)' in told


def test_the_chosen_rate_goes_back_by_the_name_of_the_parameter(package: Path) -> None:
    """30 Hz are no whole number of nanoseconds; 25 ms are written to the node in its container."""
    (package / "config" / "robot.yaml").write_text(PARAMETERS.replace("20.0", "30"), encoding="utf-8")
    data, _ = read(package / "launch" / "robot.launch.xml", arguments="fast:=false")
    del data["threads"]["logger"], data["ros2"]["nodes"]["logger"]
    result = dse.solve(dse.load(yaml.safe_dump({**data, "objectives": ["minimise price"]})))
    parameters = yaml.safe_load(dse.export(result, 1, "ros2"))
    assert parameters["/front/cam"] == {"ros__parameters": {"update_rate": 30}}
    assert parameters["/front/track"] == {"ros__parameters": {"timer_period_ms": 25}}
    assert set(parameters) == {"/front/cam", "/front/track"}


OPEN = """<launch>
  <arg name="need"/>
  <group if="$(var need)"><node pkg="a" exec="a" name="a"/></group>
  <include file="$(find-pkg-share nowhere)/launch/x.launch.xml"/>
  <node pkg="b" exec="b" name="$(env ROBOT)"/>
  <node pkg="c" exec="$(command 'which c')" name="c"><param from="none.yaml"/></node>
  <executable cmd="roscore"/>
  <wobble/>
</launch>
"""
OPEN_PYTHON = """def generate_launch_description():
    nodes = [Node(package="a", executable="a", name="a")]
    if os.path.exists("/x"):
        nodes.append(Node(package="b", executable="b", name="b"))
    for item in load("x"):
        nodes.append(Node(package="b", executable="b", name=item))
    nodes.append(Node(package="c", executable="c", name=open("x").read()))
    return LaunchDescription(nodes + [make()])
"""


def test_what_is_not_static_is_told_and_marked(tmp_path: Path) -> None:
    path = tmp_path / "open.launch.xml"
    path.write_text(OPEN, encoding="utf-8")
    data, said = read(path)
    assert list(data["threads"]) == ["b", "c"]
    told = "\n".join(text.removeprefix(f"{tmp_path}/open.launch.xml") for text in said)
    for words in (
        ":3: warning: not static, left out: group: the launch argument need is not given (give it: --arguments",
        ":4: warning: not static, left out: include $(find-pkg-share nowhere)/launch/x.launch.xml: the package nowhere",
        ":5: warning: not static, left out: its name (node $(env ROBOT)): the environment variable ROBOT is only known",
        ":5: warning: b has no name: it is taken for b (the node may call itself otherwise: state its `name`)",
        ":6: warning: not static, left out: what it runs (node c): $(command 'which c') is only known at the launch",
        ":6: warning: left out: there is no parameter file none.yaml",
        ":7: warning: left out: executable roscore: nothing says how often it runs",
        ":8: warning: left out: what <wobble> does is not known here",
    ):
        assert words in told
    marked = [text for text in data["assumptions"] if text.startswith("MISSING: what only the launch decides")]
    assert len(marked) == 1 and "open.launch.xml:3: not static, left out: group" in marked[0]
    (tmp_path / "open_launch.py").write_text(OPEN_PYTHON, encoding="utf-8")
    data, said = read(tmp_path / "open_launch.py")
    assert list(data["threads"]) == ["a", "b", "c"]
    told = "\n".join(said)
    for words in (":3: warning: a branch counts as taken: its condition is not followed: what os.path.exists",
                  ":5: warning: not static, left out: what load('x') gives",
                  ":7: warning: not static, left out: its name (node open('x').read()): what",
                  ":8: warning: not static, left out: what make() gives"):  # fmt: skip
        assert words in told


KINDS = {
    "component_container": ({"box.executor": "wait_set"}, "box.executor"),
    "component_container_mt": ({"b.group": "wait_set"}, None),
    "component_container_isolated": ({"b.group": "wait_set"}, None),
    "component_container_callback_isolated": ({"a.group": "callback_group", "b.group": "callback_group"}, "a.group"),
}


@pytest.mark.parametrize("name", KINDS)
def test_containers_are_executors_by_their_kind(name: str, tmp_path: Path) -> None:
    path = tmp_path / "box.launch.xml"
    path.write_text(
        f"""<launch><node_container pkg="p" exec="{name}" name="box"/>
        <load_composable_node target="/box"><composable_node pkg="p" plugin="p::A" name="a">
          <param name="rate" value="10"/></composable_node>
          <composable_node pkg="p" plugin="p::B" name="b">
          <param name="scan"><param name="rate" value="5"/></param><param name="rate" value="1"/></composable_node>
        </load_composable_node></launch>""",
        encoding="utf-8",
    )
    data, _ = read(path)
    kinds, of_a = KINDS[name]
    assert {key: body["kind"] for key, body in data["executors"].items()} == kinds
    assert data["threads"]["a.timer"].get("executor") == of_a
    assert list(data["threads"]) == ["a.timer", "b.timer.scan.rate", "b.timer.rate"]
    assert {body["process"] for body in data["threads"].values()} == {"box"}


def test_a_parameter_file_alone_has_the_nodes_that_it_names(package: Path) -> None:
    data, _ = read(package / "config" / "robot.yaml")
    assert {key: body["period"] for key, body in data["threads"].items()} == {"front.track.timer": "25 ms"}


BAD = {
    "empty": ("x.launch.xml", "", 3, "x.launch.xml:1:"),
    "cut off": ("x.launch.xml", XML[:300], 3, "not XML: "),
    "other root": ("x.launch.xml", "<robot/>", 3, "expected <launch>, got <robot>"),
    "entities": ("x.launch.xml", "<!DOCTYPE a [<!ENTITY b 'c'>]><launch/>", 3, "a document type is not expected here"),
    "no node": ("x.launch.xml", "<launch/>", 3, "x.launch.xml:1: it starts no node"),
    "itself": ("x.launch.xml", '<launch><include file="$(filename)"/></launch>', 3, "x.launch.xml includes itself"),
    "endless": ("x.launch.xml", '<launch><node pkg="a" exec="$(var x" name="$(var x"/></launch>', 3, "does not end"),
    "no list": ("x.launch.yaml", "launch: 1\n", 3, "expected `launch:` and a list of actions"),
    "not YAML": ("x.launch.yaml", "launch: [", 3, "not YAML"),
    "not Python": ("x.launch.py", "def generate_launch_description(:\n", 3, "x.launch.py:1:33: not Python"),
    "no function": ("x.launch.py", "a = 1\n", 3, "it has no function generate_launch_description"),
    "nothing": ("x.launch.py", "def generate_launch_description():\n    return 1\n", 3, "returns no launch"),
    "recursion": ("x.launch.py", "def generate_launch_description():\n    return generate_launch_description()\n", 3,
                  "returns no launch"),
    "no parameters": ("p.yaml", "a: {ros__parameters: 1}\n", 3, "p.yaml:1:22: the parameters of /a are no mapping"),
    "no rate": ("p.yaml", "a: {ros__parameters: {b: 1}}\n", 3, "none of its parameters is the rate or period"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_told(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, text, code, words = BAD[case]
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert run(["import", str(tmp_path / name), "-o", str(tmp_path / "out.yaml")]) == code
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()


def test_wrong_options_are_told(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(package / "launch" / "robot.launch.xml")
    assert run(["import", path, "--timers", "fps [km]"]) == 2
    assert "--timers 'fps [km]': expected the name of a parameter" in capsys.readouterr().err
    assert run(["import", path, "--arguments", "fast"]) == 2
    assert "--arguments fast: expected name:=value" in capsys.readouterr().err
