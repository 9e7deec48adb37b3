"""What frames take on the wire: against frames laid out bit by bit, published times, and the report's parameters."""

from __future__ import annotations

import random
from fractions import Fraction
from textwrap import dedent

import pytest

import dse
from dse.space.architecture.frames import FD_SIZES, Frame, bit_units, wire_bits, wire_ns
from tests.analysis import encoder
from tests.helpers.effort import count
from tests.helpers.small import US

KBIT = 1000
MBIT = 10**6


def test_the_encoder_stuffs_as_a_receiver_takes_it_apart() -> None:
    source = random.Random(1)
    for _ in range(200):
        bits = [source.choice([0, 0, 0, 1]) for _ in range(90)]
        assert encoder.destuffed(encoder.stuffed(bits)) == bits
    assert encoder.stuffed([1] * 5 + [0] * 4 + [1] * 4) == [1] * 5 + [0] + [0] * 4 + [1] + [1] * 4 + [0]
    assert encoder.crc([0] * 9 + [1], encoder.CRC_15) == encoder.number(0x4599, 15)


@pytest.mark.parametrize("is_long", [False, True])
def test_every_can_frame_is_within_its_bounds(is_long: bool) -> None:
    """Random frames and ones that stuff much; some come close to the most, none goes beyond."""
    source = random.Random(2)
    frame = Frame("can", 29 if is_long else 11)
    closest = 99
    for _ in range(count(3000)):
        size = source.randrange(9)
        byte = source.choice([None, 0x00, 0xFF, 0x0F, 0xF0, 0x1E, 0x3C, 0x78, 0x87, 0xE1])
        data = source.randbytes(size) if byte is None else bytes([byte] * size)
        identifier = source.choice([source.getrandbits(29 if is_long else 11), 0])
        body, rest = encoder.can(identifier, data, is_long=is_long)
        least, most = wire_bits(frame, size, MBIT)
        assert least <= len(body) + len(rest) <= most - 3
        closest = min(closest, int(most) - 3 - len(body) - len(rest))
    assert closest <= 6


def test_the_worst_stuffing_can_be_had_where_all_bits_are_free() -> None:
    """The pattern behind the bound: 34 + 8 n free bits take floor((34 + 8 n - 1) / 4) stuff bits, and no more."""
    for size in range(9):
        free = 34 + 8 * size
        pattern = [1] * 5 + ([0] * 4 + [1] * 4) * free
        stuffing = len(encoder.stuffed(pattern[:free])) - free
        assert wire_bits(Frame("can"), size, MBIT)[1] == free + 13 + stuffing


@pytest.mark.parametrize("is_long", [False, True])
def test_every_can_fd_frame_is_within_its_bounds(is_long: bool) -> None:
    source = random.Random(3)
    frame = Frame("can_fd", 29 if is_long else 11, data_bandwidth_bps=2 * MBIT)
    for _ in range(count(1500)):
        size = source.choice(FD_SIZES)
        data = bytes([source.choice([0, 255, 0x0F])] * size) if source.random() < 0.5 else source.randbytes(size)
        identifier = source.choice([source.getrandbits(29 if is_long else 11), 0])
        slow, fast, after = encoder.can_fd(identifier, data, is_long=is_long)
        time = Fraction(len(slow) + after, 500_000) + Fraction(len(fast), 2 * MBIT)
        least, most = (Fraction(bits, 500_000) for bits in wire_bits(frame, size, 500_000))
        assert least <= time <= most - Fraction(3, 500_000)


