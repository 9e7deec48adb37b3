"""The analysis of one design, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING, Any

from dse.analysis.boundaries import Boundary
from dse.analysis.limits import Verdict
from dse.analysis.osate_findings import Finding
from dse.analysis.osate_load import Budget
from dse.analysis.osate_resources import ResourceUse
from dse.analysis.overheads import stated_overheads
from dse.analysis.rows import Row
from dse.analysis.scheduling import Response
from dse.analysis.views import View
from dse.errors import UsageError
from dse.records import dataclass
from dse.results.answer import Answer, With
from dse.results.contention import Contended
from dse.results.frames import unit_frame
from dse.space.trees import at
from dse.space.types import EMPTY, Design, Space
from dse.units import Exact, whole

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class FlowTable:
    """The contributor table of a flow, in ns, with its totals; `findings` are what OSATE says of it (`osate-2.19`)."""

    name: str
    rows: tuple[Row, ...]
    findings: tuple[Finding, ...] = ()

    @property
    def min_ns(self) -> Exact:
        """The minimum latency: the sum of the column."""
        return whole(sum((row.min_ns for row in self.rows), Fraction(0)))

    @property
    def max_ns(self) -> Exact:
        """The maximum latency: the sum of the column."""
        return whole(sum((row.max_ns for row in self.rows), Fraction(0)))

    @property
    def specified_ns(self) -> tuple[Exact, Exact] | None:
        """OSATE's specified totals; None where rows do not tell what is specified."""
        given = [row.specified_ns for row in self.rows]
        if None in given:
            return None
        ends = [sum((item[end] for item in given if item is not None), Fraction(0)) for end in (0, 1)]
        return whole(ends[0]), whole(ends[1])

    @property
    def jitter_ns(self) -> Exact:
        """Maximum minus minimum latency."""
        return whole(self.max_ns - self.min_ns)


@dataclass(frozen=True)
class Usage:
    """How much of a processor (ppm of one core) or bus (B/s) is used, by whom, and what it has (None: not stated).

    `busy` has the busy time of a physical bus by connection, in ppm; None where it is not computable, which
    `no_busy` explains, and for what has none.
    `cores` has the core, from 1, of each of those who use a processor with several. `payload` has what each connection
    carries over a bus with frames without these, in B/s (what OSATE counts), where `shares` are those of the wire.
    `budget` are OSATE's budgets of a bus, under its current rules and where any is stated.
    """

    name: str
    type: str
    shares: Mapping[str, Fraction]
    capacity: Fraction | None
    busy: Mapping[str, Fraction] | None = None
    no_busy: str = ""
    cores: Mapping[str, int] = field(default_factory=dict)
    payload: Mapping[str, Fraction] | None = None
    unit: str = "ppm"
    budget: Budget | None = None

    @property
    def total(self) -> Fraction:
        """The sum of the shares."""
        return sum(self.shares.values(), Fraction(0))

    @property
    def busy_total(self) -> Fraction | None:
        """The share of the time, in ppm, that a physical bus is busy; None where that is not computable."""
        return None if self.busy is None else sum(self.busy.values(), Fraction(0))

    @property
    def busy_use(self) -> Mapping[str, Any]:
        """The share of the time that a bus is busy, by connection; or why it is not known."""
        if self.busy is None:
            return {"total": None, "reason": self.no_busy or None}
        return {"unit": "ppm", "shares": self.busy, "total": self.busy_total}


