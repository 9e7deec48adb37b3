"""Why a problem has no design: minimal conflicts, the limits that mend it, the least to give up, and offers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Literal

from dse.analysis.bounds import Impossible
from dse.analysis.diagnosis.flow_delays import Delayed
from dse.analysis.diagnosis.lateness import Late
from dse.analysis.diagnosis.overloads import Overload
from dse.analysis.diagnosis.shortening import Shorter
from dse.analysis.latency.offset_advice import Boundary
from dse.analysis.messages.late import LateMessage
from dse.answers.base import Answer, to_file
from dse.answers.question_data import BY_WAITING, WAITING, ExplainedProblem, Origin, WaitingCounted
from dse.answers.result import csv_text
from dse.answers.tables.frames import mixed_frame
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.support.json_fields import NULL, Data, Json, Of, Unit

if TYPE_CHECKING:
    import pandas

COLUMNS = ("conflict", "kind", "text", "origin", "helps", "limit", "closest", "unit", "requirement")
Decisions = Mapping[str, str]


@dataclass(frozen=True)
class Demand:
    """A requirement, a rule or a fixed decision.

    Members of conflicts and relaxations are demands; implied limits of 100 % count as requirements.
    """

    kind: Annotated[Literal["requirement", "rule", "fixed decision"], "Which of the three."]
    text: Annotated[str, "In the words of the problem."]
    origin: Annotated[str, "Where it stands: `FILE:LINE`, or `command line`."]


@dataclass(frozen=True)
class Example:
    """A design that is named, and every demand of the question that it breaks: it meets all others.

    `overloads` are the cores that are used beyond a limit that it violates, `late` the threads that end too late in it,
    with what goes before them on their cores, and those without a bound in flows whose limits it violates; `delayed`
    says
    who waits in these, `boundaries` are the timers that read on one clock along them. `late_messages` miss limits on
    their response times. `conditions` of valid designs it would break with the fixed decisions that it violates.
    """

    design: Decisions
    breaks: tuple[Demand, ...] = ()
    overloads: tuple[Overload, ...] = ()
    late: tuple[Late, ...] = ()
    delayed: tuple[Delayed, ...] = ()
    boundaries: tuple[Boundary, ...] = ()
    shorter: tuple[Shorter, ...] = ()
    late_messages: tuple[LateMessage, ...] = ()
    conditions: tuple[str, ...] = ()
    numbered: Decisions = field(default_factory=dict)

    @property
    def shown(self) -> Decisions:
        """The decisions for readers, with the number of each identifier ``any`` where it was looked up."""
        return self.numbered or self.design

    @property
    def broken_texts(self) -> list[str]:
        """The demands that the design violates, in the user's words."""
        return [demand.text for demand in self.breaks]

    def besides(self, *expected: Demand) -> tuple[Demand, ...]:
        """The demands that the design violates beyond the expected ones.

        Demands in the order of `breaks`; an empty tuple where the design violates nothing but `expected`.
        """
        return tuple(demand for demand in self.breaks if demand not in expected)


class Why(Data):
    """The reasons why a design violates requirements."""

    overloads: Annotated[tuple[Overload, ...], "The cores and buses that it uses beyond a limit that it violates."]
    late: Annotated[
        tuple[Late, ...],
        "The threads that end too late in it, and those without a bound in flows whose limits it violates.",
    ]
    delayed: Annotated[
        tuple[Delayed, ...], "The limits on flows that it violates while threads in these wait for others."
    ]
    boundaries: Annotated[
        tuple[Boundary, ...],
        "The readers on the clock of the timer before them, along the flows whose limits it violates.",
    ]
    shorter: Annotated[tuple[Shorter, ...], "Shorter times with each of which alone all that is asked holds in it."]
    late_messages: Annotated[tuple[LateMessage, ...], "The messages that end too late in it, or wait in flows that do."]


OF_DEMAND = ("demand.kind", "demand.text", "demand.origin")
OF_EXAMPLE = (
    Of("example.design", "An example."),
    Of("example.broken_texts", "Every demand of the question that the example violates.", key="breaks"),
    Of("example.overloads", "The cores that the example uses beyond a limit that it violates."),
    Of(
        "example.late",
        "The threads that end too late in the example, and those without a bound in flows whose limits it violates.",
    ),
    Of("example.delayed", "The limits on flows that the example violates while threads in these wait for others."),
    Of(
        "example.boundaries",
        "The readers on the clock of the timer before them, along the flows whose limits the example violates.",
    ),
    Of("example.shorter", "Shorter times with each of which alone all that is asked holds in the example."),
    Of("example.late_messages", "The messages that end too late in the example, or wait in flows that do."),
    Of(
        "example.conditions",
        "The conditions of valid designs that the example would break with the fixed decisions that it violates.",
    ),
)


