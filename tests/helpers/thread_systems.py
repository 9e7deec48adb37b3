"""Random small systems of threads that share cores, as problem files; and their front by looking at every design.

Schedulability is judged here by a response-time iteration of its own, which knows nothing of the product's analysis:
fixed priorities, each core alone, jitter inherited along trigger connections until nothing changes.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from tests.helpers.thread_executors import draw_executors
from tests.helpers.thread_responses import PERIODS, Settled, responses, times_of

KINDS = ("plain", "chained", "stated", "fixed", "blocked", "ordered", "best", "grouped", "joined", "reserved",
         "unequal", "mixed", "late")  # fmt: skip
ORDERS = (None, 1, 2, (1, 3), (2, 1, 3), "rate_monotonic", "deadline_monotonic", "deadline_monotonic",
          ("rate_monotonic", "deadline_monotonic"))  # fmt: skip
LATER_JOBS = """
dse: 1
name: later jobs
processing: response_time
deadlines: all
processor_types: {cpu: {}}
processors: {c: {type: cpu}}
device_types:
  near: {period: 3 ms, latency: 1 ms, price: 30 EUR}
  middle: {period: 3 ms, latency: 2 ms, price: 20 EUR}
  far: {period: 3 ms, latency: 3 ms, price: 10 EUR}
devices: {s: {type: [near, middle, far]}}
threads:
  first: {processor: c, compute_execution_time: 7 ms, period: 20 ms}
  second: {processor: c, compute_execution_time: 3 ms, dispatch_protocol: aperiodic}
  urgent: {processor: c, compute_execution_time: 4 ms, period: [9 ms, 10 ms]}
