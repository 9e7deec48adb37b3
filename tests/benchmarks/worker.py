"""One measurement in a process of its own: a task as JSON on standard input, the outcome as JSON on standard output."""

from __future__ import annotations

import json
import resource
import sys
import time
from typing import Any

from .cases import ROOT, Case

STARTED = time.perf_counter()


def main() -> None:
    """Run the task."""
    task = json.load(sys.stdin)
    outcome = TASKS[task["task"]](Case(**task["case"]), task)
    used = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    outcome["peak_mb"] = max(used) / 1024  # of this process, or of the largest that it started
    json.dump(outcome, sys.stdout)


def _load(case: Case) -> tuple[Any, float, float]:
    """The problem, the seconds to import what reads it, and those to build it."""
    started = time.perf_counter()
    from dse.questions.problem import changed, load, loads
    from dse.questions.question import QuestionChanges

    imported = time.perf_counter()
    text = "" if case.file else case.text()
    drawn = time.perf_counter()
    problem = loads(text) if text else load(ROOT / case.file)
    if case.file:  # the peers know no waiting
        limits = [("jitter", case.max_jitter)] if case.max_jitter else []
        problem = changed(problem, QuestionChanges(limits=limits, processing="execution_time"))
    return problem, imported - started, time.perf_counter() - drawn


