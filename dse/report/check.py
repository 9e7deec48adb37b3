"""What `dse check` prints; apart from the other reports, whose imports it does not need."""

from __future__ import annotations

from rich.console import Console

from dse.api.check import Description, impossible_words
from dse.report.contention import scale_words
from dse.report.plain import basis_words, plain, plain_table
from dse.space.settings import settings_of
from dse.units.text import count_words


def print_description(console: Console, description: Description) -> None:
    """The decisions of a problem, the size of its space, and remarks."""
    space = description.space
    console.print(f"{space.name}: valid ({basis_words(settings_of(space))})", style="bold", markup=False)
    if description.decisions:
        table = plain_table(console)
        table.add_column("decision", overflow="fold")
        table.add_column("options", overflow="fold")
        for decision in description.decisions:
            table.add_row(plain(decision.name), plain(", ".join(decision.options)))
        console.print(table)
        console.print(
            f"At most {count_words(description.size, 'design')}: combinations of options, before rules, bindings and "
            "requirements (a decision that is not in use counts once where one other decides on that, else in full).",
            markup=False,
        )
    else:
        console.print("No decision is open: the file states a single design.", markup=False)
    console.print(f"Flows: {', '.join(flow.name for flow in space.flows) or 'none'}", markup=False)
    for title, texts in (
        ("Requirements", [item.shown for item in space.requirements]),
        ("Rules", [item.text for item in space.rules]),
        ("Objectives", [f"{item.sense} {item.metric.name}" for item in space.objectives]),
    ):
        console.print(f"{title}: {'; '.join(texts) or 'none'}", markup=False)
    if scale := scale_words(space):
        console.print(scale, markup=False)
    for item in description.impossible:
        console.print(f"impossible: {impossible_words(item, space.currency)}", style="bold red", markup=False)
    for remark in description.remarks:
        console.print(f"remark: {remark}", markup=False)
