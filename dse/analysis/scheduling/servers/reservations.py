"""Reservations: threads that share a budget of their core's time in each period, and what that is to others.

*To its threads* a reservation is a supply. Wherever they have work to do, a budget Q of each period P is theirs, at an
unknown place in it: in the worst case they have just missed one and get the next at its very end, so that in no less
than t they get

    sbf(t) = max over n >= 0 of max(0, n * Q, t - 2 * (P - Q) - n * (P - Q)) while that is below (n + 1) * Q

(the periodic resource model of I. Shin and I. Lee, "Periodic resource model for compositional real-time guarantees",
RTSS 2003; the same as G. Lipari and E. Bini, "Resource partitioning among real-time applications", ECRTS 2003). What
they do not get, t - sbf(t), is the work in a busy period of length t of a task of P - Q every P with a jitter of Q: the
times at which the supply has caught up with the demand are the same, so that response times under a supply are those
behind such a task (`supply_gaps`). By their priorities, or executors, they go one before another in there.

*To others* it is a task of Q every P. Its threads may want the budget at any time of a period as long as there is
some left (a deferrable server: J. K. Strosnider, J. P. Lehoczky and L. Sha, "The deferrable server algorithm for
enhanced aperiodic responsiveness in hard real-time environments", IEEE Transactions on Computers 44(1), 1995), so that
it is up to P - Q late (R. I. Davis and A. Burns, "Hierarchical fixed priority pre-emptive scheduling", RTSS 2005).

The supply is one only where the budget is there in each period: where a job of Q ends within P behind all that may
delay the reservation. Else nothing in it has a bound. (docs/semantics.md, section 4.8)
"""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.scheduling.overheads import switching_ns
from dse.analysis.scheduling.response_time import Stream, Task, periodic, response_time_ns
from dse.analysis.scheduling.turns import Turn
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at

Given = Sequence["Task | None"]


def supply_gaps(name: str, budget_ns: int, period_ns: int) -> Task:
    """What a supply leaves out, as a task that goes before all that it is for.

    Examples
    --------
    3 of every 5: nothing for 4, then 3, then nothing for 2; 4 are there after 4 + 3 + 2 + 1 = 10.

    >>> gaps = supply_gaps("r", 3, 5)
    >>> [response_time_ns(Task("", work, ()), [gaps]) for work in (1, 3, 4)]
    [5, 7, 10]
    """
    return periodic(gaps_name(name), period_ns - budget_ns, period_ns, budget_ns)


def gaps_name(name: str) -> str:
    """What the times without the budget of a reservation are called."""
    return f"no budget of {name}"


def server(name: str, budget_ns: int, period_ns: int, switching: int = 0) -> Task:
    """A reservation as others on its core see it: a budget in each period, with the switches to it and back."""
    return Task(name, budget_ns + switching, (Stream(period_ns, period_ns - budget_ns),))


def before_task(
    space: Space, turns: Sequence[Turn], turn: Turn, tasks: Given, interrupts: Sequence[Task], view: View
) -> list[Task | None]:
    """What goes before a task of a core beside its rivals there (`Turn.rivals`); None stands for what has no bound.

    `turns` and `tasks` are those of its core. That is interrupts and reservations; in a reservation what its supply
    leaves out, as long as it has one.
    """
    others = [_server_of(space, number, turns, view) for number in turn.reservations(turns)]
    if turn.reservation is None:
        return [*interrupts, *others]
    mine = space.reservations[turn.reservation]
    budget, period = at(mine.budget_ns, view), at(mine.period_ns, view)
    given = [*interrupts, *others, *(tasks[position] for position in turn.outside(turns))]
    rivals = [item for item in given if item is not None]
    job = Task(mine.name, budget + switching_ns(space, turn.key[0], view), ())
    end = response_time_ns(job, rivals, turn.blocked_ns) if len(rivals) == len(given) else None
    return [supply_gaps(mine.name, budget, period) if end is not None and end <= period else None]


def _server_of(space: Space, number: int, turns: Sequence[Turn], view: View) -> Task:
    item = space.reservations[number]
    switching = switching_ns(space, next(turn.key[0] for turn in turns if turn.reservation == number), view)
    return server(item.name, at(item.budget_ns, view), at(item.period_ns, view), switching)


def blocking_ns(turn: Turn) -> int:
    """How long less urgent work may keep a task waiting; in a reservation its supply holds whatever blocks that."""
    return turn.blocked_ns if turn.reservation is None else 0
