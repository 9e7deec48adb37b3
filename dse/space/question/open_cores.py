"""The core of a thread as a decision: there only where something that is asked depends on cores.

A thread without a stated core may run on any core of its processor (`core: any`), one with a list on any of these. Such
decisions stand behind all others, so that questions that do not depend on cores are the same with and without them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import prod
from typing import Any

from dse.space.architecture.clocks import reads_when_jobs_begin
from dse.space.model.criteria import Metric, MultipleTest, PairTest, ResolvedCondition, UsedTest, ValueTest
from dse.space.model.metric_kinds import CHAIN_METRICS, FLOW_METRICS, parts_of
from dse.space.model.space import Component, Decision, OpenCore, Processor, Space
from dse.space.model.trees import NOT_OFFERED, Choice, PerCore, Tree, graft, leaves
from dse.space.properties import Ledger, Path
from dse.spec.language.expressions import And, Not, Or
from dse.spec.schema.fields import CORE_RULES
from dse.spec.schema.model import Spec

OWNERS = ("reservations", "executors", "threads")
"""Sections whose entries have a core: each that of its threads, where it is the first of these."""
MOST_WAYS = 256
"""The greatest number of ways through the executors of threads that are looked at, to tell where one has none."""
PER_CORE = ("execution_ns", "callback_ns", "response_ns", "section_ns")
"""Figures of a thread that may be those of its core."""


def cores_named(
    ledger: Ledger, processors: Sequence[Processor], path: Path, processor: Tree, given: Sequence[int | str]
) -> tuple[int | str, ...]:
    """The cores of a thread with groups as their numbers; rules stay as they are.

    Words such as ``any`` are kept. A group with other numbers on another type, and an unknown group, go to `ledger`.
    """
    slots = [processors[leaf] for leaf in dict.fromkeys(leaves(processor)) if leaf is not None]
    found: dict[int | str, None] = {}
    for item in given:
        if isinstance(item, int) or item in CORE_RULES:
            found[item] = None
            continue
        places = {numbers_of(slot, type_name, item) for slot in slots for type_name in slot.groups} - {()}
        known = [group for slot in slots for groups in slot.groups.values() for group, _ in groups]
        if len(places) == 1:
            found |= dict.fromkeys(next(iter(places)))
        elif places:
            ledger.error(path, f"{item} has other numbers on other processor types: give numbers")
        else:
            ledger.unknown(path, "core", item, [*CORE_RULES, *dict.fromkeys(known)])
    return tuple(found)


def the_core(named: Sequence[int | str]) -> int | None:
    """The one core that is stated; None where several are, or a rule decides."""
    return named[0] if len(named) == 1 and isinstance(named[0], int) else None


def numbers_of(slot: Processor, type_name: str, group: str) -> tuple[int, ...]:
    """The cores of a group, from 1 on; none where the type has no such group.

    Ascending core numbers of one processor type; groups are numbered in the order of the file.
    """
    first = 1
    for name, count in slot.groups.get(type_name, ()):
        if name == group:
            return tuple(range(first, first + count))
        first += count
    return ()


def with_times_of_cores(ledger: Ledger, spec: Spec, space: Space) -> Space:
    """The space with the times that a thread takes on each group of cores as figures of its core.

    Execution times become trees over the core decision; a thread whose core first-fit would choose is a mistake.
    """
    components = list(space.components)
    cores: dict[str, Tree] = {}
    for number, component in enumerate(space.components):
        trees = {key: getattr(component, key) for key in PER_CORE}
        if not any(isinstance(leaf, PerCore) for tree in trees.values() for leaf in leaves(tree)):
            continue
        if component.core is None or not component.bound:
            name = component.stated_as
            path = ("threads", name, *(("core",) if spec.threads[name].core else ()))
            ledger.error(path, "its execution times depend on the core: first-fit knows equal cores only")
            continue
        cores[component.name] = component.core
        made = {key: graft(tree, partial(_of_core, component.core)) for key, tree in trees.items()}
        components[number] = replace(component, **made)
    decisions = tuple(
        replace(item, home=graft(item.home, partial(_of_core, cores[item.component])))
        if item.component in cores
        else item
        for item in space.decisions
    )
    for name in cores:
        for field in ("compute_execution_time", "callback_execution_time", "response_time", "non_preemptive"):
            reference = ledger.references.get(f"{name}.{field}")
            if reference is not None:
                tree = graft(reference.tree, partial(_of_core, cores[name]))
                ledger.references[reference.name] = replace(reference, tree=tree)
    return replace(
        space,
        components=tuple(components),
        decisions=decisions,
        references=ledger.references,
        unequal_cores=bool(cores),
    )


def _of_core(core: Tree, leaf: Any) -> Tree:
    """The figure of a thread's core; an offer of none where there is no such core."""
    if not isinstance(leaf, PerCore):
        return leaf

    def at_core(number: int | None) -> Tree:
        if number is None:
            return leaf.by_core[0] if len(leaf.by_core) == 1 else NOT_OFFERED
        return leaf.by_core[number - 1] if number <= len(leaf.by_core) else NOT_OFFERED

    return graft(core, at_core)


