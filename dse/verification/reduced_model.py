"""The model of a smaller question: its rows with the options that are left, and rows of cores where these are asked."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import gcd
from typing import TYPE_CHECKING, Any

from ortools.sat.python import cp_model

from dse.timelimit import look_at_the_clock
from dse.verification.diagrams import Diagram, Node, leaves
from dse.verification.levels import Demand, Levels, add_levels
from dse.verification.lookups import Lookups
from dse.verification.remainders import is_deep

if TYPE_CHECKING:
    from dse.verification.reduced import Row


def reduced_model(
    rows: Sequence[Row],
    left: Sequence[Sequence[int]],
    levels: Levels | None = None,
    add: Callable[[cp_model.CpModel, Sequence[Mapping[Demand, Any]]], None] = add_levels,
) -> tuple[cp_model.CpModel, Options]:
    """The rows with what is left: what one decision adds to a row is one figure. With what is added for `levels`."""
    model = cp_model.CpModel()
    small: dict[tuple[Any, ...], Diagram] = {}
    options = Options(model, left)
    for row in rows:
        look_at_the_clock()
        alone: dict[int, list[int]] = {}
        total: Any = row.constant
        for decision, values in row.alone.items():
            values = [values[option] for option in left[decision]]
            if len(set(values)) == 1:
                total += values[0]
            else:
                alone[decision] = values
        for part in (_restricted(item, left, small) for item in row.deep):
            if not isinstance(part, Node):
                total += int(part)
            elif is_deep(part):
                total += options.lookups.value(part)
            else:
                known = alone.get(part.decision, [0] * len(part.branches))
                alone[part.decision] = [value + int(more) for value, more in zip(known, part.branches, strict=True)]
        if levels is None:
            total += sum(options.lookups.value(_node(decision, values, small)) for decision, values in alone.items())
            if not isinstance(total, int):  # else it holds, as `narrow` has left it
                model.add(total <= row.most)
        elif alone:
            _add_in_steps(
                model, total, [(values, options.of(decision)) for decision, values in alone.items()], row.most
            )
        elif not isinstance(total, int):
            model.add(total <= row.most)
    if levels is not None:
        add(model, [_uses(levels, number, left, small, options) for number in sorted(levels.demands)])
    return model, options


def _add_in_steps(
    model: cp_model.CpModel, total: Any, choices: Sequence[tuple[Sequence[int], Sequence[Any]]], most: int
) -> None:
    """Total + the chosen value of each choice <= most: where these are all, in the steps in which they grow."""
    low = sum(min(values) for values, _ in choices)
    step = gcd(*(value - min(values) for values, _ in choices for value in values)) if isinstance(total, int) else 1
    chosen = sum(
        (value - min(values)) // (step or 1) * literal
        for values, literals in choices
        for value, literal in zip(values, literals, strict=True)
    )
    if isinstance(total, int):
        model.add(chosen <= (most - low - total) // (step or 1))
    else:
        model.add(total + chosen <= most - low)


class Options:
    """What is left of each decision, as the position of an option and as literals, each where it is asked for."""

    def __init__(self, model: cp_model.CpModel, left: Sequence[Sequence[int]]) -> None:
        self.model, self.left = model, left
        self.lookups = Lookups(model, self.position)
        self._positions: dict[int, Any] = {}
        self._literals: dict[int, list[Any]] = {}

    def position(self, decision: int) -> Any:
        """The position of the option."""
        if decision not in self._positions:
            self._positions[decision] = self.model.new_int_var(0, len(self.left[decision]) - 1, "")
            self._bind(decision)
        return self._positions[decision]

    def of(self, decision: int) -> list[Any]:
        """A literal for each option."""
        if decision not in self._literals:
            self._literals[decision] = [self.model.new_bool_var("") for _ in self.left[decision]]
            self.model.add_exactly_one(self._literals[decision])
            self._bind(decision)
        return self._literals[decision]

    def chosen(self, solver: cp_model.CpSolver) -> list[list[int]]:
        """The position that a solution has of each decision; of one that no row looks at the first that is left."""
        found = [[options[0]] for options in self.left]
        for decision, variable in self._positions.items():
            found[decision] = [self.left[decision][solver.value(variable)]]
        for decision, literals in self._literals.items():
            found[decision] = [self.left[decision][[solver.value(literal) for literal in literals].index(1)]]
        return found

    def equal(self, variable: Any, values: Iterable[int]) -> list[Any]:
        """A literal for each of the values that a variable may have."""
        literals = []
        for value in values:
            literals.append(self.model.new_bool_var(""))
            self.model.add(variable == value).only_enforce_if(literals[-1])
        self.model.add_exactly_one(literals)
        return literals

    def _bind(self, decision: int) -> None:
        """Where there are both, the literals say which position it is."""
        if decision in self._positions:
            for value, literal in enumerate(self._literals.get(decision, ())):
                self.model.add(self._positions[decision] == value).only_enforce_if(literal)


def _uses(
    levels: Levels, number: int, left: Sequence[Sequence[int]], known: dict[tuple[Any, ...], Diagram], options: Options
) -> dict[Demand, Any]:
    """Whether a thread has each of its demands that are left: a sum of literals of which at most one is true."""
    listed, diagram = levels.demands[number], _restricted(levels.positions[number], left, known)
    uses: dict[Demand, Any] = {}
    if not isinstance(diagram, Node):
        pairs: Iterable[tuple[int, Any]] = [(int(diagram), 1)]
    elif is_deep(diagram):
        values = sorted({int(leaf) for leaf in leaves(diagram)})
        pairs = zip(values, options.equal(options.lookups.value(diagram), values), strict=True)
    else:
        pairs = zip(map(int, diagram.branches), options.of(diagram.decision), strict=True)
    for position, literal in pairs:
        demand = listed[position]
        if demand is not None:
            uses[demand] = uses.get(demand, 0) + literal
    return uses


def _node(decision: int, branches: Sequence[Diagram], known: dict[tuple[Any, ...], Diagram]) -> Diagram:
    """The node with these branches, the same one for the same branches; or their common value."""
    key = (decision, *(("node", id(item)) if isinstance(item, Node) else item for item in branches))
    if len(set(key[1:])) == 1:
        return branches[0]
    return known.setdefault(key, Node(decision, tuple(branches)))


def _restricted(diagram: Diagram, left: Sequence[Sequence[int]], known: dict[tuple[Any, ...], Diagram]) -> Diagram:
    """A diagram with the branches of the options that are left."""
    if not isinstance(diagram, Node):
        return int(diagram)
    key = ("of", id(diagram))
    if key not in known:
        branches = [_restricted(diagram.branches[option], left, known) for option in left[diagram.decision]]
        known[key] = _node(diagram.decision, branches, known)
    return known[key]
