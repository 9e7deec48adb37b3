"""Components without a period that would dispatch each other in a cycle: what nothing starts sends nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

NO_DATA = "0 B/s"


def broken_cycles(document: Mapping[str, Any]) -> Iterator[str]:
    """The connections that close cycles of event-triggered components, by name.

    For OSATE a component without a Period sends nothing; we let it send at the rate of what triggers it, which a cycle
    has not: so these are to state a rate of 0.
    """
    components = {**document.get("devices", {}), **document.get("threads", {})}
    eager = {
        name
        for name, item in components.items()
        if item.get("dispatch_protocol") in ("aperiodic", "sporadic")
        or ("dispatch_protocol" not in item and "period" not in item)
    }
    following: dict[str, list[tuple[str, str]]] = {name: [] for name in eager}
    for name, item in document.get("connections", {}).items():
        one, other = item.get("from"), item.get("to")
        is_trigger = item.get("port") != "data" and "rate" not in item and "data_rate" not in item
        is_trigger = is_trigger and name in components.get(other, {}).get("dispatch_trigger", [name])
        if one in eager and other in eager and is_trigger:
            following[one].append((name, other))
    done: set[str] = set()
    for start in (name for name in components if name in eager):
        yield from _closing(start, following, done)


def _closing(start: str, following: Mapping[str, list[tuple[str, str]]], done: set[str]) -> Iterator[str]:
    """The connections that lead back to where a walk came through; without recursion, for long chains."""
    if start in done:
        return
    path = {start}
    stack = [(start, iter(following[start]))]
    while stack:
        here, rest = stack[-1]
        for name, other in rest:
            if other in path:
                yield name
            elif other not in done:
                path.add(other)
                stack.append((other, iter(following[other])))
                break
        else:
            stack.pop()
            path.discard(here)
            done.add(here)
