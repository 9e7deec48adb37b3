"""Response times over a box of inputs: variables of their own, which rise with what is executed and sent.

Where each thread keeps its core and its place among the priorities, the response time of fixed-priority scheduling
never falls when an execution time, a blocking time or a release jitter grows: the busy period of the longer jobs holds
that of the shorter ones (J. P. Lehoczky, RTSS 1990; N. Audsley et al., Software Engineering Journal 8(5), 1993), and so
does the least fixed point of response times and the jitter that they pass on (K. Tindell and J. Clark, 1994). The same
holds of executors, reservations and segments (docs/semantics.md, sections 4.6 to 4.8): their bounds too are the
greatest, over jobs, of a least time by which all that is demanded until then is done, and longer jobs and more jitter
demand more. It holds of messages that wait for a bus, too (section 5.4): their bounds are the greatest over jobs of
such times, or the lesser of two of them, and transmissions and a bit of the wire are demanded as execution is. A
response time grows at least as fast as the thread's own longest execution time (a message's longest transmission),
which is all in its last job. So the jitter that is passed on, response time less shortest time, grows too where the
longest time grows no slower than the shortest. Over the box a response time lies between those at the two corners where
all of these are least and most, and its derivative is at least that of the own longest time: enough for the signs of
`dse.questions.robust.worst_case`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dse.analysis.binding import transmission_ns
from dse.analysis.messages.stages import bus_of, counted_buses, identifier_range
from dse.analysis.scheduling.busy_window import TaskKey
from dse.analysis.scheduling.fixed_point import solve
from dse.analysis.scheduling.model import EndKey, Stage
from dse.analysis.scheduling.order import Schedule, Turn
from dse.analysis.scheduling.policies.coupled import behind_next, releaser_on_core
from dse.analysis.scheduling.resolve import resolve, resolve_buses
from dse.analysis.scheduling.responses import UNBOUNDED_NS, all_responses, counted_ns, messages_of
from dse.analysis.scheduling.tasks import alone_ns, elapsed_ns
from dse.analysis.views import View
from dse.questions.robust.worst_case import Box, Corner, Worst, remedies_of
from dse.questions.sensitivity.design_function import DesignFunction, OutputComparison
from dse.questions.sensitivity.inputs import InputSpace, Values
from dse.questions.sensitivity.intervals import (
    INFINITE,
    ZERO,
    Further,
    Interval,
    NotProvedError,
    combined,
    seeds_of,
    slopes_over,
    undecided_over,
    values_over,
)
from dse.questions.sensitivity.traced_numbers import (
    MOST_GUARDS,
    ExpressionNode,
    Program,
    TooManyGuardsError,
    Traced,
    watching,
)
from dse.space.architecture.chains import follows
from dse.space.model.space import Design, Space
from dse.space.model.trees import at
from dse.support.units import is_unbounded

Responses = Mapping[EndKey, Any]


class ScheduledFunction(DesignFunction):
    """A design's figures as functions of the inputs and of its response times, which follow from the inputs.

    Response times are solutions of a fixed point and have no expression; they enter as further variables whose ranges
    and directions are known.
    """

    def __init__(self, inputs: InputSpace, design: Design, motion: Motion, box: Box) -> None:
        self._known: tuple[Values, Responses] = ((), {})
        low, high = (box.values(inputs.nominal, corner) for corner in (motion.least, motion.most))
        least, most = (_ends(inputs.at(values), design) for values in (low, high))
        ends = {key: (_counted(least[key]), _counted(most[key])) for key in sorted(least, key=_order)}
        self.keys = tuple(ends)
        """The tasks that have response times."""
        changing = any(is_unbounded(latest) and not is_unbounded(soonest) for soonest, latest in ends.values())
        self.top = motion.most if changing else None
        """The corner where some response time has no bound that has one elsewhere in the box, if there is one."""
        self.counts_bounded_inputs = motion.counts_bounded_inputs
        """Whether the jobs of some thread are counted by an input that has a bound (docs/semantics.md, section 3.8)."""
        super().__init__(inputs, design, cores=False)
        self.further = tuple(motion.response(key, ends[key]) for key in self.keys)

    def inputs_of(self, values: Values) -> Values:
        """The values of the inputs with the response times that follow from them.

        The inputs first, then a response time in ns for each task in the order of `keys`; `UNBOUNDED_NS` stands for one
        without a bound.
        """
        responses = self._responses(values)
        return (*values, *(_counted(responses[key]) for key in self.keys))

    def view_of(self, values: Values, *, traced: bool) -> View:
        """A view of the design that knows its response times, traced as variables of their own.

        The response times are put into the view's memo, so that formulas of latency do not compute them again.
        """
        view = super().view_of(values, traced=traced)
        responses = self._responses(values)
        if traced:
            first = len(self.inputs.variables)
            responses = {key: _variable(responses[key], number) for number, key in enumerate(self.keys, first)}
        view.memo["responses"] = view.memo["message ends"] = responses
        return view

    def _responses(self, values: Values) -> Responses:
        if self._known[0] != tuple(values):
            self._known = (tuple(values), _ends(self.inputs.at(values), self.design))
        return self._known[1]

    def broken_without_bound(self, box: Box) -> list[tuple[OutputComparison, Worst]]:
        """The comparisons at the corner where some response time has no bound, if this violates one; else nothing.

        An unbounded response time breaks every limit that contains it, at the corner where all times are longest. The
        list is empty when all response times are bounded in the box.

        Raises
        ------
        NotProvedError
            when a thread that waits for several inputs may come less often where one of these has no bound.
        """
        if self.top is None:
            return []
        outputs = self.analysed(box.values(self.inputs.nominal, self.top))
        worsts = [(bound, Worst(self.top, outputs[bound.value], outputs[bound.limit])) for bound in self.outputs.bounds]
        if not self.broken(outputs) and self.counts_bounded_inputs:
            raise NotProvedError(
                "a response time has no bound in part of the stated ranges, where the jobs of a thread that waits for "
                "all its inputs are counted by another one of these"
            )
        return worsts if self.broken(outputs) else []


def _ends(space: Space, design: Design) -> Responses:
    """The response times of all tasks of a design, and of its messages as latencies count them."""
    view = View(design)
    messages = messages_of(space, view).ends if counted_buses(space) else {}
    return {**all_responses(space, view), **{key: end for key, end in messages.items() if key[1] == "message"}}


def _order(key: EndKey) -> tuple[int, str]:
    return key[0], str(key[1:])


def _variable(response_ns: Any, number: int) -> Any:
    """A response time as a variable; one without a bound stays as it is, and what is made of it is of such places."""
    variable = Traced(_counted(response_ns), ExpressionNode("var", (), number))
    return None if response_ns is None and variable >= UNBOUNDED_NS else variable  # which is a guard


def _counted(response_ns: Any) -> Fraction:
    return Fraction(0) + counted_ns(response_ns)


@dataclass(frozen=True)
class Motion:
    """The dependence of a design's response times on the uncertain inputs."""

    space: Space
    least: Corner
    most: Corner
    """The corners where every response time is shortest, and longest."""
    signs: tuple[int, ...]
    """For each uncertain input 1 where response times rise with it, -1 where they fall, 0 where they do neither."""
    own: Mapping[TaskKey, tuple[Interval, ...]]
    """The slopes of each task's longest execution time, or transmission, in each of them."""
    counts_bounded_inputs: bool
    """Whether some thread waits for several inputs, and an input that has no bound decides nothing."""

    def response(self, key: EndKey, ends: Interval) -> Further:
        """The response time of a task as a variable, from its ends: it moves at least as its execution time does.

        The bound of a chain's window moves at least as the execution times of all its threads together.

        `ends` are the shortest and longest response time in ns. The slope in an input has a known sign, and at least
        the slope of the execution time; its other end is infinite.
        """
        tasks = _tasks_of(self.space, key)
        slopes = tuple(
            ZERO
            if ends[0] == ends[1] or not sign
            else (max(Fraction(0), sum(slope[0] for slope in own)), INFINITE)
            if sign > 0
            else (-INFINITE, min(Fraction(0), sum(slope[1] for slope in own)))
            for sign, *own in zip(self.signs, *(self.own[task] for task in tasks), strict=True)
        )
        return Further(ends, slopes)


