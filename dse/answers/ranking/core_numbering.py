"""Designs that differ in the numbers of cores alone are the same: equal cores of a processor may change places."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from dse.analysis.views import View
from dse.space.core_symmetry import interchangeable_cores
from dse.space.model.space import Design, Space
from dse.space.model.trees import at


def numbered_like(space: Space, design: Design, other: Design) -> Design:
    """The design with the cores of each processor numbered such that as many threads as can have the one in `other`.

    Where something tells cores apart (`dse.space.core_symmetry`), the baseline names some, or threads choose their
    executors, the numbers stay.

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
    if not cores or space.has_open_groups or len(space.decisions) <= min(cores) or not cores.isdisjoint(space.baseline):
        return design
    result, views = list(design), (View(design), View(other))
    for processor, slot in enumerate(space.processors):
        count = max(1, at(slot.cores, views[0]))
        here = [_cores_on(space, processor, view) for view in views]
        shared = Counter((core, here[1][index]) for index, core in here[0].items() if index in here[1])
        new: dict[int, int] = {}
        for cores_alike in interchangeable_cores(space, processor, _threads_on(space, processor, views[0])):
            new |= _matched(shared, [core for core in cores_alike if core <= count])
        for index, core in here[0].items():
            result[index] = space.decisions[index].values.index(new[core])
    return tuple(result)


def _threads_on(space: Space, processor: int, view: View) -> list[int]:
    """The components that run on a processor."""
    items = enumerate(space.components)
    return [number for number, item in items if item.processor is not None and at(item.processor, view) == processor]


def _cores_on(space: Space, processor: int, view: View) -> dict[int, int]:
    """The cores that are decided on a processor, by decision."""
    decided = {number: item.index for item in space.open_cores for number in item.threads}
    cores = {number: at(space.components[number].core, view) for number in _threads_on(space, processor, view)}
    return {decided[number]: core for number, core in cores.items() if number in decided and core is not None}


def _matched(shared: Counter[tuple[int, int]], cores: Sequence[int]) -> dict[int, int]:
    """New numbers of interchangeable cores, by which most threads keep theirs; of several such the nearest.

    An assignment problem: a thread that keeps its number outweighs all cores that keep theirs.
    """
    here = {pair: threads for pair, threads in shared.items() if set(pair) <= set(cores)}
    if all(old == number for old, number in here):
        return {number: number for number in cores}
    gains = [[here.get((old, number), 0) * (len(cores) + 1) + (old == number) for number in cores] for old in cores]
    return {cores[old]: cores[number] for old, number in enumerate(best_assignment(gains))}


# The assignment problem: who takes what, so that the gains sum to the most.


def best_assignment(gains: Sequence[Sequence[int]]) -> list[int]:
    """For each row of a square matrix its column, such that the sum of the gains is the greatest; exact.

    Shortest augmenting paths (R. Jonker and A. Volgenant, "A shortest augmenting path algorithm for dense and sparse
    linear assignment problems", Computing 38, 1987): rows are assigned one after the other, in n steps of n² each.

    Examples
    --------
    >>> best_assignment([[5, 4], [4, 1]])  # 4 + 4 is more than 5 + 1
    [1, 0]
    """
    count = len(gains)
    row_price, column_price = [0] * count, [0] * count
    owner: list[int | None] = [None] * count
    for start in range(count):
        path, last = _cheapest_path(gains, start, owner, row_price, column_price)
        while path[last] >= 0:  # each row on the path takes the next column, from the free one back
            owner[last] = owner[path[last]]
            last = path[last]
        owner[last] = start
    assignment = [0] * count
    for column, row in enumerate(owner):
        assert row is not None
        assignment[row] = column
    return assignment


def _cheapest_path(
    gains: Sequence[Sequence[int]],
    start: int,
    owner: Sequence[int | None],
    row_price: list[int],
    column_price: list[int],
) -> tuple[dict[int, int], int]:
    """Dijkstra from a row to a free column: for each column reached the one before (-1: the row itself), and the end.

    Prices are moved so that no reduced cost becomes negative, and those on the path are 0.
    """
    distance: dict[int, int] = {}
    before: dict[int, int] = {}
    done: list[int] = []
    row, offset, via = start, 0, -1
    while True:
        for column in range(len(gains)):
            if column not in done:
                reached = offset - gains[row][column] - row_price[row] - column_price[column]
                if column not in distance or reached < distance[column]:
                    distance[column], before[column] = reached, via
        via = min((column for column in distance if column not in done), key=distance.__getitem__)
        offset = distance[via]
        taken_by = owner[via]
        if taken_by is None:
            break
        done.append(via)
        row = taken_by
    row_price[start] += offset
    for column in done:
        gap = offset - distance[column]
        column_price[column] -= gap
        taken_by = owner[column]
        assert taken_by is not None
        row_price[taken_by] += gap
    return before, via
