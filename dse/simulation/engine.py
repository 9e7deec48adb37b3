"""The simulation itself: events in integer nanoseconds (in fractions of them where messages take such).

At one instant jobs end and separations run out first, then messages arrive, then jobs end that take no time, then
timers dispatch, then a bus takes its next message. So what arrives at the very moment of a timer's dispatch is read by
it, and what a message releases may go before a job that would end at once. A timer's job reads the latest value
of everything at its dispatch (in a problem that speaks of clocks when it first gets its core, unless its data pass at
its dispatch); an arrival dispatches an event-triggered thread, or waits in its queue while there is room, or is lost.
Output leaves when a job ends; under logical execution time at the deadline, or when the job ends where that is later.

*The latency of a datum* runs from the dispatch of the job that produces it in the first component of a flow (from its
sending where a flow begins with a connection) to the first moment at which the last element of the flow has processed
it or a newer one that has overwritten it on the way: the length of its immediate forward job chain, without the first
component's own period (the maximum reduced reaction time of M. Günzel et al., "Timing analysis of asynchronized
distributed cause-effect chains", RTAS 2021). It is counted once; data that a full queue or a stated rate drops are
counted as lost.
"""

from __future__ import annotations

import random
from collections import Counter, deque
from fractions import Fraction
from heapq import heappop, heappush
from math import lcm

from dse.simulation.bus import Bus, QueuedMessage
from dse.simulation.core import Births, Core, InputQueue, Job
from dse.simulation.observing import Observation, Setting
from dse.simulation.plan import Gap, Plan, ReservationShare, SimulatedConnection, SimulatedTask, StepKey, TaskKey
from dse.simulation.readings import Range
from dse.support.timelimit import look_at_the_clock
from dse.support.units import Exact, whole

MILLION = 10**6


def simulate_once(plan: Plan, setting: Setting) -> Observation:
    """One run of a plan.

    Raises
    ------
    OutOfTime
        when the limit of time in force is over.
    """
    return _SimulationRun(plan, setting).run()


END, ARRIVE, END_AT_ONCE, DISPATCH, ARBITRATE = 0, 1, 2, 3, 4
FAULTY = 0.5
"""The share of the frames that faults hit, of those that one may hit."""
EVENTS_A_LOOK = 512
"""The number of events, some milliseconds, between two looks at the clock."""


