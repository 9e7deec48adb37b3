"""Random small systems of threads with segments, as problem files; and every design of them, judged by hand.

The bounds are those of docs/semantics.md, section 4.7, by an iteration of its own in whole ms: nothing of the
product's analysis is in here.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

LATE = 10**6
"""A time without a bound, in ms."""
PERIODS = (8, 10, 12, 15, 20, 30)
PRICES = {"a": 30, "b": 10}


def draw(seed: int) -> dict[str, Any]:
    """Two to four threads on one or two cores; on one or two accelerators some of their pieces, and whole threads."""
    rng = random.Random(f"segments {seed}")
    accelerators = rng.choice((1, 1, 2))
    threads: list[dict[str, Any]] = []
    for number in range(rng.randint(2, 4)):
        periods = tuple(sorted(rng.sample(PERIODS, rng.randint(1, 2))))
        trigger = rng.randrange(number) if number and rng.random() < 0.25 else None
        kind = rng.choice(("plain", "segments", "segments", "served" if rng.random() < 0.4 else "segments"))
        count = rng.randint(2, 4) if kind == "segments" else 1
        budget = max(count, periods[0] * rng.randint(2, 6) // 10)
        pieces: list[dict[str, Any]] = []
        for position in range(count):
            away = kind == "served" or (kind == "segments" and (position % 2 == 1) != (rng.random() < 0.15))
            work = rng.randint(1, max(1, budget // count))
            slower = rng.choice((0, 0, 1, 3)) if away else 0
            place = rng.randrange(accelerators) if away else None
            least = rng.randint(1, work)
            pieces.append({"place": place, "a": work, "b": work + slower, "best": (least, min(least + slower, work))})
        if kind == "segments" and all(item["place"] is not None for item in pieces):
            pieces[0]["place"], pieces[0]["b"] = None, pieces[0]["a"]
        for item in pieces:
            item["best"] = {
                "a": item["best"][0],
                "b": item["best"][1] if item["place"] is not None else item["best"][0],
            }
        threads.append({
            "periods": periods, "trigger": trigger, "kind": kind, "pieces": pieces,
            "priority": rng.choice((None, None, None, 1, 2)), "core": rng.choice((None, None, None, 1)),
            "deadline": rng.choice((None, None, rng.randint(6, 30))),
        })  # fmt: skip
    orders = {name: rng.choice(("fifo", "priority")) for name in PRICES}
    return {"threads": threads, "cores": rng.choice((1, 2)), "accelerators": accelerators, "orders": orders}


def text_of(system: dict[str, Any], objectives: Sequence[str] = ("minimise price", "minimise latency of f")) -> str:
    """The problem file."""
    lines = ["dse: 1", "name: drawn", "overload: allowed", "deadlines: all", "processing: response_time"]
    lines += ["processor_types:", f"  cpu: {{cores: {system['cores']}}}"]
    lines += [f"  {name}: {{serves: {system['orders'][name]}, price: {price} EUR}}" for name, price in PRICES.items()]
    lines += ["processors:", "  c: {type: cpu}"]
    lines += [f"  g{number}: {{type: [a, b], optional: true}}" for number in range(system["accelerators"])]
    lines += ["devices: {sensor: {period: 3 ms}}", "threads:"]
    for number, thread in enumerate(system["threads"]):
        home = f"g{thread['pieces'][0]['place']}" if thread["kind"] == "served" else "c"
        fields = [f"processor: {home}"]
        if thread["trigger"] is None:
            fields.append(f"period: [{', '.join(f'{period} ms' for period in thread['periods'])}]")
        else:
            fields.append("dispatch_protocol: aperiodic")
        if thread["priority"] is not None:
            fields.append(f"priority: {thread['priority']}")
        if thread["core"] is not None and thread["kind"] != "served":
            fields.append(f"core: {thread['core']}")
        if thread["deadline"] is not None:
            fields.append(f"deadline: {thread['deadline']} ms")
        if thread["kind"] == "segments":
            fields.append(f"segments: [{', '.join(f'{{{_piece(item)}}}' for item in thread['pieces'])}]")
        else:
            fields.append(_piece({**thread["pieces"][0], "named": False}))
        lines.append(f"  t{number}: {{{', '.join(fields)}}}")
    lines += ["connections:", "  w: {from: sensor, to: t0}"]
    path = [len(system["threads"]) - 1]
    for number, thread in enumerate(system["threads"]):
        if number:
            source = number - 1 if thread["trigger"] is None else thread["trigger"]
            lines.append(f"  w{number}: {{from: t{source}, to: t{number}}}")
    while path[0]:
        path.insert(0, _before(system, path[0]))
    lines += [f"flows: {{f: {{path: [sensor, {', '.join(f't{number}' for number in path)}]}}}}", "objectives:"]
    return "\n".join([*lines, *(f"  - {item}" for item in objectives)]) + "\n"


def _before(system: dict[str, Any], number: int) -> int:
    trigger = system["threads"][number]["trigger"]
    return number - 1 if trigger is None else int(trigger)


def _piece(item: dict[str, Any]) -> str:
    if item["place"] is None:
        return f"compute_execution_time: {item['best']['a']} ms .. {item['a']} ms"
    times = ", ".join(f"{name}: {item['best'][name]} ms .. {item[name]} ms" for name in PRICES)
    where = f"processor: g{item['place']}, " if item.get("named", True) else ""
    return f"{where}compute_execution_time: {{{times}}}"


def every_choice(system: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Every type of each accelerator that is used, each period, each core."""
    used = {item["place"] for thread in system["threads"] for item in thread["pieces"]} - {None}
    types = [tuple(PRICES) if number in used else ("none",) for number in range(system["accelerators"])]
    periods = [thread["periods"] if thread["trigger"] is None else (None,) for thread in system["threads"]]
    cores = [
        (None,)
        if thread["kind"] == "served"
        else (thread["core"],)
        if thread["core"]
        else range(1, system["cores"] + 1)
        for thread in system["threads"]
    ]
    for chosen in product(product(*types), product(*periods), product(*cores)):
        yield dict(zip(("types", "periods", "cores"), chosen, strict=True))


