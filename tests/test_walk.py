"""The walk through ECE-TR-25 (`python -m tests.walk`), its page, and the problems beside the tables."""

from __future__ import annotations

import re
import shlex
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.support.errors import EXIT_NO
from tests.walk import COMMANDS, EXPECTED, ROOT, TABLES, Figure, answer, main, rounded, table, walk

FOLDER = ROOT / "problems" / "report"
PAGE = (ROOT / "docs" / "report.md").read_text(encoding="utf-8")


def test_every_figure_is_equal_or_differs_for_a_known_reason() -> None:
    figures = list(walk())
    assert [str(figure) for figure in figures if not figure.is_as_said] == []
    assert {(figure.place, figure.what) for figure in figures if not figure.is_equal} == set(EXPECTED)
    tables = {f"Table {path.stem.removeprefix('table_').replace('_', '.')}" for path in TABLES.glob("table_*.csv")}
    assert {"Table 5.3"} == tables - {figure.place for figure in figures}  # the input of Table 5.6
    said = re.search(r"(\d+) of (\d+) figures are equal", PAGE)
    assert said is not None
    assert [int(text) for text in said.groups()] == [sum(figure.is_equal for figure in figures), len(figures)]


NUMBERED = {
    "Table": ("2.1-2.2", "3.1-3.5", "5.1-5.9"),
    "Listing": ("2.1-2.3", "3.1-3.4", "4.1-4.9"),
    "Figure": ("2.1-2.3", "3.1-3.2", "4.1-4.1", "5.1-5.8"),
}
"""What the report numbers; the figures of chapter 1 are pictures."""


def test_the_page_has_every_table_listing_and_figure_of_the_report() -> None:
    for kind, ranges in NUMBERED.items():
        found = set()
        for listed in re.findall(rf"\b{kind}s? ((?:\d\.\d(?:, | and | to )?)+)", PAGE):
            for first, last in re.findall(r"(\d\.\d)(?: to (\d\.\d))?", listed):
                found |= {f"{first[0]}.{number}" for number in range(int(first[-1]), int((last or first)[-1]) + 1)}
        for part in ranges:
            first, last = part.split("-")
            assert found >= {f"{first[0]}.{number}" for number in range(int(first[-1]), int(last[-1]) + 1)}, (
                kind,
                part,
            )


def test_the_page_has_every_command_of_the_walk() -> None:
    for command in COMMANDS:
        assert f"dse {command}" in PAGE, command


def test_the_walk_fails_where_a_figure_is_not_as_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = Figure("Table 2.1", "row 1 max_ms", "0.0", "0.1")
    monkeypatch.setattr("tests.walk.walk", lambda: iter([wrong]))
    assert main(["--brief"]) == 1
    assert "not as said: different  Table 2.1, row 1 max_ms: 0.0 in the report, 0.1 here" in capsys.readouterr().out
    gone = Figure("Section 5.5.2", "jitter of Table 5.7, ms", "43", "43")  # said to differ
    assert gone.is_equal and not gone.is_as_said


def test_halves_are_rounded_up() -> None:
    assert [rounded(Fraction(text), "0.00") for text in ("0.005", "0.0149", "1/3")] == ["0.01", "0.01", "0.33"]


