"""Margins of a design: how far each input may move, alone, before a requirement breaks.

All execution times together; tornado bars.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from dse.analysis.limits import HOLDS
from dse.results.sensitivity import Bar, Break, Margin, Scaling
from dse.study.functions import Bound, DesignFunction, Variable
from dse.study.quantities import COUNT
from dse.units import TIME_RANGE

FARTHEST = 10**6
"""An input is followed up to this multiple of its value (of 1 s, 1 MB and the like where it is 0)."""
MOST_ITEMS = 1000
"""Cores and items in a queue are followed up to this multiple."""
FINEST = Fraction(1, 10**9)
"""How close the border of a quantity that need not be whole is found where it cannot be solved for."""
LOOKS = 16
"""At how many places on the way to a break it is made sure that nothing breaks earlier."""
EXECUTION = ("compute_execution_time", "callback_execution_time")
Point = Callable[[Fraction], list[Fraction]]


@dataclass(frozen=True)
class _Way:
    """Outputs along one way through the space of inputs, and the comparisons that are looked at."""

    outputs: Point
    bounds: tuple[Bound, ...]
    operators: tuple[str, ...]

    def broken(self, place: Fraction) -> list[Bound]:
        found = self.outputs(place)
        return [
            bound
            for bound in self.bounds
            if not HOLDS[self.operators[bound.requirement]](found[bound.value], found[bound.limit])
        ]

    def gap(self, place: Fraction, bound: Bound) -> Fraction:
        found = self.outputs(place)
        return found[bound.limit] - found[bound.value]


def broken_texts(function: DesignFunction) -> list[str]:
    """The requirements that the design breaks as it is."""
    broken = function.broken(function.exact(function.inputs.nominal))
    return list(dict.fromkeys(function.outputs.texts[bound.requirement] for bound in broken))


def _held(function: DesignFunction) -> tuple[Bound, ...]:
    """The comparisons of the requirements that hold as it is."""
    broken = {bound.requirement for bound in function.broken(function.exact(function.inputs.nominal))}
    return tuple(bound for bound in function.outputs.bounds if bound.requirement not in broken)


def margins(function: DesignFunction) -> tuple[Margin, ...]:
    """The margin of every input that reaches a requirement of the design, in the order of the file."""
    held = _held(function)
    found = []
    for variable in function.inputs.variables:
        bounds = tuple(bound for bound in held if reaches(function, variable, bound))
        if bounds:
            found.append(_margin(function, variable, bounds))
    return tuple(found)


def reaches(function: DesignFunction, variable: Variable, bound: Bound) -> bool:
    """Whether the input has a part in a comparison."""
    if not function.applies:
        return True
    program = function.programs[0]
    guarded = any(variable.index in program.variables(side) for _, *sides, _ in program.guards for side in sides)
    numbers = (program.outputs[bound.value], program.outputs[bound.limit])
    return guarded or any(variable.index in program.variables(number) for number in numbers)


def _margin(function: DesignFunction, variable: Variable, bounds: tuple[Bound, ...]) -> Margin:
    way = _Way(_alone(function, variable), bounds, function.outputs.operators)
    least, most = domain(function, variable)
    breaks = [_first_break(way, variable.nominal, end, variable.is_whole, function) for end in (least, most)]
    return Margin(variable.path, variable.unit, variable.nominal, breaks[0], breaks[1], least, most)


def _alone(function: DesignFunction, variable: Variable) -> Point:
    nominal = list(function.inputs.nominal)

    def outputs(place: Fraction) -> list[Fraction]:
        return function.exact([*nominal[: variable.index], place, *nominal[variable.index + 1 :]])

    return outputs


def domain(function: DesignFunction, variable: Variable) -> tuple[Fraction, Fraction]:
    """The values that an input can take while the others stay: an end of a range stops at the other end."""
    least, most = Fraction(variable.least), max(variable.nominal, Fraction(1000)) * FARTHEST
    if not variable.is_whole:
        least = variable.nominal / FARTHEST
    if variable.kind is COUNT:
        most = max(variable.nominal, Fraction(1)) * MOST_ITEMS
    variables = function.inputs.variables
    if variable.end == "min":
        most = variables[variable.index + 1].nominal
    elif variable.end == "max":
        least = variables[variable.index - 1].nominal
    return least, most


def _first_break(way: _Way, start: Fraction, end: Fraction, is_whole: bool, function: DesignFunction) -> Break | None:
    """The first break on the way from `start`, where all holds, to `end`."""
    if start == end:
        return None
    good, bad = start, None
    step = Fraction(1) if end > start else Fraction(-1)
    size = Fraction(1) if is_whole else max(abs(end - start) * FINEST, FINEST)
    while bad is None:
        place = start + step * size
        if (place - end) * step >= 0:
            place = end
        if way.broken(place):
            bad = place
        elif place == end:
            return None
        else:
            good, size = place, size * 2
    good, bad = _narrowed(way, good, bad, is_whole)
    for look in range(1, LOOKS):  # nothing breaks earlier, should a requirement not move one way only
        place = start + (good - start) * look / LOOKS
        place = Fraction(round(place)) if is_whole else place
        if way.broken(place):
            good, bad = _narrowed(way, start, place, is_whole)
            break
    broken = way.broken(bad)[0]
    text = function.outputs.texts[broken.requirement]
    if not is_whole:
        exact_border = _solved(way, broken, good, bad)
        if exact_border is not None:
            return Break(exact_border, None, text, broken.thread)
    return Break(good, bad, text, broken.thread)


def _narrowed(way: _Way, good: Fraction, bad: Fraction, is_whole: bool) -> tuple[Fraction, Fraction]:
    """The last value that holds and the first that does not, between one of each."""
    finest = Fraction(1) if is_whole else max(abs(good), abs(bad)) * FINEST
    while abs(bad - good) > finest:
        middle = (good + bad) / 2
        if is_whole:
            middle = Fraction((good + bad).__floor__() // 2)
            middle = middle if middle not in (good, bad) else middle + 1
        if way.broken(middle):
            bad = middle
        else:
            good = middle
    return good, bad


def _solved(way: _Way, bound: Bound, good: Fraction, bad: Fraction) -> Fraction | None:
    """The exact place where the two sides of a comparison meet, if they are straight lines between two places."""
    first, second = way.gap(good, bound), way.gap(bad, bound)
    if first == second:
        return None
    place = good + (bad - good) * first / (first - second)
    return place if way.gap(place, bound) == 0 and not way.broken(place) else None


# --- all execution times ------------------------------------------------------------------------------------------


def scaling(function: DesignFunction) -> Scaling:
    """The largest factor on all execution times with which every requirement holds, and what breaks beyond it."""
    nominal = function.inputs.nominal
    chosen = {item.index for item in function.inputs.variables if _is_execution(item)}

    def outputs(factor: Fraction) -> list[Fraction]:
        return function.exact([value * factor if index in chosen else value for index, value in enumerate(nominal)])

    held = _held(function)
    alone: dict[str, Fraction | None] = {}
    exact_ones: dict[str, bool] = {}
    for number in dict.fromkeys(bound.requirement for bound in held):
        bounds = tuple(bound for bound in held if bound.requirement == number)
        found = _first_break(
            _Way(outputs, bounds, function.outputs.operators), Fraction(1), Fraction(FARTHEST), False, function
        )
        text = function.outputs.texts[number]
        alone[text] = None if found is None else found.last
        exact_ones[text] = found is not None and found.first is None
    limits = {text: value for text, value in alone.items() if value is not None}
    first = min(limits, key=lambda text: limits[text]) if limits else ""
    at = outputs(limits[first]) if first else outputs(Fraction(1))
    names = function.outputs.names
    used = {
        name.removeprefix("utilisation of "): at[number]
        for number, name in enumerate(names)
        if name.startswith("utilisation of ")
    }
    return Scaling(limits.get(first), first, exact_ones.get(first, True), alone, used, Fraction(FARTHEST))


def _is_execution(variable: Variable) -> bool:
    return variable.kind is TIME_RANGE and any(f".{name}" in variable.path for name in EXECUTION)


# --- tornado ------------------------------------------------------------------------------------------------------


def bars(
    function: DesignFunction, swing: Fraction, stated: Mapping[int, tuple[Fraction, Fraction]], metrics: Sequence[str]
) -> tuple[Bar, ...]:
    """For each metric and each input that moves it, the metric at both ends of the input's range.

    The range is the stated one, else the value less and plus `swing` of it.
    """
    nominal = function.exact(function.inputs.nominal)
    found: list[Bar] = []
    for variable in function.inputs.variables:
        ends = stated.get(variable.index)
        if ends is None:
            least, most = domain(function, variable)
            ends = (max(variable.nominal * (1 - swing), least), min(variable.nominal * (1 + swing), most))
        if ends[0] == ends[1]:
            continue
        outputs = [_alone(function, variable)(end) for end in ends]
        for number, name in enumerate(function.outputs.names):
            values = (outputs[0][number], outputs[1][number])
            if name in metrics and values != (nominal[number], nominal[number]):
                unit = function.outputs.units[number]
                found.append(Bar(name, unit, variable.path, variable.unit, ends, values, nominal[number]))
    order = {name: number for number, name in enumerate(metrics)}
    return tuple(sorted(found, key=lambda bar: (order[bar.metric], -bar.swing, bar.path)))
