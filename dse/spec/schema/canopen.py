"""Identifiers of CANopen's default connection set: a function code, and the node that it is of.

The eleven bits are four of the function code and seven of the node (CAN in Automation, CiA 301, "CANopen application
layer and communication profile", section on the pre-defined connection set). ``T`` and ``R`` are as the node sees it:
it sends its TPDOs and TSDO, and receives its RPDOs and RSDO.
"""

from __future__ import annotations

import re

FUNCTIONS = {
    "EMCY": 0x080, "TPDO1": 0x180, "RPDO1": 0x200, "TPDO2": 0x280, "RPDO2": 0x300, "TPDO3": 0x380, "RPDO3": 0x400,
    "TPDO4": 0x480, "RPDO4": 0x500, "TSDO": 0x580, "RSDO": 0x600, "HEARTBEAT": 0x700,
}  # fmt: skip
"""Messages of each node, with the identifier to which its number is added."""
BROADCASTS = {"NMT": 0x000, "SYNC": 0x080, "TIME": 0x100}
"""Messages that exist once, for all nodes."""
MOST_NODE = 127
OF_NODE = re.compile(r"(\w+) of node (\d{1,9})")
PATTERN = rf"^({'|'.join(FUNCTIONS)}) of node ([1-9]|[1-9][0-9]|1[01][0-9]|12[0-7])$"
"""The names that a schema admits."""


def connection_set(text: str) -> int | None:
    """The identifier that a text means, such as ``TPDO1 of node 3`` or ``SYNC``; None where it is no such text.

    Raises
    ------
    ValueError
        where the function is unknown, or its node is none or not what it has, with what is wrong as its only argument.

    Examples
    --------
    >>> hex(connection_set("TPDO1 of node 3")), hex(connection_set("SYNC")), connection_set("0x183")
    ('0x183', '0x80', None)
    """
    if text in BROADCASTS:
        return BROADCASTS[text]
    match = OF_NODE.fullmatch(text)
    if match is None:
        if text in FUNCTIONS:
            raise ValueError(f"{text} is a function of each node, such as {text} of node 1")
        return None
    function, node = match[1], int(match[2])
    if function in BROADCASTS:
        raise ValueError(f"{function} has no node in CANopen's default connection set")
    if function not in FUNCTIONS:
        raise ValueError(f"{match[1]} is no function of CANopen's default connection set")
    if not 1 <= node <= MOST_NODE:
        raise ValueError(f"a node of CANopen is a number from 1 to {MOST_NODE}, got {node}")
    return FUNCTIONS[function] + node
