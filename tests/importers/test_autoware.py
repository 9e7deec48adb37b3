"""Autoware's system design files: processes, instances, wildcards, bases, modes, groups; the robot is our own."""

from __future__ import annotations

import random
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.cli.main import run
from dse.importers.allowance import allowed
from dse.importers.registry import read_foreign
from dse.support.errors import ProblemError, UsageError
from tests.helpers.effort import LONG, cases

FORMAT = "autoware_system_design_format: 0.3.0\n"
CAMERA = """name: Camera.node
publishers: [{name: image, message_type: m/msg/Image}]
processes:
  - name: grab
    trigger_conditions: [{periodic: 20.0, warn_rate: 10.0}]
    outcomes: [{to_output: image}]
"""
FUSION = """name: Fusion.node
subscribers: [{name: left}, {name: right}, {name: third}, {name: map}]
publishers: [{name: objects}]
processes:
  - name: pair
    trigger_conditions:
      - and:
          - once: map
          - on_input: left
          - or:
              - on_input: right
              - on_input: third
    outcomes: [{to_trigger: track}]
  - name: track
    trigger_conditions:
      - on_trigger: pair
      - periodic: 10.0
    outcomes: [{to_output: objects}]
"""
EYES = """name: Eyes.module
instances:
  - {name: left_camera, entity: Camera.node}
  - {name: right_camera, entity: Camera.node}
subscribers: []
publishers: [{name: left/image}, {name: right/image}]
connections:
  - ["^_camera.publisher.*", "publisher.^/*"]
"""
DRIVE = """name: Drive.node
subscribers: [{name: objects}]
publishers: []
processes:
  - name: steer
    trigger_conditions: [{and: [{periodic: 50.0}, {on_input: objects}]}]
    outcomes: [{terminal: null}]
"""
ROBOT = """name: Robot.system
modes: [{name: runtime, default: true}, {name: blind}]
components:
  - {name: eyes, entity: Eyes.module, path: /sensing/eyes, compute_unit: front_ecu}
  - {name: fusion, entity: Fusion.node, compute_unit: main_ecu}
  - {name: drive, entity: Drive.node, compute_unit: main_ecu}
node_groups:
  - {name: sensing_container, type: ros2_component_container, nodes: [/sensing]}
connections:
  - [eyes.publisher.left/image, fusion.subscriber.left]
  - [fusion.subscriber.right, eyes.publisher.right/image]
  - [fusion.publisher.*, drive.subscriber.*]
blind:
  remove:
    components: [{name: eyes}]
"""
FILES = {
    "node/Camera.node.yaml": CAMERA, "node/Fusion.node.yaml": FUSION, "node/Drive.node.yaml": DRIVE,
    "module/Eyes.module.yaml": EYES, "system/Robot.system.yaml": ROBOT,
}  # fmt: skip


def write(folder: Path, **changed: str) -> Path:
    """The design files of the robot, some with other texts; the path of the system."""
    for name, text in FILES.items():
        path = folder / "design" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(FORMAT + changed.get(path.name.partition(".")[0], text))
    return folder / "design" / "system" / "Robot.system.yaml"


def imported(path: Path, **options: str) -> tuple[dict[str, Any], list[str]]:
    """The document, and the messages of its remarks."""
    found = read_foreign(path, None, options)
    dse.load(dict(found.document))
    return dict(found.document), [item.message for item in found.remarks]


def test_a_system(tmp_path: Path) -> None:
    """Wildcards fill each other, both cameras share their container's executor, the third input leads from nowhere."""
    document, remarks = imported(write(tmp_path))
    threads, wires = document["threads"], document["connections"]
    keys = ("dispatch_protocol", "period", "join", "executor", "processor")
    assert {name: tuple(body.get(key) for key in keys) for name, body in threads.items()} == {
        "sensing.eyes.left_camera.grab": ("periodic", "50 ms", None, "sensing_container", None),
        "sensing.eyes.right_camera.grab": ("periodic", "50 ms", None, "sensing_container", None),
        "fusion.pair": ("aperiodic", None, "all", "fusion", None),
        "fusion.track": ("aperiodic", None, None, "fusion", None),
        "fusion.track.periodic": ("periodic", "100 ms", None, "fusion", None),
        "drive.steer": ("hybrid", "20 ms", "all", None, "main_ecu"),
    }
    assert sorted((body.get("from"), body["to"], body.get("port")) for body in wires.values()) == [
        ("fusion.pair", "fusion.track", None),
        ("fusion.pair", "fusion.track.periodic", "data"),
        ("fusion.track", "drive.steer", None),
        ("fusion.track.periodic", "drive.steer", None),
        ("sensing.eyes.left_camera.grab", "fusion.pair", None),
        ("sensing.eyes.right_camera.grab", "fusion.pair", None),
    ]
    assert set(document["processors"]) == {"front_ecu", "main_ecu"}
    assert threads["sensing.eyes.left_camera.grab"]["process"] == "sensing_container"
    assert remarks == ["track starts in 2 ways: it counts as a thread for each"]


def test_a_node_alone_that_says_how_it_is_launched(tmp_path: Path) -> None:
    """Its key ``launch`` does not make it a launch file: the name tells what it is."""
    path = tmp_path / "Camera.node.yaml"
    path.write_text(FORMAT + CAMERA + "launch:\n  executable: camera_node\n", encoding="utf-8")
    document, _ = imported(path)
    assert {name: body["period"] for name, body in document["threads"].items()} == {"Camera.grab": "50 ms"}


