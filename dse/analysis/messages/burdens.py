"""Which options of a decision keep a bus busier: with more of them messages never wait less.

A message never takes less time on its bus where frames are longer, the bus is slower, or messages or faults come more
often, nor do fewer orders meet all deadlines where deadlines are later (docs/semantics.md, section 5.4).
"""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.messages.stages import counted_buses, is_each_alone, may_wait_for
from dse.analysis.views import View
from dse.space.architecture.clocks import is_always_timed
from dse.space.architecture.frames import Frame
from dse.space.model.space import Decision, Space
from dse.space.model.trees import Choice, Tree, at


def burdens(space: Space, index: int) -> Sequence[int] | None:
    """A number for each option of a decision, the greater the busier; None where options cannot be compared."""
    decision = space.decisions[index]
    if decision.field == "period":
        number = space.component_numbers.get(decision.component)
        is_timer = number is not None and is_always_timed(space.components[number])
        return [-value for value in decision.values] if is_timer else None
    if decision.field in ("data_size", "fault_burst"):
        return list(decision.values)
    if decision.field == "fault_interval":
        return [-value for value in decision.values]
    if decision.field == "deadline" and any(item.name == decision.component for item in space.connections):
        return [-value for value in decision.values]
    bus = next((item for item in space.buses if item.name == decision.component), None)
    if bus is not None and decision.field == "bandwidth":
        return [-value for value in decision.values] if _same_but_for_rate(bus.fixed_ns) else None
    if bus is not None and index == bus.type_decision:
        rates = bus.bandwidth_bps.branches if isinstance(bus.bandwidth_bps, Choice) else ()
        trees = (bus.fixed_ns, bus.overhead_bytes, bus.arbitration, bus.fault_interval_ns, bus.fault_burst)
        is_alike = all(map(_same_but_for_rate, trees)) and all(type(rate) is int for rate in rates)
        return [-rate for rate in rates] if is_alike and len(rates) == len(decision.options) else None
    return None


def _same_but_for_rate(tree: Tree) -> bool:
    """Whether all types of a bus have one figure; of its frames those of CAN, whose bits take less the faster it is."""
    leaves = tree.branches if isinstance(tree, Choice) else (tree,)
    if any(isinstance(leaf, Choice) or leaf != leaves[0] for leaf in leaves):
        return False
    return not isinstance(leaves[0], Frame) or leaves[0].protocol == "can"


def is_settled(space: Space) -> bool:
    """Whether the jitter of all messages is the same whatever their buses carry.

    So it is where no message that waits dispatches a sender of another one, nor what dispatches such a sender.
    """
    if space.processing != "execution_time" or not counted_buses(space):
        return False
    waiting = {number for number in range(len(space.connections)) if may_wait_for(space, number)}
    senders = {space.connections[number].sender for number in waiting}
    dispatched = {
        number: set(item.triggers) for number, item in enumerate(space.components) if not is_always_timed(item)
    }
    late: set[int] = set()
    wires = waiting
    while fresh := {number for number, triggers in dispatched.items() if triggers & wires} - late:
        late |= fresh
        wires = {number for number, item in enumerate(space.connections) if item.sender in fresh}
    return not late & senders


def goes_first(space: Space, decision: Decision, message: int, view: View) -> Sequence[int] | None:
    """Whether each identifier goes before that of a message: among those that do, and those that do not, all is one.

    None where that is not so: of a message without one, or where senders queue messages as they come.
    """
    if not is_each_alone(space):
        return None
    own = at(space.connections[message].identifier, view)
    return None if own is None else [int(value < own) for value in decision.values]
