"""What a design keeps when threads wait for each other, told of fronts whose search does not count that.

docs/semantics.md, section 4.4. The cores are those of the design: stated, decided, else as first-fit gives them
(`dse.analysis.placement.first_fit.core_of_each`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from dse.analysis.diagnosis.unbounded import unbounded_in
from dse.analysis.latency.metrics import flow_figure_ns
from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit, Verdict, build_limit, judge
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import counted_buses
from dse.analysis.placement.first_fit import placement
from dse.analysis.placement.heuristics import placed
from dse.analysis.placement.partition import Spread
from dse.analysis.validity import Rulebook
from dse.analysis.views import View
from dse.space.architecture.carriers import carriers
from dse.space.model.metric_kinds import is_of_message
from dse.space.model.space import EMPTY, Bus, Component, Design, Space
from dse.space.model.trees import at, leaves
from dse.space.question.open_cores import asked_metrics, is_scheduled, with_open_cores
from dse.support.timelimit import in_time


@dataclass(frozen=True)
class Miss:
    """A requirement that a design breaks, and the threads in it whose response time has no bound, if there are any.

    The verdict has value and limit; `unbounded` is empty where the value is finite.
    """

    verdict: Verdict
    unbounded: tuple[str, ...]


def is_left_out(space: Space) -> bool:
    """Whether latencies leave contention out although a profile that knows it applies, and threads share processors.

    Then a verdict with contention is given for each design in addition.
    """
    knows = counts_responses(replace(space, processing="response_time"))
    return knows and not counts_responses(space) and any(item.processor is not None for item in space.components)


def leaves_out_buses(space: Space) -> bool:
    """Whether times count no waiting for some physical bus that may carry messages; OSATE has rules of its own.

    True where such a bus has no stated arbitration, or counting is switched off, and a flow or a message is asked
    about.
    """
    is_timed = bool(space.flows) or any(is_of_message(space, metric) for metric in asked_metrics(space))
    return space.profile == "dse" and is_timed and bool(uncounted_buses(space))


def uncounted_buses(space: Space) -> tuple[Bus, ...]:
    """The physical buses that may carry messages, of which the waiting for them is not counted.

    In the order of the space; virtual buses have no waiting of their own.
    """
    carried = {bus for item in space.connections for bus in carriers(space.buses, item)}
    counted = counted_buses(space)
    buses = enumerate(space.buses)
    return tuple(bus for number, bus in buses if number in carried and not bus.virtual and number not in counted)


def waiting_counted(space: Space) -> dict[str, list[str]]:
    """The resources for which latencies count waiting, those for which they do not, and buses with counted faults.

    ``{"counted": ["processors", "can0"], "not_counted": ["ser0"], "faults": ["can0"]}``: all processors together, each
    physical bus that may carry messages by its name; nothing of buses under the OSATE profiles, which have own rules.
    """
    carried = {bus for item in space.connections for bus in carriers(space.buses, item)}
    buses = [space.buses[number] for number in counted_buses(space) if number in carried]
    processors = ["processors"] if any(item.processor is not None for item in space.components) else []
    is_counted = counts_responses(space)
    left = [bus.name for bus in uncounted_buses(space)] if leaves_out_buses(space) else []
    return {
        "counted": [*(processors if is_counted else []), *(bus.name for bus in buses)],
        "not_counted": [*([] if is_counted else processors), *left],
        "faults": [bus.name for bus in buses if set(leaves(bus.fault_interval_ns)) != {None}],
    }


def with_contention(space: Space) -> Space | None:
    """The question with response times counted in latencies; None where that is what is asked anyway.

    A space with ``processing: response_time``, by which `ContentionReferee` judges.
    """
    return replace(space, processing="response_time") if is_left_out(space) else None


@dataclass(frozen=True)
class Judged:
    """The violations of a design, as `design` of `space`: the question with contention and an order of threads."""

    misses: tuple[Miss, ...]
    space: Space
    design: Design


class ContentionReferee:
    """Judges designs by the question with contention.

    Where a best order is open in a design, and is none of the decisions of the question that it is an answer to, it is
    judged in the one that whoever analyses it with contention gets (`dse.analysis.placement.heuristics.placed`).
    """

    def __init__(self, counted: Space, *, of_fronts: bool = True) -> None:
        """Judge by `counted`, which `with_contention` gives.

        Designs of fronts keep what the question without contention requires: of them only what response times count in
        is looked at; else every requirement.
        """
        self.space, self.of_fronts = counted, of_fronts
        self._limits = self._limits_of(counted)

    def judge(self, design: Design) -> Judged:
        """The violations of a valid design with contention counted, in the order of the requirements.

        Raises
        ------
        OutOfTime
            when a limit of time (`dse.support.timelimit.until`) is up.
        """
        if self._open is None:
            return Judged(self._misses(self.space, self._limits, design), self.space, design)
        space, limits = self._open
        added = range(len(self.space.decisions), len(space.decisions))
        whole = placed(space, (*design, *(0 for _ in added)), added)
        if Rulebook(space).breaches(whole):
            return Judged(self._misses(self.space, self._limits, design), self.space, design)
        return Judged(self._misses(space, limits, whole), space, whole)

    @cached_property
    def _open(self) -> tuple[Space, tuple[Limit, ...]] | None:
        """The space with a decision for each open core and order; None where no order is left open."""
        space = with_open_cores(self.space) if self.space.open_priorities else self.space
        return (space, self._limits_of(space)) if len(space.decisions) > len(self.space.decisions) else None

    def _limits_of(self, space: Space) -> tuple[Limit, ...]:
        requirements = (item for item in space.requirements if not self.of_fronts or is_scheduled(space, item.metric))
        return tuple(build_limit(space, item) for item in in_time(requirements))

    def _misses(self, space: Space, limits: Sequence[Limit], design: Design) -> tuple[Miss, ...]:
        view = View(design)  # one for all: response times are found together, once for a view
        verdicts = [judge(item, view, flow_figure_ns(space, item.requirement.metric, view)) for item in in_time(limits)]
        return tuple(
            Miss(verdict, unbounded_in(space, verdict.requirement.metric, view))
            for verdict in verdicts
            if not verdict.holds
        )


def core_by(space: Space, component: Component, view: View) -> str:
    """Whose choice a thread's core is: ``stated`` in the file, ``decided`` as a decision is, or ``first-fit``.

    For the thread of `component` in one design; executors and reservations decide for their threads.
    """
    if at(component.core, view) is None:
        return "first-fit"
    decision = space.decision_index(f"{space.core_owner(component, view)}.core")
    return "stated" if decision is None or not space.decisions[decision].is_open else "decided"


def core_origins(space: Space) -> frozenset[str]:
    """The ways in which threads on processors with several cores get their core in any design, as `core_by` names them.

    A subset of ``stated``, ``decided`` and ``first-fit``; empty where each processor has one core.
    """
    several = {number for number, slot in enumerate(space.processors) if max(leaves(slot.cores), default=1) > 1}
    open_ = {decision.name for decision in space.decisions if decision.field == "core" and decision.is_open}
    origins = set()
    for item in space.components:
        if several & set(leaves(item.processor)):
            stated = {"decided" if f"{name}.core" in open_ else "stated" for name in space.core_owners(item)}
            origins |= {"first-fit"} if item.core is None else stated
    return frozenset(origins)


_PLACEMENTS: Recall[Spread] = Recall()


def cores_of(space: Space, design: Design) -> Mapping[int, int]:
    """The core, from 1, of each thread that runs on a processor with several, by the thread's number.

    Component indices to core numbers, ascending by component.
    """
    core_of: dict[int, int] = {}
    for item in placements_of(space, design).values():
        core_of |= item.cores
    return dict(sorted(core_of.items()))


def placements_of(space: Space, design: Design) -> Mapping[int, Spread]:
    """The assignment of threads to cores on each processor with several, and whether it meets the limits on cores.

    Processor indices to `Spread` objects with cores, loads and status; remembered for each space.
    """
    view = View(design)
    return {
        number: _PLACEMENTS.recall(space, number, view, placement)
        for number, slot in enumerate(space.processors)
        if slot.types[view[slot.type_decision]] != EMPTY and at(slot.cores, view) > 1
    }
