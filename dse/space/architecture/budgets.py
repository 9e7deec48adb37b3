"""OSATE's resource budgets as stated: of threads, devices and subsystems, and what processors and memories have."""

from __future__ import annotations

from collections.abc import Sequence

from dse.space.model.budgets import Budgeted, MemorySizes, Resources
from dse.space.properties import Ledger
from dse.spec.schema.model import ResourceBudget, Spec

OF_THREADS = ("processor", "partition")
"""Fields that a thread or device states at its own entry."""


def build_resources(ledger: Ledger, spec: Spec, names: Sequence[str], processors: Sequence[str]) -> Resources:
    """The budgets of a problem; `names` are those of its components, in their order, `processors` of its slots.

    A `Resources` with speeds in MIPS and sizes in bytes; unknown names go to `ledger`.
    """
    stated = list(spec.budgets)
    entries = tuple(
        Budgeted(
            name=name,
            component=names.index(name) if name in names else None,
            within=_index(ledger, name, "within", "entry of budgets", given.within, stated),
            processor=_index(ledger, name, "processor", "processor", given.processor, processors),
            partition=given.partition,
            memory=given.memory,
            speed=given.speed,
            instructions=given.instructions,
            ram=given.ram,
            rom=given.rom,
            ram_used=given.ram_used or 0,
            rom_used=given.rom_used or 0,
        )
        for name, given in spec.budgets.items()
    )
    for name, given in spec.budgets.items():
        _check(ledger, spec, name, given)
    _check_cycles(ledger, entries)
    return Resources(
        entries,
        {name: MemorySizes(item.size, item.ram, item.rom) for name, item in spec.memories.items()},
        {name: item.speed for name, item in spec.processor_types.items() if item.speed is not None},
        {name: item.speed for name, item in spec.partitions.items() if item.speed is not None},
    )


def _index(ledger: Ledger, name: str, key: str, what: str, named: str | None, known: Sequence[str]) -> int | None:
    if named is None or named in known:
        return None if named is None else known.index(named)
    ledger.unknown(("budgets", name, key), what, named, known)
    return None


def _check(ledger: Ledger, spec: Spec, name: str, given: ResourceBudget) -> None:
    """What an entry names is there, and a thread states elsewhere what it is bound to."""
    for key, what, known in (("partition", "partition", spec.partitions), ("memory", "memory", spec.memories)):
        named = getattr(given, key)
        if named is not None and named not in known:
            ledger.unknown(("budgets", name, key), what, named, known)
    section = next((item for item in ("threads", "devices") if name in getattr(spec, item)), None)
    if section is not None:
        for key in OF_THREADS:
            if getattr(given, key) is not None:
                message = f"what {name} is bound to is stated in {section}: leave it out here"
                ledger.error(("budgets", name, key), message)
    if given.instructions is not None and section != "threads":
        ledger.error(("budgets", name, "instructions"), "only a thread has instructions of a dispatch")


def _check_cycles(ledger: Ledger, entries: Sequence[Budgeted]) -> None:
    for number, entry in enumerate(entries):
        at, seen = entry.within, {number}
        while at is not None and at not in seen:
            seen.add(at)
            at = entries[at].within
        if at == number:
            ledger.error(("budgets", entry.name, "within"), f"{entry.name} is within itself")
