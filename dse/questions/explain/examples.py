"""The designs that an explanation names, with all that they break and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from dse.analysis.diagnosis.flow_delays import Delayed, delayed_flows, unbounded_threads
from dse.analysis.diagnosis.lateness import Late, Teller
from dse.analysis.diagnosis.overloads import KINDS, Overload, overloads
from dse.analysis.diagnosis.shortening import Shorter, mending_cuts
from dse.analysis.diagnosis.unbounded import may_be_unbounded
from dse.analysis.evaluate import Evaluator
from dse.analysis.latency.offset_advice import boundaries
from dse.analysis.limits import Verdict, judge
from dse.analysis.messages.late import late_messages
from dse.analysis.views import View
from dse.answers.designs import numbered_texts
from dse.answers.explanation import Demand, Example
from dse.answers.result import decisions_of
from dse.search.feasibility.oracle import Fixed, Member, Oracle
from dse.space.model.criteria import Requirement, Rule
from dse.space.model.metric_kinds import flows_in
from dse.space.model.space import Design, Space


@dataclass
class NamedDesigns:
    """Tells of designs; where it `is_brief` nothing but that there is one, for nobody looks at it.

    Nothing is told of the members that are `unseen`, by number, for they may follow from others.
    """

    space: Space
    oracle: Oracle = field(repr=False)
    is_brief: bool = False
    unseen: frozenset[int] = frozenset()
    told: dict[Design, Example] = field(default_factory=dict, repr=False)

    @cached_property
    def evaluator(self) -> Evaluator:
        """The analysis of the question."""
        return Evaluator(self.space)

    @property
    def seen(self) -> frozenset[int]:
        """The members that are looked at.

        A set of member numbers of the oracle: every member less those that are `unseen`.
        """
        return self.oracle.everything - self.unseen

    def demand(self, number: int) -> Demand:
        """A member in the user's words.

        A `Demand` with its kind (fixed decision, rule or requirement), its text and the place where it is stated.
        `number` counts the members of the oracle.
        """
        member = self.oracle.members[number]
        if isinstance(member, Fixed):
            return Demand("fixed decision", member.text, member.origin)
        return Demand("rule" if isinstance(member, Rule) else "requirement", member.text, member.origin)

    def stated(self, statement: tuple[int, ...]) -> Demand:
        """Members that are stated as one, in the user's words.

        The members come from one line of the file, such as a limit on every flow; the demand has the line's text as
        written and the origin of the first member.
        """
        demand, member = self.demand(statement[0]), self.oracle.members[statement[0]]
        if len(statement) > 1 and isinstance(member, Requirement):
            return replace(demand, text=member.stated)
        return demand

    def decisions(self, design: Design) -> Mapping[str, str]:
        """The active open decisions of a design.

        Names of decisions to names of options; decisions that have no effect in this design are left out.
        """
        return decisions_of(self.space, design)

    def example(self, design: Design) -> Example:
        """A design as it is named, with what it breaks; many demands have the same.

        An `Example` with decisions, violated demands, late threads and delayed flows; an empty one when the explanation
        is brief. Kept, because several relaxations often lead to one design.
        """
        if design not in self.told:
            self.told[design] = Example({}) if self.is_brief else self._example(design)
        return self.told[design]

    def _example(self, design: Design) -> Example:
        broken = sorted(self.oracle.everything - self.oracle.met_by(design))
        breaks = tuple(self.demand(number) for number in broken)
        view = View(design)
        verdicts = [judge(limit, view) for limit in self.evaluator.limits]
        seen = [item for number, item in enumerate(verdicts) if number not in self.unseen]
        teller = Teller(self.space, view)
        late, delayed = tuple(_late(teller, seen)), tuple(delayed_flows(teller, seen))
        full = tuple(overloads(self.space, seen, view, late))
        limited = [self.oracle.members[number] for number in broken if number not in self.unseen]
        flows = {
            name for item in limited if isinstance(item, Requirement) for name in flows_in(self.space, item.metric)
        }
        read = tuple(item for item in boundaries(self.space, view) if item.flow in flows) if flows else ()
        is_whole = all(isinstance(self.oracle.members[number], Requirement) for number in broken)
        shorter = tuple(self._mending(teller, verdicts, (*full, *late, *delayed))) if is_whole else ()
        messages = tuple(late_messages(self.space, seen, view))
        conditions = self._conditions(design, [self.oracle.members[number] for number in broken])
        chosen = self.decisions(design)
        told = numbered_texts(self.space, chosen, design)
        return Example(chosen, breaks, full, late, delayed, read, shorter, messages, conditions, told)

    def _conditions(self, design: Design, broken: Sequence[Member]) -> tuple[str, ...]:
        """The conditions of valid designs that a design breaks with the fixed decisions among those it violates."""
        fixed = {item.decision: item.option for item in broken if isinstance(item, Fixed)}
        if not fixed:
            return ()
        structure = Evaluator(replace(self.space, fixed={}, objectives=(), requirements=(), rules=()))
        return tuple(structure.invalid(tuple(fixed.get(at, option) for at, option in enumerate(design))))

    def _mending(
        self, teller: Teller, verdicts: Sequence[Verdict], wrong: Sequence[Overload | Late | Delayed]
    ) -> Iterator[Shorter]:
        """Single cuts with which the design keeps all, where only upper limits are broken of which it is told why."""
        is_told = all(self._is_told(item.requirement) for item in verdicts if not item.holds)
        if not wrong or not is_told:
            return
        if not set[str].intersection(*({cut.name for cut in item.shorter} for item in wrong)):
            return
        if self.unseen:
            rest = [verdicts[number] for number in self.unseen]
            wrong = [*wrong, *_late(teller, rest), *delayed_flows(teller, rest)]
        yield from mending_cuts(self.space, teller.view, [item.shorter for item in wrong])

    def _is_told(self, item: Requirement) -> bool:
        """Whether the explanation says why an upper limit is violated."""
        return item.is_upper and (item.metric.kind in KINDS or may_be_unbounded(self.space, item.metric))


def _late(teller: Teller, verdicts: Sequence[Verdict]) -> Iterator[Late]:
    """The threads that break limits on their response times, and those without a bound in flows that break limits."""
    late = tuple(teller.late_threads(verdicts))
    yield from late
    named = {item.thread for item in late}
    yield from (item for item in unbounded_threads(teller, verdicts) if item.thread not in named)
