"""Contention for the CPU in words: whether it is counted, which designs hold with it, and which core runs what."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from dse.analysis.diagnosis.front_verdicts import (
    core_by,
    core_origins,
    leaves_out_buses,
    placements_of,
    uncounted_buses,
)
from dse.analysis.messages.stages import counted_buses, may_queue
from dse.analysis.placement.first_fit import core_room
from dse.analysis.placement.partition import Spread
from dse.analysis.scheduling.overheads import safe_bounds, stated_overheads
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.answers.contention_verdicts import Broken, Contended
from dse.answers.designs import Point
from dse.answers.result import Result
from dse.answers.tables.display import readable
from dse.report.amounts import listed
from dse.report.words.basis import basis_parts
from dse.space.model.metric_kinds import flows_in
from dse.space.model.space import Design, Space
from dse.space.model.trees import leaves
from dse.space.question.open_cores import asked_metrics, cores_beside, is_scheduled
from dse.space.question.settings import SETTINGS
from dse.support.units.text import first_of

PROCESSING = {
    "execution_time": "CPU contention is not in the latencies: each thread counts its execution time, as if alone on "
    "its core (--processing response-time counts what it waits for, and decides cores that are not stated).",
    "response_time": "CPU contention is in the latencies: each thread counts its response time under fixed priorities, "
    "on the core that is stated or decided, else on the one that first-fit gives.",
}
"""The processing time of a thread in a latency, by the setting `processing`."""
UNCOUNTED = (
    "CPU contention is not in the latencies: this profile counts no response times, but execution times and deadlines."
)
CONTENTION_OUT = "CPU contention is not in the latencies: with response times"
BLOCKING = "blocking by non-preemptive sections"
COUNTED_BY = " Counted in the search: --processing response-time."
"""Where designs do not keep what is asked: how to find those that do."""
WAITING = "Waiting for a bus is not counted."
MOST_NAMES = 6
MOST_EXAMPLES = 3
MOST_THREADS = 24
"""Maximum number of threads whose cores are told one by one in a sentence."""
MOST_IDS = 12
MOST_BROKEN = 3


def processing_words(settings: Mapping[str, str]) -> str:
    """Whether contention for the CPU is in the latencies, from the settings by name.

    One sentence. `settings` are those of the question; the profile ``osate-2.2`` never counts response times.
    """
    return UNCOUNTED if settings["profile"] == "osate-2.2" else PROCESSING[settings["processing"]]


def uncounted_words(space: Space) -> str:
    """The remark that the profile counts no response times at all, where something asked is about a flow.

    Empty where nothing is asked of a flow, or the profile counts response times.
    """
    asks = space.profile == "osate-2.2" and any(flows_in(space, metric) for metric in asked_metrics(space))
    return UNCOUNTED if asks else ""


def waiting_words(space: Space) -> str:
    """The short remark on bus arbitration that is not counted, for answers about a whole front.

    Empty where no flow is asked about, or waiting for every bus is counted.
    """
    return waiting_left_words(space) if any(flows_in(space, metric) for metric in asked_metrics(space)) else ""


def waiting_left_words(space: Space) -> str:
    """The remark that messages do not wait for a bus that may carry them, in short.

    Empty where waiting for every such bus is counted. See docs/semantics.md on arbitration.
    """
    return (_left_out_words(space) or WAITING) if leaves_out_buses(space) else ""


def _left_out_words(space: Space) -> str:
    """Which buses messages do not wait for, and why; "" where nothing is stated of the arbitration of any."""
    left = uncounted_buses(space)
    if not counted_buses(space) and not any(bus.uncounted for bus in left):
        return ""
    said = [f"{bus.name} ({bus.uncounted or 'no `arbitration` is stated'})" for bus in left]
    return f"Waiting for {listed(said)} is not counted."


KINDS = {
    "priority": "by identifier",
    "classes": "by priority, equal ones as they come",
    "fifo": "as they come",
    "round_robin": "in turns, as a safe bound",
    "none": "each sender by itself",
}


def arbitration_words(space: Space) -> str:
    """The sentence on buses whose arbitration is counted, with the order of messages; "" where none is counted.

    One sentence with the kind of arbitration of each bus.
    """
    said = []
    queue = ", senders that queue messages as they come as safe bounds" if may_queue(space) else ""
    for bus in (space.buses[number] for number in counted_buses(space)):
        kinds = dict.fromkeys(leaf for leaf in leaves(bus.arbitration) if leaf is not None)
        more = queue if "priority" in kinds else ""
        more += ", with faults of the wire" if set(leaves(bus.fault_interval_ns)) != {None} else ""
        said.append(f"{bus.name} ({' or '.join(KINDS[kind] for kind in kinds)}{more})")
    return f"Waiting for {listed(said)} is counted." if said else ""


def study_settings(data: Mapping[str, Any]) -> Mapping[str, str]:
    """The settings of the question that a study asked, by name; nothing where an older study does not state them.

    `data` is the JSON form of a sweep, a sensitivity study or a result.
    """
    settings: Mapping[str, str] = data["problem"].get("effective", data["problem"])
    return settings if set(SETTINGS) <= set(settings) else {}


def study_counting_words(data: Mapping[str, Any]) -> str:
    """The delays that latencies of a study count and leave out, and its unusual settings; "" where none are stated.

    Sentences that begin with *Counted*; `data` is the JSON form of a sweep or a sensitivity study.
    """
    settings = study_settings(data)
    if not settings:
        return ""
    is_counted = settings["processing"] == "response_time" and settings["profile"] != "osate-2.2"
    left = [*([] if is_counted else ["waiting for the CPU"]), *(["bus arbitration"] if data.get("bus_waiting") else [])]
    counted = f"execution, {'waiting for the CPU, ' if is_counted else ''}transmission."
    omitted = {"processing", *(["profile"] if settings["profile"] == "dse" else [])}
    rules = ", ".join(text for name, text in basis_parts(settings).items() if name not in omitted)
    parts = [f"Counted  {counted}", *([f"Not {', not '.join(left)}."] if left else [])]
    return " ".join([*parts, *([f"{rules[:1].upper()}{rules[1:]}."] if rules else [])])


def bus_words(space: Space) -> str:
    """The sentence on buses whose arbitration delay latencies count, and on those whose delay they leave out.

    One or two sentences; both are needed where a system mixes buses with and without arbitration.
    """
    text = "Waiting for a bus is not in the latencies: each message counts as if alone on it."
    left = (_left_out_words(space) or text) if leaves_out_buses(space) else ""
    return " ".join(filter(None, (arbitration_words(space), left)))


def contention_words(result: Result) -> str:
    """How many designs of a front keep what is asked when response times count, and on which cores, in one line.

    Empty where there is no front, or the front was searched with all of that.
    """
    if not result.front or not result.leaves_out_contention:
        return ""
    space = result.space
    if all(item.implied for item in space.requirements):
        return "CPU contention is not in the latencies, and no requirement is stated that it could violate."
    verdicts = {point.id: result.contended.get(str(point.id)) for point in result.front}
    known = {number: item for number, item in verdicts.items() if item is not None and item.status != "unknown"}
    kept = [number for number, item in known.items() if item.status == "kept"]
    begin = f"{CONTENTION_OUT}, {chosen_words(space)},"
    rest = f"; {len(verdicts) - len(known)} unknown: the time was too short" if len(known) < len(verdicts) else ""
    if not known:
        return f"{begin} it is unknown which designs keep every requirement: the time was too short." + COUNTED_BY
    if len(verdicts) == 1:
        said = f"{begin} the only design {'keeps' if kept else 'does not keep'} every requirement."
        return said if kept else said + COUNTED_BY
    count = f"{len(kept) or 'none'} of the {len(verdicts)}"
    if len(kept) == len(verdicts):
        count = "both" if len(kept) == 2 else f"all {len(verdicts)}"
    who = f" ({_ids(kept)}; the best is #{kept[0]})" if 0 < len(kept) < len(verdicts) else ""
    verb = "keep" if len(kept) > 1 else "keeps"
    said = f"{begin} {count} designs {verb} every requirement{who}{rest}."
    return said if len(kept) == len(verdicts) else said + COUNTED_BY


def chosen_words(space: Space) -> str:
    """The phrase for the cores on which designs of a front are judged: chosen for each, where any core is open.

    Such as ``with cores chosen for each design``; else those of `core_words`.
    """
    return "with cores chosen for each design" if cores_beside(space) else core_words(space)


def broken_choice_words(result: Result, chosen: Point) -> str:
    """The sentence on violations of the chosen design with response times, and on the first design in rank without any.

    Empty where it breaks nothing, it is not known, or the front was searched with response times. That none keeps
    them is said by `contention_words`.
    """
    verdict = result.contended.get(str(chosen.id)) if result.leaves_out_contention else None
    if verdict is None or verdict.status != "broken":
        return ""
    violated = first_of([_broken_words(item, result.space.currency) for item in verdict.broken], 1)
    said = f"But with response times it violates {violated}"
    if cores_beside(result.space):
        own = own_core_words(result.space)
        said = f"But with response times it keeps every requirement on no cores ({own}: {violated})"
    verdicts = ((point.id, result.contended.get(str(point.id))) for point in result.front)
    kept = next((number for number, item in verdicts if item is not None and item.status == "kept"), None)
    return f"{said}." if kept is None else f"{said}: #{kept} is the best that meets every requirement."


def own_core_words(space: Space) -> str:
    """The phrase for the cores that a design of a front has without a further choice.

    ``by first-fit`` where that gives some of them, else ``on its own``.
    """
    return "by first-fit" if "first-fit" in core_origins(space) else "on its own"


def study_contention_words(data: Mapping[str, Any]) -> str:
    """The number of designs of a sweep that meet the requirements with waiting for the CPU, in words; "" if counted.

    One sentence with the number of designs of all fronts; `data` is the JSON form of a sweep.
    """
    basis = data.get("contention")
    judged = [
        item["contention"]
        for run in data["runs"]
        for item in run.get("front", run.get("alternatives", ()))
        if "contention" in item
    ]
    if basis is None or not judged:
        return ""
    kept = sum(item["status"] == "kept" for item in judged)
    count = f"{kept or 'none'} of the" if kept < len(judged) else "all"
    designs = f"{len(judged)} designs of all fronts" if len(judged) > 1 else "only design"
    count = count if len(judged) > 1 else "the"
    verb = ("keep" if kept > 1 else "keeps") if kept or len(judged) > 1 else "does not keep"
    varied = " (a limit that varies counts apart)" if any(run["kind"] == "breaks" for run in data["runs"]) else ""
    cores = _cores_of_origins(basis["cores"])
    said = f"{CONTENTION_OUT}, {cores}, {count} {designs} {verb} every requirement{varied}."
    return said if kept == len(judged) else said + COUNTED_BY


def asks_for_responses(space: Space) -> bool:
    """Whether a requirement or an objective looks at response times.

    True also where response times enter through the latency of a flow.
    """
    return any(is_scheduled(space, metric) for metric in asked_metrics(space))


def waits_in_flows(space: Space) -> bool:
    """Whether a requirement or an objective is about a flow whose latency counts response times.

    Such a question is quicker without them (`processing: execution_time`).
    """
    return any(flows_in(space, metric) and is_scheduled(space, metric) for metric in asked_metrics(space))


def overhead_words(space: Space, design: Design | None = None) -> str:
    """The overheads that response times count besides execution times, and those left out: in any design, or in one.

    One sentence about blocking, context switches, interrupts and throttling; `design` limits it to what that design
    chooses.
    """
    stated = stated_overheads(space, design)
    counted = [
        f"{BLOCKING if kind == 'blocking' else kind} ({_some(names)})" for kind, names in stated.items() if names
    ]
    left = [kind for kind, names in stated.items() if not names]
    elsewhere = stated_overheads(space)
    others = any(elsewhere[kind] for kind in left)
    if not counted:
        who = "design has" if others else "problem states"
        return f"Response times count no overheads: the {who} no {', '.join(left[:-1])} and no {left[-1]}."
    none = "of which the design has none" if others else "of which nothing is stated"
    rest = f"; not {' and not '.join(left)}, {none}" if left else ""
    return f"Response times count {', '.join(counted)}{rest}."


def bound_words(space: Space, design: Design | None = None) -> str:
    """The sentence on response times that are safe bounds, with the reason; empty where all can be reached.

    One sentence with the cores on which a response time need not be reached, and why; with `design` for that design
    only.
    """
    reasons = _safe(safe_bounds(space, design))
    return f"They are {reasons}." if reasons else ""


def response_time_words(space: Space, design: Design | None = None) -> str:
    """The sentences on response times: the overheads that they count, and where they are safe bounds, with the reason.

    One or two sentences; with `design` for that design only.
    """
    return f"{overhead_words(space, design)} {bound_words(space, design)}".rstrip()


def safe_words(reasons: Mapping[str, Sequence[str]], *, is_known: bool = True) -> str:
    """The remark that a proof rests on response times that are safe bounds: `reasons` says why they are.

    It may only rest on them where it is not `is_known` which demands clash.
    """
    text, rests = _safe(reasons), "rests" if is_known else "may rest"
    return f"The proof {rests} on response times that are {text}: a design may be in time all the same." if text else ""


def _safe(reasons: Mapping[str, Sequence[str]]) -> str:
    phrases = [f"{why} {_some(names, MOST_EXAMPLES)}" for why, names in reasons.items() if names]
    return f"safe bounds, which need not be reached, on cores where {'; '.join(phrases)}" if phrases else ""


def core_words(space: Space) -> str:
    """The phrase for the cores on which response times are counted.

    Stated cores, decided ones, first-fit, or several of these.
    """
    return _cores_of_origins(core_origins(space))


def _cores_of_origins(origins: Collection[str]) -> str:
    """The cores on which response times are counted, in words, from who chooses them."""
    words = " or ".join(word for word in ("stated", "decided") if word in origins)
    if not origins:
        return "on the only core of each processor"
    if "first-fit" not in origins:
        return f"on the cores {words}"
    return f"on the cores {words}, else those that first-fit gives" if words else "on the cores that first-fit gives"


def cores_origin(space: Space) -> str:
    """The remark that first-fit chooses the cores of a design, in brackets, as far as it does.

    Empty where no core is chosen by first-fit.
    """
    origins = core_origins(space)
    if "first-fit" not in origins:
        return ""
    return " (by first-fit)" if len(origins) == 1 else " (by first-fit, where none is stated)"


def _some(names: Sequence[str], most: int = MOST_NAMES) -> str:
    return ", ".join(names[:most]) + (", …" if len(names) > most else "")


def _ids(numbers: list[int]) -> str:
    return first_of([f"#{number}" for number in numbers], MOST_IDS)


def contended_words(verdict: Contended | None, currency: str, *, own: str = "") -> str:
    """The verdict on a design when response times count.

    One sentence with at most `MOST_BROKEN` violated requirements, and `MOST_NAMES` other cores. `own` is what the cores
    are called on which requirements are violated, where others could have been chosen (`own_core_words`).
    """
    if verdict is None:
        return "Unknown: the time was too short."
    if verdict.decisions:
        chosen = _some([f"{name} {option}" for name, option in verdict.decisions.items()])
        return f"Meets every requirement with {chosen}."
    if not verdict.broken:
        return "Meets every requirement."
    shown = "; ".join(_broken_words(item, currency) for item in verdict.broken[:MOST_BROKEN])
    more = len(verdict.broken) - MOST_BROKEN
    said = f"Violates {shown}" + (f"; and {more} more" if more > 0 else "")
    if not own:
        return f"{said}."
    if verdict.status == "unknown":
        return f"{said} ({own}); whether it holds on other cores is unknown: the time was too short."
    return f"{said} ({own}); no other cores meet every requirement: proved."


def _broken_words(item: Broken, currency: str) -> str:
    """``jitter of f <= 20 ms (29.294 ms)``; who has no bound, where one has none."""
    if item.value is None:
        return f"{item.requirement} (unbounded: {', '.join(item.unbounded)})"
    limit = f" of {readable(item.limit, item.unit, currency)}" if item.requirement.endswith("its deadline") else ""
    return f"{item.requirement}{limit} ({readable(item.value, item.unit, currency)})"


def placed_words(space: Space, design: Design) -> list[str]:
    """For each processor with several cores what runs on each, and how much of it: ``computer: core 1 (70 %) a; …``.

    One line for each processor; loads in % of one core. Many threads are counted instead of named.
    """
    view = View(design)
    lines = []
    for number, placement in placements_of(space, design).items():
        here = dict(sorted(placement.cores.items()))
        if not here:
            continue
        parts = []
        for core in sorted(set(here.values())):
            threads = [thread for thread, its in here.items() if its == core]
            names = ", ".join(_named(space, thread, view) for thread in threads)
            used = readable(placement.loads[core - 1] * PPM, "ppm")
            parts.append(f"core {core} ({used}) {names if len(here) <= MOST_THREADS else f'{len(threads)} threads'}")
        lines.append(f"{space.processors[number].name}: {'; '.join(parts)}{_partition_words(space, number, placement)}")
    return lines


def _partition_words(space: Space, processor: int, placement: Spread) -> str:
    """Whether threads without a core can be put on cores such that each keeps what is required of it."""
    if not placement.is_open:
        return ""
    room = core_room(space, processor)
    within = f"{'below' if room.is_strict else 'within'} {readable(room.share * PPM, 'ppm')} of each core"
    if placement.status == "found":
        return f" (a partition {within})"
    if placement.status == "none":
        return f" (no partition is {within}: proved)"
    return f" (whether a partition is {within} is undecided)"


def _named(space: Space, thread: int, view: View) -> str:
    component = space.components[thread]
    return f"{component.name} (stated)" if core_by(space, component, view) == "stated" else component.name
