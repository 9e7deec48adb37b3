"""Cores that nothing tells apart: where any design will do, those that differ in the numbers of such cores are one.

The condition is the second model's own: it looks at its tables. Where no diagram but those of places looks at the core
of a thread, nothing that is asked names cores, and no thread goes where first-fit puts it, cores that the same threads
may have may change numbers on all processors at once. So they are numbered as the first threads on them stand in the
file. Where the model has places of threads they are numbered processor by processor: that a core is one of those that
a processor has may be demanded then, for in that order cores have the least numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.validity import has_core_text
from dse.space.model.space import Component, OpenCore
from dse.space.model.trees import leaves
from dse.space.question.open_cores import decided_cores, tells_cores_apart
from dse.verification.diagrams import Diagram, scope
from dse.verification.tables import Tables


def alike_cores(tables: Tables) -> list[list[int]]:
    """Classes of cores, from 1, that may change numbers; only those of two and more."""
    space, decided = tables.space, decided_cores(tables.space)
    if not decided or tells_cores_apart(space):
        return []
    indices = {item.index for item in decided}
    kept = {has_core_text(item) for item in space.components} if tables.places else set[str]()
    if any(indices & scope(diagram) for diagram in _of_figures(tables, kept)):
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
    """Whether a thread may be on a processor with several cores."""
    places = set(leaves(component.processor)) - {None} if component.processor is not None else set()
    return any(max(leaves(tables.space.processors[place].cores), default=1) > 1 for place in places)


def _values(tables: Tables, item: OpenCore) -> list[int]:
    """The cores that a thread may have in a question."""
    return [item.decision.values[option] for option in tables.allowed[item.index]]


def _of_figures(tables: Tables, kept: Collection[str]) -> Iterator[Diagram]:
    """Every diagram but those of places, and but the conditions that are `kept` in any case, by their names."""
    for name, diagram in tables.conditions:
        if name not in kept:
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

    In the order of the file, that is, on each processor if `places` of threads are known; they go into copies of the
    model whose answers may be any design.
    """

    def __init__(
        self, tables: Tables, model: cp_model.CpModel, chosen: Sequence[Any], places: Mapping[int, Any]
    ) -> None:
        decided, classes = decided_cores(tables.space), alike_cores(tables)
        self.decisions = {item.index for item in decided}
        self._model = model
        self._needs: list[tuple[Any, list[Any]]] = []  # a literal, and those of which it needs one
        most = max(count for slot in tables.space.processors for count in leaves(slot.cores)) if classes else 0
        on: list[dict[tuple[int, int], Any]] = []
        for item in decided if classes else ():
            if places:
                on.append(self._literals(self._where(tables, item, most), places[item.threads[0]]))
            else:
                cores = zip(_values(tables, item), tables.allowed[item.index], strict=True)
                on.append(self._literals({(0, core): option for core, option in cores}, chosen[item.index]))
        for former, core in (pair for cores in classes for pair in pairwise(cores)):
            for position, here in enumerate(on):
                for processor in sorted({processor for processor, number in here if number == core}):
                    place = processor, former
                    before = [other[place] for other in on[:position] if place in other]
                    self._needs.append((here[processor, core], before))

    @staticmethod
    def _where(tables: Tables, item: OpenCore, most: int) -> dict[tuple[int, int], int]:
        """The number of each place that a thread may have (`place_of`), by processor and core."""
        component = tables.space.components[item.threads[0]]
        processors = {leaf for leaf in leaves(component.processor) if leaf is not None}
        return {
            (processor, core): processor * (most + 1) + core
            for processor in processors
            for core in _values(tables, item)
        }

    def _literals(self, values: Mapping[tuple[int, int], int], variable: Any) -> dict[tuple[int, int], Any]:
        """A literal for each value of a variable that is true where it has the value."""
        found = {}
        for place, value in values.items():
            found[place] = self._model.new_bool_var("")
            self._model.add(variable == value).only_enforce_if(found[place])
            self._model.add(variable != value).only_enforce_if(found[place].negated())
        return found

    def add(self, model: cp_model.CpModel) -> None:
        """Number the cores in a copy of the model."""
        for here, before in self._needs:
            first, *others = (model.get_int_var_from_proto_index(literal.index) for literal in (here, *before))
            model.add_bool_or([first.negated(), *others])
