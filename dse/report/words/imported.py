"""The end of an import: how much was read, what is to be filled in, what was guessed, and warnings by their kind."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from dse.importers.registry import STORED_PORTS
from dse.support.errors import Diagnostic
from dse.support.units.text import first_of

MOST_NAMED = 6
MOST_ALIKE = 3
"""The greatest number of warnings that differ in names alone; more of them are counted."""
MOST_LINES = 12
MOST_COMPARED = 300
_GUESS = re.compile(
    r"\b(is|are) taken (for|to)\b|\bcounts? (as|with)\b|\ball count as\b|\bby its name\b|\bthe trace counts\b"
)
"""How importers say that something is not what a file states."""
_NAME = re.compile(r"'[^']*'|\"[^\"]*\"|\S*[\d/_.$:<>(){}@]\S*|\b[A-Z]\w*")
Body = Mapping[str, Any]


def import_block(document: Mapping[str, Any], remarks: Sequence[Diagnostic], *, every: bool = False) -> list[str]:
    """The lines that an import ends with.

    Parameters
    ----------
    document
        the problem file that was made, as plain data.
    remarks
        what was guessed, left out or not understood.
    every
        show every warning, not one of each kind with a count.

    Examples
    --------
    >>> print(*import_block({"threads": {"nav": {"period": "5 ms", "processor": "pc"}}}, ()), sep=chr(10))
    Read: 1 thread, no connections, no flows.
    Fill in:
      threads.nav.compute_execution_time [ms]: without it the thread counts as taking no time
      connections [from, to]: nothing says who sends to whom
      flows [path]: without one there is no end-to-end latency
    """
    lines = [f"Read: {_counts(document)}."]
    wanted = list(_fill_in(document))
    if wanted:
        lines += ["Fill in:", *(f"  {line}" for line in wanted)]
    guesses = [item for item in remarks if _GUESS.search(item.message)]
    others = [item for item in remarks if not _GUESS.search(item.message)]
    for title, items in (("Guessed", guesses), ("Warnings", others)):
        if items:
            lines += [f"{title} ({len(items)}):", *(f"  {line}" for line in _grouped(items, every))]
    return lines


def _counts(document: Mapping[str, Any]) -> str:
    counts = []
    for section in ("threads", "devices", "buses", "connections", "flows"):
        number = len(_without_data(document.get(section) or {}))
        if number or section in ("threads", "connections", "flows"):
            one = "bus" if section == "buses" else section[:-1]
            counts.append(f"no {section}" if not number else f"1 {one}" if number == 1 else f"{number} {section}")
    return ", ".join(counts)


def _fill_in(document: Mapping[str, Any]) -> Iterator[str]:
    """The fields that a problem needs and the document lacks: field, unit, and reason."""
    threads, devices = (document.get(name) or {} for name in ("threads", "devices"))
    connections = document.get("connections") or {}
    types = {**(document.get("thread_types") or {}), **(document.get("device_types") or {})}
    sent = {body.get("from") for body in connections.values() if not {"rate", "data_rate"} & body.keys()}

    def has(body: Body, key: str) -> bool:
        named = body.get("type")
        names = named if isinstance(named, list) else [named]
        return key in body or any(key in types.get(name, {}) for name in names)

    def lacking(bodies: Mapping[str, Body], is_so: Callable[[str, Body], bool]) -> list[str]:
        return [name for name, body in bodies.items() if is_so(name, body)]

    triggered = {body.get("to") for body in connections.values() if body.get("port") not in STORED_PORTS}
    threads = _without_data(threads)
    steps = [step for flow in (document.get("flows") or {}).values() for step in flow["path"] if isinstance(step, dict)]
    figured = {step["element"] for step in steps if len(step) > 1}
    taking = ("compute_execution_time", "latency", "response_time")
    timed = lacking(threads, lambda name, body: name not in figured and not any(has(body, key) for key in taking))
    yield from _line("threads", timed, threads, "compute_execution_time [ms]", "without it {} counts as taking no time")
    open_ = lacking(threads, lambda name, body: not has(body, "period") and _is_timed(name, body, triggered))
    yield from _line("threads", open_, threads, "period [ms]", "nothing says how often {} runs")
    open_ = lacking(devices, lambda name, body: not has(body, "period") and name in sent and name not in triggered)
    yield from _line("devices", open_, devices, "period [ms]", "nothing says how often {} sends")
    outside = lacking(connections, lambda name, body: "from" not in body and not {"rate", "data_rate"} & body.keys())
    yield from _line("connections", outside, connections, "rate [Hz]", "nothing says how often {} comes from outside")
    sized = lacking(connections, lambda name, body: not {"data_size", "data_rate", "message"} & body.keys())
    yield from _line("connections", sized, connections, "data_size [B]", "without it {} costs nothing on a bus")
    sent_on = {name: body for name, body in connections.items() if body.get("port") != "data_access"}
    free = lacking(sent_on, lambda name, body: "bus" not in body and {"from", "to"} <= body.keys())
    yield from _line("connections", free, sent_on, "bus [name of a bus]", "without one {} costs nothing")
    if not connections:
        yield "connections [from, to]: nothing says who sends to whom"
    if not document.get("flows"):
        yield "flows [path]: without one there is no end-to-end latency"


def _without_data(bodies: Mapping[str, Body]) -> dict[str, Body]:
    """The components of a section that work: shared data, which stand among the threads, do not."""
    return {name: body for name, body in bodies.items() if (body or {}).get("category") != "data"}


def _is_timed(name: str, body: Body, triggered: set[Any]) -> bool:
    """Whether a thread needs a period: its timer dispatches it, or nothing does."""
    return body.get("dispatch_protocol", "aperiodic" if name in triggered else "periodic") in ("periodic", "hybrid")


def _line(section: str, names: Sequence[str], of: Mapping[str, Any], field: str, why: str) -> Iterator[str]:
    if not names:
        return
    one = section[:-1]
    if len(names) == 1:
        yield f"{section}.{names[0]}.{field}: {why.format(f'the {one}')}"
        return
    count = f"all {len(of)}" if len(names) == len(of) else f"{len(names)} of {len(of)}"
    yield f"{section}.NAME.{field}: {why.format('each')}; {count}: {first_of(names, MOST_NAMED)}"


def _grouped(items: Sequence[Diagnostic], every: bool) -> Iterator[str]:
    """Warnings in their order; of those that differ in names alone the first, with how many there are."""
    groups: dict[tuple[str, str], list[Diagnostic]] = {}
    for item in items:
        groups.setdefault((_NAME.sub("", item.message[:MOST_COMPARED]), item.hint), []).append(item)
    left = MOST_LINES
    for number, alike in enumerate(groups.values()):
        shown = alike if every or len(alike) <= MOST_ALIKE else alike[:1]
        if not every and left < len(shown) and number < len(groups) - 1:
            more = sum(map(len, list(groups.values())[number:]))
            yield f"and {more} more: --all shows them"
            return
        left -= len(shown)
        for item in shown:
            more = len(alike) - len(shown)
            yield f"{item}{f' [and {more} more like this]' if more else ''}"
