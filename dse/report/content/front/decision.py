"""The first screen of the page of a front: banner, cards of kinds, and for each design its latencies and limits.

`banner` and `cards` are set by the template; `designs_data` goes to the page's script, which compares two designs,
filters and ranks. Times are in ns, shares from 0 to 1.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from dse.analysis.binding import bus_stack
from dse.analysis.diagnosis.front_verdicts import waiting_counted
from dse.analysis.latency.rows import JOIN_METHOD, Row
from dse.analysis.views import View
from dse.answers.analysis import Analysis, FlowTable
from dse.answers.contention_verdicts import Broken
from dse.answers.designs import Point
from dse.answers.ranking.reasons import Margin
from dse.answers.tables.display import counted, display_unit, readable
from dse.report.content.front.document import AlternativePage
from dse.report.content.front.first_screen import Screen
from dse.report.page import Text
from dse.report.plots.design import drawn_ns
from dse.report.plots.front import drawn_figures
from dse.report.words.basis import counted_delays, counts_latencies, missing_figures, waiting_verdict
from dse.report.words.choice import beyond_words, margin_parts, short_metrics
from dse.report.words.headline import found_words
from dse.report.words.reasons import figures_words
from dse.space.model.metric_kinds import flows_in
from dse.support.units import Exact, format_duration, is_unbounded

if TYPE_CHECKING:
    from dse.questions.beyond_limit import Beyond

CAUSES = ("sampling", "execution", "waiting for the CPU", "middleware", "buses", "devices", "waiting for input")
"""The parts of a latency, in the order of its bar."""
WITH_WAITING = ", with waiting"
MOST_LIMITS = 8
"""The greatest number of limits of a design that have a bar, the nearest first."""


@dataclass(frozen=True)
class Banner:
    """The answer in one box: `facts` say how sure it is, each with whether it is good news.

    `state` chooses the colour: green, amber or red.
    """

    state: Literal["good", "doubtful", "wrong"]
    title: str
    lines: tuple[str, ...]
    facts: tuple[tuple[bool, str], ...]


@dataclass(frozen=True)
class Card:
    """A kind of design: the point that stands for it, what it is, its objectives, and how many designs it has.

    `figures` are pairs of an objective's name and its value as text.
    """

    point: Point
    kind: int
    name: str
    figures: tuple[tuple[str, str], ...]
    count: int


def banner(screen: Screen) -> Banner:
    """The banner of the page: a warning that changes the decision, else the recommendation, else why there is none.

    Green with a recommendation of a complete front; red with a warning, or where no design exists.
    """
    result = screen.result
    _, status, _ = found_words(result, screen.kinds)
    waiting = waiting_counted(result.space)
    is_complete = result.status == "complete"
    facts = [(is_complete, f"{status[:1].upper()}{status[1:]}".rstrip("."))]
    if counts_latencies(result.space):
        facts.append((True, f"Counted: {counted_delays(waiting)}"))
        verdict = waiting_verdict(waiting, missing_figures(result.space)).rstrip(".")
        facts += [(not waiting["not_counted"], verdict)] if verdict else []
    note = screen.waiting.note()
    facts += [(not note.startswith("With waiting for the CPU no"), note.rstrip("."))] if note else []
    if result.status == "infeasible":
        return Banner("wrong", "Infeasible: no design meets every requirement and rule", (), tuple(facts))
    if not result.front:
        return Banner("doubtful", "No design was found before the search stopped", (), tuple(facts))
    said = [block.text.strip() for block in screen.choice(with_baseline=False) if isinstance(block, Text)]
    if screen.warnings:
        title, _, rest = screen.warnings[0].partition(". ")
        lines = [rest, *screen.warnings[1:], *said]
        return Banner("wrong", f"Warning: {title.rstrip('.')}", tuple(filter(None, lines)), tuple(facts))
    title, _, also = said[0].rstrip(".").partition("; ")
    first = result.front[0]
    figures = (
        f"{figures_words(result, first.objectives)}. " if len(result.front) > 1 and title.startswith("Rec") else ""
    )
    lines = [f"{figures}{also + '.' if also else ''}".strip(), *map(_with_colon, said[1:])]
    state: Literal["good", "doubtful"] = "good" if is_complete else "doubtful"
    return Banner(state, _with_colon(title), tuple(filter(None, lines)), tuple(facts))


def _with_colon(title: str) -> str:
    """``Recommended  #1 Spectra``, as a terminal aligns it, with a colon.

    >>> _with_colon("Recommended  #1 Spectra")
    'Recommended: #1 Spectra'
    """
    label, gap, rest = title.strip().partition("  ")
    return f"{label}: {rest.strip()}" if gap else title.strip()


def cards(screen: Screen) -> list[Card]:
    """A card for each kind of design, by the rank of its best; for each design where all are of one kind.

    In the order of rank; the page filters and highlights cards by the number of their kind.
    """
    kinds = {point.id: number for number, kind in enumerate(screen.kinds.kinds) for point in kind.points}
    return [
        Card(
            item.point,
            kinds[item.point.id],
            screen.names.design(item.point),
            tuple(_figures(screen, item.point)),
            len(item.points),
        )
        for item in screen.shown
    ]


def beyond_card(screen: Screen) -> tuple[str, tuple[tuple[str, str], ...], tuple[str, str]] | None:
    """The card of the nearest design beyond a limit: its name, its objectives, what it saves and what it exceeds.

    None where there is no such design, or where a warning stands in place of the recommendation.
    """
    item = screen.document.beyond
    if item is None or screen.warnings:
        return None
    return screen.names.design(item), tuple(_figures(screen, item)), beyond_words(screen.result, item)


def _figures(screen: Screen, point: Point | Beyond) -> Iterator[tuple[str, str]]:
    infos = screen.result.objectives
    short = short_metrics(info.name for info in infos)
    for info in infos:
        yield short[info.name], counted(point.objectives[info.name], info.unit, screen.currency)


def designs_data(screen: Screen, alternatives: Sequence[AlternativePage]) -> dict[str, Any]:
    """The data by which the page compares, filters and ranks designs.

    ``kinds`` has the points of each kind; ``designs`` by id: ``name``, ``kind``, ``limits`` as [name, share of the
    limit used, figures, slack], ``flows`` as the times of `CAUSES`, least and greatest latency.
    """
    result = screen.result
    short = short_metrics(info.name for info in result.objectives)
    kinds = {point.id: number for number, kind in enumerate(screen.kinds.kinds) for point in kind.points}
    flows = [flow.name for flow in result.space.flows]
    asked = (name for item in result.space.objectives for name in sorted(flows_in(result.space, item.metric)))
    is_ideal = result.ranking in ("", "ideal")
    return {
        "causes": CAUSES,
        "kinds": [[point.id for point in kind.points] for kind in screen.kinds.kinds],
        "names": [screen.names.kind(kind.point) or f"like #{kind.point.id}" for kind in screen.kinds.kinds],
        "groups": [[point.id for point in item.points] for item in screen.shown],
        "stands": [item.point.id for item in screen.shown],
        "short": [short[info.name] for info in result.objectives],
        "units": [display_unit(info.unit, screen.currency)[1] for info in result.objectives],
        "bounds": [_bound(screen, info.name, info.unit, alternatives) for info in result.objectives],
        "flows": flows,
        "flow": flows.index(next(asked, flows[0])) if flows else 0,
        "ranking": "" if is_ideal else result.ranking_words,
        "recommends": screen.recommends,
        "beyond": _beyond_record(screen),
        "designs": {str(item.point.id): _design(screen, item, kinds[item.point.id]) for item in alternatives},
    }


def _beyond_record(screen: Screen) -> dict[str, Any] | None:
    """The nearest design beyond a limit as a point of the plot, with the fields of `front_records`."""
    item = screen.document.beyond
    if item is None or screen.warnings:
        return None
    return drawn_figures(screen.result, item.objectives)


def _bound(screen: Screen, name: str, unit: str, alternatives: Sequence[AlternativePage]) -> dict[str, Any] | None:
    """The tightest limit on an objective: as a number in the unit shown, as text, and whether it is an upper one."""
    margins = [m for m in alternatives[0].margins if m.requirement.metric.name == name and not m.thread]
    if not margins or margins[0].requirement.implied:
        return None
    limit, factor = margins[0].limit, display_unit(unit, screen.currency)[0]
    text = counted(limit, unit, screen.currency)
    return {"value": float(limit / factor), "text": text, "upper": margins[0].requirement.is_upper}


def steps(screen: Screen) -> list[tuple[str, str]]:
    """Commands to go on with, each with what it does; ``…`` stands for the options of this question.

    Pairs of a command and its meaning, such as a sweep of the nearest limit in ms and a study of margins.
    """
    result = screen.result
    file = shlex.quote(result.problem.file)
    commands = [(f"dse solve {file} … {option}", meaning) for option, meaning in screen.changing_steps()]
    margins = screen.document.reasoner.margins(result.front[0])
    limited = [m for m in margins if m.unit == "ns" and not m.thread and m.requirement.is_upper and m.limit > 0]
    if limited and not screen.warnings:
        name, ends = limited[0].requirement.metric.name, [format_duration(limited[0].limit * n) for n in (1, 2)]
        vary = shlex.quote(f"{name}={ends[0].replace(' ', '')}..{ends[1].replace(' ', '')}")
        commands.append((f"dse sweep {file} … --vary {vary}", "what a looser limit makes possible"))
    commands.append(
        (f"dse sensitivity {file} …", f"how far inputs may move before #{result.front[0].id} violates a limit")
    )
    return commands


def _design(screen: Screen, item: AlternativePage, kind: int) -> dict[str, Any]:
    nearest: dict[tuple[str, str, bool], Margin] = {}
    for margin in item.margins:
        if margin.limit and margin.value and not margin.requirement.implied:
            nearest.setdefault((margin.requirement.metric.name, margin.thread, margin.requirement.is_upper), margin)
    margins = list(nearest.values())
    broken = [_with_waiting(limit, screen.currency) for limit in screen.waiting.broken(item.point.id)]
    rows = [*broken, *(margin_parts(margin, screen.currency) for margin in margins)]
    return {
        "name": screen.names.design(item.point),
        "kind": kind,
        "waiting": f"{broken[0][0].removesuffix(WITH_WAITING)} {broken[0][2]}" if broken else "",
        "limits": rows[:MOST_LIMITS],
        "more": max(0, len(rows) - MOST_LIMITS),
        "flows": [_flow(flow, item.analysis) for flow in item.analysis.flows],
    }


def _with_waiting(item: Broken, currency: str) -> tuple[str, float, str, str]:
    """A limit that a design violates once waiting is counted, as `margin_parts` has those that the search counts."""
    name = re.split(r" [<>=]=? ", item.requirement)[0] + WITH_WAITING
    limit = readable(item.limit, item.unit, currency)
    if item.value is None:
        return name, 2.0, f"unbounded, limit {limit}", "violated"
    value = readable(item.value, item.unit, currency).removesuffix(f" {limit.rpartition(' ')[2]}")
    return name, max(float(item.value / item.limit) if item.limit else 2.0, 1.001), f"{value} of {limit}", "violated"


def _flow(flow: FlowTable, analysis: Analysis) -> list[Any]:
    """The worst-case latency of a flow by cause, its least and its greatest value; None where it has no bound."""
    if is_unbounded(flow.max_ns):
        return [None, drawn_ns(flow.min_ns), None]
    times: dict[str, Exact] = dict.fromkeys(CAUSES, 0)
    view = View(analysis.design)
    execution = {item.name: item.worst_ns for responses in analysis.responses.values() for item in responses}
    for row in flow.rows:
        for cause, part in _by_cause(row, analysis, view, execution):
            times[cause] += part
    return [[drawn_ns(times[cause]) for cause in CAUSES], drawn_ns(flow.min_ns), drawn_ns(flow.max_ns)]


def _by_cause(row: Row, analysis: Analysis, view: View, execution: Mapping[str, Exact]) -> Iterator[tuple[str, Exact]]:
    """The greatest time of a row, by what takes it: a response time is execution, and waiting for the rest."""
    if row.max_method.startswith(JOIN_METHOD):
        yield "waiting for input", row.max_ns
    elif "sampling" in row.max_method or row.max_method == "queued":
        yield "sampling", row.max_ns
    elif row.category == "device":
        yield "devices", row.max_ns
    elif row.category == "connection":
        yield ("buses" if _is_physical(row, analysis, view) else "middleware"), row.max_ns
    else:
        own = min(execution.get(row.contributor, row.max_ns), row.max_ns)
        is_response = row.max_method == "response time"
        yield "execution", own if is_response else row.max_ns
        yield "waiting for the CPU", row.max_ns - own if is_response else 0


def _is_physical(row: Row, analysis: Analysis, view: View) -> bool:
    """Whether a connection's row is time on a physical bus."""
    space = analysis.space
    if row.medium:
        return any(bus.name == row.medium and not bus.virtual for bus in space.buses)
    item = next((item for item in space.connections if item.name == row.contributor), None)
    stack = bus_stack(space, item, view) if item is not None else ()
    return any(not space.buses[bus].virtual for bus in stack)
