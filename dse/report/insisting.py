"""The price of insisting on an option, in words and figures."""

from __future__ import annotations

from dse.records import dataclass
from dse.report.amounts import amount_words
from dse.report.figuretext import MOST_ROWS
from dse.report.page import NOTHING, Section, Table, texts
from dse.results.display import counted
from dse.results.insisting import InsistedOption
from dse.results.points import ObjectiveInfo
from dse.results.solve import Result
from dse.units import is_unbounded

TOP = 10


@dataclass(frozen=True)
class Price:
    """What an option costs: how many points of the whole front have it, and what is lost at the best of each objective.

    `kept` counts points of the whole front; `best` and `lost` are by objective, empty where no design is known.
    """

    item: InsistedOption
    kept: int
    best: tuple[int, ...]
    lost: tuple[int, ...]

    @property
    def state(self) -> str:
        """``impossible``, ``unknown`` where the search was stopped, else how many points it keeps."""
        if self.item.status == "infeasible":
            return "impossible"
        return "unknown" if self.item.status == "incomplete" else str(self.kept)


def prices(result: Result) -> list[Price]:
    """The price of each option, in the order of the problem."""
    assert result.insisting is not None
    vectors = {point.id: point.objectives for point in result.front}
    vectors |= {point.id: point.objectives for point in result.insisting.points}
    whole = {point.id for point in result.front}

    def best(info: ObjectiveInfo, ids: tuple[int, ...]) -> int:
        values = [vectors[number][info.name] for number in ids]
        return min(values) if info.sense == "minimise" else max(values)

    found = []
    for item in result.insisting.options:
        reached = tuple(best(info, item.front) for info in result.objectives) if item.front else ()
        most = [best(info, tuple(whole)) for info in result.objectives] if reached else []
        lost = tuple(abs(value - ideal) for value, ideal in zip(reached, most, strict=True))
        found.append(Price(item, len(whole & set(item.front)), reached, lost))
    return found


def summary_words(result: Result) -> str:
    """How many options keep the whole front, part of it or nothing, are impossible or unknown."""
    every = prices(result)
    size = len(result.front)
    done = [price for price in every if price.item.status == "complete"]
    counts = [
        (sum(price.kept == size for price in done), "keep every alternative"),
        (sum(0 < price.kept < size for price in done), "keep some"),
        (sum(price.kept == 0 for price in done), "keep none"),
        (sum(price.item.status == "infeasible" for price in every), "are impossible"),
        (sum(price.item.status == "incomplete" for price in every), "are unknown: the search was stopped"),
    ]
    told = ", ".join(f"{count} {words}" for count, words in counts if count)
    return f"Of {len(every)} options that one may insist on {told}."


def costly(result: Result) -> list[Price]:
    """The options that no alternative of the front has, in the order of the problem."""
    return [price for price in prices(result) if not price.kept]


def cost_words(result: Result, price: Price) -> list[str]:
    """For each objective the best value with an option, and what that is worse than without insisting."""
    texts = []
    for info, value, lost in zip(result.objectives, price.best, price.lost, strict=False):
        text = counted(value, info.unit, result.space.currency)
        if lost and not is_unbounded(value):
            text += (
                f" ({'+' if info.sense == 'minimise' else '-'}{amount_words(lost, info.unit, result.space.currency)})"
            )
        texts.append(text)
    return texts


def insisting_section(result: Result, top: int | None = None) -> Section:
    """What the options cost that no alternative has, on a terminal the first of them; how many others there are."""
    said = texts(f"The price of insisting: {summary_words(result)}")
    rows = []
    for price in costly(result):
        cells = cost_words(result, price) or [NOTHING] * len(result.objectives)
        rows.append((f"{price.item.decision} {price.item.option}", price.state, *cells))
    if rows:
        headings = ("insisting on", "alternatives kept", *(f"best {info.name}" for info in result.objectives))
        numbers = tuple(range(1, len(headings)))
        rest = f"{{}} more such options: --top {len(rows)}, --json or --report."
        brief = None if top is None else max(top, TOP)
        said.append(
            Table("What insisting costs", headings, tuple(rows), numbers, brief=brief, rest=rest, most=MOST_ROWS)
        )
    return Section("insisting", "The price of insisting", tuple(said))
