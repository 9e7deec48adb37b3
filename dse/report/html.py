"""The report as one HTML file that needs nothing else: text, tables, plots, their JavaScript.

Alternatives share most of their lines, so each is kept as a list of numbers into a pool of distinct lines. Jinja
escapes every text; data and libraries are packed, which no text in them can end; a content security policy admits these
scripts alone, by their hashes, and no network at all.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from dse.answers.drawing.picture import STYLE, Drafter
from dse.answers.tables.display import display_unit
from dse.report.content.front.decision import banner, beyond_card, cards, designs_data, steps
from dse.report.content.front.document import AlternativePage, Document
from dse.report.content.front.filters import decide_data, further_metrics, insist_choices
from dse.report.content.front.first_screen import Screen
from dse.report.page import Page, Section
from dse.report.plots.canvas import STYLE as PLOT_STYLE
from dse.report.plots.deadlines import deadline_chart
from dse.report.plots.design import usage_chart, waterfall
from dse.report.plots.front import EDGE, axis_title
from dse.report.words.clocks import timeline
from dse.report.words.headline import limits_words
from dse.report.words.reasons import proof_words
from dse.support.files.writing import utf8
from dse.support.theme import DARK, LIGHT, css_variables
from dse.support.timelimit import look_at_the_clock
from dse.support.units import is_unbounded
from dse.support.units.text import format_count

MOST_ON_PAPER = 8
"""Decisions that the table of the front shows on paper: more would not fit."""
SCRIPTS = ("print.js", "scatter.js", "parallel.js", "first.js", "decide.js", "report.js")
"""The page of a front: each defines its part, the last begins."""
QUESTION, LEAST_QUESTION = 120, 40
"""Letters of title and limits in one line, and of the limits at least."""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def html_report(document: Document, chosen: int | None = None, studies: Sequence[Section] = ()) -> str:
    """The whole page; `chosen` is the id of the alternative that it opens with (the first in rank).

    `studies` are sections of sweeps and the like, shown before what all rests on.
    """
    templates = environment()
    result = document.result
    first = chosen if chosen is not None else result.front[0].id if result.front else None
    drafter = Drafter(result.space)
    fragments = {item.point.id: _fragment(templates, document, drafter, item) for item in document.alternatives}
    script = "".join(map(_asset, SCRIPTS))
    screen = Screen(document)
    studies = [*document.further_sections, *studies]
    data = _data(document, fragments, first)
    data["first"] = designs_data(screen, document.alternatives) if result.front else None
    return templates.get_template("report.html.j2").render(
        document=document,
        result=result,
        proof=proof_words(result),
        screen=screen,
        question=limits_words(result, max(LEAST_QUESTION, QUESTION - len(result.problem.name))),
        banner=banner(screen),
        cards=cards(screen),
        beyond=beyond_card(screen) if result.front else None,
        short=data["first"]["short"] if result.front else (),
        steps=steps(screen) if result.front else (),
        drawing=list(drafter.lines(None)),
        crowded=len(document.varying) > MOST_ON_PAPER,
        first=first,
        fragment=fragments.get(first, []) if first is not None else [],
        style=_asset("report.css") + STYLE + PLOT_STYLE,
        light=css_variables(LIGHT),
        dark=css_variables(DARK),
        data=_packed_json(data),
        studies=studies,
        choices=insist_choices(result),
        further=further_metrics(result),
        script=script,
        policy=f"{POLICY}; script-src {_hash(script)}",
    )


def html_page(page: Page) -> str:
    """A page as one file, which needs no network.

    HTML text with style and plots inside; its script opens on paper what is folded.
    """
    script = _asset("print.js")
    return (
        environment()
        .get_template("page.html.j2")
        .render(
            page=page,
            style=_asset("report.css") + STYLE + PLOT_STYLE,
            light=css_variables(LIGHT),
            dark=css_variables(DARK),
            script=script,
            policy=f"{POLICY}; script-src {_hash(script)}",
        )
    )


def _packed(text: str) -> str:
    """Text as gzip and base64: a third of its size, and nothing in it can end the script element that holds it."""
    return base64.b64encode(gzip.compress(utf8(text), 9, mtime=0)).decode()


def _packed_json(data: Any) -> str:
    """Data as JSON, packed."""
    return _packed(json.dumps(data, ensure_ascii=False, separators=(",", ":")))


class Distinct:
    """Distinct items, numbered in the order of their first use.

    Used to write repeated texts and data of a page once; the page refers to them by number.
    """

    def __init__(self) -> None:
        self.items: list[Any] = []
        self._numbers: dict[str, int] = {}

    def take(self, items: Iterable[Any]) -> list[int]:
        """The numbers of the items.

        A number for each item, in their order; a new item is added to the pool.
        """
        numbers = []
        for item in items:
            key = item if isinstance(item, str) else json.dumps(item, sort_keys=True)
            if key not in self._numbers:
                self._numbers[key] = len(self.items)
                self.items.append(item)
            numbers.append(self._numbers[key])
        return numbers


@cache
def environment() -> Environment:
    """The templates of pages, each compiled once; every text in them is escaped.

    Jinja2 with strict undefined names: a template that asks for something that is not there fails.
    """
    templates = Environment(
        loader=PackageLoader("dse.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    templates.filters["breakable"] = _breakable
    templates.filters["thousands"] = format_count
    return templates


def _breakable(text: str) -> Markup:
    """The text, escaped, with a place to break the line after each dot or underscore in a name.

    >>> str(_breakable("main_loop.period <= 1.5 ms"))
    'main_<wbr>loop.<wbr>period &lt;= 1.5 ms'
    """
    return Markup(re.sub(r"([._])(?=[^\W\d_])", r"\1<wbr>", str(escape(text))))


def _asset(name: str) -> str:
    """The text of a file beside the templates."""
    templates = environment()
    assert templates.loader is not None
    text, _, _ = templates.loader.get_source(templates, name)
    return text


def _hash(script: str) -> str:
    """The hash of a script for the content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _fragment(
    environment: Environment, document: Document, drafter: Drafter, alternative: AlternativePage
) -> list[str]:
    """The lines of an alternative's section."""
    look_at_the_clock()
    template = environment.get_template("alternative.html.j2")
    drawing = list(drafter.lines(alternative.point.design))
    plots = {"waterfall": waterfall, "timeline_plot": timeline, "usage": usage_chart, "deadlines": deadline_chart}
    text = template.render(document=document, item=alternative, drawing=drawing, **plots)
    return [line.strip() for line in text.splitlines() if line.strip()]


