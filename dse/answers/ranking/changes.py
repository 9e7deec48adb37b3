"""Differences between two designs of a space: decisions, and the gain or loss in each objective."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from dse.analysis.measures import changed_decisions
from dse.analysis.views import View
from dse.answers.designs import numbered_texts
from dse.answers.ranking.core_numbering import numbered_like
from dse.answers.result import ObjectiveInfo, decisions_of
from dse.space.model.metric_kinds import asks_for_changes
from dse.space.model.space import Design, Space


@dataclass(frozen=True)
class Change:
    """A decision that differs; None where a design has no use for it.

    `follows` marks what is no choice of its own: a decision that falls away with another one, or an optional slot of
    one type, which is filled exactly when something is bound to it. Where changes are counted, it marks what does not
    count, and `cost` is what the change counts.
    """

    name: str
    before: str | None
    after: str | None
    follows: bool
    cost: int | None = None


@dataclass(frozen=True)
class Delta:
    """An objective in two designs, in its counting unit.

    `before` and `after` are integers in `unit`, such as ns or hundredths of the currency.
    """

    name: str
    sense: str
    unit: str
    before: int
    after: int

    @property
    def gain(self) -> int:
        """By how much `after` is better; negative when it is worse."""
        return self.before - self.after if self.sense == "minimise" else self.after - self.before


def changes_between(space: Space, before: Design, after: Design, *, like_before: bool = False) -> tuple[Change, ...]:
    """The open decisions in which two canonical designs differ, in the order of the problem.

    Equal cores of `before` are numbered as in `after`, or the other way round with `like_before`: a change of numbers
    alone is none. The design that a text is about keeps its numbers, for they are shown beside it.
    """
    if like_before:
        return tuple(_changes(space, before, numbered_like(space, after, before)))
    return tuple(_changes(space, numbered_like(space, before, after), after))


def counted_changes(space: Space, design: Design) -> tuple[Change, ...] | None:
    """The changes against the stated baseline that ``changes`` counts; None where nothing asks how many there are.

    One `Change` for each decision that differs from the baseline, with its cost; options by name.
    """
    if not asks_for_changes(space):
        return None
    costs = changed_decisions(space, View(design))
    chosen = numbered_texts(space, decisions_of(space, design), design)
    return tuple(
        Change(
            decision.name,
            decision.options[space.baseline[index]],
            chosen.get(decision.name, decision.options[design[index]]),
            False,
            costs[decision.name],
        )
        for index, decision in enumerate(space.decisions)
        if decision.name in costs
    )


def _changes(space: Space, before: Design, after: Design) -> Iterator[Change]:
    old_texts, new_texts = (numbered_texts(space, decisions_of(space, design), design) for design in (before, after))
    for decision, old, new in zip(space.decisions, before, after, strict=True):
        if old == new or not decision.is_open:
            continue
        yield Change(
            decision.name,
            old_texts.get(decision.name),
            new_texts.get(decision.name),
            follows=new < 0 or decision.follows,
        )


def deltas(infos: Sequence[ObjectiveInfo], before: Mapping[str, int], after: Mapping[str, int]) -> tuple[Delta, ...]:
    """Each objective before and after.

    One `Delta` for each objective, in the order of the question; `before` and `after` are objectives by name.
    """
    return tuple(Delta(info.name, info.sense, info.unit, before[info.name], after[info.name]) for info in infos)
