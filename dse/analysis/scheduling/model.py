"""The plain model of a design: stages of jobs, the resources that serve them, and the system that they make up.

`dse.analysis.scheduling.resolve` makes it of a space and a design. All that is computed of response times is a function
of it alone: no formula behind it looks at a space or at decisions.

The words are those of the field: a *stage* is one visit of a job to a resource (a step of MAST, a subtask of
K. Tindell), a *release* one way in which it comes about, and a *resource* a core or an accelerator, which serves the
stages on it by its policies (`dse.analysis.scheduling.policies`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias

from dse.analysis.scheduling.busy_window import Stream, Task, TaskKey
from dse.spec.kinds import Arbitration, ExecutorKind
from dse.support.units import Exact

ChainKey: TypeAlias = tuple[int, int]
"""The last and the first thread of a chain on one core (`dse.analysis.scheduling.policies.chains`)."""
LagKey: TypeAlias = tuple[int, int, Literal["lag", "joined"]] | tuple[int, Literal["message"], Literal["lag"]]
"""The last and the first thread of a chain on one core, a thread twice, or a message, of which the lag is meant.

Of a thread that needs all its inputs, *joined*, counted from the latest release by messages in order.
"""
EndKey: TypeAlias = "TaskKey | ChainKey | LagKey"


def lag_of(key: TaskKey) -> LagKey:
    """The key of the lag of a thread or a message; callbacks have none, and no key of theirs is in `Ends`."""
    return (key[0], "message", "lag") if key[1] == "message" else (key[0], key[0], "lag")


Ends: TypeAlias = Mapping[EndKey, "Exact | None"]
"""For stages how long after the release of its thread each ends, in ns, as far as it is known; None without a bound.

