"""Requirements as comparisons of exact sums: metric against limit, with the capacity of what is limited.

A ratio limits the utilisation of a processor by limit * cores, and each thread alone by the limit of one core
(docs/semantics.md, section 4.2); it limits the load of a bus by limit * bandwidth
(docs/semantics.md, section 5.1).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm
from typing import Annotated, Protocol

from dse.analysis.diagnosis.unbounded import may_be_unbounded, unbounded_from
from dse.analysis.measures import (
    PPM,
    SCALE_LIMIT,
    ZERO,
    Measure,
    Term,
    build_measure,
    display_unit,
    exact_sum,
    scaled_term,
)
from dse.analysis.placement.bin_packing import Room
from dse.analysis.placement.partition import Spread, asks_for_first_fit, even_spread, spread
from dse.analysis.scheduling.priorities import deadline_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.views import View, tabulate
from dse.space.model.criteria import Requirement
from dse.space.model.metric_kinds import metric_dimension
from dse.space.model.space import EMPTY, Bus, Component, Space
from dse.space.model.trees import Choice, Tree, at, leaves
from dse.support.errors import TooLargeError
from dse.support.json_fields import NULL, Of, Unit
from dse.support.units import Exact

MANY_CASES = 10_000
MOST_LEFT_OUT = 32
"""Of more threads on a processor that have no partition none is left out: each takes a search of its own."""
FULLEST = "the fullest core"
"""What is said of a core that has no number, for threads may have others."""

HOLDS: dict[str, Callable[[Fraction, Fraction], bool]] = {
    "<=": lambda value, limit: value <= limit,
    "<": lambda value, limit: value < limit,
    ">=": lambda value, limit: value >= limit,
    ">": lambda value, limit: value > limit,
    "==": lambda value, limit: value == limit,
    "!=": lambda value, limit: value != limit,
}


@dataclass(frozen=True)
class EachCore:
    """An upper limit on each core of a processor of a space: at most `most`, in ppm of the core, or less than that.

    `most` is in ppm of one core; with `is_strict` the load must be less.
    """

    space: Space
    processor: int
    most: Fraction
    is_strict: bool

    @property
    def room(self) -> Room:
        """The capacity of a core that the limit allows, as a share of the core.

        The capacity for bin packing, 1 for a whole core.
        """
        return Room(self.most / PPM, self.is_strict)


@dataclass(frozen=True)
class Limit:
    """A requirement ready to evaluate: the sum of `measure` against `bound`, both in the measure's unit.

    `cores` is what it asks of every core of a processor beside the sum, and so of each thread alone, which cannot use
    more than one; or None. `is_elsewhere`: its figures are not those of the space that it limits, but of one with other
    inputs.
    """

    requirement: Requirement
    measure: Measure
    bound: Callable[[View], Fraction]
    cores: EachCore | None = None
    is_elsewhere: bool = False

    @property
    def alone(self) -> dict[str, list[Term]]:
        """The terms of each thread that must keep the limit of one core alone; none where no core is limited.

        Names of threads to their terms. A thread whose share exceeds the limit of a core violates it wherever it runs.
        """
        return {} if self.cores is None else _thread_loads(self.measure.terms)

    @property
    def together(self) -> list[list[Term]]:
        """The terms of threads that are stated to run on one core, which keep its limit together, core by core.

        One list of terms for each core with several such threads. Their sum is a lower bound of the core's load.
        """
        if self.cores is None:
            return []
        stated = {item.name: item.core for item in self.cores.space.components if isinstance(item.core, int)}
        groups: dict[int, list[list[Term]]] = {}
        for name, terms in self.alone.items():
            if name in stated:
                groups.setdefault(stated[name], []).append(terms)
        return [[term for terms in group for term in terms] for group in groups.values() if len(group) > 1]


class Reading(Protocol):
    """A function that makes a requirement a limit: `build_limit`, or one that uses other figures.

    Takes a space, a requirement and flags, and returns a `Limit`; explanations use another reading without waiting.
    """

    def __call__(self, space: Space, requirement: Requirement, *, is_asked: bool = True) -> Limit:
        """The limit of a requirement of a space; one that is not asked may be any."""


@dataclass(frozen=True)
class ComparedSum:
    """One comparison that a requirement makes in a design: of the sum, or of what `thread` or `core` uses alone.

    The core is the fullest one; where threads have no core yet, of the partition in `spread`. A partition that is
    undecided keeps its limit: nothing was found against it.
    """

    value: Fraction
    bound: Fraction
    thread: str = ""
    core: int = 0
    spread: Spread | None = None


@dataclass(frozen=True)
class Verdict:
    """The verdict on a requirement in a design.

    `value` and `limit` are those of the sum, unless the limit of one core is nearer, or broken by more: then those of
    the thread, which `worst_term` names, or of `worst_core`, from 1. `whole_limit` is the limit of the sum. `spread`
    tells which core each thread of a limited processor has.
    """

    WRITTEN = (
        Of("requirement.text", "In the words of the problem.", key="requirement", kind=str),
        Of(
            "requirement.implied",
            "Whether it is not stated, but implied: 100 % of a core, a bandwidth or the time of an exclusive bus.",
            kind=bool,
        ),
        Of("requirement.origin", "Where it stands: `FILE:LINE`, or `command line`.", kind=str),
        *("value", "limit", "slack", "unit", "holds", Of("who", key="worst_thread")),
    )

    requirement: Requirement
    value: Annotated[Fraction, NULL, "What the design has, in `unit`; null where it is unbounded."]
    limit: Annotated[Fraction, "The limit in this design, in `unit`."]
    whole_limit: Fraction
    unit: Annotated[Unit, "What the figures count."]
    holds: Annotated[bool, "Whether the requirement holds."]
    worst_term: str = ""
    worst_core: int = 0
    spread: Spread | None = None

    @property
    def who(self) -> Annotated[str, NULL]:
        """The thread or core that alone decides, where one does: value and limit are then its own.

        A name, such as of a thread that exceeds a core, or the words for the fullest core; empty where the sum decides.
        """
        return self.worst_term or (core_words(self.spread) if self.worst_core and self.spread is not None else "")

    @property
    def slack(self) -> Annotated[Fraction, NULL]:
        """The distance from value to limit; negative where the limit is missed, null where the value is unbounded.

        In the unit of the metric; value and limit are those that decide (`who`).
        """
        return self.limit - self.value if self.requirement.is_upper else self.value - self.limit


def build_limit(space: Space, requirement: Requirement, *, counted: bool = True, is_asked: bool = True) -> Limit:
    """The limit of a resolved requirement; `counted` as for `build_measure`; one that is not asked may be any.

    An empty slot uses nothing, and keeps every upper limit: its capacity counts as 1.

    Raises
    ------
    TooLargeError
        when it is asked, and what stands for an unbounded response time would keep it.
    """
    metric, quantity = requirement.metric, requirement.limit
    measure = build_measure(space, metric, counted=counted)
    if requirement.implied and metric.kind in ("load", "busy"):
        limited = space.buses[metric.index or 0]
        tree = limited.bandwidth_bps if metric.kind == "load" else limited.exclusive
        measure = _where_limited(limited, tree, measure)
    if metric.kind == "utilisation":
        number, per_core = metric.index or 0, quantity.value * PPM
        slot = space.processors[number]
        upper = requirement.is_upper
        return Limit(
            requirement,
            measure,
            lambda view: per_core * (at(slot.cores, view) or 1),
            EachCore(space, number, per_core, requirement.operator == "<") if upper else None,
        )
    if metric.kind == "load" and requirement.is_share:
        bus, share = space.buses[metric.index or 0], quantity.value / 8
        return Limit(requirement, measure, lambda view: share * (at(bus.bandwidth_bps, view) or 8))
    if metric.key == "deadline":
        if metric.kind == "message response":
            stated = space.connections[metric.index or 0].deadline_ns
            return Limit(requirement, measure, lambda view: Fraction(0) + at(stated, view))
        thread = space.components[metric.index or 0]
        return Limit(requirement, measure, lambda view: Fraction(0) + _deadline_ns(space, thread, view))
    dimension = metric_dimension(space, metric)
    bound = quantity.value * (display_unit(dimension)[1] if dimension is not None else 1)
    if is_asked and may_be_unbounded(space, metric) and bound > unbounded_from(space, metric):
        raise TooLargeError(f"{requirement.shown}: no limit; beyond 50 000 s a response time counts as unbounded")
    return Limit(requirement, measure, lambda view: bound)


def _where_limited(bus: Bus, tree: Tree, measure: Measure) -> Measure:
    """The measure of a bus as far as an implied limit is about its type: nothing where `tree` says so of none."""
    branches = tree.branches if isinstance(tree, Choice) and tree.decision == bus.type_decision else [tree]
    kinds = zip(bus.types, branches, strict=len(branches) > 1)
    if all(name == EMPTY or all(map(bool, leaves(branch))) for name, branch in kinds):
        return measure
    return replace(measure, terms=tuple(_term_where(tree, term) for term in measure.terms))


def _term_where(tree: Tree, term: Term) -> Term:
    """The term where a tree's leaf is neither missing nor false, else 0."""
    coefficient = term.coefficient

    def value(view: View) -> Fraction:
        return term.value(view) if at(tree, view) else ZERO

    def scaled(view: View) -> Fraction:
        assert coefficient is not None
        return coefficient(view) if at(tree, view) else ZERO

    return replace(term, value=value, coefficient=scaled if coefficient is not None else None)