class Judge:
    """The ends of all pieces of one design."""

    def __init__(self, system: dict[str, Any], choice: dict[str, Any]) -> None:
        self.threads, self.choice = system["threads"], choice
        self.orders = [system["orders"].get(name, "") for name in choice["types"]]
        self.period = [self._root_period(number) for number in range(len(self.threads))]
        self.keys = [(i, k) for i, thread in enumerate(self.threads) for k in range(len(thread["pieces"]))]
        self.cost = {(i, k): self._time(i, k, "worst") for i, k in self.keys}
        self.best = {(i, k): self._time(i, k, "best") for i, k in self.keys}
        self.span = dict(self.cost)
        self.end = {(i, k): sum(self.cost[i, m] for m in range(k + 1)) for i, k in self.keys}
        for _ in range(300):
            fresh = {key: self._end(*key) for key in self.keys}
            if fresh == self.end:
                break
            self.end = fresh
        else:
            self.end = dict.fromkeys(self.keys, LATE)

    def _root_period(self, number: int) -> int:
        while self.threads[number]["trigger"] is not None:
            number = self.threads[number]["trigger"]
        return int(self.choice["periods"][number])

    def _time(self, i: int, k: int, which: str) -> int:
        piece = self.threads[i]["pieces"][k]
        name = "a" if piece["place"] is None else self.choice["types"][piece["place"]]
        return int(piece["best"][name] if which == "best" else piece[name])

    def _home(self, i: int, k: int) -> Any:
        place = self.threads[i]["pieces"][k]["place"]
        return ("core", self.choice["cores"][i]) if place is None else ("accelerator", place)

    def first(self, i: int) -> int:
        """The jitter of a thread's releases."""
        trigger = self.threads[i]["trigger"]
        if trigger is None:
            return 0
        last = len(self.threads[trigger]["pieces"]) - 1
        if self.end[trigger, last] >= LATE:
            return LATE
        return self.first(trigger) + self.end[trigger, last] - sum(self.best[trigger, m] for m in range(last + 1))

    def jitter(self, i: int, k: int) -> int:
        """The jitter of a piece's releases."""
        if self.threads[i]["kind"] == "segments" and self.response(i) >= LATE:
            return LATE  # the first piece of a job waits for the job before, however late that is
        begin = self.end[i, k - 1] - sum(self.best[i, m] for m in range(k)) if k else 0
        return min(LATE, self.first(i) + begin)

    def _goes_before(self, one: tuple[int, int], other: tuple[int, int]) -> bool:
        """By numbers, equal ones both ways; else by period, then by the order of the file."""
        mine, theirs = (self.threads[item[0]]["priority"] for item in (one, other))
        if mine is not None or theirs is not None:
            return mine is not None and (theirs is None or mine >= theirs)
        return (self.period[one[0]], one) < (self.period[other[0]], other)

    def _end(self, i: int, k: int) -> int:
        pieces = self.threads[i]["pieces"]
        own = self.threads[i]["kind"] == "segments"
        begin = self.end[i, k - 1] if k else 0
        last = self.end[i, len(pieces) - 1]
        others = [key for key in self.keys if key[0] != i and self._home(*key) == self._home(i, k)]
        urgent = [key for key in others if self._goes_before(key, (i, k))]
        alone = own and not any(self._goes_before((i, k), key) for key in urgent)  # nothing waits for its other pieces
        earlier = [key for key in self.keys if key[0] == i and key[1] != k and self._home(*key) == self._home(i, k)]
        if pieces[k]["place"] is None:
            self.span[i, k] = self._run(i, k, [*urgent, *([] if alone else earlier)], self.cost[i, k], alone)
        else:
            self.span[i, k] = self._served(i, k, (others, urgent, earlier), alone)
        if max(begin, last, self.span[i, k], self.first(i)) >= LATE:
            return LATE
        found = begin + self.span[i, k]
        if k and pieces[k]["place"] is None:
            whole = sum(self.cost[i, m] if pieces[m]["place"] is None else self.span[i, m] for m in range(k + 1))
            found = min(found, self._run(i, k, urgent, whole, alone, self.first(i)))
        if own and found > self.period[i] - self.first(i):
            return LATE
        return found

    def _jobs(self, key: tuple[int, int], window: int) -> int:
        return -(-(window + self.jitter(*key)) // self.period[key[0]])

    def _full(self, keys: Sequence[tuple[int, int]]) -> bool:
        """Whether such work never ends; where nothing is left of a core and all is in step it may."""
        load = sum((Fraction(self.cost[key], self.period[key[0]]) for key in keys), Fraction(0))
        return load > 1 or any(self.jitter(*key) >= LATE for key in keys)

    def _is_endless(self, keys: Sequence[tuple[int, int]], blocked: int, single: bool) -> bool:
        """Whether a busy period of an accelerator has no end: it is full, and something comes before its time."""
        load = sum((Fraction(self.cost[key], self.period[key[0]]) for key in keys), Fraction(0))
        return load > 1 or (load == 1 and (single or blocked > 0 or any(self.jitter(*key) for key in keys)))

    def _run(
        self, i: int, k: int, urgent: Sequence[tuple[int, int]], work: int, single: bool, late: int | None = None
    ) -> int:
        """On a core: the jobs of a busy period one after the other, or one job alone; `late` is its jitter."""
        late = self.jitter(i, k) if late is None else late
        if self._full([*urgent, *([] if single else [(i, k)])]) or late >= LATE:
            return LATE
        worst, number, end = 0, 0, 0
        while True:
            number += 1
            while (needed := number * work + sum(self._jobs(key, end) * self.cost[key] for key in urgent)) > end:
                end = needed
                if end > 5_000:
                    return LATE
            if single:
                return end
            worst = max(worst, end - max(0, (number - 1) * self.period[i] - late))
            if end <= max(0, number * self.period[i] - late):
                return worst

    def _served(self, i: int, k: int, given: Sequence[Sequence[tuple[int, int]]], alone: bool) -> int:
        """On an accelerator: in the order of arrival, or the most urgent of those that wait.

        Given are what else it serves, what of that goes first, and the other pieces of the thread.
        """
        others, urgent, earlier = given
        single = self.threads[i]["kind"] == "segments"
        order = self.orders[self.threads[i]["pieces"][k]["place"]]
        if any(self.jitter(*key) >= LATE for key in (others if order == "fifo" else urgent)):
            return LATE  # of what is less urgent one job counts, however often it comes
        if order == "fifo" and single and all(self.threads[key[0]]["kind"] == "segments" for key in others):
            longest: dict[int, int] = {}
            for key in others:
                longest[key[0]] = max(longest.get(key[0], 0), self.cost[key])
            return self.cost[i, k] + sum(longest.values())
        if order == "fifo" and single:
            return self._queued(i, k, others, earlier)
        blocked = max((self.cost[key] for key in others if key not in urgent), default=0)
        if order == "priority" and alone:
            ends = [self._behind(i, k, urgent, blocked)]
            for key in [*earlier, (i, k)] if urgent else ():
                since = max(0, self.period[i] - self.first(i) - self.end[key]) if key[1] >= k else 0
                ends.append(self._behind(i, k, urgent, self.cost[key]) - self.cost[key] - since)
            return max(ends)
        if order == "priority":
            return self._many(i, k, [*urgent, *(earlier if single else ())], blocked)
        return self._many(i, k, others, None)

    def _many(self, i: int, k: int, before: Sequence[tuple[int, int]], behind: int | None) -> int:
        """Job after job of an accelerator's busy period; `behind` may have begun, None in the order of arrival."""
        own, blocked = [(i, k)], behind or 0
        if self._is_endless([*before, *own], blocked, False):
            return LATE

        def came(keys: Sequence[tuple[int, int]], until: int) -> int:
            return sum(self._jobs(key, until + 1) * self.cost[key] for key in keys)

        busy = 1
        while (needed := blocked + came([*before, *own], busy - 1)) > busy:
            busy = needed
            if busy > 5_000:
                return LATE
        if behind is None:
            return max(came([*before, *own], at) - at for at in range(busy))
        worst, number = 0, 0
        while not number or number * self.period[i] - self.jitter(i, k) < busy:
            sooner = int(blocked > 0)  # what has begun has done so a moment sooner
            start = blocked + number * self.cost[i, k]
            while (later := blocked + number * self.cost[i, k] + came(before, start - sooner)) > start:
                start = later
            end = blocked + (number + 1) * self.cost[i, k] + came(before, start - sooner)
            worst = max(worst, end - max(0, number * self.period[i] - self.jitter(i, k)))
            number += 1
        return worst

    def _behind(self, i: int, k: int, urgent: Sequence[tuple[int, int]], begun: int) -> int:
        """By priority: one job alone, where something has begun a moment before all that goes first came."""
        if self._is_endless(urgent, begun, True):
            return LATE
        start = begun
        while True:
            window = start + 1 if not begun else start
            later = begun + sum(self._jobs(key, window) * self.cost[key] for key in urgent)
            if later <= start:
                return start + self.cost[i, k]
            start = later
            if start > 5_000:
                return LATE

    def _queued(self, i: int, k: int, others: Sequence[tuple[int, int]], earlier: Sequence[tuple[int, int]]) -> int:
        """In the order of arrival, each ms at which a piece may come after the accelerator was idle.

        What its own thread ran before has ended by then; what came of others meanwhile has not all run.
        """
        everything = [*others, *earlier, (i, k)]
        if self._is_endless(everything, 0, False):
            return LATE

        def came(keys: Sequence[tuple[int, int]], until: int) -> int:
            return sum(self._jobs(key, until + 1) * self.cost[key] for key in keys)

        worst, at = 0, 0
        while at == 0 or came(everything, at - 1) > at:
            idle = max(0, at - came([*earlier, (i, k)], at) + self.cost[i, k])
            worst = max(worst, came(others, at) - idle)
            at += 1
            if at > 5_000:
                return LATE
        return worst + self.cost[i, k]

    def response(self, i: int) -> int:
        """When the thread ends after its release, `LATE` without a bound."""
        return self.end[i, len(self.threads[i]["pieces"]) - 1]

    def is_in_time(self) -> bool:
        """Whether each thread ends by its deadline, else its period."""
        for i, thread in enumerate(self.threads):
            deadline = thread["deadline"]
            if deadline is None and thread["trigger"] is None:
                deadline = self.period[i]
            if deadline is not None and self.response(i) > deadline:
                return False
        return True


def figures_of(system: dict[str, Any], choice: dict[str, Any]) -> tuple[int, int] | None:
    """Price in EUR and latency in ms of a design; None of one that misses a deadline."""
    judge = Judge(system, choice)
    if not judge.is_in_time():
        return None
    number, latency = len(system["threads"]) - 1, 0
    while True:
        latency += judge.response(number)
        if system["threads"][number]["trigger"] is None:
            latency += judge.period[number]
        if number == 0:
            break
        number = _before(system, number)
    return sum(PRICES.get(name, 0) for name in choice["types"]), min(latency, LATE)


def best_of(points: set[tuple[int, int]]) -> list[tuple[int, int]]:
    """The non-dominated points."""
    return sorted(
        one for one in points
        if not any(other != one and other[0] <= one[0] and other[1] <= one[1] for other in points)
    )  # fmt: skip
