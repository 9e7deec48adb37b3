"""A brute-force evaluator of problem files: an independent reading of `docs/problem-file.md` (profile ``dse`` only).

It favours plain arithmetic over speed and imports nothing from `dse`; what designs have in common is found once.

Where the documents leave something open, this is how they are read here:

 1. Decisions are the lists with two or more entries that the design can reach, and ``type`` of every optional slot
    (``none``, then its types).
 2. Options inside types and inside entries of per-processor-type maps form one decision of the component that
    uses them. Its options are all values that some reachable type or entry offers, in file order and however they are
    spelled; an entry with a single value offers just that value (and the decision then has that value). A default (1
    core, no overhead, no fixed time and no time per byte within a transmission time) is no option: where the chosen
    type counts with it the decision is inactive, and rules compare with the default. Inside a map it counts as stated.
 3. A ``period`` counts as an aperiodic one where the protocol is aperiodic, not where none is stated; every decision of
    an empty slot but its type is inactive.
 4. A carrier counts as bound to (so an optional one may not be empty) only when its virtual bus carries a connection.
 5. A response_time replaces the worst execution time in the processing row and in the queue, never in utilisation.
 6. A hybrid component has no queue row. Its callback row precedes its sampling row; there is none when the flow
    starts at it.
 7. Where the path begins with a connection, the component behind it samples: it is not where the flow starts.
 8. An explicit queue of an event-triggered component counts at the start of a flow too (that of the component).
 9. The machine of a virtual bus is the processor of the sending thread, else of the receiving thread; a design in
    which a map has no entry for that machine's type, or a thread none for its processor's type, is invalid.
10. Every member of a stack gives its transmission time, or its latency when it has none; they are added up. The size
    of all of them includes the overheads of the whole stack.
11. A stated data_rate is the load as it stands: overheads are not added to it. With a data_size the connection
    delivers data_rate / data_size messages, without one it delivers at the rate of its sender.
12. Data rates are exact; sizes are whole bytes, rounded up; both parts of a transmission time, and a flow's stated
    latency, are exact.
13. A component that nothing triggers, and a boundary without a rate, have rate 0.
14. A design with any cycle of event-triggered components is invalid, also when a sporadic one or a source is in it. A
    connection that states its rate breaks the cycle; so does a periodic or hybrid component.
15. No core, bandwidth or exclusive bus whose busy time can be computed is used beyond all of it, unless the file or the
    slot says ``overload: allowed``.
    ``utilisation`` with ``>=``, ``>`` or ``==`` compares the sum with limit * cores; ``<=`` and ``<`` ask for each
    core: some way to put the threads on cores keeps the limit on every one. A stated ``core`` stays; of a list one is
    chosen (nothing that is asked here depends on which). An empty slot has utilisation 0 of 1 core.
16. A share of the bandwidth, required of every bus, concerns only those with a bandwidth.
17. A virtual bus type used directly costs its price once when a connection uses it.
18. Rules may also name fixed fields; quantities are compared after their rounding, as options are. A
    type is used when some slot or component has it (or a connection, directly); an empty slot's type is ``none`` and
    known. ``implies`` and ``requires`` bind weaker than ``or``.
19. A bus is busy for its own longest transmission time of each message, with the overheads of the whole stack. Where
    some type has no transmission time, or some connection only a data rate, that is not computable in any design.
20. An objective without a name is about the worst of all candidates. In an extreme (``max``, ``min``) a metric without
    a name that stands alone, perhaps with constants, is every one of its kind; one in a sum must be unmistakable.
    Utilisation counts as it is listed, of one core.
21. ``changes`` counts the decisions with two or more options that the baseline states, that are active in the design,
    and for which it has another option, each as often as ``cost_of_change`` says, else once. Cores are left out.
22. A bus type with a ``frame`` has the times that its messages take on the wire (`wire`), and their load there: the
    longest of them as bytes, times the rate of the messages.
23. A timer keeps its phase to those of the same clock: of one processor, or of processors and devices that name one.
    The times from a release of one to those of the next on a flow are all numbers that differ from the difference of
    their offsets by multiples of the greatest common divisor of the periods; data are read at the first release from
    when they are there. Unknown offsets may be any. A job that does not read at its release may read as late as its
    stated response time, less its longest execution time, allows; flows count from the release of their first.
24. Where flows from timers meet at a timer by different ways, what it reads by one is at most as old as data may be
    when they are read and a period of their first timer, less that of the reader, whose every release reads; at least
    as the way takes. The disparity is the largest difference.
25. A response time is the longest that a job takes in the busiest stretch of its core (`scheduling`): of what a stated
    rate delivers once in each whole ns of 1 / rate, of what nothing dispatches once; a stated response_time changes
    nothing of it, and goes before it in latencies. Threads without a core are where a decision puts them; where none
    does (nothing that is asked depends on it) no response time is told.
26. What an executor runs has its processor and core, and shares that core where it is open. Where a thread chooses its
    executor all open cores are decisions; an executor that no thread of a design is in has none there, and asks for
    none. Among equal turns on a core that thread of it counts that is the first in the file. Of a callback group what
    has begun before does so a moment sooner; of a first-in-first-out queue any of those that come together may be the
    last; in a wait set all others go first. What never waits at the same time (`chains`) has one trigger each, but for
    the first of a chain: a timer, sporadic or with any triggers; a device is none, a thread without a processor may be.
27. A reservation goes by its priority, else by its period; to what it goes before it is a job of its budget each
    period, up to the rest of a period late; in there jobs find nothing for twice that rest, then a budget, and so on.
    That counts where a budget, wanted at the start of a period, is had by its end. Its decisions are always there.
28. A thread with segments is one in its flows and connections, which know its own processor and process; its pieces
    use the processors where they run (`pieces`). What is more urgent than one of them but less than another does not
    exist: all have the priority of the thread. Where one has no bound what stands for that is its end.
    Two releases that streams of two senders bring may come at once: what they release has no bound.
29. Not judged: `priority: any`, priority levels, non-preemptive sections beside executors, reservations or segments,
    context switches, interrupts, throttling, groups of cores (``tests/helpers/thread_systems.py`` has an own reading
    of each of these).
30. Messages wait for a bus (`arbitration`, `buses`) where its types say how it arbitrates and all that may be on it has
    sizes, and identifiers where these decide; senders may queue them as they come (`queues`). Where latencies count no
    response times senders end within what these count of them; else threads and messages are found together. A message
    is late where all that its connection adds to a latency is longer than its deadline.
31. A connection between threads of one processor is on no bus where it states ``local``, or offers physical buses
    alone; its own latency counts all the same, unlike within a process. Its ``bus`` is then no decision.
32. Chains end in all designs at a connection whose messages wait for a bus in some. Whether chains have ended (S) is
    told by response times, not by lags. A stated response time ends windows, but neither chains nor what is over; lags
    count behind it. They do in flows behind the first of a chain where that, or something before it in the flow, is one
    in every design: a device, a timer, what is sporadic or several release. That comes by its streams then, whatever
    its minimum separation is; so does what comes behind a thread in busy windows in which both run, but the first of a
    window keeps its separation. Of a thread that comes once in busy windows it does not matter how late it may be.
    What comes before the thread that a window begins behind comes late by the streams that count there (`successors`),
    whatever priority it states. What is behind it is not late for that. Of several least urgent threads of a window the
    last one is its level.
    Windows and lags that grow without end have no bound where response times have none, beyond ten periods.
33. Lists inside a ``totals`` mapping, and inside a map of a virtual bus per processor type, are not supported here.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

from . import grammar, quantities
from .problem import NONE, Problem, as_list, load_file, load_text, option_value
from .quantities import DATA_RATE, MONEY, NS_PER_S, POWER, RATIO, TIME, Dimension
from .reading import COMPARE, InvalidDesign, Reading

__all__ = [
    "Design",
    "InvalidDesign",
    "Problem",
    "canonical",
    "decisions",
    "designs",
    "dominates",
    "evaluate",
    "evaluated",
    "front",
    "is_met",
    "is_obeyed",
    "load_file",
    "load_text",
    "needed_limit",
    "non_dominated",
    "violations",
]

Design = dict[str, str | None]
BINDINGS = ("type", "process", "executor", "processor", "bus")
"""The fields that say what is where; many designs have them in common."""
CHANGES: Dimension = (("changes", 1),)


def decisions(problem: Problem) -> dict[str, list[str]]:
    """Every decision with its options, components and options in file order."""
    return dict(problem.decisions)


def designs(problem: Problem) -> Iterator[Design]:
    """Every design that obeys the rules, once each: inactive decisions are None. Requirements are not looked at."""
    return (dict(reading.design) for reading in _readings(problem))


def evaluated(problem: Problem) -> Iterator[tuple[Design, dict[str, Any]]]:
    """Every design that obeys the rules with its figures, as `designs` and `evaluate` give them."""
    for reading in _readings(problem):
        yield dict(reading.design), _Figures(problem, reading)


def _readings(problem: Problem) -> Iterator[Reading]:
    order = _decision_order(problem)
    names = list(problem.decisions)
    binding = [decision for _, field, decision in order if field in BINDINGS]
    admitted: dict[tuple[str | None, ...], bool] = {}
    partial: Design = {}
    reading = Reading(problem, partial, complete=False)

    def extend(depth: int) -> Iterator[Reading]:
        if depth == len(order):
            complete = Reading(problem, {decision: partial[decision] for decision in names})
            bindings = tuple([partial[decision] for decision in binding])
            if bindings not in admitted:
                admitted[bindings] = _passes(complete.check_bindings)
            if admitted[bindings] and _passes(complete.check_rest):
                yield complete
            return
        name, field, decision = order[depth]
        try:
            options = _admissible(reading, name, field)
        except InvalidDesign:
            return
        for option in options:
            partial[decision] = option
            if field != "processor" or _processes_agree(reading):
                yield from extend(depth + 1)
            del partial[decision]

    yield from extend(0)


def _passes(check: Callable[[], None]) -> bool:
    try:
        check()
    except InvalidDesign:
        return False
    return True


def _processes_agree(reading: Reading) -> bool:
    """False as soon as the threads bound so far break up a process."""
    homes: dict[str, str] = {}
    for thread, body in reading.problem.sections["threads"].items():
        if "process" not in body:
            continue
        place = reading.place_of(thread)
        slots = as_list(reading.problem.component(place).get("processor"))
        slot = slots[0] if len(slots) == 1 else reading.design.get(f"{place}.processor")
        if slot is not None and homes.setdefault(reading.get(thread, "process"), slot) != slot:
            return False
    return True


def _decision_order(problem: Problem) -> list[tuple[str, str, str]]:
    """Decisions in an order in which each one's activity and options follow from those before it."""

    def stage(name: str, field: str) -> tuple[int, int]:
        section = problem.section_of[name]
        if section in ("devices", "threads") and field in ("type", "process"):
            return (0, 0)
        if field == "executor":
            return (0, 1)
        if field == "processor":
            return (1, 0)
        if field == "bus" and section == "connections":
            return (2, 0)
        if field in ("type", "bus") and name in problem.virtual_slots:
            return (3, problem.virtual_slots.index(name))
        if field == "type":
            return (4, 0)
        return (5, 0) if field == "dispatch_protocol" else (7, 0) if field == "core" else (6, 0)

    split = [(*problem.owner(decision), decision) for decision in problem.decisions]
    return sorted(split, key=lambda item: stage(item[0], item[1]))


