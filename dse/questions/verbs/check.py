"""`dse.check`: a valid problem's space, described; and what a careful reader would remark."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar, Unpack

from dse.analysis.bounds import Ends, Impossible, impossible, largest
from dse.analysis.diagnosis.remarks import problem_remarks
from dse.analysis.evaluate import Evaluator
from dse.analysis.measures import counted_decisions
from dse.analysis.validity import slot_users
from dse.answers.base import Answer
from dse.answers.question_data import OF_SPACE
from dse.questions.problem import Problem, Source, load
from dse.questions.question import Question
from dse.space.architecture.activation import exclusions
from dse.space.model.flows import UnreadFlow
from dse.space.model.metric_kinds import asks_for_changes
from dse.space.model.space import Component, Decision, Slot, Space
from dse.space.model.trees import leaves
from dse.space.properties import mentions
from dse.space.question.implied import overload_needed
from dse.space.question.metrics import busy_obstacle
from dse.space.question.rules import unoffered_types
from dse.space.size import space_size
from dse.spec.quantities.rounding import rounded_figures
from dse.support import arguments
from dse.support.errors import EXIT_COMPLETE, EXIT_INVALID, TooLargeError
from dse.support.json_fields import Data, Json, Of, Unit
from dse.support.timelimit import OutOfTime, TimeLimit, look_at_the_clock, until
from dse.support.units import TimeRange
from dse.support.units.text import count_words, first_of, writable

if TYPE_CHECKING:
    import pandas


T = TypeVar("T")
TIME_S = 10.0
"""Seconds that each of the questions beside the form of the file may take: bounds, exact sums, remarks."""
MOST_ROUNDED = 20
"""The most figures of which is said one by one that they are rounded."""
DEMANDS_OF_ONE = ("data_size", "overhead", "non_preemptive", "context_switch")
"""Fields of demands that have no range: of several values the largest stands for all."""
ONE_TAKEN = "of which the search takes one"
MOST_NAMES = 10
"""The most decisions that one remark names."""


class OutOfReach(Data):
    """A requirement that no design meets, as bounds alone show; it has either `least` or `most`."""

    JSON_NAME = "Impossible"

    requirement: Annotated[str, "In the words of the problem."]
    origin: Annotated[str, "Where it stands."]
    least: Annotated[str, "The least value that any design can have, an exact number as text.", Json(default="")]
    most: Annotated[str, "The greatest value that any design can have, an exact number as text.", Json(default="")]
    limit: Annotated[str, "The limit, an exact number as text."]
    unit: Annotated[Unit, "What the figures count."]


@dataclass(frozen=True, repr=False)
class Description(Answer):
    """The outcome of `dse check`: the space of a valid problem.

    `impossible` are requirements and deadlines that no design meets, as bounds alone show, each with its place and both
    figures; there may be others. `too_large` says which sum the search cannot count exactly, with its place, where it
    would refuse the problem for that.

    Examples
    --------
    >>> import dse
    >>> [decision.name for decision in dse.check("pump.yaml").decisions][:2]
    ['computer.type', 'can0.type']
    """

    FORMAT = "check"
    WRITTEN = (
        Of("space.name", "The name of the problem.", key="problem"),
        "valid",
        *OF_SPACE,
        *("size", Of("options", key="decisions"), "flows", "requirements", "implied", "rules", "objectives"),
        *(Of("out_of_reach", key="impossible"), "too_large", "unread", "remarks"),
    )

    space: Space
    decisions: tuple[Decision, ...]
    size: Annotated[int, "The number of designs that the decisions make at most.", Json("space_size")]
    remarks: Annotated[tuple[str, ...], "What a careful reader would remark."]
    impossible: tuple[Impossible, ...] = ()
    too_large: Annotated[
        str, "Which sum the search cannot count exactly, where it refuses the problem for that.", Json(default="")
    ] = ""

    @property
    def exit_code(self) -> int:
        """The exit code of the command line: 3 where `dse solve` refuses the problem.

        0 for a problem that `dse solve` accepts; 3 where the space is too large or a requirement cannot be checked.
        """
        return EXIT_INVALID if self.too_large or self.space.unchecked else EXIT_COMPLETE

    @property
    def unread(self) -> Annotated[tuple[UnreadFlow, ...], Json(default=[])]:
        """The flows of the model that its import could not follow; `dse solve` refuses a problem that limits one.

        `UnreadFlow` entries with the flow's name and the reason; empty for problem files that were not imported.
        """
        return self.space.unread

    def _verdict(self) -> str:
        size = f"{count_words(len(self.decisions), 'decision')}, at most {count_words(self.size, 'design')}"
        remarks = f", {count_words(len(self.remarks), 'remark')}" if self.remarks else ""
        return f"{'too large' if self.too_large else 'valid'}, {size}{remarks}"

    def frame(self) -> pandas.DataFrame:
        """The open decisions; columns ``decision`` and ``options``, one text.

        One row for each open decision, in the order of the file; options are separated by ", ".
        """
        import pandas

        rows = [[item.name, ", ".join(item.options)] for item in self.decisions]
        return pandas.DataFrame(rows, columns=["decision", "options"])

    @property
    def valid(self) -> Literal[True]:
        """A problem with mistakes has no description.

        Always true in the JSON of `dse check`: mistakes are reported as a list of diagnostics instead of a description.
        """
        return True

    @property
    def options(self) -> Mapping[str, Sequence[str]]:
        """The options of each open decision, in the order of the file.

        Names of decisions to names of options; decisions with one option are not open and left out.
        """
        return {decision.name: decision.options for decision in self.decisions}

    @property
    def flows(self) -> list[str]:
        """The names of the flows."""
        return [flow.name for flow in self.space.flows]

    @property
    def requirements(self) -> list[str]:
        """The requirements in words.

        Requirements as texts such as ``latency of chain <= 20 ms``, without those that are implied.
        """
        return [item.text for item in self.space.requirements if not item.implied]

    @property
    def implied(self) -> list[str]:
        """The limits that apply without being stated: 100 % of cores, bandwidths and exclusive buses.

        Texts in the form of `requirements`.
        """
        return [item.text for item in self.space.requirements if item.implied]

    @property
    def rules(self) -> list[str]:
        """The rules in words."""
        return [item.text for item in self.space.rules]

    @property
    def objectives(self) -> list[str]:
        """The objectives with their senses.

        Texts such as ``minimise price``, in the order of the question.
        """
        return [f"{item.sense} {item.metric.name}" for item in self.space.objectives]

    @property
    def out_of_reach(self) -> Annotated[list[Mapping[str, str]], Json(kind=list[OutOfReach])]:
        """Requirements that no design meets, as bounds alone show.

        Mappings with ``requirement``, ``origin``, ``limit``, ``unit`` and ``least`` or ``most``, exact numbers as text.
        The bounds come from `dse.analysis.bounds`, without a search.
        """
        return [
            {
                "requirement": item.requirement.text,
                "origin": item.requirement.origin,
                item.side: str(writable(item.value)),
                "limit": str(writable(item.limit)),
                "unit": item.unit,
            }
            for item in self.impossible
        ]


@arguments.checked(also=Question.__annotations__)
def check(problem: Source, **question: Unpack[Question]) -> Description:
    """Validate a problem and describe its space.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        with every mistake in the file.
    UsageError
        when a change does not fit the problem.

    Examples
    --------
    >>> import dse
    >>> dse.check("pump.yaml").size
    768
    """
    problem_asked = load(problem).ask(**question)
    space = problem_asked.space
    decisions = tuple(item for item in space.decisions if item.is_open)
    evaluator, ends = Evaluator(space), Ends(space)
    unread = (f"{item.reason} ({item.origin})" for item in space.unread)
    unfinished: list[str] = []
    impossible_demands = _in_time(impossible(evaluator.limits, ends), unfinished, "which requirements no design meets")
    asked_for = iter(()) if space.unchecked else too_large(evaluator, ends)
    sums = _in_time(asked_for, unfinished, "whether sums stay within exact arithmetic")
    remarks = (
        *unread,
        *_lists_for_ranges(space),
        *_in_time(_remarks(space), unfinished, "what else there is to remark"),
        *_setting_remarks(space),
        *_costs_of_nothing(problem_asked),
        *_rounded(problem_asked),
    )
    return Description(space, decisions, space_size(space), (*sums, *unfinished, *remarks), impossible_demands, *sums)


def _in_time(items: Iterator[T], unfinished: list[str], what: str) -> tuple[T, ...]:
    """The items that are found within `TIME_S`; where that is too short, `unfinished` takes a note of it."""
    finished: list[T] = []
    try:
        with until(TimeLimit.after(TIME_S)):
            finished.extend(items)
    except OutOfTime:
        look_at_the_clock()
        unfinished.append(f"{what} was not found out within {TIME_S:g} s")
    return tuple(finished)


def _setting_remarks(space: Space) -> Iterator[str]:
    """Remarks on stated fields that the settings ignore."""
    there = [item for item in space.components if any(leaf is not None for leaf in leaves(item.deadline_ns))]
    idle = [item.name for item in there if item.processor is None]
    if idle and space.profile == "dse":
        yield f"no deadline counts of what runs on no processor: {', '.join(idle)}"
    if space.profile == "osate-2.2" and space.processing == "response_time":
        yield "profile osate-2.2 counts no response times: `processing: response_time` changes nothing"


def _rounded(problem: Problem) -> Iterator[str]:
    """Remarks on figures that are rounded because there is no finer unit."""
    exact = () if problem.space.profile == "dse" else ("data_size", "type_size", "overhead")
    figures = rounded_figures(problem.loaded)
    rounded = [f"{path}: {note}" for path, note in figures if path.rpartition(".")[2] not in exact]
    yield from rounded[:MOST_ROUNDED]
    if len(rounded) > MOST_ROUNDED:
        yield f"{len(rounded) - MOST_ROUNDED} more figures are rounded"


def _lists_for_ranges(space: Space) -> Iterator[str]:
    """Lists of two ascending demands (times, sizes), which may stand where a range was meant: the search takes one.

    A list that a rule or the baseline names is meant as one.
    """
    remarks: dict[str, None] = {}
    for index, item in enumerate(space.decisions):
        if (
            len(item.values) != 2
            or index in space.baseline
            or any(mentions(rule.text, item.name) for rule in space.rules)
        ):
            continue
        first, second = item.values
        low, high = item.options
        if isinstance(first, TimeRange):
            if first.min_ns == first.max_ns < second.min_ns == second.max_ns:
                remarks[f"{item.name}: two options, {ONE_TAKEN}; a range is written `{low} .. {high}`"] = None
        elif item.field in DEMANDS_OF_ONE and first < second:
            remarks[
                f"{item.name}: two options, {ONE_TAKEN}; where it may be either, state the larger alone: `{high}`"
            ] = None
    yield from remarks


def _limited(space: Space) -> set[tuple[str, int | None]]:
    """The kind and index of every metric that has an upper limit, also by a limit on the greatest of several."""
    limited = set()
    for item in space.requirements:
        if not item.implied and item.operator in ("<=", "<", "=="):
            alone = [part[0][1] for part in item.metric.operands if len(part) == 1 and item.metric.kind == "max"]
            limited |= {(metric.kind, metric.index) for metric in (item.metric, *alone)}
    return limited


def _idle(space: Space) -> Iterator[str]:
    """Processors, buses and devices that every design has, though none uses them, and what they cost."""
    for slot, users in slot_users(space):
        if not users and not slot.optional and _costs(slot):
            verb = "runs on" if slot in space.processors else "goes over"
            yield f"nothing {verb} {slot.name}, but every design has it and its {_costs(slot)}"
    ends = {end for item in space.connections for end in (item.source, item.target)}
    steps = {step.index for flow in space.flows for step in flow.steps if step.kind == "component"}
    for number, component in enumerate(space.components):
        if component.section == "devices" and number not in ends | steps and _costs(component):
            yield f"no connection or flow uses {component.name}, but every design has it and its {_costs(component)}"


def _costs(part: Slot | Component) -> str:
    """The price, power and totals that a part adds to a design, in words; "" for none."""
    figures = part.figures
    trees = {"price": figures.price_ct, "power": figures.power_mw, **figures.totals}
    return " and ".join(name for name, tree in trees.items() if any(leaf for leaf in leaves(tree)))


ADMITTED = "`overload: allowed` admits designs that overload it"


def _shares(space: Space) -> Iterator[str]:
    """Limits on shares that say less, or lift less, than they seem to."""
    for item in space.requirements:
        if item.metric.kind == "utilisation" and item.operator == "==":
            upper = item.text.replace("==", "<=", 1)
            yield f"{item.text} compares the sum over all cores, not each thread and core: `{upper}` limits these too"
        is_upper = item.is_upper and not item.implied
        if is_upper and (of := overload_needed(space, item, item.limit.value)):
            yield f"{item.text} lifts no implied limit: 100 % applies anyway, unless `overload: allowed` for {of}"


def _remarks(space: Space) -> Iterator[str]:
    limited = _limited(space)
    implied = {(item.metric.kind, item.metric.index) for item in space.requirements if item.implied}
    for number, slot in enumerate(space.processors):
        loaded = any(
            number in set(leaves(item.processor)) for item in space.components if item.execution_ns is not None
        )
        if loaded and ("utilisation", number) not in limited:
            said = "100 % of each core is implied" if ("utilisation", number) in implied else ADMITTED
            yield f"no limit on the utilisation of {slot.name} is stated: {said}"
    for number, bus in enumerate(space.buses):
        bandwidths = [leaf for leaf in leaves(bus.bandwidth_bps) if leaf is not None]
        if bandwidths and not limited & {("load", number), ("busy", number)}:
            said = "100 % of its bandwidth is implied" if ("load", number) in implied else ADMITTED
            yield f"no limit on the load of {bus.name} is stated: {said}"
        obstacle = busy_obstacle(space, number) if any(leaves(bus.exclusive)) else ""
        if obstacle and space.overload == "forbidden" and not bus.overload:
            yield f"the busy time of {bus.name} is not limited, although it is exclusive: it {obstacle}"
    yield from _idle(space)
    yield from problem_remarks(space)
    yield from _shares(space)
    yield from exclusions(space)
    for name in unoffered_types(space):
        for rule in space.rules:
            if mentions(rule.text, name):
                yield f'rule "{rule.text}" names the type {name}, which nothing may have: it is used in no design'
    yield from _uncounted_changes(space)
    if not space.objectives:
        yield "there are no objectives: `dse solve` needs --minimise"


def _uncounted_changes(space: Space) -> Iterator[str]:
    """Remarks on changes that are not counted although changes are an objective or limit, and on unused costs."""
    if asks_for_changes(space):
        counted = {index for index, _, _ in counted_decisions(space)}
        left = [
            item.name
            for index, item in enumerate(space.decisions)
            if item.is_open and index not in counted and index < space.first_open
        ]
        if left:
            names = first_of(left, MOST_NAMES)
            yield f"the baseline leaves {names} open: what a design chooses there is not counted as a change"
    for index in space.cost_of_change:
        item = space.decisions[index]
        if item.is_open and index not in space.baseline:
            yield f"the cost of changing {item.name} is not counted: the baseline does not state it"


def _costs_of_nothing(problem: Problem) -> Iterator[str]:
    """Costs of changing what the file fixes."""
    space = problem.space
    for part, fields in problem.loaded.spec.cost_of_change.items():
        for name in (f"{part}.{field}" for field in fields):
            index = space.decision_index(name)
            if index is None or not space.decisions[index].is_open:
                yield f"the cost of changing {name} is not counted: it is no open decision"


# What `dse solve` will refuse because its sums leave exact arithmetic, found without solving.


SURELY_EXACT = 2**43
"""Sums below this are exact whatever the search makes of them; of others it is asked."""


def too_large(evaluator: Evaluator, ends: Ends) -> Iterator[str]:
    """The first objective or requirement that the search cannot count exactly, with its place, as the search says.

    Raises
    ------
    OutOfTime
        when the limit in force comes before it is known.
    """
    measures = [*evaluator.objectives, *(limit.measure for limit in evaluator.limits)]
    sums = (largest(ends, measure) for measure in measures)
    if all(figure is not None and figure < SURELY_EXACT for figure in sums):
        return
    from dse.encode.model import encode

    try:
        encode(evaluator)
    except TooLargeError as error:
        yield str(error)
