"""Whether threads that share a core meet their limits on response times, asked of one thread more at a time.

Whoever puts threads on cores asks hundreds of times whether a core may take one more of them (an admission test). The
response times among fewer threads are a place to begin from, for they are no longer: those that are known, and that
nothing new goes before, stay as they are, and the others follow from there by the recurrence of M. Joseph and P. Pandya
("Finding response times in a real-time system", The Computer Journal 29(5), 1986).
Threads of one chain do not wait for each other; where they are in time though each counts as if it did, which takes no
analysis, they are in time. Where they are not, and where more than the preemption of tasks has a part in it, the
analysis is asked as a whole (`dse.analysis.scheduling.responses`), with the same answers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from dse.analysis.limits import HOLDS
from dse.analysis.placement.priority_assignment import Latest, best_options
from dse.analysis.scheduling.busy_window import Task, TaskKey, most_jobs, response_time_ns
from dse.analysis.scheduling.event_models import EventModels
from dse.analysis.scheduling.model import Ends, Stage
from dse.analysis.scheduling.order import turns_of
from dse.analysis.scheduling.overheads import interrupting
from dse.analysis.scheduling.policies.coupled import is_coupled
from dse.analysis.scheduling.priorities import most_levels, number_of, order_ns
from dse.analysis.scheduling.resolve import reader, with_senders
from dse.analysis.scheduling.responses import UNBOUNDED_NS, counted_ns, subset_responses
from dse.analysis.views import View
from dse.space.model.space import OpenPriority, Space
from dse.support.units import Exact

NUMBERS = (int, Fraction)


class _Latest(NamedTuple):
    """A response time is to be at most so long, or shorter unless it `allows_equal`; the tighter one is the smaller."""

    bound_ns: Fraction | int
    allows_equal: bool

    def allows(self, response_ns: Exact) -> bool:
        """Whether a response time keeps it."""
        return response_ns <= self.bound_ns if self.allows_equal else response_ns < self.bound_ns


ANY = _Latest(UNBOUNDED_NS, allows_equal=False)
"""Any response time that has a bound."""


@dataclass(frozen=True)
class _Simple:
    """A thread that is one task, which only tasks of a lower or the same `turn` delay.

    `stages` are it and all that releases it, and `upstream` those whose response times are jitter of its releases.
    `latest` is the limit on its response
    time, None where any will do.
    """

    key: TaskKey
    turn: tuple[int, int, int]
    stages: Mapping[TaskKey, Stage]
    upstream: tuple[TaskKey, ...]
    latest: _Latest | None


@dataclass(frozen=True)
class _Among:
    """What is known of threads that share a core, by number: their tasks, and the response times that matter, in ns."""

    tasks: Mapping[int, Task]
    responses: Mapping[int, Exact]


class _NotSimple(Exception):
    """The analysis has to be asked."""


NOBODY = _Among({}, {})
MOST_ROUNDS = 64
"""After so many rounds in which response times of threads of one chain still rise the analysis is asked."""


class Admission:
    """Tells whether threads meet their limits on a core of their own, in some order of those whose order is open.

    With further threads response times are no shorter, so that what is not admitted is not admitted beside others.
    `orders` are the priorities that are open in the design; `latest` are the limits in ns.
    """

    def __init__(self, space: Space, view: View, latest: Latest, orders: Sequence[OpenPriority] = ()) -> None:
        self.space, self.view, self.latest = space, view, latest
        self._free = {item.component: item for item in orders}
        self._simple: dict[int, _Simple | None] = {}
        self._tasks: dict[tuple[int, tuple[Exact | None, ...]], Task] = {}
        self._among: dict[frozenset[int], _Among | None] = {}
        self._answers: dict[frozenset[int], bool] = {}

    def __call__(self, numbers: Sequence[int]) -> bool:
        """Whether the threads with these numbers, the newest last, meet their limits together."""
        group = frozenset(numbers)
        answer = self._answers.get(group)
        if answer is None:
            try:
                answer = self._step_by_step(numbers) is not None
            except _NotSimple:
                answer = self._by_analysis(numbers)
            self._answers[group] = answer
        return answer

    def _by_analysis(self, numbers: Sequence[int]) -> bool:
        if self._free:
            return best_options(self.space, numbers, self._free, self.latest, self.view.design) is not None
        known = subset_responses(self.space, [numbers], self.view)
        for number in numbers:
            response = Fraction(counted_ns(known.get((number, "thread"), 0)))
            if not all(HOLDS[operator](response, bound) for operator, bound in self.latest.get(number, ())):
                return False
        return True

    def _simple_of(self, number: int) -> _Simple:
        if number not in self._simple:
            self._simple[number] = None if self._free else self._made(number)
        simple = self._simple[number]
        if simple is None:
            raise _NotSimple
        return simple

    def _made(self, number: int) -> _Simple | None:
        space, view = self.space, self.view
        turns = turns_of(space, [number], view)
        if len(turns) != 1 or turns[0].executor is not None or turns[0].pieces or turns[0].reservation is not None:
            return None
        if space.components[number].section_ns is not None or turns[0].key[1] != "thread":
            return None
        if most_levels(space, [number], view) is not None or interrupting(space, [number], view):
            return None
        priority = number_of(space.components[number], view)
        time = order_ns(space, number, view) if priority is None else Fraction(-priority)
        if time is None or time.denominator != 1:
            return None
        limits = [
            _Latest(int(bound) if bound.denominator == 1 else bound, operator == "<=")
            for operator, bound in self.latest.get(number, ())
        ]
        limits = [item for item in limits if not item.allows(UNBOUNDED_NS)]  # which counts where there is no bound
        turn = (0, int(time), 0) if priority is not None else (1, int(time), number)
        key = turns[0].key
        stages = with_senders([key], reader(space, view))
        if is_coupled(stages, stages[key]):
            return None
        return _Simple(key, turn, stages, tuple(item for item in stages if item != key), min(limits, default=None))

    def _step_by_step(self, numbers: Sequence[int]) -> _Among | None:
        """What is known of the threads together; None where one of them is late."""
        first = len(numbers)
        while first and frozenset(numbers[:first]) not in self._among:
            first -= 1
        among = self._among[frozenset(numbers[:first])] if first else NOBODY
        for count in range(first + 1, len(numbers) + 1):
            among = None if among is None else self._with(among, numbers[:count])
            self._among[frozenset(numbers[:count])] = among
        return among

    def _with(self, before: _Among, numbers: Sequence[int]) -> _Among | None:
        """Tasks and response times of threads on a core, the last of `numbers` new there; None where one is late.

        `before` has those of the others, which are in time. Threads that release others of them wait for those, too,
        and pass their response times on as jitter: this is never too short. Raises `_NotSimple` where one of them is
        late in that way.
        """
        order = sorted((self._simple_of(number).turn, number) for number in numbers)
        upstream = {key for number in numbers for key in self._simple_of(number).upstream}
        passing = {number: key for number in numbers if (key := self._simple_of(number).key) in upstream}
        ends: Ends = {
            key: before.responses.get(number, self._task(number, {}).worst_ns) for number, key in passing.items()
        }
        for _ in range(MOST_ROUNDS):
            after = self._risen(before, order, ends, passing)
            if after is None or not passing:
                break
            if all(after.responses[number] == ends[key] for number, key in passing.items()):
                return after
            before, ends = after, {key: after.responses[number] for number, key in passing.items()}
        if passing:
            raise _NotSimple
        return after

    def _risen(
        self,
        before: _Among,
        order: Sequence[tuple[tuple[int, int, int], int]],
        ends: Ends,
        passing: Collection[int],
    ) -> _Among | None:
        """Tasks and response times of threads in `order`, where those that release others end as in `ends`.

        None where one of them is late. Threads that nobody limits have a response time only where they are `passing`
        it on to others.
        """
        tasks = {number: self._task(number, ends) for _, number in order}
        responses = dict(before.responses)
        rivals: list[Task] = []
        is_new = False
        for _, level in groupby(order, key=itemgetter(0)):
            members = [number for _, number in level]
            rivals += (tasks[number] for number in members)
            is_new = is_new or any(tasks[number] is not before.tasks.get(number) for number in members)
            for number in members:
                latest = self._simple_of(number).latest
                if (latest is None and number not in passing) or (not is_new and number in responses):
                    continue
                response = _response_ns(tasks[number], rivals, responses.get(number, 0), latest or ANY)
                if response is None:
                    return None
                responses[number] = response
        return _Among(tasks, responses)

    def _task(self, number: int, ends: Ends) -> Task:
        """A thread as a task where those that release it end as given: one object for the same ends.

        Others end after their longest time by themselves, for waiting only makes them later.
        """
        simple = self._simple_of(number)
        key = number, tuple(ends.get(item) for item in simple.upstream)
        task = self._tasks.get(key)
        if task is None:
            made = EventModels(simple.stages, ends).bounded_task(simple.key)
            if made is None or type(made.worst_ns) is not int:
                raise _NotSimple
            if any(type(time) not in NUMBERS for item in made.streams for time in (item.period_ns, item.jitter_ns)):
                raise _NotSimple
            task = self._tasks[key] = made
        return task


def _response_ns(task: Task, together: Sequence[Task], begin_ns: Exact, latest: _Latest) -> Exact | None:
    """The response time of a task, which is no shorter than `begin_ns`; None where it is longer than it may be.

    `together` are the tasks that may delay it, and itself.
    """
    if not task.worst_ns:
        return 0 if latest.allows(0) else None
    is_timed = len(task.streams) == 1 and task.separation_ns is None and not task.streams[0].jitter_ns
    if is_timed and latest.bound_ns <= task.streams[0].period_ns:
        return _first_response_ns(max(begin_ns, task.worst_ns), together, latest)
    response_ns = response_time_ns(task, [other for other in together if other is not task])
    return response_ns if response_ns is not None and latest.allows(response_ns) else None


def _first_response_ns(begin_ns: Exact, together: Sequence[Task], latest: _Latest) -> Exact | None:
    """The least time, from `begin_ns` on, that holds all work of tasks that is released in it; None where it is late.

    A job that ends before the next one of its task is released is the only one in its busy period.
    """
    is_plain = all(task.separation_ns is None and len(task.streams) == 1 for task in together)
    terms = [(item.worst_ns, item.streams[0].period_ns, item.streams[0].jitter_ns) for item in together if is_plain]
    time = begin_ns
    while latest.allows(time):
        if is_plain:
            needed = sum(-(-(time + jitter) // period) * work for work, period, jitter in terms)
        else:
            needed = sum(most_jobs(task, time) * task.worst_ns for task in together)
        if needed == time:
            return time
        time = needed
    return None