def _admissible(reading: Reading, name: str, field: str) -> list[str | None]:
    """The options that may extend a partial design; [None] for an inactive decision."""
    if not reading.is_active(name, field):
        return [None]
    options = reading.admitted(name, field)
    if NONE in reading.problem.types(name) and field == "type":
        return [option for option in options if (option != NONE) == (name in reading.bound())]
    return options


def canonical(problem: Problem, design: Mapping[str, str | None]) -> Design:
    """The design with inactive decisions set to None; raises InvalidDesign when it is none."""
    result: Design = dict.fromkeys(problem.decisions)
    reading = Reading(problem, result, complete=False)
    for name, field, decision in _decision_order(problem):
        options = _admissible(reading, name, field)
        if options != [None]:
            if (chosen := design.get(decision)) is None:
                raise InvalidDesign(f"{decision} is open")
            meant = [
                option
                for option in options
                if option is not None and option_value(field, option) == option_value(field, chosen)
            ]
            if not meant:
                raise InvalidDesign(f"{decision}: {chosen} is not one of {options}")
            result[decision] = meant[0]
    Reading(problem, result).check()
    return result


def evaluate(problem: Problem, design: Mapping[str, str | None]) -> dict[str, Any]:
    """Every figure of a design, exact; raises InvalidDesign when it is none.

    Returns
    -------
    dict
        ``flows``: name -> ``min``, ``max``, ``jitter`` (ns, int) and ``rows`` (component, method, min, max);
        ``utilisation``: processor -> cores (Fraction of one core); ``shares``: processor -> thread -> the same;
        ``cores``; ``rates`` (1/s); ``load``: bus -> B/s; ``load_share``: bus -> share of the bandwidth or None;
        ``busy``: bus -> share of the time, for those of which it can be computed;
        ``price`` (ct), ``power`` (mW) and ``totals``: ``system`` and ``components``; ``metrics``: derived ones in
        ns, nm, B, ct, mW (data rates in B/s); ``violations``: texts; ``objectives``: tuple, maximised ones negated.
    """
    reading = Reading(problem, dict(design))
    reading.check()
    return _Figures(problem, reading)


