"""Limits on response times of messages in the second proof: what a refused solution teaches of them.

Where none of several messages can be the last in time, the model learns that they are too many in any order; else why
each late message is late in this order (`reasons.py`).
"""

from __future__ import annotations

from collections.abc import Sequence

from dse.analysis.limits import Limit, judge
from dse.analysis.messages.conflicts import conflicts, is_own_deadline
from dse.analysis.messages.stages import counted_buses
from dse.analysis.views import View
from dse.space.model.space import Design, Space
from dse.verification.messages.reasons import conflict_lesson, late_lesson
from dse.verification.scheduling.reasons import Lesson


def is_message_limit(limit: Limit) -> bool:
    """Whether a limit is an upper one on the response time of a message."""
    metric = limit.requirement.metric
    return metric.kind == "message response" and limit.requirement.is_upper and not limit.is_elsewhere


def limited_by_deadline(space: Space, limits: Sequence[Limit]) -> set[int]:
    """The messages that must meet the deadline of their connection."""
    pairs = [(item.requirement.metric.index or 0, item) for item in limits]
    return {number for number, item in pairs if is_own_deadline(space, number, item.bound)}


def message_lessons(space: Space, limits: Sequence[Limit], design: Design, *, has_places: bool) -> list[Lesson]:
    """The lesson from messages that miss these limits in a design; of threads that wait where these have places."""
    view = View(design)
    limited = limited_by_deadline(space, limits)
    found = [
        conflict_lesson(space, conflict, design)
        for bus in counted_buses(space)
        for conflict in conflicts(space, bus, view)
        if limited.issuperset(conflict.limited(space, view))
    ]
    if found:
        return found
    late = [item for item in limits if not judge(item, view).holds]
    return [late_lesson(space, item, design, has_places=has_places) for item in late]