def test_published_times() -> None:
    """Davis et al. 2007 (135 and 160 bits); the least and largest frames of Ethernet; a character of RS-232."""
    assert [wire_bits(Frame("can"), size, MBIT)[1] for size in (0, 1, 8)] == [55, 65, 135]
    assert [wire_bits(Frame("can", 29), size, MBIT)[1] for size in (0, 1, 8)] == [80, 90, 160]
    assert wire_ns(Frame("can"), 8, 125 * KBIT)[1] == 1080 * US
    ethernet = Frame("ethernet")
    assert 10**9 // wire_ns(ethernet, 46, 100 * MBIT)[1] == 148_809  # frames a second, at the least size
    assert 10**9 // wire_ns(ethernet, 1500, 100 * MBIT)[1] == 8_127
    assert wire_bits(Frame("ethernet", vlan=True), 42, MBIT)[1] == 84 * 8
    assert wire_bits(Frame("ethernet", transport="udp"), 1472, MBIT)[1] == 1538 * 8
    assert wire_bits(Frame("ethernet", transport="udp"), 1473, MBIT)[1] == (1538 + 84) * 8
    assert wire_bits(Frame("ethernet", transport="tcp"), 1460, MBIT)[1] == 1538 * 8
    assert wire_ns(Frame("serial"), 1, 115200) == (Fraction(10 * 10**9, 115200),) * 2
    assert wire_bits(Frame("serial", data_bits=7, parity=True, stop_halves=3), 2, 9600)[1] == 21


def test_the_reports_can_and_serial_figures() -> None:
    """Listing 3.1 (256 us, 64 to 88 us a byte with 4 of identifier) is a 29-bit frame; RS-232 takes 87 us a byte."""
    least, most = wire_ns(Frame("can", 29), 8, 125 * KBIT)
    assert least == (256 + 64 * 12) * US == 1024 * US
    assert most == 160 * 8 * US < (256 + 88 * 12) * US
    assert round(wire_ns(Frame("serial"), 1, 115200)[0] / US) == 87


def test_large_messages_go_in_several_frames_and_empty_ones_in_one() -> None:
    assert wire_bits(Frame("can"), 20, MBIT)[1] == 135 + 135 + 95
    assert wire_bits(Frame("can"), 20, MBIT)[0] == 111 + 111 + 79 - 3
    assert wire_bits(Frame("can"), 0, MBIT) == (44, 55)
    fd = Frame("can_fd", data_bandwidth_bps=MBIT)
    assert wire_bits(fd, 65, MBIT)[1] == wire_bits(fd, 64, MBIT)[1] + wire_bits(fd, 1, MBIT)[1]
    assert wire_bits(fd, 9, MBIT) == wire_bits(fd, 12, MBIT)
    assert wire_bits(Frame("ethernet"), 0, MBIT)[1] == 84 * 8
    assert wire_bits(Frame("serial"), 0, MBIT) == (0, 0)


@pytest.mark.parametrize("protocol", ["can", "can_fd", "serial", "ethernet", "ethercat", "flexray"])
def test_more_bytes_never_take_less_and_all_are_multiples_of_the_unit(protocol: str) -> None:
    frame = Frame(protocol, data_bandwidth_bps=3 * MBIT, stop_halves=3)  # type: ignore[arg-type]
    [(unit, _)] = bit_units(frame, 500_000)
    bits = [wire_bits(frame, size, 500_000) for size in range(200)]
    assert bits == sorted(bits)
    assert all((value / unit).denominator == 1 for pair in bits for value in pair)


@pytest.mark.parametrize("payload", [0, 16, 254])
def test_flexray_frames_are_those_of_an_encoder(payload: int) -> None:
    for size in (0, 1, 2, 7, 16, 17, 254, 255, 600):
        most = payload or 254
        cuts = [min(most, size - start) for start in range(0, max(1, size), most)]
        frames = [encoder.flexray(bytes(cut), payload or cut + cut % 2, start=9) for cut in cuts]
        sent = sum(map(len, frames)) + 11 * (len(frames) - 1)
        assert wire_bits(Frame("flexray", payload_bytes=payload, start_bits=9), size, MBIT) == (sent, sent + 11)


