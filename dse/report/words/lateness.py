"""Why threads are late, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dse.analysis.diagnosis.flow_delays import Delayed, FlowWait
from dse.analysis.diagnosis.lateness import Full, Late
from dse.analysis.diagnosis.overloads import Overload
from dse.analysis.diagnosis.reservation_budgets import ReservationBudget
from dse.analysis.diagnosis.shortening import Shorter
from dse.analysis.scheduling.parts import Delay
from dse.analysis.scheduling.waits import Wait
from dse.analysis.terms import PPM
from dse.answers.tables.display import readable
from dse.report.amounts import listed
from dse.support.units import Exact
from dse.support.units.text import count_words

DIGITS = 6
MOST_SHORTER = 4
"""The greatest number of cuts that are told of one thread; the smallest of those that are not its own."""
MOST_WAITING = 3
"""The greatest number of threads that are told to wait in a flow; those that wait longest."""
MOST_USERS = 6
"""The greatest number of threads that are told to use a core; those that use most."""
MOST_DELAYS = 6
"""The greatest number of threads that are told to go before another at one place; those that take longest."""


def late_words(late: Late) -> str:
    """The reason why a thread is late, and the shorter times that would be enough.

    ``b ends 4 ms late on core 1 of p: 8 ms of its own, behind 2 jobs of a (8 ms); in time with 4 ms less of b each
    time, or 2 ms less of a``.
    """
    where = _place(late.processor, late.core, is_served=late.processor in (late.executor, *late.accelerators))
    begin = f"{late.thread} has no bound" if late.limit_ns is None else f"{late.thread} ends late without a bound"
    if late.late_ns is not None:
        return f"{late.thread} ends {_time(late.late_ns)} late {where}: {_work(late)}{_behind(late)}{_enough(late)}"
    if late.endless and (late.budget is None or late.budget.is_served):
        have = "has" if len(late.endless) == 1 else "have"
        because = f"because {listed(late.endless)} {have} none"
        return f"{begin} {where} {because}{_enough(late)}"
    return f"{begin} {where}: {_why_endless(late)}{_enough(late)}"


def _work(late: Late) -> str:
    """The thread's own work, and whether it alone exceeds the limit."""
    text = f"{_time(late.work_ns)} of its own"
    if late.limit_ns is None or not late.is_late_alone:
        return text
    return f"{text}, more than its {_time(late.limit_ns)} even by itself"


def _behind(late: Late) -> str:
    """The waits of a late thread, for each core and accelerator."""
    waits = list(_wait_words(late.waits, told=bool(late.has_segments)))
    return f", behind {'; '.join(waits)}" if waits else ""


def _why_endless(late: Late) -> str:
    """The reason why a response time is unbounded although all threads of higher priority have bounds."""
    if late.budget is not None:
        has = f"{_time(late.budget.budget_ns)} of every {_time(late.budget.period_ns)}"
        if late.budget.is_served:
            return f"it and the threads of higher priority need more than {late.budget.reservation} has, {has}"
        return f"{late.budget.reservation} does not get its {has} after the threads of higher priority"
    if late.is_late_alone and not late.has_segments:
        return _work(late)
    alone = f"{_work(late)}; " if late.is_late_alone else ""
    if late.full is not None:
        never = ", so that what comes late is never made up for" if late.full.share_ppm == PPM else ""
        return f"{alone}it and the threads of higher priority need {_full(late.full)}{never}"
    if late.has_segments and late.ends_ns is not None and late.apart_ns is not None:
        end = f"a job would end {_time(late.ends_ns)} after its release, at the least"
        return (
            f"{_work(late)}{_behind(late)}: {end}, and has to end before the next one, {_time(late.apart_ns)} after it"
        )
    if late.has_segments:
        return f"{alone}with what its pieces wait for, a job of it need not end before its next one comes"
    return (
        f"{alone}it and the threads of higher priority fit on the core, but the later it ends, the closer together "
        "come the jobs that it waits for"
    )


def _full(full: Full) -> str:
    return f"{_share(full.share_ppm)} of {_named(full.processor, full.core, is_served=full.is_served)}"


def _named(processor: str, core: int, *, is_served: bool) -> str:
    return processor if is_served else f"core {core} of {processor}"


def _place(processor: str, core: int, *, is_served: bool) -> str:
    return f"on {_named(processor, core, is_served=is_served)}"


def _wait_words(waits: Sequence[Wait], *, told: bool) -> Iterator[str]:
    """What goes before jobs, place by place, where something does; where it does so is `told`.

    ``1 job of a (2 ms), 3 jobs of b (6 ms) on g``.
    """
    places: dict[tuple[str, int, bool], list[Wait]] = {}
    for item in waits:
        places.setdefault((item.processor, item.core, item.is_served), []).append(item)
    for (processor, core, is_served), here in places.items():
        parts = list(_parts(here))
        if parts:
            where = f" {_place(processor, core, is_served=is_served)}" if told else ""
            yield f"{', '.join(parts)}{where}{_over(here)}"


