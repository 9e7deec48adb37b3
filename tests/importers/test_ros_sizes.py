"""Sizes of ROS messages: the report's rule, what rosbags serialises, definitions and bags of all kinds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import dse
from dse.cli.main import run
from tests.answers.written import write_bag

TABLE_5_3 = {1: 76, 2: 132, 32: 1812, 1024: 57364}
"""Poses, and the bytes that the report measured (PoseArray of ROS 1)."""
COMMON = ("std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "diagnostic_msgs", "shape_msgs", "trajectory_msgs")


def test_the_reports_rule_gives_the_reports_sizes() -> None:
    found = {item.name: item.rule for item in dse.sizes("sensor_msgs/Imu", "nav_msgs/Odometry").types}
    assert found == {"sensor_msgs/msg/Imu": 128, "nav_msgs/msg/Odometry": 152}


def test_pose_arrays_take_what_the_report_measured() -> None:
    for poses, size in TABLE_5_3.items():
        [item] = dse.sizes("geometry_msgs/PoseArray", lengths={"poses": poses}, distribution="ros1_noetic").types
        assert (item.stated, item.most) == (size, None)


def filled(store: Any, name: str, count: int) -> Any:
    """A message with `count` of everything that has a length, made field by field."""
    values: dict[str, Any] = {}
    for field, (kind, what) in store.fielddefs[name][1]:
        values[field] = one(store, (kind, what), count)
    return store.types[name](**values)


def one(store: Any, node: Any, count: int) -> Any:
    kind, what = node
    if kind == Nodetype.NAME:
        return filled(store, what, count)
    if kind == Nodetype.BASE:
        return "y" * count if what[0] == "string" else False if what[0] == "bool" else 1
    (inner, base), bound = what
    number = bound if kind == Nodetype.ARRAY else min(count, bound or count)
    if inner == Nodetype.BASE and base[0] != "string":
        kinds = {"byte": np.uint8, "char": np.uint8}
        return np.ones(number, dtype=kinds.get(base[0], base[0]))
    return [one(store, (inner, base), count) for _ in range(number)]


@pytest.mark.parametrize("distribution", ["ros1_noetic", "ros2_foxy", "ros2_humble", "ros2_jazzy"])
def test_every_type_of_the_common_interfaces_has_the_size_that_is_serialised(distribution: str) -> None:
    store = get_typestore(Stores(distribution))
    serialise = store.serialize_ros1 if distribution.startswith("ros1") else store.serialize_cdr
    names = [name for name in store.fielddefs if name.startswith(COMMON)]
    assert len(names) > 80
    from dse.importers.ros2.messages import Types

    types = Types(distribution)
    for name in names:
        assert types.size(name, {}) == len(serialise(filled(store, name, 0), name)), name
        lengths = dict.fromkeys(types.places(name), 3)
        assert types.size(name, lengths) == len(serialise(filled(store, name, 3), name)), name


def put(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_workspace_of_definitions(tmp_path: Path) -> None:
    put(
        tmp_path,
        "src/my_msgs/msg/Beam.msg",
        "std_msgs/Header header\nfloat32[<=4] ranges\nstring<=10 name\nHit[2] hits\n",
    )
    put(tmp_path, "src/my_msgs/msg/Hit.msg", "# a point\nuint8 kind\nint64 when\nuint8 NEAR=1\n")
    put(tmp_path, "src/my_msgs/srv/Ask.srv", "int32 a\n---\nstring answer\n")
    put(tmp_path, "src/my_msgs/srv/Poke.srv", "---\nbool done\n")
    put(tmp_path, "src/my_msgs/action/Go.action", "float64 to\n---\nbool there\n---\nfloat64 rest\n")
    put(
        tmp_path,
        "src/other/msg/Pair.idl",
        "module other { module msg { struct Pair { double one; sequence<long, 3> two; }; }; };",
    )
    found = {item.name: item for item in dse.sizes(definitions=[tmp_path]).types}
    assert set(found) == {
        *("my_msgs/msg/Beam", "my_msgs/msg/Hit", "my_msgs/srv/Ask_Request", "my_msgs/srv/Ask_Response"),
        *("my_msgs/srv/Poke_Request", "my_msgs/srv/Poke_Response", "other/msg/Pair"),
        *("my_msgs/action/Go_Goal", "my_msgs/action/Go_Result", "my_msgs/action/Go_Feedback"),
    }
    assert found["my_msgs/msg/Hit"].least == found["my_msgs/msg/Hit"].most == 4 + 8 + 8
    assert found["my_msgs/msg/Beam"].rule == 24 + 4 + 8 + 9 and found["my_msgs/msg/Beam"].most is None
    assert found["other/msg/Pair"].most == 4 + 8 + 4 + 3 * 4
    [beam] = dse.sizes("my_msgs/Beam", definitions=[tmp_path], lengths={"ranges": 4, "name": 2}).types
    assert beam.stated == beam.least + 4 * 4  # the letters go where bytes were left for the next field


BAD = {
    "itself": ("my/msg/A.msg", "my/A[] more\n", "A.msg:1: my/msg/A contains itself: my/msg/A > my/msg/A"),
    "unknown": (
        "my/msg/A.msg",
        "my/Nothing b\n",
        "A.msg:1: the type my/msg/Nothing, which my/msg/A has, is not defined",
    ),
    "cut off": ("my/msg/A.msg", "int32 a\nfloat6", "A.msg:2: no definition of a message: "),
    "no definition": ("my/msg/A.msg", "int32 a\n%&/ ?\n", "A.msg:2: no definition of a message: "),
    "service of one part": ("my/srv/A.srv", "int32 a\n", "A.srv:1: no definition of a message: expected 2 parts"),
    "idl": ("my/msg/A.idl", "module my {", "A.idl:1: no definition of a message: "),
}


@pytest.mark.parametrize("name", BAD)
def test_definitions_that_are_none(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, text, message = BAD[name]
    put(tmp_path, file, text)
    assert run(["sizes", "--definitions", str(tmp_path), "--json", str(tmp_path / "o.json")]) == 3
    said = capsys.readouterr().err
    assert message in said, said
    assert not (tmp_path / "o.json").exists()


def test_the_package_is_called_as_its_package_xml_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    put(tmp_path, "my-robot/msg/Frame.msg", "uint8[] data\n")
    assert run(["sizes", "--definitions", str(tmp_path)]) == 3
    assert (
        "Frame.msg: 'my-robot' cannot be the name of a package with messages (a package.xml" in capsys.readouterr().err
    )
    put(tmp_path, "my-robot/package.xml", "<package><name>my_robot</name></package>")
    put(tmp_path, "my-robot/msg/sub/Deep.msg", "Frame frame\n")
    found = dse.sizes(definitions=[tmp_path]).types
    assert [item.name for item in found] == ["my_robot/msg/Deep", "my_robot/msg/Frame"]


def test_only_what_is_asked_for_has_to_be_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    put(tmp_path, "my/msg/A.msg", "float32 x\n")
    put(tmp_path, "my/msg/B.msg", "geographic_msgs/GeoPose p\n")
    put(tmp_path, "my/msg/C.msg", "A a\n")
    put(tmp_path, "my/msg/D.msg", "B[] b\n")
    put(tmp_path, "other/msg/E.msg", "int32 a\n%&/ ?\n")
    put(tmp_path, "other/msg/F.msg", "E e\n")
    assert [item.least for item in dse.sizes("my/A", "my/C", definitions=[tmp_path]).types] == [8, 8]
    foreign = "B.msg:1: the type geographic_msgs/msg/GeoPose, which my/msg/B has, is not defined (name the types that"
    broken = "E.msg:2: no definition of a message"
    wanted = {"my/B": (foreign, broken), "my/D": (foreign, broken), "other/F": (broken,), "other/E": (broken,)}
    for name, messages in wanted.items():
        assert run(["sizes", name, "--definitions", str(tmp_path)]) == 3
        said = capsys.readouterr().err
        assert all(message in said for message in messages) and ("Geo" in said) == (name in ("my/B", "my/D")), said
    assert run(["sizes", "--definitions", str(tmp_path)]) == 3
    said = capsys.readouterr().err
    assert foreign in said and broken in said
    assert run(["sizes", "my/Absent", "--definitions", str(tmp_path)]) == 3


def test_other_encodings_and_empty_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sizes", "--definitions", str(tmp_path)]) == 3
    assert "there is no file of definitions in this folder (.msg, .srv, .action, .idl)" in capsys.readouterr().err
    (tmp_path / "A.msg").write_bytes("int32 a\n".encode("utf-16"))
    assert run(["sizes", "--definitions", str(tmp_path)]) == 3
    assert "A.msg: the file is not UTF-8 text" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["sensor_msgs/Imv"],
            "there is no message type 'sensor_msgs/Imv'; did you mean \"sensor_msgs/msg/Imu\"?",
        ),
        (
            ["std_msgs/String", "--length", "text=3"],
            "--length text: nothing of that path has a length; std_msgs/msg/String",
        ),
        (["std_msgs/String", "--length", "data=999999999"], "--length data=999999999: from 0 to 100000000"),
        (["--distribution", "ros3"], "--distribution ros3: there are ros1_noetic, ros2_dashing"),
        (["shape_msgs/SolidPrimitive", "--length", "dimensions=4"], "--length dimensions=4: its bound is 3"),
    ],
)
def test_wrong_use(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sizes", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_bag_of_ros_1_tells_sizes_and_rates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(tmp_path / "a.bag")
    [topic] = dse.sizes(bags=[tmp_path / "a.bag"]).topics
    assert (topic.name, topic.type, topic.count) == ("/chatter", "std_msgs/msg/String", 3)
    assert (topic.least, topic.most, topic.mean) == (4, 6, 5)
    assert (topic.shortest_ns, topic.longest_ns, topic.mean_ns) == (10_000_000, 20_000_000, 15_000_000)
    assert run(["sizes", "--bag", str(tmp_path / "a.bag")]) == 0
    assert "15 ms" in capsys.readouterr().out


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_bags_of_ros_2(plugin: StoragePlugin, tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(tmp_path / "bag", version=8, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        for stamp_ns in range(3):
            writer.write(
                connection, stamp_ns, store.serialize_cdr(filled(store, "sensor_msgs/msg/Imu", 0), connection.msgtype)
            )
    [topic] = dse.sizes(bags=[tmp_path / "bag"]).topics
    assert (topic.least, topic.most, topic.count) == (316, 316, 3)


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "a.db3"])
@pytest.mark.parametrize("share", [0, 2, 10])
def test_bags_that_are_cut_off(name: str, share: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(tmp_path / "whole.bag")
    data = (tmp_path / "whole.bag").read_bytes()
    (tmp_path / name).write_bytes(data[: len(data) * share // 10 - (share == 10)])
    assert run(["sizes", "--bag", str(tmp_path / name)]) == 3
    assert f"{name}: no bag that can be read: " in capsys.readouterr().err


def test_without_rosbags(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "rosbags"]:
        monkeypatch.setitem(sys.modules, name, None)
    assert run(["sizes", "std_msgs/String"]) == 2
    assert (
        "The size of a ROS message needs rosbags, the extra `ros`: pip install 'dse-pareto[ros]'"
        in capsys.readouterr().err
    )
