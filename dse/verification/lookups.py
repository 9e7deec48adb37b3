"""Diagrams in a solver's model: an element constraint for each node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ortools.sat.python import cp_model

from dse.timelimit import look_at_the_clock
from dse.verification.diagrams import Diagram, Node


class Lookups:
    """The leaves that decisions lead to; `position(d)` is the variable for the position of decision d's option."""

    def __init__(self, model: cp_model.CpModel, position: Callable[[int], Any]) -> None:
        self.model = model
        self.position = position
        self._known: dict[int, tuple[Node, Any]] = {}
        self._ends: dict[int, tuple[int, int]] = {}

    def value(self, diagram: Diagram) -> Any:
        """The leaf that the chosen options lead to: a variable, or a number where there is one leaf only."""
        if not isinstance(diagram, Node):
            return int(diagram)
        if id(diagram) not in self._known:
            look_at_the_clock()
            branches = [self.value(branch) for branch in diagram.branches]
            ends = [self._ends.get(id(branch), (branch, branch)) for branch in diagram.branches]
            low, high = int(min(end for end, _ in ends)), int(max(end for _, end in ends))
            self._ends[id(diagram)] = low, high
            target = self.model.new_int_var(low, high, "")
            self.model.add_element(self.position(diagram.decision), branches, target)
            self._known[id(diagram)] = diagram, target  # with the node, so that its id stays its own
        return self._known[id(diagram)][1]

    def variable(self, diagram: Diagram) -> Any:
        """The same, always as a variable."""
        found = self.value(diagram)
        return self.model.new_constant(found) if isinstance(found, int) else found
