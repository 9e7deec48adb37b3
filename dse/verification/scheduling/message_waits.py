"""How long messages wait for their bus in the second proof: a row of each, and what goes first there.

A message waits for jobs of each other one that goes before it (those that come while a job of each that surely does is
sent), for the longest frame of the rest, which has begun, and for faults of the wire: each costs an error frame, and
its own frame or one that surely goes before it once more.
Numbers tell who goes before it; where one of both may have any number that is a literal of its own, which is false
unless a refused solution taught that it is true: with all options that make their bus no less busy, another message
cannot be placed behind it in time, or the rule has it before (`dse.analysis.messages.conflicts`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit
from dse.analysis.messages.burdens import burdens, is_settled
from dse.analysis.messages.conflicts import earlier_on_flows, open_identifiers, soonest
from dse.analysis.messages.stages import counted_buses, is_each_alone
from dse.analysis.scheduling.busy_window import most_jobs
from dse.analysis.scheduling.policies.faults import ERROR_BITS
from dse.analysis.views import View
from dse.space.architecture.arbitration import may_be_any
from dse.space.model.space import Design, Space
from dse.support.units import Exact
from dse.verification.scheduling.contention import Lesson
from dse.verification.scheduling.message_lessons import limited_by_deadline, message_of, wait_key, widened
from dse.verification.scheduling.messages import BusRows, Sent


class MessageWaits:
    """The rows of messages that wait, in units of 1 / `scale` ns; `before` has a literal for a message and another."""

    def __init__(self, rows: BusRows, variables: dict[int, Any], scale: int) -> None:
        self.rows, self.space, self.scale = rows, rows.space, scale
        self.before: dict[tuple[int, int], Any] = {}
        for bus in counted_buses(self.space) if variables and is_each_alone(self.space) else ():
            self._add_bus(bus, variables)

    def _add_bus(self, bus: int, variables: Mapping[int, Any]) -> None:
        asked = [
            (key, kind, wire, messages, own)
            for kind, wire, messages in self.rows.by_type(bus)
            for own in messages
            for key in (wait_key(own.number, has_source=has_source) for has_source in (False, True))
            if key in variables
        ]
        for key, kind, wire, messages, own in asked:
            variable, model, works = variables[key], self.rows.model, list[Any]()
            most = int(max(one.longest_ns for one in messages) * self.scale)
            begun = model.new_int_var(0, most, "")
            sure = [one for one in messages if one is not own and self._is_sure(own, one)]
            before, least = sum(map(_one_job, sure)), min(item.last_ns for _, item in own.cases)
            hits = min((most_jobs(faults, before + least) for faults in wire.faults), default=0)
            again = ERROR_BITS * wire.bit_ns + max(one.frame_ns for one in (own, *sure))
            works.append(int(hits * again * self.scale))
            window = wire.bit_ns + before
            for one in messages:
                if one is own:
                    continue
                first = self._goes_first(key, own, one)
                frame = int(one.frame_ns * self.scale)
                if first is None:
                    model.add(begun >= frame).only_enforce_if(kind)
                    continue
                model.add(begun >= frame).only_enforce_if([kind, first.negated()])
                for literal, item in one.cases:
                    assert item.task is not None
                    jobs = most_jobs(item.task, window)
                    works.append(int(jobs * item.task.worst_ns * self.scale) * self.rows.both(first, literal))
            model.add(variable >= begun + sum(works)).only_enforce_if(kind)

    def _is_sure(self, own: Sent, other: Sent) -> bool:
        """Whether another message has a lower number in every design."""
        if any(may_be_any(self.space.connections[one.number]) for one in (own, other)):
            return False
        return max(number for _, number in other.numbers) < min(number for _, number in own.numbers)

    def _goes_first(self, key: int, own: Sent, other: Sent) -> Any:
        """A literal that is true where another message has a lower number, or is known to be before; None: never."""
        pair = key, other.number
        pairs = [(mine, one) for mine, number in own.numbers for one, least in other.numbers if least < number]
        is_open = any(may_be_any(self.space.connections[one.number]) for one in (own, other))
        if not pairs and not is_open:
            return None
        if pair not in self.before:
            self.before[pair] = made = self.rows.model.new_bool_var("")
            for both in pairs:
                self.rows.model.add_bool_or([made, *(one.negated() for one in both if one is not None)])
        return self.before[pair]


def _one_job(one: Sent) -> Exact:
    """The least time of a job of a message, in ns."""
    return min(item.task.worst_ns for _, item in one.cases if item.task is not None)


def order_lessons(
    space: Space, key: int, limits: Sequence[Limit], design: Design, open_: Callable[[int], bool]
) -> Iterator[Lesson]:
    """The lessons of which messages go before one in a design, of those for which that is `open_`."""
    if not is_chosen_alike(space, limits):
        return
    alone = replace(space, processing="execution_time")
    number, told = message_of(key)[0], set[int]()
    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(alone, number, View(design))]):
        found = soonest(alone, number, View(design), kept)
        for other in sorted(found.before - told) if found is not None else ():
            if not open_(other):
                continue
            told.add(other)

            def is_before(given: Sequence[int], other: int = other, kept: frozenset[int] = kept) -> bool:
                seen = soonest(alone, number, View(given), kept)
                return seen is not None and other in seen.before

            yield Lesson(_box(alone, number, design, is_before, kept), (), before=(key, other))


def soonest_lesson(
    space: Space, key: int, limits: Sequence[Limit], longer_ns: Fraction, design: Design
) -> Lesson | None:
    """The lesson from a message that waits longer than `longer_ns` in every order that meets all deadlines; else None.

    It does so though no thread waits for another; threads that wait pass on more jitter, by which identifiers are not
    chosen. Of those orders, if need be, that have earlier messages of flows before it as the rule does. Only where
    `limits` have all deadlines.
    """
    if not is_chosen_alike(space, limits):
        return None
    alone, (number, has_source) = replace(space, processing="execution_time"), message_of(key)
    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(alone, number, View(design))]):
        least = soonest(alone, number, View(design), kept, has_source=has_source)
        if least is None or least.waits_ns <= longer_ns:
            continue
        bound = Fraction(least.waits_ns)

        def is_as_long(given: Sequence[int], kept: frozenset[int] = kept, bound: Fraction = bound) -> bool:
            found = soonest(alone, number, View(given), kept, has_source=has_source)
            return found is not None and found.waits_ns >= bound

        return Lesson(_box(alone, number, design, is_as_long, kept), (), (key, bound))
    return None


def is_chosen_alike(space: Space, limits: Sequence[Limit]) -> bool:
    """Whether messages have places in which all meet their deadlines, with jitter that is the same in any order.

    Where no thread waits for another; `limits` must have all deadlines.
    """
    alone = replace(space, processing="execution_time") if counts_responses(space) else space
    if not (is_settled(alone) and open_identifiers(alone)):
        return False
    limited = limited_by_deadline(space, limits)
    return all(item.deadline_ns is None or number in limited for number, item in enumerate(space.connections))


def _box(
    space: Space, number: int, design: Design, holds: Callable[[Sequence[int]], bool], kept: frozenset[int]
) -> dict[int, frozenset[int]]:
    """Options with which something holds that the busier a bus is holds the more, and the rule has `kept` before."""

    def compared(decision: int) -> Sequence[int] | None:
        item = space.decisions[decision]
        if item.field != "identifier":
            return burdens(space, decision)
        stated = [int(isinstance(value, int)) for value in item.values]
        return stated if sum(stated) == 1 else None

    def are_before(given: Sequence[int]) -> bool:
        return kept <= earlier_on_flows(space, number, View(given))

    def idler(decision: int) -> Sequence[int] | None:
        busy = compared(decision)
        return None if busy is None else [-one for one in busy]

    box = widened(design, holds, compared)[0]
    for decision, options in widened(design, are_before, idler)[0].items() if kept else ():
        box[decision] = box.get(decision, options) & options
    return box
