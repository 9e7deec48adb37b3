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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from dse.analysis.scheduling.overheads import switching_ns
from dse.analysis.scheduling.response_time import Stream, Task
from dse.analysis.scheduling.tasks import TaskKey, alone_ns
from dse.analysis.scheduling.turns import Turn
from dse.analysis.views import View
from dse.space.model.space import Component, Space
from dse.space.model.trees import leaves
from dse.support.units import Exact

Respond = Callable[[int, Exact], "Exact | None"]
"""The response time of a job that takes so long, with what blocks it, beside all that delays a piece on its core."""


class Segments:
    """The pieces of threads on some cores: what each takes there, as far as it is known."""

    def __init__(self, space: Space, cores: Sequence[Sequence[Turn]], view: View) -> None:
        self.space, self.view = space, view
        self._blocked = {turn.key[0]: turn.blocked_ns for turns in cores for turn in turns if turn.pieces}
        self.spans: dict[int, Exact | None] = {}
        """How long after its own release each piece ends, as far as it is known."""
        self._alone: dict[int, int] = {}

    def alone_ns(self, number: int) -> int:
        """What a thread takes until the end of a piece where nothing delays it."""
        found = self._alone.get(number)
        if found is None:
            found = self._alone[number] = elapsed_ns(self.space, number, self.view)[1]
        return found

    def end_ns(
        self,
        turn: Turn,
        span_ns: Exact | None,
        known: Mapping[TaskKey, Exact | None],
        releases: tuple[Stream, ...] | None,
        separation_ns: int | None,
        respond: Respond,
    ) -> Exact | None:
        """How long after the release of its thread a piece ends at the latest, `span_ns` after its own release.

        `releases` and `separation_ns` are those of the thread.
        """
        number = turn.key[0]
        position = turn.pieces.index(number)
        self.spans[number] = span_ns
        earlier = turn.pieces[position - 1] if position else None
        begin: Exact | None = 0
        if earlier is not None:
            begin = known.get((earlier, "thread"), self.alone_ns(earlier))
        last: TaskKey = (turn.pieces[-1], "thread")
        if span_ns is None or begin is None or known.get(last, 0) is None or releases is None:
            return None
        found = begin + span_ns
        if position and turn.executor is None:
            together = self.together_ns(turn.pieces[: position + 1])
            end = None if together is None else respond(*together)
            found = found if end is None else min(found, end)
        apart = apart_ns(releases, separation_ns)
        return found if apart is None or found <= apart else None

    def since_ns(
        self,
        turn: Turn,
        known: Mapping[TaskKey, Exact | None],
        releases: tuple[Stream, ...] | None,
        separation_ns: int | None,
    ) -> dict[int, Exact]:
        """How long before the release of a piece each piece of its thread has ended that ran before, at least.

        Those behind it, and it itself, have done so in an earlier job; where there is none they are left out.
        """
        position = turn.pieces.index(turn.key[0])
        found: dict[int, Exact] = dict.fromkeys(turn.pieces[:position], 0)
        apart = None if releases is None else apart_ns(releases, separation_ns)
        if apart is not None:
            for number in turn.pieces[position:]:
                end = known.get((number, "thread"), self.alone_ns(number))
                found[number] = 0 if end is None else max(0, apart - end)
        return found

    def together_ns(self, pieces: Sequence[int]) -> tuple[int, Exact] | None:
        """All of these pieces of a thread, and the times away, as one job: what it takes, and what blocks it."""
        taken: Exact = 0
        blocked: Exact = 0
        for number in pieces:
            component = self.space.components[number]
            least = alone_ns(component, "thread", self.view)[1]
            if component.executor is None:
                taken += least + switching_ns(self.space, number, self.view)
                blocked += self._blocked.get(number, 0)
                continue
            span = self.spans.get(number, least)
            if span is None:
                return None
            taken += span
        is_whole = type(taken) is Fraction and taken.denominator == 1
        return (int(taken) if is_whole else taken), blocked  # type: ignore[return-value]


def elapsed_ns(space: Space, number: int, view: View) -> tuple[int, int]:
    """The shortest and longest time of a thread's job until the end of a component, all its pieces so far."""
    times = [alone_ns(item, "thread", view) for item in _so_far(space, number)]
    return sum(least for least, _ in times), sum(most for _, most in times)


def always_executes(space: Space, number: int) -> bool:
    """Whether a thread executes something in every design, until the end of a component in each piece."""
    return all(leaf is not None for item in _so_far(space, number) for leaf in leaves(item.execution_ns))


def _so_far(space: Space, number: int) -> list[Component]:
    """A component, and the pieces of its thread before it."""
    pieces = space.components[number].pieces
    members = (number,) if pieces is None else pieces.members[: pieces.members.index(number) + 1]
    return [space.components[item] for item in members]


def apart_ns(releases: Sequence[Stream], separation_ns: int | None) -> Exact | None:
    """How far apart two releases of a thread are at least; None where there is one only."""
    if not releases:
        return None
    streams = releases[0].period_ns - releases[0].jitter_ns if len(releases) == 1 else 0
    return max(0, streams, separation_ns or 0)


def single(task: Task) -> Task:
    """One job of a task alone: those before it have ended."""
    return replace(task, streams=(), separation_ns=None)
