"""A layered drawing of a directed graph: cycles broken, layers by longest path, crossings reduced by barycentres.

Sugiyama, Tagawa and Toda (1981), in its simplest form; the same graph always gives the same drawing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from dse.records import dataclass

SWEEPS = 8


@dataclass(frozen=True)
class Layout:
    """`place` has the (column, layer) of each node, a node being 1 wide; `routes` the places that each edge passes.

    A route runs from the edge's source to its target, also where the target lies above.
    """

    place: Mapping[int, tuple[float, int]]
    routes: tuple[tuple[tuple[float, int], ...], ...]
    width: float
    height: int


def layered(count: int, edges: Sequence[tuple[int, int]]) -> Layout:
    """Lay out nodes 0 .. count - 1.

    Examples
    --------
    >>> layered(3, [(0, 1), (0, 2)]).place
    {0: (0.5, 0), 1: (0.0, 1), 2: (1.0, 1)}
    """
    down = _downward(count, edges)
    layer = _layers(count, down)
    rows, chains = _with_bends(count, down, layer)
    neighbours = _neighbours(chains)
    _reduce_crossings(rows, neighbours)
    columns = _columns(rows, neighbours)
    level = {node: number for number, row in enumerate(rows) for node in row}
    place = {node: (columns[node], level[node]) for node in range(count)}
    routes = []
    for (source, target), (upper, _), chain in zip(edges, down, chains, strict=True):
        points = [(columns[node], level[node]) for node in chain]
        routes.append(tuple(points if source in (upper, target) else points[::-1]))
    width = max(columns.values(), default=0.0) + 1
    return Layout(place, tuple(routes), width, len(rows))


def _downward(count: int, edges: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The edges with those turned round that close a cycle, by a depth-first walk in the order of the nodes."""
    following: dict[int, list[int]] = {node: [] for node in range(count)}
    for source, target in edges:
        following[source].append(target)
    state = [0] * count
    turned: set[tuple[int, int]] = set()
    for root in range(count):
        if state[root]:
            continue
        state[root] = 1
        stack: list[tuple[int, Iterator[int]]] = [(root, iter(following[root]))]
        while stack:
            node, rest = stack[-1]
            target = next(rest, -1)
            if target < 0:
                state[node] = 2
                stack.pop()
            elif state[target] == 1:
                turned.add((node, target))
            elif not state[target]:
                state[target] = 1
                stack.append((target, iter(following[target])))
    return [(target, source) if (source, target) in turned else (source, target) for source, target in edges]


def _layers(count: int, edges: Sequence[tuple[int, int]]) -> list[int]:
    """The longest way from a source to each node; sources stand right above what they feed."""
    layer = [0] * count
    for _ in range(count):
        moved = False
        for source, target in edges:
            if source != target and layer[target] <= layer[source]:
                layer[target] = layer[source] + 1
                moved = True
        if not moved:
            break
    entered = {target for source, target in edges if source != target}
    for node in range(count):
        below = [layer[target] for source, target in edges if source == node and target != node]
        if node not in entered and below:
            layer[node] = min(below) - 1
    return layer


def _with_bends(
    count: int, edges: Sequence[tuple[int, int]], layer: Sequence[int]
) -> tuple[list[list[int]], list[list[int]]]:
    """The nodes of each layer, with a bend for every layer that an edge passes; and the chain of nodes of each edge."""
    rows: list[list[int]] = [[] for _ in range(max(layer, default=-1) + 1)]
    for node in range(count):
        rows[layer[node]].append(node)
    chains = []
    fresh = count
    for source, target in edges:
        chain = [source]
        for between in range(layer[source] + 1, layer[target]):
            rows[between].append(fresh)
            chain.append(fresh)
            fresh += 1
        chains.append([*chain, target])
    return rows, chains


def _neighbours(chains: Sequence[Sequence[int]]) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {}
    for chain in chains:
        for one, other in pairwise(chain):
            if one != other:
                found.setdefault(one, []).append(other)
                found.setdefault(other, []).append(one)
    return found


def _reduce_crossings(rows: list[list[int]], neighbours: Mapping[int, list[int]]) -> None:
    """Order each layer by the mean position of its neighbours in the layer before, downwards and upwards in turn."""
    for sweep in range(SWEEPS):
        order = range(1, len(rows)) if sweep % 2 == 0 else range(len(rows) - 2, -1, -1)
        for number in order:
            fixed = {node: at for at, node in enumerate(rows[number - 1 if sweep % 2 == 0 else number + 1])}
            keys = {}
            for at, node in enumerate(rows[number]):
                near = [fixed[other] for other in neighbours.get(node, []) if other in fixed]
                keys[node] = sum(near) / len(near) if near else float(at)
            rows[number].sort(key=lambda node: keys[node])


def _columns(rows: Sequence[Sequence[int]], neighbours: Mapping[int, list[int]]) -> dict[int, float]:
    """Columns at least 1 apart within a layer, drawn towards the neighbours; the leftmost is 0."""
    widest = max((len(row) for row in rows), default=0)
    columns = {node: at + (widest - len(row)) / 2 for row in rows for at, node in enumerate(row)}
    for _ in range(SWEEPS):
        for row in rows:
            wanted = {
                node: sum(near) / len(near)
                if (near := [columns[other] for other in neighbours.get(node, [])])
                else columns[node]
                for node in row
            }
            low: list[float] = []
            for node in row:
                low.append(max(wanted[node], low[-1] + 1) if low else wanted[node])
            shift = sum(wanted[node] - at for node, at in zip(row, low, strict=True)) / (len(row) or 1)
            columns.update({node: at + shift for node, at in zip(row, low, strict=True)})
    left = min(columns.values(), default=0.0)
    return {node: round(column - left, 3) for node, column in columns.items()}
