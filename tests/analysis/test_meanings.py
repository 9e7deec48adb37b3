"""A file whose figures count otherwise than under an earlier meaning of files is told so by `dse check`."""

from __future__ import annotations

import pytest

import dse

TEXT = """
dse: 1
name: older
totals: {share: '%', mass: g}
processor_types: {c: {cores: 2, totals: {share: 20 %, mass: 1 kg}}}
bus_types:
  short: {bandwidth: 1 Mbit/s, transmission_time: {per_byte: [1 us, 2 us]}}
  long: {bandwidth: 1 Mbit/s, transmission_time: {fixed: [5 us, 6 us], per_byte: 8 us}}
processors: {p: {type: c}, q: {type: c}}
buses: {x: {type: [short, long]}}
threads:
  a: {processor: p, period: 10 ms, compute_execution_time: 1 ms, priority: 3}
  b: {processor: [p, q], period: 20 ms, compute_execution_time: 1 ms, priority: [2, 4]}
connections: {w: {from: a, to: b, data_size: 8 B, bus: x}}
flows: {f: {path: [a, b]}}
requirements: [mass <= 5 kg]
objectives: [minimise latency of f]
"""
PRIORITIES = "threads of equal stated priority count in each other's response time on one core, in both directions"
FINE = "times that are no whole ns count exactly (rounded outwards to whole ns before): "
CORES = "the core of each thread is a decision, as something that is asked depends on it"
DEADLINES = (
    "every design meets the deadlines that are stated (each design only told of them before; `deadlines: none` asks "
    "for none): "
)
BEGIN = (
    "jobs of timers that share a clock may read when they begin, which lowers minimum latencies "
    "(at their release before: `communication: at_dispatch`): "
)
FELLOW = (
    "a callback without a bound delays the more urgent ones of its group by one job (none of them had a bound before): "
)
GROUP = """  c: {executor: g, period: 5 ms, compute_execution_time: 1 ms}
  d: {executor: g, compute_execution_time: 1 ms}
executors: {g: {kind: callback_group, processor: p}}
connections: {v: {from: a, to: d}, """
FIXED = "x.transmission_time.fixed is no decision where the chosen type does not state it: it counts as 0 ns"


def remarks(text: str, word: str) -> list[str]:
    return [remark for remark in dse.check(dse.loads(text)).remarks if word in remark]


@pytest.mark.parametrize(
    ("edit", "word", "said"),
    [
        (("[2, 4]", "[2, 3]"), "equal stated", [f"{PRIORITIES} (the shorter period went first before): a, b"]),
        (("[p, q]", "q"), "equal stated", []),
        (("[2, 4]", "3"), "equal stated", [f"{PRIORITIES} (the shorter period went first before): a, b"]),
        (("per_byte: 8 us", "per_byte: 0.1 ns"), "whole ns", [f"{FINE}bus_types.long.transmission_time.per_byte"]),
        (("per_byte: 8 us", "per_byte: 1/3 ns .. 8 us"), "whole ns",
         [f"{FINE}bus_types.long.transmission_time.per_byte.min"]),
        (("path: [a, b]", "path: [a, b], latency: 1 ps .. 1 s"), "whole ns", [f"{FINE}flows.f.latency"]),
        (("mass <= 5 kg", "share <= 100 %"), "own unit",
         ["limits on share count in its own unit, % (off by a factor of 100 before)"]),
        (("mass <= 5 kg", "utilisation <= 50 %"), "own unit", []),
        (("fixed: [5 us, 6 us]", "fixed: [5 us, 6 us]"), "no decision", [f"{FIXED}, which was an option before"]),
        (("fixed: [5 us, 6 us], ", ""), "no decision", []),
        (("requirements:", "deadlines: all\nrequirements:"), CORES,
         [f"{CORES} (`core: first_fit` puts them as before): a, b"]),
        (("priority: 3}", "priority: 3, core: first_fit}\ndeadlines: all"), CORES, []),
        (("priority: 3}", "priority: 3, deadline: 5 ms}"), "deadlines", [f"{DEADLINES}a"]),
        (("priority: 3}", "priority: 3, offset: 1 ms, response_time: 4 ms}"), "begin", [f"{BEGIN}a"]),
        (("priority: 3}", "priority: 3, offset: 1 ms, response_time: 4 ms, communication: at_dispatch}"), "begin", []),
        (("priority: 3}", "priority: 3, offset: 1 ms}"), "begin", []),
        (("connections: {", GROUP), "of its group", [f"{FELLOW}g"]),
        (("connections: {", GROUP.replace("  d: {", "  d: {period: 9 ms, ")), "of its group", []),
    ],
)  # fmt: skip
def test_what_counts_otherwise_is_told(edit: tuple[str, str], word: str, said: list[str]) -> None:
    if "first_fit}" in edit[1]:
        text = TEXT.replace("priority: 3}", "priority: 3, core: first_fit}").replace("[2, 4]}", "[2, 4], core: [1, 2]}")
        text = text.replace("requirements:", "deadlines: all\nrequirements:")
    else:
        text = TEXT.replace(*edit)
    assert remarks(text, word) == said


