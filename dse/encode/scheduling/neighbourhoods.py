"""Models of the neighbours of a solution: designs in which only the threads of some cores have other rates and cores.

Such a model is the search's own with most of its literals fixed, so that what it finds is a solution of that, but for
the numbers of cores that are interchangeable.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ortools.sat.python import cp_model

from dse.encode.linear import set_domain
from dse.encode.model import EncodedSpace
from dse.encode.scheduling.places import Places, Thread

Core = tuple[int, int]
"""A processor, and a core of it counted from 0."""


def unnumbered(encoded: EncodedSpace) -> cp_model.CpModel:
    """The model as it stands, wherever its objectives lie, and with the cores of a processor in any order."""
    assert encoded.contention is not None, "nothing is asked about response times"
    model = encoded.model.clone()
    model.clear_hints()
    for clause in encoded.contention.numbering:
        model.proto.constraints[clause].bool_or.literals.append(encoded.contention.places.true)
    for objective in encoded.objectives:
        set_domain(model.proto.variables[objective.variable.index], 0, objective.size)
    for switch in encoded.regions:
        for constraint, objective in zip(switch.constraints, encoded.objectives, strict=True):
            set_domain(model.proto.constraints[constraint].linear, 0, objective.size)
    return model


def least_demanding(places: Places, model: cp_model.CpModel) -> cp_model.CpModel:
    """The model, in which threads are to use as little of their processors as they can by their rates."""
    demanding = model.clone()
    uses: dict[int, int] = {}
    for (_, number), worst in places.worst_on.items():
        for index, rate in places.threads[number].rates or ():
            uses[index] = max(uses.get(index, 0), int(min(worst) * rate) // 1000)
    literals = [_literal(demanding, index) for index in uses]
    demanding.minimize(cp_model.LinearExpr.weighted_sum(literals, list(uses.values())))
    return demanding


def threads_by_core(places: Places, solution: Sequence[int]) -> dict[Core, frozenset[int]]:
    """The numbers of the threads on each core that may have one; those whose rates are too many to list are on none."""
    found: dict[Core, set[int]] = {}
    for thread in places.threads.values():
        for processor, columns in thread.cores.items():
            for core, index in enumerate(columns):
                members = found.setdefault((processor, core), set())
                if _is_true(solution, index) and thread.rates is not None:
                    members.add(thread.number)
    return {core: frozenset(members) for core, members in sorted(found.items())}


def neighbourhood(
    places: Places, model: cp_model.CpModel, solution: Sequence[int], cores: Sequence[Core], free: frozenset[int]
) -> cp_model.CpModel:
    """The solutions of a model in which the threads `free` are on `cores`, and all others as they are in `solution`."""
    near = model.clone()
    variables = near.proto.variables
    for thread in places.threads.values():
        if thread.number in free:
            for processor, columns in thread.cores.items():
                for core, index in enumerate(columns):
                    if (processor, core) not in cores and index not in (places.true, -places.true - 1):
                        set_domain(variables[_variable(index)], int(index < 0), int(index < 0))
        else:
            for variable in _held(thread):
                set_domain(variables[variable], solution[variable], solution[variable])
    return near


def _held(thread: Thread) -> Iterator[int]:
    """The variables that say where a thread is, and how often it runs."""
    for columns in thread.cores.values():
        yield from map(_variable, columns)
    for index, _ in (*(thread.rates or ()), *thread.modes):
        yield _variable(index)


def _variable(index: int) -> int:
    return index if index >= 0 else -index - 1


def _is_true(solution: Sequence[int], index: int) -> bool:
    return bool(solution[index]) if index >= 0 else not solution[-index - 1]


def _literal(model: cp_model.CpModel, index: int) -> Any:
    found = model.get_int_var_from_proto_index(_variable(index))
    return found if index >= 0 else found.negated()