@dataclass(frozen=True)
class ConflictMember:
    """A member of a minimal conflict."""

    WRITTEN = (
        *OF_DEMAND,
        Of("example.design", "A design that meets all the other members.", key="without_it"),
        Of("example.broken_texts", "Every demand of the question that this design violates.", key="breaks"),
        Of(
            "example",
            "The reasons: overloads, late threads, late messages and delayed flows of the design.",
            key="why",
            kind=Why,
        ),
    )

    demand: Demand
    example: Example


@dataclass(frozen=True)
class MinimalConflict:
    """Demands that cannot hold together; without any one of them the others can.

    Each member has an example: a design that meets every other member of the conflict, which proves that the member
    matters.
    """

    WRITTEN = (Of("listed", "The demands of the conflict.", key="members"), "by_waiting")

    members: tuple[tuple[Demand, Example], ...]
    by_waiting: Annotated[bool, BY_WAITING] = True

    @property
    def listed(self) -> list[ConflictMember]:
        """The members, each with a design that meets all others."""
        return [ConflictMember(demand, example) for demand, example in self.members]


@dataclass(frozen=True)
class Relaxation:
    """The outcome of relaxing one demand alone while all others hold.

    `helps` says whether that leaves a design; `example` is one. For a requirement `limit` is its own and `closest` the
    exact one nearest to it at which there is a design (beyond it, where the `operator` is strict), both in `unit`; a
    share of a processor or a bandwidth counts in ppm. `closest` is None where giving it up does not help, where the
    response time of the threads `unbounded` has no bound even in the best design (so that no limit helps), and where
    `is_sought` is False: the time was too short to look. `thread` names the thread that alone needs so much of one
    core. `text` is the requirement as it may be written then; `overload` names the processor or bus that must be
    allowed to be overloaded for it, which alone mends a limit that is implied. `together` are the requirements of a
    limit that is stated once for several flows, processors, cores or buses: they have one limit, and move as one.
    """

    WRITTEN = (
        *OF_DEMAND,
        *(
            "helps",
            "limit",
            "closest",
            "unit",
            "beyond",
            "thread",
            "text",
            "overload",
            "unbounded",
            "together",
            "is_sought",
        ),
        *OF_EXAMPLE,
    )

    demand: Demand
    helps: Annotated[bool, "Whether a design exists when this demand alone is relaxed."]
    example: Example = field(default_factory=lambda: Example({}))
    unit: Annotated[Unit, "Unit of the figures; empty where there are none."] = ""
    limit: Annotated[Fraction | None, "The requirement's limit, in `unit`; null for what has none."] = None
    closest: Annotated[Fraction | None, "The closest limit at which there is a design; null where there is none."] = (
        None
    )
    operator: str = ""
    thread: Annotated[str, NULL, "The thread that alone needs so much of one core, where that is what counts."] = ""
    text: Annotated[
        str, NULL, "The requirement as it may be written then; null for one that is implied.", Json("requirement")
    ] = ""
    unbounded: Annotated[tuple[str, ...], "The threads whose response time has no bound even in the best design."] = ()
    is_sought: Annotated[bool, "False where the time was too short to look for `closest`.", Json("looked_for")] = True
    overload: Annotated[
        str, NULL, "The processor or bus whose `overload: allowed` it takes; null where it takes none."
    ] = ""
    together: Annotated[
        tuple[str, ...],
        "For a limit stated once for several flows, processors, cores or buses: their requirements, which are relaxed "
        "as one.",
        Json(default=[]),
    ] = ()

    @property
    def beyond(self) -> bool:
        """Whether the requirement, which is strict, holds beyond `closest` only.

        `closest` itself leaves no design then, any limit looser than it does.
        """
        return self.operator in ("<", ">")


@dataclass(frozen=True)
class GiveUp:
    """The fewest demands without which the others leave a design.

    Minimal in number; there can be other sets of equal size. The example is a design that meets all other demands.
    """

    WRITTEN = ("members", *OF_EXAMPLE)

    members: Annotated[
        tuple[Relaxation, ...], "The demands to relax, each with its closest limit if the others are dropped."
    ]
    example: Example


@dataclass(frozen=True)
class Offer:
    """The effect of further options that the file does not allow.

    `price` is in hundredths of the currency; None means that the options alone do not make the problem feasible.
    """

    texts: Annotated[tuple[str, ...], "The options, in words.", Json("options")]
    price: Annotated[int | None, "The price of the cheapest design with them; null where there is none."]
    unit: Annotated[Unit, "Unit of the price."]
    design: Annotated[Decisions, "The cheapest design with the offers."]


class Effort(Data):
    """The effort of an explanation: solver calls and wall time."""

    solver_calls: Annotated[int, "Number of solver calls."]
    wall_s: Annotated[float, "Seconds that passed."]


