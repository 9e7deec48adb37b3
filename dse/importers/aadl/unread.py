"""Standard properties that bear on timing or load and that nothing here looks at: each is told once, never silence."""

from __future__ import annotations

from dse.importers.aadl.lookup import Found
from dse.importers.aadl.model import Model
from dse.importers.aadl.syntax import Listed, Value, Word

FIXED_PRIORITIES = frozenset(
    (
        "rms", "rm", "rma", "dms", "dm", "dma", "hpf", "fixedtimeline", "arinc653", "posix_1003",
        "posix_1003_highest_priority_first_protocol", "rate_monotonic_protocol", "deadline_monotonic_protocol",
        "fixed_priority", "static", "cyclic",
    )
)  # fmt: skip
"""What `Scheduling_Protocol` may say without a word: threads go by priorities, or partitions by their windows."""
UNREAD = (
    ("SEI", "RAMActual"), ("SEI", "ROMActual"), ("", "Dispatch_Jitter"), ("", "Clock_Jitter"),
    ("", "First_Dispatch_Time"), ("", "Not_Collocated"), ("", "Collocated"), ("", "Input_Rate"), ("", "Urgency"),
)  # fmt: skip
SCHEDULING = "Scheduling_Protocol"
SAID = {
    SCHEDULING: "other than fixed priorities is not looked at",
}


def tell(model: Model) -> None:
    """A remark for each such property: where it first stands, and at how many places."""
    components = (model.root, *model.root.below())
    for group, name in (*UNREAD, ("", SCHEDULING)):
        places: dict[str, Found] = {}
        for component in components:
            found = model.properties.of(component, name, group)
            if found is not None and not (name == SCHEDULING and _is_fixed(found.value)):
                places.setdefault(str(found.place), found)
        if places:
            _remark(model, f"{group}::{name}" if group else name, list(places.values()))


def _remark(model: Model, name: str, found: list[Found]) -> None:
    first = min((item.place for item in found), key=lambda place: (place.file, place.line, place.column))
    what = SAID.get(name, "is not looked at")
    times = f" (at {len(found)} places, first here)" if len(found) > 1 else ""
    model.library.remark(f"{name} {what}{times}", first)


def _is_fixed(value: Value) -> bool:
    items = value.items if isinstance(value, Listed) else (value,)
    return all(isinstance(item, Word) and item.name.lower() in FIXED_PRIORITIES for item in items)
