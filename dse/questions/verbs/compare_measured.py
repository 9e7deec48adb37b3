"""`dse.compare_measured`: a design's prediction against what was measured, and whether its figures have drifted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from math import ceil, floor
from pathlib import Path
from typing import Any, Unpack

from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import HOLDS, Verdict, build_limit
from dse.analysis.rates import rate_hz
from dse.analysis.terms import PPM
from dse.analysis.views import View
from dse.answers.analysis import Analysis, analyse_design
from dse.answers.measured import Input, Kept, MeasuredComparison, Prediction, Seen
from dse.answers.result import decisions_of
from dse.fitting.observed import Observed, read_observed
from dse.importers.registry import importer_of
from dse.importers.ros2.bags import read_bag
from dse.importers.ros2.system import Callback, is_of_topic
from dse.importers.ros2.trace import read_seen
from dse.importers.ros2.yaml_places import ros_name
from dse.questions.problem import Problem, Source, load, with_stated_cores
from dse.questions.question import Decided, Question, decisions_as_texts
from dse.questions.sensitivity.sensitivity import chosen_design
from dse.space.model.space import Design, Space
from dse.space.model.trees import at, graft
from dse.space.question.metrics import QuestionError
from dse.space.question.reading import read_requirements
from dse.space.question.unchecked import refuse_unchecked
from dse.spec.language.scan import ExpressionError
from dse.spec.schema.model import Spec, Thread
from dse.support import arguments
from dse.support.errors import Diagnostic, ProblemError, UsageError, did_you_mean
from dse.support.units import (
    DATA,
    FREQUENCY,
    TIME,
    UNITS,
    Dimension,
    TimeRange,
    UnitError,
    canonical_unit,
    format_number,
    parse_ratio,
)

INPUTS = ("execution time", "callback execution time", "period", "rate", "data size")
"""What is held against what the file states, not against a metric."""


@arguments.checked(also=Question.__annotations__, files=arguments.paths, tolerance=arguments.text)
def compare_measured(
    problem: Source,
    *files: str | Path,
    design: Decided = None,
    tolerance: str = "1 %",
    **question: Unpack[Question],
) -> MeasuredComparison:
    r"""A design's prediction against what was measured.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    files
        CSV with samples of metrics (``metric,sample_ms`` with ``latency of steering``; ``flow,latency_ms``) and of
        what the file states: ``execution time``, ``period`` or ``rate`` of a thread or device, ``rate`` or
        ``data size`` of a connection; traces of ros2_tracing, and bags.
    design
        decisions by name (or texts ``name = option``) or a point of a front, on top of the baseline; the baseline alone
        when left out.
    tolerance
        how far the mean of periods and rates may be from what is stated, such as ``1 %``.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the problem or a file of measurements is wrong, with every mistake.
    UsageError
        when the design is none, or the tolerance is no share.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> path = Path("seen.csv")
    >>> written = path.write_text("flow,latency_ms\nsensor_to_valve,5.5\nsensor_to_valve,90\n", encoding="utf-8")
    >>> found = dse.compare_measured("pump.yaml", path, design=best.decisions)
    >>> [(item.name, item.verdict, item.outside) for item in found.predictions]
    [('latency of sensor_to_valve', 'above', 1)]
    """
    try:
        share = parse_ratio(tolerance)
    except UnitError as error:
        raise UsageError(f"--tolerance {tolerance}: {error}") from error
    if not files:
        raise UsageError("name a file of measurements")
    paths = [Path(item) for item in files]
    observed, unused = read_observed([path for path in paths if not _is_recording(path)])
    texts = decisions_as_texts(design)
    problem_asked = with_stated_cores(load(problem).ask(**question), texts)
    chosen = chosen_design(problem_asked.space, list(texts))
    bench = _Bench(problem_asked, chosen, share)
    for path in filter(_is_recording, paths):
        shown, others = _read_recording(path, problem_asked.loaded.spec)
        if not shown:
            raise UsageError(f"{path}: nothing in it is of this problem ({'; '.join(others)})")
        observed += shown
        bench.remarks += others
    for item in _merged(observed):
        try:
            bench.hold(item)
        except (_UnknownError, ExpressionError, QuestionError) as error:
            file, _, line = item.place.rpartition(":")
            hint = error.hint if isinstance(error, _UnknownError) else ""
            words = str(error).removeprefix(f"{item.text}: ")
            bench.mistakes.append(Diagnostic(f"{item.words}: {words}", "", file, int(line), hint=hint))
    if bench.mistakes:
        raise ProblemError(bench.mistakes)
    columns = [f"columns that say nothing for this: {', '.join(unused[:12])}"] if unused else []
    return MeasuredComparison(
        problem=problem_asked.name,
        files=tuple(str(item) for item in files),
        decisions=decisions_of(problem_asked.space, chosen),
        tolerance=share,
        currency=problem_asked.space.currency,
        predictions=tuple(bench.predictions),
        inputs=tuple(bench.inputs),
        requirements=tuple(bench.kept()),
        remarks=(*columns, *bench.remarks),
    )


def _merged(observed: Sequence[Observed]) -> list[Observed]:
    """Each figure once: what several files and recordings say of it counts together."""
    merged: dict[tuple[str, str, bool], Observed] = {}
    for item in observed:
        key = (item.figure, item.name, UNITS[canonical_unit(item.unit)][1] == FREQUENCY)
        merged[key] = merged[key].merged(item) if key in merged else item
    return list(merged.values())


class _UnknownError(Exception):
    """There is nothing to hold a measurement against."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class _Stated:
    """A figure of the space: the fields of its part that hold it (none where it follows), its ends, and its unit."""

    section: str
    number: int
    fields: tuple[str, ...]
    low: Fraction
    high: Fraction
    unit: str
    dimension: Dimension


