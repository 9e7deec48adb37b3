"""What robustness costs, as a section of the page of a robust front."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from dse.report.figuretext import MOST_ROWS, Data, figure_text
from dse.report.page import Block, Section, Table, listing, texts
from dse.results.display import counted, figure

NAMED = 2
"""The greatest number of inputs, and of designs that are lost, that are told on one screen."""


def robust_section(data: Data, *, is_brief: bool = False) -> Section:
    """The best of each objective with and without it, and why nominal designs were lost; from ``dse-result/1``.

    Where it `is_brief` what may vary is named, and of what was lost there are the first.
    """
    return Section("robust", "What robustness costs", tuple(_blocks(data, is_brief=is_brief)))


def _blocks(data: Data, *, is_brief: bool) -> Iterator[Block]:
    found = data["robust"]
    currency = found.get("currency", "EUR")
    units = {info["name"]: info["unit"] for info in data["objectives"]}
    lost = {item["nominal_id"] for item in found["lost"]}
    front = {item["id"]: item for item in found["nominal_front"]}
    count = len(found.get("unjudged", []))
    yield from texts(
        "Robust: every requirement holds for all of the stated values, proved. Objectives are those of the nominal "
        "figures.",
        tone="strong",
    )
    if is_brief:
        named = [f"{path} ({stated})" for path, stated in found["inputs"].items()]
        more = f" and {len(named) - NAMED} more (--explain)" if len(named) > NAMED else ""
        yield from texts(f"What may vary: {', '.join(named[:NAMED])}{more}.")
    else:
        yield Table("What may vary", ("input", "what is stated"), tuple(found["inputs"].items()))
    prices = []
    for name, pair in found["price"].items():
        ends = [pair[key] for key in ("nominal", "robust")]
        prices.append((name, *("none" if value is None else counted(value, units[name], currency) for value in ends)))
    caption = "What robustness costs: the best of each objective"
    yield Table(caption, ("objective", "nominal", "robust"), tuple(prices), (1, 2))
    reached = {tuple(item["objectives"].items()) for item in front.values()}
    same = sum(
        item["id"] in found["entered"] and tuple(item["objectives"].items()) in reached for item in data["front"]
    )
    alike = f"{same} as good with other decisions, " if same else ""
    unjudged = f", {count} were not looked at: the time was up" if count else ""
    yield from texts(
        f"Of {len(front)} nominal alternatives {len(lost)} are not robust{unjudged}. "
        f"{len(found['kept'])} of {len(data['front'])} robust alternatives are on the nominal front too, "
        f"{alike}{len(found['entered']) - same} take the place of better ones that are not robust."
    )
    reasons = Counter(item["requirement"] for item in found["lost"])
    yield from listing(f"{number} break {text}" for text, number in reasons.most_common())
    rows = []
    for item in found["lost"]:
        objectives = front[item["nominal_id"]]["objectives"]
        figures = (counted(figure(objectives[name]), unit, currency) for name, unit in units.items())
        worst = (figure_text(item[key], item["unit"], currency) for key in ("worst", "limit"))
        rows.append((f"#{item['nominal_id']}", *figures, item["requirement"], *worst))
    if rows:
        yield Table(
            "Nominal alternatives that are not robust, at their worst",
            ("nominal", *units, "breaks", "there", "limit"),
            tuple(rows),
            (*range(1, 1 + len(units)), 2 + len(units), 3 + len(units)),
            brief=NAMED if is_brief else 10,
            rest="and {} more that are not robust" + (" (--explain)" if is_brief else ""),
            most=MOST_ROWS,
        )