def test_nothing_is_told_of_a_file_that_no_change_touches() -> None:
    text = TEXT.replace("{fixed: [5 us, 6 us], per_byte: 8 us}", "{per_byte: 8 us}")
    assert remarks(text, "before") == []


SEGMENTS = """
dse: 1
name: pieces
processor_types: {c: {}, g: {serves: fifo}}
processors: {p: {type: c}, gpu: {type: g}}
threads:
  a:
    processor: p
    period: 40 ms
    segments: [PIECES]
  b: {processor: gpu, period: 4 ms, compute_execution_time: 2 ms}
flows: {f: {path: [a]}}
objectives: [minimise latency of f]
"""
PIECES = (
    "{compute_execution_time: 1 ms}, {processor: gpu, compute_execution_time: 8 ms}, {compute_execution_time: 1 ms}"
)
WAITED = "what waited for a segment of a thread goes before its next segment (it was not counted before): "


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("", "", [f"{WAITED}a"]),
        ("  b: {processor: gpu,", "  b: {processor: p,", []),
        ("  b: {processor: gpu, period: 4 ms, compute_execution_time: 2 ms}",
         "  b: {processor: p, period: 40 ms, segments: [PIECES]}", []),
        ("  b: {processor: gpu, period: 4 ms, compute_execution_time: 2 ms}",
         "  b: {processor: p, priority: 3, period: 40 ms, segments: [PIECES]}", []),
    ],
)  # fmt: skip
def test_segments_beside_what_may_wait_for_them_are_told(old: str, new: str, said: list[str]) -> None:
    text = SEGMENTS.replace(old, new) if old else SEGMENTS
    assert remarks(text.replace("PIECES", PIECES), "what waited") == said


def test_segments_on_an_accelerator_that_serves_by_priority_are_told() -> None:
    other = "  b: {processor: p, period: 40 ms, segments: [PIECES]}\nflows:"
    text = SEGMENTS.replace("serves: fifo", "serves: priority")
    text = text.replace("  b: {processor: gpu, period: 4 ms, compute_execution_time: 2 ms}\nflows:", other)
    assert remarks(text.replace("PIECES", PIECES), "what waited") == [f"{WAITED}a, b"]


LATE = (
    "what the first segment of a thread without a bound goes before has none either "
    "(that segment counted as if it came in time before): a"
)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("b: {processor: gpu", "b: {processor: p", [LATE]),
        ("", "", []),
        ("b: {processor: gpu", "b: {processor: p, deadline: 4 ms", [LATE]),
        ("period: 40 ms", "period: 40 ms\n    deadline: 40 ms", []),
        ("flows:", "deadlines: all\nflows:", []),
        ("flows:", "requirements: [response time of a <= 1 s]\nflows:", []),
    ],
)
def test_what_a_late_thread_may_delay_is_told(old: str, new: str, said: list[str]) -> None:
    """Where no limit keeps the thread in time, and where it begins; without a change `b` is on the accelerator only."""
    text = SEGMENTS if old.startswith("b:") or not old else SEGMENTS.replace("b: {processor: gpu", "b: {processor: p")
    assert old in text
    assert remarks(text.replace(old, new).replace("PIECES", PIECES), "first segment of") == said


HOMES = """
dse: 1
name: t
processor_types: {c: {}, g: {serves: fifo}}
processors: {p: {type: c}, gpu: {type: g}}
bus_types: {can: {bandwidth: 1 Mbit/s}, dds: {virtual: true, transmission_time: {c: {fixed: 1 ms}, g: {fixed: 9 ms}}}}
buses: {wire: {type: can}, middleware: {type: dds, bus: wire}}
threads:
  a:
    processor: p
    process: one
    period: 40 ms
    segments: [{compute_execution_time: 1 ms}, {processor: gpu, compute_execution_time: 8 ms}]
  b: {processor: p, process: one, period: 4 ms, compute_execution_time: 1 ms}
connections: {m: {from: a, to: b, bus: wire, data_size: 8 B}}
flows: {f: {path: [a, b]}}
objectives: [minimise latency of f]
"""
AT_HOME = (
    "messages of a thread count where the thread runs, on its own processor and in its process "
    "(before, where its first or last segment runs): a"
)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([], [AT_HOME]),
        ([("processor: gpu, compute", "compute")], []),
        ([("b: {processor: p, process: one", "b: {processor: p")], []),
        ([("b: {processor: p, process: one", "b: {processor: p"), ("bus: wire, data", "bus: middleware, data")],
         [AT_HOME]),
    ],
)  # fmt: skip
def test_messages_of_a_thread_that_ends_elsewhere_are_told(changes: list[tuple[str, str]], said: list[str]) -> None:
    """Inside a process they load no bus, and middleware runs where the thread does."""
    text = HOMES
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    assert remarks(text, "messages of a thread") == said
