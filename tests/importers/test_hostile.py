"""Sizes that would take all memory, damaged recordings, encodings: a message with a place, and nothing is allocated."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path

import pytest

import dse
from dse.cli.main import run
from dse.importers.ros2.bags import read_bag
from tests.fuzz.importing import ARXML, MUXED, SYM
from tests.importers.test_can import DBC, KCD
from tests.importers.test_ros_sizes import put
from tests.importers.test_trace import put as put_trace
from tests.importers.test_trace import text

MANY = 10**9
SIZES = {
    "a signal of DBC": (
        "a.dbc",
        DBC.replace("0|16@1+ (0.01", f"0|{MANY}@1+ (0.01"),
        ":6: the signal has 1000000000 bits",
    ),
    "a start of DBC": (
        "a.dbc",
        DBC.replace("0|16@1+ (0.01", f"{MANY}|16@1+ (0.01"),
        ":6: the signal has 1000000000 bits",
    ),
    "a message of DBC": ("a.dbc", DBC.replace("Speed: 8", f"Speed: {MANY}"), ":5: the message has 8000000000 bits"),
    "a multiplexer of DBC": ("a.dbc", MUXED.replace("0-3", f"0-{MANY}"), ":23: a range of 1000000001 values"),
    "an exponent of DBC": ("a.dbc", DBC.replace("291 10;", "291 1e999999999;"), ":18: 1e999999999: a number is below"),
    "many signals of DBC": (
        "a.dbc",
        DBC.replace(" SG_ speed", ' SG_ s : 0|999999@1+ (1,0) [0|1] "" Brake\n' * 101 + " SG_ speed"),
        ":105: signals and messages have more than 100000000 bits up to here",
    ),
    "a signal of KCD": ("a.kcd", KCD.replace('length="16"', f'length="{MANY}"'), ":7: Signal rpm has 1000000000 bits"),
    "with gaps in KCD": (
        "a.kcd",
        KCD.replace('length="16"', 'length="1_000_000_000"'),
        ":7: Signal rpm has 1000000000 bits",
    ),
    "a message of KCD": ("a.kcd", KCD.replace('length="8"', f'length="{MANY}"'), ":6: Message Rpm has 8000000000 bits"),
    "entities of KCD": (
        "a.kcd",
        KCD.replace("<Net", "<!DOCTYPE a [<!ENTITY b 'c'>]><Net"),
        ":2: a document type is not",
    ),
    "levels of KCD": ("a.kcd", KCD + "<a>" * 100_000, ":15:1: not XML: junk after document element"),
    "an encoding of KCD": ("a.kcd", KCD.replace("utf-8", "x"), ":1: the encoding 'x' cannot be read"),
    "a signal of SYM": (
        "a.sym",
        SYM.replace("speed unsigned 16", f"speed unsigned {MANY}"),
        ":6: the signal has 10000",
    ),
    "a variable of SYM": ("a.sym", SYM.replace("8,8", f"8,{MANY}"), ":20: the variable has 1000000000 bits"),
    "a multiplexer of SYM": ("a.sym", SYM.replace("0,8 1", f"0,{MANY} 1"), ":19: the multiplexer has 1000000000 bits"),
    "a message of SYM": ("a.sym", SYM.replace("Len=8", f"Len={MANY}"), ":11: the message has 8000000000 bits"),
    "identifiers of SYM": ("a.sym", SYM.replace("200h-203h", "0h-1FFFFFFFh"), ":16: a range of 536870912 values"),
    "a signal of ARXML": ("a.arxml", ARXML.replace("<LENGTH>16", "<LENGTH>0x3B9ACA00"), ":17: LENGTH has 1000000000"),
    "a position of ARXML": ("a.arxml", ARXML.replace("POSITION>0", "POSITION>1e9"), ":11: START-POSITION has 10000000"),
}


@pytest.mark.parametrize("name", SIZES)
def test_sizes_in_can_databases_are_refused_before_anything_is_allocated(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, content, message = SIZES[name]
    monkeypatch.setattr("dse.importers.can._database", None)
    with pytest.raises(dse.ProblemError) as caught:
        dse.import_file(put(tmp_path, file, content), bandwidth="1 Mbit/s")
    assert f"{file}{message}" in str(caught.value)


def test_kcd_in_an_encoding_of_several_bytes_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.kcd"
    path.write_bytes(KCD.replace("utf-8", "shift_jis").replace('"Drive"', '"駆動"').encode("shift_jis"))
    assert "駆動" in dse.import_file(path).text


@pytest.mark.parametrize("name", ["a.sym", "a.arxml", "other.txt"])
def test_the_files_of_these_tests_are_databases(name: str, tmp_path: Path) -> None:
    content = {"a.sym": SYM, "a.arxml": ARXML, "other.txt": SYM}[name]
    found = dse.import_file(put(tmp_path, name, content), form="can", bandwidth="1 Mbit/s", cycle="10 ms")
    assert "data_size: 8 B" in found.text


# --- definitions of messages

IDL = "module mine {{ module msg {{\n{}\nstruct S {{ {} }}; }}; }};\n"
DEFINITIONS = {
    "an array": (
        "msg/A.msg",
        "int8 x\nuint8[999999999999] a\n",
        ":2: a: expected a length from 0 to 100000000, got 9999",
    ),
    "a sequence": ("msg/A.msg", "int8[<=999999999999] a\n", ":1: a: expected a length from 0 to 100000000, got 9999"),
    "a string": ("msg/A.msg", "string<=999999999999 a\n", ":1: a: expected a length from 0 to 100000000, got 9999"),
    "below nothing": ("msg/A.msg", "int8[-1] a\n", ":1: a: expected a length from 0 to 100000000, got -1"),
    "digits": ("msg/A.msg", f"int8[{'9' * 5000}] a\n", ":1: no definition of a message: it has a number of too many"),
    "a part of a service": ("srv/A.srv", "int8 a\n---\nint8 b\n!\n", ":4: no definition of a message: this is not"),
    "a shift": (
        "msg/S.idl",
        IDL.format("const long N = 1 << 99999999999;", "long a;"),
        ":2: a number is shifted by at",
    ),
    "a shift by a name": (
        "msg/S.idl",
        IDL.format("const long N = 99999999999; const long M = 1 << N;", "long a;"),
        ":2: a number is shifted by at most 63",
    ),
    "products": (
        "msg/S.idl",
        IDL.format("const long A0 = 99;\n" + "".join(f"const long A{n + 1} = A{n} * A{n};\n" for n in range(45)), ""),
        ":12: the numbers of this statement are too large",
    ),
    "parentheses": ("msg/S.idl", IDL.format("", "long a[((((3))))];"), ":3: parentheses are not read here: state the"),
    "sequences": (
        "msg/S.idl",
        IDL.format("", f"{'sequence<' * 9}long{'>' * 9} a;"),
        ":3: a sequence of sequences is not read here",
    ),
    "an array of IDL": (
        "msg/S.idl",
        IDL.format("", "octet a[999999999999];"),
        ":3: a: expected a length from 0 to 10000",
    ),
    "modules": ("msg/S.idl", "module a { " * 400 + "struct S { long a; };" + "};" * 400, ": it is nested too deeply"),
    "a type without a size": ("msg/S.idl", IDL.format("", "wstring a;"), ":3: a: the type wstring has no size that is"),
}


@pytest.mark.parametrize("name", DEFINITIONS)
def test_definitions_that_would_take_all_memory_or_time(name: str, tmp_path: Path) -> None:
    file, content, message = DEFINITIONS[name]
    put(tmp_path, f"mine/{file}", content)
    with pytest.raises(dse.ProblemError) as caught:
        dse.sizes(definitions=[tmp_path])
    assert Path(file).name in str(caught.value) and message in str(caught.value)


def test_expressions_that_are_computed_count(tmp_path: Path) -> None:
    text_ = IDL.format("const long N = 1 << 3; const long M = 2 * 4 + 1; // ((1 << 99))", "octet a[8]; long b;")
    put(tmp_path, "mine/msg/S.idl", f'@verbatim (language="comment", text="(see << 99)")\n{text_}')
    [found] = dse.sizes(definitions=[tmp_path]).types
    assert found.least == found.most == 4 + 8 + 4


def test_messages_within_messages_are_counted_once_each(tmp_path: Path) -> None:
    """40 levels of two each: 2 ** 40 numbers of 4 B, and as many texts by name in another, which is refused."""
    for number in range(40):
        put(tmp_path, f"mine/msg/D{number}.msg", f"D{number + 1} x\nD{number + 1} y\n")
    put(tmp_path, "mine/msg/D40.msg", "int32 a\n")
    [found] = dse.sizes("mine/D0", definitions=[tmp_path]).types
    assert (found.rule, found.least, found.most) == (2**40 * 4, 2**40 * 4 + 4, 2**40 * 4 + 4)
    put(tmp_path, "mine/msg/D40.msg", "string a\n")
    with pytest.raises(dse.ProblemError, match="has more than 10000 strings and sequences"):
        dse.sizes("mine/D0", definitions=[tmp_path])


def test_long_arrays_of_messages_take_no_memory(tmp_path: Path) -> None:
    """An element takes 8 + 1 B, and 7 B are left out before the next; the last one ends after its bool."""
    put(tmp_path, "mine/msg/A.msg", "B[100000000] b\n")
    put(tmp_path, "mine/msg/B.msg", "int64 a\nbool c\n")
    [found] = dse.sizes("mine/A", definitions=[tmp_path]).types
    assert found.least == 4 + 16 * 10**8 - 7
    put(tmp_path, "mine/msg/C.msg", "string<=5[<=3] a\n")
    [found] = dse.sizes("mine/C", definitions=[tmp_path], lengths={"a": 2, "a[]": 1}).types
    assert (found.least, found.stated, found.most) == (
        4 + 4,
        4 + 4 + (4 + 2 + 2) + 4 + 2,
        4 + 4 + (4 + 6 + 2) * 2 + 4 + 6,
    )


def test_a_chain_of_very_many_types_is_told(tmp_path: Path) -> None:
    for number in range(400):
        put(tmp_path, f"mine/msg/D{number}.msg", f"D{number + 1} x\n")
    put(tmp_path, "mine/msg/D400.msg", "int32 a\n")
    with pytest.raises(dse.ProblemError, match=r"D0.msg:1: mine/msg/D0 has more than 60 messages within each other"):
        dse.sizes(definitions=[tmp_path])


# --- recordings


def bag(path: Path, stamp: object = 10**18, size: int = 300) -> Path:
    """A bag of ROS 2 as SQLite, of several pages."""
    with sqlite3.connect(path) as database:
        database.executescript(
            "PRAGMA page_size = 512;"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
            "INSERT INTO topics VALUES(1, '/chatter', 'std_msgs/msg/String', 'cdr')"
        )
        rows = [(1, stamp, b"x" * size) for _ in range(20)]
        database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", rows)
    database.close()
    return path


@pytest.mark.parametrize("size", [300, 3000])
def test_pages_of_a_bag_that_are_damaged_are_told(
    size: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whichever page is: where messages are longer than a page SQLite finds it when they are read."""
    whole = bag(tmp_path / "whole.db3", size=size).read_bytes()
    assert [topic.count for topic in read_bag(tmp_path / "whole.db3")] == [20]
    codes = []
    for start in range(0, len(whole), 512):
        (tmp_path / "a.db3").write_bytes(whole[:start] + b"\xff" * 8 + whole[start + 8 :])
        codes.append(run(["sizes", "--bag", str(tmp_path / "a.db3")]))
        assert codes[-1] == 0 or "a.db3: no bag that can be read: " in capsys.readouterr().err
    assert set(codes) <= {0, 3} and codes.count(3) > len(codes) / 2


