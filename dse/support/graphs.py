"""Circles in a directed graph, given as each node's successors; small enough not to import a graph library for."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from typing import TypeVar

N = TypeVar("N")


def strong_components(successors: Mapping[N, Iterable[N]]) -> list[list[N]]:
    """The strongly connected components, each after those that it leads to.

    R. Tarjan, "Depth-first search and linear graph algorithms", SIAM Journal on Computing 1 (1972), without recursion.

    >>> strong_components({"a": "b", "b": "ac", "c": ""})
    [['c'], ['b', 'a']]
    """
    number: dict[N, int] = {}
    low: dict[N, int] = {}
    open_nodes: list[N] = []
    is_open: set[N] = set()
    components: list[list[N]] = []
    for root in successors:
        if root in number:
            continue
        path = [(root, iter(successors[root]))]
        number[root] = low[root] = len(number)
        open_nodes.append(root)
        is_open.add(root)
        while path:
            node, rest = path[-1]
            for following in rest:
                if following not in number:
                    number[following] = low[following] = len(number)
                    open_nodes.append(following)
                    is_open.add(following)
                    path.append((following, iter(successors[following])))
                    break
                if following in is_open:
                    low[node] = min(low[node], number[following])
            else:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == number[node]:
                    place = open_nodes.index(node)
                    components.append(open_nodes[place:][::-1])
                    is_open.difference_update(open_nodes[place:])
                    del open_nodes[place:]
    return components


def shortest_cycle(successors: Mapping[N, Iterable[N]], start: N) -> list[N]:
    """The nodes of a shortest way from `start` back to itself, `start` first; there must be one.

    >>> shortest_cycle({"a": "b", "b": "ca", "c": "a"}, "a")
    ['a', 'b']
    """
    before: dict[N, N] = {}
    waiting = deque([start])
    while True:
        node = waiting.popleft()
        for following in successors[node]:
            if following == start:
                way = [node]
                while way[-1] != start:
                    way.append(before[way[-1]])
                return way[::-1]
            if following not in before:
                before[following] = node
                waiting.append(following)