class _SimulationRun:
    def __init__(self, plan: Plan, setting: Setting) -> None:
        self.plan, self.setting = plan, setting
        self.rng = random.Random(setting.seed)
        self.seen = Observation([Counter() for _ in plan.lengths])
        self.heap: list[tuple[Exact, int, int, tuple[object, ...]]] = []
        self.sequence = 0
        self.cores: dict[tuple[int, int], Core] = {}
        self.entries: dict[TaskKey, InputQueue] = {}
        self.free: dict[TaskKey, Exact] = {}
        self.buffers: Births = {}
        self.newest: dict[StepKey, Exact] = {}
        self.sent_after: dict[int, Exact] = {}
        self.delivered: dict[int, Exact] = {}
        self.bus_free: dict[int, Exact] = {}
        self.buses: dict[tuple[int, int], Bus] = {}
        self.riding: dict[int, deque[Births]] = {}
        self.senders = sorted({link.turn.sender for link in plan.links if link.turn is not None})
        self.begun: dict[int, list[Exact]] = {}
        self.held: dict[int, dict[int, deque[Births]]] = {}
        self.fresh: dict[int, set[int]] = {}
        self.started: set[int] = set()
        self.ended: Counter[TaskKey] = Counter()
        self.now: Exact = 0

    def at(self, time: Exact, order: int, *what: object) -> None:
        self.sequence += 1
        heappush(self.heap, (time, order, self.sequence, what))

    def run(self) -> Observation:
        """Play every event up to the end of the run."""
        for task in self.plan.tasks.values():
            if task.period_ns is not None:
                self._next_tick(task, 0)
        for number, link in enumerate(self.plan.links):
            if link.period_ns is not None:
                self._next_send(number, link, 0)
        for place, gap in self.plan.gaps.items():
            self._next_refill(gap, self._core(place), 0)
        for share in self.plan.shares:
            self._next_refill(share, self._core(share.core), 0)
        handlers = {
            "tick": self._tick, "send": self._send_timer, "end": self._end, "alone": self._complete,
            "yield": self._yield, "refill": self._refill, "begin": self._read,
            "bus": self._on_bus, "arbitrate": self._arbitrate, "arrive": self._arrive, "wake": self._serve,
            "publish": self._publish,
        }  # fmt: skip
        while self.heap and self.heap[0][0] <= self.setting.duration_ns:
            self.now, _, _, what = heappop(self.heap)
            self.seen.events += 1
            if not self.seen.events % EVENTS_A_LOOK:
                look_at_the_clock()
            handlers[what[0]](*what[1:])  # type: ignore[index, operator]
        return self.seen

    # --- timers -----------------------------------------------------------------------------------------------------

    def _time_of(self, name: str, period: object, count: int) -> Exact:
        drift = self.setting.drift_ppm.get(name, 0)
        return self.setting.offsets_ns.get(name, 0) + int(count * period * (MILLION + drift) / MILLION)  # type: ignore[operator]

    def _next_tick(self, task: SimulatedTask, count: int) -> None:
        self.at(self._time_of(task.name, task.period_ns, count), DISPATCH, "tick", task, count)

    def _tick(self, task: SimulatedTask, count: int) -> None:
        self._next_tick(task, count + 1)
        fresh = self.fresh.get(task.key[0])
        if task.rooms and (fresh is None or len(fresh) < len(task.rooms)):
            return  # not all have come: it waits for another period
        if fresh is not None:
            fresh.clear()
            self._start(task)
        self._release(task, self.now, {})

    def _next_send(self, number: int, link: SimulatedConnection, count: int) -> None:
        self.at(self._time_of(link.name, link.period_ns, count), DISPATCH, "send", number, link, count)

    def _send_timer(self, number: int, link: SimulatedConnection, count: int) -> None:
        self._next_send(number, link, count + 1)
        self._send(number, {})

    def _next_refill(self, of: Gap | ReservationShare, core: Core, count: int) -> None:
        """Its clock is that of the core: it drifts from none."""
        time = self.setting.offsets_ns.get(of.name, 0) + count * of.period_ns
        self.at(time, DISPATCH, "refill", of, core, count)

    def _refill(self, of: Gap | ReservationShare, core: Core, count: int) -> None:
        self._next_refill(of, core, count + 1)
        self.sequence += 1
        core.refill(of, self.now, self.sequence)
        self._reschedule(core)

    # --- jobs -------------------------------------------------------------------------------------------------------

    def _drawn(self, limits: Range) -> Exact:
        """A time in whole ns, or in the fraction of it that both ends count."""
        low, high = limits
        if self.setting.execution != "random":
            return high if self.setting.execution == "max" else low
        scale = lcm(low.denominator, high.denominator)
        return whole(Fraction(self.rng.randint(int(low * scale), int(high * scale)), scale))

    def _release(
        self, task: SimulatedTask, release: Exact, births: Births, by: int | None = None, order: int | None = None
    ) -> None:
        """A job begins its life: it gets a core or waits for one, and reads what is there at once, or then.

        Among equals it stands where its `order` puts it, that of its message, else behind all that are there.
        """
        component, part = task.key
        if task.first == component:
            self.begun.setdefault(component, []).append(release)
        if part == "thread" and self.now < self.setting.births_until_ns:
            for flow in self.plan.starts.get(component, ()):
                births[flow, 0] = [self.now]
        job = Job(task, release, self._drawn(task.cost_ns), births, by=by)
        if not task.reads_late or task.core is None:
            self._read(job)
        if task.core is not None:
            self._place_section(job)
            core = self._core(task.core)
            self.sequence += 1
            if not core.add(job, self.sequence if order is None else order):
                self.seen.dropped[task.name] += 1
            self._reschedule(core)
            return
        last = self.free.get(task.key, 0)  # jobs end in their order, also where they do not wait for each other
        end = max(self.now, last) + job.left if task.serial else max(self.now + job.left, last)
        self.free[task.key] = end
        self.at(end, END, "alone", job)

    def _read(self, job: Job) -> None:
        """A job reads what is there, once."""
        component, part = job.task.key
        is_new, job.has_read = not job.has_read, True
        if not is_new or part != "thread":
            return
        if component in self.fresh:
            self.fresh[component].clear()
        for key in self.plan.places.get(component, ()):
            fresh = self.buffers.pop(key, None)
            if fresh:
                job.births.setdefault(key, []).extend(fresh)
                self.newest[key] = max(fresh)
        self._compare(component)

    def _compare(self, component: int) -> None:
        """How far apart the births are of what a component holds by each flow, as long as births are followed."""
        keys = self.plan.meetings.get(component)
        if keys is None or self.now >= self.setting.births_until_ns:
            return
        held = [self.newest[key] for key in keys if key in self.newest]
        if len(held) > 1:
            disparity = max(held) - min(held)
            self.seen.disparities[component] = max(disparity, self.seen.disparities.get(component, 0))

    def _core(self, place: tuple[int, int]) -> Core:
        if place not in self.cores:
            gap = self.plan.gaps.get(place)
            self.cores[place] = Core(gap.budget_ns if gap is not None else None)
        return self.cores[place]

    def _place_section(self, job: Job) -> None:
        """The section that nothing preempts lies anywhere in the job: at its start where times are not drawn."""
        length = min(job.task.section_ns, job.left)
        if not length:
            return
        later = 0
        if self.setting.execution == "random":
            later = self.rng.randint(0, int(job.left - length))
        job.holds = job.left - later
        job.yields = job.holds - length

    def _reschedule(self, core: Core) -> None:
        """The most urgent ready job runs; the running one goes back to the ready ones if it is less urgent."""
        running = core.running
        if running is not None:
            if not core.is_overtaken:
                return
            core.settle(self.now)
            if running.is_held and not core.ready[0][2].is_interrupt:
                self._hold(core, running)
                return
            core.put_back()
        length = core.pick(self.now)
        if length is not None:
            self.at(self.now + length, END if length else END_AT_ONCE, "end", core, core.version)
            if core.running is not None and not core.running.has_read:  # behind what arrives at this moment
                self.at(self.now, DISPATCH, "begin", core.running)
        if core.running is not None and core.running.is_held:
            self._hold(core, core.running)

    def _hold(self, core: Core, job: Job) -> None:
        """Look at the ready jobs again when the section is over."""
        self.at(self.now + job.left - job.yields, END, "yield", core, core.version)

    def _yield(self, core: Core, version: int) -> None:
        """A section is over, unless something else has run since."""
        if version == core.version and core.running is not None:
            self._reschedule(core)

    def _end(self, core: Core, version: int) -> None:
        """A job is done, or threads have used up their budget."""
        if version != core.version or core.running is None:
            return
        core.settle(self.now)
        core.version += 1
        if core.running.left:
            core.put_back()
        else:
            job, core.running = core.running, None
            self._complete(job)
            core.done(job)
        self._reschedule(core)

    def _complete(self, job: Job) -> None:
        self._read(job)  # at last: it took no time
        task, release = job.task, job.release
        if task.first is not None:  # counted from the release of the thread, whose pieces keep their order
            release = self.begun[task.first][self.ended[task.key]]
            self.ended[task.key] += 1
        self.seen.responses[task.name] = max(self.seen.responses.get(task.name, 0), self.now - release)
        if task.logical_ns is not None and job.release + task.logical_ns > self.now:
            self.at(job.release + task.logical_ns, END, "publish", job)
        else:
            self._publish(job)
        if task.period_ns is None:
            self.entries[task.key].busy = False
            self._serve(task)

    def _publish(self, job: Job) -> None:
        """Output leaves: at the end of a job, or at its release and its deadline under logical execution time."""
        component, part = job.task.key
        if part == "callback":
            for key, births in job.births.items():
                self._store(key, births)
            self._come(component, job.by)
        else:
            for (flow, position), births in job.births.items():
                if position == self.plan.lengths[flow] - 1:
                    self._arrived(flow, births)
            for number in self.plan.outgoing.get(component, ()):
                carried = {
                    (flow, position + 1): births
                    for (flow, position), births in job.births.items()
                    if self.plan.exits.get((flow, position)) == number
                }
                self._send(number, carried)

    def _arrived(self, flow: int, births: list[Exact]) -> None:
        counter = self.seen.latencies[flow]
        for birth in births:
            counter[self.now - birth] += 1

    def _store(self, key: StepKey, births: list[Exact]) -> None:
        """Data for the next dispatch to read; unread older data live on in what overwrites them."""
        self._note(key, births)
        self.buffers.setdefault(key, []).extend(births)

    def _note(self, key: StepKey, births: list[Exact]) -> None:
        for birth in births:
            age = self.now - birth
            if key not in self.seen.latest or age > self.seen.latest[key][0]:
                self.seen.latest[key] = (age, self.now)
            if key not in self.seen.earliest or age < self.seen.earliest[key][0]:
                self.seen.earliest[key] = (age, self.now)

    # --- messages ---------------------------------------------------------------------------------------------------

    def _send(self, number: int, births: Births) -> None:
        link = self.plan.links[number]
        if self.now < self.sent_after.get(number, 0):
            self.seen.lost[f"{link.name}: sooner than its stated rate"] += 1
            return
        self.sent_after[number] = self.now + link.gap_ns
        if self.now < self.setting.births_until_ns:
            for flow in self.plan.link_starts.get(number, ()):
                births[flow, 0] = [self.now]
        soft = self._drawn(link.soft_ns)
        if link.turn is not None and link.turn.rides_on is not None:
            self.riding.setdefault(number, deque()).append(births)
        elif link.turn is not None or (self.setting.bus_contention and link.bus is not None):
            self.at(self.now + soft, ARRIVE, "bus", number, births)
        else:
            self._deliver(number, self.now + soft + self._drawn(link.bus_ns), births)

    def _on_bus(self, number: int, births: Births) -> None:
        """A physical bus carries one message at a time, in the order of its arbitration.

        Where that is not counted, in the order in which they are handed to it.
        """
        link = self.plan.links[number]
        assert link.bus is not None
        if link.turn is not None:
            self.sequence += 1
            message = QueuedMessage(number, births, self.now, self.sequence, link.turn, deque(link.turn.frames))
            self.buses.setdefault(link.turn.line, Bus()).waiting.append(message)
            self.at(self.now, ARBITRATE, "arbitrate", link.turn.line)
            return
        end = max(self.now, self.bus_free.get(link.bus, 0)) + self._drawn(link.bus_ns)
        self.bus_free[link.bus] = end
        self._deliver(number, end, births)

    def _arbitrate(self, line: tuple[int, int]) -> None:
        """The next frame has the bus, if that is free and something waits."""
        bus = self.buses[line]
        if not bus.waiting or self.now < bus.busy_until:
            return
        message = bus.next(self.senders)
        bus.last_sender = message.turn.sender
        frame = message.left.popleft()
        bus.busy_until = end = self.now + self._drawn(frame)
        faults = message.turn.faults
        may_fail = faults is not None and self.setting.execution != "min" and bus.may_fail(end, faults)
        if faults is not None and may_fail and self.rng.random() < FAULTY:
            bus.fail()  # in its last bit; it competes again after the error frame
            message.left.appendleft(frame)
            bus.busy_until = end = end + self._drawn(faults.error_ns)
        self.at(end, ARBITRATE, "arbitrate", line)
        if message.left:
            return
        bus.waiting.remove(message)
        link = self.plan.links[message.link]
        self.seen.responses[link.name] = max(self.seen.responses.get(link.name, 0), end - message.since)
        self._deliver(message.link, end, message.births)
        for number, riders in self.riding.items():
            turn = self.plan.links[number].turn
            if turn is not None and turn.rides_on == message.link and riders:
                self._deliver(number, end, riders.popleft())

    def _deliver(self, number: int, time: Exact, births: Births) -> None:
        """Messages of one connection keep their order."""
        time = max(time, self.delivered.get(number, 0))
        self.delivered[number] = time
        self.at(time, ARRIVE, "arrive", number, births)

    def _arrive(self, number: int, births: Births) -> None:
        link = self.plan.links[number]
        onward: Births = {}
        for (flow, position), born in births.items():
            if position == self.plan.lengths[flow] - 1:
                self._arrived(flow, born)
            else:
                onward[flow, position + 1] = born
        if link.target is None:
            return
        task = self.plan.tasks[link.target, "thread"]
        if task.period_ns is not None:
            task = self.plan.tasks.get((link.target, "callback"), task)
        if task.period_ns is not None or not link.is_trigger:
            for key, born in onward.items():
                self._store(key, born)
            self._come(link.target, number)
            if task.takes_at_once:
                self._release(task, self.now, {}, number)
            return
        if task.rooms:
            self._join(task, number, onward)
            return
        entry = self.entries.setdefault(task.key, InputQueue())
        for key, born in onward.items() if task.key[1] == "thread" else ():
            self._note(key, born)
        if task.keeps is not None and task.core is not None:
            self._release(task, self.now, onward, number)
            return
        room = link.capacity if link.capacity is not None and task.key[1] == "thread" else task.capacity
        if len(entry.waiting) >= room and (entry.busy or entry.waiting or self.now < entry.not_before):
            reason = "no room in its queue" if entry.busy else "sooner than its minimum separation"
            self.seen.lost[f"{task.name}: {reason}"] += 1
            return
        self.sequence += 1
        entry.waiting.append((self.now, onward, number, self.sequence))
        self._serve(task)

    def _come(self, component: int, number: int | None) -> None:
        """A message is there for the next release of a timer that goes on only when all have come."""
        if number is not None and number in self.plan.tasks[component, "thread"].rooms:
            self.fresh.setdefault(component, set()).add(number)

    def _start(self, task: SimulatedTask) -> None:
        """All inputs have come for the first time: what waited for the system to start is not followed.

        It is where all of an input waits, in order.
        """
        component = task.key[0]
        if component in self.started:
            return
        self.started.add(component)
        for key in self.plan.places.get(component, ()):
            self.buffers.pop(key, None)
        for number, queue in self.held.get(component, {}).items():
            for births in queue if task.rooms[number] is not None else ():
                births.clear()

    def _join(self, task: SimulatedTask, number: int, births: Births) -> None:
        """A message waits until one of each trigger is there; then one of each is what dispatches the thread.

        Where there is no room the oldest makes place: what it says lives on in the next one.
        """
        held = self.held.setdefault(task.key[0], {wire: deque() for wire in task.rooms})
        for key, born in births.items():
            self._note(key, born)
        room = task.rooms[number]
        held[number].append(births)
        if room is not None and len(held[number]) > room:
            _add_to(held[number][1], held[number].popleft())
            self.seen.dropped[self.plan.links[number].name] += 1
        if not all(held.values()):
            return
        self._start(task)
        together: Births = {}
        for queue in held.values():
            _add_to(together, queue.popleft())
        entry = self.entries.setdefault(task.key, InputQueue())
        if len(entry.waiting) >= task.capacity and (entry.busy or entry.waiting or self.now < entry.not_before):
            reason = "no room in its queue" if entry.busy else "sooner than its minimum separation"
            self.seen.lost[f"{task.name}: {reason}"] += 1
            return
        self.sequence += 1
        entry.waiting.append((self.now, together, number, self.sequence))
        self._serve(task)

    def _serve(self, task: SimulatedTask) -> None:
        """Dispatch the next arrival that waits, if the thread is free and its minimum separation has passed."""
        entry = self.entries[task.key]
        if entry.busy or not entry.waiting:
            return
        if self.now < entry.not_before:
            self.at(entry.not_before, END, "wake", task)
            return
        arrival, births, by, order = entry.waiting.popleft()
        # a response counts from when on only the thread itself and its core keep the message waiting
        release = max(arrival, entry.not_before)
        if task.separation_ns is not None:
            entry.not_before = self.now + task.separation_ns
        entry.busy = task.serial
        self._release(task, release, births, by, order if release == arrival else None)


def _add_to(births: Births, more: Births) -> None:
    for key, born in more.items():
        births.setdefault(key, []).extend(born)
