"""Reads on a common clock in the second proof, beside response times: between which instants data are read.

The second model's own form of what a flow takes until a component reads (docs/semantics.md, section 3.6). Instants are
counted from the release of the timer before it, the sender. The reader's releases are at a whole number of steps g from
the difference d of both offsets. The latest read is at the first of them that is no sooner than all that is on the way,
every job at its response time, and a period less g behind it; the earliest at the first that is no sooner than the way
with nothing to wait for, or a step before that, where the reader may begin so late.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.measures import Term
from dse.analysis.rates import is_periodic
from dse.analysis.terms import Sampled
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.space.model.trees import at, is_given
from dse.support.units import Exact
from dse.verification.diagrams import NO_DESIGN, Diagram, Diagrams, TooLarge, leaves
from dse.verification.scheduling.sampling import beginners, clock_step_ns, on_the_way, timer_before, timer_of
from dse.verification.sums import Sum


@dataclass(frozen=True)
class Passage:
    """The time of a flow until a component reads, as a variable; diagrams of whole numbers, in the unit of waiting.

    `sender` is 0 where no timer on the reader's clock is before it, else the position from 1 on of its own sum in
    `since`. Where 0, it is `before` and `behind`; else the sum since the sender read, what is read `behind` the step,
    and from the earliest to the latest read (`is_jitter`) or to the latest. `step` is g, `offsets` are those of the
    reader and of the sender; data are there
    between `soonest` and `latest` after the sender's release, if nothing waits. Of the threads in `delayed`, `late`
    and `missed` the diagrams say whether their waiting delays the data, the reader, and the sender's own read.
    """

    before: Sum
    since: tuple[Sum, ...]
    sender: Diagram
    behind: Diagram
    step: Diagram
    offsets: tuple[Diagram, Diagram]
    soonest: Diagram
    latest: Diagram
    delayed: Mapping[int, Diagram]
    late: Mapping[int, Diagram]
    missed: Mapping[int, Diagram]
    is_jitter: bool

    @property
    def floor(self) -> tuple[Diagram, ...]:
        """Diagrams whose sum is a lower bound: the sum until the first timer reads, and `behind`."""
        first = self.since[0] if self.since else self.before
        return (*first.parts, *first.floors, self.behind)

    @property
    def high(self) -> int:
        """An upper bound of the passage."""
        longest: int = max([0, *leaves(self.behind)]) + 2 * max([1, *leaves(self.step)])
        return max(self.before.high, *(item.high for item in self.since), 0) + longest

    @property
    def diagrams(self) -> Iterator[Diagram]:
        """Every diagram of the passage."""
        for total in (self.before, *self.since):
            yield from total.diagrams
        yield from (self.sender, self.behind, self.step, *self.offsets, self.soonest, self.latest)
        yield from (*self.delayed.values(), *self.late.values(), *self.missed.values())

    @property
    def threads(self) -> set[int]:
        """The threads whose waiting counts in the passage."""
        return {*self.delayed, *self.late, *self.missed}


def passage_of(make: Diagrams, term: Term, before: Sum, since: Mapping[int, Sum], scale: int) -> Passage:
    """The time of a flow until the component of a term reads; times in 1 / `scale` ns.

    `since` are the sums until the components before it read.

    Raises
    ------
    TooLarge
        when a time is no whole number of that unit, or a read is counted from one that has no sum.
    """
    assert term.sampled is not None
    sampled = term.sampled
    alone = replace(sampled.space, processing="execution_time")
    drifting = replace(alone, components=tuple(replace(item, offset_ns=None) for item in alone.components))
    senders = list(since)
    read = partial(_Read, sampled, alone, drifting)

    def diagram(of: Callable[[_Read], Any]) -> Diagram:
        def formula(view: View) -> Any:
            return of(read(view))

        found = make.diagram(formula, f"reads of {term.label}")
        return make.mapped(found, lambda leaf: 0 if leaf is NO_DESIGN else leaf)

    def time(of: Callable[[_Read], Exact]) -> Diagram:
        return make.mapped(diagram(of), partial(in_units, scale))

    def position(found: _Read) -> int:
        if found.sender is None:
            return 0
        return senders.index(found.sender) + 1 if found.sender in since else -1

    sender = diagram(position)
    if -1 in leaves(sender):
        raise TooLarge(f"reads of {term.label} hang on one that is not taken apart")

    def of_threads(asked: Callable[[_Read], Iterable[int]]) -> dict[int, Diagram]:
        sets = make.mapped(diagram(lambda item: tuple(sorted(asked(item)))), lambda leaf: leaf or ())
        numbers = sorted({number for leaf in leaves(sets) for number in leaf})
        return {number: make.mapped(sets, lambda leaf, number=number: int(number in leaf)) for number in numbers}  # type: ignore[misc]

    is_jitter = sampled.kind == "jitter"
    return Passage(
        before=before,
        since=tuple(since.values()),
        sender=sender,
        behind=time(lambda item: item.behind_ns),
        step=time(lambda item: item.step_ns),
        offsets=(time(lambda item: item.offset_ns), time(lambda item: item.sender_offset_ns)),
        soonest=time(lambda item: item.soonest_ns),
        latest=time(lambda item: item.latest_ns),
        delayed=of_threads(lambda item: item.delayed),
        late=of_threads(lambda item: item.late) if is_jitter else {},
        missed=of_threads(lambda item: item.missed) if is_jitter else {},
        is_jitter=is_jitter,
    )


def in_units(scale: Fraction | int, time: Any) -> int:
    """A time in 1 / `scale` ns; raises `TooLarge` where it is no whole number of that."""
    found = Fraction(time) * scale
    if found.denominator != 1:
        raise TooLarge("some time between reads is no whole number of the unit of response times")
    return int(found)


class _Read:
    """A read in a partial design, all times in ns.

    `alone` is the space in which nothing waits, `drifting` the same without offsets, which are asked for apart.
    """

    def __init__(self, sampled: Sampled, alone: Space, drifting: Space, view: View) -> None:
        self.alone, self.drifting, self.step, self.view = alone, drifting, sampled.step, view
        self.component = alone.components[sampled.step.index]
        self._timer = timer_of(alone, self.step, view) if self._is_timed else None

    @property
    def _is_timed(self) -> bool:
        return is_periodic(self.component, self.view)

    @cached_property
    def _between(self) -> tuple[Exact, Exact]:
        """The time from the release of the timer before the reader until data may be there, if nothing waits."""
        found = timer_before(self.drifting, self.step, self.view) if self.sender is not None else None
        return (0, 0) if found is None else found[1:]

    @cached_property
    def sender(self) -> int | None:
        """The timer before the reader whose clock it shares, where both offsets are known."""
        if self._timer is None:
            return None
        number = self._timer.index
        other = self.alone.components[number]
        if clock_step_ns(other, self.component, self.view) is None:
            return None
        return number if all(is_given(item.offset_ns, self.view) for item in (other, self.component)) else None

    @property
    def step_ns(self) -> Exact:
        """The step of both timers; 1 where there is no sender."""
        if self.sender is None:
            return 1
        found = clock_step_ns(self.alone.components[self.sender], self.component, self.view)
        assert found is not None
        return found

    @property
    def behind_ns(self) -> Exact:
        """The time between the first and the last read of a step."""
        if not self._is_timed:
            return 0
        period: Exact = at(self.component.period_ns, self.view)
        return period if self.sender is None else period - self.step_ns

    @property
    def offset_ns(self) -> Exact:
        """The offset of the reader; 0 where there is no sender."""
        found: Exact = 0 if self.sender is None else at(self.component.offset_ns, self.view)
        return found

    @property
    def sender_offset_ns(self) -> Exact:
        """The offset of the sender; 0 where there is none."""
        found: Exact = 0 if self.sender is None else at(self.alone.components[self.sender].offset_ns, self.view)
        return found

    @property
    def soonest_ns(self) -> Exact:
        """The shortest time from the sender's release until data are there, in ns."""
        return self._between[0]

    @property
    def latest_ns(self) -> Exact:
        """The longest time until data are there if nothing waits, in ns."""
        return self._between[1]

    @property
    def delayed(self) -> set[int]:
        """The threads whose waiting makes data arrive later."""
        return set() if self.sender is None else set(on_the_way(self.alone, self.step, self.view))

    @property
    def late(self) -> set[int]:
        """The number of the reader, if it reads when its job begins; else an empty set."""
        return set() if self.sender is None else set(beginners(self.alone, self.step, self.view))

    @property
    def missed(self) -> set[int]:
        """The number of the sender, if it reads when its job begins; else an empty set."""
        if self._timer is None or self.sender is None:
            return set()
        return set(beginners(self.alone, self._timer, self.view))


