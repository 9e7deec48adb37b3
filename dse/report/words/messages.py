"""Messages that wait for their bus: response against deadline, what each waits for, and a Gantt chart of each bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dse.analysis.diagnosis.bus_timelines import worst_bus_period
from dse.analysis.messages.late import LateMessage
from dse.analysis.messages.waits import MessageResponse, named_identifiers
from dse.analysis.scheduling.policies.buses import Arbitrated
from dse.analysis.scheduling.policies.transmit_queues import QueuedMessage
from dse.answers.tables.display import readable
from dse.report.amounts import listed
from dse.report.page import Table, Timeline
from dse.report.words.scheduling import GROWS, busy_timeline, deadline_cells, in_ms, no_bound_words
from dse.space.model.space import Design, Space
from dse.support.units.text import count_words

HEADINGS = (
    "message", "identifier", "priority", "transmission", "queued", "response time", "deadline", "", "slack", "blocked",
    "waits for",
)  # fmt: skip
NUMBERS = (1, 2, 3, 5, 6, 8)
LEAST = 2
"""The greatest number of rows of a table on a terminal."""
DETAIL = 9
"""Columns from here on a terminal leaves out."""
MOST_NAMED = 4


def message_tables(messages: Mapping[str, Sequence[MessageResponse]], brief: int | None = None) -> Iterator[Table]:
    """For each bus the messages that wait for it, those that are late or closest to their deadline first.

    A terminal shows `brief` rows in all.
    """
    shown = {bus: of_bus for bus, of_bus in messages.items() if of_bus}
    for bus, of_bus in shown.items():
        ordered = sorted(of_bus, key=_slack)
        rows = [_row(item) for item in ordered]
        kept = [at for at in range(len(HEADINGS)) if any(row[at] for row in rows)]
        numbers = tuple(position for position, at in enumerate(kept) if at in NUMBERS)
        table = Table(
            f"Response times of messages on {bus}",
            tuple(HEADINGS[at] for at in kept),
            tuple(tuple(row[at] for at in kept) for row in rows),
            numbers,
            bars=tuple(map(_share, ordered)) if any(item.deadline_ns for item in ordered) else (),
        )
        if brief is not None:
            spare = tuple(position for position, at in enumerate(kept) if at >= DETAIL)[::-1]
            rest = "and {} more messages, and what each waits for (--all)"
            table = replace(table, brief=max(LEAST, brief // len(shown)), rest=rest, spare=spare)
        yield table


def bus_timelines(messages: Mapping[str, Sequence[MessageResponse]]) -> Iterator[Timeline]:
    """The timeline of the worst busy period of each bus.

    Of buses on which several messages wait for each other; nothing for the others.
    """
    for bus, of_bus in messages.items():
        busy = worst_bus_period(of_bus)
        if busy is not None and len({piece.name for piece in busy.pieces}) > 1:
            yield busy_timeline(f"Bus {bus}", busy)


def _share(item: MessageResponse) -> float:
    """How much of the time to its deadline a message takes: nothing without one, all where it is late."""
    if not item.deadline_ns:
        return 0.0
    late = item.response_ns is None or item.meets_deadline is False
    return 1.0 if late or item.response_ns is None else min(1.0, float(item.response_ns) / item.deadline_ns)


def _slack(item: MessageResponse) -> tuple[bool, float]:
    """The share of its deadline that a message takes, the greatest first; those without one behind."""
    if item.deadline_ns is None:
        return True, 0.0
    if item.response_ns is None:
        return False, float("-inf")
    return False, -float(item.response_ns / item.deadline_ns)


def _row(item: MessageResponse) -> tuple[str, ...]:
    queued = [
        f"every {in_ms(stream.period_ns)}" + (f" +{in_ms(stream.jitter_ns)}" if stream.jitter_ns else "")
        for stream in item.releases or ()
    ]
    return (
        _named(item),
        "" if item.identifier is None else f"{item.identifier:#x}",
        "" if item.priority is None else str(item.priority),
        in_ms(item.transmission_ns[1]),
        ", ".join(queued),
        *deadline_cells(item.response_ns, item.deadline_ns, item.meets_deadline),
        f"{in_ms(item.blocking_ns)} by {item.blocked_by}" if item.blocking_ns else "",
        _waits_for(item),
    )


def _named(item: MessageResponse) -> str:
    """The connection whose message it is, with what else is carried in it."""
    return f"{item.name} with {listed(item.carries)}" if item.carries else item.name


def _waits_for(item: MessageResponse) -> str:
    """Which messages go first, the longest times first; of one without a bound those that are the cause."""
    if item.because:
        return no_bound_words(item.because)
    if item.needed_ppm is not None:
        needed = readable(item.needed_ppm, "ppm", digits=1)
        has_faults = isinstance(item.window, Arbitrated | QueuedMessage) and item.window.faults is not None
        faults = ", with faults," if has_faults else ""
        return f"no bound, for it and what goes first{faults} need {needed} of the bus"
    if item.response_ns is None:
        return GROWS
    first = sorted(item.interference, key=lambda one: -one.work_ns)
    waits = [
        f"{count_words(one.jobs, 'transmission')} of {one.name} ({in_ms(one.work_ns)})" for one in first[:MOST_NAMED]
    ]
    if len(first) > MOST_NAMED:
        work = sum(one.work_ns for one in first[MOST_NAMED:])
        waits.append(f"{len(first) - MOST_NAMED} more ({in_ms(work)})")
    if item.earlier_ns:
        waits.insert(0, f"earlier transmissions of its own ({in_ms(item.earlier_ns)})")
    if item.faults:
        waits.append(f"{count_words(item.faults, 'fault')} ({in_ms(item.faults_ns)})")
    if item.over_ns:
        waits.append(f"of which {in_ms(item.over_ns)} are over at its arrival")
    return ", ".join(waits)


def identifier_words(space: Space, design: Design) -> list[str]:
    """The identifiers of messages of a design that may have any: ``m3 0x10 (0x183 in the baseline)``.

    In the order of the file; empty where each message has a stated one.
    """
    found = []
    for name, number in named_identifiers(space, design).items():
        index = space.decision_index(f"{name}.identifier")
        option = space.baseline.get(index) if index is not None else None
        before = None if index is None or option is None else space.decisions[index].values[option]
        is_other = isinstance(before, int) and f"{before:#x}" != number
        found.append(f"{name} {number}" + (f" ({before:#x} in the baseline)" if is_other else ""))
    return found


def late_message_words(late: LateMessage) -> str:
    """The reason why a message is late: messages before it, and an identifier or priority that would be early enough.

    ``m3 (0x13) ends 0.7 ms late on b: 0.54 ms of its own, behind 2 transmissions of m0 (1.08 ms); in time
    right before m1, with 0x10``. In a flow that misses its limit: ``m3 (0x13) waits 1.08 ms for b, behind 2
    transmissions of m0 (1.08 ms); 0.7 ms less right before …``.
    """
    item = late.message
    name = _named(item) if item.identifier is None else f"{_named(item)} ({item.identifier:#x})"
    name = name if item.priority is None else f"{_named(item)} (priority {item.priority})"
    end = "has no bound" if late.late_ns is None else f"ends {in_ms(late.late_ns)} late"
    parts = [] if not item.blocking_ns else [f"{item.blocked_by} that has begun ({in_ms(item.blocking_ns)})"]
    waits = _waits_for(item)
    parts += [waits] if waits else []
    behind = f", behind {', '.join(parts)}" if parts else ""
    if late.flow and item.response_ns is not None:
        waited = in_ms(item.response_ns - item.transmission_ns[1])
        return f"{late.flow}: {name} waits {waited} for {late.bus}{behind}{_would_do(late)}"
    return f"{name} {end} on {late.bus}: {in_ms(item.transmission_ns[1])} of its own{behind}{_would_do(late)}"


def _would_do(late: LateMessage) -> str:
    kind = "identifier" if late.message.priority is None else "priority"
    in_time, not_enough = "in time", f"late with every {kind} while the others keep theirs"
    if late.flow and late.late_ns is not None:
        in_time = f"{in_ms(late.late_ns)} less"
        not_enough = f"no {kind} saves {in_ms(late.late_ns)} while the others keep theirs"
    if late.message.priority is not None:
        if late.priority is None:
            return f"; {not_enough}"
        return f"; {in_time} with priority {late.priority}{_but_late(late)}"
    if late.before is None:
        return "" if late.message.identifier is None else f"; {not_enough}"
    free = "" if late.identifier is None else f", with {late.identifier:#x} for example"
    return f"; {in_time} right before {late.before}{free}{_but_late(late)}"


def _but_late(late: LateMessage) -> str:
    """The words for the messages that a change of identifier or priority would make late; empty without any."""
    named = listed(late.makes_late[:MOST_NAMED])
    more = f" and {len(late.makes_late) - MOST_NAMED} more" if len(late.makes_late) > MOST_NAMED else ""
    return f", but then {named}{more} would be late" if late.makes_late else ""
