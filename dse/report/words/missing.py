"""The optimality gap of an incomplete front in words."""

from __future__ import annotations

from dataclasses import replace

from dse.answers.ranking.optimality_gap import Outlook, outlooks_of
from dse.answers.result import Result
from dse.answers.tables.display import column, counted, titled, without_stand_in
from dse.report.amounts import amount_words, listed
from dse.report.page import NOTHING, Block, Table
from dse.space.model.criteria import Objective
from dse.space.model.space import Space
from dse.support.units import is_unbounded

TITLE = "Proved of every design that may be missing"


def missing_words(result: Result) -> list[str]:
    """The bounds on designs that a stopped search did not find, as phrases after `TITLE`; none if the search finished.

    Phrases with the bound on missing designs and the gap in each objective.
    """
    currency, outlooks = result.space.currency, outlooks_of(result)
    pairs = zip(outlooks, result.space.objectives, strict=bool(outlooks))
    outlooks = tuple(_without_stand_ins(item, objective, result.space) for item, objective in pairs)
    said = [_outlook(item, currency) for item in outlooks]
    near = [
        f"{amount_words(item.near, item.unit, currency)} in {item.name}"
        for item in outlooks
        if item.near is not None and not is_unbounded(item.near)
    ]
    return [*said, f"some design found is worse by at most {listed(near)}"] if near else said


def _without_stand_ins(item: Outlook, objective: Objective, space: Space) -> Outlook:
    """The outlook with unbounded values in place of the finite numbers that stand for them in regions."""

    def marked(value: int) -> int:
        return without_stand_in(space, objective.metric, item.unit, value)

    best, near = (None if value is None else marked(value) for value in (item.best, item.near))
    return replace(item, bound=marked(item.bound), best=best, near=near)


def _outlook(item: Outlook, currency: str) -> str:
    """``price: no less than 240 EUR, 50 EUR less than the best found``."""
    word = "less" if item.sense == "minimise" else "more"
    bound = f"{item.name}: no {word} than {counted(item.bound, item.unit, currency)}"
    if item.best is None:
        return f"{bound}; nothing was found yet"
    if not item.possible_gain:
        return f"{bound}; the best is found: {counted(item.best, item.unit, currency)}"
    if is_unbounded(item.best) or is_unbounded(item.bound):
        return f"{bound}, instead of {counted(item.best, item.unit, currency)}, the best found"
    gain = amount_words(item.possible_gain, item.unit, currency)
    return f"{bound}, {gain} {word} than the best found"


def outlook_table(result: Result) -> list[Block]:
    """For each objective of a stopped search the best value found, the bound on missing designs, and the gap.

    At most one `Table`; gaps are in the unit of the objective, a dash where a bound is infinite.
    """
    outlooks = outlooks_of(result)
    if not outlooks:
        return []
    pairs = zip(outlooks, result.space.objectives, strict=True)
    known = [_without_stand_ins(item, objective, result.space) for item, objective in pairs]
    headings, columns = [""], [["best found", "bound, designs missing", "gap"]]
    for item in known:
        best = item.bound if item.best is None else item.best
        unit, cells = column([best, item.bound, item.possible_gain], item.unit, result.space.currency)
        is_known = item.best is not None
        if is_unbounded(best) or is_unbounded(item.bound):
            cells[2] = NOTHING
        headings.append(titled(item.name, unit))
        columns.append(cells if is_known else [NOTHING, cells[1], NOTHING])
    rows = tuple(zip(*columns, strict=True))
    return [Table("", tuple(headings), rows, tuple(range(1, len(headings))))]
