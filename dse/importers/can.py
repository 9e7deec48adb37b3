"""CAN databases (DBC, KCD, SYM, ARXML) as problem files: what is sent how often, by whom, on a bus with frames.

Messages are read by cantools (the extra ``can``). A message is on the wire once, however many receive it: it becomes
one connection, which ends at its receiver where there is one, or at the node that ``--to`` names.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from fractions import Fraction
from pathlib import Path
from typing import Any

from dse.importers.can_dbc import MOST_NAMED, UNUSED_SIGNALS, check_statements, mended
from dse.importers.can_sizes import check_sizes
from dse.importers.registry import Imported, Key, Place
from dse.support.errors import Diagnostic, ProblemError, UsageError
from dse.support.extras import needed_for
from dse.support.files.foreign import reading
from dse.support.files.reading import UnreadableFileError, read_bytes
from dse.support.files.xml import xml_text
from dse.support.units import UnitError, format_bandwidth, format_rate, parse_bandwidth_bps, parse_duration_ns
from dse.support.units.table import Rounding
from dse.support.units.text import Hexadecimal, first_of

MOST_BYTES = 64_000_000
XML = ("kcd", "arxml")
FORMATS = ("dbc", "sym", *XML)
MOST_LOOKED_AT = 4096
"""The number of bytes that tell the format of a database of another suffix."""
UNKNOWN = "unknown sender"
DOUBTFUL_BPS = 1000
"""No CAN bus is so slow: some tools write kbit/s."""
LEFT_OUT = 0
"""The cycle time of messages that are left out."""
CYCLES = "a cycle time for all, such as 100 ms, or for some, such as NAME=20 ms, or none, which leaves them out"
HOW_CYCLES = "--cycle '100 ms' for all; --cycle 'NAME=20 ms, DIAG_*=1 s' for some; --cycle none leaves them out"


def read(path: Path, options: Mapping[str, Any]) -> Imported:
    """A CAN database as the document of a problem file.

    Raises
    ------
    ProblemError
        when the file is none, has no messages, or does not say how fast its buses are and no option does.
    UsageError
        when an option is wrong, or cantools is not installed.
    """
    if path.stat().st_size == 0:
        raise ProblemError([Diagnostic("the file is empty: expected a CAN database", file=str(path), line=1)])
    form, text = _text(path)
    check_sizes(path, text, form)
    remarks: list[Diagnostic] = []
    if form == "dbc":
        text, remarks = mended(path, text)
    database = _database(path, text, form)
    return _Reader(path, text, database, options, remarks).read()


def _text(path: Path) -> tuple[str, str]:
    """The format of a database, by its suffix or else by its beginning, and its text."""
    try:
        data = read_bytes(path, MOST_BYTES, "a CAN database")
    except UnreadableFileError as error:
        raise ProblemError([Diagnostic(error.reason, file=str(path))]) from None
    form = path.suffix.lower().lstrip(".")
    if form not in FORMATS:
        start = data[:MOST_LOOKED_AT].lstrip()
        xml = "arxml" if b"AUTOSAR" in start else "kcd"
        form = xml if start.startswith(b"<") else "sym" if start.startswith(b"FormatVersion") else "dbc"
    if form in XML:
        return form, xml_text(path, data)
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "cp1252"
    try:
        return form, data.decode("utf-8-sig") if data[:3] == b"\xef\xbb\xbf" else data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ProblemError([Diagnostic(f"the file is not {encoding} text", file=str(path), line=line)]) from None


def _database(path: Path, text: str, form: str) -> Any:
    with needed_for("A CAN database", "can"):
        from cantools.database import load_string
    logging.getLogger("cantools").addHandler(logging.NullHandler())  # else what it warns of is printed as it is
    with reading(path, "no CAN database", "", lambda words: _place(words, text)):
        database = load_string(text, form, strict=False)
    if form == "dbc":
        check_statements(path, text)
    if not getattr(database, "messages", None):
        hint = "is the file cut off?"
        raise ProblemError([Diagnostic("it has no CAN messages", file=str(path), line=1, hint=hint)])
    return database


def _place(words: str, text: str) -> tuple[int, int]:
    """The line of the message that cantools names, where it names one."""
    named = re.search(r"\bmessage (\w+)", words)
    there = re.search(rf"\b{named[1]}\b", text) if named else None
    return (text.count("\n", 0, there.start()) + 1 if there else 1), 0


class _Reader:
    """Makes the document of one database."""

    def __init__(
        self, path: Path, text: str, database: Any, options: Mapping[str, Any], remarks: Sequence[Diagnostic]
    ) -> None:
        self.path, self.database, self.options = path, database, options
        self.remarks = [*remarks]
        self.places: dict[Key, Place] = {}
        self.lines = _message_lines(text)
        self.cycles = _cycles(options.get("cycle"))
        self.bandwidth = _option(options, "bandwidth", parse_bandwidth_bps)
        self.data_bandwidth = _option(options, "data-bandwidth", parse_bandwidth_bps)
        self.nodes: dict[str, None] = {}
        self.unordered: set[str] = set()
        self.to = options.get("to", "")

    def _remark(self, message: str, hint: str = "", line: int = 0) -> None:
        self.remarks.append(Diagnostic(message, file=str(self.path), line=line, hint=hint, severity="warning"))

    def _check_all_were_read(self) -> None:
        """A message that the text begins, but that was not read: cantools passes over what is not whole."""
        known = {_key(message) for message in self.database.messages}
        missing = [line for key, line in self.lines.items() if key not in known]
        if missing:
            hint = "is the file cut off?"
            raise ProblemError(
                [Diagnostic("this message is not whole", file=str(self.path), line=line, hint=hint) for line in missing]
            )

    def read(self) -> Imported:
        self._check_all_were_read()
        messages = sorted(self.database.messages, key=lambda message: (message.bus_name or "", message.frame_id))
        names = [node.name for node in self.database.nodes]
        ends = {name for message in messages for name in (*message.senders, *message.receivers)}
        if self.to and self.to not in {*names, *ends}:
            raise UsageError(f"--to {self.to}: there is no such node; nodes: {', '.join(sorted({*names, *ends}))}")
        missing: list[Diagnostic] = []
        messages = self._with_cycles(messages, missing)
        buses = dict.fromkeys(message.bus_name or "can0" for message in messages)
        self.unordered = _without_order(messages)
        types = {}
        for name in buses:
            try:
                types[name] = self._bus_type(name, [m for m in messages if (m.bus_name or "can0") == name])
            except ProblemError as error:
                missing += error.diagnostics
        if missing:
            raise ProblemError(missing)
        connections = dict(self._connections(messages, {*buses, *names, *ends}))
        document: dict[str, Any] = {
            "dse": 1,
            "name": self.path.stem,
            "source": f"{self.path.name} (CAN database)",
            "assumptions": [
                "Every message is sent once in each cycle; what is sent on events counts with the cycle stated for it.",
                "Nodes are devices without figures of their own: their latencies and threads are still to be stated.",
            ],
            "bus_types": {f"{name}_type": body for name, body in types.items()},
            "buses": {name: {"type": f"{name}_type"} for name in buses},
            "devices": {name: {} for name in self.nodes},
            "connections": connections,
        }
        is_named = all(message.bus_name for message in messages)
        made_up = frozenset() if is_named else frozenset(("can0", "can0_type"))
        return Imported(document, tuple(self.remarks), self.places, made_up=made_up)

    def _cycle_ns(self, message: Any) -> Fraction:
        """The cycle time of a message: its own, or that stated for it."""
        if message.cycle_time:
            return Fraction(message.cycle_time) * 10**6
        stated = _stated(self.cycles, message.name)
        assert stated
        return Fraction(stated)

    def _with_cycles(self, messages: Sequence[Any], missing: list[Diagnostic]) -> list[Any]:
        """The messages that have a cycle time, of the file or of the option.

        Where some have none all messages are returned, and `missing` gets a mistake with their names.

        Raises
        ------
        ProblemError
            when all are left out.
        UsageError
            when the option names messages that are not there.
        """
        open_ = [message for message in messages if not message.cycle_time]
        for pattern in self.cycles:
            if pattern != "*" and not any(fnmatchcase(message.name, pattern) for message in open_):
                raise UsageError(f"--cycle {pattern}=...: no message without a cycle time has this name")
        cycle_of = {id(message): _stated(self.cycles, message.name) for message in open_}
        unknown = [message for message in open_ if cycle_of[id(message)] is None]
        if unknown:
            count = "1 message has" if len(unknown) == 1 else f"{len(unknown)} messages have"
            text = f"{count} no cycle time: {first_of([message.name for message in unknown], MOST_NAMED)}"
            line = min(self.lines.get(_key(message), 1) for message in unknown)
            missing.append(Diagnostic(text, file=str(self.path), line=line, hint=HOW_CYCLES))
            return list(messages)
        names: dict[bool, list[str]] = {False: [], True: []}
        for message in open_:
            names[cycle_of[id(message)] == LEFT_OUT].append(message.name)
        if names[False]:
            some = first_of(names[False], MOST_NAMED)
            self._remark(f"{len(names[False])} without a cycle time count with --cycle: {some}")
        if names[True]:
            some = first_of(names[True], MOST_NAMED)
            self._remark(f"{len(names[True])} without a cycle time are left out (--cycle): {some}")
        kept = [message for message in messages if cycle_of.get(id(message)) != LEFT_OUT]
        if not kept:
            raise ProblemError(
                [Diagnostic("no message has a cycle time", file=str(self.path), line=1, hint=HOW_CYCLES)]
            )
        return kept

    def _bus_type(self, name: str, messages: Sequence[Any]) -> dict[str, Any]:
        stated = next((bus for bus in self.database.buses if (bus.name or "can0") == name), None)
        bandwidth = self.bandwidth or getattr(stated, "baudrate", None) or self._attribute("Baudrate")
        if not bandwidth or bandwidth <= DOUBTFUL_BPS:
            text = f"nothing says the bit rate of {name}"
            if bandwidth:
                text = f"the bit rate of {name} is {bandwidth} bit/s, slower than CAN: is it in kbit/s?"
            hint = "give --bandwidth, such as --bandwidth '500 kbit/s'"
            raise ProblemError([Diagnostic(text, file=str(self.path), line=1, hint=hint)])
        long = any(message.is_extended_frame for message in messages)
        if long and not all(message.is_extended_frame for message in messages):
            self._remark(
                f"{name} has identifiers of 11 and of 29 bits: all count as 29, none is kept, no waiting is counted"
            )
        body: dict[str, Any] = {"bandwidth": format_bandwidth(int(bandwidth)), "exclusive": True}
        frame: dict[str, Any] = {"protocol": "can", "identifier_bits": 29} if long else {"protocol": "can"}
        if any(message.is_fd for message in messages):
            rate = self.data_bandwidth or getattr(stated, "fd_baudrate", None)
            if not rate:
                hint = "give --data-bandwidth, such as --data-bandwidth '2 Mbit/s'"
                text = f"{name} has CAN FD messages, and nothing says the bit rate of their data"
                raise ProblemError([Diagnostic(text, file=str(self.path), line=1, hint=hint)])
            frame |= {"protocol": "can_fd", "data_bandwidth": format_bandwidth(int(rate))}
            if not all(message.is_fd for message in messages):
                self._remark(f"{name} has messages of CAN 2.0 and of CAN FD: all count as CAN FD")
        return {**body, "frame": frame, "source": self.path.name}

    def _attribute(self, name: str) -> int | None:
        attributes = getattr(self.database.dbc, "attributes", None) or {}
        value = getattr(attributes.get(name), "value", None)
        if value is None:
            definitions = getattr(self.database.dbc, "attribute_definitions", None) or {}
            value = getattr(definitions.get(name), "default_value", None)
        return value if isinstance(value, int) and value > 0 else None

    def _connections(self, messages: Sequence[Any], taken: set[str]) -> Iterator[tuple[str, dict[str, Any]]]:
        names = set(taken)
        for message in messages:
            name = message.name
            if name in names or name == "none":
                name = next(
                    f"{message.name}_{number}" for number in range(2, 10**6) if f"{message.name}_{number}" not in names
                )
            names.add(name)
            line = self.lines.get(_key(message), 0)
            if line:
                self.places["connections", name] = Place(str(self.path), line, 1)
            yield name, self._connection(message, line)

    def _connection(self, message: Any, line: int) -> dict[str, Any]:
        sender = message.senders[0] if message.senders else UNKNOWN
        if not message.senders:
            self._remark(f"{message.name}: no sender is stated", "it is sent by a device of that name", line)
        self.nodes[sender] = None
        receivers = sorted(set(message.receivers) - {sender})
        body: dict[str, Any] = {"from": sender}
        to = self.to if self.to in receivers else receivers[0] if len(receivers) == 1 else None
        if to is not None:
            self.nodes[to] = None
            body["to"] = to
        body["data_size"] = f"{message.length} B"
        said = [f"identifier {message.frame_id:#x}"]
        body["rate"] = format_rate(10**9 / self._cycle_ns(message))
        if not message.cycle_time:
            said.append("cycle time stated at the import (--cycle)")
        if len(receivers) > 1:
            said.append(f"received by {', '.join(receivers)}")
        body["bus"] = message.bus_name or "can0"
        if body["bus"] not in self.unordered:
            body["identifier"] = Hexadecimal(message.frame_id)
        body["source"] = f"{self.path.name}{f':{line}' if line else ''}: {'; '.join(said)}"[:1000]
        return body


def _without_order(messages: Sequence[Any]) -> set[str]:
    """The buses whose messages have identifiers of both lengths, or one identifier twice: none of these is kept."""
    seen: dict[str, list[tuple[bool, int]]] = {}
    for message in messages:
        key = bool(message.is_extended_frame), int(message.frame_id)
        seen.setdefault(message.bus_name or "can0", []).append(key)
    return {bus for bus, key in seen.items() if len({long for long, _ in key}) > 1 or len({*key}) < len(key)}


def _key(message: Any) -> int:
    """The identifier as DBC files have it: the topmost bit says that it is long."""
    key: int = message.frame_id | message.is_extended_frame << 31
    return key


def _option(options: Mapping[str, Any], name: str, parse: Any) -> int | None:
    text = options.get(name)
    if text is None:
        return None
    try:
        size = int(parse(str(text)))
    except UnitError as error:
        raise UsageError(f"--{name} {text}: {error}") from error
    if size <= 0:
        raise UsageError(f"--{name} {text}: it must be above zero")
    return size


def _cycles(text: Any) -> dict[str, int]:
    """The cycle times in ns that ``--cycle`` states, by pattern of names; `LEFT_OUT` for ``none``.

    >>> _cycles("Wake*=20 ms, Log=none, 1 s")
    {'Wake*': 20000000, 'Log': 0, '*': 1000000000}
    """
    cycles: dict[str, int] = {}
    for part in str(text).split(",") if text is not None else ():
        pattern, sign, stated = (item.strip() for item in part.rpartition("="))
        pattern = pattern if sign else "*"
        if not pattern or not stated or pattern in cycles:
            raise UsageError(f"--cycle {part.strip()}: expected {CYCLES}")
        ns = LEFT_OUT
        if stated != "none":
            ns = _option({"cycle": stated}, "cycle", lambda words: parse_duration_ns(words, Rounding.EXACT)) or 0
        cycles[pattern] = ns
    return cycles


def _stated(cycles: Mapping[str, int], name: str) -> int | None:
    """The cycle time that the option states for a message: by the first pattern that fits, else for all."""
    own = (ns for pattern, ns in cycles.items() if pattern != "*" and fnmatchcase(name, pattern))
    return next(own, cycles.get("*"))


def _message_lines(text: str) -> dict[int, int]:
    """The line of each message of a DBC file by its identifier, whose topmost bit says that it is long."""
    line_of: dict[int, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        match = re.match(r"\s*BO_ (\d{1,10}) ", line)
        if match and UNUSED_SIGNALS not in line:
            line_of.setdefault(int(match[1]), number)
    return line_of