@dataclass(frozen=True, repr=False)
class Analysis(Answer):
    """Everything that can be said of one design; `breaches` says why it is not valid, then the tables are empty.

    Examples
    --------
    >>> import dse
    >>> best = dse.solve("pump.yaml").front[0]
    >>> found = dse.analyse("pump.yaml", best.decisions)
    >>> [(item.requirement.text, item.holds) for item in found.verdicts][:1]
    [('jitter of sensor_to_valve <= 30 ms', True)]
    """

    FORM = "design.AnalysisForm"

    space: Space
    design: Design
    decisions: Mapping[str, str]
    flows: tuple[FlowTable, ...]
    processors: tuple[Usage, ...]
    buses: tuple[Usage, ...]
    metrics: Mapping[str, Fraction]
    metric_units: Mapping[str, str]
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...] = ()
    breaches: tuple[str, ...] = ()
    responses: Mapping[str, tuple[Response, ...]] = field(default_factory=dict)
    """By processor, where response times were asked for."""
    resources: tuple[ResourceUse, ...] = ()
    """OSATE's resource budgets, under its current rules and where anything is stated."""
    boundaries: tuple[Boundary, ...] = ()
    """Every reader on the clock of the timer before it, flow by flow."""
    contended: Contended | None = None
    """What the design keeps when response times count, where the question leaves that out."""

    @property
    def is_feasible(self) -> bool:
        """Valid, and every requirement holds."""
        return not self.breaches and all(verdict.holds for verdict in self.verdicts)

    def limits_empty_slot(self, verdict: Verdict) -> bool:
        """Whether a requirement holds because what it limits is left empty, or of a type without such a limit."""
        metric = verdict.requirement.metric
        slots = {"utilisation": self.processors, "load": self.buses, "busy": self.buses}.get(metric.kind)
        if slots is None or not verdict.holds:
            return False
        usage = slots[metric.index or 0]
        return usage.type == EMPTY or self.is_of_other_type(verdict)

    def is_of_other_type(self, verdict: Verdict) -> bool:
        """Whether a limit is implied by other types of a bus than the chosen one, which has none."""
        metric, number = verdict.requirement.metric, verdict.requirement.metric.index or 0
        if not verdict.requirement.implied or metric.kind not in ("load", "busy") or self.buses[number].type == EMPTY:
            return False
        if metric.kind == "busy":
            return not at(self.space.buses[number].exclusive, View(self.design))
        return self.buses[number].capacity is None

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The design as a frame of one row, with the columns of `Result.frame`.

        Columns: each metric as ``NAME [UNIT]`` (exact), each decision by name (text); `units` as for `Result.frame`.
        """
        columns = [*self.metrics, *self.decisions]
        row = {**{name: whole(value) for name, value in self.metrics.items()}, **self.decisions}
        return unit_frame(columns, [row] if self.metrics else [], self.metric_units, units, self.space.currency)

    def flow_frame(self, name: str, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """A flow's contributor table, in order.

        Columns: ``category``, ``contributor``, ``min_ns``, ``min_method``, ``max_ns``, ``max_method``; with `units` (as
        for `Result.frame`) the times are called ``min [ms]`` and ``max [ms]``.

        Raises
        ------
        UsageError
            when there is no such flow, or no such unit.
        """
        import pandas

        from dse.results.forms.design import Row as RowForm
        from dse.results.forms.writing import written

        table = next((table for table in self.flows if table.name == name), None)
        if table is None:
            raise UsageError(f"no flow is called {name!r}: there are {', '.join(flow.name for flow in self.flows)}")
        rows = [written(RowForm, row) for row in table.rows]
        if units is None:
            return pandas.DataFrame(rows)
        names = {"min_ns": "min", "max_ns": "max"}
        named = [{names.get(column, column): value for column, value in row.items()} for row in rows]
        return unit_frame([*dict.fromkeys(chain(*named))], named, {"min": "ns", "max": "ns"}, units)

    def _told(self) -> Mapping[str, Any]:
        return {
            "metrics": {name: (value, self.metric_units[name]) for name, value in self.metrics.items()},
            "overheads": stated_overheads(self.space, self.design),
            "response_times": {name: [_response(item) for item in found] for name, found in self.responses.items()},
        }


def _response(response: Response) -> With:
    return With(
        response,
        {
            "execution_ns": (response.best_ns, response.worst_ns),
            "switching_ns": response.task.worst_ns - response.worst_ns,
        },
    )