class _Figures(dict[str, Any]):
    """The figures of a design, each worked out when it is first asked for."""

    def __init__(self, problem: Problem, reading: Reading) -> None:
        self.problem, self.reading = problem, reading

    def __missing__(self, name: str) -> Any:
        figure = self[name] = _FIGURES[name](self.problem, self.reading, self)
        return figure


_FIGURES: dict[str, Callable[[Problem, Reading, Mapping[str, Any]], Any]] = {
    "flows": lambda problem, reading, _: {flow: reading.flow_figures(flow) for flow in problem.paths},
    "responses": lambda _, reading, __: reading.responses(),
    "lateness": lambda _, reading, __: reading.lateness(),
    "disparity": lambda problem, reading, _: {name: reading.disparity(name) for name in problem.meetings},
    "shares": lambda _, reading, __: reading.shares(),
    "utilisation": lambda _, __, so_far: {
        slot: sum(parts.values(), Fraction(0)) for slot, parts in so_far["shares"].items()
    },
    "peak": lambda _, reading, so_far: {slot: reading.peak(slot) for slot in so_far["shares"]},
    "core use": lambda _, reading, so_far: {
        slot: reading.core_use(slot, parts) for slot, parts in so_far["shares"].items()
    },
    "cores": lambda problem, reading, _: {
        slot: int(reading.get(slot, "cores") or 1) for slot in problem.sections["processors"]
    },
    "rates": lambda problem, reading, _: {
        name: reading.rate(name) for section in ("devices", "threads") for name in problem.sections[section]
    },
    "load": lambda _, reading, __: reading.loads(),
    "busy": lambda _, reading, __: reading.busy(),
    "exclusive": lambda _, reading, so_far: {
        bus: share for bus, share in so_far["busy"].items() if reading.is_exclusive(bus)
    },
    "load_share": lambda problem, reading, so_far: {
        bus: None if text is None else so_far["load"][bus] / quantities.bandwidth(text)
        for bus, text in ((bus, reading.bus_field(bus, "bandwidth")) for bus in problem.buses)
    },
    "price": lambda _, reading, __: _amounts(reading, "price"),
    "power": lambda _, reading, __: _amounts(reading, "power"),
    "changes": lambda problem, reading, _: _changes(problem, reading.design),
    "totals": lambda problem, reading, _: {figure: _amounts(reading, figure) for figure in problem.totals},
    "metrics": lambda problem, _, so_far: {
        name: quantities.per_second(*_sum(problem, so_far, terms)) for name, terms in problem.metrics.items()
    },
    "violations": lambda problem, _, so_far: violations(problem, so_far),
    "objectives": lambda problem, _, so_far: tuple(
        objective.sign * quantities.per_second(*_value(problem, so_far, _worst(problem, objective)))
        for objective in problem.objectives
    ),
}


