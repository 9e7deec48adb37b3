"""Threads that need a message of each of their triggers for a job (a join of all, docs/semantics.md, section 3.8)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dse.space.model.arrivals import BY_INPUTS
from dse.space.model.flows import Step
from dse.space.model.space import Component, Space
from dse.space.model.trees import Tree, graft, leaves
from dse.space.properties import FieldReader, Ledger, Owner
from dse.spec.schema.model import Spec
from dse.support.units import shown

ALL = "all"
"""A job needs a message of each trigger; else any of them dispatches it."""
LATEST = "latest"
"""The newest message of each trigger is taken; else one of each, in the order of arrival."""
BY_MESSAGES = frozenset({*BY_INPUTS, "hybrid"})


def may_join(component: Component) -> bool:
    """Whether a component needs all its triggers for a job, in some design.

    Judged over all options of `join`.
    """
    return ALL in set(leaves(component.join))


def read_join(ledger: Ledger, spec: Spec, owner: Owner, protocol: Tree, period: Tree) -> tuple[Tree, Tree]:
    """Which triggers a job of a thread needs, and which messages it takes of a join of all.

    Leaves are the words of the file; None where nothing is stated, where a timer alone releases jobs, and of a pairing
    where nothing is joined.
    """
    join, pairing = _stated(ledger, owner, "join"), _stated(ledger, owner, "pairing")
    path = owner.path
    if join is None:
        if pairing is not None:
            message = "says which messages a join of all takes together, but nothing is joined"
            ledger.error((*path, "pairing"), message, "join: all")
        return None, None
    whole = join
    join = graft(protocol, lambda word: _by_messages(word, period, whole))
    if ALL in set(leaves(whole)) and ALL not in set(leaves(join)):
        message = f"{shown(owner.name)} is periodic: its timer dispatches it, whatever comes"
        ledger.error((*path, "join"), message, "an aperiodic, sporadic or hybrid thread waits for all of its inputs")
    if ALL in set(leaves(whole)) and spec.profile != "dse":
        ledger.error((*path, "join"), f"profile {spec.profile} knows no join of all", "profile: dse")
    ledger.with_use(f"{owner.name}.join", join)
    if pairing is None:
        return join, None
    taken = graft(join, lambda word: pairing if word == ALL else None)
    ledger.with_use(f"{owner.name}.pairing", taken)
    return join, taken


def _stated(ledger: Ledger, owner: Owner, field: str) -> Tree:
    """The words that a thread states in a field; None without any."""
    own = Owner(owner.name, owner.path, owner.own)  # types of threads say nothing of what dispatches them
    return FieldReader(ledger, own, field, field, str).read(lambda model: getattr(model, field))


def _by_messages(protocol: str | None, period: Tree, join: Tree) -> Tree:
    """The join where messages dispatch a thread or run its callback."""
    if protocol is not None:
        return join if protocol in BY_MESSAGES else None
    return graft(period, lambda time: join if time is None else None)


def check_joins(ledger: Ledger, space: Space) -> None:
    """A join of all has several triggers to wait for, and waits for messages that come.

    A join with fewer than two triggers goes to `ledger` as a mistake.
    """
    for component in space.components:
        if not may_join(component) or len(component.triggers) > 1:
            continue
        name = component.stated_as
        if ledger.is_doubtful(name, f"{name}.dispatch_trigger") or not ledger.loaded.remains.is_whole:
            continue
        wires = [space.connections[wire].name for wire in component.triggers]
        found = f"{wires[0]} alone dispatches {shown(name)}" if wires else f"nothing dispatches {shown(name)}"
        hint = "several connections lead to it that are not to `data` ports" if not wires else "leave `join` out"
        ledger.error(("threads", name, "join"), f"a join of all needs several triggers: {found}", hint)


def with_way(components: Sequence[Component], steps: Sequence[Step]) -> tuple[Step, ...]:
    """The steps of a flow, each at a component that may join all its triggers with all that is before it.

    `Step.before` lets a formula find the other flows that lead to the join.
    """
    return tuple(
        replace(step, before=tuple(steps[:number]))
        if step.kind == "component" and step.via is not None and may_join(components[step.index])
        else step
        for number, step in enumerate(steps)
    )
