"""Observations of a simulation beside the bounds of the analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, ClassVar

from dse.answers.base import Answer
from dse.answers.question_data import OF_SPACE
from dse.answers.tables.frames import unit_frame
from dse.space.model.space import Design, Space
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.support.json_fields import BY_NAME, NULL, Json, Of
from dse.support.units import Exact

if TYPE_CHECKING:
    import pandas

LATENCY = (
    "The latency of a datum runs from the dispatch of the job that produces it in the first component to the first "
    "moment at which the end of the flow has processed it or a newer one that overwrote it (reduced reaction time)."
)

CONTENTION = "they leave out CPU contention"
"""Why bounds of execution times need not hold where threads share cores."""


@dataclass(frozen=True)
class Extreme:
    """An observed extreme, and what shows it again.

    Offsets, drifts and seed reproduce the run: `dse simulate` with them shows the latency again.
    """

    latency_ns: Annotated[Exact, "The latency."]
    offsets_ns: Annotated[Mapping[str, Exact], "The offset of each timer."]
    drift_ppm: Annotated[Mapping[str, int], "The drift of each clock."]
    execution: Annotated[str, "Mode in which execution times were drawn: random, max or min."]
    seed: Annotated[int, "The seed of the run."]


@dataclass(frozen=True)
class FlowObservation:
    """The observed latencies of a flow against its bounds.

    `latencies` has how often each was seen, in ns. Without an `excuse` an observation outside the bounds is a
    contradiction; with one it is outside all the same.
    """

    JSON_NAME = "ObservedFlow"
    WRITTEN = (
        *("count", "min_ns", "max_ns", Of("shown_mean_ns", key="mean_ns"), "bounds_ns", "scheduled_ns"),
        *("allowance_ns", "outside", Of("is_contradiction", key="contradiction"), "excuse"),
        *(Of("shown_reach", key="reach"), "histogram", "worst", "best"),
    )

    name: str
    latencies: Mapping[Exact, int]
    bounds_ns: Annotated[
        tuple[Annotated[Exact, NULL], Annotated[Exact, NULL]],
        "The analysed minimum and maximum, null where unbounded.",
    ]
    scheduled_ns: Annotated[
        tuple[Annotated[Exact, NULL], Annotated[Exact, NULL]] | None,
        "The bounds with response times as processing times, where threads share cores; these bounds must hold.",
        Json("scheduled_bounds_ns", kind=tuple[Annotated[Exact, NULL], ...] | None),
    ]
    allowance_ns: Annotated[int, "Allowance for drifting clocks in the upper bound."]
    worst: Annotated[Extreme | None, "The greatest latency."]
    best: Annotated[Extreme | None, "The least latency."]
    histogram: Annotated[Sequence[Mapping[str, Exact]], "Histogram of the latencies: counts by interval, in ns."]
    excuse: Annotated[str, NULL, "Why the bounds need not hold for this flow or run."] = ""

    @property
    def count(self) -> int:
        """The number of data that reached the end."""
        return sum(self.latencies.values())

    @property
    def mean_ns(self) -> Fraction | None:
        """The exact mean; None when nothing arrived.

        In ns, from the latencies and how often each occurred.
        """
        total = sum(value * count for value, count in self.latencies.items())
        return Fraction(total, self.count) if self.count else None

    @property
    def outside(self) -> int:
        """The number of latencies outside `bounds_ns`.

        A count of data, whatever the reason, contention that the question does not count included.
        """
        return self._outside(self.bounds_ns)

    @property
    def _claimed_ns(self) -> tuple[Exact, Exact]:
        """The bounds that must hold."""
        return self.bounds_ns if self.scheduled_ns is None else self.scheduled_ns

    def _outside(self, bounds_ns: tuple[Exact, Exact]) -> int:
        least, most = bounds_ns
        return sum(n for value, n in self.latencies.items() if not least <= value <= most + self.allowance_ns)

    @property
    def is_contradiction(self) -> bool:
        """Whether the observation refutes the analysis.

        True where a latency lies outside what the analysis claims for this run and no known reason excuses it.
        """
        return self._outside(self._claimed_ns) > 0 and not self.excuse

    @property
    def outside_words(self) -> str:
        """The sentence on latencies outside the bounds of the question, with the reason; empty where none are.

        Words such as "3 of 200 latencies of main (...)" for the summary of a run.
        """
        if not self.outside:
            return ""
        return f"{self.outside} of {self.count} latencies of {self.name} ({self.excuse or CONTENTION})"

    @property
    def reach(self) -> Fraction | None:
        """The part of the analysed range [min, max] that was observed; None when there is nothing to reach.

        A fraction from 0 to 1 that tells how close the simulation came to both bounds; None where nothing arrived or
        minimum and maximum are equal.
        """
        least, most = self._claimed_ns
        if not self.latencies or most == least:
            return None
        return Fraction(max(self.latencies) - min(self.latencies), most - least)

    @property
    def min_ns(self) -> Exact | None:
        """The least latency; null where nothing arrived."""
        return min(self.latencies, default=None)

    @property
    def max_ns(self) -> Exact | None:
        """The greatest latency; null where nothing arrived."""
        return max(self.latencies, default=None)

    @property
    def shown_mean_ns(self) -> float | None:
        """The mean; null where nothing arrived."""
        return None if self.mean_ns is None else round(float(self.mean_ns), 3)

    @property
    def shown_reach(self) -> float | None:
        """The part of the analysed range that was observed."""
        return None if self.reach is None else round(float(self.reach), 6)


@dataclass(frozen=True)
class TaskObservation:
    """The longest observed response of a thread on a shared core, or of a message on its bus.

    The longest response in ns, from release to end; `is_compared` is false where the bound need not hold for the run.
    """

    JSON_NAME = "ObservedThread"
    WRITTEN = ("observed_ns", "bound_ns", Of("is_contradiction", key="contradiction"))

    name: str
    observed_ns: Annotated[Exact, "The longest that was observed."]
    bound_ns: Annotated[
        Exact | None, "The analysed response time; null where it has no bound.", Json("response_time_ns")
    ]
    is_compared: bool = True

    @property
    def is_outside(self) -> bool:
        """Whether the observation is longer than the response time, for whatever reason."""
        return self.bound_ns is not None and self.observed_ns > self.bound_ns

    @property
    def is_contradiction(self) -> bool:
        """Whether the observation refutes the analysis.

        False where the bound need not hold for the run, because some threads are dispatched at no stated rate.
        """
        return self.is_compared and self.is_outside

    @property
    def outside_words(self) -> str:
        """The words for a value outside the bound, with the reason; empty where it is inside."""
        if not self.is_outside:
            return ""
        why = "" if self.is_compared else " (some threads are dispatched at no stated rate)"
        return f"the longest response of {self.name}{why}"


@dataclass(frozen=True)
class DisparityObservation:
    """The largest observed difference of age of what a component reads by two flows.

    Ages differ by at most the *disparity*, which the analysis bounds (docs/semantics.md).
    """

    JSON_NAME = "ObservedDisparity"
    WRITTEN = ("observed_ns", "bound_ns", "allowance_ns", Of("is_contradiction", key="contradiction"), "excuse")

    name: str
    observed_ns: Annotated[Exact | None, "The largest that was observed; null where two inputs were never there."]
    bound_ns: Annotated[Exact, NULL, "The disparity by the analysis; null where it is unbounded."]
    allowance_ns: Annotated[int, "Allowance for drifting clocks in the bound."] = 0
    excuse: Annotated[str, NULL, "Why the bound need not hold for this run."] = ""

    @property
    def is_outside(self) -> bool:
        """Whether the observation is beyond the bound, for whatever reason.

        Beyond `bound_ns` by more than `allowance_ns`, both in ns.
        """
        return self.observed_ns is not None and self.observed_ns > self.bound_ns + self.allowance_ns

    @property
    def is_contradiction(self) -> bool:
        """Whether the observation refutes the analysis."""
        return self.is_outside and not self.excuse

    @property
    def outside_words(self) -> str:
        """The words for a value outside the bound, with the reason; empty where it is inside."""
        return f"the disparity of {self.name}{f' ({self.excuse})' if self.excuse else ''}" if self.is_outside else ""


@dataclass(frozen=True, repr=False)
class Simulation(Answer):
    """The outcome of `dse simulate`: what was observed, against what the analysis says.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.simulate("pump.yaml", best.decisions, runs=1)
    >>> found.flows[0].name, found.flows[0].count > 0
    ('sensor_to_valve', True)
    """

    FORMAT = "simulation"
    WRITTEN = (
        Of("space.name", "The name of the problem.", key="problem"),
        *OF_SPACE,
        *("decisions", "offsets", "contention", "runs", "events", "duration_ns", "seed"),
        Of("definition", "Definition of a latency.", kind=str),
        *("contradictions", "outside", "flows", "tasks", "messages", "disparities", "lost", "notes", "is_stopped"),
    )

    space: Space
    design: Design
    decisions: Annotated[Mapping[str, str], "The simulated design."]
    flows: Annotated[tuple[FlowObservation, ...], BY_NAME, "Observations of each flow."]
    tasks: Annotated[
        tuple[TaskObservation, ...], BY_NAME, "Observations of each thread on a shared core.", Json("threads")
    ]
    lost: Annotated[Mapping[str, int], "Number of lost messages by connection."]
    notes: Annotated[tuple[str, ...], "Notes on the simulation."]
    offsets: Annotated[str, "Mode in which offsets of timers were chosen."]
    runs: Annotated[int, "The number of runs."]
    events: Annotated[int, "The number of events in all runs."]
    duration_ns: Annotated[int, "The simulated time of a run."]
    contention: Annotated[bool, "Whether threads waited for the processor."]
    seed: Annotated[int, "The seed."]
    is_stopped: Annotated[
        bool, "Whether the time limit ended it: the other runs were not made.", Json("stopped", default=False)
    ] = False
    disparities: Annotated[
        tuple[DisparityObservation, ...],
        BY_NAME,
        "Observed disparity of the inputs of each component for which it is defined.",
        Json(default={}),
    ] = ()
    messages: Annotated[
        tuple[TaskObservation, ...],
        BY_NAME,
        "Observations of each message that waits for its bus.",
        Json(default={}),
    ] = ()
    definition: ClassVar[str] = LATENCY

    @property
    def exit_code(self) -> int:
        """The exit code of the command line.

        4 where an observation lies outside an analysed bound, 5 where the simulation was stopped, else 0.
        """
        if self.contradictions or self.outside:
            return EXIT_NO
        return EXIT_INCOMPLETE if self.is_stopped else EXIT_COMPLETE

    @property
    def is_anything_observed(self) -> bool:
        """Whether a single datum came through, a thread ended, or a message was sent.

        A run without any observation confirms nothing, and is reported so.
        """
        return any(flow.count for flow in self.flows) or any(task.observed_ns for task in (*self.tasks, *self.messages))

    @property
    def outside(self) -> tuple[str, ...]:
        """Every observation outside the bounds of the question, with the reason where one is known, in words.

        Sentences for flows, threads, messages and disparities, in this order; contradictions and excused observations
        alike.
        """
        outside = [flow.outside_words for flow in self.flows]
        outside += [task.outside_words for task in (*self.tasks, *self.messages)]
        outside += [item.outside_words for item in self.disparities]
        return tuple(words for words in outside if words)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Every observation that refutes the analysis, in words.

        Sentences with the observed and the analysed figures in ns. Any of them is a fault of the analysis or of the
        simulation.
        """
        contradictions = [
            f"flow {flow.name}: observed {min(flow.latencies)} .. {max(flow.latencies)} ns, "
            f"analysed {flow._claimed_ns[0]} .. {flow._claimed_ns[1]} ns"
            for flow in self.flows
            if flow.is_contradiction
        ]
        contradictions += [
            f"{what} {task.name}: observed response {task.observed_ns} ns, response time {task.bound_ns} ns"
            for what, tasks in (("thread", self.tasks), ("message", self.messages))
            for task in tasks
            if task.is_contradiction
        ]
        contradictions += [
            f"disparity of {item.name}: observed {item.observed_ns} ns, analysed {item.bound_ns} ns"
            for item in self.disparities
            if item.is_contradiction
        ]
        return tuple(contradictions)

    def _verdict(self) -> str:
        """Whether what was observed contradicts the analysis."""
        if self.contradictions:
            return f"{len(self.contradictions)} contradictions"
        return "outside the analysed bounds" if self.outside else "within the analysed bounds"

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A row for each flow: what was observed, and what the analysis says.

        Columns: ``flow``, ``count``, ``min [ms]``, ``mean [ms]``, ``max [ms]``, ``bound min [ms]``, ``bound max [ms]``;
        `units` as for `Result.frame`.
        """
        times = ("min", "mean", "max", "bound min", "bound max")
        rows = [
            {
                "flow": flow.name,
                "count": flow.count,
                "min": flow.min_ns,
                "mean": None if flow.mean_ns is None else float(flow.mean_ns),
                "max": flow.max_ns,
                "bound min": flow.bounds_ns[0],
                "bound max": flow.bounds_ns[1],
            }
            for flow in self.flows
        ]
        return unit_frame(["flow", "count", *times], rows, dict.fromkeys(times, "ns"), units)