def test_ethercat_frames_are_those_of_an_encoder() -> None:
    """The published least frame: 84 bytes on the wire, 6.72 us at 100 Mbit/s; the longest has 1538 bytes."""
    for size in (0, 1, 32, 33, 200, 1486, 1487, 4000):
        cuts = [min(1486, size - start) for start in range(0, max(1, size), 1486)]
        bits = 8 * sum(len(encoder.ethercat(bytes(cut))) + 12 for cut in cuts)
        assert wire_bits(Frame("ethercat"), size, MBIT) == (bits - 96, bits)
    assert wire_ns(Frame("ethercat"), 32, 100 * MBIT)[1] == 6_720
    assert wire_ns(Frame("ethercat"), 1486, 100 * MBIT)[1] == 123_040


BUS = """
bus_types: {can: {bandwidth: 125 kbit/s, frame: can, latency: 9 s}}
buses: {bus: {type: can}}
devices: {sensor: {period: 10 ms}, sink: {}}
connections: {c: {from: sensor, to: sink, data_size: 8 B, bus: bus}}
flows: {f: {path: [sensor, c, sink]}}
objectives: [minimise latency of f]
"""


def test_load_busy_time_and_latency_are_those_of_the_wire_and_the_payload_is_told() -> None:
    found = dse.analyse("dse: 1\nname: x\n" + BUS)
    [flow], [bus] = found.flows, found.buses
    assert (flow.min_ns, flow.max_ns) == (108 * 8 * US, 1080 * US)
    assert bus.payload == {"c": 800}
    assert bus.total == Fraction(135, 8) * 100 and bus.busy_total == 108_000
    assert bus.capacity is not None
    assert bus.total / bus.capacity == Fraction(bus.busy_total, 10**6)
    assert not [text for text in found.warnings if "busier" in text]
    for profile in ("osate-2.2", "osate-2.19"):
        flow = dse.analyse("dse: 1\nname: x\n" + BUS, profile=profile).flows[0]
        assert flow.min_ns == 108 * 8 * US and (flow.max_ns - 1080 * US) % (10_000 * US) == 0
    plain = dse.analyse("dse: 1\nname: x\n" + BUS.replace("frame: can", "transmission_time: from bandwidth"))
    assert plain.buses[0].payload is None and plain.buses[0].total == 800


def test_overheads_of_the_stack_are_framed_with_the_message() -> None:
    text = """
    bus_types:
      eth: {bandwidth: 100 Mbit/s, frame: {protocol: ethernet, transport: udp}}
      dds: {virtual: true, overhead: 100 B}
    buses: {wire: {type: eth}, net: {type: dds, bus: wire}}
    devices: {sensor: {period: 10 ms}, sink: {}}
    connections: {c: {from: sensor, to: sink, data_size: 1400 B, bus: net}}
    flows: {f: {path: [sensor, c, sink]}}
    """
    found = dse.analyse("dse: 1\nname: x\n" + dedent(text))
    udp = Frame("ethernet", transport="udp")
    assert found.flows[0].max_ns == wire_ns(udp, 1500, 100 * MBIT)[1]
    assert {bus.name: bus.total for bus in found.buses} == {"wire": (1538 + 38 + 20 + 28) * 100, "net": 150_000}


def test_a_data_rate_counts_its_messages() -> None:
    text = BUS.replace("data_size: 8 B", "data_size: 8 B, data_rate: 1600 B/s")
    [bus] = dse.analyse("dse: 1\nname: x\n" + text).buses
    assert bus.payload == {"c": 1600} and bus.total == Fraction(135, 8) * 200


def test_bit_rates_are_swept_and_have_margins() -> None:
    found = dse.sweep("dse: 1\nname: x\n" + BUS, "bus_types.can.bandwidth=125kbit/s,250kbit/s", store=None)
    assert [run.front[0]["metrics"]["latency of f"] for run in found.runs] == [1080 * US, 540 * US]
    assert found.remarks == ()
    inputs = dse.sensitivity("dse: 1\nname: x\n" + BUS + "requirements: [latency of f <= 2 ms]\n", samples=10).to_dict()
    margins = {item["path"]: item for item in inputs["margins"]}
    assert margins["bus_types.can.bandwidth"]["below"]["last"] == 67_500  # 135 bits in 2 ms
    assert margins["connections.c.data_size"]["above"]["last"] == 14  # 135 and 115 bits
