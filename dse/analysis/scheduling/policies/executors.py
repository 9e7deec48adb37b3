"""Response times of threads that one OS thread runs, one job at a time: executors under preemptive fixed priorities.

No job of an executor preempts another of it; what goes before the OS thread on its core preempts all of them.

* ``fifo``: jobs run as they come. A job that comes a after the beginning of a busy period of the executor waits for all
  that came no later: its end is the least w with w = blocking + work that came in [0, a] + work of the more urgent in
  [0, w), and its response w - a. Of a only those count at which a job may come (K. Bedarkar, M. Vardishvili, S. Bozhko,
  M. Maida and B. B. Brandenburg, "From intuition to Coq: a case study in verified response-time analysis of FIFO
  scheduling", RTSS 2022).
* ``callback_group``: of those that wait the most urgent runs next; one less urgent may have begun before. A job's start
  counts what comes until then, its end only what goes before the OS thread (L. George, N. Rivierre and M. Spuri,
  "Preemptive and non-preemptive real-time uniprocessor scheduling", INRIA 2966, 1996; with all jobs of the busy period
  as R. J. Bril, J. J. Lukkien and W. F. J. Verhaegh, Real-Time Systems 42, 2009, require).
* ``wait_set``: ROS 2's single-threaded executor takes what waits at its polling points, timers first, and runs it all
  before it looks again (D. Casini, T. Blass, I. Luetkebohle and B. B. Brandenburg, "Response-time analysis of ROS 2
  processing chains under reservation-based scheduling", ECRTS 2019). It is never idle while a job waits, and runs the
  jobs of one callback as they come: until one starts, all that comes of others may go before it, as theirs of polled
  callbacks. That is a safe bound, whatever the order.

* ``polling``: a wait set that drops. At a polling point it takes a job of each callback that has one, and polls again
  when these are over, so that in a round each callback runs at most once; at most so many jobs of a callback wait, and
  what comes beyond is dropped. A job is over within as many rounds after the running one as jobs of its callback may
  wait, however much comes, and sooner where priorities order the callbacks of a round (H. Teper, T. Betz, M. Guenzel,
  D. Ebner, G. von der Brueggen, J. Betz and J.-J. Chen, "End-to-end timing analysis and optimization of multi-executor
  ROS 2 systems", RTAS 2024).

Jobs of one chain never wait for each other (`dse.analysis.scheduling.policies.successions`): what others of its
chain did in a busy period was over when a job was released, and took no longer than until then. Where of each chain at
most one job waits at a time, a job that runs as it comes waits for one of each. (docs/semantics.md, section 4.6)
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from heapq import merge
from operator import attrgetter

from dse.analysis.scheduling.busy_window import (
    PLAIN,
    Task,
    TaskKey,
    densest_releases_ns,
    is_late,
    is_plain,
    load,
    most_jobs,
)
from dse.analysis.scheduling.event_models import once
from dse.analysis.scheduling.model import Entry, Resource
from dse.analysis.scheduling.parts import Parts, before_job, counted
from dse.analysis.scheduling.policies.executor_work import EndlessError, Work, jobs_by, until_end
from dse.analysis.scheduling.policies.reservations import gaps_and_servers
from dse.analysis.scheduling.policies.successions import Succession, longest_of_each
from dse.spec.kinds import ExecutorKind
from dse.support.units import Exact


@dataclass(frozen=True, slots=True)
class Fellow:
    """Another task of an executor; `goes_first` among those that wait (in a callback group).

    One that `is_kin` never waits while the task does: they are of one chain. Of those of a `line` at most one waits at
    a time; of one in no line several jobs may. In a round of an executor that polls its `turn` is before that of the
    task (1), behind it (-1), or either (0).
    """

    task: Task
    goes_first: bool
    is_kin: bool = False
    line: TaskKey | None = None
    turn: int = 0


@dataclass(frozen=True, slots=True)
class WorstJob:
    """The job of an executor that responds last, in a busy period: of its fellows those count that come `until` then.

    Of a callback group something less urgent may have begun, for `behind_ns`. Where that or other less urgent work
    keeps the core at first it begins a moment before, and so does the job: what comes at its very start `comes_late`.

    Its chain has run for `chain_ns` by then (None: it is in none). In `lines` it waits for one job of each.
    """

    release_ns: Exact
    end_ns: Exact
    until_ns: Exact
    behind_ns: Exact = 0
    comes_late: bool = False
    chain_ns: Exact | None = None
    lines: tuple[Task, ...] | None = None

    @property
    def response_ns(self) -> Exact:
        """From its release to its end."""
        return self.end_ns - self.release_ns

    def jobs(self, task: Task) -> int:
        """How many jobs of a fellow go before it."""
        if self.lines is not None:
            return sum(task is item for item in self.lines)
        return (most_jobs if self.comes_late else jobs_by)(task, self.until_ns)


@dataclass(frozen=True, slots=True)
class Queued:
    """A task of an executor, and all that may go before it: its fellows in there, and what preempts the OS thread.

    Attributes
    ----------
    kind, task, fellows
        the executor, the task, and what else the executor runs.
    higher
        the tasks of the core that go before the executor's OS thread.
    blocked_ns
        how long less urgent work outside of the executor may keep the core, at most.
    is_in_line
        no earlier job of the task itself waits when one comes, and lines of jobs bound what does (`Fellow.line`).
    rounds
        so many rounds after the one that runs at its release a job is over at the latest; None where the executor does
        not poll, or the task has no bound on how many jobs wait.
    is_known
        whether releases of all fellows are known; else only rounds bound the response time.

    Examples
    --------
    A timer of 1 every 10 behind a callback of 3 every 20, and the other way round; alone at its priority, and with
    another OS thread of 2 every 5 before both.

    >>> from dse.analysis.scheduling.busy_window import periodic
    >>> timer, callback = periodic("timer", 1, 10), periodic("callback", 3, 20)
    >>> Queued("fifo", timer, (Fellow(callback, False),)).response_ns()
    4
    >>> Queued("callback_group", callback, (Fellow(timer, True),), (periodic("other", 2, 5),)).response_ns()
    8

    The callback comes with the timer and waits for it; from then on nobody may come before it.

    >>> found = Queued("fifo", callback, (Fellow(timer, False),), (periodic("other", 2, 5),)).worst_job()
    >>> found.release_ns, found.until_ns, found.end_ns
    (0, 0, 8)
    """

    kind: ExecutorKind
    task: Task
    fellows: tuple[Fellow, ...]
    higher: tuple[Task, ...] = ()
    blocked_ns: Exact = 0
    is_in_line: bool = False
    rounds: int | None = None
    is_known: bool = True

    def response_ns(self) -> Exact | None:
        """The longest time from the release of a job to its end, in ns; None where it has no bound."""
        if not self.task.worst_ns:
            return 0
        tasks = (self.task, *self.higher, *(item.task for item in self.fellows))
        found = _remembered(self) if type(self.blocked_ns) in PLAIN and all(map(is_plain, tasks)) else self.worst_job()
        return None if found is None else found.response_ns

    def parts(self) -> Parts | None:
        """The parts of the wait of the job with the longest response time; None where it has no bound.

        One of the fellows may have begun, or less urgent work outside: the longer of the two counts.
        """
        if not self.task.worst_ns:
            return Parts()
        found = self.worst_job()
        if found is None:
            return None
        others = counted(self._jobs_before(found))
        blocked = self.blocked_ns if self.blocked_ns >= found.behind_ns else 0
        if found.chain_ns is None:
            return before_job(self.task, others, blocked, found.release_ns, found.end_ns)
        work = sum(jobs * item.worst_ns for item, jobs in others)
        blocked = found.end_ns - self.task.worst_ns - found.chain_ns - work
        return Parts(others, blocked_ns=blocked, over_ns=found.release_ns - found.chain_ns)

    @property
    def sharing(self) -> list[Task]:
        """The tasks that share the core with this one during its busy period."""
        inside = (item.task for item in self.fellows if item.goes_first or self.kind != "callback_group")
        return [*self.higher, *inside]

    def worst_job(self) -> WorstJob | None:
        """The job with the longest response time, of a task that takes some time; None where it has no bound."""
        kind, task, blocked = self.kind, self.task, self.blocked_ns
        inside = [item for item in self.fellows if item.task.worst_ns]
        urgent = [item for item in inside if item.goes_first or kind != "callback_group"]
        less = [item for item in inside if kind == "callback_group" and not item.goes_first]  # one may have begun
        outside = [item for item in self.higher if item.worst_ns]
        found: list[WorstJob] = []
        with suppress(EndlessError):
            if self.is_in_line and kind == "fifo" and load(outside) < 1:
                waiting = longest_of_each([(item.task, item.line) for item in inside if not item.is_kin])
                if waiting is not None:
                    return _in_lines(Work(task, waiting, outside, blocked))
        behind = _longest(less)
        begun = max(blocked, behind)
        tasks = [item.task for item in urgent]
        with suppress(EndlessError):
            if self.rounds is not None and load(outside) < 1:
                found.append(_in_rounds(Work(task, tasks, outside, blocked), self.rounds, inside))
        used = load((task, *tasks, *outside))
        is_full = used == 1 and (begun or not task.streams or any(map(is_late, (task, *tasks, *outside))))
        if used <= 1 and not is_full and self.is_known:
            with suppress(EndlessError):
                work = Work(task, tasks, outside, begun)
                found.append(_fifo(work) if kind == "fifo" else _grouped(work, behind))
            with suppress(EndlessError):
                if any(item.is_kin for item in self.fellows):
                    found.append(_in_chain(kind, task, (urgent, less), outside, blocked))
        return min(found, key=attrgetter("response_ns"), default=None)

    def _jobs_before(self, worst: WorstJob) -> list[tuple[Task, int]]:
        """How many jobs of what go before the worst job: what preempts the executor first, then its fellows.

        At last the one of these that had begun, where that takes longer than what else blocks.
        """
        kind = self.kind
        jobs = [(item, most_jobs(item, worst.end_ns)) for item in self.higher]
        inside = [item for item in self.fellows if worst.chain_ns is None or not item.is_kin]
        jobs += [(item.task, worst.jobs(item.task)) for item in inside if kind != "callback_group" or item.goes_first]
        if worst.behind_ns > self.blocked_ns:
            begun = (item.task for item in inside if not item.goes_first and item.task.worst_ns == worst.behind_ns)
            jobs.append((next(begun), 1))
        return jobs


@lru_cache(16384)
def _remembered(window: Queued) -> WorstJob | None:
    return window.worst_job()


def window_of(resource: Resource, position: int, tasks: Sequence[Task | None], succession: Succession) -> Queued | None:
    """The busy window that decides the response time of a stage of an executor; None where it has no bound."""
    task = tasks[position]
    if task is None:
        return None
    if not task.worst_ns:
        return Queued("fifo", task, (), ())
    return beside(resource, position, tasks, succession)


def beside(resource: Resource, position: int, tasks: Sequence[Task | None], succession: Succession) -> Queued | None:
    """A stage of an executor or accelerator with all that may go before it; None where some of that has no bound.

    Of a less urgent callback of its group one job may have begun before it, however often that comes. Where the
    executor shares its priority on the core with others any job of the executor may have held these up before.
    """
    entry, task = resource.entries[position], tasks[position]
    assert task is not None and entry.executor is not None
    kind, stages = resource.kinds[entry.executor], succession.events.stages
    is_level_shared = shares_level(resource, position)
    if kind == "callback_group" and is_level_shared:
        kind = "wait_set"
    fellows: dict[int, Task] = {}
    is_known = True
    before = gaps_and_servers(resource, entry, tasks)
    higher = [item for item in before if item is not None]
    if len(higher) < len(before):
        return None
    for rival in entry.rivals:
        other, found = resource.entries[rival], tasks[rival]
        if found is None and counts_once(resource, entry, rival):
            found, is_known = once(stages[other.key]), is_known and kind != "polling"
        if found is None:
            return None
        if other.executor == entry.executor:
            fellows[rival] = found
        else:
            higher.append(found)
    mine, chains = stages[entry.key], succession.chains(entry.executor)
    working = [*(rival for rival, item in fellows.items() if item.worst_ns), position]
    has_sections = any(stages[resource.entries[item].key].has_section for item in working)
    # in lines: no earlier job of its own waits, and no section that is over has held up what preempts it
    is_preempted = any(item.worst_ns for item in higher)
    is_cut = is_level_shared or (has_sections and is_preempted)
    is_in_line = kind == "fifo" and chains.line(mine) is not None and not is_cut
    made = []
    for rival, found in fellows.items():
        other_stage = stages[resource.entries[rival].key]
        line = chains.line(other_stage) if is_in_line else None
        turn = int(rival in entry.earlier) - int(rival in entry.later)
        made.append(Fellow(found, rival in entry.urgent, chains.never_meet(mine, other_stage), line, turn))
    rounds = None if kind != "polling" or is_level_shared else mine.keeps
    if rounds is None and not is_known:
        return None
    return Queued(kind, task, tuple(made), tuple(higher), entry.blocking_ns, is_in_line, rounds, is_known)


def counts_once(resource: Resource, entry: Entry, position: int) -> bool:
    """Whether no more than one job of another stage matters to a stage, however often these come.

    In a callback group a less urgent one may have begun before; in an executor that polls one runs in each round.
    """
    if entry.executor is None or resource.entries[position].executor != entry.executor:
        return False
    if shares_level(resource, resource.entries.index(entry)):
        return False
    kind = resource.kinds[entry.executor]
    return kind == "polling" or (kind == "callback_group" and position not in entry.urgent)


def shares_level(resource: Resource, position: int) -> bool:
    """Whether something outside the executor of a stage may go before it, and the stage before that."""
    entry = resource.entries[position]
    others = (resource.entries[rival] for rival in entry.rivals)
    return any(other.executor != entry.executor and position in other.rivals for other in others)


def _longest(fellows: Iterable[Fellow]) -> Exact:
    return max((item.task.worst_ns for item in fellows), default=0)


def _fifo(work: Work) -> WorstJob:
    inside = (work.task, *work.fellows)
    busy = work.busy_ns()
    worst = WorstJob(0, 0, 0)
    last: Exact = -1
    end: Exact = 0
    for arrival in until_end(merge(*map(densest_releases_ns, inside)), busy):
        if arrival == last:
            continue
        last = arrival
        work.step()
        before = work.blocked_ns + sum(jobs_by(item, arrival) * item.worst_ns for item in inside)
        end = work.end(before, end)
        if end - arrival > worst.end_ns - worst.release_ns:
            worst = WorstJob(arrival, end, arrival)
    return worst


def _grouped(work: Work, behind_ns: Exact) -> WorstJob:
    """Job after job of the busy period of the task and of what goes before it."""
    busy = work.busy_ns()
    worst = WorstJob(0, 0, 0)
    start = end = work.blocked_ns
    for number, release in enumerate(until_end(densest_releases_ns(work.task), busy)):
        start = work.start(work.blocked_ns + number * work.task.worst_ns, start)
        fixed = work.blocked_ns + (number + 1) * work.task.worst_ns + work.before_start(start)
        end = work.end(fixed, end)
        if end - release > worst.end_ns - worst.release_ns:
            worst = WorstJob(release, end, start, behind_ns, work.comes_late)
    return worst


def _in_lines(work: Work) -> WorstJob:
    """A job that waits for one job of each line: none of these comes again before it has ended."""
    before = work.blocked_ns + work.task.worst_ns + sum(item.worst_ns for item in work.fellows)
    return WorstJob(0, work.end(before), 0, lines=tuple(work.fellows))


def _in_rounds(work: Work, rounds: int, inside: Sequence[Fellow]) -> WorstJob:
    """A job that is over after so many rounds, in each of which each callback runs once at most, and part of another.

    If the task was in the round that runs at the release that is itself, and what may come behind it there; if not, all
    others. Those whose turn is not known may have come behind it then, and before it in the last round.
    """
    own: Exact = work.task.worst_ns
    either = [item.task for item in inside if not item.turn]
    earlier = [item.task for item in inside if item.turn > 0]
    before = sum(item.worst_ns for item in earlier)
    more = earlier if before >= own else []
    whole = rounds * (own + sum(item.worst_ns for item in work.fellows))
    end = whole + sum(item.worst_ns for item in either) + max(before, own)
    return WorstJob(0, work.end(work.blocked_ns + end), 0, lines=(*tuple(work.fellows) * rounds, *either, *more))


def _in_chain(
    kind: ExecutorKind,
    task: Task,
    fellows: tuple[Sequence[Fellow], Sequence[Fellow]],
    outside: Sequence[Task],
    blocked_ns: Exact,
) -> WorstJob:
    """A job of a chain, whose other jobs in the busy period were over when it was released.

    They, and its own earlier ones, ran until then at most; of the less urgent `fellows`, the second ones, that had
    begun may have been one of theirs. When it is released counts: with each job that may come, and at the last moment
    by which they all ran.
    """
    urgent, less = fellows
    chain = [item.task for item in urgent if item.is_kin]
    others = [item.task for item in urgent if not item.is_kin]
    behind = _longest(item for item in less if not item.is_kin)
    own_behind = _longest(item for item in less if item.is_kin)
    ways: list[tuple[Work, Exact, Exact]] = [(Work(task, others, outside, max(blocked_ns, behind)), 0, behind)]
    if own_behind:
        ways.append((Work(task, others, outside, 0), own_behind, 0))
    busy = Work(task, [*chain, *others], outside, max(blocked_ns, behind, own_behind)).busy_ns(repeats=False)
    worst = WorstJob(0, 0, 0, chain_ns=0)
    for work, began, before in ways:
        for release, ran in _moments(work, began, chain, others if kind == "fifo" else (), busy):
            work.step()
            found = _after(work, kind, release, ran, before)
            if found.response_ns > worst.response_ns:
                worst = found
    return worst


def _moments(
    work: Work, began_ns: Exact, chain: Sequence[Task], others: Sequence[Task], busy_ns: Exact
) -> Iterator[tuple[Exact, Exact]]:
    """When a job of a chain is looked at, with the longest that its chain, `began_ns` first, can have run by then."""

    def ran(time: Exact) -> Exact:
        jobs = sum(jobs_by(item, time) * item.worst_ns for item in chain)
        return began_ns + jobs + (jobs_by(work.task, time) - 1) * work.task.worst_ns

    last: Exact | None = None
    most: Exact = 0
    for release in until_end(merge(*map(densest_releases_ns, (work.task, *chain, *others))), busy_ns):
        if last is not None and release == last:
            continue
        if last is not None and last < most < release:
            yield most, most
        last, most = release, ran(release)
        yield release, min(most, release)
    if last is not None and last < most:
        yield most, most


def _after(work: Work, kind: ExecutorKind, release: Exact, ran: Exact, behind: Exact) -> WorstJob:
    """The job of a chain that is released then, after its chain has run for some time."""
    before = work.blocked_ns + ran
    comes_late = kind != "fifo" and work.comes_late
    until = release if kind == "fifo" else work.start(before)
    waits = sum((most_jobs if comes_late else jobs_by)(item, until) * item.worst_ns for item in work.fellows)
    return WorstJob(release, work.end(before + waits + work.task.worst_ns), until, behind, comes_late, ran)
