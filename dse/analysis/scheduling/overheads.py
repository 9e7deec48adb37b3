"""What delays threads beside the work of more urgent ones: sections that nothing interrupts, switches, interrupts.

A thread that has just begun a non-preemptive section keeps the CPU, however urgent what is released then: a thread is
blocked once in each busy period, for no longer than the longest section of any less urgent thread of its core
(A. Burns, "Preemptive priority based scheduling: an appropriate engineering approach", in Advances in Real-Time
Systems, 1994; R. J. Bril, J. J. Lukkien and W. F. J. Verhaegh, "Worst-case response time analysis of real-time tasks
under fixed-priority scheduling with deferred preemption", Real-Time Systems 42, 2009). Where in a job its section lies
is not known, so that a thread's own sections save it nothing.

Each job costs two context switches more than its execution time: to it and back from it (A. Burns and A. Wellings,
"Real-Time Systems and Programming Languages", response time analysis). Interrupts go before all threads. So does what
throttling takes: a budget is used up, at the earliest, when a period of it has `budget` of threads' work, and the gap
that is left ends with that period, so that gaps are no longer than period - budget, and end a period apart
(docs/semantics.md, section 4.5).
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any

from dse.analysis.scheduling.busy_window import Task, periodic
from dse.analysis.views import View
from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.space import Design, Space
from dse.space.model.trees import Tree, at, leaves
from dse.support.units import picked

KINDS = ("blocking", "context switches", "interrupts", "throttling")
"""What response times count beside execution times, where the problem states it."""


def stated_overheads(space: Space, design: Design | None = None) -> Mapping[str, tuple[str, ...]]:
    """For each of `KINDS` the threads or processors of which the problem states it, in the order of the file.

    With a `design` only what it chooses counts.
    """
    made = None if design is None else dict(enumerate(design))

    def found(tree: Tree) -> list[Any]:
        return list(leaves(tree, made))

    slots = {slot.name: [item for leaf in found(slot.interference) for item in leaf] for slot in space.processors}
    switching = [slot.name for slot in space.processors if any(found(slot.switch_ns))]
    blocking = [item.name for item in space.components if any(found(item.section_ns))]
    return {
        "blocking": tuple(blocking),
        "context switches": tuple(switching),
        "interrupts": tuple(name for name, items in slots.items() if any(not item.is_throttling for item in items)),
        "throttling": tuple(name for name, items in slots.items() if any(item.is_throttling for item in items)),
    }


def safe_bounds(space: Space, design: Design | None = None) -> Mapping[str, tuple[str, ...]]:
    """Why response times are safe bounds and need not be reached, each with the threads that make them so.

    Releases by events are counted as far apart or as close as their jitter lets them be, pieces of a thread and the
    jobs of a wait set with the longest that may come before them, budgets of reservations as late as they may come
    (docs/semantics.md, sections 4.2 and 4.6 to 4.8). What shares a core with such a thread is bounded so, too. With a
    `design` only what it chooses counts.
    """
    made = None if design is None else dict(enumerate(design))

    def is_any(tree: Tree, values: Container[object]) -> bool:
        return any(leaf in values for leaf in leaves(tree, made))

    threads = [item for item in space.components if item.section == "threads"]
    pieces = [item.pieces.thread for item in threads if item.pieces is not None]
    waiting = [item for item in space.executors if is_any(item.kind, ("wait_set", "polling"))]
    alone = [item for item in threads if item.pieces is None]
    stated = [item.name for item in alone if is_any(item.protocol, (*BY_INPUTS, "hybrid"))]
    unstated = [item.name for item in alone if is_any(item.protocol, (None,)) and is_any(item.period_ns, (None,))]
    reserved = [item.name for item in threads if item.reservation is not None]
    events = [item.name for item in alone if item.name in {*stated, *unstated}]
    return {
        "events dispatch": tuple(events),
        "segments make up": tuple(dict.fromkeys(pieces)),
        "a wait set runs": tuple(space.components[number].name for item in waiting for number in item.members),
        "reservations supply": tuple(reserved),
    }


def switching_ns(space: Space, number: int, view: View) -> int:
    """The time of two context switches for each job of a thread, to the job and back, in ns."""
    slot = space.processors[at(space.components[number].processor, view)]
    switch: int = at(slot.switch_ns, view)
    return 2 * switch


def section_ns(space: Space, number: int, longest_ns: int, view: View) -> int:
    """The longest part of a job of `longest_ns` during which no other thread gets the CPU: no longer than the job."""
    stated = at(space.components[number].section_ns, view)
    shorter: int = 0 if stated is None else picked("min", stated, longest_ns)
    return shorter


def interrupting(space: Space, numbers: Sequence[int], view: View) -> tuple[Task, ...]:
    """The interrupts of a processor as tasks that delay all threads of the core on which `numbers` run."""
    if not numbers:
        return ()
    slot = space.processors[at(space.components[numbers[0]].processor, view)]
    return tuple(periodic(item.name, item.worst_ns, item.period_ns) for item in at(slot.interference, view))
