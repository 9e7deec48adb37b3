"""Whether some of a problem's demands can hold together: the answer is a design that the analysis accepts, or a proof.

A *member* is a demand that can be given up: a requirement, a rule, or a decision that the caller has fixed. The
structure of the architecture (bindings, options that are offered, acyclic dispatch) always holds.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import inf
from typing import TypeAlias

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import Limit, Reading, build_limit, judge
from dse.analysis.measures import Measure
from dse.analysis.validity import is_broken
from dse.analysis.views import View
from dse.encode.model import encode
from dse.search.feasibility.guarded_model import Switchboard, TimeLeft
from dse.search.referee import accepted
from dse.search.solver.strategy import Portfolios, Strategy
from dse.search.solver_answer import Found, Unfinished
from dse.search.workers import heard
from dse.space.model.criteria import Objective, Requirement, Rule
from dse.space.model.space import INACTIVE, Design, Space
from dse.support.errors import RefereeError
from dse.support.timelimit import OutOfTime, until


@dataclass(frozen=True)
class Fixed:
    """A decision that the caller has fixed at one option.

    A member of a conflict beside requirements and rules; numbers are those of the space.
    """

    decision: int
    option: int
    text: str
    origin: str = "command line"


Member: TypeAlias = Requirement | Rule | Fixed
SHARED_WORK = 0.1
"""Work (`dse.search.solver.settings`) at a question in the model that all questions share."""
DIRECTED = ("<=", "<", ">=", ">")


def _members_of(space: Space) -> tuple[Member, ...]:
    """Everything that the question demands: requirements, rules, fixed decisions, in this order."""
    fixed = [
        Fixed(decision, option, f"{space.decisions[decision].name} = {space.decisions[decision].options[option]}")
        for decision, option in space.fixed.items()
    ]
    return (*space.requirements, *space.rules, *fixed)


def _statements_of(members: Sequence[Member]) -> tuple[tuple[int, ...], ...]:
    """Members by number, together where one limit states them: a limit of every flow, processor, core or bus."""
    by_statement: dict[object, list[int]] = {}
    for number, item in enumerate(members):
        is_one = isinstance(item, Requirement) and item.stated and item.operator in DIRECTED
        key = (item.origin, item.stated) if isinstance(item, Requirement) and is_one else number
        by_statement.setdefault(key, []).append(number)
    return tuple(map(tuple, by_statement.values()))


def demanding(space: Space, members: Iterable[Member]) -> Space:
    """The space with exactly these demands and no objectives.

    A copy of `space`. Implied requirements are dropped, too, unless they are among the members.
    """
    kept = tuple(members)
    return replace(
        space,
        requirements=tuple(item for item in kept if isinstance(item, Requirement)),
        rules=tuple(item for item in kept if isinstance(item, Rule)),
        fixed={item.decision: item.option for item in kept if isinstance(item, Fixed)},
        objectives=(),
    )


def find_design(
    space: Space,
    measure: Measure | None = None,
    *,
    seed: int = 0,
    time_left: TimeLeft | None = None,
    reading: Reading = build_limit,
    portfolios: Portfolios | None = None,
) -> Design | None:
    """A design of the space, or None where there is none; with `measure` one in which it is small.

    The least is found exactly unless the measure is `rounded`. Requirements are made limits by `reading`. The
    `portfolios` tell which settings answered earlier questions.

    Raises
    ------
    OutOfTime
        when there is no answer in the time that is left.
    RefereeError
        when the analysis refuses the solver's design.
    """
    time_left = time_left or TimeLeft(None)
    measures = () if measure is None else (measure,)
    objectives = tuple(Objective(item.metric.name, "minimise", item.metric) for item in measures)
    evaluator = Evaluator(replace(space, objectives=objectives), measures, reading=reading)
    encoded = encode(evaluator)
    strategy = Strategy(encoded, seed=seed, deadline=time_left.at, portfolios=portfolios)
    with time_left.worked(strategy):
        while True:
            answer = heard(strategy, lambda: strategy.minimise([1] * len(measures), [encoded.everywhere]))
            if isinstance(answer, Unfinished):
                raise OutOfTime
            if not isinstance(answer, Found):
                return None
            evaluation = accepted(evaluator, answer.design)
            if evaluation is not None:
                return evaluation.design
            strategy.exclude(answer.design)  # within what rounding admits, but not exactly


class Oracle:
    """Decides which sets of members have a design; remembers witnesses and refuted sets to ask few questions.

    Sets are those of positions in `members`; `statements` has those together that a user stated as one. The space is
    encoded once, with a switch for each member; once a question has taken `SHARED_WORK` in vain, each is encoded for
    its own members, without what the others would add. Requirements are made limits by `reading`. `calls` counts the
    questions that were solved. Ctrl-C is as if the deadline had come, for all who share the `time_left`.
    """

    def __init__(
        self,
        space: Space,
        *,
        seed: int = 0,
        deadline: float | None = None,
        reading: Reading = build_limit,
        time_left: TimeLeft | None = None,
    ) -> None:
        self.space = space
        self.reading = reading
        self.members = _members_of(space)
        self.everything = frozenset(range(len(self.members)))
        self.statements = _statements_of(self.members)
        self.seed = seed
        self.time_left = time_left if time_left is not None else TimeLeft(deadline)
        self.calls = 0
        self._structure = Evaluator(demanding(space, ()))
        self._limits = Evaluator(replace(space, objectives=()), reading=reading).limits
        self._switchboard: Switchboard | None = None
        self._is_hard = False
        self._portfolios: Portfolios = {}
        self._witnesses: dict[Design, frozenset[int]] = {}
        self._refuted: list[frozenset[int]] = []
        self._met: dict[Design, frozenset[int]] = {}

    @property
    def deadline(self) -> float | None:
        """The time at which questions end, by the monotonic clock; None without a limit.

        Seconds of `time.monotonic()`.
        """
        return self.time_left.at

    @deadline.setter
    def deadline(self, at: float | None) -> None:
        self.time_left.at = at

    def space_of(self, kept: Iterable[int]) -> Space:
        """The space that demands only these members.

        `kept` are positions of members.
        """
        return demanding(self.space, (self.members[number] for number in sorted(kept)))

    def witness(self, kept: frozenset[int]) -> Design | None:
        """A design that meets these members, or None where it is proved that there is none.

        Answered from known designs and known refutations where possible, else by a solver call. Raises `OutOfTime` at
        the deadline.
        """
        for design, met in self._witnesses.items():
            if kept <= met:
                return design
        if any(refuted <= kept for refuted in self._refuted):
            return None
        return self.solve(kept)

    def shown(self, design: Design) -> frozenset[int]:
        """Note a design that was found elsewhere; returns the members that it meets, none for an invalid design.

        Positions of members. Later questions that the design answers take no solver call.
        """
        if self._structure.invalid(design):
            return frozenset()
        self._witnesses[design] = self.met_by(design)
        return self._witnesses[design]

    def refute(self, kept: frozenset[int]) -> None:
        """Know that these members have no design together, for that was proved elsewhere.

        Later questions about a superset are answered without a solver call.
        """
        self._refuted.append(kept)

    def solve(self, kept: frozenset[int], *, seed: int | None = None) -> Design | None:
        """A design that meets the members, or a proof that there is none, always by solving.

        With a `seed` the question is a problem of its own, encoded for it alone.
        """
        if seed is None:
            design = self.find(kept)
        else:
            with self._spent():
                design = self._apart(kept, seed)
        if design is None:
            self._refuted.append(kept)
        else:
            met = self.met_by(design)
            if not kept <= met:
                raise RefereeError(f"the solver's design {design} does not meet {sorted(kept - met)}")
            self._witnesses[design] = met
        return design

    def find(
        self, kept: frozenset[int], measure: Measure | None = None, further: Sequence[Limit] = ()
    ) -> Design | None:
        """A design that meets these members and further limits, or None; with `measure` one in which that is least.

        One model serves all questions, with a switch for each member, until one of them is hard in it.
        """
        is_plain = measure is None and not further
        with self._spent():
            if is_plain and self._is_hard:
                return self._apart(kept, self.seed)
            if self._switchboard is None:
                self._switchboard = Switchboard(self.space, self.reading)
            most = SHARED_WORK if is_plain else inf
            try:
                return self._switchboard.find(
                    kept, measure, further, seed=self.seed, time_left=self.time_left, most_work=most
                )
            except OutOfTime:
                if not is_plain or self.time_left.is_over:
                    raise
                self._is_hard = True
                return self._apart(kept, self.seed)

    def _apart(self, kept: frozenset[int], seed: int) -> Design | None:
        """A design that meets these members, or None, by a model of them alone."""
        return find_design(
            self.space_of(kept),
            seed=seed,
            time_left=self.time_left,
            reading=self.reading,
            portfolios=self._portfolios,
        )

    @contextmanager
    def _spent(self) -> Iterator[None]:
        """Count a question, if there is time for it."""
        if self.time_left.is_over:
            raise OutOfTime
        self.calls += 1
        try:
            with until(self.deadline):
                yield
        except KeyboardInterrupt:
            self.deadline = time.monotonic()
            raise OutOfTime from None

    def met_by(self, design: Design) -> frozenset[int]:
        """The members that a design meets, by the analysis alone.

        Positions of members; kept for each design.
        """
        if design not in self._met:
            self._met[design] = self._judged(design)
        return self._met[design]

    def _judged(self, design: Design) -> frozenset[int]:
        assert not self._structure.invalid(design), design
        view = View(design)
        verdicts = [judge(limit, view).holds for limit in self._limits]
        for member in self.members[len(verdicts) :]:
            if isinstance(member, Fixed):
                verdicts.append(design[member.decision] in (member.option, INACTIVE))
            else:
                assert isinstance(member, Rule)
                verdicts.append(not is_broken(member, view))
        return frozenset(number for number, holds in enumerate(verdicts) if holds)
