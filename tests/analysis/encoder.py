"""Real frames: CAN 2.0, CAN FD (ISO 11898-1) and FlexRay as bits with their check sequences; EtherCAT as bytes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

CRC_15, CRC_17, CRC_21 = (15, 0x4599), (17, 0x1685B), (21, 0x102899)
FD_CODES = [*range(9), 12, 16, 20, 24, 32, 48, 64]


def number(value: int, width: int) -> list[int]:
    return [value >> place & 1 for place in reversed(range(width))]


def crc(bits: Sequence[int], kind: tuple[int, int], start: int = 0) -> list[int]:
    width, polynomial = kind
    register = start
    for bit in bits:
        top = register >> (width - 1) & 1
        register = register << 1 & ((1 << width) - 1)
        if top ^ bit:
            register ^= polynomial
    return number(register, width)


def stuffed(bits: Sequence[int]) -> list[int]:
    """With the complement after every five equal bits; a stuff bit is the first of what comes next."""
    found: list[int] = []
    run, last = 0, -1
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        found.append(bit)
        if run == 5:
            found.append(1 - bit)
            run, last = 1, 1 - bit
    return found


def destuffed(bits: Sequence[int]) -> list[int]:
    """What a receiver makes of it."""
    found: list[int] = []
    run, last, skip = 0, -1, False
    for bit in bits:
        if skip:
            assert bit != last
            run, last, skip = 1, bit, False
            continue
        run = run + 1 if bit == last else 1
        last = bit
        found.append(bit)
        skip = run == 5
    return found


def can(identifier: int, data: bytes, *, is_long: bool) -> tuple[list[int], list[int]]:
    """What is stuffed, with its stuff bits, and the rest up to the end of the frame."""
    if is_long:
        head = [0, *number(identifier >> 18, 11), 1, 1, *number(identifier & 0x3FFFF, 18), 0, 0, 0]
    else:
        head = [0, *number(identifier, 11), 0, 0, 0]
    bits = [*head, *number(len(data), 4), *(bit for byte in data for bit in number(byte, 8))]
    return stuffed([*bits, *crc(bits, CRC_15)]), [1, 0, 1, *[1] * 7]


def can_fd(identifier: int, data: bytes, *, is_long: bool) -> tuple[list[int], list[int], int]:
    """The bits at the slower rate, those at the faster one, and how many slow ones follow."""
    padded = data + bytes(next(size for size in FD_CODES if size >= len(data)) - len(data))
    if is_long:
        head = [0, *number(identifier >> 18, 11), 1, 1, *number(identifier & 0x3FFFF, 18), 0, 1, 0, 1]
    else:
        head = [0, *number(identifier, 11), 0, 0, 1, 0, 1]
    body = [0, *number(FD_CODES.index(len(padded)), 4), *(bit for byte in padded for bit in number(byte, 8))]
    whole = stuffed([*head, *body])
    slow = len(stuffed(head[:-1])) + 1  # a stuff bit behind the one that switches goes at the faster rate
    count = len(whole) - len(head) - len(body)
    gray = (count % 8) ^ (count % 8) >> 1
    counter = [*number(gray, 3), bin(gray).count("1") % 2]
    kind = CRC_17 if len(padded) <= 16 else CRC_21
    check = [*counter, *crc([*whole, *counter], kind, 1 << (kind[0] - 1))]
    fixed: list[int] = []
    for place, bit in enumerate(check):
        if place % 4 == 0:
            fixed.append(1 - (fixed or whole)[-1])
        fixed.append(bit)
    return whole[:slow], [*whole[slow:], *fixed], 1 + 1 + 1 + 7


FLEXRAY_HEADER_CRC, FLEXRAY_FRAME_CRC = (11, 0x385), (24, 0x5D6DCB)


def flexray(data: bytes, payload: int, *, start: int) -> list[int]:
    """A static frame of FlexRay on the channel: start sequences, coded bytes, end sequence (ISO 17458)."""
    words = payload // 2
    protected = [0, 0, *number(7, 11), *number(words, 7)]  # sync and startup bits, frame 7, length in words
    header = [0, 0, 1, *protected, *crc(protected, FLEXRAY_HEADER_CRC, 0x01A), *number(1, 6)]
    assert len(header) == 40
    body = header + [bit for byte in data.ljust(payload, b"\0") for bit in number(byte, 8)]
    body += crc(body, FLEXRAY_FRAME_CRC, 0xFEDCBA)
    found = [0] * start + [1]
    for place in range(0, len(body), 8):
        found += [1, 0, *body[place : place + 8]]
    return [*found, 0, 1]


def ethercat(data: bytes) -> bytes:
    """An EtherCAT frame with one datagram that reads and writes logical memory, from its preamble to its end."""
    datagram = struct.pack("<BBIHH", 12, 0, 0x10000, len(data) & 0x7FF, 0) + data + b"\0\0"
    payload = struct.pack("<H", len(datagram) | 1 << 12) + datagram
    frame = b"\xff" * 6 + b"\x02" * 6 + b"\x88\xa4" + payload.ljust(46, b"\0")
    return b"\x55" * 7 + b"\xd5" + frame + zlib.crc32(frame).to_bytes(4, "little")
