"""`dse solve` as users run it beside the exact method of `classical.py`, on knapsacks and assignments: whole processes.

Processor seconds are those of the processes, user and system, with the start of Python and of the solver.
"""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from .cases import Case, classical
from .classical import PEERS
from .commands import solve_quietly
from .contending import beside
from .run import Save, Say, measure, processor_s


def run_classical(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Each case by the command, and by the method in each of its ways."""
    others = {name: partial(_peer, peer=name) for name in PEERS}
    return beside(classical(quick=options.quick, seed=options.seed), command, others, options, say, save)


def command(case: Case, limit_s: float) -> dict[str, Any]:
    """The front that the command writes, as minimised values; it ends by the clock, peers by processor time."""
    with tempfile.TemporaryDirectory() as folder:
        problem, written = Path(folder) / "problem.yaml", Path(folder) / "result.json"
        problem.write_text(case.text(), encoding="utf-8")
        _, worked_s = solve_quietly(problem, limit_s, ["--json", str(written)])
        if not written.exists():
            return {"failed": "no result was written"}
        result = json.loads(written.read_text(encoding="utf-8"))
    signs = {item["name"]: -1 if item["sense"] == "maximise" else 1 for item in result["objectives"]}
    points = [tuple(sign * point["objectives"][name] for name, sign in signs.items()) for point in result["front"]]
    return {
        "front": sorted(points),
        "is_complete": result["status"] == "complete",
        "calls": result["search"]["solver_calls"],
        "worked_s": worked_s,
    }


def _peer(case: Case, limit_s: float, peer: str) -> dict[str, Any]:
    before = processor_s()
    made = measure("classical", case, limit_s=limit_s, peer=peer)
    return {**made, "worked_s": processor_s() - before}
