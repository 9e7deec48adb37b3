"""The space of a problem as a function of the figures of its file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

from dse.api.problem import Problem, changed
from dse.records import dataclass
from dse.space.build import build_space
from dse.space.types import Space
from dse.spec.model import Spec
from dse.spec.quantities import Figure, matching, with_figures
from dse.study.trace import Node, Traced

Values = Sequence[Fraction]


@dataclass(frozen=True)
class Variable(Figure):
    """An input: a figure of the file, with its number."""

    index: int = 0


def _traced(spec: Spec) -> tuple[Spec, tuple[Variable, ...]]:
    """The spec with a variable in the place of every stated quantity, and the variables; nothing in it is uncertain."""
    variables: list[Variable] = []

    def make(value: Any, figure: Figure) -> Traced:
        variable = Variable(**vars(figure), index=len(variables))
        variables.append(variable)
        return Traced(value, Node("var", (), variable.index))

    return with_figures(spec, make).model_copy(update={"uncertainty": {}}), tuple(variables)


class InputSpace:
    """The space of a problem as a function of its inputs: the same decisions and options whatever the inputs are."""

    def __init__(self, problem: Problem, ask: Callable[[Problem], Problem] | None = None) -> None:
        """`ask` makes the question of `problem` from the problem as its file states it, where its changes do not."""
        spec, self.variables = _traced(problem.loaded.spec)
        loaded = replace(problem.loaded, spec=spec)
        self.problem = problem
        asked = ask or partial(changed, changes=problem.changes)
        self.traced = asked(Problem(loaded, build_space(loaded))).space
        assert [item.options for item in self.traced.decisions] == [
            item.options for item in self.problem.space.decisions
        ]

    @cached_property
    def nominal(self) -> tuple[Fraction, ...]:
        """The values of the file."""
        return tuple(variable.nominal for variable in self.variables)

    def at(self, values: Values, *, traced: bool = False) -> Space:
        """The space for other values; with `traced`, figures remember the variables they are."""

        def replaced(number: Traced) -> Any:
            assert number.node.operation == "var", "a figure of the space is a variable of the file"
            value = values[number.node.value]
            if traced:
                return Traced(value, number.node)
            return int(value) if value.denominator == 1 else value

        parts = {
            name: _substituted(getattr(self.traced, name), replaced, {})
            for name in ("processors", "buses", "components", "connections")
        }
        return replace(self.traced, **parts)

    def matching(self, path: str) -> list[Variable]:
        """The variables that a path stands for: its own, or all below it."""
        return matching(self.variables, path)


def _substituted(part: Any, replaced: Any, seen: dict[int, Any]) -> Any:
    """A copy of frozen data with every traced number replaced."""
    if isinstance(part, Traced):
        return replaced(part)
    if isinstance(part, str | int | None) or part is None:
        return part
    if id(part) in seen:
        return seen[id(part)]
    made = part
    if isinstance(part, tuple):
        items = [_substituted(item, replaced, seen) for item in part]
        if any(new is not old for new, old in zip(items, part, strict=True)):
            made = type(part)(*items) if hasattr(part, "_fields") else tuple(items)
    elif isinstance(part, Mapping):
        made = {key: _substituted(item, replaced, seen) for key, item in part.items()}
    elif is_dataclass(part) and not isinstance(part, type):
        old = {item.name: getattr(part, item.name) for item in fields(part)}
        new = {name: _substituted(item, replaced, seen) for name, item in old.items()}
        if any(new[name] is not old[name] for name in old):
            made = replace(part, **new)
    seen[id(part)] = made
    return made
