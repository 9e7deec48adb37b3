"""Peers for deadlines and open cores: how else limits on response times are made part of an exact search.

All run the textbook loop of two objectives (`textbook.py`) on the plain model, and judge each optimum by the analysis.
They differ in what the model knows of deadlines, and in what a refused optimum teaches:

* `Rows`: a row of request bounds for each thread, in each rate and on each core, and a binary for each point at which
  it may hold (H. Zeng and M. Di Natale, "An efficient formulation of the real-time feasibility region for design
  optimization", IEEE Transactions on Computers 62(4), 2013), the points of Bini and Buttazzo over all rates that may
  be more urgent. What the rows leave open, jitter of event-triggered threads alone, is cut as in the next.
* `Loop`: nothing; a refused optimum is cut, the combination of all options at once.
* `Cores`: nothing; a refused optimum is cut with the unschedulability cores of its late threads (Y. Zhao and H. Zeng,
  "The concept of unschedulability core for optimizing priority assignment in real-time systems", DATE 2017): threads
  are taken away as long as those left are late, then rates are lowered as long as they still are. They are late
  together on any of the cores, with these rates or higher ones, on any type that is no faster. What is late
  by its jitter alone is cut as in `Loop`.

In favour of all: equal cores are numbered, which the papers do not speak of. `in_our_search` gives the first and the
last the rest of our search too, so that the two ways to meet deadlines are compared, and nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from fractions import Fraction
from typing import Any
from unittest.mock import patch

from ortools.sat.python import cp_model

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import judge
from dse.analysis.rates import NS_PER_S, is_event_triggered, rate_hz
from dse.analysis.views import View
from dse.encode.model import EncodedSpace
from dse.encode.scheduling import contention
from dse.encode.scheduling.core_demand import jobs_within, scheduling_points
from dse.encode.scheduling.schedulability import Deadline
from dse.encode.scheduling.threads import Places, Thread
from dse.search.solver import strategy
from dse.space.model.space import Design, Space
from dse.space.model.trees import at

from .asking import Ask, Vector, within_processor_time
from .textbook import textbook_front

Member = tuple[Thread, Fraction]
"""A thread with a rate (Hz)."""


class Loop:
    """Asks until the analysis accepts an optimum; cuts the whole design that it refuses."""

    def __init__(self, ask: Ask, evaluator: Evaluator, encoded: EncodedSpace) -> None:
        assert encoded.contention is not None, "nothing is asked about response times"
        self.inner, self.evaluator, self.encoded = ask, evaluator, encoded
        self.space: Space = evaluator.space
        self.model, self.places = encoded.model, encoded.contention.places
        self.deadlines = encoded.contention.deadlines
        self.literals = [literal for literals in encoded.options for literal in literals]
        self.refused = 0
        encoded.contention.number_cores()

    def __call__(self, model: Any, variables: Sequence[Any], left_s: float) -> Vector | None:
        while True:
            # the values of the literals too: the design is read from them
            found = self.inner(model, [*variables, *self.literals], left_s)
            if found is None:
                return None
            values = iter(found[len(variables) :])
            design = tuple(
                next((option for option, value in enumerate([next(values) for _ in literals]) if value), -1)
                for literals in self.encoded.options
            )
            if self.evaluator.evaluate(design).is_feasible:
                return found[: len(variables)]
            self.refused += 1
            self.cut(design)

    def cut(self, design: Design) -> None:
        """Never this combination again."""
        self.model.add_bool_or(
            [self.encoded.options[index][option].negated() for index, option in enumerate(design) if option >= 0]
        )

    def literal(self, index: int) -> Any:
        """The solver's literal of an index; negative ones negated."""
        found = self.model.get_int_var_from_proto_index(index if index >= 0 else -index - 1)
        return found if index >= 0 else found.negated()


class Rows(Loop):
    """With rows for each thread from the start."""

    def __init__(self, ask: Ask, evaluator: Evaluator, encoded: EncodedSpace) -> None:
        super().__init__(ask, evaluator, encoded)
        for processor in range(len(self.space.processors)):
            add_thread_rows(self.space, self.model, self.places, processor, self.deadlines)


