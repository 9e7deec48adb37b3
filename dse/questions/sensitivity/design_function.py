"""A design's metrics and requirements as functions of the inputs of its problem file.

The problem is read once with traced figures (`dse.questions.sensitivity.traced_numbers`); the analysis' formulas then
give every metric and limit of one design as an expression. The expressions are held to the analysis itself at random
inputs when they are made; where they do not apply (a comparison would be decided otherwise) the formulas are run again
for those inputs.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy

from dse.analysis.latency.metrics import EXACT_KINDS
from dse.analysis.limits import (
    HOLDS,
    Limit,
    build_limit,
    comparisons,
    core_comparison,
    core_words,
    sum_comparisons,
    thread_values,
)
from dse.analysis.measures import all_metrics, build_measure
from dse.analysis.views import View
from dse.questions.sensitivity.inputs import InputSpace, Values, Variable
from dse.questions.sensitivity.intervals import Further
from dse.questions.sensitivity.traced_numbers import MOST_GUARDS, Program, TooManyGuardsError, watching
from dse.space.model.space import Design
from dse.support.timelimit import look_at_the_clock
from dse.support.units import is_unbounded

CHUNK = 8192
"""The number of samples that are evaluated at a time: what they need stays in the cache."""
KEPT_PROGRAMS = 30
"""The number of expressions that are remembered besides the one of the values in the file."""
CHECKS = 3
"""At how many random inputs a function is held to the analysis."""


@dataclass(frozen=True)
class OutputComparison:
    """One comparison that a requirement makes: numbers of two outputs.

    `thread` names the thread, or the core, that it is about, if it is one.
    """

    requirement: int
    value: int
    limit: int
    thread: str = ""


@dataclass(frozen=True)
class Outputs:
    """The outputs of a design's function: the metrics by number, then both sides of each comparison.

    `names` and `units` belong to the metrics; `texts` and `operators` to the requirements, whose comparisons in
    `bounds` refer to outputs by number.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    texts: tuple[str, ...]
    operators: tuple[str, ...]
    bounds: tuple[OutputComparison, ...]
    about_cores: frozenset[int]
    """Requirements whose comparisons depend on which threads share a core: their expressions hold nearby only."""


@dataclass(frozen=True)
class NearbyProgram:
    """A program, the value of each of its steps at the values of the file, and the step of each output by number.

    The program holds near the values of the file: guards say which comparisons it took for granted.
    """

    program: Program
    steps: Sequence[Fraction]
    outputs: Mapping[int, int]


