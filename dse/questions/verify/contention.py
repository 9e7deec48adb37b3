"""The referee's word on the designs of a result: which keep every requirement when threads wait for each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from dse.analysis.diagnosis.front_verdicts import ContentionReferee, cores_of, with_contention
from dse.analysis.evaluate import Evaluator
from dse.analysis.messages.waits import named_identifiers
from dse.answers.contention_verdicts import NOT_JUDGED, Contended, CoreUse, core_use, judge
from dse.answers.forms.codec import written
from dse.answers.result import Result
from dse.space.model.space import INACTIVE, Design, Space
from dse.space.question.open_cores import cores_beside, with_all_cores
from dse.support.errors import UsageError


class CoreJury:
    """Says what designs keep with contention: on their own cores, and with other cores and best orders.

    `counted` is the question that `with_contention` gives.
    """

    def __init__(self, counted: Space) -> None:
        self.referee = ContentionReferee(counted)
        self.space = with_all_cores(counted)
        self.free = cores_beside(replace(counted, processing="execution_time"))

    @cached_property
    def evaluator(self) -> Evaluator:
        """The evaluator of the question with contention, each core a decision.

        It has no objectives.
        """
        return Evaluator(replace(self.space, objectives=()))

    def judged(self, design: Design) -> Contended:
        """The verdict on a design on its own cores; `is_open` where other cores may be chosen, and it violates some.

        Raises
        ------
        OutOfTime
            when a limit of time (`dse.support.timelimit.until`) is up.
        """
        verdict = judge(self.referee, design)
        return replace(verdict, is_open=bool(verdict.broken and self.free))

    def restated(self, design: Design, stated: Mapping[str, Any]) -> Contended:
        """The verdict on a design as `stated` has it, as far as the analysis alone confirms it.

        That no cores hold is taken from `stated`; cores that it names are judged. Raises as `judged`.
        """
        own = self.judged(design)
        if stated.get("status") == "broken":
            return replace(own, is_open=False)
        named = stated.get("decisions", {})
        known = {self.space.decisions[index].name: index for index in self.free}
        if own.status != "unknown" or not named or not set(named) <= known.keys():
            return own
        chosen = dict(enumerate(self.whole(design)))
        for name, option in named.items():
            options = self.space.decisions[known[name]].options
            chosen[known[name]] = options.index(option) if option in options else INACTIVE
        evaluation = self.evaluator.evaluate(tuple(chosen.values()))
        return replace(own, is_open=False, decisions=self.chosen(evaluation.design)) if evaluation.is_feasible else own

    def whole(self, design: Design) -> Design:
        """The design with an entry for each decision of `space`.

        Those that the question has no decision for are inactive.
        """
        return (*design, *(INACTIVE for _ in range(len(self.space.decisions) - len(design))))

    def chosen(self, design: Design) -> dict[str, str]:
        """The options of the decisions on cores and orders, by name.

        Of those that are `free`, and that the design uses.
        """
        decisions = [(self.space.decisions[index], design[index]) for index in sorted(self.free)]
        return {item.name: item.options[option] for item, option in decisions if option >= 0}


def stated_verdicts(result: Result, data: Mapping[str, Any], path: str | Path) -> Mapping[str, Contended]:
    """The contention verdicts of a result file, judged again; designs that the file has not checked are left out.

    That no cores hold is not proved again: `dse verify` does.

    Raises
    ------
    UsageError
        when the file says otherwise.
    """
    counted = with_contention(result.space)
    verdicts: dict[str, Contended] = {}
    jury = None if counted is None else CoreJury(counted)
    designs = {str(point.id): point.design for point in result.front}
    designs |= {sibling.id: sibling.design for others in result.others for sibling in others.designs}
    for _, item in listed_designs(data):
        stated, number = item.get("contention"), str(item["id"])
        placed = {} if data.get("under_way") else placed_as(result.space, designs[number], item)
        if wrong := [name for name, own in placed.items() if item.get(name, {}) != own]:
            what = "identifiers" if wrong == ["identifiers"] else "cores"
            raise UsageError(f"{path}: alternative {number} has other {what} than the result says")
        if jury is None or stated is None or stated == NOT_JUDGED:
            continue
        verdicts[number] = jury.restated(designs[number], stated)
        if written(Contended, verdicts[number]) != stated:
            raise UsageError(
                f"{path}: alternative {number} meets other requirements with response times than the result says"
            )
    return verdicts


def placed_as(space: Space, design: Design, item: Mapping[str, Any]) -> dict[str, Any]:
    """The cores of threads, their use, and the identifiers of messages that may have any, in the words of a result.

    A result from elsewhere may leave out the last two.
    """
    cores = {space.components[thread].name: core for thread, core in cores_of(space, design).items()}
    placed: dict[str, Any] = {"cores": cores}
    if "core_use" in item:
        placed["core_use"] = {name: written(CoreUse, use) for name, use in core_use(space, design).items()}
    if "identifiers" in item:
        placed["identifiers"] = named_identifiers(space, design)
    return placed


def listed_designs(data: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Every design that the data of a result list, with its place."""
    designs = [(f"front[{at}]", item) for at, item in enumerate(data["front"])]
    for position, others in enumerate(data.get("others", [])):
        designs += [(f"others[{position}].designs[{at}]", item) for at, item in enumerate(others["designs"])]
    return designs
