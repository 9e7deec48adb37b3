"""The form of ``dse-result/1``: what ``dse solve``, ``dse report`` and ``dse solve --robust`` write."""

from __future__ import annotations

from typing import Annotated, Literal

from dse.answers.forms.base import (
    Count,
    Counts,
    Decisions,
    Figure,
    Form,
    Include,
    Metrics,
    Number,
    Objective,
    Of,
    Settings,
    Unit,
    Values,
    field,
)


class Question(Settings):
    """The question as it was really asked: that of the file, with what the command line or a caller added."""

    INHERITED_BEHIND = "fixed"

    requirements: list[str] = field("The requirements, in the order of the file; then those that were added.")
    implied: list[str] = field("The limits that nobody states: 100 % of cores, bandwidths and exclusive buses.")
    rules: list[str] = field("The rules, likewise.")
    objectives: list[str] = field("The objectives with their senses, such as `minimise price`.")
    fixed: Decisions = field("The decisions that were fixed, each with its option.")
    robust: bool = field("Whether every requirement had to hold for all values that `uncertainty` states.")


class SolvedProblem(Form):
    """Which problem was solved, and what was asked of it."""

    name: str = field("The name that the problem gives itself.")
    file: str = field("The path of its file, as it was given.", pattern=r"^[^\x00]*$")
    sha256: str = field("The SHA-256 of the file.")
    includes: list[Include] = field("The files that it includes.")
    identity: str = field(
        "A digest of what the problem means, the same whatever its layout and comments; results of earlier versions "
        "have none.",
        earlier=None,
    )
    effective: Question = field("The question as it was asked.")
    question: str = field("A digest of meaning and question together; regions belong to one of them only.")


class Broken(Form):
    """A requirement that a design misses when response times count."""

    requirement: str = field("The requirement in the words of the problem.")
    value: Figure | None = field("What the design has, in `unit`; null where it is unbounded.")
    limit: Figure = field("The limit, in `unit`.")
    unit: Unit = field("What the two figures count.")
    unbounded: list[str] = field("The threads in it whose response time has no bound.")


class Contention(Form):
    """What a design keeps when response times count."""

    status: Literal["kept", "broken", "not checked"] = field("Whether it keeps every requirement then.")
    broken: list[Broken] = field("What it misses then.")


class CoreUse(Form):
    """How the cores of a processor are used."""

    partition: Literal["stated", "found", "none", "undecided"] = field(
        "`stated` where every core is stated or decided; of threads without one whether some way to put them on cores "
        "keeps what is required of each core: found, none (proved absent), or undecided."
    )
    used: list[Figure] = field("What each core carries, in ppm of it, core 1 first.")


class NamedDesign(Form):
    """A design with its figures."""

    objectives: Values = field(
        "The figure of each objective, in the unit that `objectives` states; null where it is unbounded."
    )
    metrics: Annotated[Metrics, Of("counts")] = field(
        "The figure of each further metric, in the unit that `metric_units` states; null where it is unbounded."
    )
    decisions: Decisions = field("The chosen option of each open decision that matters in this design.")


class ListedDesign(NamedDesign):
    """A design with its figures, and what becomes of its threads."""

    cores: dict[str, int] = field("The core, from 1, of each thread with several to choose from.", default={})
    core_use: dict[str, CoreUse] = field("How each processor with several cores is used, core by core.", default={})
    contention: Contention = field(
        "What it keeps when response times count, where the question leaves them out.", default=None
    )


class Point(ListedDesign):
    """A point of the front: the design that stands for it."""

    INHERITED_BEHIND = "score"
    LAST = ("cores", "core_use", "contention", "reasons")

    id: int = field("The number by which commands call it; it is the same whatever the ranking.")
    rank: int = field("Its rank, from 1; equally good points share one.")
    score: str = field("What the rank is founded on, in words or figures.")
    is_first: bool = field(
        "False where it is not proved that of all designs with these objectives this is the first in the order of the "
        "file.",
        default=True,
    )
    variant_of: int = field("The better-ranked point that this one is near-identical to.", default=None)
    reasons: dict[str, str] = field("In the JSON of a report: why it is on the front, in sentences.", default={})


