"""Outcomes of runs as they come back from a store or another machine: plain data of the very form that runs have."""

from __future__ import annotations

from typing import Any

from dse.files.plain_json import parse_json
from dse.results.forms.agreement import mistakes_in_outcome


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
    for mistake in mistakes_in_outcome(data):
        raise OutcomeError(str(mistake))
    return data
