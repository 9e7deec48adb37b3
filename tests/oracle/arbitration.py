"""For which buses messages wait: docs/semantics.md, section 5.4, read from the file."""

from __future__ import annotations

from typing import Any


def counted(problem: Any) -> list[str]:
    """The bus slots for which messages wait, in any design."""
    if problem.document.get("bus_queuing") == "not_counted":
        return []
    return [slot for slot in problem.sections["buses"] if _is_counted(problem, slot)]


def _is_counted(problem: Any, slot: str) -> bool:
    kinds = [kind for kind in problem.types(slot) if kind != "none"]
    bodies = [problem.sections["bus_types"][kind] for kind in kinds]
    if not bodies or any(body.get("virtual") == "true" for body in bodies):
        return False
    ways = [arbitration(body) for body in bodies]
    here = [name for name in problem.sections["connections"] if slot in may_be_on(problem, name)]
    if not here or None in ways:
        return False
    stated = [problem.component(name) for name in here]
    wanted = {"priority": "identifier", "classes": "priority"}
    named = all(
        key in body or "alone" not in _ways(body) for way, key in wanted.items() if way in ways for body in stated
    )
    return named and all("data_size" in body and not body.get("further_buses") for body in stated)


def arbitration(body: Any) -> str | None:
    """How a type of bus takes turns: as it says, else by identifier where its frames are those of CAN.

    By classes where it says priority of Ethernet.
    """
    frame = body.get("frame")
    protocol = frame.get("protocol") if isinstance(frame, dict) else frame
    if "arbitration" in body:
        return "classes" if (body["arbitration"], protocol) == ("priority", "ethernet") else str(body["arbitration"])
    return "priority" if protocol in ("can", "can_fd") else None


def may_be_on(problem: Any, connection: str) -> set[str]:
    """The buses that may carry a connection; none where its ends have one processor in every design."""
    found: set[str] = set()
    body = problem.component(connection)
    homes = [_listed(problem.sections["threads"].get(body.get(end), {}).get("processor")) for end in ("from", "to")]
    if homes[0] == homes[1] and len(homes[0]) == 1 and problem.need_not_travel(body):
        return found
    todo = _listed(problem.component(connection).get("bus"))
    while todo:
        slot = todo.pop()
        if slot not in found:
            found.add(slot)
            todo += _listed(problem.component(slot).get("bus")) if slot in problem.sections["buses"] else []
    return found


def _ways(body: Any) -> list[Any]:
    """Whose messages may carry a connection, its own (``alone``) among them."""
    return _listed(body.get("carried_in")) or ["alone"]


def _listed(given: Any) -> list[Any]:
    """What a file gives for a field: several options, one, or none."""
    return list(given) if isinstance(given, list) else [] if given is None else [given]
