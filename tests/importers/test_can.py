"""CAN databases as problem files: what they say, what they leave open, and what is none."""

from __future__ import annotations

import json
import random
import re
import sys
from fractions import Fraction
from pathlib import Path

import pytest
import yaml

import dse
from dse.cli.main import run
from dse.importers.can import HOW_CYCLES
from dse.support.errors import ProblemError
from tests.helpers.effort import cases

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


def put(folder: Path, text: str, name: str = "car.dbc") -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_database_is_a_problem_with_sizes_rates_senders_and_receivers(tmp_path: Path) -> None:
    found = dse.import_file(put(tmp_path, DBC), cycle="Event=1 s")
    problem = dse.loads(found.text)
    [bus] = dse.analyse(problem).buses
    wire = {"Speed": 135, "Pressure": 95, "Event": 65, "Lost": 75}
    rates: dict[str, Fraction | int] = {"Event": 1, "Speed": 100, "Pressure": Fraction(100, 3), "Lost": 10}
    assert bus.shares == {name: Fraction(wire[name], 8) * rate for name, rate in rates.items()}
    assert bus.capacity == Fraction(250_000, 8)
    assert "identifier 0x123; received by Brake, Gateway" in found.text
    assert "\n    identifier: 0x123\n" in found.text
    assert {body.get("identifier") for body in found.document["connections"].values()} != {None}
    [(_, messages)] = dse.analyse(problem).messages.items()
    assert [item.identifier for item in messages] == sorted(item.identifier or 0 for item in messages)
    said = [str(remark) for remark in found.remarks]
    assert said == [
        f"{tmp_path}/car.dbc: warning: 1 without a cycle time count with --cycle: Event",
        f"{tmp_path}/car.dbc:11: warning: Lost: no sender is stated (it is sent by a device of that name)",
    ]


def test_all_that_is_missing_is_asked_for_at_once(tmp_path: Path) -> None:
    """The cycle time of a message and the bit rate of the bus."""
    bare = "\n".join(line for line in DBC.splitlines() if "Baudrate" not in line)
    with pytest.raises(ProblemError) as caught:
        dse.import_file(put(tmp_path, bare))
    assert [item.message for item in caught.value.diagnostics] == [
        "1 message has no cycle time: Event",
        "nothing says the bit rate of can0",
    ]


def test_options_fill_in_what_is_not_stated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = put(tmp_path, DBC), str(tmp_path / "car.yaml")
    assert run(["import", path, "--cycle", "50ms", "--to", "Gateway", "--bandwidth", "125 kbit/s", "-o", out]) == 0
    assert "1 without a cycle time count with --cycle: Event" in capsys.readouterr().err
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
    assert run(["import", path, "--cycle", "none"]) == 3
    assert "nothing says the bit rate of their data (give --data-bandwidth" in capsys.readouterr().err
    found = dse.import_file(path, cycle="none", **{"data-bandwidth": "2 Mbit/s"})
    assert any("all count as CAN FD" in str(remark) for remark in found.remarks)
    assert "protocol: can_fd" in found.text