connections: {w: {from: s, to: first}, v: {from: first, to: second}}
flows: {f: {path: [s, first, second]}}
objectives: [minimise price, minimise latency of f]
"""
"""Three designs of a price and a latency each; events dispatch `second`, whose second job responds last."""


def draw(seed: int, *, kind: str = "plain") -> dict[str, Any]:
    """A system of a kind.

    That is plain, chained (event-triggered threads), stated (priorities, deadlines), fixed (cores), blocked
    (non-preemptive sections, context switches, interrupts and throttling, with some of everything else), ordered
    (every way to say priorities, as decisions too, with event-triggered threads and sections, and few priority levels),
    best (the best order is asked for, with some of that), grouped (executors, with some of all that), joined (which
    executor some threads are in is open), reserved (reservations, with executors and some of all that), unequal (a core
    of the slow computer is slower still), mixed (all of that together, but the best order), or late (chains of threads
    that mostly take a whole job less at least than at most, on one core or two).
    """
    rng = random.Random(f"{kind} {seed}")
    count = rng.randint(2, 3 if kind == "best" else 4)
    cores = 1 if rng.random() < (0.1 if kind == "late" else 0.3) else 2
    types: dict[str, dict[str, Any]] = {
        "slow": {"cores": cores, "price": 10},
        "fast": {"cores": rng.choice((1, cores)), "price": 30},
    }
    threads: list[dict[str, Any]] = []
    shares = {"grouped": 1.0, "joined": 1.0, "reserved": 0.5, "mixed": 0.7}.get(kind)
    executors = draw_executors(rng) if shares is not None and (shares == 1 or rng.random() < shares) else []
    for number in range(count):
        periods = sorted(rng.sample(PERIODS, rng.randint(1, 2)))
        work = rng.randint(1, max(1, periods[0] * rng.randint(3, 9) // 10))
        thread: dict[str, Any] = {
            "name": f"t{number}",
            "periods": periods,
            "slow": work + rng.randint(0, 2),
            "fast": work,
            "trigger": None,
            "both": False,
            "priority": None,
            "deadline": None,
            "core": None,
            "section": None,
            "least": None,
            "executor": None,
            "reservation": None,
            "among": None,
        }
        _draw_sections(rng, kind, thread, executors)
        often = {"chained": 1.0, "blocked": 0.4, "grouped": 0.4, "joined": 0.3, "reserved": 0.4, "mixed": 0.4}.get(
            kind, 0.0
        )
        if often and number and rng.random() < 0.6 * often:
            thread["trigger"] = rng.randrange(number)
            thread["both"] = rng.random() < 0.5
            if rng.random() < 0.4:
                thread["deadline"] = rng.randint(4, 30)
        if kind == "stated":
            thread["priority"] = rng.choice((None, 1, 2, 3))
            thread["deadline"] = rng.choice((None, rng.randint(2, 40)))
        _order(rng, kind, thread, number)
        if kind == "fixed" or (kind == "stated" and rng.random() < 0.2):
            thread["core"] = 1 if cores == 1 or types["fast"]["cores"] == 1 else rng.randint(1, 2)
        threads.append(thread)
    if kind == "blocked" or (kind in ("mixed", "reserved") and rng.random() < 0.4):
        for name in types:
            types[name]["switch"] = rng.choice((0, 0, 1))
            types[name]["interrupts"] = rng.choice(([], [], [(1, 7)], [(1, 9), (1, 30)]))
            types[name]["throttling"] = rng.choice((None, None, (9, 10), (28, 30)))
    if kind in ("unequal", "mixed"):
        types["slow"] |= {"cores": 2, "groups": rng.choice(("{big: 1, little: 1}", "{big: 2}", "{little: 1, big: 1}"))}
        for thread in threads:
            thread["little"] = thread["slow"] + rng.randint(0, 4)
            thread["core"] = rng.choice((None, None, None, 1)) if thread["executor"] is None else None
    if kind in ("ordered", "best", "mixed") and rng.random() < (0.4 if kind == "ordered" else 0.2):
        types["slow"]["levels"] = rng.randint(1, 3)
        types["fast"]["levels"] = rng.choice((None, 2))
    if kind == "late":
        _chain(rng, threads, min(figures["cores"] for figures in types.values()))
    _share(rng, kind, threads, executors)
    _take_no_time(random.Random(f"no time {kind} {seed}"), threads)  # apart from all else
    return {"types": types, "threads": threads}


def _chain(rng: random.Random, threads: list[dict[str, Any]], cores: int) -> None:
    """A long thread, perhaps alone on its core, releases most others, which jobs that are short make late."""
    periods = sorted(rng.sample((10, 12, 15, 20), rng.randint(1, 2)))
    for number, thread in enumerate(threads):
        tenths = rng.randint(2, 5) if number else rng.randint(5, 9)
        work = max(1, periods[0] * tenths // 10)
        thread |= {
            "periods": periods,
            "slow": work + rng.randint(0, 1),
            "fast": work,
            "least": rng.choice((0, 0, 1, None if number else 0)),
        }
        thread["priority"] = rng.choice((None, 1, 2, 3))
        thread["section"] = rng.choice((None, None, None, 1))
        if number and rng.random() < 0.75:
            thread["trigger"] = number - 1 if rng.random() < 0.7 else rng.randrange(number)
        if rng.random() < 0.8:
            thread["core"] = cores if number and (number == 1 or rng.random() < 0.75) else 1


def _take_no_time(rng: random.Random, threads: list[dict[str, Any]]) -> None:
    """In one of five systems some threads take no time, in another one two are alike."""
    case = rng.random()
    if case < 0.2:
        for thread in rng.sample(threads, rng.randint(1, len(threads) - 1)):
            thread |= {key: 0 for key in ("slow", "fast", "little") if key in thread}
    elif case < 0.3:
        one, other = rng.sample(threads, 2)
        other |= {key: one[key] for key in ("periods", "slow", "fast", "little") if key in one}


def _share(rng: random.Random, kind: str, threads: list[dict[str, Any]], executors: list[dict[str, Any]]) -> None:
    if kind == "reserved" or (kind == "mixed" and rng.random() < 0.3):
        _reserve(rng, threads, executors)
    if kind == "joined":
        _join(rng, threads)


def _reserve(rng: random.Random, threads: list[dict[str, Any]], executors: list[dict[str, Any]]) -> None:
    """One or two reservations for some of the threads, and of the executors."""
    found = []
    for number in range(rng.choice((1, 1, 2))):
        period = rng.choice((2, 3, 4, 5, 8))
        budgets = sorted(rng.sample(range(1, period + 1), rng.choice((1, 2))))
        priority = rng.choice((None, None, 1, 3))
        found.append({"name": f"r{number}", "period": period, "budgets": budgets, "priority": priority})
    homes = {executor["name"]: rng.choice((None, *found)) for executor in executors}
    for thread in threads:
        one = homes[thread["executor"]["name"]] if thread["executor"] else rng.choice((None, *found))
        if one is not None:
            thread |= {"reservation": one, "section": None, "core": None}
        thread["periods"] = [2 * period for period in thread["periods"]]


def _join(rng: random.Random, threads: list[dict[str, Any]]) -> None:
    """Two executors, and which of them some threads are in is a decision."""
    executors = [*draw_executors(rng), {"name": "e1", "kind": ("callback_group",), "priority": None}][:2]
    for thread in threads:
        where = rng.choice(("among", "among", "one", "alone"))
        thread["executor"] = rng.choice(executors) if where == "one" else None
        thread["periods"] = [2 * period for period in thread["periods"]]
        if where == "among":
            thread |= {"among": executors, "section": rng.choice((None, 1))}
        if where != "alone":
            thread["priority"] = None


def _order(rng: random.Random, kind: str, thread: dict[str, Any], number: int) -> None:
    """Draw a thread's priority, and what makes it hard to choose one."""
    if kind not in ("ordered", "best", "mixed"):
        return
    if kind != "best":
        if thread["executor"] is None:
            thread["priority"] = rng.choice(ORDERS)
        thread["section"] = rng.choice((None, None, None, 1, 2))
        thread["deadline"] = rng.choice((None, rng.randint(2, 30)))
    else:
        thread["priority"] = "any" if rng.random() < 0.85 else rng.randint(1, 3)
        thread["deadline"] = rng.choice((None, rng.randint(5, 15), rng.randint(10, 30)))
        thread["section"] = rng.choice((None, None, None, 1, 2))
    if number and rng.random() < (0.25 if kind == "ordered" else 0.2):
        thread["trigger"] = rng.randrange(number)


