"""CAN databases as problem files: what they say, what they leave open, and what is none."""

from __future__ import annotations

import json
import sys
from fractions import Fraction
from pathlib import Path

import pytest

import dse
from dse.cli.main import run

HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: Engine Brake Gateway\n'
DBC = (
    HEAD
    + """BO_ 291 Speed: 8 Engine
 SG_ speed : 0|16@1+ (0.01,0) [0|655] "km/h" Brake,Gateway
BO_ 512 Pressure: 4 Brake
 SG_ pressure : 0|16@1+ (1,0) [0|100] "bar" Engine
BO_ 1024 Event: 1 Gateway
 SG_ event : 0|8@1+ (1,0) [0|1] "" Engine
BO_ 1025 Lost: 2 Vector__XXX
 SG_ lost : 0|8@1+ (1,0) [0|1] "" Brake
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_ "Baudrate" INT 0 1000000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_DEF_DEF_ "Baudrate" 500000;
BA_ "Baudrate" 250000;
BA_ "GenMsgCycleTime" BO_ 291 10;
BA_ "GenMsgCycleTime" BO_ 512 30;
BA_ "GenMsgCycleTime" BO_ 1025 100;
"""
)
KCD = """<?xml version="1.0" encoding="utf-8"?>
<NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0">
  <Document name="two" version="1"/>
  <Node id="1" name="Motor"/><Node id="2" name="Dash"/>
  <Bus name="Drive" baudrate="125000">
    <Message id="0x123" name="Rpm" length="8" interval="20"><Producer><NodeRef id="1"/></Producer>
      <Signal name="rpm" offset="0" length="16"><Consumer><NodeRef id="2"/></Consumer></Signal></Message>
  </Bus>
  <Bus name="Comfort" baudrate="50000">
    <Message id="0x1" name="Lamp" length="1" interval="500" format="extended">
      <Producer><NodeRef id="2"/></Producer>
      <Signal name="lamp" offset="0" length="1"/></Message>
  </Bus>
</NetworkDefinition>
"""


HINT = "(state its `rate`, or give --cycle, such as --cycle '100 ms')"


def put(folder: Path, text: str, name: str = "car.dbc") -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_database_is_a_problem_with_sizes_rates_senders_and_receivers(tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, DBC))
    with pytest.raises(dse.ProblemError, match=r"Gateway: its rate is needed, .* or its connections a `rate`"):
        dse.loads(found.text)
    problem = dse.loads(found.text.replace("  Event:", "  Event:\n    rate: 1 Hz"))
    [bus] = dse.analyse(problem).buses
    wire = {"Speed": 135, "Pressure": 95, "Event": 65, "Lost": 75}
    rates: dict[str, Fraction | int] = {"Event": 1, "Speed": 100, "Pressure": Fraction(100, 3), "Lost": 10}
    assert bus.shares == {name: Fraction(wire[name], 8) * rate for name, rate in rates.items()}
    assert bus.capacity == Fraction(250_000, 8)
    assert "identifier 0x123; received by Brake, Gateway" in found.text
    said = [str(remark) for remark in found.remarks]
    assert said == [
        f"{tmp_path}/car.dbc:9: warning: Event: no cycle time is stated {HINT}",
        f"{tmp_path}/car.dbc:11: warning: Lost: no sender is stated (it is sent by a device of that name)",
    ]


def test_options_fill_in_what_is_not_stated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = put(tmp_path, DBC), str(tmp_path / "car.yaml")
    assert run(["import", path, "--cycle", "50ms", "--to", "Gateway", "--bandwidth", "125 kbit/s", "-o", out]) == 0
    assert "Event: no cycle time is stated (counts with --cycle)" in capsys.readouterr().err
    assert run(["check", out]) == 0
    [bus] = dse.analyse(out).buses
    assert bus.shares["Event"] == Fraction(65, 8) * 20 and bus.capacity == Fraction(125_000, 8)
    assert "to: Gateway" in Path(out).read_text(encoding="utf-8")


def test_buses_of_a_kcd_file_have_their_own_rates_and_frames(tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, KCD, "two.kcd"))
    figures = {bus.name: bus for bus in dse.analyse(found.text).buses}
    assert figures["Drive"].shares == {"Rpm": Fraction(135, 8) * 50} and figures["Drive"].capacity == 125_000 / 8
    assert figures["Comfort"].shares == {"Lamp": Fraction(90, 8) * 2}


