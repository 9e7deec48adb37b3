"""The AADL models of ECE-TR-25 in problems/aadl give its tables, row by row; its listings parse as they are printed."""

from __future__ import annotations

import csv
from decimal import ROUND_HALF_UP, Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import dse
from dse.importers.aadl.syntax.parser import parse

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "problems" / "aadl"
MS = 10**6


def table(name: str) -> list[dict[str, str]]:
    with (ROOT / "problems" / "report" / "tables" / f"{name}.csv").open(encoding="utf-8") as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


def printed(value_ns: Any, cell: str) -> str:
    digits = len(cell.partition(".")[2])
    exact = Decimal(Fraction(value_ns).numerator) / Decimal(Fraction(value_ns).denominator) / MS
    return str(exact.quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP))


ET: dict[str, Any] = {"worst_case": "execution_time"}
DL: dict[str, Any] = {"worst_case": "deadline"}
NOTHING: dict[str, Any] = {}
TABLES = [
    ("table_2_1", "inmark_chapter2", "inmark_full.gnss_flow", "f_gnss_lat", ET),
    ("table_2_2", "inmark_chapter2", "inmark_full.gnss_flow2", "f_gnss_lat", ET),
    ("table_3_4", "inmark_chapter3", None, "f_io_cmd", ET),
    ("table_3_5", "inmark_chapter3", None, "f_gnss_lat", ET),
    ("table_5_7", "inmark_software", "software.rt101", "chain", DL),
    ("table_5_9", "inmark_software", "software.spectra", "chain", DL),
]


@pytest.mark.parametrize(("name", "file", "root", "flow", "asked"), TABLES)
def test_latency_tables(name: str, file: str, root: str | None, flow: str, asked: dict[str, Any]) -> None:
    analysis = dse.analyse(dse.Model(MODELS / f"{file}.aadl", root), profile="osate-2.2", **asked)
    found = next(item for item in analysis.flows if item.name == flow)
    rows = [row for row in found.rows if row.contributor not in ("serial_driver", "io_driver")]
    *cells, total = table(name)
    for key in ("min", "max"):
        methods = [getattr(row, f"{key}_method") for row in rows]
        assert methods == [cell[f"{key}_method"] for cell in cells]
    assert [row.category for row in rows] == [cell["kind"] for cell in cells]
    for row, cell in zip(rows, cells, strict=True):
        for key in ("min", "max"):
            value, text = getattr(row, f"{key}_ns"), cell[f"{key}_ms"]
            slack = 0 if printed(value, text) == text else 10 ** -len(text.partition(".")[2])
            # some cells of 5.7 and 5.9 are cut or come of unrounded fits: within their last digit
            assert abs(float(value) / MS - float(text)) <= slack * 1.001 + 10 ** -len(text.partition(".")[2]) / 2, cell
            assert not slack or name in ("table_5_7", "table_5_9"), cell
    for key, value in (("min", found.min_ns), ("max", found.max_ns)):
        assert printed(value, total[f"{key}_ms"]) == total[f"{key}_ms"]


def test_bus_tables() -> None:
    analysis = dse.analyse(MODELS / "inmark_chapter3.aadl")
    for name in ("table_3_1", "table_3_2", "table_3_3"):
        cells = {cell["source"]: Fraction(cell["actual_KBytesps"]) * 1000 for cell in table(name)}
        bus = next(item for item in analysis.buses if item.name == table(name)[0]["bus"])
        total, available = cells.pop("TOTAL"), cells.pop("AVAILABLE")
        assert {key: value for key, value in bus.shares.items() if value} == cells
        assert (sum(bus.shares.values()), bus.capacity) == (total, available)


def test_the_search_finds_the_improvement_of_the_report_and_better_ones() -> None:
    """Listing 2.3 has 115.7 ms of jitter; the front has that at no change but the dispatch protocol, and less."""
    front = dse.solve(MODELS / "inmark_chapter2.yaml").front
    found = {point.objectives["changes"]: point.objectives["jitter of f_gnss_lat"] for point in front}
    assert found == {1: 115_700_000, 2: 75_700_000, 3: 65_700_000, 4: 55_700_000}
    first = next(point for point in front if point.objectives["changes"] == 1)
    assert first.decisions["sw.localisation_subsystem.gnss_provider.dispatch_protocol"] == "aperiodic"


# --- listings, as printed but for what the scan garbled ------------------------------------------------------------