def check_core(
    ledger: Ledger, processors: Sequence[Processor], path: Path, processor: Tree, given: Sequence[int | str]
) -> None:
    """Stated cores exist on some processor that the thread or executor may have.

    A design that chooses another is invalid. A thread alone may be put by rule.
    """
    section, name, _ = path
    rules = [item for item in given if item in CORE_RULES]
    numbers = [item for item in given if isinstance(item, int)]
    if section != "threads" and "first_fit" in rules:
        one = "an executor" if section == "executors" else "a reservation"
        ledger.error(path, f"{one} has one core: first-fit puts threads", "a core, a list of cores, or any")
    if rules and len(given) > 1:
        ledger.error(path, f"{rules[0]} stands alone, without other cores")
    slots = [leaf for leaf in leaves(processor) if leaf is not None]
    if given and not slots and not ledger.is_doubtful(str(name), f"{name}.processor"):
        ledger.error(path, "a core needs a `processor`")
    most = max((count for slot in slots for count in leaves(processors[slot].cores)), default=0)
    unsure = any(ledger.is_doubtful(processors[slot].name) for slot in slots)
    if slots and numbers and min(numbers) > most and not unsure:
        ledger.error(path, f"core {min(numbers)} does not exist: there are {most} at most")


def open_cores(ledger: Ledger, spec: Spec, space: Space) -> tuple[OpenCore, ...]:
    """The threads whose core is open, each with its decision; makes every core known to rules and the baseline.

    Each has the index of its decision behind those of the architecture. Whether the decision takes part is decided with
    the question.
    """
    found: list[OpenCore] = []
    for owner, (threads, processor) in _core_owners(space).items():
        ledger.work.go_on(10)
        section = next((item for item in OWNERS if owner in getattr(spec, item)), None)
        if section is None:
            continue  # the one core of an accelerator
        given: tuple[int | str, ...] = getattr(spec, section)[owner].core or ("any",)
        place: Path = (section, owner, "core")
        if "first_fit" in given:
            if space.has_open_groups:
                message = "first-fit where the executors of some threads are decisions: all cores are then decisions"
                ledger.error(place, message, "a core, a list of cores, or any")
            continue
        named = cores_named(ledger, space.processors, place, processor, given)
        given = given if "any" in given else named
        most = max((count for slot in set(leaves(processor)) - {None}
                    for count in leaves(space.processors[slot].cores)), default=0)  # fmt: skip
        numbers = tuple(range(1, most + 1))
        if "any" not in given:
            numbers = tuple(item for item in given if isinstance(item, int))
        name = f"{owner}.core"
        if len(numbers) < 2:
            ledger.refer(name, "count", numbers[0] if numbers else None, {item: str(item) for item in numbers})
            continue
        index = len(space.decisions) + len(found)
        tree = home = _home(space, processor, index, numbers)
        if section == "executors":
            number = next(at for at, item in enumerate(space.executors) if item.name == owner)
            home = where_there_is_one(space.components, threads, number, tree)
        decision = Decision(name, owner, "core", "count", tuple(map(str, numbers)), numbers, home)
        found.append(OpenCore(threads[0], index, decision, tuple(threads[1:]), tree))
        ledger.refer(name, "count", home, {item: str(item) for item in numbers})
    return tuple(found)


