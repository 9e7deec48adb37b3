"""What `dse check` says, as a page; apart from the other reports, whose imports it does not need."""

from __future__ import annotations

from dse.questions.verbs.check import Description
from dse.report.content.explain import impossible_words
from dse.report.page import Block, Page, Section, Table, Text, few, listing, texts
from dse.report.words.basis import basis_words, scale_words
from dse.space.question.settings import settings_of
from dse.support.units.text import count_words

FEW = 3
"""More requirements, rules or objectives than this have a line each."""
SCREEN = 3
"""The greatest number of such lines on a terminal; twice as many decisions are told."""
MANY = 12
"""The greatest number of flows."""


def description_page(description: Description) -> Page:
    """The decisions of a problem, the size of its space, and remarks.

    A `Page` with impossible requirements first, then a table of open decisions with the number of designs, and remarks;
    a terminal shows the first decisions only.
    """
    space = description.space
    impossible = [impossible_words(item, space.currency) for item in description.impossible]
    blocks: list[Block] = [*listing(impossible, "impossible", 0, "wrong")]
    if description.decisions:
        rows = tuple((decision.name, ", ".join(decision.options)) for decision in description.decisions)
        count = count_words(len(rows), "decision")
        begin = f"{count}, at most {count_words(description.size, 'design')}"
        said = (
            f"{begin}: combinations of options, before rules, bindings and requirements (a decision that is not in "
            "use counts once where one other decides on that, else in full)."
        )
        blocks.append(Text(said, brief=f"{begin}, before rules, bindings and requirements."))
        rest = "and {} more decisions (--all)"
        blocks.append(Table("", ("decision", "options"), rows, brief=2 * SCREEN, rest=rest))
    else:
        blocks += texts("No decision is open: the file states a single design.")
    flows = [flow.name for flow in space.flows]
    blocks.append(Text(f"Flows: {', '.join(flows) or 'none'}", brief=f"Flows: {few(flows, MANY, 'flows') or 'none'}"))
    for title, found in (
        ("Requirements", [item.shown for item in space.requirements]),
        ("Rules", [item.text for item in space.rules]),
        ("Objectives", [f"{item.sense} {item.metric.name}" for item in space.objectives]),
    ):
        if len(found) > FEW:
            blocks += [*texts(f"{title} ({len(found)}):"), *listing(found, brief=SCREEN)]
        else:
            blocks += texts(f"{title}: {'; '.join(found) or 'none'}")
    blocks += texts(scale_words(space))
    blocks += listing(description.remarks, "remark", 0, brief=SCREEN - 1)
    verdict = "too large to search exactly" if description.too_large else "valid"
    lead = f"{space.name}: {verdict} ({basis_words(settings_of(space))})"
    return Page(f"{space.name}: the problem", lead, (Section("problem", "What is open and asked", tuple(blocks)),))