WHOLE = DBC + 'BA_ "GenMsgCycleTime" BO_ 1024 40;\n'
"""Every message has a cycle time."""
BAD = {
    "empty": ("", "car.dbc:1: the file is empty: expected a CAN database"),
    "no database": ("hello\nworld\n", "car.dbc:1:1: no CAN database: DBC"),
    "an identifier too long": (
        'VERSION ""\nBU_: A\nBO_ 1 Short: 1 A\nBO_ 600000000 Long: 8 A\n',
        'car.dbc:4: no CAN database: DBC: "Standard frame id 0x23c34600 is more than 11 bits in message Long."',
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
    "no cycle time": (DBC, f"car.dbc:9: 1 message has no cycle time: Event ({HOW_CYCLES})"),
    "no cycle times": (
        DBC.replace("BA_DEF_ BO_", 'BA_DEF_ BO_ "O" INT 0 1;\nBA_DEF_ BO_')
        .replace(" 10;", " 0;")
        .replace(" 30;", " 0;"),
        f"car.dbc:5: 3 messages have no cycle time: Speed, Pressure, Event ({HOW_CYCLES})",
    ),
    "a bit rate in kbit/s": (
        WHOLE.replace("250000;", "250;"),
        "car.dbc:1: the bit rate of can0 is 250 bit/s, slower than CAN: is it in kbit/s? (give --bandwidth",
    ),
    "no bit rate": (
        WHOLE.replace("Baudrate", "Other"),
        "car.dbc:1: nothing says the bit rate of can0 (give --bandwidth",
    ),
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
        (["--cycle", "Speed=5 ms"], "--cycle Speed=...: no message without a cycle time has this name"),
        (["--cycle", "=5 ms"], "--cycle =5 ms: expected a cycle time for all, such as 100 ms"),
        (["--cycle", "5 ms, 6 ms"], "--cycle 6 ms: expected a cycle time for all, such as 100 ms"),
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


def test_messages_without_cycle_times_count_as_stated_by_name_or_are_left_out(tmp_path: Path) -> None:
    text = DBC.replace("BO_ 1025 Lost", "BO_ 7 Extra: 1 Brake\nBO_ 8 Wake_up: 1 Brake\nBO_ 1025 Lost")
    found = dse.import_file(put(tmp_path, text), cycle="Wake*=none, Extra=20 ms, 1 s")
    data = yaml.safe_load(found.text)["connections"]
    rates = {"Speed": "100 Hz", "Pressure": "100/3 Hz", "Event": "1 Hz", "Lost": "10 Hz", "Extra": "50 Hz"}
    assert {name: body["rate"] for name, body in data.items()} == rates
    assert "1 without a cycle time are left out (--cycle): Wake_up" in str(found.remarks[1])
    with pytest.raises(dse.ProblemError, match="2 messages have no cycle time: Extra, Event"):
        dse.import_file(put(tmp_path, text), cycle="Wake*=none")


def test_the_default_of_the_bit_rate_counts_where_nothing_else_says_it(tmp_path: Path) -> None:
    text = WHOLE.replace('BA_ "Baudrate" 250000;\n', "")
    assert (
        yaml.safe_load(dse.import_file(put(tmp_path, text)).text)["bus_types"]["can0_type"]["bandwidth"] == "500 kbit/s"
    )


@pytest.mark.parametrize("seed", cases(4))
def test_unmarked_identifiers_and_values_of_no_signal_change_nothing(seed: int, tmp_path: Path) -> None:
    """A drawn database, with and without the bit that marks long identifiers, and with values of signals not there."""
    rng = random.Random(f"dbc/{seed}")
    keys = rng.sample(range(2048, 2**29), rng.randint(1, 5))
    lines, attributes = [], []
    for number, key in enumerate(keys):
        marked = f"<{key}>"
        lines += [f"BO_ {marked} M{number}: {rng.randint(1, 8)} {rng.choice(['Engine', 'Vector__XXX'])}"]
        lines += [f' SG_ s{number} : 0|8@1+ (1,0) [0|0] "BO_ {key} 5;" Brake']
        attributes += [
            f'BA_ "GenMsgCycleTime" BO_ {marked} {rng.randint(1, 500)};',
            f'CM_ SG_ {marked} s{number} "VAL_";',
        ]
        attributes += [f'VAL_ {marked} s{number} 0 "off;" 1 "on";', f"SIG_VALTYPE_ {marked} s{number} : 0;"]
    junk = ['VAL_ 5 x 0 "a;\nb" 1 "c";', "SIG_VALTYPE_ 5 x : 0;", f'VAL_ <{keys[0]}> none 0 "off";']
    kept = HEAD + "\n".join(lines) + '\nBA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;\nBA_DEF_DEF_ "GenMsgCycleTime" 0;\n'
    sound = kept + "\n".join(attributes)
    odd = kept + "\n".join(rng.sample([*attributes, *junk], len(attributes) + len(junk)))
    marked = re.sub(r"<(\d+)>", lambda found: str(int(found[1]) | 1 << 31), sound)
    plain = re.sub(r"<(\d+)>", r"\1", odd)
    options = {"bandwidth": "500 kbit/s"}
    expected, got = (dse.import_file(put(tmp_path, text + "\n"), **options) for text in (marked, plain))
    assert got.text == expected.text
    told = [remark.message for remark in got.remarks]
    assert told[0].startswith("left out: values of signals that no message has: ")
    assert told[1].startswith("identifiers of more than 11 bits that are not marked as long count as 29 bits: M")
