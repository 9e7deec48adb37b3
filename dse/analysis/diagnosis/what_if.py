"""A system of stages and resources with one time shortened, to find its response times again without its design.

Every stage keeps its resource and its place in the order there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.model import Entry, Resource, Stage, System


def with_shorter_job(system: System, key: TaskKey, by_ns: int) -> System:
    """The system in which jobs of a stage take `by_ns` less at the longest.

    A shortest time that is longer than the longest one then is the same as that, and so is a section.
    """
    stage = system.stages[key]
    worst = stage.worst_ns - by_ns
    best = min(stage.best_ns, worst)
    less = stage.best_ns - best, by_ns

    def changed(other: Stage) -> Stage:
        is_later = other.pieces and key in other.pieces and other.pieces.index(other.key) >= other.pieces.index(key)
        if other.key != key and not is_later:
            return other
        elapsed = other.elapsed_ns[0] - less[0], other.elapsed_ns[1] - less[1]
        if other.key != key:
            return replace(other, elapsed_ns=elapsed)
        return replace(other, best_ns=best, worst_ns=worst, cost_ns=other.cost_ns - by_ns, elapsed_ns=elapsed)

    stages = {other: changed(item) for other, item in system.stages.items()}
    shorter = _with_sections(system, lambda one, section_ns: min(section_ns, worst) if one == key else section_ns)
    return replace(shorter, stages=stages)


def with_shorter_section(system: System, number: int, section_ns: int) -> System:
    """The system in which the sections of a thread, by number, that nothing interrupts take so long.

    `section_ns` replaces longer sections of the thread; other tasks are unchanged.
    """

    def section_of(key: TaskKey, longest: int) -> int:
        return min(section_ns, longest) if key[0] == number and key[1] != "message" else longest

    return _with_sections(system, section_of)


def with_shorter_interrupt(system: System, processor: int, index: int, by_ns: int) -> System:
    """The system in which an interrupt of a processor, by its place among these, takes `by_ns` less.

    Every core of the processor has the shorter interrupt.
    """

    def changed(resource: Resource) -> Resource:
        if resource.processor != processor or not resource.interrupts:
            return resource
        interrupts = list(resource.interrupts)
        interrupts[index] = replace(interrupts[index], worst_ns=interrupts[index].worst_ns - by_ns)
        return replace(resource, interrupts=tuple(interrupts))

    return replace(system, resources=tuple(map(changed, system.resources)))


def only(system: System, places: frozenset[tuple[int, int]]) -> System:
    """The system with these resources only, by processor and core.

    For response times of one core, where other cores do not matter.
    """
    resources = (item for item in system.resources if (item.processor, item.core) in places)
    return replace(system, resources=tuple(resources))


def _with_sections(system: System, section_of: Callable[[TaskKey, int], int]) -> System:
    """The system with other sections, of the stages that have one."""

    def of_entry(entry: Entry) -> Entry:
        if not entry.blockers:
            return entry
        blockers = tuple((key, section_of(key, section_ns)) for key, section_ns in entry.blockers)
        return replace(entry, blockers=blockers, blocked_ns=max(section_ns for _, section_ns in blockers))

    def of_resource(resource: Resource) -> Resource:
        return replace(resource, entries=tuple(map(of_entry, resource.entries)))

    return replace(system, resources=tuple(map(of_resource, system.resources)))
