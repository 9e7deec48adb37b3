"""The assignment problem: who takes what, so that the gains sum to the most."""

from __future__ import annotations

from collections.abc import Sequence


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
    found = [0] * count
    for column, row in enumerate(owner):
        assert row is not None
        found[row] = column
    return found


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