def _draw_sections(rng: random.Random, kind: str, thread: dict[str, Any], executors: list[dict[str, Any]]) -> None:
    """What keeps a thread from running beside more urgent ones."""
    if executors and rng.random() < 0.7:
        thread["executor"] = rng.choice(executors)
    if kind == "blocked" or (kind == "grouped" and rng.random() < 0.3):
        thread["section"] = rng.choice((None, 1, 2, 5))
        thread["priority"] = rng.choice((None, None, None, 1, 2))
    if thread["executor"] is not None and "callback_group" not in thread["executor"]["kind"]:
        thread["priority"] = None


def text_of(
    system: Mapping[str, Any], objectives: tuple[str, ...] = ("minimise price", "minimise latency of f")
) -> str:
    """The problem file: few and cheap computers, and a flow that wants short periods."""
    lines = ["dse: 1", "name: drawn", "overload: allowed", f"deadlines: {system.get('deadlines', 'all')}"]
    lines.append("processing: execution_time")
    lines.append("processor_types:")
    for name, figures in system["types"].items():
        lines.append(f"  {name}: {{{', '.join(_type_fields(figures))}}}")
    lines += ["processors: {c: {type: [slow, fast]}}", "devices: {sensor: {period: 3 ms}}"]
    named = {one["name"]: one for item in system["threads"] for one in item["among"] or [item["executor"]] if one}
    for name, executor in named.items():
        stated = f", priority: {executor['priority']}" if executor["priority"] is not None else ""
        begin = f"executors: {{{name}:" if name == next(iter(named)) else f"  {name}:"
        end = "}" if name == list(named)[-1] else ","
        home = next((item["reservation"] for item in system["threads"] if item["executor"] is executor), None)
        where = "processor: c" if home is None else f"reservation: {home['name']}"
        lines.append(f"{begin} {{kind: [{', '.join(executor['kind'])}], {where}{stated}}}{end}")
    lines += _reservations(system)
    lines.append("threads:")
    for thread in system["threads"]:
        fields = [
            _home(thread),
            f"compute_execution_time: {{{_slow(system, thread)}, fast: {_ms(thread, 'fast')}}}",
        ]
        eager = thread["trigger"] is not None
        if eager:
            fields.append("dispatch_protocol: " + ("[periodic, aperiodic]" if thread["both"] else "aperiodic"))
        if not eager or thread["both"]:
            fields.append(f"period: [{', '.join(f'{period} ms' for period in thread['periods'])}]")
        for key, unit in (("priority", ""), ("core", ""), ("deadline", " ms"), ("section", " ms")):
            if thread[key] is not None:
                word = "non_preemptive" if key == "section" else key
                given = thread[key] if isinstance(thread[key], tuple) else (thread[key],)
                text = ", ".join(f"{item}{unit}" for item in given)
                fields.append(f"{word}: {text}" if len(given) == 1 else f"{word}: [{text}]")
        lines.append(f"  {thread['name']}: {{{', '.join(fields)}}}")
    lines += ["connections:", "  w: {from: sensor, to: t0}"]
    wires = []
    for number, thread in enumerate(system["threads"]):
        if number:
            source = number - 1 if thread["trigger"] is None else thread["trigger"]
            wires.append(f"  w{number}: {{from: t{source}, to: t{number}}}")
    lines += wires
    path = [len(system["threads"]) - 1]
    while path[0]:
        trigger = system["threads"][path[0]]["trigger"]
        path.insert(0, path[0] - 1 if trigger is None else trigger)
    lines += [f"flows: {{f: {{path: [sensor, {', '.join(f't{number}' for number in path)}]}}}}", "objectives:"]
    lines += [f"  - {text}" for text in objectives]
    return "\n".join(lines) + "\n"


