"""`dse.verify`: a result checked again, robust or not.

A robust result is one of the worst of all stated values. Each of its points is proved robust over the whole box again
(`dse.study.worst_place`), and played through at corners and places inside by the analysis itself. Its refuted regions
are proved again for the designs that meet demands at corners, by the means of `dse.verification`; a design that is
found there and is not robust names a corner to demand as well, and the proof begins anew.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from dse.analysis.evaluate import Evaluator
from dse.api.completeness import check_claims
from dse.api.points import Bench, check_front, check_statements
from dse.api.problem import Problem
from dse.api.stated import restated
from dse.api.verify import verify_with
from dse.results.display import exact, figure
from dse.results.forms.result import Lost
from dse.results.forms.writing import written
from dse.results.robust import RobustResult
from dse.results.solve import Result, decisions_of
from dse.results.verify import Verification
from dse.space.types import Design
from dse.study.corners import RobustQuestion
from dse.study.functions import DesignFunction
from dse.study.resume import nominal_data
from dse.verification.prover import Method

MOST_CORNERS = 32
"""The greatest number of corners of the box, and of places inside, that are looked at for each point."""


def verify(
    result: Result | RobustResult | Mapping[str, Any] | str | Path,
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: float | None = None,
) -> Verification:
    """Check a result without trusting the solver or the encoding that made it.

    The problem is read again and what it means compared, the question rebuilt, every figure of every point recomputed
    by the analysis alone. Then the claim that nothing is missing: points and refuted regions must leave no part of
    the objective space uncovered (integer geometry), and that the refuted regions are empty is proved again, by
    looking at every design or by a second model. Of a robust result each point is proved to hold for all stated values,
    and what it says of the nominal front is checked likewise.

    Parameters
    ----------
    result
        a result, its dictionary, or the file that it was written to.
    problem
        the problem, where it is no longer where the result says. Where there is none, the problem that the result
        itself carries is taken, and the status is at best ``unfinished``: a forgery of both would pass.
    method
        ``exhaustion`` looks at every design, ``model`` asks a second model; ``auto`` looks where there are few enough.
    time_limit_s
        seconds for everything; what could not be looked at by then is said in `left_open`.

    Returns
    -------
    Verification
        with status ``verified``, ``rejected`` or ``unfinished``, and every finding.

    Raises
    ------
    UsageError
        when the file is no result or the problem is not found.
    ProblemError
        when the problem is wrong.

    Examples
    --------
    >>> import dse
    >>> dse.verify(dse.solve("pump.yaml")).status
    'verified'
    """
    data = result.to_dict() if isinstance(result, RobustResult) else result
    return verify_with(data, RobustWitness, problem=problem, method=method, time_limit_s=time_limit_s)


class RobustWitness:
    """Knows of designs whether they are robust, and of a robust result what else it states."""

    def __init__(self, problem: Problem, effective: Mapping[str, Any]) -> None:
        self.problem = problem
        self.question = RobustQuestion(restated(problem, effective), partial(restated, effective=effective))

    def evaluator(self) -> Evaluator:
        """The evaluator of designs that meet what is demanded so far: all robust ones, and fewer and fewer others."""
        return self.question.evaluator()

    def learn(self, design: Design) -> bool:
        """Whether a design is not robust; then what it breaks is demanded from now on."""
        return self.question.learn(design)

    def broken(self, design: Design) -> list[str]:
        """What a design breaks for some of the stated values: by the proof, and at places that are looked at."""
        found = self.question.failures(0, design)
        if found:
            return [f"breaks {item.requirement!r} for some stated values: {item.value} {item.unit}" for item in found]
        self.question.expect(design)
        return self._seen_broken(design)

    def _seen_broken(self, design: Design) -> list[str]:
        """The analysis itself at corners and at places inside the box."""
        function, box = DesignFunction(self.question.inputs, design), self.question.box
        source = random.Random(len(box.ends))
        corners = list(product((0, 1), repeat=len(box.ends))) if 2 ** len(box.ends) <= MOST_CORNERS else []
        places = [[ends[end] for ends, end in zip(box.ends, corner, strict=True)] for corner in corners]
        for _ in range(MOST_CORNERS - len(places) // 2):
            places.append([low + (high - low) * Fraction(source.randrange(1001), 1000) for low, high in box.ends])
        for place in places:
            values = list(self.question.inputs.nominal)
            for item, value in zip(box.uncertain, place, strict=True):
                item.set(values, value)
            broken = function.broken(function.compared(values, function.outputs.bounds)[0])
            if broken:
                return [f"breaks {self.question.space.requirements[broken[0].requirement].text!r} at {_at(place)}"]
        return []

    def check(self, bench: Bench, method: Method, deadline: float | None) -> None:
        """What a robust result says of its inputs, of the nominal front, and of what robustness costs."""
        nominal = self._check_nominal(bench, method, deadline)
        stated = bench.data["robust"]
        unjudged = stated.get("unjudged", [])
        if unjudged and bench.data["status"] != "incomplete" and not bench.under_way:
            bench.find("robust.unjudged", "there is none where the search was not stopped")
        lost = [
            written(Lost, failure)
            for point, design in zip(nominal.data["front"], nominal.designs, strict=False)
            if point["id"] not in unjudged
            for failure in self.question.failures(point["id"], design)
        ]
        known = [decisions_of(bench.space, design) for design in nominal.designs]
        kept = [point["id"] for point in bench.data["front"] if point["decisions"] in known]
        expected = {
            "inputs": self.question.words,
            "currency": bench.space.currency,
            "price": {name: {"nominal": _best(nominal, name), "robust": _best(bench, name)} for name in bench.names},
            "kept": kept,
            "entered": [point["id"] for point in bench.data["front"] if point["id"] not in kept],
            "lost": lost,
        }
        bench.compare("robust", expected, {name: stated[name] for name in expected})
        bench.checked.append(
            f"{len(bench.designs)} points hold for all stated values of {len(self.question.words)} inputs: proved over "
            "the whole ranges, and looked at in corners and inside"
        )

    def _check_nominal(self, bench: Bench, method: Method, deadline: float | None) -> Bench:
        """The nominal front, as a result of its own; what is found is noted under ``robust.nominal``."""
        data = nominal_data(bench.data)
        asked = replace(self.question.inputs.problem, robust=False)
        nominal = Bench(data, self.problem, asked=asked, has_moved=bench.has_moved)
        check_statements(nominal)
        check_front(nominal)
        check_claims(nominal, method, deadline)
        for item in nominal.findings:
            bench.find(f"robust.nominal.{item.place}", item.text)
        bench.left_open += [f"the nominal front: {text}" for text in nominal.left_open]
        bench.checked.append(f"the nominal front: {'; '.join(nominal.checked)}")
        return nominal


def _best(bench: Bench, name: str) -> int | str | None:
    """The best value of an objective among the points of a result."""
    sense = next(item.sense for item in bench.space.objectives if item.metric.name == name)
    values = [figure(point["objectives"][name]) for point in bench.data["front"]]
    if not values:
        return None
    return exact(min(values) if sense == "minimise" else max(values))


def _at(place: list[Fraction]) -> str:
    return ", ".join(str(value) for value in place)
