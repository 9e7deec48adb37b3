"""Budgets of threads and devices as properties of AADL's set SEI, where OSATE sees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dse.answers.exports.aadl.names import instructions, real_size, speed
from dse.answers.exports.aadl.package import ComponentDraft

WORDS = (
    ("speed", "MIPSBudget", speed),
    ("instructions", "InstructionsPerDispatch", instructions),
    ("ram", "RAMBudget", real_size),
    ("rom", "ROMBudget", real_size),
)


def state_budgets(entries: Mapping[str, Any], parts: Mapping[str, ComponentDraft]) -> dict[str, dict[str, Any]]:
    """Give the parts their budgets as properties; returns what AADL has no word for of the entries.

    The property of each part is appended to its draft in place (``SEI::MIPSBudget`` and so on). Budgets of other
    components, of 0, or in units that SEI does not have are returned, to be kept as text.
    """
    budgets = {}
    for name, entry in entries.items():
        rest = budgets[name] = dict(entry)
        part = parts.get(name)
        is_thread = part is not None and part.category == "thread"
        if part is None or not (is_thread or (part.category == "device" and part.features)):
            continue  # SEI has none for abstract ones; a device without features is taken for hardware
        for key, word, reader in WORDS:
            value = reader(rest[key]) if key in rest else None
            if value is not None and not value.startswith("0.0 "):  # 0 counts as none there
                part.properties.append(f"SEI::{word} => {value};")
                del rest[key]
    return budgets
