"""Margins of a design: how far each input may move, alone, before a requirement breaks.

All execution times together; tornado bars.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from dse.analysis.views import View
from dse.answers.studies.sensitivity import Bar, Break, Margin, Scaling
from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison
from dse.questions.sensitivity.input_line import LineComparisons, reached_steps
from dse.questions.sensitivity.inputs import Variable
from dse.questions.sensitivity.uncertainty import stated_cores
from dse.space.model.trees import at
from dse.spec.schema.fields import COUNT
from dse.support.units import TIME_RANGE, is_unbounded

FARTHEST = 10**6
"""An input is followed up to this multiple of its value (of 1 s, 1 MB and the like where it is 0)."""
MOST_ITEMS = 1000
"""Cores and items in a queue are followed up to this multiple."""
FINEST = Fraction(1, 10**9)
"""How close the border of a quantity that need not be whole is found where it cannot be solved for."""
NEAREST, STRIDE = 64, 4
"""A break is looked for at a 64th of the value from it, then ever farther, each time four times as far."""
LOOKS = 16
"""At how many places on the way to a break it is made sure that nothing breaks earlier."""
EXECUTION = ("compute_execution_time", "callback_execution_time")


def broken_texts(function: DesignFunction) -> list[str]:
    """The requirements that the design breaks as it is.

    Texts of requirements, each once, evaluated exactly at the values of the file; empty for a feasible design.
    """
    broken = function.broken(function.exact(function.inputs.nominal))
    return list(dict.fromkeys(function.outputs.texts[bound.requirement] for bound in broken))


def _held(function: DesignFunction) -> tuple[OutputComparison, ...]:
    """The comparisons of the requirements that hold as it is."""
    broken = {bound.requirement for bound in function.broken(function.exact(function.inputs.nominal))}
    return tuple(bound for bound in function.outputs.bounds if bound.requirement not in broken)


def margins(function: DesignFunction) -> tuple[Margin, ...]:
    """The margin of every input that reaches a requirement of the design, in the order of the file.

    One `Margin` for each input: how far it can go down and up, in base units, while every other input keeps the value
    of the file.
    """
    return tuple(each_margin(function))


def each_margin(function: DesignFunction) -> Iterator[Margin]:
    """The margin of each input that reaches a requirement of the design, one by one, in the order of the file.

    Yields as margins are computed, so that progress can be shown. Only requirements that hold at the file's values can
    break, so that only these are looked at.
    """
    of = reaches(function, _held(function))
    for variable in function.inputs.variables:
        bounds = of(variable)
        if bounds:
            yield _margin(function, variable, bounds)


def reaches(
    function: DesignFunction, bounds: Sequence[OutputComparison]
) -> Callable[[Variable], tuple[OutputComparison, ...]]:
    """A function from an input to the comparisons that depend on it.

    The function that is returned takes a variable and gives the comparisons whose expression contains it; all of them
    where the variable decides a guard or the program does not apply.
    """
    nearby = function.around_cores
    inside = [
        frozenset().union(*(nearby.program.variables(nearby.outputs[side]) for side in _sides(function, bound)))
        for bound in bounds
    ]

    def reached_by(variable: Variable) -> tuple[OutputComparison, ...]:
        if not function.applies or variable.index in nearby.program.deciding:
            return tuple(bounds)
        return tuple(bound for bound, indices in zip(bounds, inside, strict=True) if variable.index in indices)

    return reached_by


def _sides(function: DesignFunction, bound: OutputComparison) -> list[int]:
    """The outputs that a comparison is made of: its own, and for the fullest core those of the threads."""
    listed = [bound]
    if bound == function.core_bound(bound.requirement):
        listed = [item for item in function.bounds_of(bound.requirement) if item != bound]
    return [number for item in listed for number in (item.value, item.limit)]


def _margin(function: DesignFunction, variable: Variable, bounds: tuple[OutputComparison, ...]) -> Margin:
    way = LineComparisons(function, {variable.index: Fraction(1)}, bounds)
    least, most = domain(function, variable)
    breaks = [_first_break(way, variable.nominal, end, variable.is_whole) for end in (least, most)]
    return Margin(variable.path, variable.unit, variable.nominal, breaks[0], breaks[1], (least, most))


def domain(function: DesignFunction, variable: Variable) -> tuple[Fraction, Fraction]:
    """The values that an input can take while the others stay: an end of a range stops at the other end.

    A pair (least, most) in base units, at most `FARTHEST` times the file's value away. A number of items is at most
    `MOST_ITEMS` times the file's.
    """
    least, most = Fraction(variable.least), max(variable.nominal, Fraction(1000)) * FARTHEST
    if not variable.is_whole:
        least = variable.nominal / FARTHEST
    if variable.kind is COUNT:
        most = max(variable.nominal, Fraction(1)) * MOST_ITEMS
        least = min(variable.nominal, max(least, _fewest_cores(function, variable)))
    variables = function.inputs.variables
    if variable.end == "min":
        most = variables[variable.index + 1].nominal
    elif variable.end == "max":
        least = variables[variable.index - 1].nominal
    return least, most


def _fewest_cores(function: DesignFunction, variable: Variable) -> Fraction:
    """The highest stated core that the design has on processors of a type, should the input be its cores."""
    space, view = function.inputs.problem.space, View(function.design)
    types = [slot.types[function.design[slot.type_decision]] for slot in space.processors]
    cores = [
        at(item.core, view)
        for item in space.components
        if stated_cores(function.inputs.problem, item)
        and (place := at(item.processor, view)) is not None
        and variable.path.partition("[")[0] == f"processor_types.{types[place]}.cores"
    ]
    return Fraction(max((core for core in cores if isinstance(core, int)), default=0))


def _first_break(way: LineComparisons, start: Fraction, end: Fraction, is_whole: bool) -> Break | None:
    """The first break on the way from `start`, where all holds, to `end`."""
    if start == end:
        return None
    good, bad = start, None
    for place in _places(start, end, is_whole):
        if way.broken(place):
            bad = place
            break
        good = place
    if bad is None:
        return None
    good, bad = _narrowed(way, good, bad, is_whole)
    for look in range(1, LOOKS):  # nothing breaks earlier, should a requirement not move one way only
        place = start + (good - start) * look / LOOKS
        place = Fraction(round(place)) if is_whole else place
        if way.broken(place):
            good, bad = _narrowed(way, start, place, is_whole)
            break
    broken = way.broken(bad)[0]
    text = way.function.outputs.texts[broken.requirement]
    if not is_whole:
        exact_border = _solved(way, broken, good, bad)
        if exact_border is not None:
            return Break(exact_border, None, text, broken.thread)
    return Break(good, bad, text, broken.thread)


def _places(start: Fraction, end: Fraction, is_whole: bool) -> Iterator[Fraction]:
    """Where a break is looked for: ever farther from `start`, at last at `end`."""
    size = abs(start) / NEAREST if start else abs(end) / NEAREST / FARTHEST
    size = Fraction(max(1, round(size))) if is_whole else size
    while size < abs(end - start):
        yield start + size if end > start else start - size
        size *= STRIDE
    yield end


def _narrowed(way: LineComparisons, good: Fraction, bad: Fraction, is_whole: bool) -> tuple[Fraction, Fraction]:
    """The last value that holds and the first that does not, between one of each.

    A step goes to where a straight line would meet its limit; after one that gains little, to the middle.
    """
    finest = (max(abs(good), abs(bad)) * FINEST).limit_denominator(10**18) or FINEST**3
    finest = Fraction(1) if is_whole else finest
    halve = False
    while abs(bad - good) > finest:
        width = abs(bad - good)
        place = (good + bad) / 2 if halve else _met(way, good, bad)
        if is_whole:
            place = Fraction(place.__floor__() if good < bad else place.__ceil__())
        else:  # where lines meet, denominators multiply from step to step
            place = round(place / finest * 16) * finest / 16
        if not min(good, bad) < place < max(good, bad):
            aside = finest if good < bad else -finest
            place = good + aside if place == good or halve else bad - aside
        if way.broken(place):
            bad = place
        else:
            good = place
        halve = abs(bad - good) * 2 > width
    return good, bad


def _met(way: LineComparisons, good: Fraction, bad: Fraction) -> Fraction:
    """Where the first of the broken comparisons would meet its limit if it moved in a straight line."""
    meets = []
    for bound in way.broken(bad):
        first, second = way.gap(good, bound), way.gap(bad, bound)
        if first != second:
            meets.append((bad - good) * first / (first - second))
    return good + min(meets, key=abs) if meets else (good + bad) / 2


def _solved(way: LineComparisons, bound: OutputComparison, good: Fraction, bad: Fraction) -> Fraction | None:
    """The exact place where the two sides of a comparison meet, if they are straight lines between two places."""
    first, second = way.gap(good, bound), way.gap(bad, bound)
    if first == second:
        return None
    place = good + (bad - good) * first / (first - second)
    return place if way.gap(place, bound) == 0 and not way.broken(place) else None


# --- all execution times ------------------------------------------------------------------------------------------


def scaling(function: DesignFunction) -> Scaling:
    """The largest factor on all execution times with which every requirement holds, and what breaks beyond it.

    A `Scaling` with the factor (None when nothing breaks up to `FARTHEST`), the requirement and thread that break
    first, and the utilisation at the factor. The classic *critical scaling factor* (Lehoczky, Sha and Ding 1989), here
    over every requirement.
    """
    moving = {item.index: item.nominal for item in function.inputs.variables if _is_execution(item)}
    held = _held(function)
    breaks: dict[str, Break | None] = {}
    for number in dict.fromkeys(bound.requirement for bound in held):
        bounds = tuple(bound for bound in held if bound.requirement == number)
        scaled = _first_break(LineComparisons(function, moving, bounds), Fraction(1), Fraction(FARTHEST), False)
        breaks[function.outputs.texts[number]] = scaled
    known = [item for item in breaks.values() if item is not None]
    first = min(known, key=lambda item: item.last, default=None)
    at = function.exact(LineComparisons(function, moving, ()).values(Fraction(1) if first is None else first.last))
    names = function.outputs.names
    used = {
        name.removeprefix("utilisation of "): at[number]
        for number, name in enumerate(names)
        if name.startswith("utilisation of ")
    }
    return Scaling(
        factor=None if first is None else first.last,
        requirement="" if first is None else first.requirement,
        thread="" if first is None else first.thread,
        is_exact=first is None or first.first is None,
        by_requirement={text: None if item is None else item.last for text, item in breaks.items()},
        utilisations=used,
        most=Fraction(FARTHEST),
    )


def _is_execution(variable: Variable) -> bool:
    return variable.kind is TIME_RANGE and any(f".{name}" in variable.path for name in EXECUTION)


# --- tornado ------------------------------------------------------------------------------------------------------


def bars(
    function: DesignFunction, swing: Fraction, stated: Mapping[int, tuple[Fraction, Fraction]], metrics: Sequence[str]
) -> tuple[Bar, ...]:
    """For each metric and each input that moves it, the metric at both ends of the input's range.

    The range is the stated one, else the value less and plus `swing` of it; whole numbers move in whole steps, at least
    one.
    """
    nominal = function.exact(function.inputs.nominal)
    swings: list[Bar] = []
    for variable in function.inputs.variables:
        ends = stated.get(variable.index) or _swung(function, variable, swing)
        if ends[0] == ends[1]:
            continue
        outputs = _metrics_at(function, variable, ends)
        for number, name in enumerate(function.outputs.names):
            values = (outputs[0][number], outputs[1][number])
            if all(map(is_unbounded, (*values, nominal[number]))):
                continue  # it is unbounded whatever the input
            if name in metrics and values != (nominal[number], nominal[number]):
                unit = function.outputs.units[number]
                swings.append(Bar(name, unit, variable.path, variable.unit, ends, values, nominal[number]))
    order = {name: number for number, name in enumerate(metrics)}
    return tuple(sorted(swings, key=lambda bar: (order[bar.metric], -bar.swing, bar.path)))


def _metrics_at(
    function: DesignFunction, variable: Variable, values: Iterable[Fraction]
) -> list[Sequence[Fraction] | Mapping[int, Fraction]]:
    """The metrics by number at some values of one input: what it does not reach is as stated."""
    part = reached_steps(function.around_cores, frozenset([variable.index]), range(len(function.outputs.names)))
    way = LineComparisons(function, {variable.index: Fraction(1)}, ())
    metrics: list[Sequence[Fraction] | Mapping[int, Fraction]] = []
    for value in values:
        reached = part.run({variable.index: value}) if function.applies else None
        metrics.append(function.exact(way.values(value)) if reached is None else reached)
    return metrics


def _swung(function: DesignFunction, variable: Variable, swing: Fraction) -> tuple[Fraction, Fraction]:
    """The value less and plus a share of it, as far as the input can go."""
    least, most = domain(function, variable)
    step = variable.nominal * swing
    if variable.is_whole and variable.nominal:
        step = Fraction(max(1, round(step)))
    return max(variable.nominal - step, least), min(variable.nominal + step, most)