def add_passage(
    model: cp_model.CpModel,
    passage: Passage,
    value: Callable[[Diagram], Any],
    total: Callable[[Sum], Any],
    waiting: Mapping[int, Any],
    longest_wait: int,
) -> Any:
    """The variable of a passage, no less than what it takes.

    `waiting` are the variables of threads, none of which is more than `longest_wait`.
    """
    found = model.new_int_var(0, passage.high, "")
    senders = {position: model.new_bool_var("") for position in sorted(set(leaves(passage.sender)))}
    sender = value(passage.sender)
    for position, literal in senders.items():
        model.add(sender == position).only_enforce_if(literal)
    model.add_exactly_one(senders.values())
    behind = value(passage.behind)
    if 0 in senders:
        model.add(found >= total(passage.before) + behind).only_enforce_if(senders[0])
    longest = max(leaves(passage.step))
    most = max([abs(leaf) for item in (*passage.offsets, passage.latest) for leaf in leaves(item)])
    last = 2 * (most + longest) + longest_wait * max(1, len(passage.delayed))
    latest = model.new_int_var(-last, last, "")
    model.add(latest >= value(passage.latest) + _shares(model, passage.delayed, value, waiting, longest_wait))
    earliest, counted = model.new_int_var(-last, last, ""), model.new_int_var(-last, last, "")
    steps = {length: model.new_bool_var("") for length in sorted(set(leaves(passage.step)))}
    step, soonest = value(passage.step), value(passage.soonest)
    ahead = value(passage.offsets[0]) - value(passage.offsets[1])
    for length, literal in steps.items():
        model.add(step == length).only_enforce_if(literal)
        for instant in (latest, earliest):
            times = model.new_int_var(-last // length - 1, last // length + 1, "")
            model.add(instant == ahead + length * times).only_enforce_if(literal)
        model.add(earliest <= soonest + length - 1).only_enforce_if(literal)
    model.add_exactly_one(steps.values())
    model.add(earliest >= soonest)
    meets = model.new_bool_var("")
    late, missed = (_shares(model, flags, value, waiting, longest_wait) for flags in (passage.late, passage.missed))
    model.add(counted + missed <= earliest).only_enforce_if(meets)
    for length, literal in steps.items():
        model.add(earliest + late <= soonest + length - 1).only_enforce_if([meets, literal])
    model.add(counted <= soonest).only_enforce_if(meets.negated())
    for position, literal in senders.items():
        if position > 0:
            since = total(passage.since[position - 1])
            passed = latest - counted if passage.is_jitter else latest
            model.add(found >= since + behind + passed).only_enforce_if(literal)
    return found


def _shares(
    model: cp_model.CpModel,
    flags: Mapping[int, Diagram],
    value: Callable[[Diagram], Any],
    waiting: Mapping[int, Any],
    longest_wait: int,
) -> Any:
    """The waiting of the threads whose flags are set, at least."""
    shares: list[Any] = []
    for number, flag in flags.items():
        if set(leaves(flag)) == {1}:
            shares.append(waiting[number])
            continue
        share, counts = model.new_int_var(0, longest_wait, ""), model.new_bool_var("")
        model.add(value(flag) == 0).only_enforce_if(counts.negated())
        model.add(share >= waiting[number]).only_enforce_if(counts)
        shares.append(share)
    return sum(shares)
