"""Further designs at or near the points of a result, as `dse solve --further K --within 5%` asks for them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

from dse.analysis.evaluate import Evaluator
from dse.answers.designs import FurtherAsked, FurtherDesign, FurtherDesigns, Point
from dse.answers.ranking.changes import changes_between
from dse.answers.result import Result, decisions_of
from dse.questions.front_verdicts import with_verdicts
from dse.search.alternatives import Finder, Neighbourhood
from dse.search.workers import stop_on_interrupt
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, until
from dse.support.units import DIMENSIONLESS, UnitError, parse_quantity

DEFAULT_COUNT = 3


@arguments.checked(
    result=arguments.RESULT,
    count=arguments.Whole(1, 1000),
    within=arguments.optional_text,
    top=arguments.Whole(0, 10**9, is_optional=True),
    seed=arguments.SEED,
    time_limit_s=arguments.span,
)
def with_further_designs(
    result: Result,
    count: int = DEFAULT_COUNT,
    within: str | None = None,
    top: int | None = None,
    *,
    seed: int = 0,
    time_limit_s: arguments.Span | None = None,
) -> Result:
    """The result with other designs of its first points; Ctrl-C keeps those that were found until then.

    Parameters
    ----------
    result
        from `dse.solve`; one whose search was ended by Ctrl-C comes back as it is.
    count
        how many designs to look for at each point.
    within
        a share such as ``"5 %"``: also designs whose objectives are each at most so much worse than the point's.
    top
        at how many points, in the order of rank; all when None.
    seed
        of the solver.
    time_limit_s
        seconds to look for them; where that is too short it is not known whether there are more.

    Raises
    ------
    UsageError
        when `within` is no share.

    Examples
    --------
    >>> import dse
    >>> found = dse.with_further_designs(dse.solve("pump.yaml"), 2, within="20%")
    >>> [item.id for item in found.others[0].designs]
    []
    """
    if result.interrupted:
        return result
    limit = arguments.time_limit(time_limit_s)
    share = None if within is None else read_share(within)
    started = time.monotonic()
    evaluator = Evaluator(result.space)
    try:
        with until(limit):
            finder = Finder(evaluator, seed=seed, deadline=limit.deadline)
    except OutOfTime:
        shares = [Fraction(0)] if share is None else [Fraction(0), share]
        unknown = tuple(FurtherDesigns(point.id, within, (), None) for point in result.front[:top] for within in shares)
        return replace(result, others=unknown, others_asked=_asked(result, count, share, top))
    front = [point.design for point in result.front]
    further: list[FurtherDesigns] = []
    with stop_on_interrupt(finder.stop):
        for point in result.front[:top]:
            objectives = [point.objectives[info.name] for info in result.objectives]
            ties = finder.near(objectives, point.design, count)
            further.append(_others(result, evaluator, point, ties, Fraction(0), 1))
            if share is not None:
                known = [*front, *(design for design, _ in ties.designs)]
                near = finder.near(objectives, point.design, count, share, known)
                further.append(_others(result, evaluator, point, near, share, len(ties.designs) + 1))
    found_all = replace(result, others=tuple(further), others_asked=_asked(result, count, share, top))
    return with_verdicts(found_all, started=started, limit=limit)


def _asked(result: Result, count: int, share: Fraction | None, top: int | None) -> FurtherAsked:
    return FurtherAsked(count, share, tuple(point.id for point in result.front[:top]))


def read_share(text: str) -> Fraction:
    """``5%`` as 1/20.

    Raises
    ------
    UsageError
        when it is no positive share.
    """
    try:
        quantity = parse_quantity(text)
    except UnitError as error:
        raise UsageError(f"--within {text}: {error.message}") from error
    if quantity.dimension != DIMENSIONLESS or not quantity.unit or quantity.value <= 0:
        raise UsageError(f"--within {text}: expected a share such as 5%")
    return quantity.value


def _others(
    result: Result, evaluator: Evaluator, point: Point, neighbourhood: Neighbourhood, within: Fraction, first: int
) -> FurtherDesigns:
    names = [info.name for info in result.objectives]
    designs = []
    for number, (design, _) in enumerate(neighbourhood.designs, start=first):
        objectives = dict(zip(names, evaluator.evaluate(design).objectives, strict=True))
        designs.append(
            FurtherDesign(
                id=f"{point.id}.{number}",
                objectives=objectives,
                counts=evaluator.metric_values(design),
                counting_units=evaluator.counting_units,
                decisions=decisions_of(result.space, design),
                design=design,
                dominated_by=tuple(_dominating(result, objectives)),
                different=len(changes_between(result.space, point.design, design)),
            )
        )
    return FurtherDesigns(point.id, within, tuple(designs), neighbourhood.more)


def _dominating(result: Result, objectives: dict[str, int]) -> Iterator[int]:
    """The points that are no worse in any objective, and better in one."""
    for point in result.front:
        gains = [
            objectives[info.name] - point.objectives[info.name]
            if info.sense == "minimise"
            else point.objectives[info.name] - objectives[info.name]
            for info in result.objectives
        ]
        if min(gains) >= 0 and max(gains) > 0:
            yield point.id
