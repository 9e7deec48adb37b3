"""`dse.sensitivity`: margins, tornado bars and uncertain inputs of one design."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TypeVar, Unpack

from dse.analysis.diagnosis.front_verdicts import leaves_out_buses
from dse.analysis.evaluate import Evaluator
from dse.answers.result import decisions_of
from dse.answers.studies.sensitivity import Chance, SensitivityResult, UncertainResult
from dse.questions.complete_design import complete_design
from dse.questions.problem import Problem, Source, load, read_choices, with_stated_cores
from dse.questions.question import Decided, Question, decisions_as_texts
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.sensitivity.importance import SAMPLES, chance, indices, random_shares
from dse.questions.sensitivity.inputs import InputSpace
from dse.questions.sensitivity.margins import bars, broken_texts, each_margin, scaling
from dse.questions.sensitivity.uncertainty import Uncertain, read_uncertainties, stated_ends
from dse.questions.sweep.fronts import search_space
from dse.space.model.space import Design, Space
from dse.space.question.settings import settings_of
from dse.space.question.unchecked import refuse_unchecked
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.extras import how_to_install, is_installed
from dse.support.timelimit import OutOfTime, look_at_the_clock, until
from dse.support.units import format_ratio

SWING = Fraction(1, 10)
MOST_DRAWS = 50_000_000
"""The most numbers that are drawn for uncertain inputs together: 400 MB."""
T = TypeVar("T")


@dataclass(frozen=True)
class StudySettings:
    """The swing of bars without stated ranges, and the sampling of uncertain inputs.

    `front` asks for the chance of each alternative.
    """

    swing: Fraction = SWING
    samples: int = SAMPLES
    seed: int = 0
    front: bool = True


@arguments.checked(
    also=Question.__annotations__,
    swing=arguments.share,
    samples=arguments.Whole(1, 10**8),
    seed=arguments.SEED,
    front=arguments.flag,
    time_limit_s=arguments.span,
)
def sensitivity(
    problem: Source,
    design: Decided = None,
    *,
    swing: Fraction | float = SWING,
    samples: int = SAMPLES,
    seed: int = 0,
    front: bool = True,
    time_limit_s: arguments.Span | None = None,
    **question: Unpack[Question],
) -> SensitivityResult:
    """The margin of each input of a design, and the inputs that matter most.

    Parameters
    ----------
    problem
        a problem, the path of its file, its content as text or mapping, or a result.
    design
        decisions by name (or texts ``name = option``) or a point of a front, on top of the baseline; the baseline alone
        when left out.
    swing
        how far the bars of the tornado chart go where no uncertainty is stated: 0.1 is less and plus a tenth.
    samples, seed
        of the uncertain inputs that the problem states; recorded in the result.
    front
        whether to solve for the front, and tell of each alternative how likely it meets every requirement.
    time_limit_s
        seconds for everything; what there was no time for is named in `left_out`.
    question
        changes to the question, in the words of `Problem.ask`.

    Raises
    ------
    ProblemError
        when the file, or an uncertainty that it states, is wrong.
    UsageError
        when a decision does not exist, or the design is none.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.sensitivity("pump.yaml", [f"{name} = {option}" for name, option in best.decisions.items()])
    >>> found.scaling.factor
    Fraction(5, 2)
    """
    limit = arguments.time_limit(time_limit_s)
    texts = decisions_as_texts(design)
    settings = StudySettings(Fraction(swing).limit_denominator(10**9), samples, seed, front)
    with until(limit):
        return sensitivity_asked(load(problem).ask(**question), texts, settings)


def sensitivity_asked(
    problem: Problem,
    texts: Sequence[str],
    settings: StudySettings,
    say: Callable[[str], None] | None = None,
) -> SensitivityResult:
    """`sensitivity` with its settings in one, as far as the time limit admits; `say` is called with the progress.

    Raises
    ------
    OutOfTime
        when there was not even time to set it up.
    """
    if settings.samples < 1:
        raise UsageError("at least one sample")
    if not 0 < settings.swing < 1:
        raise UsageError("the swing is a share above 0 and below 100 %")
    if problem.loaded.spec.uncertainty and not is_installed("sensitivity"):
        raise UsageError(f"The indices of uncertain inputs need {how_to_install('sensitivity')}")
    refuse_unchecked(problem.space)
    tell = say or (lambda _: None)
    problem = with_stated_cores(problem, texts)
    inputs = InputSpace(problem)
    space = inputs.problem.space
    design = chosen_design(space, texts)
    uncertain = read_uncertainties(problem, inputs)
    if settings.samples * len(uncertain) > MOST_DRAWS:
        most = MOST_DRAWS // len(uncertain)
        raise UsageError(f"{settings.samples:,} samples of {len(uncertain)} uncertain inputs: at most {most:,} of them")
    function = DesignFunction(inputs, design)
    tell("margins")
    metrics = _watched_metrics(space)
    part = _Parts()
    result = SensitivityResult(
        problem={
            "name": problem.name,
            "sha256": problem.loaded.sha256,
            **settings_of(space),
            "currency": space.currency,
        },
        files=problem.loaded.texts,
        decisions=decisions_of(space, design),
        broken=tuple(broken_texts(function)),
        margins=part.collected("margins of further inputs", each_margin(function)),
        scaling=part.made("the factor on all execution times", lambda: scaling(function)),
        bars=part.made(
            "how far each input moves a metric",
            lambda: bars(function, settings.swing, stated_ends(uncertain), metrics),
        )
        or (),
        swing=f"stated range, else {format_ratio(settings.swing)} less and more",
        uncertain=part.made("uncertain inputs", lambda: _uncertain(inputs, function, uncertain, settings, tell, part))
        if uncertain
        else None,
        bus_waiting="not counted" if leaves_out_buses(space) else None,
    )
    return replace(result, left_out=tuple(part.left_out))


class _Parts:
    """The parts of a result that are computed before the time limit in force; `left_out` names the others."""

    def __init__(self) -> None:
        self.left_out: list[str] = []

    def made(self, what: str, make: Callable[[], T]) -> T | None:
        """A part, or None when there was no time for all of it."""
        try:
            look_at_the_clock()
            return make()
        except OutOfTime:
            self.left_out.append(what)
            return None

    def collected(self, what: str, items: Iterator[T]) -> tuple[T, ...]:
        """The items for which there was time."""
        collected: list[T] = []
        with suppress(OutOfTime):
            look_at_the_clock()
            for item in items:
                collected.append(item)  # noqa: PERF402 (what came before the time was up is kept)
            return tuple(collected)
        self.left_out.append(what)
        return tuple(collected)


def chosen_design(space: Space, texts: Sequence[str]) -> Design:
    """The design that texts name on top of the baseline.

    Raises
    ------
    UsageError
        when it leaves decisions open, or is not valid.
    """
    design = complete_design(space, {**space.baseline, **space.fixed, **read_choices(space, texts)})
    evaluation = Evaluator(space).evaluate(design)
    if evaluation.breaches:
        raise UsageError(f"not a valid design: {'; '.join(evaluation.breaches)}")
    return evaluation.design


def _watched_metrics(space: Space) -> list[str]:
    """The metrics that are asked about: objectives, then requirements."""
    names = [item.metric.name for item in space.objectives] + [item.metric.name for item in space.requirements]
    return list(dict.fromkeys(names))


def _uncertain(
    inputs: InputSpace,
    function: DesignFunction,
    uncertain: Sequence[Uncertain],
    settings: StudySettings,
    tell: Callable[[str], None],
    part: _Parts,
) -> UncertainResult:
    shares = random_shares(len(uncertain), settings.samples, settings.seed)
    space = inputs.problem.space
    tell("design")
    design_chance = chance(function, uncertain, shares)
    tell("indices")
    metrics = _watched_metrics(space)
    measured = part.made("what moves each metric", lambda: indices(function, uncertain, metrics, settings.seed))
    sobol, endless = measured if measured is not None else ((), ())

    def chances() -> Iterator[Chance]:
        alternatives: list[Design] = []
        if settings.front and space.objectives:
            tell("front")
            search = search_space(Evaluator(space), settings.seed)
            alternatives = list(search.points.values())
            if not search.is_complete:
                part.left_out.append("further alternatives of the front")
        for number, design in enumerate(alternatives, start=1):
            tell(f"alternative {number} of {len(alternatives)}")
            yield chance(DesignFunction(inputs, design), uncertain, shares)

    return UncertainResult(
        inputs={item.path: item.sampled_words for item in uncertain},
        samples=settings.samples,
        seed=settings.seed,
        chances=tuple(
            sorted(part.collected("chances of further alternatives", chances()), key=lambda item: -item.all_met)
        ),
        indices=sobol,
        design_chance=design_chance,
        unbounded=endless,
    )
