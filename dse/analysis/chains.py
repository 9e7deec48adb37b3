"""The exact latency of a flow whose timers share clocks: job by job over the hyperperiod (docs/semantics.md, 3.6).

The sum of neighbours' waits (`dse.analysis.clocks`) bounds it: not every pair of neighbours need be at its worst for
the same datum. Between releases whose phase drifts, each stretch of a flow is at its worst for some datum.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, lcm

from dse.analysis.clocks import METHOD, pair_of
from dse.analysis.latency import arrival_ns, flow_rows, step_rows
from dse.analysis.rates import is_periodic
from dse.analysis.views import View
from dse.space.trees import at
from dse.space.types import Component, Flow, Space, Step
from dse.units import Exact, is_unbounded

MOST_RELEASES = 50_000
"""A hyperperiod with more releases to follow than this is not looked through: the bound stands for the exact value."""


@dataclass(frozen=True, slots=True)
class Hop:
    """To a reader released every `period_ns` from `offset_ns` on, `least_ns` to `most_ns` after the release before."""

    period_ns: Exact
    offset_ns: Exact
    least_ns: Exact
    most_ns: Exact
    error_ns: Exact = 0


@dataclass(slots=True)
class Run:
    """A stretch of a flow on one clock: its first release, the hops from there, and the waits that bound it."""

    period_ns: Exact
    offset_ns: Exact
    hops: list[Hop] = field(default_factory=list)
    bounds_ns: tuple[Exact, Exact] = (0, 0)


def exact_range_ns(space: Space, flow: Flow, view: View) -> tuple[Exact, Exact, bool]:
    """The shortest and the longest latency of a flow, and whether they are exact.

    Where a hyperperiod is too long (`MOST_RELEASES`), or clocks differ by an error, they are safe bounds.
    """
    least, most = Fraction(0), Fraction(0)
    runs, others = _runs(space, flow, view)
    for low, high in others:
        least, most = least + low, most + high
    is_exact = True
    for run in runs:
        found = None if is_unbounded(most) else longest_and_shortest_ns(run)
        is_exact = is_exact and found is not None and not any(hop.error_ns for hop in run.hops)
        low, high = run.bounds_ns
        if found is not None:
            low = max(low, found[0] - sum(hop.least_ns for hop in run.hops))
            high = min(high, found[1] - sum(hop.most_ns for hop in run.hops))
        least, most = least + low, most + high
    return least, most, is_exact


def repeats_too_late(space: Space, flow: Flow, view: View) -> bool:
    """Whether the hyperperiod of some stretch of a flow on one clock is too long to look through."""
    return any(_releases(run) is None for run in _runs(space, flow, view)[0])


def _runs(space: Space, flow: Flow, view: View) -> tuple[list[Run], list[tuple[Exact, Exact]]]:
    """The stretches of a flow on one clock, and what else adds to its latency."""
    if space.profile != "dse":  # OSATE knows no offsets: its sums are all there is
        return [], [(row.min_ns, row.max_ns) for row in flow_rows(space, flow, view)]
    runs: list[Run] = []
    others: list[tuple[Exact, Exact]] = []
    is_open = False
    for step in flow.steps:
        is_synchronous = False
        for row in step_rows(space, step, view):
            if row.max_method == METHOD:
                is_synchronous = True
                sender, hop = _hop(space, step, view)
                if not is_open:
                    runs.append(Run(at(sender.period_ns, view), at(sender.offset_ns, view)))
                low, high = runs[-1].bounds_ns
                runs[-1].hops.append(hop)
                runs[-1].bounds_ns = (low + row.min_ns, high + row.max_ns)
            else:
                others.append((row.min_ns, row.max_ns))
        if step.kind == "component" and is_periodic(space.components[step.index], view):
            is_open = is_synchronous
    return runs, others


def _hop(space: Space, step: Step, view: View) -> tuple[Component, Hop]:
    """The timer that releases what a synchronous reader reads, and the way from there."""
    receiver = space.components[step.index]
    found = arrival_ns(space, step, view)
    assert found is not None, receiver.name
    sender, least, most = found
    pair = pair_of(sender, receiver, view)
    assert pair is not None, receiver.name
    return sender, Hop(pair.receiver_ns, at(receiver.offset_ns, view), least, most, pair.error_ns)


def longest_and_shortest_ns(run: Run) -> tuple[Exact, Exact] | None:
    """The shortest and the longest time from a release to the last read of its data; None where that is too long.

    >>> longest_and_shortest_ns(Run(5, 0, [Hop(10, 0, 5, 5), Hop(20, 0, 10, 10)]))
    (15, 30)
    """
    count = _releases(run)
    if count is None:
        return None
    ends = []
    for number in range(count):
        start = run.offset_ns + number * run.period_ns
        ends.append((_read(run.hops, start, "least_ns", -1) - start, _read(run.hops, start, "most_ns", 1) - start))
    error = max(hop.error_ns for hop in run.hops)
    return max(0, min(low for low, _ in ends) - error), max(high for _, high in ends) + error


def _read(hops: list[Hop], release: Exact, end: str, sign: int) -> Exact:
    """When the last component reads what the first one released, where everything takes its shortest or longest."""
    for hop in hops:
        there = release + getattr(hop, end) + sign * hop.error_ns
        release = hop.offset_ns + ceil((there - hop.offset_ns) / Fraction(hop.period_ns)) * hop.period_ns
    return release


def _releases(run: Run) -> int | None:
    """After how many releases the pattern repeats."""
    periods = [run.period_ns, *(hop.period_ns for hop in run.hops)]
    scale = lcm(*(period.denominator for period in periods))
    whole = lcm(*(int(period * scale) for period in periods))
    count = whole // int(run.period_ns * scale)
    return count if count * len(run.hops) <= MOST_RELEASES else None
