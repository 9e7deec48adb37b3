"""Sampling for the second proof, release by release: formulas of its own for what clocks and offsets do to a flow.

docs/semantics.md, section 3.6. What the analysis says in closed form (`dse.analysis.latency.sampling`) is found here by
going through the releases of two timers until their pattern repeats; what else an element of a flow adds is asked of
its rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial
from math import gcd, lcm
from typing import Any

from dse.analysis.latency.contributors import step_rows
from dse.analysis.latency.rows import Row
from dse.analysis.rates import is_periodic
from dse.analysis.terms import Measure, Sampled, Term
from dse.analysis.views import View
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import at, is_given
from dse.support.units import Exact, is_unbounded

MOST_RELEASES = 2_000
"""With more releases before a pattern repeats only what is left of whole steps is looked at."""
Ends = tuple[Any, Any]
KINDS = ("latency", "min latency", "jitter", "run jitter", "oldest input")
"""The metrics that have formulas here; of others the analysis is asked."""


def sampled_ns(sampled: Sampled, view: View) -> Fraction:
    """The contribution of an element of a flow to a metric, in the metric's own unit."""
    space, step, seen = sampled.space, sampled.step, sampled.asked(view)
    least, most, spread = _parts(space, step, sampled.kind, seen)
    figures = {"min latency": least, "latency": most, "jitter": most - least, "run jitter": spread}
    figures["oldest input"] = _oldest_ns(space, step, seen, most) if sampled.kind == "oldest input" else most
    found: Fraction = Fraction(0) + figures[sampled.kind]
    return found * sampled.factor


def _oldest_ns(space: Space, step: Step, view: View, most: Any) -> Any:
    """The time by which a reader that begins late reads older data, at most a period."""
    component = space.components[step.index]
    if at(component.offset_ns, view) is None or not is_periodic(component, view):
        return most
    came = sum(row.max_ns for row in step_rows(space, step, view) if not _is_sampling(component, row, view))
    return max(most, min(most + _start_ns(space, step, view), came + at(component.period_ns, view)))


def own_value(measure: Measure, view: View) -> Fraction:
    """A metric of a design with what its flows sample by the formulas here; other terms are the analysis' own."""
    return sum((_value(term, view) for term in measure.terms), Fraction(0))


def _value(term: Term, view: View) -> Fraction:
    if term.extreme is not None:
        found: Fraction = term.extreme.pick(sum(_value(item, view) for item in terms) for terms in term.extreme.sums)
        return found
    return formula_of(term)(view)


def formula_of(term: Term) -> Callable[[View], Fraction]:
    """The function from a design to the value of a term: a formula of this module, where there is one."""
    if term.sampled is None or term.sampled.kind not in KINDS:
        return term.value
    return partial(sampled_ns, term.sampled)


def _parts(space: Space, step: Step, kind: str, view: View) -> tuple[Any, Any, Any]:
    """The least and the most that an element adds, and the largest difference of that within one run.

    The latter only for the metric of that `kind`.
    """
    component = space.components[step.index]
    rows = [row for row in step_rows(space, step, view) if not _is_sampling(component, row, view)]
    least, most = sum(row.min_ns for row in rows), sum(row.max_ns for row in rows)
    if space.profile != "dse" or step.via is None or not is_periodic(component, view):
        return least, most, most - least
    period = at(component.period_ns, view)
    timer = timer_of(space, step, view)
    sender = None if timer is None else space.components[timer.index]
    error = None if sender is None else _error_ns(sender, component, view)
    is_known = sender is not None and all(is_given(item.offset_ns, view) for item in (sender, component))
    if sender is None or error is None or not (is_known or kind == "run jitter"):  # how soon data come says nothing
        return least, most + period, most + period - least
    found = timer_before(space, step, view)
    assert found is not None
    if is_unbounded(found[2]):
        return least, most + period, most + period - least
    _, soonest, latest = found
    base = at(sender.period_ns, view), period
    offsets = at(sender.offset_ns, view), at(component.offset_ns, view)
    if None in offsets:
        spread = _run_spread(*base, latest - soonest, error)
        if _start_ns(space, step, view) or _start_ns(space, found[0], view):
            spread = period  # a job that begins late reads what others of its run miss
        return least, most + period, most - least + spread
    shift = offsets[1] - offsets[0]
    late, missed = _start_ns(space, step, view), _start_ns(space, found[0], view)
    low = max(0, _wait(*base, shift - soonest + error + late)[0] - 2 * error - late - missed)
    high = min(period, _wait(*base, shift - latest - error)[1] + 2 * error)
    return least + low, most + high, most + high - least - low


def _is_sampling(component: Component, row: Row, view: View) -> bool:
    return is_periodic(component, view) and "sampling" in row.max_method


