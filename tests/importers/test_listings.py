"""Listings 4.6 and 4.9 of the report: calls, and parameters of components, in AADL and ROS 2."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run
from tests.helpers.documents import ROOT
from tests.importers.test_reading import document

AADL = ROOT / "problems" / "aadl"
FOLDER = ROOT / "problems" / "report"
CONFIG = """
  data config end config;
  data implementation config.i
    subcomponents
      size : data Base_Types::Integer {Data_Model::Integer_Range => 2 .. 50; Data_Model::Initial_Value => ("%s");};
      period : data Base_Types::Float {Data_Model::Real_Range => 0.5 .. 1.5; Data_Model::Measurement_Unit => "m/s";};
      name : data Base_Types::String {Data_Model::Initial_Value => ("left");};
  end config.i;
  thread t end t;
  thread implementation t.i
    subcomponents c : data config.i;
    properties Dispatch_Protocol => Periodic; Period => 10 ms;
  end t.i;
  process p end p;
  process implementation p.i subcomponents t : thread t.i; end p.i;
  system top end top;
  system implementation top.i subcomponents p : process p.i; end top.i;
"""


def test_a_call_in_aadl_is_told_with_what_counts_it(capsys: pytest.CaptureFixture[str]) -> None:
    """8.004 to 25.4 ms: 1 .. 5 + 7 .. 17 + 0.0043 .. 3.4, as in OSATE, which follows no call."""
    assert run(["analyse", str(AADL / "planning.aadl")]) == 0
    [told] = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert "nodes.mission calls nodes.planner: nothing is made of that, as in OSATE" in told
    assert "connection with `from`, `to` and `reply`" in told
    assert dse.analyse(AADL / "planning.aadl").metrics["latency of wanted_to_start"] == 25_400_000


CALL = """
dse: 1
name: planning with its call
of: planning.aadl
profile: dse
devices: {operator: {period: 10 s}}
threads: {nodes.mission: {executor: callbacks}}
executors: {callbacks: {kind: fifo, processor: cpu}}
connections:
  ask: {from: nodes.mission, to: nodes.planner, reply: {compute_execution_time: 1 ms}}
objectives: [minimise latency of wanted_to_start]
"""


def test_a_file_that_decides_states_the_call_of_the_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """926.4 ms: 5 + 17 + 900 of who answers + 1 after the answer + 3.4; the executor goes before the binding."""
    text = (AADL / "planning.aadl").read_text(encoding="utf-8")
    text = text.replace("operator : device operator;", "operator : device operator; cpu : processor cpu;")
    text = text.replace("  system robot\n", "  processor cpu end cpu;\n  system robot\n", 1)
    bound = "-> nodes.f; properties Actual_Processor_Binding => (reference (cpu)) applies to nodes;"
    (tmp_path / "planning.aadl").write_text(text.replace("-> nodes.f;", bound), encoding="utf-8")
    (tmp_path / "p.yaml").write_text(CALL, encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml", processing="execution_time")
    assert result.front[0].metrics["latency of wanted_to_start"] == 926_400_000
    with pytest.raises(dse.UsageError, match="the model has no connection ask"):
        dse.export(result, 1, "aadl")
    for name, hint in (
        ("ask", "a connection of your own states `from` and `to`"),
        ("operator.want", "operator.wanted"),
    ):
        (tmp_path / "p.yaml").write_text(CALL.replace("ask: {from: nodes.mission,", f"{name}: {{"), encoding="utf-8")
        assert run(["check", str(tmp_path / "p.yaml")]) == 3
        assert hint in capsys.readouterr().err


def test_a_file_that_decides_keeps_what_the_model_says_of_parameters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The range of the parameter that it decides, and the other parameters: all of them are exported."""
    path = tmp_path / "p.yaml"
    text = f"dse: 1\nname: p\nof: {AADL / 'localisation_config.aadl'}\nobjectives: [minimise latency of fix]\n"
    text += "threads: {node.localisation: {parameters: {min_vel: {value: [0.1 m/s, 0.5 m/s]}}}}\n"
    path.write_text(text + "rules: [node.localisation.min_dist >= 0.1 m]\n", encoding="utf-8")
    result = dse.solve(path)
    assert yaml.safe_load(dse.export(result, 1, "ros2"))["node_localisation"] == {
        "ros__parameters": {"orientation_buffer_size": 10, "min_dist": 0.2, "min_vel": 0.1}
    }
    path.write_text(text.replace("0.5 m/s", "5 m/s"), encoding="utf-8")
    assert run(["check", str(path)]) == 3
    assert "min_vel.value[1]: 5 m/s is not within 0.05 m/s .. 1 m/s" in capsys.readouterr().err


