"""OSATE's resource budgets as tables: what processors and memories have, and who needs how much of it."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from dse.analysis.osate.resources import ResourceUse
from dse.answers.analysis import Analysis
from dse.answers.tables.display import readable
from dse.report.page import NOTHING, Block, Table, listing

SYSTEM = "system"


def resource_blocks(analysis: Analysis) -> Iterator[Block]:
    """A table of resources, a table of budgets, and OSATE's findings on both.

    Up to two tables and a list of findings; nothing for a problem without budgets (OSATE's resource budget analyses).
    """
    if not analysis.resources:
        return
    uses = analysis.resources
    rows = [(use.name, use.resource, *_words(use.unit, use.total, use.capacity, use.slack_ppm)) for use in uses]
    headings = ("of", "resource", "needed", "there is", "slack")
    yield Table("OSATE's resource budgets", headings, tuple(rows), (2, 3, 4))
    stated = [(use, item) for use in analysis.resources if use.name == SYSTEM for item in use.users]
    budgets = [
        (item.name, use.resource, *_words(use.unit, item.used, item.budget, item.slack_ppm)) for use, item in stated
    ]
    if budgets:
        headings = ("who", "resource", "needs", "budget", "slack")
        yield Table("Budgets of processors and memories", headings, tuple(budgets), (2, 3, 4))
    yield from listing(_resource_findings(analysis.resources), "OSATE", 0)


def _resource_findings(uses: tuple[ResourceUse, ...]) -> list[str]:
    """OSATE's errors and warnings, each with its severity."""
    return [f"{item.severity}: {item.text}" for use in uses for item in use.findings]


def _words(unit: str, used: Fraction, most: Fraction | None, slack_ppm: Fraction | None) -> tuple[str, str, str]:
    left = NOTHING if slack_ppm is None else readable(slack_ppm, "ppm", digits=1)
    return readable(used, unit), NOTHING if most is None else readable(most, unit), left