def _parts(waits: Sequence[Wait]) -> Iterator[str]:
    earlier = sum(item.earlier_jobs for item in waits)
    if earlier:
        yield f"{count_words(earlier, 'earlier job')} of its own ({_time(sum(item.earlier_ns for item in waits))})"
    delays: dict[str, Delay] = {}
    for item in (one for wait in waits for one in wait.delays):
        before = delays.get(item.name, Delay(item.name, 0, 0))
        delays[item.name] = Delay(item.name, before.jobs + item.jobs, before.work_ns + item.work_ns)
    longest = sorted(delays.values(), key=lambda item: -item.work_ns)[:MOST_DELAYS]
    for item in (item for item in delays.values() if item in longest):
        yield f"{count_words(item.jobs, 'job')} of {item.name} ({_time(item.work_ns)})"
    others = [item for item in delays.values() if item not in longest]
    if others:
        jobs, work = sum(item.jobs for item in others), sum(item.work_ns for item in others)
        yield f"{count_words(jobs, 'job')} of {len(others)} others ({_time(work)})"
    for name in dict.fromkeys(item.blocked_by for item in waits if item.blocked_ns):
        blocked = [item.blocked_ns for item in waits if item.blocked_by == name and item.blocked_ns]
        times = f"{len(blocked)} times the" if len(blocked) > 1 else "the"
        yield f"{times} {_time(sum(blocked))} section of {name} that has begun"


def _over(waits: Sequence[Wait]) -> str:
    """The part of the waits that is over when the thread is released."""
    over = sum(item.over_ns for item in waits)
    return f", of which {_time(over)} are over when it is released" if over else ""


def _enough(late: Late) -> str:
    """The single changes that are enough."""
    enough = shorter_words(late.shorter, late.thread)
    if late.budget is not None and late.budget.enough_ns is not None:
        enough = f"{enough}, or " if enough else ""
        enough += _enough_budget(late.budget)
    return f"; {'bounded' if late.limit_ns is None else 'in time'} with {enough}" if enough else ""


def delayed_words(delayed: Delayed) -> str:
    """The waits of threads that a requirement counts, and the single shorter times that would meet it.

    ``nav waits 4 ms on core 1 of p, behind 1 job of fast (4 ms); latency of f <= 27 ms holds with 2 ms less of fast
    each time``; where no such time is known ``for latency of f <= 27 ms nav waits ...``.
    """
    phrases = []
    for item in delayed.waiting[:MOST_WAITING]:
        behind = "; ".join(_wait_words(item.waits, told=True))
        phrases.append(f"{_who_waits(item)} {_time(item.waited_ns)}{f' behind {behind}' if behind else ''}")
    left = delayed.waiting[MOST_WAITING:]
    phrases += [f"{len(left)} more wait {_time(sum(item.waited_ns for item in left))} in all"] if left else []
    enough = shorter_words(delayed.shorter)
    if not enough:
        return f"for {delayed.requirement} {'; '.join(phrases)}"
    kept = f"{delayed.requirement} holds with {enough}"
    return "; ".join([*phrases, kept])


def _who_waits(item: FlowWait) -> str:
    """``a waits``, or ``a, b and c wait together``."""
    if len(item.threads) == 1:
        return f"{item.threads[0]} waits"
    return f"{', '.join(item.threads[:-1])} and {item.threads[-1]} wait together"


def overload_words(overload: Overload) -> str:
    """The users of an overloaded core or bus, and the threads without a bound because of it.

    ``core 1 of p is used to 105 %, at most 100 %: a 60 %, b 45 %; because of it b has no bound; kept with 1 ms less of
    b each time``.
    """
    shares = [f"{item.thread} {_share(item.share_ppm)}" for item in overload.uses[:MOST_USERS]]
    left = overload.uses[MOST_USERS:]
    shares += [f"{len(left)} more {_share(sum(item.share_ppm for item in left))}"] if left else []
    most = _share(overload.limit_ppm)
    if not overload.core:
        whom = f"the {overload.cores} cores of {overload.processor}"
        if len(overload.uses) == 1:
            return f"{shares[0]} of one core, more than the {most} that {whom} may each be used"
        return f"{listed(shares)} have no partition on {whom} with at most {most} on each"
    where = _named(overload.processor, overload.core, is_served=overload.is_served)
    text = f"{where} is used to {_share(overload.total_ppm)}, at most {most}: {', '.join(shares)}"
    if overload.executor:
        text += f"; those in executor {overload.executor}, which share a core, need more than that by themselves"
    if overload.unbounded:
        have = "has" if len(overload.unbounded) == 1 else "have"
        text += f"; because of it {listed(overload.unbounded)} {have} no bound"
    enough = shorter_words(overload.shorter)
    return f"{text}; kept with {enough}" if enough else text


def _share(share_ppm: Exact) -> str:
    return readable(share_ppm, "ppm", digits=DIGITS)


def shorter_words(shorter: Sequence[Shorter], own: str = "") -> str:
    """Cuts of which each is enough: those of the thread itself first, of others the smallest.

    At most `MOST_SHORTER` cuts, with times as text; the number of further ones is said.
    """
    mine = [item for item in shorter if item.name == own or item.name.startswith(f"{own} (")]
    others = sorted((item for item in shorter if item not in mine), key=lambda item: item.by_ns)
    shown = sorted([*mine, *others][:MOST_SHORTER], key=shorter.index)
    words = [
        f"{_time(item.by_ns)} less of {f'the section of {item.name}' if item.section else f'{item.name} each time'}"
        for item in shown
    ]
    left = len(shorter) - len(shown)
    return ", or ".join(words) + (f" (or of {left} more: --json)" if left else "")


def _enough_budget(budget: ReservationBudget) -> str:
    assert budget.enough_ns is not None
    return f"a budget of {_time(budget.enough_ns)} instead of {_time(budget.budget_ns)} of {budget.reservation}"


def _time(value_ns: Exact) -> str:
    return readable(value_ns, "ns", digits=DIGITS)
