"""Which problem a result or an explanation speaks about, and what was really asked of it."""

from __future__ import annotations

from typing import Any

from dse.api.problem import Problem
from dse.results.points import Origin
from dse.space.settings import settings_of


def origin_of(problem: Problem) -> Origin:
    """Which problem this is: name, file, hashes, and the question as it is asked."""
    space = problem.space
    effective: dict[str, Any] = {
        "requirements": [item.text for item in space.requirements if not item.implied],
        "implied": [item.text for item in space.requirements if item.implied],
        "rules": [item.text for item in space.rules],
        "objectives": [f"{item.sense} {item.metric.name}" for item in space.objectives],
        "fixed": {
            space.decisions[decision].name: space.decisions[decision].options[option]
            for decision, option in space.fixed.items()
        },
        **settings_of(space),
        "robust": problem.robust,
    }
    loaded = problem.loaded
    return Origin(
        name=space.name,
        file=str(loaded.path),
        sha256=loaded.sha256,
        includes=loaded.includes,
        effective=effective,
        identity=loaded.identity,
        texts=loaded.texts,
        is_carried=loaded.is_carried,
    )