def _deadline_ns(space: Space, thread: Component, view: View) -> int:
    """The deadline of a thread as the designs have it; one without is never late.

    Where only stated deadlines count a thread without one has none, else its period.
    """
    deadline = at(thread.deadline_ns, view) if space.deadlines == "stated" else deadline_ns(thread, view)
    return UNBOUNDED_NS if deadline is None else deadline


def excess(space: Space, limit: Limit) -> Measure:
    """The excess of a design over a limit, in the measure's unit: positive when violated.

    Leaves out the limit per thread. The sign is such that less is better for ``<=`` and ``<`` as well as for ``>=``
    and ``>``.
    """
    sign = 1 if limit.requirement.operator in ("<=", "<", "==") else -1
    measure = limit.measure
    bounds = {limit_case.value for limit_case in tabulate(space, limit.bound, MANY_CASES) or []}
    scale = lcm(measure.scale, *(bound.denominator for bound in bounds))
    terms = [scaled_term(term, Fraction(sign)) for term in measure.terms]
    terms.append(Term("limit", lambda view: -sign * limit.bound(view)))
    too_fine = measure.rounded or scale > SCALE_LIMIT
    return Measure(measure.metric, measure.unit, tuple(terms), min(scale, SCALE_LIMIT), rounded=too_fine)


