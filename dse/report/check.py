"""What `dse check` says, as a page; apart from the other reports, whose imports it does not need."""

from __future__ import annotations

from dse.api.check import Description, impossible_words
from dse.report.page import Block, Page, Section, Table, listing, texts
from dse.report.plain import basis_words, scale_words
from dse.space.settings import settings_of
from dse.units.text import count_words

FEW = 3
"""More requirements, rules or objectives than this have a line each."""


def description_page(description: Description) -> Page:
    """The decisions of a problem, the size of its space, and remarks."""
    space = description.space
    blocks: list[Block] = []
    if description.decisions:
        rows = tuple((decision.name, ", ".join(decision.options)) for decision in description.decisions)
        blocks.append(Table("", ("decision", "options"), rows))
        blocks += texts(
            f"At most {count_words(description.size, 'design')}: combinations of options, before rules, bindings and "
            "requirements (a decision that is not in use counts once where one other decides on that, else in full)."
        )
    else:
        blocks += texts("No decision is open: the file states a single design.")
    blocks += texts(f"Flows: {', '.join(flow.name for flow in space.flows) or 'none'}")
    for title, found in (
        ("Requirements", [item.shown for item in space.requirements]),
        ("Rules", [item.text for item in space.rules]),
        ("Objectives", [f"{item.sense} {item.metric.name}" for item in space.objectives]),
    ):
        if len(found) > FEW:
            blocks += [*texts(f"{title} ({len(found)}):"), *listing(found)]
        else:
            blocks += texts(f"{title}: {'; '.join(found) or 'none'}")
    blocks += texts(scale_words(space))
    impossible = [impossible_words(item, space.currency) for item in description.impossible]
    blocks += listing(impossible, "impossible", 0, "wrong")
    blocks += listing(description.remarks, "remark", 0)
    lead = f"{space.name}: valid ({basis_words(settings_of(space))})"
    return Page(f"{space.name}: the problem", lead, (Section("problem", "What is open and asked", tuple(blocks)),))
