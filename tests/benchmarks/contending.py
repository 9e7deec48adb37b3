"""Ours beside others, by processor time and in turns: the peers of `contended.py` with deadlines and open cores."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from .cases import Case, contended
from .contended import PEERS, WAYS
from .run import Save, Say, measure, spread

OURS = "ours"
LEAST_S = 12.0
"""A peer has at least so much processor time."""
TIMES = 12
"""And so many times what ours took: one that has not ended then is slower than any bar asks."""


Run = Callable[..., dict[str, Any]]
"""Solves a case within `limit_s`: the front, whether it is complete, and the processor seconds that it took."""


def run_contention(options: Any, say: Say, save: Save) -> list[dict[str, Any]]:
    """Each case by ours, by ours with a peer's way to meet deadlines, and by the peers."""
    ours = partial(measure, "ours contended")
    others = {name: partial(measure, **task) for name, task in _others()}
    return beside(contended(quick=options.quick, seed=options.seed), ours, others, options, say, save)


def beside(
    cases: Sequence[Case], ours: Run, others: Mapping[str, Run], options: Any, say: Say, save: Save
) -> list[dict[str, Any]]:
    """Each case by ours and by the others, in turns."""
    rows = []
    for case in cases:
        if options.match in case.name:
            rows.append(_one_case(case, ours, others, options))
            save(rows)
            say(_line(rows[-1]))
    return rows


def _one_case(case: Case, mine: Run, others: Mapping[str, Run], options: Any) -> dict[str, Any]:
    runs: dict[str, list[dict[str, Any]]] = {}
    for _ in range(options.repeats):
        ours = mine(case=case, limit_s=options.limit)
        runs.setdefault(OURS, []).append(ours)
        limit = min(options.limit, max(LEAST_S, TIMES * ours.get("worked_s", 0.0)))
        for name, other in others.items():
            known = runs.setdefault(name, [])
            if not known or known[-1].get("is_complete"):  # what has not ended once is not asked again
                known.append(other(case=case, limit_s=limit))
    good = [run for run in runs[OURS] if "failed" not in run]
    if not good:
        return {"case": case.name, "failed": [run["failed"] for run in runs[OURS]]}
    front = {tuple(point) for point in good[0]["front"]}
    return {
        "case": case.name,
        "points": len(front),
        "is_complete": good[0]["is_complete"],
        "agreement": _agreement(front, good[0]["is_complete"], runs),
        "ways": {name: _way(found, good) for name, found in runs.items()},
    }


def _others() -> Iterator[tuple[str, dict[str, Any]]]:
    for name in WAYS:
        yield f"ours with {name}", {"task": "ours contended", "way": name}
    for name in PEERS:
        yield name, {"task": "contended", "peer": name}


def _way(runs: list[dict[str, Any]], good: list[dict[str, Any]]) -> dict[str, Any]:
    fine = [run for run in runs if "failed" not in run]
    if not fine:
        return {"failed": [run["failed"] for run in runs]}
    made = {
        "worked_s": spread([run["worked_s"] for run in fine]),
        "times_ours": spread([run["worked_s"] / mine["worked_s"] for run, mine in zip(fine, good, strict=False)]),
        "is_complete": fine[0]["is_complete"],
        "points": len(fine[0]["front"]),
    }
    return made | {key: fine[0][key] for key in ("calls", "refused", "solver_s") if key in fine[0]}


def _agreement(front: set[tuple[int, ...]], is_complete: bool, runs: dict[str, list[dict[str, Any]]]) -> str:
    """Who has the same front; what did not end has some of its points."""
    said = []
    for name, found in runs.items():
        for run in found:
            if "failed" in run or not is_complete:
                continue
            points = {tuple(point) for point in run["front"]}
            same = points == front if run["is_complete"] else name.startswith(OURS) or points <= front
            if not same:
                said.append(f"{name.upper()} DISAGREES")
            elif run["is_complete"] and name != OURS:
                said.append(name)
    return ", ".join(dict.fromkeys(said)) or "nobody ended"


def _line(row: dict[str, Any]) -> str:
    if "ways" not in row:
        return f"{row['case']}: FAILED {row['failed']}"
    ways = {
        name: way.get("failed") or f"{way['worked_s']['median']:.1f} s, {way['points']} points, {way['is_complete']}"
        for name, way in row["ways"].items()
    }
    return f"{row['case']}: {row['points']} points, {row['agreement']}: {json.dumps(ways)}"
