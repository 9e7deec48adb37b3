"""What a design changes against the baseline that the problem file states (docs/semantics.md, section 6.1)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from dse.analysis.terms import Term
from dse.analysis.views import View, is_met
from dse.space.types import Decision, Space


def counted_decisions(space: Space) -> Iterator[tuple[int, Decision, int]]:
    """The open decisions that the baseline states, each with its index and the option that the baseline has.

    What the baseline leaves out is not counted, nor on which core of its processor a thread runs,
    and in which order where the best one is asked for.
    """
    for index, decision in enumerate(space.decisions[: space.first_open]):
        if index in space.baseline and decision.is_open:
            yield index, decision, space.baseline[index]


def change_terms(space: Space) -> tuple[Term, ...]:
    """A summand for each decision: what it costs where a design uses it and has another option than the baseline."""
    return tuple(
        _term(index, decision, option, space.cost_of_change.get(index, 1))
        for index, decision, option in counted_decisions(space)
    )


def _term(index: int, decision: Decision, option: int, cost: int) -> Term:
    def value(view: View) -> Fraction:
        return Fraction(cost if _differs(decision, index, option, view) else 0)

    return Term(decision.name, value, component=decision.component)


def _differs(decision: Decision, index: int, option: int, view: View) -> bool:
    return is_met(decision, index, view) and view[index] != option


def changed_decisions(space: Space, view: View) -> dict[str, int]:
    """The names of the decisions that a design changes, each with its cost, in the order of the file.

    A change costs 1 where the file states no `cost_of_change` for it.
    """
    return {
        decision.name: space.cost_of_change.get(index, 1)
        for index, decision, option in counted_decisions(space)
        if _differs(decision, index, option, view)
    }


def cost_of_changes(space: Space, view: View) -> int:
    """The figure of ``changes`` for a design."""
    return sum(changed_decisions(space, view).values())