def _changes(problem: Problem, design: Mapping[str, str | None]) -> int:
    """The decisions that differ from the baseline, by what each costs."""
    costs = problem.document.get("cost_of_change", {})
    count = 0
    for name, fields in problem.document.get("baseline", {}).items():
        for field, stated in fields.items():
            decision = f"{name}.{field}"
            chosen = design.get(decision)
            if chosen is None or field == "core" or len(problem.decisions[decision]) < 2:
                continue
            if option_value(field, chosen) != option_value(field, stated):
                count += int(costs.get(name, {}).get(field, 1))
    return count


def _amounts(reading: Reading, figure: str) -> dict[str, Any]:
    components = reading.amounts(figure)
    return {"system": sum(components.values(), Fraction(0)), "components": components}


def _metric(problem: Problem, figures: Mapping[str, Any], name: str, of: str | None) -> tuple[Fraction, Dimension]:
    """A metric in coherent units, and its dimension."""
    if name in problem.metrics:
        return _sum(problem, figures, problem.metrics[name])
    if name in ("price", "power") or name in problem.totals:
        amounts = figures[name] if name in ("price", "power") else figures["totals"][name]
        dimension = {"price": MONEY, "power": POWER}.get(name) or ((problem.totals.get(name, ""), 1),)
        return (amounts["system"] if of is None else amounts["components"][of]), dimension
    if name == "changes":
        return Fraction(figures["changes"]), CHANGES
    of = of if of is not None else _only(problem, name)
    if name == "utilisation" and (named := grammar.core_of(of)) is not None and named[0] is not None:
        return figures["core use"][named[1]][named[0] - 1], RATIO
    if name == "utilisation":
        return figures["utilisation"][of], RATIO
    if name == "load":
        return figures["load"][of] / NS_PER_S, DATA_RATE
    if name == "busy":
        return figures["busy"][of], RATIO
    if name == "disparity":
        return Fraction(figures["disparity"][of]), TIME
    if name == "response time":
        return figures["responses"][of], TIME
    key = {
        "latency": "max", "min latency": "min", "jitter": "jitter", "run jitter": "run", "reaction time": "reaction",
        "data age": "age",
    }[name]  # fmt: skip
    return Fraction(figures["flows"][of][key]), TIME