LISTINGS = {
    "2.2": """
system implementation inmark_full.gnss_flow
  subcomponents
    sw : system robots :: ci_base_robot :: generic_rtk_gnss_robot_diff_drive.std;
    gnss : device devices :: gnss :: gnss_leica_mojo3_v2;
    hw_dummy : device dummy;
  connections
    c1: port gnss.position -> sw.gnss_in;
    c2 : port sw.tool_out -> hw_dummy.tool_in;
  flows
    f_gnss_lat : end to end flow gnss.output -> c1 ->
      sw.f_gnss_tc -> c2 -> hw_dummy.input
      {Latency => 1 ms .. 12 ms;};
  properties
    Compute_Execution_Time => 1100 us .. 1800 us applies to
      sw.localisation_subsystem.gnss_provider;
    Period => 20 ms applies to
      sw.navigation_subsystem.nav_controller
      sw.navigation_subsystem.implement_controller,
      hw_dummy;
end inmark_full.gnss_flow;""",
    "3.1": """
bus can
end can;
bus implementation can.c125
properties
   SEI::BandWidthCapacity => 125000.0 bitsps;
   Latency => 1 us .. 1084 us;
   Transmission_Time => [ Fixed => 256 us .. 256 us;
        PerByte => 64 us .. 88 us; ];
end can.c125;""",
    "3.2": """
feature group canopen_dsp401_motor_plug
features
    rpdo_1 : in event data port canopen_dsp401_pdo.r1;
    tpdo_1 : out event data port canopen_dsp401_pdo.t1;
    tpdo_2 : out event data port canopen_dsp401_pdo.t2;
    sdo_req : in event data port canopen_dsp401_sdo.i;
    sdo_rep : out event data port canopen_dsp401_sdo.i;
end canopen_dsp401_motor_plug;
data implementation canopen_dsp401_pdo.t1
    subcomponents
    cob : data Base_Types::Unsigned_32;
    status_word : data Base_Types::Unsigned_16;
    properties
    Data_Size => 6 Bytes;
end canopen_dsp401_pdo.t1;""",
    "4.4": """
thread periodic_component
  features
    cmd msg in : in event data port
      middleware :: ros :: geometry_msgs :: TwistStamped ;
  properties
    Dispatch_Protocol => Periodic;
    Period => 100 ms;
end periodic_component;
thread asynchronous_component
  features
    cmd_msg_in : in event data port
      middleware :: ros :: geometry_msgs :: TwistStamped ;
  properties
    Dispatch_Protocol => Aperiodic;
    Dispatch_Trigger => (reference(cmd_msg_in));
end asynchronous_component;""".replace("cmd msg in", "cmd_msg_in"),
    "4.5": """
thread gnss_localisation extends interfaces::localisation::gnss_pose_provider
features
gnss_in : refined to in event data port middleware::ros::msgs::gpgga_tranmerc;
pose_out : refined to out event data port middleware::ros::nav_msgs::Odometry;
reset : refined to in event data port middleware::ros::std_msgs::Bool;
status_out :refined to out event data port middleware::ros::std_msgs::Bool;
end gnss_localisation;
thread implementation gnss_localisation.std
subcomponents
config : data gnss_localisation_config.impl;
properties
Dispatch_Protocol => Periodic;
end gnss_localisation.std;""",
    "4.6": """
package planning
public
with interfaces::planning;
thread field_plan_generator extends
    interfaces::planning::plan_provider
    features
        get_plan : refined to provides subprogram access
        interfaces::planning::get_plan;
        get_planners : refined to provides subprogram access
        interfaces::planning::list_planners;
end field_plan_generator;
end planning;""",
    "4.7": """
virtual bus ros_ipc
properties
SEI::BandWidthCapacity => 10.0 GBytesps;
Latency => 2 us .. 1 ms;
Transmission_Time => [Fixed => 1 us .. 20 us;
PerByte => 1 ns .. 1 ns;];
end ros_ipc;""",
    "4.8": """
data Imu
properties
    Data_Size => 128 Bytes;
end Imu;
data implementation Imu.impl
subcomponents
linear_acceleration_covariance : data Base_Types::Float_64[];
orientation : data middleware::ros::geometry_msgs::Quaternion.impl;
header : data middleware::ros::std_msgs::Header.impl;
end Imu.impl;""",
    "4.9": """
data gnss_localisation_config
end gnss_localisation_config;
data implementation gnss_localisation_config.impl
subcomponents
orientation_buffer_size : data Base_Types::Integer {
    Data_Model::Integer_Range => 2 .. 50;};
min_dist : data Base_Types::Float {
    Data_Model::Real_Range => 0.04 .. 1.5;
    Data_Model::Measurement_Unit => "m";};
end gnss_localisation_config.impl;""",
}
"""ECE-TR-25; Listing 2.2 with the comma that it misses. Listings 2.1, 2.3, 3.3 and 3.4 are in problems/aadl."""


@pytest.mark.parametrize("number", LISTINGS)
def test_listings_parse(number: str) -> None:
    parsed = parse(LISTINGS[number], "listing.aadl")
    assert not parsed.findings
    assert parsed.unit.packages[0].classifiers
    said = [item.message for item in parsed.remarks if "package" not in item.message]
    assert said == (["expected a comma before this path: read as if there were one"] if number == "2.2" else [])


def test_a_model_alone_has_the_preferences_of_osate() -> None:
    """AS-MF-DL-EQ-EQL since December 2016: the worst case is the deadline unless something else is said."""
    model = dse.Model(MODELS / "inmark_chapter3.aadl")
    alone, deadline, execution = (dse.analyse(model, profile="osate-2.2", **asked) for asked in (NOTHING, DL, ET))
    assert alone.metrics == deadline.metrics != execution.metrics