class _Bench:
    """Holds observations against one design."""

    def __init__(self, problem: Problem, design: Design, tolerance: Fraction) -> None:
        self.space, self.design, self.tolerance = problem.space, design, tolerance
        self.view = View(design)
        self.predictions: list[Prediction] = []
        self.inputs: list[Input] = []
        self.remarks: list[str] = []
        self.mistakes: list[Diagnostic] = []
        self.changed = problem.space
        self.held: dict[_Stated, str] = {}
        self.shown: dict[str, tuple[Fraction, Fraction]] = {}

    def hold(self, item: Observed) -> None:
        """Hold one observation against what it is about."""
        if item.figure in INPUTS:
            self._input(item)
        else:
            self._metric(item)

    # --- metrics

    def _metric(self, item: Observed) -> None:
        low = self._limit(item, item.low)
        high = self._limit(item, item.high)
        mean = None if item.mean is None else self._limit(item, item.mean)[2]
        name, value, top, unit = *low[:2], high[2], low[3]
        least = None
        if item.figure == "latency":
            least = self._limit(replace(item, figure="min latency"), item.low)[1]
        seen = Seen(low[2], top, mean, item.count, item.place)
        prediction = Prediction(name, unit, least, value, seen)
        outside = None
        if item.samples:
            scale = top / item.high if item.high else Fraction(1)
            outside = sum(
                sample * scale > value or (least is not None and sample * scale < least) for sample in item.samples
            )
        self.predictions.append(replace(prediction, outside=outside))
        self.shown[name] = low[2], top
        if item.figure == "latency":
            self.shown.setdefault(f"min {name}", (low[2], low[2]))
            self.shown.setdefault(name.replace("latency", "jitter", 1), (top - low[2], top - low[2]))

    def _limit(self, item: Observed, value: Fraction) -> tuple[str, Fraction, Fraction, str]:
        """Name, predicted value, measured value and unit of a metric, the latter as a limit of it would be read."""
        unit = canonical_unit(item.unit)
        text = f"{item.text} <= {format_number(value / UNITS[unit][0])} {unit}"
        requirements = read_requirements(self.space, text)
        if len(requirements) != 1:
            raise _UnknownError("say of which", ", ".join(one.metric.name for one in requirements[:8]))
        limit = build_limit(self.space, requirements[0], counted=False)
        bound = limit.bound(self.view)
        if requirements[0].metric.kind == "utilisation":
            bound = (
                requirements[0].limit.value * PPM
            )  # the sum, in parts of one core: a limit would be that of each core
        return requirements[0].metric.name, limit.measure.value(self.view), bound, limit.measure.unit

    # --- figures of the file

    def _input(self, item: Observed) -> None:
        stated = self._stated(item)
        own = UNITS[canonical_unit(item.unit)][1]
        if own != stated.dimension and {own, stated.dimension} != {TIME, FREQUENCY}:
            raise _UnknownError(f"{item.unit} is no unit of it")

        def scaled(value: Fraction) -> Fraction:
            if own != stated.dimension:
                if not value:
                    raise _UnknownError("0 is no rate, and no period")
                value = 1 / value
            return value * (10**9 if stated.dimension == TIME else 1)

        if stated.fields and (before := self.held.setdefault(stated, item.place)) is not item.place:
            raise _UnknownError(f"that is stated at {before.removesuffix(':0')}, too", "a period or a rate, not both")
        ends = sorted((scaled(item.low), scaled(item.high)))
        mean = None if item.mean is None else scaled(item.mean)
        seen = Seen(ends[0], ends[1], mean, item.count, item.place)
        counted = self._counted(stated, seen)
        name = item.words
        self.inputs.append(Input(name, stated.unit, stated.low, stated.high, seen, counted))
        if counted is not None and stated.fields:
            self.changed = _with(self.changed, stated, self.view, counted)
        elif counted is not None:
            self.remarks.append(f"{name} follows from others in the file: it counts by what is measured of these")

    def _counted(self, stated: _Stated, seen: Seen) -> tuple[Fraction, Fraction] | None:
        """The ends that count where what was measured lies beyond what is stated; None where it does not."""
        if stated.unit == "ns" and "period_ns" not in stated.fields:  # a time range is widened
            low, high = min(stated.low, seen.low), max(stated.high, seen.high)
            return None if (low, high) == (stated.low, stated.high) else (low, high)
        if stated.unit == "B":
            return (seen.high, seen.high) if seen.high > stated.high else None
        middle = seen.mean if seen.mean is not None else (seen.low + seen.high) / 2
        if middle < (1 if stated.unit == "ns" else Fraction(1, 10**9)):
            raise _UnknownError("0 is no rate, and no period")
        return (middle, middle) if abs(middle - stated.high) > self.tolerance * stated.high else None

    def _stated(self, item: Observed) -> _Stated:
        numbers = {component.name: number for number, component in enumerate(self.space.components)}
        wires = {connection.name: number for number, connection in enumerate(self.space.connections)}
        if item.figure == "data size" or (item.figure == "rate" and item.name in wires):
            number = _known(item.name, wires, "connection")
            return self._of_connection(item, number)
        number = _known(item.name, numbers, "thread or device")
        component = self.space.components[number]
        if item.figure in ("period", "rate"):
            period = at(component.period_ns, self.view)
            if period is not None:
                return _Stated("components", number, ("period_ns",), Fraction(period), Fraction(period), "ns", TIME)
            rate = rate_hz(self.space, ("activation", number), self.view)
            return _Stated("components", number, (), Fraction(rate), Fraction(rate), "Hz", FREQUENCY)
        field = "callback_ns" if item.figure == "callback execution time" else "execution_ns"
        tree = at(getattr(component, field), self.view)
        if tree is None:
            raise _UnknownError("the file states none, as far as this design goes")
        return _Stated("components", number, (field,), Fraction(tree.min_ns), Fraction(tree.max_ns), "ns", TIME)

    def _of_connection(self, item: Observed, number: int) -> _Stated:
        connection = self.space.connections[number]
        if item.figure == "data size":
            size = at(connection.size_bytes, self.view)
            if size is None:
                raise _UnknownError("the file states none, as far as this design goes")
            return _Stated("connections", number, ("size_bytes",), Fraction(size), Fraction(size), "B", DATA)
        rate = rate_hz(self.space, ("delivery", number), self.view)
        is_own = at(connection.rate_hz, self.view) is not None
        fields = ("rate_hz",) if is_own else ()
        return _Stated("connections", number, fields, Fraction(rate), Fraction(rate), "Hz", FREQUENCY)

    # --- requirements

    def kept(self) -> list[Kept]:
        """Each requirement with the figures of the file, and with what was measured where that lies beyond them."""
        before, after = _analysed(self.space, self.design), _analysed(self.changed, self.design)
        return [
            Kept(
                one.requirement.shown,
                one.unit,
                other.limit,
                (one.value, other.value),
                (one.slack, other.slack),
                (one.holds, other.holds),
                *self._observed(one),
            )
            for one, other in zip(before.verdicts, after.verdicts, strict=True)
        ]

    def _observed(self, verdict: Verdict) -> tuple[Fraction, bool] | tuple[None, None]:
        """The measured end of the metric itself that the requirement looks at, and whether that keeps it."""
        operator = verdict.requirement.operator
        ends = self.shown.get(verdict.requirement.metric.name)
        if ends is None or operator not in ("<=", "<", ">=", ">"):
            return None, None
        value = ends[1] if verdict.requirement.is_upper else ends[0]
        if verdict.requirement.metric.kind != "utilisation":
            return value, HOLDS[operator](value, verdict.limit)
        holds = HOLDS[operator](value, verdict.whole_limit)
        if holds and verdict.whole_limit != verdict.requirement.limit.value * PPM:
            return None, None  # which core takes how much of the sum was not measured
        return value, holds


