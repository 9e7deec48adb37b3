"""Designs that a result lists: points of the front, further designs at or near them, designs with an option fixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from dse.analysis.diagnosis.front_verdicts import cores_of
from dse.analysis.messages.waits import named_identifiers
from dse.answers.contention_verdicts import Contended, CoreUse, core_use
from dse.answers.tables.display import counted, in_base_units
from dse.space.model.space import Design, Space
from dse.support.json_fields import NULL, WHOLE, Json, Values

if TYPE_CHECKING:
    pass


Status: TypeAlias = Literal["complete", "incomplete", "infeasible"]
Objectives: TypeAlias = Annotated[
    Values, "The figure of each objective, in the unit that `objectives` states; null where it is unbounded."
]


Metrics: TypeAlias = Annotated[
    Mapping[str, Annotated[int, WHOLE, NULL]],
    "The figure of each further metric, in the unit that `metric_units` states; null where it is unbounded.",
    Json("metrics"),
]


Decisions: TypeAlias = Annotated[
    Mapping[str, str], "The chosen option of each open decision that matters in this design."
]


class Figures:
    """The metrics of a design: as they are counted, and as they are.

    `counts` are integers in the `counting_units` of the result, as its JSON has them.
    """

    counts: Mapping[str, int]
    counting_units: Mapping[str, str]

    @property
    def metrics(self) -> Mapping[str, Fraction]:
        """Every metric in the unit that `metric_units` of the result states, as `dse.analyse` has it.

        Exact but for those that the result lists as `rounded`: these are rounded up.
        """
        return in_base_units(self.counts, self.counting_units)


@dataclass(frozen=True, repr=False)
class Point(Figures):
    """A non-dominated design: one point of a Pareto front.

    `objectives` and `counts` are exact integers by name, in the units of `Result.units`; `metrics` has each metric in
    the units of `Result.metric_units`. `decisions` names the option of each decision that the design uses. Points are
    hashable, and stay valid when a front is ranked anew: `id` does not change, `rank` does.
    """

    id: Annotated[int, "The number by which commands call it; it is the same whatever the ranking."]
    rank: Annotated[int, "Rank of the point, from 1; equally good points share a rank."]
    objectives: Objectives
    counts: Metrics
    counting_units: Mapping[str, str]
    decisions: Decisions
    design: Design
    score: Annotated[str, "Score by which the point is ranked, as text or figure."] = ""
    is_first: Annotated[
        bool,
        "False where it is not proved that of all designs with these objectives this is the first in the order of the "
        "file.",
        Json(default=True),
    ] = True

    def __hash__(self) -> int:
        """Equal points have equal ids and designs."""
        return hash((self.id, self.design))

    def __repr__(self) -> str:
        """One line: its number, rank and objectives."""
        units = self.counting_units
        figures = ", ".join(
            f"{name} {counted(value, units.get(name, ''), '').strip()}" for name, value in self.objectives.items()
        )
        return f"<Point {self.id}, rank {self.rank}: {figures}>"


@dataclass(frozen=True)
class FurtherDesign(Figures):
    """A further design at or near a point of the front.

    It has the objectives of its point, or each at most a stated share worse (`--further`, `--within`), and differs from
    the point and its other further designs in as many decisions as was found.
    """

    id: Annotated[str, "`POINT.NUMBER`, such as `3.1`: the first further design of point 3."]
    objectives: Objectives
    counts: Metrics
    counting_units: Mapping[str, str]
    decisions: Decisions
    design: Design
    dominated_by: Annotated[tuple[int, ...], "The points that are as good in every objective, and better in one."]
    different: Annotated[int, "In how many decisions it differs from its point.", Json("different_decisions")]

    def __hash__(self) -> int:
        """Equal designs have equal ids."""
        return hash((self.id, self.design))


@dataclass(frozen=True)
class FurtherDesigns:
    """The further designs of one point of the front.

    `within` is the share by which each objective may be worse than the point's; `more` tells whether others exist,
    None where the time was too short to know.
    """

    of: Annotated[int, "The point."]
    within: Annotated[Fraction, "Each objective is at most this share worse than the point's; 0: the same objectives."]
    designs: tuple[FurtherDesign, ...]
    more: Annotated[bool | None, "Whether there are others still; null where time was too short to tell."]


@dataclass(frozen=True)
class KeptBy:
    """The cores and identifiers of a design of a result, and what it keeps with contention.

    `cores` has the numbers of cores, from 1, by thread; `contention` is None where response times count in the question
    itself.
    """

    cores: Annotated[
        Mapping[str, int], "The core, from 1, of each thread with several to choose from.", Json(default={})
    ]
    core_use: Annotated[
        Mapping[str, CoreUse], "Use of each core of the processors with several cores.", Json(default={})
    ]
    identifiers: Annotated[
        Mapping[str, str], "The identifier, such as `0x10`, of each message that may have any.", Json(default={})
    ]
    contention: Annotated[
        Contended | Mapping[str, Any] | None,
        "Verdict on the design with response times, where the question leaves them out.",
        Json(default=None, kind=Contended),
    ]

    @staticmethod
    def in_design(space: Space, design: Design, contention: Contended | Mapping[str, Any] | None) -> KeptBy:
        """The cores and identifiers of a whole design, beside its verdict with contention."""
        cores = cores_of(space, design)
        named = {space.components[thread].name: core for thread, core in cores.items()}
        use = core_use(space, design) if cores else {}
        return KeptBy(named, use, named_identifiers(space, design), contention)


def with_numbers(space: Space, decisions: Mapping[str, str], design: Design) -> dict[str, str]:
    """The decisions of a design, with the number (``0xff``) of each message that takes any free identifier.

    Names of decisions to texts for tables; `decisions` itself has the option, ``any``, which is read back.
    """
    chosen = dict(decisions)
    if "any" in chosen.values():
        numbers = {f"{name}.identifier": number for name, number in named_identifiers(space, design).items()}
        chosen |= {name: number for name, number in numbers.items() if name in chosen}
    return chosen


def numbered_texts(space: Space, decisions: Mapping[str, str], design: Design) -> dict[str, str]:
    """The decisions of a design for readers: ``any (0xff)`` where a message takes any free identifier.

    Names of decisions to texts, in the order of `decisions`; for what is read back, `decisions` itself has the options.
    """
    numbered = with_numbers(space, decisions, design)
    return {name: text if numbered[name] == text else f"{text} ({numbered[name]})" for name, text in decisions.items()}


@dataclass(frozen=True)
class ListedPoint:
    """A point of the front as JSON has it: the design that stands for it.

    With the cores of its threads, what it meets when threads wait for the CPU, and the point that it is
    near-identical to.
    """

    JSON_NAME = "Point"
    WRITTEN = (
        *("point.id", "point.rank", "point.score", "point.objectives", "point.counts", "point.decisions"),
        *("point.is_first", "variant_of", "kept.cores", "kept.core_use", "kept.identifiers", "kept.contention"),
        "reasons",
    )

    point: Point
    kept: KeptBy
    variant_of: Annotated[
        int | None, "The better-ranked point that this one is near-identical to.", Json(default=None, kind=int)
    ]
    reasons: Annotated[
        Mapping[str, str] | None,
        "In the JSON of a report: why it is on the front, in sentences.",
        Json(default={}, kind=Mapping[str, str]),
    ] = None


@dataclass(frozen=True)
class ListedDesign:
    """A further design at or near a point."""

    JSON_NAME = "FurtherDesign"
    WRITTEN = (
        *("item.id", "item.objectives", "item.counts", "item.decisions", "item.dominated_by", "item.different"),
        *("kept.cores", "kept.core_use", "kept.identifiers", "kept.contention"),
    )

    item: FurtherDesign
    kept: KeptBy


@dataclass(frozen=True)
class ListedDesigns:
    """The further designs of one point as JSON has them, each with its cores and what it meets with waiting."""

    JSON_NAME = "FurtherDesigns"
    WRITTEN = ("found.of", "found.within", "designs", "found.more")

    found: FurtherDesigns
    designs: Annotated[
        tuple[ListedDesign, ...],
        "The designs that were found, chosen to differ from the point and from one another.",
    ]


@dataclass(frozen=True)
class FurtherAsked:
    """The question for further designs: their number, and the points."""

    count: Annotated[int, "Number of further designs for each point."]
    within: Annotated[Fraction | None, "Within which share of each objective; null: with the same objectives."]
    points: Annotated[tuple[int, ...], "Points for which further designs were searched."]


@dataclass(frozen=True)
class InsistedPoint(Figures):
    """A design on the front with some option fixed that is not on the whole front.

    Objectives and metrics are integers in counting units, as those of a `Point`.
    """

    WRITTEN = ("id", "objectives", "counts", "decisions")

    id: Annotated[int, "Id of the design; ids go on after those of the points of `front`."]
    objectives: Objectives
    counts: Metrics
    counting_units: Mapping[str, str]
    decisions: Decisions
    design: Design


@dataclass(frozen=True)
class InsistedOption:
    """The front with an option of a decision fixed."""

    decision: Annotated[str, "The decision."]
    option: Annotated[str, "The option that is insisted on."]
    status: Annotated[
        Status,
        "`complete`: the front is proved; `incomplete`: stopped, these points are on it, others may be; `infeasible`: "
        "proved that no design has the option.",
    ]
    front: Annotated[tuple[int, ...], "The points, by their ids in `front` and in `insisting.points`."]


@dataclass(frozen=True)
class Insisting:
    """The price of insisting: for each option of each open decision the front with that option fixed.

    A designer who wants a certain computer reads there what that costs in each objective. Points that are on the whole
    front are named by their id, others are listed in `points`.
    """

    points: Annotated[tuple[InsistedPoint, ...], "The designs that only these fronts have."]
    options: Annotated[tuple[InsistedOption, ...], "Every option of every open decision, in the order of the problem."]

    @property
    def is_complete(self) -> bool:
        """Whether every option's front is proved.

        True also where an option is proved infeasible.
        """
        return all(item.status != "incomplete" for item in self.options)
