"""Margins of designs against the analysis of edited problem files."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import numpy
import pytest

from dse.answers.analysis import Analysis
from dse.answers.studies.sensitivity import Break, Margin
from dse.questions.complete_design import complete_design
from dse.questions.problem import Problem, loads
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.input_line import LineComparisons
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.margins import _held, _margin, bars, broken_texts, margins, reaches, scaling
from dse.questions.sensitivity.traced_numbers import STEPS, ExpressionNode, Program, Traced, watching
from dse.questions.sweep.fronts import front_outcome
from dse.questions.sweep.inputs_of_file import Inputs, copied, effective_text, merged_data
from dse.questions.verbs.analyse import analyse
from dse.space.model.space import Design, Space
from dse.support.errors import UsageError
from dse.support.units import format_number
from tests.questions.studies import LONG, NAMES, edited, example, written

UNITS = {"ct": "EUR", "mW": "mW", "": ""}


def design_of(space: Space) -> dict[str, str]:
    """The baseline where it is complete, else the first of the front."""
    try:
        design = complete_design(space, dict(space.baseline))
    except UsageError:
        return dict(front_outcome(space, 0)["front"][0]["decisions"])
    return {
        item.name: item.options[option] for item, option in zip(space.decisions, design, strict=True) if item.is_open
    }


def function_of(problem: Problem, decisions: dict[str, str]) -> DesignFunction:
    options = {item.name: index for index, item in enumerate(problem.space.decisions)}
    chosen = {
        options[name]: problem.space.decisions[options[name]].options.index(text) for name, text in decisions.items()
    }
    design: Design = complete_design(problem.space, chosen)
    return DesignFunction(InputSpace(problem), design)


def value_text(margin: Margin, value: Fraction) -> str:
    unit = margin.unit
    number = value / 100 if unit == "ct" else value
    return f"{format_number(number)} {UNITS.get(unit, unit)}".strip()


def analysed(problem: Problem, margin: Margin, value: Fraction, decisions: dict[str, str]) -> Analysis:
    """The design in the problem with one value edited; an edited alternative is chosen under its new name."""
    changed = edited(problem, **{margin.path: value_text(margin, value)})
    changes = {}
    for index, item in enumerate(problem.space.decisions):
        if item.name in decisions:
            option = item.options.index(decisions[item.name])
            changes[item.name] = changed.space.decisions[index].options[option]
    return analyse(changed, changes)


def verdicts(analysis: Analysis) -> dict[str, bool]:
    return {verdict.requirement.text: verdict.holds for verdict in analysis.verdicts}


def same_options(problem: Problem, margin: Margin, value: Fraction) -> bool:
    """Whether the edit leaves the alternatives apart: two that become one are one option in the file."""
    try:
        changed = edited(problem, **{margin.path: value_text(margin, value)})
    except Exception:  # noqa: BLE001 (an option given twice is refused)
        return False
    return [len(item.options) for item in changed.space.decisions] == [
        len(item.options) for item in problem.space.decisions
    ]


@pytest.mark.parametrize("name", [*NAMES, *([] if LONG else ["inmark"])])
def test_margins_agree_with_analyse(name: str) -> None:
    """By `dse analyse` of the edited file the last value holds, the first that breaks does; nothing sooner."""
    problem = example(name)
    decisions = design_of(problem.space)
    stated = {"rules": [], "processing": problem.space.processing}  # margins are about requirements
    problem = loads(effective_text({**merged_data(problem), **stated}))
    function = function_of(problem, decisions)
    broken = set(broken_texts(function))
    step = 1 if LONG else {"starter": 1, "inmark": 15, "inmark_chapter3": 4}.get(name, 2)
    reached = reaches(function, _held(function))
    variables = [item for item in function.inputs.variables if reached(item)]
    found = [_margin(function, item, reached(item)) for item in variables[::step]]
    assert function.applies and (step > 1 or tuple(found) == margins(function))
    looked = 0
    for margin in found:
        for side in (margin.below, margin.above):
            if side is None:
                continue
            looked += _agrees(problem, margin, side, decisions, broken)
    assert looked > 3


def _agrees(problem: Problem, margin: Margin, side: Break, decisions: dict[str, str], broken: set[str]) -> int:
    step = Fraction(1, 10**6) * (1 if side.last > margin.nominal else -1)
    first = side.first if side.first is not None else side.last + step
    if not all(same_options(problem, margin, value) for value in (side.last, first)):
        return 0
    holding = verdicts(analysed(problem, margin, side.last, decisions))
    breaking = verdicts(analysed(problem, margin, first, decisions))
    assert all(good for text, good in holding.items() if text not in broken), (margin, side)
    assert not breaking[side.requirement], (margin, side)
    halfway = (margin.nominal + side.last) / 2
    halfway = Fraction(round(halfway)) if side.first is not None else halfway
    if same_options(problem, margin, halfway):
        between = verdicts(analysed(problem, margin, halfway, decisions))
        assert all(good for text, good in between.items() if text not in broken)
    return 1


@pytest.mark.parametrize("name", NAMES)
def test_scaling_agrees_with_analyse(name: str) -> None:
    """A little less holds, a little more breaks the requirement that is named."""
    problem = example(name)
    decisions = design_of(problem.space)
    function = function_of(problem, decisions)
    found = scaling(function)
    if found.factor is None:
        pytest.skip("nothing breaks")
    broken = set(broken_texts(function))
    data = merged_data(problem)
    inputs = Inputs(data)
    paths = [path for path in inputs.groups if path.endswith(("compute_execution_time", "callback_execution_time"))]
    for times, good in ((Fraction(9999, 10000), True), (Fraction(10001, 10000), False)):
        changed = copied(data)
        for path in paths:
            inputs.scale(changed, path, found.factor * times)
        said = verdicts(analyse(loads(effective_text(changed)), decisions))
        assert said[found.requirement] == good
        assert not good or all(value for text, value in said.items() if text not in broken)


def test_bars_are_the_analysis_at_both_ends() -> None:
    problem = example("starter")
    decisions = design_of(problem.space)
    function = function_of(problem, decisions)
    found = bars(function, Fraction(1, 10), {}, function.outputs.names)
    assert found
    for bar in found[:20]:
        variable = next(item for item in function.inputs.variables if item.path == bar.path)
        for end, value in zip(bar.inputs, bar.values, strict=True):
            values = list(function.inputs.nominal)
            values[variable.index] = end
            assert function.analysed(values)[function.outputs.names.index(bar.metric)] == value


@pytest.mark.parametrize("name", NAMES)
def test_functions_are_the_analysis(name: str) -> None:
    """Expressions give exactly what the formulas give, at inputs far from the nominal ones."""
    problem = example(name)
    function = function_of(problem, design_of(problem.space))
    for factor in (Fraction(1, 2), Fraction(7, 3), Fraction(11)):
        values = [max(Fraction(item.least), item.nominal * factor) for item in function.inputs.variables]
        assert function.exact(values) == function.analysed(values)


def with_response_times(folder: Path) -> Problem:
    """The starter with both threads on one core, where they wait for each other."""
    path = written(folder, "starter")
    text = path.read_text(encoding="utf-8").replace("\nname:", "\nprocessing: response_time\nname:", 1)
    text = text.replace("\n    processor: computer", "\n    processor: computer\n    core: 1")
    text = text.replace("requirements:", "requirements:\n  - response time of controller <= 1.2 ms", 1)
    return loads(text.partition("\nbaseline:")[0])


def test_response_times_have_margins_too(tmp_path: Path) -> None:
    """Where figures move in steps: the last value holds by `dse analyse`, the first that breaks does."""
    problem = with_response_times(tmp_path)
    decisions = design_of(problem.space)
    function = function_of(problem, decisions)
    found = margins(function)
    assert any(
        "response time" in side.requirement for item in found for side in (item.below, item.above) if side is not None
    )
    problem = loads(effective_text({**merged_data(problem), "rules": []}))
    looked = 0
    for margin in found:
        for side in (margin.below, margin.above):
            looked += side is not None and _agrees(problem, margin, side, decisions, set())
    assert looked > 10


def test_options_that_a_design_does_not_have_need_no_analysis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A longer period of another option changes no response time: the expressions say so, nothing is analysed again."""
    problem = with_response_times(tmp_path)
    decisions = design_of(problem.space)
    function = function_of(problem, decisions)
    reached = reaches(function, _held(function))
    chosen = [f"threads.{name.removesuffix('.period')}.period" for name in decisions if name.endswith(".period")]
    nearby = function.around_cores
    figures = frozenset().union(*map(nearby.program.variables, nearby.outputs.values()))
    others = [
        item
        for item in function.inputs.variables
        if item.path.partition("[")[0] in chosen and item.index not in figures and reached(item)
    ]
    assert len(others) > 2
    monkeypatch.setattr(function, "compared", lambda *_: pytest.fail("analysed"))
    for variable in others:
        assert _margin(function, variable, reached(variable)).above is None