def _analysed(space: Space, design: Design) -> Analysis:
    refuse_unchecked(space)
    analysis = analyse_design(Evaluator(space), design)
    if analysis.breaches:
        raise UsageError(f"with the measured figures the design is not valid: {'; '.join(analysis.breaches)}")
    return analysis


def _known(name: str, names: Mapping[str, int], kind: str) -> int:
    if name not in names:
        raise _UnknownError(f"there is no such {kind}", did_you_mean(name, names, 0.5))
    return names[name]


def _with(space: Space, stated: _Stated, view: View, ends: tuple[Fraction, Fraction]) -> Space:
    """The space with another figure where the design has the stated one."""
    parts: list[Any] = list(getattr(space, stated.section))
    part = parts[stated.number]
    changes: dict[str, Any] = {}
    for name in (*stated.fields, *(("stated_period_ns",) if "period_ns" in stated.fields else ())):
        tree = getattr(part, name)
        old = at(tree, view)
        new: Any = ends[1] if name == "rate_hz" else max(1, round(ends[1]))
        if isinstance(old, TimeRange):
            new = TimeRange(floor(ends[0]), ceil(ends[1]))
        changes[name] = graft(tree, partial(_in_place_of, old, new))
    parts[stated.number] = replace(part, **changes)
    if stated.section == "components":
        return replace(space, components=tuple(parts))
    return replace(space, connections=tuple(parts))


