"""When the pieces of a thread end: a thread with segments runs, waits on an accelerator, and runs on.

The job of a thread goes from piece to piece; each is released when the one before ends, so that others see it as a
task of its own, with the jitter of that (K. Tindell and J. Clark, "Holistic schedulability analysis for distributed
hard real-time systems", Microprocessing and Microprogramming 40, 1994). How late a piece ends after the release of
its thread is bounded twice, and the lesser bound counts:

* by the end of the piece before, and the longest time from there to its own end: one job, delayed by whatever else
  goes before it where it runs;
* by looking at the thread's core alone, from the release on: a job of all work done there so far, and of the times
  away, which may be delayed at any moment (suspension-oblivious for the thread itself, exact for the work of others;
  J.-J. Chen et al., "Many suspensions, many problems: a review of self-suspending tasks in real-time systems",
  Real-Time Systems 55, 2019, section 4.2).

The pieces of one thread never wait for each other: those of one job come one after the other, and a job ends before
the next is released. Where that cannot be shown, no piece of the thread has a bound: of all jobs that end later than
that the first would contradict its bound. On an accelerator that serves in the order of arrival each other thread with
segments has at most one piece before a new one, for the same reason.

They may delay what delays them: jobs of others that have waited for a piece go before the next one. That cannot be
where all of these are more urgent and preempt it. Else such jobs are counted: of an accelerator those that come while
the earlier pieces run, and among equal priorities the pieces count as others' do. (docs/semantics.md, section 4.7)
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.analysis.scheduling.event_models import EventModels, Streams, apart_ns
from dse.analysis.scheduling.model import Entry, Resource
from dse.analysis.scheduling.policies import preemptive
from dse.analysis.scheduling.policies.preemptive import Preempted
from dse.support.units import Exact

Spans: TypeAlias = "dict[TaskKey, Exact | None]"
"""How long after its own release each piece ends, in ns, as far as it is known; None without a bound."""


class Segments:
    """The pieces of threads on some resources: when each ends, as response times are known by now.

    Times in ns; used by cores and accelerators alike.
    """

    def __init__(self, events: EventModels, resources: Sequence[Resource], spans: Spans) -> None:
        self.events, self.spans = events, spans
        self._blocked = {item.key: item.blocked_ns for one in resources for item in one.entries if item.is_piece}

    def end_ns(
        self, resource: Resource, position: int, tasks: Sequence[Task | None], span_ns: Exact | None
    ) -> Exact | None:
        """The latest end of a piece after the release of its thread, where it ends `span_ns` after its own release.

        In ns; None without a bound, and where the end comes later than the thread's next release, for which the bound
        does not hold.
        """
        entry = resource.entries[position]
        pieces, index = self._place(entry)
        self.spans[entry.key] = span_ns
        begin: Exact | None = 0 if not index else self._end_of(pieces[index - 1])
        releases = self.events.streams(pieces[0])
        if span_ns is None or begin is None or self.events.ends.get(pieces[-1], 0) is None or releases is None:
            return None
        found = begin + span_ns
        together = self.together(resource, position, tasks)
        if together is not None:
            end = together.response_ns()
            found = found if end is None else min(found, end)
        apart = apart_ns(releases, self._separation_ns(entry))
        return found if apart is None or found <= apart else None

    def _place(self, entry: Entry) -> tuple[tuple[TaskKey, ...], int]:
        pieces = self.events.stages[entry.key].pieces
        return pieces, pieces.index(entry.key)

    def _end_of(self, piece: TaskKey) -> Exact | None:
        return self.events.ends.get(piece, self.events.stages[piece].elapsed_ns[1])

    def _separation_ns(self, entry: Entry) -> int | None:
        return self.events.stages[self.events.stages[entry.key].first].separation_ns

    def apart_ns(self, entry: Entry) -> Exact | None:
        """The least time between two releases of the thread of a piece; None where it is not known.

        In ns.
        """
        releases: Streams = self.events.streams(self.events.stages[entry.key].first)
        return None if releases is None else apart_ns(releases, self._separation_ns(entry))

    def since_ns(self, entry: Entry) -> dict[TaskKey, Exact]:
        """How long before the release of a piece each piece of its thread has ended that ran before, at least.

        Those behind it, and it itself, have done so in an earlier job; where there is none they are left out.
        """
        pieces, index = self._place(entry)
        found: dict[TaskKey, Exact] = dict.fromkeys(pieces[:index], 0)
        apart = self.apart_ns(entry)
        if apart is not None:
            for key in pieces[index:]:
                end = self._end_of(key)
                found[key] = 0 if end is None else max(0, apart - end)
        return found

    def together(self, resource: Resource, position: int, tasks: Sequence[Task | None]) -> Preempted | None:
        """All work of a thread on its core so far, and the times away, as one job from the release of the thread on.

        None for a first piece, for one away from the core, and where something has no bound.
        """
        entry = resource.entries[position]
        pieces, index = self._place(entry)
        if not index or entry.executor is not None:
            return None
        taken: Exact = 0
        blocked: Exact = 0
        for key in pieces[: index + 1]:
            stage = self.events.stages[key]
            if not stage.is_away:
                taken += stage.cost_ns
                blocked += self._blocked.get(key, 0)
                continue
            span = self.spans.get(key, stage.worst_ns)
            if span is None:
                return None
            taken += span
        is_whole = type(taken) is Fraction and taken.denominator == 1
        streams: tuple[Stream, ...] = ()
        separation = None
        if entry.shares_turn:
            streams, separation = self.events.streams(pieces[0]) or (), self._separation_ns(entry)
        job = Task("", int(taken) if is_whole else taken, streams, separation)  # type: ignore[arg-type]
        if not job.worst_ns:
            return Preempted(job, ())
        rivals = preemptive.rivals_of(resource, entry, tasks)
        return None if rivals is None else Preempted(job, rivals, blocked)

    def away_ns(self, pieces: Sequence[TaskKey]) -> Exact:
        """The total time that these pieces of a thread spend away from its core, in ns.

        The sum of the spans of pieces on accelerators.
        """
        return sum((self.spans[key] or 0 for key in pieces if self.events.stages[key].is_away), 0)
