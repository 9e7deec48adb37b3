"""Cores that nothing tells apart: where any design will do, those that differ in the numbers of such cores are one.

The condition is the second model's own: it looks at its tables. Where no diagram but those of places looks at the core
of a thread, nothing that is asked names cores, and no thread goes where first-fit puts it, cores that the same threads
may have may change numbers on all processors at once. So they are numbered as the first threads on them stand in the
file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from ortools.sat.python import cp_model

from dse.space.cores import decided_cores, tells_cores_apart
from dse.space.trees import leaves
from dse.space.types import Component, OpenCore
from dse.verification.diagrams import Diagram, scope
from dse.verification.tables import Tables


def alike_cores(tables: Tables) -> list[list[int]]:
    """Classes of cores, from 1, that may change numbers; only those of two and more."""
    space, decided = tables.space, decided_cores(tables.space)
    if not decided or tells_cores_apart(space):
        return []
    indices = {item.index for item in decided}
    if any(indices & scope(diagram) for diagram in _of_figures(tables)):
        return []
    moved = {number for item in decided for number in item.threads}
    stated = [item for number, item in enumerate(space.components) if number not in moved and _has_core(tables, item)]
    if any(core is None for item in stated for core in leaves(item.core)):
        return []  # first-fit goes by the numbers of cores
    most = max(count for slot in space.processors for count in leaves(slot.cores))
    classes: dict[tuple[bool, ...], list[int]] = {}
    for core in range(1, most + 1):
        may_have = (core in _values(tables, item) for item in decided)
        mark = (*may_have, *(core in set(leaves(item.core)) for item in stated))
        classes.setdefault(mark, []).append(core)
    return [cores for cores in classes.values() if len(cores) > 1]


def _has_core(tables: Tables, component: Component) -> bool:
    """Whether it may be on a processor with several cores."""
    places = set(leaves(component.processor)) - {None} if component.processor is not None else set()
    return any(max(leaves(tables.space.processors[place].cores), default=1) > 1 for place in places)


def _values(tables: Tables, item: OpenCore) -> list[int]:
    """The cores that a thread may have in a question."""
    return [item.decision.values[option] for option in tables.allowed[item.index]]


def _of_figures(tables: Tables) -> Iterator[Diagram]:
    """Every diagram but those of places."""
    for _, diagram in tables.conditions:
        yield diagram
    yield from (diagram for diagram in tables.met if diagram is not None)
    for total in (*(bound.sum for bound in tables.bounds), *(total for total, _ in tables.objectives)):
        yield from total.diagrams
    for table in tables.cores:
        yield table.count
        yield from (part for thread in table.threads for part in thread.parts)
    if (waits := tables.waits) is not None:
        for found in (waits.works, waits.ranks, waits.separations, waits.priorities, waits.latest):
            yield from found.values()
    for passage in tables.passages:
        yield from passage.diagrams


class Numbering:
    """Clauses that number alike cores: of two that follow each other the second needs an earlier thread on the first.

    In the order of the file, that is; they go into copies of the model whose answers may be any design.
    """

    def __init__(self, tables: Tables, model: cp_model.CpModel, chosen: Sequence[Any]) -> None:
        decided, classes = decided_cores(tables.space), alike_cores(tables)
        self.decisions = {item.index for item in decided}
        self._needs: list[tuple[Any, list[Any]]] = []  # a literal, and those of which it needs one
        on = [self._literals(tables, model, item, chosen[item.index]) for item in decided if classes]
        for former, core in (pair for cores in classes for pair in pairwise(cores)):
            for position, here in enumerate(on):
                if core in here:
                    self._needs.append((here[core], [other[former] for other in on[:position] if former in other]))

    @staticmethod
    def _literals(tables: Tables, model: cp_model.CpModel, item: OpenCore, variable: Any) -> dict[int, Any]:
        """For each core that a thread may have whether it does."""
        found = {}
        for option, core in zip(tables.allowed[item.index], _values(tables, item), strict=True):
            found[core] = model.new_bool_var("")
            model.add(variable == option).only_enforce_if(found[core])
            model.add(variable != option).only_enforce_if(found[core].negated())
        return found

    def add(self, model: cp_model.CpModel) -> None:
        """Number them in a copy of the model."""
        for here, before in self._needs:
            first, *others = (model.get_int_var_from_proto_index(literal.index) for literal in (here, *before))
            model.add_bool_or([first.negated(), *others])