class Cores(Loop):
    """Learns why threads are late."""

    def cut(self, design: Design) -> None:
        """Why the late threads are late; the whole combination where that is their jitter."""
        view = View(design)
        reasons = [self._learn(item.thread, view) for item in self.deadlines if not judge(item.limit, view).holds]
        if not any(reasons):
            super().cut(design)

    def _learn(self, number: int, view: View) -> bool:
        """Forbid a least set of threads that makes a thread late; whether there is one."""
        late, processor = self.places.threads[number], self.places.processor_of(number, view)
        own = rate_hz(self.space, ("activation", number), view)
        if is_event_triggered(self.space.components[number], view) or late.rates is None:
            return False
        slot = self.space.processors[processor].type_decision
        kind = self.places.types[processor].index(self.places.chosen(slot, view.design[slot]))
        beside = [
            (thread, rate_hz(self.space, ("activation", thread.number), view))
            for thread in self.places.on(processor)
            if thread.rates is not None and self._place(thread.number, view) == self._place(number, view)
        ]
        least = self._least(processor, kind, (late, own), beside)
        if least is not None:
            self._forbid(processor, kind, (late, own), least)
        return least is not None

    def _place(self, number: int, view: View) -> tuple[int, int]:
        return self.places.processor_of(number, view), at(self.space.components[number].core, view) or 1

    def _least(self, processor: int, kind: int, late: Member, beside: Sequence[Member]) -> list[Member] | None:
        """As few threads beside a late one as keep it late, at rates as low as keep it late; None where it is not."""
        worst = {thread.number: self.places.worst_on[processor, thread.number][kind] for thread, _ in beside}

        def is_late(members: Sequence[Member]) -> bool:
            urgent = [(worst[thread.number], rate) for thread, rate in members]
            return ends_late(worst[late[0].number], urgent, int(NS_PER_S / late[1]))

        members = [one for one in beside if one[0] is not late[0] and is_before(one, late)]
        if not is_late(members):
            return None
        for one in list(members):
            fewer = [other for other in members if other is not one]
            if is_late(fewer):
                members = fewer
        for position, (thread, rate) in enumerate(members):
            for slower in sorted({item for _, item in thread.rates or () if 0 < item < rate}):
                changed = [*members[:position], (thread, slower), *members[position + 1 :]]
                if is_before((thread, slower), late) and is_late(changed):
                    members = changed
                    break
        return members

    def _forbid(self, processor: int, kind: int, late: Member, members: Sequence[Member]) -> None:
        """Not together on any core, on a type that is no faster for them."""
        threads = [late[0], *(thread for thread, _ in members)]
        times = [self.places.worst_on[processor, thread.number] for thread in threads]
        slower = [
            index
            for position, index in enumerate(self.places.types[processor])
            if all(one[position] >= one[kind] for one in times)
        ]
        held = [self._any(slower), self._any([index for index, rate in late[0].modes if rate == late[1]])]
        held += [self._any([index for index, own in thread.rates or () if own >= rate]) for thread, rate in members]
        for cores in self.places.cores_of(processor, [thread.number for thread in threads]):
            self.model.add_bool_or([*(one.negated() for one in held), *(self.literal(-index - 1) for index in cores)])

    def _any(self, indices: Sequence[int]) -> Any:
        """A literal that is true where one of these is."""
        if len(indices) == 1:
            return self.literal(indices[0])
        made = self.model.new_bool_var("")
        for index in indices:
            self.model.add_implication(self.literal(index), made)
        return made


PEERS: dict[str, type[Loop]] = {"rows per thread": Rows, "unschedulability cores": Cores, "referee loop": Loop}


WAYS = ("rows per thread", "unschedulability cores")
"""Those that our search can use in place of its own."""


@contextmanager
def in_our_search(way: str) -> Iterator[None]:
    """Within it, our search meets deadlines as a peer does.

    No threads are moved, no design is exchanged for a roomier one, and there are no rows of levels. What remains is
    the search itself, and clauses from late threads (ours). With no way everything is as it is.
    """
    with ExitStack() as stack:
        if way:
            rows = add_thread_rows if way == "rows per thread" else lambda *_: []
            stack.enter_context(patch.object(contention, "placements", lambda *_: ()))
            stack.enter_context(patch.object(contention, "add_rows", rows))
            stack.enter_context(patch.object(strategy, "roomier", lambda *_: None))
        yield


