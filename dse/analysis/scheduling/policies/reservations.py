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

from dse.analysis.scheduling.busy_window import Stream, Task, periodic, response_time_ns
from dse.analysis.scheduling.model import Entry, Resource, Server


def supply_gaps(name: str, budget_ns: int, period_ns: int) -> Task:
    """The gaps in the supply of a reservation, as a task that delays all threads of the reservation.

    Examples
    --------
    3 of every 5: nothing for 4, then 3, then nothing for 2; 4 are there after 4 + 3 + 2 + 1 = 10.

    >>> gaps = supply_gaps("r", 3, 5)
    >>> [response_time_ns(Task("", work, ()), [gaps]) for work in (1, 3, 4)]
    [5, 7, 10]
    """
    return periodic(_gaps_name(name), period_ns - budget_ns, period_ns, budget_ns)


def _gaps_name(name: str) -> str:
    """What the times without the budget of a reservation are called."""
    return f"no budget of {name}"


def server(name: str, budget_ns: int, period_ns: int, switching: int = 0) -> Task:
    """A reservation as others on its core see it: a budget in each period, with the switches to it and back.

    A periodic task of the budget with a jitter of period less budget, since the budget may be used at any time in the
    period.
    """
    return Task(name, budget_ns + switching, (Stream(period_ns, period_ns - budget_ns),))


def gaps_and_servers(resource: Resource, entry: Entry, tasks: Sequence[Task | None]) -> list[Task | None]:
    """The interrupts and reservations that delay a stage besides its rivals; None stands for one without a bound.

    That is interrupts and reservations; in a reservation what its supply leaves out, as long as it has one.
    """
    if entry.reservation is None:
        return [*resource.interrupts, *(_server_task(resource.servers[number]) for number in entry.servers)]
    mine = resource.servers[entry.reservation]
    return [supply_gaps(mine.name, mine.budget_ns, mine.period_ns) if is_served(resource, entry, tasks) else None]


def is_served(resource: Resource, entry: Entry, tasks: Sequence[Task | None]) -> bool:
    """Whether the budget of the reservation of a stage is there in each period behind what goes before that.

    Judged by the response time of the whole budget with its switches, against the period.
    """
    assert entry.reservation is not None
    mine = resource.servers[entry.reservation]
    others = [_server_task(resource.servers[number]) for number in entry.servers]
    given = [*resource.interrupts, *others, *(tasks[position] for position in entry.outside)]
    rivals = [item for item in given if item is not None]
    if len(rivals) < len(given):
        return False
    end = response_time_ns(Task(mine.name, mine.budget_ns + mine.switching_ns, ()), rivals, entry.blocked_ns)
    return end is not None and end <= mine.period_ns


def _server_task(item: Server) -> Task:
    return server(item.name, item.budget_ns, item.period_ns, item.switching_ns)
