"""Executors: OS threads that run the jobs of several threads of the architecture, one at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dse.space.cores import check_core, cores_named
from dse.space.properties import FieldReader, Ledger, Owner
from dse.space.segments import accelerator
from dse.space.slots import read_named
from dse.space.trees import Tree, graft, leaves
from dse.space.types import Component, Executor, Processor
from dse.spec.model import Spec
from dse.units import shown


@dataclass(frozen=True)
class Home:
    """Where the threads of an executor run: a tree of processors, and the stated core."""

    index: int
    processor: Tree
    core: int | None


def executor_homes(ledger: Ledger, spec: Spec, processors: Sequence[Processor]) -> dict[str, Home]:
    """The home of each executor: a decision about it is one for all of its threads."""
    slots = {slot.name: number for number, slot in enumerate(processors)}
    homes = {}
    for index, (name, given) in enumerate(spec.executors.items()):
        processor = read_named(ledger, name, "processor", ("executors", name, "processor"), given.processor, slots)
        path = ("executors", name, "core")
        named = cores_named(ledger, processors, path, processor, given.core or ())
        core = named[0] if len(named) == 1 and isinstance(named[0], int) else None
        check_core(ledger, processors, path, processor, named)
        for leaf in leaves(processor):
            if leaf is not None and processors[leaf].serves is not None:
                message = f"{shown(processors[leaf].name)} serves one job at a time by itself: no executor runs there"
                ledger.error(("executors", name, "processor"), message)
                break
        homes[name] = Home(index, processor, core)
    return homes


def served_by(ledger: Ledger, spec: Spec, processors: Sequence[Processor], name: str, processor: Tree) -> int | None:
    """The executor that serves the jobs of a thread on an accelerator; None where it runs on none."""
    slots = dict.fromkeys(leaf for leaf in leaves(processor) if leaf is not None)
    served = [slot for slot in slots if processors[slot].serves is not None]
    if not served:
        return None
    if len(slots) > 1:
        one = shown(processors[served[0]].name)
        message = f"{one} serves one job at a time: whether a thread runs there is no decision"
        ledger.error(("threads", name, "processor"), message, "name one processor")
    return accelerator(processors, spec, served[0])


def home_of(ledger: Ledger, homes: Mapping[str, Home], name: str, given: Any) -> Home | None:
    """The home of a thread in an executor; None for one in none, or in one that there is not."""
    if given.executor is None:
        return None
    if given.executor not in homes:
        ledger.unknown(("threads", name, "executor"), "executor", given.executor, homes)
        ledger.doubt(f"{name}.processor")
        return None
    for field_name in ("processor", "figures_of", "core"):
        if getattr(given, field_name) is not None:
            ledger.error(("threads", name, field_name), "the executor says where its threads run: state it there")
    return homes[given.executor]


def build_executors(
    ledger: Ledger,
    spec: Spec,
    processors: Sequence[Processor],
    homes: Mapping[str, Home],
    components: Sequence[Component],
) -> tuple[Executor, ...]:
    """Every executor with its threads; behind them the accelerators, which serve jobs as executors do."""
    named = {item.executor for item in spec.threads.values()} - {None}
    is_whole = named <= set(homes) and ledger.loaded.remains.is_whole
    found = []
    for name, home in homes.items():
        given, path = spec.executors[name], ("executors", name)
        owner = Owner(name, path, given)
        kind = FieldReader(ledger, owner, "kind", "rule", str).read(lambda model: model.kind)
        priority = FieldReader(ledger, owner, "priority", "count", str).read(lambda model: model.priority)
        members = tuple(number for number, item in enumerate(components) if item.executor == home.index)
        if not members and is_whole:
            ledger.error(path, "no thread runs in this executor")
        for number in members:
            thread = spec.threads[components[number].name]
            if thread.priority is not None and "callback_group" not in given.kind:
                message = f"a {given.kind[0]} executor knows no priorities among its threads"
                ledger.error(("threads", components[number].name, "priority"), message, "state that of the executor")
        found.append(Executor(name, kind, members, priority))
    for number, slot in enumerate(processors):
        index = accelerator(processors, spec, number)
        if index is not None:
            members = tuple(at for at, item in enumerate(components) if item.executor == index)
            kind = graft(slot.serves, lambda order: "fifo" if order == "fifo" else "callback_group")
            found.append(Executor(slot.name, kind, members))
    return tuple(found)