@pytest.mark.parametrize("command", sorted({*re.findall(r"`dse ([a-z][^`]*)`", PAGE)} - {*COMMANDS}))
def test_every_other_command_of_the_page_runs(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [str(ROOT / word) if word.startswith("problems/") else word for word in shlex.split(command)]
    is_broken = words[0] == "explain" or "inmark_full.gnss_flow2" in words  # the 12 ms of Listing 2.2
    assert len(words) == 1 or run(words) == (EXIT_NO if is_broken else 0)
    assert "Traceback" not in "".join(capsys.readouterr())


PROBLEMS = ["ethernet", "remote", "budgets", "power", "middleware", "differential_odometry", "shared_state"]
PROBLEMS += ["request_reply", "component_parameters", "can_messages"]


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_problem_of_the_report_is_solved(name: str) -> None:
    result = dse.solve(FOLDER / f"{name}.yaml")
    assert result.status == "complete" and result.front
    assert dse.analyse(FOLDER / f"{name}.yaml").is_feasible
    assert {path.stem for path in FOLDER.glob("*.yaml")} == {*PROBLEMS}


def test_what_the_page_says_that_dse_adds() -> None:
    front = sorted(
        (
            float(point.objectives["jitter of f_gnss_lat"] / 10**6),
            float(point.objectives["utilisation of computer"] / 10**4),
        )
        for point in dse.solve(ROOT / "problems" / "inmark_chapter2.yaml").front
    )
    assert len(front) == 6 and front[0] == (55.7, 39.8) and (115.7, 11.8) in front
    assert len(dse.solve(ROOT / "problems" / "inmark.yaml", max_jitter="20 ms").front) == 15
    for computer, jitter in (("RT101", "53.436"), ("Spectra", "45.489")):
        found = dse.analyse(ROOT / "problems" / "inmark.yaml", {"computer.type": computer}, processing="execution_time")
        assert rounded(Fraction(found.metrics["jitter of software_chain"]) / 10**6, "0.000") == jitter
        assert f"{jitter} ms" in PAGE


def test_what_the_page_says_of_the_messages_of_table_3_1() -> None:
    """Each row has the printed data rate; the command takes what Table 3.4 says where nothing waits.

    Else three frames of 12 B and two of 10 B go first, and one of 12 B has begun.
    """
    path = FOLDER / "can_messages.yaml"
    rows = {row["source"]: Fraction(row["actual_KBytesps"]) * 1000 for row in table("3_1")}
    sent = {item.name: item.data_rate for item in dse.load(path).space.connections}
    assert sent == {name: rate for name, rate in rows.items() if name in sent} and len(sent) == 12
    reported = {"canbus0.type": "can_125k", "io_dummy.io_conn.rpdo1.identifier": "0x203"}
    for queuing, worst_us in (("not_counted", 2_612), ("counted", 2_612 + 4 * 1_312 + 2 * 1_136)):
        found = dse.analyse(path, reported, bus_queuing=queuing)
        assert found.metrics["latency of f_io_cmd"] == worst_us * 1000
        assert found.metrics["load of canbus0"] == 2_920
    solved = [
        point.objectives["latency of f_io_cmd"] for point in dse.solve(path).front if point.objectives["price"] == 2000
    ]
    assert solved == [3_924_000]
    assert all(text in PAGE for text in ("7.52 ms", "10.132 ms", "3.924 ms"))


def test_what_the_page_says_of_the_listings_of_chapter_4() -> None:
    shared, called, set_up = (dse.solve(FOLDER / f"{name}.yaml") for name in
                              ("shared_state", "request_reply", "component_parameters"))  # fmt: skip
    asked = "max(latency)"
    slow = [point for point in shared.front if point.decisions["main_loop.period"] == "20 ms"]
    found = [
        dse.analyse(FOLDER / "shared_state.yaml").metrics[f"latency of {side}_to_pose"] for side in ("left", "right")
    ]
    assert [slow[0].objectives[asked], max(found)] == [27_630_000, 30_600_000]
    assert [round(point.objectives["latency of wanted_to_plan"] / 10**6) for point in called.front] == [254, 962]
    assert len(set_up.front) == 3
    assert all(text in PAGE for text in ("30.60 to 27.63 ms", "within 254 ms", "within 962 ms"))


def test_the_estimate_of_section_5_1_is_what_a_serial_line_and_a_bridge_carry() -> None:
    found = {bus.name: bus for bus in dse.analyse(FOLDER / "ethernet.yaml").buses}
    assert (sum(found["ser0"].shares.values()), sum(found["eth0"].shares.values())) == (1200, 4560)


def test_a_remote_message_costs_half_of_table_5_6_at_each_end_and_the_wire() -> None:
    """152 B from the Spectra to the RT101; on the wire 230 B at 1 Gbit/s; its overhead counts in the sender's bytes."""
    analysis = dse.analyse(FOLDER / "remote.yaml")
    wire = Fraction((152 + 78) * 8)  # ns at 1 Gbit/s
    sent = Fraction("147500") + 5 * (152 + 78)
    received = Fraction("557500") + Fraction("47.5") * 152
    assert analysis.metrics["latency of remote"] == sent + received + wire


def test_a_budget_that_is_too_small_is_told() -> None:
    """ekf_fusion at 20 ms needs 3 / 20 of 2,500 MIPS: 375, where its budget is 200."""
    path = FOLDER / "budgets.yaml"
    assert not [item for item in dse.analyse(path).resources if "ekf_fusion" in str(item) and "error" in str(item)]
    assert "375" in str(dse.analyse(path, {"ekf_fusion.period": "20 ms"}).resources)


def test_the_power_of_the_system_is_that_of_its_parts() -> None:
    """RT101 5 W, GNSS 4.5 W, IMU 1 W, two motors of 6 W, IO box 2.5 W."""
    assert dse.analyse(FOLDER / "power.yaml").metrics["power"] == 5_000 + 4_500 + 1_000 + 2 * 6_000 + 2_500


def test_the_shape_of_figure_5_7_is_noticed() -> None:
    [found] = dse.fit(FOLDER / "sweep.csv", round_trip=True).transports
    assert "spread" in {remark.kind for remark in found.remarks}
    assert found.sizes_bytes == (76, 2820)


def test_the_catalogue_of_middlewares_is_what_the_figures_give() -> None:
    written = (FOLDER.parent / "catalogues" / "rmw_rpi4b.yaml").read_text(encoding="utf-8")
    fitted = dse.fit(FOLDER / "rmw_rpi4b.csv")
    for item in fitted.transports:
        assert item.transport in written
        low, high = item.fixed_ns
        assert f"{float(low) / 1000:.1f} us .. {float(high) / 1000:.1f} us" in written


HEADERS = [
    (path, *found)
    for path in sorted((ROOT / "problems").rglob("*.aadl"))
    for found in re.findall(r"^-- +dse (analyse \S.*?) +Table (\S+)$", path.read_text(encoding="utf-8"), re.M)
]


@pytest.mark.parametrize(("path", "command", "number"), HEADERS, ids=[number for _, _, number in HEADERS])
def test_the_header_of_a_model_names_the_command_that_gives_its_table(path: Path, command: str, number: str) -> None:
    words = [str(path) if word == path.name else word for word in command.split()]
    total = table(number)[-1]
    [flow] = answer(" ".join(words))["flows"].values()
    rows = [row for row in flow["rows"] if row["contributor"] not in ("serial_driver", "io_driver")]
    for end in ("min", "max"):
        ours = sum(Fraction(row[f"{end}_ns"]) for row in rows) / 10**6
        assert rounded(ours, total[f"{end}_ms"]) == total[f"{end}_ms"]


def test_the_headers_of_the_models_are_found() -> None:
    assert {number for _, _, number in HEADERS} == {"2.1", "2.2", "5.7", "5.9"}