def _home(thread: Mapping[str, Any]) -> str:
    if thread["among"]:
        return f"executor: [{', '.join(item['name'] for item in thread['among'])}]"
    if thread["executor"]:
        return f"executor: {thread['executor']['name']}"
    return f"reservation: {thread['reservation']['name']}" if thread["reservation"] else "processor: c"


def _reserved(system: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The reservations that some thread is in, by name."""
    return {item["reservation"]["name"]: item["reservation"] for item in system["threads"] if item["reservation"]}


def _reservations(system: Mapping[str, Any]) -> list[str]:
    lines = ["reservations:"]
    for name, one in _reserved(system).items():
        stated = f", priority: {one['priority']}" if one["priority"] is not None else ""
        budgets = ", ".join(f"{budget} ms" for budget in one["budgets"])
        lines.append(f"  {name}: {{processor: c, budget: [{budgets}], period: {one['period']} ms{stated}}}")
    return lines if len(lines) > 1 else []


def _slow(system: Mapping[str, Any], thread: Mapping[str, Any]) -> str:
    if "groups" not in system["types"]["slow"]:
        return f"slow: {_ms(thread, 'slow')}"
    little = f"slow/little: {_ms(thread, 'little')}, " if "little" in system["types"]["slow"]["groups"] else ""
    return f"{little}slow/big: {_ms(thread, 'slow')}"


def _type_fields(figures: Mapping[str, Any]) -> list[str]:
    fields = [f"cores: {figures.get('groups', figures['cores'])}", f"price: {figures['price']} EUR"]
    if figures.get("levels"):
        fields.append(f"priority_levels: {figures['levels']}")
    if figures.get("switch"):
        fields.append(f"context_switch: {figures['switch']} ms")
    if figures.get("interrupts"):
        named = (
            f"i{number}: {{compute_execution_time: {work} ms, period: {period} ms}}"
            for number, (work, period) in enumerate(figures["interrupts"])
        )
        fields.append(f"interrupts: {{{', '.join(named)}}}")
    if figures.get("throttling"):
        budget, period = figures["throttling"]
        fields.append(f"throttling: {{budget: {budget} ms, period: {period} ms}}")
    return fields


def _ms(thread: Mapping[str, Any], kind: str) -> str:
    most = thread[kind]
    return f"{most} ms" if thread["least"] is None else f"{min(thread['least'], most)} ms .. {most} ms"


def every_choice(system: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Every way to make the decisions: the type, each thread's period (None: dispatched by events), each one's core.

    Where executors of threads are among them, the threads as they then are.
    """
    for chosen in product(*(thread["among"] or [thread["executor"]] for thread in system["threads"])):
        threads = [{**thread, "executor": one} for thread, one in zip(system["threads"], chosen, strict=True)]
        for choice in _choices({**system, "threads": threads}):
            yield {**choice, "threads": threads}


def _choices(system: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    ways = []
    for thread in system["threads"]:
        periods: list[int | None] = [] if thread["trigger"] is not None and not thread["both"] else [*thread["periods"]]
        ways.append(periods + [None] * (thread["trigger"] is not None))
    served = {item["executor"]["name"]: item["executor"]["kind"] for item in system["threads"] if item["executor"]}
    reserved = {name: one["budgets"] for name, one in _reserved(system).items()}
    for kind, figures in system["types"].items():
        cores = [
            [thread["core"]] if thread["core"] is not None else range(1, figures["cores"] + 1)
            for thread in system["threads"]
        ]
        given = [thread["priority"] for thread in system["threads"]]
        stated = [item for item in given if isinstance(item, int)]
        numbers = {item + step for item in stated for step in range(-len(given), len(given) + 1)}
        every = sorted(item for item in numbers if item >= 0) or range(1, len(given) + 1)
        ranks: list[Sequence[int]] = [
            every if item == "any" else item if isinstance(item, tuple) else (item,) for item in given
        ]
        for released in product(*ways):
            for placed in product(*cores):
                if max(placed) <= figures["cores"] and _is_together(system["threads"], placed):
                    ways_on = product(product(*ranks), product(*served.values()), product(*reserved.values()))
                    for chosen, kinds, budgets in ways_on:
                        yield {
                            "type": kind, "periods": released, "cores": placed, "priorities": chosen,
                            "kinds": dict(zip(served, kinds, strict=True)),
                            "budgets": dict(zip(reserved, budgets, strict=True)),
                        }  # fmt: skip


def _is_together(threads: Any, placed: tuple[int, ...]) -> bool:
    """Whether each executor and each reservation has one core."""
    pairs = [(item[key]["name"], core) for key in ("executor", "reservation")
             for item, core in zip(threads, placed, strict=True) if item[key]]  # fmt: skip
    return len(set(pairs)) == len({name for name, _ in pairs})


def is_in_time(system: Mapping[str, Any], choice: Mapping[str, Any]) -> bool:
    """Whether each thread ends by its deadline: the stated one, else (where all count) its period, else any time."""
    return _ends_in_time(system, choice, responses(system, choice))


def _ends_in_time(system: Mapping[str, Any], choice: Mapping[str, Any], found: Sequence[int]) -> bool:
    for number, thread in enumerate(system["threads"]):
        latest = thread["deadline"]
        if latest is None and system.get("deadlines", "all") == "all":
            latest = choice["periods"][number]
        if latest is not None and found[number] > latest:
            return False
    return True


def front(system: Mapping[str, Any], *, by_response: bool = False) -> set[tuple[int, int]]:
    """The non-dominated pairs of price (cents) and latency of the flow (ns), by looking at every choice."""
    path = [len(system["threads"]) - 1]
    while path[0]:
        trigger = system["threads"][path[0]]["trigger"]
        path.insert(0, path[0] - 1 if trigger is None else trigger)
    found: set[tuple[int, int]] = set()
    for choice in every_choice(system):
        if by_response:
            settled = Settled(system, choice)
            times = [min(item, 10**8) for item in settled.known]
            work = times_of(system, choice)
            latency = sum(_takes(row, settled, times, work) for row in _rows(path, choice))
        else:
            times = times_of(system, choice)
            latency = sum(times[number] for number in path)
        latency += sum(choice["periods"][number] or 0 for number in path)
        pair = (system["types"][choice["type"]]["price"] * 100, latency * 10**6)
        if pair not in found and (_ends_in_time(system, choice, times) if by_response else is_in_time(system, choice)):
            found.add(pair)
    return {one for one in found if not any(o != one and o[0] <= one[0] and o[1] <= one[1] for o in found)}


def _takes(row: Sequence[int], settled: Settled, times: Sequence[int], work: Sequence[int]) -> int:
    """How long a part of a flow takes: for each thread how much longer the chain takes with it, or its own time.

    What the chain takes up to a thread is no more than what it takes up to one behind it, less the work from there on.
    """
    ends: list[int] = []
    for place in reversed(range(len(row))):
        now = settled.chains.bound(row[: place + 1], times)
        ends.insert(0, min(now, ends[0] - work[row[place + 1]]) if ends else now)
    steps = zip(row, [0, *ends], ends, strict=False)
    return sum(times[number] if max(now, before) >= 10**8 else now - before for number, before, now in steps)


def _rows(path: Sequence[int], choice: Mapping[str, Any]) -> list[list[int]]:
    """A path in parts, each of which begins with a timer."""
    found: list[list[int]] = []
    for number in path:
        if choice["periods"][number] is None and found:
            found[-1].append(number)
        else:
            found.append([number])
    return found
