"""What the referee remembers does not depend on what it was asked before."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from dse.analysis.evaluate import Evaluator
from dse.analysis.views import View
from dse.examples.shipped import example_files
from tests.helpers.effort import count
from tests.helpers.support import PROBLEMS, load_space


@pytest.mark.parametrize("path", [*PROBLEMS, *example_files()], ids=lambda path: path.stem)
def test_the_figures_of_a_flow_at_once_are_the_sums_of_its_terms(path: Path) -> None:
    """`flow_figure_ns` remembers the elements of a flow from design to design: the measures themselves do not."""
    space = load_space(path)
    evaluator = Evaluator(space)
    source = random.Random(path.stem)
    seen = 0
    for _ in range(count(1000)):
        design = tuple(source.randrange(len(decision.options)) for decision in space.decisions)
        if evaluator.evaluate(design).breaches:
            continue
        expected = {measure.metric.name: measure.integer(View(design)) for measure in evaluator.metrics}
        assert evaluator.metric_values(design) == expected
        evaluator.metric_values(design).clear()  # what is handed out is the caller's
        assert evaluator.metric_values(design) == expected
        seen += 1
    assert seen or len(space.decisions) > 5, "no valid design was drawn"
