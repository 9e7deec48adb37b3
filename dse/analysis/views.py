"""Designs as formulas see them, and the table of a formula over the decisions that it consults.

A formula is a function of a `View`. Evaluating it on a whole design gives its value; `tabulate` evaluates it on partial
designs, branching whenever it asks for a decision that is still open. The result is a list of disjoint, exhaustive
cases: the search takes its coefficients from there, so that no formula is written twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from dse.space.model.arrivals import CyclicActivation
from dse.space.model.space import Decision, Space
from dse.space.model.trees import NotOffered, consulted
from dse.support.timelimit import look_at_the_clock

T = TypeVar("T")


class View:
    """A design (the option of each decision, by number) with a memo for intermediate results of formulas.

    With `groups` only these threads, by number, count in response times, each group on a core of its own; None: all do.
    """

    __slots__ = ("design", "groups", "memo")

    def __init__(
        self, design: Sequence[int] | Mapping[int, int], groups: Sequence[Sequence[int]] | None = None
    ) -> None:
        self.design: Any = design
        self.groups = groups
        self.memo: dict[Any, Any] = {}

    def __getitem__(self, decision: int) -> int:
        return int(self.design[decision])

    def apart(self) -> View:
        """A view of the design with a memory of its own; what notes the decisions that are asked for still does.

        The copy has none of the remembered response times and figures.
        """
        return type(self)(self.design, self.groups)


class Undecided(Exception):
    """A formula asked for `decision`, which the partial design leaves open.

    Caught by whoever tabulates a formula: the formula is evaluated once for each option of the decision.
    """

    def __init__(self, decision: int) -> None:
        self.decision = decision


class PartialView(View):
    """A partial design: asking for an open decision raises `Undecided`.

    Decisions without an option are left open; figures that do not depend on them can be computed.
    """

    __slots__ = ()

    def __init__(self, design: Mapping[int, int], groups: Sequence[Sequence[int]] | None = None) -> None:
        self.design: Any = design
        self.groups = groups
        self.memo: dict[Any, Any] = {}

    def __getitem__(self, decision: int) -> int:
        option = self.design.get(decision)
        if option is None:
            raise Undecided(decision)
        return int(option)


def is_met(decision: Decision, index: int, view: View) -> bool:
    """Whether the design uses the decision.

    A decision is used where its home tree, evaluated for this design, passes through it.
    """
    return index in consulted(decision.home, view)[0]


@dataclass(frozen=True, slots=True)
class Case(Generic[T]):
    """One case of a tabulated formula: its `value` where every decision of `conditions` takes the option given there.

    `conditions` are pairs (decision, option); cases of a table exclude each other and cover all designs.
    """

    conditions: tuple[tuple[int, int], ...]
    value: T


def tabulate(
    space: Space, formula: Callable[[View], T], limit: int, given: Mapping[int, int] | None = None
) -> list[Case[T]] | None:
    """The cases of `formula` over all designs; None when there are more than `limit`.

    `given` are decisions that are taken already (decision to option); the conditions of the cases leave them out.

    Cases in which the design cannot be valid (an option that is not offered, a cycle of event-triggered components) are
    left out: the constraints that forbid them stand elsewhere.

    Raises
    ------
    OutOfTime
        when the time limit in force is over.
    """
    cases: list[Case[T]] = []
    taken = dict(given or {})
    stack: list[dict[int, int]] = [taken]
    while stack:
        look_at_the_clock()
        partial = stack.pop()
        try:
            value = formula(PartialView(partial))
        except Undecided as question:
            options = allowed_options(space, question.decision)
            stack.extend({**partial, question.decision: option} for option in reversed(options))
            if len(cases) + len(stack) > limit:
                return None
        except (NotOffered, CyclicActivation):
            continue
        else:
            cases.append(Case(tuple(partial.items())[len(taken) :], value))
    return cases


def allowed_options(space: Space, decision: int) -> Sequence[int]:
    """The options that ``--fix`` leaves a decision.

    Indices of options: all of them, or the one that the caller has fixed.
    """
    if decision in space.fixed:
        return (space.fixed[decision],)
    return range(len(space.decisions[decision].options))