def thread_values(limit: Limit, view: View, threads: Collection[str] | None = None) -> dict[str, Fraction]:
    """The use of each thread that counts in a limit on single cores, in a design and in the measure's unit.

    Names to exact shares. `threads` restricts the names; a limit that is not about cores gives an empty mapping.
    """
    return {
        name: exact_sum(term.value(view) for term in terms)
        for name, terms in limit.alone.items()
        if threads is None or name in threads
    }


def _thread_loads(terms: tuple[Term, ...]) -> dict[str, list[Term]]:
    """Utilisation terms by thread: a hybrid thread's callback and timer together."""
    grouped: dict[str, list[Term]] = {}
    for term in terms:
        grouped.setdefault(term.component, []).append(term)
    return grouped


def comparisons(limit: Limit, view: View) -> Iterator[ComparedSum]:
    """Everything that a requirement compares in a design: the sum, then each thread and the fullest core.

    `ComparedSum` objects; the requirement holds when each of them does.
    """
    loads = thread_values(limit, view)
    yield from sum_comparisons(limit, view, loads)
    if limit.cores is not None:
        yield core_comparison(limit.cores, loads, view)


def sum_comparisons(limit: Limit, view: View, loads: Mapping[str, Fraction] | None = None) -> Iterator[ComparedSum]:
    """The sum, then each thread; `loads` are what `thread_values` finds, where that is known.

    Without the fullest core, whose load takes a partition of threads to compute.
    """
    if limit.cores is None:
        yield ComparedSum(limit.measure.value(view), limit.bound(view))
        return
    loads = thread_values(limit, view) if loads is None else loads
    yield ComparedSum(exact_sum(loads.values()), limit.bound(view))
    for name, load in loads.items():
        yield ComparedSum(load, limit.cores.most, thread=name)


def core_comparison(cores: EachCore, loads: Mapping[str, Fraction], view: View) -> ComparedSum:
    """The load of the fullest core; where no partition keeps the limit, as first-fit leaves it.

    In ppm of one core: the least possible load of the fullest core, by complete search within an effort limit
    (`spread`).
    """
    used = on_processor(cores.space, cores.processor, loads, view)
    assignment = spread(cores.space, cores.processor, used, view, cores.room)
    value = ZERO if assignment.status == "undecided" else assignment.loads[assignment.fullest - 1] * PPM
    return ComparedSum(value, cores.most, core=assignment.fullest, spread=assignment)


def keeps_cores(limit: Limit, view: View, threads: Collection[str] | None = None) -> bool:
    """Whether every core keeps a limit: some partition does, or nothing was found against it.

    With `threads` whether it does where these alone run on the processor.
    """
    if limit.cores is None:
        return True
    return _fits_on_cores(limit, limit.cores, thread_values(limit, view, threads), view)