def motion_of(inputs: InputSpace, design: Design, box: Box) -> Motion | None:
    """The direction in which response times move over the box; None where the theorem does not give it.

    It is known of threads that keep their cores and priorities, and of messages that keep their order, where execution
    and transmission times may vary.

    Raises
    ------
    NotProvedError
        when some response times may rise and others fall with an input, or there are too many comparisons.
    """
    ranges = box.ranges(inputs.nominal)
    space, view = inputs.at(inputs.nominal, traced=True), View(design)
    with watching() as guards:
        schedule = Schedule(space, view)
        turns = [turn for *_, core in schedule.all_cores() for turn in core]
        stages = resolve(space, view).stages
        messages = [stage for key, stage in stages.items() if key[1] == "message"]
        times = [*_times(space, turns, messages, view), *_times_of_senders(space, stages, view)]
        for stage in stages.values():  # of which a shortest time decides how often it comes
            if (before := releaser_on_core(stages, stage)) is not None:
                behind_next(stage, before)  # for its comparisons, which are guards
    program = Program([Fraction(0) + item for pair in times for item in pair], guards)
    if undecided_over(program, ranges):
        return None
    reached = frozenset().union(*map(program.variables, program.outputs))
    others = {item.index for uncertain in box.uncertain for item in uncertain.variables} - reached
    if others and others & _deciding(space, view):
        return None
    values, seeds = values_over(program, ranges), seeds_of(box.uncertain)
    slopes = [slopes_over(program, values, item) for item in seeds]
    signs = tuple(
        _sign(program, one, item.path, remedies_of(space)) for one, item in zip(slopes, box.uncertain, strict=True)
    )
    keys = [*(turn.key for turn in turns), *(stage.key for stage in messages)]
    own = {key: tuple(one[program.outputs[2 * number]] for one in slopes) for number, key in enumerate(keys)}
    ends = (tuple(int(sign * way > 0) for sign in signs) for way in (-1, 1))
    joins = any(item.stored_by is not None or any(room is not None for room in item.rooms) for item in stages.values())
    return Motion(space, next(ends), next(ends), signs, own, joins)


