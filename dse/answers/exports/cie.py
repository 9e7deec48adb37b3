"""A design as a configuration of the callback-isolated executor: policy, priority and core of each callback group."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.scheduling.priorities import levels_of
from dse.analysis.views import View
from dse.space.model.space import Design, Space
from dse.space.model.trees import at
from dse.spec.loading.writing import yaml_text
from dse.spec.schema.model import Ros2
from dse.spec.schema.ros2 import HOLE
from dse.support.errors import UsageError

MOST_URGENT = 90
"""Priority of the first level of a core under SCHED_FIFO; each further one is one less. 91 to 99 are left to others."""


def cie_configuration(space: Space, design: Design, title: str, names: Ros2 | None) -> str:
    """The configuration: an entry for each executor or thread of which the problem states the callback group's id.

    Threads of one core get the priorities of their levels, the most urgent `MOST_URGENT`; ids have the chosen periods.

    Raises
    ------
    UsageError
        when the problem states no ids, two of them are the same, there are more levels than priorities, or a group
        runs on a core that nothing gives.
    """
    if names is None or not names.callback_groups:
        hint = "state them under `ros2: callback_groups`, as `dse import` of that executor's template does"
        raise UsageError(f"the problem states no ids of callback groups: {hint}")
    entries = list(_entries(space, design, names))
    seen: dict[str, str] = {}
    for name, text, _ in entries:
        if text in seen:
            raise UsageError(f"{name} and {seen[text]} have the same id with the chosen periods: {text}")
        seen[text] = name
    unnamed = [name for name in _threads_of(space, design) if name not in names.callback_groups]
    lines = [f"# {title}", f"# Priorities by the levels of each core, from {MOST_URGENT} downwards."]
    lines += [f"# Without an id, and so not here: {', '.join(unnamed)}"] if unnamed else []
    lines += ["callback_groups:"]
    for _, text, rest in entries:
        lines += [f"  - id: {yaml_text(text)}", *(f"    {line}" for line in rest), ""]
    return "\n".join("".join(char if char.isprintable() else " " for char in line) for line in lines).rstrip() + "\n"


def _threads_of(space: Space, design: Design) -> dict[str, list[int]]:
    """The OS threads: executors, and threads without one that run on a processor; each with its jobs by number."""
    view = View(design)
    threads_of: dict[str, list[int]] = {}
    for number, component in enumerate(space.components):
        processor = at(component.processor, view)
        if component.section != "threads" or processor is None or space.processors[processor].serves is not None:
            continue
        executor = at(component.executor, view)
        name = component.stated_as if executor is None else space.executors[executor].name
        threads_of.setdefault(name, []).append(number)
    return threads_of


def _entries(space: Space, design: Design, names: Ros2) -> Iterator[tuple[str, str, list[str]]]:
    view, cores, threads = View(design), cores_of(space, design), _threads_of(space, design)
    ranks = _ranks(space, design)
    for name, pattern in names.callback_groups.items():
        if name not in threads:
            raise UsageError(f"{name}: it runs on no processor of this design, or with an executor")
        first = threads[name][0]
        if space.components[first].reservation is not None:
            reserved = space.core_owner(space.components[first], view)
            raise UsageError(
                f"{name}: its priority holds in the reservation {reserved}, which this format does not know"
            )
        rank = ranks[space.unit(first, view)]
        if rank >= MOST_URGENT:
            raise UsageError(f"{name}: its core has more than {MOST_URGENT} levels, SCHED_FIFO has no priority for it")
        processor = at(space.components[first].processor, view)
        slot = space.processors[processor]
        core = cores.get(first)
        several = at(slot.cores, view) not in (None, 1)
        if core is None and several:
            raise UsageError(f"{name}: nothing gives it a core of {slot.name}; state it, or ask for `core: any`")
        rest = [
            f"affinity: [{(core or 1) - 1}]  # {slot.name}",
            "policy: SCHED_FIFO",
            f"priority: {MOST_URGENT - rank}",
        ]
        yield name, _with_periods(space, pattern, view, name), rest


def _ranks(space: Space, design: Design) -> dict[int, int]:
    """The level of each OS thread on its core, by its first job; 0 is the most urgent."""
    view, cores = View(design), cores_of(space, design)
    by_core: dict[tuple[int, int | None], list[int]] = {}
    for numbers in _threads_of(space, design).values():
        for number in numbers:
            key = at(space.components[number].processor, view), cores.get(number)
            by_core.setdefault(key, []).append(number)
    rank_of: dict[int, int] = {}
    for numbers in by_core.values():
        for rank, level in enumerate(levels_of(space, numbers, view)):
            rank_of |= dict.fromkeys(level, rank)
    return rank_of


def _with_periods(space: Space, pattern: str, view: View, owner: str) -> str:
    """The id with the period of each thread that it names, in ns."""
    numbers = {component.name: number for number, component in enumerate(space.components)}
    text = pattern
    for thread in HOLE.findall(pattern):
        period = at(space.components[numbers[thread]].period_ns, view)
        if period is None:
            raise UsageError(f"{owner}: {thread} has no period in this design, which its id needs")
        text = text.replace(f"{{{thread}}}", str(Fraction(period)), 1)
    return text