def _subjects(problem: Problem, metric: str) -> list[str]:
    """The flows, processors or buses that a metric without a name is about."""
    if metric == "utilisation":
        return list(problem.sections["processors"])
    if metric in ("busy", "disparity"):
        return problem.timed_buses if metric == "busy" else list(problem.meetings)
    return problem.buses if metric == "load" else list(problem.paths)


def _only(problem: Problem, metric: str) -> str:
    subjects = _subjects(problem, metric)
    if len(subjects) != 1:
        raise ValueError(f"{metric} of what? one of {subjects}")
    return subjects[0]


def _value(
    problem: Problem, figures: Mapping[str, Any], metric: grammar.Metric | grammar.Extreme
) -> tuple[Fraction, Dimension]:
    """A metric or an extreme in coherent units, and its dimension."""
    if isinstance(metric, grammar.Metric):
        return _metric(problem, figures, metric.name, metric.of)
    found = [_sum(problem, figures, one) for operand in metric.operands for one in _each(problem, operand)]
    values, (dimension, *others) = [value for value, _ in found], [unit for _, unit in found]
    if any(other != dimension for other in others):
        raise ValueError(f"{metric.kind} compares different dimensions")
    return (max(values) if metric.kind == "max" else min(values)), dimension


def _worst(problem: Problem, objective: grammar.Objective) -> grammar.Metric | grammar.Extreme:
    """What an objective without a name is about where there are several candidates."""
    metric = objective.metric
    if isinstance(metric, grammar.Extreme):
        return metric
    subjects = _each(problem, ((1, metric, ()),))
    if len(subjects) == 1:
        return subjects[0][0][1]
    return grammar.Extreme("max" if objective.sign > 0 else "min", (((1, metric, ()),),))


