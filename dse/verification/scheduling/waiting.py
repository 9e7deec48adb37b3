"""Waiting times in the second proof: a variable for each thread, at least what the jobs counted so far make it.

The second model's own form of response times: a product that is never written out. The work that another thread does
within a thread's response time is a variable; k times its execution time where the thread waits for it and its k-th
job is released in time, a comparison of the response time with k - 1 times its separation, which is a variable, too.
That is so of the first job of a busy period, whose waiting is a variable beside that of the thread: a later one may
respond later, with fewer jobs of others in that time. What that leaves open (jitter, several streams, later jobs) is
learnt from designs, for each option in a box and wherever the same threads share their cores
(`dse.verification.scheduling.contention`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from ortools.sat.python import cp_model

from dse.analysis.scheduling.chained import chain_wait_ns
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses, counted_ns, waited_ns
from dse.analysis.views import View
from dse.space.architecture.chains import before_in_chain, may_come_seldom
from dse.space.model.space import Design, Space
from dse.verification.diagrams import leaves
from dse.verification.sums import Waits

MOST_JOBS = 24
"""The greatest number of jobs of one thread that are counted within the response time of another."""


class WaitVariables:
    """The waiting times in a model, in units of 1 / `scale` ns; of messages see `messages/waiting.py`."""

    def __init__(self, space: Space, model: cp_model.CpModel, waits: Waits, value: Callable[[Any], Any]) -> None:
        self.space, self.model, self.scale = space, model, waits.scale
        self.waits = waits

        def variable(diagram: Any) -> Any:
            found = value(diagram)
            return model.new_constant(found) if isinstance(found, int) else found

        self.work = {number: variable(item) for number, item in waits.works.items()}
        self.rank = {number: variable(item) for number, item in waits.ranks.items()}
        self.separation = {number: variable(item) for number, item in waits.separations.items()}
        self.priority = {number: variable(item) for number, item in waits.priorities.items()}
        self.place = {number: variable(item) for number, item in waits.places.items()}
        self.most = most = UNBOUNDED_NS * self.scale
        self.variables = {number: model.new_int_var(0, most, "") for number in (*waits.threads, *waits.messages)}
        for number, chain in waits.chains.items():
            self.variables[number] = model.new_int_var(0, len(chain.threads) * most, "")
        self.first = {number: model.new_int_var(0, most, "") for number in waits.threads if number in self.work}
        self._done: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._pairs: dict[tuple[int, int], Any] = {}
        self._waiting: dict[tuple[int, int], Any] = {}
        self._at: dict[int, dict[int, Any]] = {}
        self._rests: dict[int, list[Any]] = {}
        self._counted: set[tuple[int, int, int]] = set()
        self._homes = {number: frozenset(map(int, leaves(waits.places[number]))) for number in self.work}
        self._before = {number: frozenset(before_in_chain(space, number)) for number in self.work}
        for number in (item for item in waits.threads if item in self.work):
            others = [
                other
                for other in self.work
                if other != number
                and self._may_wait(number, other)
                and not self._may_succeed(number, other)
                and not may_come_seldom(space, other, (number,))
            ]
            shares = [self._share(number, other) for other in others]
            model.add(self.first[number] >= self.scale * sum(shares))
            model.add(self.variables[number] >= self.first[number])
        for number, chain in waits.chains.items():
            self._add_chain(self.variables[number], chain.threads)
        for number, latest in waits.latest.items():
            model.add(self.scale * self.work[number] + self.variables[number] <= value(latest))

    @property
    def has_threads(self) -> bool:
        """Whether threads wait, not messages alone."""
        return bool(self.waits.threads or self.waits.chains)

    @property
    def of_messages(self) -> dict[int, Any]:
        """The variables of messages, by their keys."""
        return {number: self.variables[number] for number in self.waits.messages}

    def _add_chain(self, variable: Any, chain: Sequence[int]) -> None:
        """Threads that may be one chain wait, all together, for one job of each other that one of them waits for.

        One thread alone lags no less than the first job of a busy period waits.
        """
        if len(chain) == 1 and chain[0] in self.first:
            self.model.add(variable >= self.first[chain[0]])
            return
        members = [number for number in chain if number in self.work]
        shares = []
        for other in self.work:
            waiting = [number for number in members if self._may_wait(number, other)]
            if not waiting or other in chain or any(self._may_succeed(number, other) for number in members):
                continue
            if may_come_seldom(self.space, other, members):
                continue
            share = self.model.new_int_var(0, UNBOUNDED_NS, "")
            for number in waiting:
                self.model.add(share >= self.work[other]).only_enforce_if(self._waits_for(number, other))
            shares.append(share)
        self.model.add(variable >= self.scale * sum(shares))

    def _may_succeed(self, one: int, other: int) -> bool:
        """Whether one of two threads may come before the other in a chain: then it need not wait for a job of that."""
        return one in self._before[other] or other in self._before[one]

    def _may_wait(self, number: int, other: int) -> bool:
        """Whether a thread may wait for another: not one with a number for one without, nor where no core is both's."""
        is_urgent = number in self.priority and other not in self.priority
        return not is_urgent and not self._homes[number].isdisjoint(self._homes[other])

    def _share(self, number: int, other: int) -> Any:
        """The work of another thread that a thread waits for: at least its first job, where it does wait."""
        model = self.model
        waits = self._waits_for(number, other)
        share = model.new_int_var(0, UNBOUNDED_NS, "")
        model.add(share >= self.work[other]).only_enforce_if(waits)
        self._done[number, other] = waits, share
        return share

    def _waits_for(self, number: int, other: int) -> Any:
        """A literal that is true where a thread waits for another one."""
        if (number, other) in self._waiting:
            return self._waiting[number, other]
        model = self.model
        self._waiting[number, other] = waits = model.new_bool_var("")
        ways = [waits, self._together(number, other).negated(), *self._resting(number)]
        after = model.new_bool_var("")
        if number in self.rank and other in self.rank:
            model.add(self.rank[other] <= self.rank[number] - int(other < number)).only_enforce_if(after)
            ways.append(after)
        elif number in self.priority and other in self.priority:
            model.add(self.priority[other] <= self.priority[number] - 1).only_enforce_if(after)
            ways.append(after)
        model.add_bool_or(ways)
        return waits

    def _resting(self, number: int) -> list[Any]:
        """A literal that may be true where a thread takes no time, and does not wait; none where it always does."""
        if number not in self._rests:
            rests = [self.model.new_bool_var("")] if 0 in leaves(self.waits.works[number]) else []
            for literal in rests:
                self.model.add(self.work[number] <= 0).only_enforce_if(literal)
            self._rests[number] = rests
        return self._rests[number]

    def _together(self, number: int, other: int) -> Any:
        """Whether two threads share a core: true where they do."""
        pair = min(number, other), max(number, other)
        if pair not in self._pairs:
            self._pairs[pair] = together = self.model.new_bool_var("")
            one, another = (self._places(item) for item in pair)
            for place in one.keys() & another.keys():
                self.model.add_bool_or([together, one[place].negated(), another[place].negated()])
        return self._pairs[pair]

    def _places(self, number: int) -> dict[int, Any]:
        """For each place of a thread a literal that it is there."""
        if number not in self._at:
            place, model = self.place[number], self.model
            found = {value: model.new_bool_var("") for value in sorted(self._homes[number])}
            for value, literal in found.items():
                model.add(place == value).only_enforce_if(literal)
                model.add(place != value).only_enforce_if(literal.negated())
            self._at[number] = found
        return self._at[number]

    def count(self, design: Design) -> bool:
        """Count the jobs within response times of a design, whoever shares a core; whether any was not counted yet."""
        view = View(design)
        known = all_responses(self.space, view)
        fresh = False
        for (number, other), (waits, share) in self._done.items():
            response = known.get((number, "thread"), 0)
            separation = self.waits.separation_ns(other, view)
            for job in range(2, MOST_JOBS + 1):
                if response is not None and (separation is None or (job - 1) * separation >= response):
                    break
                if (number, other, job) not in self._counted:
                    self._counted.add((number, other, job))
                    self._add_job(number, other, job, waits, share)
                    fresh = True
        return fresh

    def _add_job(self, number: int, other: int, job: int, waits: Any, share: Any) -> None:
        """A share of `job` jobs, or a response time that is over before the last of them is released."""
        model = self.model
        over, full = model.new_bool_var(""), model.new_bool_var("")
        end = self.scale * self.work[number] + self.first[number]
        model.add(end <= (job - 1) * self.separation[other]).only_enforce_if(over)
        model.add(share >= job * self.work[other]).only_enforce_if(full)
        model.add_bool_or([waits.negated(), over, full])

    def too_low(self, design: Design, values: Mapping[int, int]) -> dict[int, Fraction]:
        """The threads that wait longer in a design than a solution says, with how long (ns)."""
        view = View(design)
        known = all_responses(self.space, view)
        found: dict[int, Fraction] = {}
        for number, value in values.items():
            if number < 0:
                chain = self.waits.chains.get(number)
                waited = self.waits.messages[number](view) if chain is None else chain_wait_ns(self.space, chain, view)
                found |= {number: Fraction(waited)} if waited * self.scale > value else {}
                continue
            waited = Fraction(waited_ns(self.space, number, view, counted_ns(known.get((number, "thread"), 0))))
            if waited * self.scale > value:
                found[number] = waited
        return found
