"""`dse.sensitivity`: margins, tornado bars and uncertain inputs of one design."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from dse.analysis.evaluate import Evaluator
from dse.api.problem import Changes, Problem, complete_design, load, read_choices
from dse.errors import UsageError
from dse.results.result import decisions_of
from dse.results.sensitivity import SensitivityResult, UncertainResult
from dse.space.settings import settings_of
from dse.space.types import Design, Space
from dse.study.fronts import search_space
from dse.study.functions import DesignFunction, InputSpace
from dse.study.importance import SAMPLES, chance, indices, random_shares
from dse.study.margins import bars, broken_texts, margins, scaling
from dse.study.uncertainty import Uncertain, read_uncertainties, stated_ends
from dse.units import format_ratio

SWING = Fraction(1, 10)


@dataclass(frozen=True)
class Settings:
    """How far bars go where nothing is stated, and how uncertain inputs are sampled.

    `front` asks for the chance of each alternative.
    """

    swing: Fraction = SWING
    samples: int = SAMPLES
    seed: int = 0
    front: bool = True


def sensitivity(
    problem: Problem | str | Path,
    design: Mapping[str, str] | Sequence[str] | None = None,
    *,
    processing: str | None = None,
    changes: Changes | None = None,
    swing: Fraction | float = SWING,
    samples: int = SAMPLES,
    seed: int = 0,
    front: bool = True,
) -> SensitivityResult:
    """How far each input of a design may move before a requirement breaks, and which inputs matter.

    Parameters
    ----------
    problem
        a loaded problem, or the path of a problem file.
    design
        decisions by name (or texts ``name = option``), on top of the baseline; the baseline alone when left out.
    processing
        what a flow counts for a thread, ``execution_time`` or ``response_time``, instead of what the file says.
    changes
        further changes to the question, as for `dse.solve`.
    swing
        how far the bars of the tornado chart go where no uncertainty is stated: 0.1 is less and plus a tenth.
    samples, seed
        of the uncertain inputs that the problem states; recorded in the result.
    front
        whether to solve for the front, and tell of each alternative how likely it meets every requirement.

    Raises
    ------
    ProblemError
        when the file, or an uncertainty that it states, is wrong.
    UsageError
        when a decision does not exist, or the design is none.
    """
    loaded = problem if isinstance(problem, Problem) else load(problem)
    texts = (
        [f"'{name}' = {option}" for name, option in design.items()]
        if isinstance(design, Mapping)
        else list(design or ())
    )
    settings = Settings(Fraction(swing).limit_denominator(10**9), samples, seed, front)
    return sensitivity_of(loaded, texts, (changes or Changes()).with_settings(processing=processing), settings)


def sensitivity_of(
    problem: Problem,
    texts: Sequence[str],
    changes: Changes,
    settings: Settings,
    say: Callable[[str], None] | None = None,
) -> SensitivityResult:
    """`sensitivity` with its settings in one; `say` is told what is under way."""
    if settings.samples < 1:
        raise UsageError("at least one sample")
    if not 0 < settings.swing < 1:
        raise UsageError("the swing is a share above 0 and below 100 %")
    tell = say or (lambda _: None)
    inputs = InputSpace(problem, changes)
    space = inputs.problem.space
    design = chosen_design(space, texts)
    uncertain = read_uncertainties(problem, inputs)
    function = DesignFunction(inputs, design)
    tell("margins")
    metrics = watched_metrics(space)
    found = SensitivityResult(
        problem={
            "name": problem.name,
            "sha256": problem.loaded.sha256,
            **settings_of(space),
            "currency": space.currency,
        },
        decisions=decisions_of(space, design),
        broken=tuple(broken_texts(function)),
        margins=margins(function),
        scaling=scaling(function),
        bars=bars(function, settings.swing, stated_ends(uncertain), metrics),
        swing=f"stated range, else {format_ratio(settings.swing)} less and more",
        uncertain=_uncertain(inputs, function, uncertain, settings, tell) if uncertain else None,
        currency=space.currency,
    )
    return found


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


def watched_metrics(space: Space) -> list[str]:
    """The metrics that are asked about: objectives, then requirements."""
    names = [item.metric.name for item in space.objectives] + [item.metric.name for item in space.requirements]
    return list(dict.fromkeys(names))


def _uncertain(
    inputs: InputSpace,
    function: DesignFunction,
    uncertain: Sequence[Uncertain],
    settings: Settings,
    tell: Callable[[str], None],
) -> UncertainResult:
    shares = random_shares(len(uncertain), settings.samples, settings.seed)
    space = inputs.problem.space
    alternatives: list[Design] = []
    if settings.front and space.objectives:
        tell("front")
        alternatives = list(search_space(Evaluator(space), settings.seed).points.values())
    chances = []
    for number, design in enumerate(alternatives, start=1):
        tell(f"alternative {number} of {len(alternatives)}")
        chances.append(chance(DesignFunction(inputs, design), uncertain, shares))
    tell("indices")
    return UncertainResult(
        inputs={item.path: item.words for item in uncertain},
        samples=settings.samples,
        seed=settings.seed,
        chances=tuple(sorted(chances, key=lambda item: -item.all_met)),
        indices=indices(function, uncertain, watched_metrics(space), settings.seed),
        design_chance=chance(function, uncertain, shares),
    )
