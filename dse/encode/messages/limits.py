"""Limits on response times of messages: what the search's model knows of them, and what it learns.

The model has rows of what messages need of a bus, whatever their order (`rows`). A solution that they admit is judged
by the analysis. Where a message is late in it the model gets a clause: messages of which none can be last in time,
whatever the order (`dse.analysis.messages.conflicts`), with as few conditions as keep it so; else the conditions under
which the message takes so long, or the options that were looked at. No design is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ortools.sat.python import cp_model

from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit, judge
from dse.analysis.memo import consulted
from dse.analysis.messages.conflicts import conflicts, is_own_deadline
from dse.analysis.messages.stages import counted_buses
from dse.analysis.views import View
from dse.encode.linear import Board
from dse.encode.literals import Chosen, literal_of
from dse.encode.messages.reasons import Conditions, conditions_of, conflict_conditions
from dse.encode.messages.rows import add_rows
from dse.space.model.space import Design, Space


@dataclass(frozen=True)
class MessageLimit:
    """An upper limit on the response time of a message; it holds while the literal `guard` (an index) is true."""

    limit: Limit
    guard: int | None
    is_deadline: bool
    """Whether the limit is the connection's own deadline."""

    @property
    def message(self) -> int:
        """The number of the limited message's connection."""
        return self.limit.requirement.metric.index or 0


def is_message_limit(limit: Limit) -> bool:
    """Whether a limit is an upper one on the response time of a message that waits for a bus."""
    return limit.requirement.metric.kind == "message response" and limit.requirement.is_upper and not limit.is_elsewhere


def message_limit(board: Board, limit: Limit) -> MessageLimit:
    """A limit as one on a message, under the guard that the board has."""
    number = limit.requirement.metric.index or 0
    guard = board.guard.index if board.guard is not None else None
    return MessageLimit(limit, guard, is_own_deadline(board.space, number, limit.bound))


class MessageLimits:
    """The limits on messages of one model, and what has been added to it for their sake."""

    def __init__(
        self, space: Space, model: cp_model.CpModel, chosen: Callable[[int, int], int], limits: Sequence[MessageLimit]
    ) -> None:
        self.space, self.model, self.chosen, self.limits = space, model, chosen, limits

    def copy(self, model: cp_model.CpModel) -> MessageLimits:
        """The limits of a copy of the model."""
        return MessageLimits(self.space, model, self.chosen, self.limits)

    def settled(
        self,
        design: Design,
        is_true: Callable[[cp_model.IntVar], bool],
        why_late: Callable[[Limit, View], Sequence[int]] | None = None,
    ) -> bool:
        """Whether all messages meet their limits in a design; where one does not, the model has learnt from it.

        Where threads that wait make it late `why_late` names literals that are true together only where it is.
        """
        view = View(design)
        held = [item for item in self.limits if item.guard is None or is_true(literal_of(self.model, item.guard))]
        by_deadline = {item.message: item for item in held if item.is_deadline}
        is_late = False
        for bus in counted_buses(self.space):
            for conflict in conflicts(self.space, bus, view):
                limited = conflict.limited(self.space, view)
                if all(number in by_deadline for number in limited):
                    conditions = conflict_conditions(self.space, self.chosen, conflict, view)
                    self._forbid([by_deadline[number] for number in limited], conditions)
                    is_late = True
        for item in held if not is_late else ():
            if not judge(item.limit, view).holds:
                self._forbid([item], self._why(item, view, why_late))
                is_late = True
        return not is_late

    def _why(
        self, item: MessageLimit, view: View, why_late: Callable[[Limit, View], Sequence[int]] | None
    ) -> Conditions:
        if why_late is not None and counts_responses(self.space):
            return [(literal,) for literal in why_late(item.limit, view)]
        (term,) = item.limit.measure.terms
        scale = item.limit.measure.scale
        conditions = conditions_of(
            self.space,
            self.chosen,
            item.message,
            lambda seen: int(term.value(seen) * scale),
            view,
            int(term.value(view) * scale),
        )

        def asks(seen: View) -> None:
            item.limit.bound(seen)
            if conditions is None:
                term.value(seen)

        _, asked = consulted(View(view.design), asks)
        return [*(conditions or []), *((self.chosen(decision, option),) for decision, option in asked.items())]

    def _forbid(self, held: Sequence[MessageLimit], conditions: Conditions) -> None:
        """Forbid that all conditions hold together while all limits in `held` apply."""
        clause = [literal_of(self.model, item.guard).negated() for item in held if item.guard is not None]
        for literals in conditions:
            if len(literals) == 1:
                clause.append(literal_of(self.model, literals[0]).negated())
                continue
            none = self.model.new_bool_var("")
            for index in literals:
                self.model.add_implication(none, literal_of(self.model, index).negated())
            clause.append(none)
        self.model.add_bool_or(clause)


def message_limits_of(board: Board) -> MessageLimits | None:
    """The `MessageLimits` of a board's model, made on first use and shared by all questions; None without limits."""
    if not board.message_limits:
        return None
    if board.messages is None:
        chosen = Chosen.of_model(board.options, board.inactive).literal
        board.messages = MessageLimits(board.space, board.model, chosen, board.message_limits)
        add_rows(board, [(item.message, item.guard) for item in board.message_limits if item.is_deadline])
    found: MessageLimits = board.messages
    return found
