"""Response times of some threads of a design, remembered for designs that agree in all that decides them.

A search asks for those of the same few threads again and again, to find what makes a figure of a refused solution so
large. Unlike `dse.analysis.memo.Recall` this asks a whole design, whose tasks are shared: it is only noted what is
looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeAlias

from dse.analysis.memo import looked_at
from dse.analysis.scheduling.model import EndKey
from dse.analysis.views import View
from dse.space.model.space import Space
from dse.support.units import Exact

KEPT = 20_000
"""The greatest number of answers that are remembered."""
KEPT_SPACES = 4
Known: TypeAlias = dict[EndKey, Exact | None]
Options: TypeAlias = tuple[int, ...]
Answers: TypeAlias = dict[tuple[Options, ...], dict[Options, dict[Options, Known]]]
Groups: TypeAlias = Sequence[Sequence[int]]


class Subsets:
    """Answers by the threads that are asked about, and by the options of the decisions that were looked at.

    Keyed by what was looked at only, so that designs that differ elsewhere share an answer.
    """

    def __init__(self) -> None:
        self._kept: dict[int, tuple[Space, Sequence[int], Answers]] = {}
        self._count = 0

    def recall(
        self, space: Space, groups: Groups, view: View, formula: Callable[[Space, Groups, View], Known]
    ) -> Known:
        """``formula(space, groups, view)``, from memory where it was asked of a design that is the same to it.

        Groups that no event leads from one to another are asked about by themselves.
        """
        _, chains, answers = self._of(space)
        found: Known = {}
        for part in _apart(chains, groups):
            known = answers.setdefault(tuple(map(tuple, part)), {})
            answer = _answered(known, view.design)
            if answer is None:
                made, seen = looked_at(view.design, partial(formula, space, part))
                known.setdefault(tuple(seen), {})[tuple(seen.values())] = answer = made
                self._count += 1
            found |= answer
        return found

    def _of(self, space: Space) -> tuple[Space, Sequence[int], Answers]:
        """The chains of a space, and what is remembered of it; all is forgotten where that is much."""
        if self._count >= KEPT or (id(space) not in self._kept and len(self._kept) >= KEPT_SPACES):
            self._kept, self._count = {}, 0
        kept = self._kept.get(id(space))
        if kept is None:
            kept = self._kept[id(space)] = space, _chains(space), {}
        return kept


def _answered(known: Mapping[Options, Mapping[Options, Known]], design: Sequence[int]) -> Known | None:
    for decisions, found in known.items():
        answer = found.get(tuple([design[decision] for decision in decisions]))
        if answer is not None:
            return answer
    return None


def _apart(chains: Sequence[int], groups: Groups) -> list[Groups]:
    """The groups, those together between which events lead, or in which pieces of one thread are."""
    if len(groups) < 2:
        return [groups]
    parts: list[tuple[set[int], list[Sequence[int]]]] = []
    for group in groups:
        mine, here = {chains[number] for number in group}, [group]
        for part in [part for part in parts if part[0] & mine]:
            parts.remove(part)
            mine, here = mine | part[0], [*part[1], *here]
        parts.append((mine, here))
    return [here for _, here in parts]


def _chains(space: Space) -> list[int]:
    """For each component the first of all to which events lead from it, or from which they come, and so on."""
    first = list(range(len(space.components)))

    def root(number: int) -> int:
        while first[number] != number:
            number = first[number]
        return number

    for number, component in enumerate(space.components):
        senders = [space.connections[wire].sender for wire in component.triggers]
        pieces = component.pieces.members if component.pieces is not None else ()
        for other in (*senders, *pieces):
            if other is not None:
                first[max(root(number), root(other))] = min(root(number), root(other))
    return [root(number) for number in range(len(first))]
