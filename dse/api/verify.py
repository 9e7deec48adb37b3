"""`dse.verify`: a result checked against its problem by the analysis alone, its completeness proved a second time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.api.belonging import Belonging, belonging, carried_digests, carried_problem
from dse.api.completeness import check_claims
from dse.api.conflicts import check_conflicts
from dse.api.contention import check_contention
from dse.api.insisting import check_insisting
from dse.api.nearby import check_others
from dse.api.origins import origin_of
from dse.api.points import MOST_FINDINGS, Bench, Witness, check_front, check_statements
from dse.api.problem import Problem, set_up
from dse.api.stated import restated
from dse.errors import UsageError
from dse.records import dataclass
from dse.results.forms.agreement import check_whole
from dse.results.reading import check_semantics, read_stated
from dse.results.solve import Result
from dse.results.verify import Finding, Verification
from dse.space.settings import settings_of
from dse.timelimit import OutOfTime, TimeLimit, until
from dse.verification.prover import Method


def verify_with(
    result: Result | Mapping[str, Any] | str | Path,
    robust: Callable[[Problem, Mapping[str, Any]], Witness],
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: float | None = None,
) -> Verification:
    """Check a result; `robust` makes the witness of a robust question. See `dse.study.verify.verify`."""
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
        found = belonging(data, name, problem)
        bench = _checked(data, found, name, Means(robust, method, limit))
    status = "rejected" if bench.findings else "unfinished" if bench.left_open else "verified"
    return Verification(
        result=name,
        problem="the problem that the result itself carries" if found.is_carried else str(found.problem.loaded.path),
        status=status,  # type: ignore[arg-type]
        findings=tuple(bench.findings),
        checked=tuple(bench.checked),
        left_open=tuple(bench.left_open),
        remarks=tuple(bench.remarks),
        wall_s=round(time.monotonic() - started, 3),
    )


@dataclass(frozen=True)
class Means:
    """By what a result is checked: the witness of a robust question, the method of the second proof, until when."""

    robust: Callable[[Problem, Mapping[str, Any]], Witness]
    method: Method
    limit: TimeLimit


def _checked(data: Mapping[str, Any], found: Belonging, name: str, means: Means) -> Bench:
    """All checks, one after the other; later ones need what earlier ones found sound."""
    bench = Bench(data, found.problem, has_moved=not found.is_same_text or _is_of_a_model(found))
    method, limit = means.method, means.limit
    checks: dict[str, Callable[[], None]] = {
        "the question": lambda: _check_question(bench),
        "objectives, units and status": lambda: check_statements(bench),
        "whether it is robust": lambda: _check_robust(bench, means),
        "the points": lambda: check_front(bench),
        "other designs": lambda: check_others(bench, method, limit.deadline),
        "the fronts with one option each": lambda: check_insisting(bench, method, limit.deadline),
        "contention": lambda: check_contention(bench, limit.deadline),
        "what robustness costs": lambda: _check_costs(bench, means),
        "that nothing is missing": lambda: check_claims(bench, method, limit.deadline),
        "conflicts": lambda: check_conflicts(bench, method, limit.deadline),
    }
    waiting = dict(checks)
    try:
        _check_problem(bench, found, name)
        if found.differs:
            return bench  # nothing else would agree
        for what, check in checks.items():
            limit.check()
            check()
            del waiting[what]
    except OutOfTime:
        bench.left_open.append(f"the time was too short; not looked at to the end: {', '.join(waiting)}")
    except UsageError as error:
        bench.find("problem.effective", str(error))
    return bench


def _is_of_a_model(found: Belonging) -> bool:
    """Whether the result carries what was imported, whose lines are not those of the model."""
    return found.is_carried and found.problem.loaded.spec.imported is not None


def _check_robust(bench: Bench, means: Means) -> None:
    """Whoever knows what holds for all stated values is there where that is asked."""
    assert bench.asked is not None
    if bench.asked.robust:
        bench.witness = means.robust(bench.problem, bench.data["problem"]["effective"])
    elif "robust" in bench.data:
        bench.find("robust", "is stated, but the question is not robust")


def _check_costs(bench: Bench, means: Means) -> None:
    """What a robust result says of the nominal front and of the difference."""
    if bench.witness is not None:
        bench.witness.check(bench, means.method, means.limit.deadline)


def _check_problem(bench: Bench, found: Belonging, name: str) -> None:
    """That the problem means what the one that was solved meant, and what the result says of its files is true."""
    stated = bench.data["problem"]
    for text in found.differs:
        bench.find("problem.identity", f"{bench.problem.loaded.path} is not the problem that was solved: {text}")
    if found.is_carried:
        lacking = f"{', '.join(found.absent)}, which {stated['file']} names," if found.absent else ""
        bench.left_open.append(
            f"{lacking or 'the problem file ' + stated['file']} is not there: this is what the result itself carries, "
            "and a forgery of both would pass"
        )
    if not found.is_carried and not found.is_same_text and not found.differs:
        bench.remarks.append(f"{bench.problem.loaded.path} has changed since, in comments, layout or paths only")
    try:
        carried = carried_problem(bench.data, name)
    except UsageError as error:
        bench.find("files", str(error))
        return
    if carried is not None:
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
    space = set_up(bench.problem, settings_of(asked.space), replaced=range(len(bench.problem.space.objectives)))
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