def test_a_call_comes_back_from_aadl(tmp_path: Path) -> None:
    """On the robot alone: a virtual bus with figures of two types of processors is none in AADL."""
    text = (FOLDER / "request_reply.yaml").read_text(encoding="utf-8")
    text = text.replace("../catalogues", str(AADL.parent / "catalogues"))
    text = text.replace("  planners: {path: [user_interface]}", "  #").replace("[latency of planners <= 1 s]", "[]")
    source = tmp_path / "p.yaml"
    source.write_text(text, encoding="utf-8")
    result = dse.solve(source, processing="execution_time", fix=["base.type = none"])
    (tmp_path / "x.aadl").write_text(dse.export(result, 1, "aadl"), encoding="utf-8")
    again = dse.analyse(tmp_path / "x.aadl")
    for metric in ("latency of wanted_to_plan", "load of ros", "utilisation of robot"):
        assert again.metrics[metric] == result.front[0].metrics[metric]


@pytest.mark.parametrize(("value", "stated"), [("10", "10"), ("60", None), ("many", None)])
def test_data_of_a_thread_with_a_range_are_its_parameters(
    tmp_path: Path, value: str, stated: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    found = document(tmp_path, f"package m public with Base_Types, Data_Model; {CONFIG % value} end m;")
    parameters = found["threads"]["p.t"]["parameters"]
    kept = {name: {key: text for key, text in entry.items() if key != "source"} for name, entry in parameters.items()}
    size = {"range": "2 .. 50"} if stated is None else {"range": "2 .. 50", "value": stated}
    assert kept == {"size": size, "c_period": {"range": "0.5 m/s .. 1.5 m/s"}}


def test_listing_4_9_is_read_and_gives_ros_parameters(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(dse.import_file(AADL / "localisation_config.aadl").text, encoding="utf-8")
    result = dse.solve(tmp_path / "p.yaml", minimise="price")
    [own] = yaml.safe_load(dse.export(result, 1, "ros2")).values()
    assert own == {"ros__parameters": {"orientation_buffer_size": 10, "min_dist": 0.2}}


def test_parameters_are_exported_under_their_names_and_in_the_units_that_are_asked_for() -> None:
    text = (FOLDER / "component_parameters.yaml").read_text(encoding="utf-8")
    text = text.replace("include: ../catalogues/platforms.yaml", "processor_types: {RT101: {}}")
    named = "parameters: {gnss_localisation.min_dist: 'dist_cm [int cm]', gnss_localisation.period: period}"
    result = dse.solve(dse.loads(text.replace("ros2:\n", f"ros2:\n  {named}\n")))
    own = yaml.safe_load(dse.export(result, result.front[0].id, "ros2"))["/gnss_localisation"]["ros__parameters"]
    assert own == {"dist_cm": 20, "period": 0.05, "orientation_buffer_size": 10, "min_vel": 0.2}


def test_a_service_in_an_executors_configuration_is_told_with_who_has_a_client(tmp_path: Path) -> None:
    groups = ["/plan@Service(/get_plan)", "/mission@Timer(100000000)@Client(/get_plan)"]
    entries = [{"id": text, "affinity": None, "policy": "SCHED_OTHER", "priority": 0} for text in groups]
    path = tmp_path / "cie.yaml"
    path.write_text(yaml.safe_dump({"callback_groups": entries, "non_ros_threads": []}), encoding="utf-8")
    told = [item.message for item in dse.import_file(path).remarks if "get_plan" in item.message]
    assert told == ["/get_plan of /plan is left out: nothing says which callback of /mission calls it, and how often"]
