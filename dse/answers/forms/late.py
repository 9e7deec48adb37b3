"""The forms of why threads are late, flows too long and cores overloaded: parts of explanations."""

from __future__ import annotations

from dse.answers.forms.base import Figure, Form, field


class Delay(Form):
    """Jobs of what goes before a late thread."""

    name: str = field("The thread or interrupt.")
    jobs: int = field("How many jobs of it go before the worst one of the late thread.")
    work_ns: Figure = field("What they take together.")


class Shorter(Form):
    """What alone would let a late thread end in time."""

    name: str = field("The thread, its piece, or the interrupt.")
    by_ns: Figure = field("How much less each of its jobs takes then, or each of its sections.")
    section: bool = field("Whether its section that nothing interrupts is meant, not its jobs.", earlier=False)


class Budget(Form):
    """The budget of the reservation that a late thread is in."""

    reservation: str = field("The reservation.")
    budget_ns: Figure = field("Its budget.")
    period_ns: Figure = field("The period in which it has that.")
    is_served: bool = field("Whether the budget is there in each period behind what goes before the reservation.")
    enough_ns: Figure | None = field("The least budget with which the thread is in time; null where none is enough.")


class Wait(Form):
    """What a thread does on a core, or a piece of it does there or on an accelerator, and what it waits for there."""

    name: str = field("The thread or the piece; the thread where all its pieces on the core are taken together.")
    processor: str = field("The processor or accelerator.")
    core: int = field("The core, from 1.")
    work_ns: Figure = field("What it does itself.")
    earlier_jobs: int = field("How many earlier jobs of its own thread go before it.")
    earlier_ns: Figure = field("What these take.")
    delays: list[Delay] = field("The jobs of others that go before it.")
    blocked_by: str = field("The thread whose section that nothing interrupts has begun before; empty where none has.")
    blocked_ns: Figure = field("What that takes.")
    over_ns: Figure = field("How much of all this is over when it is released.")
    response_ns: Figure = field("From its release to its end: all of this without what is over by then.")


class Full(Form):
    """A core of which more than all is needed."""

    processor: str = field("The processor or accelerator.")
    core: int = field("The core, from 1.")
    share_ppm: Figure = field("The share that a thread and what goes before it need together, in ppm.")


class Late(Form):
    """A thread that ends too late, and why."""

    thread: str = field("The thread.")
    processor: str = field("The processor that it runs on.")
    core: int = field("The core, from 1.")
    late_ns: Figure | None = field("How long after its limit it ends; null where it has no bound.")
    work_ns: Figure = field("What its own jobs take up to then.")
    blocked_ns: Figure = field("What less urgent work takes that has begun before.")
    executor: str = field("The executor or accelerator in which it waits for others; empty where there is none.")
    delays: list[Delay] = field("What goes before it, the most urgent first; empty without a bound, and of segments.")
    shorter: list[Shorter] = field("Each of these is enough by itself.")
    budget: Budget | None = field("Of the reservation that it is in; null outside of any.", earlier=None)
    accelerators: list[str] = field(
        "The accelerators that its segments wait for, in the order of these; empty where it has none.", earlier=[]
    )
    endless: list[str] = field(
        "Of one without a bound, the threads that have none themselves and because of which it has none.", earlier=[]
    )
    limit_ns: Figure | None = field(
        "The limit that it misses; null where it has none of its own, and in earlier files.", earlier=None
    )
    waits: list[Wait] = field(
        "What it waits for, with segments piece by piece; the response times add up to its own. Without a bound and "
        "with segments what would make a job end after `ends_ns`, at the least; else empty without a bound.",
        earlier=[],
    )
    full: Full | None = field(
        "Of one without a bound, where it and what goes before it need more than there is; null where they do not.",
        earlier=None,
    )
    ends_ns: Figure | None = field(
        "When a job of it ends after its release, if `waits` tell it; else null.", earlier=None
    )
    apart_ns: Figure | None = field(
        "Of one with segments and without a bound, how long after its release the next job may come, before which it "
        "has to end; else null.",
        earlier=None,
    )


class Waiting(Form):
    """A thread of a flow that waits for others."""

    thread: str = field("The thread.")
    waited_ns: Figure = field("How much later than by itself it ends.")
    waits: list[Wait] = field("What it waits for, with segments piece by piece.")


class Delayed(Form):
    """A broken limit on what counts response times of flows, and who waits in these."""

    requirement: str = field("The limit, in the words of the problem.")
    waiting: list[Waiting] = field("The threads that wait, longest first.")
    shorter: list[Shorter] = field("Each of these would keep it by itself.")


class Use(Form):
    """What a thread uses of a core, or a connection of a bus."""

    thread: str = field("The thread, or the connection.")
    share_ppm: Figure = field("Its share of the core or the bus, in ppm.")


class Overload(Form):
    """A core or bus that is used beyond a limit, or threads that have no partition which keeps it."""

    requirement: str = field("The limit, in the words of the problem.")
    processor: str = field("The processor, accelerator or bus.")
    core: int = field("The core, from 1; 0 where threads have no core yet and no partition keeps the limit.")
    cores: int = field("How many cores the processor has.")
    limit_ppm: Figure = field("How much of each core may be used, in ppm of it.")
    total_ppm: Figure = field("What the threads use together, in ppm of one core.")
    uses: list[Use] = field(
        "The threads, those that use most first; without a core those that have no partition, of which none can be "
        "left out."
    )
    unbounded: list[str] = field("The late threads that have no bound because of it.")
    shorter: list[Shorter] = field("Each of these would keep the limit by itself; empty without a core.")
    executor: str = field(
        "An executor whose threads, which share a core, break the limit by themselves; empty where none do.", earlier=""
    )