@dataclass(frozen=True, repr=False)
class Explanation(Answer):
    """The outcome of `dse explain`: why a problem has no design, and what mends it.

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

    FORMAT = "explanation"
    WRITTEN = (
        *("problem", "status", "complete", "left_open", "design", "conflicts", "every", "limited", "reduced"),
        *("relaxations", "give_up", "least", "impossible", "without_waiting", "excluded", "offered", "offers"),
        *(Of("effort", key="search"), "safe_bounds", "waiting"),
    )

    problem: Annotated[Origin, "Which problem was explained.", Json(kind=ExplainedProblem)]
    status: Annotated[
        Literal["feasible", "infeasible", "no structure", "incomplete"],
        "`no structure`: even without demands there is no design; `incomplete`: time ran out before it was decided.",
    ]
    currency: str
    design: Annotated[Decisions, "A design, where the problem is feasible."] = field(default_factory=dict)
    conflicts: Annotated[tuple[MinimalConflict, ...], "Minimal conflicts."] = ()
    every: Annotated[bool, "Whether these are all there are.", Json("all_conflicts")] = False
    limited: Annotated[
        bool, "Whether the number of conflicts that were asked for was reached.", Json("limit_reached")
    ] = False
    relaxations: Annotated[tuple[Relaxation, ...], "Relaxations of one demand alone."] = ()
    give_up: Annotated[GiveUp | None, "The fewest demands to relax together, where relaxing one is not enough."] = None
    least: Annotated[
        GiveUp | None,
        "Where threads need more than there is of a processor, and what may follow from that was not looked at: the "
        "fewest of the other demands that must be relaxed, each with its least change, but for the use of "
        "processors; more may have to.",
    ] = None
    impossible: Annotated[tuple[Impossible, ...], "Requirements that no design meets, as bounds alone show."] = ()
    without_waiting: Annotated[
        bool, "Whether there is no design even if no thread waited for another, where threads do."
    ] = False
    offers: Annotated[tuple[Offer, ...], "Offers and their effect."] = ()
    offered: Annotated[Sequence[str], "The options that were asked about."] = ()
    excluded: Annotated[Sequence[str], "Combinations that are no designs though nothing in the file forbids them."] = ()
    complete: Annotated[bool, "Whether nothing that was asked for is missing."] = True
    left_open: Annotated[tuple[str, ...], "Questions that were left open, in words."] = ()
    reduced: Annotated[
        tuple[Demand, ...],
        "Where time ran out: demands that have no design together, fewer of which may have none either.",
        Json("impossible_together"),
    ] = ()
    solver_calls: int = 0
    wall_s: float = 0.0
    safe_bounds: Annotated[
        Mapping[str, Sequence[str]],
        "Where all conflicts rest on response times that are safe bounds, which need not be reached: why they are, "
        "each reason with the threads. Else empty.",
    ] = field(default_factory=dict)
    waiting: Annotated[Mapping[str, list[str]], WAITING, Json(kind=WaitingCounted)] = field(default_factory=dict)

    @property
    def effort(self) -> Annotated[Explanation, Json(kind=Effort)]:
        """The effort of the explanation."""
        return self

    def with_(self, **changes: Any) -> Explanation:
        """The explanation with some of its parts replaced.

        A new object, as `dataclasses.replace` makes it; used while an explanation is put together.
        """
        return replace(self, **changes)

    @property
    def exit_code(self) -> int:
        """The exit code of the command line.

        4: infeasible, proved; 5: stopped before everything was searched; 0: feasible, nothing to explain.
        """
        if not self.complete:
            return EXIT_INCOMPLETE
        return EXIT_COMPLETE if self.status == "feasible" else EXIT_NO

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """The conflicts as CSV text: a row for each member of each; what would mend it alone beside it.

        Columns: ``conflict`` (a number), ``kind``, ``text``, ``origin``; ``helps`` (whether giving it up alone leaves a
        design), ``limit`` and ``closest`` in ``unit``, exact, and ``requirement``, as it may be written then. The last
        five are empty where that was not looked at. There are no rows where the problem has designs.
        """
        return to_file(csv_text([[*COLUMNS], *self._rows()]), path)

    def frame(self, units: str | Sequence[str] | None = None) -> pandas.DataFrame:
        """The rows of `to_csv` as a frame, with its columns: ``limit`` and ``closest`` count in the row's ``unit``.

        `units` as for `Result.frame`: rows of their kind are in that unit, which then stands in ``unit``.
        """
        rows = [dict(zip(COLUMNS, row, strict=True)) for row in self._rows()]
        return mixed_frame(COLUMNS, rows, ("limit", "closest"), units, self.currency)

    def _rows(self) -> list[list[Any]]:
        from dse.answers.forms.codec import written

        alone = {
            (text, item.demand.origin): written(Relaxation, item)
            for item in self.relaxations
            for text in item.together or (item.demand.text,)
        }
        rows: list[list[Any]] = []
        for number, conflict in enumerate(self.conflicts, start=1):
            for demand, _ in conflict.members:
                row = {"conflict": number, **alone.get((demand.text, demand.origin), {}), **vars(demand)}
                rows.append([row.get(name) for name in COLUMNS])
        return rows
