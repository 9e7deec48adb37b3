"""Response times and the jitter that they pass on, as one fixed point over the plain model of a design.

Event-triggered stages inherit the streams of what releases them, with the jitter that processing and transmission add
on the way (K. Tindell and J. Clark, "Holistic schedulability analysis for distributed hard real-time systems",
Microprocessing and Microprogramming 40, 1994). Resource after resource its policies tell how long each stage takes
there (`dse.analysis.scheduling.policies`), until nothing rises any more.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, TypeAlias

from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey, is_plain
from dse.analysis.scheduling.event_models import EventModels
from dse.analysis.scheduling.growth import TooLongError, growth, steps_along
from dse.analysis.scheduling.model import ChainKey, EndKey, Ends, LagKey, Resource, System, lag_of
from dse.analysis.scheduling.policies import accelerators, buses, chains, executors, preemptive
from dse.analysis.scheduling.policies.accelerators import Served
from dse.analysis.scheduling.policies.buses import Arbitrated, OnBus
from dse.analysis.scheduling.policies.chains import Chain, chains_in
from dse.analysis.scheduling.policies.coupled import least_known
from dse.analysis.scheduling.policies.preemptive import Preempted
from dse.analysis.scheduling.policies.segments import Segments, Spans
from dse.analysis.scheduling.policies.successions import Succession, heads_in, is_prioritised, sources_in
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

Window: TypeAlias = Preempted | Served | OnBus
"""What decides how long a stage takes on its resource: `response_ns()`, and `parts()` of it."""


@dataclass(frozen=True)
class Loss:
    """How it turned out that a stage has no bound: where it runs, and what was known of all stages then."""

    resource: Resource
    position: int
    tasks: Sequence[Task | None]
    ends: Ends


@dataclass(frozen=True)
class Solution:
    """The response times of a system: when each stage on a resource ends after the release of its thread, in ns.

    Of those without a bound (None) `losses` tell how that turned out, for each thread by the stage with which it
    begins. `rounds` were needed.
    """

    system: System
    ends: Ends
    spans: Spans
    losses: Mapping[TaskKey, Loss] = field(default_factory=dict)
    rounds: int = 0

    @property
    def tasks(self) -> Iterator[TaskKey]:
        """The stages on its resources."""
        return (entry.key for resource in self.system.resources for entry in resource.entries)

    def because(self, loss: Loss) -> tuple[TaskKey, ...]:
        """The stages without a bound because of which a stage has none; none where it has none by itself."""
        resource, entry = loss.resource, loss.resource.entries[loss.position]
        events = self._known_at(loss).events
        found: list[TaskKey] = []
        for position in entry.before:
            key = resource.entries[position].key
            if loss.tasks[position] is None and not executors.counts_once(resource, entry, position):
                found += [key] if self.ends[key] is None else events.endless_before(key)
        members = {key[0] for key in self.system.stages[entry.key].pieces or (entry.key,)}
        found += [key for key in events.endless_before(entry.key) if key[0] not in members]
        return tuple(dict.fromkeys(found))

    def overload(self, loss: Loss) -> Fraction | None:
        """The share of its resource that a stage without a bound and what goes before it need, if that is all or more.

        In the long run, as known when it turned out that it has no bound; None where that is less than all, or where
        something of that has no bound itself.
        """
        needed = self._known_at(loss).share(loss.resource, loss.position)
        return None if needed is None or needed < 1 else needed

    def _known_at(self, loss: Loss) -> Windows:
        return Windows(self.system, loss.ends, loss=loss)

    @cached_property
    def windows(self) -> Windows:
        """The busy windows that decide the response times of the solved system."""
        return Windows(self.system, self.ends, self.spans)

    def loss_of(self, key: TaskKey) -> Loss | None:
        """How it turned out that the thread of a stage has no bound; None where it has one."""
        return self.losses.get(self.system.stages[key].first)


def solve(system: System) -> Solution:
    """Response times and inherited jitter, raised together until both stand still; what keeps growing has no bound.

    Where round after round adds the same, as many rounds are taken at once as add the same for sure
    (`dse.analysis.scheduling.growth`).

    Raises
    ------
    CyclicActivation
        when event-triggered stages release each other in a cycle.
    """
    work = Rounds(system)
    history: deque[dict[Any, Any]] = deque(maxlen=2 * MOST_ALIKE + 1)
    pause, look = 1, SLOW
    while work.next():
        if work.count >= SLOW - 2 * MOST_ALIKE:
            history.append(work.state())
        if work.count >= look:
            pause = 1 if work.follow(history) >= WORTH else 2 * pause
            look = work.count + pause
    return Solution(system, work.ends, work.spans, work.losses, work.count)


class Rounds:
    """The response times of a system as they are after `count` rounds: lower bounds that rise."""

    def __init__(self, system: System) -> None:
        self.system = system
        entries = [entry for resource in system.resources for entry in resource.entries]
        self.ends: dict[EndKey, Exact | None] = {one.key: system.stages[one.key].elapsed_ns[1] for one in entries}
        self.sources = sources_in(system)
        self.lagging = {entry.key for entry in entries if entry.executor is None and entry.key in self.sources}
        self.ends |= {lag_of(key): self.ends[key] for key in self.lagging}
        self.paired = paired_in(system)
        self.ends |= {(key[0], key[0], "joined"): self.ends[key] for key in self.paired}
        self.heads = heads_in(system)
        self.chains = chains_in(system)
        for resource, found in zip(system.resources, self.chains, strict=True):
            keys = [entry.key for entry in resource.entries]
            for chain in found:
                alone = sum(system.stages[keys[item]].worst_ns for item in chain.members)
                self.ends[chain.key] = alone + chain.absent_ns
                if (chain.key[1], "thread") in self.sources:
                    self.ends[*chain.key, "lag"] = self.ends[chain.key]
                elif (chain.key[1], "thread") in self.paired:
                    self.ends[*chain.key, "joined"] = self.ends[chain.key]
        self.spans: Spans = {}
        self.losses: dict[TaskKey, Loss] = {}
        self.has_losses = False
        self.count = 0
        self._begin(is_plain=not system.is_traced)

    def _begin(self, *, is_plain: bool) -> None:
        """Read what releases each stage; where times are mere numbers what is found of them is kept."""
        self.is_plain = is_plain
        keys = [chain.key for found in self.chains for chain in found]
        self.events = EventModels(self.system.stages, self.ends, keys, heads=self.heads, is_plain=is_plain)
        self.segments = Segments(self.events, self.system.resources, self.spans)
        self._before: list[list[Task | None] | None] = [None] * len(self.system.resources)

    def next(self) -> bool:
        """Raise all once, resource by resource; whether anything rose."""
        self.count, changed = self.count + 1, False
        look_at_the_clock()
        for number, resource in enumerate(self.system.resources):
            tasks, earlier = [self.events.in_window(entry.key) for entry in resource.entries], self._before[number]
            counted = [*tasks, *(self._source_of(entry.key) for entry in resource.entries if entry.key in self.sources)]
            succession = Succession(self.events, resource)
            related = succession.has_relatives or succession.has_coupled
            looks_beyond = related or _looks_beyond(resource)
            if earlier is not None and not looks_beyond and all(map(_is_same, counted, earlier)):
                continue  # as in the round before
            self._before[number] = counted
            find = partial(window_of, resource, tasks=tasks, succession=succession, segments=self.segments)
            together = _remembered(resource, tasks, find) if self.is_plain and not related else None
            for position, entry in enumerate(resource.entries):
                has_lag = entry.key in self.lagging or entry.key in self.paired
                window = find(position) if together is None or has_lag else None
                found = self._end_of(resource, position, tasks, window) if together is None else together[position]
                if found is not None and self.count > 1 and self._is_beyond(found):
                    found = found if found == self.ends[entry.key] else None
                if self.ends[entry.key] is not None and found != self.ends[entry.key]:
                    if found is None:
                        self.has_losses = True
                        self._note_loss(resource, position, tasks)
                    self.ends[entry.key], changed = found, True
                    self.events.raised(entry.key)
                if has_lag:
                    changed |= self._raise_lag(entry.key, window)
            for chain in self.chains[number]:
                changed |= self._raise_chain(resource, chain, tasks, succession)
        return changed

    def _raise_chain(
        self, resource: Resource, chain: Chain, tasks: Sequence[Task | None], succession: Succession
    ) -> bool:
        """Raise the end of a chain; whether it rose."""
        if self.ends[chain.key] is None:
            return False
        windows = [window for _, window in chains.windows_of(resource, chain, tasks, succession)]
        found = least_known(window.response_ns() for window in windows)
        changed = self._raise(chain.key, None if found is None else found - chain.sent_ns)
        first: TaskKey = (chain.key[1], "thread")
        if first in self.sources or first in self.paired:
            is_known = self.ends[chain.key] is not None
            lag = least_known(self._lag(window, first) for window in windows) if is_known else None
            key: LagKey = (*chain.key, "lag" if first in self.sources else "joined")
            changed |= self._raise(key, None if lag is None else lag - chain.sent_ns)
        return changed

    def _raise_lag(self, key: TaskKey, window: Window | None) -> bool:
        """Raise the lag of a stage; whether it rose."""
        lag = None
        if window is not None and self.ends[key] is not None:
            assert isinstance(window, Preempted | Arbitrated)
            lag = self._lag(window, key)
        return self._raise(lag_of(key) if key in self.sources else (key[0], key[0], "joined"), lag)

    def _source_of(self, key: TaskKey) -> Task | None:
        """The releases of the source of a stage that has one; None where they come without a bound."""
        return self.events.source_task(self.sources[key])

    def _lag(self, window: Preempted | Arbitrated, first: TaskKey) -> Exact | None:
        """How long after the latest release of its `first` stage a window is over; None where it has no bound.

        A message that is queued as its source releases has no other lag than its response time.
        """
        jobs = self._source_of(first) if first in self.sources else self.paired[first]
        response = self.ends[first] if isinstance(window, Arbitrated) else window.response_ns()
        if jobs is None or response is None:
            return None
        task = window.task
        if isinstance(window, Arbitrated) and is_plain(jobs) and is_plain(task) and jobs.streams == task.streams:
            return response
        lag = window.counted_from(jobs).response_ns()
        return None if lag is None else min(lag, response)

    def _raise(self, key: ChainKey | LagKey, found: Exact | None) -> bool:
        """Raise the end of a chain or a lag; whether it changed.

        It falls only once a stage has no bound: what needs all its inputs may come less often without that one.
        """
        known = self.ends[key]
        if known is None or found == known or (found is not None and found < known and not self.has_losses):
            return False
        self.has_losses |= found is None
        if found is not None and self.count > 1 and self._is_beyond(found):
            found = None
        self.ends[key] = found
        self.events.raised((key[0], "message" if key[1] == "message" else "thread"))
        return True

    def _note_loss(self, resource: Resource, position: int, tasks: Sequence[Task | None]) -> None:
        first = self.system.stages[resource.entries[position].key].first
        if first not in self.losses:
            self.losses[first] = Loss(resource, position, tasks, dict(self.ends))

    def _is_beyond(self, end_ns: Exact) -> bool:
        return end_ns > self.system.horizon_ns or self.count > MOST_ROUNDS

    def _end_of(
        self, resource: Resource, position: int, tasks: Sequence[Task | None], window: Window | None
    ) -> Exact | None:
        """When a stage ends after the release of its thread, with what is known so far."""
        found = None if window is None else window.response_ns()
        if resource.entries[position].is_piece:
            return self.segments.end_ns(resource, position, tasks, found)
        return found

    def state(self) -> dict[Any, Any]:
        """All that the next round depends on."""
        return {**self.ends, **{("span", key): span for key, span in self.spans.items()}}

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
            kept, item = (self.spans, key[1]) if key[0] == "span" else (self.ends, key)  # type: ignore[index]
            kept[item] += steps * more  # type: ignore[index, operator]
        self._begin(is_plain=self.is_plain)
        return steps * rounds

    def _raised(self, rounds: int, state: dict[Any, Any]) -> dict[Any, Any]:
        """All that is known some rounds after a state, of numbers that may be lines."""
        other = copy(self)
        other.ends = {key: state[key] for key in self.ends}
        other.spans = {key: state["span", key] for key in self.spans}
        other.losses = {}
        other._begin(is_plain=False)
        for _ in range(rounds):
            other.next()
        return other.state()


def paired_in(system: System) -> dict[TaskKey, Task]:
    """Releases at the pace of the slowest timer before each stage that needs all its inputs, by the stage's key.

    The time from the latest release of the stage counts from these; only priorities schedule it.
    """
    return {
        entry.key: Task("", 0, (Stream(stage.paired_ns),))
        for resource in system.resources
        if resource.wire is None and not resource.is_accelerator
        for entry in resource.entries
        if (stage := system.stages[entry.key]).paired_ns is not None and is_prioritised(entry, stage)
    }


def window_of(
    resource: Resource, position: int, tasks: Sequence[Task | None], succession: Succession, segments: Segments
) -> Window | None:
    """The busy window that decides the time of a stage from its own release to its end; None without a bound.

    `tasks` are the stages of the resource as they are released; None where one comes without a bound.
    """
    entry = resource.entries[position]
    if resource.wire is not None:
        return buses.window_of(resource, position, tasks)
    if entry.executor is None:
        return preemptive.window_of(resource, position, tasks, succession)
    if not entry.is_piece:
        return executors.window_of(resource, position, tasks, succession)
    return accelerators.window_of(resource, position, tasks, succession, segments.since_ns(entry))


def response_ns(system: System, key: TaskKey, ends: Ends) -> Exact | None:
    """The response time in ns of a stage on a resource where all that releases stages ends as given; None: no bound.

    What `ends` leaves out ends after its longest time by itself.
    """
    place = system.place(key)
    assert place is not None
    window = Windows(system, ends).of(*place)
    return None if window is None else window.response_ns()


KEPT = 4096
"""The number of resources, each with its releases, whose response times are remembered."""
_KEPT: dict[tuple[int, ...], tuple[Resource, Sequence[Task | None], list[Exact | None]]] = {}


def _remembered(
    resource: Resource, tasks: Sequence[Task | None], find: Callable[[int], Window | None]
) -> list[Exact | None] | None:
    """The response times of a resource where priorities alone decide them, or which is a bus; None of others.

    Designs share resources and tasks, so that the same objects tell that they agree (decision record 1).
    """
    key = (id(resource), *map(id, tasks))
    if (kept := _KEPT.get(key)) is not None:  # once: another thread may empty it
        return kept[2]
    if not resource.is_plain and resource.wire is None:
        return None
    windows = map(find, range(len(tasks)))
    found = [None if window is None else window.response_ns() for window in windows]
    if len(_KEPT) >= KEPT:
        _KEPT.clear()
    _KEPT[key] = resource, tasks, found  # which keeps alive whatever the key names
    return found


def _is_same(one: Task | None, other: Task | None) -> bool:
    """Whether two tasks have the same response time for sure."""
    if one is other:
        return True
    return one is not None and other is not None and is_plain(one) and is_plain(other) and one == other


def _looks_beyond(resource: Resource) -> bool:
    """Whether more than the releases of its stages has a part in a response time."""
    return bool(resource.kinds) or any(entry.is_piece for entry in resource.entries)


class Windows:
    """The busy windows of a solved system, from which the parts of each response time are read."""

    def __init__(self, system: System, ends: Ends, spans: Spans | None = None, *, loss: Loss | None = None) -> None:
        """With a `loss` the stages of its resource come as they were known to come then."""
        self.system = system
        self.chains = {chain.key: chain for found in chains_in(system) for chain in found}
        self.events = EventModels(system.stages, ends, self.chains, heads=heads_in(system))
        self.segments = Segments(self.events, system.resources, {} if spans is None else dict(spans))
        self._tasks = {} if loss is None else {id(loss.resource): list(loss.tasks)}
        self._successions: dict[int, Succession] = {}

    def tasks(self, resource: Resource) -> list[Task | None]:
        """The stages of a resource as they are released; None where one comes without a bound."""
        found = self._tasks.get(id(resource))
        if found is None:
            found = self._tasks[id(resource)] = [self.events.in_window(entry.key) for entry in resource.entries]
        return found

    def of(self, resource: Resource, position: int, tasks: Sequence[Task | None] | None = None) -> Window | None:
        """The busy window that decides the time of a stage from its own release to its end; None without a bound.

        `tasks` are the stages of the resource as they are released, where not as is known.
        """
        given = self.tasks(resource) if tasks is None else tasks
        return window_of(resource, position, given, self.succession(resource), self.segments)

    def share(self, resource: Resource, position: int) -> Fraction | None:
        """The share of a resource that a stage and what goes before it need; None where some of that has no bound."""
        if resource.wire is not None:
            window = buses.window_of(resource, position, self.tasks(resource))
            return None if window is None else sum((item.utilisation for item in window.demand), Fraction(0))
        entry, tasks = resource.entries[position], list(self.tasks(resource))
        tasks[position] = self.events.bounded_task(entry.key)
        counted: Sequence[Task] | None
        if entry.executor is None:
            counted = preemptive.rivals_of(resource, entry, tasks)
        else:
            known = tasks[position] is not None
            found = executors.beside(resource, position, tasks, self.succession(resource)) if known else None
            counted = None if found is None else found.sharing
        if counted is None:
            return None
        given = [tasks[position], *(tasks[item] for item in entry.siblings), *counted]
        return sum((item.utilisation for item in given if item is not None), Fraction(0))

    def succession(self, resource: Resource) -> Succession:
        """The chains of a resource."""
        if id(resource) not in self._successions:
            self._successions[id(resource)] = Succession(self.events, resource)
        return self._successions[id(resource)]

    def since_thread(self, resource: Resource, position: int, window: Window | None) -> tuple[Exact, Window | None]:
        """The busy window that decides the end of a stage after its thread's release, and the time before it, in ns.

        `window` is what decides its time from its own release. Before a later piece of a thread is the end of the piece
        before. Where looking at the core of the thread alone bounds all of it better, another window decides, and
        before are the work of the pieces before and the times away.
        """
        stage = self.system.stages[resource.entries[position].key]
        alone = None if window is None else window.response_ns()
        if stage.key == stage.first or alone is None:
            return 0, window
        previous = stage.pieces[stage.pieces.index(stage.key) - 1]
        begin = self.events.ends.get(previous, self.system.stages[previous].elapsed_ns[1])
        together = self.segments.together(resource, position, self.tasks(resource))
        end = None if together is None else together.response_ns()
        if together is not None and end is not None and begin is not None and end < begin + alone:
            return together.task.worst_ns - stage.cost_ns, together
        return begin or 0, window
