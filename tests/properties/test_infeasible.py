"""Infeasible problems: the verdict, the minimal conflicts and the closest limits, against all designs."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import combinations
from math import ceil, floor

import pytest

import dse
from dse.answers.result import Clash, Result
from tests.helpers.effort import cases
from tests.oracle import evaluator as oracle
from tests.oracle import grammar
from tests.oracle.generator import random_problem
from tests.properties.pair import PER_UNIT, Pair
from tests.properties.rewriting import Document, decimal, document_of, text_of

DRAWN = [*(("tiny", seed) for seed in cases(40, 2_000)), *(("hosted", seed) for seed in cases(10, 109))]
LIMITABLE = ("ns", "mW", "ct", "B/s", "ppm", "g", "%")


def made_infeasible(seed: int, size: str = "tiny") -> Document | None:
    """A random problem that no design can meet: as drawn, or with a limit just beyond what the designs attain."""
    rng = random.Random(seed)
    pair = Pair(random_problem(seed, size))
    document = document_of(pair.text)
    if not pair.feasible or not pair.valid:
        return document if pair.valid else None
    measures = [item for item in pair.evaluator.metrics if item.unit in LIMITABLE and item.metric.kind != "derived"]
    measures = [item for item in measures if not item.metric.kind.startswith("exact ")]  # the oracle has the bounds
    measure = rng.choice(measures)
    kind, _, name = measure.metric.name.partition(" of ")
    subject = f"{kind} of '{name}'" if name else kind
    is_share = kind == "utilisation" or (
        kind == "load" and rng.random() < 0.5 and all(item.figures["load_share"].get(name) for item in pair.valid)
    )
    sign = rng.choice(["<=", "<=", "<", ">=", ">"])
    unit = "ppm" if is_share else measure.unit
    asked = f"{subject} {sign} 1 {'EUR' if unit == 'ct' else unit}"
    values = [oracle.needed_limit(pair.oracle, item.figures, asked) * PER_UNIT.get(unit, 1) for item in pair.feasible]
    if sign in ("<=", "<"):
        limit = floor(min(values)) - rng.choice([1, 1, 5])
    else:
        limit = ceil(max(values)) + rng.choice([1, 1, 5])
    if limit < 0:
        return None
    shown = f"{decimal(Fraction(limit, 100))} EUR" if unit == "ct" else f"{limit} {unit}"
    requirements = [*document.get("requirements", []), f"{subject} {sign} {shown}"]
    return {**document, "requirements": requirements}


class Demands:
    """Every design of a problem without its demands, and the demands that each one meets, by the oracle alone."""

    def __init__(self, document: Document, requirements: list[str], rules: list[str]) -> None:
        free = {key: value for key, value in document.items() if key not in ("requirements", "rules")}
        free["flows"] = {
            name: {key: value for key, value in flow.items() if key != "latency"}
            for name, flow in document["flows"].items()
        }
        if oracle.load_text(text_of(document)).asks_of_cores:  # they are decisions without the demands, too
            core = f"utilisation of core 1 of '{next(iter(document['processors']))}'"
            free["objectives"] = [*document["objectives"], f"minimise {core}"]
        self.problem = oracle.load_text(text_of(free))
        self.texts = [*requirements, *rules]
        self.designs = []
        for named, figures in oracle.evaluated(self.problem):
            met = {text for text in requirements if oracle.is_met(self.problem, figures, text)}
            met |= {text for text in rules if oracle.is_obeyed(self.problem, named, text)}
            self.designs.append((figures, met))

    def can_hold(self, texts: set[str]) -> bool:
        """Whether some design meets all of these."""
        return any(texts <= met for _, met in self.designs)

    def closest(self, text: str) -> Fraction | None:
        """The limit nearest to that of the requirement which a design needs that meets all the others."""
        others = set(self.texts) - {text}
        needed = [oracle.needed_limit(self.problem, figures, text) for figures, met in self.designs if others <= met]
        if not needed:
            return None
        return {"<": min, ">": max}[grammar.requirement(text).operator[0]](needed)


def checked(document: Document) -> tuple[Result, Demands]:
    """The result of an infeasible problem, its verdict confirmed by looking at every design."""
    problem = dse.loads(text_of(document))
    requirements = [item.text for item in problem.space.requirements]
    demands = Demands(document, requirements, [item.text for item in problem.space.rules])
    assert not demands.can_hold(set(demands.texts))
    result = dse.solve(problem)
    assert result.status == "infeasible"
    assert result.front == ()
    return result, demands


@pytest.mark.parametrize(("size", "seed"), DRAWN)
def test_conflicts_are_minimal_and_closest_limits_exact(size: str, seed: int) -> None:
    document = made_infeasible(seed, size)
    if document is None:
        pytest.skip("no limit is beyond every design")
    result, demands = checked(document)
    assert bool(result.conflicts) == bool(demands.designs)
    for conflict in result.conflicts:
        texts = [clash.text for clash in conflict.members]
        assert not demands.can_hold(set(texts))
        assert all(demands.can_hold(set(fewer)) for fewer in combinations(texts, len(texts) - 1))
        for clash in conflict.members:
            assert_closest(document, demands, clash)


def assert_closest(document: Document, demands: Demands, clash: Clash) -> None:
    """The closest limit is what the designs say, the miss is the way there, and a hair less does not do."""
    if clash.text not in {item.text for item in dse.loads(text_of(document)).space.requirements}:
        assert clash.closest is None
        return
    operator = grammar.requirement(clash.text).operator
    if operator == "==":
        return
    exact = demands.closest(clash.text)
    if exact is None:
        assert clash.closest is None
        return
    assert clash.closest == exact * PER_UNIT.get(clash.unit, 1), clash
    assert clash.limit is not None and clash.miss == abs(clash.closest - clash.limit)
    position = next((at for at, text in enumerate(document["requirements"]) if text == clash.text), None)
    if position is None or decimal(clash.closest) is None:
        return  # one of several that a requirement without a name stands for, or of a flow
    hair = Fraction(1, 1000) * (1 if operator[0] == "<" else -1)
    assert moved(document, position, clash, clash.closest - hair).status == "infeasible"
    enough = clash.closest if operator in ("<=", ">=") else clash.closest + hair
    assert moved(document, position, clash, enough).status == "complete"


def moved(document: Document, position: int, clash: Clash, limit: Fraction) -> Result:
    """The result with another limit."""
    subject = clash.text[: clash.text.index(grammar.requirement(clash.text).operator)]
    shown = f"{decimal(limit / 100)} EUR" if clash.unit == "ct" else f"{decimal(limit)} {clash.unit}"
    requirements = list(document["requirements"])
    requirements[position] = f"{subject}{grammar.requirement(clash.text).operator} {shown}"
    return dse.solve(dse.loads(text_of({**document, "requirements": requirements})))


def test_the_problems_are_worth_it() -> None:
    """Conflicts of one and of several demands occur, with limits on sums and on single threads."""
    sizes: set[int] = set()
    threads = False
    for seed in cases(1_000, 2_008):  # as far as is needed
        document = made_infeasible(seed)
        if document is not None:
            result = dse.solve(dse.loads(text_of(document)))
            sizes |= {len(conflict.members) for conflict in result.conflicts}
            threads |= any(clash.thread for conflict in result.conflicts for clash in conflict.members)
        if threads and {1, 2} <= sizes:
            return
    pytest.fail(f"{sizes}, {threads}")
