"""The least value of an objective from both sides, where neither is found by itself.

Sums of waiting times have weak relaxations: a solver that improves its designs proves no bound, and one that proves
bounds meets no good designs. Here bounds are proved from below first. Then the solver is only asked for what lies in
the lowest part of what is left between the bound and the best design: a limit on the sum leaves each thread so little
time to wait that most places are excluded at once. Either answer makes the gap smaller. Where objectives are weighed
against each other a limit on their sum says little of each, and all that is better is asked for at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dse.encode.linear import EXACT_LIMIT
from dse.search.solver.call import Call
from dse.search.solver.pooled_cores import PoolMemory, pooled
from dse.search.solver.settings import BARE, CLOSING, CLOSING_RANGE, FROM_BELOW, RELAXED
from dse.search.solver_answer import Answer, Found, NoSuchDesign, Unfinished

if TYPE_CHECKING:
    from dse.encode.model import EncodedSpace


@dataclass
class Narrowing:
    """The experience of past questions: the number of slices of which the lowest is asked for, and failed attempts.

    `quick` is how much work clause learning alone is given for a range; `bounded` has the parts (by their literals) of
    the question as it stands whose bound it does not raise any more.
    """

    slices: int
    quick: float
    bounded: set[tuple[int, ...]] = field(default_factory=set)

    def begin(self) -> None:
        """Begin another question.

        What was learnt about parts of the last question is dropped.
        """
        self.bounded.clear()


def narrowed(call: Call, known: Narrowing, work: float) -> Answer:
    """The best design of the model as it stands, with a given amount of work; what was proved where that is not enough.

    Bounds from below and designs from above take turns, until they meet or `work` (deterministic time) is used up.
    """
    end, tuning = call.work + work, call.tuning.bounding
    is_single = _counts_one(call)
    first = call.raise_least(0)
    answer: Answer = Unfinished(first)
    if is_single and call.within not in known.bounded:
        answer = call.run(FROM_BELOW, min(tuning.most_below, work / tuning.below))
        if isinstance(answer, Unfinished) and first and (answer.bound or 0) <= first:
            known.bounded.add(call.within)
    while isinstance(answer, Unfinished) and answer.bound is not None:
        least, best = answer.bound, answer.best
        left = end - call.work
        if left < work / tuning.least or call.out_of_time():
            return Unfinished(least, best)
        call.raise_least(least)
        most = call.most(best)
        if most is None:  # nothing to be better than
            answer = call.any_design([(CLOSING, left)])
            if isinstance(answer, Unfinished):
                return Unfinished(least)
            answer = Unfinished(least, answer) if isinstance(answer, Found) else answer
            continue
        middle = least + (most - least) // known.slices if is_single else most
        answer = _in_range(call, known, left, best, middle)
        if isinstance(answer, NoSuchDesign):
            narrower = known.slices // tuning.change
            known.slices = tuning.widest if _counts_options(call) else max(tuning.widest, narrower)
            if middle >= most:
                return best or answer
            answer = Unfinished(middle + 1, best)
        elif isinstance(answer, Unfinished):
            least = max(least, answer.bound or 0)
            if answer.best is best:
                known.slices = min(tuning.narrowest, known.slices * tuning.change)
                return Unfinished(least, best)
            answer = Unfinished(least, answer.best)
    return answer


def _in_range(call: Call, known: Narrowing, work: float, best: Found | None, most: int) -> Answer:
    """The best design in a range of values, or that there is none; unfinished with any that is better than `best`."""
    tuning = call.tuning.bounding
    answer: Answer = Unfinished(best=best)
    if known.quick >= tuning.least_quick:
        answer = call.run(BARE, min(work, known.quick), best, most)
        known.quick = known.quick / 2 if isinstance(answer, Unfinished) else min(tuning.most_quick, 2 * known.quick)
    if isinstance(answer, Unfinished) and answer.best is best:
        answer = call.run(CLOSING_RANGE, work, best, most)
    return answer


def _counts_one(call: Call) -> bool:
    """Whether one objective is minimised, without regard to others."""
    return call.weights is not None and sum(map(bool, call.weights)) == 1


def _counts_options(call: Call) -> bool:
    """Whether what is minimised is a plain sum over options: then a range of it says nothing of waiting."""
    if call.weights is None:
        return False
    weighed = {number for number, weight in enumerate(call.weights) if weight}
    return weighed.isdisjoint(waiting_axes(call.encoded))


def waiting_axes(encoded: EncodedSpace) -> frozenset[int]:
    """The objectives that depend on how long threads wait: those that are no plain sums over options, where any may be.

    What a part of the space has of them is proved once for all other objectives where these are what is minimised, the
    loosest limits on the others first; with plain sums minimised it is proved anew for each (decision record 9).
    """
    chosen = {literal.index for literals in encoded.options for literal in literals}
    return frozenset(
        axis
        for axis, item in enumerate(encoded.objectives)
        if encoded.is_loose and not (item.branches and all(chosen.issuperset(parts) for *_, parts in item.branches))
    )


def lowest(call: Call, work: float, pools: PoolMemory | None = None) -> Answer:
    """The best design from the known bound on: one value of the objective at first, then twice as many at a time.

    Where designs are hard to pack a solver finds those near its bound when it is asked for nothing else, or proves that
    there are none. With `pools`, what it does not find at once is asked of pooled cores first
    (`dse.search.solver.pooled_cores`), and what is left is less.
    """
    end, width = call.work + work, 0
    best: Found | None = None
    while True:
        least, known = call.raise_least(0), call.most(best)
        if best is not None and known is not None and known < least:
            return best
        most = EXACT_LIMIT if known is None else known  # no sum is beyond it
        middle = min(most, least + width)
        limit = max(0.0, end - call.work)
        limit = limit if pools is None else min(limit, call.tuning.lowest_first.at_once)
        answer = call.run(RELAXED, limit, None, middle)
        if isinstance(answer, Unfinished) and pools is not None:
            before = call.work
            better, pools = pooled(call, pools, answer.best or best), None
            if not isinstance(better, Unfinished):
                return better
            call.raise_least(better.bound or 0)
            best = better.best or answer.best
            end += call.work - before
            continue
        if isinstance(answer, Unfinished):
            return Unfinished(max(least, answer.bound or 0), answer.best or best)
        if isinstance(answer, Found) or middle == most:
            return best or answer if isinstance(answer, NoSuchDesign) else answer
        width = 2 * (call.raise_least(middle + 1) - least)
        if call.out_of_time() or call.work >= end:
            return Unfinished(middle + 1, best)
