"""Which connections may share a frame where the search packs: docs/semantics.md, section 5.7, read from the file."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from . import quantities

Section = dict[str, dict[str, Any]]


def packed(sections: dict[str, Section], bus: str) -> Section:
    """The connections of a bus that may be carried in others' messages, each with these as its options."""
    most = max(_room(sections["bus_types"][kind]) for kind in _options(sections["buses"][bus].get("type")))
    members = {name: body for name, body in sections["connections"].items() if _may_share(body, bus)}
    order = sorted(members, key=lambda name: _urgency(members[name]))  # as in the file where it is equal
    found = {}
    for position, name in enumerate(order):
        body = members[name]
        heads = [other for other in order[:position] if _may_carry(members[other], body, most)]
        if heads and "carried_in" not in body:
            found[name] = {**body, "carried_in": ["alone", *heads]}
    return found


def _room(body: dict[str, Any]) -> int:
    frame = body["frame"]
    return {"can": 8, "can_fd": 64}[frame["protocol"] if isinstance(frame, dict) else frame]


def _may_share(body: dict[str, Any], bus: str) -> bool:
    never = ("reply", "further_buses", "from_port", "data_rate")
    is_plain = "from" in body and "data_size" in body and not any(key in body for key in never)
    return is_plain and _options(body.get("bus")) == [bus] and len(_options(body.get("rate"))) < 2


def _urgency(body: dict[str, Any]) -> tuple[Fraction, bool, int]:
    rate = sum((Fraction(quantities.rate(text)) for text in _options(body.get("rate"))), Fraction(0))
    deadlines = [quantities.deadline(text) for text in _options(body.get("deadline"))]
    return -rate, not deadlines, min(deadlines, default=0)


def _may_carry(head: dict[str, Any], body: dict[str, Any], most: int) -> bool:
    if head["from"] != body["from"] or ("rate" in head) != ("rate" in body):
        return False
    if "alone" not in _options(head.get("carried_in", "alone")):
        return False
    return sum(min(map(quantities.size, _options(one["data_size"]))) for one in (head, body)) <= most


def _options(given: Any) -> list[Any]:
    return list(given) if isinstance(given, list) else [] if given is None else [given]
