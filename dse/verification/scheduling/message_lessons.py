"""Lessons of the second proof from refused solutions in which messages wait for buses too long.

Of messages none of which can be the last in time: with all options that make their bus no less busy
(`dse.analysis.messages`). Of a message that waits so long: the options under which it does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit, judge
from dse.analysis.memo import looked_at
from dse.analysis.messages.burdens import burdens, goes_first, is_settled
from dse.analysis.messages.conflicts import Conflict, conflicts, is_own_deadline, open_identifiers
from dse.analysis.messages.stages import (
    counted_buses,
)
from dse.analysis.scheduling.responses import message_waits_ns, with_threads
from dse.analysis.views import View
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Design, Space
from dse.space.model.trees import NotOffered, at
from dse.verification.scheduling.contention import Lesson, least_groups, ordered_pairs


def is_message_limit(limit: Limit) -> bool:
    """Whether a limit is an upper one on the response time of a message."""
    metric = limit.requirement.metric
    return metric.kind == "message response" and limit.requirement.is_upper and not limit.is_elsewhere


def limited_by_deadline(space: Space, limits: Sequence[Limit]) -> set[int]:
    """The messages that must meet the deadline of their connection."""
    pairs = [(item.requirement.metric.index or 0, item) for item in limits]
    return {number for number, item in pairs if is_own_deadline(space, number, item.bound)}


def message_lessons(space: Space, limits: Sequence[Limit], design: Design, *, has_places: bool) -> list[Lesson]:
    """The lesson from messages that miss these limits in a design; of threads that wait where these have places."""
    view = View(design)
    limited = limited_by_deadline(space, limits)
    found = [
        _conflict_lesson(space, conflict, design)
        for bus in counted_buses(space)
        for conflict in conflicts(space, bus, view)
        if limited.issuperset(conflict.limited(space, view))
    ]
    if found:
        return found
    late = [item for item in limits if not judge(item, view).holds]
    return [_late_lesson(space, item, design, has_places=has_places) for item in late]


def _late_lesson(space: Space, limit: Limit, design: Design, *, has_places: bool) -> Lesson:
    """The lesson from one message that is late in a design, with as few threads that wait as make it late."""

    def is_late(groups: Sequence[Sequence[int]] | None, given: Sequence[int]) -> bool:
        view = View(given) if groups is None else with_threads(space, groups, given)
        return not judge(limit, view).holds

    groups = None
    if counts_responses(space) and has_places:
        groups = least_groups(space, -1, lambda found, view: is_late(found, view.design), design)

    def is_late_there(given: Sequence[int]) -> bool:
        for thread in (one for group in groups or () for one in group):
            at(space.components[thread].processor, View(given))
        return is_late(groups, given)

    still, seen = looked_at(design, lambda view: is_late_there(view.design))
    assert still, "a message is in time"
    apart, above = ordered_pairs(space, groups, seen)
    box = {item: frozenset((option,)) for item, option in seen.items() if item not in apart}
    return Lesson(box, groups or (), above=above)


def _conflict_lesson(space: Space, conflict: Conflict, design: Design) -> Lesson:
    def is_late(given: Sequence[int]) -> bool:
        return conflict.is_late(space, View(given))

    def compared(decision: int) -> Sequence[int | None] | None:
        is_of_frame = space.decisions[decision].field == "carried_in"
        return conflict.frame_burden(space, decision, View(design)) if is_of_frame else burdens(space, decision)

    box, busy = widened(design, is_late, compared)
    ordered = conflict.kept_from_last(space, View(busy))
    assert ordered is not None
    for number, bound, is_most in conflict.bounds(ordered):
        index = space.decision_index(f"{space.connections[number].name}.identifier")
        if index is not None and design[index] >= 0:
            values = enumerate(space.decisions[index].values)
            numbered = [(option, value) for option, value in values if isinstance(value, int)]
            fit = frozenset(option for option, value in numbered if (value <= bound if is_most else value >= bound))
            box[index] = box.get(index, fit) & fit
    return Lesson(box, ())


def wait_key(number: int, *, has_source: bool) -> int:
    """A key below 0 for the waiting of a message, by its connection: from when it is queued, or from its source on."""
    return -1 - 2 * number - has_source


def message_of(key: int) -> tuple[int, bool]:
    """The connection of a `wait_key`, and whether it waits from its source on."""
    return (-1 - key) // 2, bool((-1 - key) % 2)


def waits_lesson(space: Space, key: int, waits: Callable[[View], Fraction], waited: Fraction, design: Design) -> Lesson:
    """The lesson from a message that waits `waited` ns or longer in a design."""
    message, view = message_of(key)[0], View(design)

    def is_as_long(given: Sequence[int]) -> bool:
        return waits(View(given)) >= waited

    def compared(decision: int) -> Sequence[int] | None:
        item = space.decisions[decision]
        if item.field == "identifier" and item.component != space.connections[message].name:
            return goes_first(space, item, message, view)
        return burdens(space, decision)

    if is_settled(space) and not open_identifiers(space):
        return Lesson(widened(design, is_as_long, compared)[0], (), (key, waited))
    return Lesson(_seen(is_as_long, design), (), (key, waited))


def undelayed_lesson(space: Space, key: int, longer_ns: Fraction, design: Design) -> Lesson | None:
    """The lesson from a message that waits longer than `longer_ns` though no thread waits for another; else None.

    Threads that wait pass on more jitter, by which identifiers are not chosen.
    """
    if not counts_responses(space):
        return None
    alone = replace(space, processing="execution_time")
    number, has_source = message_of(key)

    def waits(view: View) -> Fraction:
        return Fraction(message_waits_ns(alone, number, view, has_source=has_source))

    waited = waits(View(design))
    return waits_lesson(alone, key, waits, waited, design) if waited > longer_ns else None


def widened(
    design: Design, holds: Callable[[Sequence[int]], bool], compared: Callable[[int], Sequence[int | None] | None]
) -> tuple[dict[int, frozenset[int]], Design]:
    """Options of the decisions that are looked at, with which a thing holds, and the least busy design of these.

    It holds the more the busier a bus is, as `compared` has it for the options of a decision; one without a number
    there keeps it at least as busy as the least busy one.
    """
    box = _seen(holds, design)
    least = design
    for decision in list(box):
        burden = compared(decision) if design[decision] >= 0 else None
        if burden is None:
            continue
        known = {option: busy for option, busy in enumerate(burden) if busy is not None}
        for option in sorted(known, key=known.__getitem__):
            trial = (*least[:decision], option, *least[decision + 1 :])
            if known[option] >= known[design[decision]] or _still(holds, trial):
                least = least if known[option] >= known[design[decision]] else trial
                busier = {item for item, busy in known.items() if busy >= known[option]}
                box[decision] = frozenset(range(len(burden)) if len(busier) == len(known) else busier)
                break
    return box, least


def _still(holds: Callable[[Sequence[int]], bool], design: Design) -> bool:
    try:
        return holds(design)
    except (NotOffered, CyclicActivation):
        return False


def _seen(holds: Callable[[Sequence[int]], bool], design: Design) -> dict[int, frozenset[int]]:
    """The options that are looked at to see that something holds in a design."""
    does_hold, seen = looked_at(design, lambda view: holds(view.design))
    assert does_hold, "it does not hold"
    return {decision: frozenset((option,)) for decision, option in seen.items()}
