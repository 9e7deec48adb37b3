"""Which designs of a front keep every requirement when threads wait: on their own cores, or on others."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from dse.analysis.diagnosis.front_verdicts import with_contention
from dse.answers.contention_verdicts import Contended
from dse.answers.result import Result
from dse.questions.verify.contention import CoreJury
from dse.space.model.space import Design, Space
from dse.space.model.trees import leaves
from dse.support.timelimit import OutOfTime, TimeLimit, look_at_the_clock, until

if TYPE_CHECKING:
    from dse.search.feasibility.other_cores import OtherCores

LEAST_TIME_S = 10.0
"""Without a time limit the referee has as long as the search took, at least this long."""
LEAST_FOR_CORES_S = 60.0
"""Without a time limit other cores are looked for as long at least: their work ends far sooner."""
MOST_WORK = 0.05
"""The work (`dse.search.solver.settings`) at other cores for all designs of a front together."""
MOST_PAIRS = 800
"""With more pairs of threads that may share a processor, in both orders, other cores are not looked for: the model has
rows for each pair, with deadlines of all on each core, and `MOST_WORK` settles no design of a larger one. (Of 230
designs of drawn problems with 900 to 28 000 pairs none; making these models took up to 40 % of the whole run.)"""
GRACE_S = 0.3
"""A search that took all of its time leaves this much for a first look: most fronts need less."""


def with_verdicts(result: Result, *, started: float, limit: TimeLimit) -> Result:
    """The result with what each of its designs keeps with contention; those that time does not suffice for have none.

    `started` is when the search began, in seconds of the monotonic clock, `limit` its limit. Where the question
    counts contention already, and no deadline is only told, the result stays as it is; so does one that Ctrl-C ended.
    """
    counted = with_contention(result.space)
    if counted is None or result.interrupted:
        return result
    now = time.monotonic()
    grace_s = min(GRACE_S, limit.for_the_last_steps().left_s)
    own_s = max(LEAST_TIME_S, now - started) if limit.seconds is None else max(limit.left_s, grace_s)
    designs = {str(point.id): point.design for point in result.front}
    designs |= {sibling.id: sibling.design for others in result.others for sibling in others.designs}
    todo = {number: design for number, design in designs.items() if number not in result.contended}
    own = TimeLimit.after(own_s)
    cores = TimeLimit.after(max(LEAST_FOR_CORES_S, own_s)) if limit.seconds is None else own
    verdicts = {**result.contended, **_judged(counted, todo, own, cores)}
    return replace(result, contended={number: verdicts[number] for number in designs if number in verdicts})


def _judged(counted: Space, designs: Mapping[str, Design], own: TimeLimit, cores: TimeLimit) -> dict[str, Contended]:
    """Verdicts for which there is time, in the order of the designs; Ctrl-C ends it, and keeps what was found.

    First of all designs on their `own` cores, until the limit of these; then of those that need it on other `cores`.
    """
    verdicts: dict[str, Contended] = {}
    if not designs:
        return verdicts
    from dse.search.feasibility.other_cores import OtherCores

    try:
        with until(own):
            jury = CoreJury(counted)
            for number, design in designs.items():
                verdicts[number] = jury.judged(design)
        with until(cores):
            most_work = MOST_WORK if _pairs(jury.space) <= MOST_PAIRS else 0.0
            others = OtherCores(jury.evaluator, jury.free, most_work=most_work)
            for number, item in verdicts.items():
                verdicts[number] = _elsewhere(jury, others, designs[number], item)
    except (OutOfTime, KeyboardInterrupt):
        pass
    return verdicts


def _pairs(space: Space) -> int:
    """How many pairs of threads may share a processor, in both orders; with deadlines of all, for each of its cores."""
    homes = Counter(
        number
        for item in space.components
        if item.processor is not None
        for number in {leaf for leaf in leaves(item.processor) if leaf is not None}
    )
    cores = {number: max(leaves(item.cores)) for number, item in enumerate(space.processors)}
    return sum(count**2 * (cores[number] if space.deadlines == "all" else 1) for number, count in homes.items())


def _elsewhere(jury: CoreJury, others: OtherCores, design: Design, own: Contended) -> Contended:
    """The verdict on a design whose own one is open: with the cores that were found, or the proof that none hold.

    `own` itself where it is not open, or the work that all designs may take is done. Raises `OutOfTime` when the limit
    of time is up.
    """
    if own.status != "unknown":
        return own
    try:
        other = others.holding(jury.whole(design))
    except OutOfTime:
        look_at_the_clock()
        return own
    return replace(own, is_open=False, decisions={} if other is None else jury.chosen(other))
