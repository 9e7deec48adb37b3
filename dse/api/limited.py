"""The metrics that ``--max-METRIC`` and ``max_METRIC`` limit; light, for the command line reads it before its work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Limited(NamedTuple):
    """How a limit of a metric is told: an example; what each has its own, if that is so; its name; else whose it is."""

    example: str
    of: str = ""
    called: str = ""
    whose: str = "of the system"


LIMITED: Mapping[str, Limited] = {
    "jitter": Limited("20ms", "flow"),
    "latency": Limited("20ms", "flow"),
    "utilisation": Limited("70%", "processor"),
    "load": Limited("50%", "bus"),
    "busy": Limited("80%", "bus", "busy time"),
    "price": Limited("500EUR"),
    "power": Limited("10W"),
    "changes": Limited("3", whose="against the baseline"),
}
"""By metric; each has a keyword ``max_METRIC`` in `dse.api.question.Question` too."""
