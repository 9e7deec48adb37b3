"""Chosen identifiers as a CAN database, which the importer reads again."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import dse
from dse.support.errors import UsageError

pytest.importorskip("cantools")

TEXT = """
dse: 1
name: 'robot "3"'
bus_types: {can: {bandwidth: 250 kbit/s, frame: FRAME, broadcast: true, price: 1 EUR}}
buses: {b: {type: [can]}}
devices: {sink: {}, wheel.left: {period: [2.5 ms, 4 ms]}, 2nd node: {period: 20 ms}}
threads: {}
connections:
  pdo: {from: wheel.left, to: sink, from_port: o, bus: b, data_size: SIZE, identifier: any, deadline: 2 ms}
  pdo copy: {from: wheel.left, to: 2nd node, from_port: o, bus: b, data_size: SIZE, identifier: any, port: data}
  a status that has a very long name: {from: 2nd node, to: sink, bus: b, data_size: 2 B, identifier: 0x20, port: data}
  sync: {to: sink, rate: 100 Hz, bus: b, data_size: 0 B, identifier: any, port: data}
flows: {f: {path: [wheel.left, pdo, sink]}}
objectives: [minimise price]
"""


def written(frame: str = "can", size: str = "8 B", text: str = TEXT) -> str:
    """The database of the first alternative."""
    return dse.export(dse.solve(dse.loads(text.replace("FRAME", frame).replace("SIZE", size))), 1, "dbc")


@pytest.mark.parametrize("frame", ["can", "{protocol: can, identifier_bits: 29}"])
def test_what_is_written_is_read_again(frame: str, tmp_path: Path) -> None:
    """Identifiers, sizes and cycle times; of two connections that are one message one stands."""
    path = tmp_path / "b.dbc"
    path.write_text(written(frame), encoding="utf-8")
    spec = dse.loads(dse.import_file(path).text).loaded.spec
    assert [item.bandwidth for item in spec.bus_types.values()] == [(250_000,)]
    read = spec.connections
    found = {item.identifier: (item.data_size, item.rate) for item in read.values() if item.identifier}
    stated = TEXT.replace("FRAME", frame).replace("SIZE", "8 B").replace("[2.5 ms, 4 ms]", "2.5 ms")
    messages = dse.analyse(dse.loads(stated)).messages["b"]
    numbers = {item.name: item.identifier for item in messages if item.identifier is not None}
    assert set(found) == {(number,) for number in numbers.values()}
    assert numbers["pdo"] < 0x20 < numbers["sync"]
    assert found[(numbers["pdo"],)][0] == (8,)
    assert found[(0x20,)] == ((2,), (50,))


def test_what_no_database_says_is_said_before_a_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("cantools", "cantools.database", "cantools.database.can"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match="CAN FD"):
        written("{protocol: can_fd, data_bandwidth: 8 Mbit/s}", "12 B")
    with pytest.raises(UsageError, match="needs cantools"):
        written()


@pytest.mark.parametrize(
    ("frame", "size", "said"),
    [
        ("can", "12 B", "several frames"),
        ("{protocol: can_fd, data_bandwidth: 8 Mbit/s}", "12 B", "CAN FD"),
        ("ethernet, arbitration: fifo", "8 B", "this design has none"),
    ],
)
def test_what_no_database_says(frame: str, size: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        written(frame, size, TEXT.replace(", deadline: 2 ms", "").replace("250 kbit/s", "5 Mbit/s"))
