"""`dse.sweep`: the answer as a function of limits and inputs, run by run, kept as it comes."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Unpack

from dse.analysis.diagnosis.front_verdicts import leaves_out_buses
from dse.answers.contention_verdicts import basis_dict
from dse.answers.studies.sweep import RANKING, SweepRanking, SweepResult, SweepRun, VariedAxis, rank_together
from dse.questions.problem import Problem, Source, load
from dse.questions.question import Question, QuestionChanges
from dse.questions.sweep.axes import Axis, InputAxis, LimitAxis, grid_points, read_axis
from dse.questions.sweep.cluster import run_on_cluster
from dse.questions.sweep.fronts import check_objectives
from dse.questions.sweep.inputs_of_file import Inputs, copied, merged_data, needed_data
from dse.questions.sweep.runs import OTHER_VERSION, OutcomeError, SweepPoint, make_payload, read_outcome, solve_payload
from dse.questions.sweep.store import Store, semantics_version
from dse.questions.sweep.workers import Task, check_workers, run_all
from dse.space.question.settings import SETTINGS, settings_of
from dse.space.question.unchecked import refuse_unchecked
from dse.spec.schema.hardware import FROM_BANDWIDTH
from dse.support import arguments
from dse.support.errors import DseError, UsageError
from dse.support.timelimit import NEVER, OutOfTime, TimeLimit


@dataclass(frozen=True)
class SweepProgress:
    """The progress of a sweep: runs in all, finished (of which `found` in the store), seconds.

    And those still expected.
    """

    total: int
    done: int
    found: int
    elapsed_s: float

    @property
    def left_s(self) -> float | None:
        """The seconds that the rest will take, as far as one can tell; None before the first run is solved.

        Elapsed time over runs solved, times runs left; runs that the store already had do not count as solved.
        """
        solved = self.done - self.found
        return self.elapsed_s / solved * (self.total - self.done) if solved else None


@dataclass(frozen=True)
class Means:
    """The means of solving runs: local processes or a Dask scheduler, the time limit, and the file that keeps outcomes.

    `workers` is a number of processes; with `scheduler`, such as ``tcp://host:8786``, runs go to a Dask cluster
    instead. `store` is an SQLite file, None to keep nothing.
    """

    workers: int = 1
    scheduler: str | None = None
    store: Path | None = None
    limit: TimeLimit = NEVER


@arguments.checked(
    also=Question.__annotations__,
    vary=arguments.texts,
    seed=arguments.SEED,
    workers=arguments.Whole(1, 1024),
    scheduler=arguments.optional_text,
    store=arguments.optional_path,
    time_limit_s=arguments.span,
    progress=arguments.call,
)
def sweep(
    problem: Source,
    vary: str | Sequence[str],
    *,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    store: str | Path | None = None,
    time_limit_s: arguments.Span | None = None,
    progress: Callable[[SweepProgress], None] | None = None,
    **question: Unpack[Question],
) -> SweepResult:
    """The front, or the break-points of a limit, for every combination of values.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    vary
        what varies: ``"PATH=1ms,2ms"``, ``"PATH=1ms..5ms step 1ms"``, ``"PATH=*0.5..2 step 0.1"`` (a factor) for an
        input; ``"METRIC of NAME=a,b,c"`` for a limit, and ``"METRIC of NAME=5ms..100ms"`` for every break-point in an
        interval (one such at most).
    seed
        of the solver. The result does not depend on it.
    workers
        processes on this machine; 1 solves in this one. More need a main module that can be imported (``if __name__
        == "__main__"``).
    scheduler
        address of a Dask scheduler, which solves the runs instead.
    store
        a file that keeps every finished run; runs that are there already are not solved again.
    time_limit_s
        seconds for the sweep; then it holds what was finished.
    progress
        called after every run.
    question
        changes to the question, in the words of `Problem.ask`.

    Returns
    -------
    SweepResult
        runs in the order of the values. Stopped by Ctrl-C or its time limit it holds what was finished, status
        ``incomplete``.

    Raises
    ------
    ProblemError
        when the file is wrong.
    UsageError
        when a path, metric, range, step or unit is wrong, the store is damaged or foreign, or the cluster is not there.

    Examples
    --------
    >>> import dse
    >>> found = dse.sweep("pump.yaml", "jitter of sensor_to_valve=1ms..40ms", store=None)
    >>> [stretch["from"] for stretch in found.runs[0].outcome["stretches"]]
    [6934000, 7078000, 13444000, 13588000]
    """
    limit = arguments.time_limit(time_limit_s)
    texts = [vary] if isinstance(vary, str) else list(vary)
    means = Means(workers, scheduler, Path(store) if store is not None else None, limit)
    return sweep_asked(load(problem).ask(**question), texts, seed, means, progress)


def sweep_asked(
    problem: Problem,
    vary: Sequence[str],
    seed: int,
    means: Means,
    progress: Callable[[SweepProgress], None] | None = None,
) -> SweepResult:
    """Sweep the question of a problem as it stands; see `sweep`.

    Axes are read from `vary`, runs already in the store are taken from it, the rest is solved. `progress` is called
    after each run.

    Raises `UsageError` for an axis that cannot be read or a question without objectives.
    """
    check_workers(means.workers)
    refuse_unchecked(problem.space)
    check_objectives(problem.space)
    inputs = Inputs(merged_data(problem))
    axes = read_axes(problem, inputs, vary)
    runs = _plan(axes, inputs, problem, seed)
    done, from_store = _solved(runs, means, progress)
    limits = [(axis.metric.name, axis.operator) for axis in axes if isinstance(axis, LimitAxis)]
    outcomes, scale = rank_together([done.get(number) for number in range(len(runs))], limits)
    return SweepResult(
        problem={
            "name": problem.name,
            "sha256": problem.loaded.sha256,
            **settings_of(problem.space),
            "currency": problem.space.currency,
            "changes": _shown(problem.changes),
        },
        semantics=semantics_version(),
        axes=tuple(_varied(axis) for axis in axes),
        runs=tuple(SweepRun(_labels(axes, run), outcome) for run, outcome in zip(runs, outcomes, strict=True)),
        seed=seed,
        ranking=SweepRanking(RANKING, scale),
        remarks=tuple(_remarks(problem, axes)),
        contention=basis_dict(problem.space),
        bus_waiting="not counted" if leaves_out_buses(problem.space) else None,
        files=problem.loaded.texts,
        solved=len(done) - from_store,
        found=from_store,
    )


def _remarks(problem: Problem, axes: Sequence[Axis]) -> Iterator[str]:
    """A bandwidth that no transmission time follows from moves no latency."""
    for axis in axes:
        section, _, path = axis.name.partition(".")
        types = problem.loaded.spec.bus_types if isinstance(axis, InputAxis) and section == "bus_types" else {}
        for name, model in types.items():
            if path.startswith(f"{name}.bandwidth"):
                if model.frame is not None:
                    continue
                if model.transmission_time != FROM_BANDWIDTH:
                    yield (
                        f"{axis.name} moves no latency: what a transfer takes is stated apart from it, or not at all "
                        f"(`transmission_time: {FROM_BANDWIDTH}` lets it follow)"
                    )
                elif problem.space.profile != "dse":
                    yield f"{axis.name} moves no latency: under profile {problem.space.profile} none follows from it"


def read_axes(problem: Problem, inputs: Inputs, vary: Sequence[str]) -> list[Axis]:
    """The axes of a sweep; at most one varies a limit over a whole interval, and no name occurs twice.

    Raises
    ------
    UsageError
        when a text is wrong.
    """
    if not vary:
        raise UsageError('say what varies: --vary "jitter of my_flow=5ms..100ms"')
    axes = [read_axis(problem, inputs, text) for text in vary]
    for number, axis in enumerate(axes):
        if any(axis.name == other.name for other in axes[:number]):
            raise UsageError(f"{axis.name} is varied twice")
    if sum(isinstance(axis, LimitAxis) and axis.is_exact for axis in axes) > 1:
        raise UsageError("one limit can vary over a whole interval; give the others values (a,b,c or a..b step c)")
    return axes


def _plan(axes: Sequence[Axis], inputs: Inputs, problem: Problem, seed: int) -> list[SweepPoint]:
    """The runs of a sweep, in order."""
    exact = next((axis.shipped(None) for axis in axes if isinstance(axis, LimitAxis) and axis.is_exact), None)
    grid = [axis for axis in axes if not (isinstance(axis, LimitAxis) and axis.is_exact)]
    limits = [item for axis in axes if isinstance(axis, LimitAxis) for item in axis.requirements]
    space = replace(problem.space, requirements=(*problem.space.requirements, *limits))
    needed = {name: value for name, value in needed_data(inputs.data, space).items() if name not in SETTINGS}
    settings: dict[str, Any] = dict(settings_of(problem.space))  # the same question, whoever states its settings
    changes = replace(problem.changes, **settings)
    runs = []
    for point in grid_points(grid):
        data = copied(needed)
        shipped = []
        for axis, number in zip(grid, point, strict=True):
            if isinstance(axis, InputAxis):
                axis.write(inputs, data, number)
            else:
                shipped.append(axis.shipped(number))
        runs.append(SweepPoint(point, make_payload(data, changes, shipped, exact, seed)))
    return runs


def _solved(
    runs: Sequence[SweepPoint], means: Means, progress: Callable[[SweepProgress], None] | None
) -> tuple[dict[int, dict[str, object]], int]:
    """Outcomes by number, as far as they are there when all is done or Ctrl-C is pressed.

    And how many the store had.
    """
    store = Store(means.store) if means.store is not None else None
    try:
        kept = store.find([run.key for run in runs]) if store is not None else {}
        done = _taken(runs, kept, means.store)
        from_store, started = len(done), time.monotonic()
        todo = [number for number in range(len(runs)) if number not in done]
        outcomes = _outcomes([runs[number].payload for number in todo], means)
        try:
            for position, text in outcomes:
                number, outcome = todo[position], _read(text)
                if outcome["status"] == OTHER_VERSION:
                    raise DseError(
                        f"a worker has another version of dse ({outcome['message']}): install the same everywhere"
                    )
                assert outcome["status"] != "incomplete", "a run is not stopped half-way"
                done[number] = outcome
                if store is not None and outcome["kind"] != "error":
                    store.keep(runs[number].key, text)
                if progress is not None:
                    progress(SweepProgress(len(runs), len(done), from_store, time.monotonic() - started))
        except (KeyboardInterrupt, OutOfTime):
            pass
        finally:
            outcomes.close()
        return done, from_store
    finally:
        if store is not None:
            store.close()


def _read(text: str) -> dict[str, Any]:
    """The outcome that a worker has sent.

    Raises
    ------
    DseError
        when it is none.
    """
    try:
        return read_outcome(text)
    except OutcomeError as error:
        raise DseError(f"a worker has sent what is no outcome of a run: {error}") from error


def _taken(runs: Sequence[SweepPoint], kept: Mapping[str, str], store: Path | None) -> dict[int, dict[str, object]]:
    """The outcomes of these runs in a store, all with the same objectives.

    Raises
    ------
    UsageError
        when that is nothing that a run has written.
    """
    done: dict[int, dict[str, object]] = {}
    for number, run in enumerate(runs):
        if run.key not in kept:
            continue
        try:
            done[number] = outcome = read_outcome(kept[run.key])
            objectives = [item["objectives"] for item in done.values() if item["kind"] != "error"]
            if outcome["kind"] != "error" and outcome["objectives"] != objectives[0]:
                raise OutcomeError("objectives is not that of other runs")
        except OutcomeError as error:
            raise UsageError(
                f"{store}: cannot be used as a store: the entry {run.key[:12]} was not written by a run: {error} "
                "(move it away, or name another with --store)"
            ) from error
    return done


def _outcomes(payloads: Sequence[str], means: Means) -> Generator[tuple[int, str], None, None]:
    task: Task = partial(solve_payload, semantics=semantics_version())
    if means.scheduler is not None:
        return run_on_cluster(task, payloads, means.scheduler, means.limit)
    return run_all(task, payloads, means.workers, means.limit)


def _varied(axis: Axis) -> VariedAxis:
    if isinstance(axis, LimitAxis):
        return VariedAxis(f"{axis.name} {axis.operator}", "limit", axis.labels, axis.interval)
    return VariedAxis(axis.name, "factor" if axis.factors else "value", axis.labels)


def _labels(axes: Sequence[Axis], run: SweepPoint) -> tuple[str, ...]:
    grid = [axis for axis in axes if axis.labels]
    return tuple(axis.labels[number] for axis, number in zip(grid, run.point, strict=True))


def _shown(changes: QuestionChanges) -> dict[str, object]:
    """The caller's changes as data."""
    shown: dict[str, object] = {
        "limits": [list(item) for item in changes.limits],
        "require": list(changes.require),
        "objectives": list(changes.objectives),
        "fix": list(changes.fix),
        **changes.settings,
    }
    return {name: value for name, value in shown.items() if value}
