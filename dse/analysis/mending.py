"""Which single shorter time would let a design keep all that is asked at once.

Of each thing that is wrong with it the least cuts are known by which it alone is kept (`dse.analysis.shortening`).
Shorter jobs never make another response time longer, so that the greatest of these cuts of one job is enough for all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dse.analysis.limits import build_limit, judge
from dse.analysis.shortening import Shorter, Trials
from dse.analysis.tasks import TaskKey
from dse.analysis.views import View
from dse.space.types import Space


def mending_cuts(space: Space, view: View, wrong: Sequence[Sequence[Shorter]]) -> Iterator[Shorter]:
    """The least cuts with each of which alone a design keeps all that is asked, smallest first.

    Parameters
    ----------
    wrong
        for each thing that is wrong with the design the cuts each of which would mend that. Where that is all that is
        wrong, what is mended everywhere is judged once more with all requirements: shorter times may break lower
        limits.
    """
    found = [{(item.name, item.section): item.by_ns for item in cuts} for cuts in wrong]
    if len(found) < 2:
        return
    named = [name for name in found[0] if all(name in cuts for cuts in found)]
    if not named:
        return
    trials = Trials(space, view)
    candidates = {(item.name, item.kind == "section"): item for item in trials.candidates(_keys(trials))}
    for name, by_ns in sorted(((one, max(cuts[one] for cuts in found)) for one in named), key=lambda item: item[1]):
        candidate = candidates.get(name)
        if candidate is not None:
            trial, seen = trials.whole(candidate, by_ns)
            if all(judge(build_limit(trial, item), seen).holds for item in space.requirements):
                yield Shorter(name[0], by_ns, name[1])


def _keys(trials: Trials) -> list[TaskKey]:
    """Every task of the design."""
    schedule, processors = trials.schedule, range(len(trials.space.processors))
    return [turn.key for processor in processors for core in schedule.cores(processor) for turn in core]
