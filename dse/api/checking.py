"""`dse.check`: a valid problem's space, described; and what a careful reader would remark."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dse.analysis.remarks import problem_remarks
from dse.api.problem import Changes, Problem, changed, load
from dse.space.activation import exclusions
from dse.space.figures import mentions
from dse.space.questions import unoffered_types
from dse.space.settings import settings_of
from dse.space.size import space_size
from dse.space.trees import leaves
from dse.space.types import Decision, Space
from dse.spec.rounding import rounded_figures

MOST_ROUNDED = 20
"""The most figures of which is said one by one that they are rounded."""


@dataclass(frozen=True)
class Description:
    """The space of a problem: open decisions with their options, its size, and remarks."""

    space: Space
    decisions: tuple[Decision, ...]
    size: int
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """The description in the form ``dse-check/1``."""
        space = self.space
        return {
            "format": "dse-check/1",
            "problem": space.name,
            "valid": True,
            **settings_of(space),
            "space_size": self.size,
            "decisions": {decision.name: list(decision.options) for decision in self.decisions},
            "flows": [flow.name for flow in space.flows],
            "requirements": [item.text for item in space.requirements],
            "rules": [item.text for item in space.rules],
            "objectives": [f"{item.sense} {item.metric.name}" for item in space.objectives],
            "remarks": list(self.remarks),
        }


def check(
    problem: Problem | str | Path,
    changes: Changes | None = None,
    *,
    processing: str | None = None,
    deadlines: str | None = None,
) -> Description:
    """Validate a problem and describe its space.

    Parameters
    ----------
    problem
        a loaded problem, or the path of a problem file.
    changes
        what the question adds to that of the file.
    processing, deadlines
        a shorthand for settings among them.

    Raises
    ------
    ProblemError
        with every mistake in the file.
    UsageError
        when a change does not fit the problem.
    """
    loaded = problem if isinstance(problem, Problem) else load(problem)
    asked = (changes or Changes()).with_settings(processing=processing, deadlines=deadlines)
    space = changed(loaded, asked).space
    decisions = tuple(item for item in space.decisions if item.is_open)
    return Description(space, decisions, space_size(space), (*_remarks(space), *_rounded(loaded)))


def _rounded(problem: Problem) -> Iterator[str]:
    """What counts otherwise than it is written, for want of a finer unit."""
    found = [f"{path}: {note}" for path, note in rounded_figures(problem.loaded)]
    yield from found[:MOST_ROUNDED]
    if len(found) > MOST_ROUNDED:
        yield f"{len(found) - MOST_ROUNDED} more figures are rounded likewise"


def _remarks(space: Space) -> Iterator[str]:
    limited = {(item.metric.kind, item.metric.index) for item in space.requirements}
    for number, slot in enumerate(space.processors):
        loaded = any(
            number in set(leaves(item.processor)) for item in space.components if item.execution_ns is not None
        )
        if loaded and ("utilisation", number) not in limited:
            yield f"nothing limits the utilisation of {slot.name}: designs that overload it are admitted"
    for number, bus in enumerate(space.buses):
        bandwidths = [leaf for leaf in leaves(bus.bandwidth_bps) if leaf is not None]
        if bandwidths and ("load", number) not in limited:
            yield f"nothing limits the load of {bus.name}: designs that overload it are admitted"
    yield from problem_remarks(space)
    yield from exclusions(space)
    for name in unoffered_types(space):
        for rule in space.rules:
            if mentions(rule.text, name):
                yield f'rule "{rule.text}" names the type {name}, which nothing may have: it is used in no design'
    if not space.objectives:
        yield "there are no objectives: `dse solve` needs --minimise"
