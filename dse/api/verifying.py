"""`dse.verify`: a result checked against its problem by the analysis alone, its completeness proved a second time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.api.belonging import Belonging, belonging, carried_digests, carried_problem
from dse.api.claims import check_claims
from dse.api.clashes import check_conflicts
from dse.api.contention import check_contention
from dse.api.nearby import check_others
from dse.api.origins import origin_of
from dse.api.problem import Problem, set_up
from dse.api.recalling import restated
from dse.api.recomputing import Bench, check_front, check_statements
from dse.errors import UsageError
from dse.results.reading import read_result
from dse.results.result import Result
from dse.results.verification import Verification
from dse.space.settings import settings_of
from dse.timelimit import OutOfTime, TimeLimit, until
from dse.verification.prover import Method


def verify(
    result: Result | Mapping[str, Any] | str | Path,
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: float | None = None,
) -> Verification:
    """Check a result without trusting the solver or the encoding that made it.

    The problem is read again and what it means compared, the question rebuilt, every figure of every point recomputed
    by the analysis alone. Then the claim that nothing is missing: points and refuted regions must leave no part of
    the objective space uncovered (integer geometry), and that the refuted regions are empty is proved again, by
    looking at every design or by a second model.

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
    """
    started, limit = time.monotonic(), TimeLimit.after(time_limit_s)
    if isinstance(result, Result):
        data, name = result.to_dict(), "the result"
    elif isinstance(result, Mapping):
        data, name = dict(result), "the result"
    else:
        data, name = read_result(result), str(result)
    with until(limit):
        found = belonging(data, name, problem)
        bench = _checked(data, found, name, method, limit)
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


def _checked(data: Mapping[str, Any], found: Belonging, name: str, method: Method, limit: TimeLimit) -> Bench:
    """All checks, one after the other; later ones need what earlier ones found sound."""
    bench = Bench(data, found.problem, has_moved=not found.is_same_text)
    checks: dict[str, Callable[[], None]] = {
        "the question": lambda: _check_question(bench),
        "objectives, units and status": lambda: check_statements(bench),
        "the points": lambda: check_front(bench),
        "other designs": lambda: check_others(bench, method, limit.deadline),
        "contention": lambda: check_contention(bench, limit.deadline),
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
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        bench.find("the result", f"is not whole or not of the form dse-result/1 ({type(error).__name__}: {error})")
    return bench


def _check_problem(bench: Bench, found: Belonging, name: str) -> None:
    """That the problem means what the one that was solved meant, and what the result says of its files is true."""
    stated = bench.data["problem"]
    for text in found.differs:
        bench.find("problem.identity", f"{bench.problem.loaded.path} is not the problem that was solved: {text}")
    if found.is_carried:
        bench.left_open.append(
            f"the problem file {stated['file']} is not there: this is what the result itself carries, and a forgery of "
            "both would pass"
        )
    elif not found.is_same_text and not found.differs:
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
    rebuilt = dict(origin_of(asked).effective)
    once = {**stated, "requirements": list(dict.fromkeys(stated["requirements"]))}  # one may be asked for twice
    bench.compare("problem.effective", {**rebuilt, "requirements": list(dict.fromkeys(rebuilt["requirements"]))}, once)
    space = set_up(bench.problem, settings_of(asked.space))
    for key, own in (("requirements", space.requirements), ("rules", space.rules)):
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
        if stated[name] != own:
            bench.remarks.append(f"{name.replace('_', ' ')} {stated[name]}: the file says {own}")
