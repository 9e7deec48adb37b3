"""Properties that nothing here looks at: each is told once, never silence."""

from __future__ import annotations

from collections.abc import Sequence

from dse.importers.aadl.instance.model import InstanceModel
from dse.importers.aadl.instance.properties import OwnedProperty
from dse.importers.aadl.property_set import OURS
from dse.importers.aadl.syntax.predeclared import STANDARD
from dse.importers.aadl.syntax.tree import Listed, Value, Word

FIXED_PRIORITIES = frozenset(
    (
        "rms", "rm", "rma", "dms", "dm", "dma", "hpf", "fixedtimeline", "arinc653", "posix_1003",
        "posix_1003_highest_priority_first_protocol", "rate_monotonic_protocol", "deadline_monotonic_protocol",
        "fixed_priority", "static", "cyclic",
    )
)  # fmt: skip
"""What `Scheduling_Protocol` may say without a word: threads go by priorities, or partitions by their windows."""
SCHEDULING = "scheduling_protocol"
SAID = {SCHEDULING: "other than fixed priorities is not looked at"}
MOST_NAMES = 6


def tell(model: InstanceModel) -> None:
    """A remark for each property that nothing looked up: where it first stands, and at how many places.

    Of sets that are not AADL's own for timing, communication, deployment and resources there is one remark for each
    set, with the names.
    """
    standard: dict[tuple[str, str], list[OwnedProperty]] = {}
    others: dict[str, list[OwnedProperty]] = {}
    read = {(name, group) for _, name, group in model.properties.asked}
    for item in model.properties.stated():
        association = item.owned.association
        if model.properties.is_asked(item) or association.package.lower() == OURS or _is_silent(item):
            continue
        if association.key in STANDARD:
            of = item.holder if item.property in read else ""
            standard.setdefault((association.key, of), []).append(item)
        else:
            others.setdefault(association.package, []).append(item)
    for (key, of), items in standard.items():
        first = items[0].owned.association
        name = f"{first.package}::{first.name}" if first.package else first.name
        name += f" of {'an' if of[0] in 'aeiou' else 'a'} {of}" if of else ""
        _remark(model, f"{name} {SAID.get(key, 'is not looked at')}", items)
    for package, items in others.items():
        names = list(dict.fromkeys(item.owned.association.name for item in items))
        listed = ", ".join(names[:MOST_NAMES]) + (", ..." if len(names) > MOST_NAMES else "")
        of = f"of {package} " if package else ""
        _remark(model, f"properties {of}that bear on no figure here are not looked at: {listed}", items)


def _remark(model: InstanceModel, text: str, items: Sequence[OwnedProperty]) -> None:
    for item in items:
        model.library.remark(text, item.owned.association.place)


def _is_silent(item: OwnedProperty) -> bool:
    """Whether nothing need be said: a scheduler that goes by fixed priorities, and what allows a refinement."""
    association = item.owned.association
    if association.key == "classifier_substitution_rule":
        return True
    return association.key == SCHEDULING and all(_is_fixed(one.value) for one in association.values)


def _is_fixed(value: Value) -> bool:
    items = value.items if isinstance(value, Listed) else (value,)
    return all(isinstance(item, Word) and item.name.lower() in FIXED_PRIORITIES for item in items)
