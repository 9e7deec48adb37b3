"""Diagrams in a solver's model: an element constraint for each node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ortools.sat.python import cp_model

from dse.support.timelimit import look_at_the_clock
from dse.verification.diagrams import Diagram, Node


class Lookups:
    """The leaves that decisions lead to; `position(d)` is the variable for the position of decision d's option.

    Of a decision whose position is `given` only that branch is followed.
    """

    def __init__(
        self, model: cp_model.CpModel, position: Callable[[int], Any], given: Mapping[int, int] | None = None
    ) -> None:
        self.model = model
        self.position = position
        self.given = given or {}
        self._known: dict[int, tuple[Node, Any]] = {}
        self._ends: dict[int, tuple[int, int]] = {}

    def value(self, diagram: Diagram) -> Any:
        """The leaf that the chosen options lead to: a variable, or a number where there is one leaf only.

        Variables are made once for each node; raises `OutOfTime` at the time limit.
        """
        if not isinstance(diagram, Node):
            return int(diagram)
        if diagram.decision in self.given:
            return self.value(diagram.branches[self.given[diagram.decision]])
        if id(diagram) not in self._known:
            look_at_the_clock()
            branches = [self.value(branch) for branch in diagram.branches]
            ends = [self._ends_of(branch) for branch in diagram.branches]
            low, high = int(min(end for end, _ in ends)), int(max(end for _, end in ends))
            self._ends[id(diagram)] = low, high
            target = self.model.new_int_var(low, high, "")
            if len(branches) == 2 and all(isinstance(branch, int) for branch in branches):
                first, second = branches
                self.model.add(target == first + (second - first) * self.position(diagram.decision))
            else:
                self.model.add_element(self.position(diagram.decision), branches, target)
            self._known[id(diagram)] = diagram, target  # with the node, so that its id stays its own
        return self._known[id(diagram)][1]

    def _ends_of(self, diagram: Diagram) -> tuple[int, int]:
        """The least and the greatest leaf."""
        while isinstance(diagram, Node) and diagram.decision in self.given:
            diagram = diagram.branches[self.given[diagram.decision]]
        return self._ends[id(diagram)] if isinstance(diagram, Node) else (int(diagram), int(diagram))

    def variable(self, diagram: Diagram) -> Any:
        """The value of a diagram as a variable of the model, also where it is constant."""
        value = self.value(diagram)
        return self.model.new_constant(value) if isinstance(value, int) else value
