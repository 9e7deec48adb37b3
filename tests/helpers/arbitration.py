"""Buses played bit by bit, without any code of the analysis: who sends when, and how long each message took.

Times are in bits, and may be fractions of one. Whoever is ready within a bit after a frame has begun may still win the
arbitration for it, as its nodes' clocks fall: `sees_bits` is how much later than the start a message may be ready for
that; a message that has won is sent to its end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from heapq import heapify, heappop
from random import Random


@dataclass(frozen=True)
class Message:
    """A message by its place in the order, the most urgent first: frame, period and jitter in bits, and its sender."""

    place: int
    bits: int
    period: int
    jitter: int = 0
    sender: int = 0

    def releases(self, offset: Fraction | int, delays: Iterable[Fraction | int]) -> list[Fraction]:
        """When its jobs are ready: periodically from an offset on, each later by a delay, and never before the last."""
        found: list[Fraction] = []
        for number, delay in enumerate(delays):
            ready = Fraction(offset) + number * self.period + delay
            found.append(max(ready, found[-1]) if found else ready)
        return found

    def densest(self, begin: Fraction | int, jobs: int) -> list[Fraction]:
        """The first job as late as it may be, at `begin`, and all later ones as soon as they may be."""
        return [max(Fraction(begin), Fraction(begin) + number * self.period - self.jitter) for number in range(jobs)]


def draw_bus(rng: Random, *, load: float = 0.9, late: bool = True) -> list[Message]:
    """Some messages of CAN with up to 8 bytes, by their order, that use less than all of a bus."""
    many = rng.randint(2, 7)
    shares = [rng.random() for _ in range(many)]
    whole = sum(shares) / rng.uniform(0.3, load)
    found = []
    for place, share in enumerate(shares):
        bits = rng.choice((55, 75, 95, 115, 135))
        period = max(bits + 1, round(bits * whole / share))
        jitter = rng.choice((0, 0, rng.randint(0, 2 * period))) if late else 0
        found.append(Message(place, bits, period, jitter, rng.randint(0, 2)))
    return found


Choice = Callable[[Fraction, list[tuple[Fraction, int, int]]], tuple[Fraction, int, int]]
"""Which of those that are ready is sent at a time: ready since, message, number of the job."""


ERROR_BITS = 31
"""The longest error frame of CAN with the gap behind it."""
Hit = Callable[[int, Fraction], bool]
"""Whether a fault hits the frame of a message, by its place, in its last bit, which ends then."""


def nothing_hits(_: int, __: Fraction) -> bool:
    """No fault."""
    return False


def played(
    messages: Sequence[Message],
    ready: Sequence[Sequence[Fraction]],
    choose: Choice,
    sees_bits: Callable[[], Fraction],
    hits: Hit = nothing_hits,
) -> dict[int, Fraction]:
    """The longest time from when a job of each message is ready until its frame is over.

    What is hit competes anew after an error frame.
    """
    coming = [(when, place, number) for place, jobs in enumerate(ready) for number, when in enumerate(jobs)]
    heapify(coming)
    waiting: list[tuple[Fraction, int, int]] = []
    worst: dict[int, Fraction] = {}
    now = Fraction(-(10**9))
    while coming or waiting:
        if not waiting:
            now = max(now, coming[0][0])
        until = now + sees_bits()
        while coming and coming[0][0] <= until:
            waiting.append(heappop(coming))
        chosen = choose(now, waiting)
        waiting.remove(chosen)
        when, place, _ = chosen
        now += messages[place].bits
        if hits(place, now):
            now += ERROR_BITS
            waiting.append(chosen)
            continue
        worst[place] = max(worst.get(place, Fraction(0)), now - when)
    return worst


BIT = Fraction(999, 1000)
"""Just less than one bit: what is ready a whole bit later has nothing to do with a frame any more."""


def with_all_at_once(messages: Sequence[Message], place: int, jobs: int, hits: Hit = nothing_hits) -> Fraction:
    """How long a message takes where all more urgent ones come with it, as densely as they may, and a frame has begun.

    That is the longest of the less urgent ones, which has begun a moment before.
    """
    ready: list[list[Fraction]] = [item.densest(0, jobs) for item in messages[: place + 1]]
    less = messages[place + 1 :]
    longest = max(less, key=lambda item: item.bits, default=None)
    ready += [[BIT - 1] if item is longest else [] for item in less]
    seen = iter([Fraction(0)] if less else [])
    return played(messages, ready, by_identifier, lambda: next(seen, BIT), hits)[place]


def drawn(
    messages: Sequence[Message],
    choose: Choice,
    rng: Random,
    jobs: int,
    *,
    exact: bool = False,
    hits: Hit = nothing_hits,
) -> dict[int, Fraction]:
    """How long messages take at most where offsets, delays and what nodes see are drawn; with `exact` what has come."""
    ready = [
        item.releases(
            Fraction(rng.randint(0, 4 * item.period), 4),
            [item.jitter * rng.choice((Fraction(0), Fraction(1), Fraction(rng.randint(0, 8), 8))) for _ in range(jobs)],
        )
        for item in messages
    ]
    return played(messages, ready, choose, lambda: Fraction(0) if exact else rng.choice((Fraction(0), BIT)), hits)


def by_identifier(_: Fraction, waiting: list[tuple[Fraction, int, int]]) -> tuple[Fraction, int, int]:
    """The most urgent of those that wait, of one message the oldest."""
    return min(waiting, key=lambda job: (job[1], job[2]))


def as_they_come(_: Fraction, waiting: list[tuple[Fraction, int, int]]) -> tuple[Fraction, int, int]:
    """The one that waits longest."""
    return min(waiting)


def in_turns(messages: Sequence[Message]) -> Choice:
    """Senders take turns by their numbers, each with the oldest of its messages."""
    last = [0]

    def choose(_: Fraction, waiting: list[tuple[Fraction, int, int]]) -> tuple[Fraction, int, int]:
        many = 1 + max(item.sender for item in messages)
        chosen = min(waiting, key=lambda job: ((messages[job[1]].sender - last[0] - 1) % many, job))
        last[0] = messages[chosen[1]].sender
        return chosen

    return choose