def _each(problem: Problem, operand: grammar.Sum) -> list[grammar.Sum]:
    """A metric that stands alone without a name is about each flow, processor or bus."""
    ((sign, metric, constants), *others) = operand
    core = None if isinstance(metric, grammar.Extreme) else grammar.core_of(metric.of)
    if not others and core is not None and core[0] is None:
        subjects = [f"core {number + 1} of {core[1]}" for number in range(problem.most_cores(core[1]))]
        return [((sign, grammar.Metric(metric.name, subject), constants),) for subject in subjects]
    named = isinstance(metric, grammar.Extreme) or metric.of is not None or metric.name in problem.metrics
    if others or named or metric.name in ("price", "power", "changes", *problem.totals):
        return [operand]
    subjects = _subjects(problem, metric.name)
    return [((sign, grammar.Metric(metric.name, subject), constants),) for subject in subjects]


def _sum(problem: Problem, figures: Mapping[str, Any], terms: grammar.Sum) -> tuple[Fraction, Dimension]:
    total, dimension = Fraction(0), None
    for sign, metric, constants in terms:
        value, unit = _value(problem, figures, metric)
        for exponent, constant in constants:
            unit = quantities.multiply(unit, constant.dimension, exponent)
        if dimension not in (None, unit):
            raise ValueError(f"{terms} add up different dimensions")
        total, dimension = total + sign * value * grammar.value_of(constants), unit
    assert dimension is not None, terms
    return total, dimension


def violations(problem: Problem, figures: Mapping[str, Any]) -> list[str]:
    """The requirements that the figures of a design break, as texts."""
    broken = []
    broken += [item.text for item in problem.requirements if not is_met(problem, figures, item.text)]
    for flow, body in problem.sections["flows"].items():
        limit = body.get("latency")
        if limit is not None and figures["flows"][flow]["max"] > quantities.transmission(limit)[1]:
            broken.append(f"latency of {flow} <= {limit.rpartition('..')[2].strip()}")
    broken += [f"response time of {name} <= its deadline" for name, by in figures["lateness"].items() if by > 0]
    return [*broken, *_overloads(problem, figures)]


def _overloads(problem: Problem, figures: Mapping[str, Any]) -> Iterator[str]:
    """What is used beyond all of it, where nobody allows that."""
    if problem.document.get("overload") == "allowed":
        return
    for slot, peak in figures["peak"].items():
        if not _may_be_overloaded(problem, slot) and not peak.keeps(operator.le, Fraction(1)):
            yield f"core of {slot}"
    for what in ("load_share", "exclusive"):
        for slot, share in figures[what].items():
            if share is not None and share > 1 and not _may_be_overloaded(problem, slot):
                yield f"{what} of {slot}"


def _may_be_overloaded(problem: Problem, slot: str) -> bool:
    """Whether the entry of a slot says so; a virtual bus type that is used directly has none."""
    return slot in problem.section_of and problem.component(slot).get("overload") == "allowed"


def is_met(problem: Problem, figures: Mapping[str, Any], text: str) -> bool:
    """Whether figures meet a requirement, whether the problem states it or not."""
    requirement = grammar.requirement(text)
    name, of = requirement.metric.name, requirement.metric.of
    if requirement.limit == "its deadline":
        return figures["lateness"].get(of, 0) <= 0
    whole = name not in ("latency", "min latency", "jitter", "utilisation", "load", "busy")
    subjects = [of] if of is not None or whole else _subjects(problem, name)
    if (core := grammar.core_of(of)) is not None and core[0] is None:
        subjects = [f"core {number + 1} of {core[1]}" for number in range(problem.most_cores(core[1]))]
    return all(_satisfied(problem, figures, requirement, subject) for subject in subjects)


