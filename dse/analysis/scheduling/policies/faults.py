"""Faults of a CAN wire: each costs an error frame, and the frame that it hit is sent again.

K. Tindell's model: up to `burst` faults come at once, others an interval apart, so that in a window of t there are up
to burst - 1 + ceil(t / interval). A fault costs a message at most 31 bits of error frame, and the longest frame among
it and the more urgent ones: a less urgent frame that is hit has to compete anew (K. Tindell, A. Burns and A. J.
Wellings, "Calculating controller area network (CAN) message response times", Control Engineering Practice 3(8), 1995;
R. I. Davis and others, Real-Time Systems 35, 2007). A fault counts where it comes before the message is over:

    w(q) = B + q C + sum over the more urgent of ceil((w(q) + J + bit) / T) C + E(w(q) + C)

(docs/semantics.md, section 5.4)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from dse.analysis.scheduling.busy_window import Stream, Task, most_jobs
from dse.support.units import Exact

ERROR_BITS = 31
"""The longest error frame, with its flags of several nodes, delimiter and the gap behind it, in bits."""
NAME = "faults"


def faults_of_wire(interval_ns: int, burst: int, bit_ns: Exact) -> Task:
    """The faults of a wire as a task whose jobs are error frames, without the frames that are sent again.

    >>> most_jobs(faults_of_wire(100, 2, 1), 150), faults_of_wire(100, 2, 1).worst_ns
    (3, 31)
    """
    return Task(NAME, ERROR_BITS * bit_ns, (Stream(interval_ns, (burst - 1) * interval_ns),))  # type: ignore[arg-type]


def with_frame(faults: Task | None, longest_ns: Exact) -> Task | None:
    """The faults of a wire where each has a frame of up to `longest_ns` sent again; None without faults."""
    return None if faults is None else replace(faults, worst_ns=faults.worst_ns + longest_ns)  # type: ignore[arg-type]


def work_of(faults: Task | None) -> Callable[[Exact], Exact]:
    """The cost of the faults in a window, in ns, as a function of its length in ns; always 0 without faults."""
    return _none if faults is None else partial(_cost_ns, faults)


def _cost_ns(faults: Task, window_ns: Exact) -> Exact:
    return most_jobs(faults, window_ns) * faults.worst_ns


def _none(_: Exact) -> Exact:
    return 0
