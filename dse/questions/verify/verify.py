"""`dse.verify`: a result checked against its problem by the analysis alone, its completeness proved a second time."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, get_args

from dse.analysis.evaluate import Evaluator
from dse.answers.forms.codec import written
from dse.answers.forms.consistency import check_whole
from dse.answers.reading import check_semantics, read_stated
from dse.answers.result import Result, decisions_of
from dse.answers.robust import Failure, RobustResult
from dse.answers.tables.display import exact, figure
from dse.answers.verification import Finding, Verification
from dse.questions.problem import Problem, origin_of, restated
from dse.questions.result_problem import Belonging, belonging, carried_digests, carried_problem
from dse.questions.result_question import set_up
from dse.questions.resume import nominal_data
from dse.questions.robust.corner_demands import RobustQuestion
from dse.questions.sensitivity.design_function import DesignFunction
from dse.questions.verify.alternatives import check_others
from dse.questions.verify.completeness import check_claims
from dse.questions.verify.conflicts import check_conflicts
from dse.questions.verify.contention_claims import check_contention
from dse.questions.verify.insisting import check_insisting
from dse.questions.verify.points import MOST_FINDINGS, Bench, Witness, check_front, check_statements
from dse.space.model.space import Design
from dse.space.question.settings import settings_of
from dse.support import arguments
from dse.support.errors import UsageError
from dse.support.timelimit import OutOfTime, TimeLimit, until
from dse.support.units.text import count_words
from dse.verification.prover import Method


def _verify_with(
    result: Result | Mapping[str, Any] | str | Path,
    robust: Callable[[Problem, Mapping[str, Any]], Witness],
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: float | None = None,
) -> Verification:
    """Check a result; `robust` makes the witness of a robust question. See `dse.questions.verify.verify.verify`."""
    started, limit = time.monotonic(), TimeLimit.after(time_limit_s)
    if isinstance(result, Result):
        data, name = result.to_dict(), "the result"
    elif isinstance(result, Mapping):
        data, name = dict(result), "the result"
        check_semantics(data, name)
    else:
        data, name = read_stated(result), str(result)
    wrong = [Finding(item.place or "the result", item.text) for item in check_whole("result", data)]
    if wrong:
        said = ("whether it has every field, each of its kind",)
        return Verification(name, "(it was not read)", "rejected", tuple(wrong[:MOST_FINDINGS]), said)
    with until(limit):
        origin = belonging(data, name, problem)
        bench = _checked(data, origin, name, ProofMeans(robust, method, limit))
    status = "rejected" if bench.findings else "unfinished" if bench.left_open else "verified"
    return Verification(
        result=name,
        problem="the problem that the result itself carries" if origin.is_carried else str(origin.problem.loaded.path),
        status=status,  # type: ignore[arg-type]
        findings=bench.listed(),
        checked=tuple(bench.checked),
        left_open=tuple(bench.left_open),
        remarks=tuple(bench.remarks),
        wall_s=round(time.monotonic() - started, 3),
        claim=_claim(data),
    )


def _claim(data: Mapping[str, Any]) -> str:
    """What a result claims: ``incomplete: 65 designs, 6 open regions``."""
    designs, regions = len(data["front"]), len(data.get("unexplored", ()))
    said = [count_words(designs, "design")] if designs or data["status"] != "infeasible" else ["no design"]
    said += [count_words(regions, "open region")] if regions else []
    return f"{data['status']}: {', '.join(said)}"


@dataclass(frozen=True)
class ProofMeans:
    """The means of checking a result: the witness of a robust question, the method of the second proof, the time limit.

    `robust` makes a witness from a problem and the data of a robust result; `method` is the one of `dse.verify`.
    """

    robust: Callable[[Problem, Mapping[str, Any]], Witness]
    method: Method
    limit: TimeLimit


def _checked(data: Mapping[str, Any], origin: Belonging, name: str, means: ProofMeans) -> Bench:
    """All checks, one after the other; later ones need what earlier ones found sound."""
    bench = Bench(data, origin.problem, has_moved=not origin.is_same_text or _is_of_a_model(origin))
    method, limit = means.method, means.limit
    checks: dict[str, Callable[[], None]] = {
        "the question": lambda: _check_question(bench),
        "objectives, units and status": lambda: check_statements(bench),
        "whether it is robust": lambda: _check_robust(bench, means),
        "the points": lambda: check_front(bench),
        "other designs": lambda: check_others(bench, method, limit.deadline),
        "the fronts with one option each": lambda: check_insisting(bench, method, limit.deadline),
        "contention": lambda: check_contention(bench, method, limit.deadline),
        "what robustness costs": lambda: _check_costs(bench, means),
        "that nothing is missing": lambda: check_claims(bench, method, limit.deadline),
        "conflicts": lambda: check_conflicts(bench, method, limit.deadline),
    }
    waiting = dict(checks)
    try:
        _check_problem(bench, origin, name)
        if origin.differs:
            return bench  # nothing else would agree
        for what, check in checks.items():
            limit.check()
            check()
            del waiting[what]
    except OutOfTime:
        bench.left_open.append(f"the time was too short; not examined completely: {', '.join(waiting)}")
    except UsageError as error:
        bench.find("problem.effective", str(error))
    return bench


def _is_of_a_model(origin: Belonging) -> bool:
    """Whether the result carries what was imported, whose lines are not those of the model."""
    return origin.is_carried and origin.problem.loaded.spec.imported is not None


def _check_robust(bench: Bench, means: ProofMeans) -> None:
    """Whoever knows what holds for all stated values is there where that is asked."""
    assert bench.asked is not None
    if bench.asked.robust:
        bench.witness = means.robust(bench.problem, bench.data["problem"]["effective"])
    elif "robust" in bench.data:
        bench.find("robust", "is stated, but the question is not robust")


def _check_costs(bench: Bench, means: ProofMeans) -> None:
    """What a robust result says of the nominal front and of the difference."""
    if bench.witness is not None:
        bench.witness.check(bench, means.method, means.limit.deadline)


def _check_problem(bench: Bench, origin: Belonging, name: str) -> None:
    """Check that the problem means what the solved one meant, and that what the result says of its files is true."""
    stated = bench.data["problem"]
    for text in origin.differs:
        bench.find("problem.identity", f"{bench.problem.loaded.path} is not the problem that was solved: {text}")
    if origin.is_carried:
        lacking = f"{', '.join(origin.absent)}, which {stated['file']} names," if origin.absent else ""
        bench.left_open.append(
            f"{lacking or 'the problem file ' + stated['file']} is not there: this is what the result itself carries, "
            "and a forgery of both would pass"
        )
    if not origin.is_carried and not origin.is_same_text and not origin.differs:
        bench.remarks.append(f"{bench.problem.loaded.path} has changed since, in comments, layout or paths only")
    try:
        carried = carried_problem(bench.data, name)
    except UsageError as error:
        bench.find("files", str(error))
        return
    sha256, includes = carried_digests(carried)
    own = {"sha256": sha256, "includes": [{"file": file, "sha256": digest} for file, digest in includes]}
    bench.compare("problem", own, {key: stated[key] for key in own})
    bench.compare("problem.identity", carried.loaded.identity, stated["identity"])
    if stated["name"] != bench.problem.name:
        bench.find("problem.name", f"is {stated['name']!r}, the file says {bench.problem.name!r}")
    bench.checked.append("the problem, with what it includes and its samples, by what it means")


def _check_question(bench: Bench) -> None:
    """The question is that of the file, with additions; and what the result states of it is all of it."""
    stated: Mapping[str, Any] = bench.data["problem"]["effective"]
    bench.asked = asked = restated(bench.problem, stated)
    origin = origin_of(asked)
    rebuilt = dict(origin.effective)
    if rebuilt == stated:
        bench.compare("problem.question", origin.question, bench.data["problem"]["question"])
    once = {**stated, "requirements": list(dict.fromkeys(stated["requirements"]))}  # one may be asked for twice
    bench.compare("problem.effective", {**rebuilt, "requirements": list(dict.fromkeys(rebuilt["requirements"]))}, once)
    loaded, given = bench.problem.loaded, bench.problem.space
    space = set_up(loaded, given, settings_of(asked.space), replaced=range(len(given.objectives)))
    required = [item for item in space.requirements if not item.implied]
    for key, own in (("requirements", required), ("rules", space.rules)):
        texts = [item.text for item in own]
        for position, text in enumerate(texts):
            if position >= len(stated[key]) or stated[key][position] != text:
                bench.find(f"problem.effective.{key}", f"lacks {text!r} of the file, or has it elsewhere")
                break
        bench.remarks += [f"asked beyond the file: {text}" for text in stated[key][len(texts) :]]
    _remark(bench, stated, [f"{item.sense} {item.metric.name}" for item in space.objectives])
    bench.checked.append("the question, rebuilt from its words")


def _remark(bench: Bench, stated: Mapping[str, Any], objectives: Sequence[str]) -> None:
    if stated["objectives"] != list(objectives):
        bench.remarks.append(f"asked for other objectives than the file: {', '.join(stated['objectives'])}")
    bench.remarks += [f"fixed beyond the file: {name} = {option}" for name, option in stated["fixed"].items()]
    for name, own in settings_of(bench.problem.space).items():
        if stated.get(name, own) != own:  # one that is left out is a finding already
            bench.remarks.append(f"{name.replace('_', ' ')} {stated[name]}: the file says {own}")


# `dse.verify`: a result checked again, robust or not.
#
# A robust result is one of the worst of all stated values. Each of its points is proved robust over the whole box again
# (`dse.questions.robust.worst_case`), and played through at corners and places inside by the analysis itself. Its
# refuted regions are proved again for the designs that meet demands at corners, by the means of `dse.verification`; a
# design that is found there and is not robust names a corner to demand as well, and the proof begins anew.


MOST_CORNERS = 32
"""The greatest number of corners of the box, and of places inside, that are looked at for each point."""


@arguments.checked(
    result=arguments.STATED,
    problem=arguments.PROBLEM,
    method=arguments.Word(get_args(Method)),
    time_limit_s=arguments.span,
)
def verify(
    result: Result | RobustResult | Mapping[str, Any] | str | Path,
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: arguments.Span | None = None,
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
    return _verify_with(
        data, RobustWitness, problem=problem, method=method, time_limit_s=arguments.time_limit(time_limit_s).seconds
    )


class RobustWitness:
    """Knows of designs whether they are robust, and of a robust result what else it states.

    It uses the proofs over boxes of `dse.questions.robust`, and looks at corners and inside points by the analysis
    alone.
    """

    def __init__(self, problem: Problem, effective: Mapping[str, Any]) -> None:
        self.problem = problem
        self.question = RobustQuestion(restated(problem, effective), partial(restated, effective=effective))

    def evaluator(self) -> Evaluator:
        """The evaluator of designs that meet what is demanded so far: all robust ones, and fewer and fewer others.

        A new evaluator of the question with all demands at corners that were learnt so far.
        """
        return self.question.evaluator()

    def learn(self, design: Design) -> bool:
        """Whether a design is not robust; then what it breaks is demanded from now on.

        Demands are added to the question at the corners where the design breaks them.
        """
        return self.question.learn(design)

    def broken(self, design: Design) -> list[str]:
        """The violations of a design for some of the stated values: by the proof, and at sampled places.

        Sentences with requirement, value and unit. An empty list means: proved over the whole ranges, and no sampled
        place contradicts the proof.
        """
        failures = self.question.failures(0, design)
        if failures:
            return [
                f"violates {item.requirement!r} for some stated values: {item.value} {item.unit}" for item in failures
            ]
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
            broken = function.broken(function.compared(values, function.outputs.bounds))
            if broken:
                return [f"violates {self.question.space.requirements[broken[0].requirement].text!r} at {_at(place)}"]
        return []

    def check(self, bench: Bench, method: Method, deadline: float | None) -> None:
        """Check the inputs, the nominal front and the price of robustness of a robust result.

        The nominal front is verified as a result of its own, without robustness; lost and kept designs and the price
        are recomputed and compared.
        """
        nominal = self._check_nominal(bench, method, deadline)
        stated = bench.data["robust"]
        unjudged = stated.get("unjudged", [])
        if unjudged and bench.data["status"] != "incomplete" and not bench.under_way:
            bench.find("robust.unjudged", "there is none where the search was not stopped")
        lost = [
            written(Failure, failure)
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
