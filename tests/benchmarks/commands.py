"""The command as users run it: whole processes, without and with a result that is kept while it searches."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .cases import ROOT, Case, commands
from .run import RUN, Save, Say, processor_s, spread

PLAIN, KEPT = "dse solve -q --workers 1", "dse solve -q --workers 1 --json"


def run_commands(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Processor seconds of both, in turns, and what `--json` takes on top; the answers of all runs must be the same."""
    rows = []
    for case in commands(quick=options.quick, seed=options.seed):
        if options.match in case.name:
            rows.append(_one_case(case, options))
            save(rows)
            say(json.dumps(rows[-1]))
    return rows


def solve_quietly(problem: Path, limit_s: float, more: Sequence[str]) -> tuple[float, float]:
    """Run `PLAIN` on a problem file, with further arguments: the seconds and the processor seconds that it takes."""
    arguments = ["solve", str(problem), "-q", "--workers", "1", "--time-limit", f"{limit_s}s", *more]
    began, before = time.perf_counter(), processor_s()
    subprocess.run([sys.executable, "-c", RUN, *arguments], cwd=ROOT, check=False)
    return time.perf_counter() - began, processor_s() - before


def _one_case(case: Case, options: Any) -> dict[str, Any]:
    worked: dict[str, list[float]] = {PLAIN: [], KEPT: []}
    seconds: dict[str, list[float]] = {PLAIN: [], KEPT: []}
    fronts = []
    with tempfile.TemporaryDirectory() as folder:
        problem, result = ROOT / case.file, Path(folder) / "result.json"
        if not case.file:
            problem = Path(folder) / "problem.yaml"
            problem.write_text(case.text(), encoding="utf-8")
        limit = ["--max-jitter", case.max_jitter.replace(" ", "")] if case.max_jitter else []
        for _ in range(options.repeats):
            for name, more in ((PLAIN, []), (KEPT, ["--json", str(result)])):
                taken = solve_quietly(problem, options.limit, [*limit, *more])
                seconds[name].append(taken[0])
                worked[name].append(taken[1])
            found = json.loads(result.read_text(encoding="utf-8"))
            fronts.append([found["status"], [point["objectives"] for point in found["front"]]])
    ratios = [kept / plain for kept, plain in zip(worked[KEPT], worked[PLAIN], strict=True)]
    return {
        "case": case.name,
        "status": fronts[0][0],
        "points": len(fronts[0][1]),
        "bytes": len(json.dumps(found)),
        "agreement": "same every time" if all(front == fronts[0] for front in fronts) else "NOT THE SAME",
        "processor_seconds": {name: spread(values) for name, values in worked.items()},
        "seconds": {name: spread(values) for name, values in seconds.items()},
        "kept_times_plain": spread(ratios),
    }