def _feasible(document: Document) -> list[list[float | None]]:
    """Readable objectives of each feasible design that is not on the front, as `front_records` has them."""
    if document.feasible is None:
        return []
    result = document.result
    front = {tuple(point.objectives[info.name] for info in result.objectives) for point in result.front}
    factors = [display_unit(info.unit, result.space.currency)[0] for info in result.objectives]
    return [
        [None if is_unbounded(value) else float(value / factor) for value, factor in zip(vector, factors, strict=True)]
        for vector in document.feasible.vectors
        if vector not in front
    ]


def _data(document: Document, fragments: Mapping[int, Sequence[str]], chosen: int | None) -> dict[str, Any]:
    result, today = document.result, document.reasoner.baseline
    lines = Distinct()
    parts = {str(number): lines.take(fragment) for number, fragment in fragments.items()}
    return {
        "chosen": chosen,
        "objectives": [{"name": info.name, "sense": info.sense} for info in result.objectives],
        "front": document.records,
        "lines": lines.items,
        "fragments": parts,
        "titles": [axis_title(result, axis) for axis in range(len(result.objectives))],
        "edge": EDGE,
        "baseline": document.baseline_record,
        "feasible": _feasible(document) if result.front else [],
        "decide": decide_data(result, today[0].metrics if today is not None else None) if result.front else None,
    }
