"""How long messages wait for their bus in the second proof: a row of each, and what goes first there.

A message waits for jobs of each other one that goes before it (those that come while a job of each that surely does is
sent), for the longest frame of the rest, which has begun, and for faults of the wire: each costs an error frame, and
its own frame or one that surely goes before it once more.
Numbers tell who goes before it; where one of both may have any number that is a literal of its own, which is false
unless a refused solution taught that it is true: with all options that make their bus no less busy, another message
cannot be placed behind it in time, or the rule has it before (`dse.analysis.messages.precedence`). Of two messages that
wait one goes before the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dse.analysis.messages.stages import counted_buses, is_each_alone
from dse.analysis.scheduling.busy_window import most_jobs
from dse.analysis.scheduling.policies.faults import ERROR_BITS
from dse.space.architecture.arbitration import may_be_any
from dse.support.units import Exact
from dse.verification.messages.rows import BusRows, Sent


def wait_key(number: int, *, has_source: bool) -> int:
    """A key below 0 for the waiting of a message, by its connection: from when it is queued, or from its source on."""
    return -1 - 2 * number - has_source


def message_of(key: int) -> tuple[int, bool]:
    """The connection of a `wait_key`, and whether it waits from its source on."""
    return (-1 - key) // 2, bool((-1 - key) % 2)


class MessageWaits:
    """The rows of messages that wait, in units of 1 / `scale` ns.

    `before` has a literal for pairs of messages, by their connections: whether the first goes before the second.
    """

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
                first = self._goes_first(own, one)
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

    def _goes_first(self, own: Sent, other: Sent) -> Any:
        """A literal that is true where another message has a lower number, or is known to be before; None: never."""
        pairs = [(mine, one) for mine, number in own.numbers for one, least in other.numbers if least < number]
        is_open = any(may_be_any(self.space.connections[one.number]) for one in (own, other))
        if not pairs and not is_open:
            return None
        pair = other.number, own.number
        if pair not in self.before:
            self._add_pair(*pair)
            for both in pairs:
                self.rows.model.add_bool_or([self.before[pair], *(one.negated() for one in both if one is not None)])
        return self.before[pair]

    def _add_pair(self, one: int, own: int) -> None:
        """A literal of whether one message goes before another: the opposite of the other way round, without rings."""
        opposite = self.before.get((own, one))
        self.before[one, own] = self.rows.model.new_bool_var("") if opposite is None else opposite.negated()
        for third in sorted({number for pair in self.before for number in pair} - {one, own}):
            for ring in (
                ((one, own), (own, third), (one, third)),
                ((third, one), (one, own), (third, own)),
                ((one, third), (third, own), (one, own)),
            ):
                if all(pair in self.before for pair in ring):
                    first, second, both = (self.before[pair] for pair in ring)
                    self.rows.model.add_bool_or([first.negated(), second.negated(), both])


def _one_job(one: Sent) -> Exact:
    """The least time of a job of a message, in ns."""
    return min(item.task.worst_ns for _, item in one.cases if item.task is not None)