def test_response_times_have_a_factor_too(tmp_path: Path) -> None:
    """A little less holds, a little more breaks what is named; the numbers on the way stay short."""
    problem = with_response_times(tmp_path)
    function = function_of(problem, design_of(problem.space))
    found = scaling(function)
    assert found.factor is not None and found.factor.denominator < 10**30
    moving = [item.index for item in function.inputs.variables if "execution_time" in item.path]
    for times, good in ((Fraction(9999, 10000), True), (Fraction(10001, 10000), False)):
        values = list(function.inputs.nominal)
        for index in moving:
            values[index] *= found.factor * times
        said = {function.outputs.texts[bound.requirement] for bound in function.broken(function.analysed(values))}
        assert (found.requirement not in said) == good and (not good or not said)


def test_expressions_of_response_times_are_the_analysis(tmp_path: Path) -> None:
    """Between the jumps of a response time expressions apply; at other inputs new ones are made."""
    problem = with_response_times(tmp_path)
    function = function_of(problem, design_of(problem.space))
    assert any(guard[0] in STEPS for guard in function.programs[0].guards)
    for factor in (Fraction(1), Fraction(1000001, 1000000), Fraction(3, 2), Fraction(5)):
        values = [item.nominal * (factor if item.unit else 1) for item in function.inputs.variables]
        assert function.exact(values) == function.analysed(values)


