"""Which single shorter time would be enough for what is late, found by asking the analysis again.

A candidate is the longest time of one task's jobs, of an interrupt, or of a section that nothing interrupts. With it
shorter by so much the response times are found anew, with all jitter that follows from them; every thread keeps its
core and its place in the order there. Shorter jobs never make a response time longer (docs/semantics.md, section 4.3),
so that the least cut is found by halves, and what is said is enough, exactly: 1 ns less of it is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Literal

from dse.analysis.diagnosis.reservation_budgets import least
from dse.analysis.diagnosis.what_if import only, with_shorter_interrupt, with_shorter_job, with_shorter_section
from dse.analysis.limits import build_limit, judge
from dse.analysis.messages.stages import counted_buses
from dse.analysis.scheduling.busy_window import Part, TaskKey
from dse.analysis.scheduling.fixed_point import response_ns, solve
from dse.analysis.scheduling.model import Ends, System
from dse.analysis.scheduling.order import Schedule
from dse.analysis.scheduling.responses import solution_of
from dse.analysis.scheduling.waits import told_name
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at
from dse.support.json_fields import FIGURE
from dse.support.units import Exact

MOST_CANDIDATES = 64
"""No more times than this are shortened for one thread, its own first and what is most urgent next."""
MOST_ROUNDS = 10_000
"""No more cuts are looked for in a design when its tasks have been looked at so often, each in each round; seconds."""


@dataclass(frozen=True)
class Shorter:
    """A reduction of one execution time that alone lets a late thread meet its limit.

    In ns; the least whole cut that is enough while every other time stays.
    """

    name: Annotated[str, "The thread, its piece, or the interrupt."]
    by_ns: Annotated[int, FIGURE, "How much less each of its jobs takes then, or each of its sections."]
    section: Annotated[bool, "Whether its section that nothing interrupts is meant, not its jobs."] = False


@dataclass(frozen=True)
class Shortenable:
    """A longest time that may be shorter by `most_ns`: of a component's jobs or section, or a processor's interrupt.

    `part` names the thread's part or the interrupt's index; `most_ns` is the whole time.
    """

    kind: Literal["job", "section", "interrupt"]
    number: int
    part: Part | int
    name: str
    most_ns: int


class Trials:
    """A design with the cores and orders that it has, to be asked again with a shorter time.

    Cores and orders are kept: the question is what a faster job would change, not what another design would.
    """

    def __init__(self, space: Space, view: View) -> None:
        self.space, self.view = space, view
        self._asked: dict[object, Ends] = {}
        self._spent = 0

    @cached_property
    def system(self) -> System:
        """The system of the design.

        Stages and resources with all times of the design, in ns.
        """
        return solution_of(self.space, self.view).system

    def candidates(self, keys: Sequence[TaskKey]) -> list[Shortenable]:
        """The times whose reduction shortens the response times of these tasks: their own, interference and blocking.

        At most `MOST_CANDIDATES`; jobs and sections with no time are left out.
        """
        by_part: dict[tuple[str, int, Part | int], Shortenable] = {}
        for item in (*(self._job(key) for key in keys), *(one for key in keys for one in self._beside(key))):
            if item.most_ns > 0:
                by_part.setdefault((item.kind, item.number, item.part), item)
        return list(by_part.values())[:MOST_CANDIDATES]

    def _beside(self, key: TaskKey) -> Iterator[Shortenable]:
        place = self.system.place(key)
        if place is None:
            return
        resource, entry = place[0], place[0].entries[place[1]]
        for index, item in enumerate(resource.interrupts):
            yield Shortenable("interrupt", resource.processor, index, item.name, item.worst_ns - 1)
        yield from (self._job(resource.entries[position].key) for position in entry.before)
        longest: dict[int, int] = {}
        for (number, _), section_ns in entry.blockers:
            longest[number] = max(section_ns, longest.get(number, 0))
        for number, longest_ns in longest.items():
            yield Shortenable("section", number, "thread", self.space.components[number].stated_as, longest_ns)

    def _job(self, key: TaskKey) -> Shortenable:
        stage = self.system.stages.get(key) if key[1] != "message" else None
        return Shortenable("job", *key, told_name(self.space, key), 0 if stage is None else int(stage.worst_ns) - 1)

    def shortened(self, item: Shortenable, by_ns: int) -> System:
        """The system with a candidate that takes `by_ns` less; threads keep their cores.

        A new `System`; `by_ns` is at most `Shortenable.most_ns`.
        """
        if item.kind == "interrupt":
            return with_shorter_interrupt(self.system, item.number, int(item.part), by_ns)
        if item.kind == "section":
            return with_shorter_section(self.system, item.number, item.most_ns - by_ns)
        key: TaskKey = (item.number, "callback" if item.part == "callback" else "thread")
        return with_shorter_job(self.system, key, by_ns)

    def whole(self, item: Shortenable, by_ns: int) -> tuple[Space, View]:
        """The space with a shorter time, and a design of it that knows all response times, for figures of flows.

        Response times are solved with the shorter time, so that flows can be evaluated with them.
        """
        solution = solve(self.shortened(item, by_ns))
        self._spent += solution.rounds * len(solution.ends)
        view = View(self.view.design)
        view.memo["responses"], view.memo["solution"] = solution.ends, solution
        space = self.space
        if item.kind == "job":
            components = list(space.components)
            component, stage = components[item.number], solution.system.stages[item.number, item.part]  # type: ignore[index]
            field = "callback_ns" if item.part == "callback" else "execution_ns"
            tree = at(getattr(component, field), self.view)
            changed = (stage.best_ns, stage.worst_ns, *tree[2:])
            components[item.number] = replace(component, **{field: changed})  # type: ignore[arg-type]
            space = replace(space, components=tuple(components))
        return space, view

    def shorter(
        self, keys: Sequence[TaskKey], others: Sequence[TaskKey], is_in_time: Callable[[Exact | None], bool]
    ) -> Iterator[Shorter]:
        """The least cut of each candidate with which the last of these tasks `is_in_time`, where one is enough.

        Candidates of `others` count, too: of threads because of which it has no bound.
        """
        last = keys[-1]
        needed = [place for place in Schedule(self.space, self.view).needed([last]) if place[2]]
        places = frozenset((processor, core) for processor, core, _ in needed)
        counted = [turn.key for *_, turns in needed for turn in turns]
        resources = only(self.system, places).resources
        is_simple = all(self.system.stages[key].is_lone for key in counted) and all(
            entry.executor is None and not entry.is_piece
            for resource in resources
            for entry in resource.entries
            if entry.key in counted
        )

        def shorter_ns(item: Shortenable, by_ns: int) -> Exact | None:
            if is_simple:
                return response_ns(self.shortened(item, by_ns), last, {})
            return self._known(places, item, by_ns)[last]

        yield from self.least_cuts(
            self.candidates([*keys, *others]), lambda item, by_ns: is_in_time(shorter_ns(item, by_ns))
        )

    def least_cuts(
        self, candidates: Sequence[Shortenable], is_enough: Callable[[Shortenable, int], bool]
    ) -> Iterator[Shorter]:
        """The least cut of each candidate that is enough, if one is; of as many as `MOST_ROUNDS` leaves time for.

        Bisection over whole ns, in the order of `candidates`.
        """
        for item in candidates:
            if self._spent > MOST_ROUNDS:
                return
            if is_enough(item, item.most_ns):
                by_ns = least(lambda by_ns, item=item: is_enough(item, by_ns), item.most_ns)  # type: ignore[misc]
                yield Shorter(item.name, by_ns, item.kind == "section")

    def _known(self, places: frozenset[tuple[int, int]], item: Shortenable, by_ns: int) -> Ends:
        """The response times of all that is on some cores, which decide each other; threads there ask for the same."""
        question = places, item, by_ns
        if question not in self._asked:
            shorter = self.shortened(item, by_ns)  # with buses everything may have a part in everything
            solution = solve(shorter if counted_buses(self.space) else only(shorter, places))
            self._asked[question] = solution.ends
            self._spent += solution.rounds * len(solution.ends)
        return self._asked[question]


# Which single shorter time would let a design keep all that is asked at once.
#
# Of each thing that is wrong with it the least cuts are known by which it alone is kept
# (`dse.analysis.diagnosis.shortening`). Shorter jobs never make another response time longer, so that the greatest of
# these cuts of one job is enough for all.


def mending_cuts(space: Space, view: View, wrong: Sequence[Sequence[Shorter]]) -> Iterator[Shorter]:
    """The least cuts with each of which alone a design keeps all that is asked, smallest first.

    Parameters
    ----------
    wrong
        for each thing that is wrong with the design the cuts each of which would mend that. Where that is all that is
        wrong, what is mended everywhere is judged once more with all requirements: shorter times may break lower
        limits.
    """
    kept_cuts = [{(item.name, item.section): item.by_ns for item in cuts} for cuts in wrong]
    if len(kept_cuts) < 2:
        return
    named = [name for name in kept_cuts[0] if all(name in cuts for cuts in kept_cuts)]
    if not named:
        return
    trials = Trials(space, view)
    candidates = {(item.name, item.kind == "section"): item for item in trials.candidates(_keys(trials))}
    for name, by_ns in sorted(((one, max(cuts[one] for cuts in kept_cuts)) for one in named), key=lambda item: item[1]):
        candidate = candidates.get(name)
        if candidate is not None:
            trial, seen = trials.whole(candidate, by_ns)
            if all(judge(build_limit(trial, item), seen).holds for item in space.requirements):
                yield Shorter(name[0], by_ns, name[1])


def _keys(trials: Trials) -> list[TaskKey]:
    """Every task of the design."""
    return [entry.key for resource in trials.system.resources for entry in resource.entries]
