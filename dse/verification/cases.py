"""Several questions asked of a solver as one: each is a case, and a variable says which of them a solution answers.

What is learnt of one case refutes most of the others: 166 regions of a front of 100 threads take 0.4 CPU seconds
together, and 17 one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ortools.sat.python import cp_model

from dse.verification.solver_calls import Outcome

EASY_LIMIT = 0.1
"""Deterministic time for each case of a question about several."""
MOST_SOLUTIONS = 4
"""After so many cases with a solution what is left is no longer asked together."""


class Cases:
    """The cases 0, 1, ... of a model, of which each solution is of one.

    Parameters
    ----------
    model
        gets a variable for the case.
    count
        the number of cases.
    """

    def __init__(self, model: cp_model.CpModel, count: int) -> None:
        self.model, self.count = model, count
        self.which = model.new_int_var(0, count - 1, "")

    def value(self, values: Sequence[int]) -> Any:
        """The number of the case: a constant where all cases have the same number, else a variable."""
        if len(set(values)) == 1:
            return values[0]
        said = self.model.new_int_var(min(values), max(values), "")
        self.model.add_element(self.which, list(values), said)
        return said

    def unproved(self, attempt: Callable[[cp_model.CpModel, float], Outcome]) -> list[int]:
        """The cases that are not proved infeasible, in ascending order.

        `attempt` asks the solver about a model for at most so much deterministic time. A case with a solution is left
        out and the others are asked again, up to `MOST_SOLUTIONS` times.
        """
        left, solved = list(range(self.count)), list[int]()
        while left and len(solved) < MOST_SOLUTIONS:
            self.which.proto.domain.clear()
            self.which.proto.domain.extend(cp_model.Domain.from_values(left).flattened_intervals())
            status, solver = attempt(self.model, EASY_LIMIT * len(left))
            if status == cp_model.INFEASIBLE:
                return sorted(solved)
            if solver is None:
                break
            solved.append(solver.value(self.which))
            left.remove(solved[-1])
        return sorted(solved + left)