def test_a_busy_period_of_thousands_of_jobs_is_computed_and_not_remembered() -> None:
    """A core that is nearly full has a busy period without end, nearly: expressions of it would only be slow."""
    problem = loads(
        "dse: 1\nname: full\nprocessing: response_time\nprocessor_types: {board: {}}\n"
        "processors: {main: {type: board}}\nthreads:\n"
        "  a: {processor: main, period: 10 ms, compute_execution_time: 1 ms}\n"
        "  b: {processor: main, period: 7.1303 ms, compute_execution_time: 1 ms}\n"
        "connections: {c: {from: a, to: b}}\nflows: {f: {path: [a, b]}}\nobjectives: [minimise latency of f]\n"
    )
    function = function_of(problem, {})
    full = [
        item.nominal * (5 if item.path.startswith("threads.a.comp") else 1)
        if not item.path.startswith("threads.b.comp")
        else item.nominal * Fraction(3565149993, 10**9)
        for item in function.inputs.variables
    ]
    assert function.exact(full) == function.analysed(full)
    assert len(function.programs) == 1
    moving = {item.index: item for item in function.inputs.variables if "execution_time" in item.path}
    columns = {
        index: numpy.array([float(item.nominal), float(full[index]), float(item.nominal) * 1.2])
        for index, item in moving.items()
    }
    drawn = function.sampled(columns, 3)
    for sample in range(3):
        values = [
            Fraction(float(columns[item.index][sample])) if item.index in moving else item.nominal
            for item in function.inputs.variables
        ]
        expected = [float(value) for value in function.analysed(values)]
        found = [float(item[sample]) if isinstance(item, numpy.ndarray) else float(item) for item in drawn]
        assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["starter", "response times", "inmark"])
def test_a_way_is_the_analysis_of_its_places(tmp_path: Path, name: str) -> None:
    """Only what an input reaches is computed anew: the same verdicts and gaps as from the whole analysis."""
    problem = with_response_times(tmp_path) if name == "response times" else example(name)
    function = function_of(problem, design_of(problem.space))
    for variable in function.inputs.variables[:: 18 if name == "inmark" else 3]:
        way = LineComparisons(function, {variable.index: Fraction(1)}, function.outputs.bounds)
        for factor in (Fraction(1, 1000), Fraction(1, 2), Fraction(99, 100), Fraction(1), Fraction(3), Fraction(400)):
            place = max(variable.nominal * factor, Fraction(variable.least))
            place = place if variable.unit else Fraction(round(place))
            outputs = function.analysed(way.values(place))
            assert way.broken(place) == function.broken(outputs)
            for bound in function.outputs.bounds:
                gap = outputs[bound.limit] - outputs[bound.value]
                if bound == function.core_bound(bound.requirement):  # of another partition that holds as well
                    assert (way.gap(place, bound) < 0) == (gap < 0)
                else:
                    assert way.gap(place, bound) == gap


@pytest.mark.parametrize("wanted", ["7", "1.5", "0.001", "40"])
def test_traced_numbers_say_where_their_integers_hold(wanted: str) -> None:
    """Floor, ceiling and quotient, against plain fractions; taking a number apart binds what follows to it."""
    value, other = Fraction(7, 2), Fraction(wanted)
    for operation in (
        math.floor,
        math.ceil,
        lambda item: item // 2,
        lambda item: 20 // item,
        lambda item: -(-item // 3),
    ):
        with watching() as guards:
            result = operation(Traced(value, ExpressionNode("var", (), 0)))
        assert result == operation(value)
        program = Program([Fraction(result)], guards)
        assert program.holds(program.run([value]))
        assert bool(program.holds(program.run([other]))) == (operation(other) == result)
    with watching() as guards:
        assert Fraction(Traced(value, ExpressionNode("var", (), 0))) == value
    assert not Program([], guards).holds(Program([], guards).run([other]))
