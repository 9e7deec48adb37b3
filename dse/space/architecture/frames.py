"""The bits of a message on the wire: frames with their headers, gaps, stop bits and stuff bits.

A bus type with a `frame` counts these bits in its load, its busy time and its transmission times; see
docs/semantics.md, section 5.3. Sizes are those of whole messages in bytes, protocol overhead included. Every function
takes and gives exact numbers, and works on traced ones (`dse.questions.sensitivity.traced_numbers`) as on integers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal, TypeAlias

from dse.space.model.trees import Tree, at, graft, leaves
from dse.spec.schema.frames import (
    CanFdFrame,
    CanFrame,
    EthercatFrame,
    EthernetFrame,
    FlexrayFrame,
    FrameModel,
    SerialFrame,
)
from dse.support.units import NS_PER_S, Exact

Protocol: TypeAlias = Literal["can", "can_fd", "serial", "ethernet", "ethercat", "flexray"]
Bits: TypeAlias = tuple[Exact, Exact]
"""Least and most bits, of the length of one bit at the bandwidth of the bus."""
CAN_BYTES = 8
MOST_BYTES = {"can": 8, "can_fd": 64}
"""The most bytes that a frame of CAN carries."""
FD_SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
"""The sizes that a CAN FD frame can have; others are filled up (ISO 11898-1)."""
INTERFRAME = 3
PREAMBLE, MAC_HEADER, CHECK_SEQUENCE, GAP = 8, 14, 4, 12
"""Bytes of an Ethernet frame: preamble with start of frame, addresses and type, check sequence, gap (IEEE 802.3)."""
LEAST_PAYLOAD, TAG = 46, 4
IP_HEADER: Mapping[str, int] = {"ipv4": 20, "ipv6": 40}
UDP_HEADER, FRAGMENT_HEADER = 8, 8
ETHERCAT_HEADER, DATAGRAM = 2, 12
"""Bytes of EtherCAT: the header of a frame; the header of a datagram with its working counter (IEC 61158-4-12)."""
ETHERCAT_MOST = 1500 - ETHERCAT_HEADER - DATAGRAM
FLEXRAY_MOST, FLEXRAY_HEADER, FLEXRAY_TRAILER = 254, 5, 3
"""Bytes of a frame of FlexRay (ISO 17458-2): the longest payload, the header, the check sequence."""
FLEXRAY_START, FLEXRAY_END, FLEXRAY_BYTE, FLEXRAY_IDLE = 1, 2, 10, 11
"""Bits of FlexRay: frame start sequence, frame end sequence, a byte with its start sequence, channel idle delimiter."""
TCP_HEADER: Mapping[str, int] = {"tcp": 20, "tcp_timestamps": 32}


@dataclass(frozen=True)
class Frame:
    """How a bus frames messages. Which fields count depends on the protocol; `stop_halves` are half bits.

    `payload_bytes` is the size of all static slots of FlexRay (0: each frame is as long as its message asks for).
    """

    protocol: Protocol
    identifier_bits: int = 11
    data_bandwidth_bps: int = 0
    data_bits: int = 8
    parity: bool = False
    stop_halves: int = 2
    transport: str = "none"
    network: str = "ipv4"
    vlan: bool = False
    mtu_bytes: int = 1500
    payload_bytes: int = 0
    start_bits: int = 15


def wire_bits(frame: Frame, size: int, bandwidth_bps: int) -> Bits:
    """Least and most bits that a message takes on the wire.

    The least are those until its last bit has come; the most are those until the next frame may begin (the gap between
    frames of CAN and Ethernet), with as many stuff bits as there can be. At least one frame is sent.
    """
    return _BITS[frame.protocol](frame, size, bandwidth_bps)


def _frames(size: int, most: int) -> tuple[int, int]:
    """How many full frames come before the last one, and what that carries (0 only of an empty message)."""
    full = -(-size // most) - 1 if size > 0 else 0
    return full, size - full * most


def _can_bits(frame: Frame, size: int, _: int) -> Bits:
    """CAN 2.0: ``g + 8 n + 13 + floor((g + 8 n - 1) / 4)`` bits with n data bytes, of which g + 8 n can be stuffed.

    g is 34 with identifiers of 11 bits and 54 with 29: Davis, Burns, Bril, Lukkien, Controller Area Network (CAN)
    schedulability analysis, Real-Time Systems 35 (2007). A message of more than 8 bytes goes in several frames.
    """
    stuffable = 34 if frame.identifier_bits == 11 else 54
    full, rest = _frames(size, CAN_BYTES)

    def bits(data: int) -> Bits:
        plain = stuffable + 8 * data + 10 + INTERFRAME
        return plain, plain + (stuffable + 8 * data - 1) // 4

    (least, most), (least_full, most_full) = bits(rest), bits(CAN_BYTES)
    return least + full * least_full - INTERFRAME, most + full * most_full


def _fd_bits(frame: Frame, size: int, bandwidth_bps: int) -> Bits:
    """CAN FD (ISO 11898-1:2015) with its two bit rates, in bits of the slower one.

    At the slower rate: from the start of the frame to the bit that switches (17 bits, 36 with long identifiers), and
    from the end of the check sequence on (delimiter, acknowledge, its delimiter, 7 bits of end of frame, 3 between
    frames). At the faster one: the error state, 4 bits of length, data, 4 bits that count stuff bits, a check sequence
    of 17 bits (21 beyond 16 bytes), and the fixed stuff bits of these two fields, one before every 4 bits. What can be
    stuffed is all from the start to the data. The bits in which the rate changes (the one that switches, and the
    delimiter) count at the faster rate for the least and at the slower one for the most.
    """
    slow = 17 if frame.identifier_bits == 11 else 36
    full, rest = _frames(size, FD_SIZES[-1])
    fast = Fraction(bandwidth_bps, 1) / frame.data_bandwidth_bps

    def bits(data: int) -> Bits:
        padded = next(fits for fits in FD_SIZES if data <= fits)
        check, fixed = (17, 6) if padded <= 16 else (21, 7)
        quick = 5 + 8 * padded + 4 + check + fixed
        stuffed, slowly_stuffed = (slow + 5 + 8 * padded - 1) // 4, (slow - 2) // 4  # the last slow bit switches
        end = 1 + 1 + 7 + INTERFRAME
        least = slow - 1 + end + (quick + 2) * fast
        return least, slow + 1 + end + slowly_stuffed + (quick + stuffed - slowly_stuffed) * fast

    (least, most), (least_full, most_full) = bits(rest), bits(FD_SIZES[-1])
    return least + full * least_full - INTERFRAME, most + full * most_full


def _serial_bits(frame: Frame, size: int, _: int) -> Bits:
    """RS-232, RS-485: each byte is a character with a start bit, data bits, a parity bit or none, and stop bits."""
    character = Fraction(2 + 2 * frame.data_bits + 2 * frame.parity + frame.stop_halves, 2)
    return size * character, size * character


def _ethernet_bits(frame: Frame, size: int, _: int) -> Bits:
    """Ethernet (IEEE 802.3), and IP with UDP (whose messages are cut into IP fragments) or TCP (cut into segments).

    Acknowledgements of TCP are not counted.
    """
    total = sum(count * _ethernet_bytes(frame, payload) for count, payload in _payloads(frame, size))
    return 8 * (total - GAP), 8 * total


def _ethernet_bytes(frame: Frame, payload: int) -> int:
    """The bytes of a frame of Ethernet with the gap behind it."""
    floor = LEAST_PAYLOAD - (TAG if frame.vlan else 0)
    head = PREAMBLE + MAC_HEADER + (TAG if frame.vlan else 0) + CHECK_SEQUENCE + GAP
    return head + (payload if payload >= floor else floor)


def _payloads(frame: Frame, size: int) -> Iterator[tuple[int, int]]:
    """How many frames of which payload a message goes in: full ones, and the last one."""
    mtu = frame.mtu_bytes
    if frame.transport == "none":
        head, most, once = 0, mtu, 0
    elif frame.transport == "udp":
        header = IP_HEADER[frame.network]
        if size + UDP_HEADER + header <= mtu:
            yield 1, header + UDP_HEADER + size
            return
        head = header + (FRAGMENT_HEADER if frame.network == "ipv6" else 0)
        most, once = (mtu - head) // 8 * 8, UDP_HEADER
    else:
        head, once = IP_HEADER[frame.network] + TCP_HEADER[frame.transport], 0
        most = mtu - head
    full, rest = _frames(size + once, most)
    yield full, head + most
    yield 1, head + rest


def _ethercat_bits(frame: Frame, size: int, _: int) -> Bits:
    """EtherCAT: an Ethernet frame with a header of 2 bytes and a datagram: 10 bytes, the data, 2 of working counter.

    A message of more than 1486 bytes goes in several frames.
    """
    full, rest = _frames(size, ETHERCAT_MOST)

    def length(data: int) -> int:
        payload = ETHERCAT_HEADER + DATAGRAM + data
        return PREAMBLE + MAC_HEADER + CHECK_SEQUENCE + GAP + (payload if payload >= LEAST_PAYLOAD else LEAST_PAYLOAD)

    total = full * length(ETHERCAT_MOST) + length(rest)
    return 8 * (total - GAP), 8 * total


def _flexray_bits(frame: Frame, size: int, _: int) -> Bits:
    """The static segment of FlexRay (ISO 17458-4): words of 2 bytes, each byte as 10 bits, between start and end.

    A frame has the transmission start sequence, the frame start sequence (1 bit), header (5 bytes), payload and check
    sequence (3 bytes), and the frame end sequence (2 bits); the channel is idle 11 bits later, which the most count.
    Slots, and the cycle in which they come, are not looked at.
    """
    most = frame.payload_bytes or FLEXRAY_MOST
    full, rest = _frames(size, most)

    def bits(data: int) -> int:
        payload = frame.payload_bytes or -(-data // 2) * 2
        coded = FLEXRAY_BYTE * (FLEXRAY_HEADER + payload + FLEXRAY_TRAILER)
        return frame.start_bits + FLEXRAY_START + coded + FLEXRAY_END + FLEXRAY_IDLE

    total = full * bits(most) + bits(rest)
    return total - FLEXRAY_IDLE, total


_BITS: Mapping[Protocol, Callable[[Frame, int, int], Bits]] = {
    "can": _can_bits,
    "can_fd": _fd_bits,
    "serial": _serial_bits,
    "ethernet": _ethernet_bits,
    "ethercat": _ethercat_bits,
    "flexray": _flexray_bits,
}


def wire_ns(frame: Frame, size: int, bandwidth_bps: int) -> tuple[Exact, Exact]:
    """Least and most time of a message on the wire; see `wire_bits`.

    In ns, exact: the bits of `wire_bits` divided by the bandwidth of the bus.
    """
    least, most = wire_bits(frame, size, bandwidth_bps)
    unit = Fraction(NS_PER_S, 1) / bandwidth_bps
    return least * unit, most * unit


def last_frame_ns(frame: Frame, size: int, bandwidth_bps: int) -> tuple[Exact, Exact]:
    """The longest time of the last frame of a message, and of the longest of its frames.

    Those of CAN and of Ethernet compete one by one; a message in other frames is sent as a whole. Of a message in
    several frames of Ethernet the longest counts as one of the whole `mtu`.
    """
    if frame.protocol == "ethernet":
        times = ethernet_frames_ns(frame, size, bandwidth_bps)
        largest = _ethernet_bytes(frame, frame.mtu_bytes) * Fraction(8 * NS_PER_S, bandwidth_bps)
        return times[-1][1], times[-1][1] if len(times) == 1 else largest
    most = {"can": CAN_BYTES, "can_fd": FD_SIZES[-1]}.get(frame.protocol)
    if most is None or size <= most:
        whole = wire_ns(frame, size, bandwidth_bps)[1]
        return whole, whole
    _, rest = _frames(size, most)
    return wire_ns(frame, rest, bandwidth_bps)[1], wire_ns(frame, most, bandwidth_bps)[1]


def ethernet_frames_ns(frame: Frame, size: int, bandwidth_bps: int) -> tuple[tuple[Exact, Exact], ...]:
    """The least and most time of each frame of a message on Ethernet, in order, in ns.

    The gap behind the last one counts for the most only.
    """
    unit = Fraction(8 * NS_PER_S, bandwidth_bps)
    each = [_ethernet_bytes(frame, payload) for count, payload in _payloads(frame, size) for _ in range(count)]
    last = each[-1]
    return (*((item * unit, item * unit) for item in each[:-1]), ((last - GAP) * unit, last * unit))


def wire_bytes(frame: Frame, size: int, bandwidth_bps: int) -> Exact:
    """The most that a message takes on the wire, in eighths of its bits: what counts in the load of the bus.

    Exact bytes: bits on the wire divided by 8, headers, gaps and stuff bits included.
    """
    return wire_bits(frame, size, bandwidth_bps)[1] / Fraction(8)


def frame_at(fixed_ns: Tree, view: Any) -> Frame | None:
    """The frame of a bus (`dse.space.model.space.Bus.fixed_ns`) in a design; None where its type has none.

    `view` gives the options of the design that the tree asks for.
    """
    leaf = at(fixed_ns, view)
    return leaf if isinstance(leaf, Frame) else None


def is_framed(fixed_ns: Tree) -> bool:
    """Whether some type of a bus has a frame.

    Judged over all leaves, without a design.
    """
    return any(isinstance(leaf, Frame) for leaf in leaves(fixed_ns))


def bit_units(fixed_ns: Tree, bandwidth_bps: Tree) -> set[tuple[Fraction, int]]:
    """The unit of which all numbers of bits on a bus are multiples, with the bandwidth, for each possible frame.

    Pairs of a unit in bits and a bandwidth in bit/s; the time scale of the search is a common multiple of their
    quotients.
    """

    def pairs(leaf: Any) -> Tree:
        return graft(bandwidth_bps, lambda bps: (leaf, bps)) if isinstance(leaf, Frame) else None

    found = set()
    for pair in leaves(graft(fixed_ns, pairs)):
        if isinstance(pair, tuple) and pair[1] is not None:
            frame, bandwidth = pair
            fast = Fraction(bandwidth, frame.data_bandwidth_bps) if frame.protocol == "can_fd" else Fraction(1)
            unit = Fraction(1, 2) if frame.protocol == "serial" else Fraction(1, fast.denominator)
            found.add((unit, int(bandwidth)))
    return found


LEAST_MTU, MOST_MTU = 128, 65535
"""A unit of transfer has room for the headers and some data; IP counts its length in 16 bits."""


def frame_of(model: FrameModel) -> Frame:
    """The frame that a bus type states.

    A `Frame` with the parameters of its protocol; defaults are those of the schema (docs/semantics.md on frames).
    """
    match model:
        case CanFrame():
            return Frame("can", model.identifier_bits)
        case CanFdFrame():
            return Frame("can_fd", model.identifier_bits, data_bandwidth_bps=int(model.data_bandwidth))
        case SerialFrame():
            parity = model.parity != "none"
            return Frame("serial", data_bits=model.data_bits, parity=parity, stop_halves=model.stop_bits)
        case EthernetFrame():
            return Frame(
                "ethernet",
                transport=model.transport,
                network=model.network,
                vlan=model.vlan,
                mtu_bytes=int(model.mtu),
            )
        case EthercatFrame():
            return Frame("ethercat")
        case FlexrayFrame():
            return Frame("flexray", payload_bytes=int(model.payload or 0), start_bits=model.transmission_start_bits)
    raise AssertionError("no such frame")