def is_obeyed(problem: Problem, design: Mapping[str, str | None], text: str) -> bool:
    """Whether a design obeys a rule, whether the problem states it or not."""
    rule = grammar.rule(text)
    return Reading(problem, design).holds(rule.condition) is not rule.forbid


def needed_limit(problem: Problem, figures: Mapping[str, Any], text: str) -> Fraction:
    """The limit that a design would just meet, in the units of `evaluate`; a share where the limit is one.

    Of a deadline that is how much later than it the thread may end.
    """
    requirement = grammar.requirement(text)
    metric, of = requirement.metric.name, requirement.metric.of
    if requirement.limit == "its deadline":
        return figures["lateness"][of]
    if of is None and metric in ("utilisation", "load", "busy"):
        of = _only(problem, metric)
    if metric == "load" and requirement.limit.endswith(("%", "ppm")):
        return figures["load_share"][of] or Fraction(0)
    if metric != "utilisation" or grammar.core_of(of) is not None:
        return quantities.per_second(*_value(problem, figures, requirement.metric))
    needed = figures["utilisation"][of] / figures["cores"][of]
    return max(needed, figures["peak"][of].exact) if requirement.operator in ("<=", "<") else needed


def _satisfied(
    problem: Problem, figures: Mapping[str, Any], requirement: grammar.Requirement, subject: str | None
) -> bool:
    compare, metric = COMPARE[requirement.operator], requirement.metric.name
    limit = quantities.quantity(requirement.limit)
    if metric in problem.totals and metric not in problem.metrics:
        unit = problem.totals[metric]
        limit = quantities.Quantity(quantities.figure(requirement.limit, unit), ((unit, 1),))
    if metric == "changes" and limit is not None:
        limit = quantities.Quantity(limit.value, CHANGES)
    if limit is None:
        raise ValueError(f"cannot read the limit of {requirement.text!r}")
    if metric == "load" and limit.dimension == RATIO:
        share = figures["load_share"][subject]
        return share is None or compare(share, limit.value)
    extreme = isinstance(requirement.metric, grammar.Extreme)
    value, dimension = _value(problem, figures, requirement.metric if extreme else grammar.Metric(metric, subject))
    if dimension != limit.dimension:
        raise ValueError(f"{requirement.text!r} compares different dimensions")
    if metric != "utilisation" or grammar.core_of(subject) is not None:
        return compare(value, limit.value)
    whole = compare(value, limit.value * figures["cores"][subject])
    return whole and (requirement.operator not in ("<=", "<") or figures["peak"][subject].keeps(compare, limit.value))


def dominates(left: tuple[Any, ...], right: tuple[Any, ...]) -> bool:
    """Whether `left` is nowhere larger and somewhere smaller."""
    return left != right and all(a <= b for a, b in zip(left, right, strict=True))


def non_dominated(vectors: set[tuple[Fraction, ...]]) -> set[tuple[Fraction, ...]]:
    """The minimal vectors; compares the ranks of values, which are cheap integers."""
    levels = [{value: i for i, value in enumerate(sorted(set(column)))} for column in zip(*vectors, strict=True)]
    ranked = sorted((tuple(level[v] for level, v in zip(levels, vector, strict=True)), vector) for vector in vectors)
    kept: list[tuple[tuple[int, ...], tuple[Fraction, ...]]] = []
    for ranks, vector in ranked:
        if not any(dominates(other, ranks) for other, _ in kept):
            kept.append((ranks, vector))
    return {vector for _, vector in kept}


def front(problem: Problem) -> dict[tuple[Fraction, ...], list[Design]]:
    """The Pareto front by exhaustion: each non-dominated objective vector with all designs that have it.

    Units: ns, cores (1 = one core), B/s, ct, mW, totals as declared; maximised objectives are negated.
    """
    reached: dict[tuple[Fraction, ...], list[Design]] = {}
    for design, figures in evaluated(problem):
        if not figures["violations"]:
            reached.setdefault(figures["objectives"], []).append(design)
    return {vector: reached[vector] for vector in sorted(non_dominated(set(reached)))}
