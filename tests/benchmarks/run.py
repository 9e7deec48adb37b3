"""Measurements, each in a fresh process; peers take turns, so that whatever else the machine does falls on all."""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from . import cases
from .cases import ROOT, Case
from .fronts import hypervolume
from .minizinc import installed

Say = Callable[[str], None]
Save = Callable[[Any], None]
"""Takes what a part has measured so far: a run that is stopped keeps it."""
GRACE_S = 120.0
MOST_DESIGNS = 5 * 10**7
MINIZINC_THREADS = 30
"""Larger problems are not given to MiniZinc."""
LOOPS: dict[str, dict[str, Any]] = {
    "plain model, 1 worker": {"model": "plain", "workers": 1},
    "plain model, all cores": {"model": "plain", "workers": 0},
    "our model, 1 worker": {"model": "our", "workers": 1},
}
"""How the textbook loop is run."""
MINIZINC = "MiniZinc"


def measure(task: str, case: Case, **options: Any) -> dict[str, Any]:
    """The outcome of one worker process; ``{"failed": why}`` when it died."""
    text = json.dumps({"task": task, "case": asdict(case), **options})
    command = [sys.executable, "-m", "tests.benchmarks.worker"]
    try:
        done = subprocess.run(
            command,
            input=text,
            capture_output=True,
            text=True,
            cwd=ROOT,
            timeout=(options.get("limit_s", 0.0) * 2 + 600 * (case.threads >= 1000)) * crowding() + GRACE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return {"failed": "did not stop in time"}
    if done.returncode:
        return {"failed": (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]}
    outcome: dict[str, Any] = json.loads(done.stdout)
    return outcome


def crowding() -> float:
    """How many processes want each core just now, at least 1."""
    waiting = os.getloadavg()[0] / (os.cpu_count() or 1) if hasattr(os, "getloadavg") else 1.0
    return max(1.0, waiting)


def spread(values: list[float]) -> dict[str, float]:
    """Median, least and most."""
    if not values:
        return {}
    return {"median": statistics.median(values), "least": min(values), "most": max(values), "runs": len(values)}


def run_fronts(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Ours against the other exact ones, then the genetic algorithms with our time and ten times that."""
    rows: list[dict[str, Any]] = []
    for case in cases.fronts(quick=options.quick, seed=options.seed):
        if options.match not in case.name:
            continue
        row = _one_front(case, options)
        rows.append(row)
        save(rows)
        say(_line(row))
    return rows


def _one_front(case: Case, options: Any) -> dict[str, Any]:
    ours: list[dict[str, Any]] = []
    peers = {name: partial(measure, "textbook", case, limit_s=options.limit, **loop) for name, loop in LOOPS.items()}
    left_out = _why_not_minizinc(case, options)
    if not left_out:
        peers[MINIZINC] = partial(measure, "minizinc", case, limit_s=options.limit)
    loops: dict[str, list[dict[str, Any]]] = {name: [] for name in peers}
    for _ in range(options.repeats):
        for workers in (1, 2):
            ours.append({**measure("ours", case, limit_s=options.limit, workers=workers), "workers": workers})
        for name, runs in loops.items():
            if not runs or runs[-1].get("is_complete"):  # what has not ended once is not asked again
                runs.append(peers[name]())
    full = measure("exhaustive", case, limit_s=options.limit, most_designs=MOST_DESIGNS)
    good = [run for run in ours if "failed" not in run]
    row: dict[str, Any] = {"case": case.name, "failed": [run["failed"] for run in ours if "failed" in run]}
    if not good:
        return row
    front = [tuple(point) for point in good[0]["front"]]
    row.update({key: good[0][key] for key in ("is_complete", "gap", "variables", "constraints", "calls", "all_calls")})
    row["points"] = len(front)
    for workers in (1, 2):
        mine = [run for run in good if run["workers"] == workers]
        keys = ("build_s", "import_s", "encode_s", "proof_s", "enumerate_s", "report_s", "peak_mb")
        row[f"ours_{workers}"] = {key: spread([run[key] for run in mine]) for key in keys}
    row["same_every_time"] = all(run["front"] == good[0]["front"] for run in good if run["is_complete"])
    row["textbook"] = {name: _loop(runs, good) for name, runs in loops.items() if name in LOOPS}
    row["minizinc"] = {"left_out": left_out} if left_out else _minizinc(loops[MINIZINC], good)
    row["exhaustive"] = {key: full.get(key) for key in ("is_complete", "designs", "seconds", "combinations", "failed")}
    row["checked_by"] = _checks(front, row, loops, full)
    if row["is_complete"] and options.genetic:
        row["genetic"] = _genetic(case, row, front, options)
    return row


def _loop(runs: list[dict[str, Any]], good: list[dict[str, Any]]) -> dict[str, Any]:
    """A textbook loop: seconds, and how many times ours it took, repeat by repeat, against one worker of ours."""
    fine = [run for run in runs if "failed" not in run]
    if not fine:
        return {"failed": [run["failed"] for run in runs]}
    ours = [run for run in good if run["workers"] == 1]
    ratios = [loop["seconds"] / mine["proof_s"] for loop, mine in zip(fine, ours, strict=False) if mine["proof_s"] > 0]
    return {
        "seconds": spread([run["seconds"] for run in fine]),
        "is_complete": fine[0]["is_complete"],
        "points": len(fine[0]["front"]),
        "calls": fine[0]["calls"],
        "times_ours": spread(ratios),
        "peak_mb": spread([run["peak_mb"] for run in fine]),
    }


def _minizinc(runs: list[dict[str, Any]], good: list[dict[str, Any]]) -> dict[str, Any]:
    """As a textbook loop, and which solver, and its seconds without starting MiniZinc and flattening for every call."""
    made = _loop(runs, good)
    if "seconds" in made:
        fine = [run["solver_s"] for run in runs if "failed" not in run]
        ours = [run["proof_s"] for run in good if run["workers"] == 1]
        made["solver"] = runs[0]["solver"]
        made["solver_s"] = spread(fine)
        made["solver_times_ours"] = spread([one / other for one, other in zip(fine, ours, strict=False) if other > 0])
    return made


def _why_not_minizinc(case: Case, options: Any) -> str:
    if not options.minizinc:
        return "left out"
    if installed() is None:
        return "not installed"
    return "" if case.threads <= MINIZINC_THREADS else "not asked"


def _checks(front: list[Any], row: dict[str, Any], loops: dict[str, list[dict[str, Any]]], full: dict[str, Any]) -> str:
    """Who confirms the front; a front that anybody contradicts is reported in capitals."""
    known = set(front)
    said = []
    if not row["same_every_time"]:
        said.append("NOT THE SAME IN EVERY RUN")
    if full.get("is_complete"):
        same = known == {tuple(point) for point in full["front"]}
        said.append("brute force" if same else "BRUTE FORCE DISAGREES")
    for name, runs in loops.items():
        peer, whose = ("textbook loop", "the textbook loop") if name in LOOPS else (name, name)
        for run in runs:
            found = {tuple(point) for point in run.get("front", ())}
            if "failed" in run or not found:
                continue
            if run["is_complete"] and row["is_complete"]:
                said.append(peer if found == known else f"{peer.upper()} DISAGREES")
            elif row["is_complete"]:
                said.append(f"{len(found)} points of {whose}" if found <= known else f"{peer.upper()} DISAGREES")
    return ", ".join(dict.fromkeys(said)) or "nobody"


def _genetic(case: Case, row: dict[str, Any], front: list[Any], options: Any) -> dict[str, Any]:
    """Medians over seeds for both algorithms and both times."""
    made: dict[str, Any] = {}
    ours_s = max(0.2, row["ours_1"]["proof_s"]["median"])
    for algorithm in ("nsga2", "nsga3"):
        for factor in (1, 10):
            limit = ours_s * factor
            if limit > options.limit * 2:
                continue
            seeds = range(1, 1 + min(3, options.repeats))
            runs = [measure("genetic", case, limit_s=limit, solver_seed=seed, algorithm=algorithm) for seed in seeds]
            fine = [run for run in runs if "failed" not in run]
            if not fine:
                return {"failed": runs[0]["failed"]}
            shares = [len({tuple(point) for point in run["front"]} & set(front)) / len(front) for run in fine]
            volumes = [hypervolume(run["front"], front) for run in fine]
            made[f"{algorithm} x{factor}"] = {
                "limit_s": limit,
                "share_of_true_front": spread(shares),
                "hypervolume": spread([volume for volume in volumes if volume is not None]),
                "designs": spread([run["designs"] for run in fine]),
            }
    return made


def _line(row: dict[str, Any]) -> str:
    if "points" not in row:
        return f"{row['case']}: FAILED {row['failed']}"
    ratios = [
        f"{item['times_ours']['median']:.1f}x{'' if item['is_complete'] else '+'}"
        for item in row["textbook"].values()
        if item.get("times_ours")
    ]
    state = "proved" if row["is_complete"] else f"gap {row['gap']}"
    seconds = row["ours_1"]["proof_s"]["median"]
    return f"{row['case']}: {row['points']} points, {state}, {seconds:.2f} s, textbook {ratios}, {row['checked_by']}"


def run_curves(options: Any, say: Say, save: Save) -> dict[str, list[dict[str, Any]]]:
    """Time and memory along each series; the gap where a search did not end."""
    made: dict[str, list[dict[str, Any]]] = {}
    limits = [60.0, 600.0] if options.long else [options.limit]
    for name, series in cases.curves(quick=options.quick, seed=options.seed).items():
        made[name] = []
        for value, case in series:
            for limit in limits if options.match in case.name else ():
                row = {"value": value, **_on_curve(case, limit, options.repeats)}
                made[name].append(row)
                save(made)
                shown = {key: row.get(key) for key in ("limit_s", "points", "is_complete", "gap", "failed")}
                say(f"{name} = {value}: {json.dumps(shown)}")
                if row.get("is_complete"):
                    break
    return made


def _on_curve(case: Case, limit_s: float, repeats: int) -> dict[str, Any]:
    """One point of a curve; what does not end in time is not repeated."""
    runs: list[dict[str, Any]] = []
    while len(runs) < repeats and (not runs or runs[-1].get("is_complete")):
        runs.append(measure("ours", case, limit_s=limit_s, workers=1))
    fine = [run for run in runs if "failed" not in run]
    row: dict[str, Any] = {"case": case.name, "limit_s": limit_s}
    row["failed"] = [run["failed"] for run in runs if "failed" in run]
    if fine:
        row.update({key: spread([run[key] for run in fine]) for key in ("build_s", "encode_s", "proof_s", "peak_mb")})
        row.update({key: fine[0][key] for key in ("is_complete", "gap", "calls", "variables", "constraints")})
        row["points"] = len(fine[0]["front"])
    return row


def run_analysis(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Designs per second."""
    rows = []
    for case in (cases.INMARK, cases.generated("event-driven", 100, 3, options.seed)):
        runs = [measure("analysis", case, designs=400_000, singles=300) for _ in range(options.repeats)]
        fine = [run for run in runs if "failed" not in run]
        keys = ("build_s", "per_second", "singles_per_second")
        row = {"case": case.name, **{key: spread([run[key] for run in fine]) for key in keys}}
        rows.append(row)
        save(rows)
        say(json.dumps(row))
    return rows


RUN = "from dse.cli.entry import main; main()"
IMPORT = "import ortools.sat.python.cp_model"
STARTS = {
    IMPORT: [IMPORT],
    "dse --help": [RUN, "--help"],
    "dse check problems/inmark.yaml": [RUN, "check", "problems/inmark.yaml"],
    "dse solve problems/inmark.yaml --max-jitter 20ms": [RUN, "solve", "problems/inmark.yaml", "--max-jitter", "20ms"],
}


def run_startup(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Whole processes, in turns; and their multiples of importing the solver.

    Processor seconds are those of the process, user and system: other work on the machine does not count in them.
    """
    seconds: dict[str, list[float]] = {name: [] for name in STARTS}
    worked: dict[str, list[float]] = {name: [] for name in STARTS}
    for _ in range(max(5, options.repeats * 2)):
        for name, arguments in STARTS.items():
            started, before = time.perf_counter(), processor_s()
            done = subprocess.run([sys.executable, "-c", *arguments], cwd=ROOT, capture_output=True, check=False)
            if done.returncode == 0:
                seconds[name].append(time.perf_counter() - started)
                worked[name].append(processor_s() - before)
    rows = []
    for name, measured in seconds.items():
        ratios = [one / other for one, other in zip(measured, seconds[IMPORT], strict=False)]
        row = {"command": name, "seconds": spread(measured), "times_import": spread(ratios)}
        rows.append({**row, "processor_seconds": spread(worked[name])})
        save(rows)
        say(json.dumps(rows[-1]))
    return rows


def processor_s() -> float:
    """User and system seconds of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def write(folder: Path, record: dict[str, Any], text: str, name: str) -> None:
    """The record as JSON and the tables as Markdown."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
