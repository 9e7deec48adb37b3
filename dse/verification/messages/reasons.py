"""Lessons of the second proof from refused solutions in which messages wait for buses too long.

Of messages none of which can be the last in time: with all options that make their bus no less busy
(`dse.analysis.messages`). Of a message that waits so long: the options under which it does. Of messages that may have
any identifier: which ones are sent before it in every order that meets all deadlines.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit, judge
from dse.analysis.memo import looked_at
from dse.analysis.messages.burdens import burdens, goes_first, is_settled
from dse.analysis.messages.conflicts import Conflict, open_identifiers
from dse.analysis.messages.precedence import earlier_on_flows, is_idler_alike, nested, soonest, waits_behind_ns
from dse.analysis.scheduling.responses import message_waits_ns, with_threads
from dse.analysis.views import View
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Design, Space
from dse.space.model.trees import NotOffered, at
from dse.verification.messages.waiting import message_of
from dse.verification.scheduling.reasons import Lesson, least_groups, ordered_pairs


def late_lesson(space: Space, limit: Limit, design: Design, *, has_places: bool) -> Lesson:
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


def conflict_lesson(space: Space, conflict: Conflict, design: Design) -> Lesson:
    """The lesson from messages of a bus of which none can be the last in time in a design."""
    return Lesson(_conflict_box(space, conflict, design, lambda seen: True), ())


def _conflict_box(
    space: Space, conflict: Conflict, design: Design, further: Callable[[View], bool]
) -> dict[int, frozenset[int]]:
    """Options with which a conflict of a design is one, and something else holds that a busier bus does not change."""

    def is_late(given: Sequence[int]) -> bool:
        return conflict.is_late(space, View(given)) and further(View(given))

    def compared(decision: int) -> Sequence[int | None] | None:
        is_of_frame = space.decisions[decision].field == "carried_in"
        return conflict.frame_burden(space, decision, View(design)) if is_of_frame else burdens(space, decision)

    box, busy = _widened(design, is_late, compared)
    ordered = conflict.kept_from_last(space, View(busy))
    assert ordered is not None
    for number, bound, is_most in conflict.bounds(ordered):
        index = space.decision_index(f"{space.connections[number].name}.identifier")
        if index is not None and design[index] >= 0:
            values = enumerate(space.decisions[index].values)
            numbered = [(option, value) for option, value in values if isinstance(value, int)]
            fit = frozenset(option for option, value in numbered if (value <= bound if is_most else value >= bound))
            box[index] = box.get(index, fit) & fit
    return box


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
        return Lesson(_widened(design, is_as_long, compared)[0], (), (key, waited))
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


def soonest_lesson(
    space: Space, key: int, limited: Collection[int], longer_ns: Fraction, design: Design
) -> Lesson | None:
    """The lesson from a message that waits longer than `longer_ns` in every order that meets all deadlines; else None.

    It does so though no thread waits for another; threads that wait pass on more jitter, by which identifiers are not
    chosen. Of those orders, if need be, that have earlier messages of flows before it as the rule does. Only where all
    messages with a deadline are `limited` by it.
    """
    if not _is_chosen_alike(space, limited):
        return None
    alone, (number, has_source) = replace(space, processing="execution_time"), message_of(key)
    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(alone, number, View(design))]):
        before = soonest(alone, number, View(design), kept)
        least = None if before is None else waits_behind_ns(before, alone, View(design), has_source=has_source)
        if before is None or least is None or least <= longer_ns:
            continue
        bound = Fraction(least)

        def is_as_long(seen: View, before: Conflict = before, bound: Fraction = bound) -> bool:
            waits = waits_behind_ns(before, alone, seen, has_source=has_source)
            return waits is not None and waits >= bound

        box = _conflict_box(alone, before, design, is_as_long)
        return Lesson(_both(box, _kept_box(alone, number, design, kept)), (), (key, bound))
    return None


def order_lessons(
    space: Space, key: int, limited: Collection[int], design: Design, open_: Callable[[int], bool]
) -> Iterator[Lesson]:
    """The lessons of which messages go before one in a design, of those for which that is `open_`."""
    if not _is_chosen_alike(space, limited):
        return
    alone = replace(space, processing="execution_time")
    number, told = message_of(key)[0], set[int]()
    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(alone, number, View(design))]):
        whole = soonest(alone, number, View(design), kept)
        fresh = {one for one in whole.group if one not in told and open_(one)} if whole is not None else set[int]()
        if whole is None or not fresh:
            continue
        told |= fresh
        if_kept = _kept_box(alone, number, design, kept)
        yield from (Lesson(if_kept, (), before=(other, number)) for other in sorted(fresh & kept))
        fresh -= kept
        for before in nested(alone, View(design), whole) if fresh else ():
            known = sorted(fresh & {*before.group})
            box = _conflict_box(alone, before, design, lambda seen: True) if known else {}
            yield from (Lesson(_both(box, if_kept), (), before=(other, number)) for other in known)
            fresh -= {*known}


def _is_chosen_alike(space: Space, limited: Collection[int]) -> bool:
    """Whether messages have places in which all meet their deadlines, with jitter that is the same in any order.

    Where no thread waits for another; `limited` must have all messages with a deadline.
    """
    alone = replace(space, processing="execution_time") if counts_responses(space) else space
    if not (is_settled(alone) and open_identifiers(alone)):
        return False
    return all(item.deadline_ns is None or number in limited for number, item in enumerate(space.connections))


def _both(box: dict[int, frozenset[int]], other: dict[int, frozenset[int]]) -> dict[int, frozenset[int]]:
    """The options that are in both of two boxes."""
    found = {**other, **box}
    for one in box.keys() & other.keys():
        found[one] = box[one] & other[one]
    return found


def _kept_box(space: Space, number: int, design: Design, kept: frozenset[int]) -> dict[int, frozenset[int]]:
    """Options with which the rule has the messages `kept` before another one, as it has in a design."""

    def are_before(given: Sequence[int]) -> bool:
        return kept <= earlier_on_flows(space, number, View(given))

    def idler(decision: int) -> Sequence[int] | None:
        item = space.decisions[decision]
        if not is_idler_alike(space, decision):
            return None
        if item.field != "identifier":
            busy = burdens(space, decision)
            return None if busy is None else [-one for one in busy]
        stated = [int(isinstance(value, int)) for value in item.values]
        return [-one for one in stated] if sum(stated) == 1 else None

    return _widened(design, are_before, idler)[0] if kept else {}


def _widened(
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
