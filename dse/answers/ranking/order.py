"""A result in another order: the same points, ranked by another method."""

from __future__ import annotations

from dataclasses import replace

from dse.analysis.measures import cost_of_changes
from dse.analysis.views import View
from dse.answers.ranking.ranking import rank
from dse.answers.result import Result
from dse.space.model.space import Space
from dse.support import arguments


def check_ranking(method: str, space: Space, *, has_baseline: bool) -> None:
    """Refuse a method that does not exist or does not fit the question, before there is a front.

    Raises
    ------
    UsageError
        saying why.
    """
    rank(method, [], [(item.metric.name, item.sense) for item in space.objectives], [] if has_baseline else None)


@arguments.checked(result=arguments.RESULT, method=arguments.text)
def ranked_by(result: Result, method: str) -> Result:
    """The result with its front ranked by `method` (`dse.answers.ranking.ranking`); every point stays, with its id.

    Parameters
    ----------
    result
        what `dse.solve` returned.
    method
        as for ``--rank-by``: ``ideal``, ``topsis``, ``knee``, ``baseline``, ``weights:price=2,jitter=1``,
        ``order:price,jitter``.

    Raises
    ------
    UsageError
        when the method does not exist or does not fit the result.

    Examples
    --------
    >>> import dse
    >>> found = dse.ranked_by(dse.solve("pump.yaml"), "knee")
    >>> [point.id for point in found.front]
    [1, 4, 2, 3]
    """
    names = [item.name for item in result.objectives]
    objectives = [(item.name, item.sense) for item in result.objectives]
    points = [[point.objectives[name] for name in names] for point in result.front]
    changed = None
    if result.baseline is not None:
        changed = [cost_of_changes(result.space, View(point.design)) for point in result.front]
    ranking = rank(method, points, objectives, changed)
    rows = zip(ranking.ranks, ranking.scores, result.front, strict=True)
    front = [replace(point, rank=number, score=score) for number, score, point in rows]
    front.sort(key=lambda point: (point.rank, point.id))
    return replace(result, front=tuple(front), ranking=method, ranking_words=ranking.words)
