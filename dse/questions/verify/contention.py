"""The referee's word on the designs of a result: which keep every requirement when threads wait for each other."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, cores_of, with_contention
from dse.analysis.evaluate import Evaluator
from dse.answers.contention_verdicts import NOT_JUDGED, Contended, CoreUse, core_use, judge
from dse.answers.forms.codec import written
from dse.answers.result import Result
from dse.questions.result_question import named_design
from dse.space.model.space import Design, Space
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, TimeLimit, until
from dse.support.units.text import count_words

if TYPE_CHECKING:  # whoever solves needs none of the second proof
    from dse.questions.verify.points import Bench

LEAST_TIME_S = 10.0
"""Without a time limit the referee has as long as the search took, at least this long."""
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
    found = {**result.contended, **_judged(counted, todo, TimeLimit.after(own_s))}
    return replace(result, contended={number: found[number] for number in designs if number in found})


def _judged(counted: Space, designs: Mapping[str, Design], limit: TimeLimit) -> dict[str, Contended]:
    """Verdicts for which there is time, in the order of the designs; Ctrl-C ends it, and keeps what was found."""
    found: dict[str, Contended] = {}
    if not designs:
        return found
    try:
        with until(limit):
            referee = ContentionReferee(counted)
            for number, design in designs.items():
                found[number] = judge(referee, design)
    except (OutOfTime, KeyboardInterrupt):
        pass
    return found


def stated_verdicts(result: Result, data: Mapping[str, Any], path: str | Path) -> Mapping[str, Contended]:
    """The contention verdicts of a result file, computed again; designs that the file has not checked are left out.

    Raises
    ------
    UsageError
        when the file says otherwise.
    """
    counted = with_contention(result.space)
    found: dict[str, Contended] = {}
    referee = None if counted is None else ContentionReferee(counted)
    designs = {str(point.id): point.design for point in result.front}
    designs |= {sibling.id: sibling.design for others in result.others for sibling in others.designs}
    for _, item in _listed(data):
        stated, number = item.get("contention"), str(item["id"])
        placed = {} if data.get("under_way") else _placed(result.space, designs[number], item)
        if any(item.get(name, {}) != own for name, own in placed.items()):
            raise UsageError(f"{path}: alternative {number} has other cores than the result says")
        if referee is None or stated is None or stated == NOT_JUDGED:
            continue
        found[number] = judge(referee, designs[number])
        if written(Contended, found[number]) != stated:
            raise UsageError(
                f"{path}: alternative {number} meets other requirements with response times than the result says"
            )
    return found


def check_contention(bench: Bench, deadline: float | None) -> None:
    """The core of each thread of each listed design, and what the design keeps when response times count.

    Each design is placed on cores and judged again (`ContentionReferee`); a verdict that differs from the stated one is
    a finding. Nothing is stated where the question already counts response times.
    """
    counted = with_contention(bench.space)
    referee = None if counted is None else ContentionReferee(counted)
    listed = _listed(bench.data)
    evaluator = Evaluator(bench.space)
    judged = left = 0
    for place, item in listed:
        try:
            design = named_design(bench.space, item["decisions"])
        except UsageError:
            continue  # which was found with the design itself
        if evaluator.evaluate(design).breaches:
            continue  # likewise
        placed = {} if bench.under_way else _placed(bench.space, design, item)
        for name, own in placed.items():
            bench.compare(f"{place}.{name}", own, item.get(name, {}))
        stated = item.get("contention", {})
        if referee is None:
            bench.compare(f"{place}.contention", {}, stated)
        elif stated != NOT_JUDGED:
            try:
                with until(deadline):
                    bench.compare(f"{place}.contention", written(Contended, judge(referee, design)), stated)
                judged += 1
            except OutOfTime:
                left += 1
    if left:
        bench.left_open.append(f"what {left} of {len(listed)} designs keep with response times: the time was too short")
    if listed:
        said = f", and what {judged} of them keep with response times" if judged else ""
        bench.checked.append(f"the cores of {count_words(len(listed), 'design')}{said}")


def _placed(space: Space, design: Design, item: Mapping[str, Any]) -> dict[str, Any]:
    """Who runs on which core and how full each is, in the words of a result; one from elsewhere may leave out that."""
    cores = {space.components[thread].name: core for thread, core in cores_of(space, design).items()}
    if "core_use" not in item:
        return {"cores": cores}
    return {"cores": cores, "core_use": {name: written(CoreUse, use) for name, use in core_use(space, design).items()}}


def _listed(data: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Every design that the data of a result list, with its place."""
    found = [(f"front[{at}]", item) for at, item in enumerate(data["front"])]
    for position, others in enumerate(data.get("others", [])):
        found += [(f"others[{position}].designs[{at}]", item) for at, item in enumerate(others["designs"])]
    return found
