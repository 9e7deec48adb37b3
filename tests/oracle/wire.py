"""What a message takes on the wire: lays frames out as lists of bits and counts. Imports nothing of `dse`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import cache
from typing import Any

from . import quantities

Bit = tuple[bool, bool]
"""Whether it may be stuffed, and whether it goes at the faster rate."""
FD_SIZES = [*range(9), 12, 16, 20, 24, 32, 48, 64]


def seconds(body: Mapping[str, Any], bandwidth: Fraction, size: int) -> tuple[Fraction, Fraction]:
    """Least and most time of a message in s; `bandwidth` is in B/s."""
    frame = body["frame"]
    frame = {"protocol": frame} if isinstance(frame, str) else frame
    bit = 1 / (8 * bandwidth)
    if frame["protocol"] == "serial":
        parity = frame.get("parity", "none") != "none"
        each = 1 + int(frame.get("data_bits", 8)) + parity + Fraction(frame.get("stop_bits", 1))
        return size * each * bit, size * each * bit
    if frame["protocol"] == "ethernet":
        whole = sum(8 + 4 + 12 + max(60, packet) for packet in packets(frame, size))
        return (whole - 12) * 8 * bit, whole * 8 * bit
    if frame["protocol"] == "ethercat":
        whole = sum(8 + 4 + 12 + max(60, 14 + 2 + 10 + part + 2) for part in pieces(size, 1486))
        return (whole - 12) * 8 * bit, whole * 8 * bit
    if frame["protocol"] == "flexray":
        slots = [flexray_bits(frame, part) for part in pieces(size, flexray_payload(frame) or 254)]
        return (sum(slots) + 11 * (len(slots) - 1)) * bit, (sum(slots) + 11 * len(slots)) * bit
    long = int(frame.get("identifier_bits", 11)) == 29
    if frame["protocol"] == "can":
        parts = list(pieces(size, 8))
        least = sum(can_frame(part, long)[0] for part in parts) - 3
        most = sum(can_frame(part, long)[1] for part in parts)
        return least * bit, most * bit
    quick = 1 / (8 * quantities.bandwidth(frame["data_bandwidth"]))
    counts = [fd_frame(part, long) for part in pieces(size, 64)]
    low = sum(item[0] for item in counts) * bit + sum(item[1] for item in counts) * quick
    high = sum(item[2] for item in counts) * bit + sum(item[3] for item in counts) * quick
    return low - 3 * bit, high


def flexray_payload(frame: Mapping[str, Any]) -> int:
    """The bytes that a slot has, where that is stated; 0 elsewhere."""
    return int(str(frame.get("payload", "0 B")).removesuffix(" B"))


def flexray_bits(frame: Mapping[str, Any], data: int) -> int:
    """The bits from the first one low to the end of a frame: start, then two bits before each byte, then the end."""
    words = [0] * ((data + 1) // 2)
    payload = flexray_payload(frame) or 2 * len(words)
    bits = ["low"] * int(frame.get("transmission_start_bits", 15)) + ["frame start"]
    for _ in range(5 + payload + 3):
        bits += ["byte start"] * 2 + ["bit"] * 8
    return len(bits + ["end"] * 2)


@cache
def can_frame(data: int, long: bool) -> tuple[int, int]:
    """The fewest and the most bits of a CAN frame, the three between frames included."""
    bits = can_bits(data, long)
    return len(bits) + 3, len(bits) + 3 + stuffing(bits)


@cache
def fd_frame(data: int, long: bool) -> tuple[int, int, int, int]:
    """The slow and the quick bits of a CAN FD frame, at least and at most, the three between frames included."""
    bits = fd_bits(data, long)
    slow = sum(not fast for _, fast in bits)
    most = [3, 0]
    run = 0
    for number, (may, fast) in enumerate(bits):
        most[fast] += 1
        run += may
        if may and run == 5:  # the stuff bit goes at the rate of the bit behind it
            most[bits[number + 1][1]] += 1
            run = 1
    return slow - 2 + 3, len(bits) - slow + 2, most[0], most[1]


def pieces(size: int, most: int) -> Iterator[int]:
    """The sizes of the frames of a message."""
    while size > most:
        yield most
        size -= most
    yield size


def can_bits(data: int, long: bool) -> list[bool]:
    """Which bits of a CAN frame may be stuffed: all from the start to the end of the check sequence."""
    identifier = 11 + 1 + 1 + 18 + 1 + 2 if long else 11 + 1 + 1 + 1
    return [True] * (1 + identifier + 4 + 8 * data + 15) + [False] * (1 + 1 + 1 + 7)


def stuffing(bits: list[bool]) -> int:
    """The most stuff bits: the first after five equal bits, each further one after four more, which it begins."""
    count, run = 0, 0
    for may in bits:
        run += may
        if run == 5 and may:
            count, run = count + 1, 1
    return count


def fd_bits(data: int, long: bool) -> list[Bit]:
    """The bits of a CAN FD frame; stuff bits of the check sequence are part of it."""
    data = next(size for size in FD_SIZES if size >= data)
    head = 1 + (11 + 1 + 1 + 18 + 1 if long else 11 + 1 + 1) + 1 + 1 + 1
    check = 4 + (17 if data <= 16 else 21)
    fixed = len(range(0, check, 4))
    slow = [(True, False)] * head
    fast = [(True, True)] * (1 + 4 + 8 * data) + [(False, True)] * (check + fixed)
    return slow + fast + [(False, False)] * (1 + 1 + 1 + 7)


def longest_packet(frame: Any) -> int:
    """The bytes of an Ethernet frame with a payload of the whole MTU, from the addresses on."""
    body = frame if isinstance(frame, dict) else {}
    return 14 + (4 if body.get("vlan") == "true" else 0) + quantities.size(body.get("mtu", "1500 B"))


def packets(frame: Mapping[str, Any], size: int) -> Iterator[int]:
    """The bytes of each Ethernet frame from the addresses to the end of the payload."""
    mtu = quantities.size(frame.get("mtu", "1500 B"))
    mac = 14 + (4 if frame.get("vlan") == "true" else 0)
    internet = {"ipv4": 20, "ipv6": 40}[frame.get("network", "ipv4")]
    kind = frame.get("transport", "none")
    if kind == "udp":
        size += 8
        if size + internet <= mtu:
            yield mac + internet + size
            return
        room = mtu - internet - (8 if internet == 40 else 0)
        room -= room % 8
        for part in pieces(size, room):
            yield mac + internet + (8 if internet == 40 else 0) + part
        return
    header = {"none": 0, "tcp": internet + 20, "tcp_timestamps": internet + 32}[kind]
    for part in pieces(size, mtu - header):
        yield mac + header + part