def _fits_on_cores(limit: Limit, cores: EachCore, loads: Mapping[str, Fraction], view: View) -> bool:
    """Whether a limit is kept, or nothing is found against it, where threads use what `loads` says."""
    comparison = core_comparison(cores, loads, view)
    return HOLDS[limit.requirement.operator](comparison.value, comparison.bound)


def too_many(limit: Limit, view: View) -> tuple[str, ...]:
    """Threads for which a processor has no partition, in a design in which a limit on its cores is not kept.

    None of them can be left out. All of the processor are named where the cores of some are not open, for then fewer
    threads may need more room, and where they are more than `MOST_LEFT_OUT`.
    """
    assert limit.cores is not None
    space, processor = limit.cores.space, limit.cores.processor
    loads = thread_values(limit, view)
    used = on_processor(space, processor, loads, view)
    threads = [space.components[number].name for number in used]
    if asks_for_first_fit(space, used) or len(threads) > MOST_LEFT_OUT:
        return tuple(threads)
    for name in sorted(threads, key=lambda name: loads[name]):
        others = [other for other in threads if other != name]
        if not _fits_on_cores(limit, limit.cores, {other: loads[other] for other in others}, view):
            threads = others
    return tuple(threads)


def on_processor(space: Space, processor: int, loads: Mapping[str, Fraction], view: View) -> dict[int, Fraction]:
    """The share of a core that each thread on a processor uses, by its number; `loads` are in ppm, by name.

    Component indices to fractions of a core, for the threads that run on `processor` in the design.
    """
    return {
        number: loads[item.name] / PPM
        for number, item in enumerate(space.components)
        if item.name in loads and at(item.processor, view) == processor
    }


def needed_share(limit: Limit, view: View, *, of_total: bool = False) -> tuple[Fraction, str]:
    """The share at which a design just keeps a limit of the whole (100 %), and the thread or core that alone needs it.

    With `of_total` the sum alone counts.
    """
    loads = thread_values(limit, view)
    whole, *threads = sum_comparisons(limit, view, loads)
    needed, who = whole.value / whole.bound, ""
    if of_total or limit.cores is None:
        return needed, who
    for item in threads:
        if item.value / item.bound > needed:
            needed, who = item.value / item.bound, _sharing(limit, item.thread, view)
    space, processor = limit.cores.space, limit.cores.processor
    even = even_spread(space, processor, on_processor(space, processor, loads, view), view)
    peak = even.loads[even.fullest - 1] * PPM / limit.cores.most
    return (peak, core_words(even)) if peak > needed else (needed, who)


def _sharing(limit: Limit, thread: str, view: View) -> str:
    """A thread, or the executor in which it is with others, that needs a core for all of them; "" for none."""
    if not thread or limit.cores is None:
        return thread
    space, loads = limit.cores.space, limit.alone[thread]
    number = next(number for number, item in enumerate(space.components) if item.name == thread)
    executor = at(space.components[number].executor, view)
    is_shared = executor is not None and len({term.label for term in loads}) > 1
    return f"executor {space.executors[executor].name}" if executor is not None and is_shared else thread


def core_words(assignment: Spread) -> str:
    """The fullest core in words: its number where every core is stated or decided.

    With open cores the number has no meaning, because equal cores are interchangeable.
    """
    return FULLEST if assignment.is_open else f"core {assignment.fullest}"


def judge(limit: Limit, view: View, value: Exact | None = None) -> Verdict:
    """The verdict on a design, with the figures of what is tightest: the sum, a core, or a thread that breaks a limit.

    Of threads without a core another partition could use the fullest core less: it counts where it alone is broken.
    `value` is the sum where that is known, and no core is limited.
    """
    requirement, compare = limit.requirement, HOLDS[limit.requirement.operator]
    known = [] if value is None else [ComparedSum(ZERO + value, limit.bound(view))]
    whole, *parts = known or comparisons(limit, view)
    broken = [item for item in (whole, *parts) if not compare(item.value, item.bound)]
    shown = broken or [whole, *(item for item in parts if item.core)]
    sure = [item for item in shown if item.spread is None or not item.spread.is_open]
    decisive = max(sure or broken, key=lambda item: item.value / (item.bound or 1))
    return Verdict(
        requirement,
        decisive.value,
        decisive.bound,
        whole.bound,
        limit.measure.unit,
        compare(decisive.value, decisive.bound),
        worst_term=_sharing(limit, decisive.thread, view),
        worst_core=decisive.core,
        spread=parts[-1].spread if parts else None,
    )
