"""What several tests need: hand-made problems, every design of a space, and the front by looking at all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from weakref import WeakKeyDictionary

from dse.analysis.evaluate import Evaluation, Evaluator
from dse.analysis.validity import canonical
from dse.examples.shipped import example_files
from dse.space.build import build_space
from dse.space.model.space import Design, Space
from dse.spec.loading.load import load_spec, parse_spec
from tests.helpers.effort import LONG
from tests.helpers.small import without_waiting

TOO_MANY = ("inmark_clock",)
"""Problems with millions of designs: nothing looks at every one of them, or verifies them over and over."""
SLOW = ("racing_stack",)
"""Problems of which each question takes seconds: without more effort they are solved and analysed, and no more."""
PARTS = {
    "inmark_clock": {"gnss_provider.period": "20 ms", "nav_controller.offset": "4 ms"},
    "perception": {"detection.core": "1", "lanes.core": "2"},
    "racing_stack": {"ground.executor": "ground_node", "tracking.period": "50 ms", "tracking.priority": "1"},
}
"""Decisions that are fixed in these problems where there is little time: the proof is the same, of fewer designs."""
ENUMERABLE = [path for path in example_files() if path.stem not in TOO_MANY and (LONG or path.stem not in SLOW)]
"""The example problems whose designs can all be looked at, in the time that there is."""

PROBLEMS = sorted((Path(__file__).parents[1] / "encode" / "problems").glob("*.yaml"))


def load_space(path: Path) -> Space:
    """The space of a problem file."""
    return build_space(load_spec(path))


def space_of(text: str) -> Space:
    """The space of a problem given as text, `without_waiting`."""
    return build_space(parse_spec(without_waiting(text)))


def raw_designs(space: Space) -> list[Design]:
    """Every combination of options, whether it is a design or not."""
    return list(product(*(range(len(decision.options)) for decision in space.decisions)))


_EVALUATED: WeakKeyDictionary[Evaluator, dict[Design, Evaluation]] = WeakKeyDictionary()


def evaluated(evaluator: Evaluator) -> Mapping[Design, Evaluation]:
    """Every canonical combination of options and what the analysis makes of it; once for each evaluator."""
    if evaluator not in _EVALUATED:
        _EVALUATED[evaluator] = _evaluated(evaluator)
    return _EVALUATED[evaluator]


def _evaluated(evaluator: Evaluator) -> dict[Design, Evaluation]:
    found: dict[Design, Evaluation] = {}
    for raw in raw_designs(evaluator.space):
        design = canonical(evaluator.space, raw)
        if design not in found:
            found[design] = evaluator.evaluate(raw)
        elif LONG:  # whatever the decisions hold that it does not use
            assert evaluator.evaluate(raw).objectives == found[design].objectives
    return found


def counted_down(space: Space, objectives: tuple[int, ...]) -> tuple[int, ...]:
    """Objectives as numbers to be minimised."""
    senses = [objective.sense for objective in space.objectives]
    return tuple(value if sense == "minimise" else -value for value, sense in zip(objectives, senses, strict=True))


def brute_front(evaluator: Evaluator) -> dict[tuple[int, ...], Design]:
    """The non-dominated objective vectors, each with the first of its designs in the order of the file."""
    space = evaluator.space
    found: dict[tuple[int, ...], Design] = {}
    for design, evaluation in sorted(evaluated(evaluator).items()):
        if evaluation.is_feasible:
            found.setdefault(evaluation.objectives, design)
    points = {vector: counted_down(space, vector) for vector in found}
    return {
        vector: design
        for vector, design in found.items()
        if not any(dominates(other, points[vector]) for other in points.values())
    }


def dominates(one: Sequence[int], other: Sequence[int]) -> bool:
    """Whether `one` is no worse in every objective (minimised) and better in at least one."""
    return tuple(one) != tuple(other) and all(a <= b for a, b in zip(one, other, strict=True))
