"""The referee: every figure of one design, computed by the analysis alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from dse.analysis.latency.metrics import AT_ONCE, flow_figure_ns
from dse.analysis.latency.rows import counts_responses
from dse.analysis.limits import Limit, Reading, Verdict, build_limit, judge
from dse.analysis.measures import Measure, all_metrics, build_measure
from dse.analysis.memo import Recall
from dse.analysis.messages.stages import counted_buses
from dse.analysis.rates import active_cycle, rate_hz
from dse.analysis.validity import Rulebook, canonical
from dse.analysis.views import View
from dse.space.model.arrivals import CyclicActivation
from dse.space.model.criteria import Metric
from dse.space.model.space import Design, Space
from dse.space.model.trees import NotOffered
from dse.space.question.open_cores import is_scheduled
from dse.support.timelimit import in_time

REMEMBERED = 4096
VIEWS = 512
"""The number of designs of which rates and flows are remembered, for what is asked of them next."""
MANY = 500
"""With more limits than this the figures of a design take a noticeable part of a second."""
SHARED = 256
"""The number of values of a figure that are shared by the designs that agree in what it looks at."""


@dataclass(frozen=True)
class Evaluation:
    """The figures of a design, and its verdicts.

    `objectives` and `metrics` are integers in the counting units of the evaluator's measures, in the order of the
    problem; `breaches` says why the design is not valid, `verdicts` how it meets each requirement.
    """

    design: Design
    objectives: tuple[int, ...]
    breaches: tuple[str, ...]
    verdicts: tuple[Verdict, ...]

    @property
    def is_feasible(self) -> bool:
        """Valid, and every requirement holds."""
        return not self.breaches and all(verdict.holds for verdict in self.verdicts)


class Evaluator:
    """The measures and limits of a space, built once; evaluates designs without a solver.

    `objectives` may stand in for the measures of the space's own objectives, one for each; `further` limits are held
    beside those of its requirements, made limits by `reading`.
    """

    def __init__(
        self,
        space: Space,
        objectives: tuple[Measure, ...] | None = None,
        further: Iterable[Limit] = (),
        reading: Reading = build_limit,
    ) -> None:
        self.space = space
        self.rulebook = Rulebook(space)
        self.objectives: tuple[Measure, ...] = (
            objectives
            if objectives is not None
            else tuple(build_measure(space, item.metric) for item in space.objectives)
        )
        self.limits: tuple[Limit, ...] = (*(reading(space, item) for item in in_time(space.requirements)), *further)
        self._verdicts: Recall[Verdict] = Recall(SHARED)
        self._integers: Recall[int] = Recall(SHARED)
        # response times consult nearly all of a design, and are found together
        self._shares = not counts_responses(space) and not counted_buses(space)
        self._shared_limits = [self._is_shared(item.requirement.metric) for item in self.limits]
        self._views: dict[Design, View] = {}
        self._known: dict[Design, Evaluation] = {}
        self._figures: dict[Design, dict[str, int]] = {}

    @cached_property
    def metrics(self) -> tuple[Measure, ...]:
        """Every metric that a result lists.

        Measures with their integer scale, in the order of `all_metrics`; built on first use.
        """
        return tuple(build_measure(self.space, metric) for metric in in_time(all_metrics(self.space)))

    @cached_property
    def counting_units(self) -> dict[str, str]:
        """The unit in which each metric is counted.

        Names of metrics to units such as ``ns`` or ``1/3 ppm``.
        """
        return {item.metric.name: item.counting_unit for item in self.metrics}

    @cached_property
    def _shared_metrics(self) -> list[bool]:
        return [self._is_shared(item.metric) for item in self.metrics]

    def _is_shared(self, metric: Metric) -> bool:
        """Whether designs share a figure: not one that a design has at once with others, as a flow its ends."""
        return self._shares and metric.kind not in AT_ONCE and not is_scheduled(self.space, metric)

    def _view(self, design: Design) -> View:
        """The view of a design for all that is asked of it, which remembers rates and flows."""
        known_view = self._views.get(design)
        if known_view is None:
            if len(self._views) >= VIEWS:
                self._views.clear()
            known_view = self._views[design] = View(design)
        return known_view

    def find_metrics(self) -> None:
        """Build what a result lists, while there is time.

        Raises `OutOfTime` where the limit in force is over.
        """
        _ = self.metrics

    @property
    def rounded(self) -> tuple[str, ...]:
        """The objectives and metrics that are rounded up because no common unit is fine enough for them.

        Names, each once. A rounded figure is an upper bound that is less than a counting unit per term too high.
        """
        return tuple(dict.fromkeys(item.metric.name for item in (*self.objectives, *self.metrics) if item.rounded))

    def evaluate(self, design: Design) -> Evaluation:
        """Objectives, validity and verdicts of a design (options by decision; unused decisions may hold anything).

        The last evaluations are remembered: a search asks for the same design again and again.
        """
        evaluation = self._known.get(design)
        if evaluation is None:
            evaluation = self._evaluate(design)
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            self._known[design] = evaluation
        return evaluation

    def _evaluate(self, design: Design) -> Evaluation:
        breaches = self.invalid(design)
        if breaches:
            return Evaluation(design, (), tuple(breaches), ())
        view = self._view(design)
        objectives = tuple(measure.integer(view) for measure in self.objectives)
        verdicts = tuple(self._verdict(number, view) for number in in_time(range(len(self.limits))))
        return Evaluation(canonical(self.space, design), objectives, (), verdicts)

    def invalid(self, design: Design) -> list[str]:
        """The reasons why a combination of options is no valid design, in words.

        Sentences; empty for a valid design, which may still violate requirements.
        """
        try:
            breaches = self.rulebook.breaches(design)
        except NotOffered:
            return ["a chosen option is not offered"]
        view = self._view(design)
        try:
            for number in range(len(self.space.components)):
                rate_hz(self.space, ("activation", number), view)
        except CyclicActivation:
            cycle = " -> ".join(self.space.components[number].name for number in active_cycle(self.space, view))
            breaches.append(f"event-triggered components dispatch each other in a cycle and have no rate: {cycle}")
        except NotOffered:
            breaches.append("a chosen option is not offered")
        return breaches

    def metric_values(self, design: Design) -> dict[str, int]:
        """Every metric of a valid design, in its counting unit; the last ones are remembered, as by `evaluate`.

        Names to integers; an unbounded metric has the stand-in of `UNBOUNDED_NS`. At most `REMEMBERED` designs are
        kept.
        """
        figures = self._figures.get(design)
        if figures is None:
            view = self._view(design)
            figures = {
                item.metric.name: self._metric(number, view) for number, item in enumerate(in_time(self.metrics))
            }
            if len(self._figures) >= REMEMBERED:
                self._figures.clear()
            self._figures[design] = figures
        return dict(figures)

    @property
    def is_slow(self) -> bool:
        """Whether the figures of a design take so long that a search finds them while there is time (`weigh`).

        True where response times or waiting for buses count, or with more than `MANY` limits.
        """
        return not self._shares or len(self.limits) > MANY

    def weigh(self, design: Design) -> None:
        """Find, and remember, whatever is asked about a design later: where figures are slow, while there is time.

        Called for each new point of a front, so that writing the answer takes no time at the end.
        """
        if not self.evaluate(design).breaches:
            self.metric_values(design)

    def _verdict(self, number: int, view: View) -> Verdict:
        if not self._shared_limits[number]:
            return self._judged(number, view)
        return self._verdicts.recall(self.space, number, view, lambda *asked: self._judged(*asked[1:]))

    def _judged(self, number: int, view: View) -> Verdict:
        limit = self.limits[number]
        figure_ns = None if limit.is_elsewhere else flow_figure_ns(self.space, limit.requirement.metric, view)
        return judge(limit, view, figure_ns)

    def _metric(self, number: int, view: View) -> int:
        measure = self.metrics[number]
        if not self._shared_metrics[number]:
            return self._integer(measure, view)
        return self._integers.recall(self.space, number, view, lambda *asked: self._integer(measure, asked[2]))

    def _integer(self, measure: Measure, view: View) -> int:
        figure_ns = None if measure.rounded else flow_figure_ns(self.space, measure.metric, view)
        return measure.integer(view) if figure_ns is None else measure.counted(figure_ns)
