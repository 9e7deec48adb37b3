"""Circles are found as a graph library finds them."""

from __future__ import annotations

import random

import networkx
import pytest

from dse.support.graphs import shortest_cycle, strong_components


@pytest.mark.parametrize("seed", range(60))
def test_components_are_those_of_networkx_and_come_after_what_they_lead_to(seed: int) -> None:
    rng = random.Random(seed)
    count = rng.randint(1, 9)
    graph = {one: [other for other in range(count) if rng.random() < 0.25] for one in range(count)}
    theirs = networkx.DiGraph([(one, other) for one in graph for other in graph[one]])
    theirs.add_nodes_from(graph)
    ours = strong_components(graph)
    assert sorted(map(sorted, ours)) == sorted(map(sorted, networkx.strongly_connected_components(theirs)))
    place = {node: number for number, members in enumerate(ours) for node in members}
    assert all(place[other] <= place[one] for one in graph for other in graph[one])
    for members in ours:
        if len(members) > 1:
            way = shortest_cycle(graph, members[0])
            assert way[0] == members[0]
            assert len(set(way)) == len(way)
            assert all(other in graph[one] for one, other in zip(way, [*way[1:], way[0]], strict=True))


def test_long_chains_need_no_recursion() -> None:
    count = 20_000
    graph = {number: [number + 1] if number + 1 < count else [0] for number in range(count)}
    assert len(strong_components(graph)) == 1
    assert len(shortest_cycle(graph, 5)) == count
