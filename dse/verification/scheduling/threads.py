"""Each thread as diagrams: its execution time, separation, turn, priority and core, which its waiting follows from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial
from math import ceil, floor
from typing import Any

from dse.analysis.limits import Limit
from dse.analysis.rates import NS_PER_S, rate_hz
from dse.analysis.scheduling.priorities import number_of, order_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS
from dse.analysis.scheduling.tasks import work_ns
from dse.analysis.views import View
from dse.space.architecture.joins import may_join
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.space.model.trees import leaves as leaves_of
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, leaves
from dse.verification.sums import Waits

NEVER = Fraction(UNBOUNDED_NS) ** 2
"""The turn of a thread that has none."""
Defined = Callable[[Diagram, str], None]
"""Demands that a diagram has a value in every design; with what it is of."""


def is_simple(component: Component) -> bool:
    """Whether the jobs of a thread can be counted: it is an OS thread with jobs of one kind."""
    is_hybrid = "hybrid" in set(leaves_of(component.protocol)) and (
        component.callback_ns is not None or may_join(component)
    )
    return component.processor is not None and component.is_lone and not is_hybrid


def has_number(component: Component) -> bool:
    """Whether a thread has a priority number, stated or decided."""
    return any(isinstance(leaf, int) for leaf in leaves_of(component.priority))


def place_of(space: Space, number: int, view: View) -> int:
    """A number for the core that a thread runs on: the same for two threads only where they share one.

    Negative where it runs on none, or where first-fit decides.
    """
    component = space.components[number]
    processor, core = at(component.processor, view), at(component.core, view)
    if processor is None:
        return -1 - number
    if core is None:
        if at(space.processors[processor].cores, view) > 1:
            return -1 - number
        core = 1
    most = max(count for slot in space.processors for count in leaves_of(slot.cores))
    return int(processor * (most + 1) + core)


def waits_of(make: Diagrams, defined: Defined, threads: Iterable[int], late: Sequence[Limit], scale: int) -> Waits:
    """The data from which the waiting of threads follows, in 1 / `scale` ns; `late` are limits on response times."""
    space, wanted = make.space, set(threads)
    simple = [number for number, item in enumerate(space.components) if is_simple(item)]
    orders = {number: _turns(make, number) for number in simple if not has_number(space.components[number])}
    listed = sorted({leaf for diagram in orders.values() for leaf in leaves(diagram)}, reverse=True)

    def separation(rate: Any) -> int:
        return ceil(NS_PER_S * scale / rate) if rate and rate is not NO_DESIGN else 2 * UNBOUNDED_NS * scale

    places = places_of(make, defined)
    return Waits(
        space=space,
        scale=scale,
        threads=tuple(sorted(wanted)),
        works={number: _works(make, number) for number in simple},
        ranks={number: make.mapped(found, listed.index) for number, found in orders.items()},
        separations={number: make.mapped(rate_of(make, number), separation) for number in simple},
        places={number: places[number] for number in simple},
        priorities={number: _priorities(make, number) for number in simple if number not in orders},
        latest={
            limit.requirement.metric.index or 0: _latest(make, limit, scale)
            for limit in late
            if limit.requirement.metric.index in wanted & set(simple)
        },
    )


def rate_of(make: Diagrams, number: int) -> Diagram:
    """The rate (Hz) at which a component is released."""
    formula = partial(rate_hz, make.space, ("activation", number))
    return make.diagram(formula, f"the rate of {make.space.components[number].name}")


def _turns(make: Diagrams, number: int) -> Diagram:
    """The time that orders a thread in ns, the shorter first."""

    def order(view: View) -> Fraction:
        found = order_ns(make.space, number, view)
        return NEVER if found is None else found

    found = make.diagram(order, f"the turn of {make.space.components[number].name}")
    return make.mapped(found, lambda leaf: NEVER if leaf is NO_DESIGN else leaf)


def _priorities(make: Diagrams, number: int) -> Diagram:
    component = make.space.components[number]
    found = make.diagram(partial(number_of, component), f"the priority of {component.name}")
    return make.mapped(found, lambda leaf: leaf if isinstance(leaf, int) else 0)


def _works(make: Diagrams, number: int) -> Diagram:
    name = f"the execution time of {make.space.components[number].name}"
    found = make.diagram(partial(work_ns, make.space, number), name)
    return make.mapped(found, lambda leaf: 0 if leaf is NO_DESIGN else leaf)


def _latest(make: Diagrams, limit: Limit, scale: int) -> Diagram:
    """The time by which a job ends, in the unit of waiting."""
    strict = limit.requirement.operator == "<"

    def count(bound: Any) -> int:
        if bound is NO_DESIGN:
            return 2 * UNBOUNDED_NS * scale
        scaled = Fraction(bound) * scale
        return min(ceil(scaled) - 1 if strict else floor(scaled), 2 * UNBOUNDED_NS * scale)

    return make.mapped(make.diagram(limit.bound, limit.requirement.text), count)


def places_of(make: Diagrams, defined: Defined) -> dict[int, Diagram]:
    """The core of each thread, as a number."""
    found = {}
    for number, component in enumerate(make.space.components):
        if component.processor is not None:
            name = f"the core of {component.name}"
            diagram = make.diagram(partial(place_of, make.space, number), name)
            defined(diagram, name)
            found[number] = make.mapped(diagram, lambda leaf: -1 if leaf is NO_DESIGN else leaf)
    return found