def _core_owners(space: Space) -> dict[str, tuple[list[int], Tree]]:
    """By the name of what has a core (a thread, an executor, a reservation) all threads that may run there, and where.

    In the order of the first of these threads.
    """
    found: dict[str, tuple[list[int], Tree]] = {}
    for number, component in enumerate(space.components):
        if component.section != "threads" or component.processor is None:
            continue
        owners = [(component.stated_as, component.processor)]
        if component.reservation is not None:
            owners = [(space.reservations[component.reservation].name, component.processor)]
        elif component.executor is not None:
            executors = [space.executors[item] for item in dict.fromkeys(leaves(component.executor))]
            owners = [(item.name, item.processor) for item in executors]
        for name, processor in owners:
            found.setdefault(name, ([], processor))[0].append(number)
    return found


def where_there_is_one(components: Sequence[Component], members: Sequence[int], executor: int, inner: Tree) -> Tree:
    """`inner` where some thread is in an executor; None where all that may be are elsewhere: it decides nothing then.

    `inner` everywhere where there would be more than `MOST_WAYS` through the executors of its threads.
    """
    trees = [components[number].executor for number in members]
    if prod(max(1, len(tree.branches) - 1) for tree in trees if isinstance(tree, Choice)) > MOST_WAYS:
        return inner
    found: Tree = None
    for tree in reversed(trees):
        found = graft(tree, lambda leaf, rest=found: inner if leaf == executor else rest)  # type: ignore[misc]
    return found


def _home(space: Space, processor: Tree, index: int, numbers: tuple[int, ...]) -> Tree:
    """The thread's core: nothing to decide where its processor has one core only."""

    def on(processor: int | None) -> Tree:
        if processor is None:
            return None
        return graft(space.processors[processor].cores, lambda count: None if count < 2 else choice)

    choice = Choice(index, numbers)
    tree = graft(processor, on)
    return choice if all(leaf is not None for leaf in leaves(tree)) else tree


def with_open_cores(space: Space) -> Space:
    """The space with the decisions on cores and best orders where something asked depends on them, else without.

    What is asked are requirements, objectives, rules and fixed decisions.
    """
    return _with_cores(space, _depends_on_cores(space)) if space.open_cores or space.open_priorities else space


def with_all_cores(space: Space) -> Space:
    """The space with every open core and best order as a decision.

    For designs that state cores, whatever is asked; the space itself where nothing is open.
    """
    return _with_cores(space, True) if space.open_cores or space.open_priorities else space


def without_scheduling(space: Space) -> Space:
    """The space without decisions on cores and best orders where nothing but response times depends on them.

    A smaller search space for questions without response times: equal cores give equal figures.
    """
    return space if _is_spoken_of(space) else _with_cores(space, False)


def without_cores(space: Space, threads: Iterable[OpenCore]) -> Space:
    """The space in which these threads have no core, the decisions in their places.

    First-fit then places these threads when response times are computed.
    """
    components = list(space.components)
    for number in (number for item in threads for number in item.threads):
        components[number] = replace(components[number], core=None)
    return replace(space, components=tuple(components))


def _with_cores(space: Space, wanted: bool) -> Space:
    first = space.first_open
    if wanted == (len(space.decisions) > first):
        return space
    components = list(space.components)
    homes: dict[str, Tree] = {}
    for item in space.open_cores:
        homes[item.decision.component] = core = item.tree if wanted else None
        for number in item.threads:
            components[number] = replace(components[number], core=core)
    for number, component in enumerate(components) if space.has_open_groups else ():
        if isinstance(component.executor, Choice):  # it has the core of the one that it is in
            executors = {item: space.executors[item] for item in leaves(component.executor)}
            cores = {item: homes.get(one.name, one.core) for item, one in executors.items()}
            components[number] = replace(component, core=graft(component.executor, cores.__getitem__))
    for item in space.open_priorities:
        home = item.decision.home if wanted else "deadline_monotonic"
        components[item.component] = replace(components[item.component], priority=home)
    added = tuple(item.decision for item in (*space.open_cores, *space.open_priorities)) if wanted else ()
    return replace(space, decisions=(*space.decisions[:first], *added), components=tuple(components))


def _depends_on_cores(space: Space) -> bool:
    """Whether a requirement, an objective, a rule or a fixed decision of the space depends on who shares a core."""
    return _is_spoken_of(space) or any(is_scheduled(space, metric) for metric in asked_metrics(space))