def _ours(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    problem, _, build_s = _load(case)
    started = time.perf_counter()
    from dse.analysis.evaluate import Evaluator
    from dse.encode.model import encode
    from dse.questions.verbs.solve import result_of
    from dse.search.front import Progress, SearchLimits, Watch, search_front
    from dse.support.timelimit import TimeLimit

    import_s = time.perf_counter() - started
    started = time.perf_counter()
    evaluator = Evaluator(problem.space)
    encoded = encode(evaluator)
    encode_s = time.perf_counter() - started
    proof = {"seconds": 0.0, "calls": 0}

    def watch(progress: Progress) -> None:
        proof.update(seconds=progress.elapsed_s, calls=progress.calls)

    budget = SearchLimits(TimeLimit.after(task["limit_s"]), task.get("solver_seed", 0), task.get("workers", 1))
    started = time.perf_counter()
    search = search_front(evaluator, budget, Watch(watch))
    search_s = time.perf_counter() - started
    started = time.perf_counter()
    result = result_of(problem, evaluator, search, budget)
    text = result.to_json()
    report_s = time.perf_counter() - started
    signs = [-1 if item.sense == "maximise" else 1 for item in problem.space.objectives]
    points = [tuple(sign * value for sign, value in zip(signs, point, strict=True)) for point in search.points]
    from .fronts import certified_gap

    return {
        "build_s": build_s,
        "import_s": import_s,
        "encode_s": encode_s,
        "proof_s": max(0.0, proof["seconds"]),
        "enumerate_s": search_s,
        "report_s": report_s,
        "report_bytes": len(text),
        "calls": proof["calls"],
        "all_calls": search.calls,
        "front": sorted(points),
        "is_complete": search.is_complete,
        "gap": certified_gap(points, search.floors),
        "open_regions": len(search.unexplored),
        "variables": len(encoded.model.proto.variables),
        "constraints": len(encoded.model.proto.constraints),
    }


def _textbook(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from dse.analysis.evaluate import Evaluator

    from .asking import by_cp_sat
    from .textbook import textbook_front

    evaluator = Evaluator(_load(case)[0].space)
    return textbook_front(evaluator, task["limit_s"], by_cp_sat(task["workers"]), task["model"])


def _ours_contended(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    """Our search with one worker; with `way`, what it does about deadlines is replaced by what a peer does.

    It ends by the clock, later on a machine with other work; peers end by processor time.
    """
    problem, _, _ = _load(case)
    from dse.analysis.evaluate import Evaluator
    from dse.search.front import SearchLimits, search_front
    from dse.support.timelimit import TimeLimit

    from .contended import in_our_search
    from .run import crowding

    limit = TimeLimit.after(task["limit_s"] * crowding())
    began = time.process_time()
    with in_our_search(task.get("way", "")):
        search = search_front(Evaluator(problem.space), SearchLimits(limit))
    signs = [-1 if item.sense == "maximise" else 1 for item in problem.space.objectives]
    return {
        "worked_s": time.process_time() - began,
        "front": sorted(
            tuple(sign * value for sign, value in zip(signs, point, strict=True)) for point in search.points
        ),
        "is_complete": search.is_complete,
    }


def _contended(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from dse.analysis.evaluate import Evaluator

    from .contended import contended_front

    return contended_front(Evaluator(_load(case)[0].space), task["limit_s"], task["peer"])


def _classical(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from .classical import PEERS, epsilon_front, model_of

    return epsilon_front(model_of(case), task["limit_s"], **PEERS[task["peer"]])


def _minizinc(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from dse.analysis.evaluate import Evaluator

    from .minizinc import MiniZinc, installed
    from .textbook import textbook_front

    solver = installed()
    assert solver is not None
    ask = MiniZinc(solver)
    made = textbook_front(Evaluator(_load(case)[0].space), task["limit_s"], ask, "plain")
    return {**made, "solver": f"{solver.text}, MiniZinc {solver.minizinc}", "solver_s": ask.solver_s}


def _genetic(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from dse.analysis.evaluate import Evaluator

    from .genetic import genetic_front

    evaluator = Evaluator(_load(case)[0].space)
    return genetic_front(evaluator, task["limit_s"], task["solver_seed"], task["algorithm"])


def _exhaustive(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    from dse.analysis.evaluate import Evaluator

    from .exhaustive import combinations, exhaustive_front

    evaluator = Evaluator(_load(case)[0].space)
    count = combinations(evaluator)
    if count > task["most_designs"]:
        return {"front": [], "is_complete": False, "designs": 0, "seconds": 0.0, "combinations": count}
    return {**exhaustive_front(evaluator, task["limit_s"]), "combinations": count}


def _analysis(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    """Designs evaluated per second, vectorised and one by one, on the same random designs."""
    import numpy as np

    from dse.analysis.evaluate import Evaluator
    from tests.benchmarks.vectorised import VectorisedEvaluator

    space = _load(case)[0].space
    evaluator = Evaluator(space)
    started = time.perf_counter()
    tables = VectorisedEvaluator(evaluator)
    build_s = time.perf_counter() - started
    rng = np.random.default_rng(1)
    designs = np.stack([rng.integers(0, len(item.options), task["designs"]) for item in space.decisions], axis=1)
    started = time.perf_counter()
    batch = tables.evaluate(designs)
    many_s = time.perf_counter() - started
    few = designs[: task["singles"]]
    started = time.perf_counter()
    evaluations = [evaluator.evaluate(tuple(map(int, row))) for row in few]
    one_s = (time.perf_counter() - started) / len(few)
    assert [item.is_feasible for item in evaluations] == batch.is_feasible[: len(few)].tolist()
    return {"build_s": build_s, "per_second": len(designs) / many_s, "singles_per_second": 1 / one_s}


def _heuristics(case: Case, task: dict[str, Any]) -> dict[str, Any]:
    """Our search with one worker and without a heuristic; what it takes, in seconds and in counts that do not vary."""
    problem, _, _ = _load(case)
    from unittest.mock import patch

    from ortools.sat.python import cp_model

    from dse.analysis.evaluate import Evaluator
    from dse.search.front import SearchLimits, search_front
    from dse.support.timelimit import TimeLimit
    from tests.helpers.tuned import tuning_with

    from .run import crowding

    solved, deterministic, solve = 0, 0.0, cp_model.CpSolver.solve

    def counted(self: cp_model.CpSolver, *given: Any) -> Any:
        nonlocal solved, deterministic
        status = solve(self, *given)
        solved += 1
        deterministic += self.response_proto.deterministic_time
        return status

    tuning = tuning_with({task["without"]: {"is_on": False}} if task["without"] else {})
    limit = TimeLimit.after(task["limit_s"] * crowding())
    began = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    with patch.object(cp_model.CpSolver, "solve", counted):
        search = search_front(Evaluator(problem.space), SearchLimits(limit, tuning=tuning))
    return {
        "user_s": resource.getrusage(resource.RUSAGE_SELF).ru_utime - began,
        "solved": solved,
        "deterministic": deterministic,
        "front": sorted(search.points),
        "is_complete": search.is_complete,
    }


TASKS = {
    "heuristics": _heuristics,
    "ours": _ours,
    "textbook": _textbook,
    "classical": _classical,
    "minizinc": _minizinc,
    "ours contended": _ours_contended,
    "contended": _contended,
    "genetic": _genetic,
    "exhaustive": _exhaustive,
    "analysis": _analysis,
}

if __name__ == "__main__":
    main()
