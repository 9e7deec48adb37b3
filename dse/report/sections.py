"""What a report says of studies: sections made of the data that ``--json`` writes, for HTML, Markdown and figures.

A section is made from data alone, so that a page and a section of another report say the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from dse.errors import UsageError
from dse.report.document import Table
from dse.report.parts import Data, Section, figure_text, limited
from dse.report.sensitivitysection import sensitivity_sections
from dse.report.sweepsection import sweep_sections
from dse.results import sensitivity, sweep
from dse.results.display import counted, figure
from dse.results.solve import FORMAT as RESULT_FORMAT


def sections_of(data: Data) -> list[Section]:
    """The sections of a study.

    Raises
    ------
    UsageError
        when the data are not those of a study.
    """
    makers: dict[str, Callable[[Data], Iterator[Section]]] = {
        sweep.FORMAT: sweep_sections,
        sensitivity.FORMAT: sensitivity_sections,
        RESULT_FORMAT: _robust,
    }
    form = data.get("format")
    if form not in makers or (form == RESULT_FORMAT and "robust" not in data):
        known = f"{sweep.FORMAT}, {sensitivity.FORMAT} or {RESULT_FORMAT} of solve --robust"
        raise UsageError(f"it is no study: expected {known}")
    return list(makers[form](data))


def _robust(data: Data) -> Iterator[Section]:
    found = data["robust"]
    currency = found.get("currency", "EUR")
    units = {info["name"]: info["unit"] for info in data["objectives"]}
    lost = {item["nominal_id"] for item in found["lost"]}
    front = {item["id"]: item for item in found["nominal_front"]}
    prices = [
        (
            name,
            *(
                "none" if pair[key] is None else counted(pair[key], units[name], currency)
                for key in ("nominal", "robust")
            ),
        )
        for name, pair in found["price"].items()
    ]
    rows = []
    for item in found["lost"]:
        figures = (
            counted(figure(front[item["nominal_id"]]["objectives"][name]), unit, currency)
            for name, unit in units.items()
        )
        worst = (figure_text(item[key], item["unit"], currency) for key in ("worst", "limit"))
        rows.append((f"#{item['nominal_id']}", *figures, item["requirement"], *worst))
    count = len(found.get("unjudged", []))
    unjudged = f", {count} were not looked at: the time was up" if count else ""
    kept = (
        f"Of {len(front)} nominal alternatives {len(lost)} are not robust{unjudged}. "
        f"{len(found['kept'])} of {len(data['front'])} robust alternatives are on the nominal front too, "
        f"{len(found['entered'])} take the place of better ones that are not robust."
    )
    proof = "Every requirement holds for all of the stated values, proved. Objectives are those of the nominal figures."
    texts = (proof, kept)
    tables = (
        Table("What may vary", ("input", "what is stated"), tuple(found["inputs"].items())),
        Table(
            "What robustness costs: the best of each objective",
            ("objective", "nominal", "robust"),
            tuple(prices),
            (1, 2),
        ),
        Table(
            "Nominal alternatives that are not robust, at their worst",
            ("nominal", *units, "breaks", "there", "limit"),
            limited(rows),
            (*range(1, 1 + len(units)), 2 + len(units), 3 + len(units)),
        ),
    )
    yield Section("robust", "What robustness costs", texts, (), tables)
