"""The page of `dse check`; apart from the other reports, whose imports it does not need."""

from __future__ import annotations

from dse.questions.verbs.check import Description
from dse.report.content.explain import impossible_words
from dse.report.page import Block, Page, Section, Table, Text, few, listing, texts
from dse.report.words.basis import basis_words, counting_words, scale_words
from dse.space.question.settings import settings_of
from dse.support.units.text import count_words

FEW = 3
"""More requirements, rules or objectives than this have a line each."""
SCREEN = 3
"""The greatest number of such lines on a terminal, which shows twice as many decisions."""
MANY = 12
"""The greatest number of flows."""
HANG = 10
"""The column in which the text behind a label begins."""


def description_page(description: Description) -> Page:
    """The decisions of a problem, the size of its space, what is asked, and remarks.

    A `Page` with the counts, impossible requirements, a table of open decisions, objectives, limits and rules; a
    terminal shows the first ones.
    """
    space = description.space
    impossible = [impossible_words(item, space.currency) for item in description.impossible]
    blocks: list[Block] = [*_counts(description), *listing(impossible, "impossible", 0, "wrong")]
    if description.decisions:
        rows = tuple((decision.name, ", ".join(decision.options)) for decision in description.decisions)
        rest = "and {} more decisions (--all)"
        blocks.append(Table("", ("decision", "options"), rows, brief=2 * SCREEN, rest=rest))
    blocks += _asked(description)
    blocks += texts(scale_words(space))
    blocks += listing(description.remarks, "remark", 0, brief=SCREEN - 1)
    basis, counted = f"{basis_words(settings_of(space))}.", counting_words(space)
    blocks.append(
        Text(
            " ".join(filter(None, (f"{'Counted':<{HANG}}", counted, f"{basis[:1].upper()}{basis[1:]}"))),
            brief=f"{'Counted':<{HANG}} {counted or basis}",
            hang=HANG + 1,
        )
    )
    lead = f"{space.name}: {'too large to search exactly' if description.too_large else 'valid'}"
    return Page(f"{space.name}: the problem", lead, (Section("problem", "What is open and asked", tuple(blocks)),))


def _counts(description: Description) -> list[Block]:
    """The numbers of decisions, designs, requirements, rules and objectives, as text."""
    space = description.space
    parts = [(len(space.requirements), "requirement"), (len(space.rules), "rule"), (len(space.objectives), "objective")]
    counted = ", ".join(count_words(count, noun) for count, noun in parts if count)
    counted = f"; {counted}" if counted else ""
    if not description.decisions:
        return texts(f"No decision is open: the file states a single design{counted}.")
    begin = f"{count_words(len(description.decisions), 'decision')}, at most {count_words(description.size, 'design')}"
    return [
        Text(
            f"{begin}{counted}. Designs are combinations of options, before rules, bindings and requirements (an "
            "unused decision counts once where a single other decision makes it unused, else in full).",
            brief=f"{begin}{counted}",
        )
    ]


def _asked(description: Description) -> list[Block]:
    """Objectives, limits, rules and flows: a line for each kind, or for each entry where there are many."""
    space = description.space
    blocks: list[Block] = []
    for title, entries in (
        ("Objectives", [f"{item.sense} {item.metric.name}" for item in space.objectives]),
        ("Limits", [item.shown for item in space.requirements]),
        ("Rules", [item.text for item in space.rules]),
    ):
        if len(entries) > FEW:
            blocks += [*texts(f"{title} ({len(entries)}):"), *listing(entries, brief=SCREEN)]
        elif entries:
            blocks.append(Text(f"{title:<{HANG}} {'; '.join(entries)}", hang=HANG + 1))
    flows = [flow.name for flow in space.flows]
    if flows:
        brief = f"{'Flows':<{HANG}} {few(flows, MANY, 'flows')}"
        blocks.append(Text(f"{'Flows':<{HANG}} {', '.join(flows)}", brief=brief, hang=HANG + 1))
    return blocks
