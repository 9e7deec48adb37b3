"""One run of a study: everything that it needs as one text, and its outcome as another.

What is shipped to another process or machine is the problem, never the model.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from dse.answers.forms.codec import written
from dse.answers.forms.consistency import mistakes_in_outcome
from dse.answers.studies.run_data import Failure
from dse.questions.problem import changed, loads
from dse.questions.question import QuestionChanges
from dse.questions.sweep.axes import LimitAxis, limited, read_limit_axis
from dse.questions.sweep.break_points import break_points
from dse.questions.sweep.fronts import front_outcome
from dse.questions.sweep.inputs_of_file import effective_text
from dse.questions.sweep.store import run_key, semantics_version
from dse.space.model.space import Space
from dse.support.errors import DseError, ProblemError
from dse.support.files.plain_json import parse_json
from dse.support.timelimit import OutOfTime, look_at_the_clock

OTHER_VERSION = "other version"


@dataclass(frozen=True)
class SweepPoint:
    """One point of a sweep: where it stands, what to solve, and the key of the outcome.

    `point` has the number of the value on each axis; `payload` is what a worker process gets.
    """

    point: tuple[int, ...]
    payload: str

    @property
    def key(self) -> str:
        """The key of the outcome in the store.

        SHA-256 of payload and version of the semantics, in hexadecimal (`run_key`).
        """
        return run_key(self.payload)


def make_payload(
    data: Mapping[str, Any],
    changes: QuestionChanges,
    limits: Sequence[tuple[str, str]],
    exact: tuple[str, str] | None,
    seed: int,
) -> str:
    """A run as text: effective problem, changes, limits and an interval of a limit as (metric, ``OP VALUES``).

    JSON with sorted keys, so that equal runs have equal texts and one key in the store.
    """
    content = {
        "problem": effective_text(data),
        "changes": {name: _plain(value) for name, value in asdict(changes).items()},
        "limits": [list(item) for item in limits],
        "exact": list(exact) if exact is not None else None,
        "seed": seed,
    }
    return json.dumps(content, ensure_ascii=False, sort_keys=True)


def _plain(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def solve_payload(payload: str, semantics: str) -> str:
    """The outcome of a run, as text; the same payload gives the same text, wherever it is solved.

    An effective problem that is not valid is an outcome too (``status`` ``invalid``). `semantics` is the version that
    the caller expects: a machine with another one says so rather than answer.

    Raises
    ------
    OutOfTime
        when the limit of time in force ends it.
    """
    if semantics != semantics_version():
        return _failure(OTHER_VERSION, f"this machine has {semantics_version()}")
    content = json.loads(payload)
    try:
        space = _effective_space(content)
        if content["exact"] is not None:
            metric, values = content["exact"]
            axis = read_limit_axis(space, metric, values)
            assert isinstance(axis, LimitAxis)
            return _finished(break_points(space, axis, content["seed"]))
        return _finished(front_outcome(space, content["seed"]))
    except OutOfTime:
        raise
    except ProblemError as error:
        messages = [
            f"{item.path}: {item.message}" + (f" ({item.hint})" if item.hint else "") for item in error.diagnostics
        ]
        return _failure("invalid", "; ".join(messages))
    except DseError as error:
        return _failure("invalid", str(error))


def _effective_space(content: Mapping[str, Any]) -> Space:
    """The space that a run is about."""
    stated = content["changes"]
    changes = QuestionChanges(**{**stated, "limits": [tuple(item) for item in stated["limits"]]})
    space = changed(loads(content["problem"], "effective problem"), changes).space
    for metric, values in content["limits"]:
        axis = read_limit_axis(space, metric, values)
        space = limited(space, axis.values[0])
    return space


def _finished(outcome: Mapping[str, Any]) -> str:
    """An outcome that was not cut short.

    Raises
    ------
    OutOfTime
        when it was, by the limit of time in force.
    """
    if outcome["status"] == "incomplete":
        look_at_the_clock()
    return _text(outcome)


def _failure(status: str, message: str) -> str:
    return _text(written(Failure, {"kind": "error", "status": status, "message": message}))


def _text(outcome: Mapping[str, Any]) -> str:
    return json.dumps(outcome, ensure_ascii=False, separators=(",", ":"))


# Outcomes of runs as they come back from a store or another machine: plain data of the very form that runs have.


class OutcomeError(ValueError):
    """A text that is no outcome of a run.

    Raised by reading what a worker or a store returned; the run counts as not solved.
    """


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
