"""Sampling on a common clock: how long data wait between neighbours whose releases keep their phase.

All of docs/semantics.md, section 3.6. A component with a timer is released at its offset and every period after it, as
its clock shows; it reads then, or when its job begins. What leaves the one before it on a flow, between `least` and
`most` after that one's release (its deadline under logical execution time), is read at the first release from then on.
The times from a release of the one to those of the other are the numbers that are congruent to the difference of their
offsets modulo the greatest common divisor g of both periods, and every one of them occurs. So the read is no sooner
than the first of them from `least` on, and no later than a period less g behind the first of them from `most` on.

A job that reads when it begins, up to S after its release, may meet data that came in between: the first release from
`least` - S on counts, and data that its sender read late had less time until then.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import gcd

from dse.analysis.views import View
from dse.space.model.space import Component
from dse.space.model.trees import at
from dse.support.units import Exact, is_unbounded, picked

LET = "let"
LET_METHOD = "logical execution time"
METHOD = "sampling on one clock"


@dataclass(frozen=True, slots=True)
class Pair:
    """Neighbours with timers on one clock, and what the second may still differ by (ns) from what it should show.

    `begins_ns`: how long after its release the sender, and the receiver, may begin and read.
    """

    sender_ns: Exact
    receiver_ns: Exact
    shift_ns: Exact | None
    error_ns: Exact
    begins_ns: tuple[Exact, Exact] = (0, 0)

    @property
    def step_ns(self) -> Exact:
        """The greatest common divisor of both periods.

        In ns: differences of releases repeat in steps of it.
        """
        return common_step(self.sender_ns, self.receiver_ns)


def pair_of(sender: Component, receiver: Component, view: View, *, offsets: bool = True) -> Pair | None:
    """Two neighbours with timers, where they share a clock; None where they do not.

    With `offsets` both must be known, too; else `shift_ns` is None.
    """
    shift = None
    if offsets:
        later = at(receiver.offset_ns, view)
        earlier = None if later is None else at(sender.offset_ns, view)
        if later is None or earlier is None:
            return None
        shift = later - earlier
    one, other = at(sender.clock, view), at(receiver.clock, view)
    if one is None or other is None:
        return None
    if one.member == other.member:
        error = 0
    elif one.name and one.name == other.name:
        error = one.error_ns
    else:
        return None
    return Pair(at(sender.period_ns, view), at(receiver.period_ns, view), shift, error)


def wait_ns(pair: Pair, least: Exact, most: Exact) -> tuple[Exact, Exact]:
    """The least and the greatest wait from when data are there, `least` to `most` after the sender's release.

    Under logical execution time without transmission (`least` and `most` are the sender's deadline D) and exact
    clocks: r and T - g + r, where r = (shift - D) mod g. A reader that may begin 2 ns after its release meets what came
    1 ns after it.

    >>> wait_ns(Pair(10, 4, 3, 0), 10, 10), wait_ns(Pair(10, 4, 3, 0, (0, 2)), 10, 10)
    ((1, 3), (0, 3))
    """
    assert pair.shift_ns is not None
    if is_unbounded(most):
        return 0, pair.receiver_ns
    error, step = pair.error_ns, pair.step_ns
    latest = pair.receiver_ns - step + _rest(pair.shift_ns - most - error, step)
    return _least_ns(pair, least), picked("min", latest + 2 * error, pair.receiver_ns) if error else latest


def _least_ns(pair: Pair, least: Exact) -> Exact:
    """The least wait: until the first release whose job may still meet the data, less what `missing_ns` says."""
    assert pair.shift_ns is not None
    less = missing_ns(pair) + 2 * pair.error_ns
    if is_unbounded(less):
        return 0
    soonest = _rest(pair.shift_ns - least + pair.error_ns + pair.begins_ns[1], pair.step_ns)
    return picked("max", soonest - less, 0) if less else soonest


def missing_ns(pair: Pair) -> Exact:
    """By how much less than until a release whose job may meet them data may have waited, at most."""
    earlier, later = pair.begins_ns
    return earlier + later


def _rest(time: Exact, step: Exact) -> Exact:
    """The remainder of a time after whole steps: linear between them, for numbers that remember how they were made."""
    return time - step * _steps(time, step)


def _steps(time: Exact, step: Exact) -> Exact:
    """How many whole steps are in a time; numbers that remember how they were made remember that, too."""
    return time.whole_steps(step) if hasattr(time, "whole_steps") else time // step


def spread_ns(pair: Pair, least: Exact, most: Exact) -> Exact:
    """The contribution of sampling to the run jitter, in ns, for any offsets.

    Data whose time to arrive spreads over s reach a read within s rounded up to whole steps of g, and a period less g
    behind it; s itself counts with what spreads it. Where jobs read when they begin it is a period, a safe bound.

    >>> spread_ns(Pair(10, 4, None, 0), 10, 10), spread_ns(Pair(10, 4, None, 0), 7, 10)
    (2, 3)
    """
    if is_unbounded(most) or missing_ns(pair):
        return pair.receiver_ns
    step, spread = pair.step_ns, most - least + 2 * pair.error_ns
    grown = -_steps(-spread, step) * step
    within = pair.receiver_ns - step + grown + 2 * pair.error_ns - (most - least)
    wait_ns: Exact = picked("min", within, pair.receiver_ns)
    return wait_ns


def common_step(one: Exact, other: Exact) -> Exact:
    """The greatest common divisor of two times, exact.

    >>> common_step(20_000_000, 33_333_000), common_step(Fraction(1, 2), 3)
    (1000, Fraction(1, 2))
    """
    if isinstance(one, int) and isinstance(other, int):
        return gcd(one, other)
    above = gcd(one.numerator * other.denominator, other.numerator * one.denominator)
    return Fraction(above, one.denominator * other.denominator)