class FurtherDesign(ListedDesign):
    """A further design at or near a point."""

    INHERITED_BEHIND = "id"
    LAST = ("cores", "core_use", "contention")

    id: str = field("`POINT.NUMBER`, such as `3.1`: the first further design of point 3.")
    dominated_by: list[int] = field("The points that are as good in every objective, and better in one.")
    different_decisions: Annotated[int, Of("different")] = field("In how many decisions it differs from its point.")


class FurtherDesigns(Form):
    """The further designs of a point."""

    of: int = field("The point.")
    within: Figure = field("Each objective is at most this share worse than the point's; 0: the same objectives.")
    designs: list[FurtherDesign] = field(
        "The designs that were found, chosen to differ from the point and from one another."
    )
    more: bool | None = field("Whether there are others still; null where time was too short to tell.")


class FurtherAsked(Form):
    """How many further designs were asked for, and where."""

    count: int = field("How many of each point.")
    within: Figure | None = field("Within which share of each objective; null: with the same objectives.")
    points: list[int] = field("Of which points.")


class Member(Form):
    """A requirement or rule of a conflict."""

    text: str = field("In the words of the problem.")
    origin: str = field("Where it stands: `FILE:LINE`, or `command line`.")
    limit: Figure | None = field("Its limit, in `unit`; null for a rule.")
    closest: Figure | None = field("The closest limit with which there is a design while all else holds, if any.")
    miss: Figure | None = field("How far `closest` is beyond `limit`.")
    unit: Unit = field("What the figures count; empty where there are none.")
    thread: str | None = field("The thread that alone needs so much of one core, where that is what counts.")
    unbounded: list[str] = field(
        "The threads whose response time has no bound even in the best design, so that no limit helps.", default=[]
    )
    looked_for: Annotated[bool, Of("is_sought")] = field(
        "False where the time was too short to look for `closest`.", default=True
    )
    overload: str = field("The processor or bus whose `overload: allowed` the closest limit takes.", default="")


class Conflict(Form):
    """Requirements and rules that cannot hold together, although without any one of them the others can."""

    members: list[Member] = field("They, in the order of the problem.")
    by_waiting: bool = field(
        "False where there is no design even if each response time were as long as the job takes alone; true where it "
        "takes that threads wait for each other, as far as is known.",
        earlier=True,
    )


class Search(Form):
    """What the search did; the only part that differs between two runs of one question."""

    solver_calls: int = field("How often the solver was called.")
    wall_s: Number = field("Seconds that passed.")
    space_size: int = field("The number of designs that the decisions make at most.")
    solver: str = field("The solver and its version.")
    workers: int = field("How many solvers worked side by side.")
    seed: int = field("The seed.")


class Ranking(Form):
    """A way of ranking."""

    method: str = field("The method, as `--rank-by` names it.")
    words: str = field("The method with its parameters, in words.")


class NominalState(Form):
    """How far the nominal front of a robust question is proved."""

    status: Literal["complete", "incomplete", "infeasible"] = field("As for the result.")
    unexplored: list[Counts] = field("As for the result.")
    refuted: list[Counts] = field("As for the result.")
    potential: Counts = field("As for the result.")
    ranking: Ranking = field("As for the result.")


class Cost(Form):
    """The best value of an objective on two fronts."""

    nominal: Count | None = field("On the nominal front; null where that is empty, or the best is unbounded.")
    robust: Count | None = field("On the robust front; null where that is empty, or the best is unbounded.")


class Lost(Form):
    """Why a design of the nominal front is not robust."""

    nominal_id: Annotated[int, Of("point")] = field("The id of the point on the nominal front.")
    requirement: str = field("A requirement that it breaks somewhere in the stated ranges.")
    worst: Annotated[Figure | None, Of("value")] = field(
        "What it has where it misses the limit most, in `unit`; null where it is unbounded."
    )
    limit: Figure = field("The limit there, in `unit`.")
    unit: Unit = field("What the two figures count.")
    inputs: dict[str, Figure] = field("The values of the inputs there, in base units (ns, B, bit/s) or as factors.")