def _start_ns(space: Space, step: Step, view: View) -> Any:
    """The latest time at which a timer's job may read: its response time less its own work."""
    component = space.components[step.index]
    is_first = step.via is None  # the clock of a latency starts with it
    if is_first or at(component.communication, view) in ("let", "at_dispatch"):
        return 0
    rows = step_rows(space, replace(step, only_reads=False), view)
    last = next((row for row in reversed(rows) if "response time" in row.max_method), None)
    if last is None:
        return 0
    work = at(component.execution_ns, view)
    return max(0, last.max_ns - (last.min_ns if work is None else work[1]))


def timer_before(space: Space, step: Step, view: View) -> tuple[Step, Any, Any] | None:
    """The last timer before an element, and the least and the most time from its release until its data are there."""
    least: Exact = 0
    most: Exact = 0
    for row in _ways(space, step, view):
        if isinstance(row, Step):
            return row, least, most
        least, most = least + row.min_ns, most + row.max_ns
    return None


def timer_of(space: Space, step: Step, view: View) -> Step | None:
    """The last timer before an element."""
    for earlier in step.since[::-1]:
        if earlier.kind == "component" and is_periodic(space.components[earlier.index], view):
            return earlier
    return None


def on_the_way(space: Space, step: Step, view: View) -> Iterator[int]:
    """The threads between a reader and the timer before it, that one with them, that may wait for their cores."""
    for earlier in step.since[::-1]:
        if earlier.kind == "component":
            yield from _computes(space, earlier.index, view)
            if is_periodic(space.components[earlier.index], view):
                return


def beginners(space: Space, step: Step, view: View) -> Iterator[int]:
    """The thread of an element, where it reads as late as its job begins."""
    is_first = step.via is None
    if not is_first and at(space.components[step.index].communication, view) not in ("let", "at_dispatch"):
        yield from _computes(space, step.index, view)


def _computes(space: Space, number: int, view: View) -> Iterator[int]:
    """A thread whose job ends when its response time says."""
    component = space.components[number]
    is_let = at(component.communication, view) == "let"
    if at(component.processor, view) is not None and at(component.execution_ns, view) is not None and not is_let:
        yield number


def clock_step_ns(one: Component, other: Component, view: View) -> Exact | None:
    """The step of two timers on exactly the same clock; None where they are not."""
    if _error_ns(one, other, view) != 0:
        return None
    periods = [Fraction(at(item.period_ns, view)) for item in (one, other)]
    scale = lcm(*(period.denominator for period in periods))
    return Fraction(gcd(*(int(period * scale) for period in periods)), scale)


def _ways(space: Space, step: Step, view: View) -> Iterator[Row | Step]:
    """The rows from an element back to the timer before it, and that at last."""
    here = step_rows(space, step, view)
    yield from here[: _sampled_at(here)]
    for earlier in step.since[::-1]:
        rows = step_rows(space, earlier, view)
        if earlier.kind == "component" and is_periodic(space.components[earlier.index], view):
            yield from rows[_sampled_at(rows) + 1 :]  # its timer's work
            yield earlier
            return
        yield from rows


def _sampled_at(rows: Sequence[Row]) -> int:
    return next(number for number, row in enumerate(rows) if "sampling" in row.max_method)


def _error_ns(one: Component, other: Component, view: View) -> Any:
    """The largest error between the clocks of two components, in ns; None where they share no clock."""
    clocks = [at(item.clock, view) for item in (one, other)]
    if None in clocks:
        return None
    if clocks[0].member == clocks[1].member:
        return 0
    is_shared = clocks[0].name != "" and clocks[0].name == clocks[1].name
    return clocks[0].error_ns if is_shared else None


@lru_cache(maxsize=65536)
def _wait(sender: Any, receiver: Any, shift: Any) -> Ends:
    """The shortest and the longest time from `shift` before a release of the sender to the receiver's next release.

    >>> [int(time) for time in _wait(10, 4, 3 - 10)]
    [1, 3]
    """
    scale = lcm(*(Fraction(time).denominator for time in (sender, receiver, shift)))
    every, period, first = (int(time * scale) for time in (sender, receiver, shift))
    count = lcm(every, period) // every
    if count > MOST_RELEASES:
        step = every * period // lcm(every, period)
        rest = first % step
        return Fraction(rest, scale), Fraction(period - step + rest, scale)
    waits = [-(number * every - first) % period for number in range(count)]
    return Fraction(min(waits), scale), Fraction(max(waits), scale)


def _run_spread(sender: Any, receiver: Any, spread: Any, error: Any) -> Any:
    """The largest difference of waits within one run: data just meet a release, or miss it by all that they spread."""
    just, late = _wait(sender, receiver, Fraction(0)), _wait(sender, receiver, -spread - 2 * error)
    return min(receiver, late[1] - just[0] + 4 * error)
