"""Which cores of a processor are interchangeable: designs that differ in their numbers alone have the same figures.

The one home of that condition for the search and for what is shown of its designs; `dse.verification`, which proves
again what the search says, has its own.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Sequence

from dse.space.model.space import Component, OpenCore, Space
from dse.space.model.trees import Choice, Tree, leaves
from dse.space.question.metrics import by_first_fit, most_cores
from dse.space.question.open_cores import names_cores, numbers_of

Classes = tuple[tuple[int, ...], ...]
"""Cores from 1 on: those of one class may change places."""


def interchangeable_cores(
    space: Space,
    processor: int,
    threads: Collection[int] | None = None,
    *,
    fixable: Collection[int] = (),
    by_rule: bool = True,
) -> Classes:
    """The classes of a processor's cores that nothing in the question tells apart, in the order of their first cores.

    What tells cores apart: rules and figures of single cores, groups of cores, first-fit, which goes through cores by
    their numbers, and where each thread may run: on stated cores, on those of its list, on the one that is fixed.

    Parameters
    ----------
    space
        the question.
    processor
        its place among the processors.
    threads
        who is looked at, by component; all that may run there when omitted.
    fixable
        decisions, by index, that may be fixed to any of their options later on.
    by_rule
        whether first-fit matters: not where only some placement is asked for.

    Examples
    --------
    >>> import dse
    >>> thread = {"processor": "p", "period": "10 ms", "compute_execution_time": "1 ms"}
    >>> def cores_of(listed):
    ...     threads = {"a": {**thread, "core": listed}, "b": thread}
    ...     return dse.load({"dse": 1, "name": "Four", "processor_types": {"t": {"cores": 4}}, "threads": threads,
    ...                      "processors": {"p": {"type": "t"}}, "deadlines": "all"})
    >>> interchangeable_cores(cores_of("any").space, 0)
    ((1, 2, 3, 4),)
    >>> interchangeable_cores(cores_of([1, 3]).space, 0)
    ((1, 3), (2, 4))
    """
    every = range(1, most_cores(space, processor) + 1)
    if names_cores(space) or (by_rule and any(by_first_fit(space, processor))):
        return tuple((core,) for core in every)
    decided: dict[int, list[OpenCore]] = defaultdict(list)
    for item in space.open_cores:
        for number in item.threads:
            decided[number].append(item)
    classes: dict[Hashable, list[int]] = defaultdict(list)
    for core in every:
        marks: list[Hashable] = [_groups(space, processor, core)]
        for number, component in enumerate(space.components):
            if processor in set(leaves(component.processor)) and (threads is None or number in threads):
                marks += [_mark(space, item, core, fixable) for item in decided[number]]
                marks += [core in set(leaves(tree)) for tree in _stated(space, component, decided[number])]
        classes[tuple(marks)].append(core)
    return tuple(tuple(cores) for cores in classes.values())


def are_offered_in_order(space: Space, cores: Collection[int]) -> bool:
    """Whether every decision that offers interchangeable cores offers them in the order of their numbers.

    The first design in the order of the file uses equal cores in the order of their options, and a type may lack the
    one that is offered first: elsewhere cores cannot be numbered without losing designs.

    Examples
    --------
    >>> import dse
    >>> thread = {"processor": "p", "period": "10 ms", "compute_execution_time": "1 ms"}
    >>> def space_of(*lists):
    ...     threads = {f"t{number}": {**thread, "core": cores} for number, cores in enumerate(lists)}
    ...     return dse.load({"dse": 1, "name": "Three", "processor_types": {"t": {"cores": 3}}, "threads": threads,
    ...                      "processors": {"p": {"type": "t"}}, "deadlines": "all"}).space
    >>> are_offered_in_order(space_of("any", [1, 3, 2]), (1, 3)), are_offered_in_order(space_of("any", [2, 1]), (1, 2))
    (True, False)
    """
    offered = ([core for core in item.decision.values if core in cores] for item in space.open_cores)
    return all(order == sorted(order) for order in offered)


def _groups(space: Space, processor: int, core: int) -> Hashable:
    """The group of a core in each type that has several kinds of cores."""
    slot = space.processors[processor]
    return tuple(
        next((group for group, _ in named if core in numbers_of(slot, type_name, group)), None)
        for type_name, named in slot.groups.items()
    )


def _stated(space: Space, component: Component, decided: Sequence[OpenCore]) -> list[Tree]:
    """The cores of a thread that no decision gives it: its own, or those of the executors that it may be in."""
    if not isinstance(component.executor, Choice):
        return [] if decided else [component.core]
    owners = {item.decision.component for item in decided}
    executors = [space.executors[number] for number in dict.fromkeys(leaves(component.executor))]
    return [item.core for item in executors if item.name not in owners]


def _mark(space: Space, item: OpenCore, core: int, fixable: Collection[int]) -> Hashable:
    """The properties that distinguish a core from others where a decision chooses it."""
    if item.index in fixable:
        return core
    if item.index in space.fixed:
        return bool(core == item.decision.values[space.fixed[item.index]])
    return core in item.decision.values
