"""Response times in random systems of threads, in whole ms: nothing of the product's analysis is in here.

Fixed priorities, each core alone, jitter inherited along trigger connections until nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from tests.helpers.thread_chains import Comes, Given, OnCore, Stream
from tests.helpers.thread_executors import LATE, MOST_MS, Chains, InExecutor, goes_first, supplied

PERIODS = (4, 5, 6, 8, 10, 12, 15, 20)


def times_of(system: Mapping[str, Any], choice: Mapping[str, Any]) -> list[int]:
    """The execution time of each thread in ms."""
    groups = system["types"][choice["type"]].get("groups", "")
    little = {"{big: 1, little: 1}": 2, "{little: 1, big: 1}": 1}.get(groups)
    return [
        thread["little"] if core == little else thread[choice["type"]]
        for thread, core in zip(system["threads"], choice["cores"], strict=True)
    ]


def responses(system: Mapping[str, Any], choice: Mapping[str, Any]) -> list[int]:
    """The response time of each thread in ms, `LATE` without a bound."""
    return Settled(system, choice).known


class Settled:
    """Response times of a choice, in ms; and the longest times of threads in a row that release each other."""

    def __init__(self, system: Mapping[str, Any], choice: Mapping[str, Any]) -> None:
        self.system, self.choice = {**system, "threads": choice["threads"]}, choice
        self.threads = choice["threads"]
        source = {i: thread["trigger"] for i, thread in enumerate(self.threads) if choice["periods"][i] is None}

        def root(number: int) -> int:
            return root(source[number]) if number in source else number

        self.period = [choice["periods"][root(number)] for number in range(len(self.threads))]
        self.kind = {**system["types"][choice["type"]], "kinds": choice["kinds"], "budgets": choice["budgets"]}
        self.work = times_of(system, choice)
        self.cost = [work + 2 * self.kind.get("switch", 0) for work in self.work]
        self.levels = _levels(self.system, choice, self.period)
        is_alone = [None if thread["reservation"] else not thread["executor"] for thread in self.threads]
        least = [
            work if thread["least"] is None else min(thread["least"], work)
            for thread, work in zip(self.threads, self.work, strict=True)
        ]
        sections = [min(thread["section"] or 0, work) for thread, work in zip(self.threads, self.work, strict=True)]
        figures = (choice["cores"], self.levels[0], self.period, self.cost, least, sections)
        has_one_core = max(each["cores"] for each in system["types"].values()) == 1
        is_limited = any(each.get("levels") for each in system["types"].values())
        is_settled = [
            isinstance(thread["priority"], int) and (has_one_core or thread["core"] is not None) and not is_limited
            for thread in self.threads
        ]
        self.chains = OnCore(source, figures, is_alone, is_settled, [thread["executor"] for thread in self.threads])
        self.known = self._settle()

    def _settle(self) -> list[int]:
        known = list(self.work)
        for _ in range(200):
            jitter = self.chains.jitters(known)
            chains = Chains(self.chains.source, partial(self.chains.least, known=known), self.period, jitter)
            self.kind["chains"] = chains
            fresh = [self._response(number, chains) for number in range(len(known))]
            windows, lags = self.chains.widened(chains, self._rivals)
            if max(fresh) >= 10 * max(PERIODS):
                fresh = [LATE if item >= 10 * max(PERIODS) else item for item in fresh]
            if (fresh, windows, lags) == (known, self.chains.windows, self.chains.lags):
                return known
            known, self.chains.windows, self.chains.lags = fresh, windows, lags
        return [LATE] * len(known)

    def _rivals(self, row: Sequence[int]) -> Given:
        """The threads and reservations that go before some thread of a row, and how long the rest may block it."""
        levels, cores = self.levels[0], self.choice["cores"]
        level = max(levels[item] for item in row)
        here = [item for item in range(len(levels)) if cores[item] == cores[row[0]] and item not in row]
        urgent = [item for item in here if levels[item] <= level]
        homes = [self.threads[item]["reservation"] for item in urgent]
        begun = self._may_have_begun(row, urgent) if len(row) > 1 else []
        urgent = [item for item in urgent if item not in begun]
        sections = [min(self.threads[item]["section"] or 0, self.work[item]) for item in here if levels[item] > level]
        sections += [self.cost[item] for item in begun]
        rivals = [item for item in urgent if self.threads[item]["reservation"] is None and self.cost[item]]
        before = [Stream(work, Comes(*often)) for work, *often in _before_all(self.kind, homes, None)]
        return rivals, before, max(sections, default=0), begun

    def _may_have_begun(self, row: Sequence[int], here: Sequence[int]) -> list[int]:
        """The less urgent threads in the callback group of the least urgent OS thread of a row, if it has one."""
        levels = self.levels[0]
        last = max(row, key=lambda item: levels[item])
        executor = self.threads[last]["executor"]
        if not executor or self.kind["kinds"][executor["name"]] != "callback_group":
            return []
        if any(levels[item] == levels[last] and self.threads[item]["executor"] is not executor for item in here):
            return []
        own = [item for item in row if self.threads[item]["executor"] is executor]
        beside = [item for item in here if self.threads[item]["executor"] is executor]
        return [item for item in beside if not any(self._goes_first(item, each) for each in own)]

    def _goes_first(self, item: int, other: int) -> bool:
        """Whether one of two threads of a callback group goes first, or may."""
        one, two = (self.threads[each]["priority"] for each in (item, other))
        return goes_first(one, two, (self.period[item], item), (self.period[other], other))

    def _response(self, number: int, chains: Chains) -> int:
        cases = self.chains.cases((number,), number, chains)
        if self.threads[number]["executor"]:
            cases = [[self.chains.comes_inside(item, chains) for item in range(len(self.period))]]
        here = [number, *self._rivals([number])[0]]
        if self.chains.over(number, chains) or any(comes[item].has_limit for comes in cases for item in here):
            return self.chains.single(number, chains, self._rivals([number]))
        found = []
        for comes in cases:
            period, jitter = [each.period for each in comes], [each.late for each in comes]
            given = (self.threads, self.levels)
            found.append(_response(number, given, self.choice["cores"], period, jitter, self.work, self.kind))
        return max(found)


def _takes_nothing(kind: Any, work: int) -> bool:
    return not work and not kind.get("switch", 0)


def _response(
    number: int,
    given: tuple[Any, tuple[list[int], list[int]]],
    cores: Any,
    period: list[int],
    jitter: list[int],
    work: list[int],
    kind: Any,
) -> int:
    """Lehoczky's busy period with release jitter, that begins with the longest section of a less urgent thread."""
    threads, (levels, inner) = given
    if _takes_nothing(kind, work[number]):
        return 0  # it waits for nothing
    home = threads[number]["reservation"]
    here = [item for item in range(len(levels)) if cores[item] == cores[number] and item != number]
    urgent = [item for item in here if levels[item] <= levels[number]]
    rivals = [item for item in urgent if threads[item]["reservation"] is None]
    blocked = max(
        (min(threads[item]["section"] or 0, work[item]) for item in here if item not in urgent),
        default=0,
    )
    cost = [item + 2 * kind.get("switch", 0) for item in work]
    rivals = [item for item in rivals if cost[item]]
    first = _before_all(kind, [threads[item]["reservation"] for item in urgent], home)
    supply = None
    if home is not None:
        supply = (kind["budgets"][home["name"]], home["period"])
        wanted = supply[0] + 2 * kind.get("switch", 0) + blocked
        if not _has_budget(
            wanted, home["period"], [(cost[item], period[item], jitter[item]) for item in rivals] + first
        ):
            return LATE
        rivals = [item for item in here if threads[item]["reservation"] is home and inner[item] <= inner[number]]
        rivals = [item for item in rivals if cost[item]]
        blocked, first = 0, []
    if threads[number]["executor"]:
        what = kind["kinds"][threads[number]["executor"]["name"]]
        figures = (period, jitter, cost, blocked, what)
        return InExecutor(number, threads, rivals, first, figures, supply).response(kind["chains"])
    load = sum((Fraction(cost[item], period[item]) for item in (*rivals, number)), Fraction(0))
    load += sum((Fraction(*item[:2]) for item in first), Fraction(0))
    latest = max(blocked, *(jitter[item] for item in (*rivals, number)), *(item[2] for item in first))
    if supply is not None:
        load += Fraction(supply[1] - supply[0], supply[1])
        latest = max(latest, int(supply[0] < supply[1]))
    if load > 1 or latest >= LATE // 2 or (load == 1 and latest):  # then each window has more work than room
        return LATE
    worst, jobs, end = 0, 0, 0
    while True:
        jobs += 1
        end = max(end, jobs * cost[number])
        while True:
            demand = (
                blocked + jobs * cost[number] + sum(-(-(end + late) // every) * taken for taken, every, late in first)
            )
            demand += sum(-(-(end + jitter[item]) // period[item]) * cost[item] for item in rivals)
            if demand <= supplied(supply, end):
                break
            end += 1
            if end > MOST_MS:
                return LATE
        worst = max(worst, end - max(0, (jobs - 1) * period[number] - jitter[number]))
        if end <= max(0, jobs * period[number] - jitter[number]):
            return worst


def _before_all(kind: Any, urgent: Sequence[Any], home: Any) -> list[tuple[int, int, int]]:
    """Work, period and jitter of interrupts, of what throttling takes, and of reservations but one's own."""
    found = [(*item, 0) for item in kind.get("interrupts", [])]
    if kind.get("throttling"):
        budget, every = kind["throttling"]
        found.append((every - budget, every, 0))
    for one in {item["name"]: item for item in urgent if item is not None and item is not home}.values():
        budget = kind["budgets"][one["name"]]
        found.append((budget + 2 * kind.get("switch", 0), one["period"], one["period"] - budget))
    return found


def _has_budget(wanted: int, period: int, before: Sequence[tuple[int, int, int]]) -> bool:
    """Whether so much work is done within a period behind work, period and jitter of what goes before."""
    if max((late for *_, late in before), default=0) >= LATE // 2:
        return False
    ends = range(1, period + 1)
    return any(wanted + sum(-(-(end + late) // every) * taken for taken, every, late in before) <= end for end in ends)


def _levels(system: Mapping[str, Any], choice: Mapping[str, Any], period: list[int]) -> tuple[list[int], list[int]]:
    """The priority level of each thread on its core, 0 the most urgent, the last one for all that are left.

    In a reservation it is that of the reservation; that of the thread in there is the second number.
    """
    most = system["types"][choice["type"]].get("levels") or 10**6
    turns: list[tuple[Any, ...]] = []
    for number, thread in enumerate(system["threads"]):
        priority, own = choice["priorities"][number], choice["periods"][number]
        executor = thread["executor"]
        if executor:
            inside = [item for item, other in enumerate(system["threads"]) if other["executor"] is executor]
            priority = executor["priority"]
            turns.append((1, min(period[item] for item in inside), inside[0]) if priority is None else (0, -priority))
        elif isinstance(priority, int):
            turns.append((0, -priority))
        else:
            late = thread["deadline"] if thread["deadline"] is not None else own
            by_deadline = priority == "deadline_monotonic" and late is not None
            turns.append((1, late if by_deadline else period[number], number))
    inner = [sum(other < turn for other in set(turns)) for turn in turns]
    for number, thread in enumerate(system["threads"]):
        one = thread["reservation"]
        if one is not None:
            first = next(item for item, other in enumerate(system["threads"]) if other["reservation"] is one)
            turns[number] = (1, one["period"], first) if one["priority"] is None else (0, -one["priority"])
    found = []
    for number, turn in enumerate(turns):
        here = {other for other, core in zip(turns, choice["cores"], strict=True) if core == choice["cores"][number]}
        found.append(min(sum(other < turn for other in here), most - 1))
    return found, inner
