"""The priority of a thread: a number, a rule that orders it, several of these as a decision, or whatever is best.

The best order is a decision for each thread: a number, behind the decisions on cores, and like these there only where
something that is asked depends on it.
"""

from __future__ import annotations

from collections.abc import Iterable

from dse.space.model.space import Component, Decision, OpenPriority, Space
from dse.space.model.trees import Choice, Tree, graft, leaves
from dse.space.properties import FieldReader, Ledger, Owner
from dse.spec.schema.fields import ANY_PRIORITY, PRIORITY_RULES
from dse.spec.schema.model import Spec
from dse.support.units import shown


def read_priority(ledger: Ledger, owner: Owner, default: str) -> Tree:
    """The priority of a thread as its leaves have it: a number, the name of a rule, or None where nothing is stated.

    Numbers and rules have no order among each other, so that no list has both. `default` is for those that state none.
    """
    stated = getattr(owner.own, "priority", None) or ()
    if ANY_PRIORITY in stated:
        if len(stated) > 1:
            ledger.error((*owner.path, "priority"), f"{ANY_PRIORITY} stands alone, without other priorities")
        return "deadline_monotonic"
    if not stated:
        return None if default == "rate_monotonic" else "deadline_monotonic"
    rules = [item for item in stated if item in PRIORITY_RULES]
    if rules and len(rules) < len(stated):
        ledger.error((*owner.path, "priority"), f"{rules[0]} and a number: a list has numbers, or rules that order")
        return None
    reader = FieldReader(ledger, owner, "priority", "rule" if rules else "count", str)
    return reader.read(lambda model: model.priority)


def open_priorities(ledger: Ledger, spec: Spec, space: Space, first: int) -> tuple[OpenPriority, ...]:
    """The threads that ask for the best order, each with its decision; `first` is the index of the first of them.

    An `OpenPriority` for each thread with ``priority: any``, over the threads that may share its processor.
    """
    free = {
        number
        for number, item in enumerate(space.components)
        if item.section == "threads" and item.processor is not None and _is_open(spec, item)
    }
    priorities: list[OpenPriority] = []
    numbers = _numbers(space, free)
    for number in sorted(free):
        component = space.components[number]
        others = {
            other
            for other, item in enumerate(space.components)
            if item.processor is not None and set(leaves(item.processor)) & set(leaves(component.processor)) - {None}
        }
        _check_order(ledger, spec, space, number, others - free)
        name = f"{component.name}.priority"
        texts = {item: str(item) for item in numbers}
        if len(numbers) < 2:
            ledger.refer(name, "count", numbers[0], texts)
            continue
        index = first + len(priorities)
        home = graft(component.processor, lambda slot, index=index, numbers=numbers: (  # type: ignore[misc]
            None if slot is None else Choice(index, numbers)
        ))  # fmt: skip
        if all(leaf is not None for leaf in leaves(component.processor)):
            home = Choice(index, numbers)
        decision = Decision(name, component.name, "priority", "count", tuple(texts.values()), numbers, home)
        priorities.append(OpenPriority(number, index, decision))
        ledger.refer(name, "count", home, texts)
    return tuple(priorities)


def _is_open(spec: Spec, component: Component) -> bool:
    priority = spec.threads[component.stated_as].priority
    return priority == (ANY_PRIORITY,) if priority else spec.priorities == ANY_PRIORITY


def _check_order(ledger: Ledger, spec: Spec, space: Space, number: int, others: Iterable[int]) -> None:
    """Check that all threads that share a core with one of open order have priority numbers."""
    whole = (number, *sorted(others))
    executed = [item for item in whole if not space.components[item].is_lone]
    if executed:
        name = space.components[number].stated_as
        one = space.components[executed[0]]
        where = f"where an executor runs {shown(one.name)}"
        if one.pieces:
            where = f"together with {shown(one.stated_as)}, which has segments"
        elif one.reservation is not None:
            where = f"where {shown(one.name)} has a reservation"
        ledger.error(
            ("threads", name, "priority") if spec.threads[name].priority else ("priorities",),
            f"any priority {where}",
            "the best order is sought of threads alone: give numbers, or have rules order them",
        )
        return
    for other in sorted(others):
        item = space.components[other]
        if item.section == "threads" and not all(isinstance(leaf, int) for leaf in leaves(item.priority)):
            name = space.components[number].stated_as
            path: tuple[str, ...] = ("threads", name, "priority") if spec.threads[name].priority else ("priorities",)
            message = f"any priority together with {shown(item.name)}, which has no number and may share a processor"
            ledger.error(path, message, f"give {shown(item.name)} a number, or `priority: any` as well")
            return


def _numbers(space: Space, free: set[int]) -> tuple[int, ...]:
    """Numbers enough for any order of threads that may share a processor, around those that others state.

    All threads have the same ones.
    """
    runs = {number: set(leaves(item.processor)) - {None} for number, item in enumerate(space.components)}
    slots = {slot for number in free for slot in runs[number]}
    count = max((sum(slot in runs[number] for number in free) for slot in slots), default=0)
    beside = [space.components[number] for number in runs if number not in free and runs[number] & slots]
    stated = {leaf for item in beside for leaf in leaves(item.priority) if isinstance(leaf, int)}
    if stated:
        around = (range(max(0, number - count), number + count + 1) for number in stated)
        return tuple(sorted({item for part in around for item in part}))
    levels = [leaf for slot in slots for leaf in leaves(space.processors[slot].priority_levels)]
    most = count if None in levels else max(levels, default=count)
    return tuple(range(1, min(count, most) + 1))
