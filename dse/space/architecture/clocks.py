"""Clocks: which one a thread or device runs on, when on it the first release is, and when its data pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.flows import Step
from dse.space.model.space import ClockReading, Component, Space
from dse.space.model.trees import NOT_OFFERED, Tree, graft, leaves
from dse.space.properties import FieldReader, Ledger, Owner, Path
from dse.spec.schema.model import Spec
from dse.spec.schema.quantity_fields import OFFSET_WORDS
from dse.support.units import format_duration, shown

AT_RELEASE = frozenset({"let", "at_dispatch"})
"""When data are read at the release of a job, and not when it begins."""
MOST_OFFSETS = 2_000
"""The most offsets that a grid may offer one thread."""


def speaks_of_clocks(spec: Spec, components: Sequence[Component]) -> bool:
    """Whether a problem says anything of clocks: else each component is taken to run on its own.

    True where a clock, an offset or a communication is stated.
    """
    said = any(item.offset_ns is not None or item.communication is not None for item in components)
    return said or bool(spec.clocks)


def reads_when_jobs_begin(space: Space) -> bool:
    """Whether some timer on a clock may read when its job begins: how late that is says its response time.

    Judged over all options of `communication`; only the profile *dse* has clocks.
    """
    timed = [item for item in space.components if item.offset_ns is not None and item.processor is not None]
    return space.profile == "dse" and any(set(leaves(item.communication)) - AT_RELEASE for item in timed)


def grid_in_use(spec: Spec) -> int:
    """The grid (ns) on which some offsets are chosen; 0 where none is.

    ``offset_grid`` of the file where some offset is ``any``.
    """
    sections = (spec.devices, spec.threads, spec.device_types, spec.thread_types)
    asked = any("any" in (item.offset or ()) for section in sections for item in section.values())
    return (spec.offset_grid or 0) if asked else 0


def is_always_timed(component: Component) -> bool:
    """Whether a timer releases a component, whatever the design.

    Judged over all leaves of protocol and period.
    """
    return not set(BY_INPUTS) & set(leaves(component.protocol)) and None not in set(leaves(component.period_ns))


def clock_of(ledger: Ledger, spec: Spec, section: str, name: str, processor: Tree) -> Tree:
    """The clock of a device, or of the processors that a thread may run on, which have one of their own by default.

    Leaves are `ClockReading` or None, by which nothing else goes.
    """
    if section == "devices":
        return _reading(ledger, spec, section, name)
    if processor is None:
        return None
    slots = list(spec.processors)
    return graft(processor, lambda index: None if index is None else _reading(ledger, spec, "processors", slots[index]))


def _reading(ledger: Ledger, spec: Spec, section: str, member: str) -> ClockReading | None:
    named = getattr(spec, section)[member].clock
    if named is None:
        return ClockReading("", member, 0) if section == "processors" else None
    if named not in spec.clocks:
        ledger.unknown((section, member, "clock"), "clock", named, spec.clocks)
        return None
    return ClockReading(named, member, spec.clocks[named].synchronisation_error)


def check_clocks(ledger: Ledger, spec: Spec) -> None:
    """Processors name clocks that are there, whether they are used or not.

    Unknown names go to `ledger` with the place of the processor.
    """
    for name, processor in spec.processors.items():
        if processor.clock is not None and processor.clock not in spec.clocks:
            ledger.unknown(("processors", name, "clock"), "clock", processor.clock, spec.clocks)


def read_offset(ledger: Ledger, spec: Spec, owner: Owner, protocol: Tree, period: Tree, clock: Tree) -> Tree:
    """The offsets (ns) of a component's releases on its clock: None where unknown, or where no timer releases it.

    A tree in ns; ``any`` becomes a decision over the multiples of the grid within the period.
    """
    longest = max((leaf for leaf in leaves(period) if leaf is not None), default=0)
    grid: Sequence[Any] = _grid(ledger, spec, owner, longest)

    def read(model: Any) -> Any:
        given = model.offset
        if given is None or not set(given) & set(OFFSET_WORDS):
            return given
        return (None,) if given[0] == "unknown" else tuple(grid)

    is_open = any(model.offset is not None and "any" in model.offset for _, model in _models(owner))
    reader = FieldReader(ledger, owner, "offset", "offset", _text)
    tree = reader.read(read)
    if all(leaf is None for leaf in leaves(tree)):
        return None
    _check_clock(ledger, owner, clock)
    if is_open:
        offsets = tree
        tree = graft(period, lambda time: _within(offsets, time))
    elif None in set(leaves(period)):
        whole = tree
        tree = graft(period, lambda time: None if time is None else whole)
    return ledger.with_use(f"{owner.name}.offset", _where_timed(protocol, tree))


def _text(value: int | None) -> str:
    return "unknown" if value is None else format_duration(value)


def _models(owner: Owner) -> list[tuple[Path, Any]]:
    types = [((*owner.type_path, name), model) for name, model in owner.types]
    return [(owner.path, owner.own), *types] if owner.own is not None else types


def _grid(ledger: Ledger, spec: Spec, owner: Owner, longest: int) -> Sequence[int]:
    """The offsets to choose from: the points of the stated grid below the longest period."""
    for path, model in _models(owner):
        given = model.offset or ()
        if len(given) > 1 and set(given) & set(OFFSET_WORDS):
            place = next(number for number, item in enumerate(given) if item in OFFSET_WORDS)
            ledger.error((*path, "offset", place), f"{given[place]} stands alone: it is no option of a list")
            return (0,)
        if "any" in given and spec.offset_grid is None:
            if ("offset_grid",) not in ledger.loaded.remains.places:  # a wrong one is told at its place
                hint = 'such as "offset_grid: 1 ms" at the top'
                ledger.error((*path, "offset"), "any offset, but no grid is stated", hint)
            return (0,)
        if "any" in given and longest // (spec.offset_grid or 1) > MOST_OFFSETS:
            count = longest // (spec.offset_grid or 1)
            message = f"a grid of {format_duration(spec.offset_grid or 1)} has {count:,} offsets below the period"
            ledger.error((*path, "offset"), message, f"at most {MOST_OFFSETS:,}: state a coarser `offset_grid`")
            return (0,)
    return range(0, max(longest, 1), spec.offset_grid or 1)


def _check_clock(ledger: Ledger, owner: Owner, clock: Tree) -> None:
    """An offset is counted on a clock."""
    if all(leaf is not None for leaf in leaves(clock)) or ledger.is_doubtful(owner.name, f"{owner.name}.processor"):
        return
    section = owner.path[0]
    if section == "devices" and getattr(owner.own, "clock", None) is not None:
        return  # an unknown one
    path = (*owner.path, "offset") if getattr(owner.own, "offset", None) is not None else owner.path
    hint = "name its `clock`" if section == "devices" else "state its `processor`"
    ledger.error(path, f"an offset is counted on a clock, and {shown(owner.name)} has none", hint)


def _within(offset: Tree, period: int | None) -> Tree:
    """Offsets of a whole period and more are those of a later release."""
    if period is None:
        return None
    return graft(offset, lambda value: value if value is None or value < period else NOT_OFFERED)


def _where_timed(protocol: Tree, tree: Tree) -> Tree:
    if not set(BY_INPUTS) & set(leaves(protocol)):
        return tree
    return graft(protocol, lambda found: None if found in BY_INPUTS else tree)


def read_communication(ledger: Ledger, owner: Owner, protocol: Tree, period: Tree) -> Tree:
    """The communication timing of a thread: leaves ``implicit``, ``at_dispatch``, ``let``, or None without a timer.

    A tree; None where nothing is stated anywhere. What None means is in docs/semantics.md.
    """
    tree = FieldReader(ledger, owner, "communication", "communication", str).read(
        lambda model: getattr(model, "communication", None)
    )
    if all(leaf is None for leaf in leaves(tree)):
        return None
    if None in set(leaves(period)):
        whole = tree
        tree = graft(period, lambda time: None if time is None else whole)
    return ledger.with_use(f"{owner.name}.communication", _where_timed(protocol, tree))


def with_past(steps: Sequence[Step]) -> tuple[Step, ...]:
    """The steps of a flow, each component behind the first with all that is before it.

    `Step.since` lets a formula look at the offsets of the timers that the data passed.
    """
    return tuple(
        replace(step, since=tuple(steps[:number])) if step.kind == "component" and number else step
        for number, step in enumerate(steps)
    )
