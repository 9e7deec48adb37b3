"""Messages that wait for a bus, as busy windows: published figures, and buses played bit by bit."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from dse.analysis.scheduling.busy_window import Stream, Task, periodic
from dse.analysis.scheduling.policies.buses import Arbitrated, InTurn
from tests.helpers.arbitration import (
    BIT,
    Message,
    as_they_come,
    by_identifier,
    draw_bus,
    drawn,
    in_turns,
    with_all_at_once,
)
from tests.helpers.effort import cases


def task_of(message: Message) -> Task:
    return Task(str(message.place), message.bits, (Stream(message.period, message.jitter),))


def windows_of(messages: list[Message], bit: int = 1) -> list[Arbitrated]:
    """By identifier, in the order of the list."""
    found = []
    for message in messages:
        urgent = tuple(task_of(item) for item in messages[: message.place])
        blocked = max((item.bits for item in messages[message.place + 1 :]), default=0)
        found.append(Arbitrated(task_of(message), urgent, blocked, message.bits, bit))
    return found


def responses(*frames: tuple[int, int], bit: int = 1) -> list[object]:
    """Of frames with their periods, in bits, the most urgent first."""
    messages = [Message(place, bits, period) for place, (bits, period) in enumerate(frames)]
    return [window.response_ns() for window in windows_of(messages, bit)]


def test_davis_2007() -> None:
    """Section 3.3 there: three messages of 1 ms, of which the third responds last in its second job, at 3.5 ms."""
    us = [(1000, 2500), (1000, 3500), (1000, 3500)]
    assert responses(*us, bit=0) == [2000, 3000, 3500]
    third = windows_of([Message(place, *one) for place, one in enumerate(us)], 0)[2]
    parts = third.parts()
    assert parts is not None
    assert (parts.earlier_jobs, parts.over_ns) == (1, 3500)


def test_what_comes_within_a_bit_of_a_start_still_competes() -> None:
    """Without that bit the fourth message would be told 475 bits, with which a played bus takes 625."""
    frames = [(75, 400), (75, 400), (135, 2200), (75, 1100), (115, 2200), (75, 9000)]
    assert responses(*frames)[3] == 625
    assert responses(*frames, bit=0)[3] == 475
    messages = [Message(place, *one) for place, one in enumerate(frames)]
    assert with_all_at_once(messages, 3, 20) == 625 - (1 - BIT)


def test_the_shorter_deadline_is_not_always_to_go_first() -> None:
    """Deadlines of 360, 420, 630 and 850 bits, which are the periods: by deadline the third one ends at 650."""
    assert responses((95, 360), (135, 420), (55, 630), (135, 850)) == [230, 365, 650, 420]
    assert responses((95, 360), (55, 630), (135, 420), (135, 850)) == [230, 285, 420, 420]


@pytest.mark.parametrize("seed", cases(60))
def test_arbitration_bit_by_bit(seed: int) -> None:
    """Nothing that is drawn is above the bound, and what it is made of reaches it, but for the moment of blocking."""
    rng = Random(seed)
    messages = draw_bus(rng, load=rng.choice((0.8, 0.95)))
    windows = windows_of(messages)
    seen = drawn(messages, by_identifier, rng, 12)
    for message, window in zip(messages, windows, strict=True):
        bound = window.response_ns()
        parts, job = window.parts(), window.worst_job()
        assert bound is not None
        assert parts is not None
        assert job is not None
        assert seen[message.place] <= bound
        assert parts.waited_ns + message.bits == bound
        before = messages[: message.place + 1]
        jobs = job[1] // min(item.period for item in before) + max(item.jitter // item.period for item in before) + 5
        assert bound - with_all_at_once(messages, message.place, int(jobs)) <= 1 - BIT


def queue_of(messages: list[Message], message: Message, *, shared: bool) -> tuple[Task, ...]:
    """What goes in one line with a message: all others, or those of its sender."""
    others = [item for item in messages if item is not message]
    return tuple(task_of(item) for item in others if shared or item.sender == message.sender)


@pytest.mark.parametrize("seed", cases(60))
def test_first_come_first_served_bit_by_bit(seed: int) -> None:
    rng = Random(seed)
    messages = draw_bus(rng)
    seen = drawn(messages, as_they_come, rng, 12, exact=True)
    for message in messages:
        window = InTurn(task_of(message), queue_of(messages, message, shared=True))
        bound, parts = window.response_ns(), window.parts()
        assert bound is not None
        assert parts is not None
        assert seen[message.place] <= bound == parts.waited_ns + message.bits


@pytest.mark.parametrize("seed", cases(60))
def test_turns_of_senders_bit_by_bit(seed: int) -> None:
    rng = Random(seed)
    messages = draw_bus(rng, load=1.2 if seed % 3 else 0.7)
    seen = drawn(messages, in_turns(messages), rng, 12, exact=True)
    for message in messages:
        others = sorted({item.sender for item in messages} - {message.sender})
        longest = [max((one for one in messages if one.sender == item), key=lambda one: one.bits) for item in others]
        window = InTurn(
            task_of(message),
            queue_of(messages, message, shared=False),
            tuple(task_of(item).single() for item in longest),
            queue_of(messages, message, shared=True) if others else (),
        )
        bound, parts = window.response_ns(), window.parts()
        if bound is not None:
            assert parts is not None
            assert seen[message.place] <= bound == parts.waited_ns + message.bits


def test_a_full_bus_has_bounds_for_its_urgent_messages() -> None:
    assert responses((100, 200), (100, 300), (100, 200)) == [200, 400, None]


def test_a_message_of_several_frames_is_overtaken_between_them() -> None:
    """Two frames of 100 behind one of 50 every 120, which comes again before the second frame."""
    urgent, large = periodic("urgent", 50, 120), periodic("large", 200, 2000)
    assert Arbitrated(large, (urgent,), 0, 100, 0).response_ns() == 50 + 100 + 50 + 100
    assert Arbitrated(large, (urgent,), 0, 200, 0).response_ns() == 50 + 200


def test_a_fast_sender_does_not_wait_for_those_that_are_silent() -> None:
    """By turns alone its load would be beyond the bus; what comes in any order bounds it."""
    fast, slow = periodic("fast", 10, 40), periodic("slow", 50, 1000)
    found = InTurn(fast, (), (slow.single(),), (slow,)).response_ns()
    assert found == Fraction(50) + 10
