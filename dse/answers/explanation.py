"""Why a problem has no design: minimal conflicts, the limits that mend it, the least to give up, and offers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal

from dse.analysis.bounds import Impossible
from dse.analysis.diagnosis.flow_delays import Delayed
from dse.analysis.diagnosis.lateness import Late
from dse.analysis.diagnosis.overloads import Overload
from dse.analysis.diagnosis.shortening import Shorter
from dse.analysis.latency.offset_advice import Boundary
from dse.answers.base import Answer, With
from dse.answers.result import Origin, csv_text
from dse.answers.tables.frames import mixed_frame
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO

if TYPE_CHECKING:
    import pandas

COLUMNS = ("conflict", "kind", "text", "origin", "helps", "limit", "closest", "unit", "requirement")
Decisions = Mapping[str, str]


@dataclass(frozen=True)
class Demand:
    """A requirement, a rule or a fixed decision in the user's words, with the place where it stands."""

    kind: Literal["requirement", "rule", "fixed decision"]
    text: str
    origin: str


@dataclass(frozen=True)
class Example:
    """A design that is named, and every demand of the question that it breaks: it meets all others.

    `overloads` are the cores that are used beyond a limit that it breaks, `late` the threads that end too late in it,
    with what goes before them on their cores, and those without a bound in flows whose limits it breaks; `delayed` says
    who waits in these, `boundaries` are the timers that read on one clock along them.
    """

    design: Decisions
    breaks: tuple[Demand, ...] = ()
    overloads: tuple[Overload, ...] = ()
    late: tuple[Late, ...] = ()
    delayed: tuple[Delayed, ...] = ()
    boundaries: tuple[Boundary, ...] = ()
    shorter: tuple[Shorter, ...] = ()

    @property
    def broken_texts(self) -> list[str]:
        """What it breaks, in the user's words."""
        return [demand.text for demand in self.breaks]

    def besides(self, *expected: Demand) -> tuple[Demand, ...]:
        """What it breaks beyond what is expected of it."""
        return tuple(demand for demand in self.breaks if demand not in expected)


@dataclass(frozen=True)
class MinimalConflict:
    """Demands that cannot hold together; beside each, a design that meets all the others of the conflict.

    `by_waiting` is False where there is no design even if each response time were as long as the job takes alone; True
    where it takes that threads wait for each other, as far as is known.
    """

    members: tuple[tuple[Demand, Example], ...]
    by_waiting: bool = True

    @property
    def listed(self) -> list[With]:
        """The members as JSON has them."""
        return [
            With(demand, {"without_it": example.design, "breaks": example.broken_texts, "why": example})
            for demand, example in self.members
        ]


@dataclass(frozen=True)
class Relaxation:
    """What happens when one demand alone gives, and all others hold.

    `helps` says whether that leaves a design; `example` is one. For a requirement `limit` is its own and `closest` the
    exact one nearest to it at which there is a design (beyond it, where the `operator` is strict), both in `unit`; a
    share of a processor or a bandwidth counts in ppm. `closest` is None where giving it up does not help, where the
    response time of the threads `unbounded` has no bound even in the best design (so that no limit helps), and where
    `is_sought` is False: the time was too short to look. `thread` names the thread that alone needs so much of one
    core. `text` is the requirement as it may be written then; `overload` names the processor or bus that must be
    allowed to be overloaded for it, which alone mends a limit that is implied. `together` are the requirements of a
    limit that is stated once for several flows, processors, cores or buses: they have one limit, and move as one.
    """

    demand: Demand
    helps: bool
    example: Example = field(default_factory=lambda: Example({}))
    unit: str = ""
    limit: Fraction | None = None
    closest: Fraction | None = None
    operator: str = ""
    thread: str = ""
    text: str = ""
    unbounded: tuple[str, ...] = ()
    is_sought: bool = True
    overload: str = ""
    together: tuple[str, ...] = ()

    @property
    def beyond(self) -> bool:
        """Whether the requirement, which is strict, holds beyond the closest limit only."""
        return self.operator in ("<", ">")


@dataclass(frozen=True)
class GiveUp:
    """The fewest demands without which the others leave a design; each with its limit while the rest is given up."""

    members: tuple[Relaxation, ...]
    example: Example


