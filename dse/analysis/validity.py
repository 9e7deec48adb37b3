"""Which combinations of options are designs at all: structure, bindings and the user's rules.

`conditions` gives predicates on designs that each consult few decisions, `covers` the slots that must not be filled in
vain. Evaluation and search read the same list.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any

from dse.analysis.binding import (
    bus_figure,
    bus_stack,
    frame_of,
    message_sizes,
    overhead_bytes,
    travels_whole,
    ways_over,
)
from dse.analysis.limits import HOLDS
from dse.analysis.usage import all_reachable_buses
from dse.analysis.views import View, is_met
from dse.space.architecture.arbitration import is_one_message
from dse.space.architecture.carriers import carriers, counted, wrapping
from dse.space.architecture.frames import MOST_BYTES, Frame, frame_at
from dse.space.model.criteria import Atom, MultipleTest, PairTest, ResolvedCondition, Rule, UsedTest, ValueTest
from dse.space.model.space import EMPTY, INACTIVE, Component, Connection, Decision, Design, Slot, Space
from dse.space.model.trees import NOT_OFFERED, Choice, NotOffered, PerProcessorType, Tree, at, consulted, leaves
from dse.spec.language.expressions import And, Not, Or
from dse.spec.schema.fields import ANY_IDENTIFIER

NO_LIMIT = 10**9
"""Bytes that no frame has to hold."""
MOST_LISTED = 8
"""The most options of a decision that are named where another one was chosen."""


@dataclass(frozen=True)
class Predicate:
    """Something that must hold in every design, with the words to say so; `why` says more where it does not.

    `why` gives a longer sentence for one design; `text` says what should hold. Where there are `terms` it holds where
    their sum is at most 0: each consults few decisions.
    """

    text: str
    holds: Callable[[View], bool]
    why: Callable[[Design], str] | None = None
    terms: tuple[Callable[[View], int], ...] = ()

    def _breach(self, design: Design) -> str:
        """The sentence about a design that violates the condition."""
        return self.text if self.why is None else self.why(design)


@dataclass(frozen=True)
class Cover:
    """An optional slot must be empty unless one of its users is bound to it.

    `users` are predicates: whether a thread runs in the slot, or a message is carried by it.
    """

    slot: Slot
    users: tuple[Callable[[View], bool], ...]


def has_conditional_home(decision: Decision, index: int) -> bool:
    """Whether the decision can be inactive: its home tree does not begin with it.

    Unconditional decisions are active in every design.
    """
    return not (isinstance(decision.home, Choice) and decision.home.decision == index)


def canonical(space: Space, design: Design) -> Design:
    """The design with every decision that it does not use marked inactive; equal designs become identical.

    Inactive decisions get the option `INACTIVE`. Designs are compared and hashed in this form only.
    """
    view = View(design)
    return tuple(
        option if is_met(space.decisions[index], index, view) else INACTIVE for index, option in enumerate(design)
    )


def _unanswered(space: Space, view: View) -> list[Decision]:
    """The decisions that a design uses without an option for them."""
    open_ = (index for index, option in enumerate(view.design) if option < 0)
    return [space.decisions[index] for index in open_ if is_met(space.decisions[index], index, view)]


def _structural_predicates(space: Space) -> Iterator[Predicate]:
    """The conditions of the architecture on every design."""
    for number, decision in enumerate(space.decisions):
        if _mentions_not_offered(decision.home):
            why = partial(_what_is_offered, decision, number)
            yield Predicate(f"{decision.name} is offered", partial(_is_offered, decision.home), why)
    yield from _offered_by_machines(space)
    yield from _filled_slots(space)
    yield from _shared_processes(space)
    yield from _existing_cores(space)
    yield from _different_identifiers(space)
    yield from _whole_frames(space)


def _different_identifiers(space: Space) -> Iterator[Predicate]:
    """Messages that meet on a bus have different identifiers, but for one that a broadcast bus carries to several."""
    named = [(number, item) for number, item in enumerate(space.connections) if item.identifier is not None]
    if not any(isinstance(item.identifier, Choice) or isinstance(item.bus, Choice) for _, item in named):
        return  # that they are different was looked at when the file was read
    reach = all_reachable_buses(space)
    offered = {number: set(leaves(item.identifier)) - {None, ANY_IDENTIFIER} for number, item in named}
    for (one, first), (two, second) in combinations(named, 2):
        if offered[one] & offered[two] and any(not space.buses[bus].virtual for bus in reach[one] & reach[two]):
            text = f"{first.name} and {second.name} have different identifiers"
            yield Predicate(text, partial(_are_apart, space, first, second))


def _whole_frames(space: Space) -> Iterator[Predicate]:
    """The conditions of messages that carry the data of several connections: none is carried itself, and all data fit.

    A message that carries others has a frame of its own, and their data together are no longer than that frame.
    """
    for number, item in enumerate(space.connections):
        heads = {leaf for leaf in leaves(item.carried_in) if leaf is not None}
        for head in sorted(heads):
            other = space.connections[head]
            if other.carried_in is not None:
                text = f"{other.name} is not carried itself where it carries {item.name}"
                yield Predicate(text, partial(_is_own_message, item, head, other))
        for bus in sorted(carriers(space.buses, item)) if item.riders else ():
            if any(
                leaf.protocol in MOST_BYTES for leaf in leaves(space.buses[bus].fixed_ns) if isinstance(leaf, Frame)
            ):
                text = f"all data that {item.name} carries fit into a frame of {space.buses[bus].name}"
                terms = _room_terms(space, number, bus) if travels_whole(space, number) else ()
                yield Predicate(text, partial(_fits, space, number, bus), terms=terms)


def _is_own_message(rider: Connection, head: int, other: Connection, view: View) -> bool:
    return at(rider.carried_in, view) != head or at(other.carried_in, view) is None


def _fits(space: Space, number: int, bus: int, view: View) -> bool:
    item = space.connections[number]
    frame = frame_of(space, item, view)
    leaf = frame_at(space.buses[bus].fixed_ns, view)
    if len(frame) == 1 or leaf is None or leaf.protocol not in MOST_BYTES:
        return True
    sizes = (size for one in frame for size in message_sizes(space, one, bus, view))
    return max(sizes, default=0) <= MOST_BYTES[leaf.protocol]


def _room_terms(space: Space, number: int, bus: int) -> tuple[Callable[[View], int], ...]:
    """Terms in B of which the sum is at most 0 where all connections of a frame fit into it: data less room.

    A message that is too long for one frame carries no others, not even of 0 B.
    """
    item = space.connections[number]

    def beyond(view: View) -> int:
        leaf = frame_at(space.buses[bus].fixed_ns, view)
        if leaf is None or leaf.protocol not in MOST_BYTES:
            return -NO_LIMIT
        ways = ways_over(space, item, bus, view)
        around = max((overhead_bytes(space, way, view) for way in ways), default=-NO_LIMIT)
        return int(around + at(item.size_bytes, view) - MOST_BYTES[leaf.protocol])

    def own(view: View) -> int:
        return min(0, beyond(view))

    def added(rider: Connection, view: View) -> int:
        is_in = at(rider.carried_in, view) == number
        return int(at(rider.size_bytes, view)) + (beyond(view) > 0) if is_in else 0

    return (own, *(partial(added, space.connections[rider]) for rider in item.riders))


def _are_apart(space: Space, first: Connection, second: Connection, view: View) -> bool:
    """Whether two messages have different identifiers, are on different buses, or are one message."""
    identifier = at(first.identifier, view)
    if identifier == ANY_IDENTIFIER or identifier != at(second.identifier, view):
        return True
    if second in frame_of(space, first, view):
        return True
    stacks = [bus_stack(space, item, view) for item in (first, second)]
    shared = [bus for bus in stacks[0] if bus in stacks[1] and not space.buses[bus].virtual]
    return all(is_one_message(first, second) and at(space.buses[bus].broadcast, view) for bus in shared)


def _mentions_not_offered(tree: Tree) -> bool:
    if isinstance(tree, Choice):
        return any(_mentions_not_offered(branch) for branch in tree.branches)
    return tree is NOT_OFFERED


def _is_offered(home: Tree, view: View) -> bool:
    return consulted(home, view)[1] is not NOT_OFFERED


def _what_is_offered(decision: Decision, number: int, design: Design) -> str:
    """The options of a decision beside the others of a design, which has one that is not among them."""
    offers = []
    for option, text in enumerate(decision.options):
        if _is_offered(decision.home, View((*design[:number], option, *design[number + 1 :]))):
            offers.append(text)
    listed = ", ".join(offers[:MOST_LISTED]) + (
        f" and {len(offers) - MOST_LISTED:,} more" if offers[MOST_LISTED:] else ""
    )
    chosen = f" {decision.options[design[number]]}" if design[number] >= 0 else ""
    return f"{decision.name}:{chosen or ' it'} is not offered with the other choices (offered: {listed or 'nothing'})"


def _offered_by_machines(space: Space) -> Iterator[Predicate]:
    """The chosen figures of a virtual bus are offered on each machine that runs it."""
    for connection in space.connections:
        buses = counted(space.buses, connection)
        trees = [tree for bus in buses for tree in (bus.fixed_ns, bus.per_byte_ns, bus.latency_ns)]
        tables = [leaf for tree in trees for leaf in leaves(tree) if isinstance(leaf, PerProcessorType)]
        if any(_mentions_not_offered(subtree) for table in tables for subtree in table.by_type.values()):
            yield Predicate(
                f"what carries {connection.name} is offered on the machine that runs it",
                partial(_has_figures, space, connection),
            )


def _has_figures(space: Space, connection: Connection, view: View) -> bool:
    try:
        stack = frozenset(bus_stack(space, connection, view))
        for bus in (space.buses[index] for index in stack | wrapping(space.buses, connection.protocols, stack)):
            for tree in (bus.fixed_ns, bus.per_byte_ns, bus.latency_ns):
                bus_figure(space, tree, connection, view)
    except NotOffered:
        return False
    return True


def _filled_slots(space: Space) -> Iterator[Predicate]:
    """Nothing is bound to an empty slot."""
    for slot, users in slot_users(space):
        if not slot.optional:
            continue
        empty = slot.types.index(EMPTY)
        for name, uses in users:
            text = f"{name} is not bound to the empty slot {slot.name}"
            yield Predicate(text, partial(_is_filled_if_used, slot.type_decision, empty, uses))


def _is_filled_if_used(decision: int, empty: int, uses: Callable[[View], bool], view: View) -> bool:
    return view[decision] != empty or not uses(view)


def covers(space: Space) -> tuple[Cover, ...]:
    """The optional slots with everything that may be bound to them.

    A combination of options that fills an optional slot without a user is no design.
    """
    return tuple(Cover(slot, tuple(uses for _, uses in users)) for slot, users in slot_users(space) if slot.optional)


def slot_users(space: Space) -> Iterator[tuple[Slot, list[tuple[str, Callable[[View], bool]]]]]:
    """The possible users of each slot: their names, with a predicate that tells whether a design binds them to it.

    Pairs of a slot and its users (name, predicate), processors first.
    """
    for number, slot in enumerate(space.processors):
        threads = [item for item in space.components if number in set(leaves(item.processor))]
        yield slot, [(item.name, _runs_on(item.processor, number)) for item in threads]
    reach = all_reachable_buses(space)
    for number, bus in enumerate(space.buses):
        wires = [item for item, buses in zip(space.connections, reach, strict=True) if number in buses]
        yield bus, [(item.name, _is_carried(space, item, number)) for item in wires]


def _runs_on(processor: Tree, number: int) -> Callable[[View], bool]:
    return lambda view: at(processor, view) == number


def _is_carried(space: Space, connection: Any, number: int) -> Callable[[View], bool]:
    return lambda view: number in bus_stack(space, connection, view)


def _existing_cores(space: Space) -> Iterator[Predicate]:
    """A thread with a stated core runs on a processor that has it."""
    for component in space.components:
        if component.core is not None:
            yield Predicate(has_core_text(component), partial(_has_core, space, component))
    for item in space.open_cores:
        least, component = min(item.decision.values), space.components[item.component]
        if component.core is None and least > 1:
            text = f"a core of {component.name} is one that its processor has"
            yield Predicate(text, partial(_has_listed_core, space, component, least))


def has_core_text(component: Component) -> str:
    """The text of the rule that the core of a thread is one that its processor has.

    Also used to recognise the predicate among the breaches of a design.
    """
    return f"the core of {component.name} is one that its processor has"


def _has_listed_core(space: Space, component: Component, least: int, view: View) -> bool:
    processor = at(component.processor, view)
    count = 0 if processor is None else at(space.processors[processor].cores, view)
    return bool(count < 2 or least <= count)


def _has_core(space: Space, component: Component, view: View) -> bool:
    core, processor = at(component.core, view), at(component.processor, view)
    return core is None or processor is None or core <= at(space.processors[processor].cores, view)


def _shared_processes(space: Space) -> Iterator[Predicate]:
    """Threads of one process run on one processor."""
    threads = [item for item in space.components if item.process is not None and item.processor is not None]
    for position, one in enumerate(threads):
        for other in threads[position + 1 :]:
            if not set(leaves(one.process)) & set(leaves(other.process)):
                continue
            if one.processor == other.processor and not isinstance(one.processor, Choice):
                continue

            def together(view: View, one: Any = one, other: Any = other) -> bool:
                process = at(one.process, view)
                if process is None or process != at(other.process, view):
                    return True
                return bool(at(one.processor, view) == at(other.processor, view))

            yield Predicate(f"{one.name} and {other.name} run on one processor if they share a process", together)


def truth(condition: ResolvedCondition, view: View) -> bool | None:
    """Kleene's three-valued truth: None is unknown, because a figure is inactive in the design.

    Source: docs/semantics.md, section 7.
    """
    if isinstance(condition, Not):
        value = truth(condition.operand, view)
        return None if value is None else not value
    if isinstance(condition, And | Or):
        decisive = isinstance(condition, Or)
        values = [truth(item, view) for item in condition.operands]
        if decisive in values:
            return decisive
        return None if None in values else not decisive
    return atom_truth(condition, view)


def atom_truth(atom: Atom, view: View) -> bool | None:
    """The truth of a single test.

    None where a figure is inactive in the design: rules treat that as unknown.
    """
    if isinstance(atom, UsedTest):
        return any(_value(tree, view) in names for tree, names in atom.types)
    if isinstance(atom, ValueTest):
        value = _value(atom.tree, view)
        if value is None:
            return None
        return value in atom.value if atom.operator == "in" else HOLDS[atom.operator](value, atom.value)
    left, right = _value(atom.left, view), _value(atom.right, view)
    if left is None or right is None:
        return None
    if isinstance(atom, MultipleTest):
        return bool(left % right == 0)
    assert isinstance(atom, PairTest)
    return HOLDS[atom.operator](left, right)


def _value(tree: Tree, view: View) -> Any:
    """The figure, or None where it is inactive or not offered."""
    try:
        return at(tree, view)
    except NotOffered:
        return None


def is_broken(rule: Rule, view: View) -> bool:
    """``require`` is broken only by what is false, ``forbid`` only by what is true.

    Three-valued logic: an unknown condition breaks neither.
    """
    return truth(rule.condition, view) is (rule.verb == "forbid")


class Rulebook:
    """Everything that makes a combination of options a design, gathered once for a space.

    Structure (optional slots, processes, cores), bindings, and the user's rules, each as a `Predicate` or rule.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.predicates = tuple(_structural_predicates(space))
        self.covers = covers(space)

    def breaches(self, design: Design) -> list[str]:
        """The reasons why the design is not valid, in words; empty when it is.

        Raises
        ------
        NotOffered
            when the bindings cannot even be followed.
        """
        view = View(design)
        broken = [f"{item.name} has no option" for item in _unanswered(self.space, view)]
        broken += [item._breach(design) for item in self.predicates if not item.holds(view)]
        for cover in self.covers:
            filled = cover.slot.types[view[cover.slot.type_decision]] != EMPTY
            if filled and not any(uses(view) for uses in cover.users):
                broken.append(f"nothing is bound to the optional slot {cover.slot.name}: it is empty")
        broken += [rule.text for rule in self.space.rules if is_broken(rule, view)]
        for decision, option in self.space.fixed.items():
            item = self.space.decisions[decision]
            if design[decision] != option and is_met(item, decision, view):
                broken.append(f"{item.name} is fixed at {item.options[option]}")
        return broken
