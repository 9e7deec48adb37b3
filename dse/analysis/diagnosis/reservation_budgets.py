"""What the budget of a reservation has to do with a thread in it that is late, and which budget would do.

Two things go wrong with a budget: it is too small for what its threads need in time, or so large that it is not there
in each period behind what has priority over the reservation; then nothing in it has a bound (docs/semantics.md,
section 4.8).
Between the two a larger budget never makes a response time longer, so that the least that is enough is found by halves,
and the analysis is asked again with each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

from dse.analysis.scheduling.policies.reservations import is_served
from dse.analysis.scheduling.responses import response_of, solution_of
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.json_fields import FIGURE
from dse.support.units import Exact


@dataclass(frozen=True)
class ReservationBudget:
    """The budget of the reservation that a late thread is in.

    Times in ns; `enough_ns` is found by bisection over the budget with everything else unchanged.
    """

    reservation: Annotated[str, "The reservation."]
    budget_ns: Annotated[int, FIGURE, "Its budget."]
    period_ns: Annotated[int, FIGURE, "The period in which it has that."]
    is_served: Annotated[
        bool, "Whether the budget is there in each period after the threads of higher priority than the reservation."
    ]
    enough_ns: Annotated[
        int | None, FIGURE, "The least budget with which the thread is in time; null where none is enough."
    ]


def budget_of(
    space: Space, number: int, view: View, is_in_time: Callable[[Exact | None], bool]
) -> ReservationBudget | None:
    """The budget of a thread's reservation, and the least with which it is in time; None outside of reservations.

    `number` is the component's index, `is_in_time` judges a response time in ns (None: no bound).
    """
    place = space.components[number].reservation
    if place is None:
        return None
    mine = space.reservations[place]
    budget, period = at(mine.budget_ns, view), at(mine.period_ns, view)

    def changed(budget_ns: int) -> tuple[Space, View]:
        other = replace(mine, budget_ns=budget_ns)
        reservations = (*space.reservations[:place], other, *space.reservations[place + 1 :])
        return replace(space, reservations=reservations), View(view.design)

    def is_too_large(budget_ns: int) -> bool:
        return not _is_served(*changed(budget_ns), number)

    def is_enough(budget_ns: int) -> bool:
        other, seen = changed(budget_ns)
        response = response_of(other, number, "thread", seen)
        return response is not None and is_in_time(response.response_ns)

    most = period if not is_too_large(period) else least(is_too_large, period) - 1
    enough = least(is_enough, most) if most and is_enough(most) else None
    return ReservationBudget(mine.name, budget, period, _is_served(space, view, number), enough)


def _is_served(space: Space, view: View, number: int) -> bool:
    """Whether the budget that a thread is in is there in each period."""
    solution = solution_of(space, view)
    place = solution.system.place((number, "thread"))
    assert place is not None
    resource, position = place
    return is_served(resource, resource.entries[position], solution.windows.tasks(resource))


def least(is_enough: Callable[[int], bool], most: int) -> int:
    """The least number from 1 to `most` that is enough, as `most` is, and all beyond it.

    >>> least(lambda number: number >= 7, 100)
    7
    """
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return high