@dataclass(frozen=True)
class Offer:
    """What offered options would change; `price` (in `unit`) is that of the cheapest feasible design, if any."""

    texts: tuple[str, ...]
    price: int | None
    unit: str
    design: Decisions


@dataclass(frozen=True, repr=False)
class Explanation(Answer):
    """The outcome of `dse.explain`.

    `status` is ``feasible`` (`design` meets everything), ``infeasible`` (proved, and explained), ``no structure``
    (proved: even without requirements, rules and fixed decisions there is no design) or ``incomplete`` (time ran out
    before feasibility was decided). `excluded` says which combinations of options are no designs though nothing in the
    file forbids them. `complete` says that nothing which was asked for is missing, `every` that
    `conflicts` are all there are. Where time ran out, `left_open` says in words what was not looked at, and `reduced`,
    if not empty, are demands that have no design together (proved), fewer of which may have none either. Where all
    conflicts rest on response times `safe_bounds` says why these need not be reached, each reason with its threads.
    `without_waiting` says whether there is none either if no thread waited for another, where threads do.
    `impossible` are the requirements that no design meets as bounds of their figures show, without a search. `least` is
    there where threads need more than there is of a processor, and not every conflict was asked for: the fewest of the
    demands that were looked at that must be given up, each with the least that it must move, but for the use of
    processors. What may follow from the overload was not looked at then, so that more may have to give, and by more.

    Examples
    --------
    >>> import dse
    >>> dse.explain("pump.yaml").status
    'feasible'
    """

    FORM = "verdicts.ExplanationForm"

    problem: Origin
    status: Literal["feasible", "infeasible", "no structure", "incomplete"]
    currency: str
    design: Decisions = field(default_factory=dict)
    conflicts: tuple[MinimalConflict, ...] = ()
    every: bool = False
    limited: bool = False
    relaxations: tuple[Relaxation, ...] = ()
    give_up: GiveUp | None = None
    least: GiveUp | None = None
    impossible: tuple[Impossible, ...] = ()
    without_waiting: bool = False
    offers: tuple[Offer, ...] = ()
    offered: Sequence[str] = ()
    excluded: Sequence[str] = ()
    complete: bool = True
    left_open: tuple[str, ...] = ()
    reduced: tuple[Demand, ...] = ()
    solver_calls: int = 0
    wall_s: float = 0.0
    safe_bounds: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def with_(self, **changes: Any) -> Explanation:
        """The explanation with some of its parts replaced."""
        return replace(self, **changes)

    @property
    def exit_code(self) -> int:
        """What the command line answers with."""
        if not self.complete:
            return EXIT_INCOMPLETE
        return EXIT_COMPLETE if self.status == "feasible" else EXIT_NO

    def to_csv(self) -> str:
        """The conflicts as CSV text: a row for each member of each; what would mend it alone beside it.

        Columns: ``conflict`` (a number), ``kind``, ``text``, ``origin``; ``helps`` (whether giving it up alone leaves a
        design), ``limit`` and ``closest`` in ``unit``, exact, and ``requirement``, as it may be written then. The last
        five are empty where that was not looked at. There are no rows where the problem has designs.
        """
        return csv_text([[*COLUMNS], *self._rows()])

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The rows of `to_csv` as a frame, with its columns: ``limit`` and ``closest`` count in the row's ``unit``.

        `units` as for `Result.frame`: rows of their kind are in that unit, which then stands in ``unit``.
        """
        rows = [dict(zip(COLUMNS, row, strict=True)) for row in self._rows()]
        return mixed_frame(COLUMNS, rows, ("limit", "closest"), units, self.currency)

    def _rows(self) -> list[list[Any]]:
        from dse.answers.forms.verdicts import Relaxation as RelaxationForm
        from dse.answers.forms.writing import written

        alone = {
            (text, item.demand.origin): written(RelaxationForm, item)
            for item in self.relaxations
            for text in item.together or (item.demand.text,)
        }
        rows: list[list[Any]] = []
        for number, conflict in enumerate(self.conflicts, start=1):
            for demand, _ in conflict.members:
                row = {"conflict": number, **alone.get((demand.text, demand.origin), {}), **vars(demand)}
                rows.append([row.get(name) for name in COLUMNS])
        return rows
