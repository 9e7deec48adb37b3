"""The space of a problem as a function of the figures of its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

from dse.analysis.limits import Limit, build_limit
from dse.questions.problem import Problem, changed
from dse.questions.sensitivity.traced_numbers import ExpressionNode, Traced
from dse.space.build import build_space
from dse.space.model.space import Space
from dse.spec.quantities.quantities import Figure, matching, with_figures
from dse.spec.schema.model import Spec

Values = Sequence[Fraction]
PARTS = ("processors", "buses", "components", "connections")
"""What of a space holds figures."""
KEPT_SPACES = 64
"""The number of spaces that are remembered."""


@dataclass(frozen=True)
class Variable(Figure):
    """An input: a figure of the file, with its number.

    `index` is its position among the inputs, in the order of the file; the value is exact, in base units.
    """

    index: int = 0


@dataclass(frozen=True)
class _Kept:
    """A space that is remembered, with the limits that were asked for."""

    space: Space
    limits: dict[int, Limit]


def _traced(spec: Spec) -> tuple[Spec, tuple[Variable, ...]]:
    """The spec with a variable in the place of every stated quantity, and the variables; nothing in it is uncertain."""
    variables: list[Variable] = []

    def make(value: Any, figure: Figure) -> Traced:
        variable = Variable(**vars(figure), index=len(variables))
        variables.append(variable)
        return Traced(value, ExpressionNode("var", (), variable.index))

    return with_figures(spec, make).model_copy(update={"uncertainty": {}}), tuple(variables)


class InputSpace:
    """The space of a problem as a function of its inputs: the same decisions and options whatever the inputs are.

    A figure that is changed is put into the problem data and the space is built again, so that every rule about figures
    is checked as on loading.
    """

    def __init__(self, problem: Problem, ask: Callable[[Problem], Problem] | None = None) -> None:
        """`ask` makes the question of `problem` from the problem as its file states it, where its changes do not."""
        spec, self.variables = _traced(problem.loaded.spec)
        loaded = replace(problem.loaded, spec=spec)
        self.problem = problem
        question = ask or partial(changed, changes=problem.changes)
        self.traced = replace(question(Problem(loaded, build_space(loaded))).space, is_traced=True)
        self._known: dict[frozenset[tuple[int, Fraction]], _Kept] = {}
        assert [item.options for item in self.traced.decisions] == [
            item.options for item in self.problem.space.decisions
        ]

    @cached_property
    def nominal(self) -> tuple[Fraction, ...]:
        """The values of the file.

        Exact fractions in base units (ns, B, Hz, hundredths of the currency, ...), in the order of `variables`.
        """
        return tuple(variable.nominal for variable in self.variables)

    def at(self, values: Values, *, traced: bool = False) -> Space:
        """The space for other values; with `traced`, figures remember the variables they are.

        The last spaces are kept, but for traced ones: what a formula compares is noted where it is computed, and what
        was found of the same space before is not computed again.
        """
        return self._made(values, traced=True) if traced else self._kept(values).space

    def limits(self, values: Values, numbers: Iterable[int]) -> dict[int, Limit]:
        """The limits of some requirements for other values; only exact values may be asked of them (`build_limit`).

        `Limit` objects by number of the requirement, kept for each set of values. Their measures are without integer
        tables, for exact evaluation only.
        """
        kept = self._kept(values)
        for number in numbers:
            if number not in kept.limits:
                kept.limits[number] = build_limit(kept.space, kept.space.requirements[number], counted=False)
        return kept.limits

    def _kept(self, values: Values) -> _Kept:
        key = self._moved(values)
        if key not in self._known:
            if len(self._known) >= KEPT_SPACES:
                self._known.pop(next(iter(self._known)))
            self._known[key] = _Kept(self._made(values, traced=False), {})
        return self._known[key]

    def _moved(self, values: Values) -> frozenset[tuple[int, Fraction]]:
        """The values that are not those of the file, each with the index of its variable."""
        pairs = enumerate(zip(values, self.nominal, strict=True))
        return frozenset([(index, value) for index, (value, old) in pairs if value is not old and value != old])

    def _made(self, values: Values, *, traced: bool) -> Space:
        """The space anew: what holds no figure that is other than in the file is that of the file."""

        def replaced(number: Traced) -> Any:
            value = values[number.node.value]
            return Traced(value, number.node) if traced else _plain(value)

        moved = frozenset([index for index, _ in self._moved(values)])
        seen: dict[int, Any] = {}
        parts: dict[str, Any] = {
            name: tuple(
                [self._changed(item, moved, replaced, seen, traced=traced) for item in getattr(self.traced, name)]
            )
            for name in PARTS
        }
        return replace(self.traced, is_traced=traced, **parts)

    def _changed(
        self, part: Any, moved: frozenset[int], replaced: Callable[[Traced], Any], seen: dict[int, Any], *, traced: bool
    ) -> Any:
        """A component or slot with the values of the variables that are `moved`."""
        if self._variables_of[id(part)] & moved:
            return _substituted(part, replaced, seen)
        return part if traced else self._as_stated[id(part)]

    @cached_property
    def _variables_of(self) -> dict[int, frozenset[int]]:
        """The variables in each component and slot of the traced space, by its id."""
        variables_of: dict[int, frozenset[int]] = {}
        for part in (part for name in PARTS for part in getattr(self.traced, name)):
            inside: set[int] = set()

            def note(number: Traced, inside: set[int] = inside) -> Traced:
                assert number.node.operation == "var", "a figure of the space is a variable of the file"
                inside.add(number.node.value)
                return number

            _substituted(part, note, {})
            variables_of[id(part)] = frozenset(inside)
        return variables_of

    @cached_property
    def _as_stated(self) -> dict[int, Any]:
        """Each component and slot of the traced space with the values of the file, by its id."""
        seen: dict[int, Any] = {}
        return {
            id(part): _substituted(part, lambda number: _plain(self.nominal[number.node.value]), seen)
            for name in PARTS
            for part in getattr(self.traced, name)
        }

    def matching(self, path: str) -> list[Variable]:
        """The variables that a path stands for: its own, or all below it.

        The variable whose path is `path`, else all whose path continues it with a dot or a bracket, in the order of the
        file.
        """
        return matching(self.variables, path)


def _plain(value: Fraction) -> int | Fraction:
    return int(value) if value.denominator == 1 else value


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
