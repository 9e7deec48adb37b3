"""Why a message takes so long in a design, as few conditions as will do: what a model learns of waiting for buses.

A message never takes less time on its bus where frames are longer, the bus is slower, messages come more often, or more
of them go first: more has to be sent before it (docs/semantics.md, section 5.4). So where it takes long it does so with
every option that is no better, and decisions do not matter with whose best option it takes as long. That holds where
the jitter of messages is the same whatever the bus carries: where no message that waits releases what sends another,
and senders end within their longest processing.
"""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.messages.stages import counted_buses, may_wait_for
from dse.analysis.views import Noting, View
from dse.encode.linear import OpenTerm
from dse.encode.scheduling.places import Places
from dse.space.architecture.clocks import is_always_timed
from dse.space.architecture.frames import Frame
from dse.space.model.space import Decision, Space
from dse.space.model.trees import Choice, NotOffered, Tree, at


def conditions_of(space: Space, places: Places, term: OpenTerm, view: View, exact: int) -> list[tuple[int, ...]] | None:
    """For each decision that matters literals of which one is true: together the figure is at least `exact`.

    None where it is not known which options are no better than those of the design.
    """
    if term.message is None or not _is_settled(space):
        return None
    noting = Noting(view.design)
    term.value(View(noting))
    relaxed = list(view.design)
    found: list[tuple[int, ...]] = []
    for index, option in noting.seen.items():
        burden = _burden(space, index, term.message, view) if option >= 0 else None
        if burden is None:
            found.append((places.chosen(index, option),))
            continue
        best = min(range(len(burden)), key=burden.__getitem__)
        if burden[best] == burden[option]:
            continue
        trial = [*relaxed[:index], best, *relaxed[index + 1 :]]
        if _is_as_long(term, trial, exact):
            relaxed = trial
            continue
        worse = (number for number, item in enumerate(burden) if item >= burden[option])
        found.append(tuple(places.chosen(index, number) for number in worse))
    return found


def _is_as_long(term: OpenTerm, design: Sequence[int], exact: int) -> bool:
    try:
        return term.value(View(tuple(design))) >= exact
    except NotOffered:
        return False


def _is_settled(space: Space) -> bool:
    """Whether the jitter of all messages is the same whatever their buses carry."""
    if space.processing != "execution_time" or not counted_buses(space):
        return False
    led_to = {item.target for number, item in enumerate(space.connections) if may_wait_for(space, number)}
    senders = {item.source for number, item in enumerate(space.connections) if may_wait_for(space, number)}
    timed = {
        number for number in led_to & senders if number is not None and not is_always_timed(space.components[number])
    }
    return not timed


def _burden(space: Space, index: int, message: int, view: View) -> Sequence[int] | None:
    """How much each option of a decision keeps a bus busy before a message, more the greater; None: not known."""
    decision = space.decisions[index]
    if decision.field == "period":
        number = space.component_numbers.get(decision.component)
        is_timer = number is not None and is_always_timed(space.components[number])
        return [-value for value in decision.values] if is_timer else None
    if decision.field == "data_size":
        return list(decision.values)
    bus = next((item for item in space.buses if item.name == decision.component), None)
    if bus is not None and decision.field == "bandwidth":
        return [-value for value in decision.values] if _same_but_for_rate(bus.fixed_ns) else None
    if bus is not None and index == bus.type_decision:
        rates = bus.bandwidth_bps.branches if isinstance(bus.bandwidth_bps, Choice) else ()
        trees = (bus.fixed_ns, bus.overhead_bytes, bus.arbitration)
        is_alike = all(map(_same_but_for_rate, trees)) and all(type(rate) is int for rate in rates)
        return [-rate for rate in rates] if is_alike and len(rates) == len(decision.options) else None
    if decision.field == "identifier" and decision.component != space.connections[message].name:
        return _goes_first(space, decision, message, view)
    return None


def _same_but_for_rate(tree: Tree) -> bool:
    """Whether all types of a bus have one figure; of its frames those of CAN, whose bits take less the faster it is."""
    leaves = tree.branches if isinstance(tree, Choice) else (tree,)
    if any(isinstance(leaf, Choice) or leaf != leaves[0] for leaf in leaves):
        return False
    return not isinstance(leaves[0], Frame) or leaves[0].protocol == "can"


def _goes_first(space: Space, decision: Decision, message: int, view: View) -> Sequence[int] | None:
    """Whether each identifier goes before that of a message: among those that do, and those that do not, all is one."""
    own = at(space.connections[message].identifier, view)
    return None if own is None else [int(value < own) for value in decision.values]