@pytest.mark.parametrize("stamp", [-1, 1e300, None])
def test_times_in_a_bag_that_are_none(stamp: object, tmp_path: Path) -> None:
    with pytest.raises(dse.ProblemError, match=r"a message of /chatter has no time from 0 to 2\*\*63 ns"):
        read_bag(bag(tmp_path / "a.db3", stamp))


@pytest.mark.parametrize("name", ["metadata.yaml", "a.db3"])
def test_nothing_in_the_folder_of_a_bag_is_waited_for(name: str, tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("x", encoding="utf-8")
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    with pytest.raises(dse.ProblemError, match=f"{name}: expected a file, this is a pipe"):
        read_bag(tmp_path)
    (tmp_path / name).unlink()
    (tmp_path / "metadata.yaml").write_bytes(b"[" * 4_000_001)
    with pytest.raises(dse.ProblemError, match=r"metadata.yaml: the file is larger than 4 MB"):
        read_bag(tmp_path)


def test_a_definition_in_a_bag_is_not_computed(tmp_path: Path) -> None:
    """Only sizes and times are asked for, whatever types a bag says that it has."""
    path = bag(tmp_path / "a.db3")
    with sqlite3.connect(path) as database:
        database.executescript(
            "CREATE TABLE schema(schema_version INTEGER); INSERT INTO schema VALUES(4);"
            "ALTER TABLE topics ADD COLUMN offered_qos_profiles TEXT DEFAULT '';"
            "ALTER TABLE topics ADD COLUMN type_description_hash TEXT DEFAULT '';"
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT,"
            "encoded_message_definition TEXT, type_description_hash TEXT);"
            "INSERT INTO message_definitions VALUES"
            "(1, 'std_msgs/msg/String', 'ros2idl', 'const long A = 1 << 9999999;', '')"
        )
    database.close()
    assert [topic.count for topic in read_bag(path)] == [20]


@pytest.mark.parametrize("name", ["callbacks", "unit", "wires", "node_of", "rate", "timer", "subscription", "_init_"])
def test_events_of_a_trace_are_no_functions_of_ours(name: str, tmp_path: Path) -> None:
    found = dse.import_file(put_trace(tmp_path, text().replace("rcl_publish", name)))
    assert "track.on.image" in found.text


EVENT = (
    "[{}.000000000] (+0.000000001) host ros2:callback_start: {{ cpu_id = 0 }}, {{ vpid = {} }}, {{ callback = 1 }}\n"
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (EVENT.format(99_999_999_999, 7), ":1: this event is later than 2**63 ns"),
        (EVENT.format("9" * 5000, 7), ":1: no event: '[999"),
        (EVENT.format(1, "9" * 5000), ":1: a number of more than 40 digits"),
        (EVENT.format(1, f"0x{'f' * 5000}"), ":1: a number of more than 40 digits"),
        (text().replace("[23:59:59", "[99999999:59:59"), ":1: this event is later than 2**63 ns"),
    ],
)
def test_numbers_of_a_trace_beyond_what_there_is(
    content: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["import", put_trace(tmp_path, content), "-o", str(tmp_path / "out.yaml")]) == 3
    assert f"trace.txt{message}" in capsys.readouterr().err


def test_periods_and_numbers_of_a_trace_that_are_odd(tmp_path: Path) -> None:
    """A number may begin with zeros, as addresses do; a period of more than 2 ** 63 ns is none."""
    zeros = dse.import_file(put_trace(tmp_path, text().replace("vpid = 7", "vpid = 007")))
    assert zeros.text == dse.import_file(put_trace(tmp_path, text())).text
    found = dse.import_file(put_trace(tmp_path, text().replace("period = 20000000", f"period = {2**64 - 1}")))
    assert "a timer of /front/cam without a period is left out" in str(found.remarks[0])
