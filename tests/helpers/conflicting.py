"""Random infeasible problems, small enough to look at every design of their structure."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import dse
from dse.analysis.evaluate import Evaluator
from dse.analysis.limits import build_limit
from dse.analysis.measures import all_metrics, build_measure
from dse.analysis.views import View
from dse.questions.problem import Problem
from dse.search.feasibility.oracle import Oracle, demanding
from dse.space.model.criteria import Metric, Requirement
from dse.space.model.metric_kinds import metric_dimension
from dse.space.model.space import Design, Space
from dse.space.model.trees import leaves
from dse.space.question.implied import with_implied
from dse.spec.language.expressions import Operator
from dse.support.errors import ProblemError
from dse.support.units import DIMENSIONLESS, Quantity
from dse.support.units.table import UNITS
from dse.verification.exhaustion import exhaust
from dse.verification.tables import build_tables
from tests.helpers.effort import LONG
from tests.oracle.generator import random_problem

MOST_MEMBERS = 9
MOST_DESIGNS = 1500 if LONG else 150


def infeasible(seed: int) -> tuple[Problem, list[Design]] | None:
    """A random problem tightened until no design is left, and every design of its structure."""
    try:
        problem = dse.loads(random_problem(seed, "tiny"))
    except ProblemError:
        return None
    space = problem.space
    designs = structural_designs(space)
    rng = random.Random(seed)
    if not 2 <= len(designs) <= MOST_DESIGNS:
        return None
    requirements = [item for item in space.requirements if not item.implied][:3]
    fixed = {}
    if rng.random() < 0.3:
        decision = rng.choice([n for n, item in enumerate(space.decisions) if item.is_open])
        fixed[decision] = rng.randrange(len(space.decisions[decision].options))
    for _ in range(12):
        asked = with_implied(replace(space, requirements=tuple(requirements), rules=space.rules[:3], fixed=fixed))
        if Brute(asked).infeasible(designs):
            return replace(problem, space=asked), designs
        if requirements and len(asked.requirements) + len(asked.rules) + len(fixed) >= MOST_MEMBERS:
            requirements.pop(rng.randrange(len(requirements)))
        requirements.append(tight(rng, asked, designs))
    return None


class Brute:
    """Which members each design meets, by the analysis; no solver, no encoding."""

    def __init__(self, space: Space) -> None:
        self.oracle = Oracle(space)

    def infeasible(self, designs: list[Design]) -> bool:
        return not any(self.oracle.met_by(design) == self.oracle.everything for design in designs)


def structural_designs(space: Space) -> list[Design]:
    try:
        found = exhaust(build_tables(Evaluator(demanding(space, ()))), 20_000).designs
    except Exception as error:  # noqa: BLE001 - too many for this test
        assert type(error).__name__ in ("TooMany", "TooLarge")
        return []
    return [tuple(int(option) for option in row) for row in found]


def tight(rng: random.Random, space: Space, designs: list[Design]) -> Requirement:
    """A requirement that few designs meet."""
    metrics = [metric for metric in all_metrics(space) if metric.kind != "response time"]
    varying = [m for m in metrics if len({value(space, m, design) for design in rng.sample(designs, 2)}) > 1]
    metric = rng.choice(varying or metrics)
    operators: list[Operator] = ["<=", "<=", "<=", "<", ">=", ">", "=="]
    operator = rng.choice(operators)
    share = metric.kind == "utilisation" or (
        metric.kind == "load" and rng.random() < 0.5 and all(leaf is not None for leaf in _bandwidths(space, metric))
    )
    dimension = DIMENSIONLESS if share else metric_dimension(space, metric)
    unit = next((unit for unit, known in UNITS.items() if known == (Fraction(1), dimension)), "")
    unit_limit = Quantity(Fraction(1), dimension, unit)
    one = build_limit(space, Requirement("", metric, operator, unit_limit))
    needed = sorted(one.measure.value(View(design)) / one.bound(View(design)) for design in designs)
    few = needed if operator in ("<=", "<", "==") else needed[::-1]
    limit = few[rng.randrange(max(1, len(few) // 4))]
    return Requirement(f"{metric.name} {operator} {limit}", metric, operator, replace(unit_limit, value=limit), "test")


def _bandwidths(space: Space, metric: Metric) -> Iterator[int | None]:
    return leaves(space.buses[metric.index or 0].bandwidth_bps)


def value(space: Space, metric: Metric, design: Design) -> Fraction:
    return build_measure(space, metric).value(View(design))