class Robust(Form):
    """What a robust front costs against the nominal one."""

    inputs: dict[str, str] = field("What may vary, and what the problem states of it, in words.")
    currency: Annotated[str, Of("robust.space.currency")] = field("The currency of prices.")
    corners: int = field("How many pairs of a requirement and values stand for all values in between.")
    nominal_front: list[Point] = field("The front without uncertainty.")
    nominal: NominalState = field("How far that front is proved.")
    price: dict[str, Cost] = field("The best value of each objective on both fronts.")
    kept: list[int] = field("The points of the robust front that are on the nominal front too.")
    entered: list[int] = field("The points that only the robust front has.")
    lost: Annotated[list[Lost], Of("failures")] = field(
        "The points of the nominal front that are not robust, each with what it breaks."
    )
    unjudged: list[int] = field("Points of the nominal front that the time was too short to judge.", default=[])


class InsistedPoint(NamedDesign):
    """A design on the front with some option fixed that is not on the whole front."""

    INHERITED_BEHIND = "id"

    id: int = field("Its number, after those of the points of `front`.")


class InsistedOption(Form):
    """The front with an option of a decision fixed."""

    decision: str = field("The decision.")
    option: str = field("The option that is insisted on.")
    status: Literal["complete", "incomplete", "infeasible"] = field(
        "`complete`: the front is proved; `incomplete`: stopped, these points are on it, others may be; `infeasible`: "
        "proved that no design has the option."
    )
    front: list[int] = field("The points, by their ids in `front` and in `insisting.points`.")


class Insisting(Form):
    """The price of insisting: for each option of each open decision the front with that option fixed."""

    points: list[InsistedPoint] = field("The designs that only these fronts have.")
    options: list[InsistedOption] = field("Every option of every open decision, in the order of the problem.")


class UnusedChoice(Form):
    """A fixed decision that changes nothing in some points."""

    decision: str = field("The decision.")
    option: str = field("The option at which it was fixed.")
    points: list[int] = field("The ids of the points that have no use for it.")


class ResultForm(Form):
    """The outcome of `dse solve`: the front, its proof, and the question that was asked."""

    format: Literal["dse-result/1"] = field("The name of this format.")
    semantics: int = field("The version of what the figures mean; a result of another one is refused.")
    problem: SolvedProblem = field("Which problem was solved.")
    status: Literal["complete", "incomplete", "infeasible"] = field(
        "`complete`: the front is proved; `incomplete`: the search was stopped, points may be missing in `unexplored`; "
        "`infeasible`: proved that there is no design."
    )
    under_way: bool = field(
        "True where the search went on when this was written, in case the run is lost: points are as the solver "
        "claims them, with objectives and decisions and no other figure; `--resume` looks at them first.",
        default=False,
    )
    ranking: Ranking = field("How the points are ranked.")
    objectives: list[Objective] = field("The objectives, in the order of the question.")
    metric_units: Annotated[dict[str, Unit], Of("counting_units")] = field("What the figures of each metric count.")
    rounded: list[str] = field("The metrics whose figures are rounded up to their unit.", default=[])
    front: list[Point] = field("The non-dominated designs, in the order of rank.")
    unused: list[UnusedChoice] = field(
        "Decisions that were fixed, though some points have no use for them.", default=[]
    )
    unexplored: list[Counts] = field(
        "Regions that may still hold better designs: everything better than these exclusive bounds in every objective."
    )
    refuted: list[Counts] = field("Regions, bounded likewise, that are proved to hold no design.")
    potential: Counts = field("The best value of each objective that may still be unexplored.")
    conflicts: list[Conflict] = field("Of an infeasible problem: what clashes.")
    give_up: list[Member] = field(
        "Where no single member mends it: the fewest that do together, each with its closest limit. A limit that is "
        "stated once for several flows, processors, cores or buses is one, in the words in which it is stated.",
        default=[],
    )
    others: list[FurtherDesigns] = field("Further designs at or near points, where they were asked for.")
    others_asked: FurtherAsked = field("Which further designs were asked for.", default=None)
    insisting: Insisting = field("What each option costs, where that was asked for.", default=None)
    search: Search = field("What the search did.")
    files: Annotated[dict[str, str], Of("problem.texts")] = field(
        "The text of the problem file and of what it includes, by name, so that the result can be worked with where "
        "they are not.",
        earlier=None,
    )
    robust: Robust = field("Of a robust question: the nominal front, and what the difference costs.", default=None)
