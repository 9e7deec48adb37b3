"""Whether demands clash even if no thread waits for another, with a remark first: how threads wait may follow from it.

See `dse.analysis.diagnosis.without_contention` for what is asked like this.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property

from dse.analysis.diagnosis.overloads import KINDS
from dse.analysis.diagnosis.unbounded import delayed_by, may_be_delayed
from dse.analysis.diagnosis.without_contention import uncontended_limit
from dse.analysis.placement.heuristics import evenly
from dse.analysis.validity import canonical
from dse.analysis.views import View
from dse.search.feasibility.conflicts import Conflicts, Heard, find_conflicts
from dse.search.feasibility.oracle import Member, Oracle
from dse.space.model.criteria import Requirement
from dse.space.model.space import Design, Space
from dse.space.model.trees import at
from dse.space.question.open_cores import decided_cores, without_scheduling
from dse.support.errors import TooLargeError

ONE = Fraction(1)


class Uncontended:
    """The members of a question, their response times as long as the jobs take alone.

    It has the seed and the time of the one who answers with waiting.
    """

    def __init__(self, space: Space, beside: Oracle) -> None:
        self.space = space
        self.oracle = Oracle(
            without_scheduling(space), seed=beside.seed, reading=uncontended_limit, time_left=beside.time_left
        )
        self.differs = any(uncontended_limit(space, item, is_asked=False).is_elsewhere for item in space.requirements)
        """Whether response times count in some requirement."""
        self.overloaded_processors = frozenset[int]()

    @cached_property
    def is_refuted(self) -> bool:
        """Whether it is proved like this that no design meets all members.

        Raises
        ------
        OutOfTime
            when there is no answer by the deadline.
        """
        return self.differs and not self._may_hold(self.oracle.everything)

    def takes_waiting(self, members: Iterable[int]) -> bool:
        """Whether some members that have no design together would have one if no thread waited, as far as is known.

        Raises
        ------
        OutOfTime
            when there is no answer by the deadline.
        """
        return self.differs and self._may_hold(frozenset(members))

    def _may_hold(self, members: frozenset[int]) -> bool:
        try:
            return self.oracle.witness(members) is not None
        except TooLargeError:
            return True

    def conflicts(self, *, every: bool, limit: int, heard: Heard) -> Conflicts:
        """The conflicts of a question that is refuted, as `find_conflicts` finds them.

        `every` asks for all of them, at most `limit`. Each response time counts as what the job takes when no thread
        waits. Each set that has no design is `heard` of as soon as it is known.
        """
        return find_conflicts(self.oracle, every=every, limit=limit, heard=heard)

    def overloaded(self, conflict: Iterable[int]) -> frozenset[int]:
        """The processors of which more is needed than there is, whatever else of a conflict holds; by number.

        They are those of the limits on use in it, if it is none about less than all of them.
        """
        members = {number: self.oracle.members[number] for number in conflict}
        limits = [item for item in members.values() if isinstance(item, Requirement) and limits_use(item)]
        rest = frozenset(number for number, item in members.items() if not limits_use(item))
        if not limits:
            return frozenset()
        if any(item.limit.value < 1 for item in limits):
            whole = [replace(item, limit=replace(item.limit, value=max(item.limit.value, ONE))) for item in limits]
            if self.oracle.find(rest, further=[self.oracle.reading(self.oracle.space, item) for item in whole]):
                return frozenset()
        return frozenset(item.metric.index or 0 for item in limits)

    def follow_from_overloads(self, conflicts: Sequence[frozenset[int]]) -> frozenset[int]:
        """The members, in none of some conflicts, that may be broken because threads need more than there is.

        Raises
        ------
        OutOfTime
            when there is no answer by the deadline.
        """
        members, named = self.oracle.members, frozenset().union(*conflicts)
        self.overloaded_processors = frozenset().union(*map(self.overloaded, conflicts))
        late = delayed_by(self.space, self.overloaded_processors)
        return frozenset(
            number
            for number, item in enumerate(members)
            if number not in named and isinstance(item, Requirement) and may_be_delayed(self.space, item.metric, late)
        )

    def whole(self, design: Design) -> Design:
        """A design that `oracle` has found as one of the question, its threads evenly on the cores that are open.

        The result has an option for each decision of the space, decisions about cores included, and is canonical. Where
        threads cannot be spread, each open core takes its first option.
        """
        made = (*design, *[0] * (len(self.space.decisions) - len(design)))
        return canonical(self.space, evenly(self.space, made, decided_cores(self.space)) or made)

    def evened(self, design: Design) -> Design:
        """A design of the question with the threads of overloaded processors evenly on the cores that are open.

        Only threads on processors whose use a conflict limits are moved; every other choice stays. The example of a
        conflict then shows the lowest possible load of the fullest core.
        """
        view, components = View(design), self.space.components
        moved = [
            item
            for item in decided_cores(self.space)
            if at(components[item.component].processor, view) in self.overloaded_processors
        ]
        return canonical(self.space, evenly(self.space, design, moved) or design)


def limits_use(member: Member) -> bool:
    """Whether a member limits the use of a processor or core: deadlines that nothing keeps may follow from that.

    Only upper limits count. Such a conflict is reported first, because late threads may be nothing but its consequence.
    """
    return isinstance(member, Requirement) and member.metric.kind in KINDS and member.is_upper
