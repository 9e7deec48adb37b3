"""Outcomes of runs as they come back from a store or another machine: plain data of the very form that runs have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dse.files.plain_json import parse_json
from dse.results.forms.agreement import mistakes_in_run

RANKED = {"rank": 1, "score": ""}
"""What an outcome does not say: how the sweep that it belongs to ranks its designs."""


class OutcomeError(ValueError):
    """A text that is no outcome of a run."""


def read_outcome(text: str) -> dict[str, Any]:
    """The outcome that a run has written, see `SweepRun.outcome`.

    Raises
    ------
    OutcomeError
        when it is none; what it says may still be wrong.
    """
    try:
        data = parse_json(text)
    except ValueError as error:
        raise OutcomeError(f"not JSON: {error}") from error
    if not isinstance(data, dict) or data.get("kind") not in ("front", "breaks", "error"):
        raise OutcomeError("it is of no known kind")
    for mistake in mistakes_in_run(_as_run(data)):
        raise OutcomeError(str(mistake))
    return data


def _as_run(data: Mapping[str, Any]) -> dict[str, Any]:
    """An outcome as ``dse-sweep/1`` has it, alone and in the order in which it is."""
    run = {**data, "values": {}, "change": None}
    if isinstance(data.get("front"), list):
        run["front"] = [_ranked(item) for item in data["front"]]
    if isinstance(data.get("stretches"), list):
        run["stretches"] = [
            {"best": _first(item), **item, "front": [_ranked(entry) for entry in item["front"]]}
            if isinstance(item, dict) and isinstance(item.get("front"), list)
            else item
            for item in data["stretches"]
        ]
    return run


def _ranked(item: Any) -> Any:
    return {**RANKED, **item} if isinstance(item, dict) else item


def _first(stretch: Mapping[str, Any]) -> Any:
    """The design that stands first in a stretch, if it is one."""
    entry = next(iter(stretch["front"]), None)
    return entry.get("id") if isinstance(entry, dict) else None