def _in_place_of(old: Any, new: Any, leaf: Any) -> Any:
    return new if leaf == old else leaf


# What traces and bags show of a problem: execution times and periods of its threads, rates and sizes of its topics.


BAGS = (".mcap", ".db3", ".bag")
NS = 10**9


def _is_recording(path: Path) -> bool:
    """Whether it is a trace or a bag, rather than a table."""
    return _is_trace(path) or path.suffix.lower() in BAGS or (path.is_dir() and (path / "metadata.yaml").is_file())


def _is_trace(path: Path) -> bool:
    importer = importer_of(path)
    return importer is not None and importer.name == "trace"


def _read_recording(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    """The observations of a trace or bag about the threads and connections of a problem, and remarks on the rest.

    Callbacks are found by their node (the process of the thread, or its name in `ros2`) and their period or topic;
    topics by the name that an import gives their connection: ``/front/image`` is ``front.image``.

    Raises
    ------
    ProblemError
        when it is none, or damaged.
    UsageError
        when the library that reads it is not installed.
    """
    return _of_trace(path, spec) if _is_trace(path) else _of_bag(path, spec)


def _summary(figure: str, name: str, path: Path, values: Sequence[int], unit: str, scale: int) -> Observed:
    observed = Observed(figure, name, f"{path}:0", unit, Fraction(min(values), scale), Fraction(max(values), scale))
    observed.count, observed.total = len(values), Fraction(sum(values), scale)
    return observed


def _of_trace(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    observed: list[Observed] = []
    others: list[str] = []
    for one in read_seen(path):
        names = _threads_of(one, spec)
        if len(names) != 1:
            others.append(one.name)
            continue
        observed.append(_summary("execution time", names[0], path, one.durations_ns, "ns", NS))
        gaps = [later - earlier for earlier, later in pairwise(one.starts_ns)]
        if one.period_ns is not None and gaps:
            observed.append(_summary("period", names[0], path, gaps, "ns", NS))
    return observed, [f"callbacks of {path.name} that are no threads here: {', '.join(others)}"[:500]] if others else []


def _threads_of(one: Callback, spec: Spec) -> list[str]:
    """The threads that may be a callback: by name, else by node and period or topic."""
    if ros_name(one.name) in spec.threads:
        return [ros_name(one.name)]
    nodes = spec.ros2.nodes if spec.ros2 is not None else {}
    own = {
        name: thread
        for name, thread in spec.threads.items()
        if any(nodes.get(process, f"/{process.replace('.', '/')}") == one.node for process in thread.process or (name,))
    }
    if one.topic:
        return [name for name in own if name in set(_targets(one.topic, spec))]
    return _timers(one, own)


def _timers(one: Callback, own: dict[str, Thread]) -> list[str]:
    timers = [name for name, thread in own.items() if thread.period]
    same = [name for name in timers if one.period_ns in (own[name].period or ())]
    return same or (timers if len(timers) == 1 else [])


def _wires_of(topic: str, spec: Spec) -> Iterator[str]:
    """The connections that an import names by a topic."""
    return (wire for wire, stated in spec.connections.items() if is_of_topic(wire, stated.port, topic))


def _targets(topic: str, spec: Spec) -> Iterator[str]:
    for wire in _wires_of(topic, spec):
        to = spec.connections[wire].to
        if to is not None:
            yield to


def _of_bag(path: Path, spec: Spec) -> tuple[list[Observed], list[str]]:
    observed: list[Observed] = []
    others: list[str] = []
    for topic in read_bag(path):
        wires = list(_wires_of(topic.name, spec))
        if not wires:
            others.append(topic.name)
        for wire in wires:
            size = Observed("data size", wire, f"{path}:0", "B", Fraction(topic.least), Fraction(topic.most))
            size.count, size.total = topic.count, Fraction(topic.mean) * topic.count
            observed.append(size)
            if topic.mean_ns and topic.shortest_ns is not None and topic.longest_ns is not None:
                ends = Fraction(max(1, topic.shortest_ns), NS), Fraction(max(1, topic.longest_ns), NS)
                rate = Observed("rate", wire, f"{path}:0", "ns", *ends)
                rate.count, rate.total = topic.count - 1, Fraction(topic.mean_ns) / NS * (topic.count - 1)
                observed.append(rate)
    return observed, [
        f"topics of {path.name} that are no connections here: {', '.join(others)}"[:500]
    ] if others else []