def _tasks_of(space: Space, key: EndKey) -> list[TaskKey]:
    """The tasks that an end is of: one, or the threads of a chain, the last of them first."""
    if isinstance(key[1], str):
        return [(key[0], key[1])]
    numbers = [key[0]]
    while numbers[-1] != key[1]:
        before = follows(space.components, space.connections, numbers[-1])
        assert before is not None, key
        numbers.append(before)
    return [(number, "thread") for number in numbers]


def _times(space: Space, turns: list[Turn], messages: list[Stage], view: View) -> Iterator[tuple[Any, Any]]:
    """The longest and shortest of each time that response times are made of: first of tasks and messages, in order."""
    for number, part in (turn.key for turn in turns):
        is_piece = space.components[number].pieces is not None
        yield (elapsed_ns(space, number, view) if is_piece else alone_ns(space.components[number], part, view))[::-1]
    for stage in messages:
        yield stage.worst_ns, stage.best_ns
    for turn in turns:
        yield turn.blocked_ns, 0
    for stage in messages:
        for release in stage.releases:
            yield release.most_ns - release.least_ns, 0
            yield 0 if release.stream is None else release.stream.jitter_ns, 0
        bus = bus_of(space, stage.key[0], view)
        if bus is not None and at(space.buses[bus].arbitration, view) == "priority":
            yield identifier_range(space, bus, view)[0], 0
    for component in space.components:
        yield alone_ns(component, "thread", view)[::-1]
        for wire in component.triggers:
            least, most, _ = transmission_ns(space, space.connections[wire], view)
            yield most - least, 0


def _times_of_senders(space: Space, stages: Mapping[TaskKey, Stage], view: View) -> Iterator[tuple[Any, Any]]:
    """The longest and shortest times of what sends messages or releases threads and has no response time of its own.

    Those are devices and threads off the processors, and all where response times of threads do not count. A stated
    response time is among them (docs/semantics.md, section 3.2).
    """
    if space.processing != "response_time":
        stages = resolve_buses(space, view).stages if counted_buses(space) else {}
    for (number, part), stage in stages.items():
        is_on_core = part != "message" and at(space.components[number].processor, view) is not None
        if not (is_on_core and space.processing == "response_time"):
            yield stage.elapsed_ns[::-1]


def _sign(program: Program, slopes: list[Interval], path: str, remedies: str) -> int:
    """Which way response times move with an input: the sign of every longest time, and of that less the shortest."""
    outputs = [slopes[number] for number in program.outputs]
    pairs = list(zip(outputs[::2], outputs[1::2], strict=True))
    moves = [longest for longest, _ in pairs] + [combined("-", *pair) for pair in pairs]
    rises, falls = all(low >= 0 for low, _ in moves), all(high <= 0 for _, high in moves)
    if not rises and not falls:
        raise NotProvedError(
            f"response times may rise and fall with {path}; no end of its range is the worst: state one value{remedies}"
        )
    return 0 if rises and falls else 1 if rises else -1


def _deciding(space: Space, view: View) -> frozenset[int]:
    """The variables that response times depend on in any way."""
    try:
        with watching() as guards:
            guards.most = MOST_GUARDS
            known = solve(resolve(space, view)).ends
    except TooManyGuardsError:
        raise NotProvedError("a figure takes more comparisons than are looked at") from None
    figures = [Fraction(0) + item for item in known.values() if item is not None and item < UNBOUNDED_NS]
    program = Program(figures, guards)
    return frozenset().union(program.deciding, *map(program.variables, program.outputs))
