"""What each heuristic of the search saves: every benchmark with each of them off, as a multiple of the whole search."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tests.helpers.tuned import HEURISTICS

from . import cases
from .cases import Case
from .run import Save, Say, measure, spread

KEYS = ("user_s", "solved", "deterministic")


def run_heuristics(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Processor seconds, calls of CP-SAT and its deterministic time; with all heuristics, then without each."""
    rows: list[dict[str, Any]] = []
    for case in cases.heuristics(quick=options.quick, seed=options.seed):
        if options.match not in case.name:
            continue
        row: dict[str, Any] = {"case": case.name, "all": _measured(case, "", options)}
        rows.append(row)
        say(f"{case.name}: {_told(row['all'])}")
        for name in HEURISTICS:
            found = row[name] = _measured(case, name, options)
            if found.get("front") != row["all"].get("front") and found.get("is_complete", True):
                found["differs"] = "NOT THE SAME"
            save(rows)
            say(f"  without {name}: {_told(found, row['all'])}")
    return rows


def _measured(case: Case, without: str, options: Any) -> dict[str, Any]:
    runs = [measure("heuristics", case, without=without, limit_s=options.limit) for _ in range(options.repeats)]
    fine = [run for run in runs if "failed" not in run]
    if not fine:
        return {"failed": [run["failed"] for run in runs]}
    same = {key: fine[0][key] for key in ("front", "is_complete")}
    return {**same, **{key: spread([run[key] for run in fine]) for key in KEYS}}


def _told(found: dict[str, Any], whole: dict[str, Any] | None = None) -> str:
    """One line: seconds, calls and deterministic time, and their multiples of those with all heuristics."""
    if "failed" in found:
        return f"FAILED {found['failed']}"
    state = "" if found["is_complete"] else "NOT PROVED, "
    shown = [f"{found['user_s']['median']:.2f} s", f"{found['solved']['median']:.0f} calls"]
    shown.append(f"{found['deterministic']['median']:.3f} units")
    if whole is not None and "failed" not in whole:
        shown.append("times " + " / ".join(ratios(found, whole)))
    return state + ", ".join([*shown, *([found["differs"]] if "differs" in found else [])])


def ratios(found: dict[str, Any], whole: dict[str, Any]) -> Iterator[str]:
    """Each figure as a multiple of that with all heuristics."""
    for key in KEYS:
        yield f"{found[key]['median'] / max(whole[key]['median'], 1e-9):.2f}"
