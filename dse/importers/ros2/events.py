"""Events of a trace of ros2_tracing: from CTF by babeltrace2's Python module, or as `babeltrace2 TRACE` prints them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from dse.support.errors import Diagnostic, ProblemError
from dse.support.files.foreign import reading
from dse.support.files.reading import UnreadableFileError, opened

MAGIC = b"\xc1\x1f\xfc\xc1"
DAY_NS = 86_400 * 10**9
HOW = "convert it: babeltrace2 TRACE > trace.txt, and import that; or install the module: apt install python3-bt2"
_LINE = re.compile(
    r"\[(?:(?P<date>\d{4}-\d\d-\d\d )?(?P<h>\d{1,12}):(?P<m>\d\d):(?P<s>\d\d)|(?P<seconds>\d{1,12}))\.(?P<ns>\d{9})\]"
    r"(?: \([^)]*\))?(?: \S+)*? (?P<name>[\w.]+(?::[\w.]+)?): (?P<rest>\{.*\})"
)
_FIELD = re.compile(r'(?<!\w)(\w+) = (?:"((?:[^"\\]|\\.)*)"|(0x[0-9A-Fa-f]+|-?\d+))', re.ASCII)
LONGEST_NUMBER = 40
MOST_NS = 2**63
LONGEST = 100_000
"""No line is longer: what is left of one is no event."""


class Event(NamedTuple):
    """An event: its name without the provider, its time in ns, its fields with those of its context, and its line.

    Field names are those of ros2_tracing; the line counts from 1 in the printed form, and is 0 for CTF.
    """

    name: str
    time_ns: int
    fields: Mapping[str, Any]
    line: int


def events_of(path: Path) -> Iterator[Event]:
    """The events of a trace, in order.

    Raises
    ------
    ProblemError
        when it is none, or it is CTF and there is no babeltrace2.
    """
    if path.is_dir():
        yield from _of_ctf(path)
    else:
        yield from _of_text(path)


def _stop(path: Path, message: str, hint: str = "", line: int = 1) -> ProblemError:
    return ProblemError([Diagnostic(message, "", str(path), line, hint=hint)])


def _of_ctf(path: Path) -> Iterator[Event]:
    if not any(path.rglob("metadata")):
        raise _stop(path, "this folder is no trace: it has no file `metadata`", "", 0)
    try:
        import bt2
    except ImportError:
        raise _stop(path, "a CTF trace is read by babeltrace2's Python module, which is not there", HOW, 0) from None
    with reading(path, "no trace that can be read"):
        for message in bt2.TraceCollectionMessageIterator(str(path)):
            if type(message) is not bt2._EventMessageConst:
                continue
            event = message.event
            fields: dict[str, Any] = {}
            of_packet = getattr(getattr(event, "packet", None), "context_field", None)  # which has the CPU
            for part in (of_packet, event.common_context_field, event.payload_field):
                fields |= {str(name): _plain(value) for name, value in part.items()} if part is not None else {}
            time_ns = message.default_clock_snapshot.ns_from_origin
            if not 0 <= time_ns < MOST_NS:
                raise _stop(path, f"an event at {time_ns} ns: no time from 0 to 2**63 ns", "", 0)
            yield Event(event.name.rpartition(":")[2], time_ns, fields, 0)


def _plain(value: Any) -> Any:
    try:
        return int(value)
    except (TypeError, ValueError):
        return str(value)


def _of_text(path: Path) -> Iterator[Event]:
    days, before, is_any = 0, 0, False
    try:
        with opened(path) as stream:
            if stream.read(4) == MAGIC:
                raise _stop(path, "this is one stream of a CTF trace: name its folder", HOW)
            stream.seek(0)
            for number, data in enumerate(iter(partial(stream.readline, LONGEST), b""), start=1):
                text = data.decode("utf-8", "replace").strip()
                if not text:
                    continue
                match = _LINE.fullmatch(text) if text.endswith("}") else None  # else it would be tried at every brace
                if match is None:
                    hint = "expected what `babeltrace2 TRACE` prints; is the file cut off?"
                    raise _stop(path, f"no event: {text[:60]!r}", hint, number)
                time_ns = _time_ns(match) + days * DAY_NS
                if match["h"] and time_ns + DAY_NS // 2 < before:
                    days, time_ns = days + 1, time_ns + DAY_NS
                if time_ns >= MOST_NS:
                    raise _stop(path, "this event is later than 2**63 ns", "", number)
                if time_ns < before:
                    raise _stop(path, "this event is earlier than the one before it", "one trace, in its order", number)
                before, is_any = time_ns, True
                fields = _fields(match["rest"])
                if fields is None:
                    raise _stop(path, f"a number of more than {LONGEST_NUMBER} digits", "", number)
                yield Event(match["name"].rpartition(":")[2], time_ns, fields, number)
    except UnreadableFileError as error:
        raise _stop(path, error.reason) from None
    except OSError as error:
        raise _stop(path, f"cannot be read: {error.strerror}") from None
    if not is_any:
        raise _stop(path, "the file is empty", "expected what `babeltrace2 TRACE` prints")


def _fields(text: str) -> dict[str, Any] | None:
    """The fields of an event by their names; None where a number is longer than any."""
    fields: dict[str, Any] = {}
    for name, quoted, number in _FIELD.findall(text):
        if len(number) > LONGEST_NUMBER:
            return None
        fields[name] = int(number, 16 if number.startswith("0x") else 10) if number else quoted
    return fields


def _time_ns(match: re.Match[str]) -> int:
    if match["seconds"] is not None:
        seconds = int(match["seconds"])
    else:
        seconds = int(match["h"]) * 3600 + int(match["m"]) * 60 + int(match["s"])
    return seconds * 10**9 + int(match["ns"])