def _is_spoken_of(space: Space) -> bool:
    """Whether something tells cores or orders apart beside how long threads respond."""
    is_fixed = any(index >= space.first_open for index in space.fixed)
    return is_fixed or tells_cores_apart(space) or rules_on_order(space)


def asked_metrics(space: Space) -> list[Metric]:
    """The metrics of the requirements of a space, then those of its objectives."""
    return [item.metric for item in space.requirements] + [item.metric for item in space.objectives]


def is_scheduled(space: Space, metric: Metric) -> bool:
    """Whether response times count in a metric.

    True for response times and for latencies that count them (`processing: response_time`). Then the assignment of
    threads to cores matters.
    """
    parts = parts_of(space, metric)
    if parts:
        return any(is_scheduled(space, inner) for _, inner in parts)
    if is_shortest(metric):
        return space.processing == "response_time" and reads_when_jobs_begin(space)
    if metric.kind in (*FLOW_METRICS, *CHAIN_METRICS, "oldest input"):
        return space.processing == "response_time"
    if metric.kind == "message response":
        return space.processing == "response_time"
    return metric.kind == "response time"


def is_shortest(metric: Metric) -> bool:
    """Whether a metric is the shortest of several times: longer response times never make it longer.

    A minimum latency under response times is a best case, which waiting does not change.
    """
    return metric.kind.endswith("min latency") or metric.kind == "newest input"


def decided_cores(space: Space) -> list[OpenCore]:
    """The open cores that are decisions of the question, in the order of the file."""
    return [item for item in space.open_cores if item.index < len(space.decisions)]


def cores_beside(space: Space) -> frozenset[int]:
    """The decisions on cores and best orders that change no objective of the question, and are not fixed.

    Indices of decisions of `with_all_cores`. A design of a front stays the same point with other options of these.
    Empty where an objective counts response times or single cores, or execution times depend on the core.
    """
    asked = [item.metric for item in space.objectives]
    if space.unequal_cores or any(is_scheduled(space, item) or _is_of_cores(space, item) for item in asked):
        return frozenset()
    return frozenset(item.index for item in (*space.open_cores, *space.open_priorities)) - space.fixed.keys()


def tells_cores_apart(space: Space) -> bool:
    """Whether something tells the cores of a processor apart: who speaks of them, execution times, or open groups.

    Where the executor of a thread is a decision its core follows from that: none can change places with another one.
    """
    return space.unequal_cores or space.has_open_groups or names_cores(space)


def names_cores(space: Space) -> bool:
    """Whether rules, or figures of single cores, tell cores apart: a derived metric is looked at wherever it stands.

    Cores of a processor are then not interchangeable, and symmetric designs differ.
    """
    cores = {item.index for item in space.open_cores}
    if any(_looks_at(rule.condition, lambda index: index in cores) for rule in space.rules):
        return True
    derived = [Metric(item.name, "derived", number) for number, item in enumerate(space.derived)]
    return any(_is_of_cores(space, metric) for metric in (*asked_metrics(space), *derived))


def _is_of_cores(space: Space, metric: Metric) -> bool:
    parts = parts_of(space, metric)
    return metric.kind == "core utilisation" or any(_is_of_cores(space, inner) for _, inner in parts)


def rules_on_order(space: Space) -> bool:
    """Whether rules look at priorities of which the best are asked for.

    Such priorities stay decisions, even if nothing else depends on them.
    """
    orders = {item.index for item in space.open_priorities}
    return any(_looks_at(rule.condition, lambda index: index in orders) for rule in space.rules)


def _looks_at(condition: ResolvedCondition, wanted: Callable[[int], bool]) -> bool:
    if isinstance(condition, Not):
        return _looks_at(condition.operand, wanted)
    if isinstance(condition, And | Or):
        return any(_looks_at(item, wanted) for item in condition.operands)
    return any(wanted(index) for tree in _trees(condition) for index in _decisions(tree))


def _trees(atom: ValueTest | PairTest | MultipleTest | UsedTest) -> Iterable[Tree]:
    if isinstance(atom, ValueTest):
        return (atom.tree,)
    if isinstance(atom, UsedTest):
        return [tree for tree, _ in atom.types]
    return (atom.left, atom.right)


def _decisions(tree: Tree) -> Iterable[int]:
    if isinstance(tree, Choice):
        yield tree.decision
        for branch in tree.branches:
            yield from _decisions(branch)
