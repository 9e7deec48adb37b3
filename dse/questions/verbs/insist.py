"""`dse.insist`: the price of insisting on each option, computed side by side from a result."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from time import monotonic
from typing import Literal, TypeAlias, cast

from dse.analysis.evaluate import Evaluator
from dse.answers.designs import InsistedOption, InsistedPoint, Insisting
from dse.answers.result import Result, decisions_of
from dse.answers.tables.display import figure, figures_of
from dse.questions.stopped_search import search_of
from dse.questions.sweep.cluster import run_on_cluster
from dse.questions.sweep.workers import run_all
from dse.questions.verify.insisting import open_options
from dse.search.front import FrontSearch, SearchLimits
from dse.search.insist import Insistence
from dse.space.model.space import Design
from dse.support import arguments
from dse.support.timelimit import OutOfTime, TimeLimit, in_force

ALONE_S = 2.0
"""Seconds for which options are searched in this process before others are started."""
Status: TypeAlias = Literal["complete", "incomplete", "infeasible"]
Fronts: TypeAlias = "dict[tuple[int, int], tuple[Status, list[InsistedPoint]]]"


@dataclass(frozen=True)
class Machines:
    """The machines that search the options: processes on this machine, or the cluster of a Dask scheduler.

    `workers` is a number of processes; `scheduler` an address such as ``tcp://host:8786``, None to stay on this
    machine.
    """

    workers: int = 1
    scheduler: str | None = None


@arguments.checked(
    result=arguments.RESULT,
    workers=arguments.Whole(1, 64),
    scheduler=arguments.optional_text,
    time_limit_s=arguments.span,
    progress=arguments.call,
)
def insist(
    result: Result,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    time_limit_s: arguments.Span | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """The result with the price of insisting: for each option of each open decision the front with that option fixed.

    The same fronts as `dse.solve` finds with `fix`, but from one model and from what the whole front's search has
    proved.

    Parameters
    ----------
    result
        what `dse.solve` or `dse.reopen` returned.
    workers
        on how many cores of this machine, once it has taken some seconds; what is found does not depend on it.
    scheduler
        the address of a Dask scheduler, to search on its workers instead.
    time_limit_s
        seconds for all of it; options that are not done by then are ``incomplete``.
    progress
        called with the number of options that are done, and of all.

    Returns
    -------
    Result
        with `insisting`, whose options are in the order of the problem.

    Raises
    ------
    UsageError
        when the result is of a problem without objectives, or there is no such cluster.

    Examples
    --------
    >>> import dse
    >>> result = dse.insist(dse.solve("pump.yaml"))
    >>> [(item.option, item.status, item.front) for item in result.insisting.options if item.decision == "can0.type"]
    [('can_250k', 'complete', (1, 4)), ('can_500k', 'complete', (2, 3))]
    """
    limit = arguments.time_limit(time_limit_s)
    return insisted(result, Machines(workers, scheduler), limit, progress or (lambda done, whole: None))


def insisted(
    result: Result, machines: Machines, limit: TimeLimit, tell: Callable[[int, int], None] = lambda done, whole: None
) -> Result:
    """`insist` until a limit of time, or Ctrl-C.

    The result with `insisting`: for each option of each open decision the front with that option fixed, and its status.
    `tell` is called with the options done and their number.
    """
    space = result.space
    wanted = open_options(space)
    fronts: Fronts = {}
    if result.status == "infeasible":
        fronts = {one: ("infeasible", []) for one in wanted}
    else:
        _search(result, [one for one in wanted if one not in fronts], machines, limit, fronts, tell)
    return replace(result, insisting=_gathered(result, wanted, fronts))


def _search(
    result: Result,
    wanted: Sequence[tuple[int, int]],
    machines: Machines,
    limit: TimeLimit,
    fronts: Fronts,
    tell: Callable[[int, int], None],
) -> None:
    """Fill `fronts` as far as there is time."""
    shared = json.dumps({**result.to_dict(), "insisting": None, "others": []}, ensure_ascii=False)
    payloads = [
        json.dumps({"result": shared, "decision": decision, "option": option, "seed": result.search.seed})
        for decision, option in wanted
    ]
    try:
        for done, (number, outcome) in enumerate(_outcomes(payloads, machines, limit), start=1):
            data = json.loads(outcome)
            points = [
                InsistedPoint(
                    id=0,
                    objectives=_counted(item["objectives"]),
                    counts=_counted(item["metrics"]),
                    counting_units=result.counting_units,
                    decisions={},
                    design=tuple(item["design"]),
                )
                for item in data["front"]
            ]
            fronts[wanted[number]] = data["status"], points
            tell(done, len(wanted))
    except (OutOfTime, KeyboardInterrupt):
        return  # what is missing is incomplete
    finally:
        _prepared.cache_clear()


def _outcomes(payloads: Sequence[str], machines: Machines, limit: TimeLimit) -> Iterator[tuple[int, str]]:
    if machines.scheduler is not None:
        yield from run_on_cluster(_search_payload, payloads, machines.scheduler, limit)
        return
    begun, done = monotonic(), 0
    if machines.workers > 1:  # processes take seconds to start: most problems are through by then
        for number, outcome in run_all(_search_payload, payloads, 1, limit):
            done = number + 1
            yield number, outcome
            if monotonic() - begun > ALONE_S:
                break
    for number, outcome in run_all(_search_payload, payloads[done:], machines.workers, limit):
        yield done + number, outcome


def _search_payload(payload: str) -> str:
    """The front with an option, as text: the status and the designs."""
    content = json.loads(payload)
    insistence = _prepared(content["result"])
    search = insistence.front(content["decision"], content["option"], SearchLimits(in_force(), content["seed"]))
    evaluator = insistence.evaluator
    names = [measure.metric.name for measure in evaluator.objectives]
    front = [
        {
            "design": design,
            "objectives": figures_of(dict(zip(names, evaluator.evaluate(design).objectives, strict=True))),
            "metrics": figures_of(evaluator.metric_values(design)),
        }
        for _, design in sorted(_certain(search, insistence.senses))
    ]
    return json.dumps({"status": _status(search), "front": front})


def _counted(figures: Mapping[str, int | None]) -> dict[str, int]:
    """Figures in counting units as `figures_of` wrote them."""
    return {name: cast(int, figure(None)) if value is None else value for name, value in figures.items()}


@lru_cache(maxsize=1)
def _prepared(result: str) -> Insistence:
    """The search state that all options share, made once in each process."""
    data = json.loads(result)
    del data["insisting"]
    problem_asked, search = search_of(data, data["problem"]["file"], None)
    return Insistence(Evaluator(problem_asked.space), search)


def _certain(search: FrontSearch, senses: Sequence[str]) -> list[tuple[tuple[int, ...], Design]]:
    """The points that are on the front, whatever else is: none in a region that is still open."""
    points = []
    for vector, design in search.points.items():
        signed = [-value if sense == "maximise" else value for value, sense in zip(vector, senses, strict=True)]
        if not any(
            all(value < bound for value, bound in zip(signed, region, strict=True)) for region in search.unexplored
        ):
            points.append((vector, design))
    return points


def _status(search: FrontSearch) -> Status:
    if not search.is_complete:
        return "incomplete"
    return "complete" if search.points else "infeasible"


def _gathered(result: Result, wanted: Sequence[tuple[int, int]], fronts: Fronts) -> Insisting:
    """Ids for all points: those of the front have theirs."""
    space = result.space
    ids = {point.design: point.id for point in result.front}
    points: list[InsistedPoint] = []
    options = []
    for decision, option in wanted:
        status, front = fronts.get((decision, option), ("incomplete", []))
        for point in front:
            if point.design not in ids:
                ids[point.design] = len(ids) + 1
                points.append(replace(point, id=ids[point.design], decisions=decisions_of(space, point.design)))
        item = space.decisions[decision]
        numbers = tuple(sorted(ids[point.design] for point in front))
        options.append(InsistedOption(item.name, item.options[option], status, numbers))
    return Insisting(tuple(points), tuple(options))
