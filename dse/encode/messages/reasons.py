"""Why a message takes so long in a design, as few conditions as will do: what a model learns of waiting for buses.

What keeps a bus busier makes messages wait no less (`dse.analysis.messages.burdens`). So where a message takes long it
does so with every option that is no better, and decisions do not matter with whose best option it takes as long. That
holds where the jitter of messages is the same whatever the bus carries: where no message that waits releases what sends
another, and senders end within their longest processing. Where messages may have any identifier it holds of the place
that a message has when those of the others come first: it has no better one in any order that meets all deadlines. What
goes before it there does so in each of these orders, and is told to the model one message at a time: few sets of
messages are then looked at. Of messages of flows the rule has the earlier ones of the file first, where that leaves all
in time: so in designs in which nothing is busier, too, which is a condition in the other direction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.latency.rows import counts_responses
from dse.analysis.memo import looked_at
from dse.analysis.messages.burdens import burdens, goes_first, is_settled
from dse.analysis.messages.conflicts import Conflict, open_identifiers
from dse.analysis.messages.precedence import earlier_on_flows, is_idler_alike, nested, soonest, waits_behind_ns
from dse.analysis.scheduling.responses import message_waits_ns
from dse.analysis.views import View
from dse.encode.linear import OpenTerm
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Space
from dse.space.model.trees import NotOffered

Chosen = Callable[[int, int], int]
"""The literal of an option of a decision, or (below 0) of its being inactive."""
Conditions = list[tuple[int, ...]]
"""One tuple of literals for each decision that matters, of which one literal is true."""


def value_conditions(
    space: Space, chosen: Chosen, term: OpenTerm, view: View, has: int, exact: int
) -> tuple[Conditions, int] | None:
    """Conditions under which the figure of a message is at least so large, and how large.

    More than a solution `has`, and at most its `exact` value. None of other figures, and where none are known.
    """
    if term.message is None:
        return None
    known = conditions_of(space, chosen, term.message.number, term.value, view, exact)
    if known is not None:
        return known, exact
    sooner = soonest_conditions(space, chosen, term, view, has)
    return undelayed_conditions(space, chosen, term, view, has) if sooner is None else sooner


def conditions_of(
    space: Space, chosen: Chosen, message: int, value: Callable[[View], int], view: View, exact: int
) -> Conditions | None:
    """Conditions under which the figure of a message is together at least `exact`.

    None where it is not known which options are no better than those of the design.
    """
    if not is_settled(space) or open_identifiers(space):
        return None

    def is_as_long(trial: Sequence[int]) -> bool:
        return value(View(trial)) >= exact

    def compared(index: int, option: int) -> Sequence[int] | None:
        decision = space.decisions[index]
        if decision.field == "identifier" and decision.component != space.connections[message].name:
            return goes_first(space, decision, message, view)
        return burdens(space, index) if option >= 0 else None

    return _relaxed(chosen, view, is_as_long, compared)[0]


def soonest_conditions(
    space: Space, chosen: Chosen, term: OpenTerm, view: View, has: int
) -> tuple[Conditions, int] | None:
    """Conditions under which a figure is at least so large whatever the identifiers of others, and how large.

    That is what its message waits in the best order for it in which all messages meet their deadlines; in other designs
    some are late. Where that is no more than a solution `has`, of those orders in which messages of flows come first
    that the rule has before it for sure. None where that is no more either.
    """
    message, waiting = term.message, term.waiting
    if message is None or waiting is None or not _is_chosen_alike(space):
        return None
    number = message.number

    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(space, number, view)]):
        before = soonest(space, number, view, kept)
        waits = None if before is None else waits_behind_ns(before, space, view, has_source=message.has_source)
        if before is None or waits is None or (enough := waiting(view, Fraction(waits))) <= has:
            continue

        def is_as_long(seen: View, before: Conflict = before, enough: int = enough) -> bool:
            there = waits_behind_ns(before, space, seen, has_source=message.has_source)
            return there is not None and waiting(seen, Fraction(there)) >= enough

        conditions = conflict_conditions(space, chosen, before, view, is_as_long)
        return [*conditions, *_kept_conditions(space, chosen, number, kept, view)], enough
    return None


def order_conditions(
    space: Space, chosen: Chosen, term: OpenTerm, view: View, known: Callable[[int], bool]
) -> Iterator[tuple[Conditions, int]]:
    """Conditions under which other messages go before that of a figure, whatever the identifiers of the rest.

    Each with the literal of `term.before` that is true then; only of messages of which the model does not know it, and
    as it is where no thread waits for another, by which identifiers are chosen.
    """
    alone = replace(space, processing="execution_time") if counts_responses(space) else space
    if term.message is None or term.waiting is None or not term.before or not _is_chosen_alike(alone):
        return
    number = term.message.number
    told: set[int] = {other for other, literal in term.before.items() if known(literal)}
    for kept in dict.fromkeys([frozenset[int](), earlier_on_flows(alone, number, view)]):
        whole = soonest(alone, number, view, kept)
        fresh = set() if whole is None else {*whole.group} & term.before.keys() - told
        if whole is None or not fresh:
            continue
        told |= fresh
        if_kept = _kept_conditions(alone, chosen, number, kept, view)
        yield from ((if_kept, term.before[one]) for one in sorted(fresh & kept))
        fresh -= kept
        for before in nested(alone, view, whole) if fresh else ():
            if not fresh.isdisjoint(before.group):
                conditions = conflict_conditions(alone, chosen, before, view)
                yield from (([*conditions, *if_kept], term.before[one]) for one in sorted(fresh & {*before.group}))
                fresh -= {*before.group}


def _kept_conditions(space: Space, chosen: Chosen, number: int, before: frozenset[int], view: View) -> Conditions:
    """Conditions under which the rule has messages of flows before a later one of a flow (`earlier_on_flows`)."""
    if not before:
        return []

    def are_before(trial: Sequence[int]) -> bool:
        return before <= earlier_on_flows(space, number, View(trial))

    def idler(index: int, option: int) -> Sequence[int] | None:
        burden = _busier(space, index, option) if is_idler_alike(space, index) else None
        return None if burden is None else [-one for one in burden]

    return _relaxed(chosen, view, are_before, idler)[0]


def _busier(space: Space, index: int, option: int) -> Sequence[int] | None:
    """A number for each option of a decision: the greater, the longer messages wait, and in the fewer orders in time.

    None where options cannot be compared. A stated identifier leaves fewer orders than any.
    """
    if space.decisions[index].field == "identifier":
        known = [isinstance(value, int) for value in space.decisions[index].values]
        return [int(one) for one in known] if known.count(True) == 1 else None
    return burdens(space, index) if option >= 0 else None


def undelayed_conditions(
    space: Space, chosen: Chosen, term: OpenTerm, view: View, has: int
) -> tuple[Conditions, int] | None:
    """Conditions under which a figure is at least so large where no thread waits for another, and how large.

    Threads that wait pass on more jitter, and so messages wait no less, in any order. None where that is no more than
    a solution `has`.
    """
    message, waiting = term.message, term.waiting
    if message is None or waiting is None or not counts_responses(space):
        return None
    number = message.number
    alone = replace(space, processing="execution_time")
    if (sooner := soonest_conditions(alone, chosen, term, view, has)) is not None:
        return sooner

    def least(seen: View) -> int:
        waited = message_waits_ns(alone, number, seen, has_source=message.has_source)
        return waiting(seen, Fraction(waited))

    found = least(View(view.design))
    if found <= has:
        return None
    conditions = conditions_of(alone, chosen, number, least, view, found)
    if conditions is None:
        conditions = [(chosen(index, option),) for index, option in looked_at(view.design, least)[1].items()]
    return conditions, found


def _is_chosen_alike(space: Space) -> bool:
    """Whether places are chosen whose messages all meet their deadlines, with jitter that is the same in any order."""
    return is_settled(space) and open_identifiers(space) and _all_must_be_in_time(space)


def _all_must_be_in_time(space: Space) -> bool:
    """Whether each message with a deadline is required to meet it."""
    required = {
        item.metric.index
        for item in space.requirements
        if item.metric.kind == "message response" and item.metric.key == "deadline" and item.is_upper
    }
    return all(item.deadline_ns is None or number in required for number, item in enumerate(space.connections))


def conflict_conditions(
    space: Space, chosen: Chosen, conflict: Conflict, view: View, further: Callable[[View], bool] = lambda seen: True
) -> Conditions:
    """Conditions under which none of the messages of a conflict can be the last in time.

    And under which something else holds, that holds the more the busier a bus is.
    """

    def is_late(trial: Sequence[int]) -> bool:
        return conflict.is_late(space, View(trial)) and further(View(trial))

    def compared(index: int, option: int) -> Sequence[int | None] | None:
        if option >= 0 and space.decisions[index].field == "carried_in":
            return conflict.frame_burden(space, index, view)
        return burdens(space, index) if option >= 0 else None

    found, relaxed = _relaxed(chosen, view, is_late, compared)
    ordered = conflict.kept_from_last(space, View(relaxed))
    assert ordered is not None
    return [*found, *_numbers(space, chosen, conflict, ordered, view)]


def _numbers(
    space: Space, chosen: Chosen, conflict: Conflict, ordered: frozenset[int], view: View
) -> Iterator[tuple[int, ...]]:
    """Conditions that keep messages with a number before another one."""
    for number, bound, is_most in conflict.bounds(ordered):
        index = space.decision_index(f"{space.connections[number].name}.identifier")
        if index is None:
            continue
        values = enumerate(space.decisions[index].values)
        numbered = [(option, value) for option, value in values if isinstance(value, int)]
        if view[index] >= 0:
            yield tuple(
                chosen(index, option) for option, value in numbered if (value <= bound if is_most else value >= bound)
            )


def _relaxed(
    chosen: Chosen,
    view: View,
    holds: Callable[[Sequence[int]], bool],
    compared: Callable[[int, int], Sequence[int | None] | None],
) -> tuple[Conditions, list[int]]:
    """Conditions under which something holds that the busier a bus is holds the more, and a design at their ends."""
    does_hold, seen = looked_at(view.design, lambda whole: holds(whole.design))
    assert does_hold
    relaxed = list(view.design)
    found: Conditions = []
    for index, option in seen.items():
        burden = compared(index, option)
        if burden is None:
            found.append((chosen(index, option),))
            continue
        known = {number: busy for number, busy in enumerate(burden) if busy is not None}
        best = min(known, key=known.__getitem__)
        if known[best] == known[option]:
            continue
        trial = [*relaxed[:index], best, *relaxed[index + 1 :]]
        if _holds(holds, trial):
            relaxed = trial
            continue
        found.append(tuple(chosen(index, number) for number, busy in known.items() if busy >= known[option]))
    return found, relaxed


def _holds(holds: Callable[[Sequence[int]], bool], trial: Sequence[int]) -> bool:
    try:
        return holds(tuple(trial))
    except (NotOffered, CyclicActivation):
        return False