def ends_late(work_ns: int, urgent: Sequence[tuple[int, Fraction]], latest_ns: int) -> bool:
    """Whether the first job of a thread ends late, delayed by threads of these times and rates (Joseph and Pandya).

    >>> [ends_late(5, [(3, Fraction(NS_PER_S, 7)), (3, Fraction(NS_PER_S, 12))], latest) for latest in (19, 20)]
    [True, False]
    """
    end, before = work_ns, 0
    while end != before and end <= latest_ns:
        end, before = work_ns + sum(worst * jobs_within(end, rate) for worst, rate in urgent), end
    return end > latest_ns


def is_before(one: Member, other: Member) -> bool:
    """Whether a thread is more urgent than another: the order of the file breaks ties."""
    return (-one[1], one[0].number) < (-other[1], other[0].number)


def add_thread_rows(
    space: Space, model: cp_model.CpModel, places: Places, processor: int, deadlines: Sequence[Deadline]
) -> list[int]:
    """On each core and for each period of each thread: some point has room for it and all that is more urgent there.

    Returns the clauses that number equal cores: none.
    """
    rows = _Rows(model, places, processor)
    for item in deadlines:
        thread = places.threads[item.thread]
        for literal, rate in thread.modes if processor in thread.cores else ():
            for core in range(len(thread.cores[processor])) if rate is not None else ():
                rows.add(thread, literal, rate, core)
    return []


class _Rows:
    def __init__(self, model: cp_model.CpModel, places: Places, processor: int) -> None:
        self.model, self.places, self.processor = model, places, processor
        self.known: dict[tuple[int, int], int] = {}

    def literal(self, index: int) -> Any:
        found = self.model.get_int_var_from_proto_index(index if index >= 0 else -index - 1)
        return found if index >= 0 else found.negated()

    def both(self, one: int, other: int) -> int:
        """A literal that is true where both are."""
        if self.places.true in (one, other):
            return other if one == self.places.true else one
        if (one, other) not in self.known:
            made = self.model.new_bool_var("")
            self.model.add_bool_or([made, self.literal(-one - 1), self.literal(-other - 1)])
            self.model.add_implication(made, self.literal(one))
            self.model.add_implication(made, self.literal(other))
            self.known[one, other] = made.index
        return self.known[one, other]

    def add(self, thread: Thread, literal: int, own: Fraction, core: int) -> None:
        """The rows of a thread in one rate on one core."""
        urgent = [
            (self.both(index, other.cores[self.processor][core]), rate, other.number)
            for other in self.places.on(self.processor)
            if other is not thread and core < len(other.cores[self.processor])
            for index, rate in other.rates or other.modes
            if rate and is_before((other, rate), (thread, own))
        ]
        latest = int(NS_PER_S / own)
        points = scheduling_points(latest, sorted({rate for _, rate, _ in urgent}))
        if points is None:
            return
        here = self.both(literal, thread.cores[self.processor][core])
        chosen = [self.model.new_bool_var("") for _ in points]
        self.model.add_bool_or([self.literal(-here - 1), *chosen])
        for position, kind in enumerate(self.places.types[self.processor]):
            work = self.places.worst_on[self.processor, thread.number][position]
            for point, at_point in zip(points, chosen, strict=True):
                terms = [
                    self.places.worst_on[self.processor, number][position] * jobs_within(point, rate)
                    for _, rate, number in urgent
                ]
                row = cp_model.LinearExpr.weighted_sum([self.literal(index) for index, *_ in urgent], terms)
                self.model.add(row + work <= point).only_enforce_if(at_point, self.literal(kind))


def contended_front(evaluator: Evaluator, limit_s: float, peer: str) -> dict[str, Any]:
    """The front of a peer, as `textbook_front`, within so much processor time.

    `refused` says how many optima the analysis refused, `worked_s` how long the process worked.
    """
    made: list[Loop] = []
    began = time.process_time()

    def with_deadlines(ask: Ask, encoded: EncodedSpace) -> Ask:
        made.append(PEERS[peer](ask, evaluator, encoded))
        return made[0]

    found = textbook_front(evaluator, 10**6, within_processor_time(limit_s), "plain", with_deadlines)
    return {**found, "refused": made[0].refused, "worked_s": time.process_time() - began}
