"""Response times as tables, and who has a core when as a Gantt chart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from dse.analysis.diagnosis.timelines import SECTION, BusyPeriod, worst_busy_period
from dse.analysis.scheduling.responses import Response
from dse.answers.tables.display import readable
from dse.report.amounts import listed
from dse.report.page import Lane, Table, Timeline
from dse.support.units import Exact
from dse.support.units.text import count_words

SAID = {None: "", True: "met", False: "MISSED"}


HEADINGS = (
    "core", "thread", "execution", "releases", "response time", "deadline", "", "slack", "blocked", "waits for",
)  # fmt: skip
NUMBERS = (0, 2, 4, 5, 7, 8)
CORES = "Response times on {}, by core and priority"
GROWS = "no bound: the later it ends, the closer together comes what it waits for"
LEAST = 2
"""The greatest number of rows of a table on a terminal."""
NAMED = 1
"""The column of threads."""
MOST_LANES = 16
"""The greatest number of lanes of a timeline."""
ALWAYS = 7
"""Columns from here on are there where they say something."""


def _response_table(processor: str, responses: Sequence[Response]) -> Table:
    """The threads of a processor by core and priority, with their waits and response times."""
    rows = [_row(item, processor) for item in responses]
    is_served = any(item.is_served for item in responses)
    caption = f"Response times on {processor}, which serves one job at a time" if is_served else CORES.format(processor)
    kept = [at for at in range(int(is_served), len(HEADINGS)) if at < ALWAYS or any(row[at] for row in rows)]
    shown = tuple(tuple(row[at] for at in kept) for row in rows)
    numbers = tuple(position for position, at in enumerate(kept) if at in NUMBERS)
    bars = tuple(map(_share, responses)) if any(item.deadline_ns for item in responses) else ()
    named = kept.index(NAMED)
    return Table(caption, tuple(HEADINGS[at] for at in kept), shown, numbers, label=named, bars=bars)


def _share(item: Response) -> float:
    """How much of the time to its deadline a thread takes: nothing without one, all where it is late."""
    if not item.deadline_ns:
        return 0.0
    return 1.0 if item.response_ns is None else min(1.0, float(item.response_ns) / item.deadline_ns)


def response_tables(responses: Mapping[str, Sequence[Response]], brief: int | None = None) -> Iterator[Table]:
    """For each processor what runs on it; a terminal shows `brief` rows in all, without what they wait for.

    Times in ms; processors without response times have no table. At least `LEAST` rows of each are shown.
    """
    shown = {processor: on_processor for processor, on_processor in responses.items() if on_processor}
    for processor, on_processor in shown.items():
        table = _response_table(processor, on_processor)
        if brief is not None:
            rows = max(LEAST, brief // len(shown))
            what = "threads and pieces" if any(item.is_piece for item in on_processor) else "threads"
            spare = tuple(at for at, name in enumerate(table.headings) if name in HEADINGS[ALWAYS:])[::-1]
            rest = f"and {{}} more {what}, and what each waits for (--all)"
            table = replace(table, brief=rows, rest=rest, spare=spare)
        yield table


def busy_timelines(responses: Mapping[str, Sequence[Response]]) -> Iterator[Timeline]:
    """The timeline of the worst busy period of each core.

    A timeline of the busy period of each core on which several tasks run; nothing for the others.
    """
    for processor, on_processor in responses.items():
        for core in sorted({item.core for item in on_processor}):
            busy = worst_busy_period(core, on_processor)
            if busy is not None and len({piece.name for piece in busy.pieces}) > 1:
                is_served = any(item.is_served for item in on_processor)
                yield busy_timeline(processor if is_served else f"Core {core} of {processor}", busy)


def busy_timeline(where: str, busy: BusyPeriod) -> Timeline:
    """The timeline of a core or bus until the end of the job that has the least time left.

    The lowest lane is that of its thread or message. Of more than `MOST_LANES` those that take least share one.
    """
    whole = float(busy.end_ns)
    names = dict.fromkeys(piece.name for piece in busy.pieces)
    others = [name for name in names if name not in (busy.name, SECTION)]
    work = dict.fromkeys(names, 0.0)
    for piece in busy.pieces:
        work[piece.name] += float(piece.end_ns - piece.start_ns)
    section = [name for name in names if name == SECTION]
    room = MOST_LANES - len(section) - 1
    least = sorted(others, key=lambda name: -work[name])[room - 1 :] if len(others) > room else []
    rows = [(name, {name}) for name in [*section, *(name for name in others if name not in least)]]
    rows += [(f"{len(least)} more", set(least))] if least else []
    lanes = []
    for name, shown in [*rows, (busy.name, {busy.name})]:
        pieces = [item for item in busy.pieces if item.name in shown]
        lanes.append(Lane(name, tuple((float(item.start_ns) / whole, float(item.end_ns) / whole) for item in pieces)))
    response = busy.end_ns - busy.released_ns
    said = f"{busy.name} ends {in_ms(response)} after its release"
    if busy.deadline_ns is not None:
        left = busy.deadline_ns - response
        said += f", {in_ms(left)} before its deadline" if left >= 0 else f", {in_ms(-left)} after its deadline"
    caption = f"{where} where it is tightest: {said}"
    if busy.is_segment:
        said = f"{busy.name} ends at most {in_ms(response)} after its own release, with all interference"
        caption = f"{where} where a segment takes longest: {said}"
    marks = ((float(busy.released_ns) / whole, f"| is the release of that job, at {in_ms(busy.released_ns)}."),)
    return Timeline(caption, tuple(lanes), ("0", in_ms(busy.end_ns)), marks if busy.released_ns else ())


def _row(item: Response, processor: str) -> tuple[str, ...]:
    releases = [
        f"every {in_ms(stream.period_ns)}" + (f" +{in_ms(stream.jitter_ns)}" if stream.jitter_ns else "")
        for stream in item.task.streams
    ]
    response, deadline = item.response_ns, item.deadline_ns
    hosts = ", ".join(host for host in (item.executor, item.reservation) if host not in ("", processor))
    named = f"{item.name} ({hosts})" if hosts else item.name
    switching = item.task.worst_ns - item.worst_ns
    return (
        str(item.core),
        named,
        in_ms(item.worst_ns) + (f" +{in_ms(switching)}" if switching else ""),
        ", ".join(releases),
        *deadline_cells(response, deadline, item.meets_deadline),
        f"{in_ms(item.blocked_ns)} by {item.blocked_by}" if item.blocked_ns else "",
        _waits_for(item),
    )


def _waits_for(item: Response) -> str:
    """Whose jobs go before the worst one, how many of each, and what of all that is over when it is released.

    Of a thread without a bound why it has none.
    """
    if item.response_ns is None:
        return _endless_words(item)
    waits = [f"{count_words(delay.jobs, 'job')} of {delay.name} ({in_ms(delay.work_ns)})" for delay in item.delays]
    earlier, over = item.parts.earlier_jobs, item.parts.over_ns
    if earlier:
        waits.insert(0, f"{count_words(earlier, 'earlier job')} ({in_ms(item.parts.earlier_ns)})")
    if item.before_ns:
        waits.insert(0, f"its earlier pieces ({in_ms(item.before_ns)})")
    if over:
        waits.append(f"of which {in_ms(over)} are over when it is released")
    return ", ".join(waits) or (f"its turn in {item.executor}" if item.executor else "")


def _endless_words(item: Response) -> str:
    """The reason why a thread has no bound, as one phrase."""
    if item.because:
        return no_bound_words(item.because)
    if item.needed_ppm is not None:
        return f"no bound: with work of higher priority it needs {readable(item.needed_ppm, 'ppm')} of the core"
    if item.is_piece:
        return "no bound: a job need not end before the next one comes"
    if item.reservation:
        return f"no bound: {item.reservation} does not get what it needs"
    return GROWS


def deadline_cells(response_ns: Exact | None, deadline_ns: Exact | None, meets: bool | None) -> tuple[str, ...]:
    """A response time, the deadline, whether it is met, and how much sooner the response is; "" of what is missing.

    Four texts for a row of a table, times in ms. Negative slack means a missed deadline.
    """
    return (
        "unbounded" if response_ns is None else in_ms(response_ns),
        "" if deadline_ns is None else in_ms(deadline_ns),
        SAID[meets],
        "" if deadline_ns is None or response_ns is None else in_ms(deadline_ns - response_ns),
    )


def no_bound_words(causes: Sequence[str]) -> str:
    """The reason why a response time has no bound: the threads or messages that have none themselves.

    One phrase; `causes` are names, in the order in which they were found.
    """
    return f"no bound, for {listed(causes)} {'has' if len(causes) == 1 else 'have'} none"


def in_ms(value_ns: Exact) -> str:
    """A time in ns as tables of response times show it: in ms, of six digits."""
    return readable(value_ns, "ns", digits=6)
