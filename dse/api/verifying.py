"""`dse.verify`: a result checked against its problem by the analysis alone, its completeness proved a second time."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dse.api.claims import check_claims
from dse.api.clashes import check_conflicts
from dse.api.contention import check_contention
from dse.api.origins import origin_of
from dse.api.problem import Problem, load, set_up
from dse.api.recalling import restated
from dse.api.recomputing import Bench, check_front, check_others, check_statements
from dse.errors import UsageError
from dse.results.reading import read_result
from dse.results.result import Result
from dse.results.verification import Verification
from dse.space.settings import settings_of
from dse.verification.prover import Method


def verify(
    result: Result | Mapping[str, Any] | str | Path,
    *,
    problem: Problem | str | Path | None = None,
    method: Method = "auto",
    time_limit_s: float | None = None,
) -> Verification:
    """Check a result without trusting the solver or the encoding that made it.

    The problem is read again and compared by its hash, the question rebuilt, every figure of every point recomputed
    by the analysis alone. Then the claim that nothing is missing: points and refuted regions must leave no part of
    the objective space uncovered (integer geometry), and that the refuted regions are empty is proved again, by
    looking at every design or by a second model.

    Parameters
    ----------
    result
        a result, its dictionary, or the file that it was written to.
    problem
        the problem, where it is no longer where the result says.
    method
        ``exhaustion`` looks at every design, ``model`` asks a second model; ``auto`` looks where there are few enough.
    time_limit_s
        for the second model, in seconds.

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
    started = time.monotonic()
    deadline = None if time_limit_s is None else started + time_limit_s
    if isinstance(result, Result):
        data, name, folder = result.to_dict(), "the result", Path()
    elif isinstance(result, Mapping):
        data, name, folder = dict(result), "the result", Path()
    else:
        data, name, folder = read_result(result), str(result), Path(result).parent
    loaded = _problem(data, folder, problem)
    bench = _checked(data, loaded, method, deadline)
    status = "rejected" if bench.findings else "unfinished" if bench.left_open else "verified"
    return Verification(
        result=name,
        problem=str(loaded.loaded.path),
        status=status,  # type: ignore[arg-type]
        findings=tuple(bench.findings),
        checked=tuple(bench.checked),
        left_open=tuple(bench.left_open),
        remarks=tuple(bench.remarks),
        wall_s=round(time.monotonic() - started, 3),
    )


def _checked(data: Mapping[str, Any], loaded: Problem, method: Method, deadline: float | None) -> Bench:
    """All checks, one after the other; later ones need what earlier ones found sound."""
    bench = Bench(data, loaded)
    try:
        _check_files(bench)
        asked = restated(loaded, data["problem"]["effective"])
        _check_question(bench, asked)
        check_statements(bench, asked)
        check_front(bench)
        check_others(bench)
        check_contention(bench, deadline)
        check_claims(bench, method, deadline)
        check_conflicts(bench, method, deadline)
    except UsageError as error:
        bench.find("problem.effective", str(error))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        bench.find("the result", f"is not whole or not of the form dse-result/1 ({type(error).__name__}: {error})")
    return bench


def _problem(data: Mapping[str, Any], folder: Path, given: Problem | str | Path | None) -> Problem:
    """The problem as given, where the result says, or beside the result; of several the one with the stated hash."""
    if isinstance(given, Problem):
        return given
    if given is not None:
        return load(given)
    stated = data.get("problem")
    named = stated.get("file") if isinstance(stated, dict) else None
    if not isinstance(named, str):
        raise UsageError("the result does not name its problem file; name it with --problem")
    candidates = [Path(named), folder / named, folder / Path(named).name]
    found = [load(path) for path in dict.fromkeys(candidates) if path.is_file()]
    if not found:
        raise UsageError(f"the problem file {named} is not there; name it with --problem")
    assert isinstance(stated, dict)
    return next((item for item in found if item.loaded.sha256 == stated.get("sha256")), found[0])


def _check_files(bench: Bench) -> None:
    """The very files that were solved."""
    stated, loaded = bench.data["problem"], bench.problem.loaded
    if stated["sha256"] != loaded.sha256:
        bench.find("problem.sha256", f"{loaded.path} has another content than the problem that was solved")
    then = [(item["file"], item["sha256"]) for item in stated["includes"]]
    for file, digest in loaded.includes:
        if (file, digest) not in then:
            bench.find("problem.includes", f"{file} has another content than when the problem was solved")
    if len(then) != len(loaded.includes):
        bench.find("problem.includes", f"{len(then)} files are stated, the problem includes {len(loaded.includes)}")
    if stated["name"] != bench.problem.name:
        bench.find("problem.name", f"is {stated['name']!r}, the file says {bench.problem.name!r}")
    bench.checked.append("the problem file and what it includes, by their hashes")


def _check_question(bench: Bench, asked: Problem) -> None:
    """The question is that of the file, with additions; and what the result states of it is all of it."""
    stated: Mapping[str, Any] = bench.data["problem"]["effective"]
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
