"""Connections that name their type of ROS message: its size, what is wrong with it, and that a result carries it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import dse
from dse.cli.main import run

PROBLEM = """dse: 1
name: Fusion
messages: {distribution: ros1_noetic}
processor_types: {pc: {}}
bus_types:
  ros_ipc: {virtual: true, transmission_time: {pc: {fixed: 529 us .. 1115 us, per_byte: 87 ns .. 95 ns}}}
processors: {computer: {type: pc}}
buses: {ipc: {type: ros_ipc}}
devices: {imu: {period: [10 ms, 20 ms]}}
threads: {ekf: {processor: computer, compute_execution_time: 1 ms}}
connections:
  data: {from: imu, to: ekf, message: geometry_msgs/PoseArray, lengths: {poses: 32, header.frame_id: 0}, bus: ipc}
flows: {reaction: {path: [imu, ekf]}}
objectives: [minimise latency of reaction, minimise load of ipc]
"""
STATED = "message: geometry_msgs/PoseArray, lengths: {poses: 32, header.frame_id: 0}"
OWN = "messages: {distribution: ros2_humble, definitions: own}"


def put(folder: Path, text: str = PROBLEM) -> str:
    path = folder / "fusion.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_message_is_as_large_as_the_report_measured(tmp_path: Path) -> None:
    """Table 5.3: 32 poses take 1,812 B; everything else is as if that were stated."""
    named = dse.solve(put(tmp_path))
    plain = dse.solve(PROBLEM.replace(STATED, "data_size: 1812 B").replace("messages: {distribution: ros1_noetic}", ""))
    assert [point.objectives for point in named.front] == [point.objectives for point in plain.front]
    assert named.problem.identity == plain.problem.identity


def test_the_rule_of_the_report_counts_an_array_once() -> None:
    text = PROBLEM.replace(STATED, "message: nav_msgs/Odometry").replace("ros1_noetic", "ros2_humble, size: rule")
    assert dse.load(text).loaded.spec.connections["data"].data_size == (152,)


def test_a_result_carries_the_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without rosbags, the definitions and the problem file it is verified, exported and reported all the same."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "Scan.msg").write_text("float32[] ranges\nstring<=4 unit\n", encoding="utf-8")
    text = PROBLEM.replace("messages: {distribution: ros1_noetic}", OWN)
    path = put(tmp_path, text.replace(STATED, "message: own/Scan, lengths: {ranges: 10}"))
    result = str(tmp_path / "fusion.json")
    assert run(["solve", path, "--json", result]) == 0
    size = json.loads(Path(result).read_text(encoding="utf-8"))["files"]["<sizes of messages>"]
    assert json.loads(size) == {"data": 4 + 4 + 40 + 4 + 5}  # CDR: encapsulation, count, floats, length, text with 0
    (tmp_path / "there").mkdir()
    exported = tmp_path / "there" / "chosen.yaml"
    assert run(["export", result, "--alternative", "1", "-o", str(exported)]) == 0
    assert 'definitions: "../own"' in exported.read_text(encoding="utf-8")
    assert run(["check", str(exported)]) == 0
    (tmp_path / "own" / "Scan.msg").unlink()
    Path(path).unlink()
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    assert run(["verify", result]) == 5  # nothing is wrong, but that the file is gone is told


WRONG = {
    "unknown": (STATED, "message: geometry_msgs/PoseArrai", 'did you mean "geometry_msgs/msg/PoseArray"?', ""),
    "open": (STATED, "message: geometry_msgs/PoseArray", "depends on the length of header.frame_id, poses", "state it"),
    "path": ("poses: 32", "pose: 32", "data.lengths.pose: nothing of geometry_msgs/PoseArray", "has header.frame_id"),
    "size too": ("bus: ipc", "data_size: 4 B", "data.data_size: give `message` or `data_size`, not both", ""),
    "rate too": ("bus: ipc", "data_rate: 4 B/s", "data.data_rate: give `message` or `data_rate`, not both", ""),
    "lengths alone": (STATED, "lengths: {a: 1}", "data.lengths: lengths are those of a `message`", ""),
    "negative": ("poses: 32", "poses: -1", "data.lengths.poses: expected a whole number of at least 0, got -1", ""),
    "many": ("poses: 32", "poses: 100000001", "data.lengths.poses: expected a whole number of at most 100,000,000", ""),
    "distribution": ("ros1_noetic", "ros3", "messages.distribution: distribution ros3: there are ros1_noetic", ""),
    "no folder": ("ros1_noetic", "ros1_noetic, definitions: nix", "messages.definitions: no such file", "relative"),
    "rule": ("ros1_noetic", "ros1_noetic, size: rule", "data.lengths: they do not count", ""),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_are_told_with_their_place(name: str, tmp_path: Path) -> None:
    before, after, words, hint = WRONG[name]
    with pytest.raises(dse.ProblemError) as raised:
        dse.load(put(tmp_path, PROBLEM.replace(before, after)))
    [finding] = raised.value.diagnostics
    assert words in str(finding) and hint in finding.hint
    assert finding.line in (3, 12)


def test_every_length_that_is_none_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(dse.ProblemError) as raised:
        dse.load(put(tmp_path, PROBLEM.replace("{poses: 32, header.frame_id: 0}", "{pose: 32, frame_id: 0}")))
    assert [item.path.rpartition(".")[2] for item in raised.value.diagnostics] == ["pose", "frame_id"]


def test_definitions_that_contain_themselves_and_bounds_that_are_broken(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "Ring.msg").write_text("own/Ring[] next\n", encoding="utf-8")
    text = PROBLEM.replace("messages: {distribution: ros1_noetic}", OWN)
    with pytest.raises(dse.ProblemError, match="own/msg/Ring contains itself: own/msg/Ring > own/msg/Ring"):
        dse.load(put(tmp_path, text.replace(STATED, "message: own/Ring")))
    (tmp_path / "own" / "Ring.msg").write_text("string<=4 unit\n", encoding="utf-8")
    with pytest.raises(dse.ProblemError, match=r"data\.lengths\.unit: its bound is 4"):
        dse.load(put(tmp_path, text.replace(STATED, "message: own/Ring, lengths: {unit: 5}")))
    with pytest.raises(dse.ProblemError, match="a text cannot name files of definitions"):
        dse.load(text.replace(STATED, "message: own/Ring, lengths: {unit: 5}"))


def test_without_rosbags_the_command_that_installs_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(dse.ProblemError, match=r"data\.message: .* pip install 'dse-pareto\[ros\]'"):
        dse.load(put(tmp_path, PROBLEM.replace("messages: {distribution: ros1_noetic}", "")))


def test_very_many_elements_count_as_few_do(tmp_path: Path) -> None:
    """Of 7 numbers of 8 B each, after 20 B: none of them is built."""
    problem = dse.load(put(tmp_path, PROBLEM.replace("poses: 32", "poses: 100000000")))
    assert problem.loaded.spec.connections["data"].data_size == (20 + 56 * 10**8,)


def test_a_result_that_lost_its_sizes_says_so(tmp_path: Path) -> None:
    from dse.questions.problem import load_carried

    with pytest.raises(dse.ProblemError, match=r"data\.message: the result does not carry its size"):
        load_carried("fusion.yaml", {"fusion.yaml": PROBLEM})
