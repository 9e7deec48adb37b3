"""A message of a connection, and what each other connection adds to it that may be carried in it.

A frame is known by its head, the connection whose message it is. Where all bytes take as long as any other (CAN) each
connection that is carried adds its own part, whatever else is carried; in other frames (CAN FD fills up) it may add
nothing. So what a frame takes at least is a sum, without a case for each combination of connections.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dse.analysis.messages.stages import candidate_of, limit_ns
from dse.analysis.scheduling.resolve import released_undelayed
from dse.analysis.usage import ADDITIVE
from dse.analysis.views import Case, PartialView, View, tabulate
from dse.space.architecture.frames import MOST_BYTES, frame_at, wire_ns
from dse.space.model.space import Space
from dse.space.model.trees import Choice, at
from dse.support.units import Exact

MOST_CASES = 16
"""A connection with more combinations of options than this adds nothing."""


@dataclass(frozen=True)
class Added:
    """The least that a connection adds to the message that it is carried in, and how long it may take; in ns."""

    extra_ns: Exact
    limit_ns: Exact | None


def has_own_message(space: Space, number: int) -> bool:
    """Whether a connection has a message of its own in some design, as far as the options that are fixed say."""
    tree = space.connections[number].carried_in
    if isinstance(tree, Choice) and tree.decision in space.fixed:
        tree = tree.branches[space.fixed[tree.decision]]
    return None in tree.branches if isinstance(tree, Choice) else tree is None


def apart(space: Space, number: int, given: Mapping[int, int]) -> dict[int, int]:
    """The options `given` and those with which the message of a connection has its own data alone.

    Decisions by number, with their options; what is always carried in it stays.
    """
    found = dict(given)
    own = space.connections[number].carried_in
    if isinstance(own, Choice):
        found[own.decision] = own.branches.index(None)
    for rider in space.connections[number].riders:
        tree = space.connections[rider].carried_in
        if isinstance(tree, Choice) and tree.decision not in space.fixed:
            others = [option for option, head in enumerate(tree.branches) if head != number]
            found[tree.decision] = next((item for item in others if tree.branches[item] is None), others[0])
    return found


def added(space: Space, bus: int, number: int, rider: int, alone: Mapping[int, int]) -> list[Case[Added]]:
    """The additions of a connection to the message of another one on a bus, by the options that they depend on.

    Each case has the option with which it is carried there among its conditions. `alone` are options with which nothing
    is (`apart`). Empty where it is always or never carried there, or there are too many cases.
    """
    tree = space.connections[rider].carried_in
    if not isinstance(tree, Choice) or tree.decision not in alone:
        return []
    carried = tree.branches.index(number)

    def formula(view: View) -> Added:
        limit = limit_ns(space, bus, rider, view)
        frame = frame_at(space.buses[bus].fixed_ns, view)
        if frame is not None and frame.protocol not in ADDITIVE:
            return Added(0, limit)
        without = PartialView({**view.design, tree.decision: alone[tree.decision]})
        return Added(_last_ns(space, bus, number, view) - _last_ns(space, bus, number, without), limit)

    cases = tabulate(space, formula, MOST_CASES, {**alone, tree.decision: carried}) or []
    return [Case(((tree.decision, carried), *case.conditions), case.value) for case in cases]


def _last_ns(space: Space, bus: int, number: int, view: View) -> Exact:
    (task,) = released_undelayed(space, view, [(number, "message")]).values()
    return candidate_of(space, bus, number, view, task).last_ns


def longest_frame_ns(space: Space, bus: int, view: View) -> Exact | None:
    """The time of a frame with all the data that it can have, in ns; None where there is no such limit."""
    frame = frame_at(space.buses[bus].fixed_ns, view)
    if frame is None or frame.protocol not in MOST_BYTES:
        return None
    return wire_ns(frame, MOST_BYTES[frame.protocol], at(space.buses[bus].bandwidth_bps, view))[1]