class DesignFunction:
    """Every metric and requirement of one design as a function of the inputs.

    Without `cores`, comparisons of whole cores are left out: which threads share a core may change with the inputs, and
    `core_sides` has to be asked.
    """

    def __init__(self, inputs: InputSpace, design: Design, *, cores: bool = True) -> None:
        self.inputs, self.design, self.cores = inputs, design, cores
        self.programs: list[Program] = []
        space = inputs.problem.space
        listed = [item for item in all_metrics(space) if item.kind not in EXACT_KINDS]  # no functions: jobs
        named = {item.name: item for item in (*listed, *(objective.metric for objective in space.objectives))}
        self.metrics = tuple(named.values())
        """The metrics of the problem as stated: with other numbers of cores there are others of single cores."""
        self.partitions: dict[int, deque[Mapping[int, int]]] = {}
        """The last partitions of threads on cores that were found to keep a requirement, by its number."""
        self._loads_alone: dict[int, NearbyProgram] = {}
        self.further: tuple[Further, ...] = ()
        """What follows from the inputs and is a variable of the programs all the same, after them."""
        self.outputs, results, guards = self._formulas(inputs.nominal, traced=True)
        self.programs.append(Program(results, guards))
        self.applies = self._agrees()

    def inputs_of(self, values: Values) -> Values:
        """The variables of the programs, computed from the values of the inputs.

        Here the values themselves, in base units; a design with response times adds these as further variables
        (`ScheduledFunction`).
        """
        return values

    def view_of(self, values: Values, *, traced: bool) -> View:
        """The design as the formulas see it.

        `traced` asks for numbers that remember their expression (`Traced`), which a subclass gives to what it computes
        itself.
        """
        return View(self.design)

    def _formulas(
        self, values: Values, *, traced: bool = False, most: int | None = None, cores: bool | None = None
    ) -> tuple[Outputs, list[Fraction], list[Any]]:
        """Run the analysis on the design: what its outputs are, their values, the comparisons made on the way.

        `cores` says whether whole cores are compared too, if not as the function does.

        Raises
        ------
        TooManyGuardsError
            when there are more than `most` comparisons, where that is given.
        """
        look_at_the_clock()
        cores = self.cores if cores is None else cores
        space = self.inputs.at(values, traced=traced)
        with watching() as guards:
            limits = [build_limit(space, item, counted=False) for item in space.requirements]
            measures = [build_measure(space, metric, counted=False) for metric in self.metrics]
            guards.clear()  # scales and units are no part of the figures
            guards.most = most
            view = self.view_of(values, traced=traced)
            results = [measure.value(view) for measure in measures]
            bounds: list[OutputComparison] = []
            for number, limit in enumerate(limits):
                for value, bound, thread in _comparisons(limit, view, cores=cores):
                    bounds.append(OutputComparison(number, len(results), len(results) + 1, thread))
                    results += [value, bound]
        outputs = Outputs(
            tuple(measure.metric.name for measure in measures),
            tuple(measure.unit for measure in measures),
            tuple(item.shown for item in space.requirements),
            tuple(item.operator for item in space.requirements),
            tuple(bounds),
            frozenset(number for number, limit in enumerate(limits) if cores and limit.cores),
        )
        return outputs, results, list(guards)

    def analysed(self, values: Values) -> list[Fraction]:
        """The outputs by the analysis itself, without expressions.

        Exact, in the order of `outputs`: metrics, then both sides of each comparison. Slower than the program, and
        right for any values.
        """
        return [item if is_unbounded(item) else Fraction(item) for item in self._formulas(values)[1]]

    def _agrees(self) -> bool:
        """Whether the expressions give what the analysis gives at random inputs; never used where they do not."""
        source = random.Random(1)
        program = self.programs[0]
        for _ in range(CHECKS):
            values = [_nearby(variable, source) for variable in self.inputs.variables]
            steps = program.run(self.inputs_of(values))
            if program.holds(steps) and [steps[number] for number in program.outputs] != self.analysed(values):
                return False
        return True

    def program_at(self, values: Values) -> tuple[Program, list[Fraction]]:
        """A program that applies at these inputs, with the value of each of its steps.

        Raises
        ------
        TooManyGuardsError
            when it would have more comparisons than are worth remembering.
        """
        inputs = self.inputs_of(values)
        for program in self.programs:
            steps = steps_or_none(program, inputs)
            if steps is not None and program.holds(steps):
                return program, steps
        _, results, guards = self._formulas(values, traced=True, most=MOST_GUARDS)
        program = Program(results, guards)
        self.programs = [*self.programs[:1], *self.programs[1:][1 - KEPT_PROGRAMS :], program]
        return program, program.run(inputs)

    def compared(self, values: Values, bounds: Sequence[OutputComparison]) -> dict[int, Fraction]:
        """Both sides of some comparisons by the analysis itself.

        Exact fractions by number of output. Raises `OutOfTime` when the limit of time in force is up.
        """
        look_at_the_clock()
        view = View(self.design)
        wanted = dict.fromkeys(bound.requirement for bound in bounds)
        limits = self.inputs.limits(values, wanted)
        sides: dict[int, Fraction] = {}
        for number in wanted:
            places = self.bounds_of(number)
            for bound, (value, most, _) in zip(
                places, _comparisons(limits[number], view, cores=self.cores), strict=True
            ):
                sides[bound.value], sides[bound.limit] = value, most
        return sides

    def core_sides(self, values: Values, only: int | None = None) -> dict[int, tuple[Fraction, Fraction, str]]:
        """For each requirement about whole cores (`only` that one) the load of the fullest, its limit, and the core.

        Requirement numbers to (load, limit, core in words), exact. Threads may change cores with the inputs, which an
        expression cannot follow.
        """
        view = View(self.design)
        sides = {}
        numbers = range(len(self.inputs.problem.space.requirements)) if only is None else (only,)
        limits = self.inputs.limits(values, numbers)
        for number in numbers:
            limit = limits[number]
            if limit.cores is not None:
                item = core_comparison(limit.cores, thread_values(limit, view), view)
                assert item.spread is not None
                sides[number] = (Fraction(item.value), Fraction(item.bound), core_words(item.spread))
        return sides

    @cached_property
    def around_cores(self) -> NearbyProgram:
        """The outputs but for the load of the fullest core: which threads share one decides nothing in it.

        The program's outputs keep the numbers of `outputs`; the comparison of the fullest core is missing. Its guards
        do not depend on the assignment of threads to cores.
        """
        if not self.outputs.about_cores:
            return NearbyProgram(self.programs[0], self._steps_as_stated, dict(enumerate(self.programs[0].outputs)))
        outputs, results, guards = self._formulas(self.inputs.nominal, traced=True, cores=False)
        program = Program(results, guards)
        numbers = {number: program.outputs[number] for number in range(len(outputs.names))}
        for requirement in range(len(outputs.texts)):
            those = (bound for bound in outputs.bounds if bound.requirement == requirement)
            for bound, other in zip(self.bounds_of(requirement), those, strict=False):
                numbers[bound.value], numbers[bound.limit] = program.outputs[other.value], program.outputs[other.limit]
        return NearbyProgram(program, program.run(self.inputs_of(self.inputs.nominal)), numbers)

    def loads_alone(self, requirement: int) -> NearbyProgram:
        """The comparisons of limited cores but for the fullest one, as a program of its own.

        Where other inputs change what response times count, the program of all outputs does not apply; this one does.
        """
        if requirement not in self._loads_alone:
            space = self.inputs.at(self.inputs.nominal, traced=True)
            with watching() as guards:
                limit = build_limit(space, space.requirements[requirement], counted=False)
                guards.clear()
                compared = list(_comparisons(limit, View(self.design), cores=False))
            program = Program([side for value, most, _ in compared for side in (value, most)], guards)
            numbers = [side for bound in self.bounds_of(requirement)[:-1] for side in (bound.value, bound.limit)]
            steps = program.run(self.inputs.nominal)
            self._loads_alone[requirement] = NearbyProgram(
                program, steps, dict(zip(numbers, program.outputs, strict=True))
            )
        return self._loads_alone[requirement]

    def bounds_of(self, requirement: int) -> list[OutputComparison]:
        """The comparisons of a requirement: the sum, then each thread of limited cores and the fullest core.

        In the order of `outputs.bounds`; one entry for a requirement that is a single sum.
        """
        return [bound for bound in self.outputs.bounds if bound.requirement == requirement]

    def core_bound(self, requirement: int) -> OutputComparison | None:
        """The comparison of the fullest core, where a requirement has one.

        It is the last comparison of its requirement; None where the requirement is not about whole cores.
        """
        return self.bounds_of(requirement)[-1] if requirement in self.outputs.about_cores else None

    @cached_property
    def _steps_as_stated(self) -> list[Fraction]:
        """The value of each step of the first program at the values of the file."""
        return self.programs[0].run(self.inputs.nominal)

    def exact(self, values: Values) -> list[Fraction]:
        """The outputs at exact inputs.

        Exact fractions in the order of `outputs`, by the program of the file's values where it applies (its guards hold
        at these values), else by the analysis, which is quicker than another program for one place.
        """
        if self.applies:
            program = self.programs[0]
            steps = steps_or_none(program, self.inputs_of(values))
            if steps is not None and program.holds(steps):
                return [steps[number] for number in program.outputs]
        return self.analysed(values)

    def sampled(self, columns: Mapping[int, Any], size: int) -> list[Any]:
        """The outputs for `size` samples as arrays of floats; `columns` has those of the variables that vary, by index.

        Outputs that no varying variable reaches are exact numbers.
        """
        parts = []
        for start in range(0, size, CHUNK):
            look_at_the_clock()
            end = min(start + CHUNK, size)
            parts.append(self._sampled({index: column[start:end] for index, column in columns.items()}, end - start))
        return [_joined(pieces, size) for pieces in zip(*parts, strict=True)]

    def _sampled(self, columns: Mapping[int, Any], size: int) -> list[Any]:
        inputs = [columns.get(variable.index, float(variable.nominal)) for variable in self.inputs.variables]
        if not self.applies:
            return self._one_by_one(inputs, size)
        program = self.programs[0]
        nominal = self._steps_as_stated
        steps = program.run(inputs)
        varying = frozenset(columns)
        sampled = [
            numpy.broadcast_to(steps[number], (size,)).copy()
            if program.variables(number) & varying
            else nominal[number]
            for number in program.outputs
        ]
        left = numpy.flatnonzero(~numpy.broadcast_to(program.holds(steps), (size,)))
        while left.size:
            left = self._sampled_elsewhere(inputs, left, sampled, size)
        return sampled

    def _sampled_elsewhere(self, inputs: Sequence[Any], rows: Any, sampled: list[Any], size: int) -> Any:
        """Fill in what the program of the first of these samples gives, wherever it applies; returns the other rows."""
        first = [Fraction(float(item[rows[0]]) if isinstance(item, numpy.ndarray) else item) for item in inputs]
        try:
            program, exact = self.program_at(first)
        except TooManyGuardsError:
            self._fill_in(sampled, rows[:1], [[value] for value in self.analysed(first)], size)
            return rows[1:]
        with numpy.errstate(all="ignore"):
            steps = program.run([item[rows] if isinstance(item, numpy.ndarray) else item for item in inputs])
            good = numpy.broadcast_to(program.holds(steps), rows.shape).copy()
        good[0] = True  # decided in exact fractions
        columns = []
        for step in program.outputs:
            values = numpy.broadcast_to(numpy.asarray(steps[step], dtype=float), rows.shape).copy()
            values[0] = float(exact[step])
            columns.append(values[good])
        self._fill_in(sampled, rows[good], columns, size)
        return rows[~good]

    @staticmethod
    def _fill_in(sampled: list[Any], rows: Any, columns: Sequence[Any], size: int) -> None:
        """Put the outputs of some samples to those of the others; a number for all becomes an array where it must."""
        for number, column in enumerate(columns):
            values = numpy.asarray(column, dtype=float)
            if not isinstance(sampled[number], numpy.ndarray):
                if (values == float(sampled[number])).all():
                    continue
                sampled[number] = numpy.full(size, float(sampled[number]))
            sampled[number][rows] = values

    def _one_by_one(self, inputs: Sequence[Any], size: int) -> list[Any]:
        rows = []
        for sample in range(size):
            values = [Fraction(float(item[sample]) if isinstance(item, numpy.ndarray) else item) for item in inputs]
            rows.append([float(value) for value in self.analysed(values)])
        return [numpy.array(column) for column in zip(*rows, strict=True)]

    def broken(
        self, outputs: Sequence[Fraction] | Mapping[int, Fraction], bounds: Sequence[OutputComparison] | None = None
    ) -> list[OutputComparison]:
        """The comparisons, of some or of all, that do not hold.

        `outputs` are values by number of output; a comparison holds when its requirement's operator is true of both
        sides. An empty list means that every requirement is met.
        """
        operators = self.outputs.operators
        return [
            bound
            for bound in (self.outputs.bounds if bounds is None else bounds)
            if not HOLDS[operators[bound.requirement]](outputs[bound.value], outputs[bound.limit])
        ]


