"""What OSATE prints beside the actual latencies: the specified column, and its verdicts on a flow.

Source: osate.md, A2, A6 and A8: OSATE's `LatencyContributor` and `LatencyReportEntry`. Totals are compared as OSATE
prints them, in whole us.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Annotated, Literal

from dse.analysis.binding import bus_figure
from dse.analysis.latency.rows import Row, in_flow
from dse.analysis.osate.components import is_sampling, period_ns
from dse.analysis.osate.latency import FlowPosition, place_rows, place_step, places_of, since_sampling
from dse.analysis.osate.media import media, medium_ns
from dse.analysis.views import View
from dse.space.model.flows import Flow
from dse.space.model.space import Component, Space
from dse.space.model.trees import at
from dse.support.units import Exact, format_duration

CURRENT = "osate-2.19"
Range = tuple[Exact, Exact]
NOTHING: Range = (0, 0)
CARRYING = ("transmission time", "specified")
"""How OSATE finds what a carrier takes."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A message that OSATE prints about a flow.

    `severity` is the one that OSATE gives; the text names the figures that it compares.
    """

    JSON_NAME = "FlowFinding"

    severity: Annotated[Literal["error", "warning"], "How grave it is."]
    text: Annotated[str, "In words."]


def specified_rows(space: Space, flow: Flow, view: View) -> tuple[Row, ...]:
    """The rows of a flow, each with what is specified for it (`Row.specified_ns`), under OSATE's rules.

    That is the latency of the flow specification for the processing of a component, and of the bus for each carrier of
    a connection; the connection's own where they specify none, at each end, but not in 2014.
    """
    specified: list[Row] = []
    for place in places_of(space, flow):
        rows = list(place_rows(space, place, view))
        is_wire = place_step(space, place).kind == "connection"
        budgets = _of_connection(space, place, rows, view) if is_wire else _of_component(space, place, rows, view)
        specified += [replace(row, specified_ns=budget) for row, budget in zip(rows, budgets, strict=True)]
    return tuple(specified)


def _of_component(space: Space, place: FlowPosition, rows: Sequence[Row], view: View) -> list[Range]:
    return [NOTHING] * (len(rows) - 1) + [at(_component(space, place, view).latency_ns, view) or NOTHING]


def _component(space: Space, place: FlowPosition, view: View) -> Component:
    """The component at a place, with the figures that it has in this flow."""
    step = place_step(space, place)
    component = space.components[step.index]
    return in_flow(space, component, step, is_periodic=is_sampling(space, component, view))


def _of_connection(space: Space, place: FlowPosition, rows: Sequence[Row], view: View) -> list[Range]:
    wire = space.connections[place_step(space, place).index]
    carried = [item for item in media(space, wire, view) if medium_ns(space, wire, item, view)[1]]
    latencies = iter([bus_figure(space, space.buses[item.bus].latency_ns, wire, view) or NOTHING for item in carried])
    first = next(number for number, row in enumerate(rows) if row.category == "connection")
    counted = [NOTHING] * len(rows)
    if space.profile != CURRENT:  # one row for all that carries it, and nothing of its own
        ranges = list(latencies)
        counted[first] = (sum(item[0] for item in ranges), sum(item[1] for item in ranges))
        return counted
    counted = [next(latencies, NOTHING) if row.max_method in CARRYING and row.medium else NOTHING for row in rows]
    own = at(wire.latency_ns, view) or NOTHING
    least, most = (
        counted[first][end] if any(budget[end] for budget in counted) else own[end] for end in (0, 1)
    )  # fmt: skip
    counted[first] = (least, most)
    return counted


def _printed(value_ns: Exact) -> Fraction:
    """A total in whole us, half rounded up."""
    return Fraction((Fraction(value_ns) / 1000 + Fraction(1, 2)) // 1) * 1000


def _told(value_ns: Exact) -> str:
    return format_duration(value_ns)


def flow_findings(space: Space, flow: Flow, rows: Sequence[Row], view: View) -> Iterator[Finding]:
    """OSATE's errors and warnings about a flow, whose `rows` have what is specified.

    In OSATE's order: each contributor against its specification, immediate connections, totals against the required
    latency.
    """
    for row in rows:
        (least, most), name = row.specified_ns or NOTHING, row.contributor
        if row.category != "connection":
            if most and row.max_ns > most:
                yield Finding("warning", f"{name} takes {_told(row.max_ns)}, specified are at most {_told(most)}")
            if least and row.min_ns > least:
                yield Finding("warning", f"{name} takes at least {_told(row.min_ns)}, specified are {_told(least)}")
    yield from _immediate(space, flow, view)
    yield from _totals(flow, rows)


def _immediate(space: Space, flow: Flow, view: View) -> Iterator[Finding]:
    """The last element of a chain of immediate connections has to end by its deadline."""
    places = places_of(space, flow)
    for number, place in enumerate(places):
        step = place_step(space, place)
        if step.kind != "component" or step.via is None or step.unlinked:
            continue
        wire, component = space.connections[step.via], _component(space, place, view)
        leaving = [place_step(space, item).index for item in places[number + 1 : number + 2]]
        goes_on = any(space.connections[index].timing == "immediate" for index in leaving)
        samples = is_sampling(space, component, view) and wire.port in ("data", "feature")
        if wire.timing != "immediate" or goes_on or not samples:
            continue
        stated = at(component.deadline_ns, view)
        deadline = period_ns(component, view) if stated is None else stated
        since = since_sampling(space, place, view)
        own = place_rows(space, place, view)[-1].max_ns
        passed = own + (since.max_ns if since is not None else 0)
        if passed > deadline > 0:
            text = f"the immediate connections up to {component.name} end after {_told(passed)}, its deadline is"
            yield Finding("error", f"{text} {_told(deadline)}")


def _totals(flow: Flow, rows: Sequence[Row]) -> Iterator[Finding]:
    if flow.required_ns is None or not flow.required_ns[1]:
        yield Finding("warning", "no latency is specified for the flow")
        return
    low, high = flow.required_ns
    ends = [f"the minimum {_told(low)} of the flow", f"the maximum {_told(high)} of the flow"]
    actual = (_printed(sum(row.min_ns for row in rows)), _printed(sum(row.max_ns for row in rows)))
    budgets = [row.specified_ns or NOTHING for row in rows]
    specified = (_printed(sum(item[0] for item in budgets)), _printed(sum(item[1] for item in budgets)))
    for what, (least, most) in (("specified", specified), ("actual", actual)):
        if least > high:
            yield Finding("error", f"the minimum {what} total {_told(least)} exceeds {ends[1]}")
        elif least < low:
            yield Finding("warning", f"the minimum {what} total {_told(least)} is below {ends[0]}")
        if actual[1] and most > high:
            yield Finding("error", f"the maximum {what} total {_told(most)} exceeds {ends[1]}")
        if actual[1] and most - least > high - low:
            text = (
                f"the jitter of the {what} total, {_told(most - least)}, exceeds that of the flow, {_told(high - low)}"
            )
            yield Finding("warning", text)