def test_can_fd_needs_its_second_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    formats = ",".join(f'"{name}"' for name in ["StandardCAN", *"ABCDEFGHIJKLM", "StandardCAN_FD"])
    stated = f'BA_DEF_ BO_ "VFrameFormat" ENUM {formats};\nBA_DEF_DEF_ "VFrameFormat" "StandardCAN";\n'
    text = DBC.replace('BA_DEF_DEF_ "Gen', stated + 'BA_DEF_DEF_ "Gen')
    path = put(tmp_path, text + 'BA_ "VFrameFormat" BO_ 291 14;\n')
    assert run(["import", path]) == 3
    assert "nothing says the bit rate of their data (give --data-bandwidth" in capsys.readouterr().err
    found = dse.import_file(path, **{"data-bandwidth": "2 Mbit/s"})
    assert "all count as CAN FD" in str(found.remarks[0])
    assert "protocol: can_fd" in found.text


BAD = {
    "empty": ("", "car.dbc:1: the file is empty: expected a CAN database"),
    "no database": ("hello\nworld\n", "car.dbc:1:1: no CAN database: DBC"),
    "an identifier too long": (
        'VERSION ""\nBU_: A\nBO_ 1 Short: 1 A\nBO_ 4000 Long: 8 A\n',
        'car.dbc:4: no CAN database: DBC: "Standard frame id 0xfa0 is more than 11 bits in message Long."',
    ),
    "cut off": (DBC[: DBC.index("BO_ 512") + 12], "car.dbc:7: this message is not whole (is the file cut off?)"),
    "cut off in a message": (DBC[: DBC.index("BO_ 512") + 7], "car.dbc:7: this message is not whole (is the"),
    "cut off in a signal": (DBC[: DBC.index("[0|100]") + 4], "car.dbc:8: this signal is not whole (is the file cut"),
    "cut off in a signal's name": (DBC[: DBC.index("pressure") + 3], "car.dbc:8: this signal is not whole (is the"),
    "cut off in an attribute": (
        DBC[: DBC.index("1025 100;") + 4],
        "this attribute is not whole (is the file cut off?)",
    ),
    "cut off in its value": (DBC[: DBC.index("1025 100;") + 6], "this attribute is not whole (is the file cut off?)"),
    "no messages": (HEAD, "car.dbc:1: it has no CAN messages (is the file cut off?)"),
    "no bit rate": (DBC.replace("Baudrate", "Other"), "car.dbc:1: nothing says the bit rate of can0 (give --bandwidth"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_none_is_told_with_its_place(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, message = BAD[name]
    out = tmp_path / "out.yaml"
    assert run(["import", put(tmp_path, text), "-o", str(out)]) == 3
    said = capsys.readouterr().err
    assert message in said, said
    assert not out.exists()


@pytest.mark.parametrize(("name", "text"), [("a.kcd", "<a/>"), ("a.arxml", "<a"), ("a.sym", "x"), ("a.kcd", "")])
def test_other_formats_that_are_none(name: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["import", put(tmp_path, text, name)]) == 3
    assert f"{name}:1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--cycle", "5"], "--cycle 5: expected a duration"),
        (["--cycle", "0 ms"], "--cycle 0 ms: it must be above zero"),
        (["--bandwidth", "fast"], "--bandwidth fast: expected a bandwidth"),
        (["--to", "Nobody"], "--to Nobody: there is no such node; nodes: Brake, Engine, Gateway"),
    ],
)
def test_wrong_options(options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["import", put(tmp_path, DBC), *options]) == 2
    assert message in capsys.readouterr().err


def test_without_cantools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("cantools", "cantools.database"):
        monkeypatch.setitem(sys.modules, name, None)
    assert run(["import", put(tmp_path, DBC)]) == 2
    assert "A CAN database needs cantools, the extra `can`: pip install 'dse-pareto[can]'" in capsys.readouterr().err


def test_what_is_imported_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bit rate as a decision: the slowest that keeps the bus below a quarter."""
    monkeypatch.chdir(tmp_path)
    text = dse.import_file(put(tmp_path, DBC), cycle="100 ms").text
    text = text.replace("bandwidth: 250 kbit/s", "bandwidth: [50 kbit/s, 100 kbit/s, 250 kbit/s]")
    Path("car.yaml").write_text(text, encoding="utf-8")
    assert run(["solve", "car.yaml", "--max-load", "25 %", "--maximise", "busy of can0", "--json", "r.json", "-q"]) == 0
    [point] = json.loads(Path("r.json").read_text(encoding="utf-8"))["front"]
    assert "100 kbit/s" in point["decisions"].values()


def test_a_message_without_cycle_time_says_at_what_rate_it_counts(tmp_path: Path) -> None:
    out = tmp_path / "out.yaml"
    assert run(["import", put(tmp_path, DBC), "-o", str(out)]) == 0
    text = out.read_text(encoding="utf-8")
    assert "Messages without a `rate` have no cycle time" in text
    assert "cycle time missing: without a `rate` it counts at the rate of Gateway" in text
