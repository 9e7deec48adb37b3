"""A layered drawing of a directed graph: cycles broken, layers by longest path, crossings reduced by barycentres.

Sugiyama, Tagawa and Toda (1981), in its simplest form; the same graph always gives the same drawing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

SWEEPS = 8
PLACINGS = 60
"""How often the nodes of a layer are placed again, in drawings of few nodes."""
MOST_PLACED = 20_000
"""How many nodes are placed altogether; large drawings are placed `SWEEPS` times at least."""
HEAVY = 100
"""The pull of an edge that should be straight; that of another one is 1."""
BEND = 0.15
"""The width of a door, and of the place at which an edge passes a layer; that of a node is 1."""


@dataclass(frozen=True)
class Graph:
    """Nodes, by number, with their layers, and edges from source to target; `heavy` edges should be straight.

    Layers count from 0 to `height` - 1; layers -1 and `height` are those of doors, which are as narrow as bends.
    """

    layers: Sequence[int]
    edges: Sequence[tuple[int, int]]
    height: int
    heavy: Collection[int] = ()


@dataclass(frozen=True)
class Layers:
    """`centres` has the place of each node across, a node being 1 wide; `routes` what each edge passes.

    A route has pairs of a place and a layer, from the edge's source to its target. `width` is that of all layers.
    """

    centres: tuple[float, ...]
    routes: tuple[tuple[tuple[float, int], ...], ...]
    width: float


def layered(graph: Graph) -> Layers:
    """Order the nodes of each layer and place them.

    Examples
    --------
    >>> layered(Graph([0, 1, 1], [(0, 1), (0, 2)], 2)).centres
    (1.0, 0.5, 1.5)
    """
    count = len(graph.layers)
    layers = [layer + 1 for layer in graph.layers]
    down = [(one, other) if layers[one] <= layers[other] else (other, one) for one, other in graph.edges]
    rows, chains = _with_bends(count, down, layers)
    neighbours = _neighbours(chains, graph.heavy)
    _reduce_crossings(rows, neighbours)
    narrow = {node for node, layer in enumerate(graph.layers) if layer in (-1, graph.height)}
    spans = {node: BEND if node >= count or node in narrow else 1.0 for row in rows for node in row}
    columns = _columns(rows, neighbours, spans)
    level = {node: number - 1 for number, row in enumerate(rows) for node in row}
    routes = []
    for (source, _), (upper, _), chain in zip(graph.edges, down, chains, strict=True):
        points = [(columns[node], level[node]) for node in chain]
        routes.append(tuple(points if source == upper else points[::-1]))
    width = max((columns[node] + span / 2 for node, span in spans.items()), default=0.0)
    return Layers(tuple(columns[node] for node in range(count)), tuple(routes), round(width, 3))


def ranks(count: int, edges: Sequence[tuple[int, int]]) -> list[int]:
    """A layer for each node, from 0: the longest way from a source; sources stand right above what they feed.

    >>> ranks(4, [(0, 1), (1, 2), (2, 0), (3, 2)])
    [0, 1, 2, 1]
    """
    down = [(source, target) for source, target in _downward(count, edges) if source != target]
    layer = [0] * count
    for _ in range(count):
        moved = False
        for source, target in down:
            if layer[target] <= layer[source]:
                layer[target] = layer[source] + 1
                moved = True
        if not moved:
            break
    entered = {target for _, target in down}
    for node in range(count):
        below = [layer[target] for source, target in down if source == node]
        if node not in entered and below:
            layer[node] = min(below) - 1
    return layer


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


def _neighbours(chains: Sequence[Sequence[int]], heavy: Collection[int]) -> dict[int, list[tuple[int, int]]]:
    """The neighbours of each node, with the weight of each link."""
    neighbours: dict[int, list[tuple[int, int]]] = {}
    for number, chain in enumerate(chains):
        pull = HEAVY if number in heavy else 1
        for one, other in pairwise(chain):
            if one != other:
                neighbours.setdefault(one, []).append((other, pull))
                neighbours.setdefault(other, []).append((one, pull))
    return neighbours


def _mean(places: Sequence[tuple[float, int]]) -> float:
    return sum(place * pull for place, pull in places) / sum(pull for _, pull in places)


def _reduce_crossings(rows: list[list[int]], neighbours: Mapping[int, Sequence[tuple[int, int]]]) -> None:
    """Order each layer by the mean position of its neighbours in the layer before, downwards and upwards in turn."""
    for sweep in range(SWEEPS):
        order = range(1, len(rows)) if sweep % 2 == 0 else range(len(rows) - 2, -1, -1)
        for number in order:
            fixed = {node: place for place, node in enumerate(rows[number - 1 if sweep % 2 == 0 else number + 1])}
            keys = {}
            for place, node in enumerate(rows[number]):
                near = [(float(fixed[other]), pull) for other, pull in neighbours.get(node, []) if other in fixed]
                keys[node] = _mean(near) if near else float(place)
            rows[number].sort(key=lambda node: keys[node])


def _columns(
    rows: Sequence[Sequence[int]], neighbours: Mapping[int, Sequence[tuple[int, int]]], spans: Mapping[int, float]
) -> dict[int, float]:
    """Centres that keep the nodes of a layer apart, drawn towards the neighbours; the leftmost edge is 0."""
    columns: dict[int, float] = {}
    for row in rows:
        right = 0.0
        for node in row:
            columns[node] = right + spans[node] / 2
            right += spans[node]
    for sweep in range(min(PLACINGS, max(SWEEPS, MOST_PLACED // max(1, len(spans))))):
        for row in rows if sweep % 2 == 0 else rows[::-1]:
            near = {node: [(columns[other], pull) for other, pull in neighbours.get(node, [])] for node in row}
            wanted = {node: _mean(places) if places else columns[node] for node, places in near.items()}
            pulls = {node: sum(pull for _, pull in places) or 1 for node, places in near.items()}
            columns.update(apart(row, wanted, spans, pulls))
    left = min((columns[node] - span / 2 for node, span in spans.items()), default=0.0)
    return {node: round(column - left, 3) for node, column in columns.items()}


def apart(
    row: Sequence[int], wanted: Mapping[int, float], spans: Mapping[int, float], pulls: Mapping[int, int] | None = None
) -> dict[int, float]:
    """Centres in the order of the row, as near to the wanted ones as can be; items that push each other move as one.

    Least squares, weighted by the pulls, by pooling adjacent violators.

    >>> apart([0, 1], {0: 1.0, 1: 1.0}, {0: 2.0, 1: 2.0})
    {0: 0.0, 1: 2.0}
    """
    blocks: list[tuple[float, int, list[int]]] = []  # wanted left edge of the block, its pull, its nodes
    for node in row:
        blocks.append((wanted[node] - spans[node] / 2, pulls[node] if pulls else 1, [node]))
        while len(blocks) > 1:
            (left, pull, nodes), (next_left, next_pull, next_nodes) = blocks[-2:]
            length = sum(spans[item] for item in nodes)
            if next_left >= left + length:
                break
            mean = (left * pull + (next_left - length) * next_pull) / (pull + next_pull)
            blocks[-2:] = [(mean, pull + next_pull, nodes + next_nodes)]
    placed = {}
    for left, _, nodes in blocks:
        edge = left
        for node in nodes:
            placed[node] = edge + spans[node] / 2
            edge += spans[node]
    return placed
