"""Designs that differ in the numbers of cores alone are the same: equal cores of a processor may change places."""

from __future__ import annotations

from collections import Counter

from dse.analysis.views import View
from dse.results.assignment import best_assignment
from dse.space.cores import tells_cores_apart
from dse.space.trees import at
from dse.space.types import Design, Space


def numbered_like(space: Space, design: Design, other: Design) -> Design:
    """The design with the cores of each processor numbered such that as many threads as can have the one in `other`.

    Where something tells cores apart (a rule, a fixed or stated core, the baseline) the numbers stay.

    Examples
    --------
    >>> import dse
    >>> thread = {"processor": "p", "period": "10 ms", "compute_execution_time": "1 ms"}
    >>> duo = dse.load({"dse": 1, "name": "Duo", "processor_types": {"t": {"cores": 2}}, "deadlines": "all",
    ...                 "processors": {"p": {"type": "t"}}, "threads": {"a": thread, "b": thread, "c": thread}})
    >>> numbered_like(duo.space, (0, 0, 0, 1), (0, 1, 1, 1))
    (0, 1, 1, 0)
    """
    cores = {item.index for item in space.open_cores}
    told_apart = not cores.isdisjoint((*space.fixed, *space.baseline)) or tells_cores_apart(space)
    if not cores or len(space.decisions) <= min(cores) or told_apart:
        return design
    result, views = list(design), (View(design), View(other))
    for processor, slot in enumerate(space.processors):
        count = max(1, at(slot.cores, views[0]))
        here = [_cores_on(space, processor, view) for view in views]
        if here[0] is None or here[1] is None:
            continue
        new = _matched(Counter((core, here[1][index]) for index, core in here[0].items() if index in here[1]), count)
        for index, core in here[0].items():
            result[index] = space.decisions[index].values.index(new[core])
    return tuple(result)


def _cores_on(space: Space, processor: int, view: View) -> dict[int, int] | None:
    """The cores that are decided on a processor, by decision; None where a thread there may have some cores only."""
    found = {}
    every = set(range(1, max(1, at(space.processors[processor].cores, view)) + 1))
    decided = {number: item for item in space.open_cores for number in item.threads}
    for number, component in enumerate(space.components):
        if component.processor is None or at(component.processor, view) != processor:
            continue
        core = at(component.core, view)
        if core is None:
            continue
        item = decided.get(number)
        if item is None or not every <= set(item.decision.values):
            return None
        found[item.index] = core
    return found


def _matched(shared: Counter[tuple[int, int]], count: int) -> dict[int, int]:
    """New numbers of the cores from 1 to `count`, by which most threads keep theirs; of several such the nearest.

    An assignment problem: a thread that keeps its number outweighs all cores that keep theirs.
    """
    numbers = range(1, count + 1)
    if all(old == number for old, number in shared):
        return {number: number for number in numbers}
    gains = [[shared[old, number] * (count + 1) + (old == number) for number in numbers] for old in numbers]
    return {old + 1: number + 1 for old, number in enumerate(best_assignment(gains))}
