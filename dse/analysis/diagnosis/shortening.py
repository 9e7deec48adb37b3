"""Which single shorter time would be enough for what is late, found by asking the analysis again.

A candidate is the longest time of one task's jobs, of an interrupt, or of a section that nothing interrupts. With it
shorter by so much the response times are found anew, with all jitter that follows from them; every thread keeps its
core and its place in the order there. Shorter jobs never make a response time longer (docs/semantics.md, section 4.3),
so that the least cut is found by halves, and what is said is enough, exactly: 1 ns less of it is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from dse.analysis.diagnosis.reservation_budgets import least
from dse.analysis.limits import build_limit, judge
from dse.analysis.scheduling.holistic import counted_fixed_point, one_response_ns
from dse.analysis.scheduling.releases import is_lone
from dse.analysis.scheduling.tasks import Part, TaskKey
from dse.analysis.scheduling.turns import Schedule, blockers, turns_of
from dse.analysis.scheduling.waiting import told_name
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
    """What alone would let a late thread end in time."""

    name: Annotated[str, "The thread, its piece, or the interrupt."]
    by_ns: Annotated[int, FIGURE, "How much less each of its jobs takes then, or each of its sections."]
    section: Annotated[bool, "Whether its section that nothing interrupts is meant, not its jobs."] = False


@dataclass(frozen=True)
class Candidate:
    """A longest time that may be shorter by `most_ns`: of a component's jobs or section, or a processor's interrupt."""

    kind: Literal["job", "section", "interrupt"]
    number: int
    part: Part | int
    name: str
    most_ns: int


class _Trial(View):
    """A design that is asked about once: nothing of it is remembered for other designs."""

    __slots__ = ()


class Trials:
    """A design with the cores and orders that it has, to be asked again with a shorter time."""

    def __init__(self, space: Space, view: View) -> None:
        self.space, self.view = space, view
        self.schedule = Schedule(space, view)
        self._asked: dict[object, Mapping[TaskKey, Exact | None]] = {}
        self._spent = 0
        self._has_sections = any(item.section_ns is not None for item in space.components)

    def candidates(self, keys: Sequence[TaskKey]) -> list[Candidate]:
        """What may be shortened for these tasks of a thread: they, what goes before them, and what blocks them."""
        found: dict[tuple[str, int, Part | int], Candidate] = {}
        for item in (*(self._job(key) for key in keys), *(one for key in keys for one in self._beside(key))):
            if item.most_ns > 0:
                found.setdefault((item.kind, item.number, item.part), item)
        return list(found.values())[:MOST_CANDIDATES]

    def _beside(self, key: TaskKey) -> Iterator[Candidate]:
        place = self.schedule.place(key)
        if place is None:
            return
        processor, core, turn = place
        turns = self.schedule.cores(processor)[core]
        slot = self.space.processors[processor]
        for index, item in enumerate(at(slot.interference, self.view)):
            yield Candidate("interrupt", processor, index, item.name, item.worst_ns - 1)
        before = {*turn.rivals(turns), *(turn.outside(turns) if turn.reservation is not None else ())}
        yield from (self._job(turns[position].key) for position in sorted(before))
        for number, longest_ns in blockers(self.space, turns, turn, self.view).items():
            yield Candidate("section", number, "thread", self.space.components[number].stated_as, longest_ns)

    def _job(self, key: TaskKey) -> Candidate:
        component = self.space.components[key[0]]
        given = at(component.callback_ns if key[1] == "callback" else component.execution_ns, self.view)
        return Candidate("job", *key, told_name(self.space, key), 0 if given is None else given[1] - 1)

    def shortened(self, item: Candidate, by_ns: int) -> tuple[Space, View]:
        """The space with a candidate that takes so much less, and the design in it, whose threads stay where they are.

        A shortest time that is longer than the longest one then is the same as that.
        """
        space, view = self.space, self.view
        if item.kind == "interrupt":
            slot = space.processors[item.number]
            given = list(at(slot.interference, view))
            given[int(item.part)] = replace(given[int(item.part)], worst_ns=given[int(item.part)].worst_ns - by_ns)
            slots = list(space.processors)
            slots[item.number] = replace(slot, interference=tuple(given))
            return self._kept(replace(space, processors=tuple(slots)))
        components = list(space.components)
        component = components[item.number]
        if item.kind == "section":
            components[item.number] = replace(component, section_ns=item.most_ns - by_ns)
        else:
            field = "callback_ns" if item.part == "callback" else "execution_ns"
            best, worst, *more = at(getattr(component, field), view)
            changed = (min(best, worst - by_ns), worst - by_ns, *more)
            components[item.number] = replace(component, **{field: changed})  # type: ignore[arg-type]
        return self._kept(replace(space, components=tuple(components)))

    def _kept(self, space: Space) -> tuple[Space, View]:
        trial = _Trial(self.view.design)
        for processor in range(len(space.processors)):
            cores = self.schedule.cores(processor)
            if self._has_sections:  # these are no longer than the jobs
                cores = [turns_of(space, list(dict.fromkeys(turn.key[0] for turn in core)), trial) for core in cores]
            trial.memo["turns", processor] = cores
        return space, trial

    def whole(self, item: Candidate, by_ns: int) -> tuple[Space, View]:
        """The same as a design with all response times, for figures that count these."""
        space, trial = self.shortened(item, by_ns)
        cores = [core for processor in range(len(space.processors)) for core in trial.memo["turns", processor]]
        view = View(self.view.design)
        view.memo |= trial.memo
        view.memo["responses"], rounds = counted_fixed_point(space, cores, trial)
        self._spent += rounds * len(view.memo["responses"])
        return space, view

    def shorter(
        self, keys: Sequence[TaskKey], others: Sequence[TaskKey], is_in_time: Callable[[Exact | None], bool]
    ) -> Iterator[Shorter]:
        """The least cut of each candidate with which the last of these tasks `is_in_time`, where one is enough.

        Candidates of `others` count, too: of threads because of which it has no bound.
        """
        last = keys[-1]
        needed = [core for core in self.schedule.needed([last]) if core]
        is_simple = all(
            is_lone(self.space, turn.key, self.view) and not turn.pieces and turn.executor is None
            for core in needed
            for turn in core
        )
        places = tuple(sorted(self._place(core[0].key) for core in needed))

        def response_ns(item: Candidate, by_ns: int) -> Exact | None:
            if not is_simple:
                return self._known(places, item, by_ns)[last]
            space, trial = self.shortened(item, by_ns)
            place = Schedule(space, trial).place(last)
            assert place is not None
            return one_response_ns(space, trial.memo["turns", place[0]][place[1]], place[2], trial)

        yield from self.least_cuts(
            self.candidates([*keys, *others]), lambda item, by_ns: is_in_time(response_ns(item, by_ns))
        )

    def least_cuts(
        self, candidates: Sequence[Candidate], is_enough: Callable[[Candidate, int], bool]
    ) -> Iterator[Shorter]:
        """The least cut of each candidate that is enough, if one is; of as many as `MOST_ROUNDS` leaves time for."""
        for item in candidates:
            if self._spent > MOST_ROUNDS:
                return
            if is_enough(item, item.most_ns):
                by_ns = least(lambda by_ns, item=item: is_enough(item, by_ns), item.most_ns)  # type: ignore[misc]
                yield Shorter(item.name, by_ns, item.kind == "section")

    def _place(self, key: TaskKey) -> tuple[int, int]:
        place = self.schedule.place(key)
        assert place is not None
        return place[:2]

    def _known(
        self, places: tuple[tuple[int, int], ...], item: Candidate, by_ns: int
    ) -> Mapping[TaskKey, Exact | None]:
        """The response times of all that is on some cores, which decide each other; threads there ask for the same."""
        asked = places, item, by_ns
        if asked not in self._asked:
            space, trial = self.shortened(item, by_ns)
            cores = [trial.memo["turns", processor][core] for processor, core in places]
            self._asked[asked], rounds = counted_fixed_point(space, cores, trial)
            self._spent += rounds * len(self._asked[asked])
        return self._asked[asked]


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