def _joined(pieces: Sequence[Any], size: int) -> Any:
    """One output of several chunks: an array, or the number that all of them have."""
    if not any(isinstance(piece, numpy.ndarray) for piece in pieces):
        return pieces[0]
    sizes = [min(CHUNK, size - number * CHUNK) for number in range(len(pieces))]
    return numpy.concatenate(
        [
            numpy.broadcast_to(numpy.asarray(piece, dtype=float), (count,))
            for piece, count in zip(pieces, sizes, strict=True)
        ]
    )


def _comparisons(limit: Limit, view: View, *, cores: bool) -> Iterator[tuple[Fraction, Fraction, str]]:
    """Value, bound and thread or core of each comparison of a requirement (see `dse.analysis.limits.judge`)."""
    for item in comparisons(limit, view) if cores else sum_comparisons(limit, view):
        who = item.thread if item.spread is None else core_words(item.spread)
        yield item.value, Fraction(0) + item.bound, who


def steps_or_none(program: Program, values: Values) -> list[Fraction] | None:
    """The value of each step; None where a formula divides by 0, which a guard would have kept it from.

    `values` are the inputs of the program, exact or arrays of floats.
    """
    try:
        return program.run(values)
    except ZeroDivisionError:
        return None


def _nearby(variable: Variable, source: random.Random) -> Fraction:
    value = variable.nominal * Fraction(source.randint(900, 1100), 1000)
    return variable.settled(value)