For chains how long after the release of its first thread the last one ends, less the longest times that what they send
each other is on its way. The lag of either is how long after the latest release that there can be, counted from the
release of its source, it ends (docs/semantics.md, section 4.9, of a message 5.4); it is there where that may be less.
So is the time from the latest release of a thread that needs all its inputs (section 3.8).
"""


@dataclass(frozen=True, slots=True)
class Release:
    """One way in which a stage is released: by a source of its own, or by the end of another stage.

    A source is a `stream` of releases. What the stage `after` sends arrives `least_ns` to `most_ns` after its end. It
    `is_steady` where something comes in each period, later by the jitter at most: none is lost.
    """

    stream: Stream | None = None
    after: TaskKey | None = None
    least_ns: Exact = 0
    most_ns: Exact = 0
    is_steady: bool = False


class Stated(NamedTuple):
    """A core that a file states for a thread, by the numbers of the processor and of the core, and its priority."""

    processor: int
    core: int
    priority: int

    def shares_core(self, other: Stated) -> bool:
        """Whether another thread is on the same core."""
        return self[:2] == other[:2]


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """One visit of a job to a resource, or to none where nothing delays it. Times in ns.

    Attributes
    ----------
    key
        the thread or device by its number in the space, and which of its tasks; or the connection of a message.
    name
        what tables call it.
    best_ns, worst_ns
        what one job takes by itself.
    cost_ns
        the longest time with the context switches to it and back.
    releases, separation_ns
        what releases it, and the least time between two jobs; None where nothing keeps them apart.
    pieces
        the stages of its thread in their order, itself among them; none where the thread is one stage.
    elapsed_ns
        the shortest and longest time from the release of its thread to its own end where nothing delays any of it.
    is_away
        whether it is a piece that an accelerator serves, away from the core of its thread.
    follows
        the only stage whose end releases it, in a chain of which each job may end before the next one begins; None
        where there are others, a timer, a separation, or a time for which what is sent waits.
    is_chained
        whether it may be one chain with the stage that it follows, by what the file offers.
    has_section
        whether nothing interrupts it for a part of its time.
    rooms
        of one that needs an event of each of its releases for a job, how many of each wait at most for the others
        (None: as many as come); none where each event of any of them releases a job.
    stated
        its core and its priority where these are the same in every design, and nothing but its priority schedules it.
    keeps
        how many of its jobs wait in an executor that polls; what comes beyond is dropped. None where all wait.
    paired_ns
        of one that needs an event of each of its releases, and holds no job back, the longest period of the timers that
        these come from.
    stored_by
        of the timer of a hybrid thread that needs an event of each of its releases the stage that stores them: jobs
        come when the timer, of the period `separation_ns`, finds all stored. None where events release jobs at once.
    """

    key: TaskKey
    name: str
    best_ns: int
    worst_ns: int
    cost_ns: int
    releases: tuple[Release, ...]
    separation_ns: int | None = None
    pieces: tuple[TaskKey, ...] = ()
    elapsed_ns: tuple[int, int] = (0, 0)
    is_away: bool = False
    follows: Release | None = None
    has_section: bool = False
    is_chained: bool = False
    rooms: tuple[int | None, ...] = ()
    keeps: int | None = None
    stated: Stated | None = None
    paired_ns: int | None = None
    stored_by: TaskKey | None = None

    @property
    def first(self) -> TaskKey:
        """The stage with which its thread begins."""
        return self.pieces[0] if self.pieces else self.key

    @property
    def is_lone(self) -> bool:
        """Whether its releases depend on no other stage."""
        return self.stored_by is None and all(release.after is None for release in self.releases)


@dataclass(frozen=True, slots=True)
class Entry:
    """A stage in the order of its resource; what else is there is named by its position in that order.

    Attributes
    ----------
    rank
        how many of the stages before it always go first.
    rivals
        the positions of what may go before it where it runs: in its reservation, if it is in one.
    blockers, blocked_ns
        the stages that never go before it but may keep the resource all the same, each with its section, in ns; and
        the longest of these.
    executor, urgent
        the executor that runs it, and which positions of that go first where they wait with it.
    earlier, later
        which positions of its executor have priorities that put them before it in a round, and behind it.
    siblings, shares_turn
        the other pieces of its thread here, and whether something may delay it that one of these, or an earlier job of
        it, may delay.
    reservation, outside, servers
        the reservation that it is in, the positions of what is in none and may delay that, and the reservations that
        may delay it.
    """

    key: TaskKey
    rank: int
    rivals: tuple[int, ...]
    blockers: tuple[tuple[TaskKey, int], ...] = ()
    blocked_ns: Exact = 0
    executor: int | None = None
    urgent: frozenset[int] = frozenset()
    is_piece: bool = False
    siblings: tuple[int, ...] = ()
    shares_turn: bool = False
    reservation: int | None = None
    outside: tuple[int, ...] = ()
    servers: tuple[int, ...] = ()
    earlier: frozenset[int] = frozenset()
    later: frozenset[int] = frozenset()

    @property
    def blocking_ns(self) -> Exact:
        """For how long less urgent work may keep it waiting; in a reservation the supply holds whatever blocks that."""
        return self.blocked_ns if self.reservation is None else 0

    @property
    def before(self) -> tuple[int, ...]:
        """The positions of all that may delay it, or its reservation."""
        return self.rivals if self.reservation is None else tuple(sorted({*self.rivals, *self.outside}))


@dataclass(frozen=True, slots=True)
class Server:
    """A reservation: a budget in each period, with what it takes to switch to it and back."""

    name: str
    budget_ns: int
    period_ns: int
    switching_ns: int


@dataclass(frozen=True, slots=True)
class Wire:
    """The arbitration of a bus between waiting messages; times in ns, tuples by the entries of the resource.

    Attributes
    ----------
    arbitration
        what decides which message goes next.
    bit_ns
        what comes up to so much after a start still competes for it.
    last_ns
        the longest time of the last frame of each message, before which nothing else goes once it has begun.
    turns
        the messages of which one may go before each message of its sender, one for each other sender.
    identifiers
        those of the messages where these decide, chosen ones among them; else none.
    lines
        for each message the positions of those that its sender queues with it as they come, itself among them; none of
        one whose sender queues by identifier.
    faults
        for each message the faults of the wire as a task, each with the frame that is sent again; none where none are
        counted.
    """

    arbitration: Arbitration
    bit_ns: Exact
    last_ns: tuple[Exact, ...]
    turns: tuple[tuple[Task, ...], ...]
    identifiers: tuple[int, ...] = ()
    lines: tuple[tuple[int, ...], ...] = ()
    faults: tuple[Task, ...] = ()


NO_PROCESSOR = -1
"""In place of a processor of what is a bus."""


@dataclass(frozen=True, slots=True, eq=False)
class Resource:
    """A core, an accelerator or a bus with all that it serves, the most urgent first.

    `interrupts` go before everything on it. `kinds` are those of its executors, and `servers` its reservations, both by
    their numbers in the space. An accelerator has one core, which has no number to anybody. A bus has a `wire`; its
    number is that of the `core` of no processor.
    """

    processor: int
    core: int
    entries: tuple[Entry, ...]
    interrupts: tuple[Task, ...] = ()
    kinds: Mapping[int, ExecutorKind] = field(default_factory=dict)
    servers: Mapping[int, Server] = field(default_factory=dict)
    is_accelerator: bool = False
    wire: Wire | None = None

    @property
    def is_plain(self) -> bool:
        """Whether nothing but the priorities of whole stages decides its response times."""
        return (
            self.wire is None
            and not self.kinds
            and not self.servers
            and not any(entry.is_piece for entry in self.entries)
        )


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """The resources of a design, in the order of the file, and all stages on them or before these.

    Response times that grow beyond `horizon_ns` by their own jitter have no bound. Of a system that `is_traced` times
    are numbers that remember how they were made: nothing found of them is kept. One that `is_part` of a design leaves
    threads out, which may be anywhere.
    """

    stages: Mapping[TaskKey, Stage]
    resources: tuple[Resource, ...]
    horizon_ns: int
    is_traced: bool = False
    is_part: bool = False

    def place(self, key: TaskKey) -> tuple[Resource, int] | None:
        """The resource of a stage and its position there; None where it runs on none of these."""
        for resource in self.resources:
            for position, entry in enumerate(resource.entries):
                if entry.key == key:
                    return resource, position
        return None