def test_a_mode_without_what_fusion_reads(tmp_path: Path) -> None:
    document, _ = imported(write(tmp_path), mode="blind", rate="20 Hz")
    assert "sensing.eyes.left_camera.grab" not in document["threads"]
    outside = [body["to"] for body in document["connections"].values() if "from" not in body]
    assert set(outside) == {"fusion.pair", "fusion.pair.all"}
    with pytest.raises(UsageError, match="has runtime, blind"):
        imported(write(tmp_path), mode="night")


def test_a_system_based_on_another(tmp_path: Path) -> None:
    """What is removed goes first, with its connections; what is overridden takes the place of its name."""
    path = write(tmp_path)
    other = path.with_name("Other.system.yaml")
    other.write_text(
        f"{FORMAT}name: Other.system\nbase: Robot.system\nremove: {{components: [{{name: drive}}]}}\n"
        "override:\n  components: [{name: eyes, entity: Camera.node, compute_unit: tiny}]\n"
        "  connections: [[eyes.publisher.image, fusion.subscriber.left]]\n"
    )
    document, remarks = imported(other)
    assert set(document["threads"]) == {
        "eyes.grab",
        "fusion.pair",
        "fusion.pair.all",
        "fusion.track",
        "fusion.track.periodic",
    }
    assert document["threads"]["eyes.grab"]["processor"] == "tiny"
    assert sum("no ports are there" in text for text in remarks) == 2


def test_several_threads_of_a_container_are_a_thread_for_each_node(tmp_path: Path) -> None:
    document, remarks = imported(
        write(tmp_path, Robot=ROBOT.replace("component_container,", "component_container_mt,"))
    )
    camera = document["threads"]["sensing.eyes.left_camera.grab"]
    assert (camera["process"], camera.get("processor")) == ("sensing_container", "front_ecu")
    assert any("sensing_container has several threads" in text for text in remarks)


def test_modules_and_nodes_alone(tmp_path: Path) -> None:
    design = write(tmp_path).parents[1]
    assert len(imported(design / "module" / "Eyes.module.yaml")[0]["threads"]) == 2
    assert len(imported(design / "node" / "Camera.node.yaml")[0]["threads"]) == 1


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("Robot", "name: Robot.rocket\n", "expected the name of a node, module or system"),
        ("Robot", "[1", "not YAML"),
    ],
)
def test_what_is_none(name: str, text: str, expected: str, tmp_path: Path) -> None:
    with pytest.raises(ProblemError, match=expected):
        imported(write(tmp_path, **{name: text}))


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("Camera", CAMERA.replace("20.0", "fast"), "`periodic` without what it needs"),
        ("Camera", CAMERA + "base: Camera.node\n", "is based on itself"),
        (
            "Eyes",
            EYES.replace("left_camera, entity: Camera", "left_camera, entity: Lost"),
            "there is no Lost.node.yaml",
        ),
        (
            "Eyes",
            EYES.replace("left_camera, entity: Camera.node", "left_camera, entity: Eyes.module"),
            "nested too deeply",
        ),
        ("Robot", ROBOT.replace("[/sensing]", "[/sensing, /drive]"), "its nodes are on several compute units"),
        ("Robot", ROBOT.replace("eyes.publisher.left/image", "eyes.server.left/image"), "services"),
        ("Fusion", FUSION.replace("on_trigger: pair", "on_trigger: par"), "which is no process of its node"),
    ],
)
def test_what_is_left_out_is_told(name: str, text: str, expected: str, tmp_path: Path) -> None:
    remarks = read_foreign(write(tmp_path, **{name: text})).remarks
    assert any(expected in item.message for item in remarks), [item.message for item in remarks]


def test_instances_that_double_at_each_level_are_too_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not LONG:  # what is allowed takes seconds
        monkeypatch.setattr("dse.importers.autoware.reading.allowed", partial(allowed, 100_000))
    path = write(tmp_path)
    for level in range(18):
        inner = f"Level{level + 1}.module" if level < 17 else "Camera.node"
        body = "".join(f"  - {{name: {name}, entity: {inner}}}\n" for name in "abcd")
        text = f"{FORMAT}name: Level{level}.module\ninstances:\n{body}connections: []\n"
        (path.parents[1] / "module" / f"Level{level}.module.yaml").write_text(text)
    with pytest.raises(ProblemError, match="more than"):
        read_foreign(path.parents[1] / "module" / "Level0.module.yaml")


@pytest.mark.parametrize("seed", cases(40, 1000))
def test_mutated_files_never_crash(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = random.Random(f"autoware {seed}")
    name = rng.choice(list(FILES))
    lines = FILES[name].splitlines(keepends=True)
    for _ in range(rng.choice((1, 2, 4))):
        at = rng.randrange(len(lines))
        words = rng.choice(("", "- a\n", "  name: x\n", lines[rng.randrange(len(lines))], "*\n", "connections: 3\n"))
        lines[at : at + rng.choice((0, 1, 2))] = [words]
        lines = lines or ["\n"]
    path = write(tmp_path, **{Path(name).name.partition(".")[0]: "".join(lines)})
    out = tmp_path / "out.yaml"
    code = run(["import", str(path), "-o", str(out), "--rate", "10 Hz"])
    assert code in (0, 2, 3)
    if code == 0:
        assert run(["check", str(out)]) in (0, 3)
    capsys.readouterr()
