"""Response times and the jitter that they pass on, as one fixed point.

Event-triggered threads inherit the streams of what triggers them, with the jitter that processing and transmission add
on the way (K. Tindell and J. Clark, "Holistic schedulability analysis for distributed hard real-time systems",
Microprocessing and Microprogramming 40, 1994).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Any

from dse.analysis.memo import Answering, Recall, knowing
from dse.analysis.rates import NS_PER_S
from dse.analysis.scheduling.growth import TooLongError, growth, steps_along
from dse.analysis.scheduling.overheads import interrupting
from dse.analysis.scheduling.releases import bounded_task, has_no_bound, is_lone, late_task, thread_releases
from dse.analysis.scheduling.responding import beside_piece, respond, respond_in
from dse.analysis.scheduling.response_time import PLAIN, Stream, Task, is_plain
from dse.analysis.scheduling.servers.reservations import before_task, blocking_ns
from dse.analysis.scheduling.servers.segments import Segments
from dse.analysis.scheduling.servers.succession import Succession
from dse.analysis.scheduling.tasks import TaskKey, alone_ns
from dse.analysis.scheduling.turns import Turn
from dse.analysis.views import View
from dse.space.model.space import Component, Space
from dse.space.model.trees import leaves
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact

MOST_ROUNDS = 4096
"""After so many rounds, those aside that are taken at once, what still grows is told to have no bound."""
SLOW = 32
"""Most systems stand still, or are beyond any bound, after fewer rounds."""
WORTH = 16
"""Following growth takes as long as some rounds."""
MOST_ALIKE = 4
"""After so many rounds at most growth may repeat: jitter goes from core to core."""
SHARED = 256
"""The number of tasks that designs share, for each thread: as many as its releases have jitter."""
KEPT_CORES = 4096
"""The number of cores whose response times are remembered."""


Lost = Callable[[Turn, Sequence[Turn], Sequence["Task | None"], "Mapping[TaskKey, Exact | None]"], None]
"""Told of a task that turns out to have no bound: its turn, those of its core, their tasks, and what is known then."""


def fixed_point(
    space: Space, cores: Sequence[Sequence[Turn]], view: View, lost: Lost | None = None
) -> dict[TaskKey, Exact | None]:
    """Response times and inherited jitter, raised together until both stand still; what keeps growing has no bound.

    Where round after round adds the same, as many rounds are taken at once as add the same for sure
    (`dse.analysis.scheduling.growth`).
    """
    return counted_fixed_point(space, cores, view, lost)[0]


def counted_fixed_point(
    space: Space, cores: Sequence[Sequence[Turn]], view: View, lost: Lost | None = None
) -> tuple[dict[TaskKey, Exact | None], int]:
    """The same, and the number of rounds."""
    work = _Rounds(space, cores, view)
    work.lost = lost
    history: deque[dict[Any, Any]] = deque(maxlen=2 * MOST_ALIKE + 1)
    pause, look = 1, SLOW
    while work.next():
        if work.count >= SLOW - 2 * MOST_ALIKE:
            history.append(work.state())
        if work.count >= look:
            pause = 1 if work.follow(history) >= WORTH else 2 * pause
            look = work.count + pause
    return work.known, work.count


def one_response_ns(space: Space, turns: Sequence[Turn], turn: Turn, view: View) -> Exact | None:
    """The response time of a task of a core where no release depends on one, and none is of a thread with segments."""
    work = _Rounds(space, [turns], view)
    tasks = [bounded_task(space, other.key, work.known, view) for other in turns]
    return work.found(turn, turns, tasks, work.interrupts[0], Succession(space, turns, work.known, view))


class _Rounds:
    """The response times of the tasks of some cores, as they are after `count` rounds: lower bounds that rise."""

    def __init__(self, space: Space, cores: Sequence[Sequence[Turn]], view: View) -> None:
        self.space, self.cores, self.view = space, cores, view
        self.known: dict[TaskKey, Exact | None] = {
            turn.key: alone_ns(space.components[turn.key[0]], turn.key[1], view)[1] for turns in cores for turn in turns
        }
        self.segments = Segments(space, cores, view)
        self.known |= {
            turn.key: self.segments.alone_ns(turn.key[0]) for turns in cores for turn in turns if turn.pieces
        }
        self.interrupts = [interrupting(space, [turn.key[0] for turn in turns[:1]], view) for turns in cores]
        self.horizon = _horizon_ns(space)
        self.asked = _answering(view, self.known)
        self.lone = _lone(space, cores, self.known, view, self.asked)
        self.before_that: list[list[Task | None] | None] = [None] * len(cores)
        self.count = 0
        self.lost: Lost | None = None

    def next(self) -> bool:
        """Raise all once, core by core; whether anything rose."""
        self.count, changed = self.count + 1, False
        space, known, view = self.space, self.known, self.view
        look_at_the_clock()
        for place, (turns, before) in enumerate(zip(self.cores, self.interrupts, strict=True)):
            tasks = [
                late_task(space, turn.key, view) if has_no_bound(space, turn.key[0], known)
                else self.lone[turn.key] if turn.key in self.lone else _task(space, turn.key, known, view, self.asked)
                for turn in turns
            ]  # fmt: skip
            earlier = self.before_that[place]
            if earlier is not None and all(map(_is_same, tasks, earlier)) and not any(map(_hangs_on_others, turns)):
                continue  # as in the round before
            self.before_that[place] = tasks
            together = None if self.asked is None or before else _on_core(turns, tasks)
            succession = Succession(space, turns, known, view)
            for number, turn in enumerate(turns):
                key = turn.key
                found = together[number] if together is not None else self.found(turn, turns, tasks, before, succession)
                if found is not None and self.count > 1 and (found > self.horizon or self.count > MOST_ROUNDS):
                    found = found if found == known[key] else None
                if known[key] is not None and found != known[key]:
                    if found is None and self.lost is not None:
                        self.lost(turn, turns, tasks, known)
                    known[key], changed = found, True
                    self.asked = self.asked if type(found) in PLAIN else None
        return changed

    def found(
        self,
        turn: Turn,
        turns: Sequence[Turn],
        tasks: Sequence[Task | None],
        before: Sequence[Task],
        succession: Succession,
    ) -> Exact | None:
        """The response time of a task of a core, with what is known so far."""
        space, known, view, segments = self.space, self.known, self.view, self.segments
        first = before_task(space, turns, turn, tasks, before, view)
        rivals = [*first, *(tasks[position] for position in turn.rivals(turns))]
        released = thread_releases(space, turn.pieces[0], known, view) if turn.pieces else ((), None)
        if turn.executor is None:
            found = respond(*beside_piece(turn, turns, tasks, rivals), blocking_ns(turn))
        else:
            since = segments.since_ns(turn, known, *released) if turn.pieces else {}
            found = respond_in(space, turns, tasks, first, turn, succession, since)
        if not turn.pieces:
            return found
        again = ((released[0] or ()), released[1]) if turn.shares_turn(turns) else ((), None)
        return segments.end_ns(turn, found, known, *released, partial(_beside, rivals, again))

    def state(self) -> dict[Any, Any]:
        """All that the next round depends on."""
        return {**self.known, **self.segments.spans}

    def follow(self, history: Sequence[dict[Any, Any]]) -> int:
        """Take the next rounds at once, as far as they add the same for sure, if the last ones did; how many."""
        found = growth(history)
        if found is None:
            return 0
        rounds, grown = found
        try:
            steps = steps_along(history[-1], grown, partial(self._raised, rounds))
        except TooLongError:
            return 0
        for key, more in grown.items():
            kept: dict[Any, Any] = self.segments.spans if key in self.segments.spans else self.known
            kept[key] += steps * more
        return steps * rounds

    def _raised(self, rounds: int, state: dict[Any, Any]) -> dict[Any, Any]:
        """All that is known some rounds after a state, of numbers that may be lines."""
        other = copy(self)
        other.segments = copy(self.segments)
        other.segments.spans = {key: state[key] for key in self.segments.spans}
        other.known = {key: state[key] for key in self.known}
        other.asked, other.before_that, other.lost = None, [None] * len(self.cores), None
        for _ in range(rounds):
            other.next()
        return other.state()


def _beside(
    rivals: Sequence[Task | None], released: tuple[tuple[Stream, ...], int | None], worst_ns: int, blocked_ns: Exact
) -> Exact | None:
    return respond(Task("", worst_ns, *released), rivals, blocked_ns)


def _answering(view: View, known: Mapping[TaskKey, Exact | None]) -> Answering | None:
    """A whole design that answers what is known; None where figures carry more than a number (`is_plain`)."""
    if type(view) is View and all(type(found) in PLAIN for found in known.values()):
        return Answering(view, known)
    return None


@dataclass(frozen=True)
class _Shared:
    """A task that designs share, and whether its releases depend on no other task."""

    task: Task | None
    is_lone: bool


_TASKS: Recall[_Shared] = Recall(SHARED)


def _shared(space: Space, key: TaskKey, view: View) -> _Shared:
    known: Any = knowing(view)
    return _Shared(bounded_task(space, key, known, view), is_lone(space, key, view))


def _task(
    space: Space, key: TaskKey, known: Mapping[TaskKey, Exact | None], view: View, asked: Answering | None
) -> Task | None:
    """A task as its releases are known; where the design answers, the same object wherever the answers are the same."""
    return bounded_task(space, key, known, view) if asked is None else _TASKS.recall(space, key, asked, _shared).task


def _lone(
    space: Space,
    cores: Sequence[Sequence[Turn]],
    known: Mapping[TaskKey, Exact | None],
    view: View,
    asked: Answering | None,
) -> dict[TaskKey, Task | None]:
    """The tasks whose releases depend on no other task: they stay as they are."""
    keys = [turn.key for turns in cores for turn in turns]
    if asked is None:
        return {key: bounded_task(space, key, known, view) for key in keys if is_lone(space, key, view)}
    # who chooses cores asks hundreds of times of a design; with the space, so that its id stays its own
    _, memory = view.memo.setdefault(("lone", id(space)), (space, {}))
    for key in keys:
        if key not in memory:
            memory[key] = _TASKS.recall(space, key, asked, _shared)
    return {key: memory[key].task for key in keys if memory[key].is_lone}


_CORES: dict[tuple[int, ...], tuple[Any, Any, list[Exact | None]]] = {}


def _on_core(turns: Sequence[Turn], tasks: Sequence[Task | None]) -> list[Exact | None] | None:
    """The response times of the tasks of a core that nothing else goes before, remembered by what shares it.

    None where an executor, a reservation or segments have a part in them.
    """
    key = (id(turns), *map(id, tasks))
    if (kept := _CORES.get(key)) is not None:  # once: another thread may empty it
        return kept[2]
    if any(turn.executor is not None or turn.pieces or turn.reservation is not None for turn in turns):
        return None
    are_plain = all(task is None or is_plain(task) for task in tasks)
    found = [
        respond(task, [tasks[position] for position in turn.rivals(turns)], blocking_ns(turn), are_plain=are_plain)
        for turn, task in zip(turns, tasks, strict=True)
    ]
    if len(_CORES) >= KEPT_CORES:
        _CORES.clear()
    _CORES[key] = turns, tasks, found  # which keeps alive whatever the key names
    return found


def _is_same(one: Task | None, other: Task | None) -> bool:
    """Whether two tasks have the same response time for sure."""
    if one is other:
        return True
    return one is not None and other is not None and is_plain(one) and is_plain(other) and one == other


def _hangs_on_others(turn: Turn) -> bool:
    """Whether more than the releases of the tasks of its core has a part in a response time."""
    return bool(turn.pieces) or turn.executor is not None


def _horizon_ns(space: Space) -> int:
    """Ten times the longest period: response times that grow beyond it by their own jitter have no bound."""
    for components, known in _HORIZON:
        if components is space.components:
            return known
    periods = [leaf for item in space.components for leaf in leaves(item.period_ns) if leaf is not None]
    found: int = 10 * max(periods, default=NS_PER_S)
    _HORIZON[:] = [(space.components, found)]
    return found


_HORIZON: list[tuple[tuple[Component, ...], int]] = []
"""That of the components that were asked about last."""
